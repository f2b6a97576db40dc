"""Chapter 4.5: Euler parameters p of axis and angle, the rotation matrix R(p) entry by entry, and p from R."""

from __future__ import annotations

import sympy as sp
from sympy import cos, sin

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, proofs
from symdyn.lecture.chapter_4_euler_theorem import UNIT, a, a_x, a_y, a_z, phi

p = sp.Matrix(sd.coordinates("theta_0:4"))
theta_0, theta_1, theta_2, theta_3 = p
pd = sp.Matrix([theta.dot for theta in p])
# Euler parameters have norm 1, and their rates keep it: p_dot . p = 0. Thirds of theta_1, theta_2, theta_3 instead of themselves
# leave theta_0 real wherever formulas are compared.
_theta_0 = sp.sqrt(9 - theta_1**2 - theta_2**2 - theta_3**2) / 3
NORM = {theta: theta / 3 for theta in [*p[1:], *pd[1:]]} | {theta_0: _theta_0, theta_0.dot: sd.rate(_theta_0)}

# As printed; the entry (1, 1) stands with the other sign once.
R = sp.Matrix([
    [2 * (theta_0**2 + theta_1**2) - 1, 2 * (theta_1 * theta_2 - theta_0 * theta_3), 2 * (theta_1 * theta_3 + theta_0 * theta_2)],
    [2 * (theta_1 * theta_2 + theta_0 * theta_3), 2 * (theta_0**2 + theta_2**2) - 1, 2 * (theta_2 * theta_3 - theta_0 * theta_1)],
    [2 * (theta_1 * theta_3 - theta_0 * theta_2), 2 * (theta_2 * theta_3 + theta_0 * theta_1), 2 * (theta_0**2 + theta_3**2) - 1],
])
HALF = {theta_0: cos(phi / 2), theta_1: a_x * sin(phi / 2), theta_2: a_y * sin(phi / 2), theta_3: a_z * sin(phi / 2)}


def _matrix() -> list[Formula]:
    first = R.copy()
    first[0, 0] = 2 * (theta_0**2 - theta_1**2) - 1
    about_x = proofs.limit("The rotation by phi about x keeps the x component: R_11 is 1.",
                           at=HALF | {theta_1: sin(phi / 2), theta_2: 0, theta_3: 0},
                           value=[[1, 0, 0], [0, cos(phi), -sin(phi)], [0, sin(phi), cos(phi)]])
    sign = Erratum("theta_1^2 has a minus where a plus belongs, as on all later slides.", about_x, entries=[(0, 0)])
    right = sd.rotation.from_parameters(p)
    return [
        Formula("p", sp.Matrix([HALF[theta] for theta in p]), sd.rotation.parameters_of_axis_angle(list(a), phi, unit=True),
                line=6920, also=(6852, 6967, 6987, 7015, 7266)),
        Formula("R, first print", first, right, line=6852, where=NORM, errata=[sign], latex=r"{}^nR_b"),
        Formula("R", R, right, line=6858, where=NORM, latex=r"{}^nR_b",
                also=(6870, 6882, 6894, 6906, 6918, 6937, 6943, 6949, 6955, 6965, 6985, 7017, 7035, 7055, 7264)),
    ]


def _diagonal(of: sp.Expr) -> list[sp.Expr]:
    """The steps of a diagonal entry after the first; of: component of the axis."""
    up, down = (1 + cos(phi)) / 2, (1 - cos(phi)) / 2
    return [2 * (up + of**2 * down) - 1, 1 + cos(phi) + of**2 * (1 - cos(phi)) - 1, (1 - cos(phi)) * of**2 + cos(phi)]


def _off_diagonal(of: sp.Expr, by: sp.Expr, third: sp.Expr, sign: int) -> list[sp.Expr]:
    """The steps of another entry after the first; of, by, third: components of the axis."""
    return [2 * (of * by * (1 - cos(phi)) / 2 + sign * third * sin(phi) / 2),
            (1 - cos(phi)) * of * by + sign * third * sin(phi)]


