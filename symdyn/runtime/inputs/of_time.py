"""Expressions of the time as inputs: functions of t of which values are computed by SymPy, with rates for motions.

SymPy is read where expressions are given, by which it is there already.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.shown import shown

_TIME = "t"
# Functions that jump or have kinks.
_NOT_SMOOTH = ("Abs", "Heaviside", "Max", "Min", "Mod", "Piecewise", "ceiling", "floor", "frac", "sign")


def is_expression(value: Any) -> bool:
    """Whether a value is an expression of symbols; numbers of SymPy are none."""
    return bool(getattr(value, "free_symbols", None)) and hasattr(value, "diff")


def is_smooth(expression: Any) -> bool:
    """Whether an expression has none of the functions that jump or have kinks."""
    from sympy import preorder_traversal

    return not any(type(part).__name__ in _NOT_SMOOTH for part in preorder_traversal(expression))


def input_of(expression: Any, where: str) -> Callable[[float, np.ndarray], float]:
    """The function of (t, x) of an expression of the time. Raises ArgumentError where it has other symbols."""
    value = _function([_checked(expression, where)])
    return lambda t, x: value(t)[0]


def motion_of(expression: Any, where: str) -> Callable[[float], Sequence[float]]:
    """The function of t that returns value, rate and acceleration of an expression of the time.

    Raises ArgumentError where it has other symbols, and where it may jump or have kinks, whose rates are impulses or jump.
    """
    known = _checked(expression, where)
    if not is_smooth(known):
        raise ArgumentError(f"{where} is {shown(known)}, which may jump or have kinks; a motion needs a rate and an acceleration "
                            "at all times: pass a smooth expression, or a function of t that returns the three")
    (time,) = known.free_symbols
    return _function([known, known.diff(time), known.diff(time, 2)])


def _checked(expression: Any, where: str) -> Any:
    others = sorted(str(symbol) for symbol in expression.free_symbols if str(symbol) != _TIME)
    if others:
        raise ArgumentError(f"{where} is {shown(expression)}; an expression of an input has the time symdyn.t alone, found "
                            f"{', '.join(others)} in it: put numbers in their place, write the expression into the description "
                            "in place of the input, or pass a function of (t, x)")
    return expression


def _function(expressions: Sequence[Any]) -> Callable[[float], list[float]]:
    from sympy import lambdify

    time = next(iter(expressions[0].free_symbols))
    function = lambdify(time, list(expressions), ["scipy", "numpy"])

    def values(t: float) -> list[float]:
        with np.errstate(all="ignore"):  # a value that is not finite ends the motion with a message
            return [float(value) for value in function(t)]

    return values
