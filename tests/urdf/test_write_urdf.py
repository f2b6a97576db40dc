"""system.to_urdf: what is written is read back equal, by symdyn and by Pinocchio; and what a URDF has no words for."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import symdyn as sd
from symdyn.errors import ArgumentError, MissingExtra, ModelError, ModelWarning
from symdyn.lab.robots import collection
from symdyn.urdf.angles import angles, rotation
from tests.helpers import without_constants_of_modules
from tests.urdf.texts import ALL, saved

pytest.importorskip("defusedxml", reason="defusedxml is not installed; run: pip install 'symdyn[robots]'")
without_constants_of_modules()
# One of each kind; of what the package holds every robot with a joint is read back equal.
ROBOTS = ("panda_description/urdf/panda.urdf", "kinova_description/robots/kinova.urdf", "solo_description/robots/solo12.urdf",
          "allegro_hand_description/urdf/allegro_left_hand.urdf", "talos_data/robots/talos_left_arm.urdf")
TREE = ALL.replace('type="planar"', 'type="prismatic"').replace('type="floating"', 'type="continuous"')


def demand_equal(a: sd.System, b: sd.System) -> None:
    """Demand that two systems are described by the same names, numbers and expressions."""
    assert [x.name for x in a.bodies] == [x.name for x in b.bodies]
    for x, y in zip(a.bodies, b.bodies, strict=True):
        assert (x.mass, x.inertia, x.com) == (y.mass, y.inertia, y.com)
    for x, y in zip(a.joints, b.joints, strict=True):
        assert (type(x), x.name, x.coordinates) == (type(y), y.name, y.coordinates)
        for what in ("parent_point", "parent_rotation", "child_point", "child_rotation", "axis"):
            assert getattr(x, what, None) == getattr(y, what, None), (x.name, what)
    assert [load.values for load in a.loads] == [load.values for load in b.loads]


@pytest.mark.filterwarnings("ignore::symdyn.errors.ModelWarning")
@pytest.mark.parametrize("file", ROBOTS)
def test_a_robot_is_read_back_equal(tmp_path: Path, file: str) -> None:
    try:
        system = sd.read_urdf(collection.folder() / file)
    except MissingExtra as error:
        pytest.skip(str(error))
    demand_equal(system, sd.read_urdf(system.to_urdf(tmp_path / "again.urdf")))


def test_every_joint_is_read_back_equal(tmp_path: Path) -> None:
    text = TREE.replace('<axis xyz="1 2 -2"/>', '<axis xyz="1 2 -2.1"/><dynamics damping="0.3"/>')
    system = sd.read_urdf(saved(tmp_path, text), damping=True, symbolic=["m_*", "d_*", "p_x_*"])
    again = sd.read_urdf(system.to_urdf(tmp_path / "again.urdf"), damping=True, symbolic=["m_*", "d_*", "p_x_*"])
    demand_equal(system, again)
    assert system.defaults == again.defaults


def test_pinocchio_reads_it(tmp_path: Path) -> None:
    pytest.importorskip("pinocchio", reason="Pinocchio is not installed; run: pip install pin")
    from symdyn.lab.robots.agreement import differences
    from symdyn.lab.robots.pinocchio_robot import PinocchioRobot

    system = sd.read_urdf(saved(tmp_path, TREE))
    model = system.check()
    peer = PinocchioRobot(system.to_urdf(tmp_path / "again.urdf"), model)
    assert max(differences(system.recursive(), model, peer, 3).values()) < 1e-13


def branching() -> sd.System:
    """Joints away from their links' origins, turned on both sides, two of them on the ground; a gear; parameters; a drive."""
    q = sd.coordinates("a b c")
    m, l, k = sd.parameters("m l k")
    system = sd.System("tree", gravity=[0, 0, -9.81])
    R = [sd.rotation.about("X", sp.Rational(3, 10)), sd.rotation.about("Y", sp.Rational(-7, 10))]
    one = system.add_body("one", mass=m, inertia=[m * l**2 / 12, m * l**2 / 6, m * l**2 / 7], com=[l / 2, 0, 0.1])
    I = [[0.3, 0.01, 0.02], [0.01, 0.4, 0.03], [0.02, 0.03, 0.5]]
    two = system.add_body("two + more", mass=2, inertia=I, com=[0, 0.2, 0])
    three = system.add_body("three", mass=k * m, com=[0.1, 0.2, 0.3], inertia=[1, 1, 1])
    four = system.add_body("four", mass=0.5, inertia=[0.1, 0.1, 0.1])
    system.add_joint(sd.Revolute("A", system.ground, one, q[0], axis=[0, 0.6, 0.8], child_point=[0, l, 0], child_rotation=R[0]))
    system.add_joint(sd.Prismatic("B", one, two, q[1], axis=[1, 0, 0], parent_point=[l, 0, 0], parent_rotation=R[1],
                                  child_rotation=R[0], child_point=[0.1, 0.2, 0.3]))
    system.add_joint(sd.Revolute("C", system.ground, three, q[2], axis=[0, 0, 1], parent_point=[1, 0, 0]))
    system.add_joint(sd.Revolute("D", three, four, 2 - 3 * q[0], axis=[0, 1, 0], parent_point=[0, 0, l]))
    system.add_joint_force("A", sd.inputs("tau") - k * q[0].dot)
    system.defaults = {m: 1.7, l: 0.3, k: 0.25}
    return system


