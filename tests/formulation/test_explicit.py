"""Level 1, by hand from a position map: the lecture's first results (chapters 3.2 to 3.4 and 5.2)."""

import numpy as np
import pytest
import sympy as sp

import symdyn as sd

q1, q2, q3 = sd.coordinates("q1 q2 q3")
m, m1, m2, m3, g, theta, x0, y0, I_t = sd.parameters("m m1 m2 m3 g theta x0 y0 I_t")


def equal(found: sp.Matrix, wanted: list) -> bool:
    return (found - sp.Matrix(wanted).reshape(*found.shape)).applyfunc(sp.simplify) == sp.zeros(*found.shape)


@pytest.fixture(scope="module")
def straight_track():
    return sd.embedding([q1], [x0 + q1 * sp.cos(theta), y0 - q1 * sp.sin(theta)], [m, m], [0, -m * g])


@pytest.fixture(scope="module")
def rotating_track():
    return sd.embedding([q1, q2], [q1 * sp.cos(q2), -q1 * sp.sin(q2)], sp.diag(m, m), sp.Matrix([0, -m * g]))


def test_straight_track(straight_track):
    eq = straight_track
    assert sp.Matrix([sp.cos(theta), -sp.sin(theta)]) == eq.J
    assert eq.M_tilde == sp.Matrix([m]) and eq.k_tilde == sp.Matrix([0])
    assert equal(eq.explicit("accelerations"), [g * sp.sin(theta)])


def test_reaction_of_the_straight_track(straight_track):
    assert straight_track.F_c == m * g * sp.cos(theta) * sp.Matrix([sp.sin(theta), sp.cos(theta)])


def test_rotating_track(rotating_track):
    eq = rotating_track
    assert eq.M_tilde == sp.diag(m, m * q1**2)
    assert equal(eq.k_tilde, [-m * q1 * q2.dot**2, 2 * m * q1 * q1.dot * q2.dot])
    assert equal(eq.F_tilde, [m * g * sp.sin(q2), m * g * q1 * sp.cos(q2)])
    assert equal(eq.Jdot, [-sp.sin(q2) * q2.dot, -q1.dot * sp.sin(q2) - q1 * sp.cos(q2) * q2.dot,
                           -sp.cos(q2) * q2.dot, -q1.dot * sp.cos(q2) + q1 * sp.sin(q2) * q2.dot])
    assert equal(eq.Jd_qd, list(eq.Jdot * sp.Matrix([q1.dot, q2.dot])))


def test_vehicle_and_track_with_inertia():
    r = [q1 * sp.cos(q2), q1 * sp.sin(q2), 0, 0, q2]
    eq = sd.embedding([q1, q2], r, [m1, m1, m2, m2, I_t], [0, -m1 * g, 0, -m2 * g, 0])
    assert eq.J.shape == (5, 2)
    assert eq.M_tilde == sp.diag(m1, I_t + m1 * q1**2)
    assert equal(eq.k_tilde, [-m1 * q1 * q2.dot**2, 2 * m1 * q1 * q1.dot * q2.dot])


def test_pendulum():
    length = sp.Symbol("l")
    eq = sd.embedding([q1], [length * sp.sin(q1), -length * sp.cos(q1)], [m, m], [0, -m * g])
    assert equal(eq.M_tilde, [m * length**2]) and equal(eq.F_tilde, [-m * g * length * sp.sin(q1)])


def test_prismatic_joints():
    eq = sd.embedding([q1, q2], [q1, q1 + q2], [m1, m2])
    assert eq.M_tilde == sp.Matrix([[m1 + m2, m2], [m2, m2]])
    eq = sd.embedding([q1, q2, q3], [q1, q1 + q2, q1 + q2 + q3], [m1, m2, m3])
    assert eq.M_tilde == sp.Matrix([[m1 + m2 + m3, m2 + m3, m3], [m2 + m3, m2 + m3, m3], [m3, m3, m3]])
    assert sp.Matrix([[1, 0, 0], [1, 1, 0], [1, 1, 1]]) == eq.J


def test_given_motion_of_the_track():
    """A track that turns at a given rate: centrifugal term m q1 w^2, no equation for the angle."""
    w = sp.Symbol("w")
    eq = sd.embedding([q1], [q1 * sp.cos(w * sd.t), q1 * sp.sin(w * sd.t)], [m, m])
    assert equal(eq.k_tilde, [-m * q1 * w**2])
    assert eq.M_tilde == sp.Matrix([m])


def test_equals_the_system_of_bodies_and_joints():
    system = sd.systems.get("vehicle_on_rotating_track", track_inertia=False)
    eq = system.embedding()
    by_hand = sd.embedding([q1, q2], [q1 * sp.cos(q2), -q1 * sp.sin(q2)], [m, m], [0, -m * g])
    rename = {p: m if "m" in p.name else p for p in eq.symbols.parameters}
    for name in ("M_tilde", "k_tilde", "F_tilde"):
        difference = eq.explicit(name).xreplace(rename) - by_hand.explicit(name)
        assert difference.applyfunc(sp.simplify).is_zero_matrix


def test_compiles_and_runs(rotating_track):
    module = rotating_track.compile(backend="numpy")
    found = module.rhs(0.0, [0.5, 0.2, 0.3, 0.4], {"m": 2.0, "g": 9.81})
    wanted = [0.3, 0.4, 0.5 * 0.16 + 9.81 * np.sin(0.2), (9.81 * np.cos(0.2) - 2 * 0.3 * 0.4) / 0.5]
    assert np.allclose(found, wanted, rtol=1e-14)
    assert rotating_track.verify().passed


@pytest.mark.parametrize(("arguments", "parts"), [
    (([q1], [q1, q1], [m], None), ["mass has the shape 1 x 1", "position has 2"]),
    (([q1], [q1], [m], [0, 1]), ["force has 2 entries, position 1"]),
    (([q1, q2], [q1], [m], None), ["position does not depend on q2"]),
    (([q1], [q1 + q2], [m], None), ["position uses q2", "not among the coordinates q1"]),
    (([q1], [q1.dot], [m], None), ["position uses q1_dot"]),
    (([q1], [q1], [m * q1], None), ["mass depends on q1"]),
    (([q1], ["q1"], [m], None), ["text is never evaluated"]),
    (([q1], [q1], sp.Matrix([[1, 2], [3, 4]]), None), ["mass has the shape 2 x 2"]),
    (([q1, q2], [q1, q2], sp.Matrix([[1, 2], [3, 4]]), None), ["mass is not symmetric"]),
    (([q1, q2], [q1, q2], sp.Matrix([[1, 2], [2, 1]]), None), ["mass has the eigenvalue -1; pass a matrix"]),
    (([q1], 3, [m], None), ["position is 3"]),
    (([q1], [q1], [m], [q1.ddot]), ["force uses q1_ddot"]),
])
def test_faults(arguments, parts):
    with pytest.raises(sd.ModelError) as caught:
        sd.embedding(*arguments)
    for part in parts:
        assert part in str(caught.value)


def test_all_faults_at_once():
    with pytest.raises(sd.ModelError) as caught:
        sd.embedding([q1], [q1 + q2, "x"], [m], [0, 0, 0])
    assert len(caught.value.faults) >= 4
