"""Gradients across events, resets and instants of controllers, backwards: against closed forms and sensitivities forwards."""

from __future__ import annotations

import warnings
from typing import Any

import mpmath as mp
import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, EvaluationError, SimulationWarning
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.integrating import across
from symdyn.runtime.integrating import gradient as backwards
from tests.derivatives.test_sensitivities import derivatives
from tests.derivatives.test_sensitivities_at_events import ball, block, bounced, slid
from tests.derivatives.test_sensitivities_of_controllers import PERIOD, controlled, mass

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")

BALL = {"g": 9.81, "e": 0.8, "y(0)": 1.0}


@pytest.mark.every_value
@pytest.mark.parametrize("method", ["dop853", "bs54"])
@pytest.mark.parametrize("rtol", [1e-6, 1e-11])
def test_bouncing_ball(method: str, rtol: float) -> None:
    """Six bounces, whose resets depend on the time; between them motions are polynomials, which the steps have exactly."""
    for k, name in enumerate(("y", "y_dot", "n")):
        exact = derivatives(lambda *a, k=k: bounced(*a)[k], [3.0], BALL)[0]
        found = ball().gradient(sd.Loss(end=sp.Symbol(name)), list(BALL), (0, 3), rtol=rtol, method=method)
        np.testing.assert_allclose(found.array, exact, rtol=0, atol=1e-10)
        assert found.value == pytest.approx(float(bounced(mp.mpf(3), mp.mpf("9.81"), mp.mpf("0.8"), mp.mpf(1))[k]), abs=1e-10)
        assert found.n_steps == ball().simulate((0, 3), rtol=rtol, method=method).n_steps


def area(t: Any, g: Any, e: Any, height: Any) -> Any:
    """The integral of the height of the ball up to a time."""
    begin = mp.sqrt(2 * height / g)
    total, speed = height * begin - g * begin**3 / 6, mp.sqrt(2 * g * height)
    while True:
        speed = e * speed
        s = min(2 * speed / g, t - begin)
        total += speed * s**2 / 2 - g * s**3 / 6
        begin += 2 * speed / g
        if begin > t:
            return total


def test_integral_over_bounces_and_pieces_of_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = derivatives(area, [2.5], BALL)[0]
    loss = sd.Loss(integral=sp.Symbol("y"))
    found = ball().gradient(loss, list(BALL), (0, 2.5), rtol=1e-10)
    np.testing.assert_allclose(found.array, exact, rtol=0, atol=1e-10)
    assert found.value == pytest.approx(float(area(*map(mp.mpf, (2.5, 9.81, 0.8, 1)))), abs=1e-11)
    monkeypatch.setattr(backwards, "KEPT", 0)
    np.testing.assert_allclose(ball().gradient(loss, list(BALL), (0, 2.5), rtol=1e-10).array, found.array, rtol=1e-13)


@pytest.mark.parametrize(("rtol", "error"), [(1e-7, 1e-6), (1e-11, 1e-9)])
def test_friction_block(rtol: float, error: float) -> None:
    """The right-hand side jumps where the block turns; no stage of a step lies beyond."""
    at = {"mu": 0.1, "k": 20.0, "x(0)": 1.0}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = block().gradient(sd.Loss(end=sp.Symbol("x")), list(at), (0, 2.9), rtol=rtol)
    np.testing.assert_allclose(found.array, derivatives(slid, [2.9], at)[0], rtol=0, atol=error)
    with pytest.warns(SimulationWarning, match=r"may jump where x_dot passes zero .*add an event"):
        block(event=False).gradient(sd.Loss(end=sp.Symbol("x")), ["mu"], (0, 1))


def falling(quantity: Any = None, **event: Any) -> Any:
    y = sd.coordinates("y")
    m, g = sd.parameters("m g", positive=True)
    system = sd.System("fall", gravity=[0, -g])
    body = system.add_body("ball", mass=m)
    system.add_joint(sd.Prismatic("fall", system.ground, body, y, axis=[0, 1]))
    system.add_event("lands", y if quantity is None else quantity, **event)
    system.defaults, system.initial = {m: 1, g: 9.81}, {y: 1}
    return system.embedding().compile()


