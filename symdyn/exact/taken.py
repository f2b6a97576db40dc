"""SymPy's expressions on a tape, for exact values."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

from symdyn.errors import ArgumentError
from symdyn.model.symbols import Acceleration, Coordinate, Input, Rate, Speed, parts_of, symbols_of, time
from symdyn.shown import shown
from symdyn.tape.node import COORDINATE, PARAMETER, SPEED, Node
from symdyn.tape.recorder import Recorder
from symdyn.tape.sympy_bridge import record_expression

# Decimal numbers are taken as floats.
LEAST, MOST = sys.float_info.min, sys.float_info.max


def recorded(expressions: Iterable[Any], same: Mapping[Any, Any] | None = None) -> tuple[list[Any], dict[Node, sp.Expr]]:
    """Entries (nodes and numbers) of the expressions, and what each leaf stands for.

    same   symbol -> the one that it is taken for
    Functions without a value, such as q(t), their derivatives, and integrals are leaves; other derivatives are taken. Raises
    UnsupportedExpression for functions that no code can be generated for, ZeroDivisionError for a division by zero, ArgumentError
    for text, which is never evaluated, anything else that is no expression, and decimal numbers beyond the range of floats.
    """
    expressions = [_taken(e) for e in expressions]
    same = same or {}
    result: set[Any] = {part for part in parts_of(*expressions) if isinstance(part, (AppliedUndef, sp.Derivative, sp.Integral))}
    result = result.union(*map(symbols_of, expressions))
    recorder = Recorder()
    leaves: dict[sp.Basic, Any] = {}
    symbols: dict[Node, sp.Expr] = {}
    for k, symbol in enumerate(sorted({same.get(symbol, symbol) for symbol in result}, key=ordered)):
        leaf = recorder.leaf(f"x{k}", _kind(symbol))
        leaves[symbol], symbols[leaf] = leaf, symbol
    leaves |= {symbol: leaves[same[symbol]] for symbol in result if symbol in same}
    memory: dict[sp.Basic, Any] = {}
    return [record_expression(recorder, e, leaves, memory) for e in expressions], symbols


def ordered(part: sp.Basic) -> tuple[Any, str]:
    """A key to sort by that distinguishes symbols of one name by what is assumed of them."""
    return sp.default_sort_key(part), str(sorted(getattr(part, "assumptions0", {}).items()))


def _taken(value: Any) -> Any:
    try:
        e = sp.sympify(value, strict=True)
    except sp.SympifyError:
        raise ArgumentError(f"exact algebra takes numbers and expressions of SymPy symbols, found {shown(value)}") from None
    in_range(e)
    left = {part: part.doit(deep=False) for part in parts_of(e) if isinstance(part, sp.Derivative) and value_unknown(part)}
    return e.xreplace(left) if left else e


def in_range(e: Any) -> Any:
    """The expression itself. Raises ArgumentError if it holds a decimal number beyond the range of floats."""
    for number in parts_of(e) if isinstance(e, sp.Basic) else ():
        if isinstance(number, sp.Float) and number.is_finite and not (LEAST <= abs(number) <= MOST or number.is_zero):
            raise ArgumentError(f"the number {number.n(6)} is beyond the range of floats, {LEAST:.1e} to {MOST:.1e}; pass it as "
                                f"a fraction, sp.Rational('{number.n(6)}')")
    return e


def value_unknown(letter: sp.Basic) -> bool:
    """Whether a letter stands for an integral, or a derivative, whose value follows from what stands in it."""
    return isinstance(letter, sp.Integral) or (isinstance(letter, sp.Derivative) and not isinstance(letter.expr, AppliedUndef))


def _kind(symbol: Any) -> int:
    if isinstance(symbol, (Rate, Speed, Acceleration, Input, sp.Derivative)):
        return SPEED
    moves = isinstance(symbol, (Coordinate, AppliedUndef, sp.Integral)) or symbol == time
    return COORDINATE if moves else PARAMETER
