"""Chapter 4.3: finite rotations, which do not commute, against infinitesimal ones, which add; rates of Euler angles."""

from __future__ import annotations

import sympy as sp
from sympy import cos, sin

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, conventions, proofs
from symdyn.lecture.chapter_4_xyz_angles import G, gamma_dot, phi, psi, theta

# The angles of an infinitesimal rotation have a prime; SymPy typesets the names so.
small = sd.coordinates("phiprime thetaprime psiprime")
phi_, theta_, psi_ = small

TO_B = conventions.transposed("The slide's rotations take components in n to components in b.")
EXCHANGED = "The matrices of R_z and R_x are exchanged."

# As printed, at the angles a.


def R_z(a: sp.Expr) -> sp.Matrix:
    return sp.Matrix([[1, 0, 0], [0, cos(a), sin(a)], [0, -sin(a), cos(a)]])


def R_y(a: sp.Expr) -> sp.Matrix:
    return sp.Matrix([[cos(a), 0, -sin(a)], [0, 1, 0], [sin(a), 0, cos(a)]])


def R_x(a: sp.Expr) -> sp.Matrix:
    return sp.Matrix([[cos(a), sin(a), 0], [-sin(a), cos(a), 0], [0, 0, 1]])


def _stays(axis: str, column: int) -> proofs.Proof:
    """The proof that a rotation matrix turns about an axis."""
    unit = sp.eye(3).col(column)
    return proofs.Proof("invariant axis", f"A rotation about {axis} leaves the unit vector along {axis} as it is.",
                        lambda R: sp.Matrix(R) * unit - unit)


def _finite() -> list[Formula]:
    about = sd.rotation.about
    of_z = Erratum("This is the matrix of a rotation about x; those of R_z and R_x are exchanged.",
                   _stays("z", 2), slip=EXCHANGED)
    of_x = Erratum("This is the matrix of a rotation about z; those of R_z and R_x are exchanged.",
                   _stays("x", 0), slip=EXCHANGED)
    seen = sp.Matrix([-sin(theta), cos(theta) * sin(phi), cos(theta) * cos(phi)])
    first = Erratum("Rotations that take components in n to those in b follow from right to left: R_x R_y R_z; the order "
                    "printed is that of rotations from b to n.", proofs.Proof(
        "invariant axis", "The first rotation leaves the unit vector along z_{0} as it is; only those about y and x change it.",
        lambda R: sp.Matrix(R) * sp.Matrix([0, 0, 1]) - seen))
    # The product with R_z and R_x corrected, as the slides themselves use them at line 6361.
    right_z, right_x = R_x(psi), R_z(phi)
    to_b = sd.rotation.from_euler("ZYX", (psi, theta, phi)).T
    return [
        Formula("R_z", R_z(psi), about("Z", psi).T, line=6317, errata=[of_z], latex="R_z"),
        Formula("R_y", R_y(theta), about("Y", theta), line=6321, conventions=[TO_B], latex="R_y"),
        Formula("R_x", R_x(phi), about("X", phi).T, line=6325, errata=[of_x], latex="R_x"),
        Formula("R", right_z * R_y(theta) * right_x, to_b, line=6329, errata=[first], latex="R"),
        Formula("R_z of a small angle", R_z(psi_), about("Z", psi_).T, line=6347, errata=[of_z]),
        Formula("R_y of a small angle", R_y(theta_), about("Y", theta_), line=6347, conventions=[TO_B]),
        Formula("R_x of a small angle", R_x(phi_), about("X", phi_).T, line=6347, errata=[of_x]),
    ]


