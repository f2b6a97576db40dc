"""The spherical joint: any rotation about a common point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.model.joints.base import Joint, JointMotion
from symdyn.model.joints.rotation import (
    Orientation,
    named_speeds,
    orientation_units,
    rotation_motion,
    rotation_rates,
    symbols_only,
    taken_orientation,
)
from symdyn.model.orientation import EulerAngles
from symdyn.spatial.vectors import zeros

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, Matrix, Scalar, Vector


class Spherical(Joint):
    """coordinates = the three Euler angles (rad) in the order of the sequence, or the four Euler parameters.

    orientation   EulerAngles(sequence), the default "ZYX", whose speeds are the angles' derivatives;
                  EulerAngles(sequence, speeds="body") or EulerParameters(), whose speeds are the angular velocity, rad/s, in
                  the axes of the child's joint frame: omega_x_NAME, omega_y_NAME, omega_z_NAME unless named otherwise
    See Joint for the frames.

    >>> system = sd.System("one")
    >>> joint = sd.Spherical("joint", system.ground, system.add_body("body", mass=1))
    >>> joint.coordinates
    (q_joint_1, q_joint_2, q_joint_3)
    """

    kind = "spherical"

    def __init__(self, name: str, parent: BodyOrName, child: BodyOrName, coordinates: Sequence[Scalar] | None = None,
                 orientation: Orientation | None = None, speeds: Sequence[sp.Symbol] | None = None,
                 parent_point: Vector = (0, 0, 0), child_point: Vector = (0, 0, 0), parent_rotation: Matrix | None = None,
                 child_rotation: Matrix | None = None) -> None:
        self.orientation, faults = taken_orientation(name, orientation, EulerAngles("ZYX"))
        self.coordinate_units = orientation_units(self.orientation)
        super().__init__(name, parent, child, coordinates, speeds, parent_point, child_point, parent_rotation,
                         child_rotation)
        self.faults.extend(faults)

    @property
    def speed_units(self) -> tuple[str, ...]:
        return ("rad/s",) * 3

    @property
    def symbols_only(self) -> str:
        return symbols_only(self.orientation)

    def default_speeds(self) -> tuple[sp.Symbol | None, ...]:
        return named_speeds("omega", self.name) if self.orientation.angular_velocity else super().default_speeds()

    def motion(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> JointMotion:
        R, S_w, c_w = rotation_motion(algebra, self.orientation, s, sd)
        S, c = zeros(6, 3), zeros(6)
        S[:3, :] = S_w
        c[:3] = c_w
        return JointMotion(R, zeros(3), S, c)

    def rates(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> list[Any]:
        return rotation_rates(algebra, self.orientation, self.name, s, sd)
