"""Named intermediates stand for what they are called, in an order to read, and put together give the quantity."""

import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import SymdynError
from symdyn.exact.ring import TooLarge
from symdyn.model.symbols import symbols_of


@pytest.mark.parametrize(("name", "quantity"), [("four_bar", "k_tilde"), ("three_link_arm", "M_tilde"), ("cart_pole", "F_tilde"),
                                                ("flyball_governor", "k_tilde")])
def test_put_together_they_are_the_quantity(name, quantity):
    system = sd.systems.get(name)
    eq = system.augmented() if name in sd.systems.names(constrained=True) else system.embedding()
    value, steps = eq.explicit(quantity, intermediates=True)
    known = symbols_of(eq.explicit(quantity))
    for step in steps:
        assert symbols_of(step.expression) <= known, step
        known.add(step.symbol)
    for step in reversed(steps):
        value = value.xreplace({step.symbol: step.expression})
    assert sd.prove(value, eq.explicit(quantity, simplify=False))


def test_constants_come_first_and_are_named_once():
    value, steps = sd.systems.get("four_bar").augmented().explicit("k_tilde", intermediates=True)
    assert [(str(s.symbol), s.meaning) for s in steps[:4]] == [
        ("h_1", "constant of the mechanism: h_x_bar2*l1, of the base parameters"),
        ("h_2", "constant of the mechanism: h_x_bar3*l1, of the base parameters"),
        ("h_3", "constant of the mechanism: h_x_bar3*l2, of the base parameters"), ("s_{2}", "sine of q2")]
    assert {str(s.expression) for s in steps[:3]} == {"l1*(l2*m3 + lc2*m2)", "l1*lc3*m3", "l2*lc3*m3"}
    assert sp.count_ops(value) < 30


def test_a_sum_of_base_parameters_is_called_so():
    _, steps = sd.systems.two_link_arm().embedding().explicit("M_tilde", intermediates=True)
    assert str(steps[0].expression) == "I1 + I2 + lc1**2*m1 + m2*(l1**2 + lc2**2)"
    assert steps[0].meaning == "constant of the mechanism: I_zz_link1 + I_zz_link2, of the base parameters"


def test_more_than_a_page_is_given_in_the_steps_of_the_derivation():
    eq = sd.systems.puma560().embedding()
    value, steps = eq.explicit("k_tilde", intermediates=True)
    meanings = [step.meaning for step in steps]
    assert {"inertia of link 5, zz", "angular velocity of link 3, x", "cosine of q3"} <= set(meanings)
    known = symbols_of(eq.explicit("bias", simplify=False))
    for step in steps:
        assert symbols_of(step.expression) <= known, step
        known.add(step.symbol)
    for step in reversed(steps):
        value = value.xreplace({step.symbol: step.expression})
    assert sd.prove(value, eq.explicit("k_tilde", simplify=False))


def test_what_is_too_large_to_be_read_has_intermediates():
    eq = sd.systems.get("spatial_chain").embedding()
    with pytest.raises(SymdynError, match=r"k_tilde is too large to be read: it has 59,165 terms, above the bound of 20,000 for "
                                          r"printing, and 389,500 operations as it was derived; ask for named intermediates with "
                                          r"explicit\('k_tilde', intermediates=True\)"):
        _ = eq.k_tilde
    value, steps = eq.explicit("k_tilde", intermediates=True)
    assert sp.count_ops(value) + sum(sp.count_ops(step.expression) for step in steps) < 1000


@pytest.mark.parametrize(("name", "quantity", "most"), [("n_link_pendulum", "M_tilde", 300), ("puma560", "M_tilde", 600),
                                                        ("puma560", "k_tilde", 1500)])
def test_long_ones_fit_a_page(name, quantity, most):
    value, steps = sd.systems.get(name).embedding().explicit(quantity, intermediates=True)
    assert sp.count_ops(value) + sum(sp.count_ops(step.expression) for step in steps) < most


def test_names_of_the_user_are_left_alone():
    q = sd.coordinates("q")
    h_1, p_1, m = sd.parameters("h_1 p_1 m")
    system = sd.System("named", gravity=[0, -1, 0])
    body = system.add_body("body", mass=m, inertia=[0, 0, h_1], com=[p_1 + h_1, 0, 0])
    system.add_joint(sd.Revolute("joint", system.ground, body, q))
    _, steps = system.embedding().explicit("M_tilde", intermediates=True)
    assert [str(step.symbol) for step in steps] == ["hh_1"]


def test_too_large(monkeypatch):
    def too_large(*_: object) -> None:
        raise TooLarge("a product has up to 9 terms, above the bound of 8")

    monkeypatch.setattr("symdyn.report.named.with_intermediates", too_large)
    with pytest.raises(SymdynError, match="M_tilde is too large for named intermediates: a product has up to 9 terms"):
        sd.systems.pendulum().embedding().explicit("M_tilde", intermediates=True)
