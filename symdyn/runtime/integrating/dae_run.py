"""Integration of the stabilized index-2 form by an implicit method for differential-algebraic equations.

q_dot = N (u + C_r^T mu) + n_t, M u_dot + k - F + C_r^T lam = 0, C = 0, C_dot = 0 with the multipliers as derivatives,
lam = Lambda_dot, mu = Mu_dot, which makes it one of index 1 in y = [q; u; z; Lambda; Mu].
Source: Gear, Leimkuhler and Gupta, Automatic integration of Euler-Lagrange equations with constraints, J. Comput. Appl. Math.
12 (1985); multipliers as derivatives: Gear, Differential-algebraic equation index transformations, SIAM J. Sci. Stat. Comput.
9 (1988).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.right_side import RightSide
from symdyn.errors import ArgumentError, EvaluationError, MissingExtra
from symdyn.runtime.constraints import names, rank
from symdyn.runtime.integrating.outcome import Outcome, Request
from symdyn.runtime.integrating.scipy_run import Field, Run
from symdyn.runtime.integrating.stabilization import Projector
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# The integrals of multipliers have no meaning of their own: their errors are not controlled. (The multipliers of a solution
# are those of its states, which are some thirty times as accurate as the derivatives of the collocation polynomial.)
_UNCONTROLLED = 1e100


def check_ggl(module: Module, x: np.ndarray, params: np.ndarray, t: float, stabilization: Any, work: bool) -> None:
    """Raise ArgumentError if the form does not apply, MissingExtra if the solver is not installed."""
    known = names(module)
    if not known:
        raise ArgumentError(f"{module.name}: method 'ggl' is for equations with constraints, and there are none; leave it out")
    if stabilization is not None:
        raise ArgumentError(f"{module.name}: method 'ggl' keeps the constraints itself; leave out "
                            f"stabilization={shown(stabilization)}")
    if work:
        raise ArgumentError(f"{module.name}: method 'ggl' does not integrate the work of loads; leave out work=True, or take "
                            "another method")
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
    """Integrate from the nearest state that fulfils the constraints."""
    return _Run(module, request, Stabilized, RightSide()).through(bar)


class _Run(Run):
    def start(self) -> None:
        self.xs[0] = self.state = Projector(self.module, self.request.p)(self.here, self.request.x0)
        super().start()


class Stabilized:
    """The solver, called like those of SciPy: its y is the state of the mechanism, without the integrals of multipliers.

    field   right-hand side, of whose mechanism and inputs it is; x0: on the constraints
    """

    def __init__(self, field: Field, t0: float, x0: np.ndarray, t_end: float, rtol: float, atol: np.ndarray,
                 max_step: float = np.inf, first_step: float | None = None) -> None:
        module, p, integrals = field.module, field.request.p, np.zeros(len(names(field.module)))
        self.field, self.n_x = field, len(x0)
        self.evaluator = module.library("residual").evaluator("residual")
        self.evaluator.set_params(p)
        lam = module.evaluate("lam", t0, x0, p, field.given(t0, x0))
        self.solver = _solver()(self.residual, t0, np.concatenate([x0, integrals, integrals]),
                                np.concatenate([field(t0, x0), lam, integrals]), t_end, rtol=rtol, max_step=max_step,
                                atol=np.append(atol, np.full(2 * len(lam), _UNCONTROLLED)), first_step=first_step)
        self.status = self.solver.status

    def residual(self, t: float, y: np.ndarray, yd: np.ndarray) -> np.ndarray:
        """Residual of the form, (n_x + 2 n_c,); NaN where it cannot be evaluated, which the field keeps the reason of."""
        state = y[:self.n_x]
        inputs = self.field.given(t, state)
        try:
            return self.evaluator.one(t, state, inputs if self.field.n_in else None, yd)
        except EvaluationError as error:
            if np.isfinite(y).all() and np.isfinite(yd).all():
                self.field.note(error, t, inputs)
            return np.full(len(y), np.nan)

    def step(self) -> str | None:
        """One step; returns why it failed."""
        if self.t == self.solver.t_bound:
            self.status = "finished"
            return None
        note: str | None = self.solver.step()
        self.status = self.solver.status
        return note

    def dense_output(self) -> Callable[[float], np.ndarray]:
        """The state within the latest step."""
        polynomials = self.solver.dense_output()
        return lambda t: np.asarray(polynomials(t)[0][:self.n_x])

    def __getattr__(self, name: str) -> Any:
        """All other attributes, such as the direction and the counts, are the solver's own."""
        return getattr(self.solver, name)

    @property
    def y(self) -> np.ndarray:
        """The state, (n_x,)."""
        return np.asarray(self.solver.y[:self.n_x])

    @property
    def step_size(self) -> float:
        """Length of the latest step, s."""
        return abs(float(self.t - self.solver.t_old))

    @property
    def n_rejected(self) -> int:
        """Steps given up."""
        return int(self.solver.nrejct)
