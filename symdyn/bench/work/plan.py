"""The rows of a benchmark one by one: what is measured, with which other programs, and in which order."""

from __future__ import annotations

import contextlib
import time as clock
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from symdyn.bench.work import against, methods
from symdyn.bench.work.against.apart import Prepared, TooLong, prepared
from symdyn.bench.work.against.peer import Peer, taken_as
from symdyn.bench.work.asked import Asked
from symdyn.bench.work.measure import own, peer_row
from symdyn.bench.work.record import Key, Row, Skipped
from symdyn.bench.work.system_under_test import Comparison, Formulation, SystemUnderTest
from symdyn.bench.work.timing import PASSES, Timing
from symdyn.errors import ArgumentError, SymdynError

# Part of what is left of a budget that may pass until all other programs are prepared, and part of that for the next one.
_FOR_PEERS, _FOR_NEXT = 1 / 2, 1 / 2
# A method that took longer than this for a run, s, is not asked for tighter tolerances.
_SLOW = 2.0
# Rows of an earlier run are timed again with the others if that takes no longer than this, s, and fits the budget.
_AGAIN = 120.0


@dataclass(frozen=True)
class Job:
    """A row to be measured; key as that of the row; peer: what it does once, such as compiling, it does at every tolerance."""

    key: Key
    measure: Callable[[Timing], Row]
    peer: bool = False
    timing: Timing = field(default_factory=Timing)

    def run(self) -> Row:
        """Measure it. Raises ArgumentError where the method does not take the mechanism, TooLong."""
        begun = clock.perf_counter()
        row = self.measure(self.timing)
        return replace(row, took=clock.perf_counter() - begun)


