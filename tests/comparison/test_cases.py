"""Verdicts, conventions, errata with their proofs, and what bad cases get."""

import pickle
import re

import pytest
import sympy as sp

import symdyn as sd
from symdyn.comparison.proofs import dimensions, energy_balance, limit, numeric_derivative, other
from symdyn.comparison.run import find
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
    (m * g / l, m * g * l, limit("Without an arm there is no moment.", {l: 0}, sp.S.Zero)),
    (sp.Eq(m * l * q.ddot, -m * g * sp.cos(q)), sp.Eq(m * l * q.ddot, -m * g * sp.sin(q)),
     energy_balance("Energy is kept.", [q], m * l**2 * q.dot**2 / 2 - m * g * l * sp.cos(q))),
    ([[m * l]], [[m * l**2]], other("The embedding formulation.", lambda: pendulum().M_tilde)),
])
def test_each_proof_distinguishes_the_wrong_formula_from_the_right_one(printed, derived, proof):
    erratum = sd.Erratum("It is wrong.", proof)
    found = compare(sd.Formula("f", printed, derived, errata=[erratum]))
    assert found.decided and found.counts[Verdict.WRONG] >= 1
    ((_, shown),) = found.errata
    assert shown.evidence.holds and shown.evidence.printed > 1e-6 and shown.evidence.right < 1e-25
    # A formula that is printed right cannot be proven wrong: with the sides changed the proof fails.
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


def test_text_of_a_comparison_reports_places_counts_and_points():
    text = str(compare(sd.Formula("v", [VELOCITY[0], -VELOCITY[1]], VELOCITY, line=17)))
    assert "17" in text and "1 equal, proved; 1 different, not proven wrong" in text
    assert re.search(r"\[1\] different, not proven wrong; refuted at this state: printed -?[\d.]+, derived -?[\d.]+ at l =", text)


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
def test_faults_of_a_bad_case_are_reported(make, message):
    with pytest.raises(sd.CaseError, match=re.escape(message)):
        sd.compare(sd.Case("bad", formulas=make))


def test_all_faults_of_a_case_are_reported_at_once():
    with pytest.raises(sd.CaseError) as caught:
        compare(sd.Formula("A", [[m, l], [m]], [[m], [l]]), sd.Formula("B", "m", m))
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
    with pytest.raises(sd.UnknownCase, match=r"there are \d+; `symdyn compare` lists them"):
        sd.compare("§")


@pytest.mark.parametrize("value", [3, None, [3]])
def test_compare_takes_names_and_cases_only(value):
    with pytest.raises(sd.CaseError, match="takes a name, a Case or several"):
        sd.compare(value)


PROOF = other("It.", m)


@pytest.mark.parametrize("given, same", [
    ({"slide": "3.2"}, {"slide": sd.Slide("3.2")}),
    ({"also": 3}, {"also": (3,)}),
    ({"also": [3, 4]}, {"also": (3, 4)}),
])
def test_a_single_value_stands_for_a_sequence(given, same):
    assert sd.Formula("f", m, m, **given) == sd.Formula("f", m, m, **same)
    (formula,) = sd.compare(sd.Case("one", formulas=sd.Formula("f", m, m, **given))).formulas
    assert formula.slide.section == ("3.2" if "slide" in given else "") and formula.also == same.get("also", ())


def test_a_single_convention_and_a_single_erratum():
    opposite = sd.conventions.opposite_sign("x points left")
    assert compare(sd.Formula("f", -m, m, conventions=opposite)).counts == {Verdict.CONVENTION: 1}
    assert compare(sd.Formula("f", 2 * m, m, errata=sd.Erratum("m is doubled.", PROOF))).counts == {Verdict.WRONG: 1}


def test_the_slide_of_a_case_as_text_is_its_section():
    found = sd.compare(sd.Case("mine", slide="3.2", formulas=[sd.Formula("f", m, m, line=4)]))
    assert found.slide == sd.Slide("3.2") and found.formulas[0].slide == sd.Slide("3.2", line=4)


def test_a_generator_of_formulas_can_be_compared_again():
    case = sd.Case("lazy", formulas=(sd.Formula(str(e), e, e) for e in (m, l)))
    assert [len(sd.compare(case).formulas) for _ in range(2)] == [2, 2]
    from_function = sd.Case("lazy", formulas=lambda: (sd.Formula(str(e), e, e) for e in (m, l)))
    assert [len(sd.compare(from_function).formulas) for _ in range(2)] == [2, 2]


def test_entries_of_an_erratum_may_be_lists():
    assert sd.Erratum("x", PROOF, [[0, 1], (2, 3)]).entries == ((0, 1), (2, 3))


