"""Joint frames turned so that the joint's axis is a coordinate axis, where it is given in numbers."""

from __future__ import annotations

import copy
from typing import Any

import sympy as sp

from symdyn.model.joints import Joint
from symdyn.model.joints.base import IDENTITY
from symdyn.model.symbols import flat


def along_coordinate_axis(joint: Joint) -> tuple[Joint, sp.ImmutableMatrix]:
    """The joint with its axis along z of a turned joint frame, and the turn A (3, 3): new to old joint components.

    A joint without an axis, with an axis along a coordinate, or with a symbolic one stays as it is (A = 1). A turn about z
    has zeros that Rodrigues' formula about a general axis has not; A is constant and multiplied into constants.
    """
    axis = getattr(joint, "axis", None)
    if axis is None or not all(e.is_number for e in flat(axis)) or sum(e != 0 for e in flat(axis)) == 1:
        return joint, IDENTITY
    x, y, _ = axis
    across = sp.sqrt(x * x + y * y) if (x, y) != (0, 0) else sp.S.One
    first = sp.Matrix([-y, x, 0]) / across
    A = sp.ImmutableMatrix(sp.Matrix.hstack(first, sp.Matrix(axis).cross(first), sp.Matrix(axis)))
    turned: Any = copy.copy(joint)
    turned.axis = sp.ImmutableMatrix([0, 0, 1])
    return turned, A
