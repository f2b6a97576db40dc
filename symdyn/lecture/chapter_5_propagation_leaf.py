"""5.7, forward dynamics of the last link of an arm: the one-link arm, and link 2 of the two-link arm."""

from __future__ import annotations

import sympy as sp

from symdyn.comparison.case import Case, Erratum, Formula, Slide
from symdyn.comparison.proofs import other
from symdyn.lecture.propagation_arms import Arm, inverse, row
from symdyn.lecture.propagation_newton import Newton

TITLE = "Forward Dynamics - Propagation Methods"


def _one_link() -> list[Formula]:
    arm = Arm(1)
    X, S, I, c, p, a_0, a_1, f_1 = arm.X_1, arm.S_1, arm.I_1, arm.c_1, arm.p_1, arm.a_0, arm.a_1, arm.f_1
    (q_ddot,), (tau,), torque = arm.q_ddot, arm.tau, arm.torques
    needed = (tau, torque)  # tau_1 = S^T f_1 as symdyn derives it
    return [
        row("a_1", 9871, X * a_0 + S * q_ddot + c, a_1,
            (9895, 9921, 9945, 9969, 9999, 10031, 10053, 10077, 10099, 10123, 10151, 10182, 10218, 10246, 10279), latex="a_1"),
        row("f_1^B", 9873, I * a_1 + p, arm.f_B(1), (9897, 9923, 9947, 9971, 10009), latex="f_1^B"),
        row("f_1 of the last link", 9925, arm.f_B(1), f_1, (9949, 9975, 10013), latex="f_1"),
        row("f_1", 9979, I * a_1 + p, f_1, (10017, 10033, 10055, 10079, 10101, 10125, 10153, 10194, 10220, 10248, 10281),
            latex="f_1"),
        row("tau_1", 9877, S.T * f_1, torque,
            (9903, 9927, 9951, 9981, 10021, 10035, 10057, 10081, 10103, 10127, 10155, 10200, 10222, 10250, 10283),
            latex=r"\tau_1"),
        row("f_1 with a_1 put in", 10055, I * (X * a_0 + S * q_ddot + c) + p, f_1, (10065, 10079), latex="f_1"),
        row("tau_1 with f_1 put in", 10081, S.T * (I * (X * a_0 + S * q_ddot + c) + p), torque,
            (10113, 10137, 10157, 10192, 10232, 10252, 10285), latex=r"\tau_1"),
        row("tau_1, q1_ddot taken out of the bracket", 10141, S.T * (I * (X * a_0 + c) + I * S * q_ddot + p), torque,
            (10161, 10198), latex=r"\tau_1"),
        row("tau_1, q1_ddot last", 10164, S.T * (I * (X * a_0 + c) + p) + S.T * I * S * q_ddot, torque, (10204,),
            latex=r"\tau_1"),
        row("equation of motion", 10208, (S.T * I * S * q_ddot, tau - S.T * (I * (X * a_0 + c) + p)), needed,
            (10236, 10255, 10287)),
        row("q1_ddot", 10259, inverse(S.T * I * S) * (tau - S.T * (I * (X * a_0 + c) + p)), arm.accelerations, (10289,),
            latex=r"\ddot{q}_1"),
    ]


def _link_2() -> list[Formula]:
    arm = Arm(2)
    X, S, I, c, p, a_1, a_2, f_2 = arm.X_2, arm.S_2, arm.I_2, arm.c_2, arm.p_2, arm.a_1, arm.a_2, arm.f_2
    q_ddot, tau, torque = arm.q_ddot[1], arm.tau[1], arm.torques[1:, :]
    # For a given a_1, that is a given q1_ddot.
    free = sp.Matrix([arm.free(2)[q_ddot]])
    missing = Erratum("On an arm of two links the joint of link 1 also carries link 2: X* f_2 is missing.",
                      other("Moment and force by Newton and Euler in 3-vectors, from differentiating positions",
                            Newton(arm).through_joint(1)))
    return [
        row("a_2", 10311, X * a_1 + S * q_ddot + c, a_2,
            (10334, 10357, 10378, 10399, 10428, 10447, 10468, 10482, 10501, 10524, 10552, 10580, 10605, 10633), latex="a_2"),
        row("f_2^B", 10313, I * a_2 + p, arm.f_B(2), (10336, 10359, 10380, 10401), latex="f_2^B"),
        row("f_2 of the last link", 10338, arm.f_B(2), f_2, (10361, 10382, 10405), latex="f_2"),
        row("f_2", 10409, I * a_2 + p, f_2, (10430, 10450, 10470, 10484, 10503, 10526, 10556, 10582, 10609, 10637), latex="f_2"),
        row("tau_2", 10317, S.T * f_2, torque,
            (10342, 10363, 10384, 10413, 10432, 10452, 10472, 10486, 10505, 10528, 10562, 10584, 10615, 10643),
            latex=r"\tau_2"),
        row("f_1 beside the equations for link 2", 10319, arm.I_1 * (arm.X_1 * arm.a_0 + arm.S_1 * arm.q_ddot[0] + arm.c_1)
            + arm.p_1, arm.f_1, (10344, 10365, 10386, 10415, 10434, 10669), [missing], latex="f_1"),
        row("f_2 with a_2 put in", 10450, I * (X * a_1 + S * q_ddot + c) + p, f_2, (10470,), latex="f_2"),
        row("tau_2 with f_2 put in", 10472, S.T * (I * (X * a_1 + S * q_ddot + c) + p), torque,
            (10491, 10510, 10530, 10554, 10589, 10607, 10635), latex=r"\tau_2"),
        row("tau_2, q2_ddot taken out of the bracket", 10514, S.T * (I * (X * a_1 + c) + I * S * q_ddot + p), torque,
            (10534, 10560), latex=r"\tau_2"),
        row("tau_2, q2_ddot last", 10538, S.T * (I * (X * a_1 + c) + p) + S.T * I * S * q_ddot, torque, (10566,),
            latex=r"\tau_2"),
        row("equation of motion", 10570, (S.T * I * S * q_ddot, tau - S.T * (I * (X * a_1 + c) + p)), (tau, torque),
            (10593, 10613, 10641)),
        row("q2_ddot for a given a_1", 10619, inverse(S.T * I * S) * (tau - S.T * (I * (X * a_1 + c) + p)), free, (10647,),
            latex=r"\ddot{q}_2"),
    ]


CASES = (
    Case("propagation-one-link", "Forward dynamics of the one-link arm",
         Slide("5.7", f"{TITLE} - Examples of 1 link arm", 9871), _one_link),
    Case("propagation-last-link", "Forward dynamics of the two-link arm: equations for link 2",
         Slide("5.7", f"{TITLE} - Examples of 2 link arm", 10311), _link_2),
)
