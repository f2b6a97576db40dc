"""Derivatives of the user that contradict what they are of, or are not finite, are reported by name and number."""

from __future__ import annotations

import warnings
from functools import cache
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import ArgumentError, EvaluationError, SimulationWarning
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.contradicted import contradiction
from symdyn.runtime.integrating.compiled import shown_name

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


@cache
def module() -> Any:
    x, F = sd.coordinates("x"), sd.inputs("F")
    k = sd.parameters("k")
    system = sd.System("spring")
    body = system.add_body("body", mass=1)
    system.add_joint_force(system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=x)), F - k * x)
    system.defaults, system.initial = {k: 4}, {x: 1}
    return system.compile()


def test_slopes_by_differences() -> None:
    """sin(a) + b^3 at (1, 2): both slopes are known; kinks, and what is not defined nearby, are not judged."""
    x, rows = np.array([1.0, 2.0]), np.array([[np.cos(1.0), 12.0]])
    of = lambda v: np.array([np.sin(v[0]) + v[1] ** 3])
    assert contradiction(of, x, rows) is None
    found = contradiction(of, x, rows * [[1, 0]])
    assert found is not None
    direction = np.array([1.0, 2.0]) * (1 + 0.5 * np.cos(1.0 + 1.7 * np.arange(2)))
    assert found == pytest.approx((float((rows @ direction)[0]), float(np.cos(1.0) * direction[0])), rel=1e-8)
    assert contradiction(lambda v: np.abs(v - x).sum()[None], x, np.array([[1.0, 1.0]])) is None
    assert contradiction(lambda v: np.sqrt(1.0 - v[:1]) / 0, x, rows) is None  # not finite
    assert contradiction(lambda v: 1 / 0, x, rows) is None


def test_losses() -> None:
    right = lambda t, x, p: (p[0] * x[0] ** 2, np.array([2 * p[0] * x[0], 0]), np.array([x[0] ** 2]))
    with warnings.catch_warnings():
        warnings.simplefilter("error", SimulationWarning)
        module().gradient(sd.Loss(integral=right, end=right), ["k"], (0, 1))
    twice = lambda t, x, p: (x[0] ** 2, np.array([4 * x[0], 0]))
    message = r"spring: the function for the integral of the loss contradicts its derivatives: at t = 0 it changes by 2\.5\d* " \
              r"along a direction of the state, and by 5\.0\d* by the derivatives that it came with"
    with pytest.raises(ArgumentError, match=message):
        module().gradient(sd.Loss(integral=twice), ["k"], (0, 1))
    forgotten = lambda t, x, p: (p[0] * x[0] ** 2, np.array([2 * p[0] * x[0], 0]))
    with pytest.raises(ArgumentError, match=r"the end of the loss contradicts .* at t = 1 it .* of the parameters, and by 0"):
        module().gradient(sd.Loss(end=forgotten), ["k"], (0, 1))


def test_inputs() -> None:
    law = lambda t, x: -3 * x[0]
    asked: dict[str, Any] = {"t": (0, 1), "sensitivities": ["k"]}
    wrong = sd.Smooth(law, gradient=lambda t, x: np.array([3.0, 0]))
    message = r"the function of input F contradicts its derivatives: at t = 0 it changes by -3.8\d* along .* and by 3.8"
    with pytest.raises(ArgumentError, match=message):
        module().simulate(**asked, inputs={"F": wrong})
    with pytest.raises(ArgumentError, match=message):
        module().gradient(sd.Loss(end=sd.coordinates("x")), ["k"], (0, 1), inputs={"F": wrong})
    bad = lambda t, x: np.array([np.nan, 0])
    with pytest.raises(ArgumentError, match="the gradient of the function of input F is nan at t = 0"):
        module().simulate(**asked, inputs={"F": sd.Smooth(law, gradient=bad)})
    with pytest.warns(SimulationWarning, match="the gradient of the sampled controller of F is nan at t = 0"):
        module().simulate(**asked, inputs={"F": sd.Sampled(law, 0.1, gradient=bad)})
    late = sd.Smooth(law, gradient=lambda t, x: np.array([-3.0 if t < 0.5 else np.nan, 0]))
    with pytest.raises(EvaluationError, match=r"the gradient of the function of input F is nan at t = [01]"):
        module().gradient(sd.Loss(end=sd.coordinates("x")), ["k"], (0, 1), inputs={"F": late})
    raises = sd.Smooth(law, gradient=lambda t, x: np.array([1 / 0, 0]))
    with pytest.warns(SimulationWarning, match="the gradient of the function of input F raised ZeroDivisionError"):
        module().simulate(**asked, inputs={"F": raises})


def test_entries_of_columns_have_names() -> None:
    assert shown_name("(d x_dot by 1 m)") == "the derivative of x_dot by m" and shown_name("x_dot") == "x_dot"
    assert shown_name("(d q1 by 2 )") == "the derivative of q1 by an initial value"
