"""A small still picture of a mechanism as SVG: the solids of the page by lines, circles and polygons, seen by the same camera."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np
from matplotlib.colors import to_hex, to_rgb
from scipy.spatial import ConvexHull

from symdyn.pictures.grounds import Ground
from symdyn.pictures.looks import GROUND, PALETTE, Item, Mechanism, looks_of
from symdyn.pictures.mechanism import filled
from symdyn.pictures.meshes import Part, parts_of
from symdyn.pictures.ropes import rope
from symdyn.pictures.solids import color_of

_WIDE, _HIGH, _MARGIN = 260, 200, 12
# The camera of the page: azimuth and elevation.
_AZIMUTH, _ELEVATION = -0.95, 0.34
# Room for a block that is alone on its rail, in its own sizes.
_AROUND = 3.0
# Radius of a circle at least, pixels.
_LEAST = 3.0
# Ground in the plane: its thickness, pixels; its colour.
_THICK, _GROUND_COLOR = 8.0, "#d1d5db"
# Cosine to the eye below which a face is seen from its edge.
_EDGEWISE = 1e-6
# Part of a colour that is left on faces turned away from the light.
_SHADE = 0.62

# Depth, points, half the width in m, of a wire the width in pixels, colour, and what is drawn through the points.
Shape = tuple[float, np.ndarray, float, str, str]


def picture_of(m: Mechanism, records: Sequence[Mapping[str, Any]], lengths: np.ndarray, name: str) -> str:
    """The mechanism as an SVG element; records: shapes of the user's, with lengths in place of None."""
    items, _ = looks_of(m)
    axes = _camera(m)
    # At the same depth rules draw over shapes: a particle over its track.
    shapes = [shape for record in filled(records, lengths) if record["kind"] != "water"
              for shape in _of_record(m, record, axes, name)]
    shapes += [shape for item in items if not item.layer for shape in _of_item(m, item, axes)]
    shapes += _around(m, axes)
    if not shapes:
        return ""
    # A rail that leaves the picture does not make the rest small.
    room = [(points, 0.0 if kind == "wire" else wide) for _, points, wide, _, kind in shapes if kind not in ("rail", "ground")]
    seen = np.concatenate([end for points, wide in room or [(shapes[0][1], 0.0)] for end in (points - wide, points + wide)])
    low, high = seen.min(axis=0), seen.max(axis=0)
    # A block without a mechanism: its rail distinguishes it from a box. A ball alone is no particle where it fills the picture.
    alone = len(room) == 1 and (len(shapes) > 1 or shapes[0][-1] == "circle")
    span = np.maximum((high - low) * (_AROUND if alone else 1.0), 1e-9)
    scale = min((_WIDE - 2 * _MARGIN) / span[0], (_HIGH - 2 * _MARGIN) / span[1])
    middle = (low + high) / 2
    drawn = "".join(_ground(m, plane, axes, scale, middle) for plane in m.around.planes)
    drawn += "".join(_text(points, wide, color, kind, scale, middle) for _, points, wide, color, kind in
                     sorted(shapes, key=lambda shape: (shape[0], shape[-1] != "rail")))  # a rail goes through its block
    return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDE} {_HIGH}" width="{_WIDE}" height="{_HIGH}" role="img" '
            f'aria-label="{escape(name)}">{drawn}</svg>')


def _camera(m: Mechanism) -> np.ndarray:
    """Rows: to the right, upward, to the eye."""
    up = np.array(m.up)
    ahead = np.array([0.0, 0.0, 1.0]) if m.planar else np.eye(3)[1 if abs(up[0]) > 0.9 else 0]
    azimuth, elevation = (0.0, 0.0) if m.planar else (_AZIMUTH, _ELEVATION)
    flat = np.cos(azimuth) * ahead + np.sin(azimuth) * np.cross(up, ahead)
    eye = np.cos(elevation) * flat + np.sin(elevation) * up
    right = np.cross(up, eye) / np.linalg.norm(np.cross(up, eye))
    return np.array([right, np.cross(eye, right), eye])


