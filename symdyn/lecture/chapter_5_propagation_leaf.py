"""5.7, forward dynamics of the last link of an arm: the one-link arm, and link 2 of the two-link arm."""

from __future__ import annotations

import sympy as sp

from symdyn.comparison.case import Case, Erratum, Formula, Remark, Slide
from symdyn.comparison.proofs import other
from symdyn.lecture.propagation_arms import arm_of, row
from symdyn.lecture.propagation_newton import Newton

TITLE = "Forward Dynamics - Propagation Methods"


def _one_link() -> list[Formula]:
    arm = arm_of(1)
    of, f_1, (tau,), torque = arm.letter, arm.f_1, arm.tau, arm.torques
    return [
        row(of, "a_1", 9871, "a1 = 1X0 a0 + S1 q1'' + c1", arm.a_1,
            (9895, 9921, 9945, 9969, 9999, 10031, 10053, 10077, 10099, 10123, 10151, 10182, 10218, 10246, 10279)),
        row(of, "f_1^B", 9873, "f1B = I1 a1 + p1", arm.f_B(1), (9897, 9923, 9947, 9971, 10009)),
        row(of, "f_1 of the last link", 9925, "f1 = f1B", f_1, (9949, 9975, 10013)),
        row(of, "f_1", 9979, "f1 = I1 a1 + p1", f_1,
            (10017, 10033, 10055, 10079, 10101, 10125, 10153, 10194, 10220, 10248, 10281)),
        row(of, "tau_1", 9877, "tau_1 = S1^T f1", torque,
            (9903, 9927, 9951, 9981, 10021, 10035, 10057, 10081, 10103, 10127, 10155, 10200, 10222, 10250, 10283)),
        row(of, "f_1 with a_1 put in", 10055, "f1 = I1 (1X0 a0 + S1 q1'' + c1) + p1", f_1, (10065, 10079)),
        row(of, "tau_1 with f_1 put in", 10081, "tau_1 = S1^T (I1 (1X0 a0 + S1 q1'' + c1) + p1)", torque,
            (10113, 10137, 10157, 10192, 10232, 10252, 10285)),
        row(of, "tau_1, q1_ddot taken out of the bracket", 10141, "tau_1 = S1^T (I1 (1X0 a0 + c1) + I1 S1 q1'' + p1)", torque,
            (10161, 10198)),
        row(of, "tau_1, q1_ddot last", 10164, "tau_1 = S1^T (I1 (1X0 a0 + c1) + p1) + S1^T I1 S1 q1''", torque, (10204,)),
        # tau_1 on one side, and on the other what symdyn derives for it
        row(of, "equation of motion", 10208, "S1^T I1 S1 q1'' = tau_1 - S1^T (I1 (1X0 a0 + c1) + p1)", (tau, torque),
            (10236, 10255, 10287)),
        row(of, "q1_ddot", 10259, "q1'' = (S1^T I1 S1)^-1 (tau_1 - S1^T (I1 (1X0 a0 + c1) + p1))", arm.accelerations, (10289,)),
    ]


def _link_2() -> list[Formula]:
    arm = arm_of(2)
    of, f_2, tau, torque = arm.letter, arm.f_2, arm.tau[1], arm.torques[1:, :]
    # For a given a_1, that is a given q1_ddot.
    free = sp.Matrix([arm.free(2)[arm.q_ddot[1]]])
    missing = Erratum("On an arm of two links the joint of link 1 also carries link 2: X* f_2 is missing.",
                      other("Moment and force by Newton and Euler in 3-vectors, from differentiating positions",
                            Newton(arm).through_joint(1)))
    return [
        row(of, "a_2", 10311, "a2 = 2X1 a1 + S2 q2'' + c2", arm.a_2,
            (10334, 10357, 10378, 10399, 10428, 10447, 10468, 10482, 10501, 10524, 10552, 10580, 10605, 10633)),
        row(of, "f_2^B", 10313, "f2B = I2 a2 + p2", arm.f_B(2), (10336, 10359, 10380, 10401)),
        row(of, "f_2 of the last link", 10338, "f2 = f2B", f_2, (10361, 10382, 10405)),
        row(of, "f_2", 10409, "f2 = I2 a2 + p2", f_2, (10430, 10450, 10470, 10484, 10503, 10526, 10556, 10582, 10609, 10637)),
        row(of, "tau_2", 10317, "tau_2 = S2^T f2", torque,
            (10342, 10363, 10384, 10413, 10432, 10452, 10472, 10486, 10505, 10528, 10562, 10584, 10615, 10643)),
        row(of, "f_1 next to the equations for link 2", 10319, "f1 = I1 (1X0 a0 + S1 q1'' + c1) + p1", arm.f_1,
            (10344, 10365, 10386, 10415, 10434, 10669), [missing]),
        row(of, "f_2 with a_2 put in", 10450, "f2 = I2 (2X1 a1 + S2 q2'' + c2) + p2", f_2, (10470,)),
        row(of, "tau_2 with f_2 put in", 10472, "tau_2 = S2^T (I2 (2X1 a1 + S2 q2'' + c2) + p2)", torque,
            (10491, 10510, 10530, 10554, 10589, 10607, 10635)),
        row(of, "tau_2, q2_ddot taken out of the bracket", 10514, "tau_2 = S2^T (I2 (2X1 a1 + c2) + I2 S2 q2'' + p2)", torque,
            (10534, 10560)),
        row(of, "tau_2, q2_ddot last", 10538, "tau_2 = S2^T (I2 (2X1 a1 + c2) + p2) + S2^T I2 S2 q2''", torque, (10566,)),
        row(of, "equation of motion", 10570, "S2^T I2 S2 q2'' = tau_2 - S2^T (I2 (2X1 a1 + c2) + p2)", (tau, torque),
            (10593, 10613, 10641)),
        row(of, "q2_ddot for a given a_1", 10619, "q2'' = (S2^T I2 S2)^-1 (tau_2 - S2^T (I2 (2X1 a1 + c2) + p2))", free,
            (10647,)),
    ]


CASES = (
    Case("propagation-one-link", "Forward dynamics of the one-link arm",
         Slide("5.7", f"{TITLE} - Examples of 1 link arm", 9871), _one_link),
    Case("propagation-last-link", "Forward dynamics of the two-link arm: equations for link 2",
         Slide("5.7", f"{TITLE} - Examples of 2 link arm", 10311), _link_2,
         remarks=[Remark("Link 2 is the leaf of the arm, as line 10340 has it; link 1 is printed.", 10411)]),
)
