"""Suspended footbridges of hundreds of pin-jointed bars in absolute coordinates: how derivation and evaluation grow, with
accelerations compared with a dense solution of equations written by hand, with 60 digits, and the energy of a swing.

A plane truss of pin-jointed bars has no freedom of motion. These bridges do: main cables of bars from tower to tower, hangers,
and a deck of bars from abutment to abutment that sags, too; of n + 1 panels they have 3 n + 2 bars and n - 2 freedoms.
"""

from __future__ import annotations

import json
import math
import os
import time as clock
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.model.joints import Revolute
from symdyn.model.symbols import coordinates, parameters
from symdyn.model.system import System

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from symdyn.runtime.module import Module

Line = TypeVar("Line", bound="DataclassInstance")
# Numbers of bars; 3 n + 2 of n + 1 panels.
SIZES = (20, 50, 101, 200)
# Panels are 1 m long; the towers stand out so high, the main cables and the deck sag so much, as parts of the span.
TOWERS, CABLE_SAG, DECK_SAG = 0.11, 0.1, 0.02
DENSITY, GRAVITY = 12.0, 9.81  # kg/m, m/s^2
# Speed of the antisymmetric swing that motions begin with, m/s.
SWING = 0.5
DIGITS, BITS = 60, 200
RTOL, DURATION = 1e-9, 1.0
# The largest relative error of accelerations, as parts of the condition number; errors of energy and violation of constraints,
# relative, along a motion.
BOUNDS = (2.0**-52, 1e-8, 1e-11)
HEADING = (f"{'bars':>5}{'speeds':>8}{'rows':>6}{'free':>6}{'operations':>12}{'a bar':>7}{'derive s':>10}{'compile s':>11}"
           f"{'us':>8}{'error':>10}{'condition':>11}{'steps':>7}{'s a second':>12}{'energy':>9}{'C':>9}")


@dataclass(frozen=True)
class Bar:
    """A bar between two ends, m: name, and what it hangs on in the tree, "" for the ground."""

    name: str
    on: str
    a: tuple[float, float]
    b: tuple[float, float]

    @property
    def length(self) -> float:
        """m"""
        return math.dist(self.a, self.b)

    @property
    def angle(self) -> float:
        """From the horizontal, rad."""
        return math.atan2(self.b[1] - self.a[1], self.b[0] - self.a[0])


@dataclass(frozen=True)
class Bridge:
    """Bars in the order of the tree; closing: pairs of bars whose second ends meet, "" for the ground."""

    bars: tuple[Bar, ...]
    closing: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Row:
    """One bridge: sizes, operations of the accelerations; processor seconds to derive and to compile, microseconds of an
    evaluation; relative error of accelerations, and the condition number of their equations; of a motion its steps, processor
    seconds for each second, errors of the energy balance and of the constraints, relative."""

    bars: int
    speeds: int
    rows: int
    free: int
    operations: int
    derive: float
    compile: float
    microseconds: float
    error: float
    condition: float
    steps: int
    seconds: float
    energy: float
    violation: float

    def __str__(self) -> str:
        """A line under HEADING."""
        a_bar = self.operations / self.bars
        return (f"{self.bars:>5}{self.speeds:>8}{self.rows:>6}{self.free:>6}{self.operations:>12}{a_bar:>7.0f}"
                f"{self.derive:>10.1f}{self.compile:>11.1f}{self.microseconds:>8.2f}{self.error:>10.1e}"
                f"{self.condition:>11.1e}{self.steps:>7}{self.seconds:>12.3f}{self.energy:>9.1e}{self.violation:>9.1e}")


def design(bars: int) -> Bridge:
    """The bridge of so many bars, 3 n + 2 with n of 3 or more.

    Main cables are parabolas and the deck half a sine: with two parabolas the lengths of cable and deck would change alike, to
    first order, so that the constraints would lose rank. Raises ArgumentError for another number.
    """
    n = (bars - 2) // 3
    if n < 3 or bars != 3 * n + 2:
        raise ArgumentError(f"a footbridge that moves has 3 n + 2 bars, n being 3 or more; found {bars}; take "
                            f"{3 * max(n, 3) + 2}")
    span = n + 1

    def cable(k: int) -> tuple[float, float]:
        return float(k), TOWERS * span - 4 * CABLE_SAG * k * (span - k) / span

    def deck(k: int) -> tuple[float, float]:
        return float(k), -DECK_SAG * span * math.sin(math.pi * k / span)

    made = [Bar(f"cable{k}", f"cable{k - 1}" if k > 1 else "", cable(k - 1), cable(k)) for k in range(1, span + 1)]
    made += [Bar(f"hanger{k}", f"cable{k}", cable(k), deck(k)) for k in range(1, n + 1)]
    made += [Bar(f"deck{k}", f"deck{k - 1}" if k > 1 else "", deck(k - 1), deck(k)) for k in range(1, span + 1)]
    closing = [(f"deck{k}", f"hanger{k}") for k in range(1, n + 1)]
    return Bridge(tuple(made), (*closing, (f"cable{span}", ""), (f"deck{span}", "")))


