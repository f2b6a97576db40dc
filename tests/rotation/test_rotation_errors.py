"""Every message says what was asked, what was found, in numbers, and what to do; nothing bad ends as NaN or in a traceback."""

from __future__ import annotations

import warnings
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd

rotation = sd.rotation
psi, theta, phi = sp.symbols("psi theta phi")
NEAR = np.pi / 2 - 3e-9


@pytest.mark.parametrize("call, kind, parts", [
    # Gimbal lock
    (lambda: rotation.euler_rates_inverse("ZYX", [0.1, NEAR, 0.3]), sd.GimbalLock,
     ["the ZYX angles", "theta = 1.57079632379 rad", "3e-09 rad from pi/2", "1e-08", "Euler parameters"]),
    (lambda: rotation.euler_rates_inverse("ZYX", [0.1, -NEAR, 0.3], "b"), sd.GimbalLock, ["theta = -1.57", "from -pi/2"]),
    (lambda: rotation.euler_rates_inverse("ZXZ", [0.1, 2 * np.pi, 0.3]), sd.GimbalLock,
     ["the ZXZ angles", "from 0, modulo 2 pi"]),
    (lambda: rotation.euler_rates_inverse("XZY", [[1, 0.2, 3], [0.1, -np.pi / 2, 0.3]]), sd.GimbalLock, ["psi = -1.57079632679"]),
    (lambda: rotation.euler_rates_inverse("ZYX", [psi, sp.pi / 2, phi]), sd.GimbalLock, ["theta = pi/2 rad is 0 rad from pi/2"]),
    (lambda: rotation.euler_rates_inverse("ZXZ", [psi, 3.1415926535, phi]), sd.GimbalLock, ["8.98e-11 rad from pi"]),
    (lambda: rotation.euler_rates_inverse("ZYX", [psi, theta - theta + sp.pi / 2 + 2 * sp.pi, phi]), sd.GimbalLock,
     ["from pi/2"]),
    # Not a rotation
    (lambda: rotation.to_euler(1.01 * np.eye(3), "ZYX"), sd.NotARotation,
     ["|R^T R - 1| is 0.0201 (allowed is 1e-09)", "det R = 1.030301", "symdyn.rotation.nearest(R)"]),
    (lambda: rotation.axis_angle(np.diag([1, 1, -1])), sd.NotARotation, ["|R^T R - 1| is 0 ", "det R = -1", "reflection"]),
    (lambda: rotation.to_parameters(5 * np.ones((3, 3))), sd.NotARotation,
     ["is 75 ", "det R = 0", "columns are the unit vectors"]),
    (lambda: rotation.to_euler(sp.diag(1, 1, 2), "ZYX"), sd.NotARotation, ["is 3 ", "det R = 2"]),
    (lambda: rotation.to_euler([np.eye(3), 2 * np.eye(3)], "ZYX"), sd.NotARotation, ["R[1] is not a rotation"]),
    (lambda: rotation.to_euler(1e200 * np.eye(3), "ZYX"), sd.NotARotation, ["R is not a rotation"]),
    (lambda: rotation.to_euler(1e200 * np.ones((3, 3)), "ZYX"), sd.NotARotation, ["R is not a rotation"]),
    (lambda: rotation.to_euler(np.eye(4), "ZYX"), sd.NotARotation, ["R: shape (4, 4); pass 3 rows of 3"]),
    (lambda: rotation.axis_angle(sp.Matrix([[psi, 0], [0, 1]])), sd.NotARotation, ["R: shape (2, 2); pass 3 rows of 3"]),
    (lambda: rotation.axis_angle([[1, 0, 0], [0, 1, 0], [0, 1]]), sd.NotARotation, ["R: rows of different lengths"]),
    (lambda: rotation.axis_angle([[1, 0, 0], [0, 1, 0], [0, psi]]), sd.NotARotation, ["R: shape (3,)"]),
    (lambda: rotation.nearest(-np.eye(3)), sd.NotARotation, ["det R = -1", "reflection"]),
    (lambda: rotation.nearest(np.zeros((3, 3))), sd.NotARotation, ["det R = 0"]),
    (lambda: rotation.nearest(rotation.about("Z", psi)), sd.NotARotation, ["R has symbols", "insert numbers"]),
    (lambda: rotation.to_euler(sp.Matrix([[0, 0, psi], [0, 1, theta], [phi, 0, 0]]), "ZYX"), sd.NotARotation,
     ["column 1", "R[3, 1] = phi", "must be 1 or -1"]),
    # Zero axis
    (lambda: rotation.about([0, 0, 0], 1), sd.ZeroAxis, ["the axis (0, 0, 0) has length 0", "pass a vector"]),
    (lambda: rotation.about([0, 0, 0], phi), sd.ZeroAxis, ["the axis (0, 0, 0) has length 0", "pass a vector"]),
    (lambda: rotation.about([psi - psi, 0, sp.cos(phi)**2 + sp.sin(phi)**2 - 1], phi), sd.ZeroAxis, ["has length 0"]),
    (lambda: rotation.parameters_of_axis_angle([[1, 0, 0], [0, 0, 0]], 1), sd.ZeroAxis, ["has length 0"]),
    # Not normalized
    (lambda: rotation.from_parameters([1, 1, 0, 0]), sd.NotNormalized,
     ["(1.0, 1.0, 0.0, 0.0)", "norm 1.41421356237", "not 1 to 1e-09", "symdyn.rotation.normalized(p)"]),
    (lambda: rotation.from_parameters(sp.Matrix([1, 1, 0, 0])), sd.NotNormalized, ["norm 1.41421356237", "normalized(p)"]),
    (lambda: rotation.compose([1, 0, 0, 0], [1e200, 1e200, 0, 0]), sd.NotNormalized, ["norm inf"]),
    (lambda: rotation.inverse([1 + 2e-9, 0, 0, 0]), sd.NotNormalized, ["norm 1.000000002"]),
    (lambda: rotation.axis_angle_of_parameters([0, 0, 0, 0]), sd.NotNormalized, ["norm 0"]),
    (lambda: rotation.omega_from_parameters([[1, 0, 0, 0], [1, 2, 0, 0]], [0, 1, 0, 0]), sd.NotNormalized,
     ["(1.0, 2.0, 0.0, 0.0)"]),
    (lambda: rotation.parameters_rate([2, 0, 0, 0], [0, 1, 0]), sd.NotNormalized, ["norm 2"]),
    (lambda: rotation.normalized([0, 0, 0, 0]), sd.NotNormalized, ["(0, 0, 0, 0)", "pass four numbers that are not all zero"]),
    (lambda: rotation.normalized(sp.zeros(4, 1)), sd.NotNormalized, ["(0, 0, 0, 0)"]),
    (lambda: rotation.about([1, 2, 3], 1, unit=True), sd.NotNormalized, ["length 3.74165738677", "leave out unit=True"]),
    # Members of a family
    (lambda: rotation.to_euler(np.eye(3), "ZYX").at(first=1), sd.RotationError,
     ["not at gimbal lock", "1.57 rad away", "take .angles or .other"]),
    (lambda: rotation.to_euler(rotation.from_euler("ZYX", [psi, theta, phi]), "ZYX").at(first=1), sd.RotationError,
     ["no angle is free"]),
    (lambda: rotation.to_euler(np.array([np.eye(3)] * 2), "ZYX").at(first=1), sd.RotationError, ["2 of 2 rotations are not"]),
    (lambda: rotation.to_euler(np.eye(3), "ZXZ").at(), sd.RotationError, ["either first= or third="]),
    (lambda: rotation.to_euler(np.eye(3), "ZXZ").at(first=1, third=2), sd.RotationError, ["either first= or third="]),
    (lambda: rotation.to_euler(np.eye(3), "ZXZ").at(first="1"), sd.ArgumentError, ["the first angle: the text '1'"]),
    # Arguments
    (lambda: rotation.to_euler(np.eye(3), "XXX"), sd.ArgumentError, ["no Euler sequence 'XXX'", ", ".join(rotation.SEQUENCES)]),
    (lambda: rotation.from_euler("zyx", [1, 2, 3]), sd.ArgumentError, ["'zyx'", "letters are capitals"]),
    (lambda: rotation.gimbal_lock(313), sd.ArgumentError, ["no Euler sequence 313"]),
    (lambda: rotation.euler_rates("ZYX", [1, 2, 3], frame="e"), sd.ArgumentError, ["no components in 'e'", "'n'", "'b'"]),
    (lambda: rotation.about("Q", 1), sd.ArgumentError, ["no axis 'Q'", "'X', 'Y', 'Z'"]),
    (lambda: rotation.about(3, 1), sd.ArgumentError, ["no axis 3", "0, 1, 2"]),
    (lambda: rotation.about(0.5, 1), sd.ArgumentError, ["the axis: shape (); pass 3 components"]),
    (lambda: rotation.about(["a", 0, 0], 1), sd.ArgumentError, ["the axis: the text 'a'", "never evaluated"]),
    (lambda: rotation.about([1, 0, 0], "phi"), sd.ArgumentError, ["the angle: the text 'phi'", "never evaluated"]),
    (lambda: rotation.about("Z", None), sd.ArgumentError, ["the angle: None of type NoneType"]),
    (lambda: rotation.about("Z", True), sd.ArgumentError, ["the angle: True of type bool"]),
    (lambda: rotation.about("Z", 10**400), sd.ArgumentError, ["the angle: a number that no float can hold"]),
    (lambda: rotation.about("Z", [sp.Symbol("a"), 1]), sd.ArgumentError, ["the angle: shape (2,); pass one number"]),
    (lambda: rotation.from_euler("ZYX", [1, np.nan, 2]), sd.ArgumentError,
     ["the Euler angles: the value nan at [1]; pass finite"]),
    (lambda: rotation.from_euler("ZYX", [1, 2, np.inf]), sd.ArgumentError, ["the value inf at [2]"]),
    (lambda: rotation.from_euler("ZYX", [1, 2, sp.oo]), sd.ArgumentError, ["the value oo; pass finite"]),
    (lambda: rotation.from_euler("ZYX", [1, sp.nan, 2]), sd.ArgumentError, ["the value nan; pass finite"]),
    (lambda: rotation.from_euler("ZYX", [psi, "1", 2]), sd.ArgumentError, ["the Euler angles: the text '1'"]),
    (lambda: rotation.from_euler("ZYX", [psi, 1, None]), sd.ArgumentError, ["None of type NoneType"]),
    (lambda: rotation.from_euler("ZYX", [psi, 1, sp.true]), sd.ArgumentError, ["of type BooleanTrue"]),
    (lambda: rotation.from_euler("ZYX", [1, 2j, 3]), sd.ArgumentError, ["2j of type complex; pass real"]),
    (lambda: rotation.from_euler("ZYX", [psi, sp.I, 3]), sd.ArgumentError, ["the complex value I"]),
    (lambda: rotation.from_euler("ZYX", [1, 2]), sd.ArgumentError, ["shape (2,); pass 3 components"]),
    (lambda: rotation.from_euler("ZYX", [psi, 2]), sd.ArgumentError, ["shape (2,); pass 3 components"]),
    (lambda: rotation.from_euler("ZYX", [1, [2, 3], 4]), sd.ArgumentError, ["rows of different lengths"]),
    (lambda: rotation.from_euler("ZYX", "abc"), sd.ArgumentError, ["the Euler angles: the text 'abc'"]),
    (lambda: rotation.from_euler("ZYX", [1, Decimal("sNaN"), 4]), sd.ArgumentError, ["a number that no float can hold"]),
    (lambda: rotation.to_euler(np.full((3, 3), np.inf), "ZYX"), sd.ArgumentError, ["R: the value inf at [0, 0]"]),
    (lambda: rotation.E([1, 2, 3]), sd.ArgumentError, ["p: shape (3,); pass 4 components"]),
    (lambda: rotation.parameters_rate([1, 0, 0, 0], [np.nan, 0, 0]), sd.ArgumentError, ["omega: the value nan"]),
    (lambda: rotation.omega_from_parameters([1, 0, 0, 0], [0, 0, 0]), sd.ArgumentError, ["p_dot: shape (3,)"]),
    (lambda: rotation.skew([1, 2]), sd.ArgumentError, ["the vector: shape (2,)"]),
    (lambda: rotation.vee(np.eye(3)), sd.ArgumentError, ["not skew-symmetric", "|S + S^T| is 2", "(S - S^T) / 2"]),
    (lambda: rotation.vee(sp.eye(3)), sd.ArgumentError, ["not skew-symmetric"]),
    (lambda: rotation.infinitesimal([np.nan, 0, 0]), sd.ArgumentError, ["the small rotation: the value nan"]),
    (lambda: rotation.angular_velocity(np.eye(3)), sd.ArgumentError, ["does not show how it changes", "R_dot="]),
    (lambda: rotation.angular_velocity(np.eye(3), R_dot=np.eye(3)), sd.ArgumentError,
     ["not skew-symmetric", "is 2 ", "check R_dot"]),
    (lambda: rotation.angular_velocity(rotation.about("Z", sd.coordinates("q").ddot)), sd.ArgumentError, ["depends on q_ddot"]),
    (lambda: rotation.angular_velocity(rotation.about("Z", sd.inputs("u"))), sd.ArgumentError, ["depends on u"]),
])
def test_messages(call: Any, kind: type[Exception], parts: list[str]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(kind) as caught:
            call()
    assert type(caught.value) is kind
    for part in parts:
        assert part in str(caught.value)


def test_what_is_near_a_border_but_within_it_passes() -> None:
    assert np.isfinite(rotation.euler_rates_inverse("ZYX", [0.1, np.pi / 2 - 1.1e-8, 0.3])).all()
    assert rotation.from_parameters([1 + 5e-10, 0, 0, 0]) == pytest.approx(np.eye(3), abs=0)
    assert not rotation.to_euler(np.eye(3) * (1 + 4e-10), "ZYX").locked
    assert rotation.about([0, 3e-320, 0], 0.2) == pytest.approx(rotation.about("Y", 0.2), abs=1e-15)
    assert rotation.about([0, 1e300, 0], 0.2) == pytest.approx(rotation.about("Y", 0.2), abs=1e-15)
    assert rotation.about([0, 1e-30, 0], phi).shape == (3, 3)
    exact = rotation.about([Fraction(1, 2), Decimal("0"), 0], Fraction(1, 3))
    assert exact == pytest.approx(rotation.about("X", 1 / 3), abs=1e-15)
    assert rotation.skew(np.array([[1.0], [2.0], [3.0]])).shape == (3, 3)


def test_the_four_kinds_are_errors_of_rotation_and_of_symdyn() -> None:
    for kind in (sd.GimbalLock, sd.NotARotation, sd.ZeroAxis, sd.NotNormalized):
        assert issubclass(kind, sd.RotationError) and issubclass(kind, sd.SymdynError) and issubclass(kind, ValueError)
