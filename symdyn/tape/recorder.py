"""The recorder: writes each operation down once, folds what is structurally simple, keeps names and sections.

Folding is exact (rational arithmetic), and a sign is moved outwards, so that a - b and b - a, x and -x share
one assignment; a change of sign costs nothing in the emitted code.
"""

from __future__ import annotations

import math
import operator
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from functools import lru_cache
from itertools import count
from math import isqrt
from typing import Any

import numpy as np

from symdyn.shown import shown
from symdyn.tape.intrinsics import Intrinsic
from symdyn.tape.node import Node, exact
from symdyn.tape.ops import OPERATIONS

_ODD = {"sin", "tan", "asin", "atan", "sinh", "tanh", "asinh", "atanh", "sign", "erf"}
_SELF_EXPLAINING = {"leaf", "neg", "sin", "cos"}
_EVEN = {"cos", "cosh", "abs"}
_AT_ZERO = {"sin": 0, "tan": 0, "asin": 0, "atan": 0, "sinh": 0, "tanh": 0, "asinh": 0, "atanh": 0, "sqrt": 0,
            "sign": 0, "abs": 0, "cos": 1, "cosh": 1, "exp": 1, "floor": 0, "ceil": 0, "erf": 0}
_EXACT: dict[str, Callable] = {
    "abs": abs, "sign": lambda a: (a > 0) - (a < 0), "floor": math.floor, "ceil": math.ceil, "min": min, "max": max,
    "lt": operator.lt, "le": operator.le, "gt": operator.gt, "ge": operator.ge, "eq": operator.eq, "ne": operator.ne,
    "not": operator.not_, "and": lambda a, b: a and b, "or": lambda a, b: a or b}


@lru_cache(maxsize=64)
def _ends(shape: tuple[int, ...], axes: bool) -> tuple[str, ...]:
    """Ends of the names of the entries of an array."""
    if not shape:
        return ("",)
    if axes:
        return tuple("_" + "".join("xyz"[k] for k in position) for position in np.ndindex(shape))
    return tuple("_" + "_".join(str(k + 1) for k in position) for position in np.ndindex(shape))


