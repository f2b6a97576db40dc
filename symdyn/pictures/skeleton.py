"""The lines of a mechanism whose joints are not known, from its motion alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from symdyn.pictures.joints import GROUND, find_joints


@dataclass(frozen=True)
class Skeleton:
    """Points over time, in space or in a plane.

    lines      of each body, (n_t, n_points, 3); NaN where the pen is lifted
    arms       from each body's first point to its centre of mass, joined in one line; rails: from slider to slider
    pivots     points that hold the mechanism to the ground, (n, 3)
    sliders    the bodies that slide, and which points of their lines do
    """

    lines: list[np.ndarray]
    arms: np.ndarray
    rails: np.ndarray
    pivots: np.ndarray
    sliders: dict[int, list[int]]

    def in_axes(self, shown: Sequence[int]) -> Skeleton:
        """In some axes of the n-frame."""
        axes = list(shown)
        return Skeleton([line[..., axes] for line in self.lines], self.arms[..., axes], self.rails[..., axes],
                        self.pivots[..., axes], self.sliders)

    def at(self, a: np.ndarray, b: np.ndarray, w: np.ndarray) -> Skeleton:
        """At other times: a share w (n, 1, 1) of the way from the times a to the times b."""
        arms, rails, *lines = (points[a] * (1 - w) + points[b] * w for points in (self.arms, self.rails, *self.lines))
        return Skeleton(lines, arms, rails, self.pivots, self.sliders)


def bare_skeleton(centres: np.ndarray) -> Skeleton:
    """Centres of mass alone, (n_t, n_b, 3)."""
    nothing = np.zeros((len(centres), 0, 3))
    return Skeleton([c[:, None] for c in np.moveaxis(centres, 1, 0)], nothing, nothing, np.zeros((0, 3)), {})


def guess_skeleton(origins: np.ndarray, rotations: np.ndarray, centres: np.ndarray,
                  ends: Sequence[tuple[int, np.ndarray]] = ()) -> Skeleton:
    """Lines of the bodies from origins (n_t, n_b, 3), rotations (n_t, n_b, 3, 3) and centres of mass: a tree.

    ends   further points that bodies reach to: body, (n_t, 3)
    """
    n_t, n_b = centres.shape[:2]
    poses = [(origins[:, k], rotations[:, k]) for k in range(n_b)]
    size = extent(origins, centres)
    starts: dict[int, np.ndarray] = {}
    carried: list[list[np.ndarray]] = [[] for _ in range(n_b)]
    rails, pivots = [], []
    sliders: dict[int, list[int]] = {}
    for k, j, point, slides in find_joints(poses, (np.zeros((n_t, 3)), np.broadcast_to(np.eye(3), (n_t, 3, 3))), size):
        if slides:
            sliders[k] = [0]
            rails.append(np.stack([point, poses[k][0]], axis=1))
            continue
        starts[k] = point
        if j == GROUND:
            pivots.append(point[0])
        else:
            carried[j].append(point)
    for k, end in ends:
        carried[k].append(end)
    lines = []
    for k in range(n_b):
        points = [starts[k], origins[:, k]] if k in starts else [origins[:, k]]
        for point in carried[k]:
            points += [point, origins[:, k]]
        lines.append(np.stack(points, axis=1))
    arms = [np.stack([origins[:, k], centres[:, k]], axis=1) for k in range(n_b)]
    for k in range(n_b):
        if not carried[k] and _length(lines[k]) < 1e-6 * size:
            lines[k] = np.stack([origins[:, k], centres[:, k]], axis=1)
    return Skeleton(lines, connect(arms, n_t), connect(rails, n_t), np.array(pivots).reshape(-1, 3), sliders)


def extent(*points: np.ndarray) -> float:
    """Largest distance of points of one kind, (n_t, n, 3) each, m."""
    return float(max(*[np.ptp(p, axis=(0, 1)).max() for p in points], 1e-12))


def connect(parts: Sequence[np.ndarray], n_t: int) -> np.ndarray:
    """Lines (n_t, n, 3) as one, the pen lifted between them."""
    lifted = np.full((n_t, 1, 3), np.nan)
    return np.concatenate([lifted, *[piece for part in parts for piece in (part, lifted)]], axis=1)


def _length(line: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(line, axis=1), axis=2).max(initial=0.0))
