"""Many states and motions at once compared with one after the other, states with Pinocchio, too: `symdyn bench batch`.

All figures of one line come from one run; the programs take turns, and of each the best timing counts.
"""

from __future__ import annotations

import ctypes
import re
import subprocess
import tempfile
import time as clock
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import symdyn as sd
from symdyn.emission import emit
from symdyn.errors import SimulationWarning, SymdynError
from symdyn.formulation.equations import Equations
from symdyn.lab.figures import Figure, print_figures
from symdyn.lab.peers.benchmark import random_state
from symdyn.lab.peers.description import describe
from symdyn.lab.peers.pinocchio_peer import PinocchioPeer
from symdyn.lab.peers.symdyn_peer import symdyn_program
from symdyn.runtime.batches.states import LIBRARY, tables_of
from symdyn.runtime.building.compiler import flags, require_compiler
from symdyn.runtime.building.library import Frame
from symdyn.runtime.module import Module
from symdyn.timing.loops import best_times

STATES = 2000
ARITHMETIC = re.compile(r"\s*v(add|sub|mul|div|sqrt|fn?m)\w*")
REPEATS = 100
PENDULUMS = 10_000
SINGLE = 200
# The best timing of each piece counts, as of each of those that are alone.
PIECES = 50
ROUNDS = 5
FEW = 10
DIFFERENTIATED: tuple[tuple[str, dict[str, int], tuple[int, ...]], ...] = (
    ("double_pendulum", {}, (1, 4, 12)), ("n_link_pendulum", {"n": 5}, (1, 8, 16)), ("spatial_chain", {"n": 7}, (1, 8, 60)))
LOOPS = ("four_bar", "andrews_squeezer", "double_wishbone", "rolling_disc")


def chain() -> Iterator[Figure]:
    """The right-hand side of seven links: states in one call, their entries side by side."""
    system = sd.systems.get("spatial_chain", n=7)
    equations = system.equations()
    module = equations.compile(backend="c")
    x = np.random.default_rng(3).uniform(-1, 1, (module.metadata.sizes.x, STATES)).T
    rows = np.ascontiguousarray(x)
    same = bool((module.rhs_batch(0.0, x) == module.evaluate("rhs", 0.0, rows)).all())
    state = random_state(equations)

    def many(f: Callable[[], Any]) -> Callable[[int], None]:
        def run(n: int) -> None:
            for _ in range(n):
                f()

        return run

    batch_out, out = np.empty(x.shape[::-1]).T, np.empty(rows.shape)
    at_once = _direct(module, x, batch_out)
    evaluator: Any = module.library("rhs").evaluator("rhs")
    evaluator.set_params(module.parameters())
    given = (evaluator.t, rows, evaluator.ud, evaluator.inputs, evaluator.p, evaluator.c, out)
    frame = Frame(STATES, *[a.ctypes.data for a in given], 0, 1, 0, 0, 0)
    runs = [many(at_once), many(lambda: evaluator.call(ctypes.byref(frame))), symdyn_program(equations, state).run,
            many(lambda: module.rhs_batch(0.0, x, out=batch_out))]
    try:
        runs.append(PinocchioPeer().program(describe(system.check()), state).run)
    except SymdynError as error:
        yield f"Pinocchio is left out: {str(error).splitlines()[0]}", np.nan, "", ""
    times = best_times(runs, REPEATS)
    batch, one = times[0] / STATES, times[1] / STATES
    yield "spatial_chain(7): states at once", module.batch_width, "", ""
    yield "spatial_chain(7): a state among many", batch * 1e9, "ns", ""
    yield "spatial_chain(7): a state, one after the other", one * 1e9, "ns", ""
    yield "spatial_chain(7): many at once are quicker by", one / batch, "x", ">= 5"
    yield "spatial_chain(7): than where each waits for the one before", times[2] / batch, "x", ""
    yield "spatial_chain(7): a state among many, called from Python", times[3] / STATES * 1e9, "ns", ""
    if len(times) > 4:
        yield "spatial_chain(7): Pinocchio's ABA in C++", times[4] * 1e9, "ns", ""
        yield "spatial_chain(7): many at once are quicker than Pinocchio by", times[4] / batch, "x", ">= 25"
    yield "spatial_chain(7): the bits of one state", float(same), "", ">= 1"
    for what, number in stack_traffic(equations).items():
        yield f"spatial_chain(7): {what}", number, "", ""


