"""Passes that rebuild a tape: substitution and specialization."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from symdyn.errors import EvaluationError
from symdyn.tape.node import PARAMETER, Node
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Output, Tape, reachable, unsigned

_ARITHMETIC = {"add", "sub", "mul", "div", "neg", "pow"}


def rebuild(recorder: Recorder, op: str, args: tuple) -> Any:
    """Record the operation again, with folding."""
    if op == "call":
        items = recorder.call(args[0], args[1:])
        return items[0].args[0] if isinstance(items[0], Node) else items
    if op == "guard":
        return recorder.guarded(*args)
    if op == "item":
        return recorder.item(*args)
    if op in _ARITHMETIC:
        return getattr(recorder, op)(*args)
    return recorder.apply(op, *args)


def substitute(entries: tuple, replacements: Mapping[Node, Any], recorder: Recorder) -> tuple:
    """The entries with nodes replaced, everything above them recorded again under its old name and section."""
    new: dict[Node, Any] = {}
    for node in reachable(entries):
        if node in replacements:
            new[node] = replacements[node]
        elif node.op == "leaf":
            new[node] = recorder.leaf(node.args[1], node.args[0])
        else:
            with recorder.section(node.section):
                try:
                    value = rebuild(recorder, node.op, tuple(new[a] if isinstance(a, Node) else a for a in node.args))
                except ZeroDivisionError:
                    demanded = node if node.op == "call" else unsigned(node.args[-1])
                    reason = node.recorder.checks.get(demanded, "an expression divides by zero")
                    raise EvaluationError(f"with the numbers that are bound: {reason}") from None
            new[node] = value
            if isinstance(value, Node):
                if node in node.recorder.names:
                    recorder.name(node.recorder.names[node], value)
                if node in node.recorder.checks and node.op == "guard":
                    recorder.positive(unsigned(value), node.recorder.checks[node])
                elif node in node.recorder.checks:
                    new[node] = recorder.positive(value, node.recorder.checks[node])
    return tuple(new[e] if isinstance(e, Node) else e for e in entries)


def specialize(tape: Tape, values: Mapping[str, Any]) -> Tape:
    """Bind parameters, by name, to numbers and fold them; the others stay."""
    bound = {leaf: values[leaf.args[1]] for leaf in tape.inputs
             if leaf.mask == PARAMETER and leaf.args[1] in values}
    recorder = Recorder()
    entries = tuple(e for output in tape.outputs.values() for e in output.entries)
    folded = iter(substitute(entries, bound, recorder))
    return Tape(recorder, {name: Output(name, o.shape, tuple(next(folded) for _ in o.entries))
                           for name, o in tape.outputs.items()})
