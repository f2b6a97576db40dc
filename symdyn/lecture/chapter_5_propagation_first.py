"""5.7, forward dynamics of link 1 of the two-link arm: eliminating q2_ddot gives I_1^A and p_1^A.

Sizes, masses and angles in exact numbers, as f_1 is written in nine ways; 5.8 has the results in symbols.
"""

from __future__ import annotations

from symdyn.comparison.case import Case, Formula, Slide
from symdyn.lecture.propagation_arms import arm_of, row

# q2_ddot of the equations for link 2, and what of it a_1 is not in
SOLVED = "(S2^T I2 S2)^-1 (tau_2 - S2^T (I2 (2X1 a1 + c2) + p2))"
REST = "(S2^T I2 S2)^-1 (tau_2 - S2^T (I2 c2 + p2))"
I_1_A = "I1 + 1X2* I2 2X1 - 1X2* I2 S2 (S2^T I2 S2)^-1 S2^T I2 2X1"
P_1_A = f"p1 + 1X2* p2 + 1X2* I2 c2 + 1X2* I2 S2 {REST}"


def _link_1() -> list[Formula]:
    arm = arm_of(2, exact=True)
    of, f_1 = arm.letter, arm.f_1
    # From here on q2_ddot is what tau_2 makes it, for a given a_1.
    free = arm.free(2)

    def eliminated(name: str, line: int, text: str, *also: int) -> Formula:
        return row(of, name, line, f"f1 = {text}", f_1, also, where=free)

    return [
        row(of, "a_1", 10661, "a1 = 1X0 a0 + S1 q1'' + c1", arm.a_1,
            (10691, 10712, 10733, 10762, 10789, 10813, 10837, 10862, 11028, 11058)),
        row(of, "f_1^B", 10663, "f1B = I1 a1 + p1", arm.f_B(1), (10693, 10714, 10735, 10764, 10791, 10815, 10839, 10864, 11030)),
        row(of, "f_1", 10665, "f1 = f1B + 1X2* f2", f_1, (10695, 10716, 10739, 10768, 10793, 10819, 10843, 10866, 11034)),
        row(of, "tau_1", 10667, "tau_1 = S1^T f1", arm.torques[:1, :],
            (10697, 10718, 10745, 10776, 10801, 10827, 10849, 10868, 11040, 11068)),
        row(of, "f_1 with f_1^B put in", 10743, "f1 = I1 a1 + p1 + 1X2* f2", f_1, (10774, 10799)),
        row(of, "f_2 from the equations for link 2", 10772, "f2 = I2 (2X1 a1 + S2 q2'' + c2) + p2", arm.f_2, (10797, 10823)),
        row(of, "f_1 with f_2 put in", 10825, "f1 = I1 a1 + p1 + 1X2* (I2 (2X1 a1 + S2 q2'' + c2) + p2)", f_1,
            (10847, 10873, 10884, 10895, 10910, 10931, 10956, 10980, 11004, 11036)),
        row(of, "q2_ddot for a given a_1", 10904, f"q2'' = {SOLVED}", [free[arm.q_ddot[1]]],
            (10919, 10940, 10958, 10982, 11006)),
        eliminated("f_1 with q2_ddot put in", 10925, f"I1 a1 + p1 + 1X2* (I2 (2X1 a1 + S2 {SOLVED} + c2) + p2)", 10946),
        eliminated("f_1, X* p_2 taken out", 10950, f"I1 a1 + p1 + 1X2* I2 (2X1 a1 + S2 {SOLVED} + c2) + 1X2* p2", 10962),
        eliminated("f_1, multiplied out", 10966,
                   f"I1 a1 + p1 + 1X2* I2 2X1 a1 + 1X2* I2 S2 {SOLVED} + 1X2* I2 c2 + 1X2* p2"),
        eliminated("f_1, a_1 first", 10970, f"I1 a1 + 1X2* I2 2X1 a1 + 1X2* I2 c2 + 1X2* I2 S2 {SOLVED} + p1 + 1X2* p2"),
        eliminated("f_1, inner bracket multiplied out", 10974,
                   "I1 a1 + 1X2* I2 2X1 a1 + 1X2* I2 c2"
                   " + 1X2* I2 S2 (S2^T I2 S2)^-1 (tau_2 - S2^T (I2 2X1 a1 + I2 c2 + p2)) + p1 + 1X2* p2"),
        eliminated("f_1, a_1 apart in the bracket", 10986,
                   "I1 a1 + 1X2* I2 2X1 a1 + 1X2* I2 c2"
                   " + 1X2* I2 S2 (S2^T I2 S2)^-1 (tau_2 - S2^T I2 2X1 a1 - S2^T (I2 c2 + p2)) + p1 + 1X2* p2"),
        eliminated("f_1, a_1 out of the bracket", 10990,
                   "I1 a1 + 1X2* I2 2X1 a1 + 1X2* I2 c2 - 1X2* I2 S2 (S2^T I2 S2)^-1 S2^T I2 2X1 a1"
                   f" + 1X2* I2 S2 {REST} + p1 + 1X2* p2"),
        eliminated("f_1, sorted", 10994, f"I1 a1 + 1X2* I2 2X1 a1 - 1X2* I2 S2 (S2^T I2 S2)^-1 S2^T I2 2X1 a1 + {P_1_A}"),
        eliminated("f_1, a_1 factored out", 10998, f"({I_1_A}) a1 + {P_1_A}", 11010),
        eliminated("f_1 with I_1^A and p_1^A", 11012, "I1A a1 + p1A", 11042, 11060),
        row(of, "I_1^A", 11014, f"I1A = {I_1_A}", arm.I_A_1, (11010, 11044, 11072)),
        row(of, "p_1^A", 11016, f"p1A = {P_1_A}", arm.p_A_1, (11010, 11046, 11074)),
        row(of, "q1_ddot", 11066, "q1'' = (S1^T I1A S1)^-1 (tau_1 - S1^T (I1A (1X0 a0 + c1) + p1A))", arm.accelerations[:1, :]),
    ]


CASES = (
    Case("propagation-first-link", "Forward dynamics of the two-link arm: equations for link 1, in exact numbers",
         Slide("5.7", "Forward Dynamics - Propagation Methods - Examples of 2 link arm", 10661), _link_1),
)
