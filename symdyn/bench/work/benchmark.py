"""Work against error of one mechanism: the plan, the run that goes on where it was stopped, and what came of it."""

from __future__ import annotations

import contextlib
import math
import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from symdyn.bench import kept as files
from symdyn.bench.work import resume
from symdyn.bench.work.asked import Asked
from symdyn.bench.work.carried import DAMAGED, Carried, carried
from symdyn.bench.work.methods import NO_COMPILER
from symdyn.bench.work.plan import Peers, Walk, jobs_of
from symdyn.bench.work.record import Key, Reference, Row, Skipped
from symdyn.bench.work.reference import PATIENCE, find_reference
from symdyn.bench.work.start import ELSEWHERE, STILL, on_constraints, stands_still
from symdyn.bench.work.system_under_test import Comparison, Formulation, SystemUnderTest
from symdyn.bench.work.timing import PASSES
from symdyn.errors import ArgumentError, SymdynError
from symdyn.pipeline import emit
from symdyn.progress import bar as progress_bar
from symdyn.runtime.building.compiler import find_compiler

RESULTS = "results.json"
STATE, BODIES = "coordinates (q) and speeds (u)", "poses (q) and velocities (u) of all bodies"
# Part of a budget that a reference may be expected to take, with derivation, and after which no run for it is begun.
_OF_BUDGET, _AT_MOST = 1 / 3, 2 / 3


@dataclass(frozen=True)
class Benchmark:
    """Measurements of one mechanism.

    rows, skipped   see `record`; unfinished: empty, or why rows are missing
    reference       what errors are measured by; at: its times that are of interest besides the end, s
    operations      of one evaluation of the right-hand side, by formulation
    about           machine, compiler, version
    measure         of what errors are: STATE, or BODIES if formulations with different coordinates take part
    timed           when this run began; command: identifies the command it belongs to, if that measures several mechanisms
    notes           what a reader must know of the motion, a sentence each
    asked           keys of all rows that were requested; motion: identifies the motion, machine and code, fingerprint also what
                    errors are of; carried: rows of earlier runs that were not asked for, which a later one may go on with
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
    timed: str = ""
    command: str = ""
    notes: tuple[str, ...] = ()
    asked: tuple[Key, ...] = ()
    motion: str = ""
    carried: Carried = field(default_factory=Carried)

    def table(self) -> str:
        """Everything as text."""
        from symdyn.bench.work.table import table

        return table(self)

    @property
    def still(self) -> bool:
        """Whether nothing moves: the best of runs without errors says nothing."""
        return STILL in self.notes

    @property
    def earlier(self) -> list[Row]:
        """Rows with times of an earlier run, which this one went on with."""
        return [row for row in self.rows if row.earlier and not row.message]

    def best(self, error: float, at: float | None = None, peer: bool | None = None) -> Row | None:
        """The row that gets below an error in the least time; None if there is none.

        at     time of the error, s, one of the reference's; None: the end
        peer   of other programs only, or of symdyn and SciPy's methods on its right-hand side only; None: of all
        """
        index = None if at is None else self.index(at)
        good = [r for r in self.rows if r.error_at(index) <= error and r.time_at(index) > 0 and peer in (None, r.peer)]
        return min(good, key=lambda r: r.time_at(index), default=None)

    def index(self, at: float) -> int:
        """Index of this time among the reference's. Raises ArgumentError for another."""
        for k, t in enumerate(self.reference.times):
            if math.isclose(t, at, rel_tol=1e-12):
                return k
        raise ArgumentError(f"{self.name}: errors are known at t = {', '.join(f'{t:g}' for t in self.reference.times)} s, not at "
                            f"{at!r}; pass it to the bench as one of the times `at`")

    def record(self) -> dict[str, Any]:
        """As plain data."""
        r = self.reference
        return {"name": self.name, "end": self.end, "at": list(self.at), "complete": not self.unfinished,
                "unfinished": self.unfinished, "fingerprint": self.fingerprint, "about": self.about, "timed": self.timed,
                "command": self.command, "motion": self.motion, "notes": list(self.notes), "asked": [list(k) for k in self.asked],
                "operations": self.operations, "measure": self.measure,
                "reference": {"kind": r.kind, "digits": round(r.digits, 2), "how": r.how, "names": list(r.names),
                              "times": list(r.times), "x": [list(x) for x in r.x]},
                "skipped": [vars(s) for s in self.skipped], "rows": [row.record() for row in self.rows],
                "carried": self.carried.record(self.fingerprint, self.rows)}

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> Benchmark:
        """From plain data. Raises KeyError, TypeError, ValueError or AttributeError for what is none of a benchmark."""
        r = data["reference"]
        reference = Reference(r["kind"], tuple(r["times"]), r["x"], float(r["digits"]), r["how"], tuple(r["names"]))
        return cls(data["name"], float(data["end"]), [Row.of(row) for row in data["rows"]],
                   [Skipped(**skipped) for skipped in data["skipped"]], reference, tuple(data["at"]), dict(data["operations"]),
                   dict(data["about"]), data["unfinished"], data["fingerprint"], data["measure"], data["timed"], data["command"],
                   tuple(data["notes"]), tuple(tuple(key) for key in data["asked"]), data["motion"],
                   Carried.of({**data, "rows": ()}))

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
        files.write(folder / RESULTS, self.record())

    def __str__(self) -> str:
        return self.table()


