"""Solvers for M x + C^T lam = f, C x = d; see Saddle and Multipliers in symdyn.tape.intrinsics.

`xp` is the arithmetic: NumPy, or what has its names for other numbers. Arrays have the entries of vectors and matrices first, and
then states, of which there may be none.
"""

import numpy as np

# A mass below this part of the largest is none.
SYMDYN_MASSLESS = 1e-12
# Rounds of iteration, and how often what rounding leaves outside the range of C is taken off.
SYMDYN_ROUNDS = 5
SYMDYN_CLEANINGS = 2


def symdyn_less(xp, start, products):
    """start - products[0] - products[1] - ..., in this order."""
    return xp.subtract.reduce(np.concatenate([start[None], products]), axis=0)


def symdyn_loose(A, least):
    """Whether a pivot of the symmetric A (n, n) is no more than this part of its entry: nothing holds some direction then.

    The pivot that is the largest part of its entry goes first, so that rounding stays small."""
    n, entries, A = len(A), symdyn_diagonal(A), A.copy()
    loose, waiting = (entries <= 0).any(axis=0), np.ones(entries.shape, dtype=bool)
    parts = 1 / np.where(loose, 1, entries)
    for _ in range(n):
        if loose.all():
            break
        part = np.where(waiting, symdyn_diagonal(A) * parts, -np.inf)
        p = part.argmax(axis=0)[None]
        loose = loose | (np.take_along_axis(part, p, 0)[0] <= least)
        column = np.take_along_axis(A, p[None], 1)[:, 0]
        pivot = np.where(loose, 1, np.take_along_axis(column, p, 0)[0])
        np.put_along_axis(waiting, p, False, 0)
        there = np.flatnonzero(symdyn_nonzero(np.where(waiting, column, 0)[:, None]))
        at, column = np.ix_(there, there), column[there]
        A[at] = A[at] - column[:, None] * column / pivot
    return loose


def symdyn_diagonal(A):
    """The entries A[k, k], (n,)."""
    return A[np.arange(len(A)), np.arange(len(A))]


def symdyn_spoiled(values):
    """0, or no number where one of them is none or infinite: zeros that are passed over would have spread it."""
    return (0 * values).sum(axis=0)


def symdyn_nonzero(A):
    """Whether entries (n, m) are anything but zero at some state; what is not computed yet counts as such."""
    if A.dtype == object:
        return np.array([[not isinstance(e, (int, float)) or e != 0 for e in row] for row in A]).reshape(A.shape)
    return (A != 0).reshape(*A.shape[:2], -1).any(axis=2)


def symdyn_with_square(start, C):
    """start + C^T C, (n, n), from the entries of C (m, n) that are not zero."""
    square = start.copy()
    for row, there in zip(C, symdyn_nonzero(C)):
        at = np.ix_(np.flatnonzero(there), np.flatnonzero(there))
        square[at] = square[at] + row[there][:, None] * row[there]
    return square


def symdyn_factorize(xp, A):
    """L, its columns below the diagonal, and D of A = L D L^T by the lower triangle, and whether a pivot is not positive; what
    is no number passes, and so do infinite entries, which become that. L is kept as far as its columns reach."""
    entries, A, L = symdyn_diagonal(A), A.copy(), []
    first = [min(np.flatnonzero(there[:i + 1]), default=i) for i, there in enumerate(symdyn_nonzero(A))]
    ends = [max(i for i in range(j, len(A)) if first[i] <= j) + 1 for j in range(len(A))]
    D = A[:, 0].copy()
    for j, end in enumerate(ends):
        before = slice(first[j], j)
        column = symdyn_less(xp, A[j:end, j], np.swapaxes(A[j:end, before], 0, 1) * (A[j, before] * D[before])[:, None])
        D[j] = column[0] + 0 * entries[j]
        A[j + 1:end, j] = xp.divide(column[1:], D[j])
        L.append(A[j + 1:end, j].copy())
    return (L, D), xp.logical_or.reduce(xp.less_equal(D, 0))


def symdyn_substitute(xp, factors, right):
    """A^-1 right by these factors, (n,)."""
    (L, D), x = factors, right.copy()
    for k, column in enumerate(L):
        x[k + 1:k + 1 + len(column)] -= column * x[k]
    x = xp.divide(x, D)
    for i in range(len(x) - 2, -1, -1):
        x[i] = xp.subtract.reduce(np.concatenate([x[i:i + 1], L[i] * x[i + 1:i + 1 + len(L[i])]]), axis=0)
    return x


