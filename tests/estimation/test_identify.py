"""Inertial parameters from forces: known ones from noisy data against their covariance, physical consistency, what is open."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

import symdyn as sd
from symdyn.errors import ArgumentError, EvaluationError
from symdyn.estimation import pseudo_inertia as steps
from symdyn.estimation.pseudo_inertia import Chart, _At, is_consistent, nearest, parameters_of, pseudo_inertia
from tests.helpers import swept

T = np.linspace(0, 10, 301)
# Moments of inertia that a distribution of mass can have: the published I3_yy exceeds I3_xx + I3_zz, and link 1 has an inertia
# about one axis alone.
REAL = {"m1": 13.0, "I1_xx": 0.3, "I1_zz": 0.2, "I3_yy": 0.07}
NOISE = np.array([1.0, 1.0, 0.5, 0.1, 0.1, 0.05]) / 2
FULL = np.ones(6)


@cache
def robot() -> Any:
    return sd.systems.get("puma560", general=True).embedding().compile(backend="numpy")


@cache
def motion(seed: int = 1, moving: tuple[float, ...] = tuple(FULL)) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles, speeds and accelerations of a Fourier series over 10 s."""
    a = np.random.default_rng(seed).normal(size=(2, 5, 6)) * 0.4 * np.array(moving)
    w = 2 * np.pi * 0.1 * np.arange(1, 6)
    sin, cos = np.sin(np.outer(T, w)), np.cos(np.outer(T, w))
    return (sin @ a[0] + cos @ a[1], (cos * w) @ a[0] - (sin * w) @ a[1], -(sin * w**2) @ a[0] - (cos * w**2) @ a[1])


@cache
def forces(moving: tuple[float, ...] = tuple(FULL)) -> np.ndarray:
    q, u, ud = motion(1, moving)
    return robot().evaluate("inverse_dynamics", 0.0, np.hstack([q, u]), REAL, ud=ud)


def true(name: str) -> np.ndarray:
    return robot().evaluate(name, 0.0, np.zeros(12), REAL)


def nominal(seed: int) -> dict[str, np.ndarray]:
    """Inertias of bodies that are wrong by a fifth."""
    parts = np.random.default_rng(seed).uniform(0.8, 1.2, 6)
    bodies = true("inertial_parameters").reshape(6, 10)
    return {f"link{k + 1}": part * values for k, (part, values) in enumerate(zip(parts, bodies, strict=True))}


def measured(seed: int, noise: np.ndarray = NOISE, **more: Any) -> sd.MeasuredMotion:
    q, u, ud = motion()
    return sd.MeasuredMotion(T, q, forces() + noise * np.random.default_rng(seed).normal(size=q.shape), u, ud, **more)


def distance(found: Any, truth: np.ndarray, B: np.ndarray | None = None) -> float:
    """Distance of the values, or of B values, from the truth, squared, in units of the covariance."""
    B = np.eye(len(truth)) if B is None else B
    off = B @ np.array(list(found.values.values())) - truth
    return float(off @ np.linalg.solve(B @ found.covariance @ B.T, off))


def test_exact_values_without_noise() -> None:
    found = sd.identify(robot(), measured(0, 0 * NOISE))
    np.testing.assert_allclose(list(found.values.values()), true("base_parameters"), rtol=0, atol=1e-11)
    assert list(found.values)[:2] == ["I_zz_link1", "h_x_link2"] and found.undetermined == () and found.condition < 20


@pytest.mark.parametrize("seed", [None, 1])
def test_consistent_parameters_without_noise(seed: int | None) -> None:
    """Forces are met to rounding from nominal values that are right, which are kept, and that are wrong by a fifth."""
    right = dict(zip(robot().metadata.bodies, true("inertial_parameters").reshape(6, 10), strict=True))
    found = sd.identify(robot(), measured(0, 0 * NOISE), consistent=True, nominal=right if seed is None else nominal(seed))
    assert max(np.abs(left).max() for left in found.residuals) < 1e-14 * np.abs(forces()).max()
    assert all(is_consistent(np.array(list(found.body(body).values()))) for body in robot().metadata.bodies)
    if seed is None:
        np.testing.assert_allclose(list(found.values.values()), true("inertial_parameters"), rtol=0, atol=1e-12)