def run(tested: SystemUnderTest, asked: Asked, folder: Path | None = None, progress: bool = False,
        log: Callable[[str], None] = lambda text: None, command: str = "", share: float | None = None,
        begun: float | None = None) -> Benchmark:
    """Measure a mechanism.

    folder     rows that an unfinished run left there are kept, and timed again at the end where that is cheap; every row is
               written as soon as it is measured
    progress   show a bar (needs tqdm);  log: called with what is going on;  command: see Benchmark
    share      of the budget, s, where it is for several mechanisms;  begun: of time.perf_counter, when it began to count
    Raises SymdynError where nothing can be measured.
    """
    begun = clock.perf_counter() if begun is None else begun
    tested = replace(tested, at=asked.at)
    formulations, skipped, first, moved = _formulated(tested, asked)
    budget = math.inf if asked.budget is None else asked.budget if share is None else share
    now = clock.perf_counter()
    reference = find_reference(tested, _leading(first, formulations), min(PATIENCE, begun + budget * _OF_BUDGET - now), log,
                               begun + budget * _AT_MOST)
    bodies = _differ(first, formulations)
    motion = _motion(tested, first)
    notes = [*filter(None, [moved]), *[STILL] * stands_still(reference, first), *[NO_COMPILER] * (find_compiler() is None)]
    for note in notes:
        log(f"{tested.name}: {note}")
    waited = clock.perf_counter() - begun
    result = Benchmark(tested.name, tested.end, [], skipped, reference, asked.at,
                       {f.name: f.operations for f in formulations}, resume.about(), "it was interrupted",
                       _fingerprint(motion, reference, bodies), BODIES if bodies else STATE, resume.now(), command,
                       tuple(notes), motion=motion)
    result = replace(result, carried=carried(folder and folder / RESULTS, result.motion, result.fingerprint))
    deadline = begun + budget
    with contextlib.ExitStack() as stack:
        peers = Peers(formulations, asked, tested, deadline, stack)
        jobs = list(jobs_of(formulations, asked, Comparison(reference, first, bodies), peers))
        result = replace(result, asked=tuple(job.key for job in jobs))
        kept = result.carried.kept(result.fingerprint, result.asked)
        bar = progress_bar(desc=tested.name, total=len(jobs) * PASSES, unit="run", leave=False) if progress else None
        if bar is not None:
            stack.callback(bar.close)
        walked = Walk(jobs, result.rows, kept, deadline, bar)
        if folder is not None:
            stack.callback(result.store, folder)
        walked.measure(lambda: result.store(folder) if folder is not None else None)
        walked.time_again(asked.repeats)
    result.skipped.extend([*peers.skipped, *walked.skipped])
    result = replace(result, rows=_sorted(result.rows, formulations, asked),
                     unfinished=_unfinished(walked.left, len(jobs), peers.late, asked.budget, share, waited))
    if folder is not None:
        result.store(folder)
    return result


