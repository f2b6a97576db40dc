"""Whether two formulas are the same: after renaming, by limited simplification, at random points.

Numbers come first as a refutation, since two expressions that differ at one point differ; that a simplification did not
finish says nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

import sympy as sp

from symdyn.comparison.points import DIGITS, REMAINDER, Expressions, points
from symdyn.errors import UnsupportedExpression
from symdyn.report.simplify import shown_zero

POINTS = 12
FEWEST = 3
# Differences that are rounding for sure, relative to the values; others are looked at again with twice the digits.
ROUNDING = 1e-45
# Where a decimal fraction such as 9.81 stands in a formula, it was given with the digits of a float.
SAME_DECIMAL, OTHER_DECIMAL = 1e-13, 1e-9
# Operations from which simplification is not tried.
LONGEST = 60


@dataclass(frozen=True)
class Decision:
    """equal: True, False or None (not decided); how it was decided; for unequal ones a point with both values."""

    equal: bool | None
    how: str
    point: dict[str, float] | None = None
    values: tuple[float, float] | None = None


def decide(printed: Sequence[sp.Expr], derived: Sequence[sp.Expr], decimals: int | None = None) -> list[Decision]:
    """Entry by entry; symbols are the same if they are the same objects (see values.canonical).

    decimals   printed numbers are rounded to so many decimals
    """
    pairs = list(zip(printed, derived, strict=True))
    found: list[Decision | None] = [Decision(True, "the same after renaming") if a == b else None for a, b in pairs]
    open_ones = [k for k, decision in enumerate(found) if decision is None]
    if open_ones:
        for k, by_number in zip(open_ones, _by_numbers([pairs[k] for k in open_ones], decimals)):
            found[k] = by_number
    result = []
    for (a, b), decision in zip(pairs, found):
        assert decision is not None
        if decision.equal and decision.how.startswith("equal at") and decimals is None \
                and not (_long(a) or _long(b)) and _vanishes(a - b):
            decision = Decision(True, "by simplification")
        result.append(decision)
    return result


def _long(e: sp.Expr) -> bool:
    """Whether an expression is far longer than what is simplified; stops counting there."""
    return any(True for _ in islice(sp.preorder_traversal(e), 10 * LONGEST, None))


def _vanishes(difference: sp.Expr) -> bool:
    """Whether a short difference simplifies to zero."""
    if sp.count_ops(difference) > LONGEST or difference.has(sp.Float):
        return False
    return shown_zero(difference)


def _by_numbers(pairs: list[tuple[sp.Expr, sp.Expr]], decimals: int | None) -> list[Decision]:
    try:
        return _Comparison(pairs, decimals).decisions()
    except UnsupportedExpression as error:
        if len(pairs) == 1:
            return [Decision(None, str(error))]
        return [_by_numbers([pair], decimals)[0] for pair in pairs]


class _Comparison:
    """Pairs of expressions at random points, until each is decided."""

    def __init__(self, pairs: list[tuple[sp.Expr, sp.Expr]], decimals: int | None) -> None:
        self.pairs, self.decimals = pairs, decimals
        self.given = [a.has(sp.Float) or b.has(sp.Float) for a, b in pairs]
        sizes = [_size(a) + _size(b) if given else sp.S.Zero for (a, b), given in zip(pairs, self.given)]
        self.expressions = Expressions([e for pair, size in zip(pairs, sizes) for e in (*pair, size)])
        self.symbols = {s for pair in pairs for e in pair for s in e.free_symbols}

    def decisions(self) -> list[Decision]:
        agreeing, doubtful = [0] * len(self.pairs), [0] * len(self.pairs)
        decided: dict[int, Decision] = {}
        for point in points(self.symbols):
            values = self.expressions.at(point)
            precise: list[Any] | None = None
            for k, (a, b) in enumerate(self.pairs):
                x, y = values[3 * k:3 * k + 2]
                if k in decided or x is None or y is None:
                    continue
                if precise is None and self._unclear(k, values):
                    precise = self.expressions.at(point, 2 * DIGITS)
                same = self._same(k, values, precise)
                if same is False:
                    shown = {s.name: float(point[s.name]) for s in sorted(a.free_symbols | b.free_symbols, key=str)}
                    decided[k] = Decision(False, "different at a point", shown, (float(x), float(y)))
                elif same is None:
                    doubtful[k] += 1
                else:
                    agreeing[k] += 1
                    if agreeing[k] == POINTS or not self.symbols:
                        decided[k] = self._agreed(k, agreeing[k])
            if len(decided) == len(self.pairs) or not self.symbols:
                break
        for k in range(len(self.pairs)):
            if k not in decided:
                enough = agreeing[k] >= FEWEST and not doubtful[k]
                decided[k] = self._agreed(k, agreeing[k]) if enough else Decision(None, (
                    f"values agree at {agreeing[k]} points, at {doubtful[k]} they are too near to tell; elsewhere there are no "
                    "real values"))
        return [decided[k] for k in range(len(self.pairs))]

    def _unclear(self, k: int, values: list[Any]) -> bool:
        x, y = values[3 * k:3 * k + 2]
        return self.decimals is None and not self.given[k] and bool(abs(x - y) > ROUNDING * max(abs(x), abs(y)))

    def _same(self, k: int, values: list[Any], precise: list[Any] | None) -> bool | None:
        """Whether the values of a pair are the same; None: too near to tell."""
        x, y, size = values[3 * k:3 * k + 3]
        difference = abs(x - y)
        if self.decimals is not None:
            return bool(difference <= 0.5000001 * 10.0**-self.decimals)
        if self.given[k]:
            size = size or abs(x) + abs(y)
            return True if difference <= SAME_DECIMAL * size else False if difference > OTHER_DECIMAL * size else None
        if not self._unclear(k, values):
            return True
        assert precise is not None
        again = precise[3 * k:3 * k + 2]
        return again[0] is not None and again[1] is not None and bool(abs(again[0] - again[1]) <= REMAINDER * difference)

    def _agreed(self, k: int, count: int) -> Decision:
        if self.decimals is not None:
            return Decision(True, f"equal when rounded to {self.decimals} decimals")
        digits = 13 if self.given[k] else DIGITS
        return Decision(True, f"equal at {count} random points, {digits} digits" if count > 1 else f"equal to {digits} digits")


def _size(e: sp.Expr) -> sp.Expr:
    """The sum of the sizes of the terms."""
    return sp.Add(*[sp.Abs(term) for term in sp.Add.make_args(e)])
