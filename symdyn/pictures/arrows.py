"""Contacts in pictures: where bodies touch, and the forces there as arrows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

POINTS = "contact_points"
# Length of the arrow of a usual force, of the extent of the picture; longer ones are cut at so many times that.
LENGTH, LONGEST = 0.22, 2.0
# Length of the head of an arrow, of the arrow, and half its width.
HEAD, WIDTH = 0.25, 0.11


def touching(solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Where contacts touch and the forces on their bodies a, (n_t, n_c, 3), n-frame; NaN while nothing is transmitted."""
    if POINTS not in solution.module.functions:
        none = np.full((len(solution.t), 0, 3), np.nan)
        return none, none
    rows = solution.rows(POINTS).reshape(len(solution.t), -1, 2, 3)
    at, forces = rows[:, :, 0].copy(), rows[:, :, 1].copy()
    idle = ~(np.linalg.norm(forces, axis=2) > 0)
    at[idle] = forces[idle] = np.nan
    return at, forces


def names_of(solution: Solution) -> list[str]:
    """What the contacts in `touching` are called."""
    about, count = solution.module.metadata, solution.module.shape(POINTS)[0] // 6
    names = [*(record.name for record in about.contacts), *(record.name for record in about.compliant)]
    return names if len(names) == count else [f"contact {k + 1}" for k in range(count)]


def usual(forces: np.ndarray) -> float:
    """The median size of forces (n_t, n_c, 3), N; zero without any."""
    sizes = np.linalg.norm(forces, axis=2)
    there = sizes[np.isfinite(sizes) & (sizes > 0)]
    return float(np.median(there)) if len(there) else 0.0


def floor_of(at: np.ndarray, up: np.ndarray, near: float) -> float | None:
    """How high the flat ground is on which all contacts touch that do; None where they touch at several heights."""
    heights = (at @ up)[np.isfinite(at).all(axis=2)]
    return float(np.median(heights)) if len(heights) and np.ptp(heights) <= near else None


def arrow_scale(forces: np.ndarray, extent: float) -> np.ndarray:
    """Lengths of arrows by forces (n_t, n_c, 2 or 3), m/N: the median force has LENGTH of the extent."""
    sizes, middle = np.linalg.norm(forces, axis=2), usual(forces)
    if not middle:
        return np.zeros((1, 1, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        return (LENGTH * extent * np.minimum(1 / middle, LONGEST / sizes))[:, :, None]


def arrows(tails: np.ndarray, tips: np.ndarray) -> np.ndarray:
    """Arrows as one curve, (n, 2 or 3), lifted between them; from tails to tips (n_c, 2 or 3)."""
    n = tails.shape[-1]
    way = tips - tails
    length = np.linalg.norm(way, axis=1, keepdims=True)
    if n == 2:
        sides = [way[:, ::-1] * [-1, 1]]
    else:  # a head in two planes is seen from everywhere
        first = np.cross(way, np.where(np.abs(way[:, 2:]) > 0.9 * length, [[1.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]]))
        first *= length / np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-300)
        sides = [first, np.cross(way, first) / np.maximum(length, 1e-300)]
    barbs = [end for side in sides for sign in (1, -1) for end in (tips - HEAD * way + sign * WIDTH * side, tips)]
    return np.stack([tails, tips, *barbs, np.full_like(tails, np.nan)], axis=1).reshape(-1, n)
