"""Work against error on the page: the bench with a small budget."""

from __future__ import annotations

import tempfile
import time as clock
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symdyn.errors import MissingExtra, SymdynError
from symdyn.runtime.building.compiler import find_compiler

if TYPE_CHECKING:
    from symdyn.bench.work.benchmark import Benchmark
    from symdyn.overview.context import OfWork

TOLERANCES = tuple(10.0**-k for k in (3, 5, 7, 9, 11, 13, 15))
REPEATS = 3
# Methods that the formulation of the report is measured with, one group after the other, each at all tolerances before the next;
# and those of the other formulations.
METHODS, OTHERS = (("dop853", "bs54", "taylor"), ("gauss", "radau")), ("dop853",)
WITHOUT_COMPILER, OTHERS_WITHOUT = (("DOP853", "RK45"), ("Radau", "LSODA")), ("DOP853",)
# Part of the budget that must be left for a group where the reference is not kept and is made again.
_AGAIN = 0.5


def measure(tested: Any, formulation: str, budget: float, log: Callable[[str], None]) -> list[Benchmark]:
    """A formulation with every method, and all formulations with one method, while the budget, s, lasts.

    tested        what sd.bench takes
    formulation   as sd.bench names it; empty where these are equations, of which there is one formulation
    The second is missing where it would have one formulation. They are not put together: where coordinates differ errors are
    those of bodies. Raises SymdynError where nothing can be measured, also within the budget.
    """
    begun = clock.perf_counter()

    def left(result: Benchmark | None) -> float:
        """Seconds; none where the reference is not kept and takes too much of them again."""
        rest = budget - (clock.perf_counter() - begun)
        return 0.0 if result is not None and result.reference.kind == "agreement" and rest < _AGAIN * budget else max(rest, 0.0)

    def run(formulations: Sequence[str] | None, methods: Sequence[str], seconds: float) -> Benchmark:
        from symdyn.bench.work import bench

        return bench(tested, formulations=formulations, methods=methods, tolerances=TOLERANCES, repeats=REPEATS, budget=seconds)

    compiled = find_compiler() is not None
    own = (formulation,) if formulation else None
    first: Benchmark | None = None
    missing: list[str] = []
    for methods in METHODS if compiled else WITHOUT_COMPILER:
        label, seconds = ", ".join(methods), left(first) if first is not None else budget
        if not seconds:
            missing.append(label)
            continue
        log(f"work against error: {label}, {seconds:.0f} s left")
        new = run(own, methods, seconds)
        missing += [f"some runs of {label}"] if new.unfinished else []
        first = new if first is None else merged(first, new)
    assert first is not None
    if not first.rows and not missing:
        raise SymdynError("no method fits:\n  - " + "\n  - ".join(map(str, first.skipped)))
    if not first.rows:
        raise SymdynError(f"no run was made within {budget:g} s, which the reference and compilation took; give more time with "
                          "--budget, or budget=")
    second: Benchmark | None = None
    seconds = left(first)
    if formulation and seconds:
        log(f"work against error: formulations, {seconds:.0f} s left")
        second = run(None, OTHERS if compiled else OTHERS_WITHOUT, seconds)
        missing += ["some runs of other formulations"] if second.unfinished else []
    elif formulation:
        missing.append("other formulations")
    first = replace(first, unfinished=f"{budget:g} s were not enough for {'; '.join(missing)}" if missing else "")
    several = second is not None and len({row.formulation for row in second.rows}) > 1
    return [first, replace(second, unfinished="")] if second is not None and several else [first]


def merged(first: Benchmark, second: Benchmark) -> Benchmark:
    """The rows of both, each once."""
    known = {row.key for row in first.rows}
    return replace(first, rows=[*first.rows, *[row for row in second.rows if row.key not in known]],
                   operations={**second.operations, **first.operations},
                   skipped=list(dict.fromkeys([*first.skipped, *second.skipped])))


def shown(benchmarks: Sequence[Benchmark], notes: list[str]) -> OfWork:
    """Content of the page: with pictures, or tables as text where these cannot be drawn, of which notes then tell."""
    from symdyn.bench.work.page import part
    from symdyn.bench.work.picture import write_pictures
    from symdyn.overview.context import OfWork

    with tempfile.TemporaryDirectory() as folder:
        try:
            parts = []
            for benchmark in benchmarks:
                drawn = next(path for path in write_pictures(benchmark, Path(folder)) if path.suffix == ".svg")
                parts.append(part(benchmark, drawn))
            return OfWork(tuple(parts), "")
        except MissingExtra as missing:
            notes.append(str(missing))
            return OfWork((), "\n\n".join(b.table() for b in benchmarks))
