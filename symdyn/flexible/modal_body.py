"""The integrals of a flexible beam over its assumed modes, complete to second order in the elastic coordinates."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

SYMMETRIC = ("H2", "I0", "I1", "I2", "Me", "K", "D", "S_tip", "S")


@dataclass(frozen=True, eq=False)
class ModalBody:
    """A slender beam, clamped at the origin O of its frame, that deflects in n assumed modes.

    In the axes of the frame, with e the unit vector along the undeflected beam, the material point at the distance X
    from the clamp is at

        r(X, eta) = X e + Psi(X) eta - 1/2 e eta^T S(X) eta,      S_ij(X) = int_0^X psi_i' . psi_j' ds

    psi_i is transverse to e; S is the foreshortening, which keeps the length of a deflected beam to second order and from
    which centrifugal and gravity stiffening follow. With velocity v of O and angular velocity omega of the frame, both in
    its axes, the kinetic energy

        T = 1/2 m v.v + v . (omega x h) + v . Ct etad + 1/2 omega . I omega + omega . Cr etad + 1/2 etad . Me etad

    and the strain energy 1/2 eta . K eta are complete to second order in (eta, etad); what is left out is of third order.
    The rotary inertia of the cross sections, torsion, shear and stretching are neglected.

    m              mass, kg
    h0 (3,)        first moment of mass about O, kg m;        h(eta) = h0 + H1 eta + 1/2 eta . H2 eta
    H1 (3, n)      int Psi dm
    H2 (3, n, n)   -e int S dm; symmetric in the last two
    I0 (3, 3)      inertia about O, kg m^2;                   I(eta) = I0 + sum I1_i eta_i + 1/2 sum I2_ij eta_i eta_j
    I1 (n, 3, 3)   first derivatives by eta
    I2 (n, n, 3, 3)  second derivatives by eta, foreshortening included
    Cr0 (3, n)     int X e x Psi dm, kg m^2;                  Cr(eta) = Cr0 + sum Cr1_j eta_j, Cr = int r x dr/deta dm
    Cr1 (n, 3, n)  Cr1[j, :, i] = int psi_j x psi_i dm; foreshortening adds nothing, as it moves points along e
    Me (n, n)      int psi_i . psi_j dm;                      Ct(eta) = dh/deta = H1 + H2 eta
    K (n, n)       stiffness, N/m for modes without unit
    D (n, n)       damping: the modes of (Me, K) have the damping ratios given, and stay uncoupled
    e (3,)         direction of the undeflected beam; length, m: its length L
    Psi_tip (3, n), Theta_tip (3, n), S_tip (n, n)
                   the tip is at r(L, eta), and turned by the rotation vector Theta_tip eta = e x psi'(L) eta
    X (k,), Psi (k, 3, n), S (k, n, n)
                   stations from clamp to tip, to draw the beam with
    names (n,)     what the modes are called; name: the beam
    """

    name: str
    names: tuple[str, ...]
    length: float
    e: np.ndarray
    m: float
    h0: np.ndarray
    H1: np.ndarray
    H2: np.ndarray
    I0: np.ndarray
    I1: np.ndarray
    I2: np.ndarray
    Cr0: np.ndarray
    Cr1: np.ndarray
    Me: np.ndarray
    K: np.ndarray
    D: np.ndarray
    Psi_tip: np.ndarray
    Theta_tip: np.ndarray
    S_tip: np.ndarray
    X: np.ndarray
    Psi: np.ndarray
    S: np.ndarray

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                if field.name in SYMMETRIC:  # to the last bit, as an energy has them
                    value = (value + np.swapaxes(value, -1, -2)) / 2
                    value = (value + np.swapaxes(value, 0, 1)) / 2 if field.name == "I2" else value
                    object.__setattr__(self, field.name, value)
                value.flags.writeable = False

    @property
    def n(self) -> int:
        """The number of modes."""
        return len(self.names)

    def h(self, eta: np.ndarray) -> np.ndarray:
        """First moment of mass about O (3,), kg m."""
        return self.h0 + self.H1 @ eta + self.H2 @ eta @ eta / 2

    def Ct(self, eta: np.ndarray) -> np.ndarray:
        """dh/deta (3, n)."""
        return self.H1 + self.H2 @ eta

    def inertia(self, eta: np.ndarray) -> np.ndarray:
        """I(eta) (3, 3) about O, kg m^2."""
        return self.I0 + np.einsum("i,iab->ab", eta, self.I1) + np.einsum("i,j,ijab->ab", eta, eta, self.I2) / 2

    def Cr(self, eta: np.ndarray) -> np.ndarray:
        """Angular momentum about O per modal speed (3, n)."""
        return self.Cr0 + np.einsum("j,jai->ai", eta, self.Cr1)

    def points(self, eta: np.ndarray) -> np.ndarray:
        """Where the stations are (k, 3), m, in the frame."""
        return np.outer(self.X, self.e) + self.Psi @ eta - np.outer(self.S @ eta @ eta / 2, self.e)

    def kinetic_energy(self, v: np.ndarray, omega: np.ndarray, eta: np.ndarray, etad: np.ndarray) -> float:
        """T, J, at velocity v of O and angular velocity omega of the frame, both in its axes."""
        momentum = np.cross(omega, self.h(eta)) + self.Ct(eta) @ etad
        turning = omega @ (self.inertia(eta) @ omega / 2 + self.Cr(eta) @ etad)
        return float(self.m * v @ v / 2 + v @ momentum + turning + etad @ self.Me @ etad / 2)
