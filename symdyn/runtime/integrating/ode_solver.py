"""The compiled methods as classes that `scipy.integrate.solve_ivp` takes: a step at a time, and the motion within each step."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from scipy.integrate import DenseOutput, OdeSolver

from symdyn.backend.right_side import RightSide
from symdyn.errors import ArgumentError, EvaluationError, SimulationWarning
from symdyn.kinds import flag
from symdyn.runtime.consistent import check_start, normalised
from symdyn.runtime.contact_numbers import check_contact_numbers
from symdyn.runtime.inputs.inputs import Inputs, take_inputs
from symdyn.runtime.integrating.charts import warn_near_lock
from symdyn.runtime.integrating.compiled import Run, stopped_because
from symdyn.runtime.integrating.methods import COMPILED, check_compiled, is_compiled, with_own_tolerances
from symdyn.runtime.integrating.outcome import Request
from symdyn.runtime.integrating.run_record import STATUS
from symdyn.runtime.integrating.simulate import checked_positive, checked_tolerances, integrate, stabilization_of
from symdyn.runtime.integrating.stabilization import Projector
from symdyn.runtime.masses import real_parameters
from symdyn.runtime.solutions.validity import VALIDITY_CHECKS, warn
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import Values
    from symdyn.runtime.module import InputValues, Module

# Where `fun` is compared with the right-hand side: at the start, and at a part of the span with every entry of the state moved.
_PART, _MOVED = 0.618, 0.01
# Differences of rounding, such as between backends, are smaller; other parameters or inputs make larger ones.
_SAME = 1e-9


@dataclass(frozen=True)
class Setting:
    """Data of an integration: the module, the method's name, parameters (n_p,), inputs for a span, what keeps the constraints."""

    module: Module
    method: str
    p: np.ndarray
    inputs: Callable[[tuple[float, float] | None], Inputs]
    stabilization: str | tuple[str, float] | None

    @classmethod
    def of(cls, module: Module, method: str, params: Values | None, inputs: InputValues | None, events: bool,
           stabilization: str | tuple[str, float] | None, interpolation: str, extend: str) -> Setting:
        """Raises ArgumentError for what steps that SciPy asks for one by one cannot do."""
        if not is_compiled(method):
            raise ArgumentError(f"{module.name}: a solver by the method {shown(method)} asked for; there are "
                                f"{', '.join(COMPILED)}. SciPy's own methods take module.rhs as it is, and "
                                "module.simulate takes all others")
        about = module.metadata
        if about.contacts or about.contact_groups:
            raise ArgumentError(f"{module.name}: rigid contacts switch between modes, which solve_ivp does not do; use "
                                "module.simulate")
        changing = [e.name for e in about.events if e.reset or e.stop]
        if flag(events, f"{module.name}: events") and changing:
            raise ArgumentError(f"{module.name}: the events {', '.join(changing)} reset states or end the motion, which "
                                "solve_ivp does not know of; use module.simulate, or pass events=False to leave them out")
        taken = functools.partial(_taken, module, inputs, interpolation, extend)
        taken(None)
        return cls(module, method, real_parameters(module, params), taken, stabilization)


def _taken(module: Module, given: InputValues | None, interpolation: str, extend: str,
           span: tuple[float, float] | None) -> Inputs:
    """Inputs over a span. Raises ArgumentError as simulate does, and for controllers whose values are held."""
    about = module.metadata
    free = take_inputs(given, about.inputs, about.initial, module.name, span, interpolation, extend, about.motions)
    if free.are_held:
        raise ArgumentError(f"{module.name}: a sampled controller acts at instants, which solve_ivp does not know of; use "
                            "module.simulate")
    return free


