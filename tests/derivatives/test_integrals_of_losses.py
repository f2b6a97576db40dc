"""Integrals of losses that vary faster than the motion, have kinks or jumps: against quadrature of closed forms.

A mass on a spring, q = cos(w t) with w = sqrt(k): dq/dk = -t sin(w t)/(2 w).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import quad

import symdyn as sd
from symdyn.errors import SimulationWarning
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.integrating import quadrature

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")

Q = sd.coordinates("q")
K, P = sd.parameters("k p")
END, W = 2.0, 2.0


@cache
def module(event: bool = False) -> Any:
    system = sd.System("oscillator")
    body = system.add_body("body", mass=1)
    system.add_joint_force(system.add_joint(sd.Prismatic("slide", system.ground, body, Q, axis=[1, 0])), -K * Q)
    if event:
        system.add_event("zero", Q)
    system.add_state(sp.Symbol("z"), P)
    system.defaults, system.initial = {K: W**2, P: 0.7}, {Q: 1}
    return system.compile()


def exact(f: Callable[[float], float], slope: Callable[[float], float], breaks: list[float]) -> tuple[float, float]:
    """The integral of f(q), and its derivative by k without what jumps do."""
    options: dict[str, Any] = {"points": sorted(t for t in breaks if 0 < t < END), "limit": 500, "epsabs": 1e-12, "epsrel": 1e-12}
    by_k = lambda t: slope(np.cos(W * t)) * -t * np.sin(W * t) / (2 * W)
    return quad(lambda t: f(np.cos(W * t)), 0, END, **options)[0], quad(by_k, 0, END, **options)[0]


def times_at(q: float) -> list[float]:
    """When the motion passes a place."""
    first = float(np.arccos(q))
    return [first / W, (2 * np.pi - first) / W]


def by_jumps(q: float, size: float) -> float:
    """Contribution of jumps of the integrand by `size`, where q rises past a place, to the derivative by k: at each dt/dk = -t/(2
    k)."""
    return sum(-size * way * -t / (2 * W**2) for t, way in zip(times_at(q), (-1, 1), strict=True) if t < END)


CASES: dict[str, tuple[sp.Expr, Callable[[float], float], Callable[[float], float], list[float]]] = {
    "fast": (sp.sin(20 * Q) ** 2, lambda q: np.sin(20 * q) ** 2, lambda q: 20 * np.sin(40 * q), []),
    "narrow": (sp.exp(-1000 * (Q - 0.5) ** 2), lambda q: np.exp(-1000 * (q - 0.5) ** 2),
               lambda q: -2000 * (q - 0.5) * np.exp(-1000 * (q - 0.5) ** 2), times_at(0.5)),
    "abs": (abs(Q), abs, np.sign, times_at(0)),
    "max": (sp.Max(Q, 0), lambda q: max(q, 0), lambda q: float(q > 0), times_at(0)),
    "corner": (sp.Max(Q - sp.Rational(9, 10), 0) ** 2, lambda q: max(q - 0.9, 0) ** 2, lambda q: 2 * max(q - 0.9, 0),
               times_at(0.9))}


@pytest.mark.parametrize("method", ["dop853", "bs54"])
@pytest.mark.parametrize("name", CASES)
def test_what_varies_faster_than_the_motion(name: str, method: str) -> None:
    loss, f, slope, breaks = CASES[name]
    value, by_k = exact(f, slope, breaks)
    with warnings.catch_warnings():
        warnings.simplefilter("error", SimulationWarning)
        found = module().gradient(sd.Loss(integral=loss), ["k"], (0, END), rtol=1e-9, method=method)
    assert found.value == pytest.approx(value, rel=2e-8)
    assert found["k"] == pytest.approx(by_k, rel=0, abs=5e-7 * max(1.0, abs(by_k)))
    # Backwards in time, from the end.
    there = module().gradient(sd.Loss(integral=loss), ["k"], (END, 0), [np.cos(W * END)], [-W * np.sin(W * END)], rtol=1e-9)
    assert there.value == pytest.approx(-value, rel=2e-8)


@pytest.mark.parametrize("event", [False, True])
def test_jumps_move_with_the_motion(event: bool) -> None:
    found = module(event).gradient(sd.Loss(integral=sp.sign(Q)), ["k"], (0, END), rtol=1e-10)
    assert found.value == pytest.approx(2 * times_at(0)[0] - END, abs=1e-9)
    assert found["k"] == pytest.approx(by_jumps(0, 2), rel=1e-7)
    there = sd.Loss(integral=sp.Piecewise((Q**2, Q > 0.5), (0, True)))
    value, by_k = exact(lambda q: q**2 * (q > 0.5), lambda q: 2 * q * (q > 0.5), times_at(0.5))
    found = module(event).gradient(there, ["k", "q(0)"], (0, END), rtol=1e-10)
    assert found.value == pytest.approx(value, abs=1e-9)
    assert found["k"] == pytest.approx(by_k + by_jumps(0.5, 0.25), rel=1e-7)
    # q = q0 cos(w t) and t = arccos(0.5/q0)/w: 0.25 dt/dq0 = 0.25 0.5/(w sqrt(1 - 0.25)), once each way.
    along = quad(lambda t: 2 * np.cos(W * t) ** 2 * (np.cos(W * t) > 0.5), 0, END, points=times_at(0.5), epsabs=1e-13)[0]
    moved = 0.25 * 0.5 / (W * np.sqrt(0.75)) * sum(t < END for t in times_at(0.5))
    assert found["q(0)"] == pytest.approx(along + moved, rel=1e-7)


def test_jump_at_a_time_that_is_a_parameter() -> None:
    """The integral of 3 until p is 3 p."""
    found = module().gradient(sd.Loss(integral=sp.Piecewise((3, sd.t < P), (0, True))), ["p", "k"], (0, END))
    assert found.value == pytest.approx(2.1, abs=1e-7) and found["p"] == pytest.approx(3, rel=1e-9) and found["k"] == 0


def test_functions_of_the_user() -> None:
    at = lambda t, x, p: (abs(x[0]), np.array([np.sign(x[0]), 0, 0]))
    value, by_k = exact(abs, np.sign, times_at(0))
    found = module().gradient(sd.Loss(integral=at), ["k"], (0, END), rtol=1e-9)
    assert found.value == pytest.approx(value, rel=1e-8) and found["k"] == pytest.approx(by_k, abs=1e-7)
    steps = lambda t, x, p: (np.sign(x[0]), np.zeros(3))
    with pytest.warns(SimulationWarning, match=r"the integrand of the loss jumps near t = 0.7853.* lacks what moves the time"):
        found = module().gradient(sd.Loss(integral=steps), ["k"], (0, END))
    assert found.value == pytest.approx(2 * times_at(0)[0] - END, abs=1e-7)
    late = lambda t, x, p: ((t > 1) * x[0] ** 2, np.array([2 * (t > 1) * x[0], 0, 0]))
    with warnings.catch_warnings():
        warnings.simplefilter("error", SimulationWarning)
        found = module().gradient(sd.Loss(integral=late), ["k"], (0, END), rtol=1e-9)
    assert found.value == pytest.approx(quad(lambda t: np.cos(W * t) ** 2, 1, END)[0], abs=1e-8)


def test_a_pole_is_warned_of(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.warns(SimulationWarning, match=r"may be off by as much as .*: near t = 0.52.* system.add_state"):
        module().gradient(sd.Loss(integral=1 / (Q - 0.5)), ["k"], (0, END))
    monkeypatch.setattr(quadrature, "WORK", 10)
    with pytest.warns(SimulationWarning, match=r"may be off .*: near t = 0.7"):
        module().gradient(sd.Loss(integral=abs(Q)), ["k"], (0, END))


def test_smooth_losses_take_no_step_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(quadrature, "WORK", 0)  # whatever would be divided is warned of
    with warnings.catch_warnings():
        warnings.simplefilter("error", SimulationWarning)
        for rtol in (1e-4, 1e-8, 1e-12):
            found = module().gradient(sd.Loss(integral=Q**2 + Q.dot**2 * K), ["k"], (0, END), rtol=rtol)
            assert found.n_steps > 1
