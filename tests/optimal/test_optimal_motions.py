"""Optimal motions against closed forms, an independent collocation and each other; meshes, orders, solvers, results."""

from __future__ import annotations

import functools
import warnings
from typing import Any

import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
import scipy.optimize
import sympy as sp

import symdyn as sd
from symdyn.lab import gait
from symdyn.runtime.module import Module
from tests.helpers import swept

F = sp.Symbol("F")
# Kelly, SIAM Review 59 (2017), section 5; the pole is a point mass, and turns the other way round here.
KELLY: dict[str, Any] = {"start": {"q1": 0, "q2": -np.pi}, "end": {"q1": 1, "q2": 0, "q1_dot": 0, "q2_dot": 0},
                         "bounds": {"F": (-20, 20), "q1": (-2, 2)}, "params": {"m_c": 1, "m_p": 0.3, "I_p": 0, "l": 0.5}}
# Cost by an independent collocation with 320 intervals.
CONVERGED = 58.807667
EFFORT = sd.Loss(integral=F**2)


@functools.cache
def cart_pole() -> Module:
    return sd.systems.cart_pole().compile(backend="c")


@functools.cache
def slider() -> Module:
    x, m = sd.coordinates("x"), sd.parameters("m")
    system = sd.System("slider")
    body = system.add_body("body", mass=m)
    slide = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=x))
    system.add_joint_force(slide, sd.inputs("F"))
    system.defaults = {m: 1}
    return system.compile(backend="c")


@functools.cache
def linkage() -> Module:
    system = sd.systems.four_bar()
    system.add_joint_force("hinge1", sd.inputs("tau"))
    return system.compile(backend="c")


@functools.cache
def walking() -> tuple[Module, sd.Optimum]:
    module = gait.biped().compile(backend="c")
    return module, gait.step(module, intervals=15, tolerance=1e-5)


@functools.cache
def swing_up(**options: Any) -> sd.Optimum:
    return sd.optimize(cart_pole(), EFFORT, 2.0, **KELLY, **options)


@pytest.mark.parametrize(("options", "tolerance"), [
    ({"tolerance": 1e-7}, 3e-6), ({"transcription": "radau", "degree": 4, "tolerance": 1e-7}, 1e-6)])
def test_swing_up_costs_what_an_independent_collocation_finds(options: dict[str, Any], tolerance: float) -> None:
    found = swing_up(**options)
    assert found.success and found.error <= 1e-7
    assert abs(found.cost - CONVERGED) < tolerance
    assert found.iterations < 60 and found.iterations == sum(mesh.iterations for mesh in found.meshes)
    assert max(found.difference.values()) < 1e-4 and abs(found.simulated.x - found.x).max() == max(found.difference.values())
    assert np.abs(found.x[-1] - [1, 0, 0, 0]).max() < 1e-9


def test_inputs_that_are_held_or_straight_cost_more_the_fewer_they_are() -> None:
    costs = {n: swing_up(transcription="shooting", intervals=n, steps=3, tolerance=None).cost for n in (40, 80)}
    # Straight pieces leave out what the optimum has between them, h^2, and the cost is flat there: its error is of the order h^4.
    assert CONVERGED < costs[80] < costs[40]
    assert 14 < (costs[40] - CONVERGED) / (costs[80] - CONVERGED) < 19
    held = swing_up(transcription="shooting", hold=True, intervals=40, tolerance=1e-7)
    assert held.cost > costs[40] and max(held.difference.values()) < 1e-5
    at = held.t[7] + np.array([0.01, 0.04])
    assert np.ptp(held.inputs_at(at)) == 0 and held.inputs_at(held.t[8]) != held.inputs_at(at[1])


def test_order_of_the_transcriptions() -> None:
    """The cost of Hermite and Simpson's method converges by the fourth power, that of Radau's by the fifth for degree 3."""
    for options, order in (({}, 4), ({"transcription": "radau", "degree": 2}, 3), ({"transcription": "radau", "degree": 3}, 5)):
        errors = [abs(swing_up(intervals=n, tolerance=None, **options).cost - 58.80766746) for n in (40, 80)]
        assert np.log2(errors[0] / errors[1]) > order - 0.6, (options, errors)


def test_minimum_time_by_a_bounded_force() -> None:
    """Bang-bang: half of the way at full force, T = 2 sqrt(m d/F)."""
    for options in ({"transcription": "shooting", "hold": True}, {"transcription": "radau"}, {}):
        found = sd.optimize(slider(), sd.Loss(end=sd.t), (0.1, 10), end={"x": 1, "x_dot": 0}, bounds={"F": (-1, 1)},
                            tolerance=None, params={"m": 2}, **options)
        assert abs(found.duration - 2 * np.sqrt(2)) < 1e-6 and found.cost == pytest.approx(found.duration, abs=1e-12)
        assert np.allclose(np.abs(found["F"][1:-1][[2, -3]]), 1, atol=1e-5) and found.t[-1] == pytest.approx(found.duration)


