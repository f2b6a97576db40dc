"""A mechanism as lines over time, in the axes that are shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symdyn.runtime.pictures.points import points_of
from symdyn.runtime.pictures.skeleton import bare_skeleton, make_skeleton

if TYPE_CHECKING:
    from symdyn.runtime.solution import Solution

_LEFT_OUT = 1e-9


@dataclass(frozen=True)
class Drawing:
    """A mechanism as lines over time, in the axes that are shown.

    lines      of each body, (n_t, n_points, 2 or 3); NaN where the pen is lifted
    arms       from each body's origin to its centre of mass, joined in one line; rails: from slider to slider
    centres    centres of mass (n_t, n_b, 2 or 3); pivots: points that hold the mechanism to the ground, (n, 2 or 3)
    sliders    the bodies that slide; labels: of the axes
    """

    lines: list[np.ndarray]
    arms: np.ndarray
    rails: np.ndarray
    centres: np.ndarray
    pivots: np.ndarray
    sliders: Sequence[int]
    labels: Sequence[str]

    @property
    def spatial(self) -> bool:
        return len(self.labels) == 3

    @classmethod
    def of(cls, solution: Solution) -> Drawing | None:
        """What can be drawn of a motion; None if the module gives no positions, or nothing moves."""
        functions, n_t = solution.module.functions, len(solution.t)
        if "positions" not in functions:
            return None
        centres = solution.module.evaluate("positions", solution.t, solution.x, solution.params, solution.inputs)
        centres = centres.reshape(n_t, -1, 3)
        if not centres.shape[1] or not np.isfinite(centres).all():
            return None
        if "frames" in functions:
            frames = solution.frames.reshape(n_t, -1, 12)
            skeleton = make_skeleton(frames[..., :3], frames[..., 3:].reshape(n_t, -1, 3, 3), centres, _ends(solution))
        else:
            skeleton = bare_skeleton(centres)
        everything = np.concatenate([*[line.reshape(-1, 3) for line in skeleton.lines], centres.reshape(-1, 3),
                                     skeleton.pivots])
        ranges = np.nanmax(everything, axis=0) - np.nanmin(everything, axis=0)
        shown = [k for k in range(3) if ranges[k] > _LEFT_OUT * max(ranges.max(), _LEFT_OUT)]
        if not shown:
            return None
        if len(shown) == 1:
            shown = sorted({*shown, 1 if shown[0] != 1 else 0})
        return cls([line[..., shown] for line in skeleton.lines], skeleton.arms[..., shown], skeleton.rails[..., shown],
                   centres[..., shown], skeleton.pivots[..., shown], skeleton.sliders, ["xyz"[k] for k in shown])

    def at(self, t: np.ndarray, times: np.ndarray) -> Drawing:
        """The drawing at other times, by linear interpolation."""
        order = np.argsort(t)
        right = np.clip(np.searchsorted(t[order], times), 1, len(t) - 1)
        a, b = order[right - 1], order[right]
        w = ((times - t[a]) / (t[b] - t[a]))[:, None, None]
        arms, rails, centres, *lines = [points[a] * (1 - w) + points[b] * w
                                        for points in (self.arms, self.rails, self.centres, *self.lines)]
        return Drawing(lines, arms, rails, centres, self.pivots, self.sliders, self.labels)

    def limits(self) -> np.ndarray:
        """Lower and upper limits of the axes, (2 or 3, 2), the same length in each direction of a plane."""
        points = np.concatenate([*[line.reshape(-1, len(self.labels)) for line in self.lines], self.pivots,
                                 self.centres.reshape(-1, len(self.labels))])
        low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
        longest = (high - low).max()
        half = np.maximum((high - low) / 2, 0.15 * longest) + 0.06 * longest
        return np.column_stack([(low + high) / 2 - half, (low + high) / 2 + half])


def _ends(solution: Solution) -> list[tuple[int, np.ndarray]]:
    """Outputs that are positions on bodies: body, (n_t, 3)."""
    found = []
    for name, point in points_of(solution).items():
        if point.quantity == "position":
            given = solution.outputs[name]
            found.append((point.body, np.pad(given, ((0, 0), (0, 3 - given.shape[1])))))
    return found
