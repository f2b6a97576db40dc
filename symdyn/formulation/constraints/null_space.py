"""Solving M x + C^T lam = f, C x = d by eliminating dependent speeds: only M in the directions that C leaves must be regular.

x = Z v + g with C Z = 0 and C g = d: Z^T M Z v = Z^T (f - M g), C_d^T lam = (f - M x)_d, where C_d are the columns of C of the
dependent speeds, factorized as they are, in an order that is good at a sample state.
Source: Benzi, Golub and Liesen, Numerical solution of saddle point problems, Acta Numerica 14 (2005), section 6.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from symdyn.formulation.trees.mass_matrix import factorize
from symdyn.spatial.vectors import congruence, inner, vector, zeros
from symdyn.tape.node import Node, is_zero

# Below this part of the size of its row, a pair of pivots below its square, a pivot takes too many digits away, from multipliers
# those of its square: the intrinsic takes over.
SMALLEST_PIVOT = Fraction(1, 10)
# Pivots at the sample state are at least this part of the largest that there is.
ADMITTED = 0.2
# So few independent speeds are no reason to wait for their accelerations.
FEW = 1


class NullSpaceSolver:
    """As statements.

    pivots   (row, column) of C in the order of elimination; names: of the rows
    least    squares of what the rows are compared with where they are small as a whole, (m,); default 0
    columns  factors by which columns in other units compare, (n,); default 1
    massless_pivots   first speed of a motion without kinetic energy at some positions -> the other speeds of this motion
    """

    def __init__(self, algebra: Any, M: np.ndarray, C: np.ndarray, pivots: Sequence[tuple[int, int]], names: Sequence[str],
                 speeds: Sequence[Any], least: Sequence[Any] = (), columns: Sequence[Any] = (),
                 massless_pivots: Mapping[int, Collection[int]] | None = None) -> None:
        self.algebra, self.M, self.C = algebra, M, C
        self.least = least or [0] * len(C)
        self.columns = vector(*(columns or [1] * C.shape[1]))
        self.rows, self.d = [r for r, _ in pivots], [c for _, c in pivots]
        self.i = [k for k in range(C.shape[1]) if k not in self.d]
        with algebra.section("dependent speeds: C_r u_dot = F_d solved for them"):
            self._factorize(names)
            columns = [self._solve(-C[self.rows, k]) for k in self.i]
            self.Z = zeros(C.shape[1], len(self.i))
            for index, k in enumerate(self.i):
                self.Z[k, index] = 1
                self.Z[self.d, index] = algebra.name(f"Z_{k + 1}", columns[index])
        with algebra.section("mass matrix of the independent speeds"):
            self.MZ = M @ self.Z if self.i else zeros(len(M), 0)
            reduced = congruence(M, self.Z)
            algebra.name("Mi", reduced)
            reasons = [f"the mass matrix under the constraints is not positive definite at {speeds[k]}" for k in self.i]
            sizes = self._sizes(reduced, massless_pivots or {})
            self.factors = factorize(algebra, reduced, reasons, "i", dict.fromkeys(sizes, algebra.rounding), sizes)

    def _sizes(self, reduced: np.ndarray, massless_pivots: Mapping[int, Collection[int]]) -> dict[int, Any]:
        """Reference sizes of pivots of the reduced mass matrix: those of the first independent speed of a motion that may
        have no kinetic energy. Where other speeds of it are dependent, the entry that the pivot comes from may vanish itself."""
        sizes: dict[int, Any] = {}
        for first, others in massless_pivots.items():
            dependent = any(k in self.d for k in (first, *others))
            for k in (first,) if first in self.i else others:
                if k in self.i:
                    index = self.i.index(k)
                    sizes[index] = reduced[index, index] + (self.M[k, k] if dependent else 0)
        return sizes

    def solve(self, f: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        g = zeros(len(f))
        if not all(is_zero(e) for e in d):
            g[self.d] = self._solve(d[self.rows])
        left = f - self.M @ g
        v = self.factors.solve(vector(*[inner(self.Z[:, k], left) for k in range(len(self.i))]))
        x = g + (self.Z @ v if len(v) else zeros(len(f)))
        lam = zeros(len(d))
        lam[self.rows] = self._multipliers(left, v)
        return x, lam

    def _multipliers(self, left: np.ndarray, v: np.ndarray) -> np.ndarray:
        """lam of C_d^T lam = (f - M x)_d, f - M x = left - M Z v; of few v column by column, so that little waits for them."""
        if len(v) > FEW:
            return self._solve_transposed(left[self.d] - self.MZ[self.d] @ v)
        lam = self._solve_transposed(left[self.d])
        for k, speed_rate in enumerate(v):
            lam = lam - self._solve_transposed(self.MZ[self.d, k]) * speed_rate
        return lam

    # -- C_d = L U by blocks of one or two rows, in the order of the pivots; U with ones on its diagonal blocks

    def _factorize(self, names: Sequence[str]) -> None:
        A = self.C[np.ix_(self.rows, self.d)].copy()
        n = len(A)
        self.blocks = _blocks(A)
        self.inverse: list[np.ndarray] = []
        for b in self.blocks:
            k, after = list(b), list(range(b.stop, n))
            rows = [self.rows[p] for p in b]
            scaled = [self.C[row] * self.columns for row in rows]
            sizes = [inner(row, row) + self.least[index] for row, index in zip(scaled, rows, strict=True)]
            label = " and ".join(names[self.rows[p]] for p in b)
            self.inverse.append(self._inverse(A[np.ix_(k, k)], sizes, label, b.start))
            if after:
                A[np.ix_(k, after)] = self.inverse[-1] @ A[np.ix_(k, after)]
                A[np.ix_(after, after)] = A[np.ix_(after, after)] - A[np.ix_(after, k)] @ A[np.ix_(k, after)]
        self.LU = A

    def _inverse(self, A: np.ndarray, sizes: Sequence[Any], label: str, index: int) -> np.ndarray:
        """Inverse of one entry or of 2 x 2, by one division; sizes: squares of the rows that they come from, scaled."""
        a = self.algebra
        determinant = A[0, 0] if len(A) == 1 else A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0]
        if isinstance(determinant, Node):
            least: Any = SMALLEST_PIVOT ** (2 * len(A))
            for size in sizes:
                least = least * size
            scaled = determinant
            for column in self.d[index:index + len(A)]:
                scaled = scaled * self.columns[column]
            reason = f"the dependent speeds do not follow from {label} here"
            determinant = a.recorder.guard(determinant, scaled * scaled - least, reason)
        over = a.name(f"iC{index + 1}", a.recorder.div(1, determinant))
        if len(A) == 1:
            return np.array([[over]], dtype=object)
        return np.array([[A[1, 1] * over, -A[0, 1] * over], [-A[1, 0] * over, A[0, 0] * over]], dtype=object)

    def _solve(self, right: np.ndarray) -> np.ndarray:
        """y with C_d y = right, (m,)."""
        y = np.array(right, dtype=object)
        for b, inverse in zip(self.blocks, self.inverse, strict=True):
            k = slice(b.start, b.stop)
            y[k] = inverse @ y[k]
            if b.stop < len(y):
                y[b.stop:] = y[b.stop:] - self.LU[b.stop:, k] @ y[k]
        for b in reversed(self.blocks):
            if b.start:
                y[:b.start] = y[:b.start] - self.LU[:b.start, b.start:b.stop] @ y[b.start:b.stop]
        return y

    def _solve_transposed(self, right: np.ndarray) -> np.ndarray:
        """y with C_d^T y = right, (m,)."""
        y = np.array(right, dtype=object)
        for b in self.blocks:
            if b.start:
                y[b.start:b.stop] = y[b.start:b.stop] - self.LU[:b.start, b.start:b.stop].T @ y[:b.start]
        for b, inverse in zip(reversed(self.blocks), reversed(self.inverse), strict=True):
            if b.stop < len(y):
                y[b.start:b.stop] = y[b.start:b.stop] - self.LU[b.stop:, b.start:b.stop].T @ y[b.stop:]
            y[b.start:b.stop] = inverse.T @ y[b.start:b.stop]
        return y


def _blocks(A: np.ndarray) -> list[range]:
    """Pairs of pivots whose rows and columns meet in all four entries: two pivots for one division. Others stand alone."""
    blocks: list[range] = []
    k = 0
    while k < len(A):
        paired = k + 1 < len(A) and not any(is_zero(e) for e in (A[k, k + 1], A[k + 1, k]))
        blocks.append(range(k, k + 2 if paired else k + 1))
        k = blocks[-1].stop
    return blocks


def elimination_order(sample: np.ndarray, structure: np.ndarray) -> list[tuple[int, int]] | None:
    """Pivots (row, column) for a C of full rank, large at the sample and with little fill-in (Markowitz); None if there are none.

    sample (m, n): C at a state, scaled; structure (m, n): where C is not zero by structure
    """
    A, left = sample.astype(float).copy(), structure.copy()  # left: of waiting rows and free columns
    waiting = np.ones(len(A), dtype=bool)
    largest = np.where(left, np.abs(A), 0.0).max(axis=1, initial=0.0)
    in_rows, in_columns = left.sum(axis=1), left.sum(axis=0)
    pivots: list[tuple[int, int]] = []
    for _ in range(len(A)):
        rows, columns = np.divmod(np.flatnonzero(left), A.shape[1])
        size = np.abs(A[rows, columns])
        admitted = np.flatnonzero((size >= ADMITTED * largest[rows]) & (largest[rows] > 1e-9))
        if not len(admitted):
            return None
        fill = (in_rows[rows[admitted]] - 1) * (in_columns[columns[admitted]] - 1)
        least = admitted[fill == fill.min()]
        index = least[np.argmax(size[least])]
        i, j = int(rows[index]), int(columns[index])
        pivots.append((i, j))
        waiting[i] = False
        row, below = np.flatnonzero(left[i]), np.flatnonzero(waiting & left[:, j])
        left[i] = left[:, j] = False
        row = row[row != j]
        others = np.ix_(below, row)
        A[others] -= np.outer(A[below, j] / A[i, j], A[i, row])
        in_columns[row] += (~left[others]).sum(axis=0) - 1
        in_rows[below] += (~left[others]).sum(axis=1) - 1
        left[others] = True
        largest[below] = np.where(left[below], np.abs(A[below]), 0.0).max(axis=1, initial=0.0)
    return pivots


def least_operations(structure: np.ndarray, mass: np.ndarray, pivots: Sequence[tuple[int, int]]) -> int:
    """No more operations than elimination with these pivots takes: those of Z^T M Z, without what ones in Z save, and of its
    factors.

    structure (m, n), mass (n, n): where C and M are not zero by structure
    """
    rows, dependent = [r for r, _ in pivots], [c for _, c in pivots]
    free = [k for k in range(structure.shape[1]) if k not in set(dependent)]
    left, right = structure[np.ix_(rows, dependent)].copy(), structure[np.ix_(rows, free)].copy()
    for k in range(len(rows)):
        below = k + 1 + np.flatnonzero(left[k + 1:, k])
        left[below] |= left[k]
        right[below] |= right[k]
    for k in range(len(rows) - 1, -1, -1):
        right[np.flatnonzero(left[:k, k])] |= right[k]
    Z = np.zeros((structure.shape[1], len(free)), dtype=np.float32)
    Z[free, range(len(free))] = 1
    Z[dependent] = right
    MZ = (mass.astype(np.float32) @ Z > 0).astype(np.float32)
    near = Z.T @ MZ > 0
    products = np.tril(Z[dependent].T @ MZ[dependent])
    operations = int(np.maximum(2 * products - 1, 0).sum())
    for k in range(len(free) - 1, -1, -1):  # as the factors are made, from the last to the first
        others = np.flatnonzero(near[k, :k])
        near[np.ix_(others, others)] = True
        operations += len(others) * (len(others) + 1) // 2
    return operations
