"""The free joint: six degrees of freedom."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.model.joints.base import Joint, JointMotion
from symdyn.model.joints.rotation import (
    Orientation,
    named_speeds,
    orientation_units,
    rotation_matrix,
    rotation_motion,
    rotation_rates,
    symbols_only,
    taken_orientation,
)
from symdyn.model.orientation import EulerAngles
from symdyn.shown import shown
from symdyn.spatial.vectors import cross, identity, vector, zeros

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, Matrix, Scalar, Vector


class Free(Joint):
    """coordinates = [x, y, z (m, parent axes), then the rotation's: Euler angles or Euler parameters].

    speeds = [three of the child frame's origin, then the rotation's three]
    orientation   as for Spherical; with velocity="body" the default is EulerAngles("ZYX", speeds="body")
    velocity      "parent": the origin's speeds are x_dot, y_dot, z_dot; "body": its velocity, m/s, in the axes of the
                  child's joint frame, v_x_NAME, v_y_NAME, v_z_NAME unless named otherwise. With the angular velocity as the
                  rotation's speeds a free body's mass matrix is then constant, and the joint's forces are the force at this
                  origin and the moment about it, both in the child's axes.
    See Joint for the frames.

    >>> system = sd.System("one")
    >>> joint = sd.Free("joint", system.ground, system.add_body("body", mass=1))
    >>> joint.coordinates
    (q_joint_1, q_joint_2, q_joint_3, q_joint_4, q_joint_5, q_joint_6)
    """

    kind = "free"

    def __init__(self, name: str, parent: BodyOrName, child: BodyOrName, coordinates: Sequence[Scalar] | None = None,
                 orientation: Orientation | None = None, speeds: Sequence[sp.Symbol] | None = None,
                 parent_point: Vector = (0, 0, 0), child_point: Vector = (0, 0, 0), parent_rotation: Matrix | None = None,
                 child_rotation: Matrix | None = None, velocity: str = "parent") -> None:
        self.body_velocity = isinstance(velocity, str) and velocity == "body"
        default = EulerAngles("ZYX", "body" if self.body_velocity else "rates")
        self.orientation, faults = taken_orientation(name, orientation, default)
        self.coordinate_units = ("m", "m", "m", *orientation_units(self.orientation))
        super().__init__(name, parent, child, coordinates, speeds, parent_point, child_point, parent_rotation,
                         child_rotation)
        self.faults.extend(faults)
        if not isinstance(velocity, str) or velocity not in ("parent", "body"):
            self.faults.append(f"joint {shown(name)}: velocity is {shown(velocity)}; pass 'parent' (derivatives of x, y, z) or "
                               "'body' "
                               "(components in the axes of the child's joint frame)")

    @property
    def speed_units(self) -> tuple[str, ...]:
        return ("m/s",) * 3 + ("rad/s",) * 3

    @property
    def symbols_only(self) -> str:
        if self.body_velocity:
            return ("with velocity='body' every coordinate must be a symbol; use velocity='parent' and Euler angles with "
                    "speeds='rates' for a prescribed motion")
        return symbols_only(self.orientation)

    def default_speeds(self) -> tuple[sp.Symbol | None, ...]:
        rates = super().default_speeds()
        linear = named_speeds("v", self.name) if self.body_velocity else rates[:3]
        return (*linear, *(named_speeds("omega", self.name) if self.orientation.angular_velocity else rates[3:]))

    def motion(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> JointMotion:
        R, S_w, c_w = rotation_motion(algebra, self.orientation, s[3:], sd[3:])
        S, c = zeros(6, 6), zeros(6)
        S[:3, 3:] = S_w
        S[3:, :3] = identity() if self.body_velocity else R.T
        c[:3] = c_w
        if self.body_velocity:
            # d_dot = R v, so that R^T d_ddot = v_dot + omega x v.
            c[3:] = cross(S_w @ vector(*sd[3:]), sd[:3])
        return JointMotion(R, vector(*s[:3]), S, c)

    def rates(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> list[Any]:
        turning = rotation_rates(algebra, self.orientation, self.name, s[3:], sd[3:])
        if not self.body_velocity:
            return [*sd[:3], *turning]
        return [*(rotation_matrix(algebra, self.orientation, s[3:]) @ np.array(list(sd[:3]), dtype=object)), *turning]
