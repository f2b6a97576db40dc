"""Requests and results of a user: guesses of a trim, the verdict of a linearization, held dead points, gimbal lock."""

from __future__ import annotations

import functools
import math
from typing import Any

import pytest

import symdyn as sd
from symdyn.errors import ArgumentError

X, Y = sd.coordinates("x y")


@functools.cache
def pushed() -> Any:
    """k q + q^3 = F^2 - c: the input F has two values for each q."""
    q, F = sd.coordinates("q"), sd.inputs("F")
    k, c = sd.parameters("k c")
    s = sd.System("pushed", planar=True)
    s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("mass", mass=1), q, axis=[1, 0]))
    s.add_joint_force("rail", F**2 - c - k * q - q**3)
    s.defaults = {k: 8.0, c: 0.0}
    return s.embedding().compile(backend="numpy")


def test_a_start_of_a_trim_may_name_its_inputs_and_parameters() -> None:
    """9 = F^2 has two solutions, and the guess chooses; c = F^2 - 9."""
    fixed = {"q": 1.0}
    for guess in (2.0, -2.0):
        trim = pushed().equilibrium(free=["F"], fixed=fixed, start={"F": guess})
        assert trim["F"] == pytest.approx(math.copysign(3, guess), rel=1e-12)
    assert pushed().equilibrium(free=["c"], fixed=fixed, start={"c": 1.0}, inputs=[4.0])["c"] == pytest.approx(7.0, rel=1e-12)
    both = pushed().equilibrium(free=["F"], fixed=fixed, start={"F": -1.0, "q": 0.3}, params={"k": 3.0})
    assert both["F"] == pytest.approx(-2.0, rel=1e-12)
    with pytest.raises(ArgumentError, match=r"pushed: start names F, not among what is solved for \(nothing\); give values "
                                            r"in inputs, or name them in free"):
        pushed().equilibrium(start={"F": 2.0})
    with pytest.raises(ArgumentError, match="pushed: F in start and in inputs; leave it out of one of them"):
        pushed().equilibrium(free=["F"], fixed=fixed, start={"F": 2.0}, inputs={"F": 1.0})


def test_a_linearization_prints_its_verdict() -> None:
    rest = pushed().equilibrium()
    assert repr(pushed().linearize(rest)) == "<Linearization of pushed about an equilibrium: q; neutral>"
    assert "held: q; nothing is free to move>" in repr(pushed().linearize(pushed().equilibrium(fixed={"q": 0.0})))
    moving = repr(pushed().linearize({"q": 1.0}))
    assert "; no verdict: a verdict was requested at a state that is neither at rest" in moving and moving.count("pushed") == 1


@functools.cache
def wire() -> Any:
    """A mass on a wire y = x^2: y stands still at x = 0 while x moves."""
    s = sd.System("wire", gravity=[0, -9.81])
    across, bead = s.add_body("across"), s.add_body("bead", mass=1)
    s.add_joint(sd.Prismatic("along x", s.ground, across, X, axis=[1, 0]))
    s.add_joint(sd.Prismatic("along y", across, bead, Y, axis=[0, 1]))
    s.add_constraint(Y - X**2)
    return s.augmented().compile(backend="numpy")


def test_a_coordinate_that_is_held_at_its_dead_point_is_a_singular_configuration() -> None:
    """(2 x, -1) and (0, 1) have the rank 1 at x = 0 and 2 next to it."""
    bottom = {"x": 0.0, "y": 0.0}
    text = r"singular configuration: the constraints with what is held \(y\) have rank 1 here and rank 2 at positions nearby"
    linear = wire().linearize(bottom, fixed={"y": 0.0})
    with pytest.raises(ArgumentError, match=text):
        linear.modes()
    assert "no verdict" in repr(linear) and "singular configuration" in linear.describe()
    found = wire().stability(bottom, fixed={"y": 0.0})
    assert found.verdict == "not decided" and "with what is held (y)" in repr(found)
    assert wire().linearize(bottom).verdict == "neutral" and wire().linearize(bottom, fixed={"x": 0.0}).verdict == ""
    assert wire().linearize({"x": 0.5, "y": 0.25}, fixed={"y": 0.25}).A.shape == (0, 0)


def test_gimbal_lock_is_named_with_what_to_do() -> None:
    s = sd.System("top", gravity=[0, 0, -9.81])
    body = s.add_body("body", mass=1, inertia=[0.1, 0.2, 0.3], com=[0, 0, -0.2])
    s.add_joint(sd.Spherical("ball", s.ground, body, sd.coordinates("a b c"), sd.EulerAngles("ZYX")))
    module = s.embedding().compile(backend="numpy")
    locked = module.linearize({"b": math.pi / 2})
    text = r"top: {} requested at gimbal lock: b = 90 deg; .*; use Euler parameters \(.*\), or another order of the angles"
    with pytest.raises(ArgumentError, match=text.format("modes were")):
        locked.modes()
    with pytest.raises(ArgumentError, match=text.format("the stability was")):
        module.stability({"b": math.pi / 2})
    with pytest.raises(ArgumentError, match=r"at gimbal lock of three angles use Euler parameters"):
        locked.describe()
    assert "no verdict: a verdict was requested at gimbal lock" in repr(locked)
