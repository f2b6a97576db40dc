"""Expressions as texts of data files, which are read back to the same expressions."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

import sympy as sp
from sympy.printing.str import StrPrinter

from symdyn.datafile.expressions import CONSTANTS, FUNCTIONS, OF_POINTS, QUANTITIES, Wrong, parsed
from symdyn.errors import ModelError
from symdyn.model.symbols import time
from symdyn.tape.external import Result

_IDENTIFIER = re.compile(r"[^\W\d]\w*")
_RESERVED = {*CONSTANTS, *FUNCTIONS, *QUANTITIES, "symbol"}
# Whole numbers of TOML that every reader takes.
_WHOLE = 2**63


class _Printer(StrPrinter):
    """SymPy's text, with rates as name.dot, quantities by their functions, and doubles by all their digits."""

    def _print_Symbol(self, e: sp.Symbol) -> str:
        if e == time:
            return "t"
        return e.name if _IDENTIFIER.fullmatch(e.name) and e.name not in _RESERVED else f'symbol("{e.name}")'

    def _print_Dummy(self, e: sp.Dummy) -> str:
        return str(e.name)

    def _based(self, e: sp.Symbol, end: str) -> str:
        return f"{self._print_Symbol(sp.Symbol(e.name.removesuffix('_' + end)))}.{end}"

    def _print_Rate(self, e: sp.Symbol) -> str:
        return self._based(e, "dot")

    def _print_Acceleration(self, e: sp.Symbol) -> str:
        return self._based(e, "ddot")

    _print_GivenRate, _print_GivenAcceleration = _print_Rate, _print_Acceleration

    def _print_Quantity(self, e: Any) -> str:
        m = e.measure
        if m.kind != "position" and m.kind not in QUANTITIES:
            raise ModelError([f"{e} has no words in a data file; write the expression that it stands for"])
        name, order = (OF_POINTS[m.order], 0) if m.kind == "position" else (m.kind, m.order)
        names = ", ".join(f'"{one}"' for one in [*m.of, *([] if m.frame is None else [m.frame])])
        points = "".join(f", [{', '.join(map(self._print, point))}]" for point in m.points)
        index = f"[{', '.join(map(str, m.index))}]" if m.index else ""
        return f"{name}({names}{points}){index}" + (f".{'d' * order}ot" if order else "")

    def _print_Float(self, e: sp.Float) -> str:
        return repr(float(e))

    def _print_UnevaluatedExpr(self, e: sp.UnevaluatedExpr) -> str:
        return f"UnevaluatedExpr({self._print(e.args[0])})"

    def _print_Relational(self, e: Any) -> str:
        return f"({self._print(e.lhs)} {e.rel_op} {self._print(e.rhs)})"


class _AsBuilt(_Printer):
    """Sums, products and powers as functions, for expressions that SymPy would arrange otherwise."""

    def _print_Add(self, e: sp.Add, order: Any = None) -> str:
        return f"Add({', '.join(map(self._print, e.args))})"

    def _print_Mul(self, e: sp.Mul) -> str:
        return f"Mul({', '.join(map(self._print, e.args))})"

    def _print_Pow(self, e: sp.Pow, rational: bool = False) -> str:
        return f"Pow({', '.join(map(self._print, e.args))})"


def number_or_text(e: sp.Expr, symbols: Mapping[str, sp.Symbol], what: str) -> int | float | str:
    """An expression as a value of TOML: a number, or a text that is read back to the same expression.

    symbols   those that the file declares; what: where it stands, for messages
    Raises ModelError for what has no words in a file.
    """
    if isinstance(e, sp.Integer) and abs(int(e)) < _WHOLE:
        return int(e)
    if isinstance(e, sp.Float):
        return float(e)
    foreign = sorted(f.func.__name__ if not isinstance(f, Result) else f.intrinsic.label for f in e.atoms(Result))
    if foreign:
        raise ModelError([f"{what} calls {', '.join(dict.fromkeys(foreign))}, a function of the user, which is a program; a data "
                          "file holds none: describe this mechanism in Python"])
    doubles = e.xreplace({f: sp.Float(float(f)) for f in e.atoms(sp.Float)})
    for printer in (_Printer(), _AsBuilt()):
        text = printer.doprint(doubles)
        try:
            if parsed(text, symbols) == doubles:
                return str(text)
        except Wrong:
            continue
    raise ModelError([f"{what} is {e}, which has no words in a data file; write it by "
                      f"{', '.join(sorted(FUNCTIONS)[:8])} and the like"])


def dummies(expressions: Iterable[sp.Expr]) -> dict[str, sp.Symbol]:
    """The placeholders in expressions, by name."""
    return {d.name: d for e in expressions for d in e.atoms(sp.Dummy)}
