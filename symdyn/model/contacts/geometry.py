"""Gap, normal, tangents and point of a contact as expressions of positions and orientations of its bodies.

The gap g is the distance along the normal n, which points from body b to body a. The rows of a contact are the components of the
relative velocity of the material points that touch, along n and the tangents; for distances that along n is the rate of the gap,
since the touching points move along their surfaces only (envelope theorem). The gap of a point over a curve or surface is the
distance to first order; while it touches rigidly it is on the curve. In a compliant contact it may be deep, and n is the gradient
of the gap, so that the normal force is that of a potential; round shapes have their distance there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import UnsupportedExpression
from symdyn.model.contacts.compliance import positive_part
from symdyn.model.contacts.contact import Contact
from symdyn.model.contacts.grid import Spline, grid_spline_of, line_spline_of
from symdyn.model.contacts.shapes import Bore, Box, Cam, Curve, Cylinder, Disc, Plane, Point, Shape, Sphere, Surface, Torus
from symdyn.model.contacts.touching import Implicit, circle_of_points, touching_of
from symdyn.model.faults import Faults
from symdyn.model.quantity import Measure, Place, Quantity
from symdyn.model.symbols import Moving, time
from symdyn.shown import shown

Triple = tuple[sp.Expr, sp.Expr, sp.Expr]

# Square of a distance from the middle of a bore, m^2, below which the normal loses its direction.
CENTRED = sp.Rational(1, 10**30)
# Pieces of a spline in one variable that are written out; of more a function looks for the piece.
WRITTEN_OUT = 12
# Splines of a cam end as they begin to this part.
NEARLY = 1e-9
# Variables of heights: real, and of names that no parameter has.
REAL = (sp.Symbol("abscissa x", real=True), sp.Symbol("abscissa y", real=True))
# Points of a circle and of a sphere that show whether it touches elsewhere, too: parts of the radius, and how many all around.
AROUND = 12
NEARBY = (-0.95, -0.7, -0.45, -0.2, 0.2, 0.45, 0.7, 0.95)
RINGS = ((0.4, 6), (0.8, 8))


@dataclass(frozen=True)
class Touch:
    """One place where bodies may touch.

    name       of the contact, with a number where a shape has several
    at         the point of body a that the force is applied from, body axes; lever: from there to the place, n-frame
    gap        m; normal, tangents: n-frame
    width      of a shape that may touch in several places, m; None of others
    """

    name: str
    at: Place
    lever: Triple
    gap: sp.Expr
    normal: Triple
    tangents: tuple[Triple, ...]
    width: sp.Expr | None = None


@dataclass(frozen=True)
class Round:
    """A shape that touches a curve or surface by its curvature: a sphere, or a circle with a tube around it.

    axis   of the circle, body axes; None of a sphere
    """

    radius: sp.Expr
    axis: Triple | None = None
    tube: sp.Expr = sp.S.Zero


class Geometry:
    """Expressions of one contact.

    fixed    whether the ground does not move
    faults   what is wrong with numbers and directions is added to it
    """

    def __init__(self, contact: Contact, planar: bool, fixed: bool, faults: Faults) -> None:
        self.contact, self.planar, self.fixed, self.faults = contact, planar, fixed, faults
        self.a, self.b = (str(getattr(body, "name", body)) for body in (contact.a, contact.b))
        self.yields = contact.law == "compliant"
        self._spline = _spline_of(f"{contact.name}_height", contact.on_b)

    def touches(self) -> list[Touch]:
        """The places of the contact, each with its expressions."""
        shape: Shape = self.contact.on_a
        name = self.contact.name
        if isinstance(shape, Box):
            half = [self._number(e, "size") / 2 for e in shape.size]
            center = self._vector(shape.center, "center")
            half += [sp.S.Zero] * (3 - len(half))
            signs = product((-1, 1), (-1, 1), (0,) if self.planar else (-1, 1))
            corners = [[c + s * h for c, s, h in zip(center, one, half, strict=True)] for one in signs]
            return [self._touch(f"{name}_{k + 1}", tuple(corner), sp.S.Zero) for k, corner in enumerate(corners)]
        if isinstance(shape, Point):
            return [self._touch(name, self._vector(shape.at, "point"), sp.S.Zero)]
        radius, center = self._number(shape.radius, "radius"), self._vector(shape.center, "center")
        if isinstance(shape, Sphere):
            return [self._touch(name, center, radius)]
        axis = _unit(self._vector(shape.axis, "axis"))
        if axis is None:
            self.faults.append(f"{self.contact.where}: the axis is zero; pass a direction")
            axis = (sp.S.Zero, sp.S.Zero, sp.S.One)
        if isinstance(shape, Disc):
            return [self._edge(name, center, axis, radius)]
        if isinstance(shape, Torus):
            return [self._edge(name, center, axis, radius, self._number(shape.tube, "tube"))]
        assert isinstance(shape, Cylinder)
        half_length = self._number(shape.length, "length") / 2
        ends = [_add(center, _scaled(axis, s * half_length)) for s in (1, -1)]
        return [self._edge(f"{name}_{k + 1}", end, axis, radius) for k, end in enumerate(ends)]

    def place(self, touch: Touch) -> Triple:
        """Where body a touches, n-frame."""
        return _add(self._position(self.a, touch.at), touch.lever)

    def rows(self, touch: Touch) -> tuple[sp.Expr, ...]:
        """Relative velocity of the touching points along the normal, then along the tangents."""
        velocity_a = _add(self._velocity(self.a, touch.at), _cross(self._omega(self.a), touch.lever))
        place = self.place(touch)
        origin = (sp.S.Zero,) * 3
        if self._still(self.b):
            relative = velocity_a
        else:
            arm = _add(place, self._position(self.b, origin), -1)
            velocity_b = _add(self._velocity(self.b, origin), _cross(self._omega(self.b), arm))
            relative = _add(velocity_a, velocity_b, -1)
        return tuple(_dot(direction, relative) for direction in (touch.normal, *touch.tangents))

    # -- kinds

    def _touch(self, name: str, at: Place, radius: sp.Expr) -> Touch:
        """A point or sphere of body a against what body b has."""
        other, place = self.contact.on_b, self._position(self.a, at)
        if isinstance(other, Plane):
            gap, normal, tangents = self._from_plane(other, place)
        elif isinstance(other, Sphere):
            center = self._position(self.b, self._vector(other.center, "center on b"))
            arm = _add(place, center, -1)
            distance = sp.sqrt(_dot(arm, arm))
            gap = distance - self._number(other.radius, "radius on b")
            normal = _scaled(arm, 1 / distance)
            tangents = self._tangents(normal)
        elif isinstance(other, Bore):
            arm = _add(place, self._position(self.b, self._vector(other.center, "center on b")), -1)
            distance = sp.sqrt(_dot(arm, arm) + CENTRED)
            gap = self._number(other.radius, "radius on b") - distance
            normal = _scaled(arm, -1 / distance)
            tangents = self._tangents(normal)
        elif isinstance(other, Cam):
            return self._outside_cam(name, at, radius)
        else:
            return self._above_graph(name, at, None if radius == 0 else Round(radius))
        return Touch(name, at, _scaled(normal, -radius), gap - radius, normal, tangents)

    def _edge(self, name: str, center: Place, axis: Triple, radius: sp.Expr, tube: sp.Expr = sp.S.Zero) -> Touch:
        """A circle, with a tube around it, against what body b has."""
        other = self.contact.on_b
        if isinstance(other, (Sphere, Bore)):
            return self._edge_and_sphere(name, center, axis, radius, tube)
        if isinstance(other, Surface):
            return self._above_graph(name, center, Round(radius, axis, tube))
        assert isinstance(other, Plane)
        gap, normal, tangents = self._from_plane(other, self._position(self.a, center))
        lever = _lowest(Round(radius, self._turned(self.a, axis), tube), normal)
        return Touch(name, center, lever, gap + _dot(normal, lever), normal, tangents)

    def _edge_and_sphere(self, name: str, center: Place, axis: Triple, radius: sp.Expr, tube: sp.Expr) -> Touch:
        """The point of a circle that is nearest to the centre of a sphere, in a bore the one that is furthest from it: along what
        is across the axis of the arm between the centres."""
        other, e = self.contact.on_b, self._turned(self.a, axis)
        inside = isinstance(other, Bore)
        arm = _add(self._position(self.a, center), self._position(self.b, self._vector(other.center, "center on b")), -1)
        across = _add(arm, _scaled(e, _dot(arm, e)), -1)
        to_circle = _scaled(across, (radius if inside else -radius) / sp.sqrt(_dot(across, across)))
        reach = _add(arm, to_circle)
        distance = sp.sqrt(_dot(reach, reach))
        normal = _scaled(reach, (-1 if inside else 1) / distance)
        of_b = self._number(other.radius, "radius on b")
        gap = (of_b - distance if inside else distance - of_b) - tube
        return Touch(name, center, _add(to_circle, _scaled(normal, tube), -1), gap, normal, self._tangents(normal))

    def _from_plane(self, plane: Plane, place: Triple) -> tuple[sp.Expr, Triple, tuple[Triple, ...]]:
        default = (0, 1, 0) if self.planar else (0, 0, 1)
        unit = _unit(self._vector(default if plane.normal is None else plane.normal, "normal"))
        if unit is None:
            self.faults.append(f"{self.contact.where}: the normal of the plane is zero; pass a direction")
            unit = _unit(default)
            assert unit is not None
        point = self._vector(plane.point, "point of the plane")
        gap = _dot(self._turned(self.b, unit), _add(place, self._position(self.b, point), -1))
        own = ((unit[1], -unit[0], sp.S.Zero),) if self.planar else _across(unit)
        return gap, self._turned(self.b, unit), tuple(self._turned(self.b, t) for t in own)

    def _above_graph(self, name: str, at: Place, shape: Round | None) -> Touch:
        """A point, or what is round about it, above a curve or surface of body b."""
        graph: Any = self.contact.on_b
        symbols = REAL[:1] if isinstance(graph, Curve) else REAL
        height = self._height(graph, symbols)
        local = self._in_b(_add(self._position(self.a, at), self._position(self.b, (sp.S.Zero,) * 3), -1))
        n = len(symbols)
        if height is None:
            height = sp.S.Zero
        touching: tuple[sp.Expr, ...] = local[:n]
        if shape is not None:
            if shape.axis is not None:
                shape = Round(shape.radius, self._in_b(self._turned(self.a, shape.axis)), shape.tube)
            touching, height = self._touching(symbols, height, local[:n + 1], shape)
        steep, size = _normal(symbols, height)
        at_point = dict(zip(symbols, touching, strict=True))
        normal = (steep[0].xreplace(at_point), steep[1].xreplace(at_point), steep[2].xreplace(at_point))
        lever = (sp.S.Zero,) * 3 if shape is None else _lowest(shape, normal)
        over, size = local[n] + lever[n] - height.xreplace(at_point), size.xreplace(at_point)
        gap = over / size
        tangents = ((normal[1], -normal[0], sp.S.Zero),) if self.planar else self._tangents(normal)
        if self.yields and shape is None:
            up = sp.Symbol("ordinate", real=True)
            slopes = _gradient((up - height) / _normal(symbols, height)[1], (*symbols, up))
            normal = tuple([e.xreplace({**at_point, up: local[n]}) for e in slopes])
        elif self.yields:
            gap = over * sp.Piecewise((size, over < 0), (1 / size, True))
        return Touch(name, at, self._turned(self.b, lever), gap, self._turned(self.b, normal),
                     tuple(self._turned(self.b, t) for t in tangents),
                     None if shape is None else shape.radius + shape.tube)

    def _height(self, graph: Any, symbols: Sequence[sp.Symbol]) -> sp.Expr | None:
        """f of a curve or surface, in these symbols; None, with faults, where there is none."""
        where, kind = self.contact.where, type(graph).__name__
        given = [graph.x] if isinstance(graph, Curve) else [graph.x, graph.y]
        if not all(isinstance(s, sp.Symbol) for s in given) or len(set(given)) < len(given):
            self.faults.append(f"{where}: the abscissa of a {kind} is {', '.join(map(shown, given))}; pass the symbols that its "
                               "height is written in")
            return None
        if self._spline is not None:
            return self._spline.at(*symbols)
        if isinstance(graph, Curve) and is_spline(graph.height):
            return _polynomials(graph.height, symbols[0])
        return self._written(graph.height, dict(zip(given, symbols, strict=True)), "height")

    def _written(self, value: Any, symbols: Mapping[sp.Symbol, sp.Symbol], what: str) -> sp.Expr | None:
        """An expression of what is fixed to body b, in other symbols; None, with faults, where it moves or jumps."""
        where, before, kind = self.contact.where, len(self.faults), type(self.contact.on_b).__name__
        result = self.faults.expression(value, f"{where}: {what}").xreplace(dict(symbols))
        moving = sorted(str(s) for s in result.free_symbols if isinstance(s, Moving) or s == time)
        if moving:
            self.faults.append(f"{where}: the {what} depends on {', '.join(moving)}; a {kind} is fixed to its body: write it by "
                               f"{', '.join(map(str, symbols))} and parameters, and let the body move")
        if any(result.diff(s).atoms(sp.Derivative, sp.Subs, sp.DiracDelta) for s in symbols.values()):
            self.faults.append(f"{where}: the {what} {shown(value)} has no slope everywhere; leave out what jumps, such as Mod, "
                               "floor and sign")
        return result if len(self.faults) == before else None

    def _touching(self, symbols: Sequence[sp.Symbol], height: sp.Expr, center: Sequence[sp.Expr],
                  shape: Round) -> tuple[tuple[sp.Expr, ...], sp.Expr]:
        """Where a shape touches, along x (and y) of body b, and the height with the functions that it calls; center: in b."""
        parameters = sorted(height.free_symbols - set(symbols), key=lambda s: s.name)
        n = len(symbols)
        axis = () if shape.axis is None else shape.axis
        tube = [shape.tube] * (shape.tube != 0)
        up = center[n:] if self.yields else ()
        given = (*center[:n], shape.radius, *tube, *axis, *parameters, *up)
        names = [*["c_x", "c_y"][:n], "radius", *["tube"][:len(tube)], *["e_x", "e_y", "e_z"][:len(axis)],
                 *[f"parameter_{k + 1}" for k in range(len(parameters))]]
        known = tuple(sp.Symbol(name, real=True) for name in names)
        above = tuple(sp.Symbol("c_up", real=True) for _ in up)
        unknowns = tuple(sp.Symbol(name, real=True) for name in ("s_x", "s_y")[:n])

        def implicit(spline: Spline | None) -> Implicit:
            f = height if spline is None else spline.at(*symbols)
            f = f.xreplace(dict(zip((*symbols, *parameters), (*unknowns, *known[len(known) - len(parameters):]), strict=True)))
            normal, _ = _normal(unknowns, f)
            own = Round(known[n], known[-len(parameters) - 3:len(known) - len(parameters)] if axis else None,
                        known[n + 1] if tube else sp.S.Zero)
            lever = _lowest(own, normal)

            def value(offset: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
                there = [c + o for c, o in zip(known, offset[:n], strict=False)]
                return (*there, offset[n] - f.xreplace(dict(zip(unknowns, there, strict=True))))

            residual = tuple(s - c - o for s, c, o in zip(unknowns, known, lever, strict=False))
            others = [value(offset) for offset in _other_points(own, lever, normal, n)]
            nearest = tuple(k - f.diff(s) * sp.Min(0, c + lever[n] - f) for c in above
                            for s, k in zip(unknowns, residual, strict=True))
            return Implicit(unknowns, (*known, *above), own.radius + own.tube, lever[n] - f, residual, tuple(others), nearest)

        result = self._found(implicit, given, "surface" if n == 2 else "curve", self._spline)
        if result is None:
            return tuple(center[:n]), height
        return result[0], height if result[1] is None else result[1].at(*symbols)

    def _found(self, implicit: Callable[[Spline | None], Implicit], given: Sequence[sp.Expr], what: str,
               spline: Spline | None = None) -> tuple[tuple[sp.Expr, ...], Spline | None] | None:
        """The unknowns of a touching point as functions of what is given; None, with a fault, where they have no text."""
        try:
            result, together = touching_of(f"touching_{self.contact.name}", f"contact {self.contact.name}: the {what}", implicit,
                                           spline)
        except UnsupportedExpression as error:
            self.faults.append(f"{self.contact.where}: {error}")
            return None
        return tuple(result.applied(given)), together

    def _outside_cam(self, name: str, at: Place, radius: sp.Expr) -> Touch:
        """A point, or a circle around it, outside a closed curve of body b, in polar coordinates; see Tangent."""
        x, y, _ = self._in_b(_add(self._position(self.a, at), self._position(self.b, (sp.S.Zero,) * 3), -1))
        phi, (R, slope) = sp.atan2(y, x), self._radius_of_cam(self._spline)
        if radius != 0:
            parameters = sorted(R.free_symbols - {REAL[0]}, key=lambda s: s.name)
            phi, spline = self._touching_cam(parameters, phi, sp.sqrt(x**2 + y**2), radius)
            if spline is not None:
                R, slope = self._radius_of_cam(spline)
        far = sp.sqrt(x**2 + y**2)
        tangent = _tangent(R.xreplace({REAL[0]: phi}), slope.xreplace({REAL[0]: phi}), radius)
        c, s = sp.cos(phi), sp.sin(phi)

        def turned(along: sp.Expr, across: sp.Expr) -> Triple:
            return along * c - across * s, along * s + across * c, sp.S.Zero

        normal, gap = turned(*tangent.normal), (far - tangent.reach) * tangent.steep
        across = (normal[1], -normal[0], sp.S.Zero)
        if self.yields and radius == 0:
            away, general = sp.Symbol("distance", real=True), _tangent(R, slope, radius)
            steep, turning, _ = _gradient((away - general.reach) * general.steep, (away, REAL[0]))
            normal = turned(*[e.xreplace({away: far, REAL[0]: phi}) for e in (steep, turning / away)])
        elif self.yields:
            reach = _reach(R.xreplace({REAL[0]: phi}), tangent, far)
            gap = sp.Piecewise((reach - radius, reach < radius), (gap, True))
        return Touch(name, at, self._turned(self.b, _scaled(normal, -radius)), gap, self._turned(self.b, normal),
                     (self._turned(self.b, across),), None if radius == 0 else radius)

    def _radius_of_cam(self, spline: Spline | None) -> tuple[sp.Expr, sp.Expr]:
        """R of a cam and its derivative, in REAL[0]; a circle, with faults, where there is none."""
        cam, where, phi = self.contact.on_b, self.contact.where, REAL[0]
        if not isinstance(cam.angle, sp.Symbol):
            self.faults.append(f"{where}: the angle of a Cam is {shown(cam.angle)}; pass the symbol that its radius is written "
                               "in")
            return sp.S.One, sp.S.Zero
        if spline is not None:
            ends = [float(v) for v in cam.radius.x[[0, -1]]]
            values = [[float(cam.radius(v, order)) for order in (0, 1)] for v in ends]
            apart = np.abs(np.subtract(values[0], values[1])).max()
            if abs(ends[1] - ends[0] - 2 * np.pi) > NEARLY or apart > NEARLY * abs(values[0][0]):
                self.faults.append(f"{where}: the spline of a Cam goes from {ends[0]:g} to {ends[1]:g} rad and from "
                                   f"{values[0][0]:g} to {values[1][0]:g} m; pass one over a turn that ends as it begins: "
                                   "CubicSpline(..., bc_type='periodic')")
            half = sp.Float(ends[0]) + sp.pi
            within = {phi: half + sp.atan2(sp.sin(phi - half), sp.cos(phi - half))}
            return spline.at(phi).xreplace(within), spline.at(phi).diff(phi).xreplace(within)
        R = self._written(cam.radius, {cam.angle: phi}, "radius")
        if R is not None and not _is_periodic(R, phi):
            self.faults.append(f"{where}: the radius {shown(cam.radius)} of a Cam has not the period 2 pi; write it by sines and "
                               "cosines, or pass a spline over a turn, CubicSpline(..., bc_type='periodic')")
        return (sp.S.One, sp.S.Zero) if R is None else (R, R.diff(phi))

    def _touching_cam(self, parameters: Sequence[sp.Symbol], psi: sp.Expr, far: sp.Expr,
                      radius: sp.Expr) -> tuple[sp.Expr, Spline | None]:
        """The angle at which a circle touches a cam, by that of its centre, which is so far away; and the spline that stands with
        it in one text."""
        named = [sp.Symbol(f"parameter_{k + 1}", real=True) for k in range(len(parameters))]
        center, away, r, phi = (sp.Symbol(name, real=True) for name in ("psi", "distance", "radius", "phi"))
        names = dict(zip((REAL[0], *parameters), (phi, *named), strict=True))

        def implicit(spline: Spline | None) -> Implicit:
            R, slope = (e.xreplace(names) for e in self._radius_of_cam(spline))
            tangent, others = _tangent(R, slope, r), []
            for share in NEARBY:
                angle = center + sp.Float(share) * r / away
                there = R.xreplace({phi: angle})
                square = r**2 - (there * sp.sin(angle - center))**2
                reach = there * sp.cos(angle - center) + sp.sqrt(positive_part(square))
                others.append((angle, sp.Piecewise((-reach, square > 0), (0, True))))
            known, residual = (center, away, r, *named), (phi + tangent.turned - center,)
            deep = _tangent(R, slope, sp.Min(r, _reach(R, tangent, away)))
            return Implicit((phi,), known, sp.S.One, -tangent.reach, residual, tuple(others),
                            (phi + deep.turned - center,) if self.yields else ())

        result = self._found(implicit, (psi, far, radius, *parameters), "cam", self._spline)
        return (psi, None) if result is None else (result[0][0], result[1])

    def _in_b(self, v: Triple) -> Triple:
        """A vector of the n-frame in the axes of body b."""
        return v if self._still(self.b) else tuple(_dot(column, v) for column in self._columns(self.b))

    def _tangents(self, n: Triple) -> tuple[Triple, ...]:
        """Across a normal that turns: in space without a singularity but n = -z.

        Source: Frisvad, Building an orthonormal basis from a 3D unit vector without normalization, 2012.
        """
        if self.planar:
            return ((n[1], -n[0], sp.S.Zero),)
        x, y, z = n
        return (1 - x**2 / (1 + z), -x * y / (1 + z), -x), (-x * y / (1 + z), 1 - y**2 / (1 + z), -y)

    # -- bodies

    def _still(self, body: str) -> bool:
        return body == "ground" and self.fixed

    def _columns(self, body: str) -> tuple[Triple, ...]:
        def entry(i: int, j: int) -> sp.Expr:
            if self.planar and 2 in (i, j):
                return sp.Integer(i == j)
            return Quantity(Measure("rotation_matrix", (body,), index=(i, j)))

        return tuple((entry(0, j), entry(1, j), entry(2, j)) for j in range(3))

    def _turned(self, body: str, v: Triple) -> Triple:
        """A vector in body axes in the n-frame."""
        if self._still(body):
            return v
        columns = self._columns(body)
        return _add(_add(_scaled(columns[0], v[0]), _scaled(columns[1], v[1])), _scaled(columns[2], v[2]))

    def _position(self, body: str, at: Place) -> Triple:
        return tuple(at) if self._still(body) else self._components("position", body, at, 0)

    def _velocity(self, body: str, at: Place) -> Triple:
        return self._components("position", body, at, 1)

    def _components(self, kind: str, body: str, at: Place, order: int) -> Triple:
        result = [Quantity(Measure(kind, (body,), (tuple(at),), (k,), order)) for k in range(2 if self.planar else 3)]
        return (*result, sp.S.Zero)[:3]

    def _omega(self, body: str) -> Triple:
        result = [Quantity(Measure("angular_velocity", (body,), index=(k,))) for k in range(3)]
        return (sp.S.Zero, sp.S.Zero, result[2]) if self.planar else (result[0], result[1], result[2])

    # -- numbers

    def _number(self, value: Any, what: str) -> sp.Expr:
        return self.faults.expression(value, f"{self.contact.where}: {what}")

    def _vector(self, value: Any, what: str) -> Triple:
        return tuple(self.faults.vector(value, f"{self.contact.where}: {what}", self.planar))


def _lowest(shape: Round, normal: Sequence[sp.Expr]) -> Triple:
    """From the centre to the point that is furthest against a normal: -r n of a sphere, -r (n - (n e) e)/sqrt(1 - (n e)^2) of a
    circle, further by -tube n with a tube around it."""
    if shape.axis is None:
        return _scaled(normal, -shape.radius)
    along = _dot(normal, shape.axis)
    in_plane = _add(normal, _scaled(shape.axis, along), -1)
    return _add(_scaled(in_plane, -shape.radius / sp.sqrt(1 - along**2)), _scaled(normal, shape.tube), -1)


def _normal(symbols: Sequence[sp.Symbol], height: sp.Expr) -> tuple[Triple, sp.Expr]:
    """The unit normal of y = f(x) or z = f(x, y), and sqrt(1 + f'^2)."""
    slopes = [height.diff(s) for s in symbols]
    size = sp.sqrt(1 + sp.Add(*[s**2 for s in slopes]))
    entries = [*[-s / size for s in slopes], 1 / size, sp.S.Zero]
    return (entries[0], entries[1], entries[2]), size


@dataclass(frozen=True)
class Tangent:
    """A circle that touches a closed curve at the angle phi: there the curve is R e_r, its normal n along R e_r - R' e_phi.

    normal   n along e_r and e_phi; its centre is at R e_r + r n, at the distance `reach`, turned from phi by `turned`
    steep    n along the way to the centre: the distance to first order is the way along it times this
    """

    normal: tuple[sp.Expr, sp.Expr]
    reach: sp.Expr
    turned: sp.Expr
    steep: sp.Expr


def _reach(R: sp.Expr, tangent: Tangent, distance: sp.Expr) -> sp.Expr:
    """Distance along the normal of a closed curve of a point that has this distance from its middle; see Tangent."""
    along = R * tangent.normal[0]
    return sp.sqrt(positive_part(distance**2 - R**2 + along**2)) - along


def _tangent(R: sp.Expr, slope: sp.Expr, r: sp.Expr) -> Tangent:
    size = sp.sqrt(R**2 + slope**2)
    n = (R / size, -slope / size)
    center = (R + r * n[0], r * n[1])
    reach = sp.sqrt(center[0]**2 + center[1]**2)
    return Tangent(n, reach, sp.atan2(center[1], center[0]), (n[0] * center[0] + n[1] * center[1]) / reach)


def _gradient(gap: sp.Expr, symbols: Sequence[sp.Symbol]) -> Triple:
    """By coordinates, of which there are two or three."""
    slopes = [*[gap.diff(s) for s in symbols], sp.S.Zero]
    return slopes[0], slopes[1], slopes[2]


def _other_points(shape: Round, lever: Triple, normal: Triple, n: int) -> list[tuple[sp.Expr, ...]]:
    """Points of a shape from its centre, along x (and y) and upwards."""
    if shape.axis is not None:
        to_circle = _add(lever, _scaled(normal, shape.tube))
        turned = _cross(shape.axis, to_circle)
        return [_add(_add(_scaled(to_circle, c), _scaled(turned, s)), _scaled(normal, shape.tube), -1)
                for c, s in ((sp.Float(c), sp.Float(s)) for c, s in circle_of_points(AROUND)[1:])]
    if n == 1:
        return [(sp.Float(k) * shape.radius, -sp.sqrt(1 - sp.Float(k)**2) * shape.radius) for k in NEARBY]
    return [(sp.Float(k * c) * shape.radius, sp.Float(k * s) * shape.radius, -sp.sqrt(1 - sp.Float(k)**2) * shape.radius)
            for k, count in RINGS for c, s in circle_of_points(count)]


def _is_periodic(R: sp.Expr, phi: sp.Symbol) -> bool:
    """Whether an expression has the same values a turn later, at some angles and with some numbers for its parameters."""
    others = sorted(R.free_symbols - {phi}, key=lambda s: s.name)
    at = {s: sp.Float(0.7 + 0.1 * k) for k, s in enumerate(others)}
    for angle in (-3.0, -1.2, 0.4, 1.9, 3.1):
        now, later = (R.xreplace({**at, phi: sp.Float(angle + turn)}).evalf() for turn in (0.0, 2 * math.pi))
        if now.is_Float and later.is_Float and abs(now - later) > NEARLY * abs(now):
            return False
    return True


def _spline_of(label: str, other: Any) -> Spline | None:
    """The function of a spline that body b has; None of expressions, and of curves of few pieces, which are written out."""
    if isinstance(other, Surface):
        return grid_spline_of(label, other.height)
    value: Any = other.height if isinstance(other, Curve) else other.radius if isinstance(other, Cam) else None
    long = is_spline(value) and (isinstance(other, Cam) or len(value.x) > WRITTEN_OUT + 1)
    return line_spline_of(label, value) if long else None


def is_spline(value: Any) -> bool:
    """Whether it has breaks x and coefficients c of polynomials between them, as splines of SciPy."""
    x, c = getattr(value, "x", None), getattr(value, "c", None)
    return (isinstance(x, np.ndarray) and isinstance(c, np.ndarray) and x.ndim == 1 and c.ndim == 2
            and c.shape[1] == len(x) - 1 > 0 and bool(np.isfinite(x).all() and np.isfinite(c).all()))


def _polynomials(spline: Any, x: sp.Symbol) -> sp.Expr:
    """A spline as polynomials piece by piece; beyond its ends those of the ends go on."""
    pieces = []
    for k, column in enumerate(spline.c.T.tolist()):
        at, value = x - sp.Float(float(spline.x[k])), sp.S.Zero
        for coefficient in column:
            value = value * at + sp.Float(coefficient)
        pieces.append((value, x < sp.Float(float(spline.x[k + 1])) if k + 2 < len(spline.x) else True))
    return sp.Piecewise(*pieces)


def _add(a: Sequence[Any], b: Sequence[Any], sign: int = 1) -> Triple:
    return tuple(x + sign * y for x, y in zip(a, b, strict=True))


def _scaled(a: Sequence[Any], k: Any) -> Triple:
    return tuple(k * x for x in a)


def _dot(a: Sequence[Any], b: Sequence[Any]) -> sp.Expr:
    return sp.Add(*[x * y for x, y in zip(a, b, strict=True)])


def _cross(a: Sequence[Any], b: Sequence[Any]) -> Triple:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _unit(v: Sequence[Any]) -> Triple | None:
    size = sp.sqrt(_dot(v, v))
    return None if size == 0 else _scaled(v, 1 / size)


def _across(n: Triple) -> tuple[Triple, Triple]:
    """Two directions across a constant one: from the axis that it has the smallest component along, where these are numbers."""
    sizes = [abs(float(e)) if e.is_number else 1.0 for e in n]
    k = sizes.index(min(sizes))
    if n == (0, 0, 1):
        return (sp.S.One, sp.S.Zero, sp.S.Zero), (sp.S.Zero, sp.S.One, sp.S.Zero)
    axis = tuple(sp.Integer(i == k) for i in range(3))
    first = _unit(_cross(axis, n))
    assert first is not None
    return first, _cross(n, first)