@pytest.mark.parametrize("given, message", [
    ({"name": 3}, "the name of a formula is 3 of type int; pass text"),
    ({"name": " "}, "the name of a formula is empty"),
    ({"slide": 3.2}, "the slide of f is 3.2 of type float; pass symdyn.Slide(section, title, line), or the section as text"),
    ({"slide": sd.Slide(3.2)}, "the section of the slide of f is 3.2 of type float; pass text"),
    ({"slide": sd.Slide("3", 4)}, "the title of the slide of f is 4 of type int; pass text"),
    ({"slide": sd.Slide("3", "", "4")}, "the line of the slide of f is '4' of type str; pass a whole number"),
    ({"line": "7"}, "the line of f is '7' of type str; pass a whole number from 0 on"),
    ({"also": "3"}, "`also` of f is '3' of type str; pass numbers of lines, [3, 7]"),
    ({"also": [3, None]}, "`also` of f is (3, None) of type tuple"),
    ({"latex": 3}, "`latex` of f is 3 of type int; pass text"),
    ({"renamed": [(m, l)]}, "`renamed` of f is [(m, l)] of type list; pass a dict"),
    ({"where": [(m, l)]}, "`where` of f is [(m, l)] of type list; pass a dict"),
    ({"conventions": "opposite sign"}, "`conventions` of f is 'opposite sign' of type str; pass a list: [symdyn.conventions."),
    ({"conventions": ["transposed"]}, "`conventions` of f[0] is 'transposed' of type str; pass symdyn.conventions."),
    ({"conventions": 5}, "`conventions` of f is 5 of type int"),
    ({"errata": PROOF}, "pass a list: [symdyn.Erratum(why, proof), ...]"),
    ({"errata": [PROOF]}, "pass symdyn.Erratum(why, proof)"),
    ({"errata": sd.Erratum("", PROOF)}, "`why` of an erratum of f is empty; write it out"),
    ({"errata": sd.Erratum("x", None)}, "`proof` of an erratum of f is None of type NoneType; pass one of symdyn.proofs"),
    ({"errata": sd.Erratum("x", "limit")}, "`proof` of an erratum of f is 'limit' of type str; pass one of symdyn.proofs"),
    ({"errata": sd.Erratum("x", PROOF, [0])}, "`entries` of an erratum of f is (0,) of type tuple; pass a list of index tuples "
     "such as (0,) of a vector, (0, 1) of a matrix, counted from 0; you may mean [(0,)]"),
    ({"errata": sd.Erratum("x", PROOF, (0,))}, "you may mean [(0,)]"),
    ({"errata": sd.Erratum("x", PROOF, (0, 1))}, "you may mean [(0,), (1,)] or [(0, 1)]"),
    ({"errata": sd.Erratum("x", PROOF, 2)}, "`entries` of an erratum of f is 2 of type int"),
    ({"errata": sd.Erratum("x", PROOF, [(-1,)])}, "counted from 0"),
    ({"errata": sd.Erratum("x", PROOF, [])}, "`entries` of an erratum of f is empty; name entries, or leave it out"),
    ({"unreadable": "smudged"}, "f is unreadable as a whole ('smudged'), and something is printed; pass {index: reason}"),
    ({"unreadable": {0: "smudged"}}, "`unreadable` of f has the index 0 of type int; pass tuples such as (0,)"),
    ({"unreadable": {(0,): "smudged"}}, "`unreadable` of f names entry (0,); the print has one entry, ()"),
    ({"unreadable": {(2,): "smudged"}, "printed": [m, l]}, "names entry (2,); the print has the entries (0,) to (1,)"),
    ({"unreadable": {(0,): None}, "printed": [m]}, "`unreadable` of f at (0,) is None of type NoneType; pass text"),
    ({"unreadable": [(0,)]}, "`unreadable` of f is [(0,)] of type list; pass a sentence, or {index: sentence}"),
    ({"decimals": "2"}, "`decimals` of f is '2' of type str; pass a whole number from 0 on"),
    ({"decimals": -1}, "`decimals` of f is -1 of type int"),
    ({"decimals": True}, "`decimals` of f is True of type bool"),
])
def test_wrong_types_of_a_formula_are_reported(given, message):
    with pytest.raises(sd.CaseError, match=re.escape("the case 'mine': ") + ".*" + re.escape(message)):
        compare(sd.Formula(**{"name": "f", "printed": m, "derived": m} | given))