def footbridge(bars: int) -> System:
    """A suspended footbridge of uniform bars with pins, a mechanism in the plane; the angle of each bar is relative to the one
    that it hangs on. It starts in the shape in which it is designed, nearly at rest there.

    Parameters: g (m/s^2, along -y), rho (kg/m).
    """
    bridge, (g, rho) = design(bars), parameters("g rho")
    system = System(f"footbridge_{bars}", gravity=[0, -g])
    bodies: dict[str, Any] = {"": system.ground}
    by_name = {bar.name: bar for bar in bridge.bars}
    for bar in bridge.bars:
        body = system.add_body(bar.name, mass=rho * bar.length, inertia=rho * (bar.length**3 / 12), com=[bar.length / 2, 0])
        q, = coordinates(f"q_{bar.name},")
        on = by_name.get(bar.on)
        at = [on.length, 0] if on else list(bar.a)
        system.add_joint(Revolute(f"pin_{bar.name}", bodies[bar.on], body, q, parent_point=at))
        system.initial[q] = bar.angle - (on.angle if on else 0.0)
        bodies[bar.name] = body
    for first, second in bridge.closing:
        end, other = by_name[first], by_name.get(second)
        point = [other.length, 0] if other else list(end.b)
        own = [end.length, 0]
        system.close_loop(Revolute(f"close_{first}", bodies[second], bodies[first], parent_point=point, child_point=own))
    system.defaults = {g: GRAVITY, rho: DENSITY}
    return system


