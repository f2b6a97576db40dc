"""Rates of change of what carries the speeds to the links: S_ring of every joint, D_dot of the whole tree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from symdyn.formulation.trees.tree import Tree
from symdyn.spatial.vectors import vector
from symdyn.tape.differentiate import forward


@dataclass(frozen=True)
class Rates:
    """S_ring   (6, k) for each link: rate of change of S as an observer on the link sees it, link axes
    D_dot    (n_w, n_u): rate of change of D in w = D u + w_t
    """

    S_ring: tuple[np.ndarray, ...]
    D_dot: np.ndarray


def apparent_rates(tree: Tree) -> Rates:
    """S_ring and D_dot along the motion of the tree, entry by entry: d/dt of an entry = sum over q of its partial times q_dot.

    On the link, components in link axes are what an observer sees, so that S_ring is the derivative of the components.
    """
    algebra = tree.algebra
    if hasattr(algebra, "apparent_rates"):  # numbers have no derivatives; they bring the rates along
        return algebra.apparent_rates  # type: ignore[no-any-return]
    arrays = [*[link.S for link in tree.links], tree.D]
    entries = [e for array in arrays for e in array.ravel()]
    rates = iter(forward(algebra.recorder, entries, algebra.by_time(tree.model.coordinates, tree.rates)))
    *S_ring, D_dot = [vector(*[next(rates) for _ in range(array.size)]).reshape(array.shape) for array in arrays]
    return Rates(tuple(S_ring), D_dot)
