"""Bodies held by constraints of their velocity: a rolling disc, a skate and a sleigh."""

from __future__ import annotations

import math

import sympy as sp

from symdyn.model import shapes
from symdyn.model.bodies import Body
from symdyn.model.joints import Free, Planar
from symdyn.model.orientation import EulerAngles
from symdyn.model.symbols import coordinates, inputs, parameters
from symdyn.model.system import System


def rolling_disc() -> System:
    """A thin disc that rolls on a horizontal plane without slipping.

    The n-frame has z upward, the plane is z = 0. x, y, z (m) is the centre of the disc, psi, theta, phi (rad) its ZXZ Euler
    angles: psi is the heading, the disc's tangent at the contact being (cos psi, sin psi, 0); theta is the angle of the disc's
    axis from the vertical (pi/2: the disc stands upright, 0: it lies flat); phi turns the disc about its axis. Contact is a
    constraint of the position, z - R sin theta = 0, which leaves the point of contact P at R (sin psi cos theta,
    -cos psi cos theta) from (x, y); that the disc does not slip there is two constraints of the velocity, v_P = 0 along x and y.
    A positive rate of phi rolls the disc against its heading. It starts leaning by 0.3 rad, rolling and turning.

    Parameters: g (m/s^2, along -z), m mass (kg), R radius (m), I_t inertia about a diameter and I_a about the axis (kg m^2).
    Source: Neimark and Fufaev, Dynamics of Nonholonomic Systems, 1972. theta stays constant where
    (I_a + m R^2) Omega omega_3 sin theta = I_t Omega^2 sin theta cos theta - m g R cos theta, with Omega = psi_dot and
    omega_3 = phi_dot + psi_dot cos theta.
    """
    x, y, z, psi, theta, phi = coordinates("x y z psi theta phi")
    g, m, R, I_t, I_a = parameters("g m R I_t I_a")
    system = System("rolling_disc", gravity=[0, 0, -g])
    disc = system.add_body("disc", mass=m, inertia=[I_t, I_t, I_a])
    system.add_joint(Free("centre", system.ground, disc, [x, y, z, psi, theta, phi], EulerAngles("ZXZ")))
    spin = phi.dot + psi.dot * sp.cos(theta)
    system.add_constraint(z - R * sp.sin(theta), name="contact")
    system.add_constraint(x.dot + R * (spin * sp.cos(psi) - theta.dot * sp.sin(psi) * sp.sin(theta)), name="no slip along x")
    system.add_constraint(y.dot + R * (spin * sp.sin(psi) + theta.dot * sp.cos(psi) * sp.sin(theta)), name="no slip along y")
    system.defaults = {g: 9.81, m: 1.0, R: 0.5, I_t: 0.25 / 4, I_a: 0.25 / 2}
    _draw_disc(system, disc, R)
    lean, turn, roll = math.pi / 2 - 0.3, 1.0, -6.0
    system.initial = {z: 0.5 * math.sin(lean), theta: lean, x.dot: -0.5 * (roll + turn * math.cos(lean)), psi.dot: turn,
                      phi.dot: roll}
    system.units = {R: "m"}
    system.duration = 5.0
    return system


def skate() -> System:
    """A skate (Chaplygin's sleigh): a body on a horizontal plane with a knife edge that does not slip sideways.

    x, y (m) is the point where the edge touches the plane, theta (rad) the direction of the edge, counterclockwise. The
    centre of mass is a ahead of this point. Planar, no gravity in the plane. The constraint is
    -x_dot sin theta + y_dot cos theta = 0.

    Parameters: m mass (kg), I inertia about the vertical at the centre of mass (kg m^2), a (m).
    Source: Neimark and Fufaev, Dynamics of Nonholonomic Systems, 1972. With v the speed along the edge, v_dot = a theta_dot^2
    and (I + m a^2) theta_ddot = -m a v theta_dot: v tends to V tanh(gamma (t - t_0)), V^2 = v^2 + (I + m a^2) theta_dot^2 / m,
    gamma = m a V / (I + m a^2).
    """
    x, y, theta = coordinates("x y theta")
    m, I, a = parameters("m I a")
    system = System("skate", planar=True)
    body = system.add_body("skate", mass=m, inertia=I, com=[a, 0])
    system.add_joint(Planar("plane", system.ground, body, [x, y, theta]))
    system.add_constraint(-x.dot * sp.sin(theta) + y.dot * sp.cos(theta), name="edge")
    _draw_skate(system, body, a)
    system.defaults = {m: 1.0, I: 0.02, a: 0.1}
    system.initial = {x.dot: -0.5, theta.dot: 4.0}
    system.duration = 5.0
    return system


