"""Draws the shapes of bodies into axes of a plane or of space."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection

from symdyn.pictures.depth_order import Camera, cut, order, planes
from symdyn.pictures.solids import Solids, Water

_WATER_ALPHA = 0.38
# Strips of water with waves: a wave length's, at most; the width of their edges; how much lighter crests are, and darker troughs.
_PER_WAVE, _MOST_STRIPS, _SEAM, _CREST = 24, 240, 0.0, 0.3
# Part of a colour that is left in the shade, and along edges.
_SHADE, _EDGE = 0.5, 0.6
# Opacity of transparent parts; the width of their outline.
_GLASS_ALPHA, _OUTLINE = 0.28, 0.9


class Scene(PolyCollection):
    """Shapes at one time as polygons of the screen, in the order in which they hide each other.

    Polygons are made again whenever the axes are drawn: they follow the eye.

    shown   axes of the n-frame that the picture has; of two the first is to the right, the second up, and the eye is far away
    up      what is above, in the n-frame; an axis against it is turned over
    """

    def __init__(self, solids: Solids, shown: Sequence[int], up: Sequence[float] = (0.0, 0.0, 1.0), alpha: float = 1.0) -> None:
        super().__init__([], closed=True)
        self._solids, self._opacity, self._spatial = solids, alpha, len(shown) == 3
        self._up = np.array(up)
        self._flat = _facing(shown[0], shown[1], self._up) if len(shown) == 2 else None
        self._places, self._time = solids.vertices(0), float(solids.times[0])
        self.set_in_layout(False)
        self.set_capstyle("round")
        self.set_joinstyle("round")

    def place(self, index: int) -> None:
        """Show the shapes at one of the times."""
        self._places, self._time = self._solids.vertices(index), float(self._solids.times[index])
        self.stale = True

    def do_3d_projection(self) -> float:
        """Make the polygons; axes of space call it before they draw."""
        axes: Any = self.axes
        self._paint(self._flat or Camera.of(axes.get_proj()))
        return 0.0

    def draw(self, renderer: Any) -> None:
        self.do_3d_projection()
        super().draw(renderer)

    def _paint(self, camera: Camera) -> None:
        """Polygons below the water, the water, and those above it; the other way round for an eye under water."""
        water = self._solids.water if self._spatial else None
        low, high = _Pieces(self._opacity), _Pieces(self._opacity)
        light = _light(camera.toward(np.concatenate(self._places).mean(axis=0)), self._up) if self._places else np.zeros(3)
        for k in self._order(camera):
            part, places = self._solids.parts[k], self._places[k]
            normals, offsets = planes(places, part.corners)
            sides = camera.side(normals, offsets)
            if part.open:
                normals, sides = normals * np.sign(sides)[:, None], np.abs(sides)
            seen = np.append((sides > 0) & normals.any(axis=1), False)
            faces, own = np.flatnonzero(seen), part.edges[:, 2:]
            if not part.convex:
                way = camera.toward(places.mean(axis=0))
                middles = [camera.distance(places[part.faces[k]].mean(axis=0), way) for k in faces]
                faces = faces[np.argsort(middles)[::-1]]
            edges = np.where(part.creases, seen[own].any(axis=1) | (own < 0).all(axis=1), seen[own].sum(axis=1) == 1)
            shaded = np.clip(np.array(part.color) * (_SHADE + (1 - _SHADE) * (1 + normals[faces] @ light) / 2)[:, None], 0, 1)
            dark = np.array(part.color) * (_EDGE if len(part.faces) else 1.0)
            flat = camera.project(places)
            z = water.heights(places, self._time) if water is not None else np.zeros(len(places))
            whole = high if z.min() >= 0 else low if z.max() <= 0 else None
            for vertices, color, width in (*((part.faces[k], color, 0.3) for k, color in zip(faces, shaded, strict=True)),
                                           *((ends, dark, part.width) for ends in part.edges[edges, :2])):
                if whole is not None:
                    whole.add(flat[vertices], color, width)
                    continue
                heights = z[vertices]
                if heights.min() >= 0 or heights.max() <= 0:
                    (high if heights.min() >= 0 else low).add(flat[vertices], color, width)
                else:
                    for pieces, points in zip((low, high), cut(places[vertices], heights), strict=True):
                        pieces.add(camera.project(points), color, width)
        surface = _Pieces(1.0, self._opacity * _WATER_ALPHA)
        for strip, color in self._surface(water, camera) if water is not None else ():
            surface.add(camera.project(strip), color, _SEAM if water is not None and water.waves else 0.8)
        above = camera.eye[2] > water.level * camera.eye[3] if water is not None else True
        together = (*((low, surface, high) if above else (high, surface, low)), *self._glass(camera))
        self.set_verts([polygon for pieces in together for polygon in pieces.polygons], closed=True)
        colors: Any = np.array([color for pieces in together for color in pieces.colors]).reshape(-1, 4)
        self.set_facecolor(colors)
        self.set_edgecolor(colors)
        self.set_linewidth([width for pieces in together for width in pieces.widths])

    def _order(self, camera: Camera) -> list[int]:
        """The parts from back to front: the ground behind all that is on it."""
        parts = self._solids.parts
        ground = [k for k, part in enumerate(parts) if part.ground]
        others = [k for k, part in enumerate(parts) if not (part.ground or part.glass)]
        return [*ground, *[others[k] for k in order([parts[k] for k in others], [self._places[k] for k in others], camera)]]

    def _glass(self, camera: Camera) -> tuple[_Pieces, _Pieces]:
        """Transparent parts: the areas within its outlines, and its lines, from back to front."""
        areas, lines = _Pieces(1.0, self._opacity * _GLASS_ALPHA), _Pieces(self._opacity)
        glass = [(part, places) for part, places in zip(self._solids.parts, self._places, strict=True) if part.glass]
        if not glass:
            return areas, lines
        from scipy.spatial import ConvexHull  # other pictures of kept modules need no SciPy

        way = camera.toward(np.concatenate(self._places).mean(axis=0))
        glass.sort(key=lambda one: -camera.distance(one[1].mean(axis=0), way))
        for part, places in glass:
            flat = camera.project(places)
            outline = flat[ConvexHull(flat).vertices]
            areas.add(outline, np.array(part.color), _SEAM)
            dark = _EDGE * np.array(part.color)
            for ends in flat[part.edges[:, :2]]:
                lines.add(ends, dark, part.width)
            for ends in zip(outline, np.roll(outline, -1, axis=0), strict=True):
                lines.add(np.array(ends), dark, _OUTLINE)
        return areas, lines

    def _surface(self, water: Water, camera: Camera) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """The water's rectangle, or its strips along the crests of waves from back to front: corners (n, 3) and colour."""
        axes: Any = self.axes
        (x0, y0), (x1, y1) = water.reach if water.reach is not None else np.sort(
            np.array([axes.get_xlim(), axes.get_ylim()]), axis=1).T
        flat, color = np.array([[x0, y0, water.level], [x1, y0, water.level], [x1, y1, water.level], [x0, y1, water.level]]), \
            np.array(water.color)
        if water.waves is None:
            yield flat, color
            return
        along = flat[:, :2] @ water.heading
        count = int(np.clip(np.ptp(along) / water.waves[2] * _PER_WAVE, _PER_WAVE, _MOST_STRIPS))
        ends = np.linspace(along.min(), along.max(), count + 1)
        toward = camera.toward(flat.mean(axis=0))[:2] @ water.heading
        for k in range(count) if toward > 0 else range(count - 1, -1, -1):
            strip = _between(flat, along, ends[k], ends[k + 1])
            strip[:, 2] += water.elevation(self._time, strip[:, :2] @ water.heading)
            (height,) = water.elevation(self._time, ends[k:k + 2].mean(keepdims=True))
            yield strip, np.clip(color * (1 + _CREST * height / water.waves[0]), 0, 1)


