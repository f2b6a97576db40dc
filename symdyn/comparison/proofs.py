"""Proofs that a printed formula is wrong: something independent that the right formula fulfils and the printed one does not.

Every proof measures a residual, which vanishes for a right formula, at random points with 50 digits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from symdyn.comparison.points import DIGITS, Expressions, context, points
from symdyn.comparison.values import canonical, take
from symdyn.errors import CaseError

POINTS = 3
# A residual of a right formula is rounding; with decimal fractions in it, that of a float.
ZERO, ZERO_DECIMAL = 1e-25, 1e-12
# A residual of a wrong formula must be plainly visible.
VISIBLE = 1e-6
Entries = Sequence[tuple[int, ...]] | None


@dataclass(frozen=True)
class Evidence:
    """What a proof measured: the largest residual of the printed formula and of the right one, and whether that proves it."""

    kind: str
    sentence: str
    printed: float
    right: float
    holds: bool

    def __str__(self) -> str:
        return f"{self.sentence} ({self.kind}: printed {self.printed:.2g}, right {self.right:.2g})"


@dataclass(frozen=True)
class Proof:
    """residual(formula) vanishes if the formula is right.

    kind       "limit", "energy balance", "numeric differentiation", "another formulation", ...
    sentence   what is demanded of the formula
    residual   takes the formula as SymPy expression or matrix (of an equation: left minus right), in symdyn's symbols; returns
               an expression, a matrix or numbers
    """

    kind: str
    sentence: str
    residual: Callable[[Any], Any]

    def check(self, printed: Any, right: Any, where: Mapping[str, sp.Expr], entries: Entries = None) -> Evidence:
        """Measure the residuals; entries: those of the formula that are claimed to be wrong."""
        of_printed, _ = self.largest(printed, where, entries)
        of_right, decimal = self.largest(right, where, None)
        bound = ZERO_DECIMAL if decimal else ZERO
        holds = of_right is not None and of_right <= bound and of_printed is not None and of_printed >= VISIBLE
        return Evidence(self.kind, self.sentence, _number(of_printed), _number(of_right), holds)

    def largest(self, formula: Any, where: Mapping[str, sp.Expr], entries: Entries) -> tuple[Any, bool]:
        """The largest residual relative to 1 + its terms at the points, None if it has no value; whether floats are in it."""
        faults: list[str] = []
        taken = take(self.residual(formula), "the residual of a proof", faults)
        if taken is None:
            raise CaseError(faults)
        shape = getattr(formula, "shape", ())
        own = taken.entries
        if entries is not None and taken.shape == tuple(shape):
            places = {tuple(e) for e in entries}
            own = tuple(e for e, place in zip(own, taken.indices()) if place in places)
        replaced = [sp.sympify(e.xreplace({s: where[s.name] for s in e.free_symbols if s.name in where})) for e in own]
        same = canonical(replaced)
        expressions = [e.xreplace(same) for e in replaced]
        evaluator = Expressions(expressions)
        worst, found = 0.0, 0
        for point in points(set(same.values())):
            values = evaluator.at(point)
            if any(v is None for v in values):
                continue
            worst = max([worst, *(float(abs(v)) for v in values)])
            found += 1
            if found == POINTS or not same:
                break
        return (worst if found else None), any(e.has(sp.Float) for e in expressions)


def _number(value: Any) -> float:
    return float("nan") if value is None else float(value)


def other(sentence: str, value: Any) -> Proof:
    """Another formulation gives `value`, of the formula's shape; or a function that returns it."""
    def residual(formula: Any) -> Any:
        own = value() if callable(value) else value
        return sp.Matrix(formula) - sp.Matrix(own) if hasattr(formula, "shape") else formula - own

    return Proof("another formulation", sentence, residual)


def limit(sentence: str, at: Mapping[Any, Any], value: Any) -> Proof:
    """With these values of symbols the formula must become `value`, of its shape."""
    def residual(formula: Any) -> Any:
        names = {str(key): sp.sympify(v) for key, v in at.items()}

        def put(e: sp.Expr) -> sp.Expr:
            return e.subs({s: names[s.name] for s in e.free_symbols if s.name in names}, simultaneous=True)

        there = sp.Matrix(formula).applyfunc(put) if hasattr(formula, "shape") else put(formula)
        return there - sp.Matrix(value) if hasattr(formula, "shape") else there - sp.sympify(value)

    return Proof("limit", sentence, residual)


