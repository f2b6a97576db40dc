"""The integrals of a modal body over a table and a basis of shape functions."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from scipy.linalg import eigh

from symdyn.flexible.modal_body import ModalBody
from symdyn.flexible.table import Table

AXES = {"x": "yzx", "y": "zxy", "z": "xyz"}  # the two transverse directions, then the beam's: right-handed


class Functions(Protocol):
    """Functions of x (m) in the two transverse directions, piecewise polynomials between `breaks`."""

    n: int

    @property
    def breaks(self) -> np.ndarray: ...

    @property
    def degree(self) -> int: ...

    def __call__(self, x: np.ndarray, derivative: int = 0) -> np.ndarray: ...


def integrate(table: Table, basis: Functions, axis: str, damping: np.ndarray, integration: str, X: np.ndarray, name: str,
              names: tuple[str, ...]) -> ModalBody:
    """The modal body; X (k,) are the stations to draw it with, damping (n,) the ratios in the order of the frequencies."""
    T = np.eye(3)[:, ["xyz".index(a) for a in AXES[axis]]]  # columns: transverse 1, transverse 2, along the beam
    e, T = T[:, 2], T[:, :2]
    breaks = _merged(np.concatenate([table.x, basis.breaks, X]), table.length)
    # Polynomials of degree 2 d + 1 at most, of mass and shapes as of foreshortening; sines of the twist need some more points.
    x, w = _gauss(breaks, basis.degree + 2 + (5 if table.twist.any() else 0))
    slopes = _columns(basis(x, 1))
    beyond, moment = table.outboard(x)
    S_m, S_mX = (_gram(slopes, np.repeat(w * f, 2)) for f in (beyond, moment))
    S = _cumulated(slopes, w, np.searchsorted(x, X))
    if integration == "stations":
        x, w, lever = _stations(table.x)
    else:
        lever = w * x
    V, mass = basis(x), table.mass_at(x)
    m, first, second = (w * mass).sum(), (w * mass * x).sum(), (lever * mass * x).sum()
    P = T @ np.einsum("p,pai->ai", w * mass, V)
    Q = T @ np.einsum("p,pai->ai", lever * mass, V)
    PP = np.einsum("xa,yb,aibj->ijxy", T, T, _pairs(V, w * mass))  # int psi_i psi_j^T dm
    Me = _without_rounding(np.einsum("ijxx->ij", PP))
    K = _without_rounding(_stiffness(table, basis(x, 2), x, w))
    across = np.eye(3) - np.outer(e, e)
    I1 = -np.einsum("x,yi->ixy", e, Q)
    I2 = np.einsum("ij,xy->ijxy", Me, np.eye(3)) - np.einsum("ij,xy->ijxy", S_mX, across)
    psi = basis(X)
    tip = T @ basis(np.array([table.length]), 1)[0]
    return ModalBody(
        name=name, names=names, length=table.length, e=e, m=float(m), h0=first * e, H1=P,
        H2=-np.einsum("x,ij->xij", e, S_m), I0=second * across, I1=I1 + I1.transpose(0, 2, 1),
        I2=2 * I2 - PP - PP.transpose(0, 1, 3, 2),
        Cr0=np.cross(e, Q, axisb=0, axisc=0), Cr1=_crossed(PP), Me=Me, K=K, D=_damping(Me, K, damping),
        Psi_tip=T @ basis(np.array([table.length]))[0], Theta_tip=np.cross(e, tip, axisb=0, axisc=0), S_tip=S[-1],
        X=X, Psi=np.einsum("xa,pai->pxi", T, psi), S=S)


def _merged(x: np.ndarray, length: float) -> np.ndarray:
    """The breaks in order, without those that rounding made twice."""
    x = np.unique(np.clip(x, 0.0, length))
    kept = x[np.concatenate([[True], np.diff(x) > 1e-9 * length])]
    kept[-1] = length
    return kept


def _gauss(breaks: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and weights of Gauss-Legendre between all breaks."""
    points, weights = np.polynomial.legendre.leggauss(count)
    half = np.diff(breaks)[:, None] / 2
    return ((breaks[:-1, None] + half) + half * points).ravel(), (half * weights).ravel()


def _stations(x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stations with the weights of int f dx and of int x f dx for functions f that are linear between them."""
    h = np.diff(x)
    w, lever = np.zeros(x.size), np.zeros(x.size)
    w[:-1] += h / 2
    w[1:] += h / 2
    lever[:-1] += h * (x[:-1] / 2 + h / 6)
    lever[1:] += h * (x[:-1] / 2 + h / 3)
    return x, w, lever


def _gram(A: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Sum of w A_i A_j over the rows, symmetric to the last digit."""
    product = A.T @ (w[:, None] * A)
    return (product + product.T) / 2


def _columns(V: np.ndarray) -> np.ndarray:
    return V.reshape(-1, V.shape[2])


def _pairs(V: np.ndarray, w: np.ndarray) -> np.ndarray:
    """(2, n, 2, n) sum of w V_ai V_bj."""
    flat = V.reshape(V.shape[0], -1)
    return _gram(flat, w).reshape(V.shape[1:] * 2)


def _cumulated(slopes: np.ndarray, w: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """S (k, n, n) at stations before which there are `ends` (k,) points of integration."""
    weights, first = np.repeat(w, 2), np.zeros((1, slopes.shape[1], slopes.shape[1]))
    parts = [_gram(slopes[2 * a : 2 * b], weights[2 * a : 2 * b]) for a, b in pairwise(ends)]
    return np.cumsum(np.concatenate([first, np.array(parts)]), axis=0)


def _stiffness(table: Table, curvature: np.ndarray, x: np.ndarray, w: np.ndarray) -> np.ndarray:
    """int EI_1 k_1 k_1 + EI_2 k_2 k_2, curvatures along the principal axes."""
    c, s = np.cos(table.twist_at(x)), np.sin(table.twist_at(x))
    turned = np.stack([np.stack([c, s], -1), np.stack([-s, c], -1)], 1) @ curvature
    k = _columns(turned)
    return _gram(k, (w[:, None] * table.EI_at(x)).ravel())


def _crossed(PP: np.ndarray) -> np.ndarray:
    """Cr1[j, :, i] = int psi_j x psi_i dm."""
    out: Any = np.empty((PP.shape[0], 3, PP.shape[1]))
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        out[:, k, :] = PP[:, :, a, b] - PP[:, :, b, a]
    return out


def modes_of(M: np.ndarray, K: np.ndarray, count: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    """omega^2 rising, rad^2/s^2, and the modes as columns with phi . M phi = 1, of K phi = omega^2 M phi; all or the first."""
    size = np.sqrt(np.diag(M))  # scaled to a unit diagonal, so that modes of different units can stand next to each other
    part = None if count is None else [0, count - 1]
    values, vectors = eigh(K / np.outer(size, size), M / np.outer(size, size), subset_by_index=part)
    return values, vectors / size[:, None]


def _damping(Me: np.ndarray, K: np.ndarray, ratios: np.ndarray) -> np.ndarray:
    """D that gives the modes of (Me, K) these ratios and leaves them uncoupled."""
    if not ratios.any():
        return np.zeros_like(K)
    squares, modes = modes_of(Me, K)
    return _without_rounding(_gram((Me @ modes).T, 2 * ratios * np.sqrt(np.maximum(squares, 0))))


def _without_rounding(A: np.ndarray) -> np.ndarray:
    """With zeros where modes are uncoupled in all but rounding, so that nothing is computed of them."""
    size = np.sqrt(np.diag(A))
    return np.where(np.abs(A) > 1e-14 * np.outer(size, size), A, 0.0)
