"""Solving M x + C^T lam = f, C x = d by eliminating dependent speeds: only M in the directions that C leaves must be regular.

x = Z v + g with C Z = 0 and C g = d: Z^T M Z v = Z^T (f - M g), C_d^T lam = (f - M x)_d, where C_d are the columns of C of the
dependent speeds, factorized as they are, in an order that is good at a sample state.
Source: Benzi, Golub and Liesen, Numerical solution of saddle point problems, Acta Numerica 14 (2005), section 6.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from symdyn.formulation.constraints.sampled import Sampled
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


def elimination_order(A: Sampled) -> list[tuple[int, int]] | None:
    """Pivots (row, column) for a C of full rank, large at the sample and with little fill-in (Markowitz); None if there are none.

    A   (1, m, n): C at a state, scaled, with the entries that are not zero by structure
    """
    starts = np.searchsorted(A.rows, np.arange(1, A.m))
    columns, values = np.split(A.columns, starts), np.split(A.values[0], starts)  # of waiting rows, and of free columns
    in_columns = np.bincount(A.columns, minlength=A.n)
    waiting = list(range(A.m))
    pivots: list[tuple[int, int]] = []
    while waiting:
        counts = np.array([len(columns[i]) for i in waiting])
        at, size = np.concatenate([columns[i] for i in waiting]), np.abs(np.concatenate([values[i] for i in waiting]))
        rows = np.repeat(np.arange(len(waiting)), counts)
        largest = np.zeros(len(waiting))
        np.maximum.at(largest, rows, size)
        admitted = np.flatnonzero((size >= ADMITTED * largest[rows]) & (largest[rows] > 1e-9))
        if not len(admitted):
            return None
        fill = (counts[rows[admitted]] - 1) * (in_columns[at[admitted]] - 1)
        least = admitted[fill == fill.min()]
        index = least[np.argmax(size[least])]
        i, j = waiting[rows[index]], int(at[index])
        touched = [waiting[k] for k in rows[at == j] if waiting[k] != i]
        waiting.remove(i)
        pivots.append((i, j))
        kept = columns[i] != j
        pivot, row, others = values[i][~kept][0], columns[i][kept], values[i][kept]
        in_columns[columns[i]] -= 1
        for below in touched:
            there = columns[below] != j
            factor = values[below][~there][0] / pivot
            merged = np.union1d(columns[below][there], row)
            changed = np.zeros(len(merged))
            changed[np.searchsorted(merged, columns[below][there])] = values[below][there]
            changed[np.searchsorted(merged, row)] -= factor * others
            in_columns[columns[below]] -= 1
            in_columns[merged] += 1
            columns[below], values[below] = merged, changed
    return pivots


def _bits(bits: int) -> Iterator[int]:
    """Members of a set."""
    while bits:
        yield (bits & -bits).bit_length() - 1
        bits &= bits - 1


def _turned(rows: Sequence[int], n: int) -> list[int]:
    """Columns of a matrix as sets of rows, from its rows as sets of n columns."""
    columns = [0] * n
    for k, row in enumerate(rows):
        for column in _bits(row):
            columns[column] |= 1 << k
    return columns


def least_operations(structure: Sampled, mass: Sampled, pivots: Sequence[tuple[int, int]]) -> int:
    """No more operations than elimination with these pivots takes: those of Z^T M Z, without what ones in Z save, and of its
    factors.

    structure (m, n), mass (n, n): C and M with the entries that are not zero by structure. Rows are sets of columns, as bits.
    """
    dependent = {column: k for k, (_, column) in enumerate(pivots)}
    number = {row: k for k, (row, _) in enumerate(pivots)}
    free = {column: k for k, column in enumerate(k for k in range(structure.n) if k not in dependent)}
    left, right = [0] * len(pivots), [0] * len(pivots)
    for i, j in zip(structure.rows.tolist(), structure.columns.tolist(), strict=True):
        if j in dependent:
            left[number[i]] |= 1 << dependent[j]
        else:
            right[number[i]] |= 1 << free[j]
    for k in range(len(left)):
        for below in range(k + 1, len(left)):
            if left[below] >> k & 1:
                left[below] |= left[k]
                right[below] |= right[k]
    for k in range(len(left) - 1, -1, -1):
        for above in range(k):
            if left[above] >> k & 1:
                right[above] |= right[k]
    Z = [right[dependent[k]] if k in dependent else 1 << free[k] for k in range(structure.n)]
    MZ = [0] * structure.n
    for i, j in zip(mass.rows.tolist(), mass.columns.tolist(), strict=True):
        MZ[i] |= Z[j]
    by_Z, by_MZ = _turned(right, len(free)), _turned([MZ[column] for _, column in pivots], len(free))
    near, operations = [0] * len(free), 0
    for k, row in enumerate(Z):
        for a in _bits(row):
            near[a] |= MZ[k]
    for a, ones in enumerate(by_Z):
        for b in range(a + 1):
            operations += max(2 * (ones & by_MZ[b]).bit_count() - 1, 0)
    for k in range(len(free) - 1, -1, -1):  # as the factors are made, from the last to the first
        others = near[k] & ((1 << k) - 1)
        for a in _bits(others):
            near[a] |= others
        operations += others.bit_count() * (others.bit_count() + 1) // 2
    return operations