def _unfinished(left: int, total: int, late: Sequence[str], budget: float | None, share: float | None, waited: float) -> str:
    """Why rows are missing; empty if none is. share: of the budget, None: all of it; waited: s before anything could be run."""
    missing = [f"{left} of {total} runs were not made"] if left else []
    if late:
        missing.append(f"{late[0]} was not ready" if len(late) == 1 else f"{len(late)} other programs were not ready")
    if budget is None or not missing:
        return ""
    part = "" if share is None else f", of which this mechanism has {share:.3g} s"
    over = waited > (budget if share is None else share)
    why = f", which derivation, compilation and reference used up: they took {waited:.2g} s" if over else ""
    return f"{' and '.join(missing)} within the budget of {budget:.4g} s{part}{why}"


def finished(tested: SystemUnderTest, asked: Asked, folder: Path, command: str) -> Benchmark | None:
    """Results that an earlier run of the same command left in a folder, if it was done and the motion is the same; else None."""
    data = resume.whole(folder / RESULTS, command)
    tested = replace(tested, at=asked.at)
    with contextlib.suppress(*DAMAGED, SymdynError):  # damaged, or nothing can be derived
        result = Benchmark.of(data)
        formulations, _, first, _ = _formulated(tested, asked)
        if result.fingerprint == _fingerprint(_motion(tested, first), result.reference, _differ(first, formulations)):
            return result
    return None


def _formulated(tested: SystemUnderTest, asked: Asked) -> tuple[list[Formulation], list[Skipped], Formulation, str]:
    """Formulations, those left out, the first there is, whatever was requested: errors are measured by its motion; and what was
    changed in the start, if it was not on the constraints, else nothing.

    Raises SymdynError if there is none.
    """
    formulations, skipped = tested.formulated(asked.formulations)
    if not formulations:
        raise SymdynError(f"{tested.name}: none of the formulations that were asked for fits:\n  - "
                          + "\n  - ".join(map(str, skipped)))
    first = formulations[0] if asked.formulations is None else tested.first()
    moved, note = on_constraints(tested, first)
    if note:
        names = [f.name for f in formulations if f.name in moved.names]
        skipped += [Skipped(f.name, "", ELSEWHERE) for f in formulations if f.name not in names]
        if not names:
            raise SymdynError(f"{tested.name}: {ELSEWHERE}")
        formulations = moved.formulated(names)[0]
        first = next((f for f in formulations if f.name == first.name), None) or moved.formulated([first.name])[0][0]
    return formulations, skipped, first, note


def _differ(first: Formulation, formulations: Sequence[Formulation]) -> bool:
    """Whether formulations have different coordinates."""
    return len({f.coordinates for f in (first, *formulations)}) > 1


def _leading(first: Formulation, formulations: Sequence[Formulation]) -> list[Formulation]:
    return [first, *[f for f in formulations if f.name != first.name]]


def _sorted(rows: Sequence[Row], formulations: Sequence[Formulation], asked: Asked) -> list[Row]:
    """As they are read: line by line, from loose to tight; other programs last."""
    names, order = [f.name for f in formulations], list(asked.methods)

    def place(row: Row) -> tuple[Any, ...]:
        method = order.index(row.method) if row.method in order else len(order)
        formulation = names.index(row.formulation) if row.formulation in names else len(names)
        return row.peer, row.peer and row.method, formulation, method, -(row.tolerance or row.step or 0.0)

    return sorted(rows, key=place)


def _motion(tested: SystemUnderTest, first: Formulation) -> str:
    """Fingerprint of the data that rows depend on besides their own names and the quantities of errors: numbers, and the code
    that runs."""
    text = "".join(emit(first.equations, "c", ("rhs",), standalone=False).files.values())
    return resume.fingerprint(tested.name, tested.end, first.x0.tolist(), first.module.default_parameters.tolist(),
                              resume.about(), resume.code(), text)


def _fingerprint(motion: str, reference: Reference, bodies: bool) -> str:
    """The same, with what errors are of and measured by."""
    return resume.fingerprint(motion, bodies, list(reference.times), reference.kind)
