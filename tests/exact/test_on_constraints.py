"""Claims and shortest forms on relations: constraints of mechanisms, and expressions that are zero."""

import dataclasses

import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError
from symdyn.exact.ideal import Ideal
from symdyn.exact.mechanism import POWER
from symdyn.exact.taken import recorded
from symdyn.exact.walk import Exact
from tests.helpers import swept

x, y = sp.symbols("x y", real=True)
l = sp.Symbol("l", positive=True)
s, c = sp.sin, sp.cos


@pytest.fixture(scope="module")
def four_bar():
    eq = sd.systems.get("four_bar").augmented()
    lengths = {p.name: p for p in eq.symbols.parameters}
    return eq, eq.symbols.coordinates, eq.symbols.speeds, [lengths[name] for name in ("l1", "l2", "l3", "d")]


@pytest.mark.parametrize(("a", "b", "on"), [
    (x**4 + x**2 * y**2, x**2, x**2 + y**2 - 1),
    (x, 0, x**2),
    (c(x) ** 2, c(y) ** 2, [sp.Eq(s(x), s(y))]),
    (s(x), -s(y), l * (s(x) + s(y))),
    (sp.Matrix([x * y, y**2]), sp.Matrix([1, y**2]), sp.Matrix([x * y - 1])),
    (x + sp.sqrt(y), 2 * x, [x**2 - y, sp.sqrt(y) - x]),
])
def test_proved_on_relations(a, b, on):
    assert not sd.prove(a, b)
    assert str(sd.prove(a, b, on=on)) == "proved: on the relations"


@pytest.mark.parametrize(("a", "on"), [(x - y, x**2 + y**2 - 1), (c(x) - c(y), s(x) - s(y)), (x, [x**2 - l**2])])
def test_refuted_at_a_state_that_fulfils_the_relations(a, on):
    proof = sd.prove(a, on=on)
    assert proof.refuted and abs(a.subs(proof.state)) > 1e-6
    assert all(abs(e.subs(proof.state)) < 1e-12 for e in (on if isinstance(on, list) else [on]))


def test_proved_without_the_relations_reports_it():
    assert str(sd.prove(s(x) ** 2 + c(x) ** 2, 1, on=x - y)) == "proved"


@pytest.mark.parametrize(("on", "reason"), [
    ([x, x - 1], "undecided: the relations contradict each other: nothing fulfils them, and anything would follow"),
    (x**2 + y**2 + 1, "undecided: nothing real fulfils the relations: x**2 + y**2 + 1 is never zero"),
    (sp.sqrt(x) + 1, "undecided: nothing real fulfils the relations: sqrt(x) + 1 is never zero"),
    (-l - sp.exp(x) - 2, "undecided: nothing real fulfils the relations: -l - exp(x) - 2 is never zero"),
    (s(x) - 2, "undecided: no state was found that fulfils the relations, and no multiples of them add up to the difference of "
               "the sides, x - y"),
])
def test_relations_that_nothing_fulfils_prove_nothing(on, reason):
    assert str(sd.prove(x, y, on=on)) == reason


def test_multiples_of_relations_that_nothing_real_fulfils_are_no_proof():
    assert str(sd.prove(x * (s(y) - 2), 0, on=s(y) - 2)) == (
        "undecided: no real values were found that fulfil the relations; from what nothing fulfils anything would follow")
    assert str(sd.prove(x * (s(y) - 1), 0, on=s(y) - 1)) == "proved: on the relations"


@pytest.mark.parametrize(("a", "b", "on"), [
    (s(x), 0, x), (c(x + y), c(y), x), (s(x), s(y), x - y), (c(x), c(y), x + y), (sp.exp(x), 1, x), (sp.sqrt(x), 1, x - 1),
    (s(x) + y, s(4) + 2, [x - 2 * y, y - 2]), (sp.Matrix([s(x), c(x)]), sp.Matrix([0, 1]), sp.Eq(x, 0)),
    (s(x / l), s(y), x - l * y), (s(x) * y**2, s(x), [x - y, y**2 - 1])])
