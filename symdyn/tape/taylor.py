"""Taylor coefficients of a solution by recurrences over the assignments of its right-hand side.

With a_k = a^(k)(t) / k! the coefficients of a product are the convolution of those of its factors, and a function y of a
fulfils y' = (dy/da) a', another convolution. The terms of each with both indices from 1 to k - 1 are known from lower orders:
they are sums S_k = sum_(j=1)^(k-1) a_j b_(k-j), which can be taken all at once. The rest of order k is linear in the new
coefficients, and is recorded on the tape again; where a factor does not move, nothing of the convolution is left.

Sources: Jorba and Zou, A software package for the numerical integration of ODEs by means of high-order Taylor methods,
Experimental Mathematics 14 (2005); Griewank and Walther, Evaluating Derivatives, 2nd ed., chapter 13.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.errors import UnsupportedExpression
from symdyn.tape.node import ACCELERATION, COORDINATE, INPUT, PARAMETER, SPEED, STATE, TIME, Node
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Tape, reachable, unsigned

_MOVING = TIME | COORDINATE | SPEED | STATE
_SWITCHES = ("abs", "sign", "floor", "ceil", "min", "max", "lt", "le", "gt", "ge", "eq", "ne", "and", "or", "not", "select")
_WHY = {**{op: f"switches ({op})" for op in _SWITCHES}, "call": "calls a numeric algorithm or a function of the user"}


@dataclass(frozen=True)
class Series:
    """The recurrences of x' = f(t, x).

    start    tape with the output `series_start`: x' (n_x,), then what the next orders need of order 0 (n_0,)
    next     tape with the output `series_next`, of one order: x' (n_x,), then the left factors of the sums (n_s,), then the right
             ones (n_s,)
    leaves   of `next` -> (group, index): t the order k; inputs 1/k and the coefficient of the time; q the coefficients of
             x; ud k times these; u the sums; z what `start` gives behind x'
    """

    start: Tape
    next: Tape
    leaves: dict[str, tuple[str, int]]
    n_x: int
    n_0: int
    n_s: int

    @property
    def borders(self) -> tuple[int, ...]:
        """Ends of the parts of what `next` gives: x', left factors, right factors."""
        return 0, self.n_x, self.n_x + self.n_s, self.n_x + 2 * self.n_s


def series(recorder: Recorder, field: Sequence[Any], state: Sequence[str]) -> Series:
    """The recurrences for the right-hand side `field`, one entry for each name of `state`.

    Raises UnsupportedExpression, with the reason, where it is not smooth or calls what has no recurrences.
    """
    reason = not_smooth(field)
    if reason:
        raise UnsupportedExpression(f"there is no Taylor series: {reason}")
    return _Recurrences(recorder, state).series(field)


def not_smooth(entries: Sequence[Any]) -> str:
    """Why these have no Taylor series along a motion; empty if they have."""
    result = dict.fromkeys(_WHY[n.op] for n in reachable(entries) if n.op in _WHY and _moves(n))
    return f"the right-hand side {' and '.join(result)}" if result else ""


