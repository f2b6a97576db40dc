"""Linear-quadratic regulators against published gains, SciPy's Riccati solver and closed forms; the gain at work."""

from __future__ import annotations

import functools
import sys
import types
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import sympy as sp

import symdyn as sd
from symdyn.statics.regulator import Regulator, _out_of_reach
from tests.helpers import swept


@functools.cache
def cart(damping: float = 0.1) -> Any:
    """The inverted pendulum on a cart of the Control Tutorials: M = 0.5, m = 0.2, b = 0.1, l = 0.3, I = 0.006, g = 9.8."""
    x, phi = sd.coordinates("x phi")
    F = sd.inputs("F")
    s = sd.System("cart", gravity=[0, -9.8, 0])
    body, pole = s.add_body("cart", mass=0.5), s.add_body("pole", mass=0.2, inertia=[0.006, 0.006, 0.006], com=[0, 0.3, 0])
    rail = s.add_joint(sd.Prismatic("rail", s.ground, body, x))
    s.add_joint(sd.Revolute("hinge", body, pole, phi))
    s.add_joint_force(rail, F)
    s.add_joint_force(rail, -damping * x.dot)
    return s.compile(backend="numpy")


def by_hand() -> tuple[np.ndarray, np.ndarray]:
    """A and B of [x, x_dot, phi, phi_dot] as the tutorial has them."""
    M, m, b, inertia, g, length = 0.5, 0.2, 0.1, 0.006, 9.8, 0.3
    p = inertia * (M + m) + M * m * length**2
    A = np.array([[0, 1, 0, 0], [0, -(inertia + m * length**2) * b / p, m**2 * g * length**2 / p, 0], [0, 0, 0, 1],
                  [0, -m * length * b / p, m * g * length * (M + m) / p, 0]])
    return A, np.array([[0], [(inertia + m * length**2) / p], [0], [m * length / p]])


ORDER = ("x", "x_dot", "phi", "phi_dot")


@pytest.mark.parametrize(("weights", "published"), [((1, 1), [-1.0000, -1.6567, 18.6854, 3.4594]),
                                                    ((5000, 100), [-70.7107, -37.8345, 105.5298, 20.9238])])
def test_the_published_gain_of_the_inverted_pendulum(weights: tuple[float, float], published: list[float]) -> None:
    """Source: Control Tutorials for MATLAB and Simulink, Inverted Pendulum: State-Space Methods for Controller Design."""
    found = cart().linearize().lqr({"x": weights[0], "phi": weights[1]}, {"F": 1})
    gain = np.array([found.K["F", n] for n in ORDER])
    assert np.allclose(gain, published, atol=5e-5)
    A, B = by_hand()
    S = scipy.linalg.solve_continuous_are(A, B, np.diag([weights[0], 0, weights[1], 0]), np.eye(1))
    assert np.allclose(gain, (B.T @ S)[0], rtol=1e-9)
    assert np.allclose(np.sort_complex(found.eigenvalues), np.sort_complex(np.linalg.eigvals(A - B @ B.T @ S)), rtol=1e-7)


def test_weights_in_order_by_symbol_and_as_a_matrix_are_the_same() -> None:
    linear = cart().linearize()
    Q = np.diag([3.0, 5.0, 0.0, 2.0])
    assert linear.states == ("x", "phi", "x_dot", "phi_dot")
    phi = sd.coordinates("phi")
    ways = ((Q, [[2.0]]), ([3, 5, 0, 2], [2]), ({"x": 3, phi: 5, phi.dot: 2}, {"F": 2.0}), (Q, 2))
    gains = [linear.lqr(q, r).K for q, r in ways]
    assert all(np.array_equal(gains[0], g) for g in gains)
    coupled = Q + np.array([[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0.0]])
    S = scipy.linalg.solve_continuous_are(linear.A, linear.B, coupled, 2 * np.eye(1))
    assert np.allclose(linear.lqr(coupled, 2).K, linear.B.T @ S / 2, rtol=1e-12)


def test_a_double_integrator_in_closed_form() -> None:
    """x_ddot = F / m with Q = (1, 0), R = r: K = (1/sqrt(r), sqrt(2 m / sqrt(r)))."""
    x, F = sd.coordinates("x"), sd.inputs("F")
    s = sd.System("mass")
    s.add_joint_force(s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("body", mass=3), x)), F)
    found = s.compile(backend="numpy").linearize().lqr([1, 0], [0.25])
    assert np.allclose(found.K, [[2.0, np.sqrt(2 * 3 * 2)]], rtol=1e-12) and (found.eigenvalues.real < 0).all()
    assert np.isclose(found.S[0, 0], 0.25 * np.sqrt(12) * 2, rtol=1e-12)  # the least cost from x = 1


