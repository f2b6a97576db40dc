"""Periodic motions with rigid contacts, against published digits and a closed form."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.runtime.building.compiler import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


def walker_system(ahead: float = 0.15, law: str = "rigid") -> sd.System:
    """The simplest walker (Garcia, Chatterjee, Ruina and Coleman 1998) with feet of mass m: a hip on two legs of length 1 whose
    feet touch the slope with much friction. A foot is ignored until it is `ahead` of the other one: in mid-swing it scuffs."""
    x, y, left, right = sd.coordinates("x y left right")
    m, slope = sd.parameters("m slope")
    system = sd.System("walker", gravity=[sp.sin(slope), -sp.cos(slope)])
    system.defaults = {m: 1e-3, slope: 0.009}
    carrier, hip = system.add_body("carrier"), system.add_body("hip", mass=1.0)
    system.add_joint(sd.Prismatic("along", system.ground, carrier, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("across", carrier, hip, axis=[0, 1], coordinate=y))
    for leg, other in ((left, right), (right, left)):
        body = system.add_body(leg.name, mass=m, inertia=0, com=[0, -1])
        system.add_joint(sd.Revolute(f"{leg.name}_joint", hip, body, coordinate=leg))
        system.add_contact(sd.Contact(f"{leg.name}_foot", body, system.ground, shape=sd.contacts.Point([0, -1]), friction=5,
                                      law=law, ignored=ahead - sp.sin(leg) + sp.sin(other)))
    return system


@cache
def walker() -> Any:
    return walker_system().compile()


def after_heel_strike(angle: float, speed: float) -> tuple[list[float], list[float]]:
    """The state on the left foot with the right one behind, by the angle of the stance leg and its rate."""
    behind = speed * np.cos(2 * angle)
    return ([-np.sin(angle), np.cos(angle), angle, -angle],
            [-np.cos(angle) * speed, -np.sin(angle) * speed, speed, behind])


def to_zero(at: list[float], values: list[float]) -> float:
    """The value at 0 of the polynomial through values (Neville)."""
    y = list(values)
    for j in range(1, len(at)):
        y = [(at[i] * y[i + 1] - at[i + j] * y[i]) / (at[i] - at[i + j]) for i in range(len(y) - 1)]
    return y[0]


def test_a_step_with_light_feet_comes_back() -> None:
    """Near the published one of feet without mass; along the slope steps may begin anywhere."""
    m = 1e-3
    middle = walker().simulate((0, 1.0), *after_heel_strike(0.19393737, -0.20386693), {"m": m}, rtol=1e-10).x[-1]
    gait = walker().periodic(3.1, middle[:4], middle[4:], {"m": m}, cyclic=["x"], exchange=[("left", "right")], rtol=1e-10)
    later = walker().simulate((0, gait.period), gait.x[:4], gait.x[4:], {"m": m}, rtol=1e-10).x[-1]
    back = later[[0, 1, 3, 2, 4, 5, 7, 6]] - gait.x
    assert np.abs(back[1:]).max() < 1e-7 and back[0] > 0.3
    sizes = np.sort(np.abs(gait.multipliers))
    assert len(sizes) == 4 and sizes[0] < 1e-9 and sizes[2] == pytest.approx(1, abs=1e-7) and not gait.stable
    assert gait.period == pytest.approx(3.0961058680777, abs=4 * m) and sizes[3] == pytest.approx(4.00386436, abs=40 * m)


@pytest.mark.sweep
def test_short_gait_of_the_simplest_walker() -> None:
    """Published digits are those of feet without mass: gaits with feet of 0.00025 to 0.004 of the hip's mass, taken to none."""
    masses, found = [4e-3 / 2**k for k in range(5)], []
    for m in masses:
        middle = walker().simulate((0, 1.0), *after_heel_strike(0.19393737, -0.20386693), {"m": m}, rtol=1e-10).x[-1]
        gait = walker().periodic(3.1, middle[:4], middle[4:], {"m": m}, cyclic=["x"], exchange=[("left", "right")], rtol=1e-13)
        strike = walker().simulate((0, 3), gait.x[:4], gait.x[4:], {"m": m}, rtol=1e-13).events["right_foot_closes"].x[0]
        sizes = np.sort(np.abs(gait.multipliers))
        assert len(sizes) == 4 and sizes[0] < 1e-9 and sizes[2] == pytest.approx(1, abs=1e-8) and not gait.stable
        found.append([gait.period, sizes[3], sizes[1], -strike[2], np.cos(2 * strike[2]) * strike[6]])
    period, leaves, dies, angle, speed = (to_zero(masses, [one[k] for one in found]) for k in range(5))
    assert period == pytest.approx(3.0961058680777, abs=3e-11)
    assert [leaves, dies] == pytest.approx([4.00386436, 0.45958959], abs=1e-8)
    assert [angle, speed] == pytest.approx([0.19393737, -0.20386693], abs=1e-8)


