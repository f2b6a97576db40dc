"""5.8, the summary: forward dynamics of the two-link arm in symbols and of the three-link arm in exact numbers."""

from __future__ import annotations

import sympy as sp

from symdyn.comparison.case import Case, Erratum, Formula, Slide
from symdyn.comparison.proofs import Proof
from symdyn.lecture.propagation_arms import Arm, inverse, row


def _two_links() -> list[Formula]:
    arm = Arm(2)
    X_1, X, Xs, S_1, S, I_1, I = arm.X_1, arm.X_2, arm.X_star_2, arm.S_1, arm.S_2, arm.I_1, arm.I_2
    c_1, c, p_1, p, a_0, a_1, f_1 = arm.c_1, arm.c_2, arm.p_1, arm.p_2, arm.a_0, arm.a_1, arm.f_1
    I_A, p_A = arm.I_A_1, arm.p_A_1
    (q1_ddot, q2_ddot), (tau_1, tau) = arm.q_ddot, arm.tau
    D = inverse(S.T * I * S)
    free = arm.free(2)
    mass = arm.put(arm.system.embedding().explicit("M_tilde", simplify=False))
    product = Erratum(
        "A product stands where line 11186 has a minus: what link 2 gives way at its free joint is subtracted.",
        Proof("another formulation", "1 / (S_1^T I_1^A S_1) is the first entry of the inverse of M_tilde by embedding",
              lambda I_A: S_1.T * I_A * S_1 * mass.inv()[0, 0] - sp.Matrix([1])))
    return [
        row("a_1", 11087, X_1 * a_0 + S_1 * q1_ddot + c_1, a_1,
            (11116, 11139, 11172, 11197, 11225, 11254, 11285, 11316, 11351), latex="a_1"),
        row("f_1^B", 11089, I_1 * a_1 + p_1, arm.f_B(1), (11118, 11141), latex="f_1^B"),
        row("f_1", 11091, arm.f_B(1) + Xs * arm.f_2, f_1, (11120, 11143), latex="f_1"),
        row("tau_1", 11093, S_1.T * f_1, arm.torques[:1, :],
            (11122, 11151, 11176, 11201, 11229, 11258, 11291, 11322, 11357), latex=r"\tau_1"),
        row("a_2", 11097, X * a_1 + S * q2_ddot + c, arm.a_2,
            (11126, 11155, 11180, 11205, 11233, 11264, 11299, 11326, 11365), latex="a_2"),
        row("f_2^B", 11099, I * arm.a_2 + p, arm.f_B(2), latex="f_2^B"),
        row("f_2", 11103, I * arm.a_2 + p, arm.f_2,
            (11128, 11157, 11182, 11207, 11235, 11266, 11301, 11328, 11367), latex="f_2"),
        row("tau_2", 11107, S.T * arm.f_2, arm.torques[1:, :],
            (11130, 11159, 11184, 11209, 11237, 11268, 11303, 11330, 11369), latex=r"\tau_2"),
        row("f_1 with I_1^A and p_1^A", 11145, I_A * a_1 + p_A, f_1, (11174, 11199, 11227, 11256, 11289, 11320, 11355),
            where=free, latex="f_1"),
        row("I_1^A with a product", 11161, I_1 + Xs * I * X * Xs * I * S * D * S.T * I * X, I_A, (11340, 11375), [product],
            latex="I_1^A"),
        row("I_1^A", 11186, I_1 + Xs * I * X - Xs * I * S * D * S.T * I * X, I_A, (11214, 11243, 11274, 11305), latex="I_1^A"),
        row("p_1^A", 11163, p_1 + Xs * p + Xs * I * c + Xs * I * S * D * (tau - S.T * (I * c + p)), p_A,
            (11188, 11216, 11245, 11276, 11307, 11342, 11377), latex="p_1^A"),
        row("q2_ddot for a given a_1", 11212, D * (tau - S.T * (I * (X * a_1 + c) + p)), [free[q2_ddot]],
            (11239, 11270, 11334, 11371), latex=r"\ddot{q}_2"),
        row("q1_ddot", 11270, inverse(S_1.T * I_A * S_1) * (tau_1 - S_1.T * (I_A * (X_1 * a_0 + c_1) + p_A)),
            arm.accelerations[:1, :], (11293, 11332, 11359), latex=r"\ddot{q}_1"),
        # now with the a_1 that follows from q1_ddot
        row("q2_ddot", 11334, D * (tau - S.T * (I * (X * a_1 + c) + p)), arm.accelerations[1:, :], (11371,),
            where={q1_ddot: arm.accelerations[0]}, latex=r"\ddot{q}_2"),
    ]