def _entries() -> list[Formula]:
    """The nine derivations of R(p) = R_a,phi; the first step is the entry of R(p) with p of axis and angle."""
    right = sd.rotation.about(list(a), phi, unit=True)
    half = sd.rotation.parameters_of_axis_angle(list(a), phi, unit=True)
    lines = [(6860, 0, 0, _diagonal(a_x)), (6862, 0, 1, _off_diagonal(a_x, a_y, a_z, -1)),
             (6872, 0, 2, _off_diagonal(a_x, a_z, a_y, 1)), (6874, 1, 0, _off_diagonal(a_x, a_y, a_z, 1)),
             (6884, 1, 1, _diagonal(a_y)), (6886, 1, 2, _off_diagonal(a_y, a_z, a_x, -1)),
             (6896, 2, 0, _off_diagonal(a_x, a_z, a_y, -1)), (6898, 2, 1, _off_diagonal(a_y, a_z, a_x, 1)),
             (6908, 2, 2, _diagonal(a_z))]
    formulas = [
        Formula(f"steps of R_{i + 1}{j + 1}", [R[i, j].xreplace(HALF), *steps], [right[i, j]] * (len(steps) + 1), line=line,
                latex=f"R_{{{i + 1}{j + 1}}}")
        for line, i, j, steps in lines]
    return [
        Formula("cosine of half the angle, squared", (1 + cos(phi)) / 2, half[0]**2, line=6860, also=(6884, 6908)),
        Formula("sine of half the angle, squared", (1 - cos(phi)) / 2, half[1:, 0].dot(half[1:, 0]), line=6860, where=UNIT,
                also=(6862, 6872, 6874, 6884, 6886, 6896, 6898, 6908)),
        Formula("product of sine and cosine", a * sin(phi) / 2, half[0] * half[1:, 0], line=6862,
                also=(6872, 6874, 6886, 6896, 6898)),
        *formulas,
    ]


def _inverse() -> list[Formula]:
    turned = sd.rotation.from_parameters(p)
    trace = turned.trace()
    squares = [theta**2 for theta in p]
    diagonal = [2 * (theta_0**2 + theta**2) for theta in p[1:]]
    whole = sum(squares)
    added = 6 * squares[0] + 2 * squares[1] + 2 * squares[2] + 2 * squares[3]
    steps_0 = [(sum(diagonal) - 3 + 1) / 4, (added - 2) / 4, (added - 2 * whole) / 4, 4 * squares[0] / 4, squares[0]]
    formulas = [
        Formula("theta_0^2 by the trace", (trace + 1) / 4, theta_0**2, line=6927, where=NORM, latex=r"\theta_0^2"),
        Formula("trace", R[0, 0] + R[1, 1] + R[2, 2], trace, line=6929, where=NORM, latex=r"\mathrm{tr}\,R"),
        Formula("steps of theta_0^2", steps_0, [theta_0**2] * 5, line=6939, where=NORM, latex=r"\theta_0^2"),
    ]
    for k, line in ((1, 6945), (2, 6951), (3, 6957)):
        own, (d_1, d_2, d_3) = diagonal[k - 1], diagonal
        others = sum(d for d in diagonal if d is not own)
        first = (1 + 2 * own - 2 - (d_1 - 1) + d_2 - 1 + d_3 - 1) / 4
        steps = [(1 + 2 * own - 2 - d_1 + 1 - d_2 + 1 - d_3 + 1) / 4, (2 + 2 * own - d_1 - d_2 - d_3) / 4, (2 + own - others) / 4,
                 (2 * whole + own - others) / 4, 4 * p[k]**2 / 4, p[k]**2]
        still = proofs.limit("Without a rotation, p = (1, 0, 0, 0), it must be 0.", at=dict(zip(p, [1, 0, 0, 0])), value=0)
        bracket = Erratum("The bracket ends after R_11: the minus belongs to all three entries of the trace.", still)
        right = sd.rotation.from_parameters(p)
        formulas += [
            Formula(f"theta_{k}^2 by the trace", (1 + 2 * right[k - 1, k - 1] - trace) / 4, p[k]**2, line=6927, where=NORM,
                    latex=rf"\theta_{k}^2"),
            Formula(f"first step of theta_{k}^2", first, p[k]**2, line=line, where=NORM, errata=[bracket],
                    latex=rf"\theta_{k}^2"),
            Formula(f"steps of theta_{k}^2", steps, [p[k]**2] * 6, line=line, where=NORM, latex=rf"\theta_{k}^2"),
        ]
    return formulas


_TITLE = "Euler parameter - rotation transformation matrix"
CASES = (
    Case("euler-parameters-rotation", "Rotation matrix of Euler parameters", Slide("4.5", _TITLE, 6846), _matrix),
    Case("euler-parameters-entries", "Rotation matrix of Euler parameters, derived entry by entry",
         Slide("4.5", "(derivation)", 6854), _entries),
    Case("euler-parameters-from-rotation", "Euler parameters of a rotation matrix", Slide("4.5", _TITLE, 6912), _inverse),
)
