"""Euler parameters p = (theta0, theta1, theta2, theta3): theta0 = cos(angle / 2), the others a sin(angle / 2)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.errors import NotNormalized
from symdyn.rotation.algebra import Algebra, Expressions, Numbers, algebra_of
from symdyn.rotation.euler import frame_of
from symdyn.rotation.matrices import UNIT, axis_number, norm, unit_axis
from symdyn.rotation.proper import as_floats, only_floats, rotation_matrix
from symdyn.rotation.zero import all_zero, vanishes

if TYPE_CHECKING:
    from symdyn.given import Angle, Array, Axis, Matrix, Vector


def E(p: Vector) -> Array:
    """E (3, 4) of any four numbers: R = E E_bar^T, omega in n-components is 2 E p_dot. Source: lecture, chapter 4.5.

    >>> p = [0.5, 0.5, 0.5, 0.5]
    >>> sd.rotation.E(p) @ sd.rotation.E_bar(p).T
    array([[0., 0., 1.],
           [1., 0., 0.],
           [0., 1., 0.]])
    """
    algebra = algebra_of(p)
    e0, e1, e2, e3 = algebra.components(algebra.read(p, (4,), "p"))
    return algebra.matrix([[-e1, e0, -e3, e2], [-e2, e3, e0, -e1], [-e3, -e2, e1, e0]])


def E_bar(p: Vector) -> Array:
    """E_bar (3, 4) of any four numbers: R = E E_bar^T, omega in b-components is 2 E_bar p_dot. Source: lecture, chapter 4.5.

    >>> sd.rotation.E_bar(sp.symbols("e0:4"))
    Matrix([
    [-e1,  e0,  e3, -e2],
    [-e2, -e3,  e0,  e1],
    [-e3,  e2, -e1,  e0]])
    """
    algebra = algebra_of(p)
    e0, e1, e2, e3 = algebra.components(algebra.read(p, (4,), "p"))
    return algebra.matrix([[-e1, e0, e3, -e2], [-e2, -e3, e0, e1], [-e3, e2, -e1, e0]])


def from_parameters(p: Vector) -> Array:
    """R (3, 3) = E E_bar^T of Euler parameters (4,), theta0 first; numbers may have leading axes.

    Numbers are divided by their norm, so that R is a rotation to the last digit; symbols are taken to be of norm 1.
    Raises NotNormalized if the norm of numbers is not 1 to 1e-9. Source: lecture, chapter 4.5.

    >>> sd.rotation.from_parameters([0.5, 0.5, 0.5, 0.5])
    array([[0., 0., 1.],
           [1., 0., 0.],
           [0., 1., 0.]])
    """
    algebra = algebra_of(p)
    p = _kept(algebra, unit_parameters(algebra, p))
    return E(p) @ algebra.transposed(E_bar(p))


def to_parameters(R: Matrix) -> Array:
    """Euler parameters (4,), theta0 first, of a rotation R (3, 3); numbers may have leading axes.

    The same rotation has the parameters p and -p: taken are those with theta0 > 0, or where theta0 is zero those whose first
    component that is not zero is positive. Numbers by the largest component, so that no digits are lost at any angle.
    Expressions with symbols by theta0 = sqrt(1 + trace R) / 2, which holds for every angle but pi (there, if R is so for all
    values of its symbols, by another component).
    Raises NotARotation if |R^T R - 1| of numbers has an entry above 1e-9, det R < 0, or R is not (3, 3).
    Source: lecture, chapter 4.5.

    >>> sd.rotation.to_parameters([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    array([0.5, 0.5, 0.5, 0.5])
    """
    algebra = algebra_of(R)
    R = rotation_matrix(algebra, R)
    if only_floats(algebra, R):
        return sp.Matrix(to_parameters(as_floats(R)).tolist())
    rows = _products(algebra.entries(R))
    if isinstance(algebra, Expressions):
        return _symbolic_parameters(rows)
    K = algebra.matrix(rows)
    largest = np.argmax(np.diagonal(K, axis1=-2, axis2=-1), axis=-1)
    p = np.take_along_axis(K, largest[..., None, None], axis=-2)[..., 0, :]
    return _of_positive_sign(normalized(p))


def compose(p: Vector, r: Vector) -> Array:
    """Euler parameters (4,) of the product of two rotations: R(compose(p, r)) = R(p) R(r).

    The norm of numbers is kept at 1; they may have leading axes. Raises NotNormalized.

    >>> p, r = (sd.rotation.parameters_of_axis_angle("Z", angle) for angle in (0.3, 0.4))
    >>> axis, angle = sd.rotation.axis_angle_of_parameters(sd.rotation.compose(p, r))
    >>> axis, round(float(angle), 12)
    (array([0., 0., 1.]), 0.7)
    """
    algebra = algebra_of(p, r)
    p, r = unit_parameters(algebra, p), unit_parameters(algebra, r)
    a, b, c, d = algebra.components(p)
    w, x, y, z = algebra.components(r)
    return _kept(algebra, algebra.vector([a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y,
                                          a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w]))


def inverse(p: Vector) -> Array:
    """Euler parameters (4,) of the inverse rotation: theta0 and the others with a minus. Raises NotNormalized.

    >>> p = sd.rotation.parameters_of_axis_angle([1, 2, 2], 0.3)
    >>> np.round(sd.rotation.compose(p, sd.rotation.inverse(p)), 12) + 0.0
    array([1., 0., 0., 0.])
    """
    algebra = algebra_of(p)
    e0, e1, e2, e3 = algebra.components(unit_parameters(algebra, p))
    return algebra.vector([e0, -e1, -e2, -e3])


def normalized(p: Vector) -> Array:
    """p (4,) divided by its norm; numbers may have leading axes. Raises NotNormalized for zero, which has no direction.

    >>> sd.rotation.normalized([3.0, 0.0, 4.0, 0.0])
    array([0.6, 0. , 0.8, 0. ])
    """
    algebra = algebra_of(p)
    p = algebra.read(p, (4,), "p")
    zero = "the Euler parameters are (0, 0, 0, 0), which have no direction; pass four numbers that are not all zero"
    if isinstance(algebra, Expressions):
        if all_zero(p):
            raise NotNormalized(zero)
        return p / sp.sqrt(sum(component**2 for component in p))
    largest = abs(p).max(axis=-1, keepdims=True)
    if (largest == 0).any():
        raise NotNormalized(zero)
    scaled = p / largest
    return scaled / norm(scaled)[..., None]


def omega_from_parameters(p: Vector, pd: Vector, frame: str = "n") -> Array:
    """omega (3,) = 2 E p_dot in n-components, 2 E_bar p_dot in b-components.

    p, pd   (4,); what of pd is along p, which would change the norm, has no effect; numbers may have leading axes
    Raises NotNormalized. Source: lecture, chapter 4.5.

    >>> sd.rotation.omega_from_parameters([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.25])
    array([0. , 0. , 0.5])
    """
    algebra, in_n = algebra_of(p, pd), frame_of(frame)
    p, pd = unit_parameters(algebra, p), algebra.read(pd, (4,), "p_dot")
    return algebra.times(2 * (E(p) if in_n else E_bar(p)), pd)


def parameters_rate(p: Vector, omega: Vector, frame: str = "n") -> Array:
    """p_dot (4,) = E^T omega / 2 of omega (3,) in n-components, E_bar^T omega / 2 in b-components; the norm of p stays.

    Numbers may have leading axes. Raises NotNormalized. Source: lecture, chapter 4.5.

    >>> sd.rotation.parameters_rate([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.5])
    array([0.  , 0.  , 0.  , 0.25])
    """
    algebra, in_n = algebra_of(p, omega), frame_of(frame)
    p, omega = unit_parameters(algebra, p), algebra.read(omega, (3,), "omega")
    return algebra.times(algebra.transposed(E(p) if in_n else E_bar(p)), omega) / 2


def parameters_of_axis_angle(axis: Axis, angle: Angle, *, unit: bool = False) -> Array:
    """Euler parameters (4,) = (cos(angle / 2), a sin(angle / 2)); axis, angle and unit as for about.

    An angle beyond pi or below -pi gives a negative theta0. Raises ZeroAxis. Source: lecture, chapter 4.5.

    >>> np.round(sd.rotation.parameters_of_axis_angle("Z", np.pi / 3), 6)
    array([0.866025, 0.      , 0.      , 0.5     ])
    """
    algebra = algebra_of(angle) if axis_number(axis) is not None else algebra_of(axis, angle)
    x, y, z = algebra.components(unit_axis(algebra, axis, unit))
    half = algebra.read(angle, (), "the angle") / 2
    s = algebra.sin(half)
    return algebra.vector([algebra.cos(half), x * s, y * s, z * s])


def unit_parameters(algebra: Algebra, p: Any) -> Any:
    """p (4,), or NotNormalized."""
    p = algebra.read(p, (4,), "p")
    if isinstance(algebra, Numbers):
        size = norm(p)
    elif all(component.is_number for component in p):
        size = np.asarray(float(sp.sqrt(sum(component**2 for component in p)).evalf(30)))
    else:
        return p
    if (abs(size - 1) > UNIT).any():
        worst = int(np.argmax(abs(size - 1)))
        result = tuple(float(f"{float(x):.6g}") for x in (p.reshape(-1, 4)[worst] if isinstance(algebra, Numbers) else p))
        raise NotNormalized(f"the Euler parameters {result} have the norm {float(size.flat[worst]):.12g}, not 1 to {UNIT:g}; "
                            "divide them by it: symdyn.rotation.normalized(p)")
    return p


def _kept(algebra: Algebra, p: Any) -> Any:
    """p with the rounding of its norm taken out, if it is of numbers."""
    return p / norm(p)[..., None] if isinstance(algebra, Numbers) else p


def _products(R: list[list[Any]]) -> list[list[Any]]:
    """4 p p^T (4, 4) of a rotation, by rows."""
    (a, b, c), (d, e, f), (g, h, i) = R
    x, y, z = h - f, c - g, d - b
    return [[1 + a + e + i, x, y, z], [x, 1 + a - e - i, b + d, c + g],
            [y, b + d, 1 - a + e - i, f + h], [z, c + g, f + h, 1 - a - e + i]]


def _of_positive_sign(p: np.ndarray) -> np.ndarray:
    """p or -p, so that its first component that is not zero is positive."""
    first = np.take_along_axis(p, np.argmax(p != 0, axis=-1)[..., None], axis=-1)
    return np.where(first < 0, -p, p) + 0.0


def _symbolic_parameters(rows: list[list[Any]]) -> Any:
    diagonal = [rows[m][m] for m in range(4)]
    if all(entry.is_number for row in rows for entry in row):
        largest = max(range(4), key=lambda m: diagonal[m].evalf(30))
    else:
        largest = next(m for m in range(4) if not vanishes(diagonal[m]))
    p = sp.Matrix(rows[largest]) / (2 * sp.sqrt(diagonal[largest]))
    first = next(component for component in p if not vanishes(component))
    return -p if first.is_number and first.evalf(30) < 0 else p
