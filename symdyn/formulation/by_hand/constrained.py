"""Constraints of equations by hand: nothing there distinguishes lengths from angles."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

from symdyn.formulation.constraints.motion import Constrained
from symdyn.formulation.constraints.rows import Row


class ConstrainedByHand(Constrained):
    """Mixed in before a Motion whose mass and forces were given."""

    def constrain(self, rows: Sequence[Row], intrinsic: bool, independent: tuple[int, ...] | None,
                  pivots: tuple[tuple[int, int], ...] | None) -> None:
        """Take the rows of the constraints, and in which way they are solved."""
        self.rows = list(rows)
        self.intrinsic, self.independent, self.pivots = intrinsic, independent, pivots

    @cached_property
    def length(self) -> Any:
        """1 m: how long the mechanism is, and which of the coordinates are lengths, is not known."""
        return 1

    @cached_property
    def lever(self) -> Any:
        """1 m, as the length."""
        return self.length

    @property
    def angular(self) -> list[bool]:
        return [False] * len(self.speeds)
