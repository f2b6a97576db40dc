"""Points of bodies, as outputs and by their components as scalars in expressions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from symdyn.model.bodies import Body
from symdyn.model.quantity import Quantity, component

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, Vector


@dataclass(frozen=True)
class Point:
    """A point of a body: an output, and by its components, scalars in every expression; in the inertial n-frame.

    at         (3,) position on the body, body axes, from its origin
    quantity   "position", "velocity" or "acceleration", (3,), planar (2,); "jacobian", (6, n_u), planar (3, n_u), or
               "bias_acceleration", (6,), planar (3,): rows of the point's velocity first, then of the body's omega
    """

    body: BodyOrName
    at: Vector
    quantity: str = "position"

    def __getitem__(self, index: int) -> Quantity:
        """One component, 0 for x, 1 for y, 2 for z, as a scalar for every expression. Raises ModelError, IndexError."""
        return component(self.body, self.at, self.quantity, index)


def position(body: Body, at: Vector = (0, 0, 0)) -> Point:
    """The position of a point of a body in the n-frame, m; an output, and `[i]` a scalar for every expression.

    >>> system = sd.systems.pendulum()
    >>> system.add_output("tip", sd.position("bob", [0, -1]))
    >>> module = system.compile(backend="numpy")
    >>> module.outputs(0.0, [0.0, 2.0])["tip"]
    array([ 0., -1.])
    """
    return Point(body, at, "position")


def velocity(body: Body, at: Vector = (0, 0, 0)) -> Point:
    """The velocity of a point of a body in the n-frame, m/s; an output, and `[i]` a scalar for every expression.

    >>> system = sd.systems.pendulum()
    >>> system.add_output("tip", sd.velocity("bob", [0, -1]))
    >>> module = system.compile(backend="numpy")
    >>> module.outputs(0.0, [0.0, 2.0])["tip"]
    array([2., 0.])
    """
    return Point(body, at, "velocity")


def acceleration(body: Body, at: Vector = (0, 0, 0)) -> Point:
    """The acceleration of a point of a body in the n-frame, under all loads, m/s^2; an output, and `[i]` a scalar for outputs,
    events and loads.

    >>> system = sd.systems.pendulum()
    >>> system.add_output("tip", sd.acceleration("bob", [0, -1]))
    >>> module = system.compile(backend="numpy")
    >>> module.outputs(0.0, [0.0, 2.0])["tip"] + 0.0
    array([0., 4.])
    """
    return Point(body, at, "acceleration")


def jacobian(body: Body, at: Vector = (0, 0, 0)) -> Point:
    """J of a point of a body, (6, n_u), for `System.add_output`: [v; omega] = J u, and what given motion adds, n-frame.

    Rows: velocity of the point, then angular velocity of the body; in a planar system v_x, v_y, omega_z, (3, n_u).

    >>> system = sd.systems.pendulum()
    >>> system.add_output("tip", sd.jacobian("bob", [0, -1]))
    >>> module = system.compile(backend="numpy")
    >>> module.outputs(0.0, [0.0, 2.0])["tip"]
    array([[1.],
           [0.],
           [1.]])
    """
    return Point(body, at, "jacobian")


def bias_acceleration(body: Body, at: Vector = (0, 0, 0)) -> Point:
    """J_dot u of a point of a body, (6,), for `System.add_output`: [a; alpha] = J u_dot + J_dot u, rows as in `jacobian`.

    The accelerations at u_dot = 0, m/s^2 and rad/s^2; given motion is part of them.

    >>> system = sd.systems.pendulum()
    >>> system.add_output("tip", sd.bias_acceleration("bob", [0, -1]))
    >>> module = system.compile(backend="numpy")
    >>> module.outputs(0.0, [0.0, 2.0])["tip"] + 0.0
    array([0., 4., 0.])
    """
    return Point(body, at, "bias_acceleration")
