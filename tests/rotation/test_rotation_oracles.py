"""Against SciPy's rotations, the orientation of joints, matrix exponentials, and published values."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

import symdyn as sd
from symdyn.model.joints.euler_angles import angles_rates
from symdyn.model.joints.rotation import parameters_rates, parameters_rotation
from symdyn.spatial.sixvectors import skew
from tests.rotation.orientations import difference, uniform

rotation = sd.rotation
RNG = np.random.default_rng(20)
ANGLES = RNG.uniform(-3, 3, (200, 3))


@pytest.mark.parametrize("sequence", rotation.SEQUENCES)
def test_euler_angles_against_scipy(sequence: str) -> None:
    theirs = Rotation.from_euler(sequence, ANGLES)
    assert difference(rotation.from_euler(sequence, ANGLES), theirs.as_matrix()) < 2e-15
    R = uniform(21, 500)
    assert abs(rotation.to_euler(R, sequence).angles - Rotation.from_matrix(R).as_euler(sequence)).max() < 1e-12


def test_euler_parameters_against_scipy() -> None:
    R = uniform(22, 500)
    theirs = Rotation.from_matrix(R).as_quat(canonical=True)[:, [3, 0, 1, 2]]
    assert difference(rotation.to_parameters(R), theirs) < 1e-15
    assert difference(rotation.from_parameters(theirs), R) < 2e-15
    both = rotation.compose(theirs[:250], theirs[250:])
    assert difference(rotation.from_parameters(both), R[:250] @ R[250:]) < 4e-15
    assert difference(rotation.from_parameters(rotation.inverse(theirs)), np.swapaxes(R, 1, 2)) < 2e-15


def test_axis_angle_against_scipy_and_the_matrix_exponential() -> None:
    R = uniform(23, 500)
    axis, angle = rotation.axis_angle(R)
    assert difference(axis * angle[:, None], Rotation.from_matrix(R).as_rotvec()) < 1e-13
    for vector in RNG.normal(size=(20, 3)):
        length = float(np.linalg.norm(vector))
        assert difference(rotation.about(vector, length), expm(rotation.skew(vector))) < 2e-15


@pytest.mark.parametrize("sequence", rotation.SEQUENCES)
def test_rates_against_differences_and_the_joints(sequence: str) -> None:
    class Floats:
        sin, cos = staticmethod(np.sin), staticmethod(np.cos)

        @staticmethod
        def divisor(value: float, smallest: object, why: str) -> float:
            return value

    angles, rates, h = np.array([0.4, 0.9, -0.7]), np.array([0.3, -1.1, 0.8]), 1e-4
    R = rotation.from_euler(sequence, angles)
    # Fourth order
    steps = np.array([1, -1, 2, -2])[:, None] * h
    R_dot = np.tensordot(np.array([8, -8, -1, 1]), rotation.from_euler(sequence, angles + steps * rates), 1) / (12 * h)
    for frame in ("n", "b"):
        omega = rotation.euler_rates(sequence, angles, frame) @ rates
        assert omega == pytest.approx(rotation.angular_velocity(R, frame, R_dot=R_dot), abs=1e-11)
        assert rotation.euler_rates_inverse(sequence, angles, frame) @ omega == pytest.approx(rates, abs=1e-14)
    joint = angles_rates(Floats, sd.EulerAngles(sequence), "j", angles, omega)
    assert np.array(joint, dtype=float) == pytest.approx(rates, abs=1e-14)


def test_euler_parameters_against_the_joints() -> None:
    p = rotation.normalized([0.3, -0.5, 0.7, 0.2])
    omega = np.array([0.4, -0.2, 0.9])
    assert difference(rotation.from_parameters(p), parameters_rotation(p).astype(float)) < 1e-15
    assert rotation.parameters_rate(p, omega, "b") == pytest.approx(np.array(parameters_rates(p, omega), dtype=float), abs=1e-16)
    for frame in ("n", "b"):
        pd = rotation.parameters_rate(p, omega, frame)
        assert rotation.omega_from_parameters(p, pd, frame) == pytest.approx(omega, abs=1e-15)
        assert rotation.omega_from_parameters(p, pd + 5 * p, frame) == pytest.approx(omega, abs=1e-14)
    assert difference(rotation.skew(omega), skew(omega).astype(float)) == 0


def test_small_rotations_to_first_order() -> None:
    delta = np.array([2e-5, -3e-5, 1e-5])
    size = np.linalg.norm(delta)
    assert difference(rotation.infinitesimal(delta), rotation.about(delta, size)) < size**2
    assert difference(rotation.infinitesimal(delta), rotation.from_euler("XYZ", delta)) < size**2


def test_diebel_2006() -> None:
    # Representing Attitude, eqs. 287-290: quaternion of yaw, pitch, roll from half angles.
    psi, theta, phi = 0.6, -0.3, 1.1
    c, s = np.cos(np.array([psi, theta, phi]) / 2), np.sin(np.array([psi, theta, phi]) / 2)
    p = [c[2] * c[1] * c[0] + s[2] * s[1] * s[0], s[2] * c[1] * c[0] - c[2] * s[1] * s[0],
         c[2] * s[1] * c[0] + s[2] * c[1] * s[0], c[2] * c[1] * s[0] - s[2] * s[1] * c[0]]
    assert rotation.to_parameters(rotation.from_euler("ZYX", [psi, theta, phi])) == pytest.approx(p, abs=1e-15)


def test_goldstein() -> None:
    # Classical Mechanics, chapter 4.4: the 3-1-3 rotation matrix, body to space; chapter 4.9: body components of omega.
    phi, theta, psi = 0.5, 1.2, -0.8
    A = np.array([
        [np.cos(psi) * np.cos(phi) - np.cos(theta) * np.sin(phi) * np.sin(psi),
         np.cos(psi) * np.sin(phi) + np.cos(theta) * np.cos(phi) * np.sin(psi), np.sin(psi) * np.sin(theta)],
        [-np.sin(psi) * np.cos(phi) - np.cos(theta) * np.sin(phi) * np.cos(psi),
         -np.sin(psi) * np.sin(phi) + np.cos(theta) * np.cos(phi) * np.cos(psi), np.cos(psi) * np.sin(theta)],
        [np.sin(theta) * np.sin(phi), -np.sin(theta) * np.cos(phi), np.cos(theta)]])
    assert difference(rotation.from_euler("ZXZ", [phi, theta, psi]), A.T) < 1e-15
    rates = np.array([0.3, 0.7, -0.4])
    omega = [rates[0] * np.sin(theta) * np.sin(psi) + rates[1] * np.cos(psi),
             rates[0] * np.sin(theta) * np.cos(psi) - rates[1] * np.sin(psi), rates[0] * np.cos(theta) + rates[2]]
    assert rotation.euler_rates("ZXZ", [phi, theta, psi], "b") @ rates == pytest.approx(omega, abs=1e-15)


def test_two_quarter_turns_do_not_commute() -> None:
    x, z = rotation.about("X", np.pi / 2), rotation.about("Z", np.pi / 2)
    assert x @ z == pytest.approx(np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]]), abs=1e-15)
    assert z @ x == pytest.approx(np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]]), abs=1e-15)
