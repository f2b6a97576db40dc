"""Chapter 2: the errors that were found, what the slides give once they are corrected, and the letters they are typed in."""

from __future__ import annotations

from dataclasses import replace

import pytest
import sympy as sp
from compared import compared, formula, verdicts

import symdyn as sd
from symdyn.comparison import Verdict
from symdyn.lecture import chapter_2_inertia, chapter_2_moment
from symdyn.lecture.letters import constant, ddot, dot, moving, stands_for, symmetric
from symdyn.model.symbols import symbols_of


def test_errors_that_were_found() -> None:
    found = {f.slide.line for name in ("particle-moment", "rate-of-angular-momentum", "moment-about-O", "inertia-transformation",
                                       "plane-transformation") for f, _ in compared(name).errata}
    assert found == {2523, 2598}


def test_corrected_moment_of_one_particle() -> None:
    m1, r1, rO, omega = (getattr(chapter_2_moment, name) for name in ("m1", "r1", "rO", "omega"))
    right = m1 * r1.cross(ddot(rO)) + sd.rate(chapter_2_moment.inertia_of(m1, r1) * omega)
    assert set(verdicts(replace(formula("particle-moment", "with I_O"), printed=right, errata=()))) == {Verdict.EQUAL}


def test_corrected_rate_of_the_rotation() -> None:
    wrong = formula("rate-of-angular-momentum", "rate of bRn, on any vector")
    assert set(verdicts(replace(wrong, printed=-wrong.printed, errata=()))) == {Verdict.EQUAL}


def test_dots_over_components_are_a_convention() -> None:
    declared = formula("planar-rigid-body", "acceleration in the force equation")
    assert Verdict.DIFFERENT in verdicts(replace(declared, conventions=()))


def test_wrong_rate_does_not_change_the_moment() -> None:
    """omega x omega vanishes, so that the sum is right with either sign."""
    name = ("rate-of-angular-momentum", "with omega")
    R, b_I, b_omega, omega = (getattr(chapter_2_inertia, letter) for letter in ("R", "b_I", "b_omega", "omega"))
    term = R * b_I * b_omega.cross(R.T * omega)
    assert set(verdicts(replace(formula(*name), printed=formula(*name).printed - 2 * term))) == {Verdict.EQUAL}


@pytest.mark.parametrize(("case", "name"), [
    ("moment-about-O", "moment equation"), ("moment-about-G", "moment equation about G"), ("inertia-transformation", "nI_O"),
    ("particle-inertia", "I_O,1"), ("mass-moment-of-inertia", "in space"), ("xyz-angular-velocity", "nG"),
    ("xyz-rotation", "nRb")])
def test_other_signs_are_found(case: str, name: str) -> None:
    """A formula whose first entry has the other sign is different there, and only there."""
    right = formula(case, name)
    wrong = sp.Matrix(right.printed)
    wrong[0, 0] = -wrong[0, 0]
    found = verdicts(replace(right, printed=wrong))
    assert found[0] is Verdict.DIFFERENT
    assert set(found[1:]) == {Verdict.EQUAL}


def test_moment_equation_needs_each_term() -> None:
    right = formula("moment-about-O", "moment equation")
    rG, rO, m_system = (getattr(chapter_2_moment, name) for name in ("rG", "rO", "m_system"))
    without = right.printed - m_system * rG.cross(ddot(rO))
    assert set(verdicts(replace(right, printed=without))) == {Verdict.DIFFERENT}


def test_letters_stand_for_a_motion() -> None:
    q = sd.coordinates("q")
    r = moving("r")
    value = sp.Matrix([sp.sin(q), q**2, 3])
    known = stands_for(r, value, dots=2)
    assert len(known) == 9
    assert sp.Matrix([known[e] for e in dot(r)]) == sd.rate(value)
    assert sp.Matrix([known[e] for e in ddot(r)]) == sd.rate(sd.rate(value))


def test_letters_of_matrices() -> None:
    inertia = symmetric("I")
    assert inertia == inertia.T
    assert len(symbols_of(inertia)) == 6
    assert constant("F") == sp.Matrix(sp.symbols("F_x F_y F_z"))
    with pytest.raises(ValueError, match="shorter"):
        stands_for(constant("F"), [1, 2])
