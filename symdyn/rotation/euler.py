"""Euler angles of the twelve sequences: R, and the matrix G between the rates of the angles and the angular velocity."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.errors import ArgumentError, GimbalLock
from symdyn.rotation.algebra import Algebra, Expressions, algebra_of
from symdyn.rotation.matrices import turn
from symdyn.rotation.sequence import EulerSequence, gimbal_lock, sequence_of
from symdyn.rotation.zero import vanishes
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import Array, Vector

# Sine or cosine of the second angle that G^-1 is divided by: below, more than half of the digits are lost.
LOCK = 1e-8


def from_euler(sequence: str, angles: Vector) -> Array:
    """R (3, 3) = R_1(a) R_2(b) R_3(c) of three successive rotations about body axes; it takes components in b to those in n.

    sequence   one of the twelve, "ZYX" is yaw, pitch, roll
    angles     (3,), rad, in the order of the sequence; numbers may have leading axes (..., 3)
    Raises ArgumentError for an unknown sequence and for anything but three angles. Source: lecture, chapter 4.2.

    >>> a = sp.Symbol("a", real=True)
    >>> sd.rotation.from_euler("ZYX", [a, 0, 0])
    Matrix([
    [cos(a), -sin(a), 0],
    [sin(a),  cos(a), 0],
    [     0,       0, 1]])
    >>> np.round(sd.rotation.from_euler("ZYX", [np.pi / 2, 0.0, 0.0]) @ [1.0, 0.0, 0.0], 12) + 0.0
    array([0., 1., 0.])
    """
    of, algebra = sequence_of(sequence), algebra_of(angles)
    R_1, R_2, R_3 = _turns(algebra, of, algebra.read(angles, (3,), "the Euler angles"))
    return R_1 @ R_2 @ R_3


def euler_rates(sequence: str, angles: Vector, frame: str = "n") -> Array:
    """G (3, 3) with omega = G gamma_dot, gamma_dot the rates of the angles in the order of the sequence.

    frame   the components of omega: "n" or "b"
    Numbers may have leading axes. The columns are the axes of the three rotations, of which the first and third become
    parallel at gimbal lock. Raises ArgumentError. Source: lecture, chapter 4.2.

    >>> a, b, c = sp.symbols("a b c", real=True)
    >>> sd.rotation.euler_rates("ZYX", [a, b, c], frame="b")
    Matrix([
    [      -sin(b),       0, 1],
    [sin(c)*cos(b),  cos(c), 0],
    [cos(b)*cos(c), -sin(c), 0]])
    """
    of, algebra = sequence_of(sequence), algebra_of(angles)
    in_n = frame_of(frame)
    R_1, R_2, R_3 = _turns(algebra, of, algebra.read(angles, (3,), "the Euler angles"))
    i, j, k = of.axes
    if in_n:
        columns = [[int(row == i) for row in range(3)], _column(algebra, R_1, j), _column(algebra, R_1 @ R_2, k)]
    else:
        columns = [_row(algebra, R_2 @ R_3, i), _row(algebra, R_3, j), [int(row == k) for row in range(3)]]
    return algebra.matrix([[column[row] for column in columns] for row in range(3)])


def euler_rates_inverse(sequence: str, angles: Vector, frame: str = "n") -> Array:
    """G^-1 (3, 3) with gamma_dot = G^-1 omega; arguments as for euler_rates.

    Raises GimbalLock where the sine (proper sequences) or cosine (Tait-Bryan) of the second angle is below 1e-8 in numbers,
    or zero for all values of the symbols. Source: lecture, chapter 4.3.

    >>> angles = [0.3, -0.2, 0.1]
    >>> rates = sd.rotation.euler_rates_inverse("ZYX", angles) @ [0.0, 0.0, 2.0]
    >>> np.round(sd.rotation.euler_rates("ZYX", angles) @ rates, 12) + 0.0
    array([0., 0., 2.])
    """
    of, algebra = sequence_of(sequence), algebra_of(angles)
    in_n = frame_of(frame)
    angles = algebra.read(angles, (3,), "the Euler angles")
    b = algebra.components(angles)[1]
    s, c, e, l = algebra.sin(b), algebra.cos(b), of.sign, of.remaining
    i, j, k = of.axes
    _check_lock(algebra, of, b, s if of.proper else c)
    # y = a_dot u + b_dot e_j + c_dot v is omega before the second rotation (n) or after it (b), where one of u, v is a
    # coordinate axis and the other one is in the plane of e_i and e_l: divided by the component along that which is left.
    outer, inner = (0, 2) if in_n else (2, 0)
    axis = i if in_n else k
    across, divisor, rest = (l, (-e if in_n else e) * s, c) if of.proper else (k if in_n else i, c, e * s)
    P: list[list[Any]] = [[0, 0, 0], [0, 0, 0], [0, 0, 0]]
    P[1][j] = 1
    P[inner][across] = 1 / divisor
    P[outer][axis] = 1
    P[outer][across] = -rest / divisor
    R_1, _, R_3 = _turns(algebra, of, angles)
    return algebra.matrix(P) @ (algebra.transposed(R_1) if in_n else R_3)


def frame_of(frame: Any) -> bool:
    """Whether a frame of components is "n" rather than "b"; ArgumentError for anything else."""
    if frame in ("n", "b") and isinstance(frame, str):
        return frame == "n"
    raise ArgumentError(f"there are no components in {shown(frame)}; pass 'n' (fixed frame) or 'b' (body)")


def _turns(algebra: Algebra, of: EulerSequence, angles: Any) -> list[Any]:
    return [turn(algebra, axis, angle) for axis, angle in zip(of.axes, algebra.components(angles), strict=True)]


def _column(algebra: Algebra, matrix: Any, j: int) -> list[Any]:
    return [row[j] for row in algebra.entries(matrix)]


def _row(algebra: Algebra, matrix: Any, i: int) -> list[Any]:
    return algebra.entries(matrix)[i]


def _check_lock(algebra: Algebra, of: EulerSequence, b: Any, divisor: Any) -> None:
    """GimbalLock if the divisor, the sine or cosine of b that is zero at lock, is too small."""
    if isinstance(algebra, Expressions):
        rounded = divisor.is_number and divisor.has(sp.Float)
        if abs(divisor) < LOCK if rounded else vanishes(divisor):
            raise _locked(of, f"{b}", abs(float(divisor)) if rounded else 0.0, float(b) if b.is_number else None)
        return
    near = abs(np.asarray(divisor)) < LOCK
    if near.any():
        second = float(np.asarray(b)[near].flat[0])
        raise _locked(of, f"{second:.12g}", float(abs(np.asarray(divisor))[near].flat[0]), second)


def _locked(of: EulerSequence, shown: str, distance: float, second: float | None) -> GimbalLock:
    lock = gimbal_lock(of.name)
    near = [angle for angle in lock.second if second is not None and np.cos(second - float(angle)) > 0]
    where = f"{near[0]}, modulo 2 pi" if near else f"{lock.second[0]} or {lock.second[1]}"
    return GimbalLock(
        f"the {of.name} angles are at gimbal lock: the second angle {of.names[1]} = {shown} rad is {distance:.3g} rad from "
        f"{where} (allowed is {LOCK:g} or more); there G has no inverse, and no rates of these angles give every angular "
        "velocity: take a sequence that locks elsewhere, or Euler parameters")
