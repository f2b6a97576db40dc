"""A pin in a bore, and a slider-crank whose piston has a journal with clearance.

Source: Flores, Ambrosio, Claro and Lankarani, Kinematics and Dynamics of Multibody Systems with Imperfect Joints, 2008 (the
kind of mechanism; the numbers are of its size).
"""

from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd

G, C = 9.81, sd.contacts


@pytest.mark.parametrize("space", [False, True])
def test_pin_rests_in_its_bore(space: bool) -> None:
    """At the clearance and the depth (m g/k)^(2/3) below the middle; rigid, it carries its weight."""
    down = [0, 0, -G] if space else [0, -G]
    for law in ("compliant", "rigid"):
        system = sd.System("pin", gravity=down)
        body = system.add_body("pin", mass=2.0)
        axis = [0, 0, 1] if space else [0, 1]
        system.add_joint(sd.Prismatic("height", system.ground, body, axis=axis, coordinate=sd.coordinates("h")))
        yielding = {"law": law, "compliance": C.Compliance(1e8)} if law == "compliant" else {}
        system.add_contact(sd.Contact("bore", body, system.ground, shape=(C.Sphere(0.009), C.Bore(0.01)), **yielding))
        module = system.compile(backend="numpy")
        if law == "rigid":
            assert module.rest({"h": -0.001}).contacts["bore"].force == pytest.approx([2 * G], rel=1e-9)
            continue
        depth = (2 * G / 1e8) ** (2 / 3)
        assert module.equilibrium(start={"h": -0.0011})["h"] == pytest.approx(-0.001 - depth, rel=1e-10)


@pytest.fixture(scope="module")
def slider_crank() -> Any:
    system = sd.System("slider_crank", gravity=[0, -G])
    theta, phi, x = sd.coordinates("theta phi x")
    crank = system.add_body("crank", mass=0.3, inertia=1e-4, com=[0.025, 0])
    rod = system.add_body("rod", mass=0.21, inertia=2.5e-4, com=[0.06, 0])
    slider = system.add_body("slider", mass=0.14)
    system.add_joint(sd.Revolute("A", system.ground, crank, theta))
    system.add_joint(sd.Revolute("B", crank, rod, phi, parent_point=[0.05, 0]))
    system.add_joint(sd.Prismatic("guide", system.ground, slider, axis=[1, 0], coordinate=x))
    steel = C.Compliance(6.6e10, dissipation=0.05, slip_speed=1e-2)
    system.add_contact(sd.Contact("journal", rod, slider, shape=(C.Sphere(0.0095, [0.12, 0]), C.Bore(0.01)), friction=0.03,
                                  law="compliant", compliance=steel))
    pin, middle = sd.position("rod", [0.12, 0]), sd.position("slider")
    gap = sp.Rational(1, 2000) - sp.sqrt((pin[0] - middle[0]) ** 2 + (pin[1] - middle[1]) ** 2 + sp.Rational(1, 10**30))
    system.add_event("closes", gap, 0, reset={theta: theta})  # a step ends there
    return system.compile()


def test_energy_balances_and_the_motion_converges(slider_crank: Any) -> None:
    """Over 0.05 s, in which the pin crosses its clearance; later impacts magnify every error."""
    w = 2 * np.pi * 8
    start = {"q": [0.0, 0.0, 0.17], "u": [w, -w - w * 0.05 / 0.12, 0.0]}
    runs = [slider_crank.simulate(np.linspace(0, 0.05, 201), rtol=rtol, work=True, **start) for rtol in (1e-12, 3e-14)]
    for run in runs:
        assert np.abs(run.energy_balance["error"]).max() < 1e-8 * run.energy_scale[0]
        assert len(run.events["closes"].t) >= 2
        assert 0 < -run.contacts["journal"].gap.min() < 1e-4
    apart = np.linalg.norm(runs[0].x - runs[1].x, axis=1)
    assert (apart / np.linalg.norm(runs[1].x, axis=1)).max() < 1e-8
