"""Lecture, chapter 3.3: vehicle and rotating track in absolute coordinates, augmented formulation.

r = [x_v, y_v, x_t, y_t, theta]: the vehicle is at O_v, the centre of mass and hinge of the track at O_t, which rests at
(x_c, y_c). The slides write C_3 with that fixed point; lambda_1 and lambda_2 then hold the push of the vehicle as well, the
motion is the same.
"""

from __future__ import annotations

from functools import cache

import sympy as sp
from sympy import Matrix, cos, diag, sec, tan

import symdyn as sd
from symdyn.comparison import conventions, proofs
from symdyn.comparison.case import Case, Erratum, Formula, Slide
from symdyn.lecture.chapter_3_straight_track import place_on_track

TRACK = "Vehicle constrained to move along the straight track"
# C_3 differentiated by x_v: the slides' sign, which everything after it inherits.
SIGN = "The derivative of -(x_c - x_v) tan(theta) by x_v is +tan(theta), not -tan(theta)."
TOTAL = "The total derivative of C_r r_dot stands where its derivative by r, times r_dot, belongs."


class _System:
    """Vehicle and track in the slides' coordinates, and in the embedded ones: q1 from the hinge, q2 = theta."""

    def __init__(self) -> None:
        self.r = xv, yv, xt, yt, theta = sd.coordinates("x_v y_v x_t y_t theta")
        self.masses = m_v, m_t, I_t = sd.parameters("m_v m_t I_t")
        self.F = Matrix(sd.parameters("F_vx F_vy F_tx F_ty M_t"))
        self.hinge = x_c, y_c = sd.parameters("x_c y_c")
        self.C = [xt - x_c, yt - y_c, y_c - yv - (x_c - xv) * tan(theta)]
        self.M = diag(m_v, m_v, m_t, m_t, I_t)
        self.eq = sd.augmented(self.r, self.M, self.F, self.C, name="vehicle_and_track")
        self.rates, self.accelerations = Matrix([c.dot for c in self.r]), Matrix([c.ddot for c in self.r])
        self.q = q1, q2 = sd.coordinates("q1:3")
        self.map = Matrix([*place_on_track(-q1, q2, self.hinge), *place_on_track(0, q2, self.hinge), q2])
        self.embedded = sd.embedding(self.q, self.map, self.M, self.F, name="vehicle_and_track")

    def along(self, formula: Matrix) -> Matrix:
        """With the positions and velocities that the embedded coordinates give."""
        velocity = sd.rate(self.map)
        return Matrix(formula).xreplace(dict(zip(self.r, self.map)) | dict(zip(self.rates, velocity)))

    def no_motion_off_the_track(self) -> proofs.Proof:
        """Proof about C_r."""
        return proofs.Proof("another formulation", "C_r J must vanish, with J of the embedding technique.",
                            lambda C_r: self.along(C_r) * self.embedded.J)

    def acceleration_on_the_track(self) -> proofs.Proof:
        """Proof about (C_r r_dot)_r."""
        rates = Matrix([c.dot for c in self.q])

        def residual(formula: Matrix) -> Matrix:
            return self.along(self.eq.C_r) * self.embedded.Jdot * rates + self.along(formula * self.rates)

        return proofs.Proof("another formulation", "C_r J_dot q_dot + (C_r r_dot)_r r_dot must vanish, with J of the embedding "
                            "technique.", residual)


@cache
def _both() -> _System:
    return _System()


def _system() -> list[Formula]:
    s = _both()
    (m_v, m_t, I_t), eq, theta = s.masses, s.eq, s.r[4]
    lam, lam_dot = Matrix(eq.multipliers), Matrix([c.dot for c in sd.coordinates("lambda1:4")])
    # The blocks by what the slides say they are.
    C_r = Matrix(s.C).jacobian(Matrix(s.r))
    blocks = sp.Matrix(sp.BlockMatrix([[s.M, C_r.T], [C_r, sp.zeros(3, 3)]]))
    right = Matrix([*s.F, *(-(C_r * s.rates).jacobian(Matrix(s.r)) * s.rates)])
    derived = (eq.matrix * Matrix([*s.accelerations, *lam]), eq.rhs)
    force = eq.constraint_forces
    rows = (derived[0][:5, :], derived[1][:5, :])
    # The loads that go with any accelerations and multipliers.
    loads = dict(zip(s.F, rows[0]))
    solved = dict(zip([*s.accelerations, *lam], eq.matrix.LUsolve(eq.rhs)))
    solution = proofs.Proof("another formulation",
                            "The solution of the linear system for accelerations and multipliers must fulfil it.",
                            lambda formula: formula.xreplace(solved))
    printed_M = [[m_v, 0, 0, 0, 0], [0, m_v, 0, 0, 0], [0, 0, m_t, 0, 0], [0, 0, 0, m_t, 0], [0, 0, 0, 0, I_t]]
    return [
        Formula("augmented equations", (blocks * Matrix([*s.accelerations, *lam]), right), derived, line=4763,
                also=(4776, 4806, 4840, 4871, 4904, 4925, 4948, 4965, 4997)),
        Formula("augmented equations with a rate of lambda", (blocks * Matrix([*s.accelerations, *lam_dot]), right), derived,
                line=4783, errata=[Erratum("The unknown is the multiplier itself; its rate does not appear.", solution)]),
        Formula("constraint force", -C_r.T * lam, s.M * s.accelerations - s.F, line=4772, also=(5004,),
                where=loads),
        Formula("Newton, vehicle", (Matrix([[m_v, 0], [0, m_v]]) * s.accelerations[:2, :], s.F[:2, :] + force[:2, :]),
                (rows[0][:2, :], rows[1][:2, :]), line=4791),
        Formula("Newton, track", (Matrix([[m_t, 0], [0, m_t]]) * s.accelerations[2:4, :], s.F[2:4, :] + force[2:4, :]),
                (rows[0][2:4, :], rows[1][2:4, :]), line=4820),
        Formula("moment, track", (Matrix([I_t * theta.ddot]), Matrix([s.F[4] + force[4]])), (rows[0][4:, :], rows[1][4:, :]),
                line=4822),
        Formula("M, first five rows and columns", printed_M, eq.M_tilde, line=5006, latex=r"\mathbf{M}"),
        Formula("M, sixth row and column", None, None, line=5006, latex=r"\mathbf{M}",
                unreadable="the transcription has an empty sixth row and column, to which no acceleration belongs"),
        Formula("F_e", s.F, eq.rhs[:5, :], line=5006, latex=r"\mathbf{F}^e"),
    ]


