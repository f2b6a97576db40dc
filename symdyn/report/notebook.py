r"""Equations on a notebook's page: matrices where they fit a line, else in named intermediates, else link by link.

One line of matrices if it fits; up to two pages quantity by quantity, first in their shortest form, then in named intermediates;
above two pages the recursion from link to link, in letters, with what belongs to each link.
Source of the recursion: Featherstone, Rigid Body Dynamics Algorithms, section 5.3 (Newton-Euler in spatial vectors, in the
coordinates of the links).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.errors import SymdynError, UnsupportedExpression
from symdyn.exact.ring import TooLarge
from symdyn.exact.shortest import written, written_out
from symdyn.formulation.printed.provenance import OfBodies
from symdyn.formulation.trees.tree import GROUND, Link, Tree
from symdyn.model.record import joint_speeds
from symdyn.report.latex import columns, letters, matrix_lines, without_macros
from symdyn.report.named import Step, with_intermediates
from symdyn.report.notation import name_latex
from symdyn.spatial.vectors import cross
from symdyn.tape.node import Node, is_zero
from symdyn.tape.tape import Output

if TYPE_CHECKING:
    from symdyn.formulation.printed.augmented import AugmentedEquations
    from symdyn.formulation.printed.independent_speeds import MotionEquations

# Letters in a line of a notebook; lines of two pages.
WIDTH, LINES = 78, 110
# Lines of each formula where one of all lines is more than MathJax takes.
BLOCK = 36
# Operations as derived up to which the shortest form is tried; operations as derived of what is written at all in a recursion.
SHORT, SMALL = 1500, 20_000
_STRUT = r"\\[2pt]"


def equation_page(equations: MotionEquations) -> str:
    """M_tilde u_dot + k_tilde = F_tilde."""
    if _operations(equations, ("M_tilde", "k_tilde", "F_tilde")) <= SHORT:
        parts = [equations.M_tilde, equations.accelerations, equations.k_tilde, equations.F_tilde]
        if sum(map(_wide, parts)) + 8 <= WIDTH:
            M, a, k, F = map(sp.latex, parts)
            return _display([f"{M} {a} + {k} = {F}"])
    return _display(_lines(equations, r"\tilde{\mathbf{M}}\,\dot{\mathbf{u}} + \tilde{\mathbf{k}} = \tilde{\mathbf{F}}",
                           ("M_tilde", "k_tilde", "F_tilde")))


def augmented_page(equations: AugmentedEquations) -> str:
    """[[M, C_r^T], [C_r, 0]] [u_dot; lam] = [F - k; F_d]."""
    if _operations(equations, ("matrix", "right_side")) <= SHORT:
        parts = [equations.matrix, sp.Matrix([*equations.accelerations, *equations.multipliers]), equations.rhs]
        if sum(map(_wide, parts)) + 6 <= WIDTH:
            A, x, b = map(sp.latex, parts)
            return _display([f"{A} {x} = {b}"])
    head = (r"\tilde{\mathbf{M}}\,\dot{\mathbf{u}} + \tilde{\mathbf{k}} + \mathbf{C}_{\mathbf{r}}^{T}\boldsymbol{\lambda} = "
            r"\tilde{\mathbf{F}},\qquad \mathbf{C}_{\mathbf{r}}\,\dot{\mathbf{u}} = \mathbf{F}^{d}")
    return _display(_lines(equations, head, ("M_tilde", "k_tilde", "F_tilde", "C_r", "F_d")))


def _lines(equations: MotionEquations, head: str, names: Sequence[str]) -> list[str]:
    """The equations in letters, then what the letters are."""
    u = sp.latex(equations.accelerations.T)
    first = rf"{head},\qquad \dot{{\mathbf{{u}}}}^{{T}} = {u}" if letters(u) <= WIDTH / 2 else head
    if _operations(equations, names) <= SHORT:
        lines = [first]
        for name in names:
            lines += matrix_lines(name_latex(name), name, equations.explicit(name), WIDTH)
        if _height(lines) <= LINES / 2:
            return lines
    try:
        lines = [first, *_in_intermediates(equations, names)]
    except (SymdynError, ZeroDivisionError):
        lines = []
    if lines and _height(lines) <= LINES:
        return lines
    of = equations.provenance
    if isinstance(of, OfBodies):
        return [first, *_recursion(equations, of.of.tree), *_constraints(equations)]
    return lines or [first]


def _in_intermediates(equations: MotionEquations, names: Sequence[str]) -> list[str]:
    """Quantities in intermediates that they have in common."""
    outputs = equations.tape(*names).outputs
    entries = tuple(e for name in names for e in outputs[name].entries)
    value, steps = with_intermediates(Output("all", (len(entries),), entries), equations.printed_leaves(),
                                      equations.recorder.names)
    lines = _packed(steps)
    index = 0
    for name in names:
        shape = outputs[name].shape
        size = len(outputs[name].entries)
        matrix = sp.Matrix(shape[0], shape[1] if len(shape) == 2 else 1, list(value)[index:index + size])
        index += size
        if size:
            lines += matrix_lines(name_latex(name), name, matrix, WIDTH)
    return lines


def _packed(steps: Sequence[Step]) -> list[str]:
    """Definitions, several on a line where they are short."""
    lines: list[str] = []
    row = ""
    for step in steps:
        first, *more = matrix_lines(sp.latex(step.symbol), "", step.expression, WIDTH)
        joined = rf"{row},\quad {first.replace('&=', '=', 1)}" if row else first.replace("&=", "=", 1)
        if row and (more or letters(joined) > WIDTH):
            lines.append(f"&{row}")
            joined = first.replace("&=", "=", 1)
        row = joined
        if more:
            lines += [f"&{row}", *more]
            row = ""
    return [*lines, f"&{row}"] if row else lines


# -- the recursion

_RECURSION = (
    r"\text{From the ground outwards, for link } i \text{ on its parent } p\text{:}",
    r"\mathbf{X}_i = \begin{bmatrix} \mathbf{R}_i^T & \mathbf{0} \\ -\mathbf{R}_i^T [\mathbf{r}_i]_\times & \mathbf{R}_i^T "
    r"\end{bmatrix},\quad \mathbf{I}_i = \begin{bmatrix} \Theta_i & [h_i]_\times \\ -[h_i]_\times & m_i "
    r"\mathbf{1} \end{bmatrix}",
    r"\mathbf{v}_i = \mathbf{X}_i \mathbf{v}_p + \mathbf{S}_i w_i,\quad "
    r"\mathbf{a}_i = \mathbf{X}_i \mathbf{a}_p + \mathbf{S}_i \dot{w}_i + \mathbf{c}_i + "
    r"\mathbf{v}_i \times \mathbf{S}_i w_i,\quad \mathbf{a}_0 = \begin{bmatrix} \mathbf{0} \\ -\mathbf{g} \end{bmatrix}",
    r"\text{back inwards, with the loads } \mathbf{f}^{e}_i \text{ on the link and its children } j\text{:}",
    r"\mathbf{f}_i = \mathbf{I}_i \mathbf{a}_i + \mathbf{v}_i \times^{*} \mathbf{I}_i \mathbf{v}_i - \mathbf{f}^{e}_i + "
    r"\textstyle\sum_j \mathbf{X}_j^T \mathbf{f}_j,\qquad \mathbf{S}_i^T \mathbf{f}_i = \boldsymbol{\tau}_i",
    r"\text{with } \boldsymbol{\tau}_i \text{ the forces along the joint}",
)


def _recursion(equations: MotionEquations, tree: Tree) -> list[str]:
    """The recursion in letters, then what belongs to each link."""
    lines = [f"&{line}" for line in _RECURSION]
    if tree.added:
        lines.append(r"&\text{added mass } \mathbf{A}_i \text{ of the water stands with } \mathbf{I}_i \text{: }"
                     r"\mathbf{A}_i \mathbf{a}_i + \mathbf{v}_i \times^{*} \mathbf{A}_i \mathbf{v}_i")
    if tree.flexible:
        lines.append(r"&\text{elastic links: } w_i = \dot{\boldsymbol{\eta}}_i,\ \mathbf{S}_i \text{ the mode shapes at "
                     r"the free end},\ \boldsymbol{\tau}_i = -\mathbf{K}_i \boldsymbol{\eta}_i - "
                     r"\mathbf{D}_i \dot{\boldsymbol{\eta}}_i - (\text{inertia of the beam})")
    for k, link in enumerate(tree.links):
        lines += _link(equations, tree, k, link)
    return lines


def _link(equations: MotionEquations, tree: Tree, k: int, link: Link) -> list[str]:
    """Quantities of one link that the recursion takes."""
    n = k + 1
    parent = r"\text{the ground}" if link.parent == GROUND else rf"\text{{link }} {link.parent + 1}"
    head = rf"&\textbf{{link {n}: {_text(link.name)}}} \text{{ on }} {parent} \text{{ by {_text(link.joint.name)}}}"
    speeds = [tree.w[i] for i in link.speeds]
    product = velocity_product(tree, link)
    called = [sp.Symbol(str(u)) if u is None else u for u in joint_speeds(link.joint)]
    rows: list[tuple[str, Any]] = [("R", link.R), ("r", link.r), ("S", link.S), ("w", speeds)]
    if not all(map(is_zero, product)):
        rows.append(("c", product))
    rows += [("m", [link.inertia.m]), ("h", link.inertia.h), ("Theta", link.inertia.I)]
    lines, row, room = [head], "", float(WIDTH)
    for name, value in rows:
        letter, matrix = name_latex(f"{name}_{n}"), _matrix(equations, value)
        if matrix is None:
            below, text, width = [], rf"{letter}({', '.join(sp.latex(u) for u in called)})", 20.0
        else:
            row_vector = matrix.cols == 1 and matrix.rows > 1 and _wide(matrix.T) < WIDTH / 2
            left, shown = (rf"{letter}^{{T}}", matrix.T) if row_vector else (letter, matrix)
            text, width = f"{left} = {sp.latex(shown[0] if shown.shape == (1, 1) else shown)}", letters(left) + 3 + _wide(shown)
            below = matrix_lines(letter, f"{name}_{n}", matrix, WIDTH) if width > WIDTH else []
        if row and (below or width > room):
            lines.append(f"&{row}")
            row, room = "", float(WIDTH)
        if below:
            lines += below
        else:
            row, room = (rf"{row},\quad {text}" if row else text), room - width - 3
    return [*lines, f"&{row}"] if row else lines


def velocity_product(tree: Tree, link: Link) -> np.ndarray:
    """(6,) rate of S w at constant rates of the speeds, seen from the link's frame, link axes."""
    moved = link.S @ tree.w[list(link.speeds)]
    return np.concatenate([link.c[:3], link.c[3:] - cross(moved[:3], moved[3:])])