def _infinitesimal() -> list[Formula]:
    small_turn = sd.rotation.infinitesimal
    first_z = sp.Matrix([[1, 0, 0], [0, 1, psi_], [0, -psi_, 1]])
    first_y = sp.Matrix([[1, 0, -theta_], [0, 1, 0], [theta_, 0, 1]])
    first_x = sp.Matrix([[1, phi_, 0], [-phi_, 1, 0], [0, 0, 1]])
    product = sp.Matrix([[1, psi_ + theta_ * phi_, -theta_ + psi_ * phi_],
                         [-psi_, 1 - psi_ * theta_ * phi_, phi_ + psi_ * theta_], [theta, -phi_, 1]])
    first_order = sp.Matrix([[1, psi_, -theta_], [-psi_, 1, phi_], [theta, -phi_, 1]])
    of_z = Erratum("This is the matrix of a small rotation about x; those of R_z and R_x are exchanged.",
                   _stays("z", 2), slip=EXCHANGED)
    of_x = Erratum("This is the matrix of a small rotation about z; those of R_z and R_x are exchanged.",
                   _stays("x", 0), slip=EXCHANGED)
    prime = Erratum("The prime is missing: the entry is the small angle theta', not the Euler angle theta.", proofs.limit(
        "Without small angles there is no rotation.", at=dict.fromkeys(small, 0), value=sp.eye(3)), entries=[(2, 0)])
    turns = small_turn([0, 0, psi_]).T * small_turn([0, theta_, 0]).T * small_turn([phi_, 0, 0]).T
    rates = sp.Matrix([x.dot for x in small])
    there = dict.fromkeys(small, sp.S.Zero)
    # The order of small angles does not matter; R_z and R_x corrected, as the slides themselves use them at line 6361.
    of_small = R_x(psi_) * R_y(theta_) * R_z(phi_)
    linear = sp.eye(3) + sum((of_small.diff(x).xreplace(there) * x for x in small), sp.zeros(3))
    return [
        Formula("R_z to first order", first_z, small_turn([0, 0, psi_]).T, line=6355, errata=[of_z], latex="R_z"),
        Formula("R_y to first order", first_y, small_turn([0, theta_, 0]), line=6357, conventions=[TO_B], latex="R_y"),
        Formula("R_x to first order", first_x, small_turn([phi_, 0, 0]).T, line=6359, errata=[of_x], latex="R_x"),
        Formula("R of small angles", linear, small_turn(list(small)), line=6345, conventions=[TO_B], latex="R"),
        Formula("R, product R_z R_y R_x", product, turns, line=6361, errata=[prime], latex="R"),
        Formula("R to first order", first_order, small_turn(list(small)), line=6361, conventions=[TO_B], errata=[prime],
                latex="R"),
        Formula("omega of small angles", rates, sd.rotation.euler_rates("XYZ", small) * rates, line=6363, also=(6374,),
                where=there, latex=r"{}^n\omega_{b/n}"),
    ]


def _rates() -> list[Formula]:
    yaw = proofs.limit("Where psi alone moves, the first of the three rotations, omega is along z_{0}.",
                       at={phi.dot: 0, theta.dot: 0}, value=[0, 0, psi.dot])
    of_xyz = Erratum("This G belongs to the angles xyz; of the rotations listed here, psi about z_{0}, theta about y_{1} and phi "
                     "about x_{2}, it has the columns (cos psi cos theta, sin psi cos theta, -sin theta), (-sin psi, cos psi, 0) "
                     "and (0, 0, 1).", yaw)
    from_rates = sd.rotation.angular_velocity(sd.rotation.from_euler("ZYX", (psi, theta, phi)), frame="n")
    return [Formula("omega by the rates of ZYX angles", G * gamma_dot, from_rates, line=6394, also=(6392,), errata=[of_xyz],
                    latex=r"{}^n\omega_{b/n}")]


CASES = (
    Case("finite-rotation", "Finite rotations: elementary matrices and the order of their product",
         Slide("4.3", "Finite rotation vs. infinitesimal rotation", 6309), _finite),
    Case("infinitesimal-rotation", "Infinitesimal rotations add",
         Slide("4.3", "Finite rotation vs. infinitesimal rotation", 6339), _infinitesimal),
    Case("finite-rotation-rates", "Rates of ZYX angles against angular velocity",
         Slide("4.3", "Finite rotation vs. infinitesimal rotation", 6369), _rates),
)
