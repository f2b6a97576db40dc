"""Flexible bodies in a tree: what their elastic coordinates add to the inertia, the forces and the energy of rigid links.

The undeformed beam is part of the link that its clamped end belongs to. These quantities depend on eta: from the kinetic energy
of ModalBody, with the momenta P = m v + omega x h + Ct eta_dot, L = I omega + h x v + Cr eta_dot and
pi = Ct^T v + Cr^T omega + Me eta_dot, the equations are P_dot + omega x P = f, L_dot + omega x L + v x P = n and
pi_dot - dT/deta = Q (Boltzmann and Hamel), written with the acceleration a of the clamped end.
Source: Shabana, Dynamics of Multibody Systems, chapter 5; Schwertassek and Wallrapp, Dynamik flexibler Mehrkoerpersysteme,
chapter 6.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from symdyn.flexible.modal_body import ModalBody
from symdyn.formulation.trees.link import LinkMotion, Wrench, inertial_wrench
from symdyn.model.joints.modal import exactly
from symdyn.spatial.inertia import Inertia
from symdyn.spatial.rotation import rotated_symmetric
from symdyn.spatial.vectors import cross, dot, identity, inner, zeros


@dataclass(frozen=True)
class FlexibleLink:
    """One flexible body, in the axes of the link that carries its clamped end.

    link      number of the link at its free end, whose joint has the elastic coordinates; root: of the link at its clamped
              end, or GROUND
    R, p      pose of the clamped end in that link; speeds: indices of eta_dot among the joint speeds
    eta, eta_dot   (n,)
    stiffness, damping   (n, n)
    """

    link: int
    root: int
    R: np.ndarray
    p: np.ndarray
    speeds: range
    eta: np.ndarray
    eta_dot: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    beam: ModalBody

    # -- integrals over the deflected beam, about its clamped end

    @cached_property
    def H2(self) -> np.ndarray:
        return np.tensordot(self.R, exactly(self.beam.H2), 1)

    @cached_property
    def Ct(self) -> np.ndarray:
        """dh/deta, (3, n)."""
        return self.R @ exactly(self.beam.H1) + self.H2 @ self.eta

    @cached_property
    def h(self) -> np.ndarray:
        """First moment of mass less that of the straight beam, (3,)."""
        return self.R @ (exactly(self.beam.H1) @ self.eta) + (self.H2 @ self.eta) @ self.eta / 2

    @cached_property
    def slopes(self) -> list[np.ndarray]:
        """dI/deta_i, (3, 3) each."""
        I1, I2 = exactly(self.beam.I1), exactly(self.beam.I2)
        return [rotated_symmetric(self.R, I1[i] + np.tensordot(self.eta, I2[i], 1)) for i in range(self.beam.n)]

    @cached_property
    def I(self) -> np.ndarray:  # noqa: E743 the letter of the inertia everywhere
        """Inertia less that of the straight beam, (3, 3)."""
        I1, I2 = exactly(self.beam.I1), exactly(self.beam.I2)
        total = zeros(3, 3)
        for i, eta in enumerate(self.eta):
            half = np.tensordot(self.eta, I2[i], 1) / 2
            total = total + rotated_symmetric(self.R, I1[i] + half) * eta
        return total

    @cached_property
    def Cr1(self) -> np.ndarray:
        """dCr[:, i]/deta_j, (j, 3, i)."""
        return np.tensordot(self.R, exactly(self.beam.Cr1), (1, 1)).transpose(1, 0, 2)

    @cached_property
    def Cr(self) -> np.ndarray:
        """Angular momentum by eta_dot, (3, n)."""
        return self.R @ exactly(self.beam.Cr0) + np.tensordot(self.eta, self.Cr1, 1)

    @cached_property
    def Me(self) -> np.ndarray:
        return exactly(self.beam.Me)

    # -- what the recursions take

    @property
    def inertia(self) -> Inertia:
        """Change of the link's inertia by the deflection, about the link's origin."""
        return Inertia(0, self.h, self.I).moved(identity(), self.p)

    def coupling(self, column: int) -> Wrench:
        """Force and moment about the link's origin by eta_ddot of one mode."""
        f = self.Ct[:, column]
        return f, self.Cr[:, column] + cross(self.p, f)

    def inertial_forces(self, motion: LinkMotion, eta_ddot: np.ndarray) -> tuple[Wrench, np.ndarray]:
        """Force and moment about the link's origin, and forces along the elastic coordinates (n,), that the motion of the link
        and eta_ddot need beyond those of the straight beam."""
        omega, alpha, a, rate = motion.omega, motion.alpha, motion.at(self.p), self.eta_dot
        here = LinkMotion(omega, alpha, a, motion.U, motion.products)
        f, n = inertial_wrench(Inertia(0, self.h, self.I), here)
        h_dot = self.Ct @ rate
        f = f + 2 * cross(omega, h_dot) + self.Ct @ eta_ddot + (self.H2 @ rate) @ rate
        I_dot = sum((slope * v for slope, v in zip(self.slopes, rate, strict=True)), zeros(3, 3))
        turning = np.tensordot(rate, self.Cr1, 1)
        n = n + I_dot @ omega + cross(omega, self.Cr @ rate) + self.Cr @ eta_ddot + turning @ rate
        along = self.Ct.T @ a + self.Cr.T @ alpha + self.Me @ eta_ddot
        for i, slope in enumerate(self.slopes):
            gyroscopic = dot(omega, turning[:, i] - self.Cr1[i] @ rate)
            along[i] = along[i] + gyroscopic - dot(omega, slope @ omega) / 2
        return (f, n + cross(self.p, f)), along

    def weight(self, g: np.ndarray) -> tuple[Wrench, np.ndarray]:
        """Force and moment of gravity g (3,), link axes, about the link's origin, and along the elastic coordinates (n,)."""
        return (zeros(3), cross(self.h, g)), self.Ct.T @ g

    def kinetic_energy(self, omega: np.ndarray, v: np.ndarray) -> Any:
        """Change of it by the deflection, J, for a twist of the link."""
        v = v + cross(omega, self.p)
        momentum = cross(omega, self.h) + self.Ct @ self.eta_dot
        turning = self.I @ omega / 2 + self.Cr @ self.eta_dot
        return dot(v, momentum) + dot(omega, turning) + inner(self.eta_dot, self.Me @ self.eta_dot) / 2

    def strain_energy(self) -> Any:
        """1/2 eta . K eta, J."""
        return inner(self.eta, self.stiffness @ self.eta) / 2
