"""Jumps of weights at events on the way back: one event, or several at one time, each of which happens at its own.

An event comes later by what moves its quantity over its rate, and the weights jump by the transpose of the saltation matrix.
Several events at one time have saltation matrices one after the other, with the slopes between them, if the result is the same
in any order; else they are taken for one event. The same in C: templates/c/runtime/events.h. Source: Hiskens and Pai, Trajectory
sensitivity analysis of hybrid systems, 2000.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import EvaluationError
from symdyn.runtime.integrating.carried_on import CarriedOn
from symdyn.runtime.integrating.grazing import JUMPS
from symdyn.runtime.integrating.outcome import Request
from symdyn.runtime.integrating.quadrature import Integral
from symdyn.runtime.integrating.way_back import Way

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Relative differences up to which the times of events change alike, and matrices of two orders are the same.
ALIKE, SAME = 1e-9, 1e-7
# Part of its size that a gradient of a quantity must keep when those of the others are taken away.
APART = 1e-5


class Field:
    """The right-hand side of a piece in Python."""

    def __init__(self, module: Module, request: Request) -> None:
        self.module, self.p, self.given = module, request.p, request.inputs

    def inputs(self, t: float, x: np.ndarray) -> np.ndarray:
        return self.given.rows(np.array([t]), x[None, :])[0]

    def __call__(self, t: float, x: np.ndarray) -> np.ndarray:
        return self.module.evaluate("rhs", t, x, self.p, self.inputs(t, x))

    def one_sided(self, t: float, x: np.ndarray, step: float) -> np.ndarray:
        """The slope at a state as it is on one side of it, to second order in the step, which has a sign."""
        slope = self(t, x)
        for _ in range(3):  # the first ones go over to the side
            far = slope = self(t + 2 * step, x + 2 * step * slope)
        for _ in range(3):
            slope = self(t + step, x + step * slope)
        return 2 * slope - far


@dataclass
class Jump:
    """Events at a time: states and slopes before and after, None after an end; which of them sets the time; step: a short one,
    by which either side is looked at.

    The change of the time by those of the state before it and of the others is -(by_x x' + by p')/rate.
    """

    way: Way
    t: float
    x: np.ndarray
    slope: np.ndarray
    events: tuple[int, ...]
    first: int
    step: float
    after: np.ndarray | None = None
    slope_after: np.ndarray | None = None
    reset: CarriedOn | None = None

    def back(self, integral: Integral | None, weights: np.ndarray, end: float = 0.0) -> float:
        """Carry weights of the state after it to that before, in place; end: what the loss gains by time, where the motion ends
        here."""
        n_x = len(self.x)
        g_x, _, g_others = self.derivatives("events")
        later, rate = end, self.rate()
        if integral is not None:
            later += self._cost(integral, self.x, self.slope, -self.step)
        if integral is not None and self.after is not None and self.slope_after is not None:
            later -= self._cost(integral, self.after, self.slope_after, self.step)
        if self.after is None:
            later += float(weights[:n_x] @ self.slope)
        else:
            assert self.slope_after is not None
            moved = weights[:n_x].copy()
            later -= float(moved @ self.slope_after)
            by_x, by_t, by_others = self._through_resets()
            weights[:n_x] = moved @ by_x
            weights[n_x:] += moved @ by_others
            later += float(moved @ by_t) + float(weights[:n_x] @ self.slope)
        weights[:n_x] -= later / rate * g_x[self.first]
        weights[n_x:] -= later / rate * g_others[self.first]
        return 0.0

    def rate(self) -> float:
        """Rate of the quantity that sets the time, along the motion before it."""
        g_x, g_t, _ = self.derivatives("events")
        return float(g_t[self.first] + g_x[self.first] @ self.slope)

    def _through_resets(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Derivatives of the state after resets by that before, by the time, and by what is carried."""
        n_x = len(self.x)
        by_x, by_t, by_others = np.eye(n_x), np.zeros(n_x), np.zeros((n_x, len(self.way.carried)))
        indices, rows = self.resets()
        if indices:
            by_x[indices], by_t[indices], by_others[indices] = (d[rows] for d in self.derivatives("event_resets"))
        if self.reset is None or self.slope_after is None:
            return by_x, by_t, by_others
        whole = self.reset.carried(self.way, np.column_stack([by_x, by_t, by_others]), self.slope_after)
        return whole[:, :n_x], whole[:, n_x], whole[:, n_x + 1:]

    def go_on(self, after: np.ndarray) -> np.ndarray:
        """The state after the resets; after: that before them, which is changed."""
        module, p, indices = self.way.module, self.way.request.p, self.resets()[0]
        if not indices:
            return after
        values = module.evaluate("event_resets", self.t, self.x, p, Field(module, self.way.request).inputs(self.t, self.x))
        after[indices] = values[self.resets()[1]]
        if module.metadata.constraints and any(index < module.metadata.sizes.q + module.metadata.sizes.u for index in indices):
            self.reset = CarriedOn.of(module, self.t, after, p, indices)
            return self.reset.after
        return after

    def resets(self) -> tuple[list[int], list[int]]:
        """Entries of the state that are reset, and their rows in the function of all resets; the last reset of one counts."""
        result, row = {}, 0
        for k, record in enumerate(self.way.module.metadata.events):
            for index in record.reset:
                if k in self.events:
                    result[index] = row
                row += 1
        return list(result), list(result.values())

    def _cost(self, integral: Integral, x: np.ndarray, slope: np.ndarray, step: float) -> float:
        """The integrand as it is on one side of a state, where it may jump with the event."""
        steps = step * np.array([1.0, 2.0])
        t, states = self.t + steps, x + steps[:, None] * slope
        near, far = integral(t, states, self.way.request.inputs.rows(t, states)).values
        return float(2 * near - far)

    def derivatives(self, of: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Derivatives of a function by the state before, by the time, and by the carried quantities."""
        module, request, metadata = self.way.module, self.way.request, self.way.module.metadata
        inputs = request.inputs.rows(np.array([self.t]), self.x[None, :])[0]
        J: Any = module.jacobian(self.t, self.x, request.p, inputs, ["x", "t", "params", "inputs"], of)
        known = dict(zip((*metadata.parameters, *metadata.inputs), np.hstack([J.params, J.inputs]).T, strict=True))
        others = np.array([known[name] for name in self.way.carried]).reshape(len(self.way.carried), len(J.x)).T
        rows = np.hstack([J.x, others])
        for row in rows:
            self.way.feedback.fold(self.t, self.x, row)
        return rows[:, :len(self.x)], J.t[:, 0], rows[:, len(self.x):]


class Several:
    """Events at one time on the way back; side: a step, with sign, to the side where the motion goes on."""

    def __init__(self, jump: Jump, side: float) -> None:
        self.way, self.t, self.x, self.slope, self.side = jump.way, jump.t, jump.x, jump.slope, side
        self.field = Field(self.way.module, self.way.request)
        records = self.way.module.metadata.events
        self.events = tuple(k for k in jump.events if records[k].reset or self._jumps_alone(k, jump.events))

    def in_turn(self) -> list[Jump] | None:
        """A jump of each event that has an effect, one after the other; of one time a single one. None: what they do depends on
        their order."""
        if len(self.events) < 2 or self._alike():
            return []
        n = len(self.events)
        orders: list[tuple[int, ...]] = [self.events, self.events[::-1]]
        for k in range(n - 1 if n > 2 else 0):
            orders.append((*self.events[:k], self.events[k + 1], self.events[k], *self.events[k + 2:]))
        together = self._jump(self.x, self.slope, self.events).go_on(self.x.copy())
        request, result = self.way.request, []
        for order in orders:
            try:
                jumps = self._ordered(order)
            except EvaluationError:
                return None
            if jumps is None or jumps[-1].after is None:
                return None
            if (np.abs(jumps[-1].after - together) > request.atol + request.rtol * np.abs(together)).any():
                return None
            result.append((jumps, self._matrix(jumps)))
        first = result[0][1]
        size = np.abs(first).max(axis=0)
        return result[0][0] if all((np.abs(other - first) <= SAME * size).all() for _, other in result) else None

    def _jump(self, x: np.ndarray, slope: np.ndarray, events: tuple[int, ...]) -> Jump:
        return Jump(self.way, self.t, x, slope, events, events[0], self.side)

    def _alike(self) -> bool:
        """Whether the times of all events change alike with everything."""
        jump = self._jump(self.x, self.slope, self.events)
        g_x, g_t, g_others = jump.derivatives("events")
        rates = g_t + g_x @ self.slope
        rows = [self._allowed(self.x, np.concatenate([g_x[k], g_others[k]]) / rates[k]) for k in self.events]
        return all((np.abs(row - rows[0]) <= ALIKE * np.abs(rows[0]).max()).all() for row in rows)

    def _jumps_alone(self, k: int, events: Sequence[int]) -> bool:
        """Whether the right-hand side jumps at one of the events."""
        slope = self._between(self.x, {other: other == k for other in events})
        return slope is None or _differ(self.slope, slope)

    def _ordered(self, order: Sequence[int]) -> list[Jump] | None:
        """The jumps in an order; None where slopes between them are not known."""
        x, slope, jumps = self.x, self.slope, list[Jump]()
        for number, k in enumerate(order):
            jump = self._jump(x, slope, (k,))
            jump.after = jump.go_on(x.copy())
            over = {other: index <= number for index, other in enumerate(order)}
            then = self._between(jump.after, over) if number + 1 < len(order) else None
            if then is None and number + 1 < len(order):
                return None
            jump.slope_after = self.field.one_sided(self.t, jump.after, self.side) if then is None else then
            x, slope = jump.after, jump.slope_after
            jumps.append(jump)
        return jumps

    def _between(self, x: np.ndarray, over: dict[int, bool]) -> np.ndarray | None:
        """The slope at a state where quantities of some events have gone over, and those of others not yet: along the nearest way
        to that side. None: there is none."""
        g_x, g_t, _ = self._jump(x, self.slope, tuple(over)).derivatives("events")
        rows = np.column_stack([g_t, g_x])[list(over)]
        lengths = np.linalg.norm(rows, axis=1)
        if not lengths.all() or np.linalg.svd(rows / lengths[:, None], compute_uv=False)[-1] < APART:
            return None
        before = np.concatenate([[1.0], self.slope])
        waiting = ~np.array(list(over.values()))
        slope = far = self.field(self.t, x)
        for part in (2, 1):
            far = slope
            for _ in range(3):  # the first ones go over to the side
                along = np.concatenate([[1.0], slope])
                gap = np.where(waiting, -rows @ before - rows @ along, 0.0)
                along += np.linalg.lstsq(rows / lengths[:, None], gap / lengths, rcond=None)[0]
                slope = self.field(self.t + part * self.side * along[0], x + part * self.side * along[1:])
        between: np.ndarray = 2 * slope - far
        return between

    def _matrix(self, jumps: Sequence[Jump]) -> np.ndarray:
        """The derivatives of the state after jumps by the one before and by what is carried."""
        n_x, end, rows = len(self.x), jumps[-1].after, []
        assert end is not None
        for unit in np.eye(n_x):
            row = self._allowed(end, np.concatenate([unit, np.zeros(len(self.way.carried))]))
            for jump in reversed(jumps):
                jump.back(None, row)
            rows.append(self._allowed(self.x, row))
        return np.array(rows)

    def _allowed(self, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Weights of a state and of what is carried, along what the constraints allow."""
        if "corrected_weights" not in self.way.library.metadata.shapes:
            return weights
        result = self.way.weights("corrected_weights", self.t, x, weights[:len(x)])
        result[len(x):] += weights[len(x):]
        return result


def _differ(slope: np.ndarray, other: np.ndarray) -> bool:
    return bool((np.abs(other - slope) > JUMPS * (np.abs(other) + np.abs(slope))).any())
