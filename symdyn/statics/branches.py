"""Branches of periodic motions over a parameter, past folds, by pseudo-arclength continuation.

Start, period and parameter are unknowns together. From a point of the branch a step goes along its tangent, and Newton's method
comes back to the branch across it, so that the parameter may turn back. Source: Keller, Numerical solution of bifurcation and
nonlinear eigenvalue problems (1977); Seydel, Practical Bifurcation and Stability Analysis, 3rd ed., chapter 4.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError, NoEquilibrium
from symdyn.real_numbers import number_of
from symdyn.runtime.integrating.stabilization import ProjectionFailed
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.statics.periodic import PeriodicMotion

# Newton's steps that are tried, and up to which the next step along the branch is longer; its factors; how short it may become.
ITERATIONS, QUICK, LONGER, SHORTER, SHORTEST = 12, 4, 1.5, 0.5, 1e-4


def branch(motion: PeriodicMotion, name: Any, least: Any, most: Any, step: Any, n: Any) -> list[PeriodicMotion]:
    """See PeriodicMotion.branch."""
    module = motion.module
    parameters, asked = list(module.metadata.parameters), name_of(name)
    if asked not in parameters:
        raise ArgumentError(f"{module.name}: a branch was to be followed over {shown(asked)}, which is no parameter; there are "
                            f"{', '.join(parameters)}")
    index = parameters.index(asked)
    low, high = (number_of(value, module.name, f"{what} of the branch must be a number")
                 for value, what in ((least, "least"), (most, "most")))
    if not low <= motion.params[index] <= high:
        raise ArgumentError(f"{module.name}: {asked} = {motion.params[index]:g} is not between the ends {low:g} and {high:g} of "
                            "the "
                            "branch; begin with a motion between them")
    length = number_of(step, module.name, "the step along the branch must be a number")
    if not (np.isfinite(length) and length):
        raise ArgumentError(f"{module.name}: the step along the branch is {shown(step)}; pass a positive number, or a negative "
                            "one to "
                            f"begin with smaller {asked}")
    if isinstance(n, bool) or not isinstance(n, (int, np.integer)) or n < 1:
        raise ArgumentError(f"{module.name}: a branch of {shown(n)} motions was asked for; pass a whole number from 1 on")
    at = _Point.of(motion, index, float(np.sign(length)), None)
    result: list[PeriodicMotion] = []
    length = abs(length)
    longest = length
    while len(result) < n:
        reached = at.along(length)
        if reached is None:
            length *= SHORTER
            if length < SHORTEST * longest:
                raise NoEquilibrium(f"{module.name}: the branch of periodic motions over {asked} is lost after {len(result)} "
                                    f"motions, at {asked} = {at.motion.params[index]:.6g}; it may end there, or branch off; the "
                                    "error has these motions as found", result)
            continue
        there, iterations = reached
        if not low <= there.params[index] <= high:
            break
        result.append(there)
        at = _Point.of(there, index, 0.0, at.tangent)
        length = min(longest, LONGER * length) if iterations <= QUICK else length
    return result


@dataclass(frozen=True)
class _Point:
    """A motion of a branch: the unit tangent in [start, along its basis; period; parameter], each by its size; the basis."""

    motion: PeriodicMotion
    place: int
    tangent: np.ndarray
    basis: np.ndarray
    slide: np.ndarray
    sizes: np.ndarray

    @classmethod
    def of(cls, motion: PeriodicMotion, index: int, way: float, before: np.ndarray | None) -> _Point:
        """way: the sign of the parameter's change; 0: on as before, by a tangent."""
        shot, slide = _shot(motion, index, motion.x, motion.period, motion.params[index])
        p = motion.params[index]
        sizes = np.append(np.full(shot.matrix.shape[1] - 1, max(float(np.abs(motion.x).max()), 1e-3)), abs(p) or 1.0)
        if motion.free_period:
            sizes[-2] = motion.period
        tangent = np.linalg.svd(shot.matrix * sizes)[2][-1]
        full = np.concatenate([shot.basis @ (tangent * sizes)[:shot.basis.shape[1]], tangent[shot.basis.shape[1]:]])
        turned = tangent[-1] * way if before is None else full @ before
        return cls(motion, index, full if turned >= 0 else -full, shot.basis, slide, sizes)

    def along(self, length: float) -> tuple[PeriodicMotion, int] | None:
        """The motion a step further on the branch, and Newton's steps; None if it is not found."""
        motion, place = self.motion, self.place
        n, free = len(motion.x), motion.free_period
        start = motion.x + length * self.tangent[:n] + length * self.tangent[-1] * self.sizes[-1] * self.slide
        period = motion.period + (length * self.tangent[n] * motion.period if free else 0.0)
        p = motion.params[place] + length * self.tangent[-1] * self.sizes[-1]
        for iteration in range(ITERATIONS):
            try:
                x = _with(motion, place, p).start(start)
                shot, slide = _shot(motion, place, x, period, p)
            except (EvaluationError, ProjectionFailed, ArgumentError):
                return None
            problem = _with(motion, place, p)
            if np.abs(shot.gap).max() <= problem.enough(x, shot.end):
                return problem.found(problem.shot(x, period), iteration), iteration
            m = shot.basis.shape[1]
            across = np.append(shot.basis.T @ self.tangent[:n] / self.sizes[0] ** 2, self.tangent[n:] / self.sizes[m:])
            right = np.append(-shot.gap, np.zeros(len(shot.matrix) - n + 1))
            change = np.linalg.lstsq(np.vstack([shot.matrix, across]), right, rcond=None)[0]
            if not np.isfinite(change).all() or np.abs(change / self.sizes).max() > max(1.0, 10 * length):
                return None
            start = x + shot.basis @ change[:m] + change[-1] * slide
            period += change[m] if free else 0.0
            p += change[-1]
        return None


@dataclass(frozen=True)
class _Linear:
    """The gap of a motion (n_x,), its end, and derivatives: rows of the gap, and one that holds the start along the motion where
    the period is free; columns of the start along a basis, the period, the parameter."""

    gap: np.ndarray
    end: np.ndarray
    basis: np.ndarray
    matrix: np.ndarray


def _shot(motion: PeriodicMotion, index: int, x: np.ndarray, period: float, p: float) -> tuple[_Linear, np.ndarray]:
    """A motion from a start with its derivatives, and how the start moves with the parameter on the constraints, (n_x,)."""
    problem = _with(motion, index, p)
    shot = problem.shot(x, period)
    by = problem.solution(x, period, 2, [motion.module.metadata.parameters[index]]).sensitivity.matrix[:, :, 0]
    by_p = problem.back @ by[-1] - problem.keeps * by[0]
    columns = [shot.moved - shot.basis, *([shot.late[:, None]] if motion.free_period else []), by_p[:, None]]
    matrix = np.hstack(columns)
    if motion.free_period:
        along = shot.basis.T @ shot.rate
        matrix = np.vstack([matrix, np.concatenate([along / max(float(np.linalg.norm(along)), 1e-300), [0.0, 0.0]])])
    return _Linear(shot.gap, shot.end, shot.basis, matrix), by[0]


def _with(motion: PeriodicMotion, index: int, value: float) -> Any:
    """The problem of the motion with another value of the parameter."""
    p = motion.params.copy()
    p[index] = value
    return replace(motion._problem, p=p)
