"""Repeated runs of one row: some now, some when all rows were measured, so that all of them see the machine alike."""

from __future__ import annotations

import math
import statistics
import time as clock
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from symdyn.bench.work.record import NAN, Row

# Passes over all rows that the repeats are spread over: the speed of a processor that others use changes within seconds.
PASSES = 3
# Seconds after which a run is not repeated any more; short runs are repeated for as long as MUCH s in a pass, but MOST times as
# often as asked at most: on a machine with other work a median of few of them says nothing.
ENOUGH, MUCH, MOST = 2.0, 0.01, 8

# repeats requested in all passes together -> s inside the integrator of the runs of one pass, evaluations of the right-hand side
Pass = Callable[[int], tuple[list[float], int]]


@dataclass
class Timing:
    """Runs until the times of a reference, each under its place there, the last to the end, and what they took so far."""

    runs: dict[int, Pass] = field(default_factory=dict)
    seconds: dict[int, list[float]] = field(default_factory=dict)
    evaluations: dict[int, int] = field(default_factory=dict)

    def add(self, index: int, run: Pass, repeats: int) -> None:
        """Time a run for the first time."""
        self.runs[index], self.seconds[index] = run, []
        self._repeat(index, repeats)

    def again(self, row: Row, repeats: int) -> Row:
        """One more pass; the row with its figures."""
        for place in self.runs:
            if sum(self.seconds[place]) < ENOUGH:
                self._repeat(place, repeats)
        return self.reported(row, len(row.errors))

    def reported(self, row: Row, n_times: int) -> Row:
        """The row with what was measured.

        n_times   of the reference
        """
        end = max(self.runs)
        seconds = self.seconds[end]
        until = [(NAN, 0)] * n_times
        for place in self.runs:
            until[place] = min(self.seconds[place]), self.evaluations[place]
        return replace(row, seconds=statistics.median(seconds), least=min(seconds), repeats=len(seconds),
                       evaluations=self.evaluations[end], until=tuple(until))

    def _repeat(self, index: int, repeats: int) -> None:
        seconds, self.evaluations[index] = self.runs[index](repeats)
        self.seconds[index] += seconds


def one_pass(run: Callable[[], float], repeats: int, deadline: float = math.inf) -> list[float]:
    """Times of the runs of one pass, s, each by its own clock.

    repeats    requested in all passes together;  deadline: of time.perf_counter, after which none is begun
    """
    now: list[float] = []
    each = -(-repeats // PASSES)
    while clock.perf_counter() < deadline and (not now or (sum(now) < ENOUGH / PASSES and (
            len(now) < each or (len(now) * min(now) < MUCH and len(now) < MOST * each)))):
        now.append(run())
    return now


def seconds_of(solution: Any) -> float:
    """Inside the integrator, where it reports it, else of the whole call."""
    return float(solution.seconds if solution.integrator_seconds is None else solution.integrator_seconds)
