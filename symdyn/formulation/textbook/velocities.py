"""Start of every recursion of the lecture: transforms, velocities, and the forces and accelerations they alone make."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.formulation.textbook.rates import apparent_rates
from symdyn.formulation.trees.tree import GROUND, Link, Tree
from symdyn.spatial.sixvectors import force_cross, motion_cross, motion_transform, spatial_inertia
from symdyn.spatial.vectors import Vector, zeros


@dataclass(frozen=True)
class Velocities:
    """For each link, in its own axes and about its origin, which is the joint:

    X        (6, 6) motions from the parent's frame to the link's; X_star (6, 6) forces from the link's to the parent's
    S        (6, k) motion subspace of the joint; S_ring (6, k) its apparent rate of change
    I        (6, 6) spatial inertia
    v        (6,) velocity [omega; v_O]
    c        (6,) what is left of the acceleration without the parent's and without w_dot
    p        (6,) force that the velocity alone needs
    """

    X: tuple[np.ndarray, ...]
    X_star: tuple[np.ndarray, ...]
    S: tuple[np.ndarray, ...]
    S_ring: tuple[np.ndarray, ...]
    I: tuple[np.ndarray, ...]
    v: tuple[np.ndarray, ...]
    c: tuple[np.ndarray, ...]
    p: tuple[np.ndarray, ...]


def velocities(tree: Tree) -> Velocities:
    """From the base outwards, link by link. Source: lecture, chapter 5.6, the summary, and 5.7, where c and p are named.

        v_i = X v_parent + S q_dot
        c_i = S_ring q_dot + v_i x S q_dot
        p_i = v_i x* I v_i                      (the summary of 5.7 prints v x I v; a force takes x*)

    For q_dot stand the speeds w of the joint, which may be quasi-velocities or follow a given motion. The joints' own c is
    not used: S_ring q_dot comes from differentiating S.
    """
    S_ring = apparent_rates(tree).S_ring
    X, X_star, I, c, p = [], [], [], [], []
    v: list[np.ndarray] = []
    for i, link in enumerate(tree.links):
        with tree.algebra.section(f"link {link.name}: spatial velocity"):
            S, q_dot = link.S, at_joint(link, tree.w)
            X.append(motion_transform(link.R, link.r))
            X_star.append(X[i].T)
            I.append(spatial_inertia(link.inertia))
            v_parent = zeros(6) if link.parent == GROUND else v[link.parent]
            v.append(X[i] @ v_parent + S @ q_dot)
            named(tree, i, v=v[i])
            c.append(S_ring[i] @ q_dot + motion_cross(v[i]) @ (S @ q_dot))
            p.append(force_cross(v[i]) @ (I[i] @ v[i]))
            named(tree, i, c=c[i], p=p[i])
    return Velocities(tuple(X), tuple(X_star), tuple(link.S for link in tree.links), S_ring, tuple(I), tuple(v), tuple(c),
                      tuple(p))


def named(tree: Tree, i: int, **quantities: Any) -> None:
    """Name quantities of link i on the tape, counted from 1 as the lecture counts."""
    for letter, value in quantities.items():
        tree.algebra.name(f"{letter}{i + 1}", value)


def at_joint(link: Link, values: Vector) -> np.ndarray:
    """The entries (k,) of a link's joint among values (n_w,) for all joint speeds."""
    return np.asarray(values[link.speeds.start:link.speeds.stop], dtype=object)


def joint_accelerations(tree: Tree, u_dot: Vector) -> np.ndarray:
    """w_dot = D u_dot + b, (n_w,), of all joints for generalized accelerations u_dot (n_u,)."""
    return tree.D @ np.asarray(u_dot, dtype=object) + tree.b


def generalized(tree: Tree, tau: np.ndarray) -> np.ndarray:
    """D^T tau, (n_u,): forces along the joints' speeds as forces along the generalized speeds."""
    return tree.D.T @ tau


def base_acceleration(tree: Tree) -> np.ndarray:
    """a_0 = [0; -g], (6,): a base that accelerates upwards loads every body as its weight does."""
    return np.concatenate([zeros(3), -tree.algebra.constants(tree.model.gravity)])
