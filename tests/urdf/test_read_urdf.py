"""sd.read_urdf: what becomes of a file's elements, and what is reported of faulty files."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, MissingExtra, ModelError
from tests.urdf.texts import ALL, BALL, BOX, joint, link, pendulum, robot, saved

pytest.importorskip("defusedxml", reason="defusedxml is not installed; run: pip install 'symdyn[robots]'")


def read(folder: Path, text: str, **options: object) -> sd.System:
    return sd.read_urdf(saved(folder, text), **options)


def faults(folder: Path, text: str, **options: object) -> list[str]:
    """Faults reported of a file, each as LINE: FAULT."""
    with pytest.raises(ModelError) as raised:
        read(folder, text, **options)
    path = f"{folder / 'robot.urdf'}:"
    assert all(f.startswith(path) for f in raised.value.faults)
    return [f.removeprefix(path) for f in raised.value.faults]


# -- what becomes of a file


def test_the_elements(tmp_path: Path) -> None:
    system = read(tmp_path, ALL)
    model = system.check()
    assert system.name == "all_of_them"
    assert [b.name for b in model.bodies] == ["base", "table", "arm", "slide", "finger", "thumb", "tip", "plate", "flyer"]
    assert [(j.name, j.kind) for j in model.joints] == [
        ("root", "fixed"), ("turn", "revolute"), ("lift", "revolute"), ("push", "prismatic"), ("grip", "revolute"),
        ("close", "prismatic"), ("end", "fixed"), ("float", "planar"), ("fly", "free")]
    assert [str(q) for q in model.coordinates] == [
        "q_turn", "q_lift", "q_push", "x_float", "y_float", "theta_float",
        "x_fly", "y_fly", "z_fly", "e0_fly", "e1_fly", "e2_fly", "e3_fly"]
    assert list(model.gravity) == [0, 0, sp.Float(-9.81)] and not model.parameters
    joints = {j.name: j for j in model.joints}
    q_lift, q_push = sd.coordinates("q_lift q_push")
    assert joints["grip"].coordinates[0] == -0.5 * q_lift + 0.3 and joints["close"].coordinates[0].doit() == q_push
    assert list(joints["lift"].axis) == [sp.Rational(1, 3), sp.Rational(2, 3), -sp.Rational(2, 3)]
    # A right angle to the last digit is one; 1.5708 and 3.14159265 are none.
    assert joints["turn"].parent_rotation == sp.Matrix([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert joints["push"].parent_rotation[1, 0] == np.sin(3.14159265) != 0
    tip = model.bodies[6]
    assert tip.mass == 0 and tip.inertia.is_zero_matrix


def test_inertia_is_turned_into_the_axes_of_the_link(tmp_path: Path) -> None:
    body = read(tmp_path, ALL).bodies[1]
    I = np.array([[0.05, 0.002, -0.003], [0.002, 0.06, 0.004], [-0.003, 0.004, 0.07]])
    R = np.array(sd.rotation.about("Z", 0.5)) @ np.array(sd.rotation.about("Y", -0.4)) @ np.array(sd.rotation.about("X", 0.3))
    np.testing.assert_allclose(np.array(body.inertia, dtype=float), R @ I @ R.T, atol=1e-16)
    assert body.mass == 2.5 and list(body.com) == [sp.Float(0.1), sp.Float(-0.2), sp.Float(0.3)]


def test_a_robot_that_flies(tmp_path: Path) -> None:
    model = read(tmp_path, pendulum(), root="floating").check()
    assert [str(q) for q in model.coordinates[:7]] == [f"{a}_root" for a in ("x", "y", "z", "e0", "e1", "e2", "e3")]
    assert len(model.speeds) == 7


def test_parameters_by_name(tmp_path: Path) -> None:
    system = read(tmp_path, ALL, symbolic=["m_t*", "slide", "p_?_lift", "g"])
    names = {p.name for p in system.check().parameters}
    assert names == {"g", "m_table", "m_thumb", "m_tip", "p_x_lift", "p_y_lift", "p_z_lift", "m_slide", "c_x_slide", "c_y_slide",
                     "c_z_slide", *(f"I_{e}_slide" for e in ("xx", "xy", "xz", "yy", "yz", "zz"))}
    assert {p.name: v for p, v in system.defaults.items()}["m_table"] == 2.5
    assert system.gravity[2] == -sp.Symbol("g") and system.defaults[sp.Symbol("g")] == 9.81
    assert not read(tmp_path, pendulum(), symbolic="m_bar").bodies[1].mass.is_number
    with pytest.raises(ModelError, match=r"symbolic has 'm_tabel', which fits no .*did you mean 'm_table'"):
        read(tmp_path, ALL, symbolic="m_tabel")


def test_parameters_change_nothing_but_names(tmp_path: Path) -> None:
    plain, symbolic = read(tmp_path, ALL), read(tmp_path, ALL, symbolic="*")
    modules = [s.recursive().compile(backend="numpy") for s in (plain, symbolic)]
    n_q, n_u = len(plain.check().coordinates), len(plain.check().speeds)
    x = np.random.default_rng(1).uniform(-1, 1, n_q + n_u)
    x[n_q - 4:n_q] /= np.linalg.norm(x[n_q - 4:n_q])
    rates = [module.rhs(0, x) for module in modules]
    np.testing.assert_allclose(rates[0], rates[1], rtol=1e-9, atol=1e-9 * np.abs(rates[0]).max())


def test_joints_that_are_held(tmp_path: Path) -> None:
    held = {j.name: j for j in read(tmp_path, ALL, fixed=["lift", "pus?"]).joints}
    assert [held[name].kind for name in ("lift", "push", "grip", "close")] == ["fixed"] * 4
    # grip stays at the offset of its <mimic>: 0.3 rad about x, after 0.5 rad about y
    R = np.array(sd.rotation.about("Y", 0.5)) @ np.array(sd.rotation.about("X", 0.3))
    np.testing.assert_allclose(np.array(held["grip"].parent_rotation, dtype=float), R, atol=1e-15)
    shifted = ALL.replace('<mimic joint="push"/>', '<mimic joint="push" offset="0.2"/>')
    close = {j.name: j for j in read(tmp_path, shifted, fixed="push").joints}["close"]
    assert list(close.parent_point) == [0, 0, sp.Float(0.2)]
    # A joint that is held follows no other; one that follows with the factor zero stays at its offset.
    grip = {j.name: j for j in read(tmp_path, ALL, fixed="grip").joints}["grip"]
    np.testing.assert_allclose(np.array(grip.parent_rotation, dtype=float), np.array(sd.rotation.about("Y", 0.5)), atol=1e-15)
    still = ALL.replace('multiplier="-0.5"', 'multiplier="0"')
    grip = {j.name: j for j in read(tmp_path, still).joints}["grip"]
    np.testing.assert_allclose(np.array(grip.parent_rotation, dtype=float), R, atol=1e-15)
    with pytest.raises(ModelError, match=r"fixed has 'push1', which fits no joint of the file; did you mean 'push'"):
        read(tmp_path, ALL, fixed="push1")


def test_damping_where_it_is_asked_for(tmp_path: Path) -> None:
    text = pendulum().replace("</joint>", '<dynamics damping="0.7" friction="3"/></joint>')
    assert not read(tmp_path, text).loads
    q = sd.coordinates("q_hinge")
    assert [load.values for load in read(tmp_path, text, damping=True).loads] == [(-0.7 * q.dot,)]
    assert read(tmp_path, text, damping=True, symbolic="d_*").defaults == {sp.Symbol("d_hinge"): 0.7}


@pytest.mark.parametrize("axis", [(0, 0, -1), (0.6, 0, 0.8), (1, 0, 0)])
def test_the_plane_of_a_planar_joint(tmp_path: Path, axis: tuple[float, ...]) -> None:
    """Its axis is the normal: the child stays in the plane, and at zero its frame is the joint's."""
    text = robot(link("base", ""), link("plate"),
                 joint("p", "planar", "base", "plate", f'<origin xyz="1 2 3"/><axis xyz="{" ".join(map(str, axis))}"/>'))
    system = read(tmp_path, text)
    system.add_output("place", sd.position("plate"))
    system.add_output("tip", sd.position("plate", axis))
    outputs = system.recursive().compile(backend="numpy").function("outputs")
    at = np.array(outputs([0.3, -0.4, 0.9], [0, 0, 0])).reshape(2, 3)
    shift = at[0] - [1, 2, 3]
    np.testing.assert_allclose([shift @ axis, np.linalg.norm(shift)], [0, 0.5], atol=1e-14)
    np.testing.assert_allclose(at[1] - at[0], axis, atol=1e-14)
    np.testing.assert_allclose(np.array(outputs([0, 0, 0], [0, 0, 0])).ravel()[:3], [1, 2, 3], atol=1e-15)


