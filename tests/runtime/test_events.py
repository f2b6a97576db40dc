"""Events against closed forms and against motions that were looked at afterwards, in compiled runs and in SciPy's."""

from __future__ import annotations

import functools
import warnings
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.special import ellipk

import symdyn as sd
from symdyn.errors import ArgumentError, SimulationWarning
from tests.helpers import swept

G, E = 9.81, 0.8


def ball() -> sd.System:
    """A ball that bounces; sideways it is driven, and a state counts the bounces."""
    y, x, n = sd.coordinates("y x n")
    m, g, e = sd.parameters("m g e", positive=True)
    push = sd.inputs("push")
    s = sd.System("ball", gravity=[0, -g])
    carrier, body = s.add_body("carrier"), s.add_body("ball", mass=m)
    s.add_joint(sd.Prismatic("fall", s.ground, carrier, y, axis=[0, 1]))
    aside = s.add_joint(sd.Prismatic("aside", carrier, body, x, axis=[1, 0]))
    s.add_joint_force(aside, push, name="push")
    s.add_state(n, 0)
    s.add_event("bounce", sd.position(body)[1], direction=-1, reset={y.dot: -e * y.dot, n: n + 1})
    s.add_event("top", y.dot, direction=-1)
    s.add_event("either", x - sp.Rational(1, 2))
    s.add_event("late", sd.t - sp.Rational(7, 2), stop=True)
    s.defaults, s.initial = {m: 1, g: G, e: E}, {y: 1}
    return s


def bounces(n: int) -> np.ndarray:
    """Times of the first n bounces from a height of 1 m."""
    fall = np.sqrt(2 / G)
    return fall + 2 * fall * np.concatenate([[0.0], np.cumsum(E ** np.arange(1, n))])


@pytest.fixture(scope="module")
def modules() -> dict[str, Any]:
    equations = ball().embedding()
    return {backend: equations.compile(backend=backend) for backend in ("c", "numpy")}


METHODS = [("c", "dop853"), ("c", "Radau"), ("numpy", "DOP853"), ("numpy", "RK45"), ("numpy", "LSODA")]


@pytest.mark.parametrize(("backend", "method"), METHODS)
def test_bouncing_ball(modules: dict[str, Any], backend: str, method: str) -> None:
    run = modules[backend].simulate((0, 3.0), method=method, rtol=1e-10, events=["bounce", "top"])
    tolerated = 1e-13 if method != "LSODA" else 1e-8
    assert run.success and set(run.events) == {"bounce", "top", "either", "late"}
    found, x = run.events["bounce"]
    np.testing.assert_allclose(found, bounces(7)[bounces(7) < 3], rtol=0, atol=tolerated)
    np.testing.assert_allclose(x[:, 2], -np.sqrt(2 * G) * E ** np.arange(len(found)), rtol=100 * tolerated)
    np.testing.assert_array_equal(np.round(x[:, 4]), np.arange(len(found)))  # before the reset that counts it
    tops = np.append(0.0, bounces(7)[:-1] + np.diff(bounces(7)) / 2)  # it is let go at a top
    np.testing.assert_allclose(run.events["top"].t, tops[tops < 3], rtol=0, atol=10 * tolerated)
    assert len(run.events["either"].t) == len(run.events["late"].t) == 0


@pytest.mark.parametrize(("backend", "method"), METHODS[:3])
def test_stop_inputs_and_work(modules: dict[str, Any], backend: str, method: str) -> None:
    run = modules[backend].simulate(method=method, t=(0, 5), inputs={"push": 0.5}, work=True, rtol=1e-11)
    assert run.success and run.message == "event late ended the motion at t = 3.5 s"
    assert run.t[-1] == pytest.approx(3.5, abs=1e-14) and (run.t[:-1] < 3.5).all()
    aside = run.events["either"]
    assert aside.t == pytest.approx([np.sqrt(2.0)], abs=1e-12) and aside.x.shape == (1, 5)
    assert run.work[-1] == pytest.approx(0.5 * 0.25 * 3.5**2, rel=1e-10)  # the work goes on through the bounces


