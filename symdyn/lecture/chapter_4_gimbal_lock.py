"""Chapter 4.3: gimbal lock of the arm of three links (ZYX), unit vectors of its last frame, determination of its angles."""

from __future__ import annotations

import sympy as sp
from sympy import cos, sin

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, proofs
from symdyn.lecture.chapter_4_three_link import R_3, G, arm, gamma_dot, of_phi, of_psi, of_theta, phi, psi, theta
from symdyn.model.symbols import symbols_of


def _lock() -> list[Formula]:
    n, _, b2, b3 = arm()
    of_b3 = b3.angular_velocity(n, components=n)
    right_angle = {theta: sp.pi / 2}
    G_lock = sp.Matrix([[0, -sin(psi), 0], [0, cos(psi), 0], [-1, 0, 1]])
    return [
        Formula("omega of b3 where only psi moves", of_psi * psi.dot, of_b3, line=6252, where={theta.dot: 0, phi.dot: 0}),
        Formula("omega of b3 where phi stands", of_psi * psi.dot + of_theta * theta.dot, of_b3, line=6269, where={phi.dot: 0},
                latex=r"{}^n\omega_{b_3/n}"),
        Formula("omega of b2 where phi stands", of_psi * psi.dot + of_theta * theta.dot, b2.angular_velocity(n, components=n),
                line=6268, latex=r"{}^n\omega_{b_2/n}"),
        Formula("omega of b3, three terms", of_psi * psi.dot + of_theta * theta.dot + of_phi * phi.dot, of_b3, line=6283,
                latex=r"{}^n\omega_{b_3/n}"),
        Formula("omega of b3", G * gamma_dot, of_b3, line=6285, also=(6287, 6300), latex=r"{}^n\omega_{b_3/n}"),
        Formula("omega of b3 at 90 degrees", G_lock * gamma_dot, of_b3.xreplace(right_angle), line=6304,
                latex=r"{}^n\omega_{b_3/n}"),
        Formula("angle of lock", sp.pi / 2, sd.rotation.gimbal_lock("ZYX").second[1], line=6302, latex=r"\theta_{b_2/b_1}"),
    ]


def _columns() -> list[Formula]:
    n, _, _, b3 = arm()
    R = b3.rotation(n)
    # The components of the unit vectors of b_3, from points on its axes.
    origin = b3.point("O", [0, 0, 0]).position(of=n, components=n)
    i, j, k = (b3.point("U", sp.eye(3).col(axis)).position(of=n, components=n) - origin for axis in range(3))
    in_x, in_y, in_z = sp.Matrix([1, 0, 0]), sp.Matrix([0, 1, 0]), sp.Matrix([0, 0, 1])
    of_i = sp.Matrix([cos(psi) * cos(theta), sin(psi) * cos(theta), -sin(theta)])
    of_j = sp.Matrix([cos(psi) * sin(theta) * sin(phi) - sin(psi) * cos(phi),
                      sin(psi) * sin(theta) * sin(phi) + cos(psi) * cos(phi), cos(theta) * sin(phi)])
    of_k = sp.Matrix([cos(psi) * sin(theta) * cos(phi) + sin(psi) * sin(phi),
                      sin(psi) * sin(theta) * cos(phi) - cos(psi) * sin(phi), cos(theta) * cos(phi)])
    return [
        Formula("i of b3, product", R_3 * in_x, i, line=6465, also=(6463,), latex=r"{}^ni_{b_3}"),
        Formula("i of b3", of_i, i, line=6467, latex=r"{}^ni_{b_3}"),
        Formula("j of b3, product", R_3 * in_y, j, line=6481, also=(6479,), latex=r"{}^nj_{b_3}"),
        Formula("j of b3", of_j, j, line=6483, latex=r"{}^nj_{b_3}"),
        Formula("k of b3, product", R_3 * in_z, k, line=6495, latex=r"{}^nk_{b_3}"),
        Formula("k of b3, product written out", None, k, line=6497, latex=r"{}^nk_{b_3}",
                unreadable="the transcription breaks the second column of R in two; there are four columns and an empty entry"),
        Formula("k of b3", of_k, k, line=6499, latex=r"{}^nk_{b_3}"),
        Formula("R of b3", R_3, R, line=6505, also=(6465, 6481, 6547), latex=r"{}^nR_{b_3}"),
    ]


