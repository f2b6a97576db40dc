"""Surfaces that contacts touch: planes, curves, surfaces, cams, hollows and balls, as far as bodies get, and how mooring lines
hang."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb

from symdyn.pictures.meshes import Color, Part, line, prism, ribbon, sheet

# The normal, which points to the bodies, and normal @ point of the points of the plane, m; n-frame.
Ground = tuple[np.ndarray, float]

COLOR = "#c4c9d1"
# Parts of the mechanism's length: how far curves and surfaces go on beyond where bodies get, in a plane and in space; how thick
# and how wide a curve is drawn.
_PLANAR, _SPATIAL, _THICK, _HALF = 2.0, 0.3, 0.05, 0.12
# Stations of a curve for a length of the mechanism, of all at most; of a surface along its longer side.
_FINE, _MOST, _GRID = 60, 3000, 40
# Points of a closed curve, and of a circle that stands for a hollow ball.
_AROUND = 180
# Digits of a normal after the point; normals that differ by less, and levels by less of the length, are the same.
_DIGITS, _SAME = 9, 1e-6


@dataclass(frozen=True)
class Line:
    """A mooring line: its unstretched length, m; its weight over EA; friction with the seabed, if it has one."""

    length: float
    give: float
    friction: float
    seabed: bool


@dataclass(frozen=True)
class Surroundings:
    """Surroundings of the bodies of a mechanism.

    planes   of the ground, which stays where it is; floors: in space what of them is below the bodies
    parts    of curves and the like, in the axes of their bodies
    balls    on other bodies or the ground that contacts touch: body, centre in its axes, radius
    lines    mooring lines by the names of their loads
    """

    planes: Sequence[Ground] = ()
    floors: Sequence[Part] = ()
    parts: Sequence[Part] = ()
    balls: Sequence[tuple[int, np.ndarray, float]] = ()
    lines: Mapping[str, Line] = field(default_factory=dict)


@dataclass(frozen=True)
class Reach:
    """Where bodies get.

    bodies      names; frames (n, n_b, 12) at some configurations, centres (n_b, 3) in body axes
    length      of the mechanism, m; further: how far beyond these places bodies may get, of it
    colors      of bodies; coarse: whether few facets are wanted
    """

    bodies: Sequence[str]
    frames: np.ndarray
    centres: np.ndarray
    planar: bool
    length: float
    colors: Callable[[int], str]
    further: float = 0.0
    coarse: bool = False

    def places(self, names: Iterable[str], body: int) -> np.ndarray:
        """Centres of mass and origins of bodies in the axes of another, or of the ground: body -1; (n, 3)."""
        result = []
        for k in (self.bodies.index(name) for name in names):
            o, R = self.frames[:, k, :3], self.frames[:, k, 3:].reshape(-1, 3, 3)
            result += [o, o + R @ self.centres[k]]
        places = np.concatenate(result)
        if body < 0:
            return places
        o, R = self.frames[:, body, :3], self.frames[:, body, 3:].reshape(-1, 3, 3)
        return np.concatenate([np.einsum("tji,tj->ti", R, one - o) for one in result])

    @property
    def margin(self) -> float:
        return self.length * (self.further + (_PLANAR if self.planar else _SPATIAL))


def surroundings_of(records: Sequence[Mapping[str, Any]], reach: Reach, own_ground: bool) -> Surroundings:
    """Visible parts of contacts and mooring lines.

    records      with numbers in place of None; own_ground: whether the user draws the ground
    """
    planes: list[Ground] = []
    parts: list[Part] = []
    balls, lines = [], {}
    for record in records:
        kind, values = record["kind"], {name: np.array(rows, dtype=float) for name, rows in record["values"].items()}
        if kind == "mooring":
            length, give, friction = map(float, values["numbers"][0])
            lines[record["name"]] = Line(length, give, friction, bool(record["seabed"]))
            continue
        body = reach.bodies.index(record["body"]) if record["body"] in reach.bodies else -1
        if (body < 0 and own_ground) or not all(np.isfinite(rows).all() for rows in values.values()):
            continue
        color = to_rgb(COLOR if body < 0 else reach.colors(body))
        if kind == "plane":
            normal = values["normal"][0] / (np.linalg.norm(values["normal"][0]) or 1.0)
            level = float(normal @ values["point"][0])
            if body < 0:
                _add(planes, (np.round(normal, _DIGITS) + 0.0, level), reach.length)
            else:
                parts.append(plane_part((normal, level), reach.places(record["on"], body), reach, body, color))
        elif kind == "sphere":
            balls.append((body, values["center"][0], float(values["radius"][0, 0])))
        elif kind == "bore":
            parts += _bore(values["center"][0], float(values["radius"][0, 0]), reach, body, color)
        else:
            height = _height(record)
            made = None if height is None else _graph(kind, height, reach.places(record["on"], body), reach, body, color)
            parts += [] if made is None or any(_equal(made, part) for part in parts) else [made]
    floors = [] if reach.planar else [plane_part(plane, reach.places(reach.bodies, -1), reach, -1, to_rgb(COLOR))
                                      for plane in planes]
    return Surroundings(planes, floors, parts, balls, lines)


def plane_part(plane: Ground, places: np.ndarray, reach: Reach, body: int, color: Color) -> Part:
    """The part of a plane below places (n, 3) of what may touch it, in the axes of its body."""
    normal, level = plane
    first = np.cross(normal, [0.0, 0.0, 1.0]) if reach.planar else np.cross(np.eye(3)[np.abs(normal).argmin()], normal)
    first = first / np.linalg.norm(first)
    second = np.cross(normal, first)
    low, high = _range(places @ np.column_stack([first, second]), reach)
    if reach.planar:
        ends = level * normal + np.array([[high[0]], [low[0]]]) * first
        return ribbon(body, color, ends, -_THICK * reach.length * normal, _HALF * reach.length)
    a, b = (np.linspace(low[k], high[k], 9) for k in range(2))
    return sheet(body, color, level * normal + a[:, None, None] * first + b[None, :, None] * second, 1)


def _add(planes: list[Ground], plane: Ground, length: float) -> None:
    normal, level = plane
    if not any(np.abs(normal - other).max() <= _SAME and abs(level - height) <= _SAME * length for other, height in planes):
        planes.append(plane)


def _equal(a: Part, b: Part) -> bool:
    return a.body == b.body and a.vertices.shape == b.vertices.shape and bool(np.allclose(a.vertices, b.vertices))


def _range(along: np.ndarray, reach: Reach) -> tuple[np.ndarray, np.ndarray]:
    """Ends of what is drawn below places (n, m) along some directions."""
    return along.min(axis=0) - reach.margin, along.max(axis=0) + reach.margin


def _bore(center: np.ndarray, radius: float, reach: Reach, body: int, color: Color) -> Iterator[Part]:
    """A ring in a plane; in space circles about the axes, through which the body inside is seen."""
    angles = np.linspace(0.0, 2 * np.pi, _AROUND + 1)
    circle = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    if reach.planar:
        thick = min(_THICK * reach.length, radius)
        yield ribbon(body, color, center + radius * circle, thick * circle, _HALF * reach.length, ground=False)
        return
    for k in range(3):
        yield line(body, color, center + radius * np.roll(circle, k, axis=1), 1.0)


def _graph(kind: str, height: Callable[..., np.ndarray], places: np.ndarray, reach: Reach, body: int,
           color: Color) -> Part | None:
    """The part of a curve, surface or cam; None where it is not finite."""
    with np.errstate(all="ignore"):
        if kind == "cam":
            angles = 2 * np.pi * np.arange(_AROUND) / _AROUND
            r = height(angles)
            made = np.column_stack([r * np.cos(angles), r * np.sin(angles), 0 * angles])
            return prism(body, color, made, _HALF / 2 * reach.length) if np.isfinite(made).all() else None
        low, high = _range(places[:, :2], reach)
        if kind == "curve":
            count = int(np.clip(_FINE * (high[0] - low[0]) / (5 * reach.length if reach.coarse else reach.length), 2, _MOST))
            x = np.linspace(low[0], high[0], count + 1)
            made = np.column_stack([x, height(x), 0 * x])
            made = made[np.isfinite(made).all(axis=1)]  # a bowl ends where its rim is
            down = np.array([0.0, -_THICK * reach.length, 0.0])
            return ribbon(body, color, made, down, _HALF * reach.length) if len(made) > 1 else None
        sides = high[:2] - low[:2]
        n, m = np.maximum(np.ceil((_GRID // 3 if reach.coarse else _GRID) * sides / sides.max()), 2).astype(int)
        x, y = np.meshgrid(np.linspace(low[0], high[0], n + 1), np.linspace(low[1], high[1], m + 1), indexing="ij")
        made = np.stack([x, y, height(x, y)], axis=-1)
        return sheet(body, color, made, 1 if reach.coarse else 4) if np.isfinite(made).all(axis=2).any() else None


def _height(record: Mapping[str, Any]) -> Callable[..., np.ndarray] | None:
    """A height or radius as a function of arrays; None where its text is no expression that is known here."""
    import sympy as sp  # where there are curves: pictures of kept modules need no SymPy

    from symdyn.datafile.expressions import Wrong, parsed
    from symdyn.model.contacts.grid import grid_spline, piece_spline
    from symdyn.model.surroundings import ABSCISSAE

    given, numbers = record["height"], record["values"]["parameters"][0]
    if not isinstance(given, str):
        knots, coefficients = [np.array(t) for t in given["knots"]], np.array(given["coefficients"])
        if len(knots) == 1:
            ends = knots[0][[0, -1]]
            turned = (lambda x: ends[0] + np.mod(x - ends[0], 2 * np.pi)) if record["kind"] == "cam" else (lambda x: x)
            return lambda x: np.asarray(piece_spline(knots[0], coefficients, turned(x), 0), dtype=float)
        return lambda x, y: np.asarray(grid_spline(knots, given["degrees"], coefficients, (x, y), (0, 0)), dtype=float)
    symbols = {name: sp.Symbol(name) for name in (*ABSCISSAE, *[f"p{k + 1}" for k in range(len(numbers))])}
    try:
        height = sp.lambdify(list(symbols.values()), parsed(given, symbols), ["numpy", "scipy"])
    except Wrong:
        return None

    def of(x: np.ndarray, y: Any = 0.0) -> np.ndarray:
        return np.broadcast_to(np.asarray(height(x, y, *numbers), dtype=float), np.shape(x))

    return of
