"""Rotation matrices about an axis, and skew-symmetric matrices."""

from __future__ import annotations

from numbers import Integral
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.errors import ArgumentError, NotNormalized, ZeroAxis
from symdyn.rotation.algebra import Algebra, Expressions, algebra_of
from symdyn.rotation.zero import all_zero
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import Angle, Array, Axis, Matrix, Vector

# Largest distance from 1 of the length of a vector given as a unit vector, or of Euler parameters; how far from zero the entries
# of S + S^T of a skew-symmetric S of size 1.
UNIT = 1e-9


def about(axis: Axis, angle: Angle, *, unit: bool = False) -> Array:
    """R (3, 3), the rotation about an axis by an angle, rad: it takes components in b to components in n.

    axis    "X", "Y", "Z" (or 0, 1, 2), or a vector (3,) of any length but zero, in n- or b-components, which are the same
    unit    whether the vector has length 1 already and is not divided by its length, which keeps symbols a_x, a_y, a_z plain
    Numbers may have leading axes: axis (..., 3), angle (...). Rodrigues: R = 1 + sin(angle) S + (1 - cos(angle)) S^2 with
    S = skew(a), a the axis of length 1; about("Z", phi) is [[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]].

    Raises ZeroAxis for a vector of length zero, NotNormalized for numbers with unit=True whose length is not 1 to 1e-9,
    ArgumentError for anything else that is no axis or no angle. Source: lecture, chapters 1.6 and 4.4.

    >>> phi = sp.Symbol("phi", real=True)
    >>> sd.rotation.about("Z", phi)
    Matrix([
    [cos(phi), -sin(phi), 0],
    [sin(phi),  cos(phi), 0],
    [       0,         0, 1]])
    >>> np.round(sd.rotation.about([1, 1, 1], 2 * np.pi / 3) @ [1.0, 0.0, 0.0], 12) + 0.0
    array([0., 1., 0.])
    """
    number = axis_number(axis)
    algebra = algebra_of(angle) if number is not None else algebra_of(axis, angle)
    angle = algebra.read(angle, (), "the angle")
    if number is not None:
        return turn(algebra, number, angle)
    a = unit_axis(algebra, axis, unit)
    x, y, z = algebra.components(a)
    c, s = algebra.cos(angle), algebra.sin(angle)
    # 1 - cos loses digits at small angles
    v = 1 - c if isinstance(algebra, Expressions) else 2 * algebra.sin(angle / 2) ** 2
    return algebra.matrix([[c + v * x * x, v * x * y - s * z, v * x * z + s * y],
                           [v * x * y + s * z, c + v * y * y, v * y * z - s * x],
                           [v * x * z - s * y, v * y * z + s * x, c + v * z * z]])


def from_axis_angle(axis: Axis, angle: Angle, *, unit: bool = False) -> Array:
    """R (3, 3) from axis and angle, rad: the same as about(axis, angle).

    >>> bool((sd.rotation.from_axis_angle([0, 3, 4], 0.5) == sd.rotation.about([0, 3, 4], 0.5)).all())
    True
    """
    return about(axis, angle, unit=unit)


def turn(algebra: Algebra, axis: int, angle: Any) -> Any:
    """R (3, 3) about a coordinate axis 0, 1, 2."""
    c, s = algebra.cos(angle), algebra.sin(angle)
    rows = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    i, j = (axis + 1) % 3, (axis + 2) % 3
    rows[i][i], rows[i][j], rows[j][i], rows[j][j] = c, -s, s, c
    return algebra.matrix(rows)


def axis_number(axis: Any) -> int | None:
    """0, 1 or 2 of a coordinate axis given by letter or number; None of anything that may be a vector."""
    if isinstance(axis, str):
        if axis.upper() in ("X", "Y", "Z"):
            return "XYZ".index(axis.upper())
        raise ArgumentError(f"there is no axis {shown(axis)}; pass 'X', 'Y', 'Z', the numbers 0, 1, 2, or a vector of 3 "
                            "components")
    if isinstance(axis, (Integral, sp.Integer)) and not isinstance(axis, bool):
        if int(axis) in (0, 1, 2):
            return int(axis)
        raise ArgumentError(f"there is no axis {axis}; the numbers of the axes are 0, 1, 2 for X, Y, Z")
    return None


