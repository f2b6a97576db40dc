"""The recursive formulation of a tree: inverse dynamics by Newton-Euler, forward dynamics by articulated bodies, both O(n)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import SymdynError
from symdyn.formulation.accelerations import Solver
from symdyn.formulation.names import OfLink, link_named
from symdyn.formulation.printed.independent_speeds import MotionEquations
from symdyn.formulation.probes.inertia_faults import demand_pivots, joints_by_speed, massless
from symdyn.formulation.textbook.page import Page
from symdyn.formulation.trees.articulated import Articulated
from symdyn.formulation.trees.equations import derive_tree
from symdyn.formulation.trees.inertial_forces import inertial_forces
from symdyn.formulation.trees.quantities import TreeQuantities
from symdyn.formulation.trees.tree import Tree
from symdyn.model.bodies import Body
from symdyn.model.joints import Fixed
from symdyn.model.record import Model
from symdyn.shown import shown
from symdyn.spatial.vectors import zeros
from symdyn.tape.node import is_zero


@dataclass(frozen=True, eq=False, repr=False)
class RecursiveEquations(MotionEquations):
    """tau by Newton-Euler, u_dot by articulated bodies; M_tilde by composite bodies where it is requested.

    links   names of the links, parents first; `link` gives what the lecture's pages name of one

    >>> sd.systems.double_pendulum().recursive().links
    ('rod1', 'rod2')
    """

    links: tuple[str, ...] = ()

    @property
    def tau(self) -> sp.Matrix:
        """(n_u, 1) forces along the speeds that given accelerations need: M_tilde u_dot + k_tilde - F_tilde.

        >>> sd.systems.pendulum().recursive().tau
        Matrix([[l*m*(g*sin(q1) + l*q1_ddot)]])
        """
        return self.explicit("inverse_dynamics")

    @property
    def coriolis(self) -> sp.Matrix:
        """(n_u, n_u) C with C u = k_tilde and M_tilde_dot - 2 C skew-symmetric.

        >>> equations = sd.systems.double_pendulum().recursive()
        >>> sp.simplify(equations.coriolis * sp.Matrix(equations.symbols.speeds) - equations.k_tilde)
        Matrix([
        [0],
        [0]])
        """
        return self.explicit("coriolis")

    @property
    def gravity_load(self) -> sp.Matrix:
        """(n_u, 1) forces along the speeds that hold the weights.

        >>> sd.systems.pendulum().recursive().gravity_load
        Matrix([[g*l*m*sin(q1)]])
        """
        return self.explicit("gravity_load")

    def link(self, which: Body | str | int) -> LinkPage:
        """Quantities of one link on the lecture's pages: the body that a joint moves, its name, or its number from 1.

        Raises SymdynError for a link that is not there.

        >>> sd.systems.pendulum().recursive().link("bob").v.T
        Matrix([[0, 0, q1_dot, 0, 0, 0]])
        """
        name = which.name if isinstance(which, Body) else which
        number = name if isinstance(name, int) else self.links.index(name) + 1 if name in self.links else 0
        if not 1 <= number <= len(self.links):
            there = ", ".join(f"{k + 1} {name}" for k, name in enumerate(self.links))
            raise SymdynError(f"{self.name} has no link {shown(which)}; it has {there} (bodies on fixed joints belong to the "
                              "link "
                              "before them)")
        return LinkPage(self, number)


@dataclass(frozen=True, repr=False)
class LinkPage:
    """One link's X, X_star, S, S_ring, I, v, c, p, a, f, I_A, p_A, v_G, a_G, f_G as explicit SymPy; see recursive.page."""

    equations: RecursiveEquations
    number: int

    def __dir__(self) -> list[str]:
        there = filter(None, map(link_named, self.equations.quantities))
        return sorted(one.letter for one in there if one.number == self.number)

    def __repr__(self) -> str:
        return f"<link {self.number} of {self.equations.name}: {', '.join(dir(self))}>"

    def __getattr__(self, name: str) -> sp.Matrix:
        quantity = OfLink(name, self.number).name
        if name.startswith("__") or quantity not in self.equations.quantities:
            reasons = "".join(f" ({note})" for note in self.equations.notes if note.startswith("no "))
            raise AttributeError(f"link {self.number} has no {name}; it has {', '.join(dir(self))}{reasons}")
        return self.equations.explicit(quantity)


