"""The gradient of a loss of a motion, backwards: the discrete adjoint of the steps that were taken.

The motion is integrated and gone back over, see way_back; across events and instants of controllers in pieces, see across.
"""

from __future__ import annotations

import time as clock
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.methods import METHODS as RECORDS
from symdyn.errors import ArgumentError, EvaluationError, SimulationWarning
from symdyn.runtime.consistent import check_start
from symdyn.runtime.contact_numbers import check_contact_numbers
from symdyn.runtime.inputs.inputs import take_inputs
from symdyn.runtime.inputs.sampled import check_span
from symdyn.runtime.integrating.across import Chain
from symdyn.runtime.integrating.at_breaks import Breaks
from symdyn.runtime.integrating.at_kinks import ending, staying
from symdyn.runtime.integrating.contact_chain import ContactChain
from symdyn.runtime.integrating.contact_columns import Switch
from symdyn.runtime.integrating.contacts import check_overlap
from symdyn.runtime.integrating.events import not_seen
from symdyn.runtime.integrating.methods import DEFAULT, check_compiled
from symdyn.runtime.integrating.outcome import Outcome, Request
from symdyn.runtime.integrating.quadrature import Integral
from symdyn.runtime.integrating.sensitivities import Asked, gathered, unseen_jumps
from symdyn.runtime.integrating.simulate import (
    checked_positive,
    checked_times,
    checked_tolerances,
    integrate,
    looked_for,
    stabilization_of,
    start_of,
)
from symdyn.runtime.integrating.way_back import Feedback, Way
from symdyn.runtime.losses import Cost, Costs, Loss, cost_of
from symdyn.runtime.masses import real_parameters
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Bytes up to which steps are kept.
KEPT = 2**22
# Methods whose steps are carried back: explicit pairs.
METHODS = tuple(m.name for m in RECORDS.values() if m.tableau is not None)
# Step of differences by time of the cost where an event ends the motion, of the time.
DIFFERENCE = 1e-3


class Gradient(Mapping[Any, float]):
    """Derivatives of a loss by name: what they are by -> number.

    value       of the loss; array: the derivatives in the order of `names`, (n,)
    t, x        end of the motion and the state there (n_x,)
    n_steps     of the motion; memory: most bytes that were kept at a time, checkpoints and steps; seconds: of the call
    """

    def __init__(self, owner: str, names: Sequence[str], value: float, array: np.ndarray, end: tuple[float, np.ndarray],
                 n_steps: int, memory: int, seconds: float) -> None:
        self.names, self.value, self.array = tuple(names), value, array
        self.t, self.x = end
        self.n_steps, self.memory, self.seconds = n_steps, memory, seconds
        self._owner = owner

    def __getitem__(self, name: Any) -> float:
        """The derivative by a parameter, an input or an initial value, by name or symbol. Raises ArgumentError for another."""
        asked = name_of(name)
        if asked not in self.names:
            raise ArgumentError(f"{self._owner}: the gradient has no {shown(asked)}; it is by {', '.join(self.names)}")
        return float(self.array[self.names.index(asked)])

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)

    def __contains__(self, name: object) -> bool:
        return name_of(name) in self.names

    def __repr__(self) -> str:
        return f"<Gradient of a loss of {self.value:.9g} by {len(self.names)} numbers, {self.n_steps} steps>"


def gradient(module: Module, loss: Any, by: Any, t: Any, q: Any, u: Any, params: Any, *, z: Any, inputs: Any, rtol: float,
             atol: Any, method: Any, max_step: float, first_step: float, stabilization: Any, events: Any, interpolation: str,
             extend: str) -> Gradient:
    """See Module.gradient."""
    begun = clock.perf_counter()
    metadata = module.metadata
    if not isinstance(loss, Loss):
        raise ArgumentError(f"{module.name}: the loss is {shown(loss)}; pass sd.Loss(integral=..., end=...)")
    p, start = real_parameters(module, params), start_of(module, q, u, z)
    _, span, _ = checked_times(module, t, False)
    free = take_inputs(inputs, metadata.inputs, metadata.initial, module.name, span, interpolation, extend, metadata.motions)
    module = module.following(free)
    check_span(free.samplers, span, module.name)
    look = looked_for(module, events)
    request = Request(span, None, start, p, free, *checked_tolerances(module, rtol, atol),
                      checked_positive(module, max_step, "max_step"), checked_positive(module, first_step, "first_step"),
                      None, len(start), look=look)
    asked = Asked.of(module, by, p, free)
    method = _checked(module, request, asked, method or DEFAULT)
    check_start(module, span[0], start, p)
    if metadata.compliant or metadata.contacts:
        check_contact_numbers(module, span[0], start, p, free.at(span[0], start))
    if metadata.contacts:
        check_overlap(module, span[0], start, p, free.at(span[0], start))
    request = replace(request, stabilization=stabilization_of(module, request, method, stabilization))
    asked.check(module, request, method, False)
    followed = Feedback(module, free, ()).names
    carried = tuple(dict.fromkeys([*[name for name in asked.columns if name], *followed]))
    breaks = Breaks.of(module, span)
    way = _way(module, request, method, carried, breaks)
    names = way.carried
    integral, end = (None if given is None else cost_of(module, what, given, names, p)
                     for what, given in (("the integral", loss.integral), ("the end", loss.end)))
    measured = None if integral is None else Integral(module, integral, request, method)
    t, x = way.forth(measured)
    weights, value = np.zeros(len(x) + len(names)), 0.0
    if end is not None:
        at = _cost(end, request, t, x)
        weights[:len(x)] = at.by_x[0]
        if at.by is not None:
            weights[len(x):] = at.by[0]
        value = float(at.values[0])
    Feedback(module, free, names).fold(t, x, weights)
    if not isinstance(way, Way):
        value += way.back(measured, weights, lambda: 0.0 if end is None else _by_time(end, request, t, x))
    else:
        value += way.back(measured, weights)
    if not np.isfinite(value):
        raise EvaluationError(f"{module.name}: the loss is {value:g}")
    for doubt in (*([] if measured is None else measured.doubts()), *([] if breaks is None else breaks.doubts()),
                  *staying(module, request, np.array([span[0], t]), np.array([start, x]), integral),
                  *([] if end is None else ending(module, request, t, x, end))):
        warnings.warn(doubt, SimulationWarning, stacklevel=3)
    return Gradient(module.name, asked.names, value, _chosen(asked, names, weights), (t, x), way.n_steps, way.memory,
                    clock.perf_counter() - begun)