def dimensions(sentence: str, units: Mapping[Any, Sequence[float]], unit: Sequence[float]) -> Proof:
    """The formula must have the unit (kg, m, s) when its symbols have theirs: units = {m: (1, 0, 0), v: (0, 1, -1), ...}.

    Symbols that are left out are pure numbers. Every unit is made smaller by a factor of its own, and the value must follow.
    """
    factors = (sp.Rational(7, 5), sp.Rational(11, 7), sp.Rational(5, 3))
    powers = {str(key): list(value) for key, value in units.items()}

    def scale(exponents: Sequence[float]) -> sp.Expr:
        return sp.Mul(*[f ** sp.nsimplify(e) for f, e in zip(factors, exponents, strict=True)])

    def residual(formula: Any) -> Any:
        def change(e: sp.Expr) -> sp.Expr:
            return e.xreplace({s: s * scale(powers[s.name]) for s in e.free_symbols if s.name in powers}) - scale(unit) * e

        return sp.Matrix(formula).applyfunc(change) if hasattr(formula, "shape") else change(formula)

    return Proof("dimensions", sentence, residual)


@dataclass(frozen=True)
class _Measured(Proof):
    """A proof whose residual is measured at each point instead of being an expression."""

    def measure(self, formula: list[sp.Expr], where: Mapping[str, sp.Expr]) -> Iterator[list[Any]]:
        raise NotImplementedError

    def largest(self, formula: Any, where: Mapping[str, sp.Expr], entries: Entries) -> tuple[Any, bool]:
        shape = tuple(getattr(formula, "shape", ()))
        taken = take(formula, "the formula of a proof", [])
        assert taken is not None
        worst, found = 0.0, 0
        for values in self.measure(list(taken.entries), where):
            if entries is not None and len(values) == len(taken.entries):
                places = {tuple(e) for e in entries}
                values = [v for v, place in zip(values, taken.indices() if shape else [()]) if place in places]
            if any(v is None for v in values):
                continue
            worst = max([worst, *(float(abs(v)) for v in values)])
            found += 1
            if found == POINTS:
                break
        return (worst if found else None), any(e.has(sp.Float) for e in taken.entries)


def numeric_derivative(sentence: str, of: Any, order: int = 1) -> Proof:
    """The formula must be the derivative of `of` by time, differentiated numerically along a random motion.

    Symbols X, X_dot, X_ddot are a motion and its derivatives, t is the time; all others are constant.
    order   1 or 2
    Raises CaseError for another order.
    """
    if order not in (1, 2):
        raise CaseError([f"numeric differentiation of order {order} asked for; there are orders 1 and 2"])
    return _Differentiation("numeric differentiation", sentence, lambda formula: formula, of, order)


