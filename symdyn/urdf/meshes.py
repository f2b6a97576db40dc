"""Meshes of robots: read by trimesh, with no more triangles than the eye sees; and the triangles of simple solids."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.errors import MissingExtra

# Largest length of a file, bytes; largest number of triangles of a mesh in a picture, and number of cells that it is divided into
# first.
LONGEST, TRIANGLES, _CELLS = 64 * 2**20, 800, 40
FORMATS = ("stl", "obj", "dae")
# The unit of lengths in COLLADA, m, which trimesh leaves to its callers.
_UNIT = re.compile(rb"<unit\b[^>]*\bmeter\s*=\s*[\"']([^\"']+)[\"']")
Triangles = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Piece:
    """Triangles of one colour: three numbers from 0 to 1, or None where the file states none."""

    vertices: np.ndarray
    faces: np.ndarray
    color: tuple[float, ...] | None = None


def loaded(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (n, 3), m, faces (m, 3) and their colours (m, 3), from 0 to 1 or NaN for none, of a file. It alone is read, no
    texture and no other file that it names; of COLLADA in the unit that it states, along its axes as they are, with the diffuse
    colours of its materials.

    Raises ValueError with what is wrong with it, MissingExtra without trimesh.
    """
    try:
        import trimesh
    except ImportError:
        raise MissingExtra("reading meshes needs the package trimesh: pip install 'symdyn[meshes]'") from None
    kind = path.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        raise ValueError(f"is of the format {kind or 'without an ending'}; read are {', '.join(FORMATS)}")
    if path.stat().st_size > LONGEST:
        raise ValueError(f"has {path.stat().st_size / 2**20:.0f} MiB; read are {LONGEST // 2**20} at most")
    content = path.read_bytes()
    try:
        if kind == "dae":
            scene: Any = trimesh.load(io.BytesIO(content), file_type=kind, force="scene")
            vertices, faces, colors = _joined(scene.dump())
            stated = _UNIT.search(content)
            vertices *= float(stated[1]) if stated else 1.0
        else:
            result: Any = trimesh.load_mesh(io.BytesIO(content), file_type=kind)
            vertices, faces = np.array(result.vertices, dtype=float), np.array(result.faces, dtype=int)
            colors = np.full(faces.shape, np.nan)
    except Exception as error:  # of any kind: parsers of others
        raise ValueError(f"cannot be read as {kind} ({type(error).__name__}: {str(error)[:80]})") from None
    if not len(faces) or not np.isfinite(vertices).all():
        raise ValueError("has no triangles, or coordinates that are not finite")
    return vertices, faces, colors


def _joined(parts: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The parts of a scene as one mesh: vertices, faces, colours of faces."""
    vertices, faces, colors, before = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=int)], [np.zeros((0, 3))], 0
    for part in parts:
        if not len(getattr(part, "faces", ())):
            continue  # lines and points
        diffuse = getattr(getattr(part.visual, "material", None), "baseColorFactor", None)
        vertices.append(np.array(part.vertices, dtype=float))
        faces.append(np.array(part.faces, dtype=int) + before)
        color = np.full(3, np.nan) if diffuse is None else np.array(diffuse, dtype=float)[:3] / 255
        colors.append(np.tile(color, (len(part.faces), 1)))
        before += len(part.vertices)
    return np.concatenate(vertices), np.concatenate(faces), np.concatenate(colors)


def pieces(path: Path) -> Iterator[Piece]:
    """The triangles of a file, reduced, one piece for each colour; raises as `loaded`."""
    vertices, faces, colors = loaded(path)
    vertices, faces, kept = _reduced(vertices, faces, TRIANGLES)
    different, which = np.unique(np.nan_to_num(colors[kept], nan=-1.0), axis=0, return_inverse=True)
    for k, color in enumerate(different):
        used, at = np.unique(faces[which.ravel() == k], return_inverse=True)
        yield Piece(vertices[used], at.reshape(-1, 3), None if color[0] < 0 else tuple(map(float, color)))


def decimated(vertices: np.ndarray, faces: np.ndarray, most: int = TRIANGLES) -> Triangles:
    """At most so many triangles: vertices in one cell of a grid become one, their mean.

    Source: Rossignac and Borrel, Multi-resolution 3D approximations for rendering complex scenes, 1993.
    """
    return _reduced(vertices, faces, most)[:2]


def _reduced(vertices: np.ndarray, faces: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As `decimated`, and which of the faces (m,) are left."""
    low, size = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    cells, kept, left, at = _CELLS, vertices, faces, np.arange(len(faces))
    while len(left) > most or len(kept) > 3 * most:
        x, y, z = np.floor((vertices - low) / (size or 1.0) * cells).astype(np.int64).T
        _, which, counts = np.unique((x * 1000 + y) * 1000 + z, return_inverse=True, return_counts=True)
        kept = np.column_stack([np.bincount(which, column) for column in vertices.T]) / counts[:, None]
        left = which[faces]
        at = np.flatnonzero((left[:, 0] != left[:, 1]) & (left[:, 1] != left[:, 2]) & (left[:, 2] != left[:, 0]))
        ends = np.sort(left[at], axis=1) @ np.array([len(kept) ** 2, len(kept), 1])
        _, first = np.unique(ends, return_index=True)
        at = at[np.sort(first)]
        left, cells = left[at], int(cells * 0.8)
        if cells < 2:
            break
    used, which = np.unique(left, return_inverse=True)
    return kept[used], which.reshape(-1, 3), at


def box(half: np.ndarray) -> Triangles:
    """Box with half its edges given, (3,)."""
    vertices = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5,
             7], [1, 7, 3]]
    return vertices, np.array(faces)


def turned(profile: np.ndarray, sides: int = 16) -> Triangles:
    """The solid of revolution about z of a profile of radius and height, (n, 2), upwards."""
    angles = 2 * np.pi * np.arange(sides) / sides
    vertices = np.array([[r * np.cos(a), r * np.sin(a), z] for r, z in profile for a in angles])
    faces = [[row + k, row + (k + 1) % sides, row + sides + (k + 1) % sides] for row in range(0, len(vertices) - sides, sides)
             for k in range(sides)]
    faces += [[row + k, row + sides + (k + 1) % sides, row + sides + k] for row in range(0, len(vertices) - sides, sides)
              for k in range(sides)]
    return vertices, np.array(faces)


def cylinder(radius: float, half: float) -> Triangles:
    return turned(np.array([[0, -half], [radius, -half], [radius, half], [0, half]]))


def capsule(radius: float, half: float) -> Triangles:
    """A cylinder with half balls at its ends; half: of the cylinder."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, 9)
    return turned(np.array([[radius * np.cos(a), radius * np.sin(a) + half * (1 if a > 0 else -1)] for a in angles]))


def cone(radius: float, half: float) -> Triangles:
    """With its tip upwards; half: of its height."""
    return turned(np.array([[0, -half], [radius, -half], [0, half]]))


def ellipsoid(half: np.ndarray) -> Triangles:
    vertices, faces = capsule(1.0, 0.0)
    return vertices * half, faces
