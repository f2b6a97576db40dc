"""Pose and motion of one body for load elements, recorded where an element asks for it."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from symdyn.formulation.trees.kinematics import Kinematics
from symdyn.formulation.trees.tree import GROUND, Pose, Tree
from symdyn.model.joints import Fixed, Free, Joint
from symdyn.model.orientation import EulerAngles
from symdyn.model.record import Model
from symdyn.model.symbols import Coordinate
from symdyn.spatial.vectors import cross, dot, vector, zeros

# Below this (sine of the half angle)^2 the rotation vector is taken from a series, which is then exact to 1e-17.
SMALL = Fraction(1, 1000)
# asin(x) / x = sum of these times x^(2k)
ARCSINE = (Fraction(1), Fraction(1, 6), Fraction(3, 40), Fraction(5, 112), Fraction(35, 1152), Fraction(63, 2816))


class BodySite:
    """The symdyn.model.elements.Site of body number k."""

    def __init__(self, tree: Tree, kinematics: Kinematics, k: int) -> None:
        self.algebra = tree.algebra
        self.tree = tree
        self.kinematics = kinematics
        self.pose: Pose = tree.poses[k]
        self.joint = joint_with_ground(tree.model, k)

    @cached_property
    def R(self) -> np.ndarray:
        return self.kinematics.rotation(self.pose)

    @cached_property
    def p(self) -> np.ndarray:
        return self.kinematics.position(self.pose, zeros(3))

    @cached_property
    def omega(self) -> np.ndarray:
        if self.pose.link == GROUND:
            return zeros(3)
        return self.pose.R.T @ self.kinematics.twists[self.pose.link][0]

    @cached_property
    def v(self) -> np.ndarray:
        if self.pose.link == GROUND:
            return zeros(3)
        omega, v = self.kinematics.twists[self.pose.link]
        return self.pose.R.T @ (v + cross(omega, self.pose.p))

    @cached_property
    def gravity(self) -> np.ndarray:
        return self.algebra.constants(self.tree.model.gravity)

    @property
    def angles_given(self) -> bool:
        """Whether the body's own joint with the ground has roll, pitch and yaw as coordinates."""
        return has_roll_pitch_yaw(self.joint)

    @cached_property
    def angles(self) -> Sequence[Any]:
        """phi, theta, psi of R = R_z(psi) R_y(theta) R_x(phi)."""
        if self.angles_given:
            assert self.joint is not None
            psi, theta, phi = (self.algebra.leaves[q] for q in self.joint.coordinates[-3:])
            return phi, theta, psi
        R, apply = self.R, self.algebra.recorder.apply
        return apply("atan2", R[2, 1], R[2, 2]), apply("asin", -R[2, 0]), apply("atan2", R[1, 0], R[0, 0])

    @cached_property
    def rotation_vector(self) -> np.ndarray:
        """angle / sin(angle / 2) times the vector part of the Euler parameters, p_k = (R_ij - R_ji) / (4 p_0)."""
        R, recorder = self.R, self.algebra.recorder
        p_0 = self.algebra.sqrt(1 + R[0, 0] + R[1, 1] + R[2, 2]) / 2
        part = vector(R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]) / (4 * p_0)
        square = dot(part, part)
        series: Any = 0
        for factor in reversed(ARCSINE):
            series = series * square + factor
        # The branch that is not taken must not divide by zero: its derivative would not be a number.
        sine = self.algebra.sqrt(recorder.apply("max", square, SMALL))
        far = recorder.apply("atan2", sine, p_0) / sine
        return 2 * recorder.apply("select", recorder.apply("lt", square, SMALL), series, far) * part


def has_roll_pitch_yaw(joint: Joint | None) -> bool:
    """Whether a joint with the ground has roll, pitch and yaw of R = R_z(psi) R_y(theta) R_x(phi) as coordinates."""
    return (isinstance(joint, Free) and isinstance(joint.orientation, EulerAngles) and joint.orientation.sequence == "ZYX"
            and joint.parent_rotation == sp.eye(3) == joint.child_rotation
            and all(isinstance(q, Coordinate) for q in joint.coordinates))


def joint_with_ground(model: Model, k: int) -> Joint | None:
    """The joint with the ground that moves body k, through bodies that are fixed to each other; None if there is none, or the
    ground moves."""
    if model.ground_motion is not None:
        return None
    by_child = {child: (joint, parent) for joint, parent, child in zip(model.joints, model.parents, model.children, strict=True)}
    joint, parent = by_child[k]
    while parent != -1 and isinstance(joint, Fixed) and joint.parent_rotation == joint.child_rotation:
        joint, parent = by_child[parent]
    return joint if parent == -1 else None
