"""Solution: a computed motion; time first. Energy and outputs are evaluated when requested."""

from __future__ import annotations

import contextlib
import csv
import difflib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.arguments import fixed
from symdyn.backend.metadata import Sizes
from symdyn.counting import counted
from symdyn.errors import ArgumentError, EvaluationError
from symdyn.pages import table, titled
from symdyn.runtime.constraints import names, position_residual, rank, unique, velocity_residual
from symdyn.runtime.inputs.inputs import Inputs
from symdyn.runtime.inputs.sampled import SampleRows
from symdyn.runtime.integrating.events import EventRows, rows_of
from symdyn.runtime.integrating.outcome import Outcome, Stepped
from symdyn.runtime.paths import as_path, writing
from symdyn.runtime.solutions import frames
from symdyn.runtime.solutions.contacts import ContactMotion, GroupMotion, contact_motions, group_motions
from symdyn.runtime.solutions.energy_balance import friction_energy, reset_energy
from symdyn.runtime.solutions.reactions import in_frame, reactions, unique_reactions
from symdyn.runtime.solutions.sensitivity import Sensitivity
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    import pandas
    import sympy as sp
    import xarray
    from matplotlib.animation import FuncAnimation
    from matplotlib.figure import Figure

    from symdyn.given import BodyOrName, JointOrName, PathName, Times
    from symdyn.optimal import Tracking
    from symdyn.runtime.integrating.sensitivities import Asked
    from symdyn.runtime.module import Module
    from symdyn.statics.regulator import Weights
    from symdyn.viewer import View

# With kinetic energy and changes of potential energy below this part of it, a mechanism rests: both are rounding errors.
REST = 1e-10

# Functions that take what contacts do at an instant.
OF_FORCES = ("rhs", "reactions", "lam", "cut_loads", "contacts")