def test_an_integrand_that_jumps_with_the_time_of_an_event() -> None:
    """y from when a switch is thrown at t = T on, of a mass that moves at 1 m/s: (4 - T^2)/2."""
    y, T = sd.coordinates("y"), sd.parameters("T")
    system = sd.System("switched")
    system.add_joint(sd.Prismatic("slide", system.ground, system.add_body("mass", mass=1), y, axis=[1, 0]))
    system.add_event("thrown", sd.t - T, reset={y.dot: y.dot + T - sd.t})
    system.defaults, system.initial = {T: 0.75}, {y.dot: 1.0}
    loss = sd.Loss(integral=sp.Piecewise((y, sd.t > T), (0, True)))
    found = system.compile().gradient(loss, ["T"], (0, 2))
    assert found.value == pytest.approx((4 - 0.75**2) / 2, abs=1e-9) and found["T"] == pytest.approx(-0.75, abs=1e-6)


def test_where_an_event_ends_the_motion() -> None:
    """The time of the end moves, too: t y_dot is -2 h there, and the integral of y is 2/3 h sqrt(2 h/g)."""
    y, names = sd.coordinates("y"), ["g", "y(0)"]
    module = falling(stop=True)
    end = module.gradient(sd.Loss(end=sd.t * y.dot), names, (0, 5))
    np.testing.assert_allclose(end.array, [0, -2], atol=1e-10)
    assert end.t == pytest.approx(np.sqrt(2 / 9.81), rel=1e-12)
    by_function = module.gradient(sd.Loss(end=lambda t, x, p: (t * x[1], np.array([0, t]))), names, (0, 5))
    np.testing.assert_allclose(by_function.array, [0, -2], atol=1e-10)
    root = np.sqrt(2 / 9.81)
    found = module.gradient(sd.Loss(integral=y), names, (0, 5))
    assert found.value == pytest.approx(2 / 3 * root, rel=1e-11)
    np.testing.assert_allclose(found.array, [-root / 3 / 9.81, root], rtol=1e-9)


def test_backward_in_time_across_an_event() -> None:
    y = sd.coordinates("y")
    module = falling(y - 1.5, reset={y.dot: 2 * y.dot})
    run = module.simulate((1, 0), {"y": 1.0}, {"y_dot": -6.0}, sensitivities=["g", "y_dot(0)"], rtol=1e-11)
    found = module.gradient(sd.Loss(end=y), ["g", "y_dot(0)"], (1, 0), {"y": 1.0}, {"y_dot": -6.0}, rtol=1e-11)
    assert len(run.events["lands"].t) == 1
    np.testing.assert_allclose(found.array, run.sensitivity.of("y")[-1], rtol=1e-8)


