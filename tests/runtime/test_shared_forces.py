"""Contacts in space that share forces: they slip where no distribution of forces holds them any more."""

import warnings
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

import symdyn as sd
from symdyn.errors import SimulationWarning
from symdyn.runtime.contact_laws import SLIDING, STICKING
from symdyn.runtime.shared_forces import Cone, shared_forces
from tests.helpers import swept

G, MASS, STATIC, KINETIC, RATE, LOW = 9.81, 2.0, 0.6, 0.4, 4.0, 0.1
FIVE = ((-0.2, -0.15), (0.2, -0.15), (0.25, 0.15), (-0.2, 0.2), (0, 0.3))
FAR = ((-0.2, -0.15), (0.2, -0.15), (0.2, 0.3), (-0.2, 0.3))
EDGE = ((-0.2, 0), (0.2, 0), (0, 0.3))
LEGS = ((-0.2, -0.15), (0.2, -0.15), (0.2, 0.15), (-0.2, 0.15))


@cache
def table(legs: tuple[tuple[float, float], ...] = LEGS, friction: Any = (STATIC, KINETIC)) -> Any:
    """A rigid body on legs, with a force and a torque about the vertical axis that grow with time: see `load`."""
    system = sd.System("table", gravity=[0, 0, -G])
    top = system.add_body("top", mass=MASS, inertia=[0.02, 0.03, 0.04])
    system.add_joint(sd.Free("free", system.ground, top, orientation=sd.EulerAngles("ZYX")))
    names = sd.parameters("f_x f_y f_z a_x a_y a_z c_z")
    system.add_force(top, [f * sd.t for f in names[:3]], point=names[3:6])
    system.add_torque(top, [0, 0, names[6] * sd.t])
    system.defaults.update(dict.fromkeys(names, 0.0))
    for k, (x, y) in enumerate(legs):
        system.add_contact(sd.Contact(f"leg_{k}", top, "ground", shape=sd.contacts.Point([x, y, -LOW]), friction=friction))
    return system.embedding().compile()


def load(force: Any = (0, 0, 0), at: Any = (0, 0, 0), torque: float = 0.0) -> dict[str, float]:
    """Parameters of `table` for a force at a point and a torque, by time."""
    return {**{f"f_{x}": float(f) for x, f in zip("xyz", force, strict=True)},
            **{f"a_{x}": float(a) for x, a in zip("xyz", at, strict=True)}, "c_z": torque}


def slips(solution: Any) -> float:
    """When the first leg slips; before that all stick."""
    assert solution.success
    switches = [contact.switches for contact in solution.contacts.values()]
    assert all(of[0] == (0.0, STICKING) and of[1][1] == SLIDING for of in switches)
    return min(of[1][0] for of in switches)


def start(module: Any) -> dict[str, float]:
    return {module.metadata.q[2]: LOW}


@pytest.mark.parametrize(("legs", "height", "friction"), swept(
    [(legs, height, friction) for legs, height in ((LEGS, -0.05), (LEGS, 0.1), (FIVE, -0.05), (FAR, -LOW))
     for friction in ((STATIC, KINETIC), STATIC)], (LEGS, -0.05, (STATIC, KINETIC))))
def test_pushed_body_slips_where_the_static_friction_of_all_legs_is_used(legs: Any, height: float, friction: Any) -> None:
    """A force c t above the middle: at c t = mu_s m g, then m x'' = c t - mu_k m g, though legs carry different loads."""
    push = RATE * np.array([1, 0.3]) / np.hypot(1, 0.3)
    module, begin = table(legs, friction), STATIC * MASS * G / RATE
    solution = module.simulate((0, begin + 1), q=start(module), params=load((*push, 0), (0, 0, height)), rtol=1e-10)
    assert slips(solution) == pytest.approx(begin, rel=1e-7)  # rows are softened by 1e-8: compilers differ by 2e-8
    kinetic = friction if isinstance(friction, float) else KINETIC
    after = RATE * ((begin + 1)**3 / 6 - begin**3 / 6 - begin**2 / 2) / MASS - kinetic * G / 2
    assert np.hypot(*solution.q[-1, :2]) == pytest.approx(after, rel=1e-7)


