"""URDF files as SolidWorks' and Onshape's exporters write them, and their meshes in pictures."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import ArgumentError, MissingExtra, ModelError
from symdyn.urdf.meshes import TRIANGLES, box, capsule, cylinder, decimated, ellipsoid
from tests.urdf.texts import collada, link, robot, saved

pytest.importorskip("defusedxml", reason="defusedxml is not installed; run: pip install 'symdyn[robots]'")

# As the SolidWorks exporter writes: a byte order mark, its comment, a prolog, materials without a name, limits of zero, a safety
# controller, lines that end in CR LF.
SOLIDWORKS = """\ufeff<?xml version="1.0" encoding="utf-8"?>
<!-- This URDF was automatically created by SolidWorks to URDF Exporter! Originally created by Stephen Brawner
     Commit Version: 1.6.0-4-g7f85cfe  Build Version: 1.6.7995.38578 -->
<robot
  name="my arm">
  <link
    name="base_link">
    <inertial>
      <origin
        xyz="-2.1E-17 0.0125 1.3878E-17"
        rpy="0 0 0" />
      <mass
        value="0.85" />
      <inertia
        ixx="0.0012"
        ixy="-1.2E-19"
        ixz="3.4E-20"
        iyy="0.002"
        iyz="0"
        izz="0.0013" />
    </inertial>
    <visual>
      <origin
        xyz="0 0 0"
        rpy="0 0 0" />
      <geometry>
        <mesh
          filename="package://my arm/meshes/base_link.STL" />
      </geometry>
      <material
        name="">
        <color
          rgba="0.79216 0.81961 0.93333 1" />
      </material>
    </visual>
  </link>
  <link
    name="Link1">
    <inertial>
      <origin xyz="0 0 0.1" rpy="0 0 0" />
      <mass value="0.4" />
      <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.0002" />
    </inertial>
  </link>
  <joint
    name="Joint1"
    type="continuous">
    <origin
      xyz="0 0.025 0"
      rpy="1.5708 0 0" />
    <parent
      link="base_link" />
    <child
      link="Link1" />
    <axis
      xyz="0 0 1" />
    <limit
      lower="0"
      upper="0"
      effort="0"
      velocity="0" />
    <safety_controller
      k_velocity="0" />
  </joint>
</robot>""".replace("\n", "\r\n")

# As onshape-to-robot writes: dummy links without mass, frames as fixed links, a floating base, a revolute joint without limits.
ONSHAPE = """<?xml version="1.0" ?>
<!-- Generated using onshape-to-robot -->
<!-- Onshape https://cad.example/documents/1 -->
<robot name="leg" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <link name="world_dummy"><inertial><origin xyz="0 0 0" rpy="0 -0 0"/><mass value="0"/>
   <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
  <joint name="base_free" type="floating"><origin xyz="0 0 0.3" rpy="0 0 0"/>
   <parent link="world_dummy"/><child link="body"/></joint>
  <link name="body"><inertial><origin xyz="0.01 0 0" rpy="0 0 0"/><mass value="1.2"/>
   <inertia ixx="0.01" ixy="1e-05" ixz="0" iyy="0.02"
   iyz="0" izz="0.02"/></inertial>
   <!-- Part body --><visual><origin xyz="0 0 0" rpy="0 0 0"/><geometry><mesh filename="package://assets/body.stl"/></geometry>
   <material name="body_material"><color rgba="0.2 0.4 0.6 1.0"/></material></visual></link>
  <link name="tip_frame"/>
  <joint name="tip_frame_joint" type="fixed"><origin xyz="0 0 -0.2" rpy="0 0 0"/><parent link="shin"/><child link="tip_frame"/>
   <axis xyz="0 0 0"/></joint>
  <link name="shin"><inertial><origin xyz="0 0 -0.1" rpy="0 0 0"/><mass value="0.3"/>
   <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001"
   iyz="0" izz="0.0001"/></inertial></link>
  <joint name="knee" type="revolute"><origin xyz="0 0 -0.05" rpy="1.5708 -0 3.14159"/><parent link="body"/><child link="shin"/>
   <axis xyz="0 0 1"/><joint_properties friction="0.0"/></joint>
  <link name="claw"><inertial><mass value="0.1"/>
   <inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial></link>
  <joint name="claw" type="prismatic"><parent link="shin"/><child link="claw"/><axis xyz="1 0 0"/>
   <mimic joint="knee" multiplier="0.02"/></joint>
