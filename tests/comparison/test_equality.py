"""Whether two formulas are the same, and how that is decided."""

import pytest
import sympy as sp

import symdyn as sd
from symdyn.comparison.equality import decide
from symdyn.comparison.points import Expressions, points
from symdyn.comparison.verdict import Verdict

x, y = sp.symbols("x y", real=True)
a = sp.Symbol("a", positive=True)


@pytest.mark.parametrize("printed, derived, way", [
    (x + y, y + x, "renaming"),
    (sp.sin(x) ** 2 + sp.cos(x) ** 2, sp.S.One, "simplification"),
    (sp.cos(x + y), sp.cos(x) * sp.cos(y) - sp.sin(x) * sp.sin(y), "simplification"),
    (sp.atan2(sp.sin(x) * a, sp.cos(x) * a), sp.atan2(sp.sin(x), sp.cos(x)), "random points"),
])
def test_equal_formulas_are_found_equal_the_cheapest_way(printed, derived, way):
    (decision,) = decide([printed], [derived])
    assert decision.equal is True and way in decision.how


@pytest.mark.parametrize("printed, derived", [
    (sp.sin(x), sp.sin(x) + sp.Rational(1, 10**12)), (sp.sqrt(x**2), x), (x * y, x + y), (sp.S.One, sp.S.Zero)])
def test_different_formulas_come_with_a_point_where_they_differ(printed, derived):
    (decision,) = decide([printed], [derived])
    assert decision.equal is False
    where = {s: decision.point[s.name] for s in printed.free_symbols | derived.free_symbols}
    assert float(printed.subs(where)) == pytest.approx(decision.values[0], rel=1e-14)
    assert decision.values[0] != decision.values[1]


@pytest.mark.parametrize("printed, derived", [
    (-x * y, y * sp.Abs(x)), (y * sp.sign(x), -y), (sp.Abs(sp.cos(x)), sp.cos(x)), (sp.sqrt(1 - sp.sin(x) ** 2), sp.cos(x)),
    (sp.asin(sp.sin(x)), x), (sp.atan2(sp.sin(x), sp.cos(x)), x), (sp.acos(sp.cos(x - y)), sp.Abs(x - y)), (sp.Min(x, 2), x),
    (sp.Piecewise((x, x < 2), (0, True)), x)])
def test_signs_and_ranges_are_not_taken_for_granted(printed, derived):
    assert decide([printed], [derived])[0].equal is False


@pytest.mark.parametrize("printed, derived", [
    (sp.Float("6.67e-11") * x, sp.Float("6.674e-11") * x), (sp.Float(1.2e-14), sp.Float(3.4e-14)),
    (sp.Rational(1, 10**31) * x, sp.Rational(2, 10**31) * x), (10**40 + x, sp.Integer(10) ** 40),
    (sp.Float(1.2e-9), sp.Float(1.3e-9)), (x + sp.Rational(1, 10**40), x)])
def test_small_numbers_count(printed, derived):
    assert decide([printed], [derived])[0].equal is False


def test_rounding_of_large_terms_that_cancel_does_not_count():
    big = sp.Integer(10) ** 30 * (sp.atan2(sp.sin(x) * a, sp.cos(x) * a) - sp.atan2(sp.sin(x), sp.cos(x)))
    assert decide([big], [sp.S.Zero])[0].equal is True


def test_one_entry_that_cannot_be_evaluated_leaves_the_others_decided():
    decisions = decide([sp.besselj(0, x), x, sp.Max(sp.atan2(-x, sp.sqrt(1 - x**2)), 0)],
                       [sp.besselj(0, x) + 1, 2 * x, sp.Max(sp.asin(-x), 0)])
    assert [d.equal for d in decisions] == [None, False, True]


def test_what_cannot_be_evaluated_is_not_decided_and_not_different():
    (nowhere,) = decide([sp.sqrt(-1 - x**2)], [sp.sqrt(-2 - x**2)])
    assert nowhere.equal is None and "no real values" in nowhere.how
    (unknown,) = decide([sp.gamma(x)], [sp.gamma(x) + 1])
    assert unknown.equal is None and "gamma" in unknown.how


def test_printed_decimals_are_compared_as_rounded():
    assert decide([sp.Float("3.46")], [2 * sp.sqrt(3)], decimals=2)[0].equal is True
    assert decide([sp.Float("3.45")], [2 * sp.sqrt(3)], decimals=2)[0].equal is False
    assert decide([sp.Float("3.46")], [2 * sp.sqrt(3)])[0].equal is False


def test_decimal_fractions_are_as_exact_as_floats():
    assert decide([sp.Float(9.81) * x], [sp.Rational(981, 100) * x])[0].equal is True
    assert decide([sp.Float(9.81) * x], [sp.Rational(9810001, 1000000) * x])[0].equal is False


def test_points_are_the_same_in_every_run_and_come_near_and_far_with_both_signs():
    first, again = list(points([x, a])), list(points([a, x]))
    assert first == again
    assert all(p["a"] >= 0.2 and 0.2 <= abs(p["x"]) <= 7 for p in first)
    assert all(p["a"] == m["a"] and p["x"] == -m["x"] for p, m in zip(first[::2], first[1::2]))
    assert all(abs(p["x"]) <= 1.3 for p in first[::4]) and all(abs(p["x"]) >= 1.5 for p in first[2::4])


def test_values_have_fifty_digits():
    (value,) = Expressions([sp.sqrt(2)]).at({})
    assert abs(value**2 - 2) < 1e-49


def test_symbols_are_the_same_by_name_whatever_their_assumptions():
    q = sd.coordinates("q")
    case = sd.Case("names", formulas=[sd.Formula("v", sp.Symbol("l") * sp.Symbol("q_dot"), sp.Symbol("l", positive=True) * q.dot),
                                      sd.Formula("r", sp.Symbol("r") * sp.Symbol("phi"), sp.Symbol("l") * q,
                                                 renamed={"phi": q, "r": sp.Symbol("l")})])
    assert [f.verdict for f in sd.compare(case).formulas] == [Verdict.EQUAL, Verdict.EQUAL]


def test_equations_stay_the_same_when_terms_change_sides():
    m, g, q = sp.symbols("m g q")
    case = sd.Case("sides", formulas=[sd.Formula("motion", sp.Eq(m * g - q, 0), sp.Eq(q, m * g)),
                                      sd.Formula("vectors", (sp.Matrix([m, g]), sp.Matrix([q, q])),
                                                 (sp.Matrix([q, g]), sp.Matrix([m, q])))])
    assert sd.compare(case).counts == {Verdict.EQUAL: 3}


def test_equality_can_hold_on_certain_states_only():
    p = sp.symbols("p0:2")
    formula = {"printed": p[0] ** 2 + p[1] ** 2, "derived": 1}
    assert sd.compare(sd.Case("norm", formulas=[sd.Formula("p.p", **formula)])).counts[Verdict.DIFFERENT] == 1
    on = sd.Formula("p.p", **formula, where={p[0]: sp.sqrt(1 - p[1] ** 2)})
    assert sd.compare(sd.Case("norm", formulas=[on])).counts[Verdict.EQUAL] == 1