def test_steps_have_the_states_before_and_after(modules: dict[str, Any]) -> None:
    for backend, method in METHODS[:3]:
        run = modules[backend].simulate((0, 1.0), steps=True, method=method)
        twice = np.flatnonzero(np.diff(run.t) == 0)
        assert len(twice) == 1 and run.t[twice[0]] == pytest.approx(bounces(1)[0], abs=1e-12)
        before, after = run.x[twice[0]], run.x[twice[0] + 1]
        assert after[2] == -E * before[2] and after[4] == before[4] + 1 and (after[[0, 1, 3]] == before[[0, 1, 3]]).all()


def test_output_times_do_not_change_the_events(modules: dict[str, Any]) -> None:
    few, many = (modules["c"].simulate(np.linspace(0, 3, n), events="bounce") for n in (2, 5001))
    np.testing.assert_array_equal(few.events["bounce"].t, many.events["bounce"].t)
    np.testing.assert_array_equal(few.x[-1], many.x[-1])


def test_without_events_nothing_is_looked_for(modules: dict[str, Any]) -> None:
    run = modules["c"].simulate((0, 5.0), events=False)
    assert run["y"][-1] == pytest.approx(1 - G * 12.5) and not any(len(e.t) for e in run.events.values())


@pytest.mark.parametrize(("backend", "method"), swept(METHODS[:4], METHODS[0]))
def test_bounces_without_end_stop_with_the_reason(modules: dict[str, Any], backend: str, method: str) -> None:
    with pytest.warns(SimulationWarning, match="ball: stopped at t = 4.06371.*5 events, bounce the last, with hardly any time"):
        run = modules[backend].simulate((0, 5.0), method=method, rtol=1e-10, events=["bounce"])
    assert not run.success and abs(run["y"][-1]) < 1e-12 and len(run.events["bounce"].t) > 80  # more than the 64 that wait in C


def test_unknown_event(modules: dict[str, Any]) -> None:
    with pytest.raises(ArgumentError, match="ball: events bouncy asked for; there are bounce, top, either, late"):
        modules["numpy"].simulate(events=["bouncy"])


def swinging() -> Any:
    """A pendulum that says when it is upright below, and how fast, forward and backward in time."""
    s = sd.systems.get("pendulum")
    q = next(iter(s.check().coordinates))
    s.add_event("below", sp.sin(q))
    s.add_event("rightwards", q, direction=1)
    return s, q


def test_pendulum_by_its_elliptic_period() -> None:
    s, _ = swinging()
    module = s.embedding().compile(backend="c")
    # The period follows from the first integral for any parameters of the pendulum.
    rates = [module.rhs(0.0, [a, 0.0])[1] for a in (0.5, 1.0)]
    omega = np.sqrt(-rates[0] / np.sin(0.5))
    assert -rates[1] / np.sin(1.0) == pytest.approx(omega**2, rel=1e-14)
    period = 4 * ellipk(np.sin(0.5) ** 2) / omega
    run = module.simulate((0, 20 * period), q=[1.0], u=[0.0], rtol=1e-12)
    np.testing.assert_allclose(run.events["below"].t, period * (0.25 + 0.5 * np.arange(40)), rtol=1e-10)
    np.testing.assert_array_equal(run.events["rightwards"].t, run.events["below"].t[1::2])
    back = module.simulate((0, -2 * period), q=[1.0], u=[0.0], rtol=1e-12)
    np.testing.assert_allclose(back.events["below"].t, -period * (0.25 + 0.5 * np.arange(4)), rtol=1e-10)


@pytest.mark.parametrize("method", swept(["dop853", "Radau"], "dop853"))
def test_loop_and_reset_that_is_projected(method: str) -> None:
    """A four-bar whose crank is braked to half its speed whenever it passes a right angle: the loop stays closed."""
    s = sd.systems.get("four_bar")
    q1 = s.check().coordinates[0]
    s.add_event("pass", sp.cos(q1), reset={q1.dot: q1.dot / 2})
    module = s.augmented().compile(backend="c")
    run = module.simulate((0, 2.0), method=method, rtol=1e-9)
    assert len(run.events["pass"].t) >= 1 and np.abs(np.cos(run.events["pass"].x[:, 0])).max() < 1e-12
    assert np.abs(run.constraint_violation).max() < 1e-11 and np.abs(run.velocity_violation).max() < 1e-11
    without = module.simulate((0, float(run.events["pass"].t[0])), method=method, rtol=1e-9, events=False)
    np.testing.assert_allclose(run.events["pass"].x[0], without.x[-1], rtol=1e-7)
    energy = run.energy - run.energy[0]
    assert energy[-1] < -1e-3 * np.abs(run.energy).max()  # lost at the resets only
    before = run.t < run.events["pass"].t[0]
    assert np.abs(energy[before]).max() < 1e-6 * np.abs(run.energy).max()


