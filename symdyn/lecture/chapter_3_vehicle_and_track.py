"""Lecture, chapter 3.2: the vehicle and the rotating track together, embedding technique.

The vehicle is at O, the centre of mass and hinge of the track at O_0; r = [x_O, y_O, x_O0, y_O0, theta]. On these slides q2
counts counterclockwise, and the vehicle is on the other side of the hinge than on the slides before.
"""

from __future__ import annotations

from functools import cache

from sympy import Matrix, cos, diag, sin

import symdyn as sd
from symdyn.comparison import proofs
from symdyn.comparison.case import Case, Erratum, Formula, Slide
from symdyn.lecture.chapter_3_straight_track import place_on_track

TRACK = "Vehicle constrained to move along the straight track"
# Erratum of two formulas of one slide.
ALONE = "The vehicle alone stands where J has five rows, those of vehicle and track."


@cache
def _map() -> tuple:
    """Coordinates, masses, loads, the position map and its equations."""
    q1, q2 = sd.coordinates("q1:3")
    masses = sd.parameters("m_v m_t I_t")
    loads = Matrix(sd.parameters("F_Ox F_Oy F_O0x F_O0y M_O0"))
    x0, y0 = sd.parameters("x_O0 y_O0")
    m_v, m_t, I_t = masses
    r = [*place_on_track(-q1, q2, (x0, y0)), *place_on_track(0, q2, (x0, y0)), q2]
    eq = sd.embedding([q1, q2], r, [m_v, m_v, m_t, m_t, I_t], loads, name="vehicle_and_track")
    return q1, q2, masses, loads, x0, y0, eq


def _kinematics() -> list[Formula]:
    q1, q2, _, _, x0, y0, eq = _map()
    c, s, q1d, q2d = cos(q2), sin(q2), q1.dot, q2.dot
    r = eq.explicit("r")
    r_dot = sd.rate(r)
    J = Matrix([[-c, q1 * s], [-s, -q1 * c], [0, 0], [0, 0], [0, 1]])
    J_dot = Matrix([[s * q2d, q1d * s + q1 * c * q2d], [-c * q2d, -q1d * c + q1 * s * q2d], [0, 0], [0, 0], [0, 0]])
    q_dot, q_ddot = Matrix([q1d, q2d]), Matrix([q1.ddot, q2.ddot])
    n = sd.Frame("n")
    turning = n.frame("track", rotation=sd.rotation.about("Z", q2)).angular_velocity(n, components=n)[2]
    # A particle turns with the track, but has no inertia: its orientation, row 2, is left out.
    bodies = sd.systems.vehicle_on_rotating_track().embedding()
    rows = [0, 1, 3, 4, 5]
    return [
        Formula("r of the vehicle", Matrix([x0, y0]) + Matrix([-c, -s]) * q1, r[:2, :], line=4069, also=(4085,)),
        Formula("r of the track", [x0, y0], r[2:4, :], line=4073, also=(4089, 4099)),
        Formula("theta", q2, r[4], line=4077, also=(4093, 4101)),
        Formula("x", x0 - q1 * c, r[0], line=4097),
        Formula("y", y0 - q1 * s, r[1], line=4097),
        Formula("x_dot", -q1d * c + q1 * s * q2d, r_dot[0], line=4107, also=(4123,)),
        Formula("y_dot", -q1d * s - q1 * c * q2d, r_dot[1], line=4109, also=(4125,)),
        Formula("x_dot of the track", 0, r_dot[2], line=4111, also=(4127,)),
        Formula("y_dot of the track", 0, r_dot[3], line=4113, also=(4129,)),
        Formula("theta_dot", q2d, turning, line=4115, also=(4131,)),
        Formula("r_dot", J * q_dot, r_dot, line=4135, also=(4138, 4145, 4151, 4175), latex=r"\dot{\mathbf{r}}"),
        Formula("J", J, eq.J, line=4155, also=(4135, 4145, 4195), latex=r"\mathbf{J}"),
        Formula("J of bodies and joints", J, bodies.J.extract(rows, [0, 1]), line=4155, latex=r"\mathbf{J}"),
        Formula("J_dot", J_dot, eq.Jdot, line=4155, also=(4195,), latex=r"\dot{\mathbf{J}}"),
        Formula("J_dot of bodies and joints", J_dot, bodies.Jdot.extract(rows, [0, 1]), line=4155, latex=r"\dot{\mathbf{J}}"),
        Formula("r_ddot", J * q_ddot + J_dot * q_dot, sd.rate(r_dot), line=4179, latex=r"\ddot{\mathbf{r}}"),
    ]


