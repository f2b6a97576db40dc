"""`symdyn bench figures`: the figures of the pipeline, each compared with what it should be."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
import time as clock
from collections.abc import Iterator, Sequence

import numpy as np

import symdyn as sd
from symdyn.formulation.equations import Equations
from symdyn.functions.tapes import function_tape
from symdyn.lab.figures import Figure, print_figures
from symdyn.lab.particles import fekete
from symdyn.pipeline import emit
from symdyn.runtime.building import cache
from symdyn.timing.loops import compile_time, evaluation_time


def chain() -> Iterator[Figure]:
    """Seven-link spatial chain, every parameter symbolic."""
    sd.systems.get("spatial_chain", n=2).equations()
    best = np.inf
    for _ in range(3):
        begun = clock.perf_counter()
        equations = sd.systems.get("spatial_chain", n=7).equations()
        emit(equations, "c", ("rhs",), standalone=False)
        best = min(best, clock.perf_counter() - begun)
    tape = function_tape(equations, "rhs")
    yield "spatial_chain(7): describe, derive the candidates and emit", best, "s", "< 0.4"
    yield "spatial_chain(7): compile", compile_time(equations), "s", "< 1.0"
    yield "spatial_chain(7): operations of the right-hand side", tape.operations, "", "<= 1400"
    yield "spatial_chain(7): operations of the prologue", sum(tape.count_prologue().values()), "", ""
    yield "spatial_chain(7): longest chain of operations", tape.longest_chain(), "", ""
    yield "spatial_chain(7): one compiled evaluation", evaluation_time(equations) * 1e6, "us", "< 0.35"


# Seconds that gcc 12 took for a right-hand side with its integrator when both were one translation unit, on two idle cores. The
# bound is half of these; the longest have bounds of their own.
ONE_UNIT = {"double_pendulum": 0.24, "spatial_chain": 0.52, "four_bar": 0.71, "andrews_squeezer": 1.22, "double_wishbone": 1.27,
            "n_four_bar(17)": 2.6}
LONGEST = {"n_four_bar(40)": 4.0, "fekete": 4.0}


def compilation() -> Iterator[Figure]:
    """Compilation of right-hand sides with their integrators: nothing cached, then with what other mechanisms share cached."""
    bounds = {**{name: seconds / 2 for name, seconds in ONE_UNIT.items()}, **LONGEST}
    for name, bound in bounds.items():
        system, _, n = name.removesuffix(")").partition("(")
        described = fekete() if system == "fekete" else sd.systems.get(system, **({"n": int(n)} if n else {}))
        equations = described.equations()
        with tempfile.TemporaryDirectory() as folder, _cached_in(folder):
            # The best of three, but for those that take long.
            runs = [_first_and_second(equations) for _ in range(1 if n else 3)]
        cold, shared = (min(times) for times in zip(*runs, strict=True))
        if name in ONE_UNIT:
            yield f"{name}: compiled as one unit by gcc 12, as noted then", ONE_UNIT[name], "s", ""
        yield f"{name}: compile, nothing cached", cold, "s", f"< {bound:g}"
        yield f"{name}: compile, the integrator cached", shared, "s", f"< {cold:.3g}"


def _first_and_second(equations: Equations) -> tuple[float, float]:
    """Seconds for a right-hand side: nothing cached, and after another mechanism of the same sizes."""
    for path in cache.cache_dir().iterdir():
        path.unlink()
    return compile_time(equations, 1), compile_time(equations, 1)


@contextlib.contextmanager
def _cached_in(folder: str) -> Iterator[None]:
    before = os.environ.get("SYMDYN_CACHE_DIR")
    os.environ["SYMDYN_CACHE_DIR"] = folder
    try:
        yield
    finally:
        os.environ.pop("SYMDYN_CACHE_DIR")
        if before is not None:
            os.environ["SYMDYN_CACHE_DIR"] = before


def long_chain() -> Iterator[Figure]:
    """A hundred links, by articulated bodies."""
    begun = clock.perf_counter()
    equations = sd.systems.get("spatial_chain", n=100).equations()
    emit(equations, "c", ("rhs",), standalone=False)
    yield "spatial_chain(100): describe, derive and emit", clock.perf_counter() - begun, "s", "< 10"
    yield "spatial_chain(100): operations of the right-hand side", function_tape(equations, "rhs").operations, "", ""


def pendulum() -> Iterator[Figure]:
    """Double pendulum of uniform rods, 10 s, rtol = atol = 1e-9."""
    module = sd.systems.get("double_pendulum").embedding().compile(backend="c")
    runs = [module.simulate(t=(0, 10), q=[0, 0.1], u=[0, 0], rtol=1e-9) for _ in range(20)]
    yield "double_pendulum: 10 s inside the integrator", min(r.integrator_seconds or r.seconds for r in runs) * 1e3, "ms", "< 1"
    yield "double_pendulum: energy error over these 10 s", runs[0].energy_error(), "", ""
    x, best = np.array([0.1, 0.2, 0.3, 0.4]), np.inf
    for _ in range(10):
        begun = clock.perf_counter()
        for _ in range(20_000):
            module.rhs(0.0, x)
        best = min(best, (clock.perf_counter() - begun) / 20_000)
    yield "double_pendulum: module.rhs called from Python", best * 1e6, "us", "< 2"
    yield "cart_pole: module.rhs called from Python with an input", _call_with_input() * 1e6, "us", "< 2"


def _call_with_input() -> float:
    module = sd.systems.get("cart_pole").embedding().compile(backend="c")
    x, given, best = np.array([0.1, 0.2, 0.3, 0.4]), np.array([1.0]), np.inf
    for _ in range(10):
        begun = clock.perf_counter()
        for _ in range(20_000):
            module.rhs(0.0, x, None, given)
        best = min(best, (clock.perf_counter() - begun) / 20_000)
    return best


def puma() -> Iterator[Figure]:
    """PUMA 560 moving freely."""
    module = sd.systems.get("puma560").embedding().compile(backend="c")
    solution = module.simulate(t=(0, 10), rtol=1e-11)
    yield "puma560: energy error over 10 s of free motion, rtol 1e-11", solution.energy_error(), "", "<= 1e-10"


def stabilization() -> Iterator[Figure]:
    """Cost of Baumgarte's method with the gain that is chosen, and the violations that it leaves: a pendulum in x and y, 10 s,
    rtol = atol."""
    module = sd.systems.get("pendulum_absolute").augmented().compile(backend="c")
    for method, rtol in (("dop853", 1e-6), ("dop853", 1e-9), ("RK45", 1e-6), ("LSODA", 1e-6), ("LSODA", 1e-9)):
        without, kept = (module.simulate((0, 10), rtol=rtol, atol=rtol, method=method, stabilization=way)
                         for way in ("none", "baumgarte"))
        what = f"Baumgarte, {method}, rtol {rtol:g}"
        yield f"{what}: steps over those without", kept.n_steps / without.n_steps, "", "<= 1.25"
        yield f"{what}: violation over rtol", float(np.abs(kept.constraint_violation).max()) / rtol, "", "<= 20"


def start_up() -> Iterator[Figure]:
    """Whole commands in new processes, nothing cached and then again."""
    def seconds(code: str) -> float:
        times = []
        for _ in range(5):
            begun = clock.perf_counter()
            subprocess.run([sys.executable, "-c", code], check=True)
            times.append(clock.perf_counter() - begun)
        return min(times)

    yield "import symdyn / import sympy", seconds("import symdyn") / seconds("import sympy"), "", "< 1.3"
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "SYMDYN_CACHE_DIR": f"{folder}/cache"}
        for what, limit in (("first", "< 4"), ("second", "< 2")):
            begun = clock.perf_counter()
            subprocess.run([sys.executable, "-m", "symdyn", "simulate", "double_pendulum", "--output",
                            f"{folder}/{what}"], env=environment, check=True, stdout=subprocess.DEVNULL)
            yield f"symdyn simulate double_pendulum, {what} time", clock.perf_counter() - begun, "s", limit


GROUPS = (chain, compilation, long_chain, pendulum, puma, stabilization, start_up)


def run(only: Sequence[str] | None = None) -> int:
    """Print the figures, or those of some groups; returns the number of those that miss their bound."""
    return print_figures(GROUPS, only)
