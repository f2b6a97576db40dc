"""Nets of rods between particles, with many loops and many freedoms: derivation, compilation and evaluation over their size, with
accelerations compared with a dense solution of equations by hand with 60 digits, and the energy of a motion."""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.lab.bridges import measured, microseconds, missed, with_children
from symdyn.lab.particles import add_particle
from symdyn.model.closures import Rod
from symdyn.model.symbols import parameters
from symdyn.model.system import System

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Numbers of particles along each side.
SIZES = (5, 10)
# Distances of particles in the row before the net folds, in rods of 1 m, and how far every second one lies back.
WIDTH, DEPTH, GRAVITY = 0.9, float(np.sqrt(1 - 0.9**2)), 9.81
BITS = 200
RTOL, DURATION = 1e-9, 0.05
# Relative errors of accelerations and energy, violation of the constraints.
BOUNDS = (1e-12, 1e-8, 1e-11)
HEADING = (f"{'side':>5}{'speeds':>8}{'rows':>6}{'operations':>12}{'derive s':>10}{'write s':>9}{'compile s':>11}{'us':>9}"
           f"{'error':>10}{'steps':>7}{'energy':>9}{'C':>9}")


@dataclass(frozen=True)
class Row:
    """One net: sizes, operations of x_dot; processor seconds to derive, to write the code and to compile, microseconds of an
    evaluation; relative error of accelerations; of a motion its steps, errors of energy and of the constraints, relative."""

    side: int
    speeds: int
    rows: int
    operations: int
    derive: float
    write: float
    compile: float
    microseconds: float
    error: float
    steps: int
    energy: float
    violation: float

    def __str__(self) -> str:
        """A line under HEADING."""
        return (f"{self.side:>5}{self.speeds:>8}{self.rows:>6}{self.operations:>12}{self.derive:>10.1f}{self.write:>9.1f}"
                f"{self.compile:>11.1f}{self.microseconds:>9.2f}{self.error:>10.1e}{self.steps:>7}{self.energy:>9.1e}"
                f"{self.violation:>9.1e}")


def net(rows: int, columns: int) -> System:
    """Particles that rods join to their neighbours; all hang from the two outer ones of the first row, which stand still."""
    mass, gravity, length = parameters("m g l")
    system = System(f"net_{rows}_{columns}", gravity=[0, 0, -gravity])
    knots: dict[tuple[int, int], Any] = {}
    for i, j in np.ndindex(rows, columns):
        at = [WIDTH * j, DEPTH * (j % 2), -1.0 * i]
        if i == 0 and j in (0, columns - 1):
            knots[i, j] = system.ground, at
            continue
        body, position = add_particle(system, f"{i}_{j}", mass)
        system.initial.update(zip(position, at, strict=True))
        knots[i, j] = body, [0, 0, 0]
    for i, j in knots:
        for other in ((i, j + 1), (i + 1, j)):
            if other in knots and not (knots[i, j][0] is knots[other][0] is system.ground):
                (a, at), (b, there) = knots[i, j], knots[other]
                system.close_loop(Rod(f"rod_{i}_{j}_{other[0]}_{other[1]}", a, b, length, parent_point=at, child_point=there))
    system.defaults = {mass: 0.1, gravity: GRAVITY, length: 1.0}
    return system


