"""How derivation, generated code, compilation and run time grow with the number of bodies: O(n) recursion, O(n^3) mass matrix."""

from __future__ import annotations

import json
import time as clock
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.formulation.equations import Equations
from symdyn.functions.tapes import function_tape
from symdyn.lab.random_tree import random_tree
from symdyn.model.system import System
from symdyn.pipeline import emit
from symdyn.runtime.building import cache
from symdyn.runtime.building.compiler import require_compiler
from symdyn.systems import get
from symdyn.timing.loops import evaluation_times

SIZES = (2, 3, 4, 5, 7, 10, 14, 20, 30, 50, 70, 100)
FORMULATIONS = ("embedding", "recursive")
# Sizes after one with more operations than this are left to the recursion: the mass matrix has lost long before.
LARGEST_EMBEDDING = 50_000
HEADING = (f"{'n':>5} {'formulation':12}{'operations':>11}{'longest chain':>15}{'derive s':>10}{'C bytes':>10}{'compile s':>11}"
           f"{'evaluation us':>15}")


@dataclass(frozen=True)
class Growth:
    """One size in one formulation: exact counts, seconds of derivation with emission, bytes of C, seconds of compilation and of
    one evaluation."""

    n: int
    formulation: str
    operations: int
    chain: int
    derive: float
    size: int
    compile: float
    evaluation: float

    def __str__(self) -> str:
        return (f"{self.n:>5} {self.formulation:12}{self.operations:>11}{self.chain:>15}{self.derive:>10.3f}{self.size:>10}"
                f"{self.compile:>11.2f}{self.evaluation * 1e6:>15.3f}")


def chain(n: int) -> System:
    """The chain whose growth is measured."""
    return get("spatial_chain", n=n)


def grow(make: Callable[[int], System] = chain, sizes: Sequence[int] = SIZES,
         formulations: Sequence[str] = FORMULATIONS) -> Iterator[Growth]:
    """Measure size after size; a formulation that gets too long is left out from there on."""
    going = list(formulations)
    for n in sizes:
        for row in measure(make(n), n, going):
            yield row
            if row.formulation == "embedding" and row.operations > LARGEST_EMBEDDING:
                going.remove("embedding")


def measure(system: System, n: int, formulations: Sequence[str]) -> list[Growth]:
    """The formulations of one system, their evaluations timed side by side."""
    derived = [_derive(system, formulation) for formulation in formulations]
    times = evaluation_times([equations for equations, _, _ in derived], repeats=20)
    rows = []
    for formulation, (equations, seconds, text), time in zip(formulations, derived, times, strict=True):
        tape = function_tape(equations, "rhs")
        rows.append(Growth(n, formulation, tape.operations, tape.longest_chain(), seconds, len(text), _compile(text), time))
    return rows


def _derive(system: System, formulation: str) -> tuple[Equations, float, str]:
    """Equations, seconds until their C text was there, and the text."""
    begun = clock.perf_counter()
    equations: Equations = getattr(system, formulation)()
    source = emit(equations, "c", ("rhs",), standalone=False, integrator=False)
    return equations, clock.perf_counter() - begun, next(iter(source.files.values()))


def _compile(text: str) -> float:
    """Seconds that the compiler takes, nothing cached."""
    begun = clock.perf_counter()
    cache.discard(cache.build(f"{text}// measured at {clock.time_ns()}\n", "growth", require_compiler()))
    return clock.perf_counter() - begun


def order(rows: Sequence[Growth], value: Callable[[Growth], float], upper: int = 3) -> float:
    """The exponent of n with which a value grows, fitted to the largest sizes."""
    last = sorted(rows, key=lambda r: r.n)[-upper:]
    return float(np.polyfit(np.log([r.n for r in last]), np.log([value(r) for r in last]), 1)[0])


def crossover(rows: Sequence[Growth], value: Callable[[Growth], float]) -> int | None:
    """The first size from which on the recursion is ahead."""
    by = {(r.n, r.formulation): value(r) for r in rows}
    ahead = [n for n, formulation in by if formulation == "embedding" and by.get((n, "recursive"), np.inf) < by[n, "embedding"]]
    behind = [n for n, formulation in by if formulation == "embedding" and n not in ahead]
    after = [n for n in ahead if not behind or n > max(behind)]
    return min(after, default=None)


def picture(rows: Sequence[Growth], path: Path) -> None:
    """Four panels over the number of bodies: operations, evaluation, derivation, compilation."""
    from symdyn.pictures.figure import Picture

    figure = Picture(figsize=(11, 7.5), layout="constrained")
    panels = (("operations of the right-hand side", lambda r: r.operations), ("one evaluation, µs", lambda r: r.evaluation * 1e6),
              ("describe, derive and emit, s", lambda r: r.derive), ("compile, s", lambda r: r.compile))
    for axes, (title, value) in zip(figure.subplots(2, 2).ravel(), panels, strict=True):
        for formulation, color, label in (("embedding", "tab:orange", "mass matrix, L$^T$DL"),
                                          ("recursive", "tab:blue", "articulated bodies")):
            own = [r for r in rows if r.formulation == formulation]
            if own:
                grown = f"{label} (last sizes: n$^{{{order(own, value):.1f}}}$)" if len(own) > 2 else label
                axes.loglog([r.n for r in own], [value(r) for r in own], "o-", color=color, label=grown)
        where = crossover(rows, value)
        if where is not None and title.startswith(("operations", "one")):
            axes.axvline(where, color="0.6", linestyle=":")
            axes.annotate(f"recursion ahead from n = {where}", (where, axes.get_ylim()[0]), xytext=(4, 6),
                          textcoords="offset points", fontsize=8, color="0.35")
        axes.set_title(title, fontsize=10)
        axes.grid(True, which="major", alpha=0.3)
        axes.legend(fontsize=8)
    figure.supxlabel("bodies n of a spatial chain")
    figure.savefig(path, dpi=120)


def run(sizes: Sequence[int] | None = None, folder: Path | None = None) -> int:
    """Print the table, write growth.json and growth.png into the folder (default: generated/growth); returns 0.

    Raises ArgumentError unless sizes are numbers of bodies.
    """
    sizes, folder = sizes or SIZES, folder or Path("generated") / "growth"
    if any(n < 1 for n in sizes):
        raise ArgumentError(f"--sizes takes numbers of bodies, 1 or more; found {' '.join(map(str, sizes))}")
    rows: list[Growth] = []
    print(HEADING)
    for row in grow(sizes=sizes):
        rows.append(row)
        print(row, flush=True)
    tree = measure(random_tree(2 * max(sizes)), 2 * max(sizes), ["recursive"])
    print(f"a random tree of {2 * max(sizes)} bodies:\n{tree[0]}")
    for what, value in (("operations", lambda r: r.operations), ("evaluation", lambda r: r.evaluation)):
        for formulation in FORMULATIONS:
            own = [r for r in rows if r.formulation == formulation]
            if len(own) > 2:
                print(f"{what} of {formulation} grow like n^{order(own, value):.2f} over the last sizes")
        where = crossover(rows, value)
        print(f"{what}: recursion ahead from n = {where}" if where else f"{what}: the mass matrix is ahead throughout")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "growth.json").write_text(json.dumps([asdict(r) for r in [*rows, *tree]], indent=1), encoding="utf-8")
    picture(rows, folder / "growth.png")
    print(f"wrote {folder / 'growth.json'}\nwrote {folder / 'growth.png'}")
    return 0
