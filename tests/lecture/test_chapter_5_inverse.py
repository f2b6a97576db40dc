"""Chapters 5.1 to 5.6: where they are wrong, and why they are compared in space though the slides draw an arm in the plane."""

from __future__ import annotations

import importlib

import pytest
import sympy as sp
from compared import compared

from symdyn.comparison import Verdict
from symdyn.lecture import cases
from symdyn.lecture.arm_in_space import block, cross, typeset
from symdyn.model.symbols import symbols_of

# Every line with something wrong, repetitions too.
WRONG = {
    "prismatic": [],
    "newton_euler": [7711, 7756, 7815, 7887, 8022, 8046, 8050, 8052, 8054, 8061, 8063, 8069],
    "spatial_velocity": [8273],
    "spatial_acceleration": [8439, 8548, 8552, 8682, 8690],
    "spatial_force": [8818],
    "spatial_joint": [9048],
}


@pytest.mark.parametrize("module", WRONG)
def test_errors_stand_where_they_are_known(module: str) -> None:
    of_module = importlib.import_module(f"symdyn.lecture.chapter_5_{module}").CASES
    formulas = [f for case in of_module for f in compared(case.name).formulas]
    wrong = [f for f in formulas if f.counts[Verdict.WRONG]]
    assert sorted({line for f in wrong for line in (f.slide.line, *f.also)}) == WRONG[module]
    assert not any(f.counts[Verdict.DIFFERENT] or f.counts[Verdict.UNDECIDED] for f in formulas)


def test_the_plane_hides_errors() -> None:
    """While the base stands still, both links turn about parallel axes, and the wrong print gives what the right one does."""
    wrong = next(f for f in compared("spatial-angular-acceleration").formulas if f.verdict is Verdict.WRONG)
    assert wrong.slide.line == 8439
    of_case = next(case for case in cases() if case.name == "spatial-angular-acceleration")
    typed = next(f for f in of_case.taken() if f.name == wrong.name)
    letters = {str(letter): value for letter, value in typed.renamed.items()}
    printed = [e.printed.xreplace({s: letters[s.name] for s in symbols_of(e.printed) if s.name in letters})
               for e in wrong.entries]
    differences = sp.Matrix([a - e.right for a, e in zip(printed, wrong.entries)])
    turning = [s for s in symbols_of(differences) if s.name in ("q_a_dot", "q_a_ddot")]
    assert len(turning) == 2
    assert differences.subs(dict.fromkeys(turning, 0)).applyfunc(sp.simplify).is_zero_matrix
    assert not differences.subs(dict.fromkeys(turning, 1)).applyfunc(sp.simplify).is_zero_matrix


def test_products_are_read_from_the_left() -> None:
    x, y = sp.Matrix([1, 0, 0]), sp.Matrix([0, 1, 0])
    assert cross(x, y, y) == -x
    assert cross(x, x, y) == sp.zeros(3, 1)


def test_blocks() -> None:
    one, two = sp.eye(3), 2 * sp.eye(3)
    assert block([[one, 0], [0, two]]) == sp.diag(1, 1, 1, 2, 2, 2)
    assert block([[one[:, 0]], [0]]) == sp.Matrix([1, 0, 0, 0, 0, 0])


@pytest.mark.parametrize(("name", "place", "text"), [
    ("b2_omega_b2_b1", "x", r"{}^{b_{2}}\omega_{b_{2}/b_{1},x}"), ("n_R_bG2_dot", "xy", r"{}^{n}\dot{R}_{b_{G2},xy}"),
    ("b1_v_O1_dot", "z", r"{}^{b_{1}}\dot{v}_{O_{1},z}")])
def test_letters_are_typeset_as_on_the_slides(name: str, place: str, text: str) -> None:
    assert typeset(name, place) == text
