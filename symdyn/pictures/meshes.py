"""Faces and edges of shapes, in the axes of their bodies."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

Color = tuple[float, float, float]
# Corners of a round section, of a wheel, and of a flat section.
_ROUND, _WHEEL, _FLAT = 20, 48, 10
# Stations of a shape that bends.
_BENDING = 13
# Width of a beam without a shape, of the mechanism's length.
_BEAM = 0.03


@dataclass(frozen=True)
class Part:
    """A convex piece of a shape, or a line.

    vertices   (n, 3); stations: (n, 3), the point of the middle line that each goes with when its body bends
    faces      vertices of each, counter-clockwise from outside; corners: (m, 4), four of them, which define the plane
    hidden     (k, 4), corners of planes where pieces touch: never drawn, but they part the pieces
    edges      (k, 4): two vertices, two faces (-1: none); creases: (k,), drawn from every side, others as outlines alone
    convex     whether it is; of any other, triangles are drawn by their distance, and `hidden` is a box around it
    width      of lines, in points of print; to: the body that the last vertex of a line is on, if it is another
    ground     whether it is what bodies stand on: behind all that the eye above it sees; open: whether it has no inside, and is
               seen from both sides
    glass      whether it is seen through, over all others: its outline, filled in pale, and its edges
    """

    body: int
    color: Color
    vertices: np.ndarray
    stations: np.ndarray
    faces: tuple[np.ndarray, ...]
    corners: np.ndarray
    hidden: np.ndarray
    edges: np.ndarray
    creases: np.ndarray
    width: float = 0.4
    to: int | None = None
    convex: bool = True
    ground: bool = False
    open: bool = False
    glass: bool = False


def parts_of(record: Mapping[str, Any], body: int, color: Color, to: int | None = None, bends: bool = False) -> Iterator[Part]:
    """The pieces of a shape; to: the body where a line ends; bends: with stations enough to bend."""
    values = {name: np.array(rows, dtype=float) for name, rows in record["values"].items()}
    if record["kind"] == "box":
        yield from box(body, color, values["size"][0], values["center"][0], values["hole"][0] if "hole" in values else None)
    elif record["kind"] == "sweep":
        points, widths = values["points"], values["widths"]
        if bends:
            points, widths = _finer(points), _finer(widths, points)
        flat = len(points) == 2 and float(widths.max()) > float(np.linalg.norm(points[1] - points[0]))
        yield sweep(body, color, points, widths, values["direction"][0] if "direction" in values else None,
                    _WHEEL if flat else _ROUND)
    elif record["kind"] == "mesh":
        yield _triangles(body, color, np.array(record["vertices"]), np.array(record["faces"], dtype=int))
    elif record["kind"] == "line":
        points = values["points"].reshape(-1, 3)
        if bends and to is None:
            points = _finer(points)
        yield line(body, color, np.vstack([points, *values.get("end", ())]), float(record["width"]), to)


def sweep(body: int, color: Color, points: np.ndarray, widths: np.ndarray, direction: np.ndarray | None = None,
          around: int = _ROUND) -> Part:
    """Elliptic sections along points (n, 3), widths (n, 2) across: the first along a direction; corners around each."""
    along = points[-1] - points[0]
    along = along / np.linalg.norm(along)
    for given in (*(() if direction is None else (direction,)), np.eye(3)[np.abs(along).argmin()]):
        first = given / np.linalg.norm(given)
        first = first - (first @ along) * along
        if np.linalg.norm(first) > 1e-6:
            break
    first = first / np.linalg.norm(first)
    second = np.cross(along, first)
    sides = around if direction is None else _FLAT
    angles = 2 * np.pi * np.arange(sides) / sides
    rings = (points[:, None] + widths[:, :1, None] / 2 * np.cos(angles)[None, :, None] * first
             + widths[:, 1:, None] / 2 * np.sin(angles)[None, :, None] * second)
    vertices, count = rings.reshape(-1, 3), len(points)

    def at(k: int, j: int) -> int:
        return k * sides + j % sides

    faces = [[at(k, j), at(k, j + 1), at(k + 1, j + 1), at(k + 1, j)] for k in range(count - 1) for j in range(sides)]
    ends = [[at(0, -j) for j in range(sides)], [at(count - 1, j) for j in range(sides)]]
    return _part(body, color, vertices, [*faces, *ends], (), np.repeat(points, sides, axis=0), lambda face: face >= len(faces))


def beam(body: int, color: Color, points: np.ndarray, length: float) -> Part:
    """A bar through the points of what bends; length of the mechanism, m."""
    return sweep(body, color, points, np.full((len(points), 2), _BEAM * length))


def line(body: int, color: Color, points: np.ndarray, width: float, to: int | None = None) -> Part:
    """Through points, (n, 3)."""
    nothing = np.zeros((0, 4), dtype=int)
    edges = np.array([[k, k + 1, -1, -1] for k in range(len(points) - 1)])
    return Part(body, color, points, points, (), nothing, nothing, edges, np.ones(len(edges), dtype=bool), width, to)


def globe(body: int, color: Color) -> Part:
    """A unit ball that is seen through, with the circles across its three axes."""
    angles = 2 * np.pi * np.arange(_WHEEL) / _WHEEL
    circle = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    heights = np.cos(np.pi * np.arange(1, _WHEEL // 2) / (_WHEEL // 2))
    rings = [np.sqrt(1 - z * z) * circle + [0.0, 0.0, z] for z in heights]
    vertices = np.concatenate([*(np.roll(circle, k, axis=1) for k in range(3)), *rings])
    steps = np.arange(_WHEEL)
    edges = np.concatenate([np.column_stack([k * _WHEEL + steps, k * _WHEEL + (steps + 1) % _WHEEL]) for k in range(3)])
    nothing = np.zeros((0, 4), dtype=int)
    return Part(body, color, vertices, vertices, (), nothing, nothing, np.pad(edges, ((0, 0), (0, 2)), constant_values=-1),
                np.ones(len(edges), dtype=bool), glass=True)


def _triangles(body: int, color: Color, vertices: np.ndarray, faces: np.ndarray) -> Part:
    """Triangles of any form."""
    return _boxed(body, color, vertices, tuple(faces), np.zeros((0, 4), dtype=int))


def ribbon(body: int, color: Color, points: np.ndarray, away: np.ndarray, half: float, ground: bool = True) -> Part:
    """A curve of a plane as a band from points (n, 3), which has what touches it on its left, to away from there, (3,) or (n, 3);
    half: of its width across the plane, m. The ground has no outlines, of which a long road would have many."""
    up, n = np.array([0.0, 0.0, half]), len(points)
    vertices = np.stack([points + up, points - up, points + away - up, points + away + up], axis=1).reshape(-1, 3)
    rows = np.arange(n - 1)[:, None] * 4
    pairs = [(0, 1), (1, 2), (2, 3), (3, 0)]
    faces = np.concatenate([rows + [a, a + 4, b + 4, b] for a, b in pairs])
    first = rows // 4  # faces of a pair: those of another are n - 1 later
    edges = np.concatenate([np.column_stack([rows + k, rows + k + 4, first + (n - 1) * k, first + (n - 1) * ((k - 1) % 4)])
                            for k in range(4)])
    return _boxed(body, color, vertices, tuple(faces), edges[:0] if ground else edges, ground)


def sheet(body: int, color: Color, grid: np.ndarray, every: int) -> Part:
    """A surface through points (n, m, 3), as far as they are finite, with every so many rows and columns as lines."""
    n, m = grid.shape[:2]
    vertices, finite = grid.reshape(-1, 3), np.isfinite(grid).all(axis=2).ravel()
    at = np.arange(n * m).reshape(n, m)
    faces = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    faces = faces[finite[faces].all(axis=1)]
    rows = [at[k, [i, i + 1]] for k in {*range(0, n, every), n - 1} for i in range(m - 1)]
    columns = [at[[i, i + 1], k] for k in {*range(0, m, every), m - 1} for i in range(n - 1)]
    lines = np.array([*rows, *columns])
    lines = lines[finite[lines].all(axis=1)]
    index = np.cumsum(finite) - 1
    edges = np.column_stack([index[lines], np.full((len(lines), 2), -1)])
    return replace(_boxed(body, color, vertices[finite], tuple(index[faces]), edges, True), open=True)


def prism(body: int, color: Color, outline: np.ndarray, half: float) -> Part:
    """Prism within a closed curve (n, 3), counter-clockwise around the origin, which sees all of it; half its thickness."""
    n, up = len(outline), np.array([0.0, 0.0, half])
    vertices = np.concatenate([outline + up, outline - up, [up, -up]])
    a = np.arange(n)
    b = (a + 1) % n
    front, back = np.column_stack([0 * a + 2 * n, a, b]), np.column_stack([0 * a + 2 * n + 1, b + n, a + n])
    edges = np.concatenate([np.column_stack([a, b, a, 2 * n + a]), np.column_stack([a + n, b + n, n + a, 2 * n + a])])
    return _boxed(body, color, vertices, (*front, *back, *np.column_stack([a, a + n, b + n, b])), edges)


def _boxed(body: int, color: Color, vertices: np.ndarray, faces: tuple[np.ndarray, ...], edges: np.ndarray,
           ground: bool = False) -> Part:
    """Triangles and quadrilaterals of any form, and the corners of the box around them, which none of them has."""
    ends = np.array([vertices.min(axis=0), vertices.max(axis=0)])
    corners = np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in range(2) for j in range(2) for k in range(2)])
    sides = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]) + len(vertices)
    every = np.vstack([vertices, corners])
    four = np.array([[face[k * len(face) // 4] for k in range(4)] for face in faces], dtype=int).reshape(-1, 4)
    return Part(body, color, every, every, faces, four, sides, edges, np.ones(len(edges), dtype=bool), convex=False,
                ground=ground)


def box(body: int, color: Color, size: np.ndarray, center: np.ndarray, hole: np.ndarray | None = None) -> Iterator[Part]:
    """A box; one with an opening is four around it, without edges where they touch."""
    reach = [[c - s / 2, c + s / 2] for c, s in zip(center, size, strict=True)]
    if hole is not None:
        for k in range(2):
            reach[k][1:1] = [center[k] - hole[k] / 2, center[k] + hole[k] / 2]
    xs, ys, zs = reach
    vertices = np.array([[x, y, z] for x in xs for y in ys for z in zs])
    n, m = len(xs) - 1, len(ys) - 1

    def at(i: int, j: int, k: int) -> int:
        return (i * len(ys) + j) * 2 + k

    def walls(*way: tuple[int, int]) -> list[list[int]]:
        """Upright faces along a way that has the piece on its left."""
        return [[at(*a, 0), at(*b, 0), at(*b, 1), at(*a, 1)] for a, b in pairwise(way)]

    def lids(*way: tuple[int, int]) -> list[list[int]]:
        """Top and bottom over a way around the piece."""
        return [[at(*p, 1) for p in way], [at(*p, 0) for p in reversed(way)]]

    if hole is None:
        around = ((0, 0), (n, 0), (n, m), (0, m))
        yield _part(body, color, vertices, [*lids(*around), *walls(*around, (0, 0))])
        return
    left, right = ((0, 0), (1, 0), (1, 1), (1, 2), (1, 3), (0, 3)), ((2, 0), (3, 0), (3, 3), (2, 3), (2, 2), (2, 1))
    yield _part(body, color, vertices, [*lids(*left), *walls(*left[4:], *left[:2]), *walls(*left[2:4])], walls((1, 0), (1, 3)),
                rims=[(at(1, j, 0), at(1, j, 1)) for j in (1, 2)])
    yield _part(body, color, vertices, [*lids(*right), *walls(*right[:4]), *walls(*right[4:])], walls((2, 3), (2, 0)),
                rims=[(at(2, j, 0), at(2, j, 1)) for j in (1, 2)])
    for piece in (((1, 0), (2, 0), (2, 1), (1, 1)), ((1, 2), (2, 2), (2, 3), (1, 3))):
        yield _part(body, color, vertices, [*lids(*piece), *walls(*piece[:2]), *walls(*piece[2:])],
                    [*walls(*piece[1:3]), *walls(piece[3], piece[0])])


def _part(body: int, color: Color, vertices: np.ndarray, faces: Sequence[Sequence[int]], hidden: Sequence[Sequence[int]] = (),
          stations: np.ndarray | None = None, crease: Callable[[int], bool] = lambda face: True,
          rims: Sequence[tuple[int, int]] = ()) -> Part:
    """A piece with the vertices that its faces use.

    crease   whether an edge of a face is drawn from every side; rims: edges of one face alone that are drawn nevertheless
    """
    used = sorted({v for face in faces for v in face})
    index = {v: k for k, v in enumerate(used)}
    owners: dict[tuple[int, int], list[int]] = {}
    for k, face in enumerate(faces):
        for a, b in zip(face, [*face[1:], face[0]], strict=True):
            owners.setdefault((min(a, b), max(a, b)), []).append(k)
    seen = {tuple(sorted(rim)) for rim in rims}
    edges, creases = [], []
    for ends, both in owners.items():
        if len(both) == 2 or ends in seen:
            edges.append([*(index[v] for v in ends), *(both if len(both) == 2 else [*both, -1])])
            creases.append(any(map(crease, both)))
    own = vertices[used]
    return Part(body, color, own, own if stations is None else stations[used],
                tuple(np.array([index[v] for v in face]) for face in faces), _corners(faces, index), _corners(hidden, index),
                np.array(edges), np.array(creases))


def _corners(faces: Sequence[Sequence[int]], place: Mapping[int, int]) -> np.ndarray:
    """Four corners of each face, all around it."""
    return np.array([[place[face[k * len(face) // 4]] for k in range(4)] for face in faces], dtype=int).reshape(-1, 4)


def _finer(values: np.ndarray, points: np.ndarray | None = None) -> np.ndarray:
    """Rows at more stations, equally far apart along points (default: the rows themselves)."""
    points = values if points is None else points
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    wanted = np.unique(np.concatenate([lengths, np.linspace(0, lengths[-1], _BENDING)]))
    return np.column_stack([np.interp(wanted, lengths, column) for column in values.T])