def test_angles_and_angular_velocities_have_weights_of_their_own() -> None:
    """A body turned by a moment, C omega_dot = T: weight a on the angle and R = 1 give K = [sqrt(a), sqrt(2 C sqrt(a))]."""
    system = sd.System("satellite")
    body = system.add_body("body", mass=1, inertia=[3, 3, 2])
    joint = sd.Spherical("about_G", system.ground, body, orientation=sd.EulerAngles("ZYX", speeds="body"))
    system.add_joint(joint)
    system.add_torque(body, sd.inputs("T1:4"), frame=body)
    linear = system.compile("numpy").linearize()
    turned, omega = linear.states[:3], linear.states[3:]
    assert omega == ("omega_x_about_G", "omega_y_about_G", "omega_z_about_G") and turned == tuple(f"along_{n}" for n in omega)
    assert [linear.units[n] for n in linear.states] == ["rad"] * 3 + ["rad/s"] * 3
    gain = linear.lqr(dict.fromkeys(turned, 4), {"T1": 1, "T2": 1, "T3": 1})
    exact = np.hstack([2 * np.eye(3), np.diag(np.sqrt([12, 12, 8]))])
    np.testing.assert_allclose(gain.K, exact, atol=1e-12)


def test_a_regulator_prints_names_units_and_the_closed_loop() -> None:
    text = repr(cart().linearize().lqr([1, 1, 0, 0], [1]))
    assert "cart: linear-quadratic regulator" in text and "F [N]" in text
    assert "phi_dot [rad/s]" in text and "closed loop: " in text


# -- constraints and held coordinates


@functools.cache
def rod() -> Any:
    """The same cart in absolute coordinates of the pole, pinned to the cart by two constraints."""
    x, a, b, phi = sd.coordinates("x a b phi")
    F = sd.inputs("F")
    s = sd.System("rod", gravity=[0, -9.8], planar=True)
    body, pole = s.add_body("cart", mass=0.5, inertia=1), s.add_body("pole", mass=0.2, inertia=0.006)
    rail = s.add_joint(sd.Prismatic("rail", s.ground, body, x, axis=[1, 0]))
    s.add_joint(sd.Planar("pole", s.ground, pole, [a, b, phi]))
    s.add_joint_force(rail, F)
    s.add_joint_force(rail, -0.1 * x.dot)
    s.add_constraint(a + 0.3 * sp.sin(phi) - x, name="pin x")
    s.add_constraint(b - 0.3 * sp.cos(phi), name="pin y")
    s.initial = {b: 0.3}
    return s.augmented().compile(backend="numpy")


def test_dependent_coordinates_leave_the_independent_states() -> None:
    """Four coordinates, two freedoms; with x and phi as states the gain is that of the tree."""
    linear = rod().linearize(coordinates=["x", "phi"])
    found = linear.lqr({"x": 1, "phi": 1}, [1])
    assert found.K.shape == (1, 4)
    assert np.allclose([found.K["F", n] for n in ORDER], [-1.0, -1.6567, 18.6854, 3.4594], atol=5e-5)
    # The deviation of a state near the upright one, read from all of its coordinates.
    x = np.array([0.01, 0.01 - 0.3 * np.sin(0.02), 0.3 * np.cos(0.02), 0.02, 0.03, 0, 0, 0.04])
    assert np.allclose(linear.deviation(0.0, x), [0.01, 0.02, 0.03, 0.04], rtol=1e-12)


def test_held_coordinates_are_no_states() -> None:
    """With the pole held the cart is a damped mass: K by its own Riccati equation."""
    linear = cart().linearize(hold=["phi"])
    found = linear.lqr([4, 0], [1])
    assert linear.states == ("x", "x_dot")
    A, B = np.array([[0, 1], [0, -0.1 / 0.7]]), np.array([[0], [1 / 0.7]])
    assert np.allclose(found.K, B.T @ scipy.linalg.solve_continuous_are(A, B, np.diag([4.0, 0]), np.eye(1)), rtol=1e-9)


# -- the gain at work


@pytest.mark.parametrize("module", [cart, *swept([rod])])
def test_the_gain_brings_the_pole_upright(module: Any) -> None:
    linear = module().linearize()
    regulator = linear.lqr([1.0] * 4, [1.0])
    q, u = module().consistent({"phi": 0.2, "x": 0.1} if module is cart else {"phi": 0.2, "b": 0.3}, params=None)
    for inputs in (regulator, sd.Sampled(regulator, period=0.04)):
        sol = module().simulate([0, 6], q, u, inputs=inputs, rtol=1e-4, method="RK23")
        assert sol.success and np.abs(linear.deviation(6.0, sol.x[-1])).max() < 0.02


