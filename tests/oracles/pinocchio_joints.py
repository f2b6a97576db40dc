"""symdyn's joints as rows of Pinocchio's, with massless bodies between.

The row of a joint has symdyn's speeds one by one: a planar joint is two slides and a turn, Euler angles are three turns, a
free joint is three slides in parent axes and a ball. Only the coordinates of balls are converted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from symdyn.model.joints import (
    Cylindrical,
    Fixed,
    Free,
    Helical,
    Joint,
    Planar,
    Prismatic,
    Revolute,
    Spherical,
    Universal,
)
from symdyn.model.orientation import EulerAngles, EulerParameters

UNIT = np.eye(3)


class CannotExpress(Exception):
    """Pinocchio has no counterpart for something in the model; the message says for what."""


def row(joint: Joint, array: Callable[[Any], np.ndarray]) -> list[Any]:
    """The joints of Pinocchio that a joint is, first to last; `array` gives a matrix of expressions in numbers.

    Raises CannotExpress for one that has no counterpart with the same speeds.
    """
    def axis(matrix: Any) -> np.ndarray:
        found = array(matrix).ravel()
        return found / np.linalg.norm(found)

    slides = [pin.JointModelPX(), pin.JointModelPY(), pin.JointModelPZ()]
    match joint:
        case Fixed():
            return []
        case Revolute():
            return [pin.JointModelRevoluteUnaligned(axis(joint.axis))]
        case Prismatic():
            return [pin.JointModelPrismaticUnaligned(axis(joint.axis))]
        case Helical():
            return [pin.JointModelHelicalUnaligned(axis(joint.axis), float(array([[joint.pitch]])[0, 0]))]
        case Cylindrical():
            return [pin.JointModelRevoluteUnaligned(axis(joint.axis)), pin.JointModelPrismaticUnaligned(axis(joint.axis))]
        case Universal():
            return [pin.JointModelRevoluteUnaligned(axis(a)) for a in joint.axes]
        case Planar():
            return [*slides[:2], pin.JointModelRZ()]
        case Spherical():
            return turns(joint.orientation)
        case Free() if joint.body_velocity and joint.orientation.angular_velocity:
            return [pin.JointModelFreeFlyer()]
        case Free() if not joint.body_velocity:
            return [*slides, *turns(joint.orientation)]
    raise CannotExpress(f"joint {joint.name!r} ({joint.kind}) has no counterpart in Pinocchio with the same speeds")


def conversion(joint: Joint, places: Sequence[int]) -> Callable[[np.ndarray], np.ndarray]:
    """From symdyn's q to Pinocchio's coordinates of a joint, which are at these places of q."""
    at = list(places)
    orientation = getattr(joint, "orientation", None)
    if orientation is None or not orientation.angular_velocity:
        return lambda q: q[at]
    n = len(at) - (4 if isinstance(orientation, EulerParameters) else 3)
    return lambda q: np.concatenate([q[at[:n]], ball(orientation, q[at[n:]])])


def turns(orientation: Any) -> list[Any]:
    """Three turns whose speeds are the derivatives of Euler angles, or a ball whose speeds are the angular velocity."""
    if orientation.angular_velocity:
        return [pin.JointModelSpherical()]
    letters = {"X": pin.JointModelRX, "Y": pin.JointModelRY, "Z": pin.JointModelRZ}
    return [letters[letter]() for letter in orientation.sequence]


def ball(orientation: Any, s: np.ndarray) -> np.ndarray:
    """(x, y, z, w) of a rotation; symdyn's Euler parameters have w first."""
    if isinstance(orientation, EulerParameters):
        return s[[1, 2, 3, 0]]
    assert isinstance(orientation, EulerAngles)
    R = UNIT
    for axis, angle in zip(orientation.axes, s, strict=True):
        R = R @ pin.AngleAxis(angle, UNIT[axis]).matrix()
    return np.array(pin.Quaternion(R).coeffs())
