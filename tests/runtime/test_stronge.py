"""Stronge's energetic restitution of an impact with friction, against closed forms."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import symdyn as sd
from symdyn.errors import SimulationWarning
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
    for _ in range(15):
        D, mu, e = rod(stream.uniform(0.1, 1.5)), stream.uniform(0, 2), stream.uniform(0, 1)
        v = np.array([-1.0, stream.uniform(-2, 2)])
        one = stronge(D, v, e, Site((0, 1), mu, mu))
        assert one is not None
        assert one.w == pytest.approx(v + D @ one.lam, abs=1e-12)
        assert (v + one.w) @ one.lam <= 1e-13
        assert abs(one.lam[1]) <= mu * one.lam[0] + 1e-13
        assert one.w == pytest.approx(in_small_steps(D, v, e, mu, 1e-4), abs=2e-2)


def turned(angle: float) -> np.ndarray:
    """About the normal."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def test_an_impact_in_space_whose_slip_stays_in_a_plane_is_that_in_the_plane() -> None:
    stream = np.random.default_rng(3)
    for _ in range(12):
        D, mu, e = rod(stream.uniform(0.1, 1.5)), stream.uniform(0, 2), stream.uniform(0, 1)
        v, R = np.array([-1.0, stream.uniform(-2, 2)]), turned(stream.uniform(0, 6))
        in_plane = stronge(D, v, e, Site((0, 1), mu, mu))
        in_space = stronge(R @ np.pad(D, (0, 1)) @ R.T + R @ np.diag([0, 0, 1.3]) @ R.T, R @ [*v, 0], e, Site((0, 1, 2), mu, mu))
        assert in_plane is not None and in_space is not None
        assert R.T @ in_space.w == pytest.approx([*in_plane.w, 0], abs=1e-12)
        assert R.T @ in_space.lam == pytest.approx([*in_plane.lam, 0], abs=1e-12)
        assert in_space.modes[0].kind == in_plane.modes[0].kind


def test_the_central_impact_of_a_ball_in_space_is_a_closed_form() -> None:
    """The normal does not feel friction; the slip keeps its direction, and stops where 7/2 mu (1 + e) v_N is enough."""
    D, e, slip = np.diag([1.0, 3.5, 3.5]), 0.7, np.array([0.6, -0.8])
    for mu, left in ((0.1, 1 - 3.5 * 0.1 * 1.7), (0.3, 0.0)):
        one = stronge(D, np.array([-1.0, *slip]), e, Site((0, 1, 2), mu, mu))
        assert one is not None and one.modes[0].kind == (SLIDING if left else STICKING)
        assert one.w == pytest.approx([e, *(left * slip)], abs=1e-13)
        assert one.lam[0] == pytest.approx(1 + e, rel=1e-13)


def followed(D: np.ndarray, v: np.ndarray, e: float, mu: float) -> np.ndarray | None:
    """Velocities after an impact in which the slip does not stop, by an implicit method over the normal impulse."""
    def rates(_: float, y: np.ndarray) -> list[float]:
        return [*(D @ [1, *(-mu * y[1:3] / np.hypot(*y[1:3]))]), y[0]]

    def phase(start: np.ndarray, end: Callable[..., float]) -> np.ndarray | None:
        ends: list[Any] = [lambda _, y: np.hypot(*y[1:3]) - 1e-6, end]
        for one in ends:
            one.terminal = True
        run = solve_ivp(rates, (0, 50), start, method="Radau", rtol=1e-10, atol=1e-12, events=ends)
        return None if len(run.t_events[0]) else run.y[:, -1]

    turned_round = phase(np.array([*v, 0.0]), lambda _, y: y[0])
    if turned_round is None:
        return None
    work = turned_round[3]
    after = phase(np.array([1e-12, *turned_round[1:]]), lambda _, y: y[3] - work + e**2 * work)
    return None if after is None else after[:3]


def test_slip_that_turns_in_space_gives_back_the_part_of_the_energy() -> None:
    stream = np.random.default_rng(4)
    compared = 0
    for _ in range(12):
        A = stream.normal(size=(3, 5))
        D, mu, e, v = A @ A.T / 5, stream.uniform(0, 0.6), stream.uniform(0, 1), np.array([-1.0, *stream.uniform(-3, 3, 2)])
        one = stronge(D, v, e, Site((0, 1, 2), mu, mu))
        assert one is not None and one.w == pytest.approx(v + D @ one.lam, abs=1e-11)
        assert np.hypot(*one.lam[1:]) <= mu * one.lam[0] * (1 + 1e-9)
        assert (v + one.w) @ one.lam < 1e-12
        expected = followed(D, v, e, mu)
        if expected is not None:
            compared += 1
            assert one.w == pytest.approx(expected, abs=1e-8)
    assert compared > 6


def test_slip_that_stops_in_space_slips_on_where_friction_does_not_hold_it() -> None:
    """Along the one direction that its accelerations have themselves: from rest, a straight line to both ends of the impact."""
    D = np.array([[2.0, 0.9, 0.5], [0.9, 1.0, 0.2], [0.5, 0.2, 1.5]])
    mu, e = 0.2, 0.5
    one = stronge(D, np.array([-1.0, 0, 0]), e, Site((0, 1, 2), mu, mu))
    assert one is not None and one.modes[0].kind == SLIDING
    d = one.w[1:] / np.hypot(*one.w[1:])
    assert one.lam[1:] == pytest.approx(-mu * one.lam[0] * d, rel=1e-12)
    assert one.w[0] == pytest.approx(e, rel=1e-12)


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


def test_several_contacts_at_once_are_rejected() -> None:
    system = sd.System("rod", gravity=[0, -9.81])
    body = system.add_body("body", mass=1.0, inertia=1 / 3)
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y theta")))
    system.add_contact(foot("left", [-1, 0]))
    system.add_contact(foot("right", [1, 0]))
    with pytest.warns(SimulationWarning, match="is one of 2 contacts at once, left, right; impact='stronge' takes"):
        run = system.compile().simulate((0, 1), q=[0, 0.1, 0])
    assert run.t[-1] == pytest.approx(math.sqrt(0.2 / 9.81), abs=1e-9)


def test_a_motion_in_space_with_an_impact_is_that_of_the_law() -> None:
    space = sd.System("ball")
    ball = space.add_body("body", mass=1.0, inertia=[0.4, 0.3, 0.2])
    space.add_joint(sd.Free("free", space.ground, ball, orientation=sd.EulerParameters()))
    space.add_contact(foot("foot", [0.3, 0.2, -1], friction=0.2))
    solution = space.compile().simulate((0, 0.5), q=[0, 0, 1.1, 1, 0, 0, 0], u=[1, 0.5, -1, 0, 0, 0], rtol=1e-12)
    hit = solution.contacts["foot"].impacts
    arm = np.array([0.3, 0.2, -1])
    cross = np.array([[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]])
    D = np.eye(3) - cross @ np.diag(1 / np.array([0.4, 0.3, 0.2])) @ cross
    places = [2, 0, 1]  # the normal, then the tangents along x and y
    expected = stronge(D[np.ix_(places, places)], np.array([-1, 1, 0.5]), 0.6, Site((0, 1, 2), 0.2, 0.2))
    assert expected is not None and len(hit.t) == 1
    assert hit.after[0] == pytest.approx(expected.w, abs=1e-10)
    assert hit.impulse[0] == pytest.approx(expected.lam, abs=1e-10)
