"""States where the equations have a kink or a jump, such as dry friction at rest or the edge of a contact: no linear ones exist.

The balance is evaluated at a few steps to both sides, coordinate by coordinate, speed by speed, and so on. The slopes of a smooth
function on both sides differ by less and less, in proportion to the step; at a kink they differ by the same at each step, and at
a jump the values do. Rounding does neither: what it makes of the values is measured where they are the same but for it, and by
data that differ in their last digit, since large terms that cancel, such as those of stiff springs, leave their own.
"""

from __future__ import annotations

import warnings

import numpy as np

from symdyn.errors import EvaluationError, EvaluationWarning
from symdyn.statics.manifold import held_indices
from symdyn.statics.noise import SAMPLES, rounded
from symdyn.statics.selection import Selection
from symdyn.statics.terms import OperatingPoint

# Steps, as parts of the value or of one unit; by how much differences at a kink or a jump may vary with them, and how far above
# rounding they have to be. Parts by which steps vary where rounding is measured.
STEPS, SAME, ABOVE = (1e-4, 1e-5, 1e-6), 0.1, 1e3
SPREAD = (1.0, 1.0 + 1e-12, 1.0 - 1e-12)


def kink(point: OperatingPoint, selection: Selection) -> str:
    """Quantity that passes its value where the equations have a kink or a jump at a state with accelerations, as "x"; "" for
    none."""
    metadata = point.module.metadata
    coordinates, speeds = held_indices(point, selection)
    held = {metadata.q[k] for k in coordinates} | {f"{metadata.q[k]}_dot" for k in coordinates}
    held |= {metadata.u[k] for k in speeds} | set(selection.held)
    entries = list(enumerate((*metadata.x, *metadata.inputs)))
    tried = [(k, name) for k, name in (entries if metadata.not_smooth else entries[len(metadata.x):]) if name not in held]
    return next((name for k, name in tried if _breaks(point, k)), "")


def no_linear_equations(name: str) -> str:
    """Message about such a state; name: the quantity that passes its value."""
    return (f"the equations have a kink or a jump at this state, where {name} passes its value, so that there are no linear "
            "ones; take another state, or a smooth law such as tanh(x/eps) in place of sign(x)")


def _breaks(point: OperatingPoint, k: int) -> bool:
    """Whether the balance has a kink or jump at the value of entry k of [x; inputs]."""
    n_x = len(point.x)
    value = np.concatenate([point.x, point.inputs])
    steps = np.array([sign * part * step for step in STEPS for sign in (1, -1) for part in SPREAD]) * max(1.0, abs(value[k]))
    moved = np.tile(value, (len(steps) + 1, 1))
    moved[1:, k] += steps
    ud = np.concatenate([point.ud, point.lam])
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", EvaluationWarning)
            result = point.module.evaluate("balance", point.t, moved[:, :n_x], point.p, moved[:, n_x:], ud)
    except EvaluationError:
        return False
    middle = result[0]
    sides = result[1:].reshape(len(STEPS), 2, len(SPREAD), -1)
    rounding = np.ptp(sides, axis=2).max(axis=(0, 1)) + np.finfo(float).eps * np.abs(result).max(axis=0)
    widths = steps.reshape(len(STEPS), 2, len(SPREAD))[:, 0, 0, None]
    bent, across = sides[:, 0, 0] + sides[:, 1, 0] - 2 * middle, sides[:, 0, 0] - sides[:, 1, 0]
    alike = _constant(across), _constant(bent / widths)
    sizes = np.abs(across[-1]), np.abs(bent[0])
    broken = lambda least: any(bool((same & (size > ABOVE * least)).any()) for same, size in zip(alike, sizes, strict=True))
    return broken(rounding) and broken(rounding + _noise(point, k, steps[0]))


def _noise(point: OperatingPoint, k: int, step: float) -> np.ndarray:
    """Change of the balance by data that differ in their last digit, on both sides of the value of entry k."""
    stream = np.random.default_rng(0)
    result = []
    for way in (step, -step):
        moved = np.concatenate([point.x, point.inputs])
        moved[k] += way
        side = point.at(x=moved[:len(point.x)], inputs=moved[len(point.x):])
        result.append(np.ptp([rounded(side, stream).balance for _ in range(SAMPLES)], axis=0))
    return np.max(result, axis=0)  # type: ignore[no-any-return]


def _constant(rows: np.ndarray) -> np.ndarray:
    """Mask of the columns that are the same in all rows, but for a part."""
    result: np.ndarray = np.ptp(rows, axis=0) <= SAME * np.abs(rows).max(axis=0)
    return result
