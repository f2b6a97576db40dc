"""Quantities from which sensitivities of a motion are integrated: derivatives along a direction of what a run evaluates.

The direction is an argument, the leaves of `direction`: changes of [q; u; z; inputs; parameters]. The values that take the place
of these leaves (see symdyn.functions.sensitivities) decide how many columns there are, and of which sensitivities.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.formulation.algebra import given_by_time
from symdyn.formulation.linearization import DIRECTION
from symdyn.formulation.names import outputs_in, rate_of, variation_of
from symdyn.spatial.vectors import vector, zeros
from symdyn.tape import node as kinds
from symdyn.tape.differentiate import forward, jacobian
from symdyn.tape.node import is_zero
from symdyn.tape.passes import substitute

if TYPE_CHECKING:
    from symdyn.formulation.accelerations import Motion
    from symdyn.formulation.equations import Symbols


def direction_names(symbols: Symbols) -> list[str]:
    """Names of the leaves that stand for a direction of [q; u; z; inputs; parameters], in this order."""
    return [f"({DIRECTION} {s.name})" for s in (*symbols.coordinates, *symbols.speeds, *symbols.states, *symbols.inputs,
                                                *symbols.parameters)]


def indices_of_resets(symbols: Symbols | Motion, events: Sequence[Any]) -> list[int]:
    """Entries of [q; u] that events reset, in order."""
    reset = {symbol for event in events for symbol, _ in event.reset}
    return [k for k, symbol in enumerate((*symbols.coordinates, *symbols.speeds)) if symbol in reset]


def carried_names(speeds: Sequence[Any], held: int) -> list[str]:
    """Names of the leaves that stand for what resets make of speeds, see Sensitive.carried_variation: the jump of every speed,
    the impulse along every entry of [q; u] that events reset, `held` of them."""
    return [*[f"(jump of {u.name})" for u in speeds], *[f"(impulse {k + 1})" for k in range(held)]]


# The leaf that stands for the direction of t.
LATER = f"({DIRECTION} t)"


class Sensitive:
    """Records derivatives along a direction for a formulation in independent speeds.

    rhs_variation              of x_dot, (n_x,), accelerations implicitly: M_tilde u_dot' = -r', r the residual at these u_dot
    rhs_variation_by_matrix    the same with the derivatives of r as a matrix, which many directions share
    corrected_variation        the part [q; u] of the direction of what projection onto the constraints makes of a state that
                               fulfils them, (n_q + n_u,)
    events_rate, events_variation              of what vanishes at events, (n_e,): by the time alone, and along the direction
    outputs_sensitivity        of the user's outputs along the motion, one after the other
    event_resets_rate, event_resets_variation  of what events make of entries of the state, likewise
    """

    def __init__(self, motion: Motion) -> None:
        self.motion = motion
        self.algebra, self.recorder = motion.algebra, motion.algebra.recorder

    def quantities(self) -> dict[str, Callable[[], Any]]:
        """name -> function that records it."""
        recorded: dict[str, Callable[[], Any]] = {
            "rhs_variation": self.rhs_variation, "rhs_variation_by_matrix": lambda: self.rhs_variation(True),
            "corrected_variation": self.corrected_variation, "outputs_sensitivity": self.outputs_sensitivity}
        for name in ("events", "event_resets"):
            if hasattr(self.motion, name):
                recorded |= {rate_of(name): partial(self._by_time, name), variation_of(name): partial(self._of, name)}
        return recorded

    def direction(self) -> dict[Any, Any]:
        """Leaf of the state, an input or a parameter -> the leaf of its change."""
        motion = self.motion
        moving = [*motion.coordinates, *motion.speeds, *[z for z, _ in motion.states], *motion.inputs, *motion.parameters]
        return {self.algebra.leaves[s]: self.recorder.leaf(f"({DIRECTION} {s.name})", kinds.ACCELERATION) for s in moving}

    def rhs_variation(self, by_matrix: bool = False) -> np.ndarray:
        """See above."""
        motion, seeds = self.motion, self.direction()
        motion.recall("accelerations")  # under its own headings
        with self.algebra.section("sensitivities"):
            residual, at, solve = motion.implicit()
            if by_matrix:
                by = list(seeds)
                matrix = np.array(substitute(tuple(jacobian(self.recorder, residual, by, "forward").ravel()), at, self.recorder),
                                  dtype=object).reshape(len(residual), len(by))
                change = [sum((e * seeds[leaf] for e, leaf in zip(row, by, strict=True) if not is_zero(e)), 0) for row in matrix]
            else:
                change = list(substitute(tuple(forward(self.recorder, residual, seeds)), at, self.recorder))
            top = forward(self.recorder, motion.rates, seeds)
            return vector(*top, *solve(-vector(*change)), *forward(self.recorder, motion.state_rates(), seeds))

    def corrected_variation(self) -> np.ndarray:
        """See above. First coordinates, then speeds, as the projection does it."""
        motion, seeds = self.motion, self.direction()
        q, u = motion._leaves(motion.coordinates), motion._leaves(motion.speeds)
        if not motion.rows:
            return vector(*[seeds[leaf] for leaf in (*q, *u)])
        with self.algebra.section("projection of sensitivities"):
            saddle, none = motion.recall("corrector"), np.zeros(len(u), dtype=object)
            gaps = forward(self.recorder, [row.value for row in motion.rows], seeds)
            v = saddle.solve(none, -vector(*gaps))[0]
            moved = forward(self.recorder, motion.rates, dict(zip(u, v, strict=True)))
            seeds |= {leaf: seeds[leaf] + change for leaf, change in zip(q, moved, strict=True)}
            gaps = forward(self.recorder, [row.rate for row in motion.rows], seeds)
            changes = saddle.solve(none, -vector(*gaps))[0]
            return vector(*[seeds[leaf] for leaf in q], *[seeds[leaf] + change for leaf, change in zip(u, changes, strict=True)])

    def carried_variation(self, held: Sequence[int]) -> np.ndarray:
        """Derivative, (n_u,), of the speeds after a reset that the constraints carry on, along a direction of the coordinates
        after it, of the speeds that are wanted, of inputs, parameters and t, at given impulses along the speeds that are held.

        A reset wants u_w, and takes the nearest speeds in the metric of the mass matrix with those that are held as wanted:
        M (u - u_w) + C_r^T lam = E^T nu, C_r u + C_t = 0, E u = E u_w. With the jump J = u - u_w this is differentiated at
        constant nu; changes along `reset_directions` then take what is held to what is wanted. held: entries of [q; u] that
        events reset; impulses along coordinates do not count.
        """
        motion, recorder, seeds = self.motion, self.recorder, self.direction()
        names = carried_names(motion.speeds, len(held))
        given = [recorder.leaf(name, kinds.ACCELERATION) for name in names]
        jump, impulses = vector(*given[:len(motion.speeds)]), given[len(motion.speeds):]
        later = recorder.leaf(LATER, kinds.ACCELERATION)
        for leaf, rate in given_by_time(self.algebra.leaves).items():
            seeds[leaf] = seeds.get(leaf, 0) + rate * later
        saddle, M, C_r = motion.recall("corrector"), motion.recall("M_tilde"), motion.C_r()  # type: ignore[attr-defined]
        with self.algebra.section("sensitivities across resets"):
            along = zeros(len(jump))
            for k, impulse in zip(held, impulses, strict=True):
                if k >= len(motion.coordinates):
                    along[k - len(motion.coordinates)] = impulse
            lam = saddle.solve(along, C_r @ jump)[1]
            fixed = vector(*[recorder.leaf(f"lam{k + 1}", kinds.SEED) for k in range(len(lam))])
            change = substitute(tuple(forward(recorder, (M @ jump + C_r.T @ fixed).tolist(), seeds)),
                                dict(zip(fixed, lam, strict=True)), recorder)
            gaps = forward(recorder, [row.rate for row in motion.rows], seeds)
            moved = saddle.solve(-vector(*change), -vector(*gaps))[0]
            return vector(*[seeds[leaf] + e for leaf, e in zip(motion._leaves(motion.speeds), moved, strict=True)])

    def outputs_sensitivity(self) -> np.ndarray:
        """See above."""
        recorded = self.motion.quantities()
        values = [np.asarray(recorded[name](), dtype=object).ravel() for name in outputs_in(recorded)]
        return self._along(np.concatenate(values) if values else vector())

    def _of(self, name: str) -> np.ndarray:
        return self._along(getattr(self.motion, name)())

    def _along(self, values: np.ndarray) -> np.ndarray:
        with self.algebra.section("derivatives along sensitivities"):
            return vector(*forward(self.recorder, values.tolist(), self.direction()))

    def _by_time(self, name: str) -> np.ndarray:
        """The derivative by time at a given state."""
        values = getattr(self.motion, name)()
        with self.algebra.section("derivatives by time at a given state"):
            return vector(*forward(self.recorder, values.tolist(), given_by_time(self.algebra.leaves)))
