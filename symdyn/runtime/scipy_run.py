"""Integration by SciPy's solvers, step by step, so that nothing is lost when a step fails."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError
from symdyn.runtime.events import Locator
from symdyn.runtime.inputs import Inputs, not_finite
from symdyn.runtime.methods import COMPILED
from symdyn.runtime.outcome import Outcome, Request
from symdyn.runtime.stabilization import Corrections, ProjectionFailed, Projector, Watch
from symdyn.runtime.stops import describe_stop, lost_rank, nearly_singular, with_last

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

_SCIPY = ("RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA")


def solver_class_of(module: Module, method: Any) -> Any:
    """SciPy's class by name, or the class that was given; raises ArgumentError for another method."""
    from scipy import integrate

    if isinstance(method, str):
        if method not in _SCIPY:
            raise ArgumentError(f"{module.name}: there is no method {method!r}; there are {', '.join(COMPILED)} (compiled), "
                                f"{', '.join(_SCIPY)}, ggl (with constraints), or pass an OdeSolver class")
        return getattr(integrate, method)
    if isinstance(method, type) and issubclass(method, integrate.OdeSolver):
        return method
    raise ArgumentError(f"{module.name}: method must be a name or an OdeSolver class, found {method!r}")


def takes_changed_states(solver_class: Any) -> bool:
    """Whether a solver goes on from y and f alone, so that both may be changed after a step: one-step methods do."""
    from scipy.integrate import Radau
    from scipy.integrate._ivp.rk import RungeKutta

    return issubclass(solver_class, (RungeKutta, Radau))