@dataclass(frozen=True)
class _Differentiation(_Measured):
    of: Any = None
    order: int = 1

    def measure(self, formula: list[sp.Expr], where: Mapping[str, sp.Expr]) -> Iterator[list[Any]]:
        taken = take(self.of, "what is differentiated", [])
        assert taken is not None and len(taken.entries) == len(formula), "`of` must have the shape of the formula"
        same = canonical(taken.entries, formula)
        moving, target = Expressions(taken.entries), Expressions([e.xreplace(same) for e in formula])
        own = context(2 * DIGITS)
        step = own.mpf(10) ** -(DIGITS * 3 // 5)
        names = set(moving.names) | set(target.names)
        heads = {n.removesuffix("_dot").removesuffix("_ddot") for n in names if n.endswith(("_dot", "_ddot"))}
        every = {sp.Symbol(n) for n in names | {h + end for h in heads for end in ("", "_dot", "_ddot")}} | set(same.values())
        for drawn in points(_one_each(every)):
            point = {name: own.mpf(value) for name, value in drawn.items()}
            known: dict[Any, list[Any]] = {}

            def at(tau: Any, point: dict[str, Any] = point, known: dict[Any, list[Any]] = known) -> list[Any]:
                if tau not in known:
                    moved = dict(point)
                    for head in heads:
                        q, v, a = (point[head + end] for end in ("", "_dot", "_ddot"))
                        moved |= {head: q + v * tau + a * tau**2 / 2, f"{head}_dot": v + a * tau}
                    if "t" in moved:
                        moved["t"] = point["t"] + tau
                    known[tau] = moving.at(moved, 2 * DIGITS)
                return known[tau]

            values = target.at(point)
            if any(v is None for v in [*values, *at(own.zero)]):
                continue
            slopes = _central_difference(at(step), at(own.zero), at(-step), step, self.order)
            yield [x - y for x, y in zip(values, slopes)]


def _central_difference(after: list[Any], here: list[Any], before: list[Any], step: Any, order: int) -> list[Any]:
    """First or second derivative; the error is of the order of step^2."""
    if order == 1:
        return [(a - b) / (2 * step) for a, b in zip(after, before)]
    return [(a - 2 * x + b) / step**2 for a, x, b in zip(after, here, before)]


def _one_each(symbols: set[sp.Symbol]) -> list[sp.Symbol]:
    """One symbol of each name, the positive one where there are several."""
    chosen: dict[str, sp.Symbol] = {}
    for s in sorted(symbols, key=lambda s: (s.name, bool(s.is_positive))):
        chosen[s.name] = s
    return list(chosen.values())


def energy_balance(sentence: str, coordinates: Sequence[sp.Symbol], energy: Any, equations: Callable[[Any], Any] | None = None,
                   power: Any = 0) -> Proof:
    """The accelerations that solve the equations must change the energy at the rate `power`.

    coordinates   whose second derivatives the equations determine
    energy        E of coordinates, their derivatives (and t)
    equations     makes, of the formula, residuals linear in the second derivatives, as many as coordinates; default: the formula
    power         of what is not in the energy, W
    """
    return _EnergyBalance("energy balance", sentence, equations or (lambda formula: formula), tuple(coordinates), energy, power)


@dataclass(frozen=True)
class _EnergyBalance(_Measured):
    coordinates: tuple[Any, ...] = ()
    energy: Any = None
    power: Any = 0

    def largest(self, formula: Any, where: Mapping[str, sp.Expr], entries: Entries) -> tuple[Any, bool]:
        return super().largest(sp.Matrix([self.residual(formula)]), where, None)

    def measure(self, formula: list[sp.Expr], where: Mapping[str, sp.Expr]) -> Iterator[list[Any]]:
        names = [str(q) for q in self.coordinates]
        plain = canonical(formula, [sp.sympify(self.energy), sp.sympify(self.power)])
        rows = [e.xreplace(plain) for e in formula]
        E, P = (sp.sympify(e).xreplace(plain) for e in (self.energy, self.power))
        by_name = {s.name: s for s in plain.values()}

        def symbol(name: str) -> sp.Symbol:
            return by_name.get(name, sp.Symbol(name, real=True))

        n = len(names)
        q, v, a = ([symbol(name + end) for name in names] for end in ("", "_dot", "_ddot"))
        expressions = Expressions([*[sp.diff(row, x) for row in rows for x in a],
                                   *[row.xreplace(dict.fromkeys(a, sp.S.Zero)) for row in rows],
                                   *[sp.diff(E, x) for x in q], *[sp.diff(E, x) for x in v],
                                   sp.diff(E, symbol("t")), P])
        own = context()
        for point in points({*plain.values(), *q, *v, *a}):
            values = expressions.at(point)
            if any(value is None for value in values):
                continue
            A = own.matrix(np.array(values[:n * len(rows)], dtype=object).reshape(len(rows), n).tolist())
            b = own.matrix(values[n * len(rows):(n + 1) * len(rows)])
            rest = values[(n + 1) * len(rows):]
            try:
                accelerations = own.lu_solve(A, -b)
            except ZeroDivisionError:
                continue
            rate = sum(E_q * point[x.name] for E_q, x in zip(rest[:n], v))
            rate += sum(E_v * accelerations[k] for k, E_v in enumerate(rest[n:2 * n]))
            yield [rate + rest[-2] - rest[-1]]


__all__ = ["Evidence", "Proof", "dimensions", "energy_balance", "limit", "numeric_derivative", "other"]
