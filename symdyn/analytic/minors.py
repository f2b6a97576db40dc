"""Determinants and solutions of small linear equations by Laplace's expansion, so that nothing is divided on the way.

Entries are nodes and numbers, or lists of these for polynomials (see symdyn.analytic.stability). Minors are shared: 2^n of them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from symdyn.errors import SymdynError
from symdyn.tape.node import is_zero

# Larger blocks have too many minors.
LARGEST = 10


def determinant(rows: Any, add: Callable[[Any, Any], Any] = lambda a, b: a + b,
                multiply: Callable[[Any, Any], Any] = lambda a, b: a * b, negative: Callable[[Any], Any] = lambda a: -a,
                zero: Any = 0, one: Any = 1, vanishes: Callable[[Any], bool] = is_zero) -> Any:
    """The determinant of a square matrix, given by its rows.

    add, multiply, negative, zero, one, vanishes   arithmetic of the entries; default: nodes and numbers
    Raises SymdynError for more than LARGEST rows.
    """
    n = len(rows)
    if n > LARGEST:
        raise SymdynError(f"the determinant of {n} rows is requested in symbols; this is done up to {LARGEST} rows")
    # Rows with few entries first: they leave few minors.
    order = sorted(range(n), key=lambda k: (sum(not vanishes(e) for e in rows[k]), k))
    known: dict[tuple[int, ...], Any] = {(): one}

    def minor(columns: tuple[int, ...]) -> Any:
        """Minor of the last rows and these columns."""
        if columns not in known:
            row, total = rows[order[n - len(columns)]], zero
            for k, column in enumerate(columns):
                if not vanishes(row[column]):
                    below = minor(columns[:k] + columns[k + 1:])
                    if not vanishes(below):
                        term = multiply(row[column], below)
                        total = add(total, negative(term) if k % 2 else term)
            known[columns] = total
        return known[columns]

    value = minor(tuple(range(n)))
    swaps = sum(order[i] > order[j] for i in range(n) for j in range(i + 1, n))
    return negative(value) if swaps % 2 else value


def blocks(matrix: np.ndarray) -> list[list[int]]:
    """Indices that entries which are not zero connect, group by group, of a square matrix."""
    left, result = list(range(len(matrix))), []
    while left:
        group, new = [left[0]], [left[0]]
        while new:
            k = new.pop()
            more = [j for j in left if j not in group and not (is_zero(matrix[k, j]) and is_zero(matrix[j, k]))]
            group += more
            new += more
        result.append(sorted(group))
        left = [k for k in left if k not in group]
    return result


def solve(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """matrix^-1 right by Cramer's rule, block by block; right: (n,) or (n, m).

    Raises SymdynError for blocks of more than LARGEST rows, ZeroDivisionError where a determinant is zero by structure."""
    columns = right.reshape(len(right), -1)
    result = np.zeros(columns.shape, dtype=object)
    for block in blocks(matrix):
        rows = matrix[np.ix_(block, block)]
        below = determinant(rows)
        if is_zero(below):
            raise ZeroDivisionError("the matrix is singular")
        for j in range(columns.shape[1]):
            own = columns[block, j]
            if all(map(is_zero, own)):
                continue
            for k, index in enumerate(block):
                replaced = rows.copy()
                replaced[:, k] = own
                result[index, j] = determinant(replaced) / below
    return result.reshape(right.shape)
