"""Springs and dampers whose stiffness, damping and length are expressions, against the same forces by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ModelError

T = np.linspace(0, 2, 21)


def slider(by_hand: bool) -> sd.System:
    """A mass on a rail at a height, which a spring pulls to the ground; it stiffens, and its length is driven."""
    x = sd.coordinates("x")
    k, c, h = sd.parameters("k c h", positive=True)
    drive = sd.inputs("drive")
    z = sd.coordinates("memory")
    system = sd.System("slider")
    mass = system.add_body("mass", mass=2, inertia=[1, 1, 1])
    system.add_joint(sd.Prismatic("rail", parent=system.ground, child=mass, axis=[1, 0, 0], coordinate=x))
    stiffness, damping, length = k * (1 + x**2 + z / 2), c * (1 + x.dot**2), 1 + drive + sp.sin(3 * sd.t) / 5
    if by_hand:
        distance = sp.sqrt(x**2 + h**2)
        pull = stiffness * (distance - length) + damping * x * x.dot / distance
        system.add_force(mass, [-pull * x / distance, -pull * h / distance, 0])
    else:
        system.add_spring_damper(system.ground, mass, point_a=[0, -h, 0], stiffness=stiffness, damping=damping, length=length)
    system.add_state(z, x - z)
    system.defaults = {k: 30.0, c: 0.7, h: 0.4}
    system.initial = {x: 0.6, z: 0.2, drive: 0.3}
    return system


@pytest.mark.parametrize("backend", ["numpy", "c"])
@pytest.mark.parametrize("formulation", ["embedding", "recursive", "absolute"])
def test_a_spring_by_expressions_is_the_force_by_hand(formulation: str, backend: str) -> None:
    system = slider(False)
    equations: Any = (system.augmented(coordinates="absolute") if formulation == "absolute" else getattr(system, formulation)())
    drive = {"drive": lambda t, x: 0.3 + 0.1 * np.cos(t)}
    found = equations.compile(backend).simulate(T, inputs=drive, rtol=1e-11, atol=1e-12, work=True)
    wanted = slider(True).embedding().compile("numpy").simulate(T, inputs=drive, rtol=1e-11, atol=1e-12)
    for name in ("x", "x_dot", "memory"):
        np.testing.assert_allclose(found[name], wanted[name], rtol=0, atol=1e-9)
    assert found.energy_error() < 1e-8 and np.ptp(found.work) > 1
    np.testing.assert_allclose(found.energies[:, 1], 0, atol=0)


def test_what_depends_on_parameters_only_has_a_potential() -> None:
    x = sd.coordinates("x")
    k, l = sd.parameters("k l", positive=True)
    energies = []
    for stiffness in (2 * k, k * (2 + 0 * x), k * (2 + sp.Integer(0) * sd.t)):
        system = sd.System("spring")
        mass = system.add_body("mass", mass=2, inertia=[1, 1, 1])
        system.add_joint(sd.Prismatic("rail", parent=system.ground, child=mass, axis=[1, 0, 0], coordinate=x))
        system.add_spring_damper(system.ground, mass, stiffness=stiffness, length=l / 2)
        system.defaults = {k: 3.0, l: 1.0}
        module = system.compile(backend="numpy")
        assert module.metadata.conservative
        energies.append(float(module.energy([0.8], [0.0])[1]))
    assert energies == [pytest.approx(0.5 * 6 * 0.3**2)] * 3


def test_points_of_a_spring_are_fixed_on_their_bodies() -> None:
    x = sd.coordinates("x")
    system = sd.System("spring")
    mass = system.add_body("mass", mass=2, inertia=[1, 1, 1])
    system.add_joint(sd.Prismatic("rail", parent=system.ground, child=mass, axis=[1, 0, 0], coordinate=x))
    system.add_spring_damper(system.ground, mass, point_a=[x, 0, 0], stiffness=3)
    with pytest.raises(ModelError, match="spring_1: points"):
        system.compile()
