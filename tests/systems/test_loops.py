"""Mechanisms with loops and constraints against published motions and closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import symdyn as sd
from symdyn.lab.loop_cases import REFERENCE
from symdyn.runtime.building.compiler import find_compiler
from tests.helpers import swept

VARIANTS = [*[(name, {}) for name in sd.systems.names(constrained=True)], ("n_four_bar", {"n": 1}),
            ("particle_on_moving_slope", {"rocking": True}), ("flyball_governor", {"links": "rods"})]

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


@pytest.fixture(scope="module")
def built() -> Callable[..., Any]:
    """built(name, **options): the compiled module of a mechanism's augmented equations, made once."""
    known: dict[Any, Any] = {}

    def module(name: str, **options: Any) -> Any:
        key = (name, *options.items())
        if key not in known:
            known[key] = sd.systems.get(name, **options).augmented().compile()
        return known[key]

    return module


def start(name: str, **options: Any) -> np.ndarray:
    """[q; u] where the mechanism starts."""
    model = sd.systems.get(name, **options).check()
    return np.array([float(model.initial.get(symbol, 0.0)) for symbol in (*model.coordinates, *model.speeds)])


def largest(values: Any) -> float:
    return float(np.abs(np.asarray(values)).max())


# -- all of them


@pytest.mark.parametrize(("name", "options"), swept(VARIANTS, *(case for case in VARIANTS if case[0] != "bicycle")))
def test_starts_consistently(built, name, options):
    """The catalogue's start satisfies the constraints, of position and velocity, to the last digits."""
    module = built(name, **options)
    x = start(name, **options)
    assert largest(module.evaluate("C", 0, x)) <= 1e-15
    assert largest(module.evaluate("C_dot", 0, x)) <= 1e-14


def test_options_that_are_impossible():
    with pytest.raises(sd.ModelError, match="n_four_bar"):
        sd.systems.get("n_four_bar", n=0)
    with pytest.raises(sd.ModelError, match="flyball_governor"):
        sd.systems.get("flyball_governor", links="ropes")


# -- the lecture


def test_pendulum_is_the_lectures(built):
    """M = diag(m, m), C_r = [2 x, 2 y]; at rest at the side the rod carries nothing, hanging it carries m g."""
    module = built("pendulum_absolute")
    x = np.array([0.6, -0.8, 0.0, 0.0])
    np.testing.assert_allclose(module.mass_matrix(x[:2]), np.eye(2))
    np.testing.assert_allclose(module.evaluate("C_r", 0, x), [[1.2, -1.6]], rtol=1e-15)
    hanging = np.array([0.0, -1.0, 0.0, 0.0])
    np.testing.assert_allclose(-module.evaluate("C_r", 0, hanging).T @ module.evaluate("lam", 0, hanging), [0, 9.81], atol=1e-14)


def test_pendulum_A01(built):
    rows = np.array(REFERENCE["pendulum_absolute"]["t_x_y"])[:3]
    sol = built("pendulum_absolute").simulate(np.r_[0, rows[:, 0]], rtol=1e-12, atol=1e-13)
    assert largest(sol.q[1:] - rows[:, 1:]) <= 1e-9


def test_vehicle_is_the_lectures(built):
    """C_r = [tan theta, 1], lam = -m g cos^2 theta, and the acceleration g sin theta down the track."""
    module, theta, g = built("vehicle_on_track_absolute"), 0.5, 9.81
    x = start("vehicle_on_track_absolute")
    np.testing.assert_allclose(module.evaluate("C_r", 0, x), [[math.tan(theta), 1]], rtol=1e-15)
    np.testing.assert_allclose(module.evaluate("lam", 0, x), [-g * math.cos(theta)**2], rtol=1e-14)
    acceleration = module.rhs(0, x)[2:]
    np.testing.assert_allclose(acceleration, g * math.sin(theta) * np.array([math.cos(theta), -math.sin(theta)]), rtol=1e-14)
    sol = module.simulate((0, 2), rtol=1e-12)
    travelled = 0.5 * 2 + g * math.sin(theta) * 2
    np.testing.assert_allclose(sol.q[-1], travelled * np.array([math.cos(theta), -math.sin(theta)]), rtol=1e-12)