def test_covariance_against_many_repetitions() -> None:
    """Errors over 20 repetitions have the distribution that the covariance says, with known and with estimated noise."""
    truth, noise = true("base_parameters"), dict(zip(robot().metadata.u, NOISE, strict=True))
    known = [sd.identify(robot(), measured(seed), noise=noise) for seed in range(20)]
    sums = np.array([distance(found, truth) for found in known])
    least, most = chi2.ppf([0.001, 0.999], 20 * 36)
    assert least < sums.sum() < most and sums.max() < chi2.ppf(1 - 1e-5, 36)
    estimated = [sd.identify(robot(), measured(seed)) for seed in range(20)]
    np.testing.assert_allclose(np.mean([list(f.noise.values()) for f in estimated], axis=0), NOISE, rtol=0.02)
    assert least * 0.97 < sum(distance(found, truth) for found in estimated) < most * 1.03
    assert known[0].degrees == 6 * 301 - 36


@pytest.mark.parametrize("seeds", [range(5), *swept([range(5, 60)])], ids=str)
def test_consistent_parameters_are_no_farther_than_others(seeds: range) -> None:
    """The nearest point of a convex set that holds the truth is nearer to it than the nearest point anywhere."""
    noise = dict(zip(robot().metadata.u, NOISE, strict=True))
    q, u, ud = motion()
    at = np.hstack([q, u])
    Y, Yb = (robot().evaluate(name, 0.0, at, None, ud=ud).reshape(-1, n)
             for name, n in (("regressor", 60), ("base_regressor", 36)))
    B, truth = np.linalg.lstsq(Yb, Y, rcond=None)[0], true("base_parameters")
    for seed in seeds:
        found = sd.identify(robot(), measured(seed), noise=noise, consistent=True, nominal=nominal(seed))
        for body in robot().metadata.bodies:
            np.linalg.cholesky(found.pseudo_inertia(body))
            assert is_consistent(np.array(list(found.body(body).values())))
        assert distance(found, truth, B) < distance(sd.identify(robot(), measured(seed), noise=noise), truth) + 1
    assert len(found.undetermined) == 24 and found.consistent and "and 16 combinations more" in str(found)
    assert found.undetermined[0].startswith("1 ") or " 1 " in found.undetermined[0]


def test_combinations_without_data_stay_nominal() -> None:
    """One joint turns: base parameters of the others are open, and consistent ones those of the nominal bodies."""
    moving = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    q, u, ud = motion(1, moving)
    data = sd.MeasuredMotion(T, q, forces(moving), u, ud)
    found = sd.identify(robot(), data)
    assert {"1 I_yy_link6", "1 I_xz_link2"} < set(found.undetermined) and np.isnan(found.deviations["I_yy_link6"])
    sure = np.isfinite(list(found.deviations.values()))
    np.testing.assert_allclose(np.array(list(found.values.values()))[sure], true("base_parameters")[sure], atol=1e-9)
    assert len(found.undetermined) == 36 - np.linalg.matrix_rank(
        robot().evaluate("base_regressor", 0.0, np.hstack([q, u]), None, ud=ud).reshape(-1, 36), 1e-9)
    assert "not determined by the data: " in str(found)
    right = dict(zip(robot().metadata.bodies, true("inertial_parameters").reshape(6, 10), strict=True))
    kept = sd.identify(robot(), data, noise=0.1, consistent=True, nominal=right)
    np.testing.assert_allclose(list(kept.values.values()), true("inertial_parameters"), rtol=1e-8, atol=1e-10)


def test_noise_of_the_motion_and_friction() -> None:
    """Rows are weighted by what the noise of the motion makes of the forces; friction of every joint is linear as well."""
    q, u, ud = motion()
    viscous, coulomb = np.arange(1, 7) * 0.3, np.arange(6, 0, -1) * 0.2
    tau, sizes = forces() + viscous * u + coulomb * np.sign(u), (1e-5, 1e-3, 0.05)
    truth = np.concatenate([true("base_parameters"), viscous, coulomb])
    sums = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        noisy = [a + size * rng.normal(size=a.shape) for a, size in zip((q, u, ud), sizes, strict=True)]
        data = sd.MeasuredMotion(T, noisy[0], tau + NOISE * rng.normal(size=q.shape), *noisy[1:])
        found = sd.identify(robot(), data, noise=dict(zip(robot().metadata.u, NOISE, strict=True)), motion_noise=sizes,
                            friction=["viscous", "coulomb"])
        sums.append(distance(found, truth))
    least, most = chi2.ppf([0.001, 0.999], 20 * 48)
    assert least < sum(sums) < 1.1 * most
    assert found.values["viscous q2_dot"] == pytest.approx(0.6, abs=0.2) and list(found.values)[-1] == "coulomb q6_dot"


