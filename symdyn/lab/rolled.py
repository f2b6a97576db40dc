"""Savings by loops in place of repeated statements: code, compilation and run time of mechanisms of like parts."""

from __future__ import annotations

import json
import time as clock
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.choice import choose
from symdyn.errors import ArgumentError
from symdyn.functions.tapes import function_tape
from symdyn.lab.figures import Figure, print_figures
from symdyn.lab.growth import compile_seconds
from symdyn.model.joints import Free, Revolute, Universal
from symdyn.model.symbols import coordinates, parameters
from symdyn.model.system import System
from symdyn.pipeline import emit
from symdyn.systems import get
from symdyn.tape.evaluate import evaluate
from symdyn.timing.loops import best_times, compiled_loop

SIZES = (10, 50, 100, 200, 500, 1000)
# Straight-line code is measured up to so many bodies: its compilation takes minutes beyond.
LONGEST_STRAIGHT = 100
DIGITS = 40
# Bounds: seconds of processor time to derive and to compile the largest size, time of an evaluation with loops by that of
# straight-line code, and the number of bodies at which these are compared.
DERIVE, COMPILE, SLOWER, COMPARED = 2.0, 2.0, 1.3, 50
HEADING = (f"{'system':>18} {'n':>5} {'code':9}{'operations':>11}{'statements':>11}{'derive s':>10}{'C bytes':>10}"
           f"{'compile s':>11}{'evaluation us':>15}{'error':>10}")


@dataclass(frozen=True)
class Rolled:
    """One size, with loops or straight-line: operations of x_dot, statements that are written, seconds of processor time to
    describe, derive and emit, bytes of C, seconds to compile and to evaluate once, the error against 40 digits."""

    system: str
    n: int
    loops: bool
    operations: int
    statements: int
    derive: float
    size: int
    compile: float
    evaluation: float
    error: float

    def __str__(self) -> str:
        """A line under HEADING."""
        code = "loops" if self.loops else "straight"
        return (f"{self.system:>18} {self.n:>5} {code:9}{self.operations:>11}{self.statements:>11}{self.derive:>10.2f}"
                f"{self.size:>10}{self.compile:>11.2f}{self.evaluation * 1e6:>15.2f}{self.error:>10.1e}")


def cable(n: int) -> System:
    """Links in space on universal joints that bend against springs and dampers."""
    m, length, g, k, d, inertia = parameters("m l g k d I")
    system = System(f"cable_{n}", gravity=[0, 0, -g])
    parent = system.ground
    for i, angles in enumerate(zip(coordinates(f"a1:{n + 1}"), coordinates(f"b1:{n + 1}"), strict=True)):
        link = system.add_body(f"link{i + 1}", mass=m, inertia=[inertia / 100, inertia, inertia], com=[length / 2, 0, 0])
        joint = system.add_joint(Universal(f"joint{i + 1}", parent, link, angles, axes=([0, 1, 0], [0, 0, 1]),
                                           parent_point=[length if i else 0, 0, 0]))
        system.add_joint_force(joint, [-k * angle - d * angle.dot for angle in angles])
        parent = link
    system.defaults = {m: 0.1, length: 0.1, g: 9.81, k: 1.0, d: 0.01, inertia: 1e-4}
    return system


def legs(n: int) -> System:
    """A trunk that floats, on n legs of three links each: the hip turns about x, then all about y."""
    g, mass, inertia = parameters("g M I")
    system = System(f"legs_{n}", gravity=[0, 0, -g])
    trunk = system.add_body("trunk", mass=mass, inertia=[inertia, 2 * inertia, 3 * inertia])
    system.add_joint(Free("float", system.ground, trunk))
    system.defaults = {g: 9.81, mass: 10.0, inertia: 0.2}
    for k in range(n):
        parent, hip = trunk, parameters(f"x{k + 1} y{k + 1}")
        system.defaults |= dict(zip(hip, (0.3 - 0.2 * k, 0.2 + 0.1 * k), strict=True))
        at: list[Any] = [*hip, 0]
        for j, axis in enumerate(([1, 0, 0], [0, 1, 0], [0, 1, 0])):
            m, c, i = parameters(" ".join(f"{letter}{k + 1}_{j + 1}" for letter in "mcJ"))
            q, = coordinates(f"q{k + 1}_{j + 1},")
            link = system.add_body(f"leg{k + 1}_{j + 1}", mass=m, inertia=[i, i, i / 10], com=[0, 0, -c])
            system.add_joint(Revolute(f"joint{k + 1}_{j + 1}", parent, link, q, axis=axis, parent_point=at))
            system.defaults |= {m: 1.0, c: 0.15, i: 0.01}
            parent, at = link, [0, 0, -0.3]
    return system


SYSTEMS: dict[str, Callable[[int], System]] = {
    "n_link_pendulum": lambda n: get("n_link_pendulum", n=n), "spatial_chain": lambda n: get("spatial_chain", n=n),
    "cable": cable, "legs": legs}
# The number of legs does not grow.
LEGS = (4,)


