"""Chapter 5.6: accelerations of the frames b2 and bG2, which are the rates of the components of their velocities."""

from __future__ import annotations

import sympy as sp

import symdyn as sd
from symdyn.comparison.case import Case, Erratum, Formula, Slide
from symdyn.comparison.proofs import Proof, numeric_derivative
from symdyn.lecture.arm_in_space import ArmInSpace, arm_in_space, block, cross, tilde
from symdyn.lecture.chapter_5_spatial_velocity import ARM, Named, transform_to_center

OMEGA_DOT, V_DOT = r"{}^{b_2}\dot{\boldsymbol\omega}_{b_2/n}", r"{}^{b_2}\dot{\mathbf v}_{O_2/E}"
ZERO = sp.zeros(3, 1)
INDEX = "omega_b1/b2 keeps its index where it is replaced by -omega_b2/b1."


class Accelerated(Named):
    """The slides' symbols for rates: a dot, or d/dt, is the rate of the components that the letter stands for."""

    def __init__(self, arm: ArmInSpace) -> None:
        super().__init__(arm)
        n, b1, b2, vector = arm.n, arm.b1, arm.b2, arm.vector
        self.omega_1_dot = vector("b1_omega_b1_dot", sd.rate(b1.angular_velocity(n, components=b1)))
        self.v_O1_dot = vector("b1_v_O1_dot", sd.rate(b1.velocity(n, components=b1)))
        self.k_dot = vector("b2_k_b2_dot", arm.of_link2("S_ring")[:3])
        self.r_21_dot = vector("b1_r_O2_O1_dot", sd.rate(b2.position(b1)))
        self.omega_12 = vector("b2_omega_b1_b2", b1.angular_velocity(b2, components=b2))
        self.omega_21 = vector("b2_omega_b2_b1", b2.angular_velocity(b1, components=b2))
        self.R_dot = arm.matrix("b2_R_b1_dot", sd.rate(b1.rotation(b2)))
        self.theta_ddot = arm.q2.ddot
        self.turn = self.k * self.theta_dot
        self.a_1 = sp.Matrix.vstack(self.omega_1_dot, self.v_O1_dot)
        self.S_ring = sp.Matrix.vstack(self.k_dot, ZERO)
        self.v_cross = block([[tilde(self.omega_2), 0], [tilde(self.v_O2), tilde(self.omega_2)]])
        self.omega_2_of_t, self.v_O2_of_t = b2.angular_velocity(n, components=b2), b2.velocity(n, components=b2)


def angular() -> list[Formula]:
    """The rate of omega_b2/n in b2-components."""
    arm = arm_in_space()
    s = Accelerated(arm)
    derived = arm.of_link2("a")[:3, :]
    R, w_1, w_1_dot, k, theta_dot, turn = s.b2_R_1, s.omega_1, s.omega_1_dot, s.k, s.theta_dot, s.turn
    rest = R * w_1_dot + s.k_dot * theta_dot + k * s.theta_ddot
    lost = Erratum("omega_b1/b2 = -omega_b2/b1 is put in without its minus; the next line, with the factors exchanged, is right.",
                   numeric_derivative("it must be the rate of the components of omega_b2/n in b2", of=s.omega_2_of_t))
    return [
        s.formula("product rule", s.R_dot * w_1 + R * w_1_dot + (s.k_dot * theta_dot + k * s.theta_ddot), derived, 8403,
                  latex=OMEGA_DOT),
        s.formula("R_dot", tilde(s.omega_12) * R, sd.rate(arm.b1.rotation(arm.b2)), 8407, also=(8517,),
                  latex=r"{}^{b_2}\dot{\mathbf R}_{b_1}"),
        s.formula("with R_dot", s.omega_12.cross(R * w_1) + rest, derived, 8409, also=(8415, 8433), latex=OMEGA_DOT),
        s.formula("omega of b1 against b2", -s.omega_21, arm.b1.angular_velocity(arm.b2, components=arm.b2), 8437, also=(8546,),
                  latex=r"{}^{b_2}\boldsymbol\omega_{b_1/b_2}"),
        s.formula("with omega of b2 against b1", s.omega_21.cross(R * w_1) + rest, derived, 8439, latex=OMEGA_DOT, errata=[lost]),
        s.formula("factors exchanged", (R * w_1).cross(s.omega_21) + rest, derived, 8443, also=(8463,), latex=OMEGA_DOT),
        s.formula("omega of b2 against b1", turn, arm.b2.angular_velocity(arm.b1, components=arm.b2), 8467, also=(8574,),
                  latex=r"{}^{b_2}\boldsymbol\omega_{b_2/b_1}"),
        s.formula("with k", (R * w_1).cross(turn) + rest, derived, 8469, also=(8473, 8627), latex=OMEGA_DOT),
        s.formula("k x k", turn.cross(turn), ZERO, 8631),
        s.formula("with k x k added", R * w_1_dot + k * s.theta_ddot + s.k_dot * theta_dot + (R * w_1).cross(turn)
                  + turn.cross(turn), derived, 8633, also=(8653,), latex=OMEGA_DOT),
        s.formula("with the sum as factor", rest + (R * w_1 + turn).cross(turn), derived, 8659, latex=OMEGA_DOT),
        s.formula("angular acceleration", rest + s.omega_2.cross(turn), derived, 8665, also=(8676, 8706), latex=OMEGA_DOT),
    ]


