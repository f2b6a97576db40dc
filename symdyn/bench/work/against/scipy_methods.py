"""SciPy's integrators on our compiled right-hand side: DOP853, Radau, and LSODA with its loop outside Python."""

from __future__ import annotations

import time as clock
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from scipy import integrate
from scipy.integrate import odeint

from symdyn.bench.work.against.peer import LONGEST, Failed, Ran, Runner, fitting
from symdyn.bench.work.against.walk import constant_inputs
from symdyn.errors import EvaluationError

_MANY_STEPS = 10**8


@dataclass(frozen=True)
class Scipy:
    """One of them; Radau and LSODA get the exact Jacobian."""

    method: str
    bodies = False

    @property
    def name(self) -> str:
        return f"scipy {self.method}"

    @property
    def title(self) -> str:
        return f"SciPy {scipy.__version__} {self.method}; our compiled right-hand side"

    def available(self) -> bool | str:
        return True

    def prepare(self, equations: Any, params: np.ndarray, x0: np.ndarray, end: float, system: Any = None) -> Runner:
        bound = equations.compile().bind(params)
        inputs = tuple(constant_inputs(equations).values())
        f = (lambda t, x: bound.rhs(t, x, inputs)) if inputs else bound.rhs
        slope = (lambda t, x: bound.jacobian_x(t, x, inputs)) if inputs else bound.jacobian_x
        if self.method != "DOP853":
            with fitting("SciPy"):
                slope(0.0, x0)  # which compiles it

        def run(tolerance: float, times: np.ndarray | None = None) -> Ran:
            begun = clock.perf_counter()
            try:
                x, evaluations = self._odeint(f, slope, x0, end, tolerance, times) if self.method == "LSODA" else self._solver(
                    f, slope, x0, end, tolerance, times)
            except (EvaluationError, ValueError) as error:
                raise Failed(f"{self.name} at {tolerance:g}: {error}") from None
            return clock.perf_counter() - begun, evaluations, x

        return run

    def _solver(self, f: Any, slope: Any, x0: np.ndarray, end: float, tolerance: float, times: np.ndarray | None
                ) -> tuple[np.ndarray, int]:
        exact = {"jac": slope} if self.method == "Radau" else {}
        last = clock.perf_counter() + LONGEST
        states: list[np.ndarray] = []
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # a tolerance below what it takes is raised to that
            solver = getattr(integrate, self.method)(f, 0.0, x0, end, rtol=tolerance, atol=tolerance, **exact)
            while solver.status == "running":
                message = solver.step()
                if times is not None and solver.status != "failed":
                    states += [solver.dense_output()(t) for t in times[len(states):np.searchsorted(times, solver.t, "right")]]
                if clock.perf_counter() > last:
                    raise Failed(f"{self.name} at {tolerance:g} takes longer than {LONGEST:g} s")
        if solver.status == "failed":
            raise Failed(f"{self.name} at {tolerance:g}: {message}")
        return solver.y if times is None else np.array(states), solver.nfev

    def _odeint(self, f: Any, slope: Any, x0: np.ndarray, end: float, tolerance: float, times: np.ndarray | None
                ) -> tuple[np.ndarray, int]:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what it says is looked at
            # With times its first step is another one, which it chooses by the first of them.
            rows, message = odeint(f, x0, np.r_[0.0, end if times is None else times], Dfun=slope, tfirst=True, rtol=tolerance,
                                   atol=tolerance, full_output=True, mxstep=_MANY_STEPS, tcrit=(end,))
        if message["message"] != "Integration successful.":
            raise Failed(f"{self.name} at {tolerance:g}: {message['message']}")
        return rows[-1] if times is None else rows[1:], int(message["nfe"][-1])


PEERS = (Scipy("DOP853"), Scipy("LSODA"), Scipy("Radau"))