class _Recurrences:
    def __init__(self, recorder: Recorder, state: Sequence[str]) -> None:
        self.r = recorder
        self.leaves: dict[str, tuple[str, int]] = {}
        self.k = self._leaf("t", TIME, 0)
        self.inverse, self.time = (self._leaf("inputs", INPUT, j) for j in range(2))
        self.state = {name: (self._leaf("q", COORDINATE, j), self._leaf("ud", ACCELERATION, j)) for j, name in enumerate(state)}
        self.coefficients: dict[Node, Any] = {}
        self.kept: dict[Node, Node] = {}
        self.sums: dict[tuple[Node, Node, bool], Node] = {}

    def series(self, field: Sequence[Any]) -> Series:
        rates = [self.of(entry) for entry in field]
        factors: dict[Node, tuple[Any, Any]] = {}
        waiting = set(reachable(rates))
        while waiting:  # of all sums only those that are used; their factors may need further ones
            reached: set[Node] = set()
            for (a, b, of_rate), leaf in list(self.sums.items()):
                if leaf in waiting and leaf not in factors:
                    factors[leaf] = (self.rate(a) if of_rate else self.of(a), self.of(b))
                    reached.update(reachable(factors[leaf]))
            waiting = reached
        entries = [*rates, *(a for a, _ in factors.values()), *(b for _, b in factors.values())]
        used = set(reachable(entries))
        kept = {node: leaf for node, leaf in self.kept.items() if leaf in used}
        for group, nodes in (("u", factors), ("z", kept.values())):
            self.leaves |= {leaf.args[1]: (group, index) for index, leaf in enumerate(nodes)}
        start = Tape.of(self.r, series_start=np.array([*field, *kept], dtype=object))
        following = Tape.of(self.r, series_next=np.array(entries, dtype=object))
        return Series(start, following, self.leaves, len(rates), len(kept), len(factors))

    def _leaf(self, group: str, mask: int, index: int) -> Node:
        name = f"series {group}{index + 1}"  # no name that a user can give
        self.leaves[name] = (group, index)
        return self.r.leaf(name, mask)

    # -- what the rules are made of

    def of(self, value: Any) -> Any:
        """The coefficient of order k >= 1."""
        if not _moves(value):
            return 0
        if value not in self.coefficients:
            for node in reachable([value]):
                if _moves(node) and node not in self.coefficients:
                    self.coefficients[node] = self._rule(node)
        return self.coefficients[value]

    def rate(self, value: Node) -> Any:
        """k times the coefficient of order k."""
        return self.state[value.args[1]][1] if value.op == "leaf" and value.args[1] in self.state else self.k * self.of(value)

    def at(self, value: Any) -> Any:
        """The coefficient of order 0, which the start hands on unless it depends on parameters only."""
        core = unsigned(value)
        if not isinstance(core, Node) or not core.mask & ~PARAMETER:
            return value
        if core not in self.kept:
            self.kept[core] = self._leaf("z", STATE, len(self.kept))
        return self.kept[core] if core is value else -self.kept[core]

    def sum(self, a: Any, b: Any, of_rate: bool = False) -> Any:
        """S_k of a and b, or of t a' and b."""
        (factor_a, a), (factor_b, b) = _varying(a), _varying(b)
        if a is None or b is None:
            return 0
        if a.index > b.index and not of_rate:
            a, b = b, a
        if (a, b, of_rate) not in self.sums:
            self.sums[a, b, of_rate] = self._leaf("u", SPEED, len(self.sums))
        return factor_a * factor_b * self.sums[a, b, of_rate]

    # -- the rules

    def _rule(self, node: Node) -> Any:
        op, args = node.op, node.args
        if op == "leaf":
            return self.state[args[1]][0] if args[1] in self.state else self.time
        if op in ("add", "sub"):
            a, b = map(self.of, args)
            return a + b if op == "add" else a - b
        if op in ("neg", "guard"):
            return -self.of(args[0]) if op == "neg" else self.of(args[0])
        if op == "mul":
            return self._product(node, *args) if all(map(_moves, args)) else self._multiple(node)
        if op == "div":
            return self._quotient(node, *args)
        if op == "sqrt":
            return (self.of(args[0]) - self.sum(node, node)) * self.at(self.r.div(1, 2 * node))
        return self._function(node)

    def _multiple(self, node: Node) -> Any:
        """A constant times a constant times a variable: one product, by what is computed once."""
        factor, varying = _varying(node)
        return self.at(factor) * self.of(varying)

    def _product(self, node: Node, a: Any, b: Any) -> Any:
        for x, y in ((a, b), (b, a)):
            if isinstance(y, Node) and y.op == "div" and _moves(y) and not _moves(y.args[0]):
                return self._quotient(node, x * y.args[0], y.args[1])  # one sum, not two
        if a is b:
            return self.at(2 * a) * self.of(a) + self.sum(a, a)
        return self.at(a) * self.of(b) + self.of(a) * self.at(b) + self.sum(a, b)

    def _quotient(self, node: Node, a: Any, b: Any) -> Any:
        if not _moves(b):
            return self.of(a) * self.at(self.r.div(1, b))
        rest = self.of(a) - self.at(node) * self.of(b) - self.sum(b, node)
        return rest * self.at(self.r.div(1, b))

    def _function(self, node: Node) -> Any:
        """y' = sum of (dy/da) a' over the arguments a."""
        rule = OPERATIONS[node.op].partials
        assert rule is not None
        slopes = rule(self.r, node, node.args)
        if node.op == "pow":  # else the slope would be another power
            slopes = (node.args[1] * node / node.args[0], slopes[1])
        total: Any = 0
        for a, slope in zip(node.args, slopes, strict=True):
            if _moves(a):
                total = total + self.at(slope) * self.of(a) + self.inverse * self.sum(a, slope, of_rate=True)
        return total


def _moves(value: Any) -> bool:
    """Whether a value changes over a step."""
    return isinstance(value, Node) and bool(value.mask & _MOVING)


def _varying(value: Any) -> tuple[Any, Any]:
    """(factor, core) with value = factor*core + constant; the core is None if nothing varies."""
    factor: Any = 1
    while _moves(value):
        if value.op == "guard":
            value = value.args[0]
        elif value.op == "neg":
            factor, value = -factor, value.args[0]
        elif value.op in ("add", "sub", "mul") and not (_moves(value.args[0]) and _moves(value.args[1])):
            a, b = value.args
            if value.op == "mul":
                factor = factor * (a if _moves(b) else b)
            elif value.op == "sub" and _moves(b):
                factor = -factor
            value = b if _moves(b) else a
        else:
            return factor, value
    return 0, None
