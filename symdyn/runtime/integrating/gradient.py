"""The gradient of a loss of a motion, backwards: the discrete adjoint of the steps that were taken.

The motion is integrated once, and what it goes on from is kept at checkpoints. Then stretch by stretch, the last one first, the
weights of the state at the end of each step are carried back to its start. The steps of the first stretches are kept, up to a
given memory; all others are taken again, to the same bits. There are as many checkpoints as a stretch has steps, so that memory
grows with the square root of their number (Griewank and Walther, Evaluating Derivatives, 2nd ed., chapter 12).
"""

from __future__ import annotations

import ctypes
import time as clock
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.methods import method_of
from symdyn.backend.right_side import RightSide
from symdyn.errors import ArgumentError, EvaluationError
from symdyn.runtime.consistent import check_start
from symdyn.runtime.inputs.inputs import take_inputs
from symdyn.runtime.integrating.compiled import Run, stopped_because
from symdyn.runtime.integrating.events import wanted
from symdyn.runtime.integrating.methods import DEFAULT, check_compiled
from symdyn.runtime.integrating.outcome import Request
from symdyn.runtime.integrating.run_record import STATUS
from symdyn.runtime.integrating.sensitivities import Asked
from symdyn.runtime.integrating.simulate import (
    checked_positive,
    checked_times,
    checked_tolerances,
    stabilization_of,
    start_of,
)
from symdyn.runtime.losses import Cost, Loss, cost_of
from symdyn.runtime.masses import real_parameters
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Steps that are tried in a stretch at first; doubled as often as there are more checkpoints than that.
STRETCH = 128
# Bytes up to which steps are kept.
KEPT = 2**22
METHODS = (DEFAULT, "bs54")


class Gradient(Mapping[Any, float]):
    """Derivatives of a loss by name: what they are by -> number.

    value       of the loss; array: the derivatives in the order of `names`, (n,)
    t, x        end of the motion and the state there (n_x,)
    n_steps     of the motion; memory: most bytes that were kept at a time, checkpoints and steps; seconds: of the call
    """

    def __init__(self, owner: str, names: Sequence[str], value: float, array: np.ndarray, end: tuple[float, np.ndarray],
                 n_steps: int, memory: int, seconds: float) -> None:
        self.names, self.value, self.array = tuple(names), value, array
        self.t, self.x = end
        self.n_steps, self.memory, self.seconds = n_steps, memory, seconds
        self._owner = owner

    def __getitem__(self, name: Any) -> float:
        """The derivative by a parameter, an input or an initial value, by name or symbol. Raises ArgumentError for another."""
        asked = name_of(name)
        if asked not in self.names:
            raise ArgumentError(f"{self._owner}: the gradient has no {shown(asked)}; it is by {', '.join(self.names)}")
        return float(self.array[self.names.index(asked)])

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)

    def __contains__(self, name: object) -> bool:
        return name_of(name) in self.names

    def __repr__(self) -> str:
        return f"<Gradient of a loss of {self.value:.9g} by {len(self.names)} numbers, {self.n_steps} steps>"


def gradient(module: Module, loss: Any, by: Any, t: Any = None, q: Any = None, u: Any = None, params: Any = None, *,
             z: Any = None, inputs: Any = None, rtol: float = 1e-8, atol: Any = None, method: Any = None, max_step: float = 0.0,
             first_step: float = 0.0, stabilization: Any = None, events: Any = True, interpolation: str = "linear",
             extend: str = "error") -> Gradient:
    """See Module.gradient."""
    begun = clock.perf_counter()
    metadata = module.metadata
    if not isinstance(loss, Loss):
        raise ArgumentError(f"{module.name}: the loss is {shown(loss)}; pass sd.Loss(integral=..., end=...)")
    p, start = real_parameters(module, params), start_of(module, q, u, z)
    _, span, _ = checked_times(module, t, False)
    free = take_inputs(inputs, metadata.inputs, metadata.initial, module.name, span, interpolation, extend, metadata.motions)
    module = module.following(free)
    request = Request(span, None, start, p, free, *checked_tolerances(module, rtol, atol),
                      checked_positive(module, max_step, "max_step"), checked_positive(module, first_step, "first_step"),
                      None, len(start), look=wanted(module, events))
    asked = Asked.of(module, by, p, free)
    method = _checked(module, request, asked, method or DEFAULT)
    check_start(module, span[0], start, p)
    request = replace(request, stabilization=stabilization_of(module, request, method, stabilization))
    asked.check(module, request, method, False)
    carried = tuple(dict.fromkeys(name for name in asked.columns if name))
    costs = [None if given is None else cost_of(module, what, given, carried, p)
             for what, given in (("the integral", loss.integral), ("the end", loss.end))]
    way = _Way(module, request, method, carried)
    weights, value = way.through(*costs)
    return Gradient(module.name, asked.names, value, _chosen(asked, carried, weights), way.end, way.n_steps, way.memory,
                    clock.perf_counter() - begun)


