"""5.7, the equations from inverse dynamics and their simplification, before any arm is chosen.

Evaluated on link 2 of the three-link arm, which a next link loads; the simplification in exact numbers. The notes print x and
x* for the velocity product of a force in turns; 5.6 derives x*, and only that is right. Where a star is missing they are called
wrong as they stand, although the star may have been on the slide: in one place it stands over the next letter.
"""

from __future__ import annotations

import sympy as sp

from symdyn.comparison.case import Case, Erratum, Formula, Remark, Slide
from symdyn.comparison.proofs import Proof, other
from symdyn.frames.rates import rate
from symdyn.lecture.chapter_5_spatial_joint import STAR
from symdyn.lecture.propagation_arms import arm_of, row
from symdyn.lecture.propagation_letters import typeset
from symdyn.lecture.propagation_newton import Newton
from symdyn.model.joints import Revolute, Universal
from symdyn.model.symbols import coordinates, parameters
from symdyn.model.system import System
from symdyn.spatial.sixvectors import motion_transform
from symdyn.spatial.vectors import identity, vector

TITLE = "Forward Dynamics - Propagation Methods"
WHY_STAR = "The velocity product of a force is v x* I v, as lines 8859 and 9568 have it; here the star is missing."
NEWTON = "Moment and force by Newton and Euler in 3-vectors, from differentiating positions"


def _inverse_dynamics() -> list[Formula]:
    arm = arm_of(3)
    newton, of = Newton(arm), arm.letter
    star = Erratum(WHY_STAR, other(NEWTON, newton.at_center(2)), slip=STAR)
    return [
        row(of, "velocity of b2", 9100, "v_2 = X v_1 + S q2'", arm.v_2,
            (9122, 9146, 9168, 9190, 9212, 9284, 9306, 9330, 9354, 9380, 9410, 9432, 9454, 9476, 9498, 9522, 9546, 9564, 9596,
             9628, 9660)),
        row(of, "velocity of bG2", 9102, "v_G = X_G v_2", arm.v_G_2,
            (9124, 9148, 9170, 9192, 9214, 9286, 9308, 9332, 9356, 9382, 9412, 9434, 9456, 9478, 9500, 9524)),
        row(of, "acceleration of b2", 9104, "a_2 = X a_1 + S q2'' + S_ring q2' + v_2 x S q2'", arm.a_2,
            (9126, 9150, 9172, 9194, 9216, 9288, 9310, 9334, 9358, 9384, 9414, 9436, 9458, 9480, 9504, 9528, 9548, 9566, 9662,
             9759, 9775, 9796, 9817)),
        _where_S_moves(),
        row(of, "acceleration of bG2", 9106, "a_G = X_G a_2", arm.a_G_2,
            (9128, 9152, 9174, 9196, 9218, 9290, 9312, 9336, 9360, 9386, 9416, 9438, 9460, 9482, 9506, 9530)),
        row(of, "force and moment on bG2", 9108, "f_G = I_G a_G + v_G x I_G v_G", arm.f_G_2,
            (9130, 9176, 9198, 9220, 9292, 9314, 9338, 9362, 9388, 9418), [star]),
        Formula("force and moment on bG2, boxed", None, arm.f_G_2, line=9154, latex=typeset("f_G"),
                unreadable="the star of the product stands over I, which has lost its frame"),
        row(of, "force and moment on b2", 9110, "f_2 = X_G* f_G + X_3* f_3", arm.f_2,
            (9132, 9156, 9178, 9200, 9222, 9294, 9316, 9340, 9366, 9392, 9420)),
        row(of, "tau_2", 9112, "tau_2 = S^T f_2", arm.torques[1:2, :],
            (9134, 9158, 9180, 9202, 9224, 9296, 9318, 9344, 9370, 9400, 9422, 9444, 9466, 9488, 9512, 9536, 9554, 9572, 9604,
             9636, 9668, 9694, 9720, 9746, 9765, 9781, 9802, 9829)),
    ]


