"""Lecture, chapter 3.2: a vehicle on a straight track by the embedding technique.

x_OO0 is the horizontal component of the displacement r_{O/O_0} along the track.
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp
from sympy import Matrix, cos, sin, tan

import symdyn as sd
from symdyn.comparison.case import Case, Formula, Slide
from symdyn.spatial.vectors import inner

TRACK = "Vehicle constrained to move along the straight track"


def place_on_track(along: sp.Expr, angle: sp.Expr, hinge: Sequence[sp.Expr]) -> Matrix:
    """Components in n (2, 1) of a point on the x axis of a track that is turned by an angle about z; along: its x there."""
    n = sd.Frame("n")
    track = n.frame("track", rotation=sd.rotation.about("Z", angle), origin=[*hinge, 0])
    return track.point("O", [along, 0, 0]).position(of=n, components=n)[:2, :]


def _straight_track_embedding() -> list[Formula]:
    (q1,) = sd.coordinates("q1:2")
    x, y = sd.coordinates("x_O y_O")
    m, g, theta, x0, y0, xr = sd.parameters("m g theta x_O0 y_O0 x_OO0")
    eq = sd.embedding([q1], list(place_on_track(q1, -theta, (x0, y0))), [m, m], [0, -m * g], name="vehicle_on_track")
    bodies = sd.systems.vehicle_on_track().embedding()
    r, r0 = eq.explicit("r"), Matrix([x0, y0])
    # q1 is the distance down the track, x_{O/O_0} its horizontal part.
    shift = (r - r0).xreplace({q1: xr / cos(theta)})
    M, F, J = Matrix([[m, 0], [0, m]]), Matrix([0, -m * g]), Matrix([cos(theta), -sin(theta)])
    r_ddot = Matrix([x.ddot, y.ddot])
    on_track = {x.ddot: eq.J[0] * q1.ddot, y.ddot: eq.J[1] * q1.ddot}
    Jx, Jy, Fx, Fy = sp.symbols("J_x J_y F_x F_y")
    components = on_track | {Jx: eq.J[0], Jy: eq.J[1], Fx: 0, Fy: -m * g}
    equation = (eq.M_tilde * Matrix([q1.ddot]), eq.F_tilde)
    augmented = sd.augmented([x, y], [m, m], [0, -m * g], [y - y0 + (x - x0) * tan(theta)], name="vehicle_on_track")
    full = (M * r_ddot + augmented.C_r.T * augmented.lam, F)
    a, b = sp.symbols("a_1:4"), sp.symbols("b_1:4")
    A, B = Matrix(a), Matrix(b)
    product = inner(a, b)
    return [
        Formula("r", Matrix([x0, y0]) + Matrix([xr, -tan(theta) * xr]), r0 + shift, line=3530,
                also=(3486, 3522, 4301, 4305, 4309, 4315, 4318, 4342)),
        Formula("slope", -tan(theta), shift[1] / shift[0], line=3498, also=(3526, 4295, 4336)),
        Formula("y of the displacement", -tan(theta) * xr, shift[1], line=3498, also=(3526, 4295, 4336)),
        Formula("displacement 1", [xr, -tan(theta) * xr], shift, line=3520),
        Formula("displacement 2", xr * Matrix([1, -tan(theta)]), shift, line=3520),
        Formula("displacement 3", xr * cos(theta) / cos(theta) * Matrix([1, -tan(theta)]), shift, line=3520),
        Formula("displacement 4", xr / cos(theta) * Matrix([cos(theta), -sin(theta)]), shift, line=3520, also=(3532,)),
        Formula("kinematic constraint", r0 + q1 * J, r, line=3538, also=(3561, 3586, 3639, 3661, 3703, 3723, 3755, 4266),
                latex=r"\mathbf{r}_{O/E}"),
        Formula("J", [cos(theta), -sin(theta)], eq.J, line=3538, also=(3562, 3588, 3640, 3662, 3703, 3761), latex=r"\mathbf{J}"),
        Formula("J of bodies and joints", [cos(theta), -sin(theta)], bodies.J[:2, :], line=3761, latex=r"\mathbf{J}"),
        Formula("Newton's law with the reaction", (M * r_ddot, F + eq.F_c), full, line=3548,
                also=(3546, 3572, 3618, 3649, 3677, 3713, 3745, 4256)),
        Formula("reaction is perpendicular to J", 0, (eq.J.T * eq.F_c)[0], line=3578, also=(3557, 3623)),
        Formula("scalar product with J", ((J.T * M * r_ddot)[0] - (J.T * F)[0] - (J.T * eq.F_c)[0]),
                (equation[0] - equation[1])[0], line=3580, also=(3625,), renamed=on_track),
        Formula("A . B", a[0] * b[0] + a[1] * b[1] + a[2] * b[2], product, line=3600, also=(4398,)),
        Formula("A^T B", (A.T * B)[0], product, line=3606, also=(3608, 3610, 3631, 4404, 4406, 4408, 4438, 5137, 5248)),
        Formula("projected Newton", (J.T * M * r_ddot, J.T * F), equation, line=3635, also=(3651, 3679, 3719, 4262),
                renamed=on_track),
        Formula("projected by components",
                (Matrix([[Jx, Jy]]) * Matrix([[m, 0], [0, m]]) * r_ddot, Matrix([[Jx, Jy]]) * Matrix([Fx, Fy])), equation,
                line=3653, renamed=components),
        Formula("projected, written out", sp.Eq(Jx * m * x.ddot + Jy * m * y.ddot, Jx * Fx + Jy * Fy),
                sp.Eq(equation[0][0], equation[1][0]), line=3655, also=(3683,), renamed=components),
        Formula("x", x0 + q1 * cos(theta), r[0], line=3693),
        Formula("y", y0 - q1 * sin(theta), r[1], line=3695),
        Formula("r_dot", J * q1.dot, sd.rate(r), line=3727, also=(3757, 4270), latex=r"\dot{\mathbf{r}}"),
        Formula("r_ddot", J * q1.ddot, sd.rate(sd.rate(r)), line=3731, also=(3759, 4274), latex=r"\ddot{\mathbf{r}}"),
        Formula("equation of motion", (J.T * M * J * q1.ddot, J.T * F), equation, line=3735, also=(3763,)),
        Formula("equation of motion of bodies and joints", (J.T * M * J * q1.ddot, J.T * F),
                (bodies.M_tilde * q1.ddot + bodies.k_tilde, bodies.F_tilde), line=3763),
    ]


CASES = (
    Case("straight-track-embedding", "A vehicle on a straight track, embedding technique", Slide("3.2", TRACK, 3456),
         _straight_track_embedding),
)
