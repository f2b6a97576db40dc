"""Drives the compiled integrator: in pieces, so that it can be interrupted and shown in a progress bar."""

from __future__ import annotations

import contextlib
import ctypes
import re
import time as clock
import warnings
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.c_records import fields_of
from symdyn.backend.right_side import RightSide
from symdyn.errors import SimulationWarning, SymdynError
from symdyn.runtime.inputs.inputs import not_finite
from symdyn.runtime.integrating.chatter import STEPS, chatter_of
from symdyn.runtime.integrating.events import Happened, at_once, ended, entangled, not_known, not_proved, too_quick
from symdyn.runtime.integrating.interrupts import Interrupts
from symdyn.runtime.integrating.methods import DEFAULT, with_own_tolerances
from symdyn.runtime.integrating.outcome import Outcome, Request
from symdyn.runtime.integrating.run_record import NOTED, STATUS, Noted, Report, RunReport
from symdyn.runtime.integrating.short_steps import ShortSteps
from symdyn.runtime.integrating.stabilization import TOO_FAR, Corrections, not_converged, not_smooth, reset_rejected
from symdyn.runtime.integrating.stops import describe_stop, lost_rank, nearly_singular, with_last
from symdyn.runtime.raised import InputRaised
from symdyn.thresholds import AT_ONCE, NEAR, most_events

if TYPE_CHECKING:
    from symdyn.runtime.building.library import CLibrary
    from symdyn.runtime.module import Module

# Attempted steps in one call; a fraction of a second even for large systems.
PIECE = 20_000
STEPS_AT_ONCE = 4096
# A step whose error was tolerated and that is moved by more tolerances has lost digits. Among 720 runs across singular
# configurations those whose sensitivities lost a hundred tolerances or more were moved by 4,000 to 6e8; regular runs by 12 at
# most.
FAR = 1000.0


class Problem(ctypes.Structure):
    """Parameters, constants and inputs of a run."""

    _fields_ = fields_of("runtime/problem_type.h")


_InputFunction = dict(Problem._fields_)["function"]


