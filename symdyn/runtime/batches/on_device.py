"""Integrates many motions on a GPU, by the kernel that the C of a mechanism is, too."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.methods import METHODS
from symdyn.backend.right_side import METHOD, RightSide
from symdyn.errors import ArgumentError
from symdyn.runtime.batches.precision import LEAST_RTOL, PRECISIONS
from symdyn.runtime.batches.solution import BatchSolution
from symdyn.runtime.batches.starts import projects
from symdyn.runtime.batches.states_on_device import device_kernel
from symdyn.runtime.batches.together import Asked, Together
from symdyn.runtime.gpu import device as devices
from symdyn.runtime.gpu.arrays import RowsThere
from symdyn.runtime.gpu.dlpack import DeviceArray
from symdyn.runtime.gpu.motions import MOST_STEPS, MotionKernels, Work, integrate
from symdyn.runtime.inputs.inputs import Inputs
from symdyn.runtime.integrating.methods import unfit
from symdyn.runtime.integrating.run_record import STATUS, SingleReport

if TYPE_CHECKING:
    from symdyn.runtime.module import Module



def on_device(module: Module, asked: Asked, number: int, options: Mapping[str, Any],
              alone: Callable[[np.ndarray], BatchSolution], precision: str) -> BatchSolution:
    """Motions on the GPU with this number.

    options    of `simulate`, those that differ from the defaults
    alone      integrates some of the motions, by their numbers, on the processor
    Raises ArgumentError for what kernels cannot do, and where there is no such device; MissingExtra.
    """
    method = options.get("method", METHOD)
    demand_fit(module, method, asked.along, options)
    if precision == "single":
        demand_single(module, method, asked.looks, asked.rtol)
    device = devices.open_device(number, module.name)
    try:
        library: Any = module.library(RightSide(method=method, threads=True, looks=asked.looks,
                                             single=precision == "single"))
        kernels = MotionKernels(*(device_kernel(module, device, library.source, f"{library.metadata.name}_{what}")
                                  for what in ("motions", "motion_size")))
        there, shape = asked.there, (asked.n, len(asked.times), module.metadata.sizes.x)
        motions = Together(module, asked, None if there is None else RowsThere(
            device, shape, np.dtype(PRECISIONS[precision]), module.name))
        work = Work(motions.starts, asked.inputs, motions.params, motions.lengths, motions.span, asked.atol, asked.times,
                    projects(module), motions.pieces, motions.stops, motions.look, asked.event_spacing, motions.taken_after,
                    *_results(motions, precision), motions.doubts, _numbers(module, asked, motions, precision))
        interrupted, note = False, ""
        try:
            note = integrate(device, kernels, work, module.name)
        except KeyboardInterrupt:
            interrupted = True
            if isinstance(motions.x, RowsThere):  # what was not begun
                of = work.reports
                motions.x[np.flatnonzero((of["status"] == STATUS.STEP_LIMIT) & (of["n_steps"] + of["n_rejected"] == 0))] = np.nan
        _take(motions, work)
        return motions.solution(library, device.at_once(kernels.motions), note, interrupted, MOST_STEPS, alone)
    finally:
        device.close()


def _numbers(module: Module, asked: Asked, motions: Together, precision: str) -> dict[int, tuple[int, int]]:
    """Addresses and strides of arrays on the device that the kernel reads, unless a check has replaced them."""
    if asked.there is None:
        return {}
    same = {"x": np.array_equal(motions.starts, asked.starts, equal_nan=True), "inputs": asked.along is None,
            "params": np.array_equal(motions.params, asked.params, equal_nan=True)}
    return asked.there.numbers(module.metadata, np.dtype(PRECISIONS[precision]).itemsize, same)


def _results(motions: Together, precision: str) -> tuple[np.ndarray | DeviceArray, np.ndarray, np.ndarray]:
    """Where states at output times, states of reports, and reports go."""
    if precision == "double":
        return motions.x if isinstance(motions.x, np.ndarray) else motions.x.array, motions.states, motions.reports
    reports = np.zeros(len(motions.reports), dtype=np.dtype(SingleReport))
    reports["status"] = motions.reports["status"]
    x = np.full(motions.x.shape, np.nan, np.float32) if isinstance(motions.x, np.ndarray) else motions.x.array
    return x, np.full(motions.states.shape, np.nan, np.float32), reports


def _take(motions: Together, work: Work) -> None:
    """Results in single precision as doubles."""
    if work.states is not motions.states:
        if isinstance(motions.x, np.ndarray):
            motions.x[:] = work.x
        motions.states[:] = work.states
        for name in motions.reports.dtype.names or ():
            motions.reports[name] = work.reports[name]


def demand_single(module: Module, method: str, looks: bool, rtol: float) -> None:
    """Raises ArgumentError with all that needs double precision."""
    faults = []
    if METHODS[method].tableau is None:
        explicit = " or ".join(repr(name) for name, one in METHODS.items() if one.tableau is not None)
        faults.append(f"method={method!r}, whose equations are solved to rounding; pass {explicit}")
    if module.metadata.constraints:
        faults.append(f"the constraints {', '.join(module.metadata.constraints)}, which are kept to 1e-12")
    if looks:
        faults.append("events, whose times are found to rounding; pass events=False where they do not matter")
    if rtol < LEAST_RTOL:
        faults.append(f"rtol={rtol:g}; pass {LEAST_RTOL:g} or more")
    if faults:
        raise ArgumentError(f"{module.name}: precision='single' does not take {'; '.join(faults)}. Leave precision out for "
                            "doubles")


def demand_fit(module: Module, method: Any, along: Inputs | None, options: Mapping[str, Any]) -> None:
    """Raises ArgumentError with all that keeps motions from being integrated by a kernel; the arguments as above."""
    faults = []
    if module.backend != "c":
        faults.append(f"the backend of the module is {module.backend}; kernels are made of its C, compile(backend='c')")
    if module.metadata.contacts:
        faults.append("the mechanism has rigid contacts, whose modes change in Python")
    if not module.metadata.sizes.x:
        faults.append("the mechanism has no state")
    if method not in METHODS:
        faults.append(f"method={method!r}; kernels integrate by {' or '.join(map(repr, METHODS))}")
    elif module.backend == "c" and (why := unfit(module, method, along)):
        faults.append(f"method={method!r}: {why}")
    others = [name for name in ("max_steps", "stabilization", "sensitivities") if name in options]
    if others:
        faults.append(f"{', '.join(others)}: kernels have none of these")
    if along is not None and not along.by_tables:
        faults.append("inputs by functions of Python or controllers; give tables, splines or numbers")
    if faults:
        raise ArgumentError(f"{module.name}: device='gpu' does not take these motions: {'; '.join(faults)}. Leave device out to "
                            "compute on the processor")
