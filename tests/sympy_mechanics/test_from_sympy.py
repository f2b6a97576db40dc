"""Equations of SymPy's mechanics taken over, against SymPy's own matrices in numbers, and against closed forms."""

from __future__ import annotations

import functools
import pickle
import warnings
from typing import Any

import numpy as np
import pytest
import sympy as sp
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)

import symdyn as sd
from symdyn.lab.sympy_models import EXAMPLES, Example
from symdyn.lab.sympy_models.chains import conical_pendulum, pendulum_on_cart
from symdyn.lab.sympy_models.measure import differentiated, lambdified, random_states, taken
from tests.helpers import swept

BY_NAME = {example.name: example for example in EXAMPLES}
QUICK = [example for example in EXAMPLES if not example.slow and example.name != "pendulum_on_cart(10)"]


@functools.cache
def formed(name: str) -> Any:
    """SymPy's equations of an example, formed once."""
    return BY_NAME[name].make()


@pytest.mark.parametrize("example", swept(QUICK, *(e for e in QUICK if e.name != "astrobee")), ids=lambda e: e.name)
def test_right_hand_sides_are_those_of_sympys_matrices(example: Example) -> None:
    derived = formed(example.name)
    equations = taken(example, derived)
    module, compared = equations.compile(), lambdified(derived, equations)
    for x, inputs in random_states(example, equations, 20):
        expected = compared(x, inputs)
        assert np.abs(module.rhs(0.0, x, inputs=inputs)[:len(expected)] - expected).max() <= 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("example", swept(
    [e for e in QUICK if e.name not in ("rattleback", "astrobee")],
    *(e for e in QUICK if e.name not in ("rattleback", "astrobee", "snakeboard", "pendulum_on_cart(5)"))), ids=lambda e: e.name)
def test_derivatives_are_those_of_sympys_matrices(example: Example) -> None:
    derived = formed(example.name)
    equations = taken(example, derived)
    module, compared = equations.compile("numpy"), differentiated(derived, equations)
    for x, inputs in random_states(example, equations, 5):
        expected = compared(x, inputs)
        found = module.jacobian(0.0, x, inputs=inputs).x[:len(expected)]
        assert found.shape[1] == expected.shape[1]
        assert np.abs(found - expected).max() <= 1e-12 * np.abs(expected).max()


def linear(example: Example) -> tuple[np.ndarray, np.ndarray]:
    """A of SymPy's linearization and the Jacobian of the right-hand side, at the example's state, which is steady."""
    derived = example.make()
    equations = taken(example, derived)
    symbols, kane, t = equations.symbols, derived.equations, dynamicsymbols._t
    x = np.array([example.linear.get(s.name, 0.0) for s in (*symbols.coordinates, *symbols.speeds)])
    numbers = {s: example.numbers[s.name] for s in symbols.parameters}
    point = {f: example.linear.get(f.func.__name__, 0.0) for f in (*kane.q, *kane.u)}
    rates = {rate: value.subs(point).subs(numbers) for rate, value in kane.kindiffdict().items()}
    A, _, _ = kane.linearize(A_and_B=True, op_point=[dict.fromkeys(kane.u.diff(t), 0), rates, point, numbers])
    return np.array(A, dtype=float), equations.compile().jacobian(0.0, x).x


@pytest.mark.parametrize("name", ["pendulum_on_cart(2)", "chaos_pendulum", "rolling_disc"])
def test_linear_equations_are_sympys(name: str) -> None:
    expected, found = linear(BY_NAME[name])
    assert np.abs(found - expected).max() <= 1e-11 * np.abs(expected).max()


def test_linear_equations_of_dependent_coordinates_have_sympys_eigenvalues() -> None:
    derived = BY_NAME["four_bar"].make()
    equations, kane, t = taken(BY_NAME["four_bar"], derived), derived.equations, dynamicsymbols._t
    module = equations.compile()
    rest = module.equilibrium(start={"q1": 0.5, "q2": 0.3, "q3": -1.5})
    point = dict(zip(kane.q, rest.q, strict=True)) | dict.fromkeys([*kane.u, *kane.q.diff(t), *kane.u.diff(t)], 0)
    numbers = {p: BY_NAME["four_bar"].numbers[p.name] for p in equations.symbols.parameters}
    A, _, _ = kane.linearize(A_and_B=True, op_point=[point, {dynamicsymbols("T"): 0}, numbers])
    expected = np.sort_complex(np.linalg.eigvals(np.array(A, dtype=float)))
    assert np.sort_complex(np.linalg.eigvals(module.linearize(rest).A)) == pytest.approx(expected, rel=1e-10)


