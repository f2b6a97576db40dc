"""Lowering of contacts: forces between their bodies, events, and for the rigid law rows that parameters switch.

A rigid contact has one row along its normal and one along each tangent. The force along row k is the quantity contact(NAME)[k].
Parameters say which rows hold, NAME_closed and NAME_sticking (1 or 0 each), and which way it slides, NAME_sliding, in space
NAME_sliding_x and NAME_sliding_y. All are 0 by default: the contact is open. A run sets them in every phase.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.contact_kinds import BODIES, FRICTION, RELEASES, TOUCHES
from symdyn.model.bodies import Body
from symdyn.model.contacts.compliance import Compliance, Range, by_parameters, law_of, ranges_of
from symdyn.model.contacts.contact import Contact
from symdyn.model.contacts.geometry import Geometry, Touch
from symdyn.model.contacts.group import lowered
from symdyn.model.contacts.joints import JointElement, Row
from symdyn.model.event import Event
from symdyn.model.faults import Faults
from symdyn.model.loads import Force, Torque
from symdyn.model.quantity import Measure, Quantity
from symdyn.model.state import State
from symdyn.model.symbols import Coordinate
from symdyn.shown import shown
from symdyn.turning import force_unit

if TYPE_CHECKING:
    from symdyn.model.system import System

CLOSES, OPENS, STICKS, SLIPS, TURNS, IGNORED, COUNTS = "closes", "opens", "sticks", "slips", "turns", "ignored", "counts"
# The part of the kinetic friction below which a compliant contact holds and should not slip.
HELD = sp.Rational(99, 100)
# A speed, m/s, that is added to the slip along the direction which friction in space is written by: a large one holds that
# direction, a small one lets friction act against the slip.
HOLDING, SLOW = sp.Symbol("contacts_holding", real=True), 1e-12
# Added to the diagonal of the rows that hold, by their size, where they depend on each other.
SOFTNESS = sp.Symbol("contacts_shared", real=True)


@dataclass(frozen=True)
class RigidContact:
    """A rigid contact in one place, or one row of an element of joints.

    gap       m; rows: relative velocities along the normal and the tangents, m/s; dry friction of a joint has no normal row
    forces    quantities of the forces along the rows
    switches  parameters: for each row whether it holds
    slide     coefficients of the tangential forces by the normal force while the contact slides; without one, the forces
    sliding   parameters of the direction of slip, one for each tangent
    events    what its events are called after its name
    kind      BODIES, or that of the element of joints
    at, acting   where it touches and the force on body a, n-frame; empty of an element of joints
    ranges    what radii and lengths of its shapes may be that follow from parameters
    width     of a shape that may touch in several places, m; None of others
    """

    name: str
    contact: str
    gap: sp.Expr
    rows: tuple[sp.Expr, ...]
    forces: tuple[Quantity, ...]
    switches: tuple[sp.Symbol, ...]
    slide: tuple[sp.Expr, ...]
    sliding: tuple[sp.Symbol, ...]
    static: sp.Expr
    kinetic: sp.Expr
    restitution: sp.Expr
    impact: str
    events: tuple[str, ...]
    kind: str = BODIES
    at: tuple[sp.Expr, ...] = ()
    acting: tuple[sp.Expr, ...] = ()
    ranges: tuple[Range, ...] = ()
    width: sp.Expr | None = None

    @property
    def normal(self) -> bool:
        """Whether its first row is a normal one, which opens."""
        return self.kind != FRICTION

    @property
    def shares(self) -> list[sp.Symbol]:
        """Parameters p of a contact in space for the softness of its rows while it sticks and shares forces, 1/(1 + p^2):
        those of the direction of its slip, which it has none of then."""
        return [self.sliding[1], self.sliding[0], self.sliding[0]] if len(self.sliding) == 2 else []

    @property
    def expressions(self) -> list[sp.Expr]:
        """All that a motion evaluates."""
        return [self.gap, *self.rows, *self.slide, *self.switches, *self.sliding]

    @property
    def constants(self) -> list[sp.Expr]:
        """Expressions that depend on parameters alone."""
        return [self.static, self.kinetic, self.restitution]


@dataclass(frozen=True)
class CompliantContact:
    """A compliant contact in one place: the forces along its rows, the slip up to which it counts as sticking, m/s, the depth and
    the creep that are reported, m; where it touches and the force on body a, n-frame; what numbers that follow from parameters
    may be."""

    name: str
    gap: sp.Expr
    rows: tuple[sp.Expr, ...]
    forces: tuple[sp.Expr, ...]
    slip_speed: sp.Expr
    depth: float | None
    creep: float | None = None
    at: tuple[sp.Expr, ...] = ()
    acting: tuple[sp.Expr, ...] = ()
    ranges: tuple[Range, ...] = ()

    @property
    def expressions(self) -> list[sp.Expr]:
        """Its numbers along a motion: gap, slip speed, forces, slips."""
        return [self.gap, self.slip_speed, *self.forces, *self.rows[1:]]

    @property
    def held_slip(self) -> sp.Expr:
        """The size of the slip while it is closed and friction is below HELD of what it reaches in the end, else zero, m/s."""
        slip = sp.sqrt(sp.Add(*[v**2 for v in self.rows[1:]]))
        return sp.Piecewise((slip, sp.And(self.gap < 0, slip < HELD / sp.sqrt(1 - HELD**2) * self.slip_speed)), (0, True))


def contact_force(name: str, row: int, unit: str = "N") -> Quantity:
    """The force of a rigid contact along one of its rows; of an element of joints it may be a torque, N m."""
    return Quantity(Measure("contact", (name,), index=(row,), force=unit))


def with_contacts(system: System) -> System:
    """The system with what its contacts become; the same one where it has none."""
    if not system.contacts and not system.contact_groups:
        return system
    result = copy.copy(system)
    result._faults = faults = Faults(system._faults)
    found = [lowered(system, group, faults) for group in system.contact_groups]
    result.lowered_groups = [group for group in found if group is not None]
    result.loads, result.events, result.states = list(system.loads), list(system.events), list(system.states)
    result.rigid_contacts, result.compliant_contacts = [], []
    result.defaults = dict(system.defaults)
    known = {"ground", *[b.name for b in system.bodies if isinstance(b.name, str)]}
    for contact in system.contacts:
        before = len(faults)
        if isinstance(contact, JointElement):
            faults.extend([*contact.faults, *contact.number_faults(system.defaults)])
            for row in contact.rows(system, faults) if len(faults) == before else ():
                _add_row(result, contact, row)
            continue
        faults.extend([*contact.faults, *contact.structure_faults(system.planar), *contact.number_faults(system.defaults),
                       *_body_faults(contact, system, known)])
        if len(faults) == before:
            geometry = Geometry(contact, system.planar, system.ground_motion is None, faults)
            for touch in geometry.touches():
                _add(result, contact, geometry, touch)
    if result.rigid_contacts:
        added = [SOFTNESS, *[s for c in result.rigid_contacts for s in (*c.switches, *c.sliding)]]
        result.defaults.update(dict.fromkeys(added, 0.0))
        result.units = {**dict.fromkeys(added, "1"), **system.units}
        if any(len(c.sliding) == 2 for c in result.rigid_contacts):
            added.append(HOLDING)
            result.defaults[HOLDING] = SLOW
            result.units[HOLDING] = "m/s"
        if system.declared is not None:
            result.declared = (*system.declared, *added)
    return result


def _body_faults(contact: Contact, system: System, known: set[str]) -> list[str]:
    own = {body.name: body for body in system.bodies if isinstance(body.name, str)}
    foreign = [body.name for body in (contact.a, contact.b) if isinstance(body, Body) and own.get(body.name, body) is not body]
    if foreign:
        return [f"{contact.where}: {' and '.join(map(shown, foreign))} is a body of another system, and this one has another "
                "body of that name; pass that one, or its name"]
    a, b = (getattr(body, "name", body) for body in (contact.a, contact.b))
    names = [body if isinstance(body, str) else shown(body) for body in (a, b)]
    strange = [name for name in names if name not in known]
    if not strange and a == b:
        return [f"{contact.where}: {a} is in contact with itself; pass two different bodies"]
    if not strange and a == "ground":
        return [f"{contact.where}: body a is the ground; pass the body that moves first, and the ground as b"]
    return [f"{contact.where} is between {', '.join(map(repr, strange))}, which the system does not have; bodies: "
            f"{', '.join(sorted(known))}"] if strange else []


def _add(system: System, contact: Contact, geometry: Geometry, touch: Touch) -> None:
    """Loads, events and rows of a contact in one place."""
    directions = [touch.normal, *(() if contact.frictionless else touch.tangents)]
    name, rows = touch.name, geometry.rows(touch)[:len(directions)]
    if contact.law == "compliant":
        _add_compliant(system, contact, geometry, touch, directions, rows)
        return
    forces = tuple(contact_force(name, k) for k in range(len(rows)))
    closed, sticking = sp.Symbol(f"{name}_closed", real=True), sp.Symbol(f"{name}_sticking", real=True)
    switches = (closed, *[sticking] * (len(rows) - 1))
    sliding = (sp.Symbol(f"{name}_sliding", real=True),) if len(rows) == 2 else tuple(
        sp.Symbol(f"{name}_sliding_{axis}", real=True) for axis in "xy"[:len(rows) - 1])
    slide, of_sliding = _sliding(contact.kinetic, rows[1:], sliding)
    events = {CLOSES: touch.gap, OPENS: forces[0], **of_sliding}
    if len(rows) > 1:
        events[SLIPS] = (contact.static * forces[0]) ** 2 - sp.Add(*[f**2 for f in forces[1:]])
    if contact.ignored is not None:
        events |= {IGNORED: contact.ignored, COUNTS: contact.ignored}
    system.rigid_contacts.append(RigidContact(name, contact.name, touch.gap, rows, forces, switches, slide, sliding,
                                              contact.static, contact.kinetic, contact.restitution, contact.impact,
                                              tuple(events), at=geometry.place(touch), acting=_along(directions, forces),
                                              ranges=by_parameters(contact.ranges),
                                              width=touch.width))
    _act(system, geometry, touch, directions, forces)
    for what, value in events.items():
        system.events.append(Event(f"{name}_{what}", value, 1 if what == IGNORED else -1, True, ()))


def _add_row(system: System, element: JointElement, row: Row) -> None:
    """Loads, events and the row of an element of joints."""
    unit = force_unit(row.on[0][0].speed_units[0]) if row.on else "N"  # of a rope
    name, force = row.name, contact_force(row.name, 0, unit)
    switch = sp.Symbol(f"{name}_{'sticking' if row.kind == FRICTION else 'closed'}", real=True)
    sliding: tuple[sp.Symbol, ...] = ()
    slide: tuple[sp.Expr, ...] = ()
    events: dict[str, sp.Expr] = {CLOSES: row.gap, OPENS: force}
    if row.kind == FRICTION:
        sliding = (sp.Symbol(f"{name}_sliding", real=True),)
        slide, events = _sliding(element.kinetic, (row.rate,), sliding)
        events[SLIPS] = element.static**2 - force**2
    system.rigid_contacts.append(RigidContact(name, element.name, row.gap, (row.rate,), (force,), (switch,), slide, sliding,
                                              element.static, element.kinetic, element.restitution, element.impact,
                                              tuple(events), row.kind))
    system.loads += element.act(row, force)
    for what, value in events.items():
        system.events.append(Event(f"{name}_{what}", value, -1, True, ()))


def _add_compliant(system: System, contact: Contact, geometry: Geometry, touch: Touch, directions: list[Any],
                   rows: tuple[sp.Expr, ...]) -> None:
    """Loads of a compliant contact, and the states of its bristles."""
    compliance = contact.compliance
    assert isinstance(compliance, Compliance)  # checked before
    names = [f"{touch.name}_bristle"] if len(rows) == 2 else [f"{touch.name}_bristle_{axis}" for axis in "xy"]
    deflections = [Coordinate(name) for name in names[:len(rows) - 1]] if compliance.bristles is not None else []
    law = law_of(compliance, contact.static, contact.kinetic, touch.gap, rows, deflections, geometry.faults, contact.where)
    system.states += [State(z, rate) for z, rate in zip(deflections, law.rates, strict=True)]
    slow = geometry.faults.expression(compliance.slip_speed, f"{contact.where}: slip_speed")
    system.compliant_contacts.append(CompliantContact(touch.name, touch.gap, rows, law.forces, slow, compliance.depth,
                                                      compliance.creep, geometry.place(touch), _along(directions, law.forces),
                                                      by_parameters([*ranges_of(compliance, contact.static, contact.kinetic),
                                                                     *contact.ranges])))
    _act(system, geometry, touch, directions, law.forces)
    if compliance.located:
        stays = next(q for joint in system.joints for q in joint.coordinates if isinstance(q, Coordinate))
        for what, values in ((TOUCHES, (touch.gap,)), (RELEASES, law.kinks)):  # a reset ends the step, and changes nothing here
            system.events += [Event(f"{touch.name}_{what}", value, 0, False, ((stays, stays),)) for value in values]


def _sliding(kinetic: sp.Expr, slips: tuple[sp.Expr, ...],
             sliding: tuple[sp.Symbol, ...]) -> tuple[tuple[sp.Expr, ...], dict[str, sp.Expr]]:
    """Tangential forces by the normal force, and the events of sliding.

    In a plane friction is along the given direction. In space it is against the slip, written by its parts a along and b across
    the given direction as (d + (b/a) d')/sqrt(1 + (b/a)^2), which goes on smoothly where a slip along a line passes zero. Where
    a contact begins to slip a is zero; HOLDING is then large, and friction along d.
    """
    if not slips:
        return (), {}
    if len(slips) == 1:
        return (-kinetic * sliding[0],), {STICKS: sliding[0] * slips[0]}
    (x, y), (v, w) = sliding, slips
    along, across = v * x + w * y, w * x - v * y
    ratio = across / (along + HOLDING)
    size = sp.sqrt(1 + ratio**2)
    forces = (-kinetic * (x - ratio * y) / size, -kinetic * (y + ratio * x) / size)
    return forces, {STICKS: along, TURNS: along**2 - across**2}


def _along(directions: list[Any], forces: tuple[Any, ...]) -> tuple[sp.Expr, ...]:
    """The sum of forces along directions, n-frame."""
    return tuple(sp.Add(*[f * d[k] for f, d in zip(forces, directions, strict=True)]) for k in range(3))


def _act(system: System, geometry: Geometry, touch: Touch, directions: list[Any], forces: tuple[Any, ...]) -> None:
    """The force on body a and the opposite on body b, at one place."""
    force = _along(directions, forces)
    other = None if geometry.b == "ground" else geometry.b
    label = f"contact {touch.name}"
    system.loads.append(Force(geometry.a, sp.ImmutableMatrix(force), sp.ImmutableMatrix(touch.at), None, other, label))
    if any(e != 0 for e in touch.lever):
        (x, y, z), (f, g, h) = touch.lever, force
        moment = sp.ImmutableMatrix([y * h - z * g, z * f - x * h, x * g - y * f])
        system.loads.append(Torque(geometry.a, moment, None, other, f"{label}: moment"))
