"""Chains of four-bar linkages in a row, "windows", up to a hundred: how derivation, code and evaluation grow, with accelerations
compared with a dense solution of equations by hand with 60 digits, and the energy of a motion."""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.lab.bridges import BITS, DIGITS, Bar, Bridge, by_hand, measured, microseconds, missed, with_children
from symdyn.pipeline import emit
from symdyn.systems import get

# Numbers of windows.
SIZES = (25, 50, 100)
# s; they lie flat, where the constraints lose rank, after about 0.7 s.
RTOL, DURATION = 1e-9, 0.5
# Relative errors of accelerations and energy, violation of the constraints.
BOUNDS = (1e-12, 1e-8, 1e-11)
HEADING = (f"{'windows':>8}{'speeds':>8}{'rows':>6}{'operations':>12}{'a window':>10}{'derive s':>10}{'compile s':>11}"
           f"{'C bytes':>10}{'us':>8}{'error':>10}{'condition':>11}{'steps':>7}{'energy':>9}{'C':>9}")


@dataclass(frozen=True)
class Row:
    """One chain: sizes, operations of the accelerations; processor seconds to derive and to compile, bytes of C of the right-hand
    side, microseconds of an evaluation; relative error of accelerations, and the condition number of their equations; of a motion
    its steps, errors of the energy balance and of the constraints, relative."""

    windows: int
    speeds: int
    rows: int
    operations: int
    derive: float
    compile: float
    size: int
    microseconds: float
    error: float
    condition: float
    steps: int
    energy: float
    violation: float

    def __str__(self) -> str:
        """A line under HEADING."""
        a_window = self.operations / self.windows
        return (f"{self.windows:>8}{self.speeds:>8}{self.rows:>6}{self.operations:>12}{a_window:>10.1f}{self.derive:>10.2f}"
                f"{self.compile:>11.1f}{self.size:>10}{self.microseconds:>8.2f}{self.error:>10.1e}{self.condition:>11.1e}"
                f"{self.steps:>7}{self.energy:>9.1e}{self.violation:>9.1e}")


def design(n: int) -> Bridge:
    """Bars of n windows of 1 m: uprights 0 ... n, and the bars across, each hung on the upright before it."""
    uprights = [Bar(f"upright{j}", "", (float(j), 0.0), (float(j), 1.0)) for j in range(n + 1)]
    across = [Bar(f"bar{i}", f"upright{i - 1}", (i - 1.0, 1.0), (float(i), 1.0)) for i in range(1, n + 1)]
    return Bridge((*uprights, *across), tuple((f"bar{i}", f"upright{i}") for i in range(1, n + 1)))


def exact(n: int, names: Sequence[str], q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, float]:
    """Accelerations of n_four_bar(n) by equations by hand, in the order of names, and the condition number of these; for
    coordinates and speeds in this order."""
    from flint import arb, ctx

    at = {name: k for k, name in enumerate(names)}
    uprights = [at[f"theta{j}"] for j in range(n + 1)]
    across = [at[f"phi{i}"] for i in range(1, n + 1)]

    def turned(values: np.ndarray, upright: Any) -> list[Any]:
        """From the horizontal, counterclockwise: of the uprights, counted from the vertical, and of the bars relative to them."""
        numbers = [arb(float(e)) for e in values]
        return [*(upright - numbers[k] for k in uprights),
                *(-(numbers[k] + numbers[on]) for k, on in zip(across, uprights[:-1], strict=True))]

    with ctx.workprec(BITS):
        angles, rates = turned(q, arb.pi() / 2), turned(u, arb(0))
        turns, condition = by_hand(design(n), angles, rates)
    result = np.zeros(len(names))
    result[uprights] = -turns[:n + 1, 2]
    result[across] = turns[:n, 2] - turns[n + 1:, 2]
    return result, condition


def measure(n: int) -> Row:
    """One chain. Raises ArithmeticError where its motion stops."""
    begun = clock.process_time()
    equations = get("n_four_bar", n=n).augmented()
    derive = clock.process_time() - begun
    before = with_children()
    module = equations.compile(backend="c")
    rhs = module.bind(None).rhs
    rhs(0.0, np.concatenate(module.consistent()))
    compiled = with_children() - before
    code = next(iter(emit(equations, "c", ("rhs",), standalone=False, integrator=False).files.values()))
    sol = module.simulate((0, DURATION), rtol=RTOL)
    if not sol.success:
        raise ArithmeticError(sol.message)
    x = sol.x[-1]
    wanted, condition = exact(n, module.metadata.q, *np.split(x, 2))
    result = rhs(0.0, x)[len(wanted):]
    error = float(np.abs(result - wanted).max() / np.abs(wanted).max())
    return Row(n, len(wanted), len(equations.constraints), equations.tape("rhs").operations, derive, compiled, len(code),
               microseconds(rhs, x), error, condition, sol.n_steps, sol.energy_error(),
               float(np.abs(sol.constraint_violation).max()))


def run(sizes: Sequence[int] = SIZES, to_json: Path | None = None) -> int:
    """Measure and print; returns how many bounds are missed. Raises ArgumentError for numbers of windows that there are not."""
    if not sizes or min(sizes) < 1:
        raise ArgumentError(f"chains have 1 window or more; found {' '.join(map(str, sizes)) or 'none'}")
    rows = measured(sizes, measure, HEADING, to_json)
    print(f"error of accelerations relative to equations by hand with {DIGITS} digits (<= {BOUNDS[0]:g}); energy and C over "
          f"{DURATION:g} s at rtol {RTOL:g}, relative (<= {BOUNDS[1]:g}, {BOUNDS[2]:g})")
    return missed([(row.error, row.energy, row.violation) for row in rows], BOUNDS)
