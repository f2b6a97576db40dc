"""Constrained motion that is described at gimbal lock: start values are numbers, and equations come, or an error of ours."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ModelError, ModelWarning

BODY_SPEEDS = sd.EulerAngles("ZXZ", speeds="body")
SPIN = sd.speeds("p q r")


def top() -> sd.System:
    """Two bodies, the first on a joint whose ZXZ angles all start at zero, which is gimbal lock."""
    system = sd.System("top", gravity=[0, 0, -9.81])
    first, second = (system.add_body(name, mass=2, inertia=[1, 1, 1.5], com=[0, 0, 0.2]) for name in ("first", "second"))
    system.add_joint(sd.Spherical("ball", parent=system.ground, child=first, orientation=BODY_SPEEDS, speeds=SPIN))
    system.add_joint(sd.Revolute("hinge", parent=first, child=second, axis=[0, 1, 0], coordinate=sd.coordinates("h"),
                                 parent_point=[0, 0, 1], child_point=[0.3, 0, 0]))
    return system


@pytest.mark.parametrize("backend", ["numpy", "c"])
def test_speeds_of_the_body_at_gimbal_lock_have_start_values_in_absolute_coordinates(backend: str) -> None:
    system = top()
    system.initial = dict(zip(SPIN, (0.4, -0.3, 0.7), strict=True))
    equations = system.augmented(coordinates="absolute")
    start = {s.name: v for s, v in equations.symbols.initial.items()}
    assert all(np.isfinite(v) for v in start.values())
    omega = np.array([0.4, -0.3, 0.7])
    np.testing.assert_allclose([start[f"omega_{axis}_first"] for axis in "xyz"], omega, atol=1e-15)
    place = np.array([start[f"{axis}_second"] for axis in "xyz"])
    np.testing.assert_allclose([start[f"{axis}_second_dot"] for axis in "xyz"], np.cross(omega, place), atol=1e-15)
    assert equations.compile(backend=backend).simulate((0, 0.1)).success


def test_start_values_on_a_ground_that_moves() -> None:
    """Velocities of the bodies are those that the ground sees: of a body at rest on it none."""
    system = top()
    system.move_ground(position=[2 * sd.t, 0, 0], angles=[3 * sd.t, 0, 0])
    start = {s.name: v for s, v in system.augmented(coordinates="absolute").symbols.initial.items()}
    assert {v for name, v in start.items() if name.endswith("_dot") or name.startswith("omega")} == {0.0}


def test_a_start_without_numbers_is_an_error() -> None:
    """A wheel whose angle follows one of the angles that has no rate there."""
    a, b, c = sd.coordinates("a b c")
    system = sd.System("geared")
    first, second = (system.add_body(name, mass=2, inertia=[1, 1, 1.5]) for name in ("first", "second"))
    system.add_joint(sd.Spherical("ball", parent=system.ground, child=first, orientation=BODY_SPEEDS, coordinates=[a, b, c]))
    system.add_joint(sd.Revolute("wheel", parent=first, child=second, axis=[1, 0, 0], coordinate=2 * c))
    with pytest.raises(ModelError, match=r"the initial state has no numbers in absolute coordinates: .*omega_x_second"):
        system.augmented(coordinates="absolute")


@pytest.mark.parametrize("close", [True, False])
def test_augmented_equations_come_where_the_mass_matrix_does_not_exist_at_the_start(close: bool) -> None:
    """A wheel that follows an angle has a mass matrix by rates of angles; away from gimbal lock all is well."""
    a, b, c = sd.coordinates("a b c")
    system = sd.System("geared", gravity=[0, 0, -9.81])
    first, second = (system.add_body(name, mass=2, inertia=[1, 1, 1.5], com=[0, 0, 0.2]) for name in ("first", "second"))
    system.add_joint(sd.Free("ball", parent=system.ground, child=first, orientation=BODY_SPEEDS,
                             coordinates=[*sd.coordinates("x y z"), a, b, c]))
    system.add_joint(sd.Revolute("wheel", parent=first, child=second, axis=[1, 0, 0], coordinate=2 * c))
    if close:
        system.close_loop(sd.Rod("rod", system.ground, first, length=sp.Rational(5, 4), parent_point=[sp.Rational(3, 4), 0, 0],
                                 child_point=[0, 0, 1]))
    else:
        system.add_constraint(system.joints[0].coordinates[0])
    with warnings.catch_warnings():
        warnings.simplefilter("error", ModelWarning)
        module: Any = system.augmented().compile(backend="numpy")
    q, u = module.consistent({"b": 0.4, "a": 0.1})
    assert module.simulate((0, 0.1), q, u).success
