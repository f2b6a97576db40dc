"""Lecture, chapter 3.2: the vehicle on a track that turns about a hinge, embedding technique; the track has no mass."""

from __future__ import annotations

from functools import cache

from sympy import Matrix, cos, simplify, sin

import symdyn as sd
from symdyn.comparison.case import Case, Formula, Slide
from symdyn.formulation.trees.embedding import EmbeddedEquations
from symdyn.lecture.chapter_3_straight_track import place_on_track

TRACK = "Vehicle constrained to move along the straight track"


@cache
def _map() -> tuple:
    """The coordinates, m and g, the position map from the hinge, and its equations."""
    q1, q2 = sd.coordinates("q1:3")
    m, g, x0, y0 = sd.parameters("m g x_O0 y_O0")
    place = place_on_track(q1, -q2, (x0, y0))
    eq = sd.embedding([q1, q2], list(place), [m, m], [0, -m * g], name="vehicle_on_massless_track")
    return q1, q2, m, g, x0, y0, eq


@cache
def _bodies() -> EmbeddedEquations:
    """The same of bodies and joints."""
    return sd.systems.vehicle_on_rotating_track(track_inertia=False).embedding()


def _kinematics() -> list[Formula]:
    q1, q2, _, _, x0, y0, eq = _map()
    c, s, q1d, q2d = cos(q2), sin(q2), q1.dot, q2.dot
    r = eq.explicit("r")
    velocity = sd.rate(r)
    q_dot, q_ddot = Matrix([q1d, q2d]), Matrix([q1.ddot, q2.ddot])
    J = Matrix([[c, -q1 * s], [-s, -q1 * c]])
    J_dot = Matrix([[-s * q2d, -q1d * s - q1 * c * q2d], [-c * q2d, -q1d * c + q1 * s * q2d]])
    bodies = _bodies()
    return [
        Formula("r", Matrix([x0, y0]) + Matrix([c, -s]) * q1, r, line=3795, also=(3803,), latex=r"\mathbf{r}_{O/E}"),
        Formula("x", x0 + q1 * c, r[0], line=3807),
        Formula("y", y0 - q1 * s, r[1], line=3809),
        Formula("x_dot", q1d * c - q1 * s * q2d, velocity[0], line=3813),
        Formula("y_dot", -q1d * s - q1 * c * q2d, velocity[1], line=3815),
        Formula("r_dot", J * q_dot, velocity, line=3819, also=(3823, 3831, 3859), latex=r"\dot{\mathbf{r}}"),
        Formula("J", J, eq.J, line=3835, also=(3819, 3831, 3895, 3911, 3935, 3963, 3996), latex=r"\mathbf{J}"),
        Formula("J of bodies and joints", J, bodies.J[:2, :], line=3835, latex=r"\mathbf{J}"),
        Formula("J_dot", J_dot, eq.Jdot, line=3839, also=(3897, 3913, 3939, 3965, 3998), latex=r"\dot{\mathbf{J}}"),
        Formula("r_ddot", J * q_ddot + J_dot * q_dot, sd.rate(velocity), line=3863, latex=r"\ddot{\mathbf{r}}"),
    ]


