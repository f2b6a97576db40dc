"""Expressions of data files: a strict parser, which knows names, numbers and functions and runs nothing.

    expression   comparisons and  & | ~  over  + - * / **  over numbers, names, calls, name.dot, name.ddot, what[0], what[0, 1]
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable, Mapping
from typing import Any

import sympy as sp

from symdyn.errors import ModelError
from symdyn.model.quantity import Measure, Quantity
from symdyn.model.symbols import time
from symdyn.shown import shown

# An expression has no more characters, levels of brackets, and digits of a number that a power makes.
LONGEST, DEEPEST, DIGITS = 1_000_000, 100, 1000
_TOKEN = re.compile(r"""\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[^\W\d]\w*)|"(?P<text>[^"\\]*)"
                        |(?P<sign>\*\*|<=|>=|==|!=|[-+*/()\[\],.<>&|~]))""", re.VERBOSE)
# Functions by name, as SymPy writes them; Add, Mul and Pow are kept as they stand.
FUNCTIONS: dict[str, Callable[..., Any]] = {name: getattr(sp, name) for name in (
    "sin", "cos", "tan", "cot", "sec", "csc", "asin", "acos", "atan", "acot", "asec", "acsc", "atan2", "sinh", "cosh", "tanh",
    "coth", "sech", "csch", "asinh", "acosh", "atanh", "acoth", "asech", "acsch", "exp", "log", "sqrt", "Abs", "sign", "floor",
    "ceiling", "erf", "erfc", "sinc", "frac", "Mod", "Min", "Max", "And", "Or", "Not", "ITE", "Eq", "Ne", "Lt", "Le", "Gt", "Ge",
    "Heaviside", "Piecewise", "UnevaluatedExpr")} | {
    name: (lambda kind: lambda *given: kind(*given, evaluate=False))(getattr(sp, name)) for name in ("Add", "Mul", "Pow")}
CONSTANTS = {"pi": sp.pi, "E": sp.E, "True": sp.true, "False": sp.false, "t": time}
# Kind of quantity -> how many bodies, joints or constraints it is of, points it takes, indices in brackets.
QUANTITIES = {"position": (1, 1, 1), "velocity": (1, 1, 1), "acceleration": (1, 1, 1), "distance": (2, 2, 0),
              "rotation_matrix": (1, 0, 2), "angular_velocity": (1, 0, 1), "multiplier": (1, 0, 0), "reaction": (1, 0, 1)}
OF_POINTS = ("position", "velocity", "acceleration")
_LARGEST = {"position": (3,), "velocity": (3,), "acceleration": (3,), "rotation_matrix": (3, 3), "angular_velocity": (3,),
            "reaction": (6,)}
_BELOW = {"or": 1, "and": 2, "compare": 4, "sum": 5, "product": 6, "sign": 7, "power": 8}
_BINARY = {"|": "or", "&": "and", **dict.fromkeys(("<", "<=", ">", ">=", "==", "!="), "compare"), "+": "sum", "-": "sum",
           "*": "product", "/": "product", "**": "power"}
_COMPARED = {"<": sp.Lt, "<=": sp.Le, ">": sp.Gt, ">=": sp.Ge, "==": sp.Eq, "!=": sp.Ne}


class Wrong(Exception):
    """A text is no expression; the message says why."""


def parsed(text: str, symbols: Mapping[str, sp.Symbol]) -> sp.Expr:
    """The expression of a text. Raises Wrong.

    symbols   by name, besides t, pi and E
    """
    if len(text) > LONGEST:
        raise Wrong(f"has {len(text)} characters; the longest have {LONGEST}")
    try:
        result = _Parser(text, symbols).whole()
    except (TypeError, ValueError, AttributeError, ArithmeticError, ModelError, RecursionError) as error:
        raise Wrong(f"is {shown(text, 80)}, which is no expression: {error}") from None
    if not isinstance(result, sp.Expr):
        raise Wrong(f"is {shown(text, 80)}, a condition; write a value")
    return result


class _Parser:
    """A parser by precedence over one text."""

    def __init__(self, text: str, symbols: Mapping[str, sp.Symbol]) -> None:
        self.text, self.symbols = text, symbols
        self.tokens = self._split()
        self.at = self.depth = 0

    def _split(self) -> list[tuple[str, str, int]]:
        tokens, at = [], 0
        while self.text[at:].strip():
            result = _TOKEN.match(self.text, at)
            if result is None:
                at += len(self.text[at:]) - len(self.text[at:].lstrip())
                hint = "; names stand in double quotation marks, the expression then in single ones"
                raise Wrong(f"is {shown(self.text, 80)}; {self.text[at]!r} at character {at + 1} is no part of an expression"
                            + (hint if self.text[at] == "'" else ""))
            kind = result.lastgroup or ""
            tokens.append((kind, result[kind], result.start(kind)))
            at = result.end()
        return [*tokens, ("end", "", len(self.text))]

    def whole(self) -> Any:
        """The value of the whole text."""
        value = self._value(0)
        if self.tokens[self.at][0] != "end":
            raise self._unexpected("an operator or the end")
        return value

    def _unexpected(self, wanted: str) -> Wrong:
        kind, word, place = self.tokens[self.at]
        result = "the end" if kind == "end" else f"{word!r} at character {place + 1}"
        return Wrong(f"is {shown(self.text, 80)}; found {result}, expected {wanted}")

    def _next(self) -> tuple[str, str, int]:
        self.at += 1
        return self.tokens[self.at - 1]

    def _is(self, sign: str) -> bool:
        return self.tokens[self.at][:2] == ("sign", sign)

    def _take(self, sign: str) -> bool:
        result = self._is(sign)
        self.at += result
        return result

    def _need(self, sign: str) -> None:
        if not self._take(sign):
            raise self._unexpected(f"'{sign}'")

    def _value(self, above: int) -> Any:
        """The value up to an operator that does not bind more strongly."""
        self.depth += 1
        if self.depth > DEEPEST:
            raise Wrong(f"has more than {DEEPEST} levels; write it in parts")
        value = self._first()
        while True:
            kind, sign, _ = self.tokens[self.at]
            level = _BELOW[_BINARY[sign]] if kind == "sign" and sign in _BINARY else 0
            if level <= above:
                break
            self._next()
            value = _joined(sign, value, self._value(level - 1 if sign == "**" else level))
        self.depth -= 1
        return value

    def _first(self) -> Any:
        if self._take("-"):
            return -self._value(_BELOW["sign"])
        if self._take("+"):
            return +self._value(_BELOW["sign"])
        if self._take("~"):
            return sp.Not(self._value(_BELOW["compare"]))
        if self._take("("):
            value = self._value(0)
            if self._is(","):
                value = (value, *self._more(")"))
            self._need(")")
            return value
        kind, word, _ = self.tokens[self.at]
        if kind == "number":
            self._next()
            return _number(word)
        if kind == "name":
            self._next()
            return self._dotted(self._called(word) if self._is("(") else self._named(word))
        raise self._unexpected("a number, a name or '('")

    def _more(self, end: str) -> list[Any]:
        result = []
        while self._take(","):
            if self._is(end):
                break
            result.append(self._value(0))
        return result

    def _dotted(self, value: Any) -> Any:
        while self._take("."):
            kind, word, _ = self._next()
            if kind != "name" or word not in ("dot", "ddot") or not hasattr(value, word):
                self.at -= 1
                raise self._unexpected(f"dot or ddot of a coordinate, and {value} has none" if word in ("dot", "ddot")
                                       else "dot or ddot")
            value = getattr(value, word)
        return value

    def _named(self, word: str) -> Any:
        if word in self.symbols:
            return self.symbols[word]
        if word in CONSTANTS:
            return CONSTANTS[word]
        raise Wrong(f"is {shown(self.text, 80)}; {word} is not declared{near(word, self.symbols)}")

    def _called(self, word: str) -> Any:
        self._need("(")
        if word == "symbol":
            return self._named(self._text(")"))
        if word in QUANTITIES:
            return self._quantity(word)
        if word not in FUNCTIONS:
            raise Wrong(f"is {shown(self.text, 80)}; there is no function {word}{near(word, [*FUNCTIONS, *QUANTITIES])}")
        given = [] if self._is(")") else [self._value(0), *self._more(")")]
        self._need(")")
        return FUNCTIONS[word](*given)

    def _text(self, end: str = "") -> str:
        kind, word, _ = self.tokens[self.at]
        if kind != "text":
            raise self._unexpected("a name in quotation marks")
        self._next()
        if end:
            self._need(end)
        return word

    def _quantity(self, word: str) -> Quantity:
        n_of, n_points, n_index = QUANTITIES[word]
        of, points, frame = [self._text()], list[tuple[sp.Expr, ...]](), None
        while self._take(","):
            if self._is("["):
                points.append(self._point())
            elif word == "reaction" and frame is None:
                frame = self._text()
            else:
                of.append(self._text())
        self._need(")")
        if len(of) != n_of or len(points) > n_points:
            raise Wrong(f"is {shown(self.text, 80)}; {word} takes {n_of} name{'s' * (n_of > 1)} and up to {n_points} points")
        zero = (sp.S.Zero,) * 3
        at = (*points, *[zero] * (n_points - len(points)))
        index = self._indices(word) if n_index else ()
        order = OF_POINTS.index(word) if word in OF_POINTS else 0
        return Quantity(Measure("position" if word in OF_POINTS else word, tuple(of), at, index, order, frame))

    def _point(self) -> tuple[sp.Expr, ...]:
        self._need("[")
        result = [self._value(0), *self._more("]")]
        self._need("]")
        if len(result) not in (2, 3):
            raise Wrong(f"is {shown(self.text, 80)}; a point has {len(result)} components; write 2 or 3")
        return tuple(sp.sympify(e, strict=True) for e in [*result, sp.S.Zero][:3])

    def _indices(self, word: str) -> tuple[int, ...]:
        self._need("[")
        result = [self._value(0), *self._more("]")]
        self._need("]")
        if len(result) != len(_LARGEST[word]) or not all(
                isinstance(k, sp.Integer) and 0 <= k < n for k, n in zip(result, _LARGEST[word], strict=True)):
            ranges = " and ".join(f"0 to {n - 1}" for n in _LARGEST[word])
            raise Wrong(f"is {shown(self.text, 80)}; {word} has components {ranges}")
        return tuple(int(k) for k in result)


def _number(word: str) -> sp.Expr:
    if word.isdigit():
        if len(word) > DIGITS:
            raise Wrong(f"holds a number of {len(word)} digits; the longest have {DIGITS}")
        return sp.Integer(int(word))
    value = float(word)
    if not math.isfinite(value):
        raise Wrong(f"holds {word}, which is beyond the range of double precision")
    return sp.Float(value)


def _joined(sign: str, a: Any, b: Any) -> Any:
    if sign in _COMPARED:
        return _COMPARED[sign](a, b)
    if sign in "&|":
        return (sp.And if sign == "&" else sp.Or)(a, b)
    if isinstance(a, tuple) or isinstance(b, tuple):
        raise Wrong("has a list where a value is expected")
    if sign == "**":
        if isinstance(a, sp.Rational) and isinstance(b, sp.Rational) and abs(b) * max(
                abs(a.p).bit_length(), a.q.bit_length()) > DIGITS * 4:
            raise Wrong(f"raises {a} to the power {b}; the number has too many digits")
        return a**b
    if sign == "/":
        if b == 0:
            raise Wrong("divides by zero")
        return a / b
    return a + b if sign == "+" else a - b if sign == "-" else a * b


def near(word: str, known: Mapping[str, Any] | list[str]) -> str:
    """A hint at the nearest names, for messages."""
    result = difflib.get_close_matches(word, list(known), 3, cutoff=0.6)
    if result:
        return f"; did you mean {' or '.join(result)}?"
    few = list(known)[:12]
    return f"; there are {', '.join(few)}{', ...' if len(known) > len(few) else ''}" if few else "; there are none"
