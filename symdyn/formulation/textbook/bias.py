"""Loads of joints by the motion and the weight alone: k_tilde, and the gravity load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from symdyn.formulation.textbook.inverse_dynamics import InverseDynamics, inverse_dynamics
from symdyn.formulation.textbook.velocities import base_acceleration, generalized
from symdyn.formulation.trees.tree import GROUND, Tree
from symdyn.spatial.sixvectors import motion_transform, spatial_inertia
from symdyn.spatial.vectors import zeros


@dataclass(frozen=True)
class Bias:
    """k_tilde (n_u,): Coriolis, centrifugal and gyroscopic forces, and those of given motions; the recursion behind it."""

    recursion: InverseDynamics
    k_tilde: np.ndarray


def bias(tree: Tree) -> Bias:
    """k_tilde = inverse dynamics with u_dot = 0 (w_dot = b), a base at rest, nothing acting from outside."""
    recursion = inverse_dynamics(tree, tree.b, zeros(6))
    return Bias(recursion, generalized(tree, recursion.tau))


@dataclass(frozen=True)
class GravityLoad:
    """For each link a (6,) = -g in link axes, and f (6,) that holds it and all outwards of it; the load (n_u,) = dV/dq."""

    a: tuple[np.ndarray, ...]
    f: tuple[np.ndarray, ...]
    load: np.ndarray


def gravity_load(tree: Tree) -> GravityLoad:
    """Forces along the generalized speeds that hold the weights: inverse dynamics at rest, every velocity product left out.

        a_i = X a_parent from a_0 = [0; -g];  f_i = I_i a_i + sum of X* f_child;  tau_i = S^T f_i

    It stands on the left: M_tilde u_dot + k_tilde + gravity_load = the other forces.
    """
    X = [motion_transform(link.R, link.r) for link in tree.links]
    a_0 = base_acceleration(tree)
    a: list[np.ndarray] = []
    f, tau = [], zeros(len(tree.w))
    for i, link in enumerate(tree.links):
        with tree.algebra.section(f"link {link.name}: weight"):
            a.append(X[i] @ (a_0 if link.parent == GROUND else a[link.parent]))
            f.append(spatial_inertia(link.inertia) @ a[i])
    for i, link in reversed(list(enumerate(tree.links))):
        with tree.algebra.section(f"link {link.name}: weight of all outwards of its joint"):
            tau[link.speeds.start:link.speeds.stop] = link.S.T @ f[i]
            if link.parent != GROUND:
                f[link.parent] = f[link.parent] + X[i].T @ f[i]
    return GravityLoad(tuple(a), tuple(f), generalized(tree, tau))
