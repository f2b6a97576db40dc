"""Bodies that move in the motions that constraints leave: parts on their own, idle rotations, motions without mass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

TOLERANCE = 1e-9


@dataclass(frozen=True)
class Mobility:
    """Places of bodies: parts that move independently, bodies that stand still, idle ones; speeds with motions without mass."""

    parts: tuple[tuple[int, ...], ...]
    still: tuple[int, ...]
    idle: tuple[int, ...]
    massless: tuple[int, ...]


def mobility(free: Sequence[np.ndarray], J: np.ndarray, M: np.ndarray, F: np.ndarray, R: np.ndarray) -> Mobility:
    """At several states: free (n_u, d) directions left, J (s, m n_b, n_u) with m rows a body (the last ones angular),
    M (s, n_u, n_u), F (s, n_u), R (s, n_b, 3, 3) body to inertial components; all speeds as velocities."""
    n = R.shape[1]
    near = np.zeros((n, n), dtype=bool)
    moving = np.zeros(n, dtype=bool)
    axes: list[dict[int, np.ndarray]] = []
    massless: set[int] | None = None
    for Z, jacobian, mass, force in zip(free, J, M, F, strict=True):
        T = jacobian @ Z
        joined, moved = _coupled(T, n)
        near |= joined
        moving |= moved
        axes.append({b: spin for b in range(n) if len(spin := _idle(T, Z, force, b, n))})
        bare = _without_mass(Z, mass)
        massless = bare if massless is None else massless | bare if bare and massless else set()
    idle = [b for b in axes[0] if all(b in result for result in axes) and _same_axes([R[k, b].T @ result[b] if len(result[b]) == 3
            else result[b] for k, result in enumerate(axes)])] if axes else []
    parts = _components(near, [b for b in range(n) if moving[b]])
    return Mobility(parts, tuple(b for b in range(n) if not moving[b]), tuple(idle),
                    tuple(sorted(massless or ())))


def _coupled(T: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Masks of the bodies without motions of their own, and of those that move at all: by the projector on all motions of
    bodies."""
    U, sizes, _ = np.linalg.svd(T, full_matrices=False)
    kept = sizes > TOLERANCE * max(sizes.max(initial=0.0), 1e-300)
    P = U[:, kept] @ U[:, kept].T
    m = len(T) // n if n else 0
    blocks = np.abs(P.reshape(n, m, n, m)).max(axis=(1, 3), initial=0.0)
    return blocks > 1e-8, np.diagonal(blocks) > 1e-8


def _idle(T: np.ndarray, Z: np.ndarray, force: np.ndarray, b: int, n: int) -> np.ndarray:
    """Orthonormal axes (3, k), planar (1, k), about which body b can turn with its centre of mass and all other bodies standing
    still, and no load acting along; (0, 0) if there are none."""
    none = np.zeros((0, 0))
    if not T.size:
        return none
    m = len(T) // n
    linear = m - 1 if m == 3 else 3
    turning = np.zeros(len(T), dtype=bool)
    turning[b * m + linear:(b + 1) * m] = True
    size = np.abs(T).max()
    alone = _null(T[~turning], max(size, 1e-300))
    if not alone.shape[1] or np.abs(force @ Z @ alone).max() > TOLERANCE * max(np.abs(force).max(), 1e-300):
        return none
    U, sizes, _ = np.linalg.svd(T[turning] @ alone, full_matrices=False)
    kept = sizes > 1e-8 * size
    return U[:, kept] if kept.any() else none


def _same_axes(axes: list[np.ndarray]) -> bool:
    """Whether the axes (3, k), in the body's own components, are the same at all states."""
    first = axes[0]
    return all(a.shape == first.shape and np.abs(a @ a.T - first @ first.T).max() < 1e-6 for a in axes)


def _null(A: np.ndarray, size: float) -> np.ndarray:
    _, sizes, Vt = np.linalg.svd(A)
    return Vt[int((sizes > TOLERANCE * size).sum()):].T  # type: ignore[no-any-return]


def _without_mass(Z: np.ndarray, M: np.ndarray) -> set[int]:
    """Speeds that take part in a motion without mass."""
    if not Z.shape[1]:
        return set()
    values, vectors = np.linalg.eigh(Z.T @ M @ Z)
    null = np.abs(values) <= TOLERANCE * max(np.abs(M).max(), 1e-300)
    entries = np.abs(Z @ vectors[:, null]).max(axis=1, initial=0.0)
    return {int(j) for j in np.flatnonzero(entries > 1e-6)}


def _components(near: np.ndarray, bodies: list[int]) -> tuple[tuple[int, ...], ...]:
    left, parts = list(bodies), []
    while left:
        part = [left.pop(0)]
        for b in part:
            for other in list(left):
                if near[b, other]:
                    left.remove(other)
                    part.append(other)
        parts.append(tuple(sorted(part)))
    return tuple(parts)
