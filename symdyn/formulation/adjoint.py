"""Derivatives of a weighted sum of the rates x_dot: its gradient, and the derivative of the gradient along a direction.

With weights w the sum is G = w^T x_dot. Its unknowns a (accelerations, multipliers) solve r(y, a) = 0, y being all arguments.
Both derivatives come from L(y, a, mu) = G(y, a) + mu^T r(y, a) with multipliers mu of the residual:

    dL/da = 0      gives mu, by the solver that is there, since dr/da is symmetric
    dG/dy total  = dL/dy

and along a direction dy the changes da and dmu follow from r = 0 and dL/da = 0, again by that solver. So the factorization is
differentiated neither once nor twice. Source: Griewank and Walther, Evaluating Derivatives, 2nd ed., sections 3.2 (adjoints) and
5.1 (second-order adjoints by forward over reverse); Bryson and Ho, Applied Optimal Control, section 2.2 (multipliers).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import SymdynError
from symdyn.formulation.names import ADJOINT, GROUPS, along_group
from symdyn.spatial.vectors import inner, vector
from symdyn.tape.differentiate import direction, forward, reverse
from symdyn.tape.node import ACCELERATION, SEED, Node
from symdyn.tape.passes import substitute
from symdyn.tape.tape import reachable

if TYPE_CHECKING:
    from symdyn.formulation.accelerations import Motion


class Adjoint:
    """Records the gradient of w^T x_dot by [x; inputs; parameters; t] and its derivatives along directions."""

    def __init__(self, motion: Motion) -> None:
        self.motion = motion
        self.recorder = motion.algebra.recorder

    def quantities(self) -> dict[str, Callable[[], Any]]:
        """name -> function that records it."""
        return {ADJOINT: self.gradient, **{along_group(ADJOINT, group): partial(self.along, group) for group in GROUPS}}

    def gradient(self) -> np.ndarray:
        """Gradient of w^T x_dot by q, u, z, inputs, parameters and t, one after the other."""
        by_arguments, by_unknowns, _, mu = self._gradients()
        at = self._values(by_unknowns, mu)
        return vector(*substitute(tuple(by_arguments), at, self.recorder))

    def along(self, group: str) -> np.ndarray:
        """The derivative of the gradient along a direction in one group of arguments."""
        recorder, motion = self.recorder, self.motion
        by_arguments, by_unknowns, a, mu = self._gradients()
        at = self._values(by_unknowns, mu)
        with motion.algebra.section("derivative of the gradient along the direction"):
            seeds = direction(recorder, motion.groups()[group])
            da = dict(zip(a, [recorder.leaf(f"(da {k})", SEED) for k in range(len(a))], strict=True))
            dmu = dict(zip(mu, [recorder.leaf(f"(dmu {k})", SEED) for k in range(len(mu))], strict=True))
            change = motion.along(group)
            held = {**at, **dict(zip(da.values(), change, strict=True))}
            lacking = substitute(tuple(forward(recorder, by_unknowns, {**seeds, **da})), held, recorder)
            held |= dict(zip(dmu.values(), motion.solve_unknowns(-vector(*lacking)), strict=True))
            second = forward(recorder, by_arguments, {**seeds, **da, **dmu})
            return vector(*substitute(tuple(second), held, recorder))

    def _gradients(self) -> tuple[list[Any], list[Any], list[Any], list[Any]]:
        """dL/dy and dL/da, and the leaves of a and mu in them.

        Raises SymdynError where rates of states depend on multipliers or reactions.
        """
        motion, recorder = self.motion, self.recorder
        residual, at = motion.residual_of_unknowns()
        a = list(at)
        mu = [recorder.leaf(f"(mu {k})", SEED) for k in range(len(residual))]
        weights = [recorder.leaf(name, ACCELERATION) for name in weight_names(
            len(motion.rates) + len(motion.speeds) + len(motion.states))]
        with motion.accelerations_given():
            state_rates = motion.state_rates()
        solved = {value for value in at.values() if isinstance(value, Node) and value.op != "leaf"}
        if not solved.isdisjoint(reachable(state_rates)):
            raise SymdynError("a gradient of the weighted rates is requested, and the rate of a state depends on multipliers or "
                              "reactions; take it from the derivatives of the rates, module.jacobian")
        with motion.algebra.section("gradient of the weighted rates"):
            rates = [*motion.rates, *a[:len(motion.speeds)], *state_rates]
            leaves = [leaf for group in GROUPS for leaf in motion.groups()[group]]
            whole = reverse(recorder, inner(weights, rates) + inner(mu, residual), [*leaves, *a])
        return whole[:len(leaves)], whole[len(leaves):], a, mu

    def _values(self, by_unknowns: list[Any], mu: list[Any]) -> dict[Any, Any]:
        """The values of the leaves of a and mu: dL/da = 0 is linear in mu."""
        motion = self.motion
        at = dict(motion.residual_of_unknowns()[1])
        with motion.algebra.section("multipliers of the residual"):
            without = substitute(tuple(by_unknowns), {**at, **dict.fromkeys(mu, 0)}, self.recorder)
            return {**at, **dict(zip(mu, motion.solve_unknowns(-vector(*without)), strict=True))}


def weight_names(n: int) -> list[str]:
    """Names of the weights of n entries."""
    return [f"(weight {k + 1})" for k in range(n)]
