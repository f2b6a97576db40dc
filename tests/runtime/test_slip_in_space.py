"""Contacts in space that begin to slip and come to stick, with friction whose direction turns."""

from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import symdyn as sd
from symdyn.runtime.module import Module
from tests.helpers import swept

MASSES, PRESSED = np.array([6.0, 5.0]), 30.0  # kg along x and along y; N


def pushed(t: float) -> np.ndarray:
    """The force that pushes the skid, N."""
    return np.array([18 * np.sin(1.3 * t), 9 * np.cos(0.7 * t) + 3 * np.sin(2.1 * t)])


def skid(friction: object, m1: object = 1, m2: object = 2, pushes: object = 18) -> Module:
    """A body with different masses along x and y; m1, m2: of its carriers, pushes: along x, N."""
    system, t = sd.System("skid", gravity=[0, 0, -10]), sd.t
    system.defaults.update({s: value for s, value in ((m1, 1), (m2, 2), (pushes, 18)) if isinstance(s, sp.Symbol)})
    bodies = [system.add_body(name, mass=mass, inertia=[1, 1, 1]) for name, mass in zip("abc", (m1, m2, 3), strict=True)]
    carriers = [system.ground, *bodies[:2]]
    for body, carrier, q, axis in zip(bodies, carriers, sd.coordinates("x y z"), np.eye(3, dtype=int), strict=True):
        system.add_joint(sd.Prismatic(f"along_{q.name}", carrier, body, axis=axis, coordinate=q))
    system.add_joint_force("along_x", pushes * sp.sin(1.3 * t))
    system.add_joint_force("along_y", 9 * sp.cos(0.7 * t) + 3 * sp.sin(2.1 * t))
    system.add_contact(sd.Contact("sole", bodies[2], system.ground, friction=friction))
    return system.compile()


def slides(t: float, x: np.ndarray, kinetic: float) -> np.ndarray:
    """Rates of the place and the speed of the skid."""
    return np.concatenate([x[2:], (pushed(t) - kinetic * PRESSED * x[2:] / np.linalg.norm(x[2:])) / MASSES])


@cache
def expected(static: float, kinetic: float) -> tuple[float, float, np.ndarray]:
    """When the skid begins to slip and when it sticks again, at the latest at 5 s, and where it is then.

    It slips against the direction of the force that held last. Where static friction is left continuously the slip grows as
    a t^2/2, with the part of the force's rate along that direction; by more friction than acts then, with an acceleration
    along a direction d of its own, M a d = F - mu_k N d.
    """
    begins = brentq(lambda t: np.linalg.norm(pushed(t)) - static * PRESSED, 0, 1, xtol=1e-15)
    force, rate = pushed(begins), (pushed(begins + 1e-5) - pushed(begins - 1e-5)) / 2e-5
    if static == kinetic:
        d, after = force / np.linalg.norm(force), 1e-4
        jerk = d @ rate / (d @ (MASSES * d))
        start = np.concatenate([jerk * d * after**3 / 6, jerk * d * after**2 / 2])
    else:
        after = 1e-7
        size = brentq(lambda a: np.linalg.norm(force / (MASSES * a + kinetic * PRESSED)) - 1, 1e-6, 10, xtol=1e-15)
        d = force / (MASSES * size + kinetic * PRESSED)
        start = np.concatenate([size * d * after**2 / 2, size * d * after])

    def rests(t: float, x: np.ndarray, kinetic: float) -> float:
        return float(np.linalg.norm(x[2:])) - 1e-9

    rests.terminal, rests.direction = True, -1  # type: ignore[attr-defined]
    found = solve_ivp(slides, (begins + after, 5), start, method="Radau", rtol=1e-11, atol=1e-14, events=rests, args=(kinetic,))
    return begins, float(found.t[-1]), found.y[:2, -1]


@pytest.mark.every_value
@pytest.mark.parametrize("rtol", [1e-6, 1e-11])
@pytest.mark.parametrize("kinetic", [0.4, 0.3])
def test_a_skid_slips_along_the_force_that_held_it_last(kinetic: float, rtol: float) -> None:
    """With less kinetic friction it still slips at the end."""
    begins, until, place = expected(0.4, kinetic)
    solution = skid((0.4, kinetic)).simulate([0, until, until + 0.02], rtol=rtol, method="dop853")
    times, modes = zip(*solution.contacts["sole"].switches, strict=True)
    assert modes == (("sticking", "sliding", "sticking") if kinetic == 0.4 else ("sticking", "sliding"))
    assert abs(times[1] - begins) < 1e-11 and abs([*times, until][2] - until) < max(20 * rtol, 1e-8)
    np.testing.assert_allclose(solution.q[1, :2], place, rtol=0, atol=max(20 * rtol, 1e-9))