def _checked(module: Module, request: Request, asked: Asked, method: Any) -> str:
    if not isinstance(method, str) or method not in METHODS:
        raise ArgumentError(f"{module.name}: a gradient was asked for with method {shown(method)}; the way back is there for "
                            f"{' and '.join(METHODS)}")
    if not asked.names:
        raise ArgumentError(f"{module.name}: a gradient by nothing was asked for; name parameters, inputs or initial values")
    if request.inputs.are_held:
        raise ArgumentError(f"{module.name}: a gradient was asked for, but the way back does not go across the instants of "
                            "sampled controllers; take simulate(..., sensitivities=[...]), which does")
    check_compiled(module, request, method)
    if request.look is not None and request.look.any():
        names = [e.name for e, look in zip(module.metadata.events, request.look, strict=True) if look]
        raise ArgumentError(f"{module.name}: a gradient was asked for, but the way back does not go across the events "
                            f"{', '.join(names)}; pass events=False, or take simulate(..., sensitivities=[...]), which does")
    return method


def _chosen(asked: Asked, carried: Sequence[str], weights: np.ndarray) -> np.ndarray:
    n_x = asked.starts.shape[1]
    return np.array([weights[n_x + carried.index(name)] if name else start @ weights[:n_x]
                     for name, start in zip(asked.columns, asked.starts, strict=True)])


@dataclass
class _Steps:
    """Steps of a stretch, the states between them, the slopes of their stages; how many there are."""

    t: np.ndarray
    h: np.ndarray
    x: np.ndarray
    slopes: np.ndarray
    n: int = 0

    @classmethod
    def room(cls, n: int, n_x: int, stages: int) -> _Steps:
        return cls(np.empty(n), np.empty(n), np.empty((n + 1, n_x)), np.empty((n, stages, n_x)))

    @property
    def bytes(self) -> int:
        return sum(a.nbytes for a in (self.t, self.h, self.x, self.slopes))


