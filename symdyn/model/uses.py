"""Where expressions stand in a description, and which unit a symbol therefore has."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.model.closures import Gear, Rod
from symdyn.model.contacts.compliance import numbers_of
from symdyn.model.contacts.lowering import SOFTNESS
from symdyn.model.elements import AddedMass, Element
from symdyn.model.joints import Helical, Joint
from symdyn.model.loads import Force, ForceBetween, JointForce, SpringDamper, Torque, expressions_of
from symdyn.model.points import Point
from symdyn.model.quantity import Quantity, quantities_in
from symdyn.model.record import joint_speeds
from symdyn.model.symbols import Coordinate, GivenMotion, flat, symbols_of, time
from symdyn.shown import shown
from symdyn.turning import force_unit

if TYPE_CHECKING:
    from symdyn.model.system import System


class Scope(IntEnum):
    """Quantities that may occur in an expression; each adds to those before it."""

    PARAMETERS = 0
    COORDINATES = 1  # and t
    MOTION = 2  # speeds, states, inputs; points and orientations of bodies
    FORCES = 3  # accelerations of points, multipliers, reactions


Use = tuple[str, Iterable[sp.Expr], Scope]


def uses(system: System, joints: Sequence[Joint], loads: Sequence[Any]) -> Iterable[Use]:
    """(where, expressions, what may occur in them), in the order of description; points of quantities follow those."""
    for where, expressions, scope in _uses(system, joints, loads):
        listed = list(expressions)
        yield where, listed, scope
        for quantity in quantities_in(listed):
            for point in quantity.measure.points:
                yield f"{where}: point of {quantity}", point, Scope.PARAMETERS


def _uses(system: System, joints: Sequence[Joint], loads: Sequence[Any]) -> Iterable[Use]:
    s = system
    yield "gravity", s.gravity, Scope.PARAMETERS
    for body in s.bodies:
        yield f"body {shown(body.name)}", [body.mass, *flat(body.com), *flat(body.inertia)], Scope.PARAMETERS
    for gear in (g for g in s.loops if isinstance(g, Gear)):
        yield f"gear {shown(gear.name)}", [gear.ratio, gear.offset], Scope.PARAMETERS
    for joint in [*joints, *(j for j in s.loops if isinstance(j, Joint))]:
        yield f"joint {shown(joint.name)}", joint.constants, Scope.PARAMETERS
        yield (f"joint {shown(joint.name)}: coordinates",
               [q for q in joint.coordinates if not isinstance(q, Coordinate)], Scope.COORDINATES)
    if s.ground_motion is not None:
        yield "move_ground", s.ground_motion.coordinates, Scope.COORDINATES
    for load in loads:
        if isinstance(load, (Force, Torque, JointForce, SpringDamper, ForceBetween)):
            yield load.label, expressions_of(load), Scope.FORCES
        if isinstance(load, Force):
            yield f"{load.label}: point", load.point, Scope.PARAMETERS
        elif isinstance(load, (SpringDamper, ForceBetween)):
            yield f"{load.label}: points", [*load.point_a, *load.point_b], Scope.PARAMETERS
        elif isinstance(load, (Element, AddedMass)):
            yield load.label, load.constants, Scope.PARAMETERS
            yield load.label, load.expressions, Scope.MOTION
    for output in s.outputs:
        if isinstance(output.value, Point):
            yield f"output {shown(output.name)}: point", output.value.at, Scope.PARAMETERS
        else:
            value = output.value
            yield f"output {shown(output.name)}", value if isinstance(value, tuple) else [value], Scope.FORCES
    for contact in s.rigid_contacts:
        yield f"contact {contact.name}", [*contact.expressions, *numbers_of(contact.ranges)], Scope.MOTION
        yield f"contact {contact.name}: friction and restitution", contact.constants, Scope.PARAMETERS
    for compliant in s.compliant_contacts:
        yield f"contact {compliant.name}", [*compliant.expressions, *numbers_of(compliant.ranges)], Scope.MOTION
    for group in s.lowered_groups:
        yield f"contact group {group.name}", group.constants, Scope.PARAMETERS
    if s.rigid_contacts:
        yield "contacts", [SOFTNESS], Scope.PARAMETERS
    for event in s.events:
        yield f"event {shown(event.name)}", event.expressions, Scope.FORCES
    for state in s.states:
        yield f"rate of state {state.symbol}", [state.rate], Scope.FORCES
    for u, expression in s.chosen_speeds.items():
        yield f"the speed {u}", [expression], Scope.MOTION
    for constraint in s.constraints:
        yield constraint.name, [constraint.expression], Scope.MOTION


def units_of(system: System, joints: Sequence[Joint], loads: Sequence[Any], used: Iterable[Use]) -> dict[sp.Symbol, str]:
    """The unit of every symbol that stands alone where its unit is known; used: see `uses`."""
    units: dict[sp.Symbol, str] = {time: "s"}

    def note(expressions: Iterable[sp.Expr], unit: str) -> None:
        for e in flat(expressions) if isinstance(expressions, sp.MatrixBase) else expressions:
            core = e.args[1] if e.is_Mul and len(e.args) == 2 and e.args[0] == -1 else e
            if isinstance(core, sp.Symbol):
                units.setdefault(core, unit)

    s = system
    for joint in joints:
        for q, unit in zip(joint.coordinates, joint.coordinate_units, strict=True):
            if isinstance(q, (Coordinate, GivenMotion)):
                units[q] = unit
            if isinstance(q, GivenMotion):
                units.update({q.dot: f"{unit}/s", q.ddot: f"{unit}/s^2"})
        for speed, unit in zip(joint_speeds(joint), joint.speed_units, strict=True):
            if speed is not None:
                units[speed] = unit
    note(s.gravity, "m/s^2")
    for body in s.bodies:
        note([body.mass], "kg")
        note(body.com, "m")
        note(body.inertia, "kg m^2")
    for joint in [*joints, *(j for j in s.loops if isinstance(j, Joint))]:
        note([*flat(joint.parent_point), *flat(joint.child_point)], "m")
        if isinstance(joint, Rod):
            note([joint.length], "m")
        if isinstance(joint, Helical):
            note([joint.pitch], "m/rad")
    known: dict[Any, Joint] = {**{j.name: j for j in joints}, **{j: j for j in joints}}
    for load in loads:
        if isinstance(load, Force):
            note(load.force, "N")
            note(load.point, "m")
        elif isinstance(load, Torque):
            note(load.torque, "N m")
        elif isinstance(load, JointForce):
            driven = known.get(load.joint)
            for value, unit in zip(load.values, () if driven is None else driven.speed_units, strict=False):
                if force_unit(unit):
                    note([value], force_unit(unit))
        elif isinstance(load, ForceBetween):
            note([load.force], "N")
            note([*load.point_a, *load.point_b], "m")
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
    for _, read, _ in used:
        for quantity in quantities_in(read):
            for point in quantity.measure.points:
                note(point, "m")
    return units


def unit_of(expression: sp.Expr, units: Mapping[sp.Symbol, str]) -> str:
    """The unit of an expression of lengths, or of their rates: "m", "rad" (no length in it), "m^2", ...; "" if its terms differ.

    Found by its values with all lengths doubled and trebled.
    """
    symbols = sorted(symbols_of(expression), key=str)
    lengths = [s for s in symbols if (s.unit if isinstance(s, Quantity) else units.get(s)) in ("m", "m/s")]
    stream = np.random.default_rng(5)
    values = {s: sp.Float(v, 30) for s, v in zip(symbols, stream.uniform(0.3, 1.3, len(symbols)), strict=True)}
    try:
        first, *others = [complex(expression.xreplace({**values, **{s: k * values[s] for s in lengths}}).evalf(25))
                          for k in (1, 2, 3)]
    except (TypeError, ValueError):
        return ""
    for power in range(4):
        if all(abs(v - first * k**power) <= 1e-12 * abs(v) for k, v in zip((2, 3), others, strict=True)):
            return ("rad", "m")[power] if power < 2 else f"m^{power}"
    return ""