@pytest.mark.parametrize(("legs", "push", "height"), [
    (EDGE, (1, 0.3), -LOW), *swept([((*EDGE[:2], (0.2, 0.3), (-0.2, 0.3)), (0, 1), -LOW), (EDGE, (1, 0), -0.09)])])
def test_legs_that_nothing_presses_have_no_friction(legs: Any, push: Any, height: float) -> None:
    """The weight is on the edge of two legs, which the others leave alone until the load presses them; one coefficient."""
    force = RATE * np.array(push) / np.hypot(*push)
    module, begin, params = table(legs, STATIC), STATIC * MASS * G / RATE, load((*force, 0), (0, 0, height))
    solution = module.simulate(np.linspace(0, begin, 13), q=start(module), params=params, rtol=1e-10)
    forces = np.array([contact.force for contact in solution.contacts.values()])
    assert (np.linalg.norm(forces[:, :-1, 1:], axis=2) <= STATIC * forces[:, :-1, 0] + 1e-8 * MASS * G).all()  # softness
    assert np.abs(solution.u).max() < 1e-9
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)  # of the border of two modes
        solution = module.simulate((0, begin + 0.1), q=start(module), params=params, rtol=1e-10)
    times = [contact.switches[1][0] for contact in list(solution.contacts.values())[:2]]
    assert solution.success and times == pytest.approx([begin, begin], rel=1e-7)


def test_twisted_body_slips_where_the_static_friction_of_all_legs_is_used() -> None:
    """A torque c t: at c t = mu_s m g r of legs at the distance r, then I phi'' = c t - mu_k m g r."""
    r, rate = np.hypot(0.2, 0.15), 1.0
    module, begin = table(), STATIC * MASS * G * np.hypot(0.2, 0.15) / rate
    solution = module.simulate((0, begin + 0.5), q=start(module), params=load(torque=rate), rtol=1e-10)
    assert slips(solution) == pytest.approx(begin, rel=1e-8)
    after = (rate * ((begin + 0.5)**3 / 6 - begin**3 / 6 - begin**2 / 4) - KINETIC * MASS * G * r / 8) / 0.04
    assert solution.q[-1, 3] == pytest.approx(after, rel=1e-6)


def test_body_pushed_at_its_side_slips_at_the_load_of_limit_analysis() -> None:
    """The largest load with an equilibrium within cones of 720 facets, by linear programming."""
    angles, at = np.linspace(0, 2 * np.pi, 720, endpoint=False), (0.0, 0.1, -0.1)
    n = len(LEGS)
    equilibrium = np.zeros((6, 3 * n + 1))
    for k, (x, y) in enumerate(LEGS):
        for j, e in enumerate(np.eye(3)):
            equilibrium[:, 3 * k + j] = [*e, *np.cross([x, y, -LOW], e)]
    equilibrium[:, -1] = [1, 0, 0, *np.cross(at, [1, 0, 0])]
    cones = np.zeros((n * len(angles), 3 * n + 1))
    for k in range(n):
        cones[k * len(angles):(k + 1) * len(angles), 3 * k:3 * k + 3] = np.column_stack(
            [np.cos(angles), np.sin(angles), np.full(len(angles), -STATIC)])
    found = linprog([*[0] * (3 * n), -1], cones, np.zeros(len(cones)), equilibrium, [0, 0, MASS * G, 0, 0, 0],
                    [(None, None)] * (3 * n + 1))
    module = table()
    begin = slips(module.simulate((0, 3), q=start(module), params=load((RATE, 0, 0), at), rtol=1e-10))
    assert begin == pytest.approx(-found.fun / RATE, rel=2e-5)


