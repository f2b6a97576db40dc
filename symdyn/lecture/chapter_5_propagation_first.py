"""5.7, forward dynamics of link 1 of the two-link arm: eliminating q2_ddot gives I_1^A and p_1^A.

Sizes, masses and angles in exact numbers, as f_1 is written in nine ways; 5.8 has the results in symbols.
"""

from __future__ import annotations

import sympy as sp

from symdyn.comparison.case import Case, Formula, Slide
from symdyn.lecture.propagation_arms import Arm, inverse, row


def _link_1() -> list[Formula]:
    arm = Arm(2, exact=True)
    X, Xs, S, I, c, p = arm.X_2, arm.X_star_2, arm.S_2, arm.I_2, arm.c_2, arm.p_2
    S_1, I_1, c_1, p_1, a_0, a_1, f_1 = arm.S_1, arm.I_1, arm.c_1, arm.p_1, arm.a_0, arm.a_1, arm.f_1
    I_A, p_A, X_1 = arm.I_A_1, arm.p_A_1, arm.X_1
    (q1_ddot, q2_ddot), (tau_1, tau) = arm.q_ddot, arm.tau
    D = inverse(S.T * I * S)
    solved = D * (tau - S.T * (I * (X * a_1 + c) + p))
    printed_I_A = I_1 + Xs * I * X - Xs * I * S * D * S.T * I * X
    printed_p_A = p_1 + Xs * p + Xs * I * c + Xs * I * S * D * (tau - S.T * (I * c + p))
    # From here on q2_ddot is what tau_2 makes it, for a given a_1.
    free = arm.free(2)

    def eliminated(name: str, line: int, printed: sp.Matrix, *also: int) -> Formula:
        return row(name, line, printed, f_1, also, where=free, latex="f_1")

    return [
        row("a_1", 10661, X_1 * a_0 + S_1 * q1_ddot + c_1, a_1,
            (10691, 10712, 10733, 10762, 10789, 10813, 10837, 10862, 11028, 11058), latex="a_1"),
        row("f_1^B", 10663, I_1 * a_1 + p_1, arm.f_B(1),
            (10693, 10714, 10735, 10764, 10791, 10815, 10839, 10864, 11030), latex="f_1^B"),
        row("f_1", 10665, arm.f_B(1) + Xs * arm.f_2, f_1,
            (10695, 10716, 10739, 10768, 10793, 10819, 10843, 10866, 11034), latex="f_1"),
        row("tau_1", 10667, S_1.T * f_1, arm.torques[:1, :],
            (10697, 10718, 10745, 10776, 10801, 10827, 10849, 10868, 11040, 11068), latex=r"\tau_1"),
        row("f_1 with f_1^B put in", 10743, I_1 * a_1 + p_1 + Xs * arm.f_2, f_1, (10774, 10799), latex="f_1"),
        row("f_2 from the equations for link 2", 10772, I * (X * a_1 + S * q2_ddot + c) + p, arm.f_2, (10797, 10823),
            latex="f_2"),
        row("f_1 with f_2 put in", 10825, I_1 * a_1 + p_1 + Xs * (I * (X * a_1 + S * q2_ddot + c) + p), f_1,
            (10847, 10873, 10884, 10895, 10910, 10931, 10956, 10980, 11004, 11036), latex="f_1"),
        row("q2_ddot for a given a_1", 10904, solved, [free[q2_ddot]], (10919, 10940, 10958, 10982, 11006),
            latex=r"\ddot{q}_2"),
        eliminated("f_1 with q2_ddot put in", 10925, I_1 * a_1 + p_1 + Xs * (I * (X * a_1 + S * solved + c) + p), 10946),
        eliminated("f_1, X* p_2 taken out", 10950, I_1 * a_1 + p_1 + Xs * I * (X * a_1 + S * solved + c) + Xs * p, 10962),
        eliminated("f_1, multiplied out", 10966,
                   I_1 * a_1 + p_1 + Xs * I * X * a_1 + Xs * I * S * solved + Xs * I * c + Xs * p),
        eliminated("f_1, a_1 first", 10970,
                   I_1 * a_1 + Xs * I * X * a_1 + Xs * I * c + Xs * I * S * solved + p_1 + Xs * p),
        eliminated("f_1, inner bracket multiplied out", 10974,
                   I_1 * a_1 + Xs * I * X * a_1 + Xs * I * c
                   + Xs * I * S * D * (tau - S.T * (I * X * a_1 + I * c + p)) + p_1 + Xs * p),
        eliminated("f_1, a_1 apart in the bracket", 10986,
                   I_1 * a_1 + Xs * I * X * a_1 + Xs * I * c
                   + Xs * I * S * D * (tau - S.T * I * X * a_1 - S.T * (I * c + p)) + p_1 + Xs * p),
        eliminated("f_1, a_1 out of the bracket", 10990,
                   I_1 * a_1 + Xs * I * X * a_1 + Xs * I * c - Xs * I * S * D * S.T * I * X * a_1
                   + Xs * I * S * D * (tau - S.T * (I * c + p)) + p_1 + Xs * p),
        eliminated("f_1, sorted", 10994,
                   I_1 * a_1 + Xs * I * X * a_1 - Xs * I * S * D * S.T * I * X * a_1
                   + p_1 + Xs * p + Xs * I * c + Xs * I * S * D * (tau - S.T * (I * c + p))),
        eliminated("f_1, a_1 factored out", 10998, printed_I_A * a_1 + printed_p_A, 11010),
        eliminated("f_1 with I_1^A and p_1^A", 11012, I_A * a_1 + p_A, 11042, 11060),
        row("I_1^A", 11014, printed_I_A, I_A, (11010, 11044, 11072), latex="I_1^A"),
        row("p_1^A", 11016, printed_p_A, p_A, (11010, 11046, 11074), latex="p_1^A"),
        row("q1_ddot", 11066, inverse(S_1.T * I_A * S_1) * (tau_1 - S_1.T * (I_A * (X_1 * a_0 + c_1) + p_A)),
            arm.accelerations[:1, :], latex=r"\ddot{q}_1"),
    ]


CASES = (
    Case("propagation-first-link", "Forward dynamics of the two-link arm: equations for link 1, in exact numbers",
         Slide("5.7", "Forward Dynamics - Propagation Methods - Examples of 2 link arm", 10661), _link_1),
)
