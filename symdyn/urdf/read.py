"""A System from a URDF file."""

from __future__ import annotations

import keyword
import math
import re
from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import ArgumentError, ModelError
from symdyn.kinds import flag
from symdyn.model.bodies import Body
from symdyn.model.joints import Fixed, Free, Joint, Planar, Prismatic, Revolute
from symdyn.model.orientation import EulerParameters
from symdyn.model.symbols import Coordinate, coordinates
from symdyn.model.system import System
from symdyn.shown import shown
from symdyn.urdf.angles import rotation
from symdyn.urdf.checks import mimicked, outwards
from symdyn.urdf.document import as_path, read_document
from symdyn.urdf.inertias import demand_inertia, negligible, tensor
from symdyn.urdf.parameters import Names, Parameters, plain
from symdyn.urdf.parse import parse
from symdyn.urdf.robot import GRAVITY, ZERO, Inertial, Link, Origin, Robot, UrdfJoint
from symdyn.urdf.values import FileFaults, nearest
from symdyn.urdf.visuals import Visuals

ROOTS = ("fixed", "floating")


def read_urdf(path: str | Path, symbolic: str | Sequence[str] = (), root: str = "fixed", name: str | None = None,
              fixed: str | Sequence[str] = (), damping: bool = False, visuals: bool = False,
              folder: str | Path | None = None) -> System:
    """The mechanism that a URDF file describes, under gravity of 9.81 m/s^2 along -z.

    symbolic   what becomes a parameter instead of a number, the number of the file its default: names of parameters (m_LINK,
               c_x_LINK, I_xx_LINK about the centre of mass in the link's axes, p_x_JOINT the joint in its parent, d_JOINT, g),
               of links or of joints (all of theirs), with * and ? as in names of files: symbolic=["m_*", "gripper", "g"]
    root       "fixed": the root link is part of the ground; "floating": it moves freely, with Euler parameters, and the
               velocity of its origin and its angular velocity in its own axes
    name       of the system; default: the file's name of the robot
    fixed      names of joints, with * and ?, that are held where their coordinate is zero
    damping    whether joints with one coordinate of their own have the viscous damping of <dynamics>
    visuals    whether bodies look in pictures as <visual> draws them: boxes, spheres, cylinders and meshes (STL, OBJ, DAE, read
               by trimesh), each with 800 triangles at most; in the colour of <material>, or those of a DAE's own materials
    folder     that no mesh may be outside of, and where package:// begins; default: that of the file

    Bodies are the links, with the links' frames. A joint's coordinate is q_JOINT (planar: x_, y_, theta_JOINT; floating: x_,
    y_, z_, e0_ ... e3_JOINT), where every character that no symbol has is an underscore. A joint that mimics another has no
    coordinate, but multiplier q + offset in terms of the other's; the drive of q then moves both. A link without <inertial> has
    no mass. Friction, limits, drives and whatever else is in the file are not looked at, nor,
    but with `visuals`, files it refers to.

    Raises ModelError that lists every fault of the file with its line; ArgumentError for an unknown root, and for a path and
    names that are none; MissingExtra without defusedxml, with meshes without trimesh. Source of the format:
    wiki.ros.org/urdf/XML.

    >>> import tempfile
    >>> system = sd.System("slider", gravity=[0, 0, -9.81])
    >>> joint = system.add_joint(sd.Prismatic("rail", system.ground, system.add_body("block", mass=1), axis=[1, 0, 0]))
    >>> sd.read_urdf(system.to_urdf(f"{tempfile.mkdtemp()}/slider.urdf")).name
    'slider'
    """
    wanted, held = patterns(symbolic, "symbolic"), patterns(fixed, "fixed")
    flag(damping, "damping")
    flag(visuals, "visuals")
    if not isinstance(root, str) or root not in ROOTS:
        raise ArgumentError(f"root is {shown(root)}; pass 'fixed' or 'floating'")
    path = as_path(path)
    document = read_document(path)
    faults = FileFaults(path)
    robot = parse(document, faults)
    still = frozenset(j for j in robot.joints if any(fnmatchcase(j, p) for p in held))
    faults += [f"{path}: fixed has {shown(p)}, which fits no joint of the file{nearest(p, robot.joints)}" for p in held
               if not any(fnmatchcase(j, p) for j in robot.joints)]
    base, order = outwards(robot, faults)
    following = mimicked(robot, still, faults)
    _raise(faults, robot.name)
    moving = {j.name: following[j.name][0] if j.name in following else j.name for j in order
              if j.kind != "fixed" and j.name not in still and following.get(j.name, ("-",))[0] != ""}
    demand_inertia(robot, order, moving, faults)
    if root == "floating" and all(link.inertial is None or link.inertial.nothing for link in robot.links.values()):
        faults.at(document.line, "no link has mass or inertia, so that nothing can move freely; give one an <inertial>")
    _raise(faults, robot.name)
    builder = _Builder(robot, system_name(robot.name or path.stem) if name is None else name, wanted, damping)
    system = builder.system(base, order, following, moving, root == "floating")
    faults += builder.parameters.faults()
    if visuals:
        Visuals(faults, path.parent if folder is None else as_path(folder, "the folder of a URDF")).draw(document,
                                                                                                         builder.bodies, system)
    _raise(faults, robot.name)
    return system


