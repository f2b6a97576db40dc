"""Motion along the tree of frames against plain differentiation of R r, and against sympy.physics.vector."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from sympy.physics import vector as spv

import symdyn as sd
from symdyn.frames import numbers
from tests.frames.chains import at_time, jet, random_tree, times, transposed, turn
from tests.helpers import swept

NOW = 0.6


def _transform(frame, motion):
    """R and origin of a frame in the first one with their rates, multiplied out along its path."""
    R, origin = jet(sp.eye(3), {}, NOW), np.zeros((3, 3, 1))
    for f in frame.path[1:]:
        origin = origin + times(R, jet(f.shift, motion, NOW))
        R = times(R, jet(f.turn, motion, NOW))
    return R, origin


@pytest.mark.parametrize("seed", [0, *swept([1])])
def test_seen_from_any_frame_in_any_components(seed):
    frames, motion = random_tree(seed)
    rng = np.random.default_rng(seed)
    carrier, seen_from, components = (frames[k] for k in rng.integers(len(frames), size=3))
    P = carrier.point("P", [next(iter(motion)), sd.t, 2])
    R_P, o_P = _transform(carrier, motion)
    R_f, o_f = _transform(seen_from, motion)
    R_c, _ = _transform(components, motion)
    way = times(transposed(R_f), o_P + times(R_P, jet(P.given, motion, NOW)) - o_f)
    into = R_c[0].T @ R_f[0]
    for order, vector in enumerate((P.position(seen_from, components), P.velocity(seen_from, components),
                                    P.acceleration(seen_from, components))):
        np.testing.assert_allclose(numbers(vector, motion, NOW), into @ way[order].ravel(), rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("seed", [0, *swept([1])])
def test_angular_motion_is_that_of_the_rotation(seed):
    frames, motion = random_tree(seed + 10)
    rng = np.random.default_rng(seed)
    moving, seen_from, components = (frames[k] for k in rng.integers(len(frames), size=3))
    R_m, _ = _transform(moving, motion)
    R_f, _ = _transform(seen_from, motion)
    R_c, _ = _transform(components, motion)
    R = times(transposed(R_f), R_m)
    into = R_c[0].T @ R_f[0]
    for S, vector in ((R[1] @ R[0].T, moving.angular_velocity(seen_from, components)),
                      (R[2] @ R[0].T + R[1] @ R[1].T, moving.angular_acceleration(seen_from, components))):
        np.testing.assert_allclose(numbers(vector, motion, NOW), into @ [S[2, 1], S[0, 2], S[1, 0]], rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(numbers(moving.rotation(seen_from), motion, NOW), R[0], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("seed", [0, *swept([1])])
def test_parts_add_up_through_any_frame(seed):
    frames, motion = random_tree(seed + 20)
    rng = np.random.default_rng(seed)
    carrier, through, seen_from, components = (frames[k] for k in rng.integers(len(frames), size=4))
    P = carrier.point("P", [1, list(motion)[1], 3])
    parts = P.acceleration_parts(through, seen_from, components).at(motion, NOW)
    np.testing.assert_allclose(parts.total, numbers(P.acceleration(seen_from, components), motion, NOW),
                               rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(P.velocity_parts(through, seen_from, components).at(motion, NOW).total,
                               numbers(P.velocity(seen_from, components), motion, NOW), rtol=1e-11, atol=1e-11)
    forces = P.inertial_forces(2, through, components, seen_from)
    np.testing.assert_allclose(forces.at(motion, NOW).total, 2 * (parts.relative - parts.total),
                               rtol=1e-11, atol=1e-11)


def test_parts_against_the_theorems_of_sympy():
    phi, psi, x, y = spv.dynamicsymbols("phi psi x y")
    n = sd.Frame("n")
    b = n.frame("b", rotation=turn("Z", phi), origin=[x, y, x * y])
    c = b.frame("c", rotation=turn("X", psi), origin=[1, 0, psi])
    P = c.point("P", [y, 2, x])
    N = spv.ReferenceFrame("N")
    B = N.orientnew("B", "Axis", [phi, N.z])
    C = B.orientnew("C", "Axis", [psi, B.x])
    E, O, Q, S = (spv.Point(name) for name in "EOQS")
    E.set_vel(N, 0)
    O.set_pos(E, x * N.x + y * N.y + x * y * N.z)
    Q.set_pos(O, B.x + psi * B.z)
    S.set_pos(Q, y * C.x + 2 * C.y + x * C.z)
    O.set_vel(N, O.pos_from(E).dt(N))
    O.set_vel(B, 0)
    Q.set_vel(B, Q.pos_from(O).dt(B))
    Q.set_vel(C, 0)
    S.set_vel(C, S.pos_from(Q).dt(C))
    Q.v1pt_theory(O, N, B)
    S.v1pt_theory(Q, N, C)
    Q.a1pt_theory(O, N, B)
    S.a1pt_theory(Q, N, C)
    values = {phi: 0.4 + sd.t, psi: sd.t**2 - 0.3, x: sp.sin(sd.t), y: 1 / (1 + sd.t)}

    def known(v, frame):
        return at_time(v.to_matrix(frame).subs(values).doit(), NOW).ravel()

    assert np.allclose(numbers(P.velocity(n, b), values, NOW), known(S.vel(N), B), rtol=1e-12, atol=1e-12)
    parts = P.acceleration_parts(c, n, c).at(values, NOW)
    r, w, v = S.pos_from(Q), C.ang_vel_in(N), S.vel(C)
    for found, expected in ((parts.origin, Q.acc(N)), (parts.relative, v.dt(C)), (parts.coriolis, 2 * (w ^ v)),
                            (parts.euler, C.ang_acc_in(N) ^ r), (parts.centripetal, w ^ (w ^ r)), (parts.total, S.acc(N))):
        assert np.allclose(found, known(expected, C), rtol=1e-12, atol=1e-12)


def test_rates_of_euler_angles_in_body_axes():
    """ZXZ: omega = [a_dot sb sc + b_dot cc, a_dot sb cc - b_dot sc, a_dot cb + c_dot] as in every textbook."""
    a, b, c = sd.coordinates("a b c")
    n = sd.Frame("n")
    body = n.frame("b", rotation=turn("Z", a) * turn("X", b) * turn("Z", c))
    assert body.angular_velocity(n, body) == sp.Matrix([
        a.dot * sp.sin(b) * sp.sin(c) + b.dot * sp.cos(c), a.dot * sp.sin(b) * sp.cos(c) - b.dot * sp.sin(c),
        a.dot * sp.cos(b) + c.dot])
    assert body.angular_velocity() == sp.Matrix([
        b.dot * sp.cos(a) + c.dot * sp.sin(a) * sp.sin(b), b.dot * sp.sin(a) - c.dot * sp.sin(b) * sp.cos(a),
        a.dot + c.dot * sp.cos(b)])


def test_relative_motion_of_two_frames_is_opposite():
    frames, motion = random_tree(5)
    a, b, n = frames[1], frames[-1], frames[0]
    total = a.angular_velocity(b, n) + b.angular_velocity(a, n)
    assert np.allclose(numbers(total, motion, NOW), 0, atol=1e-12)
    # alpha of a in b, seen from b, and of b in a, seen from a, are opposite too.
    assert np.allclose(numbers(a.angular_acceleration(b, n) + b.angular_acceleration(a, n), motion, NOW), 0, atol=1e-12)
    assert np.allclose(numbers(a.rotation(b) * b.rotation(a), motion, NOW), np.eye(3), atol=1e-12)


def test_position_from_another_point():
    frames, motion = random_tree(6)
    P, Q = frames[1].point("P", [1, 2, 3]), frames[2].point("Q", [0, next(iter(motion)), 1])
    between = P.position(Q, frames[0])
    assert np.allclose(numbers(between, motion, NOW), numbers(P.position() - Q.position(), motion, NOW), atol=1e-12)
    assert np.allclose(numbers(P.position(Q), motion, NOW),
                       numbers(frames[0].rotation(Q.frame), motion, NOW) @ numbers(between, motion, NOW), atol=1e-12)


def test_origins_move_as_their_points():
    frames, _ = random_tree(7)
    b = frames[2]
    O = b.point("O")
    assert (b.position(), b.velocity(), b.acceleration()) == (O.position(), O.velocity(), O.acceleration())


def test_rate_of_a_vector_seen_from_its_own_frame_and_from_outside():
    q, f = sd.coordinates("q f")
    n = sd.Frame("n")
    b = n.frame("b", rotation=turn("Z", q))
    v = b.vector([f, 0, 0], "F")
    assert v.rate(b) == sp.Matrix([f.dot, 0, 0])
    assert v.rate(n, b) == sp.Matrix([f.dot, f * q.dot, 0])
    assert sd.rate(v.components(n)).applyfunc(sp.expand) == v.rate(n).applyfunc(sp.expand)


def test_euler_parameters_move_with_their_norm_kept():
    """Four coordinates of norm 1 that turn about z at the rate 2 w."""
    p = sd.coordinates("p0:4")
    R = sp.Matrix([[p[0]**2 + p[1]**2 - p[2]**2 - p[3]**2, 2 * (p[1] * p[2] - p[0] * p[3]), 2 * (p[1] * p[3] + p[0] * p[2])],
                   [2 * (p[1] * p[2] + p[0] * p[3]), p[0]**2 - p[1]**2 + p[2]**2 - p[3]**2, 2 * (p[2] * p[3] - p[0] * p[1])],
                   [2 * (p[1] * p[3] - p[0] * p[2]), 2 * (p[2] * p[3] + p[0] * p[1]), p[0]**2 - p[1]**2 - p[2]**2 + p[3]**2]])
    b = sd.Frame("n").frame("b", rotation=R)
    spin = {p[0]: sp.cos(3 * sd.t), p[1]: 0, p[2]: 0, p[3]: sp.sin(3 * sd.t)}
    assert np.allclose(numbers(b.angular_velocity(), spin, np.array([0.1, 0.2])), [0, 0, 6], atol=1e-13)
    assert np.allclose(numbers(b.angular_acceleration(), spin, np.array([0.1, 0.2])), 0, atol=1e-13)
    # Written short, and the same as R_dot R^T and R^T R_dot along any motion that keeps the norm.
    assert b.angular_velocity()[2] == sp.expand(2 * (p[0] * p[3].dot - p[3] * p[0].dot + p[1] * p[2].dot - p[2] * p[1].dot))
    angle, s = sd.t / 2 + sd.t**2, sp.sin(sd.t)
    motion = {p[0]: sp.cos(angle) * sp.cos(s), p[1]: sp.sin(angle) * sp.cos(s), p[2]: sp.cos(angle) * sp.sin(s),
              p[3]: sp.sin(angle) * sp.sin(s)}
    turning = sd.rate(R)
    for skew, components in ((turning * R.T, b.parent), (R.T * turning, b)):
        S = numbers(skew, motion, 0.4)
        assert np.allclose(numbers(b.angular_velocity(None, components), motion, 0.4), [S[2, 1], S[0, 2], S[1, 0]], atol=1e-13)


def test_euler_parameters_in_another_order_and_the_inverse_rotation():
    """The scalar last, and the rotation back: omega of one is minus that of the other."""
    w, x, y, z = sd.coordinates("w x y z")
    R = sp.Matrix([[1 - 2 * (y**2 + z**2), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                   [2 * (x * y + w * z), 1 - 2 * (x**2 + z**2), 2 * (y * z - w * x)],
                   [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x**2 + y**2)]])
    n = sd.Frame("n")
    swapped = n.frame("b", rotation=R.xreplace({w: z, x: w, y: x, z: y}))
    assert swapped.angular_velocity()[2] == sp.expand(2 * (z * y.dot - y * z.dot + w * x.dot - x * w.dot))
    there, back = n.frame("b", rotation=R), n.frame("c", rotation=R.T)
    assert (there.angular_velocity() + back.angular_velocity(n, back)).applyfunc(sp.expand) == sp.zeros(3, 1)
