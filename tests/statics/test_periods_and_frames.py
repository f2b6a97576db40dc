"""Periods that are none, motions that must not be moved, frequencies that do not depend on the choice of coordinates."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError
from tests.helpers import swept
from tests.statics.test_velocity_constraints import DISC, circling, circular_state, disc


@functools.cache
def parametric() -> Any:
    """q_ddot + c q_dot + (1 + eps sin(w t)) q = 0: in resonance at w = 2."""
    q = sd.coordinates("q")
    eps, w, c = sd.parameters("eps w c")
    s = sd.System("parametric", planar=True)
    s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("mass", mass=1), q, axis=[1, 0]))
    s.add_joint_force("rail", -(1 + eps * sp.sin(w * sd.t)) * q - c * q.dot)
    s.defaults = {eps: 0.02, w: 2.0, c: 1e-4}
    return s.embedding().compile()


def test_half_a_period_is_no_period() -> None:
    """At half a period A is what it was at the start, by chance; the verdict would be the opposite."""
    assert parametric().stability({"q": 0, "q_dot": 0}, period=math.pi).verdict == "unstable"
    with pytest.raises(ArgumentError, match=r"do not repeat after 1.5708 s: forces at t = .* differ at the same position"):
        parametric().stability({"q": 0, "q_dot": 0}, period=math.pi / 2)
    with pytest.raises(ArgumentError, match="pass a period in seconds, found True"):
        parametric().stability(period=True)


def test_a_period_of_forces_that_is_not_theirs() -> None:
    """The equations depend on t by a force alone, which the state matrix does not show."""
    q = sd.coordinates("q")
    s = sd.System("driven", planar=True)
    s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("mass", mass=1), q, axis=[1, 0]))
    s.add_joint_force("rail", sp.cos(2 * sd.t) - 10 * q - q**3 / 10 - 0.3 * q.dot)
    module = s.embedding().compile()
    assert module.stability(period=math.pi).verdict == "stable"
    with pytest.raises(ArgumentError, match="do not repeat after 3 s"):
        module.stability(period=3.0)


@pytest.mark.parametrize("turn", [0.4, *swept([1.5])])
def test_a_motion_that_nothing_holds_is_judged_where_it_is(turn: float) -> None:
    """A disc in a circle, without its period: the disc spins faster than it goes round, and is not moved onto another motion."""
    theta = 1.2
    omega_3 = (0.25 * turn**2 * math.cos(theta) - math.cos(theta) / math.sin(theta)) / (1.5 * turn)
    found = disc().stability(circular_state(theta, turn, omega_3), params=DISC)
    assert np.isclose(found.period, 2 * math.pi / turn, rtol=1e-12) and "Newton" not in repr(found)
    expected = np.exp(1j * math.sqrt(-circling(theta, turn, omega_3)) * found.period)
    assert np.abs(found.multipliers - expected).min() < 1e-9 and found.verdict == "drifts"


def spinning_body(three: bool) -> Any:
    """A body that is not round on springs against two angles, spinning with the third: as one joint, or as three hinges."""
    a, b, c = sd.coordinates("a b c")
    s = sd.System("three" if three else "one")
    body = s.add_body("body", mass=1, inertia=[0.5, 1, 1.3])
    if three:
        outer, inner = s.add_body("outer"), s.add_body("inner")
        s.add_joint_force(s.add_joint(sd.Revolute("first", s.ground, outer, a, axis=[0, 0, 1])), -20 * a)
        s.add_joint_force(s.add_joint(sd.Revolute("second", outer, inner, b, axis=[0, 1, 0])), -20 * b)
        s.add_joint(sd.Revolute("third", inner, body, c, axis=[1, 0, 0]))
    else:
        joint = s.add_joint(sd.Spherical("ball", s.ground, body, orientation=sd.EulerAngles("ZYX"), coordinates=[a, b, c]))
        s.add_joint_force(joint, [-20 * a, -20 * b, 0])
    return s.embedding().compile()


def test_the_fixed_frame_sees_the_same_whatever_the_joints_are() -> None:
    """Against the spectrum of a simulation: what tilts shows two lines, those of the two modes."""
    W = 3.0
    modules = [spinning_body(three) for three in (False, True)]
    found = [np.sort([m.damped_frequency for m in module.stability({"c_dot": W}).modes if m.kind != "zero"])
             for module in modules]
    assert len(found[0]) == 2 and np.allclose(found[0], found[1], rtol=1e-9)
    length, count = 400.0, 2**14
    sol = modules[1].simulate(np.arange(count) * length / count, q=[1e-6, 0, 0], u=[0, 0, W], rtol=1e-10, atol=1e-16)
    lines = np.abs(np.fft.rfft(sol.q[:, 0] * np.hanning(count)))
    peaks = [k for k in range(1, len(lines) - 1) if lines[k] > max(lines[k - 1], lines[k + 1]) and lines[k] > 0.2 * lines.max()]
    assert len(peaks) == 2 and np.allclose(np.array(peaks) / length, found[0], atol=1 / length)


def test_a_guess_of_a_rest_is_taken_to_it() -> None:
    theta = sd.coordinates("theta")
    s = sd.System("pendulum", gravity=[0, -9.81])
    s.add_joint(sd.Revolute("hinge", s.ground, s.add_body("rod", mass=1, com=[0, -1]), theta))
    module = s.embedding().compile()
    assert [module.stability(start={"theta": at}).verdict for at in (3.0, 0.2)] == ["unstable", "neutral"]
    held = module.stability(fixed={"theta_dot": 1.0})
    assert held.verdict == "" and "nothing is free to move" in repr(held)
    assert module.stability({"theta": 0.0, "theta_dot": 0.0}, period=1e300).kind == "rest"


def test_a_table_of_a_singular_configuration_names_it() -> None:
    module = sd.systems.n_four_bar(1).augmented().compile()
    flat = {"theta0": math.pi / 2, "theta1": math.pi / 2, "phi1": -math.pi / 2, "theta0_dot": 0, "theta1_dot": 0, "phi1_dot": 0}
    assert "singular configuration" in module.linearize(flat, params={"g": 0.0}).describe()