class _Way:
    """A run forth and back."""

    def __init__(self, module: Module, request: Request, method: str, carried: Sequence[str]) -> None:
        self.module, self.request = module, request
        unit: Any = module.unit(RightSide(method=method, adjoint=tuple(carried)))
        self.unit, self.run = unit, Run(unit, request)
        tableau = method_of(method).tableau
        assert tableau is not None
        self.stages = s = tableau.n_stages
        self.A, self.b, self.c = np.zeros((s, s)), np.zeros(s), np.zeros(s)
        for j in range(1, s):
            self.c[j] = tableau.c.get(j, 1.0)
            for k, factor in tableau.a[j].items():
                self.A[j, k] = factor
        for k, factor in tableau.b.items():
            self.b[k] = factor
        self.n_x, self.width = len(request.x0), len(request.x0) + len(carried)
        self.stretch, self.kept = STRETCH, [self.run.checkpoint()]
        self.steps: dict[int, _Steps] = {}  # by the place of their stretch
        self.n_steps, self.memory = 0, 0
        self.end: tuple[float, np.ndarray] = (request.span[0], request.x0)
        self._costs: tuple[float, int] = (0.0, 0)

    def through(self, integral: Cost | None, end: Cost | None) -> tuple[np.ndarray, float]:
        """Weights of the start and of what is carried along, (n_x + n_carried,), and the loss."""
        steps = self._forth()
        times, states = np.empty((self.stretch, self.stages)), np.empty((self.stretch, self.stages, self.n_x))
        weights, value = np.zeros(self.width), 0.0
        if end is not None:
            t, x = self.end
            at = end(np.array([t]), x[None, :], self._inputs(np.array([t]), x[None, :]))
            weights[:self.n_x] = at.by_x[0]
            if at.by is not None:
                weights[self.n_x:] = at.by[0]
            value = float(at.values[0])
        for k in reversed(range(len(self.kept))):
            if k not in self.steps:
                self.run.restore(self.kept[k])
                self._record(steps)
            value += self._back(self.steps.get(k, steps), times, states, integral, weights)
        if self.request.stabilization.way == "projection" and "corrected_weights" in self.unit.metadata.shapes:
            # The start is put onto the constraints, too.
            begin = self.request.span[0]
            evaluator = self.unit.evaluator("corrected_weights")
            evaluator.set_params(self.request.p)
            inputs = self._inputs(np.array([begin]), self.start[None, :])[0]
            row = evaluator.one(begin, self.start, inputs if len(inputs) else None, weights[:self.n_x].copy())
            weights[:self.n_x] = row[:self.n_x]
            weights[self.n_x:] += row[self.n_x:]
        if not np.isfinite(value):
            raise EvaluationError(f"{self.module.name}: the loss is {value:g}")
        return weights, value

    def _forth(self) -> _Steps:
        """To the end, with checkpoints; room for the steps of a stretch."""
        run, status = self.run, STATUS.STEP_LIMIT if self.run.status == STATUS.DONE else self.run.status  # the start went well
        self.start = run.report().x.copy()
        steps = _Steps.room(self.stretch, self.n_x, self.stages)
        while status == STATUS.STEP_LIMIT:
            status = self._record(steps)
            self.n_steps += steps.n
            if sum(kept.bytes for kept in self.steps.values()) + steps.bytes <= KEPT or status != STATUS.STEP_LIMIT:
                self.steps[len(self.kept) - 1] = steps
                steps = _Steps.room(self.stretch, self.n_x, self.stages)
            if status != STATUS.STEP_LIMIT:
                break
            self.kept.append(run.checkpoint())
            if len(self.kept) > self.stretch and len(self.kept) % 2:  # the latest begins a longer stretch
                self.kept, self.stretch, self.steps = self.kept[::2], 2 * self.stretch, {}
                steps = _Steps.room(self.stretch, self.n_x, self.stages)
            self._note(steps)
        self._note(steps)
        report = run.report()
        if run.trouble:
            raise run.trouble[0]
        if status != STATUS.DONE:
            raise EvaluationError(stopped_because(self.module, run, status, report))
        self.end = report.of.t, report.x
        return steps

    def _record(self, steps: _Steps) -> int:
        """Try as many steps as a stretch has, and keep those that are accepted; the status."""
        written = ctypes.c_long(0)
        with self.run.guard:
            status = self.unit.function("simulation_record")(
                self.run.address, ctypes.c_long(self.stretch), ctypes.c_long(len(steps.t)),
                *[ctypes.c_void_p(a.ctypes.data) for a in (steps.t, steps.h, steps.x, steps.slopes)], ctypes.byref(written))
        steps.n = written.value
        return int(status)

    def _back(self, steps: _Steps, times: np.ndarray, states: np.ndarray, integral: Cost | None, weights: np.ndarray) -> float:
        """Carry the weights back over the steps of a stretch; its part of the integral. times, states: room for the stages."""
        n = steps.n
        pointers = lambda *arrays: [ctypes.c_void_p(None if a is None else a.ctypes.data) for a in arrays]
        self.unit.function("simulation_stages")(
            ctypes.c_long(n), *pointers(self.A, self.c, steps.t, steps.h, steps.x, steps.slopes, times, states))
        of_x, of_others, value = None, None, 0.0
        if integral is not None and n:
            at, rows = times[:n].ravel(), states[:n].reshape(-1, self.n_x)
            costs = integral(at, rows, self._inputs(at, rows))
            value = float(steps.h[:n] @ costs.values.reshape(n, self.stages) @ self.b)
            of_x = np.ascontiguousarray(costs.by_x)
            of_others = None if costs.by is None else np.ascontiguousarray(costs.by)
        ends = steps.x[1:]
        with self.run.guard:
            reason = self.unit.function("simulation_back")(
                ctypes.byref(self.run.problem), ctypes.c_long(n),
                *pointers(self.A, self.b, steps.h, ends, times, states, of_x, of_others, weights))
        if self.run.trouble:
            raise self.run.trouble[0]
        if reason:
            raise EvaluationError(f"{self.module.name}: the derivatives along the motion cannot be evaluated: "
                                  f"{self.unit.reason(int(reason))}")
        self._note(steps, sum(a.nbytes for a in (times, states, of_x, of_others) if a is not None))
        return value

    def _inputs(self, t: np.ndarray, x: np.ndarray) -> np.ndarray:
        rows = self.request.inputs.rows(t, x)
        return np.broadcast_to(rows, (len(t), rows.shape[1]))

    def _note(self, steps: _Steps, more: int = 0) -> None:
        kept = sum(map(len, self.kept)) + sum(kept.bytes for kept in self.steps.values())
        self.memory = max(self.memory, kept + steps.bytes + more)
