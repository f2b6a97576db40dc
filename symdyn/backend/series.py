"""The recurrences of Taylor coefficients as statements of a dialect, with constants of their own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from symdyn.backend.dialect import Dialect
from symdyn.backend.function import Function
from symdyn.backend.gathered import Gathered
from symdyn.backend.program import Program, build
from symdyn.errors import UnsupportedExpression
from symdyn.tape.balance import balance
from symdyn.tape.tape import Output, Tape
from symdyn.tape.taylor import series

if TYPE_CHECKING:
    from symdyn.backend.source import Content

# Sums that a vector holds, and vectors that are summed up at once: as many additions wait for each other as they take.
LANES, MOST_VECTORS = 4, 4
# Up to so many sums, orders are written out one by one, without vectors: 1.3 times as fast for pendulums.
FEW_SUMS = 2
# Highest order.
ORDERS = 30


@dataclass(frozen=True, kw_only=True)
class Series(Gathered):
    """The functions and sizes for the template of the method.

    program   of the functions: order 0, which hands on n_0 numbers, and any other order
    n_sums    sums, which are done in blocks of n_block, on vectors of n_lanes
    row       numbers that an order takes
    """

    program: Program
    n_0: int
    n_sums: int
    n_block: int
    n_lanes: int
    row: int
    orders: int = ORDERS

    @property
    def start(self) -> Function:
        """The function of order 0."""
        return self.program.functions[0]

    @property
    def next(self) -> Function:
        """The function of any other order."""
        return self.program.functions[1]


def gather_series(content: Content, program: Program, dialect: Dialect, leaves: Mapping[str, tuple[str, int]]) -> Series:
    """The functions of the series of a right-hand side.

    Raises UnsupportedExpression where the right-hand side has no Taylor series.
    """
    rhs = content.tapes["rhs"]
    state = [name for group in ("q", "u", "z") for name in content.groups[group]]
    try:
        made = series(rhs.recorder, next(iter(rhs.outputs.values())).entries, state)
    except UnsupportedExpression as error:
        raise UnsupportedExpression(f"{content.name}: {error}; use method='dop853'") from None
    # Factors side by side, filled up with zeros to whole blocks of vectors: the sums are done on these.
    rates, left, right = (made.next.outputs["series_next"].entries[a:b] for a, b in pairwise(made.borders))
    n_lanes = 1 if made.n_s <= FEW_SUMS else LANES
    n_block = max(made.n_s, 1) if n_lanes == 1 else LANES * min(MOST_VECTORS, -(-made.n_s // LANES))
    zeros = (0,) * ((-made.n_s % n_block) if made.n_s else 1)
    entries = (*left, *zeros, *right, *zeros, *rates)
    factors = Output("series_next", (len(entries),), entries)
    whole = balance(Tape(rhs.recorder, {**made.start.outputs, "series_next": factors}))
    tapes = {name: whole.prune((name,)) for name in ("series_start", "series_next")}
    written = build(dialect, tapes, {name: name for name in tapes}, {**leaves, **made.leaves}, program.reasons)
    stretches = [part for f in written.functions for part in f.stretches]
    n_sums = made.n_s + len(zeros)
    # An odd number of cache lines, so that rows do not compete for the same sets of the cache.
    row = 2 * n_sums + made.n_x if n_lanes == 1 else (2 * n_sums + made.n_x + 7) // 16 * 16 + 8
    return Series(program=written, n_0=made.n_0, n_sums=n_sums, n_block=n_block, n_lanes=n_lanes, row=row, unrolled=n_lanes == 1,
                  sincos="symdyn_sincos(" in repr(stretches))
