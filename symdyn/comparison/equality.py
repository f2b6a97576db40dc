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

from symdyn.comparison.points import DIGITS, Expressions, points
from symdyn.errors import UnsupportedExpression
from symdyn.report.simplify import simplified

POINTS = 5
FEWEST = 3
# Relative to the values that are compared: with DIGITS digits, what rounding leaves and what no rounding explains.
SAME, OTHER = 1e-30, 1e-15
# Where a decimal fraction such as 9.81 stands in a formula, it was given with the digits of a float.
SAME_DECIMAL, OTHER_DECIMAL = 1e-13, 1e-9
# Simplification: time of one entry, and the length from which it is not tried.
SECONDS, LONGEST = 0.5, 200


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
    return bool(simplified(difference, SECONDS) == 0)


def _by_numbers(pairs: list[tuple[sp.Expr, sp.Expr]], decimals: int | None) -> list[Decision]:
    try:
        expressions = Expressions([e for pair in pairs for e in pair])
    except UnsupportedExpression as error:
        return [Decision(None, str(error)) for _ in pairs]
    symbols = {s for pair in pairs for e in pair for s in e.free_symbols}
    agreeing, doubtful = [0] * len(pairs), [0] * len(pairs)
    decided: dict[int, Decision] = {}
    for point in points(symbols):
        values = expressions.at(point)
        for k, (a, b) in enumerate(pairs):
            x, y = values[2 * k], values[2 * k + 1]
            if k in decided or x is None or y is None:
                continue
            same, other = _bounds(a, b, decimals, abs(x) + abs(y))
            if abs(x - y) > other:
                shown = {s.name: float(point[s.name]) for s in sorted(a.free_symbols | b.free_symbols, key=str)}
                decided[k] = Decision(False, "different at a point", shown, (float(x), float(y)))
            elif abs(x - y) <= same:
                agreeing[k] += 1
            else:
                doubtful[k] += 1
            if agreeing[k] == POINTS or (agreeing[k] and not symbols):
                decided[k] = _agreed(agreeing[k], decimals)
        if len(decided) == len(pairs):
            break
    for k in range(len(pairs)):
        if k not in decided:
            enough = agreeing[k] >= FEWEST and not doubtful[k]
            decided[k] = _agreed(agreeing[k], decimals) if enough else Decision(None, (
                f"values agree at {agreeing[k]} points, at {doubtful[k]} they are too near to tell; elsewhere there are no real "
                "values"))
    return [decided[k] for k in range(len(pairs))]


def _agreed(count: int, decimals: int | None) -> Decision:
    if decimals is not None:
        return Decision(True, f"equal when rounded to {decimals} decimals")
    return Decision(True, f"equal at {count} random points, {DIGITS} digits" if count > 1 else f"equal to {DIGITS} digits")


def _bounds(a: sp.Expr, b: sp.Expr, decimals: int | None, size: Any) -> tuple[Any, Any]:
    if decimals is not None:
        half = 0.5000001 * 10.0**-decimals
        return half, half
    if a.has(sp.Float) or b.has(sp.Float):
        return SAME_DECIMAL * (1 + size), OTHER_DECIMAL * (1 + size)
    return SAME * (1 + size), OTHER * (1 + size)
