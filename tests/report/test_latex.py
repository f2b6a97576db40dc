"""Equations typeset as the lecture writes them."""

import pytest
import sympy as sp

import symdyn as sd
from symdyn.model.symbols import symbols_of
from symdyn.report.latex import letters, named_steps
from symdyn.report.notation import NOTATION, entry_latex, name_latex
from symdyn.report.shorthand import Shorthand

q1, q2 = sd.coordinates("q1 q2")
m, l = sd.parameters("m l", positive=True)


@pytest.fixture(scope="module")
def arm():
    return sd.systems.two_link_arm().embedding()


@pytest.mark.parametrize("name, latex", [
    ("M_tilde", r"\tilde{\mathbf{M}}"), ("nR_b", r"{}^{n}\mathbf{R}_{b}"), ("b2_R_b1", r"{}^{b_{2}}\mathbf{R}_{b_{1}}"),
    ("X_star_2", r"\mathbf{X}^{*}_{2}"), ("I_A_1", r"\mathbf{I}^{A}_{1}"), ("w2_z", r"\omega_{2,z}"), ("n3_z", "n_{3,z}"),
    ("I2_xx", "I_{2,xx}"), ("lam", r"\boldsymbol{\lambda}"), ("tip", "tip")])
def test_names_are_those_of_the_lecture(name, latex):
    assert name_latex(name) == latex


def test_entries_are_counted_from_one():
    assert entry_latex("M_tilde", (0, 1)) == r"\tilde{M}_{12}" and entry_latex("k_tilde", (2,)) == r"\tilde{k}_{3}"
    assert entry_latex("J", (11, 0)) == r"J_{12,1}" and entry_latex("lam", (0,)) == r"\lambda_{1}"


def test_every_row_of_the_notation_is_complete():
    assert len({row.code for row in NOTATION}) == len(NOTATION)
    assert all(row.latex and row.shape.startswith("(") and row.meaning for row in NOTATION)


def test_dots_and_powers():
    assert str(sd.latex(m * l * q1.ddot - q2.dot**2)) == r"l m \ddot{q}_{1} - \dot{q}_{2}^{2}"
    assert sd.latex(m, "M_tilde")._repr_latex_() == r"$\displaystyle \tilde{\mathbf{M}} = m$"


def test_shorthand_and_legend(arm):
    text = arm.latex("J", shorthand=True)
    assert "c_{12}" in str(text) and r"\cos" not in "".join(text.lines)
    assert dict(text.legend)["s_{12}"] == r"\sin{\left(q_{1} + q_{2} \right)}" and r"\text{with }" in text.latex


def test_short_names_are_unambiguous():
    p1 = sd.coordinates("p1")
    short = Shorthand([sp.sin(q1) * sp.sin(p1) + sp.cos(q1 - q2) + sp.sin(2 * q1) + sp.cos(sd.coordinates("theta"))])
    names = {str(s) for s in short.symbols.values()}
    assert names == {"s_{q_{1}}", "s_{p_{1}}", "c_{1-2}", r"s_{2 q_{1}}", r"c_{\theta}"}


def test_shorthand_only_renames(arm):
    short = Shorthand([arm.J])
    back = {symbol: function for function, symbol in short.symbols.items()}
    assert arm.J.applyfunc(short.short).xreplace(back) == arm.J


@pytest.mark.parametrize("system, quantity", [("two_link_arm", "k_tilde"), ("three_link_arm", "k_tilde"),
                                              ("three_link_arm", "M_tilde"), ("four_bar", "C_r")])
def test_named_intermediates_put_together_are_the_quantity(system, quantity):
    model = sd.systems.get(system)
    eq = model.augmented() if system == "four_bar" else model.embedding()
    *steps, (_, value) = named_steps(eq, quantity)
    for name, expression in reversed(steps):
        value = value.xreplace({sp.Symbol(name): expression})
    plain = eq.explicit(quantity, simplify=False)
    point = {s: sp.Rational(k + 3, 7) for k, s in enumerate(sorted(symbols_of(plain) | symbols_of(value), key=str))}
    assert max(abs(e) for e in (plain - value).xreplace(point).evalf(30)) < 1e-25


def test_intermediates_have_the_names_of_their_quantities():
    eq = sd.systems.three_link_arm().embedding()
    names = [name for name, _ in named_steps(eq, "k_tilde")]
    assert r"\omega_{3,y}" in names and "n_{3,z}" in names and names[-1] == r"\tilde{\mathbf{k}}"
    text = str(eq.latex("k_tilde", intermediates=True, shorthand=True))
    assert text.index(r"\omega_{3,y} &=") < text.index(r"\tilde{\mathbf{k}} &=")


def test_lines_keep_to_the_width():
    eq = sd.systems.three_link_arm().embedding()
    for width in (40, 60, 80):
        lines = eq.latex("M_tilde", width=width).lines
        assert len(lines) > 1
        sums = [line for line in lines if "matrix" not in line]
        assert max(letters(line.replace("&", "")) for line in sums) <= width + 12  # a factor cannot be broken
        assert r"\tilde{M}_{11} &=" in "\n".join(lines)


def test_broken_sums_keep_all_their_terms():
    terms = sp.symbols("a_1:60")
    text = sd.latex(m * sp.Add(*terms), "tau", width=50)
    joined = "".join(text.lines)
    assert len(text.lines) > 3 and all(str(sp.latex(a)) in joined for a in terms)
    assert joined.count(r"\bigl[") == joined.count(r"\bigr]") == 1


def test_of_two_sums_multiplied_both_keep_their_brackets():
    text = "".join(sd.latex((q1 + m) * sp.Add(*sp.symbols("a_1:40")), "tau", width=50).lines)
    assert r"\left(m + q_{1}\right) \bigl[" in text and text.count(r"\bigr]") == 1


def test_products_and_powers_of_long_sums_are_broken():
    a, b = (sp.Add(*sp.symbols(f"{letter}_1:30")) for letter in "ab")
    for value in (a * b, m * a / sp.sqrt(b), sp.sin(q1) / a, b**3):
        lines = sd.latex(value, width=50).lines
        text = "".join(lines)
        assert max(letters(line.replace("&", "")) for line in lines) <= 55
        assert all(str(sp.latex(s)) in text for s in symbols_of(value)) and text.count(r"\bigl[") == text.count(r"\bigr]")
    assert r"\bigr]^{3}" in text


def test_a_short_matrix_is_one_line(arm):
    assert str(sd.latex(sp.zeros(0, 1), "C")).startswith(r"\mathbf{C} = \left[")
    assert len(arm.latex("F_tilde").lines) == 1 and len(sd.latex(sp.Matrix([[m, l]]), "C_r").lines) == 1


@pytest.mark.parametrize("value, message", [("m*l", "latex takes a SymPy expression or matrix, found 'm\\*l' of type str"),
                                            ([m], "of type list")])
def test_what_cannot_be_typeset(value, message):
    with pytest.raises(sd.ArgumentError, match=message):
        sd.latex(value)


def test_widths_that_nothing_fits_in():
    with pytest.raises(sd.ArgumentError, match="lines of 3 letters asked for; pass a width from 20 on"):
        sd.latex(m, width=3)
