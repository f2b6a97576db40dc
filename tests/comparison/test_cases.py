"""Verdicts, conventions, errata with their proofs, and what bad cases get."""

import re

import pytest
import sympy as sp

import symdyn as sd
from symdyn.comparison.proofs import dimensions, energy_balance, limit, numeric_derivative, other
from symdyn.comparison.verdict import Verdict

q = sd.coordinates("q")
m, l, g = sd.parameters("m l g", positive=True)
POSITION = sp.Matrix([l * sp.sin(q), -l * sp.cos(q)])
VELOCITY = sp.Matrix([l * q.dot * sp.cos(q), l * q.dot * sp.sin(q)])
MOTION = sp.Eq(m * l**2 * q.ddot, -m * g * l * sp.sin(q))


def compare(*formulas):
    return sd.compare(sd.Case("mine", formulas=formulas))


def pendulum():
    return sd.embedding([q], POSITION, [m, m], [0, -m * g])


def test_the_short_form_takes_names_from_equations():
    case = sd.Case("pendulum", printed={"M_tilde": [[m * l**2]], "F_tilde": [-m * g * l * sp.sin(q)]}, derived=pendulum())
    assert sd.compare(case).counts == {Verdict.EQUAL: 2}


def test_formulas_may_be_derived_late():
    case = sd.Case("late", formulas=lambda: [sd.Formula("M", [[m * l**2]], lambda: pendulum().M_tilde)])
    assert sd.compare(case).decided


@pytest.mark.parametrize("printed, derived, convention, name", [
    (-VELOCITY, VELOCITY, sd.conventions.opposite_sign("x points left"), "opposite sign"),
    (sp.Matrix([[1, m], [g, l]]).T, sp.Matrix([[1, m], [g, l]]), sd.conventions.transposed("nRb printed as bRn"), "transposed"),
    (sp.Matrix([g, m]), sp.Matrix([m, g]), sd.conventions.reordered([1, 0], sentence="y before x"), "order of coordinates"),
    (2 * m, m, sd.conventions.other_point(2 * m, "about the end"), "reference point"),
    (sp.Eq(l * q.ddot, -g * sp.sin(q)), MOTION, sd.conventions.scaled(1 / (m * l), "divided by m l"), "common factor"),
])
def test_conventions_are_named(printed, derived, convention, name):
    (formula,) = compare(sd.Formula("f", printed, derived, conventions=[convention])).formulas
    assert formula.verdict is Verdict.CONVENTION and formula.convention == name
    assert convention.sentence in formula.entries[0].note


def test_a_convention_that_does_not_make_it_equal_excuses_nothing():
    found = compare(sd.Formula("v", [VELOCITY[0], -VELOCITY[1]], VELOCITY, conventions=[sd.conventions.opposite_sign("left")]))
    assert found.counts[Verdict.DIFFERENT] == 1 and not found.decided


@pytest.mark.parametrize("printed, derived, proof", [
    ([VELOCITY[0], -VELOCITY[1]], VELOCITY, numeric_derivative("It is the rate of the position.", of=POSITION)),
    ([sp.S.Zero, -l * q.dot**2], [l * sp.cos(q) * q.ddot - l * sp.sin(q) * q.dot**2,
                                  l * sp.sin(q) * q.ddot + l * sp.cos(q) * q.dot**2],
     numeric_derivative("It is the second rate of the position.", of=POSITION, order=2)),
    (m * l**3, m * l**2, dimensions("A moment of inertia.", {m: (1, 0, 0), l: (0, 1, 0)}, (1, 2, 0))),
    (m * g / l, m * g * l, limit("Without an arm there is no moment.", {l: sp.Rational(1, 10**40)}, sp.S.Zero)),
    (sp.Eq(m * l * q.ddot, -m * g * sp.cos(q)), sp.Eq(m * l * q.ddot, -m * g * sp.sin(q)),
     energy_balance("Energy is kept.", [q], m * l**2 * q.dot**2 / 2 - m * g * l * sp.cos(q))),
    ([[m * l]], [[m * l**2]], other("The embedding formulation.", lambda: pendulum().M_tilde)),
])
def test_each_proof_tells_the_wrong_formula_from_the_right_one(printed, derived, proof):
    erratum = sd.Erratum("It is wrong.", proof)
    found = compare(sd.Formula("f", printed, derived, errata=[erratum]))
    assert found.decided and found.counts[Verdict.WRONG] >= 1
    ((_, shown),) = found.errata
    assert shown.evidence.holds and shown.evidence.printed > 1e-6 and shown.evidence.right < 1e-25
    # What is printed right cannot be proven wrong: with the sides changed the proof fails.
    exchanged = compare(sd.Formula("f", derived, printed, errata=[erratum]))
    assert not exchanged.decided and not exchanged.errata
    assert "the proof does not hold" in str(exchanged)


def test_the_energy_balance_takes_power_and_driven_motions():
    c, v = sp.symbols("c v", positive=True)
    x = sd.coordinates("x")
    damped = sp.Eq(m * x.ddot, -c * x.dot)
    proof = energy_balance("The damper takes c v^2.", [x], m * x.dot**2 / 2, power=-c * x.dot**2)
    assert proof.check(m * x.ddot - c * x.dot, damped.lhs - damped.rhs, {}).holds
    driven = energy_balance("The kinetic energy changes by the force alone.", [x], m * (x.dot + v * sd.t) ** 2 / 2)
    assert driven.check(m * x.ddot, m * (x.ddot + v), {}).holds


