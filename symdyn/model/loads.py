"""Loads: what acts on bodies and joints besides gravity."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import sympy as sp


@dataclass(frozen=True)
class Force:
    """A force (N) on a point of a body; point (3, 1) in body axes (None, until checked: the centre of mass), components
    in `frame` (None: the n-frame).

    reaction   a body on whose coinciding point the opposite force acts, or None
    """

    body: Any
    force: sp.ImmutableMatrix
    point: Any
    frame: Any
    reaction: Any
    label: str


@dataclass(frozen=True)
class Torque:
    """A torque (N m) on a body; components in `frame` (None: the n-frame); the opposite on `reaction`, if any."""

    body: Any
    torque: sp.ImmutableMatrix
    frame: Any
    reaction: Any
    label: str


@dataclass(frozen=True)
class JointForce:
    """Forces (N) or torques (N m) along the speeds of a joint."""

    joint: Any
    values: tuple[sp.Expr, ...]
    label: str


@dataclass(frozen=True)
class SpringDamper:
    """A spring (N/m) and damper (N s/m) in line between a point of one body and a point of another.

    length   unstretched length, m; points (3, 1) in the axes of their bodies
    stiffness, damping, length   expressions in coordinates, speeds, inputs, extra states, t and parameters
    """

    body_a: Any
    body_b: Any
    point_a: sp.ImmutableMatrix
    point_b: sp.ImmutableMatrix
    stiffness: sp.Expr
    damping: sp.Expr
    length: sp.Expr
    label: str

    def is_elastic(self, parameters: Collection[sp.Symbol]) -> bool:
        """Whether the spring has a potential, 1/2 stiffness (distance - length)^2: where both depend on parameters only."""
        return (self.stiffness.free_symbols | self.length.free_symbols) <= set(parameters)


@dataclass(frozen=True)
class ForceBetween:
    """A force (N) along the line from a point of one body to a point of another; positive where it draws them together.

    points (3, 1) in the axes of their bodies
    span   the distance of the points, m, with a value above 0 where they coincide; None: it is computed, and the force has no
           direction there
    """

    body_a: Any
    body_b: Any
    force: sp.Expr
    point_a: sp.ImmutableMatrix
    point_b: sp.ImmutableMatrix
    label: str
    span: sp.Expr | None = None


def expressions_of(load: Any) -> tuple[sp.Expr, ...]:
    """The expressions of a force, torque, joint force, spring-damper or force between points, which may depend on the motion."""
    if isinstance(load, Force):
        return tuple(load.force)
    if isinstance(load, Torque):
        return tuple(load.torque)
    if isinstance(load, JointForce):
        return load.values
    if isinstance(load, SpringDamper):
        return load.stiffness, load.damping, load.length
    if isinstance(load, ForceBetween):
        return (load.force,) if load.span is None else (load.force, load.span)
    return ()
