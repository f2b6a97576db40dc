"""Linearization: what a user gets of the linear equations about a state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symdyn.arguments import take
from symdyn.errors import ArgumentError, MissingExtra, SymdynError
from symdyn.pages import table, titled
from symdyn.runtime.consistent import NotConsistent, check_start, consistent, normalised, number
from symdyn.runtime.masses import real_parameters
from symdyn.shown import shown
from symdyn.statics.analysis import WORDS, Analysis, held_note
from symdyn.statics.contact_modes import demand_modes, with_modes
from symdyn.statics.contact_rest import Rest
from symdyn.statics.equilibrium import Equilibrium, given_inputs
from symdyn.statics.gimbal import demand_no_lock
from symdyn.statics.kinks import kink, no_linear_equations
from symdyn.statics.manifold import Manifold, in_motion
from symdyn.statics.modes import Modes
from symdyn.statics.selection import Selection, holding, listed, select
from symdyn.statics.sensitivity import Sensitivity, of_eigenvalue, shift
from symdyn.statics.singular import singular_configuration
from symdyn.statics.steady import Steadiness, steadiness
from symdyn.statics.terms import OperatingPoint, coordinate_names, rest

if TYPE_CHECKING:
    from control import StateSpace as ControlStateSpace
    from scipy.signal import StateSpace as ScipyStateSpace

    from symdyn.given import Key, Names, Times
    from symdyn.runtime.module import Module
    from symdyn.runtime.solutions.solution import Solution
    from symdyn.statics.modes import Mode
    from symdyn.statics.regulator import Regulator, Weights
    from symdyn.statics.response import Response
    from symdyn.statics.stability import Stability


class StateSpace(NamedTuple):
    """y' = C x' + D in', x'_dot = A x' + B in'."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray


