"""From M_tilde and k_tilde - F_tilde to accelerations, the right-hand side x_dot = f(t, x) and its exact Jacobian."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any, Protocol

import numpy as np
import sympy as sp

from symdyn.formulation.adjoint import Adjoint
from symdyn.formulation.algebra import TapeAlgebra, accelerations_of
from symdyn.formulation.linearization import Varied
from symdyn.formulation.names import along_group
from symdyn.formulation.sensitivities import Sensitive
from symdyn.formulation.trees.mass_matrix import factorize
from symdyn.model.symbols import time
from symdyn.spatial.vectors import vector
from symdyn.tape.differentiate import direction, forward, jacobian
from symdyn.tape.passes import substitute

# A residual that is zero, leaves in it that stand for unknowns with their values, and what solves for the change of u_dot.
Implicit = tuple[list[Any], dict[Any, Any], Callable[[np.ndarray], np.ndarray]]


class Solver(Protocol):
    """Gives the accelerations that forces along the speeds make, M_tilde^-1 right, (n_u,)."""

    def solve(self, right: np.ndarray) -> np.ndarray: ...


class Motion:
    """Common part of all formulations in independent speeds.

    A formulation adds `M_tilde`, `bias` (k_tilde - F_tilde) and `inverse_dynamics`; one that needs no mass matrix for the
    accelerations has its own `solver` and `accelerations`.
    remarks    speed -> what else to say where the mass matrix is singular along it
    rows       of constraints
    vanishing_pivots   indices of the speeds whose pivot of the mass matrix vanishes at some positions (see that probe)
    """

    rows: Sequence[Any] = ()
    vanishing_pivots: Collection[int] = ()

    def __init__(self, algebra: TapeAlgebra, coordinates: Sequence[sp.Symbol], speeds: Sequence[sp.Symbol],
                 rates: Sequence[Any], states: Sequence[tuple[sp.Symbol, sp.Expr]], inputs: Sequence[sp.Symbol],
                 parameters: Sequence[sp.Symbol], remarks: Mapping[sp.Symbol, str] | None = None) -> None:
        self.algebra = algebra
        self.coordinates, self.speeds, self.inputs, self.parameters = coordinates, speeds, inputs, parameters
        self.states = states
        self.remarks = remarks or {}
        self.rates = list(rates)
        self.speed_rates = vector(*accelerations_of(speeds, algebra.recorder, algebra.leaves))
        self._memory: dict[str, Any] = {}

    def quantities(self) -> dict[str, Callable[[], Any]]:
        """name -> function that records it."""
        recorded: dict[str, Callable[[], Any]] = {
            "M_tilde": self.M_tilde, "bias": self.bias, "inverse_dynamics": self.inverse_dynamics,
            "accelerations": self.accelerations, "rates": lambda: vector(*self.rates), "N": self.N, "rhs": self.rhs,
            "jacobian_x": lambda: self.jacobian(self.x()),
            "jacobian_inputs": lambda: self.jacobian(self._leaves(self.inputs)),
            "jacobian_params": lambda: self.jacobian(self._leaves(self.parameters)),
            "unknowns": self.unknowns, **{along_group("unknowns", group): partial(self.along, group) for group in self.groups()}}
        shared = ("M_tilde", "bias", "accelerations")
        return {**{name: partial(self.recall, name) if name in shared else record for name, record in recorded.items()},
                **Varied(self).quantities(), **Adjoint(self).quantities(), **Sensitive(self).quantities()}

    def M_tilde(self) -> np.ndarray:
        raise NotImplementedError

    def bias(self) -> np.ndarray:
        raise NotImplementedError

    def inverse_dynamics(self) -> np.ndarray:
        raise NotImplementedError

    def recall(self, name: str) -> Any:
        """A quantity that others build on, recorded once."""
        if name not in self._memory:
            self._memory[name] = getattr(self, name)()
        return self._memory[name]

    @contextmanager
    def accelerations_given(self) -> Iterator[None]:
        """While this lasts, what is recorded takes accelerations as arguments in place of those that the forces make."""
        kept = self._memory
        self._memory = {name: value for name, value in kept.items() if name != "all_reactions"}
        self._memory["accelerations"] = self.speed_rates
        try:
            yield
        finally:
            self._memory = kept

    def reasons(self) -> list[str]:
        """Reasons, speed by speed, for a pivot of the mass matrix that is not positive."""
        return [f"the mass matrix is not positive definite at {u}{self.remarks.get(u, '')}" for u in self.speeds]

    def sizes_of_pivots(self) -> Mapping[int, Any]:
        """Reference sizes of vanishing pivots by index; those left out are compared with their diagonal entries."""
        return {}

    def solver(self) -> Solver:
        """The mass matrix, factorized."""
        M = self.recall("M_tilde")
        with self.algebra.section("factors of the mass matrix, L^T D L"):
            least = dict.fromkeys(self.vanishing_pivots, self.algebra.rounding)
            return factorize(self.algebra, M, self.reasons(), least=least, sizes=self.sizes_of_pivots() if least else {})

    def accelerations(self) -> np.ndarray:
        """u_dot, (n_u,)."""
        solver, bias = self.recall("solver"), self.recall("bias")
        with self.algebra.section("accelerations: M_tilde u_dot = F_tilde - k_tilde"):
            return self.algebra.name("ud", solver.solve(-bias))

    def state_rates(self) -> list[Any]:
        """z_dot of the extra states."""
        with self.algebra.section("rates of the extra states"):
            return [self.expression(rate) for _, rate in self.states]

    def expression(self, e: sp.Expr) -> Any:
        """An expression, which may hold accelerations of points, multipliers and reactions."""
        return self.algebra.expression(e)

    def N(self) -> np.ndarray:
        """q_dot = N u + n_t, (n_q, n_u)."""
        return jacobian(self.algebra.recorder, self.rates, self._leaves(self.speeds), "forward")

    def rhs(self) -> np.ndarray:
        """x_dot for x = [q; u; z]."""
        return vector(*self.rates, *self.recall("accelerations"), *self.state_rates())

    def x(self) -> list[Any]:
        """The leaves of the state."""
        return self._leaves([*self.coordinates, *self.speeds, *[z for z, _ in self.states]])

    def by_time(self) -> dict[Any, Any]:
        """Seeds of the derivative by time at constant speeds."""
        return self.algebra.by_time(self.coordinates, self.rates)

    def rate(self, values: np.ndarray) -> np.ndarray:
        """Derivative by time at constant speeds, entry by entry."""
        rates = forward(self.algebra.recorder, values.ravel().tolist(), self.by_time())
        return vector(*rates).reshape(values.shape)

    def implicit(self) -> Implicit:
        """A residual r that is zero, leaves in it that stand for accelerations with their values, and the solver that gives the
        change of u_dot from -dr at constant leaves: here r = M_tilde u_dot + k_tilde - F_tilde."""
        ud, solver = self.recall("accelerations"), self.recall("solver")
        return self.inverse_dynamics().tolist(), dict(zip(self.speed_rates, ud, strict=True)), solver.solve

    def jacobian(self, by: Sequence[Any], implicit: Implicit | None = None) -> np.ndarray:
        """d x_dot / d by, exact.

        Accelerations are differentiated implicitly, so that the factorization is not differentiated: by `implicit` if given,
        else by self.implicit().
        """
        recorder = self.algebra.recorder
        self.recall("accelerations")  # under its own headings
        with self.algebra.section("Jacobian"):
            residual, at, solve = implicit or self.implicit()
            derivatives = jacobian(recorder, residual, by)
            derivatives = vector(*substitute(tuple(derivatives.ravel()), at, recorder)).reshape(derivatives.shape)
            columns = [solve(-derivatives[:, j]) for j in range(len(by))]
            middle = np.array(columns, dtype=object).T.reshape(len(self.speeds), len(by))
            top = jacobian(recorder, self.rates, by, "forward")
            bottom = jacobian(recorder, self.state_rates(), by, "forward")
            return np.vstack([top, middle, bottom])

    def unknowns(self) -> np.ndarray:
        """Unknowns of the equations: accelerations, and with constraints multipliers."""
        return self.recall("accelerations")  # type: ignore[no-any-return]

    def groups(self) -> dict[str, list[Any]]:
        """The leaves by which quantities are differentiated, by group of arguments."""
        states = [z for z, _ in self.states]
        held = {"q": self.coordinates, "u": self.speeds, "z": states, "inputs": self.inputs, "p": self.parameters, "t": [time]}
        return {group: self._leaves(symbols) for group, symbols in held.items()}

    def along(self, group: str) -> np.ndarray:
        """The derivative of the unknowns along a direction in one group of arguments; the direction is an argument, too.

        As in `jacobian` from the derivative of a residual, so that the factorization is not differentiated.
        """
        return self.solved_along(group, *self.residual_of_unknowns())

    def solved_along(self, group: str, residual: Sequence[Any], at: Mapping[Any, Any]) -> np.ndarray:
        """The change of the unknowns that keeps a residual at zero along a direction; at: the values of the unknowns."""
        recorder = self.algebra.recorder
        with self.algebra.section("derivative along the direction"):
            change = forward(recorder, residual, direction(recorder, self.groups()[group]))
            return self.solve_unknowns(-vector(*substitute(tuple(change), at, recorder)))

    def residual_of_unknowns(self) -> tuple[list[Any], dict[Any, Any]]:
        """A residual that is zero, and the leaves in it that stand for the unknowns, in their order, with their values."""
        residual, at, _ = self.implicit()
        return residual, at

    def solve_unknowns(self, right: np.ndarray) -> np.ndarray:
        """The change of the unknowns that changes the residual by `right`; its matrix is symmetric."""
        return self.recall("solver").solve(right)  # type: ignore[no-any-return]

    def _leaves(self, symbols: Sequence[sp.Symbol]) -> list[Any]:
        return [self.algebra.leaves[s] for s in symbols]
