"""Exact derivatives by the chain rule over the assignments, forward and reverse.

Source: Griewank and Walther, Evaluating Derivatives, 2nd ed., chapters 3 (forward) and 3.2 (reverse).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from symdyn.shown import shown
from symdyn.tape.node import SEED, Node, is_zero
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import reachable

# A call with more values than this is differentiated along directions only: its derivatives one by one would be many.
MANY = 32


def forward(recorder: Recorder, entries: Sequence[Any], seeds: Mapping[Node, Any]) -> list[Any]:
    """The directional derivative of each entry along the seeds (node -> its derivative)."""
    tangent: dict[Any, Any] = {}
    for node in reachable(entries):
        if node in seeds:
            tangent[node] = seeds[node]
            continue
        if node.op == "item":
            tangent[node] = tangent[node.args[0]][node.args[1]] if node.args[0] in tangent else 0
            continue
        if node.op == "call":
            _call(recorder, node, tangent)
            continue
        moving = [k for k, a in enumerate(node.args) if isinstance(a, Node) and not is_zero(tangent.get(a, 0))]
        rule = OPERATIONS[node.op].partials if moving else None
        if rule is None:
            continue
        partials = rule(recorder, node, node.args)
        total: Any = 0
        for k in moving:
            total = total + partials[k] * tangent[node.args[k]]
        tangent[node] = total
    return [tangent.get(e, 0) if isinstance(e, Node) else 0 for e in entries]


def direction(recorder: Recorder, leaves: Sequence[Node]) -> dict[Node, Node]:
    """Leaves that stand for the entries of leaves in a direction: seeds of `forward`."""
    return {leaf: recorder.leaf(seed_name(leaf.args[1]), SEED) for leaf in leaves}


def seed_name(name: str) -> str:
    """The name of a leaf's entry in a direction; no symbol can have it."""
    return f"(change of {name})"


def _call(recorder: Recorder, node: Node, tangent: dict[Any, Any]) -> None:
    """The derivatives of a numeric algorithm's results, as a list, unless nothing in it moves."""
    intrinsic, *values = node.args
    changes = [tangent.get(v, 0) if isinstance(v, Node) else 0 for v in values]
    if not all(map(is_zero, changes)):
        results = [recorder.item(node, k) for k in range(intrinsic.n_out)]
        tangent[node] = intrinsic.tangents(recorder, values, results, changes)


def reverse(recorder: Recorder, entry: Any, by: Sequence[Node]) -> list[Any]:
    """The gradient of one entry by each node of `by`."""
    if not isinstance(entry, Node):
        return [0] * len(by)
    order = reachable([entry])
    if any(node.op == "call" and len(node.args) > MANY for node in order):
        return [forward(recorder, [entry], {node: 1})[0] for node in by]
    wanted = set(by)
    active: set[Node] = set()
    for node in order:
        if node in wanted or any(isinstance(a, Node) and a in active for a in node.args):
            active.add(node)
    adjoint: dict[Node, Any] = {entry: 1}
    for node in reversed(order):
        bar = adjoint.get(node, 0)
        if node not in active or node.op == "leaf":
            continue
        if node.op == "call":
            _back_through(recorder, node, active, adjoint)
            continue
        if is_zero(bar):
            continue
        if node.op == "item":
            continue  # its call looks for it
        rule = OPERATIONS[node.op].partials
        if rule is None:
            continue
        for a, partial in zip(node.args, rule(recorder, node, node.args), strict=True):
            if isinstance(a, Node) and a in active:
                adjoint[a] = adjoint.get(a, 0) + bar * partial
    return [adjoint.get(node, 0) for node in by]


def _back_through(recorder: Recorder, node: Node, active: set[Node], adjoint: dict[Node, Any]) -> None:
    """From the adjoints of a call's results to those of its values, by its derivatives one value at a time."""
    intrinsic, *values = node.args
    results = [recorder.item(node, k) for k in range(intrinsic.n_out)]
    bars = [adjoint.get(result, 0) for result in results]
    if all(map(is_zero, bars)):
        return
    for a in dict.fromkeys(v for v in values if isinstance(v, Node) and v in active):
        changes = [int(v is a) for v in values]
        for bar, slope in zip(bars, intrinsic.tangents(recorder, values, results, changes), strict=True):
            adjoint[a] = adjoint.get(a, 0) + bar * slope


def jacobian(recorder: Recorder, entries: Sequence[Any], by: Sequence[Node], mode: str = "auto") -> np.ndarray:
    """The matrix of derivatives d entries / d by, shape (len(entries), len(by)).

    mode   "forward" a column at a time, "reverse" a row at a time, "auto" the side with fewer passes
    """
    if mode == "auto":
        mode = "reverse" if len(entries) < len(by) else "forward"
    matrix = np.zeros((len(entries), len(by)), dtype=object)
    if mode == "forward":
        for j, node in enumerate(by):
            matrix[:, j] = forward(recorder, entries, {node: 1})
    elif mode == "reverse":
        for i, entry in enumerate(entries):
            matrix[i, :] = reverse(recorder, entry, by)
    else:
        raise ValueError(f"mode {shown(mode)} asked for; there are 'forward', 'reverse' and 'auto'")
    return matrix
