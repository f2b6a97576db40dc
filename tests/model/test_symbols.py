"""Symbols: dots, how they print, how they are pickled, and dynamicsymbols in their place."""

from __future__ import annotations

import pickle
import re
from typing import Any

import pytest
import sympy as sp
from sympy.physics import mechanics
from sympy.physics.mechanics import dynamicsymbols, mlatex
from sympy.physics.vector.printing import vlatex

import symdyn as sd
from symdyn.model.symbols import Acceleration, Coordinate, Input, Rate, Speed, as_coordinate, as_expression, flat, take_over
from tests import helpers

q1, q2, theta = sd.coordinates("q1 q2 theta")
c = sd.parameters("c")
t = sd.t


# -- kinds


def test_kinds_and_names() -> None:
    u = sd.speeds("u1")
    tau = sd.inputs("tau")
    kinds = [Coordinate, Rate, Acceleration, Speed, Rate, Input, sp.Symbol]
    assert [type(s) for s in (q1, q1.dot, q1.ddot, u, u.dot, tau, t)] == kinds
    assert [s.name for s in (q1.dot, q1.ddot, q1.dot.dot, u.dot, t)] == ["q1_dot", "q1_ddot", "q1_ddot", "u1_dot", "t"]
    assert q1.dot.dot == q1.ddot and q1.dot == sd.coordinates("q1").dot and q1.dot != theta.dot
    assert type(sd.parameters("m")) is sp.Symbol and sd.parameters("m") == sp.Symbol("m")


def test_entries_of_matrices_that_change_and_of_those_that_do_not() -> None:
    rows = [[q1, 2, c], [sp.Rational(1, 3), q1 + c, 0.5]]
    for made in (sp.Matrix, sp.ImmutableMatrix, sp.SparseMatrix, sp.ImmutableSparseMatrix):
        assert list(flat(made(rows))) == [sp.sympify(e) for row in rows for e in row]


def test_kinds_differ_though_names_agree() -> None:
    assert len({sd.coordinates("a"), sd.parameters("a"), sd.inputs("a"), sd.speeds("a"), sp.Symbol("a", real=True)}) == 5


@pytest.mark.parametrize(("names", "wanted"), [("q1 q2", ["q1", "q2"]), ("q1, q2", ["q1", "q2"]), ("q1:4", ["q1", "q2", "q3"]),
                                               ("x", "x"), ("x,", ["x"]), ("q3:4", ["q3"])])
@pytest.mark.parametrize("make", [sd.coordinates, sd.speeds, sd.parameters, sd.inputs])
def test_several_at_once(make: Any, names: str, wanted: Any) -> None:
    made = make(names)
    assert made.name == wanted if isinstance(wanted, str) else [s.name for s in made] == wanted


def test_assumptions_are_kept() -> None:
    q, u = sd.coordinates("q", real=True), sd.speeds("u", real=True)
    m, F = sd.parameters("m", positive=True), sd.inputs("F", real=True)
    assert all(s.is_real for s in (q, q.dot, q.ddot, m, F, u, u.dot)) and m.is_positive
    assert sp.sqrt(m**2) == m and sp.sqrt(q**2) == sp.Abs(q) and q1.is_real is None
    assert q.dot.dot == q.ddot and q != sd.coordinates("q") and as_coordinate(sp.Symbol("q", real=True)) == q


def test_the_derivative_of_a_positive_coordinate_may_be_negative() -> None:
    r = sd.coordinates("r", positive=True)
    assert r.is_positive and r.dot.is_real and r.dot.is_positive is None and r.ddot.is_positive is None
    assert sp.Abs(r) == r and sp.Abs(r.dot) != r.dot and sp.sign(r.dot) != 1 and r.dot.dot == r.ddot


def test_derivatives_by_symbols() -> None:
    expression = q1.dot**2 * sp.sin(q1)
    assert expression.diff(q1) == q1.dot**2 * sp.cos(q1) and expression.diff(q1.dot) == 2 * q1.dot * sp.sin(q1)


