"""Lecture, chapter 3.4: the pendulum in its relative coordinate, embedding technique."""

from __future__ import annotations

from functools import cache

import sympy as sp
from sympy import Matrix, cos, sin

import symdyn as sd
from symdyn.comparison import proofs
from symdyn.comparison.case import Case, Erratum, Formula, Slide

PENDULUM = "Example of the pendulum"


def place_of_pendulum(q1: sp.Expr, length: sp.Expr) -> Matrix:
    """Components in n (2, 1) of the end of a wire that hangs down and is turned by q1 about z."""
    n = sd.Frame("n")
    wire = n.frame("wire", rotation=sd.rotation.about("Z", q1))
    return wire.point("P", [0, -length, 0]).position(of=n, components=n)[:2, :]


def circle(x: sp.Expr, y: sp.Expr, length: sp.Expr) -> sp.Expr:
    """C of the pendulum: squared distance of its mass from the hinge, less that of the wire's end."""
    n = sd.Frame("n")
    r, end = n.point("P", [x, y, 0]).position(), place_of_pendulum(sp.S.Zero, length)
    return r.dot(r) - end.dot(end)


@cache
def _map() -> tuple:
    """q1, m, g, l_1 and the equations of the position map."""
    (q1,) = sd.coordinates("q1:2")
    m, g, length = sd.parameters("m g l_1")
    eq = sd.embedding([q1], list(place_of_pendulum(q1, length)), [m, m], [0, -m * g], name="pendulum")
    return q1, m, g, length, eq


def _reaction() -> list[Formula]:
    q1, m, g, length, eq = _map()
    x, y = sd.coordinates("x_P y_P")
    r_ddot, weight, M = Matrix([x.ddot, y.ddot]), Matrix([0, -m * g]), Matrix([[m, 0], [0, m]])
    tension = Matrix([-m * g * cos(q1) * sin(q1), m * g * cos(q1) * cos(q1)])
    F_c = eq.F_c
    place = eq.explicit("r")
    velocity = sd.rate(place)
    augmented = sd.augmented([x, y], [m, m], [0, -m * g], [circle(x, y, length)], name="pendulum")
    on_circle = dict(zip([x, y, x.dot, y.dot], [*place, *velocity]))
    newton = (M * r_ddot, weight + F_c)
    with_multiplier = (M * r_ddot + (augmented.C_r.T * augmented.lam).xreplace(on_circle), weight)

    def stretch(reaction: Matrix) -> sp.Expr:
        """Second rate of half the squared length, with the acceleration that this reaction gives."""
        return (velocity.T * velocity + place.T * (weight + reaction) / m)[0]

    kept = "The length of the rod must stay: r . r_ddot + r_dot . r_dot = 0 with the acceleration (F_e + F_c) / m."
    of_force = proofs.Proof("another formulation", kept, stretch)
    of_equation = proofs.Proof("another formulation", kept, lambda rows: stretch(M * r_ddot - rows - weight))
    why = ("The reaction of the wire is the part of the weight along it only while the pendulum is at rest; in motion it holds "
           "the centripetal force m l_1 q1_dot^2 as well.")
    return [
        Formula("M", [[m, 0], [0, m]], augmented.M_tilde, line=5025, also=(5102, 5125, 5209), latex=r"\mathbf{M}"),
        Formula("F_e", [0, -m * g], augmented.F_tilde, line=5025, also=(5102, 5125, 5209), latex=r"\mathbf{F}^e"),
        Formula("Newton", (M * r_ddot, weight + F_c), with_multiplier, line=5031, also=(5027, 5086, 5095, 5102, 5112, 5125)),
        Formula("equations with the reaction", (Matrix([[m, 0], [0, m]]) * r_ddot, Matrix([0, -m * g]) + tension), newton,
                line=5115, errata=[Erratum(why, of_equation)]),
        Formula("F_c", tension, F_c, line=5115, latex=r"\mathbf{F}^c", errata=[Erratum(why, of_force)]),
        # At rest the slide is right.
        Formula("F_c at rest", tension, F_c, line=5115, latex=r"\mathbf{F}^c", where={q1.dot: 0}),
    ]


