"""Simulation: by the compiled integrator where there is one, else by SciPy's, with the same interface."""

from __future__ import annotations

import time as clock
import warnings
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError, SimulationInterrupted, SimulationWarning
from symdyn.progress import bar as progress_bar
from symdyn.runtime.arguments import take
from symdyn.runtime.automatic import automatic
from symdyn.runtime.charts import CHARTS, warn_near_lock
from symdyn.runtime.compiled import run_compiled
from symdyn.runtime.consistent import check_start, normalised
from symdyn.runtime.events import wanted
from symdyn.runtime.inputs import take_inputs
from symdyn.runtime.masses import real_parameters
from symdyn.runtime.methods import DEFAULT, SMALLEST_RTOL, check_compiled, is_compiled
from symdyn.runtime.outcome import Outcome, Request
from symdyn.runtime.scipy_run import run_scipy, solver_class_of, takes_changed_states
from symdyn.runtime.solution import Solution
from symdyn.runtime.stabilization import Projector, Stabilization, choose, chosen_gain
from symdyn.runtime.watches import WATCHES, warn

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

N_POINTS = 1001
# With more, steps whose error is of the size of the motion itself pass: a double pendulum gained energy without end in 10 s from
# 0.2 on (RK45) or 0.3 on (dop853, bs54), while at 0.1 it was wrong by a sixth at most with the compiled methods.
LARGEST_RTOL = 0.1
# Steps of the trial run that Baumgarte's gain is chosen by.
TRIAL_STEPS = 100