def linear() -> list[Formula]:
    """The rate of v_O2/E in b2-components; it is not the acceleration of O_2, which has omega x v besides."""
    arm = arm_in_space()
    s = Accelerated(arm)
    derived = arm.of_link2("a")[3:, :]
    R, w_1, w_1_dot, r, v_1, v_1_dot = s.b2_R_1, s.omega_1, s.omega_1_dot, s.r_21, s.v_O1, s.v_O1_dot
    w_12, w_21, turn = s.omega_12, s.omega_21, s.turn
    product = w_1_dot.cross(r) + w_1.cross(s.r_21_dot)
    tail = R * w_1_dot.cross(r) + R * v_1_dot
    carried = cross(R * w_1, R * r, turn)
    rates = numeric_derivative("it must be the rate of the components of v_O2/E in b2", of=s.v_O2_of_t)
    not_turned = Erratum("The minus of omega_b1/b2 = -omega_b2/b1 is put in, but the index stays, and the sign is wrong.", rates,
                         slip=INDEX)
    not_turned_2 = Erratum("Exchanging the factors of -omega_b2/b1 x a gives a x omega_b2/b1; the slide has omega_b1/b2.", rates,
                           slip=INDEX)
    return [
        s.formula("R (omega x r)", (R * w_1.cross(r), (R * w_1).cross(R * r)), ZERO, 8486),
        s.formula("product rule", s.R_dot * w_1.cross(r) + R * product + s.R_dot * v_1 + R * v_1_dot, derived, 8496, also=(8513,),
                  latex=V_DOT),
        s.formula("with R_dot", w_12.cross(R * w_1.cross(r)) + R * product + w_12.cross(R * v_1) + R * v_1_dot, derived, 8519,
                  latex=V_DOT),
        s.formula("rate of omega x r", product, sd.rate(arm.b1.angular_velocity(arm.n, components=arm.b1).cross(arm.r_O2)), 8523),
        s.formula("rate of omega x r, r constant", w_1_dot.cross(r),
                  sd.rate(arm.b1.angular_velocity(arm.n, components=arm.b1).cross(arm.r_O2)), 8523),
        s.formula("with a constant r", w_12.cross(R * w_1.cross(r)) + tail + w_12.cross(R * v_1), derived, 8525, also=(8542,),
                  latex=V_DOT),
        s.formula("with the index turned", -w_12.cross(R * w_1.cross(r)) + tail - w_21.cross(R * v_1), derived, 8548, latex=V_DOT,
                  errata=[not_turned]),
        s.formula("factors exchanged", (R * w_1.cross(r)).cross(w_12) + tail + (R * v_1).cross(w_21), derived, 8552, latex=V_DOT,
                  errata=[not_turned_2]),
        s.formula("factors exchanged, next slide", (R * w_1.cross(r)).cross(w_21) + tail + (R * v_1).cross(w_21), derived, 8570,
                  latex=V_DOT),
        s.formula("with k", (R * w_1.cross(r)).cross(turn) + tail + (R * v_1).cross(turn), derived, 8576, also=(8582, 8601),
                  latex=V_DOT),
        s.formula("R multiplied in", carried + (R * w_1_dot).cross(R * r) + (R * v_1).cross(turn) + R * v_1_dot, derived, 8605,
                  latex=V_DOT),
        s.formula("in another order", (R * w_1_dot).cross(R * r) + R * v_1_dot + carried + (R * v_1).cross(turn), derived, 8609,
                  also=(8629,), latex=V_DOT),
        s.formula("with the sum as factor", -R * r.cross(w_1_dot) + R * v_1_dot
                  + ((R * w_1).cross(R * r) + R * v_1).cross(turn), derived, 8635, also=(8655, 8661), latex=V_DOT),
        s.formula("linear acceleration", -R * r.cross(w_1_dot) + R * v_1_dot + s.v_O2.cross(turn), derived, 8667,
                  also=(8677, 8708), latex=V_DOT),
    ]


