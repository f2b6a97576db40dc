"""Mechanisms whose mass matrix is singular at every state are rejected with the speed and what to do."""

import pytest

import symdyn as sd

q1, q2 = sd.coordinates("q1 q2")


def series(first: type, second: type, mass_between=0):
    system = sd.System("series", gravity=[0, 0, -9.81])
    between = system.add_body("between", mass=mass_between, inertia=[mass_between] * 3)
    last = system.add_body("last", mass=sd.parameters("m"), inertia=sd.parameters("I1 I2 I3"), com=[1, 0, 0])
    system.add_joint(first("j1", system.ground, between, q1))
    system.add_joint(second("j2", between, last, q2))
    return system


@pytest.mark.parametrize("kind", [sd.Prismatic, sd.Revolute])
def test_two_joints_that_do_the_same(kind):
    with pytest.raises(sd.ModelError, match=r"singular at every state: q1_dot .* give the bodies between them mass"):
        series(kind, kind).embedding()


@pytest.mark.parametrize("kind", [sd.Prismatic, sd.Revolute])
def test_mass_between_makes_them_differ(kind):
    assert series(kind, kind, mass_between=1).embedding().verify(states=1).passed


def test_massless_body_between_different_joints_is_fine():
    assert series(sd.Prismatic, sd.Revolute).embedding().verify(states=1).passed


def test_nothing_to_move():
    system = sd.System("empty")
    body = system.add_body("arm", mass=0)
    system.add_joint(sd.Revolute("pin", system.ground, body, q1))
    with pytest.raises(sd.ModelError, match=r"joint 'pin': what it moves has no mass or inertia along q1_dot"):
        system.embedding()


def test_point_mass_on_the_axis():
    system = sd.System("spindle")
    body = system.add_body("bead", mass=1)
    system.add_joint(sd.Revolute("pin", system.ground, body, q1))
    with pytest.raises(sd.ModelError, match="no mass or inertia along q1_dot"):
        system.embedding()
