"""Formulas of a comparison in LaTeX, and as MathML for pages that need no network."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from typing import Any

import sympy as sp

from symdyn.comparison.verdict import EntryResult, FormulaResult, Verdict
from symdyn.errors import MissingExtra
from symdyn.model.symbols import Coordinate
from symdyn.report.latex import columns, letters, named_entries, wrapped

# Expressions with more operations than this, written out, are not typeset: nobody reads them.
READABLE = 120
# Entries of one formula that a list of errata shows; more of the same kind are counted.
SHOWN = 4
# Rows of a matrix that a page of the document holds.
HIGHEST = 36
Places = Collection[tuple[int, ...]]


def formula_latex(value: Any, marked: Places = (), color: str = "#b00020") -> str:
    """An expression, a matrix, or both sides of an equation; entries at the marked places, of equations rows, in the colour."""
    if isinstance(value, tuple):
        if not _by_rows(value, marked):
            return _colored(" = ".join(formula_latex(side) for side in value), bool(marked), color)
        return " = ".join(formula_latex(side, marked, color) for side in value)
    if not isinstance(value, sp.MatrixBase):
        return _colored(_entry(value), bool(marked), color)
    return _matrix(_cells(value), value, marked, color)


def _by_rows(sides: tuple[Any, Any], marked: Places) -> bool:
    return all(isinstance(side, sp.MatrixBase) for side in sides) and sides[0].shape == sides[1].shape and () not in marked


def _cells(value: Any) -> list[list[str]]:
    return [[_entry(value[i, j]) for j in range(value.cols)] for i in range(value.rows)]


def _matrix(cells: Sequence[Sequence[str]], value: Any, marked: Places, color: str) -> str:
    rows = [" & ".join(_colored(text, _index(value, i, j) in marked, color) for j, text in enumerate(row))
            for i, row in enumerate(cells)]
    return _colored(r"\left[\begin{matrix}" + r"\\".join(rows) + r"\end{matrix}\right]", () in marked, color)


def _index(value: Any, i: int, j: int) -> tuple[int, ...]:
    return (i, j) if value.cols > 1 else (i,)


@lru_cache(maxsize=1 << 14)  # reports need the same entries several times, for their width and for each document
def _entry(value: sp.Expr) -> str:
    operations = _operations(value)
    if operations > READABLE:
        return rf"\langle {operations}\ \text{{operations}} \rangle"
    return str(sp.latex(value, mul_symbol=r"\,"))


def _operations(value: sp.Expr) -> int:
    long = next(islice(sp.preorder_traversal(value), READABLE, None), None) is not None  # only those are worth counting
    return int(sp.count_ops(value)) if long else 0


def _colored(text: str, marked: bool, color: str) -> str:
    return rf"\textcolor{{{color}}}{{{text}}}" if marked else text


def width(value: Any) -> float:
    """About how wide a formula becomes, in letters; infinite where it is higher than a page, so that no line holds it."""
    if isinstance(value, tuple):
        return width(value[0]) + width(value[1]) + 3
    if not isinstance(value, sp.MatrixBase):
        return letters(_entry(value))
    return columns(_cells(value)) + 2 if value.rows <= HIGHEST else math.inf


@dataclass(frozen=True)
class Lines:
    """Lines of LaTeX, each a formula for itself, for what is too wide for one.

    room   letters in a line
    """

    room: float
    color: str = "#b00020"

    def of(self, value: Any, marked: Places = (), left: str = "") -> list[str]:
        """Lines of `left = value`. The longest entries of a matrix get names and stand below; where that is not enough, the
        entries that are not zero are listed. Equations of matrices are listed row by row."""
        start = f"{left} = " if left else ""
        if width(value) + letters(start) <= self.room:
            return [start + formula_latex(value, marked, self.color)]
        if isinstance(value, tuple):
            return self._equation(value, marked, start)
        if isinstance(value, sp.MatrixBase):
            return self._of_matrix(value, marked, start)
        return self._sum(value, bool(marked), start)

    def _equation(self, sides: tuple[Any, Any], marked: Places, start: str) -> list[str]:
        if not isinstance(sides[0], sp.MatrixBase):
            return [*self._sum(sides[0], bool(marked), start), *self._sum(sides[1], bool(marked), r"\quad = ")]
        if not _by_rows(sides, ()):
            return [*self.of(sides[0], marked, start.removesuffix(" = ")), *self.of(sides[1], marked, r"\quad")]
        lines = [start.removesuffix(" = ")] if start else []
        for i in range(sides[0].rows):
            for j in range(sides[0].cols):
                index = _index(sides[0], i, j)
                row = self.of((sides[0][i, j], sides[1][i, j]), () if {(), index}.isdisjoint(marked) else [()])
                lines += [rf"{_named(index)}\colon\enspace {row[0]}", *row[1:]]
        return lines

    def _of_matrix(self, value: Any, marked: Places, start: str) -> list[str]:
        cells = _cells(value)
        short, below = named_entries(cells, self.room - letters(start) - 2, lambda i, j: _named(_index(value, i, j)))
        every = [(i, j) for i in range(value.rows) for j in range(value.cols)]
        fits = columns(short) + letters(start) + 2 <= self.room and value.rows <= HIGHEST
        if fits:
            lines, places = [start + _matrix(short, value, marked, self.color)], sorted((i, j) for i, j, _ in below)
            if not start and places == every:  # a matrix of names says nothing
                lines = []
        else:
            lines = [rf"{start}{value.rows} \times {value.cols}\text{{, entries that are not zero:}}"]
            places = [p for p in every if value[p] != 0 or _index(value, *p) in marked]
        for i, j in places:
            # Equal entries share a name, that of the first.
            red = {(), *(_index(value, a, b) for a, b in every if (a, b) == (i, j) or (fits and cells[a][b] == cells[i][j]))}
            lines += self._sum(value[i, j], not red.isdisjoint(marked), f"{_named(_index(value, i, j))} = ")
        return lines

    def _sum(self, value: sp.Expr, marked: bool, start: str) -> list[str]:
        long = _operations(value) > READABLE
        parts = [_entry(value)] if long else wrapped(value, self.room - letters(start) - 3, r"\,")
        first, *rest = [_colored(part, marked, self.color) for part in parts]
        return [start + first, *[rf"\quad {part}" for part in rest]]


def _named(index: tuple[int, ...]) -> str:
    """The name of an entry: its row and column, in brackets."""
    return rf"\langle {'{,}'.join(str(i + 1) for i in index)} \rangle"


def where_latex(formula: FormulaResult) -> list[str]:
    """Substitutions in both sides before they were compared, symbol by symbol."""
    return [f"{_symbol(name)} = {_entry(e)}" for name, e in formula.where]


def where_lines(formula: FormulaResult, room: float) -> list[str]:
    """The same in lines."""
    lines: list[str] = []
    for (name, e), text in zip(formula.where, where_latex(formula)):
        if lines and letters(lines[-1]) + letters(text) + 3 <= room:
            lines[-1] += rf",\enspace {text}"
        else:
            lines += Lines(room).of(e, (), _symbol(name))
    return lines


def _symbol(name: str) -> str:
    head, dots, _ = name.partition("_dot") if name.endswith("_dot") else name.partition("_ddot")
    symbol = Coordinate(head)
    return str(sp.latex(symbol if not dots else symbol.dot if dots == "_dot" else symbol.ddot))


def marked(formula: FormulaResult) -> set[tuple[int, ...]]:
    """Places of the entries that are wrong, different or not decided."""
    return {e.index for e in formula.entries if e.verdict in (Verdict.WRONG, Verdict.DIFFERENT, Verdict.UNDECIDED)}


@dataclass(frozen=True)
class Correction:
    """Printed and right form: an entry with its place, or the whole formula with the places that are wrong."""

    place: str
    printed: Any
    right: Any
    wrong: frozenset[tuple[int, ...]] = frozenset({()})


def corrections(formula: FormulaResult, places: Places) -> list[Correction]:
    """The first entries at the places; an equation, or a formula of another shape, whole."""
    entries: list[EntryResult] = [e for e in formula.entries if e.index in places]
    if isinstance(formula.printed, tuple) or not all(e.index for e in entries):
        return [Correction("", formula.printed, formula.derived, frozenset(places))]
    return [Correction(place(formula, e.index), e.printed, e.right) for e in entries[:SHOWN]]


def place(formula: FormulaResult, index: tuple[int, ...]) -> str:
    """Row and column counted from 1, as one reads a matrix; nothing where there is one entry."""
    if not index or len(formula.entries) == 1:
        return ""
    return f"row {index[0] + 1}" + (f", column {index[1] + 1}" if len(index) > 1 else "")


def mathml(latex: str) -> str:
    """A formula for a page. Raises MissingExtra without latex2mathml."""
    try:
        from latex2mathml.converter import convert
    except ImportError:
        raise MissingExtra("pages with formulas need latex2mathml; install it with: pip install 'symdyn[report]'") from None
    return _OPERATOR.sub("<mo>", _ENTITY.sub(_character, str(convert(latex))))


# Attributes of brackets that browsers assume by themselves, and characters by number: half of a page.
_OPERATOR = re.compile(r'<mo stretchy="true" fence="true" form="(?:prefix|postfix)">')
_ENTITY = re.compile(r"&#x([0-9A-F]+);")


def _character(entity: re.Match[str]) -> str:
    character = chr(int(entity[1], 16))
    return entity[0] if character in "<>&" else character
