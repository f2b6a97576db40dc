"""Matrices at many states without the entries that are zero by structure, and what is asked of them: least changes, ranks, the
combinations of rows that vanish. Small and full ones are taken as they are, with singular values; large ones with few entries
by sparse factors: R of A^T = Q R, constraint by constraint in an order of little fill-in.

Source: Davis, Algorithm 915, SuiteSparseQR: multifrontal multithreaded rank-revealing sparse QR factorization, ACM Trans. Math.
Softw. 38 (2011), for R with columns left out that follow from others (Heath, 1982).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.tape.intrinsics import RANK

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from symdyn.tape.floats import Entries

# With so many places at least, and entries in this part of them at most, sparse factors are taken.
LEAST_PLACES, LARGEST_PART = 20_000, 0.1
# Part of the square of the largest entry of a row by which least changes are damped, and rounds that take the damping off again.
DAMPING, ROUNDS = 1e-12, 4
# Rounds of the power iterations for the largest and for the smallest singular value.
POWERS = 12


@dataclass(frozen=True)
class Sampled:
    """(m, n) matrices A at s states: entries at the indices rows, columns (e,), ascending row by row; values (s, e)."""

    m: int
    n: int
    rows: np.ndarray
    columns: np.ndarray
    values: np.ndarray

    @classmethod
    def of(cls, A: np.ndarray) -> Sampled:
        """Entries of arrays (s, m, n) that are not zero at some state."""
        rows, columns = np.nonzero((A != 0).any(axis=0))
        _, m, n = A.shape
        return cls(m, n, rows, columns, A[:, rows, columns])

    @classmethod
    def of_entries(cls, entries: Entries) -> Sampled:
        """Entries of a matrix on a tape."""
        m, n = entries.shape
        return cls(m, n, entries.indices // max(n, 1), entries.indices % max(n, 1), entries.values)

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, states: Any) -> Sampled:
        return replace(self, values=self.values[states])

    @property
    def sparse(self) -> bool:
        """Whether sparse factors are taken."""
        return self.m * self.n >= LEAST_PLACES and len(self.rows) <= LARGEST_PART * self.m * self.n

    def dense(self) -> np.ndarray:
        """(s, m, n)"""
        A = np.zeros((len(self), self.m, self.n))
        A[:, self.rows, self.columns] = self.values
        return A

    def scaled(self, factors: np.ndarray, divisors: np.ndarray) -> Sampled:
        """Entries times factors of their rows (s, m), divided by divisors of their columns (s, n)."""
        return replace(self, values=self.values * factors[:, self.rows] / divisors[:, self.columns])

    def of_rows(self, kept: Sequence[int]) -> Sampled:
        """These rows in this order."""
        index = np.full(self.m, -1)
        index[list(kept)] = range(len(kept))
        there = np.flatnonzero(index[self.rows] >= 0)
        order = there[np.argsort(index[self.rows[there]], kind="stable")]
        return Sampled(len(kept), self.n, index[self.rows[order]], self.columns[order], self.values[:, order])

    def of_columns(self, kept: Sequence[int]) -> Sampled:
        """These columns in this order."""
        index = np.full(self.n, -1)
        index[list(kept)] = range(len(kept))
        there = np.flatnonzero(index[self.columns] >= 0)
        order = there[np.lexsort((index[self.columns[there]], self.rows[there]))]
        return Sampled(self.m, len(kept), self.rows[order], index[self.columns[order]], self.values[:, order])

    def without_rows(self, left_out: np.ndarray) -> Sampled:
        """The rows where this (m,) holds are zero."""
        return replace(self, values=np.where(left_out[self.rows], 0.0, self.values))

    def together(self) -> Sampled:
        """The matrices of all states next to each other, as one state, (m, s n)."""
        rows, columns = np.tile(self.rows, len(self)), (self.n * np.arange(len(self))[:, None] + self.columns).ravel()
        order = np.argsort(rows, kind="stable")
        return Sampled(self.m, len(self) * self.n, rows[order], columns[order], self.values.ravel()[None, order])

    def times(self, v: np.ndarray) -> np.ndarray:
        """A v (s, m) for v (s, n)."""
        if not self.sparse:
            product: np.ndarray = (self.dense() @ v[..., None])[..., 0]
            return product
        return np.stack([A @ x for A, x in zip(self.matrices, v, strict=True)]).reshape(len(v), self.m)

    def largest_of_rows(self) -> np.ndarray:
        """The largest absolute value in each row at each state, (s, m)."""
        largest = np.zeros((self.m, len(self)))
        np.maximum.at(largest, self.rows, np.abs(self.values).T)
        return largest.T

    @cached_property
    def matrices(self) -> list[csr_matrix]:
        """One for each state."""
        from scipy.sparse import csr_matrix

        starts = np.searchsorted(self.rows, np.arange(self.m + 1))
        return [csr_matrix((values, self.columns, starts), shape=(self.m, self.n)) for values in self.values]

    # -- what is asked

    def least_change(self, right: np.ndarray, cut: float) -> np.ndarray:
        """The smallest y (s, n) that brings A y next to right (s, m); cut: part of the largest singular value below which others
        are passed over. With sparse factors these hold less and less instead."""
        if not self.sparse:
            change: np.ndarray = (np.linalg.pinv(self.dense(), rcond=cut) @ right[..., None])[..., 0]
            return change
        from scipy.sparse import identity
        from scipy.sparse.linalg import splu

        changes = np.zeros((len(self), self.n))
        for A, y, r in zip(self.matrices, changes, right, strict=True):
            size = float(A.multiply(A).sum(axis=1).max()) if A.nnz else 0.0
            if size == 0:
                continue
            square = (A @ A.T + DAMPING * size * identity(self.m)).tocsc()
            factors = splu(square, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
            for _ in range(ROUNDS):
                y += A.T @ factors.solve(r - A @ y)
        return changes

    def ranks(self) -> np.ndarray:
        """Number of singular values of more than RANK of the largest, (s,)."""
        if not self.sparse:
            return self.by_singular_values()
        factors = self.triangular()
        counts = factors.kept.sum(axis=1)
        for k in np.flatnonzero(factors.smallest() <= RANK * factors.largest):  # the diagonal of R does not show it
            counts[k] = self[[k]].by_singular_values()[0]
        return counts

    def by_singular_values(self) -> np.ndarray:
        """The same without sparse factors."""
        sizes = self.singular_values()
        counts: np.ndarray = (sizes > RANK * np.maximum(sizes[:, :1], 1e-300)).sum(axis=1)
        return counts

    def singular_values(self) -> np.ndarray:
        """(s, min(m, n)), the largest first."""
        return np.linalg.svd(self.dense(), compute_uv=False)

    def smallest(self) -> np.ndarray:
        """The smallest singular value of matrices of full row rank, (s,)."""
        if not self.sparse:
            return self.singular_values()[:, -1]
        factors = self.triangular()
        return np.where(factors.kept.all(axis=1), factors.smallest(), 0.0)

    def vanishing(self, rank: int) -> np.ndarray:
        """Orthonormal combinations of the rows that vanish, (s, m, m - rank)."""
        if not self.sparse:
            return np.linalg.svd(self.dense())[0][:, :, rank:]
        factors = self.triangular()
        result = np.linalg.qr(factors.combinations(self.m - rank))[0]
        for k in np.flatnonzero(factors.kept.sum(axis=1) != rank):
            result[k] = np.linalg.svd(self[[k]].dense())[0][0, :, rank:]
        return result

    def triangular(self) -> Triangular:
        """R of A^T = Q R."""
        order = elimination(self)
        index = np.empty(self.m, dtype=int)
        index[order] = range(self.m)
        largest = _largest(self)
        fronts: list[list[tuple[np.ndarray, np.ndarray]]] = [[] for _ in range(self.m)]
        by_column = np.lexsort((index[self.rows], self.columns))
        for entries in np.split(by_column, np.searchsorted(self.columns[by_column], np.arange(1, self.n))):
            if len(entries):
                at = index[self.rows[entries]]
                fronts[at[0]].append((at, self.values[:, None, entries]))
        kept = np.zeros((len(self), self.m), dtype=bool)
        R: list[tuple[np.ndarray, np.ndarray]] = []
        for k, blocks in enumerate(fronts):
            at = np.unique(np.concatenate([[k], *[a for a, _ in blocks]]))
            block = np.zeros((len(self), sum(values.shape[1] for _, values in blocks), len(at)))
            first = 0
            for a, values in blocks:
                block[:, first:first + values.shape[1], np.searchsorted(at, a)] = values
                first += values.shape[1]
            block = np.asarray(np.linalg.qr(block, mode="r")) if first > 1 else block
            kept[:, k] = np.abs(block[:, 0, 0]) > RANK * largest if first else False
            R.append((at, np.where(kept[:, k, None], block[:, 0], 0.0) if first else np.zeros((len(self), len(at)))))
            rest = block[:, :, 1:]
            rest = rest[:, 1:] if kept[:, k].all() else np.where(kept[:, k, None, None] & _first(block.shape[1]), 0.0, rest)
            if rest.size:
                fronts[at[1]].append((at[1:], rest))
            fronts[k] = []
        return Triangular(order, R, kept, largest)


def _first(n: int) -> np.ndarray:
    """Marks the first of n rows, (n, 1)."""
    return (np.arange(n) == 0)[:, None]


def _largest(A: Sampled) -> np.ndarray:
    """The largest singular value, (s,), by power iteration."""
    result = np.zeros(len(A))
    start = np.random.default_rng(5).standard_normal(A.m)
    for k, matrix in enumerate(A.matrices):
        x = start / np.linalg.norm(start)
        for _ in range(POWERS):
            x = matrix @ (matrix.T @ x)
            size = float(np.linalg.norm(x))
            if size == 0:
                break
            x /= size
        result[k] = np.sqrt(size)
    return np.maximum(result, 1e-300)


def elimination(A: Sampled) -> np.ndarray:
    """Rows in an order in which A A^T fills in little when it is eliminated from the first to the last."""
    by_column = np.argsort(A.columns, kind="stable")
    near: list[set[int]] = [set() for _ in range(A.m)]
    for entries in np.split(by_column, np.searchsorted(A.columns[by_column], np.arange(1, A.n))):
        together = set(A.rows[entries].tolist())
        for i in together:
            near[i] |= together
    for i in range(A.m):
        near[i].discard(i)
    return np.array(minimum_degree(near), dtype=int)


def minimum_degree(near: Sequence[set[int]]) -> list[int]:
    """An order of elimination that fills in little of a symmetric matrix whose row i is not zero in columns near[i], and in i.

    Duff, Erisman and Reid, Direct Methods for Sparse Matrices, section 7.2.
    """
    left = [set(row) for row in near]  # without what is eliminated
    waiting = set(range(len(left)))
    order: list[int] = []
    while waiting:
        k = min(waiting, key=lambda i: (len(left[i]), i))
        waiting.remove(k)
        for i in left[k]:
            left[i] |= left[k]
            left[i] -= {i, k}
        order.append(k)
    return order


@dataclass(frozen=True)
class Triangular:
    """R of A^T = Q R, its columns the rows of A in their order of elimination.

    R        row by row: its columns from the diagonal on, and the values (s, c) there
    kept     (s, m) whether a row of A does not follow from those before it; largest: singular value of A, (s,)
    """

    order: np.ndarray
    R: list[tuple[np.ndarray, np.ndarray]]
    kept: np.ndarray
    largest: np.ndarray

    def _matrix(self, k: int) -> csr_matrix:
        """R (m, m) at state k; rows that were not kept are zero."""
        from scipy.sparse import csr_matrix

        m = len(self.R)
        starts = np.cumsum([0, *[len(at) for at, _ in self.R]])
        columns = np.concatenate([at for at, _ in self.R])
        return csr_matrix((np.concatenate([values[k] for _, values in self.R]), columns, starts), shape=(m, m))

    def _solver(self, R: csr_matrix) -> Any:
        from scipy.sparse.linalg import splu

        return splu(R.tocsc(), permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})

    def smallest(self) -> np.ndarray:
        """The smallest singular value of the rows that were kept, (s,), by inverse iteration; inf where there are none."""
        sizes = np.full(len(self.kept), np.inf)
        for k, kept in enumerate(self.kept):
            if kept.any():
                own = np.flatnonzero(kept)
                solver = self._solver(self._matrix(k)[own][:, own])
                x, size = np.random.default_rng(5).standard_normal(len(own)), np.inf
                for _ in range(POWERS):
                    x = solver.solve(solver.solve(x / np.linalg.norm(x), "T"))
                    size = float(np.linalg.norm(x))
                sizes[k] = 1 / np.sqrt(size)
        return sizes

    def combinations(self, count: int) -> np.ndarray:
        """Combinations of rows of A that vanish: a row that was not kept less its combination of those that were, (s, m,
        count)."""
        result = np.zeros((len(self.kept), len(self.R), count))
        for k, kept in enumerate(self.kept):
            own, others = np.flatnonzero(kept), np.flatnonzero(~kept)[:count]
            R = self._matrix(k)
            parts = self._solver(R[own][:, own]).solve(R[own][:, others].toarray())
            result[k][np.ix_(self.order[own], np.arange(len(others)))] = -parts
            result[k, self.order[others], range(len(others))] = 1
        return result
