"""The way back across events and instants of controllers: the motion in pieces, and what carries weights from piece to piece.

A first run finds when events happen and what controllers hold. The motion is then integrated once more, piece by piece. No stage
of a step may lie beyond an event at which the right-hand side jumps, so that the last stretch before an event, and the first one
after it, are bridged by a step of the two-stage Gauss method, whose stages lie within; the time of the event is the one at which
the quantity vanishes along this very motion. An event comes later by what moves its quantity over its rate, and the weights jump
by the transpose of the saltation matrix. Source: Hiskens and Pai, Trajectory sensitivity analysis of hybrid systems, 2000;
Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.7 (Gauss's methods).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from symdyn.errors import EvaluationError, SimulationWarning
from symdyn.runtime.inputs.inputs import Inputs
from symdyn.runtime.integrating.at_breaks import Breaks
from symdyn.runtime.integrating.events import Happened, entangled
from symdyn.runtime.integrating.grazing import JUMPS, grazing, without_rate
from symdyn.runtime.integrating.jumps import Field, Jump, Several
from symdyn.runtime.integrating.outcome import Outcome, Request
from symdyn.runtime.integrating.quadrature import Integral
from symdyn.runtime.integrating.way_back import Way

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# The two-stage Gauss method, of order 4.
_ROOT = 3**0.5 / 6
A = np.array([[0.25, 0.25 - _ROOT], [0.25 + _ROOT, 0.25]])
C = np.array([0.5 - _ROOT, 0.5 + _ROOT])
# Length of a bridge: of the latest step, and of the time to the event before; how often it is made longer to find the event.
SHORT, MOST, TRIES = 1e-2, 0.2, 8
# Iterations for the stages of a bridge, and for the time of an event; changes below which they end, relative.
ITERATIONS, ENOUGH = 60, 4e-16
# Steps to one side of an event at which the slope there is evaluated, of a bridge.
NEARBY = 1e-3
# Relative change that iterations may end with.
LEFT = 1e-12


class Moment(NamedTuple):
    """A cut: when, the events that happen there, whether controllers are sampled or what they hold changes."""

    t: float
    events: tuple[int, ...]
    instant: bool


def moments(module: Module, outcome: Outcome, request: Request) -> list[Moment]:
    """Where the motion is cut, in order: events that have an effect, and instants. Raises EvaluationError where both are one."""
    record, direction = outcome.record, 1.0 if request.span[1] >= request.span[0] else -1.0
    result: dict[float, list[int]] = {}
    for one in outcome.happened:
        result.setdefault(one.t, []).append(one.event)
    cuts = [Moment(t, tuple(events), False) for t, events in result.items() if _matter(module, request, outcome, t, events)]
    instants = record.times[record.times > request.span[0]].tolist() if record is not None else []
    close = 1e-9 * abs(request.span[1] - request.span[0])
    for cut in cuts:
        near = [t for t in instants if abs(t - cut.t) <= close]
        if near:
            raise EvaluationError(f"{module.name}: the event {module.metadata.events[cut.events[0]].name} happens at t = "
                                  f"{cut.t:.9g} s, at an instant of a controller; a gradient does not go across both at once")
    return sorted([*cuts, *[Moment(t, (), True) for t in instants]], key=lambda cut: direction * cut.t)


def _matter(module: Module, request: Request, outcome: Outcome, t: float, events: Sequence[int]) -> bool:
    """Whether anything changes at events: a reset, an end, a jump of the right-hand side."""
    records = module.metadata.events
    if any(records[k].reset or records[k].stop for k in events):
        return True
    x = next(one.before for one in outcome.happened if one.t == t)[:request.n_state]
    inputs = request.inputs if outcome.record is None else request.inputs.recorded(outcome.record)
    field = Field(module, replace(request, inputs=inputs))
    length = SHORT * MOST * _spacing(outcome, t, request)
    before, after = field.one_sided(t, x, -length), field.one_sided(t, x, length)
    return bool((np.abs(after - before) > JUMPS * (np.abs(after) + np.abs(before))).any())


def _spacing(outcome: Outcome, t: float, request: Request) -> float:
    """The length of the step before an event, with sign."""
    direction = 1.0 if request.span[1] >= request.span[0] else -1.0
    before = outcome.t[direction * outcome.t < direction * t]
    steps = np.diff(np.append(before[-3:], t)) if len(before) else np.array([t - request.span[0]])
    return float(steps[np.argmax(np.abs(steps))])


@dataclass
class Bridge:
    """A step of the two-stage Gauss method; stages (2, n_x)."""

    way: Way
    t: float
    x: np.ndarray
    length: float
    stages: np.ndarray
    end: np.ndarray

    @classmethod
    def over(cls, way: Way, t: float, x: np.ndarray, length: float, side: float = 0.0) -> Bridge:
        """From a state; side: a step that leads to the side of the state where it goes on, 0: it is there already."""
        field = Field(way.module, way.request)
        slopes = np.tile(field.one_sided(t, x, side) if side else field(t, x), (2, 1))
        for _ in range(ITERATIONS):
            stages = x + length * (A @ slopes)
            then = np.array([field(t + c * length, y) for c, y in zip(C, stages, strict=True)])
            change, slopes = np.abs(then - slopes).max(), then
            if change <= ENOUGH * np.abs(then).max():
                break
        _converged(way.module, t, change, slopes)
        return cls(way, t, x, length, x + length * (A @ slopes), x + length * slopes.mean(axis=0))

    def back(self, integral: Integral | None, weights: np.ndarray) -> float:
        """Carry weights of the end to the start, in place; its part of the integral."""
        n_x, way, half = len(self.x), self.way, self.length / 2
        times = self.t + C * self.length
        costs = None if integral is None else integral(times, self.stages, way.request.inputs.rows(times, self.stages))
        of_x, of_others = np.zeros((2, n_x)), np.zeros((2, len(weights) - n_x))
        if costs is not None:
            whole = np.hstack([costs.by_x, of_others if costs.by is None else costs.by])
            for t, y, row in zip(times, self.stages, whole, strict=True):
                way.feedback.fold(t, y, row)
            of_x, of_others = whole[:, :n_x], whole[:, n_x:]
        gained = np.zeros((2, n_x))
        rows = np.zeros((2, len(weights)))
        for _ in range(ITERATIONS):
            along = self.length * (weights[:n_x] / 2 + A.T @ gained)
            rows = np.array([way.weights("rhs_weights", t, y, a) for t, y, a in zip(times, self.stages, along, strict=True)])
            then = rows[:, :n_x] + half * of_x
            change, gained = np.abs(then - gained).max(), then
            if change <= ENOUGH * np.abs(then).max():
                break
        _converged(way.module, self.t, change, gained)
        weights[:n_x] += gained.sum(axis=0)
        weights[n_x:] += rows[:, n_x:].sum(axis=0)
        weights[n_x:] += half * of_others.sum(axis=0)
        return 0.0 if costs is None else half * float(costs.values.sum())


def _converged(module: Module, t: float, change: float, values: np.ndarray) -> None:
    """Raises EvaluationError where an iteration has not come to an end."""
    if not change <= LEFT * np.abs(values).max():
        raise EvaluationError(f"{module.name}: the step up to an event near t = {t:.9g} s is not computed, since the motion is "
                              "stiff or irregular there; take simulate(..., sensitivities=[...])")


@dataclass
class Instant:
    """Controllers are sampled, or what they hold changes: gradients of those that are sampled here, by index; indices of inputs
    that take another value, with the number of the instant at which it was sampled."""

    number: int
    sampled: dict[int, np.ndarray]
    fresh: dict[int, int]


class Chain:
    """A motion in pieces, forth and back; room: bytes up to which steps are kept."""

    def __init__(self, module: Module, request: Request, method: str, carried: Sequence[str], outcome: Outcome,
                 room: float, breaks: Breaks | None = None) -> None:
        self.breaks = breaks
        self.module, self.method, self.outcome, self.room = module, method, outcome, room
        self.request = replace(request, look=None)
        self.cuts = moments(module, outcome, request)
        self.record = outcome.record
        held = [] if self.record is None else [module.metadata.inputs[k] for k in self.record.indices]
        self.carried = tuple(dict.fromkeys([*carried, *held]))
        self.direction = 1.0 if request.span[1] >= request.span[0] else -1.0
        self.pieces: list[Way | Bridge | Jump | Instant] = []
        self.n_steps, self.memory = outcome.n_steps, outcome.t.nbytes + outcome.x.nbytes
        self.end = (request.span[0], request.x0)
        self.way: Way | None = None

    def forth(self, integral: Integral | None = None) -> tuple[float, np.ndarray]:
        """To the end: the time and the state there; integral: what is measured along the first run."""
        t, x = self.end
        if integral is not None:
            first, inputs = self.outcome, self.request.inputs.recorded(self.record)
            integral.over_rows(first.t, first.x, inputs.rows(first.t, first.x))
        if self.record is not None:
            self.pieces.append(self._instant(t, x, 0))
        for number, cut in enumerate(self.cuts):
            if cut.instant:
                t, x = self._through(t, x, cut.t)
                self.pieces.append(self._instant(t, x, number + 1))
                continue
            t, x, over = self._event(t, x, cut, number)
            if over:
                self.end = t, x
                return self.end
        self.end = self._through(t, x, self.request.span[1])
        return self.end

    def back(self, integral: Integral | None, weights: np.ndarray, by_time: Callable[[], float]) -> float:
        """Carry weights of the end to the start, in place; the integral. by_time: what the loss at the end gains by time."""
        value, waiting = 0.0, dict[tuple[int, int], float]()
        n_x = len(self.request.x0)
        for piece in reversed(self.pieces):
            if isinstance(piece, Instant):
                for index, sampled in piece.fresh.items():
                    at = n_x + self.carried.index(self.module.metadata.inputs[index])
                    waiting[sampled, index] = waiting.get((sampled, index), 0.0) + weights[at]
                    weights[at] = 0.0
                for index, row in piece.sampled.items():
                    weights[:n_x] += waiting.pop((piece.number, index), 0.0) * row
            elif isinstance(piece, Jump) and piece.after is None:
                value += piece.back(integral, weights, by_time())
            else:
                value += piece.back(integral, weights)
        return value

    def _piece(self, t: float, x: np.ndarray, until: float) -> Way:
        first = self.request.first_step if not self.pieces else 0.0
        request = replace(self.request, span=(t, until), x0=x, first_step=first, inputs=self._inputs(t))
        return Way(self.module, request, self.method, self.carried, self.room, self.breaks)

    def _inputs(self, t: float) -> Inputs:
        """The inputs from a time on to the next cut."""
        if self.record is None:
            return self.request.inputs
        return self.request.inputs.held(self.record.rows(t + 1e-9 * (self.request.span[1] - self.request.span[0])))

    def _through(self, t: float, x: np.ndarray, until: float) -> tuple[float, np.ndarray]:
        if self.direction * (until - t) <= 0:
            return t, x
        way = self.way = self._piece(t, x, until)
        end = way.forth()
        self._keep(way)
        return end

    def _keep(self, way: Way) -> None:
        self.pieces.append(way)
        self.memory += way.memory
        self.room = max(0.0, self.room - sum(kept.bytes for kept in way.steps.values()))

    def _event(self, t: float, x: np.ndarray, cut: Moment, number: int) -> tuple[float, np.ndarray, bool]:
        """Across an event: the time and the state after it, and whether it ends the motion."""
        records = self.module.metadata.events
        first = next((k for k in cut.events if records[k].reset), cut.events[-1])
        gap = cut.t - t
        length = SHORT * _spacing(self.outcome, cut.t, self.request)
        length = length if abs(length) < MOST * abs(gap) else MOST * gap
        for _ in range(TRIES):
            way = self._piece(t, x, cut.t - length)
            at, there = way.forth()
            bridge = self._to_event(way, at, there, length, first)
            if bridge is not None and 0.2 < bridge.length / length < 5:
                break
            length = min(4 * length, 0.9 * gap, key=abs)
        else:
            raise EvaluationError(f"{self.module.name}: the event {records[first].name} at t = {cut.t:.9g} s is not found again "
                                  "when "
                                  "the motion is cut there; take a finer rtol, or simulate(..., sensitivities=[...])")
        self._keep(way)
        self.pieces.append(bridge)
        t, x = at + bridge.length, bridge.end
        field = Field(self.module, way.request)
        jump = Jump(way, t, x, field.one_sided(t, x, -NEARBY * bridge.length), cut.events, first, NEARBY * bridge.length)
        self._demand_rates(jump, (first,))
        self.pieces.append(jump)
        if any(records[k].stop for k in cut.events):
            return t, x, True
        later = self.cuts[number + 1].t if number + 1 < len(self.cuts) else self.request.span[1]
        after = jump.go_on(x.copy())
        length = min(bridge.length, MOST * (later - t), key=abs)
        jump.after, jump.slope_after = after, field.one_sided(t, after, NEARBY * length)
        if len(cut.events) > 1:
            self._several(jump, NEARBY * (length or bridge.length))
        if not length:
            return t, after, False
        bridge = Bridge.over(way, t, after, length, NEARBY * length)
        self.pieces.append(bridge)
        return t + length, bridge.end, False

    def _demand_rates(self, jump: Jump, events: tuple[int, ...]) -> None:
        """Raises EvaluationError where one of the events grazes."""
        n, size = len(events), np.maximum(np.abs(self.outcome.x).max(axis=0), np.abs(jump.x))
        graze = grazing(self.module, jump.way.request, np.full(n, jump.t), np.tile(jump.x, (n, 1)), np.array(events), size)
        if graze.any():
            raise EvaluationError(without_rate(self.module, events[int(graze.argmax())], jump.t))

    def _several(self, jump: Jump, side: float) -> None:
        """Take the latest piece, of several events at one time, for those of each of them."""
        several = Several(jump, side)
        self._demand_rates(jump, several.events or (jump.first,))
        jumps = several.in_turn()
        if jumps:
            self.pieces[-1:] = jumps
            return
        records = self.module.metadata.events
        jump.events = several.events or jump.events
        jump.first = next((k for k in jump.events if records[k].reset), jump.events[-1])
        if jumps is None:
            happened = [Happened(k, jump.t, jump.x, jump.x) for k in jump.events]
            warnings.warn(entangled(self.module, happened, [jump.t]), SimulationWarning, stacklevel=6)

    def _to_event(self, way: Way, t: float, x: np.ndarray, length: float, first: int) -> Bridge | None:
        """The bridge to where the quantity of an event vanishes, by the secant method; None if it is not found."""
        field = Field(self.module, way.request)

        def tried(length: float) -> tuple[Bridge, float]:
            bridge = Bridge.over(way, t, x, length)
            at, inputs = t + length, field.inputs(t + length, bridge.end)
            return bridge, float(self.module.evaluate("events", at, bridge.end, way.request.p, inputs)[first])

        old, (_, value_old) = 0.5 * length, tried(0.5 * length)
        bridge, value = tried(length)
        for _ in range(ITERATIONS):
            if value == 0 or bridge.length == old or value == value_old:
                return bridge
            then = bridge.length - value * (bridge.length - old) / (value - value_old)
            if not 0 < then / length < 10:
                return None
            if abs(then - bridge.length) <= ENOUGH * max(abs(t), abs(then)):
                return bridge
            old, value_old = bridge.length, value
            bridge, value = tried(then)
        return bridge

    def _instant(self, t: float, x: np.ndarray, number: int) -> Instant:
        """Events at an instant."""
        assert self.record is not None
        near = 1e-9 * abs(self.request.span[1] - self.request.span[0])
        times = [self.request.span[0], *[cut.t for cut in self.cuts]]
        row = int(np.argmin(np.abs(self.record.times - t)))
        sampled: dict[int, np.ndarray] = {}
        fresh: dict[int, int] = {}
        for sampler in self.request.inputs.samplers:
            of, begin = sampler.sampled, self.request.span[0]
            k = round((t - begin - of.offset) / of.period)
            if k >= 0 and abs(begin + of.offset + k * of.period - t) <= near:
                slopes = sampler.columns(t, x, np.eye(len(x)))
                sampled |= dict(zip(sampler.indices, slopes, strict=True))
            for index in sampler.indices:
                if self.record.fresh[row, index]:
                    fresh[index] = int(np.argmin(np.abs(np.array(times) - (t - of.delay))))
        return Instant(number, sampled, fresh)
