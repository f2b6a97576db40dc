"""Expressions of a state, inputs, parameters and time, with exact first and second derivatives, at many points at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from symdyn.tape import node as kinds
from symdyn.tape.differentiate import forward, reverse
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.node import Node, is_zero
from symdyn.tape.recorder import Recorder
from symdyn.tape.sympy_bridge import record_expression
from symdyn.tape.tape import Output, Tape


class Expressions:
    """Values of m expressions, their derivatives by their arguments, and the second derivatives of a weighted sum of them.

    expressions   of SymPy, whose symbols are called as the arguments
    names         of the arguments, in the order of their columns
    constants     values of all other symbols, by name
    slopes, curvature   where derivatives (m, n) and second derivatives (n, n) may differ from zero
    Raises UnsupportedExpression for what a tape does not have.
    """

    def __init__(self, expressions: Sequence[Any], names: Sequence[str], constants: Mapping[str, float]) -> None:
        self.names, self.m, n = tuple(names), len(expressions), len(names)
        recorder = Recorder()
        leaves = {name: recorder.leaf(name, kinds.STATE) for name in names}
        self._weights = [f"(weight {k + 1})" for k in range(self.m)]
        at: dict[str, Any] = {**{name: Fraction(value) for name, value in constants.items()}, **leaves}
        values = [record_expression(recorder, e, {s: at[str(s)] for s in e.free_symbols}) for e in expressions]
        columns = list(leaves.values())
        first = np.array([reverse(recorder, value, columns) for value in values], dtype=object).reshape(self.m, n)
        total: Any = 0
        for name, value in zip(self._weights, values, strict=True):
            total = total + recorder.leaf(name, kinds.ACCELERATION) * value
        gradient = reverse(recorder, total, columns) if isinstance(total, Node) else [0] * n
        second = np.array([forward(recorder, gradient, {leaf: 1}) for leaf in columns], dtype=object).reshape(n, n)
        self.slopes, self.curvature = _present(first), _present(second)
        self.curvature |= self.curvature.T
        self._values = Tape(recorder, {"f": Output.of("f", np.array(values, dtype=object))})
        self._first = Tape(recorder, {"f": Output.of("f", first[self.slopes])})
        self._second = Tape(recorder, {"f": Output.of("f", second[self.curvature])})

    def values(self, at: np.ndarray) -> np.ndarray:
        """(N, m) at rows of arguments (N, n); NaN where an expression is not defined."""
        return self._at(self._values, at)

    def jacobian(self, at: np.ndarray) -> np.ndarray:
        """(N, m, n)."""
        result = np.zeros((len(at), *self.slopes.shape))
        result[:, self.slopes] = self._at(self._first, at)
        return result

    def hessian(self, at: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Second derivatives (N, n, n) of the sums with weights (N, m)."""
        result = np.zeros((len(at), *self.curvature.shape))
        result[:, self.curvature] = self._at(self._second, at, weights)
        return result

    def _at(self, tape: Tape, at: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
        values = dict(zip(self.names, at.T, strict=True))
        if weights is not None:
            values |= dict(zip(self._weights, weights.T, strict=True))
        return evaluate_rows(tape, values, len(at))["f"].reshape(len(at), -1)


def _present(entries: np.ndarray) -> np.ndarray:
    """Mask of the entries that are not zero by structure."""
    return np.array([not is_zero(e) for e in entries.ravel()], dtype=bool).reshape(entries.shape)
