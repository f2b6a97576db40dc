"""The 6 x 6 matrices of spatial vectors: what they mean, and their zeros."""

from __future__ import annotations

import numpy as np
import pytest

from symdyn.spatial.inertia import Inertia
from symdyn.spatial.sixvectors import (
    force_cross,
    force_cross_swapped,
    force_transform,
    mass_and_first_moment,
    motion_cross,
    motion_transform,
    spatial_inertia,
)
from symdyn.spatial.vectors import cross, vector, zeros
from symdyn.tape import Recorder
from symdyn.tape.node import PARAMETER, is_zero


@pytest.fixture(params=range(5))
def rng(request: pytest.FixtureRequest) -> np.random.Generator:
    return np.random.default_rng(request.param)


def rotation(rng: np.random.Generator) -> np.ndarray:
    Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return Q * np.linalg.det(Q)


def body(rng: np.random.Generator) -> Inertia:
    A = rng.normal(size=(3, 3))
    about_com = Inertia(1.7, zeros(3), A @ A.T + 2 * np.eye(3))
    return about_com.moved(np.eye(3), rng.normal(size=3))


def close(a: np.ndarray, b: np.ndarray) -> bool:
    return bool(np.allclose(a.astype(float), b.astype(float), rtol=1e-13, atol=1e-13))


def test_transforms_carry_a_body_s_velocity_and_a_wrench(rng: np.random.Generator) -> None:
    R, r, omega, v, n, f = rotation(rng), *rng.normal(size=(5, 3))
    moved = motion_transform(R, r) @ np.concatenate([omega, v])
    assert close(moved, np.concatenate([R.T @ omega, R.T @ (v + np.cross(omega, r))]))
    carried = force_transform(R, r) @ np.concatenate([n, f])
    assert close(carried, np.concatenate([R @ n + np.cross(r, R @ f), R @ f]))


def test_transforms_keep_power_and_undo_each_other(rng: np.random.Generator) -> None:
    R, r = rotation(rng), rng.normal(size=3)
    X, X_star = motion_transform(R, r), force_transform(R, r)
    assert close(X_star, X.T)
    assert close(motion_transform(R.T, -R.T @ r) @ X, np.eye(6)) and close(force_transform(R.T, -R.T @ r) @ X_star, np.eye(6))


def test_lecture_s_force_transform(rng: np.random.Generator) -> None:
    """Chapter 5.6, "Force and moment exerted on O_2": [[R, -R r_O2/O3 x], [0, R]] with r_O2/O3 in the axes of b3."""
    R, r = rotation(rng), rng.normal(size=3)
    back = -R.T @ r
    skew = np.array([[0, -back[2], back[1]], [back[2], 0, -back[0]], [-back[1], back[0], 0]])
    assert close(force_transform(R, r), np.block([[R, -R @ skew], [np.zeros((3, 3)), R]]))


def test_cross_products(rng: np.random.Generator) -> None:
    v, w, f = rng.normal(size=(3, 6))
    R, r = rotation(rng), rng.normal(size=3)
    X, X_star = motion_transform(R, r), motion_transform(R, r).T
    assert close(force_cross(v), -motion_cross(v).T)
    assert close(motion_cross(v) @ w, -(motion_cross(w) @ v)) and close(motion_cross(v) @ v, np.zeros(6))
    assert close(motion_cross(X @ v) @ (X @ w), X @ (motion_cross(v) @ w))
    assert close(X_star @ force_cross(X @ v) @ f, force_cross(v) @ (X_star @ f))
    B = force_cross_swapped(f)
    assert close(B @ v, force_cross(v) @ f) and close(B, -B.T)


def test_inertia_gives_momentum_energy_and_mass(rng: np.random.Generator) -> None:
    inertia, R, r, v = body(rng), rotation(rng), rng.normal(size=3), rng.normal(size=6)
    I = spatial_inertia(inertia)
    f, n = inertia.momentum(v[:3], v[3:])
    assert close(I @ v, np.concatenate([n, f])) and close(I, I.T)
    X = motion_transform(R, r)
    assert close(X.T @ I @ X, spatial_inertia(inertia.moved(R, r)))
    m, h = mass_and_first_moment(X.T @ I @ X)
    assert m == pytest.approx(1.7) and close(h, inertia.moved(R, r).h)


def test_zeros_are_structural_on_the_tape() -> None:
    recorder = Recorder()
    x, y, z, m = (recorder.leaf(name, PARAMETER) for name in "xyzm")
    R = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]], dtype=object)
    X = motion_transform(R, vector(x, 0, 0))
    assert sum(not is_zero(e) for e in X.ravel()) == 8
    assert sum(not is_zero(e) for e in force_cross(vector(0, 0, x, y, 0, 0)).ravel()) == 6
    I = spatial_inertia(Inertia(m, zeros(3), zeros(3, 3)))
    assert [e for e in I.ravel() if not is_zero(e)] == [m, m, m]
    assert all(is_zero(e) for e in cross(vector(0, 0, z), vector(0, 0, x)))