def by_hand(rows: int, columns: int, names: Sequence[str], q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Accelerations of the particles, in the order of names, for coordinates and speeds in that order.

    Each rod with ends D apart has D . D_ddot = -D_dot . D_dot, and its force acts along D: the multipliers are solved for as a
    dense matrix, in balls of many digits, which enclose the rounding.
    """
    from flint import arb, arb_mat, ctx

    index = {name: k for k, name in enumerate(names)}
    with ctx.workprec(BITS):
        def known(values: np.ndarray, knot: tuple[int, int], still: Sequence[float]) -> list[Any]:
            keys = [f"{letter}{knot[0]}_{knot[1]}" for letter in "xyz"]
            return [arb(float(values[index[key]])) if key in index else arb(e) for key, e in zip(keys, still, strict=True)]

        C, right = list[dict[int, Any]](), []
        for i, j in np.ndindex(rows, columns):
            for other in ((i, j + 1), (i + 1, j)):
                if other[0] == rows or other[1] == columns:
                    continue
                ends = [(knot, [WIDTH * knot[1], DEPTH * (knot[1] % 2), -1.0 * knot[0]]) for knot in ((i, j), other)]
                D = [b - a for a, b in zip(*(known(q, knot, at) for knot, at in ends), strict=True)]
                rates = [b - a for a, b in zip(*(known(u, knot, [0.0] * 3) for knot, _ in ends), strict=True)]
                row = {index[key]: sign * along for (a, b), sign in zip(((i, j), other), (-1, 1), strict=True)
                       for letter, along in zip("xyz", D, strict=True) if (key := f"{letter}{a}_{b}") in index}
                if row:
                    C.append(row)
                    right.append(sum((e * e for e in rates), arb(0)))
        weight = [arb(-GRAVITY) if name.startswith("z") else arb(0) for name in names]
        at: list[list[int]] = [[] for _ in names]
        for i, row in enumerate(C):
            for k, value in row.items():
                at[k].append(i)
                right[i] += value * weight[k]
        S = [arb(0)] * len(C)**2
        for k, together in enumerate(at):
            for i in together:
                for j in together:
                    S[i * len(C) + j] += C[i][k] * C[j][k]
        pull = arb_mat(len(C), len(C), S).solve(arb_mat(len(C), 1, right))  # by mass
        pulled = [sum((C[i][k] * pull[i, 0] for i in together), arb(0)) for k, together in enumerate(at)]
        result = [g - p for g, p in zip(weight, pulled, strict=True)]
        if any(e.rad() > 1e-30 for e in result):
            raise ArgumentError(f"{BITS} bits do not suffice for a net of {rows} x {columns}; take a smaller one")
        return np.array([float(e.mid()) for e in result])


def moving(module: Module) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and speeds of a motion of all particles, consistent."""
    return module.consistent(u=np.random.default_rng(2).normal(size=module.metadata.sizes.u))


def measure(side: int) -> Row:
    """One net. Raises ArithmeticError where its motion stops."""
    begun = clock.process_time()
    equations = net(side, side).augmented()
    derive = clock.process_time() - begun
    before, begun = with_children(), clock.process_time()
    module = equations.compile(backend="c")
    q, u = moving(module)
    x, rhs = np.concatenate([q, u]), module.bind(None).rhs
    result = rhs(0.0, x)[len(q):]
    write = clock.process_time() - begun
    compiled = with_children() - before - write
    exact = by_hand(side, side, module.metadata.q, q, u)
    sol = module.simulate((0, DURATION), q, u, rtol=RTOL)
    if not sol.success:
        raise ArithmeticError(sol.message)
    return Row(side, len(u), len(equations.constraints), equations.tape("rhs").operations, derive, write, compiled,
               microseconds(rhs, x), float(np.abs(result - exact).max() / np.abs(exact).max()), sol.n_steps, sol.energy_error(),
               float(np.abs(sol.constraint_violation).max()))


def run(sizes: Sequence[int] = SIZES, to_json: Path | None = None) -> int:
    """Measure and print; returns how many bounds are missed. Raises ArgumentError for sides of less than 3 particles."""
    if not sizes or min(sizes) < 3:
        result = " ".join(map(str, sizes)) or "none"
        raise ArgumentError(f"nets take numbers of particles along a side, 3 or more; found {result}")
    rows = measured(sizes, measure, HEADING, to_json)
    print(f"error of accelerations relative to equations by hand with {BITS} bits (<= {BOUNDS[0]:g}); energy and C over "
          f"{DURATION:g} s at rtol {RTOL:g}, relative (<= {BOUNDS[1]:g}, {BOUNDS[2]:g})")
    return missed([(row.error, row.energy, row.violation) for row in rows], BOUNDS)