@pytest.mark.parametrize("given, message", [
    ({"name": 3}, "the name of a case is 3 of type int; pass text"),
    ({"name": ""}, "the name of a case is empty"),
    ({"title": 3}, "`title` is 3 of type int; pass text"),
    ({"slide": 3.2}, "`slide` is 3.2 of type float; pass symdyn.Slide"),
    ({"formulas": [("M", m, m)]}, "formulas[0] is ('M', m, m) of type tuple; pass symdyn.Formula(name, printed, derived)"),
    ({"formulas": {"M": m}}, "formulas is {'M': m} of type dict; pass a list: [symdyn.Formula(name, printed, derived), ...]"),
    ({"formulas": None}, "formulas is None of type NoneType; pass a list"),
    ({"formulas": lambda: None}, "formulas() is None of type NoneType; pass a list"),
    ({"formulas": lambda: [3]}, "formulas()[0] is 3 of type int"),
    ({"formulas": lambda missing: []}, "formulas() ended with TypeError"),
    ({"formulas": lambda: [1 // 0]}, "formulas() ended with ZeroDivisionError"),
    ({"formulas": lambda: (1 // n for n in (1, 0))}, "formulas() ended with ZeroDivisionError"),
    ({"printed": [m]}, "`printed` is [m] of type list; pass a dict"),
    ({"printed": {"M": m}}, "something is printed, but nothing derived; pass derived=..."),
    ({"printed": {3: m}, "derived": {3: m}}, "a name in `printed` is 3 of type int; pass text"),
    ({"printed": {"M": m}, "derived": {}}, "`derived` has no M; it has nothing"),
    ({"printed": {"latex": m}, "derived": pendulum()}, "latex of `derived` is a method; call it and pass what it returns: "
     "derived={'latex': ...}"),
])
def test_wrong_types_of_a_case_are_reported(given, message):
    name = given.get("name", "mine")
    with pytest.raises(sd.CaseError, match=re.escape(f"the case {name!r}: " if name else "") + ".*" + re.escape(message)):
        sd.compare(sd.Case(**{"name": "mine", "formulas": () if "printed" in given else [sd.Formula("f", m, m)]} | given))


def test_an_attribute_of_what_is_derived_that_raises():
    class Equations:
        @property
        def M(self):
            raise ValueError("no mass")

    with pytest.raises(sd.CaseError, match="the case 'mine': M of `derived` ended with ValueError: no mass"):
        sd.compare(sd.Case("mine", printed={"M": m}, derived=Equations()))


def test_all_wrong_types_of_a_case_are_reported_at_once():
    case = sd.Case("mine", 3, formulas=[
        sd.Formula("a", m, m, also="3", decimals="2", conventions=sd.conventions.transposed("")),
        sd.Formula("b", m, m, renamed=[m], errata=[sd.Erratum("", None, [0])]), ("c", m, m)], printed=[m])
    with pytest.raises(sd.CaseError) as caught:
        case.taken()
    assert len(caught.value.faults) == 10 and str(caught.value).startswith("the case 'mine' has 10 faults:\n  - ")


def test_a_case_error_comes_whole_from_another_process():
    for error in (sd.CaseError(["one"], "mine"), sd.CaseError(["one", "two"], "mine"), sd.CaseError(["one"])):
        again = pickle.loads(pickle.dumps(error))
        assert (str(again), again.faults, again.name) == (str(error), error.faults, error.name)


def fails(*_):
    raise ValueError("no such body")


@pytest.mark.parametrize("formula, message", [
    (sd.Formula("M", m, fails), "the case 'mine': what is derived for M ended with ValueError: no such body"),
    (sd.Formula("M", m, lambda missing: m), "the case 'mine': what is derived for M ended with TypeError"),
    (sd.Formula("M", m, l, conventions=sd.conventions.Convention("mine", "It fails.", fails)),
     "the case 'mine': M: the convention 'mine' ended with ValueError: no such body"),
    (sd.Formula("M", m, l, conventions=sd.conventions.transposed("A row.")),
     "the case 'mine': M: the convention 'transposed': what is derived is a scalar, l; only a vector or a matrix can be "
     "transposed"),
    (sd.Formula("M", m, l, conventions=sd.conventions.reordered([0], sentence="Otherwise.")),
     "what is derived is a scalar, l; only a vector or a matrix can be put in another order"),
    *[(sd.Formula("M", [m, l], [l, m], conventions=sd.conventions.reordered(rows, sentence="Otherwise.")),
       f"the convention 'order of coordinates': rows is {rows!r}, what is derived is 2 x 1; pass each index from 0 to 1 once")
      for rows in ([1], [1, 1], [1, 2], [-1, 0], ["a", "b"], 1, "10")],
    (sd.Formula("M", [[m, l]], [[l, m]], conventions=sd.conventions.reordered(columns=[0, 1, 2], sentence="Otherwise.")),
     "columns is [0, 1, 2], what is derived is 1 x 2"),
    (sd.Formula("M", m, l, conventions=sd.conventions.reordered([0])),
     "M: the convention 'order of coordinates' has no sentence; say in `sentence` what the slide does otherwise"),
    (sd.Formula("M", m, l, conventions=sd.conventions.opposite_sign(3)), "the sentence of the convention 'opposite sign' is 3"),
    (sd.Formula("M", m, l, conventions=sd.conventions.Convention("", "It.", abs)), "the name of a convention is empty"),
    (sd.Formula("M", m, l, conventions=sd.conventions.Convention("mine", "It.", 2)),
     "`to_slide` of the convention 'mine' is 2 of type int; pass a function of what is derived"),
])
def test_what_functions_and_conventions_of_a_formula_raise(formula, message):
    with pytest.raises(sd.CaseError, match=re.escape(message)) as caught:
        compare(formula)
    assert str(caught.value).startswith("the case 'mine': ")


def test_equal_formulas_need_no_convention_that_fits():
    # A convention is tried only where what is printed differs.
    assert compare(sd.Formula("M", m, m, conventions=sd.conventions.transposed("A row."))).counts == {Verdict.EQUAL: 1}


@pytest.mark.parametrize("factor, message", [
    ("m", "the common factor is the text 'm'; text is never evaluated"),
    (float("nan"), "finite"),
    (0, "the common factor 0 is zero"),
    (sp.sin(q) ** 2 + sp.cos(q) ** 2 - 1, "is zero, and would make all formulas equal; pass one that is not"),
    (sp.sin(2 * q) - 2 * sp.sin(q) * sp.cos(q), "is zero"),
    ([m], "pass a number or an expression"),
])
def test_factors_that_cannot_be_common(factor, message):
    with pytest.raises(sd.CaseError, match=re.escape(message)):
        sd.conventions.scaled(factor, "divided")


def test_an_order_needs_rows_or_columns():
    with pytest.raises(sd.CaseError, match=re.escape("neither rows nor columns; pass rows=[...] or columns=[...]")):
        sd.conventions.reordered(sentence="x before y")


def test_a_section_or_a_chapter_is_all_of_its_cases():
    sections = {case.name: case.slide.section for case in sd.lecture.cases()}
    section = sd.compare("1.5")
    assert [c.name for c in section] == [name for name, s in sections.items() if s == "1.5"] and len(section) == 2
    cases = find(["3"])
    assert [c.name for c in cases] == [name for name, s in sections.items() if s.startswith("3.")] and len(cases) > 10
    assert [c.name for c in find(["1.1", sd.Case("mine")])] == [*[n for n, s in sections.items() if s == "1.1"], "mine"]


def test_the_lecture_is_a_public_name():
    assert "lecture" in sd.__all__ and sd.__getattr__("lecture").names() == [case.name for case in find(list("123456"))]


def test_sections_without_cases():
    for name in ("9", "3.55", "0.1"):
        with pytest.raises(sd.UnknownCase, match=f"there is no case of section {name}; sections with cases are 1.1, 1.2, .*6.4"):
            sd.compare(name)


def test_remarks_are_checked():
    case = sd.Case("remarks", formulas=[sd.Formula("m", 1, 1)], remarks=[sd.Remark("", -1, "3"), "a word"])
    with pytest.raises(sd.CaseError) as error:
        sd.compare(case)
    said = str(error.value)
    assert "`why` of a remark is empty" in said and "the line of a remark is -1" in said
    assert "`also` of a remark is '3' of type str" in said and "`remarks`[1] is 'a word'" in said


def test_the_slip_of_an_erratum_is_text():
    case = sd.Case("slip", formulas=[sd.Formula("m", 1, 2, errata=[sd.Erratum("No.", sd.proofs.other("So.", 2), slip=3)])])
    with pytest.raises(sd.CaseError, match="`slip` of an erratum of m is 3 of type int; pass text"):
        sd.compare(case)


def test_entries_that_are_sampled_are_named_with_the_reason():
    found = sd.compare([sd.Case("gravity", formulas=[sd.Formula("g", [9.81 * l, m], [sp.Rational(981, 100) * l, m])])])
    assert found.proved == 1 and len(found.cases[0].sampled) == 1
    assert "1 equal, proved; 1 equal, sampled" in str(found.cases[0])
    assert "1 of 2 decided entries are proved equal, or refuted at a state; sampled:" in str(found)
    assert "\n  gravity, g: [0] equal at 24 random points" in str(found) and "not proved: decimal numbers" in str(found)


def test_symbols_that_only_the_print_holds_are_named():
    wrong = compare(sd.Formula("F", [sp.Symbol("M") * g * sp.sin(q), l * q.dot], sp.Matrix([m * g * sp.sin(q), 2 * l * q.dot])))
    first, second = wrong.formulas[0].entries
    assert (first.note, second.note) == ("only the print holds M", "") and "; only the print holds M" in str(wrong)