def test_names_that_symbols_cannot_have(tmp_path: Path) -> None:
    text = robot(link("ground"), link("a b|c"), link("a b?c"), joint("a-b", "continuous", "ground", "a b|c"),
                 joint("a b", "continuous", "a b|c", "a b?c"), joint("a-b_dot", "prismatic", "a b?c", "end"), link("end"),
                 name="1st-robot")
    model = read(tmp_path, text).check()
    assert model.name == "robot_1st_robot"
    assert [b.name for b in model.bodies] == ["ground 2", "a b_c", "a b_c 2", "end"]
    assert [str(q) for q in model.coordinates] == ["q_a_b", "q_a_b_2", "q_a_b_dot_2"]


def test_what_is_left_alone(tmp_path: Path) -> None:
    """Meshes that are not there, transmissions, simulators' elements, comments, an unknown namespace that is declared."""
    visual = '<visual><geometry><mesh filename="package://nowhere/none.dae" scale="a b c"/></geometry></visual>'
    text = pendulum("<!-- ${xacro} -->", '<transmission name="t"><joint name="hinge"/><type>x</type></transmission>',
                    f'<gazebo reference="bar"><joint name="x" type="ball"/></gazebo><link name="tool">{visual}</link>',
                    joint("weld", "fixed", "bar", "tool"), '<s:imu xmlns:s="http://sensors" name="i"/>', '<material name="m"/>')
    text = text.replace("</joint>", '<limit lower="1"/><calibration rising="x"/></joint>', 1)
    assert len(read(tmp_path, '<?xml version="1.0"?>\n' + text).check().joints) == 3