class Recorder:
    """Makes nodes; equal operations are one node (value numbering).

    names    node -> the name of the quantity it is, given while deriving
    checks   node -> reason: values that must be positive, such as pivots of the mass matrix
    slopes   node -> pairs (derivative, by which value): derivatives that are known to be shorter than those by the chain rule,
             which the steps do not show, such as those of the potential of what is at rest; for proofs
    balanced   the outputs that were balanced last, and the tape that they became, see symdyn.tape.balance
    """

    def __init__(self) -> None:
        self._known: defaultdict[str, dict[tuple, Node]] = defaultdict(dict)  # operation -> arguments -> node
        self._negatives: dict[Node, Node] = {}  # by the value without its sign
        self._numbers = count()
        self._section = ""
        self.names: dict[Node, str] = {}
        self.checks: dict[Node, str] = {}
        self.slopes: dict[Node, tuple[tuple[Any, Any], ...]] = {}
        self.balanced: tuple[Any, Any] | None = None

    # -- leaves, names, sections

    def leaf(self, name: str, mask: int) -> Node:
        """An input of the tape; mask says its kind (node.COORDINATE, ...)."""
        return self._make("leaf", (mask, name), mask)

    def name(self, name: str, value: Any, axes: bool = False) -> Any:
        """Give the entries of a scalar, vector or matrix a name, and return it unchanged.

        axes   number the entries x, y, z instead of 1, 2, 3
        """
        if isinstance(value, Node):
            entries, ends = [value], _ends((), axes)
        else:
            array = np.asarray(value, dtype=object)
            entries, ends = array.ravel().tolist(), _ends(array.shape, axes)
        for node, end in zip(entries, ends, strict=True):
            if isinstance(node, Node) and node.op not in _SELF_EXPLAINING and node not in self.names:
                self.names[node] = f"{name}{end}"
        return value

    @contextmanager
    def section(self, title: str) -> Iterator[None]:
        """Statements recorded inside stand under this heading in the emitted code."""
        outer, self._section = self._section, title
        try:
            yield
        finally:
            self._section = outer

    @property
    def heading(self) -> str:
        """The section under which is recorded now; set where a tape is recorded again, whose steps know theirs."""
        return self._section

    @heading.setter
    def heading(self, title: str) -> None:
        self._section = title

    def positive(self, node: Any, reason: str) -> Any:
        """The value, which must be positive when it is computed; reason says what it means if not."""
        if isinstance(node, Node):
            if node.op == "neg":  # what is computed, and divided by, is the value without its sign
                return self.guard(node, node, reason)
            self.checks.setdefault(node, reason)
        return node

    def guard(self, value: Any, margin: Any, reason: str) -> Any:
        """A value that may be used only where the margin is positive; where it is not, the code stops and says the reason."""
        node = self.guarded(value, margin)
        core = node.args[0] if isinstance(node, Node) and node.op == "neg" else node
        if isinstance(core, Node) and core.op == "guard":
            self.checks.setdefault(core, reason)
        return node

    def guarded(self, value: Any, margin: Any) -> Any:
        """A guard that is recorded again; its reason is taken over with it."""
        if not isinstance(margin, Node) or not isinstance(value, Node):
            return value if isinstance(margin, Node) or margin > 0 else 0
        if value.op == "neg":
            return self.neg(self._record("guard", value.args[0], margin))
        return self._record("guard", value, margin)

    def _make(self, op: str, args: tuple, mask: int) -> Node:
        known = self._known[op]
        node = known.get(args)
        if node is None:
            node = known[args] = self._new(op, args, mask)
        return node

    def _new(self, op: str, args: tuple, mask: int) -> Node:
        return Node(self, op, args, next(self._numbers), mask, self._section)

    def _record(self, op: str, *args: Any) -> Node:
        mask = 0
        for a in args:
            if isinstance(a, Node):
                mask |= a.mask
        return self._make(op, args, mask)

    # -- arithmetic

    def add(self, a: Any, b: Any) -> Any:
        if not isinstance(a, Node):
            a, b = b, a
        if not isinstance(a, Node):
            return exact(exact(a) + exact(b))
        if not isinstance(b, Node):
            b = b if type(b) is int else exact(b)
            if b == 0:
                return a
            if a.op == "add" and not isinstance(a.args[0], Node):
                return self.add(a.args[1], exact(a.args[0] + b))
            return self._make("add", (b, a), a.mask)
        if a.op == "neg":
            return self.sub(b, a.args[0])
        if b.op == "neg":
            return self.sub(a, b.args[0])
        if a is b:
            return self.mul(2, a)
        return self._make("add", (a, b) if a.index < b.index else (b, a), a.mask | b.mask)

    def sub(self, a: Any, b: Any) -> Any:
        if not isinstance(b, Node):
            return self.add(a, -(b if type(b) is int else exact(b)))
        if not isinstance(a, Node):
            return self.add(self.neg(b), a)
        if b.op == "neg":
            return self.add(a, b.args[0])
        if a.op == "neg":
            return self.neg(self.add(a.args[0], b))
        if a is b:
            return 0
        mask = a.mask | b.mask
        return self._make("sub", (a, b), mask) if a.index < b.index else self.neg(self._make("sub", (b, a), mask))

    def mul(self, a: Any, b: Any) -> Any:
        if not isinstance(a, Node):
            a, b = b, a
        if not isinstance(a, Node):
            return exact(exact(a) * exact(b))
        if not isinstance(b, Node):
            b = b if type(b) is int else exact(b)
            if b == 0:
                return 0
            if b == 1:
                return a
            if b < 0 or a.op == "neg":
                return self.neg(self.mul(a, -b)) if b < 0 else self.neg(self.mul(a.args[0], b))
            if a.op == "mul" and not isinstance(a.args[0], Node):
                return self.mul(a.args[1], exact(a.args[0] * b))
            return self._make("mul", (b, a), a.mask)
        if a.op == "neg":
            return self.mul(a.args[0], b.args[0]) if b.op == "neg" else self.neg(self.mul(a.args[0], b))
        if b.op == "neg":
            return self.neg(self.mul(a, b.args[0]))
        if a is b and a.op == "sqrt":
            return a.args[0]
        return self._make("mul", (a, b) if a.index < b.index else (b, a), a.mask | b.mask)

    def div(self, a: Any, b: Any) -> Any:
        if not isinstance(b, Node):
            divisor = exact(b)
            if divisor == 0:
                raise ZeroDivisionError("an expression divides by zero")
            return self.mul(a, exact(1 / Fraction(divisor)))
        if b.op == "neg":
            return self.neg(self.div(a, b.args[0]))
        if isinstance(a, Node):
            if a.op == "neg":
                return self.neg(self.div(a.args[0], b))
            return 1 if a is b else self._record("div", a, b)
        a = exact(a)
        if a == 0:
            return 0
        return self._record("div", a, b) if a > 0 else self.neg(self._record("div", -a, b))

    def neg(self, a: Any) -> Any:
        if not isinstance(a, Node):
            return -exact(a)
        if a.op == "neg":
            return a.args[0]
        negative = self._negatives.get(a)
        if negative is None:
            negative = self._negatives[a] = self._new("neg", (a,), a.mask)
        return negative

    def pow(self, base: Any, exponent: Any) -> Any:
        """Integer powers by repeated squaring, half-integer ones by a square root."""
        if not isinstance(exponent, Node):
            exponent = exact(exponent)
            if exponent < 0:
                return self.div(1, self.pow(base, -exponent))
            if isinstance(exponent, Fraction) and exponent.denominator == 2:
                return self.mul(self.pow(base, exponent.numerator // 2), self.apply("sqrt", base))
            if isinstance(exponent, int):
                if not isinstance(base, Node):
                    return exact(Fraction(exact(base)) ** exponent)
                result: Any = 1
                while exponent:
                    if exponent & 1:
                        result = self.mul(result, base)
                    exponent >>= 1
                    if exponent:
                        base = self.mul(base, base)
                return result
        return self.apply("pow", base, exponent)

    # -- functions

    def apply(self, op: str, *args: Any) -> Any:
        """Any other operation of the table, with the folding that is exact."""
        args = tuple(a if isinstance(a, (Node, bool)) else exact(a) for a in args)
        first = args[0] if args else None
        if op in _EXACT and not any(isinstance(a, Node) for a in args):
            value = _EXACT[op](*args)
            return value if isinstance(value, bool) else exact(value)
        if len(args) == 1:
            if op in _AT_ZERO and not isinstance(first, Node) and first == 0:
                return _AT_ZERO[op]
            negative = first.op == "neg" if isinstance(first, Node) else first is not None and first < 0
            if negative and op in _ODD:
                return self.neg(self.apply(op, self.neg(first)))
            if negative and op in _EVEN:
                return self.apply(op, self.neg(first))
            if op == "sqrt" and isinstance(first, (int, Fraction)) and first >= 0:
                root = Fraction(isqrt(Fraction(first).numerator), isqrt(Fraction(first).denominator))
                if root * root == first:
                    return exact(root)
        if op == "select":
            if isinstance(first, bool):
                return args[1] if first else args[2]
            if args[1] is args[2] or (not isinstance(args[1], Node) and not isinstance(args[2], Node)
                                      and args[1] == args[2]):
                return args[1]
        if op in ("and", "or"):
            for a, b in (args, args[::-1]):
                if isinstance(a, bool):
                    return b if a == (op == "and") else a
        if op not in OPERATIONS:
            raise ValueError(f"unknown operation {shown(op)}; known: {', '.join(OPERATIONS)}")
        return self._record(op, *args)

    def call(self, intrinsic: Intrinsic, values: Sequence[Any]) -> list[Any]:
        """The results of a numeric algorithm."""
        taken = [v if isinstance(v, Node) else exact(v) for v in values]
        if not any(isinstance(v, Node) and v.mask for v in taken):
            return self._called(intrinsic, taken)
        node = self._record("call", intrinsic, *taken)
        self.checks.setdefault(node, intrinsic.reason)
        return [self._record("item", node, k) for k in range(intrinsic.n_out)]

    @staticmethod
    def _called(intrinsic: Intrinsic, values: Sequence[Any]) -> list[Any]:
        """The results for numbers and for nodes without inputs, such as sqrt(2)."""
        from symdyn.tape.evaluate import constant

        results = [float(v) for v in intrinsic.rows([constant(v) for v in values])]
        if not all(map(math.isfinite, results)):
            raise ZeroDivisionError(intrinsic.reason)
        return [exact(v) for v in results]

    def item(self, results: Any, k: int) -> Any:
        """One result of a call that was recorded, or folded into a list of numbers."""
        return self._record("item", results, k) if isinstance(results, Node) else results[k]

    def sin(self, a: Any) -> Any:
        return self.apply("sin", a)

    def cos(self, a: Any) -> Any:
        return self.apply("cos", a)

    def sqrt(self, a: Any) -> Any:
        return self.apply("sqrt", a)

    def pi(self) -> Node:
        return self._record("pi")