def stack_traffic(equations: Equations) -> dict[str, int]:
    """Instructions on the widest vectors in the machine code of many right-hand sides, and those that store vectors on the stack
    and load them from there, as registers are too few; none where the compiler writes no assembly of x86 with wide vectors."""
    text = next(iter(emit(equations, "c", ["rhs"], standalone=False, integrator=False, batch=True).files.values()))
    compiler = require_compiler()
    with tempfile.TemporaryDirectory() as folder:
        source, assembly = Path(folder, "batch.c"), Path(folder, "batch.s")
        source.write_text(text, encoding="utf-8")
        options = [o for o in flags(compiler) if o not in ("-shared", "-fPIC")]
        done = subprocess.run([*compiler.command, *options, "-S", "-masm=intel", "-o", str(assembly), str(source)],
                              capture_output=True)
        lines = assembly.read_text(encoding="utf-8").splitlines() if done.returncode == 0 else []
    widest = "zmm" if any("zmm" in line for line in lines) else "ymm"
    wide = [line.split("#")[0] for line in lines if widest in line]
    stack = [line for line in wide if "[rsp" in line or "[rbp" in line]
    stores = [line for line in stack if re.match(r"\s*vmov\w+\s+[A-Z]* ?PTR", line)]
    if not wide:
        return {}
    return {"sums, products and quotients of vectors": sum(bool(ARITHMETIC.match(line)) for line in wide),
            "stores of vectors to the stack": len(stores), "loads of vectors from there": len(stack) - len(stores)}


def _direct(module: Module, x: np.ndarray, out: np.ndarray) -> Callable[[], Any]:
    """The compiled function behind rhs_batch without Python around it, as the others are called."""
    unit: Any = module.library(LIBRARY)
    kept = [np.zeros((1, 1)), x, np.zeros((1, 0)), module.parameters()[None, :], out, np.zeros(len(x), dtype=np.intc)]
    call, tables, steps = unit.function("rhs_batch"), tables_of(kept[:4]), (ctypes.c_long * 2)(1, len(x))
    n, result, codes = ctypes.c_long(len(x)), ctypes.c_void_p(out.ctypes.data), ctypes.c_void_p(kept[5].ctypes.data)
    return lambda: call(n, tables, result, steps, codes) and kept


def pendulums() -> Iterator[Figure]:
    """Double pendulums for 10 s, each with its own steps: all at once, and some of them one after the other."""
    module = sd.systems.get("double_pendulum").embedding().compile(backend="c")
    rng = np.random.default_rng(4)
    q, u, span = rng.uniform(-1.5, 1.5, (PENDULUMS, 2)), rng.uniform(-1, 1, (PENDULUMS, 2)), np.array([0.0, 10.0])
    inside, called, at_once = np.full(SINGLE, np.inf), np.full(SINGLE, np.inf), np.full(PIECES, np.inf)
    same = True
    many = module.simulate_batch(q, u, t=(0, 10), rtol=1e-8)
    for _ in range(ROUNDS):
        for k, (some_q, some_u) in enumerate(zip(np.split(q, PIECES), np.split(u, PIECES))):
            at_once[k] = min(at_once[k], module.simulate_batch(some_q, some_u, t=(0, 10), rtol=1e-8).seconds)
        for k in range(SINGLE):
            begun = clock.perf_counter()
            one = module.simulate(span, q[k], u[k], rtol=1e-8)
            called[k] = min(called[k], clock.perf_counter() - begun)
            inside[k] = min(inside[k], one.integrator_seconds or np.inf)
            same &= bool((one.x[-1] == many.x[k, -1]).all())
    steps = many.n_steps + many.n_rejected
    alone, outer = (times.sum() / steps[:SINGLE].sum() for times in (inside, called))
    among = at_once.sum() / steps.sum()
    yield "double_pendulum: motions that reached 10 s", float(many.success.sum()), "", f">= {PENDULUMS}"
    yield "double_pendulum: a step among many", among * 1e9, "ns", ""
    yield "double_pendulum: a step, one motion after the other", alone * 1e9, "ns", ""
    yield "double_pendulum: many at once are quicker by", alone / among, "x", ">= 4"
    yield "double_pendulum: than simulate() in a loop by", outer / among, "x", ""
    yield "double_pendulum: the bits of one motion", float(same), "", ">= 1"


