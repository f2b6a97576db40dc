"""Integrals along a motion over each of its intervals, with control of their errors, at many points at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.polynomial import legendre

# Panels of an interval to begin with, points of Gauss in each, and how often a panel is halved at most.
CUTS, POINTS, HALVED = 4, 6, 40


def integrals(f: Callable[[np.ndarray], np.ndarray], breaks: np.ndarray, relative: float) -> tuple[np.ndarray, np.ndarray]:
    """The integral of a function over each interval, and that of its absolute value, (K,) both.

    f          of times (n,), with values (n,); breaks (K + 1,)
    relative   what the integral over a panel and those over its halves may differ by, of the integral of the absolute value over
               all intervals; panels with more go on by their halves
    An interval in which a value is not finite has an integral that is not a number. Features that are narrower than the distance
    of the first points, about a fiftieth of an interval, may lie between them.
    """
    K = len(breaks) - 1
    nodes, weights = legendre.leggauss(POINTS)
    nodes, weights = (nodes + 1) / 2, weights / 2

    def over(begin: np.ndarray, h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values = f((begin[:, None] + h[:, None] * nodes).ravel()).reshape(len(begin), POINTS)
        return h * (values @ weights), h * (np.abs(values) @ weights)

    of = np.repeat(np.arange(K), CUTS)
    h = np.repeat(np.diff(breaks) / CUTS, CUTS)
    begin = breaks[of] + h * np.tile(np.arange(CUTS), K)
    result, size, coarse = np.zeros(K), np.zeros(K), over(begin, h)[0]
    for halved in range(HALVED):
        halves = np.stack([begin, begin + h / 2], axis=1)
        fine, absolute = (part.reshape(-1, 2) for part in over(halves.ravel(), np.repeat(h / 2, 2)))
        both, of_both = fine.sum(axis=1), absolute.sum(axis=1)
        # Intervals that are closed by now belong to the whole size, too.
        least = relative * (np.nansum(size) + np.nansum(of_both))
        with np.errstate(invalid="ignore"):
            still = (np.abs(both - coarse) > least) & (halved < HALVED - 1)  # not a number: closed
        result += np.bincount(of[~still], both[~still], K)
        size += np.bincount(of[~still], of_both[~still], K)
        if not still.any():
            break
        of, h, begin, coarse = np.repeat(of[still], 2), np.repeat(h[still] / 2, 2), halves[still].ravel(), fine[still].ravel()
    return result, size
