"""Chapters 5.1 to 5.4: bodies that slide on each other, by Newton's law, the embedding technique and the recursion."""

from __future__ import annotations

import sympy as sp

import symdyn as sd
from symdyn.comparison.case import Case, Formula, Remark, Slide
from symdyn.lecture.letters import stands_for

TITLE = "Equations of Motion for Multibody that has two Prismatic Joints"

q1, q2, q3 = q = sd.coordinates("q1:4")
u1, u2, u3 = (e.dot for e in q)
a1, a2, a3 = (e.ddot for e in q)
x0, *_ = BASES = sd.coordinates("x0:4")
x0_ddot, x1_ddot, x2_ddot, x3_ddot = (x.ddot for x in BASES)
m1, m2, m3 = sp.symbols("m1:4")
l1, l2, l3 = sp.symbols("l1:4")
F1, F2, F3, F4 = sp.symbols("F1:5")


class Chain:
    """A chain of n sliding bodies and what symdyn derives of it."""

    def __init__(self, n: int) -> None:
        system = sd.systems.prismatic_chain(n)
        for body in system.bodies:
            system.add_output(f"G_{body.name}", sd.position(body, body.com))
        self.n = n
        self.embedded = system.embedding()
        self.recursive = system.recursive()
        self.along = [3 * k for k in range(n)]  # the rows of J for x

    @property
    def x(self) -> sp.Matrix:
        """(n, 1) positions of the centres of mass along the line."""
        return sp.Matrix([self.recursive.explicit(f"G_body{k + 1}")[0] for k in range(self.n)])

    @property
    def J(self) -> sp.Matrix:
        """(n, n) x_dot = J q_dot."""
        return self.embedded.J.extract(self.along, list(range(self.n)))

    @property
    def x_dot(self) -> sp.Matrix:
        return self.J * sp.Matrix(self.embedded.symbols.speeds)

    @property
    def x_ddot(self) -> sp.Matrix:
        """(n, 1) of given q_ddot, from the recursion."""
        return sp.Matrix([self.recursive.link(k + 1).a[3] for k in range(self.n)])

    @property
    def F(self) -> sp.Matrix:
        """(n, 1) forces of each body on the next, for given q_ddot, from the recursion."""
        return sp.Matrix([self.recursive.link(k + 1).f[3] for k in range(self.n)])

    @property
    def newton(self) -> sp.Matrix:
        """(n, 1) residuals m_k x_k_ddot - (F_k - F_(k+1)): what the joints lack, of each body less that of the next."""
        tau = self.recursive.tau
        return sp.Matrix([tau[k] - (tau[k + 1] if k + 1 < self.n else 0) for k in range(self.n)])

    @property
    def q_ddot(self) -> sp.Matrix:
        """(n, 1) for given forces, by articulated bodies."""
        return self.recursive.explicit("accelerations")

    def named(self, values: sp.Matrix, name: str = "x{}_ddot") -> dict[str, sp.Expr]:
        return {name.format(k + 1): value for k, value in enumerate(values)}


def column(*entries: sp.Expr) -> sp.Matrix:
    return sp.Matrix(entries)


def newton() -> list[Formula]:
    """5.1: two bodies by Newton's law; the joint forces from the accelerations and the other way."""
    c = Chain(2)
    masses = sp.Matrix([[m1 + m2, m2], [m2, m2]])
    in_q = c.named(c.x_ddot)
    return [
        Formula("F_2", (column(F2), column(m2 * x2_ddot)), c.newton[1:, :], line=7372, renamed=in_q),
        Formula("F_1 - F_2", (column(F1 - F2), column(m1 * x1_ddot)), c.newton[:1, :], line=7373, renamed=in_q),
        Formula("x", [q1 + l1, q1 + q2 + l2], c.x, line=7376, also=(7377, 7438)),
        Formula("x_dot", [u1, u1 + u2], c.x_dot, line=7376, also=(7377, 7438)),
        Formula("x_ddot", [a1, a1 + a2], c.x_ddot, line=7376, also=(7377,)),
        Formula("(1)", (column(F1 - F2), column(m1 * a1)), c.newton[:1, :], line=7376, also=(7388,)),
        Formula("(2)", (column(F2), column(m2 * a2 + m2 * a1)), c.newton[1:, :], line=7377, also=(7390,)),
        Formula("(2) + (1)", (column(F1), column((m1 + m2) * a1 + m2 * a2)), c.newton[:1, :] + c.newton[1:, :], line=7388),
        Formula("inverse dynamics", masses * column(a1, a2), c.F, line=7394, also=(7416, 7452, 7617)),
        Formula("forward dynamics", masses.inv() * column(F1, F2), c.q_ddot, line=7400),
    ]


