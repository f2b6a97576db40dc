"""A System from an MJCF."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from symdyn.errors import ArgumentError, ModelError, ModelWarning
from symdyn.kinds import flag, text
from symdyn.mjcf.closures import Closures
from symdyn.mjcf.compiled import Compiled
from symdyn.mjcf.document import KIND
from symdyn.mjcf.forces import Forces
from symdyn.mjcf.left_out import LeftOut, examine
from symdyn.mjcf.pictures import draw
from symdyn.mjcf.start import set_start
from symdyn.mjcf.tree import Tree
from symdyn.model.system import System
from symdyn.shown import shown
from symdyn.urdf.document import as_path
from symdyn.urdf.read import patterns, system_name
from symdyn.urdf.values import FileFaults, nearest


def read_mjcf(path: str | Path, symbolic: str | Sequence[str] = (), name: str | None = None, fixed: str | Sequence[str] = (),
              leave_out: str | Sequence[str] = (), folder: str | Path | None = None, visuals: bool = False,
              keyframe: str | None = None) -> System:
    """The mechanism that a model of MuJoCo's describes: its bodies, joints, equality constraints, springs, tendons, actuators.

    path       of the file, or its text, which begins with "<"
    symbolic   what becomes a parameter instead of a number, the number of the file its default: names of parameters, of bodies,
               joints, tendons or actuators (all of theirs), with * and ?: m_BODY, c_x_BODY, I_xx_BODY about the centre of mass in
               the body's axes, p_x_BODY the body in its parent, a_x_JOINT the joint's anchor in its body, d_ damping, k_
               stiffness, J_ armature, gear_, kp_, kv_, gain_, tau_ACTUATOR, and g
    name       of the system; default: the model's
    fixed      names of joints, with * and ?, that are held where the file has them
    leave_out  what the motion is to do without: names of elements that are not built, and of what a warning reports otherwise,
               the kinds "contacts", "limits", "friction", "ranges", "inactive" and "mocap", with * and ?
    folder     that no file of the model may be outside of; default: that of the file
    visuals    whether bodies look in pictures as the geoms of the groups 0 to 2, each with 800 triangles at most
    keyframe   whose positions, speeds, activations and commands are the initial values, by its name; default: the one that
               `to_mjcf` writes, "initial", where there is one

    MuJoCo's own compiler resolves default classes, frames, orientations and inertias of geoms. Coordinates are MuJoCo's: q_JOINT
    of hinges and slides, e0_ ... e3_JOINT of balls, and before these x_, y_, z_JOINT of free joints; so are the speeds, and the
    initial state. Several joints of one body are connected by bodies without mass. Armature is a body on the ground that
    the coordinate moves. connect and weld become exact loops, couplings of joints and tendons exact constraints; in MuJoCo they
    are
    soft. Actuators are inputs called after them; those with a state have act_NAME.

    Raises ModelError that lists the faults with file and line: of the file, files outside of the folder, and what is not built:
    muscles, tendons around geoms, stiff balls, fluids, deformable bodies, plugins; ArgumentError for what is no path, no names;
    MissingExtra without mujoco or defusedxml. Warns (ModelWarning) of all that is left out: contacts, limits, friction, ranges of
    actuators. Source of the format: MuJoCo's XML reference.

    >>> text = '''<mujoco><worldbody><body name="bar"><joint name="hinge" axis="0 1 0" damping="0.1"/>
    ...           <geom type="capsule" fromto="0 0 0 0 0 -1" size="0.02" mass="2"/></body></worldbody>
    ...           <actuator><motor name="torque" joint="hinge"/></actuator></mujoco>'''
    >>> system = sd.read_mjcf(text, symbolic=["m_*", "g"])
    >>> system.check().coordinates, system.check().inputs
    ((q_hinge,), (torque,))
    """
    wanted, held, without = patterns(symbolic, "symbolic"), patterns(fixed, "fixed"), patterns(leave_out, "leave_out")
    flag(visuals, "visuals")
    if keyframe is not None:
        text(keyframe, "keyframe", "home")
    written = isinstance(path, str) and path.lstrip("\ufeff \t\r\n").startswith("<")
    given = path.lstrip("\ufeff \t\r\n").encode() if isinstance(path, str) and written else None
    taken = Path("text") if written else as_path(path, KIND)
    root = _folder(folder, None if written else taken.parent)
    faults = FileFaults(taken)
    if written and root is not None:
        taken = root / "text"
    model = Compiled(taken, root, faults, given)
    joints = [model.name("joint", j) for j in range(model.m.njnt)]
    faults += [f"{taken}: fixed has {shown(p)}, which fits no joint of the file{nearest(p, joints)}" for p in held
               if not any(fnmatchcase(j, p) for j in joints)]
    title = model.title or ("model" if written else taken.stem)
    system = System(system_name(title) if name is None else name)
    tree, out = Tree(model, system, wanted, held), LeftOut(model, without)
    examine(model, out)
    tree.build()
    forces = Forces(tree, out)
    forces.build()
    Closures(tree, forces).build()
    set_start(tree, keyframe)
    if visuals:
        draw(tree)
    system.set_defaults(tree.parameters.defaults)
    faults += [*tree.parameters.faults(), *out.faults()]
    if faults:
        raise ModelError(faults, title)
    report = out.report()
    if report:
        warnings.warn(f"{taken}: not taken over are {report}; add what matters, such as sd.Contact, sd.Stop or "
                      "sd.JointFriction, or "
                      "name it in leave_out", ModelWarning, stacklevel=2)
    return system


def _folder(folder: Any, default: Path | None) -> Path | None:
    if folder is None:
        return default
    result = as_path(folder, "the folder of an MJCF")
    if not result.is_dir():
        raise ArgumentError(f"folder is {shown(str(folder))}, which is no folder; pass one that holds all files of the model")
    return result