def test_frames_that_are_not_at_joints(tmp_path: Path) -> None:
    """The system that is read back moves alike: mass matrix and gravity load; a drive is no part of the file."""
    system = branching()
    again = sd.read_urdf(system.to_urdf(tmp_path / "tree.urdf"), damping=True)
    assert [b.name for b in again.bodies] == ["world", "one", "two + more", "three", "four"]
    assert {j.name for j in again.joints} == {"root", "A", "B", "C", "D"}
    (damping,) = again.loads
    assert damping.values == (-0.25 * sd.coordinates("q_A").dot,)
    ours, theirs = (s.embedding().compile(backend="numpy") for s in (system, again))
    rng = np.random.default_rng(3)
    for q, u, ud in rng.uniform(-1, 1, (5, 3, 3)):
        for a, b in ((ours.mass_matrix(q), theirs.mass_matrix(q)),
                     (ours.inverse_dynamics(q, u, ud), theirs.inverse_dynamics(q, u, ud))):
            np.testing.assert_allclose(a, b, rtol=1e-13, atol=1e-14 * np.abs(a).max())


@settings(deadline=None, max_examples=200)
@given(st.tuples(*[st.sampled_from([0.0, 1.5707963267948966, -1.5708, 3.14159265359, -4.71238898038, 0.785398, 1e-6, -2.5])
                   | st.integers(-31416, 31416).map(lambda k: k / 1e4)] * 3))
def test_written_angles_turn_alike_to_the_last_bit(rpy: tuple[float, float, float]) -> None:
    """For angles of few digits; two that turn about one axis, at a pitch of exactly 90 degrees, are joined in one."""
    R = rotation(rpy)
    found = rotation(angles(R))
    if abs(R[2][0]) == 1 and R[2][1:] == (0, 0):
        np.testing.assert_allclose(found, R, atol=4e-16)
    else:
        assert found == R


@settings(deadline=None, max_examples=100)
@given(st.tuples(*[st.floats(-4, 4)] * 3))
def test_written_angles_of_any_rotation(rpy: tuple[float, float, float]) -> None:
    np.testing.assert_allclose(rotation(angles(rotation(rpy))), rotation(rpy), atol=1e-15)


# -- what a URDF has no words for


def test_a_path_that_is_none() -> None:
    with pytest.raises(ArgumentError, match="the path is 7; pass that of a URDF file"):
        branching().to_urdf(7)


def fault_of(change: Callable[[sd.System], object]) -> str:
    system = branching()
    change(system)
    with pytest.raises(ModelError) as raised:
        system.to_urdf("/nowhere/never.urdf")
    (fault,) = raised.value.faults
    return fault


def test_gravity_that_is_not_what_is_read_is_reported(tmp_path: Path) -> None:
    system = sd.System("side", gravity=[0, -9.81, 0])
    bar = system.add_body("bar", mass=1, inertia=[1, 1, 1], com=[1, 0, 0])
    system.add_joint(sd.Revolute("hinge", system.ground, bar, sd.coordinates("q"), axis=[0, 0, 1]))
    told = r"^side: a URDF holds no gravity, and read_urdf takes 9\.81 m/s\^2 along -z; here it is \[0, -9\.81, 0\]$"
    with pytest.warns(ModelWarning, match=told):
        system.to_urdf(tmp_path / "side.urdf")


@pytest.mark.parametrize(("change", "told"), [
    (lambda s: s.close_loop(sd.Rod("rod", "two + more", "four", 1.0)), "it has closed loops (rod); a URDF is a tree of links"),
    (lambda s: s.add_constraint(sd.coordinates("b") - 1, "stop"), "it has constraints (stop); a URDF is a tree"),
    (lambda s: s.add_state(sd.coordinates("z"), 1), "it has extra states (z)"),
    (lambda s: s.add_event("bump", sd.coordinates("b")), "it has events (bump)"),
    (lambda s: s.move_ground(position=[sd.t, 0, 0]), "it has a moving ground (ground)"),
    (lambda s: s.add_joint(sd.Spherical("ball", "four", s.add_body("five", mass=1, inertia=[1, 1, 1]))),
     "joint 'ball' is spherical; what is written is fixed, revolute or prismatic"),
    (lambda s: s.add_joint(sd.Revolute("bent", "four", s.add_body("five", mass=1), coordinate=sd.coordinates("b")**2)),
     "joint 'bent' has the coordinate b**2; what is written is a coordinate of its own, or a multiple of another joint's plus"),
    (lambda s: s.add_joint(sd.Revolute("driven", "four", s.add_body("five", mass=1), coordinate=sp.sin(sd.t))),
     "joint 'driven' has the coordinate sin(t); what is written is a coordinate of its own"),
    (lambda s: s.add_force("one", [1, 0, 0], name="push"), "push is a load; a URDF holds none but the damping of joints: leave"),
    (lambda s: s.add_joint_force("B", -3 * sd.coordinates("b"), name="spring"),
     "spring on joint 'B' is -3*b; a URDF holds no loads but viscous damping: leave it out"),
    (lambda s: s.add_joint_force("B", 3, name="weight"), "weight on joint 'B' is 3; a URDF holds no loads but viscous damping"),
    (lambda s: s.add_joint_force("B", 3 * sd.coordinates("b").dot, name="boost"), "boost on joint 'B' is 3*b_dot; a URDF holds"),
    (lambda s: s.defaults.pop(sp.Symbol("l")), "there is no number for l; add them to the defaults: a URDF holds numbers"),
    (lambda s: None, "/nowhere/never.urdf: the file cannot be written (No such file or directory)"),
])
def test_what_is_not_written(change: Callable[[sd.System], object], told: str) -> None:
    assert fault_of(change).startswith(told)
