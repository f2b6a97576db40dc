"""Rotations: matrices, Euler angles, axis and angle, Euler parameters, angular velocity; numbers and SymPy expressions alike.

R takes components in b to components in n. Numbers and NumPy arrays in, NumPy arrays out, with any leading axes; anything of
SymPy in, SymPy matrices out. Angles are in rad. Invalid arguments raise RotationError (GimbalLock, NotARotation, ZeroAxis,
NotNormalized) or ArgumentError.

Tolerances, all on numbers:
    a rotation           entries of |R^T R - 1| up to 1e-9, and det R > 0
    a unit vector        length within 1e-9 of 1: Euler parameters (then divided by their norm), axes with unit=True
    gimbal lock of R     nearer than 1e-15 rad, or than twice the largest entry of |R^T R - 1|: a family of angles
    gimbal lock of G^-1  sine or cosine of the second angle below 1e-8: more than half of the digits of the rates are lost
    angle 0 and pi       nearer than 1e-15 rad: axis or sign are said to be arbitrary
"""

from symdyn.model.orientation import SEQUENCES
from symdyn.rotation.determination import EulerSolutions, to_euler
from symdyn.rotation.euler import euler_rates, euler_rates_inverse, from_euler
from symdyn.rotation.matrices import about, from_axis_angle, infinitesimal, skew, vee
from symdyn.rotation.parameters import (
    E,
    E_bar,
    compose,
    from_parameters,
    inverse,
    normalized,
    omega_from_parameters,
    parameters_of_axis_angle,
    parameters_rate,
    to_parameters,
)
from symdyn.rotation.proper import nearest
from symdyn.rotation.sequence import Lock, gimbal_lock
from symdyn.rotation.theorem import AxisAngle, axis_angle, axis_angle_of_parameters
from symdyn.rotation.velocity import angular_velocity

__all__ = [
    "SEQUENCES", "AxisAngle", "E", "E_bar", "EulerSolutions", "Lock", "about", "angular_velocity", "axis_angle",
    "axis_angle_of_parameters", "compose", "euler_rates", "euler_rates_inverse", "from_axis_angle", "from_euler",
    "from_parameters", "gimbal_lock", "infinitesimal", "inverse", "nearest", "normalized", "omega_from_parameters",
    "parameters_of_axis_angle", "parameters_rate", "skew", "to_euler", "to_parameters", "vee",
]
