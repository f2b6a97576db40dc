"""Proofs that a printed formula is wrong: something independent that the right formula fulfils and the printed one does not.

Every proof measures a residual, which vanishes for a right formula, at random points with 50 digits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.comparison.points import DIGITS, REMAINDER, Expressions, context, points
from symdyn.comparison.values import Value, by_name, canonical, renaming, taken
from symdyn.errors import CaseError, SymdynError
from symdyn.model.symbols import symbols_of

if TYPE_CHECKING:
    from symdyn.given import Matrix, Named, Scalar

POINTS = 4
# With decimal fractions in it, the residual of a right formula is the rounding of a float, and that of a wrong one stands out.
ZERO_DECIMAL, VISIBLE = 1e-12, 1e-6
# Numeric derivatives and balances, relative to what is subtracted.
ZERO_MEASURED = 1e-25
# Stands for the value of a formula that has none in a limit.
INFINITE = sp.Integer(10) ** 30
Entries = Sequence[tuple[int, ...]] | None


@dataclass(frozen=True)
class Evidence:
    """Residuals that a proof measured, the largest of the printed formula and of the right one, and whether that proves it.

    >>> q = sp.Symbol("q")
    >>> proof = sd.proofs.other("sin 2q = 2 sin q cos q", sp.sin(2 * q))
    >>> evidence = proof.check(2 * sp.sin(q), 2 * sp.sin(q) * sp.cos(q), {})
    >>> evidence.holds, evidence.kind, evidence.right < 1e-40
    (True, 'another formulation', True)
    """

    kind: str
    sentence: str
    printed: float
    right: float
    holds: bool
    blind: tuple[tuple[int, ...], ...] = ()

    def __str__(self) -> str:
        blind = f"; it does not see entries {', '.join(map(str, self.blind))}" if self.blind else ""
        return f"{self.sentence} ({self.kind}: printed {self.printed:.2g}, right {self.right:.2g}{blind})"


@dataclass(frozen=True)
class Residual:
    """One entry of a residual: its largest size at the points, whether it vanishes at all of them, whether it is visible at one.

    Entries without real values neither vanish nor are visible.
    """

    size: float
    vanishes: bool
    visible: bool


@dataclass(frozen=True)
class Proof:
    """residual(formula) vanishes if the formula is right.

    kind       "limit", "energy balance", "numeric differentiation", "another formulation", ...
    sentence   what is demanded of the formula
    residual   takes the formula as SymPy expression or matrix (of an equation: left minus right), in symdyn's symbols; returns
               an expression, a matrix or numbers

    >>> q = sp.Symbol("q")
    >>> even = sd.proofs.Proof("symmetry", "The formula is even in q.", lambda formula: formula - formula.subs(q, -q))
    >>> even.check(sp.sin(q), sp.cos(q), {}).holds
    True
    """

    kind: str
    sentence: str
    residual: Callable[[Any], Any]

    def check(self, printed: Any, right: Any, where: Mapping[str, sp.Expr], entries: Entries = None) -> Evidence:
        """Measure both. It holds if the residual of the right formula vanishes and that of the print does not; if residuals are
        entry by entry, that of every entry that is claimed to be wrong.

        Raises CaseError if the residual cannot be formed.

        >>> q = sp.Symbol("q")
        >>> proof = sd.proofs.limit("It vanishes at q = 0.", {q: 0}, 0)
        >>> proof.check(printed=sp.cos(q), right=sp.sin(q), where={}).holds
        True
        """
        moving = _names(printed) | _names(right)
        of_printed, of_right = (self._measured(formula, where, moving) for formula in (printed, right))
        seen = of_printed
        blind: tuple[tuple[int, ...], ...] = ()
        places = taken(printed, "the formula").indices()
        if entries is not None and len(of_printed) == len(places):
            by_place = dict(zip(places, of_printed))
            seen = [by_place[tuple(e)] for e in entries]
            blind = tuple(tuple(e) for e in entries if not by_place[tuple(e)].visible)
        holds = bool(of_right) and all(r.vanishes for r in of_right) and any(r.visible for r in seen) and not blind
        return Evidence(self.kind, self.sentence, _largest(seen), _largest(of_right), holds, blind)

    def _measured(self, formula: Any, where: Mapping[str, sp.Expr], moving: set[str]) -> list[Residual]:
        try:
            return self.measure(formula, where, moving)
        except SymdynError as error:
            raise CaseError([f"the proof {self.sentence!r}: {error}"]) from None
        except Exception as error:  # whatever a user's residual raises is reported as its own
            raise CaseError([f"the proof {self.sentence!r} ended with {type(error).__name__}: {error}"]) from error

    def measure(self, formula: Any, where: Mapping[str, sp.Expr], moving: set[str]) -> list[Residual]:
        """Entry by entry; moving: names of the symbols of both formulas.

        >>> q = sp.Symbol("q")
        >>> proof = sd.proofs.limit("It vanishes at q = 0.", {q: 0}, 0)
        >>> [residual.size for residual in proof.measure(sp.cos(q), {}, {"q"})]
        [1.0]
        """
        residual = taken(self.residual(formula), "the residual")
        residual = residual.replaced(by_name(residual, where))
        same = canonical(residual.entries)
        expressions = [e.xreplace(same) for e in residual.entries]
        evaluator = Expressions(expressions)
        result: list[list[Residual]] = []
        for point in points(set(same.values())):
            values = evaluator.at(point)
            if any(v is None for v in values):
                continue
            again = evaluator.at(point, 2 * DIGITS)
            result.append([_residual(v, w, e.has(sp.Float)) for v, w, e in zip(values, again, expressions)])
            if len(result) == POINTS or not same:
                break
        return _over_points(result, len(expressions))


def _residual(value: Any, again: Any, decimal: bool) -> Residual:
    """Residual of a value, and of the same with twice the digits: rounding shrinks."""
    size = float(abs(value))
    if decimal:
        return Residual(size, size <= ZERO_DECIMAL, size >= VISIBLE)
    vanishes = value == 0 or (again is not None and abs(again) <= REMAINDER * abs(value))
    return Residual(size, vanishes, not vanishes)


def _over_points(result: list[list[Residual]], n: int) -> list[Residual]:
    if not result:
        return [Residual(float("nan"), False, False)] * n
    return [Residual(max(r.size for r in entry), all(r.vanishes for r in entry), any(r.visible for r in entry))
            for entry in zip(*result)]


def _largest(residuals: list[Residual]) -> float:
    return max((r.size for r in residuals), default=float("nan"))


def _names(formula: Any) -> set[str]:
    return {s.name for s in symbols_of(formula)} if hasattr(formula, "free_symbols") else set()


def _minus(formula: Any, value: Any, what: str) -> Any:
    """formula - value, with a message where the shapes differ."""
    own, other_one = taken(formula, "the formula"), taken(value, what)
    if own.shape != other_one.shape:
        raise CaseError([f"{what} has the shape {other_one.shape}, the formula {own.shape}; they must be the same"])
    return own.as_sympy() - other_one.as_sympy()


def other(sentence: str, value: Scalar | Matrix) -> Proof:
    """Another formulation gives `value`, of the formula's shape; or a function that returns it.

    >>> m, l, g, q = sp.symbols("m l g q")
    >>> proof = sd.proofs.other("Lagrange's equation", -m * g * l * sp.sin(q))
    >>> proof.check(printed=-m * g * l, right=-m * g * l * sp.sin(q), where={}).holds
    True
    """
    return Proof("another formulation", sentence,
                 lambda formula: _minus(formula, value() if callable(value) else value, "what the other formulation gives"))


def limit(sentence: str, at: Named[Scalar], value: Scalar | Matrix) -> Proof:
    """With these values of symbols the formula must become `value`, of its shape.

    Raises CaseError for values that are no expressions.

    >>> m, l, g, q = sp.symbols("m l g q")
    >>> proof = sd.proofs.limit("It hangs at rest.", {q: 0}, 0)
    >>> proof.check(printed=-m * g * l, right=-m * g * l * sp.sin(q), where={}).holds
    True
    """
    faults: list[str] = []
    names = renaming(at, f"the limit {sentence!r}", faults)
    if faults:
        raise CaseError(faults)

    def put(e: sp.Expr) -> sp.Expr:
        return e.subs({s: names[s.name] for s in symbols_of(e) if s.name in names}, simultaneous=True)

    def residual(formula: Any) -> Any:
        own = taken(formula, "the formula")
        there = [INFINITE if (limited := put(e)).has(sp.zoo, sp.oo, sp.nan) else limited for e in own.entries]
        return _minus(sp.Matrix(*own.shape, there) if own.shape else there[0], value, "the value of the limit")

    return Proof("limit", sentence, residual)


def dimensions(sentence: str, units: Named[Sequence[float]], unit: Sequence[float]) -> Proof:
    """The formula must have the unit (kg, m, s) when its symbols have theirs: units = {m: (1, 0, 0), v: (0, 1, -1), ...}.

    Symbols that are left out are pure numbers. Every unit is made smaller by a factor of its own, and the value must follow.
    Raises CaseError for units that are not three numbers.

    >>> m, v = sp.symbols("m v")
    >>> proof = sd.proofs.dimensions("It is an energy.", {m: (1, 0, 0), v: (0, 1, -1)}, (1, 2, -2))
    >>> proof.check(printed=m * v / 2, right=m * v**2 / 2, where={}).holds
    True
    """
    factors = (sp.Rational(7, 5), sp.Rational(11, 7), sp.Rational(5, 3))
    powers = {str(key): list(value) for key, value in units.items()}
    faults = [f"the unit of {name} is {given!r}; pass the exponents of kg, m and s" for name, given in
              [*powers.items(), ("the formula", list(unit))]
              if len(given) != 3 or not all(isinstance(e, (int, float, sp.Rational)) for e in given)]
    if faults:
        raise CaseError(faults)

    def scale(exponents: Sequence[float]) -> sp.Expr:
        return sp.Mul(*[f ** sp.nsimplify(e) for f, e in zip(factors, exponents)])

    def change(e: sp.Expr) -> sp.Expr:
        return e.xreplace({s: s * scale(powers[s.name]) for s in symbols_of(e) if s.name in powers}) - scale(unit) * e

    def residual(formula: Any) -> Any:
        own = taken(formula, "the formula")
        changes = [change(e) for e in own.entries]
        return sp.Matrix(*own.shape, changes) if own.shape else changes[0]

    return Proof("dimensions", sentence, residual)


def _relative(value: Any, scale: Any) -> Residual:
    """Residual of a difference, compared with the size of what was subtracted."""
    size = float(abs(value) / scale) if scale else float(abs(value))
    return Residual(size, size <= ZERO_MEASURED, size >= VISIBLE)


def numeric_derivative(sentence: str, of: Any, order: int = 1) -> Proof:
    """The formula must be the derivative of `of` by time, differentiated numerically along a random motion.

    Symbols X, X_dot, X_ddot are a motion and its derivatives, t is the time; all others are constant.
    order   1 or 2
    Raises CaseError for another order, and if `of` is no formula.

    >>> x, x_dot = sp.symbols("x x_dot")
    >>> proof = sd.proofs.numeric_derivative("It is the rate of x^2.", x**2)
    >>> proof.check(printed=x * x_dot, right=2 * x * x_dot, where={}).holds
    True
    """
    if order not in (1, 2):
        raise CaseError([f"numeric differentiation of order {order} asked for; there are orders 1 and 2"])
    return _Differentiation("numeric differentiation", sentence, lambda formula: formula,
                            taken(of, f"what the proof {sentence!r} differentiates"), order)


@dataclass(frozen=True)
class _Differentiation(Proof):
    of: Value
    order: int = 1

    def measure(self, formula: Any, where: Mapping[str, sp.Expr], moving: set[str]) -> list[Residual]:
        given = taken(formula, "the formula")
        if given.shape != self.of.shape:
            raise CaseError([f"what is differentiated has the shape {self.of.shape}, the formula {given.shape}; they must be the "
                             "same"])
        same = canonical(self.of.entries, given.entries)
        path, target = Expressions(self.of.entries), Expressions([e.xreplace(same) for e in given.entries])
        own = context(2 * DIGITS)
        step = own.mpf(10) ** -(DIGITS * 3 // 5)
        names = set(path.names) | set(target.names) | moving
        heads = {n.removesuffix("_dot").removesuffix("_ddot") for n in names if n.endswith(("_dot", "_ddot"))}
        every = {sp.Symbol(n) for n in names | {h + end for h in heads for end in ("", "_dot", "_ddot")}} | set(same.values())
        result: list[list[Residual]] = []
        for drawn in points(_one_each(every)):
            point = {name: own.mpf(value) for name, value in drawn.items()}

            def at(tau: Any, point: dict[str, Any] = point) -> list[Any]:
                moved = dict(point)
                for head in heads:
                    q, v, a = (point[head + end] for end in ("", "_dot", "_ddot"))
                    moved |= {head: q + v * tau + a * tau**2 / 2, f"{head}_dot": v + a * tau}
                if "t" in moved:
                    moved["t"] = point["t"] + tau
                return path.at(moved, 2 * DIGITS)

            values, three = target.at(point), [at(step), at(own.zero), at(-step)]
            if any(v is None for v in [*values, *(v for row in three for v in row)]):
                continue
            slopes = _central_difference(three, step, self.order)
            scale = max(abs(v) for v in [*values, *slopes])
            result.append([_relative(x - y, scale) for x, y in zip(values, slopes)])
            if len(result) == POINTS:
                break
        return _over_points(result, len(given.entries))


def _central_difference(three: list[list[Any]], step: Any, order: int) -> list[Any]:
    """First or second derivative from values after, here and before; the error is of the order of step^2."""
    after, here, before = three
    if order == 1:
        return [(a - b) / (2 * step) for a, b in zip(after, before)]
    return [(a - 2 * x + b) / step**2 for a, x, b in zip(after, here, before)]


def _one_each(symbols: set[sp.Symbol]) -> list[sp.Symbol]:
    """One symbol of each name, the positive one where there are several."""
    chosen: dict[str, sp.Symbol] = {}
    for s in sorted(symbols, key=lambda s: (s.name, bool(s.is_positive))):
        chosen[s.name] = s
    return list(chosen.values())


def energy_balance(sentence: str, coordinates: Sequence[sp.Symbol], energy: Scalar, equations: Callable[[Any], Any] | None = None,
                   power: Scalar = 0) -> Proof:
    """The accelerations that solve the equations must change the energy at the rate `power`.

    coordinates   whose second derivatives the equations determine
    energy        E of coordinates, their derivatives (and t); where a motion is driven, an integral such as Jacobi's does as well
    equations     makes, of the formula, residuals linear in the second derivatives, as many as coordinates; default: the formula
    power         of what is not in the energy, W
    Raises CaseError for an energy or power that is no expression.

    >>> m, g, z, z_dot, z_ddot = sp.symbols("m g z z_dot z_ddot")
    >>> proof = sd.proofs.energy_balance("A fall keeps its energy.", [z], m * z_dot**2 / 2 + m * g * z)
    >>> proof.check(printed=m * z_ddot - m * g, right=m * z_ddot + m * g, where={}).holds
    True
    """
    symbols = (coordinates,) if isinstance(coordinates, sp.Symbol) else tuple(coordinates)
    E, P = (taken(e, f"the {what} of the proof {sentence!r}").entries[0] for e, what in ((energy, "energy"), (power, "power")))
    return _EnergyBalance("energy balance", sentence, equations or (lambda formula: formula), symbols, E, P)


@dataclass(frozen=True)
class _EnergyBalance(Proof):
    coordinates: tuple[Any, ...]
    energy: sp.Expr
    power: sp.Expr

    def measure(self, formula: Any, where: Mapping[str, sp.Expr], moving: set[str]) -> list[Residual]:
        names = [str(q) for q in self.coordinates]
        residuals = taken(self.residual(formula), "the equations").entries
        if len(residuals) != len(names):
            raise CaseError([f"there are {len(residuals)} equations for the second derivatives of {len(names)} coordinates; pass "
                             "`equations` or `coordinates` so that there are as many"])
        plain = canonical(residuals, [self.energy, self.power])
        rows = [e.xreplace(plain) for e in residuals]
        E, P = self.energy.xreplace(plain), self.power.xreplace(plain)
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
        result: list[list[Residual]] = []
        for point in points({*plain.values(), *q, *v, *a}):
            values = expressions.at(point)
            if any(value is None for value in values):
                continue
            A = own.matrix(np.array(values[:n * n], dtype=object).reshape(n, n).tolist())
            rest = values[n * n + n:]
            try:
                accelerations = own.lu_solve(A, -own.matrix(values[n * n:n * n + n]))
            except ZeroDivisionError:
                continue
            terms = [E_q * point[x.name] for E_q, x in zip(rest[:n], v)]
            terms += [E_v * accelerations[k] for k, E_v in enumerate(rest[n:2 * n])]
            terms += [rest[-2], -rest[-1]]
            result.append([_relative(sum(terms), max(abs(term) for term in terms))])
            if len(result) == POINTS:
                break
        return _over_points(result, 1)


__all__ = ["Evidence", "Proof", "dimensions", "energy_balance", "limit", "numeric_derivative", "other"]
