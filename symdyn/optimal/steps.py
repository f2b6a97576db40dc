"""Steps of Runge and Kutta's classical method across intervals, all of them at once, with exact first and second derivatives.

A stage is F at y_i = [x_i; inputs; parameters; duration], x_i = x + h sum a_ij F_j. Its derivatives by the arguments y of the
interval are G_i, and with the weights w_i of the stages, found backwards, the second derivatives of a weighted sum of what is
reached are sum G_i^T (d^2 w_i^T F) G_i: all else is linear.
Source: Griewank and Walther, Evaluating Derivatives, 2nd ed., section 5.1.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from symdyn.optimal.field import Field

# The classical method: nodes, what a stage goes on from (weight of the stage before), weights.
C, A, B = (0.0, 0.5, 0.5, 1.0), (0.0, 0.5, 0.5, 1.0), (1 / 6, 1 / 3, 1 / 3, 1 / 6)


class Stage(NamedTuple):
    """Field at the stage's times, its arguments (K, n_y), their derivatives G (K, n_y, n) by those of the interval, and
    F (K, n_x + 1)."""

    field: Field
    at: np.ndarray
    G: np.ndarray
    F: np.ndarray


class Steps:
    """The change of [x; cost] across each interval, as Rows of [x; inputs of the interval; free parameters; duration].

    field   at the starts of the intervals; h (K,) their lengths, shares of the duration; n: steps in each
    held    whether inputs are constant in an interval, else straight between two values
    """

    def __init__(self, field: Field, h: np.ndarray, n: int, held: bool) -> None:
        self.field, self.h, self.n, self.held = field, h, n, held
        of = field.dynamics.of
        self.of, self.size = of, of.n + (0 if held else of.n_in)
        self.slopes = np.ones((of.n_x + 1, self.size), dtype=bool)
        self.curvature = np.ones((self.size, self.size), dtype=bool)

    def values(self, at: np.ndarray) -> np.ndarray:
        x, cost = at[:, self.of.x].copy(), np.zeros(len(at))
        for stages in self._through(at, x, cost, None):
            del stages
        return np.column_stack([x - at[:, self.of.x], cost])

    def states(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Shares (K, n + 1), states (K, n + 1, n_x) and rates times the duration of all steps."""
        x, cost = at[:, self.of.x].copy(), np.zeros(len(at))
        states, slopes = [x.copy()], []
        for stages in self._through(at, x, cost, None):
            slopes.append(stages[0].F[:, :-1])
            states.append(x.copy())
        last = self._arguments(at, x, 1.0)
        shares = self.field.shares[:, None] + self.h[:, None] * np.arange(self.n + 1) / self.n
        slopes.append(self.field.at_shares(shares[:, -1]).values(last)[:, :-1])
        return shares, np.stack(states, axis=1), np.stack(slopes, axis=1)

    def jacobian(self, at: np.ndarray) -> np.ndarray:
        x, cost = at[:, self.of.x].copy(), np.zeros(len(at))
        D = self._unit(at)
        for stages in self._through(at, x, cost, D):
            del stages
        D[:, :self.of.n_x] -= self._unit(at)[:, :self.of.n_x]
        return D

    def hessian(self, at: np.ndarray, weights: np.ndarray) -> np.ndarray:
        x, cost = at[:, self.of.x].copy(), np.zeros(len(at))
        steps = list(self._through(at, x, cost, self._unit(at)))
        n_x, result = self.of.n_x, np.zeros((len(at), self.size, self.size))
        on_x, on_cost = weights[:, :-1].copy(), weights[:, -1:]
        h = (self.h / self.n)[:, None]
        for stages in reversed(steps):
            carried = np.zeros_like(on_x)  # weights of the state at the stage after
            total = on_x.copy()
            for i in reversed(range(len(C))):
                field, y, G, _ = stages[i]
                w = np.hstack([h * (B[i] * on_x + (A[i + 1] * carried if i + 1 < len(C) else 0.0)), h * B[i] * on_cost])
                result += np.einsum("kai,kab,kbj->kij", G, field.hessian(y, w), G, optimize=True)
                carried = np.einsum("ka,kai->ki", w, field.jacobian(y)[:, :, :n_x])
                total += carried
            on_x = total
        return result

    def _through(self, at: np.ndarray, x: np.ndarray, cost: np.ndarray, D: np.ndarray | None) -> Iterator[list[Stage]]:
        """Goes through the steps and changes x (K, n_x), the cost (K,) and their derivatives D (K, n_x + 1, n)."""
        n_x, h = self.of.n_x, (self.h / self.n)[:, None]
        for step in range(self.n):
            stages: list[Stage] = []
            change, slopes = np.zeros((len(at), n_x + 1)), None if D is None else np.zeros_like(D)
            F, DF = np.zeros((len(at), n_x + 1)), None if D is None else np.zeros_like(D)
            for c, a, b in zip(C, A, B, strict=True):
                share = (step + c) / self.n
                y = self._arguments(at, x + a * h * F[:, :-1], share)
                field = self.field.at_shares(self.field.shares + self.h * share)
                G = np.zeros(0)
                if D is not None and DF is not None:
                    G = self._inner(at, D[:, :n_x] + a * h[:, :, None] * DF[:, :n_x], share)
                F = field.values(y)
                stages.append(Stage(field, y, G, F))
                change += b * h * F
                if slopes is not None:
                    DF = field.jacobian(y) @ G
                    slopes += b * h[:, :, None] * DF
            x += change[:, :-1]
            cost += change[:, -1]
            if D is not None:
                D += slopes
            yield stages

    def _arguments(self, at: np.ndarray, x: np.ndarray, share: float) -> np.ndarray:
        """Those of the field at a share of the interval."""
        n_x, n_in = self.of.n_x, self.of.n_in
        first, rest = at[:, n_x:n_x + n_in], at[:, self.size - len(self.of.free) - 1:]
        inputs = first if self.held else (1 - share) * first + share * at[:, n_x + n_in:n_x + 2 * n_in]
        return np.hstack([x, inputs, rest])

    def _inner(self, at: np.ndarray, of_x: np.ndarray, share: float) -> np.ndarray:
        """Derivatives of these arguments, (K, n_y, n)."""
        n_x, n_in = self.of.n_x, self.of.n_in
        G = np.zeros((len(at), self.of.n, self.size))
        G[:, :n_x] = of_x
        index = np.arange(n_in)
        G[:, n_x + index, n_x + index] = 1 if self.held else 1 - share
        if not self.held:
            G[:, n_x + index, n_x + n_in + index] = share
        rest = np.arange(len(self.of.free) + 1)
        G[:, n_x + n_in + rest, self.size - len(rest) + rest] = 1
        return G

    def _unit(self, at: np.ndarray) -> np.ndarray:
        """Derivatives of [x; cost] at the starts."""
        D = np.zeros((len(at), self.of.n_x + 1, self.size))
        index = np.arange(self.of.n_x)
        D[:, index, index] = 1
        return D


