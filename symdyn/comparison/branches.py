"""The branches of formulas, those of Piecewise, Max, Min, Abs, sign and Heaviside: which of them a point lies in, and points that
lie in the others."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import chain, islice, pairwise
from typing import Any

import sympy as sp
from sympy.core.relational import Relational

from symdyn.comparison.points import Expressions, context, points, wide_points
from symdyn.model.symbols import symbols_of

# Points sought in a branch in which no other point lies.
VISITS = 3
# Points from which the search for a branch starts, of the ordinary sizes and of the others.
STARTS = 3
# Rounds through the symbols, one at a time.
ROUNDS = 2
# Sizes at which the sign of a condition's difference is looked at before its root is bracketed.
EXPONENTS = range(-20, 15)


# Functions that have one branch above zero and another below, or one for each argument.
_SIDES = (sp.Abs, sp.sign, sp.Heaviside, sp.Max, sp.Min)


@dataclass(frozen=True)
class Branch:
    """A branch: what must hold in it, from the outermost Piecewise inwards, and the words of it."""

    conditions: tuple[Any, ...]
    text: str

    @property
    def empty(self) -> bool:
        """Whether its conditions contradict each other by what SymPy finds without a search."""
        return sp.And(*self.conditions).simplify() is sp.S.false


def branches(expressions: Iterable[sp.Expr]) -> list[Branch]:
    """All branches of the expressions that may be taken, those inside of others as well; each once."""
    result: dict[tuple[Any, ...], str] = {}

    def walk(e: sp.Basic, around: tuple[Any, ...]) -> None:
        if not e.has(sp.Piecewise, *_SIDES):
            return
        if not isinstance(e, sp.Piecewise):
            for condition in _sides(e):
                if condition is not sp.S.true and condition is not sp.S.false:
                    result.setdefault((*around, condition), str(condition))
            for part in e.args:
                walk(part, around)
            return
        inside = around
        for value, condition in e.args:
            here = inside if condition is sp.S.true else (*inside, condition)
            before = ", ".join(str(c) for _, c in e.args if c is not sp.S.true)
            result.setdefault(here, f"none of {before}" if condition is sp.S.true else str(condition))
            walk(value, here)
            inside = (*inside, sp.Not(condition))

    for expression in expressions:
        walk(expression, ())
    return [Branch(*item) for item in result.items()]


def _sides(e: sp.Basic) -> list[Any]:
    """Conditions of the branches of a function that has several without being a Piecewise."""
    if isinstance(e, (sp.Max, sp.Min)):
        first = sp.Ge if isinstance(e, sp.Max) else sp.Le
        return [sp.And(*[first(a, b) for b in e.args if b != a]) for a in e.args]
    if isinstance(e, _SIDES):
        return [sp.Gt(e.args[0], 0), sp.Lt(e.args[0], 0)]
    return []


class Visits:
    """Conditions of branches that hold at points, and a search for points in a branch."""

    def __init__(self, all_branches: Iterable[Branch], symbols: Iterable[sp.Symbol]) -> None:
        self.symbols = {s.name: s for s in symbols}
        self.conditions = list(dict.fromkeys(c for b in all_branches for c in b.conditions))
        self.indicators = Expressions([sp.Piecewise((1, c), (0, True)) for c in self.conditions])
        self.own = context()

    def hold(self, point: Mapping[str, Any]) -> set[Any]:
        """Those conditions that hold at a point."""
        return {c for c, value in zip(self.conditions, self.indicators.at(point)) if value == 1}

    def inside(self, branch: Branch, point: Mapping[str, Any]) -> bool:
        """Whether a point lies in a branch."""
        return self.hold(point).issuperset(branch.conditions)

    def search(self, branch: Branch) -> list[dict[str, Any]]:
        """Up to VISITS points in the branch; none if the search fails, which proves nothing."""
        starts = chain(islice(points(self.symbols.values()), STARTS), islice(wide_points(self.symbols.values()), STARTS))
        reached = (self._moved(branch, dict(start)) for start in starts)
        return list(islice((point for point in reached if point is not None), VISITS))

    def _moved(self, branch: Branch, point: dict[str, Any]) -> dict[str, Any] | None:
        """The point with its symbols moved, one after the other, to where most conditions of the branch hold; None if not all."""
        moving = sorted({s.name for c in branch.conditions for s in symbols_of(c)})
        wanted = set(branch.conditions)
        for name in moving * ROUNDS:
            if self.hold(point) >= wanted:
                return point
            candidates = [{**point, name: value} for value in self._cells(branch, name, point)]
            point = max([point, *candidates], key=lambda at: len(self.hold(at) & wanted))
        return point if self.hold(point) >= wanted else None

    def _cells(self, branch: Branch, name: str, point: Mapping[str, Any]) -> Iterator[Any]:
        """Values of one symbol, the others held: one in each gap between zero and the roots of the conditions' differences, then
        these themselves, where a number with decimals does not decide on which side the point lies."""
        relations = {r for c in branch.conditions for r in c.atoms(Relational) if name in {s.name for s in symbols_of(r)}}
        differences = Expressions([r.lhs - r.rhs for r in sorted(relations, key=str)])
        roots: set[Any] = set()
        for k in range(len(relations)):
            roots.update(self._roots(lambda x, k=k: differences.at({**point, name: x})[k]))
        positive = self.symbols[name].is_positive
        edges = sorted(roots | {self.own.zero})
        gaps = [(a + b) / 2 for a, b in pairwise(edges)]
        for value in (*gaps, edges[0] - 1 - abs(edges[0]), edges[-1] + 1 + abs(edges[-1]), *edges):
            if value > 0 or not positive:
                yield value

    def _roots(self, difference: Any) -> set[Any]:
        """Roots of a function of one number: exactly where it is linear, elsewhere from changes of its sign."""
        own = self.own
        first = [difference(own.mpf(x)) for x in (-2, 0, 3)]
        if None not in first and abs(2 * first[2] - 5 * first[1] + 3 * first[0]) <= own.mpf(10) ** -40 * max(map(abs, first)) \
                and first[2] != first[0]:
            return {-first[1] * 5 / (first[2] - first[0])}
        sizes = [own.mpf(m) * own.mpf(10) ** e for e in EXPONENTS for m in (1, 2, 5)]
        grid = [*(-x for x in reversed(sizes)), own.zero, *sizes]
        values = [difference(x) for x in grid]
        roots = {x for x, value in zip(grid, values) if value == 0}
        for (a, left), (b, right) in pairwise(zip(grid, values)):
            if left is None or right is None or left * right >= 0:
                continue
            for _ in range(170):
                middle = (a + b) / 2
                value = difference(middle)
                if value is None:
                    break
                a, b, left = (a, middle, left) if left * value <= 0 else (middle, b, value)
            roots.add((a + b) / 2)
        return roots
