"""The manifold of the constraints in numbers: states on it, and how many displacements and speeds are independent.

Nothing here uses symdyn.statics or symdyn.runtime.consistent, so that what these give can be compared with it.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import scipy.linalg

# Singular values below this part of the largest belong to rows that depend on others.
DEPENDENT = 1e-9
# Newton's method ends where a step is rounding, or small and not much shorter than the one before; more than FAR is a failure.
STEPS, ROUNDING, FAR = 15, 2e-16, 1e-9


class OffConstraints(RuntimeError):
    """No state on the constraints was found."""


def ranks(module: Any, t: float, x: np.ndarray, p: np.ndarray, least: float = 0.0, error: type[Exception] = ValueError
          ) -> tuple[int, int, np.ndarray]:
    """Rank of the rows that bind displacements, rank of all rows, and velocities (n_u, n) that all rows allow.

    Raises `error` if a singular value lies between those of dependent rows and `least` times the largest.
    """
    C_r = module.evaluate("C_r", t, x, p)
    result = []
    for rows in (C_r[holonomic(module)], C_r):
        sizes = np.linalg.norm(rows, axis=1, keepdims=True)
        rows = rows / np.where(sizes > 0, sizes, 1.0)
        _, values, Vt = np.linalg.svd(rows)
        first = values.max(initial=0.0)
        rank = int((values > DEPENDENT * first).sum())
        if rank and values[rank - 1] < least * first:
            raise error(f"constraints are nearly dependent: {values[rank - 1] / first:.2g}")
        result.append((rank, Vt[rank:].T))
    return result[0][0], result[1][0], result[1][1]


def holonomic(module: Any) -> np.ndarray:
    """Mask of the rows that bind displacements, (n_c,) of bool."""
    metadata = module.metadata
    return np.array(metadata.holonomic or [True] * len(metadata.constraints), dtype=bool)


def consistent_state(module: Any, t: float, x: np.ndarray, p: np.ndarray, at: np.ndarray | None = None) -> np.ndarray:
    """The state on the constraints nearest to x (n_x,), to rounding; at: see `onto`, default x."""
    everything = range(module.metadata.sizes.u)
    return onto(module, t, x[None], p, everything, everything, x if at is None else at)[0]


def onto(module: Any, t: float, x: np.ndarray, p: np.ndarray, displacements: Iterable[int], speeds: Iterable[int],
         at: np.ndarray) -> np.ndarray:
    """States x (n, n_x) moved onto the constraints along the velocities `displacements`, and by changes of the speeds `speeds`,
    both by number; Newton's method, with the smallest steps where there is a choice.

    at   (n_x,) a state nearby on the constraints, where it is decided which rows are independent: off the constraints others may
         seem so
    Raises OffConstraints if it does not converge, or if other rows do not follow.
    """
    metadata = module.metadata
    n_q = metadata.sizes.q
    displacements, speeds = list(displacements), list(speeds)
    x = normalised(module, x.copy())
    if not metadata.constraints:
        return x
    C_r = module.evaluate("C_r", t, at, p)
    rows = np.flatnonzero(holonomic(module))
    rows = rows[_independent(C_r[rows])]
    before = np.inf
    for _ in range(STEPS if len(rows) and displacements else 0):
        J = module.evaluate("C_r", t, x, p)[:, rows][:, :, displacements]
        step = -_solve(J, module.evaluate("C", t, x, p)[:, rows])
        N = module.evaluate("N", t, x, p)[:, :, displacements]
        x[:, :n_q] += np.einsum("nij,nj->ni", N, step)
        x = normalised(module, x)
        size = float(np.abs(step).max(initial=0.0))
        if size <= ROUNDING or (size <= FAR and size > before / 4):
            break
        before = size
    all_rows = _independent(C_r)
    for _ in range(2 if speeds else 0):
        J = module.evaluate("C_r", t, x, p)[:, all_rows][:, :, speeds]
        x[:, [n_q + k for k in speeds]] -= _solve(J, module.evaluate("C_dot", t, x, p)[:, all_rows])
    left = max(float(np.abs(module.evaluate(name, t, x, p)).max(initial=0.0)) for name in ("C", "C_dot"))
    if not left <= FAR:
        raise OffConstraints(f"{module.name}: no state on the constraints nearby; they are violated by {left:.2g}")
    return x


def _independent(rows: np.ndarray) -> np.ndarray:
    """Numbers of rows of full rank, (rank,)."""
    if not rows.size:
        return np.zeros(0, dtype=int)
    _, R, order = scipy.linalg.qr(rows.T, mode="economic", pivoting=True)
    sizes = np.abs(np.diag(R))
    return np.sort(order[:int((sizes > DEPENDENT * sizes.max(initial=0.0)).sum())])


def normalised(module: Any, x: np.ndarray) -> np.ndarray:
    """The states (n, n_x) with Euler parameters of length 1."""
    for group in module.metadata.unit_groups:
        columns = [module.metadata.x.index(name) for name in group]
        x[:, columns] /= np.linalg.norm(x[:, columns], axis=1, keepdims=True)
    return x


def _solve(J: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The smallest solutions (n, k) of J (n, m, k) y = right (n, m)."""
    return np.einsum("nij,nj->ni", np.linalg.pinv(J, rcond=DEPENDENT), right)
