"""Small vibrations of turning, weighed and tip-loaded beams, from the integrals of a modal body alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import symdyn as sd
from symdyn.flexible.clamped import clamped, frequencies
from symdyn.flexible.modal_body import ModalBody

# Uniform cantilever turning about its root: omega sqrt(m L^4 / EI) of flapping over Omega sqrt(m L^4 / EI); A. D. Wright,
# C. E. Smith, R. W. Thresher, J. L. C. Wang, J. Appl. Mech. 49 (1982) 197-202; modes 2 and 3 by a Ritz series of 12 terms.
SPEEDS = [0, 1, 2, 3, 6, 12]
PUBLISHED = [[3.5160, 3.6816, 4.1373, 4.7973, 7.3604, 13.1702],
             [22.0345, 22.1810, 22.6149, 23.3203, 26.8091, 37.6031],
             [61.6972, 61.8418, 62.2732, 62.9850, 66.6839, 79.6145]]


def powers(count: int, direction: str = "x") -> list[sd.Shape]:
    return [sd.Shape(direction, [1.0], powers=[k]) for k in range(2, 2 + count)]


def uniform(shapes) -> ModalBody:
    return sd.Beam([0, 1], 1.0, 1.0, shapes).modal


def flapping(body: ModalBody, speed: float) -> np.ndarray:
    M, _, K = clamped(body, omega=[speed, 0, 0])
    return frequencies(M, K)


@pytest.fixture(scope="module")
def both():
    """Six powers in either direction."""
    return uniform(powers(6) + powers(6, "y"))


@pytest.fixture(scope="module")
def at_rest():
    return sd.Beam([0, 1], 1.0, 1.0, powers(1)).modes(10)


@pytest.mark.parametrize(("mode", "count"), [(1, 5), (2, 5), (3, 7)])
def test_frequencies_over_speed_with_powers(mode, count) -> None:
    body = uniform(powers(count))
    found = [flapping(body, speed)[mode - 1] for speed in SPEEDS]
    np.testing.assert_allclose(found, PUBLISHED[mode - 1], rtol=1e-3)


@pytest.mark.parametrize(("mode", "count"), [(1, 4), (2, 4), (3, 5)])
def test_frequencies_over_speed_with_modes_at_rest(mode, count, at_rest) -> None:
    body = uniform([shape for shape in at_rest if shape.parts[0][0] == "x"][:count])
    found = [flapping(body, speed)[mode - 1] for speed in SPEEDS]
    np.testing.assert_allclose(found, PUBLISHED[mode - 1], rtol=1e-3)


def test_one_shape_computed_at_speed_is_enough() -> None:
    beam = sd.Beam([0, 1], 1.0, 1.0, powers(1))
    shapes = beam.modes(2, omega=[12, 0, 0])
    assert sorted(shape.parts[0][0] for shape in shapes) == ["x", "y"]
    flap = next(shape for shape in shapes if shape.parts[0][0] == "x")
    assert flapping(uniform([flap]), 12)[0] == pytest.approx(PUBLISHED[0][5], rel=1e-5)


def test_lagging_is_softer_than_flapping_by_the_speed(both) -> None:
    M, _, K = clamped(both, omega=[5.0, 0, 0])
    flap, lag = frequencies(M[:6, :6], K[:6, :6]), frequencies(M[6:, 6:], K[6:, 6:])
    np.testing.assert_allclose(lag[:3] ** 2, flap[:3] ** 2 - 25, rtol=1e-9)


def test_a_beam_that_turns_about_itself_whirls(both) -> None:
    """Seen from a frame that turns with Omega about the beam, a plane vibration has omega +- Omega; a round tip body of polar
    inertia P adds gyroscopic terms: in the frame at rest, K - omega^2 M + omega Omega P theta theta = 0."""
    Omega, P, J = 1.3, 0.2, 0.15
    tip = {"tip_mass": 0.4, "tip_com": (0, 0, 0.3), "tip_inertia": np.diag([J, J, P])}
    M, C, K = clamped(both, omega=[0, 0, Omega], **tip)
    n = both.n
    turning = np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]]))
    assert np.abs(C + C.T).max() < 1e-12 and np.abs(turning.real).max() < 1e-5
    M, _, K = clamped(both, **tip)
    M, K, slope = M[:6, :6], K[:6, :6], both.Theta_tip[1, :6]
    gyroscopic = 1j * Omega * P * np.linalg.solve(M, np.outer(slope, slope))
    A = np.block([[np.zeros((6, 6)), np.eye(6)], [-np.linalg.solve(M, K), gyroscopic]])
    rest = np.linalg.eigvals(A).imag
    expected = np.sort(np.abs(rest - Omega))[:6]
    np.testing.assert_allclose(np.sort(np.abs(turning.imag[turning.imag > 0]))[:6], expected, rtol=1e-6)


@pytest.mark.parametrize(("mass", "tip_mass", "critical"), [(1.0, 0.0, 7.837347), (1e-9, 1.0, np.pi**2 / 4)])
def test_a_column_buckles_under_itself_and_under_a_tip_mass(mass, tip_mass, critical) -> None:
    """Greenhill: q L^3 / EI = 7.8373; Euler: m g L^2 / EI = pi^2 / 4. There the stiffness is lost."""
    body = sd.Beam([0, 1], mass, 1.0, powers(8)).modal
    before, after = (np.linalg.eigvalsh(clamped(body, gravity=[0, 0, -critical * f], tip_mass=tip_mass)[2])[0]
                     for f in (1 - 1e-6, 1 + 1e-6))
    assert before > 0 > after


def test_tip_body_by_differences_of_its_potential(both) -> None:
    """K is the Hessian of strain, centrifugal and gravity potential, the tip body's pose being r(L) and exp(Theta eta)."""
    mass, c, omega, g = 0.7, np.array([0.2, -0.3, 0.4]), np.array([0.6, -0.4, 0.9]), np.array([0.5, 2.0, -3.0])
    J = np.array([[0.3, 0.02, -0.01], [0.02, 0.4, 0.05], [-0.01, 0.05, 0.2]])
    body = uniform(powers(2) + powers(2, "y"))

    def potential(eta: np.ndarray) -> float:
        R = Rotation.from_rotvec(body.Theta_tip @ eta).as_matrix()
        p = body.e + body.Psi_tip @ eta - eta @ body.S_tip @ eta / 2 * body.e + R @ c
        inertia = body.inertia(eta) + R @ J @ R.T + mass * (p @ p * np.eye(3) - np.outer(p, p))
        return eta @ body.K @ eta / 2 - omega @ inertia @ omega / 2 - g @ (body.h(eta) + mass * p)

    _, _, K = clamped(body, tip_mass=mass, tip_com=c, tip_inertia=J, omega=omega, gravity=g)
    step, axes = 1e-3, np.eye(4)
    for i in range(4):
        for j in range(4):
            around = [potential(step * (a * axes[i] + b * axes[j])) * a * b for a in (1, -1) for b in (1, -1)]
            assert K[i, j] == pytest.approx(sum(around) / (4 * step**2), rel=1e-4, abs=1e-4)


