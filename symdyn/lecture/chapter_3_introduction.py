"""Lecture, chapter 3.1 and the end of 3.2: two pinned bodies, and a vehicle on a straight track by Newton's law.

The slides' index E of x_{O/E}, the origin of the n-frame, is left out: x_O.
"""

from __future__ import annotations

import sympy as sp
from sympy import Matrix, cos, diag, sin, tan

import symdyn as sd
from symdyn.comparison.case import Case, Formula, Slide
from symdyn.formulation.trees.embedding import EmbeddedEquations
from symdyn.lecture.chapter_3_straight_track import place_on_track

TRACK = "Vehicle constrained to move along the straight track"
SYSTEM = "Multibody System Dynamics"


def _two_pinned_bodies() -> list[Formula]:
    x1, y1, th1, x2, y2, th2 = sd.coordinates("x_O1 y_O1 theta_O1 x_O2 y_O2 theta_O2")
    m1, m2, I1, I2, l1, l2 = sd.parameters("m_1 m_2 I_1 I_2 l_O1 l_O2", positive=True)
    F1x, F1y, F2x, F2y = sd.parameters("F_O1x F_O1y F_O2x F_O2y")
    n = sd.Frame("n")
    pins = []
    for k, (x, y, th, arm) in enumerate(((x1, y1, th1, l1), (x2, y2, th2, l2))):
        body = n.frame(f"b_{k + 1}", rotation=sd.rotation.about("Z", th), origin=[x, y, 0])
        pins.append(body.point("pin", [arm, 0, 0]).position())
    closure = pins[0] - pins[1]
    q = [x1, y1, th1, x2, y2, th2]
    eq = sd.augmented(q, [m1, m1, I1, m2, m2, I2], [F1x, F1y, 0, F2x, F2y, 0], list(closure[:2, :]), name="two_pinned_bodies")
    # The rows of the positions; those of the angles are left out, as on the slides.
    places = [0, 1, 3, 4]
    F_c = Matrix([eq.constraint_forces[k] for k in places])
    left = eq.M_tilde * Matrix([c.ddot for c in q]) + eq.C_r.T * Matrix(eq.multipliers)
    newton = (Matrix([left[k] for k in places]), Matrix([eq.F_tilde[k] for k in places]))
    r1, r2 = Matrix([x1.ddot, y1.ddot]), Matrix([x2.ddot, y2.ddot])
    F1, F2, Fc1, Fc2 = Matrix([F1x, F1y]), Matrix([F2x, F2y]), F_c[:2, :], F_c[2:, :]
    M1, M2 = Matrix([[m1, 0], [0, m1]]), Matrix([[m2, 0], [0, m2]])
    # The same two bodies in four independent coordinates: those of the first body and the angle of the second.
    free = [x1, y1, th1, th2]
    J_rows = [x1, y1, th1, x1 + l1 * cos(th1) - l2 * cos(th2), y1 + l1 * sin(th1) - l2 * sin(th2), th2]
    embedded = sd.embedding(free, J_rows, [m1, m1, I1, m2, m2, I2], [F1x, F1y, 0, F2x, F2y, 0], name="two_pinned_bodies")
    q_dot, q_ddot = Matrix([c.dot for c in free]), Matrix([c.ddot for c in free])
    M, J = diag(m1, m1, I1, m2, m2, I2), embedded.J
    J_dot, M_tilde, k_tilde, F_tilde = (Matrix(embedded.explicit(name, simplify=False))
                                        for name in ("Jdot", "M_tilde", "k_tilde", "F_tilde"))
    F = Matrix([F1x, F1y, 0, F2x, F2y, 0])
    upper, lower = (newton[0][:2, :], newton[1][:2, :]), (newton[0][2:, :], newton[1][2:, :])
    return [
        Formula("Newton 1", (m1 * r1, F1 + Fc1), upper, line=3228),
        Formula("Newton 2", (m2 * r2, F2 + Fc2), lower, line=3230),
        Formula("F_constraint 1", -Fc2, Fc1, line=3232, latex=r"\mathbf{F}_{constraint}^1"),
        Formula("c_1", None, closure[0], line=3260, unreadable="the line above c_2 is lost, a single bracket is left of it"),
        Formula("c_2", y1 + l1 * sin(th1) - y2 - l2 * sin(th2), closure[1], line=3260),
        Formula("matrix Newton 1", (M1 * r1, F1 + Fc1), upper, line=4204, also=(4224,)),
        Formula("matrix Newton 2", (M2 * r2, F2 + Fc2), lower, line=4206, also=(4226,)),
        Formula("blocks", (diag(M1, M2) * Matrix([r1, r2]), Matrix([F1, F2]) + Matrix([Fc1, Fc2])), newton, line=4210,
                also=(4230,)),
        Formula("r_dot", embedded.J * q_dot, sd.rate(Matrix(J_rows)), line=4234, latex=r"\dot{\mathbf{r}}"),
        Formula("embedded", (J.T * M * J * q_ddot + J.T * M * J_dot * q_dot, J.T * F), (M_tilde * q_ddot + k_tilde, F_tilde),
                line=4238),
    ]


