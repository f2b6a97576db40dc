"""Speeds with names of their own stand in everything that is printed, in place of the derivatives of their coordinates."""

import pytest
import sympy as sp

import symdyn as sd

q1, q2 = sd.coordinates("q1 q2")
u1, u2 = sd.speeds("u1 u2")
m, l, g, c = sd.parameters("m l g c")
PRINTED = ("M_tilde", "bias", "inverse_dynamics", "accelerations", "rates", "N", "rhs", "jacobian_x", "balance", "k_tilde",
           "F_tilde", "J", "Jdot", "Jd_qd", "reactions", "energy", "power", "power_x", "output_speed", "base_regressor")


def damped(constraint: bool = False) -> sd.System:
    """A double pendulum of points whose joints have speeds with names; a damper in the second joint, written with q2.dot."""
    system = sd.System("damped", gravity=[0, -g, 0])
    first, second = (system.add_body(name, mass=m, com=[l, 0, 0]) for name in ("first", "second"))
    system.add_joint(sd.Revolute("j1", system.ground, first, coordinate=q1, speed=u1))
    system.add_joint(sd.Revolute("j2", first, second, coordinate=q2, speed=u2, parent_point=[l, 0, 0]))
    system.add_joint_force("j2", -c * q2.dot)
    system.add_output("speed", q1.dot + q2.dot)
    if constraint:
        system.add_constraint(q1 - q2)
    return system


def test_damping_is_the_derivative_of_the_forces_by_a_named_speed():
    eq = damped().embedding()
    assert eq.F_tilde.jacobian([u1, u2]) == sp.Matrix([[0, 0], [0, -c]])
    v = -m * l**2 * sp.sin(q2)
    wanted = sp.Matrix([v * (2 * u1 * u2 + u2**2), -v * u1**2])
    assert (eq.k_tilde - wanted).applyfunc(sp.expand) == sp.zeros(2, 1)
    assert eq.explicit("power") == -c * u2**2 and eq.explicit("output_speed") == u1 + u2
    assert eq.explicit("rates") == sp.Matrix([u1, u2])


@pytest.mark.parametrize("formulation", ["embedding", "recursive", "augmented"])
def test_no_derivative_of_a_coordinate_with_a_named_speed_is_printed(formulation):
    eq = getattr(damped(), formulation)()
    for name in PRINTED:
        value = sp.Matrix([eq.explicit(name, simplify=False)])
        assert not value.has(q1.dot, q2.dot, q1.ddot, q2.ddot), name
    assert not sp.Matrix([e.lhs - e.rhs for e in eq.equations]).has(q1.dot, q2.dot)
    text = eq.latex("k_tilde").latex + eq.latex("F_tilde", intermediates=True).latex
    assert "u_{1}" in text and r"\dot{q}" not in text


def test_constraints_print_named_speeds_too():
    eq = damped(constraint=True).augmented()
    for name in (*PRINTED, "C_dot", "F_d", "lam"):
        assert not sp.Matrix([eq.explicit(name, simplify=False)]).has(q1.dot, q2.dot), name
    assert eq.explicit("C_dot") == sp.Matrix([u1 - u2])


def test_contributions_of_bodies_print_named_speeds():
    explanation = damped().embedding().explain("k_tilde", 1)
    assert sp.expand(explanation.total) == m * l**2 * u1**2 * sp.sin(q2)


def test_base_parameters_print_named_speeds():
    regressor = damped().embedding().base_parameters().regressor
    assert regressor.has(u1) and regressor.has(u1.dot) and not regressor.has(q1.dot)


def test_derivatives_along_a_direction_print_the_names_of_their_arguments():
    value = damped().embedding().explicit("outputs_variation")
    assert sp.Matrix([sp.Symbol("(along u1)") + sp.Symbol("(along u2)")]) == value
