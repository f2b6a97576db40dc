"""One rigid body: every equation against a cloud of particles, energy and momentum balances, and sympy.physics.mechanics."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from sympy.physics import mechanics as me

import symdyn as sd
from symdyn import frames
from tests.frames.chains import turn


class _Cloud:
    """Six particles that move as one body: positions from a point O of it, with omega, alpha, v_O, a_O at random."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        self.masses = rng.uniform(0.5, 2, 6)
        self.r = rng.uniform(-1, 1, (6, 3))
        self.omega, self.alpha, self.v, self.a = rng.uniform(-2, 2, (4, 3))
        self.mass = self.masses.sum()
        self.r_G = self.masses @ self.r / self.mass
        self.velocities = self.v + np.cross(self.omega, self.r)
        self.forces = self.masses[:, None] * (self.a + np.cross(self.alpha, self.r)
                                              + np.cross(self.omega, np.cross(self.omega, self.r)))
        self.I_O = frames.point_inertia(self.masses, self.r)
        self.I_G = frames.point_inertia(self.masses, self.r - self.r_G)


clouds = pytest.mark.parametrize("cloud", [_Cloud(1), _Cloud(2)])
close = {"rtol": 1e-12, "atol": 1e-12}


@clouds
def test_parallel_axes_both_ways(cloud):
    np.testing.assert_allclose(frames.inertia_about(cloud.I_G, cloud.mass, cloud.r_G), cloud.I_O, **close)
    np.testing.assert_allclose(frames.inertia_about(cloud.I_G, cloud.mass, -cloud.r_G), cloud.I_O, **close)
    np.testing.assert_allclose(frames.inertia_about_com(cloud.I_O, cloud.mass, cloud.r_G), cloud.I_G, **close)
    np.testing.assert_allclose(frames.center_of_mass(cloud.masses, cloud.r), cloud.r_G, **close)


@clouds
def test_moment_and_force_are_those_of_the_particles(cloud):
    M_O = np.cross(cloud.r, cloud.forces).sum(axis=0)
    found = frames.moment_equation(cloud.I_O, cloud.omega, cloud.alpha, cloud.mass, cloud.r_G, cloud.a)
    np.testing.assert_allclose(found, M_O, **close)
    F = cloud.forces.sum(axis=0)
    np.testing.assert_allclose(frames.force_equation(cloud.mass, cloud.a, cloud.omega, cloud.alpha, cloud.r_G), F, **close)
    M_G = np.cross(cloud.r - cloud.r_G, cloud.forces).sum(axis=0)
    np.testing.assert_allclose(frames.moment_equation(cloud.I_G, cloud.omega, cloud.alpha), M_G, **close)
    # The forces moved from G to O give the moment about O.
    moved = frames.equivalent_force_system(F, cloud.r_G, M_G)
    np.testing.assert_allclose(moved.moment, M_O, **close)
    np.testing.assert_array_equal(moved.force, F)


@clouds
def test_momentum_and_energy_are_those_of_the_particles(cloud):
    H_O = np.cross(cloud.r, cloud.masses[:, None] * cloud.velocities).sum(axis=0)
    T = (cloud.masses * (cloud.velocities**2).sum(axis=1)).sum() / 2
    np.testing.assert_allclose(frames.angular_momentum(cloud.I_O, cloud.omega, cloud.mass, cloud.r_G, cloud.v), H_O, **close)
    assert frames.kinetic_energy(cloud.mass, cloud.I_O, cloud.v, cloud.omega, cloud.r_G) == pytest.approx(T, rel=1e-13)
    v_G = cloud.v + np.cross(cloud.omega, cloud.r_G)
    assert frames.kinetic_energy(cloud.mass, cloud.I_G, v_G, cloud.omega) == pytest.approx(T, rel=1e-13)


@clouds
def test_inertia_in_other_axes_is_that_of_turned_particles(cloud):
    R = np.linalg.qr(cloud.r[:3])[0]
    R = R * np.sign(np.linalg.det(R))
    np.testing.assert_allclose(frames.rotated_inertia(R, cloud.I_O), frames.point_inertia(cloud.masses, cloud.r @ R.T), **close)


@clouds
def test_plane_is_the_spatial_case_about_z(cloud):
    flat = np.array([1, 1, 0])
    r, a = cloud.r_G * flat, cloud.a * flat
    I, w, alpha = cloud.I_O[2, 2], cloud.omega[2], cloud.alpha[2]
    z = np.array([0, 0, 1])
    M = frames.moment_equation(np.diag([I, I, I]), w * z, alpha * z, cloud.mass, r, a)
    assert frames.planar_moment_equation(I, alpha, cloud.mass, r[:2], a[:2]) == pytest.approx(M[2], rel=1e-13)
    F = frames.force_equation(cloud.mass, a, w * z, alpha * z, r)
    np.testing.assert_allclose(frames.planar_force_equation(cloud.mass, a[:2], w, alpha, r[:2]), F[:2], **close)


