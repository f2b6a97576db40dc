"""What makes a robot of a file a tree that can move."""

from __future__ import annotations

import numpy as np

from symdyn.urdf.angles import rotation
from symdyn.urdf.robot import TYPES, Inertial, Origin, Robot, UrdfJoint
from symdyn.urdf.values import FileFaults, nearest

# Moments of inertia below this share of the largest are rounding.
_NONE = 1e-12
# Inertias below this share of the robot's largest are what rounding has left of none.
_ROUNDING = 1e-15


def outwards(robot: Robot, faults: FileFaults) -> tuple[str, list[UrdfJoint]]:
    """The root link, and the joints such that each comes after the one that carries its parent, limb by limb."""
    ends = [(j, end, name) for j in robot.joints.values() for end, name in (("parent", j.parent), ("child", j.child)) if name]
    for joint, end, name in ends:
        if name not in robot.links:
            faults.at(joint.line, f"joint {joint.name!r} has the {end} {name!r}, which is no link of the file"
                                  f"{nearest(name, robot.links)}")
    carrying: dict[str, UrdfJoint] = {}
    hanging: dict[str, list[UrdfJoint]] = {}
    for joint in robot.joints.values():
        if joint.child in carrying:
            other = carrying[joint.child]
            faults.at(joint.line, f"link {joint.child!r} is the child of joint {joint.name!r} and of joint {other.name!r} (line "
                                  f"{other.line}), a loop; a URDF is a tree: leave one out, and add it with system.close_loop")
            continue
        carrying[joint.child] = joint
        hanging.setdefault(joint.parent, []).append(joint)
    roots = [name for name in robot.links if name not in carrying]
    if len(roots) > 1:
        found = ", ".join(f"{name!r} (line {robot.links[name].line})" for name in roots)
        faults.at(robot.links[roots[1]].line, f"{len(roots)} links are the child of no joint: {found}; join all but one to the "
                                              "rest")
    order: list[UrdfJoint] = []
    waiting = [joint for root in roots for joint in hanging.get(root, [])][::-1]
    while waiting:
        order.append(waiting.pop())
        waiting += hanging.get(order[-1].child, [])[::-1]
    looped = [joint for joint in carrying.values() if joint not in order and joint.parent in robot.links]
    if looped:
        names = ", ".join(f"{joint.name!r} (line {joint.line})" for joint in looped)
        faults.at(looped[0].line, f"joints {names} hang on each other in a loop; a URDF is a tree that begins at one link")
    return (roots[0] if roots else ""), order


def mimicked(robot: Robot, held: frozenset[str], faults: FileFaults) -> dict[str, tuple[str, float, float]]:
    """For each joint that mimics: the joint whose coordinate q it follows in the end, "" if that is held; its coordinate is
    multiplier q + offset."""
    found: dict[str, tuple[str, float, float]] = {}
    for joint in robot.joints.values():
        source, multiplier, offset, passed = joint, 1.0, 0.0, [joint.name]
        while source.mimic is not None:
            mimic = source.mimic
            following = robot.joints.get(mimic.joint)
            offset += multiplier * mimic.offset
            multiplier *= mimic.multiplier
            if following is None:
                if source is joint and mimic.joint:
                    faults.at(mimic.line, f"joint {joint.name!r} mimics {mimic.joint!r}, which is no joint of the file"
                                          f"{nearest(mimic.joint, robot.joints)}")
                break
            if following.name in passed:
                if following is joint:
                    faults.at(mimic.line, f"joints {', '.join(map(repr, passed))} mimic each other in a circle; leave out one "
                                          "<mimic>")
                break
            if following.kind in ("planar", "floating"):
                if source is joint:
                    faults.at(mimic.line, f"joint {joint.name!r} mimics {following.name!r}, which is {following.kind} and has "
                                          "several coordinates; take a joint with one")
                break
            source = following
            passed.append(source.name)
        if joint.mimic is not None:
            idle = source.kind == "fixed" or source.name in held
            found[joint.name] = ("" if idle else source.name, multiplier, offset)
    return found


def demand_inertia(robot: Robot, order: list[UrdfJoint], moving: dict[str, str], faults: FileFaults) -> None:
    """Tell of inertias that no body can have, and of moving leaves without inertia along their joint.

    moving   joint -> the joint whose coordinate moves it; those that are not in it are fixed
    """
    least = negligible(robot)
    for link in robot.links.values():
        if link.inertial is not None and max(map(abs, link.inertial.inertia)) > least:
            values = np.linalg.eigvalsh(tensor(link.inertial))
            if values[0] < -_NONE * np.abs(values).max():
                listed = ", ".join(f"{v:.4g}" for v in values)
                faults.at(link.inertial.line, f"link {link.name!r}: its inertia has the principal moments [{listed}] kg m^2, one "
                                              "is negative; give the inertia about the centre of mass")
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
            faults.at(joint.line, f"joint {joint.name!r} moves link {child.name!r} (line {child.line}), which {kept}, and nothing "
                                  f"else; give the link mass and inertia, make the joint fixed, or pass fixed=[{joint.name!r}]")


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