def _constraints() -> list[Formula]:
    s = _both()
    xv, yv, xt, yt, theta = s.r
    (x_c, y_c), eq = s.hinge, s.eq
    # The distance of the vehicle from the axis of the track, in its own frame.
    n = sd.Frame("n")
    track = n.frame("track", rotation=sd.rotation.about("Z", theta), origin=[x_c, y_c, 0])
    distance = n.point("O_v", [xv, yv, 0]).position(track, track)[1]
    gap = n.point("O_t", [xt, yt, 0]).position(track, n)
    shift = s.map[2:4, :] - s.map[:2, :]
    xr, yr = sp.symbols("x_tv y_tv")
    to_map = {xr: shift[0], yr: shift[1], theta: s.q[1]} | dict(zip(s.r[:4], s.map))
    printed_C = [xt - x_c, yt - y_c, y_c - yv - (x_c - xv) * tan(theta)]
    printed_C_r = Matrix([[0, 0, 1, 0, 0], [0, 0, 0, 1, 0], [-tan(theta), -1, 0, 0, -(x_c - xv) * sec(theta)**2]])
    factor = conventions.scaled(-1 / cos(theta), "the equation is divided by -cos(theta)")
    inherited = "The sign of tan(theta) is inherited from the derivative of C_3 by x_v, which is +tan(theta)."
    return [
        Formula("hinge", [x_c, y_c], s.map[2:4, :], line=4848, also=(4850, 4852, 4885, 4889)),
        Formula("slope", tan(theta), shift[1] / shift[0], line=4854, renamed=to_map),
        Formula("r of the hinge from the vehicle", Matrix([xt, yt]) - Matrix([xv, yv]), shift, line=4856, also=(4858,),
                renamed=to_map),
        Formula("x of the hinge from the vehicle", x_c - xv, shift[0], line=4860, renamed=to_map),
        Formula("y of the hinge from the vehicle", y_c - yv, shift[1], line=4862, renamed=to_map),
        Formula("slope by coordinates", (y_c - yv) / (x_c - xv) - tan(theta), 0, line=4864, also=(4893,), renamed=to_map),
        Formula("C_3 = 0 on the track", y_c - yv - (x_c - xv) * tan(theta), s.along(eq.C)[2], line=4895, renamed=to_map),
        Formula("C_1", xt - x_c, gap[0], line=4887, also=(4912, 4933), latex="C_1"),
        Formula("C_2", yt - y_c, gap[1], line=4891, also=(4914, 4935), latex="C_2"),
        Formula("C_3", y_c - yv - (x_c - xv) * tan(theta), distance, line=4897, also=(4916, 4937), latex="C_3",
                conventions=[factor]),
        Formula("C_r by derivatives", [[c.diff(q) for q in s.r] for c in printed_C], eq.C_r, line=4939, latex=r"\mathbf{C}_r"),
        Formula("C_r", printed_C_r, eq.C_r, line=4941, also=(5008,), latex=r"\mathbf{C}_r",
                errata=[Erratum(SIGN, s.no_motion_off_the_track(), entries=[(2, 0)])]),
        Formula("C_r r_dot by the matrix", printed_C_r * s.rates, sd.rate(eq.C), line=4956, latex=r"\mathbf{C}_r\dot{\mathbf{r}}",
                errata=[Erratum(inherited, _rate_of(s), entries=[(2,)], slip=SIGN)]),
        Formula("C_r r_dot", [xt.dot, yt.dot, -tan(theta) * xv.dot - yv.dot - (x_c - xv) * sec(theta)**2 * theta.dot],
                sd.rate(eq.C), line=4958, also=(4979,), latex=r"\mathbf{C}_r\dot{\mathbf{r}}",
                errata=[Erratum(inherited, _rate_of(s), entries=[(2,)], slip=SIGN)]),
    ]


