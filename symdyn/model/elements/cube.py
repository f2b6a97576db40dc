"""The numeric algorithm for what water cuts off from a box, on the unit cube; see Cube."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from symdyn.errors import UnsupportedExpression
from symdyn.model.algorithms.cube import SYMDYN_SHARES, symdyn_cut_cube
from symdyn.tape.algorithms.states import symdyn_each
from symdyn.tape.intrinsics import Intrinsic

HIGHEST = 2


@dataclass(frozen=True)
class Cube(Intrinsic):
    """Integrals over the wet part of the unit cube, |x|, |y|, |z| <= 1/2, for sizes (order,).

    Values: e, where the depth of a point r = (1, x, y, z) below the water is e.r = e0 + e1 x + e2 y + e3 z.
    Results, for i <= j <= k in the order of combinations_with_replacement(range(4), order + 1):
        order 0   integrals of r_i where e.r > 0: the wet volume and its first moments
        order 1   of r_i r_j over the cut e.r = 0, by the length of (e1, e2, e3): the derivatives of the former by e_j
        order 2   the derivatives of the latter by e_k
    All are derivatives by e of one function, the integral of max(e.r, 0).

    The cut is the graph z = h(x, y) over a part P of the square, z being the axis along which the depth changes most, and P
    what the lines h = -1/2 and h = 1/2 leave of the square. The only divisors are the largest of e1, e2, e3, and another
    where a line crosses the square, which it does not when that one is 0. Where the cut is a face, the derivatives are those on
    the side where part of the cube is wet and part dry.
    """

    name = "symdyn_cube"
    module = "symdyn.model.algorithms.cube"
    called_by = "sd.Buoyancy"

    @property
    def indices(self) -> list[tuple[int, ...]]:
        """i <= j <= k of each result."""
        return list(combinations_with_replacement(range(4), self.sizes[0] + 1))

    @property
    def letters(self) -> tuple[str, ...]:
        """V and S_x, S_y, S_z: volume and first moments; A of the cut, B its derivatives, with the axes of each."""
        axes = ["".join("_xyz"[k] for k in index if k) for index in self.indices]
        letter = "VAB"[self.sizes[0]]
        return tuple("V" if not self.sizes[0] and not a else f"S_{a}" if not self.sizes[0] else f"{letter}_{a or 0}"
                     for a in axes)

    @property
    def n_out(self) -> int:
        return len(self.indices)

    @property
    def operations(self) -> int:
        return (150, 150, 450)[self.sizes[0]]

    def rows(self, values: Sequence[Any]) -> np.ndarray:
        result, _ = symdyn_each(lambda e: symdyn_cut_cube(self.sizes[0], e, 1.0, SYMDYN_SHARES), self.n_out, values)
        return np.moveaxis(np.array(result), 0, -1)

    def precise(self, context: Any, values: Sequence[Any]) -> list[Any]:
        one, root = context.mpf(1), 1 / context.sqrt(3)
        result = symdyn_cut_cube(self.sizes[0], values, one, ((1 - root) / 2, (1 + root) / 2))
        return [context.nan] * self.n_out if result is None else result

    def tangents(self, recorder: Any, values: Sequence[Any], results: Sequence[Any], changes: Sequence[Any]) -> list[Any]:
        if self.sizes[0] == HIGHEST:
            raise UnsupportedExpression("the third derivative of the buoyancy of a box is asked for; the algorithm "
                                        f"{self.name} has two: differentiate what it is used in less often")
        higher = Cube((self.sizes[0] + 1,), self.reason)
        derivatives = dict(zip(higher.indices, recorder.call(higher, values), strict=True))
        rates = []
        for index in self.indices:
            rate: Any = 0
            for k, change in enumerate(changes):
                rate = rate + derivatives[tuple(sorted((*index, k)))] * change
            rates.append(rate)
        return rates

    def by_others(self, k: int) -> tuple[int, list[tuple[int, int]]] | None:
        """By Euler's theorem: the volume and first moments stay as they are where all e grow alike, so that the sum of e_j times
        their derivatives by e_j is zero."""
        first, *others = self.indices[k]
        if self.sizes[0] != 1 or first:
            return None
        return 0, [(j, self.indices.index(tuple(sorted((*others, j))))) for j in (1, 2, 3)]
