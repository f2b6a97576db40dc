"""Evaluate a tape directly: at any precision with mpmath, which is the reference for rounding error, or in floats."""

from __future__ import annotations

import functools
import math
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
from symdyn.tape.walk import Arithmetic, walk


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
    return outputs_of(tape, walk(tape.steps, _AtLeaves(digits, values, constants)).of)


def outputs_of(tape: Tape, value: Callable[[Any], Any]) -> dict[str, np.ndarray]:
    """Outputs by name as arrays of objects; value: of an entry."""
    result = {}
    for name, output in tape.outputs.items():
        array = np.empty(len(output.entries), dtype=object)
        array[:] = [value(e) for e in output.entries]
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
    digits = Digits(40)
    try:
        found = walk(reachable([value]), digits)[value]
    except OverflowError:  # of mpmath, for exp(exp(exp(exp(9)))), whose exponent has too many digits itself
        found = digits.context.inf
    if isinstance(found, digits.context.mpc):
        raise UnsupportedExpression(f"a constant of the equations is the complex number {digits.context.nstr(found, 6)}; "
                                    "look for the root, logarithm or arc function of a number outside its range")
    result = float(found)
    if math.isinf(result):
        raise UnsupportedExpression("a constant of the equations is beyond the range of double precision, 1.8e308; look for an "
                                    "exponential or a power of numbers that large")
    return result


class Digits(Arithmetic):
    """Numbers of mpmath with so many decimal digits."""

    def __init__(self, digits: int) -> None:
        self.context, self.functions = _arithmetic(digits)

    def number(self, value: Any) -> Any:
        if isinstance(value, bool):
            return value
        if isinstance(value, Fraction):
            return self.context.mpf(value.numerator) / value.denominator
        return self.context.mpf(value)


class Lenient(Digits):
    """With NaN for what is not defined, and functions of the user with many digits."""

    @classmethod
    def of(cls, context: Any) -> Lenient:
        """With the digits of a context of mpmath."""
        made = cls.__new__(cls)
        made.context, made.functions = context, functions_of(context)
        return made

    def step(self, node: Node, args: list[Any]) -> Any:
        try:
            return self.functions[node.op](*args)
        except ZeroDivisionError:  # harmless in a branch that is not taken
            return self.context.nan

    def call(self, node: Node, args: list[Any]) -> Any:
        return node.args[0].precise(self.context, args)


class _AtLeaves(Lenient):
    """With numbers for the leaves, by name, and others in place of constants."""

    def __init__(self, digits: int, values: Mapping[str, Any], constants: Callable[[Fraction], Fraction] | None) -> None:
        super().__init__(digits)
        self.values, self.constants = values, constants

    def leaf(self, node: Node) -> Any:
        return self.context.mpf(self.values[node.args[1]])

    def number(self, value: Any) -> Any:
        return super().number(self.constants(value) if self.constants is not None and isinstance(value, Fraction) else value)


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
