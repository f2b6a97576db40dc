"""5.7, the equations from inverse dynamics and their simplification, before any arm is chosen.

Evaluated on link 2 of the three-link arm, which a next link loads; the simplification in exact numbers. The notes print x and
x* for the velocity product of a force in turns; 5.6 derives x*, and only that is right. Where a star is missing they are called
wrong as they stand, although the star may have been on the slide: in one place it stands over the next letter.
"""

from __future__ import annotations

import sympy as sp

from symdyn.comparison.case import Case, Erratum, Formula, Slide
from symdyn.comparison.proofs import Proof, other
from symdyn.frames.rates import rate
from symdyn.lecture.propagation_arms import Arm, cross, cross_star, row
from symdyn.lecture.propagation_newton import Newton
from symdyn.model.joints import Revolute, Universal
from symdyn.model.symbols import coordinates, parameters
from symdyn.model.system import System

TITLE = "Forward Dynamics - Propagation Methods"
WHY_STAR = "The velocity product of a force is v x* I v, as lines 8859 and 9568 have it; here the star is missing."
NEWTON = "Moment and force by Newton and Euler in 3-vectors, from differentiating positions"


def _inverse_dynamics() -> list[Formula]:
    arm = Arm(3)
    newton = Newton(arm)
    X, Xs_3, S, S_ring, v_1, v_2, a_1, a_2 = arm.X_2, arm.X_star_3, arm.S_2, arm.S_ring_2, arm.v_1, arm.v_2, arm.a_1, arm.a_2
    X_G, I_G, v_G, a_G, f_G = arm.X_G(2), arm.I_G(2), arm.v_G_2, arm.a_G_2, arm.f_G_2
    q_dot, q_ddot = arm.q_dot[1], arm.q_ddot[1]
    star = Erratum(WHY_STAR, other(NEWTON, newton.at_center(2)))
    return [
        row("velocity of b2", 9100, X * v_1 + S * q_dot, v_2,
            (9122, 9146, 9168, 9190, 9212, 9284, 9306, 9330, 9354, 9380, 9410, 9432, 9454, 9476, 9498, 9522, 9546, 9564, 9596,
             9628, 9660), latex=r"{}^{b_2}\hat{v}_{b_2}"),
        row("velocity of bG2", 9102, X_G * v_2, v_G,
            (9124, 9148, 9170, 9192, 9214, 9286, 9308, 9332, 9356, 9382, 9412, 9434, 9456, 9478, 9500, 9524),
            latex=r"{}^{b_{G2}}\hat{v}_{b_{G2}}"),
        row("acceleration of b2", 9104, X * a_1 + S * q_ddot + S_ring * q_dot + cross(v_2) * S * q_dot, a_2,
            (9126, 9150, 9172, 9194, 9216, 9288, 9310, 9334, 9358, 9384, 9414, 9436, 9458, 9480, 9504, 9528, 9548, 9566, 9662,
             9759, 9775, 9796, 9817), latex=r"{}^{b_2}\hat{a}_{b_2}"),
        # S_dot is the derivative of the components, which is what the ring means.
        row("acceleration of b2 with S_dot", 9598, X * a_1 + S * q_ddot + newton.rate(S) * q_dot + cross(v_2) * S * q_dot, a_2,
            (9630,), latex=r"{}^{b_2}\hat{a}_{b_2}"),
        _where_S_moves(),
        row("acceleration of bG2", 9106, X_G * a_2, a_G,
            (9128, 9152, 9174, 9196, 9218, 9290, 9312, 9336, 9360, 9386, 9416, 9438, 9460, 9482, 9506, 9530),
            latex=r"{}^{b_{G2}}\hat{a}_{b_{G2}}"),
        row("force and moment on bG2", 9108, I_G * a_G + cross(v_G) * I_G * v_G, f_G,
            (9130, 9176, 9198, 9220, 9292, 9314, 9338, 9362, 9388, 9418), [star], latex=r"{}^{b_{G2}}\hat{f}_{G_2}^{B_2}"),
        Formula("force and moment on bG2, boxed", None, f_G, line=9154, latex=r"{}^{b_{G2}}\hat{f}_{G_2}^{B_2}",
                unreadable="the star of the product stands over I, which has lost its frame"),
        row("force and moment on b2", 9110, X_G.T * f_G + Xs_3 * arm.f_3, arm.f_2,
            (9132, 9156, 9178, 9200, 9222, 9294, 9316, 9340, 9366, 9392, 9420), latex=r"{}^{b_2}\hat{f}_{O_2}"),
        row("tau_2", 9112, S.T * arm.f_2, arm.torques[1:2, :],
            (9134, 9158, 9180, 9202, 9224, 9296, 9318, 9344, 9370, 9400, 9422, 9444, 9466, 9488, 9512, 9536, 9554, 9572, 9604,
             9636, 9668, 9694, 9720, 9746, 9765, 9781, 9802, 9829), latex=r"\tau_2"),
    ]


