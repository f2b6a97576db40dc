"""Outputs that are points of bodies: a module names its outputs only, but what a point does is found at random speeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symdyn.errors import EvaluationError

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

_STATES = 12
_STEP = 1e-4
_TOLERANCE = 1e-6


@dataclass(frozen=True)
class BodyPoint:
    """Quantity that an output gives of a point fixed on a body: "position" or "velocity"."""

    body: int
    quantity: str

    @property
    def unit(self) -> str:
        return "m" if self.quantity == "position" else "m/s"


@dataclass(frozen=True)
class _Samples:
    """Values at some states, and their changes in the time in which the fastest coordinate changes by one."""

    outputs: dict[str, tuple[np.ndarray, np.ndarray]]
    frames: tuple[np.ndarray, np.ndarray]
    pace: float


def points_of(solution: Solution) -> dict[str, BodyPoint]:
    """The outputs that are points of bodies, by name."""
    module = solution.module
    names = [n for n, shape in module.metadata.outputs if tuple(shape) in ((2,), (3,))]
    if not names or "frames" not in module.functions or not len(solution.t):
        return {}
    try:
        samples = _sample(solution)
    except EvaluationError:  # at a state that the motion did not come to
        return {}
    result = {name: _match(samples, *samples.outputs[name]) for name in names}
    return {name: point for name, point in result.items() if point is not None}


def _sample(solution: Solution) -> _Samples:
    """States of the motion with other speeds: coordinates keep to what they must, Euler parameters to unit length."""
    module, sizes = solution.module, solution.module.metadata.sizes
    rows = np.linspace(0, len(solution.t) - 1, _STATES).astype(int)
    t, x, inputs = solution.t[rows], solution.x[rows].copy(), solution.inputs[rows]
    n_q, n_u = sizes.q, sizes.u
    x[:, n_q:n_q + n_u] += np.random.default_rng(1).uniform(-1, 1, (_STATES, n_u))

    def at(name: str, step: float) -> np.ndarray:
        moved = x.copy()
        moved[:, :n_q] += step * rates
        return module.evaluate(name, t + step, moved, solution.params, inputs)

    rates = module.evaluate("rhs", t, x, solution.params, inputs)[:, :n_q]
    pace = 1.0 + np.abs(rates).max(initial=0.0)
    step = _STEP / pace
    frames, outputs = [(at(name, 0.0), (at(name, step) - at(name, -step)) / (2 * _STEP)) for name in ("frames", "outputs")]
    values, changes = module.split_outputs(outputs[0]), module.split_outputs(outputs[1])
    return _Samples({name: (values[name], changes[name]) for name in values}, frames, pace)


def _match(samples: _Samples, value: np.ndarray, change: np.ndarray) -> BodyPoint | None:
    """The outermost body that has a point whose position or velocity is the output at all samples."""
    n = value.shape[1]
    frames, turning = (a.reshape(_STATES, -1, 12) for a in samples.frames)
    for k in reversed(range(frames.shape[1])):
        o, R = frames[:, k, :3], frames[:, k, 3:].reshape(-1, 3, 3)
        v, V = turning[:, k, :3], turning[:, k, 3:].reshape(-1, 3, 3)
        if n == 2 and not np.allclose(R[:, 2], [0.0, 0.0, 1.0]):
            continue
        position = np.concatenate([value - o[:, :n], change - v[:, :n]])
        if _solvable(np.concatenate([R[:, :n], V[:, :n]]), position, np.abs(value).max()):
            return BodyPoint(k, "position")
        if _solvable(V[:, :n], value / samples.pace - v[:, :n], np.abs(value).max() / samples.pace):
            return BodyPoint(k, "velocity")
    return None


def _solvable(matrices: np.ndarray, wanted: np.ndarray, size: float) -> bool:
    """Whether one vector b gives matrices @ b = wanted at all samples."""
    A, y = matrices.reshape(-1, 3), wanted.ravel()
    if not (np.isfinite(A).all() and np.isfinite(y).all()):
        return False
    b = np.linalg.lstsq(A, y, rcond=1e-9)[0]
    return bool(np.abs(A @ b - y).max() <= _TOLERANCE * max(size, np.abs(y).max(), 1e-9))