def test_numbers_of_no_size_are_no_inertia(tmp_path: Path) -> None:
    """Rounding of zeros leaves what is no inertia; it is none."""
    dust = '<inertial><mass value="0"/><inertia ixx="0" ixy="1e-20" ixz="0" iyy="0" iyz="0" izz="0"/></inertial>'
    text = robot(link("base", ""), link("bar"), link("dust", dust), joint("hinge", "continuous", "base", "bar"),
                 joint("weld", "fixed", "bar", "dust"))
    assert read(tmp_path, text).check().bodies[2].inertia.is_zero_matrix


# -- faults of the tree


def test_every_fault_of_the_file_in_one_message(tmp_path: Path) -> None:
    found = faults(tmp_path, robot(link("base"), link("bar", '<inertial><mass value="x"/></inertial>'), link("bar"),
                                   joint("hinge", "ball", "base", "bar"), joint("", "fixed", "base", "bar"),
                                   joint("weld", "fixed", "bar", "bra")))
    assert found == [
        "3: link 'bar': <inertial> has no <inertia>; add it, or leave out <inertial> for a link without mass",
        "3: link 'bar': value of <mass> is 'x'; give a number, finite and written out",
        "4: the link 'bar' is there already, in line 3; give each a name of its own",
        "5: joint 'hinge' has the type 'ball'; there are fixed, revolute, continuous, prismatic, planar, floating",
        "6: a joint has no name; write <joint name=\"...\">",
        "7: joint 'weld' has the child 'bra', which is no link of the file; did you mean 'bar'?"]


