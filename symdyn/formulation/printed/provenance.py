"""Where entries of M_tilde and k_tilde come from: each body's share, by name.

M_tilde = sum of J_v^T m J_v + J_omega^T I J_omega, k_tilde = sum of J_v^T m a + J_omega^T (I alpha + omega x I omega), with a
and alpha the accelerations that remain when u_dot = 0. Source: lecture, chapters 3.2 and 6.2 (k_tilde = J^T (M J_dot u + Q J u)).
The accelerations that remain are quadratic in the speeds: squares are centrifugal, products of two speeds Coriolis, and omega x I
omega is gyroscopic; given motions of joints or of the ground add a part of their own.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import sympy as sp

from symdyn.errors import SymdynError
from symdyn.kinds import flag
from symdyn.shown import shown
from symdyn.spatial.vectors import cross, inner
from symdyn.tape.differentiate import reverse
from symdyn.tape.node import Node, is_zero
from symdyn.tape.sympy_bridge import expand
from symdyn.tape.tape import Output

if TYPE_CHECKING:
    from symdyn.formulation.by_hand.embedding import PositionMap
    from symdyn.formulation.printed.independent_speeds import MotionEquations
    from symdyn.formulation.trees.quantities import TreeQuantities

EXPLAINED = {"M_tilde": 2, "k_tilde": 1}


@dataclass(frozen=True)
class Contribution:
    """Contribution of one body to an entry.

    body     its name; for equations from a position map the Cartesian coordinate, "r_1" for the first
    motion   "translational" or "rotational" ("" for Cartesian coordinates, which may be either)
    kind     of k_tilde: "centrifugal", "Coriolis", "gyroscopic" or "given motion"; of M_tilde: ""
    """

    body: str
    motion: str
    kind: str
    value: sp.Expr

    @property
    def title(self) -> str:
        return " ".join(part for part in (self.motion, self.kind) if part)


@dataclass(frozen=True, repr=False)
class Explanation:
    """An entry of M_tilde or k_tilde as the sum of its contributions; those that vanish are left out."""

    quantity: str
    index: tuple[int, ...]
    contributions: tuple[Contribution, ...]

    @property
    def total(self) -> sp.Expr:
        """The entry itself, the sum of the contributions."""
        return sp.Add(*[c.value for c in self.contributions])

    def of(self, body: str | None = None, motion: str | None = None, kind: str | None = None) -> sp.Expr:
        """The sum of the contributions of one body, motion or kind, or of any of these together."""
        return sp.Add(*[c.value for c in self.contributions
                        if body in (None, c.body) and motion in (None, c.motion) and kind in (None, c.kind)])

    def __str__(self) -> str:
        head = f"{self.quantity}[{', '.join(map(str, self.index))}]"
        if not self.contributions:
            return f"{head} = 0: nothing contributes"
        body = max(len(c.body) for c in self.contributions)
        title = max(len(c.title) for c in self.contributions)
        lines = [f"  {c.body:{body}}  {c.title:{title}}  {c.value}" for c in self.contributions]
        return "\n".join([f"{head} is the sum of", *lines])

    def __repr__(self) -> str:
        return str(self)

    def _repr_latex_(self) -> str:
        letter, index = self.quantity[0], ",".join(str(i + 1) for i in self.index)
        terms = " + ".join(rf"\underbrace{{{sp.latex(c.value)}}}_{{\text{{{_label(c)}}}}}" for c in self.contributions)
        return rf"$\displaystyle \tilde{{{letter}}}_{{{index}}} = {terms or 0}$"


def _label(contribution: Contribution) -> str:
    return f"{contribution.body}, {contribution.title}".removesuffix(", ").replace("_", r"\_")


def explain(equations: MotionEquations, quantity: str, *index: int, simplify: bool = True) -> Explanation:
    """The contributions to one entry of M_tilde or k_tilde; indices count from 0.

    Raises SymdynError for another quantity, an index that is not there, and equations that know no bodies.
    """
    flag(simplify, "simplify")
    if not isinstance(quantity, str) or quantity not in EXPLAINED:
        raise SymdynError(f"explain takes M_tilde (with row and column) or k_tilde (with a row), found {shown(quantity)}")
    if equations.provenance is None:
        raise SymdynError(f"the {equations.formulation} equations of {equations.name} were given in their coordinates, so no "
                          "bodies contribute; explain is for systems and for embedding from a position map")
    n, wanted = len(equations.symbols.speeds), EXPLAINED[quantity]
    if len(index) != wanted or not all(isinstance(i, (int, np.integer)) and 0 <= i < n for i in index):
        needed = "a row and a column" if wanted == 2 else "a row"
        raise SymdynError(f"{quantity} of {equations.name} takes {needed} from 0 to {n - 1}, found "
                          f"{', '.join(map(shown, index))}")
    source: Provenance = equations.provenance
    parts = source.mass(*index) if quantity == "M_tilde" else source.velocity(*index)
    result = []
    for body, motion, kind, node in parts:
        if is_zero(node):
            continue
        value = expand(Output.of("value", node), equations.printed_leaves())
        if simplify:
            from symdyn.report.simplify import simplified

            value = simplified(value, equations.simplify_seconds)
        if value != 0:
            result.append(Contribution(body, motion, kind, value))
    return Explanation(quantity, tuple(int(i) for i in index), tuple(result))


Part = tuple[str, str, str, Any]


class Provenance(Protocol):
    """Records contributions: body, motion, kind, node."""

    def mass(self, i: int, j: int) -> list[Part]: ...

    def velocity(self, i: int) -> list[Part]: ...


class OfBodies:
    """Contributions of the bodies of a tree."""

    def __init__(self, quantities: TreeQuantities) -> None:
        self.of = quantities

    def mass(self, i: int, j: int) -> list[Part]:
        parts: list[Part] = []
        for body, J, mass, inertia in self._bodies():
            parts.append((body.name, "translational", "", mass * inner(J[:3, i], J[:3, j])))
            parts.append((body.name, "rotational", "", inner(J[3:, i], inertia @ J[3:, j])))
        return parts + self._rest("M_tilde", (i, j), parts)

    def velocity(self, i: int) -> list[Part]:
        parts: list[Part] = []
        omegas = self._angular_velocities()
        for (body, J, mass, inertia), acceleration, omega in zip(self._bodies(), self.of.kinematics.bias(), omegas, strict=True):
            own = ((body.name, "translational", mass * inner(J[:3, i], acceleration[:3])),
                   (body.name, "rotational", inner(J[3:, i], inertia @ acceleration[3:])))
            for name, motion, node in own:
                parts += _by_speeds(self.of, name, motion, node)
            parts.append((body.name, "rotational", "gyroscopic", inner(J[3:, i], cross(omega, inertia @ omega))))
        return parts + self._rest("k_tilde", (i,), parts)

    def _rest(self, quantity: str, index: tuple[int, ...], parts: list[Part]) -> list[Part]:
        """Contributions of added mass and of the deflection of elastic bodies: all that rigid bodies do not."""
        if self.of.tree.rigid:
            return []
        whole = self.of.recall(quantity)[index]
        return [("added mass and deflection", "", "", whole - sum((node for *_, node in parts), 0))]

    def _bodies(self) -> Iterable[tuple[Any, np.ndarray, Any, np.ndarray]]:
        """Body, J in the n-frame (6, n_u), mass, inertia about the centre of mass in n-frame axes."""
        of, algebra = self.of, self.of.algebra
        for pose, body in zip(of.tree.poses, of.model.bodies, strict=True):
            J = of.tree.by_speeds(of.kinematics.jacobian(pose, algebra.constants(body.com)))
            R = of.kinematics.rotation(pose)
            yield body, J, algebra.expression(body.mass), R @ algebra.matrix(body.inertia) @ R.T

    def _angular_velocities(self) -> list[np.ndarray]:
        of = self.of
        return [of.kinematics.jacobian(pose, of.algebra.constants(body.com))[3:] @ of.tree.w
                for pose, body in zip(of.tree.poses, of.model.bodies, strict=True)]


class OfCoordinates:
    """Contributions of the Cartesian coordinates of a position map."""

    def __init__(self, quantities: PositionMap) -> None:
        self.of = quantities

    def mass(self, i: int, j: int) -> list[Part]:
        J, M = self.of.J(), self.of.M
        return [(name, "", "", J[k, i] * inner(M[k], J[:, j])) for k, name in enumerate(self._names())]

    def velocity(self, i: int) -> list[Part]:
        J, force = self.of.J(), self.of.M @ self.of.Jd_qd()
        return [part for k, name in enumerate(self._names()) for part in _by_speeds(self.of, name, "", J[k, i] * force[k])]

    def _names(self) -> list[str]:
        return [f"r_{k + 1}" for k in range(len(self.of.r))]


def _by_speeds(of: Any, body: str, motion: str, node: Any) -> list[Part]:
    """A part of k_tilde by how it depends on the speeds."""
    if not isinstance(node, Node):
        return [(body, motion, "given motion", node)]
    recorder = of.algebra.recorder
    u: Sequence[Node] = [of.algebra.leaves[s] for s in of.speeds]
    gradient = reverse(recorder, node, u)
    second = [reverse(recorder, g, u) for g in gradient]
    n = len(u)
    squares = inner([second[j][j] * u[j] for j in range(n)], u) / 2
    products: Any = 0
    for j in range(n):
        for k in range(j):
            products = products + second[j][k] * u[j] * u[k]
    parts: list[Part] = [(body, motion, "centrifugal", squares), (body, motion, "Coriolis", products)]
    if of.given_motion:
        parts.append((body, motion, "given motion", node - squares - products))
    return parts


__all__ = ["Contribution", "Explanation", "OfBodies", "OfCoordinates", "explain"]
