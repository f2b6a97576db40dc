"""The mass matrix by composite bodies: every link with all that hangs on it as one rigid body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from symdyn.formulation.textbook.velocities import named
from symdyn.formulation.trees.tree import GROUND, Tree
from symdyn.spatial.inertia import Inertia
from symdyn.spatial.sixvectors import motion_transform, spatial_inertia
from symdyn.spatial.vectors import congruence, zeros


@dataclass(frozen=True)
class CompositeBodies:
    """I_C   (6, 6) for each link: inertia of the link with all outwards of it, about its origin, link axes
    I_0   (6, 6) inertia of all bodies, also of those held to the ground, about the n-origin, n-frame
    M_w   (n_w, n_w) mass matrix in the joints' speeds; M (n_u, n_u) in the generalized ones, D^T M_w D
    """

    I_C: tuple[np.ndarray, ...]
    I_0: np.ndarray
    M_w: np.ndarray
    M: np.ndarray


def composite_bodies(tree: Tree) -> CompositeBodies:
    """Inertias inwards; then, joint by joint, the force that one unit of acceleration there needs at the joints inwards of it.

        I_C_i = I_i + sum over children of X* I_C X
        F = I_C_i S_i;  M_ii = S_i^T F;  inwards: F = X* F, M_ji = S_j^T F

    Source: not in the lecture. Walker and Orin (1982), method 3; Featherstone, Rigid Body Dynamics Algorithms, section 6.2.
    """
    X = [motion_transform(link.R, link.r) for link in tree.links]
    I_C = [spatial_inertia(link.inertia) for link in tree.links]
    I_0 = held_inertia(tree)
    M = zeros(len(tree.w), len(tree.w))
    for i, link in reversed(list(enumerate(tree.links))):
        with tree.algebra.section(f"link {link.name}: composite inertia"):
            named(tree, i, IC=I_C[i])
            outer = X[i].T @ I_C[i] @ X[i]
            if link.parent != GROUND:
                I_C[link.parent] = I_C[link.parent] + outer
            else:
                I_0 = I_0 + outer
    for i, link in enumerate(tree.links):
        with tree.algebra.section(f"link {link.name}: column of the mass matrix"):
            F = I_C[i] @ link.S
            M[np.ix_(link.speeds, link.speeds)] = link.S.T @ F
            j = i
            while tree.links[j].parent != GROUND:
                F = X[j].T @ F
                j = tree.links[j].parent
                M_ji = tree.links[j].S.T @ F
                M[np.ix_(tree.links[j].speeds, link.speeds)] = M_ji
                M[np.ix_(link.speeds, tree.links[j].speeds)] = M_ji.T
    return CompositeBodies(tuple(I_C), I_0, M, M if tree.plain else congruence(M, tree.D))


def held_inertia(tree: Tree) -> np.ndarray:
    """Inertia (6, 6) of the bodies that are held to the ground, about the n-origin, n-frame: no link carries them."""
    algebra, total = tree.algebra, Inertia.none()
    for pose, body in zip(tree.poses, tree.model.bodies, strict=True):
        if pose.link == GROUND:
            about_com = Inertia(algebra.expression(body.mass), zeros(3), algebra.matrix(body.inertia))
            total = total + about_com.moved(pose.R, pose.point(algebra.constants(body.com)))
    return spatial_inertia(total)
