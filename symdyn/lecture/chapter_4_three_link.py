"""Chapter 4.2: the arm of three links in space, whose joints are ZYX Euler angles; position, velocity and G."""

from __future__ import annotations

from functools import cache
from typing import Any

import sympy as sp
from sympy import cos, sin

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, conventions, proofs

psi, theta, phi = sd.coordinates("psi_b1/n theta_b2/b1 phi_b3/b2")
gamma_dot = sp.Matrix([phi.dot, theta.dot, psi.dot])
# Components of b1_r_O2/O1, b2_r_O3/O2 and b3_r_O4/O3.
r_1, r_2, r_3 = (sp.Matrix([sp.Symbol(f"r_O{i + 1}/O{i},{axis}") for axis in "xyz"]) for i in (1, 2, 3))
i, j, k = (sp.eye(3).col(axis) for axis in range(3))

# As printed.
R_1 = sp.Matrix([[cos(psi), -sin(psi), 0], [sin(psi), cos(psi), 0], [0, 0, 1]])
R_12 = sp.Matrix([[cos(theta), 0, sin(theta)], [0, 1, 0], [-sin(theta), 0, cos(theta)]])
R_23 = sp.Matrix([[1, 0, 0], [0, cos(phi), -sin(phi)], [0, sin(phi), cos(phi)]])
R_3 = sp.Matrix([
    [cos(psi) * cos(theta), cos(psi) * sin(theta) * sin(phi) - sin(psi) * cos(phi),
     cos(psi) * sin(theta) * cos(phi) + sin(psi) * sin(phi)],
    [sin(psi) * cos(theta), sin(psi) * sin(theta) * sin(phi) + cos(psi) * cos(phi),
     sin(psi) * sin(theta) * cos(phi) - cos(psi) * sin(phi)],
    [-sin(theta), cos(theta) * sin(phi), cos(theta) * cos(phi)]])
of_psi = k
of_theta = sp.Matrix([-sin(psi), cos(psi), 0])
of_phi = sp.Matrix([cos(psi) * cos(theta), sin(psi) * cos(theta), -sin(theta)])
G = sp.Matrix([[cos(psi) * cos(theta), -sin(psi), 0], [sin(psi) * cos(theta), cos(psi), 0], [-sin(theta), 0, 1]])

GAMMA = conventions.reordered(columns=[2, 1, 0], sentence="The slide's gamma is (phi, theta, psi), the last angle first.")
TOO_FAR = "Three links reach the end effector O_4, not O_3."


def arm() -> tuple[sd.Frame, sd.Frame, sd.Frame, sd.Frame]:
    """The frames n, b_1, b_2 and b_3, with origins at O_1, O_1, O_2 and O_3."""
    n = sd.Frame("n")
    b1 = n.frame("b_1", rotation=sd.rotation.about("Z", psi))
    b2 = b1.frame("b_2", rotation=sd.rotation.about("Y", theta), origin=r_1)
    return n, b1, b2, b2.frame("b_3", rotation=sd.rotation.about("X", phi), origin=r_2)


def _rotation() -> list[Formula]:
    n, b1, b2, b3 = arm()
    product = R_1 * R_12 * R_23
    return [
        Formula("R of b1", R_1, b1.rotation(n), line=6005, latex=r"{}^nR_{b_1}",
                also=(6028, 6053, 6078, 6098, 6116, 6138, 6160, 6180)),
        Formula("R of b2 in b1", R_12, b2.rotation(b1), line=6007, latex=r"{}^{b_1}R_{b_2}",
                also=(6030, 6055, 6080, 6100, 6118, 6140, 6162, 6182)),
        Formula("R of b3 in b2", R_23, b3.rotation(b2), line=6009, latex=r"{}^{b_2}R_{b_3}",
                also=(6032, 6057, 6082, 6102, 6120, 6142, 6164, 6184)),
        Formula("R of b3, product", product, b3.rotation(n), line=6038, latex=r"{}^nR_{b_3}"),
        Formula("R of b3", R_3, sd.rotation.from_euler("ZYX", (psi, theta, phi)), line=6040, latex=r"{}^nR_{b_3}",
                also=(6196,)),
    ]