def _where_S_moves() -> Formula:
    """The acceleration on a universal joint: of the joints above S is constant, and any term with its rate would do."""
    q1, q2, q3 = coordinates("q1:4")
    system = System("on_a_universal_joint")
    link1, link2 = (system.add_body(name, mass=1, inertia=[1, 1, 1]) for name in ("link1", "link2"))
    system.add_joint(Revolute("shoulder", system.ground, link1, q1))
    system.add_joint(Universal("elbow", link1, link2, [q2, q3], parent_point=[*parameters("l1 h1"), 0]))
    equations = system.recursive()
    X, S, v, a_1, a = (sp.Matrix(equations.explicit(name, simplify=False)) for name in ("X_2", "S_2", "v_2", "a_1", "a_2"))
    q_dot, q_ddot = sp.Matrix([q2.dot, q3.dot]), sp.Matrix([q2.ddot, q3.ddot])
    printed = X * a_1 + S * q_ddot + rate(S) * q_dot + cross(v) * S * q_dot
    return row("acceleration of b2 where S moves", 9598, printed, a, (9630,), latex=r"{}^{b_2}\hat{a}_{b_2}")


def _simplification() -> list[Formula]:
    arm = Arm(3, exact=True)
    newton = Newton(arm)
    Xs_3, v_2, a_2, I_2, f_2, f_3 = arm.X_star_3, arm.v_2, arm.a_2, arm.I_2, arm.f_2, arm.f_3
    X_G, X_Gs, I_G, v_G, a_G = arm.X_G(2), arm.X_G(2).T, arm.I_G(2), arm.v_G_2, arm.a_G_2
    Xv = X_G * v_2
    by_joint, by_body = other(NEWTON, newton.through_joint(2)), other(NEWTON, newton.on_body(2))
    no_work = Proof("energy balance", "With I constant dT/dt = v^T f, so the force that the velocity alone needs does no work: "
                    "v^T p = 0", lambda p: v_2.T * p)
    star = [Erratum(WHY_STAR, by_joint)]
    bracket = ("The bracket multiplies the velocity product, which is a force already, by the inertia; line 9248 has it outside, "
               "and with x*.")
    both = ("The superscript B_2 and the star are missing, and the bracket multiplies the velocity product, a force already, by "
            "the inertia.")
    superscript = ("The superscript B_2 is missing: this, with x*, is the resultant on body 2 alone; X* f_O3 of the next link is "
                   "not in it.")
    f = r"{}^{b_2}\hat{f}_{O_2}"
    f_B = r"{}^{b_2}\hat{f}_{O_2}^{B_2}"
    return [
        row("f_G2 with the velocity put in", 9176, I_G * a_G + cross(Xv) * I_G * Xv, arm.f_G_2, (9198, 9220),
            [Erratum(WHY_STAR, other(NEWTON, newton.at_center(2)))], latex=r"{}^{b_{G2}}\hat{f}_{G_2}^{B_2}"),
        row("f_O2 with f_G2 put in", 9222, X_Gs * (I_G * a_G + cross(Xv) * I_G * Xv) + Xs_3 * f_3, f_2, (9258, 9294, 9316),
            star, latex=f),
        row("f_O2 with f_G2 put in, x*", 9234, X_Gs * (I_G * a_G + cross_star(Xv) * I_G * Xv) + Xs_3 * f_3, f_2, latex=f),
        row("f_O2 with v_G2", 9238, X_Gs * (I_G * a_G + cross_star(v_G) * I_G * v_G) + Xs_3 * f_3, f_2, latex=f),
        row("f_O2 multiplied out", 9242, X_Gs * I_G * a_G + X_Gs * (cross_star(v_G) * I_G * v_G) + Xs_3 * f_3, f_2, latex=f),
        row("left side of the velocity product at O_2", 9246, X_Gs * (cross_star(v_G) * I_G * v_G), arm.p_2),
        row("right side of the velocity product at O_2", 9246, cross_star(v_2) * I_2 * v_2, arm.p_2),
        row("f_O2 with the velocity product at O_2", 9248, X_Gs * I_G * a_G + cross_star(v_2) * I_2 * v_2 + Xs_3 * f_3, f_2,
            latex=f),
        row("f_O2 with a bracket", 9262, X_Gs * I_G * (a_G + cross(v_2) * I_2 * v_2) + Xs_3 * f_3, f_2,
            errata=[Erratum(bracket, by_joint)], latex=f),
        # Printed as b2_X_b2; it is bG2_X_bG2, which is the same unit matrix.
        row("transforms there and back", 9266, X_G * arm.X_from_G(2), sp.eye(6)),
        row("f_O2 with transforms there and back", 9268,
            X_Gs * I_G * X_G * arm.X_from_G(2) * a_G + cross(v_2) * I_2 * v_2 + Xs_3 * f_3, f_2, errata=star, latex=f),
        row("inertia about O_2", 9272, X_Gs * I_G * X_G, I_2, latex=r"{}^{b_2}\hat{I}_{b_2}"),
        row("f_O2 at O_2", 9274, I_2 * a_2 + cross(v_2) * I_2 * v_2 + Xs_3 * f_3, f_2, (9320, 9342, 9368, 9394), star, latex=f),
        row("f_O2^B2", 9364, I_2 * a_2 + cross(v_2) * I_2 * v_2, arm.f_B(2),
            (9368, 9390, 9418, 9440, 9462, 9550, 9600, 9632, 9664, 9761, 9777, 9798, 9821), [Erratum(WHY_STAR, by_body)],
            latex=f_B),
        row("f_O2^B2 with x*", 9568, I_2 * a_2 + cross_star(v_2) * I_2 * v_2, arm.f_B(2), latex=f_B),
        row("f_O2 from f_O2^B2", 9398, arm.f_B(2) + Xs_3 * f_3, f_2,
            (9420, 9442, 9464, 9486, 9510, 9534, 9552, 9570, 9602, 9634, 9666, 9763, 9779, 9800, 9825), latex=f),
        row("f_O2 without superscript", 9484, I_2 * a_2 + cross(v_2) * I_2 * v_2, f_2, errata=[Erratum(superscript, by_joint)],
            latex=f),
        row("f_O2 without superscript, with a bracket", 9508, I_2 * (a_2 + cross(v_2) * I_2 * v_2), f_2, (9532,),
            [Erratum(both, by_joint)], latex=f),
        row("c_2", 9759, arm.S_ring_2 * arm.q_dot[1] + cross(v_2) * arm.S_2 * arm.q_dot[1], arm.c_2, (9793, 9814), latex="c_2"),
        row("p_2", 9761, cross(v_2) * I_2 * v_2, arm.p_2, (9793, 9814), [Erratum(WHY_STAR, no_work)], latex="p_2"),
        row("a_i for i = 2", 9792, arm.a_1, a_2, (9813,),
            [Erratum("The list of short letters calls the acceleration of every link a_1; it is a_i.",
                     other("The rates of change of the velocity of link 2, from differentiating positions",
                           newton.acceleration(2)))], latex=r"{}^{b_i}\hat{a}_{b_i}"),
    ]


