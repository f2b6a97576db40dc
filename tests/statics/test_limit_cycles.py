"""Periodic motions whose period is searched for: limit cycles, from a guess of state and period."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pytest
import scipy.integrate
import scipy.optimize
import scipy.special

import symdyn as sd
from symdyn.errors import ArgumentError, NoEquilibrium
from tests.helpers import swept

# Period of van der Pol's oscillator with mu = 1. Source: Amore, Boyd and Fernandez, High order analysis of the limit cycle of the
# van der Pol oscillator, J. Math. Phys. 59 (2018).
PERIOD, AMPLITUDE = 6.6632868593231301896996820305, 2.00861986087484313650940188


@functools.cache
def van_der_pol() -> Any:
    q, mu = sd.coordinates("q"), sd.parameters("mu")
    s = sd.System("van_der_pol", planar=True)
    s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("mass", mass=1), q, axis=[1, 0]))
    s.add_joint_force("rail", mu * (1 - q**2) * q.dot - q)
    s.defaults = {mu: 1.0}
    return s.embedding().compile(backend="numpy")


@functools.cache
def contraction() -> float:
    """exp of the integral of the trace, mu (1 - q^2), over the published cycle: the multiplier that is not 1."""
    found = scipy.integrate.solve_ivp(lambda t, y: [y[1], (1 - y[0]**2) * y[1] - y[0], 1 - y[0]**2], (0, PERIOD),
                                      [AMPLITUDE, 0, 0], "DOP853", rtol=1e-13, atol=1e-13)
    assert np.allclose(found.y[:2, -1], [AMPLITUDE, 0], atol=1e-11)  # the source's numbers are those of a closed motion
    return math.exp(found.y[2, -1])


@pytest.mark.parametrize(("state", "guess"), [((1.8, 0.3), 6.0), *swept([((1.0, 0.0), 8.0)])])
def test_the_limit_cycle_of_van_der_pol(state: tuple[float, float], guess: float) -> None:
    """Period, multipliers and amplitude, from guesses that are wrong in the first digit."""
    found = van_der_pol().stability(dict(zip(("q", "q_dot"), state, strict=True)), period=guess)
    assert found.kind == "periodic motion" and found.verdict == "neutral"
    assert abs(found.period - PERIOD) < 1e-11 * PERIOD
    multipliers = np.sort(np.abs(found.multipliers))
    assert np.isclose(multipliers[0], contraction(), rtol=1e-9) and abs(multipliers[1] - 1) < 1e-10
    assert np.isclose(np.abs(found.motion[1][:, 0]).max(), AMPLITUDE, rtol=1e-3)
    assert f"from a guess of {guess:g} s for its period" in repr(found)


@functools.cache
def orbit() -> Any:
    """A mass in a plane: -w^2 (x, y) + c (1 - x^2 - y^2) (x_dot, y_dot), which leaves the circle of 1 m with speed w alone."""
    x, y = sd.coordinates("x y")
    w, c = sd.parameters("w c", positive=True)
    s = sd.System("orbit", planar=True)
    across, mass = s.add_body("across"), s.add_body("mass", mass=1)
    s.add_joint(sd.Prismatic("along x", s.ground, across, x, axis=[1, 0]))
    s.add_joint(sd.Prismatic("along y", across, mass, y, axis=[0, 1]))
    driven = c * (1 - x**2 - y**2)
    s.add_joint_force("along x", -w**2 * x + driven * x.dot)
    s.add_joint_force("along y", -w**2 * y + driven * y.dot)
    s.defaults = {w: 3.0, c: 0.5}
    return s.embedding().compile(backend="numpy")


def test_a_limit_cycle_in_a_plane() -> None:
    """In polar coordinates about the circle: rho_ddot = 2 w s, s_dot = -2 w rho_dot - 2 c w rho, so that
    l^3 + 4 w^2 l + 4 c w^2 = 0, and l = 0 along the circle."""
    w, c = 3.0, 0.5
    found = orbit().stability({"x": 1.03, "y": 0.0, "x_dot": 0.02, "y_dot": 3.1}, period=2.0)
    assert abs(found.period - 2 * math.pi / w) < 1e-11 and found.verdict == "unstable"
    expected = np.exp(np.array([0, *np.roots([1, 0, 4 * w**2, 4 * c * w**2])]) * found.period)
    for value in expected:
        assert np.abs(found.multipliers - value).min() < 1e-8 * abs(value)
    assert np.allclose(np.hypot(*found.motion[1][:, :2].T), 1, atol=1e-10)


@functools.cache
def swing() -> Any:
    theta = sd.coordinates("theta")
    s = sd.System("swing", gravity=[0, -9.81])
    s.add_joint(sd.Revolute("pivot", s.ground, s.add_body("bob", mass=1, com=[0, -1]), theta))
    return s.embedding().compile(backend="numpy")


def test_of_a_family_the_motion_of_the_given_period_is_found() -> None:
    """A pendulum swings with any period above 2 pi sqrt(l / g): 4 K(sin(a / 2)) sqrt(l / g) gives the amplitude a."""
    found = swing().stability({"theta": 1.0, "theta_dot": 0.0}, period=2.2)
    amplitude = scipy.optimize.brentq(lambda a: 4 * scipy.special.ellipk(math.sin(a / 2)**2) / math.sqrt(9.81) - 2.2, 0.5, 2.0)
    assert found.period == 2.2 and found.verdict == "drifts"
    theta, rate = found.motion[1][0]
    assert np.isclose(rate**2 / 2 - 9.81 * math.cos(theta), -9.81 * math.cos(amplitude), rtol=1e-9)


def test_where_there_is_no_limit_cycle_near_the_search_reports_it() -> None:
    with pytest.raises(ArgumentError, match=r"no single speed of rotation gives a period: pass period=\.\.\., in seconds, "
                                            r"a guess of it, if the motion is periodic"):
        van_der_pol().stability({"q": 1.0, "q_dot": 0.0})
    with pytest.raises(NoEquilibrium, match=r"found near the start: the search ended at a state of rest; begin nearer"):
        van_der_pol().stability({"q": 1.0, "q_dot": 0.0}, period=9.0)
    with pytest.raises(NoEquilibrium, match=r"the search for the period left the guess of 0.3 s for .* s; begin elsewhere"):
        van_der_pol().stability({"q": 2.0, "q_dot": 0.0}, period=0.3)