def _position() -> list[Formula]:
    n, b1, b2, b3 = arm()
    O_2 = b1.point("O_2", r_1).position(of=n, components=n)
    O_3 = b2.point("O_3", r_2).position(of=n, components=n)
    O_4 = b3.point("O_4", r_3).position(of=n, components=n)
    of_links = R_1 * r_1 + (R_1 * R_12) * r_2 + R_3 * r_3
    stretched = proofs.limit("With all angles zero O_3 is reached by two links.", at={psi: 0, theta: 0, phi: 0}, value=r_1 + r_2)
    index = Erratum("The sum over three links reaches the end effector O_4, not O_3.", stretched, slip=TOO_FAR)
    return [
        Formula("O3 as the sum over three links", of_links, O_3, line=6011, also=(6013, 6015, 6034, 6059), errata=[index],
                latex=r"{}^nr_{O_3/E}"),
        Formula("O4, sum of three links", R_1 * r_1 + (O_3 - O_2) + (O_4 - O_3), O_4, line=6011, latex=r"{}^nr_{O_4/E}"),
        Formula("O4 by the rotations of the joints", R_1 * r_1 + R_1 * R_12 * r_2 + R_1 * R_12 * R_23 * r_3, O_4, line=6013,
                also=(6034,), latex=r"{}^nr_{O_4/E}"),
        Formula("O4 by the rotations of the links", of_links, O_4, line=6015, also=(6059,), latex=r"{}^nr_{O_4/E}"),
    ]


@cache
def _of_system() -> tuple[sp.Matrix, dict[str, sp.Expr]]:
    """Velocity of O_4 and angular velocity of link 3 (6, 1) of the system three_link_arm, and its names of the angles."""
    equations = sd.systems.three_link_arm().embedding()
    q = equations.symbols.coordinates
    l3, lc3 = sd.parameters("l3 lc3")
    motion = equations.J[12:, :].xreplace({lc3: l3}) * sp.Matrix([x.dot for x in q])
    angles = (psi, theta, phi)
    return motion, dict(zip(angles, q)) | {a.dot: x.dot for a, x in zip(angles, q)}


def _velocity() -> list[Formula]:
    n, b1, b2, b3 = arm()
    rate, skew = sd.rate, sd.rotation.skew
    of_O_3 = b2.point("O_3", r_2).velocity(seen_from=n, components=n)
    velocity = b3.point("O_4", r_3).velocity(seen_from=n, components=n)
    R_2 = R_1 * R_12
    spread = (rate(R_1) * r_1 + R_1 * rate(r_1) + rate(R_2) * r_2 + R_2 * rate(r_2) + rate(R_3) * r_3 + R_3 * rate(r_3))
    omega_1, omega_2, omega_3 = of_psi * psi.dot, of_psi * psi.dot + of_theta * theta.dot, G * gamma_dot
    printed = omega_1.cross(R_1 * r_1) + omega_2.cross(R_2 * r_2) + omega_3.cross(R_3 * r_3)
    two_links = proofs.numeric_derivative("It must be the derivative of the position of O_3, which two links reach.",
                                          of=R_1 * r_1 + R_1 * R_12 * r_2)
    index = Erratum("The terms of three links are the velocity of the end effector O_4, not of O_3.", two_links, slip=TOO_FAR)
    motion, names = _of_system()
    along = dict(zip((r_1[0], r_2[0], r_3[0]), sd.parameters("l1:4"))) | dict.fromkeys([*r_1[1:], *r_2[1:], *r_3[1:]], sp.S.Zero)
    return [
        Formula("velocity of O3 as the sum over three links", printed, of_O_3, line=6063, also=(6084, 6088, 6186), errata=[index],
                latex=r"\frac{d}{dt}{}^nr_{O_3/E}"),
        Formula("velocity of O4, products differentiated", spread, velocity, line=6063),
        Formula("velocity of O4, vectors constant", rate(R_1) * r_1 + rate(R_2) * r_2 + rate(R_3) * r_3, velocity, line=6084),
        Formula("rate of R of b1", skew(omega_1) * R_1, rate(b1.rotation(n)), line=6086),
        Formula("rate of R of b2", skew(omega_2) * R_2, rate(b2.rotation(n)), line=6086),
        Formula("rate of R of b3", skew(omega_3) * R_3, rate(b3.rotation(n)), line=6086),
        Formula("velocity of O4", printed, velocity, line=6088, also=(6186,)),
        Formula("velocity of O4 of the system", printed.xreplace(along), motion[:3, :], line=6088, renamed=names),
    ]