def _letters() -> list[Formula]:
    arm = Arm(3)
    q_ddot = arm.q_ddot
    return [
        row("a_1", 9843, arm.X_1 * arm.a_0 + arm.S_1 * q_ddot[0] + arm.c_1, arm.a_1, latex="a_1"),
        row("f_1^B", 9845, arm.I_1 * arm.a_1 + arm.p_1, arm.f_B(1), latex="f_1^B"),
        row("f_1", 9847, arm.f_B(1) + arm.X_star_2 * arm.f_2, arm.f_1, (9875, 9899), latex="f_1"),
        row("tau_1", 9849, arm.S_1.T * arm.f_1, arm.torques[:1, :], latex=r"\tau_1"),
        row("a_2", 9819, arm.X_2 * arm.a_1 + arm.S_2 * q_ddot[1] + arm.c_2, arm.a_2, (9853,), latex="a_2"),
        row("f_2^B", 9823, arm.I_2 * arm.a_2 + arm.p_2, arm.f_B(2), (9855,), latex="f_2^B"),
        row("f_2", 9827, arm.f_B(2) + arm.X_star_3 * arm.f_3, arm.f_2, (9857, 10315, 11101), latex="f_2"),
        row("tau_2", 9831, arm.S_2.T * arm.f_2, arm.torques[1:2, :], (9859,), latex=r"\tau_2"),
    ]


CASES = (
    Case("propagation-inverse-dynamics", "Equations from inverse dynamics, on link 2 of the three-link arm",
         Slide("5.7", f"{TITLE} - Equations from Inverse Dynamics", 9100), _inverse_dynamics),
    Case("propagation-simplification", "Simplifying them, on link 2 of the three-link arm in exact numbers",
         Slide("5.7", f"{TITLE} - Simplification of Equations from Inverse Dynamics", 9176), _simplification),
    Case("propagation-short-letters", "The simplified equations, on the three-link arm",
         Slide("5.7", f"{TITLE} - Simplified version of Equations from Inverse Dynamics", 9819), _letters),
)
