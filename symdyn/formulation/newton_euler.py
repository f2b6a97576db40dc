"""Recursive Newton-Euler: the joint forces that a given motion needs, body by body.

Outwards velocities and accelerations, inwards forces. Source: Luh, Walker and Paul (1980); the products omega_i omega_j
are formed once a link and serve the acceleration of every point, U = [alpha x] + [omega x][omega x], and the
gyroscopic moment (Khalil and Dombre, Modeling, Identification and Control of Robots, section 9.5).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from symdyn.formulation.tree import GROUND, Tree
from symdyn.spatial.inertia import Inertia
from symdyn.spatial.vectors import Vector, cross, dot, zeros


@dataclass(frozen=True)
class LinkMotion:
    """Of one link, in its own axes: omega, alpha (3,), a: acceleration of its origin (3,), U (3, 3) as above."""

    omega: np.ndarray
    alpha: np.ndarray
    a: np.ndarray
    U: np.ndarray
    products: np.ndarray

    def at(self, point: np.ndarray) -> np.ndarray:
        """Acceleration of a point of the link, link axes."""
        return self.a + self.U @ point


def rates_matrix(omega: np.ndarray, alpha: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """U = [alpha x] + [omega x][omega x], and the products omega_i omega_j."""
    P = zeros(3, 3)
    for i in range(3):
        for j in range(i, 3):
            P[i, j] = P[j, i] = omega[i] * omega[j]
    x, y, z = alpha
    U = np.array([[-(P[1, 1] + P[2, 2]), P[0, 1] - z, P[0, 2] + y],
                  [P[0, 1] + z, -(P[0, 0] + P[2, 2]), P[1, 2] - x],
                  [P[0, 2] - y, P[1, 2] + x, -(P[0, 0] + P[1, 1])]], dtype=object)
    return U, P


def outward(tree: Tree, w_dot: Vector, a_0: np.ndarray) -> list[LinkMotion]:
    """Motion of every link for joint accelerations w_dot (n_w,), the base accelerating with a_0 (3,), n-frame.

    With a_0 = -gravity the weight is part of the inertial forces.
    """
    motions: list[LinkMotion] = []
    for k, link in enumerate(tree.links):
        before = base_motion(a_0) if link.parent == GROUND else motions[link.parent]
        motions.append(carried_on(tree, k, before, w_dot))
    return motions


def base_motion(a_0: np.ndarray) -> LinkMotion:
    """A base that does not turn, with the acceleration a_0 (3,)."""
    return LinkMotion(zeros(3), zeros(3), a_0, zeros(3, 3), zeros(3, 3))


def carried_on(tree: Tree, k: int, before: LinkMotion, w_dot: Vector) -> LinkMotion:
    """Motion of link k from that of the link before, for joint accelerations w_dot (n_w,)."""
    algebra, link = tree.algebra, tree.links[k]
    with algebra.section(f"link {link.name}: velocity and acceleration"):
        E = link.R.T
        joint_omega, joint_v = _times(link.S, tree.w[link.speeds.start:link.speeds.stop])
        joint_alpha, joint_a = _times(link.S, w_dot[link.speeds.start:link.speeds.stop])
        carried = E @ before.omega
        omega = carried + joint_omega
        alpha = E @ before.alpha + (joint_alpha + link.c[:3] + cross(carried, joint_omega))
        a = E @ before.at(link.r) + (joint_a + link.c[3:] + 2 * cross(carried, joint_v))
        algebra.vector(f"w{k + 1}", omega)
        algebra.vector(f"al{k + 1}", alpha)
        algebra.vector(f"a{k + 1}", a)
        U, P = rates_matrix(omega, alpha)
        algebra.vector(f"U{k + 1}", U)
        return LinkMotion(omega, alpha, a, U, P)


def inertial_wrench(inertia: Inertia, motion: LinkMotion) -> tuple[np.ndarray, np.ndarray]:
    """Force and moment about the link's origin that its motion needs: f = m a + U h, n = I alpha + omega x I omega + h x a."""
    m, h, I = inertia.m, inertia.h, inertia.I
    U, P = motion.U, motion.products
    f = m * motion.a + U @ h
    al = motion.alpha
    n = np.array([
        I[0, 0] * al[0] + (I[2, 2] - I[1, 1]) * P[1, 2] + I[1, 2] * (P[1, 1] - P[2, 2]) + I[0, 2] * U[1, 0] - I[0, 1] * U[2, 0],
        I[1, 1] * al[1] + (I[0, 0] - I[2, 2]) * P[0, 2] + I[0, 2] * (P[2, 2] - P[0, 0]) + I[0, 1] * U[2, 1] - I[1, 2] * U[0, 1],
        I[2, 2] * al[2] + (I[1, 1] - I[0, 0]) * P[0, 1] + I[0, 1] * (P[0, 0] - P[1, 1]) + I[1, 2] * U[0, 2] - I[0, 2] * U[1, 2],
    ], dtype=object)
    return f, n + cross(h, motion.a)


def inward(tree: Tree, wrenches: Sequence[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Joint forces (n_w,) that balance a wrench (f, n about the origin, link axes) on each link."""
    algebra = tree.algebra
    f = [wrench[0] for wrench in wrenches]
    n = [wrench[1] for wrench in wrenches]
    tau = np.empty(len(tree.w), dtype=object)
    for k in reversed(range(len(tree.links))):
        link = tree.links[k]
        with algebra.section(f"link {link.name}: force and moment at its joint"):
            for column, place in enumerate(link.speeds):
                tau[place] = dot(link.S[:3, column], n[k]) + dot(link.S[3:, column], f[k])
            if link.parent != GROUND:
                force = link.R @ f[k]
                f[link.parent] = algebra.vector(f"f{link.parent + 1}", f[link.parent] + force)
                n[link.parent] = algebra.vector(f"n{link.parent + 1}",
                                              n[link.parent] + (link.R @ n[k] + cross(link.r, force)))
    return tau


def inverse_dynamics(tree: Tree, w_dot: Vector, a_0: np.ndarray,
                     applied: Sequence[tuple[np.ndarray, np.ndarray]] | None = None) -> np.ndarray:
    """Joint forces (n_w,) for joint accelerations w_dot, less what the applied wrenches give."""
    motions = outward(tree, w_dot, a_0)
    wrenches = []
    for k, (link, motion) in enumerate(zip(tree.links, motions, strict=True)):
        with tree.algebra.section(f"link {link.name}: inertial force and moment"):
            f, n = inertial_wrench(link.effective, motion)
            if applied is not None:
                f, n = f - applied[k][0], n - applied[k][1]
            tree.algebra.vector(f"f{k + 1}", f)
            tree.algebra.vector(f"n{k + 1}", n)
            wrenches.append((f, n))
    return inward(tree, wrenches)


def _times(S: np.ndarray, values: Vector) -> tuple[np.ndarray, np.ndarray]:
    total = zeros(6)
    for column, value in enumerate(values):
        total = total + S[:, column] * value
    return total[:3], total[3:]
