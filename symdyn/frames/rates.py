"""The derivative by time of expressions in coordinates with Newton's dots."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import sympy as sp

from symdyn.errors import ModelError
from symdyn.model.symbols import (
    Acceleration,
    Coordinate,
    GivenAcceleration,
    GivenMotion,
    GivenRate,
    Input,
    Rate,
    as_expression,
    partial_rate,
    symbols_of,
    time,
)
from symdyn.shown import shown


def rate(value: Any) -> Any:
    """d/dt by the chain rule: q -> q.dot -> q.ddot, and t; plain symbols are constant.

    value   an expression, or a matrix or (nested) list of them; SymPy's dynamicsymbols are taken over as coordinates
    Returns an expression for an expression, else a sp.Matrix of the same shape; a list gives a column. Nothing is simplified.
    Raises ModelError, listing all faults, for text, NaN, what is no expression, and for q.ddot and inputs, whose rates
    have no symbol.
    Source: lecture, chapter 1.7.

    >>> q = sd.coordinates("q")
    >>> sd.rate(sp.sin(q))
    q_dot*cos(q)
    """
    if isinstance(value, sp.MatrixBase):
        shape, entries = value.shape, list(value)
    elif isinstance(value, (list, tuple)) or (hasattr(value, "tolist") and value.ndim):
        shape, entries = _listed(value)
    else:
        return differentiated([taken("the expression to differentiate", value)])[0]
    result = [taken(f"entry {k + 1} of the matrix to differentiate", e) for k, e in enumerate(entries)]
    return sp.Matrix(*shape, differentiated(result))


def taken(what: str, value: Any) -> sp.Expr:
    """A number or expression with coordinates in place of dynamicsymbols. Raises ModelError for anything else."""
    try:
        return as_expression(value, what)
    except (sp.SympifyError, TypeError, ValueError):
        raise ModelError([f"{what} is {shown(value)}; pass a number or an expression of SymPy symbols"]) from None


def differentiated(expressions: Iterable[sp.Expr]) -> list[sp.Expr]:
    """The rates of expressions that were taken over. Raises ModelError naming all symbols without a rate."""
    entries = list(expressions)
    own = [symbols_of(e) for e in entries]
    symbols = sorted(set().union(*own), key=lambda s: (s.name, str(type(s))))
    faults = [fault for s in symbols for fault in _faults(s)]
    if faults:
        raise ModelError(faults)
    moving = [s for s in symbols if isinstance(s, (Coordinate, Rate, GivenMotion, GivenRate))]
    return [sp.Add(partial_rate(e) if time in there else 0, *[e.diff(s) * s.dot for s in moving if s in there])
            for e, there in zip(entries, own)]


def moves(symbol: sp.Symbol) -> bool:
    """Whether a symbol stands for something that changes with time."""
    return symbol.name == "t" or isinstance(symbol, (Coordinate, Rate, Acceleration, Input))


def _faults(symbol: sp.Symbol) -> list[str]:
    if isinstance(symbol, (Acceleration, GivenAcceleration)):
        return [f"the rate of {symbol} is asked for, a third derivative, for which there is no symbol; "
                "give the motion as an expression in sd.t"]
    if isinstance(symbol, Input) and not isinstance(symbol, (GivenMotion, GivenRate)):
        return [f"the rate of the input {symbol} is asked for, which is not known; use a coordinate or a motion, whose rate is "
                "its .dot, or an expression in sd.t"]
    if symbol.name == "t" and symbol != time:
        return ["there is a symbol t with assumptions, which is not the time; use sd.t"]
    return []


def _listed(value: Any) -> tuple[tuple[int, int], list[Any]]:
    rows = value.tolist() if hasattr(value, "tolist") else list(value)
    rows = [row.tolist() if hasattr(row, "tolist") else row for row in rows]
    if not any(isinstance(row, (list, tuple)) for row in rows):
        return (len(rows), 1), rows
    widths = {len(row) if isinstance(row, (list, tuple)) else 0 for row in rows}
    if len(widths) != 1 or 0 in widths:
        raise ModelError([f"the rows to differentiate have the lengths {sorted(widths)}; pass a matrix with rows of one length"])
    return (len(rows), widths.pop()), [e for row in rows for e in row]
