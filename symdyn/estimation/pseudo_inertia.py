"""Inertias that a body can have: those with a positive definite pseudo-inertia, and the least squares among them.

The pseudo-inertia of a body, J = [[S, h], [h^T, m]] with S = tr(I)/2 1 - I, is the integral of [r; 1] [r; 1]^T over its mass. It
is linear in the ten inertial parameters, and positive definite where and only where a distribution of mass has these.
Source: P. Wensing, S. Kim, J.-J. Slotine, Linear matrix inequalities for physically consistent inertial parameter identification,
IEEE RA-L 3 (2018) 60-67.

The distance to nominal values is Bregman's divergence of the log-determinant, d = -log det(J J_0^-1) + tr(J J_0^-1) - 4, which is
the same in all frames and units, convex, and infinite at the border, so that Newton's method stays inside without any program for
matrix inequalities. Source: T. Lee, P. Wensing, F. Park, Geometric robot dynamic identification: a convex programming approach,
IEEE T-RO 36 (2020) 348-365.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from symdyn.errors import EvaluationError

# Factor by which the weight of the divergence falls from stage to stage; the decrement squared of Newton's method at which a
# stage ends, and the last one, relative to the weight; steps at most.
FALL, STAGE, END, MOST_STEPS = 0.1, 0.01, 1e-10, 1000
# The part of a step below which none is tried, and the decrement that rounding of the sum may leave then; that of one operation.
LEAST_STEP, ROUNDING, EPS = 1e-12, 1e-12, float(np.finfo(float).eps)
# Places of the ten parameters in J: m, h_x, h_y, h_z, I_xx, I_xy, I_xz, I_yy, I_yz, I_zz.
_SYMMETRIC = [(0, 0), (1, 1), (2, 2), (3, 3), (0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]


def pseudo_inertia(pi: np.ndarray) -> np.ndarray:
    """J (..., 4, 4) of ten inertial parameters (..., 10) about the origin."""
    m, hx, hy, hz, xx, xy, xz, yy, yz, zz = np.moveaxis(np.asarray(pi, dtype=float), -1, 0)
    half = (xx + yy + zz) / 2
    return np.stack([np.stack(row, axis=-1) for row in ((half - xx, -xy, -xz, hx), (-xy, half - yy, -yz, hy),
                                                        (-xz, -yz, half - zz, hz), (hx, hy, hz, m))], axis=-2)


def parameters_of(J: np.ndarray) -> np.ndarray:
    """Ten inertial parameters (..., 10) of a pseudo-inertia."""
    a, b, c = J[..., 0, 0], J[..., 1, 1], J[..., 2, 2]
    return np.stack([J[..., 3, 3], J[..., 0, 3], J[..., 1, 3], J[..., 2, 3], b + c, -J[..., 0, 1], -J[..., 0, 2], a + c,
                     -J[..., 1, 2], a + b], axis=-1)


def is_consistent(pi: np.ndarray) -> bool:
    """Whether a body can have these ten parameters."""
    return bool(np.linalg.eigvalsh(_unit(pseudo_inertia(pi))).min() > 0)


def _unit(J: np.ndarray) -> np.ndarray:
    """J with a unit diagonal, which is positive definite where J is, also where parameters are of very different size."""
    diagonal = np.diag(J)
    if (diagonal <= 0).any():
        return np.diag(diagonal)
    return J / np.sqrt(np.outer(diagonal, diagonal))


class Chart:
    """Coordinates x (10,) of a body's inertia about a nominal one: J = L (1 + X) L^T, L L^T = J_0, X symmetric with the entries x
    in an orthonormal basis, so that d = |x|^2/2 to second order."""

    def __init__(self, nominal: np.ndarray) -> None:
        self.nominal = nominal
        L = np.linalg.cholesky(pseudo_inertia(nominal))
        basis = np.zeros((10, 4, 4))
        for E, (i, j) in zip(basis, _SYMMETRIC, strict=True):
            E[i, j] = E[j, i] = 1.0 if i == j else np.sqrt(0.5)
        self.basis = basis
        self.T = parameters_of(L @ basis @ L.T).T

    def parameters(self, x: np.ndarray) -> np.ndarray:
        """The ten parameters (10,)."""
        return self.nominal + self.T @ x

    def coordinates(self, W: np.ndarray) -> np.ndarray:
        """x of 1 + X = W W^T."""
        return np.einsum("iab,ab->i", self.basis, W @ W.T - np.eye(4))


def nearest(A: np.ndarray, b: np.ndarray, charts: list[Chart], weight: float) -> np.ndarray:
    """The minimum x of |A x - b|^2/2 + weight * sum of d over all bodies, by Newton's method.

    A   (n, 10 n_b + n_f) derivatives by the coordinates of the charts, and by n_f unknowns without a prior

    A body is stored as the triangular W of 1 + X = W W^T, which stays accurate near the border. The weight falls in stages,
    from one with which the nominal values are near, since Newton's method takes many steps where the minimum is near the border.
    Raises EvaluationError where there are too many.
    """
    A, b = _reduced(A, b)
    n_f = A.shape[1] - 10 * len(charts)
    at = _At([np.eye(4)] * len(charts), np.zeros(n_f))
    now = max(weight, float(b @ b))
    while True:
        at = _stage(A, b, charts, at, now, (END if now == weight else STAGE) * now)
        if now == weight:
            return at.x(charts)
        now = max(weight, FALL * now)


class _At(NamedTuple):
    """W of every body, and unknowns without a prior."""

    W: list[np.ndarray]
    free: np.ndarray

    def x(self, charts: list[Chart]) -> np.ndarray:
        return np.concatenate([*[chart.coordinates(W) for chart, W in zip(charts, self.W, strict=True)], self.free])

    def value(self, A: np.ndarray, b: np.ndarray, charts: list[Chart], weight: float) -> float:
        """The sum that is to be least."""
        d = sum(float(np.sum(W**2)) - 4 - 2 * float(np.sum(np.log(np.diag(W)))) for W in self.W)
        return 0.5 * float(np.sum((A @ self.x(charts) - b) ** 2)) + weight * d

    def moved(self, steps: list[np.ndarray], free: np.ndarray, length: float) -> _At:
        """By W V W^T of every body."""
        return _At([W @ np.linalg.cholesky(np.eye(4) + length * V) for W, V in zip(self.W, steps, strict=True)],
                   self.free + length * free)


def _stage(A: np.ndarray, b: np.ndarray, charts: list[Chart], at: _At, weight: float, end: float) -> _At:
    """The minimum with this weight, from a start; end: of the decrement squared.

    Along J = L_0 W (1 + V) W^T L_0^T the divergence has the gradient W^T W - 1 and the Hessian 1 at V = 0, so that a step is a
    linear least squares problem, with the distance to the border of order one. Steps go nine tenths of the way to it at most.
    """
    n_bodies, root = 10 * len(charts), np.sqrt(weight)
    now = at.value(A, b, charts, weight)
    for _ in range(MOST_STEPS):
        along, gradient = np.eye(A.shape[1]), np.zeros(n_bodies)
        for k, (chart, W) in enumerate(zip(charts, at.W, strict=True)):
            part = slice(10 * k, 10 * k + 10)
            along[part, part] = np.einsum("iab,jab->ij", chart.basis, W @ chart.basis @ W.T)
            gradient[part] = chart.coordinates(W.T)
        H = np.vstack([A @ along, root * np.eye(n_bodies, A.shape[1])])
        step = -np.linalg.lstsq(H, np.concatenate([A @ at.x(charts) - b, root * gradient]), rcond=None)[0]
        decrement = float(np.sum((H @ step) ** 2))
        if decrement <= end:
            return at
        parts = np.split(step[:n_bodies], len(charts))
        V = [np.tensordot(part, chart.basis, 1) for part, chart in zip(parts, charts, strict=True)]
        length = min(1.0, 0.9 / max(1e-300, *[-float(np.linalg.eigvalsh(one)[0]) for one in V]))
        while not (value := (moved := at.moved(V, step[n_bodies:], length)).value(A, b, charts, weight)) \
                <= now - 0.1 * length * decrement and length > LEAST_STEP:
            length /= 2
        if length <= LEAST_STEP:
            break
        at, now = moved, value
    # The sum decreases no more, to rounding: its own, and that of A x - b, large where data have no noise; kept is 1 + x.
    rounded = EPS * (np.abs(A) @ (1 + np.abs(at.x(charts))) + np.abs(b))
    if decrement <= ROUNDING * (1 + now) + float(np.sum(rounded**2)):
        return at
    raise EvaluationError(f"no inertial parameters found: Newton's method ended with the decrement squared {decrement:.3g}; take "
                          "a smaller spread, or nominal values nearer to the robot's")


def _reduced(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same sum of squares, but for a constant, with as many rows as columns and one."""
    R: np.ndarray = np.linalg.qr(np.column_stack([A, b])).R
    return R[:, :-1], R[:, -1]
