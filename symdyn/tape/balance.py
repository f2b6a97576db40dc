"""Sums in the order in which their terms are ready, so that fewer operations wait for each other.

a + b + c + d with d known last is worth (a + b + c) + d, and four terms known at once (a + b) + (c + d). The number of
operations stays; the longest chain, and with it the time of an evaluation, gets shorter: 5 to 10 % of the time of chains
of ten bodies.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from itertools import groupby
from operator import attrgetter
from typing import Any

from symdyn.tape.node import PARAMETER, Node
from symdyn.tape.passes import ARITHMETIC, rebuild
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Output, Tape, unsigned

# How long an operation takes, in additions.
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


class _Balancer:
    def __init__(self, tape: Tape) -> None:
        self.old = tape
        self.recorder = Recorder()
        self.new: dict[Node, Any] = {}
        self.ready: dict[Node, int] = {}
        self.inner = _inner_sums(tape)

    def tape(self) -> Tape:
        recorder, new, inner = self.recorder, self.new, self.inner
        ways = {op: getattr(recorder, op) for op in ARITHMETIC}
        names, checks = self.old.recorder.names, self.old.recorder.checks
        for section, nodes in groupby(self.old.steps, key=attrgetter("section")):
            with recorder.section(section):
                for node in nodes:
                    op, args = node.op, node.args
                    if (args[0] if op == "neg" else node) in inner:
                        continue
                    if op == "leaf":
                        value: Any = recorder.leaf(args[1], args[0])
                    elif op in _SUMS and node.mask & ~PARAMETER and self._has_inner(args):
                        value = self._sum(node)
                    else:
                        again = [new[a] if isinstance(a, Node) else a for a in args]
                        value = ways[op](*again) if op in ways else rebuild(recorder, op, tuple(again))
                    new[node] = value
                    if isinstance(value, Node):
                        if node in names:
                            recorder.name(names[node], value)
                        if node in checks and op == "guard":
                            recorder.positive(unsigned(value), checks[node])
                        elif node in checks:
                            new[node] = recorder.positive(value, checks[node])
        return Tape(recorder, {name: Output(name, o.shape, tuple(self._of(e) for e in o.entries))
                               for name, o in self.old.outputs.items()})

    def _of(self, value: Any) -> Any:
        return self.new[value] if isinstance(value, Node) else value

    def _has_inner(self, terms: tuple[Any, ...]) -> bool:
        """Whether a sum has more than its two terms, whose order is of no account."""
        return any(unsigned(term) in self.inner for term in terms)

    def _sum(self, node: Node) -> Any:
        """The terms, two by two, those that are ready first."""
        r = self.recorder
        heap = [(self._time(self._of(term)), k, sign, self._of(term)) for k, (sign, term) in enumerate(self._terms(node))]
        heapq.heapify(heap)
        count = len(heap)
        while len(heap) > 1:
            (_, _, sign_a, a), (_, _, sign_b, b) = heapq.heappop(heap), heapq.heappop(heap)
            if sign_a == sign_b:
                sign, total = sign_a, r.add(a, b)
            else:
                sign, total = 1, r.sub(a, b) if sign_a > 0 else r.sub(b, a)
            count += 1
            heapq.heappush(heap, (self._time(total), count, sign, total))
        _, _, sign, total = heap[0]
        return total if sign > 0 else r.neg(total)

    def _terms(self, node: Node) -> Iterator[tuple[int, Any]]:
        """Signs and terms in their order; without recursion, as a sum over all links of a long chain is that deep."""
        waiting: list[tuple[int, Any]] = [(1, node)]
        while waiting:
            sign, value = waiting.pop()
            core = unsigned(value)
            sign = -sign if core is not value else sign
            if core is node or core in self.inner:
                first, second = core.args
                waiting += (sign if core.op == "add" else -sign, second), (sign, first)
            else:
                yield sign, core

    def _time(self, value: Any) -> int:
        """When a value is ready."""
        if not isinstance(value, Node):
            return 0
        ready = self.ready
        known = ready.get(value)
        if known is not None:
            return known
        stack = [value]
        while stack:
            node = stack[-1]
            if node.op == "leaf" or not node.mask & ~PARAMETER:
                ready[stack.pop()] = 0
                continue
            waiting, before = False, 0
            for a in node.args:
                if isinstance(a, Node):
                    time = ready.get(a)
                    if time is None:
                        waiting = True
                        stack.append(a)
                    elif time > before:
                        before = time
            if not waiting:
                ready[stack.pop()] = before + _LATENCY.get(node.op, _FUNCTION)
        return ready[value]


def _inner_sums(tape: Tape) -> set[Node]:
    """Sums that are used once, by another sum, and have neither a name nor a check: their order is free."""
    once: dict[Node, bool] = {}
    for node in tape.steps:
        if node.op != "neg":
            free = node.op in _SUMS and bool(node.mask & ~PARAMETER)
            for a in node.args:
                if isinstance(a, Node):
                    core = a.args[0] if a.op == "neg" else a
                    if core.op in _SUMS:
                        once[core] = free and core not in once
    names, checks = tape.recorder.names, tape.recorder.checks
    results = {unsigned(e) for o in tape.outputs.values() for e in o.entries}
    return {node for node, free in once.items() if free and node.mask & ~PARAMETER and node not in names
            and node not in checks and node not in results}