def test_rotating_track_is_the_lectures(built):
    """M, C_r and F_d = -(C_r r_dot)_r r_dot; the slides print -tan theta for the derivative of the last constraint by x_v."""
    module = built("vehicle_on_rotating_track_absolute")
    x_v, theta, v, rate = -1.1, 0.3, 0.2, -0.5
    x = np.array([x_v, -0.3, 0.0, 0.0, theta, v, 0.4, 0.0, 0.0, rate])
    tan, sec2 = math.tan(theta), 1 / math.cos(theta)**2
    np.testing.assert_allclose(module.mass_matrix(x[:5]), np.diag([1.0, 1.0, 2.0, 2.0, 0.5]), atol=1e-16)
    np.testing.assert_allclose(module.evaluate("C_r", 0, x), [[0, 0, 1, 0, 0], [0, 0, 0, 1, 0], [tan, -1, 0, 0, x_v * sec2]],
                               rtol=1e-14)
    by_x, by_theta = sec2 * rate, sec2 * v + x_v * 2 * sec2 * tan * rate
    np.testing.assert_allclose(module.evaluate("F_d", 0, x), [0, 0, -by_x * v - by_theta * rate], rtol=1e-14)


def test_rotating_track_moves_as_with_relative_coordinates(built):
    times = np.linspace(0, 1, 11)
    absolute = built("vehicle_on_rotating_track_absolute").simulate(times, rtol=1e-12, atol=1e-13)
    relative = sd.systems.vehicle_on_rotating_track().compile().simulate(times, rtol=1e-12, atol=1e-13)
    q1, q2 = relative.q.T
    expected = np.transpose([-q1 * np.cos(q2), -q1 * np.sin(q2), 0 * q1, 0 * q1, q2])
    assert largest(absolute.q - expected) <= 1e-10


def test_slope_that_turns(built):
    """s_ddot = omega^2 s - g sin(omega t): s = A cosh + B sinh + g/(2 omega^2) sin."""
    omega, g, times = 2.0, 9.81, np.linspace(0, 3, 7)
    sol = built("particle_on_moving_slope").simulate(times, rtol=1e-12, atol=1e-13)
    particular = g / (2 * omega**2)
    b = (-0.5 - particular * omega) / omega
    s = np.cosh(omega * times) + b * np.sinh(omega * times) + particular * np.sin(omega * times)
    expected = s[:, None] * np.transpose([np.cos(omega * times), np.sin(omega * times)])
    assert largest(sol.q - expected) <= 1e-10 * largest(expected)


# -- plane linkages


def test_slider_crank_passes_its_folds(built):
    """The rods fold together several times, where another branch opens; the motion goes straight on."""
    rows = np.array(REFERENCE["slider_crank"]["rows"])
    sol = built("slider_crank").simulate(np.r_[0, rows[:, 0]], rtol=1e-11, atol=1e-12)
    assert largest(sol.q[1:, 0] - rows[:, 1]) <= 1e-7 and largest(sol.u[1:, 0] - rows[:, 2]) <= 1e-7
    assert largest(sol.q[:, 1] + 2 * sol.q[:, 0]) <= 1e-7
    assert sol.energy_error() <= 1e-9


@pytest.mark.parametrize("n", [1, 2])
def test_windows_A02(built, n):
    """Through the positions where all bars lie flat, on the branch of the parallelograms."""
    rows = np.array(REFERENCE["n_four_bar"]["t_x_y_vx_vy"][str(n)])
    sol = built("n_four_bar", n=n).simulate(np.r_[0, rows[:, 0]], rtol=1e-11, atol=1e-12)
    theta, rate = sol.q[1:, 0], sol.u[1:, 0]
    found = np.transpose([np.sin(theta), np.cos(theta), rate * np.cos(theta), -rate * np.sin(theta)])
    assert largest(found - rows[:, 1:]) <= 1e-6
    assert largest(sol.q[:, :n + 1] - sol.q[:, :1]) <= 1e-6
    assert sol.energy_error() <= 1e-9


