"""Where expressions stand in a description, and which unit a symbol therefore has."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.model.bodies import Component, Point
from symdyn.model.closures import Gear, Rod
from symdyn.model.elements import AddedMass, Element
from symdyn.model.joints import Helical, Joint
from symdyn.model.loads import Force, JointForce, SpringDamper, Torque
from symdyn.model.record import joint_speeds
from symdyn.model.symbols import Coordinate, time

if TYPE_CHECKING:
    from symdyn.model.system import System

# Unit of the force along a speed, by the speed's: their product is a power.
_FORCES = {"rad/s": "N m", "m/s": "N"}


def uses(system: System, joints: Sequence[Joint], loads: Sequence[Any]) -> Iterable[tuple[str, Iterable[sp.Expr], bool]]:
    """(where, expressions, whether only parameters may occur), in the order of description."""
    s = system
    yield "gravity", s.gravity, True
    for body in s.bodies:
        yield f"body {body.name!r}", [body.mass, *body.com, *body.inertia], True
    for gear in (g for g in s.loops if isinstance(g, Gear)):
        yield f"gear {gear.name!r}", [gear.ratio, gear.offset], True
    for joint in [*joints, *(j for j in s.loops if isinstance(j, Joint))]:
        yield f"joint {joint.name!r}", joint.constants, True
        yield (f"joint {joint.name!r}: coordinates",
               [q for q in joint.coordinates if not isinstance(q, Coordinate)], False)
    if s.ground_motion is not None:
        yield "move_ground", s.ground_motion.coordinates, False
    for load in loads:
        if isinstance(load, Force):
            yield load.label, load.force, False
            yield f"{load.label}: point", load.point, True
        elif isinstance(load, Torque):
            yield load.label, load.torque, False
        elif isinstance(load, JointForce):
            yield load.label, load.values, False
        elif isinstance(load, SpringDamper):
            yield load.label, [*load.point_a, *load.point_b, load.stiffness, load.damping, load.length], True
        elif isinstance(load, (Element, AddedMass)):
            yield load.label, load.constants, True
            yield load.label, load.expressions, False
    for output in s.outputs:
        if isinstance(output.value, Point):
            yield f"output {output.name!r}: point", output.value.at, True
        else:
            value = output.value
            yield f"output {output.name!r}", value if isinstance(value, tuple) else [value], False
    for event in s.events:
        if isinstance(event.value, Component):
            yield f"event {event.name!r}: point", event.value.point.at, True
        yield f"event {event.name!r}", event.expressions, False
    for state in s.states:
        yield f"rate of state {state.symbol}", [state.rate], False
    for constraint in s.constraints:
        yield constraint.name, [constraint.expression], False


def units_of(system: System, joints: Sequence[Joint], loads: Sequence[Any]) -> dict[sp.Symbol, str]:
    """The unit of every symbol that stands alone where its unit is known."""
    units: dict[sp.Symbol, str] = {time: "s"}

    def note(expressions: Iterable[sp.Expr], unit: str) -> None:
        for e in expressions:
            core = -e if e.could_extract_minus_sign() else e
            if isinstance(core, sp.Symbol):
                units.setdefault(core, unit)

    s = system
    for joint in joints:
        for q, unit in zip(joint.coordinates, joint.coordinate_units, strict=True):
            if isinstance(q, Coordinate):
                units[q] = unit
        for speed, unit in zip(joint_speeds(joint), joint.speed_units, strict=True):
            if speed is not None:
                units[speed] = unit
    note(s.gravity, "m/s^2")
    for body in s.bodies:
        note([body.mass], "kg")
        note(body.com, "m")
        note(body.inertia, "kg m^2")
    for joint in [*joints, *(j for j in s.loops if isinstance(j, Joint))]:
        note([*joint.parent_point, *joint.child_point], "m")
        if isinstance(joint, Rod):
            note([joint.length], "m")
        if isinstance(joint, Helical):
            note([joint.pitch], "m/rad")
    for load in loads:
        if isinstance(load, Force):
            note(load.force, "N")
            note(load.point, "m")
        elif isinstance(load, Torque):
            note(load.torque, "N m")
        elif isinstance(load, JointForce):
            driven = next((j for j in joints if load.joint in (j, j.name)), None)
            for value, unit in zip(load.values, () if driven is None else driven.speed_units, strict=False):
                if unit in _FORCES:
                    note([value], _FORCES[unit])
        elif isinstance(load, SpringDamper):
            note([load.stiffness], "N/m")
            note([load.damping], "N s/m")
            note([load.length, *load.point_a, *load.point_b], "m")
        elif isinstance(load, (Element, AddedMass)):
            for unit, expressions in load.units.items():
                note(expressions, unit)
    for output in s.outputs:
        if isinstance(output.value, Point):
            note(output.value.at, "m")
    for event in s.events:
        if isinstance(event.value, Component):
            note(event.value.point.at, "m")
    return units