def symdyn_saddle_point(xp, n, m, values, least, in_order=False):
    """x (n) of M x + C^T lam = f, C x = d, and whether there is none: M symmetric, perhaps singular, the m rows of C perhaps
    dependent. Values: e, M lower triangle row by row, C row by row, scales of the rows (m) and columns (n) of C, f, d.

    The iterated augmented Lagrangian of Bayo, Garcia de Jalon and Serna, Comput. Methods Appl. Mech. Eng. 71 (1988), scaled:
    (M + a C^T C) x = f - C^T lam + a C^T d, lam += a (C x - d) with a = M_kk / e^2; each round takes the residual again.
    There is none where a pivot is no more than the part `least` of its entry; None: that is not looked at. in_order: the
    pivots of the factorization itself are looked at, for arithmetic that cannot choose the next one.
    """
    e, triangle, C, rows, columns, f, d = np.split(values, np.cumsum([1, n * (n + 1) // 2, m * n, m, n, n]))
    i, j = np.indices((n, n))
    M = triangle[np.maximum(i, j) * (np.maximum(i, j) + 1) // 2 + np.minimum(i, j)]
    C = C.reshape(m, n, *values.shape[1:])
    # Columns are scaled until all masses are equal, rows back by the largest of their columns' factors.
    masses = columns * columns * symdyn_diagonal(M)
    largest = xp.maximum.reduce(masses)
    largest = xp.where(xp.greater(largest, 0), largest, 1)
    lighter = xp.sqrt(xp.divide(largest, xp.where(xp.greater(masses, SYMDYN_MASSLESS * largest), masses, largest)))
    columns = columns * lighter
    rows = xp.divide(rows, xp.maximum.reduce(xp.where(xp.not_equal(C, 0), lighter, 1), axis=1))
    C = rows[:, None] * columns * C
    Ct = np.swapaxes(C, 0, 1)
    M = columns[:, None] * columns * M
    a = xp.divide(largest, e[0] * e[0])
    f, d = columns * f, rows * d
    A = M + a * symdyn_with_square(np.zeros_like(M), C)
    loose = False if least is None or in_order else symdyn_loose(A, least)
    factors, failed = symdyn_factorize(xp, np.where(loose, np.eye(n).reshape((n, n) + (1,) * np.ndim(loose)), A))
    if in_order:
        failed = xp.logical_or.reduce(xp.less_equal(factors[1], least * symdyn_diagonal(A)))
    x, lam = np.zeros_like(f), np.zeros_like(d)
    for _ in range(SYMDYN_ROUNDS):
        gap = a * symdyn_less(xp, d, Ct * x[:, None]) - lam
        r = symdyn_less(xp, symdyn_less(xp, f, M * x[:, None]), -(C * gap[:, None]))
        x = x + symdyn_substitute(xp, factors, r)
        lam = lam - a * symdyn_less(xp, d, Ct * x[:, None])
    return columns * x + (symdyn_spoiled(x) + symdyn_spoiled(lam)), xp.logical_or(loose, failed)


def symdyn_least_multipliers(xp, n, m, values, e):
    """lam (m) of C^T lam = g of least norm after scaling, and whether there is none: rows of C perhaps dependent. Values: C row
    by row, scales of its rows (m) and columns (n), g. Iterated: lam += (C C^T + e^2)^-1 C (g - C^T lam)."""
    C, rows, columns, g = np.split(values, np.cumsum([m * n, m, n]))
    C = rows[:, None] * columns * C.reshape(m, n, *values.shape[1:])
    Ct, g, smoothed = np.swapaxes(C, 0, 1), columns * g, e * e
    start = np.zeros((m, m, *values.shape[1:]), dtype=C.dtype)
    start[np.arange(m), np.arange(m)] = smoothed
    factors, failed = symdyn_factorize(xp, symdyn_with_square(start, Ct))
    lam = np.zeros_like(rows)
    for _ in range(SYMDYN_ROUNDS):
        rest = symdyn_less(xp, g, C * lam[:, None])
        lam = lam + symdyn_substitute(xp, factors, symdyn_less(xp, np.zeros_like(lam), -(Ct * rest[:, None])))
    for _ in range(SYMDYN_CLEANINGS):
        rest = lam  # what rounding has left outside the range of C, when all else has vanished
        for _ in range(SYMDYN_ROUNDS):
            rest = symdyn_substitute(xp, factors, smoothed * rest)
        lam = lam - rest
    return rows * lam + symdyn_spoiled(lam), failed