@pytest.mark.parametrize(("lines", "told"), [
    ([link("a"), link("b"), link("c"), joint("j", "fixed", "a", "b")],
     ["4: 2 links are the child of no joint: 'a' (line 2), 'c' (line 4); join all but one to the rest"]),
    ([link("a"), link("b"), link("c"), joint("j", "revolute", "a", "b"), joint("k", "revolute", "b", "c"),
      joint("l", "revolute", "a", "c")],
     ["7: link 'c' is the child of joint 'l' and of joint 'k' (line 6), a loop; a URDF is a tree: leave one out, and add it "
      "with system.close_loop"]),
    ([link("a"), link("b"), joint("j", "revolute", "a", "b"), joint("k", "revolute", "b", "a")],
     ["4: joints 'j' (line 4), 'k' (line 5) hang on each other in a loop; a URDF is a tree that begins at one link"]),
    ([joint("j", "fixed", "a", "b")],
     ["1: the robot has no links; a URDF has at least one <link name=\"...\">",
      "2: joint 'j' has the parent 'a', which is no link of the file",
      "2: joint 'j' has the child 'b', which is no link of the file"]),
    ([link("a"), '<joint name="j" type="fixed"><parent/></joint>'],
     ["3: joint 'j': parent has no link; write <parent link=\"...\">", "3: joint 'j' has no child; write <child link=\"...\"/>"]),
    ([link("a"), link("b"), joint("j", "revolute", "a", "b"), joint("j", "revolute", "a", "b")],
     ["5: the joint 'j' is there already, in line 4; give each a name of its own"]),
    # consequences of a joint without a name are not reported, too
    ([link("a"), link("b"), link("c"), joint("j", "revolute", "a", "b"), joint("j", "revolute", "b", "c")],
     ["6: the joint 'j' is there already, in line 5; give each a name of its own"]),
    ([link("a"), link("b"), joint("", "fixed", "a", "b")], ["4: a joint has no name; write <joint name=\"...\">"]),
    ([link("a"), link("b"), joint("j", "fixed", "a", "a")],
     ["4: joint 'j' hangs a link on itself in a loop; a URDF is a tree that begins at one link"]),
])
def test_what_is_no_tree(tmp_path: Path, lines: list[str], told: list[str]) -> None:
    assert faults(tmp_path, robot(*lines)) == told


@pytest.mark.parametrize(("more", "told"), [
    ('<mimic joint="hing"/>', "6: joint 'arm' mimics 'hing', which is no joint of the file; did you mean 'hinge'?"),
    ('<mimic joint="arm"/>', "6: joint 'arm' mimics itself; leave out <mimic>"),
    ("<mimic/>", "6: joint 'arm': mimic has no joint; write <mimic joint=\"...\">"),
    ('<mimic joint="hinge" multiplier="two"/>',
     "6: joint 'arm': multiplier of <mimic> is 'two'; give a number, finite and written out"),
    ('<axis xyz="0 0 0"/>', "6: joint 'arm': its axis is zero; give a direction"),
    ('<axis xyz="0 1"/>', "6: joint 'arm': xyz of <axis> is '0 1'; give 3 numbers, finite and written out"),
    ('<origin rpy="nan 0 0"/>', "6: joint 'arm': rpy of <origin> is 'nan 0 0'; give 3 numbers, finite and written out"),
    ('<origin xyz="1_0 0 0"/>', "6: joint 'arm': xyz of <origin> is '1_0 0 0'; give 3 numbers, finite and written out"),
    ('<origin xyz="1e999 0 0"/>', "6: joint 'arm': xyz of <origin> is '1e999 0 0'; give 3 numbers of 1e+100 at most"),
    ('<origin xyz="0 -2e100 0"/>', "6: joint 'arm': xyz of <origin> is '0 -2e100 0'; give 3 numbers of 1e+100 at most"),
    ('<axis xyz="1 0 0"/>\n<axis xyz="0 1 0"/>', "7: joint 'arm' has another <axis> in line 6; leave one of them out"),
    ('<origin xyz="0 0 ${h/2}"/>', "6: joint 'arm': xyz of <origin> is '0 0 ${h/2}'; give 3 numbers, finite and written out; it "
                                   "looks like xacro, so run the file through xacro first"),
])
def test_faulty_joints(tmp_path: Path, more: str, told: str) -> None:
    assert faults(tmp_path, pendulum(link("hand"), joint("arm", "revolute", "bar", "hand", more))) == [told]


def test_multipliers_of_mimics_along_a_row_are_within_the_range_of_numbers(tmp_path: Path) -> None:
    names = "abcdefgh"
    for largest, offset in (("1e60", "0"), ("1e60", "1e80"), ("-1e100", "1")):
        lines = [link(name) for name in names] + [joint("j0", "revolute", "a", "b")]
        lines += [joint(f"j{k}", "revolute", names[k], names[k + 1],
                        f'<mimic joint="j{k - 1}" multiplier="{largest}" offset="{offset}"/>') for k in range(1, 7)]
        with pytest.raises(ModelError) as caught:
            sd.read_urdf(saved(tmp_path, robot(*lines)))
        assert any(":12: joint 'j2' mimics along 'j1' -> 'j0'; multiplier 1e+" in fault and
                   "are more than 1e+100; give smaller ones" in fault for fault in caught.value.faults), caught.value.faults