@pytest.fixture(scope="module")
def strange() -> dict[str, Any]:
    """The pendulum with the logarithm of its angle, which is no number once it has passed below."""
    s, q = swinging()
    s.add_event("strange", sp.log(q))
    equations = s.embedding()
    return {backend: equations.compile(backend=backend) for backend in ("c", "numpy")}


UNKNOWN = [("c", "dop853"), ("c", "radau"), ("c", "RK45"), ("numpy", "DOP853")]


@pytest.mark.parametrize(("backend", "method"), UNKNOWN)
def test_an_event_that_is_not_finite_ends_the_run_where_it_was_known(backend: str, method: str, strange: Any) -> None:
    """The state that is reported is one of the motion, before the angle is 0."""
    for steps in (True, False):
        with pytest.warns(SimulationWarning, match=r"pendulum: stopped at t = 0\.5\d*: event strange cannot be evaluated: the "
                                                   r"result is not finite; the state there: q1 = "):
            run = strange[backend].simulate((0, 5), q=[1.0], u=[0.0], method=method, steps=steps, rtol=1e-9)
        assert not run.success and (np.diff(run.t) > 0).all() and 0 < run.q[-1, 0] < 0.2
        exact = strange["c"].simulate(np.array([0.0, run.t[-1]]), q=[1.0], u=[0.0], events=False, rtol=1e-12)
        np.testing.assert_allclose(run.x[-1], exact.x[-1], rtol=0, atol=1e-6)


@pytest.mark.parametrize(("backend", "method"), UNKNOWN)
def test_an_event_that_is_not_finite_but_not_looked_for_does_not_matter(backend: str, method: str, strange: Any) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = strange[backend].simulate((0, 2), q=[1.0], u=[0.0], method=method, events=["below"])
    free = strange[backend].simulate((0, 2), q=[1.0], u=[0.0], method=method, events=False)
    assert run.success and len(run.events["below"].t) >= 2 and len(run.events["strange"].t) == 0
    np.testing.assert_allclose(run.x[-1], free.x[-1], rtol=0, atol=1e-5)


@pytest.mark.parametrize("declared", ["ab", "ba"])
def test_resets_of_two_events_at_once_are_made_in_the_order_of_declaration(declared: str) -> None:
    """Both are computed from the state before, u = 1; what both set is as the last has it."""
    y, n = sd.coordinates("y n")
    s = sd.System("twice")
    s.add_joint(sd.Prismatic("along", s.ground, s.add_body("block", mass=1), y, axis=[1, 0]))
    s.add_state(n, 0)
    resets = {"a": {y.dot: 2 * y.dot, n: y.dot}, "b": {y.dot: 3 * y.dot}}
    for name in declared:
        s.add_event(name, y - 1, direction=1, reset=resets[name])
    s.initial = {y.dot: 1}
    equations = s.embedding()
    for backend, method in METHODS[:4]:
        run = equations.compile(backend=backend).simulate((0, 2), method=method)
        assert run.events["a"].t == pytest.approx([1.0]) and run.events["b"].t == pytest.approx([1.0])
        assert run.x[-1] == pytest.approx([1 + (3 if declared == "ab" else 2), 3 if declared == "ab" else 2, 1])


def test_what_passes_zero_as_another_event_stops_it_has_passed() -> None:
    """y = t/2 + t^2/2 is stopped at t = 1, where it passes 1, and goes on as 1 + (t - 1)^2/2."""
    y = sd.coordinates("y")
    s = sd.System("stopped")
    body = s.add_body("block", mass=1)
    s.add_joint_force(s.add_joint(sd.Prismatic("along", s.ground, body, y, axis=[1, 0])), 1)
    s.add_event("brake", sd.t - 1, reset={y.dot: 0})
    s.add_event("passes", y - 1)
    s.initial = {y.dot: 0.5}
    equations = s.embedding()
    for backend, method in METHODS[:4]:
        run = equations.compile(backend=backend).simulate((0, 2), method=method, rtol=1e-10)
        assert run.events["passes"].t == pytest.approx([1.0]) and run.events["brake"].t == pytest.approx([1.0]), method
        assert run.x[-1] == pytest.approx([1.5, 1.0], rel=1e-7)


