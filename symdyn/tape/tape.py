"""The tape: named outputs and, reached from them, the steps that compute them.

A tape never changes. Dead code is what its outputs do not reach; a pass returns a new tape.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from typing import Any

import numpy as np

from symdyn.tape.arrays import Arrays
from symdyn.tape.node import PARAMETER, Node
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.recorder import Recorder

# Nodes from which on a list with a place for each one recorded is faster than a set of those that were found.
MANY = 10_000


@dataclass(frozen=True)
class Output:
    """A scalar, vector or matrix of the tape: name, shape, entries in row-major order (nodes or numbers)."""

    name: str
    shape: tuple[int, ...]
    entries: tuple[Any, ...]

    @classmethod
    def of(cls, name: str, value: Any) -> Output:
        array = np.asarray(value, dtype=object)
        return cls(name, array.shape, tuple(array.ravel().tolist()))

    @cached_property
    def numbers(self) -> np.ndarray:
        """The entries as doubles, zeros in place of nodes, (n,)."""
        return np.array([0.0 if isinstance(e, Node) else float(e) for e in self.entries])

    @cached_property
    def nodes(self) -> tuple[tuple[int, Node], ...]:
        """Entries that are nodes, with their indices."""
        return tuple((k, e) for k, e in enumerate(self.entries) if isinstance(e, Node))

    def array(self) -> np.ndarray:
        result = np.empty(len(self.entries), dtype=object)
        result[:] = self.entries
        return result.reshape(self.shape)


@dataclass(frozen=True)
class Tape:
    """Straight-line code for `outputs`, recorded by `recorder`."""

    recorder: Recorder
    outputs: Mapping[str, Output]

    @classmethod
    def of(cls, recorder: Recorder, **values: Any) -> Tape:
        """A tape from arrays of nodes and numbers, by output name."""
        return cls(recorder, {name: Output.of(name, value) for name, value in values.items()})

    def prune(self, names: Iterable[str]) -> Tape:
        """Keep the named outputs only; what no other output needs is gone with them."""
        names = tuple(names)
        if names == tuple(self.outputs):
            return self  # with the steps that it has found
        missing = [n for n in names if n not in self.outputs]
        if missing:
            raise KeyError(f"the tape has no output {', '.join(missing)}; it has {', '.join(self.outputs)}")
        return Tape(self.recorder, {name: self.outputs[name] for name in names})

    def merge(self, other: Tape) -> Tape:
        """Outputs of both tapes of one recorder, sharing their common steps."""
        return Tape(self.recorder, {**self.outputs, **other.outputs})

    @cached_property
    def steps(self) -> tuple[Node, ...]:
        """Every node the outputs reach, arguments before use."""
        return reachable(entry for output in self.outputs.values() for entry in output.entries)

    @cached_property
    def arrays(self) -> Arrays:
        """The steps as arrays."""
        return Arrays(self.steps)

    @cached_property
    def inputs(self) -> tuple[Node, ...]:
        """The leaves that occur."""
        return tuple([node for node in self.steps if node.op == "leaf"])

    @cached_property
    def running(self) -> tuple[Node, ...]:
        """Steps that must be evaluated at every state: those that depend on more than parameters."""
        return self.arrays.chosen(self.arrays.running)

    @cached_property
    def prologue(self) -> tuple[Node, ...]:
        """Steps that depend on parameters only; they run once per simulation."""
        return self.arrays.chosen(self.arrays.prologue)

    @cached_property
    def hoisted(self) -> tuple[Node, ...]:
        """The results of the prologue that the running steps or the outputs use, in order of recording."""
        used: dict[Node, None] = {}
        for node in self.running:
            for a in node.args:
                core = unsigned(a)
                if isinstance(core, Node) and core.mask == PARAMETER and core.op != "leaf":
                    used[core] = None
        for output in self.outputs.values():
            for entry in output.entries:
                core = unsigned(entry)
                if isinstance(core, Node) and core.mask == PARAMETER and core.op != "leaf":
                    used[core] = None
        for node in self.prologue:
            if node in self.recorder.checks:
                used[node] = None
        return tuple(sorted(used, key=lambda n: n.index))

    def count(self) -> dict[str, int]:
        """Operations of one evaluation after hoisting, by kind; one each for + - * / sqrt sin cos."""
        return count_of(self.running)

    def count_prologue(self) -> dict[str, int]:
        """Operations of the prologue, which runs once per set of parameters."""
        return count_of(self.prologue)

    @property
    def operations(self) -> int:
        """The number of operations of one evaluation after hoisting."""
        return sum(self.count().values())

    def longest_chain(self) -> int:
        """Length of the longest chain of running operations that wait for each other."""
        arrays = self.arrays
        begins, cores = arrays.begins.tolist(), arrays.cores.tolist()
        depth = [0] * (len(self.steps) + 1)  # the last one is that of numbers
        for k in np.flatnonzero(arrays.running).tolist():
            below = 0
            for core in cores[begins[k]:begins[k + 1]]:
                if depth[core] > below:
                    below = depth[core]
            depth[k] = below + 1
        return max(depth)


def unsigned(value: Any) -> Any:
    """The value without its change of sign."""
    return value.args[0] if isinstance(value, Node) and value.op == "neg" else value


def reachable(entries: Iterable[Any]) -> tuple[Node, ...]:
    """Every node that the entries reach, in order of recording."""
    stack = [e for e in entries if isinstance(e, Node)]
    seen: set[Node] = set(stack)
    pop, push, see = stack.pop, stack.append, seen.add
    while stack:
        if len(seen) > MANY:
            return _reached_by_many(seen)
        for a in pop().args:
            if a not in seen and isinstance(a, Node):
                see(a)
                push(a)
    return tuple(sorted(seen, key=attrgetter("index")))


def _reached_by_many(nodes: Collection[Node]) -> tuple[Node, ...]:
    """The same for so many nodes that a list with a place for every node recorded takes half the time of a set."""
    places: list[Node | None] = [None] * (1 + max(node.index for node in nodes))
    for node in nodes:
        places[node.index] = node
    for reached in reversed(places):  # what is filled meanwhile comes later: arguments were recorded before
        if reached is not None:
            for a in reached.args:
                if isinstance(a, Node):
                    places[a.index] = a
    return tuple([node for node in places if node is not None])


def count_of(nodes: Iterable[Node]) -> dict[str, int]:
    """Operations of these steps, by kind."""
    nodes = list(nodes)
    counter: Counter[str] = Counter()
    for op, n in Counter([node.op for node in nodes]).items():
        counter[OPERATIONS[op].kind] += n
    if counter["intrinsic"]:
        counter["intrinsic"] = sum(node.args[0].operations for node in nodes if node.op == "call")
    counter.pop("free", None)
    return dict(sorted(counter.items()))
