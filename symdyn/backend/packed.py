"""Where the derivative of x_dot by x may differ from zero; its entries are the function NAME, one after the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

NAME = "jacobian_x_packed"
# From so many states on, and with this part of the entries at most, sparse factors take less time than dense ones.
LEAST_STATES, LARGEST_PART = 100, 0.1


@dataclass(frozen=True)
class Places:
    """Places of rows and columns, (n_e,), row by row, of a matrix of n rows and n columns."""

    n: int
    rows: np.ndarray
    columns: np.ndarray

    @property
    def sparse(self) -> bool:
        """Whether sparse factors pay."""
        return self.n >= LEAST_STATES and len(self.rows) <= LARGEST_PART * self.n**2