def simulate(module: Module, t: Any = None, q: Any = None, u: Any = None, params: Any = None, *, z: Any = None,
             inputs: Any = None, rtol: float = 1e-8, atol: Any = None, method: Any = None, steps: bool = False,
             max_step: float = 0.0, first_step: float = 0.0, max_steps: int | None = None,
             progress: bool = False, work: bool = False, stabilization: Any = None, events: Any = True) -> Solution:
    """Integrate the motion.

    t           (start, end): 1001 points between, or with steps=True every step the integrator took; or an array of
                output times; default: from 0 over the system's duration
    q, u, z     start; in order, or by name or symbol; what is left out takes the system's initial value, else 0
    params      as everywhere in Module
    inputs      numbers, (times, values), a function of (t, x), or a mapping from names to these
    rtol, atol  relative and absolute tolerance of a step; rtol from 1e-15 to 0.1; atol a number or (n_x,), default rtol
    method      compiled: one of symdyn.runtime.methods.COMPILED: "dop853" (default with the C backend), "bs54" for loose
                tolerances, "taylor" for fine ones, "radau" for stiff systems ("radau5" at loose tolerances), "gauss" for very
                long conservative motion (with first_step its steps have that length, but for some that a warning counts); or one
                of SciPy's RK23 RK45 DOP853 Radau BDF LSODA, or an OdeSolver class; Radau, BDF and LSODA get the exact
                Jacobian. With constraints also "ggl": the stabilized index-2 form of Gear, Gupta and Leimkuhler by an implicit
                method (pip install 'symdyn[dae]'). "auto": by tolerance, stiffness (short trial runs) and constraints;
                `Solution.why` tells
    max_step, first_step   s, 0: chosen by the integrator;  max_steps: stop after so many
    progress    show a bar (needs tqdm)
    work        integrate the work of all loads but gravity and springs along with the motion: `Solution.work`
    stabilization   what keeps constraints, and the norm of Euler parameters, to rounding or within the tolerances:
                "projection": after every step, and at every output time, the smallest change in the metric of the mass
                matrix that fulfils them; "baumgarte", or ("baumgarte", a): C_ddot + 2 a C_dot + a^2 C = 0 instead of
                C_ddot = 0, unless given with a = 1/(twenty mean steps of a short run without); "none".
                Default: projection, with methods that build on several steps (BDF, LSODA) baumgarte
    events      which of the system's events are looked for: True (all), False, or names; see `Solution.events`

    Returns a Solution. A run that stops early keeps what was computed: `success` is False, `message` tells when, where
    and why, and a SimulationWarning is given. What a function of the user raises ends a run like that, and is its `cause`.
    Ctrl-C raises SimulationInterrupted, whose `solution` holds the same.
    Raises ArgumentError for values that do not fit.
    """
    metadata = module.metadata
    p = real_parameters(module, params)
    start = _start(module, q, u, z)
    free = take_inputs(inputs, metadata["inputs"], metadata["initial"], module.name)
    times, span, every = checked_times(module, t, steps)
    if not (max_steps is None or (isinstance(max_steps, (int, np.integer)) and max_steps > 0)):
        raise ArgumentError(f"{module.name}: max_steps must be a number of steps from 1 on, or None, found {max_steps!r}")
    request = Request(span, None if every else times, start, p, free, *checked_tolerances(module, rtol, atol),
                      checked_positive(module, max_step, "max_step"), checked_positive(module, first_step, "first_step"),
                      max_steps, len(start), look=wanted(module, events))
    if work and "power" not in metadata["functions"]:
        raise ArgumentError(f"{module.name}: the work of the loads is not known to these equations; leave out work=True")
    method = method or (DEFAULT if module.backend == "c" else "DOP853")
    check_start(module, span[0], start, p)
    why = ""
    if isinstance(method, str) and method == "auto":
        method, why = automatic(module, replace(request, look=None if request.look is None else np.zeros_like(request.look)),
                                lambda asked, name: _trial(module, asked, name))
    if is_compiled(method):
        check_compiled(module, request, method)
    if method == "ggl":
        from symdyn.runtime.dae_run import check_ggl

        check_ggl(module, start, p, span[0], stabilization, work)
    else:
        request = replace(request, stabilization=_stabilization(module, request, method, stabilization))
        if request.stabilization.way == "baumgarte":
            request = replace(request, x0=Projector(module, p)(span[0], start))
    bar = _bar(module, span) if progress else None
    begun = clock.perf_counter()
    try:
        outcome = _run(module, request.with_work() if work else request, method, bar)
    finally:
        if bar is not None:
            bar.close()
    solution = Solution(module, outcome, p, free, str(getattr(method, "__name__", method)), clock.perf_counter() - begun,
                        work, (request.rtol, float(request.atol.max(initial=0.0))), why)
    if outcome.interrupted:
        raise SimulationInterrupted(solution, outcome.message)
    if not outcome.success:
        warnings.warn(outcome.message, SimulationWarning, stacklevel=3)
    if outcome.doubt:
        warnings.warn(outcome.doubt, SimulationWarning, stacklevel=3)
    if metadata.get(WATCHES) and len(solution.t):
        warn(module, solution.rows(WATCHES), "in this motion", 3)
    if metadata.get(CHARTS):
        warn_near_lock(module, request, solution.t, solution.x, lambda part: _run(module, part, method), 3)
    return solution


def _run(module: Module, request: Request, method: Any, bar: Any = None) -> Outcome:
    if method == "ggl":
        from symdyn.runtime.dae_run import run_ggl

        return run_ggl(module, request, bar)
    field = "rhs" + "_work" * (len(request.x0) > request.n_state) + "_baumgarte" * (request.stabilization.way == "baumgarte")
    return (run_compiled if is_compiled(method) else run_scipy)(module, request, method, bar, field)


def _stabilization(module: Module, request: Request, method: Any, asked: Any) -> Stabilization:
    """What keeps the constraints; Baumgarte's gain is chosen by a short trial run."""
    one_step = is_compiled(method) or takes_changed_states(solver_class_of(module, method))
    chosen = choose(module, asked, one_step, str(getattr(method, "__name__", method)), request.p)
    if chosen.way != "baumgarte":
        return chosen
    if chosen.gain:
        return chosen

    short = replace(request, times=None, max_steps=TRIAL_STEPS)
    return replace(chosen, gain=chosen_gain(lambda: _trial(module, short, method, "none").t, request.span))


