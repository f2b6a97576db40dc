"""Links and joints of an SDF, with the frames that they are given in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from symdyn.sdf.frames import MODEL, FrameOf, Frames
from symdyn.sdf.values import Values
from symdyn.shown import shown
from symdyn.urdf.document import Element
from symdyn.urdf.poses import Pose
from symdyn.urdf.robot import INERTIA

# Types of joints, and how many axes each has.
TYPES = {"fixed": 0, "revolute": 1, "continuous": 1, "prismatic": 1, "ball": 0, "universal": 2, "revolute2": 2}
# Gravity of a world that names none, m/s^2.
GRAVITY = (0.0, 0.0, -9.8)


@dataclass(frozen=True)
class SdfLink:
    """Mass, kg; pose of the centre of mass; inertia about it in the axes of that pose, kg m^2, as INERTIA; whether it has
    weight; its <visual> elements."""

    name: str
    mass: float
    center: Pose
    inertia: tuple[float, ...]
    weight: bool
    line: int
    visuals: tuple[Element, ...]


@dataclass(frozen=True)
class Axis:
    """A direction in a frame, of length 1; damping, N m s/rad or N s/m, stiffness, N m/rad or N/m, and where that is at rest."""

    xyz: np.ndarray
    frame: str
    damping: float
    stiffness: float
    reference: float
    mimic: tuple[str, float, float, float] | None
    line: int


@dataclass(frozen=True)
class SdfJoint:
    """A joint; its own frame is among the frames, by its name."""

    name: str
    kind: str
    parent: str
    child: str
    axes: tuple[Axis, ...]
    line: int


@dataclass
class SdfModel:
    """All of a model that dynamics depends on.

    pose   of the model in the world; left: what is not looked at, by kind: names and lines
    """

    name: str
    pose: Pose
    frames: Frames
    static: bool = False
    links: dict[str, SdfLink] = field(default_factory=dict)
    joints: dict[str, SdfJoint] = field(default_factory=dict)
    gravity: tuple[float, ...] = GRAVITY
    left: dict[str, list[tuple[str, int]]] = field(default_factory=dict)


class Parser:
    """Makes the model of a document; every fault of the file is collected."""

    def __init__(self, faults: Values) -> None:
        self.faults = faults
        self.version = 0.0

    def parse(self, root: Element) -> SdfModel:
        f = self.faults
        empty = SdfModel("", Pose(), Frames(f))
        if root.tag != "sdf":
            f.at(root.line, f"the file holds a <{root.tag}>; an SDF holds an <sdf>")
            return empty
        self.version = f.number(root, "version", "<sdf>")
        world = root.find("world")
        models = list((world or root).all("model"))
        if len(models) != 1:
            f.at(root.line, f"the file holds {len(models)} models; read one: leave the others out, or nest them in one <model>")
            return empty
        name = f.name(models[0], "name", "a model")
        model = SdfModel(name, Pose(), Frames(f), static=f.true(models[0], "static"))
        self._model(models[0], model, "")
        _, pose, _ = f.pose(models[0], "the model")
        if "placement_frame" in models[0].attributes:
            placed = models[0].attributes["placement_frame"]
            pose = pose @ model.frames.pose(placed, models[0].line, "placement_frame").inverse()
        model.pose = pose
        for element in (world or root).all("include"):
            f.at(element.line, "<include> brings in another file, which is not read; put the model in this file")
        gravity = None if world is None else world.find("gravity")
        if gravity is not None:
            model.gravity = tuple(f.numbers(gravity, "<gravity>", 3))
        if not model.links:
            f.at(models[0].line, "the model has no links; an SDF has at least one <link name=\"...\">")
        return model

    def _model(self, element: Element, model: SdfModel, scope: str) -> None:
        f = self.faults
        for child in element.children:
            if child.tag == "link":
                self._link(child, model, scope)
            elif child.tag == "joint":
                self._joint(child, model, scope)
            elif child.tag == "frame":
                name = scope + f.name(child, "name", "a frame")
                attached = child.attributes.get("attached_to", "")
                relative, pose, line = f.pose(child, f"frame {shown(name)}")
                inner = scope + (attached or MODEL) if scope or attached else MODEL
                model.frames.add(name, FrameOf(f"frame {shown(name)}", self._named(relative, scope) or inner, pose, inner, line))
            elif child.tag == "model":
                name = scope + f.name(child, "name", "a nested model")
                what = f"model {shown(name)}"
                relative, pose, line = f.pose(child, what)
                if "placement_frame" in child.attributes:
                    f.at(child.line, f"{what} is nested and has a placement_frame, which is not read; give the pose of the "
                                     "model itself")
                own = f"{name}::{MODEL}"
                model.frames.add(own, FrameOf(what, self._named(relative, scope) or scope + MODEL, pose, self._canonical(child,
                                              name), line))
                model.frames.add(name, FrameOf(what, own, Pose(), own, line))
                self._model(child, model, f"{name}::")
            elif child.tag == "include":
                f.at(child.line, "<include> brings in another file, which is not read; put the model in this file")
            elif child.tag == "plugin":
                model.left.setdefault("plugins", []).append((child.attributes.get("name", "plugin"), child.line))

    @staticmethod
    def _canonical(element: Element, name: str) -> str:
        link = element.attributes.get("canonical_link") or next((e.attributes.get("name", "") for e in element.all("link")), "")
        return f"{name}::{link}" if link else ""

    @staticmethod
    def _named(name: str, scope: str) -> str:
        """A name as it is in the whole model."""
        return name if not name or name == "world" else scope + name

    def _link(self, element: Element, model: SdfModel, scope: str) -> None:
        f = self.faults
        name = scope + f.name(element, "name", "a link")
        what = f"link {shown(name)}"
        relative, pose, line = f.pose(element, what)
        if not model.frames.add(name, FrameOf(what, self._named(relative, scope) or scope + MODEL, pose, "", line)):
            return
        if f.true(element, "kinematic"):
            f.at(element.line, f"{what} is kinematic: its motion is given from outside; leave <kinematic> out, or hold its joint "
                               "with fixed=...")
        inertial = element.find("inertial")
        mass, center, entries = 1.0, Pose(), [1.0, 0.0, 0.0, 1.0, 0.0, 1.0]
        if inertial is not None:
            if inertial.attributes.get("auto") in ("true", "1"):
                f.at(inertial.line, f"{what}: its inertia is to follow from its collisions (auto), which is not computed; "
                                    "write mass and "
                                    "inertia")
            if inertial.find("fluid_added_mass") is not None:
                f.at(inertial.line, f"{what} has an added mass of a fluid, which is not read; leave it out, and add sd.AddedMass")
            mass = f.number_in(inertial, "mass", what, 1.0)
            if mass < 0:
                f.at(inertial.line, f"{what} has the mass {mass} kg; give zero or a positive mass")
            frame, center, at = f.pose(inertial, what)
            if frame not in ("", name.rpartition("::")[2]):
                f.at(at, f"{what}: the pose of its inertia is relative to {shown(frame)}; it is in the link's frame always")
            written = inertial.find("inertia")
            if written is not None:
                entries = [f.number_in(written, tag, what, 1.0 if tag[1] == tag[2] else 0.0) for tag in INERTIA]
        model.links[name] = SdfLink(name, mass, center, tuple(entries), not (
            element.find("gravity") is not None and not f.true(element, "gravity")), element.line,
            tuple(element.all("visual")))
        for collision in element.all("collision"):
            model.left.setdefault("contacts", []).append((name, collision.line))

    def _joint(self, element: Element, model: SdfModel, scope: str) -> None:
        f = self.faults
        name = scope + f.name(element, "name", "a joint")
        what = f"joint {shown(name)}"
        kind = f.name(element, "type", what)
        if kind and kind not in TYPES:
            f.at(element.line, f"{what} has the type {shown(kind)}; read are {', '.join(TYPES)}")
        parent, child = (self._named(f.word(element, end, what), scope) for end in ("parent", "child"))
        relative, pose, line = f.pose(element, what)
        if not model.frames.add(name, FrameOf(what, self._named(relative, scope) or child or MODEL, pose, child, line)):
            return
        axes = tuple(self._axes(element, kind, name, what, scope, model))
        model.joints[name] = SdfJoint(name, kind, parent, child, axes, element.line)

    def _axes(self, element: Element, kind: str, name: str, what: str, scope: str, model: SdfModel) -> Iterator[Axis]:
        f = self.faults
        for tag in ("axis", "axis2")[:TYPES.get(kind, 0)]:
            axis = element.find(tag)
            if axis is None:
                f.at(element.line, f"{what} is {kind} and has no <{tag}>; write <{tag}><xyz>...</xyz></{tag}>")
                continue
            xyz = axis.find("xyz")
            direction = np.array([0.0, 0.0, 1.0] if xyz is None else f.numbers(xyz, what, 3))
            if np.linalg.norm(direction) < 1e-12:
                f.at(axis.line, f"{what}: its axis is zero; give a direction")
                direction = np.array([0.0, 0.0, 1.0])
            if abs(np.linalg.norm(direction) - 1) > 1e-15:
                direction = direction / np.linalg.norm(direction)
            # Before 1.5 axes were in the model's frame always, then where they ask for it, since 1.7 in a frame by name.
            asked = f.true(axis, "use_parent_model_frame") or 0 < self.version < 1.5
            frame = "" if xyz is None else self._named(xyz.attributes.get("expressed_in", ""), scope)
            dynamics, limit = axis.find("dynamics"), axis.find("limit")
            friction = f.number_in(dynamics, "friction", what, 0.0)
            if friction:
                model.left.setdefault("friction", []).append((name, axis.line))
            if limit is not None and any(abs(f.number_in(limit, end, what, 1e16)) < 1e16 for end in ("lower", "upper")):
                model.left.setdefault("limits", []).append((name, axis.line))
            yield Axis(direction, frame or (scope + MODEL if asked else name), f.number_in(dynamics, "damping", what, 0.0),
                       f.number_in(dynamics, "spring_stiffness", what, 0.0), f.number_in(dynamics, "spring_reference", what, 0.0),
                       self._mimic(axis, what, scope), axis.line)

    def _mimic(self, axis: Element, what: str, scope: str) -> tuple[str, float, float, float] | None:
        result = axis.find("mimic")
        if result is None:
            return None
        f = self.faults
        if result.attributes.get("axis", "axis") != "axis":
            f.at(result.line, f"{what} mimics a second axis, which is not read; give the first")
        return (self._named(f.name(result, "joint", f"{what}: mimic"), scope), f.number_in(result, "multiplier", what, 1.0),
                f.number_in(result, "offset", what, 0.0), f.number_in(result, "reference", what, 0.0))
