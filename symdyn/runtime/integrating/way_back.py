"""A run forth and back over explicit Runge-Kutta steps: the discrete adjoint of the steps that were taken.

The motion is integrated once, and what it goes on from is kept at checkpoints. Then stretch by stretch, the last one first, the
weights of the state at the end of each step are carried back to its start. The steps of the first stretches are kept, up to a
given memory; all others are taken again, to the same bits. There are as many checkpoints as a stretch has steps, so that memory
grows with the square root of their number (Griewank and Walther, Evaluating Derivatives, 2nd ed., chapter 12).
"""

from __future__ import annotations

import ctypes
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.methods import method_of
from symdyn.backend.right_side import RightSide
from symdyn.errors import EvaluationError, SimulationWarning
from symdyn.runtime.inputs.inputs import Inputs
from symdyn.runtime.integrating.compiled import Run, moved_far, stopped_because
from symdyn.runtime.integrating.outcome import Request
from symdyn.runtime.integrating.run_record import STATUS
from symdyn.runtime.losses import Cost

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


# Steps that are tried in a stretch at first; doubled as often as there are more checkpoints than that.
STRETCH = 128


class Feedback:
    """Inputs that follow the state by functions with gradients: their places among what weights are carried to besides x."""

    def __init__(self, module: Module, inputs: Inputs, carried: Sequence[str]) -> None:
        self._given = inputs
        self._inputs = [place for places, *_ in inputs.gradients for place in places]
        self.names = [module.metadata.inputs[place] for place in self._inputs]
        self.places = np.array([carried.index(name) for name in self.names if name in carried], dtype=ctypes.c_long)

    def slopes(self, t: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Derivatives of these inputs by the state at times (n,) and states (n, n_x), (n, n_followed, n_x)."""
        eye = np.eye(x.shape[1])
        rows = [self._given.slopes(tk, xk, eye)[self._inputs] for tk, xk in zip(t.tolist(), x, strict=True)]
        return np.array(rows).reshape(len(t), len(self._inputs), x.shape[1])

    def fold(self, t: float, x: np.ndarray, weights: np.ndarray) -> None:
        """Make weights of these inputs, behind those of x (n_x,), weights of x."""
        if len(self.places):
            at = len(x) + self.places
            weights[:len(x)] += weights[at] @ self.slopes(np.array([t]), x[None, :])[0]
            weights[at] = 0.0


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


class Way:
    """A run forth and back, across no event; room: bytes up to which steps are kept."""

    def __init__(self, module: Module, request: Request, method: str, carried: Sequence[str], room: float) -> None:
        self.module, self.request, self.carried, self.room = module, request, tuple(carried), room
        self.feedback = Feedback(module, request.inputs, self.carried)
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
        self._spare: _Steps | None = None

    def forth(self) -> tuple[float, np.ndarray]:
        """To the end: the time and the state there."""
        self._spare = self._forth()
        return self.end

    def back(self, integral: Cost | None, weights: np.ndarray) -> float:
        """Carry weights of the end, (n_x + n_carried,), to the start, in place; the integral."""
        steps, self._spare = self._spare, None
        assert steps is not None
        times, states = np.empty((self.stretch, self.stages)), np.empty((self.stretch, self.stages, self.n_x))
        value = 0.0
        for k in reversed(range(len(self.kept))):
            if k not in self.steps:
                self.run.restore(self.kept[k])
                self._record(steps)
            value += self._back(self.steps.get(k, steps), times, states, integral, weights)
        if self.request.stabilization.way == "projection" and "corrected_weights" in self.unit.metadata.shapes:
            # The start is put onto the constraints, too.
            begin = self.request.span[0]
            row = self.weights("corrected_weights", begin, self.start, weights[:self.n_x])
            weights[:self.n_x] = row[:self.n_x]
            weights[self.n_x:] += row[self.n_x:]
        return value

    def weights(self, name: str, t: float, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """An adjoint at a state: from weights (n_x,) to those of x and of what is carried, (n_x + n_carried,)."""
        evaluator = self.unit.evaluator(name)
        evaluator.set_params(self.request.p)
        inputs = self.request.inputs.rows(np.array([t]), x[None, :])[0]
        found = np.array(evaluator.one(t, x, inputs if len(inputs) else None, weights.copy()))
        self.feedback.fold(t, x, found)
        return found

    def _forth(self) -> _Steps:
        """To the end, with checkpoints; room for the steps of a stretch."""
        run, status = self.run, STATUS.STEP_LIMIT if self.run.status == STATUS.DONE else self.run.status  # the start went well
        self.start = run.report().x.copy()
        steps = _Steps.room(self.stretch, self.n_x, self.stages)
        while status == STATUS.STEP_LIMIT:
            status = self._record(steps)
            self.n_steps += steps.n
            if sum(kept.bytes for kept in self.steps.values()) + steps.bytes <= self.room or status != STATUS.STEP_LIMIT:
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
        doubt = moved_far(self.module.name, report.of.largest_moved, report.of.t_moved)
        if doubt:
            warnings.warn(doubt, SimulationWarning, stacklevel=6)
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
        places = self.feedback.places
        feedback = self.feedback.slopes(times[:n].ravel(), states[:n].reshape(-1, self.n_x)) if len(places) else None
        ends = steps.x[1:]
        with self.run.guard:
            reason = self.unit.function("simulation_back")(
                ctypes.byref(self.run.problem), ctypes.c_long(n),
                *pointers(self.A, self.b, steps.h, ends, times, states, of_x, of_others), ctypes.c_long(len(places)),
                *pointers(places, feedback, weights))
        if self.run.trouble:
            raise self.run.trouble[0]
        if reason:
            raise EvaluationError(f"{self.module.name}: the derivatives along the motion cannot be evaluated: "
                                  f"{self.unit.reason(int(reason))}")
        self._note(steps, sum(a.nbytes for a in (times, states, of_x, of_others, feedback) if a is not None))
        return value

    def _inputs(self, t: np.ndarray, x: np.ndarray) -> np.ndarray:
        rows = self.request.inputs.rows(t, x)
        return np.broadcast_to(rows, (len(t), rows.shape[1]))

    def _note(self, steps: _Steps, more: int = 0) -> None:
        kept = sum(map(len, self.kept)) + sum(kept.bytes for kept in self.steps.values())
        self.memory = max(self.memory, kept + steps.bytes + more)
