"""Equations of motion whose matrices are given: K q_dot + A u + b = 0, M u_dot = f, with constraints of positions and speeds.

With constraints M u_dot + C_r^T lam = f, C_r u_dot = F_d; dependent speeds stay in the state, and accelerations follow from one
equation for each speed and one for each constraint, in whichever way takes the fewest operations.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
import sympy as sp

from symdyn.counting import counted
from symdyn.errors import ModelError, ModelWarning, UnsupportedExpression
from symdyn.formulation.accelerations import Motion
from symdyn.formulation.algebra import TapeAlgebra
from symdyn.formulation.by_hand.augmented import search_near
from symdyn.formulation.by_hand.checks import recording
from symdyn.formulation.by_hand.constrained import ConstrainedByHand
from symdyn.formulation.constraints.motion import Constrained
from symdyn.formulation.constraints.rows import Row
from symdyn.formulation.constraints.solver_choice import choose
from symdyn.formulation.equations import Equations, Symbols
from symdyn.formulation.names import output_quantity
from symdyn.formulation.printed.augmented import AugmentedEquations
from symdyn.formulation.printed.independent_speeds import MotionEquations
from symdyn.formulation.probes.contradictions import contradictions
from symdyn.formulation.probes.dependent_rows import Ranks
from symdyn.formulation.probes.rank import first_dependent
from symdyn.formulation.square_systems import SquareSystem
from symdyn.spatial.vectors import inner, vector, zeros
from symdyn.tape.differentiate import forward, jacobian, reverse
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.node import ACCELERATION, Node, is_zero
from symdyn.tape.tape import Tape

# Random states at which matrices are looked at, and what is zero there, relative to the largest entry.
STATES, ROUNDING = 5, 1e-9


@dataclass(frozen=True)
class GivenRow:
    """A constraint by name: of positions, expression = 0, or of speeds, coefficients u + rest = 0."""

    name: str
    expression: sp.Expr | None = None
    coefficients: tuple[sp.Expr, ...] = ()
    rest: sp.Expr = sp.S.Zero


@dataclass(frozen=True)
class GivenMatrices:
    """Parts of equations, in SymPy's expressions.

    symbols      of the equations; same: functions of time and their derivatives -> the symbols (or numbers) that they stand for
    kinematics   K (n_q, n_q), A (n_q, n_u), b (n_q, 1) of K q_dot + A u + b = 0; None: u = q_dot
    mass, forcing   M (n_u, n_u), symmetric, and f, a column
    parts        generalized active forces F_tilde, and the generalized inertia forces, columns, where they are known by
                 themselves: their sum is f - M u_dot; None: F_tilde = f, k_tilde = 0
    dependent    number of speeds that the constraints of speeds determine, where it is known
    accelerations   coefficients of u_dot and rest of the velocity constraints' derivatives, where these are given, too
    homogeneous  whether all velocities are linear in u, without a rest, so that the kinetic energy is u^T M u / 2
    energy       kinetic and potential energy, and the power of all other forces, where they are known
    states       extra states with their rates; outputs: by name
    unknown      name -> expression for what is not in the equations of motion but follows from `auxiliary`, linear in these
    remarks      what there is to say about the equations
    """

    name: str
    formulation: str
    symbols: Symbols
    same: Mapping[sp.Basic, Any]
    mass: sp.MatrixBase
    forcing: sp.MatrixBase
    kinematics: tuple[sp.MatrixBase, sp.MatrixBase, sp.MatrixBase] | None = None
    parts: tuple[sp.MatrixBase, sp.MatrixBase] | None = None
    dependent: int | None = None
    rows: tuple[GivenRow, ...] = ()
    accelerations: tuple[sp.MatrixBase, sp.MatrixBase] | None = None
    energy: tuple[sp.Expr, sp.Expr, sp.Expr] | None = None
    states: tuple[tuple[sp.Symbol, sp.Expr], ...] = ()
    outputs: tuple[tuple[str, Any], ...] = ()
    auxiliary: sp.MatrixBase | None = None
    homogeneous: bool = False
    unknown: Mapping[str, sp.Basic] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()


class Recorded:
    """Kinematics, matrices and rows on a tape of their own; kinematics_only: without matrices and rows."""

    def __init__(self, given: GivenMatrices, kinematics_only: bool = False) -> None:
        self.given, self.symbols = given, given.symbols
        s = self.symbols
        self.algebra = own = recording(s)
        self.speeds = vector(*[own.leaves[u] for u in s.speeds])
        self.taken = self._taking()
        self.rates = self._rates()
        for q, rate in zip(s.coordinates, self.rates, strict=True):
            own.leaves.setdefault(q.dot, rate)
        self.taken = self._taking({u.dot: own.recorder.leaf(f"{u.name}_dot", ACCELERATION) for u in s.speeds})
        if kinematics_only:
            return
        with own.section("mass matrix and forcing"):
            self.M = own.name("M", self.taken.matrix(given.mass))
            self.f = own.name("f", self.taken.constants(given.forcing))
        self.rows = [self._row(row) for row in given.rows]

    def _taking(self, others: Mapping[sp.Basic, Any] | None = None) -> TapeAlgebra:
        """The algebra that takes SymPy's functions of time for what they stand for."""
        known = {**self.algebra.leaves, **(others or {})}
        same = {f: known.get(symbol, symbol) for f, symbol in self.given.same.items()
                if symbol in known or symbol == 0}
        return self.algebra.within(same)

    def _rates(self) -> list[Any]:
        """q_dot."""
        if self.given.kinematics is None:
            return list(self.speeds)
        a = self.algebra
        with a.section("kinematic differential equations"):
            K, A, b = (self.taken.matrix(part) for part in self.given.kinematics)
            right = -(A @ self.speeds + b.ravel()) if len(self.speeds) else -b.ravel()
            reason = "the kinematic differential equations do not determine the derivatives of the coordinates here"
            try:
                return list(a.name("qd", SquareSystem(a, K, reason).solve(right)))
            except ZeroDivisionError:
                raise ModelError(["the kinematic differential equations do not determine the derivatives of the coordinates at "
                                  "any state: the matrix of their coefficients is singular"], self.given.name) from None

    def _row(self, row: GivenRow) -> Row:
        a, recorder = self.algebra, self.algebra.recorder
        by_time = a.by_time(self.symbols.coordinates, self.rates)
        with a.section(f"constraint {row.name}"):
            if row.expression is not None:
                value = self.taken.expression(row.expression)
                rate = forward(recorder, [value], by_time)[0]
                along = jacobian(recorder, [rate], list(self.speeds), "forward")[0]
            else:
                value = 0
                along = self.taken.constants(row.coefficients)
                rate = inner(along, self.speeds) + self.taken.expression(row.rest)
            return Row(row.name, value, along, rate, forward(recorder, [rate], by_time)[0], "", row.expression is not None)


