"""Integration of the stabilized index-2 form by an implicit method for differential-algebraic equations.

q_dot = N (u + C_r^T mu) + n_t, M u_dot + k - F + C_r^T lam = 0, C = 0, C_dot = 0 with the multipliers as derivatives,
lam = Lambda_dot, mu = Mu_dot, which makes it one of index 1 in y = [q; u; z; Lambda; Mu].
Source: Gear, Leimkuhler and Gupta, Automatic integration of Euler-Lagrange equations with constraints, J. Comput. Appl. Math.
12 (1985); multipliers as derivatives: Gear, Differential-algebraic equation index transformations, SIAM J. Sci. Stat. Comput.
9 (1988).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError, MissingExtra
from symdyn.runtime.constraints import names, rank
from symdyn.runtime.inputs import not_finite
from symdyn.runtime.outcome import Outcome, Request
from symdyn.runtime.stabilization import ProjectionFailed, Projector
from symdyn.runtime.stops import describe_stop, lost_rank, with_last

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# The integrals of multipliers have no meaning of their own: their errors are not controlled. (The multipliers of a solution
# are those of its states, which are some thirty times as accurate as the derivatives of the collocation polynomial.)
_UNCONTROLLED = 1e100


def check_ggl(module: Module, x: np.ndarray, params: np.ndarray, t: float, stabilization: Any, work: bool, events: bool) -> None:
    """Raise ArgumentError if the form does not apply, MissingExtra if the solver is not installed."""
    known = names(module)
    if not known:
        raise ArgumentError(f"{module.name}: method 'ggl' is for equations with constraints, and there are none; leave it out")
    if stabilization is not None:
        raise ArgumentError(f"{module.name}: method 'ggl' keeps the constraints itself; leave out "
                            f"stabilization={stabilization!r}")
    if work:
        raise ArgumentError(f"{module.name}: method 'ggl' does not integrate the work of loads; leave out work=True, or take "
                            "another method")
    if events:
        raise ArgumentError(f"{module.name}: method 'ggl' does not look for events; pass events=False, or take another method")
    independent = int(rank(module, t, x, params))
    if independent < len(known):
        raise ArgumentError(f"{module.name}: method 'ggl' needs independent constraints; of {len(known)} only {independent} are. "
                            "Take another method, or leave some of them out")
    _solver()


def _solver() -> Any:
    try:
        from solve_dae.integrate import RadauDAE
    except ImportError:
        raise MissingExtra("method 'ggl' needs the package solve-dae: pip install 'symdyn[dae]'") from None
    return RadauDAE


def run_ggl(module: Module, request: Request, bar: Any = None) -> Outcome:
    """Integrate step by step, so that nothing is lost when a step fails."""
    n_x, n_c, free = request.n_state, len(names(module)), request.inputs
    n_in = len(free.constant)
    evaluator = module.unit("residual").evaluator("residual")
    evaluator.set_params(request.p)
    trouble: list[str] = []
    raised: list[Exception] = []

    def residual(t: float, y: np.ndarray, yd: np.ndarray) -> np.ndarray:
        state = y[:n_x]
        try:
            inputs = free.at(t, state) if n_in else None
        except Exception as error:
            raised.append(error)
            raise
        try:
            return evaluator.one(t, state, inputs, yd)
        except EvaluationError as error:
            if np.isfinite(y).all() and np.isfinite(yd).all():
                trouble.append(str(error).removeprefix(f"{module.name}: ") + not_finite(module.metadata["inputs"], inputs, t))
            return np.full(len(y), np.nan)

    t0, t_end = request.span
    here, state = t0, request.x0
    ts, xs = [t0], [state]
    pending = list(request.times[1:]) if request.times is not None else []
    accepted, message, interrupted = 0, "", False
    solver: Any = None
    try:
        with np.errstate(all="ignore"):
            state = Projector(module, request.p)(t0, request.x0)
            inputs = free.at(t0, state) if n_in else ()
            lam = module.evaluate("lam", t0, state, request.p, inputs)
            xs[0] = state
            y0 = np.concatenate([state, np.zeros(2 * n_c)])
            yd0 = np.concatenate([module.evaluate("rhs", t0, state, request.p, inputs), lam, np.zeros(n_c)])
            if t_end == t0:
                times = request.times if request.times is not None else np.array([t0])
                ts, xs = list(times), [state] * len(times)
            else:
                solver = _solver()(residual, t0, y0, yd0, t_end, rtol=request.rtol, max_step=request.max_step or np.inf,
                                   atol=np.append(request.atol, np.full(2 * n_c, _UNCONTROLLED)),
                                   first_step=request.first_step or None)
            while solver is not None and solver.status == "running":
                before = solver.t
                note = solver.step()
                if solver.status == "failed" or not np.isfinite(solver.y).all():
                    message = trouble[-1] if trouble else (note or "the state is not finite").rstrip(".") + lost_rank(
                        module, here, state, request.p, request.x0, t0)
                    break
                accepted += 1
                here, state = float(solver.t), solver.y[:n_x].copy()
                trouble.clear()
                if request.times is None:
                    ts.append(here)
                    xs.append(state)
                while pending and (pending[0] - solver.t) * solver.direction <= 0:
                    xs.append(state if pending[0] == solver.t else solver.dense_output()(pending[0])[0][:n_x])
                    ts.append(pending.pop(0))
                if bar is not None:
                    bar.update(abs(solver.t - before))
                if request.max_steps is not None and accepted >= request.max_steps and solver.status == "running":
                    message = f"stopped after {accepted} steps, as asked"
                    break
    except KeyboardInterrupt:
        interrupted, message = True, "interrupted"
    except ProjectionFailed as error:
        message = str(error)
    except (ValueError, ArithmeticError) as error:
        if error in raised:
            raise
        message = trouble[-1] if trouble else str(error)
    n = min(len(ts), len(xs))  # an interrupt may come between them
    t, x = np.array(ts[:n]), np.array(xs[:n])
    if message:
        message = describe_stop(module.metadata, here, state, message)
        t, x = with_last(t, x, here, state)
    return Outcome(t, x, not message, message or "reached the end", interrupted, accepted,
                   int(getattr(solver, "nrejct", 0)), int(getattr(solver, "nfev", 0)))
