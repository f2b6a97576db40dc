"""An independent model to compare with: planar Euler-Bernoulli finite elements of a clamped, tapered column with a tip body."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import eigh

# Mass, offsets of the centre of mass from the tip along the deflection and along the column, inertia about it.
TipBody = tuple[float, float, float, float]


@dataclass(frozen=True)
class Column:
    """A vertical cantilever of given tables, linear between stations (m); deflection w and slope w' at each node."""

    stations: np.ndarray
    mass_per_length: np.ndarray
    stiffness: np.ndarray
    elements: int = 40

    def matrices(self, tip: TipBody = (0, 0, 0, 0), gravity: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """M and K with the nodes' [w, w'] but for the clamp; gravity presses from the tip to the clamp."""
        nodes = np.linspace(0, self.stations[-1], self.elements + 1)
        h = nodes[1]
        size = 2 * nodes.size
        M, K = np.zeros((size, size)), np.zeros((size, size))
        mass, along, up, inertia = tip
        # Each element is cut where the tables have a station, so that the rule meets polynomials alone.
        for k, a in enumerate(nodes[:-1]):
            inside = self.stations[(self.stations > a + 1e-9) & (self.stations < a + h - 1e-9)]
            cuts = np.concatenate([[a], inside, [a + h]])
            place = slice(2 * k, 2 * k + 4)
            for lower, upper in pairwise(cuts):
                x, weights = boole(lower, upper)
                xi = (x - a) / h
                w, slope, curvature = hermite(xi, h)
                above = mass + np.array([self.mass_above(value) for value in x])
                rho, EI = (np.interp(x, self.stations, row) for row in (self.mass_per_length, self.stiffness))
                M[place, place] += w.T @ ((weights * rho)[:, None] * w)
                K[place, place] += curvature.T @ ((weights * EI)[:, None] * curvature)
                K[place, place] -= gravity * slope.T @ ((weights * above)[:, None] * slope)
        M[-2:, -2:] += mass * np.array([[1, up], [up, up**2 + along**2]]) + np.diag([0, inertia])
        K[-1, -1] -= mass * gravity * up
        return M[2:, 2:], K[2:, 2:]

    def mass_above(self, x: float) -> float:
        """kg between x and the tip, by the trapezoidal rule, which is exact for linear tables."""
        points = np.concatenate([[x], self.stations[self.stations > x]])
        return float(np.trapezoid(np.interp(points, self.stations, self.mass_per_length), points))

    def frequencies(self, tip: TipBody = (0, 0, 0, 0), gravity: float = 0.0) -> np.ndarray:
        """Hz, rising."""
        M, K = self.matrices(tip, gravity)
        return np.sqrt(eigh(K, M, eigvals_only=True)) / (2 * np.pi)


def hermite(xi: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cubic shape functions of [w1, w1', w2, w2'] and their derivatives by x, (points, 4) each."""
    w = (1 - 3 * xi**2 + 2 * xi**3, h * (xi - 2 * xi**2 + xi**3), 3 * xi**2 - 2 * xi**3, h * (xi**3 - xi**2))
    slope = (6 * xi**2 - 6 * xi, h * (1 - 4 * xi + 3 * xi**2), 6 * xi - 6 * xi**2, h * (3 * xi**2 - 2 * xi))
    curvature = (12 * xi - 6, h * (6 * xi - 4), 6 - 12 * xi, h * (6 * xi - 2))
    return np.stack(w, -1), np.stack(slope, -1) / h, np.stack(curvature, -1) / h**2


def boole(a: float, b: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and weights on four panels, each exact to degree 5: errors are far below those of the elements."""
    panels = np.linspace(a, b, 5)
    x = np.concatenate([np.linspace(p, q, 5) for p, q in pairwise(panels)])
    weights = np.tile(np.array([7, 32, 12, 32, 7]) / 90 * (b - a) / 4, 4)
    return x, weights
