"""Times compiled evaluations of right-hand sides, in C loops in which each evaluation waits for the one before."""

from __future__ import annotations

import ctypes
import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.formulation.equations import Equations
from symdyn.pipeline import emit
from symdyn.runtime.building import cache
from symdyn.runtime.building.compiler import require_compiler
from symdyn.runtime.building.library import CLibrary

if TYPE_CHECKING:
    from symdyn.given import Rolling

# One timing takes about this long: long enough for the clock, short enough to fall between interruptions.
TIMING_SECONDS = 2e-3
_LOOP = """
SYMDYN_EXPORT void {name}_loop(long n, long fed, {name}_frame *frame, double *x);
SYMDYN_EXPORT void {name}_loop(long n, long fed, {name}_frame *frame, double *x)
{{
    const double start = x[fed];
    for (long i = 0; i < n; i++) {{
        {name}_{function}({call});
        x[fed] = start + 1e-9 * frame->out[{last}];
    }}
    x[fed] = start;
}}
"""


@dataclass(frozen=True)
class Loop:
    """A compiled function in a loop.

    evaluator   its buffers: x (n_x,) the state, out (n_x,) the result
    fed         index of the entry of x that carries the result of an evaluation on to the next, so that latency counts
    """

    evaluator: Any
    function: Any
    fed: int

    def run(self, n: int) -> None:
        """n evaluations, one after the other."""
        self.function(ctypes.c_long(n), ctypes.c_long(self.fed), ctypes.byref(self.evaluator.frame),
                      ctypes.c_void_p(self.evaluator.x.ctypes.data))


def compiled_loop(equations: Equations, x: np.ndarray | None = None, fed: int = 0, name: str = "rhs",
                  last: int | None = None, rolled: Rolling = "auto") -> Loop:
    """The right-hand side at the state x (default: small numbers), parameters at their defaults, 0.5 and more without one.

    name   of another function whose result begins with x_dot
    last   the entry of the result that the next evaluation depends on; default: the last of x_dot
    rolled   whether statements that are repeated become loops
    """
    source = emit(equations, "c", (name,), standalone=False, integrator=False, rolled=rolled)
    metadata = source.metadata
    function = source.program.functions[0]
    sizes = metadata.sizes
    places = {"t": "frame->t[0]", "q": "x", "u": f"x + {sizes.q}", "z": f"x + {sizes.q + sizes.u}",
              "inputs": "frame->inputs", "p": "frame->p", "c": "frame->c"}
    call = ", ".join([*[places[g] for g in function.arguments], "frame->out"])
    text = next(iter(source.files.values())) + _LOOP.format(
        name=metadata.name, function=name, call=call, last=sizes.x - 1 if last is None else last)
    library = CLibrary(text, metadata, require_compiler())
    evaluator = library.evaluator(name)
    evaluator.set_params(np.array([0.5 + 0.01 * k if v is None else v for k, v in enumerate(metadata.defaults)]))
    evaluator.x[:] = 0.1 + 0.01 * np.arange(sizes.x) if x is None else x
    return Loop(evaluator, library.function("loop"), fed)


def best_times(runs: Sequence[Callable[[int], None]], repeats: int, loops: int | None = None) -> list[float]:
    """Seconds of one evaluation of each `run(n)`, the best of several timings.

    They take turns, so that what else the machine does hits all alike.
    loops   evaluations in one timing; default: as many as take TIMING_SECONDS
    """
    counts = [_enough(run) if loops is None else loops for run in runs]
    best = [np.inf] * len(runs)
    for _ in range(repeats):
        for k, (run, n) in enumerate(zip(runs, counts, strict=True)):
            best[k] = min(best[k], _seconds(run, n) / n)
    return [float(time) for time in best]


def evaluation_times(equations: Sequence[Equations], repeats: int = 30) -> list[float]:
    """Seconds of one evaluation of each right-hand side, measured side by side."""
    return best_times([compiled_loop(e).run for e in equations], repeats)


def evaluation_time(equations: Equations, loops: int = 20_000, repeats: int = 30) -> float:
    """Seconds of one evaluation, the best of several loops; q[0] of each depends on the result before, so latency counts."""
    return best_times([compiled_loop(equations).run], repeats, loops)[0]


def _enough(run: Callable[[int], None]) -> int:
    """Evaluations that take TIMING_SECONDS; of several tries, so that an interruption does not make them too few."""
    n = 16
    while (seconds := min(_seconds(run, n) for _ in range(5))) < TIMING_SECONDS / 4:
        n *= 2
    return max(1, round(n * TIMING_SECONDS / seconds))


def _seconds(run: Callable[[int], None], n: int) -> float:
    begun = clock.perf_counter()
    run(n)
    return clock.perf_counter() - begun


def compile_time(equations: Equations, runs: int = 3) -> float:
    """Seconds that the compiler takes for a right-hand side with its integrator, the mechanism's own code not cached; the best of
    some runs."""
    source = emit(equations, "c", ("rhs",), standalone=False)
    best = np.inf
    for _ in range(runs):
        text = next(iter(source.files.values())) + f"// measured at {clock.time_ns()}\n"
        begun = clock.perf_counter()
        cache.discard(cache.build(text, f"{source.metadata.name}-bench", require_compiler()))
        best = min(best, clock.perf_counter() - begun)
    return float(best)
