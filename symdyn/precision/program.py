"""A tape as a Python function on mpmath numbers: what depends on parameters alone is computed once, the rest is straight-line
code."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Any

from mpmath import libmp

from symdyn.errors import EvaluationError, SymdynError
from symdyn.tape.evaluate import functions_of
from symdyn.tape.external import UserFunction
from symdyn.tape.node import PARAMETER, Node
from symdyn.tape.tape import Tape

# These run on mpmath's own tuples, which takes half the time of its numbers.
_ARITHMETIC = {"add": libmp.mpf_add, "sub": libmp.mpf_sub, "mul": libmp.mpf_mul}


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
    """Writes the function; `known` is what its names stand for: v a node's value as a tuple of mpmath, c a number, k a kernel."""

    def __init__(self, tape: Tape, context: Any, fixed: Mapping[str, Any], free: Mapping[str, int]) -> None:
        self.tape, self.context, self.fixed, self.free = tape, context, fixed, free
        self.known: dict[str, Any] = {f"f_{op}": f for op, f in {**functions_of(context), "guard": _guarded}.items()}
        self.known |= {**_ARITHMETIC, "neg": libmp.mpf_neg, "cos_sin": libmp.mpf_cos_sin, "prec": context.prec, "near": "n",
                       "div": self._div, "apply": self._apply, "call": self._call, "make": context.make_mpf}
        self.numbers: dict[Any, str] = {}
        angles = [{n.args[0] for n in tape.steps if n.op == op} for op in ("sin", "cos")]
        self.both = angles[0] & angles[1]
        self.written: set[Node] = set()

    def text(self) -> str:
        lines = ["def program(x):"]
        for node in self.tape.steps:
            if node.op == "leaf":
                if node.args[1] in self.free:
                    lines.append(f"    v{node.index} = x[{self.free[node.args[1]]}]._mpf_")
                else:
                    self.known[f"v{node.index}"] = self.context.mpf(self.fixed[node.args[1]])._mpf_
            elif node.mask & ~PARAMETER:
                lines += [f"    {line}" for line in self._line(node)]
            else:  # once and for all
                for line in self._line(node):
                    exec(line, self.known)
        entries = [f"make({self._name(e)})" for output in self.tape.outputs.values() for e in output.entries]
        return "\n".join([*lines, f"    return [{', '.join(entries)}]", ""])

    def _line(self, node: Node) -> list[str]:
        own, args = f"v{node.index}", node.args
        if node in self.written:
            return []
        if node.op in _ARITHMETIC:
            return [f"{own} = {node.op}({self._name(args[0])}, {self._name(args[1])}, prec, near)"]
        if node.op == "div":
            return [f"{own} = div({self._name(args[0])}, {self._name(args[1])})"]
        if node.op == "neg":
            return [f"{own} = neg({self._name(args[0])})"]
        if node.op == "item":
            return [f"{own} = {self._name(args[0])}[{args[1]}]"]
        if node.op == "call":
            self.known[f"k{node.index}"] = args[0]
            return [f"{own} = call(k{node.index}, {', '.join(self._name(a) for a in args[1:])})"]
        if node.op in ("sin", "cos") and args[0] in self.both:
            pair = {n.op: n for n in self.tape.steps if n.op in ("sin", "cos") and n.args[0] is args[0]}
            self.written |= set(pair.values())
            return [f"v{pair['cos'].index}, v{pair['sin'].index} = cos_sin({self._name(args[0])}, prec, near)"]
        return [f"{own} = apply({', '.join([f'f_{node.op}', *[self._name(a) for a in args]])})"]

    def _name(self, value: Any) -> str:
        if isinstance(value, Node):
            return f"v{value.index}"
        if value not in self.numbers:
            self.numbers[value] = f"c{len(self.numbers)}"
            exact = self.context.mpf(value.numerator) / value.denominator if isinstance(value, Fraction) else value
            self.known[self.numbers[value]] = value if isinstance(value, bool) else self.context.mpf(exact)._mpf_
        return self.numbers[value]

    def _div(self, a: Any, b: Any) -> Any:
        return libmp.mpf_div(a, b, self.context.prec, "n") if b != libmp.fzero else libmp.fnan  # of a branch that is not taken

    def _apply(self, function: Callable[..., Any], *args: Any) -> Any:
        try:
            value = function(*[self._number(a) for a in args])
        except ZeroDivisionError:  # harmless in a branch that is not taken
            value = self.context.nan
        return value if isinstance(value, bool) else self.context.convert(value)._mpf_

    def _call(self, kernel: Any, *args: Any) -> list[Any]:
        given = [self._number(a) for a in args]
        try:
            return [value._mpf_ for value in kernel.precise(self.context, given)]
        except Exception as error:
            if isinstance(error, SymdynError) or not isinstance(kernel, UserFunction):
                raise
            at = ", ".join(self.context.nstr(value, 6) for value in given)
            raise EvaluationError(f"the Python text of {kernel.signature} raised {type(error).__name__} at ({at}): "
                                  f"{error}") from error

    def _number(self, value: Any) -> Any:
        return self.context.make_mpf(value) if isinstance(value, tuple) else value


def _guarded(value: Any, margin: Any) -> Any:
    if margin > 0:
        return value
    raise Lost("what the equations divide by vanishes here")