def test_angles_alone_pass_a_filter_and_are_differentiated() -> None:
    t = np.linspace(0, 20, 8001)
    w, rng = 2 * np.pi * np.array([0.3, 0.7, 1.1]), np.random.default_rng(3)
    arm = sd.systems.get("two_link_arm").embedding().compile(backend="numpy")
    names = arm.metadata.parameters
    a = rng.normal(size=(3, 2)) * 0.5
    q, u, ud = np.sin(np.outer(t, w)) @ a, np.cos(np.outer(t, w)) @ (a.T * w).T, -np.sin(np.outer(t, w)) @ (a.T * w**2).T
    inputs = arm.evaluate("inverse_dynamics", 0.0, np.hstack([q, u]), None, (), ud)
    inputs = inputs + 0.2 * rng.normal(size=inputs.shape)
    data = sd.MeasuredMotion(t, q + 1e-4 * rng.normal(size=q.shape), cutoff=5.0,
                             inputs=dict(zip(arm.metadata.inputs, inputs.T, strict=True)))
    found = sd.identify(arm, [data])
    truth = arm.evaluate("base_parameters", 0.0, np.zeros(4))
    for value, true_value, deviation in zip(found.values.values(), truth, found.deviations.values(), strict=True):
        assert abs(value - true_value) < 4 * deviation + 2e-3 * abs(true_value)
    np.testing.assert_allclose(list(found.noise.values()), 0.2, rtol=0.16)  # of some 180 independent values
    assert found.residuals[0].shape[0] < 800 and "m1" in names


def test_bregman_divergence_and_the_chart() -> None:
    rng = np.random.default_rng(1)
    points, masses = rng.normal(size=(9, 3)), rng.uniform(0.1, 1, 9)
    r = np.column_stack([points, np.ones(9)])
    J = (r.T * masses) @ r
    pi = parameters_of(J)
    inertia = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, points, strict=True))
    np.testing.assert_allclose(pi, [masses.sum(), *(masses @ points), *inertia[np.triu_indices(3)]])
    np.testing.assert_allclose(pseudo_inertia(pi), J)
    assert is_consistent(pi) and not is_consistent(pi * np.array([1, 1, 1, 1, 9, 1, 1, 1, 1, 1])) and not is_consistent(-pi)
    chart = Chart(pi)
    W = np.tril(rng.normal(size=(4, 4)) * 0.2) + np.eye(4)
    moved = pseudo_inertia(chart.parameters(chart.coordinates(W)))
    ratio = np.linalg.solve(J, moved)
    d = np.trace(ratio) - np.log(np.linalg.det(ratio)) - 4
    assert _At([W], np.zeros(0)).value(np.zeros((1, 10)), np.zeros(1), [chart], 2.0) == pytest.approx(2 * d, rel=1e-12)


def test_the_minimum_near_the_border(monkeypatch: pytest.MonkeyPatch) -> None:
    """One datum that asks for a mass far below zero: the gradient vanishes there, -A^T (A x - b) = w (1 - (1 + X)^-1)."""
    chart = Chart(parameters_of(np.diag([1.0, 2.0, 3.0, 4.0])))
    row = 1e3 * chart.T[:1] / np.linalg.norm(chart.T[0])
    x = nearest(row, np.array([-1e5]), [chart], 1e-3)
    X = np.tensordot(x, chart.basis, 1)
    assert 0 < np.linalg.eigvalsh(np.eye(4) + X)[0] < 1e-6
    of_data = np.tensordot(row[0] * (row[0] @ x + 1e5), chart.basis, 1)
    np.testing.assert_allclose(1e-3 * (np.linalg.inv(np.eye(4) + X) - np.eye(4)), of_data, rtol=1e-4, atol=1e-8)
    monkeypatch.setattr(steps, "MOST_STEPS", 2)
    with pytest.raises(EvaluationError, match="no inertial parameters found: Newton's method ended with the decrement squared"):
        nearest(row, np.array([-1e5]), [chart], 1e-3)


@pytest.mark.parametrize(("given", "text"), [
    ({"noise": {"q1": 1}}, "noise has 'q1', which is no speed"), ({"noise": 0}, "noise of q1_dot is 0; it must be a positive"),
    ({"motion_noise": (1, 1, 1)}, "motion_noise was given without noise"),
    ({"noise": 1, "motion_noise": 1}, "motion_noise is 1; pass deviations of q, of u and of ud"),
    ({"noise": 1, "motion_noise": (1, -1, 1)}, "motion_noise of u is -1; pass a number, or 6, none negative"),
    ({"friction": 3}, "friction is 3; pass a list of viscous and coulomb"),
    ({"consistent": True, "nominal": [1]}, r"nominal is \[1\]; pass a dictionary from bodies to ten numbers each"),
    ({"friction": ["dry"]}, "friction has 'dry'; there are viscous and coulomb"),
    ({"spread": 0}, "spread is 0; pass a positive number up to 100"),
    ({"nominal": {}}, "nominal inertias were given without consistent=True"),
    ({"consistent": True}, "no body can have the nominal inertia of link1, m = 0, .*its pseudo-inertia is not positive definite"),
    ({"consistent": True, "nominal": {"arm": []}}, "nominal has 'arm', which is no body; there are link1"),
    ({"consistent": True, "nominal": {"link1": [1]}}, r"nominal values of link1 have the shape \(1,\); pass ten finite numbers")])
