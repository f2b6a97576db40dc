"""Sums in the order in which their terms are ready, so that fewer operations wait for each other.

a + b + c + d with d known last is worth (a + b + c) + d, and four terms known at once (a + b) + (c + d). The number of
operations stays; the longest chain, and with it the time of an evaluation, gets shorter: 5 to 10 % of the time of chains
of ten bodies.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import groupby
from operator import attrgetter
from typing import Any

from symdyn.tape.node import PARAMETER, Node
from symdyn.tape.passes import rebuild
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Output, Tape, unsigned

# How long an operation takes, in additions.
_LATENCY = {"add": 1, "sub": 1, "mul": 1, "div": 4, "sqrt": 5, "neg": 0}
_FUNCTION = 10


def balance(tape: Tape) -> Tape:
    """The tape with its sums reordered, on a recorder of its own; sums that have a name or are used twice stay as they are.

    A right-hand side that is chosen by its balanced steps is emitted with them: what was balanced last is handed out once more.
    """
    recorder = tape.recorder
    asked = {name: o.entries for name, o in tape.outputs.items()}, len(recorder.names), len(recorder.checks)
    if recorder.balanced is not None and recorder.balanced[0] == asked:
        found: Tape = recorder.balanced[1]
        recorder.balanced = None
        return found
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
        names, checks = self.old.recorder.names, self.old.recorder.checks
        waiting = (node for node in self.old.steps if unsigned(node) not in self.inner)
        for section, nodes in groupby(waiting, key=attrgetter("section")):
            with self.recorder.section(section):
                for node in nodes:
                    value = self.new[node] = self._value(node)
                    if isinstance(value, Node):
                        if node in names:
                            self.recorder.name(names[node], value)
                        if node in checks and node.op == "guard":
                            self.recorder.positive(unsigned(value), checks[node])
                        elif node in checks:
                            self.new[node] = self.recorder.positive(value, checks[node])
        return Tape(self.recorder, {name: Output(name, o.shape, tuple(self._of(e) for e in o.entries))
                                    for name, o in self.old.outputs.items()})

    def _value(self, node: Node) -> Any:
        if node.op == "leaf":
            return self.recorder.leaf(node.args[1], node.args[0])
        if node.op in ("add", "sub") and node.mask & ~PARAMETER:
            return self._sum(node)
        return rebuild(self.recorder, node.op, tuple(self._of(a) for a in node.args))

    def _of(self, value: Any) -> Any:
        return self.new[value] if isinstance(value, Node) else value

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
        if not isinstance(value, Node) or value.op == "leaf" or not value.mask & ~PARAMETER:
            return 0
        known = self.ready.get(value)
        if known is not None:
            return known
        stack = [value]
        while stack:
            node = stack[-1]
            waiting = [a for a in node.args if isinstance(a, Node) and a not in self.ready]
            if waiting:
                stack += waiting
                continue
            stack.pop()
            running = node.op != "leaf" and node.mask & ~PARAMETER
            before = max((self.ready[a] for a in node.args if isinstance(a, Node)), default=0)
            self.ready[node] = before + _LATENCY.get(node.op, _FUNCTION) if running else 0
        return self.ready[value]


def _inner_sums(tape: Tape) -> Mapping[Node, None]:
    """Sums that are used once, by another sum, and have neither a name nor a check: their order is free."""
    uses: Counter = Counter()
    for node in tape.steps:
        if node.op != "neg":
            for a in node.args:
                if isinstance(a, Node):
                    uses[a.args[0] if a.op == "neg" else a] += 1
    uses.update(core for o in tape.outputs.values() for core in map(unsigned, o.entries) if isinstance(core, Node))
    kept = {**tape.recorder.names, **tape.recorder.checks}
    inner: dict[Node, None] = {}
    for node in tape.steps:
        if node.op in ("add", "sub") and node.mask & ~PARAMETER:
            for core in map(unsigned, node.args):
                if (isinstance(core, Node) and core.op in ("add", "sub") and core.mask & ~PARAMETER and uses[core] == 1
                        and core not in kept):
                    inner[core] = None
    return inner
