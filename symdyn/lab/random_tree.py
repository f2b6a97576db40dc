"""Random trees of any size, for measurements."""

from __future__ import annotations

import random

from symdyn.model.joints import Prismatic, Revolute, Spherical
from symdyn.model.symbols import parameters
from symdyn.model.system import System

_AXES = ([1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0, 0.8])


def random_tree(n: int, seed: int = 1) -> System:
    """n bodies with full inertia, each hung on one of the last ten before it: revolute joints mostly, some prismatic and
    spherical ones. The same tree for the same seed; parameters g (m/s^2) and, of each body, its mass mi (kg)."""
    rng = random.Random(seed)
    g = parameters("g")
    system = System(f"random_tree_{n}", gravity=[0, 0, -g])
    system.defaults = {g: 9.81}
    bodies = [system.ground]
    for k in range(1, n + 1):
        mass = parameters(f"m{k}")
        system.defaults[mass] = round(rng.uniform(0.5, 2), 3)
        body = system.add_body(f"b{k}", mass=mass, com=_point(rng), inertia=[[0.05, 0.002, 0.001], [0.002, 0.04, 0.003],
                                                                           [0.001, 0.003, 0.06]])
        kind = rng.choices([Revolute, Prismatic, Spherical], [8, 1, 1])[0]
        place = {"parent_point": _point(rng), "child_point": _point(rng)}
        extra = {} if kind is Spherical else {"axis": rng.choice(_AXES)}
        system.add_joint(kind(f"j{k}", rng.choice(bodies[-10:]), body, **place, **extra))
        bodies.append(body)
    return system


def _point(rng: random.Random) -> list[float]:
    return [round(rng.uniform(-0.5, 0.5), 3) for _ in range(3)]