def test_faults_of_what_is_asked(given: dict[str, Any], text: str) -> None:
    with pytest.raises(ArgumentError, match=text):
        sd.identify(robot(), measured(0), **given)


@pytest.mark.parametrize(("given", "text"), [
    ({"t": T[::-1]}, "t of motion 1 must be two or more finite times in increasing order"),
    ({"q": T}, r"q of motion 1 has the shape \(301,\); needed is \(301, 6\)"),
    ({"tau": np.full((301, 6), np.nan)}, "tau of motion 1 has the value nan for q1_dot at t = 0 s"),
    ({"q": {"q1": T, "r": T}}, "q of motion 1 has 'r', which is none of q1, .*q of motion 1 lacks q2"),
    ({"u": None}, "motion 1 has no u; give them, or a cutoff"),
    ({"cutoff": 99.0}, "cutoff of motion 1 is 99.0; pass a frequency between 0 and 15 Hz"),
    ({"cutoff": 0.3}, "motion 1 lasts 10 s, too short for the cutoff 0.3 Hz"),
    ({"t": T**1.1, "cutoff": 5.0}, "motion 1 has a cutoff, but its times are not equally spaced"),
    ({"params": [1]}, r"params of motion 1 are \[1\]; pass a dictionary from names to numbers"),
    ({"params": {"m9": 1}}, "there is no 'm9'")])
def test_faults_of_data(given: dict[str, Any], text: str) -> None:
    q, u, ud = motion()
    with pytest.raises(ArgumentError, match=text):
        sd.identify(robot(), sd.MeasuredMotion(**{"t": T, "q": q, "tau": forces(), "u": u, "ud": ud, **given}))


def test_other_faults() -> None:
    for function, given in ((sd.identify, (measured(0),)), (sd.fit, (None,)), (sd.optimize, (None, 1.0))):
        with pytest.raises(ArgumentError, match=rf"sd\.{function.__name__} needs a Module, found .*; compile it: sys"):
            function(sd.systems.pendulum(), *given)  # type: ignore[operator]
    with pytest.raises(ArgumentError, match=r"data is 3; pass an sd.MeasuredMotion or a list of them"):
        sd.identify(robot(), 3)  # type: ignore[arg-type]
    q, u, ud = motion()
    with pytest.raises(ArgumentError, match=r"36 unknowns are identified from 12 values; measure more"):
        sd.identify(robot(), sd.MeasuredMotion(T[:2], q[:2], forces()[:2], u[:2], ud[:2]))
    with pytest.raises(ArgumentError, match="motion_noise was given for a motion with a cutoff"):
        sd.identify(robot(), measured(0, cutoff=5.0), noise=1.0, motion_noise=(1, 1, 1))
    found = sd.identify(robot(), measured(0))
    with pytest.raises(ArgumentError, match=r"the parameters of body 'link1' were asked for, but base"):
        found.body("link1")
    system, n = sd.systems.pendulum(), sd.coordinates("n")
    system.add_state(n, -n)
    with_state, rows = system.embedding().compile(backend="numpy"), np.linspace(0, 1, 9)[:, None]
    rest = sd.MeasuredMotion(rows[:, 0], rows, rows, rows, rows)
    with pytest.raises(ArgumentError, match="motion 1 has no z, and the system has the extra states n; give them"):
        sd.identify(with_state, rest)
    assert len(sd.identify(with_state, replace(rest, z=rows)).values) == 2
    ball = sd.System("ball", gravity=[0, 0, -9.81])
    ball.add_joint(sd.Free("free", ball.ground, ball.add_body("body", 1, [1, 1, 1]), orientation=sd.EulerParameters()))
    with pytest.raises(ArgumentError, match=r"the speeds .* are not the rates of the coordinates in their order; give u and ud"):
        sd.identify(ball.embedding().compile(backend="numpy"), sd.MeasuredMotion(T, np.zeros((301, 7)), cutoff=1.0))
    consistent = sd.identify(robot(), measured(0), consistent=True, nominal=nominal(1))
    with pytest.raises(ArgumentError, match="there is no body 'arm'; there are link1"):
        consistent.body("arm")
    found = sd.identify(robot(), measured(0))
    assert "condition" in repr(found) and found.confidence()["h_x_link2"][0] < found.values["h_x_link2"]
