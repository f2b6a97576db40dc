"""Motion of two bodies of a tree relative to the link that both hang on, in that link's axes.

Seen from the nearest common link, what the links before it do has no part in a constraint between the two.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.formulation.trees.link import LinkMotion, base_motion
from symdyn.formulation.trees.newton_euler import carried_on
from symdyn.formulation.trees.tree import GROUND, Pose, Tree
from symdyn.spatial.vectors import cross, identity, zeros
from symdyn.tape.evaluate import constant
from symdyn.tape.node import Node, is_zero
from symdyn.tape.recorder import Recorder


@dataclass(frozen=True)
class End:
    """A point of a body and a frame on the body, seen from the base link, in its axes.

    p (3,), A (3, 3) frame to base components; Jv, Jw (3, n_w): velocity of the point and omega per unit joint speed;
    along: the indices of joint speeds that move the body; others have columns of zeros
    v, omega (3,) with the speeds of the state; a, alpha (3,) accelerations with u_dot = 0 (of the ground: less gravity's)
    """

    pose: Pose
    at: np.ndarray
    p: np.ndarray
    A: np.ndarray
    Jv: np.ndarray
    Jw: np.ndarray
    v: np.ndarray
    omega: np.ndarray
    a: np.ndarray
    alpha: np.ndarray
    along: tuple[int, ...]


class Relative:
    """The tree seen from one of its links, or from the ground.

    weight   whether the ground accelerates upwards in place of the weight: the motions that the equations need anyway
    """

    def __init__(self, tree: Tree, base: int, weight: bool = True) -> None:
        self.tree, self.base = tree, base
        upwards = -tree.algebra.constants(tree.model.gravity) if base == GROUND and weight else zeros(3)
        self._frames: dict[int, tuple[np.ndarray, np.ndarray]] = {base: (identity(), zeros(3))}
        self._motions: dict[int, LinkMotion] = {base: base_motion(upwards)}

    def end(self, pose: Pose, point: np.ndarray, rotation: np.ndarray) -> End:
        """A point of a body, body axes, and a frame on it, frame to body components."""
        at = pose.point(point)
        R, origin = self._frame(pose.link)
        arm = R @ at
        Jv, Jw = self._jacobian(pose.link, arm)
        motion = self._motion(pose.link)
        w = self.tree.w
        along = sorted(index for k in self.path(pose.link) for index in self.tree.links[k].speeds)
        return End(pose, at, origin + arm, R @ (pose.R @ rotation), Jv, Jw, Jv[:, along] @ w[along] if along else zeros(3),
                   R @ motion.omega if len(w) else zeros(3), R @ motion.at(at), R @ motion.alpha, tuple(along))

    def rotation(self, link: int) -> np.ndarray:
        """(3, 3) components in a link's axes to those in the base's."""
        return self._frame(link)[0]

    def path(self, link: int) -> list[int]:
        """Links from the base outwards to this one, the base left out."""
        inwards = self.tree.path(link)
        return list(reversed(inwards[:inwards.index(self.base)] if self.base in inwards else inwards))

    def _frame(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        if k not in self._frames:
            link, algebra = self.tree.links[k], self.tree.algebra
            R, p = self._frame(link.parent)
            with algebra.section(f"link {link.name}: position in the {self._name} frame"):
                self._frames[k] = (algebra.vector(f"nR{k + 1}", R @ link.R), algebra.vector(f"r{k + 1}", p + R @ link.r))
        return self._frames[k]

    def _motion(self, k: int) -> LinkMotion:
        if k not in self._motions:
            self._motions[k] = carried_on(self.tree, k, self._motion(self.tree.links[k].parent), self.tree.b)
        return self._motions[k]

    def _jacobian(self, link: int, arm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Columns of every joint on the path; arm: of the point from the origin of its link, base axes."""
        Jv, Jw = zeros(3, len(self.tree.w)), zeros(3, len(self.tree.w))
        _, origin = self._frame(link)
        for k in self.path(link):
            R, p = self._frame(k)
            S = self.tree.links[k].S
            for column, index in enumerate(self.tree.links[k].speeds):
                Jw[:, index] = R @ S[:3, column]
                Jv[:, index] = R @ S[3:, column] + cross(Jw[:, index], (origin - p) + arm)
        return Jv, Jw

    @property
    def _name(self) -> str:
        return "n" if self.base == GROUND else f"{self.tree.links[self.base].name}'s"


def common_link(tree: Tree, *links: int) -> int:
    """The nearest link that all these hang on, or the ground."""
    paths = [tree.path(link) for link in links]
    return next((k for k in paths[0] if all(k in path for path in paths)), GROUND)


def complement(recorder: Recorder, axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two directions across a unit axis, so that the three are right-handed.

    Source: Duff et al., Building an orthonormal basis, revisited, JCGT 6 (2017), page 1.
    """
    x, y, z = axis
    along = [k for k in range(3) if not is_zero(axis[k])]
    if len(along) < 3:
        free = (along[0] + 1) % 3 if len(along) == 1 else 3 - sum(along)
        first = np.array([int(k == free) for k in range(3)], dtype=object)
        return first, cross(axis, first)
    s = _sign(recorder, z)
    a = -1 / (s + z)
    b = x * y * a
    return (np.array([1 + s * (x * x) * a, s * b, -s * x], dtype=object), np.array([b, s + y * y * a, -y], dtype=object))


def _sign(recorder: Recorder, z: Any) -> Any:
    """1 or -1; of what depends on parameters as a choice when the code runs."""
    if isinstance(z, Node) and z.mask:
        return recorder.apply("select", recorder.apply("gt", z, 0), 1, -1)
    return 1 if constant(z) > 0 else -1