def test_the_cost_of_a_small_disturbance_is_that_of_riccatis_matrix() -> None:
    linear = cart().linearize()
    regulator = linear.lqr([1.0, 2.0, 0.5, 0.1], [0.3])
    start = 1e-4 * np.array([1.0, -2.0, 0.5, 1.5])
    t = np.linspace(0, 16, 3201)
    sol = cart().simulate(t, start[:2], start[2:], inputs=regulator, rtol=1e-7, atol=1e-12)
    rate = np.einsum("ti,ij,tj->t", sol.x, regulator.Q, sol.x) + 0.3 * sol["F"]**2
    assert np.isclose(scipy.integrate.simpson(rate, x=t), start @ regulator.S @ start, rtol=1e-5)


def test_deviations_along_steady_motion_count_from_the_moving_state() -> None:
    whole = cart(0.0).linearize({"x_dot": 2.0})
    assert np.allclose(whole.deviation(3.0, [6.1, 0.0, 2.0, 0.3]), [0.1, 0.0, 0.0, 0.3], atol=1e-12)
    disc = sd.systems.rolling_disc().augmented().compile(backend="numpy")
    theta, turn = 1.2, 1.5
    R, I_t, I_a, g = 1.0, 0.25, 0.5, 1.0
    w = (I_t * turn**2 * np.cos(theta) - g * R / np.tan(theta)) / ((I_a + R**2) * turn)
    at = {**dict.fromkeys(disc.metadata.x, 0.0), "z": np.sin(theta), "theta": theta, "psi_dot": turn,
          "phi_dot": w - turn * np.cos(theta), "x_dot": -w}
    circle = disc.linearize(at, params={"g": g, "m": 1.0, "R": R, "I_t": I_t, "I_a": I_a})
    with pytest.raises(sd.ArgumentError, match="the motion linearized about is no straight one: y accelerates by"):
        circle.deviation(1.0, at)


# -- what is rejected


def two_masses(linked: bool) -> Any:
    """Two masses on rails; a force on the first alone; linked by a spring or not."""
    x, y, F = *sd.coordinates("x y"), sd.inputs("F")
    s = sd.System("masses")
    first = s.add_joint(sd.Prismatic("a", s.ground, s.add_body("one", mass=1), x))
    second = s.add_joint(sd.Prismatic("b", s.ground, s.add_body("two", mass=1), y))
    s.add_joint_force(first, F - (x - y if linked else 0))
    s.add_joint_force(second, x - y if linked else -4 * y)
    return s.compile(backend="numpy").linearize()


def test_what_no_input_reaches_is_named() -> None:
    with pytest.raises(sd.ArgumentError, match=r"the linear equations are not stabilizable: the mode .*y.* with the "
                                               r"eigenvalue .* does not decay, and no input \(F\) reaches it"):
        two_masses(False).lqr([1, 1, 1, 1], [1])
    assert (two_masses(True).lqr([1, 1, 1, 1], [1]).eigenvalues.real < 0).all()
    pendulum = sd.systems.pendulum().embedding().compile(backend="numpy").linearize({"q1": 0.0})
    with pytest.raises(sd.ArgumentError, match="a regulator was requested, but the system has no inputs"):
        pendulum.lqr([1, 1], [])


@pytest.mark.parametrize("noise", [0.0, 3.3e-14])
def test_rounding_hides_nothing_that_an_input_reaches(noise: float) -> None:
    """A drone with a load and yaw: what cancels to 3e-14 in the equation of roll made balancing shrink all of yaw to nothing."""
    A, B = np.zeros((8, 8)), np.zeros((8, 2))
    A[:4, 4:] = np.eye(4)
    A[4, 1:3], A[5, 2], A[6, 2] = (9.81, -2.45), noise, -12.26
    B[5:7, 0], B[5:, 1] = (16.67, -16.67), (-16.67, 16.67, 0.727)
    reached = np.hstack([np.linalg.matrix_power(A, k) @ B for k in range(8)])
    assert np.linalg.matrix_rank(reached) == 8
    assert _out_of_reach(A, B) == []
    unheard = _out_of_reach(A, B * [1, 0])
    assert len(unheard) == 2 and max(abs(value) for value, _ in unheard) < 1e-9


def test_decaying_modes_need_no_input() -> None:
    x, y, F = *sd.coordinates("x y"), sd.inputs("F")
    s = sd.System("masses")
    first = s.add_joint(sd.Prismatic("a", s.ground, s.add_body("one", mass=1), x))
    second = s.add_joint(sd.Prismatic("b", s.ground, s.add_body("two", mass=1), y))
    s.add_joint_force(first, F)
    s.add_joint_force(second, -4 * y - y.dot)
    found = s.compile(backend="numpy").linearize().lqr({"x": 1}, [1])
    assert np.allclose(found.K, [[1, 0, np.sqrt(2), 0]], atol=1e-12)


