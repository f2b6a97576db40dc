"""Common part of joints with three rotational degrees of freedom, however their orientation is described."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy as sp

from symdyn.model.joints.euler_angles import angles_motion, angles_rates, angles_rotation
from symdyn.model.orientation import EulerAngles, EulerParameters
from symdyn.model.symbols import Speed
from symdyn.shown import shown
from symdyn.spatial.vectors import identity, zeros

Orientation = EulerAngles | EulerParameters


def taken_orientation(name: str, orientation: Any, default: EulerAngles) -> tuple[Orientation, list[str]]:
    """The orientation, and faults if it is none."""
    if orientation is None or isinstance(orientation, (EulerAngles, EulerParameters)):
        return orientation or default, []
    return default, [f"joint {shown(name)}: orientation is {shown(orientation)}; pass sd.EulerAngles('ZYX') or another "
                     "sequence, or "
                     "sd.EulerParameters()"]


def orientation_units(orientation: Orientation) -> tuple[str, ...]:
    """Units of the rotation's coordinates."""
    return ("rad",) * 3 if isinstance(orientation, EulerAngles) else ("1",) * 4


def symbols_only(orientation: Orientation) -> str:
    """Why coordinates must be symbols, and what else to do; "" where they need not."""
    if isinstance(orientation, EulerParameters):
        return "with Euler parameters every coordinate must be a symbol; use Euler angles for a prescribed motion"
    if orientation.angular_velocity:
        return ("with its angular velocity as speeds every coordinate must be a symbol; use "
                f"EulerAngles({shown(orientation.sequence)}, speeds='rates') for a prescribed motion")
    return ""


def named_speeds(letter: str, name: str) -> tuple[sp.Symbol, ...]:
    """Three speeds of a joint, one for each axis."""
    return tuple(Speed(f"{letter}_{axis}_{name}") for axis in "xyz")


def rotation_matrix(algebra: Any, orientation: Orientation, s: Sequence[Any]) -> np.ndarray:
    """R (3, 3), child to parent components."""
    if isinstance(orientation, EulerParameters):
        return parameters_rotation(s)
    return angles_rotation(algebra, orientation, s)


def rotation_motion(algebra: Any, orientation: Orientation, s: Sequence[Any],
                    sd: Sequence[Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """R (3, 3), the angular motion subspace (3, 3) and its velocity product (3,), child axes."""
    if not orientation.angular_velocity:
        assert isinstance(orientation, EulerAngles)
        return angles_motion(algebra, orientation, s, sd)
    return rotation_matrix(algebra, orientation, s), identity(), zeros(3)


def rotation_rates(algebra: Any, orientation: Orientation, name: str, s: Sequence[Any], sd: Sequence[Any]) -> list[Any]:
    """Derivatives of the rotation's coordinates from its speeds; `name` of the joint for the message at gimbal lock."""
    if isinstance(orientation, EulerParameters):
        return parameters_rates(s, sd)
    return angles_rates(algebra, orientation, name, s, sd) if orientation.angular_velocity else list(sd)


def parameters_rotation(p: Sequence[Any]) -> np.ndarray:
    """R = E Ebar^T for Euler parameters p = (theta0, theta1, theta2, theta3) of unit norm."""
    e0, e1, e2, e3 = p
    return np.array([
        [1 - 2 * (e2 * e2 + e3 * e3), 2 * (e1 * e2 - e0 * e3), 2 * (e1 * e3 + e0 * e2)],
        [2 * (e1 * e2 + e0 * e3), 1 - 2 * (e1 * e1 + e3 * e3), 2 * (e2 * e3 - e0 * e1)],
        [2 * (e1 * e3 - e0 * e2), 2 * (e2 * e3 + e0 * e1), 1 - 2 * (e1 * e1 + e2 * e2)]], dtype=object)


def parameters_rates(p: Sequence[Any], omega: Sequence[Any]) -> list[Any]:
    """p_dot = Ebar^T omega / 2 with omega in child axes."""
    e0, e1, e2, e3 = p
    x, y, z = omega
    return [-(e1 * x + e2 * y + e3 * z) / 2, (e0 * x - e3 * y + e2 * z) / 2, (e3 * x + e0 * y - e1 * z) / 2,
            (-e2 * x + e1 * y + e0 * z) / 2]
