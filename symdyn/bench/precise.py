"""A tape as a Python function on mpmath numbers: what depends on parameters alone is computed once, the rest is straight-line
code."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Any

from symdyn.errors import EvaluationError
from symdyn.tape.evaluate import functions_of
from symdyn.tape.node import PARAMETER, Node
from symdyn.tape.tape import Tape

_OPERATORS = {"add": "+", "sub": "-", "mul": "*", "div": "/"}


class Lost(EvaluationError):
    """The tape does not hold here: what it divides by has vanished."""


def decimal(context: Any, value: Any) -> Any:
    """The shortest decimal number that has this float, such as 0.1 for 0.1000000000000000055."""
    return context.mpf(repr(float(value)))


def program(tape: Tape, context: Any, fixed: Mapping[str, Any], free: Sequence[str]) -> Callable[[Sequence[Any]], list[Any]]:
    """f(values of the leaves `free`) -> all entries of the tape's outputs, one after the other.

    context   of mpmath, whose precision is that of the results
    fixed     numbers of the context for the other leaves, by name
    Raises KeyError naming leaves without a value; f raises Lost where the tape does not hold.
    """
    missing = [leaf.args[1] for leaf in tape.inputs if leaf.args[1] not in {*fixed, *free}]
    if missing:
        raise KeyError(f"no value for {', '.join(missing)}")
    writer = _Writer(tape, context, fixed, {name: k for k, name in enumerate(free)})
    exec(compile(writer.text(), f"<{'/'.join(tape.outputs)}>", "exec"), writer.known)
    return writer.known["program"]  # type: ignore[no-any-return]


class _Writer:
    """Writes the function; `known` is what its names stand for."""

    def __init__(self, tape: Tape, context: Any, fixed: Mapping[str, Any], free: Mapping[str, int]) -> None:
        self.tape, self.context, self.fixed, self.free = tape, context, fixed, free
        self.functions = {**functions_of(context), "guard": _guarded}
        self.known: dict[str, Any] = {f"f_{op}": f for op, f in self.functions.items()}
        self.known |= {"cos_sin": context.cos_sin}
        self.numbers: dict[Any, str] = {}
        nodes = set(tape.steps)
        angles = [{n.args[0] for n in nodes if n.op == op} for op in ("sin", "cos")]
        self.both = angles[0] & angles[1]
        self.written: set[Node] = set()

    def text(self) -> str:
        lines = ["def program(x):"]
        for node in self.tape.steps:
            if node.op == "leaf":
                if node.args[1] in self.free:
                    lines.append(f"    v{node.index} = x[{self.free[node.args[1]]}]")
                else:
                    self.known[f"v{node.index}"] = self.context.mpf(self.fixed[node.args[1]])
            elif node.mask & ~PARAMETER:
                lines += [f"    {line}" for line in self._line(node)]
            else:  # once and for all
                for line in self._line(node):
                    exec(line, self.known)
        entries = [self._name(e) for output in self.tape.outputs.values() for e in output.entries]
        return "\n".join([*lines, f"    return [{', '.join(entries)}]", ""])

    def _line(self, node: Node) -> list[str]:
        own, args = f"v{node.index}", node.args
        if node in self.written:
            return []
        if node.op in _OPERATORS:
            return [f"{own} = {self._name(args[0])} {_OPERATORS[node.op]} {self._name(args[1])}"]
        if node.op == "neg":
            return [f"{own} = -{self._name(args[0])}"]
        if node.op == "item":
            return [f"{own} = {self._name(args[0])}[{args[1]}]"]
        if node.op == "call":
            self.known[f"k{node.index}"] = args[0].precise
            self.known["context"] = self.context
            return [f"{own} = k{node.index}(context, [{', '.join(self._name(a) for a in args[1:])}])"]
        if node.op in ("sin", "cos") and args[0] in self.both:
            pair = {n.op: n for n in self.tape.steps if n.op in ("sin", "cos") and n.args[0] is args[0]}
            self.written |= set(pair.values())
            return [f"v{pair['cos'].index}, v{pair['sin'].index} = cos_sin({self._name(args[0])})"]
        return [f"{own} = f_{node.op}({', '.join(self._name(a) for a in args)})"]

    def _name(self, value: Any) -> str:
        if isinstance(value, Node):
            return f"v{value.index}"
        if value not in self.numbers:
            self.numbers[value] = f"c{len(self.numbers)}"
            exact = value if isinstance(value, bool) else (
                self.context.mpf(value.numerator) / value.denominator if isinstance(value, Fraction) else self.context.mpf(value))
            self.known[self.numbers[value]] = exact
        return self.numbers[value]


def _guarded(value: Any, margin: Any) -> Any:
    if margin > 0:
        return value
    raise Lost("what the equations divide by vanishes here")
