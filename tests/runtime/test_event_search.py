"""Zeros found within long steps and at the start, against closed forms, by every method."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn import panels
from symdyn.errors import SimulationWarning
from symdyn.lab.events import COMPILED, SPAN, TOLERANCES, count, draw, measure, system
from tests.helpers import swept

G = 9.81
METHODS = [("c", method) for method in COMPILED] + [("c", "RK45"), ("numpy", "DOP853"), ("numpy", "Radau"), ("numpy", "LSODA")]
# Steps of one method in C and one of SciPy's, for what all methods share.
SHARED = [("c", "dop853"), ("c", "radau"), ("numpy", "DOP853")]


def thrown(**events: Any) -> Any:
    """A mass in free flight, modules by backend; events: value of the height y (a callable) with what add_event takes."""
    y = sd.coordinates("y")
    g = sd.parameters("g")
    s = sd.System("thrown", gravity=[0, -g])
    s.add_joint(sd.Prismatic("up", s.ground, s.add_body("mass", mass=1), y, axis=[0, 1]))
    for name, (value, options) in events.items():
        s.add_event(name, value(y), **{k: v(y) if callable(v) else v for k, v in options.items()})
    s.defaults = {g: G}
    equations = s.embedding()
    return {backend: equations.compile(backend=backend) for backend in ("c", "numpy")}


@pytest.fixture(scope="module")
def searched() -> Any:
    return thrown(waves=(lambda y: sp.sin(sd.t), {}), top=(lambda y: y - sp.Rational(499, 10), {"stop": True}))


@pytest.mark.parametrize(("backend", "method"), METHODS)
def test_every_zero_within_one_long_step_is_found(searched: Any, backend: str, method: str) -> None:
    """A free particle takes steps as long as the run."""
    run = searched[backend].simulate((0, 100), u=[1e-3], params={"g": 0}, method=method)
    np.testing.assert_allclose(run.events["waves"].t, np.pi * np.arange(1, 32), rtol=0, atol=1e-11)
    assert run.success


@pytest.mark.parametrize(("backend", "method"), METHODS)
def test_a_threshold_that_is_passed_twice_at_short_distance_ends_the_motion(searched: Any, backend: str, method: str) -> None:
    """50 m high, it is above 49.9 m for 0.29 s."""
    run = searched[backend].simulate((0, 6), u=[np.sqrt(2 * G * 50)], method=method, rtol=1e-9, events="top")
    assert run.t[-1] == pytest.approx((np.sqrt(2 * G * 50) - np.sqrt(2 * G * 0.1)) / G, abs=1e-7)
    assert run.message.startswith("event top ended the motion")


@pytest.mark.parametrize(("backend", "method"), swept(SHARED, *SHARED[:2]))
def test_what_varies_too_quickly_is_warned_of(backend: str, method: str) -> None:
    """A hundred thousand waves within a step, which stay above zero: whether they do is not resolved."""
    module = thrown(blur=(lambda y: sp.sin(100000 * sd.t) + sp.cos(100000 * sd.t) + sp.Rational(1414215, 1000000), {}))[backend]
    match = ("thrown: zeros of events may be missed: blur .from t = 0.0[0-9]* s on. varies so quickly within a step that 2048 "
             "divisions do not resolve it; give a max_step as short as its shortest wave")
    with pytest.warns(SimulationWarning, match=match):
        run = module.simulate((0, 10), u=[1e-3], params={"g": 0}, method=method)
    assert run.success and len(run.doubts) == 1


def test_what_stays_above_zero_by_the_ranges_of_its_arguments_is_not_searched() -> None:
    """The least of the sine is above zero: a step of an explicit method in which it waves a hundred thousand times is proved."""
    module = thrown(waves=(lambda y: sp.sin(100000 * sd.t) + sp.Rational(1000001, 1000000), {}))["c"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert module.simulate((0, 10), u=[1e-3], params={"g": 0}).success


@pytest.mark.parametrize("rtol", [1e-2, 1e-4, 1e-9])
@pytest.mark.parametrize("method", ["dop853", "bs54"])
def test_a_crossing_after_many_steps_that_were_not_searched_is_found(method: str, rtol: float) -> None:
    """Thrown up from the ground, it is back at -1 m, at 1 mm below its top twice, and never above that."""
    speed = np.sqrt(2 * G * 50)
    module = thrown(deep=(lambda y: y + 1, {}), high=(lambda y: y - sp.Rational(49999, 1000), {}),
                    over=(lambda y: y - sp.Rational(50001, 1000), {}))["c"]
    run = module.simulate((0, 10), u=[speed], rtol=rtol, method=method, max_step=0.01)
    above = np.sqrt(2 * 1e-3 / G)
    assert run.events["deep"].t == pytest.approx([(speed + np.sqrt(speed**2 + 2 * G)) / G], abs=1e-9)
    assert run.events["high"].t == pytest.approx([speed / G - above, speed / G + above], abs=1e-6)
    assert not len(run.events["over"].t)


def test_many_motions_warn_of_what_varies_too_quickly_by_their_numbers() -> None:
    module = thrown(blur=(lambda y: sp.sin(100000 * sd.t * y) + sp.cos(100000 * sd.t * y) + sp.Rational(1414215, 1000000),
                          {}))["c"]
    with pytest.warns(SimulationWarning, match="of 2 motions 1: thrown: zeros of events may be missed: blur"):
        many = module.simulate_batch(q=[[0.0], [1.0]], t=(0, 10), params={"g": 0})
    assert many.success.all() and many.note == (
        "1 of 2 motions one by one: quantities of their events vary too quickly to be resolved")


def bouncing(direction: int = -1) -> Any:
    return thrown(floor=(lambda y: y, {"direction": direction, "reset": lambda y: {y.dot: -y.dot / 2}}))


@pytest.fixture(scope="module")
def floor() -> Any:
    return bouncing()


@pytest.mark.parametrize(("backend", "method"), METHODS)
def test_a_ball_on_the_floor_that_moves_down_bounces(floor: Any, backend: str, method: str) -> None:
    run = floor[backend].simulate((0, 0.18), q=[0.0], u=[-1.0], method=method, rtol=1e-10, steps=True)
    flights = 1 / G * 0.5 ** np.arange(3)  # 2 v / g, v = 1/2, 1/4, 1/8
    np.testing.assert_allclose(run.events["floor"].t, np.append(0.0, np.cumsum(flights)), rtol=0, atol=1e-8)
    assert run.events["floor"].x[0].tolist() == [0.0, -1.0]
    assert run.t[:2].tolist() == [0.0, 0.0] and run["y_dot"][:2].tolist() == [-1.0, 0.5] and (run["y"] > -1e-12).all()


@pytest.mark.parametrize(("backend", "method"), SHARED)
def test_a_ball_on_the_floor_that_moves_up_starts_without_an_event(floor: Any, backend: str, method: str) -> None:
    run = floor[backend].simulate((0, 0.15), q=[0.0], u=[0.5], method=method, rtol=1e-10)
    assert run.events["floor"].t == pytest.approx([1 / G], abs=1e-10)


@pytest.mark.parametrize(("backend", "method"), METHODS)
def test_a_ball_that_rests_on_the_floor_does_not_fall_through(floor: Any, backend: str, method: str) -> None:
    """It leaves zero downwards, by its acceleration alone; the reset of a speed that is 0 does not keep it."""
    with pytest.warns(SimulationWarning, match="stopped at t = 0: [2-9] events, floor the last, with hardly any time between: "
                                               "its reset leads back to it, or the motion comes to rest there"):
        run = floor[backend].simulate((0, 1), q=[0.0], u=[0.0], method=method)
    assert not run.success and abs(run["y"][-1]) < 1e-12


@pytest.mark.parametrize(("backend", "method"), SHARED)
def test_an_impact_without_rebound_does_not_fall_through(backend: str, method: str) -> None:
    module = thrown(floor=(lambda y: y, {"direction": -1, "reset": lambda y: {y.dot: 0}}))[backend]
    with pytest.warns(SimulationWarning, match=r"events, floor the last, with hardly any time between"):
        run = module.simulate((0, 1), q=[1.0], method=method, rtol=1e-9)
    assert run.t[-1] == pytest.approx(np.sqrt(2 / G), abs=1e-8) and abs(run["y"][-1]) < 1e-12


@pytest.mark.parametrize(("backend", "method"), SHARED)
def test_without_a_direction_zero_at_the_start_is_no_event(backend: str, method: str) -> None:
    """A motion that begins where an event ended another goes on; one thrown from the floor comes back to it."""
    module = thrown(floor=(lambda y: y, {"stop": True}))[backend]
    run = module.simulate((0, 5), q=[0.0], u=[G], method=method, rtol=1e-9)
    assert run.t[-1] == pytest.approx(2.0, abs=1e-8)


@pytest.fixture(scope="module")
def levels() -> Any:
    return thrown(up=(lambda y: y - 1, {"direction": 1}), down=(lambda y: y - 1, {"direction": -1}))


@pytest.mark.parametrize(("backend", "method"), METHODS)
def test_directions_are_those_of_the_course_of_the_run(levels: Any, backend: str, method: str) -> None:
    """Up through 1 m and down again; backward from where it lands it rises through 1 m where it fell forward."""
    v = np.sqrt(2 * G * 2)
    rises, falls = (v - np.sqrt(2 * G)) / G, (v + np.sqrt(2 * G)) / G
    forward = levels[backend].simulate((0, 2 * v / G), u=[v], method=method, rtol=1e-9)
    backward = levels[backend].simulate((2 * v / G, 0), q=[0.0], u=[-v], method=method, rtol=1e-9)
    for run, up, down in ((forward, rises, falls), (backward, falls, rises)):
        assert run.events["up"].t == pytest.approx([up], abs=1e-7)
        assert run.events["down"].t == pytest.approx([down], abs=1e-7)


@pytest.mark.parametrize(("backend", "method"), SHARED)
def test_zero_at_the_start_of_a_backward_run_counts_in_the_direction_of_the_run(levels: Any, backend: str, method: str) -> None:
    """Backward in time, a mass that falls through 1 m at t = 0 rises from there."""
    run = levels[backend].simulate((0, -0.1), q=[1.0], u=[-3.0], method=method)
    assert run.events["up"].t.tolist() == [0.0] and len(run.events["down"].t) == 0


@pytest.mark.parametrize(("backend", "method"), SHARED)
@pytest.mark.parametrize("direction", [-1, 0, 1])
def test_a_value_that_stays_at_zero_or_elsewhere_is_no_event(backend: str, method: str, direction: int) -> None:
    """By its parameters, or as the motion does not change it."""
    g, options = sd.parameters("g"), {"direction": direction}
    module = thrown(flat=(lambda y: g * y, options), still=(lambda y: y, options), high=(lambda y: y - 2, options))[backend]
    run = module.simulate((0, 10), params={"g": 0}, method=method)
    assert run.success and not any(len(rows.t) for rows in run.events.values()) and not run.doubts


@pytest.mark.parametrize(("backend", "method"), swept(SHARED, *SHARED[:2]))
def test_random_quantities_have_no_zero_missed(backend: str, method: str) -> None:
    """Sums of sines, pairs of zeros down to 1e-9 of the span apart, thresholds touched from below."""
    module = system().embedding().compile(backend=backend)
    for _, rtol, kind, of in measure({backend: module}, [method], [3]):
        assert of.zeros > 0 and (of.missed, of.superfluous, of.warned) == (0, 0, 0), (rtol, kind)


@pytest.mark.parametrize(("backend", "method"), swept(SHARED, *SHARED[:2]))
def test_a_threshold_that_is_hardly_reached_is_passed_once_each_way(backend: str, method: str) -> None:
    """By no more than some thousand units of the last place, so that rounding of the sine passes zero again and again."""
    w, p = sd.parameters("w p")
    module = thrown(near=(lambda y: sp.sin(w * sd.t + p) - 1 + sp.Rational(3, 10**12), {}))[backend]
    rng = np.random.default_rng(5)
    for _ in range(10):
        frequency, phase = rng.uniform(1, 20), rng.uniform(0.5, 1.5)
        run = module.simulate((0, 2 * np.pi * 10 / frequency), params={"g": 0, w: frequency, p: phase}, method=method, rtol=1e-4)
        tops = (np.pi / 2 - phase + 2 * np.pi * np.arange(10)) / frequency
        half = np.sqrt(6e-12) / frequency
        np.testing.assert_allclose(run.events["near"].t, np.sort([*(tops - half), *(tops + half)]), rtol=0, atol=1e-10)


def test_zeros_of_the_sweep_are_zeros() -> None:
    """Zeros of the polynomials and the touching sine by their values next to them."""
    for seed in range(4):
        drawn = draw(seed, TOLERANCES[0])
        p = drawn.params
        for zero in drawn.zeros["touching"]:
            value = [np.sin(p["f"] * (zero + s) + p["g"]) - 1 + p["d"] for s in (-1e-9, 1e-9)]
            assert value[0] * value[1] < 0 or p["d"] < 1e-12
        assert (np.diff(drawn.zeros["doubles"]) > 0).all() and (drawn.zeros["doubles"] < SPAN).all()
    assert count(np.array([1.0, 2.0, 2.5]), np.array([1.0, 2.0, 3.0]), 0.1) == type(count(np.zeros(0), np.zeros(0), 1.0))(3, 1, 1)


def test_the_test_of_panels_is_right_for_polynomials() -> None:
    """Values, slopes and the check point are exact for what a panel can represent."""
    x = 2 * panels.NODES - 1
    polynomial = np.polynomial.Chebyshev([3.0, -1.0, 0.5, 0.25, -0.125, 0.0625, 0.03, 0.01])
    samples = polynomial(x)
    np.testing.assert_allclose(panels.COEFFICIENTS @ samples[:panels.N], polynomial.coef, atol=1e-14)
    np.testing.assert_allclose(panels.SLOPES @ samples[:panels.N], polynomial.deriv().coef, atol=1e-12)
    assert panels.AT_CHECK @ samples[:panels.N] == pytest.approx(samples[panels.N], abs=1e-14)
    quantities = np.array([2 + 0 * x, x, x**2 - 0.01, x**2 + 1.5, np.sin(40 * x) + 1.5, 0 * x]).T
    assert panels.undecided(quantities).tolist() == [False, False, True, False, True, False]
