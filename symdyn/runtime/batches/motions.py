"""Integrates many motions: on the processor's vectors with the C backend, each with its own steps, else one by one."""

from __future__ import annotations

import ctypes
import time as clock
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.c_records import fields_of
from symdyn.backend.methods import METHODS
from symdyn.backend.right_side import METHOD, RightSide
from symdyn.errors import SimulationInterrupted, SimulationWarning, SymdynError
from symdyn.kinds import flag
from symdyn.runtime.batches.arguments import side_by_side, take_rows, together
from symdyn.runtime.batches.arrays_there import take_there
from symdyn.runtime.batches.on_device import on_device
from symdyn.runtime.batches.precision import checked_precision
from symdyn.runtime.batches.sensitivities import Columns
from symdyn.runtime.batches.solution import BatchSensitivity, BatchSolution
from symdyn.runtime.batches.starts import projects
from symdyn.runtime.batches.states import LIBRARY, input_rows, parameter_rows, tables_of, width
from symdyn.runtime.batches.together import LISTED, Asked, Together, warn
from symdyn.runtime.batches.validity import outside
from symdyn.runtime.gpu.device import device_number
from symdyn.runtime.inputs.inputs import Inputs, demand_rest, take_inputs, varies_over_time
from symdyn.runtime.inputs.sampled import check_span
from symdyn.runtime.integrating.charts import locked
from symdyn.runtime.integrating.events import wanted
from symdyn.runtime.integrating.simulate import (
    check_fits,
    checked_method,
    checked_positive,
    checked_spacing,
    checked_times,
    checked_tolerances,
)
from symdyn.runtime.memory import aligned, demand

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Steps of every lane in one call: a fraction of a second, so that Ctrl-C is heard.
PIECE = 5_000
# Where the right-hand side jumps: so many calls in which no motion ends before those under way are looked at for chattering.
PATIENCE = 4
# The methods of motions that are integrated at once: those that are explicit.
IN_LANES = tuple(name for name, method in METHODS.items() if method.tableau is not None)
# Up to so many states and sensitivities a motion takes less time among others than with its own columns in the lanes, if only a
# little where these fill them; above, what the stages of all lanes hold does not fit next to the processor. Measured with 8 lanes
# and 1 MiB for each core.
MOST_ENTRIES = 3500
NO_VECTORS = "the C compiler has no vectors"


class BatchMotions(ctypes.Structure):
    """Arguments and results of motions on vectors; see c/runtime/batch_type.h."""

    _fields_ = fields_of("runtime/batch_type.h")


