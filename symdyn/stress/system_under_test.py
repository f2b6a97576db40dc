"""A mechanism under stress: its equations, generated code of its functions, runs of its motion."""

from __future__ import annotations

import copy
import warnings
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError, no_value
from symdyn.formulation.equations import Equations
from symdyn.functions.table import FUNCTIONS
from symdyn.functions.tapes import has_function
from symdyn.pipeline import emit
from symdyn.runtime.building.compiler import Compiler, find_compiler, plain
from symdyn.runtime.building.library import CLibrary, PythonLibrary
from symdyn.runtime.module import Module
from symdyn.runtime.solutions.solution import Solution

if TYPE_CHECKING:
    from symdyn.model.system import System

EPS = 2.0**-53
# Relative tolerance of runs that are compared: all but the last digits.
RTOL = 1e-10
# Where a system of the catalogue begins that has no motion of its own: it is in equilibrium.
NEARBY = {"floating_crane": {"beta": 0.2}}
# Derivatives, and forms for other purposes.
IDENTIFICATION, LONG = ("regressor", "inertial_parameters", "base_regressor", "base_parameters"), 1000
SELDOM = ("jacobian_x", "jacobian_inputs", "input_matrix", "jacobian_params", "power_x", "reactions_by_lam", "residual",
          "validity_checks", "ground_rotation", "drawn_lengths", "events", "event_resets", "reset_directions")


def named(name: str) -> System:
    """The system of a name of the catalogue, of that with its first option in parentheses, such as n_link_pendulum(3), or of the
    list of `symdyn bench --all`.

    Raises ArgumentError for a name that there is not.
    """
    from symdyn.bench.work import cases

    case = cases.named(name)
    return case.maker()(**case.options)


