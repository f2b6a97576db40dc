"""The augmented formulation of a system of bodies: constraints as rows, multipliers as unknowns.

Source: lecture, chapters 3.4 and 6.3.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from symdyn.errors import ModelError, SymdynError
from symdyn.formulation.constraints.absolute import in_absolute_coordinates
from symdyn.formulation.constraints.absolute_start import absolute_start
from symdyn.formulation.constraints.motion import Constrained
from symdyn.formulation.constraints.rows import Gathered
from symdyn.formulation.constraints.solver_choice import choose
from symdyn.formulation.equations import Equations
from symdyn.formulation.printed.augmented import AugmentedEquations
from symdyn.formulation.probes.contradictions import contradictions
from symdyn.formulation.probes.dependent_rows import search
from symdyn.formulation.sensitivities import Sensitive, indices_of_resets
from symdyn.formulation.trees.equations import tree_of, tree_result
from symdyn.formulation.trees.quantities import TreeQuantities
from symdyn.formulation.trees.reactions import reactions
from symdyn.formulation.trees.tree import Tree
from symdyn.model.joints import Joint
from symdyn.model.orientation import EulerAngles, EulerParameters
from symdyn.model.quantity import Quantity
from symdyn.model.record import Model
from symdyn.model.symbols import symbols_of
from symdyn.shown import shown
from symdyn.spatial.vectors import inner, vector, zeros
from symdyn.tape.differentiate import forward, jacobian
from symdyn.tape.node import SEED, is_zero
from symdyn.turning import turns

COORDINATES = ("relative", "absolute")


class ConstrainedTree(Constrained, TreeQuantities):
    """A tree whose loops are closed by constraints."""

    def __init__(self, tree: Tree, gathered: Gathered | None = None, intrinsic: bool = False,
                 independent: tuple[int, ...] | None = None, pivots: tuple[tuple[int, int], ...] | None = None) -> None:
        super().__init__(tree)
        self.gathered = gathered or Gathered(tree)
        self.rows = self.gathered.rows
        self.intrinsic = intrinsic
        self.independent = independent
        self.pivots = pivots
        self.massless_pivots = tree.massless_pivots
        perhaps = [f"{self.speeds[p]}{self.remarks[self.speeds[p]]}" for p in self.massless_pivots]
        self.unheld += f"; perhaps {', '.join(perhaps)}" if perhaps else ""
        if self.gathered.trivial:
            self.notes.append(f"constraints {', '.join(self.gathered.trivial)}: they hold by structure")

    @property
    def prescribed(self) -> list[str]:
        """Joints in loops whose motion is given."""
        model = self.model
        number = {body.name: k for k, body in enumerate(model.bodies)}
        above = {child: (joint, parent) for joint, parent, child in zip(model.joints, model.parents, model.children, strict=True)}

        def path(body: Any) -> set[str]:
            index, names = number.get(getattr(body, "name", body), -1), set()
            while index in above:
                joint, index = above[index]
                names.add(joint.name)
            return names

        inside: set[str] = set().union(*[path(c.joint.parent) ^ path(c.joint.child) for c in self.gathered.closures])
        known = set(model.coordinates)
        return [j.name for j in model.joints if j.name in inside and j.coordinates
                and not any(symbols_of(q) & known for q in j.coordinates)]

    @property
    def reacting(self) -> tuple[Joint, ...]:
        joints = (*super().reacting, *[c.joint for c in self.gathered.closures])
        return tuple(j for j in joints if not j.inner)

    def remaining(self) -> list[Any]:
        return self.gathered.remaining()

    def quantities(self) -> dict[str, Any]:
        own = {"reactions_by_lam": self.reactions_by_lam}
        if self.rows and self._indices_of_resets():
            own["reset_directions"] = self.reset_directions
            own["carried_variation"] = self.carried_variation
        return {**super().quantities(), **own}

    def _indices_of_resets(self) -> list[int]:
        return indices_of_resets(self, self.model.events)

    def carried_variation(self) -> np.ndarray:
        """See Sensitive."""
        return Sensitive(self).carried_variation(self._indices_of_resets())

    def reset_directions(self) -> np.ndarray:
        """Change of [q; u], as far as the constraints let it, by a force along each coordinate and an impulse along each speed
        that events reset, in the order of [q; u], (n, n_q + n_u).

        Along these directions a change of the entry is the smallest in the metric of the mass matrix: M du + C_r^T lam = e_k,
        C_r du = 0.
        """
        recorder, saddle = self.algebra.recorder, self.recall("saddle")
        n_q, n_u, leaves = len(self.coordinates), len(self.speeds), [self.algebra.leaves[u] for u in self.speeds]
        result = zeros(len(self._indices_of_resets()), n_q + n_u)
        with self.algebra.section("directions of resets"):
            for row, k in zip(result, self._indices_of_resets(), strict=True):
                along = zeros(n_u)
                if k < n_q:
                    along[:] = jacobian(recorder, [self.rates[k]], leaves, "forward")[0]
                else:
                    along[k - n_q] = 1
                v = saddle.solve(along, zeros(len(self.rows)))[0]
                if k < n_q:
                    row[:n_q] = forward(recorder, self.rates, dict(zip(leaves, v, strict=True)))
                else:
                    row[n_q:] = v
        return result

    def reactions_by_lam(self) -> np.ndarray:
        """Derivatives of the reactions, row by row, by the multipliers at given accelerations, (6 n_joints, n_c)."""
        recorder = self.algebra.recorder
        lam = vector(*[recorder.leaf(f"lam{k + 1}", SEED) for k in range(len(self.rows))])
        result = self.reactions_of(lam)
        entries = [e for joint in self.reacting for e in result[joint.name]]
        return jacobian(recorder, entries, list(lam), "forward")

    def all_reactions(self, whole: bool = False) -> dict[str, np.ndarray]:
        return self.reactions_of(self.lam(), whole)

    def reactions_of(self, lam: np.ndarray, whole: bool = False) -> dict[str, np.ndarray]:
        """Joint name -> reaction with these multipliers, or whole: cut load."""
        closed = {index for c in self.gathered.closures for index in c.indices}
        other = [k for k in range(len(self.rows)) if k not in closed]
        along = -self.C_r()[other].T @ lam[other] if other else None
        return reactions(self.tree, self.loads, self.kinematics, self.joint_accelerations(), self.gathered.closures, lam, along,
                         whole)

    def measured(self, quantity: Quantity) -> Any:
        if quantity.measure.kind != "multiplier":
            return super().measured(quantity)
        names, name = [row.name for row in self.rows], quantity.measure.of[0]
        if name not in names:
            raise ModelError([f"{quantity} is requested; constraints are {', '.join(names) or 'none'}"], self.model.name)
        return self.lam()[names.index(name)]

    def power(self) -> Any:
        """Power of the loads and drives, and of the constraints that depend on time, W."""
        total, given = super().power(), self.C_t()
        return total if all(is_zero(e) for e in given) else total + inner(self.lam(), given)

    @cached_property
    def length(self) -> Any:
        return self.gathered.length()

    @cached_property
    def lever(self) -> Any:
        return self.gathered.lever()

    @property
    def angular(self) -> list[bool]:
        return [turns(self.model.units.get(u)) for u in self.model.speeds]


def _demand_orientation(model: Model, coordinates: str, orientation: Any) -> None:
    """Raises SymdynError for an orientation that is none, or that nothing takes."""
    if not isinstance(orientation, (EulerAngles, EulerParameters)):
        raise SymdynError(f"orientation is {shown(orientation)}; it describes how bodies turn in absolute coordinates: pass "
                          "sd.EulerParameters() or sd.EulerAngles('ZYX')")
    unused = "coordinates are 'relative'" if coordinates != "absolute" else "the system is planar" if model.planar else ""
    if unused:
        raise SymdynError(f"orientation {type(orientation).__name__} is given, but {unused}: it describes how bodies turn in "
                          "absolute coordinates in space; leave it out" +
                          (", or pass coordinates='absolute'" if coordinates != "absolute" and not model.planar else ""))


def augment(model: Model, coordinates: str = "relative", orientation: Any = None, frames: str = "parallel") -> AugmentedEquations:
    """The augmented equations of a checked model; see System.augmented."""
    if not isinstance(coordinates, str) or coordinates not in COORDINATES:
        raise SymdynError(f"coordinates {shown(coordinates)} asked for; there are {' and '.join(map(repr, COORDINATES))}")
    if orientation is not None:
        _demand_orientation(model, coordinates, orientation)
    again = partial(augment, model, coordinates, orientation, frames)
    if coordinates == "absolute":
        rewritten = in_absolute_coordinates(model, orientation)
        model = replace(rewritten, initial={**rewritten.initial, **absolute_start(model, rewritten)})
    tree = tree_of(model, frames)
    gathered = Gathered(tree)
    names = {"constraints": tuple(r.name for r in gathered.rows), "holonomic": tuple(r.holonomic for r in gathered.rows)}

    def result(quantities: ConstrainedTree, singular_fallback: Equations | None) -> AugmentedEquations:
        return tree_result(quantities, "augmented", AugmentedEquations, again, singular_fallback=singular_fallback, **names)

    if gathered.rows:
        faults = contradictions(result(ConstrainedTree(tree, gathered, True), None))
        if faults:
            raise ModelError(faults, model.name)
    else:  # a tree without constraints, which needs mass in every motion, as in the other formulations
        TreeQuantities(tree).demand_inertia()
    return choose(lambda *way: ConstrainedTree(tree, gathered, *way), result, search)
