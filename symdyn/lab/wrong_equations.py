"""Equations that are right, and the same with one entry of one quantity wrong: which of them `verify` accepts.

    python -m symdyn.lab.wrong_equations [--states N]

Every entry that is not a plain number is made wrong in three ways: its sign is changed, a term of it is left out, or it is
multiplied by 1 + 1e-9; reactions only where all of them are verified. Printed are, system by system, false alarms among the
identities of the right equations, and how many of the wrong ones are found; those whose entry changes by less than 1e-12 of the
largest one at the state are left out.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np
import sympy as sp

import symdyn as sd
from symdyn.formulation.equations import Equations
from symdyn.tape.node import Node
from symdyn.verification import checks_of, judged, reactions
from symdyn.verification.sample import Sample
from symdyn.verification.states import samples

DIGITS = 30
# An entry that changes by less of the largest one of its quantity is not wrong enough to be counted.
VISIBLE = 1e-12
QUANTITIES = ("M_tilde", "k_tilde", "F_tilde", "inverse_dynamics", "accelerations", "energy", "power", "J", "coriolis", "C_r",
              "F_d", "C_dot", "lam", "reactions")
WAYS = ("sign changed", "term left out", "1e-9 off")
# A rotation whose entries are doubles: it is one to sixteen digits only.
TURNED = np.linalg.qr(np.array([[2.0, -1.0, 0.3], [0.4, 1.7, -0.6], [0.1, 0.9, 1.1]]))[0]


def chain() -> Equations:
    """Bodies on ball joints whose frames are turned by matrices of doubles."""
    system = sd.System("chain", gravity=[0, 0, -9.81])
    parent = system.ground
    for k in range(2):
        body = system.add_body(f"b{k}", mass=1.3, inertia=[[0.3, 0.01, 0.02], [0.01, 0.2, 0.03], [0.02, 0.03, 0.25]],
                               com=[0.1, 0.2, 0.3])
        system.add_joint(sd.Spherical(f"j{k}", parent, body, parent_point=[0.3, 0.4, 0.5], parent_rotation=_rotation()))
        parent = body
    return system.recursive()


def beam() -> Equations:
    """A flexible body in a turned frame, and a body on its end."""
    system = sd.System("beam", gravity=[0, 0, -9.81])
    hub = system.add_body("hub", mass=1.3, inertia=[0.3, 0.2, 0.25], com=[0.1, 0.2, 0.3])
    system.add_joint(sd.Spherical("ball", system.ground, hub))
    bending = sd.Beam([0, 1, 2.5, 4], [3, 2.5, 2, 1.5], [300, 250, 200, 100], 1, damping_ratio=0.02)
    mast = system.add_flexible_body("mast", bending)
    system.add_joint(sd.Fixed("step", hub, mast.root, parent_point=[0.1, 0.2, 0.3], parent_rotation=_rotation()))
    head = system.add_body("head", mass=2, inertia=[1, 1, 1.5], com=[0.1, 0.1, 0.1])
    system.add_joint(sd.Revolute("yaw", mast.tip, head, axis=[0.6, 0, 0.8]))
    return system.embedding()


def geared() -> Equations:
    """A joint that drives another one, a joint that mimics it, and a constraint between coordinates."""
    q1, q2 = sd.coordinates("q1 q2")
    system = sd.System("geared", gravity=[0, -9.81, 0])
    parent = system.ground
    for k, q in enumerate((q1, q2, sp.Rational(1, 10) - 2 * q1, sp.UnevaluatedExpr(q1))):
        body = system.add_body(f"b{k}", mass=1.3 - k / 4, inertia=[0.1, 0.2, 0.3], com=[0.4, 0.1, 0])
        system.add_joint(sd.Revolute(f"j{k}", parent, body, q, parent_point=[k and 1, 0, 0]))
        parent = body
    system.add_constraint(q1 - 2 * q2 - sp.sin(q2) / 10)
    return system.augmented()


def closed() -> Equations:
    """A planar loop of four bars."""
    return sd.systems.get("four_bar").augmented()


def damped() -> Equations:
    """Speeds with names, and quasi-velocities, with a damper."""
    q, u = sd.coordinates("q"), sd.speeds("u")
    system = sd.System("damped", gravity=[0, 0, -9.81])
    arm = system.add_body("arm", mass=2, inertia=[0.1, 0.3, 0.2], com=[0.3, 0, 0.1])
    system.add_joint(sd.Revolute("pivot", system.ground, arm, q, axis=[0, 1, 0], speed=u))
    system.add_joint_force("pivot", -0.3 * q.diff(sd.t) - 2 * q)
    ball = system.add_body("ball", mass=1, inertia=[0.1, 0.2, 0.3], com=[0.1, 0.2, 0])
    system.add_joint(sd.Spherical("ball", arm, ball, orientation=sd.EulerAngles("ZYX", speeds="body"), parent_point=[0.5, 0, 0]))
    return system.embedding()


SYSTEMS: tuple[Callable[[], Equations], ...] = (chain, beam, geared, closed, damped)


@dataclass
class Tally:
    """Tally of one system: names of identities that fail though the equations are right; how many wrong equations there were and
    were found, by way; what was accepted, as (quantity, index, way)."""

    alarms: list[str]
    tried: Counter[str] = field(default_factory=Counter)
    found: Counter[str] = field(default_factory=Counter)
    accepted: list[tuple[str, int, str]] = field(default_factory=list)


def sweep(equations: Equations, states: int = 1, quantities: tuple[str, ...] = QUANTITIES, every: int = 1) -> Tally:
    """Verify the equations, and all wrong ones; every: only each such entry of a quantity."""
    drawn = samples(equations, states, DIGITS, None, 1)
    tally = Tally([*_failing(equations, drawn)])
    for name in quantities:
        if name not in equations.quantities or (name == "reactions" and not _reactions_are_verified(drawn[0])):
            continue
        for index, way, wrong in list(_wrong(equations, name))[::every]:
            spoilt = dataclasses.replace(equations, _recorded={**equations._recorded, name: wrong}, _printed={})
            if not any(_changed(name, a, b) for a, b in zip(drawn, _at(spoilt, drawn), strict=True)):
                continue
            tally.tried[way] += 1
            if any(_failing(spoilt, _at(spoilt, drawn))):
                tally.found[way] += 1
            else:
                tally.accepted.append((name, index, way))
    return tally


def _reactions_are_verified(sample: Sample) -> bool:
    return bool(sample.equations.constraints) and reactions.move_every_body(sample) is not None


def _rotation() -> Any:
    return TURNED * np.linalg.det(TURNED)


def _failing(equations: Equations, drawn: list[Sample]) -> Iterator[str]:
    checks = (judged(drawn, *row) for row in checks_of(equations))
    return (check.name for check in checks if check.passed is False)


def _at(equations: Equations, drawn: list[Sample]) -> list[Sample]:
    """The same states of other equations."""
    return [Sample(equations, s.values, s.digits, s.numbers, s.independent) for s in drawn]


def _changed(name: str, right: Sample, wrong: Sample) -> bool:
    difference, size = ([abs(float(v)) for v in np.ravel(array)] for array in (wrong[name] - right[name], right[name]))
    return max(difference, default=0.0) > VISIBLE * max(size, default=0.0)


def _wrong(equations: Equations, name: str) -> Iterator[tuple[int, str, np.ndarray]]:
    right = equations.quantity(name)
    for index, entry in enumerate(right.ravel()):
        if not isinstance(entry, Node):
            continue
        changes: dict[str, Any] = {WAYS[0]: -entry, WAYS[2]: entry * (1 + Fraction(1, 10**9))}
        if entry.op in ("add", "sub"):
            changes[WAYS[1]] = entry.args[0]
        for way, value in changes.items():
            wrong = right.copy()
            wrong.reshape(-1)[index] = value
            yield index, way, wrong


def main() -> None:
    """Print the counts of all systems."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--states", type=int, default=1, help="random states of each system")
    parser.add_argument("--every", type=int, default=1, help="take only each such wrong entry")
    arguments = parser.parse_args()
    for make in SYSTEMS:
        equations = make()
        tally = sweep(equations, arguments.states, every=arguments.every)
        counts = ", ".join(f"{way} {tally.found[way]} of {tally.tried[way]}" for way in WAYS)
        print(f"{equations.name} ({equations.formulation}): false alarms {len(tally.alarms)}; found: {counts}")
        for line in [*tally.alarms, *map(str, tally.accepted)]:
            print(f"    {line}")


if __name__ == "__main__":
    main()