def _way(module: Module, request: Request, method: str, carried: Sequence[str],
         breaks: Breaks | None) -> Way | Chain | ContactChain:
    """Way forth and back; in pieces where events are looked for, controllers hold inputs, or contacts switch."""
    if module.metadata.contacts:
        switches: list[Switch] = []
        return ContactChain(module, request, method, carried, _checked_run(module, request, method, switches), switches,
                            KEPT, breaks)
    looked = request.look is not None and request.look.any()
    if not looked and not request.inputs.samplers and not module.metadata.switches:
        return Way(module, request, method, carried, KEPT, breaks)
    return Chain(module, request, method, carried, _checked_run(module, request, method), KEPT, breaks)


def _checked_run(module: Module, request: Request, method: str, switches: list[Switch] | None = None) -> Outcome:
    """The motion, which must come to its end; what it warns of is warned of. switches: takes those of contacts."""
    outcome = integrate(module, request, method, crossed=switches)
    if outcome.interrupted:
        raise KeyboardInterrupt
    if not outcome.success:
        raise EvaluationError(outcome.message)
    unseen = not_seen(module, request.look, request.inputs.by_function(module.metadata.inputs), request.event_spacing)
    recorded = replace(request, inputs=request.inputs.recorded(outcome.record))
    for doubt in (*outcome.doubts, *filter(None, [unseen]), *gathered(module, outcome),
                  *unseen_jumps(module, recorded, outcome)):
        warnings.warn(doubt, SimulationWarning, stacklevel=6)
    return outcome


def _cost(cost: Cost, request: Request, t: float, x: np.ndarray) -> Costs:
    return cost(np.array([t]), x[None, :], np.broadcast_to(request.inputs.rows(np.array([t]), x[None, :]),
                                                           (1, len(request.inputs.constant))))


def _by_time(end: Cost, request: Request, t: float, x: np.ndarray) -> float:
    """The derivative of the cost at the end by the time at a given state, by differences of sixth order."""
    h = DIFFERENCE * max(abs(t), abs(request.span[1] - request.span[0]))
    sides = [float((_cost(end, request, t + k * h, x).values - _cost(end, request, t - k * h, x).values)[0]) for k in (1, 2, 3)]
    return (45 * sides[0] - 9 * sides[1] + sides[2]) / (60 * h)


def _checked(module: Module, request: Request, asked: Asked, method: Any) -> str:
    if not isinstance(method, str) or method not in METHODS:
        raise ArgumentError(f"{module.name}: a gradient was asked for with method {shown(method)}; the way back is there for "
                            f"{' and '.join(METHODS)}")
    if not asked.names:
        raise ArgumentError(f"{module.name}: a gradient by nothing was asked for; name parameters, inputs or initial values")
    if module.backend != "c":
        raise ArgumentError(f"{module.name}: a gradient was asked for on the backend {module.backend}; the way back is compiled: "
                            "compile(backend='c')")
    check_compiled(module, request.inputs, method)
    return method


def _chosen(asked: Asked, carried: Sequence[str], weights: np.ndarray) -> np.ndarray:
    n_x = asked.starts.shape[1]
    indices = {name: n_x + k for k, name in enumerate(carried)}
    return np.array([weights[indices[name]] if name else start @ weights[:n_x]
                     for name, start in zip(asked.columns, asked.starts, strict=True)])
