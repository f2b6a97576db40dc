"""The integral of a loss under error control: what its quadrature over the stages of steps may be off by, and where it jumps.

Steps are chosen for the state. The integrand is sampled at their stages and may need shorter ones: where it varies faster than
the state, at kinks, at jumps. Each step has an estimate, by the embedded weights that the method applies to its slopes, of the
integral and of the derivatives of the integrand; the way back takes steps again, shorter, where it is too large. At a jump that
passes with the state the integral depends on the time of it, -g_x dx/(dg/dt) for a surface g.
Source: Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, 2nd ed., section II.10 (the estimate).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from symdyn.backend.methods import method_of
from symdyn.runtime.losses import Cost, Costs

if TYPE_CHECKING:
    from symdyn.runtime.integrating.outcome import Request
    from symdyn.runtime.module import Module

# An integrand with kinks, whose estimates of steps across them are rough, has this part of the tolerances. The estimate of bs54
# is that of order 4, far above its error, and counts as so much of it.
ROUGH, ORDER_4 = 0.1, 0.1
# From so many steps on an integrand is measured by two of their stages.
FEW = 32
# Steps that a gradient may take again, shorter, at the most.
WORK = 50_000
# Length of a step with a jump that is short enough, of the span; the part of the outer step from which on values are looked at
# that still vary by so much of the largest.
SHORT, INNER, VARY = 1e-9, 1 / 500, 0.1
# A step that is shorter than so many units of the last place of its time is not divided.
LEAST = 1e3


@dataclass
class Integral:
    """The integrand of a loss along a motion, and what its integral is measured by.

    size, of_x, of_others   integrals of the sizes of the integrand and of its derivatives, by x (n_x,) and by the others
    slack                   what the tolerances of the state make of it
    work                    steps that may still be taken again; left: error that was left, left_slope: by derivatives, relative;
    at                      where it was left, s; jumps: what is to be said of jumps
    """

    module: Module
    cost: Cost
    request: Request
    method: str
    size: float = 0.0
    slack: float = 0.0
    of_x: np.ndarray = field(default_factory=lambda: np.zeros(0))
    of_others: np.ndarray | None = None
    largest: float = 0.0
    weighed: bool = False
    work: int = field(default_factory=lambda: WORK)
    left: float = 0.0
    left_slope: float = 0.0
    at: float = 0.0
    jumps: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.b, self.first, self.second = _weights(self.method)
        self.of_x, self.reach = np.zeros(len(self.request.x0)), np.abs(self.request.x0)

    def __call__(self, t: np.ndarray, x: np.ndarray, inputs: np.ndarray) -> Costs:
        return self.cost(t, x, inputs)

    def over_rows(self, t: np.ndarray, x: np.ndarray, inputs: np.ndarray) -> None:
        """Measure by rows of a motion, (n,) times and (n, n_x) states; inputs (n, n_in), or (1, n_in) where they are constant."""
        if len(t) < 2:
            return
        weights = np.zeros(len(t))
        weights[:-1] = 0.5 * np.abs(np.diff(t))
        weights[1:] += 0.5 * np.abs(np.diff(t))
        self.weigh(weights, x, self.cost(t, x, np.broadcast_to(inputs, (len(t), inputs.shape[1]))))

    def over_stages(self, h: np.ndarray, x: np.ndarray, costs: Costs) -> None:
        """Measure by steps of lengths h (n,), from the states and costs at all of their stages."""
        s = len(self.b)
        every = 1 if len(h) < FEW else s // 2
        weights, rows = np.repeat(np.abs(h) / s, s)[::every] * every, slice(None, None, every)
        by = None if costs.by is None else costs.by[rows]
        self.weigh(weights, x[rows], Costs(costs.values[rows], costs.by_x[rows], by))

    def weigh(self, weights: np.ndarray, x: np.ndarray, costs: Costs) -> None:
        """Measure by costs at states, with the time that each stands for."""
        values, slopes = np.abs(costs.values), np.abs(costs.by_x)
        self.weighed = True
        self.size += float(weights @ values)
        self.largest = max(self.largest, float(values.max(initial=0.0)))
        self.of_x = self.of_x + weights @ slopes
        sizes = np.abs(x)
        self.slack += float(np.sum((weights[:, None] * slopes) * (self.request.atol + self.request.rtol * sizes)))
        self.reach = np.maximum(self.reach, sizes.max(axis=0, initial=0.0))
        if costs.by is not None:
            more = weights @ np.abs(costs.by)
            self.of_others = more if self.of_others is None else self.of_others + more

    @property
    def tolerance(self) -> float:
        """Bound of the error of the integral in a step."""
        return (1.0 if self.cost.smooth else ROUGH) * (self.request.rtol * self.size + self.slack)

    def judge(self, h: np.ndarray, t: np.ndarray, x: np.ndarray, inputs: np.ndarray, costs: Costs,
              outer: float) -> tuple[np.ndarray, np.ndarray]:
        """Masks of the steps of lengths h (n,) that have to be taken again, shorter, and of the others that hold a jump, (n,) of
        bool each.

        t, x, inputs, costs   at all of their stages, rows
        outer                 length of the step that these are within, 0: none
        """
        values = costs.values.reshape(len(h), -1)
        estimate = partial(self._estimate, h)
        own = estimate(values[:, :, None])[:, 0] / max(self.tolerance, 1e-300)
        slopes = self._largest(costs, estimate)
        if self.cost.smooth and max(own.max(), slopes.max()) <= 1:
            none = np.zeros(len(h), dtype=bool)
            return none, none
        if ((slopes > 1) & (own <= 1)).any():
            slopes = np.where(slopes > self._noise(h, t, x, inputs, costs), slopes, 0.0)
        jumping = self._jumping(h, t, x, inputs, values, outer)
        slopes = np.where(jumping & (np.abs(h) > SHORT * abs(self.request.span[1] - self.request.span[0])), 2.0, slopes)
        bad = (own > 1) | (slopes > 1)
        begins = t.reshape(len(h), -1)[:, 0]
        stuck = bad & ((np.abs(h) < LEAST * np.spacing(np.abs(begins))) | (self.work <= 0))
        for k in np.flatnonzero(stuck):
            self._leave(begins[k], own[k], slopes[k])
        return bad & ~stuck, jumping & ~(bad & ~stuck)

    def _largest(self, costs: Costs, of: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """The worst derivative of each step, in what it may be off by; of: from rows at stages (n, stages, k) to (n, k)."""
        rtol, s = self.request.rtol, len(self.b)
        n = len(costs.values) // s
        part = rtol if self.cost.smooth else ROUGH * rtol
        reach = self.reach + (self.request.atol / rtol if rtol > 0 else 1.0)
        there = np.flatnonzero(self.of_x)
        allowed = part * (self.of_x + self.size / np.maximum(reach, 1e-300))
        rows = of(costs.by_x[:, there].reshape(n, s, len(there))) / np.maximum(allowed[there], 1e-300)
        if costs.by is not None and self.of_others is not None:
            there = np.flatnonzero(self.of_others)
            others = of(costs.by[:, there].reshape(n, s, len(there))) / np.maximum(part * self.of_others[there], 1e-300)
            rows = np.hstack([rows, others])
        return np.asarray(rows.max(axis=1, initial=0.0))

    def _estimate(self, h: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Errors of integrals over steps, (n, k), from values at the stages, (n, stages, k)."""
        first = np.abs(np.einsum("j,njk->nk", self.first, values))
        if self.second is not None:
            squares = first * first
            both = np.sqrt(squares + 0.01 * np.einsum("j,njk->nk", self.second, values) ** 2)
            first = squares / np.maximum(both, 1e-300)
        return np.asarray(np.abs(h)[:, None] * first)

    def _noise(self, h: np.ndarray, t: np.ndarray, x: np.ndarray, inputs: np.ndarray, costs: Costs) -> np.ndarray:
        """Noise that the tolerances of the state alone cause in the worst derivative of each step."""
        moved = self.request.atol + self.request.rtol * np.abs(x)
        whole = lambda rows: np.abs(h)[:, None] * np.einsum("j,njk->nk", np.abs(self.first), np.abs(rows))
        sides = []
        for way in (-1.0, 1.0):
            there = self.cost(t, x + way * moved, inputs)
            by = None if costs.by is None or there.by is None else there.by - costs.by
            sides.append(self._largest(Costs(there.values, there.by_x - costs.by_x, by), whole))
        return np.minimum(*sides)

    def _jumping(self, h: np.ndarray, t: np.ndarray, x: np.ndarray, inputs: np.ndarray, values: np.ndarray,
                 outer: float) -> np.ndarray:
        """Steps in which the integrand may jump."""
        result = np.zeros(len(h), dtype=bool)
        if self.cost.surfaces is not None:
            result |= self._crossed(t, x, inputs, len(h)).any(axis=1)
        if not self.cost.known and outer:
            result |= (np.abs(h) < INNER * abs(outer)) & (np.ptp(values, axis=1) > VARY * self.largest)
        return result

    def _crossed(self, t: np.ndarray, x: np.ndarray, inputs: np.ndarray, n: int) -> np.ndarray:
        """Mask of the surfaces that change their sign in each of n steps; a motion that begins on one does not cross it."""
        assert self.cost.surfaces is not None
        signs = self.cost.surfaces(t, x, inputs).values.reshape(n, len(t) // n, -1)
        above = signs > 0
        return np.asarray(above.any(axis=1) & ~above.all(axis=1) & (signs[:, 0] != 0))

    def across(self, t: np.ndarray, x: np.ndarray, inputs: np.ndarray, values: np.ndarray, slope: np.ndarray) -> np.ndarray:
        """Gain of the integral by x and the others, (n_x + n_by,), since a jump in a short step moves.

        t, x, inputs, values   at its stages; slope: of the state there
        """
        gained = values[0] - values[-1]
        crossed = np.zeros(0, dtype=int)
        if self.cost.surfaces is not None:
            crossed = np.flatnonzero(self._crossed(t, x, inputs, 1)[0])
        if len(crossed) == 1:
            result = self.cost.surfaces(t, x, inputs)  # type: ignore[misc]
            g, row = result.values[:, crossed[0]], result.slopes[0, crossed[0]]
            n_x = x.shape[1]
            rate, seen = float(row[0] + row[1:1 + n_x] @ slope), float((g[-1] - g[0]) / (t[-1] - t[0]))
            if abs(rate - seen) > VARY * abs(seen):  # inputs vary with the time, too
                rate = seen
            return np.asarray(-gained / rate * row[1:])
        if abs(gained) > VARY * self.largest and not self._by_time_alone(t, x, inputs, gained):
            self.jumps.append(f"{self.module.name}: the integrand of the loss jumps near t = {t[0]:.6g} s, and the gradient "
                              "lacks what moves the time of this jump; write it as an extra state, system.add_state(...), with "
                              "an event where it jumps, or as an expression in which each condition passes zero by itself")
        return np.zeros(0)

    def _by_time_alone(self, t: np.ndarray, x: np.ndarray, inputs: np.ndarray, gained: float) -> bool:
        """Whether a jump comes with the time whatever the state is."""
        late = self.cost(t[[0, -1]], x[[-1, 0]], inputs[[0, -1]]).values
        return bool(abs(late[0] - late[1] - gained) < VARY * abs(gained))

    def _leave(self, t: float, own: float, slope: float) -> None:
        """Note errors, in tolerances, that are left in a step."""
        if max(own, slope) > max(self.left, self.left_slope):
            self.at = t
        self.left, self.left_slope = self.left + own, max(self.left_slope, slope)

    def doubts(self) -> list[str]:
        """Warnings."""
        result = list(dict.fromkeys(self.jumps))
        if self.left > 1 or self.left_slope > 1:
            size = f"by as much as {self.left * self.tolerance:.3g}" if self.left > 1 else "in its derivatives"
            result.append(f"{self.module.name}: the integral of the loss may be off {size}: near t = {self.at:.6g} s its "
                          "integrand is not resolved by shorter steps, as at a pole; write it as an extra state, "
                          "system.add_state(...), with an event where it breaks, or leave that part of the motion out")
        return result


def _weights(method: str) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Weights of the stages of a step, those of the estimate, and of its second part; None without one."""
    tableau = method_of(method).tableau
    assert tableau is not None
    n = tableau.n_stages
    row = lambda given: np.array([given.get(k, 0.0) for k in range(n)])
    b = row(tableau.b)
    if tableau.second is not None:
        return b, row(tableau.e), row(tableau.second)
    # The embedded method has the slope at the end. Four of the stages that count give a rule for polynomials of degree 3.
    times = np.array([0.0, *[tableau.c.get(j, 1.0) for j in range(1, n)]])
    taken = np.flatnonzero(b)[[0, 2, 4, 5]]
    rule = np.zeros(n)
    rule[taken] = np.linalg.solve(np.vander(times[taken], increasing=True).T, 1 / np.arange(1.0, 5.0))
    return b, ORDER_4 * (b - rule), None
