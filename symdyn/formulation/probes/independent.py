"""Columns of a matrix that are independent at every state, tried at random states in double precision.

A matrix whose entries are analytic in the state has the same dependencies between its columns at almost every state, so a
few random ones show them. Columns are scaled to length one; what a column has left in addition to those before it is either of
the order of rounding, or far above it, and the gap between is reported.
Source: Gautier, Numerical calculation of the base inertial parameters of robots (1991); Golub and Van Loan, Matrix
Computations, section 5.2 (Gram-Schmidt, each step taken twice).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from symdyn.errors import SymdynError

# A column is independent if more than this is left of it; what lies in the gap around it is rejected.
TOLERANCE = 1e-8
GAP = 100.0


@dataclass(frozen=True)
class Independent:
    """Columns of a matrix A (m, n) in terms of some of them.

    zero           columns that are zero
    kept           independent columns: A = A[:, kept] C up to rounding
    coefficients   C of the columns that are neither zero nor kept: column -> {kept column: factor}
    margins        least that was left of a kept column, and most of a dependent one, of 1
    """

    zero: tuple[int, ...]
    kept: tuple[int, ...]
    coefficients: dict[int, dict[int, float]]
    margins: tuple[float, float]


def independent(A: np.ndarray, names: Sequence[str]) -> Independent:
    """The independent columns of A (m, n), in their order: a column is kept if those before it do not give it.

    Raises SymdynError naming the column if it is neither clearly independent nor clearly dependent.
    """
    sizes = np.linalg.norm(A, axis=0)
    zero = tuple(np.flatnonzero(sizes <= TOLERANCE * sizes.max(initial=0.0)).tolist())
    kept: list[int] = []
    dependent: list[int] = []
    Q = np.zeros((len(A), 0))
    least, most = 1.0, 0.0
    for column in range(A.shape[1]):
        if column in zero:
            continue
        rest = A[:, column] / sizes[column]
        for _ in range(2):
            rest = rest - Q @ (Q.T @ rest)
        left = float(np.linalg.norm(rest))
        if TOLERANCE / GAP < left < TOLERANCE * GAP:
            raise SymdynError(f"whether {names[column]} can be distinguished from the parameters before it is unclear in double "
                              f"precision: {left:.1e} of its column of the regressor is left, independent is more than "
                              f"{TOLERANCE * GAP:.0e}, dependent less than {TOLERANCE / GAP:.0e}")
        if left > TOLERANCE:
            kept.append(column)
            least = min(least, left)
            Q = np.column_stack([Q, rest / left])
        else:
            dependent.append(column)
            most = max(most, left)
    return Independent(zero, tuple(kept), _coefficients(A, sizes, kept, dependent), (least, most))


def _coefficients(A: np.ndarray, sizes: np.ndarray, kept: Sequence[int],
                  dependent: Sequence[int]) -> dict[int, dict[int, float]]:
    scaled = A[:, list(kept)] / sizes[list(kept)]
    result = {}
    for column in dependent:
        found = np.linalg.lstsq(scaled, A[:, column] / sizes[column], rcond=None)[0]
        result[column] = {k: float(c * sizes[column] / sizes[k]) for k, c in zip(kept, found, strict=True)
                          if abs(c) > TOLERANCE * GAP}
    return result
