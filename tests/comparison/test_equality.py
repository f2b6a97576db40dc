"""Whether two formulas are the same, and how that is decided."""

import pytest
import sympy as sp

import symdyn as sd
from symdyn.comparison.equality import decide
from symdyn.comparison.points import Expressions, points, wide_points
from symdyn.comparison.verdict import Verdict
from symdyn.model.symbols import symbols_of

x, y = sp.symbols("x y", real=True)
a = sp.Symbol("a", positive=True)


@pytest.mark.parametrize("printed, derived, way", [
    (x + y, y + x, "renaming"),
    (sp.sin(x) ** 2 + sp.cos(x) ** 2, sp.S.One, "exact algebra"),
    (sp.cos(x + y), sp.cos(x) * sp.cos(y) - sp.sin(x) * sp.sin(y), "exact algebra"),
    (sp.Symbol("x") * a, a * x, "exact algebra"),
    (sp.atan2(sp.sin(x) * a, sp.cos(x) * a), sp.atan2(sp.sin(x), sp.cos(x)), "random points"),
])
def test_equal_formulas_are_found_equal_the_cheapest_way(printed, derived, way):
    (decision,) = decide([printed], [derived])
    assert decision.equal is True and way in decision.how
    assert decision.proved == (way != "random points")


@pytest.mark.parametrize("printed, derived", [
    (sp.sin(x), sp.sin(x) + sp.Rational(1, 10**12)), (sp.sqrt(x**2), x), (x * y, x + y), (sp.S.One, sp.S.Zero)])
def test_different_formulas_come_with_a_point_where_they_differ(printed, derived):
    (decision,) = decide([printed], [derived])
    assert decision.equal is False
    where = {s: decision.point[s.name] for s in symbols_of(printed) | symbols_of(derived)}
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


@pytest.mark.parametrize("printed, derived", [
    (1.0 * x, 1.0 * x + 1e-14), (2.5 * a, 2.5 * a + 1e-17 * a**4), (0.5 * sp.sin(x), 0.5 * sp.sin(x) + 1e-20 * x**5)])
def test_floats_that_agree_at_ordinary_sizes_are_compared_at_tiny_and_huge_ones(printed, derived):
    (decision,) = decide([printed], [derived])
    assert decision.equal is False and "the same to 13 digits at" in decision.how
    (size,) = map(abs, decision.point.values())
    assert not 0.2 <= size <= 7 and decision.values[0] != decision.values[1]


@pytest.mark.parametrize("printed, derived", [
    (sp.sin(9.81 * x), sp.sin(sp.Rational(981, 100) * x)), (a**1.4, a ** sp.Rational(7, 5)),
    (sp.exp(-0.1 * a), sp.exp(-a / 10)), (0.1 * x + 0.2 * x, 0.3 * x)])
def test_rounding_of_a_float_is_followed_through_the_expression_at_every_size(printed, derived):
    (decision,) = decide([printed], [derived])
    assert decision.equal is True and "24 random points" in decision.how and "13 digits; not proved" in decision.how


def test_numbers_too_near_for_rounding_and_for_another_number_are_not_decided():
    (decision,) = decide([9.81 * x], [9.81000000001 * x])
    assert decision.equal is None and "differ by up to 5e-13 of what the floats in them make up" in decision.how


@pytest.mark.parametrize("condition", [
    x < -10**8, sp.Eq(x, 3), sp.Eq(2 * x, y), (x > 3) & (x < sp.Rational(3001, 1000)), (x > 30) & (y**3 < -3 * 10**9),
    sp.Abs(x) < sp.Rational(1, 10**15)])
def test_points_are_made_in_branches_that_no_random_point_visits(condition):
    (decision,) = decide([sp.Piecewise((2 * x + 1, condition), (x, True))], [x])
    assert decision.equal is False and condition.subs({s: sp.Rational(decision.point[s.name])
                                                         for s in condition.free_symbols})
    assert "the same to 50 digits at 24 random points" in decision.how


def test_branches_that_no_point_visits_are_named():
    (one,) = decide([sp.Piecewise((1, sp.sin(x) > 2), (x, True))], [x])
    assert one.equal is None and one.how.endswith("none of which lies in the branch sin(x) > 2")
    (two,) = decide([sp.Piecewise((1, sp.sin(x) > 2), (2, x * y < -x**2 - y**2), (x, True))], [x])
    assert two.equal is None and two.how.endswith("none of which lies in the branches sin(x) > 2; x*y < -x**2 - y**2")


def test_branches_whose_conditions_contradict_each_other_are_not_missed():
    spread = sp.atan2(sp.sin(x) * a, sp.cos(x) * a)
    shown = sp.Piecewise((spread, x < 1), (1, x < -1), (spread, True), evaluate=False)
    (decision,) = decide([shown], [sp.atan2(sp.sin(x), sp.cos(x))])
    assert decision.equal is True


def test_wide_points_cover_tiny_huge_and_special_values():
    drawn = list(wide_points([x, a]))
    assert drawn == list(wide_points([a, x])) and all(p["a"] > 0 for p in drawn)
    sizes = [abs(p["x"]) for p in drawn]
    assert min(sizes) < 1e-8 and max(sizes) > 1e5 and any(0 < abs(size - sp.pi.evalf(50) / 2) < 1e-5 for size in sizes)


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


@pytest.mark.parametrize("printed", [
    lambda x: sp.Piecewise((x, x < 1e6), (2 * x, True)), lambda x: sp.Piecewise((x, x < 1e12), (2 * x, True)),
    lambda x: sp.Max(x, 10**7) - 10**7 + x, lambda x: x + sp.Max(0, sp.Abs(x) - 1e8), lambda x: x + sp.Heaviside(x - 10**9)])
def test_branches_far_away_are_visited(printed):
    x = sp.Symbol("x")
    assert "different" in str(sd.compare(sd.Case("far", printed={"a": [printed(x)]}, derived={"a": [x]})))
