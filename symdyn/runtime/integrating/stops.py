"""Why a run stopped early, in a sentence: when, where, and what is to blame."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symdyn.backend.metadata import Metadata
from symdyn.errors import EvaluationError
from symdyn.runtime.constraints import names, rank, scaled_jacobian
from symdyn.runtime.integrating.charts import at_lock

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


def nearly_singular(module: Module, t: float, x: np.ndarray, p: np.ndarray) -> str:
    """Addition to a message where a step became too small: whether the mass matrix is to blame, and along which speeds."""
    locked = at_lock(module, x)
    if "mass_matrix" not in module.functions or not module.metadata.u or names(module):
        return locked  # under constraints a singular mass matrix is nothing special
    try:
        M = module.evaluate("mass_matrix", t, x, p)
    except EvaluationError:
        return locked
    scale = np.sqrt(np.maximum(np.diagonal(M), 1e-300))
    values, vectors = np.linalg.eigh(M / np.outer(scale, scale))
    if values[0] > 1e-8 * values[-1]:
        return locked
    share = np.abs(vectors[:, 0])
    along = [name for name, s in zip(module.metadata.u, share, strict=True) if s > share.max() / 2]
    return f"; the mass matrix is nearly singular there, along {', '.join(along)}{locked}"


def lost_rank(module: Module, t: float, x: np.ndarray, p: np.ndarray, x0: np.ndarray, t0: float) -> str:
    """Addition to a message where a run stopped: whether constraints depend on each other there, unlike at the start."""
    if not names(module) or not np.isfinite(x).all():
        return ""
    try:
        J = scaled_jacobian(module, t, x, p)
        before = int(rank(module, t0, x0, p))
        usual = float(np.linalg.norm(scaled_jacobian(module, t0, x0, p), 2))
    except (EvaluationError, np.linalg.LinAlgError):
        return ""
    U, values, _ = np.linalg.svd(J)
    small = 1e-4 * max(values[0], usual)
    now = int((values > small).sum())
    if now >= before:
        return ""
    share = np.abs(U[:, now:before]).max(axis=1)
    among = np.flatnonzero(share > 0.1 * share.max())
    flat = np.linalg.norm(J[among], axis=1) <= small
    if len(among) - int(flat.sum()) < 2:  # one alone depends on no other
        flat[:] = True
    vanishing, tied = ([names(module)[k] for k in rows] for rows in (among[flat], among[~flat]))
    parts = []
    if vanishing:
        parts.append(f"the gradient of {vanishing[0]} nearly vanishes" if len(vanishing) == 1 else
                     f"the gradients of {', '.join(vanishing)} nearly vanish")
    if tied:
        parts.append(f"{', '.join(tied)} nearly depend on each other")
    return f"; the constraints nearly lose rank there ({now} instead of {before}): {'; '.join(parts)}"


def describe_stop(metadata: Metadata, t: float, x: np.ndarray, reason: str) -> str:
    """When, where and why a run stopped."""
    state = ", ".join(f"{n} = {v:.6g}" for n, v in zip(metadata.x, x, strict=False))
    return f"{metadata.name}: stopped at t = {t:.9g}: {reason}; the state there: {state}"


def with_last(t: np.ndarray, x: np.ndarray, t_here: float, x_here: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The rows stored so far, and the state where the run stopped, if it is further."""
    if not np.isfinite(x_here).all() or (len(t) and t[-1] == t_here):
        return t, x
    return np.append(t, t_here), np.vstack([x, x_here]) if len(x) else x_here[None, :].copy()
