"""Turbines with two and three blades over the speed of the rotor, against Lagrange's equations written down for them."""

from __future__ import annotations

import functools
import itertools
import math
from typing import Any

import numpy as np
import pytest
import scipy.integrate
import sympy as sp

import symdyn as sd
from tests.helpers import swept

# Nacelle on springs that let it tilt and yaw, overhang h, blades of point masses m at r on flap hinges at e with springs k_b.
DATA = {"I": 900.0, "k_t": 4.0e4, "k_y": 2.5e4, "h": 1.5, "e": 0.5, "r": 4.0, "m": 20.0, "k_b": 9.0e3}


@functools.cache
def turbine(n: int) -> Any:
    """The same as a System; the rotor turns about x."""
    tilt, yaw, psi = sd.coordinates("tilt yaw psi")
    p = dict(zip(DATA, sd.parameters(" ".join(DATA), positive=True), strict=True))
    s = sd.System(f"turbine_{n}", gravity=[0, 0, 0])
    table, nacelle = s.add_body("table"), s.add_body("nacelle", inertia=[p["I"]] * 3)
    hub = s.add_body("hub", inertia=[1, 0.5, 0.5])
    s.add_joint_force(s.add_joint(sd.Revolute("yaw bearing", s.ground, table, yaw, axis=[0, 0, 1])), -p["k_y"] * yaw)
    s.add_joint_force(s.add_joint(sd.Revolute("tilt hinge", table, nacelle, tilt, axis=[0, 1, 0])), -p["k_t"] * tilt)
    s.add_joint(sd.Revolute("shaft", nacelle, hub, psi, axis=[1, 0, 0], parent_point=[p["h"], 0, 0]))
    for k in range(n):
        b = sd.coordinates(f"b{k + 1}")
        blade = s.add_body(f"blade{k + 1}", mass=p["m"], com=[0, 0, p["r"]])
        turn = sd.rotation.about([1, 0, 0], 2 * sp.pi * k / n)
        hinge = sd.Revolute(f"hinge{k + 1}", hub, blade, b, axis=[0, 1, 0], parent_rotation=turn,
                            parent_point=list(turn * sp.Matrix([0, 0, p["e"]])))
        s.add_joint_force(s.add_joint(hinge), -p["k_b"] * b)
    s.defaults = {p[name]: value for name, value in DATA.items()}
    return s.embedding().compile(backend="numpy")


psi, W = sp.symbols("psi W")


def matrices(T: sp.Expr, V: sp.Expr, n: int) -> list[sp.Matrix]:
    """M, C, K of y1 to yn at psi, by expanding T and V to second order."""
    names, rates = sp.symbols(f"y1:{n + 1}"), sp.symbols(f"v1:{n + 1}")
    zero = dict.fromkeys([*names, *rates], 0)
    grad = [T.diff(rate) for rate in rates]
    M = sp.Matrix([[g.diff(rate) for rate in rates] for g in grad]).subs(zero)
    D = sp.Matrix([[g.diff(y) for y in names] for g in grad]).subs(zero)  # p = M v + D y + ...
    K = sp.Matrix([[V.diff(a).diff(b) - T.diff(a).diff(b) for b in names] for a in names]).subs(zero)
    # d/dt (M v + D y) - (D^T v - (K - V part) y) = 0
    return [M, M.diff(psi) * W + D - D.T, K + D.diff(psi) * W]


def of_nacelle_and_hub() -> list[sp.Matrix]:
    """M, C, K of tilt and yaw."""
    tilt, yaw, v_tilt, v_yaw = sp.symbols("y1 y2 v1 v2")
    T = (DATA["I"] + 0.5) / 2 * (v_tilt**2 + v_yaw**2)  # with the hub's across the shaft
    T += sp.Rational(1, 2) * (W - v_yaw * sp.sin(tilt)) ** 2  # the hub's inertia about the shaft
    return matrices(T, DATA["k_t"] / 2 * tilt**2 + DATA["k_y"] / 2 * yaw**2, 2)


