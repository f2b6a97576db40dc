"""The lecture's particles and track in absolute coordinates, held by constraints."""

from __future__ import annotations

import math

import sympy as sp

from symdyn.model import shapes
from symdyn.model.bodies import Body
from symdyn.model.joints import Custom, Planar
from symdyn.model.symbols import coordinates, parameters, time
from symdyn.model.system import System


def pendulum_absolute() -> System:
    """A point mass whose distance from the origin a massless rod keeps, in its Cartesian coordinates.

    The n-frame has its origin at the pivot, y upward; x, y (m) is the position of the mass. Planar. The constraint is
    x^2 + y^2 - l^2 = 0, its multiplier the rod's force over 2 l. It starts at rest at (-l, 0), with l = 1 m.

    Parameters: g (m/s^2, along -y), m mass (kg), l length of the rod (m).
    Source: lecture, chapter 3.5; the start and the numbers are problem A01 of the IFToMM library of computational
    benchmark problems in multibody dynamics.
    """
    x, y = coordinates("x y")
    m, length, g = parameters("m l g")
    system = System("pendulum_absolute", gravity=[0, -g])
    _particle(system, "bob", m, x, y)
    system.add_constraint(x**2 + y**2 - length**2, name="rod")
    system.draw(system.ground, shapes.Line([(0, 0)], 2.5, to=("bob", (0, 0))), color="0.45")
    system.defaults = {m: 1.0, length: 1.0, g: 9.81}
    system.initial = {x: -1.0, y: 0.0}
    system.units = {length: "m"}
    system.duration = 10.0
    return system


def vehicle_on_track_absolute() -> System:
    """A vehicle (a particle) that slides without friction down a fixed inclined track, in Cartesian coordinates.

    The n-frame has y upward and its origin at O_0, a point of the track, which falls towards +x at the angle theta below
    the horizontal; x, y (m) is the position of the vehicle. Planar. The constraint is x tan theta + y = 0.

    Parameters: g (m/s^2, along -y), m mass of the vehicle (kg), theta inclination (rad).
    Source: lecture, chapter 3.3; M = diag(m, m), C_r = [tan theta, 1]. `vehicle_on_track` is the same motion in the distance
    travelled.
    """
    x, y = coordinates("x y")
    m, g, theta = parameters("m g theta")
    system = System("vehicle_on_track_absolute", gravity=[0, -g])
    _particle(system, "vehicle", m, x, y)
    system.add_constraint(x * sp.tan(theta) + y, name="track")
    system.draw(system.ground, shapes.Line([(-1, sp.tan(theta)), (9, -9 * sp.tan(theta))], 2.0), color="0.45")
    system.defaults = {m: 1.0, g: 9.81, theta: 0.5}
    system.initial = {x.dot: 0.5 * math.cos(0.5), y.dot: -0.5 * math.sin(0.5)}
    system.duration = 2.0
    system.units = {theta: "rad"}
    return system


def vehicle_on_rotating_track_absolute() -> System:
    """A vehicle (a particle) that slides without friction along a track, which turns about its fixed centre of mass.

    The n-frame has y upward. r = [x_v, y_v, x_t, y_t, theta]: position (m) of the vehicle O_v and of the track's centre of
    mass O_t, and inclination of the track (rad), counterclockwise. Planar. The constraints are x_t - x_const = 0,
    y_t - y_const = 0 and y_const - y_v - (x_const - x_v) tan theta = 0.

    Parameters: g (m/s^2, along -y), m_v mass of the vehicle (kg), m_t mass of the track (kg), I_t its inertia about z at O_t
    (kg m^2), x_const, y_const where O_t is held (m).
    Source: lecture, chapter 3.3, augmented formulation (the slides print -tan theta for the derivative of the last constraint by
    x_v, which is tan theta). With O_t at the origin it is the motion of
    `vehicle_on_rotating_track`, from the same start: 1 m from the hinge, inclined by 0.3 rad, turning at 0.5 rad/s. The last
    constraint has no value where the track stands upright, which it approaches as the vehicle falls.
    """
    x_v, y_v, x_t, y_t, theta = coordinates("x_v y_v x_t y_t theta")
    g, m_v, m_t, I_t, x_const, y_const = parameters("g m_v m_t I_t x_const y_const")
    system = System("vehicle_on_rotating_track_absolute", gravity=[0, -g])
    _particle(system, "vehicle", m_v, x_v, y_v)
    track = system.add_body("track", mass=m_t, inertia=I_t)
    system.add_joint(Planar("track", system.ground, track, [x_t, y_t, theta]))
    system.add_constraint(x_t - x_const, name="hinge x")
    system.add_constraint(y_t - y_const, name="hinge y")
    system.add_constraint(y_const - y_v - (x_const - x_v) * sp.tan(theta), name="track")
    system.draw(track, shapes.Line([(-2.5, 0), (2.5, 0)], 3.0))
    system.defaults = {g: 9.81, m_v: 1.0, m_t: 2.0, I_t: 0.5, x_const: 0.0, y_const: 0.0}
    c, s, rate = math.cos(0.3), math.sin(0.3), 0.5
    system.initial = {x_v: -c, y_v: -s, theta: 0.3, x_v.dot: s * rate, y_v.dot: -c * rate, theta.dot: rate}
    system.duration = 1.0
    system.units = {x_const: "m", y_const: "m"}
    return system


def particle_on_moving_slope(rocking: bool = False) -> System:
    """A particle that slides without friction on a slope through the origin, whose inclination is given over time.

    The n-frame has y upward and its origin on the slope; x, y (m) is the position of the particle. Planar. The constraint
    y cos theta(t) - x sin theta(t) = 0 depends on time: the slope does work on the particle.

    rocking
        False   theta = omega t: the slope turns on. The particle's distance from the origin, s along the slope, follows
                s_ddot = omega^2 s - g sin(omega t).
        True    theta = theta_0 sin(omega t)

    Parameters: g (m/s^2, along -y), m mass (kg), omega (rad/s), if rocking theta_0 (rad).
    Source: lecture, chapter 3.5, moving particle on the slope.
    """
    x, y = coordinates("x y")
    m, g, omega, theta_0 = parameters("m g omega theta_0")
    theta = theta_0 * sp.sin(omega * time) if rocking else omega * time
    system = System("particle_on_moving_slope", gravity=[0, -g])
    _particle(system, "particle", m, x, y)
    system.add_constraint(y * sp.cos(theta) - x * sp.sin(theta), name="slope")
    system.draw(system.ground, shapes.Line([(0, 0)], 2.5, to=("particle", (0, 0))), color="0.45")  # the slope
    system.defaults = {m: 1.0, g: 9.81, omega: 2.0}
    system.units = {omega: "rad/s"}
    rate = 2.0  # of theta at the start
    if rocking:
        system.defaults |= {theta_0: 0.5}
        system.units |= {theta_0: "rad"}
        rate *= 0.5
    system.initial = {x: 1.0, x.dot: -0.5, y.dot: rate}
    system.duration = 3.0
    return system


def _particle(system: System, name: str, mass: sp.Expr, x: sp.Symbol, y: sp.Symbol) -> Body:
    """A point mass at (x, y); it has no orientation."""
    particle = system.add_body(name, mass=mass)
    system.add_joint(Custom(name, system.ground, particle, [x, y], position=[x, y, 0], units=("m", "m")))
    return particle
