"""The lecture's examples of moving observers, worked by frames; the expected results are derived by hand."""

from __future__ import annotations

import numpy as np
import sympy as sp

import symdyn as sd
from symdyn.frames import numbers
from tests.frames.chains import turn

m, g, a, w, v, R = sd.parameters("m g a omega v R", positive=True)


def test_bus_box_fixed_and_sliding():
    """Chapter 1.2: the bus accelerates with a along y."""
    n = sd.Frame("n")
    bus = n.frame("bus", origin=[0, a * sd.t**2 / 2, 0])
    fixed = bus.point("P", [0, 1, 0])
    assert fixed.velocity(bus) == sp.zeros(3, 1)
    assert m * fixed.acceleration(n) == sp.Matrix([0, m * a, 0])
    assert fixed.inertial_forces(m).total == sp.Matrix([0, -m * a, 0])
    sliding = n.point("P", [0, 1, 0])
    assert sliding.acceleration(bus) == sp.Matrix([0, -a, 0])
    assert sliding.inertial_forces(m, frame=bus).total == sp.Matrix([0, -m * a, 0])


def test_strap_hangs_at_the_angle_of_a_over_g():
    """In the bus the handle rests: T + m g + inertial force = 0 along the strap gives tan phi = a / g."""
    phi = sp.Symbol("phi")
    bus = sd.Frame("n").frame("bus", origin=[0, a * sd.t**2 / 2, 0])
    handle = bus.point("H", [0, -sp.sin(phi), -sp.cos(phi)])
    tension = sp.sqrt(a**2 + g**2) * m * sp.Matrix([0, sp.sin(phi), sp.cos(phi)])
    balance = tension + sp.Matrix([0, 0, -m * g]) + handle.inertial_forces(m).total
    assert balance.subs(phi, sp.atan(a / g)).applyfunc(sp.simplify) == sp.zeros(3, 1)
    assert balance.subs(phi, -sp.atan(a / g)).applyfunc(sp.simplify) != sp.zeros(3, 1)


def test_scale_in_an_elevator():
    """N = m (g + a) going up with a; weightless in free fall."""
    N = sp.Symbol("N")
    z = sd.coordinates("z")
    lift = sd.Frame("n").frame("lift", origin=[0, 0, z])
    person = lift.point("P")
    forces = sp.Matrix([0, 0, N - m * g]) + person.inertial_forces(m).total
    assert person.acceleration(lift) == sp.zeros(3, 1)
    assert sp.solve(forces.subs(z.ddot, a), N) == {N: m * g + m * a}
    assert sp.solve(forces.subs(z.ddot, -g), N) == {N: 0}


def test_chair_on_a_disc_fixed_and_moving():
    """Chapter 1.7: centrifugal m w^2 r outwards; a chair moving out with v feels 2 m w v against the turn."""
    disc = sd.Frame("n").frame("b", rotation=turn("Z", w * sd.t))
    still = disc.point("P", [R, 0, 0]).inertial_forces(m)
    assert still.centrifugal == sp.Matrix([m * w**2 * R, 0, 0])
    assert still.coriolis == still.euler == still.origin == sp.zeros(3, 1)
    moving = disc.point("P", [R + v * sd.t, 0, 0]).inertial_forces(m)
    assert moving.coriolis == sp.Matrix([0, -2 * m * w * v, 0])
    assert moving.centrifugal.applyfunc(sp.expand) == sp.Matrix([sp.expand(m * w**2 * (R + v * sd.t)), 0, 0])


def test_disc_that_speeds_up_needs_an_euler_force():
    q = sd.coordinates("q")
    forces = sd.Frame("n").frame("b", rotation=turn("Z", q)).point("P", [R, 0, 0]).inertial_forces(m)
    assert forces.euler == sp.Matrix([0, -m * R * q.ddot, 0])