def test_moment_is_the_rate_of_the_momentum_in_the_inertial_frame():
    """M_O = d/dt (R I_O R^T omega) + m r_G x a_O, differentiated in the n-frame, for a body whose reference point accelerates."""
    a, b, x = sd.coordinates("a b x")
    A, B, C, D, m, l = sd.parameters("A B C D m l")
    n = sd.Frame("n")
    carrier = n.frame("b", rotation=turn("Z", a) * turn("X", b), origin=[x, a * x, 0])
    body = carrier.body(m, [[A, D, 0], [D, B, 0], [0, 0, C]], [l, 0, 2 * l])
    O = carrier.point("O")
    I = body.inertia(O, n)
    term = m * (O.position() - body.com.position()).cross(O.acceleration())
    expected = sd.rate(I * carrier.angular_velocity()) - term
    motion = {a: 0.3 + sd.t, b: sd.t**2, x: sp.sin(sd.t), A: 1.1, B: 1.3, C: 0.9, D: 0.2, m: 2, l: 0.4}
    np.testing.assert_allclose(frames.numbers(body.moment(O, n), motion, 0.7), frames.numbers(expected, motion, 0.7), **close)
    R = frames.numbers(n.rotation(carrier), motion, 0.7)
    np.testing.assert_allclose(frames.numbers(body.moment(O), motion, 0.7), R @ frames.numbers(expected, motion, 0.7), **close)
    # Moments about G and O differ by that of the force m a_G at G.
    moved = frames.equivalent_force_system(body.force(n), body.com.position(O, n), body.moment(None, n))
    np.testing.assert_allclose(frames.numbers(moved.moment, motion, 0.7), frames.numbers(expected, motion, 0.7), **close)


def test_energy_in_both_frames_and_its_balance_of_power():
    """T is one number in n- and b-components, and T_dot = F . v_G + M_G . omega."""
    a, b, x = sd.coordinates("a b x")
    A, B, C, m, l = sd.parameters("A B C m l")
    n = sd.Frame("n")
    carrier = n.frame("b", rotation=turn("Y", a) * turn("X", b), origin=[x, 0, a * b])
    body = carrier.body(m, [A, B, C], [0, l, 0])
    motion = {a: 0.3 + sd.t, b: sd.t**2, x: sp.sin(sd.t), A: 1.1, B: 1.3, C: 0.9, m: 2, l: 0.4}
    T = body.kinetic_energy()
    assert frames.numbers(T, motion, 0.7) == pytest.approx(frames.numbers(body.kinetic_energy(n), motion, 0.7), rel=1e-13)
    power = body.force().dot(body.com.velocity(n, carrier)) + body.moment().dot(carrier.angular_velocity(n, carrier))
    assert frames.numbers(sd.rate(T), motion, 0.7) == pytest.approx(frames.numbers(power, motion, 0.7), rel=1e-12)


def test_against_sympy_mechanics():
    q, x = me.dynamicsymbols("q x")
    A, B, C, m, l = sp.symbols("A B C m l")
    N = me.ReferenceFrame("N")
    S = N.orientnew("S", "Body", [q, x, 0], "ZXZ")
    E, O = me.Point("E"), me.Point("O")
    E.set_vel(N, 0)
    O.set_pos(E, x * N.y)
    O.set_vel(N, x.diff() * N.y)
    G = O.locatenew("G", l * S.x + 2 * l * S.z)
    G.v2pt_theory(O, N, S)
    known = me.RigidBody("known", G, S, m, (me.inertia(S, A, B, C), G))
    carrier = sd.Frame("n").frame("b", rotation=turn("Z", q) * turn("X", x), origin=[0, x, 0])
    body = carrier.body(m, [A, B, C], [l, 0, 2 * l])
    motion = {q: 0.3 + sd.t, x: sd.t**2, A: 1.1, B: 1.3, C: 0.9, m: 2, l: 0.4}
    about_O = known.parallel_axis(O).to_matrix(S)
    assert (body.inertia(carrier.point("O")) - about_O).applyfunc(sp.expand) == sp.zeros(3, 3)
    T = known.kinetic_energy(N).subs(motion).doit()
    assert frames.numbers(body.kinetic_energy(), motion, 0.7) == pytest.approx(float(T.subs(sd.t, 0.7)), rel=1e-12)
    for about, point in ((carrier.point("O"), O), (None, G)):
        H = known.angular_momentum(point, N).to_matrix(S).subs(motion).doit().subs(sd.t, 0.7)
        np.testing.assert_allclose(frames.numbers(body.angular_momentum(about), motion, 0.7),
                                   np.array(H, dtype=float).ravel(), **close)


