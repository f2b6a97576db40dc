"""Lecture, chapter 3.5: the pendulum in Cartesian coordinates with a Lagrange multiplier, and constraints that depend on time."""

from __future__ import annotations

import sympy as sp
from sympy import Matrix, cos, sin

import symdyn as sd
from symdyn.comparison import proofs
from symdyn.comparison.case import Case, Erratum, Formula, Slide
from symdyn.lecture.chapter_3_pendulum_relative import circle, place_of_pendulum

PENDULUM = "Example of the pendulum - Augmented Formulation"
MULTIPLIER = "Lagrange Multiplier Method"


def _multiplier() -> list[Formula]:
    """With any applied force, and with the constraint of the pendulum where the slides write C."""
    x, y = sd.coordinates("x_P y_P")
    (q1,) = sd.coordinates("q1:2")
    m, length, Fx, Fy = sd.parameters("m l_1 F_x F_y")
    lam = sp.Symbol("lambda")
    dx, dy, dq = sp.symbols("delta_x delta_y delta_q")
    C = circle(x, y, length)
    eq = sd.augmented([x, y], [m, m], [Fx, Fy], [C], name="pendulum")
    embedded = sd.embedding([q1], list(place_of_pendulum(q1, length)), [m, m], [Fx, Fy], name="pendulum")
    rows = eq.matrix * Matrix([x.ddot, y.ddot, lam]) - eq.rhs
    place, J = embedded.explicit("r"), embedded.J
    r_ddot = J * q1.ddot + embedded.Jd_qd
    # A displacement that the wire allows, and the accelerations of the embedded motion.
    allowed = dict(zip([x, y, x.dot, y.dot], [*place, *(J * q1.dot)])) | {dx: J[0] * dq, dy: J[1] * dq}
    motion = allowed | dict(zip([x.ddot, y.ddot], r_ddot))
    work = (embedded.M_tilde * q1.ddot + embedded.k_tilde - embedded.F_tilde)[0] * dq
    Cx, Cy = C.diff(x), C.diff(y)
    change, newton = Matrix([[dx, dy]]), Matrix([m * x.ddot - Fx, m * y.ddot - Fy])
    both = (change * rows[:2, :])[0]
    # The multiplier from row 2 and q1_ddot from the embedding technique leave nothing of row 1.
    solved = motion | {q1.ddot: embedded.explicit("accelerations")[0]}
    row_1 = proofs.Proof("another formulation", "With the embedded motion and the multiplier of row 2, row 1 must hold.",
                         lambda row: sp.sympify(row).subs(lam, sp.solve(rows[1], lam)[0]).xreplace(motion).xreplace(solved))
    M = Matrix([[m, 0], [0, m]])
    C_r = Matrix([[Cx, Cy]])
    return [
        Formula("work", (change * M * Matrix([x.ddot, y.ddot]) - change * Matrix([Fx, Fy]))[0], work, line=5250,
                also=(5266, 5338), renamed=motion, slide=Slide("3.5", PENDULUM)),
        Formula("work with the reaction",
                (change * M * Matrix([x.ddot, y.ddot]) - change * Matrix([Fx, Fy]) - change * embedded.F_c)[0], work, line=5244,
                renamed=motion, slide=Slide("3.5", PENDULUM)),
        Formula("work, factored", (change * (M * Matrix([x.ddot, y.ddot]) - Matrix([Fx, Fy])))[0], work, line=5270, also=(5340,),
                renamed=motion, slide=Slide("3.5", PENDULUM)),
        Formula("work by components", (change * newton)[0], work, line=5274, also=(5290, 5342), renamed=motion),
        Formula("constraint", x**2 + y**2 - length**2, eq.C[0], line=5260, also=(5276, 5280, 5333, 5344, 5346, 5356)),
        Formula("constraint with l", x**2 + y**2 - sp.Symbol("l")**2, eq.C[0], line=5292, latex="C", errata=[Erratum(
            "The wire has the length l_1, as on the slides before and after; its index is missing.",
            proofs.limit("It must vanish on the circle of radius l_1.", at=dict(zip((x, y), place)), value=0))]),
        Formula("parts of the work", None, newton, line=5294,
                unreadable="which of the three lines are sums, and which of them vanish, is lost with their layout"),
        Formula("variation of C", C.diff(x) * dx + C.diff(y) * dy, (eq.C_r * change.T)[0], line=5301),
        Formula("variation of C on the circle", 0, (eq.C_r * change.T)[0], line=5301, where=allowed),
        Formula("work with lambda", dx * (m * x.ddot - Fx) + dy * (m * y.ddot - Fy) + lam * (Cx * dx + Cy * dy), both, line=5305,
                also=(5313,)),
        Formula("work with lambda, ordered", dx * (m * x.ddot - Fx + lam * Cx) + dy * (m * y.ddot - Fy + lam * Cy), both,
                line=5315),
        Formula("row of y", m * y.ddot - Fy + lam * Cy, rows[1], line=5319, also=(5327, 5354, 5366, 5398, 5412, 5446, 5478)),
        Formula("row of x", m * x.ddot - Fx + lam * Cx, rows[0], line=5325, also=(5329, 5364)),
        Formula("row of x times its displacement", dx * (m * x.ddot - Fx + lam * Cx), dx * rows[0], line=5323),
        Formula("row of x on the slides of the pendulum", m * x.ddot - Fx - lam * Cx, rows[0], line=5352,
                also=(5396, 5410, 5446, 5476), slide=Slide("3.5", PENDULUM), errata=[Erratum(
                    "lambda has the same sign in both rows, those of M r_ddot - F_e + C_r^T lambda = 0.", row_1)]),
        Formula("equations with lambda", M * Matrix([x.ddot, y.ddot]) - Matrix([Fx, Fy]) + lam * C_r.T, rows[:2, :], line=5372,
                also=(5374, 5402, 5420, 5450, 5482, 5490), slide=Slide("3.5", PENDULUM)),
        Formula("C_r", C_r, eq.C_r, line=5374, also=(5406, 5424, 5454, 5486, 5490, 5507, 5531, 5556), latex=r"\mathbf{C}_r",
                slide=Slide("3.5", PENDULUM)),
    ]