def sleigh() -> System:
    """Chaplygin's sleigh drawn along a line: a skate whose centre of mass is pulled to the line y = 0 by a force along y.

    x, y (m) is the point where the knife edge touches the plane, theta (rad) the direction of the edge, counterclockwise. The
    centre of mass is a ahead of this point; the force -k times its distance from the line acts on it. Planar, no gravity in the
    plane. The constraint is -x_dot sin theta + y_dot cos theta = 0. It starts at 1 m/s along the line, 0.01 m next to it.

    Outputs: track, centre, distances of the edge and of the centre of mass from the line (m). Input: T, a moment about the
    vertical (N m).
    Parameters: m mass (kg), I inertia about the vertical at the centre of mass (kg m^2), a (m), k (N/m).
    Source: Neimark and Fufaev, Dynamics of Nonholonomic Systems, 1972. Along the line at the speed v small deviations obey
    y_dot = v theta and (I + m a^2) theta_ddot + m a v theta_dot + k a (y + a theta) = T: without T they grow at any speed.
    """
    x, y, theta = coordinates("x y theta")
    m, I, a, k = parameters("m I a k")
    T = inputs("T")
    system = System("sleigh", planar=True)
    body = system.add_body("sleigh", mass=m, inertia=I, com=[a, 0])
    system.add_joint(Planar("plane", system.ground, body, [x, y, theta]))
    system.add_constraint(-x.dot * sp.sin(theta) + y.dot * sp.cos(theta), name="edge")
    system.add_force(body, [0, -k * (y + a * sp.sin(theta))], point=[a, 0])
    system.add_torque(body, T)
    system.add_output("track", y)
    system.add_output("centre", y + a * sp.sin(theta))
    _draw_skate(system, body, a)
    system.defaults = {m: 1.0, I: 0.02, a: 0.1, k: 50.0}
    system.initial = {x.dot: 1.0, y: 0.01}
    system.units = {k: "N/m"}
    system.duration = 2.0
    return system


def _draw_disc(system: System, disc: Body, R: sp.Symbol) -> None:
    """A thin disc with two diameters on each face, by which one sees that it turns."""
    half = R / 40
    system.draw(disc, shapes.Cylinder([0, 0, -half], [0, 0, half], R), color="#8fb3d9")
    for z in (-1.2 * half, 1.2 * half):
        system.draw(disc, shapes.Line([[-R, 0, z], [R, 0, z]], 2.0), color="#24425f")
        system.draw(disc, shapes.Line([[0, -R, z], [0, R, z]], 2.0), color="#24425f")


def _draw_skate(system: System, body: Body, a: sp.Symbol) -> None:
    """A sledge seen from above: its runner, which carries the knife edge, and the load at the centre of mass."""
    system.draw(body, shapes.Line([[-a, 0, 0], [3 * a, 0, 0]], 4.0), color="#24425f")
    for y in (-0.5 * a, 0.5 * a):
        system.draw(body, shapes.Line([[-0.6 * a, y, 0], [2 * a, y, 0], [3 * a, 0, 0]], 2.0), color="#4a6a8a")
    system.draw(body, shapes.Box([1.2 * a, 1.4 * a, 0.4 * a], center=[a, 0, 0]), color="#8fb3d9")
    system.draw(body, shapes.Line([[0.5 * a, 0, 0.3 * a], [1.5 * a, 0, 0.3 * a]], 4.0), color="#24425f")