def _matrix(equations: MotionEquations, value: Any) -> sp.Matrix | None:
    """A small array of the tape in SymPy; None where it is too long."""
    output = Output.of("part", value)
    sizes = written_out(output.entries)
    if sum(sizes.get(e, 0) for e in output.entries if isinstance(e, Node)) > SMALL:
        return None
    try:
        entries = written(output.entries, equations.printed_leaves())
    except (TooLarge, UnsupportedExpression, ZeroDivisionError):
        return None
    rows, cols = output.shape if len(output.shape) == 2 else (output.shape[0], 1)
    return sp.Matrix(rows, cols, entries)


def _constraints(equations: MotionEquations) -> list[str]:
    """C = 0, and C_r and F_d from it."""
    if not equations.constraints:
        return []
    lines = [r"&\mathbf{C}_{\mathbf{r}} = \partial\mathbf{C}/\partial\mathbf{q}\ \mathbf{N},\quad \mathbf{F}^{d} = "
             r"-(\mathbf{C}_{\mathbf{r}}\mathbf{u})_{\mathbf{r}}\mathbf{u} - 2\,\mathbf{C}_{\mathbf{r}t}\mathbf{u} - "
             r"\mathbf{C}_{tt}"]
    try:
        return [*lines, *_in_intermediates(equations, ("C",))]
    except (SymdynError, ZeroDivisionError):
        return lines


