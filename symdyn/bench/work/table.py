"""A benchmark as text."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from symdyn.bench.work.record import DISTURBED, Row

if TYPE_CHECKING:
    from symdyn.bench.work.benchmark import Benchmark

LEVELS = tuple(10.0**-k for k in range(2, 14))
LEGEND = """\
ms: wall time inside the integrator, median of the repeats (what is compared, and drawn, are the least times); evaluations: of
the right-hand side, with taylor orders of its series; operations: evaluations times operations of one, unknown with taylor,
with radau and radau5 without Jacobians and their factors: of different methods compare times; worst: the largest error over
the reference's times; energy: error of the balance, relative; C: residual of the constraints relative to the mechanism's
length, and of the norms of Euler parameters; errors q, u: at the end, norm-wise relative to the largest norm of the reference
over its times, of """


def table(benchmark: Benchmark) -> str:
    """Reference, rows, what was left out, and the best of every level of error."""
    return "\n".join(_lines(benchmark))


def _lines(benchmark: Benchmark) -> Iterator[str]:
    yield f"{benchmark.name}, {benchmark.end:g} s"
    for note in benchmark.notes:
        yield from _wrapped(f"note: {note}")
    yield from _wrapped(f"reference: {benchmark.reference}")
    yield "operations of one evaluation: " + ", ".join(f"{name} {n}" for name, n in benchmark.operations.items())
    columns = [_at(t) for t in benchmark.at]
    widths = _widths(benchmark.rows)
    yield (f"{'formulation':{widths[0]}}{'method':{widths[1]}}{'rtol':>9}{'ms':>10}{'evaluations':>13}{'steps':>9}"
           f"{'operations':>12}{'error q':>9}{'error u':>9}" + "".join(f"{c:>10}" for c in columns)
           + f"{'worst':>9}{'energy':>9}{'C':>9}")
    indices = [benchmark.index(t) for t in benchmark.at]
    for row in benchmark.rows:
        yield _row(row, indices, widths)
    yield from _wrapped(earlier(benchmark))
    yield from _wrapped(choices(benchmark))
    yield from best(benchmark, None)
    for t in benchmark.at:
        yield from best(benchmark, t)
    for skipped in benchmark.skipped:
        yield from _wrapped(f"left out: {skipped}")
    busy = sum(row.disturbed for row in benchmark.rows)
    if busy:
        yield (f"the machine had other work: of {busy} of {len(benchmark.rows)} rows, marked *, the median is over {DISTURBED:g} "
               "times the least time")
    if benchmark.unfinished:
        yield f"unfinished: {benchmark.unfinished}; run it again with the same output folder to go on"
    yield f"{LEGEND}{benchmark.measure}"


def earlier(benchmark: Benchmark) -> str:
    """Rows that were timed in an earlier run; empty if none was."""
    kept = benchmark.earlier
    when = ", ".join(sorted({row.earlier for row in kept}))
    return (f"{len(kept)} of {len(benchmark.rows)} rows, marked ^, were timed in an earlier run, of {when}: the machine may have "
            "been quicker or slower then; to compare all times measure into another folder") if kept else ""


def choices(benchmark: Benchmark) -> str:
    """Why auto chose what it did; empty where it was not requested."""
    first = {(row.formulation, row.chosen): row for row in reversed(benchmark.rows) if row.chosen}
    why = [f"{row.formulation} from {row.setting} {row.chosen}, {row.why}" for row in reversed(first.values())]
    return f"auto chose by short trial runs, which are not in the times: {'; '.join(why)}" if why else ""


def best(benchmark: Benchmark, at: float | None) -> Iterator[str]:
    """The least time below every level of error, ours and of other programs."""
    peers = any(row.peer for row in benchmark.rows)
    where = f"t = {at:g} s" if at is not None else "the end"
    if benchmark.still or benchmark.best(LEVELS[0], at) is None:
        why = "nothing moves" if benchmark.still else f"no run got below {LEVELS[0]:g}"
        yield f"least time below an error, at {where}: none, {why}"
        return
    yield f"least time below an error, at {where}:"
    index = None if at is None else benchmark.index(at)
    for error in LEVELS:
        ours, theirs = benchmark.best(error, at, False), benchmark.best(error, at, True) if peers else None
        if ours is None and theirs is None:
            continue
        line = f"  {error:.0e}  " + _shown(ours, index)
        if peers:
            line = f"{line:72}" + _shown(theirs, index)
            if ours is not None and theirs is not None:
                line += f"   ({theirs.time_at(index) / ours.time_at(index):.2g} times ours)"
        yield line


def _shown(row: Row | None, index: int | None) -> str:
    if row is None:
        return "none"
    chosen = f" ({row.chosen})" if row.chosen else ""
    return f"{milliseconds(row.time_at(index))} ms  {row.line}{chosen} at {row.setting}"


def milliseconds(seconds: float) -> str:
    """Three digits."""
    return f"{seconds * 1e3:.3g}" if seconds < 1 else f"{seconds * 1e3:.0f}"


def marked(row: Row) -> str:
    """The median, with what there is to say of it."""
    return "" if math.isnan(row.seconds) else milliseconds(row.seconds) + "*" * row.disturbed + "^" * bool(row.earlier)


def figure(value: float) -> str:
    """Two digits; a dash where it is not known."""
    return "-" if math.isnan(value) else f"{value:.1e}"


def _row(row: Row, indices: Sequence[int], widths: tuple[int, int]) -> str:
    head = f"{row.formulation:{widths[0]}}{row.label:{widths[1]}}{row.setting:>9}"
    if row.message:
        return f"{head}  stopped: {textwrap.shorten(row.message, 150)}"
    counts = "".join(f"{n or '-':>{w}}" for n, w in ((row.evaluations, 13), (row.steps, 9)))
    operations = f"{row.operations:.3g}" if row.operations else "-"
    taken = marked(row)
    return (f"{head}{taken:>10}{counts}{operations:>12}{figure(row.error_q):>9}{figure(row.error_u):>9}"
            + "".join(f"{figure(row.error_at(k)):>10}" for k in indices)
            + f"{figure(row.worst):>9}{figure(row.energy_error):>9}{figure(row.constraint_error):>9}")


def _at(t: float) -> str:
    return f"t={t:g}"


def _widths(rows: Sequence[Row]) -> tuple[int, int]:
    return (max([11, *[len(r.formulation) for r in rows]]) + 2, max([6, *[len(r.label) for r in rows]]) + 2)


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, 150, subsequent_indent="    ")
