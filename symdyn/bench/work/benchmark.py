"""Work against error of one mechanism: the plan, the run that goes on where it was stopped, and what came of it."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import platform
import time as clock
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import symdyn
from symdyn.bench.work import against, methods
from symdyn.bench.work.against.peer import Peer
from symdyn.bench.work.asked import Asked
from symdyn.bench.work.measure import own, peer_row
from symdyn.bench.work.record import Reference, Row, Skipped
from symdyn.bench.work.reference import PATIENCE, find_reference
from symdyn.bench.work.subject import Formulation, Subject, Yardstick
from symdyn.bench.work.timing import PASSES, Timing
from symdyn.errors import ArgumentError, MissingExtra, SymdynError
from symdyn.pipeline import emit
from symdyn.runtime.compiler import find_compiler

RESULTS = "results.json"
STATE, BODIES = "coordinates (q) and speeds (u)", "poses (q) and velocities (u) of all bodies"
# Part of a budget that a reference may take.
_OF_BUDGET = 1 / 3
# A method that took longer than this for a run, s, is not asked for tighter tolerances.
_SLOW = 2.0


@dataclass(frozen=True)
class Benchmark:
    """What was measured of one mechanism.

    rows, skipped   see `record`; unfinished: empty, or why rows are missing
    reference       what errors are measured by; at: its times that are of interest besides the end, s
    operations      of one evaluation of the right-hand side, by formulation
    about           machine, compiler, version
    measure         of what errors are: STATE, or BODIES if formulations with different coordinates take part
    """

    name: str
    end: float
    rows: list[Row]
    skipped: list[Skipped]
    reference: Reference
    at: tuple[float, ...] = ()
    operations: dict[str, int] = field(default_factory=dict)
    about: dict[str, str] = field(default_factory=dict)
    unfinished: str = ""
    fingerprint: str = ""
    measure: str = STATE

    def table(self) -> str:
        """Everything as text."""
        from symdyn.bench.work.table import table

        return table(self)

    def best(self, error: float, at: float | None = None, peer: bool | None = None) -> Row | None:
        """The row that gets below an error in the least time; None if there is none.

        at     time of the error, s, one of the reference's; None: the end
        peer   of other programs only, or of symdyn and SciPy's methods on its right-hand side only; None: of all
        """
        index = None if at is None else self.index(at)
        good = [r for r in self.rows if r.error_at(index) <= error and r.time_at(index) > 0 and peer in (None, r.peer)]
        return min(good, key=lambda r: r.time_at(index), default=None)

    def index(self, at: float) -> int:
        """Which of the reference's times this is. Raises ArgumentError for another."""
        for k, t in enumerate(self.reference.times):
            if math.isclose(t, at, rel_tol=1e-12):
                return k
        raise ArgumentError(f"{self.name}: errors are known at t = {', '.join(f'{t:g}' for t in self.reference.times)} s, not at "
                            f"{at!r}; pass it to the bench as one of the times `at`")

    def record(self) -> dict[str, Any]:
        """As plain data."""
        r = self.reference
        return {"name": self.name, "end": self.end, "at": list(self.at), "complete": not self.unfinished,
                "unfinished": self.unfinished, "fingerprint": self.fingerprint, "about": self.about,
                "operations": self.operations, "measure": self.measure,
                "reference": {"kind": r.kind, "digits": round(r.digits, 2), "how": r.how, "names": list(r.names),
                              "times": list(r.times), "x": [list(x) for x in r.x]},
                "skipped": [vars(s) for s in self.skipped], "rows": [row.record() for row in self.rows]}

    def save(self, folder: Any) -> list[Path]:
        """Write results.json, work_precision.png and .svg and report.html into a folder, made if absent; returns their paths.

        Raises MissingExtra without matplotlib.
        """
        from symdyn.bench.work.page import write_page
        from symdyn.bench.work.picture import write_pictures

        folder = Path(folder)
        self.store(folder)
        pictures = write_pictures(self, folder)
        return [folder / RESULTS, *pictures, write_page([self], pictures[1:], folder / "report.html")]

    def store(self, folder: Path) -> None:
        """Write results.json, whole or not at all."""
        folder.mkdir(parents=True, exist_ok=True)
        partial = folder / f".{RESULTS}.tmp"
        partial.write_text(json.dumps(self.record(), indent=1) + "\n", encoding="utf-8")
        os.replace(partial, folder / RESULTS)

    def __str__(self) -> str:
        return self.table()


