"""A nonlinear program of blocks: a cost under bounds of variables and of functions, with exact sparse derivatives.

    f(z) = sum of b_k^T F_k(y_k),    g(z) = L z + sum of A_k F_k(y_k),    y_k = constants + scale * z[columns]

Each F_k is evaluated at all its points in one call. A_k, b_k and L are constant, so that the derivatives of f and g are those of
F_k at known indices. Jacobian: by columns (CSC); Hessian of the Lagrangian: its upper triangle, by columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from symdyn.optimal.field import Rows

# Units are powers of two to this power.
PREFIX = 10.0


@dataclass(frozen=True, eq=False)
class Block:
    """F_k at N points: columns (N, n) of z that its arguments are, -1 for constants; constants and scale (N, n); A (m_g, N m),
    b (N m,)."""

    rows: Rows
    columns: np.ndarray
    constants: np.ndarray
    scale: np.ndarray
    A: sp.csr_matrix
    b: np.ndarray

    def at(self, z: np.ndarray) -> np.ndarray:
        """The arguments (N, n)."""
        there = self.columns >= 0
        result = self.constants.copy()
        result[there] += self.scale[there] * z[self.columns[there]]
        return result


@dataclass(frozen=True)
class Label:
    """Labels of rows of g: text and entry, with the time of each as a share of the duration (NaN: of no time), from row `first`
    on; soft: whether the user requested it."""

    text: str
    first: int
    shares: np.ndarray
    entries: tuple[str, ...] = ("",)
    soft: bool = False

    @property
    def n(self) -> int:
        return len(self.shares) * len(self.entries)


@dataclass(eq=False)
class Program:
    """See above. z_least, z_most, g_least, g_most: bounds; labels: of the rows of g, in order."""

    blocks: Sequence[Block]
    L: sp.csr_matrix
    z_least: np.ndarray
    z_most: np.ndarray
    g_least: np.ndarray
    g_most: np.ndarray
    labels: Sequence[Label]
    evaluations: dict[str, int] = field(default_factory=lambda: {"values": 0, "jacobian": 0, "hessian": 0})

    def __post_init__(self) -> None:
        self.n, self.m = len(self.z_least), len(self.g_least)
        self._seen: dict[str, tuple[bytes, list[np.ndarray]]] = {}
        self._jacobian_pattern()
        self._hessian_pattern()

    # -- values

    def f(self, z: np.ndarray) -> float:
        """The cost."""
        result = 0.0
        for block, F in zip(self.blocks, self._all("values", z), strict=True):
            there = np.flatnonzero(block.b)
            result += float(block.b[there] @ F.ravel()[there])
        return result

    def g(self, z: np.ndarray) -> np.ndarray:
        """The constraints (m,)."""
        result: np.ndarray = self.L @ z
        for block, F in zip(self.blocks, self._all("values", z), strict=True):
            if block.A.nnz:
                result = result + block.A @ F.ravel()
        return result

    def gradient(self, z: np.ndarray) -> np.ndarray:
        """Gradient of the cost (n,)."""
        result = np.zeros(self.n)
        for (at, columns, factors), J in zip(self._of_cost, self._all("jacobian", z), strict=True):
            if len(at):
                result += np.bincount(columns, factors * J.ravel()[at], self.n)
        return result

    def jacobian(self, z: np.ndarray) -> np.ndarray:
        """Jacobian of the constraints, the entries of the pattern (rows, colptr)."""
        parts = [self._constant]
        for (at, factors), J in zip(self._of_constraints, self._all("jacobian", z), strict=True):
            parts.append(factors * J.ravel()[at])
        return np.bincount(self._jacobian_index, np.concatenate(parts), self.jacobian_nonzeros)

    def hessian(self, z: np.ndarray, cost: float, multipliers: np.ndarray) -> np.ndarray:
        """Hessian of the cost f + multipliers^T g, the entries of the upper triangle's pattern."""
        self.evaluations["hessian"] += 1
        parts = []
        for block, (at, factors) in zip(self.blocks, self._of_hessian, strict=True):
            weights = block.A.T @ multipliers + cost * block.b
            if len(at):
                H = block.rows.hessian(block.at(z), weights.reshape(len(block.columns), -1))
                parts.append(factors * H.ravel()[at])
        return np.bincount(self._hessian_index, np.concatenate(parts) if parts else np.zeros(0), self.hessian_nonzeros)

    def _all(self, what: str, z: np.ndarray) -> list[np.ndarray]:
        """Values or derivatives of all blocks; the last ones are kept: f and g are evaluated at the same z."""
        key = z.tobytes()
        seen = self._seen.get(what)
        if seen is None or seen[0] != key:
            self.evaluations[what] += 1
            seen = self._seen[what] = key, [getattr(block.rows, what)(block.at(z)) for block in self.blocks]
        return seen[1]

    # -- patterns

    def _jacobian_pattern(self) -> None:
        L = self.L.tocoo()
        self._constant = L.data.copy()
        rows, columns = [L.row.astype(np.int64)], [L.col.astype(np.int64)]
        self._of_constraints, self._of_cost = [], []
        for block in self.blocks:
            m, n = block.rows.slopes.shape
            of, by = np.nonzero(block.rows.slopes)
            first = np.searchsorted(of, np.arange(m + 1))
            A = block.A.tocoo()
            at, row, factor = _expanded(A.row, A.col, A.data, m, n, by, first)
            self._of_constraints.append(self._kept(block, at, row, factor, rows, columns, m, n))
            present = np.flatnonzero(block.b)
            at, row, factor = _expanded(np.zeros(len(present), dtype=int), present, block.b[present], m, n, by, first)
            to: list[np.ndarray] = []
            kept, factors = self._kept(block, at, row, factor, [], to, m, n)
            self._of_cost.append((kept, to[0], factors))
        key = np.concatenate(columns) * max(self.m, 1) + np.concatenate(rows)
        unique, self._jacobian_index = np.unique(key, return_inverse=True)
        self.jacobian_rows, self.jacobian_columns = unique % max(self.m, 1), unique // max(self.m, 1)
        self.jacobian_nonzeros = len(unique)

    @staticmethod
    def _kept(block: Block, at: np.ndarray, row: np.ndarray, factor: np.ndarray, rows: list[np.ndarray],
              columns: list[np.ndarray], m: int, n: int) -> tuple[np.ndarray, np.ndarray]:
        """Those entries whose arguments are variables: indices in the derivatives, and factors."""
        point, by = at // (m * n), at % n
        column = block.columns[point, by]
        there = column >= 0
        rows.append(row[there])
        columns.append(column[there])
        return at[there], factor[there] * block.scale[point[there], by[there]]

    def _hessian_pattern(self) -> None:
        rows, columns = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
        self._of_hessian = []
        for block in self.blocks:
            N, n = block.columns.shape
            a, b = np.nonzero(block.rows.curvature)
            point = np.repeat(np.arange(N), len(a))
            a, b = np.tile(a, N), np.tile(b, N)
            row, column = block.columns[point, a], block.columns[point, b]
            there = (row >= 0) & (column >= 0) & (row <= column)
            point, a, b = point[there], a[there], b[there]
            self._of_hessian.append(((point * n + a) * n + b, block.scale[point, a] * block.scale[point, b]))
            rows.append(row[there])
            columns.append(column[there])
        key = np.concatenate(columns) * self.n + np.concatenate(rows)
        unique, self._hessian_index = np.unique(key, return_inverse=True)
        self.hessian_rows, self.hessian_columns = unique % self.n, unique // self.n
        self.hessian_nonzeros = len(unique)

    # -- what is violated

    def violations(self, z: np.ndarray) -> np.ndarray:
        """By how much each row of g is beyond its bounds, (m,); NaN where it cannot be evaluated."""
        g = self.g(z)
        return np.where(np.isfinite(g), np.maximum(np.maximum(self.g_least - g, g - self.g_most), 0.0), np.nan)

    def what(self, row: int) -> tuple[str, float]:
        """The text of a row of g, and when it is, as a share of the duration (NaN: at no time)."""
        for label in self.labels:
            if label.first <= row < label.first + label.n:
                k, entry = divmod(row - label.first, len(label.entries))
                return f"{label.text}{label.entries[entry]}", float(label.shares[k])
        raise IndexError(row)