class SystemUnderTest:
    """A mechanism with its usual parameters, start and duration.

    system   a System, Equations, or a name as of `named`
    """

    def __init__(self, system: Any) -> None:
        if isinstance(system, str):
            nearby, system = NEARBY.get(system, {}), named(system)
            system.initial = {**system.initial, **nearby}
        self.equations: Equations = system if isinstance(system, Equations) else system.equations()
        self.name = self.equations.name
        self.symbols = self.equations.symbols
        self.method: str | None = None  # of runs that name none; None: the usual one
        self._whole: Any = None
        self._evaluators: dict[str, Any] = {}

    @cached_property
    def module(self) -> Module:
        return self.equations.compile()  # type: ignore[no-any-return]

    @cached_property
    def everything(self) -> tuple[str, ...]:
        """All functions but derivatives, which are compiled when they are requested; of long equations also without those of
        identification."""
        long = self.equations.tape("rhs").operations > LONG
        without = {*SELDOM, *IDENTIFICATION} if long else set(SELDOM)
        return tuple(name for name in FUNCTIONS if name not in without and self.has(name))

    @property
    def constrained(self) -> bool:
        return bool(self.equations.constraints)

    @property
    def backend(self) -> str:
        """Backend that `evaluate` runs: "c", or "numpy" where there is no compiler."""
        return "c" if find_compiler() is not None else "numpy"

    def demand_numbers(self) -> None:
        """Raises ArgumentError where parameters have no number: nothing could be run."""
        lacking = [p.name for p in self.symbols.parameters if p not in self.symbols.defaults]
        if lacking:
            raise ArgumentError(f"{self.name}: parameters: {no_value(lacking)}; give every parameter a number in the system's "
                                "`defaults`")

    @cached_property
    def params(self) -> np.ndarray:
        return self.module.parameters()

    @cached_property
    def inputs(self) -> np.ndarray:
        """Default values of inputs, (n_in,)."""
        initial = self.module.metadata.initial
        return np.array([initial.get(name, 0.0) for name in self.module.metadata.inputs], dtype=float)

    @property
    def duration(self) -> float:
        return float(self.module.metadata.duration)

    @property
    def given(self) -> np.ndarray:
        """The initial state as it was given, (n_x,)."""
        metadata = self.module.metadata
        return np.array([metadata.initial.get(name, 0.0) for name in metadata.x], dtype=float)

    @cached_property
    def start(self) -> np.ndarray:
        """The usual start: what was given, moved onto the constraints, (n_x,)."""
        metadata, x = self.module.metadata, self.given
        n_q, n_u = metadata.sizes.q, metadata.sizes.u
        for group in metadata.unit_groups:
            places = [metadata.x.index(name) for name in group]
            norm = np.linalg.norm(x[places])
            x[places] = x[places] / norm if norm > 0 else [1.0, *[0.0] * (len(places) - 1)]
        if self.constrained:
            q, u = self.module.consistent(x[:n_q], x[n_q:n_q + n_u])
            x[:n_q + n_u] = np.concatenate([q, u])
        return x

    def changed(self, params: np.ndarray, method: str) -> SystemUnderTest:
        """The same mechanism with other parameters (n_p,), by the same code, run by a method; its start is this one's."""
        other = copy.copy(self)
        other.__dict__.update(params=params, start=self.start)
        other.method = method
        return other

    def parts(self, x: np.ndarray) -> dict[str, Any]:
        """A state as arguments of `simulate`."""
        sizes = self.module.metadata.sizes
        q, u, z = np.split(np.asarray(x, dtype=float), np.cumsum([sizes.q, sizes.u]))
        return {"q": q, "u": u, "z": z} if len(z) else {"q": q, "u": u}

    def run(self, t: Any, x: np.ndarray | None = None, params: Any = None, rtol: float = RTOL, **options: Any) -> Solution:
        """A motion; warnings are kept in `warned` of the solution."""
        if options.get("method") is None:
            options["method"] = self.method
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            sol = self.module.simulate(t, params=self.params if params is None else params, rtol=rtol,
                                       **self.parts(self.start if x is None else x), **options)
        sol.warned = [str(w.message) for w in caught]  # type: ignore[attr-defined]
        return sol  # type: ignore[no-any-return]

    def has(self, name: str) -> bool:
        return has_function(self.equations, name)

    def evaluate(self, name: str, t: Any, x: np.ndarray, params: np.ndarray | None = None, inputs: Any = None,
                 ud: Any = None) -> np.ndarray:
        """A function at rows of states, (n, size); rows of NaN where it cannot be evaluated. Compiled without optimization."""
        if name not in self._evaluators:
            together = name in self.everything
            if together and self._whole is None:
                self._whole = self.library(self.everything)
            self._evaluators[name] = (self._whole if together else self.library((name,))).evaluator(name)
        return evaluated(self._evaluators[name], t, x, self.params if params is None else params,
                         self.inputs if inputs is None else inputs, ud)

    def library(self, names: Sequence[str], backend: str = "", compiler: Compiler | None = None) -> Any:
        """Generated code of functions, loaded.

        backend   "c" or "numpy", default: C if there is a compiler; compiler: default the usual one, without optimization
        """
        compiler = compiler or find_compiler()
        if backend == "numpy" or compiler is None:
            source = emit(self.equations, "numpy", names, standalone=False)
            return PythonLibrary.from_source(next(iter(source.files.values())), source.metadata.name)
        source = emit(self.equations, "c", names, standalone=False, integrator=False)
        return CLibrary(next(iter(source.files.values())), source.metadata, plain(compiler) if not backend else compiler)


def evaluated(evaluator: Any, t: Any, x: np.ndarray, params: np.ndarray, inputs: Any, ud: Any = None) -> np.ndarray:
    """A function of a library at rows of states, (n, size), NaN where it cannot be evaluated."""
    sizes = evaluator.library.metadata.sizes
    rows = np.atleast_2d(np.asarray(x, dtype=float))
    n = len(rows)
    times = np.ascontiguousarray(np.broadcast_to(np.asarray(t, dtype=float), (n,)))
    free = np.ascontiguousarray(np.broadcast_to(np.atleast_2d(np.asarray(inputs, dtype=float)), (n, sizes.inputs)))
    given = np.zeros((n, sizes.ud)) if ud is None else np.ascontiguousarray(np.asarray(ud, dtype=float))
    if given.shape[1] != sizes.ud:
        given = np.zeros((n, sizes.ud))
    try:
        evaluator.set_params(np.asarray(params, dtype=float))
        result = evaluator.many(times, np.ascontiguousarray(rows), free, given)
        return np.asarray(result, dtype=float).reshape(n, -1)
    except EvaluationError:
        pass
    size = int(np.prod(evaluator.library.metadata.shapes[evaluator.name]))
    result = np.full((n, size), np.nan)
    for k in range(n):
        try:
            result[k] = np.asarray(evaluator.one(float(times[k]), rows[k], free[k], given[k])).ravel()
        except EvaluationError:
            continue
    return result