def _of_item(m: Mechanism, item: Item, axes: np.ndarray) -> Iterator[Shape]:
    ends = [m.at(end) for end in item.ends]
    kind, size = item.kind, item.size
    if kind in ("pin", "disc"):
        axis = m.joint_axes[item.axis]
        yield from _hull(ends[0] + _ring(axis, size[0], size[1]), axes, item.color)
    elif kind == "ball":
        yield float(ends[0] @ axes[2]), (axes[:2] @ ends[0])[None], size[0], item.color, "circle"
    elif kind in ("block", "box"):
        if kind == "block":
            z = m.joint_axes[item.axis]
            x, y = _across(z)
            own = np.column_stack([x, y, z])
        else:
            body = item.ends[0][0]
            R = np.eye(3) if body == GROUND else m.frames[body, 3:].reshape(3, 3)
            own = R @ np.array(item.turn).reshape(3, 3)
        corners = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]) * size
        yield from _hull(ends[0] + corners @ own.T, axes, item.color)
    elif kind == "stand":
        base = ends[0] - size[1] * np.array(m.up)
        ring = _ring(np.array(m.up), 1.0, 0.0)
        yield from _hull(np.concatenate([base + size[0] * ring, ends[0] + size[0] / 4 * ring]), axes, item.color)
    elif kind == "rod" and np.linalg.norm(ends[1] - ends[0]) < size[0]:  # a wheel: its rim, and the face that is seen
        axis = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        toward = float(axis @ axes[2])
        half = float(np.linalg.norm(ends[1] - ends[0])) / 2 * (1.0 if toward > 0 else -1.0)
        middle = (ends[0] + ends[1]) / 2
        yield from _hull(middle + _ring(axis, size[0], half), axes, _shaded(item.color, 0.0))
        if abs(toward) > _EDGEWISE:
            yield from _hull(middle + half * axis + _ring(axis, size[0], 0.0), axes, item.color)
    elif len(ends) == 2 and kind not in ("line", "mooring"):
        rail = isinstance(item.ends[0], tuple) and item.ends[0][0] == "off"
        if kind == "rope":
            ends = list(rope(ends[0], ends[1], size[1], np.array(m.up)))
        if kind in ("spring", "damper", "both"):
            ends = list(_zigzag(ends[0], ends[1], size[0], axes))
        points = np.array(ends)
        wide = size[0] * (0.16 if kind in ("spring", "damper", "both") else 1.0)
        yield float(points.mean(axis=0) @ axes[2]), points @ axes[:2].T, wide, item.color, "rail" if rail else "line"


def _of_record(m: Mechanism, record: Mapping[str, Any], axes: np.ndarray, name: str) -> Iterator[Shape]:
    """Faces of a shape of the user's that are seen, and its lines."""
    body, to = m.index(record["body"]), record.get("to")
    o, R = _frame(m, body)
    color = PALETTE[body % len(PALETTE)] if record["color"] is None else to_hex(color_of(record["color"], name))
    for part in parts_of(record, 0, (0.0, 0.0, 0.0)):
        placed = o + part.vertices @ R.T
        if to is not None:
            p, Q = _frame(m, m.index(to))
            placed[-1] = p + Q @ part.vertices[-1]
        yield from _of_part(part, placed, color, axes)


def _around(m: Mechanism, axes: np.ndarray) -> Iterator[Shape]:
    """Surfaces that contacts touch: the ground behind all bodies."""
    for part in m.around.parts:
        o, R = _frame(m, part.body)
        for depth, points, wide, color, kind in _of_part(part, o + part.vertices @ R.T, str(to_hex(part.color)), axes):
            yield (-np.inf, points, wide, color, "ground") if part.ground else (depth, points, wide, color, kind)