def _where_S_moves() -> Formula:
    """The acceleration with S_dot, on a universal joint: on the joints of the arms S is constant, and any such term would do."""
    q1, q2, q3 = coordinates("q1:4")
    system = System("on_a_universal_joint")
    link1, link2 = (system.add_body(name, mass=1, inertia=[1, 1, 1]) for name in ("link1", "link2"))
    system.add_joint(Revolute("shoulder", system.ground, link1, q1))
    system.add_joint(Universal("elbow", link1, link2, [q2, q3], parent_point=[*parameters("l1 h1"), 0]))
    equations = system.recursive()

    def value(name: str) -> sp.Matrix:
        return sp.Matrix(equations.explicit(name, simplify=False))

    letters = {"X": value("X_2"), "a_1": value("a_1"), "v_2": value("v_2"), "S": value("S_2"), "S_dot": rate(value("S_2")),
               "q2'": sp.Matrix([q2.dot, q3.dot]), "q2''": sp.Matrix([q2.ddot, q3.ddot])}
    # The dot is that of the components, which is what the ring means on the other slides.
    return row(letters.__getitem__, "acceleration of b2 where S moves", 9598, "a_2 = X a_1 + S q2'' + S_dot q2' + v_2 x S q2'",
               value("a_2"), (9630,))


def _simplification() -> list[Formula]:
    arm = arm_of(3, exact=True)
    newton, of, f_2, f_B = Newton(arm), arm.letter, arm.f_2, arm.f_B(2)
    by_joint, by_body = other(NEWTON, newton.through_joint(2)), other(NEWTON, newton.on_body(2))
    no_work = Proof("energy balance", "With I constant dT/dt = v^T f, so the force that the velocity alone needs does no work: "
                    "v^T p = 0", lambda p: arm.v_2.T * p)
    star = [Erratum(WHY_STAR, by_joint, slip=STAR)]
    bracket = ("The bracket multiplies the velocity product, which is a force already, by the inertia; line 9248 has it outside, "
               "and with x*.")
    both = ("The superscript B_2 and the star are missing, and the bracket multiplies the velocity product, a force already, by "
            "the inertia.")
    superscript = ("The superscript B_2 is missing: this, with x*, is the resultant on body 2 alone; X* f_O3 of the next link is "
                   "not in it.")
    first = ("The list of short letters calls the acceleration of every link a_1; it is a_i.",
             other("The rates of change of the velocity of link 2, from differentiating positions", newton.acceleration(2)))
    return [
        row(of, "f_G2 with the velocity put in", 9176, "f_G = I_G a_G + (X_G v_2) x I_G (X_G v_2)", arm.f_G_2, (9198, 9220),
            [Erratum(WHY_STAR, other(NEWTON, newton.at_center(2)), slip=STAR)]),
        row(of, "f_O2 with f_G2 put in", 9222, "f_2 = X_G* (I_G a_G + (X_G v_2) x I_G (X_G v_2)) + X_3* f_3", f_2,
            (9258, 9294, 9316), star),
        row(of, "f_O2 with f_G2 put in, x*", 9234, "f_2 = X_G* (I_G a_G + (X_G v_2) x* I_G (X_G v_2)) + X_3* f_3", f_2),
        row(of, "f_O2 with v_G2", 9238, "f_2 = X_G* (I_G a_G + v_G x* I_G v_G) + X_3* f_3", f_2),
        row(of, "f_O2 multiplied out", 9242, "f_2 = X_G* I_G a_G + X_G* (v_G x* I_G v_G) + X_3* f_3", f_2),
        row(of, "left side of the velocity product at O_2", 9246, "X_G* (v_G x* I_G v_G)", arm.p_2),
        row(of, "right side of the velocity product at O_2", 9246, "v_2 x* I_2 v_2", arm.p_2),
        row(of, "f_O2 with the velocity product at O_2", 9248, "f_2 = X_G* I_G a_G + (v_2 x* I_2 v_2) + X_3* f_3", f_2),
        row(of, "f_O2 with a bracket", 9262, "f_2 = X_G* I_G [a_G + (v_2 x I_2 v_2)] + X_3* f_3", f_2,
            errata=[Erratum(bracket, by_joint)]),
        Formula("transforms there and back", (of("X_G") * of("X_back"), sp.Matrix(motion_transform(identity(), vector(0, 0, 0)))),
                (sp.eye(6), sp.eye(6)), line=9266, latex=typeset("X_G X_back")),
        row(of, "f_O2 with transforms there and back", 9268, "f_2 = X_G* I_G X_G X_back a_G + (v_2 x I_2 v_2) + X_3* f_3", f_2,
            errata=star),
        row(of, "inertia about O_2", 9272, "I_2 = X_G* I_G X_G", arm.I_2),
        row(of, "f_O2 at O_2", 9274, "f_2 = I_2 a_2 + v_2 x I_2 v_2 + X_3* f_3", f_2, (9320, 9342, 9368, 9394), star),
        row(of, "f_O2^B2", 9364, "f_B = I_2 a_2 + v_2 x I_2 v_2", f_B,
            (9368, 9390, 9418, 9440, 9462, 9550, 9600, 9632, 9664, 9761, 9777, 9798, 9821),
            [Erratum(WHY_STAR, by_body, slip=STAR)]),
        row(of, "f_O2^B2 with x*", 9568, "f_B = I_2 a_2 + v_2 x* I_2 v_2", f_B),
        row(of, "f_O2 from f_O2^B2", 9398, "f_2 = f_B + X_3* f_3", f_2,
            (9420, 9442, 9464, 9486, 9510, 9534, 9552, 9570, 9602, 9634, 9666, 9763, 9779, 9800, 9825)),
        row(of, "f_O2 without superscript", 9484, "f_2 = I_2 a_2 + v_2 x I_2 v_2", f_2, errata=[Erratum(superscript, by_joint)]),
        row(of, "f_O2 without superscript, with a bracket", 9508, "f_2 = I_2 [a_2 + (v_2 x I_2 v_2)]", f_2, (9532,),
            [Erratum(both, by_joint)]),
        row(of, "c_2", 9759, "c2 = S_ring q2' + v_2 x S q2'", arm.c_2, (9793, 9814)),
        row(of, "p_2", 9761, "p2 = v_2 x I_2 v_2", arm.p_2, (9793, 9814), [Erratum(WHY_STAR, no_work, slip=STAR)]),
        row(of, "a_i for i = 2", 9792, "a_i = a1", arm.a_2, (9813,), [Erratum(*first)]),
    ]