def test_own_modes_are_uncoupled_and_those_of_the_theory() -> None:
    body = sd.Beam([0, 2], 3.0, 5.0, 6, damping_ratio=0.01).modal
    roots = np.repeat([1.8751040687, 4.6940911330, 7.8547574382], 2)
    np.testing.assert_allclose(frequencies(body.Me, body.K), (roots / 2) ** 2 * np.sqrt(5 / 3), rtol=1e-5)
    for A in (body.Me, body.K, body.D):
        assert np.abs(A - np.diag(np.diag(A))).max() < 1e-5 * np.abs(A).max()
    assert body.names == tuple(f"mode {k}" for k in range(1, 7))
    np.testing.assert_allclose(np.abs(body.Psi_tip[[0, 1] * 3, range(6)]), 1, rtol=1e-12)


def test_modes_with_a_heavy_tip() -> None:
    """Cantilever with a tip mass that is far heavier: omega^2 = 3 EI / (L^3 (M + 33/140 m)) but for the square of the ratio."""
    beam = sd.Beam([0, 2.0], 0.01, 5.0, powers(1))
    shapes = beam.modes(2, tip_mass=10.0)
    body = sd.Beam([0, 2.0], 0.01, 5.0, shapes).modal
    M, _, K = clamped(body, tip_mass=10.0)
    np.testing.assert_allclose(frequencies(M, K) ** 2, 3 * 5.0 / (8 * (10 + 33 / 140 * 0.02)), rtol=1e-6)


def test_modes_of_a_twisted_beam_deflect_in_both_directions() -> None:
    beam = sd.Beam([0, 1], 1.0, ([1.0, 1.0], [3.0, 3.0]), 4, twist=[0.4, 0.4])
    soft = beam.modal.Psi_tip[:2, 0]
    np.testing.assert_allclose(soft[1] / soft[0], np.tan(0.4), rtol=1e-6)
    np.testing.assert_allclose(frequencies(beam.modal.Me, beam.modal.K)[:2], 3.516015 * np.sqrt([1, 3]), rtol=1e-5)


@pytest.mark.parametrize("count", [0, 10**4, "two"])
def test_a_wrong_number_of_modes(count) -> None:
    with pytest.raises(sd.ArgumentError, match="pass a whole number of modes from 1 to"):
        sd.Beam([0, 1], 1.0, 1.0, powers(1)).modes(count)
