"""Reaction of every joint: force and moment on its child, by one pass inwards over the bodies as they are.

Nothing is merged or regrouped here: bodies held by fixed joints have reactions, too. The cut load of a joint is all that passes
from its parent to its child through it. Its reaction is the cut load less what acts along its speeds: joint forces (drives,
springs and dampers in the joint), gears, and constraints by expression. The force that holds a prescribed or dependent coordinate
is a reaction.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from symdyn.formulation.constraints.rows import Closure
from symdyn.formulation.loads.recorded import Loads
from symdyn.formulation.trees import water
from symdyn.formulation.trees.kinematics import Kinematics
from symdyn.formulation.trees.link import LinkMotion, base_motion, inertial_wrench
from symdyn.formulation.trees.newton_euler import outward
from symdyn.formulation.trees.tree import GROUND, Pose, Tree
from symdyn.model.elements import AddedMass
from symdyn.model.joints import Fixed, Joint, Modal
from symdyn.model.record import joint_speeds
from symdyn.shown import name_of
from symdyn.spatial.inertia import Inertia
from symdyn.spatial.vectors import cross, zeros
from symdyn.tape.node import is_zero

Wrench = tuple[np.ndarray, np.ndarray]


def reactions(tree: Tree, loads: Loads, kinematics: Kinematics, w_dot: np.ndarray, closures: Sequence[Closure] = (),
              lam: np.ndarray | None = None, along_speeds: np.ndarray | None = None,
              whole: bool = False) -> dict[str, np.ndarray]:
    """Joint name -> [force; moment about the joint's point on the child] on the child, n-frame, (6,).

    w_dot          (n_w,) accelerations of the joints; lam: multipliers of the closures' rows
    along_speeds   (n_u,) forces along the generalized speeds that other constraints make
    whole          the cut loads in place of the reactions
    """
    model, algebra = tree.model, tree.algebra
    gravity = algebra.constants(model.gravity)
    motions = outward(tree, w_dot, -gravity)
    still = base_motion(-gravity)
    applied = loads.applied()
    result: dict[str, np.ndarray] = {}
    for closure in closures:
        assert lam is not None
        result[closure.joint.name] = _closing(closure, lam, applied.at_body, kinematics)
    wrenches: list[Wrench] = []
    for pose, body, (f, n) in zip(tree.poses, model.bodies, applied.bodies, strict=True):
        with algebra.section(f"body {body.name}: force and moment that its motion needs"):
            about_com = Inertia(algebra.expression(body.mass), zeros(3), algebra.matrix(body.inertia))
            inertia = about_com.moved(pose.R, pose.point(algebra.constants(body.com)))
            force, moment = inertial_wrench(inertia, still if pose.link == GROUND else motions[pose.link])
            wrenches.append((force - f, moment - n))
    for number, (f, n) in _beyond_rigid(tree, kinematics, motions, w_dot, -gravity):
        wrenches[number] = (wrenches[number][0] + f, wrenches[number][1] + n)
    drives = None if whole else applied.joint + _on_joints(tree, along_speeds)
    order = list(zip(model.joints, model.parents, model.children, strict=True))
    for joint, parent, child in reversed(order):
        with algebra.section(f"joint {joint.name}: reaction"):
            pose, (force, moment) = tree.poses[child], wrenches[child]
            result[joint.name] = _at_joint(tree, joint, pose, force, moment, drives, kinematics)
            if parent != -1:
                f, n = _carried(tree, pose, tree.poses[parent], force, moment)
                wrenches[parent] = (wrenches[parent][0] + f, wrenches[parent][1] + n)
    return result


def _beyond_rigid(tree: Tree, kinematics: Kinematics, motions: Sequence[LinkMotion], w_dot: np.ndarray,
                  a_0: np.ndarray) -> Iterator[tuple[int, Wrench]]:
    """Body number, and what added mass and deflection need beyond its rigid inertia, about the link's origin, link axes."""
    model, algebra = tree.model, tree.algebra
    numbers = {body.name: k for k, body in enumerate(model.bodies)}
    for load in model.loads:
        if isinstance(load, AddedMass):
            k = numbers[name_of(load.body)]
            pose = tree.poses[k]
            if pose.link != GROUND:
                added = water.of_load(algebra, load, pose.R, pose.point(algebra.constants(load.point)))
                upwards = kinematics.frames[pose.link][0].T @ a_0
                yield k, water.inertial_wrench(added, motions[pose.link], kinematics.twists[pose.link][1], upwards)
    for body in tree.flexible:
        joint = tree.links[body.link].joint
        k = numbers[name_of(joint.parent)]
        motion = base_motion(a_0) if body.root == GROUND else motions[body.root]
        yield k, body.inertial_forces(motion, w_dot[body.speeds.start:body.speeds.stop])[0]


def _closing(closure: Closure, lam: np.ndarray, act: Any, kinematics: Kinematics) -> np.ndarray:
    """The reaction of a closing joint; acts on both bodies like a load."""
    force, moment, back = zeros(3), zeros(3), zeros(3)
    for row, index in zip(closure.rows, closure.indices, strict=True):
        force, moment, back = force - lam[index] * row.f, moment - lam[index] * row.n_c, back - lam[index] * row.n_p
    seen = closure.seen
    for end, f, n in ((closure.child, force, moment), (closure.parent, -force, back)):
        R = seen.rotation(end.pose.link).T
        act(end.pose, R @ f, cross(end.at, R @ f) + R @ n)
    R = kinematics.frame(closure.base)[0]
    return np.concatenate([R @ force, R @ moment])


def _at_joint(tree: Tree, joint: Joint, pose: Pose, force: np.ndarray, moment: np.ndarray, drives: np.ndarray | None,
              kinematics: Kinematics) -> np.ndarray:
    """The wrench at the joint's point; drives: what acts along the joints' speeds, which is taken off."""
    at = pose.point(tree.algebra.constants(joint.child_point))
    n = moment - cross(at, force)
    if drives is not None and not isinstance(joint, (Fixed, Modal)):
        link = tree.links[pose.link]
        f_d, n_d = _drive(link.S, drives[link.speeds.start:link.speeds.stop])
        force, n = force - f_d, n - n_d
    R = kinematics.frame(pose.link)[0]
    return np.concatenate([R @ force, R @ n])


def _drive(S: np.ndarray, tau: np.ndarray) -> Wrench:
    """The force and moment that act for tau along the speeds of S: moments along what turns, forces along what only shifts."""
    force, moment = zeros(3), zeros(3)
    if all(is_zero(t) for t in tau):
        return force, moment
    turning = [k for k in range(len(tau)) if not all(is_zero(e) for e in S[:3, k])]
    shifting = [k for k in range(len(tau)) if k not in turning]
    if shifting:
        force = _dual(S[3:, shifting], tau[shifting])
    if turning:
        moment = _dual(S[:3, turning], tau[turning] - S[3:, turning].T @ force)
    return force, moment


def _dual(A: np.ndarray, values: np.ndarray) -> np.ndarray:
    """A (A^T A)^-1 values for one to three independent columns."""
    G = A.T @ A
    if G.shape == (1, 1):
        return A[:, 0] * (values[0] / G[0, 0])
    if G.shape == (2, 2):
        d = G[0, 0] * G[1, 1] - G[0, 1] * G[1, 0]
        return A @ np.array([(G[1, 1] * values[0] - G[0, 1] * values[1]) / d, (G[0, 0] * values[1] - G[1, 0] * values[0]) / d],
                            dtype=object)
    a, b, c = A.T
    volume = a @ cross(b, c)
    return (cross(b, c) * values[0] + cross(c, a) * values[1] + cross(a, b) * values[2]) / volume  # type: ignore[no-any-return]


def _carried(tree: Tree, pose: Pose, parent: Pose, force: np.ndarray, moment: np.ndarray) -> Wrench:
    """A wrench about the origin of the child's link, in the link of the parent."""
    if pose.link == parent.link:
        return force, moment
    link = tree.links[pose.link]
    f = link.R @ force
    return f, link.R @ moment + cross(link.r, f)


def _on_joints(tree: Tree, along_speeds: np.ndarray | None) -> np.ndarray:
    """Forces along generalized speeds as forces along the joint speeds that these are; not along others that follow them."""
    result = zeros(len(tree.w))
    if along_speeds is not None:
        for index, row in own_rows(tree).items():
            result[row] = along_speeds[index]
    return result


def own_rows(tree: Tree) -> dict[int, int]:
    """Index of a generalized speed among all -> that of the joint speed that it is; speeds that no joint has are left out."""
    indices = {u: k for k, u in enumerate(tree.model.speeds)}
    result: dict[int, int] = {}
    for link in tree.links:
        result.update({indices[u]: row for u, row in zip(joint_speeds(link.joint), link.speeds, strict=True) if u in indices})
    return result
