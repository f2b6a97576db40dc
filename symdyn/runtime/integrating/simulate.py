"""Simulation: by the compiled integrator where there is one, else by SciPy's, with the same interface."""

from __future__ import annotations

import contextlib
import time as clock
import warnings
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.arguments import take
from symdyn.backend.right_side import RightSide
from symdyn.errors import ArgumentError, EvaluationError, SimulationInterrupted, SimulationWarning
from symdyn.kinds import flag
from symdyn.progress import bar as progress_bar
from symdyn.real_numbers import length_of, number, number_of, real, real_of
from symdyn.runtime.consistent import check_start, normalised
from symdyn.runtime.contact_numbers import check_contact_numbers
from symdyn.runtime.inputs.inputs import Inputs, take_inputs
from symdyn.runtime.inputs.sampled import check_span
from symdyn.runtime.integrating import hybrid
from symdyn.runtime.integrating.automatic import automatic
from symdyn.runtime.integrating.charts import warn_near_lock
from symdyn.runtime.integrating.compiled import run_compiled
from symdyn.runtime.integrating.contacts import TooFast, check_overlap, run_contacts
from symdyn.runtime.integrating.events import not_seen, wanted
from symdyn.runtime.integrating.handover import run_series
from symdyn.runtime.integrating.held_run import run_held
from symdyn.runtime.integrating.methods import DEFAULT, SERIES, SMALLEST_RTOL, check_compiled, factors_of, is_compiled
from symdyn.runtime.integrating.moreau import MOREAU, check_moreau, run_moreau
from symdyn.runtime.integrating.moreau_groups import check_spheres_apart
from symdyn.runtime.integrating.outcome import Outcome, Request
from symdyn.runtime.integrating.scipy_run import run_scipy, solver_class_of, takes_changed_states
from symdyn.runtime.integrating.sensitivities import Asked
from symdyn.runtime.integrating.stabilization import Projector, Stabilization, choose, chosen_gain
from symdyn.runtime.masses import real_parameters
from symdyn.runtime.memory import demand
from symdyn.runtime.raised import InputRaised
from symdyn.runtime.solutions.solution import Solution
from symdyn.runtime.solutions.validity import VALIDITY_CHECKS, warn
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.backend.metadata import ModuleMetadata
    from symdyn.runtime.integrating.contact_columns import Switch
    from symdyn.runtime.module import Module

N_POINTS = 1001
# Largest number that a long integer of C holds on every platform.
MOST_STEPS = 2**31 - 1
# With more, steps whose error is of the size of the motion itself pass: a double pendulum gained energy without end in 10 s from
# 0.2 on (RK45) or 0.3 on (dop853, bs54), while at 0.1 it was wrong by a sixth at most with the compiled methods.
LARGEST_RTOL = 0.1
# The relative tolerance of a step where none is given; public signatures show it as a number.
RTOL = 1e-8
# Part of a run below which events are not sampled.
FINEST = 1e-8
# Numbers of a motion that is repeated with a row for every step.
MOST_NUMBERS = 2**26
# Steps of the trial run that Baumgarte's gain is chosen by.
TRIAL_STEPS = 100