def windows_in_step(n: int) -> Any:
    """theta and theta_dot over time of n windows that stay parallelograms, from the closed equation, by SciPy."""
    pull = 9.81 * ((n + 1) / 2 + n) / ((n + 1) / 3 + n)
    return solve_ivp(lambda t, y: (y[1], pull * math.sin(y[0])), (0, 20), (0, 1), method="DOP853", rtol=1e-13, atol=1e-13,
                     dense_output=True).sol


def window_rows(theta: float, n: int) -> np.ndarray:
    """C_r of n windows that are parallelograms with sides of 1 m, by hand."""
    rows, sine, cosine = np.zeros((2 * n, 2 * n + 1)), math.sin(theta), math.cos(theta)
    for k in range(n):
        rows[2 * k:2 * k + 2, [k, k + 1, n + 1 + k]] = [[-cosine, cosine, 0], [1 + sine, -sine, 1]]
    return rows


@pytest.mark.filterwarnings("ignore:.*rounding is magnified there:symdyn.errors.SimulationWarning")
@pytest.mark.parametrize(("n", "tolerances"), [(12, np.logspace(-8, -10, 4)), *swept([(40, np.logspace(-8, -10, 13))])], ids=str)
def test_many_windows_pass_flat_positions_at_every_tolerance(built, n, tolerances):
    """n singular values vanish where the uprights lie flat, nowhere else; 24 times the motion goes on there."""
    exact, times = windows_in_step(n), np.linspace(0, 20, 41)
    module = built("n_four_bar", n=n)
    for theta, lost in ((math.pi / 2, n), (math.pi / 2 - 0.01, 0), (0.0, 0)):
        state = np.r_[np.full(n + 1, theta), np.full(n, -theta), np.zeros(2 * n + 1)]
        values = np.linalg.svd(np.reshape(module.evaluate("C_r", 0, state), (2 * n, 2 * n + 1)), compute_uv=False)
        assert values == pytest.approx(np.linalg.svd(window_rows(theta, n), compute_uv=False), abs=1e-14)
        assert (values < 1e-4).sum() == lost
    errors = []
    for rtol in tolerances:
        sol = module.simulate(times, rtol=rtol)
        assert sol.success, sol.message
        assert largest(sol.q[:, :n + 1] - sol.q[:, :1]) <= 1e-10
        errors.append(largest(sol.q[:, 0] - exact(times)[0]) / rtol)
    # A step's error is magnified by the motion some 500 times; by a stage next to a flat position once 50 times more.
    assert np.median(errors) <= 1e3 and max(errors) <= 5e4


def test_four_bar_turns_as_its_lengths_allow(built):
    """Energy, and the distance of the hinges that the law of cosines gives."""
    sol = built("four_bar").simulate(np.linspace(0, 10, 101), rtol=1e-11, atol=1e-12)
    assert sol.energy_error() <= 1e-9
    q1, q2, q3 = sol.q.T
    x = 0.8 * np.cos(q1) + 2 * np.cos(q1 + q2) + 1.6 * np.cos(q1 + q2 + q3)
    y = 0.8 * np.sin(q1) + 2 * np.sin(q1 + q2) + 1.6 * np.sin(q1 + q2 + q3)
    assert largest(x - 2) <= 1e-9 and largest(y) <= 1e-9


# -- Andrews' squeezing mechanism


