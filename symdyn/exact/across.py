"""Equations of one mechanism that were derived separately, proved equal by exact algebra: embedding = recursive = augmented.

The steps of the second equations are recorded again on the tape of the first, with the same leaves. Quantities are then
compared entry by entry. Accelerations are quotients of determinants, and are not compared with each other: those of the second
equations must solve the first ones, which is the same where the mass matrix is regular, and far shorter.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.exact.mechanism import BOUND, Claim, Pairs, Proofs
from symdyn.exact.prove import decide
from symdyn.formulation.equations import Equations
from symdyn.tape.node import Node
from symdyn.tape.passes import substitute
from symdyn.tape.tape import reachable

# Quantities that mean the same in every formulation, in the order of the claims.
COMPARED = ("positions", "frames", "J", "M_tilde", "k_tilde", "F_tilde", "bias", "inverse_dynamics", "energy", "kinetic_energy",
            "power", "C", "C_dot", "C_t", "C_r", "F_d")


def prove_equal(first: Equations, second: Any, bound: int = BOUND) -> Proofs:
    """Decide whether two sets of equations are the same in every quantity that both have, for every state.

    bound   terms that a product may have; claims that need more are undecided where no state refutes them
    Raises ArgumentError for what is no set of equations, and for equations in other coordinates, speeds or constraints.
    """
    if not isinstance(second, Equations):
        raise ArgumentError(f"prove compares equations with other equations of the mechanism, found {second!r:.80}; pass what "
                            "system.embedding(), .augmented() or .recursive() returns")
    for what, own, others in (("coordinates", first.symbols.coordinates, second.symbols.coordinates),
                              ("speeds", first.symbols.speeds, second.symbols.speeds),
                              ("constraints", first.constraints, second.constraints)):
        names = [[str(getattr(s, "name", s)) for s in group] for group in (own, others)]
        if names[0] != names[1]:
            lists = ["; ".join(group) or "none" for group in names]
            raise ArgumentError(f"equations are compared in the same {what}, in the same order; the {first.formulation} ones "
                                f"have {lists[0]}, the {second.formulation} ones {lists[1]}")
    taken = _Taken(first, second)
    symbols = first.printed_leaves()
    units = [[first.leaves[p] for p in group] for group in first.unit_groups]
    claims = []
    for name, pairs_of in _claims(taken):
        pairs, columns = pairs_of()
        claims.append(Claim(name, decide(first.recorder, pairs, symbols, columns, units, bound)))
    return Proofs(f"{first.name}, {first.formulation} and {second.formulation}", tuple(claims))


class _Taken:
    """Quantities of both equations on the tape of the first."""

    def __init__(self, first: Equations, second: Equations) -> None:
        self.first, self.second = first, second
        self._leaves = {leaf.args[1]: leaf for leaf in first.leaves.values() if isinstance(leaf, Node) and leaf.op == "leaf"}

    def has(self, *names: str) -> bool:
        return all(name in eq.quantities for eq in (self.first, self.second) for name in names)

    def of_second(self, name: str) -> np.ndarray:
        """A quantity of the second equations on the tape of the first."""
        value = self.second.quantity(name)
        entries = tuple(value.ravel())
        leaves = {leaf: self._leaves[leaf.args[1]] for leaf in reachable(entries)
                  if leaf.op == "leaf" and leaf.args[1] in self._leaves}
        result = np.empty(len(entries), dtype=object)
        result[:] = substitute(entries, leaves, self.first.recorder)
        return result.reshape(value.shape)

    def both(self, name: str) -> Pairs:
        one, other = self.first.quantity(name), self.of_second(name)
        if one.shape != other.shape:
            raise ArgumentError(f"{name} of the {self.first.formulation} equations has the shape {one.shape}, of the "
                                f"{self.second.formulation} ones {other.shape}; compare equations of one mechanism")
        return list(zip(one.ravel(), other.ravel())), one.shape[-1] if one.ndim == 2 else min(one.ndim, 1)

    def solved(self) -> Pairs:
        """M_tilde u_dot + k_tilde of the first, with the accelerations of the second, and F_tilde."""
        M, k, F = (self.first.quantity(name) for name in ("M_tilde", "k_tilde", "F_tilde"))
        return list(zip(M @ self.of_second("accelerations") + k, F)), 1


def _claims(taken: _Taken) -> list[tuple[str, Callable[[], Pairs]]]:
    first, second = taken.first.formulation, taken.second.formulation
    result: list[tuple[str, Callable[[], Pairs]]] = [
        (f"{name} is the same", partial(taken.both, name)) for name in COMPARED if taken.has(name)]
    if not taken.first.constraints and taken.has("M_tilde", "k_tilde", "F_tilde") and taken.has("accelerations"):
        result.append((f"accelerations of the {second} equations solve the {first} ones", taken.solved))
    return result
