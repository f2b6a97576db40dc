"""The checked model: what a formulation takes in. Everything in it is consistent; nothing in it changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import sympy as sp

from symdyn.model.bodies import Body
from symdyn.model.joints import Joint
from symdyn.model.symbols import Coordinate, Speed


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
    joints        parents before children; joint k moves `bodies[children[k]]` relative to parent index, -1 the ground
    coordinates   independent ones, q; speeds u; rates: symbol of each coordinate's derivative -> its coordinate
    parameters, inputs   symbols in the order of first use
    defaults      number for each parameter that has one; initial: for coordinates, speeds, states, inputs
    units         symbol -> unit
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
    constraints: tuple[sp.Expr, ...]
    loops: tuple[Joint, ...]
    coordinates: tuple[sp.Symbol, ...]
    speeds: tuple[sp.Symbol, ...]
    parameters: tuple[sp.Symbol, ...]
    inputs: tuple[sp.Symbol, ...]
    defaults: Mapping[sp.Symbol, float]
    initial: Mapping[sp.Symbol, float]
    duration: float
    units: Mapping[sp.Symbol, str]


def joint_speeds(joint: Joint) -> tuple[Any, ...]:
    """The symbols of a joint's speeds: given ones, else derivatives of coordinates, else omega by joint name."""
    if joint.speeds is not None:
        return joint.speeds
    same = len(joint.coordinates) == joint.n_speeds
    n_linear = joint.n_speeds if same else joint.n_speeds - 3
    linear = [q.dot if isinstance(q, Coordinate) else None for q in joint.coordinates[:n_linear]]
    angular = [] if same else [Speed(f"omega_{axis}_{joint.name}") for axis in "xyz"]
    return (*linear, *angular)