def unit_axis(algebra: Algebra, axis: Any, unit: bool = False) -> Any:
    """The axis (3,) of length 1 from a letter, number or vector."""
    number = axis_number(axis)
    if number is not None:
        return algebra.vector([int(k == number) for k in range(3)])
    a = algebra.read(axis, (3,), "the axis")
    if isinstance(algebra, Expressions):
        if all_zero(a):
            raise ZeroAxis(f"the axis {tuple(a)} has length 0 and no direction; pass a vector with a component other than zero")
        return a if unit else a / sp.sqrt(sum(component**2 for component in a))
    if unit:
        length = norm(a)
        if (abs(length - 1) > UNIT).any():
            worst = float(length.flat[np.argmax(abs(length - 1))])
            raise NotNormalized(f"the axis given with unit=True has length {worst:.12g}, not 1 to {UNIT:g}; "
                                "leave out unit=True and it is divided by its length")
    return unit_numbers(a)


def unit_numbers(v: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) divided by their lengths, or ZeroAxis; neither large nor tiny components overflow."""
    largest = abs(v).max(axis=-1, keepdims=True)
    if (largest == 0).any():
        raise ZeroAxis("the axis (0, 0, 0) has length 0 and no direction; pass a vector with a component other than zero")
    scaled = v / largest
    return scaled / norm(scaled)[..., None]


def norm(v: np.ndarray) -> np.ndarray:
    """The lengths (...) of vectors (..., n); infinite where they overflow."""
    with np.errstate(over="ignore"):
        return np.sqrt((v * v).sum(axis=-1))


def skew(v: Vector) -> Array:
    """S (3, 3) with S a = v x a; numbers may have leading axes. Raises ArgumentError for anything but three components.

    >>> sd.rotation.skew([1.0, 2.0, 3.0]) @ [4.0, 5.0, 6.0]
    array([-3.,  6., -3.])
    >>> np.cross([1.0, 2.0, 3.0], [4.0, 5.0, 6.0])
    array([-3.,  6., -3.])
    """
    algebra = algebra_of(v)
    x, y, z = algebra.components(algebra.read(v, (3,), "the vector"))
    return algebra.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def vee(S: Matrix) -> Array:
    """v (3,) with S = skew(v): the inverse of skew; numbers may have leading axes.

    Raises ArgumentError if numbers are not skew-symmetric to 1e-9 of their size. Expressions with symbols are not checked:
    entries (3, 2), (1, 3) and (2, 1) are taken.

    >>> sd.rotation.vee(sd.rotation.skew([1.0, 2.0, 3.0]))
    array([1., 2., 3.])
    """
    algebra = algebra_of(S)
    rows = algebra.entries(algebra.read(S, (3, 3), "the skew-symmetric matrix"))
    if not (isinstance(algebra, Expressions) and any(entry.free_symbols for row in rows for entry in row)):
        _check_skew(rows)
    return algebra.vector([rows[2][1], rows[0][2], rows[1][0]])


def _check_skew(rows: list[list[Any]]) -> None:
    S = np.array([[np.asarray(entry, dtype=float) for entry in row] for row in rows])
    error, size = abs(S + np.swapaxes(S, 0, 1)).max(initial=0), abs(S).max(initial=0)
    if error > UNIT * max(1.0, size):
        raise ArgumentError(f"the matrix is not skew-symmetric: the largest entry of |S + S^T| is {error:.3g} (allowed is "
                            f"{UNIT:g} of its size {size:.3g}); (S - S^T) / 2 is its skew-symmetric part")


def infinitesimal(delta: Vector) -> Array:
    """1 + skew(delta) (3, 3): the rotation by a small vector delta (3,), rad, to first order.

    Small rotations add and commute; the error is of second order, so that the matrix is no rotation, only near one.
    Source: lecture, chapter 4.3.

    >>> small = [0.0, 0.0, 1e-4]
    >>> bool(np.abs(sd.rotation.infinitesimal(small) - sd.rotation.about("Z", 1e-4)).max() < 1e-8)
    True
    """
    algebra = algebra_of(delta)
    x, y, z = algebra.components(algebra.read(delta, (3,), "the small rotation"))
    return algebra.matrix([[1, -z, y], [z, 1, -x], [-y, x, 1]])
