"""Writes operations as text in a dialect, with the parentheses that keep the recorded order of evaluation."""

from __future__ import annotations

from typing import Any

from symdyn.backend.dialect import Dialect
from symdyn.tape.evaluate import constant, double
from symdyn.tape.node import Node

_COMPARE = {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!="}
_SUM, _SIGN, _PRODUCT, _ATOM = range(4)


class Printer:
    """Text of nodes; `names` holds what is already written: variables, and inlined expressions listed in `inline`."""

    def __init__(self, dialect: Dialect, names: dict[Node, str]) -> None:
        self.dialect = dialect
        self.names = names
        self.inline: set[Node] = set()

    def text(self, value: Any) -> str:
        """A value where nothing surrounds it."""
        return self._text(value)[0]

    def operation(self, node: Node) -> str:
        """The right-hand side that computes a node."""
        return self._operation(node)[0]

    def _text(self, value: Any) -> tuple[str, int]:
        """Text and how strongly it binds."""
        if not isinstance(value, Node):
            return self._literal(value)
        if value.op == "neg":
            return self._negative(value.args[0])
        if value in self.names:
            return (self._operation(value) if value in self.inline else (self.names[value], _ATOM))
        if value.mask == 0 and value.op != "leaf":
            return self._literal(constant(value))
        return self._operation(value)

    def _literal(self, value: Any) -> tuple[str, int]:
        if isinstance(value, bool):
            return self.dialect.number(float(value)), _ATOM
        number = double(value)
        return (f"-{self.dialect.number(-number)}", _SIGN) if number < 0 else (self.dialect.number(number), _ATOM)

    def _negative(self, value: Any) -> tuple[str, int]:
        if isinstance(value, Node) and value.op == "sub" and (value in self.inline or value not in self.names):
            return self._infix("-", value.args[1], value.args[0], _SUM)
        text, strength = self._text(value)
        return f"-{text}" if strength >= _PRODUCT else f"-({text})", _SIGN

    def _operation(self, node: Node) -> tuple[str, int]:
        op, args = node.op, node.args
        custom = self.dialect.operations.get(op)
        if custom is not None:
            return custom.format(*[self._text(a)[0] for a in args]), _ATOM
        if op == "item":
            assert self.dialect.call is not None
            return self.dialect.call.item.format(name=self.names[args[0]], k=args[1] + self.dialect.first), _ATOM
        if op in ("add", "sub") and self.dialect.madd is not None:
            fused = self._fused(args[0], args[1], op == "sub")
            if fused:
                return fused, _ATOM
        if op == "add":
            first, second = args
            if not isinstance(first, Node):
                if first < 0:
                    return self._infix("-", second, -first, _SUM)
                return self._infix("+", second, first, _SUM)
            return self._infix("+", first, second, _SUM)
        if op == "sub":
            return self._infix("-", args[0], args[1], _SUM)
        if op == "mul":
            return self._infix("*", args[0], args[1], _PRODUCT)
        if op == "div":
            return self._infix("/", args[0], args[1], _PRODUCT)
        if op in _COMPARE:
            return f"({self._text(args[0])[0]} {_COMPARE[op]} {self._text(args[1])[0]})", _ATOM
        return f"{op}({', '.join(self._text(a)[0] for a in args)})", _ATOM

    def _fused(self, first: Any, second: Any, minus: bool) -> str:
        """a*b + c, a*b - c or c - a*b in one step, where a product is written nowhere else; else nothing.

        The one recorded later of two products is taken, which is likely to be known later.
        """
        assert self.dialect.madd is not None
        for product, other, negated, subtracted in ((second, first, minus, False), (first, second, False, minus)):
            if isinstance(product, Node) and product.op == "mul" and product in self.inline:
                a, b = product.args
                left = self._negative(a)[0] if negated else self._text(a)[0]
                rest = self._negative(other) if subtracted else self._text(other)
                return self.dialect.madd.format(left, self._text(b)[0], rest[0])
        return ""

    def _infix(self, sign: str, left: Any, right: Any, strength: int) -> tuple[str, int]:
        first, binds = self._text(left)
        if binds < strength:
            first = f"({first})"
        second, binds = self._text(right)
        if binds <= max(strength, _SIGN):
            second = f"({second})"
        return (f"{first} {sign} {second}" if strength == _SUM else f"{first}{sign}{second}"), strength