def test_mimics_of_what_has_several_coordinates(tmp_path: Path) -> None:
    lines = [link("a"), link("b"), joint("p", "planar", "base", "a"),
             joint("q", "revolute", "a", "b", '<mimic joint="p"/>')]
    assert faults(tmp_path, pendulum(*lines)) == [
        "8: joint 'q' mimics 'p', which is planar and has several coordinates; take a joint with one"]
    lines[2] = joint("p", "floating", "base", "a", '<mimic joint="hinge"/>')
    assert faults(tmp_path, pendulum(*lines))[0] == (
        "7: joint 'p' is floating and has a <mimic>, which takes one coordinate; leave it out")


# -- faults of masses


@pytest.mark.parametrize(("inertial", "kept"), [
    ("", "has no <inertial>"),
    ('<inertial><mass value="0"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial>',
     "has no inertia along it"),
    # a point mass on the axis
    ('<inertial><origin xyz="0 0.3 0"/><mass value="2"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial>',
     "has no inertia along it"),
])
def test_a_leaf_that_moves_without_inertia(tmp_path: Path, inertial: str, kept: str) -> None:
    text = pendulum(link("tip", inertial), joint("wrist", "continuous", "bar", "tip", '<axis xyz="0 1 0"/>'))
    assert faults(tmp_path, text) == [
        f"6: joint 'wrist' moves link 'tip' (line 5), which {kept}, and nothing else; give the link mass and inertia, or hold "
        "the joint: type=\"fixed\", or fixed=['wrist']"]
    assert len(read(tmp_path, text, fixed="wrist").recursive().symbols.speeds) == 1


def test_what_carries_something_needs_no_inertia_of_its_own(tmp_path: Path) -> None:
    cross = robot(link("base", ""), link("cross", ""), link("bar"), joint("a", "continuous", "base", "cross"),
                  joint("b", "continuous", "cross", "bar", '<axis xyz="0 1 0"/>'))
    assert len(read(tmp_path, cross).recursive().symbols.speeds) == 2
    follower = pendulum(link("tip", ""), joint("t", "prismatic", "bar", "tip", '<mimic joint="hinge"/>'))
    assert len(read(tmp_path, follower).recursive().symbols.speeds) == 1


def test_masses_that_no_body_has(tmp_path: Path) -> None:
    wrong = ['<inertial><mass value="-1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>',
             BALL.replace('ixy="0"', 'ixy="0.3"'), BALL.replace(' izz="0.1"', "")]
    links, joints = [link(f"l{k}", w) for k, w in enumerate(wrong)], [joint(f"j{k}", "fixed", "bar", f"l{k}") for k in range(3)]
    text = pendulum(*links, *joints)
    assert faults(tmp_path, text) == ["5: link 'l0' has the mass -1.0 kg; give zero or a positive mass",
                                      "7: link 'l2': <inertia> has no izz; give it a number"]
    assert faults(tmp_path, text.replace('"-1"', '"1"').replace(wrong[2], BALL)) == [
        "6: link 'l1': its inertia has the principal moments [-0.2, 0.1, 0.4] kg m^2, one is negative; give the inertia about "
        "the centre of mass"]
    assert faults(tmp_path, robot(link("base", "")), root="floating") == [
        "1: no link has mass or inertia, so that nothing can move freely; give one an <inertial>"]


# -- what is no such file, or none that may be read


BOMB = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10}">' for k in range(1, 10))


DOCTYPE = ("the file declares a document type, which is rejected: entities and other files come in by it, and a URDF needs none; "
           "leave out <!DOCTYPE ...>")


