"""Shocks along rows of spheres: all contacts that close within a step, motions from impact to impact, energy, misses reported."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import SimulationWarning
from symdyn.lab import many_contacts
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.integrating import moreau
from tests.helpers import swept

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
R, N = 0.05, 40


def row(n: int, restitution: float, *planes: sd.contacts.Plane) -> sd.Module:
    """Spheres of 1 kg in a row without gravity."""
    system = sd.System("row", gravity=[0, 0, 0])
    bodies = [system.add_body(f"ball_{k}", mass=1.0, inertia=[0.4 * R**2] * 3) for k in range(n)]
    for k, body in enumerate(bodies):
        system.add_joint(sd.Free(f"joint_{k}", system.ground, body, orientation=sd.EulerParameters()))
    system.add_contact(sd.ContactGroup("row", bodies, sd.contacts.Sphere(R), planes, restitution=restitution))
    return system.compile()


def along(x: np.ndarray, v: np.ndarray) -> dict[str, np.ndarray]:
    """Coordinates and speeds of spheres at x with velocities v along their row."""
    q, u = np.zeros((len(x), 7)), np.zeros((len(x), 6))
    q[:, 0], q[:, 3], u[:, 0] = x, 1, v
    return {"q": q.ravel(), "u": u.ravel()}


def from_impact_to_impact(x: np.ndarray, v: np.ndarray, restitution: float, end: float) -> np.ndarray:
    """Positions of equal spheres on a line, each impact at its instant, from the formulas of two bodies."""
    x, v, t = x.copy(), v.copy(), 0.0
    while True:
        closing = v[:-1] - v[1:]
        left = np.diff(x) - 2 * R
        when = np.where(closing > 1e-14, np.maximum(left, 0.0) / np.maximum(closing, 1e-14), np.inf)
        k = int(np.argmin(when))
        if not t + when[k] < end:
            return x + v * (end - t)
        x, t = x + v * when[k], t + when[k]
        mean, half = (v[k] + v[k + 1]) / 2, restitution * closing[k] / 2
        v[k], v[k + 1] = mean - half, mean + half


@pytest.mark.parametrize("n", [10, N])
def test_a_shock_closes_all_gaps_of_a_row_within_one_step(n: int) -> None:
    """Without restitution all spheres go on with the mean velocity; a look that is left out would leave some at rest."""
    x = np.arange(n) * (2 * R + 1e-6)
    solution = row(n, 0.0).simulate((0, 2e-3), method="moreau", step=1e-3, **along(x, np.eye(n)[0]))
    stepped = solution.stepped
    assert stepped is not None and stepped.residual < 1e-5
    assert len(stepped.touched.a[stepped.touched.step == 0]) == n - 1
    np.testing.assert_allclose(solution.u[1].reshape(n, 6)[:, 0], 1 / n, atol=1e-5)
    assert solution.u[1].reshape(n, 6)[:, 0].sum() == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize("restitution", swept([0.3, 0.6], 0.6))
def test_impacts_in_a_row_are_of_first_order_in_the_step(restitution: float) -> None:
    generator, n = np.random.default_rng(3), 20
    x = np.cumsum(2 * R + generator.uniform(0.01, 0.03, n))
    v = generator.normal(0, 0.3, n)
    exact = from_impact_to_impact(x, v, restitution, 0.4)
    module = row(n, restitution)
    errors = []
    for step in (2e-3, 5e-4, 1.25e-4):
        solution = module.simulate((0, 0.4), method="moreau", step=step, **along(x, v))
        errors.append(np.abs(solution.q[-1].reshape(n, 7)[:, 0] - exact).max())
        assert solution.u[-1].reshape(n, 6)[:, 0].sum() == pytest.approx(v.sum(), abs=1e-11)
    assert errors[0] < 1e-3
    assert errors[2] < errors[0] / 8  # first order: 1/16


def test_energy_that_a_sphere_between_a_wall_and_another_one_gains_is_reported() -> None:
    """One sphere leaves the other at 0.8 m/s, hits the wall and takes the other along, without restitution in this step: both go
    on at 1 m/s, with 1 J in place of 0.52 J. Without restitution nothing is gained."""
    start = along(np.array([R + 1e-5, 3 * R + 1e-5]), np.array([-1.0, -0.2]))
    wall = sd.contacts.Plane([1, 0, 0])
    with pytest.warns(SimulationWarning, match=r"impacts add 0\.48 J in 1 of 10 steps, up to 0\.48 J in a step, the first at "
                                               r"t = 0 s, as Newton's law may .*; pass a shorter step or less restitution"):
        solution = row(2, 1.0, wall).simulate((0, 0.01), method="moreau", step=1e-3, **start)
    np.testing.assert_allclose(solution.u[1].reshape(2, 6)[:, 0], 1, atol=1e-12)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        row(2, 0.0, wall).simulate((0, 0.01), method="moreau", step=1e-3, **start)


@pytest.mark.parametrize("speed", [60.0, 100.0])
def test_spheres_that_pass_through_each_other_in_a_step_are_reported(speed: float) -> None:
    """One moves by 6 or 10 diameters in a step and leaps over the other; in shorter steps all of its velocity is passed on. A
    sphere that leaps past another one at a distance is not reported."""
    module = row(2, 1.0)
    start = along(np.array([0, 0.45]), np.array([speed, 0]))
    with pytest.warns(SimulationWarning, match="bodies passed through each other, .* the first are ball_0 and ball_1 in the step "
                                               "from t = 0 s on; pass a step in which bodies move by less than their radius"):
        module.simulate((0, 0.03), method="moreau", step=1e-2, **start)
    start["q"][8] = 2 * R + 1e-3  # y of ball_1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        module.simulate((0, 0.03), method="moreau", step=1e-2, **start)
        start["q"][8] = 0
        solution = module.simulate((0, 0.03), method="moreau", step=R / speed, **start)
    np.testing.assert_allclose(solution.u[-1].reshape(2, 6)[:, 0], [0, speed], atol=1e-9)


def test_contacts_without_restitution_take_energy_in_every_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(many_contacts, "RESTITUTION", 0.0)
    system, start = many_contacts.box(N // 2)
    solution = system.compile().simulate((0, 0.4), q=start, method="moreau", step=2e-3)
    stepped = solution.stepped
    assert stepped is not None
    assert np.diff(stepped.losses, axis=0).min() > -1e-5 * stepped.losses[-1]  # the laws are missed by up to 1e-5 m/s
    assert stepped.losses[-1] > 1


def test_misses_of_a_solution_that_was_cut_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(moreau, "GROUP_UPDATES", 100)
    monkeypatch.setattr(moreau, "GROUP_SWEEPS", 5)
    monkeypatch.setattr(moreau, "GROUP_ROUGH", 2)
    monkeypatch.setattr(moreau, "LATE_DENSE", 0)
    system, start = many_contacts.box(N)
    with pytest.warns(SimulationWarning, match=r"missed by up to .* m/s in a step, in \d+ of 60 steps by more than 3e-06 m/s: "
                                               "compare the motion with one of half the step"):
        solution = system.compile().simulate((0, 0.3), q=start, method="moreau", step=5e-3)
    stepped = solution.stepped
    assert stepped is not None and stepped.residual == stepped.missed.max() > 3e-6
    np.testing.assert_allclose(stepped.missed, many_contacts.missed(solution), rtol=1, atol=1e-6)  # from what was recorded


@pytest.fixture(scope="module")
def poured() -> tuple[sd.Module, dict[str, float]]:
    """Eight discs that fall into a narrow box, one above the other."""
    system = sd.System("discs", gravity=[0, -9.81])
    bodies = [system.add_body(f"disc_{k}", mass=1.0, inertia=0.01) for k in range(8)]
    joints = [system.add_joint(sd.Planar(f"joint_{k}", system.ground, body)) for k, body in enumerate(bodies)]
    planes = [sd.contacts.Plane([0, 1]), sd.contacts.Plane([1, 0], point=[-0.33, 0]), sd.contacts.Plane([-1, 0], point=[0.33, 0])]
    system.add_contact(sd.ContactGroup("discs", bodies, sd.contacts.Sphere(0.1), planes=planes, friction=0.3, restitution=0.2))
    aside = np.random.default_rng(1).uniform(-0.15, 0.15, 8)
    start = {str(q): value for k, joint in enumerate(joints)
             for q, value in zip(joint.coordinates, (aside[k], 0.2 + 0.25 * k, 0.0), strict=True)}
    return system.compile(), start


def test_halving_ends_where_the_order_of_impacts_changes_with_the_step(poured: tuple[sd.Module, dict[str, float]],
                                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    module, start = poured
    monkeypatch.setattr(moreau, "FIRST", 16)
    with pytest.warns(SimulationWarning, match="3 halvings of the step did not halve the difference: the order of impacts"):
        solution = module.simulate((0, 0.7), q=start, method="moreau", rtol=1e-2)
    assert solution.stepped is not None and solution.stepped.estimate > 1e-2 and solution.n_steps < 2**18


def test_what_a_run_of_groups_alone_has(poured: tuple[sd.Module, dict[str, float]], tmp_path: Path) -> None:
    """No contacts with a name, a file without forces in joints and with the reason, pictures, and a message for another group."""
    module, start = poured
    solution = module.simulate((0, 0.1), q=start, method="moreau", step=1 / 256)
    assert dict(solution.contacts) == {} and list(solution.contact_groups) == ["discs"]
    with pytest.raises(sd.ArgumentError, match=r"discs: there is no contact group 'disc'; did you mean discs\?"):
        solution.contact_groups["disc"]
    with np.load(solution.save(tmp_path / "run.npz")) as stored:
        assert "reactions, which depend on the forces in the contact groups" in str(stored["about"])
        assert np.array_equal(stored["x"], solution.x) and not [name for name in stored if name.startswith("reaction")]
    solution.save(tmp_path / "run.csv")
    pytest.importorskip("matplotlib")
    assert solution.plot() is not None and solution.picture([0.1], forces=True) is not None
    assert solution.view(tmp_path / "run.html").path == tmp_path / "run.html"


def test_a_step_longer_than_the_motion_is_warned_of(poured: tuple[sd.Module, dict[str, float]]) -> None:
    module, start = poured
    with pytest.warns(SimulationWarning, match=r"step = 5 s is longer than the motion of 0.01 s, which was done in one step"):
        module.simulate((0, 0.01), q=start, method="moreau", step=5)


def test_time_stepping_has_no_sensitivities(poured: tuple[sd.Module, dict[str, float]]) -> None:
    module, start = poured
    with pytest.raises(sd.ArgumentError, match="time stepping has none; leave out the method"):
        module.simulate((0, 0.01), q=start, method="moreau", step=1e-3, sensitivities=["q_joint_0_1(0)"])
    with pytest.raises(sd.ArgumentError, match=r"no method 'mroeau', did you mean moreau\?"):
        sd.systems.pendulum().compile().simulate((0, 0.01), method="mroeau")