def _text(name: str) -> str:
    return name.replace("_", r"\_")


def _operations(equations: MotionEquations, names: Sequence[str]) -> int:
    """As derived, where nothing is shared."""
    entries = [e for output in equations.tape(*names).outputs.values() for e in output.entries]
    sizes = written_out(entries)
    return sum(sizes.get(e, 0) for e in entries if isinstance(e, Node))


def _wide(value: sp.Matrix) -> float:
    """About how wide a matrix becomes, in letters."""
    return columns([[str(sp.latex(e)) for e in value.row(i)] for i in range(value.rows)]) + 2 if len(value) else 2


def _height(lines: Sequence[str]) -> int:
    """Height of these in lines of text."""
    return sum(1 + line.count(r"\\") for line in lines)


def _display(lines: Sequence[str]) -> str:
    if len(lines) == 1:
        return rf"$\displaystyle {lines[0].replace('&', '', 1) if lines[0].startswith('&') else lines[0]}$"
    rows = ["&" + line.removeprefix("&").replace("&=", "=", 1) for line in lines]
    size = len(rows) if len(rows) <= LINES else BLOCK
    blocks = [without_macros(f" {_STRUT}\n".join(rows[k:k + size])) for k in range(0, len(rows), size)]
    return "\n\n".join(f"$\\displaystyle \\begin{{aligned}}\n{block}\n\\end{{aligned}}$" for block in blocks)
