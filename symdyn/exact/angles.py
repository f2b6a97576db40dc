"""Angles of sines and cosines as integer combinations of a few base angles.

The argument of a sine is a sum of terms with rational factors: coordinates, products such as Omega t, multiples of pi, numbers.
Each term is divided by a number that makes all its factors integers, so that half angles are covered, and arguments that occur
are taken as base angles before single terms: for links with parallel axes these are the sums in which equations are short. Sums
over a common divisor, such as (x - d)/l, are sums of quotients.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm
from typing import Any, ClassVar

from symdyn.tape.node import Node, exact


@dataclass(frozen=True)
class Inverse:
    """One over a node, as a factor of a term."""

    node: Node
    op: ClassVar[str] = "inverse"

    @property
    def index(self) -> int:
        """Index of the node."""
        return self.node.index


# A product of nodes and inverses of nodes, in order of recording: what stands in a term of an argument.
Term = tuple[Node | Inverse, ...]
Linear = dict[Term, Fraction]
# Arguments with more terms than this are one angle each; the same for multiples above it.
TERMS, MULTIPLES = 12, 8


def arguments(steps: Sequence[Node]) -> dict[Any, Linear]:
    """Every argument of a sine or cosine as sum of terms; () is the term of a number."""
    forms: dict[Node, Linear] = {}

    def form(value: Any) -> Linear:
        return forms[value] if isinstance(value, Node) else {(): Fraction(exact(value))} if value else {}

    wanted = {node.args[0] for node in steps if node.op in ("sin", "cos", "tan")}
    needed = {a for a in wanted if isinstance(a, Node)}
    for node in reversed(steps):
        if node in needed and node.op in ("add", "sub", "mul", "neg", "div", "guard"):
            needed.update(a for a in node.args if isinstance(a, Node))
    for node in steps:
        if node not in needed:
            continue
        op, args = node.op, node.args
        result: Linear | None = None
        if op in ("add", "sub"):
            result = dict(form(args[0]))
            for term, factor in form(args[1]).items():
                result[term] = result.get(term, Fraction(0)) + (factor if op == "add" else -factor)
        elif op == "mul":
            result = {}
            for one, a in form(args[0]).items():
                for two, b in form(args[1]).items():
                    term = _product(one, two)
                    result[term] = result.get(term, Fraction(0)) + a * b
        elif op == "div" and form(args[1]):
            below = form(args[1])
            divisor, number = next(iter(below.items())) if len(below) == 1 else ((args[1],), Fraction(1))
            inverse = tuple(n.node if isinstance(n, Inverse) else Inverse(n) for n in divisor)
            result = {}
            for one, a in form(args[0]).items():
                term = _product(one, inverse)
                result[term] = result.get(term, Fraction(0)) + a / number
        elif op == "neg":
            result = {term: -factor for term, factor in form(args[0]).items()}
        elif op == "guard":
            result = form(args[0])
        if result is not None:
            result = {term: factor for term, factor in result.items() if factor}
        forms[node] = {(node,): Fraction(1)} if result is None or len(result) > TERMS else result
    return {a: form(a) for a in sorted(wanted, key=lambda a: (isinstance(a, Node), a.index if isinstance(a, Node) else a))}


def _product(one: Term, two: Term) -> Term:
    """The product of two terms, without what cancels."""
    left = list(one)
    for factor in two:
        opposite = factor.node if isinstance(factor, Inverse) else Inverse(factor)
        if opposite in left:
            left.remove(opposite)
        else:
            left.append(factor)
    return tuple(sorted(left, key=lambda n: (n.index, isinstance(n, Inverse))))


class Angles:
    """Base angles of the arguments.

    bases   (n,) the base angles, each a sum of terms; vectors: argument -> integers (n,) that combine them
    quarter argument -> quarter turns to be added to the combination
    """

    def __init__(self, result: dict[Any, Linear]) -> None:
        self.quarter: dict[Any, int] = {}
        units: list[tuple[Term, Fraction]] = []
        rows: dict[Any, dict[int, int]] = {}
        factors: dict[Term, list[Fraction]] = {}
        forms: dict[Any, Linear] = {}
        for node, own in result.items():
            form = dict(own)
            turns = 0
            for term in list(form):
                if len(term) == 1 and term[0].op == "pi" and (2 * form[term]).denominator == 1:
                    turns = int(2 * form.pop(term))
            self.quarter[node] = turns % 4
            forms[node] = form
            for term, factor in form.items():
                factors.setdefault(term, []).append(factor)
        places: dict[tuple[Term, Fraction], tuple[int, int]] = {}
        for term, values in factors.items():
            below = lcm(*[v.denominator for v in values])
            common = Fraction(gcd(*[int(v * below) for v in values]), below)
            whole = all(abs(v / common) <= MULTIPLES for v in values)
            for v in values:
                unit = common if whole else abs(v)
                if (term, unit) not in units:
                    units.append((term, unit))
                places[term, v] = units.index((term, unit)), int(v / unit)
        for node, form in forms.items():
            rows[node] = dict(places[term, factor] for term, factor in form.items())
        self.units = units
        vectors = {node: tuple(row.get(k, 0) for k in range(len(units))) for node, row in rows.items()}
        self.matrix = _basis(list(vectors.values()), len(units))
        self.vectors = {node: combined(vector, self.matrix) for node, vector in vectors.items()}

    @property
    def bases(self) -> list[Linear]:
        """The base angles, each as a sum of terms."""
        return [{self.units[k][0]: n * self.units[k][1] for k, n in enumerate(row) if n} for row in self.matrix]


def _basis(vectors: Iterable[tuple[int, ...]], n: int) -> list[tuple[int, ...]]:
    """Vectors that all others, and all unit vectors that they reach, are integer combinations of; those that occur first."""
    units = [tuple(int(i == k) for i in range(n)) for k in range(n)]
    chosen: list[tuple[int, ...]] = []
    for vector in sorted(set(vectors), key=lambda v: (sum(map(abs, v)), [-abs(i) for i in v])):
        leading = next((i for i in vector if i), 0)
        vector = tuple(-i for i in vector) if leading < 0 else vector
        if leading and vector not in chosen and _independent([*chosen, vector]):
            chosen.append(vector)
    for unit in units:
        if len(chosen) < n and _independent([*chosen, unit]):
            chosen.append(unit)
    return chosen if all(combined(v, chosen) is not None for v in [*vectors, *units]) else units


def _independent(rows: Sequence[Sequence[int]]) -> bool:
    return _eliminated(rows) == len(rows)


def _eliminated(rows: Sequence[Sequence[int]]) -> int:
    """Rank."""
    left = [[Fraction(i) for i in row] for row in rows]
    rank = 0
    for column in range(len(left[0]) if left else 0):
        pivot = next((k for k in range(rank, len(left)) if left[k][column]), None)
        if pivot is None:
            continue
        left[rank], left[pivot] = left[pivot], left[rank]
        for k in range(rank + 1, len(left)):
            factor = left[k][column] / left[rank][column]
            left[k] = [a - factor * b for a, b in zip(left[k], left[rank])]
        rank += 1
    return rank


def combined(vector: Sequence[int], basis: Sequence[Sequence[int]]) -> Any:
    """Integers that combine the rows of a square basis to the vector; None where they are no integers."""
    n = len(basis)
    left = [[Fraction(basis[j][i]) for j in range(n)] + [Fraction(vector[i])] for i in range(len(vector))]
    for column in range(n):
        row = column
        pivot = next((k for k in range(row, len(left)) if left[k][column]), None)
        if pivot is None:
            return None
        left[row], left[pivot] = left[pivot], left[row]
        left[row] = [a / left[row][column] for a in left[row]]
        for k in range(len(left)):
            if k != row and left[k][column]:
                factor = left[k][column]
                left[k] = [a - factor * b for a, b in zip(left[k], left[row])]
    values = [left[k][n] for k in range(n)]
    return tuple(int(v) for v in values) if all(v.denominator == 1 for v in values) else None
