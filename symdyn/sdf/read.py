"""A System from a file in SDFormat."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import ArgumentError, ModelError, ModelWarning
from symdyn.kinds import flag
from symdyn.model.bodies import Body
from symdyn.model.joints import Fixed, Free, Joint, Prismatic, Revolute, Spherical, Universal
from symdyn.model.orientation import EulerParameters
from symdyn.model.symbols import Coordinate, coordinates
from symdyn.model.system import System
from symdyn.sdf.frames import WORLD
from symdyn.sdf.model import Parser, SdfJoint, SdfModel
from symdyn.sdf.values import KIND, Values
from symdyn.sdf.visuals import Visuals
from symdyn.shown import shown
from symdyn.urdf.document import as_path, read_document
from symdyn.urdf.parameters import Names, Parameters, plain
from symdyn.urdf.poses import Pose
from symdyn.urdf.read import patterns, system_name
from symdyn.urdf.robot import INERTIA
from symdyn.urdf.values import nearest

ROOTS = ("file", "fixed", "floating")
LEFT_OUT = ("contacts", "limits", "friction", "plugins")
_SHOWN = 4


def read_sdf(path: str | Path, symbolic: str | Sequence[str] = (), root: str = "file", name: str | None = None,
             fixed: str | Sequence[str] = (), leave_out: str | Sequence[str] = (), visuals: bool = False,
             folder: str | Path | None = None) -> System:
    """The mechanism that a model in SDFormat describes, versions 1.4 to 1.12: of the file, or of its one world.

    symbolic   what becomes a parameter instead of a number, the number of the file its default: m_LINK, c_x_LINK, I_xx_LINK,
               p_x_JOINT the joint in its parent, d_JOINT, k_JOINT, g, links or joints (all of theirs), with * and ?
    root       "file": a link that no joint carries moves freely, as in simulators, unless the model is static; "fixed": it is
               held where the file has it; "floating": the first one moves freely even so
    name       of the system; default: the model's
    fixed      names of joints, with * and ?, that are held where their coordinates are zero
    leave_out  what no warning is to report: "contacts", "limits", "friction", "plugins", with * and ?
    visuals    whether bodies look in pictures as <visual> draws them: boxes, spheres, ellipsoids, cylinders, capsules, cones and
               meshes (STL, OBJ, DAE, read by trimesh), each with 800 triangles at most, in the diffuse colour of <material>, or
               those of a DAE's own materials; planes are left out
    folder     that no mesh may be outside of, and where model:// begins; default: that of the file

    Poses may be relative to links, joints, nested models and frames, axes expressed in them. Bodies are the links; those of
    nested models are called inner::link. Coordinates are q_JOINT (universal: q_JOINT_1, q_JOINT_2; ball: e0_ ... e3_JOINT;
    free: x_,
    y_, z_, e0_ ... e3_LINK, which start at the link's pose). A second joint that carries a link closes a loop, exactly. Joints
    that
    mimic have no coordinate of their own. Damping and springs of axes are forces; a link without <inertial> has 1 kg and 1 kg
    m^2, and the world without <gravity> 9.8 m/s^2 along -z, as the format has it.

    Raises ModelError that lists every fault of the file with its line: of values, of frames, screws and gearboxes, files that are
    brought in; ArgumentError for arguments; MissingExtra without defusedxml, with meshes without trimesh. Warns (ModelWarning) of
    collisions, limits, friction and plugins. Source of the format: sdformat.org, specification and "Pose frame semantics".

    >>> import tempfile, pathlib
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "bar.sdf"
    >>> _ = file.write_text('''<sdf version="1.9"><model name="bar"><link name="bar"><pose>0 0 1 0 0 0</pose></link>
    ... <joint name="hinge" type="revolute"><parent>world</parent><child>bar</child><pose>0 0 0.5 0 0 0</pose>
    ... <axis><xyz>0 1 0</xyz></axis></joint></model></sdf>''')
    >>> sd.read_sdf(file, symbolic="m_*").embedding().M_tilde
    Matrix([[m_bar/4 + 1]])
    """
    wanted, held, silent = patterns(symbolic, "symbolic"), patterns(fixed, "fixed"), patterns(leave_out, "leave_out")
    flag(visuals, "visuals")
    if not isinstance(root, str) or root not in ROOTS:
        raise ArgumentError(f"root is {shown(root)}; pass 'file', 'fixed' or 'floating'")
    taken = as_path(path, KIND)
    document = read_document(taken, KIND)
    faults = Values(taken)
    model = Parser(faults).parse(document)
    faults += [f"{taken}: fixed has {shown(p)}, which fits no joint of the file{nearest(p, model.joints)}" for p in held
               if not any(fnmatchcase(j, p) for j in model.joints)]
    faults += [f"{taken}: leave_out has {shown(p)}; there are {', '.join(LEFT_OUT)}" for p in silent
               if not any(fnmatchcase(kind, p) for kind in LEFT_OUT)]
    if faults:
        raise ModelError(faults, model.name)
    builder = _Builder(model, faults, system_name(model.name or taken.stem) if name is None else name, wanted, held)
    system = builder.system(root)
    faults += builder.parameters.faults()
    if visuals:
        inside = taken.parent if folder is None else as_path(folder, "the folder of an SDF")
        Visuals(faults, inside).draw(model, builder.bodies, system)
    if faults:
        raise ModelError(faults, model.name)
    _report(model, silent, taken)
    return system


def _report(model: SdfModel, silent: Sequence[str], path: Path) -> None:
    parts = []
    for kind, listed in model.left.items():
        if not any(fnmatchcase(kind, p) for p in silent):
            more = f" and {len(listed) - _SHOWN} more" if len(listed) > _SHOWN else ""
            parts.append(f"{kind} of {', '.join(f'{shown(owner)} (line {line})' for owner, line in listed[:_SHOWN])}{more}")
    if parts:
        warnings.warn(f"{path}: not taken over are {'; '.join(parts)}; add what matters, such as sd.Contact, sd.Stop or "
                      "sd.JointFriction, or name it in leave_out", ModelWarning, stacklevel=3)


class _Builder:
    """Describes a model whose elements have no faults."""

    def __init__(self, model: SdfModel, faults: Values, name: str, wanted: Sequence[str], held: Sequence[str]) -> None:
        self.model, self.faults, self.held = model, faults, held
        self.names = Names({"t"})
        self.parameters = Parameters(wanted, self.names)
        self.built = System(name)
        self.bodies: dict[str, Body] = {WORLD: self.built.ground}
        self.body_names, self.joint_names = Names({"ground"}), Names()
        self.coordinates: dict[str, Coordinate] = {}
        self.taken: dict[str, str] = {}

    def system(self, root: str) -> System:
        model, system = self.model, self.built
        ends = {j.name: [model.frames.body(end, j.line, f"joint {shown(j.name)}") for end in (j.parent, j.child)]
                for j in model.joints.values()}
        for link in model.links.values():
            model.frames.pose(link.name, link.line, f"link {shown(link.name)}")
        if self.faults:
            return system
        along = np.count_nonzero(model.gravity) == 1
        value = self.parameters.gravity(max(map(abs, model.gravity))) if along else 0
        system.gravity = system._faults.vector(
            [(-value if g < 0 else value if g > 0 else 0) if along else plain(g) for g in model.gravity], "gravity")
        for joint in model.joints.values():
            if len(joint.axes) == 1 and joint.axes[0].mimic is None and not self._still(joint):
                self.coordinates[joint.name] = coordinates(self.names.symbol(f"q_{joint.name}"))
        for name in model.links:
            self._body(name)
        carrying: dict[str, SdfJoint] = {}
        for joint in model.joints.values():
            if ends[joint.name][1] == WORLD:
                self.faults.at(joint.line, f"joint {shown(joint.name)} has the child world; make the world its parent")
            carrying.setdefault(ends[joint.name][1], joint)
        if self.faults:
            return system
        reached, loops = {WORLD}, [j for j in model.joints.values() if carrying[ends[j.name][1]] is not j]
        for name in model.links:
            if name not in carrying:
                self._root(name, root)
                reached.add(name)
        while True:
            result = next((j for link, j in carrying.items() if link not in reached and ends[j.name][0] in reached), None)
            if result is None:
                break
            self._join(result, ends[result.name], loop=False)
            reached.add(ends[result.name][1])
        left = [j for link, j in carrying.items() if link not in reached]
        if left:
            self.faults.at(left[0].line, f"joints {', '.join(shown(j.name) for j in left)} hang on each other in a circle; "
                                         "join one of their "
                                         "links to the world or to the rest")
            return system
        for joint in loops:
            self._join(joint, ends[joint.name], loop=True)
        system.set_defaults(self.parameters.defaults)
        return system

    def _still(self, joint: SdfJoint) -> bool:
        return joint.kind == "fixed" or any(fnmatchcase(joint.name, p) for p in self.held)

    # -- links

    def _body(self, name: str) -> None:
        link, take = self.model.links[name], self.parameters.take
        mass = take("m", name, link.mass)
        com = [take(f"c_{axis}", name, float(v)) for axis, v in zip("xyz", link.center.p)]
        I = np.zeros((3, 3))
        for tag, value in zip(INERTIA, link.inertia, strict=True):
            i, k = "xyz".index(tag[1]), "xyz".index(tag[2])
            I[i, k] = I[k, i] = value
        least = float(np.linalg.eigvalsh(I)[0])
        if least < -1e-12 * np.abs(I).max():
            self.faults.at(link.line, f"link {shown(name)}: its inertia has the principal moment {least:.4g} kg m^2, which is "
                                      "negative; "
                                      "give the inertia about the centre of mass")
        if (np.eye(3) != link.center.R).any():
            I = link.center.R @ I @ link.center.R.T
        rows: list[list[Any]] = [[0] * 3 for _ in range(3)]
        for i, k in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
            rows[i][k] = rows[k][i] = take(f"I_{'xyz'[i]}{'xyz'[k]}", name, float(I[i, k]))
        body = self.bodies[name] = self.built.add_body(self.body_names.text(name), mass, rows, com)
        if not link.weight:
            self.built.add_force(body, [-body.mass * g for g in self.built.gravity], name=f"weight of {body.name}")

    def _root(self, name: str, root: str) -> None:
        """A link that no joint carries, at its pose in the world."""
        pose = self.model.pose @ self.model.frames.pose(name, 0, name)
        free = root == "floating" or (root == "file" and not self.model.static)
        label, body = self.joint_names.text(f"{name} root"), self.bodies[name]
        if not free:
            self.built.add_joint(Fixed(label, self.built.ground, body, parent_point=_plain(pose.p),
                                       parent_rotation=_rows(pose.R)))
            return
        result = [self._coordinate(letters, name) for letters in ("x", "y", "z", "e0", "e1", "e2", "e3")]
        self.built.add_joint(Free(label, self.built.ground, body, result, orientation=EulerParameters(), velocity="body"))
        self.built.initial.update(zip(result, [*map(float, pose.p), *map(float, pose.quaternion)], strict=True))

    # -- joints

    def _coordinate(self, letters: str, owner: str) -> Coordinate:
        made: Coordinate = coordinates(self.names.symbol(f"{letters}_{owner}"))
        return made

    def _join(self, joint: SdfJoint, carried: list[str], loop: bool) -> None:
        parent, child = carried
        frames, what = self.model.frames, f"joint {shown(joint.name)}"
        if parent == WORLD:
            on_parent = self.model.pose @ frames.pose(joint.name, joint.line, what)
        else:
            on_parent = frames.between(parent, joint.name, joint.line, what)
        on_child = frames.between(child, joint.name, joint.line, what)
        point = _plain(on_parent.p) if loop else [self.parameters.take(f"p_{axis}", joint.name, float(v))
                                                  for axis, v in zip("xyz", on_parent.p)]
        placed: dict[str, Any] = {"parent_point": point, "parent_rotation": _rows(on_parent.R), "child_point": _plain(on_child.p),
                                  "child_rotation": _rows(on_child.R)}
        label, ends = self.joint_names.text(joint.name), (self.bodies[parent], self.bodies[child])
        made = self._made(joint, label, ends, placed, loop)
        if made is None:
            return
        if loop:
            self.built.close_loop(made)
        else:
            self.built.add_joint(made)
            self._forces(joint, made)

    def _made(self, joint: SdfJoint, label: str, ends: tuple[Body, Body], placed: dict[str, Any], loop: bool) -> Joint | None:
        frames, what = self.model.frames, f"joint {shown(joint.name)}"
        if self._still(joint):
            return Fixed(label, *ends, **placed)
        axes = []
        for axis in joint.axes:
            turned = axis.xyz
            if axis.frame != joint.name:
                turned = frames.between(joint.name, axis.frame, axis.line, what).R @ turned
            axes.append([plain(float(v)) for v in np.where(np.abs(turned) < 1e-15, 0.0, turned)])
        if joint.kind == "ball":
            if loop:
                return Spherical(label, *ends, **placed)
            own = [self._coordinate(f"e{k}", joint.name) for k in range(4)]
            return Spherical(label, *ends, own, EulerParameters(), **placed)
        if len(axes) == 2:
            if np.linalg.norm(np.cross(np.array(axes[0], dtype=float), np.array(axes[1], dtype=float))) < 1e-9:
                self.faults.at(joint.line, f"{what} has two parallel axes; give axes at an angle, or one revolute joint")
                return None
            pair = None if loop else [self._coordinate("q", f"{joint.name}_{k}") for k in (1, 2)]
            return Universal(label, *ends, pair, axes=axes, **placed)
        kind = Prismatic if joint.kind == "prismatic" else Revolute
        if loop:
            return kind(label, *ends, axis=axes[0], **placed)
        value = self._value(joint)
        return None if value is None else kind(label, *ends, value, axis=axes[0], **placed)

    def _value(self, joint: SdfJoint) -> Any:
        """The coordinate of a joint, its own or an expression of another's: multiplier (q - reference) + offset."""
        if joint.name in self.coordinates:
            return self.coordinates[joint.name]
        assert joint.axes[0].mimic is not None
        source, multiplier, offset, reference = joint.axes[0].mimic
        if source not in self.coordinates:
            self.faults.at(joint.axes[0].line, f"joint {shown(joint.name)} mimics {shown(source)}, which has no coordinate of "
                                               "its own"
                                               f"{nearest(source, self.coordinates)}; name a revolute or prismatic joint that "
                                               "moves")
            return None
        return sp.UnevaluatedExpr(self.coordinates[source]) if (multiplier, offset, reference) == (1, 0, 0) else (
            plain(multiplier) * (self.coordinates[source] - plain(reference)) + plain(offset))

    def _forces(self, joint: SdfJoint, made: Joint) -> None:
        """Damping and springs of the axes."""
        if isinstance(made, Fixed) or not joint.axes or not all(isinstance(q, Coordinate) for q in made.coordinates):
            return
        values = []
        for axis, q in zip(joint.axes, made.coordinates, strict=True):
            force = sp.S.Zero
            if axis.damping:
                force -= self.parameters.take("d", joint.name, axis.damping) * q.dot
            if axis.stiffness:
                force -= self.parameters.take("k", joint.name, axis.stiffness) * (q - plain(axis.reference))
            values.append(force)
        if any(v != 0 for v in values):
            self.built.add_joint_force(made, values, name=f"spring and damper of {made.name}")


def _plain(values: Any) -> list[Any]:
    return [plain(float(v)) for v in values]


def _rows(R: np.ndarray) -> list[list[Any]]:
    return [_plain(row) for row in Pose(R).rounded().R]
