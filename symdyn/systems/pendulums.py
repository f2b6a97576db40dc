"""Pendulums in the vertical plane."""

from __future__ import annotations

from collections.abc import Sequence

from symdyn.errors import ModelError
from symdyn.model.joints import Revolute
from symdyn.model.symbols import coordinates, parameters
from symdyn.model.system import System
from symdyn.shown import shown

# More than any formulation derives in a day.
MOST_RODS = 100_000


def pendulum() -> System:
    """A point mass on a massless rod.

    The n-frame has its origin at the pivot, y upward. The coordinate q1 (rad) turns the rod about z, counted from the
    downward vertical, positive counterclockwise: the mass is at (l sin q1, -l cos q1). Planar.

    Parameters: g (m/s^2, along -y), m mass (kg), l length of the rod (m).
    Source: lecture, chapters 3.4 and 3.5; the equation of motion is m l^2 q1_ddot = -m g l sin q1.
    """
    (q1,) = coordinates("q1:2")
    m, length, g = parameters("m l g")
    system = System("pendulum", gravity=[0, -g])
    bob = system.add_body("bob", mass=m, com=[0, -length])
    system.add_joint(Revolute("pivot", system.ground, bob, q1))
    system.defaults = {m: 1.0, length: 1.0, g: 9.81}
    system.initial = {q1: 2.0}
    return system


def double_pendulum() -> System:
    """Two uniform rods: `n_link_pendulum(2)`, released at rest with the upper rod along +x and q2 = 0.1 rad.

    Chaotic: nearby motions part within a few seconds.
    """
    return _chain_of_rods("double_pendulum", 2, (0.0, 0.1))


def n_link_pendulum(n: int = 5) -> System:
    """A chain of n rods, hinged one to the next.

    The n-frame has its origin at the first hinge, y upward. Rod i has its origin at its hinge i and its x axis along
    itself; the coordinate qi (rad) turns it about z relative to the rod before (the first relative to the n-frame). At
    q = 0 all rods lie along +x; so they start, at rest. Planar.

    Parameters: g (m/s^2, along -y); of each rod mi (kg), Ii inertia about z at the centre of mass (kg m^2), lci centre
    of mass from hinge i (m); of all but the last li, distance to hinge i + 1 (m). The numbers are those of uniform rods
    of 1 m and 1 kg.
    """
    if isinstance(n, bool) or not isinstance(n, int) or not 1 <= n <= MOST_RODS:
        raise ModelError([f"n_link_pendulum was asked for {shown(n)} rods; pass 1 or more, a whole number up to {MOST_RODS}"])
    return _chain_of_rods(f"n_link_pendulum_{n}", n, (0.0,) * n)


def _chain_of_rods(name: str, n: int, start: Sequence[float]) -> System:
    q = coordinates(f"q1:{n + 1}")
    m, inertia, lc, length = (parameters(f"{name}1:{n + 1}") for name in ("m", "I", "lc", "l"))
    g = parameters("g")
    system = System(name, gravity=[0, -g])
    parent = system.ground
    for i in range(n):
        rod = system.add_body(f"rod{i + 1}", mass=m[i], inertia=inertia[i], com=[lc[i], 0])
        system.add_joint(Revolute(f"hinge{i + 1}", parent, rod, q[i], parent_point=[length[i - 1] if i else 0, 0]))
        parent = rod
    system.defaults = {g: 9.81}
    for i in range(n):
        system.defaults |= {m[i]: 1.0, inertia[i]: 1 / 12, lc[i]: 0.5}
        if i < n - 1:
            system.defaults[length[i]] = 1.0
    system.initial = dict(zip(q, start, strict=True))
    return system
