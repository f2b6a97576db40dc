"""Products of matrices of expressions."""

from __future__ import annotations

from functools import reduce

import sympy as sp


def times(*factors: sp.MatrixBase) -> sp.ImmutableMatrix:
    """The product of matrices of finite entries, those of a row and column added up as they stand.

    SymPy's own asks of every entry that meets a zero whether it is finite, which takes longer than the product.
    """
    return reduce(_product, factors).as_immutable()


def cross(a: sp.MatrixBase, b: sp.MatrixBase) -> sp.ImmutableMatrix:
    """a x b of two columns of three finite entries, without the products with a zero."""
    def pair(i: int, j: int) -> sp.Expr:
        return a[i] * b[j] if a[i] is not sp.S.Zero and b[j] is not sp.S.Zero else sp.S.Zero

    return sp.ImmutableMatrix([pair(1, 2) - pair(2, 1), pair(2, 0) - pair(0, 2), pair(0, 1) - pair(1, 0)])


def _product(a: sp.MatrixBase, b: sp.MatrixBase) -> sp.MatrixBase:
    rows, columns = a.tolist(), b.T.tolist()
    return sp.ImmutableMatrix(a.rows, b.cols, [
        sp.Add(*[x * y for x, y in zip(row, column, strict=True) if x is not sp.S.Zero and y is not sp.S.Zero])
        for row in rows for column in columns])
