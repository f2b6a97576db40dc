"""The universal (Cardan) joint: two rotations, the second about an axis that the first has turned."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.model.joints.base import Joint, JointMotion, numeric, turn
from symdyn.model.symbols import flat
from symdyn.shown import shown
from symdyn.spatial.vectors import cross, dot, zeros

if TYPE_CHECKING:
    import sympy as sp

    from symdyn.given import BodyOrName, Matrix, Scalar, Vector


class Universal(Joint):
    """coordinates = [first angle, second angle] (rad), R = R_1 R_2; `axes` are two vectors in the joint frame.

    See Joint for the frames.

    >>> system = sd.System("one")
    >>> joint = sd.Universal("joint", system.ground, system.add_body("body", mass=1))
    >>> joint.coordinates
    (q_joint_1, q_joint_2)
    """

    kind = "universal"
    coordinate_units = ("rad", "rad")

    def __init__(self, name: str, parent: BodyOrName, child: BodyOrName, coordinates: Sequence[Scalar] | None = None,
                 axes: Sequence[Vector] = ((1, 0, 0), (0, 1, 0)), speeds: Sequence[sp.Symbol] | None = None,
                 parent_point: Vector = (0, 0, 0), child_point: Vector = (0, 0, 0), parent_rotation: Matrix | None = None,
                 child_rotation: Matrix | None = None) -> None:
        super().__init__(name, parent, child, coordinates, speeds, parent_point, child_point, parent_rotation,
                         child_rotation)
        if not isinstance(axes, (list, tuple, np.ndarray)) or len(np.shape(axes) if isinstance(axes, np.ndarray) else axes) != 2 \
                or len(axes) != 2:
            self.faults.append(f"joint {shown(name)} (universal) takes 2 axes, found {shown(axes)}")
            axes = ((1, 0, 0), (0, 1, 0))
        first, second = self.axes = (self._axis(axes[0], "first axis"), self._axis(axes[1], "second axis"))
        if not self.faults and abs(abs(numeric(dot(flat(first), flat(second)))) - 1) < 1e-9:
            self.faults.append(f"joint {shown(name)} (universal): its two axes are parallel; pass axes at an angle, or use "
                               "Revolute")

    def motion(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> JointMotion:
        first, second = (algebra.constants(axis) for axis in self.axes)
        R2 = turn(algebra, second, s[1])
        S, c = zeros(6, 2), zeros(6)
        S[:3, 0] = R2.T @ first
        S[:3, 1] = second
        c[:3] = cross(S[:3, 0] * sd[0], second * sd[1])
        return JointMotion(turn(algebra, first, s[0]) @ R2, zeros(3), S, c)
