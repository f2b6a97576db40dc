"""Equations that were derived separately are proved equal; a mistake in one of them is refuted."""

import dataclasses

import pytest
import sympy as sp

import symdyn as sd

PAIRS = [("embedding", "recursive"), ("augmented", "recursive"), ("recursive", "embedding")]
SOLVE = "accelerations of the {1} equations solve the {0} ones"


def derived(name, *formulations):
    system = sd.systems.get(name)
    return [getattr(system, formulation)() for formulation in formulations]


@pytest.mark.parametrize("pair", PAIRS, ids="-".join)
@pytest.mark.parametrize("name", ["pendulum", "double_pendulum", "cart_pole", "two_link_arm", "three_link_arm",
                                  "flyball_governor", "vehicle_on_rotating_track", "prismatic_chain"])
def test_formulations_of_the_catalogue_are_the_same(name, pair):
    first, second = derived(name, *pair)
    found = first.prove(second)
    assert found.proved, str(found)
    names = [claim.name for claim in found.claims]
    assert SOLVE.format(*pair) in names and "M_tilde is the same" in names and "inverse_dynamics is the same" in names


@pytest.mark.parametrize("name", ["puma560", "n_link_pendulum"])
def test_what_is_too_large_is_undecided_with_the_reason_and_the_rest_proved(name):
    first, second = derived(name, "embedding", "recursive")
    found = first.prove(second)
    *others, last = found.claims
    assert all(claim.proof.proved for claim in others) and not found.refuted
    assert last.proof.verdict == "undecided" and "above the bound of 100,000; ask for a part of it" in last.proof.reason


def test_equations_from_positions_are_those_of_bodies_and_joints():
    """The arm by hand, J^T M J from positions, and from bodies and joints."""
    system = sd.systems.two_link_arm()
    of_bodies = system.recursive()
    q1, q2 = of_bodies.symbols.coordinates
    named = {s.name: s for s in (*of_bodies.symbols.parameters, *of_bodies.symbols.inputs)}
    m1, m2, I1, I2, l1, lc1, lc2, g = (named[name] for name in ("m1", "m2", "I1", "I2", "l1", "lc1", "lc2", "g"))
    tau1, tau2 = (named[name] for name in ("tau1", "tau2"))
    x1, y1 = lc1 * sp.cos(q1), lc1 * sp.sin(q1)
    x2, y2 = l1 * sp.cos(q1) + lc2 * sp.cos(q1 + q2), l1 * sp.sin(q1) + lc2 * sp.sin(q1 + q2)
    by_hand = sd.embedding([q1, q2], [x1, y1, q1, x2, y2, q1 + q2], mass=[m1, m1, I1, m2, m2, I2],
                           force=[0, -m1 * g, tau1 - tau2, 0, -m2 * g, tau2])
    found = of_bodies.prove(by_hand)
    assert found.proved, str(found)
    names = {claim.name for claim in found.claims}
    assert {"M_tilde is the same", "k_tilde is the same", "F_tilde is the same",
            "accelerations of the embedding equations solve the recursive ones"} <= names


@pytest.mark.parametrize("quantity", ["M_tilde", "k_tilde", "J", "accelerations"])
def test_a_mistake_in_one_is_refuted(quantity):
    first, second = derived("two_link_arm", "embedding", "recursive")
    wrong = second.quantity(quantity) * 1
    wrong.ravel()[0] = wrong.ravel()[0] + second.leaves[second.symbols.coordinates[1]]
    spoilt = dataclasses.replace(second, _recorded={**second._recorded, quantity: wrong}, _printed={})
    found = first.prove(spoilt)
    refuted = [claim for claim in found.claims if claim.proof.refuted]
    assert len(refuted) == 1 and (quantity in refuted[0].name) and refuted[0].proof.state
    if quantity != "accelerations":
        assert str(refuted[0].proof.difference) == "-q2" and "the sides differ by -q2" in str(found)


def test_equations_with_constraints_are_compared_row_by_row():
    first, second = derived("four_bar", "augmented", "augmented")
    found = first.prove(second)
    assert found.proved and {"C is the same", "C_r is the same", "F_d is the same"} <= {claim.name for claim in found.claims}


def test_sides_that_vanish_by_cancellation_are_not_refuted():
    """Both sides are rounding, which differs; with twice the digits nothing of it remains."""
    first, second = derived("spatial_chain", "embedding", "recursive")
    found = first.prove(second)
    assert not found.refuted, str(found)


@pytest.mark.parametrize(("other", "message"), [
    (lambda: "two_link_arm", "prove compares equations with other equations of the mechanism, found 'two_link_arm'"),
    (lambda: sd.systems.get("three_link_arm").recursive(),
     "compared in the same coordinates, in the same order; the recursive ones have q1; q2, the recursive ones q1; q2; q3")])
def test_what_cannot_be_compared(other, message):
    with pytest.raises(sd.ArgumentError, match=message):
        sd.systems.two_link_arm().recursive().prove(other())
