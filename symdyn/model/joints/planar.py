"""The planar joint: two translations in a plane and the rotation about its normal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.model.joints.base import Joint, JointMotion, turn
from symdyn.spatial.vectors import zeros

if TYPE_CHECKING:
    import sympy as sp

    from symdyn.given import BodyOrName, Matrix, Scalar, Vector


class Planar(Joint):
    """coordinates = [x (m), y (m), theta (rad)] in the x-y plane of the joint frame on the parent.

    See Joint for the frames.

    >>> system = sd.System("one")
    >>> joint = sd.Planar("joint", system.ground, system.add_body("body", mass=1))
    >>> joint.coordinates
    (q_joint_1, q_joint_2, q_joint_3)
    """

    kind = "planar"
    coordinate_units = ("m", "m", "rad")

    def __init__(self, name: str, parent: BodyOrName, child: BodyOrName, coordinates: Sequence[Scalar] | None = None,
                 speeds: Sequence[sp.Symbol] | None = None, parent_point: Vector = (0, 0, 0), child_point: Vector = (0, 0, 0),
                 parent_rotation: Matrix | None = None, child_rotation: Matrix | None = None) -> None:
        super().__init__(name, parent, child, coordinates, speeds, parent_point, child_point, parent_rotation,
                         child_rotation)

    def motion(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> JointMotion:
        R = turn(algebra, (0, 0, 1), s[2])
        S = zeros(6, 3)
        S[3:, 0] = R.T[:, 0]
        S[3:, 1] = R.T[:, 1]
        S[2, 2] = 1
        return JointMotion(R, np.array([s[0], s[1], 0], dtype=object), S, zeros(6))