def test_on_constraints() -> None:
    """An extra state of a four-bar linkage that an event resets, and that counts in the loss."""
    system = sd.systems.get("four_bar")
    n, q = sd.coordinates("n"), sp.Symbol("q1")
    c = sd.parameters("c")
    q1 = next(a for a in system.joints[0].coordinates if a.name == "q1")
    system.add_state(n, q1.dot)
    system.add_event("passes", q1 - system.initial[q1] - 0.2, reset={n: n + c * sd.t * q1.dot})
    system.defaults[c] = 2.0
    module = system.augmented().compile()
    names = [*module.metadata.parameters[1:4], "c", "q1_dot(0)"]
    start = dict(zip("qu", module.consistent(u={"q1_dot": 2.0}, keep=["q1", "q1_dot"]), strict=True))
    run = module.simulate((0, 0.6), **start, sensitivities=names, rtol=1e-11)
    assert len(run.events["passes"].t) >= 1 and q.name in module.metadata.x
    found = module.gradient(sd.Loss(end=n), names, (0, 0.6), **start, rtol=1e-11)
    expected = run.sensitivity.of("n")[-1]
    np.testing.assert_allclose(found.array, expected, rtol=0, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_controllers(delay: int) -> None:
    at = {"m": 2.0, "q(0)": 1.0}
    law = sd.Sampled(lambda t, x: -4 * x[0] ** 3 - 1.5 * x[1], PERIOD, delay=delay * PERIOD,
                     gradient=lambda t, x: [-12 * x[0] ** 2, -1.5])
    exact = derivatives(lambda *a: controlled(*a, delay)[0], [2.93], at)[0]
    found = mass().gradient(sd.Loss(end=sp.Symbol("q")), list(at), (0, 2.93), inputs={"F": law}, rtol=1e-9)
    np.testing.assert_allclose(found.array, exact, rtol=0, atol=1e-12)
    effort = mass().gradient(sd.Loss(integral=sp.Symbol("F") ** 2), list(at), (0, 2.93), inputs={"F": law}, rtol=1e-9)
    exact = derivatives(lambda *a: spent(*a, delay), [2.93], at)[0]
    np.testing.assert_allclose(effort.array, exact, rtol=1e-11)


def spent(t: Any, m: Any, start: Any, delay: int) -> Any:
    """The integral of the controller's force squared; motions as in `controlled`."""
    q, v, total, waiting = start, mp.mpf(0), mp.mpf(0), [mp.mpf(0)] * delay
    while t > 0:
        waiting.append(-4 * q**3 - mp.mpf(1.5) * v)
        force = waiting.pop(0)
        h = min(t, mp.mpf(PERIOD))
        q, v, t = q + v * h + force / m * h * h / 2, v + force / m * h, t - h
        total += force**2 * h
    return total


def test_what_has_no_gradient(monkeypatch: pytest.MonkeyPatch) -> None:
    y = sd.coordinates("y")
    asked: dict[str, Any] = {"loss": sd.Loss(end=y), "by": ["g"], "t": (0, 0.4)}
    with pytest.raises(EvaluationError, match=r"the quantity of the event lands vanishes at t = 0\.319.* without a rate"):
        falling((y - 0.5) ** 3, reset={y.dot: -y.dot}).gradient(**asked)
    module = falling(y - 0.5, reset={y.dot: -y.dot})
    with pytest.raises(ArgumentError, match="events jump asked for; there are lands"):
        module.gradient(**asked, events=["jump"])
    assert module.gradient(**asked, events=False)["g"] == pytest.approx(-0.08, rel=1e-12)
    monkeypatch.setattr(across, "ITERATIONS", 1)
    with pytest.raises(EvaluationError, match=r"the step up to an event near t = 0\.7.* is not computed, since the motion is"):
        block().gradient(sd.Loss(end=sp.Symbol("x")), ["mu"], (0, 1))
    monkeypatch.setattr(across, "TRIES", 0)
    with pytest.raises(EvaluationError, match=r"the event lands at t = 0\.319.* is not found again when the motion is cut there"):
        module.gradient(**asked)


def test_events_at_instants() -> None:
    q, F = sd.coordinates("q"), sd.inputs("F")
    system = sd.System("cart")
    body = system.add_body("body", mass=1)
    joint = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=q))
    system.add_joint_force(joint, F, name="drive")
    system.add_event("push", F - 1, reset={q.dot: 0})
    system.initial = {q: 0}
    law = sd.Sampled(lambda t, x: 2 * t, 0.2, gradient=lambda t, x: [0, 0])
    with pytest.raises(EvaluationError, match=r"the event push happens at t = 0\.6 s, at an instant of a controller; a gradient"):
        system.embedding().compile().gradient(sd.Loss(end=q), ["q(0)"], (0, 1), inputs={"F": law})
    with pytest.raises(ArgumentError, match="derivatives of a sampled controller by the state are not known"):
        mass().gradient(sd.Loss(end=q), ["m"], (0, 1), inputs={"F": sd.Sampled(lambda t, x: 0, 0.2)})
