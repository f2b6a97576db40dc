"""Newton's and Euler's equations of an arm in 3-vectors, by differentiating positions: no spatial vectors, no recursion.

Proofs of the errata of chapters 5.7 and 5.8.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy as sp

from symdyn.frames.product import times
from symdyn.frames.rates import differentiated
from symdyn.lecture.propagation_arms import Arm, multiplied_out

_ABOUT: dict[str, Callable[[Any], sp.Matrix]] = {"x": sp.rot_axis1, "y": sp.rot_axis2, "z": sp.rot_axis3}
_ALONG = sp.Matrix([1, 0, 0])


class Newton:
    """nR_bi and the positions of O_i and G_i as functions of the angles, and what follows from them by differentiation."""

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self.R: list[sp.Matrix] = []
        self.r_O, self.r_G = [sp.zeros(3, 1)], []
        R = sp.eye(3)
        for k, (axis, q) in enumerate(zip(arm.axes, arm.q), start=1):
            R = times(R, _ABOUT[axis](q).T)
            self.R.append(R)
            self.r_G.append(self.r_O[-1] + R * _ALONG * arm.parameter("lc#", k))
            self.r_O.append(self.r_O[-1] + R * _ALONG * arm.parameter("l#", k))

    def rate(self, value: sp.Matrix) -> sp.Matrix:
        """Derivative by time, by the chain rule."""
        return sp.Matrix(*value.shape, differentiated(value))

    def velocity(self, link: int) -> sp.Matrix:
        """(6, 1) angular velocity, and velocity of O_i, both in link axes."""
        R = self.R[link - 1]
        W = times(R.T, self.rate(R))
        return sp.Matrix([W[2, 1], W[0, 2], W[1, 0], *times(R.T, self.rate(self.r_O[link - 1]))])

    def acceleration(self, link: int) -> sp.Matrix:
        """(6, 1) rates of change of the components of the velocity; weights as an acceleration of the base."""
        upward = self.R[link - 1].T * sp.Matrix(self.arm.a_0[3:])
        return self.arm.put(self.rate(self.velocity(link)) + sp.Matrix([0, 0, 0, *upward]))

    def at_center(self, link: int) -> sp.Matrix:
        """(6, 1) moment about G_i and force that move the body, link axes: I omega_dot + omega x I omega, m (a_G - g)."""
        R, I = self.R[link - 1], self.arm.I_Gi(link)
        omega = sp.Matrix(self.velocity(link)[:3])
        moment = times(I, self.rate(omega)) + omega.cross(times(I, omega))
        a_G = self.rate(self.rate(self.r_G[link - 1])) + sp.Matrix(self.arm.a_0[3:])
        return self.arm.put(sp.Matrix([*moment, *times(R.T, a_G * self.arm.parameter("m#", link))]))

    def on_body(self, link: int) -> sp.Matrix:
        """(6, 1) the same with the moment about O_i."""
        wrench = self.at_center(link)
        force = sp.Matrix(wrench[3:])
        moment = sp.Matrix(wrench[:3]) + sp.Matrix(self.arm.r_G(link)).cross(force)
        return sp.Matrix([*moment, *force]).applyfunc(multiplied_out)

    def through_joint(self, link: int) -> sp.Matrix:
        """(6, 1) moment about O_i and force through the joint, link axes: what moves the body and all outwards of it."""
        total = self.on_body(link)
        for k in range(link + 1, len(self.R) + 1):
            turn = times(self.R[link - 1].T, self.R[k - 1])
            arm = self.arm.put(times(self.R[link - 1].T, self.r_O[k - 1] - self.r_O[link - 1]))
            wrench = self.on_body(k)
            force = self.arm.put(turn) * sp.Matrix(wrench[3:])
            moment = self.arm.put(turn) * sp.Matrix(wrench[:3]) + arm.cross(force)
            total += sp.Matrix([*moment, *force])
        return total.applyfunc(multiplied_out)