class Linearization:
    """The linear equations about a state on the manifold of the constraints.

    x'_dot = A x' + B in',  y' = C_out x' + D in'   with x' = [eta; zeta; z']: changes of the independent displacements (n_d,),
    of the independent speeds (n_s,) and of the extra states. Velocity constraints bind speeds only: n_s is less than n_d then.
    A, B, C_out and D are the derivative of the flow on the manifold, at rest and along any motion. Where a motion (sd.motions)
    stands in constraints, what depends on the independent ones follows its value, rate and acceleration, which is in B and D, for
    changes of the three that belong together. The same by forces:
    M zeta_dot + C zeta + K eta + ... = F_in in'    M, C (n_s, n_s), K (n_s, n_d); where speeds are rates of coordinates and
    nothing but positions is constrained, eta_dot = zeta, and this is M eta_ddot + C eta_dot + K eta = F_in in'
    G   (n_d, n_d): eta_dot = ... - G eta; zero where speeds are rates of coordinates, and at rest
    Z   (n_u, n_d): v = Z eta of what moves along all speeds

    coordinates   names of eta: of coordinates, of speeds that are no rates (turning about that axis)
    states        names of x', each once: a displacement along a speed that is no rate is along_ and the speed's name;
                  outputs: names of y', entries of vectors by number; held: names of what is held

    >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0})
    >>> linear.states, linear.verdict
    (('q1', 'q1_dot'), 'neutral')
    >>> np.round(linear.A, 6) + 0.0
    array([[ 0.  ,  1.  ],
           [-9.81,  0.  ]])
    >>> np.round(linear.M, 6), np.round(linear.K, 6)
    (array([[1.]]), array([[9.81]]))
    """

    def __init__(self, manifold: Manifold, equilibrium: Equilibrium | None) -> None:
        self._manifold = manifold
        self._analysis = Analysis(manifold)
        self.equilibrium = equilibrium
        point = manifold.point
        self.module = point.module
        self.t, self.x, self.params, self.inputs = point.t, point.x, point.p, point.inputs
        self.ud, self.lam = point.ud, point.lam
        self.M, self.C, self.K, self.G = manifold.M, manifold.C, manifold.K, manifold.G
        self.F_in, self.Z = manifold.F_in, manifold.Z_v
        self.coordinates = manifold.labels
        speeds = self.module.metadata.u
        displaced = [f"along_{n}" if n == speeds[k] else n for n, k in zip(manifold.labels, manifold.displacements, strict=True)]
        self.states = (*displaced, *manifold.speed_labels, *manifold.state_labels)
        self.held = manifold.selection.held

    @cached_property
    def state_space(self) -> StateSpace:
        """(A, B, C, D); C and D have no rows without outputs.

        Raises ArgumentError where the constraints do not let the mechanism follow changes of a motion (sd.motions).

        >>> linear = sd.systems.cart_pole().compile(backend="numpy").linearize({"q2": 0.0})
        >>> A, B, C, D = linear.state_space
        >>> A.shape, B.shape, C.shape, D.shape
        ((4, 4), (4, 1), (0, 4), (0, 1))
        """
        self._manifold.demand_followed()
        return StateSpace(*self._manifold.matrices, *self._manifold.output_matrices())

    def _repr_html_(self) -> str:
        """A with the names of its rows and columns, as a notebook shows it."""
        rows = [(f"d/dt {name}", *(f"{value + 0.0:.4g}" for value in row)) for name, row in zip(self.states, self.A, strict=True)]
        return titled(self, table(("A", *self.states), rows))

    def tangent(self) -> np.ndarray:
        """x' of the whole state = T [eta; zeta; z'], (n_x, m), with the inputs as they are.

        >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0})
        >>> linear.tangent()
        array([[1., 0.],
               [0., 1.]])
        """
        return self._manifold.tangent()

    @property
    def A(self) -> np.ndarray:
        """The matrix of the states, (m, m).

        >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0})
        >>> np.round(linear.A, 6) + 0.0
        array([[ 0.  ,  1.  ],
               [-9.81,  0.  ]])
        """
        return self._manifold.matrices[0]

    @property
    def B(self) -> np.ndarray:
        """The matrix of the inputs, (m, n_in); errors as for `state_space`.

        >>> linear = sd.systems.cart_pole().compile(backend="numpy").linearize({"q2": np.pi})
        >>> np.round(linear.B.T, 6) + 0.0
        array([[ 0.      ,  0.      ,  0.97561 , -1.463415]])
        """
        return self.state_space.B

    @property
    def C_out(self) -> np.ndarray:
        """The outputs by the states, (n_y, m); errors as for `state_space`.

        >>> system = sd.systems.pendulum()
        >>> system.add_output("tip", sd.position("bob", [0, -1]))
        >>> linear = system.compile(backend="numpy").linearize({"q1": 0.0})
        >>> np.round(linear.C_out, 6) + 0.0
        array([[1., 0.],
               [0., 0.]])
        """
        return self.state_space.C

    @property
    def D(self) -> np.ndarray:
        """The outputs by the inputs, (n_y, n_in); errors as for `state_space`.

        >>> system = sd.systems.cart_pole()
        >>> system.add_output("pushed", 3 * sd.inputs("F"))
        >>> system.compile(backend="numpy").linearize({"q2": np.pi}).D
        array([[3.]])
        """
        return self.state_space.D

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the rows of C_out and D.

        >>> system = sd.systems.pendulum()
        >>> system.add_output("tip", sd.position("bob", [0, -1]))
        >>> system.compile(backend="numpy").linearize({"q1": 0.0}).outputs
        ('tip[0]', 'tip[1]')
        """
        names: list[str] = []
        for name, shape in self.module.metadata.outputs:
            names += [name + (f"[{', '.join(map(str, index))}]" if index else "") for index in np.ndindex(*shape)]
        return tuple(names)

    @cached_property
    def units(self) -> Mapping[str, str]:
        """Units of the states, inputs and outputs by name; an entry of A has that of its row, by its column and a second.

        >>> linear = sd.systems.cart_pole().compile(backend="numpy").linearize({"q2": 0.0})
        >>> dict(linear.units)
        {'q1_dot': 'm/s', 'q2_dot': 'rad/s', 'F': 'N', 'q1': 'm', 'q2': 'rad'}
        """
        known = self.module.metadata.units
        displaced = {name: known.get(name, known.get(self.module.metadata.u[k], "").removesuffix("/s") or "")
                     for name, k in zip(self.states, self._manifold.displacements, strict=False)}
        others = {n: known.get(n, "") for n in (*self.states[len(self.coordinates):], *self.module.metadata.inputs)}
        points = self.module.metadata.output_units
        return {**others, **displaced, **{n: points.get(n.partition("[")[0], "") for n in self.outputs}}

    @cached_property
    def steadiness(self) -> Steadiness:
        """Test of whether these equations are constant along the motion: kind "rest" or "steady motion", or "" and the reason.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.linearize({"q1": 0.0}).steadiness.kind, module.linearize({"q1": 0.5}).steadiness.kind
        ('rest', '')
        """
        return steadiness(self._manifold)

    def _demand_steady(self, what: str) -> None:
        """Raises ArgumentError where eigenvalues decide nothing."""
        singular = singular_configuration(self._manifold.point, self._manifold.selection)
        if singular:
            raise ArgumentError(f"{self.module.name}: {what} requested at a {singular}; move the mechanism away from it")
        demand_no_lock(self._manifold.point, what)
        if not self.steadiness.kind:
            raise ArgumentError(f"{self.module.name}: {what} requested at a state that is neither at rest nor in steady motion: "
                                f"{self.steadiness.reason}. Eigenvalues decide nothing there; linearize at an equilibrium, or "
                                "use module.stability(...), which follows a periodic motion")

    @cached_property
    def eigenvalues(self) -> np.ndarray:
        """Those of A, by size, (m,) complex, 1/s. Raises ArgumentError where A is not constant along the motion.

        >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0})
        >>> sorted(np.round(linear.eigenvalues.imag, 6).tolist())
        [-3.132092, 3.132092]
        """
        self._demand_steady("eigenvalues were")
        return self._analysis.eigenvalues

    @cached_property
    def _modes(self) -> Modes:
        self._demand_steady("modes were")
        return self._analysis.modes(f"{self.module.name}: modes")

    @property
    def verdict(self) -> str:
        """"stable", "neutral", "drifts", "unstable" or "not decided", by the eigenvalues; "" if nothing is free to move.

        Raises ArgumentError where A is not constant along the motion.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.linearize({"q1": 0.0}).verdict, module.linearize({"q1": np.pi}).verdict
        ('neutral', 'unstable')
        """
        self._demand_steady("a verdict was")
        return self._analysis.verdict

    def stability(self) -> Stability:
        """The verdict with its evidence, also where A is not constant along the motion; see Module.stability.

        >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": np.pi})
        >>> linear.stability().verdict
        'unstable'
        """
        from symdyn.statics.stability import of_manifold

        return of_manifold(self._manifold)

    @property
    def inertia(self) -> np.ndarray:
        """The mass matrix that compares shapes of modes, (n_u, n_u).

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.linearize({"q1": 0.0}, params={"m": 2.0, "l": 3.0}).inertia
        array([[18.]])
        """
        return self._manifold.inertia

    def modes(self) -> Modes:
        """Natural frequencies, damping ratios, periods, shapes; prints as a table. See symdyn.statics.modes.

        Raises ArgumentError where A is not constant along the motion.

        >>> modes = sd.systems.double_pendulum().compile(backend="numpy").linearize({"q1": -np.pi / 2, "q2": 0.0}).modes()
        >>> np.round(modes.frequencies, 6)
        array([0.426553, 1.144113])
        """
        return self._modes

    def mode_motion(self, mode: int | str | Mode, amplitude: float | None = None, periods: int = 1) -> Solution:
        """The mechanism moving in the shape of a mode, to look at: a Solution, with view(), animate() and plot().

        mode        one of modes(), its number, or its name
        amplitude   largest change of a coordinate; by default so that it is well seen
        periods     how many of an oscillation, which is shown without its decay; of a real mode three time constants are shown

        Closed loops stay closed. It is no solution of the nonlinear equations. Raises ArgumentError for a mode that has the
        eigenvalue zero, and for an amplitude that the mechanism cannot reach.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> motion = module.linearize({"q1": 0.0}).mode_motion(0, amplitude=0.3)
        >>> f"{motion.t[-1]:.6f} s, {motion['q1'].max():.6f} rad"
        '2.006067 s, 0.300000 rad'
        """
        from symdyn.statics.swing import mode_motion

        return mode_motion(self, mode, amplitude, periods)

    def response(self, omega: Times | None = None, inputs: Names | None = None, outputs: Names | None = None) -> Response:
        """The harmonic response H(i omega) = C (i omega - A)^-1 B + D; its `plot` is the Bode diagram.

        omega             frequencies, rad/s; by default from a tenth of the slowest eigenvalue to ten times the fastest
        inputs, outputs   by name, all by default; states are the outputs of a system that has none

        It is infinite at the frequency of an undamped mode. Raises ArgumentError for a system without inputs, for frequencies
        that are not positive, and where A is not constant along the motion.

        >>> linear = sd.systems.cart_pole().compile(backend="numpy").linearize({"q2": 3.141592653589793})
        >>> linear.response([1.0, 10.0], outputs="q1").gain.shape
        (2, 1, 1)
        """
        from symdyn.statics.response import response

        self._demand_steady("a response was")
        return response(self, omega, inputs, outputs)

    # -- control

    def lqr(self, Q: Weights, R: Weights) -> Regulator:
        """The gain K of in' = -K x' with the least integral of x'^T Q x' + in'^T R in' from any start.

        Q   weights of the states x' (see `states`): a matrix (m, m), its diagonal (m,), or numbers by name or symbol, 0 where
            left out; symmetric and positive semidefinite
        R   weights of the inputs, (k, k), (k,), symmetric and positive definite; by name or symbol those that have one are
            driven, the others are disturbances and stay as they are. In order: of all inputs but motions (sd.motions)
        Under constraints, and with held coordinates, the states are the independent ones that the linearization has. The result
        is also the function of (t, x) that applies the gain to the mechanism: inputs=linear.lqr(Q, R), or
        inputs=sd.Sampled(linear.lqr(Q, R), period=0.01); with other inputs that are given by name, inputs={F: regulator[F], ...}.

        Raises ArgumentError for weights that are not definite, with the direction; where the equations are not stabilizable, with
        the mode that no input reaches; where Q gives no weight to a mode that neither decays nor grows; and where A is not
        constant along the motion. See symdyn.statics.regulator.Regulator, also for the source.

        >>> linear = sd.systems.cart_pole().compile(backend="numpy").linearize({"q2": np.pi})
        >>> regulator = linear.lqr(Q={"q1": 1.0, "q2": 10.0}, R={"F": 0.1})
        >>> np.round(regulator.K, 4)
        array([[ 3.1623, -7.7996,  3.462 , -1.3718]])
        """
        from symdyn.statics.regulator import lqr

        self._demand_steady("a regulator was")
        return lqr(self, Q, R)

    def deviation(self, t: float, x: Sequence[float] | np.ndarray) -> np.ndarray:
        """x' (m,), how far a state x = [q; u; z] of the mechanism (in order, or by name or symbol) is from the motion linearized
        about, at the time t: of independent displacements, independent speeds and free extra states, to first order.

        At rest the motion is the state itself; along steady motion coordinates go on at constant rates. Raises ArgumentError
        where they do not (a wheel that rolls in a circle).

        >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0})
        >>> linear.deviation(0.0, {"q1": 0.1, "q1_dot": -0.2})
        array([ 0.1, -0.2])
        """
        point, manifold = self._manifold.point, self._manifold
        metadata = self.module.metadata
        state = take(x, metadata.x, "x", metadata.initial_values("x"), self.module.name)
        n_q, n_u, *_ = point.sizes
        rates = point.balance[point.parts["q_dot"]]
        if rates.any():
            bent = point.balance[point.parts["q_ddot"]]
            k = int(np.argmax(np.abs(bent)))
            if abs(bent[k]) > 1e-9 * float(np.abs(rates).max()) * max(1.0, float(np.abs(rates).max())):
                raise ArgumentError(f"{self.module.name}: the motion linearized about is no straight one: {metadata.q[k]} "
                                    f"accelerates by {bent[k]:.4g} a second; apply the gain K to changes of your own")
        off = state - point.x
        off[:n_q] -= rates * (t - self.t)
        v = np.linalg.lstsq(point.N, off[:n_q], rcond=None)[0]
        return np.concatenate([v[manifold.displacements], off[n_q:n_q + n_u][manifold.speeds], off[n_q + n_u:][manifold.states]])

    def to_scipy(self) -> ScipyStateSpace:
        """The equations as a scipy.signal.StateSpace, with the states as its outputs where the system has no outputs.

        >>> linear = sd.systems.cart_pole().compile(backend="numpy").linearize({"q2": 0.0})
        >>> linear.to_scipy().A.shape
        (4, 4)
        """
        from scipy.signal import StateSpace

        return StateSpace(self.A, self.B, *self.observed()[:2])

    def to_control(self) -> ControlStateSpace:
        """The equations as a control.StateSpace of python-control, with names of states, inputs and outputs; with the states as
        its outputs where the system has no outputs. Raises MissingExtra where python-control is not installed.

        >>> linear = sd.systems.cart_pole().compile(backend="numpy").linearize({"q2": 0.0})
        >>> linear.to_control().state_labels
        ['q1', 'q2', 'q1_dot', 'q2_dot']
        """
        try:
            import control
        except ImportError:
            raise MissingExtra("linear.to_control() needs the package control: pip install 'symdyn[control]'") from None
        C, D, outputs = self.observed()
        return control.ss(self.A, self.B, C, D, states=list(self.states), inputs=list(self.module.metadata.inputs),
                          outputs=list(outputs), name=self.module.name)

    def observed(self) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
        """C, D and names of the outputs, or of the states without outputs.

        >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0})
        >>> C, D, names = linear.observed()
        >>> C, names
        (array([[1., 0.],
               [0., 1.]]), ('y_q1', 'y_q1_dot'))
        """
        if self.outputs:
            return self.C_out, self.D, self.outputs
        return np.eye(len(self.states)), np.zeros(self.B.shape), tuple(f"y_{n}" for n in self.states)

    def derivative(self, mode: int | Mode, parameter: Key) -> Sensitivity:
        """Exact derivatives of a mode's eigenvalue, frequency and damping by a parameter.

        mode        number or name in `modes()`; parameter: name or symbol
        About an Equilibrium its shift with the parameter counts, and that of what was solved for; at another state the state
        stays. Raises ArgumentError for double eigenvalues, and where what this needs is not constant: turning Euler parameters,
        motion under constraints, part of an orientation that is kept.

        >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0}, params={"l": 1.0})
        >>> by_length = linear.derivative(0, "l")
        >>> round(float(by_length.frequency), 6), round(float(-np.sqrt(9.81) / (4 * np.pi)), 6)
        (-0.249244, -0.249244)
        """
        manifold = self._manifold
        point, selection = manifold.point, manifold.selection
        owner = self.module.name
        named = listed(parameter, self.module.metadata.parameters, "parameter", owner)
        if len(named) != 1:
            raise ArgumentError(f"{owner}: parameter must be one name or symbol, found {shown(parameter)}")
        (name,) = named
        if not self.steadiness.kind or self.G.any():
            raise ArgumentError(f"{owner}: derivatives of eigenvalues hold at a state of rest or of steady motion; linearize at "
                                "an equilibrium")
        rows = manifold.held.positions
        if (np.count_nonzero(rows, axis=1) > 1).any() and not _fixed_space(rows):
            raise ArgumentError(f"{owner}: derivatives of eigenvalues with a part of an orientation kept are not available; fix "
                                "all of its coordinates, or none")
        if not all(self.module.metadata.holonomic or [True]):
            raise ArgumentError(f"{owner}: derivatives of eigenvalues are not available with constraints of velocities")
        if manifold.Z_u is not manifold.Z_v or manifold.W.any():
            raise ArgumentError(f"{owner}: derivatives of eigenvalues along a motion under constraints are not available; they "
                                "hold at a state of rest")
        changes = {name: 1.0}
        if self.equilibrium is not None:
            changes |= shift(point, selection, name)
        return of_eigenvalue(manifold, self._analysis.spectrum, self.modes()[mode], changes)

    def _labelled_states(self) -> tuple[str, ...]:
        """Names of x' with units."""
        return tuple(f"{name} [{self.units.get(name) or '1'}]" for name in self.states)

    def __repr__(self) -> str:
        about = "an equilibrium" if self.equilibrium is not None else "a state"
        held = f", held: {', '.join(self.held)}" if self.held else ""
        return f"<Linearization of {self.module.name} about {about}: {', '.join(self.coordinates)}{held}; {self._judgement()}>"

    def _judgement(self) -> str:
        """The verdict, or why there is none, in words; raises nothing."""
        try:
            return self.verdict or WORDS[""]
        except (SymdynError, np.linalg.LinAlgError) as error:
            return f"no verdict: {str(error).removeprefix(f'{self.module.name}: ')}"

    def describe(self) -> str:
        """A, B, C_out and D with names and units of rows and columns, what is held, and what the eigenvalues say, as tables.

        >>> linear = sd.systems.pendulum().compile(backend="numpy").linearize({"q1": 0.0})
        >>> for line in linear.describe().splitlines()[1:4]:
        ...     print(line)
        ...
        A                  q1 [rad]  q1_dot [rad/s]
        q1 [rad]                  0               1
        q1_dot [rad/s]        -9.81               0
        """
        inputs = tuple(self.module.metadata.inputs)
        lines = [f"{self.module.name}: linear equations, {len(self.states)} states, {len(inputs)} inputs; an entry of A and B "
                 "has the unit of its row by that of its column and s, of C_out and D by that of its column"]
        states = self._labelled_states()
        others = [(f"{n} [{self.units.get(n) or '1'}]" for n in names) for names in (inputs, self.outputs)]
        ins, outs = (tuple(each) for each in others)
        A = np.where(np.abs(self.A) <= self._analysis.noise.A.rounding, 0.0, self.A)
        lines += _table("A", A, states, states)
        try:
            _, B, C_out, D = self.state_space
            lines += [*_table("B", B, states, ins), *_table("C_out", C_out, outs, states), *_table("D", D, outs, ins)]
        except ArgumentError as error:  # no linear equations by the inputs
            lines.append(str(error).removeprefix(f"{self.module.name}: "))
        lines += held_note(self._manifold)
        singular = singular_configuration(self._manifold.point, self._manifold.selection)
        if singular:
            return "\n".join([*lines, singular])
        if self.steadiness.kind:
            verdict = f"{self._analysis.verdict}, " if self._analysis.verdict else ""
            return "\n".join([*lines, f"{self.steadiness.kind}: {verdict}{self._analysis.reason()}"])
        return "\n".join([*lines, f"no state of rest or of steady motion: {self.steadiness.reason}"])


