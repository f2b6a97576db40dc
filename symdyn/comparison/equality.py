"""Whether two formulas are the same: after renaming, by exact algebra, at random points.

Exact algebra proves that expressions are equal. A point where values differ refutes it. Where neither is found, which decimal
numbers and functions without relations make possible, values are sampled: points lie at ordinary sizes, at tiny, huge and mixed
ones, near special values, and in every branch of a Piecewise that a search reaches; the words of a decision name what was
covered, and why there is no proof.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import sympy as sp

from symdyn.comparison.branches import Branch, Visits, branches
from symdyn.comparison.points import DIGITS, REMAINDER, Expressions, context, points, wide_points
from symdyn.comparison.values import canonical
from symdyn.errors import UnsupportedExpression
from symdyn.exact.prove import unproved
from symdyn.model.symbols import symbols_of

# Points of ordinary sizes and of other ones at which values must agree.
POINTS, WIDE = 12, 12
FEWEST = 3
# Differences that are rounding for sure, relative to the values; others are looked at again with twice the digits.
ROUNDING = 1e-45
# A decimal fraction such as 9.81 in a formula has the digits of a float. Differences count relative to what the formulas change
# by where each of their floats changes by its own size: below the first they are the rounding of floats, above the second the
# numbers are others.
SAME_DECIMAL, OTHER_DECIMAL, DECIMAL_DIGITS = 1e-13, 1e-9, 13
# The change of a float, relative to it, that measures this, and the digits in which it is done.
NUDGE, NUDGE_DIGITS = 1e-20, 60
# Terms that a product may have in a proof: what is larger is sampled.
TERMS = 100_000


@dataclass(frozen=True)
class Decision:
    """equal: True, False or None (not decided); how it was decided; for unequal ones a point with both values.

    proved   equal by algebra, or different at a point; otherwise values were sampled, and `how` says why
    """

    equal: bool | None
    how: str
    point: dict[str, float] | None = None
    values: tuple[float, float] | None = None
    proved: bool = False


SAME = Decision(True, "the same after renaming", proved=True)


def unformed(error: Exception) -> Decision:
    """Decision on an entry that SymPy does not form with the values or symbols that are put into it."""
    return Decision(None, f"SymPy cannot form it with real symbols: {error}")


def decide(printed: Sequence[sp.Expr], derived: Sequence[sp.Expr], decimals: int | None = None) -> list[Decision]:
    """Entry by entry; symbols of one name are the same (see values.canonical).

    decimals   printed numbers are rounded to so many decimals
    """
    pairs = list(zip(printed, derived, strict=True))
    result: dict[int, Decision] = {k: SAME for k, (a, b) in enumerate(pairs) if a == b}
    same = canonical([side for k, pair in enumerate(pairs) if k not in result for side in pair])
    if decimals is None:
        _prove(pairs, result, same)
    for k, pair in enumerate(pairs):
        if k not in result:
            try:
                pairs[k] = pair[0].xreplace(same), pair[1].xreplace(same)
            except (ValueError, TypeError) as error:  # such as the larger of a complex number and another
                result[k] = unformed(error)
            else:
                result |= {k: SAME} if pairs[k][0] == pairs[k][1] else {}
    reasons = _prove(pairs, result, {}) if decimals is None else dict.fromkeys(range(len(pairs)), "printed numbers are rounded")
    rest = [k for k in range(len(pairs)) if k not in result]
    for k, decision in zip(rest, _by_numbers([pairs[k] for k in rest], decimals) if rest else []):
        result[k] = replace(decision, how=f"{decision.how}; not proved: {reasons[k]}") if decision.equal else decision
    return [result[k] for k in range(len(pairs))]


def _prove(pairs: Sequence[tuple[sp.Expr, sp.Expr]], result: dict[int, Decision], same: Mapping[Any, Any]) -> dict[int, str]:
    """Decide what exact algebra proves, and return why it does not prove the others."""
    open_ones = [k for k in range(len(pairs)) if k not in result]
    reasons = dict(zip(open_ones, unproved([pairs[k] for k in open_ones], TERMS, same) if open_ones else []))
    result |= {k: Decision(True, "by exact algebra", proved=True) for k, reason in reasons.items() if not reason}
    return reasons


def _by_numbers(pairs: list[tuple[sp.Expr, sp.Expr]], decimals: int | None) -> list[Decision]:
    try:
        return _Comparison(pairs, decimals).decisions()
    except UnsupportedExpression as error:
        if len(pairs) == 1:
            return [Decision(None, str(error))]
        return [_by_numbers([pair], decimals)[0] for pair in pairs]


class _Comparison:
    """Pairs of expressions at points, until each is decided."""

    def __init__(self, pairs: list[tuple[sp.Expr, sp.Expr]], decimals: int | None) -> None:
        self.pairs, self.decimals = pairs, decimals
        self.expressions = Expressions([e for pair in pairs for e in pair])
        self.symbols = {s for pair in pairs for e in pair for s in symbols_of(e)}
        self.floats = _Floats(pairs)
        self.entries = [_Entry(pair) for pair in pairs]

    def decisions(self) -> list[Decision]:
        self._through(points(self.symbols), POINTS)
        if self.decimals is None and self.symbols:
            for entry in self.entries:
                entry.ordinary = entry.agreeing
            self._through(wide_points(self.symbols), WIDE)
            self._into_branches()
        return [entry.decision(self.decimals) for entry in self.entries]

    def _through(self, sequence: Iterator[dict[str, Any]], count: int) -> None:
        """Compare all undecided entries at the points, until each was judged at `count` more."""
        wanted = {id(entry): entry.judged + count for entry in self.entries}
        for point in sequence:
            open_ones = [k for k, e in enumerate(self.entries) if e.different is None and e.judged < wanted[id(e)]]
            if not open_ones:
                break
            self._compare(open_ones, point)
            if not self.symbols:
                break

    def _into_branches(self) -> None:
        """Points in those branches of Piecewise expressions in which no point was."""
        open_ones = [k for k, entry in enumerate(self.entries) if entry.different is None and entry.branches]
        if not open_ones:
            return
        visits = Visits([b for k in open_ones for b in self.entries[k].branches], self.symbols)
        held = [(point, visits.hold(point)) for k in open_ones for point in self.entries[k].seen]
        for k in open_ones:
            entry = self.entries[k]
            reached = [held_there for point, held_there in held if any(point is seen for seen in entry.seen)]
            for branch in entry.branches:
                if any(there.issuperset(branch.conditions) for there in reached):
                    continue
                for point in visits.search(branch):
                    before = entry.agreeing
                    if entry.different is None:
                        self._compare([k], point)
                    if entry.agreeing > before:
                        reached.append(visits.hold(point))
            entry.unvisited = [b for b in entry.branches if not any(there.issuperset(b.conditions) for there in reached)
                               and not b.empty]

    def _compare(self, open_ones: list[int], point: dict[str, Any]) -> None:
        values = self.expressions.at(point)
        precise: list[Any] | None = None
        for k in open_ones:
            entry, (x, y) = self.entries[k], values[2 * k:2 * k + 2]
            if x is None or y is None:
                continue
            difference = abs(x - y)
            if self.decimals is not None:
                entry.count(point, bool(difference <= 0.5000001 * 10.0**-self.decimals), x, y)
                continue
            if difference > ROUNDING * max(abs(x), abs(y)):
                precise = precise or self.expressions.at(point, 2 * DIGITS)
                a, b = precise[2 * k:2 * k + 2]
                if a is None or b is None:
                    continue
                if abs(a - b) > REMAINDER * difference:
                    reach = self.floats.reach(k, point) if entry.has_floats else abs(a - b)
                    if reach is None:
                        continue
                    part = float(abs(a - b) / reach)
                    entry.floats_part = max(entry.floats_part, part if part <= OTHER_DECIMAL else 0.0)
                    entry.count(point, True if part <= SAME_DECIMAL else None if part <= OTHER_DECIMAL else False, x, y)
                    continue
            entry.count(point, True, x, y)


class _Entry:
    """Observations of a pair: points that agree, that are in doubt, one that differs; branches and the sizes of the symbols."""

    def __init__(self, pair: tuple[sp.Expr, sp.Expr]) -> None:
        self.names = sorted(s.name for s in symbols_of(pair[0]) | symbols_of(pair[1]))
        self.has_floats = any(e.has(sp.Float) for e in pair)
        self.branches: list[Branch] = branches(pair)
        self.unvisited: list[Branch] = []
        self.seen: list[dict[str, Any]] = []
        self.ordinary = self.doubtful = 0
        self.floats_part = 0.0
        self.different: tuple[dict[str, float], tuple[float, float]] | None = None

    @property
    def agreeing(self) -> int:
        return len(self.seen)

    @property
    def judged(self) -> int:
        return self.agreeing + self.doubtful

    def count(self, point: dict[str, Any], same: bool | None, x: Any, y: Any) -> None:
        if same:
            self.seen.append(point)
        elif same is None:
            self.doubtful += 1
        else:
            self.different = {name: float(point[name]) for name in self.names}, (float(x), float(y))

    def decision(self, decimals: int | None) -> Decision:
        digits = DECIMAL_DIGITS if self.floats_part else DIGITS
        covered = f"{_points(self.agreeing)}{self._sizes()}"
        if self.different is not None:
            # Where values agree at ordinary sizes, a reader wonders about a verdict that only other sizes give.
            elsewhere = f"; the same to {digits} digits at {covered}" if self.ordinary else ""
            return Decision(False, f"different at a point{elsewhere}", *self.different, proved=True)
        if decimals is not None and (self.agreeing >= (FEWEST if self.names else 1)):
            return Decision(True, f"equal when rounded to {decimals} decimals" + (f" at {covered}" if self.names else ""))
        if not self.names and self.agreeing:
            return Decision(True, f"equal to {digits} digits")
        if self.doubtful:
            return Decision(None, f"values agree at {_points(self.agreeing)}; at {self.doubtful} they differ by "
                                  f"up to {self.floats_part:.0e} of what the floats in them make up: above "
                                  f"{SAME_DECIMAL:g}, which is rounding, and below {OTHER_DECIMAL:g}, which is another number")
        if self.agreeing < FEWEST:
            return Decision(None, f"values agree at {_points(self.agreeing)}; elsewhere there are no real values")
        if self.unvisited:
            named = "; ".join(branch.text for branch in self.unvisited)
            return Decision(None, f"equal at {covered}, {digits} digits, none of which lies in the "
                                  f"branch{'es' if len(self.unvisited) > 1 else ''} {named}")
        return Decision(True, f"equal at {covered}, {digits} digits")

    def _sizes(self) -> str:
        sizes = [abs(point[name]) for point in self.seen for name in self.names if point[name]]
        if not sizes:
            return ""
        return f" with symbols of size {float(f'{float(min(sizes)):.0e}'):g} to {float(f'{float(max(sizes)):.0e}'):g}"


def _points(count: int) -> str:
    return f"{count} random point{'' if count == 1 else 's'}"


class _Floats:
    """Reach of the floats in pairs of expressions: the sum of what the values change by, per relative change of each."""

    def __init__(self, pairs: list[tuple[sp.Expr, sp.Expr]]) -> None:
        self.symbols: dict[sp.Float, sp.Symbol] = {}
        named = [tuple(self._named(e) for e in pair) for pair in pairs]
        self.names = [sorted({s.name for e in pair for s in symbols_of(e)} & {s.name for s in self.symbols.values()})
                      for pair in named]
        self.expressions = [Expressions([*pair, _size(pair[0]) + _size(pair[1])] if names else []) for pair, names
                            in zip(named, self.names)]
        self.values = {symbol.name: float(number) for number, symbol in self.symbols.items()}

    def reach(self, k: int, point: dict[str, Any]) -> Any:
        """Reach of pair k at a point; None where a value ends within the change of a float.

        At least the sum of the sizes of the terms: sums of floats leave rounding in coefficients that should have vanished.
        """
        expressions, own = self.expressions[k], context(NUDGE_DIGITS)
        at = {**point, **{name: own.mpf(self.values[name]) for name in self.names[k]}}
        *before, size = expressions.at(at, NUDGE_DIGITS)
        if None in (*before, size):
            return None
        total = own.zero
        for name in self.names[k]:
            *after, _ = expressions.at({**at, name: at[name] * (1 + own.mpf(NUDGE))}, NUDGE_DIGITS)
            if None in after:
                return None
            total += sum(abs(a - b) for a, b in zip(after, before)) / own.mpf(NUDGE)
        return max(total, size)

    def _named(self, e: Any) -> Any:
        """The expression with a symbol for every float; exponents such as 2.0 and 0.5 stay, since they are exact."""
        if isinstance(e, sp.Float):
            return self.symbols.setdefault(e, sp.Symbol(f"float {len(self.symbols)}", real=True))
        if not e.has(sp.Float):
            return e
        if isinstance(e, sp.Pow) and isinstance(e.exp, sp.Float) and (2 * e.exp) % 1 == 0:
            return sp.Pow(self._named(e.base), sp.nsimplify(e.exp), evaluate=False)
        return e.func(*map(self._named, e.args), evaluate=False) if isinstance(e, (sp.Add, sp.Mul, sp.Pow)) \
            else e.func(*map(self._named, e.args))


def _size(e: sp.Expr) -> sp.Expr:
    """The sum of the sizes of the terms."""
    return sp.Add(*[sp.Abs(term) for term in sp.Add.make_args(e)])