def test_sympys_derivatives_by_time_are_total_ones() -> None:
    tau, k = sd.inputs("tau"), sp.Symbol("k")
    assert q1.diff(t) == q1.diff() == sp.diff(q1, t) == sp.diff(q1) == q1.dot and q1.diff(t, 2) == q1.dot.diff(t) == q1.ddot
    assert sp.sin(q1).diff(t) == sp.cos(q1) * q1.dot and (k * q1 * t**2).diff(t) == 2 * k * q1 * t + k * q1.dot * t**2
    assert sp.Derivative(sp.sin(q1), t).doit() == sp.sin(q1).diff(t) and sp.Derivative(q1, t, evaluate=True) == q1.dot
    assert sp.Matrix([[q1, k], [t, q1.dot]]).diff(t) == sp.Matrix([[q1.dot, 0], [1, q1.ddot]])
    assert sd.speeds("w").diff(t) == sd.speeds("w").dot and q1.diff(q1) == 1 and q1.diff(q2) == q1.dot.diff(q1) == 0
    energy = k * q1.dot**2 * q1 / 2
    assert energy.diff(q1.dot).diff(t) - energy.diff(q1) == k * q1 * q1.ddot + k * q1.dot**2 / 2
    with pytest.raises(ValueError, match=r"variable\(s\) of differentiation must be supplied"):
        sp.sin(q1).diff()
    for unknown in (tau.diff(t), q1.ddot.diff(t), q1.diff(t, 3)):
        assert isinstance(unknown, sp.Derivative) and unknown != 0
        with pytest.raises(sd.ModelError, match=r"which has no value.*a coordinate and its \.dot"):
            as_expression(k * unknown, "the torque")


def test_partial_derivatives_by_time_hold_what_moves() -> None:
    tau, k = sd.inputs("tau"), sp.Symbol("k")
    expression = k * t**2 * sp.sin(q1 + t) + q1.dot * t + tau
    held = sp.Symbol("x")
    assert sd.partial_rate(expression) == (k * t**2 * sp.sin(held + t)).diff(t).subs(held, q1) + q1.dot
    assert sd.partial_rate(sp.Matrix([[q1, t * q1]])) == sp.Matrix([[0, q1]]) and sd.partial_rate(q1.ddot) == 0
    with pytest.raises(sd.ModelError, match="partial_rate was given 3 of type int; pass an expression or a matrix"):
        sd.partial_rate(3)


def test_a_damper_written_as_a_derivative_damps() -> None:
    taken = [as_expression(-c * rate, "damper") for rate in (q1.diff(t), q1.diff(), sp.Derivative(q1, t), q1.dot)]
    assert taken == [-c * q1.dot] * 4
    assert as_expression(sp.Derivative(sp.sin(q1), t), "value") == sp.cos(q1) * q1.dot
    f = mechanics.dynamicsymbols("q1")
    assert as_expression(sp.Derivative(f * sp.sin(f), t), "value") == (q1 * sp.sin(q1)).diff(t)


def test_sympys_frames_turn_with_the_rates_of_coordinates() -> None:
    n = mechanics.ReferenceFrame("n")
    a = n.orientnew("a", "Axis", [q1, n.z])
    b = a.orientnew("b", "Body", [q2, 0, 0], "XYZ")
    assert a.ang_vel_in(n) == q1.dot * n.z and b.ang_vel_in(n) == q1.dot * n.z + q2.dot * b.x
    assert (q1 * a.x).dt(n) == q1.dot * a.x + q1 * q1.dot * a.y


# -- printing


