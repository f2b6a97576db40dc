"""The facts about a mechanism that a method of integration gathers for its template."""

from __future__ import annotations

from dataclasses import dataclass

from symdyn.backend.band import Band


@dataclass(frozen=True, kw_only=True)
class Gathered:
    """The record that the template of a method gets of its own, and that the parts of the runtime depend on.

    second_order   whether q_dot = u; None: the method does not ask
    unrolled       whether sums are written out one by one
    sincos         whether sines and cosines are taken all at once
    band           the order in which a matrix has a narrow band; None: it is taken as a whole
    """

    second_order: bool | None = None
    unrolled: bool = False
    sincos: bool = False
    band: Band | None = None
