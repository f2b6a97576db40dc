"""Motions in SIMD lanes that have events, inputs by tables, or another method: the bits of motions one by one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.ensembles import plan
from tests.helpers import swept

pytestmark = pytest.mark.native  # tcc has no vectors
N = 19  # more than two vectors of eight lanes, and some left over


@pytest.mark.parametrize(("name", "method", "message"), [
    ("four_bar", "euler", "four_bar: there is no method 'euler'; there are dop853, bs54"),
    ("four_bar", "gauss", "four_bar: method 'gauss' does not fit: it keeps energy by its symmetry"),
    ("floating_crane", "taylor", "floating_crane: method 'taylor' does not fit")])
def test_a_method_that_does_not_fit_is_an_error_before_any_motion(monkeypatch: pytest.MonkeyPatch, name: str, method: str,
                                                                  message: str) -> None:
    module = sd.systems.get(name).compile(backend="c")
    monkeypatch.setattr(type(module), "simulate", None)
    with pytest.raises(sd.ArgumentError, match=message):
        module.simulate_batch(t=(0, 0.1), method=method)
    with pytest.raises(sd.ArgumentError, match="'taylor' needs the C backend"):
        sd.systems.get("pendulum").compile(backend="numpy").simulate_batch(t=(0, 0.1), method="taylor")


@pytest.fixture(scope="module")
def ball() -> Any:
    """A ball that loses a part of its speed at the floor, and stops the motion where it comes up to 1.5 m."""
    return bouncing()


def bouncing(events: Sequence[str] = ("floor", "top")) -> Any:
    y: Any = sd.coordinates("y")
    m, e = sd.parameters("m e")
    system = sd.System("ball", gravity=[0, -10, 0])
    system.add_joint(sd.Prismatic("j", system.ground, system.add_body("b", mass=m), y, axis=[0, 1, 0]))
    if "floor" in events:
        system.add_event("floor", y, direction=-1, reset={y.dot: -e * y.dot})
    if "top" in events:
        system.add_event("top", y - 1.5, direction=1, stop=True)
    system.defaults = {m: 1, e: 0.8}
    return system.embedding().compile(backend="c")


def alone(module: Any, t: Any, starts: Any, **options: Any) -> list[Any]:
    return [module.simulate(np.asarray(t, dtype=float), **{group: {n: v[k] for n, v in values.items()}
                                                           for group, values in starts.items()}, **options)
            for k in range(len(next(iter(next(iter(starts.values())).values()))))]


def same(many: Any, one: Sequence[Any]) -> None:
    """States at the output times that were reached, and steps, agree to the last bit."""
    assert many.note == "" and many.success.tolist() == [s.success for s in one]
    for k, solution in enumerate(one):
        reached = dict(zip(solution.t.tolist(), solution.x, strict=True))
        assert many.n_steps[k] == solution.n_steps and many.n_rejected[k] == solution.n_rejected
        for t, x in zip(many.t.tolist(), many.x[k], strict=True):
            assert np.array_equal(x, reached[t]) if t in reached else np.isnan(x).all()


@pytest.mark.parametrize("method", ["dop853", *swept(["bs54"])])
def test_resets_and_stops(ball: Any, method: str) -> None:
    starts = {"q": {"y": np.linspace(0.2, 1.4, N)}, "u": {"y_dot": np.linspace(-6, 3, N)}}
    times = np.linspace(0, 2, 9)
    many = ball.simulate_batch(**starts, t=times, method=method)
    one = alone(ball, times, starts, method=method)
    same(many, one)
    ended = [len(s.events["top"].t) == 1 for s in one]
    assert any(ended) and not all(ended) and max(len(s.events["floor"].t) for s in one) > 1
    ends = ball.simulate_batch(**starts, t=(0, 2), method=method)
    assert all(np.array_equal(x[0], s.x[-1]) for x, s in zip(ends.x, one, strict=True))


def test_a_ball_keeps_a_part_of_its_height() -> None:
    """Closed form: the time between the bounces 0 and 1 is 2 e v/g, the height of the next arc is e^2 h."""
    module = bouncing(["floor"])
    h, e = np.linspace(0.5, 2, N), np.linspace(0.75, 0.9, N)
    fall = np.sqrt(2 * h / 10)
    for k in range(0, N, 6):  # every motion is looked at half an arc after its first bounce
        top = fall[k] + e[k] * 10 * fall[k] / 10
        many = module.simulate_batch({"y": h}, params={"e": e}, t=(0, top), rtol=1e-10)
        assert many["y"][k, 0] == pytest.approx(e[k] ** 2 * h[k], abs=1e-11)


def test_many_events_without_resets(ball: Any) -> None:
    """More of them than wait to be taken."""
    x: Any = sd.coordinates("x")
    system = sd.System("oscillator")
    joint = system.add_joint(sd.Prismatic("j", system.ground, system.add_body("b", mass=1), x, axis=[1, 0, 0]))
    system.add_joint_force(joint, -400 * x)
    system.add_event("middle", x)
    module = system.embedding().compile(backend="c")
    starts, times = {"q": {"x": np.linspace(0.1, 1, N)}}, np.linspace(0, 30, 4)
    one = alone(module, times, starts)
    assert min(len(s.events["middle"].t) for s in one) > 150
    same(module.simulate_batch(**starts, t=times), one)


@pytest.mark.parametrize("method", ["dop853", *swept(["bs54"])])
def test_inputs_by_tables(compiled: Callable[..., Any], method: str) -> None:
    module = compiled("cart_pole", "c")
    name, angle = module.metadata.inputs[0], module.metadata.q[1]
    table = {name: ([0.0, 0.4, 1.0], [0.0, 3.0, -2.0])}
    starts, times = {"q": {angle: np.linspace(0.1, 1, N)}}, np.linspace(0, 1, 5)
    many = module.simulate_batch(**starts, inputs=table, t=times, method=method)
    same(many, alone(module, times, starts, inputs=table, method=method))
    assert not np.array_equal(many.x, module.simulate_batch(**starts, t=times, method=method).x)


@pytest.mark.parametrize("name", ["four_bar", *swept(["floating_crane"])])
def test_projection_with_slopes_at_ends(compiled: Callable[..., Any], name: str) -> None:
    """Constraints, and Euler parameters, with a method that evaluates its end before it is moved."""
    module = sd.systems.get(name).compile(backend="c")
    speed = module.metadata.u[-1]
    first = module.consistent()[1][-1]
    starts = {"u": {speed: first + np.linspace(0, 0.01, 9)}} if name == "floating_crane" else {"params": {
        "m2": np.linspace(1, 1.3, 9)}}
    times = np.linspace(0, 0.3, 4)
    same(module.simulate_batch(**starts, t=times, method="bs54"), alone(module, times, starts, method="bs54"))


def test_ensembles_with_resets() -> None:
    module = bouncing(["floor"])
    drawn = sd.Samples({"y": {"from": 0.5, "to": 2}}, count=2500, seed=1)
    many = sd.ensemble(module, drawn, (0, 1), ["end y", "max y"])
    few = [module.simulate((0, 1), q={"y": y}) for y in drawn.block(0, 4)[:, 0]]
    assert all(many["end y"][k] == s.x[-1, 0] and many["max y"][k] == s["y"].max() for k, s in enumerate(few))


def test_ensembles_with_resets_in_other_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    """They get all that motions in lanes call, as text."""
    monkeypatch.setattr(plan, "VECTORS_FROM", 1)
    module, samples = bouncing(["floor"]), {"y": np.linspace(0.5, 2, N)}
    here = sd.ensemble(module, samples, (0, 1), ["end y"])
    with ProcessPoolExecutor(1, get_context("spawn")) as processes:
        there = sd.ensemble(module, samples, (0, 1), ["end y"], executor=processes)
    assert there.n_failed == 0 and np.array_equal(here["end y"], there["end y"])
