"""Chapters 6.2 and 6.3: virtual work of the platform, and its equations of motion about the point O (embedding)."""

from __future__ import annotations

import sympy as sp

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, proofs
from symdyn.frames.product import times
from symdyn.lecture.chapter_6_platform import Body
from symdyn.lecture.chapter_6_transformation import F, Platform, q, tau
from symdyn.lecture.letters import constant, ddot, dot, moving
from symdyn.model.symbols import symbols_of

SECTION = "2.1 Equations of Motion"
TITLE = f"{SECTION} - Derivation of Equations of Motion with respect to the"


def virtual_work() -> list[Formula]:
    """Newton's and Euler's equations times a virtual displacement."""
    P = Body("P", principal=True)
    delta_r, delta_chi, chi = constant("delta_r"), constant("delta_chi"), moving("chi")
    delta_s, r = sp.Matrix.vstack(delta_r, delta_chi), moving("r_GE")
    F_e, F_c = sp.Matrix.vstack(P.F, P.tau), sp.Matrix.vstack(P.F_c, P.tau_c)
    balance = P.M * P.s_ddot + P.Q * P.s_dot - F_e - F_c
    residual = P.needed - P.forces
    works = sp.Matrix([delta_r.dot(residual[:3, :]), delta_chi.dot(residual[3:, :])])
    w = P.omega
    printed = sp.Matrix([r.dot(P.m * ddot(P.r) - P.F - P.F_c), chi.dot(P.I * dot(w) + w.cross(P.I * w) - P.tau - P.tau_c)])
    perpendicular = {P.F_c[0]: -(delta_s[1:, :].dot(F_c[1:, :])) / delta_r[0]}
    nothing = proofs.limit("Without a virtual displacement there is no virtual work.", at=dict.fromkeys(delta_s, 0), value=[0, 0])
    varied = Erratum("Virtual work takes the variations delta r and delta chi, not the position and the angles themselves.",
                     nothing)
    return [
        Formula("dynamic equilibrium", balance, residual, line=11763, also=(11759, 12049, 12053)),
        Formula("virtual work", (delta_s.T * balance)[0], works[0] + works[1], line=11767, also=(12057,)),
        Formula("as inner products", printed, works, line=11771, also=(11770, 12060, 12061), errata=[varied]),
        Formula("work of the constraint forces", 0, work_of_a_joint(), line=11773, also=(12063,), latex=r"\delta s \cdot F^c"),
        Formula("virtual work without constraint forces", (delta_s.T * (P.M * P.s_ddot + P.Q * P.s_dot - F_e))[0],
                works[0] + works[1], line=11778, also=(11849, 12068, 12133), where=perpendicular),
    ]


def work_of_a_joint() -> sp.Expr:
    """delta s . F^c of a pendulum, with the reaction of its joint."""
    angle = sd.coordinates("alpha")
    l, mass, g = sp.symbols("l m g", positive=True)
    pendulum = sd.embedding([angle], [l * sp.sin(angle), -l * sp.cos(angle)], [mass, mass], force=[0, -mass * g])
    return (pendulum.J * sp.Symbol("delta_alpha")).dot(pendulum.F_c)


def embedding() -> list[Formula]:
    """With s_dot = J q_dot; the slide's k with J in place of J_dot is in chapter 6.3 only."""
    p = Platform(sp.Matrix([0, 0, sp.Symbol("c")]))
    # The axes of the n-frame are chosen along the heading of that moment: psi = 0 once all is differentiated.
    ahead = {q[3]: sp.S.Zero}
    J, Jdot, M, Q = (matrix.xreplace(ahead) for matrix in (p.J, sd.rate(p.J), p.M, p.Q))
    J_derived, Jd_qd, M_tilde, k_tilde, F_tilde = (
        p.derived(name).xreplace(ahead) for name in ("J", "Jd_qd", "M_tilde", "k_tilde", "F_tilde"))
    qd, qdd, forces = p.qd, ddot(q), sp.Matrix.vstack(F, tau)
    equations = times(M_tilde, qdd) + k_tilde - F_tilde
    delta_q = sp.Matrix([sp.Symbol(f"delta_{c}") for c in q])
    work = delta_q.dot(equations)
    MJ, QJ = times(M, J), times(Q, J)
    inertia = times(M, times(J, qdd) + times(Jdot, qd)) + times(Q, times(J, qd)) - forces
    gyroscopic = times(J.T, QJ, qd)
    k_bar = times(J.T, M, Jdot, qd) + gyroscopic
    k_without_dot = times(J.T, MJ, qd) + gyroscopic
    faster = proofs.Proof("dimensions", "Centrifugal forces are four times as large at twice the speed.",
                          lambda k: k.xreplace({s: 2 * s for s in symbols_of(k) if s.name.endswith("_dot")}) - 4 * k)
    lost_dot = Erratum("The dot over the second J is lost: M J_dot q_dot is a force, M J q_dot a momentum.", faster)
    upright = dict.fromkeys(q[4:], sp.S.Zero)
    again = Slide("6.3", f"{TITLE} Arbitrary Point O for Rigid Body", 12163)
    M_bar = times(J.T, MJ)
    M_qdd, F_bar = times(M_bar, qdd), times(J.T, forces)
    return [
        Formula("s_ddot", times(J, qdd) + times(Jdot, qd), times(J_derived, qdd) + Jd_qd, line=11853, also=(12137,),
                latex=r"\ddot{s}"),
        Formula("virtual work with J", times(J, delta_q).dot(inertia), work, line=11857, also=(12141,)),
        Formula("virtual work with the transpose", times(delta_q.T, J.T, inertia)[0], work, line=11859, also=(12143,)),
        Formula("multiplied out", times(delta_q.T, M_qdd + k_bar - F_bar)[0], work, line=11861, also=(12145,)),
        Formula("M_bar", M_bar, M_tilde, line=11865, also=(11881, 12149, 12163, 12179), latex=r"\bar{M}"),
        Formula("k_bar", k_bar, k_tilde, line=11865, also=(11881, 12149), latex=r"\bar{k}"),
        Formula("F_bar", F_bar, F_tilde, line=11865, also=(11881, 12149, 12163, 12179), latex=r"\bar{F}"),
        Formula("equations of motion", M_qdd + k_bar - F_bar, equations, line=11885, also=(11863, 11879, 12147, 12161,
                12167, 12177)),
        Formula("k_bar of chapter 6.3, upright", k_without_dot.xreplace(upright), k_tilde.xreplace(upright), slide=again,
                also=(12179,), errata=[lost_dot], latex=r"\bar{k}"),
    ]


CASES = (
    Case("platform-virtual-work", "Virtual work of forces and inertia",
         Slide("6.2", f"{TITLE} Center of Mass G for Rigid Body", 11755),
         virtual_work),
    Case("platform-embedding", "Equations of motion of the platform about O",
         Slide("6.2", f"{SECTION} - Coordinates Transformation", 11845), embedding),
)
