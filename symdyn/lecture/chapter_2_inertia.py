"""Chapter 2.1: kinetic energy and inertia in turned axes, the rate of I omega, and the moment equation about G."""

from __future__ import annotations

from typing import Any

import sympy as sp

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, proofs
from symdyn.frames.product import times
from symdyn.frames.rigid_body import (
    center_of_mass,
    equivalent_force_system,
    kinetic_energy,
    moment_equation,
    point_inertia,
)
from symdyn.lecture.chapter_2_moment import F1, F2, TITLE, Body, inertia_of, m1, m2, m_system, omega, r1, r2, turning_frame
from symdyn.lecture.letters import constant, ddot, dot, moving, moving_matrix, stands_for, symmetric

half = sp.Rational(1, 2)
R = moving_matrix("R")
b_I = symmetric("b_I")
b_omega = constant("b_omega")


class Turned:
    """A turning frame, and what the letters of the slides stand for."""

    def __init__(self) -> None:
        self.n = sd.Frame("n")
        self.b = turning_frame(self.n)
        self.R = self.b.rotation(self.n)
        self.omega = self.b.angular_velocity(seen_from=self.n, components=self.n)
        self.alpha = self.b.angular_acceleration(seen_from=self.n, components=self.n)
        self.b_omega = self.b.angular_velocity(seen_from=self.n, components=self.b)
        self.letters: dict[Any, Any] = {
            **stands_for(R, self.R, 1), **stands_for(b_omega, self.b_omega), **stands_for(omega, self.omega),
            **stands_for(dot(omega), self.alpha)}


def energy() -> list[Formula]:
    """Energy of two particles on a body whose point O is at rest."""
    masses, positions = [m1, m2], [r1, r2]
    w = sp.Matrix(list(omega))
    at_rest = sp.zeros(3, 1)
    turning = stands_for(dot(r1), w.cross(r1)) | stands_for(dot(r2), w.cross(r2))
    I_O = inertia_of(m1, r1) + inertia_of(m2, r2)
    T1, T = (kinetic_energy(sum(ms), point_inertia(ms, rs), at_rest, w, center_of_mass(ms, rs))
             for ms, rs in ((masses[:1], positions[:1]), (masses, positions)))
    return [
        Formula("T_1", half * m1 * dot(r1).dot(dot(r1)), T1, line=2550, renamed=turning),
        Formula("T", half * m1 * dot(r1).dot(dot(r1)) + half * m2 * dot(r2).dot(dot(r2)), T, line=2550, renamed=turning),
        Formula("T_1 by omega", half * m1 * w.cross(r1).dot(w.cross(r1)), T1, line=2554),
        Formula("I_O,1", inertia_of(m1, r1), point_inertia([m1], [r1]), line=2556, latex="I_{O,1}"),
        Formula("I_O", I_O, point_inertia(masses, positions), line=2558),
        Formula("T by I_O", (half * w.T * I_O * w)[0], T, line=2560, also=(2566,), latex="T"),
    ]


def transformation() -> list[Formula]:
    """The same energy in the axes of the body."""
    turned = Turned()
    r_b = [constant("b_r_1"), constant("b_r_2")]
    b_inertia = point_inertia([m1, m2], r_b)
    n_inertia = point_inertia([m1, m2], [turned.R * r for r in r_b])
    T = kinetic_energy(m1 + m2, n_inertia, sp.zeros(3, 1), turned.omega)
    of_body = stands_for(b_I, b_inertia)
    letters = {**turned.letters, **of_body}
    w = sp.Matrix(list(omega))
    return [
        Formula("T in the b-frame", (half * b_omega.T * b_I * b_omega)[0], T, line=2570, renamed=letters),
        Formula("T with bRn omega", (half * (R.T * w).T * b_I * (R.T * w))[0], T, line=2570, renamed=letters),
        Formula("T with the transpose", (half * w.T * R.T.T * b_I * R.T * w)[0], T, line=2570, renamed=letters),
        Formula("T with nRb", (half * w.T * R * b_I * R.T * w)[0], T, line=2570, renamed=letters),
        Formula("nI_O", R * b_I * R.T, n_inertia, line=2576, also=(2578, 2600), latex="{}^nI_O", renamed=letters),
    ]


