"""Collects the faults of a description, so that one message lists all of them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import ModelError
from symdyn.model.bodies import Body
from symdyn.model.symbols import as_expression, finite, flat
from symdyn.model.sympy_vectors import components, is_dyadic, is_frame, is_point, is_sympy_vector, located
from symdyn.shown import name_of, shown

# Names stand in the comments and tables of generated code: what could end a comment or a text is left out.
NAME = re.compile(r"[\w .,:+*/^'(){}\[\]%#-]*\w[\w .,:+*/^'(){}\[\]%#-]*")
# Signs that units are written with, and what they are in plain text.
_SIGNS = str.maketrans({"\u00b7": " ", "\u22c5": " ", "\u2212": "-", "\u03a9": "ohm", "\u2126": "ohm", "\u00b0": "deg"})
_RAISED = dict(zip("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-", strict=True))


class Faults(list[str]):
    """A list of faults with the checks that fill it; a faulty value is replaced by zero so that checking goes on."""

    def expression(self, value: Any, what: str) -> sp.Expr:
        """A scalar expression."""
        try:
            return as_expression(value, what)
        except ModelError as error:
            self.extend(error.faults)
        except (sp.SympifyError, TypeError, ValueError):
            self.append(f"{what} is {shown(value)}; pass a number or an expression of SymPy symbols")
        return sp.S.Zero

    def vector(self, value: Any, what: str, planar: bool = False, frame: Any = None) -> sp.ImmutableMatrix:
        """A vector of 3 components; in a planar system 2 components, which get a zero third.

        frame   the ReferenceFrame in which a vector of SymPy's may be written, or the body in whose axes it may be written, whose
                frame is made for such a vector only; anything else: such vectors are rejected
        """
        if is_sympy_vector(value):
            value = self._written(value, frame, what, sp.zeros(3, 1))
        entries = self._entries(value, what)
        sizes = (2, 3) if planar else (3,)
        if len(entries) not in sizes:
            self.append(f"{what} has {len(entries)} components; pass {' or '.join(map(str, sizes))}")
            entries = [0, 0, 0]
        row = [self.expression(e, f"{what}, component {k + 1}") for k, e in enumerate(entries)]
        return matrix_of(3, 1, *row, *[sp.S.Zero] * (3 - len(row)))

    def point(self, value: Any, what: str, planar: bool = False, body: Any = None) -> sp.ImmutableMatrix:
        """A point of a body, from its origin in its axes: as `vector`, or a Point of SymPy's that is located from the origin.

        body   the body, or its name
        """
        if is_point(value):
            value = self.located(value, body.origin if isinstance(body, Body) else None, what)
        return self.vector(value, what, planar, body)

    def located(self, point: Any, origin: Any, what: str) -> Any:
        """The vector to a Point of SymPy's from a body's origin, which is another; zero where that is not known."""
        try:
            return located(point, origin, what)
        except ModelError as error:
            self.extend(error.faults)
            return [0, 0, 0]

    def expressions(self, value: Any, what: str) -> tuple[sp.Expr, ...]:
        """Any number of scalar expressions; a single one stands for itself."""
        if isinstance(value, sp.MatrixBase):
            entries = list(value)
        elif isinstance(value, np.ma.MaskedArray):
            return (self.expression(np.ma.masked, what),)
        else:
            if hasattr(value, "ravel"):
                value = value.ravel().tolist()
            entries = list(value) if isinstance(value, (list, tuple)) else [value]
        return tuple(self.expression(e, what) for e in entries)

    def matrix(self, value: Any, what: str, frame: Any = None) -> sp.ImmutableMatrix:
        """A 3 x 3 matrix; a list of 3 stands for its diagonal; frame: as for `vector`, of dyadics."""
        if is_dyadic(value):
            value = self._written(value, frame, what, sp.zeros(3, 3))
        entries = self._entries(value, what)
        if len(entries) == 3 and all(not _is_row(e) for e in entries):
            entries = [[entries[0], 0, 0], [0, entries[1], 0], [0, 0, entries[2]]]
        elif len(entries) == 9 and hasattr(value, "shape") and tuple(value.shape) == (3, 3):
            entries = [entries[0:3], entries[3:6], entries[6:9]]
        if len(entries) != 3 or any(not _is_row(row) or len(row) != 3 for row in entries):
            self.append(f"{what} is not a 3 x 3 matrix; pass three rows of three, or the three diagonal entries")
            return sp.ImmutableMatrix(sp.zeros(3, 3))
        return matrix_of(3, 3, *[self.expression(e, f"{what}[{i + 1}, {j + 1}]")
                                 for i, row in enumerate(entries) for j, e in enumerate(row)])

    def numbers(self, values: Any, known: Sequence[sp.Symbol], what: str, kind: str,
                meant: Callable[[sp.Basic], sp.Basic]) -> dict[sp.Symbol, float]:
        """Numbers for some of the known symbols, by symbol or name.

        kind    what each of the known symbols is, in messages
        meant   symbol that is given -> the one that it stands for
        """
        names = {s.name: s for s in known}
        numbers: dict[sp.Symbol, float] = {}
        if values is not None and not isinstance(values, Mapping):
            self.append(f"{what} is {shown(values)}; pass a mapping from symbols or names to numbers")
            return numbers
        for key, value in (values or {}).items():
            name = name_of(meant(key) if isinstance(key, sp.Basic) else key)
            if name not in names:
                self.append(f"{what} has a number for {shown(name)}, which is no {kind}; there are {', '.join(names) or 'none'}")
                continue
            number = finite(value)
            if number is None:
                self.append(f"{what}: the value of {name} is {shown(value)}; pass a finite number, real and within double "
                            "precision")
            else:
                numbers[names[name]] = number
        return numbers

    def square(self, value: Any, n: int, what: str) -> sp.ImmutableMatrix:
        """An n x n matrix; a list of n stands for its diagonal."""
        rows = None if isinstance(value, np.ma.MaskedArray) else value.tolist() if hasattr(value, "tolist") else value
        if isinstance(rows, (list, tuple)) and len(rows) == n:
            if not any(_is_row(e) for e in rows):
                rows = [[e if i == k else 0 for k in range(n)] for i, e in enumerate(rows)]
            if all(_is_row(row) and len(row) == n for row in rows):
                return sp.ImmutableMatrix(n, n, [self.expression(e, f"{what}[{i + 1}, {j + 1}]")
                                                 for i, row in enumerate(rows) for j, e in enumerate(row)])
        self.append(f"{what} is not a {n} x {n} matrix; pass {n} rows of {n}, or the {n} diagonal entries")
        return sp.ImmutableMatrix(sp.zeros(n, n))

    def _written(self, value: Any, frame: Any, what: str, harmless: sp.Matrix) -> sp.Matrix:
        try:
            known = frame.frame if isinstance(frame, Body) and isinstance(frame.name, str) else frame
            return components(value, known if is_frame(known) or isinstance(known, str) else None, what)
        except ModelError as error:
            self.extend(error.faults)
            return harmless

    def _entries(self, value: Any, what: str) -> list:
        if isinstance(value, sp.MatrixBase):
            return list(flat(value))
        if isinstance(value, np.ma.MaskedArray):
            self.append(f"{what} is a masked array; pass a list of numbers or expressions")
            return [0, 0, 0]
        if hasattr(value, "tolist"):
            value = value.tolist()
        if not isinstance(value, Sequence) or isinstance(value, (str, bytes, bytearray)):
            self.append(f"{what} is {shown(value)}; pass a list of numbers or expressions")
            return [0, 0, 0]
        if value and all(_is_row(row) for row in value) and all(len(row) == 1 for row in value):
            return [row[0] for row in value]
        return list(value)


@lru_cache(maxsize=256)
def matrix_of(rows: int, columns: int, *entries: sp.Expr) -> sp.ImmutableMatrix:
    """A matrix; bodies that are alike have the same ones again and again, and SymPy takes long to make one."""
    return sp.ImmutableMatrix(rows, columns, entries)


def _is_row(value: Any) -> bool:
    return isinstance(value, (list, tuple))


def plain_unit(unit: str) -> str:
    """A unit in plain text: "kg·m²" as "kg m^2"."""
    raised = re.sub(f"[{''.join(_RAISED)}]+", lambda result: "^" + "".join(_RAISED[c] for c in result[0]), unit)
    return raised.translate(_SIGNS).replace("**", "^")
