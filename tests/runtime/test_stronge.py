"""Stronge's energetic restitution of an impact with friction, against closed forms."""

import math

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import ModelError, SimulationWarning
from symdyn.runtime.contact_laws import SLIDING, STICKING, Site
from symdyn.runtime.stronge import stronge


def rod(angle: float) -> np.ndarray:
    """D = J M^-1 J^T of the tip of a uniform rod of mass 1 and length 2 that leans at an angle over the ground."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1 + 3 * c * c, 3 * s * c], [3 * s * c, 1 + 3 * s * s]])


def in_small_steps(D: np.ndarray, v: np.ndarray, e: float, mu: float, step: float) -> np.ndarray:
    """Routh's method with many small impulses."""
    now, taken = v.copy(), 0.0
    holds = -D[1, 0] / D[1, 1]
    for _ in range(10**6):
        f = -mu * math.copysign(1, now[1]) if abs(now[1]) > 4 * step else min(max(holds, -mu), mu)
        after = now + step * (D @ [1.0, f])
        work = step * (now[0] + after[0]) / 2
        taken += work * (e**2 if work < 0 else 1.0)
        now = after
        if taken >= 0 and now[0] > 0:
            break
    return now


def test_slip_that_goes_on_gives_back_e_times_the_speed() -> None:
    D, v, e, mu = rod(0.9), np.array([-1.0, 5.0]), 0.6, 0.2
    one = stronge(D, v, e, Site((0, 1), mu, mu))
    assert one is not None and one.modes[0].kind == SLIDING
    assert one.w[0] == pytest.approx(e, rel=1e-14)
    assert one.lam == pytest.approx(np.array([1, -mu]) * (1 + e) / (D[0, 0] - mu * D[0, 1]), rel=1e-13)


def test_slip_that_stops_in_compression_and_sticks() -> None:
    """With slopes a_1 and a_2 of v_N before and after: W = (v_0^2 - v_s^2)/(2 a_1) + v_s^2/(2 a_2), v = e sqrt(2 a_2 W)."""
    D, v, e, mu = rod(0.9), np.array([-1.0, 0.3]), 0.6, 1.2
    one = stronge(D, v, e, Site((0, 1), mu, mu))
    a_1, a_2 = D[0, 0] - mu * D[0, 1], D[0, 0] - D[0, 1] ** 2 / D[1, 1]
    stops = 0.3 / (mu * D[1, 1] - D[1, 0])
    v_s = -1.0 + a_1 * stops
    W = (1.0 - v_s**2) / (2 * a_1) + v_s**2 / (2 * a_2)
    assert one is not None and one.modes[0].kind == STICKING
    assert v_s < 0 and one.w == pytest.approx([e * math.sqrt(2 * a_2 * W), 0.0], rel=1e-13, abs=1e-15)
    assert one.w == pytest.approx(v + D @ one.lam, rel=1e-12, abs=1e-13)


def test_slip_that_turns_round_in_expansion() -> None:
    """Friction too small to hold it: three pieces, of which the last has the slope a_3 = D_NN + mu D_NT."""
    D, e, mu = rod(0.9), 0.9, 0.3
    v = np.array([-1.0, -0.9])
    a_1, b_1 = D[0, 0] + mu * D[0, 1], D[1, 0] + mu * D[1, 1]
    a_3 = D[0, 0] - mu * D[0, 1]
    stops, W = 0.9 / b_1, 1 / (2 * a_1)
    v_s = -1.0 + a_1 * stops
    assert v_s > 0 and v_s**2 / (2 * a_1) < e**2 * W
    expected = math.sqrt(v_s**2 + 2 * a_3 * (e**2 * W - v_s**2 / (2 * a_1)))
    one = stronge(D, v, e, Site((0, 1), mu, mu))
    assert one is not None and one.w[0] == pytest.approx(expected, rel=1e-13)
    assert one.w[1] > 0


def test_random_impacts_are_those_of_small_steps_and_lose_energy() -> None:
    stream = np.random.default_rng(2)
    for _ in range(40):
        D, mu, e = rod(stream.uniform(0.1, 1.5)), stream.uniform(0, 2), stream.uniform(0, 1)
        v = np.array([-1.0, stream.uniform(-2, 2)])
        one = stronge(D, v, e, Site((0, 1), mu, mu))
        assert one is not None
        assert one.w == pytest.approx(v + D @ one.lam, abs=1e-12)
        assert (v + one.w) @ one.lam <= 1e-13
        assert abs(one.lam[1]) <= mu * one.lam[0] + 1e-13
        assert one.w == pytest.approx(in_small_steps(D, v, e, mu, 1e-4), abs=2e-2)




def foot(name: str, at: list[float], friction: float = 1.2) -> sd.Contact:
    return sd.Contact(name, "body", "ground", shape=sd.contacts.Point(at), friction=friction, restitution=0.6, impact="stronge")


def test_motion_with_an_impact_is_that_of_the_law() -> None:
    angle = 0.9
    system = sd.System("rod", gravity=[0, 0])
    body = system.add_body("body", mass=1.0, inertia=1 / 3)
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y theta")))
    system.add_contact(foot("tip", [-1, 0]))
    solution = system.compile().simulate((0, 1), q=[0, math.sin(angle) + 0.1, angle], u=[0.3, -1.0, 0], rtol=1e-12)
    hit = solution.contacts["tip"].impacts
    expected = stronge(rod(angle) * [[1, -1], [-1, 1]], hit.before[0], 0.6, Site((0, 1), 1.2, 1.2))
    assert expected is not None and hit.after[0] == pytest.approx(expected.w, abs=1e-11)
    assert hit.impulse[0] == pytest.approx(expected.lam, rel=1e-9)


def test_several_contacts_at_once_and_friction_in_space_are_rejected() -> None:
    system = sd.System("rod", gravity=[0, -9.81])
    body = system.add_body("body", mass=1.0, inertia=1 / 3)
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y theta")))
    system.add_contact(foot("left", [-1, 0]))
    system.add_contact(foot("right", [1, 0]))
    with pytest.warns(SimulationWarning, match="is one of 2 contacts at once, left, right; impact='stronge' takes"):
        run = system.compile().simulate((0, 1), q=[0, 0.1, 0])
    assert run.t[-1] == pytest.approx(math.sqrt(0.2 / 9.81), abs=1e-9)
    space = sd.System("ball")
    ball = space.add_body("body", mass=1.0, inertia=[1, 1, 1])
    space.add_joint(sd.Free("free", space.ground, ball))
    space.add_contact(foot("foot", [0, 0, 0]))
    with pytest.raises(ModelError, match="impact='stronge' follows the slip in a plane"):
        space.check()
