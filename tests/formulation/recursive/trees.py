"""Random trees of 2 to 6 bodies with every kind of joint, and random states of them, in floats or many digits."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import mpmath
import numpy as np
import sympy as sp

import symdyn as sd
from symdyn.formulation.textbook.numbers import Numbers, NumericTree
from symdyn.model.orientation import SEQUENCES
from tests.helpers import swept

KINDS = ("revolute", "free", "universal", "prismatic", "body angles", "cylindrical", "angles", "helical", "free parameters",
         "planar", "parameters", "custom", "fixed", "free body")
FEW = range(5)  # seeds of trees that have every kind of joint, and all sizes
ROTATIONS = [None, sp.Matrix([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]), sp.Matrix([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3]
AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0, 0.8], [sp.Rational(2, 3), sp.Rational(-2, 3), sp.Rational(1, 3)]]


class RandomTree:
    """A tree drawn from a seed.

    gears    with joints that follow others (not in time); driven: with joints and a ground that follow functions of time
    loads    with a spring and damper, forces in several frames, drives
    """

    def __init__(self, seed: int, gears: bool = False, driven: bool = False, loads: bool = True) -> None:
        self.rng = random.Random(seed)
        self.m, self.g, self.k, self.d = sd.parameters("m g k d")
        self.system = sd.System(f"tree_{seed}", gravity=[self.some(), self.some(), -self.g])
        self.system.defaults = {self.m: 1.25, self.g: 9.8125, self.k: 3.5, self.d: 0.375}
        self.free: list[sp.Symbol] = []
        for n in range(2 + seed % 5):
            self.add(n, KINDS[(3 * seed + n) % len(KINDS)])
        if gears:
            q = self.free
            self.attach("gear_1", sd.Revolute, 2 * q[0] + sp.sin(q[-1]))
            self.attach("gear_2", sd.Universal, [q[0] + q[-1], q[0] * q[-1]])
        if driven:
            t, (q,) = sd.t, self.coordinates(1)
            self.attach("given_1", sd.Cylindrical, [sp.sin(2 * t), q], axis=[0, 0.6, 0.8])
            self.attach("given_2", sd.Spherical, [t, sp.cos(t), t**2 / 3])
            self.system.move_ground([sp.sin(t), self.some() * t**2, 0], [self.some() * t, 0, sp.cos(t)])
        if loads:
            self.load()

    def some(self) -> sp.Rational:
        return sp.Rational(self.rng.randint(-9, 9), 10)

    def point(self) -> list[sp.Rational]:
        return [self.some() for _ in range(3)]

    def coordinates(self, n: int) -> list[Any]:
        made = list(sd.coordinates(f"q{len(self.free) + 1}:{len(self.free) + n + 1}"))
        self.free += made
        return made

    def attach(self, name: str, joint: Any, *arguments: Any, **options: Any) -> None:
        rng, s = self.rng, self.system
        A = sp.Matrix(3, 3, lambda i, j: sp.Rational(rng.randint(-5, 5), 10))
        parent = rng.choice([s.ground, *s.bodies, *s.bodies])
        body = s.add_body(f"body_{name}", mass=self.m + len(s.bodies), com=self.point(),
                          inertia=A * A.T + sp.diag(3, 3.25, 3.5))
        s.add_joint(joint(name, parent, body, *arguments, **options, parent_point=self.point(), child_point=self.point(),
                          parent_rotation=rng.choice(ROTATIONS), child_rotation=rng.choice(ROTATIONS)))

    def add(self, n: int, kind: str) -> None:
        name, axis, sequence = f"{kind.replace(' ', '_')}_{n}", self.rng.choice(AXES), self.rng.choice(SEQUENCES)
        if kind == "fixed":
            return self.attach(name, sd.Fixed)
        if "parameters" in kind:
            four = sd.coordinates(f"e0{n} e1{n} e2{n} e3{n}")
            if kind == "parameters":
                return self.attach(name, sd.Spherical, four, sd.EulerParameters())
            return self.attach(name, sd.Free, [*self.coordinates(3), *four], sd.EulerParameters(), velocity="body")
        if kind == "custom":
            a, b = self.coordinates(2)
            R = sp.Matrix([[sp.cos(a), -sp.sin(a), 0], [sp.sin(a), sp.cos(a), 0], [0, 0, 1]])
            return self.attach(name, sd.Custom, [a, b], R, [b * sp.cos(2 * a), b * sp.sin(2 * a), a * b])
        joints: dict[str, tuple[Any, int, dict[str, Any]]] = {
            "revolute": (sd.Revolute, 1, {"axis": axis}), "prismatic": (sd.Prismatic, 1, {"axis": axis}),
            "helical": (sd.Helical, 1, {"axis": axis, "pitch": sp.Rational(1, 5)}),
            "cylindrical": (sd.Cylindrical, 2, {"axis": axis}), "universal": (sd.Universal, 2, {}), "planar": (sd.Planar, 3, {}),
            "angles": (sd.Spherical, 3, {"orientation": sd.EulerAngles(sequence)}),
            "body angles": (sd.Spherical, 3, {"orientation": sd.EulerAngles(sequence, "body")}),
            "free": (sd.Free, 6, {"orientation": sd.EulerAngles(sequence)}), "free body": (sd.Free, 6, {"velocity": "body"})}
        joint, n_q, options = joints[kind]
        q = self.coordinates(n_q)
        return self.attach(name, joint, *(q if n_q == 1 else [q]), **options)

    def load(self) -> None:
        s, rng = self.system, self.rng
        F, q = sd.inputs("F"), self.free[0]
        one, other = rng.sample([s.ground, *s.bodies], 2)
        s.initial = {F: 0.75}
        s.add_spring_damper(one, other, self.point(), self.point(), stiffness=self.k, damping=self.d, length=sp.Rational(1, 3))
        s.add_force(s.bodies[-1], [F, sp.sin(sd.t), q], point=self.point(), frame=s.bodies[1], reaction=s.bodies[0])
        s.add_torque(s.bodies[1], [q, 1, 2 * F])
        moving = [j for j in s.joints if j.n_speeds]
        s.add_joint_force(moving[0], [-self.d * q, *[F] * (moving[0].n_speeds - 1)])


def few_of(cases: Sequence[tuple[int, Any]]) -> list[Any]:
    """Cases of a seed and options, of which all but those of a few seeds are left to the sweep."""
    return swept(cases, *(case for case in cases if case[0] in FEW))


@lru_cache
def numeric(seed: int, **options: bool) -> NumericTree:
    """The numeric tree of a random tree, derived once."""
    return NumericTree(RandomTree(seed, **options).system.check())


def state(tree: NumericTree, seed: int, digits: int = 15) -> dict[str, Any]:
    """A random state for NumericTree.at; Euler parameters of unit norm to so many digits."""
    rng = random.Random(seed)
    model = tree.model
    q = {s.name: rng.randint(2**18, 2**20) / 2**20 + 0.125 for s in model.coordinates}
    u = {s.name: rng.randint(-(2**20), 2**20) / 2**20 for s in model.speeds}
    with mpmath.workdps(digits + 10):
        for first in [name for name in q if name.startswith("e0")]:
            group = [f"e{k}{first[2:]}" for k in range(4)]
            norm = mpmath.sqrt(sum(mpmath.mpf(q[name]) ** 2 for name in group))
            q.update({name: q[name] / norm if digits > 15 else float(q[name] / norm) for name in group})
    return {"q": q, "u": u, "t": 0.375}


def at(tree: NumericTree, seed: int, digits: int | None = None) -> Numbers:
    """The tree at a random state."""
    return tree.at(**state(tree, seed, digits or 15), digits=digits)


def by_time(tree: NumericTree, where: Mapping[str, Any], u_dot: Any, quantity: Any) -> np.ndarray:
    """Derivative by time of quantity(tree) along the motion, by a central difference with 60 digits, good to 40."""
    rates = tree.at(**where, digits=60).tree.rates
    ends = []
    with mpmath.workdps(60):
        for h in (mpmath.mpf(10) ** -20, -(mpmath.mpf(10) ** -20)):
            q = {name: mpmath.mpf(v) + h * rate for (name, v), rate in zip(where["q"].items(), rates, strict=True)}
            u = {name: mpmath.mpf(v) + h * a for (name, v), a in zip(where["u"].items(), u_dot, strict=True)}
            there = tree.at(q, u, t=mpmath.mpf(where["t"]) + h, digits=60).tree
            ends.append(np.asarray(quantity(there), dtype=object))
        return (ends[0] - ends[1]) / (2 * mpmath.mpf(10) ** -20)


def random_vector(n: int, seed: int) -> np.ndarray:
    """n numbers in [-1, 1], exact in floats."""
    rng = random.Random(seed)
    result = np.empty(n, dtype=object)
    result[:] = [rng.randint(-(2**20), 2**20) / 2**20 for _ in range(n)]
    return result


def relative(a: Any, b: Any) -> float:
    """|a - b| / |b|, norm-wise."""
    difference = np.asarray(a, dtype=object) - np.asarray(b, dtype=object)
    return float(np.linalg.norm(difference.astype(float)) / max(np.linalg.norm(np.asarray(b, dtype=float)), 1e-300))


def check(a: Any, b: Any, tolerance: float) -> None:
    """Assert that a is b but for so much, norm-wise."""
    error = relative(a, b)
    if not error < tolerance:
        raise AssertionError(f"they differ by {error:.2g}, allowed is {tolerance:.2g}")