def _straight_track_reaction() -> list[Formula]:
    x, y = sd.coordinates("x_O y_O")
    (q1,) = sd.coordinates("q1:2")
    m, g, theta, x0, y0, Fx, Fy = sd.parameters("m g theta x_O0 y_O0 sum_F_x sum_F_y")
    r_ddot = Matrix([x.ddot, y.ddot])
    M, weight = Matrix([[m, 0], [0, m]]), Matrix([0, -m * g])
    free = sd.embedding([x, y], [x, y], [m, m], [Fx, Fy], name="free_body")
    falling = sd.embedding([x, y], [x, y], [m, m], [0, -m * g], name="falling_body")
    track = sd.embedding([q1], list(place_on_track(q1, -theta, (x0, y0))), [m, m], [0, -m * g], name="vehicle_on_track")
    F_c = track.F_c
    # The force on the vehicle as its motion has it.
    inertia = m * track.J * Matrix(track.explicit("accelerations"))

    def sides(eq: EmbeddedEquations) -> tuple[Matrix, Matrix]:
        return Matrix([e.lhs for e in eq.equations]), Matrix([e.rhs for e in eq.equations])

    printed_force = Matrix([m * g * cos(theta) * sin(theta), m * g * cos(theta) * cos(theta)])
    normal = Matrix([sin(theta), cos(theta)])
    augmented = sd.augmented([x, y], [m, m], [0, -m * g], [y - y0 + (x - x0) * tan(theta)], name="vehicle_on_track")
    moving = (M * r_ddot + augmented.C_r.T * augmented.lam, weight)
    return [
        Formula("Newton", (m * r_ddot, Matrix([Fx, Fy])), sides(free), line=3286, also=(3209, 3306, 3318)),
        Formula("free fall", (m * r_ddot, weight), sides(falling), line=3290),
        Formula("sum of F", weight + F_c, inertia, line=3310, also=(3340,), latex=r"\sum\mathbf{F}"),
        Formula("row 1", sp.Eq(m * x.ddot, Fx), free.equations[0], line=3322),
        Formula("row 2", sp.Eq(m * y.ddot, Fy), free.equations[1], line=3324),
        Formula("matrix form", (Matrix([[m, 0], [0, m]]) * r_ddot, Matrix([Fx, Fy])), sides(free), line=3330),
        Formula("M", [[m, 0], [0, m]], free.M_tilde, line=3332, also=(3338, 3429), latex=r"\mathbf{M}"),
        Formula("F_e", [0, -m * g], falling.F_tilde, line=3338, also=(3429,), latex=r"\mathbf{F}_O^e"),
        Formula("Newton with reaction", (M * r_ddot, weight + F_c), moving, line=3344, also=(3413, 3421, 3429)),
        Formula("reaction opposes the normal part", -normal * (normal.T * weight)[0], F_c, line=3387,
                latex=r"\mathbf{F}_O^c=-\mathbf{F}_{O,n}^e"),
        Formula("reaction is perpendicular", 0, (Matrix([cos(theta), -sin(theta)]).T * F_c)[0], line=3389),
        Formula("equations with the reaction", (M * r_ddot, Matrix([0, -m * g]) + printed_force), moving, line=3436),
        Formula("equations with the reaction, repeated",
                (Matrix([0, m * y.ddot]), Matrix([0, -m * g + m * g * cos(theta) * cos(theta)])), moving, line=3450,
                unreadable={(0,): "the first row and column of all matrices are lost"}),
    ]


CASES = (
    Case("two-pinned-bodies", "Two bodies and the force of the pin between them", Slide("3.1", SYSTEM, 3222), _two_pinned_bodies),
    Case("straight-track-reaction", "Reaction of a straight track by Newton's law", Slide("3.1", TRACK, 3270),
         _straight_track_reaction),
)
