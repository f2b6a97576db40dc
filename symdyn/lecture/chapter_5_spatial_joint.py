"""Chapter 5.6: force and moment on link 2 at G_2 and at O_2 as spatial vectors, and the torque in its joint."""

from __future__ import annotations

from functools import cache

import sympy as sp

import symdyn as sd
from symdyn.comparison.case import Case, Erratum, Formula, Slide
from symdyn.comparison.proofs import Proof
from symdyn.frames.product import times
from symdyn.lecture.arm_in_space import Letters, arm_in_space, block, tilde
from symdyn.lecture.chapter_5_spatial_velocity import ARM
from symdyn.model.symbols import symbols_of
from symdyn.spatial.sixvectors import force_cross, motion_transform

M_G, F_G = r"{}^{b_{G2}}\mathbf M_{G_2}", r"{}^{b_{G2}}\mathbf F_{G_2}"

STAR = "The velocity product of a force is v x* I v; the star is missing."


class LinkAlone(Letters):
    """Link 2 cut free in O_2 and moving anyhow: the recursion shows what it needs there.

    In O_3 link 3 acts on it with -f_O3 and -m_O3. The frame b2 has its origin in O_2, bG2 at G_2 is turned against it by
    gamma, b3 at O_3 by beta.
    """

    def __init__(self) -> None:
        super().__init__()
        angles = sd.coordinates("q4 q5 q6")
        m2, gamma, beta, c2, e2, l2, h2, *moments = sd.parameters("m2 gamma beta c2 e2 l2 h2 I2_xx I2_xy I2_xz I2_yy I2_yz I2_zz")
        xx, xy, xz, yy, yz, zz = moments
        I2 = sp.Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        f_3, m_3 = (sp.Matrix(sd.inputs(f"{letter}3_x {letter}3_y {letter}3_z")) for letter in "fm")
        n = sd.Frame("n")
        b2 = n.frame("b2", rotation=sd.rotation.from_euler("ZYX", angles))
        bG = b2.frame("bG2", rotation=sd.rotation.about("X", gamma), origin=[c2, 0, e2])
        b3 = b2.frame("b3", rotation=sd.rotation.about("X", beta), origin=[l2, h2, 0])
        R_3 = b3.rotation(b2)

        system = sd.System("link2")
        link = system.add_body("link2", mass=m2, inertia=I2, com=[c2, 0, e2])
        system.add_joint(sd.Free("cut", system.ground, link, [*sd.coordinates("q1 q2 q3"), *angles], velocity="body"))
        system.add_force(link, list(-R_3 * f_3), point=[l2, h2, 0], frame=link, name="reaction")
        system.add_torque(link, list(-R_3 * m_3), frame=link, name="reaction_moment")
        equations = system.recursive()
        f, at_G, v_G, a_G, I = (equations.explicit(f"{name}_1", simplify=False) for name in ("f", "f_G", "v_G", "a_G", "I"))

        self.m2, self.f, self.I_b2 = m2, f, I
        self.X_back = sp.Matrix(motion_transform(b2.rotation(bG), list(b2.position(bG))))
        self.X_star_G, self.X_star_3 = (sp.Matrix(motion_transform(b.rotation(b2), list(b.position(b2)))).T for b in (bG, b3))
        vector, matrix, to_n, to_bG = self.vector, self.matrix, b2.rotation(n), b2.rotation(bG)
        # The recursion's axes are those of b2.
        self.f_G, self.v_G = (times(sp.diag(to_bG, to_bG), value) for value in (at_G, v_G))
        self.omega, self.v = vector("bG2_omega_bG2", self.v_G[:3, :]), vector("bG2_v_G2", self.v_G[3:, :])
        self.omega_dot = vector("bG2_omega_bG2_dot", times(to_bG, a_G[:3, :]))
        self.v_dot = vector("bG2_v_G2_dot", times(to_bG, a_G[3:, :]))
        self.I_G = matrix("bG2_I_G2", times(to_bG, I2, to_bG.T))
        self.n_f, self.n_m, self.n_F, self.n_M = (times(to_n, half) for half in (f[3:, :], f[:3, :], at_G[3:, :], at_G[:3, :]))
        self.n_f_2, self.n_m_2 = vector("n_f_O2", self.n_f), vector("n_m_O2", self.n_m)
        self.n_f_3, self.n_m_3 = vector("n_f_O3", times(to_n, R_3, f_3)), vector("n_m_O3", times(to_n, R_3, m_3))
        self.b2_f_3, self.b2_m_3 = vector("b2_f_O3", R_3 * f_3), vector("b2_m_O3", R_3 * m_3)
        self.f_3, self.m_3 = vector("b3_f_O3", f_3), vector("b3_m_O3", m_3)
        self.n_F_G, self.n_M_G = vector("n_F_G2", self.n_F), vector("n_M_G2", self.n_M)
        self.b2_F, self.b2_M = vector("b2_F_G2", at_G[3:]), vector("b2_M_G2", at_G[:3])
        self.F, self.M = vector("bG2_F_G2", to_bG * at_G[3:, :]), vector("bG2_M_G2", to_bG * at_G[:3, :])
        self.n_r_2G, self.n_r_3G = vector("n_r_O2_G2", -bG.position(n)), vector("n_r_O3_G2", b3.position(n) - bG.position(n))
        self.n_r_G3, self.n_r_23 = vector("n_r_G2_O3", bG.position(n) - b3.position(n)), vector("n_r_O2_O3", -b3.position(n))
        self.b2_r_2G, self.b2_r_23 = vector("b2_r_O2_G2", -bG.position(b2)), vector("b2_r_O2_O3", -b3.position(b2))
        self.r_2G, self.r_23 = vector("bG2_r_O2_G2", b2.position(bG)), vector("b3_r_O2_O3", b2.position(b3))
        self.b2_R_n = matrix("b2_R_n", n.rotation(b2))
        self.R_G, self.R_3 = matrix("b2_R_bG2", bG.rotation(b2)), matrix("b2_R_b3", R_3)


