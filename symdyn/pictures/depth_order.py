"""Depth order of pieces: those that lie behind come first, and what is under water before the water.

Convex pieces are ordered by the planes of their faces: if one of them has the other piece wholly on its outer side, then the
other hides it where the eye is on that side, too, and is hidden by it otherwise. Pieces that stick into each other are parted by
the plane that comes nearest to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from symdyn.pictures.meshes import Part


@dataclass(frozen=True)
class Camera:
    """Where a picture is seen from: matrix (4, 4) from the n-frame to the screen, eye (4,) homogeneous."""

    matrix: np.ndarray
    eye: np.ndarray

    @classmethod
    def of(cls, matrix: np.ndarray) -> Camera:
        """The eye goes to the point at infinity along the depth of the screen."""
        eye = np.linalg.solve(matrix, [0.0, 0.0, -1.0, 0.0])
        eye = eye / eye[3] if abs(eye[3]) > 1e-12 * np.abs(eye).max() else eye
        return cls(matrix, eye)

    def project(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) to the screen, (n, 2)."""
        there = points @ self.matrix[:, :3].T + self.matrix[:, 3]
        return there[:, :2] / there[:, 3:]

    def side(self, normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
        """Positive where the eye is on the outer side of planes normal . p = offset."""
        return normals @ self.eye[:3] - self.eye[3] * offsets

    def toward(self, point: np.ndarray) -> np.ndarray:
        """Unit vector to the eye."""
        way = self.eye[:3] - self.eye[3] * point
        return np.asarray(way / np.linalg.norm(way))

    def distance(self, point: np.ndarray, way: np.ndarray) -> float:
        """Distance of a point from the eye, along the way to the eye from the middle of the picture; less an unknown."""
        return float(-way @ point) if self.eye[3] == 0 else float(np.linalg.norm(self.eye[:3] - point))


def planes(vertices: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Outward unit normals (m, 3) and offsets (m,) of faces; zero where a face has no area."""
    a, b, c, d = (vertices[corners[:, k]] for k in range(4))
    normals = np.cross(c - a, d - b)
    lengths = np.linalg.norm(normals, axis=1)
    normals = np.divide(normals, lengths[:, None], out=np.zeros_like(normals), where=lengths[:, None] > 1e-12)
    return normals, np.einsum("ij,ij->i", normals, (a + b + c + d) / 4)


def order(parts: Sequence[Part], places: Sequence[np.ndarray], camera: Camera) -> list[int]:
    """The parts from back to front; places: their vertices, n-frame."""
    n = len(parts)
    faces = [planes(v, np.concatenate([part.corners, part.hidden]) if part.convex else part.hidden) for part, v in
             zip(parts, places, strict=True)]
    flat = [camera.project(v) for v in places]
    low, high = np.array([f.min(axis=0) for f in flat]), np.array([f.max(axis=0) for f in flat])
    way = camera.toward(np.concatenate(places).mean(axis=0))
    far = [camera.distance(v.mean(axis=0), way) for v in places]
    first: list[set[int]] = [set() for _ in range(n)]
    for i in range(n):
        for j in range(i):
            if (low[i] < high[j]).all() and (low[j] < high[i]).all():
                behind = j if _hides(faces[i], places[j], faces[j], places[i], camera, far[i] < far[j]) else i
                first[i + j - behind].add(behind)
    waiting, done = set(range(n)), []
    while waiting:
        ready = [k for k in waiting if not first[k] & waiting] or list(waiting)
        chosen = max(ready, key=lambda k: (far[k], k))
        waiting.remove(chosen)
        done.append(chosen)
    return done


def _hides(own: tuple, others: np.ndarray, other: tuple, owns: np.ndarray, camera: Camera, nearer: bool) -> bool:
    """Whether a piece hides another, by their planes and each other's vertices; without planes, whether it is nearer."""
    best, answer = -np.inf, nearer
    for (normals, offsets), vertices, mine in ((own, others, True), (other, owns, False)):
        if len(normals):
            gaps = (normals @ vertices.T).min(axis=1) - offsets
            gaps[~normals.any(axis=1)] = -np.inf
            k = int(gaps.argmax())
            if gaps[k] > best + 1e-9:
                outside = camera.side(normals[k], offsets[k]) > 0
                best, answer = gaps[k], bool(outside != mine)
    return answer


def cut(polygon: np.ndarray, heights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The parts below and above the water of a convex polygon (n, 3) that has both; heights (n,): of its corners above it."""
    below, above = [], []
    for a, b, za, zb in zip(polygon, np.roll(polygon, -1, axis=0), heights, np.roll(heights, -1), strict=True):
        if za <= 0:
            below.append(a)
        if za >= 0:
            above.append(a)
        if za * zb < 0:
            point = a + (b - a) * (za / (za - zb))
            below.append(point)
            above.append(point)
    return np.array(below), np.array(above)
