"""Quantities typeset as the lecture writes them: short sines and cosines, lines that fit a page, named intermediates."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.errors import ArgumentError
from symdyn.kinds import flag, whole
from symdyn.report.notation import entry_latex, name_latex
from symdyn.report.shorthand import Shorthand
from symdyn.shown import shown
from symdyn.tape.node import Node
from symdyn.tape.sympy_bridge import expand
from symdyn.tape.tape import Output

if TYPE_CHECKING:
    from symdyn.formulation.equations import Equations
    from symdyn.given import Matrix, Scalar

# Letters in a line of an A4 page at 11 pt, roughly.
WIDTH = 80
NARROWEST = 20
# Letters that may follow a macro of MathJax, with some to spare.
EXPANDED = 4500
# Named steps with fewer operations than this are written out.
WORTH_A_NAME = 3


@dataclass(frozen=True, repr=False)
class Typeset:
    """Lines of LaTeX, "left &= right", and what short names stand for; text and notebooks show all of it."""

    lines: tuple[str, ...]
    legend: tuple[tuple[str, str], ...] = ()

    @property
    def latex(self) -> str:
        """One display: the lines, then the legend."""
        lines = list(self.lines)
        if self.legend:
            parts = [rf"{short} = {full}" for short, full in self.legend]
            rows = [r",\enspace ".join(parts[k:k + 4]) for k in range(0, len(parts), 4)]
            lines += [r"&\text{with } " * (k == 0) + "&" * (k > 0) + row for k, row in enumerate(rows)]
        if len(lines) == 1:
            return lines[0].replace("&", "", 1)
        return "\\begin{aligned}\n" + " \\\\\n".join(lines) + "\n\\end{aligned}"

    def __str__(self) -> str:
        return self.latex

    def __repr__(self) -> str:
        return self.latex

    def _repr_latex_(self) -> str:
        return rf"$\displaystyle {without_macros(self.latex)}$"


def without_macros(text: str) -> str:
    r"""LaTeX for MathJax, which expands \bigl, \mathbf and \textbf where no more than 5 kB follow: \mathopen{\big[} and {\bf M}
    are no macros there."""
    text = text.replace(r"\bigl[", r"\mathopen{\big[}").replace(r"\bigr]", r"\mathclose{\big]}")
    if len(text) <= EXPANDED:
        return text
    text = re.sub(r"\\mathbf\{([^{}]*)\}", r"{\\bf \1}", text)
    return re.sub(r"\\textbf\{([^{}]*)\}", r"{\\bf\\text{\1}}", text)


def latex(value: Scalar | Matrix | Equations, name: str = "", shorthand: bool = False, width: int = WIDTH) -> Typeset:
    """An expression or matrix in LaTeX.

    name        code name of the quantity, for the left side: "M_tilde"; see symdyn.report.notation
    shorthand   s_1 for sin q_1, c_12 for cos(q_1 + q_2), with a legend
    width       letters in a line; longer matrices get named entries below them, longer sums several lines

    Raises ArgumentError for what is no expression or matrix, and for a width that nothing fits in.

    >>> m, l = sd.parameters("m l")
    >>> print(sd.latex(m * l**2, "M"))
    \\mathbf{M} = l^{2} m
    """
    return _typeset([(name, value)], shorthand, width)


def equations_latex(equations: Equations, name: str, shorthand: bool = False, intermediates: bool = False, width: int = WIDTH,
                    simplify: bool = True) -> Typeset:
    """A quantity of equations in LaTeX; see Equations.latex."""
    if not flag(intermediates, "intermediates"):
        return latex(equations.explicit(name, simplify), name, shorthand, width)
    steps = named_steps(equations, name)
    return _typeset([*steps[:-1], (name, steps[-1][1])], shorthand, width, raw=len(steps) - 1)


def named_steps(equations: Equations, name: str) -> list[tuple[str, Any]]:
    """LaTeX name and value of every step that the derivation has named, in terms of those before; last the quantity itself."""
    output, symbols = equations.tape(name).outputs[name], equations.printed_leaves()
    named: dict[Node, sp.Symbol] = {}
    rows: list[tuple[str, Any]] = []
    for node, text in _intermediates(equations, name):
        rows.append((text, expand(Output.of("step", node), symbols, named)))
        named[node] = sp.Symbol(text)
    rows.append((name_latex(name), expand(output, symbols, named)))
    return rows


def _intermediates(equations: Equations, name: str) -> list[tuple[Node, str]]:
    """Steps of the quantity that the derivation has named, and their names in LaTeX, in the order they are computed."""
    tape = equations.tape(name)
    own = set(tape.outputs[name].entries)
    result: list[tuple[Node, str]] = []
    operations: dict[Node, int] = {}
    kept: set[Node] = set()
    taken: set[str] = set()
    for node in tape.steps:
        operations[node] = 1 + sum(0 if a in kept else operations.get(a, 0) for a in node.args if isinstance(a, Node))
        label = tape.recorder.names.get(node)
        if label is None or node in own or operations[node] < WORTH_A_NAME:
            continue
        text = name_latex(label)
        if text not in taken:
            taken.add(text)
            kept.add(node)
            result.append((node, text))
    return result


def _typeset(rows: Sequence[tuple[str, Any]], shorthand: bool, width: int, raw: int = 0) -> Typeset:
    """raw: so many of the rows have a left side that is LaTeX already."""
    if whole(width, f"the width of lines, {NARROWEST} letters at least,") < NARROWEST:
        raise ArgumentError(f"lines of {width} letters asked for; pass a width from {NARROWEST} on")
    flag(shorthand, "shorthand")
    for _, value in rows:
        if not isinstance(value, (sp.MatrixBase, sp.Expr)):
            raise ArgumentError(f"latex takes a SymPy expression or matrix, found {shown(value)} of type {type(value).__name__}")
    short = Shorthand([v for _, v in rows]) if shorthand else None
    lines: list[str] = []
    for k, (name, value) in enumerate(rows):
        printed = short.short(value) if short else value
        left = name if k < raw or not name else name_latex(name)
        lines += matrix_lines(left, name, printed, width)
    return Typeset(tuple(lines), short.legend if short else ())


def matrix_lines(left: str, name: str, value: Any, width: int) -> list[str]:
    """Lines "left &= value" of a matrix or an expression; of a matrix that is too wide the longest entries stand below it."""
    return _matrix(left, name, value, width) if isinstance(value, sp.MatrixBase) else _sum(left, value, width)


def _matrix(left: str, name: str, value: Any, width: int) -> list[str]:
    """A matrix; where it is too wide its longest entries get names and stand below."""
    written = [[str(sp.latex(e)) for e in value.row(i)] for i in range(value.rows)]
    entries, below = named_entries(written, width - letters(left) - 3,
                                   lambda i, j: entry_latex(name or "a", (i, j) if value.cols > 1 else (i,)))
    rows = r"\\".join(" & ".join(row) for row in entries)
    matrix = rf"\left[\begin{{matrix}}{rows}\end{{matrix}}\right]"
    lines = [f"{left} &= {matrix}" if left else f"&{matrix}"]
    for i, j, short in sorted(below):
        lines += _sum(short, value[i, j], width)
    return lines


def named_entries(entries: Sequence[Sequence[str]], room: float, name: Callable[[int, int], str],
                  ) -> tuple[Sequence[Sequence[str]], list[tuple[int, int, str]]]:
    """Entries of a matrix in LaTeX with names for the longest, until its columns fit; and (row, column, name) of those."""
    below: list[tuple[int, int, str]] = []
    while columns(entries) > room:
        i, j = max(((i, j) for i, row in enumerate(entries) for j in range(len(row))), key=lambda p: letters(entries[p[0]][p[1]]))
        short, long = name(i, j), entries[i][j]
        if letters(long) <= letters(short):
            break
        below.append((i, j, short))
        entries = [[short if text == long else text for text in row] for row in entries]
    return entries, below


def columns(entries: Sequence[Sequence[str]]) -> float:
    """About how wide a matrix becomes, in letters."""
    return sum(max(letters(text) for text in column) + 2 for column in zip(*entries))


def _sum(left: str, value: sp.Expr, width: int) -> list[str]:
    """left &= value, on as many lines as it takes."""
    lines = wrapped(value, width - letters(left) - 3)
    return [f"{left} &= {lines[0]}" if left else f"&{lines[0]}", *[rf"&\quad {line}" for line in lines[1:]]]


def wrapped(value: sp.Expr, room: float, mul_symbol: str | None = None) -> list[str]:
    """Lines of a sum, or of a product with a long sum in it; anything else is one line."""
    whole = str(sp.latex(value, mul_symbol=mul_symbol))
    room = max(room, NARROWEST)
    if letters(whole) <= room:
        return [whole]
    if value.is_Add:
        return _terms(value, room, mul_symbol)
    if value.is_Pow and value.base.is_Add:
        return _bracketed("", value, room, mul_symbol)
    sums = [a for a in value.args if a.is_Add or (a.is_Pow and a.base.is_Add)] if value.is_Mul else []
    if not sums:
        return [whole]
    long = max(sums, key=lambda a: letters(sp.latex(a)))
    other = sp.Mul(*[a for a in value.args if a != long])
    before = sp.latex(other, mul_symbol=mul_symbol)
    before = "-" if before == "-1" else rf"\left({before}\right) " if other.is_Add else f"{before} "
    if letters(before) <= room / 2:
        return _bracketed(before, long, room, mul_symbol)
    first = _bracketed("", other, room, mul_symbol) if other.is_Add else wrapped(other, room, mul_symbol)
    return [*first, *[rf"\quad {line}" for line in _bracketed("", long, room - 2, mul_symbol)]]


def _bracketed(before: str, value: sp.Expr, room: float, mul_symbol: str | None) -> list[str]:
    """Lines of before [value], value being a sum or the power of one."""
    base, exponent = value.as_base_exp() if value.is_Pow else (value, sp.S.One)
    power = "" if exponent == 1 else f"^{{{sp.latex(exponent)}}}"
    lines = wrapped(base, room - letters(before) - letters(power) - 2, mul_symbol)
    lines[0] = rf"{before}\bigl[{lines[0]}"
    lines[-1] = rf"{lines[-1]}\bigr]{power}"
    return [lines[0], *[rf"\quad {line}" for line in lines[1:]]]


def _terms(value: sp.Expr, room: float, mul_symbol: str | None) -> list[str]:
    """The terms of a sum, as many on a line as there is room for."""
    lines: list[str] = []
    for term in value.as_ordered_terms():
        first, *rest = wrapped(term, room, mul_symbol)
        signed = first if first.startswith("-") or not lines else f"+ {first}"
        if lines and not rest and letters(lines[-1]) + letters(signed) <= room:
            lines[-1] = f"{lines[-1]} {signed}"
        else:
            lines += [signed, *rest]
    return lines


def letters(text: str) -> float:
    """About how wide LaTeX becomes, in letters: a command is one, a fraction as wide as its wider half."""
    while True:
        fraction = re.search(r"\\frac\{((?:[^{}]|\{[^{}]*\})*)\}\{((?:[^{}]|\{[^{}]*\})*)\}", text)
        if fraction is None:
            break
        wide = max(fraction[1], fraction[2], key=letters)
        text = text[:fraction.start()] + wide + text[fraction.end():]
    text = re.sub(r"\\(?:left|right|mathbf|boldsymbol|tilde|dot|ddot|bar|mathring|bigl|bigr|displaystyle|[,;! ])", "", text)
    text = re.sub(r"\\(sin|cos|tan)", r"\1", text)
    text = re.sub(r"\\[a-zA-Z]+", "x", text)
    small = sum(len(re.sub(r"[{}^_]", "", part)) for part in re.findall(r"[_^](?:\{[^{}]*\}|\w)", text))
    spaced = len(re.findall(r"[-+=]", text))
    return len(re.sub(r"[{}^_\s]", "", text)) + 1.2 * spaced - 0.3 * small
