"""The inertia of a rigid body, and the articulated inertia of a body with everything that hangs on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.spatial.rotation import rotated, rotated_symmetric
from symdyn.spatial.vectors import cross, zeros
from symdyn.tape.node import is_zero


@dataclass(frozen=True)
class Inertia:
    """Mass m, first moment h = m r_G and inertia I about the origin of the frame, (3, 3), in the frame's axes."""

    m: Any
    h: np.ndarray
    I: np.ndarray

    @classmethod
    def none(cls) -> Inertia:
        """No mass at all."""
        return cls(0, zeros(3), zeros(3, 3))

    def __add__(self, other: Inertia) -> Inertia:
        return Inertia(self.m + other.m, self.h + other.h, self.I + other.I)

    def __sub__(self, other: Inertia) -> Inertia:
        return Inertia(self.m - other.m, self.h - other.h, self.I - other.I)

    def turned(self, R: np.ndarray) -> Inertia:
        """The same inertia in the axes of a frame in which this one has orientation R and the same origin."""
        return Inertia(self.m, R @ self.h, rotated_symmetric(R, self.I))

    def moved(self, R: np.ndarray, p: np.ndarray) -> Inertia:
        """The same inertia seen from a frame in which this one has orientation R and origin p.

        I' = R I R^T - [h'] [p] - [p] [h'] - m [p] [p] with h' = R h (parallel axes), symmetric entries once.
        """
        turned = self.turned(R)
        h, g = turned.h, turned.h + self.m * p
        I = turned.I
        # -( [h][p] + [p][g] ) = (h.p + p.g) 1 - (p h^T + g p^T)
        both = [h[k] * p[k] for k in range(3)] if is_zero(self.m) else [(h[k] + g[k]) * p[k] for k in range(3)]
        twice = 2 if is_zero(self.m) else 1
        for i in range(3):
            for j in range(i, 3):
                if i == j:
                    a, b = (k for k in range(3) if k != i)
                    I[i, i] = I[i, i] + twice * (both[a] + both[b])
                else:
                    I[i, j] = I[j, i] = I[i, j] - (p[i] * h[j] + g[i] * p[j])
        return Inertia(self.m, g, I)

    def momentum(self, omega: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Linear momentum, and angular momentum about the origin, for a twist (or force and moment for its derivative)."""
        return self.m * v + cross(omega, self.h), self.I @ omega + cross(self.h, v)


@dataclass(frozen=True)
class ArticulatedInertia:
    """Force and moment that a body with everything that hangs on it needs for an acceleration: n = A alpha + H a,
    f = H^T alpha + M a, about the origin of the frame; A, H, M (3, 3), A and M symmetric."""

    A: np.ndarray
    H: np.ndarray
    M: np.ndarray

    @classmethod
    def rigid(cls, inertia: Inertia) -> ArticulatedInertia:
        """Inertia of a rigid body."""
        x, y, z = inertia.h
        m = inertia.m
        return cls(inertia.I, np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=object),
                   np.array([[m, 0, 0], [0, m, 0], [0, 0, m]], dtype=object))

    def __add__(self, other: ArticulatedInertia | Inertia) -> ArticulatedInertia:
        if isinstance(other, Inertia):
            other = ArticulatedInertia.rigid(other)
        return ArticulatedInertia(self.A + other.A, self.H + other.H, self.M + other.M)

    def momentum(self, omega: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As for Inertia."""
        return self.H.T @ omega + self.M @ v, self.A @ omega + self.H @ v

    def matrix(self) -> np.ndarray:
        """(6, 6), angular part first."""
        return np.block([[self.A, self.H], [self.H.T, self.M]])

    def moved(self, R: np.ndarray, p: np.ndarray) -> ArticulatedInertia:
        """The same seen from a frame in which this one has orientation R and origin p: X^T I^A X, symmetric entries once.

        With blocks turned: H' = H + [p] M, A' = A - H [p] + [p] H'^T; the components of p are factored out.
        """
        A, H, M = rotated_symmetric(R, self.A), rotated(R, self.H), rotated_symmetric(R, self.M)
        shifted, about = zeros(3, 3), zeros(3, 3)
        for j in range(3):
            shifted[:, j] = H[:, j] + cross(p, M[:, j])
        for i in range(3):
            for j in range(i, 3):
                about[i, j] = A[i, j]
                for c in range(3):
                    # ([p])_ab = - epsilon_abc p_c
                    factor: Any = 0
                    if j != c:
                        factor = factor + _permutation(3 - j - c, j, c) * H[i, 3 - j - c]
                    if i != c:
                        factor = factor - _permutation(i, 3 - i - c, c) * shifted[j, 3 - i - c]
                    about[i, j] = about[i, j] + p[c] * factor
                about[j, i] = about[i, j]
        return ArticulatedInertia(about, shifted, M)


def _permutation(i: int, j: int, k: int) -> int:
    """1 for an even permutation of 0, 1, 2, -1 for an odd one."""
    return (j - i) * (k - j) * (k - i) // 2


def total(a: Inertia | ArticulatedInertia, b: Inertia | ArticulatedInertia) -> Inertia | ArticulatedInertia:
    """The sum of two inertias, as simple as it can be."""
    if isinstance(a, Inertia) and isinstance(b, Inertia):
        return a + b
    return a + b if isinstance(a, ArticulatedInertia) else b + a  # type: ignore[operator]
