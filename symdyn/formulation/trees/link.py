"""The motion of one link, and the force and moment that it needs.

The products omega_i omega_j are formed once a link and serve the acceleration of every point, U = [alpha x] + [omega x][omega x],
and the gyroscopic moment (Khalil and Dombre, Modeling, Identification and Control of Robots, section 9.5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from symdyn.spatial.inertia import Inertia
from symdyn.spatial.vectors import cross, zeros

Wrench = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class LinkMotion:
    """Motion of one link, in its own axes: omega, alpha (3,), a: acceleration of its origin (3,), U (3, 3) as above."""

    omega: np.ndarray
    alpha: np.ndarray
    a: np.ndarray
    U: np.ndarray
    products: np.ndarray

    def at(self, point: np.ndarray) -> np.ndarray:
        """Acceleration of a point of the link, link axes."""
        return self.a + self.U @ point


def rates_matrix(omega: np.ndarray, alpha: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """U = [alpha x] + [omega x][omega x], and the products omega_i omega_j."""
    P = zeros(3, 3)
    for i in range(3):
        for j in range(i, 3):
            P[i, j] = P[j, i] = omega[i] * omega[j]
    x, y, z = alpha
    U = np.array([[-(P[1, 1] + P[2, 2]), P[0, 1] - z, P[0, 2] + y],
                  [P[0, 1] + z, -(P[0, 0] + P[2, 2]), P[1, 2] - x],
                  [P[0, 2] - y, P[1, 2] + x, -(P[0, 0] + P[1, 1])]], dtype=object)
    return U, P


def base_motion(a_0: np.ndarray) -> LinkMotion:
    """A base that does not turn, with the acceleration a_0 (3,)."""
    return LinkMotion(zeros(3), zeros(3), a_0, zeros(3, 3), zeros(3, 3))


def inertial_wrench(inertia: Inertia, motion: LinkMotion) -> tuple[np.ndarray, np.ndarray]:
    """Force and moment about the link's origin that its motion needs: f = m a + U h, n = I alpha + omega x I omega + h x a."""
    m, h, I = inertia.m, inertia.h, inertia.I
    U, P = motion.U, motion.products
    f = m * motion.a + U @ h
    al = motion.alpha
    n = np.array([
        I[0, 0] * al[0] + (I[2, 2] - I[1, 1]) * P[1, 2] + I[1, 2] * (P[1, 1] - P[2, 2]) + I[0, 2] * U[1, 0] - I[0, 1] * U[2, 0],
        I[1, 1] * al[1] + (I[0, 0] - I[2, 2]) * P[0, 2] + I[0, 2] * (P[2, 2] - P[0, 0]) + I[0, 1] * U[2, 1] - I[1, 2] * U[0, 1],
        I[2, 2] * al[2] + (I[1, 1] - I[0, 0]) * P[0, 1] + I[0, 1] * (P[0, 0] - P[1, 1]) + I[1, 2] * U[0, 2] - I[0, 2] * U[1, 2],
    ], dtype=object)
    return f, n + cross(h, motion.a)
