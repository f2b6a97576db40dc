"""The page of one benchmark or several: one HTML file that needs no network."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import symdyn
from symdyn.bench.work.benchmark import Benchmark
from symdyn.bench.work.picture import title
from symdyn.bench.work.record import DISTURBED, Row
from symdyn.bench.work.table import LEVELS, choices, earlier, figure, marked, milliseconds
from symdyn.pages import page_environment, write_text


def write_page(benchmarks: Sequence[Benchmark], pictures: Sequence[Path], path: Path) -> Path:
    """Write the page with the pictures, SVG files, of the benchmarks; returns its path.

    Raises ArgumentError where it cannot be written.
    """
    return write_text(path, page(benchmarks, pictures), "the page of the bench")


def page(benchmarks: Sequence[Benchmark], pictures: Sequence[Path]) -> str:
    """The text of the page."""
    parts = [part(benchmark, picture) for benchmark, picture in zip(benchmarks, pictures, strict=True)]
    return page_environment().get_template("report/bench.html.jinja").render(version=symdyn.__version__, parts=parts)


def part(benchmark: Benchmark, picture: Path) -> dict[str, Any]:
    """Text of the page on one mechanism."""
    at = [t for t in benchmark.at if not math.isclose(t, benchmark.end)]
    indices = [benchmark.index(t) for t in at]
    peers, busy = any(row.peer for row in benchmark.rows), sum(row.disturbed for row in benchmark.rows)
    return {"name": benchmark.name, "end": f"{benchmark.end:g}", "reference": benchmark.reference,
            "notes": benchmark.notes, "measure": benchmark.measure, "digits": f"{benchmark.reference.digits:.3g}",
            "about": benchmark.about, "unfinished": benchmark.unfinished,
            "busy": f"{busy} of {len(benchmark.rows)}" if busy else "",
            "disturbed": f"{DISTURBED:g}", "earlier": earlier(benchmark), "choices": choices(benchmark),
            "operations": [(title(name), n) for name, n in benchmark.operations.items()],
            "skipped": [(", ".join(filter(None, (s.formulation and title(s.formulation), s.method))), s.why)
                        for s in benchmark.skipped],
            "picture": "data:image/svg+xml;base64," + base64.b64encode(picture.read_bytes()).decode("ascii"),
            "at": [f"{t:g}" for t in at], "peers": peers,
            "best": [{"at": f"{benchmark.end if t is None else t:g}", "rows": _best(benchmark, t, peers)} for t in (None, *at)],
            "rows": [_row(row, indices) for row in benchmark.rows]}


def _best(benchmark: Benchmark, at: float | None, peers: bool) -> list[dict[str, str]]:
    rows, index = [], None if at is None else benchmark.index(at)
    for error in LEVELS if not benchmark.still else ():
        ours, theirs = benchmark.best(error, at, False), benchmark.best(error, at, True) if peers else None
        if ours is None and theirs is None:
            continue
        ratio = f"{theirs.time_at(index) / ours.time_at(index):.2g}" if ours and theirs else ""
        rows.append({"level": f"{error:.0e}", "ours": _time(ours, index), "which": _which(ours), "theirs": _time(theirs, index),
                     "their": _which(theirs), "ratio": ratio})
    return rows


def _time(row: Row | None, index: int | None) -> str:
    return "" if row is None else milliseconds(row.time_at(index))


def _which(row: Row | None) -> str:
    if row is None:
        return "none"
    name = row.method if row.peer else f"{title(row.formulation)}, {row.label}"
    return f"{name}, {row.setting}"


def _row(row: Row, indices: Sequence[int]) -> dict[str, Any]:
    return {"formulation": title(row.formulation), "method": row.label, "setting": row.setting, "message": row.message,
            "ms": marked(row),
            "evaluations": row.evaluations or "–", "steps": row.steps or "–",
            "operations": f"{row.operations:.3g}" if row.operations else "–",
            "errors": [figure(row.error_q), figure(row.error_u), *[figure(row.error_at(k)) for k in indices], figure(row.worst)],
            "energy": figure(row.energy_error), "constraint": figure(row.constraint_error), "peer": row.peer}
