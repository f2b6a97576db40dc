"""Evaluates a tape with many digits by FLINT, several times as fast as by mpmath: for questions that are asked while deriving.

References for rounding errors stay with mpmath (symdyn.tape.evaluate).
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb
from flint import ctx as context

from symdyn.tape.evaluate import Lenient, outputs_of
from symdyn.tape.node import Node
from symdyn.tape.tape import Tape
from symdyn.tape.walk import Arithmetic, walk

_NAN = arb(math.nan)
# Operations that FLINT computes, without the radii of its balls; all others are left to mpmath.
_FLINT: dict[str, Callable[..., Any]] = {
    "add": lambda a, b: (a + b).mid(), "sub": lambda a, b: (a - b).mid(), "mul": lambda a, b: (a * b).mid(),
    "div": lambda a, b: (a / b).mid(), "neg": operator.neg, "sqrt": lambda a: a.sqrt().mid(),
    "sin": lambda a: a.sin().mid(), "cos": lambda a: a.cos().mid()}
# Truths, and choices by them, are the same for all numbers.
_CHOICES = ("lt", "le", "gt", "ge", "eq", "ne", "and", "or", "not", "select", "min", "max")


def evaluate_quickly(tape: Tape, values: Mapping[str, float], digits: int) -> dict[str, np.ndarray]:
    """All outputs of the tape at `digits` decimal digits, as arrays of FLINT's numbers; NaN for what is no real number.

    values   leaf name -> number, taken as the exact binary number that it is
    """
    before, context.dps = context.dps, digits
    try:
        return outputs_of(tape, walk(tape.steps, _Flint(values, digits)).of)
    finally:
        context.dps = before


class _Flint(Arithmetic):
    """Numbers of FLINT's, by name for the leaves."""

    def __init__(self, values: Mapping[str, float], digits: int) -> None:
        self.values = values
        self.precise = Lenient(digits)
        others = self.precise.functions
        self.functions = {**others, **_FLINT}
        self.foreign = others.keys() - _FLINT.keys() - set(_CHOICES)

    def leaf(self, node: Node) -> Any:
        return arb(self.values[node.args[1]])

    def number(self, value: Any) -> Any:
        if isinstance(value, Fraction):
            return (arb(value.numerator) / value.denominator).mid()
        return value if isinstance(value, bool) else arb(value).mid()

    def step(self, node: Node, args: list[Any]) -> Any:
        if node.op in self.foreign:
            return self._taken(self.precise.step(node, [self._given(a) for a in args]))
        return self.functions[node.op](*args)

    def call(self, node: Node, args: list[Any]) -> Any:
        return [self._taken(v) for v in self.precise.call(node, [self._given(a) for a in args])]

    def _given(self, value: Any) -> Any:
        """A number as mpmath has it."""
        if not isinstance(value, arb):
            return value
        if not value.is_finite():
            return self.precise.context.mpf(float(value))
        mantissa, exponent = value.man_exp()
        return self.precise.context.ldexp(int(mantissa), int(exponent))

    @staticmethod
    def _taken(value: Any) -> Any:
        """A number of mpmath's, or a truth."""
        return value if isinstance(value, bool) else arb(value) if hasattr(value, "_mpf_") else _NAN
