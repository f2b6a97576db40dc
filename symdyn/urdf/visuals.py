"""What the links of a URDF look like: its <visual> elements as shapes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.model.bodies import Body
from symdyn.model.shapes import Mesh
from symdyn.model.system import System
from symdyn.shown import shown
from symdyn.urdf.angles import rotation
from symdyn.urdf.document import Element
from symdyn.urdf.meshes import Triangles, box, cylinder, decimated, ellipsoid, loaded
from symdyn.urdf.robot import ZERO
from symdyn.urdf.values import FileFaults


class Visuals:
    """Draws links; folder: that no mesh may be outside of."""

    def __init__(self, faults: FileFaults, folder: Path) -> None:
        self.faults, self.base, self.folder = faults, faults.path.parent, folder.resolve()

    def draw(self, root: Element, bodies: Mapping[str, Body], system: System) -> None:
        materials = {e.attributes.get("name"): e for e in root.all("material")}
        for link in root.all("link"):
            body = bodies.get(link.attributes.get("name", "").strip())
            if body is None:
                continue
            for visual in link.all("visual"):
                what = f"link {shown(link.attributes['name'])}: <visual>"
                found = self._triangles(visual.find("geometry"), visual, what)
                if found is None:
                    continue
                origin = visual.find("origin")
                R = np.array(rotation(self.faults.triple(origin, "rpy", what, ZERO)))
                vertices = found[0] @ R.T + np.array(self.faults.triple(origin, "xyz", what, ZERO))
                system.draw(body, Mesh(vertices, found[1]), color=self._color(visual, materials, what))

    def _triangles(self, geometry: Element | None, visual: Element, what: str) -> Triangles | None:
        f = self.faults
        for shape in () if geometry is None else geometry.children:
            if shape.tag == "box":
                return box(np.array(f.triple(shape, "size", what, (1.0, 1.0, 1.0))) / 2)
            if shape.tag == "sphere":
                return ellipsoid(np.full(3, f.number(shape, "radius", what)))
            if shape.tag == "cylinder":
                return cylinder(f.number(shape, "radius", what), f.number(shape, "length", what) / 2)
            if shape.tag == "mesh":
                return self._mesh(shape, what)
            f.at(shape.line, f"{what} has a <{shape.tag}>; read are box, sphere, cylinder and mesh")
            return None
        f.at(visual.line, f"{what} has no <geometry>; leave it out")
        return None

    def _mesh(self, shape: Element, what: str) -> Triangles | None:
        name = self.faults.name(shape, "filename", what)
        path = self._file(name, shape.line, what) if name else None
        if path is None:
            return None
        try:
            vertices, faces = decimated(*loaded(path))
        except ValueError as error:
            self.faults.at(shape.line, f"{what}: the mesh {shown(name)} {error}")
            return None
        return vertices * np.array(self.faults.triple(shape, "scale", what, (1.0, 1.0, 1.0))), faces

    def _file(self, name: str, line: int, what: str) -> Path | None:
        """The file of a name: after package://NAME/ the path is seen from the folder, with NAME or without, or from a folder NAME
        that holds the URDF."""
        inside = name.removeprefix("package://").removeprefix("file://")
        package, _, rest = inside.partition("/")
        if name.startswith("package://"):
            above = next((p for p in self.base.resolve().parents if p.name == package), self.base)
            candidates = [self.folder / inside, self.folder / rest, above / rest, above.parent / inside]
        else:
            candidates = [self.base / inside]
        found = [c.resolve() for c in candidates]
        held = [c for c in found if c.is_relative_to(self.folder)]
        if not held:
            self.faults.at(line, f"{what}: the mesh {shown(name)} is outside of the folder {self.folder}; pass folder=... with "
                                 "one that "
                                 "holds all files of the robot")
            return None
        here = next((c for c in held if c.is_file()), None)
        if here is None:
            self.faults.at(line, f"{what}: there is no mesh {shown(name)} (looked for {held[0]}); pass folder=..., or "
                                 "visuals=False")
        return here

    def _color(self, visual: Element, materials: Mapping[Any, Element], what: str) -> list[float] | None:
        material = visual.find("material")
        if material is not None and material.find("color") is None:
            material = materials.get(material.attributes.get("name"))
        color = None if material is None else material.find("color")
        if color is None:
            return None
        numbers = self.faults._numbers(color, "rgba", what, 4, (0.6, 0.6, 0.6, 1.0))
        return [min(max(v, 0.0), 1.0) for v in numbers[:3]]