def test_ball_in_a_slot_and_ball_thrown():
    """Chapter 1.9: a spiral from outside; a spiral against the turn from the disc; straight for the other observer."""
    n = sd.Frame("n")
    disc = n.frame("b", rotation=turn("Z", w * sd.t))
    t = np.linspace(0, 2, 7)
    values = {v: 1.5, w: 2.0}
    slot, thrown = disc.point("A", [v * sd.t, 0, 0]), n.point("A", [v * sd.t, 0, 0])
    spiral = 1.5 * t[:, None] * np.stack([np.cos(2 * t), np.sin(2 * t), 0 * t], axis=1)
    straight = np.stack([1.5 * t, 0 * t, 0 * t], axis=1)
    np.testing.assert_allclose(slot.path(n, t, values), spiral, atol=1e-14)
    np.testing.assert_allclose(slot.path(disc, t, values), straight, atol=1e-14)
    np.testing.assert_allclose(thrown.path(n, t, values), straight, atol=1e-14)
    np.testing.assert_allclose(thrown.path(disc, t, values), spiral * [1, -1, 1], atol=1e-14)
    # v_A = v_B + v_rel + omega x r: the thrown ball has v_rel = v - omega x r, the slot's ball a constant one.
    np.testing.assert_allclose(slot.path(disc, t, values, "velocity"), [[1.5, 0, 0]] * 7, atol=1e-14)
    expected = [[1.5, 0, 0]] - np.cross([[0, 0, 2.0]], straight)
    np.testing.assert_allclose(thrown.path(disc, t, values, "velocity", components=n), expected, atol=1e-14)


def test_projectile_on_a_meridian_has_three_terms():
    """Chapter 1.4: a = R cos(gt) b'' - 2 g R sin(gt) b' - g^2 r with b turning with the earth, g the rate on the meridian."""
    rate = sp.Symbol("gamma", positive=True)
    n = sd.Frame("n")
    earth = n.frame("b", rotation=turn("Z", w * sd.t))
    r = sp.Matrix([R * sp.cos(rate * sd.t), 0, R * sp.sin(rate * sd.t)])
    P = earth.point("P", r)
    parts = P.acceleration_parts()
    b = sp.Matrix([sp.cos(w * sd.t), sp.sin(w * sd.t), 0])
    assert parts.centripetal == R * sp.cos(rate * sd.t) * b.diff(sd.t, 2)
    assert parts.coriolis == -2 * rate * R * sp.sin(rate * sd.t) * b.diff(sd.t)
    assert parts.relative == -rate**2 * P.position()
    assert parts.euler == parts.origin == sp.zeros(3, 1)
    position = R * sp.cos(rate * sd.t) * b + sp.Matrix([0, 0, R * sp.sin(rate * sd.t)])
    assert (parts.total - position.diff(sd.t, 2)).applyfunc(sp.expand) == sp.zeros(3, 1)


def test_ship_in_two_frames():
    """Chapter 1.5: the same velocity and force, other components; the ship heads 3-4-5 off the x axis."""
    n = sd.Frame("n")
    ship = n.frame("b", rotation=[[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]])
    force = ship.vector([17500, 0, 0], "F")
    np.testing.assert_allclose(force.at(components=n), [14000, 10500, 0], rtol=1e-15)
    np.testing.assert_allclose(n.vector([12, 9, 0]).at(components=ship), [15, 0, 0], atol=1e-14)
    speed = 7.2 + 10 * 17500 / 350000
    np.testing.assert_allclose(ship.vector([speed, 0, 0]).at(components=n), [6.16, 4.62, 0], rtol=1e-15)
    x = sd.coordinates("x")
    there = n.point("O", [0.8 * x, 0.6 * x, 0])
    np.testing.assert_allclose(numbers(there.velocity(n, ship), {x: 7.2 * sd.t + 0.025 * sd.t**2}, 10), [7.7, 0, 0],
                               atol=1e-14)


