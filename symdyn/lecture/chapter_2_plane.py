"""Chapter 2.2, coordinate transformation: a frame with constant velocity, turned axes in the plane, rates of unit vectors."""

from __future__ import annotations

import sympy as sp
from sympy import cos, sin

import symdyn as sd
from symdyn.comparison import Case, Formula, Slide
from symdyn.lecture.letters import constant, ddot, dot, moving, skew, stands_for

theta = sd.coordinates("theta")
omega = sp.Symbol("omega")
i_n, j_n, k = (sp.eye(3).col(axis) for axis in range(3))
TURN = sp.Matrix([[cos(theta), -sin(theta)], [sin(theta), cos(theta)]])
TITLE = "Coordinates transformation of the vector"


def constant_velocity() -> list[Formula]:
    """A b-frame that moves with constant velocity and does not turn."""
    m, v = sp.Symbol("m_P", positive=True), constant("v_O")
    inner, F = moving("r_PO"), constant("F_P")
    rPE, rOE = moving("r_PE"), moving("r_OE")
    n = sd.Frame("n")
    b = n.frame("b", origin=list(v * sd.t))
    P = b.point("P", list(inner))
    position, velocity, acceleration = P.position(), P.velocity(n), P.acceleration(n)
    letters = stands_for(rOE, v * sd.t, 2) | stands_for(rPE, position, 2)
    newton = (m * acceleration, F)
    return [
        Formula("Newton's law in n", (m * ddot(rPE), F), newton, line=3048, renamed=letters),
        Formula("Newton's law in b", (m * ddot(inner), F), newton, line=3050, renamed=letters),
        Formula("r_P", rOE + inner, position, line=3054, latex="r_{P/E}", renamed=letters),
        Formula("velocity of P", dot(rOE) + dot(inner), velocity, line=3056, latex=r"\dot{r}_{P/E}", renamed=letters),
        Formula("acceleration of P", ddot(rOE) + ddot(inner), acceleration, line=3058, latex=r"\ddot{r}_{P/E}", renamed=letters),
        Formula("the same acceleration", ddot(inner), acceleration, line=3060, latex=r"\ddot{r}_{P/E}", renamed=letters),
    ]


def turned_axes() -> list[Formula]:
    """One vector along two pairs of axes."""
    n = sd.Frame("n")
    b = n.frame("b", rotation=sd.rotation.about("Z", theta))
    bx, by = sp.symbols("b_P_x b_P_y")
    P = b.vector([bx, by, 0])
    n_P, b_P = P.components(n), P.components(b)
    i_b, j_b = (b.vector(list(e)).components(n) for e in (i_n, j_n))
    along_x = bx * (cos(theta) * i_n + sin(theta) * j_n)
    along_y = by * (-sin(theta) * i_n + cos(theta) * j_n)
    nx, ny = sp.symbols("n_P_x n_P_y")
    letters = {nx: n_P[0], ny: n_P[1]}
    in_plane = sp.Matrix(n_P[:2])
    basis = sp.Matrix([sp.symbols("i_n j_n")])
    return [
        Formula("P along n", nx * i_n + ny * j_n, n_P, line=3076, also=(3092, 3116), latex="P", renamed=letters),
        Formula("P along b", bx * i_b + by * j_b, n_P, line=3078, also=(3080, 3094, 3096, 3118, 3120), latex="P"),
        Formula("part along i_b", along_x, b_P[0] * i_b, line=3100),
        Formula("part along j_b", along_y, b_P[1] * j_b, line=3100),
        Formula("sum of the parts", along_x + along_y, n_P, line=3102),
        Formula("sorted", (bx * cos(theta) - by * sin(theta)) * i_n + (bx * sin(theta) + by * cos(theta)) * j_n, n_P, line=3104,
                also=(3122,)),
        Formula("i_b", cos(theta) * i_n + sin(theta) * j_n, i_b, line=3108, latex="i_b"),
        Formula("j_b", -sin(theta) * i_n + cos(theta) * j_n, j_b, line=3110, latex="j_b"),
        # Columns times rows, as printed: arrays of components along axes, equal where P_x i_n + P_y j_n is.
        Formula("with the axes", (sp.Matrix([nx, ny]) * basis, TURN * sp.Matrix([bx, by]) * basis),
                (in_plane * basis, in_plane * basis),
                line=3124, renamed=letters),
        Formula("components", TURN * sp.Matrix([bx, by]), in_plane, line=3126, latex="{}^nP"),
        Formula("nRb", TURN, b.rotation(n)[:2, :2], line=3126, latex="{}^nR_b"),
    ]


def unit_vectors() -> list[Formula]:
    """Rates of the unit vectors of a turning frame, and of its rotation."""
    n = sd.Frame("n")
    b = n.frame("b", rotation=sd.rotation.about("Z", theta))
    w = b.angular_velocity()
    i, j = b.vector(list(i_n)), b.vector(list(j_n))
    i_b, j_b = i.components(n), j.components(n)
    di, dj = i.rate(n), j.rate(n)
    letters = {omega: theta.dot}
    axes, n_omega = sp.Matrix.hstack(i_b, j_b), omega * k
    rate = sp.Matrix.hstack(di, dj)
    return [
        Formula("angular velocity", omega * k, w, line=3135, also=(3133,), latex=r"\omega", renamed=letters),
        Formula("rate of i_b", theta.dot * j_b, di, line=3141, latex=r"\dot{i}_b"),
        Formula("rate of i_b by omega", omega * j_b, di, line=3141, latex=r"\dot{i}_b", renamed=letters),
        Formula("rate of i_b by k", omega * k.cross(i_b), di, line=3143, also=(3145,), latex=r"\dot{i}_b", renamed=letters),
        Formula("rate of j_b", -theta.dot * i_b, dj, line=3147, latex=r"\dot{j}_b"),
        Formula("rate of j_b by omega", -omega * i_b, dj, line=3147, latex=r"\dot{j}_b", renamed=letters),
        Formula("rate of j_b by k", omega * k.cross(j_b), dj, line=3149, also=(3151,), latex=r"\dot{j}_b", renamed=letters),
        Formula("nRb", sp.Matrix.hstack(i_n, j_n) * TURN, axes, line=3153, latex="{}^nR_b"),
        Formula("rate of nRb, by columns", sp.Matrix.hstack(n_omega.cross(i_b), n_omega.cross(j_b)), rate, line=3161,
                also=(3159,),
                latex=r"{}^n\dot{R}_b", renamed=letters),
        Formula("rate of nRb", skew(n_omega) * axes, rate, line=3165, also=(3163,), latex=r"{}^n\dot{R}_b", renamed=letters),
    ]


CASES = (
    Case("constant-velocity-frame", "A frame that moves with constant velocity", Slide("2.2", "Inertial reference frame", 3044),
         constant_velocity),
    Case("plane-transformation", "Components of a vector along turned axes", Slide("2.2", TITLE, 3072), turned_axes),
    Case("rotating-unit-vectors", "Rates of the unit vectors of a turning frame",
         Slide("2.2", "회전하는 단위 벡터의 시간에 대한 미분", 3129), unit_vectors),
)
