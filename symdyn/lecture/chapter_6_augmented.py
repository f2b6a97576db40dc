"""Chapter 6.3: Lagrange multipliers for the platform on moorings, and constraints that depend on time."""

from __future__ import annotations

import sympy as sp
from sympy import cos, sin

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, proofs
from symdyn.lecture.letters import ddot, dot

TITLE = "2.1 Equations of Motion - Derivation of Equations of Motion with respect to the Arbitrary Point O for Rigid Body"
x, z, theta = q = sp.Matrix(sd.coordinates("x z theta"))
m, I_G, c, l, h, F_x = sp.symbols("m I_G c l h F_x", positive=True)
lam = sp.Matrix(sp.symbols("lambda_1 lambda_2"))


class Moored:
    """The platform in the plane of surge, heave and pitch, with O at x, z and two constraints."""

    def __init__(self) -> None:
        system = sd.System("moored_platform", gravity=[0, 0])
        body = system.add_body("P", mass=m, inertia=I_G, com=[0, c])
        system.add_joint(sd.Planar("sea", system.ground, body, list(q)))
        system.add_force(body, [F_x, 0], point=[0, 0])
        self.C = sp.Matrix([x**2 + (z + h)**2 - l**2, z - h * sin(theta)])
        for row in self.C:
            system.add_constraint(row)
        self.equations = system.augmented()

    def derived(self, name: str) -> sp.Matrix:
        return sp.Matrix(self.equations.explicit(name, simplify=False))


def multipliers() -> list[Formula]:
    p = Moored()
    M, k, F, C_q, F_d = (p.derived(name) for name in ("M_tilde", "k_tilde", "F_tilde", "C_r", "F_d"))
    names = p.equations.multipliers
    known = dict(zip(lam, names, strict=True))
    saddle = p.derived("matrix") * sp.Matrix.vstack(ddot(q), names) - p.derived("right_side")
    delta_q = sp.Matrix([sp.Symbol(f"delta_{e}") for e in q])
    delta_C = p.C.jacobian(q) * delta_q
    balance = M * ddot(q) + k - F
    velocity_rows = (p.C.jacobian(q) * dot(q)).jacobian(q) * dot(q)
    work = delta_q.dot(saddle[:3, :])
    printed_matrix = sp.Matrix(sp.BlockMatrix([[M, C_q.T], [C_q, sp.zeros(2)]]))
    factor = proofs.Proof("dimensions", "Times the n_c x 1 variation of C it must make one number, 1 x 1.",
                          lambda shape: sp.Matrix([[shape[0] - 1, shape[1] - delta_C.rows]]))
    row = Erratum("The multipliers must stand as a row, lambda^T delta C; two columns cannot be multiplied.", factor)
    left = delta_q.dot(balance) + (lam.T * delta_C)[0]
    return [
        Formula("variation of C", delta_C, C_q * delta_q, line=12185, latex=r"\delta C"),
        Formula("shape of lambda in lambda delta C", sp.Matrix([lam.shape]), sp.Matrix([names.T.shape]), line=12185,
                errata=[row]),
        Formula("work with multipliers", left, work, line=12185, renamed=known),
        Formula("work with C_q", (delta_q.T * (balance + C_q.T * lam))[0], work, line=12187, renamed=known),
        Formula("equations of motion", balance + C_q.T * lam, saddle[:3, :], line=12191, also=(12199, 12231), renamed=known),
        Formula("C", p.C, p.derived("C"), line=12193, also=(12199, 12233), latex="C"),
        Formula("C twice differentiated", (p.C.jacobian(q) * ddot(q), -velocity_rows), (C_q * ddot(q), F_d), line=12205,
                also=(12221,)),
        Formula("matrix", printed_matrix, p.derived("matrix"), line=12209),
        Formula("right side", sp.Matrix.vstack(F - k, -velocity_rows), p.derived("right_side"), line=12209),
    ]


def depending_on_time() -> list[Formula]:
    """A constraint C(q, t), of one coordinate so that every line can be formed as it is printed."""
    s, t, (a, w) = sd.coordinates("q"), sd.t, sp.symbols("a omega", positive=True)
    C = (2 + sin(w * t)) * s**2 + t**2 * cos(s) - a
    equations = sd.augmented([s], mass=[m], force=[0], constraints=[C], defaults={m: 1, a: 2, w: 1}, initial={s: 1})
    first = equations.explicit("C_dot", simplify=False)[0]
    second = (equations.C_r * sp.Matrix([s.ddot]) - equations.F_d)[0]
    C_t, C_q, C_tt, C_qt = sd.partial_rate(C), C.diff(s), sd.partial_rate(sd.partial_rate(C)), sd.partial_rate(C.diff(s))
    velocity = C_q * s.dot

    def partial_t(value: sp.Expr) -> sp.Expr:
        """By the time, as printed: q is held, q_dot is not."""
        return sd.partial_rate(value) + value.diff(s.dot) * s.ddot

    twice = proofs.numeric_derivative("C must be differentiated twice.", of=C, order=2)
    index = Erratum("The derivative by q is that of C_t + C_q q_dot; C_qt stands where C_t belongs.", twice)
    total = C_t + velocity
    by_q = (velocity.diff(s)) * s.dot
    return [
        Formula("rate of C", C_t + C_q * s.dot, first, line=12215, latex=r"\dot{C}"),
        Formula("second rate, line 1", partial_t(total) + total.diff(s) * s.dot, second, line=12217, latex=r"\ddot{C}"),
        Formula("second rate, line 2", C_tt + partial_t(velocity) + (C_qt + velocity).diff(s) * s.dot, second, line=12217,
                errata=[index], latex=r"\ddot{C}"),
        Formula("second rate, line 3", C_tt + C_qt * s.dot + C_q * s.ddot + C_qt * s.dot + by_q, second, line=12217,
                latex=r"\ddot{C}"),
        Formula("second rate, line 4", C_tt + 2 * C_qt * s.dot + C_q * s.ddot + by_q, second, line=12217, latex=r"\ddot{C}"),
    ]


CASES = (
    Case("platform-augmented", "Lagrange multipliers of the platform", Slide("6.3", TITLE, 12173), multipliers),
    Case("constraint-rates", "Rates of a constraint that depends on time", Slide("6.3", TITLE, 12213), depending_on_time),
)