def loops() -> Iterator[Figure]:
    """Mechanisms with constraints, whose states are projected after every step: all motions at once, and one after the other."""
    for name in LOOPS:
        module = sd.systems.get(name).augmented().compile(backend="c")
        q, u = module.consistent()
        # Speeds of different sizes: a state on the constraints stays there, where these do not move by themselves.
        speeds = u * np.random.default_rng(5).uniform(0.5, 1.5, (SINGLE, 1))
        span = np.array([0.0, module.metadata.duration or 1.0])
        many = module.simulate_batch(q, speeds, t=(span[0], span[1]))
        alone, at_once, same = np.inf, np.inf, True
        for _ in range(ROUNDS):
            begun = clock.perf_counter()
            module.simulate_batch(q, speeds, t=(span[0], span[1]))
            middle = clock.perf_counter()
            ones = [module.simulate(span, q, row) for row in speeds]
            at_once, alone = min(at_once, middle - begun), min(alone, clock.perf_counter() - middle)
            same &= all(bool((one.x[-1] == row[-1]).all()) for one, row in zip(ones, many.x, strict=True))
        inside = sum(one.integrator_seconds or 0.0 for one in ones)
        yield f"{name}: a motion among {SINGLE}", at_once / SINGLE * 1e6, "us", ""
        yield f"{name}: than the integrator of one, these are quicker by", inside / at_once, "x", ""
        yield f"{name}: than simulate() in a loop by", alone / at_once, "x", ""
        yield f"{name}: the bits of one motion", float(same), "", ">= 1"


def sensitivities() -> Iterator[Figure]:
    """Motions with derivatives by few and by many numbers: a motion in each lane, and one after the other, where columns fill the
    lanes. Times of the processor."""
    for name, sizes, counts in DIFFERENTIATED:
        module = sd.systems.get(name, **sizes).compile(backend="c")
        rng, n_q, n_u = np.random.default_rng(6), module.metadata.sizes.q, module.metadata.sizes.u
        q, u, span = rng.uniform(-1, 1, (SINGLE, n_q)), rng.uniform(-1, 1, (SINGLE, n_u)), np.array([0.0, 2.0])
        names = [*[f"{x}(0)" for x in module.metadata.x], *module.metadata.parameters]
        for count in counts:
            by, alone, at_once, same = names[:count], np.full((2, FEW), np.inf), np.inf, True
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", SimulationWarning)
                many = module.simulate_batch(q, u, t=(0, 2), sensitivities=by)
                for _ in range(ROUNDS):
                    begun = clock.process_time()
                    module.simulate_batch(q, u, t=(0, 2), sensitivities=by)
                    at_once = min(at_once, clock.process_time() - begun)
                    for k in range(FEW):
                        begun = clock.process_time()
                        one = module.simulate(span, q[k], u[k], sensitivities=by)
                        seconds = (one.integrator_seconds or np.inf, clock.process_time() - begun)
                        alone[:, k] = np.minimum(alone[:, k], seconds)
                        same &= bool((one.sensitivity.matrix[-1] == many.sensitivity.matrix[k, -1]).all())
            label, among = f"{name} by {count}", at_once / SINGLE
            inside, outer = alone.mean(axis=1)
            yield f"{label}: a motion among {SINGLE}", among * 1e6, "us", ""
            yield f"{label}: than the integrator of one, these are quicker by", inside / among, "x", ">= 1"
            yield f"{label}: than simulate() in a loop by", outer / among, "x", ""
            yield f"{label}: the bits of one motion", float(same), "", ">= 1"


GROUPS = (chain, pendulums, loops, sensitivities)


def run(only: Sequence[str] | None = None) -> int:
    """Print the figures, or those of some groups; returns the number of those that miss their bound."""
    return print_figures(GROUPS, only)
