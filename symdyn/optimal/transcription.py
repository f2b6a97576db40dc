"""Transcription of a motion to numbers: points on a mesh, defects linear in states and rates, and the polynomials between points.

With states X at the points of the mesh and F, the rates times the duration at the points of the field,

    E X = W F,      cost = sum of B F_cost

are the defects and the quadrature. Both are constant on a mesh, so that all derivatives are those of F. All times are shares of
the duration, from 0 to 1.

hermite_simpson   separated form: nodes and middles, of order 4. Source: Betts, Practical Methods for Optimal Control and
                  Estimation Using Nonlinear Programming, 2nd ed., section 4.6; Kelly, An introduction to trajectory optimization,
                  SIAM Review 59 (2017), section 4
radau             polynomials of a degree d whose rates hold at the d points of Radau IIA in each interval, its end being one: of
                  order 2 d - 1. Source: Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.5; Garg,
                  Patterson, Hager, Rao, Benson and Huntington, Automatica 46 (2010)
shooting          the classical method of Runge and Kutta, a number of steps in each interval
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.polynomial import Polynomial, legendre
from scipy.interpolate import PPoly

# Points of Gauss in an interval at which the error between its points is measured.
GAUSS = 6


@dataclass(frozen=True, eq=False)
class Transcription:
    """Matrices of a mesh.

    breaks     (K + 1,) ends of the intervals, shares of the duration
    nodes      (N,) shares at which there are states; ends: indices of those at the breaks, (K + 1,)
    samples    (M,) shares at which there are inputs, the last one those at the end
    at_state, at_inputs   (P,), (P, k) which state and which inputs the points of the field depend on; shares (P,) of these
    E, W, B    the defects and, (K, P), the quadrature of each interval; share (R,): when a defect is
    corrected  (R,) index of the interval at whose end constraints are kept by a correction of this defect, -1 for others
    rates      (r, M) matrix of d inputs/d share; joints (j, M): jumps of the inputs between intervals
    order      of the errors that are measured between points; degree: of Radau's polynomials
    of_inputs, of_states   from U, and from X and the rates F at the points, to polynomials over shares of the duration
    """

    kind: str
    breaks: np.ndarray
    nodes: np.ndarray
    ends: np.ndarray
    samples: np.ndarray
    at_state: np.ndarray
    at_inputs: np.ndarray
    shares: np.ndarray
    E: sp.csr_matrix
    W: sp.csr_matrix
    B: sp.csr_matrix
    share: np.ndarray
    corrected: np.ndarray
    rates: sp.csr_matrix
    joints: sp.csr_matrix
    order: int
    degree: int
    of_inputs: Callable[[np.ndarray], PPoly]
    of_states: Callable[[np.ndarray, np.ndarray], PPoly]

    @property
    def n_intervals(self) -> int:
        return len(self.breaks) - 1

    @cached_property
    def b(self) -> np.ndarray:
        """The weights of the whole quadrature, (P,)."""
        return np.asarray(self.B.sum(axis=0)).ravel()


def hermite_simpson(breaks: np.ndarray) -> Transcription:
    """See above; the inputs are parabolas through nodes and middles, the states cubic."""
    K, h = len(breaks) - 1, np.diff(breaks)
    N = 2 * K + 1
    nodes = np.empty(N)
    nodes[0::2], nodes[1::2] = breaks, (breaks[1:] + breaks[:-1]) / 2
    k, middle = np.arange(K), 2 * np.arange(K) + 1
    E, W = sp.lil_matrix((2 * K, N)), sp.lil_matrix((2 * K, N))
    E[2 * k, middle], E[2 * k, middle - 1], E[2 * k, middle + 1] = 1, -0.5, -0.5
    W[2 * k, middle - 1], W[2 * k, middle + 1] = h / 8, -h / 8
    E[2 * k + 1, middle + 1], E[2 * k + 1, middle - 1] = 1, -1
    W[2 * k + 1, middle - 1], W[2 * k + 1, middle], W[2 * k + 1, middle + 1] = h / 6, 4 * h / 6, h / 6
    rates = sp.lil_matrix((2 * K, N))
    for row, weights in ((2 * k, (-3, 4, -1)), (2 * k + 1, (1, -4, 3))):
        for shift, weight in zip((-1, 0, 1), weights, strict=True):
            rates[row, middle + shift] = weight / h
    corrected = np.full(2 * K, -1)
    corrected[1::2] = k

    def of_inputs(U: np.ndarray) -> PPoly:
        return PPoly(through(np.array([0.0, 0.5, 1.0]), U[_thirds(K)], h), breaks)

    def of_states(X: np.ndarray, F: np.ndarray) -> PPoly:
        slopes = through(np.array([0.0, 0.5, 1.0]), F[_thirds(K)], h)
        whole = PPoly(slopes, breaks).antiderivative()
        whole.c[-1] = X[0:-1:2]
        return whole

    return Transcription("hermite-simpson", breaks, nodes, np.arange(0, N, 2), nodes, np.arange(N), np.arange(N)[:, None], nodes,
                         E.tocsr(), W.tocsr(), W.tocsr()[1::2], nodes[1:], corrected, rates.tocsr(), sp.csr_matrix((0, N)), 4,
                         3, of_inputs, of_states)


def radau(breaks: np.ndarray, degree: int) -> Transcription:
    """See above; the inputs are polynomials through the d points, of degree d - 1, that may jump between intervals."""
    K, h, d = len(breaks) - 1, np.diff(breaks), degree
    c, weights = radau_points(d)
    local = np.concatenate([[0.0], c])
    nodes = np.concatenate([[breaks[0]], (breaks[:-1, None] + h[:, None] * c).ravel()])
    N, P = K * d + 1, K * d
    D = _differences(local)[1:]
    rows, columns, values = [], [], []
    for k in range(K):
        r, s = np.meshgrid(np.arange(d), np.arange(d + 1), indexing="ij")
        rows.append((k * d + r).ravel())
        columns.append((k * d + s).ravel())
        values.append(D.ravel())
    E = sp.csr_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), (P, N))
    W = sp.diags(np.repeat(h, d)).tocsr()
    B = sp.kron(sp.diags(h), weights[None, :]).tocsr()
    slopes, start = _differences(c), _values(c, 0.0)
    rates = sp.block_diag([slopes / length for length in h]).tocsr()
    joints = sp.lil_matrix((K - 1, P))
    for k in range(1, K):
        joints[k - 1, k * d:(k + 1) * d] = start
        joints[k - 1, k * d - 1] = -1
    corrected = np.full(P, -1)
    corrected[d - 1::d] = np.arange(K)

    def of_inputs(U: np.ndarray) -> PPoly:
        return PPoly(through(c, U.reshape(K, d, -1), h), breaks)

    def of_states(X: np.ndarray, F: np.ndarray) -> PPoly:
        return PPoly(through(local, X[(np.arange(K) * d)[:, None] + np.arange(d + 1)], h), breaks)

    points = np.arange(P)
    return Transcription("radau", breaks, nodes, np.arange(0, N, d), nodes[1:], points + 1, points[:, None], nodes[1:], E, W, B,
                         nodes[1:], corrected, rates, joints.tocsr(), d + 1, d, of_inputs, of_states)


def shooting(breaks: np.ndarray, hold: bool) -> Transcription:
    """See above; the inputs are constant in each interval (hold), or straight between the breaks."""
    K, h = len(breaks) - 1, np.diff(breaks)
    k = np.arange(K)
    E = sp.csr_matrix((np.ones(K), (k, k + 1)), (K, K + 1)) - sp.csr_matrix((np.ones(K), (k, k)), (K, K + 1))
    M = K if hold else K + 1
    samples = breaks[:-1] if hold else breaks
    at_inputs = k[:, None] if hold else np.column_stack([k, k + 1])
    rates = sp.csr_matrix((0, M)) if hold else sp.csr_matrix(
        (np.concatenate([-1 / h, 1 / h]), (np.concatenate([k, k]), np.concatenate([k, k + 1]))), (K, M))

    def of_inputs(U: np.ndarray) -> PPoly:
        return PPoly(U[None] if hold else np.array([np.diff(U, axis=0) / h[:, None], U[:-1]]), breaks)

    def of_states(X: np.ndarray, F: np.ndarray) -> PPoly:
        raise NotImplementedError("the states of shooting are those of its steps")

    whole = sp.identity(K, format="csr")
    return Transcription("shooting", breaks, breaks, np.arange(K + 1), samples, k, at_inputs, breaks[:-1], E.tocsr(), whole,
                         whole, breaks[1:], k, rates, sp.csr_matrix((0, M)), 4, 1, of_inputs, of_states)


def radau_points(d: int) -> tuple[np.ndarray, np.ndarray]:
    """The d points of Radau IIA in [0, 1], the last one 1, and the weights of their quadrature, exact up to degree 2 d - 2."""
    of = np.zeros(d + 1)
    of[d - 1:] = [-1.0, 1.0]  # P_d - P_(d-1) vanishes at these points
    roots = np.sort(legendre.legroots(of).real)
    roots[-1] = 1.0
    for _ in range(3):  # Newton's steps, for the last digits
        inner = roots[:-1]
        roots[:-1] = inner - legendre.legval(inner, of) / legendre.legval(inner, legendre.legder(of))
    c = (roots + 1) / 2
    powers = np.arange(d)
    return c, np.linalg.solve(c[None, :] ** powers[:, None], 1 / (powers + 1.0))


def _basis(points: np.ndarray) -> list[Polynomial]:
    """The polynomials of Lagrange through points."""
    result = []
    for j, one in enumerate(points):
        others = np.delete(points, j)
        result.append(Polynomial(np.atleast_1d(np.poly(others))[::-1]) / np.prod(one - others))
    return result


def _differences(points: np.ndarray) -> np.ndarray:
    """The matrix that takes values at points to the derivatives there of the polynomial through them."""
    return np.array([p.deriv()(points) for p in _basis(points)]).T


def _values(points: np.ndarray, at: float) -> np.ndarray:
    """Weights of values at points in the value of the polynomial through them."""
    return np.array([p(at) for p in _basis(points)])


def through(points: np.ndarray, values: np.ndarray, h: np.ndarray) -> np.ndarray:
    """Coefficients as PPoly has them, (d, K, n), of polynomials through values (K, d, n) at points of each interval."""
    basis = np.array([np.pad(p.coef, (0, len(points) - len(p.coef))) for p in _basis(points)])  # (d, powers)
    result = np.einsum("kjn,jp->pkn", values, basis) / h[None, :, None] ** np.arange(len(points))[:, None, None]
    return np.ascontiguousarray(result[::-1])


def _thirds(K: int) -> np.ndarray:
    """Indices of the start, middle and end of each interval, (K, 3)."""
    return 2 * np.arange(K)[:, None] + np.arange(3)


def gauss_points(breaks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shares (K, GAUSS) in each interval and the weights of their quadrature there, (K, GAUSS)."""
    x, w = legendre.leggauss(GAUSS)
    h = np.diff(breaks)[:, None]
    return breaks[:-1, None] + h * (x + 1) / 2, h * w / 2
