"""Checks of inertias in files of robots: inertias that no body can have, and leaves that move without any."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from symdyn.shown import shown
from symdyn.urdf.angles import rotation
from symdyn.urdf.robot import TYPES, Inertial, Origin, Robot, UrdfJoint
from symdyn.urdf.values import FileFaults

# Moments of inertia below this share of the largest are rounding.
_NONE = 1e-12
# Inertias below this share of the robot's largest are what rounding has left of none.
_ROUNDING = 1e-15


def demand_inertia(robot: Robot, order: list[UrdfJoint], moving: dict[str, str], faults: FileFaults) -> None:
    """Report inertias that no body can have, and of moving leaves without inertia along their joint.

    moving   joint -> the joint whose coordinate moves it; those that are not in it are fixed
    """
    _demand_definite(robot, faults)
    movers = _movers(order, moving)
    borne: dict[str, float] = {}
    further: set[str] = set()
    # From the leaves inwards: what has mass passes it to the joint that carries it, and that one to the next.
    heavy: set[str] = set()
    for link in (robot.links[joint.child] for joint in reversed(order)):
        mover = movers.get(link.name)
        if mover is None:
            continue
        leader = moving[mover.joint.name]
        inertial = link.inertial
        if inertial is not None and not inertial.nothing:
            borne[leader] = borne.get(leader, 0.0) + _along(mover, inertial)
            heavy.add(mover.joint.name)
        inner = movers.get(mover.joint.parent)
        if mover.joint.name in heavy and inner is not None:
            heavy.add(inner.joint.name)
            further.add(moving[inner.joint.name])
    for joint in order:
        if moving.get(joint.name) == joint.name and joint.name not in further and not borne.get(joint.name, 0.0) > 0:
            child = robot.links[joint.child]
            kept = "has no <inertial>" if child.inertial is None else "has no inertia along it"
            faults.at(joint.line, f"joint {shown(joint.name)} moves link {shown(child.name)} (line {child.line}), which "
                                  f"{kept}, and "
                                  "nothing else; give the link mass and inertia, or hold the joint: type=\"fixed\", or "
                                  f"fixed=[{shown(joint.name)}]")


def _demand_definite(robot: Robot, faults: FileFaults) -> None:
    least = negligible(robot)
    for link in robot.links.values():
        if link.inertial is not None and max(map(abs, link.inertial.inertia)) > least:
            values = np.linalg.eigvalsh(tensor(link.inertial))
            if values[0] < -_NONE * np.abs(values).max():
                listed = ", ".join(f"{v:.4g}" for v in values)
                faults.at(link.inertial.line, f"link {shown(link.name)}: its inertia has the principal moments [{listed}] kg "
                                              "m^2, one "
                                              "is negative; give the inertia about the centre of mass")


class _Mover(NamedTuple):
    """The joint that a link moves with, and the link's frame in that joint's: R (3, 3) and p (3,), m."""

    joint: UrdfJoint
    R: np.ndarray
    p: np.ndarray


def _movers(order: list[UrdfJoint], moving: dict[str, str]) -> dict[str, _Mover]:
    """The mover of each link that moves."""
    result: dict[str, _Mover] = {}
    for joint in order:
        before = result.get(joint.parent)
        if joint.name in moving:
            result[joint.child] = _Mover(joint, np.eye(3), np.zeros(3))
        elif before is not None:
            turn, shift = place(joint.origin)
            result[joint.child] = _Mover(before.joint, before.R @ turn, before.p + before.R @ shift)
    return result


def _along(mover: _Mover, inertial: Inertial) -> float:
    """Inertia of a link along the joint that moves it: kg for a prismatic one, else kg m^2."""
    joint = mover.joint
    if TYPES[joint.kind] != 1:
        return 0.0 if inertial.nothing else 1.0
    if joint.kind == "prismatic":
        return inertial.mass
    turn, shift = place(inertial.origin)
    axis = np.array(joint.axis)
    center = mover.p + mover.R @ shift
    arm = np.cross(axis, center)
    across = (mover.R @ turn).T @ axis
    result = inertial.mass * (arm @ arm) + across @ tensor(inertial) @ across
    least = _NONE * (np.abs(inertial.inertia).max() + inertial.mass * (center @ center))
    return float(result) if result > least else 0.0


def negligible(robot: Robot) -> float:
    """Largest entries of an inertia that is none, kg m^2."""
    entries = [abs(entry) for link in robot.links.values() if link.inertial is not None for entry in link.inertial.inertia]
    return _ROUNDING * max(entries, default=0.0)


def place(origin: Origin) -> tuple[np.ndarray, np.ndarray]:
    """R (3, 3) and p (3,) of an origin."""
    return np.array(rotation(origin.rpy)), np.array(origin.xyz)


def tensor(inertial: Inertial) -> np.ndarray:
    """(3, 3) about the centre of mass in the axes that the file gives it in, kg m^2."""
    xx, xy, xz, yy, yz, zz = inertial.inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