@pytest.mark.parametrize("transcription", ["hermite-simpson", *swept(["radau"]), "shooting"])
def test_minimum_time_with_a_bounded_rate_of_the_force(transcription: str) -> None:
    """The force falls at its full rate r: F = r (T/2 - t), x(T) = r T^3/(12 m) = d."""
    found = sd.optimize(slider(), sd.Loss(end=sd.t), (0.1, 10), end={"x": 1, "x_dot": 0}, rates={"F": (-8, 8)}, intervals=12,
                        tolerance=None, transcription=transcription)
    assert found.duration == pytest.approx((12 / 8) ** (1 / 3), rel=1e-6)
    t = np.linspace(0, found.duration, 201)
    assert np.abs(found.inputs_at(t)[:, 0] - 8 * (found.duration / 2 - t)).max() < 1e-4
    # With a bounded rate and a prescribed duration, the same motion is that of least effort.
    same = sd.optimize(slider(), EFFORT, found.duration * (1 + 1e-6), end={"x": 1, "x_dot": 0}, rates={"F": (-8, 8)},
                       intervals=12, tolerance=None, transcription=transcription)
    assert np.abs(same.x - found.x).max() < 1e-4


def test_linear_quadratic_problem_against_riccati() -> None:
    """min of the integral of x^2 + v^2 + F^2 from x0 = 1: the cost is x0^T S x0, the costate 2 S x, by the Hamiltonian's matrix
    exponential."""
    T, m = 2.0, 1.5
    A, B, Q = np.array([[0, 1.0], [0, 0]]), np.array([[0], [1 / m]]), np.eye(2)
    H = np.block([[A, -B @ B.T], [-Q, -A.T]])

    def S(t: float) -> np.ndarray:
        flow = scipy.linalg.expm(H * (t - T))  # of [X; S X], which is [1; 0] at the end
        return flow[2:, :2] @ np.linalg.inv(flow[:2, :2])

    x, v = sp.symbols("x x_dot")
    for options, rtol in (({"transcription": "radau", "degree": 4, "tolerance": 1e-10}, 1e-9), ({"tolerance": 1e-8}, 1e-7)):
        found = sd.optimize(slider(), sd.Loss(integral=x**2 + v**2 + F**2), T, start={"x": 1}, params={"m": m}, **options)
        assert found.cost == pytest.approx(S(0.0)[0, 0], rel=rtol)
        exact = np.array([2 * S(t) @ found.at(t) for t in found.costate_times])
        assert np.abs(found.costates - exact).max() < (1e-6 if options.get("degree") else 1e-3) * np.abs(exact).max()
        regulator = found.lqr(Q=[1, 1], R=[1], Qf=[0, 0])
        for t in (0.0, 0.7, 1.9):
            assert np.abs(regulator.S(t) - S(t)).max() < 1e-6
            assert np.abs(regulator.K(t) - B.T @ S(t)).max() < 1e-6


@functools.cache
def sprung() -> Module:
    x, (m, k) = sd.coordinates("x"), sd.parameters("m k")
    system = sd.System("sprung")
    body = system.add_body("body", mass=m)
    slide = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=x))
    system.add_joint_force(slide, sd.inputs("F") - k * x)
    return system.compile(backend="c")


@pytest.mark.parametrize(("options", "near"), [
    ({"tolerance": 1e-7}, 1e-6), *swept([({"transcription": "radau"}, 1e-6), ({"transcription": "shooting"}, 2e-4)]),
    ({"method": "slsqp", "intervals": 8, "tolerance": None}, 1e-3)])
def test_small_and_large_motions(options: dict[str, Any], near: float) -> None:
    """A mass on a spring comes to rest at a: the effort is a^2 b^T W^-1 b with W the Gramian, in all units of length, mass and
    time; 1e-36 N^2 s is as well minimized as 1e6."""
    def exact(a: float, m: float, k: float, T: float) -> float:
        A, B = np.array([[0, 1], [-k / m * T**2, 0]]), np.array([[0], [1.0]])  # of x and x' T over shares of T; F T^2/m
        flow = scipy.linalg.expm(np.block([[-A, B @ B.T], [np.zeros((2, 2)), A.T]]))
        W = flow[2:, 2:].T @ flow[:2, 2:]
        return float(np.linalg.inv(W)[0, 0] * a**2 * m**2 / T**3)

    for a, m, T in ((1, 1, 1), (1e-9, 1, 1), (1e-9, 1e-9, 1e-2), (1e6, 1e5, 1e4)):
        k = 20 * m / T**2
        with warnings.catch_warnings():
            warnings.simplefilter("error", sd.OptimumWarning)
            found = sd.optimize(sprung(), EFFORT, T, end={"x": a, "x_dot": 0}, params={"m": m, "k": k}, **options)
        least = exact(a, m, k, T)
        assert found.success and found.cost == pytest.approx(least, rel=near, abs=0), (a, m, T)
        assert found.simulated is not None and abs(found.simulated.x[-1, 0] / a - 1) < 2e-3
        assert found.integrated_cost == pytest.approx(found.cost, rel=1e-3, abs=0)