def _table(name: str, matrix: np.ndarray, rows: Sequence[str], columns: Sequence[str]) -> list[str]:
    """A matrix with labels of rows and columns; nothing where it has no entries."""
    if not matrix.size:
        return []
    width, widths = max(map(len, rows)), [max(11, len(label)) for label in columns]
    lines = [f"{name:<{width}}  " + "  ".join(f"{label:>{w}}" for label, w in zip(columns, widths, strict=True))]
    for row, values in zip(rows, matrix + 0.0, strict=True):
        numbers = "  ".join(f"{value:>{w}.5g}" for value, w in zip(values, widths, strict=True))
        lines.append(f"{row:<{width}}  {numbers}")
    return lines


def linearize(module: Module, at: Any = None, params: Any = None, t: float | None = None, inputs: Any = None, free: Any = None,
              fixed: Any = None, coordinates: Sequence[Any] | None = None, hold: Any = None,
              contacts: Any = None) -> Linearization:
    """See Module.linearize."""
    if isinstance(at, Rest):
        if any(v is not None for v in (params, t, inputs, contacts)) or at.module is not module:
            raise ArgumentError(f"{module.name}: a state of rest on contacts has its own parameters, time, inputs and modes, and "
                                "belongs to one module; leave them out, or pass at=rest.x")
        at, params, t, inputs = at.x, at.params, at.t, at.inputs
    if isinstance(at, Equilibrium):
        passed = [n for n, v in (("params", params), ("t", t), ("inputs", inputs), ("free", free), ("fixed", fixed))
                 if v is not None]
        if passed:
            raise ArgumentError(f"{module.name}: {', '.join(passed)} given with an equilibrium, which has its own; leave them "
                                "out, or pass at=equilibrium.x")
        if at.module is not module:
            raise ArgumentError(f"{module.name}: the equilibrium is of {at.module.name}, another module; linearize with its own")
        selection = holding(at.selection, hold)
        point = at.point if hold is None else in_motion(at.point, selection)
        _demand_smooth(point, selection)
        return Linearization(Manifold(point, selection, _independent(module, coordinates)), at)
    point, selection = state_of(module, at, params, t, inputs, free, fixed, hold, contacts=contacts)
    if contacts is None:
        demand_modes(module, point.t, point.x, point.p, point.inputs)
    _demand_smooth(point, selection)
    return Linearization(Manifold(point, selection, _independent(module, coordinates)), None)


