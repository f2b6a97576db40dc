"""Rigid bodies and point masses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import sympy as sp


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body with its reference frame (origin O, body axes).

    mass      kg
    inertia   (3, 3) about the centre of mass, body axes, kg m^2; zero for a point mass
    com       (3, 1) centre of mass from O, body axes, m
    """

    name: str
    mass: sp.Expr
    inertia: sp.ImmutableMatrix
    com: sp.ImmutableMatrix

    def __repr__(self) -> str:
        return f"Body({self.name!r})"


@dataclass(frozen=True)
class Point:
    """A point of a body, as an output: its position or velocity.

    at         (3,) position on the body, body axes, from its origin
    quantity   "position" or "velocity"; components in the inertial n-frame
    """

    body: Any
    at: Any
    quantity: str = "position"


def position(body: Body, at: Any = (0, 0, 0)) -> Point:
    """The position of a point of a body in the n-frame, for `System.add_output`; m."""
    return Point(body, at, "position")


def velocity(body: Body, at: Any = (0, 0, 0)) -> Point:
    """The velocity of a point of a body in the n-frame, for `System.add_output`; m/s."""
    return Point(body, at, "velocity")