@functools.cache
def of_a_blade() -> list[sp.Matrix]:
    """M, C, K of tilt, yaw and flap, for the blade at psi."""
    names, rates = sp.symbols("y1:4"), sp.symbols("v1:4")
    tilt, yaw, b = names
    spot = sp.Matrix([DATA["r"] * sp.sin(b), 0, DATA["e"] + DATA["r"] * sp.cos(b)])
    p = _about(2, yaw) * _about(1, tilt) * (sp.Matrix([DATA["h"], 0, 0]) + _about(0, psi) * spot)
    v = p.diff(psi) * W + sum((p.diff(y) * rate for y, rate in zip(names, rates, strict=True)), sp.zeros(3, 1))
    return matrices(DATA["m"] / 2 * v.dot(v), DATA["k_b"] / 2 * b**2, 3)


@functools.cache
def by_lagrange(n: int) -> Any:
    """M, C, K of tilt, yaw and n flaps: functions of (psi, W)."""
    found = [sp.diag(M, sp.zeros(n, n)) for M in of_nacelle_and_hub()]
    for k in range(n):
        places = list(enumerate([0, 1, 2 + k]))
        for whole, own in zip(found, of_a_blade(), strict=True):
            turned = own.subs(psi, psi + 2 * sp.pi * k / n)
            for (a, i), (b, j) in itertools.product(places, places):
                whole[i, j] += turned[a, b]
    return sp.lambdify((psi, W), [whole.tolist() for whole in found], cse=True)


def _about(axis: int, a: Any) -> sp.Matrix:
    c, s = sp.cos(a), sp.sin(a)
    return [sp.Matrix([[1, 0, 0], [0, c, -s], [0, s, c]]), sp.Matrix([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
            sp.Matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]])][axis]


def multipliers(n: int, W: float) -> np.ndarray:
    """Over one turn, by integration of Lagrange's linear equations."""
    functions, m = by_lagrange(n), n + 2

    def rates(t: float, x: np.ndarray) -> np.ndarray:
        M, C, K = np.array(functions(W * t, W), dtype=float)
        y, v = x.reshape(2, m, 2 * m)
        return np.concatenate([v, -np.linalg.solve(M, C @ v + K @ y)]).ravel()

    found = scipy.integrate.solve_ivp(rates, (0, 2 * math.pi / abs(W)), np.eye(2 * m).ravel(), "DOP853", rtol=1e-12, atol=1e-13)
    return np.linalg.eigvals(found.y[:, -1].reshape(2 * m, 2 * m))


def assert_alike(found: np.ndarray, expected: np.ndarray, bound: float) -> None:
    left = list(found)
    assert len(left) == len(expected)
    for value in expected:
        k = int(np.argmin(np.abs(np.array(left) - value)))
        assert abs(left.pop(k) - value) <= bound * max(1.0, abs(value))


@pytest.mark.every_value
@pytest.mark.parametrize("W", [*swept([1.5]), 6.0, 14.0])
@pytest.mark.parametrize("n", [2, 3])
def test_multipliers_over_a_turn_are_those_of_lagranges_equations(n: int, W: float) -> None:
    found = turbine(n).stability(fixed={"psi_dot": W})
    assert_alike(found.multipliers, multipliers(n, W), 1e-8)
    assert found.held == ("psi_dot",) and np.isclose(found.period, 2 * math.pi / W, rtol=1e-14)
    # Two blades leave the equations periodic, three do not.
    assert ("monodromy" in repr(found)) == (n == 2)


def test_two_blades_by_floquet_and_three_by_multiblade_coordinates_over_the_speed() -> None:
    """The collective flap, with which the nacelle does not move, is the same: lambda^2 = -(k_b / (m r^2) + W^2 (1 + e / r)).

    Three blades in named multi-blade coordinates, and without their names, give one diagram; two need Floquet theory.
    """
    speeds = np.array([2.0, 9.0])
    named = turbine(3).campbell("psi_dot", speeds, blades=[("b1", "b2", "b3")])
    unnamed = turbine(3).campbell("psi_dot", speeds)
    two = turbine(2).campbell("psi_dot", speeds)
    p = DATA
    for k, W in enumerate(speeds):
        assert_alike(np.sort(named.frequencies[k]), np.sort(unnamed.frequencies[k]), 1e-9)
        collective = math.sqrt(p["k_b"] / (p["m"] * p["r"] ** 2) + W**2 * (1 + p["e"] / p["r"])) / (2 * math.pi)
        assert np.isclose(named["b1 collective"][k], collective, rtol=1e-10)
        assert np.abs(two.frequencies[k] - collective).min() < 1e-8 * collective
        # With as much mass in the rotor frequencies in the fixed frame lie near each other, though not on each other.
        assert two.frequencies.shape == (2, 4) and named.frequencies.shape == (2, 5)
    assert named.frame == two.frame == "fixed"
    assert any("backward" in n for n in named.names) and any("forward" in n for n in named.names)
    assert all(found.verdict == "neutral" for found in (turbine(n).stability(fixed={"psi_dot": 5.3}) for n in (2, 3)))


