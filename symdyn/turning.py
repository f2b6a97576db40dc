"""Coordinates and speeds that turn, by their units: the one place where that is decided, for derivation, code and runtime.

A speed without a length in its unit becomes a velocity by the mechanism's length, one in m/s is a velocity already. Speeds of a
Custom joint without units are in 1/s, so that they count as turning; units=["m"] makes a coordinate one that slides.
"""

from __future__ import annotations


def turns(speed_unit: str | None) -> bool:
    """Whether a speed in this unit becomes a velocity by a length: an angular velocity, or a rate of a number."""
    return speed_unit in ("rad/s", "1/s")


def is_angle(coordinate_unit: str | None) -> bool:
    """Whether a coordinate in this unit becomes a length by a length: an angle, an Euler parameter, a number."""
    return coordinate_unit in ("rad", "1")


def in_radians(coordinate_unit: str | None) -> bool:
    """Whether a coordinate in this unit is an angle in rad, so that it is the same after 2 pi."""
    return coordinate_unit == "rad"


def force_unit(speed_unit: str | None) -> str:
    """The unit of what does work along a speed in this unit, "" where it is not known: a moment, a force."""
    return "N m" if turns(speed_unit) else "N" if speed_unit == "m/s" else ""


def stiffness_unit(speed_unit: str | None) -> str:
    """The unit of such a force by the displacement that goes with it, "" where it is not known: N m by rad, N by m."""
    return {"N m": "N m", "N": "N/m"}.get(force_unit(speed_unit), "")
