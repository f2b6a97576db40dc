"""A mechanism as plain text for the peers; `model.hpp` reads it and documents its format."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import SymdynError
from symdyn.model.bodies import Body
from symdyn.model.joints import Free, Joint, Prismatic, Revolute
from symdyn.model.joints.base import IDENTITY
from symdyn.model.orientation import EulerParameters
from symdyn.model.record import Model, joint_speeds

_AXES = {(1, 0, 0): "X", (0, 1, 0): "Y", (0, 0, 1): "Z"}


@dataclass(frozen=True)
class Description:
    """Description of a mechanism for the peers.

    text      gravity, joints and bodies; p0, p1, ... stand for the parameters
    values    number of each parameter
    q_order   for each coordinate of the peers, which one of symdyn's it is; u_order: the same of the speeds
    """

    text: str
    values: np.ndarray
    q_order: tuple[int, ...]
    u_order: tuple[int, ...]


def describe(model: Model) -> Description:
    """The description of a checked model, with its default numbers.

    Raises SymdynError for what the text has no words for, and for a parameter without a number.
    """
    missing = [p.name for p in model.parameters if p not in model.defaults]
    if missing:
        raise SymdynError(f"{model.name} has no number for {', '.join(missing)}; add them to its defaults to compare it")
    if model.loads or model.ground_motion is not None:
        raise SymdynError(f"{model.name} has loads or a moving ground; peers are compared under gravity alone")
    writer = _Writer(model)
    writer.line("gravity", *model.gravity)
    moved_by = {-1: 0}  # body, -1 the ground -> number of the joint that moves it
    for joint, parent, child in zip(model.joints, model.parents, model.children, strict=True):
        moved_by[child] = writer.joint(joint, moved_by[parent])
        writer.body(model.bodies[child], moved_by[child])
    q = [model.coordinates.index(s) for s in writer.coordinates]
    u = [model.speeds.index(s) for s in writer.speeds]
    values = np.array([float(model.defaults[p]) for p in model.parameters])
    return Description("\n".join(writer.lines) + "\n", values, tuple(q), tuple(u))


@dataclass
class _Writer:
    """Collects the lines, and the coordinates and speeds in the peers' order."""

    model: Model
    lines: list[str] = field(default_factory=list)
    coordinates: list[Any] = field(default_factory=list)
    speeds: list[Any] = field(default_factory=list)
    joints: int = 0

    def line(self, word: str, *values: Any) -> None:
        self.lines.append(" ".join([word, *[self.number(v) for v in values]]))

    def number(self, value: Any) -> str:
        """A number, or a parameter with its sign."""
        for sign, text in ((1, ""), (-1, "-")):
            if sign * value in self.model.parameters:
                return f"{text}p{self.model.parameters.index(sign * value)}"
        if not sp.sympify(value).is_number:
            raise SymdynError(f"{self.model.name} has the expression {value}; the peers take a number, or a parameter with or "
                              "without a sign")
        return repr(int(value) if value == int(value) else float(value))

    def body(self, body: Body, joint: int) -> None:
        m = body.inertia
        self.line(f"body {joint}", body.mass, *body.com, m[0, 0], m[0, 1], m[0, 2], m[1, 1], m[1, 2], m[2, 2])

    def joint(self, joint: Joint, parent: int) -> int:
        """Add the simple joints that a joint consists of, with massless bodies between; returns the last one's number."""
        coordinates, place = list(joint.coordinates), tuple(joint.parent_point)
        turned = _turned(joint)
        for kind in self.kinds(joint):
            if turned:
                assert isinstance(joint, (Revolute, Prismatic))
                self.line(f"turned {parent} {kind}", *joint.axis, *joint.parent_rotation, *place)
            else:
                self.line(f"joint {parent} {kind}", *place)
            self.joints += 1
            parent, place, turned = self.joints, (0, 0, 0), False
        if joint.child_rotation != sp.Matrix(IDENTITY) or any(joint.child_point):
            R = joint.child_rotation.T
            self.line(f"frame {parent}", *R, *(-R * sp.Matrix(joint.child_point)))
        if isinstance(joint, Free) and isinstance(joint.orientation, EulerParameters):
            coordinates.append(coordinates.pop(3))  # Pinocchio has theta0 last
        self.coordinates += coordinates
        self.speeds += joint_speeds(joint)
        return parent

    def kinds(self, joint: Joint) -> Iterable[str]:
        """The words for a joint, first to last."""
        if isinstance(joint, (Revolute, Prismatic)) and tuple(joint.axis) in _AXES:
            return [("R" if isinstance(joint, Revolute) else "P") + _AXES[tuple(joint.axis)]]
        if isinstance(joint, Free) and not joint.body_velocity and not _turned(joint):
            orientation = joint.orientation
            if isinstance(orientation, EulerParameters):
                return ["PX", "PY", "PZ", "S"]
            if not orientation.angular_velocity:
                return ["PX", "PY", "PZ", *[f"R{letter}" for letter in orientation.sequence]]
        raise SymdynError(f"joint {joint.name!r} of {self.model.name} is {joint.kind}; the peers take revolute and prismatic "
                          "joints about and along coordinate axes, and free ones in frames that are not turned, with Euler "
                          "parameters or with the derivatives of Euler angles as speeds")


def _turned(joint: Joint) -> bool:
    """Whether a joint's axes are turned on the body before."""
    return bool(joint.parent_rotation != sp.Matrix(IDENTITY))