@dataclass
class Walk:
    """All jobs, one after the other, then again for their times.

    rows       what was measured; kept: of an earlier run;  deadline: of time.perf_counter
    left       how many runs were not made in time; given_up: lines whose other runs are not made, with the reason
    slow       the same of rows with tolerances alone (False), or with steps (True)
    """

    jobs: Sequence[Job]
    rows: list[Row]
    kept: dict[Key, Row]
    deadline: float
    bar: Any = None
    left: int = 0
    given_up: dict[tuple[str, str], str] = field(default_factory=dict)
    slow: dict[tuple[str, str, bool], str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.rows += [self.kept[job.key] for job in self.jobs if job.key in self.kept]

    def measure(self, store: Callable[[], None] = lambda: None) -> None:
        """Measure jobs that were not measured before; store: called after every row."""
        rows, late = self.rows, set[tuple[str, str]]()
        for job in self.jobs:
            self._step()
            if job.key in self.kept:
                continue
            before = _looser(job, rows)
            self.left += job.key[:2] in late
            steps = job.key[3] is not None
            kind = (*job.key[:2], steps)
            if job.key[:2] in self.given_up or kind in self.slow:
                continue
            if before > _SLOW:
                self.slow[kind] = f"not {'with shorter steps' if steps else 'at tighter tolerances'}: a run took {before:.2g} s"
                continue
            expected = max(2 * before, _last(job, rows) if job.peer else 0.0)
            if clock.perf_counter() + expected > self.deadline:
                self.left += 1
                continue
            try:
                rows.append(job.run())
            except TooLong as error:
                self.left += 1
                late.add(job.key[:2])
                self.given_up[job.key[:2]] = str(error)
                continue
            except ArgumentError as error:  # the method does not take the mechanism
                self.given_up[job.key[:2]] = str(error)
                continue
            store()

    @property
    def skipped(self) -> list[Skipped]:
        """Lines that were not measured, with the reasons."""
        slow = [Skipped(name, method, why) for (name, method, _), why in self.slow.items()]
        return [*[Skipped(*line, why) for line, why in self.given_up.items()], *slow]

    def time_again(self, repeats: int) -> None:
        """Further passes; rows of an earlier run first get the one that the others had, if there is time for all of them."""
        rows = self.rows
        places = {row.key: k for k, row in enumerate(rows)}
        again = [job for job in self.jobs if job.key in self.kept and not self.kept[job.key].message]
        left = min(_AGAIN, self.deadline - clock.perf_counter())
        if sum(max(0.0, self.kept[job.key].took) for job in again) <= left:
            for job in again:
                self._renew(job, rows, places[job.key])
        for job in [job for _ in range(1, PASSES) for job in self.jobs]:
            self._step()
            k = places.get(job.key)
            if k is not None and job.timing.runs and not rows[k].message and clock.perf_counter() < self.deadline:
                try:
                    rows[k] = job.timing.again(rows[k], repeats)
                except SymdynError:  # of another program; what it took before stands
                    job.timing.runs.clear()

    def _renew(self, job: Job, rows: list[Row], k: int) -> None:
        with contextlib.suppress(SymdynError):  # the row of the earlier run stays, with a mark
            row = job.run()
            if not row.message:
                rows[k] = row
                return
        job.timing.runs.clear()

    def _step(self) -> None:
        if self.bar is not None:
            self.bar.update()


def _last(job: Job, rows: Sequence[Row]) -> float:
    """Time of the row before of the same line, with compilation, s."""
    return next((r.took for r in reversed(rows) if (r.formulation, r.method) == job.key[:2] and r.took > 0), 0.0)


@dataclass
class Peers:
    """The other programs that can run the mechanism, on the formulation with the fewest operations.

    deadline   of time.perf_counter;  stack: closes what was prepared
    skipped    those that cannot, with the reason; late: those that were not ready in time
    """

    formulations: Sequence[Formulation]
    asked: Asked
    tested: SystemUnderTest
    deadline: float
    stack: contextlib.ExitStack
    skipped: list[Skipped] = field(default_factory=list)
    late: list[str] = field(default_factory=list)

    @property
    def ends(self) -> list[float]:
        """Times until which they run, s."""
        end = float(self.tested.end)
        return [*[t for t in self.asked.at if t < end], end]

    def prepare(self) -> Iterator[tuple[Peer, Formulation, Prepared]]:
        """All of them, ready."""
        if not self.asked.against:
            return
        least = min(self.formulations, key=lambda f: f.operations)
        motion = (least.equations, least.module.default_parameters, least.x0, least.system)
        now = clock.perf_counter()
        until = now + _FOR_PEERS * (self.deadline - now)
        for peer in (peer for name in self.asked.against for peer in against.peers(name)):
            there = peer.available()
            if there is not True:
                self.skipped.append(Skipped("", peer.name, str(there)))
                continue
            now = clock.perf_counter()
            try:
                ready = prepared(peer, motion, self.ends, now + _FOR_NEXT * (until - now), self.deadline)
            except Exception as error:  # Unfit, or whatever another program raises
                self.skipped.append(Skipped("", peer.name, str(error) or type(error).__name__))
                self.late += [peer.name] * isinstance(error, TooLong)
                continue
            self.stack.callback(ready.close)
            yield peer, least, ready


def jobs_of(formulations: Sequence[Formulation], asked: Asked, comparison: Comparison, peers: Peers) -> Iterator[Job]:
    """All rows; a coarse grid of tolerances first, so that a short budget shows the whole range, and at each of them all
    formulations and methods one after the other, so that they see the machine alike."""
    lines = [(f, m) for f in formulations for m in asked.methods]
    compared = list(peers.prepare())
    for tolerance in spread(asked.tolerances):
        for f, m in lines:
            yield Job((f.name, m, tolerance, None),
                       lambda timing, f=f, m=m, tolerance=tolerance: own(  # type: ignore[misc]
                           f, m, tolerance, None, comparison, asked.repeats, asked.at, timing))
        for peer, f, ready in compared:
            yield Job((taken_as(peer, f.name), peer.name, tolerance, None),
                       lambda timing, peer=peer, f=f, ready=ready, tolerance=tolerance: peer_row(  # type: ignore[misc]
                           peer, f, ready, peers.ends, tolerance, comparison, asked.repeats, timing), True)
    for step in spread(asked.steps or ()):
        for f, m in lines:
            if methods.takes_steps(m):
                yield Job((f.name, m, None, step),
                           lambda timing, f=f, m=m, step=step: own(  # type: ignore[misc]
                               f, m, None, step, comparison, asked.repeats, asked.at, timing))


def spread(values: Sequence[float]) -> list[float]:
    """Every fourth first, then those between."""
    order = [k for stride in (4, 2, 1) for k in range(0, len(values), stride)]
    return [values[k] for k in dict.fromkeys(order)]


def _looser(job: Job, rows: Sequence[Row]) -> float:
    """Time of the same method at looser tolerances, of a job with a step with longer ones, s."""
    name, method, tolerance, step = job.key
    return max((r.least for r in rows if (r.formulation, r.method) == (name, method) and r.least > 0 and (
        (step is None and r.step is None and (r.tolerance or 0) > (tolerance or 0)) or (
            step is not None and r.step is not None and r.step > step))), default=0.0)
