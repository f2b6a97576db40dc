"""The lines of a mechanism whose joints are known: each body from joint to joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from symdyn.backend.metadata import ModuleMetadata
from symdyn.pictures.joints import GROUND
from symdyn.pictures.skeleton import Skeleton, connect, extent

# Closer than this, relative to the mechanism, are points that are the same.
_SAME = 1e-6
# What kinds of joints are in a picture; others are hinges.
_ROLES = {"free": "float", "planar": "float", "prismatic": "slider", "cylindrical": "slider", "helical": "slider", "rod": "rod"}


@dataclass(frozen=True)
class PlacedJoint:
    """A joint over time: the places of its bodies (GROUND), its point on each, (n_t, 3), and its kind."""

    parent: int
    child: int
    parent_point: np.ndarray
    child_point: np.ndarray
    kind: str

    def role(self, rotations: np.ndarray, near: float) -> str:
        """"slider" if its points part along a line, "float" if anyhow, "rod", else "hinge"; of a custom joint by its motion.

        rotations of the bodies, (n_t, n_b, 3, 3)
        """
        if self.kind != "custom":
            return _ROLES.get(self.kind, "hinge")
        way = self.child_point - self.parent_point
        if np.abs(way).max() <= near:
            return "hinge"
        if self.parent != GROUND:
            way = np.einsum("tji,tj->ti", rotations[:, self.parent], way)
        return "slider" if np.linalg.svd(way - way.mean(axis=0), compute_uv=False)[1:].max(initial=0.0) <= near else "float"


def placed_joints(metadata: ModuleMetadata, bodies: Sequence[int], points: np.ndarray) -> list[PlacedJoint]:
    """The joints between these bodies and the ground; points (n_t, n_joints, 6) on parents, then on children."""
    places = {metadata.bodies[body]: k for k, body in enumerate(bodies)}
    ends = zip(metadata.reaction_bodies, metadata.reaction_kinds, strict=True)
    return [PlacedJoint(places.get(parent, GROUND), places.get(child, GROUND), points[:, k, :3], points[:, k, 3:], kind)
            for k, ((parent, child), kind) in enumerate(ends)]


def carriers(bodies: Sequence[str], joints: Sequence[str], joined: Sequence[tuple[str, str]]) -> set[int]:
    """Indices of the massless bodies that joints in loops have been given; joined: the two bodies of each joint."""
    made = {f"{name}_carrier" for name in joints} - {name for pair in joined for name in pair}
    return {k for k, name in enumerate(bodies) if name in made}


def jointed_skeleton(joints: Sequence[PlacedJoint], origins: np.ndarray, rotations: np.ndarray, centres: np.ndarray,
                     ends: Sequence[tuple[int, np.ndarray]] = ()) -> Skeleton:
    """Lines of the bodies through the points of their joints; a body with one such point reaches to its centre of mass.

    origins    (n_t, n_b, 3), and rotations (n_t, n_b, 3, 3) of the bodies' frames; a body that no joint holds begins there
    ends       further points that bodies reach to: body, (n_t, 3)
    """
    n_b = centres.shape[1]
    pairs = [np.stack([joint.parent_point, joint.child_point], axis=1) for joint in joints]
    near = _SAME * extent(np.concatenate([origins, centres, *pairs], axis=1))
    points: list[list[np.ndarray]] = [[] for _ in range(n_b)]
    rails, rods, pivots = [], [], []
    sliders: dict[int, list[int]] = {}
    for joint, pair in zip(joints, pairs, strict=True):
        role = joint.role(rotations, near)
        slides = role == "slider"
        if role == "float":
            continue
        if slides:
            rails.append(pair)
        elif role == "rod":
            rods.append(pair)
        # The point on the child first: with it the body hangs on those before.
        for body, point in ((joint.child, joint.child_point), (joint.parent, joint.parent_point)):
            if body != GROUND:
                place = _add(points[body], point, near)
                if slides and (body == joint.child or joint.child == GROUND):
                    sliders.setdefault(body, []).append(place)
            elif not slides and np.ptp(point, axis=0).max() < near:
                pivots.append(point[0])
    for body, end in ends:
        _add(points[body], end, near)
    lines, arms = [], []
    for k in range(n_b):
        found = points[k] or [origins[:, k]]
        if len(found) == 1:
            _add(found, centres[:, k], near)
        lines.append(_line(found))
        arms.append(np.stack([found[0], centres[:, k]], axis=1))
    # Places in the lines: those of more than three points go back to the first after each.
    marks = {k: [p if len(points[k]) <= 3 else max(2 * p - 1, 0) for p in places] for k, places in sliders.items()}
    return Skeleton(lines, connect(arms, len(centres)), connect(rails, len(centres)), connect(rods, len(centres)),
                    np.array(pivots).reshape(-1, 3), marks)


def _apart(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.linalg.norm(a - b, axis=1).max())


def _add(points: list[np.ndarray], point: np.ndarray, near: float) -> int:
    """Add a point unless it is there; returns its place."""
    for k, other in enumerate(points):
        if _apart(point, other) <= near:
            return k
    points.append(point)
    return len(points) - 1


def _line(points: Sequence[np.ndarray]) -> np.ndarray:
    """Through the points, (n_t, n, 3): a bar, a triangle, or spokes from the first point."""
    if len(points) == 3:
        return np.stack([*points, points[0]], axis=1)
    spokes = [p for point in points[2:] for p in (points[0], point)]
    return np.stack([*points[:2], *spokes], axis=1)
