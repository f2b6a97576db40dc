"""Periodic motions by shooting: a start that the motion comes back to, its period, its multipliers; followed over a parameter.

Newton's method on x(T; x0) - x0 with the sensitivities of the motion by its start, on constraints and across events. Where the
time does not appear in the equations the period is free, and a start moves along the motion no further than the guess.
Source: Seydel, Practical Bifurcation and Stability Analysis, 3rd ed., chapter 7.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.arguments import some
from symdyn.errors import ArgumentError, EvaluationError, NoEquilibrium, SimulationWarning
from symdyn.real_numbers import number_of, real_of
from symdyn.runtime.integrating.simulate import start_of
from symdyn.runtime.integrating.stabilization import ProjectionFailed, Projector
from symdyn.runtime.masses import real_parameters
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.given import Key
    from symdyn.runtime.module import Module
    from symdyn.runtime.solutions.solution import Solution

# Newton's steps; the largest part by which one changes the period, how often one is halved.
ITERATIONS, LARGEST, HALVINGS = 50, 0.2, 8
# What is left after a period, of the size of the motion, by the tolerance of its steps.
CLOSED = 1e3
# Singular values of Newton's matrix that do not count: where periodic motions of other energies are near, more of them.
LEFT_OUT = (1e-9, 1e-4)
# Directions that a start may change in: singular values of the projection beyond this part of the largest.
TANGENT = 1e-6


@dataclass(frozen=True, eq=False)
class PeriodicMotion:
    """A motion that comes back after its period.

    period       s; x: its start (n_x,); params: its parameters (n_p,)
    multipliers  of Floquet, complex, the largest first: factors of small disturbances over a period, along the constraints; where
                 the period is free one of them, that of a shift along the motion, is 1
    residual     what is left after a period, the largest entry; iterations: of Newton's method
    """

    module: Module
    period: float
    x: np.ndarray
    params: np.ndarray
    multipliers: np.ndarray
    residual: float
    iterations: int
    free_period: bool
    _problem: _Problem = field(repr=False)

    @property
    def stable(self) -> bool:
        """Whether all disturbances but a shift along the motion die out."""
        rest = np.abs(self.multipliers)
        if self.free_period:
            rest = np.delete(rest, np.argmin(np.abs(self.multipliers - 1)))
        return bool((rest < 1).all())

    def simulate(self, n: int = 201) -> Solution:
        """The motion over a period, at n times."""
        return self._problem.solution(self.x, self.period, n)

    def follow(self, name: Key, values: Sequence[float]) -> list[PeriodicMotion]:
        """The periodic motions at other values of a parameter, one after the other, each sought from the one before along its
        derivative by the parameter.

        Raises ArgumentError for an unknown parameter, NoEquilibrium where the way ends, with the value.
        """
        parameters = list(self.module.metadata.parameters)
        asked = name_of(name)
        if asked not in parameters:
            raise ArgumentError(f"{self.module.name}: a periodic motion was to be followed over {shown(asked)}, which is no "
                                f"parameter; there are {', '.join(parameters)}")
        point = parameters.index(asked)
        found, motion = [], self
        for value in real_of(values, self.module.name, "the values of the parameter must be numbers").ravel():
            problem = motion._problem
            change = problem.derivative(motion.x, motion.period, asked) * (value - motion.params[point])
            p = motion.params.copy()
            p[point] = value
            try:
                motion = replace(problem, p=p).solve(motion.x + change[:-1], motion.period + change[-1])
            except NoEquilibrium as error:
                raise NoEquilibrium(f"{error}; at {asked} = {value:g}, followed from {asked} = "
                                    f"{motion.params[point]:g}") from None
            found.append(motion)
        return found

    def branch(self, name: Key, least: float, most: float, step: float = 0.1, n: int = 200) -> list[PeriodicMotion]:
        """The periodic motions on the branch of this one over a parameter, past folds, where the parameter turns back.

        least, most   of the parameter: where it leaves them the branch ends
        step          along the branch, relative to the sizes of the state, the period and the parameter; the longest one, halved
                      where the branch is bent; negative: it begins with smaller values of the parameter
        n             motions at most
        Raises ArgumentError for what does not fit, NoEquilibrium where the branch is lost, with the value.
        """
        from symdyn.statics.branches import branch

        return branch(self, name, least, most, step, n)

    def __repr__(self) -> str:
        sizes = ", ".join(f"{abs(m):.4g}" for m in self.multipliers[:4])
        return (f"<PeriodicMotion of {self.module.name}: period {self.period:.9g} s, multipliers of size {sizes}"
                f"{', ...' if len(self.multipliers) > 4 else ''}>")


def periodic(module: Module, period: Any, q: Any = None, u: Any = None, params: Any = None, *, z: Any = None, t: float = 0.0,
             inputs: Any = None, advance: Any = None, rtol: float = 1e-10, method: str = "dop853") -> PeriodicMotion:
    """See Module.periodic."""
    metadata = module.metadata
    guess = number_of(period, module.name, "the period must be a number of seconds")
    if not (np.isfinite(guess) and guess > 0):
        raise ArgumentError(f"{module.name}: the period must be a positive number of seconds, found {shown(period)}; where the "
                            "time does not appear in the equations it is a guess")
    p = real_parameters(module, params)
    turns = some(advance, list(metadata.x), "advance", module.name)
    begin = number_of(t, module.name, "t must be a finite time")
    arguments = module.unit("rhs").metadata.arguments
    free = not any("t" in arguments.get(name, ()) for name in ("rhs", "events", "event_resets"))
    moves = np.array([turns.get(name, 0.0) for name in metadata.x])
    return _Problem(module, p, begin, inputs, moves, rtol, method, free).solve(start_of(module, q, u, z), guess)


@dataclass(frozen=True)
class _Problem:
    module: Module
    p: np.ndarray
    t: float
    inputs: Any
    moves: np.ndarray
    rtol: float
    method: str
    free: bool

    def solve(self, x: np.ndarray, period: float) -> PeriodicMotion:
        """The periodic motion near a start and a period."""
        x = Projector(self.module, self.p)(self.t, x)
        here = self.shot(x, period)
        scale, enough = _size(x, here.end), self.enough(x, here.end)
        for iteration in range(ITERATIONS):
            if np.abs(here.gap).max() <= enough:
                return self.found(here, iteration)
            better = (self.nearer(here, self.solved(here, -here.gap, left_out), scale) for left_out in LEFT_OUT)
            there = next((one for one in better if one is not None), None)
            if there is None:
                break
            here = there
        worst = int(np.abs(here.gap).argmax())
        raise NoEquilibrium(f"{self.module.name}: no periodic motion found near the start with the period {period:.6g} s: after "
                            f"{here.period:.6g} s {self.module.metadata.x[worst]} is off by {here.gap[worst]:.3g}; begin nearer "
                            "to it, with a state that a simulation has settled to")

    def enough(self, x: np.ndarray, end: np.ndarray) -> float:
        """The gap of a motion that counts as closed."""
        return CLOSED * self.rtol * _size(x, end)

    def nearer(self, here: _Shot, step: np.ndarray, scale: float) -> _Shot | None:
        """A motion with a smaller gap on the way of a step, None if there is none."""
        part = min(1.0, LARGEST * here.period / max(abs(step[-1]), 1e-300))
        part = min(part, 0.5 * max(scale, 1.0) / max(np.abs(step[:-1]).max(), 1e-300))
        for _ in range(HALVINGS):
            try:
                x = Projector(self.module, self.p)(self.t, here.x + part * step[:-1])
                there = self.shot(x, here.period + part * step[-1])
            except (EvaluationError, ProjectionFailed):
                there = None
            if there is not None and np.linalg.norm(there.gap) < (1 - 0.1 * part) * np.linalg.norm(here.gap):
                return there
            part *= 0.5
        return None

    def shot(self, x: np.ndarray, period: float) -> _Shot:
        """Where a start is after a period, with what it depends on. Raises EvaluationError where the motion stops early."""
        run = self.solution(x, period, 2, [f"{name}(0)" for name in self.module.metadata.x])
        S = run.sensitivity.matrix
        left, sizes, _ = np.linalg.svd(S[0])
        basis = left[:, sizes > TANGENT * sizes[0]]
        return _Shot(x, period, run.x[-1], S[-1] @ basis, basis, run.x[-1] - x - self.moves,
                     self.rate(self.t, x), self.rate(self.t + period, run.x[-1]))

    def rate(self, t: float, x: np.ndarray) -> np.ndarray:
        inputs = () if self.inputs is None else self.inputs
        return self.module.evaluate("rhs", t, x, self.p, inputs)

    def solved(self, at: _Shot, right: np.ndarray, left_out: float = 1e-9) -> np.ndarray:
        """Changes of the start and of the period by which what is left after a period changes as given, the smallest ones;
        singular values below this part of the largest are left out."""
        columns = [at.moved - at.basis]
        if self.free:  # and the start does not slide along the motion
            along = at.basis.T @ at.rate
            columns.append(at.late[:, None])
            size = max(float(np.linalg.norm(along)), 1e-300)
            matrix = np.vstack([np.hstack(columns), np.append(along / size, 0.0)])
            right = np.append(right, 0.0)
        else:
            matrix = columns[0]
        found = np.linalg.lstsq(matrix, right, rcond=left_out)[0]
        n = at.basis.shape[1]
        return np.append(at.basis @ found[:n], found[n] if self.free else 0.0)

    def derivative(self, x: np.ndarray, period: float, name: str) -> np.ndarray:
        """Derivatives of the start and of the period by a parameter, (n_x + 1,)."""
        by = self.solution(x, period, 2, [name]).sensitivity[name]
        found = self.solved(self.shot(x, period), by[0] - by[-1])
        return found + np.append(by[0], 0.0)

    def found(self, at: _Shot, iterations: int) -> PeriodicMotion:
        multipliers = np.linalg.eigvals(at.basis.T @ at.moved)
        multipliers = multipliers[np.argsort(-np.abs(multipliers))]
        left = float(np.abs(at.gap).max())
        return PeriodicMotion(self.module, float(at.period), at.x, self.p, multipliers, left, iterations, self.free, self)

    def solution(self, x: np.ndarray, period: float, n: int, by: Sequence[str] | None = None) -> Solution:
        """A motion over a period. Raises EvaluationError where it stops early."""
        sizes = self.module.metadata.sizes
        times = np.linspace(self.t, self.t + period, n)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SimulationWarning)
            run = self.module.simulate(times, x[:sizes.q], x[sizes.q:sizes.q + sizes.u], self.p, z=x[sizes.q + sizes.u:],
                                       inputs=self.inputs, rtol=self.rtol, method=self.method, sensitivities=by)
        if not run.success or run.t[-1] != times[-1]:
            raise EvaluationError(f"{self.module.name}: the motion does not last for a period: {run.message}")
        return run


def _size(x: np.ndarray, end: np.ndarray) -> float:
    return max(float(np.abs(x).max()), float(np.abs(end).max()), 1e-3)


@dataclass(frozen=True)
class _Shot:
    """A motion from x over a time: its end, what that is moved by the directions of `basis`, the gap, the rates at both ends."""

    x: np.ndarray
    period: float
    end: np.ndarray
    moved: np.ndarray
    basis: np.ndarray
    gap: np.ndarray
    rate: np.ndarray
    late: np.ndarray