def _angular_velocity() -> list[Formula]:
    n, b1, b2, b3 = arm()
    of_b1, of_b2, of_b3 = (b.angular_velocity(n, components=n) for b in (b1, b2, b3))
    first: dict[Any, Any] = {theta.dot: sp.S.Zero, phi.dot: sp.S.Zero}
    of_b2_in_b1 = b2.angular_velocity(b1, components=n)
    of_b3_in_b2 = b3.angular_velocity(b2, components=n)
    motion, names = _of_system()
    return [
        Formula("omega of b3 where only psi moves", of_psi * psi.dot, of_b3, line=6106, also=(6252,), where=first),
        Formula("omega of b2 where only psi moves", of_psi * psi.dot, of_b2, line=6106, where=first),
        Formula("omega of b1 from b1", R_1 * b1.angular_velocity(n, components=b1), of_b1, line=6104),
        Formula("omega of b1 about k", R_1 * k * psi.dot, of_b1, line=6104, also=(6108,)),
        Formula("omega of b1", of_psi * psi.dot, of_b1, line=6108, also=(6122, 6144, 6188), latex=r"{}^n\omega_{b_1/n}"),
        Formula("omega of b2, sum", of_b1 + of_b2_in_b1, of_b2, line=6124),
        Formula("omega of b2 about j", of_psi * psi.dot + R_1 * R_12 * j * theta.dot, of_b2, line=6124, also=(6128,)),
        Formula("omega of b2 in b1", of_theta * theta.dot, of_b2_in_b1, line=6126, also=(6146,), latex=r"{}^n\omega_{b_2/b_1}"),
        Formula("omega of b2", of_psi * psi.dot + of_theta * theta.dot, of_b2, line=6130, also=(6188, 6269),
                latex=r"{}^n\omega_{b_2/n}"),
        Formula("omega of b3, sum", of_b1 + of_b2_in_b1 + of_b3_in_b2, of_b3, line=6148),
        Formula("omega of b3 about i", of_psi * psi.dot + of_theta * theta.dot + R_3 * i * phi.dot, of_b3, line=6148),
        Formula("omega of b3 by the rotations", of_psi * psi.dot + of_theta * theta.dot + R_1 * R_12 * R_23 * i * phi.dot, of_b3,
                line=6150),
        Formula("omega of b3, three terms", of_psi * psi.dot + of_theta * theta.dot + of_phi * phi.dot, of_b3, line=6152,
                also=(6166, 6283), latex=r"{}^n\omega_{b_3/n}"),
        Formula("omega of b3", G * gamma_dot, of_b3, line=6168,
                also=(6188, 6200, 6285, 6287, 6300, 6975, 7001, 7280), latex=r"{}^n\omega_{b_3/n}"),
        Formula("omega of b3 of the system", G * gamma_dot, motion[3:, :], line=6168, renamed=names),
        Formula("G", G, sd.rotation.euler_rates("ZYX", (psi, theta, phi), frame="n"), line=6168, also=(6188, 6200, 6285, 6300),
                conventions=[GAMMA]),
    ]


CASES = (
    Case("three-link-arm-rotation", "Rotations of an arm of three links: ZYX Euler angles",
         Slide("4.2", "Example of 3-Link Arm - position vector of end-effector", 5994), _rotation),
    Case("three-link-arm-position", "End effector of an arm of three links",
         Slide("4.2", "Example of 3-Link Arm - position vector of end-effector", 5994), _position),
    Case("three-link-arm-velocity", "Velocity of the end effector of an arm of three links",
         Slide("4.2", "Example of 3-Link Arm - linear velocity vector of end-effector", 6042), _velocity),
    Case("three-link-arm-angular-velocity", "Angular velocities of an arm of three links, and G",
         Slide("4.2", "Example of 3-Link Arm - angular velocities", 6092), _angular_velocity),
)
