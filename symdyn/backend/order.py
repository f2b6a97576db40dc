"""The order of statements: one in which few values wait for their uses, so that compilers keep them in registers.

The rounding of a statement does not depend on its position. Compilers keep the order of long functions more or less: the values
that wait are theirs to spill, and there are more of them the longer each waits.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Sequence
from typing import Any

from symdyn.backend.writer import cores_of
from symdyn.tape.node import Node


def few_waiting(body: Sequence[Node], entries: Sequence[Any], inlined: Collection[Node]) -> list[Node]:
    """The steps of `body`, each behind what it needs. The next statement, among those whose operands are there, is that
    after which the fewest values wait; of several, the one that the longest chain of steps begins with.

    entries   used after all of them
    inlined   steps that are written where they are used, which stand before the statement that they are written in
    """
    steps = set(body)
    merged: dict[Node, list[Node]] = {}  # of a statement, the steps that are written in it, in order
    needs: dict[Node, list[Node]] = {}
    for node in body:
        if node not in inlined:
            merged[node] = _written_in([node], steps, inlined)[:-1]
            needs[node] = list(dict.fromkeys(core for one in (*merged[node], node) for core in cores_of(one.args)
                                             if core in steps and core not in inlined))
    last = _written_in(cores_of(entries), steps, inlined)
    kept = {core for one in last for core in (one, *cores_of(one.args))}.intersection(needs)
    users: dict[Node, list[Node]] = {node: [] for node in needs}
    for node, operands in needs.items():
        for operand in operands:
            users[operand].append(node)
    chain: dict[Node, int] = {}
    for node in reversed(needs):
        chain[node] = 1 + len(merged[node]) + max((chain[user] for user in users[node]), default=0)
    left = {node: len(users[node]) + (node in kept) for node in needs}
    missing = {node: len(operands) for node, operands in needs.items()}
    index = {node: k for k, node in enumerate(needs)}

    def rank(node: Node) -> tuple[int, int, int]:
        return (left[node] > 0) - sum(left[operand] == 1 for operand in needs[node]), -chain[node], index[node]

    # A rank that has become lower since is there once more.
    heap = sorted((rank(node), index[node]) for node in needs if not missing[node])
    nodes, result, done = list(needs), list[Node](), set[Node]()
    while heap:
        node = nodes[heapq.heappop(heap)[1]]
        if node in done:
            continue
        done.add(node)
        result += [one for one in merged[node] if one not in done]
        done.update(merged[node])
        result.append(node)
        for operand in needs[node]:
            left[operand] -= 1
            if left[operand] == 1:  # its last user now frees it
                for user in users[operand]:
                    if user not in done and not missing[user]:
                        heapq.heappush(heap, (rank(user), index[user]))
        for user in users[node]:
            missing[user] -= 1
            if not missing[user]:
                heapq.heappush(heap, (rank(user), index[user]))
    return [*result, *(one for one in body if one not in done)]


def _written_in(nodes: Sequence[Node], steps: Collection[Node], inlined: Collection[Node]) -> list[Node]:
    """Nodes with the steps that are written in them, each behind what it needs."""
    result: dict[Node, None] = {}

    def visit(node: Node) -> None:
        for core in cores_of(node.args):
            if core in steps and core in inlined and core not in result:
                visit(core)
        result[node] = None

    for node in nodes:
        visit(node)
    return list(result)
