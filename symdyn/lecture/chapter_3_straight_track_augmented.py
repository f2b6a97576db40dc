"""Lecture, chapter 3.3: the vehicle on a straight track in Cartesian coordinates, with a Lagrange multiplier.

x_OO0, y_OO0 are the components of the displacement r_{O/O_0} along the track.
"""

from __future__ import annotations

from functools import cache

import sympy as sp
from sympy import Matrix, cos, sin, tan

import symdyn as sd
from symdyn.comparison import conventions, proofs
from symdyn.comparison.case import Case, Erratum, Formula, Slide
from symdyn.lecture.chapter_3_straight_track import place_on_track

TRACK = "Vehicle constrained to move along straight track"


@cache
def _equations() -> tuple:
    """Coordinates, m, g, theta, the hinge, the displacement along the track, and the augmented equations."""
    x, y = sd.coordinates("x_O y_O")
    m, g, theta, x0, y0, xr, yr = sd.parameters("m g theta x_O0 y_O0 x_OO0 y_OO0")
    # The constraint from the frame of the track: no distance from its axis; over cos(theta), the factor of y is one.
    n = sd.Frame("n")
    track = n.frame("track", rotation=sd.rotation.about("Z", -theta), origin=[x0, y0, 0])
    distance = n.point("O", [x, y, 0]).position(track, track)[1]
    constraint = sp.expand(distance / cos(theta)).replace(sin(theta) / cos(theta), tan(theta))
    eq = sd.augmented([x, y], [m, m], [0, -m * g], [constraint], name="vehicle_on_track")
    return x, y, m, g, theta, x0, y0, xr, yr, eq


def _constraint() -> list[Formula]:
    x, y, _, _, theta, x0, y0, xr, yr, eq = _equations()
    C, tangent = sp.expand(eq.C[0]), tan(theta)
    A = sp.symbols("A")
    from_hinge = {x: x0 + xr, y: y0 + yr}
    # y as the constraint gives it, C = 0.
    height = y - C
    A_derived = C - (y + x * tangent)
    constant = proofs.Proof("another formulation", "A is a constant, its rate vanishes.", sd.rate)
    return [
        Formula("displacement", yr + xr * tangent, C.xreplace(from_hinge), line=4297,
                also=(4338, 4378, 4426, 4466, 4480, 4504, 4550, 4592, 4646)),
        Formula("y by eq. (1)", y0 - xr * tangent, height, line=4313, also=(4348,), renamed={xr: x - x0}),
        Formula("y by x", y0 - (x - x0) * tangent, height, line=4352),
        Formula("y by x, written out", y0 - x * tangent + x0 * tangent, height, line=4354),
        Formula("constraint, written out", y + x * tangent - x0 * tangent - y0, C, line=4356),
        Formula("constraint", y + x * tangent + A, C, line=4358, also=(4380, 4428, 4468, 4482, 4506, 4552, 4594, 4648),
                renamed={A: A_derived}),
        Formula("A", -x0 * tangent - y0, A_derived, line=4360, also=(4526, 4566)),
        Formula("A on the slide of the gradient", -y - tangent * x, A_derived, line=4672, latex="A", errata=[Erratum(
            "A is made of the fixed point O_0; made of the moving point O, it would turn the constraint into 0 = 0.", constant)]),
        Formula("gradient", [[tangent, 1]], eq.C_r, line=4678, also=(4692,), latex=r"\nabla C"),
        Formula("rate of the constraint", x.dot * tangent + y.dot, sd.rate(C), line=4530, also=(4570,)),
        Formula("second rate of the constraint", x.ddot * tangent + y.ddot, sd.rate(sd.rate(C)), line=4534,
                also=(4632, 4712)),
        Formula("gradient times acceleration", (Matrix([[tangent, 1]]) * Matrix([x.ddot, y.ddot]))[0],
                (eq.C_r * Matrix([x.ddot, y.ddot]) - eq.F_d)[0], line=4714),
    ]