def test_small_and_large_costs() -> None:
    """The same motion whatever its cost is counted in."""
    x, v = sp.symbols("x x_dot")
    costs = [sd.optimize(slider(), sd.Loss(integral=c * (F**2 + 100 * x**4), end=c * v**2), 1.0, end={"x": 1}).cost / c
             for c in (1.0, 1e-18, 1e-36, 1e18)]
    assert max(costs) - min(costs) < 1e-9 * costs[0] and 10 < costs[0] < 20


def test_conditions_of_small_motions() -> None:
    """In units of nanometres: bounds, free duration, a path condition and an end that cannot be reached."""
    params, a = {"m": 1e-12, "k": 0}, 1e-9
    small = functools.partial(sd.optimize, sprung(), params=params, tolerance=None)
    force = 1e-12 * a / 1e-6  # over a in 2 ms
    found = small(sd.Loss(end=sd.t), (1e-4, 1e-2), end={"x": a, "x_dot": 0}, bounds={"F": (-force, force)})
    assert found.duration == pytest.approx(2e-3, rel=1e-5)
    v = sp.Symbol("x_dot")
    slow = small(EFFORT, 2e-3, end={"x": a, "x_dot": 0}, path=[v <= sp.Float(0.6e-6)])
    assert slow["x_dot"].max() == pytest.approx(0.6e-6, rel=1e-6)
    with pytest.raises(sd.NoOptimum, match=r"The nearest motion violates some: x = 1e-09 at t = 0.001 s is missed by 7.5e-10"):
        small(EFFORT, 1e-3, end={"x": a, "x_dot": 0}, bounds={"F": (-force, force)})


def test_free_parameter() -> None:
    """From rest to rest over d in T the effort is 12 m^2 d^2/T^3; with m^-2 as the cost of lightness m^4 = T^3/(12 d^2)."""
    for options in ({}, {"transcription": "radau"}, {"transcription": "shooting"}, {"method": "slsqp", "intervals": 4}):
        found = sd.optimize(slider(), sd.Loss(integral=F**2, end=sp.Symbol("m") ** -2), 2.0, end={"x": 1, "x_dot": 0},
                            parameters={"m": (0.1, 10)}, params={"m": 2}, **{"tolerance": None, **options})
        assert found.values["m"] == pytest.approx((8 / 12) ** 0.25, rel=1e-5 if "method" in options else 1e-7)
        assert found.cost == pytest.approx(2 * np.sqrt(1.5), rel=1e-7)
        assert found.params[slider().metadata.parameters.index("m")] == found.values["m"]


@pytest.mark.parametrize("transcription", ["hermite-simpson", "radau", "shooting"])
def test_free_duration_of_equations_that_depend_on_the_time(transcription: str) -> None:
    """x'' = F + t from rest to rest over 1 m, cost of F^2 and of the time. By F = a + b t the momentum is a T + (b + 1) T^2/2 = 0
    and the way a T^2/2 + (b + 1) T^3/6 = 1, so that the cost is a^2 T + a b T^2 + b^2 T^3/3 + 4 T, least in T."""
    x, force = sd.coordinates("x"), sd.inputs("F")
    system = sd.System("pushed")
    body = system.add_body("body", mass=1)
    slide = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=x))
    system.add_joint_force(slide, force + sd.t)
    found = sd.optimize(system.compile(backend="c"), sd.Loss(integral=F**2 + 4), (0.2, 5), end={"x": 1, "x_dot": 0},
                        tolerance=None, transcription=transcription)
    T = sp.Symbol("T", positive=True)
    b = -12 / T**3 - 1
    cost = sp.lambdify(T, (lambda a: a**2 * T + a * b * T**2 + b**2 * T**3 / 3 + 4 * T)(-(b + 1) * T / 2))
    exact = scipy.optimize.minimize_scalar(cost, bounds=(0.2, 5), method="bounded", options={"xatol": 1e-10})
    assert found.duration == pytest.approx(exact.x, rel=1e-6) and found.cost == pytest.approx(exact.fun, rel=1e-9)
    assert max(found.difference.values()) < 1e-6


@functools.cache
def bump(narrow: float, place: float) -> tuple[sp.Expr, float]:
    """Cost of a place, and the least cost of a motion over it in 1 s: by 2 x^(4) + g'(x) = 0, a boundary value problem."""
    x = sp.Symbol("x")
    cost = 10 * sp.exp(-sp.Float(narrow) * (x - sp.Float(place)) ** 2)
    g, slope = sp.lambdify(x, cost), sp.lambdify(x, cost.diff(x))
    t, way = np.linspace(0, 1, 401), np.polynomial.Polynomial([0, 0, 3, -2])
    exact = scipy.integrate.solve_bvp(lambda s, y: np.array([y[1], y[2], y[3], -slope(y[0]) / 2]),
                                      lambda a, b: np.array([a[0], a[1], b[0] - 1, b[1]]), t,
                                      np.array([way(t), *[way.deriv(k)(t) for k in (1, 2, 3)]]), tol=1e-6, max_nodes=20_000)
    assert exact.success
    s = np.linspace(0, 1, 100_001)
    y = exact.sol(s)
    return cost, float(np.trapezoid(y[2] ** 2 + g(y[0]), s))