def simulate(module: Module, t: Any = None, q: Any = None, u: Any = None, params: Any = None, *, z: Any = None,
             inputs: Any = None, rtol: float = RTOL, atol: Any = None, method: Any = None, steps: bool = False,
             max_step: float = 0.0, first_step: float = 0.0, max_steps: int | None = None,
             progress: bool = False, work: bool = False, stabilization: Any = None, events: Any = True,
             event_spacing: float = 0.0, interpolation: str = "linear", extend: str = "error", sensitivities: Any = None,
             sensitivity_control: bool = True, step: float = 0.0, judged: bool = True) -> Solution:
    """See Module.simulate; judged: whether sensitivities are looked at for what there is to be warned of in them, which takes as
    long as a short run: fits have that of their first motion."""
    metadata = module.metadata
    p = real_parameters(module, params)
    start = start_of(module, q, u, z)
    steps, progress, work = (flag(v, f"{module.name}: {what}")
                             for v, what in ((steps, "steps"), (progress, "progress"), (work, "work")))
    method = checked_method(module, method)
    times, span, every = checked_times(module, t, steps or method == MOREAU)
    free = take_inputs(inputs, metadata.inputs, metadata.initial, module.name, span, interpolation, extend,
                       metadata.motions)
    module = module.following(free)
    check_span(free.samplers, span, module.name)
    if not (max_steps is None or (isinstance(max_steps, (int, np.integer)) and 0 < max_steps <= MOST_STEPS)):
        raise ArgumentError(f"{module.name}: max_steps must be a number of steps from 1 on, {MOST_STEPS} at most, or None, "
                            f"found {shown(max_steps)}")
    request = Request(span, None if every else times, start, p, free, *checked_tolerances(module, rtol, atol),
                      checked_positive(module, max_step, "max_step"), checked_positive(module, first_step, "first_step"),
                      max_steps, len(start), look=looked_for(module, events),
                      event_spacing=checked_spacing(module, event_spacing, span))
    request = replace(request, step=checked_positive(module, step, "step"))
    if request.step and method not in (MOREAU, "auto"):
        raise ArgumentError(f"{module.name}: step is the length of the steps of method='moreau', which method='auto' takes where "
                            "switches of contacts come faster; other methods choose theirs by rtol and atol, and take max_step")
    asked, controlled = Asked.of(module, sensitivities, p, free), flag(sensitivity_control, f"{module.name}: sensitivity_control")
    if work and "power" not in metadata.functions:
        raise ArgumentError(f"{module.name}: the work of the loads is not known to these equations; leave out work=True")
    method = method or (DEFAULT if module.backend == "c" else "DOP853")
    bar = _bar(module, span) if progress else None
    with contextlib.ExitStack() as stack:
        if bar is not None:
            stack.callback(bar.close)
            stack.enter_context(module.noting(lambda label: bar.set_description(_underway(module, label))))
        with contextlib.suppress(InputRaised):  # the run ends with it, as with what raises later
            check_start(module, span[0], start, p)
            if metadata.compliant or metadata.contacts:
                check_contact_numbers(module, span[0], start, p, free.at(span[0], start))
            if metadata.contacts:
                check_overlap(module, span[0], start, p, free.at(span[0], start))
            if metadata.contact_groups:
                check_spheres_apart(module, span[0], start, p, free.at(span[0], start))
        why = ""
        if isinstance(method, str) and method == "auto" and request.step:
            check_moreau(module, request, stabilization)
        if isinstance(method, str) and method == "auto" and metadata.contact_groups:
            method, why = MOREAU, "contacts of a group are found in steps of one length"
        elif isinstance(method, str) and method == "auto":
            blind = replace(request, look=None if request.look is None else np.zeros_like(request.look), inputs=free.held())
            method, why = automatic(module, blind, lambda asked, name: _trial(module, asked, name))
        if is_compiled(method):
            check_compiled(module, request.inputs, method)
        if metadata.contact_groups and method != MOREAU:
            raise ArgumentError(f"{module.name}: contacts of the group {metadata.contact_groups[0].name} are found in steps; "
                                "pass method='moreau' with a step, such as step=2e-3 (in s)")
        if method == MOREAU:
            check_moreau(module, request, stabilization)
        if method == "ggl":
            from symdyn.runtime.integrating.dae_run import check_ggl

            if asked.columns:
                asked.check(module, request, method, work)
            check_ggl(module, start, p, span[0], stabilization, work)
        else:
            request = replace(request, stabilization=stabilization_of(module, request, method, stabilization))
            if asked.columns:
                asked.check(module, request, method, work)
            if request.stabilization.way == "baumgarte":
                request = replace(request, x0=Projector(module, p)(span[0], start))
        whole = request.with_work() if work else request
        if asked.columns:
            whole = asked.added_to(request, controlled, metadata.inputs)
        begun = clock.perf_counter()
        try:
            outcome = integrate(module, whole, method, bar)
        except TooFast as found:
            method, why = MOREAU, f"{why}; {found}"
            whole = replace(whole, stabilization=stabilization_of(module, request, method, stabilization))
            outcome = integrate(module, whole, method, bar)
        unseen = not_seen(module, request.look, free.by_function(metadata.inputs), request.event_spacing)
        free = free.recorded(outcome.record)
        known = replace(request, inputs=free)
        of_columns = [] if outcome.interrupted or not judged else asked.doubts(
            module, known, outcome, lambda: _steps(module, replace(whole, inputs=free), method, outcome.n_steps))
        outcome = replace(outcome, doubts=(*outcome.doubts, *filter(None, [unseen]), *of_columns))
        solution = Solution(module, outcome, p, free, str(getattr(method, "__name__", method)), clock.perf_counter() - begun,
                            work, (request.rtol, float(request.atol.max(initial=0.0))), why,
                            partial(_repeated, module, replace(whole, inputs=free), method), asked,
                            partial(factors_of, module, method, whole.stabilization.way))
        if outcome.interrupted:
            raise SimulationInterrupted(solution, outcome.message)
        if not outcome.success:
            warnings.warn(outcome.message, SimulationWarning, stacklevel=3)
        for doubt in outcome.doubts:
            warnings.warn(doubt, SimulationWarning, stacklevel=3)
        if metadata.validity_checks and len(solution.t):
            warn(module, solution.rows(VALIDITY_CHECKS), "in this motion", 3, solution.t)
        if metadata.charts:
            warn_near_lock(module, known, solution.t, solution.x,
                           lambda part: integrate(module, part, method), 3)
        return solution


