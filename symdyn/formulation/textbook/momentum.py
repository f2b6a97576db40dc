"""Momenta of the whole mechanism, and its centre of mass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.errors import SymdynError
from symdyn.formulation.textbook.composite_bodies import composite_bodies
from symdyn.formulation.textbook.velocities import named, velocities
from symdyn.formulation.trees.tree import GROUND, Tree
from symdyn.spatial.sixvectors import mass_and_first_moment
from symdyn.spatial.vectors import cross, zeros
from symdyn.tape.node import is_zero


@dataclass(frozen=True)
class Momentum:
    """h     (6,) for each link with all outwards of it: [angular momentum about the link's origin; linear], link axes
    h_0   (6,) of everything: [angular momentum about the n-origin; linear momentum], n-frame, kg m^2/s and kg m/s
    h_G   (6,) the same about the centre of mass
    mass  kg, of all bodies; center (3,) their centre of mass, n-frame, m
    """

    h: tuple[np.ndarray, ...]
    h_0: np.ndarray
    h_G: np.ndarray
    mass: Any
    center: np.ndarray


def momentum(tree: Tree) -> Momentum:
    """Momenta are carried inwards as forces are: h_i = I_i v_i + sum of X* h_child; h_G = h_0 less r_G x linear momentum.

    Bodies held to the ground do not move, and count for the centre of mass. Raises SymdynError if there is no mass.
    """
    m = velocities(tree)
    h, h_0 = [I @ v for I, v in zip(m.I, m.v, strict=True)], zeros(6)
    for i, link in reversed(list(enumerate(tree.links))):
        with tree.algebra.section(f"link {link.name}: momentum of it and all outwards"):
            named(tree, i, h=h[i])
            if link.parent != GROUND:
                h[link.parent] = h[link.parent] + m.X_star[i] @ h[i]
            else:
                h_0 = h_0 + m.X_star[i] @ h[i]
    mass, first_moment = mass_and_first_moment(composite_bodies(tree).I_0)
    if is_zero(mass):
        raise SymdynError(f"{tree.model.name}: no body has a mass, so there is no centre of mass; give one a mass")
    with tree.algebra.section("centre of mass, and momenta about it"):
        center = first_moment / mass
        h_G = np.concatenate([h_0[:3] - cross(center, h_0[3:]), h_0[3:]])
    return Momentum(tuple(h), h_0, h_G, mass, center)
