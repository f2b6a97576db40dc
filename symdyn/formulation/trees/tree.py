"""The tree of links: bodies held by fixed joints merged, each link's frame at its joint, everything on the scalars.

Link frames sit in the joint's moving frame, so that a rotation about a joint's axis keeps its zeros. Where axes stay
parallel, frames may stay parallel too ("aligned"): they keep the axes of the first link of such a group, the constants of
the links are turned instead, by the sum of the angles, and nothing has to be turned from link to link.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from symdyn.formulation.algebra import TapeAlgebra, add_rates, given_by_time
from symdyn.formulation.identification.joint_regrouping import coordinate_axis, unmoved
from symdyn.formulation.probes.vanishing_pivots import Search, vanishing_pivots
from symdyn.formulation.trees.axes import along_coordinate_axis
from symdyn.formulation.trees.flexible import FlexibleLink
from symdyn.formulation.trees.water import of_load
from symdyn.model.elements import AddedMass
from symdyn.model.joints import Fixed, Joint, JointMotion, Modal
from symdyn.model.joints.base import turn
from symdyn.model.joints.modal import exactly
from symdyn.model.record import Model, joint_speeds
from symdyn.model.symbols import Coordinate
from symdyn.shown import name_of
from symdyn.spatial.inertia import ArticulatedInertia, Inertia
from symdyn.spatial.vectors import identity, vector, zeros
from symdyn.tape.differentiate import forward
from symdyn.tape.node import Node, is_zero
from symdyn.tape.passes import substitute

GROUND = -1


@dataclass(frozen=True)
class Pose:
    """Where a body's frame sits in a link's frame: link index, R (body to link components), p (its origin)."""

    link: int
    R: np.ndarray
    p: np.ndarray

    def point(self, at: np.ndarray) -> np.ndarray:
        """A point of the body, body axes, as a point of the link, link axes."""
        return self.p + self.R @ at


@dataclass(frozen=True)
class Link:
    """One moving part.

    parent      index of the parent link, or GROUND
    R, r        (3, 3) link to parent components; (3,) origin in the parent's frame, parent axes
    S, c        the joint's motion subspace (6, k) and velocity product (6,), link axes (see JointMotion)
    speeds      indices of the joint's speeds among all joint speeds of the tree
    inertia     of all bodies merged into the link, about its origin, link axes
    effective   the same with what its joint does not move counted to its parent (see regrouping); same equations of motion
    """

    name: str
    joint: Joint
    parent: int
    R: np.ndarray
    r: np.ndarray
    S: np.ndarray
    c: np.ndarray
    speeds: range
    inertia: Inertia
    effective: Inertia


@dataclass(frozen=True)
class Tree:
    """Links, parents before children, and how the joints' speeds follow from the generalized speeds.

    w = D u + w_t and w_dot = D u_dot + b, with w the speeds of all joints, (n_w,)
    poses      one for each body; ground: pose of the ground's frame
    rates      q_dot, (n_q,)
    drivers    for each joint speed the indices of the generalized speeds that it is made of: columns of D that are not zero
    added      added mass: number of a link, and that of the water it moves along, about its origin, link axes
    flexible   what elastic coordinates add to the links
    parallel   number of links whose frames are kept parallel to their parents'
    vanishing_pivots   generalized speeds whose pivot of the mass matrix vanishes at some positions, each with those of the
               speeds after it that may then move what it moves (see massless_pivots)
    sound      generalized speeds that always move something that the speeds after them do not move: their pivots are not zero
    """

    model: Model
    algebra: TapeAlgebra
    links: tuple[Link, ...]
    poses: tuple[Pose, ...]
    ground: Pose
    D: np.ndarray
    w: np.ndarray
    w_t: np.ndarray
    b: np.ndarray
    rates: list[Any]
    drivers: tuple[frozenset[int], ...]
    added: tuple[tuple[int, ArticulatedInertia], ...] = ()
    flexible: tuple[FlexibleLink, ...] = ()
    parallel: int = 0
    vanishing_pivots: Mapping[int, frozenset[int]] = field(default_factory=dict)
    sound: Set[int] = frozenset()

    @cached_property
    def plain(self) -> bool:
        """Whether the joint speeds are the generalized speeds themselves."""
        square = self.D.shape[0] == self.D.shape[1]
        return square and all(own == {k} for k, own in enumerate(self.drivers)) and bool(np.all(np.diagonal(self.D) == 1))

    def by_speeds(self, rows: np.ndarray) -> np.ndarray:
        """rows D: what rows (n, n_w) along the joints' speeds are along the generalized ones, (n, n_u)."""
        if self.plain:
            return rows
        return rows @ self.D if rows.shape[1] else zeros(len(rows), self.D.shape[1])

    def joint_accelerations(self, u_dot: np.ndarray) -> np.ndarray:
        """D u_dot + b: the rates of the joints' speeds."""
        if self.plain:
            return u_dot + self.b
        return self.D @ u_dot + self.b if self.D.size else self.b

    @cached_property
    def driven(self) -> tuple[tuple[int, ...], ...]:
        """For each generalized speed the indices of the joint speeds that it is part of: rows of D that are not zero."""
        result: list[list[int]] = [[] for _ in self.model.speeds]
        for k, speeds in enumerate(self.drivers):
            for j in speeds:
                result[j].append(k)
        return tuple(map(tuple, result))

    @cached_property
    def moved_by(self) -> Mapping[Joint | str, Link]:
        """The link that each joint moves, by the joint and by its name."""
        return {**{link.joint.name: link for link in self.links}, **{link.joint: link for link in self.links}}

    @cached_property
    def idle(self) -> frozenset[str]:
        """Names of the parameters of the default 0."""
        return frozenset(p.name for p, value in self.model.defaults.items() if value == 0)

    @cached_property
    def massless_pivots(self) -> Mapping[int, frozenset[int]]:
        """Those of the speeds with vanishing pivots that then move no link with mass, nor a constraint between such links."""
        return vanishing_pivots(self, solid=True)

    @property
    def rigid(self) -> bool:
        """Whether there are rigid bodies only, without added mass."""
        return not self.added and not self.flexible

    def added_to(self, link: int) -> ArticulatedInertia | None:
        """The added mass of a link."""
        return next((added for k, added in self.added if k == link), None)

    def elastic(self, link: int) -> FlexibleLink | None:
        """The flexible body whose free end is a link."""
        return next((body for body in self.flexible if body.link == link), None)

    def path(self, link: int) -> list[int]:
        """The link and its ancestors, leaf first."""
        result = []
        while link != GROUND:
            result.append(link)
            link = self.links[link].parent
        return result