def unit(sizes: np.ndarray) -> np.ndarray:
    """The next powers of 1024: units, like milli and kilo, in which sizes are near 1, and by which numbers are scaled without
    rounding. A number of the size 1/32 to 32 stays as it is."""
    return np.asarray(np.exp2(PREFIX * np.round(np.log2(sizes) / PREFIX)))


class Scaled:
    """A program in units in which its variables, constraints and cost are of the size 1: what solvers are given.

    z_sizes (n,), g_sizes (m,), cost_size   their units, see `unit`
    """

    def __init__(self, program: Program, z_sizes: np.ndarray, g_sizes: np.ndarray, cost_size: float) -> None:
        self.program, self.z_sizes, self.g_sizes, self.cost_size = program, z_sizes, g_sizes, cost_size
        self.n, self.m = program.n, program.m
        self.z_least, self.z_most = program.z_least / z_sizes, program.z_most / z_sizes
        self.g_least, self.g_most = program.g_least / g_sizes, program.g_most / g_sizes
        self.jacobian_rows, self.jacobian_columns = program.jacobian_rows, program.jacobian_columns
        self.hessian_rows, self.hessian_columns = program.hessian_rows, program.hessian_columns
        self._of_jacobian = z_sizes[self.jacobian_columns] / g_sizes[self.jacobian_rows]
        self._of_hessian = z_sizes[self.hessian_rows] * z_sizes[self.hessian_columns]

    def f(self, y: np.ndarray) -> float:
        """The cost."""
        return self.program.f(y * self.z_sizes) / self.cost_size

    def g(self, y: np.ndarray) -> np.ndarray:
        """The constraints (m,)."""
        return self.program.g(y * self.z_sizes) / self.g_sizes

    def gradient(self, y: np.ndarray) -> np.ndarray:
        """Gradient of the cost (n,)."""
        return self.program.gradient(y * self.z_sizes) * self.z_sizes / self.cost_size

    def jacobian(self, y: np.ndarray) -> np.ndarray:
        """Jacobian of the constraints, the entries of the pattern."""
        return self.program.jacobian(y * self.z_sizes) * self._of_jacobian

    def hessian(self, y: np.ndarray, cost: float, multipliers: np.ndarray) -> np.ndarray:
        """Hessian of the cost f + multipliers^T g, the entries of the upper triangle's pattern."""
        return self.program.hessian(y * self.z_sizes, cost / self.cost_size, multipliers / self.g_sizes) * self._of_hessian

    def violations(self, y: np.ndarray) -> np.ndarray:
        """By how much each row of g is beyond its bounds, (m,); NaN where it cannot be evaluated."""
        return self.program.violations(y * self.z_sizes) / self.g_sizes


def _expanded(rows: np.ndarray, indices: np.ndarray, data: np.ndarray, m: int, n: int, by: np.ndarray,
              first: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Entries of a map of values, one for each derivative of the value: indices in the derivatives (N, m, n), rows, factors."""
    of = indices % m
    count = first[of + 1] - first[of]
    each = np.repeat(np.arange(len(indices)), count)
    within = np.arange(len(each)) - np.repeat(np.cumsum(count) - count, count)
    column = by[first[of[each]] + within]
    return indices[each] * n + column, rows[each].astype(np.int64), data[each]