def simulate_batch(module: Module, q: Any, u: Any, params: Any, *, z: Any, t: Any, inputs: Any, rtol: float, atol: Any,
                   max_step: float, first_step: float, method: Any, max_steps: int | None, stabilization: Any, events: Any,
                   event_spacing: float, interpolation: str, extend: str, sensitivities: Any, sensitivity_control: bool,
                   device: Any, precision: Any) -> BatchSolution:
    """See Module.simulate_batch."""
    metadata = module.metadata
    gpu = device_number(device, module.name)
    precision = checked_precision(precision, gpu is not None, module.name)
    checked_method(module, method)
    there = None
    if gpu is not None:
        given, there = take_there(module, gpu, precision, {"q": q, "u": u, "z": z, "params": params, "inputs": inputs})
        q, u, z, params, inputs = (given[group] for group in ("q", "u", "z", "params", "inputs"))
    chosen = {"method": method, "max_steps": max_steps, "stabilization": stabilization}
    options = {k: v for k, v in chosen.items() if v is not None and not (k == "method" and v == METHOD)}
    controlled = flag(sensitivity_control, f"{module.name}: sensitivity_control")
    initial = metadata.initial
    groups = [take_rows(values, metadata.names(what), f"initial {what}", metadata.initial_values(what), module.name)
              for what, values in (("q", q), ("u", u), ("z", z))]
    by_time = varies_over_time(inputs)
    fixed = input_rows(module, None if by_time else inputs, initial)
    demand_rest(fixed, metadata.inputs, metadata.motions, module.name)
    rows = {"q": groups[0], "u": groups[1], "z": groups[2], "params": parameter_rows(module, params), "inputs": fixed}
    n = together(rows, module.name)
    times, span = _times(module, t)
    along = take_inputs(inputs, metadata.inputs, initial, module.name, span, interpolation, extend,
                        metadata.motions) if by_time else None
    columns = None if sensitivities is None else Columns.of(module, sensitivities, rows["params"], fixed, along, controlled)
    columns = columns if columns is not None and columns.n else None
    n_columns = 0 if columns is None else columns.n
    # The states that are kept, and starts, parameters, inputs and the report of each motion.
    kept = 0 if there is not None else len(times)
    demand(n * (kept * metadata.sizes.x * (1 + 2 * n_columns) + metadata.sizes.x + 12), module.name,
           f"{n} motions with {len(times)} states of {metadata.sizes.x} numbers each", "simulate fewer at a time, or call "
           "sd.ensemble with a path, which keeps results on the disk")
    n_starts = together({"q": groups[0], "u": groups[1], "z": groups[2]}, module.name)
    starts = side_by_side(groups, n_starts)
    if along is not None:  # what does not fit is an error before any motion runs
        check_span(along.samplers, span, module.name)
    if gpu is None:
        check_fits(module, options.get("method"), along)
    asked = Asked(n, starts, rows["params"], fixed, times, span, *checked_tolerances(module, rtol, atol),
                   checked_positive(module, max_step, "max_step"), checked_positive(module, first_step, "first_step"), along,
                   wanted(module, events), checked_spacing(module, event_spacing, span), columns, there)
    note = why_one_by_one(module) or _why_these(along, options) or why_columns_one_by_one(
        module, asked.look, n_columns)
    if columns is not None:
        options |= {"sensitivities": columns.given, "sensitivity_control": controlled}
    over_time = {"interpolation": interpolation, "extend": extend} if by_time else {}
    varying = inputs if by_time else None
    used = np.full((n, len(times), metadata.sizes.inputs), np.nan) if by_time and metadata.validity_checks else fixed
    rest = over_time | {"events": events, "event_spacing": asked.event_spacing}
    if note and gpu is None:
        solution = _one_by_one(module, asked, varying, used, note, options | rest)
    else:
        def alone(which: np.ndarray) -> BatchSolution:
            kept = ("method", "sensitivities", "sensitivity_control")
            return _alone(module, asked, which, varying, {k: v for k, v in options.items() if k in kept} | rest)

        method_or_default = options.get("method", METHOD)
        solution = _on_vectors(module, asked, method_or_default, alone) if gpu is None else on_device(
            module, asked, gpu, options, alone, precision)
        if along is not None and along.pieces is not None and used.ndim == 3:
            used[:] = along.pieces.at(times)
    return _warned(module, asked, solution, used)


def _warned(module: Module, asked: Asked, solution: BatchSolution, given: np.ndarray) -> BatchSolution:
    """The same, after warnings of what failed and of what is not meant. given: inputs, see `outside`."""
    if solution.messages:
        examples = [f"{k}: {message}" for k, message in list(solution.messages.items())[:LISTED]]
        more = f"; and {len(solution.messages) - LISTED} more, see `messages`" if len(solution.messages) > LISTED else ""
        warnings.warn(f"{len(solution.messages)} of {asked.n} motions failed: {'; '.join(examples)}{more}", SimulationWarning,
                      stacklevel=4)
    near = locked(module, asked.times, solution.x, asked.rtol) if module.metadata.charts else []
    left = outside(module, asked.times, solution.x, asked.params, given) if module.metadata.validity_checks else []
    for sentence in left + near:
        warnings.warn(sentence, SimulationWarning, stacklevel=4)
    return solution


def _times(module: Module, t: Any) -> tuple[np.ndarray, tuple[float, float]]:
    times, span, _ = checked_times(module, t, False)
    pair = t is None or (isinstance(t, (tuple, list)) and len(t) == 2)
    return (np.array([span[1]]) if pair else times), span


