"""Cut loads and reactions of joints against sums of forces and moments by hand; the axes they come in."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError

T = np.linspace(0, 0.7, 8)
FORMULATIONS = ("embedding", "recursive", "augmented", "absolute")


def compiled(system: sd.System, formulation: str, backend: str = "numpy") -> Any:
    if formulation == "absolute":
        return system.augmented(coordinates="absolute").compile(backend)
    return getattr(system, formulation)().compile(backend)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_driven_arm_with_spring_and_damper_in_its_joint(formulation: str) -> None:
    """A rod of mass m that turns about a horizontal axis at its end, weight, drive T, spring and damper in the joint.

    The joint carries m (a_G - g) and, about its point, J_O q_ddot + the moment of the weight: that of drive, spring and damper.
    """
    q = sd.coordinates("q")
    m, l, J, k, c, drive, g = 2.0, 0.6, 0.05, 3.0, 0.4, 5.0, 9.81
    system = sd.System("arm", gravity=[0, -g, 0])
    rod = system.add_body("rod", mass=m, inertia=[J, J, J], com=[l, 0, 0])
    joint = sd.Revolute("hinge", parent=system.ground, child=rod, axis=[0, 0, 1], coordinate=q)
    system.add_joint(joint)
    system.add_joint_force(joint, drive - k * q - c * q.dot)
    system.initial = {q: 0.3, q.dot: 0.8}
    sol = compiled(system, formulation).simulate(T, rtol=1e-12, atol=1e-12)
    a, w = sol["q"], sol["q_dot"]
    own = drive - k * a - c * w
    alpha = (own - m * g * l * np.cos(a)) / (J + m * l**2)
    force = m * np.column_stack([l * (-alpha * np.sin(a) - w**2 * np.cos(a)), l * (alpha * np.cos(a) - w**2 * np.sin(a)) + g])
    cut = sol.cut_loads["hinge"]
    np.testing.assert_allclose(cut[:, :2], force, rtol=0, atol=1e-9)
    np.testing.assert_allclose(cut[:, 5], own, rtol=0, atol=1e-9)
    np.testing.assert_allclose(sol.reactions["hinge"][:, 5], 0, rtol=0, atol=1e-9)
    np.testing.assert_allclose(sol.reactions["hinge"][:, :5], cut[:, :5], rtol=0, atol=1e-9)
    in_rod = sol.cut_load("hinge", frame="child")
    np.testing.assert_allclose(in_rod[:, 0], np.cos(a) * cut[:, 0] + np.sin(a) * cut[:, 1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(sol.cut_load(joint), cut)


@pytest.mark.every_value
@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("kind", ["dependent coordinate", "gear"])
def test_the_same_gear_has_the_same_cut_loads_however_it_is_described(kind: str, formulation: str) -> None:
    """Shafts of I_1 and I_2 that a gear couples, 2 to 1; a drive turns the first: (I_1 + 4 I_2) p_ddot = T."""
    if kind == "gear" and formulation in ("embedding", "recursive"):
        formulation = "augmented"
    p, s = sd.coordinates("p s")
    I_1, I_2, drive = 3.0, 0.5, 7.0
    system = sd.System("gears")
    one, two = (system.add_body(name, mass=1, inertia=[I, I, I]) for name, I in (("one", I_1), ("two", I_2)))
    first = sd.Revolute("first", parent=system.ground, child=one, axis=[0, 0, 1], coordinate=p)
    system.add_joint(first)
    second = 2 * p if kind == "dependent coordinate" else s
    other = sd.Revolute("second", parent=system.ground, child=two, axis=[0, 0, 1], coordinate=second, parent_point=[1, 0, 0])
    system.add_joint(other)
    if kind == "gear":
        system.close_loop(sd.Gear("teeth", first, other, ratio=2))
    system.add_joint_force(first, drive)
    sol = compiled(system, formulation).simulate(T, rtol=1e-10)
    alpha = drive / (I_1 + 4 * I_2)
    np.testing.assert_allclose(sol.cut_loads["first"][:, 5], I_1 * alpha, rtol=1e-9)
    np.testing.assert_allclose(sol.cut_loads["second"][:, 5], 2 * I_2 * alpha, rtol=1e-9)
    wanted = 2 * I_2 * alpha if kind == "dependent coordinate" else 0.0
    np.testing.assert_allclose(sol.reactions["second"][:, 5], wanted, rtol=0, atol=1e-9)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_joint_at_a_ground_that_turns_is_seen_in_the_axes_of_the_ground(formulation: str) -> None:
    """A post that is fixed to a turntable and carries its weight, which lies in the plane: seen from the table it turns back."""
    q = sd.coordinates("q")
    system = sd.System("table", gravity=[0, -10, 0])
    system.move_ground(angles=[sp.Rational(3, 2) * sd.t, 0, 0])
    post, wheel = (system.add_body(name, mass=2, inertia=[1, 1, 1]) for name in ("post", "wheel"))
    system.add_joint(sd.Fixed("foot", parent=system.ground, child=post))
    system.add_joint(sd.Revolute("shaft", parent=post, child=wheel, axis=[0, 0, 1], coordinate=q))
    sol = compiled(system, formulation).simulate(T, rtol=1e-10)
    a, weight = 1.5 * T, 2 * 2 * 10
    turned = weight * np.column_stack([np.sin(a), np.cos(a)])
    for frame in ("parent", "ground", system.ground, "post"):
        np.testing.assert_allclose(sol.reaction("foot", frame=frame)[:, :2], turned, rtol=0, atol=1e-9)
    for still in (sol.reactions["foot"], sol.reaction("foot"), sol.reaction("foot", frame="inertial")):
        np.testing.assert_allclose(still[:, :2], np.tile([0, weight], (len(T), 1)), rtol=0, atol=1e-9)
    with pytest.raises(ArgumentError, match="there is no frame 'wall'; there are inertial, ground, parent, child, post, wheel"):
        sol.reaction("foot", frame="wall")
    with pytest.raises(ArgumentError, match="no reaction of a joint 'feet' is known; there are foot, shaft"):
        sol.cut_load("feet")