@pytest.mark.parametrize(("symbol", "latex"), [
    (q1, "q_{1}"), (q1.dot, r"\dot{q}_{1}"), (q1.ddot, r"\ddot{q}_{1}"),
    (theta.dot, r"\dot{\theta}"), (theta.ddot, r"\ddot{\theta}"),
    (sd.coordinates("phi_12").dot, r"\dot{\phi}_{12}"), (sd.coordinates("x").ddot, r"\ddot{x}"),
    (sd.speeds("omega_x_joint").dot, r"\dot{\omega}_{x joint}"),
    (sd.inputs("tau1"), r"\tau_{1}"), (2 * q1.dot**2, r"2 \dot{q}_{1}^{2}"),
    (sp.Matrix([q1.ddot]), r"\left[\begin{matrix}\ddot{q}_{1}\end{matrix}\right]")], ids=str)
def test_latex(symbol: Any, latex: str) -> None:
    assert sp.latex(symbol) == latex
    assert mlatex(symbol) == latex or vlatex(symbol) == latex


def test_text() -> None:
    assert str(q1.dot * sp.sin(q1.ddot)) == "q1_dot*sin(q1_ddot)"


# -- pickling


@pytest.mark.parametrize("protocol", range(2, pickle.HIGHEST_PROTOCOL + 1))
def test_pickled_and_back(protocol: int) -> None:
    everything = [q1, q1.dot, q1.ddot, sd.speeds("u"), sd.inputs("F", real=True), sd.coordinates("r", positive=True).dot,
                  sp.sin(q1) * q1.dot**2, t]
    back = pickle.loads(pickle.dumps(everything, protocol))
    assert back == everything and [type(s) for s in back] == [type(s) for s in everything]
    assert back[5].is_real and back[4].is_real and back[0].dot == q1.dot


def test_model_pickled_and_back() -> None:
    model = sd.systems.get("two_link_arm").check()
    back = pickle.loads(pickle.dumps(model))
    assert (back.coordinates, back.speeds, back.parameters, back.inputs, back.defaults) == (
        model.coordinates, model.speeds, model.parameters, model.inputs, model.defaults)
    assert [b.name for b in back.bodies] == [b.name for b in model.bodies]
    assert back.joints[1].coordinates == model.joints[1].coordinates


# -- dynamicsymbols


def test_dynamicsymbols_become_coordinates() -> None:
    q, p = dynamicsymbols("q p")
    assert as_coordinate(q) == sd.coordinates("q") and as_coordinate(sp.Symbol("q")) == sd.coordinates("q")
    taken = take_over(q.diff() * sp.sin(p) + q.diff(t, 2) + sp.Symbol("m"))
    coordinate = sd.coordinates("q")
    assert taken == coordinate.dot * sp.sin(sd.coordinates("p")) + coordinate.ddot + sp.Symbol("m")
    assert as_expression(dynamicsymbols("q", 1), "here") == coordinate.dot
    assert as_coordinate(t) == t and as_coordinate(3) == 3 and as_coordinate(q1.dot) == q1.dot


def _pendulum(q: Any, rate: Any, speed: Any = None) -> sd.System:
    m, l, g, d = sd.parameters("m l g d")
    s = sd.System("pendulum", gravity=[0, -g])
    bob = s.add_body("bob", mass=m, com=[0, -l])
    s.add_joint(sd.Revolute("pivot", s.ground, bob, q, speed=speed))
    s.add_torque(bob, -d * rate - sp.sin(2 * q) * t)
    s.add_output("height", -l * sp.cos(q))
    return s


def test_dynamicsymbols_in_joints_loads_and_outputs() -> None:
    q = dynamicsymbols("q")
    ours = sd.coordinates("q")
    values = {"q": 0.3, "q_dot": 0.7, "m": 1.1, "l": 0.9, "g": 9.81, "d": 0.2, "t": 0.5}
    found, wanted = (helpers.quantities(s.embedding(), values, "rhs", "output_height") for s in
                     (_pendulum(q, q.diff(t)), _pendulum(ours, ours.dot)))
    assert helpers.close(found[0], wanted[0]) and helpers.close(found[1], wanted[1])
    assert _pendulum(q, q.diff(t)).check().coordinates == (ours,)


