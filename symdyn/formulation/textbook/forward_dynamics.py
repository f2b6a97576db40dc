"""Forward dynamics by propagation: every link with all that hangs on it as one articulated body, O(n), no mass matrix."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from symdyn.formulation.probes.vanishing_pivots import behind, felt
from symdyn.formulation.textbook.inverse_dynamics import Wrench, outside
from symdyn.formulation.textbook.own_speeds import own_speeds
from symdyn.formulation.textbook.velocities import (
    Velocities,
    at_joint,
    base_acceleration,
    joint_accelerations,
    named,
    velocities,
)
from symdyn.formulation.trees.mass_matrix import factorize
from symdyn.formulation.trees.tree import GROUND, Tree
from symdyn.spatial.vectors import Vector, zeros


@dataclass(frozen=True)
class ForwardDynamics:
    """For each link, in its own axes and about its origin:

    S     (6, k) motion per generalized speed of the joint; c (6,) with what the joint accelerates by itself (given motions)
    I_A   (6, 6), p_A (6,): articulated inertia and bias force; f = I_A a + p_A
    U     (6, k) I_A S; D (k, k) S^T I_A S; u (k,) force that is left to accelerate the joint
    a, f  (6,) as in InverseDynamics
    w_dot (n_w,), u_dot (n_u,): accelerations of all joints, and generalized ones
    """

    velocities: Velocities
    S: tuple[np.ndarray, ...]
    c: tuple[np.ndarray, ...]
    I_A: tuple[np.ndarray, ...]
    p_A: tuple[np.ndarray, ...]
    U: tuple[np.ndarray, ...]
    D: tuple[np.ndarray, ...]
    u: tuple[np.ndarray, ...]
    a: tuple[np.ndarray, ...]
    f: tuple[np.ndarray, ...]
    w_dot: np.ndarray
    u_dot: np.ndarray


def forward_dynamics(tree: Tree, tau: Vector, wrenches: Sequence[Wrench] | None = None,
                     a_0: np.ndarray | None = None) -> ForwardDynamics:
    """Accelerations for joint forces tau (n_w,); wrenches and a_0 as for inverse_dynamics.

    Raises SymdynError for joints that share a speed (gears), and for speeds that move no joint.

    Source: lecture, chapter 5.8, the three-link arm (the same in 6.4), with U = I_A S, D = S^T I_A S and
    u = tau - S^T (I_A c + p_A):

        I_A_i = I_i + sum over children of X* (I_A - U D^-1 U^T) X
        p_A_i = p_i + sum over children of X* (p_A + I_A c + U D^-1 u)              inwards
        q_ddot_i = D^-1 (tau - S^T (I_A (X a_parent + c) + p_A)) = D^-1 (u - U^T X a_parent)
        a_i = X a_parent + S q_ddot_i + c_i                                         outwards

    The lecture has one degree of freedom a joint; S of k columns makes D a matrix, which is factorized. (Some slides of 5.8
    print a product for the minus in I_A; 5.7, where it is derived, has the minus.)
    """
    own = own_speeds(tree)
    m = velocities(tree)
    a_0 = base_acceleration(tree) if a_0 is None else a_0
    n = range(len(tree.links))
    # w_dot = D u_dot + b joint by joint: S D for the joint's own speeds, and S b belongs to what is known beforehand, c.
    joint_D = [tree.D[np.ix_(link.speeds, own[i])] for i, link in enumerate(tree.links)]
    S = [m.S[i] @ joint_D[i] for i in n]
    c = [m.c[i] + m.S[i] @ at_joint(link, tree.b) for i, link in enumerate(tree.links)]
    I_A, p_A = list(m.I), [m.p[i] - outside(wrenches, i) for i in n]
    U, D, u, factors = {}, {}, {}, {}
    for i, link in reversed(list(enumerate(tree.links))):
        with tree.algebra.section(f"link {link.name}: articulated inertia and bias force"):
            tau_i = joint_D[i].T @ at_joint(link, tau)
            named(tree, i, IA=I_A[i], pA=p_A[i])
            U[i] = I_A[i] @ S[i]
            D[i] = S[i].T @ U[i]
            u[i] = tau_i - S[i].T @ (I_A[i] @ c[i] + p_A[i])
            named(tree, i, U=U[i], u=u[i])
            reasons = [f"joint {link.joint.name} moves no inertia along {tree.model.speeds[j]}" for j in own[i]]
            least = {k: tree.algebra.rounding for k, j in enumerate(own[i]) if j in tree.vanishing_pivots}
            sizes = {k: behind(tree, i, S[i][:, k], lambda child: (I_A[child][:3, :3], I_A[child][3:, 3:]))
                     for k in least if not felt(tree, i, S[i][:, k])}
            factors[i] = factorize(tree.algebra, D[i], reasons, least=least, sizes=sizes)
            if link.parent != GROUND:
                X, X_star = m.X[i], m.X_star[i]
                I_A[link.parent] = I_A[link.parent] + X_star @ (I_A[i] - U[i] @ factors[i].solve(U[i].T)) @ X
                p_A[link.parent] = p_A[link.parent] + X_star @ (p_A[i] + I_A[i] @ c[i] + U[i] @ factors[i].solve(u[i]))
    a: list[np.ndarray] = []
    u_dot = zeros(len(tree.model.speeds))
    for i, link in enumerate(tree.links):
        with tree.algebra.section(f"link {link.name}: spatial acceleration"):
            before = m.X[i] @ (a_0 if link.parent == GROUND else a[link.parent])
            q_ddot = factors[i].solve(u[i] - U[i].T @ before)
            u_dot[own[i]] = q_ddot
            a.append(before + S[i] @ q_ddot + c[i])
            named(tree, i, a=a[i], ud=q_ddot)
    f = [I_A[i] @ a[i] + p_A[i] for i in n]
    return ForwardDynamics(m, tuple(S), tuple(c), tuple(I_A), tuple(p_A), tuple(U[i] for i in n), tuple(D[i] for i in n),
                           tuple(u[i] for i in n), tuple(a), tuple(f), joint_accelerations(tree, u_dot), u_dot)
