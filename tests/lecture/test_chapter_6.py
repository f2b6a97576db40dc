"""Chapter 6: the errors that were found, what the slides give once they are corrected, and numbers by other formulations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from compared import compared, formula, verdicts

import symdyn as sd
from symdyn.comparison import Verdict
from symdyn.lecture import chapter_6_constraints, chapter_6_platform
from symdyn.lecture.chapter_6_transformation import Platform, c, q
from symdyn.lecture.letters import moving
from symdyn.model.symbols import symbols_of

ERRORS = {
    "turbine-newton-euler": {11749}, "platform-transformation": {11811, 11817, 11821, 11831},
    "platform-transformation-augmented": {12095, 12101, 12105, 12113}, "platform-virtual-work": {11771},
    "platform-embedding": {12163}, "platform-augmented": {12185}, "constraint-rates": {12217},
    "fixed-joint-constraint": {12237}, "prismatic-joint-S": {12532},
    "six-dof-joint-S": {12634, 12648},
}


@pytest.mark.parametrize("name", ERRORS)
def test_errors_that_were_found(name: str) -> None:
    assert {f.slide.line for f, _ in compared(name).errata} == ERRORS[name]


@pytest.mark.parametrize("name", ["r_G", "velocity of G", "velocity of G, exchanged", "J"])
def test_corrected_arm_of_the_platform(name: str) -> None:
    """With the arm r_G/O in place of r_O/G."""
    wrong = formula("platform-transformation", name)
    arm = {letter: -value for letter, value in wrong.renamed.items()}
    assert set(verdicts(replace(wrong, renamed=arm, errata=()))) == {Verdict.EQUAL}


@pytest.mark.parametrize("name", ["r_O", "velocity of O", "velocity of O, exchanged", "velocities in matrix form"])
def test_corrected_names_of_G_and_O(name: str) -> None:
    """With G and O interchanged again: r_G = r_O + R r_G/O."""
    wrong = formula("platform-transformation-augmented", name)
    p = Platform()
    frame = sd.Frame("n").frame("b", rotation=p.R, origin=list(moving("r_GE")))
    point = frame.point("G", list(c))
    right = {"r_O": point.position(), "velocities in matrix form": sp.Matrix.vstack(point.velocity(), frame.angular_velocity())}
    assert set(verdicts(replace(wrong, derived=right.get(name, point.velocity()), errata=()))) == {Verdict.EQUAL}


def test_corrected_k_bar() -> None:
    wrong = formula("platform-embedding", "k_bar of chapter 6.3, upright")
    right = sp.Matrix(formula("platform-embedding", "k_bar").printed).xreplace(dict.fromkeys(q[3:], sp.S.Zero))
    assert set(verdicts(replace(wrong, printed=right, errata=()))) == {Verdict.EQUAL}


def test_k_bar_keeps_the_energy() -> None:
    """Without forces the kinetic energy stays: q_dot^T M_dot q_dot / 2 = q_dot^T k, for k with J_dot only."""
    p = Platform(sp.Matrix([0, 0, sp.Symbol("c")]))
    M, k = p.derived("M_tilde"), p.derived("k_tilde")
    wrong = p.J.T * p.M * p.J * p.qd + p.J.T * p.Q * p.J * p.qd
    point = [*sorted((symbols_of(M) | symbols_of(k)) - {*q, *p.qd}, key=str), *q, *p.qd]
    values = np.random.default_rng(6).uniform(0.5, 1.5, len(point))
    M_dot, right, printed = (np.array(e, dtype=float) for e in sp.lambdify(point, [sd.rate(M), k, wrong])(*values))
    rates = values[-6:]
    assert rates @ M_dot @ rates / 2 == pytest.approx(rates @ right.ravel(), rel=1e-11)
    assert abs(rates @ M_dot @ rates / 2 - rates @ printed.ravel()) > 1e-2


def test_corrected_turbine() -> None:
    wrong = formula("turbine-newton-euler", "all bodies")
    bodies = [chapter_6_platform.Body(name, principal=True) for name in chapter_6_platform.BODIES]
    left = sp.Matrix.vstack(*[b.M * b.s_ddot + b.Q * b.s_dot for b in bodies])
    assert set(verdicts(replace(wrong, printed=(left, wrong.printed[1]), errata=()))) == {Verdict.EQUAL}


@pytest.mark.parametrize(("case", "name"), [
    ("platform-newton-euler", "omega tilde"), ("revolute-joint-S", "X"), ("three-link-forward-dynamics", "p_2^A"),
    ("platform-augmented", "matrix")])
def test_other_signs_are_found(case: str, name: str) -> None:
    """A formula in which one entry has the other sign is different there, and only there."""
    right = formula(case, name)
    wrong = sp.Matrix(right.printed)
    place = next(n for n, e in enumerate(wrong) if e != 0)
    wrong[place] = -wrong[place]
    found = verdicts(replace(right, printed=wrong))
    assert [n for n, verdict in enumerate(found) if verdict is not Verdict.EQUAL] == [place]
    assert found[place] is Verdict.DIFFERENT


@pytest.mark.parametrize("joint", [sd.Fixed, sd.Spherical])
def test_three_equations_are_a_ball_joint(joint: type) -> None:
    """The slide's equations for the fixed joint hold for a ball joint as well; the fixed joint has three rows more."""
    pair = chapter_6_constraints.Pair("P", "T", lambda P, T: joint("foot", P, T, parent_point=[1, 2, 3]))
    (rP, rT), RP = pair.r, pair.R[0]
    printed = (rP + RP * sp.Matrix([1, 2, 3]), rT)
    assert set(verdicts(replace(formula("fixed-joint-constraint", "fixed joint"), printed=printed,
                                derived=(pair.C[:3, :], sp.zeros(3, 1))))) == {Verdict.EQUAL}
    assert pair.C.rows == (6 if joint is sd.Fixed else 3)
