"""Derivatives of what a switch of rigid contacts does to a motion.

A switch comes earlier by what its quantity is moved by over its rate, and changes of the state before it go through the
projections and impacts made there as through the reset of an event (saltation). The quantity, projections and impacts are
differentiated along given directions, with all decisions held: central differences of sixth order, whose error is known from
those of fourth order. So every law of impact has derivatives, and a state at which the decisions change has none.

Source: Hiskens and Pai, Trajectory sensitivity analysis of hybrid systems, 2000; Leine and Nijmeijer, Dynamics and Bifurcations
of Non-smooth Mechanical Systems, 2004, chapter 7.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symdyn.errors import EvaluationError

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Function of the time, the state, parameters and inputs.
Function = Callable[[float, np.ndarray, np.ndarray, Any], np.ndarray]
# Steps of differences, of the sizes of what they are of, and how exactly two orders have to agree.
STEPS, AGREE, ENOUGH = (1e-3, 1e-4, 1e-5), 1e-6, 1e-11
# The least size of coordinates, m.
SMALL = 1e-9
# Differences that rounding of values may make, by their size.
ROUNDING = 1e-14
# Weights of the values at one, two and three steps: of sixth and fourth order.
SIXTH, FOURTH = np.array([45.0, -9.0, 1.0]) / 60, np.array([8.0, -1.0, 0.0]) / 12
# Events at once whose times move by amounts that differ by more than this part, and this one of the time since the switch before,
# have no common derivative.
TOGETHER, NOISE = 1e-6, 1e-9
# A rate that the curvature of the quantity outweighs within this part of the time since the switch before grazes zero.
# The step of differences for that, of this time.
GRAZES, NEARBY = 1e-6, 1e-4
# Order of the events of a contact that set the time where several happen at once.
FIRST = ("closes", "opens", "sticks", "slips", "turns")


class Moves(NamedTuple):
    """Changes, k of them: of the time (k,), the state (k, n_x), parameters (k, n_p) and inputs (k, n_in); sizes of
    what they are by, (k,): a change counts as what one of these makes."""

    t: np.ndarray
    x: np.ndarray
    p: np.ndarray
    inputs: np.ndarray
    sizes: np.ndarray


class Shifted:
    """Inputs with a shift."""

    def __init__(self, inputs: Any, shift: np.ndarray) -> None:
        self.inputs, self.shift = inputs, shift

    def at(self, t: float, x: np.ndarray) -> np.ndarray:
        """The inputs at a time, (n_in,)."""
        result: np.ndarray = np.asarray(self.inputs.at(t, x)) + self.shift
        return result


@dataclass(frozen=True)
class Switch:
    """A switch of contacts: when, the states (n_x,) and the parameters, which hold the modes, before and after it.

    events   indices of the module's events that set its time, with what messages call them; none: its time is given
    made     the state that it makes of another one, at a time, with parameters and inputs, and what is decided on the way; None:
             the state stays as it is, and only what directions are counted from changes
    since    the time since the switch before, s; inputs: over time
    stuck    whether it ends the slips of all contacts: the velocity is continuous, and what friction made of changes along slips
             is undone, so that the state after it does not depend on when that happened
    zero     where slips in space are put along directions: when they are zero, at their begin or end, s
    """

    module: Module
    t: float
    before: np.ndarray
    after: np.ndarray
    p_before: np.ndarray
    p_after: np.ndarray
    events: tuple[tuple[int, str], ...]
    made: Callable[[float, np.ndarray, np.ndarray, Any], tuple[np.ndarray, Any]] | None
    since: float
    inputs: Any
    zero: float | None = None
    stuck: bool = False

    def moves(self, x: np.ndarray, by: Sequence[str]) -> Moves:
        """Changes (k, n_x) of the state before it, each with one of the parameter or input that it is by, "" of none."""
        known = self.module.metadata
        of_p, of_inputs = (np.array([[float(a == name) for a in names] for name in by]).reshape(len(by), len(names))
                           for names in (known.parameters, known.inputs))
        values = np.hstack([self.p_before, self.inputs.at(self.t, self.before)])
        sizes = np.hstack([of_p, of_inputs]) @ np.abs(values)
        return Moves(np.zeros(len(by)), x, of_p, of_inputs, np.where(sizes == 0, 1.0, sizes))

    def along(self, moves: Moves) -> tuple[np.ndarray, np.ndarray]:
        """Change of the time of the switch, (k,), and of the state after it at a given time, (k, n_x), with changes before it at
        a given time. Raises EvaluationError where they have no derivative.
        """
        if self.made is None:
            return np.zeros(len(moves.x)), moves.x.copy()
        slope, slope_after = (self._rhs(x, p) for x, p in ((self.before, self.p_before), (self.after, self.p_after)))
        later = self._later(moves, slope) if self.events else np.zeros(len(moves.x))
        moved = moves._replace(t=later, x=moves.x + np.outer(later, slope))
        return later, self._differences(self._state(), moved, "the state after it") - np.outer(later, slope_after)

    def _rhs(self, x: np.ndarray, p: np.ndarray) -> np.ndarray:
        result: np.ndarray = self.module.evaluate("rhs", self.t, x, p, self.inputs.at(self.t, x))
        return result

    def _later(self, moves: Moves, slope: np.ndarray) -> np.ndarray:
        """Delay of the switch."""
        along = Moves(np.ones(1), slope[None, :], 0 * moves.p[:1], 0 * moves.inputs[:1], np.ones(1))
        rates = self._differences(self._quantities, along, "its time")[0]
        moved = self._differences(self._quantities, moves, "its time")
        for (_, name), rate, bent in zip(self.events, rates, self._bent(slope), strict=True):
            if abs(rate) <= bent:
                raise EvaluationError(f"{name} at t = {self.t:.9g} s grazes: its quantity has no rate, so that its time has no "
                                      "derivative; change the start or parameters, or leave sensitivities out")
        if self.stuck:
            return np.zeros(len(moved))
        later: np.ndarray = -moved / rates
        names, first = [name for _, name in self.events], later[:, 0]
        apart = np.abs(later - later[:, :1]).max(axis=1) > TOGETHER * np.abs(later).max(axis=1) + NOISE * self.since / moves.sizes
        if apart.any():
            raise EvaluationError(f"{', '.join(names)} happen at once at t = {self.t:.9g} s, and changes move their times apart: "
                                  "the motion has no derivative there; change the start or parameters, or leave sensitivities "
                                  "out")
        return first

    def _bent(self, slope: np.ndarray) -> np.ndarray:
        """Changes of the rates of the quantities within a short time, by second differences along the motion."""
        h, sides = NEARBY * self.since, []
        for step in (-h, 0.0, h):  # the midpoint rule
            middle = self.module.evaluate("rhs", self.t + step / 2, self.before + step / 2 * slope, self.p_before,
                                          self.inputs.at(self.t + step / 2, self.before + step / 2 * slope))
            sides.append(self._quantities(self.t + step, self.before + step * middle, self.p_before, self.inputs))
        result: np.ndarray = np.abs(sides[0] - 2 * sides[1] + sides[2]) / h**2 * GRAZES * self.since
        return result

    def _quantities(self, t: float, x: np.ndarray, p: np.ndarray, inputs: Any) -> np.ndarray:
        values: np.ndarray = self.module.evaluate("events", t, x, p, inputs.at(t, x))
        return values[[k for k, _ in self.events]]

    def _state(self) -> Function:
        """The state after it, as long as the same is decided."""
        made = self.made
        assert made is not None
        decided = made(self.t, self.before, self.p_before, self.inputs)[1]

        def state(t: float, x: np.ndarray, p: np.ndarray, inputs: Any) -> np.ndarray:
            result, other = made(t, x, p, inputs)
            return result if other == decided else np.full_like(result, np.nan)
        return state

    def _differences(self, function: Function, moves: Moves, what: str) -> np.ndarray:
        """Derivatives of a function along directions, (k, n)."""
        return np.array([self._difference(function, Moves(*[part[j] for part in moves]), what) for j in range(len(moves.t))])

    def _difference(self, function: Function, one: Moves, what: str) -> np.ndarray:
        scale = self._scale(one)
        if scale == 0:
            return np.zeros(len(function(self.t, self.before, self.p_before, self.inputs)))
        best, left, size = np.zeros(0), np.inf, float(np.abs(self.before).max(initial=0.0))
        for step in STEPS:
            h = step / scale
            sides = np.array([function(self.t + k * h * float(one.t), self.before + k * h * one.x, self.p_before + k * h * one.p,
                                       Shifted(self.inputs, k * h * one.inputs)) for k in (1, 2, 3, -1, -2, -3)])
            differences = sides[:3] - sides[3:]
            sixth, fourth = SIXTH @ differences / h, FOURTH @ differences / h
            moved = 3 * h * float(np.abs(one.x).max(initial=0.0))
            noise = ROUNDING * max(float(np.abs(sides).max(initial=0.0)), size, moved) / h
            apart = (float(np.abs(sixth - fourth).max(initial=0.0)) - noise) / max(float(np.abs(sixth).max(initial=0.0)), 1e-300)
            if not apart >= left:
                best, left = sixth, apart
            if left <= ENOUGH:
                break
        if not left <= AGREE:
            names = ", ".join(name for _, name in self.events) or "contacts that are closed at the start"
            raise EvaluationError(f"{names} at t = {self.t:.9g} s: {what} has no derivative there, since what happens changes "
                                  "with small changes of the state; change the start or parameters, or leave sensitivities out")
        return best

    def _scale(self, one: Moves) -> float:
        """Size of a change, relative to the quantities that it changes."""
        n_q = self.module.metadata.sizes.q
        of_q = max(float(np.abs(self.before[:n_q]).max(initial=0.0)), SMALL)
        of_rest = max(float(np.abs(self.before[n_q:]).max(initial=0.0)), of_q / self.since)
        parts = [np.abs(one.x[:n_q]) / of_q, np.abs(one.x[n_q:]) / of_rest, np.abs(np.atleast_1d(one.t)) / self.since]
        for change, values in ((one.p, self.p_before), (one.inputs, np.asarray(self.inputs.at(self.t, self.before)))):
            parts.append(np.abs(change) / np.where(values == 0, 1.0, np.abs(values)))
        return max(float(part.max(initial=0.0)) for part in parts)
