"""Chapter 5.6: velocities of the frames b2 and bG2, in n- and in b-components and as spatial vectors."""

from __future__ import annotations

from typing import Any

import sympy as sp

import symdyn as sd
from symdyn.comparison.case import Case, Erratum, Formula, Slide
from symdyn.comparison.proofs import other
from symdyn.lecture.arm_in_space import ArmInSpace, arm_in_space, block, tilde
from symdyn.spatial.sixvectors import motion_transform

ARM = "Inverse Dynamics of 2-Link Arm"


class Named:
    """The slides' symbols for the velocities of an arm in space, and formulas that know them.

    n_ stands before n-components; the letters without it have the axes of their own link. omega_1 is omega_b1/n, v_O1 v_O1/E.
    """

    def __init__(self, arm: ArmInSpace) -> None:
        n, b1, b2, bG = arm.n, arm.b1, arm.b2, arm.bG2
        self.arm, vector, matrix = arm, arm.vector, arm.matrix
        O1, O2, G2 = b1.point("O1"), b2.point("O2"), bG.point("G2")
        self.n_omega_1 = vector("n_omega_b1", b1.angular_velocity(n))
        self.n_omega_2 = vector("n_omega_b2", b2.angular_velocity(n))
        self.n_omega_21 = vector("n_omega_b2_b1", b2.angular_velocity(b1, components=n))
        self.omega_1 = vector("b1_omega_b1", b1.angular_velocity(n, components=b1))
        self.omega_2 = vector("b2_omega_b2", b2.angular_velocity(n, components=b2))
        self.n_v_O1, self.v_O1 = vector("n_v_O1", O1.velocity(n)), vector("b1_v_O1", O1.velocity(n, components=b1))
        self.n_v_O2, self.v_O2 = vector("n_v_O2", O2.velocity(n)), vector("b2_v_O2", O2.velocity(n, components=b2))
        self.n_r_O1, self.n_r_O2 = vector("n_r_O1", O1.position(n)), vector("n_r_O2", O2.position(n))
        self.n_r_21 = vector("n_r_O2_O1", O2.position(n) - O1.position(n))
        self.r_21 = vector("b1_r_O2_O1", arm.r_O2)
        self.n_r_G = vector("n_r_G2_O2", G2.position(n) - O2.position(n))
        self.r_G = vector("b2_r_G2_O2", arm.r_G2)
        # The axis of the joint is z of b2: the upper half of S.
        self.n_k, self.k = vector("n_k_b2", b2.rotation(n)[:, 2]), vector("b2_k_b2", arm.of_link2("S")[:3])
        self.n_R_1 = matrix("n_R_b1", b1.rotation(n))
        self.b1_R_n = matrix("b1_R_n", n.rotation(b1))
        self.b2_R_1 = matrix("b2_R_b1", b1.rotation(b2))
        self.b2_R_n = matrix("b2_R_n", n.rotation(b2))
        self.bG_R_2 = matrix("bG2_R_b2", b2.rotation(bG))
        self.bG_R_n = matrix("bG2_R_n", n.rotation(bG))
        self.theta_dot = arm.q2.dot
        self.X = block([[self.b2_R_1, 0], [-self.b2_R_1 * tilde(self.r_21), self.b2_R_1]])
        self.X_G = block([[self.bG_R_2, 0], [-self.bG_R_2 * tilde(self.r_G), self.bG_R_2]])
        self.S = sp.Matrix.vstack(self.k, sp.zeros(3, 1))
        self.v_1 = sp.Matrix.vstack(self.omega_1, self.v_O1)
        self.v_2 = sp.Matrix.vstack(self.omega_2, self.v_O2)

    def formula(self, name: str, printed: Any, derived: Any, line: int, **options: Any) -> Formula:
        return self.arm.formula(name, printed, derived, line, **options)


