"""Plane linkages: closed loops of bars."""

from __future__ import annotations

import math

import sympy as sp

from symdyn.errors import ModelError
from symdyn.model import shapes
from symdyn.model.joints import Revolute
from symdyn.model.points import position
from symdyn.model.symbols import coordinates, parameters
from symdyn.model.system import System


def four_bar() -> System:
    """A four-bar linkage: three uniform bars between two hinges on the ground.

    The n-frame has its origin at the first hinge, x towards the last, which is at (d, 0), and y upward. Bar i has its origin
    at its hinge i and its x axis along itself; the coordinate qi (rad) turns it about z relative to the bar before (the first
    relative to the n-frame). Planar. The loop is cut at the last hinge. It starts at rest with q1 = 1 rad and the hinge
    between the second and the third bar above the line from the bar's first hinge to the last.

    Parameters: g (m/s^2, along -y), d (m); of each bar mi mass (kg), Ii inertia about z at the centre of mass (kg m^2), lci
    centre of mass from hinge i (m), li length (m). Bars of 0.8, 2 and 1.6 m, d = 2 m: the first can turn right round.
    """
    q = coordinates("q1:4")
    m, inertia, lc, length = (parameters(f"{name}1:4") for name in ("m", "I", "lc", "l"))
    g, d = parameters("g d")
    system = System("four_bar", gravity=[0, -g])
    system.defaults = {g: 9.81, d: 2.0}
    parent = system.ground
    for i, (mass, size) in enumerate(((1.0, 0.8), (2.0, 2.0), (1.5, 1.6))):
        bar = system.add_body(f"bar{i + 1}", mass=m[i], inertia=inertia[i], com=[lc[i], 0])
        system.add_joint(Revolute(f"hinge{i + 1}", parent, bar, q[i], parent_point=[length[i - 1] if i else 0, 0]))
        system.defaults |= {m[i]: mass, inertia[i]: mass * size**2 / 12, lc[i]: size / 2, length[i]: size}
        parent = bar
    system.close_loop(Revolute("hinge4", system.ground, parent, parent_point=[d, 0], child_point=[length[2], 0]))
    system.units = {d: "m", length[2]: "m"}
    system.initial = dict(zip(q, _closed(1.0, *(system.defaults[e] for e in (*length, d))), strict=True))
    return system


def _closed(q1: float, l1: float, l2: float, l3: float, d: float) -> tuple[float, float, float]:
    """The angles of a four-bar linkage that is closed, by the law of cosines at hinges 2 and 4."""
    x, y = d - l1 * math.cos(q1), -l1 * math.sin(q1)  # from hinge 2 to hinge 4
    r = math.hypot(x, y)
    second = math.atan2(y, x) + math.acos((l2**2 + r**2 - l3**2) / (2 * l2 * r))
    third = math.atan2(y, x) - math.acos((l3**2 + r**2 - l2**2) / (2 * l3 * r))
    return q1, second - q1, third - second


def slider_crank() -> System:
    """Two identical uniform rods, hinged to each other; the end P3 of the second slides on the x axis.

    The n-frame has its origin at the pivot of the first rod, y upward. The coordinate theta (rad) turns the first rod about z,
    counted from the x axis, counterclockwise; phi (rad) turns the second relative to the first. Planar. The slider has neither
    mass nor friction: the constraint is that P3 has y = 0. On the crank's branch phi = -2 theta, and P3 is at (2 l cos theta,
    0). Where the rods fold together, P3 at the origin, another branch crosses, on which the rods turn together about the
    origin: there the constraint's gradient vanishes, and the mechanism passes straight on.

    It starts at theta = pi/4 with P3 moving at -4 m/s. Outputs: P2, the hinge between the rods, and P3 (m).
    Parameters: g (m/s^2, along -y), m mass (kg) and l length (m) of a rod.
    Source: slider-crank with singular positions, IFToMM library of computational benchmark problems.
    """
    theta, phi = coordinates("theta phi")
    g, m, length = parameters("g m l")
    system = System("slider_crank", gravity=[0, -g])
    rods = [system.add_body(f"rod{i + 1}", mass=m, inertia=m * length**2 / 12, com=[length / 2, 0]) for i in range(2)]
    system.add_joint(Revolute("P1", system.ground, rods[0], theta))
    system.add_joint(Revolute("P2", rods[0], rods[1], phi, parent_point=[length, 0]))
    system.add_constraint(length * sp.sin(theta) + length * sp.sin(theta + phi), name="slider")
    for name, rod in zip(("P2", "P3"), rods, strict=True):
        system.add_output(name, position(rod, (length, 0, 0)))
    system.draw(system.ground, shapes.Line([(-2.2 * length, 0), (2.2 * length, 0)], 1.0), color="0.6")
    system.defaults = {g: 9.81, m: 1.0, length: 1.0}
    rate = 2 * math.sqrt(2.0)
    system.initial = {theta: math.pi / 4, phi: -math.pi / 2, theta.dot: rate, phi.dot: -2 * rate}
    system.duration = 10.0
    return system


def n_four_bar(n: int = 2) -> System:
    """n four-bar linkages in a row ("windows"): n + 1 uprights on the ground, n bars across them, all alike and hinged.

    The n-frame has its origin at the first upright's pivot, x towards the others, which stand l apart, and y upward. The
    coordinate theta_j (rad), j = 0 ... n, turns upright j about -z, counted from the upward vertical: its top B_j is at
    (j l + l sin theta_j, l cos theta_j). phi_i (rad), i = 1 ... n, turns the bar from B_(i-1) to B_i about -z relative to
    upright i - 1. Planar. The loops are cut at B_1 ... B_n. While the windows are parallelograms, all theta are equal and
    phi_i = -theta_(i-1). Where the uprights lie flat the loops' Jacobian loses rank, and the windows could fold.

    It starts upright, with all B moving at +1 m/s along x. Output: B0 (m).
    Parameters: g (m/s^2, along -y), m mass (kg) and l length (m) of a bar.
    Source: problem A02 of the IFToMM library of computational benchmark problems (n = 2 there, also n = 40). As long as all
    theta are equal, theta_ddot l = g ((n + 1)/2 + n)/((n + 1)/3 + n) sin theta.
    """
    if n < 1:
        raise ModelError([f"n_four_bar was asked for {n} windows; pass 1 or more"])
    theta, phi = coordinates(f"theta0:{n + 1}"), coordinates(f"phi1:{n + 1}")
    g, m, length = parameters("g m l")
    system = System(f"n_four_bar_{n}", gravity=[0, -g])
    inertia, down = m * length**2 / 12, [0, 0, -1]
    uprights = []
    for j in range(n + 1):
        uprights.append(system.add_body(f"upright{j}", mass=m, inertia=inertia, com=[0, length / 2]))
        system.add_joint(Revolute(f"pivot{j}", system.ground, uprights[j], theta[j], axis=down, parent_point=[j * length, 0]))
    for i in range(1, n + 1):
        bar = system.add_body(f"bar{i}", mass=m, inertia=inertia, com=[length / 2, 0])
        system.add_joint(Revolute(f"hinge{i}", uprights[i - 1], bar, phi[i - 1], axis=down, parent_point=[0, length]))
        system.close_loop(Revolute(f"B{i}", uprights[i], bar, parent_point=[0, length], child_point=[length, 0]))
    system.add_output("B0", position(uprights[0], (0, length, 0)))
    system.defaults = {g: 9.81, m: 1.0, length: 1.0}
    system.initial = {e.dot: 1.0 for e in theta} | {e.dot: -1.0 for e in phi}
    system.duration = 20.0
    return system
