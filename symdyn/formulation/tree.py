"""The tree of links: bodies held by fixed joints merged, each link's frame at its joint, everything on the scalars.

Link frames sit in the joint's moving frame, so that a rotation about a joint's axis keeps its zeros.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.formulation.algebra import TapeAlgebra, add_rates
from symdyn.model.joints import Fixed, Joint, JointMotion
from symdyn.model.record import Model, joint_speeds
from symdyn.model.symbols import Coordinate, time
from symdyn.spatial.vectors import Inertia, identity, vector, zeros
from symdyn.tape.differentiate import forward

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
    R, r        (3, 3) link to parent components; (3,) origin in the parent's frame
    S, c        the joint's motion subspace (6, k) and velocity product (6,), link axes (see JointMotion)
    speeds      places of the joint's speeds among all joint speeds of the tree
    inertia     of all bodies merged into the link, about its origin, link axes
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


@dataclass(frozen=True)
class Tree:
    """Links, parents before children, and how the joints' speeds follow from the generalized speeds.

    w = D u + w_t and w_dot = D u_dot + b, with w the speeds of all joints, (n_w,)
    poses      one for each body; ground: pose of the ground's frame
    rates      q_dot, (n_q,)
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

    @property
    def plain(self) -> bool:
        """Whether the joint speeds are the generalized speeds themselves."""
        return self.D.shape[0] == self.D.shape[1] and bool(np.all(np.asarray(np.eye(len(self.w), dtype=int) == self.D)))

    def path(self, link: int) -> list[int]:
        """The link and its ancestors, leaf first."""
        result = []
        while link != GROUND:
            result.append(link)
            link = self.links[link].parent
        return result


def build(model: Model, algebra: TapeAlgebra) -> Tree:
    """The tree of a model."""
    return _Builder(model, algebra).tree()


class _Builder:
    def __init__(self, model: Model, algebra: TapeAlgebra) -> None:
        self.model = model
        self.algebra = algebra
        self.links: list[Link] = []
        self.w: list[Any] = []
        self.w_t: list[Any] = []
        self.b: list[Any] = []
        self.rows: list[list[Any]] = []
        self.inertias: list[Inertia] = []

    def tree(self) -> Tree:
        model, a = self.model, self.algebra
        self.rates = add_rates(model, a)
        self.places = {u: k for k, u in enumerate(model.speeds)}
        ground = Pose(GROUND, identity(), zeros(3))
        if model.ground_motion is not None:
            ground = self._link(model.ground_motion, ground)
        poses: list[Pose | None] = [None] * len(model.bodies)
        with a.section("constants of the links"):
            for joint, parent, child in zip(model.joints, model.parents, model.children, strict=True):
                pose = ground if parent == -1 else poses[parent]
                assert pose is not None
                poses[child] = self._fixed(joint, pose) if isinstance(joint, Fixed) else self._link(joint, pose)
                self._load(child, poses[child])
        n_u = len(model.speeds)
        D = np.array(self.rows, dtype=object).reshape(len(self.w), n_u)
        links = tuple(Link(k.name, k.joint, k.parent, k.R, k.r, k.S, k.c, k.speeds, inertia)
                      for k, inertia in zip(self.links, self.inertias, strict=True))
        return Tree(model, a, links, tuple(p for p in poses if p is not None), ground, D, vector(*self.w),
                    vector(*self.w_t), vector(*self.b), self.rates)

    def _fixed(self, joint: Joint, parent: Pose) -> Pose:
        a = self.algebra
        R = parent.R @ a.matrix(joint.parent_rotation) @ a.matrix(joint.child_rotation).T
        p = parent.point(a.constants(joint.parent_point)) - R @ a.constants(joint.child_point)
        return Pose(parent.link, R, p)

    def _link(self, joint: Joint, parent: Pose) -> Pose:
        """Add the link that the joint moves; returns the pose of the child body in it."""
        a = self.algebra
        number = len(self.links)
        R0 = parent.R @ a.matrix(joint.parent_rotation)
        with a.section(f"joint {joint.name}"):
            s, w = self._joint_speeds(joint)
            motion: JointMotion = joint.motion(a, s, w)
        R = R0 @ motion.R
        r = parent.point(a.constants(joint.parent_point)) + R0 @ motion.d
        speeds = range(len(self.w) - len(w), len(self.w))
        name = joint.child if isinstance(joint.child, str) else joint.child.name
        empty = Inertia(0, zeros(3), zeros(3, 3))
        self.links.append(Link(name, joint, parent.link, a.vector(f"R{number + 1}", R), r, motion.S, motion.c, speeds, empty))
        self.inertias.append(empty)
        back = a.matrix(joint.child_rotation).T
        return Pose(number, back, -(back @ a.constants(joint.child_point)))

    def _joint_speeds(self, joint: Joint) -> tuple[list[Any], list[Any]]:
        """Coordinates and speeds of the joint; extends w = D u + w_t and its derivative."""
        a = self.algebra
        n_u = len(self.model.speeds)
        s = [a.leaves[q] if isinstance(q, Coordinate) else a.expression(q) for q in joint.coordinates]
        symbols = joint_speeds(joint)
        w: list[Any] = []
        for k, symbol in enumerate(symbols):
            row: list[Any] = [0] * n_u
            if symbol is not None and symbol in self.places:
                row[self.places[symbol]] = 1
                w.append(a.leaves[symbol])
                self.w_t.append(0)
                self.b.append(0)
            else:
                by_time = a.by_time(self.model.coordinates, self.rates)
                speed = forward(a.recorder, [s[k]], by_time)[0]
                row = [forward(a.recorder, [speed], {a.leaves[u]: 1})[0] for u in self.model.speeds]
                w.append(speed)
                self.w_t.append(forward(a.recorder, [s[k]], {a.leaves[time]: 1})[0])
                self.b.append(forward(a.recorder, [speed], by_time)[0])
            self.rows.append(row)
        self.w.extend(w)
        return s, w

    def _load(self, child: int, pose: Pose | None) -> None:
        """Add the body's inertia to its link: first about the body's origin, then in the link's frame."""
        assert pose is not None
        if pose.link == GROUND:
            return
        a, body = self.algebra, self.model.bodies[child]
        with a.section("inertia of the links, about their joints"):
            about_com = Inertia(a.expression(body.mass), zeros(3), _symmetric(a.matrix(body.inertia)))
            inertia = about_com.moved(pose.R, pose.point(a.constants(body.com)))
            total = self.inertias[pose.link] + inertia
            n = pose.link + 1
            a.name(f"m{n}", total.m), a.vector(f"h{n}", total.h), a.vector(f"I{n}", total.I)
            self.inertias[pose.link] = total


def _symmetric(I: np.ndarray) -> np.ndarray:
    result = I.copy()
    for i in range(3):
        for j in range(i):
            result[i, j] = result[j, i]
    return result
