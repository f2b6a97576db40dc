"""Divides a long sequence of steps into stretches, and finds slots in an array for what one stretch hands on to later ones."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from symdyn.tape.arrays import Arrays
from symdyn.tape.node import Node
from symdyn.tape.tape import unsigned

_SUMS = ("add", "sub")
Stretch = tuple[list[Node], list[Node]]


def divide(arrays: Arrays, body: Sequence[Node], entries: Sequence[Any], longest: int, before: Mapping[Node, int] | None = None,
           count: int = 0, later: Collection[Node] = ()) -> tuple[list[Stretch], dict[Node, int], int]:
    """Stretches of `body`, each with the nodes that later ones or the entries need; the slot of each such node; their number.

    arrays   of the tape whose steps these are
    A stretch ends with a section where it can, and has at most `longest` steps. A slot is used again once the last stretch
    that reads it is over. Entries are read by the last stretch; more than `longest` of them by empty stretches after all
    others, `longest` by each.

    before   slots of nodes that are there when the first stretch begins, among `count`
    later    nodes that are read after the last stretch, so that their slots are not used again
    """
    before = before or {}
    order = products_next_to_their_sums(arrays, arrays.indices(body), entries)
    stretches = stretches_of([arrays.steps[k] for k in order.tolist()], longest)
    begin = len(stretches) - 1
    if len(entries) > longest:
        begin += 1
        stretches += [[] for _ in range(0, len(entries), longest)]
    where = {**dict.fromkeys(before, -1), **{node: k for k, stretch in enumerate(stretches) for node in stretch}}
    last_use: dict[Node, int] = {}
    for k, stretch in enumerate(stretches):
        for node in stretch:
            for a in node.args:
                core = unsigned(a)
                if where.get(core, k) != k:
                    last_use[core] = k
    for index, e in enumerate(entries):
        core, reader = unsigned(e), begin + index // longest
        if where.get(core, reader) != reader:
            last_use[core] = reader
    last_use |= dict.fromkeys(later, len(stretches))
    over: dict[int, list[Node]] = {}
    for node, k in last_use.items():
        over.setdefault(k, []).append(node)
    slots = {node: slot for node, slot in before.items() if node in last_use}
    free = sorted(set(range(count)).difference(slots.values()), reverse=True)
    result: list[Stretch] = []
    for k, stretch in enumerate(stretches):
        kept = [node for node in stretch if node in last_use]
        for node in kept:
            if free:
                slots[node] = free.pop()
            else:
                slots[node], count = count, count + 1
        free += sorted((slots[node] for node in over.get(k, ())), reverse=True)
        result.append((stretch, kept))
    return result, slots, count


def products_next_to_their_sums(arrays: Arrays, body: np.ndarray, entries: Sequence[Any]) -> np.ndarray:
    """Indices of steps, ascending, with each product that only one sum needs just before that sum, so that both become one
    operation.

    body   indices of the steps that read others
    """
    inside = np.zeros(len(arrays.steps), dtype=bool)
    inside[body] = True
    alone = inside & arrays.does("mul") & (arrays.read_by(inside) == 1) & ~arrays.marked(map(unsigned, entries))
    # The numbers leave room behind each step for the two products that may come before the next one.
    order = 3 * np.arange(len(arrays.steps))
    reading = np.flatnonzero((inside & arrays.does(*_SUMS))[arrays.readers] & (arrays.cores >= 0))
    reading = reading[alone[arrays.cores[reading]]]
    reader = arrays.readers[reading]
    order[arrays.cores[reading]] = 3 * reader - 2 + reading - arrays.begins[reader]
    return body[np.argsort(order[body], kind="stable")]


def stretches_of(body: Sequence[Node], longest: int) -> list[list[Node]]:
    stretches: list[list[Node]] = [[]]
    for node in body:
        current = stretches[-1]
        ends = len(current) >= longest // 2 and current[-1].section != node.section
        if (ends or len(current) >= longest) and node.op != "item":  # what a call returns stays in its stretch
            stretches.append([])
        stretches[-1].append(node)
    return stretches
