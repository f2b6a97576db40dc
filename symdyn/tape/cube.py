"""The numeric algorithm for what water cuts off from a box, on the unit cube; see Cube."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from symdyn.errors import UnsupportedExpression
from symdyn.tape.kernels import Kernel

HIGHEST = 2


@dataclass(frozen=True)
class Cube(Kernel):
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
        shape = np.broadcast_shapes(*[np.shape(v) for v in values])
        states = np.stack([np.broadcast_to(np.asarray(v, dtype=float), shape) for v in values], axis=-1)
        results = [self._results(state, 1.0, 1 / math.sqrt(3)) for state in states.reshape(-1, 4).tolist()]
        return np.array(results, dtype=float).reshape(*shape, self.n_out)

    def precise(self, context: Any, values: Sequence[Any]) -> list[Any]:
        return self._results(list(values), context.mpf(1), 1 / context.sqrt(3))

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

    def _results(self, e: Sequence[Any], one: Any, gauss: Any) -> list[Any]:
        """For numbers of any kind, of which `one` is 1 and `gauss` 1/sqrt(3); NaN where the depth is constant or no number."""
        order, zero = self.sizes[0], one - one
        z, x, y = sorted((1, 2, 3), key=lambda k: -abs(e[k]))
        A, B, C = abs(e[x]), abs(e[y]), abs(e[z])
        reach = (A + B + C) / 2
        if not C > 0 or e[0] + reach != e[0] + reach:
            return [one * math.nan] * self.n_out
        if abs(e[0]) > reach:
            return [one if k == order == 0 and e[0] > 0 else zero for k in range(self.n_out)]

        # P: the square without what is below the line h = -1/2, and without the top, where h > 1/2.
        a, b, c = A / C, B / C, e[0] / C
        s = c + (a + b) / 2
        m: list[Any] = [one, zero, zero, one / 12, zero, one / 12]
        top: list[Any] = [zero] * 6
        low: list[tuple[Any, list[Any]]] = []
        high: list[tuple[Any, list[Any]]] = []
        if s + one / 2 < a + b:
            m, low = _corner(a, b, s + one / 2, -one / 2, gauss)
        if s - one / 2 > 0:
            top, high = _corner(a, b, s - one / 2, one / 2, gauss)
        m = [p - q for p, q in zip(m, top, strict=True)]

        # Q: integrals of r_i r_j over P with r = (1, x, y, h). Axes are turned so that the depth falls along each.
        Q = [[m[0], m[1], m[2]], [m[1], m[3], m[4]], [m[2], m[4], m[5]]]
        for row in Q:
            row.append(c * row[0] - a * row[1] - b * row[2])
        last = [row[3] for row in Q]
        Q.append([*last, c * last[0] - a * last[1] - b * last[2]])
        sign = [-1 if k and e[k] > 0 else 1 for k in range(4)]
        place = [(0, x, y, z).index(k) for k in range(4)]
        if order == 0:
            # Under P the cube is wet from -1/2 to h, under the top altogether.
            local = [Q[k][3] + Q[k][0] / 2 + top[k] for k in range(3)] + [Q[3][3] / 2 - Q[0][0] / 8]
            return [sign[i] * local[place[i]] for i in range(4)]
        if order == 1:
            return [sign[i] * sign[j] * Q[place[i]][place[j]] / C for i, j in self.indices]
        results = []
        for index in self.indices:
            # As the water rises, so does the cut, by 1/C, and its edges move along x by 1/A.
            p, q, r = (place[i] for i in index)
            rising: Any = sum((Q[j][k] for i, j, k in ((p, q, r), (q, r, p), (r, p, q)) if i == 3), zero) / C
            for part, ends in ((1, low), (-1, high)):
                for weight, at in ends:
                    rising = rising + part * at[p] * at[q] * at[r] * weight / A
            results.append(math.prod(sign[i] for i in index) * rising / C)
        return results


def _corner(a: Any, b: Any, s: Any, h: Any, gauss: Any) -> tuple[list[Any], list[tuple[Any, list[Any]]]]:
    """What of the square |x|, |y| <= 1/2 lies where a (x + 1/2) + b (y + 1/2) < s, for a >= b >= 0.

    Returns the integrals of 1, x, y, x^2, x y, y^2; and the two Gauss points (1, x, y, h) of the part of the line that is inside
    the square, each with half that part's height, if there is such a part.
    """
    zero, one = h - h, abs(h) * 2
    # Counted from a corner, it is as wide as the square below y0; then its width falls from w0 to w1 at y1.
    y0, y1, w0, w1 = one, one, one, one
    if s <= 0:
        y0 = y1 = zero
    elif s < a + b:
        y0, w0 = ((s - a) / b, one) if s > a else (zero, s / a)
        y1, w1 = (s / b, zero) if s < b else (one, (s - b) / a)
    dy = (y1 - y0) / 2
    m = [y0, zero, y0 * (y0 - 1) / 2, y0 / 12, zero, _square(y0)]
    ends = []
    for side in (-1, 1):
        share = (1 + side * gauss) / 2
        w, y = w0 + (w1 - w0) * share, y0 + (y1 - y0) * share - one / 2
        first = w * (w - 1) / 2
        m = [p + dy * q for p, q in zip(m, (w, first, w * y, _square(w), first * y, w * y * y), strict=True)]
        ends.append((dy, [one, w - one / 2, y, h]))
    return m, ends if dy > 0 else []


def _square(w: Any) -> Any:
    """Integral of x^2 from -1/2 to w - 1/2."""
    return w * (3 + w * (4 * w - 6)) / 12
