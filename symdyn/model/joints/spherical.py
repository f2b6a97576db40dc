"""The spherical joint: any rotation about a common point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from symdyn.model.joints.base import Joint, JointMotion, turn
from symdyn.model.orientation import EulerAngles, EulerParameters
from symdyn.spatial.vectors import cross, zeros

Orientation = EulerAngles | EulerParameters
_AXES = ((1, 0, 0), (0, 1, 0), (0, 0, 1))


class Spherical(Joint):
    """coordinates = the three Euler angles (rad) in the order of the sequence, or the four Euler parameters.

    orientation   EulerAngles(sequence), whose speeds are the angles' derivatives, or EulerParameters(), whose
                  speeds are the angular velocity, rad/s, in the axes of the child's joint frame
    See Joint for the frames.
    """

    kind = "spherical"

    def __init__(self, name: str, parent: Any, child: Any, coordinates: Sequence[Any] | None = None,
                 orientation: Orientation | None = None, speeds: Sequence[Any] | None = None,
                 parent_point: Any = (0, 0, 0), child_point: Any = (0, 0, 0), parent_rotation: Any = None,
                 child_rotation: Any = None) -> None:
        self.orientation, faults = taken_orientation(name, orientation)
        self.coordinate_units = orientation_units(self.orientation)
        super().__init__(name, parent, child, coordinates, speeds, parent_point, child_point, parent_rotation,
                         child_rotation)
        self.faults.extend(faults)

    @property
    def n_speeds(self) -> int:
        return 3

    def motion(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> JointMotion:
        R, S_w, c_w = rotation_motion(algebra, self.orientation, s, sd)
        S, c = zeros(6, 3), zeros(6)
        S[:3, :] = S_w
        c[:3] = c_w
        return JointMotion(R, zeros(3), S, c)

    def rates(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> list[Any]:
        return rotation_rates(self.orientation, s, sd)


def taken_orientation(name: str, orientation: Any) -> tuple[Orientation, list[str]]:
    """The orientation (default: EulerAngles("ZYX")), and faults if it is none."""
    if orientation is None or isinstance(orientation, (EulerAngles, EulerParameters)):
        return orientation or EulerAngles("ZYX"), []
    return EulerAngles("ZYX"), [f"joint {name!r}: orientation is {orientation!r}; pass sd.EulerAngles('ZYX') or another "
                                "sequence, or sd.EulerParameters()"]


def orientation_units(orientation: Orientation) -> tuple[str, ...]:
    """Units of the rotation's coordinates."""
    return ("rad",) * 3 if isinstance(orientation, EulerAngles) else ("1",) * 4


def rotation_motion(algebra: Any, orientation: Orientation, s: Sequence[Any],
                    sd: Sequence[Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """R (3, 3), the angular motion subspace (3, 3) and its velocity product (3,), child axes."""
    if isinstance(orientation, EulerParameters):
        return parameters_rotation(s), np.array(_AXES, dtype=object), zeros(3)
    # Three revolute joints in a row; omega and its bias are carried from each to the next.
    R, S, omega, bias = np.array(_AXES, dtype=object), zeros(3, 3), zeros(3), zeros(3)
    for k, axis in enumerate(orientation.axes):
        e = np.array(_AXES[axis], dtype=object)
        R_k = turn(algebra, e, s[k])
        R = R @ R_k
        S = R_k.T @ S
        S[:, k] = e
        carried = R_k.T @ omega
        bias = R_k.T @ bias + cross(carried, e * sd[k])
        omega = carried + e * sd[k]
    return R, S, bias


def parameters_rotation(p: Sequence[Any]) -> np.ndarray:
    """R = E Ebar^T for Euler parameters p = (theta0, theta1, theta2, theta3) of unit norm."""
    e0, e1, e2, e3 = p
    return np.array([
        [1 - 2 * (e2 * e2 + e3 * e3), 2 * (e1 * e2 - e0 * e3), 2 * (e1 * e3 + e0 * e2)],
        [2 * (e1 * e2 + e0 * e3), 1 - 2 * (e1 * e1 + e3 * e3), 2 * (e2 * e3 - e0 * e1)],
        [2 * (e1 * e3 - e0 * e2), 2 * (e2 * e3 + e0 * e1), 1 - 2 * (e1 * e1 + e2 * e2)]], dtype=object)


def rotation_rates(orientation: Orientation, s: Sequence[Any], sd: Sequence[Any]) -> list[Any]:
    """Derivatives of the rotation's coordinates: p_dot = Ebar^T omega / 2 with omega in child axes."""
    if isinstance(orientation, EulerAngles):
        return list(sd)
    e0, e1, e2, e3 = s
    x, y, z = sd
    return [-(e1 * x + e2 * y + e3 * z) / 2, (e0 * x - e3 * y + e2 * z) / 2, (e3 * x + e0 * y - e1 * z) / 2,
            (-e2 * x + e1 * y + e0 * z) / 2]
