"""Rotating 3 x 3 blocks of an inertia: R X R^T with as few operations as the rotation allows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.spatial.vectors import zeros
from symdyn.tape.node import Node, is_zero


@dataclass(frozen=True)
class _Turn:
    """R = a turn by (c, s) about a coordinate axis, up to the names and signs of the axes.

    kept       row and column of the axis that stays, and its sign
    rows, columns   of the turned plane: R[rows, columns] = [[c, -s], [s, c]], its second column times `sign`
    """

    kept: tuple[int, int, Any]
    rows: tuple[int, int]
    columns: tuple[int, int]
    c: Node
    s: Node
    sign: int


def rotated_symmetric(R: np.ndarray, X: np.ndarray) -> np.ndarray:
    """R X R^T of a symmetric X, (3, 3), symmetric entries once.

    About a coordinate axis 16 operations instead of 27: with d = x_kk - x_ll and w = c d - 2 s x_kl, the turned block is
    [x_ll + c w, x_kl + s w; ., x_kk - c w].
    """
    turn = _turn(R)
    result = zeros(3, 3)
    if turn is None:
        half = R @ X
        for i in range(3):
            for j in range(i, 3):
                result[i, j] = result[j, i] = half[i, 0] * R[j, 0] + half[i, 1] * R[j, 1] + half[i, 2] * R[j, 2]
        return result
    (a, b, one), (i, j), (k, l), c, s = turn.kept, turn.rows, turn.columns, turn.c, turn.s
    mixed = turn.sign * X[k, l]
    w = c * (X[k, k] - X[l, l]) - s * (2 * mixed)
    cw = c * w
    result[a, a] = X[b, b]
    result[i, i] = X[l, l] + cw
    result[j, j] = X[k, k] - cw
    result[i, j] = result[j, i] = mixed + s * w
    x, y = one * X[k, b], one * turn.sign * X[l, b]
    result[a, i] = result[i, a] = c * x - s * y
    result[a, j] = result[j, a] = s * x + c * y
    return result


def rotated(R: np.ndarray, X: np.ndarray) -> np.ndarray:
    """R X R^T of any X, (3, 3); the turned block as in rotated_symmetric with 2 x_kl replaced by x_kl + x_lk."""
    turn = _turn(R)
    if turn is None:
        return (R @ X) @ R.T
    result = zeros(3, 3)
    (a, b, one), (i, j), (k, l), c, s, sign = turn.kept, turn.rows, turn.columns, turn.c, turn.s, turn.sign
    upper, lower = sign * X[k, l], sign * X[l, k]
    w = c * (X[k, k] - X[l, l]) - s * (upper + lower)
    cw, sw = c * w, s * w
    result[a, a] = X[b, b]
    result[i, i], result[j, j] = X[l, l] + cw, X[k, k] - cw
    result[i, j], result[j, i] = upper + sw, lower + sw
    for x, y, first, second in ((one * X[k, b], one * sign * X[l, b], (i, a), (j, a)),
                                (one * X[b, k], one * sign * X[b, l], (a, i), (a, j))):
        result[first] = c * x - s * y
        result[second] = s * x + c * y
    return result


def _turn(R: np.ndarray) -> _Turn | None:
    """The turn about a coordinate axis that R is, or None if it is something else (or a quarter turn, which folds)."""
    for a in range(3):
        for b in range(3):
            one = R[a, b]
            if isinstance(one, Node) or abs(one) != 1:
                continue
            i, j = (row for row in range(3) if row != a)
            k, l = (column for column in range(3) if column != b)
            if not all(is_zero(e) for e in (R[a, k], R[a, l], R[i, b], R[j, b])):
                return None  # a tilt of 1e-9 has a cosine of 1 in floats
            c, s = R[i, k], R[j, k]
            if not isinstance(c, Node) or not isinstance(s, Node):
                return None
            for sign in (1, -1):
                if R[i, l] is -(sign * s) and R[j, l] is sign * c:
                    return _Turn((a, b, one), (i, j), (k, l), c, s, sign)
    return None