class Run:
    """One run of the integrator with the memory it works in."""

    def __init__(self, library: CLibrary, request: Request) -> None:
        self.library = library
        self.n_x = library.metadata.sizes.x
        self.trouble: list[BaseException] = []
        self.guard: Any = contextlib.nullcontext()
        size = library.function("simulation_size")
        size.restype = ctypes.c_long
        self.size = size()
        self.memory = ctypes.create_string_buffer(self.size + 64)
        self.address = ctypes.c_void_p((ctypes.addressof(self.memory) + 63) // 64 * 64)
        self.request = request
        self.p, self.c = np.zeros(max(1, len(request.field_p))), np.zeros(max(1, library.metadata.n_c))
        self.p[:len(request.field_p)] = request.field_p
        library.prologue(self.p, self.c)
        self.problem = Problem(self.p.ctypes.data, self.c.ctypes.data)
        self.problem.project = int(request.stabilization.way == "projection")
        self.problem.length = request.stabilization.length
        self.kept: list[Any] = [request.x0, request.atol]
        self._inputs(request)
        span = np.array([*request.span, request.rtol, request.first_step, request.max_step])
        self.seconds = 0.0
        self.status = self._timed("simulation_start", ctypes.byref(self.problem), ctypes.c_void_p(span.ctypes.data),
                                  ctypes.c_void_p(request.x0.ctypes.data), ctypes.c_void_p(request.atol.ctypes.data))
        self.written = ctypes.c_long(0)
        self.happened: list[Happened] = []
        self.too_quick: list[tuple[int, float]] = []
        self.hidden: list[tuple[int, float]] = []
        self.entangled: list[tuple[int, float]] = []
        self.noted: np.ndarray | None = None
        if request.look is not None and request.look.any():
            self.look = np.ascontiguousarray(request.look, dtype=np.intc)
            most = most_events(len(self.look))
            self.noted, self.noted_states = np.zeros(most, dtype=np.dtype(Noted)), np.zeros((most, 2, self.n_x))
            library.function("simulation_look")(self.address, ctypes.c_void_p(self.look.ctypes.data),
                                                ctypes.c_double(request.event_spacing))
            if request.carried is not None:
                carried = np.ascontiguousarray(request.carried[:3], dtype=float)
                library.function("simulation_carry")(self.address, ctypes.c_void_p(carried.ctypes.data),
                                                     ctypes.c_int(request.carried.reset))

    def _inputs(self, request: Request) -> None:
        free = request.inputs
        constant = np.ascontiguousarray(free.constant)
        self.kept.append(constant)
        self.problem.inputs = constant.ctypes.data
        stops = np.sort(free.stops(request.span))
        self.kept.append(stops)
        self.problem.n_stops, self.problem.stops = len(stops), stops.ctypes.data
        if free.pieces is not None:
            breaks, pieces = (np.ascontiguousarray(a) for a in (free.pieces.breaks, free.pieces.coefficients))
            self.kept += [breaks, pieces]
            self.problem.n_pieces, self.problem.breaks, self.problem.pieces = len(pieces), breaks.ctypes.data, pieces.ctypes.data
        if free.function is not None:
            n_x, n_in, n_state, n_columns = self.n_x, len(constant), request.n_state, len(request.columns)
            indices = [self.library.metadata.inputs.index(name) for name in request.followed]

            def call(t: float, x: Any, out: Any) -> int:
                if self.trouble:  # the integrator tries smaller steps before it gives up
                    return 1
                try:
                    guard.check()
                    state = np.ctypeslib.as_array(x, (n_x,)).copy()
                    values = np.ctypeslib.as_array(out, (n_in + len(indices) * n_columns,))
                    values[:n_in] = free.at(t, state[:n_state])
                    if indices:
                        columns = state[n_state:n_state * (1 + n_columns)].reshape(n_columns, n_state)
                        values[n_in:] = free.slopes(t, state[:n_state], columns)[indices].T.ravel()
                    return 0
                except BaseException as error:
                    self.trouble.append(error)
                    return 1

            self.guard = guard = Interrupts(call.__code__)
            self.problem.function = _InputFunction(call)

    @property
    def raised(self) -> InputRaised | None:
        """Error that a function of inputs raised, if any."""
        return self.trouble[0] if self.trouble and isinstance(self.trouble[0], InputRaised) else None

    def at(self, times: np.ndarray, x: np.ndarray, limit: int) -> int:
        """Go on, writing states at the requested times."""
        return self._go(0, limit, times, len(times), x)

    def steps(self, t: np.ndarray, x: np.ndarray, limit: int) -> int:
        """Go on, writing every accepted step."""
        return self._go(1, limit, t, len(t), x)

    def _go(self, every: int, limit: int, *rest: Any) -> int:
        arguments = [ctypes.c_long(a) if isinstance(a, int) else ctypes.c_void_p(a.ctypes.data) for a in (limit, *rest)]
        with self.guard:
            status = self._timed("simulation_go", ctypes.c_int(every), *arguments, ctypes.byref(self.written))
        if self.noted is not None:
            take = self.library.function("simulation_events")
            take.restype = ctypes.c_long
            n = take(self.address, *(ctypes.c_void_p(a.ctypes.data) for a in (self.noted, self.noted_states)))
            doubts = {NOTED.UNRESOLVED: self.too_quick, NOTED.UNPROVED: self.hidden, NOTED.ENTANGLED: self.entangled}
            for (kind, of, t), states in zip(self.noted[:n].tolist(), self.noted_states[:n].copy(), strict=True):
                if kind == NOTED.HAPPENED:
                    self.happened.append(Happened(of, t, *states))
                else:
                    doubts[kind].append((of, t))
        return status

    def _timed(self, name: str, *arguments: Any) -> int:
        function = self.library.function(name)
        begun = clock.perf_counter()
        status = int(function(self.address, *arguments))
        self.seconds += clock.perf_counter() - begun
        return status

    def checkpoint(self) -> bytes:
        """All that the run goes on from."""
        return ctypes.string_at(self.address, self.size)

    def restore(self, checkpoint: bytes) -> None:
        """Go on from where a checkpoint of this run was made, to the same bits."""
        ctypes.memmove(self.address, checkpoint, self.size)

    def report(self) -> Report:
        """The present report of the run."""
        out, states = RunReport(), np.zeros((2, self.n_x))
        self.library.function("simulation_report")(self.address, ctypes.byref(out), ctypes.c_void_p(states.ctypes.data))
        return Report(out, *states)


def run_compiled(module: Module, request: Request, method: str, bar: Any = None,
                 field: RightSide | None = None) -> Outcome:
    """Integrate with a compiled method, by default the plain right-hand side. An error that a function of inputs raises ends the
    run.

    Raises ArgumentError where such a function returns what does not fit.
    """
    library: Any = module.library(replace(field or RightSide(), method=method))
    run = Run(library, with_own_tolerances(request, method))
    chatter = chatter_of(module, request)
    piece = PIECE if chatter is None and request.inputs.function is None else STEPS
    short = _short_steps(module, request, method, field)
    warned = []
    interrupted, stopped, chatters = False, False, ""
    times, n_x = request.times, run.n_x
    stored: list[tuple[np.ndarray, np.ndarray]] = []
    x_out = np.empty((len(times), n_x)) if times is not None else np.empty((STEPS_AT_ONCE, n_x))
    t_out = times if times is not None else np.empty(STEPS_AT_ONCE)
    status, position = run.status, request.span[0]
    try:
        while True:
            done = run.report().of.n_steps
            left = None if request.max_steps is None else request.max_steps - done
            if left is not None and left <= 0 and status != STATUS.STORE_FULL:
                stopped = True
                break
            limit = piece if left is None else min(piece, left)
            status = run.at(t_out, x_out, limit) if times is not None else run.steps(t_out, x_out, limit)
            if times is None and (status == STATUS.STORE_FULL or run.written.value == len(t_out)):
                n = run.written.value
                stored.append((t_out[:n].copy(), x_out[:n].copy()))
                run.written.value = 0
            if bar is not None:
                now = run.report().of.t
                bar.update(abs(now - position))
                position = now
            if status not in (STATUS.STEP_LIMIT, STATUS.STORE_FULL):
                break
            report = run.report()
            of = report.of
            chatters = chatter(of.t, report.x, of.n_steps) if chatter is not None else ""
            if chatters:
                break
            warning, ends = short(of.t, report.x, of.n_steps) if short is not None else ("", False)
            if ends:
                chatters = warning
                break
            if warning:
                warned.append(warning)
                warnings.warn(warning, SimulationWarning, stacklevel=5)  # now: such a run may take very long
    except KeyboardInterrupt:
        interrupted = True
    if run.trouble and isinstance(run.trouble[0], KeyboardInterrupt):
        interrupted = True
    elif run.trouble and run.raised is None:
        raise run.trouble[0]
    written = run.written.value
    if times is None:
        stored.append((t_out[:written].copy(), x_out[:written].copy()))
        t, x = np.concatenate([a for a, _ in stored]), np.concatenate([b for _, b in stored])
    else:
        t, x = times[:written], x_out[:written]
    report = run.report()
    early = interrupted or stopped or bool(chatters) or run.raised is not None
    over = status == STATUS.STOPPED and not early
    success = over or (status == STATUS.DONE and not early)
    message = "reached the end" if success else _message(module, run, status, report, interrupted, stopped, chatters)
    if over:
        stopping = (one.event for one in reversed(run.happened) if module.metadata.events[one.event].stop)
        message = ended(module, next(stopping), report.of.t)
    if over or not success:
        t, x = with_last(t, x, report.of.t, report.x)
    of = report.of
    doubts = [too_quick(module, run.too_quick), not_proved(module, run.hidden, request.event_spacing),
              entangled(module, run.happened, [t for _, t in run.entangled])]
    if status >= 0:
        doubts += [_doubt(module, request, method, of),
                   moved_far(module.name, of.largest_moved, of.t_moved, bool(request.columns))]
    return Outcome(t, x, success, message, interrupted, of.n_steps, of.n_rejected, of.n_evaluations, run.seconds,
                   Corrections(of.largest_dq, of.largest_du, of.n_corrected, of.n_corrections), run.happened, of.n_jacobians,
                   of.n_factorizations, tuple(filter(None, doubts)),
                   warned, None if run.raised is None else run.raised.__cause__,
                   _series_reason(run, report) if status == STATUS.NO_SERIES and not early else "",
                   next_step=of.h)


def _short_steps(module: Module, request: Request, method: str, field: RightSide | None) -> ShortSteps | None:
    """The search for steps that are far too short; None where their length is given or follows from a table of inputs."""
    if method == "gauss" or request.inputs.has_kinks:
        return None

    def trial(t: float, x: np.ndarray, step: float, n: int) -> Outcome:
        part = replace(request, span=(t, request.span[1]), times=None, x0=x.copy(), first_step=step, max_steps=n, look=None)
        return run_compiled(module, part, method, field=field)

    return ShortSteps(module, request, trial)


def moved_far(name: str, most: float, t: float, sensitive: bool = False) -> str:
    """Message about a step whose end, though its error was tolerated, was far off the constraints: rounding, divided by the
    distance from a singular configuration, or in sensitivities by its square."""
    if not most > FAR:
        return ""
    return (f"{name}: next to a singular configuration, at t = {t:.9g} s, projection moved the state"
            f"{' and its sensitivities' if sensitive else ''} by {most:.2g} tolerances: rounding is magnified there, and what "
            "follows may be off by many tolerances; compare with method='bs54', or with another rtol, whose steps pass at "
            "another distance")


def _doubt(module: Module, request: Request, method: str, report: RunReport) -> str:
    """Message about steps whose errors the method did not see, or which are not those that were requested."""
    if method != "gauss":
        return ""
    rough, divided = report.n_rough, report.n_divided if request.first_step else 0
    if rough < 1:
        if not divided:
            return ""
        return (f"{module.name}: method 'gauss' divided {divided} of its steps of one length, the latest of them at t = "
                f"{report.t_rough:.9g} s: its iteration does not converge over the whole of them. With steps of several lengths "
                "it is neither symplectic nor symmetric, and energy may drift; give a shorter first_step")
    return (f"{module.name}: method 'gauss' went across kinks or jumps of the right-hand side, the latest of them just before "
            f"t = {report.t_rough:.9g} s: of the steps that were done again by halves, {rough} differ by more than ten times the "
            f"tolerance; use method='{DEFAULT}'")


def stopped_because(module: Module, run: Run, status: int, report: Report) -> str:
    """Why a run ended before its end, with when and where."""
    return _message(module, run, status, report, False, False, "")


def _message(module: Module, run: Run, status: int, report: Report, interrupted: bool, stopped: bool,
             chatters: str) -> str:
    metadata, of = run.library.metadata, report.of
    x, x_fail = (state[:run.request.n_state] for state in (report.x, report.x_fail))
    t, t_fail = of.t, of.t_fail
    if interrupted:
        return describe_stop(metadata, t, x, "interrupted")
    if run.raised is not None:
        return describe_stop(module.metadata, run.raised.t, run.raised.x, str(run.raised))
    if chatters:
        return describe_stop(metadata, t, x, chatters)
    if stopped:
        return describe_stop(metadata, t, x, f"{of.n_steps} steps were done, as asked")
    if status == STATUS.EVENT_AT_ONCE:
        near = NEAR * AT_ONCE * abs(run.request.span[1] - run.request.span[0])
        return describe_stop(metadata, t, x, at_once(module, run.happened, near))
    if status == STATUS.EVENT_FAILED:
        why = run.library.reason(of.reason) if of.reason else not_known(module, of.bad_index)
        return describe_stop(metadata, t_fail, x_fail, why)
    if status == STATUS.RESET_REJECTED:
        why = reset_rejected(metadata.x[of.bad_index], of.reset_gap)
        return describe_stop(metadata, t_fail, x_fail, why)
    if status == STATUS.RESET_NOT_SMOOTH:
        return describe_stop(metadata, t_fail, x_fail, not_smooth(metadata.x[of.bad_index] if of.bad_index >= 0 else ""))
    if status == STATUS.FIELD_FAILED:
        why = _dependent(module, run, t_fail, x_fail) + _inputs(module, run, t_fail, x_fail)
        return describe_stop(metadata, t_fail, x_fail, run.library.reason(of.reason) + why)
    if status == STATUS.NO_SERIES:
        why = f"the right-hand side has no Taylor series: {_series_reason(run, report)}; use method='{DEFAULT}'"
        return describe_stop(metadata, t_fail, x_fail, why)
    if status == STATUS.STATE_NOT_FINITE:
        bad = of.bad_index
        name = shown_name(metadata.x[bad]) if 0 <= bad < run.n_x else "the state"
        why = _inputs(module, run, t_fail, x_fail)
        return describe_stop(metadata, t_fail, x_fail, f"the derivative of {name} is not finite{why}")
    if status == STATUS.PROJECTION_FAILED:
        why = _dependent(module, run, t_fail, x_fail)
        return describe_stop(metadata, t_fail, x_fail, f"no way back onto the constraints: {_off(module, run, of)}{why}")
    if status == STATUS.STEP_TOO_SMALL:
        chatter = chatter_of(module, run.request)
        why = nearly_singular(module, t, x[:module.metadata.sizes.x], run.request.p) + _dependent(module, run, t, x)
        why += chatter.of_small_steps(t, x) if chatter is not None else ""
        return describe_stop(metadata, t, x, f"the step became too small ({of.h:.3g} s) for the tolerances{why}")
    return describe_stop(metadata, t, x, f"the integrator does not go on (status {status})")


def shown_name(name: str) -> str:
    """An entry of a state as messages call it: of a column "the derivative of q1 by l1"."""
    result = re.fullmatch(r"\(d (.+) by \d+ (.*)\)", name)
    return name if result is None else f"the derivative of {result[1]} by {result[2] or 'an initial value'}"


def _series_reason(run: Run, report: Report) -> str:
    """Why a right-hand side that can be evaluated has no series."""
    reason = report.of.reason
    return run.library.reason(reason) if reason else "its coefficients are not finite"


def _dependent(module: Module, run: Run, t: float, x: np.ndarray) -> str:
    """Addition to a message where constraints depend on each other, unlike at the start."""
    n, request = module.metadata.sizes.x, run.request
    return lost_rank(module, t, x[:n], request.p, request.x0[:n], request.span[0])


def _inputs(module: Module, run: Run, t: float, x: np.ndarray) -> str:
    """Addition to a message where an input is not finite; a function of the user is asked once more."""
    request = run.request
    try:
        return not_finite(module.metadata.inputs, request.inputs.at(t, x[:request.n_state].copy()), t)
    except SymdynError:
        return ""


def _off(module: Module, run: Run, report: RunReport) -> str:
    """Why a projection failed."""
    rows, reason, worst = module.metadata.constraints, report.reason, report.bad_index
    if reason:
        return run.library.reason(reason)
    if 0 <= worst < len(rows):
        return not_converged(rows[worst], report.residual, bool(report.of_speeds))
    return TOO_FAR
