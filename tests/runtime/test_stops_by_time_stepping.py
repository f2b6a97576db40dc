"""Stops, backlash and ropes by time stepping: closed forms, momentum, and the run that locates every impact."""

from __future__ import annotations

import numpy as np
import pytest

import symdyn as sd
from symdyn.runtime.building.compiler import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")


def door(restitution: float) -> sd.Module:
    """A leaf of 2 kg m2 that swings freely between two stops."""
    system = sd.System("door")
    leaf = system.add_body("leaf", mass=1.0, inertia=[2, 2, 2])
    hinge = system.add_joint(sd.Revolute("hinge", system.ground, leaf, sd.coordinates("q")))
    system.add_contact(sd.Stop("frame", hinge, lower=-0.5, upper=1.0, restitution=restitution))
    return system.compile()


def test_a_door_swings_between_its_stops_as_in_closed_form() -> None:
    """From 0 at 3 rad/s: the upper stop after 1/3 s, then across 1.5 rad at 2.4 rad/s, then at 1.92 rad/s."""
    module, t = door(0.8), np.linspace(0, 1.2, 61)
    first, second = 1 / 3, 1 / 3 + 1.5 / 2.4
    exact = np.where(t < first, 3 * t, np.where(t < second, 1 - 2.4 * (t - first), -0.5 + 1.92 * (t - second)))
    errors = []
    for step in (1e-2, 1e-3, 1e-4):
        solution = module.simulate(t, q=[0.0], u=[3.0], method="moreau", step=step)
        assert solution.stepped is not None and solution.stepped.residual < 1e-11
        errors.append(np.abs(solution["q"] - exact).max())
        assert solution.u[-1, 0] == pytest.approx(3 * 0.8**2, rel=1e-12)
    assert errors[0] < 6e-2 and errors[2] < 6e-4, errors
    impulses = [solution.contacts[f"frame_{end}"].impacts.impulse[:, 0] for end in ("upper", "lower")]
    np.testing.assert_allclose(impulses, [[2 * 5.4], [2 * 4.32]], rtol=1e-12)
    assert solution.contacts["frame_upper"].impacts.t[0] == pytest.approx(first, abs=2e-4)


def test_a_door_is_held_by_its_stop() -> None:
    torque = sd.inputs("T")
    system = sd.System("pressed")
    leaf = system.add_body("leaf", mass=1.0, inertia=[2, 2, 2])
    hinge = system.add_joint(sd.Revolute("hinge", system.ground, leaf, sd.coordinates("q")))
    system.add_joint_force("hinge", torque)
    system.add_contact(sd.Stop("frame", hinge, lower=0.0))
    solution = system.compile().simulate((0, 0.5), q=[0.0], inputs={"T": -7.0}, method="moreau", step=1e-2)
    np.testing.assert_allclose(solution["q"], 0, atol=1e-12)
    frame = solution.contacts["frame_lower"]
    np.testing.assert_allclose(frame.force[1:, 0], 7.0, rtol=1e-10)
    assert frame.mode[-1] == "closed"


def test_a_rope_becomes_taut_and_keeps_momentum() -> None:
    """Two bodies in a plane, tied together: what the rope takes along it is that of a plastic impact of both."""
    system = sd.System("tied")
    for name, mass in (("a", 1.0), ("b", 3.0)):
        body = system.add_body(name, mass=mass, inertia=[0.1] * 3)
        system.add_joint(sd.Prismatic(f"along_{name}", system.ground, body, axis=[1, 0, 0]))
    system.add_contact(sd.Rope("rope", "a", "b", length=1.0))
    solution = system.compile().simulate((0, 1.0), q=[0.0, 0.5], u=[0.0, 1.0], method="moreau", step=1e-3)
    np.testing.assert_allclose(solution.u @ [1.0, 3.0], 3.0, rtol=1e-12)
    np.testing.assert_allclose(solution.u[-1], 0.75, rtol=1e-12)
    assert solution.contacts["rope"].gap.min() > -1e-11
    assert np.ptp(solution.q[-1]) == pytest.approx(1.0, abs=1e-11)


def test_backlash_approaches_the_run_that_locates_its_impacts() -> None:
    """A driven wheel rattles within the backlash of another one that a spring holds."""
    system = sd.System("gears")
    joints = []
    for name, inertia in (("driver", 1.0), ("driven", 0.5)):
        wheel = system.add_body(name, mass=1.0, inertia=[inertia] * 3)
        joints.append(system.add_joint(sd.Revolute(f"shaft_{name}", system.ground, wheel, sd.coordinates(f"q_{name}"))))
    system.add_joint_force("shaft_driven", -20 * sd.coordinates("q_driven"))
    system.add_contact(sd.Backlash("mesh", joints[0], joints[1], width=0.1, restitution=0.5))
    module, t = system.compile(), np.linspace(0, 1.5, 76)
    located = module.simulate(t, q=[0.0, 0.0], u=[1.0, 0.0], rtol=1e-10)
    errors = [np.abs(module.simulate(t, q=[0.0, 0.0], u=[1.0, 0.0], method="moreau", step=h).q - located.q).max()
              for h in (1e-2, 1e-3, 1e-4)]
    assert errors[2] < 2e-3 and errors[2] < errors[0] / 10, errors