def test_what_has_no_weight_and_does_not_decay_is_named() -> None:
    with pytest.raises(sd.ArgumentError, match=r"Q gives no weight to the mode x \(1.00\) with the eigenvalue 0 1/s"):
        cart().linearize(hold=["phi"]).lqr({"x_dot": 1}, [1])


@pytest.mark.parametrize(("Q", "R", "message"), [
    ([1, -1, 0, 0], [1], r"Q is not positive semidefinite: along phi \(1.00\) it is -1; give it 0 or more there"),
    ([1, 1, 1, 1], [0], r"R is not positive definite: along F \(1.00\) it is 0; give it more than 0 there"),
    ([1, 1], [1], r"Q has the shape \(2,\); needed are 4 numbers, a matrix \(4, 4\), or weights by name: x, phi, x_dot, phi_dot"),
    ([1, 1, 1, 1], {}, "R has no weights, so there is nothing to drive; give weights of inputs: F"),
    ({"y": 1}, [1], "Q: there is no 'y'"),
    (np.triu(np.ones((4, 4))), [1], "Q is not symmetric: its entry of x by phi is 1, the other way 0"),
    ([1, 1, 1, np.nan], [1], "Q must be finite"),
    ("much", [1], "Q must be numbers, found 'much'"),
    ([[1, 2, 0, 0], [2, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], [1], r"Q is not positive .*: along .*\(0.50\).* it is -1"),
])
def test_weights_that_do_not_fit(Q: Any, R: Any, message: str) -> None:
    with pytest.raises(sd.ArgumentError, match=message):
        cart().linearize().lqr(Q, R)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_extreme_weights_are_not_solved_without_a_word() -> None:
    with pytest.raises(sd.ArgumentError, match="change the weights by less extreme ratios"):
        cart().linearize().lqr([1e200, 0, 0, 0], [1e-200])


def test_a_regulator_of_a_motion_that_changes_is_rejected() -> None:
    with pytest.raises(sd.ArgumentError, match="a regulator was requested at a state that is neither at rest nor in steady"):
        cart().linearize({"phi": 0.5}).lqr([1] * 4, [1])


# -- other packages


def test_scipys_state_space() -> None:
    linear = cart().linearize()
    system = linear.to_scipy()
    assert np.array_equal(system.A, linear.A) and np.array_equal(system.B, linear.B)
    assert np.array_equal(system.C, np.eye(4)) and np.array_equal(system.D, np.zeros((4, 1)))
    t, y = system.step(T=np.linspace(0, 0.1, 11))
    assert np.isclose(y[-1, 0], linear.B[2, 0] * 0.005, rtol=0.02)
    assert isinstance(linear.lqr([1] * 4, [1]), Regulator) and t[-1] == 0.1


def test_python_control_gets_names(monkeypatch: pytest.MonkeyPatch) -> None:
    told: dict[str, Any] = {}
    fake = types.ModuleType("control")
    fake.ss = lambda *matrices, **names: told.update(matrices=matrices, **names) or "system"  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "control", fake)
    linear = cart().linearize()
    assert linear.to_control() == "system" and told["name"] == "cart" and told["inputs"] == ["F"]
    assert told["states"] == ["x", "phi", "x_dot", "phi_dot"] and told["outputs"] == ["y_x", "y_phi", "y_x_dot", "y_phi_dot"]
    assert [m.shape for m in told["matrices"]] == [(4, 4), (4, 1), (4, 4), (4, 1)]


def test_python_control_that_is_there_takes_them() -> None:
    """Its regulator, by a solver of its own, is ours."""
    control = pytest.importorskip("control")
    linear = cart().linearize()
    system = linear.to_control()
    assert isinstance(system, control.StateSpace) and system.state_labels == ["x", "phi", "x_dot", "phi_dot"]
    assert (system.name, system.input_labels, system.output_labels) == ("cart", ["F"], ["y_x", "y_phi", "y_x_dot", "y_phi_dot"])
    K, _, values = control.lqr(system, np.diag([1, 2, 3, 4]), [[5.0]])
    ours = linear.lqr([1, 2, 3, 4], [5])
    np.testing.assert_allclose(ours.K, K, rtol=1e-9)
    np.testing.assert_allclose(np.sort_complex(ours.eigenvalues), np.sort_complex(values), rtol=1e-7)


def test_python_control_takes_equations_without_inputs() -> None:
    pytest.importorskip("control")
    system = sd.systems.get("pendulum").embedding().compile(backend="numpy").linearize().to_control()
    assert (system.ninputs, system.noutputs, system.nstates) == (0, 2, 2)


def test_python_control_that_is_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(sd.MissingExtra, match=r"to_control\(\) needs the package control: pip install 'symdyn\[control\]'"):
        cart().linearize().to_control()
