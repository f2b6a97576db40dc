"""The letters of the lecture: how quantities are named in code and typeset on the page."""

from __future__ import annotations

import re
from dataclasses import dataclass

import sympy as sp


@dataclass(frozen=True)
class Notation:
    """One row of the table: code name, LaTeX, shape, meaning."""

    code: str
    latex: str
    shape: str
    meaning: str


NOTATION = (
    Notation("q", "q", "(n_q, 1)", "generalized coordinates"),
    Notation("u", "u", "(n_u, 1)", "generalized speeds"),
    Notation("r", r"\mathbf{r}", "(n_r, 1)", "Cartesian positions"),
    Notation("J", r"\mathbf{J}", "(6 n_b, n_u)", "velocity transformation, [v_G; omega] = J u"),
    Notation("Jdot", r"\dot{\mathbf{J}}", "(6 n_b, n_u)", "its derivative by time"),
    Notation("Jd_qd", r"\dot{\mathbf{J}}\dot{\mathbf{q}}", "(6 n_b, 1)", "accelerations that remain when u_dot = 0"),
    Notation("M", r"\mathbf{M}", "(6 n_b, 6 n_b)", "mass matrix of the bodies"),
    Notation("M_tilde", r"\tilde{\mathbf{M}}", "(n_u, n_u)", "J^T M J"),
    Notation("k_tilde", r"\tilde{\mathbf{k}}", "(n_u, 1)", "J^T (M J_dot u + Q J u)"),
    Notation("F_tilde", r"\tilde{\mathbf{F}}", "(n_u, 1)", "J^T F"),
    Notation("F_c", r"\mathbf{F}^{c}", "(n_r, 1)", "constraint reaction"),
    Notation("C", r"\mathbf{C}", "(n_c, 1)", "constraints"),
    Notation("C_r", r"\mathbf{C}_{\mathbf{r}}", "(n_c, n_r)", "their derivatives by the coordinates"),
    Notation("C_t", r"\mathbf{C}_{t}", "(n_c, 1)", "their derivatives by time"),
    Notation("C_dot", r"\dot{\mathbf{C}}", "(n_c, 1)", "their rates"),
    Notation("F_d", r"\mathbf{F}^{d}", "(n_c, 1)", "what C_r times the accelerations must be"),
    Notation("lam", r"\boldsymbol{\lambda}", "(n_c, 1)", "Lagrange multipliers"),
    Notation("tau", r"\boldsymbol{\tau}", "(n_u, 1)", "forces along the speeds"),
    Notation("inverse_dynamics", r"\boldsymbol{\tau}", "(n_u, 1)", "forces along the speeds that accelerations need"),
    Notation("T", "T", "()", "kinetic energy"),
    Notation("V", "V", "()", "potential energy of gravity, springs and load elements"),
    Notation("lagrangian", "L", "()", "T - V"),
    Notation("momenta", r"\mathbf{p}", "(n_u, 1)", "dT/du"),
    Notation("hamiltonian", "H", "()", "Hamilton's function, in coordinates and momenta"),
    Notation("X", r"\mathbf{X}", "(6, 6)", "transformation of motions"),
    Notation("X_star", r"\mathbf{X}^{*}", "(6, 6)", "transformation of forces"),
    Notation("S", r"\mathbf{S}", "(6, n)", "motion subspace of a joint"),
    Notation("S_ring", r"\mathring{\mathbf{S}}", "(6, n)", "its apparent rate of change"),
    Notation("I", r"\mathbf{I}", "(6, 6)", "spatial inertia"),
    Notation("I_A", r"\mathbf{I}^{A}", "(6, 6)", "articulated inertia"),
    Notation("p_A", r"\mathbf{p}^{A}", "(6, 1)", "articulated bias force"),
    Notation("v", r"\mathbf{v}", "(6, 1)", "spatial velocity"),
    Notation("a", r"\mathbf{a}", "(6, 1)", "spatial acceleration"),
    Notation("c", r"\mathbf{c}", "(6, 1)", "velocity products of acceleration"),
    Notation("p", r"\mathbf{p}", "(6, 1)", "velocity products of force"),
    Notation("f", r"\mathbf{f}", "(6, 1)", "spatial force"),
    Notation("R", r"\mathbf{R}", "(3, 3)", "rotation"),
    Notation("G", r"\mathbf{G}", "(3, 3)", "omega = G gamma_dot"),
    Notation("E", r"\mathbf{E}", "(3, 4)", "omega = 2 E p_dot"),
    Notation("E_bar", r"\bar{\mathbf{E}}", "(3, 4)", "omega in the body's axes = 2 E_bar p_dot"),
)
_LATEX = {row.code: row.latex for row in NOTATION}
# Labels of a derivation for the entries of its vectors and matrices, link by link.
_OF_LINKS = {"w": r"\omega", "v": "v", "a": "a", "alpha": r"\alpha", "f": "f", "n": "n", "h": "h", "I": "I", "r": "r", "p": "p"}


def name_latex(name: str) -> str:
    r"""A quantity by its code name as the lecture writes it.

    "M_tilde" is \tilde{M}, "nR_b" and "b2_R_b1" are rotations with a left superscript, "X_star_2" is X* of link 2, "w2_z" the
    z-component of the angular velocity of link 2; other names are typeset as SymPy does symbols.
    """
    if name in _LATEX:
        return _LATEX[name]
    rotation = re.fullmatch(r"(?:([a-zA-Z]\d*)_R_|n()R_?)(\w+)", name)
    if rotation:
        return rf"{{}}^{{{_frame(rotation[1] or 'n')}}}\mathbf{{R}}_{{{_frame(rotation[3])}}}"
    of_link = re.fullmatch(r"(\w+?)_(\d+)", name)
    if of_link and of_link[1] in _LATEX:
        return f"{_LATEX[of_link[1]]}_{{{of_link[2]}}}"
    entry = re.fullmatch(r"([a-zA-Z]+)(\d+)_([xyz]{1,2}|\d)", name)
    if entry and entry[1] in _OF_LINKS:
        return f"{_OF_LINKS[entry[1]]}_{{{entry[2]},{entry[3]}}}"
    return str(sp.latex(sp.Symbol(name)))


def entry_latex(name: str, index: tuple[int, ...]) -> str:
    r"""An entry of a quantity, counted from 1: \tilde{M}_{12}; of one that has an index already C_{r,12}."""
    letter = re.sub(r"\\(?:mathbf|boldsymbol)\{(\\?\w+)\}", r"\1", name_latex(name))
    places = [str(i + 1) for i in index]
    names = ("" if all(len(p) == 1 for p in places) else ",").join(places)
    indexed = re.fullmatch(r"(.+)_\{((?:[^{}]|\{[^{}]*\})+)\}", letter)
    return f"{indexed[1]}_{{{indexed[2]},{names}}}" if indexed else f"{letter}_{{{names}}}"


def _frame(name: str) -> str:
    """b2 is b with the index 2."""
    result = re.fullmatch(r"(\D*)(\d*)", name)
    if result is None:
        return str(sp.latex(sp.Symbol(name)))
    letters, digits = result.groups()
    return f"{letters}_{{{digits}}}" if letters and digits else name
