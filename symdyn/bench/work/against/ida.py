"""IDA of SUNDIALS on the stabilized index-2 form of Gear, Gupta and Leimkuhler, with its exact Jacobian."""

from __future__ import annotations

import ctypes
import time as clock
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from symdyn.bench.work.against import sundials
from symdyn.bench.work.against.peer import Ran, Runner, Unfit
from symdyn.formulation.constraints.motion import residual_names
from symdyn.tape.differentiate import jacobian

_NORMAL, _ONE_STEP = 1, 2
# The integrals of the multipliers have no meaning of their own: their errors are not controlled.
_UNCONTROLLED = 1e8


@dataclass(frozen=True)
class Ida:
    """The integrator, for mechanisms with constraints."""

    name: str = "IDA"
    bodies = False

    @property
    def title(self) -> str:
        return f"SUNDIALS IDA of scikit-sundae {sundials.version()}, stabilized index 2, exact Jacobian; our compiled residual"

    def available(self) -> bool | str:
        return sundials.installed()

    def prepare(self, equations: Any, params: np.ndarray, x0: np.ndarray, end: float, system: Any = None) -> Runner:
        n_c = len(equations.constraints)
        if not n_c:
            raise Unfit("it has no constraints; CVODE is SUNDIALS' program for it")
        module = equations.compile(backend="c")
        inputs = [*sundials.constant_inputs(equations).values()]
        if int(module.rank(x0[:module.metadata.sizes.q], params)) < n_c:
            raise Unfit("its constraints depend on each other, and IDA needs independent ones")
        lam = module.evaluate("lam", 0.0, x0, params, inputs)
        y0 = np.concatenate([x0, np.zeros(2 * n_c)])
        rates = np.concatenate([module.evaluate("rhs", 0.0, x0, params, inputs), lam, np.zeros(n_c)])
        library = sundials.Sundials(with_slopes(equations), ("residual", "residual_x", "residual_rates"), params)
        return lambda tolerance, times=None: self._run(library, (y0, rates, len(x0)), end, tolerance, times)

    def _run(self, library: sundials.Sundials, start: tuple[np.ndarray, np.ndarray, int], end: float,
             tolerance: float, times: np.ndarray | None) -> Ran:
        (x, rates), n_x, t = (a.copy() for a in start[:2]), start[2], ctypes.c_double()
        absolute = np.full(len(x), tolerance)
        absolute[n_x:] = _UNCONTROLLED
        y, yd, allowed = library.vector(x), library.vector(rates), library.vector(absolute)
        memory = library("ida", "IDACreate", library.context, made=True)
        library("ida", "IDAInit", memory, library.callback("residual"), 0.0, y, yd)
        used: list[tuple[str, str, Any]] = []
        try:
            library("ida", "IDASVtolerances", memory, tolerance, allowed)
            library("ida", "IDASetUserData", memory, ctypes.byref(library.given))
            library("ida", "IDASetMaxNumSteps", memory, sundials.MANY_STEPS)
            library("ida", "IDASetStopTime", memory, float(end))
            used = library.solve_linear("ida", "IDASetLinearSolver", memory, y, len(x))
            library("ida", "IDASetJacFn", memory, library.callback("slopes"))
            begun = clock.perf_counter()
            if times is None:
                library("ida", "IDASolve", memory, float(end), ctypes.byref(t), y, yd, _NORMAL)
            else:
                step = lambda: library("ida", "IDASolve", memory, float(end), ctypes.byref(t), y, yd, _ONE_STEP)
                x = library.between("ida", "IDAGetDky", memory, (x, t), step, times)
            return clock.perf_counter() - begun, library.count("ida", "IDAGetNumResEvals", memory), x[..., :n_x]
        finally:
            library.free("ida", "IDAFree", memory, [*used, *[("core", "N_VDestroy", v) for v in (y, yd, allowed)]])


def with_slopes(equations: Any) -> Any:
    """The same equations with the derivatives of their residual: residual_x by the state, residual_rates by its rates."""
    symbols, recorder = equations.symbols, equations.recorder
    n_c = len(equations.constraints)

    def slopes(names: list[str]) -> np.ndarray:
        entries = equations.quantity("residual")
        leaves = {leaf.args[1]: leaf for leaf in equations.tape("residual").inputs}
        result = np.zeros((len(entries), len(names)), dtype=object)
        there = [k for k, name in enumerate(names) if name in leaves]
        result[:, there] = jacobian(recorder, tuple(entries), [leaves[names[k]] for k in there], "forward")
        return result

    state = [s.name for s in (*symbols.coordinates, *symbols.speeds, *symbols.states)]
    given = residual_names(symbols.coordinates, symbols.speeds, symbols.states, n_c)
    return replace(equations, singular_fallback=None, again=None, quantities={
        **equations.quantities, "residual_x": lambda: slopes(state), "residual_rates": lambda: slopes(given)})


PEERS = (Ida(),)
