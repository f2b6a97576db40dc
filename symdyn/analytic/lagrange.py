"""Energies, momenta, Lagrange's and Hamilton's functions, Christoffel symbols of derived equations, on their tape.

With T(q, u, t) and V(q, t) of gravity, springs and load elements:
    L = T - V                        p = dT/du, momenta; of quasi-velocities where u is not q_dot
    H = p . q_dot - L in q and p     q_dot = dH/dp,  p_dot = -dH/dq + loads without potential (- C_r^T lam under constraints)
    c_ijk = (dM_ij/dq_k + dM_ik/dq_j - dM_jk/dq_i) / 2, so that k_tilde_i = sum of c_ijk u_j u_k where nothing is prescribed
Source: Goldstein, Poole, Safko, Classical Mechanics, 3rd ed., sections 2.7, 8.1; Siciliano et al., Robotics, section 7.1.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.analytic.minors import blocks, determinant, solve
from symdyn.errors import SymdynError
from symdyn.formulation.algebra import TapeAlgebra, given_by_time
from symdyn.formulation.trees.mass_matrix import Factors, factorize
from symdyn.spatial.vectors import vector
from symdyn.tape.differentiate import forward
from symdyn.tape.node import ACCELERATION, SEED, Node
from symdyn.tape.passes import substitute

if TYPE_CHECKING:
    from symdyn.formulation.equations import Equations


# Speeds that a mass matrix may couple so that its inverse is written out; so that it is put into the rates of momenta, too.
CLOSED, PUT_IN = 3, 2


class Mechanics:
    """Quantities of equations as nodes: q, u, accelerations u_dot and momenta p as leaves, and derivatives along the motion."""

    def __init__(self, equations: Equations) -> None:
        self.equations = equations
        self.recorder = equations.recorder
        symbols, leaves = equations.symbols, equations.leaves
        self.q = [leaves[q] for q in symbols.coordinates]
        self.u = [leaves[u] for u in symbols.speeds]
        self.z = [leaves[z] for z in symbols.states]
        self.inputs = [leaves[i] for i in symbols.inputs]
        self.ud = [self.recorder.leaf(f"{u.name}_dot", ACCELERATION) for u in symbols.speeds]
        self.p = list(momentum_leaves(equations))

    @property
    def rates(self) -> np.ndarray:
        """q_dot, (n_q,)."""
        return self.equations.quantity("rates").ravel()

    @property
    def plain(self) -> bool:
        """Whether every speed is the derivative of the coordinate in its place."""
        return len(self.q) == len(self.u) and all(a is b for a, b in zip(self.rates, self.u, strict=True))

    def demand_plain(self, what: str) -> None:
        """Raises SymdynError where speeds are no derivatives of coordinates."""
        if not self.plain:
            raise SymdynError(f"{self.equations.name}: {what} requested, but its speeds are quasi-velocities, not derivatives of "
                              "coordinates; describe orientations by Euler angles without speeds='body', or take eq.momenta and "
                              "eq.explicit('coriolis'), which hold for all speeds")

    def by(self, entries: Any, leaf: Node) -> list[Any]:
        """Partial derivatives by a leaf."""
        return forward(self.recorder, list(entries), {leaf: 1})

    def rate(self, entries: Any) -> list[Any]:
        """Derivatives by time, with accelerations u_dot."""
        seeds = {**dict(zip(self.q, self.rates, strict=True)), **dict(zip(self.u, self.ud, strict=True)),
                 **given_by_time(self.equations.leaves)}
        if self.z:
            seeds.update(zip(self.z, self.state_rates(), strict=True))
        return forward(self.recorder, list(entries), seeds)

    def statics(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """M_tilde u_dot + k_tilde - F_tilde + C_r^T lam; the constraints C; z_dot."""
        balance, n_u, n_c = self.equations.quantity("balance"), len(self.u), len(self.equations.constraints)
        return balance[:n_u], balance[n_u:n_u + n_c], balance[n_u + n_c:n_u + n_c + len(self.z)]

    def constraint_rates(self) -> tuple[np.ndarray, np.ndarray]:
        """C_dot, which of velocity constraints is A u + b itself, and C_ddot."""
        balance, n_c = self.equations.quantity("balance"), len(self.equations.constraints)
        begin = len(self.u) + n_c + len(self.z)
        return balance[begin:begin + n_c], balance[begin + n_c:begin + 2 * n_c]

    def state_rates(self) -> list[Any]:
        """z_dot of extra states."""
        return list(self.statics()[2])

    def at(self, entries: Any, values: Mapping[Node, Any]) -> np.ndarray:
        """The entries with leaves replaced by numbers or nodes."""
        array = np.asarray(entries, dtype=object)
        result = vector(*substitute(tuple(array.ravel()), values, self.recorder))
        return result.reshape(array.shape)

    # -- energies

    @property
    def T(self) -> Any:
        """Kinetic energy, J."""
        equations = self.equations
        if "energy" in equations.quantities:
            return equations.quantity("energy")[0]
        return equations.quantity("kinetic_energy").item()

    @property
    def V(self) -> Any:
        """Potential energy of gravity, springs and load elements, J. Raises SymdynError without bodies."""
        equations = self.equations
        if "energy" not in equations.quantities:
            raise SymdynError(f"{equations.name}: its potential energy was requested; its forces are expressions by hand, of "
                              "which it is not known whether they have a potential. Describe it as a System, whose gravity "
                              "and springs have one, or take eq.T and eq.F_tilde")
        return equations.quantity("energy")[1]

    def momenta(self) -> np.ndarray:
        """dT/du, (n_u,)."""
        return vector(*[self.by([self.T], u)[0] for u in self.u])

    def _split(self) -> tuple[np.ndarray, Any]:
        """dT/du and T for u = 0: zero unless something moves by itself."""
        rest = dict.fromkeys(self.u, 0)
        return self.at(self.momenta(), rest), self.at([self.T], rest)[0]

    @property
    def coupled(self) -> int:
        """Number of speeds that the largest block of the mass matrix connects."""
        return max(map(len, blocks(self.equations.quantity("M_tilde"))), default=0)

    def demand_closed(self, what: str, instead: str) -> None:
        """Raises SymdynError where the inverse of the mass matrix fills pages."""
        if self.coupled > CLOSED:
            raise SymdynError(f"{self.equations.name}: {what} requested; it takes the inverse of a mass matrix that couples "
                              f"{self.coupled} speeds, which is written out for up to {CLOSED}; {instead}, or ask for it in "
                              "named intermediates with eq.explicit(name, intermediates=True)")

    def hamiltonian(self) -> Any:
        """(p - p0)^T M_tilde^-1 (p - p0) / 2 - T0 + V, in q, p and t. Raises SymdynError for quasi-velocities, and where the
        mass matrix couples more than CLOSED speeds."""
        self.demand_plain("Hamilton's function was")
        self.demand_closed("Hamilton's function was", "take eq.hamilton_equations, which hold p = dT/dq_dot then, or eq.momenta")
        M, (p0, T0) = self.equations.quantity("M_tilde"), self._split()
        p = vector(*self.p) - p0
        total = self.V - T0
        for block in blocks(M):
            rows = M[np.ix_(block, block)]
            bordered = np.zeros((len(block) + 1,) * 2, dtype=object)
            bordered[:-1, :-1], bordered[:-1, -1], bordered[-1, :-1] = rows, p[block], p[block]
            total = total - determinant(bordered) / (2 * determinant(rows))
        return total

    def hamiltonian_by_steps(self) -> Any:
        """The same for any mass matrix, by its factors L^T D L, whose entries are steps: (p - p0)^T L^-1 D^-1 L^-T (p - p0) / 2
        - T0 + V."""
        self.demand_plain("Hamilton's function was")
        p0, T0 = self._split()
        factors = self._factors()
        y = factors.inwards(vector(*self.p) - p0)
        return sum((a * a * d / 2 for a, d in zip(y, factors.inverse_D, strict=True)), self.V - T0)

    def hamilton_speeds_by_steps(self) -> np.ndarray:
        """q_dot in q and p, by factors of the mass matrix."""
        return self._factors().solve(vector(*self.p) - self._split()[0])

    def _factors(self) -> Factors:
        M, algebra = self.equations.quantity("M_tilde"), TapeAlgebra(self.recorder, dict(self.equations.leaves))
        return factorize(algebra, M, [f"the mass matrix is not positive definite at {u}" for u in self.equations.symbols.speeds])

    def hamilton_speeds(self) -> np.ndarray:
        """q_dot in q and p, (n_q,)."""
        return solve(self.equations.quantity("M_tilde"), vector(*self.p) - self._split()[0])

    def hamilton_forces(self) -> np.ndarray:
        """p_dot without forces of constraints, (n_q,): dT/dq + F_tilde at constant q_dot, in q and q_dot."""
        return vector(*[self.by([self.T], q)[0] for q in self.q]) + self.equations.quantity("F_tilde")

    def hamilton_forces_by_momenta(self) -> np.ndarray:
        """The same in q and p."""
        return self.at(self.hamilton_forces(), dict(zip(self.u, self.hamilton_speeds(), strict=True)))

    def christoffel(self) -> np.ndarray:
        """c_ijk, (n, n * n): row i, column n j + k. Raises SymdynError for quasi-velocities."""
        self.demand_plain("Christoffel symbols were")
        M, n = self.equations.quantity("M_tilde"), len(self.q)
        slopes = np.zeros((n, n, n), dtype=object)
        for k, q in enumerate(self.q):
            slopes[:, :, k] = vector(*self.by(M.ravel(), q)).reshape(n, n)
        result = np.zeros((n, n, n), dtype=object)
        for i in range(n):
            for j in range(n):
                for k in range(j, n):
                    result[i, j, k] = result[i, k, j] = (slopes[i, j, k] + slopes[i, k, j] - slopes[j, k, i]) / 2
        return result.reshape(n, n * n)

    def explicit_rates(self) -> np.ndarray:
        """x_dot with accelerations by Cramer's rule, (n_q + n_u + n_z,). Raises SymdynError under constraints, where loads depend
        on accelerations, and where the mass matrix couples more than CLOSED speeds."""
        self._demand_free()
        self.demand_closed("x_dot in explicit form was", "take eq.mass_matrix and eq.forcing, or "
                           "evaluate module.rhs(t, x, params)")
        return self._state_rates(solve(self.equations.quantity("M_tilde"), -self.equations.quantity("bias")))

    def explicit_rates_by_steps(self) -> np.ndarray:
        """x_dot by factors of the mass matrix. Raises SymdynError under constraints, and where loads depend on accelerations."""
        self._demand_free()
        return self._state_rates(self._factors().solve(-self.equations.quantity("bias")))

    def _demand_free(self) -> None:
        equations = self.equations
        if equations.constraints or equations.implicit_loads:
            why = "constraints" if equations.constraints else "loads that depend on accelerations"
            raise SymdynError(f"{equations.name}: explicit accelerations were requested, but there are {why}; evaluate "
                              "module.rhs(t, x, params) instead")

    def _state_rates(self, accelerations: np.ndarray) -> np.ndarray:
        rates = self.equations.quantity("rates").ravel()
        return np.concatenate([rates, accelerations, vector(*self.state_rates())])


def momentum_leaves(equations: Equations) -> dict[Node, sp.Symbol]:
    """Leaf of each momentum -> the symbol it is printed as: p and the coordinate's name, with a longer letter where that is
    taken; none for quasi-velocities."""
    symbols = equations.symbols
    if len(symbols.coordinates) != len(symbols.speeds):
        return {}
    taken = {s.name for s in equations.leaves if isinstance(s, sp.Symbol)}
    letter = "p"
    while any(f"{letter}_{q.name}" in taken for q in symbols.coordinates):
        letter += "p"
    return {equations.recorder.leaf(f"(momentum {q.name})", SEED): sp.Symbol(f"{letter}_{q.name}", real=True)
            for q in symbols.coordinates}


def _lagrangian(m: Mechanics) -> Any:
    return m.T - m.V


QUANTITIES: Mapping[str, Callable[[Mechanics], Any]] = {
    "T": lambda m: m.T, "V": lambda m: m.V, "lagrangian": _lagrangian, "momenta": Mechanics.momenta,
    "hamiltonian": Mechanics.hamiltonian, "hamilton_speeds": Mechanics.hamilton_speeds,
    "hamilton_forces": Mechanics.hamilton_forces, "hamilton_forces_by_momenta": Mechanics.hamilton_forces_by_momenta,
    "christoffel": Mechanics.christoffel, "forcing": lambda m: -m.equations.quantity("bias"),
    "state_rates": Mechanics.explicit_rates}


def recorded(equations: Equations, name: str) -> Any:
    """A quantity of QUANTITIES on the tape of the equations. Raises SymdynError where it does not exist."""
    return QUANTITIES[name](Mechanics(equations))


# The same where the mass matrix couples more speeds, for named intermediates.
BY_STEPS: Mapping[str, Callable[[Mechanics], Any]] = {
    "hamiltonian": Mechanics.hamiltonian_by_steps, "hamilton_speeds": Mechanics.hamilton_speeds_by_steps,
    "state_rates": Mechanics.explicit_rates_by_steps}


def by_steps(equations: Equations, name: str) -> Any:
    """A quantity of BY_STEPS where the mass matrix couples more than CLOSED speeds, else None. Raises SymdynError where it does
    not exist."""
    mechanics = Mechanics(equations) if name in BY_STEPS else None
    return BY_STEPS[name](mechanics) if mechanics is not None and mechanics.coupled > CLOSED else None
