"""The mechanism of a motion as what is drawn hangs on: its points on their bodies, and the axes of its joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.pictures.arrows import POINTS
from symdyn.pictures.looks import GROUND, Mechanism, Ref, not_drawn_by_rules, point_of, ropes_of, with_surroundings
from symdyn.pictures.points import points_of

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution


# Times at which is looked where contacts are; what stays where it is, of how far all goes.
_SAMPLES, _SAME = 40, 1e-6
# Times at which is looked how far joints slide, at most.
_ROWS = 2000


@dataclass(frozen=True)
class Hung:
    """Points and axes by the body that each is fixed to.

    owners   of the points (n_p,), places (n_p, 3) in the axes of these; parents of the joints (n_j,), axes (n_j, 3) in theirs
    """

    owners: np.ndarray
    places: np.ndarray
    parents: np.ndarray
    axes: np.ndarray

    @classmethod
    def of(cls, m: Mechanism) -> Hung:
        owners = np.array(m.owners(), dtype=int)
        places = np.array([m.local(owner, point) for owner, point in zip(owners, m.points, strict=True)]).reshape(-1, 3)
        parents = np.array([m.index(parent) for _, parent, _, _ in m.joints], dtype=int)
        axes = [axis if body == GROUND else m.frames[body, 3:].reshape(3, 3).T @ axis
                for body, axis in zip(parents, m.joint_axes, strict=False)]
        return cls(owners, places, parents, np.array(axes).reshape(-1, 3))

    def at(self, origins: np.ndarray, rotations: np.ndarray) -> Posed:
        """Where all is at one time; origins (n_b + 1, 3) and rotations (n_b + 1, 3, 3), the last the ground's."""
        points = origins[self.owners] + np.einsum("nij,nj->ni", rotations[self.owners], self.places)
        return Posed(points, np.einsum("nij,nj->ni", rotations[self.parents], self.axes), origins, rotations)


@dataclass(frozen=True)
class Posed:
    """Points (n_p, 3) and axes of joints (n_j, 3) at one time, n-frame, with the frames of bodies, the last the ground's."""

    points: np.ndarray
    axes: np.ndarray
    origins: np.ndarray
    rotations: np.ndarray

    def at(self, ref: Ref) -> np.ndarray:
        """The point that is referred to, see `looks.Ref`."""
        return point_of(ref, self.points, self.axes, lambda body, place: self.origins[body] + self.rotations[body] @ place)


def mechanism_of(solution: Solution, frames: np.ndarray, first: int, span: tuple[float, float] | None = None) -> Mechanism:
    """The mechanism at the start of a motion.

    frames   of the bodies at every time, (n_t, n_b, 12), n-frame; first: the row of the solution that is its start
    span     the part of the motion that is shown, s: so far rails reach; None: all
    """
    module, about = solution.module, solution.module.metadata

    def at(name: str, columns: int) -> np.ndarray:
        if name not in module.functions:
            return np.zeros((0, columns))
        result = module.evaluate(name, solution.t[first], solution.x[first], solution.params, solution.inputs[first])
        return np.asarray(result, dtype=float).reshape(-1, columns)

    points = at("joint_points", 6) if "joint_axes" in module.functions else at("", 6)
    springs = at("spring_points", 6)
    names = list(zip(about.reactions, about.reaction_bodies, about.reaction_kinds, strict=True)) if len(points) else []
    inertia = at("inertial_parameters", 10)
    drawn = not_drawn_by_rules(about, about.reactions, about.reaction_bodies)
    start = frames[first]
    tips = []
    for output, point in points_of(solution).items():
        if point.quantity == "position":
            given = np.pad(solution.outputs[output][first], (0, 3 - solution.outputs[output].shape[1]))
            R, o = start[point.body, 3:].reshape(3, 3), start[point.body, :3]
            tips.append((point.body, R.T @ (given - o)))
    centres = at("positions", 3) if "positions" in module.functions else start[:, :3]
    result = Mechanism(about.bodies, start, centres, [(n, *ends, kind) for n, ends, kind in names], points,
                       at("joint_axes", 3) if len(points) else at("", 3), about.connections if len(springs) else (), springs,
                       inertia if len(inertia) == len(start) else None, about.planar, about.down, drawn, tips)
    corners, wheels = _touching(solution, result, frames)
    gaps = at("contact_gaps", 1).ravel()[:4 * len(about.contacts):4].tolist()
    ropes = ropes_of([c.name for c in about.contacts], result.connections, gaps, springs) if len(gaps) else {}
    if span is not None:
        within = (solution.t >= span[0]) & (solution.t <= span[1])
        frames = frames[within] if within.sum() > 1 else frames
    way = float(np.linalg.norm(np.ptp(frames[..., :3], axis=(0, 1))))
    result = replace(result, ropes=ropes, travels=_travels(result, frames), corners=corners, wheels=wheels, way=way)
    around = list(filled([*about.drawn, *about.surroundings], lengths_of(solution)))[len(about.drawn):]
    return with_surroundings(result, around, about.drawn, frames[np.unique(np.linspace(0, len(frames) - 1, _ROWS).astype(int))])


