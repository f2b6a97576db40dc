"""Quantities for statics and linearization: their balance at given accelerations, and exact derivatives of it.

balance   [M_tilde u_dot + k_tilde - F_tilde + C_r^T lam; C; z_dot; C_dot; C_ddot; q_dot; q_ddot],
          (n_u + n_c + n_z + 2 n_c + 2 n_q,); C is 0 in the rows of velocity constraints. At rest all of it is zero; along any
          motion its derivative is all that linear equations on the manifold of the constraints consist of, rows that hold
          coordinates at a value included

Accelerations and multipliers are arguments, so that nothing is solved for and derivatives stay short. Derivatives of the balance
are directional: the direction is an argument, too, and one short function serves all of the state, the inputs and the parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.formulation.names import outputs_in
from symdyn.spatial.vectors import vector
from symdyn.tape import node as kinds
from symdyn.tape.differentiate import forward, jacobian
from symdyn.tape.node import Node

if TYPE_CHECKING:
    from symdyn.formulation.accelerations import Motion
    from symdyn.formulation.equations import Symbols

# Arguments of `variation` and `second_variation`, by what they stand for: first the state that varies, then the direction.
FIRST, DIRECTION = "vary", "along"


class Varied:
    """Records the balance of a formulation and its derivatives."""

    def __init__(self, motion: Motion) -> None:
        self.motion = motion
        self.algebra, self.recorder = motion.algebra, motion.algebra.recorder

    def quantities(self) -> dict[str, Callable[[], Any]]:
        """name -> function that records it."""
        return {"balance": self.balance,
                "stiffness": lambda: self.by(self.forces(), self._leaves(self.motion.coordinates)),
                "damping": lambda: self.by(self.forces(), self._leaves(self.motion.speeds)),
                "N_dot": lambda: self.motion.rate(self.motion.N()),
                "variation": self.variation, "second_variation": self.second_variation,
                "outputs_variation": self.outputs_variation,
                **({"input_matrix": self.input_matrix} if len(self.motion.inputs) else {})}

    def forces(self) -> np.ndarray:
        """M_tilde u_dot + k_tilde - F_tilde + C_r^T lam, (n_u,): with u_dot = 0 and lam = 0 what a rest state lacks."""
        rows = self.motion.rows
        tau = self.motion.inverse_dynamics()
        if not rows:
            return tau
        C_r = np.array([row.jacobian for row in rows], dtype=object).reshape(len(rows), len(tau))
        return tau + C_r.T @ vector(*self.multipliers())

    def multipliers(self) -> list[Any]:
        """Leaves of given multipliers."""
        return self._made(multiplier_names(len(self.motion.rows)))

    def statics(self) -> list[Any]:
        """The part of the balance that states of rest are found by: forces, constraints, rates of the extra states."""
        return [*self.forces(), *[row.value for row in self.motion.rows], *self.motion.state_rates()]

    def balance(self) -> np.ndarray:
        """See above."""
        motion = self.motion
        with self.algebra.section("balance of forces, constraints and rates of the extra states"):
            result = self.statics()
        with self.algebra.section("first and second derivatives by time of constraints and coordinates"):
            second = [sum((c * ud for c, ud in zip(row.jacobian, motion.speed_rates, strict=True)), row.remaining)
                      for row in motion.rows]
            by_time = {**motion.by_time(), **dict(zip(self._leaves(motion.speeds), motion.speed_rates, strict=True))}
            accelerations = forward(self.recorder, motion.rates, by_time)
            return vector(*result, *[row.rate for row in motion.rows], *second, *motion.rates, *accelerations)

    def by(self, values: np.ndarray, leaves: Sequence[Any]) -> np.ndarray:
        """Derivatives (len(values), len(leaves)); column by column: speeds and coordinates move what comes after them only."""
        with self.algebra.section("derivatives"):
            return jacobian(self.recorder, values.tolist(), leaves, "forward")

    def input_matrix(self) -> np.ndarray:
        """Derivative of the generalized forces F_tilde by the inputs, (n_u, n_in)."""
        return -self.by(self.motion.inverse_dynamics(), self._leaves(self.motion.inputs))

    def outputs(self) -> np.ndarray:
        """The user's outputs, one after the other, at given accelerations."""
        recorded = self.motion.quantities()
        with self.motion.accelerations_given():
            values = [np.asarray(recorded[name](), dtype=object).ravel() for name in outputs_in(recorded)]
        return np.concatenate(values) if values else vector()

    def variation(self) -> np.ndarray:
        """Derivative of the balance along a direction of [q; u; z; inputs; p; u_dot; lam], as long as the balance."""
        return self._along(self.balance(), self._direction())

    def outputs_variation(self) -> np.ndarray:
        """The same derivative of the outputs."""
        return self._along(self.outputs(), self._direction())

    def second_variation(self) -> np.ndarray:
        """The same derivative of the linear form of the balance's statics, their change with v (q' = N v), u', u_dot', z', lam',
        (n_u + n_c + n_z,)."""
        motion = self.motion
        names = _named([s.name for s in motion.speeds], [z.name for z, _ in motion.states], len(motion.rows))
        groups = {group: self._made(made) for group, made in names.items()}
        speeds = self._leaves(motion.speeds)
        with self.algebra.section("linear form of the balance"):
            moved = forward(self.recorder, motion.rates, dict(zip(speeds, groups["v"], strict=True)))
            seeds = {**dict(zip(self._leaves(motion.coordinates), moved, strict=True)),
                     **dict(zip(speeds, groups["u"], strict=True)),
                     **dict(zip(motion.speed_rates, groups["ud"], strict=True)),
                     **dict(zip(self._leaves([z for z, _ in motion.states]), groups["z"], strict=True)),
                     **dict(zip(self.multipliers(), groups["lam"], strict=True))}
            linear = forward(self.recorder, self.statics(), seeds)
        return self._along(vector(*linear), self._direction())

    def _direction(self) -> dict[Any, Any]:
        motion = self.motion
        moving = [*motion.coordinates, *motion.speeds, *[z for z, _ in motion.states], *motion.inputs, *motion.parameters]
        leaves = [*self._leaves(moving), *motion.speed_rates, *self.multipliers()]
        names = _along([s.name for s in moving], [s.name for s in motion.speeds], len(motion.rows))
        return dict(zip(leaves, self._made(names), strict=True))

    def _along(self, values: np.ndarray, seeds: Mapping[Node, Any]) -> np.ndarray:
        with self.algebra.section("derivative along the direction"):
            return vector(*forward(self.recorder, values.tolist(), seeds))

    def _made(self, names: Sequence[str]) -> list[Any]:
        return [self.recorder.leaf(name, kinds.ACCELERATION) for name in names]

    def _leaves(self, symbols: Sequence[sp.Symbol]) -> list[Any]:
        return [self.algebra.leaves[s] for s in symbols]