def run_scipy(module: Module, request: Request, method: Any, bar: Any, field_name: str) -> Outcome:
    """Integrate with SciPy, step by step, so that nothing is lost when a step fails."""
    from scipy import integrate

    solver_class = solver_class_of(module, method)
    bound = module.bind(request.p)
    evaluator = module.unit(field_name).evaluator("rhs")
    evaluator.set_params(request.field_p)
    projector = Projector(module, request.p) if request.stabilization.way == "projection" else None
    watch = Watch(module, request.p) if request.stabilization.way == "baumgarte" else None
    n_state = request.n_state
    free: Inputs = request.inputs
    n_in = len(free.constant)
    options: dict[str, Any] = {"rtol": request.rtol, "atol": request.atol}
    if request.max_step:
        options["max_step"] = request.max_step
    if request.first_step:
        options["first_step"] = request.first_step
    trouble: list[str] = []  # why the step under way could not be evaluated
    failed: list[tuple[float, np.ndarray]] = []  # where
    raised: list[Exception] = []

    def given(s: float, x: np.ndarray) -> np.ndarray:
        try:
            return free.at(s, x)
        except Exception as error:
            raised.append(error)
            raise

    def jacobian(s: float, x: np.ndarray) -> np.ndarray:
        """Exact; the work, if it is integrated too, is one more row, and nothing depends on it."""
        state = x[:n_state]
        inputs = given(s, state) if n_in else ()
        J = bound.jacobian_x(s, state, inputs)
        if len(x) == n_state:
            return J
        bordered = np.zeros((len(x), len(x)))
        bordered[:n_state, :n_state] = J
        bordered[n_state, :n_state] = module.evaluate("power_x", s, state, request.p, inputs)
        return bordered

    exact = request.stabilization.way != "baumgarte" and "jacobian_x" in module.functions
    if solver_class in (integrate.Radau, integrate.BDF, integrate.LSODA) and exact:
        options["jac"] = jacobian

    def field(s: float, x: np.ndarray) -> np.ndarray:
        inputs = given(s, x[:n_state]) if n_in else None
        try:
            return evaluator.one(s, x, inputs)
        except EvaluationError as error:
            if np.isfinite(x).all():
                trouble.append(str(error).removeprefix(f"{module.name}: ") + not_finite(module.metadata["inputs"], inputs, s))
                failed[:] = [(s, x.copy())]
            return np.full(len(x), np.nan)

    def dependent(x: np.ndarray) -> str:
        """What to add to a message where constraints depend on each other, unlike at the start."""
        places = [(here, x), *(failed if trouble else ())]
        told = (lost_rank(module, s, at[:n_state], request.p, request.x0[:n_state], t0) for s, at in places)
        return next(filter(None, told), "")

    def between(s: float) -> np.ndarray:
        """The state within the latest step."""
        x = dense(s)
        return projector(s, x) if projector is not None else x

    def cut_by_event() -> tuple[float, np.ndarray, np.ndarray | None] | None:
        """Where the latest step ends early: the time, the state before and the one to go on from, if there is one."""
        assert locator is not None
        begun = before
        while (at := locator.first(begun, float(solver.t), between)) is not None:
            x = between(at)
            after = locator.after(at, x)
            if after is not None:  # onto the constraints, whatever keeps the steps there
                after = Projector(module, request.p)(at, after)
            if after is not None or locator.over or locator.failed:
                return at, x, after
            locator.begin(at, x, field(at, x), solver.direction * 1e-6 * solver.step_size)
            if at == solver.t:
                return None
            begun = at
        return None

    t0, t_end = request.span
    locator = None
    if request.look is not None and request.look.any():
        locator = Locator(module, request.p, request.look, lambda s, x: given(s, x) if n_in else (), n_state, t_end - t0)
    ts, xs = [t0], [request.x0]
    pending = list(request.times[1:]) if request.times is not None else []
    accepted, spent, message, interrupted, over = 0, 0, "", False, False
    here, state = t0, request.x0
    solver: Any = None
    dense: Any = None
    before = t0
    try:
        with np.errstate(all="ignore"):
            if projector is not None:
                xs[0] = state = projector(t0, request.x0)
            if not np.isfinite(field(t0, state)).all():  # SciPy would look for a first step for ever
                raise EvaluationError(trouble[-1])
            solver = solver_class(field, t0, state, t_end, **options)
            if locator is not None:
                locator.begin(t0, state, field(t0, state), 1e-9 * (t_end - t0))
            while solver.status == "running":
                before = solver.t
                note = solver.step()
                if solver.status == "failed" or not np.isfinite(solver.y).all():
                    message = trouble[-1] if trouble else note.rstrip(".") + nearly_singular(
                        module, here, state[:n_state], request.p) if note else "the state is not finite"
                    message += dependent(state)
                    break
                trouble.clear()
                # The polynomial of the step ends where the step did, before the projection.
                passed = pending and (pending[0] - solver.t) * solver.direction < 0
                dense = solver.dense_output() if passed or locator is not None else None
                if projector is not None:
                    tolerated = request.atol + request.rtol * np.abs(solver.y)
                    projected, moved = projector.step(float(solver.t), solver.y, tolerated)
                    if moved:
                        solver.f = solver.fun(solver.t, projected)
                    solver.y = projected
                accepted += 1
                here, state = float(solver.t), solver.y.copy()
                cut = cut_by_event() if locator is not None else None
                if cut is not None:
                    here, state = cut[:2]
                if request.times is None:
                    ts.append(here)
                    xs.append(state)
                while pending and (pending[0] - here) * solver.direction <= 0:
                    xs.append(state if pending[0] == here or dense is None else between(pending[0]))
                    ts.append(pending.pop(0))
                if cut is not None and locator is not None:
                    if locator.over or locator.failed:
                        over, message = bool(locator.over), locator.over or locator.failed
                        break
                    assert cut[2] is not None
                    state = cut[2]
                    if request.times is None:
                        ts.append(here)
                        xs.append(state)
                    if here == t_end:
                        break
                    step = solver.direction * 1e-6 * solver.step_size
                    spent += int(solver.nfev)
                    solver = solver_class(field, here, state, t_end, **{k: v for k, v in options.items() if k != "first_step"})
                    locator.begin(here, state, field(here, state), step)
                if bar is not None:
                    bar.update(abs(solver.t - before))
                if watch is not None and watch(here, state):
                    message = watch(here, state) + dependent(state)
                    break
                if request.max_steps is not None and accepted >= request.max_steps and solver.status == "running":
                    message = f"stopped after {accepted} steps, as asked"
                    break
    except KeyboardInterrupt:
        interrupted, message = True, "interrupted"
    except ProjectionFailed as error:
        message = str(error) + dependent(state)
    except (ValueError, ArithmeticError) as error:
        if error in raised:
            raise
        message = (trouble[-1] if trouble else str(error)) + dependent(state)
    done = not message or over
    n = min(len(ts), len(xs))  # an interrupt may come between the two
    if not done:
        message = describe_stop(module.unit(field_name).metadata, here, state, message)
    t, x = np.array(ts[:n]), np.array(xs[:n])
    if not done or over:
        t, x = with_last(t, x, here, state)
    return Outcome(t, x, done, message or "reached the end", interrupted, accepted, 0,
                   spent + (int(solver.nfev) if solver is not None else 0),
                   corrections=projector.corrections if projector is not None else Corrections(),
                   happened=locator.happened if locator is not None else (),
                   n_jacobians=int(solver.njev) if solver is not None else 0,
                   n_factorizations=int(solver.nlu) if solver is not None else 0)