def _time_dependent() -> list[Formula]:
    """C is of second order in x, y and t, with any coefficients: so is every constraint up to its second derivatives."""
    x, y = sd.coordinates("x_P y_P")
    t = sd.t
    m, Fx, Fy = sd.parameters("m F_x F_y")
    c = sp.symbols("c_1:10")
    C = sum(a * b for a, b in zip(c, (x, y, t, x**2, x * y, y**2, x * t, y * t, t**2)))
    eq = sd.augmented([x, y], [m, m], [Fx, Fy], [C], name="moving_constraint")
    r, r_dot, r_ddot = Matrix([x, y]), Matrix([x.dot, y.dot]), Matrix([x.ddot, y.ddot])
    lam, dt = Matrix(eq.multipliers), sp.Symbol("dt")
    Cx, Cy, Ct = C.diff(x), C.diff(y), sd.partial_rate(C)
    C_r, C_t = Matrix([[Cx, Cy]]), Matrix([Ct])
    C_rt, C_tt = sd.partial_rate(C_r), sd.partial_rate(C_t)
    velocity = C_r * r_dot
    total = velocity + C_t
    rate = sd.rate(Matrix([C]))
    second = sd.rate(rate)
    by_r = velocity.jacobian(r)
    by_t = C_rt * r_dot + C_r * r_ddot + C_tt

    def remainder(term: Matrix) -> Matrix:
        return term.applyfunc(lambda e: e + (by_t - second)[0])

    added_up = proofs.Proof("another formulation", "With the second term, the derivative by t, it must be the second rate of C.",
                            remainder)
    F_d = -by_r * r_dot - 2 * C_rt * r_dot - C_tt
    M = Matrix([[m, 0], [0, m]])
    blocks = sp.Matrix(sp.BlockMatrix([[M, C_r.T], [C_r, Matrix([[0]])]]))
    return [
        Formula("rate of C", Cx * x.dot + Cy * y.dot + Ct, rate[0], line=5390, also=(5426,), latex=r"\frac{dC}{dt}"),
        Formula("total differential of C", Cx * (x.dot * dt) + Cy * (y.dot * dt) + Ct * dt, rate[0] * dt, line=5394, latex="dC"),
        Formula("rate of C, matrices", C_r * r_dot + Matrix([Ct]), rate, line=5428),
        Formula("dC/dt", C_r * r_dot + C_t, rate, line=5430, also=(5440, 5462), latex=r"\frac{dC}{dt}"),
        Formula("C_r", [[C.diff(x), C.diff(y)]], eq.C_r, line=5430, also=(5440, 5462), latex=r"\mathbf{C}_r"),
        Formula("C_t", [sd.partial_rate(C)], eq.C_t, line=5430, also=(5440, 5462), latex=r"\mathbf{C}_t"),
        # The subscript r_dot means the derivative by r_dot, which is a row.
        Formula("second rate 1, first term", total.jacobian(r_dot), total.jacobian(r) * r_dot, line=5444,
                latex=r"(\mathbf{C}_r\dot{\mathbf{r}}+\mathbf{C}_t)_{\dot{\mathbf{r}}}", errata=[Erratum(
                    "It is the derivative by r, times r_dot, as on the next line; the derivative by r_dot is C_r.", added_up)]),
        # The subscript t of C_r r_dot takes r_dot for a function of time, as the next line shows.
        Formula("second rate 2", by_r * r_dot + C_t.jacobian(r) * r_dot + by_t, second, line=5444),
        Formula("second rate 3", by_r * r_dot + C_rt * r_dot + C_rt * r_dot + C_r * r_ddot + C_tt, second, line=5444),
        Formula("second rate", by_r * r_dot + 2 * C_rt * r_dot + C_r * r_ddot + C_tt, second, line=5444, also=(5466, 5470)),
        Formula("C_rt", [[sd.partial_rate(Cx), sd.partial_rate(Cy)]], sd.partial_rate(eq.C_r), line=5444, also=(5466, 5492),
                latex=r"\mathbf{C}_{rt}"),
        Formula("C_tt", [sd.partial_rate(Ct)], sd.partial_rate(eq.C_t), line=5444, also=(5466, 5492), latex=r"\mathbf{C}_{tt}"),
        Formula("C_r r_ddot", (C_r * r_ddot, F_d), (eq.C_r * r_ddot, eq.F_d), line=5472, also=(5474, 5492)),
        Formula("F_d", F_d, eq.F_d, line=5474, also=(5492, 5509, 5533, 5558), latex=r"\mathbf{F}^d"),
        Formula("augmented equations", (blocks * Matrix([*r_ddot, *lam]), Matrix([Fx, Fy, *F_d])),
                (eq.matrix * Matrix([*r_ddot, *lam]), eq.rhs), line=5496, also=(5505, 5529, 5554)),
    ]


