"""Determination of Euler angles from R: two solutions, or at gimbal lock a whole family.

R = R_i(a) R_j(b) R_k(c), l the axis that is neither i nor j, e = 1 if (i, j, l) is right-handed and -1 if not. Entries of R:
a from column k; then M = R_i(a)^T R = R_j(b) R_k(c) has b in its column k and c in its row j. b and c fit to any rounding of a
near lock, so that R comes back to the last digits at any distance from lock.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.errors import NotARotation, RotationError
from symdyn.rotation.algebra import Expressions, Numbers, algebra_of
from symdyn.rotation.matrices import turn
from symdyn.rotation.proper import as_floats, deviation, only_floats, rotation_matrix
from symdyn.rotation.sequence import EulerSequence, sequence_of
from symdyn.rotation.zero import vanishes

if TYPE_CHECKING:
    from symdyn.given import Angle, Array, Matrix

# Distance from lock, rad, below which R does not tell first and third angle apart; of an R that is orthogonal to d: 2 d.
LOCKED = 1e-15


@dataclass(frozen=True, eq=False, repr=False)
class EulerSolutions(Sequence[Any]):
    """The Euler angles of a rotation: a sequence of the two solutions, `angles` and `other`.

    sequence   name of the sequence
    locked     whether it is at gimbal lock
    angles     (3,), rad: second angle in [-pi/2, pi/2] (Tait-Bryan) or [0, pi] (proper), the others in (-pi, pi];
               at lock that member of the family whose first angle is 0
    other      (3,), rad: the other solution, a + pi, pi - b or -b, c + pi; at lock another member of the family
    distance   from gimbal lock, rad; the first and third angle are determined to about 1e-16 / distance. None with symbols.
    sign, value   at lock, what is fixed: first angle + sign * third angle = value, modulo 2 pi; None (nan) otherwise
    R          the rotation
    With leading axes of R every field but `sequence` is an array with them.

    >>> found = sd.rotation.to_euler(sd.rotation.from_euler("ZYX", [0.3, -0.2, 0.1]), "ZYX")
    >>> np.round(found.angles, 6), np.round(found.other, 6), found.locked
    (array([ 0.3, -0.2,  0.1]), array([-2.841593, -2.941593, -3.041593]), False)
    >>> round(float(found.distance), 6)
    1.370796
    """

    sequence: str
    locked: bool | np.ndarray
    angles: Array
    other: Array
    distance: Angle
    sign: int | np.ndarray | None
    value: Angle | None
    R: Array

    def __len__(self) -> int:
        return 2

    def __getitem__(self, index: Any) -> Any:
        return (self.angles, self.other)[index]

    @property
    def fixed(self) -> str | np.ndarray:
        """A sentence on what R fixes; with leading axes an array of sentences.

        >>> sd.rotation.to_euler(sd.rotation.from_euler("ZYX", [0.3, np.pi / 2, 0.1]), "ZYX").fixed
        'psi - phi = 0.2; each alone is free'
        """
        of = EulerSequence(self.sequence)
        if not isinstance(self.locked, np.ndarray):
            return _sentence(of, self.locked, self.distance, self.sign, self.value)
        facts = [np.asarray(one).flat for one in (self.locked, self.distance, self.sign, self.value)]
        flat = [_sentence(of, *one) for one in zip(*facts, strict=True)]
        return np.array(flat, dtype=object).reshape(self.locked.shape)

    def at(self, first: Angle | None = None, third: Angle | None = None) -> Array:
        """The member (3,) of the family with this first, or this third, angle, rad.

        Raises RotationError if the rotation is not at gimbal lock, where no angle is free, or not one of the two is given.

        >>> locked = sd.rotation.to_euler(sd.rotation.from_euler("ZYX", [0.3, np.pi / 2, 0.1]), "ZYX")
        >>> np.round(locked.at(first=0.5), 6)
        array([0.5     , 1.570796, 0.3     ])
        """
        if (first is None) == (third is None):
            raise RotationError("at gimbal lock one angle is free: pass either first= or third=, and not both")
        if not np.all(self.locked):
            raise RotationError(f"no angle is free: {self._not_locked()}; take .angles or .other")
        asked = "the first angle" if third is None else "the third angle"
        given = first if third is None else third
        if isinstance(self.R, sp.MatrixBase):
            given = Expressions().read(given, (), asked)
            if third is None:
                return sp.Matrix([given, self.angles[1], self.sign * (self.value - given)])
            return sp.Matrix([self.value - self.sign * given, self.angles[1], given])
        given = Numbers().read(given, (), asked)
        of = EulerSequence(self.sequence)
        if third is None:
            return np.stack(np.broadcast_arrays(given, *_second_and_third(of, self.R, given)), axis=-1)
        a = self.value - self.sign * given
        return np.stack(np.broadcast_arrays(a, _second_and_third(of, self.R, a)[0], given), axis=-1)

    def _not_locked(self) -> str:
        if isinstance(self.locked, np.ndarray):
            return f"{int((~self.locked).sum())} of {self.locked.size} rotations are not at gimbal lock"
        where = "" if self.distance is None else f", but {float(self.distance):.3g} rad away from it"
        return f"the rotation is not at gimbal lock{where}"

    def __repr__(self) -> str:
        if isinstance(self.locked, np.ndarray):
            return f"{self.sequence} angles of {self.locked.size} rotations, {int(self.locked.sum())} of them at gimbal lock"
        if self.locked:
            return f"{self.sequence} angles at gimbal lock, {self.fixed}; for instance {_row(self.angles)}"
        return f"{self.sequence} angles {_row(self.angles)} or {_row(self.other)} rad"


def to_euler(R: Matrix, sequence: str) -> EulerSolutions:
    """The Euler angles of a rotation R (3, 3): both solutions, or at gimbal lock the family; see EulerSolutions.

    Numbers may have leading axes. Locked is what is nearer to lock than 1e-15 rad, or than twice the largest entry of
    |R^T R - 1|: below, R does not tell the first and third angle apart. All solutions give R back to its own accuracy.
    Expressions give atan2 of the entries, exact for exact numbers. With symbols R is taken to be a rotation, and the angles
    hold for all real values of the symbols but those at lock; it is locked if the entries that distinguish the angles are zero
    for all values of the symbols, which is decided at two points of them to 25 digits.

    Raises NotARotation if |R^T R - 1| of numbers has an entry above 1e-9, det R < 0, or R is not (3, 3); ArgumentError for
    an unknown sequence. Source: lecture, chapter 4.3.

    >>> R = sd.rotation.about("Z", 0.3) @ sd.rotation.about("X", 0.1)
    >>> np.round(sd.rotation.to_euler(R, "ZXZ").angles, 6) + 0.0
    array([0.3, 0.1, 0. ])
    """
    of, algebra = sequence_of(sequence), algebra_of(R)
    R = rotation_matrix(algebra, R)
    if only_floats(algebra, R):
        return _as_expressions(_numeric(of, as_floats(R)), R)
    return _symbolic(of, R) if isinstance(algebra, Expressions) else _numeric(of, R)


def _numeric(of: EulerSequence, R: np.ndarray) -> EulerSolutions:
    (_, j, k), l, e = of.axes, of.remaining, of.sign
    y, x = (R[..., j, k], -e * R[..., l, k]) if of.proper else (-e * R[..., j, k], R[..., l, k])
    size = np.hypot(y, x)
    locked = size <= np.maximum(LOCKED, 2 * deviation(R))
    a, opposite = np.where(locked, 0.0, _angle(y, x)), np.where(locked, np.pi, _angle(-y, -x))
    angles = np.stack([a, *_second_and_third(of, R, a)], axis=-1)
    other = np.stack([opposite, *_second_and_third(of, R, opposite)], axis=-1)
    along = R[..., of.axes[0], k]
    sign = np.where(along > 0, 1, -1)
    value = _wrapped(sign * angles[..., 2])
    distance = np.arctan2(size, abs(along))
    if R.ndim > 2:
        return EulerSolutions(of.name, locked, angles, other, distance, np.where(locked, sign, np.nan),
                              np.where(locked, value, np.nan), R)
    if not locked:
        return EulerSolutions(of.name, False, angles, other, float(distance), None, None, R)
    return EulerSolutions(of.name, True, angles, other, float(distance), int(sign), float(value), R)


def _second_and_third(of: EulerSequence, R: np.ndarray, a: Any) -> tuple[np.ndarray, np.ndarray]:
    """b and c (...) that go with a first angle: from M = R_i(a)^T R."""
    (i, j, k), l, e = of.axes, of.remaining, of.sign
    M = np.swapaxes(turn(Numbers(), i, np.asarray(a, dtype=float)), -1, -2) @ R
    if of.proper:
        return _angle(-e * M[..., l, i], M[..., i, i]), _angle(-e * M[..., j, l], M[..., j, j])
    return _angle(e * M[..., i, k], M[..., k, k]), _angle(e * M[..., j, i], M[..., j, j])


def _angle(y: Any, x: Any) -> Any:
    """atan2 in (-pi, pi], whatever the sign of a zero."""
    return _wrapped(np.arctan2(y + 0.0, x + 0.0))


def _wrapped(angle: Any) -> Any:
    """pi for -pi."""
    return np.where(angle <= -np.pi, np.pi, angle)


def _symbolic(of: EulerSequence, R: Any) -> EulerSolutions:
    (i, j, k), l, e = of.axes, of.remaining, of.sign
    if of.proper:
        y, x, y_3, x_3 = R[j, k], -e * R[l, k], R[i, j], e * R[i, l]
    else:
        y, x, y_3, x_3 = -e * R[j, k], R[l, k], -e * R[i, j], R[i, i]
    along = R[i, k]
    if vanishes(x) and vanishes(y):
        return _symbolic_family(of, R, along)
    size = sp.sqrt(_short(x**2 + y**2))
    a, c = sp.atan2(y, x), sp.atan2(y_3, x_3)
    a_2, c_2 = sp.atan2(-y, -x), sp.atan2(-y_3, -x_3)
    b, b_2 = (sp.atan2(size, along), sp.atan2(-size, along)) if of.proper else (
        sp.atan2(e * along, size), sp.atan2(e * along, -size))
    numbers = all(entry.is_number for entry in R)
    distance = float(sp.atan2(size, abs(along))) if numbers else None
    return EulerSolutions(of.name, False, sp.Matrix([a, b, c]), sp.Matrix([a_2, b_2, c_2]), distance, None, None, R)


def _symbolic_family(of: EulerSequence, R: Any, along: Any) -> EulerSolutions:
    """At lock R = R_j(b) R_k(c) with the first angle 0, and cos b = 0 (Tait-Bryan) or sin b = 0 (proper)."""
    (i, j, k), l, e = of.axes, of.remaining, of.sign
    sign = next((sign for sign in (1, -1) if vanishes(along - sign)), 0)
    if not sign:
        raise NotARotation(f"R is not a rotation: column {k + 1} has no entry but R[{i + 1}, {k + 1}] = {along}, "
                           "which must be 1 or -1; insert it")
    b = (sp.S.Zero if sign > 0 else sp.pi) if of.proper else e * sign * sp.pi / 2
    c = sp.atan2(-e * R[j, l], R[j, j]) if of.proper else sp.atan2(e * R[j, i], R[j, j])
    value = sp.pi if sign * c == -sp.pi else sign * c
    return EulerSolutions(of.name, True, sp.Matrix([0, b, c]), sp.Matrix([sp.pi, b, sign * (value - sp.pi)]), 0.0, sign, value, R)


def _short(square: Any) -> Any:
    """A sum of squares by cos^2 + sin^2 = 1, if it is small enough to be worth it."""
    return sp.trigsimp(square) if square.count_ops() <= 60 else square


def _as_expressions(result: EulerSolutions, R: Any) -> EulerSolutions:
    value = None if result.value is None else sp.Float(result.value)
    return EulerSolutions(result.sequence, result.locked, sp.Matrix(np.asarray(result.angles).tolist()),
                          sp.Matrix(np.asarray(result.other).tolist()),
                          result.distance, result.sign, value, R)


def _sentence(of: EulerSequence, locked: Any, distance: Any, sign: Any, value: Any) -> str:
    if locked:
        number = f"{float(value):.6g}" if not isinstance(value, sp.Basic) or value.is_Float else str(value)
        return f"{of.fixed(int(sign))} = {number}; each alone is free"
    where = "" if distance is None else f"; gimbal lock is {float(distance):.3g} rad away"
    return f"{', '.join(of.names)} are determined, but for the other solution{where}"


def _row(angles: Any) -> str:
    return "(" + ", ".join(f"{float(a):.6g}" if isinstance(a, (float, sp.Float)) else str(a) for a in angles) + ")"
