"""Units of entries follow from those of symbols, and sums of different ones are reported."""

import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ModelError
from symdyn.exact.dimensions import parsed, text, units_of_expressions
from tests.helpers import swept

m, g, l, k = sd.parameters("m g l k", positive=True)


@pytest.mark.parametrize(("unit", "written"), [
    ("kg m^2/s^2", "N m"), ("N m/rad", "N m"), ("rad/s", "1/s"), ("1", "1"), ("J", "N m"), ("N s/m", "N s/m"),
    ("kg/m^3", "kg/m^3"), ("N·m", "N m"), ("N*m", "N m"), ("kg·m²", "kg m^2"), ("m/s²", "m/s^2"), ("m/s**2", "m/s^2"),
    ("s⁻¹", "1/s"), ("N⋅s/m", "N s/m"), ("N/(m/s)", "N s/m"), ("kg/(m s)", "kg/m s"), ("(kg m)^2/s", "kg^2 m^2/s"),
    ("kg (m/s)^2", "N m"), ("Ω·A", "kg m^2/s^3 A"), ("m^(-1)", "1/m"),
    ("m^-1", "1/m"), ("W", "W"), ("kg*m", "kg m"), ("m/s/s", "m/s^2"), ("V", "kg m^2/s^3 A"), ("kg m^2", "kg m^2"), ("Pa", "Pa")])
def test_units_are_read_and_written(unit, written):
    assert text(parsed(unit)) == written
    assert parsed(written) == parsed(unit)


@pytest.mark.parametrize("unit", ["", None, "mm", "N m!", "furlong", "N/", "(N m", "N m)", "()", "m^", "m 2", "m//s"])
def test_units_that_are_not_known(unit):
    assert parsed(unit) is None and text(None) == "?"


@pytest.mark.parametrize("name", [*sd.systems.names(constrained=False), "four_bar", "slider_crank", "rolling_disc", "sleigh",
                                  *swept(["stewart_platform", "andrews_squeezer", "double_wishbone", "floating_crane"])])
def test_the_catalogue_agrees(name):
    system = sd.systems.get(name)
    eq = system.recursive() if name in sd.systems.names(constrained=False) else system.augmented()
    report = eq.check_units()
    assert report and report.agree and not report.inferred, str(report)
    assert str(report) == f"{eq.name} ({eq.formulation}): units agree"


def test_units_of_entries():
    report = sd.systems.get("cart_pole").embedding().check_units()
    assert report.units["T"] == report.units["V"] == "J"
    assert report.units["M_tilde"] == [["kg", "kg m"], ["kg m", "kg m^2"]]
    assert report.units["F_tilde"] == ["N", "N m"]


