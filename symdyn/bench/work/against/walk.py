"""A tape in the expressions of another program: its steps one by one, parameters and constant inputs as numbers."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np

from symdyn.bench.work.against.peer import Unfit
from symdyn.functions.tapes import function_tape
from symdyn.tape.evaluate import functions_of
from symdyn.tape.node import Node
from symdyn.tape.tape import reachable

# What other programs call as the tape does.
ELEMENTARY = ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh",
              "exp", "log", "erf")
ARITHMETIC = {"add": operator.add, "sub": operator.sub, "mul": operator.mul, "div": operator.truediv, "neg": operator.neg,
              "pow": operator.pow}


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
    context, arithmetic = _precise()
    done: dict[Node, Any] = {}

    def known(value: Any) -> Any:
        if isinstance(value, Node):
            return done[value]
        if isinstance(value, Fraction):
            return context.mpf(value.numerator) / value.denominator
        return value if isinstance(value, bool) else context.mpf(value)

    is_number = lambda value: isinstance(value, (context.mpf, bool))
    rounded = lambda value: float(value) if isinstance(value, context.mpf) else value
    for node in reachable(entries):
        args = [known(a) for a in node.args] if node.op not in ("leaf", "call", "item") else []
        if node.op == "leaf":
            value = values[node.args[1]]
            done[node] = context.mpf(value) if isinstance(value, float) else value
        elif node.op in ("call", "item"):
            raise Unfit("its accelerations come from a numeric algorithm, not from a formula")
        elif node.op == "guard":
            done[node] = args[0]
        elif all(map(is_number, args)):
            done[node] = _number(context, arithmetic[node.op], args)
        elif node.op == "select" and isinstance(args[0], bool):
            done[node] = args[1] if args[0] else args[2]
        elif node.op in functions:
            done[node] = functions[node.op](*map(rounded, args))
        else:
            raise Unfit(f"{program} has no {node.op}")
    return [rounded(known(entry)) for entry in entries]


@functools.cache
def _precise() -> tuple[Any, Mapping[str, Callable[..., Any]]]:
    """A context of mpmath, and its functions."""
    context = mpmath.mp.clone()
    context.dps = 30
    return context, functions_of(context)


def _number(context: Any, function: Callable[..., Any], args: list[Any]) -> Any:
    try:
        value = function(*args)
    except ZeroDivisionError:  # harmless in a branch that is not taken
        value = context.nan
    return value if isinstance(value, bool) else context.mpf(value)
