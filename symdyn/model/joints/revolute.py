"""The revolute joint: one rotation about an axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from symdyn.model.joints.base import Joint, JointMotion, turn
from symdyn.spatial.vectors import zeros


class Revolute(Joint):
    """Rotation by `coordinate` (rad) about `axis`, a unit vector in the joint frame; see Joint for the frames."""

    kind = "revolute"
    coordinate_units = ("rad",)

    def __init__(self, name: str, parent: Any, child: Any, coordinate: Any, axis: Any = (0, 0, 1), speed: Any = None,
                 parent_point: Any = (0, 0, 0), child_point: Any = (0, 0, 0), parent_rotation: Any = None,
                 child_rotation: Any = None) -> None:
        super().__init__(name, parent, child, (coordinate,), None if speed is None else (speed,), parent_point,
                         child_point, parent_rotation, child_rotation)
        self.axis = self._axis(axis)

    def motion(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> JointMotion:
        axis = algebra.constants(self.axis)
        S = zeros(6, 1)
        S[:3, 0] = axis
        return JointMotion(turn(algebra, axis, s[0]), zeros(3), S, zeros(6))