def test_a_slip_that_starts_within_the_tolerances_goes_on_where_it_turns() -> None:
    """A skid that starts along y at 1e-6 m/s, and that is at 2 m/s where it has turned by 45 degrees towards x."""
    found = solve_ivp(slides, (0, 2), [0, 0, 0, 1e-6], method="Radau", rtol=1e-11, atol=1e-14, args=(0.1,))
    solution = skid(0.1).simulate([0, 2], u=[0, 1e-6, 0], rtol=1e-6, method="dop853")
    assert [mode for _, mode in solution.contacts["sole"].switches] == ["sliding"]
    (turns,) = solution.events["sole_turns"].x[:, 3:5]
    assert turns[0] == pytest.approx(turns[1]) and 1.5 < np.linalg.norm(turns) < 2.5
    np.testing.assert_allclose(solution.x[-1, [0, 1, 3, 4]], found.y[:, -1], rtol=0, atol=2e-5)


def test_a_disc_that_sticks_and_slips_on_its_edge_is_as_accurate_as_its_tolerance() -> None:
    """Five times it sticks and slips again; the normal force depends on the direction of friction."""
    system, radius, tilt = sd.System("disc", gravity=[0, 0, -9.81]), 0.3, 1.1
    body = system.add_body("disc", mass=1.0, inertia=[radius**2 / 4, radius**2 / 4, radius**2 / 2])
    system.add_joint(sd.Free("free", system.ground, body, orientation=sd.EulerParameters()))
    system.add_contact(sd.Contact("edge", body, system.ground, shape=sd.contacts.Disc(radius), friction=0.25))
    module = system.compile()
    start = [0, 0, radius * np.sin(tilt), np.cos(tilt / 2), np.sin(tilt / 2), 0, 0]
    runs = [module.simulate([0, 3], q=start, u=[0.6, 0, 0, 0, 0, -2], rtol=rtol, method="dop853") for rtol in (1e-6, 1e-8, 1e-11)]
    assert all(len(run.contacts["edge"].switches) == 11 for run in runs)
    for run, bound in zip(runs, (1e-5, 1e-7), strict=False):
        assert run.n_steps < 1500
        np.testing.assert_allclose(run.q[-1], runs[-1].q[-1], rtol=0, atol=bound)


def test_derivatives_go_through_the_beginning_of_a_slip() -> None:
    """A mass slips down the slope from rest, by (|g_t| - mu g_n) t^2/2 along the tangential gravity g_t."""
    mu, system, carrier = sd.parameters("mu"), sd.System("slope", gravity=[3, 1, -9]), None
    system.defaults[mu] = 0.1
    for q, axis, mass in zip(sd.coordinates("x y z"), np.eye(3, dtype=int), (0, 0, 2), strict=True):
        body = system.add_body(f"body_{q.name}", mass=mass)
        system.add_joint(sd.Prismatic(f"along_{q.name}", carrier or system.ground, body, axis=axis, coordinate=q))
        carrier = body
    system.add_contact(sd.Contact("sole", body, system.ground, friction=mu))
    module, along = system.compile(), np.array([3.0, 1.0]) / np.sqrt(10)
    solution = module.simulate((0, 1), rtol=1e-11, sensitivities=["mu"])
    np.testing.assert_allclose(solution.q[-1, :2], along * (np.sqrt(10) - 0.9) / 2, rtol=0, atol=1e-10)
    np.testing.assert_allclose(solution.sensitivity["mu"][-1, :2], -9 / 2 * along, rtol=0, atol=1e-8)
    found = module.gradient(sd.Loss(end=sp.Symbol("x"), integral=sp.Symbol("x") ** 2), ["mu"], (0, 1), rtol=1e-11)
    way = along[0] * (np.sqrt(10) - 0.9) / 2
    assert abs(found.value - way - way**2 / 5) < 1e-11
    assert abs(found["mu"] + 9 / 2 * along[0] * (1 + 2 * way / 5)) < 1e-10


@pytest.mark.parametrize("kinetic", swept([0.4, 0.3], 0.4))
def test_derivatives_of_a_skid_that_slips_and_sticks_are_differences_of_its_motion(kinetic: float) -> None:
    """By its masses and by what pushes it; friction turns other masses along x and y, and the skid slips twice by 0.4."""
    m1, m2, f = masses = sd.parameters("m1 m2 f")
    module = skid((0.4, kinetic), *masses)
    end, values = 5.0, {m1: 1.0, m2: 2.0, f: 18.0}
    names = [m.name for m in masses]
    run = module.simulate((0, end), rtol=1e-10, sensitivities=names)
    assert len(run.contacts["sole"].switches) == (4 if kinetic == 0.4 else 2)
    found = module.gradient(sd.Loss(end=sp.Symbol("x")), names, (0, end), rtol=1e-10)
    for m, value in values.items():
        h = 1e-4 * value
        x = [module.simulate((0, end), rtol=1e-12, params={m: value + k * h})["x"][-1] for k in (-2, -1, 1, 2)]
        difference = (x[0] - 8 * x[1] + 8 * x[2] - x[3]) / (12 * h)
        assert abs(run.sensitivity[m][-1, 0] - difference) < 5e-9
        assert abs(found[m] - difference) < 5e-9


