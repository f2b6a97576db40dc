"""Clutches and dry friction of joints by time stepping: closed forms, and the run that locates every switch."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.module import Module

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
MASS, STIFFNESS, FRICTION, AMPLITUDE = 2.0, 50.0, 1.5, 0.5


def wheels(*inertias: float) -> tuple[sd.System, list[sd.Revolute]]:
    """Wheels on shafts of their own, each with a torque T_k that is an input."""
    system, shafts = sd.System("wheels"), []
    for k, inertia in enumerate(inertias):
        wheel = system.add_body(f"wheel_{k}", mass=1.0, inertia=[inertia] * 3)
        shafts.append(system.add_joint(sd.Revolute(f"shaft_{k}", system.ground, wheel, sd.coordinates(f"q_{k}"))))
        system.add_joint_force(f"shaft_{k}", sd.inputs(f"T_{k}"))
    return system, shafts


@pytest.fixture(scope="module")
def oscillator() -> Module:
    """A mass on a spring with dry friction that holds more than it brakes."""
    x, hold = sd.coordinates("x"), sd.parameters("hold")
    system = sd.System("dry_oscillator")
    system.defaults[hold] = FRICTION
    body = system.add_body("body", mass=MASS)
    system.add_joint(sd.Prismatic("rail", system.ground, body, coordinate=x))
    system.add_joint_force("rail", -STIFFNESS * x)
    system.add_contact(sd.JointFriction("friction", "rail", breakaway=hold, sliding=FRICTION))
    return system.compile()


def test_an_oscillator_with_dry_friction_loses_its_amplitude_as_in_closed_form(oscillator: Module) -> None:
    """2 F/k in every half period, of which there are eight; then it sticks. It turns at the end of a step."""
    half = np.pi / np.sqrt(STIFFNESS / MASS)
    t = np.linspace(0, 8 * half + 1, 101)
    n = np.minimum(t // half, 8)
    middle = np.where(n < 8, (-1) ** n * FRICTION / STIFFNESS, 0.0)
    turned = (-1) ** n * (AMPLITUDE - 2 * n * FRICTION / STIFFNESS)
    exact = np.where(n < 8, middle + (turned - middle) * np.cos(np.pi * (t / half - n)), turned)
    errors = []
    for step in (1e-2, 1e-3, 1e-4):
        solution = oscillator.simulate(t, q=[AMPLITUDE], method="moreau", step=step)
        assert solution.success and solution.stepped is not None and solution.stepped.residual < 1e-11
        errors.append(np.abs(solution["x"] - exact).max() / AMPLITUDE)
    assert all(error < 2 * step for error, step in zip(errors, (1e-2, 1e-3, 1e-4), strict=True)), errors
    friction = solution.contacts["friction"]
    assert friction.mode[-1] == "sticking" and set(friction.mode) == {"sticking", "sliding"}
    assert friction.force[-1, 0] == pytest.approx(STIFFNESS * solution["x"][-1], rel=1e-9)  # what the spring pulls with
    sliding = (friction.mode == "sliding") & (np.abs(friction.slip[:, 0]) > 1e-3)
    np.testing.assert_allclose(friction.force[sliding, 0], -FRICTION * np.sign(friction.slip[sliding, 0]), rtol=1e-12)
    assert not len(friction.impacts.t)


def test_energy_that_friction_takes_closes_the_balance(oscillator: Module) -> None:
    solution = oscillator.simulate((0, 6.0), q=[AMPLITUDE], method="moreau", step=1e-3, work=True)
    path = FRICTION * sum(2 * (AMPLITUDE - (2 * k + 1) * FRICTION / STIFFNESS) for k in range(8))
    assert -solution.energy_balance["contact friction"][-1] == pytest.approx(path, rel=1e-4)
    np.testing.assert_allclose(solution.energy_balance["error"], 0, atol=2e-4 * path)


def test_breakaway_holds_more_than_sliding_friction(oscillator: Module) -> None:
    """From rest with the spring at 2.5 N, friction that holds 3 N keeps the mass, and one of 2 N lets it go."""
    held, free = (oscillator.simulate((0, 1.0), q=[0.05], params={"hold": hold}, method="moreau", step=1e-2)
                  for hold in (3.0, 2.0))
    np.testing.assert_allclose(held["x"], 0.05, atol=1e-12)
    assert held.contacts["friction"].force[-1, 0] == pytest.approx(2.5, rel=1e-10)
    assert set(held.contacts["friction"].mode) == {"sticking"}
    assert free["x"].min() == pytest.approx(0.01, abs=1e-4)  # mirrored at the middle, 1.5 N / 50 N/m
    assert free.contacts["friction"].mode[-1] == "sticking"


def test_a_slipping_clutch_takes_two_wheels_to_one_speed() -> None:
    """The torque that a clutch bears speeds up one wheel and brakes the other, until both turn alike: then it holds."""
    system, shafts = wheels(2.0, 0.5)
    system.add_contact(sd.JointFriction("clutch", shafts[0], breakaway=4.0, other=shafts[1]))
    module, t = system.compile(), np.linspace(0, 3, 61)
    solution = module.simulate(t, q=[0, 0], u=[10.0, 0.0], method="moreau", step=1e-3)
    until = 10.0 / (4.0 / 2.0 + 4.0 / 0.5)
    np.testing.assert_allclose(solution.u[:, 0], 10.0 - 2.0 * np.minimum(t, until), atol=1e-11)
    np.testing.assert_allclose(solution.u[:, 1], 8.0 * np.minimum(t, until), atol=1e-11)
    clutch = solution.contacts["clutch"]
    assert [mode for _, mode in clutch.switches] == ["sliding", "sticking"]
    assert clutch.switches[1][0] == pytest.approx(until, abs=2e-3)
    overload = module.simulate((0, 1), q=[0, 0], u=[0, 0], inputs={"T_0": 30.0, "T_1": 0.0}, method="moreau", step=1e-2)
    np.testing.assert_allclose(overload.u[-1], [13.0, 8.0], rtol=1e-12)  # 30 N m are more than the clutch bears
    loaded = module.simulate((0, 1), q=[0, 0], u=[0, 0], inputs={"T_0": 10.0, "T_1": 0.0}, method="moreau", step=1e-2)
    np.testing.assert_allclose(loaded.u[-1], [4.0, 4.0], rtol=1e-12)
    assert loaded.contacts["clutch"].force[-1, 0] == pytest.approx(-2.0, rel=1e-10)


def test_a_freewheel_locks_one_way() -> None:
    """A torque against its direction is held, one along it turns the wheel; a wheel that turns back is stopped at once."""
    system, shafts = wheels(2.0)
    system.add_contact(sd.OneWayClutch("freewheel", shafts[0]))
    module = system.compile()
    held = module.simulate((0, 1), q=[0], inputs={"T_0": -3.0}, method="moreau", step=1e-2)
    np.testing.assert_allclose(held["q_0"], 0, atol=1e-13)
    assert held.contacts["freewheel"].mode[-1] == "closed"
    assert held.contacts["freewheel"].force[-1, 0] == pytest.approx(3.0, rel=1e-10)
    free = module.simulate((0, 1), q=[0], inputs={"T_0": 3.0}, method="moreau", step=1e-2)
    np.testing.assert_allclose(free.u[:, 0], 1.5 * free.t, atol=1e-12)
    assert set(free.contacts["freewheel"].mode) == {"open"}
    struck = module.simulate((0, 1), q=[0], u=[-5.0], inputs={"T_0": 0.0}, method="moreau", step=1e-2)
    assert struck.u[-1, 0] == 0 and struck.contacts["freewheel"].impacts.impulse[0, 0] == pytest.approx(10.0, rel=1e-12)


def test_a_ratchet_approaches_the_run_that_locates_its_switches() -> None:
    """A wheel that swings on a spring drives another one over a freewheel, against dry friction and a stop."""
    system, shafts = wheels(1.0, 0.3)
    q = shafts[0].coordinates[0]
    system.add_joint_force("shaft_0", -40 * q)
    system.add_contact(sd.OneWayClutch("freewheel", shafts[1], shafts[0]))
    system.add_contact(sd.JointFriction("bearing", shafts[1], breakaway=0.8, sliding=0.5))
    system.add_contact(sd.Stop("end", shafts[0], upper=0.35, restitution=0.5))
    module, t = system.compile(), np.linspace(0, 2, 81)
    start: dict[str, Any] = {"q": [-0.3, 0.0], "inputs": {"T_0": 1.0, "T_1": 0.0}}
    located = module.simulate(t, rtol=1e-10, **start)
    assert len(located.contacts["freewheel"].switches) > 3
    errors = [np.abs(module.simulate(t, method="moreau", step=h, **start).q - located.q).max() for h in (1e-2, 1e-3, 1e-4)]
    assert errors[2] < 2e-4 and errors[2] < errors[0] / 30, errors
    solution = module.simulate(t, method="moreau", step=1e-4, **start)
    for name in ("freewheel", "bearing"):
        agree = solution.contacts[name].mode == located.contacts[name].mode
        assert agree.mean() > 0.95
