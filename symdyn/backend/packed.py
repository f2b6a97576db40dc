"""The sparsity pattern of the derivative of x_dot by x, whose entries are the function NAME, one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from symdyn.backend.band import Band, band_of

NAME = "jacobian_x_packed"
# Sparse factors take less time than dense ones from so many states on, and with this part of the entries at most.
LEAST_STATES, LARGEST_PART = 100, 0.1


@dataclass(frozen=True)
class Pattern:
    """Indices of rows and columns, (n_e,), row by row, of the entries of a matrix of n rows and n columns that may differ from
    zero; n_q: how many states are coordinates, which come first."""

    n: int
    rows: np.ndarray
    columns: np.ndarray
    n_q: int

    @cached_property
    def band(self) -> Band:
        """The order in which the matrices of compiled implicit methods have a narrow band."""
        return band_of(self)

    def with_work(self) -> Pattern:
        """The pattern with one more state at the end, the work of the loads, which depends on all others."""
        n = self.n
        return Pattern(n + 1, np.r_[self.rows, np.full(n, n)], np.r_[self.columns, np.arange(n)], self.n_q)

    @property
    def sparse(self) -> bool:
        """Whether sparse factors pay."""
        return self.n >= LEAST_STATES and len(self.rows) <= LARGEST_PART * self.n**2