def transform_to_center(arm: ArmInSpace) -> sp.Matrix:
    """bG2_X_b2, (6, 6)."""
    return sp.Matrix(motion_transform(sp.Matrix(arm.bG2.rotation(arm.b2)), list(arm.r_G2)))


def positions() -> list[Formula]:
    """O_2 from E, and its velocity, by differentiating a rotation matrix."""
    arm = arm_in_space()
    s = Named(arm)
    n, b1, b2 = arm.n, arm.b1, arm.b2
    O2 = b2.point("O2")
    theta = sp.Symbol("theta")
    R_dot = sp.Matrix(arm.matrix("n_R_b1_dot", sd.rate(b1.rotation(n))))
    r_dot = arm.vector("b1_r_O2_O1_dot", sd.rate(O2.position(b1)))
    return [
        s.formula("r_O2", s.n_r_O1 + s.n_r_21, O2.position(n), 8111, latex=r"{}^n\mathbf r_{O_2/E}"),
        s.formula("r_O2 with R", s.n_r_O1 + s.n_R_1 * s.r_21, O2.position(n), 8115, also=(8131, 8153),
                  latex=r"{}^n\mathbf r_{O_2/E}"),
        s.formula("R", sp.Matrix([[sp.cos(theta), -sp.sin(theta)], [sp.sin(theta), sp.cos(theta)]]),
                  sd.rotation.about("Z", theta)[:2, :2], 8119, latex=r"{}^n\mathbf R_b"),
        s.formula("r_O2_dot", s.n_v_O1 + R_dot * s.r_21 + s.n_R_1 * r_dot, O2.velocity(n), 8137,
                  latex=r"{}^n\dot{\mathbf r}_{O_2/E}"),
        s.formula("R_dot", tilde(s.n_omega_1) * s.n_R_1, sd.rate(b1.rotation(n)), 8141, latex=r"{}^n\dot{\mathbf R}_b"),
        s.formula("r_O2_dot with omega", s.n_v_O1 + s.n_omega_1.cross(s.n_R_1 * s.r_21) + s.n_R_1 * r_dot, O2.velocity(n), 8143,
                  also=(8158,), latex=r"{}^n\dot{\mathbf r}_{O_2/E}"),
        s.formula("r_O2_dot of a constant r", s.n_v_O1 + s.n_omega_1.cross(s.n_R_1 * s.r_21), O2.velocity(n), 8164,
                  latex=r"{}^n\dot{\mathbf r}_{O_2/E}"),
        s.formula("v_O2", s.n_v_O1 + s.n_omega_1.cross(s.n_r_21), O2.velocity(n), 8168, latex=r"{}^n\mathbf v_{O_2/E}"),
    ]


def in_n_components() -> list[Formula]:
    """omega_b2/n and v_O2/E in n-components, outwards from the base."""
    arm = arm_in_space()
    s = Named(arm)
    n, b2 = arm.n, arm.b2
    planar = sd.systems.two_link_arm().recursive().link(1).v
    theta_1_dot, k_1 = sd.coordinates("q1").dot, sp.Matrix([0, 0, 1])
    omega_n, v_E = sp.zeros(3, 1), sp.zeros(3, 1)  # line 8223
    omega_2, v_O2 = b2.angular_velocity(n), b2.velocity(n)
    return [
        Formula("omega of b2, first print", None, None, line=8179,
                unreadable="the right side of the equation was lost, the transcription ends after the equals sign"),
        s.formula("omega of b2 against b1", s.n_k * s.theta_dot, b2.angular_velocity(arm.b1, components=n), 8191,
                  latex=r"{}^n\boldsymbol\omega_{b_2/b_1}"),
        s.formula("omega of b2", s.n_omega_1 + s.n_omega_21, omega_2, 8193, latex=r"{}^n\boldsymbol\omega_{b_2/n}"),
        s.formula("omega of b2 with k", s.n_omega_1 + s.n_k * s.theta_dot, omega_2, 8195,
                  also=(8207, 8227, 8243, 8265, 8285, 8305, 8328), latex=r"{}^n\boldsymbol\omega_{b_2/n}"),
        s.formula("v_O2", s.n_omega_1.cross(s.n_r_21) + s.n_v_O1, v_O2, 8211, also=(8229, 8249, 8267, 8285, 8305, 8334),
                  latex=r"{}^n\mathbf v_{O_2/E}"),
        Formula("omega of b1", omega_n + k_1 * theta_1_dot, planar[:3, :], line=8219, latex=r"{}^n\boldsymbol\omega_{b_1/n}"),
        Formula("v_O1", omega_n.cross(s.n_r_O1) + v_E, planar[3:, :], line=8221, latex=r"{}^n\mathbf v_{O_1/E}"),
    ]


