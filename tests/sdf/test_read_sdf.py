"""sd.read_sdf: against the same mechanisms from URDF and by hand, and the messages about faulty files."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import ArgumentError, ModelError, ModelWarning
from tests.urdf.texts import collada

pytest.importorskip("defusedxml", reason="defusedxml is not installed; run: pip install 'symdyn[robots]'")
INERTIAL = ("<inertial><pose>0.1 -0.2 0.3 0.3 -0.4 "
            "0.5</pose><mass>2.5</mass><inertia><ixx>0.05</ixx><ixy>0.002</ixy><ixz>-0.003</ixz>"
            "<iyy>0.06</iyy><iyz>0.004</iyz><izz>0.07</izz></inertia></inertial>")


def saved(folder: Path, text: str) -> Path:
    path = folder / "robot.sdf"
    path.write_text(text, encoding="utf-8")
    return path


def model(*lines: str, version: str = "1.9", attributes: str = "") -> str:
    """One element a line: the first is in line 2."""
    return "\n".join([f'<sdf version="{version}"><model name="m"{attributes}>', *lines, "</model></sdf>"])


def link(name: str, more: str = INERTIAL) -> str:
    return f'<link name="{name}">{more}</link>'


def joint(name: str, kind: str, parent: str, child: str, more: str = "") -> str:
    return f'<joint name="{name}" type="{kind}"><parent>{parent}</parent><child>{child}</child>{more}</joint>'


def axis(xyz: str, more: str = "", attributes: str = "") -> str:
    return f"<axis><xyz{attributes}>{xyz}</xyz>{more}</axis>"


def accelerations(system: sd.System, x: np.ndarray) -> np.ndarray:
    return np.asarray(system.compile("numpy").rhs(0.0, x))


# -- against other descriptions


def from_urdf(path: Path) -> str:
    """The same robot in SDFormat: a joint sits in its parent as in the URDF, a link in its joint."""
    robot, lines = ElementTree.parse(path).getroot(), []
    carried = {j.find("child").attrib["link"]: j.attrib["name"] for j in robot.findall("joint")}

    def pose(element: ElementTree.Element, relative: str = "") -> str:
        origin = element.find("origin").attrib
        return f"<pose{relative}>{origin['xyz']} {origin['rpy']}</pose>"

    for one in robot.findall("link"):
        inertial = one.find("inertial")
        entries = "".join(f"<{k}>{v}</{k}>" for k, v in inertial.find("inertia").attrib.items()) if inertial is not None else ""
        mass = 0 if inertial is None else inertial.find("mass").attrib["value"]
        at = "" if inertial is None else pose(inertial)
        zero = "<ixx>0</ixx><iyy>0</iyy><izz>0</izz>"
        carrier = carried.get(one.attrib["name"])
        place = "" if carrier is None else f'<pose relative_to="{carrier}"/>'
        weight = f"<mass>{mass}</mass><inertia>{entries or zero}</inertia>"
        lines.append(f'<link name="{one.attrib["name"]}">{place}<inertial>{at}{weight}</inertial></link>')
    for one in robot.findall("joint"):
        ends = [one.find(end).attrib["link"] for end in ("parent", "child")]
        relative = f' relative_to="{ends[0]}"'
        lines.append(joint(one.attrib["name"], one.attrib["type"], *ends, pose(one, relative) +
                           axis(one.find("axis").attrib["xyz"])))
    inner = model(*lines)[19:].removesuffix("</sdf>")
    return f'<sdf version="1.9"><world name="w"><gravity>0 0 -9.81</gravity>{inner}</world></sdf>'


@pytest.mark.parametrize("n", [3, 6])
def test_a_chain_moves_as_that_of_the_urdf(tmp_path: Path, n: int) -> None:
    path = sd.systems.get("spatial_chain", n=n).to_urdf(tmp_path / "chain.urdf")
    ours, theirs = sd.read_sdf(saved(tmp_path, from_urdf(path)), root="fixed"), sd.read_urdf(path)
    assert [j.name for j in ours.check().joints][1:] == [j.name for j in theirs.check().joints][1:]
    x = np.random.default_rng(0).uniform(-1, 1, 2 * n)
    np.testing.assert_allclose(accelerations(ours, x), accelerations(theirs, x), rtol=1e-12)


def test_poses_by_hand(tmp_path: Path) -> None:
    """A link turned by 90 degrees about z at (1, 0, 0), a joint 0.5 along its x, the model's (1, 0.5, 0), axis along the model's
    x."""
    text = model('<frame name="f" attached_to="a"><pose degrees="true">0.5 0 0 0 0 -90</pose></frame>',
                 link("a", '<pose>1 0 0 0 0 1.5707963267948966</pose>'), link("b", '<pose relative_to="f">0 0 2 0 0 0</pose>'),
                 joint("hinge", "revolute", "f", "b", '<pose relative_to="f"/>' + axis("1 0 0",
                                                                                       attributes=' expressed_in="__model__"')),
                 attributes=' canonical_link="a"')
    system = sd.read_sdf(saved(tmp_path, text), root="fixed")
    placed = {j.name: j for j in system.check().joints}
    hinge = placed["hinge"]
    np.testing.assert_allclose(np.array(hinge.parent_point, dtype=float).ravel(), [0.5, 0, 0], atol=1e-15)
    np.testing.assert_allclose(np.array(hinge.child_point, dtype=float).ravel(), [0, 0, -2], atol=1e-15)
    np.testing.assert_allclose(np.array(hinge.axis, dtype=float).ravel(), [1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(np.array(hinge.parent_rotation, dtype=float), [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], atol=1e-15)
    # without <inertial> 1 kg, 1 kg m^2: about the hinge 1 + 1 * 2^2; 9.8 m/s^2 upside down
    found = accelerations(system, np.array([0.3, 0.0]))
    np.testing.assert_allclose(found[1], 9.8 * 2 * np.sin(0.3) / 5, rtol=1e-14)


def test_nested_models_and_quaternions(tmp_path: Path) -> None:
    nested = ('<model name="in"><pose rotation_format="quat_xyzw">0 1 0 0 0 0.6 0.8</pose><link name="l"><pose>1 0 0 0 0 '
              '0</pose></link>'
              '<link name="k"/>' + joint("w", "fixed", "l", "k") + "</model>")
    text = model(nested, link("base"), joint("j", "prismatic", "base", "in::l", axis("0 0 1")))
    placed = {j.name: j for j in sd.read_sdf(saved(tmp_path, text), root="fixed").check().joints}
    assert list(placed) == ["base root", "j", "in::w"]
    np.testing.assert_allclose(np.array(placed["j"].parent_point, dtype=float).ravel(), [0.28, 1.96, 0], atol=1e-15)
    np.testing.assert_allclose(np.array(placed["in::w"].parent_point, dtype=float).ravel(), [-1, 0, 0], atol=1e-15)


def test_axes_of_old_versions_are_in_the_models_frame(tmp_path: Path) -> None:
    turned = link("b", "<pose>0 0 0 1.5707963267948966 0 0</pose>")
    asked = "<use_parent_model_frame>1</use_parent_model_frame>"
    for version, more, wanted in (("1.4", "", [0, 0, -1]), ("1.6", asked, [0, 0, -1]), ("1.6", "", [0, 1, 0])):
        text = model(turned, joint("j", "revolute", "world", "b", axis("0 1 0", more)), version=version)
        made = sd.read_sdf(saved(tmp_path, text)).check().joints[0]
        np.testing.assert_allclose(np.array(made.axis, dtype=float).ravel(), wanted, atol=1e-15)


def test_loops_forces_and_free_models(tmp_path: Path) -> None:
    text = model(link("a"), link("b"), link("c"), joint("u", "universal", "a", "b", axis("1 0 0",
                                                                                         "<dynamics><damping>0.2</damping>"
                 "</dynamics>") + "<axis2><xyz>0 1 0</xyz></axis2>"), joint("s", "ball", "b", "c"),
                 joint("back", "ball", "a", "c", "<pose>0.5 0 0 0 0 0</pose>"), '<pose>0 0 2 0 0 0</pose>')
    system = sd.read_sdf(saved(tmp_path, text), symbolic=["d_*"])
    checked = system.check()
    assert [str(q) for q in checked.coordinates] == ["x_a", "y_a", "z_a", "e0_a", "e1_a", "e2_a", "e3_a", "q_u_1", "q_u_2",
                                                     "e0_s",
                                                     "e1_s", "e2_s", "e3_s"]
    assert [j.name for j in system.loops] == ["back"] and {str(s): v for s, v in system.defaults.items()} == {"d_u": 0.2}
    start = {str(s): v for s, v in checked.initial.items()}
    assert (start["z_a"], start["e0_a"], start["e1_a"]) == (2.0, 1.0, 0.0)


def test_mimic_spring_weight_static(tmp_path: Path) -> None:
    spring = "<dynamics><spring_stiffness>3</spring_stiffness><spring_reference>0.1</spring_reference></dynamics>"
    mimic = '<mimic joint="q"><multiplier>2</multiplier><offset>0.3</offset><reference>0.1</reference></mimic>'
    text = model(link("base"), link("a"), link("b", INERTIAL + "<gravity>false</gravity>"),
                 joint("q", "prismatic", "base", "a", axis("0 0 1", spring)), joint("m", "revolute", "a", "b", axis("0 1 0",
                                                                                                                    mimic)),
                 "<static>true</static>")
    system = sd.read_sdf(saved(tmp_path, text))
    q, = sd.coordinates("q_q,")
    joints = {j.name: j for j in system.check().joints}
    assert joints["m"].coordinates[0] == 2 * (q - 0.1) + 0.3 and joints["base root"].kind == "fixed"
    assert system.check().loads[0].label == "weight of b" and system.check().loads[1].values[0] == -3 * (q - 0.1)


# -- messages

BASE = link("a")


@pytest.mark.parametrize(("text", "fault"), [
    ("<robot/>", "1: the file holds a <robot>; an SDF holds an <sdf>"),
    ('<sdf version="1.9"/>', "1: the file holds 0 models; read one"),
    (model(), "1: the model has no links"),
    (model(BASE, BASE), "3: link 'a' has the name of link 'a' (line 2)"),
    (model(BASE, "<include><uri>model://x</uri></include>"), "3: <include> brings in another file, which is not read"),
    (model(link("a", '<pose frame="x">0 0 0 0 0 0</pose>')), "2: link 'a': <pose> has the attribute frame='x'"),
    (model(link("a", "<pose>0 0 0</pose>")), "2: link 'a': text of <pose> is '0 0 0'; give 6 numbers"),
    (model(link("a", "<pose>0 0 0 0 0 ${x}</pose>")), "2: link 'a': text of <pose> is '0 0 0 0 0 ${x}'; give 6 numbers"),
    (model(link("a", '<pose rotation_format="angles">0 0 0 0 0 0</pose>')),
     "2: link 'a': <pose> has the rotation_format 'angles'"),
    (model(link("a", '<pose rotation_format="quat_xyzw">0 0 0 0 0 0 2</pose>')),
     "2: link 'a': the quaternion of <pose> has the length 2"),
    (model(link("a", '<pose relative_to="none"/>')), "2: link 'a' refers to the frame 'none', which there is not"),
    (model(link("a", '<pose relative_to="b"/>'), link("b", '<pose relative_to="a"/>')),
     "2: the poses of 'a', 'b' are relative to each"),
    (model(link("a", "<kinematic>true</kinematic>")), "2: link 'a' is kinematic"),
    (model(link("a", '<inertial auto="true"/>')), "2: link 'a': its inertia is to follow from its collisions"),
    (model(link("a", "<inertial><fluid_added_mass/></inertial>")), "2: link 'a' has an added mass of a fluid"),
    (model(link("a", "<inertial><mass>-1</mass></inertial>")), "2: link 'a' has the mass -1.0 kg"),
    (model(link("a", '<inertial><pose relative_to="b"/></inertial>')), "2: link 'a': the pose of its inertia is relative to 'b'"),
    (model(link("a", "<inertial><inertia><ixy>5</ixy></inertia></inertial>")),
     "2: link 'a': its inertia has the principal moment -4"),
    (model(BASE, joint("j", "gearbox", "world", "a")), "3: joint 'j' has the type 'gearbox'; read are fixed, revolute"),
    (model(BASE, '<joint name="j" type="ball"><child>a</child></joint>'),
     "3: joint 'j' has no <parent>; write <parent>...</parent>"),
    (model(BASE, joint("j", "ball", "b", "a")), "3: joint 'j' refers to 'b', which is no link or frame"),
    (model(BASE, joint("j", "ball", "a", "world")), "3: joint 'j' has the child world; make the world its parent"),
    (model(BASE, joint("j", "revolute", "world", "a")), "3: joint 'j' is revolute and has no <axis>"),
    (model(BASE, joint("j", "revolute", "world", "a", axis("0 0 0"))), "3: joint 'j': its axis is zero"),
    (model(BASE, joint("j", "universal", "world", "a", axis("0 0 1") + "<axis2><xyz>0 0 1</xyz></axis2>")),
     "3: joint 'j' has two parallel axes"),
    (model(BASE, link("b"), joint("j", "ball", "a", "b"), joint("k", "ball", "b", "a")), "4: joints 'j', 'k' hang on each other"),
    (model(BASE, joint("j", "revolute", "world", "a", axis("0 0 1", '<mimic joint="x"/>'))),
     "3: joint 'j' mimics 'x', which has no"),
    (model(BASE, joint("j", "revolute", "world", "a", axis("0 0 1", '<mimic joint="x" axis="axis2"/>'))),
     "3: joint 'j' mimics a second"),
    (model('<frame name="f" attached_to="g"/>', '<frame name="g" attached_to="f"/>', BASE, joint("j", "ball", "f", "a")),
     "5: joint 'j' is attached in a circle"),
    (model(BASE, '<model name="in" placement_frame="l"><link name="l"/></model>'),
     "3: model 'in' is nested and has a placement_frame"),
    ("<!DOCTYPE x><sdf/>", "1: the file declares a document type, which is rejected"),
])
def test_faults_and_their_lines(tmp_path: Path, text: str, fault: str) -> None:
    path = saved(tmp_path, text)
    with pytest.raises(ModelError) as raised:
        sd.read_sdf(path)
    assert any(f.startswith(f"{path}:{fault}") for f in raised.value.faults), raised.value.faults


def test_what_is_not_taken_is_reported(tmp_path: Path) -> None:
    text = model(link("a", "<collision name='c'/>"), "<plugin name='p'/>", joint("j", "revolute", "world", "a", axis(
        "0 0 1", "<limit><lower>-1</lower></limit><dynamics><friction>0.1</friction></dynamics>")))
    with pytest.warns(ModelWarning) as warned:
        sd.read_sdf(saved(tmp_path, text))
    for part in ("contacts of 'a' (line 2)", "plugins of 'p' (line 3)", "friction of 'j' (line 4)", "limits of 'j' (line 4)"):
        assert part in str(warned[0].message)
    sd.read_sdf(tmp_path / "robot.sdf", leave_out="*")


# -- pictures


def drawn(folder: Path, visual: str, **given: object) -> sd.System:
    text = model(BASE, link("seen", f"<visual name='v'>{visual}</visual>"), joint("j", "revolute", "a", "seen", axis("0 0 1")))
    path = saved(folder, text)
    return sd.read_sdf(path, visuals=True, **given)


def geometry(shape: str) -> str:
    return f"<geometry>{shape}</geometry>"


@pytest.mark.parametrize(("shape", "half"), [
    ("<box><size>1 2 3</size></box>", (0.5, 1, 1.5)), ("<sphere><radius>2</radius></sphere>", (2, 2, 2)),
    ("<cylinder><radius>1</radius><length>3</length></cylinder>", (1, 1, 1.5)), ("<cone/>", (0.5, 0.5, 0.5)),
    ("<capsule><radius>0.5</radius><length>3</length></capsule>", (0.5, 0.5, 2)),
    ("<ellipsoid><radii>1 2 3</radii></ellipsoid>", (1, 2, 3))])
def test_solids_are_drawn_where_they_are(tmp_path: Path, shape: str, half: tuple[float, ...]) -> None:
    """At (0, 0, 1) and turned by 90 degrees about x, so that z becomes -y: y and z change places."""
    shown, = drawn(tmp_path, f'<pose degrees="1">0 0 1 90 0 0</pose>{geometry(shape)}').shapes
    vertices = np.array(shown.about["vertices"])
    x, y, z = half
    np.testing.assert_allclose([vertices.min(axis=0), vertices.max(axis=0)], [(-x, -z, 1 - y), (x, z, 1 + y)], atol=1e-12)
    assert shown.record["body"] == "seen" and shown.color is None


def test_places_and_colours_of_visuals(tmp_path: Path) -> None:
    """A visual may be relative to a joint of its own model; a nested link's names are within its model."""
    ball = geometry("<sphere><radius>0.1</radius></sphere>")
    inner = ('<model name="in"><frame name="f"><pose>0 0 5 0 0 0</pose></frame><link name="l"><pose>0 0 1 0 0 0</pose>'
             '<visual name="v">'
             f'<pose relative_to="f">1 0 0 0 0 0</pose>{ball}<material><diffuse>1.5 0.5 0 1</diffuse></material></visual>'
             f'<visual name="w">{ball}<material><ambient>0 0 1</ambient></material></visual>'
             f'<visual name="gone">{ball}<transparency>1</transparency></visual>'
             f'<visual name="floor">{geometry("<plane/>")}</visual></link></model>')
    first, second = sd.read_sdf(saved(tmp_path, model(inner)), visuals=True).shapes
    assert (first.color, second.color) == ([1.0, 0.5, 0.0], [0.0, 0.0, 1.0])
    np.testing.assert_allclose(np.mean(first.about["vertices"], axis=0), [1, 0, 4], atol=1e-4)
    assert sd.read_sdf(tmp_path / "robot.sdf").shapes == []