def _rate_of(s: _System) -> proofs.Proof:
    return proofs.numeric_derivative("C_r r_dot is the rate of C.", of=s.eq.C)


def _accelerations() -> list[Formula]:
    s = _both()
    xv, _, _, _, theta = s.r
    (x_c, _), eq = s.hinge, s.eq
    velocity = eq.C_r * s.rates
    by_r = velocity.jacobian(Matrix(s.r))
    row = [sec(theta)**2 * theta.dot, 0, 0, 0,
           -sec(theta)**2 * xv.dot - (x_c - xv) * 2 * sec(theta)**2 * tan(theta) * theta.dot]
    printed = Matrix([[0] * 5, [0] * 5, row])
    latex = r"(\mathbf{C}_r\dot{\mathbf{r}})_r"
    angle = sp.Symbol("angle")
    # d(C_r r_dot)/dt has the term C_r r_ddot in it.
    total = sd.rate(velocity)
    second = proofs.numeric_derivative("The equation is the second derivative of C by time.", of=eq.C, order=2)
    at_rest = proofs.limit("At zero velocity, where no term of it is left, F_d must vanish whatever the accelerations are.",
                           {c.dot: 0 for c in s.r}, sp.zeros(3, 1))

    def missing(F_d: Matrix) -> Matrix:
        q_dot, q_ddot = (Matrix([getattr(c, rate) for c in s.q]) for rate in ("dot", "ddot"))
        needed = s.along(eq.C_r) * (s.embedded.J * q_ddot + s.embedded.Jdot * q_dot)
        given = s.along(F_d)
        return needed - given if given.shape == needed.shape else given

    column = proofs.Proof("another formulation", "C_r r_ddot = F_d must hold for the accelerations of the embedded motion.",
                          missing)
    return [
        Formula("F_d", -by_r * s.rates, eq.F_d, line=4785, also=(4808, 4873, 4906, 4927, 4950, 4954, 4967, 4977),
                latex=r"\mathbf{F}^d"),
        Formula("F_d without r_dot", -by_r, eq.F_d, line=4842, latex=r"\mathbf{F}^d", errata=[Erratum(
            "The factor r_dot is missing; three numbers are needed, not a matrix of 3 x 5.", column)]),
        Formula("derivative of tan", sec(angle)**2, tan(angle).diff(angle), line=4981),
        Formula("derivative of sec", sec(angle) * tan(angle), sec(angle).diff(angle), line=4981),
        Formula("(C_r r_dot)_r, begun", [[0] * 5, [0] * 5, [sec(theta)**2 * theta.dot, 0, 0, 0, 0]], by_r, line=4983,
                latex=latex, unreadable={(2, k): "there are dots in its place" for k in range(1, 5)}),
        Formula("(C_r r_dot)_r", printed, by_r, line=4985, also=(5010,), latex=latex, errata=[Erratum(
            "The sign of sec^2(theta) x_v_dot is inherited from the derivative of C_3 by x_v, which is +tan(theta).",
            s.acceleration_on_the_track(), entries=[(2, 4)], slip=SIGN)]),
        Formula("constraint differentiated twice", eq.C_r * s.accelerations + total, eq.C_r * s.accelerations - eq.F_d, line=4766,
                also=(5000,), errata=[Erratum(
                    "The total derivative of C_r r_dot holds C_r r_ddot already; only (C_r r_dot)_r r_dot is added to it.",
                    second, slip=TOTAL)]),
        Formula("F_d as a total derivative", -total, eq.F_d, line=4767, latex=r"\mathbf{F}^d", errata=[Erratum(
            "The known part of the accelerations is -(C_r r_dot)_r r_dot; the total derivative has the unknown r_ddot in it.",
            at_rest, slip=TOTAL)]),
        Formula("d(C_r r_dot)/dt", printed, total, line=5010, latex=r"d(\mathbf{C}_r\dot{\mathbf{r}})/dt", errata=[Erratum(
            "A matrix of 3 x 5 stands for a vector: the factor r_dot and the term C_r r_ddot are missing, and the sign of "
            "sec^2(theta) x_v_dot is wrong.", _shape_of(total))]),
    ]


def _shape_of(total: Matrix) -> proofs.Proof:
    return proofs.Proof("another formulation", "The rate of a column with three rows is a column with three rows.",
                        lambda formula: sp.Matrix([formula.rows - total.rows, formula.cols - total.cols]))


CASES = (
    Case("rotating-track-augmented", "Vehicle and rotating track, augmented formulation", Slide("3.3", TRACK, 4724), _system),
    Case("rotating-track-constraints", "Vehicle and rotating track: constraints and their Jacobian", Slide("3.3", TRACK, 4836),
         _constraints),
    Case("rotating-track-constraint-accelerations", "Vehicle and rotating track: F_d", Slide("3.3", TRACK, 4944), _accelerations),
)
