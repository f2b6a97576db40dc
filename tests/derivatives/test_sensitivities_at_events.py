"""Sensitivities across events against closed forms: their times move with the parameters, and so do the states after them."""

from __future__ import annotations

import warnings
from functools import cache
from typing import Any

import mpmath as mp
import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import EvaluationError, SimulationWarning
from symdyn.runtime.building.compiler import find_compiler
from tests.derivatives.test_sensitivities import derivatives

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


@cache
def ball() -> Any:
    """A ball that bounces; the time of every bounce and what it loses depend on parameters."""
    y, n = sd.coordinates("y n")
    m, g, e = sd.parameters("m g e", positive=True)
    system = sd.System("ball", gravity=[0, -g])
    body = system.add_body("ball", mass=m)
    system.add_joint(sd.Prismatic("fall", system.ground, body, y, axis=[0, 1]))
    system.add_state(n, 0)
    system.add_event("bounce", y, direction=-1, reset={y.dot: -e * y.dot, n: n + sd.t * e})
    system.add_event("top", y.dot, direction=-1)
    system.defaults, system.initial = {m: 1, g: 9.81, e: 0.8}, {y: 1}
    return system.embedding().compile()


def bounced(t: Any, g: Any, e: Any, height: Any) -> tuple[Any, Any, Any]:
    """Height, speed and what the state n has gathered at a time."""
    begin, speed, gathered = mp.sqrt(2 * height / g), mp.sqrt(2 * g * height), mp.mpf(0)
    if t < begin:
        return height - g * t**2 / 2, -g * t, gathered
    while True:
        speed, gathered = e * speed, gathered + begin * e
        if t < begin + 2 * speed / g:
            return speed * (t - begin) - g * (t - begin) ** 2 / 2, speed - g * (t - begin), gathered
        begin += 2 * speed / g


@pytest.mark.parametrize("method", ["dop853", "bs54", "taylor", "radau", "radau5"])
def test_bouncing_ball(method: str) -> None:
    times, at = np.linspace(0, 3, 32), {"g": 9.81, "e": 0.8, "y(0)": 1.0}
    run = ball().simulate(times, rtol=1e-11, method=method, sensitivities=list(at))
    assert len(run.events["bounce"].t) == 6
    for k, name in enumerate(("y", "y_dot", "n")):
        exact = derivatives(lambda *a, k=k: bounced(*a)[k], times, at)
        assert np.abs(run.sensitivity.of(name) - exact).max() < 1e-9


def block(event: bool = True) -> Any:
    """A block on a spring with dry friction: the right-hand side jumps where it turns."""
    x = sd.coordinates("x")
    m, mu, g, k = sd.parameters("m mu g k", positive=True)
    system = sd.System("block", gravity=[0, -g])
    body = system.add_body("block", mass=m)
    joint = system.add_joint(sd.Prismatic("slide", system.ground, body, x, axis=[1, 0]))
    system.add_joint_force(joint, -mu * m * g * sp.sign(x.dot) - k * x, name="spring and friction")
    if event:
        system.add_event("turn", x.dot)
    system.defaults, system.initial = {m: 1, mu: 0.1, g: 9.81, k: 20.0}, {x: 1.0}
    return system.embedding().compile()


def slid(t: Any, mu: Any, k: Any, start: Any) -> Any:
    """Half waves about places of rest on both sides in turn (mass 1 kg)."""
    rate, center = mp.sqrt(k), mu * mp.mpf(9.81) / k
    while t > mp.pi / rate:
        start, center, t = 2 * center - start, -center, t - mp.pi / rate
    return center + (start - center) * mp.cos(rate * t)


@pytest.mark.parametrize("method", ["dop853", "bs54"])
def test_friction_block(method: str) -> None:
    times, at = np.linspace(0, 3, 41), {"mu": 0.1, "k": 20.0, "x(0)": 1.0}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = block().simulate(times, rtol=1e-11, method=method, sensitivities=list(at))
    assert len(run.events["turn"].t) == 4
    assert np.abs(run.sensitivity.of("x") - derivatives(slid, times, at)).max() < 1e-9


def _spring(law: sp.Expr) -> Any:
    x = sd.coordinates("x")
    system = sd.System("spring")
    body = system.add_body("body", mass=1)
    system.add_joint_force(system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=x)), law)
    system.defaults = {symbol: 0.7 for symbol in law.free_symbols if str(symbol) == "p"}
    return system.compile()