def lengths_of(solution: Solution) -> np.ndarray:
    """The lengths in pictures that follow from the parameters of the run, in order."""
    if "drawn_lengths" not in solution.module.functions:
        return np.zeros(0)
    return solution.module.evaluate("drawn_lengths", solution.t[0], solution.x[0], solution.params, solution.inputs[0]).ravel()


def filled(records: Sequence[Mapping[str, Any]], lengths: np.ndarray) -> list[Mapping[str, Any]]:
    """The records with lengths in place of None, in order."""
    left = iter(lengths)
    return [{**record, "values": {name: [[next(left) if e is None else e for e in row] for row in rows]
                                  for name, rows in record["values"].items()}} for record in records]


def _touching(solution: Solution, m: Mechanism, frames: np.ndarray) -> tuple[list[tuple[int, np.ndarray]], dict[int, float]]:
    if POINTS not in solution.module.functions:
        return [], {}
    some = np.unique(np.linspace(0, len(frames) - 1, _SAMPLES).astype(int))
    at = solution.rows(POINTS).reshape(len(frames), -1, 2, 3)[some][:, :, 0]
    return touched(m, frames[some], at)


def touched(m: Mechanism, frames: np.ndarray, at: np.ndarray) -> tuple[list[tuple[int, np.ndarray]], dict[int, float]]:
    """Points of contacts that stay where they are on a body, and distances that they keep from the centre of mass of one; of
    several bodies the one that is nearest.

    frames   of the bodies at some configurations, (n, n_b, 12), and where contacts are there, (n, n_c, 3), n-frame
    """
    origins, rotations = frames[..., :3], frames[..., 3:].reshape(len(frames), len(m.bodies), 3, 3)
    own = np.array([m.centre(body) for body in range(len(m.bodies))])
    centres = origins + np.einsum("tbij,bj->tbi", rotations, own)
    near = _SAME * float(np.ptp(np.concatenate([centres.reshape(-1, 3), at.reshape(-1, 3)]), axis=0).max(initial=0.0))
    corners: list[tuple[int, np.ndarray]] = []
    wheels: dict[int, float] = {}
    for place in at.transpose(1, 0, 2):
        if not np.isfinite(place).all():
            continue
        local = np.einsum("tbji,tbj->tbi", rotations, place[:, None] - origins)
        away = np.linalg.norm(place[:, None] - centres, axis=2)
        fixed, round_ = np.ptp(local, axis=0).max(axis=1) <= near, np.ptp(away, axis=0) <= near
        # At rest every point stays on every body: a corner is no rim.
        choice = fixed if fixed.any() else round_
        if choice.any():
            body = int(np.where(choice, away[0], np.inf).argmin())
            if fixed.any():
                corners.append((body, local[0, body]))
            else:
                wheels[body] = float(away[:, body].mean())
    return corners, wheels


def _travels(m: Mechanism, frames: np.ndarray) -> Sequence[tuple[float, float]]:
    """Range of the child of every joint along its axis: least and greatest, m."""
    hung = Hung.of(m)
    frames = frames[np.unique(np.linspace(0, len(frames) - 1, _ROWS).astype(int))]
    still = np.broadcast_to(np.concatenate([np.zeros(3), np.eye(3).ravel()]), (len(frames), 1, 12))
    frames = np.concatenate([frames, still], axis=1)
    rotations = frames[..., 3:].reshape(*frames.shape[:2], 3, 3)
    result = []
    for j in range(len(m.joints)):
        a, b = (frames[:, hung.owners[p], :3] + rotations[:, hung.owners[p]] @ hung.places[p] for p in (2 * j, 2 * j + 1))
        way = np.einsum("ti,ti->t", b - a, rotations[:, hung.parents[j]] @ hung.axes[j])
        result.append((float(way.min()), float(way.max())))
    return result