def _raise(faults: FileFaults, name: str) -> None:
    if faults:
        raise ModelError(faults, name)


def patterns(given: Any, what: str) -> list[str]:
    """Names with * and ? that an argument gives as one text or several. Raises ArgumentError for anything else."""
    listed = [given] if isinstance(given, str) else list(given) if isinstance(given, (list, tuple, set)) else [given]
    if not all(isinstance(p, str) for p in listed):
        raise ArgumentError(f"{what} is {shown(given)}; pass names as text, such as [\"m_*\"]")
    return listed


def system_name(name: str) -> str:
    """An identifier like the robot's name."""
    result = re.sub(r"\W+", "_", name).strip("_") or "robot"
    return f"robot_{result}" if not result.isidentifier() or keyword.iskeyword(result) else result


class _Builder:
    """Describes a robot that has no faults."""

    def __init__(self, robot: Robot, name: str, patterns: Sequence[str], damping: bool) -> None:
        self.robot = robot
        self.names = Names()
        self.parameters = Parameters(patterns, self.names)
        self.damping = damping
        self.negligible = negligible(robot)
        self.built = System(name)
        self.bodies: dict[str, Body] = {}
        self.coordinates: dict[str, Coordinate] = {}
        self.joint_names = Names()
        self.body_names = Names({"ground"})

    def system(self, base: str, order: Sequence[UrdfJoint], following: dict[str, tuple[str, float, float]],
               moving: dict[str, str], floating: bool) -> System:
        system = self.built
        system.gravity = system._faults.vector([0, 0, -self.parameters.gravity(GRAVITY)], "gravity")
        # The coordinates of the joints have their names before the parameters, and what mimics may stand before its source.
        named = {joint.name: self.joint_names.text(joint.name) for joint in order}
        for joint in order:
            if moving.get(joint.name) == joint.name and joint.kind in ("revolute", "continuous", "prismatic"):
                self.coordinates[joint.name] = self._coordinate("q", joint.name)
        child = self._body(self.robot.links[base])
        root = self.joint_names.text("root")
        system.add_joint(self._free(root, system.ground, child) if floating else Fixed(root, system.ground, child))
        for joint in order:
            child = self._body(self.robot.links[joint.child])
            made = self._joint(joint, named[joint.name], child, following, moving)
            system.add_joint(made)
            if self.damping and joint.damping and joint.name in self.coordinates:
                d = self.parameters.take("d", joint.name, joint.damping)
                system.add_joint_force(made, -d * self.coordinates[joint.name].dot, name=f"damping of {made.name}")
        system.set_defaults(self.parameters.defaults)
        return system

    # -- links

    def _body(self, link: Link) -> Body:
        inertial = link.inertial
        if inertial is None:
            inertial = Inertial(Origin(), 0.0, (0.0,) * 6, link.line)
        take, name = self.parameters.take, link.name
        mass = take("m", name, inertial.mass)
        com = [take(f"c_{axis}", name, value) for axis, value in zip("xyz", inertial.origin.xyz)]
        I = tensor(inertial)
        if np.abs(I).max() <= self.negligible:
            I = np.zeros((3, 3))
        if inertial.origin.rpy != ZERO:
            R = np.array(rotation(inertial.origin.rpy))
            I = R @ I @ R.T
        rows: list[list[Any]] = [[0] * 3 for _ in range(3)]
        for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
            rows[i][j] = rows[j][i] = take(f"I_{'xyz'[i]}{'xyz'[j]}", name, float(I[i, j]))
        body = self.bodies[name] = self.built.add_body(self.body_names.text(name), mass, rows, com)
        return body

    # -- joints

    def _coordinate(self, letters: str, joint: str) -> Coordinate:
        made: Coordinate = coordinates(self.names.symbol(f"{letters}_{joint}"))
        return made

    def _joint(self, joint: UrdfJoint, name: str, child: Body, following: dict[str, tuple[str, float, float]],
               moving: dict[str, str]) -> Joint:
        parent, at = self.bodies[joint.parent], joint.origin
        rows = rotation(at.rpy)
        point = [self.parameters.take(f"p_{axis}", joint.name, value) for axis, value in zip("xyz", at.xyz)]
        if joint.name not in moving:
            _, _, offset = following.get(joint.name, ("", 0.0, 0.0))
            return self._held(joint, name, child, point, offset)
        placed: dict[str, Any] = {"parent_point": point, "parent_rotation": _matrix(rows)}
        if joint.kind == "floating":
            return self._free(name, parent, child, **placed)
        if joint.kind == "planar":
            # Its x and y are along those of the joint's frame, turned by the smallest angle that makes z the normal.
            normal = _onto(joint.axis)
            placed["parent_rotation"] = _matrix((np.array(rows) @ np.array(normal)).tolist())
            result = [self._coordinate(letters, joint.name) for letters in ("x", "y", "theta")]
            return Planar(name, parent, child, result, child_rotation=_matrix(normal), **placed)
        kind = Prismatic if joint.kind == "prismatic" else Revolute
        return kind(name, parent, child, self._value(joint, following), axis=list(map(plain, joint.axis)), **placed)

    def _value(self, joint: UrdfJoint, following: dict[str, tuple[str, float, float]]) -> Any:
        """The coordinate of a joint, its own or an expression of another's."""
        if joint.name not in following:
            return self.coordinates[joint.name]
        source, multiplier, offset = following[joint.name]
        q = self.coordinates[source]
        if multiplier == 1 and offset == 0:
            return sp.UnevaluatedExpr(q)
        return plain(multiplier) * q + plain(offset)

    def _free(self, name: str, parent: Body, child: Body, **placed: Any) -> Free:
        result = [self._coordinate(letters, name) for letters in ("x", "y", "z", "e0", "e1", "e2", "e3")]
        return Free(name, parent, child, result, orientation=EulerParameters(), velocity="body", **placed)

    def _held(self, joint: UrdfJoint, name: str, child: Body, point: list[Any], value: float) -> Fixed:
        """The joint at rest where its coordinate has a value."""
        R = np.array(rotation(joint.origin.rpy))
        if value and joint.kind == "prismatic":
            shift = R @ np.array(joint.axis) * value
            point = [p + plain(s) for p, s in zip(point, shift.tolist())]
        elif value:
            R = R @ _turned(np.array(joint.axis), value)
        return Fixed(name, self.bodies[joint.parent], child, parent_point=point, parent_rotation=_matrix(R.tolist()))


def _matrix(rows: Iterable[Iterable[float]]) -> list[list[Any]]:
    return [[plain(value) for value in row] for row in rows]


def _turned(axis: np.ndarray, angle: float) -> np.ndarray:
    """(3, 3) about a unit axis."""
    x, y, z = axis
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * skew + (1 - math.cos(angle)) * skew @ skew


def _onto(axis: Sequence[float]) -> list[list[float]]:
    """The smallest rotation that takes z to an axis, (3, 3)."""
    x, y, z = axis
    if z < -1 + 1e-12:
        return [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]
    k = 1 / (1 + z)
    return [[1 - k * x * x, -k * x * y, x], [-k * x * y, 1 - k * y * y, y], [-x, -y, z]]