def _demand_smooth(point: OperatingPoint, selection: Selection) -> None:
    """Raises ArgumentError where the equations have a kink or a jump at the state."""
    name = kink(point, selection)
    if name:
        raise ArgumentError(f"{point.module.name}: linear equations were requested, but {no_linear_equations(name)}")


def state_of(module: Module, at: Any, params: Any, t: float | None, inputs: Any, free: Any, fixed: Any,
             hold: Any, guess: bool = False, contacts: Any = None) -> tuple[OperatingPoint, Selection]:
    """A state with its accelerations, and what is held there. Raises ArgumentError for one that violates the constraints.

    guess   the state may be moved onto the constraints; contacts: modes of rigid ones
    """
    point = _place(module, at, params, t, inputs)
    if contacts is not None:
        point = point.at(p=with_modes(module, contacts, point.t, point.x, point.p, point.inputs))
    selection = holding(select(module, free, fixed, None), hold)
    x = selection.apply(point.x)
    if guess and point.sizes[3]:
        kept = [n for n in selection.values if n in module.metadata.q or n in module.metadata.u]
        n_q, n_u, *_ = point.sizes
        q, u = consistent(point.bound, x[:n_q], x[n_q:n_q + n_u], point.p, point.t, kept)
        x = np.concatenate([q, u, x[len(q) + len(u):]])
    try:
        check_start(point.bound, point.t, x, point.p)
    except NotConsistent as error:
        result = error.found.replace("the initial positions", "the positions").replace("the initial speeds", "the speeds")
        raise ArgumentError(f"{result}; linear equations exist at states that fulfil the constraints: take "
                            "q, u = module.consistent(q, u, params), and pass (q, u)") from None
    return in_motion(point.at(x=x), selection), selection