def test_linear_equations_of_lagranges_method_are_sympys() -> None:
    example = BY_NAME["mass_spring_damper"]
    derived = example.make()
    equations, method, t = taken(example, derived), derived.equations, dynamicsymbols._t
    rates = method.q.diff(t)
    A, _, _ = method.linearize(q_ind=list(method.q), qd_ind=list(rates), A_and_B=True)
    numbers = {p: example.numbers[p.name] for p in equations.symbols.parameters}
    found = equations.compile().jacobian(0.0, [0.3, 0.0]).x
    assert found == pytest.approx(np.array(A.subs(numbers), dtype=float), rel=1e-14)


def test_a_rattleback_rests_upright_where_sympys_own_equations_are_undefined() -> None:
    """SymPy's elimination of the derivatives of the angles divides by sin(roll); the determinant is -cos(roll)."""
    derived = formed("rattleback")
    equations = taken(BY_NAME["rattleback"], derived)
    assert equations.compile().rhs(0.0, np.zeros(8)) == pytest.approx(np.zeros(8), abs=1e-15)
    at = dict.fromkeys([*derived.equations.q, *derived.equations.u], 0)
    assert derived.equations.forcing.xreplace(at).has(sp.nan, sp.zoo)


@pytest.mark.parametrize("spin", [2.0, 4.0])
def test_an_upright_rolling_disc_has_the_roots_of_its_closed_form(spin: float) -> None:
    """lambda^2 = 4 g / (5 r) - 12 spin^2 / 5 of a thin disc; the bicycle's published eigenvalues are in `symdyn bench sympy`."""
    example = BY_NAME["rolling_disc"]
    linear = taken(example, example.make()).compile().linearize({"q2": 0.0, "u2": spin})
    roots = np.linalg.eigvals(linear.A)
    expected = 0.8 * example.numbers["g"] / example.numbers["r"] - 2.4 * spin**2
    assert np.sort(np.abs(roots))[-2:]**2 == pytest.approx([abs(expected)] * 2, rel=1e-10)
    assert (roots.real.max() > 1e-3) == (expected > 0)


def test_dependent_coordinates_stay_on_their_constraints() -> None:
    equations = taken(BY_NAME["four_bar"], formed("four_bar"))
    module = equations.compile()
    q, u = module.consistent(u={"u1": 1.0}, keep=["u1"])
    sol = module.simulate((0, 3), q=q, u=u)
    assert sol.constraint_violation.max() < 1e-12
    assert equations.verify(states=2).passed


def constrained() -> LagrangesMethod:
    """A bob in Cartesian coordinates on a rod, with a damper."""
    x, y = dynamicsymbols("x y")
    m, g, l, c = sp.symbols("m g l c")
    N, P = ReferenceFrame("N"), Point("P")
    P.set_vel(N, x.diff() * N.x + y.diff() * N.y)
    method = LagrangesMethod(m * (x.diff()**2 + y.diff()**2) / 2 - m * g * y, [x, y], [(P, -c * x.diff() * N.x)], frame=N,
                             hol_coneqs=[x**2 + y**2 - l**2])
    method.form_lagranges_equations()
    return method


def test_lagranges_multipliers_are_sympys_and_energy_is_kept_with_the_work() -> None:
    method = constrained()
    equations = sd.from_sympy(method, "bob", defaults={"m": 2, "g": 9.81, "l": 1, "c": 0.3}, initial={"x": 1})
    module = equations.compile()
    x = np.array([0.6, -0.8, 1.6, 1.2])
    state = dict(zip([*method.q, *method.q.diff()], x, strict=True))
    state |= dict(zip(sp.symbols("m g l c"), (2, 9.81, 1, 0.3), strict=True))
    matrix, right = (np.array(e.xreplace(state), dtype=float) for e in (method.mass_matrix_full, method.forcing_full))
    expected = np.linalg.solve(matrix, right).ravel()[:4]
    found = module.rhs(0.0, x)
    assert found == pytest.approx(expected, rel=1e-13)
    state |= dict(zip([*method.q.diff().diff(), *method.lam_vec], [*found[2:], *module.evaluate("lam", 0.0, x)], strict=True))
    assert np.array(method.eom.xreplace(state), dtype=float).ravel() == pytest.approx(0.0, abs=1e-13)
    assert equations.verify(states=2).passed
    sol = module.simulate((0, 3), rtol=1e-10)
    assert sol.constraint_violation.max() < 1e-12 and np.diff(sol.energy).max() < 1e-7