def looked_for(module: Module, events: Any) -> np.ndarray:
    """Events that are looked for all along, (n_e,) of bool: those of rigid contacts are as their modes say."""
    own: np.ndarray = module._remembered("own_events", lambda: of_contacts(module.metadata))
    return wanted(module, events) & ~own


def of_contacts(metadata: ModuleMetadata) -> np.ndarray:
    """Mask of the events of rigid contacts, (n_e,) of bool."""
    own = {f"{c.name}_{what}" for c in metadata.contacts for what in c.events}
    return np.array([e.name in own for e in metadata.events], dtype=bool)


def integrate(module: Module, request: Request, method: Any, bar: Any = None, crossed: list[Switch] | None = None) -> Outcome:
    """A request, checked, by any method; crossed: takes the switches of rigid contacts, for a way back."""
    if method == MOREAU:
        return run_moreau(module, request, bar)
    if module.metadata.contacts:
        stiff = "radau" if is_compiled(method) else "Radau"
        return run_contacts(module, request, lambda part, slow, parted: _run_smooth(
            module, part, stiff if slow else method, bar, parted), method, crossed,
            hybrid.of(module, request, method) if bar is None and crossed is None else None)
    return _run_smooth(module, request, method, bar)


def _run_smooth(module: Module, request: Request, method: Any, bar: Any = None, open_contacts: bool = False) -> Outcome:
    """Without rigid contacts, or in one mode of them; open_contacts: all are open."""
    if request.inputs.are_held:
        return run_held(module, request, lambda part: _run_smooth(module, part, method, bar), method)
    if method == "ggl":
        from symdyn.runtime.integrating.dae_run import run_ggl

        return run_ggl(module, request, bar)
    field = RightSide(work=request.works, baumgarte=request.stabilization.way == "baumgarte", sensitivities=request.columns,
                      held=request.held, followed=request.followed, open_contacts=open_contacts)
    run = run_series if method == SERIES else run_compiled if is_compiled(method) else run_scipy
    return run(module, request, method, bar, field)