def test_lecture_force_off_the_centre_of_mass():
    """Chapter 2.2: F_G = F_P and M_G = r_P/G x F_P, in the plane only about z."""
    _r, F, x, y = sp.symbols("r F x y")
    system = frames.equivalent_force_system([F, 0, 0], [x, y, 0])
    assert system.force == sp.Matrix([F, 0, 0])
    assert system.moment == sp.Matrix([0, 0, -y * F])


def test_two_particles_of_the_lecture():
    m1, m2, x1, y1, z1 = sp.symbols("m1 m2 x1 y1 z1")
    expected = sp.Matrix([[m1 * (y1**2 + z1**2), -m1 * x1 * y1, -m1 * x1 * z1],
                          [-m1 * x1 * y1, m1 * (x1**2 + z1**2), -m1 * y1 * z1],
                          [-m1 * x1 * z1, -m1 * y1 * z1, m1 * (x1**2 + y1**2)]])
    found = frames.point_inertia([m1, m2], [[x1, y1, z1], [0, 0, 0]])
    assert (found - expected).applyfunc(sp.expand) == sp.zeros(3, 3)


@pytest.mark.parametrize(("call", "error", "message"), [
    (lambda: frames.inertia_about([[1, 2, 0], [0, 1, 0], [0, 0, 1]], -1, [1, 2]), sd.ArgumentError,
     r"I_G is not symmetric: I\[1, 2\] = 2, I\[2, 1\] = 0; .*mass is -1 kg; pass 0 or more; .*r has 2 components; pass 3"),
    (lambda: frames.inertia_about([-1, 2, 2], 1, [0, 0, 0]), sd.ArgumentError,
     "principal moments -1, 2, 2 kg m.*one is negative"),
    (lambda: frames.inertia_about_com([1, 1, 1], 1, [3, 0, 0]), sd.ArgumentError,
     "what is left about G has the principal moments -8, -8, 1 kg m"),
    (lambda: frames.inertia_about([[1, 0], [0, 1]], 1, [0, 0, 0]), sd.ArgumentError, "I_G is not a 3 x 3 matrix"),
    (lambda: frames.rotated_inertia(2 * np.eye(3), [1, 1, 1]), sd.NotARotation, "differs from the identity by 3 and det R = 8"),
    (lambda: frames.rotated_inertia(2 * np.eye(3), [1, 1, "I"]), sd.ArgumentError,
     "the text 'I'.*differs from the identity by 3"),
    (lambda: frames.point_inertia([1, 2], [[0, 0, 1]]), sd.ArgumentError, "masses: 2 entries, positions: 1 entries"),
    (lambda: frames.point_inertia(3, [[0, 0, 1]]), sd.ArgumentError, "masses: no list, positions: 1 entries"),
    (lambda: frames.point_inertia([1], [[0, 1]]), sd.ArgumentError, "position 1 has 2 components; pass 3"),
    (lambda: frames.center_of_mass([0, 0], [[0, 0, 1], [1, 0, 0]]), sd.ArgumentError, "the masses add up to 0"),
    (lambda: frames.moment_equation([1, 1, 1], [0, 0, float("nan")], [0, 0]), sd.ArgumentError,
     "omega.* is nan; .*alpha has 2 components"),
    (lambda: frames.planar_moment_equation(-2, 1), sd.ArgumentError, "inertia is -2 kg m.2; pass 0 or more"),
    (lambda: frames.planar_force_equation(1, [1, 2, 3]), sd.ArgumentError, "acceleration has 3 components; pass 2"),
    (lambda: frames.equivalent_force_system("F", [1, 2, 3]), sd.ArgumentError, "force is the text 'F'"),
    (lambda: sd.Frame("n").body(1, [1, 1, 1], [sd.coordinates("q"), 0, 0]), sd.ArgumentError,
     "mass, inertia or com depend on q; in the frame of a rigid body they are constant"),
    (lambda: sd.Frame("n").body(1, [1, 1, 1]).moment(sd.Frame("n").point("O")), sd.ArgumentError, "is not fixed to the body"),
    (lambda: sd.Frame("n").body(1, [1, 1, 1]).moment("O"), sd.ArgumentError, "about is 'O'; pass a point of frame 'n'"),
    (lambda: sd.Frame("n").body(1, [1, 1, 1]).force(sd.Frame("m")), sd.ArgumentError, "frames of different trees"),
])
def test_faults(call, error, message):
    with pytest.raises(error, match=message):
        call()


def test_moments_that_no_body_in_space_has_are_doubted():
    with pytest.warns(sd.ModelWarning, match="1, 1, 3 kg m.*the largest is more than the other two together") as caught:
        frames.inertia_about([1, 1, 3], 1, [0, 0, 0])
    assert caught[0].filename == __file__
