"""Arms of one, two and three links by the letters of chapters 5.7 and 5.8, in symbols or in exact numbers.

In exact numbers sizes, masses and angles are fractions, while speeds, accelerations and torques stay symbols: what the slides
multiply becomes polynomials, and two formulas are the same if their polynomials are. In symbols the arm of three links takes a
minute where numbers take a second.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache, cached_property
from typing import Any

import sympy as sp

from symdyn.comparison.case import Erratum, Formula
from symdyn.lecture.propagation_letters import both_sides, evaluated, typeset
from symdyn.model.joints import Revolute
from symdyn.model.symbols import coordinates, inputs, parameters
from symdyn.model.system import System
from symdyn.spatial.sixvectors import motion_transform
from symdyn.spatial.vectors import identity, vector
from symdyn.systems.arms import three_link_arm, two_link_arm

# Sines and cosines of these angles are fractions.
ANGLES = tuple(sp.atan(sp.Rational(a, b)) for a, b in ((3, 4), (5, 12), (8, 15)))


def one_link_arm() -> System:
    """The first link of the two-link arm on its own; parameters and torque as there."""
    (q1,), (tau1,) = coordinates("q1:2"), inputs("tau1:2")
    g, m1, I1, lc1 = parameters("g m1 I1 lc1")
    system = System("one_link_arm", gravity=[0, -g])
    link = system.add_body("link1", mass=m1, inertia=I1, com=[lc1, 0])
    system.add_joint_force(system.add_joint(Revolute("shoulder", system.ground, link, q1)), tau1)
    return system


class Arm:
    """Quantities of the recursive equations by the lecture's letters: X_2, X_star_2, S_2, I_2, c_2, p_2, a_2, f_2, I_A_1 ...

    links   1, 2 (planar, vertical) or 3 (in space)
    exact   fractions for parameters and for sines and cosines of the angles; otherwise all stay symbols
    """

    def __init__(self, links: int, exact: bool = False) -> None:
        self.system = (one_link_arm, two_link_arm, three_link_arm)[links - 1]()
        self.equations = self.system.recursive()
        symbols = self.equations.symbols
        self.numbers: dict[Any, Any] = {}
        if exact:
            self.numbers = {p: sp.Integer(k + 2) for k, p in enumerate(symbols.parameters)}
            self.numbers |= dict(zip(symbols.coordinates, ANGLES))
        self.axes = ("z",) * links if links < 3 else ("z", "y", "x")
        self.q, self.q_dot = list(symbols.coordinates), [q.dot for q in symbols.coordinates]
        self.q_ddot, self.tau = [u.dot for u in symbols.speeds], [sp.Matrix([tau]) for tau in symbols.inputs]

    def __getattr__(self, name: str) -> sp.Matrix:
        if name.startswith("_") or name not in self.equations.quantities:
            raise AttributeError(name)
        value = self.put(sp.Matrix(self.equations.explicit(name, simplify=False)))
        self.__dict__[name] = value
        return value

    def letter(self, name: str) -> Any:
        """Value of a letter of the slides; see propagation_letters."""
        if name.endswith("^T"):
            return self.letter(name[:-2]).T
        if result := re.fullmatch(r"(\d)X(\d)(\*?)", name):
            return getattr(self, f"X_star_{result[2]}" if result[3] else f"X_{result[1]}")
        if result := re.fullmatch(r"q(\d)('{1,2})", name):
            return (self.q_dot if len(result[2]) == 1 else self.q_ddot)[int(result[1]) - 1]
        if result := re.fullmatch(r"tau_(\d)", name):
            return self.tau[int(result[1]) - 1]
        if result := re.fullmatch(r"f(\d)B", name):
            return self.f_B(int(result[1]))
        if result := re.fullmatch(r"([acfpIS])(\d)(A?)", name):
            return getattr(self, "_".join(part for part in (result[1], result[3], result[2]) if part))
        if name in _OF_LINK_2:
            return _OF_LINK_2[name](self)
        return getattr(self, name)

    def put(self, value: sp.Matrix) -> sp.Matrix:
        """With the numbers, multiplied out."""
        return sp.Matrix(value).xreplace(self.numbers).applyfunc(multiplied_out)

    def parameter(self, name: str, link: int) -> Any:
        """A parameter of a link: its number, or its symbol; 0 if the arm has none of that name."""
        named = {p.name: p for p in self.equations.symbols.parameters}
        symbol = named.get(name.replace("#", str(link)), sp.S.Zero)
        return self.numbers.get(symbol, symbol)

    @property
    def a_0(self) -> sp.Matrix:
        """Acceleration of the base that stands for the weights, [0; -g]."""
        return self.put(sp.Matrix([0, 0, 0, *(-sp.sympify(g) for g in self.system.check().gravity)]))

    @cached_property
    def torques(self) -> sp.Matrix:
        """Torques that given accelerations need, (n, 1)."""
        return self.inverse_dynamics + sp.Matrix([tau[0] for tau in self.tau])

    def free(self, *joints: int) -> dict[sp.Symbol, sp.Expr]:
        """Accelerations of these joints under their torques, when those of the others are given."""
        unknown = [self.q_ddot[k - 1] for k in joints]
        rows = self.inverse_dynamics.extract([k - 1 for k in joints], [0])
        matrix = rows.jacobian(unknown)
        solution = -matrix.LUsolve(rows.xreplace(dict.fromkeys(unknown, sp.S.Zero)))
        return dict(zip(unknown, solution.applyfunc(multiplied_out)))

    # -- the frame at the centre of mass, which the slides call b_Gi

    def r_G(self, link: int) -> list[Any]:
        """Centre of mass from O_i in link axes."""
        return [self.parameter("lc#", link), 0, 0]

    def I_Gi(self, link: int) -> sp.Matrix:
        """(3, 3) about the centre of mass."""
        if len(self.axes) < 3:
            return sp.diag(0, 0, self.parameter("I#", link))
        return sp.diag(*(self.parameter(f"I#_{axis}{axis}", link) for axis in "xyz"))

    def I_G(self, link: int) -> sp.Matrix:
        """(6, 6) as chapter 5.6 writes it: the inertia about G_i, and m times the unit matrix."""
        return sp.diag(self.I_Gi(link), self.parameter("m#", link) * sp.eye(3))

    def X_G(self, link: int) -> sp.Matrix:
        """(6, 6) motions from b_i to b_Gi; its transpose takes forces from b_Gi to b_i."""
        return sp.Matrix(motion_transform(identity(), vector(*self.r_G(link))))

    def X_from_G(self, link: int) -> sp.Matrix:
        """(6, 6) motions from b_Gi to b_i."""
        return sp.Matrix(motion_transform(identity(), vector(*(-e for e in self.r_G(link)))))

    def f_B(self, link: int) -> sp.Matrix:
        """(6, 1) resultant on the body alone, about O_i: symdyn's f_G carried there."""
        return (self.X_G(link).T * getattr(self, f"f_G_{link}")).applyfunc(multiplied_out)


