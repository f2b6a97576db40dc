"""Growth of derivation, generated code, compilation and run time with the number of bodies: O(n) recursion, O(n^3) mass matrix;
and those of the derivative of x_dot by x, for which the recursion takes O(n^2) operations in O(n) code."""

from __future__ import annotations

import json
import time as clock
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from symdyn.backend.right_side import RightSide
from symdyn.errors import ArgumentError
from symdyn.formulation.equations import Equations
from symdyn.functions.tapes import columns_of, function_tape
from symdyn.lab.random_tree import random_tree
from symdyn.model.system import System
from symdyn.pipeline import emit
from symdyn.runtime.building import cache
from symdyn.runtime.building.compiler import require_compiler
from symdyn.systems import get
from symdyn.timing.loops import best_times, compiled_loop, evaluation_times

SIZES = (2, 3, 4, 5, 7, 10, 14, 20, 30, 50, 70, 100)
FORMULATIONS = ("embedding", "recursive")
# Sizes after one with more operations than this are left to the recursion: the mass matrix has lost long before.
LARGEST_EMBEDDING = 50_000
HEADING = (f"{'n':>5} {'formulation':12}{'operations':>11}{'longest chain':>15}{'derive s':>10}{'C bytes':>10}{'compile s':>11}"
           f"{'evaluation us':>15}")


JACOBIAN = "jacobian_x"
# Lanes that operations of derivatives are counted with.
LANES = 8


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
        return _line(self.n, self.formulation, self.operations, self.chain, self.derive, self.size, self.compile, self.evaluation)


@dataclass(frozen=True)
class JacobianGrowth:
    """The same of the derivative of x_dot by x in articulated bodies; operations: executed in LANES lanes."""

    n: int
    formulation: str
    operations: int
    derive: float
    size: int
    compile: float
    evaluation: float

    def __str__(self) -> str:
        return _line(self.n, self.formulation, self.operations, "", self.derive, self.size, self.compile, self.evaluation)


def _line(n: int, formulation: str, operations: int, chain: int | str, derive: float, size: int, compiled: float,
          evaluation: float) -> str:
    return (f"{n:>5} {formulation:12}{operations:>11}{chain:>15}{derive:>10.3f}{size:>10}{compiled:>11.2f}"
            f"{evaluation * 1e6:>15.3f}")


JACOBIAN_VALUES: dict[str, Callable[[JacobianGrowth], float]] = {
    "operations": lambda r: r.operations, "bytes of C": lambda r: r.size, "seconds of derivation": lambda r: r.derive,
    "seconds of compilation": lambda r: r.compile, "seconds of evaluation": lambda r: r.evaluation}
Row = TypeVar("Row", Growth, JacobianGrowth)


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
        rows.append(Growth(n, formulation, tape.operations, tape.longest_chain(), seconds, len(text), compile_seconds(text),
                           time))
    return rows


def measure_jacobian(system: System, n: int, formulation: str = "recursive") -> JacobianGrowth:
    """The derivative of x_dot by x of one system."""
    equations, seconds, text = _derive(system, formulation, JACOBIAN)
    columns = columns_of(equations, JACOBIAN, RightSide())
    operations = function_tape(equations, JACOBIAN).operations if columns is None else columns.operations(LANES)
    size = len(equations.symbols.coordinates) + len(equations.symbols.speeds)
    loop = compiled_loop(equations, name=JACOBIAN, last=size * size - 1)
    return JacobianGrowth(n, formulation, operations, seconds, len(text), compile_seconds(text), best_times([loop.run], 20)[0])


def _derive(system: System, formulation: str, function: str = "rhs") -> tuple[Equations, float, str]:
    """Equations, seconds until the C text of a function was there, and the text."""
    begun = clock.perf_counter()
    equations: Equations = getattr(system, formulation)()
    source = emit(equations, "c", (function,), standalone=False, integrator=False)
    return equations, clock.perf_counter() - begun, next(iter(source.files.values()))


def compile_seconds(text: str) -> float:
    """Seconds that the compiler takes, nothing cached."""
    begun = clock.perf_counter()
    cache.discard(cache.build(f"{text}// measured at {clock.time_ns()}\n", "growth", require_compiler()))
    return clock.perf_counter() - begun


def order(rows: Sequence[Row], value: Callable[[Row], float], upper: int = 3) -> float:
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
    print(f"the derivative of x_dot by x, articulated bodies, operations executed in {LANES} lanes:")
    derivatives: list[JacobianGrowth] = []
    for n in sizes:
        derivatives.append(measure_jacobian(chain(n), n))
        print(derivatives[-1], flush=True)
    if len(derivatives) > 2:
        for what, of in JACOBIAN_VALUES.items():
            print(f"{what} of the derivative grow like n^{order(derivatives, of):.2f} over the last sizes")
    folder.mkdir(parents=True, exist_ok=True)
    measured = {"rhs": [asdict(r) for r in [*rows, *tree]], JACOBIAN: [asdict(r) for r in derivatives]}
    (folder / "growth.json").write_text(json.dumps(measured, indent=1), encoding="utf-8")
    picture(rows, folder / "growth.png")
    print(f"wrote {folder / 'growth.json'}\nwrote {folder / 'growth.png'}")
    return 0
