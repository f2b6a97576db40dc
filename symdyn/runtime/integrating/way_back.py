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
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.methods import method_of
from symdyn.backend.right_side import RightSide
from symdyn.errors import EvaluationError, SimulationWarning
from symdyn.runtime.inputs.inputs import Inputs
from symdyn.runtime.integrating.at_breaks import Breaks
from symdyn.runtime.integrating.compiled import Run, moved_far, stopped_because
from symdyn.runtime.integrating.outcome import Request
from symdyn.runtime.integrating.quadrature import Integral
from symdyn.runtime.integrating.run_record import STATUS
from symdyn.runtime.losses import Costs

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


# Steps that are tried in a stretch at first; doubled as often as there are more checkpoints than that.
STRETCH = 128
# An integrand is measured at the start of one of so many steps, at so many at once.
SOME, GROUP = 4, 512
# Number of parts that a step is divided into where the integrand of a loss needs shorter ones.
PARTS = 8


def _pointers(*arrays: np.ndarray | None) -> list[ctypes.c_void_p]:
    return [ctypes.c_void_p(None if a is None else a.ctypes.data) for a in arrays]


class Feedback:
    """Inputs that follow the state by functions with gradients: their indices among what weights are carried to besides x."""

    def __init__(self, module: Module, inputs: Inputs, carried: Sequence[str]) -> None:
        self._given = inputs
        self._inputs = [index for indices, *_ in inputs.gradients for index in indices]
        self.names = [module.metadata.inputs[index] for index in self._inputs]
        self.indices = np.array([carried.index(name) for name in self.names if name in carried], dtype=ctypes.c_long)

    def slopes(self, t: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Derivatives of these inputs by the state at times (n,) and states (n, n_x), (n, n_followed, n_x)."""
        eye = np.eye(x.shape[1])
        rows = [self._given.slopes(tk, xk, eye)[self._inputs] for tk, xk in zip(t.tolist(), x, strict=True)]
        return np.array(rows).reshape(len(t), len(self._inputs), x.shape[1])

    def fold(self, t: float, x: np.ndarray, weights: np.ndarray) -> None:
        """Make weights of these inputs, behind those of x (n_x,), weights of x."""
        if len(self.indices):
            at = len(x) + self.indices
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
    """A run forth and back, across no event.

    room     bytes up to which steps are kept; outer: length of the step of a longer run that it divides
    breaks   where the equations have kinks; None: nowhere that is known
    """

    def __init__(self, module: Module, request: Request, method: str, carried: Sequence[str], room: float,
                 breaks: Breaks | None = None, outer: float = 0.0) -> None:
        self.module, self.request, self.carried, self.room = module, request, tuple(carried), room
        self.method, self.breaks, self.outer = method, breaks, outer
        self.feedback = Feedback(module, request.inputs, self.carried)
        library: Any = module.library(RightSide(method=method, adjoint=tuple(carried)))
        self.library, self.run = library, Run(library, request)
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
        self.steps: dict[int, _Steps] = {}  # by the index of their stretch
        self.n_steps, self.memory = 0, 0
        self.end: tuple[float, np.ndarray] = (request.span[0], request.x0)
        self._spare: _Steps | None = None
        self._rows: list[tuple[np.ndarray, np.ndarray]] = []  # at which the integrand is to be measured

    def forth(self, integral: Integral | None = None) -> tuple[float, np.ndarray]:
        """To the end: the time and the state there; integral: what is measured on the way, where one stretch is not all."""
        self._spare = self._forth(integral)
        return self.end

    def back(self, integral: Integral | None, weights: np.ndarray) -> float:
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
        if self.request.stabilization.way == "projection" and "corrected_weights" in self.library.metadata.shapes:
            # The start is put onto the constraints, too.
            begin = self.request.span[0]
            row = self.weights("corrected_weights", begin, self.start, weights[:self.n_x])
            weights[:self.n_x] = row[:self.n_x]
            weights[self.n_x:] += row[self.n_x:]
        return value

    def weights(self, name: str, t: float, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """An adjoint at a state: from weights (n_x,) to those of x and of what is carried, (n_x + n_carried,)."""
        evaluator = self.library.evaluator(name)
        evaluator.set_params(self.request.p)
        inputs = self.request.inputs.rows(np.array([t]), x[None, :])[0]
        result = np.array(evaluator.one(t, x, inputs if len(inputs) else None, weights.copy()))
        self.feedback.fold(t, x, result)
        return result

    def _forth(self, integral: Integral | None) -> _Steps:
        """To the end, with checkpoints; room for the steps of a stretch."""
        run, status = self.run, STATUS.STEP_LIMIT if self.run.status == STATUS.DONE else self.run.status  # the start went well
        self.start = run.report().x.copy()
        steps = _Steps.room(self.stretch, self.n_x, self.stages)
        while status == STATUS.STEP_LIMIT:
            status = self._record(steps)
            self.n_steps += steps.n
            if integral is not None and (len(self.kept) > 1 or status == STATUS.STEP_LIMIT):
                self._measure(integral, steps, status != STATUS.STEP_LIMIT)
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

    def _measure(self, integral: Integral, steps: _Steps, last: bool) -> None:
        """Have the integrand measured at some of the steps, in large groups."""
        if steps.n:
            taken = np.append(np.arange(0, steps.n, SOME), steps.n)
            t = np.append(steps.t[:steps.n], steps.t[steps.n - 1] + steps.h[steps.n - 1])
            self._rows.append((t[taken], steps.x[taken]))
        if self._rows and (last or sum(len(t) for t, _ in self._rows) >= GROUP):
            t, x = (np.concatenate(parts) for parts in zip(*self._rows, strict=True))
            integral.over_rows(t, x, self.request.inputs.rows(t, x))
            self._rows = []

    def _record(self, steps: _Steps) -> int:
        """Try as many steps as a stretch has, and keep those that are accepted; the status."""
        written = ctypes.c_long(0)
        with self.run.guard:
            status = self.library.function("simulation_record")(
                self.run.address, ctypes.c_long(self.stretch), ctypes.c_long(len(steps.t)),
                *[ctypes.c_void_p(a.ctypes.data) for a in (steps.t, steps.h, steps.x, steps.slopes)], ctypes.byref(written))
        steps.n = written.value
        return int(status)

    def _back(self, steps: _Steps, times: np.ndarray, states: np.ndarray, integral: Integral | None,
              weights: np.ndarray) -> float:
        """Carry the weights back over the steps of a stretch; its part of the integral. times, states: room for the stages."""
        n = steps.n
        self.library.function("simulation_stages")(
            ctypes.c_long(n), *_pointers(self.A, self.c, steps.t, steps.h, steps.x, steps.slopes, times, states))
        if not n or (integral is None and self.breaks is None):
            self._over(steps, 0, n, times, states, None, weights)
            return 0.0
        h, at, rows = steps.h[:n], times[:n].ravel(), states[:n].reshape(-1, self.n_x)
        inputs = self._inputs(at, rows)
        costs, parts, bad, jumping = None, np.zeros(n), np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
        if integral is not None:
            costs = integral(at, rows, inputs)
            if not integral.weighed:
                integral.over_stages(h, rows, costs)
            bad, jumping = integral.judge(h, at, rows, inputs, costs, self.outer)
            parts = h * (costs.values.reshape(n, self.stages) @ self.b)
        if self.breaks is not None:
            bent = self.breaks.crossed(h, at, rows, self.request.p, inputs)
            bad, jumping = bad | bent, jumping & ~bent
        if not (bad.any() or jumping.any()):
            self._over(steps, 0, n, times, states, costs, weights)
            return float(parts.sum())
        value, end = 0.0, n
        while end:
            begin = end - 1
            while not jumping[end - 1] and begin and bad[begin - 1] == bad[end - 1] and not jumping[begin - 1]:
                begin -= 1
            if bad[end - 1]:
                value += self._finer(steps, begin, end, integral, weights)
            else:
                self._over(steps, begin, end, times, states, costs, weights)
                value += float(parts[begin:end].sum())
            if jumping[end - 1] and integral is not None and costs is not None:
                here = slice(begin * self.stages, end * self.stages)
                gained = integral.across(at[here], rows[here], inputs[here], costs.values[here], steps.slopes[begin, 0])
                if len(gained):
                    self.feedback.fold(float(at[here][0]), rows[here][0], gained)
                    weights += gained
            end = begin
        return value

    def _over(self, steps: _Steps, begin: int, end: int, times: np.ndarray, states: np.ndarray, costs: Costs | None,
              weights: np.ndarray) -> None:
        """Carry the weights back over some of the steps of a stretch, from `begin` to before `end`; costs: at all stages."""
        of_x, of_others = None, None
        if costs is not None:
            here = slice(begin * self.stages, end * self.stages)
            of_x = np.ascontiguousarray(costs.by_x[here])
            of_others = None if costs.by is None else np.ascontiguousarray(costs.by[here])
        indices = self.feedback.indices
        times, states = times[begin:end], states[begin:end]
        feedback = self.feedback.slopes(times.ravel(), states.reshape(-1, self.n_x)) if len(indices) else None
        with self.run.guard:
            reason = self.library.function("simulation_back")(
                ctypes.byref(self.run.problem), ctypes.c_long(end - begin),
                *_pointers(self.A, self.b, steps.h[begin:], steps.x[begin + 1:], times, states, of_x, of_others),
                ctypes.c_long(len(indices)), *_pointers(indices, feedback, weights))
        if self.run.trouble:
            raise self.run.trouble[0]
        if reason:
            raise EvaluationError(f"{self.module.name}: the derivatives along the motion cannot be evaluated: "
                                  f"{self.library.reason(int(reason))}")
        self._note(steps, sum(a.nbytes for a in (times, states, of_x, of_others, feedback) if a is not None))

    def _finer(self, steps: _Steps, begin: int, end: int, integral: Integral | None, weights: np.ndarray) -> float:
        """The same over shorter steps in place of some, where the integrand of a loss or a kink of the equations needs them;
        their part of the integral."""
        length = float(np.abs(steps.h[begin:end]).min()) / PARTS
        part = replace(self.request, span=(float(steps.t[begin]), float(steps.t[end - 1] + steps.h[end - 1])),
                       x0=steps.x[begin].copy(), first_step=length, max_step=length, times=None)
        way = Way(self.module, part, self.method, self.carried, self.room, self.breaks,
                  self.outer or float(steps.h[begin:end].min()))
        way.forth()
        for counted in (integral, self.breaks):
            if counted is not None:
                counted.work -= PARTS + way.n_steps
        value = way.back(integral, weights)
        self._note(steps, way.memory)
        return value

    def _inputs(self, t: np.ndarray, x: np.ndarray) -> np.ndarray:
        rows = self.request.inputs.rows(t, x)
        return np.broadcast_to(rows, (len(t), rows.shape[1]))

    def _note(self, steps: _Steps, more: int = 0) -> None:
        kept = sum(map(len, self.kept)) + sum(kept.bytes for kept in self.steps.values())
        self.memory = max(self.memory, kept + steps.bytes + more)