def test_parameter_that_moves_a_jump_and_nothing_else() -> None:
    """A force of 3 until t = p: x(2) = 3 p (2 - p/2), whose derivative by p is 3 (2 - p); without an event it is not seen."""
    p = sd.parameters("p")
    module = _spring(sp.Piecewise((3, sd.t < p), (0, True)))
    with pytest.warns(SimulationWarning, match=r"p moves a jump of the right-hand side, where p - t passes zero, and nothing else"
                                               r" here.* add an event, system.add_event\(name, p - t\)"):
        run = module.simulate((0, 2), sensitivities=["p"])
    assert not run.sensitivity["p"].any()
    assert run.x[-1, 0] == pytest.approx(3 * 0.7 * (2 - 0.35), rel=1e-6)


def test_parameter_that_moves_only_a_later_zero_of_a_surface() -> None:
    """A force of 3 where t - 1/2 is below (2 + p) max(t - 1, 0): until 1/2 for every p, and from (3/2 + p)/(1 + p) on."""
    p, end = sd.parameters("p"), 2.2 / 1.7
    module = _spring(sp.Piecewise((3, sd.t - 0.5 - (2 + p) * sp.Max(sd.t - 1, 0) < 0), (0, True)))
    with pytest.warns(SimulationWarning, match="p moves a jump of the right-hand side, where .* passes zero, and nothing else"):
        run = module.simulate((0, 2), sensitivities=["p"], rtol=1e-9)
    assert run.x[-1, 0] == pytest.approx(3 * 0.5 * 1.75 + 3 * (2 - end)**2 / 2, rel=1e-6)


def test_law_in_pieces_that_does_not_jump() -> None:
    """A spring with a gap on each side is continuous where its pieces meet."""
    x, p = sd.coordinates("x"), sd.parameters("p")
    module = _spring(-x - sp.Piecewise((50 * (x - p), x > p), (50 * (x + p), x < -p), (0, True)))
    with warnings.catch_warnings():
        warnings.simplefilter("error", SimulationWarning)
        run = module.simulate((0, 3), [1.0], sensitivities=["p"], rtol=1e-9)
    h = 1e-5
    sides = [module.simulate([0, 3.0], [1.0], params={"p": 0.7 + way * h}, rtol=1e-13).x[-1] for way in (-1, 1)]
    np.testing.assert_allclose(run.sensitivity["p"][-1], (sides[1] - sides[0]) / (2 * h), rtol=1e-5)


def test_jump_without_an_event() -> None:
    with pytest.warns(SimulationWarning, match=r"may jump where x_dot passes zero \(sign\(x_dot\)\).*the sensitivities lack "
                                               r"their jump; add an event, system.add_event\(name, x_dot\)"):
        block(event=False).simulate((0, 1), sensitivities=["mu"])


@cache
def touching() -> Any:
    """A swing x = u sin(t) that is turned back at the height h."""
    x = sd.coordinates("x")
    h = sd.parameters("h")
    system = sd.System("touching")
    body = system.add_body("body", mass=1)
    joint = system.add_joint(sd.Prismatic("slide", system.ground, body, x, axis=[1, 0]))
    system.add_joint_force(joint, -x)
    system.add_event("top", x - h, reset={x.dot: -x.dot / 2})
    system.add_event("passes", x - h)  # without effect
    system.defaults, system.initial = {h: 1.0}, {x: 0}
    return system.compile()


def turned(t: Any, h: Any, speed: Any) -> Any:
    """Half of the speed is left at h; x = h cos(t - t1) - v/2 sin(t - t1) then."""
    begin = mp.asin(h / speed)
    return h * mp.cos(t - begin) - mp.sqrt(speed**2 - h**2) / 2 * mp.sin(t - begin)


@pytest.mark.parametrize("speed", [1.0, 1 + 1e-14, 1 - 1e-14, 1 + 1e-10])
def test_events_that_graze(speed: float) -> None:
    """Whether x reaches h is within the tolerances: one rule for both ways."""
    without = r"touching: the quantity of the event top vanishes at t = 1.57\d* s without a rate that the tolerances resolve, so"
    with pytest.warns(SimulationWarning, match=without):
        run = touching().simulate(np.array([0, 3.0]), u=[speed], rtol=1e-10, sensitivities=["h"])
    assert len(run.events["top"].t) == 1
    with pytest.raises(EvaluationError, match=without):
        touching().gradient(sd.Loss(end=sp.Symbol("x")), ["h"], (0, 3), u=[speed], rtol=1e-10)


@pytest.mark.parametrize(("speed", "rtol"), [(1 + 1e-8, 1e-12), (1 + 1e-6, 1e-10), (1 + 1e-4, 1e-8), (2.0, 1e-6)])
def test_events_that_nearly_graze(speed: float, rtol: float) -> None:
    """Derivatives are as exact as the tolerances over what the quantity goes beyond zero by."""
    exact = derivatives(turned, [3.0], {"h": 1.0, "u": speed})[0, 0]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = touching().simulate(np.array([0, 3.0]), u=[speed], rtol=rtol, sensitivities=["h"])
        found = touching().gradient(sd.Loss(end=sp.Symbol("x")), ["h"], (0, 3), u=[speed], rtol=rtol)
    assert run.sensitivity["h"][-1, 0] == pytest.approx(exact, rel=10 * rtol / (speed - 1) + 1e-9)
    assert found["h"] == pytest.approx(exact, rel=10 * rtol / (speed - 1) + 1e-9)


