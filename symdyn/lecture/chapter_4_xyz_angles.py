"""Chapter 4.3: Euler angles xyz, their rates and their lock."""

from __future__ import annotations

import sympy as sp
from sympy import cos, sin

import symdyn as sd
from symdyn.comparison import Case, Formula, Slide

phi, theta, psi = angles = sd.coordinates("phi theta psi")
gamma_dot = sp.Matrix([phi.dot, theta.dot, psi.dot])
x, y, z = (sp.eye(3).col(axis) for axis in range(3))

# As printed.
of_phi = sp.Matrix([1, 0, 0])
of_theta = sp.Matrix([0, cos(phi), sin(phi)])
of_psi = sp.Matrix([sin(theta), -sin(phi) * cos(theta), cos(phi) * cos(theta)])
G = sp.Matrix([[1, 0, sin(theta)], [0, cos(phi), -sin(phi) * cos(theta)], [0, sin(phi), cos(phi) * cos(theta)]])
R = sp.Matrix([
    [cos(theta) * cos(psi), -cos(theta) * sin(psi), sin(theta)],
    [sin(phi) * sin(theta) * cos(psi) + cos(phi) * sin(psi), -sin(phi) * sin(theta) * sin(psi) + cos(phi) * cos(psi),
     -sin(phi) * cos(theta)],
    [-cos(phi) * sin(theta) * cos(psi) + sin(phi) * sin(psi), cos(phi) * sin(theta) * sin(psi) + sin(phi) * cos(psi),
     cos(phi) * cos(theta)]])
RIGHT_ANGLE = {theta: sp.pi / 2}


def frames() -> tuple[sd.Frame, sd.Frame, sd.Frame, sd.Frame]:
    """The frame n and those after each of the three rotations."""
    n = sd.Frame("n")
    b1 = n.frame("b_1", rotation=sd.rotation.about("X", phi))
    b2 = b1.frame("b_2", rotation=sd.rotation.about("Y", theta))
    return n, b1, b2, b2.frame("b_3", rotation=sd.rotation.about("Z", psi))


def _rates() -> list[Formula]:
    n, b1, b2, b3 = frames()
    omega = b3.angular_velocity(n, components=n)
    axes = b1.rotation(n) * x * phi.dot + b2.rotation(n) * y * theta.dot + b3.rotation(n) * z * psi.dot
    R_01 = sp.Matrix([[1, 0, 0], [0, cos(phi), -sin(phi)], [0, sin(phi), cos(phi)]])
    R_12 = sp.Matrix([[cos(theta), 0, sin(theta)], [0, 1, 0], [-sin(theta), 0, cos(theta)]])
    turned = sp.eye(3) * x * phi.dot + sp.eye(3) * R_01 * y * theta.dot + sp.eye(3) * R_01 * R_12 * z * psi.dot
    return [
        Formula("omega by the axes of the frames", axes, omega, line=6408, also=(6422, 6430), latex=r"{}^n\omega_{b_3/n}"),
        Formula("omega by the rotations", turned, omega, line=6432, also=(6431,), latex=r"{}^n\omega_{b/n}"),
        Formula("omega, three terms", of_phi * phi.dot + of_theta * theta.dot + of_psi * psi.dot, omega, line=6410, also=(6433,),
                latex=r"{}^n\omega_{b_3/n}"),
        Formula("omega", G * gamma_dot, omega, line=6410, also=(6433,), latex=r"{}^n\omega_{b_3/n}"),
        Formula("G", G, sd.rotation.euler_rates("XYZ", angles, frame="n"), line=6410, also=(6433,)),
    ]


def _lock() -> list[Formula]:
    n, _, _, b3 = frames()
    printed = sp.Matrix([1, 0, 0]) * phi.dot + of_theta * theta.dot + sp.Matrix([1, 0, 0]) * psi.dot
    at_lock = b3.angular_velocity(n, components=n).xreplace(RIGHT_ANGLE)
    G_lock = sd.rotation.euler_rates("XYZ", (phi, sp.pi / 2, psi))
    return [
        Formula("omega at 90 degrees", printed, at_lock, line=6446, latex=r"{}^n\omega_{b_3/n}"),
        Formula("det G at 90 degrees", sp.S.Zero, sp.Matrix(G_lock).det(), line=6449, latex=r"\det G"),
        Formula("angle of lock", sp.pi / 2, sd.rotation.gimbal_lock("XYZ").second[1], line=6438, also=(6575,), latex=r"\theta"),
    ]


def _determination() -> list[Formula]:
    at_lock = sp.Matrix([[0, 0, 1], [sin(phi + psi), cos(phi + psi), 0], [-cos(phi + psi), sin(phi + psi), 0]])
    given = sp.Matrix([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    result = sd.rotation.to_euler(given, "XYZ")
    return [
        Formula("R", R, sd.rotation.from_euler("XYZ", angles), line=6571, latex=r"{}^nR_{b_3}"),
        Formula("R at 90 degrees", at_lock, sd.rotation.from_euler("XYZ", (phi, sp.pi / 2, psi)), line=6579,
                latex=r"{}^nR_{b_3}"),
        Formula("theta of the given R", sp.pi / 2, result.angles[1], line=6575, latex=r"\theta"),
        Formula("phi + psi of the given R", sp.pi / 2, result.value, line=6576, latex=r"\phi + \psi"),
    ]


CASES = (
    Case("xyz-angles-rates", "Rates of the Euler angles xyz and angular velocity",
         Slide("4.3", "Relationship between the time derivative of the Euler angle and angular velocity", 6398), _rates),
    Case("xyz-angles-lock", "Gimbal lock: angular velocity", Slide("4.3", "Gimbal lock of the Euler angle(1)", 6436), _lock),
    Case("xyz-angles-determination", "Gimbal lock: angles that a rotation does not determine",
         Slide("4.3", "Gimbal lock of the Euler angle(2)", 6555), _determination),
)
