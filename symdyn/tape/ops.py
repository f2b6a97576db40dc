"""The table of operations: how each is counted, differentiated and evaluated.

One row an operation; printing, counting, differentiation and evaluation all read this table.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

Partials = Callable[[Any, Any, tuple], tuple]


@dataclass(frozen=True)
class Operation:
    """One row of the table.

    kind       what it counts as: add, mul, div, sqrt, trig, function, compare, intrinsic (see symdyn.tape.intrinsics) or free
    partials   (recorder, result, arguments) -> derivative by each argument; None where it is zero everywhere
    numpy, mpmath, sympy   its name in the vocabulary of each
    """

    kind: str
    partials: Partials | None
    numpy: str
    mpmath: str
    sympy: str


def _power(r: Any, y: Any, a: tuple) -> tuple:
    base, exponent = a
    return exponent * r.pow(base, exponent - 1), y * r.apply("log", base)


HALF = Fraction(1, 2)

OPERATIONS: dict[str, Operation] = {
    "add": Operation("add", lambda r, y, a: (1, 1), "add", "fadd", "Add"),
    "sub": Operation("add", lambda r, y, a: (1, -1), "subtract", "fsub", "Add"),
    "mul": Operation("mul", lambda r, y, a: (a[1], a[0]), "multiply", "fmul", "Mul"),
    "div": Operation("div", lambda r, y, a: (1 / a[1], -(y / a[1])), "divide", "fdiv", "Mul"),
    "neg": Operation("free", lambda r, y, a: (-1,), "negative", "fneg", "Mul"),
    "sqrt": Operation("sqrt", lambda r, y, a: (HALF / y,), "sqrt", "sqrt", "sqrt"),
    "pow": Operation("function", _power, "power", "power", "Pow"),
    "sin": Operation("trig", lambda r, y, a: (r.apply("cos", a[0]),), "sin", "sin", "sin"),
    "cos": Operation("trig", lambda r, y, a: (-r.apply("sin", a[0]),), "cos", "cos", "cos"),
    "tan": Operation("trig", lambda r, y, a: (1 + y * y,), "tan", "tan", "tan"),
    "asin": Operation("function", lambda r, y, a: (1 / r.apply("sqrt", 1 - a[0] * a[0]),), "arcsin", "asin", "asin"),
    "acos": Operation("function", lambda r, y, a: (-1 / r.apply("sqrt", 1 - a[0] * a[0]),), "arccos", "acos", "acos"),
    "atan": Operation("function", lambda r, y, a: (1 / (1 + a[0] * a[0]),), "arctan", "atan", "atan"),
    "atan2": Operation("function", lambda r, y, a: _atan2(*a), "arctan2", "atan2", "atan2"),
    "sinh": Operation("function", lambda r, y, a: (r.apply("cosh", a[0]),), "sinh", "sinh", "sinh"),
    "cosh": Operation("function", lambda r, y, a: (r.apply("sinh", a[0]),), "cosh", "cosh", "cosh"),
    "tanh": Operation("function", lambda r, y, a: (1 - y * y,), "tanh", "tanh", "tanh"),
    "asinh": Operation("function", lambda r, y, a: (1 / r.apply("sqrt", a[0] * a[0] + 1),), "arcsinh", "asinh", "asinh"),
    "acosh": Operation("function", lambda r, y, a: (1 / r.apply("sqrt", a[0] * a[0] - 1),), "arccosh", "acosh", "acosh"),
    "atanh": Operation("function", lambda r, y, a: (1 / (1 - a[0] * a[0]),), "arctanh", "atanh", "atanh"),
    "exp": Operation("function", lambda r, y, a: (y,), "exp", "exp", "exp"),
    "log": Operation("function", lambda r, y, a: (1 / a[0],), "log", "log", "log"),
    "abs": Operation("function", lambda r, y, a: (r.apply("sign", a[0]),), "abs", "fabs", "Abs"),
    "sign": Operation("function", None, "sign", "sign", "sign"),
    "floor": Operation("function", None, "floor", "floor", "floor"),
    "ceil": Operation("function", None, "ceil", "ceil", "ceiling"),
    "erf": Operation("function", lambda r, y, a: (2 * r.apply("exp", -(a[0] * a[0])) / r.apply("sqrt", r.pi()),),
                     "erf", "erf", "erf"),
    "min": Operation("function", lambda r, y, a: _choice(r, "le", a), "minimum", "min", "Min"),
    "max": Operation("function", lambda r, y, a: _choice(r, "ge", a), "maximum", "max", "Max"),
    "lt": Operation("compare", None, "less", "lt", "StrictLessThan"),
    "le": Operation("compare", None, "less_equal", "le", "LessThan"),
    "gt": Operation("compare", None, "greater", "gt", "StrictGreaterThan"),
    "ge": Operation("compare", None, "greater_equal", "ge", "GreaterThan"),
    "eq": Operation("compare", None, "equal", "eq", "Equality"),
    "ne": Operation("compare", None, "not_equal", "ne", "Unequality"),
    "and": Operation("compare", None, "logical_and", "and_", "And"),
    "or": Operation("compare", None, "logical_or", "or_", "Or"),
    "not": Operation("compare", None, "logical_not", "not_", "Not"),
    "select": Operation("compare", lambda r, y, a: (0, r.apply("select", a[0], 1, 0), r.apply("select", a[0], 0, 1)),
                        "where", "select", "Piecewise"),
    "guard": Operation("free", lambda r, y, a: (1, 0), "", "", ""),
    "call": Operation("intrinsic", None, "", "", ""),
    "item": Operation("free", None, "", "", ""),
    "pi": Operation("free", None, "pi", "pi", "pi"),
}


def _atan2(y: Any, x: Any) -> tuple:
    square = x * x + y * y
    return x / square, -(y / square)


def _choice(r: Any, comparison: str, a: tuple) -> tuple:
    condition = r.apply(comparison, *a)
    return r.apply("select", condition, 1, 0), r.apply("select", condition, 0, 1)