def in_b_components() -> list[Formula]:
    """The same in b2-components, and as [omega; v] = X [omega; v] + S q_dot."""
    arm = arm_in_space()
    s = Named(arm)
    v = arm.of_link2("v")
    omega_2, v_O2 = v[:3, :], v[3:, :]
    R, R_n = s.b2_R_1, s.b2_R_1 * s.b1_R_n
    mixed = arm.vector("b_omega_b1", arm.b1.angular_velocity(arm.n, components=arm.b1))
    axes = Erratum("b2_R_n takes n-components, and the slide gives it omega_b1/n in components of b; the next line has n.",
                   other("adding the joint's turn in n-components and then going over to b2 must give the same",
                         lambda: arm.n.rotation(arm.b2) * (arm.b1.angular_velocity(arm.n)
                                                           + arm.b2.angular_velocity(arm.b1, components=arm.n))))
    latex = r"{}^{b_2}\boldsymbol\omega_{b_2/n}", r"{}^{b_2}\mathbf v_{O_2/E}"
    return [
        s.formula("omega of b2, multiplied by R", s.b2_R_n * mixed + s.b2_R_n * s.n_k * s.theta_dot, omega_2, 8273,
                  latex=latex[0], errata=[axes]),
        s.formula("v_O2, multiplied by R", (s.b2_R_n * s.n_omega_1).cross(s.b2_R_n * s.n_r_21) + s.b2_R_n * s.n_v_O1, v_O2, 8273,
                  latex=latex[1]),
        s.formula("b2_R_n", R * s.b1_R_n, arm.n.rotation(arm.b2), 8275, latex=r"{}^{b_2}\mathbf R_n"),
        s.formula("omega of b2, over b1", R_n * s.n_omega_1 + s.b2_R_n * s.n_k * s.theta_dot, omega_2, 8277, also=(8289,),
                  latex=latex[0]),
        s.formula("v_O2, over b1", (R_n * s.n_omega_1).cross(R_n * s.n_r_21) + R_n * s.n_v_O1, v_O2, 8277, also=(8289,),
                  latex=latex[1]),
        s.formula("omega of b2", R * s.omega_1 + s.k * s.theta_dot, omega_2, 8293,
                  also=(8297, 8309, 8394, 8400, 8423, 8429, 8453, 8459, 8481, 8504, 8533, 8560, 8590, 8617, 8643),
                  latex=latex[0]),
        s.formula("v_O2", (R * s.omega_1).cross(R * s.r_21) + R * s.v_O1, v_O2, 8293,
                  also=(8396, 8425, 8455, 8483, 8506, 8510, 8535, 8539, 8562, 8566, 8592, 8597, 8619, 8645), latex=latex[1]),
        s.formula("v_O2, product first", R * s.omega_1.cross(s.r_21) + R * s.v_O1, v_O2, 8297, also=(8309, 8488, 8492),
                  latex=latex[1]),
        s.formula("v_O2, factors exchanged", -R * s.r_21.cross(s.omega_1) + R * s.v_O1, v_O2, 8309, latex=latex[1]),
        s.formula("X", s.X, arm.of_link2("X"), 8312, latex=r"{}^{b_2}\mathbf X_{b_1}"),
        s.formula("S", s.S, arm.of_link2("S"), 8312, latex=r"\mathbf S_{b_2}"),
        s.formula("v", s.X * s.v_1 + s.S * s.theta_dot, v, 8312, also=(8314, 9040), latex=r"{}^{b_2}\hat{\mathbf v}_{b_2}"),
    ]


