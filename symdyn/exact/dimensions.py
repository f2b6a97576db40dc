"""Dimensional analysis of a tape: the unit of every step from those of its leaves, and sums of what has different units.

A unit is a product of powers of kg, m, s, A and K; radians count as 1. Leaves without a unit are unknowns: each sum, comparison
and argument of a function is an equation for exponents, which determines them or shows a contradiction. Numbers as factors have
the unit 1; numbers as terms may have any, because which is not known.
Source: Bridgman, Dimensional Analysis, chapter 4; Kennedy, Dimension Types, 1994 (units by unification).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import sympy as sp

from symdyn.exact.taken import recorded
from symdyn.model.faults import plain_unit
from symdyn.shown import shown
from symdyn.tape.node import Node
from symdyn.tape.sympy_bridge import expand
from symdyn.tape.tape import Output, reachable

# Exponents by unit of the base, or by the leaf whose unit is unknown.
Dimension = dict[Any, Fraction]
BASE = ("kg", "m", "s", "A", "K")
NAMED: dict[str, tuple[int, ...]] = {
    "1": (), "rad": (), "deg": (), "rev": (), "sr": (), "kg": (1,), "m": (0, 1), "s": (0, 0, 1), "A": (0, 0, 0, 1),
    "K": (0, 0, 0, 0, 1), "N": (1, 1, -2), "J": (1, 2, -2), "W": (1, 2, -3), "Pa": (1, -1, -2), "Hz": (0, 0, -1),
    "V": (1, 2, -3, -1), "C": (0, 0, 1, 1), "ohm": (1, 2, -3, -2), "H": (1, 2, -2, -2)}
_WRITTEN: dict[tuple[Any, ...], str] = {
    (1, 1, -2): "N", (1, 2, -2): "N m", (1, 0, -2): "N/m", (1, 2, -3): "W", (1, 2, -1): "N m s", (1, 1, -1): "N s",
    (1, 0, -1): "N s/m", (1, -1, -2): "Pa"}
_PURE = {"sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "exp", "log", "floor",
         "ceil", "erf"}
_SAME = {"add", "sub", "min", "max"}
_COMPARED = {"lt", "le", "gt", "ge", "eq", "ne", "atan2"}
_TRUTH = {"and", "or", "not", "sign"}
# Steps of a term that is written out in a message.
LISTED = 60


def parsed(unit: str | None) -> Dimension | None:
    """A unit such as "kg m^2/s^2", "N·m/rad" or "N/(m/s)"; None for one that is not known.

    All that stands between a slash and the next divides."""
    tokens = re.findall(r"[A-Za-z]+|1|[/()]|\^ *\(? *-? *\d+ *\)?|[^\s*]", plain_unit(unit or ""))
    result = _product_of(tokens) if tokens else None
    return None if result is None or tokens else {base: n for base, n in result.items() if n}


def _product_of(tokens: list[str]) -> Dimension | None:
    """Dimension by the first tokens, up to a bracket that closes; these are removed. None for what is no unit."""
    total: Dimension = {}
    sign, factors = 1, 0
    while tokens and tokens[0] != ")":
        token = tokens.pop(0)
        if token == "/":
            sign = -1
            if not tokens or tokens[0] in ("/", ")"):
                return None
            continue
        factor: Dimension | None
        if token == "(":
            factor = _product_of(tokens)
            if not tokens:
                return None
            tokens.pop(0)
        else:
            factor = dict(zip(BASE, map(Fraction, NAMED[token]), strict=False)) if token in NAMED else None
        if factor is None:
            return None
        power = int(re.sub(r"[\^() ]", "", tokens.pop(0))) if tokens and len(tokens[0]) > 1 and tokens[0][0] == "^" else 1
        for base, n in factor.items():
            total[base] = total.get(base, Fraction(0)) + n * power * sign
        factors += 1
    return total if factors else None


def text(dimension: Dimension | None) -> str:
    """A unit as it is written; "1" for numbers and angles, "?" where it is not known."""
    if dimension is None or any(key not in BASE for key in dimension):
        return "?"
    powers = tuple(dimension.get(base, Fraction(0)) for base in BASE)
    if powers[:3] in _WRITTEN and not any(powers[3:]):
        return _WRITTEN[powers[:3]]

    def powers_of(sign: int) -> str:
        return " ".join(base if sign * p == 1 else f"{base}^{sign * p}"
                        for base, p in zip(BASE, powers, strict=True) if sign * p > 0)

    above, below = powers_of(1), powers_of(-1)
    return f"{above or '1'}/{below}" if below else above or "1"


@dataclass(frozen=True)
class Mismatch:
    """A step some arguments of which (sides) have units that do not fit."""

    node: Node
    units: tuple[str, ...]
    what: str
    sides: tuple[Node, ...]


class Dimensions:
    """Units of the steps of entries.

    of_leaves   leaf -> unit, or None; mismatches: what was found, in order of recording
    """

    def __init__(self, entries: Iterable[Any], of_leaves: Mapping[Node, Dimension | None]) -> None:
        self._of_leaves = of_leaves
        self._solved: dict[Any, Dimension] = {}
        self.mismatches: list[Mismatch] = []
        self._done: dict[Node, Dimension | None] = {}
        for node in reachable(entries):
            self._done[node] = self._step(node)

    def __contains__(self, node: Any) -> bool:
        return node in self._done

    def of(self, entry: Any) -> Dimension | None:
        """The unit of an entry; None after a mismatch, where it has none, and for numbers."""
        return self._resolved(self._done[entry]) if isinstance(entry, Node) else None

    def demand(self, entry: Any, wanted: Dimension) -> tuple[str, str] | None:
        """Units that differ, of an entry that should have this one; None where they agree."""
        if not isinstance(entry, Node) or _constant(entry):
            return None
        result = self._done[entry]
        if result is None or self._unified(result, wanted):
            return None
        return text(self._resolved(result)), text(wanted)

    def _step(self, node: Node) -> Dimension | None:
        op, args = node.op, node.args
        if op == "leaf":
            known = self._of_leaves.get(node)
            return {node: Fraction(1)} if known is None else known
        if op in ("call", "item"):
            return {node: Fraction(1)} if op == "item" else {}
        if op == "guard":
            return self._value(args[0])
        if op in _SAME:
            return self._alike(node, args, "a sum of" if op in ("add", "sub") else f"the {op}imum of")
        if op in _COMPARED:
            self._alike(node, args, "a comparison of")
            return {}
        if op in _TRUTH or op == "pi":
            return {}
        if op == "select":
            return self._alike(node, args[1:], "a choice of")
        if op in _PURE:
            own = self._value(args[0])
            if own is not None and not self._unified(own, {}):
                self.mismatches.append(Mismatch(node, (text(self._resolved(own)),), f"{op} of", (args[0],)))
            return {}
        if op in ("neg", "abs"):
            return self._value(args[0])
        values = [self._value(a) for a in args]
        if op == "sqrt":
            return None if values[0] is None else _scaled(values[0], Fraction(1, 2))
        if op == "pow":
            return self._power(node, values)
        return None if None in values else product(values[0] or {}, values[1] or {}, 1 if op == "mul" else -1)

    def _power(self, node: Node, values: list[Dimension | None]) -> Dimension | None:
        exponent = node.args[1]
        if not isinstance(exponent, Node):
            return None if values[0] is None else _scaled(values[0], Fraction(exponent))
        for side, value in zip(node.args, values, strict=True):
            if value is not None and not self._unified(value, {}):
                self.mismatches.append(Mismatch(node, (text(self._resolved(value)),), "a power with", (side,)))
                return None
        return {}

    def _value(self, a: Any) -> Dimension | None:
        return self._done[a] if isinstance(a, Node) else {}

    def _alike(self, node: Node, args: Iterable[Any], what: str) -> Dimension | None:
        """The unit that all arguments share, but for numbers."""
        known = [a for a in args if isinstance(a, Node) and not _constant(a)]
        if not known:
            return {}
        side, first = known[0], self._done[known[0]]
        for other in known[1:]:
            second = self._done[other]
            if first is None:
                side, first = other, second
            elif second is not None and not self._unified(first, second):
                units = text(self._resolved(first)), text(self._resolved(second))
                self.mismatches.append(Mismatch(node, units, what, (side, other)))
                return None
        return first

    def _resolved(self, value: Dimension | None) -> Dimension | None:
        if value is None:
            return None
        total: Dimension = {}
        for key, n in value.items():
            part = self._resolved(self._solved[key]) if key in self._solved else {key: Fraction(1)}
            total = product(total, _scaled(part or {}, n), 1)
        return total

    def _unified(self, a: Dimension, b: Dimension) -> bool:
        """Whether both are the same, for suitable units of what has none."""
        difference = self._resolved(product(a, b, -1)) or {}
        unknown = [key for key in difference if key not in BASE]
        if not unknown:
            return not difference
        key = max(unknown, key=lambda node: node.index)
        power = difference.pop(key)
        self._solved[key] = _scaled(difference, -1 / power)
        return True


def _constant(a: Node) -> bool:
    return not a.mask and a.op not in ("call", "item")


def product(a: Dimension, b: Dimension, sign: int = 1) -> Dimension:
    """a b, or a / b with the sign -1."""
    total = dict(a)
    for key, n in b.items():
        total[key] = total.get(key, Fraction(0)) + sign * n
    return {key: n for key, n in total.items() if n}


def _scaled(a: Dimension, factor: Fraction) -> Dimension:
    return {key: n * factor for key, n in a.items() if n * factor}


def written(mismatch: Mismatch, symbols: Mapping[Node, sp.Basic]) -> str:
    """A mismatch in words, with the expressions where they are short."""
    node = mismatch.node
    parts = []
    for a, unit in zip(mismatch.sides, mismatch.units, strict=True):
        short = len(reachable([a])) <= LISTED
        parts.append(f"{shown(expand(Output.of('e', a), symbols)) if short else 'a long expression'} in {unit}")
    where = f"{node.section}: " if node.section else ""
    return f"{where}{mismatch.what} {' and '.join(parts)}"


def units_of_expressions(expressions: Iterable[sp.Expr], units: Mapping[sp.Basic, Dimension | None]) -> list[Dimension | None]:
    """Units of expressions in symbols with these; None where there is none."""
    entries, symbols = recorded(expressions)
    dimensions = Dimensions(entries, {leaf: units.get(symbol) for leaf, symbol in symbols.items()})
    return [dimensions.of(e) if isinstance(e, Node) else {} for e in entries]
