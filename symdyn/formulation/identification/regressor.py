"""The regressor: what moves a tree of links is linear in the inertial parameters of its bodies, tau = Y pi.

With ten parameters a body, its mass m, first moment h = m r_G and inertia I about its own origin, the force and the moment
that its motion needs, f = m a + U h and n = I alpha + omega x I omega + h x a, hold no product of two of them. So the
force that each parameter takes is that of a body which has this parameter alone, one of it and nothing else, carried
inwards from joint to joint.
Source: Atkeson, An and Hollerbach, Estimation of inertial parameters of manipulator loads and links (1986); Khalil and Dombre,
Modeling, Identification and Control of Robots, chapter 12.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from symdyn.formulation.trees.link import LinkMotion, inertial_wrench, rates_matrix
from symdyn.formulation.trees.newton_euler import outward
from symdyn.formulation.trees.tree import GROUND, Pose, Tree
from symdyn.spatial.inertia import Inertia
from symdyn.spatial.vectors import Vector, cross, dot, vector, zeros
from symdyn.tape.node import is_zero

# The ten parameters, in order: kg, kg m, kg m^2.
PARAMETERS = ("m", "h_x", "h_y", "h_z", "I_xx", "I_xy", "I_xz", "I_yy", "I_yz", "I_zz")
_PLACES = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def entries(inertia: Inertia) -> list[Any]:
    """The ten parameters of an inertia."""
    return [inertia.m, *inertia.h, *[inertia.I[index] for index in _PLACES]]


def unit_inertias() -> list[Inertia]:
    """For each parameter the inertia that has one of it, and nothing else."""
    units = []
    for k in range(len(PARAMETERS)):
        values = [int(k == i) for i in range(len(PARAMETERS))]
        I = zeros(3, 3)
        for (i, j), value in zip(_PLACES, values[4:], strict=True):
            I[i, j] = I[j, i] = value
        units.append(Inertia(values[0], vector(*values[1:4]), I))
    return units


def inertial_parameters(tree: Tree) -> np.ndarray:
    """pi, (10 n_b,): for each body of the model PARAMETERS about its origin, body axes."""
    algebra = tree.algebra
    values: list[Any] = []
    for body in tree.model.bodies:
        with algebra.section(f"body {body.name}: inertial parameters about its origin"):
            about_com = Inertia(algebra.expression(body.mass), zeros(3), algebra.matrix(body.inertia))
            values += entries(about_com.moved(np.eye(3, dtype=int).astype(object), algebra.constants(body.com)))
    return vector(*values)


def regressor(tree: Tree, w_dot: Vector, a_0: np.ndarray, poses: Sequence[Pose] | None = None) -> np.ndarray:
    """Y (n_w, 10 n): joint forces that one of each parameter takes, at joint accelerations w_dot (n_w,).

    a_0      acceleration of the base, n-frame, (3,); -gravity makes the weight part of it
    poses    frames that the parameters are about, n of them; default: those of the bodies
    """
    motions = outward(tree, w_dot, a_0)
    units = unit_inertias()
    poses = tree.poses if poses is None else poses
    Y = zeros(len(tree.w), len(units) * len(poses))
    for k, pose in enumerate(poses):
        if pose.link == GROUND:
            continue
        with tree.algebra.section(f"link {tree.links[pose.link].name}: forces at the joints, a column for each parameter"):
            motion = _seen_from(pose, motions[pose.link])
            for column, unit in enumerate(units):
                f, n = inertial_wrench(unit, motion)
                carry(tree, Y[:, len(units) * k + column], pose, f, n)
    return Y


def carry(tree: Tree, tau: np.ndarray, pose: Pose, f: np.ndarray, n: np.ndarray) -> None:
    """Add to the joint forces tau (n_w,) what balances a wrench: f, n about the origin of a frame on a link, in its axes."""
    f = pose.R @ f
    n = pose.R @ n + cross(pose.p, f)
    for k in tree.path(pose.link):
        if all(is_zero(e) for e in (*f, *n)):
            return
        link = tree.links[k]
        for column, row in enumerate(link.speeds):
            tau[row] = tau[row] + dot(link.S[:3, column], n) + dot(link.S[3:, column], f)
        f = link.R @ f
        n = link.R @ n + cross(link.r, f)


def project(tree: Tree, Y: np.ndarray) -> np.ndarray:
    """D^T Y: from the joints' speeds to the generalized ones, which leaves out joints that given motion drives, (n_u, .)."""
    if tree.plain:
        return Y
    return tree.D.T @ Y if len(tree.w) else zeros(tree.D.shape[1], Y.shape[1])


def _seen_from(pose: Pose, motion: LinkMotion) -> LinkMotion:
    """The motion of a frame on a link from that of the link, in the frame's own axes."""
    E = pose.R.T
    omega, alpha = E @ motion.omega, E @ motion.alpha
    U, P = rates_matrix(omega, alpha)
    return LinkMotion(omega, alpha, E @ motion.at(pose.p), U, P)
