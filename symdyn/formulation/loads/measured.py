"""Points, orientations and distances of a tree as scalars in expressions, recorded from its recursion where they stand.

Rates follow from the values by the chain rule over the tape; velocities of points from the recursion of the velocities of links.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from symdyn.errors import ModelError
from symdyn.formulation.loads.recorded import Loads
from symdyn.formulation.trees.kinematics import Kinematics
from symdyn.formulation.trees.tree import Tree
from symdyn.model.quantity import Quantity
from symdyn.spatial.vectors import zeros
from symdyn.tape.differentiate import forward


class Measured:
    """Records quantities that follow from coordinates and speeds."""

    def __init__(self, tree: Tree) -> None:
        self.tree, self.algebra = tree, tree.algebra
        self.kinematics = Kinematics(tree)
        self.loads = Loads(tree, self.kinematics)

    def __call__(self, quantity: Quantity) -> Any:
        """The value of a quantity, recorded. Raises ModelError for what takes accelerations or forces."""
        measure = quantity.measure
        if quantity.level == 2:
            raise ModelError([f"{quantity} follows from the forces, which are not known here"], self.tree.model.name)
        if measure.kind == "position" and measure.order == 1:
            return self._velocity(quantity)
        if measure.order:
            value = self.algebra.expression(Quantity(replace(measure, order=0)))
            by_time = self.algebra.by_time(self.tree.model.coordinates, self.tree.rates)
            return forward(self.algebra.recorder, [value], by_time)[0]
        if measure.kind == "distance":
            return self._distance(quantity)
        pose = self.loads.pose(measure.of[0])
        if measure.kind == "position":
            return self.kinematics.position(pose, self.algebra.constants(measure.points[0]))[measure.index[0]]
        if measure.kind == "rotation_matrix":
            return self.kinematics.rotation(pose)[measure.index]
        return self.kinematics.twist(pose, zeros(3))[0][measure.index[0]]

    def _velocity(self, quantity: Quantity) -> Any:
        measure = quantity.measure
        pose, at = self.loads.pose(measure.of[0]), self.algebra.constants(measure.points[0])
        return self.kinematics.twist(pose, at)[1][measure.index[0]]

    def _distance(self, quantity: Quantity) -> Any:
        (a, b), points = quantity.measure.of, quantity.measure.points
        return self.loads.separation(str(quantity), (a, b), points)[1]