@cache
def link_alone() -> LinkAlone:
    """The link, derived once for all cases."""
    return LinkAlone()


def at_center() -> list[Formula]:
    """f = I a + v x* I v at G_2."""
    s = link_alone()
    m, f = s.m2, s.f_G
    I_hat = block([[s.I_G, 0], [0, m * sp.eye(3)]])
    v, a = sp.Matrix.vstack(s.omega, s.v), sp.Matrix.vstack(s.omega_dot, s.v_dot)
    v_motion = block([[tilde(s.omega), 0], [tilde(s.v), tilde(s.omega)]])
    v_force = block([[tilde(s.omega), tilde(s.v)], [0, tilde(s.omega)]])
    motion_for_force = Erratum(
        "I v is a momentum, which turns like a force, with v x*; here the star of line 8859 is missing, and v x is for motions.",
        Proof("limit", "with m2 = 0 the lower half must vanish, since without mass no force is needed",
              lambda f: sp.Matrix(f)[3:, :].applyfunc(lambda e: e.subs({s: 0 for s in symbols_of(e) if s.name == "m2"}))),
        slip=STAR)
    latex = r"{}^{b_{G2}}\hat{\mathbf f}^B_{G_2}"
    return [
        s.formula("M_G2", s.I_G * s.omega_dot + s.omega.cross(s.I_G * s.omega), f[:3, :], 8846, also=(8852,), latex=M_G),
        s.formula("F_G2", m * (s.omega.cross(s.v) + s.v_dot), f[3:, :], 8848, latex=F_G),
        s.formula("F_G2, multiplied out", m * s.v_dot + m * s.omega.cross(s.v), f[3:, :], 8852, latex=F_G),
        s.formula("I of G2", I_hat, s.X_back.T * s.I_b2 * s.X_back, 8856, latex=r"{}^{b_{G2}}\hat{\mathbf I}_{G_2}"),
        s.formula("v x* of G2", v_force, sp.Matrix(force_cross(list(s.v_G))), 8856,
                  latex=r"{}^{b_{G2}}\hat{\mathbf v}_{b_{G2}}\times^*"),
        s.formula("f of G2", I_hat * a + v_force * I_hat * v, f, 8856, also=(8859,), latex=latex),
        s.formula("f of G2, summary", I_hat * a + v_motion * I_hat * v, f, 9048, latex=latex, errata=[motion_for_force]),
    ]


def force_at_joint() -> list[Formula]:
    """Force of link 1 on link 2 in O_2."""
    s = link_alone()
    b2, b2_f = r"{}^{b_2}\mathbf f_{O_2}", s.f[3:, :]
    return [
        s.formula("F_G2", s.n_f_2 - s.n_f_3, s.n_F, 8873, latex=r"{}^n\mathbf F_{G_2}"),
        s.formula("f_O2 in n", s.n_F_G + s.n_f_3, s.n_f, 8875, also=(8921,), latex=r"{}^n\mathbf f_{O_2}"),
        s.formula("f_O2, multiplied by R", s.b2_R_n * s.n_F_G + s.b2_R_n * s.n_f_3, b2_f, 8877, latex=b2),
        s.formula("f_O2 in b2", s.b2_F + s.b2_f_3, b2_f, 8879, latex=b2),
        s.formula("f_O2 from bG2 and b3", s.R_G * s.F + s.R_3 * s.f_3, b2_f, 8881, also=(8969,), latex=b2),
    ]