def arm(load, outputs=(), units=None):
    x, q = sd.coordinates("x q")
    system = sd.System("arm", gravity=[0, -g])
    cart, rod = system.add_body("cart", mass=m), system.add_body("rod", mass=m, com=[0, -l])
    rail = system.add_joint(sd.Prismatic("rail", system.ground, cart, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Revolute("hinge", cart, rod, coordinate=q))
    system.add_joint_force(rail, load(x, q))
    for name, value in outputs:
        system.add_output(name, value(x, q))
    system.units = {k: "N/m", **(units or {})}
    return system.embedding()


def test_a_sum_of_metres_and_radians_is_reported():
    report = arm(lambda x, q: -k * (x + q)).check_units()
    assert not report and "a sum of x in m and q in 1" in str(report)
    assert "numbers count as factors without a unit" in str(report)


def test_a_load_of_the_wrong_unit_and_functions():
    assert "F_tilde[0] is in N m, the equations take it in N" in arm(lambda x, q: -k * l * x).check_units().faults
    assert any("sin of x in m" in fault for fault in arm(lambda x, q: -k * l * sp.sin(x)).check_units().faults)
    assert any("a power with" in fault for fault in arm(lambda x, q: -k * l * q**(x / l) * (l / m)**q).check_units().faults)
    assert any("imum of" in fault for fault in arm(lambda x, q: -k * sp.Max(x, q)).check_units().faults)
    assert any("output" in fault and "a sum of" in fault for fault in arm(lambda x, q: -k * x, [("mixed", lambda x, q: x + q)])
               .check_units().faults)


@pytest.mark.parametrize(("force", "fault"), [
    (lambda x, q: sp.Piecewise((x, x > 0), (q, True)), "a choice of x in m and q in 1"),
    (lambda x, q: sp.Max(x, 0, q), "Max(0, q) in 1 and x in m"),
    (lambda x, q: (x / l) ** (q * m), "a power with m*q in kg"),
])
def test_what_does_not_fit_is_named_with_its_own_unit(force, fault):
    faults = arm(lambda x, q: -k * force(x, q)).check_units().faults
    assert any(fault in f for f in faults), faults


def test_units_that_cannot_be_read_are_named():
    c, c3 = sd.parameters("c c3")
    report = arm(lambda x, q: -k * x - c * x.dot - c3 * x**3, units={c: "kN s/m"}).check_units()
    assert report.agree and report.unread == {c: "kN s/m"}
    assert str(report).splitlines()[1:] == [
        "  c has the unit 'kN s/m', which is not read; the equations give it N s/m",
        "  c3 has no unit; the equations give it kg/m^2 s^2",
        "  units are products of powers of 1, rad, deg, rev, sr, kg, m, s, A, K, N, J, W, Pa, Hz, V, C, ohm, H, "
        "such as 'N m/rad'"]


def test_units_that_are_not_given_are_inferred():
    c, c3 = sd.parameters("c c3")
    report = arm(lambda x, q: -k * x - c * x.dot - c3 * x**3).check_units()
    assert report.agree and report.inferred == {c: "N s/m", c3: "kg/m^2 s^2"}
    assert "c has no unit; the equations give it N s/m" in str(report)
    product = sd.parameters("free")
    assert arm(lambda x, q: -k * x * sp.exp(0 * x) - c * product * x.dot).check_units().inferred[c] == "?"


def test_extra_states_and_constraints():
    z = sd.coordinates("z")
    system = sd.System("servo")
    block = system.add_body("block", mass=m)
    x = sd.coordinates("x")
    rail = system.add_joint(sd.Prismatic("rail", system.ground, block, axis=[1, 0, 0], coordinate=x))
    system.add_state(z, -k * z)
    system.add_joint_force(rail, z)
    system.units = {z: "N", k: "1"}
    assert system.embedding().check_units().faults == ("state_rates[0] is in N, the equations take it in kg m/s^3",)


def test_expressions():
    units = {m: parsed("kg"), l: parsed("m"), k: None}
    choice = sp.Piecewise((l, m > 1), (2 * l, True))
    found = units_of_expressions([m * l**2, sp.sqrt(m**2 * l), 2 * m, sp.Integer(3), k * m, choice], units)
    assert [text(d) for d in found] == ["kg m^2", "kg m^1/2", "kg", "1", "?", "m"]


def test_named_intermediates_carry_their_units():
    eq = sd.systems.get("four_bar").augmented()
    _, steps = eq.explicit("k_tilde", intermediates=True)
    units = {step.meaning.split(" ")[0]: step.unit for step in steps}
    assert units["constant"] == "kg m^2" and units["sine"] == "1" and "?" not in {step.unit for step in steps}
    assert {step.unit for step in steps if "q3_dot" in str(step.expression)} == {"1/s^2"}


def test_signs_of_units_in_a_system():
    system = sd.systems.pendulum()
    length, = [p for p in system.check().parameters if p.name == "l"]
    for unit, plain in (("N·m", "N m"), ("kg·m²", "kg m^2"), ("N m", "N m"), ("N*m", "N*m"), ("m/s²", "m/s^2")):
        system.units = {length: unit}
        assert system.check().units[length] == plain
    system.units = {length: "m"}
    assert system.embedding().check_units()
    with pytest.raises(ModelError, match="units: that of l is 3; pass text such as 'N m'"):
        system.units = {length: 3}
        system.check()