def run(subject: Subject, asked: Asked, folder: Path | None = None, progress: bool = False,
        told: Callable[[str], None] = lambda text: None) -> Benchmark:
    """Measure a mechanism.

    folder     rows that an unfinished run left there are kept; every row is written as soon as it is measured
    progress   show a bar (needs tqdm);  told: called with what is going on
    Raises SymdynError where nothing can be measured.
    """
    begun = clock.perf_counter()
    subject = replace(subject, at=asked.at)
    formulations, skipped = subject.formulated(asked.formulations)
    if not formulations:
        raise SymdynError(f"{subject.name}: none of the formulations that were asked for fits:\n  - "
                          + "\n  - ".join(map(str, skipped)))
    patience = PATIENCE if asked.budget is None else asked.budget * _OF_BUDGET
    # What errors are measured by is of the first formulation there is, whatever was asked for.
    first = formulations[0] if asked.formulations is None else subject.first()
    reference = find_reference(subject, _leading(first, formulations), patience, told)
    bodies = len({f.coordinates for f in (first, *formulations)}) > 1
    result = Benchmark(subject.name, subject.end, [], skipped, reference, asked.at,
                       {f.name: f.operations for f in formulations}, _about(), "it was interrupted",
                       _fingerprint(subject, first, reference, bodies), BODIES if bodies else STATE)
    kept = _kept(folder, result)
    # A reference that took longer than its part leaves the runs theirs.
    deadline = math.inf if asked.budget is None else max(begun + asked.budget,
                                                         clock.perf_counter() + asked.budget * (1 - _OF_BUDGET))
    jobs = list(_jobs(formulations, asked, Yardstick(reference, first, bodies), result.skipped, subject))
    bar = _bar(subject.name, len(jobs) * PASSES) if progress else None
    left, given_up = 0, dict[tuple[str, str], str]()
    try:
        for job in jobs:
            if bar is not None:
                bar.update()
            known, before = kept.get(job.key), _looser(job, result.rows)
            if known is None and (job.key[:2] in given_up or before > _SLOW):
                given_up.setdefault(job.key[:2], f"not at tighter tolerances: a run took {before:.2g} s")
                continue
            if known is None and clock.perf_counter() + 2 * before > deadline:
                left += 1
                continue
            try:
                row = known or job.run()
            except ArgumentError as error:  # the method does not take the mechanism
                given_up[job.key[:2]] = str(error)
                continue
            result.rows.append(row)
            if folder is not None and known is None:
                result.store(folder)
        _time_again(result.rows, jobs, asked.repeats, deadline, bar)
    finally:
        if bar is not None:
            bar.close()
        if folder is not None:
            result.store(folder)
    result.skipped.extend(Skipped(*line, why) for line, why in given_up.items())
    why = f"{left} of {len(jobs)} runs were not made within the budget of {asked.budget:g} s" if left else ""
    result = replace(result, rows=_sorted(result.rows, formulations, asked), unfinished=why)
    if folder is not None:
        result.store(folder)
    return result


@dataclass(frozen=True)
class _Job:
    """A row to be measured; key as that of the row."""

    key: tuple[str, str, float | None, float | None]
    measure: Callable[[Timing], Row]
    timing: Timing = field(default_factory=Timing)

    def run(self) -> Row:
        return self.measure(self.timing)


def _time_again(rows: list[Row], jobs: Sequence[_Job], repeats: int, deadline: float, bar: Any) -> None:
    """Further passes over what was measured in this run."""
    places = {row.key: k for k, row in enumerate(rows)}
    for job in [job for _ in range(1, PASSES) for job in jobs]:
        if bar is not None:
            bar.update()
        if job.timing.runs and job.key in places and not rows[places[job.key]].message and clock.perf_counter() < deadline:
            rows[places[job.key]] = job.timing.again(rows[places[job.key]], repeats)


def _leading(first: Formulation, formulations: Sequence[Formulation]) -> list[Formulation]:
    return [first, *[f for f in formulations if f.name != first.name]]


