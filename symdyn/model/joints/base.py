"""Common part of all joints: two bodies, a frame on each, coordinates. Each kind defines its motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.model.bodies import Body
from symdyn.model.faults import Faults
from symdyn.model.symbols import Coordinate, as_coordinate, flat, symbols_of
from symdyn.model.sympy_vectors import frames_of, is_sympy_vector
from symdyn.shown import name_of, shown
from symdyn.spatial.vectors import Vector

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, Matrix, Scalar

IDENTITY = sp.ImmutableMatrix.eye(3)


@dataclass(frozen=True)
class JointMotion:
    """Motion of the joint's child frame relative to its parent frame, for any scalar.

    R   (3, 3)  child components to parent components
    d   (3,)    origin of the child frame, parent axes, m
    S   (6, k)  motion subspace, angular part first, child axes: [omega; velocity of the origin] = S s_dot
    c   (6,)    what is left of the acceleration when s_ddot = 0: [d omega/dt; d^2 d/dt^2], child axes, omega
                differentiated as seen from the child frame, d as seen from the parent frame
    """

    R: np.ndarray
    d: np.ndarray
    S: np.ndarray
    c: np.ndarray


class Joint:
    """A joint between a frame on the parent body and a frame on the child body.

    parent, child       bodies of the system (or their names); the ground is `system.ground`
    parent_point        (3,) where the joint sits on the parent, parent axes, m; default: the origin
    child_point         (3,) the same on the child
                        (points and axes may be vectors of SymPy's, written in `body.frame`)
    parent_rotation     (3, 3) joint components to parent components; default: identity
    child_rotation      (3, 3) joint components to child components
    axis                of joints that have one: its direction in the joint frame; numbers are divided by its length, expressions
                        of parameters must have the length 1
    coordinates         one per degree of freedom; a coordinate may be an expression of others and of t; default: named
                        after the joint, q_NAME, or q_NAME_1, ...
    speeds              names for the generalized speeds; default: the derivatives of the coordinates
    """

    kind = ""
    coordinate_units: tuple[str, ...] = ()
    # Whether R = 1 and d = 0 where every coordinate is zero, and a single rotation about a coordinate axis turns by its
    # coordinate times its entry of S.
    identity_at_zero = True
    # Whether the derivation has made it, so that the user knows nothing of it.
    inner = False

    def __init__(self, name: str, parent: BodyOrName, child: BodyOrName, coordinates: Sequence[Scalar] | None,
                 speeds: Sequence[sp.Symbol] | None, parent_point: Vector, child_point: Vector, parent_rotation: Matrix,
                 child_rotation: Matrix) -> None:
        self.name = name
        self.parent = parent
        self.child = child
        self.faults = faults = Faults()
        where = f"joint {shown(name)}"
        self.parent_point = faults.point(parent_point, f"{where}: parent_point", True, parent)
        self.child_point = faults.point(child_point, f"{where}: child_point", True, child)
        self.parent_rotation = self._rotation(parent_rotation, "parent_rotation")
        self.child_rotation = self._rotation(child_rotation, "child_rotation")
        self.unnamed = coordinates is None
        self.coordinates = self._coordinates(coordinates)
        self.speeds = self._speeds(speeds)

    # -- what a joint type defines

    def motion(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> JointMotion:
        """R, d, S and c at coordinates s with speeds sd, on the scalars of the algebra (tape or floats)."""
        raise NotImplementedError

    @property
    def speed_units(self) -> tuple[str, ...]:
        """Unit of each speed."""
        return tuple(f"{unit}/s" for unit in self.coordinate_units)

    @property
    def n_speeds(self) -> int:
        """Number of degrees of freedom."""
        return len(self.speed_units)

    def default_speeds(self) -> tuple[sp.Symbol | None, ...]:
        """Symbols of the speeds where none are given; None for that of a coordinate that is an expression."""
        return tuple(q.dot if isinstance(q, Coordinate) else None for q in self.coordinates)

    @property
    def symbols_only(self) -> str:
        """Why coordinates must be symbols, not expressions, and what else to do; "" where they need not."""
        return ""

    @property
    def constants(self) -> list[sp.Expr]:
        """Expressions of parameters that describe the joint."""
        matrices = [self.parent_point, self.child_point, self.parent_rotation, self.child_rotation]
        matrices += [self.axis] if hasattr(self, "axis") else []
        return [e for matrix in [*matrices, *getattr(self, "axes", [])] for e in flat(matrix)]

    def rates(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> list[Any]:
        """Derivatives of the coordinates from the speeds, q_dot = N(q) u."""
        return list(sd)

    # -- shared checks

    def _coordinates(self, given: Sequence[Any] | None) -> tuple[sp.Expr, ...]:
        wanted = len(self.coordinate_units)
        if given is None:
            ends = [""] if wanted == 1 else [f"_{k + 1}" for k in range(wanted)]
            given = [Coordinate(f"q_{name_of(self)}{end}") for end in ends]
        if not listed(given):
            self.faults.append(f"joint {shown(self.name)}: coordinates is {shown(given)}; pass a list of {wanted}")
            given = [sp.S.Zero] * wanted
        given = list(given)
        if len(given) != wanted:
            self.faults.append(f"joint {shown(self.name)} ({self.kind}) takes {wanted} coordinates "
                               f"({', '.join(self.coordinate_units)}), found {len(given)}")
            given = [sp.S.Zero] * wanted
        taken = [as_coordinate(e) for e in given]
        return tuple(e if isinstance(e, Coordinate)
                     else self.faults.expression(e, f"joint {shown(self.name)}: coordinate {k + 1}")
                     for k, e in enumerate(taken))

    def _speeds(self, given: Sequence[Any] | None) -> tuple[sp.Symbol, ...] | None:
        if given is None:
            return None
        given = [as_coordinate(e) for e in given] if listed(given) else given
        if not isinstance(given, list) or len(given) != self.n_speeds or not all(isinstance(e, sp.Symbol) for e in given):
            self.faults.append(f"joint {shown(self.name)} ({self.kind}) takes {self.n_speeds} symbols as speeds, found "
                               f"{shown(given)}")
            return None
        return tuple(given)

    def _rotation(self, value: Any, what: str) -> sp.ImmutableMatrix:
        if value is None:
            return IDENTITY
        before = len(self.faults)
        matrix = self.faults.matrix(value, f"joint {shown(self.name)}: {what}")
        residual = rotation_residual(matrix) if len(self.faults) == before else 0.0
        if residual > 1e-9:
            self.faults.append(f"joint {shown(self.name)}: {what} is not a rotation: R R^T differs from the identity "
                               f"by {residual:.2g} or its determinant is not +1; pass a rotation matrix")
        return matrix

    def _axis(self, value: Any, what: str = "axis") -> sp.ImmutableMatrix:
        """A unit vector along an axis, joint frame; numbers are divided by their length, exactly where they are exact.

        A vector of SymPy's may be written in the axes of the parent or of the child, which joint frames connect with the joint.
        """
        before = len(self.faults)
        harmless = sp.ImmutableMatrix(getattr(self, "default_axis", (0, 0, 1)))
        axis = self._along(value, f"joint {shown(self.name)}: {what}")
        if len(self.faults) > before:
            return harmless
        entries = flat(axis)
        if all(e.is_Integer for e in entries) and sum(e * e for e in entries) == 1:
            return axis
        length = numeric(sp.sqrt(axis.dot(axis)))
        numbers = all(e.is_number for e in entries)
        if length < 1e-12 or (not numbers and abs(length - 1) > 1e-9):
            result = f"has length {length:.6g}" + ("" if numbers else " for arbitrary numbers")
            cure = "pass a direction that is not zero" if length < 1e-12 else "divide it by its length"
            self.faults.append(f"joint {shown(self.name)}: {what} {list(axis)} {result}, not 1; {cure}")
            return harmless
        return _exactly_unit(axis) if abs(length - 1) <= 1e-9 else _divided_by_its_length(axis)

    def _along(self, value: Any, what: str) -> sp.ImmutableMatrix:
        """Components of a direction in the joint frame."""
        if not is_sympy_vector(value):
            return self.faults.vector(value, what, planar=True)
        sides = ((self.parent, self.parent_rotation), (self.child, self.child_rotation))
        written = frames_of(value)
        body, R = next(((body, R) for body, R in sides if isinstance(body, Body) and written == [body.frame]), sides[0])
        return sp.ImmutableMatrix(R.T * self.faults.vector(value, what, frame=body))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({shown(self.name)})"


def listed(value: Any) -> bool:
    """Whether a value is a sequence of values."""
    return hasattr(value, "__iter__") and not isinstance(value, (str, bytes, dict, type)) and getattr(value, "ndim", 1) != 0


def _exactly_unit(axis: sp.ImmutableMatrix) -> sp.ImmutableMatrix:
    """An axis given in floats is a unit vector to their precision only; make it one to any precision.

    (0.6, 0, 0.8) becomes (3/5, 0, 4/5); what is no short fraction is divided by its length at 60 digits.
    """
    if not axis.has(sp.Float):
        return axis
    short = [sp.Rational(e).limit_denominator(1000) if e.is_number else e for e in axis]
    if sum(e * e for e in short) == 1:
        return sp.ImmutableMatrix(short)
    if not all(e.is_number for e in axis):
        return axis
    exact = [sp.Rational(e) for e in axis]
    length = sp.sqrt(sum(e * e for e in exact))
    return sp.ImmutableMatrix([sp.Rational(sp.N(e / length, 60)) for e in exact])


def _divided_by_its_length(axis: sp.ImmutableMatrix) -> sp.ImmutableMatrix:
    """A unit vector along numbers: (1, 1, 0) becomes (sqrt(2)/2, sqrt(2)/2, 0), also where these are floats."""
    short = [sp.Rational(e).limit_denominator(1000) if e.is_Float else e for e in axis]
    if all(float(a) == float(b) for a, b in zip(short, axis, strict=True)):  # floats that short fractions are rounded to
        return sp.ImmutableMatrix(short) / sp.sqrt(sum(e * e for e in short))
    exact = [sp.Rational(e) if e.is_Float else e for e in axis]
    length = sp.sqrt(sum(e * e for e in exact))
    return sp.ImmutableMatrix([sp.Rational(sp.N(e / length, 60)) for e in exact])


def numeric(expression: sp.Expr, symbols: Sequence[sp.Symbol] | None = None) -> float:
    """The value of an expression with its symbols (or more of them, in a given order), at fixed arbitrary numbers."""
    if isinstance(expression, sp.Rational):
        return float(expression)
    if symbols is None:
        symbols = sorted(symbols_of(expression), key=str)
    value = expression.xreplace({s: sp.Float(0.3 + 0.37 * (k + 1) ** 0.5) for k, s in enumerate(symbols)})
    return float(sp.re(sp.N(value)))


def rotation_residual(matrix: sp.ImmutableMatrix) -> float:
    """Distance of a matrix from a proper rotation: largest entry of R R^T - 1, or of det R - 1."""
    if matrix == sp.eye(3):
        return 0.0
    symbols = sorted(symbols_of(matrix), key=str)
    R = np.array([[numeric(e, symbols) for e in matrix.row(i)] for i in range(3)])
    return float(max(np.abs(R @ R.T - np.eye(3)).max(), abs(np.linalg.det(R) - 1)))


def turn(algebra: Any, axis: Vector, angle: Any) -> np.ndarray:
    """Rotation about a unit axis e by an angle: e e^T + cos (1 - e e^T) + sin [e x] (Rodrigues)."""
    s, c = algebra.sin(angle), algebra.cos(angle)
    x, y, z = axis
    R = np.empty((3, 3), dtype=object)
    skew = ((0, -z, y), (z, 0, -x), (-y, x, 0))
    for i in range(3):
        for j in range(3):
            outer = axis[i] * axis[j]
            R[i, j] = outer + c * ((1 if i == j else 0) - outer) + s * skew[i][j]
    return R
