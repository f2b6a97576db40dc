"""The augmented formulation by hand: Cartesian coordinates and constraints between them, as the lecture introduces multipliers.

M r_ddot + C_r^T lam = F, C(r, t) = 0, so that C_r r_ddot = F_d with F_d = -(C_r r_dot)_r r_dot - 2 C_rt r_dot - C_tt.
Source: lecture, chapters 3.3 and 3.4.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.errors import ModelError
from symdyn.formulation.accelerations import Motion
from symdyn.formulation.by_hand.checks import ByHand, Part, recording
from symdyn.formulation.by_hand.constrained import ConstrainedByHand
from symdyn.formulation.constraints.motion import Constrained
from symdyn.formulation.constraints.rows import Row, expression_row
from symdyn.formulation.constraints.solver_choice import choose
from symdyn.formulation.equations import Equations, Symbols
from symdyn.formulation.printed.augmented import AugmentedEquations
from symdyn.formulation.probes.contradictions import contradictions
from symdyn.formulation.probes.dependent_rows import Ranks, ranks
from symdyn.model.closures import Constraint
from symdyn.model.faults import NAME
from symdyn.model.loop_check import constraint_faults
from symdyn.model.symbols import take_over
from symdyn.shown import name_of, shown
from symdyn.spatial.vectors import inner, zeros

if TYPE_CHECKING:
    from symdyn.given import Matrix, Numbers, Scalar, Vector

# Starts from which consistent states are looked for.
STARTS = 8


def augmented(coordinates: Sequence[sp.Symbol], mass: Matrix, force: Vector, constraints: Mapping[str, Scalar] | Sequence[Scalar],
              name: str = "system", defaults: Numbers | None = None, initial: Numbers | None = None,
              names: Sequence[str] | None = None) -> AugmentedEquations:
    """Augmented equations of given coordinates and constraints between them.

    coordinates   r, (n_r,): Cartesian coordinates of all bodies (m), planar orientations (rad)
    mass          (n_r, n_r) or its diagonal (n_r,): masses and moments of inertia, constant; entries may be zero where
                  constraints hold the coordinate
    force         (n_r,) known forces and moments: of r, r_dot, t, inputs, parameters; None: no forces
    constraints   expressions that are zero, of r, t and parameters; or with speeds such as `x.dot`, linear in them
    defaults      numbers for parameters; initial: numbers for coordinates and speeds at the start
    names         of the constraints, for messages; default constraint_1, ...

    The result prints C, C_r, C_t, F_d, matrix, rhs, lam, constraint_forces and equations, gives those without multipliers by
    `without_multipliers`, and compiles like the equations of a System. The length that residuals are measured by is 1 m.
    Raises ModelError with every fault: shapes, symbols, speeds that are not linear, constraints that hold nothing or contradict
    each other, coordinates without mass that nothing holds. Constraints that leave no motion are allowed, since they may
    prescribe it; warns (ModelWarning) if no state is found that fulfils them with the numbers in `defaults`.

    >>> x, y = sd.coordinates("x y")
    >>> m, l, g = sd.parameters("m l g")
    >>> equations = sd.augmented([x, y], [m, m], [0, -m * g], [x**2 + y**2 - l**2])
    >>> equations.C_r
    Matrix([[2*x, 2*y]])
    """
    given = ByHand(coordinates, name)
    faults, q = given.faults, given.q
    F = given.column(force if force is not None else [0] * given.n, "force")
    M = given.mass(mass, given.n, "there are")
    if len(F) != given.n:
        faults.append(f"force has {len(F)} entries, there are {given.n} coordinates; give one force for each")
    single = isinstance(constraints, (sp.Expr, int, float))
    rows = [constraints] if single else constraints
    labels = _labels(given, names, len(rows) if hasattr(rows, "__len__") else 0)
    expressions, sound = _taken(given, rows, labels)
    speeds = [c.dot for c in q]
    # Inputs in constraints are reported by constraint_faults.
    parts = [Part(c.name, [c.expression], speeds=True, inputs=True) for c in expressions]
    parameters, inputs = given.symbols([Part("mass", list(M), moving=False), Part("force", F, speeds=True, inputs=True), *parts])
    faults += constraint_faults(sound, [*q, *speeds], (), speeds)
    numbers = given.faults.numbers(defaults, parameters, "defaults", "parameter", take_over)
    start = given.faults.numbers(initial, [*q, *speeds], "initial", "coordinate or speed", take_over)
    if faults:
        raise ModelError(faults, name)
    description = _Description(name, Symbols(tuple(q), tuple(speeds), (), tuple(inputs), tuple(parameters), numbers, start),
                               sp.ImmutableMatrix(M), tuple(F), tuple(expressions))
    return _derive(description)


def _labels(given: ByHand, names: Any, n: int) -> list[str]:
    """Names of n constraints."""
    if names is None:
        return [f"constraint_{k + 1}" for k in range(n)]
    if not isinstance(names, (str, list, tuple)):
        given.faults.append(f"names is {shown(names)}; pass a list of text, one for each constraint")
        return [f"constraint_{k + 1}" for k in range(n)]
    names = list(names) if not isinstance(names, str) else [names]
    given.faults += [f"one of the constraints is named {shown(label)}; pass text on one line of letters, digits, spaces and "
                     "_ . , : + - * / ^ ' # % and brackets" for label in names
                     if not isinstance(label, str) or not NAME.fullmatch(label)]
    given.faults += [f"{count} constraints are named {shown(label)}; give each a name of its own"
                     for label, count in Counter(map(name_of, names)).items() if count > 1]
    if len(names) != n:
        given.faults.append(f"names has {len(names)} entries, there are {n} constraints; give each a name")
        return [f"constraint_{k + 1}" for k in range(n)]
    return [str(label) for label in names]


def _taken(given: ByHand, rows: Any, labels: Sequence[str]) -> tuple[list[Constraint], list[Constraint]]:
    """The constraints, and those of them that are expressions."""
    if isinstance(rows, sp.MatrixBase) and 1 in rows.shape:
        rows = list(rows)
    if not isinstance(rows, (list, tuple, np.ndarray)):
        every = [Constraint(label, e) for label, e in zip(labels, given.column(rows, "constraints", labels), strict=False)]
        return every, every
    every, sound = [], []
    for label, row in zip(labels, rows, strict=False):
        known = len(given.faults)
        every.append(Constraint(label, given.expression(row, label)))
        if len(given.faults) == known:
            sound.append(every[-1])
    return every, sound


@dataclass(frozen=True)
class _Description:
    """The arguments, checked."""

    name: str
    symbols: Symbols
    M: sp.ImmutableMatrix
    F: tuple[sp.Expr, ...]
    constraints: tuple[Constraint, ...]


class _Recorded:
    """Mass, force and rows of a description on a tape of their own."""

    def __init__(self, description: _Description) -> None:
        self.symbols = description.symbols
        self.algebra = algebra = recording(self.symbols)
        self.rates = [algebra.leaves[u] for u in self.symbols.speeds]
        with algebra.section("mass M and force F"):
            self.M = algebra.name("M", algebra.matrix(description.M))
            self.F = algebra.name("F", algebra.constants(description.F))
        self.rows: list[Row] = []
        for constraint in description.constraints:
            with algebra.section(f"constraint {constraint.name}"):
                self.rows.append(expression_row(algebra, constraint, self.symbols.coordinates, self.rates, self.symbols.speeds))


class _Coordinates(ConstrainedByHand, Motion):
    """Coordinates whose mass matrix is constant; the speeds are their derivatives."""

    def __init__(self, recorded: _Recorded, intrinsic: bool = False, independent: tuple[int, ...] | None = None,
                 pivots: tuple[tuple[int, int], ...] | None = None) -> None:
        symbols = recorded.symbols
        super().__init__(recorded.algebra, symbols.coordinates, symbols.speeds, recorded.rates, (), symbols.inputs,
                         symbols.parameters)
        self.recorded = recorded
        self.constrain(recorded.rows, intrinsic, independent, pivots)

    def quantities(self) -> dict[str, Any]:
        own = {"k_tilde": self.k_tilde, "F_tilde": lambda: self.recorded.F, "kinetic_energy": self.kinetic_energy,
               "constraint_force": self.constraint_force}
        return {**super().quantities(), **own}

    def M_tilde(self) -> np.ndarray:
        return self.recorded.M  # type: ignore[no-any-return]

    def k_tilde(self) -> np.ndarray:
        return zeros(len(self.speeds))

    def bias(self) -> np.ndarray:
        return -self.recorded.F

    def inverse_dynamics(self) -> np.ndarray:
        return self.recorded.M @ self.speed_rates - self.recorded.F  # type: ignore[no-any-return]

    def constraint_force(self) -> np.ndarray:
        """-C_r^T lam, (n_r,), N or Nm."""
        return -(self.C_r().T @ self.lam()) if self.rows else zeros(len(self.speeds))

    def kinetic_energy(self) -> Any:
        """r_dot^T M r_dot / 2, J."""
        velocity = np.array(self.rates, dtype=object)
        return inner(velocity, self.recorded.M @ velocity) / 2


def _derive(description: _Description) -> AugmentedEquations:
    """The equations, recorded on a new tape. Raises ModelError for what holds at no state."""
    recorded = _Recorded(description)
    rows = recorded.rows

    def result(quantities: Constrained, singular_fallback: Equations | None) -> AugmentedEquations:
        return AugmentedEquations(description.name, "augmented", True, description.symbols, recorded.algebra.recorder,
                                  recorded.algebra.leaves, quantities.quantities(), again=partial(_derive, description),
                                  constraints=tuple(r.name for r in rows), holonomic=tuple(r.holonomic for r in rows),
                                  singular_fallback=singular_fallback)

    faults = contradictions(result(_Coordinates(recorded, intrinsic=True), None))
    if faults:
        raise ModelError(faults, description.name)
    return choose(lambda *way: _Coordinates(recorded, *way), result, search_near)


def search_near(equations: Equations) -> Ranks | None:
    """Rank and independent rows at consistent states near the initial one or, failing that, near others.

    Parameters without defaults take random numbers, which makes no rows dependent that are not with all numbers.
    """
    symbols = equations.symbols
    stream = np.random.default_rng(3)
    numbers = {p: float(symbols.defaults.get(p, stream.uniform(0.5, 1.5))) for p in symbols.parameters}
    begin = {q: float(symbols.initial.get(q, 0.0)) for q in symbols.coordinates}
    for k in range(STARTS):
        near = {q: value + (k > 0) * stream.uniform(-1, 1) * (1 + abs(value)) for q, value in begin.items()}
        result = ranks(replace(equations, symbols=replace(symbols, defaults=numbers, initial=near)))
        if result is not None:
            return result
    return None
