"""Expected results of generated code but for rounding: its own statements with 32 digits, and bounds of rounding errors."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import mpmath
import numpy as np

from symdyn.functions.tapes import function_tape
from symdyn.stress.first_order import HIGHER_ORDER, FirstOrder, first_order
from symdyn.stress.reference import DIGITS, exactly_as_written, halves, largest, leaves
from symdyn.stress.statements import Statements
from symdyn.stress.system_under_test import EPS, SystemUnderTest

# For products of rounding errors, which the first order leaves out, where divisors change by less than HIGHER_ORDER.
SAFETY = 2.0
# Below this numbers lose digits by themselves.
SMALLEST = 1e-290
# Rest of a row of the constraints without the others, of 32 digits, if it depends on them.
NOTHING = 1e-20
# Terms of the equations of motion.
TERMS = ("mass_matrix", "k_tilde", "F_tilde", "C_r")


class Coded:
    """A function as generated code runs it, at rows of its free leaves (n, n_free).

    hi, lo    values with 32 digits as sums of two doubles (n, size), NaN where there are none
    known     (n,), whether a first-order bound holds; divisors: (n,), the largest relative error of one
    comparable   which entries are compared together, and in what scale: see symdyn.stress.reference, together and weights
    """

    def __init__(self, tested: SystemUnderTest, statements: Sequence[Statements], rows: np.ndarray,
                 comparable: tuple[np.ndarray, np.ndarray], true: tuple[np.ndarray, np.ndarray],
                 params: np.ndarray | None = None) -> None:
        n, size = true[0].shape
        self.labels, self.factors = comparable
        self.hi, self.lo = (part.copy() for part in true)
        self.known, self.divisors = np.zeros(n, dtype=bool), np.zeros(n)
        self._bounds = {backend: np.full((n, size), np.inf) for backend in ("c", "numpy")}
        todo = np.arange(n)
        for one in statements:
            if not len(todo):
                break
            result = first_order(one.tape, leaves(tested, rows[todo], params), len(todo))
            self._take(result, todo)
            if one.smooths:
                holds = todo[~result.failed]
                found_there = exactly_as_written(tested, one.tape, rows[holds], params)
                self.hi[holds], self.lo[holds] = halves(found_there, size)
            todo = todo[result.failed]

    def _take(self, result: FirstOrder, where: np.ndarray) -> None:
        self.known[where] = ~result.failed & (result.divisors < HIGHER_ORDER)
        self.divisors[where] = result.divisors
        for backend, bounds in self._bounds.items():
            bounds[where] = SAFETY * result.of(backend)

    def bound(self, backend: str) -> np.ndarray:
        """Bound of rounding errors (n, size), infinite where none is known."""
        result = self._bounds[backend]
        # Products of two errors, where a result is a product of two numbers that vanish but for rounding.
        result = result + EPS * largest(result, self.labels, self.factors)
        return np.where(self.known[:, None], result, np.inf)  # type: ignore[no-any-return]

    def beyond(self, values: np.ndarray, backend: str) -> np.ndarray:
        """Decimal digits by which errors of values (n, size) exceed the bound, (n,); -16 where there is nothing to see."""
        with np.errstate(all="ignore"):
            errors = np.abs((self.hi - values) + self.lo)
            digits = np.log10(errors / self.bound(backend))
        return np.where(errors > SMALLEST, digits, -16.0).max(axis=1, initial=-16.0)  # type: ignore[no-any-return]


def imbalance(tested: SystemUnderTest, rows: np.ndarray, u_dot: np.ndarray, backend: str) -> np.ndarray:
    """Decimal digits by which accelerations (n, n_u) at rows of free leaves miss M u_dot + k + C_r^T lam = F, whatever lam is,
    beyond what is due, (n,).

    Due is that they solve equations whose entries are off by their own first-order bounds and by what the factors of M round off,
    which are no larger than roots of M_ii M_jj as long as a digit is left of every pivot. The equations are taken with 32 digits,
    their rows in units of the root of their inertia.
    """
    if not len(rows):
        return np.zeros(0)
    tapes = {name: function_tape(tested.equations, name) for name in TERMS if tested.has(name)}
    true = {name: exactly_as_written(tested, tape, rows) for name, tape in tapes.items()}
    off = {}
    for name, tape in tapes.items():
        result = SAFETY * first_order(tape, leaves(tested, rows), len(rows)).of(backend)
        # An algorithm with branches counts so many roundings of the largest value.
        sizes = np.abs(halves(true[name], result.shape[1])[0]).max(axis=1, initial=0.0, keepdims=True)
        off[name] = np.where(np.isfinite(result), result, EPS * tape.longest_chain() * sizes)
    missed = np.full(len(u_dot), -16.0)
    with mpmath.workdps(DIGITS):
        for k, row in enumerate(u_dot):
            taken = {name: _numbers(values[k] or [mpmath.nan]) for name, values in true.items()}
            if np.isfinite(row).all() and all(mpmath.isfinite(v) for values in taken.values() for v in values):
                missed[k] = _missed(taken, row, {name: values[k] for name, values in off.items()})
    return missed


def _missed(taken: dict[str, np.ndarray], row: np.ndarray, off: dict[str, np.ndarray]) -> float:
    n = len(row)
    M, C = taken["mass_matrix"].reshape(n, n), taken.get("C_r", np.zeros(0)).reshape(-1, n)
    roots = _numbers([mpmath.sqrt(m) if m > 0 else 1 for m in np.diagonal(M)])
    size, rounds = np.abs(row), 4 * n * EPS
    rest = M @ _numbers(row)
    due = off["mass_matrix"].reshape(n, n) @ size + rounds * roots * (_numbers(size) @ roots)
    for name, sign in (("k_tilde", 1), ("F_tilde", -1)):
        if name in taken:
            rest = rest + sign * taken[name]
            due = due + off[name] + rounds * np.abs(taken[name])
    left, lam = _without(rest / roots, C / roots)
    if len(C):
        due = due + (off["C_r"].reshape(C.shape) + rounds * np.abs(C)).T @ np.abs(lam)
    miss, least = _length(left), _length(due / roots)
    return -16.0 if miss <= SMALLEST else float(mpmath.log10(miss / least)) if least > 0 else np.inf


def _numbers(values: Iterable[Any]) -> np.ndarray:
    """Numbers of mpmath with the digits that are set."""
    return np.array([mpmath.mpf(v) for v in values], dtype=object)


def _without(vector: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A vector of mpmath's numbers without its parts along rows, and factors of the rows that make up these."""
    units: list[tuple[np.ndarray, np.ndarray]] = []  # each with the factors of the rows that make it up
    for k, row in enumerate(rows):
        unit, factors = row, _numbers(int(k == other) for other in range(len(rows)))
        for _ in range(2):
            for other, of_other in units:
                part = unit @ other
                unit, factors = unit - part * other, factors - part * of_other
        size = _length(unit)
        if size > NOTHING * _length(row):
            units.append((unit / size, factors / size))
    lam = _numbers(np.zeros(len(rows)))
    for _ in range(2):
        for unit, factors in units:
            part = vector @ unit
            vector, lam = vector - part * unit, lam + part * factors
    return vector, lam


def _length(vector: np.ndarray) -> mpmath.mpf:
    return mpmath.sqrt(sum(v * v for v in vector))
