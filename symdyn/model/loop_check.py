"""Checks of closed loops and constraints, and the coordinates that loops through screws and custom joints need."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.model.bodies import Body
from symdyn.model.closures import Constraint, Gear, Rod
from symdyn.model.joints import Cylindrical, Fixed, Free, Joint, Modal, Planar, Prismatic, Revolute, Spherical, Universal
from symdyn.model.quantity import Quantity, of_speeds
from symdyn.model.symbols import Acceleration, Coordinate, GivenMotion, GivenRate, Input, Rate, symbols_of
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.model.system import System

CARRIER = "carrier"
# Joints whose coordinates a loop does not need: their rows come from the poses of the two bodies (Free closes no loop).
FROM_POSES = (Cylindrical, Fixed, Free, Modal, Planar, Prismatic, Revolute, Rod, Spherical, Universal)


def with_carriers(system: System) -> System:
    """The system with every joint that closes a loop and is none of FROM_POSES, such as Helical or Custom, taken apart.

    The coordinates of such a joint need not follow from the pose of its two bodies alone (a screw after several turns), so they
    become coordinates of the system: the joint carries a massless body, which is fixed to the child.
    """
    screws = [j for j in system.loops if isinstance(j, Joint) and not isinstance(j, FROM_POSES)]
    if not screws:
        return system
    result = copy.copy(system)
    result.bodies, result.joints, result.loops = list(system.bodies), list(system.joints), []
    for joint in system.loops:
        if joint not in screws:
            result.loops.append(joint)
            continue
        assert isinstance(joint, Joint)
        carrier, moving, closure = carried(joint)
        result.bodies.append(carrier)
        result.joints.append(moving)
        result.loops.append(closure)
    return result


def carried(joint: Joint) -> tuple[Body, Joint, Joint]:
    """A massless body, the joint that carries it in place of its child, and what fixes it to the child."""
    carrier = Body(f"{joint.name}_{CARRIER}", sp.S.Zero, sp.ImmutableMatrix(sp.zeros(3, 3)), sp.ImmutableMatrix(sp.zeros(3, 1)))
    moving = copy.copy(joint)
    moving.child, moving.child_point = carrier, sp.ImmutableMatrix(sp.zeros(3, 1))
    moving.child_rotation = sp.ImmutableMatrix(sp.eye(3))
    closure = Fixed(f"{joint.name}_closure", carrier, joint.child, (0, 0, 0), joint.child_point, None, joint.child_rotation)
    closure.inner = True
    return carrier, moving, closure


def loop_faults(loops: Iterable[Joint | Gear], joints: Mapping[str, Joint],
                resolve: Callable[[Any, str], int | None]) -> list[str]:
    """Faults of the loops; resolve(body, where) gives a body's number and reports unknown ones itself."""
    faults = [f"rod {shown(j.name)} cannot carry a body in the tree; join the bodies by other joints and pass the rod to "
              "close_loop"
              for j in joints.values() if isinstance(j, Rod)]
    for loop in loops:
        if isinstance(loop, Gear):
            faults += _gear_faults(loop, joints)
            continue
        parent = resolve(loop.parent, f"joint {shown(loop.name)}: parent")
        child = resolve(loop.child, f"joint {shown(loop.name)}: child")
        if parent is not None and parent == child:
            faults.append(f"joint {shown(loop.name)} closes a loop from a body onto itself; pass two different bodies")
        given = [str(q) for q in loop.coordinates if not isinstance(q, Coordinate)]
        if given and not loop.faults:
            faults.append(f"joint {shown(loop.name)} closes a loop, where its motion follows from the others; it cannot be "
                          "given as "
                          f"{', '.join(given)}: put this joint into the tree, and close the loop at another")
        if isinstance(loop, Free):
            faults.append(f"joint {shown(loop.name)} is free and constrains nothing; leave out close_loop")
    return faults


def idle_coordinate_faults(loops: Iterable[Joint | Gear], used: Iterable[sp.Basic]) -> list[str]:
    """Coordinates given to closing joints that are nobody's; used: symbols that stand elsewhere in the description."""
    faults = []
    used = set(used)
    for joint in loops:
        if not isinstance(joint, Joint) or joint.inner or joint.faults or joint.unnamed or isinstance(joint, Free):
            continue
        idle = [q for q in joint.coordinates if isinstance(q, Coordinate) and not used & {q, q.dot}]
        if idle:
            faults.append(f"joint {shown(joint.name)} closes a loop and is given the coordinate {', '.join(map(str, idle))}; a "
                          "closing joint has no coordinate, its motion follows from the others: leave it out, or put this "
                          "joint into the tree and close the loop at another")
    return faults


def _gear_faults(gear: Gear, joints: Mapping[str, Joint]) -> list[str]:
    faults = []
    result = []
    for end in (gear.joint_a, gear.joint_b):
        joint = joints.get(end) if isinstance(end, str) else end
        if joint not in joints.values():
            faults.append(f"gear {shown(gear.name)}: it joins {shown(end)}, which is no joint of the tree; joints: "
                          f"{', '.join(joints) or 'none'}")
        elif joint is not None and len(joint.coordinates) != 1:
            faults.append(f"gear {shown(gear.name)}: joint {shown(joint.name)} has {len(joint.coordinates)} coordinates; a "
                          "gear joins "
                          "joints with one each")
        result.append(joint)
    if not faults and result[0] is result[1]:
        faults.append(f"gear {shown(gear.name)} joins joint {shown(gear.joint_a)} to itself; pass two different joints")
    return faults


def constraint_faults(constraints: Iterable[Constraint], moving: Iterable[sp.Symbol], states: Iterable[sp.Symbol],
                      speeds: Iterable[sp.Symbol]) -> list[str]:
    """Faults of constraints by expression; moving: coordinates, their rates, speeds."""
    faults = []
    moving, states, rates = set(moving), set(states), set(speeds)
    for c in constraints:
        symbols = symbols_of(c.expression)
        used = sorted((s for s in symbols if s in rates or isinstance(s, Rate) or of_speeds(s)), key=str)
        # Equations are derived by time until accelerations stand in them, and there is no third derivative of a motion.
        known = (GivenMotion, GivenRate) if used else GivenMotion
        given = sorted(str(s) for s in symbols if (isinstance(s, Input) and not isinstance(s, known)) or s in states)
        if given:
            faults.append(f"{c.name} uses {', '.join(given)}; a constraint may use coordinates, motions, t and parameters, and "
                          "one of speeds also speeds and rates of motions")
        if not symbols & moving and not any(isinstance(s, (Coordinate, Rate, Acceleration, Quantity)) for s in symbols):
            faults.append(f"{c.name}, {c.expression} = 0, has no coordinate or speed in it, so that it constrains nothing; use "
                          "coordinates of the system, or remove it")
        for k, first in enumerate(used):
            if any(sp.diff(c.expression, first, other) != 0 for other in used[k:]):
                faults.append(f"{c.name}, {c.expression} = 0, is not linear in the speed {first}; pass a constraint of the form "
                              "A(q, t) u + b(q, t) = 0")
                break
    return faults
