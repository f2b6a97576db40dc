"""A double wishbone suspension."""

from __future__ import annotations

import math

import sympy as sp

from symdyn.model.closures import Rod
from symdyn.model.joints import Revolute, Spherical
from symdyn.model.points import position
from symdyn.model.symbols import coordinates, inputs, parameters
from symdyn.model.system import System

# Where the points are in the design position, m.
_POINTS = {
    "A": (0.0, 0.35, 0.20), "B": (0.01, 0.70, 0.18), "D": (-0.02, 0.42, 0.48), "E": (-0.03, 0.66, 0.50),
    "P": (0.0, 0.45, 0.70), "Q": (0.0, 0.58, 0.20), "S": (-0.13, 0.68, 0.215), "T": (-0.12, 0.36, 0.23), "W": (0.0, 0.75, 0.32),
}


def double_wishbone() -> System:
    """A double wishbone suspension of a left front wheel, on a chassis that stands still.

    The n-frame is the chassis': x forward, y to the left, z upward. In the design position, where all coordinates are zero, the
    axes of all bodies are parallel to it. The lower arm turns about x at A by q_l (rad), the upper arm about x at D by q_u
    (rad); the upright with the wheel hangs on the lower arm by a ball joint B, psi, theta, phi (rad) being its ZYX Euler angles
    relative to that arm (psi steers). The loops are cut at the ball joint E between upright and upper arm, and at the tie
    rod from T on the chassis to S on the upright, which is massless: four constraints on five coordinates. A spring and damper
    joins P of the chassis and Q of the lower arm. It starts at rest in the design position, the spring 10 mm short.

    Input: F (N), the upward force on the wheel at its centre W. Output: W (m).
    Parameters: g (m/s^2, along -z); A_x ... W_z the points in the design position (m); of the lower arm, the upper arm and the
    upright with its wheel m_l, m_u, m_w mass (kg) and I_l, I_u about x, I_x, I_y, I_z inertia at the centre of mass (kg m^2),
    which is half way between the arm's joints, and at W; l_t length of the tie rod (m); K (N/m), C (N s/m), l0 (m) of the
    spring. The numbers are those of a middle-sized car.
    """
    q_l, q_u, psi, theta, phi = coordinates("q_l q_u psi theta phi")
    g, m_l, m_u, m_w, I_l, I_u, I_x, I_y, I_z, l_t, K, C, l0 = parameters("g m_l m_u m_w I_l I_u I_x I_y I_z l_t K C l0")
    F = inputs("F")
    at = {name: parameters(f"{name}_x {name}_y {name}_z") for name in _POINTS}

    def between(start: str, end: str) -> list[sp.Expr]:
        return [b - a for a, b in zip(at[start], at[end], strict=True)]

    system = System("double_wishbone", gravity=[0, 0, -g])
    lower = system.add_body("lower arm", mass=m_l, inertia=[I_l, I_l, I_l], com=[e / 2 for e in between("A", "B")])
    upper = system.add_body("upper arm", mass=m_u, inertia=[I_u, I_u, I_u], com=[e / 2 for e in between("D", "E")])
    upright = system.add_body("upright", mass=m_w, inertia=[I_x, I_y, I_z], com=between("B", "W"))
    system.add_joint(Revolute("A", system.ground, lower, q_l, axis=[1, 0, 0], parent_point=at["A"]))
    system.add_joint(Revolute("D", system.ground, upper, q_u, axis=[1, 0, 0], parent_point=at["D"]))
    system.add_joint(Spherical("B", lower, upright, [psi, theta, phi], parent_point=between("A", "B")))
    system.close_loop(Spherical("E", upper, upright, parent_point=between("D", "E"), child_point=between("B", "E")))
    system.close_loop(Rod("tie rod", system.ground, upright, l_t, parent_point=at["T"], child_point=between("B", "S")))
    system.add_spring_damper(system.ground, lower, at["P"], between("A", "Q"), stiffness=K, damping=C, length=l0)
    system.add_force(upright, [0, 0, F], point=between("B", "W"), name="road")
    system.add_output("W", position(upright, tuple(between("B", "W"))))
    system.defaults = {g: 9.81, m_l: 4.0, m_u: 2.5, m_w: 35.0, I_l: 0.05, I_u: 0.02, I_x: 1.0, I_y: 1.6, I_z: 1.0,
                       l_t: math.dist(_POINTS["T"], _POINTS["S"]), K: 4.5e4, C: 2.5e3,
                       l0: math.dist(_POINTS["P"], _POINTS["Q"]) + 0.01}
    system.defaults |= {symbol: value for name in _POINTS for symbol, value in zip(at[name], _POINTS[name], strict=True)}
    system.initial = {F: 0.0}
    system.duration = 2.0
    system.units = dict.fromkeys((l_t, *(e for point in at.values() for e in point)), "m")
    return system
