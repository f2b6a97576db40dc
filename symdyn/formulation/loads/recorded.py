"""Loads on the tape: wrenches on links, forces along joint speeds, springs and their potential."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import ModelError
from symdyn.formulation.loads.implicit import Settled, implicit
from symdyn.formulation.loads.site import BodySite
from symdyn.formulation.trees.flexible import FlexibleLink
from symdyn.formulation.trees.kinematics import Kinematics
from symdyn.formulation.trees.tree import GROUND, Pose, Tree
from symdyn.model.bodies import Body
from symdyn.model.elements import Action, Element, Validity
from symdyn.model.joints.modal import exactly
from symdyn.model.loads import Force, ForceBetween, JointForce, SpringDamper, Torque, expressions_of
from symdyn.model.quantity import Quantity, quantities_in
from symdyn.spatial.vectors import cross, dot, vector, zeros
from symdyn.tape.differentiate import forward
from symdyn.tape.node import SEED, Node, exact, is_zero
from symdyn.tape.tape import reachable

# Deflection of a beam's free end, by its length, that counts as large.
FAR = 0.2


@dataclass
class Applied:
    """Loads on a tree: a wrench (f, n about the origin, link axes) for each link, a force for each joint speed.

    poses    of the bodies; bodies: the same wrenches body by body, about the origins and in the axes of their links
    """

    wrenches: list[tuple[np.ndarray, np.ndarray]]
    joint: np.ndarray
    poses: tuple[Pose, ...]
    bodies: list[tuple[np.ndarray, np.ndarray]]

    def add(self, pose: Pose, f: np.ndarray, n: np.ndarray) -> None:
        """Add a wrench about the link's origin, link axes."""
        self.at_body(pose, f, n)
        if pose.link != GROUND:
            force, moment = self.wrenches[pose.link]
            self.wrenches[pose.link] = (force + f, moment + n)

    def at_body(self, pose: Pose, f: np.ndarray, n: np.ndarray) -> None:
        """Add it to the body alone; the ground's is dropped."""
        for k, own in enumerate(self.poses):
            if own is pose:
                force, moment = self.bodies[k]
                self.bodies[k] = (force + f, moment + n)


