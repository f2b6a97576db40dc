"""Chapter 2.2: x, y, z Euler angles: rotation, angular velocity, and the motion of points of a turning body."""

from __future__ import annotations

import sympy as sp
from sympy import cos, sin

import symdyn as sd
from symdyn.comparison import Case, Formula, Slide
from symdyn.lecture.letters import constant

phi, theta, psi = angles = sp.symbols("phi theta psi")
rates = sp.Matrix(sp.symbols("phi_dot theta_dot psi_dot"))
x_axis, y_axis, z_axis = (sp.eye(3).col(axis) for axis in range(3))

# As printed: {1} to {0}, {2} to {1}, b to {2}.
R_01 = sp.Matrix([[1, 0, 0], [0, cos(phi), -sin(phi)], [0, sin(phi), cos(phi)]])
R_12 = sp.Matrix([[cos(theta), 0, sin(theta)], [0, 1, 0], [-sin(theta), 0, cos(theta)]])
R_2b = sp.Matrix([[cos(psi), -sin(psi), 0], [sin(psi), cos(psi), 0], [0, 0, 1]])
R_0b = sp.Matrix([
    [cos(theta) * cos(psi), -cos(theta) * sin(psi), sin(theta)],
    [sin(phi) * sin(theta) * cos(psi) + cos(phi) * sin(psi), -sin(phi) * sin(theta) * sin(psi) + cos(phi) * cos(psi),
     -sin(phi) * cos(theta)],
    [-cos(phi) * sin(theta) * cos(psi) + sin(phi) * sin(psi), cos(phi) * sin(theta) * sin(psi) + sin(phi) * cos(psi),
     cos(phi) * cos(theta)]])
G = sp.Matrix([[1, 0, sin(theta)], [0, cos(phi), -sin(phi) * cos(theta)], [0, sin(phi), cos(phi) * cos(theta)]])


def rotation() -> list[Formula]:
    first, second, third = (sd.rotation.about(axis, angle) for axis, angle in zip("XYZ", angles, strict=True))
    R = sd.rotation.from_euler("XYZ", angles)
    r = constant("b_r_P")
    return [
        Formula("about x", R_01, first, line=2991, also=(3021,), latex=r"{}^{\{0\}}R_{\{1\}}"),
        Formula("about y", R_12, second, line=2997, also=(3021,), latex=r"{}^{\{1\}}R_{\{2\}}"),
        Formula("about z", R_2b, third, line=3003, also=(3021,), latex=r"{}^{\{2\}}R_b"),
        Formula("nRb", R_0b, R, line=3023, latex=r"{}^{\{0\}}R_b"),
        Formula("position of P", R_0b * r, sd.Frame("n").frame("b", rotation=R).point("P", list(r)).position(), line=3023,
                latex=r"{}^{\{0\}}r_{P/O}"),
        *[Formula(f"axis {letter} of b", R_0b.col(axis), R * sp.eye(3).col(axis), line=3025)
          for axis, letter in enumerate("xyz")],
    ]


def angular_velocity() -> list[Formula]:
    """From the sum of simple rotations to nG, compared with the angular velocity of a frame with these angles."""
    turning = sd.coordinates("phi theta psi")
    omega = sd.Frame("n").frame("b", rotation=sd.rotation.from_euler("XYZ", turning)).angular_velocity()
    by_G = sd.rotation.euler_rates("XYZ", angles, frame="n")
    one = sp.eye(3)
    n_x, n_y, n_z = x_axis, R_01 * y_axis, R_01 * R_12 * z_axis
    columns = [sp.Matrix([1, 0, 0]), sp.Matrix([0, cos(phi), sin(phi)]),
               sp.Matrix([sin(theta), -sin(phi) * cos(theta), cos(phi) * cos(theta)])]
    w = sp.Matrix(sp.symbols("omega_1:4"))
    # While the angles are zero, the three axes of rotation are those of the n-frame.
    upright = {**dict.fromkeys(turning, 0), **dict(zip((angle.dot for angle in turning), w, strict=True))}
    return [
        Formula("sum along e", w[0] * x_axis + w[1] * y_axis + w[2] * z_axis, omega.subs(upright), line=2857, also=(2849,)),
        Formula("along the turned axes", n_x * rates[0] + n_y * rates[1] + n_z * rates[2], omega, line=2873, also=(2882,)),
        Formula("with the matrices",
                one * x_axis * rates[0] + one * R_01 * y_axis * rates[1] + one * R_01 * R_12 * z_axis * rates[2],
                omega, line=2884),
        Formula("multiplied out", columns[0] * rates[0] + columns[1] * rates[1] + columns[2] * rates[2], omega, line=2885),
        Formula("nG", G, by_G, line=2885, latex="{}^nG"),
        Formula("omega", G * rates, omega, line=2885, latex=r"{}^n\omega_{b/n}"),
    ]


def about_pivot() -> list[Formula]:
    """A body that turns about z: all its frames have one angular velocity."""
    turn = sd.coordinates("alpha")
    E = sd.Frame("E")
    O = E.frame("O", rotation=sd.rotation.about("Z", turn))
    at = constant("O_r_AO")
    A = O.frame("A", rotation=sd.rotation.about("Z", sp.Symbol("beta")), origin=list(at))
    P = A.frame("P", origin=[sp.Symbol("c"), 0, 0])
    omega = sp.Matrix([0, 0, sp.Symbol("omega_z")])
    E_r = constant("r_AO")
    turning = {"omega_z": turn.dot}
    position = dict(zip(map(str, E_r), A.position(of=O, components=E), strict=True))
    return [
        Formula("velocity of O", [0, 0, 0], O.velocity(), line=2909, also=(2949,), latex="{}^Ev_{O/E}"),
        Formula("angular velocity of O", omega, O.angular_velocity(), line=2913, also=(2953,), renamed=turning,
                latex=r"{}^E\omega_{O/E}"),
        Formula("velocity of A", omega.cross(E_r), A.velocity(), line=2917, also=(2957,), renamed=turning | position,
                latex="{}^Ev_{A/E}"),
        Formula("angular velocity of A", omega, A.angular_velocity(), line=2961, renamed=turning, latex=r"{}^E\omega_{A/E}"),
        Formula("angular velocity of P", omega, P.angular_velocity(), line=2965, renamed=turning, latex=r"{}^E\omega_{P/E}"),
    ]


CASES = (
    Case("xyz-angular-velocity", "Angular velocity of x, y, z Euler angles",
         Slide("2.2", "Relation between the time derivative of the Euler angle and angular velocity", 2863),
         angular_velocity),
    Case("rotation-about-a-pivot", "Angular velocity of the frames of one body", Slide("2.2", "Angular Velocity", 2903),
         about_pivot),
    Case("xyz-rotation", "Rotation by x, y, z Euler angles", Slide("2.2", "Rotation transformation in spatial motion", 2985),
         rotation),
)
