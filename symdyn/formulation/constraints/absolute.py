"""From relative to absolute coordinates: every body moves freely, and every joint becomes constraints.

A model is rewritten into another: each body hangs on the ground by a joint of its own that allows every motion, and the
joints of the tree close loops. A joint whose coordinates are used elsewhere (by a load, a drive, a gear, an output), or are
given, keeps them: it carries a massless body that is fixed to the child.
Source: lecture, chapter 6.3.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import sympy as sp

from symdyn.errors import ModelError
from symdyn.formulation.loads.site import has_roll_pitch_yaw, joint_with_ground
from symdyn.model.bodies import Body
from symdyn.model.closures import Gear
from symdyn.model.elements import Element, LinearStiffness
from symdyn.model.joints import Free, Joint, Modal, Planar
from symdyn.model.loads import JointForce, expressions_of
from symdyn.model.loop_check import FROM_POSES, carried
from symdyn.model.orientation import EulerAngles, EulerParameters
from symdyn.model.points import Point
from symdyn.model.record import Model, joint_speeds
from symdyn.model.symbols import Coordinate, Speed, symbols_of


def in_absolute_coordinates(model: Model, orientation: EulerAngles | EulerParameters | None = None) -> Model:
    """The model with coordinates of its own for every body: planar x, y, theta; spatial x, y, z of its origin and its
    orientation in the ground's frame. Start values are those of the relative coordinates (see absolute_start).

    Raises ModelError for chosen speeds."""
    if model.chosen:
        chosen = ", ".join(str(u) for u, _ in model.chosen)
        raise ModelError([f"chosen speeds are those of relative coordinates, and {chosen} were given to set_speeds; take "
                          "system.augmented(), or take the choice back with set_speeds({})"], model.name)
    orientation = orientation or EulerParameters()
    taken = {s.name for s in (*model.coordinates, *model.speeds, *model.parameters, *model.inputs)}
    names = {j.name for j in (*model.joints, *model.loops)}
    used = _used(model)
    free: dict[int, Joint] = {}
    moving: list[tuple[Joint, int, int]] = []
    closing: list[Joint | Gear] = []
    bodies: list[Body] = list(model.bodies)
    # A screw or custom joint that closes a loop carries a massless body already.
    carriers = {getattr(c.parent, "name", c.parent) for c in model.loops if isinstance(c, Joint) and c.inner}
    carried_already: set[int] = set()
    for joint, parent, child in zip(model.joints, model.parents, model.children, strict=True):
        if parent == -1 and _allows_everything(joint, model.planar):
            free[child] = joint
        elif model.bodies[child].name in carriers or isinstance(joint, Modal):  # the ends of a beam stay together
            moving.append((joint, parent, child))
            carried_already.add(child)
        elif _needs_coordinates(joint, used):
            carrier, carrying, closure = carried(joint)
            closure.name = _new(closure.name, names)
            moving.append((carrying, parent, len(bodies)))
            bodies.append(carrier)
            closing.append(closure)
        elif not isinstance(joint, Free):
            closing.append(joint)
    for k, body in enumerate(model.bodies):
        if k not in free and k not in carried_already:
            free[k] = _own_joint(body, model.planar, orientation, taken, names)
    order = [(free[k], -1, k) for k in range(len(model.bodies)) if k in free] + moving
    joints = tuple(j for j, _, _ in order)
    coordinates = dict.fromkeys(q for j in joints for q in j.coordinates if isinstance(q, Coordinate))
    speeds = dict.fromkeys(u for j in joints for q, u in _pairs(j) if isinstance(q, Coordinate) and u is not None)
    extra = [q for q in model.coordinates if q in used and q not in coordinates and not _of_joint(model, q)]
    coordinates.update(dict.fromkeys(extra))
    speeds.update(dict.fromkeys(q.dot for q in extra))
    units = dict(model.units)
    for joint in joints:
        units.update({q: unit for q, unit in zip(joint.coordinates, joint.coordinate_units, strict=True)
                      if isinstance(q, Coordinate)})
        units.update({u: unit for u, unit in zip(joint_speeds(joint), joint.speed_units, strict=True) if u is not None})
    loads = tuple(_as_meant(load, model) for load in model.loads)
    known = {*coordinates, *speeds, *[z.symbol for z in model.states], *model.inputs}
    return replace(model, bodies=tuple(bodies), joints=joints, parents=tuple(p for _, p, _ in order),
                   children=tuple(c for _, _, c in order), loops=(*closing, *model.loops), loads=loads,
                   coordinates=tuple(coordinates), speeds=tuple(speeds), units=units,
                   initial={s: v for s, v in model.initial.items() if s in known})


def _own_joint(body: Body, planar: bool, orientation: Any, taken: set[str], names: set[str]) -> Joint:
    joint = _free_joint(_new(f"{body.name}_own", names), body, planar, orientation, taken)
    joint.inner = True
    return joint


def _new(name: str, names: set[str]) -> str:
    """The name, with lines after it if it is there already; adds it."""
    while name in names:
        name += "_"
    names.add(name)
    return name


def _free_joint(name: str, body: Body, planar: bool, orientation: Any, taken: set[str]) -> Joint:
    if planar:
        return Planar(name, "ground", body, [_symbol(letter, body, taken) for letter in ("x", "y", "theta")])
    letters = ["x", "y", "z"]
    if isinstance(orientation, EulerParameters):
        letters += ["p0", "p1", "p2", "p3"]
    else:
        letters += ["psi", "theta", "phi"] if orientation.sequence == "ZYX" else ["alpha", "beta", "gamma"]
    coordinates = [_symbol(letter, body, taken) for letter in letters]
    speeds = None
    if orientation.angular_velocity:
        speeds = [*[q.dot for q in coordinates[:3]], *[_symbol(f"omega_{axis}", body, taken, Speed) for axis in "xyz"]]
    return Free(name, "ground", body, coordinates, orientation, speeds)


def _symbol(letter: str, body: Body, taken: set[str], kind: Any = Coordinate) -> Any:
    name = f"{letter}_{re.sub(r'[^0-9A-Za-z]+', '_', body.name)}"
    while name in taken or f"{name}_dot" in taken:
        name += "_"
    taken.add(name)
    return kind(name)


def _allows_everything(joint: Joint, planar: bool) -> bool:
    """Whether a joint with the ground already gives the body coordinates of its own."""
    if not isinstance(joint, Planar if planar else Free) or not all(isinstance(q, Coordinate) for q in joint.coordinates):
        return False
    here = joint.child_point.is_zero_matrix and joint.parent_point.is_zero_matrix
    return bool(here and joint.parent_rotation == sp.eye(3) and joint.child_rotation == sp.eye(3))


def _needs_coordinates(joint: Joint, used: set[sp.Symbol | str]) -> bool:
    if not isinstance(joint, FROM_POSES) or joint.name in used:
        return True
    if not all(isinstance(q, Coordinate) for q in joint.coordinates):
        return True
    return any(s in used for s in (*joint.coordinates, *[q.dot for q in joint.coordinates], *joint_speeds(joint)))


def _as_meant(load: Any, model: Model) -> Any:
    """A load, with what it takes from the joints of the tree, which are no longer there."""
    if isinstance(load, JointForce):
        return replace(load, joint=getattr(load.joint, "name", load.joint))
    if isinstance(load, LinearStiffness):
        names = [body.name for body in model.bodies]
        name = getattr(load.body, "name", load.body)
        return load.with_angles_of(has_roll_pitch_yaw(joint_with_ground(model, names.index(name)))) if name in names else load
    return load


def _used(model: Model) -> set[Any]:
    """Symbols that stand in expressions, and names of joints that are driven or geared."""
    expressions: list[Any] = [c.expression for c in model.constraints] + [z.rate for z in model.states]
    expressions += [q for joint in model.joints for q in joint.coordinates if not isinstance(q, Coordinate)]
    for output in model.outputs:
        if not isinstance(output.value, Point):
            expressions += output.value if isinstance(output.value, tuple) else [output.value]
    names: set[Any] = {symbol for event in model.events for symbol, _ in event.reset}
    for event in model.events:
        expressions += event.expressions
    for load in model.loads:
        expressions += load.expressions if isinstance(load, Element) else expressions_of(load)
        if isinstance(load, JointForce):
            names.add(getattr(load.joint, "name", load.joint))
    for gear in (g for g in model.loops if isinstance(g, Gear)):
        names.update(getattr(j, "name", j) for j in (gear.joint_a, gear.joint_b))
    return names.union(*[symbols_of(e) for e in expressions if isinstance(e, sp.Basic)])


def _pairs(joint: Joint) -> Iterable[tuple[Any, Any]]:
    """Speeds with the coordinate that makes each independent; a rotation by Euler parameters has one coordinate more."""
    speeds = joint_speeds(joint)
    if len(speeds) == len(joint.coordinates):
        return zip(joint.coordinates, speeds, strict=True)
    return [(joint.coordinates[-1], u) for u in speeds]


def _of_joint(model: Model, q: sp.Symbol) -> bool:
    return any(q in joint.coordinates for joint in model.joints)
