"""Finds stretches of steps that a function repeats, such as those of like bodies one after the other.

Steps are looked at by what they do and what kinds of arguments they take, never by names: stretches that agree in that are one
loop, whatever they read.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# Kinds of so many steps in a row are compared to find out after how many steps they come again.
_IN_A_ROW = 8
# Makes one number of these, which is the same by chance for a few others: what it finds is compared in full later.
_FACTOR = np.uint64(0x9E3779B97F4A7C15)
# Lengths of stretches that are tried, the most frequent ones.
_LENGTHS = 12
# Trips of a loop and statements that it saves, at least.
LEAST_TRIPS, LEAST_SAVED = 3, 40


@dataclass(frozen=True)
class Loop:
    """Steps `begin` to `end`: `trips` stretches of `length` steps that are alike."""

    begin: int
    length: int
    trips: int

    @property
    def end(self) -> int:
        """The first step after it."""
        return self.begin + self.length * self.trips

    @property
    def saved(self) -> int:
        """Statements that it saves."""
        return self.length * (self.trips - 1)


def find_loops(kinds: np.ndarray, begins: Sequence[int] | np.ndarray) -> list[Loop]:
    """Loops in the order of their steps, those that save the most statements first.

    kinds    of all steps, as integers: steps of one kind do the same with arguments of the same kinds
    begins   steps where a stretch begins rather than elsewhere, ascending: where another heading does
    """
    result: list[Loop] = []
    begins = np.asarray(begins, dtype=int)
    waiting = [(0, len(kinds))]
    since = _since(kinds)
    while waiting:
        first, end = waiting.pop()
        loop = _best(kinds, first, end, _lengths(since, first, end), begins)
        if loop is not None:
            result.append(loop)
            waiting += [(first, loop.begin), (loop.end, end)]
    return sorted(result, key=lambda loop: loop.begin)


def _since(kinds: np.ndarray) -> np.ndarray:
    """The number of steps after which each comes again with the kinds of those behind it; 0: it comes for the first time."""
    n = max(0, len(kinds) - _IN_A_ROW + 1)
    keys = np.zeros(n, dtype=np.uint64)
    for k in range(_IN_A_ROW):
        keys = keys * _FACTOR + kinds[k:k + n].astype(np.uint64)
    order = np.argsort(keys, kind="stable")
    again = keys[order[1:]] == keys[order[:-1]]
    since = np.zeros(n, dtype=int)
    since[order[1:]] = np.where(again, np.diff(order), 0)
    return since


def _lengths(since: np.ndarray, first: int, end: int) -> list[int]:
    """The most frequent distances among the steps from first to end, ascending."""
    within = since[first:end]
    lengths, counts = np.unique(within[within > 0], return_counts=True)
    return sorted(lengths[np.argsort(-counts, kind="stable")[:_LENGTHS]].tolist())


def _best(kinds: np.ndarray, first: int, end: int, lengths: Sequence[int], begins: np.ndarray) -> Loop | None:
    """The loop among the steps from first to end that saves the most."""
    best: Loop | None = None
    for length in lengths:
        if end - first < LEAST_TRIPS * length:
            continue
        same = kinds[first:end - length] == kinds[first + length:end]
        ends = np.flatnonzero(np.concatenate(([True], ~same, [True])))
        runs = np.diff(ends) - 1
        longest = int(runs.argmax())
        loop = _aligned(first + int(ends[longest]), int(runs[longest]) + length, length, begins)
        if loop is not None and (best is None or loop.saved > best.saved):
            best = loop
    return best


def _aligned(first: int, steps: int, length: int, begins: np.ndarray) -> Loop | None:
    """The loop in a run of so many steps, from where a heading begins if that costs one trip at most."""
    k = int(np.searchsorted(begins, first))
    begin = int(begins[k]) if k < len(begins) and begins[k] - first < min(length, steps // 4) else first
    loop = Loop(begin, length, (steps - (begin - first)) // length)
    return loop if loop.trips >= LEAST_TRIPS and loop.saved >= LEAST_SAVED else None
