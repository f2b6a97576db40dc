"""Chapter 4: where its errors are, and its printed matrices against SciPy's rotations in numbers."""

from __future__ import annotations

import importlib

import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import Rotation

from symdyn.lecture import chapter_4_euler_parameters as parameters
from symdyn.lecture import chapter_4_euler_theorem as theorem
from symdyn.lecture import chapter_4_finite_rotations as finite
from symdyn.lecture import chapter_4_parameter_rates as rates
from symdyn.lecture import chapter_4_three_link as three_link
from symdyn.lecture import chapter_4_xyz_angles as xyz

# First line of every formula that is wrong.
WRONG = {
    "two_link": [5902], "three_link": [6011, 6063], "xyz_angles": [], "gimbal_lock": [6549, 6551],
    "finite_rotations": [6317, 6325, 6329, 6347, 6347, 6355, 6359, 6361, 6361, 6394],
    "euler_theorem": [6597, 6597, 6631, 6631, 6639, 6710, 6801], "euler_parameters": [6852, 6945, 6951, 6957],
    "parameter_rates": [7021, 7049, 7134],
}


@pytest.mark.parametrize("module", WRONG)
def test_errors_stand_where_they_are_known(module: str) -> None:
    """A test of all chapters together shows that they are proven, and that nothing else differs."""
    cases = importlib.import_module(f"symdyn.lecture.chapter_4_{module}").CASES
    formulas = [formula for case in cases for formula in case.taken()]
    assert sorted(f.slide.line for f in formulas if f.errata) == WRONG[module]


def in_numbers(matrix: sp.Matrix, symbols: list[sp.Symbol], values: np.ndarray) -> np.ndarray:
    return np.array(sp.lambdify(symbols, matrix, "numpy")(*values), dtype=float)


def test_printed_rotations_are_those_of_scipy() -> None:
    rng = np.random.default_rng(4)
    for _ in range(5):
        a, b, c = rng.uniform(-3, 3, 3)
        zyx = in_numbers(three_link.R_3, [three_link.psi, three_link.theta, three_link.phi], [a, b, c])
        np.testing.assert_allclose(zyx, Rotation.from_euler("ZYX", [a, b, c]).as_matrix(), atol=1e-14)
        np.testing.assert_allclose(in_numbers(xyz.R, list(xyz.angles), [a, b, c]),
                                   Rotation.from_euler("XYZ", [a, b, c]).as_matrix(), atol=1e-14)
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        of_axis = in_numbers(theorem.R, [theorem.phi, *theorem.a], [a, *axis])
        np.testing.assert_allclose(of_axis, Rotation.from_rotvec(a * axis).as_matrix(), atol=1e-14)
        p = np.roll(Rotation.from_rotvec(a * axis).as_quat(), 1)
        np.testing.assert_allclose(in_numbers(parameters.R, list(parameters.p), p), of_axis, atol=1e-14)


@pytest.mark.parametrize(("G", "angles", "sequence"), [
    (three_link.G, (three_link.phi, three_link.theta, three_link.psi), "ZYX"),
    (xyz.G, (xyz.phi, xyz.theta, xyz.psi), "XYZ"),
])
def test_printed_rates_follow_small_turns_of_scipy(G: sp.Matrix, angles: tuple, sequence: str) -> None:
    rng, step = np.random.default_rng(5), 1e-5
    for _ in range(3):
        gamma, gamma_dot = rng.uniform(-1, 1, (2, 3))
        order = -1 if sequence == "ZYX" else 1
        after, before = (Rotation.from_euler(sequence, (gamma + sign * step * gamma_dot)[::order]) for sign in (1, -1))
        omega = (after * before.inv()).as_rotvec() / (2 * step)
        np.testing.assert_allclose(in_numbers(G, list(angles), gamma) @ gamma_dot, omega, atol=1e-8)


def test_the_order_matters_for_finite_angles_only() -> None:
    """Against SciPy: the slides' product is the transpose of xyz, R_x R_y R_z that of ZYX; of small angles they agree."""
    rng = np.random.default_rng(7)
    for size, apart in ((1.0, True), (1e-5, False)):
        phi, theta, psi = size * rng.uniform(0.5, 1, 3)
        # R_z and R_x as the slides use them at line 6361, exchanged.
        of_z, of_y, of_x = (np.array(turn(angle), dtype=float) for turn, angle in (
            (finite.R_x, psi), (finite.R_y, theta), (finite.R_z, phi)))
        printed, right = of_z @ of_y @ of_x, of_x @ of_y @ of_z
        np.testing.assert_allclose(right.T, Rotation.from_euler("ZYX", [psi, theta, phi]).as_matrix(), atol=1e-14)
        np.testing.assert_allclose(printed.T, Rotation.from_euler("XYZ", [phi, theta, psi]).as_matrix(), atol=1e-14)
        difference = np.abs(printed - right).max()
        assert difference > 0.1 if apart else difference < 2 * size**2


def test_parameters_of_norm_1_are_projected_out() -> None:
    """E_bar^T E_bar is the projection along p; with the printed + it would have the eigenvalue 2."""
    p = np.random.default_rng(6).normal(size=4)
    p /= np.linalg.norm(p)
    E_bar = in_numbers(rates.E_bar, list(parameters.p), p)
    np.testing.assert_allclose(np.linalg.eigvalsh(E_bar.T @ E_bar), [0, 1, 1, 1], atol=1e-14)
    np.testing.assert_allclose(np.linalg.eigvalsh(np.eye(4) + np.outer(p, p)), [1, 1, 1, 2], atol=1e-14)
