"""sd.read_mjcf: against MuJoCo's own masses and accelerations, and the messages about faulty models."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, MissingExtra, ModelError, ModelWarning
from tests.mjcf.texts import BALL, CLOSED, DRIVEN, JOINTS, pendulum

pytest.importorskip("mujoco", reason="mujoco is not installed; run: pip install 'symdyn[mjcf]'")
pytest.importorskip("defusedxml", reason="defusedxml is not installed; run: pip install 'symdyn[mjcf]'")


def saved(folder: Path, text: str, name: str = "robot.xml") -> Path:
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


# -- against MuJoCo


@pytest.mark.parametrize("text", [JOINTS, CLOSED], ids=["joints", "closed"])
def test_masses_and_accelerations_are_those_of_mujoco(tmp_path: Path, text: str) -> None:
    from symdyn.lab.robots.mujoco_sweep import measure

    row = measure(saved(tmp_path, text), tmp_path)
    assert row.mass < 1e-14 and row.M < 1e-13 and row.ud < 1e-12
    assert row.constraints == (11 if text is CLOSED else 0)


@pytest.mark.filterwarnings("ignore:.*not taken over")
def test_forces_of_tendons_and_actuators_are_those_of_mujoco(tmp_path: Path) -> None:
    from symdyn.lab.robots.mujoco_sweep import measure

    assert measure(saved(tmp_path, DRIVEN), tmp_path).ud < 1e-12


def test_the_sweep_counts_models_that_differ(tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                             monkeypatch: pytest.MonkeyPatch) -> None:
    from symdyn.lab.robots import mujoco_sweep

    saved(tmp_path, pendulum())
    saved(tmp_path, pendulum(' foo="1"'), "wrong.xml")
    assert mujoco_sweep.run([tmp_path], states=1) == 0
    assert "1 models read, 1 agree to 1e-12; 1 rejected" in capsys.readouterr().out
    monkeypatch.setattr(mujoco_sweep, "AGREEMENT", -1.0)
    assert mujoco_sweep.run([tmp_path / "robot.xml"], states=1) == 1
    assert "DIFFERS" in capsys.readouterr().out


# -- what becomes of a model


def test_the_elements() -> None:
    model = sd.read_mjcf(JOINTS).check()
    assert model.name == "joints"
    assert [str(q) for q in model.coordinates] == [
        "q_x", "q_yaw", "q_pitch", "q_lift", "e0_socket", "e1_socket", "e2_socket", "e3_socket",
        "x_fly", "y_fly", "z_fly", "e0_fly", "e1_fly", "e2_fly", "e3_fly"]
    start = {str(s): v for s, v in model.initial.items()}
    assert start["q_x"] == 0.1 and start["q_yaw"] == pytest.approx(np.radians(15), rel=1e-15)
    assert (start["x_fly"], start["e0_fly"], start["e1_fly"]) == (1.0, 0.8, 0.6)
    names = [b.name for b in model.bodies]
    assert names[:3] == ["base", "base before pitch", "base before pitch 2"]
    assert [n for n in names if n.startswith("armature")] == [f"armature of {j}" for j in ("yaw", "pitch", "lift")]


def test_symbols_take_the_file_s_numbers() -> None:
    text = pendulum(' damping="0.2" stiffness="3" armature="0.1" pos="0 0 0.5"',
                    '<actuator><position name="servo" joint="hinge" kp="7"'
                    ' kv="0.5" gear="2"/></actuator>')
    system = sd.read_mjcf(text, symbolic=["g", "bar", "hinge", "servo"])
    values = {str(s): v for s, v in system.defaults.items()}
    assert values["m_bar"] == 2.0 and values["g"] == 9.81 and values["c_z_bar"] == -1.0 and values["a_z_hinge"] == 0.5
    assert {n: values[f"{n}"] for n in ("d_hinge", "k_hinge", "J_hinge", "kp_servo", "kv_servo", "gear_servo")} == {
        "d_hinge": 0.2, "k_hinge": 3.0, "J_hinge": 0.1, "kp_servo": 7.0, "kv_servo": 0.5, "gear_servo": 2.0}
    g, m, c, a, J, I = sp.symbols("g m_bar c_z_bar a_z_hinge J_hinge I_yy_bar")
    M = sd.read_mjcf(pendulum(' armature="0.1" pos="0 0 0.5"'), symbolic=["m_bar", "c_z_bar", "a_z_hinge", "J_hinge", "I_yy_bar"])
    formed = M.embedding().M_tilde[0, 0]
    assert sp.expand(formed - (m * (c - a)**2 + I + J)) == 0
    numbers, symbols = (sd.read_mjcf(text, symbolic=s).compile("numpy").rhs(0, [0.3, 0.2], inputs=[0.4]) for s in ([], ["*"]))
    np.testing.assert_allclose(numbers, symbols, rtol=1e-14)
    assert g in system.defaults


def test_joints_are_held_and_elements_left_out() -> None:
    held = sd.read_mjcf(DRIVEN, fixed=["b", "c"], leave_out=["ranges"]).check()
    assert "q_b" not in map(str, held.coordinates) and "q_a" in map(str, held.coordinates)
    without = sd.read_mjcf(CLOSED, leave_out=["glue", "law"])
    assert [j.name for j in without.loops] == ["tip"] and [c.name for c in without.constraints] == ["pull"]


def test_a_part_of_what_is_not_taken_is_reported() -> None:
    text = pendulum(' range="-1 1" frictionloss="0.1"', '<worldbody><geom name="floor" type="plane" size="1 1 1"/></worldbody>\n'
                    '<actuator><motor name="m" joint="hinge" ctrlrange="-1 1"/></actuator>')
    with pytest.warns(ModelWarning) as warned:
        sd.read_mjcf(text)
    said = str(warned[0].message)
    for part in ("contacts of 'floor' (text:4), 'geom_1' (text:3)", "limits of 'hinge' (text:3)",
                 "frictionloss of 'hinge' (text:3)",
                 "ctrlrange of 'm' (text:5)", "name it in leave_out"):
        assert part in said
    sd.read_mjcf(text, leave_out=["contacts", "limits", "friction", "ranges"])  # warns of nothing
    inactive = pendulum("", '<equality><joint name="lock" joint1="hinge" active="false"/></equality>')
    with pytest.warns(ModelWarning, match="constraints that are not active of 'lock'"):
        assert not sd.read_mjcf(inactive).constraints
    with pytest.warns(ModelWarning, match="motion capture"):
        sd.read_mjcf(pendulum("", '<worldbody><body name="hand" mocap="true"/></worldbody>'))


# -- files


def test_included_files_and_their_lines(tmp_path: Path) -> None:
    saved(tmp_path, '<mujocoinclude>\n\n<body name="in"><joint name="j" type="ball" stiffness="1"/><geom '
                    'size="1"/></body></mujocoinclude>',
          "parts/arm.xml")
    path = saved(tmp_path, '<mujoco><worldbody>\n<include file="parts/arm.xml"/></worldbody></mujoco>')
    with pytest.raises(ModelError) as raised:
        sd.read_mjcf(path)
    assert raised.value.faults[0].startswith(f"{tmp_path / 'parts' / 'arm.xml'}:3: joint 'j' is ball and has a stiffness")
    assert len(sd.read_mjcf(path, leave_out="j").check().speeds) == 3


@pytest.mark.parametrize(("element", "fault"), [
    ('<include file="/etc/passwd"/>', "<include> has file='/etc/passwd', which is outside of the folder"),
    ('<include file="../up.xml"/>', "<include> has file='../up.xml', which is outside of the folder"),
    ('<include file="http://a/b.xml"/>', "write the path of a file with / between its parts"),
    ('<include file="none.xml"/>', "and there is no file"), ("<include/>", "<include> has no file; write file=\"...\""),
    ('<include file="robot.xml"/>', "leads back to a file that it is in; leave it out"),
    ('<asset><mesh name="m" file="../m.stl"/></asset>', "<mesh> has file='../m.stl', which is outside of the folder"),
    ('<compiler meshdir="/tmp"/><asset><mesh name="m" file="m.stl"/></asset>', "<mesh> has file='m.stl', which is outside"),
    ('<asset><model name="m" file="m.xml"/></asset>', "<model> attaches another file, which is not read"),
    ('<worldbody><flexcomp type="mesh" file="m.obj"/></worldbody>', "<flexcomp> reads a file, which is taken for meshes"),
])
def test_files_stay_in_the_folder(tmp_path: Path, element: str, fault: str) -> None:
    (tmp_path / "inner").mkdir()
    saved(tmp_path, "<mujocoinclude/>", "up.xml")
    path = saved(tmp_path, pendulum("", element), "inner/robot.xml")
    with pytest.raises(ModelError) as raised:
        sd.read_mjcf(path)
    assert str(raised.value).startswith(f"{path}:4: ") and fault in str(raised.value)


def test_a_link_out_of_the_folder_is_rejected(tmp_path: Path) -> None:
    saved(tmp_path, "<mujocoinclude/>", "up.xml")
    path = saved(tmp_path, pendulum("", '<include file="here.xml"/>'), "inner/robot.xml")
    (path.parent / "here.xml").symlink_to(tmp_path / "up.xml")
    with pytest.raises(ModelError, match="outside of the folder"):
        sd.read_mjcf(path)
    sd.read_mjcf(path, folder=tmp_path)


# -- faults

BOX = '<mujoco><worldbody><body name="b">\n<joint name="j" type="ball"{more}/><geom size="1"/></body></worldbody></mujoco>'
WRAPPED = ('<worldbody><site name="s"/><geom name="w" size=".1" contype="0"/><site name="e" pos="1 1 1"/></worldbody><tendon>\n'
           '<spatial name="cord"{more}><site site="s"/><geom geom="w"/><site site="e"/></spatial></tendon>')


@pytest.mark.parametrize(("text", "fault"), [
    ("<!DOCTYPE x><mujoco/>", "text:1: the file declares a document type, which is rejected"),
    ("<robot/>", "text:1: the file holds a <robot>; an MJCF holds a <mujoco>"),
    ("<mujoco>\n<worldbody>", "text:2: the file is no XML there (no element found); pass an MJCF file"),
    (pendulum(' foo="1"'), "text:3: MuJoCo rejects the model in 'joint'"),
    (pendulum(' type="bolt"'), "text:3: MuJoCo rejects the model in 'joint': invalid keyword: 'bolt'"),
    (BOX.format(more=' stiffness="2"'),
     "text:2: joint 'j' is ball and has a stiffness, which is not built; pass leave_out='j' to do"),
    (BOX.format(more=' armature="2"'), "text:2: joint 'j' is ball and has an armature, which is not built"),
    (pendulum(' springyield="2" stiffness="1"'), "text:3: joint 'hinge' has a plastic spring (springyield), which is not built"),
    (pendulum(' range="-1 1" limited="false"', '<actuator>\n<muscle name="biceps" joint="hinge" lengthrange="0 1"/></actuator>'),
     "text:5: actuator 'biceps' has the dynamics muscle, which is not built"),
    (pendulum("", '<actuator>\n<dcmotor name="dc" joint="hinge" motorconst="0.1 0.1" resistance="1"/></actuator>'),
     "text:5: actuator 'dc' has the dynamics dcmotor, which is not built"),
    (pendulum("", WRAPPED.format(more=' stiffness="3"')),
     "text:5: tendon 'cord' wraps around geoms or pulleys, which is not built"),
    (pendulum("", WRAPPED.format(more="") + '<actuator><motor name="m" tendon="cord"/></actuator>'),
     "text:5: actuator 'm' pulls at a tendon that wraps around geoms or pulleys"),
    (pendulum("", '<option density="1.2"/>'), "text: the model moves in a fluid (density 1.2 kg/m^3, viscosity 0 Pa s)"),
    (pendulum("", '<extension><plugin plugin="mujoco.none"/></extension>'), "text:4: MuJoCo rejects the model in 'plugin'"),
    (pendulum("", '<include file="a.xml"/>'), "text:4: <include> has file='a.xml', and a text has no folder that files are in"),
    (f'<mujoco><worldbody><body name="b"><joint name="j" type="ball"/>{BALL}</body></worldbody><actuator>\n'
     '<position name="p" joint="j"/></actuator></mujoco>',
     "text:2: actuator 'p' feeds back the length of something that has none"),
])
def test_faults_and_their_lines(text: str, fault: str) -> None:
    with pytest.raises(ModelError) as raised:
        sd.read_mjcf(text)
    assert raised.value.faults[0].startswith(fault)


def test_arguments() -> None:
    for given, fault in (({"fixed": "none"}, "fixed has 'none', which fits no joint of the file"),
                         ({"symbolic": "m_none"}, "symbolic has 'm_none', which fits no parameter"),
                         ({"leave_out": "none"}, "leave_out has 'none', which fits no element that could be left out")):
        with pytest.raises(ModelError, match=fault):
            sd.read_mjcf(pendulum(), **given)
    for given, fault in (((7,), "the path is 7; pass that of an MJCF file"), ((pendulum(), 3), "symbolic is 3"),
                         (("<mujoco/>", (), None, (), (), "/none"), "folder is '/none', which is no folder")):
        with pytest.raises(ArgumentError, match=fault):
            sd.read_mjcf(*given)
    with pytest.raises(ModelError, match=r"none\.xml: the file cannot be read"):
        sd.read_mjcf("none.xml")


def test_without_mujoco(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingExtra, match=r"reading an MJCF needs the package mujoco: pip install 'symdyn\[mjcf\]'"):
        sd.read_mjcf(pendulum())


def test_geoms_are_drawn_where_mujoco_has_them() -> None:
    """Turned solids, and a mesh, which MuJoCo moves to its principal axes; hidden groups and clear geoms are left out."""
    text = """<mujoco><asset><mesh name="wedge" vertex="0 0 0  1 0 0  0 2 0  0 0 3"/></asset><worldbody>
      <body name="b" pos="1 2 3"><joint name="j"/>
      <geom type="box" size="0.1 0.2 0.3" pos="1 0 0" euler="0 0 90" rgba="1 0.5 0 1"/>
      <geom type="capsule" size="0.1 0.5" pos="0 1 0"/><geom type="cylinder" size="0.2 0.4" pos="0 0 1" euler="90 0 0"/>
      <geom type="ellipsoid" size="0.1 0.2 0.3"/><geom type="mesh" mesh="wedge" pos="0 0 5"/>
      <geom size="9" group="3"/><geom size="9" rgba="1 1 1 0"/></body></worldbody></mujoco>"""
    shapes = sd.read_mjcf(text, visuals=True).check().shapes
    assert len(shapes) == 5 and shapes[0].color == [1.0, 0.5, 0.0]
    ends = [(np.min(s.about["vertices"], axis=0), np.max(s.about["vertices"], axis=0)) for s in shapes]
    expected = [((0.8, -0.1, -0.3), (1.2, 0.1, 0.3)), ((-0.1, 0.9, -0.6), (0.1, 1.1, 0.6)), ((-0.2, -0.4, 0.8), (0.2, 0.4, 1.2)),
                ((-0.1, -0.2, -0.3), (0.1, 0.2, 0.3)), ((0, 0, 5), (1, 2, 8))]
    for (low, high), wanted in zip(ends, expected, strict=True):
        np.testing.assert_allclose([low, high], wanted, atol=1e-6)
