"""The checked model: what a formulation takes in. Everything in it is consistent; nothing in it changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import sympy as sp

from symdyn.model.bodies import Body
from symdyn.model.closures import Constraint, Gear
from symdyn.model.event import Event
from symdyn.model.joints import Joint
from symdyn.model.shapes import Drawn


@dataclass(frozen=True)
class State:
    """An extra state (actuator, controller) with its rate."""

    symbol: sp.Symbol
    rate: sp.Expr


@dataclass(frozen=True)
class NamedOutput:
    """An output by name: an expression, a list of expressions, or a Point of a body."""

    name: str
    value: Any


@dataclass(frozen=True)
class Model:
    """A checked mechanism.

    bodies        in the order they were added, without the ground
    loops         joints that close loops, rods and gears; constraints: by expression
    joints        parents before children; joint k moves `bodies[children[k]]` relative to parent index, -1 the ground
    coordinates   independent ones, q; speeds u; rates: symbol of each coordinate's derivative -> its coordinate
    parameters, inputs   symbols in the order of first use
    defaults      number for each parameter that has one; initial: for coordinates, speeds, states, inputs
    units         symbol -> unit
    shapes        what bodies look like
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
    events: tuple[Event, ...] = ()


def joint_speeds(joint: Joint) -> tuple[Any, ...]:
    """The symbols of a joint's speeds: given ones, else its own; None for that of a coordinate that is an expression."""
    return joint.speeds if joint.speeds is not None else joint.default_speeds()