@pytest.mark.every_value
@pytest.mark.parametrize("transcription", ["hermite-simpson", "radau", "shooting"])
@pytest.mark.parametrize(("narrow", "place"), [(2000, 0.43), (1e5, 0.437)])
def test_narrow_costs_are_integrated(transcription: str, narrow: float, place: float) -> None:
    """Where few points of the first mesh see what a place costs, or none."""
    expression, least = bump(narrow, place)
    g, s = sp.lambdify(sp.Symbol("x"), expression), np.linspace(0, 1, 100_001)
    solved = functools.partial(sd.optimize, slider(), sd.Loss(integral=F**2 + expression), 1.0, end={"x": 1, "x_dot": 0},
                               transcription=transcription)
    coarse, found = solved(tolerance=None, steps=1), solved()
    # Straight inputs of shooting cost more than any others.
    assert found.cost == pytest.approx(least, rel=5e-6 if transcription != "shooting" else 1e-5) and found.error <= 1e-6
    for one in (coarse, found):
        values = one.inputs_at(s)[:, 0] ** 2 + g(one.at(s)[:, 0])
        assert one.integrated_cost == pytest.approx(np.trapezoid(values, s), rel=1e-7)
        assert one.cost_difference == one.integrated_cost - one.cost
    assert abs(found.cost_difference) < 5e-6 * least and abs(found.simulated_cost - found.cost) < 5e-6 * least
    assert abs(coarse.cost_difference) > 1e-5 * least and coarse.error > 1e-6
    assert f"integrated along it the cost is {coarse.integrated_cost:.9g}" in str(coarse)


def test_path_and_boundary_conditions() -> None:
    x, v = sp.symbols("x x_dot")
    found = sd.optimize(slider(), EFFORT, 2.0, end={"x": 1, "x_dot": 0}, path=[v <= sp.Rational(6, 10), v * F <= 1], intervals=40,
                        tolerance=None)
    assert found["x_dot"].max() < 0.6 + 1e-7 and (found["x_dot"] * found["F"]).max() < 1 + 1e-7
    assert found.multipliers["x_dot <= 3/5"].max() > 0.1
    for transcription in ("radau", "hermite-simpson", "shooting"):  # a condition that holds the start alone
        held = sd.optimize(slider(), EFFORT, 2.0, start={"x": None}, end={"x": 1, "x_dot": 0}, boundary=[v + x <= 3],
                           path=[x <= sd.t - sp.Rational(1, 2)], tolerance=None, transcription=transcription)
        assert held["x"][0] < -0.5 + 1e-7 and "x_dot + x <= 3" not in held.multipliers
    around = sd.optimize(slider(), EFFORT, 1.0, start="free", tolerance=None,
                         boundary=[sp.Eq(sp.Symbol("x(0)") + 1, x), sp.Eq(sp.Symbol("x_dot(0)"), v), sp.Symbol("x(0)") >= 2])
    assert set(around.multipliers) == {"x(0) + 1 = x", "x_dot(0) = x_dot", "x(0) >= 2"}
    assert around["x"][-1] - around["x"][0] == pytest.approx(1) and around.cost < 1e-12 and around["x"][0] > 2 - 1e-7


@pytest.mark.parametrize("options", [{}, {"transcription": "radau"}, {"method": "slsqp", "intervals": 6},
                                     *swept([{"transcription": "shooting"}])])