def _three_links() -> list[Formula]:
    arm = Arm(3, exact=True)
    X_1, X_2, X_3, Xs_2, Xs_3 = arm.X_1, arm.X_2, arm.X_3, arm.X_star_2, arm.X_star_3
    (S_1, S_2, S_3), (c_1, c_2, c_3) = (arm.S_1, arm.S_2, arm.S_3), (arm.c_1, arm.c_2, arm.c_3)
    I_3, p_3, I_A1, p_A1, I_A2, p_A2 = arm.I_3, arm.p_3, arm.I_A_1, arm.p_A_1, arm.I_A_2, arm.p_A_2
    (q1_ddot, q2_ddot, q3_ddot), (tau_1, tau_2, tau_3) = arm.q_ddot, arm.tau
    a_0, a_1, a_2 = arm.a_0, arm.a_1, arm.a_2
    # Accelerations outwards of a link are what the torques make them, for given ones up to that link.
    free_3, free_23 = arm.free(3), arm.free(2, 3)
    D_2, D_3 = inverse(S_2.T * I_A2 * S_2), inverse(S_3.T * I_3 * S_3)
    return [
        row("a_1", 11386, X_1 * a_0 + S_1 * q1_ddot + c_1, a_1, latex="a_1"),
        row("f_1", 11388, I_A1 * a_1 + p_A1, arm.f_1, where=free_23, latex="f_1"),
        row("tau_1", 11390, S_1.T * arm.f_1, arm.torques[:1, :], latex=r"\tau_1"),
        row("q1_ddot", 11392, inverse(S_1.T * I_A1 * S_1) * (tau_1 - S_1.T * (I_A1 * (X_1 * a_0 + c_1) + p_A1)),
            arm.accelerations[:1, :], latex=r"\ddot{q}_1"),
        row("a_2", 11398, X_2 * a_1 + S_2 * q2_ddot + c_2, a_2, latex="a_2"),
        row("f_2", 11400, I_A2 * a_2 + p_A2, arm.f_2, where=free_3, latex="f_2"),
        row("tau_2", 11402, S_2.T * arm.f_2, arm.torques[1:2, :], latex=r"\tau_2"),
        row("q2_ddot for a given a_1", 11404, D_2 * (tau_2 - S_2.T * (I_A2 * (X_2 * a_1 + c_2) + p_A2)), [free_23[q2_ddot]],
            latex=r"\ddot{q}_2"),
        row("a_3", 11408, X_3 * a_2 + S_3 * q3_ddot + c_3, arm.a_3, latex="a_3"),
        row("f_3", 11410, I_3 * arm.a_3 + p_3, arm.f_3, latex="f_3"),
        row("tau_3", 11412, S_3.T * arm.f_3, arm.torques[2:, :], latex=r"\tau_3"),
        row("q3_ddot for a given a_2", 11414, D_3 * (tau_3 - S_3.T * (I_3 * (X_3 * a_2 + c_3) + p_3)), [free_3[q3_ddot]],
            latex=r"\ddot{q}_3"),
        row("I_1^A", 11416, arm.I_1 + Xs_2 * I_A2 * X_2 - Xs_2 * I_A2 * S_2 * D_2 * S_2.T * I_A2 * X_2, I_A1, latex="I_1^A"),
        row("I_2^A", 11416, arm.I_2 + Xs_3 * I_3 * X_3 - Xs_3 * I_3 * S_3 * D_3 * S_3.T * I_3 * X_3, I_A2, latex="I_2^A"),
        row("p_1^A", 11417, arm.p_1 + Xs_2 * p_A2 + Xs_2 * I_A2 * c_2
            + Xs_2 * I_A2 * S_2 * D_2 * (tau_2 - S_2.T * (I_A2 * c_2 + p_A2)), p_A1, latex="p_1^A"),
        row("p_2^A", 11417, arm.p_2 + Xs_3 * p_3 + Xs_3 * I_3 * c_3
            + Xs_3 * I_3 * S_3 * D_3 * (tau_3 - S_3.T * (I_3 * c_3 + p_3)), p_A2, latex="p_2^A"),
    ]


CASES = (
    Case("propagation-two-links", "Summary of the forward dynamics of the two-link arm",
         Slide("5.8", "Forward Dynamics of 2-Link Arm", 11087), _two_links),
    Case("propagation-three-links", "Summary of the forward dynamics of the three-link arm, in exact numbers",
         Slide("5.8", "Forward Dynamics of 3-Link Arm", 11386), _three_links),
)