def _pendulum() -> list[Formula]:
    x, y = sd.coordinates("x_P y_P")
    (q1,) = sd.coordinates("q1:2")
    m, g, length = sd.parameters("m g l_1")
    C = circle(x, y, length)
    eq = sd.augmented([x, y], [m, m], [0, -m * g], [C], name="pendulum")
    r, r_dot, r_ddot = Matrix([x, y]), Matrix([x.dot, y.dot]), Matrix([x.ddot, y.ddot])
    embedded = sd.embedding([q1], list(place_of_pendulum(q1, length)), [m, m], [0, -m * g], name="pendulum")
    place = embedded.explicit("r")
    velocity = sd.rate(place)
    on_circle = dict(zip([x, y, x.dot, y.dot], [*place, *velocity]))
    unknowns = Matrix([*r_ddot, *eq.multipliers])
    derived = (eq.matrix * unknowns, eq.rhs)
    product = eq.C_r * r_dot
    by_r = product.jacobian(r)
    c, s, rate = cos(q1), sin(q1), q1.dot
    matrix = Matrix([[m, 0, 2 * x], [0, m, 2 * y], [2 * x, 2 * y, 0]])
    early = "C_r r_dot vanishes on the circle only; it must be differentiated by r before the motion is put in"
    centripetal = proofs.Proof("another formulation", "r . r_ddot = -r_dot . r_dot on a circle, so that (C_r r_dot)_r r_dot + "
                               "2 r . r_ddot must vanish for the embedded motion.",
                               lambda term: _on(term, on_circle) + 2 * place.T * (embedded.J * q1.ddot + embedded.Jd_qd))
    kept = proofs.Proof("another formulation", "The mass must stay on the circle: the last row is the second rate of C.",
                        lambda rows: rows[2] - sd.rate(sd.rate(C)))
    curved = proofs.Proof("another formulation", "C_r r_ddot of the embedded motion must be its last row.",
                          lambda rhs: rhs[2] - 2 * (place.T * (embedded.J * q1.ddot + embedded.Jd_qd))[0])
    return [
        Formula("constraint", x**2 + y**2 - length**2, eq.C[0], line=5513, also=(5368, 5380, 5414, 5436, 5458)),
        Formula("F_e", [0, -m * g], eq.F_tilde, line=5515, also=(5236,), latex=r"\mathbf{F}^e"),
        Formula("M", [[m, 0], [0, m]], eq.M_tilde, line=5507, also=(5236, 5374, 5404, 5422, 5452, 5484, 5490, 5531, 5556),
                latex=r"\mathbf{M}"),
        Formula("C_r", [[2 * x, 2 * y]], eq.C_r, line=5517, also=(5535, 5562), latex=r"\mathbf{C}_r"),
        Formula("C_rt", [[0, 0]], sd.partial_rate(eq.C_r), line=5517, also=(5535, 5562), latex=r"\mathbf{C}_{rt}"),
        Formula("C_tt", [0], sd.partial_rate(eq.C_t), line=5517, also=(5535, 5562), latex=r"\mathbf{C}_{tt}"),
        Formula("C_r r_dot by the matrix", Matrix([[2 * x, 2 * y]]) * r_dot, product, line=5519, also=(5537,),
                latex=r"\mathbf{C}_r\dot{\mathbf{r}}"),
        Formula("C_r r_dot", 2 * x * x.dot + 2 * y * y.dot, product[0], line=5519, also=(5537, 5545),
                latex=r"\mathbf{C}_r\dot{\mathbf{r}}"),
        Formula("C_r r_dot in motion", 2 * length * s * length * c * rate - 2 * length * c * length * s * rate, product[0],
                line=5545, where=on_circle, latex=r"\mathbf{C}_r\dot{\mathbf{r}}"),
        Formula("C_r r_dot on the circle", 0, product[0], line=5545, also=(5564,), where=on_circle,
                latex=r"\mathbf{C}_r\dot{\mathbf{r}}"),
        Formula("(C_r r_dot)_r", [[0, 0]], by_r, line=5566, latex=r"(\mathbf{C}_r\dot{\mathbf{r}})_r", errata=[Erratum(
            early + ": it is [2 x_dot, 2 y_dot].", proofs.Proof(
                centripetal.kind, centripetal.sentence, lambda row: centripetal.residual(row * r_dot)), slip=early + ".")]),
        Formula("(C_r r_dot)_r r_dot", [0], by_r * r_dot, line=5566, latex=r"(\mathbf{C}_r\dot{\mathbf{r}})_r\dot{\mathbf{r}}",
                errata=[Erratum(early + ": it is 2 x_dot^2 + 2 y_dot^2.", centripetal,
                                                                slip=early + ".")]),
        Formula("matrix", matrix, eq.matrix, line=5570),
        Formula("right side", [0, -m * g, 0], eq.rhs, line=5570, errata=[Erratum(
            "F_d is -2 (x_dot^2 + y_dot^2): without it the mass leaves the circle as soon as it moves.",
            proofs.Proof(curved.kind, curved.sentence, lambda rhs: curved.residual(_on(rhs, on_circle))), entries=[(2,)],
            slip=early + ".")]),
        Formula("equations of motion", (matrix * unknowns, Matrix([0, -m * g, 0])), derived, line=5570, errata=[Erratum(
            "The last row lacks the centripetal acceleration, so that the constraint is not kept.", kept, entries=[(2,)],
            slip=early + ".")]),
    ]


def _on(formula: sp.Expr | Matrix, motion: dict) -> sp.Expr | Matrix:
    """With positions, velocities (and accelerations) of a motion."""
    return formula.xreplace(motion)


CASES = (
    Case("lagrange-multiplier-method", "Elimination of a dependent displacement by a multiplier", Slide("3.5", MULTIPLIER, 5288),
         _multiplier),
    Case("time-dependent-constraint", "Rates of a constraint that depends on time", Slide("3.5", PENDULUM, 5378),
         _time_dependent),
    Case("pendulum-augmented", "Pendulum, augmented formulation", Slide("3.5", PENDULUM, 5500), _pendulum),
)
