"""The cylindrical joint: translation along and rotation about one axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from symdyn.model.joints.base import Joint, JointMotion, turn
from symdyn.spatial.vectors import zeros

if TYPE_CHECKING:
    import sympy as sp

    from symdyn.given import BodyOrName, Matrix, Scalar, Vector


class Cylindrical(Joint):
    """coordinates = [angle (rad), distance (m)] about and along `axis`; see Joint for the frames.

    >>> system = sd.System("one")
    >>> joint = sd.Cylindrical("joint", system.ground, system.add_body("body", mass=1))
    >>> joint.coordinates
    (q_joint_1, q_joint_2)
    """

    kind = "cylindrical"
    coordinate_units = ("rad", "m")

    def __init__(self, name: str, parent: BodyOrName, child: BodyOrName, coordinates: Sequence[Scalar] | None = None,
                 axis: Vector = (0, 0, 1), speeds: Sequence[sp.Symbol] | None = None, parent_point: Vector = (0, 0, 0),
                 child_point: Vector = (0, 0, 0), parent_rotation: Matrix | None = None,
                 child_rotation: Matrix | None = None) -> None:
        super().__init__(name, parent, child, coordinates, speeds, parent_point, child_point, parent_rotation,
                         child_rotation)
        self.axis = self._axis(axis)

    def motion(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> JointMotion:
        axis = algebra.constants(self.axis)
        S = zeros(6, 2)
        S[:3, 0] = axis
        S[3:, 1] = axis
        return JointMotion(turn(algebra, axis, s[0]), axis * s[1], S, zeros(6))
