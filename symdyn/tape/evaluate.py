"""Evaluate a tape directly: at any precision with mpmath, which is the yardstick for rounding error, or in floats."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np

from symdyn.errors import UnsupportedExpression
from symdyn.tape.node import Node
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.tape import Tape, reachable


def evaluate(tape: Tape, values: Mapping[str, Any], digits: int = 30,
             constants: Callable[[Fraction], Fraction] | None = None) -> dict[str, np.ndarray]:
    """All outputs of the tape at `digits` decimal digits, as arrays of mpmath numbers.

    values      leaf name -> number (floats are taken as the exact binary numbers they are)
    constants   what to take in place of a fraction that stands on the tape; default: itself
    Raises KeyError naming the inputs that have no value.
    """
    missing = [leaf.args[1] for leaf in tape.inputs if leaf.args[1] not in values]
    if missing:
        raise KeyError(f"no value for {', '.join(missing)}")
    context, functions = _arithmetic(digits)
    done: dict[Node, Any] = {}

    def number(value: Any) -> Any:
        if isinstance(value, Node):
            return done[value]
        if isinstance(value, bool):
            return value
        if not isinstance(value, Fraction):
            return context.mpf(value)
        taken = value if constants is None else constants(value)
        return context.mpf(taken.numerator) / taken.denominator

    for node in tape.steps:
        if node.op == "leaf":
            done[node] = context.mpf(values[node.args[1]])
        elif node.op == "call":
            done[node] = node.args[0].precise(context, [number(a) for a in node.args[1:]])
        elif node.op == "item":
            done[node] = done[node.args[0]][node.args[1]]
        else:
            try:
                done[node] = functions[node.op](*[done[a] if isinstance(a, Node) else number(a) for a in node.args])
            except ZeroDivisionError:  # harmless in a branch that is not taken
                done[node] = context.nan
    result = {}
    for name, output in tape.outputs.items():
        array = np.empty(len(output.entries), dtype=object)
        array[:] = [number(e) for e in output.entries]
        result[name] = array.reshape(output.shape)
    return result


def double(value: Any) -> float:
    """The nearest float of a number. Raises UnsupportedExpression for one beyond the range of doubles."""
    try:
        return float(value)
    except OverflowError:
        raise UnsupportedExpression("numbers of the model multiply to more than the range of double precision, 1.8e308; give "
                                    "them "
                                    "in other units") from None


def constant(value: Any) -> float:
    """The nearest float of a number or of a node without inputs, such as cos(1) or pi/6.

    Raises UnsupportedExpression if it is complex, as acos(3) is, and if it is beyond the range of doubles.
    """
    if not isinstance(value, Node):
        return double(value)
    context, functions = _arithmetic(40)
    done: dict[Node, Any] = {}
    for node in reachable([value]):
        done[node] = functions[node.op](*[done[a] if isinstance(a, Node) else context.mpf(Fraction(a).numerator)
                                          / Fraction(a).denominator for a in node.args])
    if isinstance(done[value], context.mpc):
        raise UnsupportedExpression(f"a constant of the equations is the complex number {context.nstr(done[value], 6)}; "
                                    "look for the root, logarithm or arc function of a number outside its range")
    return float(done[value])


@functools.cache
def _arithmetic(digits: int) -> tuple[Any, dict[str, Callable]]:
    """A context of mpmath with so many decimal digits, and its functions; it is made once, which takes milliseconds."""
    context = mpmath.mp.clone()
    context.dps = digits
    return context, functions_of(context)


def functions_of(context: Any) -> dict[str, Callable]:
    """Operation -> what computes it with numbers of an mpmath context."""
    special: dict[str, Callable] = {
        "pi": lambda: +context.pi,
        "select": lambda c, a, b: a if c else b,
        "guard": lambda value, margin: value if margin > 0 else context.nan,
        "lt": operator.lt, "le": operator.le, "gt": operator.gt, "ge": operator.ge, "eq": operator.eq, "ne": operator.ne,
        "and": lambda a, b: a and b, "or": lambda a, b: a or b, "not": lambda a: not a,
        "min": min, "max": max,
        "add": operator.add, "sub": operator.sub, "mul": operator.mul, "div": operator.truediv, "neg": operator.neg,
    }
    return {op: special[op] if op in special else getattr(context, row.mpmath) for op, row in OPERATIONS.items()
            if op in special or row.mpmath}
