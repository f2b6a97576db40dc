"""Reference frames, points in them, and what moves a rigid body: kinematics and dynamics written in any frame."""

from __future__ import annotations

from symdyn.frames.body import Body
from symdyn.frames.frame import Frame
from symdyn.frames.numbers import numbers
from symdyn.frames.parts import AccelerationParts, InertialForces, VelocityParts
from symdyn.frames.point import Point
from symdyn.frames.rates import rate
from symdyn.frames.rigid_body import (
    ForceSystem,
    angular_momentum,
    center_of_mass,
    equivalent_force_system,
    force_equation,
    inertia_about,
    inertia_about_com,
    kinetic_energy,
    moment_equation,
    planar_force_equation,
    planar_moment_equation,
    point_inertia,
    rotated_inertia,
)
from symdyn.frames.tidy import tidy
from symdyn.frames.vector import Vector

__all__ = [
    "AccelerationParts", "Body", "ForceSystem", "Frame", "InertialForces", "Point", "Vector", "VelocityParts", "angular_momentum",
    "center_of_mass", "equivalent_force_system", "force_equation", "inertia_about", "inertia_about_com", "kinetic_energy",
    "moment_equation", "numbers", "planar_force_equation", "planar_moment_equation", "point_inertia", "rate", "rotated_inertia",
    "tidy",
]