def recursive(model: Model, frames: str = "body") -> RecursiveEquations:
    """The recursive equations of a checked model.

    frames   "body": every link in its own axes; "parallel": in those of the link before where axes stay parallel
    Raises ModelError for constraints and for joints that move no inertia.
    """
    equations = derive_tree(model, "recursive", frames, RecursiveTree, RecursiveEquations)
    joints = [model.ground_motion] if model.ground_motion is not None else []
    moving = [j for j in (*joints, *model.joints) if not isinstance(j, Fixed)]
    return replace(equations, links=tuple(j.child if isinstance(j.child, str) else j.child.name for j in moving))


class RecursiveTree(TreeQuantities):
    """A tree whose accelerations come from articulated bodies.

    Joints that share a speed (gears) cannot be released one by one: a tree with such joints keeps the mass matrix by
    composite bodies, and reports it.
    """

    def __init__(self, tree: Tree) -> None:
        super().__init__(tree)
        self.page = Page(tree, self.loads)
        self.own = _own_speeds(tree)
        self.notes.append("mass matrix: accelerations come from articulated bodies, without it" if self.own is not None else
                          "articulated bodies: a speed moves several joints, or one by a factor, so accelerations come from "
                          "the mass matrix by composite bodies")
        self.notes += self.page.notes if tree.rigid else [
            "no pages of links, Coriolis matrix or center of mass: they are of rigid bodies, without added mass"]

    def quantities(self) -> dict[str, Callable[[], Any]]:
        """name -> function that records it."""
        return {**super().quantities(), **(self.page.quantities() if self.tree.rigid else {})}

    def demand_inertia(self) -> None:
        if self.own is None:
            super().demand_inertia()
            return
        order = {index: k for k, index in enumerate(self.own)}
        # A joint is released after all joints behind it, so what is known of the speeds after its own holds for its pivot.
        sound = self.tree.sound if list(self.own) == sorted(self.own) else ()
        pivots = [(pivot, self.speeds[order[index]]) for index, pivot in self.articulated().pivots
                  if is_zero(pivot) or order[index] not in sound]
        demand_pivots(self.model, self.algebra.recorder, pivots)

    def reasons(self) -> list[str]:
        """Reasons, speed by speed, for S^T I^A S that is not positive."""
        if self.own is None:
            return super().reasons()
        joints = joints_by_speed(self.model)
        return [f"the articulated inertia S^T I^A S is not positive along {u}{self.remarks[u]}" if k in self.vanishing_pivots else
                f"{massless(u, joints.get(u))} (S^T I^A S is not positive){self.remarks.get(u, '')}"
                for k, u in enumerate(self.speeds)]

    def articulated(self) -> Articulated:
        """Articulated inertias of the links, recorded once."""
        return self.recall("_articulated")  # type: ignore[no-any-return]

    def _articulated(self) -> Articulated:
        assert self.own is not None
        reasons = dict(zip(self.own, self.reasons(), strict=True))
        return Articulated(self.tree, reasons, {self.own[k] for k in self.vanishing_pivots})

    def solver(self) -> Solver:
        return super().solver() if self.own is None else _InSpeeds(self.articulated(), self.own)

    def accelerations(self) -> np.ndarray:
        """u_dot, (n_u,): one pass outwards for the motion with w_dot = 0, one inwards, one outwards."""
        if self.own is None:
            return super().accelerations()
        applied = self.loads.applied()
        wrenches, along = inertial_forces(self.tree, self.tree.b, -self.gravity(), applied.wrenches)
        w_dot = self.articulated().solve(applied.joint - along, wrenches)
        return self.algebra.name("ud", w_dot[list(self.own)])


class _InSpeeds:
    """Articulated bodies as solver for forces along the generalized speeds."""

    def __init__(self, articulated: Articulated, own: tuple[int, ...]) -> None:
        self.articulated = articulated
        self.own = list(own)

    def solve(self, right: np.ndarray) -> np.ndarray:
        tau = zeros(len(self.articulated.tree.w))
        tau[self.own] = right
        return self.articulated.solve(tau)[self.own]


def _own_speeds(tree: Tree) -> tuple[int, ...] | None:
    """For each generalized speed the index of the joint speed that it is, or None if joints share speeds or scale them."""
    indices = []
    for column, rows in enumerate(tree.driven):
        factors = [tree.D[row, column] for row in rows]
        if len(factors) != 1 or not isinstance(factors[0], int) or factors[0] != 1:
            return None
        indices.append(rows[0])
    return tuple(indices) if len(set(indices)) == len(indices) else None
