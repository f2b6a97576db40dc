"""Nodes of a tape in double precision, one after the other, by Python's own functions."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from symdyn.tape.node import Node
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.tape import reachable
from symdyn.tape.walk import Arithmetic, walk

_OWN: dict[str, Callable[..., Any]] = {
    "add": operator.add, "sub": operator.sub, "mul": operator.mul, "div": operator.truediv, "neg": operator.neg,
    "pow": math.pow, "abs": abs, "sign": lambda a: float((a > 0) - (a < 0)), "min": min, "max": max, "lt": operator.lt,
    "le": operator.le, "gt": operator.gt, "ge": operator.ge, "eq": operator.eq, "ne": operator.ne,
    "and": lambda a, b: a and b, "or": lambda a, b: a or b, "not": operator.not_,
    "select": lambda condition, a, b: a if condition else b, "pi": lambda: math.pi,
    "guard": lambda value, margin: value if margin > 0 else math.nan}
_FUNCTIONS = {op: _OWN[op] if op in _OWN else getattr(math, row.mpmath) for op, row in OPERATIONS.items()
              if op in _OWN or row.mpmath}


class Doubles(Arithmetic):
    """Evaluates nodes; the order of the steps is found once. The walk gives each step its index in the list of values."""

    functions = _FUNCTIONS

    def __init__(self, nodes: Sequence[Node]) -> None:
        self._leaves: list[tuple[int, str]] = []
        self._steps: list[tuple[int, Callable[..., Any], list[int]]] = []
        self._start: list[Any] = []
        self._results = list(map(walk(reachable(nodes), self).__getitem__, nodes))

    def leaf(self, node: Node) -> int:
        index = self.number(math.nan)
        self._leaves.append((index, node.args[1]))
        return index

    def number(self, value: Any) -> int:
        self._start.append(value if isinstance(value, bool) else float(value))
        return len(self._start) - 1

    def step(self, node: Node, args: list[int]) -> int:
        index = self.number(math.nan)
        self._steps.append((index, self.functions[node.op], args))
        return index

    def at(self, values: Mapping[str, Any]) -> list[Any]:
        """The values of the nodes, for values of the leaves by name; NaN where an operation has no real result."""
        done = list(self._start)
        for index, name in self._leaves:
            done[index] = float(values[name])
        for index, function, arguments in self._steps:
            try:
                done[index] = function(*[done[k] for k in arguments])
            except (ValueError, ZeroDivisionError):  # harmless in a branch that is not taken
                done[index] = math.nan
            except OverflowError:
                done[index] = math.inf
        return [done[k] for k in self._results]
