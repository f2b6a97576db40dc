"""Three-vectors; arrays of nodes or of floats."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

Vector = Sequence[Any] | np.ndarray


def vector(*components: Any) -> np.ndarray:
    """A vector of any scalars."""
    array = np.empty(len(components), dtype=object)
    array[:] = components
    return array


def zeros(*shape: int) -> np.ndarray:
    """An array of exact zeros."""
    return np.zeros(shape, dtype=object)


def identity() -> np.ndarray:
    """The exact 3 x 3 identity."""
    return np.array(((1, 0, 0), (0, 1, 0), (0, 0, 1)), dtype=object)


def cross(a: Vector, b: Vector) -> np.ndarray:
    """a x b."""
    return vector(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a: Vector, b: Vector) -> Any:
    """a . b"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def inner(a: Vector, b: Vector) -> Any:
    """Sum of the products of the entries of two vectors of any length."""
    total: Any = 0
    for x, y in zip(a, b, strict=True):
        total = total + x * y
    return total


def congruence(M: np.ndarray, D: np.ndarray) -> np.ndarray:
    """D^T M D, symmetric entries once."""
    half = M @ D if M.shape[0] else zeros(0, D.shape[1])
    n = D.shape[1]
    result = zeros(n, n)
    for i in range(n):
        for j in range(i + 1):
            result[i, j] = result[j, i] = inner(D[:, i], half[:, j])
    return result
