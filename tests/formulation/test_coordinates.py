"""Coordinates that are not a joint's own: absolute angles, gears, mimics, given motions."""

import numpy as np
import pytest
import sympy as sp

import symdyn as sd

q1, q2, phi = sd.coordinates("q1 q2 phi")
g = 9.81


def double(second) -> sd.System:
    system = sd.System("double", gravity=[0, -g])
    first = system.add_body("first", mass=1.2, inertia=0.1, com=[0.5, 0])
    last = system.add_body("last", mass=0.7, inertia=0.2, com=[0.4, 0])
    system.add_joint(sd.Revolute("a", system.ground, first, q1))
    system.add_joint(sd.Revolute("b", first, last, second, parent_point=[1, 0]))
    return system


def test_absolute_angle():
    absolute = double(phi - q1)
    absolute.add_coordinate(phi)
    eq = absolute.embedding()
    assert eq.symbols.coordinates == (q1, phi)
    assert eq.verify().passed
    relative = double(q2).embedding().compile(backend="numpy")
    x = np.array([0.3, 0.8, 0.5, -0.4])
    found = eq.compile(backend="numpy").rhs(0.0, x)
    wanted = relative.rhs(0.0, [x[0], x[1] - x[0], x[2], x[3] - x[2]])
    assert np.allclose(found[2:], [wanted[2], wanted[2] + wanted[3]], rtol=1e-13)


def test_absolute_angles_decouple_the_centrifugal_terms():
    absolute = double(phi - q1)
    absolute.add_coordinate(phi)
    k = absolute.embedding().k_tilde
    assert not k[0].has(q1.dot) and not k[1].has(phi.dot)


def test_gear_has_one_speed():
    eq = double(2 * q1).embedding()
    assert len(eq.symbols.speeds) == 1 and eq.verify().passed


def test_mimic_one_to_one():
    eq = double(sp.UnevaluatedExpr(q1)).embedding()
    assert len(eq.symbols.speeds) == 1 and eq.verify().passed


def test_given_motion_does_work():
    module = double(0.3 * sp.sin(3 * sd.t)).embedding().compile()
    solution = module.simulate(t=(0, 5), q=[0.2], rtol=1e-11, work=True)
    assert np.abs(solution.work).max() > 0.1
    assert solution.energy_error() < 1e-9


@pytest.mark.parametrize(("change", "message"), [
    (lambda s: s.add_coordinate(q1), "q1 was given to add_coordinate, but joint 'a' has it for its own"),
    (lambda s: s.add_coordinate(3), "add_coordinate was given 3"),
])
def test_faults(change, message):
    system = double(q2)
    change(system)
    with pytest.raises(sd.ModelError, match=message):
        system.embedding()


def test_unused_coordinate():
    system = double(q2)
    system.add_coordinate(phi)
    with pytest.raises(sd.ModelError, match="no joint with mass or inertia moves with phi_dot"):
        system.embedding()


def test_spring_between_coinciding_points():
    system = double(q2)
    system.add_spring_damper("first", "last", [1, 0], [0, 0], stiffness=1.0, length=0.1, name="clip")
    with pytest.raises(sd.ModelError, match="clip: its two ends are the same point at every position"):
        system.embedding().tape("rhs")


@pytest.mark.parametrize(("expression", "message"), [
    (sp.gamma(q1), "load drive: gamma.q1. .* has no counterpart in generated code"),
    (sp.Piecewise((1, q1 > 0)), "load drive: .* not defined everywhere"),
])
def test_unsupported_expressions_are_reported_with_their_place(expression, message):
    system = double(q2)
    system.add_joint_force("a", expression, name="drive")
    with pytest.raises(sd.UnsupportedExpression, match=message):
        system.embedding().tape("rhs")


def test_unsupported_output_reports_where():
    system = double(q2)
    system.add_output("odd", sp.gamma(q1))
    with pytest.raises(sd.UnsupportedExpression, match="output odd: gamma"):
        system.embedding().tape("output_odd")