def _repeated(module: Module, request: Request, method: Any, times: np.ndarray) -> np.ndarray:
    """States of a motion at times (n_t,) that increase, (n_t, n_x), by the same steps.

    Raises EvaluationError where the run does not get as far again, as with inputs that depend on more than t and x.
    """
    if method == MOREAU:
        raise ArgumentError(f"{module.name}: a motion by method='moreau' has states at the ends of its steps, in sol.t; pass "
                            "other times to simulate")
    begin, end = request.span
    ahead = times if end >= begin else times[::-1]
    whole = ahead if len(ahead) and ahead[0] == begin else np.append(begin, ahead)
    outcome = integrate(module, replace(request, times=np.ascontiguousarray(whole)), method)
    if outcome.interrupted:
        raise KeyboardInterrupt
    if not np.array_equal(outcome.t[:len(whole)], whole):
        raise EvaluationError(f"{module.name}: the motion does not come as far as before when it is repeated: "
                              f"{outcome.message}")
    rows = outcome.x[len(whole) - len(ahead):len(whole)]
    return rows if end >= begin else rows[::-1]


def _steps(module: Module, request: Request, method: Any, n_steps: int) -> Outcome:
    """The same motion with a row for every step; for one of so many steps that memory would not hold them, with evenly spaced
    rows."""
    room = MOST_NUMBERS // max(1, len(request.x0))
    times = None if n_steps < room else np.linspace(*request.span, room)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)  # they have been given
        return integrate(module, replace(request, times=times), method)


def stabilization_of(module: Module, request: Request, method: Any, asked: Any) -> Stabilization:
    """Method that keeps the constraints; Baumgarte's gain is chosen by a short trial run."""
    one_step = method == MOREAU or is_compiled(method) or takes_changed_states(solver_class_of(module, method))
    chosen = choose(module, asked, one_step, str(getattr(method, "__name__", method)), request.p)
    if chosen.way != "baumgarte":
        return chosen
    if chosen.gain:
        return chosen

    short = replace(request, times=None, max_steps=TRIAL_STEPS, inputs=request.inputs.held())
    return replace(chosen, gain=chosen_gain(lambda: _trial(module, short, method, "none").t, request.span))


def _trial(module: Module, request: Request, method: Any, stabilization: Any = None) -> Outcome:
    """A run that is thrown away."""
    done = integrate(module, replace(request, stabilization=stabilization_of(module, request, method, stabilization)), method)
    if done.interrupted:
        raise KeyboardInterrupt
    return done


def start_of(module: Module, q: Any, u: Any, z: Any) -> np.ndarray:
    """The start x = [q; u; z] as it is given; raises ArgumentError for what does not fit."""
    initial = module.metadata.initial
    parts = []
    for what, values in (("q", q), ("u", u), ("z", z)):
        names = module.metadata.names(what)
        given = {name_of(key) for key in values} if isinstance(values, Mapping) else set()
        followed = [n for n in module.metadata.motions if given & {n, f"{n}_dot"}]
        if followed:
            raise ArgumentError(f"{module.name}: initial {what} has the motion {followed[0]}, which follows an input; pass it "
                                f"there, inputs={{{followed[0]}: ...}}: a function of t, a spline, a table or a number")
        parts.append(take(values, names, f"initial {what}", {n: initial.get(n, 0.0) for n in names}, module.name))
    return normalised(module, np.concatenate(parts))


def checked_method(module: Module, method: Any) -> Any:
    """A method by name, or a class of SciPy's; what the names are is checked with the backend. None: the default's."""
    if method is None or (isinstance(method, str) and method) or isinstance(method, type):
        return method
    raise ArgumentError(f"{module.name}: method must be a name or an OdeSolver class, found {shown(method)}; pass 'dop853' or "
                        "another "
                        "name, or a class derived from SciPy's")


def check_fits(module: Module, method: Any, inputs: Inputs | None) -> None:
    """Raises ArgumentError for a method that there is not, and for a compiled one that does not fit a module or inputs, None:
    constants."""
    if is_compiled(method):
        check_compiled(module, inputs, method)
    elif method not in (None, "auto", "ggl", MOREAU):
        solver_class_of(module, method)


