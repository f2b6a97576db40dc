"""Identities of a mechanism, proved by exact algebra.

Each claim compares two ways to one quantity: matrices of composite bodies, the recursion of Newton and Euler, Lagrange's
equations from the kinetic energy, derivatives of positions and of constraints. Accelerations are symbols of their own, so that
the claims hold for every motion, not only for the one that the forces make.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.errors import UnsupportedExpression
from symdyn.exact.prove import Proof, decide, zero
from symdyn.exact.shortest import not_negative
from symdyn.formulation.algebra import given_by_time
from symdyn.formulation.equations import Equations
from symdyn.spatial.vectors import inner
from symdyn.tape.differentiate import forward
from symdyn.tape.node import ACCELERATION, SEED, is_zero
from symdyn.tape.tape import reachable

# Terms that a product may have in a proof: what is larger is left to verify().
BOUND = 100_000

# The same in proofs that verify() tries before it evaluates states.
QUICK = 10_000
# Accelerations of more speeds are quotients of longer polynomials than these.
SPEEDS = 6

# Pairs that are equal, and the columns of the matrix that they are the entries of (0: scalars, 1: a vector).
Pairs = tuple[list[tuple[Any, Any]], int]


@dataclass(frozen=True)
class Claim:
    """One identity and the verdict on it."""

    name: str
    proof: Proof


@dataclass(frozen=True, repr=False)
class Proofs:
    """The verdicts on all claims that apply to equations; prints as a table."""

    name: str
    claims: tuple[Claim, ...]

    @property
    def proved(self) -> bool:
        """Whether all claims are proved."""
        return all(claim.proof.proved for claim in self.claims)

    @property
    def refuted(self) -> bool:
        """Whether a claim is refuted."""
        return any(claim.proof.refuted for claim in self.claims)

    def __str__(self) -> str:
        lines = [f"{self.name}: identities by exact algebra"]
        for claim in self.claims:
            proof = claim.proof
            place = "" if proof.index is None else f"entry {list(proof.index)}: "
            lines.append(f"  {proof.verdict:10}{claim.name}{f'  ({place}{proof.reason})' if proof.reason else ''}")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)


def prove_equations(equations: Equations, bound: int = BOUND) -> Proofs:
    """Decide the identities that apply to the equations.

    bound   terms that a product may have; claims that need more are undecided where no state refutes them"""
    own = _Quantities(equations)
    symbols = equations.printed_leaves()
    units = [[equations.leaves[p] for p in group] for group in equations.unit_groups]
    claims = []
    for name, pairs_of in CLAIMS:
        result = pairs_of(own)
        if result is not None:
            pairs, columns = result
            claims.append(Claim(name, decide(equations.recorder, pairs, symbols, columns, units, bound)))
    return Proofs(f"{equations.name} ({equations.formulation})", tuple(claims))


class _Quantities:
    """Quantities of equations as nodes, and derivatives along the motion with free accelerations."""

    def __init__(self, equations: Equations) -> None:
        self.equations = equations
        self.recorder = equations.recorder
        self.q = [equations.leaves[q] for q in equations.symbols.coordinates]
        self.u = [equations.leaves[u] for u in equations.symbols.speeds]
        self.ud = np.array([self.recorder.leaf(f"{u.name}_dot", ACCELERATION) for u in equations.symbols.speeds], dtype=object)

    def has(self, *names: str) -> bool:
        return all(name in self.equations.quantities for name in names)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.equations.quantity(name)

    def rate(self, values: Any, accelerating: bool = True, by_time: bool = True) -> list[Any]:
        """Derivatives by time: positions move with the speeds, speeds with free accelerations."""
        seeds = dict(zip(self.q, self["rates"], strict=True)) if self.q else {}
        if accelerating:
            seeds.update(zip(self.u, self.ud, strict=True))
        if by_time:
            seeds.update(given_by_time(self.equations.leaves))
        for node in reachable(values):
            if node in self.recorder.slopes:
                slopes, by = zip(*self.recorder.slopes[node])
                seeds[node] = sum(slope * rate for slope, rate in zip(slopes, forward(self.recorder, by, seeds)))
        return forward(self.recorder, list(values), seeds)

    def by(self, entries: list[Any], leaf: Any) -> list[Any]:
        """Partial derivatives by a leaf."""
        return forward(self.recorder, entries, {leaf: 1})

    @property
    def inertial(self) -> np.ndarray:
        """M_tilde u_dot + k_tilde."""
        return self["M_tilde"] @ self.ud + self["k_tilde"]

    @property
    def plain(self) -> bool:
        """Whether every speed is the derivative of the coordinate in its place."""
        return len(self.q) == len(self.u) and all(a is b for a, b in zip(self["rates"].ravel(), self.u))

    @property
    def moved(self) -> bool:
        """Whether a body moves without speeds."""
        rates = forward(self.recorder, self["positions"].ravel().tolist(), given_by_time(self.equations.leaves)) \
            if self.has("positions") else []
        return not all(map(is_zero, rates))

    @property
    def driven(self) -> bool:
        """Whether something moves without speeds, a body or a constraint."""
        return self.moved or not all(map(is_zero, self["C_t"] if self.has("C_t") else []))


def _symmetric(s: _Quantities) -> Pairs | None:
    if not s.has("M_tilde"):
        return None
    M = s["M_tilde"]
    return list(zip(M.ravel(), M.T.ravel())), len(M)


def _newton_euler(s: _Quantities) -> Pairs | None:
    if not s.has("M_tilde", "k_tilde", "F_tilde", "inverse_dynamics") or s.equations.implicit_loads:
        return None
    return list(zip(s["inverse_dynamics"], s.inertial - s["F_tilde"])), 1


def _bias(s: _Quantities) -> Pairs | None:
    if not s.has("bias", "k_tilde", "F_tilde"):
        return None
    return list(zip(s["bias"], s["k_tilde"] - s["F_tilde"])), 1


def _lagrange(s: _Quantities) -> Pairs | None:
    if not s.has("energy", "M_tilde", "k_tilde", "rates") or not s.plain or not s.q:
        return None
    T = s["energy"].ravel()[0]
    momenta = [s.by([T], u)[0] for u in s.u]
    left = [rate - s.by([T], q)[0] for rate, q in zip(s.rate(momenta), s.q)]
    return list(zip(left, s.inertial)), 1


def _hessian(s: _Quantities) -> Pairs | None:
    if not s.has("energy", "M_tilde"):
        return None
    T = s["energy"].ravel()[0]
    rows = [s.by([s.by([T], a)[0] for a in s.u], b) for b in s.u]
    return [(x, y) for row, own in zip(rows, s["M_tilde"]) for x, y in zip(row, own)], len(s.u)


def _energy(s: _Quantities) -> Pairs | None:
    """For any accelerations, what they need beyond the loads adds its power."""
    if not s.has("energy", "power", "rates", "inverse_dynamics") or s.driven or s.equations.implicit_loads:
        return None
    rate: Any = sum(s.rate(s["energy"].ravel()))
    return [(rate, s["power"].ravel()[0] + inner(np.array(s.u, dtype=object), s["inverse_dynamics"]))], 0


def _energy_on_constraints(s: _Quantities) -> Pairs | None:
    """On C_dot = 0 and M_tilde u_dot + k_tilde + C_r^T lam = F_tilde, for any multipliers: the rate less the power is the sum of
    u_k times the k-th equation less lam_i times the i-th rate, which vanish there."""
    if not s.has("energy", "power", "rates", "inverse_dynamics", "C_r", "C_t", "C_dot", "lam") or not s.equations.constraints:
        return None
    if s.moved or s.equations.implicit_loads:
        return None
    lam = np.array([s.recorder.leaf(f"lam{k + 1}", SEED) for k in range(len(s.equations.constraints))], dtype=object)
    rate: Any = sum(s.rate(s["energy"].ravel()))
    # The power holds that of moving constraints with the multipliers of the motion that the loads make.
    power = s["power"].ravel()[0] + (inner(lam - s["lam"], s["C_t"]) if s.driven else 0)
    left = inner(np.array(s.u, dtype=object), s["inverse_dynamics"] + s["C_r"].T @ lam) - inner(lam, s["C_dot"])
    return [(rate, power + left)], 0


def _solved(s: _Quantities) -> Pairs | None:
    """Equations that are solved for the accelerations."""
    if not s.has("M_tilde", "k_tilde", "F_tilde", "accelerations") or s.equations.implicit_loads or len(s.u) > SPEEDS:
        return None
    left = s["M_tilde"] @ s["accelerations"] + s["k_tilde"]
    if s.equations.constraints:
        left = left + s["C_r"].T @ s["lam"]
    return list(zip(left, s["F_tilde"])), 1


def _constraints_fulfilled(s: _Quantities) -> Pairs | None:
    if not s.has("C_r", "F_d", "accelerations") or not s.equations.constraints or len(s.u) > SPEEDS:
        return None
    return list(zip(s["C_r"] @ s["accelerations"], s["F_d"])), 1


def _jacobian(s: _Quantities) -> Pairs | None:
    """J u = rate of positions; rotations turn with it: R_dot = omega x R."""
    if not s.has("J", "rates", "positions", "frames"):
        return None
    rows = 3 if s.equations.planar else 6
    J = s["J"].reshape(-1, rows, len(s.u)) @ np.array(s.u, dtype=object)
    positions, frames = s["positions"], s["frames"]
    v = np.array(s.rate(positions.ravel(), by_time=False), dtype=object).reshape(positions.shape)
    turned = np.array(s.rate(frames.ravel(), by_time=False), dtype=object).reshape(frames.shape)
    pairs: list[tuple[Any, Any]] = []
    for k in range(len(positions)):
        omega = [0, 0, J[k, 2]] if rows == 3 else list(J[k, 3:])
        pairs += zip(v[k][:2] if rows == 3 else v[k], J[k, :rows - 1] if rows == 3 else J[k, :3])
        R, R_dot = frames[k, 3:].reshape(3, 3), turned[k, 3:].reshape(3, 3)
        x, y, z = omega
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=object)
        pairs += zip(R_dot.ravel(), (cross @ R).ravel())
    return pairs, 1


def _coriolis(s: _Quantities) -> Pairs | None:
    if not s.has("coriolis", "k_tilde"):
        return None
    return list(zip(s["coriolis"] @ np.array(s.u, dtype=object), s["k_tilde"])), 1


def _skew(s: _Quantities) -> Pairs | None:
    if not s.has("coriolis", "M_tilde", "rates"):
        return None
    M, C = s["M_tilde"], s["coriolis"]
    rate = s.rate(M.ravel(), accelerating=False, by_time=False)
    return list(zip(rate, (C + C.T).ravel())), len(M)


def _constraint_rates(s: _Quantities) -> Pairs | None:
    rows = [k for k, holonomic in enumerate(s.equations.holonomic) if holonomic]
    if not rows or not s.has("C", "C_dot"):
        return None
    return list(zip(s.rate(s["C"][rows]), s["C_dot"][rows])), 1


def _constraint_jacobian(s: _Quantities) -> Pairs | None:
    if not s.has("C_dot", "C_r") or not s.equations.constraints:
        return None
    columns = [s.by(s["C_dot"].tolist(), u) for u in s.u]
    return [(columns[j][i], s["C_r"][i, j]) for i in range(len(s["C_dot"])) for j in range(len(s.u))], len(s.u)


def _constraint_parts(s: _Quantities) -> Pairs | None:
    if not s.has("C_dot", "C_r", "C_t") or not s.equations.constraints:
        return None
    return list(zip(s["C_dot"], s["C_r"] @ np.array(s.u, dtype=object) + s["C_t"])), 1


def _constraint_accelerations(s: _Quantities) -> Pairs | None:
    """d C_dot / dt = C_r u_dot - F_d for any accelerations."""
    if not s.has("C_dot", "C_r", "F_d") or not s.equations.constraints:
        return None
    return list(zip(s.rate(s["C_dot"]), s["C_r"] @ s.ud - s["F_d"])), 1


def proved_quickly(equations: Equations, names: Collection[str]) -> set[str]:
    """Claims that exact algebra proves with products of up to QUICK terms, whatever machine it runs on."""
    own = _Quantities(equations)
    units = [[equations.leaves[p] for p in group] for group in equations.unit_groups]
    positive = not_negative(equations.printed_leaves())
    proved = set()
    for name, pairs_of in (*CLAIMS, *SOLUTIONS):
        try:
            result = pairs_of(own) if name in names else None
            if result is not None and zero(equations.recorder, result[0], QUICK, units, positive):
                proved.add(name)
        except UnsupportedExpression:  # such as the derivative of a function of the user without one
            continue
    return proved


POWER = "rate of energy is the power of loads and moving constraints, on C_dot = 0 with multipliers"
CLAIMS: tuple[tuple[str, Callable[[_Quantities], Pairs | None]], ...] = (
    ("M_tilde is symmetric", _symmetric),
    ("M_tilde is the second derivative of the kinetic energy by the speeds", _hessian),
    ("Newton-Euler: inverse dynamics is M_tilde u_dot + k_tilde - F_tilde", _newton_euler),
    ("the bias of the recursion is k_tilde - F_tilde", _bias),
    ("Lagrange: d/dt dT/du - dT/dq is M_tilde u_dot + k_tilde", _lagrange),
    ("rate of energy is the power of the loads", _energy),
    (POWER, _energy_on_constraints),
    ("J u is the rate of positions and rotations", _jacobian),
    ("Coriolis matrix times u is k_tilde", _coriolis),
    ("rate of M_tilde less twice the Coriolis matrix is skew", _skew),
    ("C_dot is the rate of C", _constraint_rates),
    ("C_dot is C_r u + C_t", _constraint_parts),
    ("C_r is the derivative of C_dot by the speeds", _constraint_jacobian),
    ("C_r u_dot - F_d is the rate of C_dot", _constraint_accelerations),
)

# Quotients of determinants, which are short for few speeds.
SOLUTIONS: tuple[tuple[str, Callable[[_Quantities], Pairs | None]], ...] = (
    ("the accelerations solve the equations of motion", _solved),
    ("the accelerations fulfil C_r u_dot = F_d", _constraints_fulfilled),
)
