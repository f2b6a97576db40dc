"""Speeds from `consistent` are those after an impact: closed forms of a few mechanisms, to rounding."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import symdyn as sd

TOLERANCE = 1e-12


def test_a_rod_that_is_caught_at_its_end_keeps_its_angular_momentum_about_it():
    """omega = (I omega_0 + m r x v_0) / (I + m r^2) about the pin, the origin of the rod, which comes to rest."""
    system = sd.System("rod", gravity=[0, -9.81])
    m, I, r, angle = 3.0, 0.02, 0.7, 0.8
    rod = system.add_body("rod", mass=m, inertia=I, com=[r, 0])
    system.add_joint(sd.Revolute("pin", system.ground, rod, sd.coordinates("q")))
    module = system.augmented(coordinates="absolute").compile(backend="numpy")
    before = np.array([1.3, -0.4, 5.0])
    q, u = module.consistent([0.0, 0.0, angle], before)
    across = np.array([-np.sin(angle), np.cos(angle)])
    v = before[:2] + before[2] * r * across
    omega = (I * before[2] + m * r * across @ v) / (I + m * r**2)
    assert np.abs(q - [0.0, 0.0, angle]).max() == 0
    assert np.abs(u - [0.0, 0.0, omega]).max() < TOLERANCE * 5


@pytest.mark.parametrize("times", [1, 3])
def test_wheels_that_are_engaged_share_their_speed_by_their_inertias(times):
    """I_1, I_2 with q_1 = n q_2: impulses n apart, so omega_2 = (n I_1 omega_1 + I_2 omega_2) / (n^2 I_1 + I_2)."""
    n, inertias = 3, (2.0, 5e-4)
    q = sd.coordinates("q1 q2")
    system = sd.System("wheels", planar=True)
    for k in range(2):
        wheel = system.add_body(f"wheel{k}", mass=1, inertia=inertias[k])
        system.add_joint(sd.Revolute(f"axle{k}", system.ground, wheel, q[k], parent_point=[k, 0]))
    for k in range(times):
        system.add_constraint((k + 1) * (q[0] - n * q[1]))
    module = system.augmented().compile(backend="numpy")
    _, u = module.consistent([0.0, 0.0], [4.0, -7.0])
    omega = (n * inertias[0] * 4.0 - inertias[1] * 7.0) / (n**2 * inertias[0] + inertias[1])
    assert np.abs(u - [n * omega, omega]).max() < TOLERANCE * 7


def test_carts_that_couple_take_a_massless_one_along():
    """x_1 (no mass) follows the common motion of x_2 and x_3 by their momentum; one of three constraints is redundant."""
    x = sd.coordinates("x1:4")
    system = sd.System("carts", planar=True)
    for k, mass in enumerate((0, 2, 7)):
        cart = system.add_body(f"cart{k + 1}", mass=mass)
        system.add_joint(sd.Prismatic(f"rail{k + 1}", system.ground, cart, x[k], axis=[1, 0]))
    for a, b in ((0, 1), (1, 2), (0, 2)):
        system.add_constraint(x[a] - x[b])
    _, u = system.augmented().compile(backend="numpy").consistent(np.zeros(3), [9.0, 1.0, -3.0])
    assert np.abs(u - (2 * 1.0 - 7 * 3.0) / 9).max() < TOLERANCE * 9


def test_massless_motions_take_the_smallest_velocities():
    """x_1 + x_2 + x_3 = 0 where x_1 and x_2 have no mass: x_3 keeps its speed, and x_1 and x_2 change alike."""
    x = sd.coordinates("x1:4")
    system = sd.System("rest", planar=True)
    for k, mass in enumerate((0, 0, 7)):
        cart = system.add_body(f"cart{k + 1}", mass=mass)
        system.add_joint(sd.Prismatic(f"rail{k + 1}", system.ground, cart, x[k], axis=[1, 0]))
    system.add_constraint(x[0] + x[1] + x[2])
    system.add_constraint(x[0] - x[1])
    _, u = system.augmented().compile(backend="numpy").consistent(np.zeros(3), [1.0, 2.0, -4.0])
    assert np.abs(u - [2.0, 2.0, -4.0]).max() < TOLERANCE * 4


def test_a_particle_on_an_incline_keeps_its_speed_along_it_whatever_the_masses():
    """Two particles of very different mass, coupled by x_1 + 2 y_2 = const: the impulse is along (1, 2)."""
    x, y = sd.coordinates("x y")
    a, b = sp.Integer(1000), sp.Rational(1, 1000)
    eq = sd.augmented(coordinates=[x, y], mass=[a, b], force=[0, 0], constraints=[x + 2 * y])
    _, u = eq.compile(backend="numpy").consistent([0.0, 0.0], [0.3, 0.9])
    impulse = -(0.3 + 1.8) / (1 / 1000 + 4 * 1000)
    assert np.abs(u - [0.3 + impulse / 1000, 0.9 + 2 * impulse * 1000]).max() < TOLERANCE
