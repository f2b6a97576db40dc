"""Sums in the order in which their terms are ready, so that fewer operations wait for each other.

a + b + c + d with d known last is worth (a + b + c) + d, and four terms known at once (a + b) + (c + d). The number of
operations stays; the longest chain, and with it the time of an evaluation, gets shorter: 5 to 10 % of the time of chains
of ten bodies.
"""

from __future__ import annotations

import heapq
from typing import Any

import numpy as np

from symdyn.tape.node import PARAMETER, Node
from symdyn.tape.passes import ARITHMETIC, rebuild
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Output, Tape, unsigned

# Time of an operation, in additions.
_LATENCY = {"add": 1, "sub": 1, "mul": 1, "div": 4, "sqrt": 5, "neg": 0}
_FUNCTION = 10
_SUMS = ("add", "sub")


def balance(tape: Tape) -> Tape:
    """The tape with its sums reordered, on a recorder of its own; sums that have a name or are used twice stay as they are.

    A right-hand side that is chosen by its balanced steps is emitted with them: what was balanced last is handed out once more.
    """
    recorder = tape.recorder
    asked = {name: o.entries for name, o in tape.outputs.items()}, len(recorder.names), len(recorder.checks)
    if recorder.balanced is not None and recorder.balanced[0] == asked:
        result: Tape = recorder.balanced[1]
        recorder.balanced = None
        return result
    balanced = _Balancer(tape).tape()
    recorder.balanced = asked, balanced
    return balanced


class _Timed(Recorder):
    """Also says when each node is ready, in `ready` by its index."""

    def __init__(self) -> None:
        super().__init__()
        self.ready: list[int] = []

    def _new(self, op: str, args: tuple, mask: int) -> Node:
        ready, time = self.ready, 0
        if mask & ~PARAMETER and op != "leaf":
            for a in args:
                if isinstance(a, Node) and ready[a.index] > time:
                    time = ready[a.index]
            time += _LATENCY.get(op, _FUNCTION)
        ready.append(time)
        return Node(self, op, args, next(self._numbers), mask, self._section)


class _Balancer:
    """Records the steps of a tape again.

    outer   of each step, whether it is a sum of more than two terms, (n,)
    inner   by its index, whether a node of the old tape is a sum within such a one; new: the value that it has become
    """

    def __init__(self, tape: Tape) -> None:
        self.old = tape
        self.recorder = _Timed()
        arrays = self.arrays = tape.arrays
        sums = _inner_sums(tape)
        within = np.flatnonzero(arrays.cores >= 0)
        outer = np.zeros(len(sums), dtype=bool)
        outer[arrays.readers[within[sums[arrays.cores[within]]]]] = True
        self.outer = outer & _free_sums(tape)
        size = tape.steps[-1].index + 1 if tape.steps else 0
        inner = np.zeros(size, dtype=bool)
        inner[[step.index for step in arrays.steps]] = sums
        self.inner: list[bool] = inner.tolist()
        self.new: list[Any] = [None] * size

    def tape(self) -> Tape:
        recorder, new, inner, arrays = self.recorder, self.new, self.inner, self.arrays
        ways = {op: getattr(recorder, op) for op in ARITHMETIC}
        names, checks = self.old.recorder.names, self.old.recorder.checks
        marked = arrays.marked(names) | arrays.marked(checks)
        section = recorder.heading
        for node, outer, noted in zip(arrays.steps, self.outer.tolist(), marked.tolist(), strict=True):
            op, args = node.op, node.args
            if inner[args[0].index if op == "neg" else node.index]:
                continue
            if node.section is not section:
                section = recorder.heading = node.section
            if outer:
                value: Any = self._sum(node)
            elif op in ways:
                value = ways[op](*[new[a.index] if isinstance(a, Node) else a for a in args])
            elif op == "leaf":
                value = recorder.leaf(args[1], args[0])
            else:
                value = rebuild(recorder, op, tuple(self._of(a) for a in args))
            new[node.index] = value
            if noted and isinstance(value, Node):
                if node in names:
                    recorder.name(names[node], value)
                if node in checks and op == "guard":
                    recorder.positive(unsigned(value), checks[node])
                elif node in checks:
                    new[node.index] = recorder.positive(value, checks[node])
        return Tape(recorder, {name: Output(name, o.shape, tuple(self._of(e) for e in o.entries))
                               for name, o in self.old.outputs.items()})

    def _of(self, value: Any) -> Any:
        return self.new[value.index] if isinstance(value, Node) else value

    def _sum(self, node: Node) -> Any:
        """The terms, two by two, those that are ready first."""
        r, ready = self.recorder, self.recorder.ready
        heap = self._terms(node)
        heapq.heapify(heap)
        count = len(heap)
        # The sign of a node is taken to that of its term, and the node that was recorded first stands first in a difference: it
        # would be recorded so with a sign that moves outwards again. With numbers among the terms, signs stay where they are.
        nodes_only = all(isinstance(term, Node) for *_, term in heap)
        while len(heap) > 1:
            (_, _, sign_a, a), (_, _, sign_b, b) = heapq.heappop(heap), heapq.heappop(heap)
            if nodes_only:
                sign_a, a = (-sign_a, a.args[0]) if a.op == "neg" else (sign_a, a)
                sign_b, b = (-sign_b, b.args[0]) if b.op == "neg" else (sign_b, b)
            if sign_a == sign_b:
                sign, total = sign_a, r.add(a, b)
            elif nodes_only and a.index > b.index:
                sign, total = sign_b, r.sub(b, a)
            elif nodes_only:
                sign, total = sign_a, r.sub(a, b)
            else:
                sign, total = 1, r.sub(a, b) if sign_a > 0 else r.sub(b, a)
            count += 1
            time = 0
            if isinstance(total, Node):
                time = ready[total.index]
            else:
                nodes_only = False
            heapq.heappush(heap, (time, count, sign, total))
        _, _, sign, total = heap[0]
        return total if sign > 0 else r.neg(total)

    def _terms(self, node: Node) -> list[tuple[int, int, int, Any]]:
        """When each term is ready, its number in their order, its sign, and the term.

        Without recursion, as a sum over all links of a long chain is that deep.
        """
        inner, new, ready = self.inner, self.new, self.recorder.ready
        result: list[tuple[int, int, int, Any]] = []
        waiting: list[tuple[int, Any]] = [(1, node)]
        while waiting:
            sign, value = waiting.pop()
            time = 0
            if isinstance(value, Node):
                if value.op == "neg":
                    sign, value = -sign, value.args[0]
                if value is node or inner[value.index]:
                    first, second = value.args
                    waiting += (sign if value.op == "add" else -sign, second), (sign, first)
                    continue
                value = new[value.index]
                if isinstance(value, Node):
                    time = ready[value.index]
            result.append((time, len(result), sign, value))
        return result


def _free_sums(tape: Tape) -> np.ndarray:
    """Mask of the steps that are sums whose terms may be taken in any order, (n,)."""
    return tape.arrays.does(*_SUMS) & (tape.arrays.masks & ~PARAMETER != 0)


def _inner_sums(tape: Tape) -> np.ndarray:
    """Mask of the sums that are used once, by another sum, and have neither a name nor a check: their order is free, (n,)."""
    arrays, free = tape.arrays, _free_sums(tape)
    results = [unsigned(e) for o in tape.outputs.values() for e in o.entries]
    kept = arrays.marked([*tape.recorder.names, *tape.recorder.checks, *results])
    used = arrays.read_by(~arrays.does("neg"))
    return free & ~kept & (used == 1) & (arrays.read_by(free) == 1)
