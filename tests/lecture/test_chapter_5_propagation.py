"""What chapters 5.7 and 5.8 are compared with: the arms' letters beside Newton's equations; which prints are found wrong."""

from __future__ import annotations

from functools import lru_cache

import pytest
import sympy as sp

from symdyn.lecture import chapter_5_propagation, chapter_5_propagation_first, chapter_5_propagation_leaf
from symdyn.lecture import chapter_5_propagation_summary as summary
from symdyn.lecture.propagation_arms import Arm, cross, cross_star, inverse
from symdyn.lecture.propagation_newton import Newton

CASES = [case for module in (chapter_5_propagation, chapter_5_propagation_leaf, chapter_5_propagation_first, summary)
         for case in module.CASES]
EACH_LINK = [(links, k) for links in (1, 2, 3) for k in range(1, links + 1)]


@lru_cache
def arm(links: int) -> Arm:
    return Arm(links, exact=True)


def same(found: sp.Matrix, other: sp.Matrix) -> bool:
    return (sp.Matrix(found) - sp.Matrix(other)).applyfunc(sp.expand).is_zero_matrix


@pytest.mark.parametrize(("links", "k"), EACH_LINK)
def test_recursion_and_differentiated_positions_agree(links: int, k: int) -> None:
    a = arm(links)
    newton = Newton(a)
    assert same(a.put(newton.velocity(k)), getattr(a, f"v_{k}"))
    assert same(newton.acceleration(k), getattr(a, f"a_{k}"))
    assert same(newton.at_center(k), getattr(a, f"f_G_{k}"))
    assert same(newton.on_body(k), a.f_B(k))
    assert same(newton.through_joint(k), getattr(a, f"f_{k}"))


@pytest.mark.parametrize(("links", "k"), EACH_LINK)
def test_inertia_about_the_joint(links: int, k: int) -> None:
    a = arm(links)
    assert same(a.X_G(k).T * a.I_G(k) * a.X_G(k), getattr(a, f"I_{k}"))
    assert same(a.X_G(k) * a.X_from_G(k), sp.eye(6))


@pytest.mark.parametrize("links", [1, 2, 3])
def test_free_joints_fulfil_their_torques(links: int) -> None:
    a = arm(links)
    everything = a.free(*range(1, links + 1))
    assert same(sp.Matrix(list(everything.values())), a.accelerations)
    last = a.torques[links - 1:, :].xreplace(a.free(links))
    assert same(last, a.tau[links - 1])
    assert a.free(links)[a.q_ddot[-1]].has(a.q_dot[0]) == (links > 1)


def test_products_of_motions_and_of_forces() -> None:
    v, f = sp.Matrix(sp.symbols("v1:7")), sp.Matrix(sp.symbols("f1:7"))
    assert same(cross_star(v), -cross(v).T)
    assert same(cross(v) * v, sp.zeros(6, 1)) and not same(cross_star(f) * v, sp.zeros(6, 1))
    assert inverse(sp.Matrix([sp.Integer(4)])) == sp.Matrix([sp.Rational(1, 4)])


def test_an_arm_has_no_other_letters() -> None:
    with pytest.raises(AttributeError, match="X_4"):
        arm(3).X_4  # noqa: B018


def test_one_joint_has_an_S_that_moves() -> None:
    found = next(f for f in chapter_5_propagation.CASES[0].taken() if f.name == "acceleration of b2 where S moves")
    q = {str(s): s for s in found.derived.free_symbols}
    # The axis q2 turns about x of link 1, which q3 tilts in b2 at the rate q3_dot.
    assert sp.diff(found.derived[0], q["q2_dot"], q["q3_dot"]) == -sp.sin(q["q3"])
    assert sp.diff(found.derived[2], q["q2_dot"], q["q3_dot"]) == sp.cos(q["q3"])


def test_lines_that_are_said_to_be_wrong() -> None:
    formulas = [f for case in CASES for f in case.taken()]
    wrong = {line for f in formulas if f.errata for line in (f.line, *f.also)}
    assert {9108, 9176, 9222, 9262, 9268, 9274, 9364, 9484, 9508, 9761, 9792, 10319, 11161, 11340, 11375} <= wrong
    # The star is printed there, and the minus.
    assert wrong.isdisjoint({9234, 9238, 9242, 9246, 9248, 9568, 11014, 11186})
    assert {f.line for f in formulas if f.unreadable} == {9154}
