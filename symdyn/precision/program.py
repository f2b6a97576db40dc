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
from symdyn.tape.walk import Arithmetic, walk

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


class _Writer(Arithmetic):
    """Writes the function: values are names. `known` is what they stand for: v a node's value as a tuple of mpmath, c a number,
    k an algorithm."""

    def __init__(self, tape: Tape, context: Any, fixed: Mapping[str, Any], free: Mapping[str, int]) -> None:
        self.tape, self.context, self.fixed, self.free = tape, context, fixed, free
        self.known: dict[str, Any] = {f"f_{op}": f for op, f in {**functions_of(context), "guard": _guarded}.items()}
        self.known |= {**_ARITHMETIC, "neg": libmp.mpf_neg, "cos_sin": libmp.mpf_cos_sin, "prec": context.prec, "near": "n",
                       "div": self._div, "apply": self._apply, "call": self._call, "make": context.make_mpf}
        self.numbers: dict[Any, str] = {}
        angles = [{n.args[0] for n in tape.steps if n.op == op} for op in ("sin", "cos")]
        self.both = angles[0] & angles[1]
        self.written: set[Node] = set()
        self.lines = ["def program(x):"]

    def text(self) -> str:
        names = walk(self.tape.steps, self)
        entries = [f"make({names.of(e)})" for output in self.tape.outputs.values() for e in output.entries]
        return "\n".join([*self.lines, f"    return [{', '.join(entries)}]", ""])

    def leaf(self, node: Node) -> str:
        own = f"v{node.index}"
        if node.args[1] in self.free:
            self.lines.append(f"    {own} = x[{self.free[node.args[1]]}]._mpf_")
        else:
            self.known[own] = self.context.mpf(self.fixed[node.args[1]])._mpf_
        return own

    def number(self, value: Any) -> str:
        if value not in self.numbers:
            self.numbers[value] = f"c{len(self.numbers)}"
            exact = self.context.mpf(value.numerator) / value.denominator if isinstance(value, Fraction) else value
            self.known[self.numbers[value]] = value if isinstance(value, bool) else self.context.mpf(exact)._mpf_
        return self.numbers[value]

    def step(self, node: Node, args: list[str]) -> str:
        own, op = f"v{node.index}", node.op
        if node in self.written:
            return own
        if op in _ARITHMETIC:
            return self._line(node, f"{own} = {op}({args[0]}, {args[1]}, prec, near)")
        if op in ("div", "neg"):
            return self._line(node, f"{own} = {op}({', '.join(args)})")
        if op in ("sin", "cos") and node.args[0] in self.both:
            pair = {n.op: n for n in self.tape.steps if n.op in ("sin", "cos") and n.args[0] is node.args[0]}
            self.written |= set(pair.values())
            return self._line(node, f"v{pair['cos'].index}, v{pair['sin'].index} = cos_sin({args[0]}, prec, near)")
        return self._line(node, f"{own} = apply({', '.join([f'f_{op}', *args])})")

    def call(self, node: Node, args: list[str]) -> str:
        self.known[f"k{node.index}"] = node.args[0]
        return self._line(node, f"v{node.index} = call(k{node.index}, {', '.join(args)})")

    def item(self, node: Node, results: str) -> str:
        return self._line(node, f"v{node.index} = {results}[{node.args[1]}]")

    def _line(self, node: Node, line: str) -> str:
        if node.mask & ~PARAMETER:
            self.lines.append(f"    {line}")
        else:  # once and for all
            exec(line, self.known)
        return f"v{node.index}"

    def _div(self, a: Any, b: Any) -> Any:
        return libmp.mpf_div(a, b, self.context.prec, "n") if b != libmp.fzero else libmp.fnan  # of a branch that is not taken

    def _apply(self, function: Callable[..., Any], *args: Any) -> Any:
        try:
            value = function(*[self._number(a) for a in args])
        except ZeroDivisionError:  # harmless in a branch that is not taken
            value = self.context.nan
        return value if isinstance(value, bool) else self.context.convert(value)._mpf_

    def _call(self, intrinsic: Any, *args: Any) -> list[Any]:
        given = [self._number(a) for a in args]
        try:
            return [value._mpf_ for value in intrinsic.precise(self.context, given)]
        except Exception as error:
            if isinstance(error, SymdynError) or not isinstance(intrinsic, UserFunction):
                raise
            at = ", ".join(self.context.nstr(value, 6) for value in given)
            raise EvaluationError(f"the Python text of {intrinsic.signature} raised {type(error).__name__} at ({at}): "
                                  f"{error}") from error

    def _number(self, value: Any) -> Any:
        return self.context.make_mpf(value) if isinstance(value, tuple) else value


def _guarded(value: Any, margin: Any) -> Any:
    if margin > 0:
        return value
    raise Lost("what the equations divide by vanishes here")
