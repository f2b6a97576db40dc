"""Printed objects: singular and plural, units, closures that would go unmentioned, rounding that is no value."""

from __future__ import annotations

import symdyn as sd
from symdyn.counting import counted


def single() -> sd.System:
    system = sd.System("one", planar=True)
    body = system.add_body("body", mass=1)
    system.add_joint(sd.Prismatic("rail", system.ground, body, sd.coordinates("q"), axis=[1, 0]))
    return system


def test_numbers_have_their_noun():
    assert [counted(n, "step") for n in (0, 1, 2)] == ["0 steps", "1 step", "2 steps"]
    assert counted(1, "body", "bodies") == "1 body" and counted(3, "body", "bodies") == "3 bodies"


def test_one_of_a_kind_is_printed_in_the_singular():
    system = single()
    assert repr(system) == "System('one', 1 body, 1 joint)"
    equations = system.embedding()
    assert repr(equations) == "<embedding equations of one: 1 coordinate, 1 speed>"
    module = equations.compile(backend="numpy")
    assert repr(module) == "<Module one: numpy, 1 coordinate, 1 speed, 0 parameters>"
    assert "3 times to t = 0.5 s, " in repr(module.simulate(t=[0, 0.2, 0.5], q=[0], u=[1]))


def test_closures_and_constraints_are_counted():
    system = sd.systems.get("four_bar")
    assert repr(system) == "System('four_bar', 3 bodies, 3 joints, 1 loop closure)"
    assert repr(system.augmented()) == "<augmented equations of four_bar: 3 coordinates, 3 speeds, 2 constraints>"


def test_rounding_of_a_search_is_printed_as_zero():
    found = sd.systems.get("double_pendulum").embedding().compile(backend="numpy").equilibrium()
    text = found.describe()
    assert "e-2" not in text.split("forces to")[1].split("\n", 1)[1]
    assert "q2   =              0 rad" in text