def _jobs(formulations: Sequence[Formulation], asked: Asked, yardstick: Yardstick, skipped: list[Skipped],
          subject: Subject) -> Iterator[_Job]:
    """All rows; a coarse grid of tolerances first, so that a short budget shows the whole range, and at each of them all
    formulations and methods one after the other, so that they see the machine alike."""
    lines = [(f, m) for f in formulations for m in asked.methods]
    compared = list(_peers(formulations, asked, yardstick, skipped, subject))
    for tolerance in _spread(asked.tolerances):
        for f, m in lines:
            yield _Job((f.name, m, tolerance, None),
                       lambda timing, f=f, m=m, tolerance=tolerance: own(  # type: ignore[misc]
                           f, m, tolerance, None, yardstick, asked.repeats, asked.at, timing))
        for peer, f, runners in compared:
            yield _Job((f.name, peer.name, tolerance, None),
                       lambda timing, peer=peer, f=f, runners=runners, tolerance=tolerance: peer_row(  # type: ignore[misc]
                           peer, f, runners, tolerance, yardstick, asked.repeats, timing))
    for step in _spread(asked.steps or ()):
        for f, m in lines:
            if methods.takes_steps(m):
                yield _Job((f.name, m, None, step),
                           lambda timing, f=f, m=m, step=step: own(  # type: ignore[misc]
                               f, m, None, step, yardstick, asked.repeats, asked.at, timing))


def _peers(formulations: Sequence[Formulation], asked: Asked, yardstick: Yardstick, skipped: list[Skipped],
           subject: Subject) -> Iterator[tuple[Peer, Formulation, list[tuple[float, Any]]]]:
    """The other programs that can run the mechanism, on the formulation with the fewest operations."""
    if not asked.against:
        return
    least = min(formulations, key=lambda f: f.operations)
    module = least.module
    end = float(yardstick.times[-1])
    for name in asked.against:
        for peer in against.peers(name):
            there = peer.available()
            if there is not True:
                skipped.append(Skipped("", peer.name, str(there)))
                continue
            try:
                runners = [(t, peer.prepare(least.equations, module.default_parameters, least.x0, t, least.system))
                           for t in (*[t for t in asked.at if t < end], end)]
            except Exception as error:  # Unfit, or whatever another program raises
                skipped.append(Skipped("", peer.name, str(error) or type(error).__name__))
                continue
            yield peer, least, runners


def _spread(values: Sequence[float]) -> list[float]:
    """Every fourth first, then those between."""
    order = [k for stride in (4, 2, 1) for k in range(0, len(values), stride)]
    return [values[k] for k in dict.fromkeys(order)]


def _looser(job: _Job, rows: Sequence[Row]) -> float:
    """How long the same method took at looser tolerances or longer steps, s."""
    name, method, tolerance, step = job.key
    return max((r.least for r in rows if (r.formulation, r.method) == (name, method) and r.least > 0 and (
        (r.tolerance or 0) > (tolerance or 0) or (r.step or 0) > (step or 0))), default=0.0)


def _sorted(rows: Sequence[Row], formulations: Sequence[Formulation], asked: Asked) -> list[Row]:
    """As they are read: line by line, from loose to tight; other programs last."""
    names, order = [f.name for f in formulations], list(asked.methods)

    def place(row: Row) -> tuple[Any, ...]:
        method = order.index(row.method) if row.method in order else len(order)
        return row.peer, row.peer and row.method, names.index(row.formulation), method, -(row.tolerance or row.step or 0.0)

    return sorted(rows, key=place)


def _fingerprint(subject: Subject, first: Formulation, reference: Reference, bodies: bool) -> str:
    """What rows depend on besides their own names: numbers, times, and the code that runs."""
    text = "".join(emit(first.equations, "c", ("rhs",), standalone=False).files.values())
    told = json.dumps([subject.name, subject.end, bodies, list(reference.times), reference.kind, first.x0.tolist(),
                       first.module.default_parameters.tolist(), sorted(_about().items())])
    return hashlib.sha256((told + text).encode()).hexdigest()[:16]


def _kept(folder: Path | None, result: Benchmark) -> dict[tuple[str, str, float | None, float | None], Row]:
    """The rows of an unfinished run of the same in a folder."""
    if folder is None:
        return {}
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError, AttributeError):  # not there, or another's file
        data = json.loads((folder / RESULTS).read_text(encoding="utf-8"))
        if data["fingerprint"] == result.fingerprint and not data["complete"]:
            rows = [Row.of(row) for row in data["rows"]]
            return {row.key: row for row in rows}
    return {}


def _about() -> dict[str, str]:
    compiler = find_compiler()
    return {"symdyn": symdyn.__version__, "machine": platform.machine(), "processor": _processor(),
            "compiler": f"{compiler.kind} {compiler.version}" if compiler else "none", "python": platform.python_version()}


def _processor() -> str:
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor()


def _bar(name: str, total: int) -> Any:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        raise MissingExtra("a progress bar needs tqdm: pip install 'symdyn[progress]', or leave out progress=True") from None
    return tqdm(total=total, desc=name, unit="run", leave=False)
