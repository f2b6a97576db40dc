"""Integration by SciPy's solvers, or by what has their interface, step by step, so that nothing is lost when a step fails."""

from __future__ import annotations

import difflib
import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symdyn.backend.packed import NAME, Pattern
from symdyn.backend.right_side import RightSide
from symdyn.errors import ArgumentError, EvaluationError, SimulationWarning
from symdyn.runtime.inputs.inputs import not_finite
from symdyn.runtime.integrating.chatter import STEPS_OF_SCIPY, chatter_of
from symdyn.runtime.integrating.events import Locator, not_proved, too_quick
from symdyn.runtime.integrating.methods import COMPILED
from symdyn.runtime.integrating.outcome import Outcome, Request
from symdyn.runtime.integrating.short_steps import TRIED_OF_SCIPY, ShortSteps
from symdyn.runtime.integrating.stabilization import Corrections, DriftCheck, ProjectionFailed, Projector
from symdyn.runtime.integrating.stops import describe_stop, lost_rank, nearly_singular, with_last
from symdyn.runtime.integrating.taken_back import take_back
from symdyn.runtime.raised import InputRaised
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Steps whose ends are off the constraints and that are not tried again shorter, as a part of the run. In C they come down to
# rounding, which before a place that no motion goes past takes tens of thousands of them: too many in Python.
SHORTEST = 1e-10
_SCIPY = ("RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA")


def solver_class_of(module: Module, method: Any) -> Any:
    """SciPy's class by name, or the class that was given; raises ArgumentError for another method."""
    from scipy import integrate

    if isinstance(method, str):
        if method not in _SCIPY:
            known = [*COMPILED, "auto", *_SCIPY, "ggl", "moreau"]
            alike = difflib.get_close_matches(method.lower(), [name.lower() for name in known], 3)
            near = [name for name in known if name.lower() in alike]
            hint = f", did you mean {' or '.join(near)}? There are" if near else "; there are"
            raise ArgumentError(f"{module.name}: there is no method {shown(method)}{hint} {', '.join(COMPILED)} (compiled), "
                                f"{', '.join(_SCIPY)} (SciPy), auto (chooses one of them), ggl (with constraints), moreau (time "
                                "stepping of rigid contacts), or pass an OdeSolver class")
        method = getattr(integrate, method)
    if method is integrate.Radau:
        from symdyn.runtime.integrating.scipy_radau import RadauWithin

        return RadauWithin
    if isinstance(method, type) and issubclass(method, integrate.OdeSolver):
        return method
    raise ArgumentError(f"{module.name}: method must be a name or an OdeSolver class, found {shown(method)}")


def takes_changed_states(solver_class: Any) -> bool:
    """Whether a solver goes on from y and f alone, so that both may be changed after a step: one-step methods do."""
    from scipy.integrate import Radau
    from scipy.integrate._ivp.rk import RungeKutta

    return issubclass(solver_class, (RungeKutta, Radau))


