"""A System as text in MuJoCo's format."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import sympy as sp

from symdyn.errors import ModelError, ModelWarning
from symdyn.mjcf.document import KIND, START
from symdyn.mjcf.equalities import Equalities
from symdyn.mjcf.parts import Numbers, Scalar, pose_of, scalars_of
from symdyn.model.joints import Fixed, Free, Joint, Prismatic, Revolute, Spherical
from symdyn.model.loads import ForceBetween, JointForce, SpringDamper
from symdyn.model.record import Model, joint_speeds
from symdyn.model.symbols import Coordinate, Input, symbols_of
from symdyn.shown import shown
from symdyn.urdf.document import as_path
from symdyn.urdf.poses import Pose

# Moments of inertia below this MuJoCo rejects, kg m^2, and masses, kg.
_LEAST = 1e-15
# Moments of inertia that point masses are given, kg m^2.
_POINT = 1e-14


def mjcf_text(model: Model) -> str:
    """The MJCF of a checked model; see System.to_mjcf. Raises ModelError with all that it has no words for."""
    writer = _Writer(model)
    lines = list(writer.lines())
    if writer.faults:
        raise ModelError(writer.faults, model.name)
    if writer.points:
        warnings.warn(f"{model.name}: MuJoCo moves no body without moments of inertia; the point masses "
                      f"{', '.join(writer.points)} are "
                      f"written with {_POINT:g} kg m^2", ModelWarning, stacklevel=4)
    return "\n".join(lines) + "\n"


def write_mjcf(model: Model, path: str | Path) -> Path:
    """Write `mjcf_text` to a file; returns its path. Raises ModelError as that does, and where the file cannot be written,
    ArgumentError for a path that is none."""
    text, taken = mjcf_text(model), as_path(path, KIND)
    try:
        taken.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ModelError([f"{taken}: the file cannot be written ({error.strerror})"], model.name) from None
    return taken


class _Writer:
    def __init__(self, model: Model) -> None:
        self.model = model
        self.faults: list[str] = []
        self.numbers = Numbers(model, self.faults)
        self.below: dict[int, list[int]] = {}
        for k, parent in enumerate(model.parents):
            self.below.setdefault(parent, []).append(k)
        self.scalars: dict[str, Scalar] = {}
        self.sites: dict[int, list[str]] = {}
        self.armature: dict[str, float] = {}
        self.damping: dict[str, float] = {}
        self.springs: dict[str, tuple[float, float]] = {}
        self.tendons: list[str] = []
        self.actuators: list[str] = []
        self.rotors: set[int] = set()
        self.points: list[str] = []
        # Values of the keyframe, in MuJoCo's order, which is that of the text.
        self.q_start: list[float] = []
        self.u_start: list[float] = []
        self.commands: list[str] = []

    def lines(self) -> Iterator[str]:
        model = self.model
        self._expressible()
        if self.faults:
            return
        for k, joint in enumerate(model.joints):
            for scalar in scalars_of(joint, self.numbers, k):
                self.scalars[scalar.name] = scalar
        self.owners = {s.coordinate: s for s in self.scalars.values() if isinstance(s.coordinate, Coordinate)}
        self._find_rotors()
        for load in model.loads:
            self._load(load)
        equalities = Equalities(model, self.numbers, self.owners, self.faults, self._site)
        closing = [*equalities.lines([s for s in self.scalars.values() if s.joint not in self.rotors])]
        tree = list(self._world())
        yield from (f"<mujoco model={quoteattr(model.name)}>", '  <compiler angle="radian" autolimits="false"/>',
                    f'  <option gravity="{self.numbers.texts(model.gravity)}"/>', "  <worldbody>")
        yield from (f"    {line}" for line in [*self.sites.get(-1, ()), *tree])
        yield "  </worldbody>"
        for tag, listed in (("tendon", self.tendons), ("equality", closing), ("actuator", self.actuators)):
            if listed:
                yield from (f"  <{tag}>", *(f"    {line}" for line in listed), f"  </{tag}>")
        if self.model.initial:
            yield from ("  <keyframe>", f"    {self._keyframe()}", "  </keyframe>")
        yield "</mujoco>"

    # -- the start

    def _keyframe(self) -> str:
        given = {symbol.name: value for symbol, value in self.model.initial.items()}
        ctrl = [given.get(name, 0.0) for name in self.commands]
        listed = [("qpos", self.q_start), ("qvel", self.u_start), ("ctrl", ctrl)]
        texts = [f' {what}="{self.numbers.texts(values)}"' for what, values in listed if values]
        return f'<key name="{START}"{"".join(texts)}/>'

    def _starts(self, joint: Joint, symbols: Sequence[Any], speeds: Sequence[Any]) -> None:
        """Note what a joint starts with; a coordinate may be an expression of others, whose rate follows from theirs."""
        model = self.model
        rates = [q.dot for q in model.coordinates if isinstance(q, Coordinate)]
        values = {**self.numbers.values, **dict.fromkeys([*model.coordinates, *rates, *model.speeds], sp.S.Zero),
                  **{symbol: sp.Float(value) for symbol, value in model.initial.items()}}
        if len(symbols) != len(speeds):  # a quaternion, perhaps after a position
            self.q_start += [float(values[q]) for q in symbols]
            self.u_start += [float(values[u]) for u in speeds]
            return
        for q, u in zip(symbols, speeds, strict=True):
            position = sp.sympify(q, strict=True)
            rate = sum((position.diff(s) * s.dot for s in symbols_of(q) if isinstance(s, Coordinate)), sp.S.Zero)
            self.q_start.append(float(position.xreplace(values)))
            self.u_start.append(float(rate.xreplace(values)))
            if u is not None and u != rate and values.get(u):
                self.faults.append(f"joint {shown(joint.name)} starts with the speed {u}, which is not the rate of a coordinate; "
                                   "MJCF has rates: leave it out of the initial values")

    def _expressible(self) -> None:
        model = self.model
        for what, given in (("extra states", [z.symbol.name for z in model.states]), ("events", [e.name for e in model.events]),
                            ("a moving ground", ["ground"] if model.ground_motion is not None else []),
                            ("chosen speeds", [u.name for u, _ in model.chosen]),
                            ("contacts", [getattr(c, "name", "contact")
                                          for c in (*model.contacts, *model.compliant, *model.groups)])):
            if given:
                self.faults.append(f"it has {what} ({', '.join(map(str, given))}), which are not written as MJCF; leave them out")
        known = (Fixed, Free, Spherical)
        for joint in model.joints:
            if not isinstance(joint, known) and joint.kind not in ("revolute", "prismatic", "universal", "planar", "cylindrical"):
                self.faults.append(f"joint {shown(joint.name)} is {joint.kind}, which MJCF has no joint for; describe it by "
                                   f"fixed, "
                                   "revolute, prismatic, universal, planar, cylindrical, spherical or free joints")

    # -- armature

    def _find_rotors(self) -> None:
        """Bodies on the ground that a coordinate of another joint moves, which are armature of that."""
        named = {getattr(getattr(load, part, None), "name", getattr(load, part, None)) for load in self.model.loads
                 for part in ("body", "body_a", "body_b", "joint")}
        for k, joint in enumerate(self.model.joints):
            child = self.model.children[k]
            body = self.model.bodies[child]
            if not isinstance(joint, (Revolute, Prismatic)) or self.model.parents[k] != -1 or self.below.get(child) or \
                    isinstance(joint.coordinates[0], Coordinate) or {body.name, joint.name} & named:
                continue
            result = self.numbers.multiple(joint.coordinates[0], self.owners)
            axis = self.numbers.array(joint.axis).ravel()
            com = self.numbers.array(body.com).ravel() - self.numbers.array(joint.child_point).ravel()
            if result is None or (isinstance(joint, Revolute) and np.cross(com, axis).any()):
                continue
            if isinstance(joint, Prismatic):
                world = self.numbers.array(joint.parent_rotation) @ axis
                if abs(world @ self.numbers.array(self.model.gravity).ravel()) > 1e-12:
                    continue
                inertia = self.numbers.value(body.mass)
            else:
                turned = self.numbers.array(joint.child_rotation) @ axis
                inertia = float(turned @ self.numbers.array(body.inertia) @ turned)
            source, factor, _ = result
            self.armature[source.name] = self.armature.get(source.name, 0.0) + inertia * factor**2
            self.rotors.add(k)

    # -- bodies

    def _world(self) -> Iterator[str]:
        for k in self.below.get(-1, ()):
            if k not in self.rotors:
                yield from self._body(k)

    def _body(self, first: int) -> Iterator[str]:
        """A body with its joints, of which those on bodies without mass are taken together, and all that hangs on it."""
        chain = self._chain(first)
        body = self.model.children[chain[-1]]
        poses = [pose_of(self.model.joints[k], self.numbers) for k in chain]
        # Pose of the last frame of the chain in each child's, where all coordinates are zero.
        outer = [Pose()]
        for pose in reversed(poses[1:]):
            outer.append(pose @ outer[-1])
        outer.reverse()
        whole = poses[0] @ outer[0]
        name = self.model.bodies[body].name
        at = f'pos="{self.numbers.texts(whole.p)}" quat="{self.numbers.texts(whole.quaternion)}"'
        yield f"<body name={quoteattr(name)} {at}>"
        yield f"  {self._inertial(body)}"
        for k, after in zip(chain, outer, strict=True):
            yield from (f"  {line}" for line in self._joints(self.model.joints[k], after, whole))
        yield from (f"  {line}" for line in self.sites.get(body, ()))
        for k in self.below.get(body, ()):
            if k not in self.rotors:
                yield from (f"  {line}" for line in self._body(k))
        yield "</body>"

    def _chain(self, first: int) -> list[int]:
        chain = [first]
        while True:
            body = self.model.children[chain[-1]]
            below = self.below.get(body, [])
            moving = not isinstance(self.model.joints[chain[-1]], Fixed)
            of = self.model.bodies[body]
            light = self.numbers.value(of.mass) == 0 and not self.numbers.array(of.inertia).any()
            if not (moving and light and len(below) == 1 and body not in self.sites) or isinstance(
                    self.model.joints[below[0]], (Fixed, Free)):
                return chain
            chain.append(below[0])

    def _inertial(self, number: int) -> str:
        body = self.model.bodies[number]
        mass, I = self.numbers.value(body.mass), self.numbers.array(body.inertia)
        if self.model.planar:  # about axes that do not turn, the moments are of no account
            I = np.eye(3) * I[2, 2]
        moving = not isinstance(self.model.joints[self.model.children.index(number)], Fixed)
        least = float(np.linalg.eigvalsh(I)[0])
        if moving and mass > 0 and not I.any():
            self.points.append(body.name)
            I, least = _POINT * np.eye(3), _POINT
        if moving and (mass < _LEAST or least < _LEAST):
            self.faults.append(f"body {shown(body.name)} has the mass {mass:g} kg and the least moment of inertia {least:g} kg "
                               f"m^2; "
                               "MuJoCo moves no body without either: give it some, however small")
        moments = np.linalg.eigvalsh(I)
        if moments[2] > (moments[0] + moments[1]) * (1 + 1e-9):
            self.faults.append(f"body {shown(body.name)} has the principal moments {', '.join(f'{v:g}' for v in moments)} kg "
                               f"m^2, the "
                               "largest more than the sum of the others, which MuJoCo rejects; no real body has them")
        entries = [I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]]
        about = f'diaginertia="{self.numbers.texts(entries[:3])}"' if not any(entries[3:]) else \
            f'fullinertia="{self.numbers.texts(entries)}"'
        return f'<inertial pos="{self.numbers.texts(body.com)}" mass="{self.numbers.text(mass)}" {about}/>'

    # -- joints

    def _joints(self, joint: Joint, after: Pose, whole: Pose) -> Iterator[str]:
        """after: pose of the file's body in the joint's child."""
        if isinstance(joint, Fixed):
            return
        back = after.inverse()
        anchor = back.point(self.numbers.array(joint.child_point).ravel())
        R = back.R @ self.numbers.array(joint.child_rotation)
        parts = [s for s in self.scalars.values() if self.model.joints[s.joint] is joint]
        if parts:
            for s in parts:
                self._starts(joint, [s.coordinate], [s.speed])
                more = self._attributes(s.name)
                yield (f'<joint name={quoteattr(s.name)} type="{s.kind}" pos="{self.numbers.texts(anchor)}" '
                       f'axis="{self.numbers.texts(R @ s.axis)}"{more}/>')
            return
        self._starts(joint, joint.coordinates, joint_speeds(joint))
        if isinstance(joint, Free):
            still = np.abs(whole.R - np.eye(3)).max() + np.abs(whole.p).max()
            if still > 0 or self.model.parents[self.model.joints.index(joint)] != -1:
                self.faults.append(f"joint {shown(joint.name)} is free and its frames are not those of the ground and of the "
                                   f"body; MJCF "
                                   "has no others: leave out its points and rotations")
            yield f'<joint name={quoteattr(joint.name)} type="free"{self._attributes(joint.name)}/>'
            return
        if np.abs(R - np.eye(3)).max() > 0:
            self.faults.append(f"joint {shown(joint.name)} is spherical and its frame on the child is turned; MJCF has "
                               f"quaternions in the "
                               "body's axes: leave out its child_rotation")
        yield (f'<joint name={quoteattr(joint.name)} type="ball" pos="{self.numbers.texts(anchor)}"'
               f"{self._attributes(joint.name)}/>")

    def _attributes(self, name: str) -> str:
        listed = [("armature", self.armature.get(name, 0.0)), ("damping", self.damping.get(name, 0.0))]
        stiffness, reference = self.springs.get(name, (0.0, 0.0))
        listed += [("stiffness", stiffness), ("springref", reference)]
        return "".join(f' {what}="{self.numbers.text(value)}"' for what, value in listed if value)

    # -- loads

    def _load(self, load: Any) -> None:
        if isinstance(load, JointForce):
            joint = next(j for j in self.model.joints if load.joint in (j, j.name))
            parts = [s for s in self.scalars.values() if self.model.joints[s.joint] is joint]
            if not parts:
                self._on_several(load, joint)
                return
            for s, value in zip(parts, load.values, strict=True):
                self._on_scalar(load, s, value)
        elif isinstance(load, SpringDamper):
            self._tendon(load, [load.stiffness, load.damping, load.length], None)
        elif isinstance(load, ForceBetween):
            self._tendon(load, [], load.force)
        else:
            self.faults.append(f"{load.label} is a load that MJCF has no words for; leave it out (written are forces along "
                               f"joints and "
                               "between points)")

    def _on_scalar(self, load: JointForce, s: Scalar, value: sp.Expr) -> None:
        q, u = s.coordinate, s.speed
        value = sp.expand(value.xreplace(self.numbers.values))
        inputs = sorted((a for a in symbols_of(value) if isinstance(a, Input)), key=str)
        slopes = [value.diff(a) for a in (q, u, *inputs)] if isinstance(q, Coordinate) else [sp.nan]
        rest = value - sum((f * a for f, a in zip(slopes, (q, u, *inputs), strict=False)), sp.S.Zero)
        rest = sp.expand(rest) if len(slopes) > 1 else sp.nan
        if not all(f.is_number for f in slopes) or not rest.is_number or rest is sp.nan:
            self.faults.append(f"{load.label} on joint {shown(s.name)} is {value}; written are forces that are linear in its own "
                               "coordinate, its speed and inputs")
            return
        k, d = -float(slopes[0]), -float(slopes[1])
        stiffness, reference = self.springs.get(s.name, (0.0, 0.0))
        moment = stiffness * reference + float(rest)
        stiffness += k
        if stiffness == 0 and moment != 0:
            self.faults.append(f"{load.label} on joint {shown(s.name)} is the constant {moment:g} besides what is linear in q; "
                               f"MJCF "
                               "has springs alone: make it an input")
            return
        self.springs[s.name] = stiffness, moment / stiffness if stiffness else 0.0
        self.damping[s.name] = self.damping.get(s.name, 0.0) + d
        for a, slope in zip(inputs, slopes[2:], strict=True):
            self._motor(a.name, f"joint={quoteattr(s.name)}", self.numbers.text(slope))

    def _on_several(self, load: JointForce, joint: Joint) -> None:
        """Damping, or an input along given directions, on a spherical or a free joint."""
        values = [sp.expand(v.xreplace(self.numbers.values)) for v in load.values]
        slopes = [-v.diff(u) for v, u in zip(values, joint_speeds(joint), strict=True)]
        if slopes[0].is_number and all(sp.expand(v + slopes[0] * u) == 0 for v, u in zip(values, joint_speeds(joint),
                                                                                         strict=True)):
            self.damping[joint.name] = self.damping.get(joint.name, 0.0) + float(slopes[0])
            return
        inputs = sorted({a for v in values for a in symbols_of(v)}, key=str)
        gears = [v.diff(inputs[0]) for v in values] if len(inputs) == 1 and isinstance(inputs[0], Input) else [sp.nan]
        if not all(g.is_number for g in gears) or any(sp.expand(v - g * inputs[0]) != 0 for v, g in zip(values, gears,
                                                                                                        strict=False)):
            self.faults.append(f"{load.label} on joint {shown(joint.name)} is {', '.join(map(str, values))}; written are equal "
                               f"damping of "
                               "all its speeds, and one input times numbers")
            return
        self._motor(inputs[0].name, f"joint={quoteattr(joint.name)}", self.numbers.texts([*gears, *[0] * (6 - len(gears))]))

    def _tendon(self, load: Any, spring: Sequence[sp.Expr], force: sp.Expr | None) -> None:
        """A straight tendon between two points."""
        values = [e.xreplace(self.numbers.values) for e in spring]
        driven = None if force is None else sp.expand(force.xreplace(self.numbers.values))
        inputs = sorted(symbols_of(driven), key=str) if driven is not None else []
        slopes = [driven.diff(a) for a in inputs] if driven is not None else []
        linear = driven is None or (all(isinstance(a, Input) for a in inputs) and all(s.is_number for s in slopes) and sp.expand(
            driven - sum((s * a for s, a in zip(slopes, inputs, strict=True)), sp.S.Zero)) == 0)
        if not all(v.is_number for v in values) or not linear:
            self.faults.append(f"{load.label} depends on the motion by a law of its own; written are springs and dampers with "
                               f"numbers, "
                               "and forces that are linear in inputs")
            return
        ends = [self._site(body, point) for body, point in ((load.body_a, load.point_a), (load.body_b, load.point_b))]
        listed = "".join(f' {what}="{self.numbers.text(v)}"' for what, v in zip(("stiffness", "damping", "springlength"), values,
                                                                             strict=False))
        name = f"{load.label} {len(self.tendons) + 1}"
        self.tendons.append(f'<spatial name={quoteattr(name)}{listed}>' + "".join(f'<site site="{end}"/>' for end in ends) +
                            "</spatial>")
        for a, slope in zip(inputs, slopes, strict=True):
            self._motor(a.name, f"tendon={quoteattr(name)}", self.numbers.text(-slope))

    def _motor(self, name: str, target: str, gear: str) -> None:
        if any(f"name={quoteattr(name)}" in line for line in self.actuators):
            self.faults.append(f"the input {name} drives several joints or loads; MJCF has an actuator for each: give each an "
                               f"input")
        self.commands.append(name)
        self.actuators.append(f'<motor name={quoteattr(name)} {target} gear="{gear}"/>')

    def _site(self, body: Any, point: Any, R: Any = None) -> str:
        """The name of a new site on a body."""
        number = next((k for k, b in enumerate(self.model.bodies) if body in (b, b.name)), -1)
        name = f"site {sum(map(len, self.sites.values())) + 1}"
        pose = Pose(np.eye(3) if R is None else self.numbers.array(R), self.numbers.array(point).ravel())
        turned = "" if R is None else f' quat="{self.numbers.texts(pose.quaternion)}"'
        self.sites.setdefault(number, []).append(f'<site name="{name}" pos="{self.numbers.texts(pose.p)}"{turned}/>')
        return name