def _embedding() -> list[Formula]:
    q1, m, g, length, eq = _map()
    c, s, rate = cos(q1), sin(q1), q1.dot
    (bodies_l,) = sd.parameters("l,")
    bodies = sd.systems.pendulum().embedding()
    place = eq.explicit("r")
    velocity = sd.rate(place)
    M, F = Matrix([[m, 0], [0, m]]), Matrix([0, -m * g])
    J, J_dot = Matrix([length * c, length * s]), Matrix([-length * s * rate, length * c * rate])
    r_ddot = eq.J * q1.ddot + eq.Jd_qd
    left, velocity_term, right = eq.M_tilde[0] * q1.ddot, eq.k_tilde[0], eq.F_tilde[0]
    equation = (Matrix([left + velocity_term]), Matrix([right]))
    from_bodies = ((bodies.M_tilde * q1.ddot + bodies.k_tilde).subs(bodies_l, length), bodies.F_tilde.subs(bodies_l, length))
    row, diagonal = Matrix([[length * c, length * s]]), Matrix([[m, 0], [0, m]])
    return [
        Formula("reaction is perpendicular to J", 0, (J.T * eq.F_c)[0], line=5131),
        Formula("projected Newton", (J.T * M * r_ddot, J.T * F), equation, line=5139, also=(5157, 5185)),
        Formula("scalar product with J", (J.T * M * r_ddot, J.T * F + J.T * eq.F_c), equation, line=5133),
        Formula("x", length * s, place[0], line=5149, also=(5161, 5541)),
        Formula("y", -length * c, place[1], line=5149, also=(5161, 5541)),
        Formula("x_dot", length * c * rate, velocity[0], line=5165, also=(5543,)),
        Formula("y_dot", length * s * rate, velocity[1], line=5167, also=(5543,)),
        Formula("r_dot", J * rate, velocity, line=5171, latex=r"\dot{\mathbf{r}}"),
        Formula("J", [length * c, length * s], eq.J, line=5171, also=(5189, 5209), latex=r"\mathbf{J}"),
        Formula("r_ddot", J * q1.ddot + J_dot * rate, sd.rate(velocity), line=5177, also=(5187,), latex=r"\ddot{\mathbf{r}}"),
        Formula("J_dot", J_dot, eq.Jdot, line=5189, also=(5209,), latex=r"\dot{\mathbf{J}}"),
        Formula("J and r_ddot put in", (J.T * M * (J * q1.ddot + J_dot * rate), J.T * F), equation, line=5195),
        Formula("embedded", (J.T * M * J * q1.ddot + J.T * M * J_dot * rate, J.T * F), equation, line=5199, also=(5207,)),
        Formula("M_tilde q_ddot 1", (row * diagonal * J)[0] * q1.ddot, left, line=5211, latex=r"\tilde{\mathbf{M}}\ddot{q}_1"),
        Formula("M_tilde q_ddot", m * length**2 * q1.ddot, left, line=5211, latex=r"\tilde{\mathbf{M}}\ddot{q}_1"),
        Formula("k_tilde 1", (row * diagonal * J_dot)[0] * rate, velocity_term, line=5213, latex=r"\tilde{\mathbf{k}}"),
        Formula("k_tilde", 0, velocity_term, line=5213, latex=r"\tilde{\mathbf{k}}"),
        Formula("F_tilde 1", (row * Matrix([0, -m * g]))[0], right, line=5215, latex=r"\tilde{\mathbf{F}}"),
        Formula("F_tilde", -length * m * g * s, right, line=5215, latex=r"\tilde{\mathbf{F}}"),
        Formula("equation of motion", (Matrix([m * length**2 * q1.ddot]), Matrix([-length * m * g * s])), equation, line=5217),
        Formula("equation of motion of body and joint", (Matrix([m * length**2 * q1.ddot]), Matrix([-length * m * g * s])),
                from_bodies, line=5217),
    ]


CASES = (
    Case("pendulum-reaction", "Reaction of the wire of a pendulum by Newton's law", Slide("3.4", PENDULUM, 5021), _reaction),
    Case("pendulum-embedding", "Pendulum, embedding technique", Slide("3.4", PENDULUM, 5119), _embedding),
)
