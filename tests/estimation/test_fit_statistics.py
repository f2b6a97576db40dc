"""Noise, priors, bounds and open combinations of fits, against closed forms: a body that falls is linear in what is fitted."""

from __future__ import annotations

import warnings
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq, lsq_linear

import symdyn as sd
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.runtime.building.compiler import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
T = np.linspace(0, 1, 101)
SIGMA = 0.01
# x = a k t^2/2 + v t + x_0: what a, v and x_0 do.
FALL = np.stack([T**2 / 2, T, np.ones_like(T)], axis=1)


@cache
def falling() -> Any:
    """x_ddot = a k - d x_dot - c x, whatever m is; the place in millimetres as well."""
    x = sd.coordinates("x")
    a, k, m, c, d = sd.parameters("a k m c d")
    system = sd.System("falling")
    body = system.add_body("body", mass=m)
    slide = system.add_joint(sd.Prismatic("slide", system.ground, body, x, axis=[1, 0]))
    system.add_joint_force(slide, m * (a * k - d * x.dot - c * x), name="drive")
    system.add_output("mm", 1000 * sd.position(body)[0])
    system.defaults = {a: 1.0, k: 1.0, m: 1.0, c: 0.0, d: 0.0}
    return system.embedding().compile()


def places(a: float = 3.0, v: float = 0.0, seed: int = 0, sigma: float = SIGMA) -> np.ndarray:
    return FALL @ [a, v, 0.0] + sigma * np.random.default_rng(seed).normal(size=len(T))


def test_priors_count_with_their_deviations_whatever_the_noise() -> None:
    """The noise is that which residuals about the posterior mean have by n less what they have determined of a."""
    y, A, (mean, deviation) = places(), FALL[:, 0], (2.0, 0.05)

    def posterior(sigma: float) -> tuple[float, float]:
        weight = A @ A / sigma**2 + 1 / deviation**2
        return (A @ y / sigma**2 + mean / deviation**2) / weight, weight**-0.5

    def left(sigma: float) -> float:
        value, spread = posterior(sigma)
        return float(np.sum((y - A * value)**2) / (len(y) - A @ A * spread**2 / sigma**2) - sigma**2)

    sigma = brentq(left, 0.5 * SIGMA, 2 * SIGMA, xtol=1e-14)
    for noise, expected in ((0.02, posterior(0.02)), (None, posterior(sigma))):
        found = sd.fit(falling(), sd.Experiment(T, {"x": y}), ["a"], priors={"a": (mean, deviation)}, noise=noise)
        assert (found.values["a"], found.deviations["a"]) == pytest.approx(expected, rel=1e-6)
    assert found.noise["x"] == pytest.approx(sigma, rel=1e-6) and found.success
    assert found.misfit == pytest.approx(1, rel=1e-6) and found.degrees == 100
    thousands = sd.fit(falling(), sd.Experiment(T, {"mm": 1000 * y}), ["a"], priors={"a": (mean, deviation)})
    assert (thousands.values["a"], thousands.deviations["a"]) == pytest.approx(posterior(sigma), rel=1e-6)
    assert thousands.noise["mm"] == pytest.approx(1000 * sigma, rel=1e-6)


def test_a_prior_alone_gives_its_own_deviation() -> None:
    y = places()
    for noise in (None, SIGMA):
        with pytest.warns(SimulationWarning, match="nothing in this motion depends on m"):
            found = sd.fit(falling(), sd.Experiment(T, {"x": y}), ["a", "m"], priors={"m": (1.2, 0.1)}, noise=noise)
        assert (found.values["m"], found.deviations["m"]) == pytest.approx((1.2, 0.1), rel=1e-9) and not found.undetermined
    with pytest.warns(SimulationWarning, match="nothing in this motion depends on m"):
        plain = sd.fit(falling(), sd.Experiment(T, {"x": places(sigma=0.0)}), ["a", "m"], priors={"m": (1.2, 0.1)})
    assert plain.deviations["m"] == pytest.approx(0.1, rel=1e-9)  # however exact the data are


def test_every_quantity_has_its_own_noise() -> None:
    """Two quantities with different units and noise, against weights that are estimated from the closed form; in any order."""
    one, other = places(seed=1), places(seed=2, sigma=10 * SIGMA)
    A, sigmas = FALL[:, :2], np.ones(2)
    for _ in range(60):
        information = sum(A.T @ A / s**2 for s in sigmas)
        value = np.linalg.solve(information, A.T @ (one / sigmas[0]**2 + other / sigmas[1]**2))
        shares = [np.trace(np.linalg.solve(information, A.T @ A)) / s**2 for s in sigmas]
        sigmas = np.array([np.sqrt(np.sum((y - A @ value)**2) / (len(T) - share))
                           for y, share in zip((one, other), shares, strict=True)])
    found = sd.fit(falling(), sd.Experiment(T, {"mm": 1000 * other, "x": one}), ["a"], ["x_dot"])
    assert list(found.values.values()) == pytest.approx(value, rel=1e-6)
    assert found.noise == pytest.approx({"x": sigmas[0], "mm": 1000 * sigmas[1]}, rel=1e-5)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(information), rtol=1e-5)
    assert found.degrees == 200 and "noise mm " in str(found)


