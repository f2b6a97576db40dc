"""The mass matrix by composite bodies, and its factorization on the tape.

Source: Walker and Orin (1982), method 3; Featherstone, Rigid Body Dynamics Algorithms, section 6.2 (composite bodies)
and 6.5 (L^T D L, which keeps the zeros that branches of the tree leave in the mass matrix).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from symdyn.formulation.probes.vanishing_pivots import behind, felt
from symdyn.formulation.trees.link import Wrench
from symdyn.formulation.trees.tree import GROUND, Tree
from symdyn.spatial.inertia import ArticulatedInertia, Inertia, total
from symdyn.spatial.vectors import cross, dot, identity, zeros
from symdyn.tape.node import is_zero


def mass_matrix(tree: Tree) -> np.ndarray:
    """Mass matrix in the joints' speeds, (n_w, n_w): each entry one link's composite inertia moved to another joint."""
    algebra = tree.algebra
    composite = own_inertias(tree)
    M = zeros(len(tree.w), len(tree.w))
    for i in reversed(range(len(tree.links))):
        link = tree.links[i]
        elastic = tree.elastic(i)
        with algebra.section(f"mass matrix: composite body from link {link.name} outwards"):
            for column, index in enumerate(link.speeds):
                f, n = composite[i].momentum(link.S[:3, column], link.S[3:, column])
                for other in range(column + 1):
                    entry = dot(link.S[:3, other], n) + dot(link.S[3:, other], f)
                    if elastic is not None:
                        entry = entry + elastic.Me[other, column]
                    M[index, link.speeds[other]] = M[link.speeds[other], index] = entry
                _carry(tree, M, i, index, f, n, None if elastic is None else elastic.coupling(column))
            if link.parent != GROUND:
                composite[link.parent] = total(composite[link.parent], composite[i].moved(link.R, link.r))
                _name(algebra, link.parent + 1, composite[link.parent])
    return M


def sizes_of_pivots(tree: Tree) -> dict[int, Any]:
    """Reference sizes of vanishing pivots whose own link has no mass along the speed: their diagonal may be rounding, too."""
    unfelt = [(i, column, index) for i, link in enumerate(tree.links) for column, index in enumerate(link.speeds)
              if tree.plain and index in tree.vanishing_pivots and not felt(tree, i, link.S[:, column])]
    if not unfelt:
        return {}
    composite = own_inertias(tree)
    for i in reversed(range(len(tree.links))):
        link = tree.links[i]
        if link.parent != GROUND:
            composite[link.parent] = total(composite[link.parent], composite[i].moved(link.R, link.r))

    def blocks(child: int) -> tuple[np.ndarray, np.ndarray]:
        whole = composite[child]
        return (whole.I, whole.m * identity()) if isinstance(whole, Inertia) else (whole.A, whole.M)

    return {index: behind(tree, i, tree.links[i].S[:, column], blocks) for i, column, index in unfelt}


def own_inertias(tree: Tree) -> list[Inertia | ArticulatedInertia]:
    """Inertia of every link, with the deflection of elastic bodies clamped to it and the water it moves along."""
    inertias: list[Inertia | ArticulatedInertia] = [link.effective for link in tree.links]
    for body in tree.flexible:
        if body.root != GROUND:
            inertias[body.root] = total(inertias[body.root], body.inertia)
    for k, added in tree.added:
        inertias[k] = total(inertias[k], added)
    return inertias


def _name(algebra: Any, number: int, inertia: Inertia | ArticulatedInertia) -> None:
    if isinstance(inertia, Inertia):
        algebra.name(f"mc{number}", inertia.m)
        algebra.vector(f"hc{number}", inertia.h)
        algebra.vector(f"Ic{number}", inertia.I)
    else:
        for letter, block in (("Ac", inertia.A), ("Hc", inertia.H), ("Mc", inertia.M)):
            algebra.vector(f"{letter}{number}", block)


def _carry(tree: Tree, M: np.ndarray, i: int, index: int, f: np.ndarray, n: np.ndarray, coupling: Wrench | None) -> None:
    """Carry the wrench of one column to the joints inwards of link i; coupling: what an elastic body adds at its clamped end."""
    link = tree.links[i]
    while link.parent != GROUND:
        force = link.R @ f
        n = link.R @ n + cross(link.r, force)
        f = force
        if coupling is not None:
            f, n, coupling = f + coupling[0], n + coupling[1], None
        link = tree.links[link.parent]
        for column, row in enumerate(link.speeds):
            M[index, row] = M[row, index] = dot(link.S[:3, column], n) + dot(link.S[3:, column], f)


@dataclass(frozen=True)
class Factors:
    """M = L^T D L with L unit lower triangular, D diagonal; entries that are zero by structure are the number 0.

    A pivot that is zero by structure has the inverse 0: what is divided by it must not be used.
    filled   of each row of L, the columns below the diagonal that are not zero by structure
    """

    L: np.ndarray
    D: list[Any]
    inverse_D: list[Any]
    filled: list[list[int]]

    def solve(self, right: np.ndarray) -> np.ndarray:
        """x with M x = right, (n,)."""
        return self.outwards(self.inwards(right))

    def inwards(self, right: np.ndarray) -> np.ndarray:
        """y with L^T y = right, (n,)."""
        y = np.array(right, dtype=object)
        for k in reversed(range(len(y))):
            for i in self.filled[k]:
                y[i] = y[i] - self.L[k, i] * y[k]
        return y

    def outwards(self, y: np.ndarray) -> np.ndarray:
        """x with D L x = y, (n,)."""
        x = np.array(y, dtype=object)
        for k in range(len(x)):
            x[k] = x[k] * self.inverse_D[k]
            for i in self.filled[k]:
                x[k] = x[k] - self.L[k, i] * x[i]
        return x


def factorize(algebra: Any, M: np.ndarray, reasons: Sequence[str], letters: str = "", least: Mapping[int, Any] | None = None,
              sizes: Mapping[int, Any] | None = None) -> Factors:
    """L^T D L of a symmetric positive definite matrix, from the last row to the first.

    reasons   what it means if the pivot of a row is not positive, or not above its `least`, when the code runs
    letters   put before the names of the factors
    least     of some rows, the part of its size that a pivot must be above; of the others it must be above 0
    sizes     of some rows, what a pivot is compared with; by default the diagonal entry that it came from
    """
    least, sizes = least or {}, sizes or {}
    n = len(M)
    A = np.array(M, dtype=object)
    L = zeros(n, n)
    inverse: list[Any] = [0] * n
    filled: list[list[int]] = [[] for _ in range(n)]
    for k in reversed(range(n)):
        filled[k] = columns = [i for i, e in enumerate(A[k, :k]) if not is_zero(e)]
        pivot = algebra.name(f"{letters}D{k + 1}", A[k, k])
        size = sizes.get(k, M[k, k])
        if k in least and not isinstance(pivot, (int, Fraction)) and pivot is not size:
            pivot = algebra.divisor(pivot, least[k] * size, reasons[k])
        pivot = algebra.positive(pivot, reasons[k])
        inverse[k] = 0 if is_zero(pivot) else algebra.name(f"i{letters}D{k + 1}", 1 / pivot)
        for i in columns:
            L[k, i] = algebra.name(f"{letters}L{k + 1}_{i + 1}", A[k, i] * inverse[k])
        for index, i in enumerate(columns):
            for j in columns[:index + 1]:
                A[i, j] = A[i, j] - L[k, i] * A[k, j]
    return Factors(L, list(np.diagonal(A)), inverse, filled)