def test_derivatives_of_where_a_table_comes_to_rest_that_slides_and_spins() -> None:
    """On three legs, which slide in different directions and stick at the same time, whatever changes."""
    mu, system = sd.parameters("mu"), sd.System("table", gravity=[0, 0, -9.81])
    system.defaults[mu] = 0.3
    top = system.add_body("top", mass=2.0, inertia=[0.02, 0.03, 0.04])
    system.add_joint(sd.Free("free", system.ground, top, orientation=sd.EulerParameters()))
    for k, (x, y) in enumerate([(0.2, 0.1), (-0.2, 0.1), (0, -0.15)]):
        leg = sd.contacts.Point([x, y, -0.05])
        system.add_contact(sd.Contact(f"leg_{k}", top, system.ground, shape=leg, friction=mu))
    module, u = system.compile(), np.array([1.0, 0.3, 0, 0, 0, 2.0])
    place, forward, spin = "q_free_1", "q_free_1_dot", "omega_z_free"
    asked: dict[str, Any] = {"t": (0, 0.8), "q": [0, 0, 0.05, 1, 0, 0, 0]}
    names = ["mu", f"{forward}(0)", f"{spin}(0)"]
    run = module.simulate(**asked, u=u, rtol=1e-9, sensitivities=names)
    assert [run.contacts[f"leg_{k}"].mode[-1] for k in range(3)] == ["sticking"] * 3
    found = module.gradient(sd.Loss(end=sp.Symbol(place)), names, **asked, u=u, rtol=1e-9)
    for name, entry in zip(names, (None, 0, 5), strict=True):
        ends = []
        for k in (-2, -1, 1, 2):
            moved = u + (0 if entry is None else 1e-4 * k * np.eye(6)[entry])
            params = {"mu": 0.3 + 1e-4 * k} if entry is None else None
            ends.append(module.simulate(**asked, u=moved, params=params, rtol=1e-11)[place][-1])
        difference = (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / 12e-4
        assert abs(run.sensitivity[name][-1, 0] - difference) < 1e-9
        assert abs(found[name] - difference) < 1e-9


def _pushed_table() -> Module:
    """A table on three legs that is pushed at its centre of mass."""
    system = sd.System("table", gravity=[0, 0, -9.81])
    F, = sd.parameters("F,")
    top = system.add_body("top", mass=10, inertia=[1, 1, 1.5])
    system.add_joint(sd.Free("float", system.ground, top, orientation=sd.EulerParameters()))
    system.add_force(top, [F, 0, 0])
    for k in range(3):
        at = [0.5 * np.cos(2 * np.pi * k / 3), 0.5 * np.sin(2 * np.pi * k / 3), -0.3]
        system.add_contact(sd.Contact(f"leg{k}", top, system.ground, shape=sd.contacts.Point(at), friction=0.4))
    return system.compile()


def test_the_legs_of_a_table_come_to_rest_at_once() -> None:
    """Pushed tables stop at v (mu g + f cos phi) / ((mu g)^2 - f^2), f = F/m, phi between F and v, on all three legs."""
    module = _pushed_table()
    rng, grip = np.random.default_rng(3), 0.4 * 9.81
    for _ in range(5):
        v, f = rng.normal(size=2) * 0.5, rng.uniform(0, 0.8) * grip
        solution = module.simulate((0, 2), q=[0, 0, 0.3, 1, 0, 0, 0], u=[*v, 0, 0, 0, 0], params={"F": 10 * f}, rtol=1e-9,
                                   atol=1e-12, max_steps=5000)
        stops = (np.hypot(*v) * grip + f * v[0]) / (grip**2 - f**2)
        assert solution.success, solution.message
        for k in range(3):
            t, mode = solution.contacts[f"leg{k}"].switches[-1]
            assert mode == "sticking" and abs(t - stops) < 1e-8


def test_a_table_that_falls_onto_a_leg_comes_to_rest() -> None:
    """Tilted by a millionth about the edge of two legs, and pushed below the limit of friction."""
    module = _pushed_table()
    q = [0, 0, 0.3 + 0.25e-6, np.cos(0.5e-6), 0, -np.sin(0.5e-6), 0]
    solution = module.simulate((0, 0.4), q=q, params={"F": 30.0}, rtol=1e-8, max_steps=5000)
    assert solution.success, solution.message
    assert [solution.contacts[f"leg{k}"].mode[-1] for k in range(3)] == ["sticking"] * 3