def test_forces_stay_within_the_cones_and_balance_the_load_until_then() -> None:
    push = RATE * np.array([1, 0.3]) / np.hypot(1, 0.3)
    module = table()
    t = np.linspace(0, 2.9, 30)
    solution = module.simulate(t, q=start(module), params=load((*push, 0), (0, 0, 0.1)), rtol=1e-10)
    forces = np.array([contact.force for contact in solution.contacts.values()])
    assert (np.linalg.norm(forces[:, :, 1:], axis=2) <= STATIC * forces[:, :, 0] * (1 + 1e-12)).all()
    assert forces[:, :, 0].sum(axis=0) == pytest.approx(np.full(30, MASS * G), rel=1e-9)
    assert np.linalg.norm(forces[:, :, 1:].sum(axis=0), axis=1) == pytest.approx(RATE * t, abs=1e-9)
    assert np.abs(solution.u).max() < 1e-9


def test_contacts_in_different_planes_end_the_run_where_their_shares_are_not_decided() -> None:
    """A table pressed against a wall: normal forces there change with friction on the floor."""
    system = sd.System("pressed", gravity=[0, 0, -G])
    top = system.add_body("top", mass=MASS, inertia=[0.02, 0.03, 0.04])
    system.add_joint(sd.Free("free", system.ground, top, orientation=sd.EulerAngles("ZYX")))
    system.add_force(top, [-8.0, 3 * sd.t, 0], point=[0, 0, -0.05])
    for k, (x, y) in enumerate(((-0.2, -0.15), (0.2, 0), (-0.2, 0.15))):
        system.add_contact(sd.Contact(f"leg_{k}", top, "ground", shape=sd.contacts.Point([x, y, -LOW]), friction=0.4))
    wall = sd.contacts.Plane([1, 0, 0], [-0.2, 0, 0])
    for k, y in enumerate((-0.1, 0.1)):
        system.add_contact(sd.Contact(f"side_{k}", top, "ground", shape=(sd.contacts.Point([-0.2, y, 0]), wall), friction=0.5))
    module = system.compile()
    with pytest.warns(SimulationWarning, match=r"leg_2, side_0, side_1 stick and share forces; .* is not decided where "
                                                         r"they are in different planes; fewer contacts"):
        solution = module.simulate((0, 6), q=start(module), rtol=1e-8)
    assert not solution.success and 1 < solution.t[-1] < 4.45 and np.abs(solution.u).max() < 1e-9


def test_derivatives_end_where_legs_that_share_forces_slip() -> None:
    module, params = table(), load((RATE, 0, 0), (0, 0, -0.05))
    with pytest.warns(SimulationWarning, match="share forces and leave their cones"):
        solution = module.simulate((0, 3.5), q=start(module), params=params, rtol=1e-8, sensitivities=["f_x"])
    assert not solution.success and solution.t[-1] == pytest.approx(STATIC * MASS * G / RATE, rel=1e-6)


def test_margin_of_two_contacts_in_closed_form() -> None:
    """A bar on two ends, N = 1 each, pulled along itself by 2 a: forces a + y and a - y, mu = 1; the margin is 1 - a."""
    D = np.array([[1.0, 1.0], [1.0, 1.0]])
    H = np.zeros((6, 2))
    H[1, 0] = H[4, 1] = 1.0
    fixed = np.array([1.0, 0, 0, 1.0, 0, 0])
    for a in (0.2, 0.7, 0.999999, 1.2):
        found = shared_forces(D, np.array([2 * a, 2 * a]), H, fixed, np.array([1.0, 3.0]),
                              [Cone(0, (1, 2), 1.0), Cone(3, (4, 5), 1.0)])
        assert found.margin == pytest.approx(1 - a, abs=1e-11)
        assert found.lam == pytest.approx(np.array([1, a, 0, 1, a, 0]), abs=1e-9)
