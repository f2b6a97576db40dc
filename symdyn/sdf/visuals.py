"""Visual shapes of the links of an SDF: its <visual> elements."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from symdyn.model.bodies import Body
from symdyn.model.shapes import Mesh
from symdyn.model.system import System
from symdyn.sdf.model import SdfLink, SdfModel
from symdyn.sdf.values import Values
from symdyn.shown import shown
from symdyn.urdf.document import Element
from symdyn.urdf.mesh_files import MeshFiles
from symdyn.urdf.meshes import Piece, box, capsule, cone, cylinder, ellipsoid
from symdyn.urdf.poses import Pose

# Geometries without a form of their own: nothing, and a ground that has no end.
_LEFT_OUT = ("empty", "plane")
_READ = "box, sphere, ellipsoid, cylinder, capsule, cone and mesh"


class Visuals:
    """Draws links; folder: that no mesh may be outside of."""

    def __init__(self, faults: Values, folder: Path) -> None:
        self.faults, self.files = faults, MeshFiles(faults, folder)

    def draw(self, model: SdfModel, bodies: Mapping[str, Body], system: System) -> None:
        for link in model.links.values():
            for visual in link.visuals:
                what = f"link {shown(link.name)}: <visual>"
                pose, color = self._pose(visual, link, model, what), self._color(visual.find("material"), what)
                pieces = self._pieces(visual, what)
                if self.faults.number_in(visual, "transparency", what, 0.0) >= 1.0:
                    continue
                for piece in pieces:
                    system.draw(bodies[link.name], Mesh(piece.vertices @ pose.R.T + pose.p, piece.faces),
                                color=color or piece.color)

    def _pose(self, visual: Element, link: SdfLink, model: SdfModel, what: str) -> Pose:
        """Pose of a visual in its link; the frame that it is relative to has a name within the link's model."""
        relative, pose, line = self.faults.pose(visual, what)
        inner, _, _ = link.name.rpartition("::")
        frame = f"{inner}::{relative}" if inner else relative
        return pose if not relative else model.frames.between(link.name, frame, line, what) @ pose

    def _pieces(self, visual: Element, what: str) -> list[Piece]:
        f, geometry = self.faults, visual.find("geometry")
        for shape in () if geometry is None else geometry.children:
            if shape.tag in _LEFT_OUT:
                return []
            if shape.tag == "box":
                return [Piece(*box(self._triple(shape, "size", what) / 2))]
            if shape.tag == "ellipsoid":
                return [Piece(*ellipsoid(self._triple(shape, "radii", what)))]
            if shape.tag == "sphere":
                return [Piece(*ellipsoid(np.full(3, f.number_in(shape, "radius", what, 1.0))))]
            if shape.tag == "cylinder":
                return [Piece(*cylinder(f.number_in(shape, "radius", what, 1.0), f.number_in(shape, "length", what, 1.0) / 2))]
            if shape.tag in ("capsule", "cone"):
                made = capsule if shape.tag == "capsule" else cone
                return [Piece(*made(f.number_in(shape, "radius", what, 0.5), f.number_in(shape, "length", what, 1.0) / 2))]
            if shape.tag == "mesh":
                return self._mesh(shape, what)
            f.at(shape.line, f"{what} has a <{shape.tag}>; read are {_READ}; leave it out, or pass visuals=False")
            return []
        f.at(visual.line, f"{what} has no <geometry>; leave it out")
        return []

    def _triple(self, shape: Element, tag: str, what: str) -> np.ndarray:
        """Three numbers that a child holds; 1 each where there is none."""
        result = shape.find(tag)
        return np.ones(3) if result is None else np.array(self.faults.numbers(result, what, 3))

    def _mesh(self, shape: Element, what: str) -> list[Piece]:
        part = shape.find("submesh")
        if part is not None:
            self.faults.at(part.line, f"{what} shows a part of a mesh (<submesh>), which is not read; give "
                                  "the part a file of its own")
            return []
        name, scale = self.faults.word(shape, "uri", what), self._triple(shape, "scale", what)
        result = self.files.pieces(name, shape.line, what) if name else []
        return [Piece(p.vertices * scale, p.faces, p.color) for p in result]

    def _color(self, material: Element | None, what: str) -> tuple[float, ...] | None:
        """The diffuse colour of a material, else the ambient one; None where there is none."""
        result = None if material is None else material.find("diffuse") or material.find("ambient")
        if result is None:
            return None
        numbers = self.faults.numbers(result, what, 3 if len(result.text.split()) == 3 else 4)
        return tuple(min(max(v, 0.0), 1.0) for v in numbers[:3])