def published_inertia(p: dict[str, float], Th: float, Ph: float, Om: float) -> np.ndarray:
    """The published M of Andrews' mechanism."""
    M = np.zeros((7, 7))
    e_ea, zf_fa = p["e"] - p["ea"], p["zf"] - p["fa"]
    i = [p[f"i{k}"] for k in range(1, 8)]
    M[0, 0] = p["m1"] * p["ra"]**2 + p["m2"] * (p["rr"]**2 - 2 * p["da"] * p["rr"] * math.cos(Th) + p["da"]**2) + i[0] + i[1]
    M[1, 0] = p["m2"] * (p["da"]**2 - p["da"] * p["rr"] * math.cos(Th)) + i[1]
    M[1, 1] = p["m2"] * p["da"]**2 + i[1]
    M[2, 2] = p["m3"] * (p["sa"]**2 + p["sb"]**2) + i[2]
    M[3, 3] = p["m4"] * e_ea**2 + i[3]
    M[4, 3] = p["m4"] * (e_ea**2 + p["zt"] * e_ea * math.sin(Ph)) + i[3]
    M[4, 4] = (p["m4"] * (p["zt"]**2 + 2 * p["zt"] * e_ea * math.sin(Ph) + e_ea**2) + p["m5"] * (p["ta"]**2 + p["tb"]**2)
               + i[3] + i[4])
    M[5, 5] = p["m6"] * zf_fa**2 + i[5]
    M[6, 5] = p["m6"] * (zf_fa**2 - p["u"] * zf_fa * math.sin(Om)) + i[5]
    M[6, 6] = (p["m6"] * (zf_fa**2 - 2 * p["u"] * zf_fa * math.sin(Om) + p["u"]**2) + p["m7"] * (p["ua"]**2 + p["ub"]**2)
               + i[5] + i[6])
    return M + np.tril(M, -1).T


def test_squeezer_has_the_published_mass_matrix(built):
    module = built("andrews_squeezer")
    numbers = {str(symbol): value for symbol, value in sd.systems.andrews_squeezer().defaults.items()}
    for q in np.random.default_rng(5).uniform(-1, 1, (3, 7)):
        expected = published_inertia(numbers, q[1], q[3], q[5])
        np.testing.assert_allclose(module.mass_matrix(q), expected, rtol=0, atol=1e-15 * largest(expected))


def test_squeezer_starts_as_published(built):
    """Accelerations and multipliers: the loops are the published constraints, signs and order included."""
    module, published, x = built("andrews_squeezer"), REFERENCE["andrews_squeezer"]["start"], start("andrews_squeezer")
    np.testing.assert_allclose(module.rhs(0, x)[7:], published["q_ddot"], rtol=1e-12, atol=1e-8)
    np.testing.assert_allclose(module.evaluate("lam", 0, x), published["lambda"], rtol=1e-12, atol=1e-10)


