"""Link 2 of an arm in space, with every vector that chapter 5.6 names, so that its formulas can be compared term by term.

The slides draw an arm in the plane, but write vectors of space. In the plane all angular velocities are parallel and many
products vanish, and with them the errors of a formula; so link 1 gets a base that turns and lifts it, and a level axis.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache, cached_property
from typing import Any

import sympy as sp

import symdyn as sd
from symdyn.comparison.case import Formula
from symdyn.model.symbols import symbols_of

# Orientation of joint 1 on the base: its axis lies level.
SEAT_1 = sp.Matrix([[1, 0, 0], [0, 0, -1], [0, 1, 0]])


class Letters:
    """Symbols for the components of the vectors and matrices that slides print, and what each stands for.

    A name such as "b2_omega_b2_b1" or "b1_v_O1_dot" says, as the slide does, the axes, the letter, the indices and a dot.
    """

    def __init__(self) -> None:
        self.values: dict[str, sp.Expr] = {}

    def vector(self, name: str, value: Sequence[Any]) -> sp.Matrix:
        """Three symbols, which are typeset as on the slide, for the components of a vector."""
        return self._named([typeset(name, axis) for axis in "xyz"], sp.Matrix(value))

    def matrix(self, name: str, value: sp.Matrix) -> sp.Matrix:
        """Nine symbols for the entries of a matrix."""
        return self._named([typeset(name, i + j) for i in "xyz" for j in "xyz"], sp.Matrix(value)).reshape(3, 3)

    def _named(self, names: list[str], value: sp.Matrix) -> sp.Matrix:
        self.values |= dict(zip(names, value, strict=True))
        return sp.Matrix([sp.Symbol(name) for name in names])

    def formula(self, name: str, printed: Any, derived: Any, line: int, **options: Any) -> Formula:
        """A formula in these symbols; see Formula."""
        parts = printed if isinstance(printed, tuple) else (printed,)
        used = {str(s) for part in parts for s in symbols_of(sp.Matrix(part))}
        renamed = {name: self.values[name] for name in used if name in self.values}
        return Formula(name, printed, derived, line=line, renamed=renamed, **options)


def typeset(name: str, place: str) -> str:
    """The entry of a vector or matrix in LaTeX: "b2_omega_b2_b1" at x is {}^{b_2}\\omega_{b_2/b_1,x}."""
    axes, letter, *indices = (re.sub(r"^(b|O|G)(.+)$", r"\1_{\2}", part) for part in name.split("_"))
    letter = rf"\{letter}" if letter in ("omega", "alpha") else letter
    if indices and indices[-1] == "dot":
        letter, indices = rf"\dot{{{letter}}}", indices[:-1]
    return rf"{{}}^{{{axes}}}{letter}_{{{'/'.join(indices)},{place}}}"


class ArmInSpace(Letters):
    """Frames n, b1, b2, bG2, the recursion, and symbols for the vectors that slides print; no weight.

    A base turns by q_a about z and rises by s_a, link 1 turns by q1 about its z, which lies level, in O_1, link 2 by q2
    about its z in O_2. The frame bG2 at G_2 is turned against b2 by gamma.
    """

    def __init__(self) -> None:
        super().__init__()
        q_a, s_a, q1, q2 = sd.coordinates("q_a s_a q1 q2")
        gamma, m0, I0, m1, m2, d, l1, h1, c2, e2 = sd.parameters("gamma m0 I0 m1 m2 d l1 h1 c2 e2")
        self.m2, self.q2 = m2, q2
        r_O1, self.r_O2, self.r_G2 = (sp.Matrix(r) for r in ([d, 0, 0], [l1, 0, h1], [c2, 0, e2]))
        xx, xy, xz, yy, yz, zz = sd.parameters("I2_xx I2_xy I2_xz I2_yy I2_yz I2_zz")
        self.I2 = sp.Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

        self.n = sd.Frame("n")
        base = self.n.frame("base", rotation=sd.rotation.about("Z", q_a), origin=[0, 0, s_a])
        self.b1 = base.frame("b1", rotation=SEAT_1 * sd.rotation.about("Z", q1), origin=list(r_O1))
        self.b2 = self.b1.frame("b2", rotation=sd.rotation.about("Z", q2), origin=list(self.r_O2))
        self.bG2 = self.b2.frame("bG2", rotation=sd.rotation.about("X", gamma), origin=list(self.r_G2))

        self.system = sd.System("arm_in_space")
        column = self.system.add_body("base", mass=m0, inertia=[I0, I0, I0])
        link1 = self.system.add_body("link1", mass=m1)
        link2 = self.system.add_body("link2", mass=m2, inertia=self.I2, com=list(self.r_G2))
        self.system.add_joint(sd.Cylindrical("lift", self.system.ground, column, [q_a, s_a]))
        self.system.add_joint(sd.Revolute("joint1", column, link1, q1, parent_point=list(r_O1), parent_rotation=SEAT_1))
        self.system.add_joint(sd.Revolute("joint2", link1, link2, q2, parent_point=list(self.r_O2)))
        self.known: dict[str, sp.ImmutableMatrix] = {}

    @cached_property
    def equations(self) -> Any:
        return self.system.recursive()

    def of_link2(self, name: str) -> sp.Matrix:
        """A quantity of link 2 from the recursion, as recorded: components in b2, about O_2."""
        if name not in self.known:
            self.known[name] = sp.ImmutableMatrix(self.equations.explicit(f"{name}_3", simplify=False))
        return sp.Matrix(self.known[name])


@cache
def arm_in_space() -> ArmInSpace:
    """The arm, derived once for all cases; a letter has the same value in all of them."""
    return ArmInSpace()


def cross(*factors: sp.Matrix) -> sp.Matrix:
    """a x b x c, read from the left as the slides do: (a x b) x c."""
    product = factors[0]
    for factor in factors[1:]:
        product = product.cross(factor)
    return product


def tilde(v: sp.Matrix) -> sp.Matrix:
    """The matrix of v x."""
    return sp.Matrix(sd.rotation.skew(v))


def block(rows: Sequence[Sequence[Any]]) -> sp.Matrix:
    """Blocks side by side; a 0 is a zero block of 3 x 3, in a column one of 3 x 1."""
    def filled(entry: Any, width: int) -> sp.Matrix:
        return sp.zeros(3, width) if not isinstance(entry, sp.MatrixBase) else entry

    widths = [max(e.cols for e in column if isinstance(e, sp.MatrixBase)) for column in zip(*rows, strict=True)]
    return sp.Matrix.vstack(*[sp.Matrix.hstack(*[filled(e, w) for e, w in zip(row, widths, strict=True)]) for row in rows])
