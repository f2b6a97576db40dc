"""A mechanism as lines and shapes over time, in the axes that are shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from symdyn.pictures.arrows import arrow_scale, floor_of, touching
from symdyn.pictures.jointed import carriers, jointed_skeleton, placed_joints
from symdyn.pictures.looks import up_of
from symdyn.pictures.points import points_of
from symdyn.pictures.skeleton import Skeleton, bare_skeleton, connect, guess_skeleton
from symdyn.pictures.solids import Solids

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

_LEFT_OUT = 1e-9
# Contacts at heights that differ by less touch a flat ground; of how far all goes.
_FLAT = 1e-3


@dataclass(frozen=True)
class Drawing:
    """A mechanism as lines and shapes over time, in the axes that are shown.

    lines      of each body, (n_t, n_points, 2 or 3); NaN where the pen is lifted, and for bodies that have shapes of the user's
    arms       from each body's first point to its centre of mass, joined in one line; rails: from slider to slider;
               rods: massless ones between two bodies
    centres    centres of mass (n_t, n_b, 2 or 3); pivots: points that hold the mechanism to the ground, (n, 2 or 3)
    sliders    the bodies that slide, and which points of their lines do; labels: of the axes
    solids     shapes, if there are any; bare: the bodies without
    touches    where contacts touch, (n_t, n_c, 2 or 3), NaN while they do not; pushes: the ends of the arrows of their forces
    up         the direction that is above; ground: how high the flat ground is on which contacts touch, if they do
    """

    lines: list[np.ndarray]
    arms: np.ndarray
    rails: np.ndarray
    rods: np.ndarray
    centres: np.ndarray
    pivots: np.ndarray
    sliders: Mapping[int, Sequence[int]]
    labels: Sequence[str]
    solids: Solids | None
    bare: Sequence[int]
    touches: np.ndarray
    pushes: np.ndarray
    up: tuple[float, float, float]
    ground: float | None

    @property
    def sticks(self) -> bool:
        """Whether lines are drawn: joints that are not listed have no look of their own."""
        return self.solids is None or self.solids.forms is None

    @property
    def axes(self) -> list[int]:
        """Which axes of the n-frame are shown."""
        return ["xyz".index(label) for label in self.labels]

    @property
    def spatial(self) -> bool:
        return len(self.labels) == 3

    @classmethod
    def of(cls, solution: Solution) -> Drawing | None:
        """What can be drawn of a motion; None if the module gives no positions, or nothing moves."""
        if "positions" not in solution.module.functions:
            return None
        centres = solution.rows("positions").reshape(len(solution.t), -1, 3)
        if not centres.shape[1] or not np.isfinite(centres).all():
            return None
        skeleton, kept = _skeleton(solution, centres)
        centres = centres[:, kept]
        solids = Solids.of(solution)
        tips = {record["tip"] for record in solution.module.metadata.flexible}
        bare = [k for k, body in enumerate(kept) if solids is None or (
            body not in solids.bodies and solution.module.metadata.bodies[body] not in tips)]
        if solids is not None:
            skeleton = _without(skeleton, bare)
        touches, forces = touching(solution)
        where = touches
        everything = np.concatenate([*[line.reshape(-1, 3) for line in skeleton.lines], centres.reshape(-1, 3),
                                     touches.reshape(-1, 3), skeleton.pivots,
                                     solids.reach() if solids is not None and solids.own else np.zeros((0, 3))])
        ranges = np.nanmax(everything, axis=0) - np.nanmin(everything, axis=0)
        shown = [k for k in range(3) if ranges[k] > _LEFT_OUT * max(ranges.max(), _LEFT_OUT)]
        # What moves in a plane is seen from the front.
        if solids is not None and (solids.own or len(shown) != 2 or solution.module.metadata.planar):
            shown = [0, 1] if solution.module.metadata.planar else [0, 1, 2]
        if not shown:
            return None
        if len(shown) == 1:
            shown = sorted({*shown, 1 if shown[0] != 1 else 0})
        arms, rails, rods, centres, pivots, touches, forces, *lines = [points[..., shown] for points in (
            skeleton.arms, skeleton.rails, skeleton.rods, centres, skeleton.pivots, touches, forces, *skeleton.lines)]
        pushes = touches + forces * arrow_scale(forces, float(ranges.max()))
        about = solution.module.metadata
        up = up_of(about.down, about.planar)
        ground = floor_of(where, np.array(up), _FLAT * float(ranges.max()))
        return cls(lines, arms, rails, rods, centres, pivots, skeleton.sliders, ["xyz"[k] for k in shown], solids, bare, touches,
                   pushes, up, ground)

    def at(self, t: np.ndarray, times: np.ndarray) -> Drawing:
        """The drawing at other times, by linear interpolation."""
        order = np.argsort(t)
        right = np.clip(np.searchsorted(t[order], times), 1, len(t) - 1)
        a, b = order[right - 1], order[right]
        w = ((times - t[a]) / (t[b] - t[a]))[:, None, None]
        arms, rails, rods, centres, touches, pushes, *lines = [
            points[a] * (1 - w) + points[b] * w for points in
            (self.arms, self.rails, self.rods, self.centres, self.touches, self.pushes, *self.lines)]
        solids = None if self.solids is None else self.solids.at(t, times)
        return replace(self, lines=lines, arms=arms, rails=rails, rods=rods, centres=centres, solids=solids, touches=touches,
                       pushes=pushes)

    def limits(self) -> np.ndarray:
        """Lower and upper limits of the axes, (2 or 3, 2), the same length in each direction of a plane."""
        reach = self.solids.reach() if self.solids is not None else np.zeros((0, 3))
        points = np.concatenate([*[line.reshape(-1, len(self.labels)) for line in self.lines], self.pivots,
                                 *[part.reshape(-1, len(self.labels)) for part in (self.touches, self.pushes)],
                                 self.centres.reshape(-1, len(self.labels)), reach[:, self.axes]])
        low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
        longest = (high - low).max()
        half = np.maximum((high - low) / 2, 0.15 * longest) + 0.06 * longest
        return np.column_stack([(low + high) / 2 - half, (low + high) / 2 + half])


def _without(skeleton: Skeleton, bare: Sequence[int]) -> Skeleton:
    """The lines of the bodies that have no shapes; others keep their place, with nothing to draw."""
    n_t = len(skeleton.arms)
    nothing = np.full((n_t, 1, 3), np.nan)
    lines = [line if k in bare else nothing for k, line in enumerate(skeleton.lines)]
    return Skeleton(lines, connect([], n_t), skeleton.rails if bare else connect([], n_t), skeleton.rods, skeleton.pivots,
                    {k: places for k, places in skeleton.sliders.items() if k in bare})


def _skeleton(solution: Solution, centres: np.ndarray) -> tuple[Skeleton, list[int]]:
    """Lines of the bodies, and which bodies these are: all but massless carriers."""
    module, n_t = solution.module, len(solution.t)
    kept = list(range(centres.shape[1]))
    if "frames" not in module.functions:
        return bare_skeleton(centres), kept
    frames = solution.frames.reshape(n_t, -1, 12)
    origins, rotations = frames[..., :3], frames[..., 3:].reshape(n_t, -1, 3, 3)
    if "joint_points" not in module.functions:
        return guess_skeleton(origins, rotations, centres, _ends(solution, kept)), kept
    about = module.metadata
    made = carriers(about.bodies, about.reactions, about.reaction_bodies)
    kept = [k for k in kept if k not in made]
    joints = placed_joints(module.metadata, kept, solution.rows("joint_points").reshape(n_t, -1, 6))
    ends = _ends(solution, kept)
    return jointed_skeleton(joints, origins[:, kept], rotations[:, kept], centres[:, kept], ends), kept


def _ends(solution: Solution, bodies: Sequence[int]) -> list[tuple[int, np.ndarray]]:
    """Outputs that are positions on bodies: place among these, (n_t, 3)."""
    found = []
    for name, point in points_of(solution).items():
        if point.quantity == "position" and point.body in bodies:
            given = solution.outputs[name]
            found.append((bodies.index(point.body), np.pad(given, ((0, 0), (0, 3 - given.shape[1])))))
    return found
