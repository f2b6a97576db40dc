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
    """A point of a body, as an output; components in the inertial n-frame.

    at         (3,) position on the body, body axes, from its origin
    quantity   "position", "velocity" or "acceleration", (3,), planar (2,); "jacobian", (6, n_u), planar (3, n_u), or
               "bias_acceleration", (6,), planar (3,): rows of the point's velocity first, then of the body's omega
    """

    body: Any
    at: Any
    quantity: str = "position"

    def __getitem__(self, index: int) -> Component:
        """One component of a vector, for `System.add_event`."""
        return Component(self, index)


@dataclass(frozen=True)
class Component:
    """One component, 0 for x, 1 for y, 2 for z, of what is asked of a point, and an expression that is added to it."""

    point: Point
    index: int
    offset: Any = 0

    def __add__(self, other: Any) -> Component:
        return Component(self.point, self.index, self.offset + other)

    def __sub__(self, other: Any) -> Component:
        return Component(self.point, self.index, self.offset - other)


def position(body: Body, at: Any = (0, 0, 0)) -> Point:
    """The position of a point of a body in the n-frame, for `System.add_output`; m."""
    return Point(body, at, "position")


def velocity(body: Body, at: Any = (0, 0, 0)) -> Point:
    """The velocity of a point of a body in the n-frame, for `System.add_output`; m/s."""
    return Point(body, at, "velocity")


def acceleration(body: Body, at: Any = (0, 0, 0)) -> Point:
    """The acceleration of a point of a body in the n-frame, under all loads, for `System.add_output`; m/s^2."""
    return Point(body, at, "acceleration")


def jacobian(body: Body, at: Any = (0, 0, 0)) -> Point:
    """J of a point of a body, (6, n_u), for `System.add_output`: [v; omega] = J u, and what given motion adds, n-frame.

    Rows: velocity of the point, then angular velocity of the body; in a planar system v_x, v_y, omega_z, (3, n_u).
    """
    return Point(body, at, "jacobian")


def bias_acceleration(body: Body, at: Any = (0, 0, 0)) -> Point:
    """J_dot u of a point of a body, (6,), for `System.add_output`: [a; alpha] = J u_dot + J_dot u, rows as in `jacobian`.

    What is left of the accelerations when u_dot = 0; given motion is part of it. m/s^2 and rad/s^2.
    """
    return Point(body, at, "bias_acceleration")