def test_relations_reach_into_functions(a, b, on):
    assert str(sd.prove(a, b, on=on)) == "proved: on the relations" and not sd.prove(a, b)


def test_relations_reach_into_functions_only_where_they_hold():
    assert sd.prove(s(x), s(y), on=x**2 - y**2).refuted and sd.prove(c(x), 1, on=x - y).refuted
    assert sd.prove(s(x), s(y), on=x * y).refuted  # x y = 0 gives neither
    z = sp.Symbol("z", real=True)
    assert not sd.prove(s(x), s(y), on=z * (x - y)).proved  # z may be zero


def test_closed_loop_of_four_bars(four_bar):
    eq, (q1, q2, q3), (u1, u2, u3), (l1, l2, l3, d) = four_bar
    # Freudenstein, Approximate synthesis of four-bar linkages, Trans. ASME 77 (1955): the coupler is as long as it is.
    coupler = (d - l1 * c(q1) - l3 * c(q1 + q2 + q3)) ** 2 + (l1 * s(q1) + l3 * s(q1 + q2 + q3)) ** 2
    assert sd.prove(coupler, l2**2, on=eq) and sd.prove(coupler, l2**2, on=list(eq.C)) and not sd.prove(coupler, l2**2)
    wrong = sd.prove(coupler, l1**2, on=eq)
    assert wrong.refuted and max(abs(e.subs(wrong.state)) for e in eq.C) < 1e-12
    # Ratios of the angular velocities hold with the rates of the constraints, not with their positions alone.
    ratio = u1 + u2, -l1 * u1 * s(q2 + q3) / (l2 * s(q3))
    assert sd.prove(*ratio, on=eq) and sd.prove(*ratio, on=[eq.C, eq.explicit("C_dot")])
    assert sd.prove(*ratio, on=eq.C).refuted
    a1, a2, a3 = (u.dot for u in (u1, u2, u3))
    rate = (a1 * l1 * s(q2) - (a1 + a2 + a3) * l3 * s(q3), (u1 + u2 + u3) * l3 * u3 * c(q3) - l1 * u1 * u2 * c(q2))
    assert sd.prove(*rate, on=eq) and sd.prove(rate[0], 2 * rate[1], on=eq).refuted


def test_parameters_of_a_mechanism_are_not_zero_in_its_constraints():
    eq = sd.systems.get("slider_crank").augmented()
    theta, phi = eq.symbols.coordinates
    assert sd.prove(c(theta) ** 2, c(phi + theta) ** 2, on=eq)
    assert sd.prove(c(theta) ** 2, c(phi + theta) ** 2, on=eq.C).refuted
    assert sd.prove(c(theta), c(phi + theta), on=eq).refuted


def test_euler_parameters_have_unit_norm_on_constraints():
    p = sd.coordinates("p0:4")
    system = sd.System("ball", gravity=[0, 0, -9.81])
    body = system.add_body("ball", mass=1, inertia=[1, 1, 2])
    system.add_joint(sd.Spherical("tip", system.ground, body, coordinates=list(p), orientation=sd.EulerParameters()))
    system.add_constraint(sd.rotation_matrix(body)[0, 2])
    eq = system.augmented()
    assert sd.prove(sum(e**2 for e in p), 1, on=eq) and sd.prove(p[1] * p[3], -p[0] * p[2], on=eq)
    # The body's z-axis stays in a plane: a component of its angular velocity follows.
    assert sd.prove((eq.C_r * sp.Matrix(eq.symbols.speeds))[0], 0, on=eq)


def test_limits_keep_what_was_found():
    """A basis that is cut short proves less, and nothing wrong."""
    nodes, _ = recorded([x * (x * y - 1), x * y - 1, x + y])
    exact = Exact(nodes)
    ideal = Ideal(exact.ring, [exact.values[1].num])
    assert ideal.contains(exact.values[0].num) and not ideal.contains(exact.values[2].num)
    assert not Ideal(exact.ring, []).contains(exact.values[0].num)


