"""The checked model: what a formulation takes in. Everything in it is consistent; nothing in it changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import sympy as sp

from symdyn.counting import counted
from symdyn.model.bodies import Body
from symdyn.model.closures import Constraint, Gear
from symdyn.model.contacts.group import LoweredGroup
from symdyn.model.contacts.lowering import CompliantContact, RigidContact
from symdyn.model.event import Event
from symdyn.model.joints import Joint
from symdyn.model.shapes import Drawn
from symdyn.model.state import State


@dataclass(frozen=True)
class NamedOutput:
    """An output by name: an expression, a list of expressions, or a Point of a body."""

    name: str
    value: Any


@dataclass(frozen=True, repr=False)
class Model:
    """A checked mechanism; prints as a summary, `details()` is the text of every field.

    bodies        in the order they were added, without the ground
    loops         joints that close loops, rods and gears; constraints: by expression
    joints        parents before children; joint k moves `bodies[children[k]]` relative to parent index, -1 the ground
    coordinates   independent ones, q; speeds u; rates: symbol of each coordinate's derivative -> its coordinate
    parameters, inputs   symbols in the order of first use
    defaults      number for each parameter that has one; initial: for coordinates, speeds, states, inputs
    units         symbol -> unit
    shapes        what bodies look like; surroundings: what contacts touch and how mooring lines hang, for pictures
    doubts        sentences on what is possible, but hardly meant
    contacts      rigid ones, place by place; their forces are among the loads, their events among the events; compliant: likewise
    groups        of contacts whose pairs are found along a motion
    chosen        generalized speeds of the user's choice: symbol, expression in the speeds that the joints would have,
                  own_speeds; eliminated: velocity constraints that the chosen speeds fulfil, which are not among `constraints`
    """

    name: str
    planar: bool
    gravity: sp.ImmutableMatrix
    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    parents: tuple[int, ...]
    children: tuple[int, ...]
    ground_motion: Joint | None
    loads: tuple[Any, ...]
    outputs: tuple[NamedOutput, ...]
    states: tuple[State, ...]
    constraints: tuple[Constraint, ...]
    loops: tuple[Joint | Gear, ...]
    coordinates: tuple[sp.Symbol, ...]
    speeds: tuple[sp.Symbol, ...]
    parameters: tuple[sp.Symbol, ...]
    inputs: tuple[sp.Symbol, ...]
    defaults: Mapping[sp.Symbol, float]
    initial: Mapping[sp.Symbol, float]
    duration: float
    units: Mapping[sp.Symbol, str]
    shapes: tuple[Drawn, ...] = ()
    surroundings: tuple[Drawn, ...] = ()
    events: tuple[Event, ...] = ()
    doubts: tuple[str, ...] = ()
    contacts: tuple[RigidContact, ...] = ()
    compliant: tuple[CompliantContact, ...] = ()
    groups: tuple[LoweredGroup, ...] = ()
    chosen: tuple[tuple[sp.Symbol, sp.Expr], ...] = ()
    own_speeds: tuple[sp.Symbol, ...] = ()
    eliminated: tuple[Constraint, ...] = ()

    def __str__(self) -> str:
        rows = [f"{self.name}: {'planar' if self.planar else 'spatial'} mechanism, no faults found",
                f"  {_number(self.bodies, 'body', 'bodies')}, {_number(self.joints, 'joint')}, "
                f"{_number(self.loops, 'loop closure')}, {_number(self.constraints, 'constraint')} by expression, "
                f"{_number(self.loads, 'load')}",
                f"  {_number(self.coordinates, 'coordinate')}: {_first(self.coordinates)}",
                f"  {_number(self.speeds, 'speed')}: {_first(self.speeds)}"]
        if self.states:
            rows.append(f"  {_number(self.states, 'extra state')}: {_first([z.symbol for z in self.states])}")
        if self.inputs:
            rows.append(f"  {_number(self.inputs, 'input')}: {_first(self.inputs)}")
        missing = [p for p in self.parameters if p not in self.defaults]
        without = f"; no default for {_first(missing)}" if missing else ", each with a default" if self.parameters else ""
        named = f": {_first(self.parameters)}" if self.parameters else ""
        rows.append(f"  {_number(self.parameters, 'parameter')}{named}{without}")
        rows += [f"  {_number(things, one)}" for things, one in ((self.outputs, "output"), (self.events, "event"),
                                                                       (self.contacts, "rigid contact"),
                                                                       (self.compliant, "compliant contact")) if things]
        rows += [f"  doubtful: {doubt}" for doubt in self.doubts]
        return "\n".join(rows)

    def __repr__(self) -> str:
        return str(self)

    def details(self) -> str:
        """Every field with its value, a line for each entry of a mapping."""
        rows = [f"{self.name}:"]
        for entry in fields(self)[1:]:
            value = getattr(self, entry.name)
            if isinstance(value, Mapping):
                rows += [f"  {entry.name}:", *(f"    {key}: {one}" for key, one in value.items())]
            elif isinstance(value, sp.MatrixBase):
                rows.append(f"  {entry.name}: {value.tolist()}")
            else:
                rows.append(f"  {entry.name}: {value}")
        return "\n".join(rows)


# Names in a line of the summary.
_SHOWN = 8


def _number(things: Sequence[Any], one: str, many: str = "") -> str:
    return counted(len(things), one, many) if things else f"no {many or one + 's'}"


def _first(things: Sequence[Any]) -> str:
    rest = len(things) - _SHOWN
    return ", ".join(map(str, things[:_SHOWN])) + (f" and {rest} more" if rest > 0 else "")


def joint_speeds(joint: Joint) -> tuple[Any, ...]:
    """The symbols of a joint's speeds: given ones, else its own; None for that of a coordinate that is an expression."""
    return joint.speeds if joint.speeds is not None else joint.default_speeds()
