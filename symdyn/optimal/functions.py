"""Costs that are functions of the user, which give their derivatives: added to an expression, at many points at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError
from symdyn.optimal.expressions import Expressions
from symdyn.optimal.field import Arguments
from symdyn.optimal.outputs import WithOutputs
from symdyn.runtime.losses import cost_of
from symdyn.runtime.raised import InputRaised

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Step of differences of derivatives, relative to 1 and the argument: a third of the digits is best for central ones.
STEP = float(np.finfo(float).eps) ** (1 / 3)
# Steps of differences of values, likewise, and what derivatives may differ from them by, relative.
DIFFERENCES, NEAR = (1e-4, 1e-5), 1e-4
# Errors that a function may raise beyond where it is defined: steps that lead there are not taken.
OF_NUMBERS = (ArithmeticError, ValueError)


class _Differences(NamedTuple):
    """Central differences of values, those to either side, how uncertain the first are, the largest value, the step."""

    central: float
    before: float
    after: float
    uncertain: float
    size: float
    h: float


class WithFunctions:
    """An expression and functions of (t, x, p), added up, as Rows with one value.

    functions   of the user, see sd.Loss; what: as messages call them
    first       where [x; inputs; free parameters; t] begin among the arguments; p (n_p,): values of all parameters

    raised      the first EvaluationError where a function was not defined

    First derivatives are those that the functions give, second ones central differences of these: they say how a solver goes on,
    and not where it ends.
    """

    def __init__(self, expression: Expressions | WithOutputs, functions: Sequence[Callable[..., Any]], what: str, module: Module,
                 of: Arguments, p: np.ndarray, first: int) -> None:
        self.expression, self.functions, self.what, self.module = expression, functions, what, module
        self.of, self.p, self.first, self.m = of, p.copy(), first, 1
        self._x = np.arange(of.n_x) + first
        self._by = np.concatenate([self._x, first + of.n_x + of.n_in + np.arange(len(of.free))])
        self.raised: EvaluationError | None = None
        self._names = [module.metadata.parameters[k] for k in of.free]
        self.slopes, self.curvature = expression.slopes.copy(), expression.curvature.copy()
        self.slopes[:, self._by] = True
        self.curvature[np.ix_(self._by, self._by)] = True

    def values(self, at: np.ndarray) -> np.ndarray:
        return self.expression.values(at) + self._of_functions(at)[0][:, None]

    def jacobian(self, at: np.ndarray) -> np.ndarray:
        result = self.expression.jacobian(at)
        result[:, 0, self._by] += self._of_functions(at)[1]
        return result

    def hessian(self, at: np.ndarray, weights: np.ndarray) -> np.ndarray:
        result, n = self.expression.hessian(at, weights), len(self._by)
        second = np.zeros((len(at), n, n))
        for k, column in enumerate(self._by):
            h = STEP * (1 + np.abs(at[:, column]))
            sides = []
            for way in (-1, 1):
                moved = at.copy()
                moved[:, column] += way * h
                sides.append(self._of_functions(moved)[1])
            second[:, k] = (sides[1] - sides[0]) / (2 * h)[:, None]
        result[:, self._by[:, None], self._by] += weights[:, :, None] * (second + second.transpose(0, 2, 1)) / 2
        return result

    def depend_on_time(self, t: Sequence[float], x: np.ndarray) -> bool:
        """Whether values or derivatives at a state (n_x,) are others at other times."""
        rows = np.array(t, dtype=float), np.tile(x, (len(t), 1)), np.zeros((len(t), self.of.n_in))
        for function in self.functions:
            result = cost_of(self.module, self.what, function, self._names, self.p, compared=False)(*rows)
            if np.ptp(np.column_stack([result.values, result.by_x]), axis=0).any():
                return True
        return False

    def demand_derivatives(self, at: np.ndarray) -> None:
        """Raises ArgumentError where a derivative that a function gives is none of its values, at rows of arguments: central
        differences and those to either side, one of which may go over a kink."""
        names = (*self.module.metadata.x, *self._names)
        for function in self.functions:
            for row in at:
                here = self._one(function, row)
                for name, column, given in zip(names, self._by, () if here is None else here[1], strict=here is not None):
                    result = self._differences(function, row, column)
                    if result is None:
                        continue
                    rounding = 1e3 * np.finfo(float).eps * result.size / result.h
                    allowed = 10 * result.uncertain + rounding + NEAR * max(abs(given), abs(result.central))
                    if min(abs(given - d) for d in (result.central, result.before, result.after)) > allowed:
                        called = getattr(function, "__name__", "<lambda>")
                        which = "" if called == "<lambda>" else f" ({called})"
                        raise ArgumentError(f"{self.module.name}: the function for {self.what} of the loss{which} gives "
                                            f"{given:.6g} as its derivative by {name} at t = {row[-1]:.6g}, and differences of "
                                            f"its values give {result.central:.6g}; correct the derivative")

    def _differences(self, function: Callable[..., Any], row: np.ndarray, column: int) -> _Differences | None:
        """By one argument; None where the function is not defined to both sides."""
        steps, values = np.array(DIFFERENCES) * (1 + abs(row[column])), list[float]()
        for way in (-steps[0], -steps[1], 0.0, steps[1], steps[0]):
            moved = row.copy()
            moved[column] += way
            result = self._one(function, moved)
            if result is None:
                return None
            values.append(result[0])
        far, h = steps
        central = (values[3] - values[1]) / (2 * h)
        return _Differences(central, (values[2] - values[1]) / h, (values[3] - values[2]) / h,
                            abs(central - (values[4] - values[0]) / (2 * far)), float(np.abs(values).max()), h)

    def _one(self, function: Callable[..., Any], row: np.ndarray) -> tuple[float, np.ndarray] | None:
        """Value and derivatives (n,) of one function; None where it is not defined."""
        p = self.p.copy()
        p[list(self.of.free)] = row[self._by[self.of.n_x:]]
        try:
            cost = cost_of(self.module, self.what, function, self._names, p, compared=False)
            result = cost(row[-1:], row[None, self._x], np.zeros((1, self.of.n_in)))
        except EvaluationError as error:
            if isinstance(error, InputRaised) and not isinstance(error.__cause__, OF_NUMBERS):
                raise
            self.raised = self.raised or error
            return None
        return result.values[0], np.concatenate([result.by_x[0], np.zeros(0) if result.by is None else result.by[0]])

    def _of_functions(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values (N,) of all functions and their derivatives (N, n) by the state and free parameters; NaN where they are not
        finite. Errors that numbers do not cause, such as a missing name, are raised."""
        value, slopes = np.zeros(len(at)), np.zeros((len(at), len(self._by)))
        for k, row in enumerate(at):
            for function in self.functions:
                result = self._one(function, row) if np.isfinite(row).all() else None
                if result is None:
                    value[k], slopes[k] = np.nan, np.nan
                    break
                value[k] += result[0]
                slopes[k] += result[1]
        return value, slopes
