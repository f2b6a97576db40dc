"""Steps that both sides of equalities have in common, taken as variables.

Two ways to one quantity often begin with the same steps. Sides that are equal for any values of what these compute are equal;
the other way round that need not be so, since relations between the steps are left out, such as that rows of a rotation are
orthogonal. Where it is so the normal forms are short, however long the steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from symdyn.tape.node import Node
from symdyn.tape.passes import substitute
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import reachable


def without_common_steps(pairs: Sequence[tuple[Any, Any]], differences: Sequence[Any]) -> tuple[list[Any], dict[Node, Node]]:
    """The differences of the sides, on a recorder of their own, with leaves for the last steps that the sides have in common;
    and the leaves there of leaves here.

    Sines and cosines stay, with their relation, and so do numbers such as roots."""
    left, right = ({*reachable(side)} for side in zip(*pairs))
    common = {node for node in left & right if node.op not in ("sin", "cos", "leaf") and node.mask}
    steps = reachable(differences)
    used = {a for node in steps if node not in common for a in node.args if isinstance(a, Node) and a in common}
    recorder = Recorder()
    taken = {node: recorder.leaf(f"step {node.index}", node.mask) for node in used}
    leaves = {leaf: recorder.leaf(leaf.args[1], leaf.args[0]) for leaf in steps if leaf.op == "leaf"}
    return list(substitute(tuple(differences), taken, recorder)), leaves