def _between(corners: np.ndarray, along: np.ndarray, low: float, high: float) -> np.ndarray:
    """Part of a rectangle (4, 3) between two lines across a direction; along: of its corners along it."""
    ahead = cut(corners, along - low)[1] if (along < low).any() else corners
    way = np.linalg.lstsq(corners - corners[0], along - along[0], rcond=None)[0]
    places = (ahead - corners[0]) @ way + along[0]
    return np.array(cut(ahead, places - high)[0] if (places > high).any() else ahead)


def _facing(right: int, upward: int, up: np.ndarray) -> Camera:
    """The camera that looks at a plane of two axes, the second of which may point down."""
    matrix = np.eye(4)
    x, y = np.eye(3)[right], np.eye(3)[upward]
    matrix[:3, :3] = [x, y, np.cross(x, y)]
    return Camera(matrix, np.append(np.cross(x, y if up[upward] >= 0 else -y), 0.0))


class _Pieces:
    """Polygons of the screen with their colours and the widths of their edges; pale: what is left of the colours on white."""

    def __init__(self, pale: float, alpha: float = 1.0) -> None:
        self.pale, self.alpha = pale, alpha
        self.polygons: list[np.ndarray] = []
        self.colors: list[tuple[float, ...]] = []
        self.widths: list[float] = []

    def add(self, polygon: np.ndarray, color: np.ndarray, width: float) -> None:
        self.polygons.append(polygon)
        # Pale is mixed with the paper: through what is half transparent its own back would be seen.
        self.colors.append((*(1 - self.pale * (1 - color)), self.alpha))
        self.widths.append(width)


def _light(toward: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Unit vector to the light: above the eye, on its left."""
    right = np.cross(up, toward)
    length = float(np.linalg.norm(right))
    right = right / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])
    light = toward - 0.6 * right + 0.8 * np.cross(toward, right)
    return np.asarray(light / np.linalg.norm(light))