def _equations() -> list[Formula]:
    q1, q2, m, g, _, _, eq = _map()
    c, s, q1d, q2d = cos(q2), sin(q2), q1.dot, q2.dot
    q_dot, q_ddot = Matrix([q1d, q2d]), Matrix([q1.ddot, q2.ddot])
    J = Matrix([[c, -q1 * s], [-s, -q1 * c]])
    J_dot = Matrix([[-s * q2d, -q1d * s - q1 * c * q2d], [-c * q2d, -q1d * c + q1 * s * q2d]])
    M, F = Matrix([[m, 0], [0, m]]), Matrix([0, -m * g])
    J_T, mJ_T = Matrix([[c, -s], [-q1 * s, -q1 * c]]), Matrix([[m * c, -m * s], [-m * q1 * s, -m * q1 * c]])
    equation = (eq.M_tilde * q_ddot + eq.k_tilde, eq.F_tilde)
    written = (Matrix([[m, 0], [0, m * q1**2]]) * q_ddot + Matrix([-m * q1 * q2d**2, 2 * m * q1 * q1d * q2d]),
               Matrix([m * g * s, m * g * q1 * c]))
    bodies = _bodies()
    from_bodies = (bodies.M_tilde * q_ddot + bodies.k_tilde, bodies.F_tilde)
    r_ddot = eq.J * q_ddot + eq.Jd_qd
    x, y = sd.coordinates("x_O y_O")
    free = sd.embedding([x, y], [x, y], [m, m], F, name="free_body")
    return [
        Formula("M", [[m, 0], [0, m]], free.M_tilde, line=3851, also=(3899, 3915, 3941, 3967, 4000), latex=r"\mathbf{M}"),
        Formula("F_e", [0, -m * g], free.F_tilde, line=3851, also=(3901, 3915, 3941, 3967, 4002), latex=r"\mathbf{F}^e"),
        # A track without mass that turns freely cannot push: F_c vanishes, and the two coordinates are free.
        Formula("Newton", (M * r_ddot, F + eq.F_c), (M * r_ddot, F), line=3849,
                where=dict(zip(q_ddot, eq.explicit("accelerations")))),
        Formula("projected Newton", (J.T * M * r_ddot, J.T * F), equation, line=3855),
        Formula("embedded", (J.T * M * J * q_ddot + J.T * M * J_dot * q_dot, J.T * F), equation, line=3867,
                also=(3875, 3909, 3937, 3961, 3979)),
        Formula("M_tilde 1", J.T * Matrix([[m, 0], [0, m]]) * J, eq.M_tilde, line=3885, also=(3883,),
                latex=r"\tilde{\mathbf{M}}"),
        Formula("M_tilde 2", J_T * Matrix([[m, 0], [0, m]]) * J, eq.M_tilde, line=3887, latex=r"\tilde{\mathbf{M}}"),
        Formula("M_tilde 3", mJ_T * J, eq.M_tilde, line=3889, latex=r"\tilde{\mathbf{M}}"),
        Formula("M_tilde 4",
                [[m * c**2 + m * s**2, -m * q1 * c * s + m * q1 * s * c],
                 [-m * q1 * s * c + m * q1 * c * s, m * q1**2 * c**2 + m * q1**2 * s**2]], eq.M_tilde, line=3891,
                latex=r"\tilde{\mathbf{M}}"),
        Formula("M_tilde", [[m, 0], [0, m * q1**2]], eq.M_tilde, line=3891, also=(3919, 3945, 3969, 3983),
                latex=r"\tilde{\mathbf{M}}"),
        *_velocity_terms(),
        Formula("k_tilde", [-m * q1 * q2d**2, 2 * m * q1 * q1d * q2d], eq.k_tilde, line=3953, also=(3969, 3983),
                latex=r"\tilde{\mathbf{k}}"),
        Formula("F_tilde 1", J.T * Matrix([0, -m * g]), eq.F_tilde, line=3971, latex=r"\tilde{\mathbf{F}}^e"),
        Formula("F_tilde 2", J_T * Matrix([0, -m * g]), eq.F_tilde, line=3971, latex=r"\tilde{\mathbf{F}}^e"),
        Formula("F_tilde 3", [0 + m * g * s, 0 + m * g * q1 * c], eq.F_tilde, line=3971, latex=r"\tilde{\mathbf{F}}^e"),
        Formula("F_tilde", [m * g * s, m * g * q1 * c], eq.F_tilde, line=3971, also=(3983,), latex=r"\tilde{\mathbf{F}}^e"),
        Formula("equations of motion", written, equation, line=3986),
        Formula("equation of motion 1", (Matrix([m * q1.ddot - m * q1 * q2d**2]), Matrix([m * g * s])),
                (equation[0][:1, :], equation[1][:1, :]), line=3990),
        Formula("equation of motion 2", (Matrix([m * q1**2 * q2.ddot + 2 * m * q1 * q1d * q2d]), Matrix([m * g * q1 * c])),
                (equation[0][1:, :], equation[1][1:, :]), line=3992),
        Formula("equations of motion of bodies and joints", written, from_bodies, line=3986),
    ]


