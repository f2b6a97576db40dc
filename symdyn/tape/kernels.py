"""Numeric algorithms that a tape calls where statements would not do: so many numbers in, so many out.

Generated code calls them by name; each backend has its own text of them (templates/BACKEND/NAME.*.jinja).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

# Singular values of the scaled constraints below this count less and less, in accelerations and in multipliers ...
SMOOTHED = 1e-5
# ... and in corrections, which would else be as large as a tiny error divided by a tiny singular value.
DAMPED = 1e-3
ROUNDS = 5
CLEANINGS = 2
# A mass below this part of the largest is none.
MASSLESS = 1e-12
# A pivot of the saddle's matrix that is no more than this part of its diagonal entry is none: nothing holds some direction. The
# pivot that is the largest part of its entry goes first, so that rounding leaves less than 1e-15 of an entry. Numbers that are
# folded and the generated code take the same test.
LOOSE = 1e-14


@dataclass(frozen=True)
class Kernel:
    """Of one size. Subclasses say what is computed.

    name     in generated code; sizes: what it is called with
    reason   what it means if it fails
    letters  what its results are called in print; none where there is no function to read
    """

    sizes: tuple[int, ...]
    reason: str

    name = ""

    @property
    def letters(self) -> tuple[str, ...]:
        return ()

    @property
    def n_out(self) -> int:
        raise NotImplementedError

    @property
    def operations(self) -> int:
        """About how many operations it takes."""
        raise NotImplementedError

    def rows(self, values: Sequence[Any]) -> np.ndarray:
        """Results, states first, for numbers or arrays of them; NaN where generated code stops with `reason`."""
        raise NotImplementedError

    def precise(self, context: Any, values: Sequence[Any]) -> list[Any]:
        """Results for numbers of an mpmath context."""
        raise NotImplementedError

    def tangents(self, recorder: Any, values: Sequence[Any], results: Sequence[Any], changes: Sequence[Any]) -> list[Any]:
        """Derivatives of the results for derivatives of the values, recorded."""
        raise NotImplementedError

    def by_others(self, k: int) -> tuple[int, list[tuple[int, int]]] | None:
        """How result k follows from others: divisor d and pairs (i, j) with results[k] values[d] = -sum(values[i] results[j]);
        None where it does not. By repeated use all results are reached that do not follow."""
        return None


@dataclass(frozen=True)
class Saddle(Kernel):
    """x of M x + C^T lam = f, C x = d, for sizes (n, m): M symmetric, perhaps singular, the rows of C perhaps dependent.

    Values: e, M lower triangle row by row, C row by row, scales of the rows (m) and columns (n) of C, f, d.
    Columns are scaled on until all masses M_kk are equal, rows back by the largest of their columns' factors. The augmented
    Lagrangian, iterated: (M + a C^T C) x = f - C^T lam + a C^T d, lam += a (C x - d) with a = M_kk / e^2; each round takes the
    residual again, so that rounding of the large matrix does not stay. A combination of rows with a singular value below e
    holds less and less: x depends smoothly on the values.
    Source: Bayo, Garcia de Jalon and Serna, A modified Lagrangian formulation for the dynamic analysis of constrained
    mechanical systems, Comput. Methods Appl. Mech. Eng. 71 (1988).
    """

    name = "symdyn_saddle"

    @property
    def n_out(self) -> int:
        return self.sizes[0]

    @property
    def operations(self) -> int:
        n, m = self.sizes
        return n * (n + 1) * m + n**3 // 3 + 2 * n**3 // 3 + ROUNDS * (4 * n * n + 4 * m * n) + 2 * n

    def split(self, values: Sequence[Any]) -> tuple[Any, ...]:
        """M (n, n), C (m, n), scales of rows and columns, f, d as arrays of objects."""
        n, m = self.sizes
        triangle = n * (n + 1) // 2
        array = _objects(values[1:])
        M = np.empty((n, n), dtype=object)
        M[np.tril_indices(n)] = array[:triangle]
        M.T[np.tril_indices(n)] = array[:triangle]
        C, s, w, f, d = np.split(array[triangle:], np.cumsum([m * n, m, n, n]))
        return M, C.reshape(m, n), s, w, f, d

    def rows(self, values: Sequence[Any]) -> np.ndarray:
        shape = np.broadcast_shapes(*[np.shape(v) for v in values])
        M, C, s, w, f, d = _stacked(self.split(values), shape)
        masses = w**2 * np.diagonal(M, axis1=-2, axis2=-1)
        largest = np.max(masses, axis=-1)[..., None]
        largest = np.where(largest > 0, largest, 1.0)
        lighter = np.sqrt(largest / np.where(masses > MASSLESS * largest, masses, largest))
        w = w * lighter
        s = s / np.max(np.where(C != 0, lighter[..., None, :], 1.0), axis=-1, initial=1.0)
        M = w[..., :, None] * M * w[..., None, :]
        C = s[..., :, None] * C * w[..., None, :]
        f, d, Ct = w * f, s * d, np.swapaxes(C, -1, -2)
        stiff = largest / _stacked([_objects(values[:1])], shape)[0] ** 2
        A = M + stiff[..., None] * (Ct @ C)
        loose = _loose(A)
        A = np.where(loose[..., None, None], np.eye(A.shape[-1]), A)
        x, lam = np.zeros(f.shape), np.zeros(d.shape)
        for _ in range(ROUNDS):
            gap = d - (C @ x[..., None])[..., 0]
            r = f - (M @ x[..., None])[..., 0] + (Ct @ (stiff * gap - lam)[..., None])[..., 0]
            x = x + _solve(A, r[..., None])[..., 0]
            lam = lam + stiff * ((C @ x[..., None])[..., 0] - d)
        return np.where(loose[..., None], np.nan, w * x)

    def precise(self, context: Any, values: Sequence[Any]) -> list[Any]:
        n, m = self.sizes
        M, C, s, w, f, d = self.split(values)
        M, C, f, d = w[:, None] * M * w[None, :], s[:, None] * C * w[None, :], w * f, s * d
        stiff = (max([M[k, k] for k in range(n)]) or 1) * context.mpf(10) ** (context.dps // 2)
        A = context.matrix((M + stiff * (C.T @ C) if m else M).tolist())
        x, lam = f * 0, d * 0
        for _ in range(ROUNDS):
            r = f - M @ x
            if m:
                r = r - C.T @ lam + stiff * (C.T @ (d - C @ x))
            step = context.lu_solve(A, context.matrix(list(r)))
            x = x + np.array(list(step), dtype=object)
            if m:
                lam = lam + stiff * (C @ x - d)
        return list(w * x)

    def tangents(self, recorder: Any, values: Sequence[Any], results: Sequence[Any], changes: Sequence[Any]) -> list[Any]:
        n, m = self.sizes
        M, C, s, w, f, _ = self.split(values)
        dM, dC, _, _, df, dd = self.split(changes)
        x = np.array(results, dtype=object)
        lam = np.array(recorder.call(Multipliers((n, m), self.reason), [*C.ravel(), *s, *w, *(f - M @ x)]), dtype=object)
        f_new, d_new = df - dM @ x - dC.T @ lam, dd - dC @ x
        kept = list(values)[:len(values) - n - m]  # e, the matrices and the scales
        return recorder.call(self, [*kept, *f_new, *d_new])  # type: ignore[no-any-return]


@dataclass(frozen=True)
class Multipliers(Kernel):
    """lam of C^T lam = g of least norm after scaling, for sizes (n, m): the rows of C perhaps dependent.

    Values: C row by row, scales of its rows (m) and columns (n), g. Iterated regularized normal equations,
    lam += (C C^T + e^2)^-1 C (g - C^T lam) with e = SMOOTHED, which stay in the range of C but for rounding, divided by e^2;
    that is what applying e^2 (C C^T + e^2)^-1 to lam again and again leaves, and it is taken off.
    """

    name = "symdyn_multipliers"

    @property
    def n_out(self) -> int:
        return self.sizes[1]

    @property
    def operations(self) -> int:
        n, m = self.sizes
        return m * (m + 1) * n + m**3 // 3 + ROUNDS * ((2 + 2 * CLEANINGS) * m * m + 4 * m * n) + 2 * n

    def split(self, values: Sequence[Any]) -> tuple[Any, ...]:
        """C (m, n), scales of rows and columns, g as arrays of objects."""
        n, m = self.sizes
        array = _objects(values)
        C, s, w, g = np.split(array, np.cumsum([m * n, m, n]))
        return C.reshape(m, n), s, w, g

    def rows(self, values: Sequence[Any]) -> np.ndarray:
        m = self.sizes[1]
        shape = np.broadcast_shapes(*[np.shape(v) for v in values])
        C, s, w, g = _stacked(self.split(values), shape)
        C = s[..., :, None] * C * w[..., None, :]
        g, Ct = w * g, np.swapaxes(C, -1, -2)
        B = C @ Ct + SMOOTHED**2 * np.eye(m)
        lam = np.zeros((*s.shape, 1))
        for _ in range(ROUNDS):
            lam = lam + np.linalg.solve(B, C @ (g[..., None] - Ct @ lam))
        for _ in range(CLEANINGS):
            rest = lam
            for _ in range(ROUNDS):
                rest = SMOOTHED**2 * np.linalg.solve(B, rest)
            lam = lam - rest
        return s * lam[..., 0]

    def precise(self, context: Any, values: Sequence[Any]) -> list[Any]:
        m = self.sizes[1]
        C, s, w, g = self.split(values)
        C, g = s[:, None] * C * w[None, :], w * g
        smoothed = context.mpf(10) ** (-(context.dps // 2))
        B = C @ C.T + np.array(context.eye(m).tolist(), dtype=object) * smoothed
        lam = s * 0
        for _ in range(ROUNDS):
            step = context.lu_solve(context.matrix(B.tolist()), context.matrix(list(C @ (g - C.T @ lam))))
            lam = lam + np.array(list(step), dtype=object)
        rest = lam
        for _ in range(ROUNDS):
            step = context.lu_solve(context.matrix(B.tolist()), context.matrix(list(smoothed * rest)))
            rest = np.array(list(step), dtype=object)
        return list(s * (lam - rest))

    def tangents(self, recorder: Any, values: Sequence[Any], results: Sequence[Any], changes: Sequence[Any]) -> list[Any]:
        C, s, w, _ = self.split(values)
        dC, _, _, dg = self.split(changes)
        lam = np.array(results, dtype=object)
        return recorder.call(self, [*C.ravel(), *s, *w, *(dg - dC.T @ lam)])  # type: ignore[no-any-return]


def _objects(values: Sequence[Any]) -> np.ndarray:
    """An array of anything, (n,)."""
    array = np.empty(len(values), dtype=object)
    for k, value in enumerate(values):
        array[k] = value
    return array


def _stacked(arrays: Sequence[np.ndarray], shape: tuple[int, ...]) -> list[np.ndarray]:
    """Arrays of numbers or of arrays (states) as arrays with the states first."""
    stacked = []
    for a in arrays:
        columns = [np.broadcast_to(np.asarray(v, dtype=float), shape) for v in a.ravel()]
        whole = np.stack(columns, axis=-1) if columns else np.zeros((*shape, 0))
        stacked.append(whole.reshape(*shape, *a.shape))
    return stacked


def _loose(A: np.ndarray) -> np.ndarray:
    """For symmetric matrices (..., n, n): whether a pivot is next to nothing of its entry; as in the templates.

    What is not a number is not loose: it shows in the result.
    """
    left, entries = A.copy(), np.diagonal(A, axis1=-2, axis2=-1)
    parts = 1.0 / np.where(entries > 0, entries, np.inf)
    loose, waiting = (entries <= 0).any(axis=-1), np.ones(entries.shape, dtype=bool)
    for _ in range(A.shape[-1]):
        part = np.where(waiting, np.diagonal(left, axis1=-2, axis2=-1) * parts, -np.inf)
        p = part.argmax(axis=-1)[..., None]
        loose |= np.take_along_axis(part, p, -1)[..., 0] <= LOOSE
        column = np.take_along_axis(left, p[..., None], -1)[..., 0]
        pivot = np.where(loose[..., None], 1.0, np.take_along_axis(column, p, -1))
        left = left - column[..., :, None] * (column / pivot)[..., None, :]
        np.put_along_axis(waiting, p, False, -1)
    return np.asarray(loose)


def _solve(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """A^-1 b for matrices (..., n, n), (..., n, 1); NaN for singular ones."""
    try:
        return np.linalg.solve(A, b)
    except np.linalg.LinAlgError:
        regular = (np.linalg.slogdet(A)[0] != 0)[..., None, None]
        return np.where(regular, np.linalg.solve(np.where(regular, A, np.eye(A.shape[-1])), b), np.nan)