def _trial(module: Module, request: Request, method: Any, stabilization: Any = None) -> Outcome:
    """A run that is thrown away."""
    done = _run(module, replace(request, stabilization=_stabilization(module, request, method, stabilization)), method)
    if done.interrupted:
        raise KeyboardInterrupt
    return done


def _start(module: Module, q: Any, u: Any, z: Any) -> np.ndarray:
    initial = module.metadata["initial"]
    parts = []
    for what, values in (("q", q), ("u", u), ("z", z)):
        names = module.metadata[what]
        parts.append(take(values, names, f"initial {what}", {n: initial.get(n, 0.0) for n in names}, module.name))
    return normalised(module, np.concatenate(parts))


def checked_times(module: Module, t: Any, steps: bool) -> tuple[np.ndarray, tuple[float, float], bool]:
    """Output times, span, whether every step is stored."""
    if t is None:
        t = (0.0, module.metadata["duration"])
    try:
        times = np.ascontiguousarray(t, dtype=float)
    except (TypeError, ValueError):
        raise ArgumentError(f"{module.name}: t must be (start, end) or an array of times, found {t!r}") from None
    if times.ndim != 1 or len(times) < 2 or not np.isfinite(times).all():
        raise ArgumentError(f"{module.name}: t must be (start, end) or an array of at least two finite times, found {t!r}")
    direction = np.sign(times[-1] - times[0])
    if isinstance(t, (tuple, list)) and len(t) == 2:
        return np.linspace(times[0], times[1], N_POINTS), (times[0], times[1]), steps
    if not (np.diff(times) * direction > 0).all():
        raise ArgumentError(f"{module.name}: the output times must increase, or decrease, throughout")
    return times, (times[0], times[-1]), False


def checked_tolerances(module: Module, rtol: Any, atol: Any) -> tuple[float, np.ndarray]:
    n = module.metadata["sizes"]["x"]
    absolute = rtol if atol is None else atol
    try:
        relative, vector = float(rtol), np.ascontiguousarray(np.broadcast_to(np.asarray(absolute, dtype=float), (n,)))
    except (TypeError, ValueError):
        raise ArgumentError(f"{module.name}: rtol must be a number and atol a number or {n} numbers, found rtol = {rtol!r}, "
                            f"atol = {atol!r}") from None
    if not (relative >= 0 and (vector >= 0).all() and np.isfinite(vector).all() and (relative > 0 or (vector > 0).all())):
        raise ArgumentError(f"{module.name}: tolerances must be positive, found rtol = {rtol}, atol = {atol}")
    if relative > LARGEST_RTOL:
        raise ArgumentError(f"{module.name}: rtol = {rtol} lets the error of a step be nearly as large as the motion itself, "
                            f"which can then grow without end; the largest is {LARGEST_RTOL}, and 1e-3 is loose. For steps of "
                            "a given length pass first_step and max_step, and a large atol")
    if 0 < relative < SMALLEST_RTOL:
        raise ArgumentError(f"{module.name}: rtol = {rtol} is finer than double precision can resolve; the smallest is "
                            f"{SMALLEST_RTOL}")
    return max(relative, SMALLEST_RTOL), vector


def checked_positive(module: Module, value: Any, what: str) -> float:
    if not (isinstance(value, (int, float, np.number)) and value >= 0):
        raise ArgumentError(f"{module.name}: {what} must be a positive number of seconds, or 0, found {value!r}")
    return 0.0 if not np.isfinite(value) else float(value)


def _bar(module: Module, span: tuple[float, float]) -> Any:
    return progress_bar(total=round(abs(span[1] - span[0]), 9), desc=module.name, unit="s",
                        bar_format="{l_bar}{bar}| {n:.3g}/{total:.3g} s")
