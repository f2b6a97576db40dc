"""Facts about a state of a module with constraints: residuals by name, rank of the Jacobian, uniqueness of multipliers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.tape.intrinsics import RANK
from symdyn.turning import is_angle, turns

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Residuals up to this part of the mechanism's length, and of its speed, are projected away; larger ones are a mistake.
CONSISTENT = 1e-6


def names(module: Module) -> list[str]:
    """Names of the constraint rows, (n_c,)."""
    return list(module.metadata.constraints)


def length(module: Module, params: Any) -> float:
    """The mechanism's length, m."""
    module.library("rhs")  # it is there, too
    return float(module.evaluate("length", 0.0, np.zeros(module.metadata.sizes.x), params))


def turning(module: Module) -> np.ndarray:
    """For every speed whether it is an angular velocity or has no length in it, (n_u,)."""
    return np.array([turns(module.metadata.units.get(u)) for u in module.metadata.u], dtype=bool)


def as_velocities(module: Module, params: Any) -> np.ndarray:
    """Factors that make velocities (m/s) of all speeds, (n_u,): the mechanism's length for angular ones."""
    return np.where(turning(module), length(module, params), 1.0)


def position_residual(module: Module, t: Any, x: Any, params: Any) -> np.ndarray:
    """C C_scale / length, (..., n_c)."""
    return _violation(module, t, x, params)[0] / length(module, params)


def velocity_residual(module: Module, t: Any, x: Any, params: Any, at_least: float = 0.0, each: bool = False) -> np.ndarray:
    """C_dot C_scale / (the largest speed of all states, or of each alone, at least `at_least`, m/s), (..., n_c).

    A speed is |u_j|, times the mechanism's length if it is in rad/s, or that with which the constraints move by themselves.
    """
    n_q, n_u = module.metadata.sizes.q, module.metadata.sizes.u
    still = np.array(x, dtype=float)
    u = np.array(still[..., n_q:n_q + n_u])
    still[..., n_q:n_q + n_u] = 0.0
    axis = -1 if each else None
    moving = np.abs(_violation(module, t, still, params)[1]).max(axis=axis, initial=at_least, keepdims=True)
    speed = np.maximum(moving, np.abs(u * as_velocities(module, params)).max(axis=axis, initial=0.0, keepdims=True))
    return _violation(module, t, x, params)[1] / np.maximum(speed, np.finfo(float).tiny)


def _violation(module: Module, t: Any, x: Any, params: Any) -> tuple[np.ndarray, np.ndarray]:
    """C C_scale, m, and C_dot C_scale, m/s, each (..., n_c)."""
    module.library("rhs")  # it is there, too
    rows, n_c = module.evaluate("violation", t, x, params), len(names(module))
    return rows[..., :n_c], rows[..., n_c:]


def scaled_jacobian(module: Module, t: Any, x: Any, params: Any) -> np.ndarray:
    """C_scale C_r, columns of angular velocities divided by the mechanism's length: all entries are numbers, (..., n_c, n_u)."""
    rows = module.evaluate("C_r", t, x, params) * module.evaluate("C_scale", t, x, params)[..., None]
    return rows / as_velocities(module, params)


def rank(module: Module, t: Any, x: Any, params: Any, tolerance: float = RANK) -> np.ndarray:
    """Rank of the scaled Jacobian, (...)."""
    if not names(module):
        return np.zeros(np.shape(x)[:-1], dtype=int)
    values = np.linalg.svd(scaled_jacobian(module, t, x, params), compute_uv=False)
    return counted(values, tolerance).sum(axis=-1)


def counted(values: np.ndarray, tolerance: float = RANK) -> np.ndarray:
    """Mask of the singular values (..., k), the largest first, that are not zero; a Jacobian that vanishes as a whole has
    none."""
    result: np.ndarray = values > tolerance * np.maximum(values[..., :1], 1)
    return result


def derivatives(module: Module, of: str, t: float, x: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of C or C_dot, as `of` says, by the state and by the parameters: (n_c, n_x), (n_c, n_p)."""
    result = module.jacobian(t, x, p, wrt=["x", "params"], of=of)
    assert result.x is not None and result.params is not None
    return result.x, result.params


def holding(module: Module, t: float, x: np.ndarray, p: np.ndarray, parameters: Sequence[str]) -> list[str]:
    """Parameters that dependent constraints do not allow to change: no dx fulfils C_q dq + C_p dp = 0 and the same of C_dot."""
    n_c, n_q = len(names(module)), module.metadata.sizes.q
    if not n_c or not parameters or int(rank(module, t, x, p)) == n_c:
        return []
    scale = module.evaluate("C_scale", t, x, p)[:, None]
    (C_x, C_p), (C_dot_x, C_dot_p) = (derivatives(module, of, t, x, p) for of in ("C", "C_dot"))
    holonomic = np.array(module.metadata.holonomic or [True] * n_c, dtype=bool)
    rows = np.vstack([(scale * C_x)[holonomic], scale * C_dot_x])
    units = np.concatenate([np.where([is_angle(module.metadata.units.get(q)) for q in module.metadata.q], length(module, p), 1.0),
                            as_velocities(module, p), np.ones(len(x) - n_q - module.metadata.sizes.u)])
    held = []
    for name in parameters:
        k = module.metadata.parameters.index(name)
        by = np.concatenate([(scale * C_p)[holonomic, k], (scale * C_dot_p)[:, k]])
        change = np.linalg.lstsq(rows / units, -by, rcond=RANK)[0]
        if np.abs(rows / units @ change + by).max() > 1e-6 * np.abs(by).max():
            held.append(name)
    return held


def unique(module: Module, t: Any, x: Any, params: Any) -> np.ndarray:
    """Mask of the unique multipliers, (..., n_c) of bool.

    C_r^T lam fixes lam up to the kernel of C_r^T; where that has no part along a row, its multiplier is unique: its row of
    the left singular vectors of the range then has the norm 1.
    """
    if not names(module):
        return np.zeros((*np.shape(x)[:-1], 0), dtype=bool)
    U, values, _ = np.linalg.svd(scaled_jacobian(module, t, x, params), full_matrices=False)
    kept = counted(values)
    squares: np.ndarray = (U**2 * kept[..., None, :]).sum(axis=-1)
    return squares > 1 - 1e-6


def undetermined(module: Module, t: Any, x: Any, params: Any) -> np.ndarray:
    """Combinations of multipliers that make no force along the speeds, as columns, (..., n_c, n_c); zero columns for the rest."""
    U, values, _ = np.linalg.svd(scaled_jacobian(module, t, x, params))
    kept = np.zeros(U.shape[:-1], dtype=bool)
    kept[..., :values.shape[-1]] = counted(values)
    scale = module.evaluate("C_scale", t, x, params)
    free: np.ndarray = scale[..., :, None] * U * ~kept[..., None, :]
    return free


def listed(module: Module, residual: np.ndarray, at_least: float) -> str:
    """The constraints whose residual is larger, the largest first."""
    order = [k for k in np.argsort(-np.abs(residual), kind="stable") if abs(residual[k]) > at_least]
    known = names(module)
    return ", ".join(f"{known[k]} by {residual[k]:.3g}" for k in order)