@pytest.mark.parametrize(("on", "message"), [
    ("x", "on takes expressions that are zero, equations and lists of these, or equations of a mechanism with constraints; "
          "found 'x'"),
    (True, "found True"),
    (sp.zoo, "found zoo"),
    (3, "on takes expressions that are zero somewhere; 3 is not"),
    ([x, sp.Integer(1)], "on takes expressions that are zero somewhere; 1 is not"),
])
def test_what_is_no_relation_is_rejected(on, message):
    with pytest.raises(ArgumentError) as error:
        sd.prove(x, y, on=on)
    assert message in str(error.value)


def test_equations_without_constraints_are_rejected():
    with pytest.raises(ArgumentError, match=r"two_link_arm \(embedding\) has no constraints that a claim could hold on"):
        sd.prove(x, y, on=sd.systems.two_link_arm().embedding())


def test_energy_of_constrained_mechanisms_with_multipliers():
    for name in ("four_bar", "particle_on_moving_slope", "rolling_disc"):
        proofs = sd.systems.get(name).augmented().prove()
        claim = next(claim for claim in proofs.claims if claim.name.endswith("on C_dot = 0 with multipliers"))
        assert claim.proof.proved and proofs.proved


def test_a_mistake_in_the_rates_of_constraints_spoils_the_power_of_multipliers():
    eq = sd.systems.get("four_bar").augmented()
    rates = eq.quantity("C_dot").copy()
    rates[0] = rates[0] * 2
    spoilt = dataclasses.replace(eq, _recorded={**eq._recorded, "C_dot": rates}, _printed={})
    verdicts = {claim.name: claim.proof.verdict for claim in spoilt.prove().claims}
    assert verdicts[POWER] == "refuted"


# -- forms that hold on the constraints


@pytest.mark.parametrize("name", [*swept(["four_bar"]), "slider_crank", *swept(["spatial_slider_crank"]), "skate"])
def test_forms_on_the_constraints_are_shorter_and_proved(name):
    eq = sd.systems.get(name).augmented()
    shorter = 0
    for quantity in ("M_tilde", "k_tilde", "C_r", "F_d", "T"):
        plain, short = eq.explicit(quantity), eq.explicit(quantity, on_constraints=True)
        assert sp.count_ops(short) <= sp.count_ops(plain) and sd.prove(plain, short, on=eq)
        shorter += sp.count_ops(short) < sp.count_ops(plain)
    assert shorter >= 1


def test_constraints_vanish_on_themselves(four_bar):
    eq, (q1, q2, q3), _, (l1, l2, l3, d) = four_bar
    assert eq.explicit("C", on_constraints=True).is_zero_matrix and not eq.C.is_zero_matrix
    assert eq.explicit("C_r", on_constraints=True) == sp.Matrix([
        [0, l1 * s(q1), -l3 * s(q1 + q2 + q3)], [d, l2 * c(q1 + q2) + l3 * c(q1 + q2 + q3), l3 * c(q1 + q2 + q3)]])


def test_slider_crank_on_its_constraint():
    eq = sd.systems.get("slider_crank").augmented()
    l, m = (next(p for p in eq.symbols.parameters if p.name == name) for name in "lm")
    theta, phi = eq.symbols.coordinates
    assert eq.explicit("k_tilde", on_constraints=True) == sp.Matrix([0, l**2 * m * theta.dot**2 * s(phi) / 2])


def test_what_cannot_be_written_on_constraints_is_rejected(four_bar):
    eq = four_bar[0]
    with pytest.raises(ArgumentError, match="has no constraints that a quantity could be written on; leave out on_constraints"):
        sd.systems.two_link_arm().embedding().explicit("k_tilde", on_constraints=True)
    with pytest.raises(ArgumentError, match="the form 'fourier' of C_r was asked for, together with on_constraints=True"):
        eq.explicit("C_r", form="fourier", on_constraints=True)
    with pytest.raises(ArgumentError, match="C_r was asked for on the constraints, together with intermediates=True"):
        eq.explicit("C_r", intermediates=True, on_constraints=True)
    with pytest.raises(ArgumentError, match="on_constraints"):
        eq.explicit("C_r", on_constraints="yes")
