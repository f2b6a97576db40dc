"""Sensitivities of motions under sampled controllers, whose held values depend on the state, against closed forms."""

from __future__ import annotations

from functools import cache
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import ArgumentError
from symdyn.runtime.building.compiler import find_compiler
from tests.derivatives.test_sensitivities import derivatives

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")

PERIOD = 0.125


@cache
def mass() -> Any:
    q = sd.coordinates("q")
    m = sd.parameters("m", positive=True)
    F = sd.inputs("F")
    system = sd.System("mass")
    body = system.add_body("body", mass=m)
    joint = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=q))
    system.add_joint_force(joint, F, name="drive")
    system.defaults, system.initial = {m: 2}, {q: 1}
    return system.embedding().compile()


def controlled(t: Any, m: Any, start: Any, delay: int) -> tuple[Any, Any]:
    """Place and speed under F = -4 q^3 - 1.5 q_dot, sampled and held, that takes effect `delay` periods later."""
    q, v, waiting = start, mp.mpf(0), [mp.mpf(0)] * delay
    while True:
        waiting.append(-4 * q**3 - mp.mpf(1.5) * v)
        a = waiting.pop(0) / m
        h = min(t, mp.mpf(PERIOD))
        q, v, t = q + v * h + a * h * h / 2, v + a * h, t - h
        if t <= 0:
            return q, v


@pytest.mark.parametrize("delay", [0, 1, 2])
@pytest.mark.parametrize("method", ["dop853", "radau"])
def test_cubic_controller(method: str, delay: int) -> None:
    times, at = np.linspace(0, 3, 25) + 0.01, {"m": 2.0, "q(0)": 1.0}
    times[0] = 0.0
    law = sd.Sampled(lambda t, x: -4 * x[0] ** 3 - 1.5 * x[1], PERIOD, delay=delay * PERIOD,
                     gradient=lambda t, x: [-12 * x[0] ** 2, -1.5])
    run = mass().simulate(times, inputs={"F": law}, rtol=1e-11, method=method, sensitivities=list(at))
    for k, name in enumerate(("q", "q_dot")):
        exact = derivatives(lambda *a, k=k: controlled(*a, delay)[k], times, at)
        assert np.abs(run.sensitivity.of(name) - exact).max() < 1e-10
    np.testing.assert_array_equal(run.sensitivity.at(times[7]), run.sensitivity.matrix[7])


def test_what_does_not_fit() -> None:
    asked: dict[str, Any] = {"t": (0, 1), "sensitivities": ["m"]}
    with pytest.raises(ArgumentError, match=r"of a sampled controller by the state are not known; pass sd.Sampled\(function, "
                                            r"period, gradient=...\)"):
        mass().simulate(**asked, inputs={"F": sd.Sampled(lambda t, x: -x[0], PERIOD)})
    with pytest.raises(ArgumentError, match=r"the gradient of .* returned 3.0 at t = 0; needed are 2 numbers for each"):
        mass().simulate(**asked, inputs={"F": sd.Sampled(lambda t, x: -x[0], PERIOD, gradient=lambda t, x: 3.0)})
    with pytest.raises(ArgumentError, match=r"the gradient of a sampled controller must be a function of \(t, x\), or None"):
        sd.Sampled(lambda t, x: -x[0], PERIOD, gradient=[1, 2])  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match="by the input F was asked for, which varies over time here"):
        law = sd.Sampled(lambda t, x: -x[0], PERIOD, gradient=lambda t, x: [-1, 0])
        mass().simulate((0, 1), sensitivities=["F"], inputs={"F": law})
