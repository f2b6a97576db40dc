"""Displacements and speeds that the constraints leave free, explicit in the parameters.

About a state with speeds u = u_0 the constraints of positions bind displacements, C_q eta' = 0; all of them bind speeds, of the
form A u + b = 0, whose change is A u' + (d/dq)(A u + b) eta' = 0. So eta' = Z_v eta, u' = Z_u zeta + Z_w eta and
eta_dot = E zeta + W eta, where eta and zeta are the changes of independent displacements and speeds. Without velocity constraints
E = 1 and W = 0.
Source: Neimark and Fufaev, Dynamics of Nonholonomic Systems, 1972, chapter III; for the elimination Bauchau, Flexible Multibody
Dynamics, 11.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.analytic.lagrange import Mechanics
from symdyn.analytic.minors import solve
from symdyn.errors import ArgumentError, SymdynError
from symdyn.exact.prove import drawn_state
from symdyn.spatial.vectors import zeros
from symdyn.tape.evaluate import evaluate
from symdyn.tape.intrinsics import RANK
from symdyn.tape.node import Node
from symdyn.tape.tape import Tape

if TYPE_CHECKING:
    from symdyn.formulation.equations import Equations

# Digits of the numbers by which dependent speeds are chosen.
DIGITS = 30


@dataclass(frozen=True, eq=False)
class Reduced:
    """Freedoms that the constraints leave.

    displacements, speeds   indices of the independent ones, of all speeds; dependent: of the speeds that the others determine
    Z_v (n_u, n_d), Z_u (n_u, n_s), Z_w (n_u, n_d), E (n_d, n_s), W (n_d, n_d)   see above
    """

    displacements: tuple[int, ...]
    speeds: tuple[int, ...]
    dependent: tuple[int, ...]
    Z_v: np.ndarray
    Z_u: np.ndarray
    Z_w: np.ndarray
    E: np.ndarray
    W: np.ndarray


def unconstrained(n_u: int, free: Sequence[int]) -> Reduced:
    """Without constraints everything that is not held is independent."""
    n = len(free)
    Z = zeros(n_u, n)
    for j, k in enumerate(free):
        Z[k, j] = 1
    return Reduced(tuple(free), tuple(free), (), Z, Z, zeros(n_u, n), np.eye(n, dtype=int).astype(object), zeros(n, n))


def reduced(equations: Equations, A: np.ndarray, A_q: np.ndarray, N: np.ndarray, free: Sequence[int],
            symbols: Mapping[Node, sp.Symbol], wanted: Sequence[int]) -> Reduced:
    """The reduction by A u + b = 0 at a state.

    A (n_c, n_u), A_q (n_c, n_q): derivatives of A u + b by speeds and coordinates; N (n_q, n_u): of the rates by the speeds;
    free: indices of speeds that are not held; symbols: of the parameters; wanted: indices of speeds that are to be independent
    Raises SymdynError where constraints depend on each other, ArgumentError where what is wanted is not independent.
    """
    choice = _Choice(equations, A, symbols, wanted)
    positions = [k for k, holonomic in enumerate(equations.holonomic) if holonomic]
    d_v = choice.more(positions, [], free)
    d = choice.more(range(len(A)), d_v, free)
    i_v, i_u = [k for k in free if k not in d_v], [k for k in free if k not in d]
    bound = [str(equations.symbols.speeds[k]) for k in wanted if k not in i_u]
    if bound:
        others = ", ".join(str(equations.symbols.speeds[k]) for k in i_u) or "none"
        raise ArgumentError(f"{equations.name}: coordinates are to be independent, but {', '.join(bound)} cannot be at this "
                            f"state; independent are {len(i_u)} speeds, such as {others}")
    Z_v, Z_u, Z_w = zeros(A.shape[1], len(i_v)), zeros(A.shape[1], len(i_u)), zeros(A.shape[1], len(i_v))
    if d_v:
        Z_v[d_v] = -solve(A[np.ix_(positions, d_v)], A[np.ix_(positions, i_v)])
    for j, k in enumerate(i_v):
        Z_v[k, j] = 1
    for j, k in enumerate(i_u):
        Z_u[k, j] = 1
    if d:
        moved = A_q @ N @ Z_v
        result = -solve(A[:, d], np.hstack([A[:, i_u], moved]))
        Z_u[d], Z_w[d] = result[:, :len(i_u)], result[:, len(i_u):]
    return Reduced(tuple(i_v), tuple(i_u), tuple(d), Z_v, Z_u, Z_w, Z_u[i_v], Z_w[i_v])


class _Choice:
    """Chooses dependent speeds, by numbers for the parameters."""

    def __init__(self, equations: Equations, A: np.ndarray, symbols: Mapping[Node, sp.Symbol], wanted: Sequence[int]) -> None:
        self.name, self.wanted = equations.name, wanted
        tape = Tape.of(Mechanics(equations).recorder, A=A)
        values = drawn_state(random.Random(5), tape.inputs, 0.2, symbols)
        numbers: Any = evaluate(tape, {leaf.args[1]: value for leaf, value in values.items()}, DIGITS)["A"]
        self.numbers = numbers.astype(float)

    def more(self, rows: Sequence[int], chosen: Sequence[int], free: Sequence[int]) -> list[int]:
        """With those chosen before, speeds whose columns in these rows are independent for parameters in general: the last ones
        first, those that are wanted as independent last."""
        numbers, result = self.numbers[list(rows)], list(chosen)
        for k in sorted(free, key=lambda k: (k in self.wanted, -k)):
            if k not in result and len(result) < len(numbers) and (
                    np.linalg.matrix_rank(numbers[:, [*result, k]], tol=RANK) > len(result)):
                result.append(k)
        if len(result) < len(numbers):
            held = " in the speeds that are not held" if len(free) < numbers.shape[1] else ""
            raise SymdynError(f"{self.name}: its {len(numbers)} constraints have rank {len(result)}{held} at the state, so that "
                              "the multipliers are not unique; leave out those that others imply (system.diagnose() names them), "
                              "or use module.linearize(at)")
        return sorted(result)
