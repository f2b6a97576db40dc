"""Chapter 5.6: Newton's law and Euler's equation of link 2 in n- and in bG2-components."""

from __future__ import annotations

import sympy as sp

import symdyn as sd
from symdyn.comparison.case import Case, Erratum, Formula, Remark, Slide
from symdyn.comparison.proofs import numeric_derivative
from symdyn.frames.product import times
from symdyn.lecture.arm_in_space import ArmInSpace, arm_in_space
from symdyn.lecture.chapter_5_spatial_velocity import ARM, Named

M_G, F_G = r"{}^{b_{G2}}\mathbf M_{G_2}", r"{}^{b_{G2}}\mathbf F_{G_2}"


class AtCenter(Named):
    """The slides' symbols for bG2, and the resultant there from the recursion, [M; F] in bG2."""

    def __init__(self, arm: ArmInSpace) -> None:
        super().__init__(arm)
        n, bG, vector, matrix = arm.n, arm.bG2, arm.vector, arm.matrix
        turn = bG.rotation(arm.b2)
        self.omega_of_t, self.v_of_t = bG.angular_velocity(n, components=bG), bG.velocity(n, components=bG)
        self.omega, self.v = vector("bG2_omega_bG2", self.omega_of_t), vector("bG2_v_G2", self.v_of_t)
        self.omega_dot = vector("bG2_omega_bG2_dot", sd.rate(self.omega_of_t))
        self.v_dot = vector("bG2_v_G2_dot", sd.rate(self.v_of_t))
        self.n_omega, self.n_v = vector("n_omega_bG2", bG.angular_velocity(n)), vector("n_v_G2", bG.velocity(n))
        self.n_alpha, self.n_a = vector("n_alpha_bG2", bG.angular_acceleration(n)), vector("n_a_G2", bG.acceleration(n))
        self.n_R_G = matrix("n_R_bG2", bG.rotation(n))
        self.I_G = matrix("bG2_I_G2", times(turn.T, arm.I2, turn))
        self.n_I_G = matrix("n_I_G2", times(arm.b2.rotation(n), arm.I2, arm.b2.rotation(n).T))
        self.resultant = times(sp.diag(turn.T, turn.T), arm.of_link2("f_G"))
        self.n_M, self.n_F = (times(bG.rotation(n), half) for half in (self.resultant[:3, :], self.resultant[3:, :]))


def force() -> list[Formula]:
    """Newton's law in n- and in bG2-components."""
    arm = arm_in_space()
    s = AtCenter(arm)
    n, bG, m, R = arm.n, arm.bG2, arm.m2, s.n_R_G
    R_dot = arm.matrix("n_R_bG2_dot", sd.rate(bG.rotation(n)))
    bG_a = arm.vector("bG2_a_G2", bG.acceleration(n, components=bG))
    a, F = bG.acceleration(n), s.resultant[3:, :]
    turned = s.n_omega.cross(R * s.v) + R * s.v_dot
    return [
        s.formula("F_G in n", m * s.n_a, s.n_F, 8754, also=(8775,), latex=r"{}^n\mathbf F_G"),
        s.formula("v_G in n", R * s.v, sd.rate(bG.position(n)), 8773, latex=r"{}^n\mathbf v_{G/E}"),
        s.formula("a_G, product rule", R_dot * s.v + R * s.v_dot, a, 8774, latex=r"{}^n\mathbf a_{G/E}"),
        s.formula("a_G, with omega", turned, a, 8774, latex=r"{}^n\mathbf a_{G/E}"),
        s.formula("F_G in n, with omega", m * turned, s.n_F, 8775, latex=r"{}^n\mathbf F_G"),
        s.formula("F_G in bG, multiplied by R", m * s.bG_R_n * s.n_a, F, 8776, latex=F_G),
        s.formula("F_G in bG", m * bG_a, F, 8776, latex=F_G),
        s.formula("F_G in bG, with omega, multiplied by R", m * s.bG_R_n * turned, F, 8776, latex=F_G),
        s.formula("F_G in bG, with omega", m * (s.omega.cross(s.v) + s.v_dot), F, 8776, latex=F_G),
    ]


def moment() -> list[Formula]:
    """Euler's equation in n- and in bG2-components."""
    arm = arm_in_space()
    s = AtCenter(arm)
    n, bG, R, n_I = arm.n, arm.bG2, s.n_R_G, s.n_I_G
    R_dot = arm.matrix("n_R_bG2_dot", sd.rate(bG.rotation(n)))
    bG_alpha = arm.vector("bG2_alpha_bG2", bG.angular_acceleration(n, components=bG))
    alpha, M = bG.angular_acceleration(n), s.resultant[:3, :]
    euler = s.I_G * s.omega_dot + s.omega.cross(s.I_G * s.omega)
    mixed = Erratum("R_dot = omega x R needs omega in n-components, but the slide takes it in b_G, and omega x omega is not 0.",
                    numeric_derivative("it must be the rate of the n-components of omega", of=bG.angular_velocity(n)))
    latex = r"{}^n\boldsymbol\alpha_{b_G/n}"
    return [
        s.formula("M_G in n", n_I * s.n_alpha + s.n_omega.cross(n_I * s.n_omega), s.n_M, 8790, also=(8824,),
                  latex=r"{}^n\mathbf M_G"),
        s.formula("omega in n", R * s.omega, bG.angular_velocity(n), 8812, latex=r"{}^n\boldsymbol\omega_{b_G/n}"),
        s.formula("alpha, product rule", R_dot * s.omega + R * s.omega_dot, alpha, 8818, latex=latex),
        s.formula("alpha, with omega x R", s.omega.cross(R * s.omega) + R * s.omega_dot, alpha, 8818, latex=latex,
                  errata=[mixed]),
        s.formula("alpha, with omega x omega", s.omega.cross(s.n_omega) + R * s.omega_dot, alpha, 8818, latex=latex,
                  errata=[mixed]),
        s.formula("alpha", R * s.omega_dot, alpha, 8818, latex=latex),
        s.formula("M_G in n, with R", n_I * R * s.omega_dot + (R * s.omega).cross(n_I * R * s.omega), s.n_M, 8826,
                  latex=r"{}^n\mathbf M_G"),
        s.formula("M_G in bG, with alpha", s.I_G * bG_alpha + s.omega.cross(s.I_G * s.omega), M, 8832, latex=M_G),
        s.formula("M_G in bG", euler, M, 8834, latex=M_G),
        s.formula("M_G of chapter 5.5", euler, M, 7777,
                  slide=Slide("5.5", "Application of Recursive Newton-Euler Equation", 7777), latex=r"\mathbf M_{G_i}"),
    ]


CASES = (
    Case("spatial-force", "Newton's law in the components of bG2", Slide("5.6", ARM, 8744), force, remarks=[Remark(
        "E and G are points and have no axes: the components of omega are those in n and those of v in b_G, as the next line has "
        "them.", 8774)]),
    Case("spatial-moment", "Euler's equation in the components of bG2", Slide("5.6", ARM, 8780), moment),
)
