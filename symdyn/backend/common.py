"""Steps that several long functions have in common, such as the factors of the equations that give accelerations and corrections:
they are written once, as a function that the others call first."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any

from symdyn.backend.function import Function
from symdyn.backend.writer import cores_of
from symdyn.tape.node import Node


@dataclass(frozen=True)
class Beginning:
    """The beginning of a function, which it has in common with others.

    calls   functions that it calls, in this order
    slots   what these compute and the function reads: node -> index in w; n_w: size of w
    done    all steps that they take
    """

    calls: tuple[Function, ...] = ()
    slots: Mapping[Node, int] = field(default_factory=dict)
    n_w: int = 0
    done: frozenset[Node] = frozenset()


def most_in_common(bodies: Mapping[str, Sequence[Node]],
                   checks: Mapping[str, Mapping[Node, str]]) -> tuple[tuple[str, ...], list[Node]]:
    """The functions that save the most statements where what they have in common is written once, and these steps.

    bodies   steps of functions by name, arguments before use; checks: what must be positive in each
    A step that only some of the functions check, with what is computed from it, is in common to these alone.
    """
    functions: dict[Node, int] = {}
    checked: dict[Node, int] = {}
    for k, (name, body) in enumerate(bodies.items()):
        for node in body:
            functions[node] = functions.get(node, 0) | 1 << k
        for node in checks[name]:
            checked[node] = checked.get(node, 0) | 1 << k
    for node in sorted(functions, key=attrgetter("index")):
        held = functions[node] & checked.get(node, -1)
        for core in cores_of(node.args):
            held &= functions.get(core, -1)
        functions[node] = held
    counts = Counter(functions.values())

    def statements(held: int) -> int:
        """The number that is saved, where the functions are the bits of a number."""
        return (held.bit_count() - 1) * sum(n for other, n in counts.items() if other & held == held)

    best = max(counts, key=statements, default=0)
    names = tuple(name for k, name in enumerate(bodies) if best >> k & 1)
    return names, [node for node in bodies[names[0]] if functions[node] & best == best] if names else []


def saved(common: tuple[Sequence[str], Sequence[Node]]) -> int:
    """Statements that are not written again, of what functions have in common."""
    names, steps = common
    return max(0, len(names) - 1) * len(steps)


def read_later(bodies: Iterable[Sequence[Node]], entries: Iterable[Sequence[Any]], there: Iterable[Node]) -> set[Node]:
    """The nodes among those that are there which these steps and entries read."""
    read = {core for body in bodies for node in body for core in cores_of(node.args)}
    read.update(core for values in entries for core in cores_of(values))
    return read.intersection(there)