@pytest.mark.sweep
def test_two_steps_have_the_squares_of_the_multipliers_of_one() -> None:
    """Without the exchange of the legs a period is two steps. The long gait is stable."""
    middle = walker().simulate((0, 1.0), *after_heel_strike(0.20031090, -0.19983247), rtol=1e-10).x[-1]
    one, two = (walker().periodic(period, middle[:4], middle[4:], cyclic=["x"], rtol=1e-12, **how)
                for period, how in ((3.88, {"exchange": [("left", "right")]}), (7.76, {})))
    assert one.stable and two.stable and two.period == pytest.approx(2 * one.period, abs=1e-9)
    assert np.sort(np.abs(two.multipliers)) == pytest.approx(np.sort(np.abs(one.multipliers)) ** 2, abs=1e-7)
    gained = one.simulate().q[[0, -1], 0]
    assert np.ptp(gained) == pytest.approx(2 * np.sin(0.2), rel=0.01)
    steeper = one.follow("slope", [0.01])[0]
    assert steeper.residual < 1e-8 and steeper.params[list(walker().metadata.parameters).index("slope")] == 0.01
    branch = one.branch("slope", 0.008, 0.02, step=0.1, n=2)
    assert len(branch) == 2 and all(gait.residual < 1e-8 for gait in branch)


def test_ball_on_a_table_that_shakes() -> None:
    """One impact per period of the table A sin w t: with T = 2 pi/w the ball leaves with g T/2, where the table's speed is
    g T/2 (1 - e)/(1 + e); linearized, impact to impact, the trace is 1 - e + (1 + e)/g ((1 + e) a + e g) with the table's
    acceleration a there, the determinant e^2."""
    y = sd.coordinates("y")
    g, e, A, w = 9.81, 0.6, 0.02, 20.0
    system = sd.System("table", gravity=[0, -g])
    table, ball = system.add_body("table"), system.add_body("ball", mass=1.0)
    system.add_joint(sd.Prismatic("shaken", system.ground, table, axis=[0, 1], coordinate=A * sp.sin(w * sd.t)))
    system.add_joint(sd.Prismatic("height", system.ground, ball, axis=[0, 1], coordinate=y))
    system.add_contact(sd.Contact("bounce", ball, table, restitution=e))
    module, T = system.compile(), 2 * np.pi / w
    phase = np.arccos(g * T / 2 * (1 - e) / (1 + e) / (A * w))
    t, start = phase / w + T / 2, A * np.sin(phase) + g * T**2 / 8
    orbit = module.periodic(T, [start + 1e-4], [1e-3], t=t, rtol=1e-13)
    assert orbit.x == pytest.approx([start, 0], abs=1e-10) and not orbit.free_period
    a = -A * w**2 * np.sin(phase)
    expected = np.roots([1, -(1 - e + (1 + e) / g * ((1 + e) * a + e * g)), e**2])
    assert np.sort_complex(orbit.multipliers) == pytest.approx(np.sort_complex(expected), abs=1e-8)


def test_ignored_contacts() -> None:
    """Without being ignored the foot that scuffs stops the walker; it is reported where it still overlaps when it counts."""
    run = walker().simulate((0, 3.2), *after_heel_strike(0.19393737, -0.20386693))
    assert run.contacts["right_foot"].gap.min() < -1e-4
    assert [mode for _, mode in run.contacts["right_foot"].switches] == ["open", "sticking"]
    early = walker_system(ahead=0.05).compile()
    with pytest.warns(SimulationWarning, match="contact right_foot overlaps by .* m where it is no longer ignored; let `ignored` "
                                               "stay positive until its gap is open"):
        stopped = early.simulate((0, 3.2), *after_heel_strike(0.19393737, -0.20386693))
    assert 1.8 < stopped.t[-1] < 2.1 and not stopped.success
    with pytest.raises(ArgumentError, match="are ignored at times, which method='moreau' does not know; leave out the method"):
        walker().simulate((0, 0.1), *after_heel_strike(0.19, -0.2), method="moreau", step=1e-3)
    with pytest.raises(sd.errors.ModelError, match="ignored belongs to rigid contacts, which close at an instant; leave it out"):
        walker_system(law="compliant").compile()


def test_what_does_not_come_back() -> None:
    q, u = after_heel_strike(0.19393737, -0.20386693)
    for arguments, text in (({"cyclic": ["way"]}, "cyclic names 'way'; there are x, y, left, right"),
                            ({"cyclic": "x"}, "cyclic is 'x'; pass a list of names"),
                            ({"exchange": [("left", "left")]}, r"a pair to exchange is \('left', 'left'\); pass two coordinates"),
                            ({"cyclic": ["x", "left"]}, "left was given as cyclic, but the motion depends on it")):
        with pytest.raises(ArgumentError, match=text):
            walker().periodic(1.0, q, u, **arguments)
