"""Added mass in a tree: what the water that links move along adds to their inertia, forces and energy."""

from __future__ import annotations

from typing import Any

import numpy as np

from symdyn.formulation.algebra import TapeAlgebra
from symdyn.formulation.trees.link import LinkMotion, Wrench
from symdyn.model.elements import AddedMass
from symdyn.spatial.inertia import ArticulatedInertia
from symdyn.spatial.vectors import cross, dot


def of_load(algebra: TapeAlgebra, load: AddedMass, R: np.ndarray, point: np.ndarray) -> ArticulatedInertia:
    """The added mass seen from a link in which its body has the orientation R and its point is at `point`."""
    A = algebra.matrix(load.A)
    for i in range(6):
        A[i, :i] = A[:i, i]
    return ArticulatedInertia(A[3:, 3:], A[3:, :3], A[:3, :3]).moved(R, point)


def inertial_wrench(added: ArticulatedInertia, motion: LinkMotion, v: np.ndarray, a_0: np.ndarray) -> Wrench:
    """Kirchhoff's equations: force P_dot + omega x P and moment L_dot + omega x L + v x P, P = M v + H^T omega,
    L = A omega + H v, about the link's origin.

    v     velocity of the origin; a_0: acceleration of the base in `motion`, which stands for gravity: water has no weight here
    """
    omega = motion.omega
    v_dot = motion.a - a_0 - cross(omega, v)
    P, L = added.momentum(omega, v)
    P_dot, L_dot = added.momentum(motion.alpha, v_dot)
    return P_dot + cross(omega, P), L_dot + cross(omega, L) + cross(v, P)


def kinetic_energy(added: ArticulatedInertia, omega: np.ndarray, v: np.ndarray) -> Any:
    """J."""
    P, L = added.momentum(omega, v)
    return (dot(v, P) + dot(omega, L)) / 2
