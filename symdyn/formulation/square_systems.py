"""Square systems of linear equations on a tape: A x = b, by blocks, each of one to three unknowns by determinants.

Rows and columns are ordered so that A becomes block triangular (Duff, Erisman and Reid, Direct Methods for Sparse Matrices,
chapter 6). A block of up to three unknowns is solved by Cramer's rule: it divides by its determinant alone, which vanishes only
where the block is singular, at no state besides. Larger blocks, which are rare in kinematics, are left to the numeric algorithm.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from symdyn.formulation.constraints.saddle import IntrinsicSolver
from symdyn.spatial.vectors import cross, inner, vector, zeros
from symdyn.tape.node import Node, is_zero

# A determinant below this part of the product of the lengths of its rows is zero.
SINGULAR = Fraction(1, 10**12)
LARGEST = 3


class SquareSystem:
    """A x = b with A (n, n).

    reason   what it means if A is singular
    Raises ZeroDivisionError if A is singular whatever the values of its entries.
    """

    def __init__(self, algebra: Any, A: np.ndarray, reason: str) -> None:
        self.algebra, self.A, self.reason = algebra, np.asarray(A, dtype=object), reason
        self.blocks = blocks(np.array([[not is_zero(e) for e in row] for row in self.A], dtype=bool).reshape(self.A.shape))
        self.inverses = [self._inverse(rows, columns) for rows, columns in self.blocks]

    def solve(self, right: Sequence[Any] | np.ndarray) -> np.ndarray:
        """x, (n,)."""
        x = zeros(len(self.A))
        for (rows, columns), inverse in zip(self.blocks, self.inverses, strict=True):
            left = vector(*[right[i] - inner(self.A[i], x) for i in rows])  # unknowns of later blocks are still zero
            x[columns] = self._numeric(rows, columns, left) if inverse is None else inverse @ left
        return x

    def _inverse(self, rows: list[int], columns: list[int]) -> np.ndarray | None:
        """Inverse of a block by determinants; None if it is too large for that."""
        block = self.A[np.ix_(rows, columns)]
        n = len(rows)
        if n > LARGEST:
            return None
        adjugate = _adjugate(block)
        determinant = inner(block[0], adjugate[:, 0])
        if not isinstance(determinant, Node):
            if determinant == 0:
                raise ZeroDivisionError(self.reason)
            return adjugate * (1 / Fraction(determinant))
        least: Any = SINGULAR**2
        for row in block:
            least = least * inner(row, row)
        margin = determinant * determinant - least if n > 1 else determinant * determinant
        guarded = self.algebra.recorder.guard(determinant, margin, self.reason)
        return np.array([[e / guarded if isinstance(e, Node) or e else 0 for e in row] for row in adjugate], dtype=object)

    def _numeric(self, rows: list[int], columns: list[int], right: np.ndarray) -> np.ndarray:
        n = len(rows)
        solver = IntrinsicSolver(self.algebra, zeros(n, n), self.A[np.ix_(rows, columns)], vector(*[1] * n), [1] * n, self.reason)
        return solver.solve(zeros(n), right)[0]


def _adjugate(A: np.ndarray) -> np.ndarray:
    """The transposed cofactors of a matrix of one to three rows."""
    n = len(A)
    if n == 1:
        return np.array([[1]], dtype=object)
    if n == 2:
        return np.array([[A[1, 1], -A[0, 1]], [-A[1, 0], A[0, 0]]], dtype=object)
    a, b, c = A.T
    return np.array([cross(b, c), cross(c, a), cross(a, b)], dtype=object)


def blocks(structure: np.ndarray) -> list[tuple[list[int], list[int]]]:
    """Rows and columns of the diagonal blocks, in the order in which they are solved.

    Raises ZeroDivisionError if no choice of entries makes the matrix regular.
    """
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components, maximum_bipartite_matching

    if not len(structure):
        return []
    row_of = maximum_bipartite_matching(csr_matrix(structure), perm_type="row")
    if (row_of < 0).any():
        raise ZeroDivisionError("the matrix is singular, whatever the values of its entries")
    permuted = structure[row_of]  # now the diagonal is full; entry (i, j): unknown i needs unknown j
    count, labels = connected_components(csr_matrix(permuted), directed=True, connection="strong")
    members = [[int(k) for k in np.flatnonzero(labels == c)] for c in range(count)]
    needs = [{int(labels[j]) for i in group for j in np.flatnonzero(permuted[i])} - {c} for c, group in enumerate(members)]
    order: list[int] = []
    while len(order) < count:
        order += [c for c in range(count) if c not in order and needs[c] <= set(order)]
    return [([int(row_of[k]) for k in members[c]], members[c]) for c in order]
