"""Checks that the robot of a file is a tree: each joint carries one link, all hang on one root; and who mimics whom."""

from __future__ import annotations

from symdyn.urdf.robot import Robot, UrdfJoint
from symdyn.urdf.values import LARGEST, FileFaults, nearest


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
    if len(roots) > 1 and not robot.dropped:  # one that was dropped may carry the other
        result = ", ".join(f"{name!r} (line {robot.links[name].line})" for name in roots)
        faults.at(robot.links[roots[1]].line, f"{len(roots)} links are the child of no joint: {result}; join all but one to the "
                                              "rest")
    order: list[UrdfJoint] = []
    waiting = [joint for root in roots for joint in hanging.get(root, [])][::-1]
    while waiting:
        order.append(waiting.pop())
        waiting += hanging.get(order[-1].child, [])[::-1]
    placed = {joint.name for joint in order}
    looped = [joint for joint in carrying.values() if joint.name not in placed and joint.parent in robot.links]
    if looped:
        names = ", ".join(f"{joint.name!r} (line {joint.line})" for joint in looped)
        which = f"joints {names} hang on each other" if len(looped) > 1 else f"joint {looped[0].name!r} hangs a link on itself"
        faults.at(looped[0].line, f"{which} in a loop; a URDF is a tree that begins at one link")
    return (roots[0] if roots else ""), order


def mimicked(robot: Robot, held: frozenset[str], faults: FileFaults) -> dict[str, tuple[str, float, float]]:
    """For each joint that mimics: the joint whose coordinate q it follows in the end, "" if that does not move it; its
    coordinate is multiplier q + offset. Joints that are held are at zero, and follow none."""
    result: dict[str, tuple[str, float, float]] = {}
    for joint in robot.joints.values():
        source, multiplier, offset, passed = joint, 1.0, 0.0, [joint.name]
        while source.mimic is not None and source.name not in held:
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
                    which = f"joints {', '.join(map(repr, passed))} mimic each other in a circle; leave out one <mimic>"
                    faults.at(mimic.line, which if len(passed) > 1 else f"joint {joint.name!r} mimics itself; leave out <mimic>")
                break
            if following.kind in ("planar", "floating"):
                if source is joint:
                    faults.at(mimic.line, f"joint {joint.name!r} mimics {following.name!r}, which is {following.kind} and has "
                                          "several coordinates; take a joint with one")
                break
            source = following
            passed.append(source.name)
        if joint.mimic is not None and joint.name not in held and not max(abs(multiplier), abs(offset)) <= LARGEST:
            faults.at(joint.mimic.line, f"joint {joint.name!r} mimics along {' -> '.join(map(repr, passed[1:]))}; multiplier "
                      f"{multiplier:.4g} and offset {offset:.4g} of all of them together are more than {LARGEST:.0e}; give "
                      "smaller ones")
        elif joint.mimic is not None and joint.name not in held:
            idle = source.kind == "fixed" or source.name in held or multiplier == 0
            result[joint.name] = ("" if idle else source.name, multiplier, offset)
    return result
