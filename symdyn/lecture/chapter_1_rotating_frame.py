"""Chapter 1.7: rates of rotating unit vectors, velocity and acceleration through a rotating frame, inertial forces."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import sympy as sp

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, proofs
from symdyn.comparison.conventions import Convention
from symdyn.lecture.chapter_1_circular import limit

m = sp.Symbol("m_P", positive=True)
F = sp.Matrix(sp.symbols("F_x F_y F_z"))


@dataclass(frozen=True)
class Turning:
    """P at x, y, z in a b-frame that turns by theta about z and whose origin O is at X, Y, Z; as the slides write it.

    R, omega, alpha    nR_b, n_omega_b/n, n_alpha_b/n
    r_b, v_b, a_b      b_r_P/O and its derivatives
    O, v_O, a_O        n_r_O/E and its derivatives
    """

    n: Any
    b: Any
    P: Any
    theta: Any
    R: sp.Matrix
    omega: sp.Matrix
    alpha: sp.Matrix
    r_b: sp.Matrix
    v_b: sp.Matrix
    a_b: sp.Matrix
    O: sp.Matrix
    v_O: sp.Matrix
    a_O: sp.Matrix

    @property
    def r(self) -> sp.Matrix:
        """n_r_P/O."""
        return self.R * self.r_b

    @property
    def relative(self) -> Convention:
        """Notation of the slides for R b_r_dot_P/O from here on."""
        spin = self.omega.cross(self.r)
        return Convention("relative rate", "A dot over r_P/O is the rate seen from the b-frame, in components of the n-frame.",
                          lambda derived: derived - spin)

    @property
    def relative_twice(self) -> Convention:
        """Notation of the slides for R b_r_ddot_P/O from here on."""
        turned = self.alpha.cross(self.r) + self.omega.cross(self.omega.cross(self.r)) + 2 * self.omega.cross(self.R * self.v_b)
        return Convention("relative rate",
                          "Two dots over r_P/O are the acceleration seen from the b-frame, in components of the n-frame.",
                          lambda derived: derived - turned)


@cache
def turning() -> Turning:
    """The frames of chapter 1.7."""
    X, Y, Z, x, y, z, theta = sd.coordinates("X Y Z x y z theta")
    n = sd.Frame("n")
    b = n.frame("b", rotation=sd.rotation.about("Z", theta), origin=[X, Y, Z])
    cos, sin = sp.cos(theta), sp.sin(theta)
    return Turning(n, b, b.point("P", [x, y, z]), theta, sp.Matrix([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]),
                   sp.Matrix([0, 0, theta.dot]), sp.Matrix([0, 0, theta.ddot]),
                   sp.Matrix([x, y, z]), sp.Matrix([x.dot, y.dot, z.dot]), sp.Matrix([x.ddot, y.ddot, z.ddot]),
                   sp.Matrix([X, Y, Z]), sp.Matrix([X.dot, Y.dot, Z.dot]), sp.Matrix([X.ddot, Y.ddot, Z.ddot]))


def crossed(vector: sp.Matrix, matrix: sp.Matrix) -> sp.Matrix:
    """vector x matrix, column by column."""
    return sp.Matrix.hstack(*[vector.cross(matrix.col(c)) for c in range(matrix.cols)])


def _unit_vectors() -> list[Formula]:
    f = turning()
    omega = f.theta.dot
    i_b, j_b, k_b = (f.R.col(c) for c in range(3))
    derived = f.b.rotation(f.n)
    Rd = sd.rate(derived)
    cos, sin = sp.cos(f.theta), sp.sin(f.theta)
    plane = sp.Matrix([[cos, -sin], [sin, cos]])
    step = sp.Symbol("Delta_theta", positive=True)
    columns = limit(derived.subs(f.theta, f.theta + step) - derived, step)
    return [
        Formula("R", plane, derived[:2, :2], line=1400, also=(1432, 1462, 1521), latex="{}^n R_b"),
        Formula("omega", omega * k_b, f.b.angular_velocity(f.n), line=1468, also=(1501, 1503), latex=r"\omega"),
        Formula("change of i_b by d theta", j_b, columns.col(0), line=1480, latex="d i_b / d\\theta"),
        Formula("change of j_b by d theta", -i_b, columns.col(1), line=1488, latex="d j_b / d\\theta"),
        Formula("size of the change of i_b by d theta", 1, columns.col(0).norm(), line=1476),
        Formula("size of the change of j_b by d theta", 1, columns.col(1).norm(), line=1484),
        Formula("rate of i_b", omega * j_b, Rd.col(0), line=1492, also=(1509,), latex="d i_b / dt"),
        Formula("rate of i_b by k_b", omega * k_b.cross(i_b), Rd.col(0), line=1492, also=(1511,), latex="d i_b / dt"),
        Formula("rate of i_b by omega", f.omega.cross(i_b), Rd.col(0), line=1492, also=(1513,), latex="d i_b / dt"),
        Formula("rate of j_b", -omega * i_b, Rd.col(1), line=1494, also=(1515,), latex="d j_b / dt"),
        Formula("rate of j_b by k_b", omega * k_b.cross(j_b), Rd.col(1), line=1494, also=(1517,), latex="d j_b / dt"),
        Formula("rate of j_b by omega", f.omega.cross(j_b), Rd.col(1), line=1494, also=(1519,), latex="d j_b / dt"),
        Formula("rate of R by columns", sp.Matrix.hstack(f.omega.cross(i_b), f.omega.cross(j_b)), Rd[:, :2], line=1529,
                also=(1527, 1531)),
        Formula("rate of R", crossed(f.omega, f.R), Rd, line=1533, also=(1454, 1561), latex=r"d\,{}^n R_b / dt"),
    ]


def _velocity() -> list[Formula]:
    f = turning()
    velocity = f.P.velocity(seen_from=f.n)
    return [
        Formula("position", f.O + f.R * f.r_b, f.P.position(of=f.n), line=1428, also=(1424, 1444),
                latex="{}^n r_{P/E}"),
        Formula("velocity, R differentiated", f.v_O + f.R * f.v_b + sd.rate(f.R) * f.r_b, velocity, line=1450),
        Formula("velocity", f.v_O + f.R * f.v_b + crossed(f.omega, f.R) * f.r_b, velocity, line=1458, also=(1551,),
                latex=r"d\,{}^n r_{P/E} / dt"),
    ]


def _acceleration() -> list[Formula]:
    f = turning()
    R, w, alpha = f.R, f.omega, f.alpha
    acceleration = f.P.acceleration(seen_from=f.n)
    position = f.P.position(of=f.n)
    parts = f.P.acceleration_parts(through=f.b, seen_from=f.n)
    bR_b = sp.eye(3)
    by_difference = proofs.numeric_derivative("The acceleration is the second derivative of the position.", of=position, order=2)
    own_frame = Erratum("bR_b is the unit matrix, whose rate is zero, so that half of the Coriolis acceleration is lost; "
                        "it must be nR_b.", by_difference)
    twice_turned = Erratum("nR_b takes components in the b-frame, and the rate of n_r_P/O holds omega x r besides; "
                           "it must be b_r_P/O.",
                           by_difference)
    centripetal = w.cross(w.cross(f.r))
    lost = "The denominator of d^2 / dt^2 is lost."
    relative, relative_rate = R * f.a_b, R * f.v_b
    total = relative + alpha.cross(f.r) + centripetal + 2 * w.cross(relative_rate) + f.a_O
    return [
        Formula("a, differentiated",
                sd.rate(bR_b) * f.v_b + R * f.a_b + crossed(alpha, R) * f.r_b + crossed(w, sd.rate(R)) * f.r_b
                + crossed(w, R) * f.v_b + f.a_O, acceleration, line=1557, errata=[own_frame]),
        Formula("a of O, differentiated", None, parts.origin, line=1557, also=(1563,), unreadable=lost),
        Formula("a, rate of R put in",
                crossed(w, R) * f.v_b + R * f.a_b + crossed(alpha, R) * f.r_b + w.cross(crossed(w, R) * f.r_b)
                + crossed(w, R) * sd.rate(f.r) + f.a_O, acceleration, line=1563, errata=[twice_turned]),
        Formula("relative a, rate of R put in", None, parts.relative, line=1563, unreadable=lost),
        Formula("a, summed",
                R * f.a_b + crossed(alpha, R) * f.r_b + w.cross(crossed(w, R) * f.r_b) + 2 * (crossed(w, R) * f.v_b) + f.a_O,
                acceleration, line=1567),
        Formula("a", R * f.a_b + alpha.cross(f.r) + w.cross(crossed(w, R) * f.r_b) + 2 * (crossed(w, R) * f.v_b) + f.a_O,
                acceleration, line=1571, latex=r"{}^n \ddot{r}_{P/E}"),
        Formula("rate of r_PO", relative_rate, sd.rate(position) - f.v_O, line=1575, also=(1590, 1596, 1600, 1610, 1667, 1719),
                conventions=[f.relative], latex=r"{}^n \dot{r}_{P/O}"),
        Formula("second rate of r_PO", relative, sd.rate(sd.rate(position)) - f.a_O, line=1575,
                also=(1590, 1596, 1600, 1610, 1667, 1719), conventions=[f.relative_twice], latex=r"{}^n \ddot{r}_{P/O}"),
        Formula("a in the n-frame", total, acceleration, line=1575, also=(1590,), latex=r"{}^n \ddot{r}_{P/E}"),
        Formula("second rate of the position", sd.rate(sd.rate(f.O + f.r)), acceleration, line=1549, also=(1418,),
                latex=r"{}^n \ddot{r}_{P/E}"),
    ]


def _forces() -> list[Formula]:
    f = turning()
    w, alpha = f.omega, f.alpha
    rdd_PO, rd_PO, centripetal = f.R * f.a_b, f.R * f.v_b, f.omega.cross(f.omega.cross(f.r))
    acceleration = f.P.acceleration(seen_from=f.n)
    inertial = f.P.inertial_forces(m, frame=f.b, components=f.n)
    relative = m * f.P.acceleration_parts(through=f.b, seen_from=f.n).relative
    newton = (F, m * acceleration)
    braces = f.a_O + rdd_PO + alpha.cross(f.r) + 2 * w.cross(rd_PO) + centripetal
    expanded = m * f.a_O + m * rdd_PO + m * alpha.cross(f.r) + 2 * m * w.cross(rd_PO) + m * centripetal
    return [
        Formula("Newton's law in the n-frame", (F, m * sd.rate(sd.rate(f.O + f.r))), newton, line=1395,
                also=(1416, 1592, 1665, 1717)),
        Formula("Newton's law", (F, m * (rdd_PO + alpha.cross(f.r)) + m * (centripetal + 2 * w.cross(rd_PO) + f.a_O)), newton,
                line=1596),
        Formula("Newton's law in the b-frame",
                (F - m * alpha.cross(f.r) - m * centripetal - 2 * m * w.cross(rd_PO) - m * f.a_O, m * rdd_PO),
                (F + inertial.total, relative), line=1600, also=(1610,)),
        Formula("Euler force", -m * alpha.cross(f.r), inertial.euler, line=1616),
        Formula("centrifugal force", -m * centripetal, inertial.centrifugal, line=1618),
        Formula("Coriolis force", -2 * m * w.cross(rd_PO), inertial.coriolis, line=1621),
        Formula("relative acceleration", m * rdd_PO, relative, line=1628),
        Formula("Newton's law, chair", (m * braces, F), newton[::-1], line=1667, also=(1719,)),
        Formula("Newton's law, chair, expanded", (expanded, F), newton[::-1], line=1669, also=(1721,)),
        Formula("Newton's law in the b-frame, chair",
                (m * rdd_PO, F - m * f.a_O - m * alpha.cross(f.r) - 2 * m * w.cross(rd_PO) - m * centripetal),
                (relative, F + inertial.total), line=1671, also=(1723,)),
    ]


CASES = (
    Case("rates-of-unit-vectors", "Rates of rotating unit vectors and of R",
         Slide("1.7", "Time Derivative of a Rotating unit vector", 1466), _unit_vectors),
    Case("rotating-frame-velocity", "Velocity through a rotating frame", Slide("1.7", "Rotating reference frame", 1383),
         _velocity),
    Case("rotating-frame-acceleration", "Acceleration through a rotating frame", Slide("1.7", "Rotating reference frame", 1538),
         _acceleration),
    Case("inertial-forces", "Inertial forces in a rotating frame", Slide("1.7", "Rotating reference frame", 1580), _forces),
)