def checked_times(module: Module, t: Any, steps: bool) -> tuple[np.ndarray, tuple[float, float], bool]:
    """Output times, span, whether every step is stored."""
    if t is None:
        t = (0.0, module.metadata.duration)
    # The times, what they are compared by, and the states at them.
    n, n_x = length_of(t), module.metadata.sizes.x
    if n is not None:
        demand(n * (n_x + 3), module.name, f"a solution with {n} output times and {n_x} numbers at each",
               "pass fewer times, or (start, end)")
    times = np.array(real_of(t, module.name, "t must be (start, end) or an array of times"), order="C")  # kept: a copy
    if np.ndim(t) != 1 or len(times) < 2 or not np.isfinite(times).all():
        raise ArgumentError(f"{module.name}: t must be (start, end) or an array of at least two finite times, found {shown(t)}")
    direction = np.sign(times[-1] - times[0])
    if isinstance(t, (tuple, list)) and len(t) == 2:
        return np.linspace(times[0], times[1], N_POINTS), (times[0], times[1]), steps
    if not (np.diff(times) * direction > 0).all():
        raise ArgumentError(f"{module.name}: the output times must increase, or decrease, throughout")
    return times, (times[0], times[-1]), False


def checked_tolerances(module: Module, rtol: Any, atol: Any) -> tuple[float, np.ndarray]:
    n = module.metadata.sizes.x
    absolute = rtol if atol is None else atol
    try:
        relative, vector = number(rtol), np.array(np.broadcast_to(real(absolute), (n,)), order="C")
    except ValueError as error:
        raise ArgumentError(f"{module.name}: rtol must be a number and atol a number or {n} numbers, found {_given(rtol, atol)}: "
                            f"{error}") from None
    if not (relative >= 0 and (vector >= 0).all() and np.isfinite(vector).all() and (relative > 0 or (vector > 0).all())):
        raise ArgumentError(f"{module.name}: tolerances must be positive, found {_given(rtol, atol)}")
    if relative > LARGEST_RTOL:
        raise ArgumentError(f"{module.name}: rtol = {rtol} lets the error of a step be nearly as large as the motion itself, "
                            f"which can then grow without end; the largest is {LARGEST_RTOL}, and 1e-3 is loose. For steps of "
                            "a given length pass first_step and max_step, and a large atol")
    if 0 < relative < SMALLEST_RTOL:
        raise ArgumentError(f"{module.name}: rtol = {rtol} is finer than double precision can resolve; the smallest is "
                            f"{SMALLEST_RTOL}")
    return max(relative, SMALLEST_RTOL), vector


def _given(rtol: object, atol: object) -> str:
    """Tolerances in words; atol None: it is rtol."""
    return f"rtol = {shown(rtol)}" + ("" if atol is None else f", atol = {shown(atol)}")


def checked_positive(module: Module, value: Any, what: str) -> float:
    seconds = number_of(value, module.name, f"{what} must be a positive number of seconds, or 0")
    if not seconds >= 0:
        raise ArgumentError(f"{module.name}: {what} must be a positive number of seconds, or 0, found {shown(value)}")
    return 0.0 if np.isinf(seconds) else seconds


def checked_spacing(module: Module, value: Any, span: tuple[float, float]) -> float:
    """The time between samples of events, s; 0: as they vary. Raises ArgumentError for what would take for ever."""
    spacing = checked_positive(module, value, "event_spacing")
    if 0 < spacing < FINEST * abs(span[1] - span[0]):
        raise ArgumentError(f"{module.name}: event_spacing = {spacing:g} s makes over {1 / FINEST:.0e} samples of a run of "
                            f"{abs(span[1] - span[0]):g} s; give a longer one, or a shorter run around the pulse")
    return spacing


def _underway(module: Module, label: str) -> str:
    """Text of the progress bar while a function, or an integrator with its right-hand side, is made; empty label: the motion
    runs."""
    return f"{module.name}: first use of {label}, which is derived and compiled" if label else module.name


def _bar(module: Module, span: tuple[float, float]) -> Any:
    return progress_bar(total=round(abs(span[1] - span[0]), 9), desc=module.name, unit="s",
                        bar_format="{l_bar}{bar}| {n:.3g}/{total:.3g} s")
