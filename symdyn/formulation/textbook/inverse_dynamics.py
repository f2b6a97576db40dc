"""Inverse dynamics by the recursive Newton-Euler formulation in spatial vectors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from symdyn.formulation.textbook.velocities import Velocities, at_joint, base_acceleration, named, velocities
from symdyn.formulation.trees.tree import GROUND, Tree
from symdyn.spatial.vectors import Vector, zeros

Wrench = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class InverseDynamics:
    """For each link, in its own axes and about its origin:

    a     (6,) spatial acceleration: the rates of change of the components of v, [omega_dot; v_O_dot]. Its lower half is not
          the acceleration of the origin, which is v_O_dot + omega x v_O. Counted with the base's acceleration a_0.
    f_B   (6,) resultant force on the body alone, I a + p
    f     (6,) force that the parent exerts on the link through the joint
    tau   (n_w,) force along each joint speed
    """

    velocities: Velocities
    a: tuple[np.ndarray, ...]
    f_B: tuple[np.ndarray, ...]
    f: tuple[np.ndarray, ...]
    tau: np.ndarray


def inverse_dynamics(tree: Tree, w_dot: Vector, a_0: np.ndarray | None = None,
                     wrenches: Sequence[Wrench] | None = None) -> InverseDynamics:
    """Joint forces for joint accelerations w_dot (n_w,); see joint_accelerations for w_dot from u_dot.

    a_0        (6,) acceleration of the base; default [0; -g], which stands for the weights
    wrenches   for each link what acts on it from outside: (force, moment about the origin), link axes

    Source: lecture, chapter 5.7, "Simplified version of Equations from Inverse Dynamics" (the same in 6.4):

        a_i   = X a_parent + S q_ddot + c_i         outwards
        f_B_i = I_i a_i + p_i
        f_i   = f_B_i + sum of X* f_child           inwards; less what acts from outside, which the lecture does not have
        tau_i = S^T f_i
    """
    m = velocities(tree)
    a_0 = base_acceleration(tree) if a_0 is None else a_0
    a: list[np.ndarray] = []
    f_B, f = [], []
    tau = zeros(len(tree.w))
    for i, link in enumerate(tree.links):
        with tree.algebra.section(f"link {link.name}: spatial acceleration and the force it needs"):
            a_parent = a_0 if link.parent == GROUND else a[link.parent]
            a.append(m.X[i] @ a_parent + m.S[i] @ at_joint(link, w_dot) + m.c[i])
            f_B.append(m.I[i] @ a[i] + m.p[i])
            named(tree, i, a=a[i], fB=f_B[i])
            f.append(f_B[i] - outside(wrenches, i))
    for i, link in reversed(list(enumerate(tree.links))):
        with tree.algebra.section(f"link {link.name}: spatial force at its joint"):
            named(tree, i, f=f[i])
            tau[link.speeds.start:link.speeds.stop] = m.S[i].T @ f[i]
            if link.parent != GROUND:
                f[link.parent] = f[link.parent] + m.X_star[i] @ f[i]
    return InverseDynamics(m, tuple(a), tuple(f_B), tuple(f), tau)


def outside(wrenches: Sequence[Wrench] | None, i: int) -> np.ndarray:
    """The load on link i from outside, (6,): moment first."""
    return zeros(6) if wrenches is None else np.concatenate([wrenches[i][1], wrenches[i][0]])
