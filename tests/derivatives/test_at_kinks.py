"""Derivatives of motions that stay at a kink and of losses that end at one are warned of; what passes a kink has derivatives."""

from __future__ import annotations

import warnings
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import SimulationWarning
from symdyn.runtime.integrating import at_breaks
from symdyn.runtime.module import Module

x, v = sp.symbols("x x_dot")


@cache
def slider(law: str = "-k*Abs(x)") -> Module:
    q, k = sd.coordinates("x"), sd.parameters("k")
    system = sd.System("slider")
    body = system.add_body("body", mass=1)
    slide = system.add_joint(sd.Prismatic("slide", system.ground, body, q, axis=[1, 0]))
    laws = {"-k*Abs(x)": -k * sp.Abs(q), "-k*x": -k * q, "-k*x*Abs(x)": -k * q * sp.Abs(q), "max": -k * sp.Max(q, 0)}
    system.add_joint_force(slide, laws[law])
    system.defaults = {k: 2}
    return system.compile(backend="c")


@pytest.mark.parametrize("law", ["-k*Abs(x)", "max"])
def test_a_motion_that_stays_at_a_kink(law: str) -> None:
    text = "slider: x stays at 0, where the equations have a kink: derivatives differ from side to side there"
    with pytest.warns(SimulationWarning, match=text):
        sol = slider(law).simulate((0, 1), q=[0.0], sensitivities=["x(0)"])
    assert sol.sensitivity["x(0)"].shape == (1001, 2)  # kept
    with pytest.warns(SimulationWarning, match=text):
        found = slider(law).gradient(sd.Loss(end=v), ["x(0)"], (0, 1), q=[0.0])
    assert np.isfinite(found["x(0)"])


@pytest.mark.parametrize(("loss", "text"), [
    ({"end": sp.Abs(x)}, r"the motion ends with x = 0, where the end of the loss has a kink"),
    ({"integral": sp.Abs(x)}, r"x stays at 0, where the integral of the loss has a kink"),
    ({"end": lambda t, x, p: (abs(x[0]), np.sign(x))}, r"the motion ends with x = 0, where the end of the loss has a kink")])
def test_losses_at_a_kink(loss: dict[str, Any], text: str) -> None:
    with pytest.warns(SimulationWarning, match=text):
        assert slider("-k*x").gradient(sd.Loss(**loss), ["x(0)"], (0, 1), q=[0.0]).value == 0


def passed(start: complex) -> np.ndarray:
    """[x; x_dot] after 1 s from a start x < 0 with the speed 1 by the force -2 |x|: it grows up to x = 0, then it swings."""
    w = np.sqrt(2)
    t = np.arctanh(-start * w) / w
    fast, left = np.cosh(w * t) + start * w * np.sinh(w * t), w * (1 - t)
    return np.array([fast / w * np.sin(left), fast * np.cos(left)])


def test_what_has_derivatives() -> None:
    """A kink that is passed, against the derivative of its closed form; a law that bends without a kink; losses that are not at
    theirs."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sol = slider().simulate(np.array([0, 1.0]), q=[-0.2], u=[1.0], sensitivities=["x(0)"], rtol=1e-11)
        assert np.abs(sol.sensitivity["x(0)"][-1] - passed(-0.2 + 1e-200j).imag / 1e-200).max() < 1e-8
        found = slider().gradient(sd.Loss(end=sp.Abs(x)), ["x(0)"], (0, 1), q=[-0.2], u=[1.0], rtol=1e-11)
        # One step, whose length follows from the error of the state, goes across the kink.
        assert found["x(0)"] == pytest.approx(sol.sensitivity["x(0)"][-1, 0], rel=2e-4)
        slider("-k*x*Abs(x)").simulate((0, 1), q=[0.0], sensitivities=["x(0)"])
        slider("-k*x").gradient(sd.Loss(integral=x**2, end=x**2), ["x(0)"], (0, 1), q=[0.0])


@pytest.mark.parametrize("method", ["dop853", "bs54"])
@pytest.mark.parametrize("law", ["max", "pieces"])
def test_gradient_across_a_stop_against_its_closed_form(law: str, method: str) -> None:
    """A free mass runs against a spring at p and comes back: x = 2 p - v T + v pi/sqrt(k) at T."""
    x = sd.coordinates("x")
    k, p = sd.parameters("k p")
    system = sd.System("stop")
    body = system.add_body("body", mass=1)
    slide = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=x))
    force = {"max": sp.Max(x - p, 0), "pieces": sp.Piecewise((x - p, x > p), (0, True))}[law]
    system.add_joint_force(slide, -k * force)
    system.defaults = {k: 30, p: 0.7}
    module, end, v = system.compile(), 3.0, 1.2
    with warnings.catch_warnings():
        warnings.simplefilter("error", SimulationWarning)
        found = module.gradient(sd.Loss(end=x), ["p", "k", "x(0)", "x_dot(0)"], (0, end), [0], [v], rtol=1e-9, method=method)
    assert found.value == pytest.approx(1.4 - v * end + v * np.pi / np.sqrt(30), abs=3e-8)
    expected = [2, -v * np.pi / 2 / 30**1.5, -1, -end + np.pi / np.sqrt(30)]
    np.testing.assert_allclose(found.array, expected, atol=1e-6)


def test_too_many_kinks_are_warned_of(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(at_breaks, "WORK", 5)
    x = sd.coordinates("x")
    system = sd.System("rectified")
    body = system.add_body("body", mass=1)
    slide = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=x))
    system.add_joint_force(slide, -4 * x + abs(sp.sin(5 * sd.t)))
    message = r"rectified: the motion passes kinks of the equations too often .*: at \d+ of them, the first near t = 0.*events"
    with pytest.warns(SimulationWarning, match=message):
        system.compile().gradient(sd.Loss(end=x), ["x(0)"], (0, 3))