class Field:
    """The right-hand side as SciPy calls it; it keeps why the step under way could not be evaluated."""

    def __init__(self, module: Module, request: Request, right_side: RightSide) -> None:
        self.module, self.request = module, request
        self.bound = module.bind(request.p)
        self.evaluator = module.library(right_side).evaluator("rhs")
        self.evaluator.set_params(request.field_p)
        self.n_in = len(request.inputs.constant)
        self.trouble: list[str] = []
        self.failed: list[tuple[float, np.ndarray]] = []  # where
        self.cause: BaseException | None = None  # what a function of the user raised there
        self.misfit: ArgumentError | None = None  # what one of inputs returned that does not fit
        self.sparse: SparseJacobian | None = None

    def given(self, t: float, x: np.ndarray) -> Any:
        """Inputs at a state of the mechanism."""
        try:
            return self.request.inputs.at(t, x) if self.n_in else ()
        except ArgumentError as error:
            self.misfit = error
            raise

    def __call__(self, t: float, x: np.ndarray) -> np.ndarray:
        inputs = self.given(t, x[:self.request.n_state]) if self.n_in else None
        try:
            return self.evaluator.one(t, x, inputs)
        except EvaluationError as error:
            if np.isfinite(x).all():
                self.note(error, t, inputs)
                self.failed[:] = [(t, x.copy())]
            return np.full(len(x), np.nan)

    def note(self, error: EvaluationError, t: float, inputs: Any) -> None:
        """Keep why an evaluation failed."""
        which = not_finite(self.module.metadata.inputs, inputs, t)
        self.trouble.append(str(error).removeprefix(f"{self.module.name}: ") + which)
        self.cause = error.__cause__

    def jacobian(self, t: float, x: np.ndarray) -> Any:
        """Exact; the work, if it is integrated too, is one more row, and nothing depends on it."""
        n = self.request.n_state
        state = x[:n]
        inputs = self.given(t, state)
        if self.sparse is not None:
            return self.sparse(t, x, inputs)
        J = self.bound.jacobian_x(t, state, inputs)
        if len(x) == n:
            return J
        bordered = np.zeros((len(x), len(x)))
        bordered[:n, :n] = J
        bordered[n, :n] = self.module.evaluate("power_x", t, state, self.request.p, inputs)
        return bordered


class SparseJacobian:
    """The same as a matrix of SciPy's without the zeros, whose factors have few entries, too."""

    def __init__(self, module: Module, request: Request, there: Pattern) -> None:
        self.module, self.request, self.there = module, request, there
        self.evaluator = module.library(NAME).evaluator(NAME)
        self.evaluator.set_params(request.p)

    def __call__(self, t: float, x: np.ndarray, inputs: Any) -> Any:
        from scipy.sparse import csc_matrix

        n, there = self.request.n_state, self.there
        values, rows, columns = self.evaluator.one(t, x[:n], inputs if len(inputs) else None), there.rows, there.columns
        if len(x) > n:
            work = self.module.evaluate("power_x", t, x[:n], self.request.p, inputs)
            values, rows, columns = np.r_[values, work], np.r_[rows, np.full(n, n)], np.r_[columns, np.arange(n)]
        return csc_matrix((values, (rows, columns)), shape=(len(x), len(x)))


class _Cut(NamedTuple):
    """Where an event ends a step early: the time, the state before; the one to go on from, None where the run ends."""

    t: float
    before: np.ndarray
    after: np.ndarray | None


