"""Many motions on a GPU compared with the processor: `symdyn bench gpu`.

Without a GPU the kernels are compiled for one, and what they take of it is printed.
"""

from __future__ import annotations

import re
import time as clock
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

import symdyn as sd
from symdyn.backend.right_side import RightSide
from symdyn.errors import ArgumentError
from symdyn.lab.figures import Figure, print_figures
from symdyn.runtime.gpu import compiling, device
from symdyn.runtime.module import Module

ARCHITECTURE = "sm_90"
COUNT = 1_000_000
# So many motions are integrated on the processor, too: for the time of one, and to be compared with.
COMPARED = 2_000
TOLERANCE = 1e-8
# Double pendulums are chaotic from some energy on; from these starts no motion magnifies rounding beyond the bound.
CASES = {"double_pendulum": (0.5, 10.0), "spatial_chain": (0.2, 1.0), "four_bar": (0.0, 1.0)}


def double_pendulum() -> Iterator[Figure]:
    """Two hinged rods."""
    return _figures("double_pendulum")


def spatial_chain() -> Iterator[Figure]:
    """Seven links in space."""
    return _figures("spatial_chain")


def four_bar() -> Iterator[Figure]:
    """A loop, projected after every step."""
    return _figures("four_bar")


GROUPS = (double_pendulum, spatial_chain, four_bar)


def run(only: Sequence[str] | None = None) -> int:
    """Print the figures, or those of some mechanisms; returns the number of those that miss their bound."""
    return print_figures(GROUPS, only)


def _figures(name: str) -> Iterator[Figure]:
    module = sd.systems.get(name).compile(backend="c")
    unit: Any = module.unit(RightSide(threads=True))
    begun = clock.perf_counter()
    compiling.cubin(unit.source, name, ARCHITECTURE)
    yield f"{name}: compiling the kernel, or finding it in the cache", clock.perf_counter() - begun, "s", ""
    for what, value in _resources(unit.source, name).items():
        yield f"{name}: {what} of a thread, for {ARCHITECTURE}", value, "", ""
    try:
        device.open_device(0, name).close()
    except ArgumentError as error:
        yield f"{name}: no times: {str(error).partition(', but ')[2].partition(' that')[0]}", np.nan, "", ""
        return
    yield from _compared(module, unit, name)


def _resources(text: str, name: str) -> dict[str, float]:
    """Registers, and bytes of the stack, that the compiler reports of the kernel."""
    log = compiling.report(text, name, ARCHITECTURE)
    kernel = log.partition("_motions' for")[2]
    found = {"registers": r"Used (\d+) registers", "bytes of stack": r"(\d+) bytes stack frame",
             "bytes of spilled registers": r"(\d+) bytes spill stores"}
    return {what: float(match[1]) if (match := re.search(pattern, kernel)) else np.nan for what, pattern in found.items()}


def _compared(module: Module, unit: Any, name: str) -> Iterator[Figure]:
    """Times of motions from random starts compared with those of one core, and how far results are from the processor's."""
    (angle, end), count = CASES[name], COUNT
    rng = np.random.default_rng(6)
    q, u = module.consistent()
    starts = q + angle * rng.uniform(-1, 1, (count, len(q)))
    speeds = u * rng.uniform(0.5, 1, (count, 1))
    module.simulate_batch(starts[:1000], speeds[:1000], t=(0, end), rtol=TOLERANCE, device="gpu")
    begun = clock.perf_counter()
    there = module.simulate_batch(starts, speeds, t=(0, end), rtol=TOLERANCE, device="gpu")
    seconds = clock.perf_counter() - begun
    here = module.simulate_batch(starts[:COMPARED], speeds[:COMPARED], t=(0, end), rtol=TOLERANCE)
    off = np.abs(there.x[:COMPARED] - here.x).max() / np.abs(here.x).max()
    yield f"{name}: {count} motions for {end} s, copies included", seconds, "s", "<= 1" if name == "double_pendulum" else ""
    yield f"{name}: times as fast as one core", here.seconds / COMPARED / (seconds / count), "x", ">= 100"
    yield f"{name}: from the processor's results", off, "", "<= 1e-12"
    # Stages of steps; each is one right-hand side and the sums of its stage.
    evaluations = 12.0 * float(there.n_steps.sum() + there.n_rejected.sum())
    yield f"{name}: right-hand sides", evaluations / seconds, "1/s", ""
    yield f"{name}: their operations", evaluations * unit.metadata.operations["rhs"] / seconds, "1/s", ""
    yield f"{name}: bytes copied", float(starts.nbytes + speeds.nbytes + there.x.nbytes) / seconds, "1/s", ""
