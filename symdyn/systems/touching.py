"""Mechanisms that touch: a walker, a block that rocks, a toy that slides down a pole."""

from __future__ import annotations

import math

import sympy as sp

from symdyn.model import shapes
from symdyn.model.contacts import Plane, Point
from symdyn.model.contacts.contact import Contact
from symdyn.model.joints import Planar, Prismatic, Revolute
from symdyn.model.symbols import coordinates, parameters
from symdyn.model.system import System


def simplest_walker() -> System:
    """The simplest walker: a hip on two straight legs with small feet, which walks down a slope.

    The axes lie along the slope and across it; x, y (m) is the position of the hip, left and right (rad) are the angles of the
    legs from the normal of the slope, positive where the foot is ahead. Feet do not slip and do not bounce. Straight legs scuff
    in mid-swing, which by convention does not count: a foot is ignored until it is 0.15 l ahead of the other one. It starts after
    a heel strike on the left foot, and walks with the shorter of the two gaits of this slope, which is not stable.

    Parameters: gamma inclination of the slope (rad), M mass of the hip, m of a foot (kg), l length of the legs (m), g (m/s^2), mu
    friction of the feet.
    Source: Garcia, Chatterjee, Ruina and Coleman, The simplest walking model: stability, complexity, and scaling, J. Biomech.
    Eng. 120 (1998), 281, for feet without mass, in units of M, l and g: theta_0 = 0.19393737, its rate -0.20386693, period
    3.0961058680777 at gamma = 0.009.
    """
    x, y, left, right = coordinates("x y left right")
    gamma, hip_mass, m, length, g, mu = parameters("gamma M m l g mu")
    system = System("simplest_walker", gravity=[g * sp.sin(gamma), -g * sp.cos(gamma)])
    carrier, hip = system.add_body("carrier"), system.add_body("hip", mass=hip_mass)
    system.add_joint(Prismatic("along", system.ground, carrier, axis=[1, 0], coordinate=x))
    system.add_joint(Prismatic("across", carrier, hip, axis=[0, 1], coordinate=y))
    for angle, other in ((left, right), (right, left)):
        leg = system.add_body(f"{angle.name}_leg", mass=m, inertia=0, com=[0, -length])
        system.add_joint(Revolute(f"{angle.name}_hip", hip, leg, coordinate=angle))
        ignored = length * (sp.Rational(3, 20) - sp.sin(angle) + sp.sin(other))
        system.add_contact(Contact(f"{angle.name}_foot", leg, system.ground, shape=Point([0, -length]), friction=mu,
                                   ignored=ignored))
    a, rate = 0.19393737, -0.20386693
    system.defaults = {gamma: 0.009, hip_mass: 1.0, m: 1e-4, length: 1.0, g: 1.0, mu: 5.0}
    system.initial = {x: -math.sin(a), y: math.cos(a), left: a, right: -a, x.dot: -math.cos(a) * rate, y.dot: -math.sin(a) * rate,
                      left.dot: rate, right.dot: math.cos(2 * a) * rate}
    system.units = {gamma: "rad", hip_mass: "kg", m: "kg", length: "m", g: "m/s^2", mu: "1"}
    system.duration = 9.0
    return system


def rocking_block() -> System:
    """A rigid block that rocks from corner to corner on the ground.

    The n-frame has y upward; x, y (m) is the position of the centre, theta (rad) the angle of the block, which is positive where
    it stands on its left corner. It starts at rest at 0.8 of the angle at which it would topple. Corners do not slip and do not
    bounce: at an impact the angular momentum about the new corner stays, and the rate of the angle falls to 1 - 3/2 sin^2(alpha)
    of itself, with the angle alpha of the diagonal from the vertical.

    Parameters: m mass (kg), b half the width, h half the height (m), g (m/s^2, along -y), mu friction.
    Source: Housner, The behavior of inverted pendulum structures during earthquakes, Bull. Seismol. Soc. Am. 53 (1963), 403.
    """
    x, y, theta = coordinates("x y theta")
    m, b, h, g, mu = parameters("m b h g mu")
    system = System("rocking_block", gravity=[0, -g])
    block = system.add_body("block", mass=m, inertia=m * (b**2 + h**2) / 3)
    system.add_joint(Planar("free", system.ground, block, [x, y, theta]))
    for name, side in (("left", -1), ("right", 1)):
        system.add_contact(Contact(name, block, system.ground, shape=Point([side * b, -h]), friction=mu))
    half, height = 0.25, 1.0
    start = 0.8 * math.atan2(half, height)
    c, s = math.cos(start), math.sin(start)
    system.defaults = {m: 1000.0, b: half, h: height, g: 9.81, mu: 5.0}
    system.initial = {x: -half + c * half - s * height, y: s * half + c * height, theta: start}
    system.units = {m: "kg", b: "m", h: "m", g: "m/s^2", mu: "1"}
    system.draw(block, shapes.Box((2 * half, 2 * height, 0.5)), color="#4a6a8a")
    system.duration = 5.0
    return system