</robot>"""


def triangles() -> str:
    """A ball of radius 1 in STL's text."""
    vertices, faces = ellipsoid(np.ones(3))
    rows = ["solid ball"]
    for face in faces:
        rows += ["facet normal 0 0 0", "outer loop", *[f"vertex {x:.6g} {y:.6g} {z:.6g}" for x, y, z in vertices[face]],
                 "endloop",
                 "endfacet"]
    return "\n".join([*rows, "endsolid ball"])


def test_a_file_of_solidworks(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_bytes(SOLIDWORKS.encode())
    model = sd.read_urdf(path).check()
    assert model.name == "my_arm" and [str(q) for q in model.coordinates] == ["q_Joint1"]
    assert float(model.bodies[0].mass) == 0.85 and model.joints[1].parent_rotation[1, 2] != -1  # 1.5708 is no right angle


def test_a_file_of_onshape(tmp_path: Path) -> None:
    model = sd.read_urdf(saved(tmp_path, ONSHAPE)).check()
    assert [str(q) for q in model.coordinates][-1] == "q_knee" and len(model.coordinates) == 8
    assert model.bodies[0].mass == 0 and {j.name: str(j.coordinates[0]) for j in model.joints if j.name == "claw"} == {
        "claw": "0.02*q_knee"}


@pytest.mark.parametrize(("old", "new", "fault"), [
    ('<mass value="1.2"/>', '<mass value="${m}"/>',
     "link 'body': value of <mass> is '${m}'; give a number, finite and written out; it"),
    ('<link name="tip_frame"/>', '<xacro:include filename="x"/>',
     "<xacro:include> is left over from xacro; run the file through xacro"),
    ('<joint name="knee" type="revolute">', '<joint name="knee" type="ball">', "joint 'knee' has the type 'ball'"),
    ('<mass value="0.3"/>', "", "<inertial> has no <mass>; add it"),
])
def test_what_exporters_leave_behind(tmp_path: Path, old: str, new: str, fault: str) -> None:
    path = saved(tmp_path, ONSHAPE.replace(old, new))
    with pytest.raises(ModelError) as raised:
        sd.read_urdf(path)
    assert all(f.startswith(f"{path}:") for f in raised.value.faults) and any(fault in f for f in raised.value.faults)


# -- meshes


def test_meshes_are_drawn(tmp_path: Path) -> None:
    pytest.importorskip("trimesh", reason="trimesh is not installed; run: pip install 'symdyn[meshes]'")
    (tmp_path / "my arm" / "meshes").mkdir(parents=True)
    (tmp_path / "my arm" / "meshes" / "base_link.STL").write_text(triangles())
    (tmp_path / "my arm" / "urdf").mkdir()
    path = tmp_path / "my arm" / "urdf" / "arm.urdf"
    path.write_bytes(SOLIDWORKS.encode())
    with pytest.raises(ModelError, match="there is no mesh"):
        sd.read_urdf(path, visuals=True, folder=path.parent)
    system = sd.read_urdf(path, visuals=True, folder=tmp_path)
    shape, = system.check().shapes
    assert shape.about["kind"] == "mesh" and shape.color == [0.79216, 0.81961, 0.93333]
    assert np.abs(np.linalg.norm(shape.about["vertices"], axis=1) - 1).max() < 1e-4
    page = system.show(tmp_path / "arm.html")
    assert page.name == "my_arm" and (tmp_path / "arm.html").stat().st_size < 500_000
    system.compile("numpy").simulate((0, 0.01)).picture(0.0, tmp_path / "arm.png")
    assert (tmp_path / "arm.png").stat().st_size > 5000


@pytest.mark.parametrize(("unit", "factor"), [("", 1.0), ('<unit name="millimeter" meter="0.001"/>', 0.001)])
def test_collada_has_the_unit_that_it_states(tmp_path: Path, unit: str, factor: float) -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed; run: pip install 'symdyn[meshes]'")
    pytest.importorskip("collada", reason="pycollada is not installed; run: pip install 'symdyn[meshes]'")
    text = trimesh.creation.box(extents=[1, 2, 3]).export(file_type="dae")
    written = text.decode() if isinstance(text, bytes) else text
    (tmp_path / "box.dae").write_text(written.replace("<up_axis>", f"{unit}<up_axis>"))
    shape, = sd.read_urdf(saved(tmp_path, visual('<mesh filename="box.dae"/>')), visuals=True).shapes
    vertices = np.array(shape.about["vertices"])
    np.testing.assert_allclose(np.ptp(vertices, axis=0), factor * np.array([1, 2, 3]), rtol=1e-12)


def test_collada_has_the_colours_of_its_materials(tmp_path: Path) -> None:
    """Two materials and triangles without one: a mesh for each, unless the robot's file states a colour of its own."""
    pytest.importorskip("trimesh", reason="trimesh is not installed; run: pip install 'symdyn[meshes]'")
    pytest.importorskip("collada", reason="pycollada is not installed; run: pip install 'symdyn[meshes]'")
    (tmp_path / "two.dae").write_text(collada())
    text = visual('<mesh filename="two.dae" scale="2 1 1"/>')
    shapes = sd.read_urdf(saved(tmp_path, text), visuals=True).shapes
    found = {s.color and tuple(round(v, 2) for v in s.color): s.about for s in shapes}
    assert set(found) == {None, (1.0, 0.0, 0.0), (0.0, 0.0, 0.5)}
    assert [len(found[c]["faces"]) for c in ((1.0, 0.0, 0.0), (0.0, 0.0, 0.5), None)] == [2, 1, 1]
    blue = found[0.0, 0.0, 0.5]["vertices"]
    assert sorted(map(tuple, blue)) == [(0.0, 0.0, 1.1), (0.0, 0.0, 1.101), (0.0, 0.001, 1.1)]
    assert max(x for x, _, _ in found[1.0, 0.0, 0.0]["vertices"]) == 0.002
    stated = text.replace("</geometry>", "</geometry><material name='m'><color rgba='0 1 0 1'/></material>")
    assert {tuple(s.color) for s in sd.read_urdf(saved(tmp_path, stated), visuals=True).shapes} == {(0.0, 1.0, 0.0)}


def visual(geometry: str) -> str:
    return robot(link("a", f"<visual><origin xyz='0 0 1'/><geometry>{geometry}</geometry></visual>"))


@pytest.mark.parametrize(("geometry", "low", "high"), [
    ('<box size="1 2 3"/>', (-0.5, -1, -0.5), (0.5, 1, 2.5)), ('<sphere radius="2"/>', (-2, -2, -1), (2, 2, 3)),
    ('<cylinder radius="1" length="3"/>', (-1, -1, -0.5), (1, 1, 2.5))])
def test_solids(tmp_path: Path, geometry: str, low: tuple[float, ...], high: tuple[float, ...]) -> None:
    shape, = sd.read_urdf(saved(tmp_path, visual(geometry)), visuals=True).shapes
    vertices = np.array(shape.about["vertices"])
    np.testing.assert_allclose([vertices.min(axis=0), vertices.max(axis=0)], [low, high], atol=1e-12)


@pytest.mark.parametrize(("geometry", "fault"), [
    ('<mesh filename="../x.stl"/>', "the mesh '../x.stl' is outside of the folder"),
    ('<mesh filename="x.stl"/>', "there is no mesh 'x.stl'"), ("<cone/>",
                                                               "has a <cone>; read are box, sphere, cylinder and mesh"),
    ("", "<visual> has no <geometry>"), ('<mesh filename="odd.stl"/>', "the mesh 'odd.stl' "),
    ('<mesh filename="odd.step"/>', "is of the format step; read are stl, obj, dae"),
    ('<mesh filename="empty.obj"/>', "the mesh 'empty.obj' "), ("<mesh/>", "<visual> has no filename"),
])
def test_faults_of_meshes(tmp_path: Path, geometry: str, fault: str) -> None:
    pytest.importorskip("trimesh", reason="trimesh is not installed; run: pip install 'symdyn[meshes]'")
    for name in ("odd.stl", "odd.step"):
        (tmp_path / name).write_text("no mesh at all")
    (tmp_path / "empty.obj").write_text("v 0 0 0\n")
    path = saved(tmp_path, visual(geometry))
    with pytest.raises(ModelError) as raised:
        sd.read_urdf(path, visuals=True)
    assert raised.value.faults[0].startswith(f"{path}:2: link 'a': <visual>") and fault in str(raised.value)
    sd.read_urdf(path)  # without pictures nothing is looked at


def test_without_trimesh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "x.stl").write_text(triangles())
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(MissingExtra, match=r"reading meshes needs the package trimesh: pip install 'symdyn\[meshes\]'"):
        sd.read_urdf(saved(tmp_path, visual('<mesh filename="x.stl"/>')), visuals=True)
    with pytest.raises(ArgumentError, match="visuals is 'no'; pass True or False"):
        sd.read_urdf(saved(tmp_path, visual("<sphere/>")), visuals="no")