def test_meshes_of_a_model(tmp_path: Path) -> None:
    pytest.importorskip("trimesh", reason="trimesh is not installed; run: pip install 'symdyn[meshes]'")
    pytest.importorskip("collada", reason="pycollada is not installed; run: pip install 'symdyn[meshes]'")
    folder = tmp_path / "arm" / "meshes"
    folder.mkdir(parents=True)
    (folder / "two.dae").write_text(collada())
    mesh = geometry("<mesh><uri>model://arm/meshes/two.dae</uri><scale>2 1 1</scale></mesh>")
    shapes = drawn(tmp_path / "arm", mesh).shapes
    assert sorted(len(s.about["faces"]) for s in shapes) == [1, 1, 2]
    assert sorted(tuple(np.round(s.color, 2)) for s in shapes if s.color) == [(0, 0, 0.5), (1, 0, 0)]
    assert max(x for s in shapes for x, _, _ in s.about["vertices"]) == 0.002
    green, = {tuple(s.color) for s in drawn(tmp_path / "arm", f"{mesh}<material><diffuse>0 1 0 1</diffuse></material>").shapes}
    assert green == (0, 1, 0)


@pytest.mark.parametrize(("visual", "fault"), [
    ("", "<visual> has no <geometry>; leave it out"),
    (geometry("<heightmap/>"), "<visual> has a <heightmap>; read are box, sphere, ellipsoid, cylinder, capsule, cone and mesh"),
    (geometry("<mesh/>"), "<visual> has no <uri>"),
    (geometry("<mesh><uri>../x.stl</uri></mesh>"), "<visual>: the mesh '../x.stl' is outside of the folder"),
    (geometry("<mesh><uri>x.stl</uri></mesh>"), "<visual>: there is no mesh 'x.stl'"),
    (geometry("<mesh><uri>x.stl</uri><submesh><name>y</name></submesh></mesh>"), "<visual> shows a part of a mesh (<submesh>)"),
    (geometry("<box><size>1 2</size></box>"), "<visual>: text of <size> is '1 2'; give 3 numbers"),
    (f"<pose relative_to='none'/>{geometry('<cone/>')}", "<visual> refers to the frame 'none', which there is not"),
    (f"{geometry('<cone/>')}<material><diffuse>red</diffuse></material>", "<visual>: text of <diffuse> is 'red'; give 4 numbers"),
])
def test_faults_of_visuals(tmp_path: Path, visual: str, fault: str) -> None:
    with pytest.raises(ModelError) as raised:
        drawn(tmp_path, visual)
    assert raised.value.faults[0].startswith(f"{tmp_path / 'robot.sdf'}:3: link 'seen': {fault}"), raised.value.faults
    sd.read_sdf(tmp_path / "robot.sdf")  # without pictures nothing is looked at


def test_arguments(tmp_path: Path) -> None:
    path = saved(tmp_path, model(BASE))
    for given, fault in (({"fixed": "none"}, "fixed has 'none', which fits no joint"), ({"symbolic": "m_b"},
                                                                                        "symbolic has 'm_b'"),
                         ({"leave_out": "none"}, "leave_out has 'none'; there are contacts, limits, friction, plugins")):
        with pytest.raises(ModelError, match=fault):
            sd.read_sdf(path, **given)
    for given, fault in (((7,), "the path is 7; pass that of an SDF file"), ((path, (), "none"), "root is 'none'; pass 'file'")):
        with pytest.raises(ArgumentError, match=fault):
            sd.read_sdf(*given)
    with pytest.raises(ArgumentError, match="visuals is 'no'; pass True or False"):
        sd.read_sdf(path, visuals="no")
    with pytest.raises(ArgumentError, match="the path is 7; pass that of the folder of an SDF file"):
        sd.read_sdf(path, visuals=True, folder=7)
