"""Generalized speeds that a joint has for its own, as propagation needs them."""

from __future__ import annotations

from symdyn.errors import SymdynError
from symdyn.formulation.trees.tree import Tree


def own_speeds(tree: Tree) -> list[list[int]]:
    """For each link the indices of the generalized speeds that move its joint and no other; empty for a given motion.

    Raises SymdynError for a speed that moves several joints (gears, absolute angles) or none: such joints cannot be released
    one after the other.
    """
    own: list[list[int]] = [[] for _ in tree.links]
    faults = []
    link_of = {row: i for i, link in enumerate(tree.links) for row in link.speeds}
    for j, (u, rows) in enumerate(zip(tree.model.speeds, tree.driven, strict=True)):
        moved = sorted({link_of[row] for row in rows})
        if len(moved) == 1:
            own[moved[0]].append(j)
        elif moved:
            joints = ", ".join(tree.links[i].joint.name for i in moved)
            faults.append(f"the speed {u} moves the joints {joints} together")
        else:
            faults.append(f"the speed {u} moves no joint")
    if faults:
        raise SymdynError(f"{tree.model.name}: propagation (articulated bodies) releases one joint after the other, but "
                          f"{'; '.join(faults)}; use the mass matrix by composite bodies for this mechanism")
    return own