def test_costs_by_functions(options: dict[str, Any]) -> None:
    """The same motion as by expressions, a free parameter and a free duration included."""
    x, v, m = sp.symbols("x x_dot m")

    def integral(t: float, x: np.ndarray, p: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        return p[0] * np.cosh(x[1]), np.array([0, p[0] * np.sinh(x[1])]), np.array([np.cosh(x[1])])

    def end(t: float, x: np.ndarray, p: np.ndarray) -> tuple[float, np.ndarray]:
        return 3 * (x[0] - 2) ** 4, np.array([12 * (x[0] - 2) ** 3, 0])

    known = sd.Loss(integral=F**2 + m * sp.cosh(v), end=3 * (x - 2) ** 4)
    found = [sd.optimize(slider(), cost, (0.5, 4), start={"x": 0.1}, end={"x_dot": 0}, parameters={"m": (0.5, 2)}, tolerance=None,
                         **options) for cost in (known, [EFFORT, sd.Loss(integral=integral), sd.Loss(end=end)])]
    rtol = 1e-4 if "method" in options else 1e-8
    assert found[1].cost == pytest.approx(found[0].cost, rel=rtol)
    assert np.abs(found[1].x - found[0].x).max() < 1e2 * rtol and abs(found[1].duration - found[0].duration) < 1e2 * rtol


def test_functions_that_are_not_finite() -> None:
    text = r"or its derivative, is not finite at the guess: the end of the cost of the loss is inf at t = 2 s; pass another guess"
    with pytest.raises(sd.EvaluationError, match=text):
        sd.optimize(slider(), sd.Loss(end=lambda t, x, p: (np.inf, x)), 2.0)
    # Steps that lead to where it is not are not taken.
    barrier = sd.Loss(end=lambda t, x, p: (-np.log(1.5 - x[0]) if x[0] < 1.5 else np.nan, np.array([1 / (1.5 - x[0]), 0.0])))
    found = sd.optimize(slider(), [EFFORT, barrier, sd.Loss(end=-20 * sp.Symbol("x"))], 2.0, end={"x_dot": 0}, tolerance=None)
    assert found["x"][-1] == pytest.approx(1.5 - 1 / (20 - 3 * found["x"][-1]), abs=1e-6)


def test_outputs_in_conditions_and_costs() -> None:
    """The tip of an arm, by the output and by hand."""
    module = sd.systems.two_link_arm().compile(backend="c")
    q1, q2, tau1, tau2 = sp.symbols("q1 q2 tau1 tau2")
    length = dict(zip(module.metadata.parameters, module.parameters(), strict=True))
    by_hand = [sum(float(length[f"l{k + 1}"]) * f(angle) for k, angle in enumerate((q1, q1 + q2))) for f in (sp.cos, sp.sin)]
    found = []
    for tip in (sp.symbols("tip[0] tip[1]"), by_hand):
        cost = sd.Loss(integral=tau1**2 + tau2**2 + 10 * tip[1] ** 2, end=tip[0] ** 2)
        found.append(sd.optimize(module, cost, 1.0, start={"q1": -1.5, "q2": 0.5}, end={"q1_dot": 0, "q2_dot": 0}, intervals=15,
                                 tolerance=None, boundary=[sp.Eq(tip[1], 0.3)], path=[tip[0] >= 0.2]))
    assert found[0].cost == pytest.approx(found[1].cost, rel=1e-9) and found[0].iterations == found[1].iterations
    tips = module.outputs(found[0].t, found[0].x)["tip"]
    assert tips[-1, 1] == pytest.approx(0.3, abs=1e-8) and tips[:, 0].min() == pytest.approx(0.2, abs=1e-7)


@pytest.mark.parametrize("transcription", ["hermite-simpson", "radau"])
def test_outputs_that_no_input_enters_hold_at_the_start(transcription: str) -> None:
    """The tip begins as high as it may; Radau's points leave the start out, where it would have been 3e-5 above."""
    tau1, tau2, across, height = sp.symbols("tau1 tau2 tip[0] tip[1]")
    arm = sd.systems.two_link_arm().compile(backend="c")
    found = sd.optimize(arm, sd.Loss(integral=tau1**2 + tau2**2 + 100 * (across - 1) ** 2), 0.3, tolerance=None,
                        start={"q1": (-1.5, 1.5), "q2": 0.5}, end={"q1": 0.1}, path=[height <= sp.Rational(3, 10)],
                        transcription=transcription)
    assert arm.outputs(found.t, found.x)["tip"][0, 1] == pytest.approx(0.3, abs=1e-7)


def _along_a_line(arm: Module, q0: np.ndarray, way: float, n: int = 12) -> float:
    """The least cost of a tip that moves along a horizontal line: over polynomials of its course, by inverse dynamics; n of these
    end 1e-5 above it."""
    p = arm.parameters()
    first, second = (float(p[arm.metadata.parameters.index(name)]) for name in ("l1", "l2"))
    t, w = np.polynomial.legendre.leggauss(60)
    t, w = (t + 1) / 2, w / 2
    polynomial = np.polynomial.Polynomial

    def tip(q: np.ndarray) -> np.ndarray:
        return np.stack([first * f(q[:, 0]) + second * f(q.sum(axis=1)) for f in (np.cos, np.sin)], axis=1)

    def slopes(q: np.ndarray) -> np.ndarray:
        x, y = tip(q).T
        both = q.sum(axis=1)
        return np.array([[-y, -second * np.sin(both)], [x, second * np.cos(both)]]).transpose(2, 0, 1)

    def torques(coefficients: np.ndarray) -> np.ndarray:
        free = np.polynomial.Chebyshev(coefficients, domain=[0, 1]).convert(kind=polynomial)
        course = polynomial([0, 0, 3, -2]) * way + polynomial([0, 0, 1, -2, 1]) * free
        wanted = tip(q0[None, :]) + np.stack([course(t), 0 * t], axis=1)
        q = np.tile(q0, (len(t), 1))
        for _ in range(30):
            q = q + np.linalg.solve(slopes(q), (wanted - tip(q))[:, :, None])[:, :, 0]
        assert np.abs(tip(q) - wanted).max() < 1e-12
        u = np.linalg.solve(slopes(q), np.stack([course.deriv()(t), 0 * t], axis=1)[:, :, None])[:, :, 0]
        both = u.sum(axis=1) ** 2
        turning = -np.stack([first * f(q[:, 0]) * u[:, 0] ** 2 + second * f(q.sum(axis=1)) * both for f in (np.cos, np.sin)],
                            axis=1)
        rates = np.linalg.solve(slopes(q), (np.stack([course.deriv(2)(t), 0 * t], axis=1) - turning)[:, :, None])[:, :, 0]
        x, none = np.hstack([q, u]), np.zeros((len(t), 2))
        idle, B = arm.evaluate("rhs", t, x, p, none)[:, 2:], arm.evaluate("jacobian_inputs", t, x, p, none)[:, 2:]
        tau = np.linalg.solve(B, (rates - idle)[:, :, None])[:, :, 0]
        return (np.sqrt(w)[:, None] * tau).ravel()

    return 2 * float(scipy.optimize.least_squares(torques, np.zeros(n), xtol=1e-12, ftol=1e-12, gtol=1e-12).cost)


def test_a_tip_on_a_line() -> None:
    """Under an equality of states Radau's method is taken; that of Hermite and Simpson ends 2 % above."""
    arm = sd.systems.two_link_arm().compile(backend="c")
    tau1, tau2, across, height = sp.symbols("tau1 tau2 tip[0] tip[1]")
    q0 = np.array([-1.2, 1.6])
    tip = arm.outputs(0, [*q0, 0, 0])["tip"]
    solved = functools.partial(sd.optimize, arm, sd.Loss(integral=tau1**2 + tau2**2), 1.0, start={"q1": q0[0], "q2": q0[1]},
                               end={"q1_dot": 0, "q2_dot": 0}, boundary=[sp.Eq(across, tip[0] - 0.15)],
                               path=[sp.Eq(height, sp.Float(tip[1]))])
    found, shot = solved(), solved(transcription="shooting", intervals=40)
    least = _along_a_line(arm, q0, -0.15)
    assert found.transcription == "Gauss-Radau of degree 4" and found.iterations < 30
    assert found.cost == pytest.approx(least, rel=2e-5) and shot.cost == pytest.approx(found.cost, rel=2e-6)
    text = (r"the cost is 5.9\d+ by the quadrature of the mesh, and 5.7\d+ integrated along the motion \(allowed is 0.01 .*leave "
            r"transcription out: inputs of Hermite and Simpson go to and fro under tip")
    with pytest.warns(sd.OptimumWarning, match=text):
        assert solved(transcription="hermite-simpson", tolerance=None).cost > 1.02 * least
    text = r"inputs converge by the first order alone with degree 3 under the condition tip\[1\]"
    with pytest.warns(sd.OptimumWarning, match=text):
        assert solved(transcription="radau", degree=3, tolerance=None).cost > 1.01 * least


def test_motions_that_differ_when_they_are_simulated_back() -> None:
    """An unstable motion on a coarse mesh."""
    text = r"simulated back by its inputs, q2_dot differs by \S+ from the motion found \(allowed is 0.01 .*pass a tolerance"
    with pytest.warns(sd.OptimumWarning, match=text):
        found = sd.optimize(cart_pole(), EFFORT, 2.0, **KELLY, intervals=10, tolerance=None)
    assert np.abs(found.simulated.x - found.x)[:, 3].max() == found.difference["q2_dot"] > 0.1
    with warnings.catch_warnings():
        warnings.simplefilter("error", sd.OptimumWarning)
        sd.optimize(cart_pole(), EFFORT, 2.0, **KELLY)


def test_a_linkage_between_two_positions() -> None:
    module = linkage()
    q = module.consistent({"q1": 0.5}, keep=["q1"])[0]
    options: dict[str, Any] = {"start": dict(zip(module.metadata.q, q, strict=True)), "end": {"q1": 2.5, "q1_dot": 0}}
    cost = sd.Loss(integral=sp.Symbol("tau") ** 2)
    found = [sd.optimize(module, cost, 1.0, **options, **more) for more in (
        {}, {"transcription": "radau", "degree": 4, "tolerance": 1e-8}, {"transcription": "shooting", "intervals": 40})]
    # The same motion of one degree of freedom with the angles in closed form, by CasADi: symdyn bench optimize.
    for one, rtol in zip(found, (1e-6, 1e-8, 2e-6), strict=True):
        assert one.cost == pytest.approx(338.8285472, rel=rtol) and one.iterations < 30
        ends = np.isin(one.t, one.breaks)
        assert np.abs(module.evaluate("C", one.t, one.x, one.params)[ends]).max() < 1e-9
        assert np.abs(module.evaluate("C_dot", one.t, one.x, one.params)[ends]).max() < 1e-9
        assert max(one.difference.values()) < 1e-4


def test_lengths_of_a_linkage_as_free_parameters() -> None:
    """Constraints depend on a free length: the motion closes with the one that is found."""
    module = linkage()
    q = module.consistent({"q1": 0.5}, keep=["q1"])[0]
    start: dict[str, Any] = {"q1": 0.5, "q1_dot": 0, **dict.fromkeys(("q2", "q3", "q2_dot", "q3_dot"))}
    found = sd.optimize(module, sd.Loss(integral=sp.Symbol("tau") ** 2), 1.0, start, {"q1": 2.5, "q1_dot": 0}, tolerance=1e-5,
                        parameters={"l2": (1.8, 2.2)}, guess=dict(zip(module.metadata.q, q, strict=True)) | {"q1": [0.5, 2.5]})
    fixed = sd.optimize(module, sd.Loss(integral=sp.Symbol("tau") ** 2), 1.0, start, {"q1": 2.5, "q1_dot": 0}, tolerance=1e-5,
                        params={"l2": found.values["l2"]}, guess=found)
    assert found.cost == pytest.approx(fixed.cost, rel=1e-6) and found.cost < 338.7
    assert np.abs(module.evaluate("C", found.t, found.x, found.params)[::2]).max() < 1e-9


def test_gait_of_a_biped() -> None:
    """Kelly (2017), section 6: the step repeats itself, the impact loses energy."""
    module, first = walking()
    assert first.iterations < 60
    assert np.abs(first.x[0, :5] - first.x[-1, 4::-1]).max() < 1e-7
    before, after = (module.evaluate("energy", 0.0, x, first.params)[0] for x in (first.x[-1], first.x[0]))
    assert 0.2 * before < after < before
    published = gait.step(module, intervals=10, transcription="radau", degree=4, tolerance=None, inputs={"u1": 0},
                          **gait.PUBLISHED)
    assert published.cost == pytest.approx(gait.PUBLISHED_COST, rel=2e-3) and published.iterations < 143


@pytest.mark.sweep
def test_both_transcriptions_find_the_gait_of_a_biped() -> None:
    module, first = walking()
    second = gait.step(module, intervals=10, transcription="radau", tolerance=1e-5)
    assert first.cost == pytest.approx(second.cost, rel=2e-5) and second.iterations < 60


def test_impact_of_the_biped_against_constraints_that_begin_to_hold() -> None:
    """The impact from momentum is that of a mechanism with free feet, one of which is held from now on."""
    q = np.array([-0.6, -0.5, 0.05, 0.7, -0.3])
    u = np.array([-1.2, -0.9, 0.3, 1.1, 0.4])
    symbols = {sp.Symbol(f"q{k + 1}"): v for k, v in enumerate(q)} | {sp.Symbol(f"q{k + 1}_dot"): v for k, v in enumerate(u)}
    after = sp.symbols("a1:6")
    impact = [c.subs({sp.Symbol(f"q{k + 1}_dot(0)"): a for k, a in enumerate(after)}).subs(symbols)
              for c in gait.boundary()[5:10]]
    left = sp.lambdify([after], [c.lhs - c.rhs for c in impact])  # linear in what comes after
    alone = np.array(left(np.zeros(5)), dtype=float)
    columns = np.array([left(e) for e in np.eye(5)], dtype=float).T - alone[:, None]
    found = np.linalg.solve(columns, -alone)  # of the new stance tibia first
    # By the least change of the velocities of all masses under the condition that the new foot stands (Gauss).
    G = sp.Matrix.vstack(*gait.points(sp.symbols("q1:6"))[1])
    names = sp.symbols("q1:6")
    at = dict(zip(names, q, strict=True))
    foot, centres = (np.array(e.jacobian(sp.Matrix(names)).subs(at), dtype=float) for e in (gait.points(names)[0][5], G))
    whole = np.hstack([np.tile(np.eye(2), (5, 1)), centres])  # by the velocity of the old foot and the rates
    M = whole.T @ np.diag(np.repeat(gait.MASSES, 2)) @ whole + np.diag([0, 0, *gait.INERTIAS])
    C = np.hstack([np.eye(2), foot])
    v = np.concatenate([[0, 0], u])
    v = v - np.linalg.solve(M, C.T @ np.linalg.solve(C @ np.linalg.solve(M, C.T), C @ v))
    assert np.abs(v[2:][::-1] - found).max() < 1e-12 * np.abs(found).max()


@functools.cache
def satellite() -> Module:
    T, p, w = sd.inputs("T1:4"), sd.coordinates("p0:4"), sd.speeds("w1:4")
    system = sd.System("satellite")
    body = system.add_body("body", mass=1, inertia=sp.diag(1, 2, 3))
    system.add_joint(sd.Spherical("pivot", system.ground, body, coordinates=p, speeds=w, orientation=sd.EulerParameters()))
    system.add_torque(body, T, frame=body)
    return system.compile(backend="c")


@pytest.mark.parametrize("options", [{}, {"transcription": "radau"}, *swept([{"transcription": "shooting", "intervals": 30}])])
def test_turn_of_a_body_in_euler_parameters(options: dict[str, Any]) -> None:
    """By 2 rad about a principal axis, from rest to rest: 12 I^2 theta^2/T^3; all four parameters are given at both ends."""
    module = satellite()
    cost = sd.Loss(integral=sum(e**2 for e in sp.symbols("T1:4")))
    end = dict(zip(module.metadata.x, [np.cos(1), 0, 0, np.sin(1), 0, 0, 0], strict=True))
    found = sd.optimize(module, cost, 2.0, start=[1, 0, 0, 0, 0, 0, 0], end=end, **options)
    assert found.cost == pytest.approx(12 * 3**2 * 2**2 / 2**3, rel=3e-6 if "intervals" not in options else 3e-3)
    assert np.abs((found.x[np.isin(found.t, found.breaks), :4] ** 2).sum(axis=1) - 1).max() < 1e-9
    assert found.iterations < 40 and max(found.difference.values()) < 1e-5


def test_solvers_of_scipy_agree() -> None:
    small: dict[str, Any] = {"intervals": 10, "tolerance": None}
    costs = {method: swing_up(method=method, **small).cost for method in ("ipopt", "slsqp", "trust-constr")}
    assert np.ptp(list(costs.values())) < 1e-6 * costs["ipopt"]
    assert np.isnan(swing_up(method="slsqp", **small).costates).all()
    difference = swing_up(method="trust-constr", **small).costates - swing_up(**small).costates
    assert np.abs(difference).max() < 1e-3 * np.abs(swing_up(**small).costates).max()


def test_warm_starts() -> None:
    found = swing_up(tolerance=1e-7)
    again = sd.optimize(cart_pole(), EFFORT, 2.0, **KELLY, guess=found, intervals=(found.breaks - found.t[0]) / found.duration,
                        tolerance=None)
    assert again.iterations <= 8 and again.cost == pytest.approx(found.cost, rel=1e-9)
    motion = cart_pole().simulate(np.linspace(0, 2, 41), found.x[0, :2], params=KELLY["params"], inputs=found.table)
    by_motion = swing_up(tolerance=None, intervals=30)
    other = sd.optimize(cart_pole(), EFFORT, 2.0, **KELLY, guess=motion, intervals=30, tolerance=None)
    assert other.cost == pytest.approx(by_motion.cost, rel=1e-8)
    arrays = {"t": found.t, "q2": found["q2"], "F": found["F"], "q1": 0.5}
    assert sd.optimize(cart_pole(), EFFORT, 2.0, **KELLY, guess=arrays, intervals=30,
                       tolerance=None).cost == pytest.approx(by_motion.cost, rel=1e-8)


def test_polynomials_go_through_nodes_and_fulfil_the_equations_there() -> None:
    for options in ({"tolerance": None, "intervals": 40}, {"tolerance": None, "transcription": "radau", "intervals": 40}):
        found = swing_up(**options)
        assert np.abs(found.at(found.t) - found.x).max() < 1e-9 and np.abs(found.inputs_at(found.t) - found.inputs).max() < 1e-12
        h, t = 1e-6, found.t[1:-1:2] if not options.get("transcription") else found.t[2:-1:3]
        rates = (found.at(t + h) - found.at(t - h)) / (2 * h)
        exact = cart_pole().evaluate("rhs", t, found.at(t), found.params, found.inputs_at(t))
        assert np.abs(rates - exact).max() < 1e-6 * np.abs(exact).max()


def test_a_disturbed_swing_up_ends_where_it_should_by_its_regulator() -> None:
    found = swing_up(tolerance=1e-6)
    regulator = found.lqr(Q=[1, 1, 0.1, 0.1], R=[0.01], Qf=[100, 100, 100, 100])
    start = found.x[0] + [0.1, 0.2, 0.1, -0.2]
    end = lambda inputs: cart_pole().simulate((0, 2), start[:2], start[2:], KELLY["params"], inputs=inputs, rtol=1e-6).x[-1]
    assert np.abs(end(sd.Sampled(regulator, 0.01)) - [1, 0, 0, 0]).max() < 5e-3
    assert np.abs(end(found.table) - [1, 0, 0, 0]).max() > 1  # without it
    assert repr(regulator) == "<Tracking of cart_pole from 0 to 2 s by F>"
    assert regulator(0.0, found.x[0]) == pytest.approx(found.inputs[0], abs=1e-9)


def test_what_is_printed_and_drawn(tmp_path: Any) -> None:
    found = swing_up(tolerance=1e-6)
    text = str(found)
    for part in ("cost 58.807", "Hermite-Simpson, 4 meshes", "simulated back", "iterations"):
        assert part in text
    assert repr(found) == text and found["q1"] is not None and found[F].shape == found.t.shape
    figure = found.plot(tmp_path / "swing.png")
    assert (tmp_path / "swing.png").stat().st_size > 10_000 and len(figure.axes) == 4
    assert [a.get_ylabel() for a in figure.axes] == ["coordinates", "speeds", "inputs", "error of an interval"]


def test_measurement_compared_with_plain_casadi(capsys: pytest.CaptureFixture[str]) -> None:
    """Minimum time: the same iterations and the same cost."""
    from symdyn.lab.optimize import run

    assert run(["minimum_time"]) == 0
    rows = {line.split("  ")[0]: line.split()[-1] for line in capsys.readouterr().out.splitlines() if "iterations" in line}
    assert rows["minimum time: iterations"] == rows["minimum time: iterations of CasADi"]