def _independent(module: Module, coordinates: Sequence[Any] | None) -> list[int] | tuple[list[int], list[int]] | None:
    """Indices of independent displacements; where rates are named, too, of independent displacements and speeds."""
    if coordinates is None:
        return None
    labels, speeds = list(coordinate_names(module.metadata)), list(module.metadata.u)
    names = listed(coordinates, [*labels, *speeds], "coordinates", module.name)
    displaced = [labels.index(n) for n in names if n in labels]
    rates = [speeds.index(n) for n in names if n not in labels]
    return (displaced, rates) if displaced and rates else displaced or rates


def _place(module: Module, at: Any, params: Any, t: float | None, inputs: Any) -> OperatingPoint:
    """The state that `at` stands for; without accelerations."""
    metadata = module.metadata
    if hasattr(at, "t") and hasattr(at, "x") and np.ndim(at.t) == 1:
        return _of_solution(module, at, params, t, inputs)
    time = 0.0 if t is None else number(t, "a finite number of seconds as t", module.name)
    if at is None:
        at = {}
    if isinstance(at, tuple) and len(at) == 2 and np.ndim(at[0]) == 1:
        at = np.concatenate([take(at[0], metadata.q, "q", {}, module.name), take(at[1], metadata.u, "u", {}, module.name),
                             list(metadata.initial_values("z").values())])
    x = take(at, metadata.x, "at", metadata.initial_values("x"), module.name)
    free = given_inputs(module, inputs)
    return rest(module, time, normalised(module, x), real_parameters(module, params), free)


def _of_solution(module: Module, at: Any, params: Any, t: float | None, inputs: Any) -> OperatingPoint:
    if t is None or params is not None or inputs is not None:
        raise ArgumentError(f"{module.name}: at a solution pass the time t alone; parameters and inputs are those of the motion")
    time = number(t, "a finite number of seconds as t", module.name)
    if not len(at.t) or not at.t[0] <= time <= at.t[-1]:
        raise ArgumentError(f"{module.name}: t = {time:g} s is not in the solution, from {at.t[0]:g} to {at.t[-1]:g} s")
    k = int(np.argmin(np.abs(at.t - time)))
    return rest(module, float(at.t[k]), at.x[k].copy(), module.parameters(at.params), np.asarray(at.inputs[k], dtype=float))


def _fixed_space(rows: np.ndarray) -> bool:
    """Whether what the rows keep is the same at every state: certain speeds as a whole."""
    used = rows.any(axis=0)
    return bool(np.linalg.matrix_rank(rows) == int(used.sum()))
