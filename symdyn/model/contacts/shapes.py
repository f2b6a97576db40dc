"""Shapes of contacts: what touches on body a, and what it touches on body b.

On a: Point, Sphere (in a plane a circle), Disc (its edge), Torus, Cylinder (the edges of its ends), Box (its corners). On b:
Plane, Sphere, Bore, Curve, Surface, Cam. Numbers may be expressions of parameters; points and directions are in body axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import sympy as sp

if TYPE_CHECKING:
    from scipy.interpolate import NdBSpline, PPoly, RectBivariateSpline

    from symdyn.given import Scalar, Vector

ORIGIN, UP = (0, 0, 0), (0, 0, 1)


@dataclass(frozen=True)
class Point:
    """A point of body a.

    at   m, body axes

    >>> sd.contacts.Point([0.5, 0, 0]).at
    [0.5, 0, 0]
    """

    at: Vector = ORIGIN


@dataclass(frozen=True)
class Sphere:
    """A sphere, in a planar system a circle.

    radius   m
    center   m, body axes

    >>> sd.contacts.Sphere(0.1).radius
    0.1
    """

    radius: Scalar
    center: Vector = ORIGIN


@dataclass(frozen=True)
class Disc:
    """The edge of a thin disc on body a, in space.

    radius   m
    axis     of the disc, body axes; center: m, body axes

    >>> sd.contacts.Disc(0.3, axis=[0, 1, 0]).radius
    0.3
    """

    radius: Scalar
    axis: Vector = UP
    center: Vector = ORIGIN


@dataclass(frozen=True)
class Torus:
    """A torus on body a, in space, such as a tyre.

    radius   of the circle in its middle, m; tube: radius of the tube around that, m
    axis     of the torus, body axes; center: m, body axes

    >>> sd.contacts.Torus(0.3, 0.02, axis=[0, 1, 0]).tube
    0.02
    """

    radius: Scalar
    tube: Scalar
    axis: Vector = UP
    center: Vector = ORIGIN


@dataclass(frozen=True)
class Cylinder:
    """The edges of the two ends of a cylinder on body a, in space: two contacts NAME_1 (end along the axis) and NAME_2.

    radius, length   m
    axis             body axes; center: of the cylinder, m, body axes

    >>> sd.contacts.Cylinder(0.1, 0.4).length
    0.4
    """

    radius: Scalar
    length: Scalar
    axis: Vector = UP
    center: Vector = ORIGIN


@dataclass(frozen=True)
class Box:
    """The corners of a box on body a: contacts NAME_1 to NAME_8, in a plane NAME_1 to NAME_4, each for itself.

    size     lengths of the edges along the body axes, m: three, in a plane two
    center   m, body axes

    >>> sd.contacts.Box([0.2, 0.5]).size
    [0.2, 0.5]
    """

    size: Vector
    center: Vector = ORIGIN


@dataclass(frozen=True)
class Plane:
    """A plane fixed to body b, with body a on the side that the normal points to.

    normal   body axes, of any length; default: y in a planar system, z in space
    point    a point of the plane, m, body axes

    >>> sd.contacts.Plane([0, 0, 1]).normal
    [0, 0, 1]
    """

    normal: Vector | None = None
    point: Vector = ORIGIN


@dataclass(frozen=True)
class Bore:
    """The inside of a hollow sphere on body b, in a planar system of a circle: a bearing with clearance around a pin.

    radius   m; center: m, body axes of b

    Body a is inside; the gap of a pin in the middle is the difference of the radii, the clearance, and its normal has no
    direction there.

    >>> sd.contacts.Bore(0.01).radius
    0.01
    """

    radius: Scalar
    center: Vector = ORIGIN


@dataclass(frozen=True)
class Curve:
    """A curve y = f(x) in the axes of body b of a planar system, with body a above it.

    height   f, m, an expression of x and parameters, or a spline such as SciPy's CubicSpline, beyond whose ends the polynomials
             of the ends go on
    x        the symbol of the abscissa

    The gap of a point is (y - f)/sqrt(1 + f'^2), which is the distance to first order and zero on the curve; that of a Sphere is
    the same at the point where it touches, which is found by Newton's method.

    >>> x = sp.Symbol("x")
    >>> sd.contacts.Curve(x**2 / 10, x).height
    x**2/10
    """

    height: Scalar | PPoly
    x: sp.Symbol


@dataclass(frozen=True)
class Surface:
    """A surface z = f(x, y) in the axes of body b, with body a above it; the gap is scaled as that of a Curve.

    height   f, m, an expression of x, y and parameters, or a spline over a grid: SciPy's RectBivariateSpline or NdBSpline, beyond
             whose ends the polynomials of the ends go on
    x, y     symbols of the horizontal coordinates

    >>> x, y = sp.symbols("x y")
    >>> sd.contacts.Surface(x * y, x, y).height
    x*y
    """

    height: Scalar | RectBivariateSpline | NdBSpline
    x: sp.Symbol
    y: sp.Symbol


@dataclass(frozen=True)
class Cam:
    """A closed curve r = R(angle) around the origin of body b of a planar system, with body a outside it: a cam.

    radius   R, m, an expression of the angle and parameters of the period 2 pi, or a spline of SciPy's over one turn, such as
             CubicSpline(angles, radii, bc_type="periodic")
    angle    the symbol of the angle from x towards y of body b, rad

    The gap of a point is the distance to first order, and zero on the cam; that of a Sphere, a roller, the same at the point
    where it touches, which is found by Newton's method.

    >>> angle = sp.Symbol("angle")
    >>> sd.contacts.Cam(0.05 + 0.01 * sp.cos(angle), angle).radius
    0.01*cos(angle) + 0.05
    """

    radius: Scalar | PPoly
    angle: sp.Symbol


Shape = Point | Sphere | Disc | Torus | Cylinder | Box
Counterpart = Plane | Sphere | Bore | Curve | Surface | Cam
