"""5.8, the summary: forward dynamics of the two-link arm in symbols and of the three-link arm in exact numbers."""

from __future__ import annotations

import sympy as sp

from symdyn.comparison.case import Case, Erratum, Formula, Slide
from symdyn.comparison.proofs import Proof
from symdyn.lecture.propagation_arms import arm_of, row


def _two_links() -> list[Formula]:
    arm = arm_of(2)
    of, q1_ddot, q2_ddot = arm.letter, *arm.q_ddot
    free = arm.free(2)
    mass = arm.put(arm.system.embedding().explicit("M_tilde", simplify=False))
    product = Erratum(
        "A product stands where line 11186 has a minus: what link 2 gives way at its free joint is subtracted.",
        Proof("another formulation", "1 / (S_1^T I_1^A S_1) is the first entry of the inverse of M_tilde by embedding",
              lambda I_A: arm.S_1.T * I_A * arm.S_1 * mass.inv()[0, 0] - sp.Matrix([1])))
    solved = "q2'' = (S2^T I2 S2)^-1 (tau_2 - S2^T (I2 (2X1 a1 + c2) + p2))"
    return [
        row(of, "a_1", 11087, "a1 = 1X0 a0 + S1 q1'' + c1", arm.a_1,
            (11116, 11139, 11172, 11197, 11225, 11254, 11285, 11316, 11351)),
        row(of, "f_1^B", 11089, "f1B = I1 a1 + p1", arm.f_B(1), (11118, 11141)),
        row(of, "f_1", 11091, "f1 = f1B + 1X2* f2", arm.f_1, (11120, 11143)),
        row(of, "tau_1", 11093, "tau_1 = S1^T f1", arm.torques[:1, :],
            (11122, 11151, 11176, 11201, 11229, 11258, 11291, 11322, 11357)),
        row(of, "a_2", 11097, "a2 = 2X1 a1 + S2 q2'' + c2", arm.a_2,
            (11126, 11155, 11180, 11205, 11233, 11264, 11299, 11326, 11365)),
        row(of, "f_2^B", 11099, "f2B = I2 a2 + p2", arm.f_B(2)),
        row(of, "f_2", 11103, "f2 = I2 a2 + p2", arm.f_2, (11128, 11157, 11182, 11207, 11235, 11266, 11301, 11328, 11367)),
        row(of, "tau_2", 11107, "tau_2 = S2^T f2", arm.torques[1:, :],
            (11130, 11159, 11184, 11209, 11237, 11268, 11303, 11330, 11369)),
        row(of, "f_1 with I_1^A and p_1^A", 11145, "f1 = I1A a1 + p1A", arm.f_1,
            (11174, 11199, 11227, 11256, 11289, 11320, 11355), where=free),
        row(of, "I_1^A with a product", 11161, "I1A = I1 + 1X2* I2 2X1 1X2* I2 S2 (S2^T I2 S2)^-1 S2^T I2 2X1", arm.I_A_1,
            (11340, 11375), [product]),
        row(of, "I_1^A", 11186, "I1A = I1 + 1X2* I2 2X1 - 1X2* I2 S2 (S2^T I2 S2)^-1 S2^T I2 2X1", arm.I_A_1,
            (11214, 11243, 11274, 11305)),
        row(of, "p_1^A", 11163, "p1A = p1 + 1X2* p2 + 1X2* I2 c2 + 1X2* I2 S2 (S2^T I2 S2)^-1 (tau_2 - S2^T (I2 c2 + p2))",
            arm.p_A_1, (11188, 11216, 11245, 11276, 11307, 11342, 11377)),
        row(of, "q2_ddot for a given a_1", 11212, solved, [free[q2_ddot]], (11239, 11270, 11334, 11371)),
        row(of, "q1_ddot", 11270, "q1'' = (S1^T I1A S1)^-1 (tau_1 - S1^T (I1A (1X0 a0 + c1) + p1A))", arm.accelerations[:1, :],
            (11293, 11332, 11359)),
        # now with the a_1 that follows from q1_ddot
        row(of, "q2_ddot", 11334, solved, arm.accelerations[1:, :], (11371,), where={q1_ddot: arm.accelerations[0]}),
    ]


def _three_links() -> list[Formula]:
    arm = arm_of(3, exact=True)
    of, _, q2_ddot, q3_ddot = arm.letter, *arm.q_ddot
    # Accelerations outwards of a link are what the torques make them, for given ones up to that link.
    free_3, free_23 = arm.free(3), arm.free(2, 3)
    return [
        row(of, "a_1", 11386, "a1 = 1X0 a0 + S1 q1'' + c1", arm.a_1),
        row(of, "f_1", 11388, "f1 = I1A a1 + p1A", arm.f_1, where=free_23),
        row(of, "tau_1", 11390, "tau_1 = S1^T f1", arm.torques[:1, :]),
        row(of, "q1_ddot", 11392, "q1'' = (S1^T I1A S1)^-1 (tau_1 - S1^T (I1A (1X0 a0 + c1) + p1A))", arm.accelerations[:1, :]),
        row(of, "a_2", 11398, "a2 = 2X1 a1 + S2 q2'' + c2", arm.a_2),
        row(of, "f_2", 11400, "f2 = I2A a2 + p2A", arm.f_2, where=free_3),
        row(of, "tau_2", 11402, "tau_2 = S2^T f2", arm.torques[1:2, :]),
        row(of, "q2_ddot for a given a_1", 11404, "q2'' = (S2^T I2A S2)^-1 (tau_2 - S2^T (I2A (2X1 a1 + c2) + p2A))",
            [free_23[q2_ddot]]),
        row(of, "a_3", 11408, "a3 = 3X2 a2 + S3 q3'' + c3", arm.a_3),
        row(of, "f_3", 11410, "f3 = I3 a3 + p3", arm.f_3),
        row(of, "tau_3", 11412, "tau_3 = S3^T f3", arm.torques[2:, :]),
        row(of, "q3_ddot for a given a_2", 11414, "q3'' = (S3^T I3 S3)^-1 (tau_3 - S3^T (I3 (3X2 a2 + c3) + p3))",
            [free_3[q3_ddot]]),
        row(of, "I_1^A", 11416, "I1A = I1 + 1X2* I2A 2X1 - 1X2* I2A S2 (S2^T I2A S2)^-1 S2^T I2A 2X1", arm.I_A_1),
        row(of, "I_2^A", 11416, "I2A = I2 + 2X3* I3 3X2 - 2X3* I3 S3 (S3^T I3 S3)^-1 S3^T I3 3X2", arm.I_A_2),
        row(of, "p_1^A", 11417, "p1A = p1 + 1X2* p2A + 1X2* I2A c2"
            " + 1X2* I2A S2 (S2^T I2A S2)^-1 (tau_2 - S2^T (I2A c2 + p2A))", arm.p_A_1),
        row(of, "p_2^A", 11417, "p2A = p2 + 2X3* p3 + 2X3* I3 c3 + 2X3* I3 S3 (S3^T I3 S3)^-1 (tau_3 - S3^T (I3 c3 + p3))",
            arm.p_A_2),
    ]


CASES = (
    Case("propagation-two-links", "Summary of the forward dynamics of the two-link arm",
         Slide("5.8", "Forward Dynamics of 2-Link Arm", 11087), _two_links),
    Case("propagation-three-links", "Summary of the forward dynamics of the three-link arm, in exact numbers",
         Slide("5.8", "Forward Dynamics of 3-Link Arm", 11386), _three_links),
)
