"""Arguments and results of an element of load at its body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from symdyn.spatial.vectors import zeros

Wrench = tuple[np.ndarray, np.ndarray]


class Site(Protocol):
    """Pose and motion of a body, on the scalars of the algebra.

    R, p         (3, 3) body axes to n-frame; (3,) origin of the body, n-frame, m
    omega, v     (3,) angular velocity, and velocity of the origin, body axes
    gravity      (3,) acceleration of gravity, n-frame
    angles       phi, theta, psi: roll, pitch, yaw of R = R_z(psi) R_y(theta) R_x(phi); the body's own coordinates where a joint
                 with the ground has them (`angles_given`)
    rotation_vector   (3,) axis times angle of R, the same in both frames; the angle below pi
    """

    algebra: Any

    @property
    def angles_given(self) -> bool: ...

    @property
    def R(self) -> np.ndarray: ...

    @property
    def p(self) -> np.ndarray: ...

    @property
    def omega(self) -> np.ndarray: ...

    @property
    def v(self) -> np.ndarray: ...

    @property
    def gravity(self) -> np.ndarray: ...

    @property
    def angles(self) -> Sequence[Any]: ...

    @property
    def rotation_vector(self) -> np.ndarray: ...


@dataclass(frozen=True)
class Validity:
    """A value that is looked at after a simulation and in statics.

    message   what it means if the value is below `least` or above `most`; {value} stands for the number found
    summed    whether its integral over the time of a motion is looked at in place of the value; statics leaves it out
    """

    label: str
    value: Any
    least: float
    most: float
    message: str
    summed: bool = False


def nothing() -> Wrench:
    """No force and no moment."""
    return zeros(3), zeros(3)


@dataclass(frozen=True)
class Action:
    """Wrenches (f in N, n in N m about the body's origin, body axes), potential energy (J) and validity checks.

    elastic   minus the gradient of the potential; other: what does work
    """

    elastic: Wrench = field(default_factory=nothing)
    other: Wrench = field(default_factory=nothing)
    potential: Any = 0
    validity_checks: tuple[Validity, ...] = ()