def test_events_without_effect_may_graze() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = touching().simulate((0, 3), u=[1.0], rtol=1e-10, events=["passes"], sensitivities=["x_dot(0)"])
    np.testing.assert_allclose(run.sensitivity["x_dot(0)"][:, 0], np.sin(run.t), atol=1e-9)


@cache
def jumping(name: str, event: bool = False) -> Any:
    """A mass on a spring with a force that jumps where no event looks for it."""
    x = sd.coordinates("x")
    k, gap, m = sd.parameters("k gap m")
    law = {"sign": -gap * sp.sign(x.dot), "floor": sp.floor(3 * x + gap), "atan2": gap * sp.atan2(x.dot, x),
           "edge": -2 * sp.Heaviside(x - gap)}
    system = sd.System(f"jumps_{name}")
    body = system.add_body("body", mass=m)
    joint = system.add_joint(sd.Prismatic("slide", system.ground, body, x, axis=[1, 0]))
    system.add_joint_force(joint, -k * x + law[name])
    if event:
        system.add_event("edge", x - gap)
    system.defaults, system.initial = {m: 1, k: 5, gap: 0.3}, {x: 1}
    return system.compile()


@pytest.mark.filterwarnings("ignore:.*nothing in this motion")
@pytest.mark.parametrize("name", ["sign", "floor", "atan2", "edge"])
def test_jumps_are_found_over_the_steps(name: str) -> None:
    """With two rows, between which every surface is passed an even number of times."""
    with pytest.warns(SimulationWarning, match="the right-hand side may jump where .* passes zero") as found:
        run = jumping(name).simulate(np.array([0, 3.0]), rtol=1e-10, sensitivities=["k", "gap"])
    assert sum("may jump" in doubt for doubt in run.doubts) == 1 and len(run.t) == 2
    if name == "edge":  # the times of these jumps depend on it
        assert any("gap moves a jump of the right-hand side, where -gap + x passes zero" in str(w.message) for w in found)


def test_batches_and_ensembles_warn_of_jumps() -> None:
    """An event at the jump makes the derivatives those of differences, without a warning."""
    values, t, h = {"k": [5.0, 5.1]}, np.array([0, 3.0]), 1e-4
    by = ["k", "gap"]
    with pytest.warns(SimulationWarning, match=r"of 2 motions 0: jumps_edge: .*may jump.*; 1: jumps_edge: .*; and 1 more"):
        jumping("edge").simulate_batch(params=values, t=t, rtol=1e-10, sensitivities=by)
    with pytest.warns(SimulationWarning, match="jumps_edge: derivatives of 2 of 2 members are doubtful: 0: jumps_edge: .*; 1: "):
        found = sd.ensemble(jumping("edge"), values, t, ["grad end x"], rtol=1e-10, sensitivities=by)
    assert "derivatives of 2 of 2" in found.doubts
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not sd.ensemble(jumping("edge"), values, t, ["end x"], rtol=1e-10).doubts
        found = sd.ensemble(jumping("edge", True), values, t, ["grad end x"], rtol=1e-10, sensitivities=by)
        batch = jumping("edge", True).simulate_batch(params=values, t=t, rtol=1e-10, sensitivities=by)
        for k, value in enumerate(values["k"]):
            at = {"k": value, "gap": 0.3}
            sides = [[jumping("edge", True).simulate(t, params={**at, n: at[n] + way}, rtol=1e-12).x[-1, 0] for way in (-h, h)]
                     for n in by]
            difference = np.diff(sides).ravel() / (2 * h)
            np.testing.assert_allclose(found["grad end x"][k], difference, atol=1e-6)
            np.testing.assert_allclose(batch.sensitivity.of("x")[k, -1], difference, atol=1e-6)


def test_steps_go_on_as_without_sensitivities() -> None:
    plain = ball().simulate((0, 3), rtol=1e-9)
    run = ball().simulate((0, 3), rtol=1e-9, sensitivities=["g"], sensitivity_control=False)
    assert list(run.events) == list(plain.events)
    for name, rows in plain.events.items():
        np.testing.assert_allclose(run.events[name].t, rows.t, rtol=0, atol=1e-12)
        assert run.events[name].x.shape == rows.x.shape
    np.testing.assert_allclose(run.x, plain.x, rtol=0, atol=1e-11)
