"""Linear complementarity problems: w = M z + q with w >= 0, z >= 0 and w z = 0, by Lemke's method.

A further unknown z_0, weighted by a covering vector, makes all w positive and is driven out by pivots. Ties are broken in
lexicographic order, so that no basis occurs twice and the method ends: with a solution, or on a ray, where it finds none. For
copositive M, such as those of impacts with friction, a ray means that there is none.

Source: Cottle, Pang and Stone, The Linear Complementarity Problem, 1992, sections 4.4 and 4.9.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Parts of the sizes of what stands in a row: pivots below are zero, ratios closer together are a tie, values below vanish.
PIVOT, TIE, VANISHES = 1e-11, 1e-12, 1e-10
# Pivots for each unknown: far more than problems of mechanics take.
MOST_PIVOTS = 100


@dataclass(frozen=True)
class Complementary:
    """A solution: z (n,) and w (n,), pivots that it took; degenerate: entries of which both z and w vanish."""

    z: np.ndarray
    w: np.ndarray
    pivots: int
    degenerate: tuple[int, ...]


def lemke(M: np.ndarray, q: np.ndarray, cover: np.ndarray | None = None) -> Complementary | None:
    """A solution of w = M z + q, w >= 0, z >= 0, w z = 0, or None where the method ends on a ray.

    cover   positive weights of the further unknown, (n,): others may lead to another solution; default: ones
    """
    n = len(q)
    d = np.ones(n) if cover is None else cover
    if (q >= 0).all():
        return _of_basis(M, q, list(range(n)), 0)
    extra = 2 * n
    rows = np.hstack([np.eye(n), -M, -d[:, None], q[:, None]])  # w - M z - d z_0 = q
    basis = list(range(n))
    least = TIE * max(1.0, float(np.abs(q).max()))
    # All w become positive with the largest of -q/d; among equal ones the row that is last in lexicographic order of (q, I)/d.
    ratios = q / d
    tied = np.flatnonzero(ratios <= ratios.min() + least)
    row = int(min(tied, key=lambda i: tuple(np.eye(n)[i] / d[i])))
    entering = extra
    for pivots in range(1, MOST_PIVOTS * (n + 1)):
        leaving = basis[row]
        _pivot(rows, row, entering)
        basis[row] = entering
        if leaving == extra:
            return _of_basis(M, q, basis, pivots)
        entering = leaving + n if leaving < n else leaving - n
        result = _leaving(rows, basis, entering, extra, least)
        if result is None:
            return None
        row = result
    return None


def _pivot(rows: np.ndarray, row: int, column: int) -> None:
    rows[row] /= rows[row, column]
    factors = rows[:, column].copy()
    factors[row] = 0.0
    rows -= np.outer(factors, rows[row])


def _leaving(rows: np.ndarray, basis: list[int], entering: int, extra: int, least: float) -> int | None:
    """The row of the unknown that becomes zero first, in lexicographic order, or that of z_0 among them; None: none does."""
    n = len(rows)
    column = rows[:, entering]
    positive = np.flatnonzero(column > PIVOT * max(1.0, float(np.abs(column).max())))
    if not len(positive):
        return None
    for k in (rows.shape[1] - 1, *range(n)):  # the right side, then the inverse of the basis
        ratios = rows[positive, k] / column[positive]
        positive = positive[ratios <= ratios.min() + least * max(1.0, float(np.abs(ratios).min()))]
        zero = [int(i) for i in positive if basis[i] == extra]
        if zero and k == rows.shape[1] - 1:
            return zero[0]
        if len(positive) == 1:
            break
    return int(positive[0])


def _of_basis(M: np.ndarray, q: np.ndarray, basis: list[int], pivots: int) -> Complementary:
    """The solution of a basis, solved once more, since pivots have added up rounding."""
    n = len(q)
    inside = sorted(k - n for k in basis if n <= k < 2 * n)
    z = np.zeros(n)
    if inside:
        z[inside] = np.linalg.lstsq(M[np.ix_(inside, inside)], -q[inside], rcond=PIVOT)[0]
    w = M @ z + q
    w[inside] = 0.0
    small_z = VANISHES * max(float(np.abs(z).max(initial=0.0)), 1e-300)
    small_w = VANISHES * max(float(np.abs(q).max(initial=0.0)), 1e-300)
    both = tuple(int(k) for k in np.flatnonzero((np.abs(z) <= small_z) & (np.abs(w) <= small_w)))
    return Complementary(z, w, pivots, both)
