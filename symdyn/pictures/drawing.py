"""A mechanism as shapes, or as lines, and arrows over time, in the axes that are shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.pictures.arrows import Arrows, arcs, arrows_of, straight, touching
from symdyn.pictures.grounds import Ground
from symdyn.pictures.looks import carriers, up_of
from symdyn.pictures.points import points_of
from symdyn.pictures.skeleton import Skeleton, bare_skeleton, connect, guess_skeleton
from symdyn.pictures.solids import Solids

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

_LEFT_OUT = 1e-9
# Functions of a module that ellipsoids of inertia need.
_OF_ELLIPSOIDS = ("frames", "joint_points", "joint_axes", "inertial_parameters")


@dataclass(frozen=True)
class Drawn:
    """Arrows in the axes that are shown.

    arrows   what they are of; tails (n_t, n, 2 or 3) and ways from there to their tips
    turns    (n_t, n) of torques about what a plane is seen along: lengths of arrows, m, positive from the first axis to the
             second; None for others
    """

    arrows: Arrows
    tails: np.ndarray
    ways: np.ndarray
    turns: np.ndarray | None

    @classmethod
    def of(cls, arrows: Arrows, shown: Sequence[int]) -> Drawn:
        ways = arrows.ways
        turns = ways @ np.cross(np.eye(3)[shown[0]], np.eye(3)[shown[1]]) if arrows.turns and len(shown) == 2 else None
        return cls(arrows, arrows.tails[..., list(shown)], ways[..., list(shown)], turns)

    def at(self, a: np.ndarray, b: np.ndarray, w: np.ndarray) -> Drawn:
        """At other times: a share w (n, 1, 1) of the way from the times a to the times b."""
        tails, ways = (part[a] * (1 - w) + part[b] * w for part in (self.tails, self.ways))
        turns = None if self.turns is None else self.turns[a] * (1 - w[..., 0]) + self.turns[b] * w[..., 0]
        return replace(self, tails=tails, ways=ways, turns=turns)

    def curve(self, index: int) -> np.ndarray:
        """At one of the times, (m, 2 or 3), lifted between the arrows."""
        if self.turns is not None:
            return arcs(self.tails[index], self.turns[index], self.arrows.head)
        return straight(self.tails[index], self.ways[index], 2 if self.arrows.turns else 1, self.arrows.head)

    def reach(self) -> np.ndarray:
        """Where arrows begin and end, (n, 2 or 3)."""
        n = self.tails.shape[-1]
        if self.turns is not None:
            half = np.abs(self.turns)[..., None] / 2
            return np.concatenate([self.tails - half, self.tails + half]).reshape(-1, n)
        return np.concatenate([self.tails, self.tails + self.ways]).reshape(-1, n)


@dataclass(frozen=True)
class Drawing:
    """A mechanism as shapes, or as lines, and arrows over time, in the axes that are shown.

    points     what must be in the picture besides shapes, (n_t, n, 2 or 3): joints, ends of springs
    centres    centres of mass (n_t, n_b, 2 or 3)
    labels     of the axes
    solids     shapes, if there are any
    sticks     lines of bodies without shapes where joints are not listed, so that these have no look of their own, else None
    bare       the bodies without shapes
    arrows     of forces and torques
    up         the direction that is above; planes: of the ground that contacts have
    """

    points: np.ndarray
    centres: np.ndarray
    labels: Sequence[str]
    solids: Solids | None
    sticks: Skeleton | None
    bare: Sequence[int]
    arrows: Sequence[Drawn]
    up: tuple[float, float, float]
    planes: Sequence[Ground]

    @property
    def axes(self) -> list[int]:
        """Axes of the n-frame that are shown."""
        return ["xyz".index(label) for label in self.labels]

    @property
    def spatial(self) -> bool:
        return len(self.labels) == 3

    @classmethod
    def of(cls, solution: Solution, forces: bool = False, span: tuple[float, float] | None = None,
           inertia: bool = False) -> Drawing | None:
        """Drawing of a motion; None if the module gives no positions, or nothing moves.

        forces    with arrows of forces in joints, loads and weights; those of contacts are always there
        span      the part of the motion that is shown, s, and for which rails and what has no size are long enough; None: all
        inertia   with the ellipsoids of inertia
        Raises ArgumentError where these are requested and no body has one.
        """
        if "positions" not in solution.module.functions:
            return None
        about, n_t = solution.module.metadata, len(solution.t)
        centres = solution.rows("positions").reshape(n_t, -1, 3)
        if not centres.shape[1] or not np.isfinite(centres).all():
            return None
        solids = Solids.of(solution, span, inertia)
        if inertia and not (solids is not None and any(part.glass for part in solids.parts)):
            raise _no_ellipsoid(solution)
        if solids is not None and solids.forms is not None:
            made = carriers(about.bodies, about.reactions, about.reaction_bodies)
            centres = np.delete(centres, sorted(made), axis=1)
            sticks, bare, points = None, [], solids.points()
        else:
            tips = {record["tip"] for record in about.flexible}
            bare = [k for k, name in enumerate(about.bodies or range(centres.shape[1])) if solids is None or (
                k not in solids.bodies and name not in tips)]
            sticks = _without(_skeleton(solution, centres), bare, solids)
            points = np.concatenate([*sticks.lines, np.broadcast_to(sticks.pivots, (n_t, *sticks.pivots.shape))], axis=1)
        touches, _ = touching(solution)
        everything = np.concatenate([points.reshape(-1, 3), centres.reshape(-1, 3), touches.reshape(-1, 3),
                                     solids.reach() if solids is not None and solids.own else np.zeros((0, 3))])
        ranges = np.nanmax(everything, axis=0) - np.nanmin(everything, axis=0)
        shown = [k for k in range(3) if ranges[k] > _LEFT_OUT * max(ranges.max(), _LEFT_OUT)]
        # A mechanism that moves in a plane is seen from the front.
        if solids is not None and (solids.own or len(shown) != 2 or about.planar):
            shown = [0, 1] if about.planar else [0, 1, 2]
        if not shown:
            return None
        if len(shown) == 1:
            shown = sorted({*shown, 1 if shown[0] != 1 else 0})
        length = solids.forms.length if solids is not None and solids.forms is not None else float(ranges.max())
        up = up_of(about.down, about.planar)
        return cls(points[..., shown], centres[..., shown], ["xyz"[k] for k in shown], solids,
                   None if sticks is None else sticks.in_axes(shown), bare,
                   [Drawn.of(one, shown) for one in arrows_of(solution, length, forces)], up,
                   solids.planes if solids is not None else ())

    def at(self, t: np.ndarray, times: np.ndarray) -> Drawing:
        """The drawing at other times, by linear interpolation."""
        order = np.argsort(t)
        right = np.clip(np.searchsorted(t[order], times), 1, len(t) - 1)
        a, b = order[right - 1], order[right]
        w = ((times - t[a]) / (t[b] - t[a]))[:, None, None]
        points, centres = (part[a] * (1 - w) + part[b] * w for part in (self.points, self.centres))
        return replace(self, points=points, centres=centres, solids=None if self.solids is None else self.solids.at(t, times),
                       sticks=None if self.sticks is None else self.sticks.at(a, b, w),
                       arrows=[one.at(a, b, w) for one in self.arrows])

    def limits(self) -> np.ndarray:
        """Lower and upper limits of the axes, (2 or 3, 2), the same length in each direction of a plane."""
        reach = self.solids.reach() if self.solids is not None else np.zeros((0, 3))
        points = np.concatenate([*[part.reshape(-1, len(self.labels)) for part in (self.points, self.centres)],
                                 *[one.reach() for one in self.arrows], reach[:, self.axes]])
        low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
        longest = (high - low).max()
        half = np.maximum((high - low) / 2, 0.15 * longest) + 0.06 * longest
        return np.column_stack([(low + high) / 2 - half, (low + high) / 2 + half])


def _no_ellipsoid(solution: Solution) -> ArgumentError:
    missing = [name for name in _OF_ELLIPSOIDS if name not in solution.module.functions]
    why = (f"its module has no function {missing[0]!r}, which mechanisms of rigid bodies without added mass have" if missing else
           "moments of inertia about centres of mass are zero, or too small to be seen; give inertia to its bodies")
    return ArgumentError(f"{solution.module.name}: inertia=True draws ellipsoids of inertia, and there is none: {why}, or leave "
                         "inertia out")


def _without(skeleton: Skeleton, bare: Sequence[int], solids: Solids | None) -> Skeleton:
    """The lines of the bodies that have no shapes; others keep their place, with nothing to draw."""
    if solids is None:
        return skeleton
    n_t = len(skeleton.arms)
    nothing = np.full((n_t, 1, 3), np.nan)
    lines = [line if k in bare else nothing for k, line in enumerate(skeleton.lines)]
    return Skeleton(lines, connect([], n_t), skeleton.rails if bare else connect([], n_t), skeleton.pivots,
                    {k: places for k, places in skeleton.sliders.items() if k in bare})


def _skeleton(solution: Solution, centres: np.ndarray) -> Skeleton:
    """Lines of the bodies, from their motion."""
    if "frames" not in solution.module.functions:
        return bare_skeleton(centres)
    frames = solution.frames.reshape(len(solution.t), -1, 12)
    origins, rotations = frames[..., :3], frames[..., 3:].reshape(len(solution.t), -1, 3, 3)
    ends = [(point.body, np.pad(given, ((0, 0), (0, 3 - given.shape[1])))) for name, point in points_of(solution).items()
            if point.quantity == "position" for given in [solution.outputs[name]]]
    return guess_skeleton(origins, rotations, centres, ends)
