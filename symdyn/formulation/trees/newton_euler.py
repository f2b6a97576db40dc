"""Recursive Newton-Euler, pass by pass: outwards velocities and accelerations, inwards forces.

Source: Luh, Walker and Paul (1980).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from symdyn.formulation.trees.link import LinkMotion, Wrench, base_motion, rates_matrix
from symdyn.formulation.trees.tree import GROUND, Tree
from symdyn.spatial.vectors import Vector, cross, dot, zeros


def outward(tree: Tree, w_dot: Vector, a_0: np.ndarray) -> list[LinkMotion]:
    """Motion of every link for joint accelerations w_dot (n_w,), the base accelerating with a_0 (3,), n-frame.

    With a_0 = -gravity the weight is part of the inertial forces.
    """
    motions: list[LinkMotion] = []
    for k, link in enumerate(tree.links):
        before = base_motion(a_0) if link.parent == GROUND else motions[link.parent]
        motions.append(carried_on(tree, k, before, w_dot))
    return motions


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


def inward(tree: Tree, wrenches: Sequence[Wrench]) -> np.ndarray:
    """Joint forces (n_w,) that balance a wrench (f, n about the origin, link axes) on each link."""
    algebra = tree.algebra
    f = [wrench[0] for wrench in wrenches]
    n = [wrench[1] for wrench in wrenches]
    tau = np.empty(len(tree.w), dtype=object)
    for k in reversed(range(len(tree.links))):
        link = tree.links[k]
        with algebra.section(f"link {link.name}: force and moment at its joint"):
            for column, index in enumerate(link.speeds):
                tau[index] = dot(link.S[:3, column], n[k]) + dot(link.S[3:, column], f[k])
            if link.parent != GROUND:
                force = link.R @ f[k]
                f[link.parent] = algebra.vector(f"f{link.parent + 1}", f[link.parent] + force)
                n[link.parent] = algebra.vector(f"n{link.parent + 1}",
                                              n[link.parent] + (link.R @ n[k] + cross(link.r, force)))
    return tau


def _times(S: np.ndarray, values: Vector) -> tuple[np.ndarray, np.ndarray]:
    total = zeros(6)
    for column, value in enumerate(values):
        total = total + S[:, column] * value
    return total[:3], total[3:]