def _of_part(part: Part, placed: np.ndarray, color: str, axes: np.ndarray) -> Iterator[Shape]:
    """Its faces that are seen, or its line; placed: its vertices, n-frame."""
    for face, corners in zip(part.faces, part.corners, strict=True):
        a, b, c, d = placed[corners]
        normal = np.cross(c - a, d - b)
        toward = float(normal @ axes[2]) / (float(np.linalg.norm(normal)) or 1.0)
        toward = abs(toward) if part.open else toward
        if toward > _EDGEWISE:
            points = placed[face]
            yield float(points.mean(axis=0) @ axes[2]), points @ axes[:2].T, 0.0, _shaded(color, toward), "polygon"
    if not part.faces:
        yield float(placed.mean(axis=0) @ axes[2]), placed @ axes[:2].T, part.width, color, "wire"


def _frame(m: Mechanism, body: int) -> tuple[np.ndarray, np.ndarray]:
    """Origin and rotation of a body's frame, or of the ground's."""
    return (np.zeros(3), np.eye(3)) if body == GROUND else (m.frames[body, :3], m.frames[body, 3:].reshape(3, 3))


def _hull(points: np.ndarray, axes: np.ndarray, color: str) -> Iterator[Shape]:
    flat = points @ axes[:2].T
    yield float(points.mean(axis=0) @ axes[2]), flat[ConvexHull(flat).vertices], 0.0, color, "polygon"


def _ring(axis: np.ndarray, radius: float, half: float) -> np.ndarray:
    """Points around both ends of a cylinder about the origin."""
    x, y = _across(axis)
    angles = np.linspace(0, 2 * np.pi, 16, endpoint=False)[:, None]
    circle = radius * (np.cos(angles) * x + np.sin(angles) * y)
    return np.concatenate([circle - half * axis, circle + half * axis]) if half else circle


def _across(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    x = np.cross(np.eye(3)[np.abs(axis).argmin()], axis)
    x = x / np.linalg.norm(x)
    return x, np.cross(axis, x)


def _zigzag(a: np.ndarray, b: np.ndarray, radius: float, axes: np.ndarray) -> Iterator[np.ndarray]:
    side = np.cross(axes[2], b - a)
    side = side / (np.linalg.norm(side) or 1.0)
    yield a
    for k in range(12):
        yield a + (b - a) * (k + 1) / 13 + (radius if k % 2 else -radius) * side
    yield b


def _shaded(color: str, toward: float) -> str:
    red, green, blue = (float(v) * (_SHADE + (1 - _SHADE) * toward) for v in to_rgb(color))
    return str(to_hex((red, green, blue)))


def _ground(m: Mechanism, plane: Ground, axes: np.ndarray, scale: float, middle: np.ndarray) -> str:
    """The ground of a plane from its edge; in space the part of it below the mechanism."""
    normal, level = plane
    centre = m.near_points.mean(axis=0)
    at = centre + (level - normal @ centre) * normal
    far = (_WIDE + _HIGH) / scale
    if m.planar:
        along, down = far * np.cross(normal, [0.0, 0.0, 1.0]), -_THICK / scale * normal
        corners = np.array([at - along, at + along, at + along + down, at - along + down])
    else:
        first, second = _across(normal)
        half = 0.5 * (_WIDE - 2 * _MARGIN) / scale / np.sqrt(2.0)
        corners = at + half * np.array([a * first + b * second for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    return _text(corners @ axes[:2].T, 0.0, _GROUND_COLOR, "polygon", scale, middle)


def _text(points: np.ndarray, wide: float, color: str, kind: str, scale: float, middle: np.ndarray) -> str:
    places = [(_WIDE / 2 + scale * (x - middle[0]), _HIGH / 2 - scale * (y - middle[1])) for x, y in points]
    if kind == "circle":
        return f'<circle cx="{places[0][0]:.1f}" cy="{places[0][1]:.1f}" r="{max(scale * wide, _LEAST):.1f}" fill="{color}"/>'
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
    if kind in ("polygon", "ground"):
        return f'<polygon points="{path}" fill="{color}" stroke="{color}" stroke-width="0.4"/>'
    width = wide if kind == "wire" else max(2 * scale * wide, 1.0)
    return (f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="{width:.1f}" '
            'stroke-linecap="round" stroke-linejoin="round"/>')