def _augmented() -> list[Formula]:
    x, y, m, g, theta, x0, y0, xr, yr, eq = _equations()
    tangent, multiplier = tan(theta), sp.Symbol("lambda")
    (q1,) = sd.coordinates("q1:2")
    embedded = sd.embedding([q1], list(place_on_track(q1, -theta, (x0, y0))), [m, m], [0, -m * g], name="vehicle_on_track")
    M, F = Matrix([[m, 0], [0, m]]), Matrix([0, -m * g])
    r_ddot, shift, gradient = Matrix([x.ddot, y.ddot]), Matrix([xr, yr]), Matrix([[tangent, 1]])
    # Along the track with the embedded motion, where the displacement is q1 J and r_ddot = J q1_ddot.
    J = embedded.J
    along = {xr: q1 * J[0], yr: q1 * J[1], x.ddot: J[0] * q1.ddot, y.ddot: J[1] * q1.ddot}
    work = (embedded.M_tilde * q1.ddot - embedded.F_tilde)[0] * q1
    rows = eq.matrix * Matrix([x.ddot, y.ddot, multiplier]) - eq.rhs
    without = rows.xreplace({multiplier: 0})
    # Row 1 with the multiplier of row 2.
    eliminated = rows[0].subs(multiplier, sp.solve(rows[1], multiplier)[0])
    sign = conventions.opposite_sign("the equation is multiplied by -1")
    times = (shift.T * (rows[:2, :]))[0]
    on_constraint = (J.T * eq.C_r.T)[0] * q1
    place = {x: x0 + q1 * J[0], y: y0 + q1 * J[1]}
    matrix = Matrix([[m, 0, tangent], [0, m, 1], [tangent, 1, 0]])
    unknowns = Matrix([x.ddot, y.ddot, multiplier])
    lam = eq.lam[0]
    return [
        Formula("M", [[m, 0], [0, m]], eq.M_tilde, line=4258, also=(4382, 4430, 4448, 4474), latex=r"\mathbf{M}"),
        Formula("F_e", [0, -m * g], eq.F_tilde, line=4258, also=(4382, 4430, 4448, 4474), latex=r"\mathbf{F}_O^e"),
        Formula("Newton", (M * r_ddot, F + embedded.F_c), (M * r_ddot + eq.C_r.T * lam, F), line=4382, also=(4430, 4448, 4474)),
        Formula("work with the reaction", (shift.T * M * r_ddot - shift.T * F - shift.T * embedded.F_c)[0], work, line=4386,
                also=(4434,), renamed=along),
        Formula("work along the track", (shift.T * M * r_ddot - shift.T * F)[0], work, line=4440,
                also=(4452, 4454, 4476, 4500, 4546), renamed=along),
        Formula("work, factored", (shift.T * (M * r_ddot - F))[0], work, line=4456, also=(4584, 4612, 4652, 4688), renamed=along),
        Formula("work by components", (Matrix([[xr, yr]]) * (Matrix([[m, 0], [0, m]]) * r_ddot - Matrix([0, -m * g])))[0], work,
                line=4458, renamed=along),
        Formula("force that is missing", [m * x.ddot, m * y.ddot + m * g], without[:2, :], line=4460),
        Formula("equation (1)", xr * (m * x.ddot) + yr * (m * y.ddot + m * g), work, line=4462,
                also=(4484, 4508, 4554, 4586, 4616, 4650, 4684), renamed=along),
        Formula("equation (2)", xr * tangent + yr, on_constraint, line=4490, also=(4510, 4556, 4588, 4618, 4654, 4658, 4686),
                renamed=along),
        Formula("y eliminated", xr * (tangent * (m * y.ddot + m * g) - m * x.ddot), xr * eliminated, line=4516, also=(4562,),
                conventions=[sign]),
        Formula("equation without y", tangent * (m * y.ddot + m * g) - m * x.ddot, eliminated, line=4520, conventions=[sign]),
        Formula("(1) + lambda (2)", xr * (tangent * multiplier + m * x.ddot) + yr * (m * y.ddot + m * g + multiplier), times,
                line=4620, also=(4696,)),
        Formula("row of y", m * y.ddot + m * g + multiplier, rows[1], line=4624, also=(4700,)),
        Formula("row of x", tangent * multiplier + m * x.ddot, rows[0], line=4628, also=(4700,)),
        Formula("displacement and gradient", (Matrix([[xr, yr]]) * Matrix([tangent, 1]))[0], on_constraint, line=4662,
                also=(4656, 4668, 4692), renamed=along),
        Formula("displacement and gradient, label", (Matrix([[x, y]]) * gradient.T)[0], on_constraint, line=4664,
                renamed={x: place[x], y: place[y]}, unreadable={(): "the line breaks off before its right side; on the slide's "
                                                                "next line it is complete, with the displacement from O_0"}),
        Formula("(1) + lambda (2), vectors", (shift.T * (M * r_ddot - F) + shift.T * gradient.T * multiplier)[0], times,
                line=4704),
        Formula("(1) + lambda (2), factored", (shift.T * (M * r_ddot - F + gradient.T * multiplier))[0], times, line=4706),
        Formula("equations with lambda", M * r_ddot - F + gradient.T * multiplier, rows[:2, :], line=4708),
        Formula("augmented equations", (matrix * unknowns, Matrix([0, -m * g, 0])), (eq.matrix * unknowns, eq.rhs), line=4718),
        Formula("matrix", matrix, eq.matrix, line=4718),
        Formula("right side", [0, -m * g, 0], eq.rhs, line=4718),
        Formula("blocks of the matrix", sp.Matrix(sp.BlockMatrix([[M, gradient.T], [gradient, Matrix([[0]])]])), eq.matrix,
                line=4722),
        Formula("reaction of section 3.1", [m * g * cos(theta) * sin(theta), m * g * cos(theta) * cos(theta)], -eq.C_r.T * lam,
                slide=Slide("3.1", "Vehicle constrained to move along the straight track", 3436), latex=r"\mathbf{F}_O^c"),
    ]


CASES = (
    Case("straight-track-constraint", "Constraint of a straight track in Cartesian coordinates", Slide("3.3", TRACK, 4281),
         _constraint),
    Case("straight-track-augmented", "A vehicle on a straight track with a Lagrange multiplier", Slide("3.3", TRACK, 4366),
         _augmented),
)