def rate_of_angular_momentum() -> list[Formula]:
    """d/dt (nI_O n_omega), with nI_O = nRb bI_O bRn."""
    turned = Turned()
    derived = turned.R * moment_equation(b_I, turned.b_omega, turned.R.T * turned.alpha)
    w, wd = omega, dot(omega)
    letters = turned.letters
    n_I, n_I_wd = times(R, b_I, R.T), times(R, b_I, R.T, wd)
    by_rates = times(sd.rate(R), b_I, R.T, w) + times(R, sp.zeros(3, 3), R.T, w) + times(R, b_I, sd.rate(R.T), w) + n_I_wd
    by_omega = w.cross(times(n_I, w)) + times(R, b_I, b_omega.cross(R.T * w)) + n_I_wd
    v, psi = constant("v"), sd.coordinates("psi")
    n = sd.Frame("n")
    b = n.frame("b", rotation=sd.rotation.about("Z", psi))
    b_v, of_n = b.rotation(n).T * v, n.angular_velocity(seen_from=b, components=b)
    fixed = proofs.numeric_derivative("v is fixed in the n-frame.", of=b_v)
    other_way = Erratum("Seen from the body, the n-frame turns with omega_n/b = -omega_b/n; the sum stays right, since "
                        "omega x omega = 0.", fixed)
    return [
        Formula("with nRb", sd.rate(times(n_I, w)), derived, line=2590, renamed=letters),
        Formula("product rule", by_rates, derived, line=2596, also=(2594,), renamed=letters),
        Formula("with omega", by_omega, derived, line=2598, renamed=letters),
        Formula("rate of bRn, on any vector", b_omega.cross(b_v), of_n.cross(b_v), line=2598, errata=[other_way],
                renamed=stands_for(b_omega, b.angular_velocity(components=b)), latex=r"{}^b\dot{R}_n v"),
        Formula("shorter", w.cross(times(n_I, w)) + n_I_wd, derived, line=2608, renamed=letters),
    ]


def about_G() -> list[Formula]:
    """The moment equation about the centre of mass."""
    body = Body()
    O = center_of_mass([m1, m2], body.r)
    from_G = [r - O for r in body.r]
    I_G = point_inertia([m1, m2], from_G)
    derived = sp.Matrix(moment_equation(I_G, body.omega, body.alpha))
    rG1, rG2, rGG, rGE = (moving(name) for name in ("r_1G", "r_2G", "r_GG", "r_GE"))
    n_I = inertia_of(m1, rG1) + inertia_of(m2, rG2)
    letters = body.letters | stands_for(rG1, from_G[0]) | stands_for(rG2, from_G[1]) | stands_for(rGG, sp.zeros(3, 1))
    w, wd = omega, dot(omega)
    acting = [equivalent_force_system(F, r).moment for F, r in ((F1, rG1), (F2, rG2))]
    turning = n_I * wd + w.cross(n_I * w)
    return [
        Formula("O at G", m_system * rGG.cross(ddot(rGE)) + w.cross(n_I * w) + n_I * wd, derived, line=2623, renamed=letters),
        Formula("moment equation about G", turning, derived, line=2625, also=(2631,), renamed=letters, latex=r"\Sigma M_G"),
        Formula("moment of the forces about G", rG1.cross(F1) + rG2.cross(F2), acting[0] + acting[1], line=2635,
                latex=r"\Sigma M_G"),
    ]


CASES = (
    Case("kinetic-energy-of-rotation", "Kinetic energy of a turning body",
         Slide("2.1", "Rotational transformation of the inertia matrix - Kinetic energy of the rotating body", 2539), energy),
    Case("inertia-transformation", "Inertia in turned axes",
         Slide("2.1", "Rotational transformation of the inertia matrix", 2564), transformation),
    Case("rate-of-angular-momentum", "The rate of I omega", Slide("2.1", TITLE, 2578), rate_of_angular_momentum),
    Case("moment-about-G", "The moment equation about the centre of mass", Slide("2.1", TITLE, 2614), about_G),
)
