"""Chapter 4.1: the arm of two links in the plane; position and velocity of its end effector O_3, angular velocities."""

from __future__ import annotations

from functools import cache

import sympy as sp
from sympy import cos, sin

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, proofs

theta_1, theta_2 = sd.coordinates("theta_b1/n theta_b2/b1")
# Components of b1_r_O2/O1 and b2_r_O3/O2; the links may have any direction in their frames.
r_1 = sp.Matrix([sp.Symbol(f"r_O2/O1,{axis}") for axis in "xyz"])
r_2 = sp.Matrix([sp.Symbol(f"r_O3/O2,{axis}") for axis in "xyz"])
k = sp.Matrix([0, 0, 1])

# As printed.
R_1 = sp.Matrix([[cos(theta_1), -sin(theta_1), 0], [sin(theta_1), cos(theta_1), 0], [0, 0, 1]])
R_12 = sp.Matrix([[cos(theta_2), -sin(theta_2), 0], [sin(theta_2), cos(theta_2), 0], [0, 0, 1]])
omega_1 = k * theta_1.dot
omega_2 = k * theta_1.dot + k * theta_2.dot


def arm() -> tuple[sd.Frame, sd.Frame, sd.Frame]:
    """The frames n, b_1 and b_2; the origin of b_2 is O_2."""
    n = sd.Frame("n")
    b1 = n.frame("b_1", rotation=sd.rotation.about("Z", theta_1))
    return n, b1, b1.frame("b_2", rotation=sd.rotation.about("Z", theta_2), origin=r_1)


def _position() -> list[Formula]:
    n, b1, b2 = arm()
    O_3 = b2.point("O_3", r_2).position(of=n, components=n)
    from_O_2 = O_3 - b1.point("O_2", r_1).position(of=n, components=n)
    return [
        Formula("R of b1", R_1, b1.rotation(n), line=5802, also=(5824, 5850, 5876, 5896, 5918), latex=r"{}^nR_{b_1}"),
        Formula("R of b2 in b1", R_12, b2.rotation(b1), line=5804, also=(5826, 5852, 5878, 5898, 5920), latex=r"{}^{b_1}R_{b_2}"),
        Formula("R of b2", R_1 * R_12, b2.rotation(n), line=5806, also=(5880, 5900, 5922), latex=r"{}^nR_{b_2}"),
        Formula("O3, sum of two links", R_1 * r_1 + from_O_2, O_3, line=5808, latex=r"{}^nr_{O_3/E}"),
        Formula("O3 by the rotations of the joints", R_1 * r_1 + R_1 * R_12 * r_2, O_3, line=5810, latex=r"{}^nr_{O_3/E}"),
        Formula("O3 by the rotations of the links", R_1 * r_1 + (R_1 * R_12) * r_2, O_3, line=5812, also=(5828,),
                latex=r"{}^nr_{O_3/E}"),
    ]


@cache
def _of_system() -> tuple[sp.Matrix, dict[str, sp.Expr]]:
    """Velocity of O_3 and angular velocity of link 2 (3, 1) of the system two_link_arm, and its names of the angles."""
    equations = sd.systems.two_link_arm().embedding()
    q1, q2 = equations.symbols.coordinates
    l2, lc2 = sd.parameters("l2 lc2")
    motion = equations.J[3:, :].xreplace({lc2: l2}) * sp.Matrix([q1.dot, q2.dot])
    return motion, {theta_1: q1, theta_2: q2, theta_1.dot: q1.dot, theta_2.dot: q2.dot}


def _velocity() -> list[Formula]:
    n, b1, b2 = arm()
    motion, names = _of_system()
    l1, l2 = sd.parameters("l1 l2")
    along = {r_1[0]: l1, r_2[0]: l2} | dict.fromkeys([*r_1[1:], *r_2[1:]], sp.S.Zero)
    velocity = b2.point("O_3", r_2).velocity(seen_from=n, components=n)
    R_2 = R_1 * R_12
    spread = sd.rate(R_1) * r_1 + R_1 * sd.rate(r_1) + sd.rate(R_2) * r_2 + R_2 * sd.rate(r_2)
    printed = omega_1.cross(R_1 * r_1) + omega_2.cross(R_2 * r_2)
    return [
        Formula("velocity of O3, differentiated", sd.rate(R_1 * r_1) + sd.rate(R_2 * r_2), velocity, line=5832),
        Formula("velocity of O3, products differentiated", spread, velocity, line=5836),
        Formula("velocity of O3, vectors constant", sd.rate(R_1) * r_1 + sd.rate(R_2) * r_2, velocity, line=5854),
        Formula("rate of R of b1", sd.rotation.skew(omega_1) * R_1, sd.rate(b1.rotation(n)), line=5856),
        Formula("rate of R of b2", sd.rotation.skew(omega_2) * R_2, sd.rate(b2.rotation(n)), line=5856),
        Formula("velocity of O3", printed, velocity, line=5858, also=(5924,)),
        Formula("velocity of O3 of the system", printed.xreplace(along)[:2, :], motion[:2, :], line=5858, renamed=names),
    ]


def _angular_velocity() -> list[Formula]:
    n, b1, b2 = arm()
    of_b1 = b1.angular_velocity(n, components=n)
    of_b2 = b2.angular_velocity(n, components=n)
    motion, names = _of_system()
    theta_22 = sd.coordinates("theta_b2/b2")
    turned = proofs.numeric_derivative("About z the velocity is the derivative of the whole angle of b_2.",
                                       of=sp.Matrix([0, 0, theta_1 + theta_2]))
    index = Erratum("The angle of b_2 is that against b_1; a frame does not turn against itself.", turned)
    return [
        Formula("omega of b1 from b1", R_1 * b1.angular_velocity(n, components=b1), of_b1, line=5882),
        Formula("omega of b1 about k", R_1 * k * theta_1.dot, of_b1, line=5882),
        Formula("omega of b1", omega_1, of_b1, line=5882, also=(5926,), latex=r"{}^n\omega_{b_1/n}"),
        Formula("omega of b2, sum", of_b1 + b2.angular_velocity(b1, components=n), of_b2, line=5902, also=(5928,)),
        Formula("omega of b2 about k", omega_1 + R_1 * R_12 * k * theta_22.dot, of_b2, line=5902, errata=[index]),
        Formula("omega of b2 by the rotations", omega_1 + R_1 * R_12 * k * theta_2.dot, of_b2, line=5904),
        Formula("omega of b2", omega_2, of_b2, line=5906, also=(5928,), latex=r"{}^n\omega_{b_2/n}"),
        Formula("omega of b2 of the system", omega_2[2], motion[2], line=5906, renamed=names),
    ]


CASES = (
    Case("two-link-arm-position", "End effector of an arm of two links",
         Slide("4.1", "Example of 2-Link Arm - position vector of end-effector", 5790), _position),
    Case("two-link-arm-velocity", "Velocity of the end effector of an arm of two links",
         Slide("4.1", "Example of 2-Link Arm - linear velocity vector of end-effector", 5814), _velocity),
    Case("two-link-arm-angular-velocity", "Angular velocities of an arm of two links",
         Slide("4.1", "Example of 2-Link Arm - Angular velocities", 5862), _angular_velocity),
)