def build(model: Model, algebra: TapeAlgebra, aligned: bool = False, grouped: bool = True) -> Tree:
    """The tree of a model.

    aligned   parallel frames where axes stay parallel
    grouped   False: `effective` inertias are the links' own, to measure what grouping is worth
    """
    tree = _Builder(model, algebra, aligned, grouped).tree()
    search = Search(tree)
    return replace(tree, vanishing_pivots=search.vanishing_pivots(), sound=search.sound)


@dataclass
class _Part:
    """A link while the tree is built, in its body-fixed frame.

    R0, p0   orientation and origin of the joint's frame on the parent, in the parent's body-fixed frame
    spin     axis number and angle by which the body-fixed frame is turned against the frame that is worked in, or None
    """

    name: str
    joint: Joint
    parent: int
    R0: np.ndarray
    p0: np.ndarray
    motion: JointMotion
    angle: Any
    speeds: range
    inertia: Inertia
    effective: Inertia
    spin: tuple[int, Any] | None = None

    @cached_property
    def axis(self) -> int | None:
        """The coordinate axis that the joint turns about, if it does nothing else."""
        S = self.motion.S
        if S.shape[1] != 1 or not self.joint.identity_at_zero or not all(is_zero(e) for e in [*S[3:, 0], *self.motion.d]):
            return None
        return coordinate_axis(S[:3, 0])