def test_auxiliary_speeds_give_the_forces_that_they_bring_in() -> None:
    q, u, along, tension = dynamicsymbols("q u along T")
    m, l, g = sp.symbols("m l g")
    N = ReferenceFrame("N")
    A = N.orientnew("A", "Axis", [q, N.z])
    A.set_ang_vel(N, u * N.z)
    origin = Point("O")
    origin.set_vel(N, 0)
    P = origin.locatenew("P", l * A.x)
    P.set_vel(N, l * u * A.y + along * A.x)
    kane = KanesMethod(N, [q], [u], [q.diff() - u], u_auxiliary=[along])
    kane.kanes_equations([Particle("bob", P, m)], [(P, m * g * N.x - tension * A.x)])
    equations = sd.from_sympy(kane, "pendulum", outputs={"speed": P.vel(N).to_matrix(A)})
    own = {s.name: s for s in (*equations.symbols.coordinates, *equations.symbols.speeds)}
    assert sd.prove(equations.explicit("output_T"), m * (g * sp.cos(own["q"]) + l * own["u"]**2)).proved
    assert equations.explicit("output_speed") == sp.Matrix([0, l * own["u"], 0])  # no motion along an auxiliary speed
    assert equations.symbols.inputs == ()


def test_specified_functions_become_inputs_and_with_derivatives_motions() -> None:
    q, u, z, F = dynamicsymbols("q u z F")
    m, k = sp.symbols("m k")
    equations = sd.from_sympy(([q], [u], sp.Matrix([[m]]), [F - m * z.diff(dynamicsymbols._t, 2) - k * q]), "carried",
                              defaults={m: 1.0, k: 4.0}, initial={q: 0.1, F: 0.5}, units={q: "m"}, outputs={"force": -k * q})
    assert equations.symbols.inputs == (sd.inputs("F"), sd.motions("z"), sd.motions("z").dot, sd.motions("z").ddot)
    sol = equations.compile().simulate((0, 1), inputs={"z": lambda t: (t**2 / 2, t, 1.0), "F": 0.5})
    assert sol.q[:, 0] == pytest.approx(-0.125 + 0.225 * np.cos(2 * sol.t), abs=1e-7)
    assert sol.outputs["force"] == pytest.approx(-4 * sol.q[:, 0])


def test_kinematic_equations_of_any_invertible_form() -> None:
    q1, q2, u1, u2 = dynamicsymbols("q1 q2 u1 u2")
    a = sp.Symbol("a")
    kinematics = [q1.diff() + a * q2.diff() * sp.cos(q1) - u1 - sp.sin(dynamicsymbols._t), q2.diff() - q1.diff() - 2 * u2]
    equations = sd.from_sympy(([q1, q2], [u1, u2], sp.eye(2), [-q1, -q2]), "coupled", defaults={a: 0.5}, kinematics=kinematics)
    rhs = equations.compile().rhs(0.3, [0.4, 0.7, 0.2, -0.1])
    rates = np.linalg.solve([[1, 0.5 * np.cos(0.4)], [-1, 1]], [0.2 + np.sin(0.3), -0.2])
    assert rhs == pytest.approx([*rates, -0.4, -0.7], rel=1e-14)


def test_equations_that_are_taken_over_pickle_print_and_prove() -> None:
    equations = sd.from_sympy(pendulum_on_cart(1).equations, "cart", defaults={"m0": 1, "m1": 1, "l0": 1, "g": 9.81})
    copy = pickle.loads(pickle.dumps(equations))
    assert copy.M_tilde == equations.M_tilde
    assert str(equations.k_tilde[0]) == "-l0*m1*u1**2*cos(q1)" and str(equations.F_tilde[0]) == "F"
    assert equations.prove().proved
    assert "kane equations of motion" in str(equations.compile().report())


