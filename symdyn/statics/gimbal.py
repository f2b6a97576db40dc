"""Gimbal lock: where three angles of an orientation move a body about two axes only.

Forces along the angles are then no longer all that act, and may balance where the body does not: with B of q' -> angular
velocity, forces along the angles are B^T times the moment, which vanishes along the axis that is lost.
"""

from __future__ import annotations

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError
from symdyn.statics.terms import OperatingPoint
from symdyn.turning import in_radians

REMEDY = ("use Euler parameters (orientation='parameters' of a catalogued system, orientation=EulerParameters() of a joint), or "
          "another order of the angles")
# Independence of the coordinates below this part of that of turned ones is lost.
LOST = 1e-8
# Angles are turned by so much for comparison, rad.
TURN = 0.4


def lock(point: OperatingPoint) -> str:
    """The coordinate whose value brings gimbal lock, as "theta = 90 deg"; "" where there is none."""
    metadata = point.module.metadata
    angles = [k for k, n in enumerate(metadata.q) if in_radians(metadata.units.get(n))]
    if not angles:
        return ""
    here = independence(point)
    if here > LOST:
        return ""
    turned = [independence(point.at(x=_turned(point.x, k))) for k in angles]
    if max(turned) * LOST <= here:
        return ""
    name = metadata.q[angles[int(np.argmax(turned))]]
    return f"{name} = {np.degrees(point.q[metadata.q.index(name)]):.6g} deg"


def demand_no_lock(point: OperatingPoint, what: str) -> None:
    """Raises ArgumentError at gimbal lock; what: the request, as "modes were"."""
    locked = lock(point)
    if locked:
        raise ArgumentError(f"{point.module.name}: {what} requested at gimbal lock: {locked}; small changes of its angles do not "
                            f"give all small motions there; {REMEDY}")


def independence(point: OperatingPoint) -> float:
    """Independence of the motions that coordinates bring about, from 0 to 1: by the mass matrix scaled to a diagonal of ones,
    without what has no mass, and by the reciprocal condition of N with unit columns."""
    try:
        M, N = point.evaluate("mass_matrix"), point.evaluate("N")
    except EvaluationError:
        return 0.0
    masses = np.diag(M)
    heavy = masses > 1e-12 * masses.max(initial=0.0)
    scale = 1 / np.sqrt(masses[heavy])
    least = float(np.linalg.eigvalsh(M[np.ix_(heavy, heavy)] * np.outer(scale, scale))[0]) if heavy.any() else 1.0
    sizes = np.linalg.norm(N, axis=0)
    if not np.isfinite(N).all() or not sizes.all():
        return 0.0
    values = np.linalg.svd(N / sizes, compute_uv=False)
    return max(0.0, min(least, float(values[-1] / max(1.0, sizes.max()))))


def _turned(x: np.ndarray, k: int) -> np.ndarray:
    x = x.copy()
    x[k] += TURN
    return x