class _Builder:
    def __init__(self, model: Model, algebra: TapeAlgebra, aligned: bool, grouped: bool) -> None:
        self.model = model
        self.grouped = grouped
        self.algebra = algebra
        self.aligned = aligned
        self.parts: list[_Part] = []
        self.w: list[Any] = []
        self.w_t: list[Any] = []
        self.b: list[Any] = []
        self.rows: list[dict[int, Any]] = []

    def tree(self) -> Tree:
        model, a = self.model, self.algebra
        self.rates = add_rates(model, a)
        self.indices = {u: k for k, u in enumerate(model.speeds)}
        ground = Pose(GROUND, identity(), zeros(3))
        if model.ground_motion is not None:
            ground = self._part(model.ground_motion, ground)
        poses: list[Pose] = [ground] * len(model.bodies)
        with a.section("constants of the links"):
            for joint, parent, child in zip(model.joints, model.parents, model.children, strict=True):
                pose = ground if parent == -1 else poses[parent]
                poses[child] = self._fixed(joint, pose) if isinstance(joint, Fixed) else self._part(joint, pose)
                self._load(child, poses[child])
            self._regroup()
        if self.aligned:
            self._align()
        links = tuple(self._link(k) for k in range(len(self.parts)))
        D = zeros(len(self.w), len(model.speeds))
        for k, row in enumerate(self.rows):
            D[k, list(row)] = list(row.values())
        drivers = tuple(frozenset(u for u, e in row.items() if not is_zero(e)) for row in self.rows)
        worked = tuple(self._worked(p) for p in poses)
        return Tree(model, a, links, worked, self._worked(ground), D, vector(*self.w), vector(*self.w_t), vector(*self.b),
                    self.rates, drivers, self._added(worked), self._flexible(links, worked),
                    sum(part.spin is not None for part in self.parts))

    # -- body-fixed frames

    def _fixed(self, joint: Joint, parent: Pose) -> Pose:
        a = self.algebra
        R = parent.R @ a.matrix(joint.parent_rotation) @ a.matrix(joint.child_rotation).T
        p = parent.point(a.constants(joint.parent_point)) - R @ a.constants(joint.child_point)
        return Pose(parent.link, R, p)

    def _part(self, joint: Joint, parent: Pose) -> Pose:
        """Add the link that the joint moves; returns the pose of the child body in it."""
        a = self.algebra
        number = len(self.parts)
        turned, A = along_coordinate_axis(joint)
        R0 = parent.R @ a.matrix(joint.parent_rotation) @ a.matrix(A)
        with a.section(f"joint {joint.name}"):
            s, w = self._joint_speeds(joint)
            motion: JointMotion = turned.motion(a, s, w)
        speeds = range(len(self.w) - len(w), len(self.w))
        name = joint.child if isinstance(joint.child, str) else joint.child.name
        self.parts.append(_Part(name, joint, parent.link, R0, parent.point(a.constants(joint.parent_point)), motion,
                                s[0] if s else None, speeds, Inertia.none(), Inertia.none()))
        back = (a.matrix(joint.child_rotation) @ a.matrix(A)).T
        return Pose(number, back, -(back @ a.constants(joint.child_point)))

    def _joint_speeds(self, joint: Joint) -> tuple[list[Any], list[Any]]:
        """Coordinates and speeds of the joint; extends w = D u + w_t and its derivative."""
        a = self.algebra
        s = [a.leaves[q] if isinstance(q, Coordinate) else a.expression(q) for q in joint.coordinates]
        symbols = joint_speeds(joint)
        w: list[Any] = []
        for k, symbol in enumerate(symbols):
            if symbol is not None and symbol in self.indices:
                row = {self.indices[symbol]: 1}
                w.append(a.leaves[symbol])
                self.w_t.append(0)
                self.b.append(0)
            elif symbol is not None and symbol in self.model.own_speeds:
                speed = a.leaves[symbol]
                leaves = [a.leaves[u] for u in self.model.speeds]
                row = dict(enumerate(forward(a.recorder, [speed], {u: 1})[0] for u in leaves))
                w.append(speed)
                self.w_t.append(substitute((speed,), dict.fromkeys(leaves, 0), a.recorder)[0])
                self.b.append(forward(a.recorder, [speed], a.by_time(self.model.coordinates, self.rates))[0])
            else:
                by_time = a.by_time(self.model.coordinates, self.rates)
                speed = forward(a.recorder, [s[k]], by_time)[0]
                row = dict(enumerate(forward(a.recorder, [speed], {a.leaves[u]: 1})[0] for u in self.model.speeds))
                w.append(speed)
                self.w_t.append(forward(a.recorder, [s[k]], given_by_time(a.leaves))[0])
                self.b.append(forward(a.recorder, [speed], by_time)[0])
            self.rows.append(row)
        self.w.extend(w)
        return s, w

    def _load(self, child: int, pose: Pose) -> None:
        """Add the body's inertia to its link: first about the body's origin, then in the link's frame."""
        if pose.link == GROUND:
            return
        a, body = self.algebra, self.model.bodies[child]
        with a.section("inertia of the links, about their joints"):
            about_com = Inertia(a.expression(body.mass), zeros(3), _symmetric(a.matrix(body.inertia)))
            part = self.parts[pose.link]
            part.inertia = part.inertia + about_com.moved(pose.R, pose.point(a.constants(body.com)))

    def _regroup(self) -> None:
        """Count what a joint does not move to the parent, from the leaves inwards."""
        a = self.algebra
        with a.section("inertia of the links, about their joints"):
            for part in self.parts:
                part.effective = part.inertia
            for k in reversed(range(len(self.parts))):
                part = self.parts[k]
                regular = self.grouped and part.joint.identity_at_zero
                piece = unmoved(part.motion.S, part.effective) if regular else Inertia.none()
                part.effective = part.effective - piece
                if part.parent != GROUND:
                    outer = self.parts[part.parent]
                    # Seen from the parent the piece looks the same at every position of the joint, so also at zero.
                    R = part.R0 if any(not is_zero(e) for e in part.motion.S[:3].ravel()) else part.R0 @ part.motion.R
                    outer.effective = outer.effective + piece.moved(R, part.p0)
                n, total = k + 1, part.effective
                a.name(f"m{n}", total.m), a.vector(f"h{n}", total.h), a.vector(f"I{n}", total.I)

    # -- the frames that are worked in

    def _align(self) -> None:
        """Decide which links keep the axes of their parent: turning ones whose children turn about parallel axes."""
        children: list[list[int]] = [[] for _ in self.parts]
        for k, part in enumerate(self.parts):
            if part.parent != GROUND:
                children[part.parent].append(k)
        for k, part in enumerate(self.parts):
            if part.axis is None or not all(self._parallel(child) for child in children[k]):
                continue
            outer = part.parent != GROUND and self.parts[part.parent].spin is not None
            if children[k] or outer:
                part.spin = (part.axis, self._total_angle(k))

    def _parallel(self, k: int) -> int:
        """1 or -1 if joint k turns about its parent's axis or its opposite, else 0."""
        part, outer = self.parts[k], self.parts[self.parts[k].parent]
        if part.axis is None or outer.axis is None:
            return 0
        # A cosine of 1 in floats says nothing: it may belong to a tilt of 1e-9, which its sines show.
        tilt = [part.R0[k, part.axis] for k in range(3) if k != outer.axis]
        along = part.R0[outer.axis, part.axis]
        return 0 if isinstance(along, Node) or abs(along) != 1 or not all(is_zero(e) for e in tilt) else int(along)

    def _total_angle(self, k: int) -> Any:
        """Angle of link k about its axis against the axes that its parent is worked in."""
        part = self.parts[k]
        own = part.motion.S[part.axis, 0] * part.angle
        spin = None if part.parent == GROUND else self.parts[part.parent].spin
        return own if spin is None else self.algebra.name(f"theta{k + 1}", own + self._parallel(k) * spin[1])

    def _link(self, k: int) -> Link:
        a, part = self.algebra, self.parts[k]
        with a.section("constants of the links"):
            outer = None if part.parent == GROUND else self.parts[part.parent].spin
            r = part.p0 + part.R0 @ part.motion.d
            inertia, effective = part.inertia, part.effective
            if part.spin is not None:
                R, turned = part.R0, self._turn(part.spin)
                inertia, effective = inertia.turned(turned), effective.turned(turned)
            else:
                R = part.R0 @ (self._turn((part.axis, self._total_angle(k))) if outer else part.motion.R)
            if outer is not None:
                r = self._turn(outer) @ r
            a.vector(f"r{k + 1}", r)
        return Link(part.name, part.joint, part.parent, a.vector(f"R{k + 1}", R), r, part.motion.S, part.motion.c, part.speeds,
                    inertia, effective)

    # -- water and elastic bodies

    def _added(self, poses: Sequence[Pose]) -> tuple[tuple[int, ArticulatedInertia], ...]:
        a = self.algebra
        numbers = {body.name: k for k, body in enumerate(self.model.bodies)}
        result: dict[int, ArticulatedInertia] = {}
        for load in self.model.loads:
            if isinstance(load, AddedMass):
                pose = poses[numbers[name_of(load.body)]]
                if pose.link == GROUND:
                    continue
                with a.section(f"load {load.label}"):
                    added = of_load(a, load, pose.R, pose.point(a.constants(load.point)))
                    result[pose.link] = result[pose.link] + added if pose.link in result else added
        return tuple(sorted(result.items(), key=lambda item: item[0]))

    def _flexible(self, links: Sequence[Link], poses: Sequence[Pose]) -> tuple[FlexibleLink, ...]:
        a = self.algebra
        result = []
        for joint, parent in zip(self.model.joints, self.model.parents, strict=True):
            if not isinstance(joint, Modal):
                continue
            number = next(k for k, link in enumerate(links) if link.joint is joint)
            pose, speeds = poses[parent], links[number].speeds
            indices = slice(speeds.start, speeds.stop)
            eta = a.constants(joint.coordinates)
            K, D = (a.expression(factor) * exactly(matrix) for factor, matrix in
                    ((joint.stiffness, joint.beam.K), (joint.damping, joint.beam.D)))
            rates = vector(*self.w[indices])
            result.append(FlexibleLink(number, pose.link, pose.R, pose.p, speeds, eta, rates, K, D, joint.beam))
        return tuple(result)

    def _worked(self, pose: Pose) -> Pose:
        """A body's pose in the frame that its link is worked in."""
        spin = None if pose.link == GROUND else self.parts[pose.link].spin
        if spin is None:
            return pose
        turned = self._turn(spin)
        return Pose(pose.link, turned @ pose.R, turned @ pose.p)

    def _turn(self, spin: tuple[int | None, Any]) -> np.ndarray:
        axis, angle = spin
        return turn(self.algebra, [int(k == axis) for k in range(3)], angle)


def _symmetric(I: np.ndarray) -> np.ndarray:
    result = I.copy()
    for i in range(3):
        for j in range(i):
            result[i, j] = result[j, i]
    return result
