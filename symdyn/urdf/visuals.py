"""Visual shapes of the links of a URDF: its <visual> elements."""

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
from symdyn.urdf.mesh_files import MeshFiles
from symdyn.urdf.meshes import Piece, box, cylinder, ellipsoid
from symdyn.urdf.robot import ZERO
from symdyn.urdf.values import FileFaults


class Visuals:
    """Draws links; folder: that no mesh may be outside of."""

    def __init__(self, faults: FileFaults, folder: Path) -> None:
        self.faults, self.files = faults, MeshFiles(faults, folder)

    def draw(self, root: Element, bodies: Mapping[str, Body], system: System) -> None:
        materials = {e.attributes.get("name"): e for e in root.all("material")}
        for link in root.all("link"):
            body = bodies.get(link.attributes.get("name", "").strip())
            if body is None:
                continue
            for visual in link.all("visual"):
                what = f"link {shown(link.attributes['name'])}: <visual>"
                pieces = self._pieces(visual.find("geometry"), visual, what)
                if not pieces:
                    continue
                origin = visual.find("origin")
                R = np.array(rotation(self.faults.triple(origin, "rpy", what, ZERO)))
                p, color = np.array(self.faults.triple(origin, "xyz", what, ZERO)), self._color(visual, materials, what)
                for piece in pieces:
                    system.draw(body, Mesh(piece.vertices @ R.T + p, piece.faces), color=color or piece.color)

    def _pieces(self, geometry: Element | None, visual: Element, what: str) -> list[Piece]:
        f = self.faults
        for shape in () if geometry is None else geometry.children:
            if shape.tag == "box":
                return [Piece(*box(np.array(f.triple(shape, "size", what, (1.0, 1.0, 1.0))) / 2))]
            if shape.tag == "sphere":
                return [Piece(*ellipsoid(np.full(3, f.number(shape, "radius", what))))]
            if shape.tag == "cylinder":
                return [Piece(*cylinder(f.number(shape, "radius", what), f.number(shape, "length", what) / 2))]
            if shape.tag == "mesh":
                return self._mesh(shape, what)
            f.at(shape.line, f"{what} has a <{shape.tag}>; read are box, sphere, cylinder and mesh")
            return []
        f.at(visual.line, f"{what} has no <geometry>; leave it out")
        return []

    def _mesh(self, shape: Element, what: str) -> list[Piece]:
        name = self.faults.name(shape, "filename", what)
        result = self.files.pieces(name, shape.line, what) if name else []
        scale = np.array(self.faults.triple(shape, "scale", what, (1.0, 1.0, 1.0))) if result else 1.0
        return [Piece(p.vertices * scale, p.faces, p.color) for p in result]

    def _color(self, visual: Element, materials: Mapping[Any, Element], what: str) -> list[float] | None:
        material = visual.find("material")
        if material is not None and material.find("color") is None:
            material = materials.get(material.attributes.get("name"))
        color = None if material is None else material.find("color")
        if color is None:
            return None
        numbers = self.faults._numbers(color, "rgba", what, 4, (0.6, 0.6, 0.6, 1.0))
        return [min(max(v, 0.0), 1.0) for v in numbers[:3]]