def spatial() -> list[Formula]:
    """Both as a = X a + S q_ddot + S_ring q_dot + v x S q_dot."""
    arm = arm_in_space()
    s = Accelerated(arm)
    derived, R = arm.of_link2("a"), s.b2_R_1
    X = block([[R, 0], [R * tilde(s.r_21), R]])
    velocities = sp.Matrix.vstack(s.omega_2_of_t, s.v_O2_of_t)
    v_1 = sp.Matrix.vstack(arm.b1.angular_velocity(arm.n, components=arm.b1), arm.b1.velocity(arm.n, components=arm.b1))
    joint = sp.Matrix([0, 0, arm.q2.dot, 0, 0, 0])
    why = "The minus before R [r x], which the line above and the X of the velocities have, is left out."
    moves = Proof("another formulation", "the same X must take velocities of b1 to b2, as differentiated positions give them",
                  lambda X: sp.Matrix(X) * v_1 + joint - velocities)
    rates = numeric_derivative("it must be the rate of the components of omega_b2/n and v_O2/E in b2", of=velocities)
    motion = s.S * s.theta_ddot + s.S_ring * s.theta_dot + s.v_cross * s.S * s.theta_dot
    latex = r"{}^{b_2}\hat{\mathbf a}_{b_2}"
    return [
        s.formula("X", X, arm.of_link2("X"), 8682, also=(8690,), latex=r"{}^{b_2}\mathbf X_{b_1}", errata=[Erratum(why, moves)]),
        s.formula("a, written out", X * s.a_1 + motion, derived, 8682, latex=latex, errata=[Erratum(why, rates)]),
        s.formula("a", s.X * s.a_1 + motion, derived, 8686, latex=latex),
        # With d/dt (a) = a_dot for components, line 8413, the dot of S is what 8686 writes with a ring.
        s.formula("a, summary", s.X * s.a_1 + motion, derived, 9044, latex=latex),
        s.formula("S", s.S, arm.of_link2("S"), 8690, latex=r"\mathbf S_{b_2}"),
        s.formula("c", s.S_ring * s.theta_dot + s.v_cross * s.S * s.theta_dot, arm.of_link2("c"), 8682,
                  latex=r"{}^{b_2}\hat{\mathbf c}_{b_2}"),
    ]


def of_center() -> list[Formula]:
    """bG2, which no joint moves against b2."""
    arm = arm_in_space()
    s = Accelerated(arm)
    R, r = s.bG_R_2, s.r_G
    a_G = transform_to_center(arm) * arm.of_link2("a")
    turned = arm.bG2.rotation(arm.b2).T
    own = sp.diag(turned, turned) * arm.of_link2("a_G")
    still = [0, 0, 0]  # line 8712: the angle of bG2 against b2 is constant
    turn, turn_dot, k_turn = (arm.vector(name, still) for name in ("bG2_s_bG2", "bG2_t_bG2", "bG2_u_bG2"))
    omega_G = arm.vector("bG2_omega_bG2", arm.bG2.angular_velocity(arm.n, components=arm.bG2))
    v_G = arm.vector("bG2_v_G2", arm.bG2.velocity(arm.n, components=arm.bG2))
    w_dot = arm.vector("b2_omega_b2_dot", arm.of_link2("a")[:3])
    v_dot = arm.vector("b2_v_O2_dot", arm.of_link2("a")[3:])
    latex = r"{}^{b_{G2}}\dot{\boldsymbol\omega}_{b_{G2}/n}", r"{}^{b_{G2}}\dot{\mathbf v}_{G_2/E}"
    moved = -R * r.cross(w_dot) + R * v_dot
    return [
        s.formula("omega_dot, all terms", R * w_dot + turn_dot + k_turn + omega_G.cross(turn), a_G[:3, :], 8718, also=(8732,),
                  latex=latex[0]),
        s.formula("v_dot, all terms", moved + v_G.cross(turn), a_G[3:, :], 8720, also=(8734,), latex=latex[1]),
        s.formula("omega_dot", R * w_dot, own[:3, :], 8736, latex=latex[0]),
        s.formula("v_dot", moved, own[3:, :], 8738, latex=latex[1]),
        s.formula("X", s.X_G, transform_to_center(arm), 8740, latex=r"{}^{b_{G2}}\mathbf X_{b_2}"),
        s.formula("a", s.X_G * sp.Matrix.vstack(w_dot, v_dot), own, 8740, also=(9046,),
                  latex=r"{}^{b_{G2}}\hat{\mathbf a}_{b_{G2}}"),
    ]


CASES = (
    Case("spatial-angular-acceleration", "Angular acceleration of b2, step by step", Slide("5.6", ARM, 8388), angular),
    Case("spatial-linear-acceleration", "Linear acceleration of b2, step by step", Slide("5.6", ARM, 8475), linear),
    Case("spatial-acceleration", "Acceleration of b2 as a spatial vector", Slide("5.6", ARM, 8669), spatial),
    Case("spatial-acceleration-of-center", "Acceleration of bG2", Slide("5.6", ARM, 8694), of_center),
)
