"""Sensitivities and gradients across several events at one time, against closed forms of each, and one event in their place."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from functools import cache
from typing import Any

import mpmath as mp
import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import SimulationWarning
from symdyn.runtime.building.compiler import find_compiler
from tests.derivatives.test_sensitivities import derivatives
from tests.derivatives.test_sensitivities_at_events import bounced, slid
from tests.helpers import swept

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


def dropped(*resets: Sequence[tuple[str, str]], jumps: bool = False) -> Any:
    """Balls dropped side by side; what events at the ground reset of each: (state, expression)."""
    g, e = sd.parameters("g e")
    system, names = sd.System("dropped", gravity=[0, -g]), {"g": g, "e": e, "t": sd.t}
    heights = sd.coordinates(" ".join(f"y{k + 1}" for k in range(len(resets))))
    for y in heights:
        body = system.add_body(f"ball {y.name}", mass=1)
        system.add_joint(sd.Prismatic(f"fall {y.name}", system.ground, body, y, axis=[0, 1]))
        names |= {y.name: y, f"v{y.name[1:]}": y.dot}
        system.initial[y] = 1
    for y, changes in zip(heights, resets, strict=True):
        system.add_event(f"hit_{y.name}", y, direction=-1,
                         reset={names[state]: sp.sympify(text, names) for state, text in changes})
    system.add_event("seen", heights[0] - heights[0].dot / 100 - g * sd.t / 100, direction=-1)  # without effect
    system.defaults = {g: 9.81, e: 0.8}
    return system.compile()


@cache
def three() -> Any:
    return dropped([("v1", "-e*v1")], [("v2", "-e*v2")], [("v3", "-e*v3")])


AT = {"g": 9.81, "e": 0.8, "y1(0)": 1.0}


@pytest.mark.parametrize("method", ["dop853", *swept(["bs54", "taylor"]), "radau"])
def test_each_of_three_balls_bounces_at_its_own_time(method: str) -> None:
    """A ball does not depend on the height of another one, at whose time it bounces all along."""
    times = np.linspace(0, 2, 11)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = three().simulate(times, rtol=1e-11, method=method, sensitivities=[*AT, "y2(0)"])
    assert [len(run.events[f"hit_y{k}"].t) for k in (1, 2, 3)] == [3, 3, 3]
    exact = derivatives(lambda *a: bounced(*a)[0], times, AT)
    for k in range(3):
        own = np.column_stack([exact[:, :2], exact[:, 2] * (k == 0), exact[:, 2] * (k == 1)])
        assert np.abs(run.sensitivity.of(f"y{k + 1}") - own).max() < 1e-9


@pytest.mark.parametrize("method", ["dop853", *swept(["bs54"])])
def test_gradients_of_three_balls(method: str) -> None:
    exact, y = derivatives(lambda *a: bounced(*a)[0], [1.9], AT)[0], sd.coordinates("y1 y2 y3")
    height, area = derivatives(lambda *a: bounced(*a)[0], [1.9], AT)[0, 2], derivatives(fallen, [1.9], AT)[0]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        end = three().gradient(sd.Loss(end=y[0] + 2 * y[1]), [*AT, "y2(0)", "y3(0)"], (0, 1.9), rtol=1e-11, method=method)
        whole = three().gradient(sd.Loss(integral=y[0] * 3 + y[1]), [*AT, "y2(0)", "y3(0)"], (0, 1.9), rtol=1e-11, method=method)
    np.testing.assert_allclose(end.array, [*(3 * exact[:2]), height, 2 * height, 0], atol=1e-9)
    np.testing.assert_allclose(whole.array, [*(4 * area[:2]), 3 * area[2], area[2], 0], atol=1e-9)


def fallen(t: Any, g: Any, e: Any, height: Any) -> Any:
    """The integral of the height of a ball."""
    begin, speed = mp.sqrt(2 * height / g), mp.sqrt(2 * g * height)
    total = height * begin - g * begin**3 / 6
    while begin < t:
        speed = e * speed
        length = min(2 * speed / g, t - begin)
        total, begin = total + speed * length**2 / 2 - g * length**3 / 6, begin + 2 * speed / g
    return total


def test_each_of_two_blocks_turns_at_its_own_time() -> None:
    """The right-hand side jumps without a reset, at each event in its own entry."""
    mu, spring, g = sd.parameters("mu k g", positive=True)
    system = sd.System("blocks", gravity=[0, -g])
    for x in sd.coordinates("x1 x2"):
        body = system.add_body(f"block {x.name}", mass=1)
        joint = system.add_joint(sd.Prismatic(f"slide {x.name}", system.ground, body, x, axis=[1, 0]))
        system.add_joint_force(joint, -mu * g * sp.sign(x.dot) - spring * x)
        system.add_event(f"turn_{x.name}", x.dot)
        system.initial[x] = 1
    system.defaults = {mu: 0.1, spring: 20, g: 9.81}
    times, at = np.linspace(0, 3, 16), {"mu": 0.1, "k": 20.0, "x1(0)": 1.0}
    module = system.compile()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = module.simulate(times, rtol=1e-11, sensitivities=[*at, "x2(0)"])
    exact = derivatives(slid, times, at)
    np.testing.assert_allclose(run.sensitivity.of("x1"), np.column_stack([exact, 0 * times]), atol=1e-8)
    np.testing.assert_allclose(run.sensitivity.of("x2"), np.column_stack([exact[:, :2], 0 * times, exact[:, 2]]), atol=1e-8)
    loss = sd.Loss(end=sp.Symbol("x1") + 2 * sp.Symbol("x2"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        gradient = module.gradient(loss, [*at, "x2(0)"], (0, 2.9), rtol=1e-11)
    exact = derivatives(slid, [2.9], at)[0]
    np.testing.assert_allclose(gradient.array, [*(3 * exact[:2]), exact[2], 2 * exact[2]], atol=1e-8)


@cache
def entangled() -> Any:
    """Each bounce changes the speed of the other ball, too."""
    return dropped([("v1", "-e*v1 + v2/4")], [("v2", "-e*v2 + v1/4")])


def test_order_that_matters_is_warned_of() -> None:
    """There is a derivative, without a warning, by a parameter that moves both alike."""
    with pytest.warns(SimulationWarning, match=r"the events hit_y1, hit_y2 happen at one time, t = 0.4515\d* s, and what they do "
                                               r"together depends on their order.*; take another start, or one event with all"):
        entangled().simulate((0, 0.6), rtol=1e-11, sensitivities=["y1(0)"])
    with pytest.warns(SimulationWarning, match=r"the events hit_y1, hit_y2 happen at one time, t = 0.4515\d* s, and what they"):
        entangled().gradient(sd.Loss(end=sp.Symbol("y1")), ["y1(0)"], (0, 0.6))
    h = 1e-4
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = entangled().simulate((0, 0.6), rtol=1e-11, sensitivities=["g", "e"])
        for name in ("g", "e"):
            sides = [entangled().simulate((0, 0.6), params={name: AT[name] + way}, rtol=1e-13).x[-1] for way in (-h, h)]
            np.testing.assert_allclose(run.sensitivity[name][-1], (sides[1] - sides[0]) / (2 * h), atol=1e-6)


def test_events_of_one_quantity_are_one() -> None:
    """They come at one time along every parameter, so that what they do together has no order: all take the state before."""
    modules = []
    for apart in (True, False):
        y, n = sd.coordinates("y n")
        g, e = sd.parameters("g e")
        system = sd.System("counted", gravity=[0, -g])
        body = system.add_body("ball", mass=1)
        system.add_joint(sd.Prismatic("fall", system.ground, body, y, axis=[0, 1]))
        system.add_state(n, 0)
        bounces, counts = {y.dot: -e * y.dot}, {n: n + y.dot * sd.t}
        system.add_event("bounces", y, direction=-1, reset=bounces if apart else bounces | counts)
        if apart:
            system.add_event("counts", 2 * y, direction=-1, reset=counts)
        system.defaults, system.initial = {g: 9.81, e: 0.8}, {y: 1}
        modules.append(system.compile())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        runs = [module.simulate(np.linspace(0, 2, 5), rtol=1e-11, sensitivities=["g", "e", "y(0)"]) for module in modules]
        losses = [module.gradient(sd.Loss(end=sp.Symbol("n") + sp.Symbol("y")), ["g", "e", "y(0)"], (0, 2), rtol=1e-11)
                  for module in modules]
    np.testing.assert_allclose(runs[0].sensitivity.matrix, runs[1].sensitivity.matrix, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(losses[0].array, losses[1].array, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(losses[0].array, runs[0].sensitivity.matrix[-1, [0, 2]].sum(axis=0), rtol=1e-8)


@cache
def hung() -> Any:
    """Two pairs of carts, each pair held together by a constraint that carries its bounce on."""
    system, pairs = sd.System("hung", gravity=[0, -9.81]), sd.coordinates("a1 a2 b1 b2")
    e = sd.parameters("e")
    for y in pairs:
        body = system.add_body(f"body {y.name}", mass=1 if y.name.endswith("1") else 0.5)
        system.add_joint(sd.Prismatic(f"fall {y.name}", system.ground, body, y, axis=[0, 1]))
    for first, second in (pairs[:2], pairs[2:]):
        system.add_constraint(first + second - 2, f"rope_{first.name}")
        system.add_event(f"hit_{first.name}", first - 0.5, direction=-1, reset={first.dot: -e * first.dot})
    system.defaults, system.initial = {e: 0.8}, dict.fromkeys(pairs, 1)
    return system.augmented().compile()


def pulled(t: Any, e: Any, height: Any) -> Any:
    """The first of a pair, which falls with a third of gravity and bounces at 1/2."""
    a = mp.mpf("9.81") / 3
    begin = mp.sqrt(2 * (height - mp.mpf("0.5")) / a)
    return mp.mpf("0.5") + e * a * begin * (t - begin) - a * (t - begin) ** 2 / 2


def test_bounces_that_constraints_carry_on() -> None:
    """Both heights of a pair are moved along the rope."""
    by = {"e": np.zeros(8), "a1(0)": np.array([1, -1, 0, 0, 0, 0, 0, 0])}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = hung().simulate(np.array([0, 0.8]), rtol=1e-11, sensitivities=by)
        gradient = hung().gradient(sd.Loss(end=sp.Symbol("a1") + sp.Symbol("b1") / 2), by, (0, 0.8), rtol=1e-11)
    by_e, by_height = derivatives(pulled, [0.8], {"e": 0.8, "a1(0)": 1.0})[0]
    exact = np.array([[by_e, by_height], [-by_e, -by_height], [by_e, 0], [-by_e, 0]])
    np.testing.assert_allclose(run.sensitivity.matrix[-1, :4], exact, atol=1e-9)
    np.testing.assert_allclose(gradient.array, [1.5 * by_e, by_height], atol=1e-9)
