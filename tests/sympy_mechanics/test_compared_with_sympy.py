"""Equations proved the same as SymPy's, refuted where they differ, and given back in SymPy's terms."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

import symdyn as sd
from symdyn.lab.sympy_models.chains import pendulum_on_cart
from symdyn.lab.sympy_models.others import four_bar


def cart() -> sd.System:
    """The pendulum on a cart of symdyn.lab.sympy_models, in absolute angles."""
    q = sd.coordinates("q0:3")
    m, l, g = sd.parameters("m0:3"), sd.parameters("l0:2"), sd.parameters("g")
    system = sd.System("cart", gravity=[0, -g])
    bodies = [system.add_body(f"body{k}", mass=m[k], com=[l[k - 1] if k else 0, 0]) for k in range(3)]
    system.add_joint(sd.Prismatic("rail", system.ground, bodies[0], q[0], axis=[1, 0]))
    system.add_joint(sd.Revolute("first", bodies[0], bodies[1], q[1]))
    system.add_joint(sd.Revolute("second", bodies[1], bodies[2], q[2] - q[1], parent_point=[l[0], 0]))
    system.add_coordinate(q[2])
    system.add_joint_force("rail", sd.inputs("F"))
    return system


def test_equations_are_proved_the_same_whatever_their_speeds() -> None:
    kane, system = pendulum_on_cart(2).equations, cart()
    assert sd.compare(system.embedding(), kane).proved
    q = system.check().coordinates
    system.set_speeds(dict(zip(sd.speeds("w1:4"), (q[0].dot, q[1].dot - q[2].dot, sp.cos(q[1]) * q[2].dot), strict=True)))
    found = sd.compare(system.embedding(), kane)
    assert found.proved and "mass matrix in SymPy's speeds is the same" in str(found)
    assert sd.compare(sd.from_sympy(kane), kane).proved
    assert sd.compare(sd.from_sympy(kane), sd.from_sympy(kane)).proved


def test_a_damper_that_sympy_does_not_have_is_found() -> None:
    system = cart()
    system.add_joint_force("first", -system.check().coordinates[1].dot / 10)
    found = sd.compare(system.embedding(), pendulum_on_cart(2).equations)
    assert found.refuted and "the sides differ by -u1/10" in str(found)


def test_constraints_are_compared_along_the_independent_speeds() -> None:
    kane = four_bar().equations
    own = sd.from_sympy(kane)
    found = sd.compare(own, kane)
    assert found.proved and [claim.name for claim in found.claims][-1] == "constraints leave SymPy's independent speeds"


def test_lagranges_constraints_are_compared_as_they_are() -> None:
    x, y = dynamicsymbols("x y")
    m, l, g = sp.symbols("m l g")
    method = LagrangesMethod(m * (x.diff()**2 + y.diff()**2) / 2 - m * g * y, [x, y], hol_coneqs=[x**2 + y**2 - l**2])
    method.form_lagranges_equations()
    a, b = sd.coordinates("x y")
    assert sd.compare(sd.augmented([a, b], [m, m], [0, -m * g], [a**2 + b**2 - l**2]), method).proved
    assert sd.compare(sd.augmented([a, b], [m, m], [0, -m * g], [a**2 + b**2 - 2 * l**2]), method).refuted


def test_what_cannot_be_compared_is_named() -> None:
    kane = pendulum_on_cart(2).equations
    with pytest.raises(sd.ArgumentError, match="has the coordinates q1, SymPy's equations q0, q1, q2"):
        sd.compare(sd.systems.pendulum().embedding(), kane)
    with pytest.raises(sd.ArgumentError, match="the first is 3; pass what"):
        sd.compare(3, kane)
    with pytest.raises(sd.ArgumentError, match="the second is None; pass what"):
        sd.compare(cart().embedding())


@pytest.mark.parametrize("simplify", [True, False])
def test_the_way_back(simplify: bool) -> None:
    equations = cart().embedding()
    given = equations.to_sympy(simplify)
    t = dynamicsymbols._t
    assert given.u == given.q.diff(t) and given.kindiffdict() == {}
    again = sd.from_sympy((given.q, given.u, given.mass_matrix, given.forcing), "again")
    assert sd.compare(equations, (given.q, given.u, given.mass_matrix, given.forcing)).proved
    assert again.symbols.inputs == (sd.inputs("F"),)


def test_named_speeds_come_with_their_kinematic_equations() -> None:
    kane = pendulum_on_cart(1).equations
    given = sd.from_sympy(kane).to_sympy()
    q, u = dynamicsymbols("q0:2"), dynamicsymbols("u0:2")
    assert list(given.q) == list(q) and list(given.u) == list(u)
    assert given.kindiffdict() == {a.diff(): b for a, b in zip(q, u, strict=True)}
    assert given.mass_matrix_full.shape == (4, 4)
    assert sp.simplify(given.mass_matrix - kane.mass_matrix) == sp.zeros(2)
    assert sp.simplify(given.forcing - kane.forcing) == sp.zeros(2, 1)


def test_constraints_and_motions_in_sympys_terms() -> None:
    x, y, w = sd.coordinates("x y w")
    z, m = sd.motions("z"), sd.parameters("m")
    equations = sd.augmented([x, y, w], [m, m, m], [m * z.ddot, 0, -1], [x**2 + y**2 - 1, w.dot - x * x.dot])
    given = equations.to_sympy()
    t = dynamicsymbols._t
    fx, fy, fw, fz = (sp.Function(name)(t) for name in "xywz")
    assert list(given.constraints) == [fx**2 + fy**2 - 1, fw.diff(t) - fx * fx.diff(t)]
    assert given.forcing[0] == sp.Symbol("m") * fz.diff(t, 2) and len(given.lam) == 2
    still = dict.fromkeys([fx.diff(t), fy.diff(t), fw.diff(t)], 0.0)
    state = {fx: 0.6, fy: 0.8, sp.Symbol("m"): 1.5}
    matrix, right = (np.array(e.subs(fz.diff(t, 2), 2.0).subs(still).subs(state), dtype=float)
                     for e in (given.mass_matrix_full, given.forcing_full))
    found = equations.compile(backend="numpy").rhs(0.0, [0.6, 0.8, 0.0, 0.0, 0.0, 0.0], [1.5], [0.0, 0.0, 2.0])
    assert np.linalg.solve(matrix, right).ravel()[:6] == pytest.approx(found, abs=1e-13)


def test_recursions_without_a_mass_matrix_say_what_to_derive() -> None:
    from dataclasses import replace

    equations = sd.systems.pendulum().embedding()
    lean = replace(equations, quantities={name: record for name, record in equations.quantities.items() if name != "M_tilde"})
    with pytest.raises(sd.SymdynError, match="has no mass matrix that could be written out"):
        lean.to_sympy()
    with pytest.raises(sd.ArgumentError, match="has no mass matrix to compare"):
        sd.compare(lean, (dynamicsymbols("q1,"), dynamicsymbols("u1,"), sp.eye(1), [0]))
