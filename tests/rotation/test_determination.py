"""Euler angles, axis and angle, Euler parameters from R: both solutions, the family at lock, what is arbitrary."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.rotation.determination import to_euler
from symdyn.rotation.euler import from_euler
from tests.rotation.orientations import difference, uniform

rotation = sd.rotation
PI = np.pi


@pytest.mark.parametrize("sequence", rotation.SEQUENCES)
def test_g_is_singular_where_a_sequence_locks_and_nowhere_between(sequence: str) -> None:
    a, b, c = sp.symbols("a b c")
    det = sp.lambdify(b, rotation.euler_rates(sequence, [a, b, c]).subs({a: 0.3, c: 0.8}).det())
    first, second = (float(angle) for angle in rotation.gimbal_lock(sequence).second)
    assert abs(det(first)) < 1e-15 and abs(det(second)) < 1e-15
    for angle in (*np.linspace(first + 0.01, second - 0.01, 7), *np.linspace(second + 0.01, first + 2 * PI - 0.01, 7)):
        assert abs(det(angle)) > 0.009


@pytest.mark.parametrize("sequence", rotation.SEQUENCES)
def test_the_sentence_at_lock_is_true(sequence: str) -> None:
    lock = rotation.gimbal_lock(sequence)
    for second, fixed in zip(lock.second, lock.fixed, strict=True):
        sign = 1 if "+" in fixed else -1
        R = rotation.from_euler(sequence, [0.7, float(second), 0.4])
        assert difference(R, rotation.from_euler(sequence, [0.7 + 0.9, float(second), 0.4 - sign * 0.9])) < 1e-15
        assert difference(R, rotation.from_euler(sequence, [0.7 + 0.9, float(second), 0.4 + sign * 0.9])) > 0.5
        found = rotation.to_euler(R, sequence)
        assert found.locked is True and found.sign == sign
        assert found.value == pytest.approx(0.7 + sign * 0.4, abs=1e-15)
        assert found.fixed == f"{fixed} = {0.7 + sign * 0.4:.6g}; each alone is free"
        assert found.angles[0] == 0 and fixed in str(found) and found.distance < 1e-15


def test_where_the_usual_sequences_lock() -> None:
    assert rotation.gimbal_lock("ZYX") == ("ZYX", (-sp.pi / 2, sp.pi / 2), ("psi + phi", "psi - phi"))
    assert rotation.gimbal_lock("ZXZ") == ("ZXZ", (0, sp.pi), ("phi + psi", "phi - psi"))
    assert str(rotation.gimbal_lock("XYZ")) == ("XYZ locks at theta = -pi/2, where only phi - psi is fixed and at "
                                                "theta = pi/2, where only phi + psi is fixed")


def test_a_cyclic_permutation_of_the_axes_is_xyz_at_lock() -> None:
    # theta = 90 degrees, and of phi and psi only the sum, 90 degrees, is determined.
    for R in ([[0, 0, 1], [1, 0, 0], [0, 1, 0]], sp.Matrix([[0, 0, 1], [1, 0, 0], [0, 1, 0]])):
        found = rotation.to_euler(R, "XYZ")
        assert found.locked and float(found.angles[1]) == PI / 2 and float(found.value) == PI / 2 and found.sign == 1
        for free in (0.0, 0.3, -2.0):
            assert difference(np.array(rotation.from_euler("XYZ", found.at(first=free)), dtype=float),
                              np.array(R, dtype=float)) < 1e-15
            assert float(found.at(third=free)[0]) == pytest.approx(PI / 2 - free, abs=1e-15)
    assert found.fixed == "phi + psi = pi/2; each alone is free"
    phi = sp.Symbol("phi")
    assert found.at(first=phi) == sp.Matrix([phi, sp.pi / 2, sp.pi / 2 - phi])


def test_lock_ends_where_the_matrix_distinguishes_the_angles() -> None:
    near = rotation.to_euler(rotation.from_euler("ZYX", [0.3, PI / 2 - 1e-10, 0.2]), "ZYX")
    assert not near.locked and near.distance == pytest.approx(1e-10, rel=1e-5) and near.value is None and near.sign is None
    assert near.angles == pytest.approx([0.3, PI / 2, 0.2], abs=1e-5)
    assert near.fixed == "psi, theta, phi are determined, but for the other solution; gimbal lock is 1e-10 rad away"
    rounded = np.round(rotation.from_euler("ZYX", [0.3, PI / 2, 0.2]) + 3e-11 * np.eye(3), 10)
    found = rotation.to_euler(rounded, "ZYX")
    assert found.locked and difference(rotation.from_euler("ZYX", found.at(first=1.0)), rounded) < 2e-10


def test_the_angles_have_their_ranges_and_no_negative_zero_or_minus_pi() -> None:
    for sequence in rotation.SEQUENCES:
        proper = sequence[0] == sequence[2]
        found = rotation.to_euler(uniform(1, 1000), sequence)
        assert found.angles[:, 1].min() >= (0 if proper else -PI / 2) and found.angles[:, 1].max() <= (PI if proper else PI / 2)
    for R in (np.eye(3), -0.0 + np.diag([1.0, -1, -1]), np.diag([-1.0, -1, 1]), np.diag([-1.0, 1, -1]) * 1.0):
        for sequence in rotation.SEQUENCES:
            found = rotation.to_euler(R, sequence)
            for angles in (found.angles, found.other):
                assert angles.min() > -PI and difference(rotation.from_euler(sequence, angles), R) < 1e-15


def test_symbolic_angles_come_back() -> None:
    angles = sp.symbols("psi theta phi", real=True)
    for sequence in rotation.SEQUENCES:
        proper = sequence[0] == sequence[2]
        R = rotation.from_euler(sequence, angles)
        found = rotation.to_euler(R, sequence)
        assert not found.locked and found.distance is None and found.angles.has(sp.atan2)
        rng = np.random.default_rng(3)
        value = sp.lambdify(angles, sp.Matrix.hstack(found.angles, found.other))
        for _ in range(5):
            point = rng.uniform(-1.5, 1.5, 3) + [0, PI / 2 if proper else 0, 0]
            assert value(*point)[:, 0] == pytest.approx(point, abs=1e-14)
            point = rng.uniform(-3, 3, 3)
            for k in (0, 1):
                again = rotation.from_euler(sequence, value(*point)[:, k])
                assert difference(again, rotation.from_euler(sequence, point)) < 4e-15


def test_symbolic_rotations_that_are_always_locked() -> None:
    psi, phi = sp.symbols("psi phi", real=True)
    for sequence in rotation.SEQUENCES:
        for k, second in enumerate(rotation.gimbal_lock(sequence).second):
            found = rotation.to_euler(rotation.from_euler(sequence, [psi, second, phi]), sequence)
            assert found.locked and found.angles[1] == second
            assert found.fixed.startswith(rotation.gimbal_lock(sequence).fixed[k])
            point = {psi: 0.7, phi: 0.4}
            assert float(found.value.subs(point)) == pytest.approx(0.7 + found.sign * 0.4, abs=1e-15)
            for angles in (found.angles, found.other, found.at(first=psi / 3), found.at(third=psi / 3)):
                back = np.array(rotation.from_euler(sequence, angles).subs(point).evalf(), dtype=float)
                assert difference(back, rotation.from_euler(sequence, [0.7, float(second), 0.4])) < 1e-14


def test_exact_numbers_give_exact_angles() -> None:
    R = rotation.from_euler("ZYX", [sp.pi / 3, sp.pi / 6, sp.pi / 4])
    found = rotation.to_euler(R, "ZYX")
    assert list(found.angles) == [sp.pi / 3, sp.pi / 6, sp.pi / 4]
    assert list(found.other) == [-2 * sp.pi / 3, 5 * sp.pi / 6, -3 * sp.pi / 4]
    assert found.distance == pytest.approx(PI / 3)
    assert rotation.axis_angle(rotation.about([1, 1, 1], 2 * sp.pi / 3)) == (sp.ones(3, 1) / sp.sqrt(3), 2 * sp.pi / 3)
    for p in ([1, 0, 0, 0], [0, 0, 1, 0], [0, sp.Rational(3, 5), 0, sp.Rational(-4, 5)], [sp.Rational(1, 2)] * 4):
        assert list(rotation.to_parameters(rotation.from_parameters(sp.Matrix(p)))) == p


def test_sympy_floats_are_computed_as_numbers() -> None:
    for angles in ([0.1, 0.2, 0.3], [0.1, PI / 2, 0.3], [0.1, PI / 2 - 1e-9, 0.3]):
        R = rotation.from_euler("ZYX", angles)
        S = sp.Matrix(R.tolist())
        numbers, expressions = rotation.to_euler(R, "ZYX"), rotation.to_euler(S, "ZYX")
        assert isinstance(expressions.angles, sp.Matrix) and list(expressions.angles) == list(numbers.angles)
        assert expressions.locked == numbers.locked and expressions.fixed == numbers.fixed
        assert list(rotation.to_parameters(S)) == list(rotation.to_parameters(R))
        axis, angle = rotation.axis_angle(S)
        assert list(axis) == list(rotation.axis_angle(R).axis) and angle == rotation.axis_angle(R).angle


def test_axis_and_angle_at_zero_and_pi_say_what_is_arbitrary() -> None:
    for one in (np.eye(3), sp.eye(3)):
        found = rotation.axis_angle(one)
        assert list(found.axis) == [1, 0, 0] and found.angle == 0
        assert found.note == "the angle is 0: there is no rotation, and the axis is arbitrary"
    for angle in (PI, sp.pi):
        found = rotation.axis_angle(rotation.about([0, 3, 4], angle))
        assert abs(np.array(found.axis, dtype=float).ravel()) == pytest.approx([0, 0.6, 0.8], abs=1e-15)
        assert found.angle == angle and found.note == "the angle is pi: the sign of the axis is arbitrary"
        assert found.note in str(found)
    assert "is determined" in rotation.axis_angle(rotation.about("Z", PI - 1e-9)).note
    many = rotation.axis_angle(rotation.about("Z", np.array([0.0, 1.0, PI, 0.0])))
    assert "(of 2 of 4 rotations)" in many.note and "(of 1 of 4 rotations)" in many.note
    assert rotation.axis_angle_of_parameters([1.0, 0, 0, 0]).note.startswith("the angle is 0")
    assert rotation.axis_angle_of_parameters(sp.Matrix([0, 0, -1, 0])) == (sp.Matrix([0, -1, 0]), sp.pi)


def test_symbolic_axis_angle_and_parameters() -> None:
    theta = sp.Symbol("theta", positive=True)
    a = sp.Matrix([1, 2, 2]) / 3
    R = rotation.about(a, theta)
    axis, angle = rotation.axis_angle(R)
    p = rotation.to_parameters(R)
    theirs = rotation.parameters_of_axis_angle(a, theta)
    for value in (0.1, 1.0, 3.0):
        assert np.array(axis.subs(theta, value).evalf(), dtype=float).ravel() == pytest.approx([1 / 3, 2 / 3, 2 / 3], abs=1e-13)
        assert float(angle.subs(theta, value)) == pytest.approx(value, abs=1e-13)
        assert np.array((p - theirs).subs(theta, value).evalf(), dtype=float) == pytest.approx(np.zeros((4, 1)), abs=1e-13)
    # A half turn, whatever the axis
    half = rotation.about([sp.cos(theta), sp.sin(theta), 0], sp.pi, unit=True)
    axis, angle = rotation.axis_angle(half)
    assert angle == sp.pi
    assert abs(np.array(axis.subs(theta, 0.4).evalf(), dtype=float).ravel()) == pytest.approx([np.cos(0.4), np.sin(0.4), 0])


def test_axis_angle_of_symbolic_parameters() -> None:
    phi = sp.Symbol("phi", positive=True)
    p = rotation.parameters_of_axis_angle("Y", phi)
    axis, angle = rotation.axis_angle_of_parameters(p)
    assert [float(x) for x in axis.subs(phi, 1.2)] == [0, 1, 0] and float(angle.subs(phi, 1.2)) == pytest.approx(1.2, abs=1e-15)


def test_the_nearest_rotation() -> None:
    R = uniform(5, 100)
    noise = 1e-6 * np.random.default_rng(5).normal(size=R.shape)
    near = rotation.nearest(R + noise)
    assert difference(np.swapaxes(near, 1, 2) @ near, np.eye(3)) < 4e-15 and difference(near, R) < 1e-5
    # The polar decomposition: R^T times the nearest is symmetric
    S = np.swapaxes(near, 1, 2) @ (R + noise)
    assert difference(S, np.swapaxes(S, 1, 2)) < 2e-14
    assert difference(np.array(rotation.nearest(sp.Matrix((R + noise)[0].tolist())), dtype=float), near[0]) == 0


def test_numbers_in_arrays_out_and_expressions_in_matrices_out() -> None:
    numbers = [rotation.about("Z", 1), rotation.from_euler("ZYX", (1, 2, 3)), rotation.skew([1, 2, 3]), rotation.E([1, 0, 0, 0]),
               rotation.to_parameters(np.eye(3)), rotation.euler_rates("ZYX", [1, 1, 1]), rotation.inverse([1, 0, 0, 0])]
    assert all(isinstance(value, np.ndarray) and value.dtype == float for value in numbers)
    one = sp.S.One
    expressions = [rotation.about("Z", one), rotation.from_euler("ZYX", (one, 2, 3)), rotation.skew(sp.Matrix([1, 2, 3])),
                   rotation.E(sp.Matrix([1, 0, 0, 0])), rotation.to_parameters(sp.eye(3)), rotation.inverse([one, 0, 0, 0]),
                   rotation.euler_rates("ZYX", np.array([one, 1, 1], dtype=object)), rotation.vee(sp.ImmutableMatrix.zeros(3)),
                   rotation.parameters_rate([1, 0, 0, 0], [sp.Symbol("x"), 0, 0]), rotation.vee(sp.MatrixSymbol("S", 3, 3))]
    assert all(isinstance(value, sp.Matrix) for value in expressions)


# -- both solutions as a sequence


def test_solutions_are_indexed_counted_and_unpacked():
    found = to_euler(from_euler("ZYX", [0.3, -0.4, 0.9]), "ZYX")
    first, second = found
    assert isinstance(found, Sequence) and len(found) == 2
    assert found[0] is found.angles is first and found[1] is found[-1] is found.other is second
    assert [len(solution) for solution in found] == [3, 3] and found[:1] == (found.angles,)
    with pytest.raises(IndexError):
        found[2]


def test_solutions_of_symbols_and_of_many_rotations_are_sequences_too():
    q = sp.Symbol("q", real=True)
    R = sp.Matrix([[sp.cos(q), -sp.sin(q), 0], [sp.sin(q), sp.cos(q), 0], [0, 0, 1]])
    assert len(to_euler(R, "ZYX")) == 2 and to_euler(R, "ZYX")[1].shape == (3, 1)
    many = to_euler(np.stack([np.eye(3)] * 4), "ZYX")
    assert len(many) == 2 and many[0].shape == (4, 3)
