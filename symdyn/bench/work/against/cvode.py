"""CVODE of SUNDIALS: Adams methods with fixed-point iterations, BDF with our exact Jacobian and dense linear algebra."""

from __future__ import annotations

import ctypes
import time as clock
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.bench.work.against import sundials
from symdyn.bench.work.against.peer import Ran, Runner

_ADAMS, _BDF, _NORMAL, _ONE_STEP = 1, 2, 1, 2


@dataclass(frozen=True)
class Cvode:
    """One family of methods: adams or not."""

    adams: bool
    bodies = False

    @property
    def name(self) -> str:
        return "CVODE Adams" if self.adams else "CVODE BDF"

    @property
    def title(self) -> str:
        how = "Adams, fixed-point iterations" if self.adams else "BDF, exact Jacobian"
        return f"SUNDIALS CVODE of scikit-sundae {sundials.version()}, {how}; our compiled right-hand side"

    def available(self) -> bool | str:
        return sundials.installed()

    def prepare(self, equations: Any, params: np.ndarray, x0: np.ndarray, end: float, system: Any = None) -> Runner:
        library = sundials.Sundials(equations, ("rhs",) if self.adams else ("rhs", "jacobian_x"), params)
        return lambda tolerance, times=None: self._run(library, x0, end, tolerance, times)

    def _run(self, library: sundials.Sundials, x0: np.ndarray, end: float, tolerance: float, times: np.ndarray | None) -> Ran:
        x, t = np.array(x0, dtype=float), ctypes.c_double()
        y = library.vector(x)
        memory = library("cvode", "CVodeCreate", _ADAMS if self.adams else _BDF, library.context, made=True)
        library("cvode", "CVodeInit", memory, library.callback("rhs"), 0.0, y)
        used: list[tuple[str, str, Any]] = []
        try:
            library("cvode", "CVodeSStolerances", memory, tolerance, tolerance)
            library("cvode", "CVodeSetUserData", memory, ctypes.byref(library.given))
            library("cvode", "CVodeSetMaxNumSteps", memory, sundials.MANY_STEPS)
            library("cvode", "CVodeSetMaxHnilWarns", memory, ctypes.c_int(-1))  # which it would print
            library("cvode", "CVodeSetStopTime", memory, float(end))
            if self.adams:
                iteration = library("cvode", "SUNNonlinSol_FixedPoint", y, 0, library.context, made=True)
                library("cvode", "CVodeSetNonlinearSolver", memory, iteration)
                used = [("core", "SUNNonlinSolFree", iteration)]
            else:
                used = library.solve_linear("cvode", "CVodeSetLinearSolver", memory, y, len(x))
                library("cvode", "CVodeSetJacFn", memory, library.callback("jacobian"))
            begun = clock.perf_counter()
            if times is None:
                library("cvode", "CVode", memory, float(end), y, ctypes.byref(t), _NORMAL)
            else:
                step = lambda: library("cvode", "CVode", memory, float(end), y, ctypes.byref(t), _ONE_STEP)
                x = library.between("cvode", "CVodeGetDky", memory, (x, t), step, times)
            return clock.perf_counter() - begun, library.count("cvode", "CVodeGetNumRhsEvals", memory), x
        finally:
            library.free("cvode", "CVodeFree", memory, [*used, ("core", "N_VDestroy", y)])


PEERS = (Cvode(adams=True), Cvode(adams=False))