def multiplier_names(n_c: int) -> list[str]:
    """Names of given multipliers; no symbol can have them."""
    return [f"(lambda {k + 1})" for k in range(n_c)]


def variation_names(symbols: Symbols, n_c: int, second: bool) -> list[str]:
    """Names of what `variation`, or `second_variation`, takes in the group ud besides accelerations and multipliers."""
    moving = [*symbols.coordinates, *symbols.speeds, *symbols.states, *symbols.inputs, *symbols.parameters]
    varied = _named([s.name for s in symbols.speeds], [s.name for s in symbols.states], n_c) if second else {}
    return [*[name for group in varied.values() for name in group],
            *_along([s.name for s in moving], [s.name for s in symbols.speeds], n_c)]


def _named(speeds: Sequence[str], states: Sequence[str], n_c: int) -> dict[str, list[str]]:
    return {**{group: [f"({FIRST} {group} {u})" for u in speeds] for group in ("v", "u", "ud")},
            "z": [f"({FIRST} z {z})" for z in states], "lam": [f"({FIRST} {name})" for name in multiplier_names(n_c)]}


def _along(names: Sequence[str], speeds: Sequence[str], n_c: int) -> list[str]:
    return [f"({DIRECTION} {name})" for name in (*names, *[f"{u}_dot" for u in speeds], *multiplier_names(n_c))]