class Loads:
    """Records the loads of a model on its tree."""

    def __init__(self, tree: Tree, kinematics: Kinematics | None = None, settle: Callable[[], Settled] | None = None,
                 touching: Callable[[], Mapping[Quantity, Any]] | None = None) -> None:
        """settle     gives the values of loads that depend on accelerations, multipliers and reactions
        touching   gives the forces of rigid contacts; None, of both: leaves stand for them
        """
        self._touching = touching
        self.tree = tree
        self._settle = settle
        self.kinematics = kinematics or Kinematics(tree)
        self.algebra = tree.algebra
        self.model = tree.model
        self._actions: dict[int, Action] = {}

    def applied(self, conservative: bool = True, other: bool = True) -> Applied:
        """All loads but gravity; conservative are springs, elastic bodies, and what elements have a potential for."""
        result = self._nothing()
        for load in self.model.loads:
            self._add(result, load, conservative, other)
        for body in self.tree.flexible:
            with self.algebra.section(f"link {self.tree.links[body.link].name}: elastic forces and damping"):
                indices = slice(body.speeds.start, body.speeds.stop)
                if conservative:
                    result.joint[indices] -= body.stiffness @ body.eta
                if other:
                    result.joint[indices] -= body.damping @ body.eta_dot
        return result

    def of_one(self, load: Any) -> Applied:
        """One load alone."""
        result = self._nothing()
        self._add(result, load, True, True)
        return result

    def _nothing(self) -> Applied:
        return Applied([(zeros(3), zeros(3)) for _ in self.tree.links], zeros(len(self.tree.w)), self.tree.poses,
                       [(zeros(3), zeros(3)) for _ in self.tree.poses])

    def _add(self, result: Applied, load: Any, conservative: bool, other: bool) -> None:
        with self.algebra.section(f"load {load.label}"):
            if isinstance(load, SpringDamper):
                self._spring(result, load, conservative, other)
            elif isinstance(load, Element):
                self._element(result, load, conservative, other)
            elif other and isinstance(load, Force):
                self._force(result, load)
            elif other and isinstance(load, Torque):
                self._torque(result, load)
            elif other and isinstance(load, JointForce):
                self._joint(result, load)
            elif other and isinstance(load, ForceBetween):
                self._between(result, load)

    def potential(self) -> Any:
        """Potential energy of springs, elements and elastic bodies, J."""
        total: Any = 0
        for body in self.tree.flexible:
            total = total + body.strain_energy()
        for load in self.model.loads:
            if isinstance(load, Element):
                total = total + self._action(load).potential
            elif isinstance(load, SpringDamper) and load.is_elastic(self.model.parameters):
                with self.algebra.section(f"load {load.label}"):
                    stretch = self._line(load)[1] - self.algebra.expression(load.length)
                    total = total + self.algebra.expression(load.stiffness) * (stretch * stretch) / 2
        return total

    def validity_checks(self) -> list[Validity]:
        """Validity checks of elements and compliant contacts, and of how far elastic bodies bend."""
        actions = [self._action(load) for load in self.model.loads if isinstance(load, Element)]
        result = [validity for action in actions for validity in action.validity_checks]
        result += [self._bending(body) for body in self.tree.flexible]
        result += [Validity(f"depth of contact {c.name}", -self.algebra.expression(c.gap), -math.inf, c.depth,
                            f"contact {c.name}: it goes {{value}} m deep, its compliance is meant for {c.depth:g} m; a larger "
                            "stiffness keeps it shallower") for c in self.model.compliant if c.depth is not None]
        result += [Validity(f"creep of contact {c.name}", self.algebra.expression(c.held_slip), -math.inf, c.creep,
                            f"contact {c.name}: it creeps {{value}} m while friction holds, its compliance is meant for "
                            f"{c.creep:g} m; a smaller slip_speed makes it creep less, and bristles with an elastic part do "
                            "not creep", True)
                   for c in self.model.compliant if c.creep is not None]
        return [*result, self.settled.validity] if self.implicit else result

    def _bending(self, body: FlexibleLink) -> Validity:
        name = self.tree.links[body.link].joint.name
        with self.algebra.section(f"joint {name}: deflection"):
            away = exactly(body.beam.Psi_tip) @ body.eta / exact(body.beam.length)
            part = self.algebra.sqrt(dot(away, away))
        return Validity(f"deflection of {name}", part, -math.inf, FAR,
                        f"{name}: the free end goes {{value}} of the length aside; the kinetic energy of a beam is complete to "
                        f"second order, which is meant for deflections below {FAR:g}")

    # -- values

    @cached_property
    def implicit(self) -> dict[sp.Expr, Node]:
        """Expressions of loads that depend on accelerations, multipliers and reactions, and leaves that stand for them."""
        expressions = [e for load in self.model.loads for e in expressions_of(load)]
        return {e: self.algebra.recorder.leaf(f"implicit_load_{k + 1}", SEED) for k, e in enumerate(implicit(expressions))}

    def value(self, e: sp.Expr) -> Any:
        """The value of an expression of a load."""
        if self.model.contacts and any(q in self.contact_forces for q in quantities_in([e])):
            return self.algebra.within(self.contact_forces).expression(e)
        if e not in self.implicit:
            return self.algebra.expression(e)
        if self._settle is None:
            return self.implicit[e]
        return self.settled.values[e]

    @cached_property
    def contact_forces(self) -> Mapping[Quantity, Any]:
        """Forces of rigid contacts, or leaves that stand for them, in the order of their rows."""
        if self._touching is not None:
            return self._touching()
        forces = [force for contact in self.model.contacts for force in contact.forces]
        return {force: self.algebra.recorder.leaf(f"contact_{k + 1}", SEED) for k, force in enumerate(forces)}

    @cached_property
    def settled(self) -> Settled:
        """Solution for the loads that depend on accelerations, multipliers and reactions."""
        assert self._settle is not None
        return self._settle()

    def values(self, expressions: Iterable[sp.Expr]) -> np.ndarray:
        """The values of several, (n,)."""
        return vector(*[self.value(e) for e in expressions])

    # -- each kind

    def _action(self, load: Element) -> Action:
        """The action of an element, recorded once."""
        if id(load) not in self._actions:
            index = self._index(load.body)
            assert index is not None  # checked with the model: nothing comes of a load on the ground
            with self.algebra.section(f"load {load.label}"):
                self._actions[id(load)] = load.act(BodySite(self.tree, self.kinematics, index))
        return self._actions[id(load)]

    def _element(self, result: Applied, load: Element, conservative: bool, other: bool) -> None:
        pose, action = self.pose(load.body), self._action(load)
        for wanted, (f, n) in ((conservative, action.elastic), (other, action.other)):
            if wanted:
                force = pose.R @ f
                result.add(pose, force, pose.R @ n + cross(pose.p, force))

    def _force(self, result: Applied, load: Force) -> None:
        pose = self.pose(load.body)
        f = self.express(self.values(load.force), load.frame, pose.link)
        at = pose.point(self.algebra.constants(load.point))
        result.add(pose, f, cross(at, f))
        if load.reaction is not None:
            other = self.pose(load.reaction)
            common, (a, b) = self._common([(pose.link, at), (other.link, zeros(3))])
            g = -self._turn(f, pose.link, other.link)
            result.add(other, g, cross(self._turn(a - b, common, other.link), g))

    def _torque(self, result: Applied, load: Torque) -> None:
        pose = self.pose(load.body)
        n = self.express(self.values(load.torque), load.frame, pose.link)
        result.add(pose, zeros(3), n)
        if load.reaction is not None:
            other = self.pose(load.reaction)
            result.add(other, zeros(3), -self._turn(n, pose.link, other.link))

    def _joint(self, result: Applied, load: JointForce) -> None:
        link = self.tree.moved_by.get(load.joint)
        for index, value in zip(link.speeds, load.values, strict=True) if link is not None else ():
            result.joint[index] = result.joint[index] + self.value(value)

    def _spring(self, result: Applied, load: SpringDamper, elastic: bool, damped: bool) -> None:
        springs = elastic if load.is_elastic(self.model.parameters) else damped  # with other loads, where it has no potential
        stiffness = self.value(load.stiffness) if springs else 0
        damping = self.value(load.damping) if damped else 0
        d, length, common = self._line(load)
        along: Any = 0
        if not is_zero(stiffness):
            rest = self.value(load.length)
            along = stiffness if is_zero(rest) else stiffness * (1 - rest / length)
        if not is_zero(damping):
            along = along + damping * self._rate(length) / length
        if is_zero(along):
            return
        self._pull(result, load, d * along, common)

    def _between(self, result: Applied, load: ForceBetween) -> None:
        tension = self.value(load.force)
        if not is_zero(tension):
            d, length, common = self._line(load)
            if load.span is not None:
                self._pull(result, load, d * (tension / self.value(load.span)), common)
                return
            apply = self.algebra.recorder.apply
            # A load that pulls only is slack where its ends coincide, and has no direction there.
            slack = isinstance(tension, Node) and any(node.op in ("max", "min", "select") for node in reachable([tension]))
            per_length = apply("select", apply("eq", tension, 0), 0, tension / length) if slack else tension / length
            self._pull(result, load, d * per_length, common)

    def _pull(self, result: Applied, load: SpringDamper | ForceBetween, pull: np.ndarray, common: int) -> None:
        """The force (3,) on the first point, in the axes of a link, and the opposite on the second."""
        for body, point, force in ((load.body_a, load.point_a, pull), (load.body_b, load.point_b, -pull)):
            pose = self.pose(body)
            f = self._turn(force, common, pose.link)
            result.add(pose, f, cross(pose.point(self.algebra.constants(point)), f))

    def _line(self, load: SpringDamper | ForceBetween) -> tuple[np.ndarray, Any, int]:
        return self.separation(load.label, (load.body_a, load.body_b), (load.point_a, load.point_b))

    def separation(self, label: str, bodies: Sequence[Any], points: Sequence[Any]) -> tuple[np.ndarray, Any, int]:
        """Vector from a point of one body to one of another in the axes of the nearest common link, its length, and that link.

        label   what it is for, in names and messages
        Raises ModelError where the points coincide at every position.
        """
        ends = [(pose.link, pose.point(self.algebra.constants(point))) for pose, point in
                ((self.pose(body), point) for body, point in zip(bodies, points, strict=True))]
        common, (a, b) = self._common(ends)
        d = b - a
        if all(is_zero(e) for e in d):
            raise ModelError([f"{label}: its two ends are the same point at every position; give them a distance, or "
                              "leave it out"], self.model.name)
        return d, self.algebra.name(f"length_{label}", self.algebra.sqrt(dot(d, d))), common

    def _rate(self, value: Any) -> Any:
        return forward(self.algebra.recorder, [value], self.algebra.by_time(self.model.coordinates, self.tree.rates))[0]

    # -- frames

    def pose(self, body: Any) -> Pose:
        """Where a body's frame sits; the ground's frame for the ground."""
        index = self._index(body)
        return self.tree.ground if index is None else self.tree.poses[index]

    def _index(self, body: Any) -> int | None:
        """Number of a body; None for the ground."""
        names = {b.name: k for k, b in enumerate(self.model.bodies)}
        return names.get(body.name if isinstance(body, Body) else body)

    def express(self, components: np.ndarray, frame: Any, link: int) -> np.ndarray:
        """Components given in a body's axes (None: the n-frame) in the axes of a link."""
        if frame is None:
            return self._turn(components, GROUND, link)
        pose = self.pose(frame)
        return self._turn(pose.R @ components, pose.link, link)

    def _turn(self, components: np.ndarray, start: int, end: int) -> np.ndarray:
        """Components in the axes of one link, in those of another: inwards to the common link, then outwards."""
        up, down = self.tree.path(start), self.tree.path(end)
        for k in up:
            if k in down:
                break
            components = self.tree.links[k].R @ components
        for k in reversed(down):
            if k not in up:
                components = self.tree.links[k].R.T @ components
        return components

    def _common(self, points: Sequence[tuple[int, np.ndarray]]) -> tuple[int, list[np.ndarray]]:
        """The nearest common link of points given as (link, link components), and the points in its frame."""
        paths = [self.tree.path(link) for link, _ in points]
        common = next((k for k in paths[0] if all(k in path for path in paths)), GROUND)
        moved = []
        for path, (_, at) in zip(paths, points, strict=True):
            for k in path:
                if k == common:
                    break
                at = self.tree.links[k].r + self.tree.links[k].R @ at
            moved.append(at)
        return common, moved
