"""system.to_mjcf: MuJoCo's accelerations of what is written, and what cannot be written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import ArgumentError, ModelError, ModelWarning
from symdyn.model.record import joint_speeds
from tests.helpers import swept
from tests.mjcf.texts import BALL, CLOSED

pytest.importorskip("mujoco", reason="mujoco is not installed; run: pip install 'symdyn[mjcf]'")
pytest.importorskip("defusedxml", reason="defusedxml is not installed; run: pip install 'symdyn[mjcf]'")
E = np.array([[0.05, 0.002, -0.003], [0.002, 0.06, 0.004], [-0.003, 0.004, 0.07]])
TILTED = [[0.36, 0.48, -0.8], [-0.8, 0.6, 0], [0.48, 0.64, 0.6]]


def every_joint() -> sd.System:
    """All joints that are written, with turned frames, a body without mass, an armature and forces."""
    system = sd.System("every", gravity=[0, 0, -9.81])
    names = ("cart", "cross", "disc", "ring", "ball", "flyer", "angled")
    bodies = {name: system.add_body(name, 1.5, E, [0.1, -0.05, 0.2]) for name in names}
    light = system.add_body("light")
    rail = system.add_joint(sd.Prismatic("rail", system.ground, bodies["cart"], axis=[1, 2, 2], parent_rotation=TILTED,
                                         child_point=[0.1, 0, 0]))
    system.add_joint(sd.Universal("cross", "cart", bodies["cross"], parent_point=[0, 0, 0.3], child_rotation=TILTED))
    turn = system.add_joint(sd.Revolute("turn", "cross", light, axis=[0, 1, 0], child_point=[0, 0.1, 0], parent_rotation=TILTED))
    system.add_joint(sd.Planar("plane", light, bodies["disc"], parent_rotation=TILTED, child_point=[0, 0, 0.1]))
    system.add_joint(sd.Cylindrical("sleeve", "disc", bodies["ring"], axis=[0, 0, 1], parent_point=[0.2, 0, 0]))
    socket = system.add_joint(sd.Spherical("socket", "ring", bodies["ball"], orientation=sd.EulerParameters(),
                                           child_point=[0, 0, 0.1]))
    system.add_joint(sd.Free("fly", system.ground, bodies["flyer"], orientation=sd.EulerParameters()))
    system.add_joint(sd.Spherical("angles", "flyer", bodies["angled"], parent_rotation=TILTED))
    rotor = system.add_body("rotor", 0, [0.01, 0.01, 0.02])
    q, F, T, G = turn.coordinates[0], *sd.inputs("F T G")
    system.add_joint(sd.Revolute("rotor", system.ground, rotor, coordinate=3 * q))
    system.add_joint_force(turn, 2 * F - 3 * q - 0.4 * q.dot + 0.6)
    x = rail.coordinates[0]
    system.add_joint_force(rail, -0.2 * x.dot)
    system.add_joint_force(socket, [T, 2 * T, -T])
    system.add_joint_force(socket, [-0.1 * w for w in socket.default_speeds()])
    system.add_spring_damper(system.ground, "ball", [1, 0, 0], [0, 0.1, 0], stiffness=20, damping=0.5, length=0.4)
    system.add_force_between("cart", "flyer", 3 * G, [0, 0.2, 0], [0.1, 0, 0])
    return system


def closed() -> sd.System:
    return sd.read_mjcf(CLOSED)


def geared() -> sd.System:
    system = sd.systems.get("spatial_chain", n=4)
    system.close_loop(sd.Gear("gear", "joint1", "joint3", ratio=-1.5, offset=0.2))
    q2, q4 = (next(j for j in system.joints if j.name == name).coordinates[0] for name in ("joint2", "joint4"))
    system.add_constraint(q4 + 0.5 * q2**3 - 0.1, "cam")
    return system


@pytest.mark.parametrize(("make", "constraints"), [
    (every_joint, 0), (closed, 11), (geared, 2), (lambda: sd.systems.get("four_bar"), 3),
    *swept([(lambda: sd.systems.get("n_four_bar"), 6)]), (lambda: sd.systems.get("bricard"), 6),
    *swept([(lambda: sd.systems.get("stewart_platform"), 18)])],
    ids=["every", "closed", "geared", "four_bar", "n_four_bar", "bricard", "stewart"])
def test_mujoco_accelerates_alike(tmp_path: Path, make: Callable[[], sd.System], constraints: int) -> None:
    from symdyn.lab.robots.mujoco_sweep import measure_system

    system = make()
    row = measure_system(system, system.to_mjcf(tmp_path / "out.xml"), tmp_path, weights=False)
    assert row.M < 1e-13 and row.ud < 1e-12 and row.constraints == constraints


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    one = sd.systems.get("spatial_chain", n=3)
    two = sd.read_mjcf(one.to_mjcf(tmp_path / "chain.xml"))
    first, second = one.check(), two.check()
    assert [j.name for j in first.joints] == [j.name for j in second.joints]
    x = np.linspace(0.1, 0.6, 6)
    np.testing.assert_allclose(two.compile("numpy").rhs(0, x), one.compile("numpy").rhs(0, x), rtol=1e-13)
    again = sd.read_mjcf(two.to_mjcf(tmp_path / "again.xml"))
    for a, b in zip(second.bodies, again.check().bodies, strict=True):
        np.testing.assert_allclose(np.array(a.inertia, dtype=float), np.array(b.inertia, dtype=float), rtol=0, atol=1e-16)


def started(system: sd.System) -> dict[str, list[float]]:
    model = system.check()
    return {j.name: [float(model.initial.get(s, 0.0)) for s in (*j.coordinates, *joint_speeds(j))] for j in model.joints}


@pytest.mark.parametrize("make", [lambda: sd.systems.get("n_four_bar"), lambda: sd.systems.get("stewart_platform"), every_joint])
def test_initial_values_are_read_back(tmp_path: Path, make: Callable[[], sd.System]) -> None:
    one = make()
    if make is every_joint:
        model = one.check()
        one.initial = {s: 0.1 * (k + 1) for k, s in enumerate([*model.coordinates[:6], *model.inputs])}
        one.initial |= {q.dot: 0.5 for q in model.coordinates[:6]}
        turned = next(j for j in model.joints if j.name == "fly").coordinates
        one.initial |= dict(zip(turned, [1.0, 2.0, 3.0, 0.5, 0.5, -0.5, 0.5]))
    two = sd.read_mjcf(one.to_mjcf(tmp_path / "out.xml"))
    first, second = started(one), started(two)
    for name in first:
        if name in second:
            np.testing.assert_allclose(second[name], first[name], rtol=1e-15)
    assert sum(name in second for name in first) >= len(first) - 8
    given = {str(s): v for s, v in two.initial.items()}
    assert all(given[str(s)] == v for s, v in one.check().initial.items() if s in one.check().inputs)


def test_loops_that_are_read_back_start_closed(tmp_path: Path) -> None:
    two = sd.read_mjcf(sd.systems.get("four_bar").to_mjcf(tmp_path / "out.xml"))
    assert two.compile("numpy").simulate((0, 0.01)).t[-1] == 0.01


def test_a_keyframe_is_chosen_by_its_name(tmp_path: Path) -> None:
    text = """<mujoco><worldbody><body name="bar"><joint name="hinge" axis="0 1 0"/><geom size="0.1" pos="0 0 -1"/></body>
      </worldbody><actuator><general name="lag" joint="hinge" dyntype="filter" dynprm="0.2"/></actuator>
      <keyframe><key name="home" qpos="0.5" qvel="2" act="0.25" ctrl="3"/><key qpos="9"/></keyframe></mujoco>"""
    home = sd.read_mjcf(text, keyframe="home")
    assert {str(s): v for s, v in home.initial.items()} == {"q_hinge": 0.5, "q_hinge_dot": 2.0, "act_lag": 0.25, "lag": 3.0}
    assert not sd.read_mjcf(text).initial
    with pytest.raises(ModelError, match="keyframe is 'hone', which the file does not have; there are home; did you mean 'home'"):
        sd.read_mjcf(text, keyframe="hone")
    with pytest.raises(ArgumentError, match="keyframe is 3; pass text"):
        sd.read_mjcf(text, keyframe=3)


def test_speeds_that_are_no_rates_are_not_started_with(tmp_path: Path) -> None:
    system = sd.System("top", gravity=[0, 0, -9.81])
    body = system.add_body("top", 1, [1, 2, 3], [0, 0, 1])
    w = sd.coordinates("w1 w2 w3")
    joint = system.add_joint(sd.Spherical("tip", system.ground, body, orientation=sd.EulerAngles("ZYX", speeds="body"), speeds=w))
    system.initial = {w[0]: 1.0}
    with pytest.raises(ModelError, match="joint 'tip' starts with the speed w1, which is not the rate of a coordinate"):
        system.to_mjcf(tmp_path / "top.xml")
    assert joint.name == "tip"


def test_point_masses_get_some_inertia(tmp_path: Path) -> None:
    with pytest.warns(ModelWarning, match="the point masses bob are written with 1e-14 kg m\\^2"):
        path = sd.systems.pendulum().to_mjcf(tmp_path / "p.xml")
    assert sd.read_mjcf(path).bodies[0].inertia[0, 0] == 1e-14


def joined(joint: sd.Joint | None = None, **body: object) -> sd.System:
    system = sd.System("s", gravity=[0, 0, -9.81])
    system.add_body("b", **{"mass": 1, "inertia": [1, 1, 1], **body})
    system.add_joint(joint or sd.Revolute("j", "ground", "b"))
    return system


def with_load(add: Callable[[sd.System, object], object]) -> sd.System:
    system = joined()
    add(system, system.joints[0].coordinates[0])
    return system


@pytest.mark.filterwarnings("ignore:.*violate the triangle inequality")
@pytest.mark.parametrize(("system", "fault"), [
    (joined(sd.Helical("j", "ground", "b", pitch=0.1)), "joint 'j' is helical, which MJCF has no joint for"),
    (joined(mass=0, inertia=[1, 0, 0]),
     "body 'b' has the mass 0 kg and the least moment of inertia 0 kg m^2; MuJoCo moves no body"),
    (joined(inertia=[1, 2, 3.5]), "body 'b' has the principal moments 1, 2, 3.5 kg m^2, the largest more than"),
    (joined(mass=sd.parameters("m")), "there is no number for m; add them to the defaults"),
    (joined(sd.Free("j", "ground", "b", orientation=sd.EulerParameters(), parent_point=[1, 0, 0])),
     "joint 'j' is free and its frames are not those of the ground and of the body"),
    (joined(sd.Spherical("j", "ground", "b", orientation=sd.EulerParameters(), child_rotation=TILTED)),
     "joint 'j' is spherical and its frame on the child is turned"),
    (with_load(lambda s, q: s.add_joint_force("j", q**2)), "on joint 'j' is q_j**2; written are forces that are linear"),
    (with_load(lambda s, q: s.add_joint_force("j", 0.3)), "on joint 'j' is the constant 0.3 besides what is linear in q"),
    (with_load(lambda s, q: s.add_torque("b", [0, 0, 1])), "torque_1 is a load that MJCF has no words for"),
    (with_load(lambda s, q: s.add_force_between("ground", "b", q, [1, 0, 0], [0, 1, 0])),
     "depends on the motion by a law of its own"),
    (with_load(lambda s, q: s.add_state(sd.coordinates("z"), q)), "it has extra states (z)"),
    (with_load(lambda s, q: s.add_event("e", q)), "it has events (e)"),
    (with_load(lambda s, q: s.set_speeds({sd.speeds("w"): 2 * q.dot})), "it has chosen speeds (w)"),
    (with_load(lambda s, q: s.move_ground([sd.t, 0, 0])), "it has a moving ground (ground)"),
    (with_load(lambda s, q: s.add_constraint(q.dot - 1, "v")), "the constraint 'v' is"),
    (with_load(lambda s, q: s.close_loop(sd.Rod("r", "ground", "b", 1, [1, 0, 0], [0, 1, 0]))),
     "the loop 'r' is closed by a rod joint"),
    (with_load(lambda s, q: [s.add_joint_force("j", sd.inputs("F"), "one"), s.add_joint_force("j", sd.inputs("F"), "two")]),
     "the input F drives several joints or loads"),
])
def test_what_cannot_be_written(tmp_path: Path, system: sd.System, fault: str) -> None:
    with pytest.raises(ModelError) as raised:
        system.to_mjcf(tmp_path / "out.xml")
    assert any(fault in f for f in raised.value.faults), raised.value.faults
    assert not (tmp_path / "out.xml").exists()


def test_coordinates_that_are_not_written(tmp_path: Path) -> None:
    system = joined()
    q = system.joints[0].coordinates[0]
    system.add_joint(sd.Revolute("k", "b", system.add_body("c", 1, [1, 1, 1]), coordinate=q**2))
    with pytest.raises(ModelError, match="joint 'k' has the coordinate q_j\\*\\*2; written are coordinates of its own"):
        system.to_mjcf(tmp_path / "out.xml")
    ball = sd.read_mjcf(f'<mujoco><worldbody><body name="b"><joint name="j" type="ball"/>{BALL}</body></worldbody></mujoco>')
    ball.add_joint_force("j", [ball.joints[0].default_speeds()[0], 0, 0])
    with pytest.raises(ModelError, match="written are equal damping of all its speeds, and one input times numbers"):
        ball.to_mjcf(tmp_path / "out.xml")


def test_paths(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match="the path is 7; pass that of an MJCF file"):
        joined().to_mjcf(7)
    with pytest.raises(ModelError, match="the file cannot be written"):
        joined().to_mjcf(tmp_path)
