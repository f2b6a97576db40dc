"""Values that no call should be given, with what is wrong about each.

Tags say what a value is: "text", "nul" (text with a NUL), "long", "number", "whole", "negative", "beyond" (the range of doubles),
"not finite", "complex", "masked", "array", "empty", "mapping", "unknown" (names), "flag", "function", "symbol", "none", "object".
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp


class Untold:
    """Something whose repr, truth and length cannot be asked for."""

    def __repr__(self) -> str:
        raise RuntimeError("this object has no repr")

    def __bool__(self) -> bool:
        raise RuntimeError("this object is neither true nor false")


@dataclass(frozen=True)
class Value:
    """A hostile value by name, made afresh for every call."""

    name: str
    make: Callable[[], Any]
    tags: frozenset[str]


def _value(name: str, make: Callable[[], Any], *tags: str) -> Value:
    return Value(name, make, frozenset(tags))


def _cyclic() -> list[Any]:
    """A list that is an entry of itself."""
    result: list[Any] = []
    result.append(result)
    return result


VALUES: tuple[Value, ...] = (
    _value("nan", lambda: float("nan"), "not finite", "number"),
    _value("inf", lambda: float("inf"), "not finite", "number"),
    _value("-inf", lambda: float("-inf"), "not finite", "number"),
    _value("sp.nan", lambda: sp.nan, "not finite"),
    _value("sp.oo", lambda: sp.oo, "not finite"),
    _value("10**400", lambda: 10**400, "beyond", "whole"),
    _value("-10**400", lambda: -10**400, "beyond", "whole", "negative"),
    _value("10**5000", lambda: 10**5000, "beyond", "whole"),
    _value("10**12", lambda: 10**12, "whole"),
    _value("2**63", lambda: 2**63, "whole"),
    _value("1e308", lambda: 1e308, "number"),
    _value("-1e308", lambda: -1e308, "number", "negative"),
    _value("1e-320", lambda: 1e-320, "number"),
    _value("-1", lambda: -1, "whole", "negative"),
    _value("0", lambda: 0, "whole"),
    _value("-0.0", lambda: -0.0, "number"),
    _value("1j", lambda: 1j, "complex"),
    _value("1+0j", lambda: 1 + 0j, "complex"),
    _value("complex64", lambda: np.complex64(1), "complex"),
    _value("sp.I", lambda: sp.I, "complex"),
    _value("complex array", lambda: np.array([1 + 2j, 0.5, 0.1, 0.2]), "complex", "array"),
    _value("complex array of 1", lambda: np.array([1 + 0j]), "complex", "array"),
    _value("complex 0-d", lambda: np.array(1 + 2j), "complex", "array"),
    _value("masked", lambda: np.ma.masked, "masked"),
    _value("masked array", lambda: np.ma.array([0.1, 0.2, 0.3, 0.4], mask=[False, True, False, False]), "masked", "array"),
    _value("masked array of 1", lambda: np.ma.array([0.1], mask=[True]), "masked", "array"),
    _value("masked array without mask", lambda: np.ma.array([0.1, 0.2]), "masked", "array"),
    _value("''", lambda: "", "text", "empty"),
    _value("' '", lambda: " ", "text"),
    _value("'1.5'", lambda: "1.5", "text"),
    _value("'nan'", lambda: "nan", "text"),
    _value("text with NUL", lambda: "a\0b", "text", "nul"),
    _value("text with line break", lambda: "a\nb */ int x; /*", "text"),
    _value("text with surrogate", lambda: "a\udc80b", "text"),
    _value("program", lambda: "__import__('os').abort()", "text"),
    _value("format", lambda: "%s%n{0}{x!r}", "text"),
    _value("long text", lambda: "q" * 100_000, "text", "long"),
    _value("long name", lambda: "q" * 300, "text", "long"),
    _value("path up", lambda: "../../x", "text"),
    _value("bytes", lambda: b"1.5", "text"),
    _value("array of text", lambda: np.array(["1.5", "2.5"]), "text", "array"),
    _value("list of text", lambda: ["1.5", "2.5"], "text", "array"),
    _value("date", lambda: np.datetime64("2020-01-01"), "object"),
    _value("array of dates", lambda: np.array(["2020-01-01"], dtype="M8[D]"), "object", "array"),
    _value("None", lambda: None, "none"),
    _value("True", lambda: True, "flag"),
    _value("np.True_", lambda: np.True_, "flag"),
    _value("object", object, "object"),
    _value("object without repr", Untold, "object"),
    _value("class", lambda: dict, "object"),
    _value("function", lambda: (lambda *a, **k: float("nan")), "function"),
    _value("function that raises", lambda: (lambda *a, **k: 1 // 0), "function"),
    _value("iterator", lambda: iter([0.1, 0.2]), "object"),
    _value("set", lambda: {1.0, 2.0}, "object"),
    _value("Ellipsis", lambda: Ellipsis, "object"),
    _value("NotImplemented", lambda: NotImplemented, "object"),
    _value("slice", lambda: slice(0, 1), "object"),
    _value("[]", list, "empty", "array"),
    _value("()", tuple, "empty", "array"),
    _value("{}", dict, "empty", "mapping"),
    _value("{'no': 1}", lambda: {"no": 1}, "mapping", "unknown"),
    _value("{None: nan}", lambda: {None: float("nan")}, "mapping", "unknown"),
    _value("{10**5000: 1}", lambda: {10**5000: 1}, "mapping", "unknown"),
    _value("list in itself", _cyclic, "object", "array"),
    _value("rows of two lengths", lambda: [[1.0, 2.0], [3.0]], "object", "array"),
    _value("0-d", lambda: np.array(0.5), "number"),
    _value("0-d nan", lambda: np.array(np.nan), "not finite"),
    _value("0-d object", lambda: np.array(None, dtype=object), "object"),
    _value("empty array", lambda: np.zeros(0), "empty", "array"),
    _value("empty rows", lambda: np.zeros((0, 4)), "empty", "array"),
    _value("array of 3 axes", lambda: np.zeros((2, 2, 2)), "array"),
    _value("array with nan", lambda: np.array([0.1, np.nan, 0.1, 0.1]), "not finite", "array"),
    _value("long array", lambda: np.zeros(10_000), "array"),
    _value("object array", lambda: np.array([0.1, None, "x", 2j], dtype=object), "object", "array"),
    _value("object array with 10**400", lambda: np.array([10**400, 1, 1, 1], dtype=object), "beyond", "array"),
    _value("list with 10**400", lambda: [10**400, 0.1, 0.1, 0.1], "beyond", "array"),
    _value("structured array", lambda: np.zeros(2, dtype=[("a", float), ("b", int)]), "object", "array"),
    _value("read-only array", lambda: np.broadcast_to(0.1, (4,)), "array"),
    _value("symbol", lambda: sp.Symbol("no_such_symbol"), "symbol"),
    _value("sympy function", lambda: sp.Function("f")(sp.Symbol("x")), "symbol"),
    _value("sympy matrix", lambda: sp.Matrix([[1, 2], [3, 4]]), "array"),
    _value("sympy 1/0", lambda: sp.zoo, "not finite"),
    _value("sympy relation", lambda: sp.Symbol("x") > 0, "object"),
)
