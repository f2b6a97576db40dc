"""Kinetic energy, and potential energy of the weights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from symdyn.formulation.textbook.composite_bodies import composite_bodies
from symdyn.formulation.textbook.velocities import velocities
from symdyn.formulation.trees.tree import Tree
from symdyn.spatial.sixvectors import mass_and_first_moment
from symdyn.spatial.vectors import dot, inner


@dataclass(frozen=True)
class Energy:
    """T   for each link, J; kinetic: their sum; potential: of the weights, zero for a mass at the n-origin, J."""

    T: tuple[Any, ...]
    kinetic: Any
    potential: Any


def energy(tree: Tree) -> Energy:
    """T_i = v_i . I_i v_i / 2; V = -g . (sum of m r_G), the first moment of everything about the n-origin."""
    m = velocities(tree)
    with tree.algebra.section("energy, in spatial vectors"):
        T = [inner(v, I @ v) / 2 for v, I in zip(m.v, m.I, strict=True)]
        _, first_moment = mass_and_first_moment(composite_bodies(tree).I_0)
        potential = -dot(tree.algebra.constants(tree.model.gravity), first_moment)
        return Energy(tuple(T), sum(T), potential)