def _velocity_terms() -> list[Formula]:
    """The products that lead to k_tilde, without and with q_dot."""
    q1, q2, m, _, _, _, eq = _map()
    c, s, q1d, q2d = cos(q2), sin(q2), q1.dot, q2.dot
    q_dot = Matrix([q1d, q2d])
    J = Matrix([[c, -q1 * s], [-s, -q1 * c]])
    J_dot = Matrix([[-s * q2d, -q1d * s - q1 * c * q2d], [-c * q2d, -q1d * c + q1 * s * q2d]])
    J_T, mJ_T = Matrix([[c, -s], [-q1 * s, -q1 * c]]), Matrix([[m * c, -m * s], [-m * q1 * s, -m * q1 * c]])
    M = Matrix([[m, 0], [0, m]])
    k = eq.k_tilde
    # The matrix in front of q_dot.
    before = (eq.J.T * M * eq.Jdot).applyfunc(simplify)
    latex = r"\mathbf{J}^T\mathbf{M}\dot{\mathbf{J}}"
    cut = "the entry is cut off after its first product"
    second = "of the sum of two products the transcription has the first one alone; two lines on, the sum is complete"
    squares = "the products with cos^2 are lost; on the next line they are there"
    return [
        Formula("k_tilde 1", J.T * M * J_dot * q_dot, k, line=3921, also=(3917, 3943), latex=r"\tilde{\mathbf{k}}"),
        Formula("k_tilde 2", J_T * M * J_dot * q_dot, k, line=3923, latex=r"\tilde{\mathbf{k}}"),
        Formula("k_tilde 3", mJ_T * J_dot * q_dot, k, line=3925, latex=r"\tilde{\mathbf{k}}"),
        Formula("products of k_tilde 1", None, before, line=3927, latex=latex, unreadable=cut),
        Formula("products of k_tilde 2",
                [[-m * c * s * q1d * q2d, -m * c * s * q1d * q2d], [-m * q1 * s * (-s * q2d), -m * q1 * s * (-s * q2d)]],
                before, line=3947, latex=latex, unreadable={(i, j): second for i in range(2) for j in range(2)}),
        Formula("products of k_tilde 3",
                [[0, -m * c * s * q1d - m * c**2 * q1 * q2d + m * s * c * q1d - m * s**2 * q1 * q2d],
                 [m * q1 * s**2 * q2d, m * q1 * s**2 * q2d]],
                before, line=3949, latex=latex, unreadable={(1, 0): squares, (1, 1): squares}),
        Formula("products of k_tilde 4",
                [[0, -m * c * s * q1d + m * s * c * q1d - m * (s**2 + c**2) * q1 * q2d],
                 [m * q1 * (s**2 + c**2) * q2d,
                  m * (s**2 + c**2) * q1 * q1d + m * s * c * q1**2 * q2d - m * c * s * q1**2 * q2d]],
                before, line=3951, latex=latex),
        Formula("products of k_tilde 5", [[0, -m * q1 * q2d], [m * q1 * q2d, m * q1 * q1d]], before, line=3953, latex=latex),
    ]


CASES = (
    Case("rotating-track-kinematics", "A vehicle on a rotating track: velocity transformation", Slide("3.2", TRACK, 3771),
         _kinematics),
    Case("rotating-track-embedding", "A vehicle on a rotating track, embedding technique", Slide("3.2", TRACK, 3843), _equations),
)