def _determination() -> list[Formula]:
    R_13, R_23, R_33 = sp.symbols("R_13 R_23 R_33")
    grip = sp.Matrix([[0, 0, R_13], [0, 1, R_23], [1, 0, R_33]])
    i, j = sp.Matrix([0, 0, 1]), sp.Matrix([0, 1, 0])
    given = sp.Matrix.hstack(i, j, i.cross(j))
    result = sd.rotation.to_euler(given, "ZYX")
    back = sp.Matrix(sd.rotation.from_euler("ZYX", result.at(first=psi)))
    n = sp.Symbol("n", integer=True)
    at_lock = sp.Matrix([[0, -sin(psi + phi), -cos(psi + phi)], [0, cos(psi + phi), -sin(psi + phi)], [1, 0, 0]])
    up = proofs.Proof("entry of R", "R_31 = -sin theta must be 1 for n = 0, 1, 2 and 3.",
                      lambda angle: sp.Matrix([-sin(angle.subs(_n(angle), value)) - 1 for value in range(4)]))
    upright = proofs.Proof("entry of R", "R_22 = cos(psi + phi) must be 1 for n = 0, 1, 2 and 3.",
                           lambda angle: sp.Matrix([cos(angle.subs(_n(angle), value)) - 1 for value in range(4)]))
    quarter = Erratum("-n pi / 2 is a solution for n = 1, 5, 9, ... alone; the solutions are -pi / 2 + 2 n pi.", up)
    whole = Erratum("-sin(psi + phi) = 0 alone admits odd multiples of pi, with the grip upside down; R_22 = 1 leaves 2 n pi.",
                    upright)
    return [
        Formula("R of the grip", grip, back, line=6543, latex=r"{}^nR_{b_3}",
                renamed=dict(zip((R_13, R_23, R_33), given.col(2)))),
        Formula("i of b3", i, back.col(0), line=6527, also=(6542,), latex=r"{}^ni_{b_3}"),
        Formula("j of b3", j, back.col(1), line=6531, also=(6543,), latex=r"{}^nj_{b_3}"),
        Formula("theta of the grip", -n / 2 * sp.pi, result.angles[1] + 2 * sp.pi * n, line=6549, errata=[quarter],
                latex=r"\theta_{b_2/b_1}"),
        Formula("R at -90 degrees", at_lock, sd.rotation.from_euler("ZYX", (psi, -sp.pi / 2, phi)), line=6551,
                latex=r"{}^nR_{b_3}"),
        Formula("R_12 of the grip", -sin(psi + phi), given[0, 1], line=6551, where={phi: result.at(first=psi)[2]}),
        Formula("psi + phi of the grip", n * sp.pi, result.value + 2 * sp.pi * n, line=6551, errata=[whole],
                latex=r"\psi_{b_1/n} + \phi_{b_3/b_2}"),
    ]


def _n(angle: sp.Expr) -> sp.Symbol:
    return next(iter(symbols_of(angle)))


CASES = (
    Case("gimbal-lock", "Gimbal lock of an arm of three links",
         Slide("4.3", "Inverse Dynamics of 3-Link Arm - Gimbal lock of the Euler angle(1)", 6210), _lock),
    Case("unit-vectors-of-b3", "Columns of R are the unit vectors of the body's frame",
         Slide("4.3", "the relationship between the unit vector of body fixed frame and rotational transformation matrix", 6455),
         _columns),
    Case("euler-angles-of-a-grip", "Determination of Euler angles at gimbal lock",
         Slide("4.3", "Example of 3-Link Arm - determination of Euler angles", 6515), _determination),
)
