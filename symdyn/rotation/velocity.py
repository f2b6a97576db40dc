"""Angular velocity from a rotation that changes with time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.errors import ArgumentError
from symdyn.model.symbols import Acceleration, Input, symbols_of, time
from symdyn.rotation.algebra import Expressions, algebra_of
from symdyn.rotation.euler import frame_of
from symdyn.rotation.proper import rotation_matrix

if TYPE_CHECKING:
    from symdyn.given import Array, Matrix

# Part of the size of R_dot R^T that need not be skew-symmetric: as much as differences of R leave.
RATE = 1e-6


def angular_velocity(R: Matrix, frame: str = "n", *, R_dot: Matrix | None = None) -> Array:
    """omega (3,), rad per unit of time, of b seen from n: skew(omega) = R_dot R^T in n-components, R^T R_dot in b-components.

    R       (3, 3), from b to n, of coordinates (whose rates are their .dot), of SymPy's functions of t, and of t itself;
            other symbols are constant
    frame   the components of omega: "n" or "b"
    R_dot   (3, 3), the derivative of R, instead of deriving it; needed for numbers, which may have leading axes

    Products of sines and cosines are collected by sin^2 = 1 - cos^2 where that makes the result shorter. Relations between
    symbols, as of Euler parameters by their norm, are not known here: see omega_from_parameters. Raises NotARotation for numbers
    that are no rotation, ArgumentError if R has accelerations or inputs, which have no derivative, numbers come without R_dot, or
    R_dot R^T of numbers is not skew-symmetric to 1e-6 of its size.
    Source: lecture, chapters 1.7 and 4.5.

    >>> q = sd.coordinates("q")
    >>> sd.rotation.angular_velocity(sd.rotation.about("X", q))
    Matrix([
    [q_dot],
    [    0],
    [    0]])
    """
    in_n = frame_of(frame)
    algebra = algebra_of(R) if R_dot is None else algebra_of(R, R_dot)
    R = rotation_matrix(algebra, R)
    if R_dot is not None:
        R_dot = algebra.read(R_dot, (3, 3), "R_dot")
    elif isinstance(algebra, Expressions):
        R_dot = R.applyfunc(_rate)
    else:
        raise ArgumentError("R is of numbers and does not show how it changes; pass its derivative too: R_dot=")
    S = R_dot @ algebra.transposed(R) if in_n else algebra.transposed(R) @ R_dot
    rows = algebra.entries(S)
    if not isinstance(algebra, Expressions):
        _check_rate(S)
    omega = [(rows[2][1] - rows[1][2]) / 2, (rows[0][2] - rows[2][0]) / 2, (rows[1][0] - rows[0][1]) / 2]
    if isinstance(algebra, Expressions):
        omega = [_collected(rows[i][j]) for i, j in ((2, 1), (0, 2), (1, 0))]
    return algebra.vector(omega)


def _check_rate(S: np.ndarray) -> None:
    error, size = float(abs(S + np.swapaxes(S, -1, -2)).max(initial=0)), float(abs(S).max(initial=0))
    if error > RATE * size:
        raise ArgumentError(f"R_dot is no derivative of this rotation: R_dot R^T is not skew-symmetric, the largest entry of it "
                            f"plus its transpose is {error:.3g} (allowed is {RATE:g} of its size {size:.3g}); check R_dot")


def _rate(expression: Any) -> Any:
    """The derivative by time."""
    for symbol in sorted(symbols_of(expression), key=lambda symbol: symbol.name):
        if isinstance(symbol, (Acceleration, Input)):
            raise ArgumentError(f"R depends on {symbol}, whose derivative by time has no symbol; "
                                "write R in coordinates, their rates and t")
    return sp.diff(expression, time)


def _collected(expression: Any) -> Any:
    """The expression as a polynomial without sin^2 and higher powers of sines, if that is shorter."""
    x = sp.Wild("x")
    n = sp.Wild("n", properties=[lambda power: power.is_Integer and power >= 2])
    reduced = sp.expand(sp.expand(expression).replace(
        sp.sin(x)**n, lambda x, n: (1 - sp.cos(x)**2)**(n // 2) * sp.sin(x)**(n % 2)))
    return reduced if reduced.count_ops() < expression.count_ops() else expression