def test_frame_that_moves_evenly_is_inertial_too():
    """Chapter 2.2, reference: with constant velocity and without rotation accelerations are the same."""
    x, y = sd.coordinates("x y")
    n = sd.Frame("n")
    b = n.frame("b", origin=[v * sd.t, 0, 0])
    P = n.point("P", [x, y, 0])
    assert P.acceleration(b) == P.acceleration(n) == sp.Matrix([x.ddot, y.ddot, 0])
    assert P.inertial_forces(m, frame=b).total == sp.zeros(3, 1)


def test_parts_are_printed_by_name():
    q, x = sd.coordinates("q x")
    P = sd.Frame("n").frame("b", rotation=turn("Z", q)).point("P", [x, 0, 0])
    assert repr(P.acceleration_parts()).splitlines() == [
        "acceleration of P seen from n, by way of b, components in n",
        "  origin      [0, 0, 0]",
        "  relative    [x_ddot*cos(q), x_ddot*sin(q), 0]",
        "  euler       [-x*q_ddot*sin(q), x*q_ddot*cos(q), 0]",
        "  centripetal [-x*q_dot**2*cos(q), -x*q_dot**2*sin(q), 0]",
        "  coriolis    [-2*q_dot*x_dot*sin(q), 2*q_dot*x_dot*cos(q), 0]",
        "  total       [(-x*q_dot**2 + x_ddot)*cos(q) - (x*q_ddot + 2*q_dot*x_dot)*sin(q), "
        "(-x*q_dot**2 + x_ddot)*sin(q) + (x*q_ddot + 2*q_dot*x_dot)*cos(q), 0]"]
    assert repr(P.inertial_forces(m)).startswith("inertial forces on P felt in b, inertial is n, components in b\n  origin")
    assert repr(P.velocity_parts()).startswith("velocity of P seen from n, by way of b, components in n\n  origin")


def test_parts_are_typeset():
    q, x = sd.coordinates("q x")
    P = sd.Frame("n").frame("b", rotation=turn("Z", q)).point("P", [x, 0, 0])
    latex = P.inertial_forces(m)._repr_latex_()
    assert latex.startswith(r"$\displaystyle {}^{b}\mathbf{F}_{P,\text{inertial}} = \underbrace{")
    assert r"\left[\begin{matrix}0\\- 2 m \dot{q} \dot{x}\\0\end{matrix}\right]}_{\text{Coriolis}}" in latex
    assert latex.count("{") == latex.count("}")
    assert r"\text{centripetal}" in P.acceleration_parts()._repr_latex_()
    assert r"\text{transport}" in P.velocity_parts()._repr_latex_()


def test_parts_too_long_to_read_are_counted():
    frame = sd.Frame("n")
    for k, q in enumerate(sd.coordinates("q1:6")):
        frame = frame.frame(f"b{k}", rotation=turn("ZX"[k % 2], q), origin=[0, 1, 0])
    parts = frame.point("P", [1, 2, 3]).acceleration_parts()
    count = int(sp.count_ops(parts.origin))
    assert count > 300
    assert f"  origin      (3 components, {count} operations)" in repr(parts)
    assert "  relative    [0, 0, 0]" in repr(parts)
    assert rf"(3\times 1,\ {count}\ \text{{operations}})" in parts._repr_latex_()


def test_parts_in_numbers_and_with_symbols_replaced():
    q, x = sd.coordinates("q x")
    P = sd.Frame("n").frame("b", rotation=turn("Z", q)).point("P", [x, 0, 0])
    parts = P.acceleration_parts(components=P.frame)
    given = {q: 0.2, q.dot: 2, q.ddot: 3, x: 0.5, x.dot: 4, x.ddot: 5}
    here = parts.at(given)
    np.testing.assert_allclose(here.total, [5 - 2, 1.5 + 16, 0], rtol=1e-15)
    np.testing.assert_allclose(here.coriolis, [0, 16, 0])
    assert "[ 3.  17.5  0. ]" in repr(here)
    assert list(map(float, parts.subs(given).total)) == [3, 17.5, 0]
    assert parts.at({q: 3 * sd.t, x: sd.t}, np.array([0.0, 1.0])).centripetal.tolist() == [[0, 0, 0], [-9, 0, 0]]
