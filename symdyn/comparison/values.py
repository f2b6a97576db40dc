"""Compared form of a formula: its shape and its entries, in row-major order."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp
from sympy.logic.boolalg import BooleanFalse, BooleanTrue

from symdyn.errors import CaseError, ModelError
from symdyn.model.symbols import as_expression, symbols_of, take_over


@dataclass(frozen=True)
class Value:
    """A scalar (), a vector (n, 1) or a matrix (n, m); of an equation the residual, left minus right, with both sides."""

    shape: tuple[int, ...]
    entries: tuple[sp.Expr, ...]
    sides: tuple[Value, Value] | None = None

    def rebuilt(self) -> Value:
        """With every expression made again from its parts, as it comes back from another process: SymPy then multiplies
        numbers into sums that were factored."""
        sides = None if self.sides is None else (self.sides[0].rebuilt(), self.sides[1].rebuilt())
        done: dict[Any, Any] = {}
        return Value(self.shape, tuple([rebuilt(e, done) for e in self.entries]), sides)

    def as_sympy(self) -> Any:
        """The expression or matrix."""
        return sp.Matrix(*self.shape, list(self.entries)) if self.shape else self.entries[0]

    def replaced(self, symbols: Mapping[Any, Any]) -> Value:
        """With symbols replaced, all at once."""
        if not symbols:
            return self
        sides = None if self.sides is None else (self.sides[0].replaced(symbols), self.sides[1].replaced(symbols))
        return Value(self.shape, tuple(e.xreplace(symbols) for e in self.entries), sides)

    def indices(self) -> list[tuple[int, ...]]:
        """Place of each entry; of a vector its row."""
        if not self.shape:
            return [()]
        rows, columns = self.shape
        return [(i, j) if columns > 1 else (i,) for i in range(rows) for j in range(columns)]


def rebuilt(e: Any, done: dict[Any, Any] | None = None) -> Any:
    """An expression made again from its parts; done: part -> what was made of it."""
    if not e.args:
        return e
    done = {} if done is None else done
    result = done.get(e)
    if result is None:
        result = done[e] = e.func(*[rebuilt(part, done) for part in e.args])
    return result


def take(value: Any, what: str, faults: list[str]) -> Value | None:
    """Take over an expression, a matrix, nested lists, an equation or a pair of sides.

    what   where it stands, for the messages that are added to `faults`
    """
    if isinstance(value, BooleanTrue):
        return Value((), (sp.S.Zero,))
    if isinstance(value, BooleanFalse):
        faults.append(f"{what} is an equation that SymPy takes for false at once; pass its sides as a pair of matrices")
        return None
    if isinstance(value, sp.Equality):
        return _equation(value.lhs, value.rhs, what, faults)
    if isinstance(value, tuple) and len(value) == 2 and any(_is_matrix(side) for side in value):
        return _equation(value[0], value[1], what, faults)
    if _is_matrix(value):
        matrix = sp.Matrix(value)
        return _entries(matrix.shape, list(matrix), what, faults)
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return _nested(value, what, faults)
    return _entries((), [value], what, faults)


def taken(value: Any, what: str) -> Value:
    """The same; raises CaseError where `take` would add faults."""
    faults: list[str] = []
    result = take(value, what, faults)
    if result is None:
        raise CaseError(faults)
    return result


def _is_matrix(value: Any) -> bool:
    return isinstance(value, (sp.MatrixBase, sp.MatrixExpr))


def _nested(value: Any, what: str, faults: list[str]) -> Value | None:
    rows = [list(row) if isinstance(row, (list, tuple)) else [row] for row in value]
    widths = sorted({len(row) for row in rows})
    if len(widths) != 1 or not widths[0]:
        faults.append(f"{what} has rows of {' and '.join(map(str, widths)) or 'no'} entries; give all rows the same length")
        return None
    return _entries((len(rows), widths[0]), [e for row in rows for e in row], what, faults)


def _entries(shape: tuple[int, ...], entries: Iterable[Any], what: str, faults: list[str]) -> Value | None:
    taken = []
    for entry in entries:
        try:
            taken.append(as_expression(entry, what))
        except ModelError as error:
            faults += error.faults
            return None
    return Value(shape, tuple(taken))


def _equation(left: Any, right: Any, what: str, faults: list[str]) -> Value | None:
    sides = []
    for side, name in ((left, "left"), (right, "right")):
        taken = take(side, f"the {name} side of {what}", faults)
        if taken is None:
            return None
        sides.append(taken)
    if sides[0].shape != sides[1].shape:
        faults.append(f"the sides of {what} have shapes {sides[0].shape} and {sides[1].shape}; they must be the same")
        return None
    residual = tuple(a - b for a, b in zip(sides[0].entries, sides[1].entries))
    return Value(sides[0].shape, residual, (sides[0], sides[1]))


def canonical(*groups: Iterable[sp.Expr]) -> dict[sp.Symbol, sp.Symbol]:
    """Symbols of the same name -> one real symbol, positive if one of them is: slides do not state assumptions."""
    symbols = sorted({s for group in groups for e in group for s in symbols_of(e)}, key=lambda s: (s.name, str(type(s))))
    positive = {s.name for s in symbols if s.is_positive}
    return {s: sp.Symbol(s.name, positive=True) if s.name in positive else sp.Symbol(s.name, real=True) for s in symbols}


def renaming(given: Mapping[Any, Any], what: str, faults: list[str]) -> dict[str, sp.Expr]:
    """Name of a symbol -> the expression that takes its place."""
    result = {}
    for key, value in given.items():
        symbol = take_over(key) if isinstance(key, sp.Basic) else key
        if not isinstance(symbol, (sp.Symbol, str)):
            faults.append(f"{what} replaces {key!r}; only symbols, or their names, can be replaced")
            continue
        taken = take(value, f"{what} of {symbol}", faults)
        if taken is not None and taken.shape == ():
            result[str(symbol)] = taken.entries[0]
        elif taken is not None:
            faults.append(f"{what} of {symbol} is a matrix; pass an expression")
    return result


def by_name(value: Value, replacements: Mapping[str, sp.Expr]) -> dict[sp.Symbol, sp.Expr]:
    """Those replacements that the value's symbols ask for."""
    if not replacements:
        return {}
    symbols = {s for e in value.entries for s in symbols_of(e)}
    if value.sides is not None:
        symbols |= {s for side in value.sides for e in side.entries for s in symbols_of(e)}
    return {s: replacements[s.name] for s in symbols if s.name in replacements}
