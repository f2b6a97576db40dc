"""CVODES of SUNDIALS as CasADi calls it, on our right-hand side in CasADi's expressions, compiled from its C code."""

from __future__ import annotations

import contextlib
import importlib.util
import tempfile
import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.bench.toolchain import c_compiler, version
from symdyn.bench.work.against.peer import Failed, Ran, Runner
from symdyn.bench.work.against.walk import ARITHMETIC, ELEMENTARY, right_hand_side
from symdyn.errors import CompilerNotFound

INSTALL = "casadi is not installed; run: pip install 'symdyn[peers]'"
_MANY_STEPS = 10**6


@dataclass(frozen=True)
class Casadi:
    """One family of methods: adams or not."""

    adams: bool
    bodies = False

    @property
    def name(self) -> str:
        return f"casadi {family(self.adams)}"

    @property
    def title(self) -> str:
        return f"CasADi {version('casadi')} CVODES {family(self.adams)}; our right-hand side as its compiled C code"

    def available(self) -> bool | str:
        return installed()

    def prepare(self, equations: Any, params: np.ndarray, x0: np.ndarray, end: float, system: Any = None) -> Runner:
        import casadi as ca

        symbols = equations.symbols
        names = [s.name for s in (*symbols.coordinates, *symbols.speeds, *symbols.states)]
        x, t = ca.SX.sym("x", len(names)), ca.SX.sym("t")
        rates = right_hand_side(equations, params, {"t": t, **dict(zip(names, ca.vertsplit(x), strict=True))}, _functions(ca),
                                "casadi")
        return runner(ca, {"x": x, "t": t, "ode": ca.vertcat(*rates)}, x0, end, self.adams)


def installed() -> bool | str:
    """True, or what to install."""
    if importlib.util.find_spec("casadi") is None:
        return INSTALL
    try:
        c_compiler()
    except CompilerNotFound as error:
        return str(error)
    return True


def family(adams: bool) -> str:
    """Its name."""
    return "Adams" if adams else "BDF"


def runner(ca: Any, problem: Mapping[str, Any], x0: np.ndarray, end: float, adams: bool) -> Runner:
    """Runs the integrator, which CasADi makes again for each tolerance, outside the timing."""
    compiler = c_compiler()
    options = {"linear_multistep_method": family(adams).lower(),
               "nonlinear_solver_iteration": "functional" if adams else "newton",
               "max_num_steps": _MANY_STEPS, "print_stats": False, "show_eval_warnings": False, "jit": True,
               "compiler": "shell", "jit_temp_suffix": True, "jit_cleanup": False,
               "jit_options": {"compiler": compiler.command[0], "linker": compiler.command[0], "flags": ["-O3", "-march=native"],
                               "verbose": False, "cleanup": False}}
    made: dict[float, Any] = {}
    folder = tempfile.TemporaryDirectory(prefix="symdyn-casadi-")  # of what is compiled; gone with the runner

    def integrator(tolerance: float, times: Sequence[float], **others: Any) -> Any:
        with contextlib.chdir(folder.name):  # CasADi writes where it is, and is not to clean up there later
            return ca.integrator("motion", "cvodes", dict(problem), 0.0, times, {
                **options, "reltol": tolerance, "abstol": tolerance, **others})

    def run(tolerance: float, times: np.ndarray | None = None) -> Ran:
        if tolerance not in made:
            made[tolerance] = integrator(tolerance, [end])
        motion = made[tolerance]
        if times is not None:  # the same first step, which would depend on the first output; not compiled, as it is not timed
            motion(x0=x0)
            motion = integrator(tolerance, times.tolist(), step0=motion.stats()["hinused"], jit=False)
        start = ca.DM(x0)
        begun = clock.perf_counter()
        try:
            result = motion(x0=start)
        except RuntimeError as error:
            raise Failed(f"casadi at {tolerance:g}: {str(error).strip().splitlines()[-1]}") from None
        seconds, states = clock.perf_counter() - begun, np.array(result["xf"]).T
        return seconds, int(motion.stats()["nfevals"]), states[-1] if times is None else states

    return run


def _functions(ca: Any) -> Mapping[str, Callable[..., Any]]:
    """Operation of the tape -> CasADi's expression."""
    own = {name: getattr(ca, name) for name in (*ELEMENTARY, "sign", "floor", "ceil", "lt", "le", "gt", "ge", "eq", "ne")}
    return {**own, **ARITHMETIC, "abs": ca.fabs, "min": ca.fmin, "max": ca.fmax, "and": ca.logic_and, "or": ca.logic_or,
            "not": ca.logic_not, "select": ca.if_else}


PEERS = (Casadi(adams=True), Casadi(adams=False))
