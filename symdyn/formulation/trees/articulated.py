"""Forward dynamics by articulated bodies (the lecture's propagation): joint accelerations in O(n), without a mass matrix.

Inwards the articulated inertia of every link, outwards the accelerations. Source: Featherstone, Rigid Body Dynamics
Algorithms, section 7.3; lecture, chapter 5.7. Two departures, both for fewer operations: accelerations are counted from a
reference motion, the one with w_dot = 0 in every joint, so that no product I^A c is needed; and what a joint along a
coordinate axis makes zero or known is not computed: its row of I^a = I^A - U D^-1 U^T is zero, its entry of
p^a = p^A + U D^-1 u is the joint's own force, and its acceleration is found together with the link's.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from symdyn.formulation.identification.joint_regrouping import coordinate_axis
from symdyn.formulation.probes.vanishing_pivots import behind, felt
from symdyn.formulation.trees.flexible import FlexibleLink
from symdyn.formulation.trees.link import Wrench
from symdyn.formulation.trees.mass_matrix import Factors, factorize, own_inertias
from symdyn.formulation.trees.tree import GROUND, Link, Tree
from symdyn.spatial.inertia import ArticulatedInertia, Inertia
from symdyn.spatial.vectors import Vector, cross, inner, zeros
from symdyn.tape.node import is_zero


@dataclass(frozen=True)
class Released:
    """A link whose joint is free to move.

    indices  of the speeds of the joint that accelerate freely
    S, U     (6, k) motion subspace of these speeds; U = I^A S, with N for elastic coordinates, see `_release`
    D        factors of S^T I^A S, with M_e for elastic coordinates, (k, k)
    axes     indices in the link's twist (6,) that the columns of S fill, if each is one coordinate direction, else ()
    gain     U D^-1, (6, 1), for one column along a coordinate direction, else None
    """

    indices: tuple[int, ...]
    S: np.ndarray
    U: np.ndarray
    D: Factors
    axes: tuple[int, ...]
    gain: np.ndarray | None


class Articulated:
    """Articulated inertias of a tree; `solve` gives the accelerations that forces make.

    reasons   index of each joint speed that accelerates freely (the others follow given functions of time) -> what it
              means if its pivot is not positive
    vanishing_pivots   those of these indices whose pivot vanishes at some positions (see that probe)
    pivots    (index, pivot) of these speeds
    """

    def __init__(self, tree: Tree, reasons: Mapping[int, str], vanishing_pivots: Container[int] = ()) -> None:
        self.tree = tree
        self.pivots: list[tuple[int, Any]] = []
        algebra, links = tree.algebra, tree.links
        IA = [ArticulatedInertia.rigid(own) if isinstance(own, Inertia) else own for own in own_inertias(tree)]
        self.released: dict[int, Released] = {}
        for k in reversed(range(len(links))):
            link = links[k]
            with algebra.section(f"link {link.name}: articulated inertia"):
                indices = tuple(index for index in link.speeds if index in reasons)
                S = link.S[:, [index - link.speeds.start for index in indices]]
                massless_pivots = [column for column, index in enumerate(indices) if index in vanishing_pivots]
                factorized = partial(factorize, algebra, reasons=[reasons[p] for p in indices],
                                     least=dict.fromkeys(massless_pivots, algebra.rounding),
                                     sizes={c: behind(tree, k, S[:, c], lambda child: (IA[child].A, IA[child].M))
                                            for c in massless_pivots if not felt(tree, k, S[:, c])})
                joint = self.released[k] = _release(algebra, k + 1, IA[k], link, indices, S, factorized, tree.elastic(k))
                self.pivots += zip(indices, joint.D.D, strict=True)
                if link.parent == GROUND or any(is_zero(pivot) for pivot in joint.D.D):
                    continue
                parent, number = link.parent, link.parent + 1
                IA[parent] = IA[parent] + _felt_across(IA[k], joint).moved(link.R, link.r)
                for letter, block in (("A", IA[parent].A), ("H", IA[parent].H), ("M", IA[parent].M)):
                    algebra.vector(f"{letter}{number}", block)

    def solve(self, tau: Vector, wrenches: Sequence[Wrench] | None = None) -> np.ndarray:
        """Joint accelerations (n_w,) for joint forces tau (n_w,), against wrenches (f, n about the origin, link axes) that
        the links need besides, such as those of the reference motion."""
        algebra, links = self.tree.algebra, self.tree.links
        p = [np.concatenate([n, f]) for f, n in wrenches] if wrenches else [zeros(6) for _ in links]
        u: list[np.ndarray] = [zeros(0)] * len(links)
        for k in reversed(range(len(links))):
            link, joint = links[k], self.released[k]
            with algebra.section(f"link {link.name}: force that accelerates its joint"):
                own = np.array([tau[index] for index in joint.indices], dtype=object)
                if joint.indices:
                    u[k] = algebra.name(f"u{k + 1}", own - joint.S.T @ p[k])
                if link.parent != GROUND:
                    pa = _carried(p[k], joint, u[k], own)
                    f = link.R @ pa[3:]
                    n = link.R @ pa[:3] + cross(link.r, f)
                    p[link.parent] = algebra.name(f"p{link.parent + 1}", p[link.parent] + np.concatenate([n, f]))
        return self._outwards(u)

    def _outwards(self, u: Sequence[np.ndarray]) -> np.ndarray:
        """w_dot = D^-1 (u - U^T X a_parent), link by link; accelerations a are those against the reference motion."""
        algebra = self.tree.algebra
        w_dot = zeros(len(self.tree.w))
        a: list[np.ndarray] = []
        for k, link in enumerate(self.tree.links):
            joint = self.released[k]
            with algebra.section(f"link {link.name}: acceleration"):
                carried = zeros(6) if link.parent == GROUND else _seen_from(link, a[link.parent])
                w_dot[list(joint.indices)], own = _accelerated(joint, carried, u[k])
                algebra.name(f"wd{k + 1}", w_dot[list(joint.indices)])
                a.append(algebra.name(f"da{k + 1}", own))
        return w_dot


def _release(algebra: Any, number: int, IA: ArticulatedInertia, link: Link, indices: tuple[int, ...], S: np.ndarray,
             factorized: Callable[[np.ndarray], Factors], elastic: FlexibleLink | None) -> Released:
    """U = I^A S and the factors of D = S^T I^A S.

    Elastic coordinates also move the mass between the ends of their body: D = S^T I^A S + M_e, and U = I^A S + N with N the
    wrench that their accelerations need at the clamped end, carried to the link at the free end.
    """
    k = len(indices)
    U = algebra.name(f"U{number}", IA.matrix() @ S) if indices else zeros(6, 0)
    D = zeros(k, k)
    for i in range(k):
        for j in range(i + 1):
            D[i, j] = D[j, i] = inner(S[:, i], U[:, j])
    if elastic is not None:
        U = algebra.name(f"N{number}", U + np.column_stack([_outwards(link, elastic.coupling(column)) for column in range(k)]))
        D = D + elastic.Me
        return Released(indices, S, U, factorized(D), (), None)
    factors = factorized(D)
    directions = [coordinate_axis(S[:, column]) for column in range(k)]
    axes = tuple(axis for column, axis in enumerate(directions) if axis is not None and abs(S[axis, column]) == 1)
    single = k == 1 and len(axes) == 1
    gain = algebra.name(f"G{number}", U[:, 0] * factors.inverse_D[0]) if single else None
    return Released(indices, S, U, factors, axes if len(axes) == k else (), gain)


def _outwards(link: Link, wrench: Wrench) -> np.ndarray:
    """A wrench about the origin of the link before, about that of the link, link axes, (6,) moment first."""
    f, n = wrench
    return np.concatenate([link.R.T @ (n - cross(link.r, f)), link.R.T @ f])


def _felt_across(IA: ArticulatedInertia, joint: Released) -> ArticulatedInertia:
    """I^a = I^A - U D^-1 U^T, column by column of Y = U L^-1: U D^-1 U^T = sum of y y^T / d; symmetric entries once."""
    Y = joint.U.copy()
    Ia = IA.matrix()
    for c in reversed(range(len(joint.indices))):
        for i in range(c):
            Y[:, i] = Y[:, i] - joint.D.L[c, i] * Y[:, c]
        scaled = Y[:, c] * joint.D.inverse_D[c]
        for i in range(6):
            for j in range(i, 6):
                Ia[i, j] = Ia[j, i] = 0 if i in joint.axes or j in joint.axes else Ia[i, j] - scaled[i] * Y[j, c]
    return ArticulatedInertia(Ia[:3, :3], Ia[:3, 3:], Ia[3:, 3:])


def _carried(p: np.ndarray, joint: Released, u: np.ndarray, own: np.ndarray) -> np.ndarray:
    """p^a = p^A + U D^-1 u."""
    if not joint.indices:
        return p
    pa = p + (joint.gain * u[0] if joint.gain is not None else joint.U @ joint.D.solve(u))
    for column, axis in enumerate(joint.axes):
        pa[axis] = joint.S[axis, column] * own[column]
    return pa


def _seen_from(link: Link, a: np.ndarray) -> np.ndarray:
    """X a: the parent's acceleration at the link's origin, link axes."""
    return np.concatenate([link.R.T @ a[:3], link.R.T @ (a[3:] + cross(a[:3], link.r))])


def _accelerated(joint: Released, a: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations of the joint's speeds, and of the link, from what the parent hands on."""
    if not joint.indices:
        return zeros(0), a
    if joint.gain is None:
        w_dot = joint.D.solve(u - joint.U.T @ a)
        return w_dot, a + joint.S @ w_dot
    axis, = joint.axes
    total = u[0] * joint.D.inverse_D[0]
    for i in range(6):
        if i != axis:
            total = total - joint.gain[i] * a[i]
    sign = joint.S[axis, 0]
    w_dot = np.array([total - sign * a[axis]], dtype=object)
    a[axis] = sign * total
    return w_dot, a