def embedding() -> list[Formula]:
    """5.2: the same by the embedding technique, and three bodies."""
    coordinates, masses, F = sd.coordinates("q1 q2"), sd.parameters("m1 m2"), sd.inputs("F1 F2")
    c = Chain(2)
    by_hand = sd.embedding(coordinates, c.x, masses, [F[0] - F[1], F[1]])
    J, M, F_e = sp.Matrix([[1, 0], [1, 1]]), sp.diag(m1, m2), column(F1 - F2, F2)
    masses = sp.Matrix([[m1 + m2, m2], [m2, m2]])
    three = Chain(3)
    n, k = sp.symbols("n k", positive=True, integer=True)
    # Multiplications and divisions: eliminating column k, then forwards and backwards for each of n columns of the unit matrix.
    inverse = sp.summation((n - k) + (n - k) ** 2, (k, 1, n - 1)) + n * n**2
    return [
        Formula("M r_ddot = F^e", (M * column(x1_ddot, x2_ddot), F_e), c.newton, line=7426, renamed=c.named(c.x_ddot)),
        Formula("J", J, by_hand.J, line=7438, also=(7430,)),
        Formula("J^T", [[1, 1], [0, 1]], by_hand.J.T, line=7430, also=(7432, 7434), latex=r"\mathbf J^T"),
        Formula("J^T M", [[m1, m2], [0, m2]], by_hand.M_tilde * by_hand.J.inv(), line=7430, latex=r"\mathbf J^T \mathbf M"),
        Formula("M_tilde", masses, by_hand.M_tilde, line=7430, also=(7436,), latex=r"\tilde{\mathbf M}"),
        Formula("J_dot", sp.zeros(2), by_hand.Jdot, line=7432, latex=r"\dot{\mathbf J}"),
        Formula("k_tilde", sp.zeros(2, 1), by_hand.k_tilde, line=7432, latex=r"\tilde{\mathbf k}"),
        Formula("F_tilde", sp.Matrix([[1, 1], [0, 1]]) * F_e, by_hand.F_tilde, line=7434, latex=r"\tilde{\mathbf F}^e"),
        Formula("F_tilde, worked out", [F1, F2], by_hand.F_tilde, line=7434, latex=r"\tilde{\mathbf F}^e"),
        Formula("equations of motion", (masses * column(a1, a2), column(F1, F2)),
                by_hand.M_tilde * by_hand.accelerations + by_hand.k_tilde - by_hand.F_tilde, line=7436),
        Formula("M_tilde of three", [[m1 + m2 + m3, m2 + m3, m3], [m2 + m3, m2 + m3, m3], [m3, m3, m3]],
                three.embedded.M_tilde, line=7460, latex=r"\tilde{\mathbf M}_3"),
        Formula("F of three", sp.Matrix([[m1 + m2 + m3, m2 + m3, m3], [m2 + m3, m2 + m3, m3], [m3, m3, m3]]) * column(a1, a2, a3),
                three.F, line=7460, latex=r"\mathbf F_3"),
        Formula("operations of Gauss elimination", None, None, line=7470,
                unreadable="where the number of operations of Gauss elimination stood the transcription has a blank"),
        Formula("operations of the inverse by LU decomposition", 4 * n**3 / 3 - n / 3, inverse, line=7472),
    ]