def test_dynamicsymbols_as_speeds() -> None:
    q, u = dynamicsymbols("q u")
    model = _pendulum(q, u, speed=u).check()
    assert [s.name for s in model.speeds] == ["u"]
    assert model.units[model.speeds[0]] == "rad/s" and model.units[model.coordinates[0]] == "rad"


def test_plain_symbols_as_coordinates() -> None:
    q = sp.Symbol("q")
    s = sd.System("slide")
    s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("cart", mass=2), q))
    assert s.check().coordinates == (sd.coordinates("q"),)


def test_dynamicsymbols_and_coordinates_of_one_name_are_one() -> None:
    ours = sd.coordinates("q")
    theirs = dynamicsymbols("q")
    assert as_expression(theirs * ours.dot + theirs.diff(t), "value") == ours * ours.dot + ours.dot
    assert _pendulum(ours, theirs.diff(t)).embedding().F_tilde == _pendulum(ours, ours.dot).embedding().F_tilde
    real = sd.coordinates("q", real=True)
    assert as_coordinate(dynamicsymbols("q", real=True)) == real
    assert _pendulum(real, dynamicsymbols("q", real=True).diff(t)).check().coordinates == (real,)


@pytest.mark.parametrize(("made", "used"), [(sd.coordinates("q", real=True), dynamicsymbols("q")),
                                            (dynamicsymbols("q"), sd.coordinates("q", real=True))])
def test_symbols_of_one_name_with_other_assumptions_are_named(made: Any, used: Any) -> None:
    one, other = ("real=True", "out assumptions") if isinstance(made, Coordinate) else ("out assumptions", "real=True")
    with pytest.raises(sd.ModelError) as caught:
        _pendulum(made, used.diff(t)).check()
    assert re.search(f"torque_1 uses q_dot, the derivative of a coordinate or speed with ?{other}, but q_dot of the system is "
                     rf"the derivative of a coordinate or speed with ?{one}; use the same symbol in both .SymPy's q\(t\)",
                     str(caught.value))
    with pytest.raises(sd.ModelError, match=f"uses q, a coordinate with ?{other}, but q among the coordinates is a coordinate "
                                            f"with ?{one}; use the same symbol"):
        sd.embedding([made], [sp.cos(made) * sp.sin(used), sp.sin(made)], [1, 1])


def test_a_speed_and_a_dynamicsymbol_of_one_name_are_named() -> None:
    with pytest.raises(sd.ModelError, match="uses u, a coordinate without assumptions, but u of the system is a speed without"):
        _pendulum(q1, dynamicsymbols("u"), speed=sd.speeds("u")).check()
    with pytest.raises(sd.ModelError, match=r"2 different symbols are named .q1. .*, a coordinate without assumptions and a "
                                            "parameter without assumptions; make each symbol once, by "
                                            r"sd.coordinates\('q1'\) where it moves, or give them different names"):
        _pendulum(q1, sp.Symbol("q1")).check()


# -- order


def test_parameters_come_in_the_order_of_use_and_coordinates_in_that_of_joints() -> None:
    z, y, x, a, b = sp.symbols("z y x a b")
    q = sd.coordinates("q1:4")
    s = sd.System("order", gravity=[0, 0, -z])
    bodies = [s.add_body(n, mass=mass, inertia=[1, 1, 1]) for n, mass in zip("cab", (y, x, a * b), strict=True)]
    for name, parent, child, coordinate in (("third", bodies[1], bodies[2], q[0]), ("second", bodies[0], bodies[1], q[1]),
                                            ("first", s.ground, bodies[0], q[2])):
        s.add_joint(sd.Revolute(name, parent, child, coordinate))
    model = s.check()
    assert model.parameters == (z, y, x, a, b)
    assert model.coordinates == (q[0], q[1], q[2]) and [j.name for j in model.joints] == ["first", "second", "third"]
