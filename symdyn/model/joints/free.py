"""The free joint: six degrees of freedom."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from symdyn.model.joints.base import Joint, JointMotion
from symdyn.model.joints.spherical import (
    Orientation,
    orientation_units,
    rotation_motion,
    rotation_rates,
    taken_orientation,
)
from symdyn.spatial.vectors import zeros


class Free(Joint):
    """coordinates = [x, y, z (m, parent axes), then the rotation's: Euler angles or Euler parameters].

    orientation   as for Spherical; speeds = [x_dot, y_dot, z_dot, then the rotation's speeds]
    See Joint for the frames.
    """

    kind = "free"

    def __init__(self, name: str, parent: Any, child: Any, coordinates: Sequence[Any] | None = None,
                 orientation: Orientation | None = None, speeds: Sequence[Any] | None = None,
                 parent_point: Any = (0, 0, 0), child_point: Any = (0, 0, 0), parent_rotation: Any = None,
                 child_rotation: Any = None) -> None:
        self.orientation, faults = taken_orientation(name, orientation)
        self.coordinate_units = ("m", "m", "m", *orientation_units(self.orientation))
        super().__init__(name, parent, child, coordinates, speeds, parent_point, child_point, parent_rotation,
                         child_rotation)
        self.faults.extend(faults)

    @property
    def n_speeds(self) -> int:
        return 6

    def motion(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> JointMotion:
        R, S_w, c_w = rotation_motion(algebra, self.orientation, s[3:], sd[3:])
        S, c = zeros(6, 6), zeros(6)
        S[:3, 3:] = S_w
        S[3:, :3] = R.T
        c[:3] = c_w
        return JointMotion(R, np.array(list(s[:3]), dtype=object), S, c)

    def rates(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> list[Any]:
        return [*sd[:3], *rotation_rates(self.orientation, s[3:], sd[3:])]
