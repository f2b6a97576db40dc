"""Many motions on a GPU compared with the processor: `symdyn bench gpu`.

Without a GPU the kernels are compiled for one, and what they take of it is printed.
"""

from __future__ import annotations

import re
import time as clock
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

import symdyn as sd
from symdyn.backend.right_side import RightSide
from symdyn.errors import ArgumentError
from symdyn.lab.figures import Figure, print_figures
from symdyn.runtime.batches.precision import PRECISIONS
from symdyn.runtime.gpu import compiling, device
from symdyn.runtime.gpu.dlpack import DeviceArray
from symdyn.runtime.module import Module

ARCHITECTURE = "sm_90"
COUNT = 1_000_000
# Number of motions integrated on the processor, too: for the time of one, and to be compared with.
COMPARED = 2_000
TOLERANCE = 1e-8
# Threads that an H200 can hold: of each multiprocessor, and their number. For all of them the driver sets stacks aside.
RESIDENT = 2048 * 132
# Operations and bytes a second of an H200 by its data sheet, sums and products counted apart, and no tensor units.
OPERATIONS, BYTES = {"double": 34e12, "single": 67e12}, 4.8e12
# Evaluations a second that right-hand sides of seven links in space are to reach.
GOALS = {"double": ">= 1e9", "single": ">= 5e9"}
ROUNDS = 20
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


def right_sides() -> Iterator[Figure]:
    """Right-hand sides of seven links in space, in double and single precision."""
    for precision in PRECISIONS:
        yield from _rates("spatial_chain", precision)


GROUPS = (double_pendulum, spatial_chain, four_bar, right_sides)


def run(only: Sequence[str] | None = None) -> int:
    """Print the figures, or those of some mechanisms; returns the number of those that miss their bound."""
    return print_figures(GROUPS, only)


def _figures(name: str) -> Iterator[Figure]:
    module = sd.systems.get(name).compile(backend="c")
    unit: Any = module.library(RightSide(threads=True))
    begun = clock.perf_counter()
    compiling.cubin(unit.source, name, ARCHITECTURE)
    yield f"{name}: compiling the kernel, or finding it in the cache", clock.perf_counter() - begun, "s", ""
    resources = _resources(unit.source, name)
    for what, value in resources.items():
        yield f"{name}: {what} of a thread, for {ARCHITECTURE}", value, "", ""
    yield f"{name}: memory of an H200 for stacks", _stacks(resources), "B", ""
    try:
        device.open_device(0, name).close()
    except ArgumentError as error:
        yield f"{name}: no times: {str(error).partition(', but ')[2].partition(' that')[0]}", np.nan, "", ""
        return
    yield from _compared(module, unit, name)


def _resources(text: str, name: str, kernel: str = "motions") -> dict[str, float]:
    """Registers, and bytes of the stack, that the compiler reports of a kernel."""
    log = compiling.report(text, name, ARCHITECTURE)
    kernel = log.partition(f"_{kernel}' for")[2]
    result = {"registers": r"Used (\d+) registers", "bytes of stack": r"(\d+) bytes stack frame",
              "bytes of spilled registers": r"(\d+) bytes spill stores"}
    return {what: float(match[1]) if (match := re.search(pattern, kernel)) else np.nan for what, pattern in result.items()}


def _stacks(resources: Mapping[str, float]) -> float:
    """Bytes of an H200's memory that stacks take."""
    return resources["bytes of stack"] * RESIDENT


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


def _rates(name: str, precision: str) -> Iterator[Figure]:
    """Resources of a kernel of right-hand sides, its bounds, and its rate with states that lie on the device."""
    module = sd.systems.get(name).compile(backend="c")
    unit: Any = module.library(RightSide(threads=True, looks=False, integrated=False, single=precision == "single"))
    resources = _resources(unit.source, name, "states")
    for what, value in resources.items():
        yield f"{name} rhs, {precision}: {what} of a thread, for {ARCHITECTURE}", value, "", ""
    yield f"{name} rhs, {precision}: memory of an H200 for stacks", _stacks(resources), "B", ""
    dtype, n_x = np.dtype(PRECISIONS[precision]), module.metadata.sizes.x
    operations, moved = unit.metadata.operations["rhs"], 2 * n_x * dtype.itemsize + 4
    yield f"{name} rhs, {precision}: operations", operations, "", ""
    yield f"{name} rhs, {precision}: bytes read and written", moved, "", ""
    yield f"{name} rhs, {precision}: an H200's bound by operations", OPERATIONS[precision] / operations, "1/s", ""
    yield f"{name} rhs, {precision}: an H200's bound by bytes", BYTES / moved, "1/s", ""
    try:
        there = device.open_device(0, name)
    except ArgumentError:
        return
    x = np.random.default_rng(6).normal(size=(n_x, COUNT)).astype(dtype)
    address, stream = there.allocate(x.nbytes), there.stream()
    there.upload(stream, address, x)
    there.wait(stream)
    states = DeviceArray(address, (COUNT, n_x), dtype, there.where, lambda: there.release(address), lambda: x.T, True)
    out = module.rhs_batch(0.0, states, device="gpu", precision=precision)
    begun = clock.perf_counter()
    for _ in range(ROUNDS):
        module.rhs_batch(0.0, states, out=out, device="gpu", precision=precision)
    rate = ROUNDS * COUNT / (clock.perf_counter() - begun)
    yield f"{name} rhs, {precision}: of states on the device, codes copied", rate, "1/s", GOALS[precision]
