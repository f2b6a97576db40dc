"""Equations on a page: symbols with numbers, quantities as MathML, long ones through the steps that the derivation names."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from symdyn.comparison.typeset import mathml
from symdyn.formulation.equations import Equations
from symdyn.report.notation import NOTATION
from symdyn.tape.node import Node

USUAL, OF_CONSTRAINTS = ("M_tilde", "k_tilde", "F_tilde"), ("C", "C_r", "F_d")
# Operations written out up to which a quantity is simplified and shown whole; operations of its tape up to which it is shown
# step by step.
WHOLE, BY_STEPS = 500, 1000
# Letters in a line.
WIDTH = 100
# Lines of a quantity from which on its entries are folded away.
MANY = 25
# 0.09999999999999998 is read better as 0.1.
_LONG_NUMBER = re.compile(r"\d+\.\d{13,}")
_MEANING = {row.code: row.meaning for row in NOTATION}


@dataclass(frozen=True)
class Line:
    """A line of a formula, HTML; more: it goes on with the line before."""

    math: str
    more: bool = False


@dataclass(frozen=True)
class Quantity:
    """A quantity: its lines, or the note that says why there are none.

    steps   how many lines are steps on the way to it; shown: the first line after these that is only shown if requested
    """

    name: str
    meaning: str
    lines: tuple[Line, ...] = ()
    note: str = ""
    steps: int = 0
    shown: int = 0
    legend: str = ""


@dataclass(frozen=True)
class SymbolRow:
    """A symbol: as HTML, in code, its unit and its number."""

    symbol: str
    code: str
    unit: str
    value: str


@dataclass(frozen=True)
class SymbolTable:
    """Symbols of a kind; what: the meaning of their numbers."""

    title: str
    what: str
    rows: tuple[SymbolRow, ...]


def written_out(equations: Equations, name: str) -> int:
    """Operations of a quantity as explicit expressions, where nothing is shared."""
    tape = equations.tape(name)
    counts: dict[Node, int] = {}
    for node in tape.steps:
        below = sum(counts[a] for a in node.args if isinstance(a, Node)) if node.op != "leaf" else -1
        counts[node] = 1 + below
    return sum(counts[e] for e in tape.outputs[name].entries if isinstance(e, Node))


def form(equations: Equations) -> str:
    """The equations of motion in letters, LaTeX."""
    left, right = r"\tilde{\mathbf{M}}\,\dot{\mathbf{u}} + \tilde{\mathbf{k}}", r"\tilde{\mathbf{F}}"
    if not equations.constraints:
        return f"{left} = {right}"
    return (rf"{left} + \mathbf{{C}}_{{\mathbf{{r}}}}^{{T}}\boldsymbol{{\lambda}} = {right}"
            r",\quad \mathbf{C}_{\mathbf{r}}\,\dot{\mathbf{u}} = \mathbf{F}^{d},\quad \mathbf{C} = \mathbf{0}")


def symbols(equations: Equations) -> tuple[SymbolTable, ...]:
    """Tables of the symbols that there are."""
    s, typeset = equations.symbols, typesetter()
    tables = []
    for title, group, numbers, what in (
            ("Coordinates q", s.coordinates, s.initial, "start"), ("Speeds u", s.speeds, s.initial, "start"),
            ("Extra states z", s.states, s.initial, "start"), ("Inputs", s.inputs, s.initial, "start"),
            ("Parameters", s.parameters, s.defaults, "default")):
        rows = tuple(SymbolRow(typeset(_latex(x)), x.name, s.units.get(x, ""),
                               _number(numbers.get(x, None if what == "default" else 0.0))) for x in group)
        if rows:
            tables.append(SymbolTable(title, what, rows))
    return tuple(tables)


def quantities(equations: Equations) -> tuple[Quantity, ...]:
    """The matrices of the equations of motion, with constraints also theirs."""
    typeset = typesetter()
    names = (*USUAL, *OF_CONSTRAINTS * bool(equations.constraints))
    return tuple(_quantity(equations, name, typeset) for name in names if name in equations.quantities)


def _quantity(equations: Equations, name: str, typeset: Callable[[str], str]) -> Quantity:
    meaning, count, operations = _MEANING.get(name, ""), written_out(equations, name), equations.tape(name).operations
    if count > WHOLE and operations > BY_STEPS:
        size = " × ".join(map(str, equations.quantity(name).shape))
        return Quantity(name, meaning, note=f"{size}, {operations} operations in steps that are shared, {count} written out: too "
                        f"long to be read. `symdyn derive` with --quantity {name} --force prints it.")
    by_steps = count > WHOLE
    shown = equations.latex(name, shorthand=True, intermediates=by_steps, width=WIDTH, simplify=not by_steps)
    lines = tuple(Line(typeset(line.lstrip("&").replace("&=", "=", 1)), line.startswith("&")) for line in shown.lines)
    legend = typeset(r",\enspace ".join(f"{short} = {full}" for short, full in shown.legend)) if shown.legend else ""
    note = f"{count} operations written out, {operations} in steps that are shared: shown step by step." if by_steps else ""
    steps = _own(shown.lines) if by_steps else 0
    return Quantity(name, meaning, lines, note, steps, steps + 1 if len(lines) - steps > MANY else len(lines), legend)


def _own(lines: Sequence[str]) -> int:
    """Number of lines before the quantity itself, which begins with the last line that is a matrix."""
    return max((k for k, line in enumerate(lines) if r"\begin{matrix}" in line), default=0)


def typesetter() -> Callable[[str], str]:
    """LaTeX to HTML: MathML, or LaTeX as text where latex2mathml is not installed or does not take it."""
    from markupsafe import Markup, escape

    def convert(latex: str) -> str:
        latex = _LONG_NUMBER.sub(lambda result: f"{float(result[0]):.12g}", latex)
        try:
            return Markup(mathml(latex))
        except Exception:  # not installed, or it does not know the command
            return Markup(f"<code>{escape(latex)}</code>")

    return convert


def _latex(symbol: Any) -> str:
    import sympy as sp

    return str(sp.latex(symbol))


def _number(value: Any) -> str:
    return "none" if value is None else f"{float(value):.6g}".replace("-", "\N{MINUS SIGN}")