@pytest.mark.sweep
def test_a_frequency_of_two_blades_is_that_of_the_nacelle() -> None:
    """A free motion that begins in one mode: the nacelle's tilt shows the frequency that is named, by its spectrum."""
    W = 5.0
    found = turbine(2).stability(fixed={"psi_dot": W})
    mode = max(found.modes, key=lambda m: abs(m.shape[turbine(2).metadata.u.index("tilt_dot")]))
    functions, m = by_lagrange(2), 4
    order = [turbine(2).metadata.u.index(u) for u in ("tilt_dot", "yaw_dot", "b1_dot", "b2_dot")]

    def rates(t: float, x: np.ndarray) -> np.ndarray:
        M, C, K = np.array(functions(W * t, W), dtype=float)
        return np.concatenate([x[m:], -np.linalg.solve(M, C @ x[m:] + K @ x[:m])])

    names = [turbine(2).metadata.u[k] for k in order]
    lin = turbine(2).linearize(turbine(2).equilibrium(fixed={"psi_dot": W}))
    right = mode.right
    start = np.array([right[lin.states.index(n)] for n in (*[n.removesuffix("_dot") for n in names], *names)])
    length, count = 200 * 2 * math.pi / W, 16384
    times = np.arange(count) * length / count
    motion = scipy.integrate.solve_ivp(rates, (0, length), start.real, "DOP853", times, rtol=1e-9, atol=1e-10).y[0]
    spectrum = np.abs(np.fft.rfft(motion * np.hanning(count)))
    assert abs(np.argmax(spectrum) / length - mode.damped_frequency) < 1.5 / length


@pytest.mark.sweep
def test_flap_and_lag_of_flexible_blades_under_their_weight() -> None:
    """The catalogue's turbine with blades that bend and a yaw drive. At a speed that the model prescribes: the motion found
    comes back
    in a simulation, and the multipliers are those of its neighbours, by differences of simulations. A speed that is held in the
    analysis gives the same multipliers, and frequencies that multi-blade coordinates name."""
    W = 1.2
    module = sd.systems.land_wind_turbine(rotor="prescribed", flexible="blades", wind=False).compile()
    params, period = {"Omega": W}, 2 * math.pi / W
    found = module.stability(params=params, period=period)
    assert found.kind == "periodic motion" and found.verdict == "stable" and found.held == ()
    n_q, start = len(module.metadata.q), found.motion[1][0]
    assert np.ptp(found.motion[1][:, module.metadata.q.index("blade1_edge1")]) > 0.1  # m, by weight

    def after_a_turn(x: np.ndarray) -> np.ndarray:
        return module.simulate((0, period), x[:n_q], x[n_q:], params, rtol=1e-11, atol=1e-13).x[-1]

    size = np.concatenate([np.ones(n_q), np.full(n_q, W)])
    assert np.abs(after_a_turn(start) - start).max() < 1e-8
    h, directions = 1e-4, np.eye(2 * n_q) * size
    columns = [(after_a_turn(start + h * d) - after_a_turn(start - h * d)) / (2 * h) / size[k] for k, d in enumerate(directions)]
    assert_alike(found.multipliers, np.linalg.eigvals(np.array(columns).T), 2e-6)

    free = sd.systems.land_wind_turbine(flexible="blades", wind=False).compile()
    held = free.stability(fixed={"azimuth_dot": W})
    assert_alike(held.multipliers, found.multipliers, 1e-8)
    sets = [[f"blade{k}_{shape}" for k in (1, 2, 3)] for shape in ("flap1", "edge1", "flap2")]
    diagram = free.campbell("azimuth_dot", [W], blades=sets)
    assert_alike(np.sort(diagram.frequencies[0]), np.sort([m.damped_frequency for m in held.modes]), 1e-7)
    assert {"blade1_flap1 collective", "blade1_edge1 collective"} <= set(diagram.names)