class _Matrices(Motion):
    """Quantities of equations without constraints."""

    def __init__(self, recorded: Recorded) -> None:
        s = recorded.symbols
        super().__init__(recorded.algebra, s.coordinates, s.speeds, recorded.rates, recorded.given.states, s.inputs, s.parameters)
        self.recorded = recorded

    def expression(self, e: sp.Expr) -> Any:
        return self.recorded.taken.expression(e)

    def quantities(self) -> dict[str, Any]:
        given = self.recorded.given
        own: dict[str, Any] = {"k_tilde": self.k_tilde, "F_tilde": self.F_tilde,
                               **{output_quantity(name): partial(self.output, name, e) for name, e in given.outputs}}
        if given.homogeneous:
            own["kinetic_energy"] = self.kinetic_energy
        if given.energy is not None:
            own |= {"energy": self.energy, "power": self.power, "power_x": self.power_x}
        own |= {output_quantity(name): partial(self.unknown, k) for k, name in enumerate(given.unknown)}
        return {**super().quantities(), **own}

    def M_tilde(self) -> np.ndarray:
        return self.recorded.M

    def F_tilde(self) -> np.ndarray:
        """Generalized active forces where they are known by themselves, else all of f."""
        parts = self.recorded.given.parts
        return self.recorded.f if parts is None else self.recorded.taken.constants(parts[0])

    def k_tilde(self) -> np.ndarray:
        """The generalized inertia forces at u_dot = 0, with the opposite sign, where they are known by themselves, else zero."""
        given, taken = self.recorded.given, self.recorded.taken
        if given.parts is None:
            return zeros(len(self.speeds))
        rates = {u.dot for u in self.speeds}
        still = taken.within({f: 0 for f, symbol in given.same.items() if symbol in rates})
        return -still.constants(given.parts[1])

    def bias(self) -> np.ndarray:
        return -self.recorded.f

    def inverse_dynamics(self) -> np.ndarray:
        return self.recorded.M @ self.speed_rates - self.recorded.f  # type: ignore[no-any-return]

    def kinetic_energy(self) -> Any:
        """u^T M u / 2, J."""
        u = self.recorded.speeds
        return inner(u, self.recorded.M @ u) / 2

    def energy(self) -> np.ndarray:
        """Kinetic and potential energy, J."""
        assert self.recorded.given.energy is not None
        return vector(*[self.expression(e) for e in self.recorded.given.energy[:2]])

    def power(self) -> Any:
        """Power of what the potential energy leaves out, and of constraints that depend on time, W."""
        assert self.recorded.given.energy is not None
        return self.expression(self.recorded.given.energy[2])

    def power_x(self) -> np.ndarray:
        """Derivative of the power by the state, (n_x,)."""
        return vector(*reverse(self.algebra.recorder, self.power(), self.x()))

    def output(self, name: str, value: Any) -> Any:
        """A named output."""
        with self.algebra.section(f"output {name}"):
            if isinstance(value, (tuple, sp.MatrixBase)):
                return vector(*[self.expression(e) for e in value])
            return self.expression(value)

    def unknown(self, k: int) -> Any:
        """One of what follows from the auxiliary equations."""
        return self.recall("unknowns_of_auxiliary")[k]

    def unknowns_of_auxiliary(self) -> np.ndarray:
        """Values by which the auxiliary equations hold at the accelerations of the motion."""
        given, recorder = self.recorded.given, self.algebra.recorder
        assert given.auxiliary is not None
        with self.algebra.section("auxiliary equations"):
            sought = [recorder.leaf(name, ACCELERATION) for name in given.unknown]
            rates = dict(zip([u.dot for u in self.speeds], self.recall("accelerations"), strict=True))
            at = {f: rates[symbol] for f, symbol in given.same.items() if symbol in rates}
            here = self.recorded.taken.within({**at, **dict(zip(given.unknown.values(), sought, strict=True))})
            rows = here.constants(given.auxiliary)
            A = jacobian(recorder, list(rows), sought, "forward")
            zero = here.within(dict.fromkeys(given.unknown.values(), 0)).constants(given.auxiliary)
            reason = f"the auxiliary equations do not determine {', '.join(given.unknown)} here"
            return SquareSystem(self.algebra, A, reason).solve(-zero)