def test_reset_of_euler_parameters_to_zeros_is_rejected() -> None:
    """No unit vector is near them."""
    s = sd.System("turned")
    e = sd.coordinates("e0 e1 e2 e3")
    s.add_joint(sd.Spherical("ball", s.ground, s.add_body("top", mass=1, inertia=[1, 2, 3]), e, sd.EulerParameters()))
    s.add_event("lost", sd.t - 0.5, reset={e[0]: 0})
    equations = s.embedding()
    for backend, method in METHODS[:4]:
        with pytest.warns(sd.SimulationWarning, match="stopped at t = 0.5: the constraints do not let e0 be what the reset of an "
                                                      "event makes it: the nearest is 1 off"):
            run = equations.compile(backend=backend).simulate((0, 1), method=method)
        assert not run.success and run.t[-1] == pytest.approx(0.5)


def test_event_at_the_very_end_of_a_step() -> None:
    y = sd.coordinates("y")
    s = sd.System("falling", gravity=[0, -10])
    body = s.add_body("ball", mass=1)
    s.add_joint(sd.Prismatic("fall", s.ground, body, y, axis=[0, 1]))
    s.add_event("clock", sd.t - 1)
    equations = s.embedding()
    for backend, method in METHODS[:4]:
        run = equations.compile(backend=backend).simulate((0, 1), method=method)
        assert run.events["clock"].t == pytest.approx([1.0], abs=1e-15), method


@functools.cache
def circling() -> Any:
    """A particle on a circle that loses half of a speed, and the end of its motion by tight steps."""
    x, y = sd.coordinates("x y")
    s = sd.System("circling", gravity=[0, -G])
    rail, particle = s.add_body("rail", mass=1), s.add_body("particle", mass=1)
    s.add_joint(sd.Prismatic("along", s.ground, rail, axis=[1, 0], coordinate=x))
    s.add_joint(sd.Prismatic("up", rail, particle, axis=[0, 1], coordinate=y))
    s.add_constraint(x**2 + y**2 - 1, "circle")
    s.initial = {x: 1}
    s.add_event("back", x - sp.Rational(3, 10), direction=-1, reset={x.dot: -x.dot / 2})  # which makes y.dot turn, too
    s.add_event("half", x - sp.Rational(1, 2), stop=True, direction=1)
    module = s.augmented().compile(backend="c")
    return module, module.simulate((0, 1.2), rtol=1e-12)


@pytest.mark.parametrize(("method", "way"), [("dop853", "baumgarte"), ("dop853", "none"), ("RK45", "baumgarte"), ("LSODA", None),
                                             ("ggl", None)])
def test_reset_is_put_onto_the_constraints_whatever_keeps_the_steps_there(method: str, way: str | None) -> None:
    if method == "ggl":
        pytest.importorskip("solve_dae")
    module, exact = circling()
    run = module.simulate((0, 1.2), method=method, stabilization=way, rtol=1e-9)
    assert run.success and len(run.events["back"].t) == 1
    at = run.events["back"].t[0]
    around = module.simulate([0, at - 1e-9, at + 1e-9], method=method, stabilization=way, rtol=1e-9)
    assert around["x_dot"][2] == pytest.approx(-around["x_dot"][1] / 2, rel=1e-7)
    assert np.abs(run["x"] ** 2 + run["y"] ** 2 - 1).max() < 1e-7 and np.abs(run.velocity_violation).max() < 1e-7
    assert run.t[-1] == pytest.approx(exact.t[-1], abs=1e-7) and run.x[-1] == pytest.approx(exact.x[-1], abs=1e-6)
    assert len(run.events["half"].t) == 1 and "event half ended the motion" in run.message
    if method == "ggl":  # those of the solver before the reset, too
        assert module.simulate((0, 1.2), method=method, rtol=1e-6, first_step=0.6).n_rejected > 0
