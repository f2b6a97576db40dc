"""Every conversion and back, and chains of them, at 10 000 orientations: near and at lock, angle 0 and angle pi too."""

from __future__ import annotations

import numpy as np
import pytest

import symdyn as sd
from tests.rotation.orientations import NUMBER, all_kinds, difference, near_angle, near_lock, uniform

rotation = sd.rotation
EXACT = 4e-15


@pytest.mark.parametrize("sequence", rotation.SEQUENCES)
def test_euler_angles_give_the_rotation_back(sequence: str) -> None:
    R = all_kinds(sequence, seed=1)
    assert len(R) == NUMBER
    found = rotation.to_euler(R, sequence)
    assert 50 < found.locked.sum() < 2500
    for angles in (found.angles, found.other):
        assert abs(angles).max() <= np.pi
        assert difference(rotation.from_euler(sequence, angles), R) <= EXACT


@pytest.mark.parametrize("sequence", rotation.SEQUENCES)
def test_every_member_of_the_family_at_lock_gives_the_rotation_back(sequence: str) -> None:
    rng = np.random.default_rng(2)
    R = near_lock(sequence, rng, NUMBER)
    R = R[rotation.to_euler(R, sequence).locked]
    assert len(R) > 2000
    found, free = rotation.to_euler(R, sequence), rng.uniform(-np.pi, np.pi, len(R))
    for angles, k in ((found.at(first=free), 0), (found.at(third=free), 2)):
        assert (angles[:, k] == free).all()
        assert difference(rotation.from_euler(sequence, angles), R) <= EXACT
        kept = angles[:, 0] + found.sign * angles[:, 2] - found.value
        assert abs(np.exp(1j * kept) - 1).max() <= EXACT


@pytest.mark.parametrize("seed", [3, 4])
def test_axis_and_angle_give_the_rotation_back(seed: int) -> None:
    R = all_kinds("ZYX", seed)
    axis, angle = rotation.axis_angle(R)
    assert abs(np.linalg.norm(axis, axis=1) - 1).max() <= EXACT
    assert angle.min() >= 0 and angle.max() <= np.pi
    assert difference(rotation.from_axis_angle(axis, angle), R) <= EXACT


@pytest.mark.parametrize("seed", [5, 6])
def test_euler_parameters_give_the_rotation_back(seed: int) -> None:
    R = all_kinds("ZXZ", seed)
    p = rotation.to_parameters(R)
    assert abs(np.linalg.norm(p, axis=1) - 1).max() <= EXACT
    assert p[:, 0].min() >= 0
    assert difference(rotation.from_parameters(p), R) <= EXACT


def test_parameters_and_axis_angle_are_inverses() -> None:
    rng = np.random.default_rng(7)
    R = np.concatenate([uniform(7, 4000), near_angle(0.0, rng, 3000), near_angle(np.pi, rng, 3000)])
    p = rotation.parameters_of_axis_angle(*rotation.axis_angle(R))
    assert difference(rotation.from_parameters(p), R) <= EXACT
    assert difference(rotation.about(*rotation.axis_angle_of_parameters(p)), R) <= EXACT
    assert difference(rotation.about(*rotation.axis_angle_of_parameters(-p)), R) <= EXACT


@pytest.mark.parametrize("start", ["ZYX", "XYZ", "ZXZ", "YXY"])
def test_a_chain_of_all_conversions_gives_the_rotation_back(start: str) -> None:
    R = kept = all_kinds(start, seed=8)
    order = list(rotation.SEQUENCES)
    for sequence in np.random.default_rng(order.index(start)).permutation(order):
        found = rotation.to_euler(R, sequence)
        R = rotation.from_euler(sequence, found.other)
        R = rotation.from_parameters(rotation.to_parameters(R)) if sequence == start else R
    R = rotation.from_axis_angle(*rotation.axis_angle(R))
    assert difference(R, kept) <= EXACT


def test_euler_angles_come_back_themselves_away_from_lock() -> None:
    rng = np.random.default_rng(9)
    for sequence in rotation.SEQUENCES:
        proper = sequence[0] == sequence[2]
        second = rng.uniform(0.1, np.pi - 0.1, 1000) - (0 if proper else np.pi / 2)
        angles = np.stack([rng.uniform(-3.1, 3.1, 1000), second, rng.uniform(-3.1, 3.1, 1000)], axis=1)
        found = rotation.to_euler(rotation.from_euler(sequence, angles), sequence)
        assert abs(found.angles - angles).max() <= 1e-14
        other = np.stack([angles[:, 0] + np.pi, -second if proper else np.pi - second, angles[:, 2] + np.pi], axis=1)
        assert abs(np.exp(1j * other) - np.exp(1j * found.other)).max() <= 1e-14


def test_small_angles_keep_their_digits() -> None:
    for small in (1e-9, 1e-100, 5e-300):
        axis, angle = rotation.axis_angle(rotation.infinitesimal([0, 3 * small / 5, 4 * small / 5]))
        assert angle == pytest.approx(small, rel=1e-15, abs=0) or small < 1e-150
        assert axis == pytest.approx([0, 0.6, 0.8], abs=1e-15)


def test_composition_keeps_the_norm_over_many_steps() -> None:
    step = rotation.parameters_of_axis_angle([1, 2, 3], 0.7)
    p = np.array([1.0, 0, 0, 0])
    for _ in range(1000):
        p = rotation.compose(p, step)
    assert np.linalg.norm(p) == pytest.approx(1, abs=4e-16)
    assert difference(rotation.from_parameters(p), rotation.about([1, 2, 3], 700.0)) <= 1e-12


def test_leading_axes_are_kept() -> None:
    R = uniform(10, 12).reshape(3, 4, 3, 3)
    found = rotation.to_euler(R, "XYZ")
    assert found.angles.shape == found.other.shape == (3, 4, 3) and found.locked.shape == found.fixed.shape == (3, 4)
    assert found.angles[1, 2] == pytest.approx(rotation.to_euler(R[1, 2], "XYZ").angles, abs=0)
    assert rotation.to_parameters(R).shape == (3, 4, 4)
    axis, angle = rotation.axis_angle(R)
    assert axis.shape == (3, 4, 3) and angle.shape == (3, 4)
    assert rotation.skew(axis).shape == (3, 4, 3, 3) and rotation.vee(rotation.skew(axis)).shape == (3, 4, 3)
    assert rotation.euler_rates("XYZ", found.angles, "b").shape == (3, 4, 3, 3)
    assert rotation.about([0, 0, 1], np.zeros(5)).shape == (5, 3, 3)
    assert rotation.to_euler(np.empty((0, 3, 3)), "XYZ").angles.shape == (0, 3)
