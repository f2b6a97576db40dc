"""Three-vectors and the inertia of a rigid body; arrays of nodes or of floats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
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


@dataclass(frozen=True)
class Inertia:
    """Mass m, first moment h = m r_G and inertia I about the origin of the frame, (3, 3), in the frame's axes."""

    m: Any
    h: np.ndarray
    I: np.ndarray

    def __add__(self, other: Inertia) -> Inertia:
        return Inertia(self.m + other.m, self.h + other.h, self.I + other.I)

    def moved(self, R: np.ndarray, p: np.ndarray) -> Inertia:
        """The same inertia seen from a frame in which this one has orientation R and origin p.

        I' = R I R^T - [h'] [p] - [p] [h'] - m [p] [p] with h' = R h (parallel axes), symmetric entries once.
        """
        h = R @ self.h
        rotated = R @ self.I
        g = h + self.m * p
        I = zeros(3, 3)
        # -( [h][p] + [p][g] ) = (h.p + p.g) 1 - (p h^T + g p^T)
        hp, pg = [h[k] * p[k] for k in range(3)], [p[k] * g[k] for k in range(3)]
        both = [hp[k] + pg[k] for k in range(3)]
        for i in range(3):
            for j in range(i, 3):
                turned = rotated[i, 0] * R[j, 0] + rotated[i, 1] * R[j, 1] + rotated[i, 2] * R[j, 2]
                if i == j:
                    a, b = (k for k in range(3) if k != i)
                    I[i, i] = turned + (both[a] + both[b])
                else:
                    I[i, j] = I[j, i] = turned - (p[i] * h[j] + g[i] * p[j])
        return Inertia(self.m, g, I)
