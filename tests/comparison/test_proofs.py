"""Proofs: what they see and what they do not, and what is rejected."""

import pytest
import sympy as sp

import symdyn as sd
from symdyn.comparison.proofs import Proof, dimensions, energy_balance, limit, numeric_derivative, other
from symdyn.comparison.verdict import Verdict

q = sd.coordinates("q")
m, l, g = sd.parameters("m l g", positive=True)


def compare(*formulas):
    return sd.compare(sd.Case("mine", formulas=formulas))


def test_a_proof_must_see_every_entry_that_is_claimed():
    blind = sd.Erratum("Both are wrong.", limit("Without a length the second vanishes.", {l: 0}, [m, 0]))
    found = compare(sd.Formula("f", [m + 1, 2 * l], [m, l], errata=[blind]))
    assert found.counts == {Verdict.DIFFERENT: 2} and not found.errata
    assert "it does not see entries (1,)" in str(found)
    first = sd.Erratum("The first is wrong.", blind.proof, entries=[(0,)])
    assert compare(sd.Formula("f", [m + 1, 2 * l], [m, l], errata=[first])).counts == {Verdict.WRONG: 1, Verdict.DIFFERENT: 1}


def test_a_print_that_has_lost_its_motion_is_still_differentiated_along_it():
    proof = numeric_derivative("It is the rate of l sin q.", of=l * sp.sin(q))
    evidence = proof.check(sp.S.Zero, l * q.dot * sp.cos(q), {})
    assert evidence.holds and evidence.printed > 1e-3


@pytest.mark.parametrize("factor", [1, sp.Rational(1, 10**12), 10**12])
def test_sizes_do_not_matter(factor):
    right = factor * l * q.dot * sp.cos(q)
    rate = numeric_derivative("It is a rate.", of=factor * l * sp.sin(q))
    assert rate.check(2 * right, right, {}).holds and not rate.check(right, 2 * right, {}).holds
    energy = energy_balance("Energy is kept.", [q], factor * (m * l**2 * q.dot**2 / 2 - m * g * l * sp.cos(q)))
    assert energy.check(l * q.ddot - g * sp.sin(q), l * q.ddot + g * sp.sin(q), {}).holds
    assert other("The same.", right).check(right * (1 + sp.Rational(1, 10**9)), right, {}).holds


def test_rounding_of_decimal_fractions_proves_nothing():
    assert not other("The same.", sp.Float(9.81) * m).check(sp.Float(9.81) * m * (1 + 1e-15), sp.Float(9.81) * m, {}).holds
    assert other("The same.", sp.Float(9.81) * m).check(sp.Float(9.8) * m, sp.Float(9.81) * m, {}).holds


def test_a_formula_without_a_value_in_a_limit_is_not_right_there():
    assert limit("It vanishes.", {l: 0}, 0).check(m / l, m * l, {}).holds


def test_errata_show_what_the_slide_prints():
    R, a = sp.symbols("R a")
    wrong = sd.Erratum("The square is missing.", dimensions("An inertia.", {m: (1, 0, 0), l: (0, 1, 0)}, (1, 2, 0)))
    ((formula, _),) = compare(sd.Formula("I", a * R, m * l**2, renamed={a: m, R: l}, errata=[wrong])).errata
    assert formula.printed == a * R == formula.entries[0].printed


def test_equations_of_several_coordinates_are_solved_together():
    x, y = sd.coordinates("x y")
    right = sp.Matrix([2 * x.ddot + y.ddot + x, x.ddot + 3 * y.ddot + y])
    E = x.dot**2 + x.dot * y.dot + 3 * y.dot**2 / 2 + x**2 / 2 + y**2 / 2
    proof = energy_balance("Energy is kept.", [x, y], E)
    assert proof.check(right + sp.Matrix([y, 0]), right, {}).holds


@pytest.mark.parametrize("make, message", [
    (lambda: limit("l", {m: 1}, "m"), "text is never evaluated"), (lambda: limit("l", {m: "1"}, m), "text is never evaluated"),
    (lambda: other("o", "m"), "text is never evaluated"), (lambda: numeric_derivative("n", of="q"), "text is never evaluated"),
    (lambda: energy_balance("e", [q], "q"), "text is never evaluated"),
    (lambda: dimensions("d", {m: (1, 0)}, (1, 0, 0)), "the unit of m is [1, 0]; pass the exponents of kg, m and s"),
    (lambda: dimensions("d", {m: (1, 0, 0)}, "kg"), "the unit of the formula is"),
    (lambda: other("o", [m, l]), "has the shape (2, 1), the formula ()"),
    (lambda: limit("l", {m: 1}, [m, l]), "has the shape (2, 1), the formula ()"),
    (lambda: numeric_derivative("n", of=[q, q]), "has the shape (2, 1), the formula ()"),
    (lambda: energy_balance("e", sd.coordinates("x y"), q.dot), "there are 1 equations for the second derivatives of 2 coord"),
    (lambda: Proof("own", "It divides.", lambda f: 1 / 0), "ended with ZeroDivisionError: division by zero"),
    (lambda: Proof("own", "It is text.", lambda f: "m"), "text is never evaluated"),
])
def test_proofs_that_cannot_be_made(make, message):
    with pytest.raises(sd.CaseError) as caught:
        compare(sd.Formula("f", m * q, m * q * 2, errata=[sd.Erratum("No.", make())]))
    assert message in str(caught.value)


def test_text_is_never_run(tmp_path):
    target = tmp_path / "made"
    with pytest.raises(sd.CaseError):
        compare(sd.Formula("f", m, l, errata=[sd.Erratum("No.", limit("l", {m: 1}, f"open({str(target)!r}, 'w')"))]))
    assert not target.exists()


def test_shapes_that_no_convention_reconciles():
    with pytest.raises(sd.CaseError, match="printed as 1 x 3, derived as 2 x 1 in every convention it names"):
        compare(sd.Formula("f", [[m, l, g]], [m, l], conventions=[sd.conventions.transposed("the other way")]))
