"""A tape in the expressions of another program: its steps one by one, parameters and constant inputs as numbers."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from symdyn.bench.work.against.peer import Unfit
from symdyn.functions.tapes import function_tape
from symdyn.tape.evaluate import Digits
from symdyn.tape.node import Node
from symdyn.tape.tape import reachable
from symdyn.tape.walk import walk as tape_walk

# Functions with the same name in other programs and on the tape.
ELEMENTARY = ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh",
              "exp", "log", "erf")
ARITHMETIC: dict[str, Callable[..., Any]] = {"add": operator.add, "sub": operator.sub, "mul": operator.mul,
                                             "div": operator.truediv, "neg": operator.neg, "pow": operator.pow}


def right_hand_side(equations: Any, params: np.ndarray, state: Mapping[str, Any], functions: Mapping[str, Callable[..., Any]],
                    program: str) -> list[Any]:
    """x_dot, as it is compiled, in the expressions of a program; inputs stay at their initial values.

    state       leaf -> the program's variable, for t and the entries of x
    functions   operation of the tape -> what builds the program's expression
    Raises Unfit for an operation that it does not have.
    """
    symbols = equations.symbols
    values = {s.name: float(v) for s, v in zip(symbols.parameters, params, strict=True)}
    values |= constant_inputs(equations) | dict(state)
    entries = function_tape(equations, "rhs").outputs["rhs"].entries
    return walk(entries, values, functions, program)


def constant_inputs(equations: Any) -> dict[str, float]:
    """The inputs' initial values, zero where there is none."""
    initial = {str(key): float(value) for key, value in equations.symbols.initial.items()}
    return {s.name: initial.get(s.name, 0.0) for s in equations.symbols.inputs}


def walk(entries: tuple[Any, ...], values: Mapping[str, Any], functions: Mapping[str, Callable[..., Any]],
         program: str) -> list[Any]:
    """The entries; what depends on numbers alone is a number, rounded once. A guard is the value that it guards."""
    arithmetic = _Peer(values, functions, program)
    done = tape_walk(reachable(entries), arithmetic)
    return [arithmetic.rounded(done.of(entry)) for entry in entries]


class _Peer(Digits):
    """Numbers, with 30 digits, where all arguments are numbers; else the program's expressions."""

    def __init__(self, values: Mapping[str, Any], functions: Mapping[str, Callable[..., Any]], program: str) -> None:
        super().__init__(30)
        self.values, self.theirs, self.program = values, functions, program

    def leaf(self, node: Node) -> Any:
        value = self.values[node.args[1]]
        return self.context.mpf(value) if isinstance(value, float) else value

    def step(self, node: Node, args: list[Any]) -> Any:
        if node.op == "guard":
            return args[0]
        if all(isinstance(a, (self.context.mpf, bool)) for a in args):
            return self._number(node.op, args)
        if node.op == "select" and isinstance(args[0], bool):
            return args[1] if args[0] else args[2]
        if node.op not in self.theirs:
            raise Unfit(f"{self.program} has no {node.op}")
        return self.theirs[node.op](*map(self.rounded, args))

    def call(self, node: Node, args: list[Any]) -> Any:
        raise Unfit("its accelerations come from a numeric algorithm, not from a formula")

    def rounded(self, value: Any) -> Any:
        """A number as a double."""
        return float(value) if isinstance(value, self.context.mpf) else value

    def _number(self, op: str, args: list[Any]) -> Any:
        try:
            value = self.functions[op](*args)
        except ZeroDivisionError:  # harmless in a branch that is not taken
            return self.context.nan
        return value if isinstance(value, bool) else self.context.mpf(value)
