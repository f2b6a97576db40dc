"""Random orientations, among them those where formulas lose their digits."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

import symdyn as sd

NUMBER = 10_000


def uniform(seed: int, number: int = NUMBER) -> np.ndarray:
    """R (number, 3, 3), uniformly distributed, not made by symdyn."""
    return Rotation.random(number, random_state=seed).as_matrix()


def distances(rng: np.random.Generator, number: int) -> np.ndarray:
    """Distances of either sign, from 1e-18 to 1e-8, a tenth of them zero."""
    sizes = 10 ** rng.uniform(-18, -8, number) * rng.choice([-1, 1], number)
    return np.where(rng.random(number) < 0.1, 0.0, sizes)


def near_lock(sequence: str, rng: np.random.Generator, number: int) -> np.ndarray:
    """R (number, 3, 3) within 1e-8 of gimbal lock, not made by symdyn."""
    angles = rng.uniform(-np.pi, np.pi, (number, 3))
    lock = np.array([float(angle) for angle in sd.rotation.gimbal_lock(sequence).second])
    angles[:, 1] = rng.choice(lock, number) + distances(rng, number)
    return Rotation.from_euler(sequence, angles).as_matrix()


def near_angle(angle: float, rng: np.random.Generator, number: int) -> np.ndarray:
    """R (number, 3, 3) about any axis within 1e-8 of an angle, not made by symdyn; one in five about X, Y or Z."""
    axes = rng.normal(size=(number, 3))
    along = rng.integers(0, 3, number)
    coordinate = rng.random(number) < 0.2
    axes[coordinate] = np.eye(3)[along[coordinate]]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    return Rotation.from_rotvec(axes * (angle + distances(rng, number))[:, None]).as_matrix()


def all_kinds(sequence: str, seed: int) -> np.ndarray:
    """R (10 000, 3, 3): 4000 uniform, 2000 near lock, 2000 near angle 0, 2000 near angle pi."""
    rng = np.random.default_rng(seed)
    return np.concatenate([uniform(seed, 4000), near_lock(sequence, rng, 2000), near_angle(0.0, rng, 2000),
                           near_angle(np.pi, rng, 2000)])


def difference(R: np.ndarray, S: np.ndarray) -> float:
    """The largest entry of |R - S|."""
    return float(abs(R - S).max())