def test_errata_cover_entries_one_by_one():
    right = sp.Matrix([m, l, g])
    proofs = [sd.Erratum("m is doubled.", other("m", right), [(0,)]), sd.Erratum("g is doubled.", other("g", right), [(2,)])]
    found = compare(sd.Formula("f", [2 * m, l, 2 * g], right, errata=proofs))
    assert [e.verdict for e in found.formulas[0].entries] == [Verdict.WRONG, Verdict.EQUAL, Verdict.WRONG]
    left_over = compare(sd.Formula("f", [2 * m, l, 2 * g], right, errata=proofs[:1]))
    assert left_over.counts[Verdict.DIFFERENT] == 1


def test_a_print_of_the_wrong_shape_can_be_an_erratum():
    def residual(formula):
        return sp.Matrix([formula.rows - 2])

    erratum = sd.Erratum("There are two coordinates.", sd.proofs.Proof("count", "One row for each coordinate.", residual))
    found = compare(sd.Formula("J", [m, l, g], [m, l], errata=[erratum]))
    assert found.counts == {Verdict.WRONG: 1}


def test_unreadable_formulas_and_entries_keep_what_is_derived():
    found = compare(sd.Formula("lost", None, VELOCITY, unreadable="the line breaks off"),
                    sd.Formula("half", [VELOCITY[0], m], VELOCITY, unreadable={(1,): "smudged"}))
    assert found.counts == {Verdict.UNREADABLE: 2, Verdict.EQUAL: 1} and found.decided
    assert found.formulas[0].derived == VELOCITY


def test_text_of_a_comparison_tells_places_counts_and_points():
    text = str(compare(sd.Formula("v", [VELOCITY[0], -VELOCITY[1]], VELOCITY, line=17)))
    assert "17" in text and "1 equal, 1 different, not proven wrong" in text
    assert re.search(r"\[1\] different, not proven wrong; printed -?[\d.]+, derived -?[\d.]+ at l = ", text)


@pytest.mark.parametrize("make, message", [
    (lambda: [sd.Formula("M", [[m, l]], [[m], [l]])], "printed as 1 x 2, derived as 2 x 1"),
    (lambda: [sd.Formula("M", m, [m])], "printed as a scalar, derived as 1 x 1"),
    (lambda: [sd.Formula("M", [[m, l], [m]], [[m, l], [m, l]])], "rows of 1 and 2 entries"),
    (lambda: [sd.Formula("M", "m*l", m)], "text is never evaluated"),
    (lambda: [sd.Formula("M", m, float("nan"))], "finite"),
    (lambda: [sd.Formula("M", m, None)], "nothing is derived for M"),
    (lambda: [sd.Formula("M", None, m)], "has nothing printed"),
    (lambda: [sd.Formula("M", m, m), sd.Formula("M", m, m)], "2 formulas are named 'M'"),
    (list, "has no formulas"),
    (lambda: [sd.Formula("M", (sp.Matrix([m]), sp.Matrix([m, l])), m)], "sides of the print of M have shapes"),
    (lambda: [sd.Formula("M", sp.Eq(sp.S(1), sp.S(2)), m)], "takes for false at once"),
    (lambda: [sd.Formula("M", m, m, renamed={m + l: g})], "only symbols"),
    (lambda: [sd.Formula("M", m, m, renamed={m: sp.Matrix([m])})], "is a matrix"),
    (lambda: [sd.Formula("M", [m, l], [m, l], errata=[sd.Erratum("No.", other("it", sp.Matrix([m, l])))])], "all of it equals"),
    (lambda: [sd.Formula("M", [m, l], [g, l], errata=[sd.Erratum("No.", other("it", sp.Matrix([g, l])), [(1,)])])],
     "entry (1,) is wrong, but it equals"),
])
def test_a_bad_case_is_told_what_is_wrong(make, message):
    with pytest.raises(sd.CaseError, match=re.escape(message)):
        sd.compare(sd.Case("bad", formulas=make))


def test_all_faults_of_a_case_are_told_at_once():
    with pytest.raises(sd.CaseError) as caught:
        compare(sd.Formula("A", [[m, l]], [[m], [l]]), sd.Formula("B", "m", m))
    assert len(caught.value.faults) == 2 and "'mine' has 2 faults" in str(caught.value)


def test_names_missing_from_what_is_derived():
    with pytest.raises(sd.CaseError, match="`derived` has no K; it has M"):
        sd.compare(sd.Case("short", printed={"K": m}, derived={"M": m}))
    with pytest.raises(sd.CaseError, match="has no nonsense"):
        sd.compare(sd.Case("short", printed={"nonsense": m}, derived=pendulum()))


def test_orders_of_differentiation():
    with pytest.raises(sd.CaseError, match="order 3 asked for; there are orders 1 and 2"):
        numeric_derivative("jerk", of=POSITION, order=3)


def test_unknown_cases_are_offered_the_nearest_names():
    with pytest.raises(sd.UnknownCase, match="there is no case 'pendulum-augmentd'; the nearest are pendulum-augmented"):
        sd.compare("pendulum-augmentd")
    with pytest.raises(sd.UnknownCase, match="listed by"):
        sd.compare("§")


@pytest.mark.parametrize("value", [3, None, [3]])
def test_compare_takes_names_and_cases_only(value):
    with pytest.raises(sd.CaseError, match="takes a name, a Case or several"):
        sd.compare(value)
