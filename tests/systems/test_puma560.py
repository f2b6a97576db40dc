"""The PUMA 560 against published values."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn as sd

REFERENCE = json.loads((Path(__file__).parent / "puma560_reference.json").read_text())
TOLERANCE = 2e-13  # N m and kg m^2; the values are published to 15 digits
PRINTED = 5.1e-5  # half a unit of the fourth decimal
PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def arrays(data: dict[str, Any], *keys: str) -> list[np.ndarray]:
    return [np.array(data[key], dtype=float) for key in keys]


@pytest.fixture(scope="module", params=["standard", "modified"])
def convention(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def robot(convention: str) -> Any:
    return sd.systems.puma560(convention).embedding().compile(backend="numpy")


@pytest.fixture(scope="module")
def geared() -> Any:
    return sd.systems.puma560(motors=True, torques=True).embedding().compile(backend="numpy")


def test_torques(robot: Any, convention: str) -> None:
    q, qd, qdd, tau = arrays(REFERENCE[convention], "q", "qd", "qdd", "tau")
    np.testing.assert_allclose(robot.inverse_dynamics(q, qd, qdd), tau, rtol=0, atol=TOLERANCE)


def test_gravity_load(robot: Any, convention: str) -> None:
    q, g = arrays(REFERENCE[convention], "q", "g")
    zero = np.zeros(6)
    np.testing.assert_allclose(robot.inverse_dynamics(q, zero, zero), g, rtol=0, atol=TOLERANCE)


def test_velocity_products(robot: Any, convention: str) -> None:
    q, qd, c = arrays(REFERENCE[convention], "q", "qd", "c")
    np.testing.assert_allclose(robot.inverse_dynamics(q, qd, np.zeros(6), {"g": 0.0}), c, rtol=0, atol=TOLERANCE)


def test_mass_matrix(robot: Any, convention: str) -> None:
    q, M = arrays(REFERENCE[convention], "q", "M")
    np.testing.assert_allclose(robot.mass_matrix(q), M, rtol=0, atol=TOLERANCE)


def test_rhs_returns_the_accelerations(convention: str) -> None:
    q, qd, qdd, tau = arrays(REFERENCE[convention], "q", "qd", "qdd", "tau")
    module = sd.systems.puma560(convention, torques=True).embedding().compile(backend="numpy")
    rates = module.rhs(0.0, np.concatenate([q, qd]), None, tau)
    condition = np.linalg.cond(np.array(REFERENCE[convention]["M"]))
    np.testing.assert_allclose(rates[6:], qdd, rtol=0, atol=1e-15 * condition * np.abs(qdd).max())


def test_general_inertia_has_the_same_torques(robot: Any, convention: str) -> None:
    q, qd, qdd, tau = arrays(REFERENCE[convention], "q", "qd", "qdd", "tau")
    general = sd.systems.puma560(convention, general=True)
    lengths = {"standard": 4, "modified": 5}[convention]
    assert len(general.check().parameters) == 60 + lengths + 1
    module = general.embedding().compile(backend="numpy")
    np.testing.assert_allclose(module.inverse_dynamics(q, qd, qdd), tau, rtol=0, atol=TOLERANCE)


def test_inertia_is_the_published_one(convention: str) -> None:
    """L about the frame's origin = I + m (c.c 1 - c c^T), in fractions of the decimal numbers."""
    numbers = {str(p): Fraction(repr(value)) for p, value in sd.systems.puma560(convention, general=True).defaults.items()}
    for i, published in enumerate(REFERENCE[convention]["L_l_m"], start=1):
        m = numbers[f"m{i}"]
        c = [numbers[f"c{i}_{axis}"] for axis in "xyz"]
        square = sum(e * e for e in c)
        L = [numbers[f"I{i}_{'xyz'[a]}{'xyz'[b]}"] + m * ((square if a == b else 0) - c[a] * c[b]) for a, b in PAIRS]
        np.testing.assert_allclose([float(e) for e in (*L, *(m * e for e in c), m)], published, rtol=0, atol=1e-15)


@pytest.mark.parametrize("row", REFERENCE["toolbox"]["torques"], ids=lambda row: f"qd={row['qd']},qdd={row['qdd']},g={row['g']}")
def test_torques_with_motors(geared: Any, row: dict[str, Any]) -> None:
    q = np.pi * np.array(REFERENCE["toolbox"]["q_over_pi"])
    found = geared.inverse_dynamics(q, np.full(6, float(row["qd"])), np.full(6, float(row["qdd"])), {"g": row["g"]})
    np.testing.assert_allclose(found, row["tau"], rtol=0, atol=PRINTED)


def test_mass_matrix_with_motors(geared: Any) -> None:
    q = np.pi * np.array(REFERENCE["toolbox"]["q_over_pi"])
    data = REFERENCE["toolbox"]
    M = geared.mass_matrix(q)
    np.testing.assert_allclose(M, data["M"], rtol=0, atol=PRINTED)
    qdd, tau = arrays(data["inertia_torques"], "qdd", "tau")
    np.testing.assert_allclose(M @ qdd, tau, rtol=0, atol=PRINTED)


def test_accelerations_with_motors(geared: Any) -> None:
    q = np.pi * np.array(REFERENCE["toolbox"]["q_over_pi"])
    qd, tau, qdd = arrays(REFERENCE["toolbox"]["accelerations"], "qd", "tau", "qdd")
    rates = geared.rhs(0.0, np.concatenate([q, qd]), None, tau)
    np.testing.assert_allclose(rates[6:], qdd, rtol=0, atol=PRINTED)


def test_velocity_products_of_the_toolbox() -> None:
    q = np.pi * np.array(REFERENCE["toolbox"]["q_over_pi"])
    qd, C = arrays(REFERENCE["toolbox"]["coriolis"], "qd", "C")
    robot = sd.systems.puma560().embedding().compile(backend="numpy")
    found = robot.inverse_dynamics(q, qd, np.zeros(6), {"g": 0.0})
    np.testing.assert_allclose(found, C @ qd, rtol=0, atol=PRINTED * np.abs(qd).sum())
