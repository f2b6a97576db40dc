"""Sensitivities of motions whose inputs follow the state by a function of the user with a gradient, against the same law in the
loads, whose derivatives symdyn derives itself."""

from __future__ import annotations

import warnings
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError
from symdyn.runtime.building.compiler import find_compiler
from tests.helpers import swept

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")

NAMES = ["m", "l", "M0", "q(0)", "x_dot(0)"]


@cache
def cart(closed: bool) -> Any:
    """A cart with a pendulum, a force on it and a torque in the hinge; closed: the laws as expressions of its loads."""
    x, q, n = sd.coordinates("x q n")
    M, m, l, m0 = sd.parameters("M m l M0", positive=True)
    F, T = sd.inputs("F T")
    force, torque = -2 * x + sp.sin(q) - x.dot**3 / 5, -q.dot * sp.cos(sd.t)
    system = sd.System("cart", gravity=[0, -9.81])
    wagon, bob = system.add_body("wagon", mass=M + m0), system.add_body("bob", mass=m, com=[0, -l])
    rail = system.add_joint(sd.Prismatic("rail", system.ground, wagon, axis=[1, 0], coordinate=x))
    hinge = system.add_joint(sd.Revolute("hinge", wagon, bob, coordinate=q))
    system.add_joint_force(rail, force if closed else F, name="drive")
    system.add_joint_force(hinge, torque if closed else T, name="motor")
    system.add_state(n, x.dot**2)
    system.add_event("swings", q, reset={n: n + q.dot})
    system.add_output("power", (force if closed else F) * x.dot)
    system.defaults, system.initial = {M: 1, m: 0.5, l: 0.7, m0: 0.2}, {x: 0.3, q: 1.0, q.dot: 0.1}
    return system.embedding().compile()


def order() -> list[int]:
    """Places of x, q, x_dot, q_dot, n in the state."""
    return [cart(False).metadata.x.index(name) for name in ("x", "q", "x_dot", "q_dot", "n")]


def laws() -> dict[str, Any]:
    x, q, v, w, _ = order()

    def row(**entries: float) -> list[float]:
        found = np.zeros(5)
        for place, value in entries.items():
            found[{"x": x, "q": q, "v": v, "w": w}[place]] = value
        return found.tolist()

    force = sd.Smooth(lambda t, s: -2 * s[x] + np.sin(s[q]) - s[v] ** 3 / 5,
                      gradient=lambda t, s: row(x=-2, q=np.cos(s[q]), v=-0.6 * s[v] ** 2))
    torque = sd.Smooth(lambda t, s: -s[w] * np.cos(t), gradient=lambda t, s: row(w=-np.cos(t)))
    return {"F": force, "T": torque}


@pytest.mark.parametrize("method", ["dop853", "bs54", "radau"])
def test_like_the_law_in_the_loads(method: str) -> None:
    """Through events and resets, and of outputs that depend on the inputs."""
    times = np.linspace(0, 2, 17)
    expected = cart(True).simulate(times, rtol=1e-10, sensitivities=NAMES)
    assert len(expected.events["swings"].t) >= 2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = cart(False).simulate(times, inputs=laws(), rtol=1e-10, method=method, sensitivities=NAMES)
    scale = np.abs(expected.sensitivity.matrix).max()
    np.testing.assert_allclose(found.sensitivity.matrix, expected.sensitivity.matrix, rtol=0, atol=1e-7 * scale)
    np.testing.assert_allclose(found.sensitivity.of("power"), expected.sensitivity.of("power"), rtol=0, atol=1e-6 * scale)
    np.testing.assert_allclose(found.sensitivity.at(times[9]), found.sensitivity.matrix[9], rtol=0, atol=1e-12 * scale)


def test_one_function_for_all_inputs_and_one_next_to_a_controller() -> None:
    times, of = np.linspace(0, 1, 9), laws()
    both = sd.Smooth(lambda t, x: [of["F"](t, x), of["T"](t, x)],
                     gradient=lambda t, x: [of["F"].gradient(t, x), of["T"].gradient(t, x)])
    apart, together = (cart(False).simulate(times, inputs=given, rtol=1e-9, sensitivities=NAMES) for given in (of, both))
    np.testing.assert_allclose(together.sensitivity.matrix, apart.sensitivity.matrix, rtol=1e-12, atol=1e-12)
    held = {"F": of["F"], "T": sd.Sampled(lambda t, x: -x[order()[3]], 0.25, gradient=lambda t, x: -np.eye(5)[order()[3]])}
    run = cart(False).simulate(times, inputs=held, rtol=1e-11, sensitivities=["m", "q(0)"])
    h = 1e-5
    for name, more in (("m", lambda way: {"params": {"m": 0.5 + way * h}}), ("q(0)", lambda way: {"q": {"q": 1.0 + way * h}})):
        ends = [cart(False).simulate(times, inputs=held, rtol=1e-12, **more(way)) for way in (-1, 1)]
        difference = (ends[1].x - ends[0].x) / (2 * h)
        np.testing.assert_allclose(run.sensitivity[name], difference, rtol=0, atol=1e-6 * np.abs(difference).max())
        powers = (ends[1].outputs["power"] - ends[0].outputs["power"]) / (2 * h)
        found = run.sensitivity.of("power")[:, run.sensitivity.names.index(name)]
        np.testing.assert_allclose(found, powers, rtol=0, atol=1e-6 * np.abs(powers).max())