def inverse() -> list[Formula]:
    """5.3: accelerations outwards, forces inwards."""
    c = Chain(3)
    in_q = c.named(c.x_ddot) | {"x0_ddot": 0}
    recursion = [x0_ddot + a1, x1_ddot + a2, x2_ddot + a3]
    forces = column(F1 - F2, F2 - F3, F3 - F4), column(m1 * x1_ddot, m2 * x2_ddot, m3 * x3_ddot)
    return [
        Formula("x_ddot, body by body", [a1, x1_ddot + a2, x2_ddot + a3], c.x_ddot, line=7494, also=(7541,), renamed=in_q),
        Formula("x", [q1 + l1, q1 + q2 + l2, q1 + q2 + q3 + l3], c.x, line=7496, also=(7502, 7512)),
        Formula("x_dot", [u1, u1 + u2, u1 + u2 + u3], c.x_dot, line=7498, also=(7506, 7514)),
        Formula("x_ddot", [a1, a1 + a2, a1 + a2 + a3], c.x_ddot, line=7500, also=(7510, 7516)),
        Formula("x_n_ddot", recursion, c.x_ddot, line=7521, also=(7547, 7627), renamed=in_q),
        Formula("resultants", (column(F3, F2 - F3, F1 - F2), column(m3 * x3_ddot, m2 * x2_ddot, m1 * x1_ddot)),
                c.newton.extract([2, 1, 0], [0]), line=7545, renamed=in_q),
        Formula("F_n - F_n+1", forces, c.newton, line=7547, also=(7627,), renamed=in_q | {"F4": 0}),
    ]


def forward() -> list[Formula]:
    """5.4: the same two recursions solved for the accelerations."""
    c = Chain(3)
    x_ddot = c.J * c.q_ddot
    # "x_0 = 0" of the slide, and with it the second derivative.
    in_F = c.named(x_ddot) | stands_for([x0], [0], dots=2)
    no_fourth = {"F4": 0}
    return [
        Formula("Newton's law", (column(F3, F2 - F3, F1 - F2), column(m3 * x3_ddot, m2 * x2_ddot, m1 * x1_ddot)),
                c.newton.extract([2, 1, 0], [0]), line=7577, also=(7579, 7581), renamed=c.named(c.x_ddot)),
        Formula("x_ddot", [(F1 - F2) / m1, (F2 - F3) / m2, F3 / m3], x_ddot, line=7577, also=(7579, 7581)),
        Formula("x_n_ddot", [(F1 - F2) / m1, (F2 - F3) / m2, (F3 - F4) / m3], x_ddot, line=7583, also=(7627,), renamed=no_fourth),
        Formula("q_ddot", [x1_ddot, x2_ddot - x1_ddot, x3_ddot - x2_ddot], c.q_ddot, line=7587, also=(7589, 7591), renamed=in_F),
        Formula("q_n_ddot", [x1_ddot - x0_ddot, x2_ddot - x1_ddot, x3_ddot - x2_ddot], c.q_ddot, line=7593, also=(7627,),
                renamed=in_F),
    ]


CASES = (
    Case("prismatic-newton", "Two bodies that slide on each other, by Newton's law", Slide("5.1", TITLE, 7364), newton),
    Case("prismatic-embedding", "The same by the embedding technique, and three bodies", Slide("5.2", TITLE, 7408), embedding),
    Case("prismatic-inverse", "Inverse dynamics by recursion", Slide("5.3", TITLE, 7478), inverse),
    Case("prismatic-forward", "Forward dynamics by recursion", Slide("5.4", TITLE, 7555), forward, remarks=[Remark(
        "The recursion starts from zero acceleration of the base; x_0 = 0 is printed, without the two "
        "dots. It follows from that where x_0 = 0 at all times.", 7593, (7627,))]),
)