class Run:
    """One run of a solver, with what is stored of it; solver_class: of SciPy, or called like these."""

    def __init__(self, module: Module, request: Request, solver_class: Any, right_side: RightSide) -> None:
        self.module, self.request, self.solver_class, self.right_side = module, request, solver_class, right_side
        self.metadata = module.library(right_side).metadata
        self.field = Field(module, request, right_side)
        self.options = self._options()
        way = request.stabilization.way
        self.projector = Projector(module, request.p) if way == "projection" else None
        self.drift = DriftCheck(module, request.p) if way == "baumgarte" else None
        self.locator: Locator | None = None
        if request.look is not None and request.look.any():
            span = request.span[1] - request.span[0]
            self.locator = Locator(module, request.p, request.look, self.field.given, request.n_state, span,
                                   request.event_spacing)
        self.chatter = chatter_of(module, request)
        self.short = None if request.inputs.has_kinks else ShortSteps(module, request, self._trial, TRIED_OF_SCIPY)
        self.warned: list[str] = []
        self.here, self.state = request.span[0], request.x0
        self.ts, self.xs = [self.here], [self.state]
        self.pending = list(request.times[1:]) if request.times is not None else []
        self.accepted, self.spent, self.message, self.over = 0, (0, 0, 0, 0), "", False
        self.n_given_up = 0  # steps that were taken and whose ends could not be put onto the constraints
        self.cause: BaseException | None = None  # as in Outcome
        self.raised: InputRaised | None = None
        self.stops = list(request.inputs.stops(request.span))  # kinks of the inputs, at which steps end
        self.proposed = 0.0  # length of the step to be tried next, were there no kink
        self.solver: Any = None
        self.dense: Any = None

    def _options(self) -> dict[str, Any]:
        from scipy import integrate

        request = self.request
        options: dict[str, Any] = {"rtol": request.rtol, "atol": request.atol}
        if request.max_step:
            options["max_step"] = request.max_step
        span = abs(request.span[1] - request.span[0])
        if request.first_step and span:  # as in C: no longer than the run, no shorter than can matter in it
            options["first_step"] = min(max(request.first_step, float(np.finfo(float).eps) ** 2 * span), span)
        exact = request.stabilization.way != "baumgarte" and "jacobian_x" in self.module.functions
        if issubclass(self.solver_class, (integrate.Radau, integrate.BDF, integrate.LSODA)) and exact:
            options["jac"] = self.field.jacobian
        if issubclass(self.solver_class, (integrate.Radau, integrate.BDF)) and exact:
            there = self.module.jacobian_indices()
            if there is not None and there.sparse:
                self.field.sparse = SparseJacobian(self.module, request, there)
        return options

    def start(self) -> None:
        t0, t_end = self.request.span
        if self.projector is not None:
            self.xs[0] = self.state = self.projector(t0, self.request.x0)
        if not np.isfinite(self.field(t0, self.state)).all():  # SciPy would look for a first step for ever
            raise EvaluationError(self.field.trouble[-1]) from self.field.cause
        self.solver = self.solver_class(self.field, t0, self.state, self._bound(), **self._with_first_step(
            self.options.get("first_step", 0.0)))
        if self.locator is not None:
            step = 1e-9 * (t_end - t0)
            if self.request.carried is not None:
                self.locator.carry(self.request.carried, step)
            self.locator.begin(t0, self.state, self.field(t0, self.state), step, after_reset=self.request.carried is not None)

    def _bound(self) -> float:
        """The kink of the inputs ahead, or the end of the run."""
        t_end = self.request.span[1]
        while self.stops and (self.stops[0] - self.here) * (t_end - self.here) <= 0:
            self.stops.pop(0)
        return float(self.stops[0]) if self.stops else t_end

    def _with_first_step(self, length: float) -> dict[str, Any]:
        """Options of a solver that begins here with a step of this length, 0: chosen."""
        later = {k: v for k, v in self.options.items() if k != "first_step"}
        return {**later, "first_step": min(length, abs(self._bound() - self.here))} if length else later

    def _go_on_after_kink(self) -> None:
        """By a new solver, as one of several steps builds on states before the kink."""
        self.spent = self._used()
        options = self._with_first_step(self._next_length)
        self.solver = self.solver_class(self.field, self.here, self.state, self._bound(), **options)

    @property
    def _next_length(self) -> float:
        """Length of the step to be tried by a new solver after a kink, s; 0: chosen, as one of several steps begins by short
        ones."""
        return self.proposed if takes_changed_states(self.solver_class) else 0.0

    def step(self) -> None:
        """One step, its events and outputs; a message if it is the last one."""
        solver, begun, start = self.solver, float(self.solver.t), self.state
        proposed, tried = getattr(solver, "h_abs", 0.0), self.n_given_up
        while True:
            before = vars(solver).copy() if self.projector is not None else {}
            note = solver.step()
            if solver.status == "failed" or not np.isfinite(solver.y).all():
                self.message = self._why_failed(note)
                return
            self.field.trouble.clear()
            # The polynomial of the step ends where the step did, before the projection.
            passed = self.pending and (self.pending[0] - solver.t) * solver.direction < 0
            self.dense = solver.dense_output() if passed or self.locator is not None else None
            if self._project(start, begun, before):
                break
        if self.n_given_up > tried:  # no longer at once, as in C
            proposed = solver.h_abs = min(solver.h_abs, abs(float(solver.t) - begun))
        self.proposed = max(proposed, getattr(solver, "h_abs", 0.0))
        self.accepted += 1
        self.here, self.state = float(solver.t), solver.y.copy()
        cut = self._look(begun, start) if self.locator is not None else None
        if cut is not None:
            self.here, self.state = cut.t, cut.before
        self._store()
        if cut is not None:
            self._go_on(cut)
        if not self.message and self.drift is not None and self.drift(self.here, self.state):
            self.message = self.drift(self.here, self.state) + self.dependent()
        if not self.message and self.solver.status == "finished" and self.here != self.request.span[1]:
            self._go_on_after_kink()
        if not self.message and self.chatter is not None and self.accepted % STEPS_OF_SCIPY == 0:
            self.message = self.chatter(self.here, self.state, self.accepted)
        if not self.message and self.short is not None and self.accepted % TRIED_OF_SCIPY == 0:
            message, ends = self.short(self.here, self.state, self.accepted)
            if ends:
                self.message = message
            elif message:
                self.warned.append(message)
                warnings.warn(message, SimulationWarning, stacklevel=7)  # now: such a run may take very long
        if not self.message and self.accepted == self.request.max_steps and self.solver.status == "running":
            self.message = f"stopped after {self.accepted} steps, as asked"

    def _trial(self, t: float, x: np.ndarray, step: float, n: int) -> Outcome:
        request = replace(self.request, span=(t, self.request.span[1]), times=None, x0=x.copy(), first_step=step, max_steps=n,
                          look=None)
        return type(self)(self.module, request, self.solver_class, self.right_side).through(None)

    def _why_failed(self, note: str | None) -> str:
        if self.field.trouble:
            why, self.cause = self.field.trouble[-1], self.field.cause
        elif note:
            state = self.state[:self.request.n_state]
            why = note.rstrip(".") + nearly_singular(self.module, self.here, state, self.request.p)
            why += self.chatter.of_small_steps(self.here, self.state) if self.chatter is not None else ""
        else:
            why = "the state is not finite"
        return why + self.dependent()

    def dependent(self) -> str:
        """Addition to a message where constraints depend on each other, unlike at the start."""
        n, p, start = self.request.n_state, self.request.p, self.request.x0
        places = [(self.here, self.state), *(self.field.failed if self.field.trouble else ())]
        result = (lost_rank(self.module, t, x[:n], p, start[:n], self.request.span[0]) for t, x in places)
        return next(filter(None, result), "")

    def _project(self, start: np.ndarray, begun: float, before: Mapping[str, Any]) -> bool:
        """Put the end of a step from a state onto the constraints; whether it is there. Where it cannot be, or only by more than
        half the step, the solver gets its attributes before the step back, to try half of it, as in C.

        Raises ProjectionFailed where there is no shorter step.
        """
        solver, request = self.solver, self.request
        if self.projector is None:
            return True
        try:
            projected, moved = self.projector.step(float(solver.t), solver.y, start, request.atol, request.rtol)
        except ProjectionFailed:
            length = abs(float(solver.t) - begun)
            if length <= SHORTEST * abs(request.span[1] - request.span[0]):
                raise
            take_back(solver, before, length / 2)
            self.n_given_up += 1
            return False
        if moved:
            solver.f = solver.fun(solver.t, projected)
        solver.y = projected
        return True

    def between(self, t: float) -> np.ndarray:
        """The state within the latest step."""
        x: np.ndarray = self.dense(t)
        return self.projector(t, x) if self.projector is not None else x

    def _look(self, begun: float, start: np.ndarray) -> _Cut | None:
        """Look for events in the latest step, from the state `start` at `begun`: where it ends early, if it does."""
        locator, solver = self.locator, self.solver
        assert locator is not None
        try:
            while (at := locator.first(begun, float(solver.t), self.between)) is not None:
                x = self.between(at)
                after = locator.after(at, x)
                if after is not None:
                    locator.goes_on(after)
                if after is not None or locator.over or locator.failed:
                    return _Cut(at, x, None if locator.over or locator.failed else after)
                if at == solver.t:
                    return None
        except (EvaluationError, ProjectionFailed) as error:
            locator.failed, self.cause = str(error).removeprefix(f"{self.module.name}: "), error.__cause__
            trusted = locator.known
            return _Cut(trusted, start if trusted == begun else self.between(trusted), None)
        return None

    def _store(self) -> None:
        """The latest step, or the output times that it has passed."""
        there = self.here == self.ts[-1]  # an event at the start of the step cuts it to nothing
        if self.request.times is None and not there and not (self.locator and self.locator.failed):
            self.ts.append(self.here)
            self.xs.append(self.state)
        while self.pending and (self.pending[0] - self.here) * self.solver.direction <= 0:
            self.xs.append(self.state if self.pending[0] == self.here or self.dense is None else self.between(self.pending[0]))
            self.ts.append(self.pending.pop(0))

    def _go_on(self, cut: _Cut) -> None:
        """From the state after an event, by a new solver; or not."""
        locator, solver, t_end = self.locator, self.solver, self.request.span[1]
        assert locator is not None
        if cut.after is None:
            self.over, self.message = bool(locator.over), locator.over or locator.failed
            return
        self.state = cut.after
        if self.request.times is None:
            self.ts.append(self.here)
            self.xs.append(self.state)
        if self.here == t_end:
            return
        step = solver.direction * 1e-6 * solver.step_size
        self.spent = self._used()
        self.solver = self.solver_class(self.field, self.here, self.state, self._bound(), **self._with_first_step(0.0))
        locator.begin(self.here, self.state, self.field(self.here, self.state), step, after_reset=True)

    @property
    def running(self) -> bool:
        return not self.message and self.solver.status == "running"

    def outcome(self, interrupted: bool) -> Outcome:
        done = not self.message or self.over
        n = min(len(self.ts), len(self.xs))  # an interrupt may come between the two
        message = self.message
        if self.raised is not None:  # where the function was called, as in C
            message = describe_stop(self.module.metadata, self.raised.t, self.raised.x, message)
        elif not done:
            message = describe_stop(self.metadata, self.here, self.state, message)
        t, x = np.array(self.ts[:n]), np.array(self.xs[:n])
        if not done or self.over:
            t, x = with_last(t, x, self.here, self.state)
        rejected, evaluations, jacobians, factorizations = self._used()
        rejected += self.n_given_up
        doubts = []
        if self.locator is not None:
            doubts = [too_quick(self.module, self.locator.too_quick),
                      not_proved(self.module, self.locator.hidden, self.request.event_spacing)]
        return Outcome(t, x, done, message or "reached the end", interrupted, self.accepted, rejected, evaluations,
                       corrections=self.projector.corrections if self.projector is not None else Corrections(),
                       happened=self.locator.happened if self.locator is not None else (),
                       n_jacobians=jacobians, n_factorizations=factorizations, doubts=tuple(filter(None, doubts)),
                       warned=self.warned, cause=self.cause, next_step=self._next_length)

    def _used(self) -> tuple[int, int, int, int]:
        """Rejected steps where the solver counts them, evaluations, Jacobians and factorizations, of all solvers so far."""
        names = ("n_rejected", "nfev", "njev", "nlu")
        a, b, c, d = (before + int(getattr(self.solver, name, 0)) for before, name in zip(self.spent, names, strict=True))
        return a, b, c, d

    def through(self, bar: Any) -> Outcome:
        """To the end, or as far as it gets."""
        interrupted = False
        try:
            with np.errstate(all="ignore"):
                self.start()
                while self.running:
                    before = self.here
                    self.step()
                    if bar is not None:
                        bar.update(abs(self.here - before))
        except KeyboardInterrupt:
            interrupted, self.message = True, "interrupted"
        except ProjectionFailed as error:
            self.message = str(error) + self.dependent()
        except InputRaised as error:
            self.raised, self.cause, self.message = error, error.__cause__, str(error)
        except (ValueError, ArithmeticError) as error:
            if error is self.field.misfit:
                raise
            known = bool(self.field.trouble)
            self.cause = self.field.cause if known else error.__cause__
            self.message = (self.field.trouble[-1] if known else str(error)) + self.dependent()
        return self.outcome(interrupted)


def run_scipy(module: Module, request: Request, method: Any, bar: Any, right_side: RightSide) -> Outcome:
    """Integrate with SciPy."""
    return Run(module, request, solver_class_of(module, method), right_side).through(bar)
