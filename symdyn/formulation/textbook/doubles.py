"""Nodes of a tape in double precision, one after the other, by Python's own functions."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from symdyn.tape.node import Node
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.tape import reachable

_OWN: dict[str, Callable[..., Any]] = {
    "add": operator.add, "sub": operator.sub, "mul": operator.mul, "div": operator.truediv, "neg": operator.neg,
    "pow": math.pow, "abs": abs, "sign": lambda a: float((a > 0) - (a < 0)), "min": min, "max": max, "lt": operator.lt,
    "le": operator.le, "gt": operator.gt, "ge": operator.ge, "eq": operator.eq, "ne": operator.ne,
    "and": lambda a, b: a and b, "or": lambda a, b: a or b, "not": operator.not_,
    "select": lambda condition, a, b: a if condition else b, "pi": lambda: math.pi,
    "guard": lambda value, margin: value if margin > 0 else math.nan}
_FUNCTIONS = {op: _OWN[op] if op in _OWN else getattr(math, row.mpmath) for op, row in OPERATIONS.items()
              if op in _OWN or row.mpmath}


class Doubles:
    """Evaluates nodes; the order of the steps is found once."""

    def __init__(self, nodes: Sequence[Node]) -> None:
        self._leaves: list[tuple[int, str]] = []
        self._steps: list[tuple[int, Callable[..., Any], list[int]]] = []
        self._start: list[Any] = []
        place: dict[Any, int] = {}
        for node in reachable(nodes):
            arguments = []
            for a in node.args if node.op != "leaf" else ():
                if isinstance(a, Node):
                    arguments.append(place[a])
                else:
                    arguments.append(len(self._start))
                    self._start.append(a if isinstance(a, bool) else float(a))
            place[node] = len(self._start)
            self._start.append(math.nan)
            if node.op == "leaf":
                self._leaves.append((place[node], node.args[1]))
            else:
                self._steps.append((place[node], _FUNCTIONS[node.op], arguments))
        self._results = [place[node] for node in nodes]

    def at(self, values: Mapping[str, Any]) -> list[Any]:
        """The values of the nodes, for values of the leaves by name; NaN where an operation has no real result."""
        done = list(self._start)
        for place, name in self._leaves:
            done[place] = float(values[name])
        for place, function, arguments in self._steps:
            try:
                done[place] = function(*[done[k] for k in arguments])
            except (ValueError, ZeroDivisionError):  # harmless in a branch that is not taken
                done[place] = math.nan
            except OverflowError:
                done[place] = math.inf
        return [done[k] for k in self._results]
