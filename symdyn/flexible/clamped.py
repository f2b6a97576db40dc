"""Small vibrations of a modal body whose root is held or turns at a constant speed, with a rigid body on its tip."""

from __future__ import annotations

from typing import Any

import numpy as np

from symdyn.flexible.integrals import modes_of
from symdyn.flexible.modal_body import ModalBody


def clamped(body: ModalBody, *, tip_mass: float = 0.0, tip_com: Any = (0, 0, 0), tip_inertia: Any = None,
            omega: Any = (0, 0, 0), gravity: Any = (0, 0, 0)) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M, C, K of M etadd + C etad + K eta = f, linear about the undeflected beam; C has damping and gyroscopic terms.

    tip_mass     mass of a rigid body fixed to the tip, kg
    tip_com      its centre of mass from the tip, m, in the axes of the body
    tip_inertia  its inertia about its centre of mass (3, 3), kg m^2
    omega        angular velocity of the root about its origin, rad/s, in the axes of the body; constant in them
    gravity      m/s^2, in the axes of the body; constant in them, so that it is along omega or omega is zero

    Centrifugal and gravity stiffening come from the second derivatives I2 and H2; the tip turns by Theta_tip eta, to
    second order as that rotation vector says.
    """
    c, w, g = (np.asarray(v, dtype=float) for v in (tip_com, omega, gravity))
    J = np.zeros((3, 3)) if tip_inertia is None else np.asarray(tip_inertia, dtype=float)
    Theta, W = body.Theta_tip, _skew(body.Theta_tip.T)
    p0, P1 = body.length * body.e + c, body.Psi_tip + np.cross(Theta, c, axisa=0, axisc=0)
    WW = np.einsum("iab,jbc->ijac", W, W)
    WW = (WW + WW.transpose(1, 0, 2, 3)) / 2  # second derivatives of the rotation matrix
    P2 = WW @ c - body.S_tip[:, :, None] * body.e
    I2 = body.I2 + tip_mass * (_inertia(P1.T[:, None], P1.T[None]) + _inertia(p0, P2)) + _both(WW @ J)
    I2 = I2 + _both(np.einsum("iab,bc,jdc->ijad", W, J, W))
    momentum = body.Cr1 + np.einsum("jab,bi->jai", W @ J + J @ W.transpose(0, 2, 1) + J @ W / 2, Theta)
    momentum = momentum + tip_mass * np.cross(P1.T[:, None], P1.T[None]).transpose(0, 2, 1)
    coupling = np.einsum("a,jai->ij", w, momentum)  # parts symmetric in i and j are left out, they fall out below
    M = body.Me + tip_mass * P1.T @ P1 + Theta.T @ J @ Theta
    K = body.K - I2 @ w @ w / 2 - np.einsum("a,aij->ij", g, body.H2) - tip_mass * P2 @ g
    return M, body.D + coupling - coupling.T, K


def frequencies(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Natural frequencies without damping and gyroscopic terms, rad/s, rising; negative where the beam buckles."""
    squares = modes_of(M, K)[0]
    return np.sign(squares) * np.sqrt(np.abs(squares))


def _inertia(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Second derivatives of r.r 1 - r r^T in the directions a and b."""
    outer = a[..., :, None] * b[..., None, :]
    return 2 * (a * b).sum(-1)[..., None, None] * np.eye(3) - _both(outer)


def _both(A: np.ndarray) -> np.ndarray:
    return A + A.swapaxes(-1, -2)


def _skew(v: np.ndarray) -> np.ndarray:
    """The matrices (n, 3, 3) of v x, for the rows v."""
    return np.cross(v[:, None, :], np.eye(3)).transpose(0, 2, 1)
