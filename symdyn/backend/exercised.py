"""The statements that a state exercises: those whose value, changed a little, changes a result by more than its tolerance.

All states are looked at together, forward and back, in floats. A statement that no state exercises may be wrong without any
reference vector showing it.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from symdyn.tape.floats import Arrays, Slopes
from symdyn.tape.node import PARAMETER, Node
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.tape import Tape
from symdyn.tape.walk import walk

# Relative change of a statement's value that has to show in a result, by how much relative to its largest entry.
CHANGE, SHOWS = 1e-2, 1e-11
# Steps that are no arithmetic of their own.
PASSED_ON = ("leaf", "neg", "call", "item", "guard", "pi")
# Halvings of the way between two states towards the one where a divisor vanishes.
HALVINGS = 60


class _Unguarded(Arrays):
    """Statements behind a check count also where the check fails; algorithms are given all points."""

    def __init__(self, values: Mapping[str, np.ndarray], n: int) -> None:
        super().__init__(values)
        self.n = n

    def step(self, node: Node, args: list[Any]) -> Any:
        return args[0] if node.op == "guard" else super().step(node, args)

    def call(self, node: Node, args: list[Any]) -> Any:
        return super().call(node, [np.broadcast_to(a, (self.n,)) for a in args])


class Rows:
    """A tape at n points at once: values of all its steps, where its checks hold, and which steps the results depend on there.

    values   leaf name -> array (n,)
    """

    def __init__(self, tape: Tape, values: Mapping[str, np.ndarray], n: int) -> None:
        self.tape, self.n = tape, n
        with np.errstate(all="ignore"):
            self.of = walk(tape.steps, _Unguarded(values, n))
        self.checked = [node for node in tape.steps if node in tape.recorder.checks and node.op != "call"]
        self.defined = self._finite()

    def margin(self, node: Node) -> np.ndarray:
        """The value that must be positive, of a checked step."""
        return np.broadcast_to(self.number(node.args[1] if node.op == "guard" else node), (self.n,))

    def number(self, value: Any) -> Any:
        return self.of.of(value)

    def _finite(self) -> np.ndarray:
        good = np.ones(self.n, dtype=bool)
        with np.errstate(all="ignore"):
            for node in self.checked:
                good &= self.margin(node) > 0
            for output in self.tape.outputs.values():
                for entry in output.entries:
                    good &= np.isfinite(np.broadcast_to(self.number(entry), (self.n,)).astype(float))
        return good

    def exercised(self) -> dict[Node, np.ndarray]:
        """Step that runs -> booleans (n,); of a choice both branches, as (step, True) and (step, False)."""
        entries = [e for output in self.tape.outputs.values() for e in output.entries]
        scale = np.zeros(self.n)
        for e in entries:
            scale = np.maximum(scale, np.abs(np.broadcast_to(self.number(e), (self.n,)).astype(float)))
        scale = np.where(scale > 0, scale, 1.0)
        stream = random.Random(1)
        weight: dict[Node, Any] = {}
        for e in entries:  # random weights, so that effects on two entries do not cancel
            if isinstance(e, Node):
                weight[e] = weight.get(e, 0.0) + stream.uniform(0.5, 1.5) * stream.choice((1, -1)) * np.ones(self.n)
        result: dict[Any, np.ndarray] = {}
        with np.errstate(all="ignore"):
            for node in reversed(self.tape.steps):
                if node not in weight or node.op == "leaf":
                    continue
                self._back(node, weight)
                self._note(node, weight[node], scale, result)
        return {key: value & self.defined for key, value in result.items()}

    def _note(self, node: Node, weight: Any, scale: np.ndarray, result: dict[Any, np.ndarray]) -> None:
        if node.op in PASSED_ON:
            return
        if node.op == "select":
            condition = np.broadcast_to(np.asarray(self.number(node.args[0]), dtype=bool), (self.n,))
            matters = np.abs(weight) > 0
            result[node, True], result[node, False] = matters & condition, matters & ~condition
            return
        value = self.number(node)
        result[node] = _numbers(np.abs(weight * value)) * CHANGE > SHOWS * scale

    def _back(self, node: Node, weight: dict[Node, Any]) -> None:
        """Pass the weight of a step on to its arguments."""
        mine = weight[node]
        if node.op == "item":
            weight[node.args[0]] = weight.get(node.args[0], 0.0) + np.abs(mine)
            return
        if node.op == "call":  # each value of a numeric algorithm is taken to act on all of its results
            for a in node.args[1:]:
                if isinstance(a, Node):
                    weight[a] = weight.get(a, 0.0) + mine
            return
        rule = OPERATIONS[node.op].partials
        if rule is None:
            return
        values = tuple(self.number(a) for a in node.args)
        result = self.of[node]
        if node.op == "sqrt":  # an exact 1/2 is divided by each root on its own, which raises for zero
            result = np.maximum(result, np.finfo(float).tiny)
        for a, partial in zip(node.args, rule(Slopes, result, values)):
            if isinstance(a, Node):
                passed = _numbers(mine * partial)
                weight[a] = weight.get(a, 0.0) + passed


def _numbers(values: Any) -> np.ndarray:
    """Zeros in place of what is no number, and the largest in place of infinity: nan_to_num, quicker where all are finite."""
    values = np.asarray(values, dtype=float)
    return values if np.isfinite(values).all() else np.nan_to_num(values)


def statements(tapes: Sequence[Tape]) -> set[Any]:
    """Statements to exercise in tapes: every statement on which a result depends, of a choice both branches."""
    result: set[Any] = set()
    for tape in tapes:
        for node in _valued(tape):
            if node.op == "select":
                result |= {(node, True), (node, False)}
            elif node.op not in PASSED_ON and OPERATIONS[node.op].kind != "compare":
                result.add(node)
    return result


def deciding(tapes: Sequence[Tape]) -> set[Node]:
    """The other statements of tapes, which serve only conditions and the margins of checks."""
    return {node for tape in tapes for node in set(tape.steps) - _valued(tape) if node.op not in PASSED_ON}


def _valued(tape: Tape) -> set[Node]:
    """The steps that results are computed from."""
    result: set[Node] = set()
    waiting = [e for output in tape.outputs.values() for e in output.entries if isinstance(e, Node)]
    while waiting:
        node = waiting.pop()
        if node in result:
            continue
        result.add(node)
        values = node.args[:1] if node.op in ("guard", "item") else node.args[1:] if node.op == "select" else node.args
        waiting += [a for a in values if isinstance(a, Node)]
    return result


def singular_states(tape: Tape, values: Mapping[str, np.ndarray], n: int, known: set[Node]) -> dict[str, np.ndarray]:
    """Points, each value an array (k,), where a guarded divisor of the tape vanishes: between two where its signs differ.

    Parameters stay those of the first of the two. All divisors are looked at together, those that are known are left out.
    """
    rows = Rows(tape, values, n)
    fixed = {leaf.args[1] for leaf in tape.inputs if leaf.mask == PARAMETER}
    divisors, first, second = list[Node](), list[int](), list[int]()
    for node in (step for step in rows.checked if step.op == "guard" and isinstance(step.args[0], Node) and step not in known):
        divisor = np.broadcast_to(rows.number(node.args[0]), (n,))
        above, below = (np.flatnonzero(side) for side in (divisor > 0, divisor < 0))
        if above.size and below.size:
            divisors.append(node.args[0])
            first.append(int(above[0]))
            second.append(int(below[0]))
    alone, each = Tape.of(tape.recorder, divisors=divisors), np.arange(len(divisors))

    def signs(points: Mapping[str, np.ndarray]) -> np.ndarray:
        there = Rows(alone, points, len(divisors))
        return np.array([np.sign(np.broadcast_to(there.number(d), each.shape)[k]) for k, d in enumerate(divisors)])

    one = {name: v[first] for name, v in values.items()}
    other = {name: one[name] if name in fixed else v[second] for name, v in values.items()}
    begin = signs(one)
    between = begin != signs(other)
    for _ in range(HALVINGS if between.any() else 0):
        middle = {name: (one[name] + other[name]) / 2 for name in values}
        same = signs(middle) == begin
        one = {name: np.where(same, middle[name], v) for name, v in one.items()}
        other = {name: np.where(same, v, middle[name]) for name, v in other.items()}
    return {name: v[between] for name, v in one.items()}
