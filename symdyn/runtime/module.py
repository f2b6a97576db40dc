"""Module: generated code as an object that evaluates and simulates. No SymPy here."""

from __future__ import annotations

import contextlib
import copy
import functools
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Literal, NamedTuple, TypeAlias, TypeVar, overload

import numpy as np

from symdyn.arguments import fixed, take
from symdyn.backend.metadata import Metadata, ModuleMetadata
from symdyn.backend.right_side import RightSide
from symdyn.counting import counted
from symdyn.errors import ArgumentError, EvaluationError
from symdyn.formulation.names import ADJOINT, HESSIAN, HESSIAN_PRODUCT, WEIGHTED, Weighted, derivative_of
from symdyn.kinds import text
from symdyn.pages import table, titled
from symdyn.real_numbers import DOUBLE, number_of, real_of
from symdyn.runtime.building.library import Evaluator, Library
from symdyn.runtime.calls import Call, ordered
from symdyn.runtime.inputs.sampled import Sampled
from symdyn.runtime.inputs.tables import Table
from symdyn.runtime.paths import as_path, writing
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    import sympy as sp

    from symdyn.backend.packed import Pattern
    from symdyn.given import ContactMode, Key, Named, Names, Numbers, PathName, Row, States, Times, Values
    from symdyn.report.text import Report
    from symdyn.runtime.batches.solution import BatchSolution
    from symdyn.runtime.gpu.dlpack import OnDevice
    from symdyn.runtime.inputs.inputs import Inputs
    from symdyn.runtime.integrating.gradient import Gradient
    from symdyn.runtime.integrating.ode_solver import CompiledSolver
    from symdyn.runtime.labelled import Labelled
    from symdyn.runtime.losses import Loss
    from symdyn.runtime.solutions.solution import Solution
    from symdyn.statics.actuation import Actuation
    from symdyn.statics.campbell import Campbell
    from symdyn.statics.contact_rest import Rest
    from symdyn.statics.equilibria import Equilibria
    from symdyn.statics.equilibrium import Equilibrium
    from symdyn.statics.linearize import Linearization
    from symdyn.statics.locus import RootLocus
    from symdyn.statics.periodic import PeriodicMotion
    from symdyn.statics.stability import Stability
    from symdyn.tape.tape import Tape

    # A number; a table over time, as a pair of times and values or as Table; a function of (t, x); an expression of the time; a
    # controller whose values are held.
    InputValue: TypeAlias = float | Table | tuple[Row, Row] | Callable[[float, np.ndarray], float] | sp.Expr | Sampled
    # Values of all inputs in one of these ways, or one for each by name.
    InputValues: TypeAlias = (Row | Table | tuple[Row, Row | Sequence[Row]] | Callable[[float, np.ndarray], float | Row] | Sampled
                              | Named[InputValue] | Numbers)
    # Numbers of many motions, also in arrays of other libraries on a GPU.
    OfMany: TypeAlias = Values | OnDevice | Named[OnDevice] | Named[float | Row | OnDevice]
    # Bounds of coordinates by name or symbol: least and greatest, or r for (-r, r).
    Ranges: TypeAlias = Named[float] | Named[tuple[float, float]] | Named[float | tuple[float, float]]
    # A state: in order, by name or symbol, as (q, u), or with all that belongs to it.
    Start: TypeAlias = Values | tuple[Row, Row] | Equilibrium | Solution

Provider = Callable[[str | RightSide], Library]
# Times that the generated code takes as they are.
_TIMES = (float, np.float64)
_WHOLE = 2**53
# Functions that depend on the choice among multipliers of redundant constraints.
_OF_MULTIPLIERS = ("lam", "reactions", "cut_loads")


# An array where all parts are requested, else perhaps None.
_Part = TypeVar("_Part", bound=np.ndarray | None, covariant=True)


class Jacobian(NamedTuple, Generic[_Part]):
    """Derivatives of a function by the state (..., n_x), the inputs (..., n_in) and the parameters (..., n_p); None for what was
    not requested. Before the last axis stands the shape of the function: of x_dot (n_x,)."""

    x: _Part
    inputs: _Part
    params: _Part


class FurtherDerivatives(NamedTuple):
    """The same, with derivatives by time (..., 1) and given accelerations (..., n_u), where these were requested."""

    x: np.ndarray | None = None
    inputs: np.ndarray | None = None
    params: np.ndarray | None = None
    t: np.ndarray | None = None
    ud: np.ndarray | None = None


def _jacobian(parts: Mapping[str, np.ndarray]) -> Jacobian[np.ndarray | None]:
    return Jacobian(*map(parts.get, Jacobian._fields))


_BY = "x, inputs, params, t and ud"


