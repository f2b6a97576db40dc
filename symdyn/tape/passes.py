"""Passes that rebuild a tape: substitution and specialization."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from symdyn.errors import EvaluationError
from symdyn.tape.node import PARAMETER, Node
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Output, Tape, reachable, unsigned
from symdyn.tape.walk import Arithmetic, walk

ARITHMETIC = {"add", "sub", "mul", "div", "neg", "pow"}


def rebuild(recorder: Recorder, op: str, args: tuple) -> Any:
    """Record the operation again, with folding."""
    if op in ARITHMETIC:
        return getattr(recorder, op)(*args)
    if op == "call":
        items = recorder.call(args[0], args[1:])
        return items[0].args[0] if isinstance(items[0], Node) else items
    if op == "guard":
        return recorder.guarded(*args)
    if op == "item":
        return recorder.item(*args)
    return recorder.apply(op, *args)


class Again(Arithmetic):
    """Nodes and numbers of another tape: every step is recorded there again, with folding."""

    def __init__(self, recorder: Recorder) -> None:
        self.recorder = recorder

    def leaf(self, node: Node) -> Any:
        return self.recorder.leaf(node.args[1], node.args[0])

    def number(self, value: Any) -> Any:
        return value

    def step(self, node: Node, args: list[Any]) -> Any:
        return self.again(node, tuple(args))

    def call(self, node: Node, args: list[Any]) -> Any:
        return self.again(node, (node.args[0], *args))

    def item(self, node: Node, results: Any) -> Any:
        return self.again(node, (results, node.args[1]))

    def again(self, node: Node, args: tuple[Any, ...]) -> Any:
        """A step with these arguments."""
        return rebuild(self.recorder, node.op, args)


class _WithNames(Again):
    """Under their names and sections, with their checks."""

    def again(self, node: Node, args: tuple[Any, ...]) -> Any:
        recorder, checks = self.recorder, node.recorder.checks
        with recorder.section(node.section):
            try:
                value = rebuild(recorder, node.op, args)
            except ZeroDivisionError:
                demanded = node if node.op == "call" else unsigned(node.args[-1])
                reason = checks.get(demanded, "an expression divides by zero")
                raise EvaluationError(f"with the numbers that are bound: {reason}") from None
        if isinstance(value, Node):
            if node in node.recorder.names:
                recorder.name(node.recorder.names[node], value)
            if node in checks and node.op == "guard":
                recorder.positive(unsigned(value), checks[node])
            elif node in checks:
                return recorder.positive(value, checks[node])
        return value


def substitute(entries: tuple, replacements: Mapping[Node, Any], recorder: Recorder) -> tuple:
    """The entries with nodes replaced, everything above them recorded again under its old name and section."""
    new = walk(reachable(entries), _WithNames(recorder), replacements)
    return tuple(new.of(e) for e in entries)


def specialize(tape: Tape, values: Mapping[str, Any]) -> Tape:
    """Bind parameters, by name, to numbers and fold them; the others stay."""
    bound = {leaf: values[leaf.args[1]] for leaf in tape.inputs
             if leaf.mask == PARAMETER and leaf.args[1] in values}
    recorder = Recorder()
    entries = tuple(e for output in tape.outputs.values() for e in output.entries)
    folded = iter(substitute(entries, bound, recorder))
    return Tape(recorder, {name: Output(name, o.shape, tuple(next(folded) for _ in o.entries))
                           for name, o in tape.outputs.items()})
