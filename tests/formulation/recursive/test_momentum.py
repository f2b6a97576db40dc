"""Momenta, centre of mass, energies: their rates are what acts from outside."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import SymdynError
from symdyn.formulation.textbook.composite_bodies import composite_bodies, held_inertia
from symdyn.formulation.textbook.energy import energy
from symdyn.formulation.textbook.forward_dynamics import forward_dynamics
from symdyn.formulation.textbook.inverse_dynamics import InverseDynamics, inverse_dynamics
from symdyn.formulation.textbook.momentum import momentum
from symdyn.formulation.textbook.numbers import Numbers, NumericTree
from symdyn.formulation.textbook.velocities import base_acceleration, joint_accelerations
from symdyn.formulation.trees.tree import GROUND, Tree
from tests import helpers
from tests.formulation.recursive.trees import at, by_time, numeric, random_vector, state

CASES = [(seed, options) for options in ({}, {"gears": True}, {"driven": True}) for seed in (0, 6, 9)]


def carried_to_the_ground(tree: Tree, forces: Any) -> np.ndarray:
    """Sum of forces (6,) on links, about the n-origin."""
    f = list(forces)
    total = np.zeros(6, dtype=object)
    for i, link in reversed(list(enumerate(tree.links))):
        moment = link.R @ f[i][:3] + np.cross(link.r, link.R @ f[i][3:])
        at_parent = np.concatenate([moment, link.R @ f[i][3:]])
        if link.parent == GROUND:
            total = total + at_parent
        else:
            f[link.parent] = f[link.parent] + at_parent
    return total


def from_the_ground(here: Numbers, inverse: InverseDynamics) -> np.ndarray:
    """Force and moment of the ground on the mechanism through the joints on it, about the n-origin."""
    rooted = [f if link.parent == GROUND else 0 * f for f, link in zip(inverse.f, here.tree.links, strict=True)]
    return carried_to_the_ground(here.tree, rooted)


def momenta(tree: Tree) -> np.ndarray:
    """h_0, h_G and the centre of mass, (15,)."""
    found = momentum(tree)
    return np.concatenate([found.h_0, found.h_G, found.center])


@pytest.mark.every_value
@pytest.mark.parametrize(("seed", "options"), CASES)
def test_rates_of_momenta_are_external_forces(seed: int, options: dict[str, bool]) -> None:
    tree = numeric(seed, **options)
    where = state(tree, seed, 60)
    u_dot = random_vector(len(tree.model.speeds), seed)
    here = tree.at(**where, digits=60)
    inverse = inverse_dynamics(here.tree, joint_accelerations(here.tree, u_dot), wrenches=here.applied.wrenches)
    found, rate = momentum(here.tree), by_time(tree, where, u_dot, momenta)
    with mpmath.workdps(60):
        weight = -(composite_bodies(here.tree).I_0 - held_inertia(here.tree)) @ base_acceleration(here.tree)
        loads = carried_to_the_ground(here.tree, [np.concatenate([n, f]) for f, n in here.applied.wrenches])
        total = from_the_ground(here, inverse) + weight + loads
        assert helpers.close(rate[:6], total)
        # About the centre of mass: the same moments, less r_G x the forces; and it moves with the linear momentum.
        assert helpers.close(rate[6:9], total[:3] - np.cross(found.center, total[3:]))
        assert helpers.close(found.mass * rate[12:], found.h_0[3:])
        m, n = mpmath.mpf(1.25), len(tree.model.bodies)
        assert helpers.close(found.mass, n * m + n * (n - 1) // 2)


def test_nothing_from_outside_keeps_the_momenta() -> None:
    """A free body with an arm, driven from inside: only gravity acts, along it the momentum grows, about G none does."""
    g, m = sd.parameters("g m")
    q = sd.coordinates("q1:7")
    s = sd.System("satellite", gravity=[0, 0, -g])
    hull = s.add_body("hull", mass=3 * m, inertia=[1, 2, 2.5], com=[0.1, 0, 0.2])
    arm = s.add_body("arm", mass=m, inertia=[0.1, 0.2, 0.2], com=[0.5, 0, 0])
    s.add_joint(sd.Free("free", s.ground, hull, q))
    elbow = s.add_joint(sd.Revolute("elbow", hull, arm, axis=[0, 1, 0], parent_point=[0.3, 0.1, 0]))
    s.add_joint_force(elbow, 2.5)
    s.defaults = {g: 9.81, m: 1.5}
    tree = NumericTree(s.check())
    where = {"q": dict(zip((c.name for c in tree.model.coordinates), random_vector(7, 1), strict=True)),
             "u": dict(zip((c.name for c in tree.model.speeds), random_vector(7, 2), strict=True)), "t": 0}
    here = tree.at(**where, digits=60)
    u_dot = forward_dynamics(here.tree, here.applied.joint, here.applied.wrenches).u_dot
    rate = by_time(tree, where, u_dot, momenta)[6:12]
    with mpmath.workdps(60):
        assert helpers.close(rate, np.array([0, 0, 0, 0, 0, -6 * mpmath.mpf(9.81)], dtype=object))


@pytest.mark.parametrize("seed", range(0, 14, 3))
def test_kinetic_energy_is_that_of_the_mass_matrix_and_of_the_momenta(seed: int) -> None:
    here = at(numeric(seed), seed).tree
    u = np.array(list(state(numeric(seed), seed)["u"].values()), dtype=object)
    kinetic = energy(here).kinetic
    assert kinetic == pytest.approx(u @ composite_bodies(here).M @ u / 2, rel=1e-13)
    assert kinetic == pytest.approx(sum(energy(here).T), rel=1e-15)


def test_no_mass_no_centre_of_mass() -> None:
    s = sd.System("massless")
    s.add_joint(sd.Revolute("hinge", s.ground, s.add_body("disc", inertia=[1, 1, 1]), axis=[0, 0, 1]))
    with pytest.raises(SymdynError, match="no body has a mass"):
        momentum(NumericTree(s.check()).at([0.1], [0.2]).tree)
