"""Contacts under stress: friction from none to ten, grazing and simultaneous impacts, redundant contacts, twelve decades of
stiffness, each against a closed form."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from sympy import sin

from symdyn.errors import SimulationWarning
from symdyn.model.contacts import Compliance, Plane, Point
from symdyn.model.contacts.contact import Contact
from symdyn.model.joints import Free, Planar, Prismatic
from symdyn.model.orientation import EulerAngles
from symdyn.model.symbols import coordinates, parameters, time
from symdyn.model.system import System
from symdyn.runtime.contact_laws import SLIDING
from symdyn.stress.record import Row, within

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

G, RTOL = 9.81, 1e-12
# Errors of a step by all entries of the state, and of how far rounding and the location of a switch go besides, of the state.
PER_STEP, BESIDES = 4.0, 1e-13
TILT = math.radians(30)
# Distance from the angle of friction at which a block sticks below it, and slides above it.
NEAR = 1e-6


def contacts(short: bool) -> Iterator[Row]:
    """All of them; shorter with fewer stiffnesses."""
    yield _friction()
    yield _grazing()
    yield from _simultaneous()
    yield _redundant()
    yield _table()
    yield _lifted()
    yield from _stiffness(short)


def _bound(steps: int, grown: float = 1.0) -> float:
    return (steps * PER_STEP * RTOL + BESIDES) * grown


def _friction() -> Row:
    """A block on a slope, which slides with g (sin - mu cos), or stays."""
    mu = parameters("mu")
    system = System("block", gravity=[G * math.sin(TILT), -G * math.cos(TILT)])
    system.defaults[mu] = 0.0
    carrier, block = system.add_body("carrier"), system.add_body("block", mass=2.0)
    system.add_joint(Prismatic("along", system.ground, carrier, axis=[1, 0], coordinate=coordinates("x")))
    system.add_joint(Prismatic("across", carrier, block, axis=[0, 1], coordinate=coordinates("y")))
    system.add_contact(Contact("sole", block, system.ground, friction=mu))
    module = system.compile()
    edge = math.tan(TILT)
    values = (0.0, 1e-6, 0.1, edge * (1 - NEAR), edge * (1 + NEAR), 1.0, 10.0)
    apart, steps = 0.0, 0
    for value in values:
        solution = module.simulate((0.0, 1.0), params={mu: value}, rtol=RTOL)
        wanted = max(0.0, G * (math.sin(TILT) - value * math.cos(TILT)) / 2)
        apart, steps = max(apart, abs(float(solution.x[-1, 0]) - wanted)), max(steps, solution.n_steps)
    return within("contacts", "block", f"friction from 0 to 10 on a slope of 30 degrees, to {NEAR:g} of the angle of friction: "
                  "way in 1 s, m", apart, _bound(steps, G), "steps times the error one may have times the acceleration",
                  "it slides and sticks as the closed form says", "friction is not Coulomb's")


def _ball(name: str, contact: Contact) -> Module:
    system = System(name, gravity=[0, -G])
    body = system.add_body("ball", mass=1.0)
    system.add_joint(Prismatic("height", system.ground, body, axis=[0, 1], coordinate=coordinates("y")))
    system.add_contact(contact)
    return system.compile()


def _grazing() -> Row:
    """A ball thrown to a ceiling that it hits more and more slowly."""
    module = _ball("thrown", Contact("ceiling", "ball", "ground", shape=(Point(), Plane([0, -1], [0, 1])), restitution=0.5))
    share = 0.0
    margins = [0.0, *(10.0**-k for k in range(1, 15, 2))]
    for margin in margins:
        start = math.sqrt(2 * G) * (1 + margin)
        solution = module.simulate((0.0, 0.9), u=[start], rtol=RTOL)
        hits = math.sqrt(max(0.0, start**2 - 2 * G))
        left = 0.9 - (start - hits) / G
        wanted = 1 - 0.5 * hits * left - G / 2 * left**2
        grown = 1 + 1.5 * G / max(hits, math.sqrt(2 * G * _bound(solution.n_steps)))
        share = max(share, abs(float(solution.x[-1, 0]) - wanted) / _bound(solution.n_steps, grown))
    return within("contacts", "thrown", f"a ceiling hit with {len(margins)} speeds down to none: way, over steps times the "
                  "error one may have times how a slow impact magnifies it", share, 1.0,
                  "an error of place moves the time of an impact by it over the speed",
                  "grazing impacts are hit or passed as the tolerances promise",
                  "grazing impacts are missed")


def _simultaneous() -> Iterator[Row]:
    """A bar that lands flat on two feet: symmetry leaves no spin."""
    for law in ("newton", "poisson"):
        system = System("bar", gravity=[0, -G])
        e = parameters("e")
        system.defaults[e] = 0.0
        body = system.add_body("bar", mass=2.0, inertia=0.3)
        system.add_joint(Planar("free", system.ground, body, coordinates("x y theta")))
        for name, x in (("left", -0.6), ("right", 0.6)):
            shape = Point([x, 0])
            system.add_contact(Contact(name, body, system.ground, shape=shape, friction=0.3, restitution=e, impact=law))
        module, apart, steps = system.compile(), 0.0, 0
        for value in (0.0, 0.6, 1.0):
            solution = module.simulate((0.0, 0.6), q={"y": 0.5}, params={e: value}, rtol=RTOL)
            left = 0.6 - math.sqrt(1 / G)
            wanted = [0.0, value * math.sqrt(G) * left - G / 2 * left**2 if value else 0.0, 0.0]
            apart, steps = max(apart, float(np.abs(solution.q[-1] - wanted).max())), max(steps, solution.n_steps)
        yield within("contacts", "bar", f"two feet land at once, impact='{law}', restitution 0, 0.6 and 1: place after 0.6 s, m, "
                     "rad", apart, _bound(steps, G), "steps times the error one may have times the acceleration",
                     "it rebounds without spin", "impacts at once are not symmetric")


def _redundant() -> Row:
    """Four feet of a bar on the floor: one normal force and one friction force decide nothing, their sums do."""
    system = System("four_feet", gravity=[2.0, -G])
    body = system.add_body("bar", mass=2.0, inertia=0.3)
    system.add_joint(Planar("free", system.ground, body, coordinates("x y theta")))
    for k, x in enumerate((-0.6, -0.2, 0.2, 0.6)):
        system.add_contact(Contact(f"foot_{k}", body, system.ground, shape=Point([x, -0.1]), friction=0.5))
    solution = system.compile().simulate((0.0, 1.0), q={"y": 0.1}, rtol=RTOL)
    total = sum(one.force[-1] for one in solution.contacts.values())
    moved = float(np.abs(solution.q[-1] - [0, 0.1, 0]).max())
    apart = max(moved, float(np.abs(total - [2 * G, -2 * 2.0]).max()) / (2 * G))
    return within("contacts", "four_feet", "four feet stick, of which two would do: motion in 1 s, m, rad, and sums of forces "
                  "over the weight", apart, 1e-9, "forces of rows that depend on each other are softened by 1e-8, which a second "
                  "step takes back", "it stays, and carries its weight", "redundant contacts move, or lose weight")


def _table() -> Row:
    """A table on four legs in space, pushed at the floor until friction gives way, with its weight in the middle, on the edge of
    two legs, and nearly there."""
    push, lever = parameters("push lever")
    system = System("table", gravity=[0, 0, -G])
    system.defaults.update({push: 4.0, lever: 0.15})
    body = system.add_body("table", mass=2.0, inertia=[0.02, 0.03, 0.04])
    system.add_joint(Free("free", system.ground, body, orientation=EulerAngles("ZYX")))
    system.add_force(body, [push * time, 0.3 * push * time, 0], point=[0, 0, -0.1])
    for k, (x, y) in enumerate(((-0.2, -lever), (0.2, -lever), (0.2, 0.3), (-0.2, 0.3))):
        system.add_contact(Contact(f"leg_{k}", body, system.ground, shape=Point([x, y, -0.1]), friction=(0.6, 0.4)))
    module, apart = system.compile(), 0.0
    begin = 0.6 * 2.0 * G / (4.0 * math.hypot(1, 0.3))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)  # of the border of two modes
        for value in (0.15, 1e-3, 0.0):
            solution = module.simulate((0.0, 1.002 * begin), q={module.metadata.q[2]: 0.1}, params={lever: value}, rtol=1e-10)
            left = [t for name in ("leg_0", "leg_1") for t, mode in solution.contacts[name].switches if mode == SLIDING]
            apart = max(apart, abs(min(left, default=0.0) - begin) / begin)
    return within("contacts", "table", "four legs in space share friction, two of them with no load at last: the time at which "
                  "the table slips, relative", apart, 1e-6, "forces of rows that depend on each other are softened by 1e-8, and "
                  "differences of loads magnify that", "it slips where all friction is used", "legs that share forces hold too "
                  "long, or not long enough")


def _lifted() -> Row:
    """A block on its floor that a force A sin(w t) lifts: nothing else accelerates it, so that rounding gives the sign of the
    acceleration where it opens."""
    amplitude, rate = parameters("amplitude rate")
    system = System("lifted", gravity=[0, -G])
    system.defaults.update({amplitude: 15.0, rate: 2.0})
    body = system.add_body("block", mass=1.0)
    y = coordinates("y")
    system.add_joint(Prismatic("height", system.ground, body, axis=[0, 1], coordinate=y))
    system.add_joint_force("height", amplitude * sin(rate * time) - y.dot / 5)
    system.add_contact(Contact("floor", body, system.ground))
    module, stream, apart, missed = system.compile(), np.random.default_rng(0), 0.0, 0
    for a, w in zip(stream.uniform(11, 40, 20), stream.uniform(0.3, 8, 20), strict=True):
        begin = math.asin(G / a) / w
        switches = module.simulate((0.0, 1.2 * begin), params={amplitude: a, rate: w}, rtol=1e-9).contacts["floor"].switches
        missed += len(switches) != 2
        apart = max(apart, abs(switches[-1][0] - begin) / begin if len(switches) == 2 else math.inf)
    return within("contacts", "lifted", f"a block that is lifted from rest, 20 forces, {missed} missed: time of opening, "
                  "relative", apart, 1e-9, "events are located to the tolerance", "it opens where its force passes zero",
                  "contacts stay closed, and pull")


def _stiffness(short: bool) -> Iterator[Row]:
    """An elastic bounce on a spring: the speed comes back."""
    k = parameters("k")
    for method in ("dop853", "radau"):
        system = System("bouncing")
        system.defaults[k] = 1.0
        body = system.add_body("ball", mass=1.0)
        system.add_joint(Prismatic("height", system.ground, body, axis=[0, 0, 1], coordinate=coordinates("z")))
        system.add_contact(Contact("floor", body, system.ground, law="compliant", compliance=Compliance(k, exponent=1)))
        module, share, worst = system.compile(), 0.0, 0.0
        decades = range(2, 13, 5 if short else 2)
        for decade in decades:
            value = 10.0**decade
            rate = math.sqrt(value)
            end = 0.2 + math.pi / rate
            solution = module.simulate((0.0, end), q=[0.1], u=[-1.0], params={k: value}, rtol=1e-10, method=method)
            off = abs(float(solution.u[-1, 0]) - 1.0)
            share = max(share, off / (solution.n_steps * PER_STEP * 1e-10 * (1 + rate)))
            worst = max(worst, off)
        yield within("contacts", "bouncing", f"stiffness from 1e2 to 1e{decades[-1]} N/m, {method} at rtol 1e-10, speed of an "
                     f"elastic bounce to {worst:.2g}: over steps times the error one may have times the contact's frequency",
                     share, 1.0, "an error of depth is one of speed by the frequency; atol is that of metres, and depths are not",
                     "the speed comes back as the tolerances promise", "bounces lose or gain speed")