def measure(name: str, n: int) -> list[Rolled]:
    """One system with loops, and straight-line where that compiles in reasonable time; evaluations are timed side by side."""
    begun = clock.process_time()
    equations = choose(SYSTEMS[name](n).check(), formulation="recursive")
    source = emit(equations, "c", ("rhs",), standalone=False, integrator=False, rolled=True)
    seconds = clock.process_time() - begun
    made = [(True, seconds, source)]
    if n <= LONGEST_STRAIGHT:
        begun = clock.process_time()
        straight = emit(equations, "c", ("rhs",), standalone=False, integrator=False, rolled=False)
        made.append((False, seconds + clock.process_time() - begun, straight))
    loops = [compiled_loop(equations, rolled=rolled) for rolled, *_ in made]
    times = best_times([loop.run for loop in loops], 40)
    tape = function_tape(equations, "rhs")
    names = source.metadata
    x = 0.1 + 0.01 * np.arange(len(names.x))
    values = dict(zip((*names.q, *names.u), x.tolist(), strict=True)) | {
        p: 0.5 + 0.01 * k if v is None else v for k, (p, v) in enumerate(zip(names.parameters, names.defaults, strict=True))}
    exact = evaluate(tape, values, DIGITS)["rhs"].ravel()
    largest = max(abs(e) for e in exact)
    rows = []
    for (rolled, derive, text), loop, time in zip(made, loops, times, strict=True):
        result = loop.evaluator.one(0.0, x).ravel()
        function, code = text.program.functions[0], next(iter(text.files.values()))
        error = float(max(abs(e - f) for e, f in zip(exact, result.tolist(), strict=True)) / largest)
        statements = function.written if function.loops else function.count
        rows.append(Rolled(name, n, rolled, tape.operations, statements, derive, len(code), compile_seconds(code), time, error))
    return rows


def figures(rows: Sequence[Rolled]) -> Iterator[Figure]:
    """Times of the largest mechanism of each kind, and of loops compared with straight-line code, with their bounds."""
    for name in dict.fromkeys(row.system for row in rows):
        own = [row for row in rows if row.system == name]
        last = max((row for row in own if row.loops), key=lambda row: row.n)
        yield f"{name}({last.n}): derive and emit", last.derive, "s", f"<= {DERIVE:g}"
        yield f"{name}({last.n}): compile", last.compile, "s", f"<= {COMPILE:g}"
        times = {row.loops: row.evaluation for row in own if row.n == (last.n if name == "legs" else COMPARED)}
        if len(times) == 2:
            yield f"{name}: evaluation with loops / straight-line", times[True] / times[False], "", f"<= {SLOWER:g}"


def picture(rows: Sequence[Rolled], path: Path) -> None:
    """Six panels over the number of bodies, with loops and straight-line."""
    from symdyn.pictures.figure import Picture

    figure = Picture(figsize=(13, 7.5), layout="constrained")
    panels: tuple[tuple[str, Callable[[Rolled], float]], ...] = (
        ("operations of the right-hand side", lambda r: r.operations), ("statements that are written", lambda r: r.statements),
        ("bytes of C, names and numbers included", lambda r: r.size), ("compile, s", lambda r: r.compile),
        ("one evaluation, µs", lambda r: r.evaluation * 1e6), ("largest error of an evaluation, relative", lambda r: r.error))
    names = list(dict.fromkeys(r.system for r in rows if r.system != "legs"))
    for axes, (title, value) in zip(figure.subplots(2, 3).ravel(), panels, strict=True):
        for k, name in enumerate(names):
            for loops, line in ((True, "o-"), (False, "x:")):
                own = [r for r in rows if r.system == name and r.loops is loops]
                axes.loglog([r.n for r in own], [value(r) for r in own], line, color=f"C{k}",
                            label=f"{name}, {'loops' if loops else 'straight-line'}")
        axes.set_title(title, fontsize=10)
        axes.grid(True, which="major", alpha=0.3)
    figure.axes[0].legend(fontsize=8, loc="lower right")
    figure.supxlabel("bodies")
    figure.savefig(path, dpi=120)


def run(names: Sequence[str] = (), sizes: Sequence[int] = SIZES, folder: Path | None = None) -> int:
    """Print the table, write rolled.json and rolled.png into the folder (default: generated/rolled); returns the number of
    times that miss their bound.

    names   some of SYSTEMS; the legs are always LEGS
    Raises ArgumentError for a name that is not there and unless sizes are numbers of bodies.
    """
    unknown = [name for name in names if name not in SYSTEMS]
    if unknown or any(n < 1 for n in sizes):
        raise ArgumentError(f"rolled takes names among {', '.join(SYSTEMS)}, and numbers of bodies, 1 or more; found "
                            f"{' '.join(map(str, [*unknown, *(n for n in sizes if n < 1)]))}")
    folder = folder or Path("generated") / "rolled"
    rows: list[Rolled] = []
    print(HEADING)
    for name in names or SYSTEMS:
        for n in LEGS if name == "legs" else sizes:
            for row in measure(name, n):
                rows.append(row)
                print(row, flush=True)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "rolled.json").write_text(json.dumps([asdict(r) for r in rows], indent=1), encoding="utf-8")
    picture(rows, folder / "rolled.png")
    print(f"wrote {folder / 'rolled.json'}\nwrote {folder / 'rolled.png'}")
    return print_figures([lambda: figures(rows)])
