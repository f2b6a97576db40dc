"""Sensitivities and gradients across resets that constraints carry on: closed forms, and differences of whole motions."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
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
from tests.helpers import swept

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


@cache
def carts() -> Any:
    """Three carts whose middle stays where it is; the first is hit, and the others share the impulse by their masses."""
    x1, x2, x3 = sd.coordinates("x1 x2 x3")
    m1, m2, m3, f, e = sd.parameters("m1 m2 m3 f e", positive=True)
    system = sd.System("carts")
    for x, m in ((x1, m1), (x2, m2), (x3, m3)):
        body = system.add_body(f"cart of {x}", mass=m)
        system.add_joint(sd.Prismatic(f"rail of {x}", system.ground, body, x, axis=[1, 0, 0]))
        system.add_force(body, [f if x is x1 else 0, 0, 0])
    system.add_constraint(x1 + x2 + x3, "middle")
    system.add_event("hit", x1 - e, direction=1, reset={x1.dot: -e * x1.dot})
    system.defaults, system.initial = {m1: 1.1, m2: 0.6, m3: 1.7, f: 2, e: 0.7}, {x1: 0}
    return system.augmented().compile()


def carried(t: Any, m1: Any, m2: Any, m3: Any, f: Any, e: Any) -> tuple[Any, Any]:
    """Position and speed of the second cart, t after the first has been hit once, from rest."""
    # M a + (1, 1, 1) lam = (f, 0, 0), and the sum of all a is zero.
    lam = f / m1 / (1 / m1 + 1 / m2 + 1 / m3)
    a1, a2 = (f - lam) / m1, -lam / m2
    begin = mp.sqrt(2 * e / a1)
    if t < begin:
        return a2 * t**2 / 2, a2 * t
    # The jumps of the others add up to that of the first, and their impulses are equal.
    speed = a2 * begin + (1 + e) * a1 * begin * m3 / (m2 + m3)
    return a2 * begin**2 / 2 + speed * (t - begin) + a2 * (t - begin) ** 2 / 2, speed + a2 * (t - begin)


@pytest.mark.parametrize("method", ["dop853", *swept(["taylor"]), "radau"])
def test_closed_form(method: str) -> None:
    times, at = np.linspace(0, 2, 9), {"m1": 1.1, "m2": 0.6, "m3": 1.7, "f": 2.0, "e": 0.7}
    run = carts().simulate(times, rtol=1e-12, method=method, sensitivities=list(at))
    assert len(run.events["hit"].t) == 1
    for k, name in enumerate(("x2", "x2_dot")):
        exact = derivatives(lambda *a, k=k: carried(*a)[k], times, at)
        assert np.abs(run.sensitivity.of(name) - exact).max() < 1e-10
    if method == "dop853":
        gradient = carts().gradient(sd.Loss(end=sd.coordinates("x2").dot), list(at), (0, 2), rtol=1e-12)
        np.testing.assert_allclose(gradient.array, exact[-1], rtol=0, atol=1e-10)


NUMBERS = {"m": 1.0, "M": 1.7, "l": 1.0, "g": 9.81, "e": 0.7}


@cache
def chain(kind: str) -> Any:
    """Two links on a cart whose tip stays at a height, which moves with the time in some cases: two free speeds."""
    x, a, b = sd.coordinates("x a b")
    m, M, l, g, e = sd.parameters("m M l g e", positive=True)
    system = sd.System("chain", gravity=[0, -g, 0])
    cart = system.add_body("cart", mass=M)
    upper = system.add_body("upper", mass=m, inertia=[0, 0, m * l**2 / 12], com=[l / 2, 0, 0])
    lower = system.add_body("lower", mass=m / 2, inertia=[0, 0, m * l**2 / 20], com=[l / 2, 0, 0])
    system.add_joint(sd.Prismatic("rail", system.ground, cart, x, axis=[1, 0, 0]))
    system.add_joint(sd.Revolute("shoulder", cart, upper, a))
    system.add_joint(sd.Revolute("elbow", upper, lower, b, parent_point=[l, 0, 0]))
    moving = sp.sin(sd.t) / 10 if kind == "time" else 0
    system.add_constraint(l * sp.sin(a) + l * sp.sin(a + b) + l / 2 - moving, "tip")
    resets = {"one": {a.dot: -e * a.dot}, "time": {a.dot: -e * a.dot + sd.t / 10}, "two": {a.dot: -e * a.dot, x.dot: l / 5},
              "other": {x.dot: x.dot + e}, "position": {a: a + e / 10, x: l / 5, a.dot: -a.dot},
              "free": {a: a + e / 10}, "at these": {a.dot: e - sp.Rational(7, 10), b.dot: 0}}
    system.add_event("hit", x - 0.2 if kind == "at these" else a + 1 + e / 10, reset=resets[kind])
    system.defaults, system.initial = {m: 1, M: 1.7, l: 1, g: 9.81, e: 0.7}, {x: 0, a: -0.6, b: 0.3}
    return system.augmented().compile()


def start(module: Any, numbers: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    found: tuple[np.ndarray, np.ndarray] = module.consistent(
        {"x": 0, "a": -0.6, "b": 0.3}, {"x_dot": 0.5, "a_dot": -0.3}, numbers, keep=["x", "a", "x_dot", "a_dot"])
    return found


def differences(module: Any, name: str, until: float) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of the state at the end and at the start by a number, by differences of sixth order of whole motions."""
    def ends(shift: float) -> np.ndarray:
        numbers = {**NUMBERS, name: NUMBERS[name] + shift}
        q, u = start(module, numbers)
        run = module.simulate((0, until), q, u, numbers, rtol=1e-13, atol=1e-14)
        return np.array([run.x[-1], np.concatenate([q, u])])
    h = 1e-4
    change = sum(w * (ends(k * h) - ends(-k * h)) for k, w in ((1, 45), (2, -9), (3, 1))) / (60 * h)
    return change[0], change[1]


