"""Joints of sympy.physics.mechanics as joints of symdyn's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import sympy as sp

from symdyn.errors import ModelError
from symdyn.model.bodies import Body
from symdyn.model.joints import Custom, Cylindrical, Fixed, Joint, Prismatic, Revolute, Spherical
from symdyn.model.orientation import SEQUENCES, EulerAngles
from symdyn.sympy_mechanics.taken import functions_of_time


@dataclass(frozen=True)
class Placed:
    """A body of symdyn's with that of SymPy's, its origin and its frame; offset: of the origin in the body's axes, of those that
    are the ground."""

    body: Body
    source: Any
    origin: Any
    frame: Any
    offset: Any = field(default_factory=lambda: sp.zeros(3, 1))

    def at(self, body: Any) -> Placed:
        """Another body that rests on this one, which is the ground."""
        try:
            offset = body.masscenter.pos_from(self.origin).to_matrix(self.frame)
        except ValueError:  # no position is given: it is at the fixed point
            offset = sp.zeros(3, 1)
        return replace(self, source=body, origin=body.masscenter, offset=offset)


def converted(joint: Any, parent: Placed, child: Placed, take: Callable[[str, Any], Any]) -> Joint:
    """The joint in symdyn. Raises ModelError for points and frames that move on their bodies."""
    from sympy.physics.mechanics import CylindricalJoint, PinJoint, PrismaticJoint, SphericalJoint, WeldJoint

    name, what = joint.name, f"joint {joint.name}"
    before, after = joint.parent_interframe, joint.child_interframe
    ends = {"parent_point": joint.parent_point.pos_from(parent.origin).to_matrix(parent.frame) + parent.offset,
            "child_point": joint.child_point.pos_from(child.origin).to_matrix(child.frame),
            "parent_rotation": parent.frame.dcm(before), "child_rotation": child.frame.dcm(after)}
    moving = sorted(str(f) for e in ends.values() for f in functions_of_time(e))
    if moving:
        raise ModelError([f"{what}: its points or intermediate frames depend on {', '.join(moving)}, but must be fixed to its "
                          f"bodies; add a joint for what moves"])
    ends = {key: take(what, e) for key, e in ends.items()}
    q, u = ([take(what, e) for e in column] for column in (joint.coordinates, joint.speeds))
    bodies = (name, parent.body, child.body)

    def axis(vector: Any) -> list[Any]:
        return list(take(what, vector.normalize().to_matrix(before)))

    if type(joint) is WeldJoint:
        return Fixed(*bodies, **ends)
    if type(joint) is PinJoint:
        return Revolute(*bodies, q[0], axis=axis(joint.joint_axis), speed=u[0], **ends)
    if type(joint) is PrismaticJoint:
        return Prismatic(*bodies, q[0], axis=axis(joint.joint_axis), speed=u[0], **ends)
    if type(joint) is CylindricalJoint:
        return Cylindrical(*bodies, q, axis(joint.joint_axis), u, **ends)
    if type(joint) is SphericalJoint and joint._rot_type.upper() == "BODY" and joint._amounts is None:
        sequence = "".join("XYZ"[int(c) - 1] if c in "123" else c for c in str(joint._rot_order).upper())
        if sequence in SEQUENCES:
            return Spherical(*bodies, q, EulerAngles(sequence), u, **ends)
    R = take(what, before.dcm(after))
    p = take(what, joint.child_point.pos_from(joint.parent_point).to_matrix(before))
    return Custom(*bodies, q, R, p, _units(joint), u, **ends)


def _units(joint: Any) -> list[str] | None:
    """Units of the coordinates of a joint, where they are known."""
    from sympy.physics.mechanics import PlanarJoint, SphericalJoint

    if isinstance(joint, PlanarJoint):
        return ["rad", "m", "m"]
    return ["rad"] * 3 if isinstance(joint, SphericalJoint) else None
