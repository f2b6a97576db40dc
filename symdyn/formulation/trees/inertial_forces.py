"""Inverse dynamics: the joint forces that a given motion needs, body by body, with what water and elastic bodies add."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from symdyn.formulation.trees import water
from symdyn.formulation.trees.kinematics import Kinematics
from symdyn.formulation.trees.link import Wrench, base_motion, inertial_wrench
from symdyn.formulation.trees.newton_euler import inward, outward
from symdyn.formulation.trees.tree import GROUND, Tree
from symdyn.spatial.vectors import Vector, zeros


def inverse_dynamics(tree: Tree, w_dot: Vector, a_0: np.ndarray, applied: Sequence[Wrench] | None = None) -> np.ndarray:
    """Joint forces (n_w,) for joint accelerations w_dot, the base accelerating with a_0 (3,), n-frame, less what the applied
    wrenches give. a_0 = -gravity makes the weights part of it."""
    wrenches, along = inertial_forces(tree, w_dot, a_0, applied)
    return inward(tree, wrenches) + along


def inertial_forces(tree: Tree, w_dot: Vector, a_0: np.ndarray,
                    applied: Sequence[Wrench] | None = None) -> tuple[list[Wrench], np.ndarray]:
    """For each link the force and the moment about its origin, link axes, that its motion needs beyond the applied wrenches,
    and what elastic coordinates need, in their places among the joint speeds (n_w,)."""
    motions = outward(tree, w_dot, a_0)
    kinematics = Kinematics(tree)
    along = zeros(len(tree.w))
    wrenches = []
    for k, (link, motion) in enumerate(zip(tree.links, motions, strict=True)):
        with tree.algebra.section(f"link {link.name}: inertial force and moment"):
            f, n = inertial_wrench(link.effective, motion)
            added = tree.added_to(k)
            if added is not None:
                upwards = kinematics.frames[k][0].T @ a_0
                f_w, n_w = water.inertial_wrench(added, motion, kinematics.twists[k][1], upwards)
                f, n = f + f_w, n + n_w
            for body in tree.flexible:
                if body.root == k:
                    (f_e, n_e), elastic = body.inertial_forces(motion, _of(w_dot, body.speeds))
                    f, n = f + f_e, n + n_e
                    along[body.speeds.start:body.speeds.stop] += elastic
            if applied is not None:
                f, n = f - applied[k][0], n - applied[k][1]
            tree.algebra.vector(f"f{k + 1}", f)
            tree.algebra.vector(f"n{k + 1}", n)
            wrenches.append((f, n))
    for body in tree.flexible:
        if body.root == GROUND:
            with tree.algebra.section(f"link {tree.links[body.link].name}: inertial forces along elastic coordinates"):
                _, elastic = body.inertial_forces(base_motion(a_0), _of(w_dot, body.speeds))
                along[body.speeds.start:body.speeds.stop] += elastic
    return wrenches, along


def _of(w_dot: Vector, speeds: range) -> np.ndarray:
    return np.array(list(w_dot[speeds.start:speeds.stop]), dtype=object)
