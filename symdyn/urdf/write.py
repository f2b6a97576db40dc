"""A System as text in the Unified Robot Description Format."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import sympy as sp

from symdyn.errors import ModelError, ModelWarning
from symdyn.model.bodies import Body
from symdyn.model.joints import Fixed, Joint, Prismatic, Revolute
from symdyn.model.loads import JointForce
from symdyn.model.record import Model, joint_speeds
from symdyn.model.symbols import Coordinate, Input, symbols_of
from symdyn.shown import shown
from symdyn.urdf.angles import angles
from symdyn.urdf.document import as_path
from symdyn.urdf.parameters import Names
from symdyn.urdf.robot import GRAVITY

# Limits where a type of joint must have some, m or rad, N or N m, m/s or rad/s.
_UNLIMITED = "1e+09"


def urdf_text(model: Model) -> str:
    """The URDF of a checked model; see System.to_urdf. Raises ModelError with all that a URDF has no words for."""
    writer = _Writer(model)
    lines = writer.lines()
    if writer.faults:
        raise ModelError(writer.faults, model.name)
    gravity = writer.gravity()
    if gravity != (0.0, 0.0, -GRAVITY):
        warnings.warn(f"{model.name}: a URDF holds no gravity, and read_urdf takes {GRAVITY} m/s^2 along -z; here it is "
                      f"[{', '.join(f'{g:g}' for g in gravity)}]", ModelWarning, stacklevel=4)
    return "\n".join(lines) + "\n"


def write_urdf(model: Model, path: str | Path) -> Path:
    """Write `urdf_text` to a file; returns its path. Raises ModelError as that does, and where the file cannot be written,
    ArgumentError for a path that is none."""
    text, path = urdf_text(model), as_path(path)
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ModelError([f"{path}: the file cannot be written ({error.strerror})"], model.name) from None
    return path


class _Writer:
    def __init__(self, model: Model) -> None:
        self.model = model
        self.faults: list[str] = []
        self.numbers = {symbol: sp.Float(value) for symbol, value in model.defaults.items()}
        missing = [p.name for p in model.parameters if p not in model.defaults]
        if missing:
            self.faults.append(f"there is no number for {', '.join(missing)}; add them to the defaults: a URDF holds numbers")
        # Pose of each body's frame in that of its link, which sits at the joint.
        self.poses = {-1: (np.eye(3), np.zeros(3))}
        self.owners = {q: j for j in model.joints for q in j.coordinates if isinstance(q, Coordinate)}
        self.following: dict[str, tuple[str, float, float]] = {}
        self.damping: dict[str, float] = {}

    def lines(self) -> list[str]:
        model = self.model
        self._expressible()
        if self.faults:
            return []
        joints = list(zip(model.joints, model.parents, model.children, strict=True))
        grounded = [(j, c) for j, p, c in joints if p == -1]
        root = grounded[0][1] if len(grounded) == 1 and self._at_rest(grounded[0][0]) else None
        links = {k: body.name for k, body in enumerate(model.bodies)}
        links[-1] = Names(links.values()).text("world") if root is None else links[root]
        lines = ['<?xml version="1.0"?>', f"<robot name={quoteattr(model.name)}>"]
        if root is None:
            lines.append(f"  <link name={quoteattr(links[-1])}/>")
        for joint, parent, child in joints:
            if child == root:
                self.poses[child] = self.poses[-1]
            else:
                lines += self._joint(joint, parent, child, links)
            lines += self._link(model.bodies[child], child)
        return [*lines, "</robot>"]

    # -- what there are words for

    def _expressible(self) -> None:
        model, faults = self.model, self.faults
        for what, given in (("closed loops", [j.name for j in model.loops]), ("constraints", [c.name for c in model.constraints]),
                            ("extra states", [z.symbol.name for z in model.states]),
                            ("events", [e.name for e in model.events]),
                            ("a moving ground", ["ground"] if model.ground_motion is not None else [])):
            if given:
                faults.append(f"it has {what} ({', '.join(given)}); a URDF is a tree of links and joints alone")
        for joint in model.joints:
            if not isinstance(joint, (Fixed, Revolute, Prismatic)):
                faults.append(f"joint {shown(joint.name)} is {joint.kind}; what is written is fixed, revolute or prismatic")
            elif not isinstance(joint, Fixed) and joint.coordinates[0] not in self.owners:
                self._follow(joint)
        for load in model.loads:
            if isinstance(load, JointForce):
                self._damp(load)
            else:
                faults.append(f"{load.label} is a load; a URDF holds none but the damping of joints: leave it out")

    def _follow(self, joint: Joint) -> None:
        """Note the joint whose coordinate a joint's is a multiple of, the multiplier and the offset."""
        q = joint.coordinates[0].doit().xreplace(self.numbers)
        sources = sorted(symbols_of(q), key=str)
        slope = q.diff(sources[0]) if len(sources) == 1 else sp.nan
        if not slope.is_number or sources[0] not in self.owners or slope is sp.nan:
            self.faults.append(f"joint {shown(joint.name)} has the coordinate {joint.coordinates[0]}; what is written is a "
                               "coordinate "
                               "of its own, or a multiple of another joint's plus a number")
            return
        self.following[joint.name] = self.owners[sources[0]].name, float(slope), float(q.xreplace({sources[0]: sp.S.Zero}))

    def _damp(self, load: JointForce) -> None:
        """Note the damping, N m s/rad or N s/m, that a load is; drives by inputs are no part of a URDF."""
        joint = next(j for j in self.model.joints if load.joint in (j, j.name))
        rate = next(iter(joint_speeds(joint)), None)
        value = sp.expand(load.values[0].xreplace(self.numbers)) if len(load.values) == 1 else sp.nan
        d = sp.S.Zero if rate is None else -value.diff(rate)
        rest = value if rate is None else sp.expand(value + d * rate)
        drives = rest == 0 or (symbols_of(rest) and all(isinstance(a, Input) for a in symbols_of(rest)))
        if value is sp.nan or not d.is_number or d < 0 or not drives:
            self.faults.append(f"{load.label} on joint {shown(joint.name)} is {', '.join(map(str, load.values))}; a URDF holds "
                               "no "
                               "loads but viscous damping: leave it out")
            return
        self.damping[joint.name] = self.damping.get(joint.name, 0.0) + float(d)

    def gravity(self) -> tuple[float, ...]:
        """As numbers, m/s^2."""
        return tuple(self._array(self.model.gravity).ravel().tolist())

    # -- elements

    def _link(self, body: Body, number: int) -> Iterator[str]:
        R, p = self.poses[number]
        mass, com, I = self._number(body.mass), self._array(body.com).ravel(), self._array(body.inertia)
        if mass == 0 and not I.any():
            yield f"  <link name={quoteattr(body.name)}/>"
            return
        entries = " ".join(f'i{"xyz"[i]}{"xyz"[j]}="{_text(I[i, j])}"' for i in range(3) for j in range(i, 3))
        yield from (f"  <link name={quoteattr(body.name)}>", "    <inertial>", f"      {_origin(R, p + R @ com)}",
                    f'      <mass value="{_text(mass)}"/>', f"      <inertia {entries}/>", "    </inertial>", "  </link>")

    def _joint(self, joint: Joint, parent: int, child: int, links: dict[int, str]) -> Iterator[str]:
        R, p = self.poses[parent]
        origin = _origin(R @ self._array(joint.parent_rotation), p + R @ self._array(joint.parent_point).ravel())
        back = self._array(joint.child_rotation).T
        self.poses[child] = back, -(back @ self._array(joint.child_point).ravel())
        follows = self.following.get(joint.name)
        # A joint without limits is an angle on the circle to some readers, which cannot follow or be followed.
        bound = follows is not None or any(source == joint.name for source, _, _ in self.following.values())
        kind = {Fixed: "fixed", Prismatic: "prismatic"}.get(type(joint), "revolute" if bound else "continuous")
        yield f'  <joint name={quoteattr(joint.name)} type="{kind}">'
        yield f"    {origin}"
        yield f"    <parent link={quoteattr(links[parent])}/>"
        yield f"    <child link={quoteattr(links[child])}/>"
        if kind != "fixed":
            axis: Any = joint
            yield f'    <axis xyz="{_texts(self._array(axis.axis).ravel())}"/>'
        if kind in ("revolute", "prismatic"):
            yield (f'    <limit lower="-{_UNLIMITED}" upper="{_UNLIMITED}" effort="{_UNLIMITED}" velocity="{_UNLIMITED}"/>')
        if self.damping.get(joint.name):
            yield f'    <dynamics damping="{_text(self.damping[joint.name])}"/>'
        if follows is not None:
            source, multiplier, offset = follows
            yield f'    <mimic joint={quoteattr(source)} multiplier="{_text(multiplier)}" offset="{_text(offset)}"/>'
        yield "  </joint>"

    def _at_rest(self, joint: Joint) -> bool:
        """Whether a joint fixes a body where its parent is."""
        turned = [m for m in (joint.parent_rotation, joint.child_rotation) if (self._array(m) != np.eye(3)).any()]
        return isinstance(joint, Fixed) and not turned and not any(joint.parent_point) and not any(joint.child_point)

    # -- numbers

    def _number(self, e: Any) -> float:
        return float(e.xreplace(self.numbers))

    def _array(self, matrix: Any) -> np.ndarray:
        return np.array([[self._number(e) for e in row] for row in sp.Matrix(matrix).tolist()])


def _origin(R: np.ndarray, p: np.ndarray) -> str:
    first, second, third = ((float(x), float(y), float(z)) for x, y, z in R)
    return f'<origin xyz="{_texts(p)}" rpy="{_texts(angles((first, second, third)))}"/>'


def _texts(values: Any) -> str:
    return " ".join(map(_text, values))


def _text(value: float) -> str:
    """A number that reads back to the last bit."""
    return repr(float(value) + 0.0)
