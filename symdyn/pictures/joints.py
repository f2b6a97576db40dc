"""Who carries whom: joints of bodies, found in their motion, where a module does not list them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

GROUND = -1
_SAMPLES = 40


def find_joints(poses: Sequence[tuple], ground: tuple, size: float) -> Iterator[tuple[int, int, np.ndarray, bool]]:
    """Who carries whom: (child, parent, shared point over time, whether the child slides), parents first."""
    waiting, placed = list(range(len(poses))), [GROUND]
    ways: dict[int, list[tuple]] = {k: [] for k in waiting}
    compared = dict.fromkeys(waiting, 0)
    while waiting:
        chosen = None
        for k in waiting:
            for j in placed[compared[k]:]:
                result = _joint(ground if j == GROUND else poses[j], poses[k], size)
                if result is not None:
                    ways[k].insert(0, (j, *result))
            compared[k] = len(placed)
            # A motion can hide who carries whom; the shortest connection is then as true as any.
            best = min(ways[k], key=lambda way: (way[2], way[3]), default=None)
            if best is not None and (chosen is None or not best[2]):
                chosen = (k, *best[:3])
                if not best[2]:
                    break
        if chosen is None:
            return
        waiting.remove(chosen[0])
        placed.append(chosen[0])
        yield chosen


def _joint(parent: tuple, child: tuple, size: float) -> tuple[np.ndarray, bool, float] | None:
    """Where two bodies meet: the shared point over time, whether they slide instead, the length of the connection.

    None if they have no point in common throughout the motion, nor a straight way, nor the axis of a screw.
    """
    n_t = len(parent[0])
    some = np.unique(np.linspace(0, n_t - 1, _SAMPLES).astype(int))
    (O, R), (o, r) = (parent[0][some], parent[1][some]), (child[0][some], child[1][some])
    near, tolerance = 1e-5 * size, 1e-5 * size
    ahead = np.einsum("tji,tj->ti", R, o - O)
    back = np.einsum("tji,tj->ti", r, O - o)
    if np.ptp(ahead, axis=0).max() < near:
        a = ahead[0]
    elif np.ptp(back, axis=0).max() < near:
        return parent[0], False, float(np.linalg.norm(back[0]))
    else:
        solved = np.linalg.lstsq(np.concatenate([R, -r], axis=2).reshape(-1, 6), (o - O).ravel(), rcond=1e-9)[0]
        a, b = solved[:3], solved[3:]
        miss = O + R @ a - o - r @ b
        if np.abs(miss).max() > tolerance:
            way = ahead - ahead.mean(axis=0)
            if np.linalg.svd(way, compute_uv=False)[1] < tolerance or _on_a_screw(ahead, R, r, tolerance):
                return parent[0], True, float(np.linalg.norm(ahead, axis=1).mean())
            return None
    return parent[0] + parent[1] @ a, False, float(np.linalg.norm(a))


def _on_a_screw(ahead: np.ndarray, R: np.ndarray, r: np.ndarray, tolerance: float) -> bool:
    """Whether a child with the origin `ahead`, (n, 3) in the parent's frame, turns about an axis fixed in the parent and
    moves along it: then some points of it stay on that axis."""
    Q = np.einsum("tji,tjk->tik", R, r)
    _, size, axes = np.linalg.svd((Q @ Q[0].T - np.eye(3)).reshape(-1, 3), full_matrices=False)
    if size[1] < 1e-6 or size[2] > 1e-6 * size[1]:
        return False
    across = axes[:2]
    # across (Q b + ahead - a) = 0 for a point b of the child and a of the parent
    left = np.concatenate([across @ Q, np.broadcast_to(-across, (len(Q), 2, 3))], axis=2).reshape(-1, 6)
    right = -(ahead @ across.T).ravel()
    solved = np.linalg.lstsq(left, right, rcond=1e-9)[0]
    return bool(np.abs(left @ solved - right).max() < tolerance)