class _ConstrainedMatrices(ConstrainedByHand, _Matrices):
    """Quantities of equations with constraints."""

    def __init__(self, recorded: Recorded, intrinsic: bool = False, independent: tuple[int, ...] | None = None,
                 pivots: tuple[tuple[int, int], ...] | None = None) -> None:
        super().__init__(recorded)
        self.constrain(recorded.rows, intrinsic, independent, pivots)

    def quantities(self) -> dict[str, Any]:
        return {**super().quantities(), "constraint_force": self.constraint_force}

    def power(self) -> Any:
        total, given = super().power(), self.C_t()
        return total if all(is_zero(e) for e in given) else total + inner(self.lam(), given)

    def constraint_force(self) -> np.ndarray:
        """-C_r^T lam, (n_u,)."""
        return -(self.C_r().T @ self.lam())


def from_matrices(given: GivenMatrices) -> MotionEquations:
    """The equations, recorded on a tape of their own; with constraints AugmentedEquations.

    Raises ModelError for a mass matrix that is not symmetric or is singular at every state, for kinematic equations that do not
    determine the derivatives of the coordinates, for constraints that contradict each other, or hold more speeds than are
    dependent; and for expressions without a counterpart in generated code.
    """
    try:
        recorded = Recorded(given)
    except UnsupportedExpression as error:
        raise ModelError([str(error)], given.name) from None
    _demand_symmetry(recorded)
    _compare_accelerations(recorded)
    again = partial(from_matrices, given)
    if not given.rows:
        quantities = _Matrices(recorded)
        dependent = first_dependent(recorded.algebra.recorder, quantities.recall("M_tilde"))
        if dependent is not None:
            raise ModelError([f"the mass matrix is singular at every state: {given.symbols.speeds[dependent]} moves nothing that "
                              f"the speeds after it do not move already; leave one out, or let bodies have mass"], given.name)
        return MotionEquations(given.name, given.formulation, False, given.symbols, recorded.algebra.recorder,
                               recorded.algebra.leaves, quantities.quantities(), given.remarks, again=again)

    def result(quantities: Constrained, singular_fallback: Equations | None) -> AugmentedEquations:
        return AugmentedEquations(given.name, given.formulation, False, given.symbols, recorded.algebra.recorder,
                                  recorded.algebra.leaves, quantities.quantities(), given.remarks, again=again,
                                  constraints=tuple(r.name for r in recorded.rows),
                                  holonomic=tuple(r.holonomic for r in recorded.rows), singular_fallback=singular_fallback)

    whole = result(_ConstrainedMatrices(recorded, intrinsic=True), None)
    faults = contradictions(whole)
    if faults:
        raise ModelError(faults, given.name)

    def search(equations: Equations) -> Ranks | None:
        found = search_near(equations)
        if found is not None and given.dependent is not None and found.rank > given.dependent:
            positions = ", ".join(r.name for r in recorded.rows if r.holonomic)
            raise ModelError([f"the velocity constraints do not imply the rates of the constraints of positions ({positions}): "
                              f"together they hold {found.rank} speeds, {counted(given.dependent, 'speed is', 'speeds are')} "
                              f"dependent; let the velocity constraints contain the derivatives of the configuration "
                              "constraints"], given.name)
        return found

    return choose(lambda *way: _ConstrainedMatrices(recorded, *way), result, search)