@cache
def arm_of(links: int, exact: bool = False) -> Arm:
    """An arm, derived once for all cases."""
    return Arm(links, exact)


_OF_LINK_2: dict[str, Callable[[Arm], sp.Matrix]] = {
    "X": lambda arm: arm.X_2, "X_3*": lambda arm: arm.X_star_3, "S": lambda arm: arm.S_2, "S_ring": lambda arm: arm.S_ring_2,
    "X_G": lambda arm: arm.X_G(2), "X_G*": lambda arm: arm.X_G(2).T, "X_back": lambda arm: arm.X_from_G(2),
    "I_G": lambda arm: arm.I_G(2), "v_G": lambda arm: arm.v_G_2, "a_G": lambda arm: arm.a_G_2, "f_G": lambda arm: arm.f_G_2,
    "f_B": lambda arm: arm.f_B(2),
}


def row(letter: Callable[[str], Any], name: str, line: int, text: str, derived: Any, also: Sequence[int] = (),
        errata: Sequence[Erratum] = (), where: Mapping[Any, Any] | None = None) -> Formula:
    """A formula as the slide writes it in letters, with its entries multiplied out; of an equation `derived` has both sides."""
    printed = both_sides(text, letter) if isinstance(derived, tuple) else evaluated(text, letter)
    return Formula(name, expanded(printed), expanded(derived), line=line, also=tuple(also), errata=tuple(errata),
                   where=where or {}, latex=typeset(text))


def multiplied_out(e: sp.Expr) -> sp.Expr:
    """Products and powers of sums; exponents are integers here, so that SymPy's other rules have nothing to do."""
    return e.expand(power_base=False, power_exp=False, log=False, basic=False)


def expanded(value: Any) -> Any:
    """A matrix or a pair of sides, multiplied out."""
    return tuple(expanded(side) for side in value) if isinstance(value, tuple) else sp.Matrix(value).applyfunc(multiplied_out)
