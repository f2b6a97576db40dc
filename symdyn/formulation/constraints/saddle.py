"""Solving M x + C^T lam = f, C x = d, with M symmetric and C of few rows.

Source: Benzi, Golub and Liesen, Numerical solution of saddle point problems, Acta Numerica 14 (2005), sections 5 and 6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Protocol

import numpy as np

from symdyn.errors import ModelError
from symdyn.formulation.constraints.sampled import minimum_degree
from symdyn.formulation.trees.mass_matrix import Factors, factorize
from symdyn.spatial.vectors import inner, vector, zeros
from symdyn.tape.intrinsics import SMOOTHED, Multipliers, Saddle
from symdyn.tape.node import PARAMETER, Node, is_zero
from symdyn.tape.recorder import Recorder

# A pivot of the Schur complement below this part of its diagonal entry leaves too few digits: a constraint nearly depends
# on the others, and the intrinsic takes over. The digits lost are those of this number.
SMALLEST_PIVOT = 1e-6
# Bytes on the stack that a numeric algorithm may take; threads have 8 MB on most machines.
MOST_ON_STACK = 6_000_000
# Speeds from which on the numeric algorithm takes them in an order of its own.
ORDERED_FROM = 30


def no_room(n_u: int, n_c: int) -> str:
    """Why numeric algorithms for so many speeds and constraints cannot be had, in words; "" where they can."""
    room = 8 * (3 * n_u * n_u + n_u * (n_u + 1) // 2 + 2 * n_c * n_u + n_c * n_c)  # with their arguments
    return "" if room <= MOST_ON_STACK else (
        f"the numeric algorithm for {n_u} speeds and {n_c} constraints would take {room / 1e6:.1f} MB of the stack, of "
        f"{MOST_ON_STACK / 1e6:.1f} MB that it may take")


class SaddleSolver(Protocol):
    """Gives x (n,) and lam (m,) for f (n,) and d (m,)."""

    def solve(self, f: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]: ...


class RangeSolver:
    """By the Schur complement S = C M^-1 C^T, with M = L^T D L factorized already.

    names   of the rows
    least   squares of the rows below which they are no constraint any more, (m,); default: none
    """

    def __init__(self, algebra: Any, factors: Factors, C: np.ndarray, names: Sequence[str], least: Sequence[Any] = ()) -> None:
        self.factors, self.C = factors, C
        n = len(factors.inverse_D)
        with algebra.section("Schur complement C_r M^-1 C_r^T"):
            self.Y = np.array([factors.inwards(row) for row in C], dtype=object).reshape(-1, n).T
            self.Z = np.array([[0 if is_zero(e) else e * d for e in row]
                               for row, d in zip(self.Y, factors.inverse_D, strict=True)], dtype=object).reshape(self.Y.shape)
            S = _square(self.Y, self.Z)
            algebra.name("S", S)
            order = fewest_neighbours(S)
            self.order = order
            reasons = [f"constraint {names[k]} depends on the others here" for k in order]
            for k, bound in enumerate(least):
                if isinstance(S[k, k], Node) and any(isinstance(e, Node) and e.mask & ~PARAMETER for e in C[k]):
                    margin = inner(C[k], C[k]) - bound
                    S[k, k] = algebra.recorder.guard(S[k, k], margin, f"constraint {names[k]} holds nothing here")
            self.S = factorize(algebra, S[np.ix_(order, order)], reasons, "S", dict.fromkeys(range(len(C)), SMALLEST_PIVOT))

    def solve(self, f: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        inwards = self.factors.inwards(f)
        right = vector(*[inner(self.Z[:, k], inwards) - d[k] for k in range(len(d))])
        result = self.S.solve(right[self.order])
        lam = zeros(len(d))
        lam[self.order] = result
        return self.factors.outwards(inwards - (self.Y @ lam if len(lam) else zeros(len(f)))), lam


def _square(Y: np.ndarray, Z: np.ndarray) -> np.ndarray:
    """Y^T Z, (m, m), which is symmetric, of matrices (n, m) with zeros in the same places, by columns that meet in some row."""
    m = Y.shape[1]
    S = zeros(m, m)
    for k, row in enumerate(Y):
        there = [j for j, e in enumerate(row) if not is_zero(e)]
        for index, i in enumerate(there):
            for j in there[:index + 1]:
                S[i, j] = S[i, j] + Y[k, i] * Z[k, j]
    for i in range(m):
        S[:i, i] = S[i, :i]
    return S


class IntrinsicSolver:
    """By numeric algorithms that take a singular M and dependent rows; lam is the solution of least norm after scaling.

    rows, columns   scales (m,) and (n,) of C that make its entries lengths by lengths
    smoothed        see Saddle
    """

    def __init__(self, algebra: Any, M: np.ndarray, C: np.ndarray, rows: np.ndarray, columns: Sequence[Any], reason: str,
                 smoothed: float = SMOOTHED) -> None:
        self.recorder, self.M, self.C, self.smoothed = algebra.recorder, M, C, smoothed
        self.rows, self.columns, self.reason = rows, columns, reason

        self.order = narrow_order(M, C)

    def solve(self, f: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        order = self.order
        M, columns = self.M[np.ix_(order, order)], [self.columns[k] for k in order]
        triangle = [M[i, j] for i in range(len(M)) for j in range(i + 1)]
        m, n = self.C.shape
        x = zeros(n)
        x[order] = vector(*self.recorder.call(Saddle((n, m), self.reason), [
            Fraction(repr(self.smoothed)), *triangle, *self.C[:, order].ravel(), *self.rows, *columns, *f[order], *d]))
        return x, least_multipliers(self.recorder, self.C, self.rows, self.columns, f - self.M @ x, self.reason)


def least_multipliers(recorder: Recorder, C: np.ndarray, rows: np.ndarray, columns: Sequence[Any], right: np.ndarray,
                      reason: str) -> np.ndarray:
    """lam (m,) of C^T lam = right, of least norm after scaling; scales as for IntrinsicSolver. Raises ModelError for too many."""
    too_large = no_room(C.shape[1], len(C))
    if too_large:
        raise ModelError([f"multipliers of least norm are requested, since constraints depend on others, and {too_large}; leave "
                          "out constraints that follow from others"])
    intrinsic = Multipliers((C.shape[1], len(C)), reason)
    return vector(*recorder.call(intrinsic, [*C.ravel(), *rows, *columns, *right]))


@dataclass(frozen=True)
class SubsetSolver:
    """With some of the rows only, which imply the others; the multipliers of these are 0.

    kept   indices of the rows among all n
    """

    solver: SaddleSolver
    kept: list[int]
    n: int

    def solve(self, f: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x, result = self.solver.solve(f, d[self.kept])
        lam = zeros(self.n)
        lam[self.kept] = result
        return x, lam


def narrow_order(M: np.ndarray, C: np.ndarray) -> list[int]:
    """An order of the speeds in which rows of M + C^T C begin near their diagonal, so that factors have few entries.

    Few speeds stay as they are. Source: Cuthill and McKee, Reducing the bandwidth of sparse symmetric matrices, 1969, reversed.
    """
    if len(M) < ORDERED_FROM:
        return list(range(len(M)))
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    near = np.array([[not is_zero(e) for e in row] for row in M])
    for row in C:
        indices = [k for k, e in enumerate(row) if not is_zero(e)]
        near[np.ix_(indices, indices)] = True
    order = reverse_cuthill_mckee(csr_matrix(near), symmetric_mode=True)
    return [int(k) for k in order]


def fewest_neighbours(S: np.ndarray) -> list[int]:
    """An order of the rows of a symmetric matrix in which eliminating from the last row to the first fills in little."""
    near = [{j for j in range(len(S)) if j != i and not is_zero(S[i, j])} for i in range(len(S))]
    return minimum_degree(near)[::-1]