def _demand_symmetry(recorded: Recorded) -> None:
    """Raises ModelError for a mass matrix that is not symmetric at random states."""
    M, speeds = recorded.M, recorded.symbols.speeds
    values = at_random_states(recorded.algebra, recorded.symbols, M=M)["M"]
    size = np.abs(values).max(axis=(1, 2), initial=0.0, where=np.isfinite(values))
    off = np.abs(values - np.swapaxes(values, 1, 2)) / np.where(size > 0, size, 1.0)[:, None, None]
    wrong = [(i, j) for i in range(len(M)) for j in range(i) if np.nanmax(off[:, i, j], initial=0.0) > ROUNDING]
    if wrong:
        pairs = "; ".join(f"{speeds[i]} and {speeds[j]}" for i, j in wrong[:4])
        raise ModelError([f"the mass matrix is not symmetric: its entries differ between {pairs}; pass the equations as they "
                          f"follow from Kane's or Lagrange's method, one for each speed in the order of the speeds. Rows of "
                          f"constraints do not belong into it: pass the KanesMethod itself"], recorded.given.name)


def _compare_accelerations(recorded: Recorded) -> None:
    """Warns of given derivatives of the velocity constraints that are not their derivatives."""
    given = recorded.given
    if given.accelerations is None:
        return
    rows = [r for r in recorded.rows if not r.holonomic]
    own = np.array([[*r.jacobian, r.remaining] for r in rows], dtype=object)
    coefficients, rest = given.accelerations
    others = np.column_stack([recorded.taken.matrix(coefficients), recorded.taken.constants(rest)])
    result = at_random_states(recorded.algebra, recorded.symbols, own=own, others=others)
    size = np.abs(result["own"]).max(axis=2) + 1e-300
    wrong = [rows[k].name for k in range(len(rows)) if (np.abs(result["own"] - result["others"])[:, k].max(axis=1)
                                                        > ROUNDING * size[:, k]).any()]
    if wrong:
        warnings.warn(f"{given.name}: the acceleration constraints of {', '.join(wrong)} are not the derivatives of the velocity "
                      "constraints at random states; the derivatives are taken, which are the same wherever the constraints "
                      "hold, unless the ones given are wrong", ModelWarning, stacklevel=5)


def at_random_states(algebra: TapeAlgebra, symbols: Symbols, states: int = STATES,
                     **quantities: np.ndarray) -> dict[str, np.ndarray]:
    """Values of quantities at random states, states first; parameters near their defaults, others between 0.3 and 1.3."""
    tape = Tape.of(algebra.recorder, **quantities)
    stream = np.random.default_rng(11)
    numbers = {leaf.args[1]: stream.uniform(0.3, 1.3, states) for leaf in tape.inputs if isinstance(leaf, Node)}
    known = {p.name: float(v) for p, v in symbols.defaults.items()}
    numbers |= {name: known[name] * (1 + (values - 0.8) / 100) for name, values in numbers.items() if known.get(name)}
    with np.errstate(all="ignore"):
        return evaluate_rows(tape, numbers, states)