def test_squeezer_ends_as_published(built):
    published = REFERENCE["andrews_squeezer"]
    module = built("andrews_squeezer")
    sol = module.simulate((0, published["t"]), rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(sol.q[-1], published["q"], rtol=1e-9)
    np.testing.assert_allclose(sol.u[-1], published["q_dot"], rtol=2e-7)
    x = np.r_[sol.q[-1], sol.u[-1]]
    np.testing.assert_allclose(module.rhs(published["t"], x)[7:], published["q_ddot"], rtol=1e-5)
    np.testing.assert_allclose(module.evaluate("lam", published["t"], x), published["lambda"], rtol=2e-6)


# -- the car axis


def test_car_axis_ends_as_published(built):
    module, published = built("car_axis"), REFERENCE["car_axis"]
    np.testing.assert_allclose(module.mass_matrix(np.zeros(4)), 5e-4 * np.eye(4), rtol=1e-15)
    sol = module.simulate((0, published["t"]), rtol=1e-12, atol=1e-13)
    assert largest(sol.q[-1] - published["q"]) <= 1e-12
    assert largest(sol.u[-1] - published["q_dot"]) <= 1e-9
    lam = module.evaluate("lam", 3, np.r_[sol.q[-1], sol.u[-1]])
    np.testing.assert_allclose(-lam, published["lambda"], rtol=0, atol=1e-9)


# -- loops in space


def test_bricard_moves_and_keeps_its_energy(built):
    """Five constraints on five coordinates, one of them redundant."""
    sol = built("bricard").simulate((0, 10), rtol=1e-11, atol=1e-12)
    assert sol.energy_error() <= 1e-9
    assert np.ptp(sol.q[:, 0]) > 1


def test_spatial_slider_crank(built):
    rows = np.array(REFERENCE["spatial_slider_crank"]["rows"])
    sol = built("spatial_slider_crank").simulate(rows[:, 0], rtol=1e-12, atol=1e-13)
    assert largest(sol.q[:, 0] - rows[:, 1]) <= 1e-8
    assert largest(sol.u[:, 0] - rows[:, 2]) <= 1e-8
    assert largest(sol.q[:, 1] - rows[:, 3]) <= 1e-10
    assert sol.energy_error() <= 1e-9


def test_double_wishbone_closes(built):
    """It settles on its spring, the lengths of arm and tie rod kept."""
    module = built("double_wishbone")
    sol = module.simulate((0, 2), rtol=1e-10, atol=1e-12, work=True)
    assert sol.energy_error() <= 1e-8
    x = np.r_[sol.q[-1], sol.u[-1]]
    assert largest(sol.u[-1]) <= 1e-3
    assert largest(module.evaluate("C", 2, x)) <= 1e-9


# -- the governor


def test_governor_A05():
    rows = np.array(REFERENCE["flyball_governor"]["rows"])
    sol = sd.systems.flyball_governor().compile().simulate(rows[:, 0], rtol=1e-11, atol=1e-11)
    phi, s, beta1, beta2 = sol.q.T
    assert largest(np.transpose([beta1, s, phi]) - rows[:, 1:4]) <= 1e-8
    assert largest(sol.u[:, [2, 1, 0]] - rows[:, 4:]) <= 1e-7
    assert largest(beta1 - beta2) <= 1e-10


def test_governor_with_rods_is_the_limit_of_stiff_springs(built):
    """Rods instead: two loops; the springs' give is a small part of the motion."""
    rows = np.array(REFERENCE["flyball_governor"]["rows"])[:3]
    sol = built("flyball_governor", links="rods").simulate(rows[:, 0], rtol=1e-11, atol=1e-12)
    assert sol.energy_error() <= 1e-9
    assert 1e-9 < largest(sol.q[:, 1] - rows[:, 2]) < 2e-3


# -- constraints of the velocity


def steady_spin(theta: float, turn: float) -> float:
    """omega_3 of the catalogue's disc with which theta stays as it is while it turns steadily."""
    g, m, R, I_t, I_a = 9.81, 1.0, 0.5, 0.0625, 0.125
    s, c = math.sin(theta), math.cos(theta)
    return (I_t * turn**2 * s * c - m * g * R * c) / ((I_a + m * R**2) * turn * s)


def test_disc_rolls_in_a_circle(built):
    theta, turn, R = 1.2, 1.5, 0.5
    spin = steady_spin(theta, turn)
    q = [0, 0, R * math.sin(theta), 0, theta, 0]
    u = [-R * spin, 0, 0, turn, 0, spin - turn * math.cos(theta)]
    sol = built("rolling_disc").simulate(np.linspace(0, 2 * math.pi / turn, 5), q=q, u=u, rtol=1e-11, atol=1e-12)
    assert largest(sol.q[:, 4] - theta) <= 1e-9
    assert largest(sol.q[-1, :2]) <= 1e-8  # back where it was
    assert largest(sol.q[2, :2] - [0, -2 * R * spin / turn]) <= 1e-8  # half way: the circle's diameter


def test_disc_keeps_its_energy(built):
    assert built("rolling_disc").simulate((0, 5), rtol=1e-11, atol=1e-12).energy_error() <= 1e-9


def test_skate_turns_round(built):
    """v = V tanh(gamma (t - t_0)): pushed backwards, it turns until it glides forwards."""
    m, I, a, v, rate = 1.0, 0.02, 0.1, -0.5, 4.0
    V = math.sqrt(v**2 + (I + m * a**2) / m * rate**2)
    gamma = m * a * V / (I + m * a**2)
    times = np.linspace(0, 5, 11)
    sol = built("skate").simulate(times, rtol=1e-12, atol=1e-13)
    phase = gamma * times + math.atanh(v / V)
    along = sol.u[:, 0] * np.cos(sol.q[:, 2]) + sol.u[:, 1] * np.sin(sol.q[:, 2])
    assert largest(along - V * np.tanh(phase)) <= 1e-10
    assert largest(sol.u[:, 2] - V * math.sqrt(m / (I + m * a**2)) / np.cosh(phase)) <= 1e-10