def moment_at_joint() -> list[Formula]:
    """Moment of link 1 on link 2 in O_2."""
    s = link_alone()
    r_2, r_3, f_2, f_3, m_2, m_3, M, F = s.n_r_2G, s.n_r_3G, s.n_f_2, s.n_f_3, s.n_m_2, s.n_m_3, s.n_M_G, s.n_F_G
    at_O2, at_b2 = s.n_m, s.f[:3, :]
    n, b2 = r"{}^n\mathbf m_{O_2}", r"{}^{b_2}\mathbf m_{O_2}"
    R_G, R_3 = s.R_G, s.R_3
    return [
        s.formula("M_G2", m_2 + r_2.cross(f_2) - m_3 - r_3.cross(f_3), s.n_M, 8899, also=(8915,), latex=r"{}^n\mathbf M_{G_2}"),
        s.formula("m_O2", M - r_2.cross(f_2) + m_3 + r_3.cross(f_3), at_O2, 8917, latex=n),
        s.formula("m_O2 with F_G2", M - r_2.cross(F + f_3) + m_3 + r_3.cross(f_3), at_O2, 8919, latex=n),
        s.formula("m_O2, multiplied out", M - r_2.cross(F) - r_2.cross(f_3) + m_3 + r_3.cross(f_3), at_O2, 8923, latex=n),
        s.formula("m_O2, reordered", M - r_2.cross(F) + m_3 - r_2.cross(f_3) + r_3.cross(f_3), at_O2, 8927, also=(8937,),
                  latex=n),
        s.formula("m_O2, arms collected", M - r_2.cross(F) + m_3 - (r_2 - r_3).cross(f_3), at_O2, 8941, latex=n),
        s.formula("m_O2, arms in a chain", M - r_2.cross(F) + m_3 - (r_2 + s.n_r_G3).cross(f_3), at_O2, 8945, latex=n),
        s.formula("m_O2 with r_O2/O3", M - r_2.cross(F) + m_3 - s.n_r_23.cross(f_3), at_O2, 8949, latex=n),
        s.formula("m_O2 in b2", s.b2_M - s.b2_r_2G.cross(s.b2_F) + s.b2_m_3 - s.b2_r_23.cross(s.b2_f_3), at_b2, 8953, latex=b2),
        s.formula("m_O2 from bG2 and b3", R_G * s.M - (R_G * s.r_2G).cross(R_G * s.F) + R_3 * s.m_3
                  - (R_3 * s.r_23).cross(R_3 * s.f_3), at_b2, 8957, latex=b2),
        s.formula("m_O2, product first", R_G * s.M - R_G * s.r_2G.cross(s.F) + R_3 * s.m_3 - (R_3 * s.r_23).cross(R_3 * s.f_3),
                  at_b2, 8961, also=(8967,), latex=b2),
    ]


def at_joint() -> list[Formula]:
    """Both as f = X* f_G + X* f_3."""
    s = link_alone()
    X_star_G = block([[s.R_G, -s.R_G * tilde(s.r_2G)], [0, s.R_G]])
    X_star_3 = block([[s.R_3, -s.R_3 * tilde(s.r_23)], [0, s.R_3]])
    f_G, f_3 = sp.Matrix.vstack(s.M, s.F), sp.Matrix.vstack(s.m_3, s.f_3)
    return [
        s.formula("X* of G2", X_star_G, s.X_star_G, 8973, also=(8983,), latex=r"{}^{b_2}\mathbf X^*_{b_{G2}}"),
        s.formula("X* of b3", X_star_3, s.X_star_3, 8973, also=(8983,), latex=r"{}^{b_2}\mathbf X^*_{b_3}"),
        s.formula("f of O2", X_star_G * f_G + X_star_3 * f_3, s.f, 8973, also=(8977, 8983, 8985, 9050),
                  latex=r"{}^{b_2}\hat{\mathbf f}_{O_2}"),
    ]


def torque() -> list[Formula]:
    """The torque of joint 2, compared with what the embedding technique gives for the same arm in space."""
    arm = arm_in_space()
    f = arm.of_link2("f")
    k, S = arm.vector("b2_k_b2", arm.of_link2("S")[:3]), arm.of_link2("S")
    m_2, f_2 = arm.vector("b2_m_O2", f[:3]), arm.vector("b2_f_O2", f[3:])
    tau_2 = arm.system.embedding().explicit("inverse_dynamics", simplify=False)[3:, :]
    written = sp.Matrix.vstack(k, sp.zeros(3, 1))
    return [
        arm.formula("tau_2", k.T * m_2 + sp.zeros(1, 3) * f_2, tau_2, 8993, latex=r"\tau_2"),
        arm.formula("S", written, S, 8995, latex=r"\mathbf S_{b_2}"),
        arm.formula("tau_2 with S", written.T * sp.Matrix.vstack(m_2, f_2), tau_2, 8995, also=(8997, 9052), latex=r"\tau_2"),
        Formula("last summary", None, None, line=9058,
                unreadable="the scheme from link to link was a figure, and a symbol in the list of what is given is lost"),
    ]


CASES = (
    Case("spatial-force-at-center", "Force and moment at G_2 as a spatial vector", Slide("5.6", ARM, 8838), at_center),
    Case("spatial-force-at-joint", "The force in O_2", Slide("5.6", ARM, 8863), force_at_joint),
    Case("spatial-moment-at-joint", "The moment in O_2, step by step", Slide("5.6", ARM, 8883), moment_at_joint),
    Case("spatial-wrench-at-joint", "Force and moment in O_2 as a spatial vector", Slide("5.6", ARM, 8963), at_joint),
    Case("spatial-torque", "The torque in the joint of link 2", Slide("5.6", ARM, 8979), torque),
)