@pytest.mark.parametrize("name", ["F", "T"])
def test_outputs_and_motions_where_one_of_the_inputs_is_held(name: str) -> None:
    """An output that holds a sampled input, against differences."""
    law = sd.Sampled(lambda t, x: -3 * x[order()[0]], 0.2, gradient=lambda t, x: -3 * np.eye(5)[order()[0]])
    given = {"F": 1.0, "T": 0.1, name: law}
    times, h = np.linspace(0, 1, 11) + 0.01, 1e-5
    run = cart(False).simulate(times, inputs=given, rtol=1e-11, sensitivities=["m"])
    ends = [cart(False).simulate(times, inputs=given, rtol=1e-12, params={"m": 0.5 + way * h}) for way in (-1, 1)]
    moved = (ends[1].x - ends[0].x) / (2 * h)
    np.testing.assert_allclose(run.sensitivity["m"], moved, rtol=0, atol=1e-6 * np.abs(moved).max())
    difference = (ends[1].outputs["power"] - ends[0].outputs["power"]) / (2 * h)
    np.testing.assert_allclose(run.sensitivity.of("power")[:, 0], difference, rtol=0, atol=1e-6 * np.abs(difference).max())


@pytest.mark.parametrize("method", ["dop853", *swept(["bs54"])])
def test_gradients_backwards(method: str) -> None:
    """Gradients of a loss with the inputs in it, across events with resets, and without them."""
    x, F, T = sp.symbols("x F T")
    values = dict(zip(("x", "q", "x_dot", "q_dot"), sp.symbols("x q x_dot q_dot"), strict=True))
    force = -2 * values["x"] + sp.sin(values["q"]) - values["x_dot"] ** 3 / 5
    torque = -values["q_dot"] * sp.cos(sd.t)
    loss = sd.Loss(integral=x**2 + F**2 * T, end=sp.Symbol("n") + F)
    same = sd.Loss(integral=x**2 + force**2 * torque, end=sp.Symbol("n") + force)
    for events in (True, False):
        expected = cart(True).gradient(same, NAMES, (0, 2), rtol=1e-11, events=events)
        found = cart(False).gradient(loss, NAMES, (0, 2), inputs=laws(), rtol=1e-11, events=events, method=method)
        assert found.value == pytest.approx(expected.value, rel=1e-8)
        np.testing.assert_allclose(found.array, expected.array, rtol=0, atol=1e-7 * np.abs(expected.array).max())


def test_gradient_backwards_next_to_a_controller() -> None:
    given = {"F": laws()["F"], "T": sd.Sampled(lambda t, x: -x[order()[3]], 0.25, gradient=lambda t, x: -np.eye(5)[order()[3]])}
    names = ["m", "q(0)"]
    run = cart(False).simulate((0, 1), inputs=given, rtol=1e-11, sensitivities=names)
    found = cart(False).gradient(sd.Loss(end=sp.Symbol("x")), names, (0, 1), inputs=given, rtol=1e-11)
    np.testing.assert_allclose(found.array, run.sensitivity.of("x")[-1], rtol=1e-8)


def test_what_does_not_fit() -> None:
    asked: dict[str, Any] = {"t": (0, 1), "sensitivities": ["m"]}
    of = laws()
    with pytest.raises(ArgumentError, match=r"whose derivatives are not known: T; pass sd.Smooth\(function, gradient=...\)"):
        cart(False).simulate(**asked, inputs={"F": of["F"], "T": lambda t, x: -x[order()[3]]})
    with pytest.raises(ArgumentError, match=r"the gradient of sd.Smooth must be a function of \(t, x\), or None, found 3"):
        sd.Smooth(lambda t, x: 0.0, gradient=3)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match=r"the gradient of the function of input F returned \[1, 2\] at t = 0; needed are 5"):
        cart(False).simulate(**asked, inputs={"F": sd.Smooth(lambda t, x: x[0], gradient=lambda t, x: [1, 2])})
    assert cart(False).simulate(**asked, inputs={"F": lambda t, x: np.sin(t)}).success