def _newton() -> list[Formula]:
    """The bodies one by one, with the reactions that hinge and track give them."""
    r = sd.coordinates("x_O y_O x_O0 y_O0 theta")
    hinge = sd.parameters("x_const y_const")
    m_v, m_t, I_t = sd.parameters("m_v m_t I_t")
    F = Matrix(sd.parameters("F_Ox F_Oy F_O0x F_O0y M_O0"))
    track = [r[2] - hinge[0], r[3] - hinge[1], (r[0] - r[2]) * sin(r[4]) - (r[1] - r[3]) * cos(r[4])]
    augmented = sd.augmented(r, [m_v, m_v, m_t, m_t, I_t], F, track, name="vehicle_and_track")
    r_ddot = Matrix([c.ddot for c in r])
    reaction = augmented.constraint_forces
    sides = (augmented.M_tilde * r_ddot + augmented.C_r.T * Matrix(augmented.multipliers), augmented.F_tilde)
    M = diag(m_v, m_v, m_t, m_t, I_t)
    return [
        Formula("Newton, vehicle", (m_v * r_ddot[:2, :], F[:2, :] + reaction[:2, :]), (sides[0][:2, :], sides[1][:2, :]),
                line=4026, also=(4165,)),
        Formula("Newton, track", (m_t * r_ddot[2:4, :], F[2:4, :] + reaction[2:4, :]), (sides[0][2:4, :], sides[1][2:4, :]),
                line=4030),
        Formula("moment, track", (Matrix([I_t * r_ddot[4]]), Matrix([F[4] + reaction[4]])), (sides[0][4:, :], sides[1][4:, :]),
                line=4032),
        Formula("matrix form", (M * r_ddot, F + reaction), sides, line=4038),
    ]


