"""Small URDF files as text."""

from __future__ import annotations

from pathlib import Path

BOX = """<inertial><origin xyz="0.1 -0.2 0.3" rpy="0.3 -0.4 0.5"/><mass value="2.5"/>
    <inertia ixx="0.05" ixy="0.002" ixz="-0.003" iyy="0.06" iyz="0.004" izz="0.07"/></inertial>"""
BALL = '<inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>'


def link(name: str, inertial: str = BALL) -> str:
    return f'<link name="{name}">{inertial}</link>'


def joint(name: str, kind: str, parent: str, child: str, more: str = "") -> str:
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{more}</joint>'


def robot(*lines: str, name: str = "small") -> str:
    """One element a line: the first is in line 2."""
    return "\n".join([f'<robot name="{name}">', *lines, "</robot>"])


def pendulum(*more: str) -> str:
    """One link on a joint "hinge", and what comes after them, from line 5 on."""
    return robot(link("base", ""), link("bar"), joint("hinge", "continuous", "base", "bar", '<axis xyz="0 1 0"/>'), *more)


def saved(folder: Path, text: str, name: str = "robot.urdf") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


LIMIT = '<limit lower="-1" upper="1" effort="10" velocity="10"/>'
# Every type of joint, turned frames, a slanted axis, joints that mimic, one of them a joint that mimics itself.
ALL = robot(
    link("base"), link("table", BOX), link("arm", BOX), link("slide", BOX), link("plate"), link("flyer", BOX),
    link("finger", BOX), link("thumb", BOX), link("tip", ""),
    joint("turn", "continuous", "base", "table", '<origin xyz="0 0 0.4" rpy="0 0 1.5707963267948966"/><axis xyz="0 0 1"/>'),
    joint("lift", "revolute", "table", "arm", f'<origin xyz="0.1 0 0.2" rpy="1.5708 0.2 -0.1"/><axis xyz="1 2 -2"/>{LIMIT}'),
    joint("push", "prismatic", "arm", "slide", f'<origin xyz="0.3 0 0" rpy="0 0 3.14159265"/><axis xyz="0 -1 0"/>{LIMIT}'),
    joint("float", "planar", "base", "plate", '<origin xyz="1 1 0" rpy="0.3 0.1 0"/><axis xyz="0 0 1"/>'),
    joint("fly", "floating", "base", "flyer", '<origin xyz="0 -1 0" rpy="0.1 0.2 0.3"/>'),
    joint("grip", "revolute", "slide", "finger", f'<origin xyz="0 0 0.1" rpy="0 0.5 0"/><axis xyz="1 0 0"/>{LIMIT}'
                                                '<mimic joint="lift" multiplier="-0.5" offset="0.3"/>'),
    joint("close", "prismatic", "finger", "thumb", f'<axis xyz="0 0 1"/>{LIMIT}<mimic joint="push"/>'),
    joint("end", "fixed", "thumb", "tip", '<origin xyz="0 0 0.05" rpy="0 0 0.7"/>'), name="all of them")


def collada() -> str:
    """A tetrahedron of 1 mm edges along x, y and z, 100 mm above the origin: two triangles red, one dark blue, one without a
    material."""
    def effect(name: str, color: str) -> str:
        return (f'<effect id="{name}-e"><profile_COMMON><technique sid="common"><phong><diffuse><color>{color}</color></diffuse>'
                "</phong></technique></profile_COMMON></effect>")

    def triangles(corners: str, symbol: str = "") -> str:
        count = len(corners.split()) // 3
        return f'<triangles count="{count}"{symbol}><input semantic="VERTEX" source="#v" offset="0"/><p>{corners}</p></triangles>'

    def bound(symbol: str, target: str) -> str:
        return f'<instance_material symbol="{symbol}" target="#{target}"/>'

    return f"""<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="mm" meter="0.001"/><up_axis>Z_UP</up_axis></asset>
<library_effects>{effect("red", "1 0 0 1")}{effect("blue", "0 0 0.5 1")}</library_effects>
<library_materials><material id="red"><instance_effect url="#red-e"/></material>
<material id="blue"><instance_effect url="#blue-e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="a" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array>
<technique_common><accessor source="#a" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
{triangles("0 2 1 0 1 3", ' material="first"')}{triangles("0 3 2", ' material="second"')}{triangles("1 2 3")}
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><translate>0 0 100</translate><instance_geometry url="#g">
<bind_material><technique_common>{bound("first", "red")}{bound("second", "blue")}</technique_common></bind_material>
</instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