def test_no_more_triangles_than_the_eye_sees() -> None:
    angles = np.linspace(0, 2 * np.pi, 200)
    grid = np.array([[np.cos(a) * (2 + np.cos(b)), np.sin(a) * (2 + np.cos(b)), np.sin(b)] for a in angles[:-1] for b in
                     angles[:-1]])
    at = np.arange(199 * 199).reshape(199, 199)
    a, b, c, d = (np.roll(at, s, axis=(0, 1)).ravel() for s in ((0, 0), (1, 0), (1, 1), (0, 1)))
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    vertices, left = decimated(grid, faces)
    assert TRIANGLES / 3 < len(left) <= TRIANGLES and left.max() == len(vertices) - 1
    # every point that is left lies within a cell of the torus
    off = np.abs(np.hypot(np.hypot(vertices[:, 0], vertices[:, 1]) - 2, vertices[:, 2]) - 1)
    assert off.max() < 0.35
    np.testing.assert_array_equal(decimated(*box(np.ones(3)))[1].shape, (12, 3))
    for solid, volume in ((box(np.array([1, 2, 3])), 48.0), (cylinder(1.0, 2.0), 4 * np.pi), (capsule(1.0, 0.0), 4 / 3 * np.pi)):
        x, y, z = (solid[0][solid[1][:, k]] for k in range(3))
        assert np.einsum("ij,ij->", x, np.cross(y, z)) / 6 == pytest.approx(volume, rel=0.1)


@pytest.mark.parametrize(("shape", "fault"), [
    (sd.shapes.Mesh([[0, 0]], [[0, 0, 0]]), "pass finite numbers, (n, 3)"), (sd.shapes.Mesh("x", [[0, 0, 0]]),
                                                                             "pass finite numbers"),
    (sd.shapes.Mesh([[0, 0, 0]], [[0, 0, 1]]), "pass (m, 3) indices from 0 to 0"),
    (sd.shapes.Mesh([[0, 0, 0]], [[0, 0, 0.5]]), "pass (m, 3) indices"),
    (sd.shapes.Mesh(np.zeros((20_001, 3)), [[0, 0, 0]]), "it has 20001 vertices; pass 20000 at most")])
def test_faults_of_shapes(shape: sd.shapes.Mesh, fault: str) -> None:
    system = sd.systems.get("spatial_chain", n=1)
    system.draw("body1", shape)
    with pytest.raises(ModelError) as raised:
        system.check()
    assert fault in str(raised.value)
