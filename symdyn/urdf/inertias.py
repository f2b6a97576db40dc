"""What robots of files weigh: inertias that no body can have, and leaves that move without any."""

from __future__ import annotations

import numpy as np

from symdyn.urdf.angles import rotation
from symdyn.urdf.robot import TYPES, Inertial, Origin, Robot, UrdfJoint
from symdyn.urdf.values import FileFaults

# Moments of inertia below this share of the largest are rounding.
_NONE = 1e-12
# Inertias below this share of the robot's largest are what rounding has left of none.
_ROUNDING = 1e-15


def demand_inertia(robot: Robot, order: list[UrdfJoint], moving: dict[str, str], faults: FileFaults) -> None:
    """Tell of inertias that no body can have, and of moving leaves without inertia along their joint.

    moving   joint -> the joint whose coordinate moves it; those that are not in it are fixed
    """
    _demand_definite(robot, faults)
    carried = {joint.child: joint for joint in order}
    borne: dict[str, float] = {}
    further: set[str] = set()
    for link in robot.links.values():
        mover, R, p = _mover(link.name, carried, moving)
        if mover is None or link.inertial is None or link.inertial.nothing:
            continue
        leader = moving[mover.name]
        borne[leader] = borne.get(leader, 0.0) + _along(mover, link.inertial, R, p)
        inner, _, _ = _mover(mover.parent, carried, moving)
        while inner is not None:
            further.add(moving[inner.name])
            inner, _, _ = _mover(inner.parent, carried, moving)
    for joint in order:
        if moving.get(joint.name) == joint.name and joint.name not in further and not borne.get(joint.name, 0.0) > 0:
            child = robot.links[joint.child]
            kept = "has no <inertial>" if child.inertial is None else "has no inertia along it"
            faults.at(joint.line, f"joint {joint.name!r} moves link {child.name!r} (line {child.line}), which {kept}, and "
                                  "nothing else; give the link mass and inertia, or hold the joint: type=\"fixed\", or "
                                  f"fixed=[{joint.name!r}]")


def _demand_definite(robot: Robot, faults: FileFaults) -> None:
    least = negligible(robot)
    for link in robot.links.values():
        if link.inertial is not None and max(map(abs, link.inertial.inertia)) > least:
            values = np.linalg.eigvalsh(tensor(link.inertial))
            if values[0] < -_NONE * np.abs(values).max():
                listed = ", ".join(f"{v:.4g}" for v in values)
                faults.at(link.inertial.line, f"link {link.name!r}: its inertia has the principal moments [{listed}] kg m^2, one "
                                              "is negative; give the inertia about the centre of mass")


def _mover(name: str, carried: dict[str, UrdfJoint], moving: dict[str, str]) -> tuple[UrdfJoint | None, np.ndarray, np.ndarray]:
    """The joint that a link moves with, and the link's frame in that joint's: R (3, 3) and p (3,), m."""
    R, p = np.eye(3), np.zeros(3)
    while name in carried:
        joint = carried[name]
        if joint.name in moving:
            return joint, R, p
        turn, shift = place(joint.origin)
        R, p = turn @ R, shift + turn @ p
        name = joint.parent
    return None, R, p


def _along(joint: UrdfJoint, inertial: Inertial, R: np.ndarray, p: np.ndarray) -> float:
    """Inertia of a link that a joint moves along it: kg for a prismatic one, else kg m^2; R, p: the link's frame in it."""
    if TYPES[joint.kind] != 1:
        return 0.0 if inertial.nothing else 1.0
    if joint.kind == "prismatic":
        return inertial.mass
    turn, shift = place(inertial.origin)
    axis = np.array(joint.axis)
    arm = np.cross(axis, p + R @ shift)
    across = (R @ turn).T @ axis
    found = inertial.mass * (arm @ arm) + across @ tensor(inertial) @ across
    return float(found) if found > _NONE * (np.abs(inertial.inertia).max() + inertial.mass * (shift @ shift)) else 0.0


def negligible(robot: Robot) -> float:
    """How large the entries of an inertia that is none may be, kg m^2."""
    entries = [abs(entry) for link in robot.links.values() if link.inertial is not None for entry in link.inertial.inertia]
    return _ROUNDING * max(entries, default=0.0)


def place(origin: Origin) -> tuple[np.ndarray, np.ndarray]:
    """R (3, 3) and p (3,) of an origin."""
    return np.array(rotation(origin.rpy)), np.array(origin.xyz)


def tensor(inertial: Inertial) -> np.ndarray:
    """(3, 3) about the centre of mass in the axes that the file gives it in, kg m^2."""
    xx, xy, xz, yy, yz, zz = inertial.inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