def test_the_kinetic_energy_is_known_where_nothing_moves_without_the_speeds() -> None:
    kane = pendulum_on_cart(1).equations
    N = kane._inertial
    equations = sd.from_sympy(kane)
    own = dict(zip([*kane.q, *kane.u], [*equations.symbols.coordinates, *equations.symbols.speeds], strict=True))
    assert sd.prove(equations.T, sum(b.kinetic_energy(N) for b in kane.bodies).xreplace(own)).proved
    q, u, x = dynamicsymbols("q u x")
    P = Point("P")
    P.set_vel(N, (u + x.diff()) * N.x)
    carried = KanesMethod(N, [q], [u], [q.diff() - u])
    carried.kanes_equations([Particle("bob", P, 1)], [(P, -q * N.x)])
    assert "kinetic_energy" not in sd.from_sympy(carried).quantities


def test_a_frame_whose_angular_velocity_contradicts_its_orientation_is_reported() -> None:
    with pytest.warns(sd.ModelWarning, match=r"contradict the orientations of the frames B1 \(.*\), B2"):
        sd.from_sympy(conical_pendulum(2, published=True).equations)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sd.from_sympy(conical_pendulum(2).equations)


def refused(*given: object, **more: object) -> str:
    with pytest.raises(sd.SymdynError) as caught:
        sd.from_sympy(*given, **more)
    return str(caught.value)


def test_equations_that_are_not_formed_yet() -> None:
    q, u, m = *dynamicsymbols("q u"), sp.Symbol("m")
    N = ReferenceFrame("N")
    assert "call kanes_equations(bodies, loads) first" in refused(KanesMethod(N, [q], [u], [q.diff() - u]))
    assert "call form_lagranges_equations() first" in refused(LagrangesMethod(m * q.diff()**2, [q]))


def test_other_objects_are_named() -> None:
    assert "of type Symbol; pass a KanesMethod" in refused(sp.Symbol("x"))
    from sympy.physics.mechanics import System as SympySystem

    assert "sd.from_system" in refused(SympySystem())
    assert "leave them out" in refused(constrained(), kinematics=[])


def test_all_faults_of_plain_equations_in_one_message() -> None:
    q, u = dynamicsymbols("q u")
    f = sp.Function("f")
    x = sp.Symbol("x")
    told = refused(([q], [u], sp.eye(2), [f(q) + u.diff()]), "bad name", defaults={"zz": 1}, outputs={"not one": q})
    for part in ("name is 'bad name'", "shape 2 x 2, there are 1 speeds", "f(q(t)), a function without a value",
                 "uses Derivative(u(t), t)", "'zz', which is no parameter", "an output is named 'not one'"):
        assert part in told
    assert "coordinate x is no function of time" in refused(([x], [u], sp.eye(1), [0]))
    assert "and no kinematic equations" in refused(([q, x.diff()], [u], sp.eye(1), [0]))
    assert "not symmetric" in refused((dynamicsymbols("q1 q2"), dynamicsymbols("u1 u2"), sp.Matrix([[1, x], [0, 1]]), [0, 0]))
    assert "singular at every state" in refused((dynamicsymbols("q1 q2"), dynamicsymbols("u1 u2"), sp.ones(2), [0, 0]))
    assert "are not linear" in refused(([q], [u], sp.eye(1), [0]), kinematics=[q.diff()**2 - u])
    assert "do not determine the derivatives" in refused(([q], [u], sp.eye(1), [0]), kinematics=[u - q])
    assert "2 different symbols are named 'q'" in refused(([q], [u], sp.eye(1), [sp.Symbol("q")]))
    assert "use an input of its own" in refused(([q], [u], sp.eye(1), [dynamicsymbols("w", 3)]))
    assert "the forcing has 2 entries" in refused(([q], [u], sp.eye(1), [0, 0]))
    assert "duration is 0 s" in refused(([q], [u], sp.eye(1), [0]), duration=0)
    assert "units has 3 for q(t)" in refused(([q], [u], sp.eye(1), [0]), units={q: 3})
    assert "1 kinematic equations and 2" in refused((dynamicsymbols("q1 q2"), [u], sp.eye(1), [0]), kinematics=[u])
    assert "has no counterpart" in refused(([q], [u], sp.eye(1), [sp.gamma(q)]))
    assert "the forcing holds 'text'" in refused(([q], [u], sp.eye(1), ["text"]))


