"""The solids that a mechanism looks like, as faces and edges: those of the page for pictures and films."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.colors import to_rgb

from symdyn.pictures.looks import Item, Mechanism, looks_of
from symdyn.pictures.mechanism import Hung, Posed
from symdyn.pictures.meshes import Part, box, globe, line, sweep
from symdyn.pictures.ropes import POINTS, mooring, rope

# Bands of a ball, and the turns of a coil with their points.
_BANDS = 8
# Angle from its poles at which a ball is cut off, rad.
_POLE = 0.06
# Corners around rods, and around what is as wide as it likes: wheels and bodies without a joint.
_ROD, _WHEEL = 16, 48
_TURNS, _PER_TURN = 9, 12
# Width of the wire of a coil and of a force's line, in points of print.
_WIRE, _THREAD = 1.4, 1.2
# A damper's cylinder and its piston rod, of its size; next to a spring it is as slim.
_CYLINDER, _PISTON, _SLIM = 0.8, 0.35, 0.5


@dataclass(frozen=True)
class Form:
    """A piece of an item: a part of unit size, which `place` puts where the item is.

    part   vertices: along z from 0 to 1 between two ends, or around the origin from -1 to 1
    item   what it is a piece of; ends: which shares of the way between its ends it takes; radii: at these, m
    """

    part: Part
    item: Item
    ends: tuple[float, float] = (0.0, 1.0)
    radii: tuple[float, float] = (1.0, 1.0)

    def place(self, posed: Posed, up: np.ndarray) -> np.ndarray:
        """The vertices, n-frame, (n, 3)."""
        item, own = self.item, self.part.vertices
        a = posed.at(item.ends[0])
        if item.kind == "rope":
            return rope(a, posed.at(item.ends[1]), item.size[1], up)
        if item.kind == "mooring":
            _, shown, length, give, friction, seabed = item.size
            return mooring(a, posed.at(item.ends[1]), length, give, friction, bool(seabed), shown)
        if item.kind == "ball":
            return np.asarray(a + item.size[0] * own)
        if item.kind in ("block", "box", "ellipsoid"):
            return np.asarray(a + (own * item.size) @ self._turned(posed).T)
        if item.kind in ("pin", "disc"):
            half = item.size[1] * posed.axes[item.axis]
            a, b = a - half, a + half
        elif item.kind == "stand":
            a, b = a - item.size[1] * up, a
        else:
            b = posed.at(item.ends[1])
        if item.kind == "line":  # the beginning of what goes far beyond the picture
            way = b - a
            b = a + way * min(1.0, item.size[1] / (float(np.linalg.norm(way)) or 1.0))
        a, b = a + self.ends[0] * (b - a), a + self.ends[1] * (b - a)
        way = b - a
        length = float(np.linalg.norm(way))
        if length == 0.0:
            return np.broadcast_to(a, own.shape).copy()
        z = way / length
        x, y = across(z)
        radii = self.radii[0] + (self.radii[1] - self.radii[0]) * own[:, 2:]
        return np.asarray(a + radii * own[:, :1] * x + radii * own[:, 1:2] * y + own[:, 2:] * way)

    def _turned(self, posed: Posed) -> np.ndarray:
        if self.item.kind == "block":
            z = posed.axes[self.item.axis]
            x, y = across(z)
            return np.column_stack([x, y, z])
        (body, *_), own = self.item.ends[0], np.array(self.item.turn).reshape(3, 3)
        return np.asarray(posed.rotations[body] @ own)


@dataclass(frozen=True)
class Forms:
    """All solids of a mechanism and what they hang on.

    up   the direction in which stands rise; length of the mechanism, m; far: indices of points that pictures need not show
    """

    forms: Sequence[Form]
    hung: Hung
    up: np.ndarray
    length: float
    far: Sequence[int] = ()

    @classmethod
    def of(cls, m: Mechanism, inertia: bool = False) -> Forms:
        """Forms of a mechanism that are always shown; inertia: with the ellipsoids of inertia."""
        layers = ("", "inertia") if inertia else ("",)
        with np.errstate(all="ignore"):
            items, length = looks_of(m)
        return cls([form for item in items if item.layer in layers for form in _forms(item)], Hung.of(m), np.array(m.up), length,
                   m.anchors)

    def vertices(self, origins: np.ndarray, rotations: np.ndarray) -> list[np.ndarray]:
        """Vertices of every part at one time; origins (n_b + 1, 3) and rotations (n_b + 1, 3, 3), the last the ground's."""
        posed = self.hung.at(origins, rotations)
        return [form.place(posed, self.up) for form in self.forms]

    def near(self, origins: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        """Points at all times that pictures show, (n_t, n, 3); origins (n_t, n_b + 1, 3), rotations (n_t, n_b + 1, 3, 3)."""
        owners, places = (np.delete(rows, self.far, axis=0) for rows in (self.hung.owners, self.hung.places))
        return np.asarray(origins[:, owners] + np.einsum("tnij,nj->tni", rotations[:, owners], places))


def across(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors across a unit vector, which turn with it."""
    x = np.cross([0.0, 0.0, 1.0] if abs(z[2]) < 0.9 else [1.0, 0.0, 0.0], z)
    x = x / np.linalg.norm(x)
    return x, np.cross(z, x)


def _forms(item: Item) -> list[Form]:
    color, size, body = to_rgb(item.color), item.size, item.body
    if item.kind == "ball":
        return [Form(_ball(body, color), item)]
    if item.kind == "ellipsoid":
        return [Form(globe(body, color), item)]
    if item.kind in ("block", "box"):
        (made,) = box(body, color, np.full(3, 2.0), np.zeros(3))
        return [Form(made, item)]
    alone = len(item.ends) == 2 and all(isinstance(end, tuple) and isinstance(end[0], int) for end in item.ends)
    rod = _rod(body, color, _WHEEL if alone or item.kind == "disc" else _ROD)
    if item.kind in ("pin", "disc"):
        return [Form(rod, item, radii=(size[0], size[0]))]
    if item.kind == "stand":
        return [Form(rod, item, radii=(size[0], size[0] / 4))]
    if item.kind == "rod":
        return [Form(rod, item, radii=(size[0], size[1]))]
    if item.kind in ("thread", "line"):
        return [Form(line(body, color, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), _THREAD), item)]
    if item.kind in ("rope", "mooring"):
        return [Form(line(body, color, np.zeros((POINTS, 3)), _THREAD), item)]
    result = []
    if item.kind in ("spring", "both"):
        result.append(Form(_coil(body, color), item, radii=(size[0], size[0])))
    if item.kind in ("damper", "both"):
        r = size[0] * (_SLIM if item.kind == "both" else 1.0)
        result += [Form(rod, item, ends, (share * r, share * r)) for ends, share in
                   (((0.0, 0.55), _CYLINDER), ((0.55, 1.0), _PISTON))]
    return result


def _rod(body: int, color: tuple[float, float, float], around: int) -> Part:
    return sweep(body, color, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.full((2, 2), 2.0), around=around)


def _ball(body: int, color: tuple[float, float, float]) -> Part:
    angles = np.concatenate([[_POLE], np.pi * np.arange(1, _BANDS) / _BANDS, [np.pi - _POLE]])
    points = np.column_stack([0 * angles, 0 * angles, -np.cos(angles)])
    made = sweep(body, color, points, np.repeat(2 * np.sin(angles), 2).reshape(-1, 2))
    return replace(made, creases=np.zeros(len(made.creases), dtype=bool))


def _coil(body: int, color: tuple[float, float, float]) -> Part:
    """A wire from z = 0 to 1, straight at its ends."""
    s = np.linspace(0.0, 1.0, _TURNS * _PER_TURN + 1)
    radius = np.where((s > 0.08) & (s < 0.92), 1.0, 0.0)
    angle = 2 * np.pi * _TURNS * s
    return line(body, color, np.column_stack([radius * np.cos(angle), radius * np.sin(angle), s]), _WIRE)
