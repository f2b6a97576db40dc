"""One walk over the steps of a tape, with an arithmetic as its parameter: whatever gives steps values is built on it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from symdyn.tape.node import Node


class Arithmetic:
    """Kind of values, and how steps make them; subclasses define it.

    Those of the package: numbers of mpmath (symdyn.tape.evaluate), arrays of doubles (symdyn.tape.floats), intervals
    (symdyn.tape.intervals), nodes of another tape (symdyn.tape.passes), SymPy (symdyn.tape.sympy_bridge), exact polynomials
    (symdyn.exact.walk), numbered doubles (symdyn.formulation.textbook.doubles), lines of Python and of C (symdyn.precision),
    expressions of other programs (symdyn.bench.work.against.walk).

    functions   operation -> what computes it from its arguments, unless `step` says otherwise
    """

    functions: Mapping[str, Callable[..., Any]] = {}

    def leaf(self, node: Node) -> Any:
        """The value of an input of the tape, whose name is node.args[1]."""
        raise NotImplementedError

    def number(self, value: Any) -> Any:
        """The value of an integer, a fraction or a truth that stands on the tape."""
        raise NotImplementedError

    def step(self, node: Node, args: list[Any]) -> Any:
        """The value of an operation, from those of its arguments."""
        return self.functions[node.op](*args)

    def call(self, node: Node, args: list[Any]) -> Any:
        """The results of a numeric algorithm, node.args[0], from the values that it is given."""
        raise NotImplementedError

    def item(self, node: Node, results: Any) -> Any:
        """One result of a call, that number node.args[1]."""
        return results[node.args[1]]


class Values(dict[Node, Any]):
    """Node -> value, as a walk found them."""

    def __init__(self, arithmetic: Arithmetic, known: Mapping[Node, Any]) -> None:
        super().__init__(known)
        self.arithmetic = arithmetic

    def of(self, entry: Any) -> Any:
        """The value of a node or a number."""
        return self[entry] if isinstance(entry, Node) else self.arithmetic.number(entry)


def walk(steps: Iterable[Node], arithmetic: Arithmetic, known: Mapping[Node, Any] | None = None) -> Values:
    """The values of the steps, which come after their arguments, as `reachable` and `Tape.steps` have them.

    known   values of steps that are not to be computed
    """
    done = Values(arithmetic, known or {})
    leaf, number, step = arithmetic.leaf, arithmetic.number, arithmetic.step

    for node in steps:
        op, args = node.op, node.args
        if known is not None and node in done:
            continue
        if op == "leaf":
            done[node] = leaf(node)
        elif op == "item":
            done[node] = arithmetic.item(node, done[args[0]])
        elif op == "call":
            done[node] = arithmetic.call(node, [done.of(a) for a in args[1:]])
        else:
            done[node] = step(node, [done[a] if isinstance(a, Node) else number(a) for a in args])
    return done
