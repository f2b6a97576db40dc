"""Shapes: what bodies look like in pictures. They have no part in the equations.

    system.draw(tower, sd.shapes.Cylinder([0, 0, 0], [0, 0, 77.6], 3.0, 1.9), color="0.9")

Lengths are numbers or expressions of parameters that the mechanism has anyway; pictures take the values of the run.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from symdyn.model.faults import Faults
from symdyn.model.symbols import symbols_of
from symdyn.shown import name_of, shown

# Text that may be a colour: #rrggbb, a grey level such as 0.8, or a name; which names there are is known to what draws.
_COLOR = re.compile(r"#[0-9a-fA-F]{6}|[01]?\.?\d+|[A-Za-z: ]+")
Row = tuple[sp.Expr, ...]
# Vertices of a mesh: pages hold indices of two bytes.
MOST = 20_000


@dataclass(frozen=True)
class Shape:
    """A shape in the axes of its body."""

    def values(self, faults: Faults, what: str, planar: bool) -> dict[str, tuple[Row, ...]]:
        """Its lengths as rows of expressions, by name; faults collects what is wrong with them."""
        raise NotImplementedError

    @property
    def about(self) -> dict[str, Any]:
        """The rest of the description: kind, and what is no number."""
        raise NotImplementedError


@dataclass(frozen=True)
class Box(Shape):
    """A box with edges along the body axes: size (3,) and centre (3,), m; hole: (2,) along x and y of an opening through its
    middle along z, such as a moonpool.

    >>> system = sd.systems.pendulum()
    >>> shape = sd.shapes.Box([0.2, 0.2, 0.2], center=[0, -1, 0])
    >>> system.draw("bob", shape, color="0.7")
    >>> shape.size, len(system.shapes)
    ([0.2, 0.2, 0.2], 1)
    """

    size: Any
    center: Any = (0, 0, 0)
    hole: Any = None

    def values(self, faults: Faults, what: str, planar: bool) -> dict[str, tuple[Row, ...]]:
        size = tuple(faults.vector(self.size, f"{what}: size"))
        _positive(faults, size, f"{what}: size")
        center = _point(faults, self.center, f"{what}: center", planar)
        result: dict[str, tuple[Row, ...]] = {"size": (size,), "center": (center,)}
        if self.hole is not None:
            hole = faults.expressions(self.hole, f"{what}: hole")
            if len(hole) != 2:
                faults.append(f"{what}: hole has {len(hole)} components; pass 2, its lengths along x and y")
                return result
            _positive(faults, hole, f"{what}: hole")
            for k, axis in enumerate("xy"):
                if (hole[k] - size[k]).is_nonnegative:
                    faults.append(f"{what}: hole is {hole[k]} m long along {axis}, and the box {size[k]} m; make it smaller")
            result["hole"] = (hole,)
        return result

    @property
    def about(self) -> dict[str, Any]:
        return {"kind": "box"}


@dataclass(frozen=True)
class Cylinder(Shape):
    """A cylinder or cone from the centre of one end to that of the other, (3,) each, with the radii there, m.

    >>> system = sd.systems.pendulum()
    >>> shape = sd.shapes.Cylinder([0, 0, 0], [0, -1, 0], radius_start=0.05, radius_end=0.02)
    >>> system.draw("bob", shape, color="0.7")
    >>> shape.radius_end, len(system.shapes)
    (0.02, 1)
    """

    start: Any
    end: Any
    radius_start: Any
    radius_end: Any = None

    def values(self, faults: Faults, what: str, planar: bool) -> dict[str, tuple[Row, ...]]:
        a, b = [_point(faults, p, f"{what}: {name}", planar) for p, name in ((self.start, "start"), (self.end, "end"))]
        radii = [faults.expression(self.radius_start, f"{what}: radius_start")]
        radii.append(radii[0] if self.radius_end is None else faults.expression(self.radius_end, f"{what}: radius_end"))
        _positive(faults, radii, f"{what}: radius", least=False)
        _apart(faults, a, b, what)
        return {"points": (a, b), "widths": tuple((2 * r, 2 * r) for r in radii)}

    @property
    def about(self) -> dict[str, Any]:
        return {"kind": "sweep"}


@dataclass(frozen=True)
class Blade(Shape):
    """A blade with elliptic sections from start to end, (3,) each.

    chords      widths at two or more stations that share the length equally, m
    direction   (3,) of the chords; thickness: of a section, as a part of its chord

    >>> system = sd.systems.pendulum()
    >>> shape = sd.shapes.Blade([0, 0, 0], [0, -1, 0], chords=[0.1, 0.2, 0.05], direction=[1, 0, 0])
    >>> system.draw("bob", shape, color="0.7")
    >>> shape.chords, len(system.shapes)
    ([0.1, 0.2, 0.05], 1)
    """

    start: Any
    end: Any
    chords: Sequence[Any]
    direction: Any = (0, 1, 0)
    thickness: Any = 0.2

    def values(self, faults: Faults, what: str, planar: bool) -> dict[str, tuple[Row, ...]]:
        a, b = [_point(faults, p, f"{what}: {name}", planar) for p, name in ((self.start, "start"), (self.end, "end"))]
        chords = faults.expressions(self.chords, f"{what}: chords")
        thickness = faults.expression(self.thickness, f"{what}: thickness")
        _positive(faults, [*chords], f"{what}: chord", least=False)
        _positive(faults, [thickness], f"{what}: thickness")
        _apart(faults, a, b, what)
        direction = _point(faults, self.direction, f"{what}: direction", planar)
        if not any(direction):
            faults.append(f"{what}: direction is zero; pass that of the chords")
        if len(chords) < 2:
            faults.append(f"{what}: chords has {len(chords)} entries; pass at least two, at the start and at the end")
            return {}
        parts = [sp.Rational(k, len(chords) - 1) for k in range(len(chords))]
        return {"points": tuple(tuple(p + w * (q - p) for p, q in zip(a, b, strict=True)) for w in parts),
                "widths": tuple((c, c * thickness) for c in chords), "direction": (direction,)}

    @property
    def about(self) -> dict[str, Any]:
        return {"kind": "sweep"}


@dataclass(frozen=True)
class Line(Shape):
    """A line through points, (n, 3) each; width in points of print.

    to   a body (or its name) and a point on it, (3,), that the line goes on to: a rope between two bodies

    >>> system = sd.systems.pendulum()
    >>> shape = sd.shapes.Line([[0, 0], [0, -1]], width=3)
    >>> system.draw("bob", shape, color="0.7")
    >>> shape.points, len(system.shapes)
    ([[0, 0], [0, -1]], 1)
    """

    points: Sequence[Any]
    width: float = 1.5
    to: tuple[Any, Any] | None = None

    def values(self, faults: Faults, what: str, planar: bool) -> dict[str, tuple[Row, ...]]:
        given = list(self.points) if hasattr(self.points, "__iter__") and not isinstance(self.points, str) else []
        points = tuple(_point(faults, p, f"{what}: point {k + 1}", planar) for k, p in enumerate(given))
        if len(points) + (self.to is not None) < 2:
            faults.append(f"{what}: points has {len(points)} points; pass at least two of three components")
        if isinstance(self.width, bool) or not isinstance(self.width, (int, float)) or not 0 < self.width < 100:
            faults.append(f"{what}: width is {shown(self.width)}; pass a number of points of print between 0 and 100")
        if self.to is None:
            return {"points": points}
        if not (isinstance(self.to, (tuple, list)) and len(self.to) == 2):
            faults.append(f"{what}: to is {shown(self.to)}; pass a body and a point on it")
            return {"points": points}
        return {"points": points, "end": (_point(faults, self.to[1], f"{what}: end", planar),)}

    @property
    def about(self) -> dict[str, Any]:
        ends = isinstance(self.to, (tuple, list)) and len(self.to) == 2
        return {"kind": "line", "width": self.width,
                "to": getattr(self.to[0], "name", self.to[0]) if ends else None}  # type: ignore[index]


@dataclass(frozen=True)
class Mesh(Shape):
    """Triangles: vertices (n, 3) in m, numbers; faces (m, 3), indices of vertices, counter-clockwise from outside.

    It may have any form; pictures that are drawn without depth sort its triangles by their distance.

    >>> system = sd.systems.pendulum()
    >>> shape = sd.shapes.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> system.draw("bob", shape, color="0.7")
    >>> len(shape.faces), len(system.shapes)
    (4, 1)
    """

    vertices: Any
    faces: Any

    def values(self, faults: Faults, what: str, planar: bool) -> dict[str, tuple[Row, ...]]:
        vertices, faces = self._arrays()
        if vertices is None or vertices.shape[1:] != (3,) or not len(vertices) or not np.isfinite(vertices).all():
            faults.append(f"{what}: vertices is {shown(self.vertices)}; pass finite numbers, (n, 3)")
        elif faces is None or faces.shape[1:] != (3,) or not len(faces) or faces.min() < 0 or faces.max() >= len(vertices):
            faults.append(f"{what}: faces is {shown(self.faces)}; pass (m, 3) indices from 0 to {len(vertices) - 1}")
        elif len(vertices) > MOST:
            faults.append(f"{what}: it has {len(vertices)} vertices; pass {MOST} at most")
        return {}

    def _arrays(self) -> tuple[np.ndarray | None, np.ndarray | None]:
        try:
            faces = np.array(self.faces)
            return np.array(self.vertices, dtype=float), faces if faces.dtype.kind in "iu" else None
        except (TypeError, ValueError):
            return None, None

    @property
    def about(self) -> dict[str, Any]:
        vertices, faces = self._arrays()
        if vertices is None or faces is None:
            return {"kind": "mesh", "vertices": [], "faces": []}
        short = [[float(f"{v:.5g}") for v in row] for row in np.atleast_2d(vertices).tolist()]
        return {"kind": "mesh", "vertices": short, "faces": np.atleast_2d(faces).tolist()}


@dataclass(frozen=True)
class Water(Shape):
    """The water surface z = level of the n-frame, for the ground; size: (2,) along x and y, m, or None: the whole picture.

    waves   regular ones, which pages show: (amplitude, frequency, length) or (amplitude, frequency, length, heading, ramp), in m,
            rad/s, m, rad, s: the surface is amplitude cos(frequency t - 2 pi s / length) above the level, s along the heading,
            which is an angle from x about z; within the time of the ramp it grows from nothing, by (1 - cos(pi t / ramp)) / 2;
            without a ramp, or with 0, it is there at once

    >>> system = sd.systems.pendulum()
    >>> shape = sd.shapes.Water(size=[4, 4], level=-2)
    >>> system.draw(system.ground, shape, color="0.7")
    >>> shape.level, len(system.shapes)
    (-2, 1)
    """

    size: Any = None
    level: Any = 0
    center: Any = (0, 0)
    waves: Any = None

    def values(self, faults: Faults, what: str, planar: bool) -> dict[str, tuple[Row, ...]]:
        if planar:
            faults.append(f"{what}: a water surface z = level is in sight in systems in space only; leave it out")
        result: dict[str, tuple[Row, ...]] = {"level": ((faults.expression(self.level, f"{what}: level"),),)}
        if self.waves is not None:
            waves = faults.expressions(self.waves, f"{what}: waves")
            if len(waves) not in (3, 5):
                faults.append(f"{what}: waves has {len(waves)} entries; pass (amplitude, frequency, length), or "
                              "(amplitude, frequency, length, heading, ramp)")
            else:
                _positive(faults, waves[2:3], f"{what}: length of waves")
                result["waves"] = (waves if len(waves) == 5 else (*waves, sp.S.Zero, sp.S.Zero),)
        if self.size is None:
            return result
        size = faults.expressions(self.size, f"{what}: size")
        size = size * 2 if len(size) == 1 else size
        center = faults.expressions(self.center, f"{what}: center")
        for name, value in (("size", size), ("center", center)):
            if len(value) != 2:
                faults.append(f"{what}: {name} has {len(value)} components; pass 2, along x and y")
        _positive(faults, size, f"{what}: size")
        return {**result, "size": (size,), "center": (center,)}

    @property
    def about(self) -> dict[str, Any]:
        return {"kind": "water"}


@dataclass(frozen=True)
class Drawn:
    """A shape of a body, checked: rows of expressions by name; about: kind, and what is no number.

    body   the body or its name; what: for messages
    """

    body: Any
    what: str
    color: Any
    values: Mapping[str, tuple[Row, ...]]
    about: Mapping[str, Any]

    @property
    def expressions(self) -> Iterator[sp.Expr]:
        """Its lengths that are no plain numbers, in order."""
        return (e for rows in self.values.values() for row in rows for e in row if symbols_of(e))

    @property
    def record(self) -> dict[str, Any]:
        """Plain data; None stands for a length that follows from parameters, see `expressions`."""
        return {"body": str(getattr(self.body, "name", self.body)), "color": self.color, **self.about,
                "values": {name: [[None if symbols_of(e) else float(e) for e in row] for row in rows]
                           for name, rows in self.values.items()}}


def drawn(faults: Faults, body: Any, shapes: Sequence[Any], color: Any, planar: bool) -> list[Drawn]:
    """The checked shapes of a body."""
    name = name_of(body)
    if isinstance(color, (tuple, list)):
        color = [float(c) if isinstance(c, (int, float)) else c for c in color]
        known = len(color) == 3 and all(isinstance(c, float) and 0 <= c <= 1 for c in color)
    else:
        known = color is None or (isinstance(color, str) and _COLOR.fullmatch(color) is not None)
    if not known:
        faults.append(f"draw: the colour of {shown(name)} is {shown(color)}; pass text such as '#3377aa', '0.8' or 'orange', "
                      "or three "
                      "numbers from 0 to 1")
        color = None
    if not shapes:
        faults.append(f"draw was given no shape for {shown(name)}; pass shapes such as sd.shapes.Box([2, 1, 1])")
    result = []
    for shape in shapes:
        if not isinstance(shape, Shape):
            faults.append(f"draw: a shape of {shown(name)} is {shown(shape)}; pass shapes such as sd.shapes.Box([2, 1, 1])")
            continue
        what = f"{type(shape).__name__} of {shown(name)}"
        if isinstance(shape, Water) and name != "ground":
            faults.append(f"{what}: the water surface stays in place; draw it on system.ground")
        result.append(Drawn(body, what, color, shape.values(faults, what, planar), shape.about))
    return result


def _point(faults: Faults, value: Any, what: str, planar: bool) -> Row:
    return tuple(faults.vector(value, what, planar))


def _positive(faults: Faults, values: Sequence[sp.Expr], what: str, least: bool = True) -> None:
    """Complains of numbers below zero, with `least` of zero as well."""
    for e in values:
        if e.is_negative or (least and e.is_zero):
            faults.append(f"{what} is {e}; pass a {'positive length' if least else 'length from zero on'}, m")


def _apart(faults: Faults, a: Row, b: Row, what: str) -> None:
    if a == b:
        faults.append(f"{what}: start and end are the same point {tuple(a)}; pass two different points")