def test_noise_that_values_cannot_say() -> None:
    text = "falling: the noise of mm cannot be estimated, since its values are no more than what they determine; pass noise"
    few, last = np.full((2, len(T)), np.nan)
    few[50:52], last[-1] = (0.5, 0.6), 1500.0
    with pytest.raises(ArgumentError, match=text):
        sd.fit(falling(), sd.Experiment(T, {"x": few, "mm": last}), ["a"], ["x_dot"])
    three = sd.fit(falling(), sd.Experiment(T[::50], {"x": [0.1, 0.6, 1.5]}), ["a"], ["x", "x_dot"])
    assert np.isnan(three.noise["x"]) and np.isnan(three.covariance).all() and three.degrees == 0
    assert list(three.values.values()) == pytest.approx(np.linalg.solve(FALL[::50], [0.1, 0.6, 1.5])[[0, 2, 1]], rel=1e-6)


def test_values_on_bounds_are_named_and_held() -> None:
    y = places(v=0.4, seed=3)
    expected = lsq_linear(FALL, y, ([-np.inf, -np.inf, -np.inf], [2.5, np.inf, np.inf]), method="bvls").x
    found = sd.fit(falling(), sd.Experiment(T, {"x": y}), ["a"], ["x", "x_dot"], bounds={"a": (0, 2.5)})
    assert found.success and found.at_bounds == ("a",) and found.values["a"] == 2.5 and "held by its bound: a" in str(found)
    assert [found.values[name] for name in ("x_dot(0)", "x(0)")] == pytest.approx(expected[1:], rel=1e-8)
    assert np.isnan(found.deviations["a"]) and found.degrees == 99
    B = FALL[:, [2, 1]]
    variance = np.sum((y - FALL @ expected)**2) / 99
    np.testing.assert_allclose(found.covariance[1:, 1:], variance * np.linalg.inv(B.T @ B), rtol=1e-6)
    both = sd.fit(falling(), sd.Experiment(T, {"x": y}), ["a"], ["x_dot"], bounds={"a": (0, 2.5), "x_dot(0)": (-1, 0.5)})
    assert both.at_bounds == ("a", "x_dot(0)") and list(both.values.values()) == [2.5, 0.5] and both.degrees == 101
    inside = sd.fit(falling(), sd.Experiment(T, {"x": y}), ["a"], ["x_dot"], bounds={"a": (0, 5)})
    assert not inside.at_bounds and np.isfinite(inside.covariance).all()


def test_what_cannot_be_known_leaves_the_others_as_they_are() -> None:
    experiment = sd.Experiment(T, {"x": places(v=0.3)})
    alone = sd.fit(falling(), experiment, ["a"], ["x_dot"])
    with pytest.warns(SimulationWarning, match="nothing in this motion depends on m"):
        found = sd.fit(falling(), experiment, ["m", "a"], ["x_dot"], start={"m": 1.7})
    assert found.values["m"] == 1.7 and found.undetermined == ("1 m",) and found.degrees == alone.degrees
    assert np.isnan(found.covariance[0]).all() and np.isnan(found.covariance[:, 0]).all()
    np.testing.assert_allclose(found.covariance[1:, 1:], alone.covariance, rtol=1e-6)


def test_open_combinations_stay_at_the_guess() -> None:
    """The data say a k: on that hyperbola the nearest to the guess, relative to it, has both larger by the same part."""
    y = places()
    product = float(FALL[:, 0] @ y / (FALL[:, 0] @ FALL[:, 0]))
    found = sd.fit(falling(), sd.Experiment(T, {"x": y}), ["a", "k"], start={"a": 1.0, "k": 0.5})
    part = np.sqrt(product / 0.5)
    assert found.values == pytest.approx({"a": part, "k": 0.5 * part}, rel=1e-6)
    assert found.undetermined in (("1 a - 1 k",), ("-1 a + 1 k",)) and np.isnan(found.covariance).all()
    assert np.sum(found.residuals[0, "x"]**2) == pytest.approx(np.sum((y - product * FALL[:, 0])**2), rel=1e-9)
    # a = 0.8 is in the way, where the sum of squares is as small: bounds hold, and the sum stays.
    bounded = sd.fit(falling(), sd.Experiment(T, {"x": y}), ["a", "k"], bounds={"a": (0.5, 1.2)}, start={"a": 1.0, "k": 0.5})
    assert 0.5 <= bounded.values["a"] <= 1.2 and bounded.values["a"] * bounded.values["k"] == pytest.approx(product, rel=1e-6)


def test_a_fit_that_finds_no_minimum_warns_at_the_line_of_the_caller() -> None:
    experiment = sd.Experiment(T, {"x": np.cos(2 * T)}, q=[1.0], params={"a": 0.0, "c": 4.0})
    for arguments, text in (
            ({"parameters": ["d"], "start": {"d": 5.0}, "max_steps": 1},
             "no minimum within 1 steps; pass a nearer start, or a larger max_steps"),
            ({"parameters": ["d"], "start": {"d": 1e8}, "method": "radau"},
             r"ended where the data say nothing, which is no minimum: d = 1e\+08 \+- \S+; give another start, or priors")):
        with pytest.warns(SimulationWarning, match="falling: the fit found no minimum: " + text) as given:
            found = sd.fit(falling(), experiment, **arguments)
        assert not found.success and {warning.filename for warning in given} == {__file__}


def test_warnings_of_runs_are_at_the_line_of_the_caller() -> None:
    with pytest.warns(SimulationWarning, match="nothing in this motion depends on m") as given:
        sd.fit(falling(), sd.Experiment(T, {"x": places()}), ["a", "m"])
    assert [warning.filename for warning in given] == [__file__]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(SimulationWarning, match="nothing in this motion depends on m"):
            sd.fit(falling(), sd.Experiment(T, {"x": places()}), ["a", "m"])
