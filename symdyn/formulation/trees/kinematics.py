"""Positions, velocities and the velocity transformation J in the n-frame, as the lecture writes them.

Recorded only where they are requested: the equations themselves are formed in link axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from symdyn.formulation.trees import water
from symdyn.formulation.trees.link import LinkMotion
from symdyn.formulation.trees.newton_euler import outward
from symdyn.formulation.trees.tree import GROUND, Pose, Tree
from symdyn.spatial.vectors import cross, dot, identity, zeros


class Kinematics:
    """n-frame quantities of a tree; each is recorded once, when first used."""

    def __init__(self, tree: Tree) -> None:
        self.tree = tree
        self.algebra = tree.algebra

    @cached_property
    def frames(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """R (link to n components) and origin p of every link, n-frame."""
        result: list[tuple[np.ndarray, np.ndarray]] = []
        for k, link in enumerate(self.tree.links):
            with self.algebra.section(f"link {link.name}: position in the n-frame"):
                R, p = (identity(), zeros(3)) if link.parent == GROUND else result[link.parent]
                result.append((self.algebra.vector(f"nR{k + 1}", R @ link.R),
                               self.algebra.vector(f"r{k + 1}", p + R @ link.r)))
        return result

    def frame(self, link: int) -> tuple[np.ndarray, np.ndarray]:
        return (identity(), zeros(3)) if link == GROUND else self.frames[link]

    def position(self, pose: Pose, at: np.ndarray) -> np.ndarray:
        """n-frame position (3,) of a point given in body axes."""
        R, p = self.frame(pose.link)
        return p + R @ pose.point(at)

    def rotation(self, pose: Pose) -> np.ndarray:
        """(3, 3) body to n components."""
        return self.frame(pose.link)[0] @ pose.R

    @cached_property
    def columns(self) -> list[tuple[np.ndarray, np.ndarray, int]]:
        """For every joint speed: omega per unit speed and velocity of the link's origin (n-frame), and the link."""
        result = []
        for k, link in enumerate(self.tree.links):
            R, _ = self.frames[k]
            for column in range(len(link.speeds)):
                result.append((R @ link.S[:3, column], R @ link.S[3:, column], k))
        return result

    def jacobian(self, pose: Pose, at: np.ndarray) -> np.ndarray:
        """[velocity of the point; omega] per unit joint speed, n-frame, (6, n_w)."""
        J = zeros(6, len(self.tree.w))
        on_path = set(self.tree.path(pose.link))
        point = self.position(pose, at)
        for index, (omega, v, link) in enumerate(self.columns):
            if link in on_path:
                J[:3, index] = v + cross(omega, point - self.frames[link][1])
                J[3:, index] = omega
        return J

    def velocity(self, pose: Pose, at: np.ndarray) -> np.ndarray:
        """Velocity (3,) of a point given in body axes, n-frame."""
        return self.jacobian(pose, at)[:3] @ self.tree.w if len(self.tree.w) else zeros(3)

    @cached_property
    def reference(self) -> list[LinkMotion]:
        """Motion of every link with u_dot = 0, link axes."""
        return outward(self.tree, self.tree.b, zeros(3))

    def acceleration(self, pose: Pose, at: np.ndarray, motions: Sequence[LinkMotion]) -> np.ndarray:
        """[acceleration of a point given in body axes; alpha], n-frame, (6,); motions: of the links, as from `outward`."""
        rows = zeros(6)
        if pose.link != GROUND:
            R, motion = self.frames[pose.link][0], motions[pose.link]
            rows[:3] = R @ motion.at(pose.point(at))
            rows[3:] = R @ motion.alpha
        return rows

    def bias(self) -> list[np.ndarray]:
        """Accelerations [a_G; alpha] (6,) of every body with u_dot = 0, n-frame."""
        return [self.acceleration(pose, self.algebra.constants(body.com), self.reference)
                for pose, body in zip(self.tree.poses, self.tree.model.bodies, strict=True)]

    @cached_property
    def twists(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """omega and velocity of the origin of every link, link axes."""
        result: list[tuple[np.ndarray, np.ndarray]] = []
        for k, link in enumerate(self.tree.links):
            with self.algebra.section(f"link {link.name}: velocity"):
                omega, v = (zeros(3), zeros(3)) if link.parent == GROUND else result[link.parent]
                E = link.R.T
                own = zeros(6)
                for column, index in enumerate(link.speeds):
                    own = own + link.S[:, column] * self.tree.w[index]
                result.append((self.algebra.vector(f"w{k + 1}", E @ omega + own[:3]),
                               self.algebra.vector(f"v{k + 1}", E @ (v + cross(omega, link.r)) + own[3:])))
        return result

    def twist(self, pose: Pose, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """omega, and velocity of a point given in body axes, n-frame, from the recursion of the links."""
        if pose.link == GROUND:
            return zeros(3), zeros(3)
        R, (omega, v) = self.frames[pose.link][0], self.twists[pose.link]
        return R @ omega, R @ (v + cross(omega, pose.point(at)))

    def kinetic_energy(self) -> Any:
        """T = sum of (omega . I omega + 2 v . (omega x h) + m v . v) / 2, J."""
        total: Any = 0
        for link, (omega, v) in zip(self.tree.links, self.twists, strict=True):
            i = link.inertia
            total = total + dot(omega, i.I @ omega) + 2 * dot(v, cross(omega, i.h)) + i.m * dot(v, v)
        total = total / 2
        for k, added in self.tree.added:
            total = total + water.kinetic_energy(added, *self.twists[k])
        for body in self.tree.flexible:
            total = total + body.kinetic_energy(*(self.twists[body.root] if body.root != GROUND else (zeros(3), zeros(3))))
        return total

    def gravity_potential(self) -> Any:
        """- sum of g . (m p + R h), zero for masses at the n-frame's origin, J."""
        g = self.algebra.constants(self.tree.model.gravity)
        total: Any = 0
        for k, link in enumerate(self.tree.links):
            R, p = self.frames[k]
            total = total - dot(g, link.inertia.m * p + R @ link.inertia.h)
        for pose, body in zip(self.tree.poses, self.tree.model.bodies, strict=True):
            if pose.link == GROUND:
                total = total - dot(g, self.algebra.expression(body.mass) * pose.point(self.algebra.constants(body.com)))
        for flexible in self.tree.flexible:
            total = total - dot(g, self.frame(flexible.root)[0] @ flexible.h)
        return total