class Module:
    """Functions of a mechanism.

    metadata   names, order, shapes, units, defaults
    provider   function name, or what a right-hand side is made with -> library that has it; called once for each, when it is
               first used

    Parameters are given as an array in the order of `metadata.parameters`, or as a mapping from names or symbols;
    what is left out takes its default. Every function takes one state, or arrays with the states along the first axis.
    Raises ArgumentError for values that do not fit, EvaluationError where the equations cannot be evaluated.

    >>> module = sd.systems.pendulum().compile(backend="numpy")
    >>> module.functions[:4], module.metadata.bodies
    (('rhs', 'mass_matrix', 'k_tilde', 'F_tilde'), ('bob',))
    """

    def __init__(self, metadata: ModuleMetadata, provider: Provider, backend: str, fallback: str = "",
                 writer: Callable[[Path], list[Path]] | None = None, reporter: Callable[[], Report] | None = None) -> None:
        self.metadata = metadata
        self.name: str = metadata.name
        self.backend = backend
        self.fallback = fallback
        self._provider = provider
        self._libraries: dict[str | RightSide, Library] = {}
        self._writer = writer
        self._reporter = reporter
        self._local, self._notes = threading.local(), threading.local()
        self._lock = threading.Lock()
        self._left_out: Callable[[Any], np.ndarray] | None = None
        self._n_in: int = metadata.sizes.inputs
        self._one, self._free = (metadata.sizes.x,), (self._n_in,)
        self._defaults = dict(zip(metadata.parameters, metadata.defaults, strict=True))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled with the text of what was generated; all else is derived where it is needed. Copies share nothing."""
        return _restored, (self.metadata.as_plain(), self._provider, self.backend, self.fallback)

    # -- evaluation

    def rhs(self, t: float, x: States, params: States | None = None, inputs: States | None = ()) -> np.ndarray:
        """x_dot (n_x,) at time t and state x = [q; u; z].

        params, inputs   in order, or by name or symbol; inputs that are left out take their initial values, as everywhere

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.rhs(0.0, [0.1, 0.0]).round(6)
        array([ 0.      , -0.979366])
        """
        try:
            evaluator, seen, mark = self._local.rhs
        except AttributeError:
            evaluator, seen, mark = self._ready("rhs", params)
        if params is not seen or _mark(params) != mark:
            evaluator, seen, mark = self._ready("rhs", params)
        # One state of doubles at a finite time needs no further look; text, complex and masked numbers take the other way.
        if type(x) is np.ndarray and x.dtype is DOUBLE and x.shape == self._one and _is_time(t):
            if self._n_in == 0 and (inputs is None or (type(inputs) is tuple and not inputs)):
                return evaluator.one(float(t), x)
            if type(inputs) is np.ndarray and inputs.dtype is DOUBLE and inputs.shape == self._free:
                return evaluator.one(float(t), x, inputs)
        return self.evaluate("rhs", t, x, params, inputs)

    @overload
    def rhs_batch(self, t: Times, x: States, params: States | None = None, inputs: States | None = (),
                  out: np.ndarray | None = None, device: Literal["cpu"] = "cpu", precision: str = "double") -> np.ndarray: ...

    @overload
    def rhs_batch(self, t: Times | OnDevice, x: States | OnDevice, params: States | OnDevice | None = None,
                  inputs: States | OnDevice | None = (), out: np.ndarray | OnDevice | None = None, device: str = "cpu",
                  precision: str = "double") -> np.ndarray | OnDevice: ...

    def rhs_batch(self, t: Times | OnDevice, x: States | OnDevice, params: States | OnDevice | None = None,
                  inputs: States | OnDevice | None = (), out: np.ndarray | OnDevice | None = None, device: str = "cpu",
                  precision: str = "double") -> np.ndarray | OnDevice:
        """x_dot (n, n_x) at rows of states x (n, n_x), with the C backend several at once on the processor's vectors.

        t                one time or (n,)
        params, inputs   as everywhere, or with an array (n,) for each name that varies, or (n, n_p), (n, n_in)
        out              where the result goes, else a new array
        device           "cpu"; or "gpu", "gpu:1" for the second one: a thread each on an NVIDIA GPU (`simulate_batch`). Where x
                         lies there, as an array of JAX, CuPy or PyTorch (any that has `__dlpack__`), it is read there, as
                         are t, params and inputs; the result is `out`, written there, or a new array there, which these
                         libraries take by `from_dlpack`. Nothing is copied but what is not there, and a code of each state
        precision        of the device: "double", or "single": float32. Arrays there have numbers of this type

        Rows that cannot be evaluated are NaN, and an EvaluationWarning says which and why. Values have the same bits as
        those of `rhs`. Quickest with states entry by entry in memory (x = a.T of an array a (n_x, n)).

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.rhs_batch(0.0, [[0.1, 0.0], [0.2, 0.0]]).round(6)
        array([[ 0.      , -0.979366],
               [ 0.      , -1.948946]])
        """
        from symdyn.runtime.batches.states import rhs_batch

        result: np.ndarray | OnDevice = rhs_batch(self, t, x, params, inputs, out, device, precision)
        return result

    @property
    def batch_width(self) -> int:
        """Number of states that one processor core computes at once in `rhs_batch` and `simulate_batch`; 1: the backend is NumPy,
        or the C compiler has no vectors.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.batch_width
        1
        """
        from symdyn.runtime.batches.states import width

        return width(self)

    def evaluate(self, name: str, t: Times, x: States, params: States | None = None, inputs: States | None = (),
                 ud: States = ()) -> np.ndarray:
        """Any function by name at one state or at rows of states; see METADATA shapes for the result.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.evaluate("mass_matrix", 0.0, [0.1, 0.0], {"l": 2.0})
        array([[4.]])
        """
        text(name, f"{self.name}: the name of a function", "mass_matrix")
        evaluator = self._evaluator(name, params)
        state = self._rows(x, "x", "x")
        if inputs is None:
            inputs = ()
        if self._left_out is not None and not (isinstance(inputs, Mapping) or np.size(inputs)):
            inputs = self._left_out(t)
        free = self._rows(inputs, "inputs", "inputs")
        acceleration = self._rows(ud, "ud", "ud", self._library(name).metadata)
        times = real_of(t, self.name, "t must be a finite time, or one for each state")
        if times.ndim > 1 or not np.isfinite(times).all():
            raise ArgumentError(f"{self.name}: t must be a finite time, or one for each state, found {shown(t)}")
        if max(state.ndim, free.ndim, acceleration.ndim, times.ndim + 1) == 1:
            return evaluator.one(float(times), state, free, acceleration)
        rows = [np.atleast_1d(times), *[np.atleast_2d(a) for a in (state, free, acceleration)]]
        lengths = {len(r) for r in rows if len(r) != 1}
        if len(lengths) > 1:
            raise ArgumentError(f"{self.name}: t, x, inputs and ud have {[len(r) for r in rows]} rows; give each one row "
                                "or the same number")
        return evaluator.many(*rows)

    def following(self, inputs: Inputs | np.ndarray) -> Module:
        """The module whose motions are those of a run, or those of inputs (n_in,), wherever inputs are left out: constraints
        depend on motions, too, though on no other inputs.

        >>> z, q = sd.motions("z"), sd.coordinates("q")
        >>> lift = sd.System("lift", gravity=[0, -9.81])
        >>> floor, ball = lift.add_body("floor", mass=1), lift.add_body("ball", mass=1)
        >>> _ = lift.add_joint(sd.Prismatic("lifted", lift.ground, floor, axis=[0, 1], coordinate=z))
        >>> _ = lift.add_joint(sd.Prismatic("up", floor, ball, axis=[0, 1], coordinate=q))
        >>> module = lift.compile(backend="numpy")
        >>> module.metadata.inputs
        ('z', 'z_dot', 'z_ddot')
        >>> module.following(np.array([0.0, 0.0, 2.0])).rhs(0, [0.0, 0.0])  # upwards at 2 m/s^2
        array([  0.  , -11.81])
        """
        if not self.metadata.motions:
            return self
        other = copy.copy(self)
        other._left_out = (lambda t: inputs) if isinstance(inputs, np.ndarray) else inputs.left_out
        return other

    def motions_at(self, t: float) -> np.ndarray | None:
        """Inputs (n_in,) with the motions of a run; None where the module follows none.

        >>> sd.systems.pendulum().compile(backend="numpy").motions_at(0.0) is None
        True
        """
        return None if self._left_out is None else self._left_out(t)

    def mass_matrix(self, *at: States | None, x: States | None = None, q: States | None = None, params: States | None = None,
                    t: Times | None = None, inputs: States | None = None) -> np.ndarray:
        """M_tilde (n_u, n_u): mass_matrix(t, x, params), where coordinates alone do for x, or mass_matrix(q, params, t=0).

        The two orders of arguments, by time and state as for `rhs`, or by parts of the state, hold for k_tilde, F_tilde, J,
        energy and inverse_dynamics, too; every argument can be named. Raises ArgumentError where what is given fits both.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.mass_matrix(q=[0.1])
        array([[1.]])
        """
        named = {"x": x, "q": q, "params": params, "t": t, "inputs": inputs}
        call = ordered(self, "mass_matrix", at, named, ("q", "params", "t", "inputs"))
        return self._called("mass_matrix", call)

    def k_tilde(self, *at: States | None, x: States | None = None, q: States | None = None, u: States | None = None,
                params: States | None = None, t: Times | None = None, inputs: States | None = None) -> np.ndarray:
        """k_tilde (n_u,), Coriolis, centrifugal and gyroscopic terms: k_tilde(t, x, params) or k_tilde(q, u, params, t=0).

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.k_tilde(q=[0.1], u=[2.0])
        array([0.])
        """
        named = {"x": x, "q": q, "u": u, "params": params, "t": t, "inputs": inputs}
        call = ordered(self, "k_tilde", at, named, ("q", "u", "params", "t", "inputs"))
        return self._called("k_tilde", call)

    def F_tilde(self, *at: States | None, x: States | None = None, q: States | None = None, u: States | None = None,
                params: States | None = None, t: Times | None = None, inputs: States | None = None) -> np.ndarray:
        """F_tilde (n_u,), generalized forces of all loads and gravity: F_tilde(t, x, params, inputs) or
        F_tilde(q, u, params, t=0, inputs=()).

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.F_tilde(q=[0.1], u=[0.0]).round(6)
        array([-0.979366])
        """
        named = {"x": x, "q": q, "u": u, "params": params, "t": t, "inputs": inputs}
        call = ordered(self, "F_tilde", at, named, ("q", "u", "params", "t", "inputs"))
        return self._called("F_tilde", call)

    def J(self, *at: States | None, x: States | None = None, q: States | None = None, params: States | None = None,
          t: Times | None = None, inputs: States | None = None) -> np.ndarray:
        """J (6 n_b, n_u), planar (3 n_b, n_u), with [v_G; omega] of every body = J u, n-frame: J(t, x, params) or
        J(q, params, t=0).

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.J(q=[0.0])
        array([[1.],
               [0.],
               [1.]])
        """
        named = {"x": x, "q": q, "params": params, "t": t, "inputs": inputs}
        call = ordered(self, "J", at, named, ("q", "params", "t", "inputs"))
        return self._called("J", call)

    def energy(self, *at: States | None, x: States | None = None, q: States | None = None, u: States | None = None,
               params: States | None = None, t: Times | None = None, inputs: States | None = None) -> np.ndarray:
        """Kinetic and potential energy (2,), J: energy(t, x, params) or energy(q, u, params, t=0).

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.energy(q=[0.0], u=[2.0])
        array([ 2.  , -9.81])
        """
        named = {"x": x, "q": q, "u": u, "params": params, "t": t, "inputs": inputs}
        call = ordered(self, "energy", at, named, ("q", "u", "params", "t", "inputs"))
        return self._called("energy", call)

    def inverse_dynamics(self, *at: States | None, x: States | None = None, q: States | None = None, u: States | None = None,
                         ud: States | None = None, params: States | None = None, t: Times | None = None,
                         inputs: States | None = None, lam: States | None = None) -> np.ndarray:
        """tau (n_u,) = M_tilde u_dot + k_tilde - F_tilde + C_r^T lam, what must be added along the speeds for the accelerations
        ud, N or N m: inverse_dynamics(t, x, ud, params, inputs) or inverse_dynamics(q, u, ud, params, t=0, inputs=()).

        lam   multipliers of the constraints (n_c,), or rows of them, in order or by the name of the constraint; with zeros the
              loops are cut and tau is that of the tree alone
        Raises ArgumentError where there are constraints and no lam: tau depends on how they share the forces. The inputs that
        make a motion of a mechanism with loops, with its multipliers, are those of `actuation`.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.inverse_dynamics(q=[0.0], u=[0.0], ud=[1.0])
        array([1.])
        """
        named = {"x": x, "q": q, "u": u, "ud": ud, "params": params, "t": t, "inputs": inputs}
        call = ordered(self, "inverse_dynamics", at, named, ("q", "u", "ud", "params", "t", "inputs"))
        constraints = self.metadata.constraints
        if not constraints:
            if lam is not None and (isinstance(lam, Mapping) or np.size(lam)):
                raise ArgumentError(f"{self.name}: multipliers lam were given, but there are no constraints; leave them out")
            return self._called("inverse_dynamics", call)
        if lam is None:
            raise ArgumentError(f"{self.name}: inverse dynamics asked for, but the forces along the speeds depend on the "
                                f"multipliers of the constraints {', '.join(constraints)}; pass lam={{...}} (zeros: those of the "
                                "tree with its loops cut), or take module.actuation(t, q, u, ud), which finds the inputs that "
                                "make the motion")
        if self.metadata.implicit_loads:
            raise ArgumentError(f"{self.name}: inverse dynamics requested with multipliers, but the loads "
                                f"{', '.join(self.metadata.implicit_loads)} depend on accelerations, multipliers or reactions "
                                "of the motion under these loads; pass them as inputs to ask for what other values need")
        held = take(lam, constraints, "lam", dict.fromkeys(constraints, 0.0), self.name) \
            if isinstance(lam, Mapping) or np.ndim(lam) < 2 else np.asarray(lam, dtype=float)
        tau = self._called("inverse_dynamics", call)
        return tau + np.einsum("...ij,...i->...j", self._called("C_r", call._replace(ud=None)), held)

    def _called(self, name: str, call: Call) -> np.ndarray:
        whole = call.x is not None and (isinstance(call.x, Mapping) or np.shape(call.x)[-1:] == self._one)
        state = call.x if whole else self._state(call.q if call.x is None else call.x, call.u)
        return self.evaluate(name, 0.0 if call.t is None else call.t, state, call.params,
                             () if call.inputs is None else call.inputs, () if call.ud is None else call.ud)

    def actuation(self, t: float, q: States, u: States, ud: States, params: States | None = None, inputs: States | None = None, *,
                  z: States | None = None, start: Values | None = None, project: bool = False, keep: Names = ()) -> Actuation:
        """The inputs that make a motion, with the multipliers of its constraints: inverse dynamics by the inputs.

        q, u, ud   coordinates (n_q,), speeds (n_u,) and their rates (n_u,), in order, or by name or symbol (ud by the names of
                   the speeds); what is left out takes the system's initial value, accelerations 0. They must fulfil the
                   constraints, to 1e-6 of the mechanism's length, of its speed and of its accelerations
        inputs     those that are kept, by name or symbol; all others are found
        z          extra states (n_z,), default: their initial values
        start      where the search begins for inputs that enter nonlinearly, by name or symbol; default: their initial values
        project    move q, u and ud onto the constraints first, by the smallest change in the metric of the mass matrix
        keep       coordinates and speeds, by name or symbol, that stay then, with the rates of these speeds: those of a platform,
                   whose legs follow

        The inputs are unique where as many as freedoms work independently; more of them are those of least norm, each counted
        in its own unit; where there are fewer, the motion must be one that the mechanism can make with them. Inputs that enter
        nonlinearly are found by Newton's method with the exact derivative, near `start` if there are several solutions.
        Raises ArgumentError for a motion that violates the constraints, or that the inputs cannot make, with the direction in
        coordinates and the force that is missing; where no solution is found; and where more inputs than freedoms enter
        nonlinearly, by name. See symdyn.statics.actuation.Actuation for the result, and for the source.

        >>> system = sd.systems.pendulum()
        >>> system.add_joint_force("pivot", sd.inputs("tau"))
        >>> system.compile(backend="numpy").actuation(0.0, q=[0.0], u=[0.0], ud=[1.0])["tau"]
        1.0
        """
        from symdyn.statics.actuation import actuation

        return actuation(self, t, q, u, ud, params, inputs, z, start, project, keep)

    def input_matrix(self, t: float, x: States, params: States | None = None, inputs: States | None = ()) -> Labelled:
        """Exact derivative of the generalized forces F_tilde by the inputs, (n_u, n_in), at the state x = [q; u; z], in order or
        by name; with the names of speeds and inputs, by which it is indexed, too.

        inputs   where they enter nonlinearly the matrix depends on them; default: their initial values

        >>> module = sd.systems.cart_pole().compile(backend="numpy")
        >>> module.input_matrix(0.0, [0.0, 0.0, 0.0, 0.0])
                            F [N]
        q1_dot [N]              1
        q2_dot [N m]            0
        """
        from symdyn.statics.actuation import input_matrix

        return input_matrix(self, t, x, params, inputs)

    def outputs(self, t: Times, x: States, params: States | None = None, inputs: States | None = ()) -> dict[str, np.ndarray]:
        """The user's named outputs.

        >>> system = sd.systems.pendulum()
        >>> system.add_output("tip", sd.position("bob", [0, -1]))
        >>> system.compile(backend="numpy").outputs(0.0, [0.0, 2.0])
        {'tip': array([ 0., -1.])}
        """
        return self.split_outputs(self.evaluate("outputs", t, x, params, inputs))

    @overload
    def jacobian(self, t: Times, x: States, params: States | None = None, inputs: States | None = (), *, of: str = "rhs",
                 ud: States = ()) -> Jacobian[np.ndarray]: ...

    @overload
    def jacobian(self, t: Times, x: States, params: States | None = None, inputs: States | None = (),
                 wrt: Sequence[str] = ("x", "inputs", "params"), of: str = "rhs",
                 ud: States = ()) -> Jacobian[np.ndarray | None] | FurtherDerivatives: ...

    def jacobian(self, t: Times, x: States, params: States | None = None, inputs: States | None = (),
                 wrt: Sequence[str] = ("x", "inputs", "params"), of: str = "rhs",
                 ud: States = ()) -> Jacobian[np.ndarray | None] | FurtherDerivatives:
        """Exact derivatives of a function, by default of x_dot, by state, inputs and parameters.

        wrt   by what: of "x", "inputs", "params", "t" (the others held), "ud" (accelerations, of functions that take them)
        of    the name of a function, such as "inverse_dynamics", "lam", "reactions", "outputs", "energy"; each derivative has the
              shape of the function with one axis more
        ud    accelerations (n_u,) of functions that take them; zero if they are left out
        t, x, params, inputs and ud are those of `evaluate`; of rows of states there are rows of derivatives. With C several
        columns are computed at once where that is faster, a direction in each SIMD lane. Accelerations and multipliers are
        differentiated through what they are solved from, so that no factorization is differentiated.

        With Euler parameters the derivatives by the state hold along changes that keep their norm. Raises ArgumentError for what
        there are no derivatives of or by, EvaluationError for those of multipliers and reactions at states where redundant
        constraints leave a choice of multipliers.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.jacobian(0.0, [0.0, 0.0]).x.round(6)
        array([[ 0.  ,  1.  ],
               [-9.81,  0.  ]])
        >>> module.jacobian(0.0, [0.0, 0.0], of="inverse_dynamics", wrt=["ud"], ud=[0.0]).ud
        array([[1.]])
        """
        if not isinstance(wrt, (list, tuple)):
            raise ArgumentError(f"{self.name}: wrt is {shown(wrt)}; pass a list of {_BY}")
        unknown = [w for w in wrt if not isinstance(w, str) or w not in FurtherDerivatives._fields]
        if unknown:
            raise ArgumentError(f"{self.name}: jacobian by {', '.join(map(name_of, unknown))} asked for; there are "
                                f"{_BY}")
        names = self._derivatives(of)
        if "ud" in wrt and "ud" not in self._library(of).metadata.arguments[of]:
            raise ArgumentError(f"{self.name}: jacobian of {of} by ud asked for, and {of} takes no accelerations; leave ud "
                                "out of wrt")
        result = {w: self.evaluate(names[w], t, x, params, inputs, ud if of != "rhs" else ()) for w in wrt}
        if of in _OF_MULTIPLIERS:
            self._demand_unique_multipliers(of, t, x, params)
        return FurtherDerivatives(**result) if {"t", "ud"}.intersection(wrt) else _jacobian(result)

    def _demand_unique_multipliers(self, of: str, t: Times, x: States, params: States | None) -> None:
        """Raises EvaluationError where the motion does not determine all multipliers.

        Those taken have the least norm, and how the choice turns with the state is no part of the equations that are
        differentiated (the third term of Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973)).
        """
        from symdyn.runtime.constraints import names, unique

        rows = names(self)
        alone = unique(self, t, x, params) if rows else np.ones(0, dtype=bool)
        free = [name for k, name in enumerate(rows) if not alone[..., k].all()]
        if free:
            raise EvaluationError(f"{self.name}: derivatives of {of} were requested, but constraints that depend on each other "
                                  f"leave a choice of the multipliers of {', '.join(free)}; leave out the redundant constraints "
                                  "that system.diagnose() lists, or differentiate accelerations, which the choice does not "
                                  "change")

    @overload
    def adjoint(self, t: Times, x: States, weights: States, params: States | None = None,
                inputs: States | None = ()) -> Jacobian[np.ndarray]: ...

    @overload
    def adjoint(self, t: Times, x: States, weights: States, params: States | None = None, inputs: States | None = (),
                wrt: Sequence[str] = ("x", "inputs", "params")) -> Jacobian[np.ndarray | None] | FurtherDerivatives: ...

    def adjoint(self, t: Times, x: States, weights: States, params: States | None = None, inputs: States | None = (),
                wrt: Sequence[str] = ("x", "inputs", "params")) -> Jacobian[np.ndarray | None] | FurtherDerivatives:
        """Gradient of a weighted sum of the rates, weights^T x_dot, by state, inputs, parameters and time, at the cost of about
        two evaluations of x_dot.

        weights   (n_x,), in the order of the state, or rows of them
        wrt       by what: of "x", "inputs", "params", "t"
        The others as for `jacobian`. Raises ArgumentError for weights and names that do not fit, SymdynError where rates of
        states depend on multipliers.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.adjoint(0.0, [0.0, 0.0], [0.0, 1.0], wrt=["x"]).x.round(6)
        array([-9.81,  0.  ])
        """
        self._weighted(wrt, "adjoint")
        given = self._with_weights(weights, (), 0)
        result = {w: self.evaluate(Weighted(ADJOINT, (w,)).name, t, x, params, inputs, given) for w in wrt}
        return FurtherDerivatives(**result) if "t" in wrt else _jacobian(result)

    def hessian(self, t: Times, x: States, weights: States, params: States | None = None, inputs: States | None = (),
                wrt: Sequence[str] = ("x",), along: States | None = None) -> np.ndarray:
        """Exact second derivatives of a weighted sum of the rates, weights^T x_dot: (n, n), symmetric.

        weights   (n_x,), in the order of the state, or rows of them
        wrt       by what: of "x", "inputs", "params", "t", in this order; n is the number of all of them
        along     (n,) a direction: the product of the matrix and it, (n,), without the matrix
        The others as for `jacobian`. With Euler parameters the second derivatives hold along changes that keep their norm. Raises
        ArgumentError for weights, directions and names that do not fit, SymdynError where rates of states depend on multipliers.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.hessian(0.0, [np.pi / 2, 0.0], [0.0, 1.0]).round(6)
        array([[9.81, 0.  ],
               [0.  , 0.  ]])
        >>> module.hessian(0.0, [np.pi / 2, 0.0], [0.0, 1.0], along=[2.0, 0.0]).round(6)
        array([19.62,  0.  ])
        """
        self._weighted(wrt, "hessian")
        chosen = tuple(by for by in WEIGHTED if by in wrt)
        sizes = self.metadata.sizes
        n = sum({"x": sizes.x, "inputs": sizes.inputs, "params": sizes.p, "t": 1}[by] for by in chosen)
        kind = HESSIAN if along is None else HESSIAN_PRODUCT
        given = self._with_weights(weights, () if along is None else along, 0 if along is None else n)
        return self.evaluate(Weighted(kind, chosen).name, t, x, params, inputs, given)

    def _weighted(self, wrt: Any, what: str) -> None:
        """Raise ArgumentError for what the weighted rates are not differentiated by."""
        if not isinstance(wrt, (list, tuple)) or not wrt:
            raise ArgumentError(f"{self.name}: wrt is {shown(wrt)}; pass a list of {', '.join(WEIGHTED)}")
        unknown = [w for w in wrt if not isinstance(w, str) or w not in WEIGHTED]
        if unknown:
            raise ArgumentError(f"{self.name}: {what} by {', '.join(map(name_of, unknown))} asked for; there are "
                                f"{', '.join(WEIGHTED)}")

    def _with_weights(self, weights: Any, along: Any, n: int) -> np.ndarray:
        """Arguments of weighted functions in place of accelerations: zeros for these, weights, a direction."""
        rows = []
        for what, value, size in (("weights", weights, self.metadata.sizes.x), ("along", along, n)):
            numbers = real_of(value, self.name, f"{what} must be numbers")
            if numbers.ndim > 2 or numbers.shape[-1:] != (size,):
                raise ArgumentError(f"{self.name}: {what} has the shape {numbers.shape}; pass {size} finite numbers, or "
                                    "rows of them")
            if not np.isfinite(numbers).all():
                raise ArgumentError(f"{self.name}: {what} has {numbers[~np.isfinite(numbers)][0]}; pass {size} finite numbers, "
                                    "or rows of them")
            rows.append(numbers)
        length = max(len(np.atleast_2d(r)) for r in rows)
        flat = [np.zeros(self.metadata.sizes.u), *rows]
        if all(r.ndim == 1 for r in rows):
            return np.concatenate(flat)
        return np.column_stack([np.broadcast_to(r, (length, r.shape[-1])) for r in flat])

    def sparsity(self, wrt: str = "x", of: str = "rhs") -> np.ndarray:
        """Pattern of the derivatives of a function by one of x, inputs, params, t, ud that may differ from zero: bool, shaped as
        `jacobian(of=of, wrt=[wrt])` gives them.

        It is read off the statements: True for an entry that is zero by numbers only. Raises ArgumentError as `jacobian`.

        >>> sd.systems.cart_pole().compile(backend="numpy").sparsity().astype(int)
        array([[0, 0, 1, 0],
               [0, 0, 0, 1],
               [0, 1, 0, 1],
               [0, 1, 0, 1]])
        """
        if not isinstance(wrt, str) or wrt not in FurtherDerivatives._fields:
            raise ArgumentError(f"{self.name}: sparsity by {shown(wrt)} asked for; there are {_BY}")
        name = self._derivatives(of)[wrt]
        if not hasattr(self._provider, "structure"):
            raise ArgumentError(f"{self.name}: this module was put together without equations, so the structure of its "
                                "derivatives is unknown; compile equations")
        result = self.structure(name)
        return result if result is not None else np.zeros(self.shape(name), dtype=bool)

    def jacobian_indices(self) -> Pattern | None:
        """Entries of `jacobian_x` that may differ from zero, as indices of rows and columns; None where that is unknown, such as
        for a module without equations.

        >>> sd.systems.pendulum().compile(backend="numpy").jacobian_indices().columns
        array([1, 0])
        """
        result: Pattern | None = getattr(self._provider, "pattern", None)
        return result

    def breaks(self) -> Tape | None:
        """Surfaces at which the right-hand side has a kink or a jump, a tape with the output `surfaces`; None where it has
        none, or where the module was put together without equations.

        >>> sd.systems.pendulum().compile(backend="numpy").breaks() is None
        True
        """
        result: Tape | None = getattr(self._provider, "breaks", None) if self.metadata.not_smooth else None
        return result

    def structure(self, name: str) -> np.ndarray | None:
        """Entries of a matrix of derivatives, such as hessian_x, that may differ from zero; None where that is unknown.

        >>> sd.systems.pendulum().compile(backend="numpy").structure("hessian_x").astype(int)
        array([[1, 0],
               [0, 0]])
        """
        result: Callable[[str], np.ndarray | None] = getattr(self._provider, "structure", lambda name: None)
        return result(name)

    def _derivatives(self, of: Any) -> dict[str, str]:
        """Quantities by which a function is differentiated -> the name of the derivative's function."""
        text(of, f"{self.name}: the name of the function to differentiate", "inverse_dynamics")
        self._library(of)
        return {by: derivative_of(of, by) for by in FurtherDerivatives._fields}

    def function(self, name: str) -> Callable[..., np.ndarray]:
        """One function as f(q, u, params, t=0, inputs=(), ud=()), of one state or of rows of states.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.function("mass_matrix")([0.1])
        array([[1.]])
        """
        self._library(text(name, f"{self.name}: the name of a function", "mass_matrix"))

        def call(q: Any, u: Any = None, params: Any = None, t: Any = 0.0, inputs: Any = (),
                 ud: Any = ()) -> np.ndarray:
            return self.evaluate(name, t, self._state(q, u), params, inputs, ud)

        return call

    def bind(self, params: States | None = None) -> BoundModule:
        """The module with these parameters, whatever becomes of `params` later: the prologue runs here and not again.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.bind({"l": 2.0}).rhs(0.0, [0.1, 0.0]).round(6)
        array([ 0.      , -0.489683])
        """
        return BoundModule(self, self.parameters(params))

    def parameters(self, params: States | None = None) -> np.ndarray:
        """Parameters in order, (n_p,).

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.parameters({"l": 2.0})
        array([9.81, 1.  , 2.  ])
        """
        return take(params, self.metadata.parameters, "parameters", self._defaults, self.name)

    @functools.cached_property
    def default_parameters(self) -> np.ndarray:
        """Their defaults, (n_p,), not to be written to: change a copy of them. Raises ArgumentError for those without one.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.default_parameters
        array([9.81, 1.  , 1.  ])
        """
        return fixed(self.parameters())

    # -- constraints

    def consistent(self, q: States | None = None, u: States | None = None, params: States | None = None, t: float = 0.0,
                   keep: Names = (), *, inputs: States | None = None) -> tuple[np.ndarray, np.ndarray]:
        """A state that fulfils the constraints: q (n_q,) and u (n_u,) near the guess, by the smallest change of both.

        q, u    in order, or by name or symbol; what is left out takes the system's initial value, else 0. The guess
                selects one of several solutions (branches)
        keep    coordinates and speeds, by name or symbol, that stay as given
        inputs  values and rates of motions that the constraints follow, {z: 0.1, z.dot: 0.3}, or as for `simulate`, at t
        The change is the smallest in the metric of the mass matrix, as that of the projection in `simulate`: the speeds are
        those after an impact, without rebound, of a mechanism whose constraints begin to hold, exact to rounding also with
        redundant constraints; along motions that move no mass the smallest velocities are added. Raises ArgumentError with
        the residual of every constraint that is left where there is no solution nearby.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.consistent({"q1": 0.1})
        (array([0.1]), array([0.]))
        """
        from symdyn.runtime.consistent import consistent

        return consistent(self, q, u, params, t, keep, inputs)

    def rank(self, q: States, params: States | None = None, t: Times = 0.0, inputs: States | None = ()) -> int | np.ndarray:
        """Number of independent constraints: rank of the scaled Jacobian C_scale C_r, of one state or rows of states.

        Columns of angular velocities are divided by the mechanism's length; singular values below 1e-8 of the largest are zero.
        inputs: values of motions, which constraints may follow.

        >>> module = sd.systems.four_bar().compile(backend="numpy")
        >>> int(module.rank([0.3, 1.0, 2.0]))
        2
        """
        from symdyn.runtime.constraints import rank

        return rank(self.following(self._rows(inputs, "inputs", "inputs")), t, self._state(q), self.parameters(params))

    def unique(self, q: States, params: States | None = None, t: Times = 0.0, inputs: States | None = ()) -> np.ndarray:
        """Mask of the multipliers that the motion determines, (n_c,) of bool, by the same singular values as `rank`.

        >>> module = sd.systems.four_bar().compile(backend="numpy")
        >>> module.unique([0.3, 1.0, 2.0])
        array([ True,  True])
        """
        from symdyn.runtime.constraints import unique

        return unique(self.following(self._rows(inputs, "inputs", "inputs")), t, self._state(q), self.parameters(params))

    # -- motion

    def simulate(self, t: Row | None = None, q: Values | None = None, u: Values | None = None,
                 params: Values | None = None, *, z: Values | None = None, inputs: InputValues | None = None,
                 rtol: float = 1e-8, atol: float | Row | None = None, method: str | type | None = None,
                 steps: bool = False, max_step: float = 0.0, first_step: float = 0.0, max_steps: int | None = None,
                 progress: bool = False, work: bool = False, stabilization: str | tuple[str, float] | None = None,
                 events: bool | str | Sequence[str] = True, event_spacing: float = 0.0, interpolation: str = "linear",
                 extend: str = "error", sensitivities: Names | Named[Row] | None = None, sensitivity_control: bool = True,
                 step: float = 0.0) -> Solution:
        """Integrate the motion.

        t           (start, end): 1001 points between, or with steps=True every step the integrator took; or an array of
                    output times; default: from 0 over the system's duration
        q, u, z     start; in order, or by name or symbol; what is left out takes the system's initial value, else 0
        params      as everywhere in Module
        inputs      numbers; a table: (times, values), or a symdyn.Table; a spline of SciPy, of order three at most; a function of
                    (t, x); an expression of symdyn.t; sd.Sampled(function, period) for a controller whose value is held between
                    its instants, at which steps end; or a mapping from names to these.
                    A motion (sd.motions): a function of t that returns value, rate and acceleration, an expression of symdyn.t, a
                    spline of SciPy, a table, or a number
        interpolation, extend   of tables that are pairs: "linear" or "cubic", a smooth spline (steps end at the times of both);
                    beyond the first and the last time "error", or "hold": the first value, and the last one
        rtol, atol  relative and absolute tolerance of a step; rtol from 1e-15 to 0.1; atol a number or (n_x,), default rtol
        method      compiled: one of "dop853" (default with the C backend), "bs54" for loose tolerances, "taylor" for fine
                    ones, "radau" for stiff systems ("radau5" at loose tolerances), "gauss" for very long
                    conservative motion (with first_step its steps have that length, but for some that a warning counts); or one
                    of SciPy's RK23 RK45 DOP853 Radau BDF LSODA, or an OdeSolver class; Radau, BDF and LSODA get the exact
                    Jacobian. With constraints also "ggl": the stabilized index-2 form of Gear, Gupta and Leimkuhler by an
                    implicit method (pip install 'symdyn[dae]'). With rigid contacts also "moreau": time stepping, for very many
                    impacts, see docs/contact.md. "auto": by tolerance, stiffness (short trial runs) and
                    constraints; `Solution.why` gives the reason
        max_step, first_step   s, 0: chosen by the integrator;  max_steps: stop after so many
        progress    show a bar (needs tqdm), which also reports what is derived and compiled at the first use of a method
        work        integrate the work of all loads but gravity and springs along with the motion: `Solution.work`
        stabilization   what keeps constraints, and the norm of Euler parameters, to rounding or within the tolerances:
                    "projection": after every step, and at every output time, the smallest change in the metric of the mass
                    matrix that fulfils them; "baumgarte", or ("baumgarte", a): C_ddot + 2 a C_dot + a^2 C = 0 instead of
                    C_ddot = 0, unless given with a = 1/(twenty mean steps of a short run without); "none".
                    Default: projection, with methods that build on several steps (BDF, LSODA) baumgarte
        events      which of the system's events are looked for: True (all), False, or names; see `Solution.events`
        event_spacing   the longest time between samples of the events, s, for pulses that last as long; 0: they are sampled as
                    they vary, with a warning where zeros between samples cannot be ruled out
        sensitivities   what the motion is differentiated by, exactly: parameters and constant inputs, by name or symbol, and
                    initial values, as "q1(0)"; or a mapping from these to derivatives of the start by them, (n_x,), for a
                    start that changes with them, such as on constraints (those of a list are: 1 for the state of "q1(0)",
                    else 0); see `Solution.sensitivity` and docs/derivatives.md. Compiled methods only
        sensitivity_control   whether the steps keep the errors of the sensitivities within the tolerances, too; False: those of
                    the state alone
        step        length of the steps of method="moreau", s; 0: it is halved until the coordinates agree within the tolerances.
                    With method="auto" switches of contacts are located as long as they come slower than one in a step; where 200
                    of them come faster, the whole motion is made by time stepping

        Returns a Solution. A run that stops early keeps what was computed: `success` is False, `message` reports when, where
        and why, and a SimulationWarning is given. A motion that slides along a jump of the right-hand side is stopped like that,
        see symdyn.runtime.integrating.chatter. Steps that are far too short, and events whose zeros may be missed, give a
        SimulationWarning, which is kept in the Solution's `doubts`. An exception in a function of the user ends a run in the same
        way, and is its `cause`. Ctrl-C raises SimulationInterrupted, whose `solution` holds the same.
        Raises ArgumentError for values that do not fit.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.simulate((0, 1), q={"q1": 0.1}, rtol=1e-10).x[-1].round(6)
        array([-0.099993, -0.003585])
        """
        from symdyn.runtime.integrating.simulate import simulate

        return simulate(self, t, q, u, params, z=z, inputs=inputs, rtol=rtol, atol=atol, method=method, steps=steps,
                        max_step=max_step, first_step=first_step, max_steps=max_steps, progress=progress, work=work,
                        stabilization=stabilization, events=events, event_spacing=event_spacing, interpolation=interpolation,
                        extend=extend, sensitivities=sensitivities, sensitivity_control=sensitivity_control, step=step)

    def ode_solver(self, method: str = "dop853", params: Values | None = None, inputs: InputValues | None = None, *,
                   events: bool = True, stabilization: str | tuple[str, float] | None = None, interpolation: str = "linear",
                   extend: str = "error") -> type[CompiledSolver]:
        """Make a class of the compiled integrator that `scipy.integrate.solve_ivp` takes as its method.

        method   "dop853", "bs54", "radau", "radau5", "gauss" or "taylor", as for `simulate`
        params, inputs, stabilization, interpolation, extend   as for `simulate`
        events   False leaves out events of the system that reset states or end the motion; with True (default) they raise, as
                 solve_ivp looks for no other events than those that it is given

        The class has the right-hand side `rhs(t, y)`, (n_x,) or (n_x, k), and its exact Jacobian `jac(t, y)`, (n_x, n_x), which
        SciPy's own methods take as well. `solve_ivp` raises where its fun is not this right-hand side; None stands for it. Times
        are in s, y is [q; u; z]. Tolerances are 1e-8 unless given. Constraints are kept along the steps and within them.
        Raises ArgumentError for other methods, without the C backend, for sampled controllers and rigid contacts.

        >>> from scipy.integrate import solve_ivp
        >>> solver = sd.systems.pendulum().compile().ode_solver(params={"l": 2.0})
        >>> solve_ivp(solver.rhs, (0, 1), [0.1, 0.0], method=solver).y[:, -1].round(6)
        array([-0.059931, -0.177191])
        """
        from symdyn.runtime.integrating.ode_solver import Setting, solver_of

        return solver_of(Setting.of(self, method, params, inputs, events, stabilization, interpolation, extend))

    def gradient(self, loss: Loss, by: Names | Named[Row], t: Row | None = None, q: Values | None = None, u: Values | None = None,
                 params: Values | None = None, *, z: Values | None = None, inputs: InputValues | None = None, rtol: float = 1e-8,
                 atol: float | Row | None = None, method: str | None = None, max_step: float = 0.0, first_step: float = 0.0,
                 stabilization: str | None = None, events: bool | str | Sequence[str] = True, interpolation: str = "linear",
                 extend: str = "error") -> Gradient:
        """Derivatives of a loss of a motion by many numbers at once, backwards over the steps that were taken.

        loss     sd.Loss: the integral of an expression or function over time, and one at the end
        by       parameters, constant inputs, by name or symbol, and initial values, as "q1(0)"; or a mapping from these to
                 derivatives of the start by them, (n_x,), as for `simulate`
        method   "dop853" (default) or "bs54"; all others as for `simulate`

        They are the derivatives of what these steps compute, exact to rounding at given lengths of the steps; with constraints
        as far as the corrections are small. The integral of a loss keeps the tolerances, too: steps are taken again, shorter,
        where its integrand needs it, as at kinks of the equations; a warning says what is not resolved, such as poles and jumps
        of functions of the user. The cost is that of some simulations, however many numbers there are; memory grows
        with the square root of the number of steps; across events with that of steps. Across events, resets, switches of rigid
        contacts (not across both) and instants of sampled controllers (which need their gradient) the motion is cut, and the
        derivatives are as exact as the tolerances; a loss at an end by an event moves with the time of it.
        Returns a Gradient. Raises ArgumentError for what does not fit, EvaluationError where the motion stops early or the loss
        is not finite.

        >>> module = sd.systems.pendulum().compile()
        >>> found = module.gradient(sd.Loss(end=sp.Symbol("q1")), ["q1(0)"], (0.0, 1.0), q=[0.0])
        >>> round(float(found["q1(0)"]), 3), round(float(np.cos(np.sqrt(9.81))), 3)  # near rest q1(1) = q1(0) cos(sqrt(g/l))
        (-1.0, -1.0)
        """
        from symdyn.runtime.integrating.gradient import gradient

        return gradient(self, loss, by, t, q, u, params, z=z, inputs=inputs, rtol=rtol, atol=atol, method=method,
                        max_step=max_step, first_step=first_step, stabilization=stabilization, events=events,
                        interpolation=interpolation, extend=extend)

    def simulate_batch(self, q: OfMany | None = None, u: OfMany | None = None,
                       params: OfMany | None = None, *, z: OfMany | None = None, t: Row | None = None,
                       inputs: InputValues | OfMany | None = None, rtol: float = 1e-8, atol: float | Row | None = None,
                       max_step: float = 0.0, first_step: float = 0.0, method: str | type | None = None,
                       max_steps: int | None = None, stabilization: str | tuple[str, float] | None = None,
                       events: bool | str | Sequence[str] = True, event_spacing: float = 0.0,
                       interpolation: str = "linear", extend: str = "error",
                       sensitivities: Names | Named[Row] | None = None,
                       sensitivity_control: bool = True, device: str = "cpu", precision: str = "double") -> BatchSolution:
        """Integrate many motions of one mechanism, each with its own steps.

        q, u, z     starts: in order, (n_q,) for all or (n, n_q); or by name or symbol, each a number or an array (n,); what is
                    left out takes the system's initial value, else 0
        params      (n_p,), (n, n_p), or by name or symbol, each a number or an array (n,)
        inputs      constants, in the same ways; or what `simulate` takes, the same for all, with interpolation and extend (a
                    sampled controller is asked in one motion after the other)
        t           (start, end): the end states alone are kept; or an array of output times; default: from 0 over the duration
        rtol, atol, max_step, first_step   as for `simulate`
        method, max_steps, stabilization, events, event_spacing   as for `simulate`, too
        sensitivities, sensitivity_control   as for `simulate`, by the same names in all motions; see `BatchSolution.sensitivity`

        device      "cpu"; or "gpu", "gpu:1" for the second one: a thread each on an NVIDIA GPU, by the kernel that the C of the
                    mechanism is, too (`pip install 'symdyn[gpu]'`). Results are not the same bits. Starts, parameters and
                    inputs in arrays of JAX, CuPy and PyTorch that lie there (any that has `__dlpack__` or
                    `__cuda_array_interface__`) are read there, and states stay there: `BatchSolution.x_on_device`, which `x`
                    copies at its first use

        precision   of the device, and of arrays there: "double", or "single": float32, with rtol from 1e-6 on, compensated sums
                    over steps, times in doubles; without constraints and events, by explicit methods

        With the C backend as many motions as the processor's vectors have lanes advance at once; each takes the very steps that
        `simulate` takes, projections onto constraints, events with resets and inputs by tables included, by `dop853` or `bs54`,
        and a lane that is through goes on with the next motion. Mechanisms with rigid contacts, inputs by functions, implicit
        methods, other options, sensitivities across events that reset states or of right-hand sides that may jump, and the NumPy
        backend run one by one through `simulate`; `note` of the solution documents it.

        A motion that fails is reported with its number (`success`, `messages`, a SimulationWarning), the others run on. Ctrl-C
        raises SimulationInterrupted, whose `solution` holds what was finished. A SimulationWarning reports in how many motions
        loads leave what they are meant for, or Euler angles come too near to gimbal lock, at the states that are kept. Raises
        ArgumentError for what does not fit, for a device that is not there and for what it cannot take.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.simulate_batch({"q1": [0.1, 0.2]}, t=(0, 1)).x.shape
        (2, 1, 2)
        """
        from symdyn.runtime.batches.motions import simulate_batch

        return simulate_batch(self, q, u, params, z=z, t=t, inputs=inputs, rtol=rtol, atol=atol, max_step=max_step,
                              first_step=first_step, method=method, max_steps=max_steps, stabilization=stabilization,
                              events=events, event_spacing=event_spacing, interpolation=interpolation, extend=extend,
                              sensitivities=sensitivities, sensitivity_control=sensitivity_control, device=device,
                              precision=precision)

    # -- statics and linearization

    def equilibrium(self, free: Names | None = None, fixed: Numbers | None = None, start: Start | None = None,
                    params: States | None = None, t: float = 0.0, inputs: States | None = None,
                    unknown_params: Names | None = None, max_iterations: int = 100) -> Equilibrium:
        """A state of rest, or of steady motion with prescribed speeds, near a start: Newton's method with exact derivatives.

        free      coordinates that are found, by name or symbol; the others stay at the start. Default: all. Parameters and
                  inputs among them are found, too: each takes one value in `fixed` as its condition, whose equation then
                  holds (a coordinate that is named in both where it is not clear which)
        fixed     coordinates, speeds and extra states with the numbers they have; forces along them may be anything. The
                  coordinate of a speed that is given stays at its start (the azimuth of a rotor that spins steadily)
        start     by name or symbol, in order (q, or x), or an Equilibrium; default: the system's initial values, speeds zero.
                  Inputs and parameters that are solved for may be named, too: guesses of them
        unknown_params   parameters that are found, in place of naming them in `free`; which values in `fixed` are their
                  conditions is then decided by their effect

        Inputs that hold a state (trim) are named in `free`, and the coordinates that they hold in `fixed`, one for each:
        module.equilibrium(free=["tau1", "tau2"], fixed={"q1": 0.5, "q2": 0.3}).solved are the torques that hold an arm there.
        Inputs that make a motion, of which rest is one, are those of `actuation`, which also takes more inputs than freedoms.

        Constraints are fulfilled at the same time. Raises NoEquilibrium with the forces that are left,
        EquilibriumNotUnique with the direction that has no stiffness, or none beyond rounding, ArgumentError for what does not
        fit.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> abs(module.equilibrium(start={"q1": 0.1})["q1"]) < 1e-9
        True
        """
        from symdyn.statics.equilibrium import equilibrium

        self._demand_no_rigid_contacts("equilibria")
        return equilibrium(self, free, fixed, start, params, t, inputs, unknown_params, max_iterations)

    def equilibria(self, starts: int | Sequence[Start] = 100, ranges: Ranges | None = None, seed: int = 0,
                   start: Start | None = None, free: Names | None = None, fixed: Numbers | None = None,
                   params: Values | None = None, t: float = 0.0, inputs: Values | None = None,
                   unknown_params: Names | None = None, max_iterations: int = 100) -> Equilibria:
        """Equilibria from many starts.

        starts   how many random ones, or the starts themselves, each as for Module.equilibrium
        ranges   coordinate or speed -> (least, most), or r for (-r, r): how far random starts are from `start`; a speed stands
                 for the motion along it (rotations in Euler parameters: about that axis). Default: half a turn, 1 m
        seed     of the random numbers, a whole number of at least 0
        start, free, fixed, params, t, inputs, unknown_params, max_iterations   as for Module.equilibrium
        Two are the same if coordinates differ by less than 1e-6, angles of joints that turn
        all the way by whole turns, Euler parameters by their sign. A start that leads to none is listed in `failures`; raises
        NoEquilibrium with the first message if none of them leads anywhere.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> len(module.equilibria(10))
        2
        """
        from symdyn.statics.equilibria import equilibria

        self._demand_no_rigid_contacts("equilibria")
        return equilibria(self, starts, ranges, seed, start, free, fixed, params, t, inputs, unknown_params, max_iterations)

    def rest(self, start: Start | None = None, params: Values | None = None, inputs: Values | None = None, t: float = 0.0,
             contacts: Mapping[str, ContactMode] | None = None) -> Rest:
        """A state of rest on rigid contacts near a start: where forces balance, with normal forces that push and friction within
        its cones.

        start      coordinates by name or symbol, in order, or x; default: the system's initial values
        params, inputs, t   as for `equilibrium`
        contacts   modes by name, "open", "sticking" or "sliding" (without friction); what is left out is open. Default: contacts
                   that touch at the start stick, or slide where they have no friction

        Contacts that stick stay where they are; all else moves until it balances. Raises NoEquilibrium where nothing does, or
        where the contacts would have to pull, or need more friction than they have; ArgumentError for what does not fit. See
        symdyn.statics.contact_rest.Rest for the forces, which contacts carry, and the range over which the state stays.

        >>> y = sd.coordinates("y")
        >>> system = sd.System("ball", gravity=[0, -9.81])
        >>> ball = system.add_body("ball", mass=1.0)
        >>> joint = system.add_joint(sd.Prismatic("height", system.ground, ball, axis=[0, 1], coordinate=y))
        >>> contact = system.add_contact(sd.Contact("floor", ball, system.ground))
        >>> system.compile(backend="numpy").rest().contacts["floor"].force
        array([9.81])
        """
        from symdyn.statics.contact_rest import rest

        return rest(self, start, params, inputs, t, contacts)

    def linearize(self, at: Start | Rest | None = None, params: States | None = None, t: float | None = None,
                  inputs: States | None = None, free: Names | None = None, fixed: Numbers | None = None,
                  coordinates: Names | None = None, hold: Names | None = None,
                  contacts: Mapping[str, ContactMode] | None = None) -> Linearization:
        """The linear equations about a state on the manifold of the constraints, by exact derivatives.

        at            an Equilibrium or a Rest, with all that belongs to it; a Solution, at its time nearest to t; x in order;
                      (q, u); or by name or symbol. Default: the system's initial values
        free, fixed   as for `equilibrium`; what stays is left out
        coordinates   which changes are independent, where constraints leave a choice; default: the best conditioned
        hold          coordinates and speeds that are held when the state is disturbed, by name or symbol; default: what `fixed`
                      names or the equilibrium kept, but for the conditions of a trim; () holds nothing
        contacts      modes of rigid contacts by name: "open", "sticking", "sliding", or ("sliding", direction) where nothing
                      slips; what is left out is open. Changes keep closed contacts closed, and sticking ones where they stick

        See symdyn.statics.linearize.Linearization for M, C, K, A, B, C_out, D, modes() and derivative().
        Raises ArgumentError for states off the constraints, for those where the equations have a kink or a jump, and where
        contacts touch whose modes are not given.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.linearize({"q1": 0.0}).A.round(4) + 0.0
        array([[ 0.  ,  1.  ],
               [-9.81,  0.  ]])
        """
        from symdyn.statics.linearize import linearize

        return linearize(self, at, params, t, inputs, free, fixed, coordinates, hold, contacts)

    def stability(self, at: Start | None = None, params: States | None = None, t: float = 0.0, inputs: States | None = None,
                  free: Names | None = None, fixed: Numbers | None = None, hold: Names | None = None,
                  period: float | None = None, start: Start | None = None) -> Stability:
        """Decide whether small disturbances of a state of rest, a steady motion or a periodic motion die out, with the evidence.

        at       an Equilibrium; or the state, as for `linearize`; where it is not on a steady motion, the periodic motion near
                 it is found first
        fixed    speeds (and coordinates) that are held at a value, such as {"azimuth_dot": 1.2}; the period is then 2 pi over it
        hold     what is held when disturbed, by name; default: what `fixed` names, or the equilibrium kept
        period   of a prescribed periodic motion, s: needed where t appears in the equations; a guess where neither t nor held
                 speeds set the time, such as for a limit cycle, whose period is found with its state
        start    in place of `at`: a guess of the state, by name or in order

        Constant equations are judged by their eigenvalues, those that a change of variables makes constant (a rotor of three or
        more like blades, a body that spins about its axis) after the change, others by Floquet theory. Raises ArgumentError where
        neither holds, NoEquilibrium where no periodic motion is found.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> print(module.stability({"q1": 0.0}).verdict)
        neutral
        """
        from symdyn.statics.stability import stability

        return stability(self, at, params, t, inputs, free, fixed, hold, period, start)

    def periodic(self, period: float, q: Values | None = None, u: Values | None = None, params: Values | None = None, *,
                 z: Values | None = None, t: float = 0.0, inputs: Values | None = None,
                 advance: Numbers | None = None, cyclic: Names | None = None,
                 exchange: Sequence[tuple[Key, Key]] | None = None, rtol: float = 1e-10,
                 method: str = "dop853") -> PeriodicMotion:
        """A periodic motion near a start, by shooting with exact sensitivities.

        period    s: where the time appears in the equations that of the motion, a multiple of that of the drive; else a guess,
                  found with the start, of the smallest period or of a multiple of it
        q, u, z   near the motion, as for `simulate`; t: the time there; inputs: constants
        advance   what coordinates gain in a period, by name or symbol: 2 pi for a wheel that turns once
        cyclic    coordinates that nothing depends on and that need not come back, such as the way of a walker
        exchange  pairs of coordinates that have changed roles after a period, with their speeds: the legs of a walker, whose step
                  is a period then
        rtol, method   of the integration, a compiled method

        On constraints, across events and across the switches and impacts of rigid contacts; the start lies between two of these.
        Returns a PeriodicMotion with `period`, `x` (the start), `params` and `multipliers`; see there for `follow`, over a
        parameter. Raises NoEquilibrium where none is found, with what is left, ArgumentError for what does not fit: also for a
        period with which the equations are not periodic. Warns of jumps that the multipliers lack, as `simulate` does.

        >>> q = sd.coordinates("q")
        >>> system = sd.System("van_der_pol")
        >>> body = system.add_body("body", mass=1)
        >>> slide = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=q))
        >>> system.add_joint_force(slide, (1 - q**2) * q.dot - q)
        >>> system.embedding().compile().periodic(6.0, [2.0], [0.0])
        <PeriodicMotion of van_der_pol: period 6.66328686 s, multipliers of size 1, 0.0008597>
        """
        from symdyn.statics.periodic import periodic

        return periodic(self, period, q, u, params, z=z, t=t, inputs=inputs, advance=advance, cyclic=cyclic, exchange=exchange,
                        rtol=rtol, method=method)

    def campbell(self, speed: Key, values: Times, free: Names | None = None, fixed: Numbers | None = None,
                 start: Start | None = None, params: Values | None = None, t: float = 0.0, inputs: Values | None = None,
                 blades: Sequence[Sequence[Key]] = (), azimuth: Key | None = None, azimuths: int = 12, max_iterations: int = 100,
                 frame: str = "fixed", averaged: bool = False) -> Campbell:
        """Natural frequencies over a rotor's speed.

        speed      name or symbol; values: rad/s. At each the equilibrium with this speed is found, then its modes
        free, fixed, start, params, t, inputs, max_iterations   as for Module.equilibrium
        blades     sets of coordinates of the blades of a rotor, one set per shape: the same coordinate of every blade, in the
                   order in which blades lie ahead of each other in the sense of the azimuth, such as
                   [("flap1", "flap2", "flap3")]: modes are named by multi-blade coordinates. A check at `azimuths`
                   positions shows whether these make the equations constant; where they do not (weight on the blades), the
                   periodic motion is found and judged by Floquet theory
        averaged   with blades: the mean of the equations over the azimuths in place of Floquet theory where they are periodic,
                   which is quicker and leaves out what is periodic; how much the entries vary is printed
        azimuth    the coordinate whose rate the speed is, where the names do not say it
        frame      "fixed": frequencies that the fixed frame sees; "rotating": those in the coordinates of the model, where the
                   equations are constant in them
        Without blades a change of variables that makes the equations constant is looked for; where there is none (two blades, an
        anisotropic rotor on anisotropic bearings), Floquet theory gives the modes. Raises NoEquilibrium, ArgumentError.

        >>> a, b, phi = sd.coordinates("a b phi")
        >>> system = sd.System("disc")
        >>> yoke, gimbal = system.add_body("yoke", mass=0), system.add_body("gimbal", mass=0)
        >>> disc = system.add_body("disc", mass=1, inertia=[0.5, 0.5, 0.8])
        >>> x = system.add_joint(sd.Revolute("x", system.ground, yoke, a, axis=[1, 0, 0]))
        >>> y = system.add_joint(sd.Revolute("y", yoke, gimbal, b, axis=[0, 1, 0]))
        >>> spin = system.add_joint(sd.Revolute("spin", gimbal, disc, phi, axis=[0, 0, 1]))
        >>> system.add_joint_force(x, -50 * a)
        >>> system.add_joint_force(y, -72 * b)
        >>> system.compile(backend="numpy").campbell("phi_dot", [0.0, 2.0])
        disc: damped natural frequencies in the fixed frame, Hz, held: phi_dot
         phi_dot [rad/s]  a backward  b forward
                       0      1.5915     1.9099
                       2      1.4688     2.0694
        """
        from symdyn.statics.campbell import campbell

        self._demand_no_rigid_contacts("natural frequencies over a speed")
        return campbell(self, speed, values, free, fixed, start, params, t, inputs, blades, azimuth, azimuths, max_iterations,
                        frame, averaged)

    def root_locus(self, parameter: Key, values: Times, at: Start | None = None, free: Names | None = None,
                   fixed: Numbers | None = None, start: Start | None = None, params: States | None = None, t: float = 0.0,
                   inputs: States | None = None) -> RootLocus:
        """Eigenvalues of the linear equations over a parameter; its `plot` shows them in the complex plane.

        parameter   name or symbol; values: its numbers. At each the equilibrium is found, from that of the value before
        at          a state where the equations are made linear in place of an equilibrium, see `linearize`
        free, fixed, start, params, t, inputs   as for `equilibrium`

        Modes are followed from value to value by the likeness of their shapes. Raises NoEquilibrium, ArgumentError.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.root_locus("l", [1.0, 4.0], start={"q1": 0.1}).eigenvalues.imag.ravel().round(6)
        array([3.132092, 1.566046])
        """
        from symdyn.statics.locus import root_locus

        self._demand_no_rigid_contacts("eigenvalues over a parameter")
        more = {"t": t, "inputs": inputs, "free": free, "fixed": fixed} | ({"start": start} if start is not None else {})
        return root_locus(self, parameter, values, at, params, **more)

    def _demand_no_rigid_contacts(self, what: str) -> None:
        """Raise ArgumentError where modes of rigid contacts would have to be chosen."""
        names = ", ".join(contact.name for contact in self.metadata.contacts)
        if names:
            raise ArgumentError(f"{self.name}: {what} are not known with the rigid contacts {names}, whose modes follow from a "
                                "motion; take module.rest(...) for states of rest on them, run simulate until the motion comes "
                                "to rest, or replace the contacts by constraints")

    # -- about the module

    def report(self) -> Report:
        """Report what was generated, what was skipped and why, and operation counts; prints as text.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.report().rows[0].function
        'rhs'
        """
        if self._reporter is None:
            raise ArgumentError(f"{self.name} was loaded from files; a report needs the equations it came from")
        from symdyn.runtime.batches.motions import many_at_once
        from symdyn.runtime.batches.states import LIBRARY

        return replace(self._reporter(), many=many_at_once(self, LIBRARY in self._libraries))

    def write(self, folder: PathName) -> list[Path]:
        """Write the generated files, complete with header, example and reference vectors; returns their paths.

        >>> import tempfile
        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> [path.name for path in module.write(tempfile.mkdtemp())]
        ['pendulum.py']
        """
        if self._writer is None:
            raise ArgumentError(f"{self.name} was loaded from files; copy them, or compile the equations it came from")
        target = as_path(folder, "of the folder to write to", "generated/arm")
        with writing(target):
            return self._writer(target)

    def to_fmu(self, path: PathName, version: int = 3, kind: str = "co_simulation", *, q: Values | None = None,
               u: Values | None = None, z: Values | None = None, params: Values | None = None,
               inputs: Values | None = None) -> Path:
        """Write an FMU, for programs that import the Functional Mock-up Interface; returns its path.

        version   of the interface, 3 or 2
        kind      "co_simulation", with the compiled integrator inside, or "model_exchange", for the importer's integrator
        q, u, z, params, inputs   values at the start, in order, or by name or symbol; what is left out takes the system's

        Variables are the states x, which are outputs, their derivatives der(...), inputs, tunable parameters, outputs, energies
        and event indicators, with units. Directional derivatives are exact. The sources are inside, and a binary for this
        platform; a CompilerWarning says where there is none, because there is no compiler.
        Raises ArgumentError for inputs that are functions, for rigid contacts (their modes are found in Python), for parameters
        without a value, and for a start off the constraints; CompileError.
        Source: Modelica Association, Functional Mock-up Interface Specification 3.0, and version 2.0.4.

        >>> import tempfile
        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.to_fmu(tempfile.mkdtemp() + "/pendulum.fmu").name
        'pendulum.fmu'
        """
        from symdyn.targets.fmu import write_fmu

        return write_fmu(self, path, version, kind, q=q, u=u, z=z, params=params, inputs=inputs)

    def to_modelica(self, folder: PathName, *, q: Values | None = None, u: Values | None = None, z: Values | None = None,
                    params: Values | None = None, inputs: Values | None = None) -> list[Path]:
        """Write a Modelica model as flat equations, and one that tests it, into a folder; returns their paths.

        q, u, z, params, inputs   values at the start, in order, or by name or symbol; what is left out takes the system's

        The model has parameters, inputs, outputs, energies, units and events, and needs no library. Constraints are stabilized by
        Baumgarte's method, with its gain as a parameter. The second model holds states with results of 30 digits: it simulates
        without a failed assertion.
        Raises ArgumentError for inputs that are functions, for rigid contacts (their modes are found in Python), for resets under
        constraints, for parameters without a value, and for a start off the constraints; UnsupportedExpression for buoyancy
        and mooring lines; SymdynError for functions of the user without a text in Modelica.
        Source: Modelica Association, Modelica Language Specification 3.6.

        >>> import tempfile
        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> [path.name for path in module.to_modelica(tempfile.mkdtemp())]
        ['pendulum.mo', 'pendulum_test.mo']
        """
        from symdyn.targets.modelica import write_modelica

        return write_modelica(self, folder, q=q, u=u, z=z, params=params, inputs=inputs)

    def split_outputs(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """The user's outputs by name from the rows of the function `outputs`.

        >>> system = sd.systems.pendulum()
        >>> system.add_output("tip", sd.position("bob", [0, -1]))
        >>> module = system.compile(backend="numpy")
        >>> module.split_outputs(module.evaluate("outputs", 0.0, [0.0, 0.0]))["tip"]
        array([ 0., -1.])
        """
        result, start = {}, 0
        for name, shape in self.metadata.outputs:
            size = int(np.prod(shape))
            part = rows[..., start:start + size]
            result[name] = part.reshape((*rows.shape[:-1], *shape))
            start += size
        return result

    @property
    def functions(self) -> tuple[str, ...]:
        """Names of the functions that can be evaluated.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.functions[0]
        'rhs'
        """
        return tuple(self.metadata.functions)

    def shape(self, name: str) -> tuple[int, ...]:
        """Shape of the result of a function at one state.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.shape("mass_matrix")
        (1, 1)
        """
        return tuple(self._library(name).metadata.shapes[name])

    def library(self, what: str | RightSide) -> Library:
        """The loaded library that has a function, or a right-hand side with its integrator.

        >>> library = sd.systems.pendulum().compile(backend="numpy").library("energy")
        >>> library.backend, library.metadata.operations
        ('numpy', {'energy': 6})
        """
        return self._library(what)

    def _has(self, what: str | RightSide) -> bool:
        """Whether a library is loaded already."""
        return (RightSide() if what == "rhs" else what) in self._libraries

    def _remembered(self, name: str, make: Callable[[], Any]) -> Any:
        """An object that this thread made under a name; it is made now if it was not."""
        kept = self._local.__dict__
        if name not in kept:
            kept[name] = make()
        return kept[name]

    def _library(self, what: str | RightSide) -> Library:
        what = RightSide() if what == "rhs" else what
        if what not in self._libraries:
            note: Callable[[str], None] = getattr(self._notes, "take", lambda label: None)
            note(what if isinstance(what, str) else what.label)
            try:
                self._make(what)
            finally:
                note("")
        return self._libraries[what]

    def _make(self, what: str | RightSide) -> None:
        with self._lock:  # the derivation behind it is for one thread at a time
            if what not in self._libraries:
                library = self._libraries[what] = self._provider(what)
                if what == RightSide() or what in library.metadata.shapes:  # other right-hand sides have a "rhs" of their own
                    for other in library.metadata.shapes:
                        self._libraries.setdefault(other, library)

    @contextlib.contextmanager
    def noting(self, note: Callable[[str], None]) -> Iterator[None]:
        """Have a function called whenever this thread makes a function of the module, which may take long: with a label at the
        beginning, and with "" at the end.

        >>> module, made = sd.systems.pendulum().compile(backend="numpy"), []
        >>> with module.noting(made.append):
        ...     rate = module.rhs(0.0, [0.0, 1.0])
        ...
        >>> made
        ['rhs', '']
        """
        self._notes.take = note
        try:
            yield
        finally:
            del self._notes.take

    def _evaluator(self, name: str, params: Any) -> Evaluator:
        return self._ready(name, params)[0]

    def _ready(self, name: str, params: Any) -> tuple[Evaluator, Any, Any]:
        """The evaluator of this thread with these parameters; remembered until they change."""
        known = getattr(self._local, name, None)
        mark = _mark(params)
        if known is None or known[1] is not params or known[2] != mark:
            evaluator = known[0] if known is not None else self._library(name).evaluator(name)
            evaluator.set_params(self.parameters(params))
            known = (evaluator, params, mark)
            setattr(self._local, name, known)
        return known

    def _initial(self, group: str) -> np.ndarray:
        """Values of entries of a group that are left out: their initial values in the system, else 0."""
        return np.array(list(self.metadata.initial_values(group).values()))

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

    def _rows(self, values: Any, what: str, group: str, metadata: Metadata | None = None) -> np.ndarray:
        """One row or rows of numbers of a group; what is left out takes its initial value, accelerations 0. Accelerations go by
        the names of the speeds."""
        about = metadata or self.metadata
        names = about.names(group)
        wanted = len(names)
        if what == "ud" and wanted == about.sizes.u:
            names = about.u
        initial = self.metadata.initial if what != "ud" else {}
        if isinstance(values, Mapping):
            return take(values, names, what, {n: initial.get(n, 0.0) for n in names}, self.name)
        array = real_of(values, self.name, f"{what} must be numbers")
        if array.ndim == 0 and wanted == 1:
            array = array.reshape(1)
        if array.shape == (0,) and what != "x":
            return np.array([initial.get(n, 0.0) for n in names], dtype=float)
        if array.ndim not in (1, 2) or array.shape[-1] != wanted:
            raise ArgumentError(f"{self.name}: {what} has the shape {array.shape}, needed are {wanted} numbers a state: "
                                f"{', '.join(names)}")
        return array

    def __repr__(self) -> str:
        sizes = self.metadata.sizes
        what = ", ".join(counted(n, one) for n, one in ((sizes.q, "coordinate"), (sizes.u, "speed"), (sizes.p, "parameter")))
        return f"<Module {self.name}: {self.backend}, {what}>"

    def _repr_html_(self) -> str:
        """Its states and parameters with units and numbers, as a notebook shows them."""
        about = self.metadata
        states = [(name, about.units.get(name, ""), f"{about.initial.get(name, 0.0):.6g}") for name in about.x]
        numbers = [(name, about.units.get(name, ""), "" if value is None else f"{value:.6g}")
                   for name, value in zip(about.parameters, about.defaults, strict=True)]
        tables = [(("state", "unit", "start"), states), (("parameter", "unit", "default"), numbers)]
        return titled(self, *[table(head, rows) for head, rows in tables if rows])


class BoundModule:
    """A module with fixed parameters. Each thread that uses it has its own buffers."""

    def __init__(self, module: Module, p: np.ndarray) -> None:
        self.module = module
        self.params = fixed(p)
        self._n_in: int = module.metadata.sizes.inputs
        self._one, self._free = (module.metadata.sizes.x,), (self._n_in,)
        self._inputs = np.array(list(module.metadata.initial_values("inputs").values()))
        self._local = threading.local()
        self._ready("rhs")

    def rhs(self, t: float, x: States, inputs: States | None = ()) -> np.ndarray:
        """x_dot (n_x,) at time t and state x = [q; u; z]."""
        return self._one_state(getattr(self._local, "rhs", None) or self._ready("rhs"), t, x, inputs)

    def jacobian_x(self, t: float, x: States, inputs: States | None = ()) -> np.ndarray:
        """d x_dot / d x (n_x, n_x)."""
        return self._one_state(getattr(self._local, "jacobian_x", None) or self._ready("jacobian_x"), t, x, inputs)

    def _one_state(self, evaluator: Any, t: float, x: Any, inputs: Any) -> np.ndarray:
        """A function at one state. Inputs that are left out take their initial values in the system, else 0."""
        if type(x) is np.ndarray and x.dtype is DOUBLE and x.shape == self._one and _is_time(t):
            if self._n_in == 0 and not len(inputs):
                return evaluator.one(float(t), x)  # type: ignore[no-any-return]
            if type(inputs) is np.ndarray and inputs.dtype is DOUBLE and inputs.shape == self._free:
                return evaluator.one(float(t), x, inputs)  # type: ignore[no-any-return]
        owner = self.module.name
        if isinstance(inputs, Mapping):
            names = self.module.metadata.inputs
            inputs = take(inputs, names, "inputs", dict(zip(names, self._inputs.tolist(), strict=True)), owner)
        state, free = real_of(x, owner, "x must be numbers"), real_of(inputs, owner, "inputs must be numbers")
        time = number_of(t, owner, "t must be a finite time")
        if state.shape != self._one or free.shape not in (self._free, (0,)):
            raise ArgumentError(f"{owner}: x has the shape {state.shape} and inputs has {free.shape}, needed are "
                                f"{self._one[0]} and {self._free[0]} numbers of one state; rows of states go to the module")
        if not np.isfinite(time):
            raise ArgumentError(f"{owner}: t must be a finite time, found {shown(t)}")
        return evaluator.one(time, state, free if free.size else self._inputs)  # type: ignore[no-any-return]

    def _ready(self, name: str) -> Any:
        evaluator = self.module.library(name).evaluator(name)
        evaluator.set_params(self.params)
        setattr(self._local, name, evaluator)
        return evaluator


def _restored(metadata: Mapping[str, Any], provider: Any, backend: str, fallback: str) -> Module:
    return Module(ModuleMetadata.of_plain(metadata), provider, backend, fallback, getattr(provider, "write", None),
                  getattr(provider, "report", None))


def _is_time(t: Any) -> bool:
    """Whether t is a finite double, or a whole number that a double holds."""
    return (type(t) in _TIMES and t - t == 0) or (type(t) is int and -_WHOLE <= t <= _WHOLE)


def demand_module(given: Any, who: str) -> None:
    """Raises ArgumentError for what is no Module; who: what needs one."""
    if not isinstance(given, Module):
        advice = "compile it: system.compile()" if hasattr(given, "compile") else "pass what system.compile() returns"
        raise ArgumentError(f"{who} needs a Module, found {shown(given, 80)}; {advice}")


def _mark(params: Any) -> Any:
    """Mark by which parameters changed in place are detected: their numbers, also those of objects that hold a number that may
    change."""
    if params is None:
        return None
    if type(params) is np.ndarray and not params.dtype.hasobject:
        return params.tobytes()
    if isinstance(params, Mapping):
        return tuple(params), [_number(value) for value in params.values()]
    return [_number(value) for value in params] if getattr(params, "ndim", 1) and hasattr(params, "__iter__") else _number(params)


def _number(value: Any) -> Any:
    """A value, or the number that it holds now, such as that of an array without dimensions."""
    if type(value) is float or type(value) is int or isinstance(value, (str, bytes, complex, np.complexfloating)):
        return value
    if isinstance(value, np.ndarray) and (np.ma.isMaskedArray(value) or value.dtype.kind not in "fiu"):
        return value
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):  # no number: what takes the parameters over reports it
        return value