def why_one_by_one(module: Module) -> str:
    """Why motions of a module are not integrated several at once; "" if they are."""
    metadata = module.metadata
    if module.backend != "c":
        return f"one by one: the backend is {module.backend}"
    if metadata.contacts:
        return "one by one: the mechanism has rigid contacts"
    return "" if metadata.sizes.x else "one by one: the mechanism has no state"


def many_at_once(module: Module, built: bool) -> str:
    """Words for how many states and motions are computed at once; built: whether the code for it is there."""
    if module.backend != "c":
        return f"rhs_batch by broadcasting, simulate_batch {why_one_by_one(module)}"
    lanes = "as many as the processor's vectors have lanes (module.batch_width)"
    if built:
        lanes = f"{width(module)} on the processor's vectors" if width(module) > 1 else f"1, {NO_VECTORS}"
    return f"rhs_batch {lanes}, simulate_batch {why_one_by_one(module) or 'likewise'}"


def _why_these(along: Inputs | None, options: Mapping[str, Any]) -> str:
    if along is not None and not along.by_tables:
        return "one by one: inputs by functions of Python or controllers"
    others = [name for name in options if name != "method" or options[name] not in IN_LANES]
    return f"one by one: asked for with {', '.join(others)}" if others else ""


def why_columns_one_by_one(module: Module, look: np.ndarray, n: int) -> str:
    """Why motions with sensitivities in n columns are not integrated several at once; "" if they are. look: for which events,
    (n_e,) of bool."""
    metadata = module.metadata
    if not n:
        return ""
    # A run of its own needs its steps or its events there to warn of sensitivities.
    if metadata.switches:
        return "one by one: with sensitivities, of a right-hand side that may jump"
    if any(event.reset for event, sought in zip(metadata.events, look, strict=True) if sought):
        return "one by one: with sensitivities, across events that reset states"
    entries = metadata.sizes.x * (1 + n)
    return f"one by one: with {entries} sensitivities and states each, whose columns fill lanes" if entries > MOST_ENTRIES else ""


# -- on vectors


def unit_of(method: str, looks: bool, sensitivities: tuple[str, ...] = ()) -> str | RightSide:
    """Name or right-hand side for which the code of motions in lanes is made; looks: for events."""
    plain = method == METHOD and not looks and not sensitivities
    return LIBRARY if plain else RightSide(method=method, lanes=True, looks=looks, sensitivities=sensitivities)