def _equations() -> list[Formula]:
    q1, q2, (m_v, m_t, I_t), F, _, _, eq = _map()
    m, g = sd.parameters("m g")
    F_Ox, F_Oy, F_O0x, F_O0y, M_O0 = F
    q, q_dot, q_ddot = Matrix([q1, q2]), Matrix([q1.dot, q2.dot]), Matrix([q1.ddot, q2.ddot])
    J, J_dot, M = eq.J, eq.Jdot, diag(m_v, m_v, m_t, m_t, I_t)
    r_ddot = J * q_ddot + eq.Jd_qd
    equation = (eq.M_tilde * q_ddot + eq.k_tilde, eq.F_tilde)
    # The loads as the equations have taken them: what J^T is applied to.
    absolute = sd.augmented(sd.coordinates("x y x_t y_t theta"), list(M.diagonal()), F, [], name="two_free_bodies")
    kinetic = m_v * (q1.dot**2 + q1**2 * q2.dot**2) / 2 + I_t * q2.dot**2 / 2
    power = (F.T * sd.rate(eq.explicit("r")))[0]
    energy = "With the power of the loads, the accelerations must change the kinetic energy."
    conserved = proofs.energy_balance(energy, [q1, q2], kinetic, power=power)
    k_conserved = proofs.energy_balance(energy, [q1, q2], kinetic, power=power,
                                        equations=lambda k: list(eq.M_tilde * q_ddot + Matrix(k) - eq.F_tilde))
    virtual = proofs.other("The power of all loads must be F_tilde . q_dot.", Matrix([power.diff(q1.dot), power.diff(q2.dot)]))
    track_alone = proofs.limit("Without loads on the track, those on the vehicle must be left.",
                               {F_O0x: 0, F_O0y: 0, M_O0: 0}, Matrix([F_Ox, F_Oy, 0, 0, 0]))

    def rows_of_J(sentence: str) -> proofs.Proof:
        return proofs.Proof("another formulation", sentence, lambda formula: formula.rows - eq.J.rows)

    return [
        Formula("M on the slide of the general equations", [[m, 0], [0, m]], M, line=4167, latex=r"\mathbf{M}",
                errata=[Erratum("The mass matrix of the vehicle alone stands where J has five rows, those of vehicle and track.",
                                rows_of_J("J^T M is defined only if M has as many rows as J, five."), slip=ALONE)]),
        Formula("F on the slide of the general equations", [0, -m * g], absolute.F_tilde, line=4167,
                latex=r"\mathbf{F}_O^e",
                errata=[Erratum("The weight of the vehicle alone stands where J has five rows, those of vehicle and track.",
                                rows_of_J("J^T F is defined only if F has as many rows as J, five."), slip=ALONE)]),
        Formula("projected Newton", (J.T * M * r_ddot, J.T * F), equation, line=4171),
        Formula("embedded", (J.T * M * J * q_ddot + J.T * M * J_dot * q_dot, J.T * F), equation, line=4183),
        # k_tilde and q_dot are columns: their product can only be meant entry by entry.
        Formula("embedded, in short", (eq.M_tilde * q_ddot + eq.k_tilde.multiply_elementwise(q_dot), eq.F_tilde), equation,
                line=4190, errata=[Erratum("k_tilde holds the rates already and is not multiplied by q_dot once more.",
                                           conserved)]),
        Formula("M_tilde", J.T * M * J, eq.M_tilde, line=4192, latex=r"\tilde{\mathbf{M}}"),
        Formula("k_tilde", J.T * M * J_dot * q, eq.k_tilde, line=4192, latex=r"\tilde{\mathbf{k}}", errata=[Erratum(
            "The last factor is the rate of q, not q.", k_conserved)]),
        Formula("F_tilde", J.T * Matrix([0, 0, F_O0x, F_O0y, M_O0]), eq.F_tilde, line=4192, latex=r"\tilde{\mathbf{F}}^e",
                errata=[Erratum("The loads of all bodies are projected, not those at O_0 on the track alone.", virtual)]),
        Formula("M", [[m_v, 0, 0, 0, 0], [0, m_v, 0, 0, 0], [0, 0, m_t, 0, 0], [0, 0, 0, m_t, 0], [0, 0, 0, 0, I_t]],
                absolute.M_tilde, line=4197, also=(4038,), latex=r"\mathbf{M}"),
        Formula("F", [F_O0x, F_O0y, F_O0x, F_O0y, M_O0], absolute.F_tilde, line=4197, latex=r"\mathbf{F}", errata=[Erratum(
            "Rows 1 and 2 are the force on the vehicle at O, not that on the track at O_0 for a second time.", track_alone)]),
        Formula("F, when first written", [F_Ox, F_Oy, F_O0x, F_O0y, M_O0], absolute.F_tilde, line=4041, latex=r"\mathbf{F}^e"),
    ]


CASES = (
    Case("vehicle-and-track-newton", "Vehicle and rotating track, body by body", Slide("3.2", TRACK, 4008), _newton),
    Case("vehicle-and-track-kinematics", "Vehicle and rotating track: velocity transformation", Slide("3.2", TRACK, 4049),
         _kinematics),
    Case("vehicle-and-track-embedding", "Vehicle and rotating track, embedding technique", Slide("3.2", TRACK, 4161), _equations),
)
