"""Elements to a Robot: every fault of the file is reported with its line."""

from __future__ import annotations

import math
from typing import TypeVar

from symdyn.shown import shown
from symdyn.urdf.document import Element
from symdyn.urdf.robot import INERTIA, TYPES, ZERO, Inertial, Link, Mimic, Origin, Robot, UrdfJoint
from symdyn.urdf.values import FileFaults, Triple

Named = TypeVar("Named", Link, UrdfJoint)
# Axis where none is given.
AXIS: Triple = (1.0, 0.0, 0.0)
# Elements that would contradict each other.
ONCE = {"link": ("inertial",), "joint": ("origin", "parent", "child", "axis", "dynamics", "mimic"),
        "inertial": ("origin", "mass", "inertia")}


def parse(root: Element, faults: FileFaults) -> Robot:
    """The robot of a file's root element; meshes, limits, transmissions and what simulators add are left out."""
    if root.tag != "robot":
        faults.at(root.line, f"the file holds a <{root.tag}>; a URDF holds a <robot>")
        return Robot("")
    _reject_xacro(root, faults)
    robot = Robot(root.attributes.get("name", "").strip())
    for element in root.children:
        if element.tag == "link":
            _add(robot.links, _link(element, faults), "link", faults)
        elif element.tag == "joint" and not _add(robot.joints, _joint(element, faults), "joint", faults):
            robot.dropped.append(element.line)
    if not robot.links:
        faults.at(root.line, "the robot has no links; a URDF has at least one <link name=\"...\">")
    return robot


def _reject_xacro(root: Element, faults: FileFaults) -> None:
    for element in root.everything():
        space, _, name = element.tag.rpartition("}")
        if "xacro" in space:
            faults.at(element.line, f"<xacro:{name}> is left over from xacro; run the file through xacro first")


def _add(known: dict[str, Named], result: Named, what: str, faults: FileFaults) -> bool:
    """Whether it has a name of its own."""
    if not result.name:
        return False
    if result.name in known:
        faults.at(result.line, f"the {what} {shown(result.name)} is there already, in line {known[result.name].line}; give each "
                              "a name "
                              "of its own")
        return False
    known[result.name] = result
    return True


def _demand_once(element: Element, what: str, faults: FileFaults) -> None:
    for tag in ONCE[element.tag]:
        result = list(element.all(tag))
        if len(result) > 1:
            faults.at(result[1].line, f"{what} has another <{tag}> in line {result[0].line}; leave one of them out")


def _origin(element: Element, what: str, faults: FileFaults) -> Origin:
    origin = element.find("origin")
    return Origin(faults.triple(origin, "xyz", what, ZERO), faults.triple(origin, "rpy", what, ZERO))


def _link(element: Element, faults: FileFaults) -> Link:
    name = faults.name(element, "name", "a link")
    _demand_once(element, f"link {shown(name)}", faults)
    inertial = element.find("inertial")
    return Link(name, None if inertial is None else _inertial(inertial, f"link {shown(name)}", faults), element.line)


def _inertial(element: Element, what: str, faults: FileFaults) -> Inertial:
    _demand_once(element, f"{what}: <inertial>", faults)
    mass, inertia = element.find("mass"), element.find("inertia")
    for tag, part in (("mass", mass), ("inertia", inertia)):
        if part is None:
            faults.at(element.line, f"{what}: <inertial> has no <{tag}>; add it, or leave out <inertial> for a link without mass")
    value = 0.0 if mass is None else faults.number(mass, "value", what)
    if value < 0:
        faults.at(element.line, f"{what} has the mass {value} kg; give zero or a positive mass")
    entries = [0.0] * 6 if inertia is None else [faults.number(inertia, entry, what) for entry in INERTIA]
    return Inertial(_origin(element, what, faults), value, tuple(entries), element.line)


def _joint(element: Element, faults: FileFaults) -> UrdfJoint:
    name = faults.name(element, "name", "a joint")
    what = f"joint {shown(name)}"
    _demand_once(element, what, faults)
    kind = faults.name(element, "type", what)
    if kind and kind not in TYPES:
        faults.at(element.line, f"{what} has the type {shown(kind)}; there are {', '.join(TYPES)}")
    ends = []
    for end in ("parent", "child"):
        result = element.find(end)
        if result is None:
            faults.at(element.line, f"{what} has no {end}; write <{end} link=\"...\"/>")
        ends.append("" if result is None else faults.name(result, "link", f"{what}: {end}"))
    dynamics = element.find("dynamics")
    damping = 0.0 if dynamics is None else faults.number(dynamics, "damping", what, 0.0)
    return UrdfJoint(name, kind, ends[0], ends[1], _origin(element, what, faults), _axis(element, kind, what, faults), damping,
                     _mimic(element, kind, what, faults), element.line)


def _axis(element: Element, kind: str, what: str, faults: FileFaults) -> Triple:
    """The axis with length 1, whatever its length in the file."""
    result = element.find("axis")
    if kind in ("fixed", "floating"):
        return AXIS
    axis = faults.triple(result, "xyz", what, AXIS)
    length = math.hypot(*axis)
    if length < 1e-12:
        faults.at(element.line if result is None else result.line, f"{what}: its axis is zero; give a direction")
        return AXIS
    # A unit vector to rounding stays as it is written.
    return axis if abs(length - 1) < 1e-15 else (axis[0] / length, axis[1] / length, axis[2] / length)


def _mimic(element: Element, kind: str, what: str, faults: FileFaults) -> Mimic | None:
    result = element.find("mimic")
    if result is None or kind == "fixed":
        return None
    if TYPES.get(kind, 1) != 1:
        faults.at(result.line, f"{what} is {kind} and has a <mimic>, which takes one coordinate; leave it out")
        return None
    return Mimic(faults.name(result, "joint", f"{what}: mimic"), faults.number(result, "multiplier", what, 1.0),
                 faults.number(result, "offset", what, 0.0), result.line)