class CompiledSolver(OdeSolver):
    """A compiled method as SciPy's solvers are used; see Module.ode_solver, which makes classes of it for one setting."""

    setting: ClassVar[Setting]
    y: np.ndarray

    @classmethod
    def rhs(cls, t: float, y: np.ndarray) -> np.ndarray:
        """x_dot (n_x,) at a state y (n_x,), or (n_x, k) at k states."""
        return cls._evaluated("rhs", t, y)

    @classmethod
    def jac(cls, t: float, y: np.ndarray) -> np.ndarray:
        """d x_dot / d x (n_x, n_x), exact, for SciPy's implicit methods; inputs are held."""
        return cls._evaluated("jacobian_x", t, y)

    @classmethod
    def _evaluated(cls, name: str, t: float, y: np.ndarray) -> np.ndarray:
        of, state = cls.setting, np.asarray(y).T
        rows = of.inputs(None).rows(np.full(len(np.atleast_2d(state)), t), np.atleast_2d(state))
        values = of.module.evaluate(name, t, state, of.p, rows[0] if state.ndim == 1 else rows)
        return values if state.ndim == 1 else np.moveaxis(values, 0, -1)

    def __init__(self, fun: Callable[[float, np.ndarray], Any] | None, t0: float, y0: np.ndarray, t_bound: float,
                 vectorized: bool = False, rtol: float = 1e-8, atol: float | Sequence[float] | None = None,
                 max_step: float = np.inf, first_step: float | None = None, **others: Any) -> None:
        of = self.setting
        name = of.module.name
        if not np.isfinite([t0, t_bound]).all():
            raise ArgumentError(f"{name}: the span ({t0}, {t_bound}) is not finite; pass an end, which compiled "
                                "methods fit their steps to")
        if others:
            warnings.warn(f"{name}: the compiled method {of.method!r} has no use for {', '.join(sorted(others))}",
                          SimulationWarning, stacklevel=3)
        super().__init__(fun or self.rhs, t0, y0, t_bound, vectorized)
        if self.y.shape != (of.module.metadata.sizes.x,):
            raise ArgumentError(f"{name}: y0 has {self.y.size} numbers, needed are {of.module.metadata.sizes.x}: "
                                f"{', '.join(of.module.metadata.x)}")
        free = of.inputs((t0, t_bound))
        self.module = of.module.following(free)
        start = normalised(self.module, self.y.copy())
        check_start(self.module, t0, start, of.p)
        if self.module.metadata.compliant or self.module.metadata.contacts:
            check_contact_numbers(self.module, t0, start, of.p, free.at(t0, start))
        self.request = request = self._request(free, (t0, t_bound), start, rtol, atol, max_step, first_step)
        check_compiled(self.module, request.inputs, of.method)
        request = replace(request, stabilization=stabilization_of(self.module, request, of.method, of.stabilization))
        by_gain = request.stabilization.way == "baumgarte"
        if by_gain:
            request = replace(request, x0=Projector(self.module, of.p)(t0, start))
        if fun is not None:
            self._compare(free)
        library: Any = self.module.library(RightSide(method=of.method, baumgarte=by_gain))
        self.run = Run(library, with_own_tolerances(request, of.method))
        self._t, self._x = np.empty(1), np.empty((1, self.n))
        self._states = [(t0, start)]
        if self.n and t0 != t_bound:
            self._checked(self.run.steps(self._t, self._x, 0))
            self.y = self._x[0].copy()
        self._count()

    def _request(self, free: Inputs, span: tuple[float, float], start: np.ndarray, rtol: Any, atol: Any, max_step: Any,
                 first_step: Any) -> Request:
        module = self.module
        return Request(span, None, start, self.setting.p, free, *checked_tolerances(module, rtol, atol),
                       checked_positive(module, max_step, "max_step"),
                       checked_positive(module, 0.0 if first_step is None else first_step, "first_step"), None, len(start))

    def _compare(self, free: Inputs) -> None:
        """Raises ArgumentError where `fun` is not what is integrated, such as with other parameters."""
        moved = self.y + _MOVED * (1.0 + np.abs(self.y)) * np.cos(np.arange(self.n))
        for t, y in ((self.t, self.y), (self.t + _PART * (self.t_bound - self.t), moved)):
            try:
                wanted = self.module.evaluate("rhs", t, y, self.setting.p, free.at(t, y))
            except EvaluationError:
                continue
            result = np.asarray(self.fun_single(t, y), dtype=float)
            if result.shape != wanted.shape or not np.abs(result - wanted).max() <= _SAME * np.abs(wanted).max():
                raise ArgumentError(f"{self.module.name}: fun is not the right-hand side that this solver integrates: at "
                                    f"t = {t:.6g} it returns {shown(result)} instead of {shown(wanted)}; pass "
                                    "solver.rhs as fun, with the parameters and inputs given to module.ode_solver")

    def _step_impl(self) -> tuple[bool, str | None]:
        run = self.run
        run.written.value, status = 0, STATUS.STEP_LIMIT
        while status == STATUS.STEP_LIMIT and not run.written.value:
            status = run.steps(self._t, self._x, 1)
        self._count()
        if not run.written.value:
            self._checked(status)
            return False, stopped_because(self.module, run, status, run.report())
        self.t, self.y = float(self._t[0]), self._x[0].copy()
        if self.module.metadata.validity_checks or self.module.metadata.charts:
            self._states.append((self.t, self.y))
            if status == STATUS.DONE:
                self._warn()
        return True, None

    def _checked(self, status: int) -> None:
        """Raises what a function of inputs raised, and EvaluationError where a run cannot begin."""
        run = self.run
        if run.trouble:
            raise run.trouble[0]
        if status < 0 and not run.report().of.n_steps:
            raise EvaluationError(f"{self.module.name}: {stopped_because(self.module, run, status, run.report())}")

    def _count(self) -> None:
        of = self.run.report().of
        self.nfev, self.njev, self.nlu = of.n_evaluations, of.n_jacobians, of.n_factorizations

    def _warn(self) -> None:
        """Warnings of simulate about a whole motion."""
        t, x = (np.array(part) for part in zip(*self._states, strict=True))
        request, module = self.run.request, self.module
        if module.metadata.validity_checks:
            warn(module, module.evaluate(VALIDITY_CHECKS, t, x, request.p, request.inputs.rows(t, x)), "in this motion", 4, t)
        warn_near_lock(module, request, t, x, lambda part: integrate(module, part, self.setting.method), 4)

    def _dense_output_impl(self) -> WithinStep:
        assert self.t_old is not None
        middle = self.t_old + 0.5 * (self.t - self.t_old)
        self._within(None, np.array([middle]))  # prepares what is needed within this step, once
        self._count()
        return WithinStep(self.t_old, self.t, functools.partial(self._within, self.run.checkpoint()))

    def _within(self, checkpoint: bytes | None, times: np.ndarray) -> np.ndarray:
        """States (n, n_t) at times within the step that a checkpoint was made after; None: within the latest step."""
        run, x = self.run, np.empty((len(times), self.n))
        now = run.checkpoint() if checkpoint is not None else b""
        if checkpoint is not None:
            run.restore(checkpoint)
        try:
            run.written.value = 0
            status = run.at(times, x, 0)
            self._checked(STATUS.DONE)
            if run.written.value < len(times):
                raise EvaluationError(f"{self.module.name}: {stopped_because(self.module, run, status, run.report())}")
        finally:
            if now:
                run.restore(now)
        return x.T


class WithinStep(DenseOutput):
    """The motion within one step, as exact as the method's own output there, on the constraints."""

    def __init__(self, t_old: float, t: float, states: Callable[[np.ndarray], np.ndarray]) -> None:
        super().__init__(t_old, t)
        self.states = states

    def _call_impl(self, t: Any) -> np.ndarray:
        times = np.array(np.atleast_1d(t), dtype=float)
        outside = times[~((times >= self.t_min) & (times <= self.t_max))]
        if len(outside):
            raise ArgumentError(f"t = {outside[0]:.9g} lies outside of the step from {self.t_old:.9g} to {self.t:.9g}; integrate "
                                "over a span that contains it")
        result = self.states(times)
        return result[:, 0] if np.ndim(t) == 0 else result


def solver_of(setting: Setting) -> type[CompiledSolver]:
    """A class for one setting."""
    return type(setting.method, (CompiledSolver,), {"setting": setting, "__doc__": CompiledSolver.__doc__})
