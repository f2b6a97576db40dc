"""States where constraints lose rank along the motions that they allow from a state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from symdyn.formulation.constraints.consistent_states import FULFILLED, AtStates, ConstraintStates

STEP = 0.05
# Motions that are followed, each both ways.
MOTIONS = 6
# Singular values below this part are reported; below the second one rank counts as lost.
NEAR, LOST = 1e-2, 1e-5
ZOOMS, POINTS = 6, 17


@dataclass(frozen=True)
class Scaled:
    """The Jacobian as numbers: rows by fixed scales (n_c,), columns as parts of the length, all by `size`; rank: elsewhere."""

    states: ConstraintStates
    rows: np.ndarray
    size: float
    rank: int

    def at(self, q: np.ndarray) -> tuple[np.ndarray, AtStates]:
        """(s, n_c, n_u), and what it was made from."""
        result = self.states.at(q)
        return self.of(result), result

    def of(self, result: AtStates) -> np.ndarray:
        D = np.where(self.states.angular[None, None, :], result.length[:, None, None], 1.0)
        scaled: np.ndarray = result.C_r.dense() * self.rows[None, :, None] / D / self.size
        return scaled

    def smallest(self, q: np.ndarray) -> np.ndarray:
        """The smallest singular value that is not zero elsewhere, (s,); inf where constraints are not defined."""
        A, _ = self.at(q)
        defined = np.isfinite(A).all(axis=(1, 2))
        sizes = np.full(len(q), np.inf)
        if defined.any():
            sizes[defined] = np.linalg.svd(A[defined], compute_uv=False)[:, self.rank - 1]
        return sizes


@dataclass(frozen=True)
class Near:
    """A state q (n_q,) with a small singular value, at a distance along a motion."""

    q: np.ndarray
    size: float
    distance: float


def follow(scaled: Scaled, q: np.ndarray, reach: float) -> tuple[list[Near], float]:
    """The states with small singular values up to `reach` from q (n_q,), and the largest distance that a motion could go."""
    A, _ = scaled.at(q[None])
    free = np.linalg.svd(A[0])[2][scaled.rank:][:MOTIONS]
    ways = np.concatenate([free, -free])
    if not len(ways):
        return [], 0.0
    here = np.repeat(q[None], len(ways), axis=0)
    ways = ways / np.abs(ways).max(axis=1, keepdims=True)
    trails = [_Trail(here[k], ways[k], scaled.smallest(q[None])[0]) for k in range(len(ways))]
    result: list[Near] = []
    for _ in range(round(reach / STEP)):
        live = [t for t in trails if not t.ended]
        if not live:
            break
        _advance(scaled, live)
        for trail in live:
            if trail.passed_a_minimum():
                near = _refined(scaled, trail)
                if near.size < NEAR:
                    result.append(near)
    return _distinct(result), max(len(t.q) - 1 for t in trails) * STEP


class _Trail:
    """One motion: states, directions (n_u,) at each, smallest singular values."""

    def __init__(self, q: np.ndarray, way: np.ndarray, size: float) -> None:
        self.q, self.ways, self.sizes = [q], [way], [size]
        self.ended = False

    def passed_a_minimum(self) -> bool:
        s = self.sizes
        if self.ended:
            return True
        return len(s) > 2 and s[-3] >= s[-2] < s[-1]


def _advance(scaled: Scaled, live: list[_Trail]) -> None:
    """One step of each motion; a motion ends where no step along it stays on the constraints."""
    q = np.array([t.q[-1] for t in live])
    A, result = scaled.at(q)
    free = np.linalg.svd(A)[2][:, scaled.rank:]
    ways = np.array([t.ways[-1] for t in live])
    ways = (np.swapaxes(free, 1, 2) @ (free @ ways[..., None]))[..., 0]
    sizes = np.abs(ways).max(axis=1, keepdims=True)
    ways = ways / np.where(sizes > 0, sizes, 1.0)
    wanted = STEP * scaled.states.moved(result, ways)
    moved, residual = scaled.states.nearest(q + wanted)
    smallest = scaled.smallest(moved)
    for k, trail in enumerate(live):
        asked, gone = np.linalg.norm(wanted[k]), np.linalg.norm(moved[k] - q[k])
        if residual[k] > 10 * FULFILLED or not 0.3 * asked < gone < 3 * asked or not np.isfinite(smallest[k]):
            trail.ended = True
            trail.ways[-1] = ways[k]
            continue
        trail.q.append(moved[k])
        trail.ways[-1] = ways[k]
        trail.ways.append(ways[k])
        trail.sizes.append(float(smallest[k]))


def _refined(scaled: Scaled, trail: _Trail) -> Near:
    """The least singular value around the last state but one of a motion; at its end, around the last."""
    start = max(len(trail.q) - (2 if trail.ended else 3), 0)
    q, way = trail.q[start], trail.ways[start]
    _, result = scaled.at(q[None])
    along = scaled.states.moved(result, way[None])[0]
    low, high = 0.0, 2 * STEP
    best = Near(trail.q[start], trail.sizes[start], start * STEP)
    for _ in range(ZOOMS):
        h = np.linspace(low, high, POINTS)
        states, residual = scaled.states.nearest(q + h[:, None] * along)
        sizes = np.where(residual < 10 * FULFILLED, scaled.smallest(states), np.inf)
        k = int(np.argmin(sizes))
        if sizes[k] < best.size:
            best = Near(states[k], float(sizes[k]), start * STEP + float(h[k]))
        width = (high - low) / (POINTS - 1)
        low, high = max(h[k] - width, 0.0), h[k] + width
    return best


def _distinct(result: list[Near]) -> list[Near]:
    kept: list[Near] = []
    for near in sorted(result, key=lambda n: n.size):
        if all(np.abs(near.q - other.q).max() > 1e-3 for other in kept):
            kept.append(near)
    return sorted(kept, key=lambda n: n.distance)
