"""Joints as constraints: what a joint that closes a loop forbids, row by row.

P is the joint's point on the parent and A its frame there, Q and B those on the child, D = Q - P. Four kinds of rows are
enough for all joints, each with value, rate and acceleration exact at every state:

    point      e . D = 0            e fixed to the base
    across     a . D = 0            a fixed to the parent
    tilt       a . b = const        a fixed to the parent, b to the child
    distance   (D . D - L^2)/(2 L) = 0

The rate of a row is f . (v_Q - v_P) + n_c . omega_child + n_p . omega_parent, its second derivative the same of the
accelerations and a rest that is quadratic in the speeds; the multiplier lam makes the force -f lam on Q, f lam on P, and
the moments -n_c lam and -n_p lam.
Source: Haug, Computer Aided Kinematics and Dynamics of Mechanical Systems, sections 9.2 and 9.4 (dot-1, dot-2, spherical
and distance constraints); lecture, chapter 6.3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.formulation.trees.relative import End, complement
from symdyn.model.closures import Rod
from symdyn.model.joints import Cylindrical, Fixed, Joint, Planar, Prismatic, Revolute, Spherical, Universal
from symdyn.spatial.vectors import cross, dot, identity, vector, zeros


@dataclass(frozen=True)
class ClosureRow:
    """One row: value, f, n_c, n_p as above, `rest` of its second derivative, whether its value is a length (else an angle)."""

    label: str
    value: Any
    f: np.ndarray
    n_c: np.ndarray
    n_p: np.ndarray
    rest: Any
    length: bool

    def along(self, P: End, Q: End) -> np.ndarray:
        """The row's Jacobian in the joint speeds, (n_w,)."""
        row = zeros(P.Jv.shape[1])
        for k in sorted({*P.along, *Q.along}):
            row[k] = dot(self.f, Q.Jv[:, k] - P.Jv[:, k]) + dot(self.n_c, Q.Jw[:, k]) + dot(self.n_p, P.Jw[:, k])
        return row

    def remaining(self, P: End, Q: End) -> Any:
        """Its second derivative with u_dot = 0."""
        return dot(self.f, Q.a - P.a) + dot(self.n_c, Q.alpha) + dot(self.n_p, P.alpha) + self.rest


def closure_rows(algebra: Any, joint: Joint, P: End, Q: End, planar: bool) -> Iterator[ClosureRow]:
    """The rows of a joint between two ends; planar: what is out of the plane is left out."""
    plane = range(2) if planar else range(3)
    D = Q.p - P.p
    if isinstance(joint, Rod):
        yield _distance(joint.name, D, Q.v - P.v, algebra.expression(joint.length))
        return
    if isinstance(joint, (Revolute, Spherical, Universal, Fixed)):
        for k in plane:
            yield ClosureRow(f"{joint.name}_{'xyz'[k]}", D[k], identity()[k], zeros(3), zeros(3), 0, True)
    if isinstance(joint, (Prismatic, Fixed)):
        pairs = ((0, 1),) if planar else ((0, 1), (1, 2), (2, 0))
        for number, (i, j) in enumerate(pairs):
            yield _tilt(f"{joint.name}_turn_{'zxy'[number]}", P, Q, P.A[:, i], Q.A[:, j])
    if isinstance(joint, Universal):
        first, second = (algebra.constants(axis) for axis in joint.axes)
        yield _tilt(f"{joint.name}_cross", P, Q, P.A @ first, Q.A @ second, dot(first, second))
    if isinstance(joint, Planar) and not planar:
        yield _across(f"{joint.name}_off_plane", P, Q, D, P.A[:, 2])
        for k in range(2):
            yield _tilt(f"{joint.name}_tilt_{k + 1}", P, Q, P.A[:, k], Q.A[:, 2])
    if isinstance(joint, (Revolute, Prismatic, Cylindrical)):
        axis = algebra.constants(joint.axis)
        sides = complement(algebra.recorder, axis) if not planar else (vector(-axis[1], axis[0], 0),)
        if isinstance(joint, (Prismatic, Cylindrical)):
            for number, side in enumerate(sides):
                yield _across(f"{joint.name}_side_{number + 1}", P, Q, D, P.A @ side)
        if isinstance(joint, (Revolute, Cylindrical)) and not planar:
            for number, side in enumerate(sides):
                yield _tilt(f"{joint.name}_tilt_{number + 1}", P, Q, P.A @ side, Q.A @ axis)


def _across(label: str, P: End, Q: End, D: np.ndarray, a: np.ndarray) -> ClosureRow:
    a_dot = cross(P.omega, a)
    rest = 2 * dot(a_dot, Q.v - P.v) + dot(cross(P.omega, a_dot), D)
    return ClosureRow(label, dot(a, D), a, zeros(3), cross(a, D), rest, True)


def _tilt(label: str, P: End, Q: End, a: np.ndarray, b: np.ndarray, constant: Any = 0) -> ClosureRow:
    a_dot, b_dot = cross(P.omega, a), cross(Q.omega, b)
    rest = dot(a, cross(Q.omega, b_dot)) + 2 * dot(a_dot, b_dot) + dot(b, cross(P.omega, a_dot))
    turning = cross(b, a)
    return ClosureRow(label, dot(a, b) - constant, zeros(3), turning, -turning, rest, False)


def _distance(label: str, D: np.ndarray, V: np.ndarray, L: Any) -> ClosureRow:
    return ClosureRow(label, (dot(D, D) - L * L) / (2 * L), D / L, zeros(3), zeros(3), dot(V, V) / L, True)
