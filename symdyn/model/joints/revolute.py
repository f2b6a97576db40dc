"""The revolute joint: one rotation about an axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from symdyn.model.joints.axis import AxisJoint
from symdyn.model.joints.base import JointMotion, turn
from symdyn.spatial.vectors import zeros


class Revolute(AxisJoint):
    """Rotation by `coordinate` (rad) about `axis`, a vector in the joint frame, default z; see Joint for the frames.

    >>> system = sd.System("one")
    >>> joint = sd.Revolute("joint", system.ground, system.add_body("body", mass=1), axis=[0, 0, 1])
    >>> joint.coordinates
    (q_joint,)
    """

    kind = "revolute"
    coordinate_units = ("rad",)
    default_axis = (0, 0, 1)

    def motion(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> JointMotion:
        axis = algebra.constants(self.axis)
        S = zeros(6, 1)
        S[:3, 0] = axis
        return JointMotion(turn(algebra, axis, s[0]), zeros(3), S, zeros(6))
