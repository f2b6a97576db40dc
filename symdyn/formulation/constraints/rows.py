"""The constraints of a mechanism as rows: C = 0 or A u + b = 0, their Jacobian in the speeds, and F_d of C_r u_dot = F_d.

F_d = -(d/dt C_r) u - (d/dt C_t): of joints from the recursion of accelerations with u_dot = 0, of expressions by
differentiating the tape by time, first everything by the chain rule and numbers afterwards.
Source: lecture, chapters 3.4 and 6.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import ModelError
from symdyn.formulation.constraints.closures import ClosureRow, closure_rows
from symdyn.formulation.loads.recorded import Loads
from symdyn.formulation.trees.relative import End, Relative, common_link
from symdyn.formulation.trees.tree import GROUND, Pose, Tree
from symdyn.model.closures import Constraint, Gear, Rod
from symdyn.model.joints import Joint
from symdyn.model.orientation import EulerParameters
from symdyn.model.quantity import of_speeds
from symdyn.model.symbols import Coordinate, symbols_of
from symdyn.model.uses import unit_of
from symdyn.spatial.vectors import dot, inner, vector
from symdyn.tape.differentiate import forward
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.node import INPUT, PARAMETER, TIME, Node, is_zero
from symdyn.tape.tape import Tape

# Values that are smaller at STATES random states are zero but for rounding: lengths in m, directions.
ROUNDING = 1e-13
STATES = 3


@dataclass(frozen=True)
class Row:
    """One constraint.

    value      C, 0 of a velocity constraint; jacobian (n_u,); rate: C_dot; remaining: C_ddot with u_dot = 0
    unit       "m", "rad" or "m^2", ... of the value, "" if unknown
    holonomic  whether it holds positions
    """

    name: str
    value: Any
    jacobian: np.ndarray
    rate: Any
    remaining: Any
    unit: str = ""
    holonomic: bool = True


@dataclass(frozen=True)
class Closure:
    """A joint that closes a loop: its ends seen from the base link, its rows, and the indices of these among all rows."""

    joint: Joint
    base: int
    seen: Relative
    parent: End
    child: End
    rows: tuple[ClosureRow, ...]
    indices: tuple[int, ...]


class Gathered:
    """Rows and closures of a tree, in the order of declaration: loops, then expressions; what holds by structure is left out.

    trivial   names of rows that hold by structure, at every state
    Raises ModelError for rows that nothing can fulfil or that move nothing.
    """

    def __init__(self, tree: Tree) -> None:
        self.tree, self.model, self.algebra = tree, tree.model, tree.algebra
        self.rows: list[Row] = []
        self.closures: list[Closure] = []
        self.trivial: list[str] = []
        self.faults: list[str] = []
        self._seen: dict[int, Relative] = {}
        loads = Loads(tree)
        for loop in self.model.loops:
            with self.algebra.section(f"constraints of {loop.kind} {loop.name}"):
                if isinstance(loop, Gear):
                    self._gear(loop)
                else:
                    self._closure(loop, loads)
        for constraint in self.model.constraints:
            with self.algebra.section(f"constraint {constraint.name}"):
                self._expression(constraint)
        if self.faults:
            raise ModelError(self.faults, self.model.name)

    def length(self) -> Any:
        """The mechanism's length, m: root of the sum of squares of all distances of joints, else of centres of mass, else of
        parameters that are lengths, as long as these are not zero; else 1 m."""
        a = self.algebra
        with a.section("length of the mechanism"):
            total: Any = 0
            joints = [*self.model.joints, *(j for j in self.model.loops if isinstance(j, Joint))]
            for point in [p for j in joints for p in (j.parent_point, j.child_point)]:
                total = total + dot(*(2 * [a.constants(point)]))
            for rod in (j for j in joints if isinstance(j, Rod)):
                total = total + a.expression(rod.length) ** 2
            if is_zero(total):
                for body in self.model.bodies:
                    total = total + dot(*(2 * [a.constants(body.com)]))
            if is_zero(total):
                for p in self.model.parameters:
                    if self.model.units.get(p) == "m":
                        total = total + a.expression(p) ** 2
                if not is_zero(total):
                    apply = a.recorder.apply
                    total = apply("select", apply("gt", total, 0), total, 1)
            return 1 if is_zero(total) else a.name("length", a.sqrt(total))

    def lever(self) -> Any:
        """Length by which angular speeds are multiplied to compare them with others, m: root mean square of the distances of
        points of joints on a moving body from the joint that carries it, else of centres of mass, else the length.

        Neither the place of a mechanism nor the number of its bodies enters it, as both enter the length.
        """
        a = self.algebra
        with a.section("length of a lever"):
            carried = {self._name(j.child): a.constants(j.child_point) for j in self.model.joints}
            joints = [*self.model.joints, *(j for j in self.model.loops if isinstance(j, Joint))]
            ends = [(self._name(body), point) for j in joints
                    for body, point in ((j.parent, j.parent_point), (j.child, j.child_point))]
            squares = [dot(arm, arm) for body, point in ends if body in carried for arm in [a.constants(point) - carried[body]]]
            if all(map(is_zero, squares)):
                squares = [dot(arm, arm) for body in self.model.bodies if body.name in carried
                           for arm in [a.constants(body.com) - carried[body.name]]]
            squares = [square for square in squares if not is_zero(square)]
            if not squares:
                return self.length()
            mean = sum(squares[1:], squares[0]) * Fraction(1, len(squares))
            if isinstance(mean, Node):
                length, apply = self.length(), a.recorder.apply
                mean = apply("select", apply("gt", mean, 0), mean, length * length)
            return a.name("lever", a.sqrt(mean))

    @staticmethod
    def _name(body: Any) -> str:
        return str(getattr(body, "name", body))

    # -- each kind

    def _closure(self, joint: Joint, loads: Loads) -> None:
        a = self.algebra
        poses = loads.pose(joint.parent), loads.pose(joint.child)
        base = common_link(self.tree, *(pose.link for pose in poses))
        seen = self._seen.setdefault(base, Relative(self.tree, base))
        P, Q = self._ends(seen, joint, poses)
        kept, indices = [], []
        for row in closure_rows(a, joint, P, Q, self.model.planar):
            along = row.along(P, Q)
            jacobian = self.tree.by_speeds(along[None])[0]
            unit = "m" if row.length else "rad"
            full = Row(row.label, row.value, jacobian, inner(along, self.tree.w), row.remaining(P, Q), unit)
            if self._add(full, closes=True):
                kept.append(row)
                indices.append(len(self.rows) - 1)
        self.closures.append(Closure(joint, base, seen, P, Q, tuple(kept), tuple(indices)))

    def _ends(self, seen: Relative, joint: Joint, poses: Sequence[Pose]) -> tuple[End, End]:
        a = self.algebra
        P, Q = (seen.end(pose, a.constants(point), a.matrix(rotation)) for pose, point, rotation in
                zip(poses, (joint.parent_point, joint.child_point), (joint.parent_rotation, joint.child_rotation), strict=True))
        return P, Q

    def remaining(self) -> list[Any]:
        """C_ddot with u_dot = 0 of every row, without the weight that goes in and out again: to be read."""
        result = [row.remaining for row in self.rows]
        seen = Relative(self.tree, GROUND, weight=False)
        for closure in self.closures:
            if closure.base == GROUND:
                with self.algebra.section(f"constraints of {closure.joint.kind} {closure.joint.name}"):
                    P, Q = self._ends(seen, closure.joint, (closure.parent.pose, closure.child.pose))
                    for row, index in zip(closure.rows, closure.indices, strict=True):
                        result[index] = row.remaining(P, Q)
        return result

    def _gear(self, gear: Gear) -> None:
        joints = {j.name: j for j in self.model.joints}
        a, b = (joints[end] if isinstance(end, str) else end for end in (gear.joint_a, gear.joint_b))
        expression = b.coordinates[0] - gear.ratio * a.coordinates[0] - gear.offset
        self._expression(Constraint(gear.name, expression))

    def _expression(self, constraint: Constraint) -> None:
        model = self.model
        row = expression_row(self.algebra, constraint, model.coordinates, self.tree.rates, model.speeds, model.own_speeds)
        self._add(replace(row, unit=unit_of(constraint.expression, self.model.units)))

    def _add(self, row: Row, closes: bool = False) -> bool:
        """Take a row, unless it holds by structure; closes: one of a joint that closes a loop, which may hold by numbers, too."""
        if not closes and any(not is_zero(e) for e in row.jacobian):
            self.rows.append(row)
            return True
        numbers = self._at([row.value if row.holonomic else row.rate, row.rate, *row.jacobian])
        if not (np.abs(numbers[:, 2:]) <= ROUNDING).all():
            self.rows.append(row)
            return True
        if (np.abs(numbers) <= ROUNDING).all():
            self.trivial.append(row.name)
            return False
        what = row.value if row.holonomic else row.rate
        mask = what.mask if isinstance(what, Node) else 0
        if np.ptp(numbers[:, 0]) > ROUNDING:
            self.faults.append(f"{row.name} holds nothing: its derivatives by all coordinates and speeds vanish at every state; "
                               "remove it, or correct it")
        elif mask & (TIME | INPUT):
            self.faults.append(f"{row.name} holds what is prescribed as a function of time: no coordinate of the system is in "
                               "it; remove it, or replace the prescribed motion by a coordinate")
        elif mask & PARAMETER:
            self.faults.append(f"{row.name} is an equation between parameters alone, which no motion of the system changes; "
                               "remove it, or choose points and axes so that it holds by itself")
        else:
            self.faults.append(f"{row.name} demands {numbers[0, 0]:.6g} = 0, which no motion of the system changes: it "
                               "contradicts the other joints; remove it, or correct the points and axes")
        return False

    def _at(self, values: Sequence[Any]) -> np.ndarray:
        """Values at a few random states, (s, n), at one time and with random parameters near their defaults."""
        if not any(isinstance(v, Node) for v in values):
            return np.array([[float(v) for v in values]])
        tape = Tape.of(self.algebra.recorder, values=np.array(list(values), dtype=object))
        stream = np.random.default_rng(3)
        parameters = {p.name: float(v) for p, v in self.model.defaults.items()}
        numbers: dict[str, Any] = {}
        for leaf in tape.inputs:
            moving = leaf.mask & ~(TIME | INPUT | PARAMETER)
            name, drawn = leaf.args[1], stream.uniform(0.2, 1.2, STATES if moving else None)
            numbers[name] = parameters[name] * (1 + drawn / 100) if parameters.get(name) else drawn
        for joint in (j for j in self.model.joints if isinstance(getattr(j, "orientation", None), EulerParameters)):
            group = [q.name for q in joint.coordinates[-4:] if q.name in numbers]
            norm = np.sqrt(sum(numbers[name] ** 2 for name in group))
            numbers.update({name: numbers[name] / norm for name in group})
        return evaluate_rows(tape, numbers, STATES)["values"]


def expression_row(algebra: Any, constraint: Constraint, coordinates: Sequence[sp.Symbol], rates: Sequence[Any],
                   speeds: Sequence[sp.Symbol], own: Sequence[sp.Symbol] = ()) -> Row:
    """The row of an expression in coordinates and t, or with speeds, linear in them; own: those of joints, where others are "
    "chosen."""
    by_time = algebra.by_time(coordinates, rates)
    recorder = algebra.recorder
    value = algebra.expression(constraint.expression)
    moving = {*speeds, *own, *[q.dot for q in coordinates if isinstance(q, Coordinate)]}
    symbols = symbols_of(constraint.expression)
    holonomic = not symbols & moving and not any(map(of_speeds, symbols))
    rate = forward(recorder, [value], by_time)[0] if holonomic else value
    jacobian = vector(*[forward(recorder, [rate], {algebra.leaves[u]: 1})[0] for u in speeds])
    remaining = forward(recorder, [rate], by_time)[0]
    return Row(constraint.name, value if holonomic else 0, jacobian, rate, remaining, "", holonomic)
