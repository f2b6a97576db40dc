"""Where the loads of a model act on its bodies, and how, for pictures: every force and torque by itself, n-frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.formulation.loads.recorded import Loads
from symdyn.model.elements import AddedMass, Element, MooringLine
from symdyn.model.joints import Joint, Prismatic, Revolute
from symdyn.model.loads import Force, ForceBetween, JointForce, SpringDamper, Torque
from symdyn.model.record import Model
from symdyn.shown import name_of
from symdyn.spatial.vectors import cross, zeros

FORCE, TORQUE = "force", "torque"
_GROUND = "ground"


@dataclass(frozen=True)
class Acting:
    """One force or torque of a load on a body.

    point   where the force acts, body axes, or the joint at whose point it does; None: at the centre of mass of the body
    """

    load: Any
    body: str
    kind: str
    point: Any = None

    @property
    def record(self) -> tuple[str, str, str]:
        """Name, body and kind ("force" or "torque")."""
        return str(self.load.label), self.body, self.kind


def acting(model: Model) -> tuple[Acting, ...]:
    """The forces and torques on bodies, in the order of the loads: without those of contacts that have points of their own, and
    of joints with several speeds, along which forces have no one point and direction."""
    contacts = [*(c.name for c in model.contacts if c.at), *(c.name for c in model.compliant)]
    own = {text for name in contacts for text in (f"contact {name}", f"contact {name}: moment")}
    joints = {j.name: j for j in model.joints}
    return tuple(one for load in model.loads if load.label not in own for one in _of_load(joints, load) if one.body != _GROUND)


def _of_load(joints: Mapping[str, Joint], load: Any) -> Iterator[Acting]:
    if isinstance(load, Force):
        yield Acting(load, name_of(load.body), FORCE, load.point)
        if load.reaction is not None:
            # At the point of the first body: where the other's coincides.
            yield Acting(load, name_of(load.reaction), FORCE)
    elif isinstance(load, Torque):
        yield Acting(load, name_of(load.body), TORQUE)
        if load.reaction is not None:
            yield Acting(load, name_of(load.reaction), TORQUE)
    elif isinstance(load, JointForce):
        joint = joints.get(name_of(load.joint))
        if isinstance(joint, (Prismatic, Revolute)):
            kind = FORCE if isinstance(joint, Prismatic) else TORQUE
            yield Acting(load, name_of(joint.child), kind, joint)
            yield Acting(load, name_of(joint.parent), kind, joint)
    elif isinstance(load, (SpringDamper, ForceBetween)):
        yield Acting(load, name_of(load.body_a), FORCE, load.point_a)
        yield Acting(load, name_of(load.body_b), FORCE, load.point_b)
    elif isinstance(load, MooringLine):
        yield Acting(load, name_of(load.body), FORCE, load.fairlead)
    elif isinstance(load, Element) and not isinstance(load, AddedMass):
        yield Acting(load, name_of(load.body), FORCE, zeros(3))
        yield Acting(load, name_of(load.body), TORQUE, zeros(3))


def applied_loads(loads: Loads, ones: Sequence[Acting]) -> np.ndarray:
    """Where each acts, m, and its vector, N or N m, n-frame, (n, 6)."""
    wrenches: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}
    rows: list[Any] = []
    for one in ones:
        if id(one.load) not in wrenches:
            wrenches[id(one.load)] = loads.of_one(one.load).bodies
        rows += [_place(loads, one), _vector(loads, one, wrenches[id(one.load)])]
    return np.array(rows, dtype=object).reshape(-1, 6)


def _place(loads: Loads, one: Acting) -> np.ndarray:
    load, at, body = one.load, one.point, one.body
    if isinstance(load, JointForce):
        at = at.child_point if body == name_of(at.child) else at.parent_point
    elif isinstance(load, Force) and at is None:
        at, body = load.point, load.body
    elif at is None:
        at = next(b.com for b in loads.model.bodies if b.name == body)
    return loads.kinematics.position(loads.pose(body), loads.algebra.constants(at))


def _vector(loads: Loads, one: Acting, wrenches: Sequence[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """The force, or the torque about the point, from the wrench of the load on the body, which is about its link's origin."""
    pose = loads.pose(one.body)
    if isinstance(one.load, JointForce):
        joint = one.point
        parent = loads.kinematics.rotation(loads.pose(joint.parent)) @ loads.algebra.matrix(joint.parent_rotation)
        axis = parent @ loads.algebra.constants(joint.axis)
        value = loads.value(one.load.values[0])
        return axis * (value if one.body == name_of(joint.child) else -value)
    f, n = wrenches[[b.name for b in loads.model.bodies].index(one.body)]
    if one.kind == FORCE:
        own = f
    else:
        own = n if isinstance(one.load, Torque) else n - cross(pose.p, f)
    return loads.kinematics.frame(pose.link)[0] @ own
