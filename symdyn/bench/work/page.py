"""The page of one benchmark or several: one HTML file that needs no network."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import symdyn
from symdyn.bench.work.benchmark import Benchmark
from symdyn.bench.work.picture import title
from symdyn.bench.work.record import DISTURBED, Row
from symdyn.bench.work.table import LEVELS, choices, earlier, figure, marked, milliseconds
from symdyn.named_records import NamedRecords
from symdyn.pages import filled, write_text


@dataclass(frozen=True)
class Best:
    """The least time below an error, as text: ours and of other programs, what each is of, and their ratio."""

    level: str
    ours: str
    which: str
    theirs: str
    their: str
    ratio: str


@dataclass(frozen=True)
class BestAt:
    """Those at a time, s."""

    at: str
    rows: tuple[Best, ...]


@dataclass(frozen=True)
class MeasuredRun:
    """A run, as text; errors: of coordinates, of speeds, at the times of interest, the worst; peer: another program's."""

    formulation: str
    method: str
    setting: str
    message: str
    ms: str
    evaluations: str
    steps: str
    operations: str
    errors: tuple[str, ...]
    energy: str
    constraint: str
    peer: bool


@dataclass(frozen=True)
class Referred:
    """The reference that errors are measured by: its kind, its digits, how these were shown; measure: of what errors are."""

    kind: str
    digits: str
    how: str
    measure: str


@dataclass(frozen=True)
class Machine:
    """The machine that times were measured on; busy: how many rows met other work, "" where none did; disturbed: by how much, at
    the least."""

    processor: str
    compiler: str
    busy: str
    disturbed: str


@dataclass(frozen=True)
class Runs:
    """The runs of a mechanism.

    operations   of one evaluation of the right-hand side, pairs of a formulation and a number; methods: each once
    at           times of interest before the end, s; peers: whether other programs take part
    """

    operations: tuple[tuple[str, int], ...]
    methods: tuple[str, ...]
    at: tuple[str, ...]
    peers: bool
    best: tuple[BestAt, ...]
    rows: tuple[MeasuredRun, ...]


@dataclass(frozen=True)
class Remarks:
    """Remarks that a reader needs: on the motion, on runs that are missing, on times of earlier runs, on the choice of auto;
    skipped: pairs of what was left out and why."""

    notes: tuple[str, ...]
    unfinished: str
    earlier: str
    choices: str
    skipped: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Measured:
    """Work against error of one mechanism; end: of the motion, s; picture: address of an <img>."""

    name: str
    end: str
    picture: str
    reference: Referred
    machine: Machine
    runs: Runs
    remarks: Remarks


@dataclass(frozen=True)
class BenchContext(NamedRecords):
    """The records that the page gets; version: of symdyn."""

    version: str
    parts: tuple[Measured, ...]


def write_page(benchmarks: Sequence[Benchmark], pictures: Sequence[Path], path: Path) -> Path:
    """Write the page with the pictures, SVG files, of the benchmarks; returns its path.

    Raises ArgumentError where it cannot be written.
    """
    return write_text(path, page(benchmarks, pictures), "the page of the bench")


def page(benchmarks: Sequence[Benchmark], pictures: Sequence[Path]) -> str:
    """The text of the page."""
    parts = tuple(part(benchmark, picture) for benchmark, picture in zip(benchmarks, pictures, strict=True))
    return filled("report/bench.html.jinja", BenchContext(symdyn.__version__, parts))


def part(benchmark: Benchmark, picture: Path) -> Measured:
    """The part of the page on one mechanism."""
    at = [t for t in benchmark.at if not math.isclose(t, benchmark.end)]
    indices = [benchmark.index(t) for t in at]
    peers, busy = any(row.peer for row in benchmark.rows), sum(row.disturbed for row in benchmark.rows)
    reference, about = benchmark.reference, benchmark.about
    return Measured(
        benchmark.name, f"{benchmark.end:g}",
        "data:image/svg+xml;base64," + base64.b64encode(picture.read_bytes()).decode("ascii"),
        Referred(reference.kind, f"{reference.digits:.3g}", reference.how, benchmark.measure),
        Machine(about["processor"], about["compiler"], f"{busy} of {len(benchmark.rows)}" if busy else "", f"{DISTURBED:g}"),
        Runs(tuple((title(name), n) for name, n in benchmark.operations.items()),
             tuple(dict.fromkeys(row.method for row in benchmark.rows)), tuple(f"{t:g}" for t in at), peers,
             tuple(BestAt(f"{benchmark.end if t is None else t:g}", _best(benchmark, t, peers)) for t in (None, *at)),
             tuple(_row(row, indices) for row in benchmark.rows)),
        Remarks(benchmark.notes, benchmark.unfinished, earlier(benchmark), choices(benchmark),
                tuple((", ".join(filter(None, (s.formulation and title(s.formulation), s.method))), s.why)
                      for s in benchmark.skipped)))


def _best(benchmark: Benchmark, at: float | None, peers: bool) -> tuple[Best, ...]:
    rows, index = [], None if at is None else benchmark.index(at)
    for error in LEVELS if not benchmark.still else ():
        ours, theirs = benchmark.best(error, at, False), benchmark.best(error, at, True) if peers else None
        if ours is None and theirs is None:
            continue
        ratio = f"{theirs.time_at(index) / ours.time_at(index):.2g}" if ours and theirs else ""
        rows.append(Best(f"{error:.0e}", _time(ours, index), _which(ours), _time(theirs, index), _which(theirs), ratio))
    return tuple(rows)


def _time(row: Row | None, index: int | None) -> str:
    return "" if row is None else milliseconds(row.time_at(index))


def _which(row: Row | None) -> str:
    if row is None:
        return "none"
    name = row.method if row.peer else f"{title(row.formulation)}, {row.label}"
    return f"{name}, {row.setting}"


def _row(row: Row, indices: Sequence[int]) -> MeasuredRun:
    errors = (figure(row.error_q), figure(row.error_u), *[figure(row.error_at(k)) for k in indices], figure(row.worst))
    return MeasuredRun(title(row.formulation), row.label, row.setting, row.message, marked(row), str(row.evaluations or "–"),
                       str(row.steps or "–"), f"{row.operations:.3g}" if row.operations else "–", errors,
                       figure(row.energy_error), figure(row.constraint_error), row.peer)