class Solution:
    """A motion.

    t (n_t,), x (n_t, n_x), q (n_t, n_q), u (n_t, n_u), z (n_t, n_z); y is x transposed, as SciPy has it
    success, message    whether the end was reached, and if not when, where and why
    doubts   sentences that were warned of in a run that went on, such as zeros of events that may be missed
    cause    the exception by which a function of the user ended the motion, with its traceback; else None
    n_steps, n_rejected, nfev   of the integrator; njev, nlu: Jacobians and factorizations of implicit methods
    seconds, integrator_seconds   wall time of the call, and inside compiled code
    tolerances    relative, and the largest absolute one, if they are known
    method, why   of integration, and why it was chosen, if it was (method="auto")
    events    name -> times t (n,) and states just before x (n, n_x) of the system's events
    corrections   of projections onto the constraints: the largest of position and speed, how many, how much work

    >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
    >>> solution.t.shape, solution.x[-1].round(6), solution.success
    ((1001,), array([-1.491035, -3.118983]), True)
    """

    def __init__(self, module: Module, outcome: Outcome, params: np.ndarray, inputs: Inputs, method: str,
                 seconds: float, work: bool = False, tolerances: tuple[float, float] | None = None, why: str = "",
                 repeat: Callable[[np.ndarray], np.ndarray] | None = None, asked: Asked | None = None,
                 factors: Callable[[], str] = str) -> None:
        self.module = module
        self._repeat, self._factors = repeat, factors
        self.t = outcome.t
        self.x = outcome.x[:, :module.metadata.sizes.x]
        self._columns = outcome.x[:, module.metadata.sizes.x:] if asked is not None and asked.columns else None
        self._asked = asked
        self._work = outcome.x[:, -1] if work else None
        self.success, self.message, self.cause = outcome.success, outcome.message, outcome.cause
        self.doubts = (*outcome.warned, *outcome.doubts)
        self.n_steps, self.n_rejected, self.nfev = outcome.n_steps, outcome.n_rejected, outcome.n_evaluations
        self.njev, self.nlu = outcome.n_jacobians, outcome.n_factorizations
        self.integrator_seconds = outcome.seconds
        self.seconds = seconds
        self.params, self.method, self.backend, self.why = fixed(params), method, module.backend, why
        self.corrections, self.tolerances = outcome.corrections, tolerances
        self._inputs = inputs
        # A function of the user may depend on what changes after the run, such as the variable of a loop: it is called here.
        self._input_rows = np.broadcast_to(inputs.rows(self.t, self.x), (len(self.t), len(inputs.constant)))
        self.events: dict[str, EventRows] = rows_of(module, outcome.happened, module.metadata.sizes.x)
        self._happened = list(outcome.happened)
        self._phases, self._impacts = outcome.phases, outcome.impacts
        self._row_phases = outcome.row_phases
        self._stepped = outcome.stepped
        self._n_c = len(names(module))

    def __call__(self, t: Times) -> np.ndarray:
        """States at any times of the motion, (n_x,) for a time, (..., n_x) for an array of times in any order, s.

        The motion is integrated once more, by the same steps, with these as its output times: the states are as exact as those at
        the output times of the run, and rows of the solution are met to the last bit. Pass all times at once: every call takes as
        long as the run. At the time of an event the state is that before it, as in the run.
        Raises ArgumentError for times outside of the motion and for motions that were not integrated by `simulate`.
        """
        return self._at(t)[..., :self._sizes.x]

    def _at(self, t: Times) -> np.ndarray:
        """All that was integrated at any times, see above."""
        if self._repeat is None:
            raise ArgumentError(f"{self.module.name}: states at any time need a motion that simulate has integrated; this one "
                                f"holds {len(self.t)} times, in sol.t")
        try:
            asked = np.asarray(t, dtype=float)
        except (TypeError, ValueError):
            raise ArgumentError(f"{self.module.name}: t must be a time or an array of times, found {t!r}") from None
        first, last = float(self.t.min(initial=np.inf)), float(self.t.max(initial=-np.inf))
        outside = asked[~((asked >= first) & (asked <= last))]
        if outside.size:
            if len(self.t) == 0:
                raise ArgumentError(f"{self.module.name}: the motion holds no time at all: {self.message}")
            raise ArgumentError(f"{self.module.name}: the motion goes from t = {self.t[0]:.9g} s to t = {self.t[-1]:.9g} s, but "
                                f"its state was asked for at t = {outside.flat[0]:.9g} s")
        times, indices = np.unique(asked, return_inverse=True)
        result = self._repeat(times)
        return result[indices.reshape(asked.shape)]

    def __getitem__(self, name: sp.Symbol | str) -> np.ndarray:
        """One coordinate, speed, extra state, input or output over time, by name or symbol, (n_t, ...); "lam" for all
        multipliers, the name of a constraint, with or without lam_ before it, for its multiplier.

        Raises ArgumentError for an unknown name.
        """
        name = name_of(name)
        metadata = self.module.metadata
        if name in metadata.x:
            return self.x[:, metadata.x.index(name)]
        if name in metadata.inputs:
            return self.inputs[:, metadata.inputs.index(name)]
        if name in self.outputs:
            return self.outputs[name]
        constraints = names(self.module)
        if self._n_c and name == "lam":
            return self.lam
        if name in constraints or name.removeprefix("lam_") in constraints:
            return self.lam[:, constraints.index(name if name in constraints else name.removeprefix("lam_"))]
        known = [*metadata.x, *metadata.inputs, *self.outputs, *(["lam", *constraints] if self._n_c else ())]
        near = difflib.get_close_matches(name, known, 3)
        raise ArgumentError(f"{self.module.name}: the solution has no {shown(name)}; "
                            + (f"did you mean {' or '.join(near)}?" if near else f"it has {', '.join(known)}"))

    @cached_property
    def factors(self) -> str:
        """Factorization of the matrices of an implicit method: "banded: ...", "dense: ...", or "sparse: ..." by SciPy, with the
        sizes; "" for other methods.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.simulate((0, 1), method="Radau").factors
        'dense: 2 states'
        """
        return self._factors()

    @property
    def y(self) -> np.ndarray:
        """States (n_x, n_t), as in SciPy.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.y.shape
        (2, 1001)
        """
        return self.x.T

    @property
    def status(self) -> int:
        """0: reached the end, -1: stopped early, as in SciPy.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.status
        0
        """
        return 0 if self.success else -1

    @property
    def q(self) -> np.ndarray:
        """Coordinates (n_t, n_q).

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.q[0]
        array([2.])
        """
        return self.x[:, :self._sizes.q]

    @property
    def u(self) -> np.ndarray:
        """Speeds (n_t, n_u).

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.u[0]
        array([0.])
        """
        return self.x[:, self._sizes.q:self._sizes.q + self._sizes.u]

    @property
    def z(self) -> np.ndarray:
        """Extra states (n_t, n_z).

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.z.shape
        (1001, 0)
        """
        return self.x[:, self._sizes.q + self._sizes.u:]

    @cached_property
    def energy(self) -> np.ndarray:
        """Kinetic plus potential energy, (n_t,), J.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.energy[:2].round(6)
        array([4.0824, 4.0824])
        """
        return self.energies.sum(axis=1)

    @cached_property
    def energies(self) -> np.ndarray:
        """Kinetic and potential energy, (n_t, 2), J. Raises ArgumentError for equations by hand, which do not define it.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.energies[0].round(6)
        array([0.    , 4.0824])
        """
        if "energy" not in self.module.functions:
            raise ArgumentError(f"{self.module.name}: its equations were given by hand and do not define the energy; compute it "
                                "from sol.q and sol.u, or describe the mechanism by bodies and joints")
        return self._rows("energy")

    def energy_at(self, t: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Kinetic plus potential energy at times (n,) and states (n, n_x), with the motion's parameters and inputs, (n,), J.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.energy_at(solution.t[:2], solution.x[:2]).round(6)
        array([4.0824, 4.0824])
        """
        rows = self.module.evaluate("energy", t, x, self.params, self._inputs.rows(t, x))
        return np.array(rows.reshape(len(t), -1).sum(axis=1))

    @cached_property
    def reset_energy(self) -> dict[str, np.ndarray]:
        """Energy that resets of events have added since the start, (n_t,), J, by the event's name, "a + b" for events at one
        time; negative where it is lost, as in impacts. Empty without such events.

        Raises ArgumentError for equations by hand, as `energies` does.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.reset_energy
        {}
        """
        return reset_energy(self, self._happened) if len(self.energies) else {}

    @cached_property
    def contacts(self) -> Mapping[str, ContactMotion]:
        """Course of contacts: name -> mode, gap, force, slip and impulse over time, impacts, see ContactMotion.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> dict(solution.contacts)
        {}
        """
        return contact_motions(self, self._phases, self._row_phases, self._impacts, self._stepped)

    @cached_property
    def contact_groups(self) -> Mapping[str, GroupMotion]:
        """Course of groups of contacts: name -> pairs that were near, with mode, gap and forces over time, see GroupMotion.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> dict(solution.contact_groups)
        {}
        """
        return {} if self._stepped is None else group_motions(self, self._stepped)

    @property
    def stepped(self) -> Stepped | None:
        """Steps of a motion by method="moreau", residuals of the laws of contact (residual, m/s; depth, m), and the
        estimate of its error, see Stepped; None for other motions.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.stepped is None
        True
        """
        return self._stepped

    @property
    def energy_balance(self) -> dict[str, np.ndarray]:
        """Parts of the energy balance since the start, each (n_t,), J: "change" of kinetic and potential energy; "work" of the
        loads, without that of dry friction of rigid contacts, which is "friction of NAME"; "reset of NAME" for every event that
        reset the state, see `reset_energy`; "impact of NAME" for every rigid contact; by method="moreau" "contact NAME" with its
        friction; "error", the change less all others.

        Raises ArgumentError as `work` does.

        >>> solution = sd.systems.cart_pole().compile(backend="numpy").simulate((0, 1), inputs={"F": 1.0}, work=True)
        >>> sorted(solution.energy_balance)
        ['change', 'error', 'work']
        """
        change = self.energy - self.energy[0]
        touching = {f"{contact.name}_closes" for contact in self.module.metadata.contacts}
        friction = friction_energy(self) if self._stepped is None else {}
        parts = {"work": self.work - sum(friction.values()), **friction}
        touched = {f"{contact.name}_{what}" for contact in self.module.metadata.compliant for what in ("touches", "releases")}
        for name, rows in self.reset_energy.items():
            if touched.issuperset(name.split(" + ")):  # resets that change nothing
                continue
            parts[f"impact of {name.removesuffix('_closes')}" if name in touching else f"reset of {name}"] = rows
        if self._stepped is not None:
            metadata = self.module.metadata
            names = [*(contact.name for contact in metadata.contacts), *(group.name for group in metadata.contact_groups)]
            parts |= {f"contact {name}": -rows for name, rows in zip(names, self._stepped.losses.T, strict=False)}
        return {"change": change, **parts, "error": change - sum(parts.values())}

    @property
    def work(self) -> np.ndarray:
        """Work of all loads but gravity and springs since the start, (n_t,), J.

        Raises ArgumentError if the simulation was not asked for it and there are such loads.

        >>> solution = sd.systems.cart_pole().compile(backend="numpy").simulate((0, 1), inputs={"F": 1.0}, work=True)
        >>> solution.work[-2:].round(4)
        array([0.4358, 0.4364])
        """
        if self._work is not None:
            return self._work
        if self.module.metadata.conservative:
            return np.zeros(len(self.t))
        raise ArgumentError(f"{self.module.name} has loads that do work; pass work=True to simulate")

    @cached_property
    def sensitivity(self) -> Sensitivity:
        """Derivatives of the state along the motion by what `simulate` was asked for: sol.sensitivity["m1"] is (n_t, n_x).

        Raises ArgumentError if the simulation was not asked for sensitivities.

        >>> solution = sd.systems.pendulum().compile().simulate((0, 1), sensitivities=["l"])
        >>> solution.sensitivity["l"].shape == solution.x.shape
        True
        """
        if self._columns is None or self._asked is None:
            raise ArgumentError(f"{self.module.name}: this motion has no sensitivities; pass simulate(..., sensitivities=[...]) "
                                "the parameters, inputs and initial values that they are by")
        return Sensitivity(self, self._asked.names, self._asked.columns, self._columns.reshape(len(self.t), -1, self._sizes.x))

    def states_and_columns(self, t: Times) -> tuple[np.ndarray, np.ndarray]:
        """States at any times of the motion, as by a call, (..., n_x), with the sensitivities, (..., n_columns, n_x).

        >>> module = sd.systems.pendulum().compile()
        >>> motion = module.simulate((0, 1), sensitivities=["l", "q1(0)"])
        >>> x, columns = motion.states_and_columns([0.0, 0.5])
        >>> x.shape, columns.shape
        ((2, 2), (2, 2, 2))
        """
        result = self._at(t)
        return result[..., :self._sizes.x], result[..., self._sizes.x:].reshape(*result.shape[:-1], -1, self._sizes.x)

    def states_and_inputs(self, t: Times) -> tuple[np.ndarray, np.ndarray]:
        """States at any times of the motion, as by a call, (..., n_x), with the inputs there, (..., n_in).

        >>> motion = sd.systems.cart_pole().compile(backend="numpy").simulate((0, 1), inputs={"F": ([0, 1], [0, 2])})
        >>> motion.states_and_inputs([0.25, 0.5])[1]
        array([[0.5],
               [1. ]])
        """
        x, times = self(t), np.asarray(t, dtype=float)
        rows = self._inputs.rows(times.ravel(), x.reshape(-1, x.shape[-1]))
        return x, np.broadcast_to(rows, (times.size, rows.shape[1])).reshape(*times.shape, rows.shape[1])

    @property
    def breaks(self) -> np.ndarray:
        """Times between which the motion is smooth, (n,), start and end among them: events, kinks of inputs given as tables,
        instants of sampled controllers.

        >>> sd.systems.pendulum().compile(backend="numpy").simulate((0, 1)).breaks
        array([0., 1.])
        """
        held = () if self._inputs.record is None else self._inputs.record.times
        inside = np.concatenate([[one.t for one in self._happened], self._inputs.stops((self.t[0], self.t[-1])), held])
        first, last = sorted((self.t[0], self.t[-1]))
        result = np.unique(np.append(inside[(inside > first) & (inside < last)], [first, last]))
        return result if self.t[0] <= self.t[-1] else result[::-1]

    @property
    def jumps(self) -> np.ndarray:
        """Times at which the state jumps, (n,): events that reset it, impacts.

        >>> sd.systems.pendulum().compile(backend="numpy").simulate((0, 1)).jumps.shape
        (0,)
        """
        result = [one.t for one in self._happened if not np.array_equal(one.before, one.after)]
        return np.unique(np.array([*result, *[one.t for one in self._impacts]], dtype=float))

    def lqr(self, Q: Weights, R: Weights, Qf: Weights | None = None) -> Tracking:
        """The time-varying linear-quadratic regulator about the motion: inputs of least integral of dx^T Q dx + din^T R din and
        dx^T Qf dx at the end.

        Q, R, Qf   matrices, their diagonals, or weights by name or symbol: of the states (n_x,), of inputs, of the states at the
                   end (default: the numbers of Q)
        Returns a function of (t, x) for simulate(inputs=...). Raises ArgumentError for weights that do not fit, and for motions
        whose state jumps or that ended early.

        >>> cart = sd.systems.cart_pole().compile(backend="numpy")
        >>> motion = cart.simulate((0, 0.5), q=[0, 0.1], inputs={"F": ([0, 0.5], [1, -1])})
        >>> motion.lqr(Q=[1, 1, 0, 0], R=[0.01])
        <Tracking of cart_pole from 0 to 0.5 s by F>
        """
        from symdyn.optimal.course import Course
        from symdyn.optimal.tracking import tracking

        if self._phases:
            raise ArgumentError(f"{self.module.name}: a regulator was requested along a motion with rigid contacts, which open "
                                "and close; compliant ones have derivatives")
        return tracking(Course.of(self), Q, R, Qf)

    @property
    def has_work(self) -> bool:
        """Test of whether the work of the loads was integrated along with the motion.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.has_work
        False
        """
        return self._work is not None

    def input_slopes(self, columns: np.ndarray) -> np.ndarray:
        """Derivatives of inputs that controllers hold, or that follow the state, along columns (n_t, k, n_x), (n_t, n_in, k).

        >>> push = sd.Smooth(lambda t, x: -3 * x[0], gradient=lambda t, x: [-3, 0, 0, 0])
        >>> solution = sd.systems.cart_pole().compile(backend="numpy").simulate((0, 1), inputs={"F": push})
        >>> solution.input_slopes(np.broadcast_to(np.eye(4), (len(solution.t), 4, 4)))[0]
        array([[-3.,  0.,  0.,  0.]])
        """
        given, shape = self._inputs, (len(self.t), self.module.metadata.sizes.inputs, columns.shape[1])
        rows = [given.slopes(t, x, row) for t, x, row in zip(self.t.tolist(), self.x, columns, strict=True)]
        return np.array(rows).reshape(shape) + (0.0 if given.record is None else given.record.slopes(self.t))

    @property
    def inputs(self) -> np.ndarray:
        """The inputs at every time, (n_t, n_in), as they were when the run ended; at an instant of a sampled controller those
        that take effect there; not a number where a function of the user raises.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.inputs.shape
        (1001, 0)
        """
        return self._input_rows

    @property
    def samples(self) -> dict[str, SampleRows]:
        """Input name -> what its sampled controller set: when the values took effect, t (n,), and the values (n,).

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.samples
        {}
        """
        record, known = self._inputs.record, self.module.metadata.inputs
        return {} if record is None else {name: record.of(k) for k, name in enumerate(known) if record.fresh[:, k].any()}

    @cached_property
    def outputs(self) -> dict[str, np.ndarray]:
        """The user's named outputs, each (n_t, ...).

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.outputs
        {}
        """
        if not self.module.metadata.outputs:
            return {}
        return self.module.split_outputs(self._rows("outputs"))

    @cached_property
    def frames(self) -> np.ndarray:
        """Origin and rotation (row by row) of every body's frame, n-frame, (n_t, n_b, 12).

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.frames.shape
        (1001, 1, 12)
        """
        return self._rows("frames")

    # -- constraints

    @cached_property
    def lam(self) -> np.ndarray:
        """Multipliers of the constraints, (n_t, n_c), the least ones where they are not unique; the force is -C_r^T lam.

        No columns without constraints; not a number where they cannot be computed.

        >>> solution = sd.systems.slider_crank().compile(backend="numpy").simulate((0, 0.1))
        >>> solution.lam.shape
        (1001, 1)
        """
        return self.rows("lam") if self._n_c else np.zeros((len(self.t), 0))

    @cached_property
    def constraint_violation(self) -> np.ndarray:
        """Residuals of the constraints relative to the mechanism's length, (n_t, n_c).

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.constraint_violation.shape
        (1001, 0)
        """
        return position_residual(self.module, self.t, self.x, self.params) if self._n_c else np.zeros((len(self.t), 0))

    @cached_property
    def velocity_violation(self) -> np.ndarray:
        """Residuals C_dot of the constraints relative to the largest speed of the motion, (n_t, n_c).

        >>> solution = sd.systems.slider_crank().compile(backend="numpy").simulate((0, 0.1))
        >>> bool(solution.velocity_violation.max() < 1e-8)
        True
        """
        return velocity_residual(self.module, self.t, self.x, self.params) if self._n_c else np.zeros((len(self.t), 0))

    @cached_property
    def rank(self) -> np.ndarray:
        """Number of independent constraints, (n_t,); see Module.rank.

        >>> solution = sd.systems.slider_crank().compile(backend="numpy").simulate((0, 0.1))
        >>> solution.rank[:2]
        array([1, 1])
        """
        return rank(self.module, self.t, self.x, self.params) if self._n_c else np.zeros(len(self.t), dtype=int)

    @cached_property
    def unique_reactions(self) -> dict[str, np.ndarray]:
        """Joint name -> whether the motion determines its reaction, (n_t,) of bool; where redundant constraints share it, it is
        that of the multipliers of least norm.

        >>> solution = sd.systems.slider_crank().compile(backend="numpy").simulate((0, 0.1))
        >>> sorted(solution.unique_reactions)
        ['P1', 'P2']
        """
        return unique_reactions(self)

    @cached_property
    def unique(self) -> np.ndarray:
        """Mask of the multipliers that the motion determines, (n_t, n_c) of bool; see Module.unique.

        >>> solution = sd.systems.slider_crank().compile(backend="numpy").simulate((0, 0.1))
        >>> solution.unique[0]
        array([ True])
        """
        return unique(self.module, self.t, self.x, self.params) if self._n_c else np.zeros((len(self.t), 0), dtype=bool)

    @cached_property
    def reactions(self) -> dict[str, np.ndarray]:
        """Joint name -> force (N) and moment (N m) on the child body about the joint's point on it, n-frame, (n_t, 6).

        A reaction is the load of the joint as a constraint, including the load that enforces a coordinate given by an expression,
        prescribed or dependent (coordinate=2*p). It excludes loads along the joint's speeds: joint forces (drives, springs and
        dampers in the joint), gears (sd.Gear), and constraints by expression. `cut_loads` has both.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.reactions["pivot"].shape
        (1001, 6)
        """
        return reactions(self)

    def reaction(self, joint: JointOrName, frame: BodyOrName = "inertial") -> np.ndarray:
        """Force and moment of one joint, by name or as the joint, (n_t, 6), in the axes of a frame, as `reactions`.

        frame   "inertial" (the n-frame), "ground" (the n-frame, or the ground that moves), "parent", "child", or a body
        Raises ArgumentError for another joint or frame.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.reaction("pivot", frame="bob").shape
        (1001, 6)
        """
        return in_frame(self, self.reactions, joint, frame)

    @cached_property
    def cut_loads(self) -> dict[str, np.ndarray]:
        """Joint name -> all that passes through the joint to its child, as force (N) and moment (N m) about the joint's point on
        the child, n-frame, (n_t, 6): the reaction, and the joint forces (drives, springs, dampers), gears and constraints that
        act along the joint's speeds. It does not depend on how a drive or a gear is described. Loads between two bodies
        (add_spring_damper, add_torque with reaction) pass outside of their joint.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> sorted(solution.cut_loads)
        ['pivot']
        """
        return reactions(self, "cut_loads")

    def cut_load(self, joint: JointOrName, frame: BodyOrName = "inertial") -> np.ndarray:
        """All that passes through one joint, by name or as the joint, (n_t, 6), in the axes of a frame; see `cut_loads`.

        frame   as for `reaction`
        Raises ArgumentError for another joint or frame.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.cut_load("pivot").shape
        (1001, 6)
        """
        return in_frame(self, self.cut_loads, joint, frame)

    def energy_error(self) -> float:
        """Largest |change of energy - work of the loads - what resets of events added| over the larger of kinetic energy and
        range of potential energy; where both are rounding errors, of a mechanism at rest, over its potential energy. See
        `energy_balance` for the parts.

        Raises ArgumentError as `work` does.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.energy_error() < 1e-6
        True
        """
        scale, _ = self.energy_scale
        return float(np.abs(self.energy_balance["error"]).max() / scale) if scale > 0 else 0.0

    @property
    def energy_scale(self) -> tuple[float, bool]:
        """Scale by which errors of energy are divided, J, see `energy_error`; and whether the mechanism rests.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.energy_scale[0] > 0
        True
        """
        kinetic, potential = self.energies.T
        moving, whole = float(max(kinetic.max(), np.ptp(potential))), float(np.abs(potential).max())
        rests = moving < REST * whole
        return whole if rests else moving, rests

    # -- pictures and files

    def plot(self, path: PathName | None = None, view: Sequence[float] | None = None,
             show: Sequence[str | sp.Symbol] | None = None, style: str = "screen") -> Figure:
        """Coordinates, speeds and energy over time; returns the matplotlib figure, and saves it if a path is given.

        view    (elevation, azimuth) of the eye on the mechanism, degrees
        show    what is shown: names of coordinates, speeds, states, inputs, outputs, "kinetic", "potential", "total"; of groups,
                "coordinates", "speeds", "states", "inputs", "outputs", "energy"; and "mechanism"; everything by default
        style   "screen", or "paper": curves alone, as wide as a column of a journal (86 mm), in its letters, for a PDF

        More curves than eight are divided by the joints that they belong to. Events are marked by dashed lines, changes of the
        modes of contacts by dotted ones. Raises ArgumentError for names that there are not, and for another style.

        >>> import tempfile
        >>> folder = tempfile.mkdtemp()
        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 0.2))
        >>> figure = solution.plot(f"{folder}/motion.png")
        >>> figure = solution.plot(f"{folder}/column.pdf", show=["coordinates", "energy"], style="paper")
        """
        from symdyn.pictures import plot

        return plot(self, path, view, show, style)

    def picture(self, t: Times | PathName | None = None, path: PathName | None = None,
                view: Sequence[float] | Sequence[Sequence[float]] | None = None, forces: bool = False,
                inertia: bool = False) -> Figure:
        """The mechanism at one time or several (default: start and end), side by side; returns the matplotlib figure, and saves
        it if a path is given, which may also stand alone: picture("rest.png").

        view     as for `plot`, or one for each picture
        forces   with arrows of forces in joints, loads and weights, and of torques, as `view` has them
        inertia  with the homogeneous ellipsoids that have the mass, centre of mass and inertia of their bodies
        Raises ArgumentError for times outside of the motion, if nothing can be drawn, and for ellipsoids where no body has one.

        >>> import tempfile
        >>> folder = tempfile.mkdtemp()
        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 0.2))
        >>> figure = solution.picture(0.1, f"{folder}/pose.png")
        """
        from symdyn.pictures import picture

        if path is None and isinstance(t, (str, os.PathLike)):
            t, path = None, t
        return picture(self, t, path, view, forces, inertia)

    def animate(self, path: PathName | None = None, fps: int = 25, speed: float = 1.0,
                view: Sequence[float] | None = None, forces: bool = False, inertia: bool = False) -> FuncAnimation:
        """The moving bodies; returns the matplotlib animation, and saves it if a path is given: as .gif, or as .mp4 where the
        program ffmpeg is installed.

        fps      pictures a second; speed: seconds of motion in one second of film; view: as for `plot`
        forces   with arrows, and inertia: with ellipsoids, as for `picture`
        Raises ArgumentError for another ending, for .mp4 without ffmpeg, and if nothing can be drawn.

        >>> import tempfile
        >>> folder = tempfile.mkdtemp()
        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 0.2))
        >>> film = solution.animate(f"{folder}/motion.gif", fps=5)
        """
        from symdyn.pictures import animate

        return animate(self, path, fps, speed, view, forces, inertia)

    def view(self, path: PathName | None = None, compare: Solution | None = None, forces: bool = False,
             show: Sequence[str | sp.Symbol] | None = None) -> View:
        """The motion to look at: a page that plays, turns and zooms, with the curves below.

        path      where to write it, one HTML file that needs no network; in a notebook the result shows itself
        compare   another motion, which is shown next to this one at the same times
        forces    with the forces and torques in the joints, those of loads where they act, and weights as arrows; their code is
                  compiled when it is first used
        show      which curves are below, as for `plot`; ["mechanism"]: none, since the mechanism is always there

        Events are marked by dashed lines, changes of the modes of contacts by dotted ones, with their names under the pointer.
        Raises ArgumentError for a module that gives no frames of bodies, for positions that are not finite, for names that there
        are not, and for another ending than .html; MissingExtra without matplotlib.

        >>> import tempfile
        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 0.2))
        >>> solution.view(f"{tempfile.mkdtemp()}/pendulum.html").name
        'pendulum'
        """
        from symdyn.viewer import view

        return view(self, path, compare, forces, show)

    def report(self, path: PathName) -> Path:
        """Write one HTML file with everything about the run: parameters, start, curves, extremes, energy, pictures, and what
        was generated. It opens without a network; returns its path.

        Raises ArgumentError for another ending than .html, MissingExtra without matplotlib.

        >>> import tempfile
        >>> folder = tempfile.mkdtemp()
        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 0.2))
        >>> solution.report(f"{folder}/run.html").name
        'run.html'
        """
        from symdyn.runtime.solutions.report import write_report

        return write_report(self, path)

    def save(self, path: PathName) -> Path:
        """Save to .npz (arrays, names, parameters, message) or .csv (t, x, inputs, outputs and multipliers in columns).

        Raises ArgumentError for another ending.

        >>> import tempfile
        >>> folder = tempfile.mkdtemp()
        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 0.2))
        >>> solution.save(f"{folder}/run.npz").name
        'run.npz'
        """
        path = as_path(path, "where to save the motion", "run.npz")
        if path.suffix not in (".npz", ".csv"):
            raise ArgumentError(f"cannot save to {path.name}: the ending must be .npz or .csv")
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            (self._save_arrays if path.suffix == ".npz" else self._save_columns)(path)
        return path

    def _save_arrays(self, path: Path) -> None:
        about = {"name": self.module.name, "x": self.module.metadata.x, "inputs": self.module.metadata.inputs,
                 "parameters": self.module.metadata.parameters, "units": self.module.metadata.units,
                 "method": self.method, "backend": self.backend, "success": self.success, "message": self.message}
        arrays: dict[str, Any] = {f"output_{name}": rows for name, rows in self.outputs.items()}
        if "energy" in self.module.functions:
            arrays["energy"] = self.energy
        if self.module.metadata.inputs:
            arrays["inputs"] = self.inputs
        if self._n_c:
            about["constraints"] = names(self.module)
            arrays |= {"constraint_violation": self.constraint_violation, "velocity_violation": self.velocity_violation}
        if self.module.metadata.contact_groups:
            about["left_out"] = "lam and reactions, which depend on the forces in the contact groups"
        else:
            arrays |= {"lam": self.lam} if self._n_c else {}
            arrays |= {f"reaction_{name}": rows for name, rows in self.reactions.items()}
        np.savez(path, t=self.t, x=self.x, q=self.q, u=self.u, z=self.z, params=self.params,
                 about=np.array(json.dumps(about)), **arrays)

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas.DataFrame over the time: states, inputs, outputs and multipliers in columns, as in a .csv file.

        The units of the columns are in its attrs["units"], by name. Raises MissingExtra without pandas.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 0.2))
        >>> frame = solution.to_pandas()                                       # doctest: +SKIP
        >>> list(frame), frame.index.name                                      # doctest: +SKIP
        (['q1', 'q1_dot'], 't')
        """
        return frames.to_pandas(self)

    def to_xarray(self) -> xarray.Dataset:
        """An xarray.Dataset over the time: a variable for each state, input, output and multiplier, with its unit.

        Outputs keep their shapes. Raises MissingExtra without xarray.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 0.2))
        >>> solution.to_xarray()["q1"].attrs["units"]                          # doctest: +SKIP
        'rad'
        """
        return frames.to_xarray(self)

    def columns(self) -> tuple[list[str], list[np.ndarray]]:
        """Names and values over the time, (n_t,) each: t, states, inputs, outputs entry by entry, multipliers.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 0.2))
        >>> solution.columns()[0]
        ['t', 'q1', 'q1_dot']
        """
        titles = ["t", *self.module.metadata.x, *self.module.metadata.inputs]
        columns = [self.t, *self.x.T, *self.inputs.T]
        for name, rows in self.outputs.items():
            flat = rows.reshape(len(self.t), int(np.prod(rows.shape[1:])))
            titles += [name] if flat.shape[1] == 1 else [f"{name}_{k + 1}" for k in range(flat.shape[1])]
            columns += list(flat.T)
        titles += [f"lam_{name}" for name in names(self.module)]
        columns += list(self.lam.T)
        return titles, columns

    def _save_columns(self, path: Path) -> None:
        titles, columns = self.columns()
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(titles)
            writer.writerows([[repr(float(v)) for v in row] for row in zip(*columns, strict=True)])

    @property
    def _sizes(self) -> Sizes:
        return self.module.metadata.sizes

    def rows(self, name: str) -> np.ndarray:
        """A function of the module at every time, (n_t, ...); not a number where it cannot be evaluated.

        >>> solution = sd.systems.pendulum().compile(backend="numpy").simulate((0, 1))
        >>> solution.rows("mass_matrix").shape
        (1001, 1, 1)
        """
        try:
            return self._rows(name)
        except EvaluationError:
            return self._single_rows(name)

    def _single_rows(self, name: str) -> np.ndarray:
        result = np.full((len(self.t), *self.module.shape(name)), np.nan)
        inputs = self.inputs
        for k, (t, x) in enumerate(zip(self.t, self.x, strict=True)):
            with contextlib.suppress(EvaluationError):
                p = self._phases[self._row_phases[k]].p if self._phases else self.params
                result[k] = self.module.evaluate(name, t, x, p, inputs[k])
        return result

    def _rows(self, name: str) -> np.ndarray:
        if name in OF_FORCES and self.module.metadata.contact_groups:
            raise ArgumentError(f"{self.module.name}: {name} depends on the forces in the contact groups, which are known as "
                                "impulses over steps alone; take them from sol.contact_groups")
        shape = self.module.shape(name)
        if len(self.t) == 0:
            return np.zeros((0, *shape))
        if not self._phases:
            return self.module.evaluate(name, self.t, self.x, self.params, self._input_rows).reshape(len(self.t), *shape)
        result = np.empty((len(self.t), *shape))
        for k in np.unique(self._row_phases):
            rows = self._row_phases == k
            result[rows] = self.module.evaluate(name, self.t[rows], self.x[rows], self._phases[k].p,
                                                self._input_rows[rows]).reshape(-1, *shape)
        return result

    def __repr__(self) -> str:
        end = f" to t = {self.t[-1]:.6g} s" if len(self.t) else ""
        return (f"<Solution of {self.module.name}: {counted(len(self.t), 'time')}{end}, {counted(self.n_steps, 'step')}, "
                f"{self.method} on {self.backend}: {self.message}>")

    def _repr_html_(self) -> str:
        """Where every column starts and ends, and its extremes, as a notebook shows them."""
        units = self.module.metadata.units
        rows = [(name, units.get(name, ""), *(f"{v:.6g}" for v in (values[0], values[-1], values.min(), values.max())))
                for name, values in zip(*self.columns(), strict=True)] if len(self.t) else []
        return titled(self, table(("", "unit", "start", "end", "least", "most"), rows[1:]))