def test_text_is_never_evaluated_and_other_values_are_named() -> None:
    q, u = dynamicsymbols("q u")
    plain = [q], [u], sp.eye(1), [0]
    assert "kinematics[1] is '1/0'; pass a number" in refused(plain, kinematics=["1/0"])
    assert "the output tip is '1/0'; pass a number" in refused(plain, outputs={"tip": "1/0"})
    assert "the rate of z(t) is 'x'; pass a number" in refused(plain, states={dynamicsymbols("z"): "x"})
    assert "an entry of the mass matrix is 'a'; pass a number" in refused(([q], [u], [["a"]], [0]))
    assert "kinematics is 3; pass a list" in refused(plain, kinematics=3)
    assert "units is 3; pass a mapping" in refused(plain, units=3)
    assert "states is 3; pass a mapping" in refused(plain, states=3)
    assert "outputs is 3; pass a mapping" in refused(plain, outputs=3)
    assert "there are no coordinates" in refused(([], [], sp.zeros(0, 0), []))
    assert "coordinate q(t) is given 2 times" in refused(([q, q], [u, u], sp.eye(2), [0, 0]))


def test_configuration_constraints_that_the_speeds_do_not_follow() -> None:
    q1, q2, u1, u2 = dynamicsymbols("q1 q2 u1 u2")
    N, P = ReferenceFrame("N"), Point("P")
    P.set_vel(N, u1 * N.x + u2 * N.y)
    kinematics = [q1.diff() - u1, q2.diff() - u2]
    bob = Particle("bob", P, 1)
    alone = KanesMethod(N, [q1], [u1, u2], kinematics, q_dependent=[q2], configuration_constraints=[q1**2 + q2**2 - 1])
    alone.kanes_equations([bob], [(P, -N.y)])
    assert "no velocity constraints" in refused(alone)
    other = KanesMethod(N, [q1], [u1], kinematics, q_dependent=[q2], configuration_constraints=[q1**2 + q2**2 - 1],
                        u_dependent=[u2], velocity_constraints=[u2 - 2 * u1 + u2 * q1])
    other.kanes_equations([bob], [(P, -N.y)])
    told = refused(other, initial={"q1": 0.6, "q2": 0.8})
    assert "do not imply the rates of the constraints of positions (configuration_1)" in told


def test_acceleration_constraints_that_are_no_derivatives() -> None:
    q1, q2, u1, u2 = dynamicsymbols("q1 q2 u1 u2")
    N, P = ReferenceFrame("N"), Point("P")
    P.set_vel(N, u1 * N.x + u2 * N.y)

    def method(acceleration: sp.Expr) -> KanesMethod:
        kane = KanesMethod(N, [q1, q2], [u1], [q1.diff() - u1, q2.diff() - u2], u_dependent=[u2],
                           velocity_constraints=[u2 - q1 * u1], acceleration_constraints=[acceleration])
        kane.kanes_equations([Particle("bob", P, 1)], [(P, -N.y)])
        return kane

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sd.from_sympy(method(u2.diff() - q1 * u1.diff() - u1**2))
    with pytest.warns(sd.ModelWarning, match="acceleration constraints of velocity_1 are not the derivatives"):
        sd.from_sympy(method(u2.diff() - q1 * u1.diff()))


def test_nonholonomic_constraints_of_lagrange_are_linear_in_the_rates() -> None:
    x, y = dynamicsymbols("x y")
    method = LagrangesMethod((x.diff()**2 + y.diff()**2) / 2, [x, y], nonhol_coneqs=[y.diff() - x * x.diff()])
    method.form_lagranges_equations()
    equations = sd.from_sympy(method)
    assert equations.holonomic == (False,)
    assert equations.compile().rhs(0.0, [0.5, 0.0, 1.0, 0.5]) == pytest.approx([1.0, 0.5, -0.4, 0.8], rel=1e-14)
    bad = LagrangesMethod((x.diff()**2 + y.diff()**2) / 2, [x, y], nonhol_coneqs=[y.diff()**2 - x.diff()])
    bad.form_lagranges_equations()
    assert "is not linear in the derivatives" in refused(bad)


def test_a_body_without_an_orientation_is_taken_as_it_is() -> None:
    q, u, I = *dynamicsymbols("q u"), sp.Symbol("I")
    N, B = ReferenceFrame("N"), ReferenceFrame("B")
    B.set_ang_vel(N, u * B.z)
    P = Point("P")
    P.set_vel(N, 0)
    kane = KanesMethod(N, [q], [u], [q.diff() - u])
    kane.kanes_equations([RigidBody("wheel", P, B, 1, (inertia(B, 0, 0, I), P))], [(B, -q * B.z)])
    assert sd.from_sympy(kane).M_tilde == sp.Matrix([[I]])
