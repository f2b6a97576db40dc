"""A five-link biped that walks: two tibias, two femurs and a torso, of one step that repeats itself, with the impact of the heel.

Source: Kelly, An introduction to trajectory optimization, SIAM Review 59 (2017), section 6 (step of 0.5 m in 0.7 s, cost the
integral of the squares of the torques); masses, lengths, inertias of RABBIT: Westervelt, Grizzle and Koditschek, IEEE
Transactions on Automatic Control 48 (2003), as listed in the paper's program OptimTraj,
demo/fiveLinkBiped/getPhysicalParameters.m. Its folder has a record of IPOPT, TrajOpt_GPOPSIPOPTinfo.txt, of a step of 0.4 m in
0.6 s without torque at the stance ankle, by Gauss-Radau collocation with 40 points (GPOPS-II): 263.69885 N^2 m^2 s after 143
iterations, with Hessians of limited memory.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy as sp

import symdyn as sd
from symdyn.runtime.module import Module

STEP, DURATION = 0.5, 0.7
# The step that was published with its cost, N^2 m^2 s.
PUBLISHED: dict[str, float] = {"length": 0.4, "duration": 0.6}
PUBLISHED_COST = 263.69884582
# Data of the stance tibia, stance femur, torso, swing femur, swing tibia: kg, kg m^2, m, and m from the knee, or the hip, to the
# centre.
MASSES, INERTIAS = (3.2, 6.8, 20.0, 6.8, 3.2), (0.93, 1.08, 2.22, 1.08, 0.93)
LENGTHS, CENTRES = (0.4, 0.4, 0.625, 0.4, 0.4), (0.128, 0.163, 0.2, 0.163, 0.128)
# A guess of the first posture; at the end the legs have changed.
POSTURE = (-0.3, 0.7, 0.0, -0.5, -0.6)


def biped() -> sd.System:
    """The biped on its stance foot: q1 ... q5 turn the links about z, counted from the vertical; torques u1 ... u5 at the ankle,
    the stance knee, the hip from stance femur to torso, the hip from torso to swing femur, the swing knee."""
    q, u = sd.coordinates("q1:6"), sd.inputs("u1:6")
    m, inertia, length, d = (sd.parameters(f"{name}1:6") for name in ("m", "I", "l", "d"))
    g = sd.parameters("g")
    system = sd.System("five_link_biped", gravity=[0, -g])
    names = ("stance_tibia", "stance_femur", "torso", "swing_femur", "swing_tibia")
    centres = (length[0] - d[0], length[1] - d[1], d[2], -d[3], -d[4])
    links = [system.add_body(name, mass=m[k], inertia=inertia[k], com=[0, centres[k]]) for k, name in enumerate(names)]
    carriers: list[tuple[Any, Any, Any]] = [(system.ground, q[0], 0), (links[0], q[1] - q[0], length[0]),
                                            (links[1], q[2] - q[1], length[1]), (links[1], q[3] - q[1], length[1]),
                                            (links[3], q[4] - q[3], -length[3])]
    for e in q[1:]:
        system.add_coordinate(e)
    for k, (parent, angle, height) in enumerate(carriers):
        system.add_joint(sd.Revolute(f"joint{k + 1}", parent, links[k], angle, parent_point=[0, height]))
    between = [(None, 0), (0, 1), (1, 2), (2, 3), (3, 4)]
    for torque, (first, second) in zip(u, between, strict=True):
        system.add_torque(links[second], [0, 0, torque])
        if first is not None:
            system.add_torque(links[first], [0, 0, -torque])
    system.defaults = {g: 9.81, **dict(zip(m, MASSES, strict=True)), **dict(zip(inertia, INERTIAS, strict=True)),
                       **{length[k]: LENGTHS[k] for k in (0, 1, 3)}, **dict(zip(d, CENTRES, strict=True))}
    system.initial = dict(zip(q, POSTURE, strict=True))
    return system


def points(q: Any) -> tuple[list[Any], list[Any]]:
    """Joints P0 ... P5 and centres of mass G1 ... G5 of angles q, with the stance foot P0 at the origin."""
    up = [sp.Matrix([-sp.sin(e), sp.cos(e)]) for e in q]
    foot = sp.zeros(2, 1)
    P1 = foot + LENGTHS[0] * up[0]
    P2 = P1 + LENGTHS[1] * up[1]
    P3, P4 = P2 + LENGTHS[2] * up[2], P2 - LENGTHS[3] * up[3]
    P5 = P4 - LENGTHS[4] * up[4]
    G = [P1 - CENTRES[0] * up[0], P2 - CENTRES[1] * up[1], P2 + CENTRES[2] * up[2], P2 - CENTRES[3] * up[3],
         P4 - CENTRES[4] * up[4]]
    return [foot, P1, P2, P3, P4, P5], G


def boundary(length: float = STEP) -> list[sp.Basic]:
    """One step: the legs change, the impact keeps the angular momentum of all about the foot that lands and of what hangs on each
    joint about it; the foot lands at the step's length, leaves the ground upward, lands downward."""
    q, rates = sp.symbols("q1:6"), sp.symbols(" ".join(f"q{k}_dot" for k in range(1, 6)))
    q0, rates0 = [sp.Symbol(f"{s}(0)") for s in q], [sp.Symbol(f"{s}(0)") for s in rates]
    P, G = points(q)
    moving = lambda what, by: what.jacobian(sp.Matrix(q)) * sp.Matrix(by)
    before = [moving(e, rates) for e in G]
    # After the impact the old swing foot P5 stands, and link k has the rate of the link that it becomes.
    after_rates = [rates0[4 - k] for k in range(5)]
    after = [moving(e - P[5], after_rates) for e in G]

    def momentum(links: tuple[int, ...], about: Any, velocities: list[Any], turning: Any) -> Any:
        arms = [G[k] - about for k in links]
        return sum(MASSES[k] * (a[0] * velocities[k][1] - a[1] * velocities[k][0]) + INERTIAS[k] * turning[k]
                   for k, a in zip(links, arms, strict=True))

    hung = [((0, 1, 2, 3, 4), P[5]), ((0, 1, 2, 3), P[4]), ((2,), P[2]), ((0, 1), P[2]), ((0,), P[1])]
    impact = [sp.Eq(momentum(links, about, before, rates), momentum(links, about, after, after_rates)) for links, about in hung]
    exchange = [sp.Eq(q0[k], q[4 - k]) for k in range(5)]
    start = dict(zip((*q, *rates), (*q0, *rates0), strict=True))
    lift = moving(P[5], rates)[1]
    return [*exchange, *impact, sp.Eq(P[5][0], length), sp.Eq(P[5][1], 0), lift <= 0, lift.xreplace(start) >= 0]


def step(module: Module, length: float = STEP, duration: float = DURATION, **options: Any) -> sd.Optimum:
    """The optimal step: its length, m, its duration, s, options of optimize."""
    there = POSTURE[::-1]
    guess: dict[str, Any] = {f"q{k + 1}": [POSTURE[k], there[k]] for k in range(5)}
    guess |= {f"q{k + 1}_dot": (there[k] - POSTURE[k]) / duration for k in range(5)}
    u = sp.symbols("u1:6")
    bounds: dict[str, Any] = {f"q{k + 1}": (-np.pi / 2, np.pi / 2) for k in range(5)}
    return sd.optimize(module, sd.Loss(integral=sum(e**2 for e in u)), duration, start="free", bounds=bounds,
                       boundary=boundary(length), guess=guess, **options)
