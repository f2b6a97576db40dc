"""Meshes of robots: read by trimesh, with no more triangles than the eye sees; and the triangles of simple solids."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.errors import MissingExtra

# What a file may be long, bytes; how many triangles a mesh in a picture has at most, and into how many cells it is divided first.
LONGEST, TRIANGLES, _CELLS = 64 * 2**20, 800, 40
FORMATS = ("stl", "obj", "dae")
# The unit of lengths in COLLADA, m, which trimesh leaves to its callers.
_UNIT = re.compile(rb"<unit\b[^>]*\bmeter\s*=\s*[\"']([^\"']+)[\"']")
Triangles = tuple[np.ndarray, np.ndarray]


def loaded(path: Path) -> Triangles:
    """Vertices (n, 3), m, and faces (m, 3) of a file. It alone is read, no material or texture that it names; of COLLADA in the
    unit that it states, along its axes as they are.

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
        found: Any = trimesh.load_mesh(io.BytesIO(content), file_type=kind)
        vertices, faces = np.array(found.vertices, dtype=float), np.array(found.faces, dtype=int)
        stated = _UNIT.search(content) if kind == "dae" else None
        vertices *= float(stated[1]) if stated else 1.0
    except Exception as error:  # of any kind: parsers of others
        raise ValueError(f"cannot be read as {kind} ({type(error).__name__}: {str(error)[:80]})") from None
    if not len(faces) or not np.isfinite(vertices).all():
        raise ValueError("has no triangles, or coordinates that are not finite")
    return vertices, faces


def decimated(vertices: np.ndarray, faces: np.ndarray, most: int = TRIANGLES) -> Triangles:
    """At most so many triangles: vertices in one cell of a grid become one, their mean.

    Source: Rossignac and Borrel, Multi-resolution 3D approximations for rendering complex scenes, 1993.
    """
    low, size = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    cells, kept, left = _CELLS, vertices, faces
    while len(left) > most or len(kept) > 3 * most:
        x, y, z = np.floor((vertices - low) / (size or 1.0) * cells).astype(np.int64).T
        _, which, counts = np.unique((x * 1000 + y) * 1000 + z, return_inverse=True, return_counts=True)
        kept = np.column_stack([np.bincount(which, column) for column in vertices.T]) / counts[:, None]
        left = which[faces]
        left = left[(left[:, 0] != left[:, 1]) & (left[:, 1] != left[:, 2]) & (left[:, 2] != left[:, 0])]
        ends = np.sort(left, axis=1) @ np.array([len(kept) ** 2, len(kept), 1])
        _, first = np.unique(ends, return_index=True)
        left, cells = left[np.sort(first)], int(cells * 0.8)
        if cells < 2:
            break
    used, which = np.unique(left, return_inverse=True)
    return kept[used], which.reshape(-1, 3)


def box(half: np.ndarray) -> Triangles:
    """Of half its edges, (3,)."""
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


def ellipsoid(half: np.ndarray) -> Triangles:
    vertices, faces = capsule(1.0, 0.0)
    return vertices * half, faces
