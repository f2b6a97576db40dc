"""The order in which matrices of implicit methods have a narrow band, and whether factors in it take less work than dense ones.

The matrices are mu - J, J the derivative of x_dot by x. A coordinate whose rate is a multiple of one other state, as where
q_dot = u, is eliminated by its row: mu - J_uu - J_uq/mu is left of a mechanism, with half of the states. States that nothing
depends on, such as the work of the loads, follow from the others. Those that are left are ordered by Cuthill and McKee, reversed:
springs and dampers between neighbours leave a band as wide as the speeds of two neighbours.

A band was chosen after measurements with one core: a real and a complex factorization of what is left of a cable of 1,000 links
take 0.13 ms, by SuperLU of SciPy with the better of its orders 1.5 ms; of nets of 20 x 20 and 30 x 30 knots in space 3.0 and
40 ms, by SuperLU 4.9 and 55 ms. Branches of branches are where a general order is ahead: a tree of 255 knots takes 2.2 ms, by
SuperLU 0.6 ms. Full matrices, of which a chain of joints is an example, stay as they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from symdyn.backend.packed import Pattern

# Solutions for every factorization in a step of "radau5"; multiplications that take as long as what is done once for each row;
# the part of the dense factors' work that those in the band may take.
SOLUTIONS, OF_A_ROW, PART = 5, 10, 0.5


@dataclass(frozen=True)
class Band:
    """An order of the states for elimination.

    sequence   (n,) of states: `reduced` coordinates that are eliminated first, `size` states of the band, those that follow
    first      (n + 1,) for every state the first of its entries; columns: (n_e,) for every entry the index of its column in
               the sequence
    lower, upper   diagonals of the band below and above the main one
    """

    sequence: np.ndarray
    first: np.ndarray
    columns: np.ndarray
    reduced: int
    size: int
    lower: int
    upper: int

    @property
    def factors(self) -> int:
        """Numbers of the factors of a real matrix."""
        return self.size * (2 * self.lower + self.upper + 1)

    @property
    def work(self) -> int:
        """Multiplications of a factorization with as many solutions as a step takes, in the band with exchanges of rows, and
        those that the rest of a row counts for."""
        below, right = self.lower, self.lower + self.upper
        return self.size * (below * (right + 1) + SOLUTIONS * (below + right + 1) + OF_A_ROW)

    @property
    def dense_work(self) -> float:
        """The same of a whole matrix of these states."""
        return self.size**3 / 3 + SOLUTIONS * self.size**2 + OF_A_ROW * self.size

    @property
    def pays(self) -> bool:
        """Whether factors in the band are taken: their work is at most PART of that of dense factors."""
        return 0 < self.work <= PART * self.dense_work


def band_of(pattern: Pattern) -> Band:
    """The band of mu - J with entries of J at these indices."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    n, rows, columns = pattern.n, pattern.rows, pattern.columns
    first = np.searchsorted(rows, np.arange(n + 1))
    following = _following(pattern, first)
    partners = _partners(pattern, first, set(following))
    eliminated = partners >= 0
    reduced = np.flatnonzero(eliminated)
    kept = np.setdiff1d(np.arange(n), [*reduced, *following])
    number = np.full(n, -1)
    number[kept] = np.arange(len(kept))
    # The column of a coordinate that is eliminated becomes part of its partner's.
    a, b = number[rows], number[np.where(eliminated[columns], partners[columns], columns)]
    a, b = a[number[rows] >= 0], b[number[rows] >= 0]
    if len(kept):
        both = coo_matrix((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, a])), shape=(len(kept), len(kept)))
        order = reverse_cuthill_mckee(both.tocsr(), symmetric_mode=True)
    else:
        order = np.zeros(0, dtype=int)
    at = np.argsort(order)
    below = at[a] - at[b]
    sequence = np.concatenate([reduced, kept[order], following]).astype(int)
    return Band(sequence, first, np.argsort(sequence)[columns], len(reduced), len(kept), int(below.max(initial=0)),
                int((-below).max(initial=0)))


def _following(pattern: Pattern, first: np.ndarray) -> list[int]:
    """States that nothing depends on but others that follow later, each after those that it depends on."""
    users = np.bincount(pattern.columns, minlength=pattern.n)
    free, result = np.flatnonzero(users == 0).tolist(), []
    while free:
        i = free.pop()
        result.append(i)
        for j in pattern.columns[first[i]:first[i + 1]].tolist():
            users[j] -= 1
            if users[j] == 0:
                free.append(j)
    return result[::-1]


def _partners(pattern: Pattern, first: np.ndarray, following: set[int]) -> np.ndarray:
    """The state that the rate of each coordinate that can be eliminated is a multiple of, (n,); -1 for all others. No such state
    is a coordinate that is eliminated itself."""
    result, needed = np.full(pattern.n, -1), set()
    for i in range(pattern.n_q):
        entries = pattern.columns[first[i]:first[i + 1]]
        if len(entries) == 1 and entries[0] != i and i not in following and i not in needed and result[entries[0]] < 0:
            result[i] = entries[0]
            needed.add(int(entries[0]))
    return result
