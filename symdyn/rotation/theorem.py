"""Euler's theorem: every rotation is one about an axis by an angle; axis and angle from R and from Euler parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import sympy as sp

from symdyn.rotation.algebra import Expressions, algebra_of
from symdyn.rotation.parameters import to_parameters, unit_parameters
from symdyn.rotation.proper import as_floats, only_floats, rotation_matrix
from symdyn.rotation.zero import vanishes

if TYPE_CHECKING:
    from symdyn.given import Matrix, Vector

# Angles this near to 0 or pi, rad, are that: R does not tell them apart.
ROUNDING = 1e-15


class AxisAngle(NamedTuple):
    """An axis (3,) of length 1, whose components in n and b are the same, and an angle, rad, in [0, pi].

    `.note` says what is arbitrary: the axis at angle 0, its sign at angle pi.

    >>> turned = sd.rotation.axis_angle(sd.rotation.about("Y", 0.25))
    >>> turned.axis, round(float(turned.angle), 12)
    (array([0., 1., 0.]), 0.25)
    """

    axis: Any
    angle: Any

    @property
    def note(self) -> str:
        """A sentence on what is arbitrary of axis and angle; with leading axes, of how many rotations.

        >>> sd.rotation.axis_angle(np.eye(3)).note
        'the angle is 0: there is no rotation, and the axis is arbitrary'
        """
        if isinstance(self.angle, (np.ndarray, float)):
            angle = np.asarray(self.angle)
            zero, half = int((abs(angle) <= ROUNDING).sum()), int((abs(angle - np.pi) <= ROUNDING).sum())
            of = f" (of {zero} of {angle.size} rotations)" if angle.ndim else "", f" (of {half} of {angle.size} rotations)"
            said = [_AT_ZERO + of[0]] * bool(zero) + [_AT_PI + (of[1] if angle.ndim else "")] * bool(half)
        else:
            said = [_AT_ZERO] * vanishes(self.angle) + [_AT_PI] * vanishes(self.angle - sp.pi)
        return "; ".join(said) or "the axis is determined (the opposite axis goes with the opposite angle)"

    def __repr__(self) -> str:
        return f"axis {self.axis}, angle {self.angle} rad: {self.note}"


_AT_ZERO = "the angle is 0: there is no rotation, and the axis is arbitrary"
_AT_PI = "the angle is pi: the sign of the axis is arbitrary"


def axis_angle(R: Matrix) -> AxisAngle:
    """(axis, angle) of a rotation R (3, 3): unit vector (3,) and rad in [0, pi], with a `.note` on what is arbitrary.

    Numbers may have leading axes. At angle 0 the axis is arbitrary, and "X" is given; at pi its sign is. Numbers go by the
    Euler parameters and keep their digits at every angle. Expressions with symbols:
    the angle is atan2(|w|, trace R - 1) and the axis w / |w| with skew(w) = R - R^T, which holds within (0, pi); if R is
    symmetric for all values of its symbols, the angle is 0 or pi.
    Raises NotARotation if |R^T R - 1| of numbers has an entry above 1e-9, det R < 0, or R is not (3, 3).
    Source: lecture, chapter 4.4.

    >>> axis, angle = sd.rotation.axis_angle([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    >>> np.round(axis * np.sqrt(3), 12), round(float(np.degrees(angle)), 9)
    (array([1., 1., 1.]), 120.0)
    """
    algebra = algebra_of(R)
    R = rotation_matrix(algebra, R)
    if only_floats(algebra, R):
        axis, angle = axis_angle(as_floats(R))
        return AxisAngle(sp.Matrix(axis.tolist()), sp.Float(angle))
    if not isinstance(algebra, Expressions):
        return axis_angle_of_parameters(to_parameters(R))
    w = sp.Matrix([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    if not all(vanishes(component) for component in w):
        length = sp.sqrt(sum(component**2 for component in w))
        return AxisAngle(w / length, sp.atan2(length, R.trace() - 1))
    return _symbolic(to_parameters(R))


def axis_angle_of_parameters(p: Vector) -> AxisAngle:
    """(axis, angle) of Euler parameters (4,): unit vector (3,) and rad in [0, pi], with a `.note` on what is arbitrary.

    Numbers may have leading axes. p and -p give the same. Expressions with symbols: angle 2 atan2(|v|, theta0) in [0, 2 pi]
    and axis v / |v|, v = (theta1, theta2, theta3).
    Raises NotNormalized. Source: lecture, chapter 4.5.

    >>> axis, angle = sd.rotation.axis_angle_of_parameters([0.6, 0.0, 0.8, 0.0])
    >>> axis, round(float(angle), 6)
    (array([0., 1., 0.]), 1.85459)
    """
    algebra = algebra_of(p)
    p = unit_parameters(algebra, p)
    if isinstance(algebra, Expressions):
        return _symbolic(p)
    p = np.where(p[..., :1] < 0, -p, p)
    v = p[..., 1:]
    length = np.hypot(np.hypot(v[..., 0], v[..., 1]), v[..., 2])
    turned = length > 0
    axis = np.where(turned[..., None], v, [1.0, 0.0, 0.0]) / np.where(turned, length, 1.0)[..., None]
    angle = 2 * np.arctan2(length, p[..., 0])
    return AxisAngle(axis + 0.0, angle if angle.ndim else float(angle))


def _symbolic(p: Any) -> AxisAngle:
    theta0, v = p[0], p[1:, :]
    if all(vanishes(component) for component in v):
        return AxisAngle(sp.Matrix([1, 0, 0]), sp.S.Zero)
    if theta0.is_number and theta0.evalf(30) < 0:
        theta0, v = -theta0, -v
    length = sp.sqrt(sum(component**2 for component in v))
    return AxisAngle(v / length, sp.pi if vanishes(theta0) else 2 * sp.atan2(length, theta0))