def _letters() -> list[Formula]:
    arm = arm_of(3)
    of = arm.letter
    return [
        row(of, "a_1", 9843, "a1 = 1X0 a0 + S1 q1'' + c1", arm.a_1),
        row(of, "f_1^B", 9845, "f1B = I1 a1 + p1", arm.f_B(1)),
        row(of, "f_1", 9847, "f1 = f1B + 1X2* f2", arm.f_1, (9875, 9899)),
        row(of, "tau_1", 9849, "tau_1 = S1^T f1", arm.torques[:1, :]),
        row(of, "a_2", 9819, "a2 = 2X1 a1 + S2 q2'' + c2", arm.a_2, (9853,)),
        row(of, "f_2^B", 9823, "f2B = I2 a2 + p2", arm.f_B(2), (9855,)),
        row(of, "f_2", 9827, "f2 = f2B + 2X3* f3", arm.f_2, (9857, 10315, 11101)),
        row(of, "tau_2", 9831, "tau_2 = S2^T f2", arm.torques[1:2, :], (9859,)),
    ]


CASES = (
    Case("propagation-inverse-dynamics", "Equations from inverse dynamics, on link 2 of the three-link arm",
         Slide("5.7", f"{TITLE} - Equations from Inverse Dynamics", 9100), _inverse_dynamics),
    Case("propagation-simplification", "Simplifying them, on link 2 of the three-link arm in exact numbers",
         Slide("5.7", f"{TITLE} - Simplification of Equations from Inverse Dynamics", 9176), _simplification,
         remarks=[Remark("There and back, from b_G2 to b_G2, is the unit matrix bG2_X_bG2; it is printed as b2_X_b2, which has "
                         "the same value.", 9266)]),
    Case("propagation-short-letters", "The simplified equations, on the three-link arm",
         Slide("5.7", f"{TITLE} - Simplified version of Equations from Inverse Dynamics", 9819), _letters),
)
