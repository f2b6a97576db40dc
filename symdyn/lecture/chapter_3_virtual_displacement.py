"""Lecture, chapter 3, reference slides: actual and virtual work of a particle on a slope, at rest and in motion."""

from __future__ import annotations

import sympy as sp
from sympy import Matrix, cos, sin

import symdyn as sd
from symdyn.comparison.case import Case, Formula, Slide

TITLE = "Virtual displacement"


def _particle(angle: sp.Expr) -> tuple:
    """d'Alembert's force F_e + F_c - m r_ddot, F_e - m r_ddot, F_c, J and r_t of a particle on a slope of this inclination."""
    (q1,) = sd.coordinates("q1:2")
    m, g = sd.parameters("m g")
    weight = Matrix([0, -m * g])
    eq = sd.embedding([q1], [q1 * cos(angle), -q1 * sin(angle)], [m, m], weight, name="particle_on_a_slope")
    # Simplifying these would take the most time of all.
    r, acceleration, F_c = (eq.explicit(name, simplify=False) for name in ("r", "accelerations", "F_c"))
    r, F_c = Matrix(r), Matrix(F_c)
    r_ddot = sd.rate(sd.rate(r)).xreplace({q1.ddot: Matrix(acceleration)[0]})
    return weight + F_c - m * r_ddot, weight - m * r_ddot, F_c, eq.J, sd.partial_rate(r)


def _fixed() -> list[Formula]:
    whole, without, F_c, J, _ = _particle(sp.Symbol("theta"))
    dq = sp.Symbol("dq")
    dr = J * dq
    return [
        Formula("d'Alembert", [0, 0], whole, line=5610, also=(5606, 5634)),
        Formula("work of the reaction", 0, (dr.T * F_c)[0], line=5640),
        Formula("actual work", 0, (dr.T * whole)[0], line=5638, latex="dW"),
        Formula("actual work without the reaction", 0, (dr.T * without)[0], line=5640, latex="dW"),
    ]


def _moving() -> list[Formula]:
    # Any inclination that depends on time, up to its second derivative.
    theta, rate, half = sd.parameters("theta_0 theta_1 theta_2")
    whole, without, F_c, J, r_t = _particle(theta + rate * sd.t + half * sd.t**2)
    dq, dt, delta_q = sp.symbols("dq dt delta_q")
    actual, virtual = J * dq + r_t * dt, J * delta_q
    # Whether the reaction does work in the actual displacement is asked on the slide, and not answered: it does, F_c . r_t dt.
    return [
        Formula("actual work", 0, (actual.T * whole)[0], line=5674, latex="dW"),
        Formula("virtual work", 0, (virtual.T * whole)[0], line=5678, latex=r"\delta W"),
        Formula("virtual work of the reaction", 0, (virtual.T * F_c)[0], line=5680, also=(5722,)),
        Formula("virtual work without the reaction", 0, (virtual.T * without)[0], line=5680, latex=r"\delta W"),
    ]


def _surface() -> list[Formula]:
    """C is of first order with any coefficients: so is every surface up to its first derivatives."""
    x, y, z = sd.coordinates("x y z")
    t = sd.t
    c = sp.symbols("c_1:8")
    dt = sp.Symbol("dt")
    fixed = c[0] * x + c[1] * y + c[2] * z + c[3] * x * y * z
    moving = fixed + t * (c[4] * x + c[5] * y + c[6] * z)
    dx, dy, dz = x.dot * dt, y.dot * dt, z.dot * dt

    def along(C: sp.Expr, *steps: sp.Expr) -> sp.Expr:
        return sum(C.diff(s) * step for s, step in zip((x, y, z), steps))

    return [
        Formula("differential, fixed surface", along(fixed, dx, dy, dz), sd.rate(fixed) * dt, line=5694, latex="dC"),
        Formula("rate, fixed surface", along(fixed, x.dot, y.dot, z.dot), sd.rate(fixed), line=5700),
        Formula("differential, moving surface", along(moving, dx, dy, dz) + sd.partial_rate(moving) * dt, sd.rate(moving) * dt,
                line=5710, latex="dC"),
        Formula("rate, moving surface", along(moving, x.dot, y.dot, z.dot) + sd.partial_rate(moving), sd.rate(moving), line=5716),
    ]


CASES = (
    Case("slope-fixed", "Actual work on a fixed slope", Slide("3.5", TITLE, 5590), _fixed),
    Case("slope-in-motion", "Actual and virtual work on a slope in motion", Slide("3.5", TITLE, 5644), _moving),
    Case("constraint-surface", "Rates of the constraint of a surface, fixed and in motion", Slide("3.5", TITLE, 5684), _surface),
)