def _on_vectors(module: Module, asked: Asked, method: str, alone: Callable[[np.ndarray], BatchSolution]) -> BatchSolution:
    library: Any = module.library(unit_of(method, asked.looks, () if asked.columns is None else asked.columns.asked.columns))
    together = Together(module, asked)
    n = asked.n
    size = library.function("batch_size")
    size.restype = ctypes.c_long
    memory = ctypes.create_string_buffer(size() + 64)
    batch = ctypes.c_void_p((ctypes.addressof(memory) + 63) // 64 * 64)
    assert isinstance(together.x, np.ndarray)  # a device has rows of its own
    pieces, stops, looks = together.pieces, together.stops, asked.looks
    tables = tables_of([together.starts, asked.inputs, together.params, together.lengths, together.atol])
    motions = BatchMotions(
        n=n, n_out=len(asked.times),
        **dict(zip(("x", "inputs", "p", "lengths", "tolerances"), map(ctypes.addressof, tables), strict=True)),
        span=together.span.ctypes.data, atol=together.atol.ctypes.data, t_out=asked.times.ctypes.data, n_stops=len(stops),
        stops=stops.ctypes.data, look=together.look.ctypes.data if looks else None, event_spacing=asked.event_spacing,
        events_taken_after=together.taken_after, x_out=together.x.ctypes.data, states=together.states.ctypes.data,
        reports=together.reports.ctypes.data, doubts=together.doubts.ctypes.data)
    if pieces is not None:
        breaks, coefficients = (np.ascontiguousarray(a) for a in (pieces.breaks, pieces.coefficients))
        motions.n_pieces, motions.breaks, motions.pieces = len(coefficients), breaks.ctypes.data, coefficients.ctypes.data
    go = library.function("batch_go")
    go.restype = ctypes.c_long
    interrupted, done, waited = False, 0, 0
    doubtful = bool(module.metadata.switches) or projects(module) or looks
    try:
        library.function("batch_start")(batch, ctypes.byref(motions))
        while (now := go(batch, ctypes.c_long(PIECE))) < n and not (doubtful and waited == PATIENCE):
            done, waited = now, waited + 1 if now == done else 0
    except KeyboardInterrupt:
        interrupted = True
    note = "" if width(module) > 1 else NO_VECTORS
    return together.solution(library, width(module), note, interrupted, PATIENCE * PIECE, alone)


def _alone(module: Module, asked: Asked, which: np.ndarray, inputs: Any, options: Mapping[str, Any]) -> BatchSolution:
    """Some motions one by one: a run of its own finds out whether a motion chatters and what led it off its constraints."""
    part = replace(asked, n=len(which), columns=None, **{name: rows[which] if len(rows := getattr(asked, name)) > 1 else rows
                                           for name in ("starts", "params", "inputs")})
    return _one_by_one(module, part, inputs, part.inputs, "", options, which)


# -- one by one


def _one_by_one(module: Module, asked: Asked, inputs: Any, used: np.ndarray, note: str, options: Mapping[str, Any],
                which: np.ndarray | None = None) -> BatchSolution:
    """used: where the inputs at the times that are kept go, (n, n_t, n_in); left as it is where they do not vary.

    which       where these are some of more motions: their numbers there
    """
    n, n_x, sizes = asked.n, module.metadata.sizes.x, module.metadata.sizes
    x = aligned((n, len(asked.times), n_x), np.nan)
    success, counts = np.zeros(n, dtype=bool), np.zeros((n, 2), dtype=int)
    messages: dict[int, str] = {}
    doubts: dict[int, Sequence[str]] = {}
    times = asked.times if len(asked.times) > 1 else np.array(asked.span)
    begun, nowhere = clock.perf_counter(), np.full(n_x, np.nan)

    by = tuple(options.get("sensitivities", ()))
    columns = aligned((*x.shape, len(by)), np.nan)
    nowhere_columns = np.full((n_x, len(by)), np.nan)

    def solution() -> BatchSolution:
        sensitivity = BatchSensitivity(module.metadata, by, columns) if by else None
        return BatchSolution(module.metadata, asked.times, x, success, messages, counts[:, 0], counts[:, 1], 1, note,
                             clock.perf_counter() - begun, sensitivity, doubts)

    for k in range(n):
        start, p, given = (a[k if len(a) > 1 else 0] for a in (asked.starts, asked.params, asked.inputs))
        q, u, z = np.split(start, np.cumsum([sizes.q, sizes.u]))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", SimulationWarning)
                done = module.simulate(times, q, u, p, z=z, inputs=given if inputs is None else inputs, rtol=asked.rtol,
                                       atol=asked.atol, max_step=asked.max_step, first_step=asked.first_step, **options)
        except SimulationInterrupted:
            for late in range(k, n):
                messages[late] = f"{module.name}: not finished"
            message = f"{module.name}: interrupted after {int(success.sum())} of {n} motions"
            raise SimulationInterrupted(solution(), message) from None
        except SymdynError as error:
            messages[k] = str(error)
            continue
        success[k], counts[k] = done.success, (done.n_steps, done.n_rejected)
        if done.doubts:
            doubts[k] = done.doubts
        if len(asked.times) > 1:
            there = dict(zip(done.t.tolist(), done.x, strict=True))
            x[k] = [there.get(t, nowhere) for t in times.tolist()]
            if by:
                known = dict(zip(done.t.tolist(), done.sensitivity.matrix, strict=True))
                columns[k] = [known.get(t, nowhere_columns) for t in times.tolist()]
        elif done.success:  # at the end, or where an event ended the motion
            x[k] = done.x[-1]
            if by:
                columns[k] = done.sensitivity.matrix[-1]
        if used.ndim == 3:
            kept = dict(zip(done.t.tolist(), done.inputs, strict=True))
            used[k] = [kept.get(t, done.inputs[-1]) for t in asked.times.tolist()]
        if not done.success:
            messages[k] = done.message
    if which is None:
        warn(doubts, n)
    return solution()
