"""Module: generated code as an object that evaluates and simulates. No SymPy here."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.runtime.arguments import take
from symdyn.runtime.unit import Evaluator, Unit

if TYPE_CHECKING:
    from symdyn.runtime.batch_solution import BatchSolution
    from symdyn.runtime.solution import Solution
    from symdyn.runtime.statics.campbell import Campbell
    from symdyn.runtime.statics.equilibria import Equilibria
    from symdyn.runtime.statics.equilibrium import Equilibrium
    from symdyn.runtime.statics.linearize import Linearization
    from symdyn.runtime.statics.stability import Stability

Provider = Callable[[str], Unit]


class Jacobian(NamedTuple):
    """Derivatives of x_dot by the state (n_x, n_x), the inputs (n_x, n_in) and the parameters (n_x, n_p)."""

    x: np.ndarray | None
    inputs: np.ndarray | None
    params: np.ndarray | None


class Module:
    """Functions of a mechanism.

    metadata   names, order, shapes, units, defaults
    provider   function name -> unit that has it; asked once for each function, when it is first called

    Parameters are given as an array in the order of `metadata["parameters"]`, or as a mapping from names or symbols;
    what is left out takes its default. Every function takes one state, or arrays with the states along the first axis.
    Raises ArgumentError for values that do not fit, EvaluationError where the equations cannot be evaluated.
    """

    def __init__(self, metadata: Mapping[str, Any], provider: Provider, backend: str, fallback: str = "",
                 writer: Callable[[Path], list[Path]] | None = None, reporter: Callable[[], Any] | None = None) -> None:
        self.metadata = metadata
        self.name: str = metadata["name"]
        self.backend = backend
        self.fallback = fallback
        self._provider = provider
        self._units: dict[str, Unit] = {}
        self._writer = writer
        self._reporter = reporter
        self._local = threading.local()
        self._lock = threading.Lock()
        self._n_x: int = metadata["sizes"]["x"]
        self._n_in: int = metadata["sizes"]["inputs"]
        self._defaults = dict(zip(metadata["parameters"], metadata["defaults"], strict=True))

    # -- evaluation

    def rhs(self, t: float, x: Any, params: Any = None, inputs: Any = ()) -> np.ndarray:
        """x_dot (n_x,) at time t and state x = [q; u; z]; inputs that are left out take their initial values, as everywhere."""
        try:
            evaluator, seen, mark = self._local.rhs
        except AttributeError:
            evaluator, seen, mark = self._ready("rhs", params)
        if params is not seen or _mark(params) != mark:
            evaluator, seen, mark = self._ready("rhs", params)
        try:
            if len(x) == self._n_x != 1 and len(inputs) == self._n_in:
                if self._n_in == 0:
                    return evaluator.one(t, x)
                if self._n_in > 1:
                    return evaluator.one(t, x, inputs)
                if isinstance(inputs, (list, tuple)) or inputs.ndim == 1:  # one number, not one row
                    return evaluator.one(t, x, inputs)
        except (TypeError, ValueError):  # rows of states or of times, or no numbers at all
            return self.evaluate("rhs", t, x, params, inputs)
        return self.evaluate("rhs", t, x, params, inputs)

    def rhs_batch(self, t: Any, x: Any, params: Any = None, inputs: Any = (), out: np.ndarray | None = None) -> np.ndarray:
        """x_dot (n, n_x) at rows of states x (n, n_x), with the C backend several at once on the processor's vectors.

        t                one time or (n,)
        params, inputs   as everywhere, or with an array (n,) for each name that varies, or (n, n_p), (n, n_in)
        out              where the result goes, else a new array

        Rows that cannot be evaluated are NaN, and an EvaluationWarning tells which and why. Values have the same bits as
        those of `rhs`. Quickest with states entry by entry in memory (x = a.T of an array a (n_x, n)).
        """
        from symdyn.runtime.batch import rhs_batch

        return rhs_batch(self, t, x, params, inputs, out)

    @property
    def batch_width(self) -> int:
        """How many states one processor core computes at once in `rhs_batch` and `simulate_batch`; 1: the backend is NumPy, or
        the C compiler has no vectors."""
        from symdyn.runtime.batch import width

        return width(self)

    def evaluate(self, name: str, t: Any, x: Any, params: Any = None, inputs: Any = (), ud: Any = ()) -> np.ndarray:
        """Any function by name at one state or at rows of states; see METADATA shapes for the result."""
        evaluator = self._evaluator(name, params)
        state = self._rows(x, "x", "x")
        free = self._rows(inputs, "inputs", "inputs")
        acceleration = self._rows(ud, "ud", "ud", self._unit(name).metadata)
        try:
            times = np.asarray(t, dtype=float)
        except (TypeError, ValueError):
            times = np.array(np.nan)
        if not np.isfinite(times).all():
            raise ArgumentError(f"{self.name}: t must be a finite time, or one for each state, found {t!r}")
        if max(state.ndim, free.ndim, acceleration.ndim, times.ndim + 1) == 1:
            return evaluator.one(float(times), state, free, acceleration)
        rows = [np.atleast_1d(times), *[np.atleast_2d(a) for a in (state, free, acceleration)]]
        lengths = {len(r) for r in rows if len(r) != 1}
        if len(lengths) > 1:
            raise ArgumentError(f"{self.name}: t, x, inputs and ud have {[len(r) for r in rows]} rows; give each one row "
                                "or the same number")
        return evaluator.many(*rows)

    def mass_matrix(self, q: Any, params: Any = None, t: float = 0.0) -> np.ndarray:
        """M_tilde (n_u, n_u)."""
        return self.evaluate("mass_matrix", t, self._state(q), params)

    def k_tilde(self, q: Any, u: Any, params: Any = None, t: float = 0.0) -> np.ndarray:
        """k_tilde (n_u,): Coriolis, centrifugal and gyroscopic terms."""
        return self.evaluate("k_tilde", t, self._state(q, u), params)

    def F_tilde(self, q: Any, u: Any, params: Any = None, t: float = 0.0, inputs: Any = ()) -> np.ndarray:
        """F_tilde (n_u,): generalized forces of all loads and gravity."""
        return self.evaluate("F_tilde", t, self._state(q, u), params, inputs)

    def J(self, q: Any, params: Any = None, t: float = 0.0) -> np.ndarray:
        """J (6 n_b, n_u), planar (3 n_b, n_u): [v_G; omega] of every body = J u, n-frame."""
        return self.evaluate("J", t, self._state(q), params)

    def energy(self, q: Any, u: Any, params: Any = None, t: float = 0.0) -> np.ndarray:
        """Kinetic and potential energy (2,), J."""
        return self.evaluate("energy", t, self._state(q, u), params)

    def inverse_dynamics(self, q: Any, u: Any, ud: Any, params: Any = None, t: float = 0.0,
                         inputs: Any = ()) -> np.ndarray:
        """tau (n_u,) = M_tilde u_dot + k_tilde - F_tilde: what must be added for the accelerations ud."""
        return self.evaluate("inverse_dynamics", t, self._state(q, u), params, inputs, ud)

    def outputs(self, t: Any, x: Any, params: Any = None, inputs: Any = ()) -> dict[str, np.ndarray]:
        """The user's named outputs."""
        return self.split_outputs(self.evaluate("outputs", t, x, params, inputs))

    def jacobian(self, t: float, x: Any, params: Any = None, inputs: Any = (),
                 wrt: Sequence[str] = ("x", "inputs", "params")) -> Jacobian:
        """Exact derivatives of x_dot by state, inputs and parameters; `wrt` leaves out what is not needed.

        With Euler parameters the derivatives by the state hold along changes that keep their norm.
        """
        unknown = [w for w in wrt if w not in Jacobian._fields]
        if unknown:
            raise ArgumentError(f"{self.name}: jacobian by {', '.join(unknown)} asked for; there are x, inputs and params")
        return Jacobian(*[self.evaluate(f"jacobian_{w}", t, x, params, inputs) if w in wrt else None
                          for w in Jacobian._fields])

    def function(self, name: str) -> Callable[..., np.ndarray]:
        """One function as f(q, u, params, t=0, inputs=(), ud=()), of one state or of rows of states."""
        self._unit(name)

        def call(q: Any, u: Any = None, params: Any = None, t: Any = 0.0, inputs: Any = (),
                 ud: Any = ()) -> np.ndarray:
            return self.evaluate(name, t, self._state(q, u), params, inputs, ud)

        return call

    def bind(self, params: Any = None) -> BoundModule:
        """The module with fixed parameters: the prologue runs here and not again."""
        return BoundModule(self, self.parameters(params))

    def parameters(self, params: Any = None) -> np.ndarray:
        """Parameters in order, (n_p,)."""
        return take(params, self.metadata["parameters"], "parameters", self._defaults, self.name)

    @functools.cached_property
    def default_parameters(self) -> np.ndarray:
        """Their defaults, (n_p,). Raises ArgumentError for those without one."""
        return self.parameters()

    # -- constraints

    def consistent(self, q: Any = None, u: Any = None, params: Any = None, t: float = 0.0,
                   keep: Sequence[Any] = ()) -> tuple[np.ndarray, np.ndarray]:
        """A state that fulfils the constraints: q (n_q,) and u (n_u,) near the guess, by the smallest change of both.

        q, u    in order, or by name or symbol; what is left out takes the system's initial value, else 0. Of several
                solutions (branches) the guess decides
        keep    coordinates and speeds, by name or symbol, that stay as given
        The change is the smallest in the metric of the mass matrix, as that of the projection in `simulate`. Raises
        ArgumentError with the residual of every constraint that is left where there is no solution nearby.
        """
        from symdyn.runtime.consistent import consistent

        return consistent(self, q, u, params, t, keep)

    def rank(self, q: Any, params: Any = None, t: Any = 0.0) -> Any:
        """Number of independent constraints: rank of the scaled Jacobian C_scale C_r, of one state or rows of states.

        Columns of angular velocities are divided by the mechanism's length; singular values below 1e-8 of the largest are zero.
        """
        from symdyn.runtime.constraints import rank

        return rank(self, t, self._state(q), self.parameters(params))

    def unique(self, q: Any, params: Any = None, t: Any = 0.0) -> np.ndarray:
        """Which multipliers the motion determines, (n_c,) of bool, by the same singular values as `rank`."""
        from symdyn.runtime.constraints import unique

        return unique(self, t, self._state(q), self.parameters(params))

    # -- motion

    def simulate(self, t: Any = None, q: Any = None, u: Any = None, params: Any = None, **options: Any) -> Solution:
        """Integrate the motion; see symdyn.runtime.simulate.simulate for all options."""
        from symdyn.runtime.simulate import simulate

        return simulate(self, t, q, u, params, **options)

    def simulate_batch(self, q: Any = None, u: Any = None, params: Any = None, **options: Any) -> BatchSolution:
        """Integrate many motions; see symdyn.runtime.batch_run.simulate_batch for all options."""
        from symdyn.runtime.batch_run import simulate_batch

        return simulate_batch(self, q, u, params, **options)

    # -- statics and linearization

    def equilibrium(self, free: Any = None, fixed: Any = None, start: Any = None, params: Any = None, t: float = 0.0,
                    inputs: Any = None, unknown_params: Any = None, max_iterations: int = 100) -> Equilibrium:
        """A state of rest, or of steady motion with given speeds, near a start: Newton's method with exact derivatives.

        free      coordinates that are found, by name or symbol; the others stay at the start. Default: all. Parameters and
                  inputs among them are found, too: each takes one value in `fixed` as its condition, whose equation then
                  holds (a coordinate that is named in both where it is not clear which)
        fixed     coordinates, speeds and extra states with the numbers they have; forces along them may be anything. The
                  coordinate of a speed that is given stays at its start (the azimuth of a rotor that spins steadily)
        start     by name or symbol, in order (q, or x), or an Equilibrium; default: the system's initial values, speeds zero
        unknown_params   parameters that are found, in place of naming them in `free`; which values in `fixed` are their
                  conditions is then told by their effect

        Constraints are fulfilled at the same time. Raises NoEquilibrium with the forces that are left,
        EquilibriumNotUnique with the direction that has no stiffness, ArgumentError for what does not fit.
        """
        from symdyn.runtime.statics.equilibrium import equilibrium

        return equilibrium(self, free, fixed, start, params, t, inputs, unknown_params, max_iterations)

    def equilibria(self, starts: Any = 100, ranges: Any = None, seed: int = 0, **options: Any) -> Equilibria:
        """Equilibria from many starts, told apart and named; see symdyn.runtime.statics.equilibria.equilibria.

        starts    how many random ones, or the starts themselves, each as for `equilibrium`
        ranges    coordinate or speed -> (least, most), or r for (-r, r): how far random starts are from `start`
        options   of `equilibrium`
        """
        from symdyn.runtime.statics.equilibria import equilibria

        return equilibria(self, starts, ranges, seed, **options)

    def linearize(self, at: Any = None, params: Any = None, t: float | None = None, inputs: Any = None, free: Any = None,
                  fixed: Any = None, coordinates: Sequence[Any] | None = None, hold: Any = None) -> Linearization:
        """The linear equations about a state on the manifold of the constraints, by exact derivatives.

        at            an Equilibrium, with all that belongs to it; a Solution, at its time nearest to t; x in order; (q, u); or by
                      name or symbol. Default: the system's initial values
        free, fixed   as for `equilibrium`; what stays is left out
        coordinates   which changes are independent, where constraints leave a choice; default: the best conditioned
        hold          coordinates and speeds that are held when the state is disturbed, by name or symbol; default: what `fixed`
                      names or the equilibrium kept, but for the conditions of a trim; () holds nothing

        See symdyn.runtime.statics.linearize.Linearization for M, C, K, A, B, C_out, D, modes() and derivative().
        """
        from symdyn.runtime.statics.linearize import linearize

        return linearize(self, at, params, t, inputs, free, fixed, coordinates, hold)

    def stability(self, at: Any = None, params: Any = None, t: float = 0.0, inputs: Any = None, free: Any = None,
                  fixed: Any = None, hold: Any = None, period: float | None = None, start: Any = None) -> Stability:
        """Whether small disturbances of a state of rest, a steady motion or a periodic motion die out, with the evidence.

        at       an Equilibrium; or the state, as for `linearize`; where it is not on a steady motion, the periodic motion near
                 it is found first
        fixed    speeds (and coordinates) that are held at a value, such as {"azimuth_dot": 1.2}; the period is then 2 pi over it
        hold     what is held when disturbed, by name; default: what `fixed` names, or the equilibrium kept
        period   of a prescribed periodic motion, s: needed where t appears in the equations
        start    in place of `at`: a guess of the state, by name or in order

        Constant equations are judged by their eigenvalues, those that a change of variables makes constant (a rotor of three or
        more like blades, a body that spins about its axis) after the change, others by Floquet theory. Raises ArgumentError where
        neither holds, NoEquilibrium where no periodic motion is found.
        """
        from symdyn.runtime.statics.stability import stability

        return stability(self, at, params, t, inputs, free, fixed, hold, period, start)

    def campbell(self, speed: Any, values: Any, **options: Any) -> Campbell:
        """Natural frequencies over a rotor's speed; see symdyn.runtime.statics.campbell.campbell for all options."""
        from symdyn.runtime.statics.campbell import campbell

        return campbell(self, speed, values, **options)

    # -- about the module

    def report(self) -> Any:
        """What was generated, what was skipped and why, operation counts; prints as text."""
        if self._reporter is None:
            raise ArgumentError(f"{self.name} was loaded from files; a report needs the equations it came from")
        from symdyn.runtime.batch import UNIT
        from symdyn.runtime.batch_run import many_at_once

        return replace(self._reporter(), many=many_at_once(self, UNIT in self._units))

    def write(self, folder: Any) -> list[Path]:
        """Write the generated files, complete with header, example and reference vectors; returns their paths."""
        if self._writer is None:
            raise ArgumentError(f"{self.name} was loaded from files; copy them, or compile the equations it came from")
        return self._writer(Path(folder))

    def split_outputs(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """The user's outputs by name from the rows of the function `outputs`."""
        result, start = {}, 0
        for name, shape in self.metadata["outputs"]:
            size = int(np.prod(shape))
            part = rows[..., start:start + size]
            result[name] = part.reshape((*rows.shape[:-1], *shape))
            start += size
        return result

    @property
    def functions(self) -> tuple[str, ...]:
        """Names of the functions that can be evaluated."""
        return tuple(self.metadata["functions"])

    def shape(self, name: str) -> tuple[int, ...]:
        """Shape of the result of a function at one state."""
        return tuple(self._unit(name).metadata["shapes"][name])

    def unit(self, name: str) -> Unit:
        """The loaded unit that has a function."""
        return self._unit(name)

    def _unit(self, name: str) -> Unit:
        if name not in self._units:
            with self._lock:  # the derivation behind it is for one thread at a time
                if name not in self._units:
                    unit = self._units[name] = self._provider(name)
                    if name in unit.metadata["shapes"]:  # not in variations of rhs, where "rhs" means something else
                        for other in unit.metadata["shapes"]:
                            self._units.setdefault(other, unit)
        return self._units[name]

    def _evaluator(self, name: str, params: Any) -> Evaluator:
        return self._ready(name, params)[0]

    def _ready(self, name: str, params: Any) -> tuple[Evaluator, Any, Any]:
        """The evaluator of this thread with these parameters; remembered until they change."""
        known = getattr(self._local, name, None)
        mark = _mark(params)
        if known is None or known[1] is not params or known[2] != mark:
            evaluator = known[0] if known is not None else self._unit(name).evaluator(name)
            evaluator.set_params(self.parameters(params))
            known = (evaluator, params, mark)
            setattr(self._local, name, known)
        return known

    def _initial(self, group: str) -> np.ndarray:
        """What entries of a group are where they are left out: their initial values in the system, else 0."""
        initial = self.metadata.get("initial", {})
        return np.array([initial.get(n, 0.0) for n in self.metadata[group]], dtype=float)

    def _state(self, q: Any, u: Any = None) -> np.ndarray:
        q = self._rows(q, "q", "q")
        u = self._rows(() if u is None else u, "u", "u")
        n = max(q.ndim, u.ndim)
        z = self._initial("z")
        if n == 1:
            return np.concatenate([q, u, z])
        lengths = {len(a) for a in (q, u) if a.ndim == n}
        rows = max(lengths)
        if lengths - {1, rows}:
            raise ArgumentError(f"{self.name}: q has {len(q)} rows and u has {len(u)}; give the same number")
        return np.concatenate([np.broadcast_to(a, (rows, a.shape[-1])) for a in (q, u, z)], axis=1)

    def _rows(self, values: Any, what: str, group: str, metadata: Mapping[str, Any] | None = None) -> np.ndarray:
        """One row or rows of numbers of a group; what is left out takes its initial value, accelerations 0. Accelerations go by
        the names of the speeds."""
        about = metadata or self.metadata
        wanted = about["sizes"][group]
        names = about["u" if what == "ud" and wanted == about["sizes"]["u"] else group]
        initial = self.metadata.get("initial", {}) if what != "ud" else {}
        if isinstance(values, Mapping):
            return take(values, names, what, {n: initial.get(n, 0.0) for n in names}, self.name)
        try:
            array = np.asarray(values if values is not None else "", dtype=float)
        except (TypeError, ValueError):
            raise ArgumentError(f"{self.name}: {what} must be numbers, found {values!r}") from None
        if array.ndim == 0 and wanted == 1:
            array = array.reshape(1)
        if array.shape == (0,) and what != "x":
            return np.array([initial.get(n, 0.0) for n in names], dtype=float)
        if array.ndim not in (1, 2) or array.shape[-1] != wanted:
            raise ArgumentError(f"{self.name}: {what} has the shape {array.shape}, needed are {wanted} numbers a state: "
                                f"{', '.join(names)}")
        return array

    def __repr__(self) -> str:
        sizes = self.metadata["sizes"]
        return f"<Module {self.name}: {self.backend}, {sizes['q']} coordinates, {sizes['u']} speeds, {sizes['p']} parameters>"


class BoundModule:
    """A module with fixed parameters. Each thread that uses it has its own buffers."""

    def __init__(self, module: Module, p: np.ndarray) -> None:
        self.module = module
        self.params = p
        self._n_x: int = module.metadata["sizes"]["x"]
        self._n_in: int = module.metadata["sizes"]["inputs"]
        initial = module.metadata.get("initial", {})
        self._inputs = np.array([initial.get(n, 0.0) for n in module.metadata["inputs"]], dtype=float)
        self._local = threading.local()
        self._ready("rhs")

    def rhs(self, t: float, x: Any, inputs: Any = ()) -> np.ndarray:
        """x_dot (n_x,) at time t and state x = [q; u; z]."""
        try:
            evaluator = self._local.rhs
        except AttributeError:
            evaluator = self._ready("rhs")
        if len(x) == self._n_x and len(inputs) == self._n_in:
            return evaluator.one(t, x, inputs) if self._n_in else evaluator.one(t, x)
        return evaluator.one(t, x, self._zeros(x, inputs))

    def jacobian_x(self, t: float, x: Any, inputs: Any = ()) -> np.ndarray:
        """d x_dot / d x (n_x, n_x)."""
        evaluator = getattr(self._local, "jacobian_x", None) or self._ready("jacobian_x")
        if len(x) == self._n_x and len(inputs) == self._n_in:
            return evaluator.one(t, x, inputs) if self._n_in else evaluator.one(t, x)
        return evaluator.one(t, x, self._zeros(x, inputs))

    def _zeros(self, x: Any, inputs: Any) -> np.ndarray:
        """Inputs that were left out: their initial values in the system, else 0."""
        if len(x) != self._n_x or len(inputs):
            raise ArgumentError(f"{self.module.name}: x has {len(x)} entries and inputs has {len(inputs)}, needed are "
                                f"{self._n_x} and {self._n_in}")
        return self._inputs

    def _ready(self, name: str) -> Any:
        evaluator = self.module.unit(name).evaluator(name)
        evaluator.set_params(self.params)
        setattr(self._local, name, evaluator)
        return evaluator


def _mark(params: Any) -> Any:
    """What tells that parameters were changed in place."""
    if params is None:
        return None
    if isinstance(params, np.ndarray):
        return params.tobytes()
    if isinstance(params, Mapping):
        return tuple(params.items())
    return tuple(params) if hasattr(params, "__iter__") else params