def woodpecker_toy() -> System:
    """The woodpecker toy: a bird on a spring, whose sleeve has play on a pole and slides down it in jerks.

    The n-frame has y upward along the pole; y (m) is the height of the sleeve, sleeve and bird (rad) are angles, in which the
    published model is linear: gaps, ways along the pole and moments of the weight are those at small angles. The edges of the
    sleeve stick, slide and do not bounce, the beak of the bird does. The motion comes to a period of 0.146 s.

    Parameters: m_M, m_S masses of sleeve and bird (kg), J_M, J_S their moments of inertia (kg m^2), c spring (N m/rad), r_0
    radius of the pole, r_M inner radius and h_M half the height of the sleeve, l_M from its middle to the spring, l_G from there
    to the middle of the bird, h_S, l_S height and reach of the beak from there (m), g (m/s^2), mu friction, e restitution of the
    beak.
    Source: Leine, van Campen and Glocker, Nonlinear dynamics and modeling of various wooden toys with impact and friction, J.
    Vib. Control 9 (2003), 25, after Pfeiffer (1984) and Glocker (1995), with their numbers.
    """
    y, sleeve, bird = coordinates("y sleeve bird")
    names = "m_M m_S J_M J_S c r_0 r_M h_M l_M l_G h_S l_S g mu e"
    m_M, m_S, J_M, J_S, c, r_0, r_M, h_M, l_M, l_G, h_S, l_S, g, mu, e = symbols = parameters(names)
    system = System("woodpecker_toy", gravity=[0, -g])
    reach, parts = l_M + l_G, []
    for angle, other, mass, inertia, height, at in ((sleeve, bird, m_M, J_M, y, 0),
                                                    (bird, sleeve, m_S, J_S, y + l_M * sleeve + l_G * bird, reach)):
        carrier = system.add_body(f"{angle.name}_carrier")
        body = system.add_body(f"{angle.name}_body", mass=mass, inertia=inertia)
        system.add_joint(Prismatic(f"{angle.name}_slide", system.ground, carrier, axis=[0, 1], coordinate=height,
                                   parent_point=[at, 0]))
        joint = system.add_joint(Revolute(f"{angle.name}_hinge", carrier, body, coordinate=angle))
        system.add_joint_force(joint, -c * (angle - other))
        parts += [carrier, body]
    play = r_M - r_0
    edges = {"beak": (reach - l_S - r_0 - h_S * bird, y + l_M * sleeve + (l_G - l_S) * bird, h_S, e),
             "low": (play + h_M * sleeve, y + r_M * sleeve, -h_M, 0), "up": (play - h_M * sleeve, y + r_M * sleeve, h_M, 0)}
    for name, (gap, way, height, restitution) in edges.items():
        carrier, edge = system.add_body(f"{name}_carrier"), system.add_body(f"{name}_edge")
        system.add_joint(Prismatic(f"{name}_way", system.ground, carrier, axis=[0, 1], coordinate=way,
                                   parent_point=[r_0, height]))
        system.add_joint(Prismatic(f"{name}_gap", carrier, edge, axis=[1, 0], coordinate=gap))
        system.add_contact(Contact(name, edge, system.ground, shape=(Point(), Plane([1, 0], [r_0, 0])), friction=mu,
                                   restitution=restitution))
    numbers = (3e-4, 4.5e-3, 5e-9, 7e-7, 0.0056, 0.0025, 0.0031, 0.0058, 0.010, 0.015, 0.02, 0.0201, 9.81, 0.3, 0.5)
    system.defaults = dict(zip(symbols, numbers, strict=True))
    system.initial = {sleeve: -(0.0031 - 0.0025) / 0.0058, bird: -0.2788, y.dot: -0.3411, bird.dot: -7.4583}
    system.units = {m_M: "kg", m_S: "kg", J_M: "kg m^2", J_S: "kg m^2", c: "N m/rad", **dict.fromkeys(symbols[5:12], "m"),
                    g: "m/s^2", mu: "1", e: "1"}
    system.draw(system.ground, shapes.Cylinder([0, -0.155, 0], [0, 0.03, 0], 0.0025, 0.0025), color="0.7")
    sides = [[-0.0031, -0.0058, 0], [-0.0031, 0.0058, 0], [0.0031, 0.0058, 0], [0.0031, -0.0058, 0], [-0.0031, -0.0058, 0]]
    outline = [[0, -0.02, 0], [0.004, 0, 0], [0, 0.02, 0], [-0.0201, 0.02, 0], [0, 0.016, 0], [-0.004, 0, 0], [0, -0.02, 0]]
    arms = [[0.0031, 0, 0], [0.010, 0, 0]], [[-0.015, 0, 0], [-0.004, 0, 0]]  # which the spring joins
    looks = ((parts[0], parts[1], (sides, arms[0]), "#7a4b8a"), (parts[2], parts[3], (outline, arms[1]), "#4a6a8a"))
    for carrier, body, lines, color in looks:
        system.draw(carrier, shapes.Cylinder([0, 0, -0.001], [0, 0, 0.001], 0.0008, 0.0008), color=color)
        for points in lines:
            system.draw(body, shapes.Line(points, 2.0), color=color)
    system.duration = 1.0
    return system
