"""Constrained mechanisms that several tests of the runtime share, compiled once."""

from __future__ import annotations

import functools
from typing import Any

import pytest

import symdyn as sd
from symdyn import systems
from symdyn.runtime.building.compiler import find_compiler


def driven() -> sd.System:
    """A particle lifted along a circle at constant speed v: no motion is left, and at the top, t = l / v, none can follow."""
    x, y = sd.coordinates("x y")
    m, l, v, g = sd.parameters("m l v g", positive=True)
    system = sd.System("driven", gravity=[0, -g])
    rail, particle = system.add_body("rail", mass=m), system.add_body("particle", mass=m)
    system.add_joint(sd.Prismatic("along", system.ground, rail, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("up", rail, particle, axis=[0, 1], coordinate=y))
    system.add_constraint(x**2 + y**2 - l**2, "circle")
    system.add_constraint(y - v * sd.t, "lift")
    system.defaults = {m: 1, l: 1, v: 1, g: 9.81}
    system.initial = {x: 1, y.dot: 1}
    return system


def top() -> sd.System:
    """A free rigid body in Euler parameters."""
    m, a, b, c = sd.parameters("m a b c", positive=True)
    system = sd.System("top")
    body = system.add_body("body", mass=m, inertia=[a, b, c])
    system.add_joint(sd.Free("free", system.ground, body, coordinates=sd.coordinates("x y z p0 p1 p2 p3"),
                             orientation=sd.EulerParameters()))
    system.defaults = {m: 1, a: 1, b: 2, c: 3}
    return system


def equations(name: str) -> Any:
    """The equations of one of these, or of a system of the catalogue, augmented if it has constraints."""
    system = {"driven": driven, "top": top}.get(name, lambda: systems.get(name))()
    return system.augmented() if system.loops or system.constraints else system.embedding()


@functools.cache
def module(name: str, backend: str = "c") -> Any:
    """The module of one of these; skips without a compiler."""
    if backend == "c" and find_compiler() is None:
        pytest.skip("no C compiler here")
    return equations(name).compile(backend=backend)
