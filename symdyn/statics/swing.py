"""A mode as a motion: what a mechanism does that moves in one of its shapes, made large enough to be seen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError
from symdyn.kinds import whole
from symdyn.real_numbers import number_of
from symdyn.runtime.consistent import NotConsistent
from symdyn.runtime.inputs.inputs import Inputs
from symdyn.runtime.integrating.outcome import Outcome
from symdyn.runtime.solutions.solution import Solution
from symdyn.shown import shown
from symdyn.statics.modes import Mode
from symdyn.turning import in_radians

if TYPE_CHECKING:
    from symdyn.statics.linearize import Linearization

# Times of a period, and of a motion without one, which lasts so many time constants.
_TIMES, _CONSTANTS = 64, 3.0
# Default way of the centre of mass that moves most, as a part of the mechanism's extent; largest change of angles.
_SEEN, _TURNED = 0.12, 0.4
_STEP = 1e-5
# Largest distance of positions on the constraints from the shape, relative to the amplitude.
_AWAY = 0.5


def mode_motion(linear: Linearization, mode: Any, amplitude: Any, periods: Any) -> Solution:
    """See Linearization.mode_motion."""
    module, name = linear.module, linear.module.name
    chosen = mode if isinstance(mode, Mode) else _mode(linear, mode)
    if not len(linear.states) or chosen.kind == "zero":
        raise ArgumentError(f"{name}: the mode {chosen.name} has no frequency and no time constant: nothing moves by itself; "
                            "choose another one")
    count = whole(periods, f"{name}: periods")
    value = 1j * abs(chosen.eigenvalue.imag) if chosen.eigenvalue.imag else complex(-abs(chosen.eigenvalue.real))
    length = count * chosen.period if chosen.eigenvalue.imag else _CONSTANTS * chosen.time_constant
    t = linear.t + np.linspace(0.0, length, _TIMES * count + 1)
    shape = linear.tangent() @ chosen.right
    largest = complex(shape[np.abs(shape[:module.metadata.sizes.q]).argmax()])
    shape = shape / largest if largest else shape
    size = _visible(linear, shape) if amplitude is None else number_of(amplitude, name, "amplitude must be a number")
    if not (np.isfinite(size) and size > 0):
        raise ArgumentError(f"{name}: amplitude must be positive, found {shown(amplitude)}")
    x = linear.x + size * np.real(np.exp(value * (t - linear.t))[:, None] * shape)
    x = np.array([_held(linear, row, time, size) for row, time in zip(x, t, strict=True)])
    outcome = Outcome(t, x, True, f"the mode {chosen.name}, not a solution of the equations", False, 0, 0, 0)
    return Solution(module, outcome, linear.params, Inputs(np.array(linear.inputs)), "mode shape", 0.0)


def _mode(linear: Linearization, mode: Any) -> Mode:
    if isinstance(mode, (bool, float)) or not isinstance(mode, (int, str, np.integer)):
        raise ArgumentError(f"{linear.module.name}: mode is {shown(mode)}; pass one of linear.modes(), its number, or its name")
    return linear.modes()[mode]


def _held(linear: Linearization, x: np.ndarray, t: float, size: float) -> np.ndarray:
    """The state with positions that fulfil the constraints: a shape of an amplitude does so to first order alone.

    Raises ArgumentError where these are nowhere near.
    """
    module, sizes = linear.module, linear.module.metadata.sizes
    if not (module.metadata.constraints or module.metadata.unit_groups):
        return x
    try:
        q, u = module.consistent(x[:sizes.q], x[sizes.q:sizes.q + sizes.u], linear.params, float(t), inputs=linear.inputs)
        why = "positions that fulfil the constraints differ from it by more than half of the amplitude"
        if np.abs(q - x[:sizes.q]).max() <= _AWAY * size:
            return np.concatenate([q, u, x[sizes.q + sizes.u:]])
    except (NotConsistent, ArgumentError, EvaluationError) as error:
        why = str(error)
    raise ArgumentError(f"{module.name}: the mechanism cannot be moved so far in this shape: {why}; pass a smaller amplitude")


def _visible(linear: Linearization, shape: np.ndarray) -> float:
    """Size of the largest change of a coordinate."""
    module = linear.module
    if "positions" not in module.functions:
        return _TURNED
    both = np.array([linear.x, *(linear.x + sign * _STEP * part for part in (shape.real, shape.imag) for sign in (1, -1))])
    n = len(both)
    centres = module.evaluate("positions", np.full(n, linear.t), both, linear.params, np.tile(linear.inputs, (n, 1)))
    centres = centres.reshape(n, -1, 3)
    moved = np.hypot(*(np.linalg.norm(centres[a] - centres[b], axis=1) / (2 * _STEP) for a, b in ((1, 2), (3, 4))))
    frames = module.evaluate("frames", linear.t, linear.x, linear.params, linear.inputs).reshape(-1, 12)[:, :3] \
        if "frames" in module.functions else np.zeros((0, 3))
    every = np.concatenate([centres[0], frames])
    extent = float(np.linalg.norm(np.ptp(every, axis=0))) if len(every) else 0.0
    largest = float(moved.max(initial=0.0))
    if not (extent > 0 and largest > 1e-9 * extent):
        return _TURNED
    turns = in_radians(module.metadata.units.get(_leading(linear, shape)))
    return min(_SEEN * extent / largest, _TURNED if turns else np.inf)


def _leading(linear: Linearization, shape: np.ndarray) -> str:
    return str(linear.module.metadata.q[int(np.abs(shape[:linear.module.metadata.sizes.q]).argmax())])
