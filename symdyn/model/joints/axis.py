"""What joints of one degree of freedom along or about an axis share."""

from __future__ import annotations

from typing import Any

from symdyn.model.joints.base import Joint


class AxisJoint(Joint):
    """A joint with one coordinate and `axis`, a vector in the joint frame; see Joint for the frames."""

    default_axis: tuple[int, int, int] = (0, 0, 1)

    def __init__(self, name: str, parent: Any, child: Any, coordinate: Any = None, axis: Any = ..., speed: Any = None,
                 parent_point: Any = (0, 0, 0), child_point: Any = (0, 0, 0), parent_rotation: Any = None,
                 child_rotation: Any = None) -> None:
        coordinates, speeds = (None if value is None else (value,) for value in (coordinate, speed))
        super().__init__(name, parent, child, coordinates, speeds, parent_point, child_point, parent_rotation,
                         child_rotation)
        self.axis = self._axis(self.default_axis if axis is ... else axis)
