"""Start values of absolute coordinates, from those of the relative ones."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import ModelError, ModelWarning
from symdyn.formulation.trees.equations import tree_of
from symdyn.formulation.trees.kinematics import Kinematics
from symdyn.model.joints import Free, Joint
from symdyn.model.orientation import EulerAngles
from symdyn.model.record import Model, joint_speeds
from symdyn.spatial.vectors import cross, zeros
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.tape import Tape


def absolute_start(relative: Model, absolute: Model) -> dict[sp.Symbol, float]:
    """Numbers for coordinates and speeds of every body's own joint, at the relative model's initial state.

    Nothing where parameters have no numbers: then the user gives the start.
    """
    if any(p not in relative.defaults for p in relative.parameters):
        return {}
    own = [(k, j) for j, k in zip(absolute.joints, absolute.children, strict=True) if j.inner]
    values: dict[str, float] = {p.name: float(relative.defaults[p]) for p in relative.parameters} | {"t": 0.0}
    for group in (relative.coordinates, relative.speeds, [z.symbol for z in relative.states], relative.inputs):
        values.update({s.name: float(relative.initial.get(s, 0.0)) for s in group})
    tree = tree_of(relative, "body")
    kinematics = Kinematics(tree)
    ground_R, ground_p = kinematics.rotation(tree.ground), kinematics.position(tree.ground, zeros(3))
    ground_omega, ground_v = kinematics.twist(tree.ground, zeros(3))
    poses, twists = [], []
    for pose in tree.poses:  # by the speeds: rates of angles do not exist at gimbal lock, where speeds may be those of the body
        arm, (omega, v) = kinematics.position(pose, zeros(3)) - ground_p, kinematics.twist(pose, zeros(3))
        poses.append([*(ground_R.T @ arm), *(ground_R.T @ kinematics.rotation(pose)).ravel()])
        twists.append([*(ground_R.T @ (v - ground_v - cross(ground_omega, arm))), *(ground_R.T @ (omega - ground_omega))])
    tape = Tape.of(tree.algebra.recorder, poses=np.array(poses, dtype=object), twists=np.array(twists, dtype=object))
    result = {name: array[0] for name, array in evaluate_rows(tape, values, 1).items()}
    start: dict[sp.Symbol, float] = {}
    for k, joint in own:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            start |= _of_joint(joint, result["poses"][k], result["twists"][k])
        if any("imbal" in str(warning.message) for warning in caught):
            angles: Any = getattr(joint, "orientation", None)
            warnings.warn(f"{relative.name}: the Euler angles {angles.sequence} of {absolute.bodies[k].name} are singular at the "
                          "initial state (gimbal lock), so that they have no derivatives there; pass an orientation of another "
                          "sequence, or sd.EulerParameters()", ModelWarning, stacklevel=5)
    wrong = [symbol.name for symbol, value in start.items() if not np.isfinite(value)]
    if wrong:
        raise ModelError([f"the initial state has no numbers in absolute coordinates: {', '.join(wrong)} would not be "
                          "finite; give initial values and defaults at which positions and velocities of all bodies exist"],
                         relative.name)
    return start


def _of_joint(joint: Joint, pose: np.ndarray, twist: np.ndarray) -> dict[sp.Symbol, float]:
    """Start values of a body's own joint; twist: velocity of its origin and angular velocity, axes of the ground."""
    p, R, rate, omega = pose[:3], pose[3:].reshape(3, 3), twist[:3], twist[3:]
    if not isinstance(joint, Free):
        position, speeds = [p[0], p[1], np.arctan2(R[1, 0], R[0, 0])], [rate[0], rate[1], omega[2]]
    else:
        turned, turning = _orientation(joint.orientation, R, omega)
        position, speeds = [*p, *turned], [*rate[:3], *turning]
    numbers = dict(zip(joint.coordinates, position, strict=True)) | dict(zip(joint_speeds(joint), speeds, strict=True))
    return {symbol: float(value) for symbol, value in numbers.items()}


def _orientation(orientation: Any, R: np.ndarray, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and speeds of an orientation, for a rotation and its angular velocity in the parent's axes."""
    from scipy.spatial.transform import Rotation

    if not isinstance(orientation, EulerAngles):
        x, y, z, w = Rotation.from_matrix(R).as_quat()
        return np.array([w, x, y, z]) * (-1 if w < 0 else 1), R.T @ omega
    angles = Rotation.from_matrix(R).as_euler(orientation.sequence)
    if orientation.angular_velocity:
        return angles, R.T @ omega
    first, second, third = orientation.axes
    unit = np.eye(3)
    after_first = Rotation.from_euler(orientation.sequence[0], angles[0]).as_matrix()
    after_second = after_first @ Rotation.from_euler(orientation.sequence[1], angles[1]).as_matrix()
    G = np.column_stack([unit[first], after_first @ unit[second], after_second @ unit[third]])
    return angles, np.linalg.lstsq(G, omega, rcond=None)[0]
