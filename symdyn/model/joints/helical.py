"""The helical joint: a screw."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.model.joints.axis import AxisJoint
from symdyn.model.joints.base import JointMotion, turn
from symdyn.shown import shown
from symdyn.spatial.vectors import zeros

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, Matrix, Scalar, Vector


class Helical(AxisJoint):
    """Rotation by `coordinate` (rad) about `axis` and translation by pitch * coordinate along it.

    axis    a vector in the joint frame, default z; see Joint
    pitch   m/rad, a number or an expression of parameters: the advance of one full turn over 2 pi; positive: a
            right-handed screw
    See Joint for the frames.

    >>> system = sd.System("one")
    >>> joint = sd.Helical("joint", system.ground, system.add_body("body", mass=1), pitch=0.01)
    >>> joint.coordinates
    (q_joint,)
    """

    kind = "helical"
    coordinate_units = ("rad",)
    default_axis = (0, 0, 1)

    def __init__(self, name: str, parent: BodyOrName, child: BodyOrName, coordinate: Scalar | None = None, axis: Vector = ...,
                 pitch: Scalar | None = None, speed: sp.Symbol | None = None, parent_point: Vector = (0, 0, 0),
                 child_point: Vector = (0, 0, 0), parent_rotation: Matrix | None = None,
                 child_rotation: Matrix | None = None) -> None:
        super().__init__(name, parent, child, coordinate, axis, speed, parent_point, child_point, parent_rotation,
                         child_rotation)
        self.pitch = self.faults.expression(pitch, f"joint {shown(name)}: pitch (m/rad)")

    @property
    def constants(self) -> list[sp.Expr]:
        return [*super().constants, self.pitch]

    def motion(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> JointMotion:
        axis, pitch = algebra.constants(self.axis), algebra.expression(self.pitch)
        S = zeros(6, 1)
        S[:3, 0] = axis
        S[3:, 0] = axis * pitch
        return JointMotion(turn(algebra, axis, s[0]), axis * (pitch * s[0]), S, zeros(6))