def swinging(module: Module, bars: int) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and speeds of an antisymmetric swing, consistent."""
    bridge, begin = design(bars), np.zeros(module.metadata.sizes.u)
    span = len([bar for bar in bridge.bars if bar.name.startswith("deck")])
    places = _places(module, bridge)
    for bar in bridge.bars:
        begin[places[bar.name][1]] = SWING * math.sin(2 * math.pi * (bar.a[0] + bar.b[0]) / 2 / span)
    return module.consistent(u=begin)


def _places(module: Module, bridge: Bridge) -> dict[str, list[int]]:
    """Indices of x and y of the first end and of the angle of each bar among the coordinates, and of their rates among the
    speeds."""
    order = {name: k for k, name in enumerate(module.metadata.q)}
    return {bar.name: [order[f"{letter}_{bar.name}"] for letter in ("x", "y", "theta")] for bar in bridge.bars}


def by_hand(bridge: Bridge, angles: Sequence[Any], rates: Sequence[Any]) -> tuple[np.ndarray, float]:
    """Accelerations of x and y of the first end and of the angle of each bar, (bars, 3), for angles from the horizontal and their
    rates, floats or numbers of more digits; and the condition number of the matrix that is solved with.

    The unknowns are the accelerations of each bar's centre and of its angle, M is diagonal, and pins hold ends together:
    (C M^-1 C^T) lam = C M^-1 f - d as a dense matrix, in balls of DIGITS digits, which enclose the rounding.
    """
    from flint import arb, arb_mat, ctx

    number = {bar.name: k for k, bar in enumerate(bridge.bars)}
    with ctx.workprec(BITS):
        c, s = ([getattr(arb(angle), f)() for angle in angles] for f in ("cos", "sin"))
        square = [arb(rate)**2 for rate in rates]
        half = [arb(bar.length) / 2 for bar in bridge.bars]
        masses = [arb(DENSITY) * arb(bar.length) for bar in bridge.bars]
        inertias = [arb(DENSITY) * arb(bar.length)**3 / 12 for bar in bridge.bars]
        weights = [[1 / m, 1 / m, 1 / inertia] for m, inertia in zip(masses, inertias, strict=True)]

        def end(name: str, second: bool) -> tuple[list[dict[tuple[int, int], Any]], list[Any]]:
            """Factors of the unknowns in the acceleration of an end of a bar, and its part that does not depend on them."""
            k, arm = number[name], half[number[name]] * (1 if second else -1)
            return ([{(k, 0): arb(1), (k, 2): -arm * s[k]}, {(k, 1): arb(1), (k, 2): arm * c[k]}],
                    [-arm * square[k] * c[k], -arm * square[k] * s[k]])

        pins = [((bar.name, False), (bar.on, True)) for bar in bridge.bars]
        pins += [((first, True), (second, True)) for first, second in bridge.closing]
        C, d = [], []
        for one, other in pins:
            factors, known = end(*one)
            if other[0]:
                for row, minus, place in zip(factors, end(*other)[0], (0, 1), strict=True):
                    row.update({key: -value for key, value in minus.items()})
                    known[place] -= end(*other)[1][place]
            C += factors
            d += [-value for value in known]
        S, right = _schur(C, d, weights)
        lam = arb_mat(len(C), len(C), S).solve(arb_mat(len(C), 1, right))
        moved = [[arb(0), -arb(GRAVITY), arb(0)] for _ in bridge.bars]
        for i, row in enumerate(C):
            for (k, place), value in row.items():
                moved[k][place] -= weights[k][place] * value * lam[i, 0]
        result = [[a + half[k] * (alpha * s[k] + square[k] * c[k]), b - half[k] * (alpha * c[k] - square[k] * s[k]), alpha]
                  for k, (a, b, alpha) in enumerate(moved)]
        if any(e.rad() > 1e-30 for row in result for e in row):
            raise ArgumentError(f"{DIGITS} digits do not suffice for {len(bridge.bars)} bars; take fewer")
        matrix = np.array([float(e.mid()) for e in S]).reshape(len(C), len(C))
        return np.array([[float(e.mid()) for e in row] for row in result]), float(np.linalg.cond(matrix))


def _schur(C: Sequence[dict[tuple[int, int], Any]], d: Sequence[Any],
           weights: Sequence[Sequence[Any]]) -> tuple[list[Any], list[Any]]:
    """C M^-1 C^T, row by row, and C M^-1 f - d of the weight."""
    from flint import arb

    S, at = [arb(0)] * len(C)**2, dict[tuple[int, int], list[int]]()
    for i, row in enumerate(C):
        for key in row:
            at.setdefault(key, []).append(i)
    for (k, place), rows in at.items():
        for i in rows:
            for j in rows:
                S[i * len(C) + j] += weights[k][place] * C[i][k, place] * C[j][k, place]
    right = [-arb(GRAVITY) * sum((value for (_, place), value in row.items() if place == 1), arb(0)) - known
             for row, known in zip(C, d, strict=True)]
    return S, right


def measure(bars: int) -> Row:
    """One bridge."""
    begun = clock.process_time()
    bridge, equations = design(bars), footbridge(bars).augmented(coordinates="absolute")
    derive = clock.process_time() - begun
    before = with_children()
    module = equations.compile(backend="c")
    q, u = swinging(module, bars)
    x = np.concatenate([q, u])
    rhs = module.bind(None).rhs
    rhs(0.0, x)
    compiled = with_children() - before
    places = list(_places(module, bridge).values())
    exact, condition = by_hand(bridge, *(values[places][:, 2].tolist() for values in (q, u)))
    error = float(np.abs(rhs(0.0, x)[len(q):][places] - exact).max() / np.abs(exact).max())
    begun = clock.process_time()
    sol = module.simulate((0, DURATION), q, u, rtol=RTOL)
    seconds = (clock.process_time() - begun) / DURATION
    if not sol.success:
        raise ArithmeticError(sol.message)
    violation = float(np.abs(sol.constraint_violation).max())
    return Row(bars, len(u), len(equations.constraints), (bars - 2) // 3 - 2, equations.tape("rhs").operations, derive, compiled,
               microseconds(rhs, x), error, condition, sol.n_steps, seconds, sol.energy_error(), violation)


def microseconds(rhs: Callable[[float, np.ndarray], np.ndarray], x: np.ndarray) -> float:
    """Processor time of one evaluation at a state: the least of 20 means of 100."""
    times = []
    for _ in range(20):
        begun = clock.process_time()
        for _ in range(100):
            rhs(0.0, x)
        times.append((clock.process_time() - begun) / 100)
    return min(times) * 1e6


def with_children() -> float:
    """Processor seconds of this process and of the compilers that it has run."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


def measured(sizes: Sequence[int], measure: Callable[[int], Line], heading: str, to_json: Path | None) -> list[Line]:
    """A record for each size, printed as soon as it is measured, and stored in a file at the end."""
    print(heading)
    rows = []
    for size in sizes:
        rows.append(measure(size))
        print(rows[-1], flush=True)
    if to_json is not None:
        to_json.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n", encoding="utf-8")
    return rows


def run(sizes: Sequence[int] = SIZES, to_json: Path | None = None) -> int:
    """Measure and print; returns how many bounds are missed. Raises ArgumentError for numbers of bars that no bridge has."""
    for bars in sizes:
        design(bars)
    rows = measured(sizes, measure, HEADING, to_json)
    print(f"error of accelerations relative to equations by hand with {DIGITS} digits (<= {BOUNDS[0]:.1e} of the condition "
          f"number); energy and C over {DURATION:g} s at rtol {RTOL:g}, relative (<= {BOUNDS[1]:g}, {BOUNDS[2]:g})")
    return missed([(row.error / row.condition, row.energy, row.violation) for row in rows], BOUNDS)


def missed(errors: Iterable[Sequence[float]], bounds: Sequence[float]) -> int:
    """The number of errors above their bounds, of rows of a table."""
    return sum(error > bound for row in errors for error, bound in zip(row, bounds, strict=True))
