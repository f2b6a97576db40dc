"""Formulas of a comparison in LaTeX, and as MathML for pages that need no network."""

from __future__ import annotations

import re
from collections.abc import Collection
from itertools import islice
from typing import Any

import sympy as sp

from symdyn.comparison.verdict import EntryResult, FormulaResult, Verdict
from symdyn.errors import MissingExtra

# Expressions with more operations than this, written out, are not typeset: nobody reads them.
READABLE = 120
# Entries of one formula that a list of errata shows; more of the same kind are counted.
SHOWN = 4
Places = Collection[tuple[int, ...]]


def formula_latex(value: Any, marked: Places = (), color: str = "#b00020") -> str:
    """An expression, a matrix, or both sides of an equation; entries at the marked places in the colour."""
    if isinstance(value, tuple):
        left, right = value
        whole = {()} if marked else ()
        return _colored(f"{formula_latex(left)} = {formula_latex(right)}", () in whole, color)
    if not isinstance(value, sp.MatrixBase):
        return _colored(_entry(value), bool(marked), color)
    rows = []
    for i in range(value.rows):
        places = [(i, j) if value.cols > 1 else (i,) for j in range(value.cols)]
        rows.append(" & ".join(_colored(_entry(value[i, j]), place in marked, color) for j, place in enumerate(places)))
    return r"\left[\begin{matrix}" + r"\\".join(rows) + r"\end{matrix}\right]"


def _entry(value: sp.Expr) -> str:
    if next(islice(sp.preorder_traversal(value), READABLE, None), None) is not None:  # only long ones are worth counting
        operations = int(sp.count_ops(value))
        if operations > READABLE:
            return rf"\langle {operations}\ \text{{operations}} \rangle"
    return str(sp.latex(value, mul_symbol=r"\,"))


def _colored(text: str, marked: bool, color: str) -> str:
    return rf"\textcolor{{{color}}}{{{text}}}" if marked else text


def where_latex(formula: FormulaResult) -> str:
    """What was put into both sides before they were compared."""
    return r",\enspace ".join(f"{sp.latex(sp.Symbol(name))} = {_entry(e)}" for name, e in formula.where)


def marked(formula: FormulaResult) -> set[tuple[int, ...]]:
    """Places of the entries that are wrong, different or not decided."""
    return {e.index for e in formula.entries if e.verdict in (Verdict.WRONG, Verdict.DIFFERENT, Verdict.UNDECIDED)}


def corrections(formula: FormulaResult, places: Places) -> list[tuple[str, str, str]]:
    """Place, print and right form in LaTeX of the first entries at the places; an equation, or a formula of another shape,
    whole."""
    entries: list[EntryResult] = [e for e in formula.entries if e.index in places]
    if isinstance(formula.printed, tuple) or not all(e.index for e in entries):
        return [("", formula_latex(formula.printed), formula_latex(formula.derived))]
    return [(place(e.index), formula_latex(e.printed), formula_latex(e.right)) for e in entries[:SHOWN]]


def place(index: tuple[int, ...]) -> str:
    """Row and column counted from 1, as one reads a matrix."""
    if not index:
        return ""
    return f"row {index[0] + 1}" + (f", column {index[1] + 1}" if len(index) > 1 else "")


def mathml(latex: str) -> str:
    """A formula for a page. Raises MissingExtra without latex2mathml."""
    try:
        from latex2mathml.converter import convert
    except ImportError:
        raise MissingExtra("pages with formulas need latex2mathml; install it with: pip install 'symdyn[report]'") from None
    return _OPERATOR.sub("<mo>", _ENTITY.sub(_character, str(convert(latex))))


# What a browser knows of brackets without being told, and characters by number: half of a page.
_OPERATOR = re.compile(r'<mo stretchy="true" fence="true" form="(?:prefix|postfix)">')
_ENTITY = re.compile(r"&#x([0-9A-F]+);")


def _character(entity: re.Match[str]) -> str:
    character = chr(int(entity[1], 16))
    return entity[0] if character in "<>&" else character
