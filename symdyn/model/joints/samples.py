"""Values of expressions at random points with many digits: what is the same there is taken to be the same everywhere."""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import sympy as sp

from symdyn.model.symbols import symbols_of
from symdyn.spatial.vectors import vector
from symdyn.tape.evaluate import evaluate
from symdyn.tape.node import PARAMETER
from symdyn.tape.recorder import Recorder
from symdyn.tape.sympy_bridge import record_expression
from symdyn.tape.tape import Tape

DIGITS = 40
POINTS = 3
TRIES = 60
# Some expressions are defined for small coordinates only, some vanish to rounding there.
REACHES = (1.0, 0.3, 3.0, 10.0)
_MEROMORPHIC = (sp.Add, sp.Mul, sp.sin, sp.cos, sp.tan, sp.exp, sp.sinh, sp.cosh, sp.tanh)


class Samples:
    """Random points where given expressions have real values.

    Coordinates are drawn from [-1, 1], [-0.3, 0.3], [-3, 3] and [-10, 10] in turn, all other symbols from [0.5, 1.5];
    `points` has three of them, fewer if few were found.
    Raises UnsupportedExpression for expressions that have no counterpart on the tape.
    """

    def __init__(self, expressions: Sequence[sp.Expr], coordinates: Sequence[sp.Symbol]) -> None:
        self.symbols = [*coordinates, *sorted({s for e in expressions for s in symbols_of(e)} - {*coordinates}, key=str)]
        self.points: list[dict[str, float]] = []
        stream = random.Random(1)
        for k in range(TRIES):
            reach = REACHES[k % len(REACHES)]
            point = {s.name: stream.uniform(-reach, reach) if s in coordinates else stream.uniform(0.5, 1.5)
                     for s in self.symbols}
            if self._at(self._tape(expressions), point) is not None:
                self.points.append(point)
            if len(self.points) == POINTS:
                break

    def values(self, expressions: Iterable[sp.Expr]) -> list[np.ndarray | None]:
        """The values of expressions in the symbols, at every point; None where one of them is not a real number."""
        tape = self._tape(expressions)
        return [self._at(tape, point) for point in self.points]

    def folded(self, expression: sp.Expr) -> sp.Expr:
        """The number that an expression is at every point, if it is a short fraction; else the expression.

        Only for meromorphic functions: if one of those is the same at random points, it is constant.
        """
        if expression.is_number or not self.points or not _meromorphic(expression):
            return expression
        result = self.values([expression])
        if any(v is None for v in result):
            return expression
        values = [v[0] for v in result if v is not None]
        short = Fraction(str(values[0])).limit_denominator(1000)
        with mpmath.workdps(DIGITS):
            near = all(abs(v - mpmath.mpf(short.numerator) / short.denominator) < mpmath.mpf(10) ** (10 - DIGITS)
                       for v in values)
        return sp.Rational(short.numerator, short.denominator) if near else expression

    def _tape(self, expressions: Iterable[sp.Expr]) -> Tape:
        recorder = Recorder()
        leaves = {s: recorder.leaf(s.name, PARAMETER) for s in self.symbols}
        memory: dict[sp.Basic, Any] = {}
        return Tape.of(recorder, values=vector(*[record_expression(recorder, e, leaves, memory) for e in expressions]))

    @staticmethod
    def _at(tape: Tape, point: dict[str, float]) -> np.ndarray | None:
        try:
            values = evaluate(tape, point, DIGITS)["values"]
            return values if all(mpmath.isfinite(v) and mpmath.im(v) == 0 for v in values) else None
        except (TypeError, ValueError, ArithmeticError):
            return None


def _meromorphic(e: sp.Expr) -> bool:
    if e.is_number or e.is_Symbol:
        return True
    known = isinstance(e, _MEROMORPHIC) or (isinstance(e, sp.Pow) and bool(e.exp.is_Integer))
    return known and all(map(_meromorphic, e.args))
