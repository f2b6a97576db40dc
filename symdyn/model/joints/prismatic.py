"""The prismatic joint: one translation along an axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from symdyn.model.joints.axis import AxisJoint
from symdyn.model.joints.base import JointMotion
from symdyn.spatial.vectors import identity, zeros


class Prismatic(AxisJoint):
    """Translation by `coordinate` (m) along `axis`, a vector in the joint frame, default x; see Joint for the frames.

    >>> system = sd.System("one")
    >>> joint = sd.Prismatic("joint", system.ground, system.add_body("body", mass=1), axis=[1, 0, 0])
    >>> joint.coordinates
    (q_joint,)
    """

    kind = "prismatic"
    coordinate_units = ("m",)
    default_axis = (1, 0, 0)

    def motion(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> JointMotion:
        axis = algebra.constants(self.axis)
        S = zeros(6, 1)
        S[3:, 0] = axis
        return JointMotion(identity(), axis * s[0], S, zeros(6))
