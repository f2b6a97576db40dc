"""Integrates many motions on a GPU, by the kernel that the C of a mechanism is, too."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.right_side import METHOD, RightSide
from symdyn.errors import ArgumentError
from symdyn.runtime.batches.solution import BatchSolution
from symdyn.runtime.batches.starts import projects
from symdyn.runtime.batches.together import Asked, Together
from symdyn.runtime.gpu import device as devices
from symdyn.runtime.gpu.motions import MOST_STEPS, Work, integrate
from symdyn.runtime.inputs.inputs import Inputs

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# The methods of kernels.
METHODS = ("dop853", "bs54")


def on_device(module: Module, asked: Asked, number: int, along: Inputs | None, options: Mapping[str, Any], has_events: bool,
              alone: Callable[[np.ndarray], BatchSolution]) -> BatchSolution:
    """Motions on the GPU with this number.

    along      inputs over time
    options    of `simulate`, those that differ from the defaults
    alone      integrates some of the motions, by their numbers, on the processor
    Raises ArgumentError for what kernels cannot do, and where there is no such device; MissingExtra.
    """
    method = options.get("method", METHOD)
    demand_fit(module, method, along, options, has_events)
    device = devices.open_device(number, module.name)
    try:
        unit: Any = module.unit(RightSide(method=method, threads=True))
        kernel = device.kernel(unit.source, module.name, f"{unit.metadata.name}_motions")
        motions = Together(module, asked)
        pieces, stops = (None, np.zeros(0)) if along is None else (along.pieces, np.sort(along.stops(asked.span)))
        work = Work(motions.starts, asked.inputs, motions.params, motions.lengths, motions.span, asked.atol, asked.times,
                    projects(module), pieces, stops, motions.x, motions.states, motions.reports)
        interrupted, note = False, ""
        try:
            note = integrate(device, kernel, work, module.name)
        except KeyboardInterrupt:
            interrupted = True
        return motions.solution(unit, device.at_once(kernel), note, interrupted, MOST_STEPS, alone)
    finally:
        device.close()


def demand_fit(module: Module, method: Any, along: Inputs | None, options: Mapping[str, Any], has_events: bool) -> None:
    """Raises ArgumentError with all that keeps motions from being integrated by a kernel; the arguments as above."""
    faults = []
    if module.backend != "c":
        faults.append(f"the backend of the module is {module.backend}; kernels are made of its C, compile(backend='c')")
    if module.metadata.contacts:
        faults.append("the mechanism has rigid contacts, whose modes change in Python")
    if has_events:
        faults.append("events are looked for; pass events=False where their times do not matter")
    if not module.metadata.sizes.x:
        faults.append("the mechanism has no state")
    if method not in METHODS:
        faults.append(f"method={method!r}; kernels integrate by {' or '.join(map(repr, METHODS))}")
    others = [name for name in ("max_steps", "stabilization", "sensitivities") if name in options]
    if others:
        faults.append(f"{', '.join(others)}: kernels have none of these")
    if along is not None and (along.function is not None or along.samplers):
        faults.append("inputs by functions of Python or controllers; give tables, splines or numbers")
    if faults:
        raise ArgumentError(f"{module.name}: device='gpu' does not take these motions: {'; '.join(faults)}. Leave device out to "
                            "compute on the processor")
