"""Whether a matrix is a rotation, and the nearest one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.errors import NotARotation
from symdyn.rotation.algebra import Algebra, Expressions, Numbers, algebra_of

if TYPE_CHECKING:
    from symdyn.given import Array, Matrix

# Largest entry of |R^T R - 1| that passes as rounding.
ORTHOGONAL = 1e-9


def rotation_matrix(algebra: Algebra, R: Any) -> Any:
    """R (3, 3), or NotARotation. Only the shape of expressions with symbols is checked."""
    R = algebra.read(R, (3, 3), "R", NotARotation)
    if isinstance(algebra, Numbers):
        _check(R)
    elif all(entry.is_number for entry in R):
        _check(np.array(R.evalf(30).tolist(), dtype=float))
    return R


def only_floats(algebra: Algebra, R: Any) -> bool:
    """Whether a SymPy matrix is of numbers that are rounded: to be computed with as numbers."""
    return isinstance(algebra, Expressions) and R.has(sp.Float) and all(entry.is_number for entry in R)


def as_floats(R: Any) -> np.ndarray:
    """A SymPy matrix of numbers as a NumPy array."""
    return np.array(R.tolist(), dtype=float)


def deviation(R: np.ndarray) -> np.ndarray:
    """The largest entry of |R^T R - 1| (...)."""
    return abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(axis=(-1, -2))


def nearest(R: Matrix) -> Array:
    """The rotation (3, 3) nearest to a matrix of numbers that is one but for rounding or measurement, by singular values.

    Numbers may have leading axes; a SymPy matrix of numbers gives SymPy floats.
    Raises NotARotation if the determinant is not positive, where no rotation is near, or there are symbols.

    >>> measured = [[0.0, -1.001, 0.0], [0.999, 0.0, 0.0], [0.0, 0.0, 1.0]]
    >>> np.round(sd.rotation.nearest(measured), 12) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    algebra = algebra_of(R)
    R = algebra.read(R, (3, 3), "R", NotARotation)
    if isinstance(algebra, Expressions):
        if not all(entry.is_number for entry in R):
            raise NotARotation("R has symbols; the nearest rotation is found for numbers alone: insert numbers first")
        return sp.Matrix(nearest(as_floats(R)).tolist())
    with np.errstate(all="ignore"):
        det = np.linalg.det(R)
    if not (det > 0).all():
        raise NotARotation(f"no rotation is near R: det R = {float(np.min(det)):.6g}, a rotation has 1; "
                           "a negative one is a reflection: turn one axis round")
    U, _, V = np.linalg.svd(R)
    return U @ V


def _check(R: np.ndarray) -> None:
    with np.errstate(all="ignore"):
        error, det = deviation(R), np.linalg.det(R)
    wrong = ~(error <= ORTHOGONAL) | (det < 0)
    if not wrong.any():
        return
    index = tuple(int(i) for i in np.argwhere(wrong)[0])
    which = f"R[{', '.join(map(str, index))}]" if index else "R"
    if error[index] <= ORTHOGONAL:
        advice = "it is a reflection: one axis is turned round, or two are swapped"
    elif det[index] > 0 and error[index] < 0.1:
        advice = "symdyn.rotation.nearest(R) gives the rotation nearest to it"
    else:
        advice = "check its entries: the columns are the unit vectors of b in n-components"
    raise NotARotation(f"{which} is not a rotation: the largest entry of |R^T R - 1| is {error[index]:.3g} (allowed is "
                       f"{ORTHOGONAL:g}) and det R = {det[index]:.9g} (a rotation has 1); {advice}")
