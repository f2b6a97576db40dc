"""Events whose quantity touches zero: whether they happen is within the tolerances, so that their time has no derivative.

A quantity g that passes zero with the rate r and the curvature c goes r^2/(2 |c|) beyond it, or has come from no further away.
Where that is no more than the tolerances of the state leave open in g, the motion next to this one has no event at all, and the
derivative of its time, 1/r, is whatever rounding makes of it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from symdyn.runtime.integrating.outcome import Request
    from symdyn.runtime.module import Module

# Errors of a motion, in tolerances of its steps.
TOLERANCES = 10.0
# Steps back along the motion, of the time in which the state changes; the same, for the side of an event.
BACK, NEARBY = 1e-3, 1e-6
# A rate that becomes smaller than this part of itself with steps of an eighth vanishes.
STAYS = 0.5
# Relative difference of slopes from which on the right-hand side jumps.
JUMPS = 1e-7


def grazing(module: Module, request: Request, t: np.ndarray, x: np.ndarray, events: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Whether events, by number (n,), at times t and states x (n, n_x) before them, graze; size: of the states, (n_x,)."""
    tolerance = TOLERANCES * (request.atol + request.rtol * size)
    slope, length = _before(module, request, t, x, size)
    own = np.arange(len(t))
    quantity = lambda s, y: _rows(module, request, "events", s, y)[own, events]
    at, rates, bends = quantity(t, x), [], []
    for part in (1.0, 0.125):
        back = -part * BACK * length
        once, twice = (quantity(t + m * back, _moved(module, request, t, x, slope, m * back)) for m in (1, 2))
        rates.append((4 * once - 3 * at - twice) / (2 * back))
        bends.append((at - 2 * once + twice) / back**2)
    open_by = sum((np.abs(quantity(t, x + row) - at) for row in np.diag(tolerance)), np.zeros(len(t)))
    resolved = (np.abs(rates[1]) > STAYS * np.abs(rates[0])) & (rates[1] ** 2 > 2 * np.abs(bends[0]) * open_by)
    return np.asarray(~resolved)


def jumping(module: Module, request: Request, t: np.ndarray, before: np.ndarray, after: np.ndarray,
            size: np.ndarray) -> np.ndarray:
    """Whether the slope of the state jumps at events at times t (n,), from states before them to those after, (n, n_x)."""
    backward = _before(module, request, t, before, size)[0]
    forward = _before(module, request, t, after, size, -1.0)[0]
    return np.asarray((np.abs(forward - backward) > JUMPS * (np.abs(forward) + np.abs(backward))).any(axis=1))


def without_rate(module: Module, event: int, t: float) -> str:
    """Message about an event that grazes."""
    return (f"{module.name}: the quantity of the event {module.metadata.events[event].name} vanishes at t = {t:.9g} s without a "
            "rate that the tolerances resolve, so that its time has no derivative; take another quantity, another start, or "
            "events=[...] without it")


def _before(module: Module, request: Request, t: np.ndarray, x: np.ndarray, size: np.ndarray,
            way: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Slopes just before times t, (n, n_x), and how long the state takes to change, with the sign of the motion, (n,); way -1:
    just after them."""
    weight = 1.0 / np.maximum(request.atol + request.rtol * size, 1e-300)
    slope = _rows(module, request, "rhs", t, x)
    whole = request.span[1] - request.span[0]
    change = np.sqrt(np.mean((slope * weight) ** 2, axis=1))
    most = np.sqrt(np.mean((size * weight) ** 2))
    length = np.sign(whole) * np.minimum(abs(whole), most / np.maximum(change, 1e-300))
    length = np.where(length == 0, whole, length)
    side, far = -way * NEARBY * length, slope
    for part in (2.0, 1.0):
        far = slope
        for _ in range(3):  # the first ones go over to the side
            slope = _rows(module, request, "rhs", t + part * side, x + (part * side)[:, None] * slope)
    return 2 * slope - far, length


def _moved(module: Module, request: Request, t: np.ndarray, x: np.ndarray, slope: np.ndarray, step: np.ndarray) -> np.ndarray:
    """States a step of the classical Runge-Kutta method away, whose first slope is given."""
    field: Callable[[np.ndarray, np.ndarray], np.ndarray] = lambda s, y: _rows(module, request, "rhs", s, y)
    h = step[:, None]
    second = field(t + step / 2, x + h / 2 * slope)
    third = field(t + step / 2, x + h / 2 * second)
    fourth = field(t + step, x + h * third)
    moved: np.ndarray = x + h / 6 * (slope + 2 * second + 2 * third + fourth)
    return moved


def _rows(module: Module, request: Request, name: str, t: np.ndarray, x: np.ndarray) -> np.ndarray:
    inputs = np.broadcast_to(request.inputs.rows(t, x), (len(t), len(request.inputs.constant)))
    return np.asarray(module.evaluate(name, t, x, request.p, inputs)).reshape(len(t), -1)