@pytest.mark.parametrize("kind", ["one", "time", *swept(["two", "other"]), "position"])
def test_differences_of_whole_motions(kind: str) -> None:
    module, until = chain(kind), 0.9
    q, u = start(module, NUMBERS)
    of_start = [f"{name}(0)" for name in module.metadata.x]
    run = module.simulate((0, until), q, u, rtol=1e-12, atol=1e-13, sensitivities=[*NUMBERS, *of_start])
    assert len(run.events["hit"].t) >= 1
    matrix = run.sensitivity.matrix[-1]
    for k, name in enumerate(NUMBERS):
        end, begin = differences(module, name, until)
        np.testing.assert_allclose(matrix[:, k] + matrix[:, len(NUMBERS):] @ begin, end, rtol=0, atol=1e-9)
    symbols = sd.coordinates("x a b")
    weights = range(1, 7)
    loss = sd.Loss(end=sum(w * s for w, s in zip(weights, [*symbols, *[s.dot for s in symbols]], strict=True)))
    gradient = module.gradient(loss, run.sensitivity.names, (0, until), q, u, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(gradient.array, np.array(weights) @ matrix, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("kind", "message"), [
    ("free", "takes coordinates off the constraints and leaves some of them free, so that where they end has no derivative"),
    ("at these", "the constraints allow what the reset of an event makes of .* at these numbers alone: it has no derivative")])
def test_resets_without_a_derivative(kind: str, message: str) -> None:
    module = chain(kind)
    q, u = start(module, NUMBERS)
    with pytest.warns(SimulationWarning, match=message), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*nothing in this motion depends on e")  # up to there
        run = module.simulate((0, 0.5), q, u, sensitivities=["e"])
    assert not run.success and 0.2 < run.t[-1] < 0.3
    assert "(d x" not in run.message
    with pytest.raises(EvaluationError, match=message):
        module.gradient(sd.Loss(end=sd.coordinates("x")), ["e"], (0, 0.5), q, u)