def of_center() -> list[Formula]:
    """The frame bG2 at the centre of mass of link 2."""
    arm = arm_in_space()
    s = Named(arm)
    n, bG = arm.n, arm.bG2
    R, R_n = s.bG_R_2, s.bG_R_2 * s.b2_R_n
    X_G = transform_to_center(arm)
    v_G = X_G * arm.of_link2("v")
    omega, v = v_G[:3, :], v_G[3:, :]
    # The recursion's own v_G has axes parallel to b2.
    own = sp.diag(bG.rotation(arm.b2).T, bG.rotation(arm.b2).T) * arm.of_link2("v_G")
    latex = r"{}^{b_{G2}}\boldsymbol\omega_{b_{G2}/n}", r"{}^{b_{G2}}\mathbf v_{G_2/E}"
    return [
        s.formula("omega in n-components", s.n_omega_2, bG.angular_velocity(n), 8322, also=(8346, 8362, 8378),
                  latex=r"{}^n\boldsymbol\omega_{b_{G2}/n}"),
        s.formula("v_G2 in n-components", s.n_omega_2.cross(s.n_r_G) + s.n_v_O2, bG.velocity(n), 8324, also=(8346, 8362, 8378),
                  latex=r"{}^n\mathbf v_{G_2/E}"),
        s.formula("omega, multiplied by R", s.bG_R_n * s.n_omega_2, omega, 8350, latex=latex[0]),
        s.formula("v_G2, multiplied by R", (s.bG_R_n * s.n_omega_2).cross(s.bG_R_n * s.n_r_G) + s.bG_R_n * s.n_v_O2, v, 8350,
                  latex=latex[1]),
        s.formula("bG2_R_n", s.bG_R_2 * s.b2_R_n, n.rotation(bG), 8352, latex=r"{}^{b_{G2}}\mathbf R_n"),
        s.formula("omega, over b2", R_n * s.n_omega_2, omega, 8354, also=(8366,), latex=latex[0]),
        s.formula("v_G2, over b2", (R_n * s.n_omega_2).cross(R_n * s.n_r_G) + R_n * s.n_v_O2, v, 8354, also=(8366,),
                  latex=latex[1]),
        s.formula("omega", R * s.omega_2, omega, 8368, also=(8370, 8382), latex=latex[0]),
        s.formula("v_G2", (R * s.omega_2).cross(R * s.r_G) + R * s.v_O2, v, 8368, latex=latex[1]),
        s.formula("v_G2, factors exchanged", -R * s.r_G.cross(s.omega_2) + R * s.v_O2, v, 8370, also=(8384,), latex=latex[1]),
        s.formula("X of G2", s.X_G, X_G, 8386, latex=r"{}^{b_{G2}}\mathbf X_{b_2}"),
        s.formula("v of G2", s.X_G * s.v_2, own, 8386, also=(9042,), latex=r"{}^{b_{G2}}\hat{\mathbf v}_{b_{G2}}"),
    ]


CASES = (
    Case("spatial-positions", "O_2 from E and its velocity", Slide("5.6", "Relative Motion", 8098), positions),
    Case("spatial-velocities-n", "Velocities of b2 in n-components", Slide("5.6", ARM, 8172), in_n_components),
    Case("spatial-velocities-b", "Velocities of b2 in b2-components; X and S", Slide("5.6", ARM, 8259), in_b_components),
    Case("spatial-velocity-of-center", "Velocities of bG2", Slide("5.6", ARM, 8316), of_center),
)
