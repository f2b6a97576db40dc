"""The Coriolis matrix: C u = k_tilde with M_dot - 2 C skew-symmetric, by recursion over the links."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from symdyn.errors import SymdynError
from symdyn.formulation.textbook.composite_bodies import composite_bodies
from symdyn.formulation.textbook.rates import apparent_rates
from symdyn.formulation.textbook.velocities import named, velocities
from symdyn.formulation.trees.tree import GROUND, Tree
from symdyn.model.symbols import GivenMotion, symbols_of, time
from symdyn.spatial.sixvectors import force_cross, force_cross_swapped, motion_cross
from symdyn.spatial.vectors import zeros


@dataclass(frozen=True)
class Coriolis:
    """B   (6, 6) for each link: B v = v x* I v, and I_dot - 2 B is skew-symmetric
    I_C, B_C   (6, 6) I and B of the link and all outwards of it
    Psi_dot    (6, k) rate of change of S in space, S_ring + v x S
    C_w   (n_w, n_w) in the joints' speeds; C (n_u, n_u) in the generalized ones, D^T C_w D + D^T M_w D_dot
    """

    B: tuple[np.ndarray, ...]
    I_C: tuple[np.ndarray, ...]
    B_C: tuple[np.ndarray, ...]
    Psi_dot: tuple[np.ndarray, ...]
    C_w: np.ndarray
    C: np.ndarray


def coriolis(tree: Tree) -> Coriolis:
    """The matrix C(q, u) (n_u, n_u).

    With v_i = J_i w and a_i = J_i w_dot + A_i w, k = sum of J^T (I A w + v x* I v), so that C = sum of J^T (I A + B J) with any
    B v = v x* I v. The rate of change of I in space is (v x*) I - I (v x); M_dot - 2 C is skew-symmetric if that less 2 B is,
    which B = ((v x*) I - I (v x) + (the matrix that takes v to v x* I v)) / 2 brings about. Summed inwards:

        I_C_i = I_i + sum of X* I_C X,  B_C_i = B_i + sum of X* B_C X
        C_ji = S_j^T (I_C_i Psi_dot_i + B_C_i S_i) and C_ij = (Psi_dot_j^T I_C_i S_i + S_j^T B_C_i^T S_i)^T, j inwards of i

    Source: not in the lecture. Echeandia and Wensing, Numerical methods to compute the Coriolis matrix and Christoffel symbols
    for rigid-body systems (2021). Raises SymdynError for given motions: what they load the joints with is not linear in u.
    """
    given = given_motions(tree)
    if given:
        raise SymdynError(f"{tree.model.name}: there is no Coriolis matrix with C u = k_tilde, since the joints "
                          f"{', '.join(given)} follow given functions of time; use k_tilde itself")
    m, rates, composite = velocities(tree), apparent_rates(tree), composite_bodies(tree)
    n, links = range(len(tree.links)), tree.links
    B, Psi_dot = [], []
    for i in n:
        with tree.algebra.section(f"link {links[i].name}: rates of change of its inertia and its motion subspace"):
            I, v = m.I[i], m.v[i]
            B.append((force_cross(v) @ I - I @ motion_cross(v) + force_cross_swapped(I @ v)) / 2)
            Psi_dot.append(m.S_ring[i] + motion_cross(v) @ m.S[i])
            named(tree, i, B=B[i], Psid=Psi_dot[i])
    B_C, I_C, C = list(B), composite.I_C, zeros(len(tree.w), len(tree.w))
    for i in reversed(n):
        with tree.algebra.section(f"link {links[i].name}: column and row of the Coriolis matrix"):
            F_1, F_2, F_3 = I_C[i] @ Psi_dot[i] + B_C[i] @ m.S[i], I_C[i] @ m.S[i], B_C[i].T @ m.S[i]
            C[np.ix_(links[i].speeds, links[i].speeds)] = m.S[i].T @ F_1
            j = i
            while links[j].parent != GROUND:
                F_1, F_2, F_3 = m.X_star[j] @ F_1, m.X_star[j] @ F_2, m.X_star[j] @ F_3
                j = links[j].parent
                C[np.ix_(links[j].speeds, links[i].speeds)] = m.S[j].T @ F_1
                C[np.ix_(links[i].speeds, links[j].speeds)] = (Psi_dot[j].T @ F_2 + m.S[j].T @ F_3).T
            if links[i].parent != GROUND:
                B_C[links[i].parent] = B_C[links[i].parent] + m.X_star[i] @ B_C[i] @ m.X[i]
    C_u = C if tree.plain else tree.D.T @ (C @ tree.D + composite.M_w @ rates.D_dot)
    return Coriolis(tuple(B), I_C, tuple(B_C), tuple(Psi_dot), C, C_u)


def given_motions(tree: Tree) -> list[str]:
    """Names of the joints that move by themselves as time goes on."""
    return [link.joint.name for link in tree.links
            if any(time in symbols_of(q) or q.has(GivenMotion) for q in link.joint.coordinates)]