@pytest.mark.parametrize(("text", "told"), [
    (f'<?xml version="1.0"?>\n<!DOCTYPE robot [\n<!ENTITY e0 "ha">{BOMB}]>\n<robot name="&e9;"/>', f"2: {DOCTYPE}"),
    ('<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]>\n<robot name="&x;"/>', f"1: {DOCTYPE}"),
    ('<!DOCTYPE robot SYSTEM "http://nowhere.invalid/robot.dtd">\n<robot name="&x;"/>', f"1: {DOCTYPE}"),
    ('<robot>\n<link name="&x;"/></robot>', "2: the file is no XML there (undefined entity); pass a URDF file"),
    ("<robot>\n<link name='a'>\n</robot>", "3: the file is no XML there (mismatched tag); pass a URDF file"),
    ("", "1: the file is empty; pass a URDF file"), ("<robot>\n\0</robot>", "2: the file is no XML there (not well-formed "
                                                                          "(invalid token)); pass a URDF file"),
    ("<sdf version='1.6'/>", "1: the file holds a <sdf>; a URDF holds a <robot>"),
    ('<robot name="r">\n<xacro:include filename="arm.xacro"/>\n</robot>',
     "2: a tag has a prefix that the file does not declare, in '<xacro:include filename=\"arm.xacro\"/>'; if it belongs to "
     "xacro, run the file through xacro first"),
    ('<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n<link name="a"/>\n<xacro:macro name="leg"/>\n</robot>',
     "3: <xacro:macro> is left over from xacro; run the file through xacro first"),
    ('<?xml version="1.0" encoding="nonsense"?>\n<robot/>',
     "1: the text cannot be decoded (unknown encoding: nonsense); save it as UTF-8"),
])
def test_files_that_are_rejected(tmp_path: Path, text: str, told: str) -> None:
    assert faults(tmp_path, text) == [told]


def test_files_in_other_encodings(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    for encoding in ("latin-1", "utf-16"):
        path.write_bytes(f'<?xml version="1.0" encoding="{encoding}"?>\n{pendulum().replace("bar", "bår")}'.encode(encoding))
        assert "bår" in [body.name for body in sd.read_urdf(path).check().bodies]
    path.write_bytes(pendulum().replace("bar", "bår").encode("latin-1"))
    with pytest.raises(ModelError, match=r":\d+: the byte 0xe5 is not UTF-8, and the file declares no other encoding; save it"):
        sd.read_urdf(path)


def test_elements_that_contradict_each_other(tmp_path: Path) -> None:
    heavy = BALL.replace("<inertial>", '<inertial><mass value="7"/>')
    assert faults(tmp_path, pendulum(link("twice", f"{BALL}\n{BALL}"), link("heavy", heavy))) [:2] == [
        "6: link 'twice' has another <inertial> in line 5; leave one of them out",
        "7: link 'heavy': <inertial> has another <mass> in line 7; leave one of them out"]


def test_files_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"none\.urdf: the file cannot be read \(No such file or directory\)"):
        sd.read_urdf(tmp_path / "none.urdf")
    with pytest.raises(ModelError, match=r"the file cannot be read"):
        sd.read_urdf(tmp_path)


def test_options_that_are_none(tmp_path: Path) -> None:
    for path in (7, b"robot.urdf", "a\0b"):
        with pytest.raises(ArgumentError, match=r"the path is .*; pass that of a URDF file, as text or a Path"):
            sd.read_urdf(path)
    with pytest.raises(ArgumentError, match="root is 'free'; pass 'fixed' or 'floating'"):
        read(tmp_path, ALL, root="free")
    with pytest.raises(ArgumentError, match=r"symbolic is \[1\]; pass names as text"):
        read(tmp_path, ALL, symbolic=[1])
    with pytest.raises(ArgumentError, match=r"fixed is 3; pass names as text"):
        read(tmp_path, ALL, fixed=3)


def test_without_defusedxml(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "defusedxml.common", None)
    with pytest.raises(MissingExtra, match=r"pip install 'symdyn\[robots\]'"):
        read(tmp_path, pendulum())


def test_a_box_is_used(tmp_path: Path) -> None:
    """The inertial of a link on a fixed joint moves with the link before it."""
    text = pendulum(link("load", BOX), joint("weld", "fixed", "bar", "load", '<origin xyz="0 0 1"/>'))
    M = [np.array(read(tmp_path, t).recursive().compile(backend="numpy").mass_matrix([0.3])) for t in (pendulum(), text)]
    R = np.array(sd.rotation.about("Z", 0.5)) @ np.array(sd.rotation.about("Y", -0.4)) @ np.array(sd.rotation.about("X", 0.3))
    I = np.array([[0.05, 0.002, -0.003], [0.002, 0.06, 0.004], [-0.003, 0.004, 0.07]])
    assert (M[1] - M[0])[0, 0] == pytest.approx((R @ I @ R.T)[1, 1] + 2.5 * (0.1**2 + 1.3**2), rel=1e-14)
