"""Rotations by Euler angles: what they give for R, angular velocity and its derivative, and their rates from omega."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from symdyn.model.joints.base import turn
from symdyn.model.orientation import EulerAngles
from symdyn.spatial.vectors import cross, identity, zeros

# Square of the sine or cosine that the rates are divided by: below, more than half of their digits are lost.
LOCK = Fraction(1, 10**16)


def angles_rotation(algebra: Any, orientation: EulerAngles, s: Sequence[Any]) -> np.ndarray:
    """R = R_1(s_1) R_2(s_2) R_3(s_3), (3, 3)."""
    R = identity()
    for axis, angle in zip(orientation.axes, s, strict=True):
        R = R @ turn(algebra, identity()[axis], angle)
    return R


def angles_motion(algebra: Any, orientation: EulerAngles, s: Sequence[Any],
                  sd: Sequence[Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """R (3, 3), omega per rate of the angles (3, 3), and what is left of its derivative at constant rates (3,), child axes."""
    # Three revolute joints in a row; omega and its bias are carried from each to the next.
    R, S, omega, bias = identity(), zeros(3, 3), zeros(3), zeros(3)
    for k, axis in enumerate(orientation.axes):
        e = identity()[axis]
        R_k = turn(algebra, e, s[k])
        R = R @ R_k
        S = R_k.T @ S
        S[:, k] = e
        carried = R_k.T @ omega
        bias = R_k.T @ bias + cross(carried, e * sd[k])
        omega = carried + e * sd[k]
    return R, S, bias


def angles_rates(algebra: Any, orientation: EulerAngles, name: str, s: Sequence[Any], omega: Sequence[Any]) -> list[Any]:
    """Derivatives of the angles of joint `name` from omega (3,), child axes.

    With the axes (i, j, k), the remaining axis l and omega seen before the third rotation, x = R_3 omega, it is
    x = a_dot (cos b e_i +- sin b e_l) + b_dot e_j + c_dot e_k, + if (i, j, l) is right-handed, which is solved for the
    rates by dividing by cos b (k = l) or sin b (k = i).
    """
    i, j, k = orientation.axes
    l = 3 - i - j
    sign = 1 if (j - i) % 3 == 1 else -1
    x = turn(algebra, identity()[k], s[2]) @ np.array(list(omega), dtype=object)
    sin, cos = algebra.sin(s[1]), algebra.cos(s[1])
    along, divisor, rest = (x[i], cos, sign * sin) if k == l else (sign * x[l], sin, cos)
    # A divisor may be negative, its square may not: what a check on the sign can distinguish from zero.
    square = algebra.divisor(divisor * divisor, LOCK, f"the {orientation.sequence} angles of joint {name} are at gimbal lock, "
                             "where no rates of theirs give its angular velocity (take another sequence, or EulerParameters)")
    a_dot = along * (divisor / square)
    return [a_dot, x[j], x[k] - rest * a_dot]
