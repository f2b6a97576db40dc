"""Equations of symdyn's and of SymPy's, proved the same by exact algebra, whatever the speeds of either.

Speeds v of symdyn's equations follow from those of SymPy's, u, by the rates of the coordinates: v = Y u + y. With this in M v' +
b, b = k - F, the equations are Y^T M Y u' + Y^T (M (dY/dt u + dy/dt) + b), which are SymPy's M u' - f. Where SymPy's velocity
constraints leave independent speeds, u' = Z w + g, both are compared along Z, so that neither multipliers nor the choice of
constrained velocities in partial velocities count.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.exact.mechanism import BOUND, Claim, Proofs
from symdyn.exact.prove import decide
from symdyn.formulation.algebra import TapeAlgebra, given_by_time
from symdyn.formulation.by_hand.matrices import GivenMatrices, Recorded, at_random_states
from symdyn.formulation.constraints.null_space import elimination_order
from symdyn.formulation.constraints.sampled import Sampled
from symdyn.formulation.equations import Equations
from symdyn.formulation.square_systems import SquareSystem
from symdyn.model.symbols import Speed
from symdyn.spatial.vectors import congruence, vector, zeros
from symdyn.sympy_mechanics.border import given_matrices
from symdyn.sympy_mechanics.options import Options
from symdyn.tape.differentiate import forward, jacobian
from symdyn.tape.node import SPEED, Node
from symdyn.tape.passes import substitute
from symdyn.tape.tape import reachable

if TYPE_CHECKING:
    from symdyn.sympy_mechanics.border import Derived


def prove_same(equations: Equations, others: Derived, bound: int = BOUND) -> Proofs:
    """Decide whether equations are those that SymPy has derived, for every state.

    bound   terms that a product may have; claims that need more are undecided where no state refutes them
    Coordinates, inputs and parameters are the same by name. Raises ArgumentError for other coordinates and for equations without
    a mass matrix, and what from_sympy raises.
    """
    given = given_matrices(others, Options("compared"))
    both = _Both(equations, given)
    theirs = {leaf: Speed(u.name) for leaf, u in zip(both.u, given.symbols.speeds, strict=True)}
    symbols = {**equations.printed_leaves(), **theirs}
    units = [[equations.leaves[p] for p in group] for group in equations.unit_groups]
    recorder = equations.recorder
    claims = [Claim(name, decide(recorder, pairs, symbols, columns, units, bound))
              for name, pairs, columns in both.claims() if pairs]
    return Proofs(f"{equations.name}, {equations.formulation} and SymPy's {given.formulation}", tuple(claims))


class _Both:
    """Both equations on the tape of the first, in the speeds of SymPy's."""

    def __init__(self, equations: Equations, given: GivenMatrices) -> None:
        self.equations, self.given, self.recorder = equations, given, equations.recorder
        names = [q.name for q in equations.symbols.coordinates]
        own = [q.name for q in given.symbols.coordinates]
        if sorted(names) != sorted(own) and not set(own) <= set(names):
            raise ArgumentError(f"{equations.name} has the coordinates {', '.join(names)}, SymPy's equations {', '.join(own)}; "
                                f"give both the same names")
        if not all(name in equations.quantities for name in ("M_tilde", "bias", "N", "rates")):
            raise ArgumentError(f"{equations.name} ({equations.formulation}) has no mass matrix to compare")
        taken = Recorded(given)
        self.u = [self.recorder.leaf(f"(SymPy's {u.name})", SPEED) for u in given.symbols.speeds]
        there = {leaf.args[1]: leaf for leaf in equations.leaves.values() if isinstance(leaf, Node) and leaf.op == "leaf"}
        self._leaves = {**there, **{u.name: leaf for u, leaf in zip(given.symbols.speeds, self.u, strict=True)}}
        self.M, self.f = self._moved(taken.M), self._moved(taken.f)
        self.rates = dict(zip(own, self._moved(vector(*taken.rates)), strict=True))
        self.rows = np.array([self._moved(r.jacobian) for r in taken.rows if not r.holonomic], dtype=object)
        self.values = self._moved(vector(*[r.value if r.holonomic else r.rate for r in taken.rows]))
        self.remaining = self._moved(vector(*[r.remaining for r in taken.rows if not r.holonomic]))
        self._into_speeds(names)

    def _moved(self, values: np.ndarray) -> np.ndarray:
        """Entries of SymPy's equations on the tape of the others."""
        entries = tuple(values.ravel())
        leaves = {leaf: self._leaves.get(leaf.args[1]) or self.recorder.leaf(leaf.args[1], leaf.args[0])
                  for leaf in reachable([e for e in entries if isinstance(e, Node)]) if leaf.op == "leaf"}
        result = np.empty(len(entries), dtype=object)
        result[:] = substitute(entries, leaves, self.recorder)
        return result.reshape(values.shape)

    def _into_speeds(self, names: Sequence[str]) -> None:
        """The speeds of symdyn's equations in terms of SymPy's, and their change."""
        eq, recorder = self.equations, self.recorder
        v = [eq.leaves[s] for s in eq.symbols.speeds]
        N, rates = eq.quantity("N"), eq.quantity("rates")
        rest = vector(*substitute(tuple(rates), dict.fromkeys(v, 0), recorder))
        known = [k for k, name in enumerate(names) if name in self.rates]
        right = vector(*[self.rates[names[k]] - rest[k] for k in known])
        algebra = TapeAlgebra(recorder, dict(eq.leaves))
        used = self._rows_that_determine(algebra, N[known])
        if used is None:
            raise ArgumentError(f"{eq.name}: the rates of the coordinates of SymPy's equations do not determine the speeds "
                                f"{', '.join(map(str, eq.symbols.speeds))}; compare equations of the same coordinates")
        result = SquareSystem(algebra, N[known][used], "the speeds do not follow from each other here").solve(right[used])
        self.v = dict(zip(v, result, strict=True))
        self.left = [(a, b) for a, b in zip(self.in_u(rates[known]), [self.rates[names[k]] for k in known], strict=True)]
        q = {eq.leaves[s]: self.rates[s.name] for s in eq.symbols.coordinates if s.name in self.rates}
        self.by_time = {**q, **given_by_time(eq.leaves)}
        speeds = list(result)
        self.Y = jacobian(recorder, speeds, self.u, "forward")
        self.change = vector(*forward(recorder, speeds, self.by_time))

    def _rows_that_determine(self, algebra: TapeAlgebra, N: np.ndarray) -> list[int] | None:
        n = N.shape[1]
        if N.shape[0] == n:
            return list(range(n))
        sample = at_random_states(algebra, self.equations.symbols, 1, N=N)["N"][0]
        order = elimination_order(Sampled.of(sample.T[np.newaxis]))
        return None if order is None or len(order) < n else sorted(column for _, column in order)

    def in_u(self, values: np.ndarray) -> np.ndarray:
        """Quantities of symdyn's equations in the speeds of SymPy's."""
        result = np.empty(values.size, dtype=object)
        result[:] = substitute(tuple(values.ravel()), self.v, self.recorder)
        return result.reshape(values.shape)

    def claims(self) -> list[tuple[str, list[tuple[Any, Any]], int]]:
        """Claims of equality: name, pairs, columns."""
        eq, Y = self.equations, self.Y
        M, bias = self.in_u(eq.quantity("M_tilde")), self.in_u(eq.quantity("bias"))
        mass, force = congruence(M, Y), -(Y.T @ (M @ self.change + bias))
        own, right = self.M, self.f
        what = "in SymPy's speeds"
        dependent = len(self.rows)
        if dependent and self.given.dependent:
            Z, g = self._along_constraints()
            force, right = Z.T @ (force - mass @ g), Z.T @ (right - own @ g)
            mass, own = congruence(mass, Z), congruence(own, Z)
            what = "along SymPy's independent speeds"
        n = len(mass)
        listed = [("rates of the coordinates are the same", [pair for pair in self.left if pair[0] is not pair[1]], 1),
                  (f"mass matrix {what} is the same", list(zip(mass.ravel(), own.ravel(), strict=True)), n),
                  (f"forces {what} are the same", list(zip(force, right, strict=True)), 1)]
        return listed + self._of_constraints()

    def _along_constraints(self) -> tuple[np.ndarray, np.ndarray]:
        """Z and g of u' = Z w + g, with the last speeds dependent."""
        m, n = self.rows.shape
        algebra = TapeAlgebra(self.recorder, dict(self.equations.leaves))
        solver = SquareSystem(algebra, self.rows[:, n - m:], "the dependent speeds do not follow here")
        Z, g = zeros(n, n - m), zeros(n)
        for k in range(n - m):
            Z[k, k] = 1
            Z[n - m:, k] = solver.solve(-self.rows[:, k])
        g[n - m:] = solver.solve(-self.remaining)
        return Z, g

    def _of_constraints(self) -> list[tuple[str, list[tuple[Any, Any]], int]]:
        """Constraints of symdyn's equations hold at the speeds of SymPy's: where these are independent as they are, else with the
        dependent ones in their places."""
        eq = self.equations
        if not eq.constraints:
            return []
        rates = self.in_u(eq.quantity("C_dot"))
        if len(self.rows):
            m, n = self.rows.shape
            Z, _ = self._along_constraints()
            rates = jacobian(self.recorder, list(rates), self.u, "forward") @ Z
            return [("constraints leave SymPy's independent speeds", [(e, 0) for e in rates.ravel()], n - m)]
        if len(self.values):
            own = eq.quantity("C")
            pairs = list(zip(own, self.values, strict=True)) if len(own) == len(self.values) else [(len(own), len(self.values))]
            return [("constraints are the same", pairs, 1)]
        return [("constraints hold at SymPy's speeds", [(e, 0) for e in rates], 1)]


