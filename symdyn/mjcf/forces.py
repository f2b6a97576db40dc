"""Armature, springs, damping, gravity compensation, tendons and actuators of a compiled model.

Source: the page Computation of MuJoCo's documentation (passive forces, actuation model, transmission), and its XML reference.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import sympy as sp

from symdyn.mjcf.compiled import Compiled, rotation
from symdyn.mjcf.left_out import LeftOut
from symdyn.mjcf.tree import Tree
from symdyn.model.joints import Prismatic, Revolute
from symdyn.model.quantity import distance
from symdyn.model.record import joint_speeds
from symdyn.model.symbols import coordinates, inputs
from symdyn.urdf.parameters import plain

_JOINTS = ("JOINT", "JOINTINPARENT")


class Forces:
    """Adds the forces to the system of a tree."""

    def __init__(self, tree: Tree, out: LeftOut) -> None:
        self.tree, self.out = tree, out
        self.c: Compiled = tree.c
        self.m, self.system, self.take = tree.m, tree.system, tree.parameters.take
        self.labels = tree.joint_names
        flags, bits = int(self.m.opt.disableflags), self.c.mujoco.mjtDisableBit
        self.springs = not flags & int(bits.mjDSBL_SPRING)
        self.dampers = not flags & int(bits.mjDSBL_DAMPER)
        self.driven = not flags & int(bits.mjDSBL_ACTUATION)

    def build(self) -> None:
        for b in range(1, self.m.nbody):
            self._lift(b)
        for j in self.tree.joints:
            self._joint(j)
        for k in range(self.m.ntendon):
            self._tendon(k)
        if self.driven:
            for i in range(self.m.nu):
                self._actuator(i)

    # -- of bodies and joints

    def _lift(self, b: int) -> None:
        """Gravity compensation: a part of the weight, upwards at the centre of mass."""
        part = float(self.m.body_gravcomp[b])
        if part:
            body = self.tree.bodies[b]
            name = self.c.name("body", b)
            self.system.add_force(body, [-plain(part) * body.mass * g for g in self.system.gravity], name=f"gravcomp of {name}")

    def _joint(self, j: int) -> None:
        m, joint, name = self.m, self.tree.joints[j], self.c.name("joint", j)
        kind, at, dof = self.c.joint(j)
        n = joint.n_speeds
        J = float(m.dof_armature[dof])
        scalar = kind in ("hinge", "slide")
        if scalar:
            q = self.tree.coordinates[j]
            if J:
                self._rotor(name, q, J, kind == "slide")
        elif J:
            self.out.rejected("joint", j, f"is {kind} and has an armature")
        d, more = float(m.dof_damping[dof]), m.dof_dampingpoly[dof]
        if self.dampers and (d or more.any()):
            symbols = joint_speeds(joint)
            d = self.take("d", name, d)
            self.system.add_joint_force(joint, [-_damping(d, more, u) for u in symbols][:n], name=f"damping of {joint.name}")
        k, higher = float(m.jnt_stiffness[j]), m.jnt_stiffnesspoly[j]
        if self.springs and (k or higher.any()):
            if not scalar:
                self.out.rejected("joint", j, f"is {kind} and has a stiffness")
                return
            x = q - plain(float(m.qpos_spring[at]))
            self.system.add_joint_force(joint, -_polynomial(self.take("k", name, k), higher, x), name=f"spring of {joint.name}")

    def _rotor(self, name: str, value: Any, inertia: float, linear: bool) -> None:
        """The inertia that a speed has besides that of the bodies: a body on the ground that the coordinate moves, turning, or,
        with a mass, along a line that gravity does not act along."""
        label = self.tree.body_names.text(f"armature of {name}")
        J = self.take("J", name, inertia)
        value = sp.UnevaluatedExpr(value)
        ground = self.system.ground
        if linear:
            body = self.system.add_body(label, J, None)
            g = np.array(self.m.opt.gravity)
            across = np.cross(g, np.eye(3)[np.abs(g).argmin()])
            axis = across / np.linalg.norm(across) if across.any() else np.array([1.0, 0.0, 0.0])
            self.system.add_joint(Prismatic(self.labels.text(label), ground, body, value, axis=[plain(float(e)) for e in axis]))
        else:
            body = self.system.add_body(label, 0, [J, J, J])
            self.system.add_joint(Revolute(self.labels.text(label), ground, body, value))

    # -- tendons

    def length(self, k: int) -> tuple[Any, Any] | None:
        """Length of a tendon and its rate; None for one that is not built."""
        length, rate = sp.S.Zero, sp.S.Zero
        parts = self._wrapped(k)
        for kind, number, factor in parts:
            if kind == "JOINT":
                if number not in self.tree.coordinates:
                    continue
                q = self.tree.coordinates[number]
                length += factor * q
                rate += factor * q.dot
        if parts and parts[0][0] != "JOINT":
            if any(kind != "SITE" for kind, _, _ in parts):
                return None
            for (_, a, _), (_, b, _) in pairwise(parts):
                if self.m.site_bodyid[a] == self.m.site_bodyid[b]:
                    length += plain(float(np.linalg.norm(self.m.site_pos[a] - self.m.site_pos[b])))
                    continue
                r = distance(*self._ends(a, b)[:2], *self._ends(a, b)[2:])
                length += r
                rate += r.dot
        return length, rate

    def _wrapped(self, k: int) -> list[tuple[str, int, Any]]:
        m, names = self.m, self.c.mujoco.mjtWrap
        first = int(m.tendon_adr[k])
        return [(names(int(m.wrap_type[w])).name.removeprefix("mjWRAP_"), int(m.wrap_objid[w]), plain(float(m.wrap_prm[w])))
                for w in range(first, first + int(m.tendon_num[k]))]

    def _ends(self, a: int, b: int) -> tuple[Any, Any, list[Any], list[Any]]:
        bodies = [self.tree.bodies[int(self.m.site_bodyid[s])] for s in (a, b)]
        points = [[plain(float(v)) for v in self.m.site_pos[s]] for s in (a, b)]
        return bodies[0], bodies[1], points[0], points[1]

    def _tendon(self, k: int) -> None:
        m, name = self.m, self.c.name("tendon", k)
        stiffness, higher = float(m.tendon_stiffness[k]), m.tendon_stiffnesspoly[k]
        d, more, J = float(m.tendon_damping[k]), m.tendon_dampingpoly[k], float(m.tendon_armature[k])
        sprung, damped = self.springs and (stiffness or higher.any()), self.dampers and (d or more.any())
        if not (sprung or damped or J) or self.out.named(name):
            return
        result = self.length(k)
        if result is None or (J and not self._fixed(k)):
            self.out.rejected("tendon", k, "wraps around geoms or pulleys" if result is None
                              else "goes through sites and has an armature")
            return
        length, rate = result
        force = sp.S.Zero
        if sprung:
            low, high = (plain(float(v)) for v in m.tendon_lengthspring[k])
            x = length - low if low == high else sp.Max(length - high, 0) + sp.Min(length - low, 0)
            force -= _polynomial(self.take("k", name, stiffness), higher, x)
        if damped:
            force -= _damping(self.take("d", name, d), more, rate)
        if force != 0:
            self._pull(k, force, f"tendon {name}")
        if J:
            self._rotor(name, length, J, False)

    def _fixed(self, k: int) -> bool:
        return all(kind == "JOINT" for kind, _, _ in self._wrapped(k))

    def _pull(self, k: int, force: Any, label: str) -> None:
        """A force along a tendon, positive where it makes the tendon longer."""
        parts = self._wrapped(k)
        if self._fixed(k):
            for n, (_, j, factor) in enumerate(parts):
                if j in self.tree.joints:
                    self.system.add_joint_force(self.tree.joints[j], factor * force, name=f"{label} {n + 1}")
            return
        for n, ((_, a, _), (_, b, _)) in enumerate(pairwise(parts)):
            if self.m.site_bodyid[a] != self.m.site_bodyid[b]:
                body_a, body_b, point_a, point_b = self._ends(a, b)
                self.system.add_force_between(body_a, body_b, -force, point_a, point_b, name=f"{label} {n + 1}")

    # -- actuators

    def _actuator(self, i: int) -> None:
        m, name = self.m, self.c.name("actuator", i)
        mj = self.c.mujoco
        kinds = [of(int(value)).name.split("_", 1)[1] for of, value in (
            (mj.mjtTrn, m.actuator_trntype[i]), (mj.mjtDyn, m.actuator_dyntype[i]), (mj.mjtGain, m.actuator_gaintype[i]),
            (mj.mjtBias, m.actuator_biastype[i]))]
        transmission, dynamics, gain, bias = kinds
        wrong = (f"has the transmission {transmission.lower()}" if transmission not in (*_JOINTS, "TENDON", "SITE") else
                 f"has the dynamics {dynamics.lower()}" if dynamics not in ("NONE", "INTEGRATOR", "FILTER", "FILTEREXACT") else
                 f"has the gain {gain.lower()}" if gain not in ("FIXED", "AFFINE") else
                 f"has the bias {bias.lower()}" if bias not in ("NONE", "AFFINE") else
                 "has a delay" if m.actuator_delay[i] else "")
        if wrong:
            self.out.rejected("actuator", i, wrong)
            return
        if self.out.named(name):
            return
        gear = np.array(m.actuator_gear[int(m.actuator_outadr[i])])
        target = int(m.actuator_trnid[i, 0])
        moved = self._moved(i, transmission, target, gear)
        if moved is None:
            return
        length, rate = moved
        ratio = self.take("gear", name, float(gear[0]))
        if length is not None:
            length, rate = ratio * length, ratio * rate
        force = self._law(i, gain, bias, self._command(i, name, dynamics), length, rate)
        if force is None:
            return
        self._apply(i, transmission, target, gear, ratio, force, name)

    def _moved(self, i: int, transmission: str, target: int, gear: np.ndarray) -> tuple[Any, Any] | None:
        """Length and rate of what an actuator moves, before its gear, (None, None) where they are no scalars; None where that is
        held or rejected."""
        if transmission == "TENDON":
            result = self.length(target)
            if result is None:
                self.out.rejected("actuator", i, "pulls at a tendon that wraps around geoms or pulleys")
            return result
        if transmission == "SITE":
            if int(self.m.actuator_trnid[i, 1]) >= 0:
                self.out.rejected("actuator", i, "acts between two sites (refsite)")
                return None
            return None, None
        if target not in self.tree.joints:
            return None
        if target in self.tree.coordinates:
            q = self.tree.coordinates[target]
            return q, q.dot
        if transmission == "JOINTINPARENT":
            self.out.rejected("actuator", i, "acts on several directions in the parent's axes (jointinparent)")
            return None
        return None, None

    def _command(self, i: int, name: str, dynamics: str) -> Any:
        """Quantity that the gain acts on: the input, or the state that follows it."""
        u = self.tree.commands[i] = inputs(self.tree.names.symbol(name))
        if dynamics == "NONE":
            return u
        state = self.tree.activations[i] = coordinates(self.tree.names.symbol(f"act_{name}"))
        rate = u if dynamics == "INTEGRATOR" else (u - state) / self.take("tau", name, float(self.m.actuator_dynprm[i, 0]))
        self.system.add_state(state, rate)
        return state

    def _law(self, i: int, gain: str, bias: str, command: Any, length: Any, rate: Any) -> Any:
        """gain * command + bias; None where it needs a length that there is not. The law of a servo has one stiffness, and one
        damping."""
        name = self.c.name("actuator", i)
        g, b = self.m.actuator_gainprm[i], self.m.actuator_biasprm[i]
        affine = [float(v) for v in (b[:3] if bias == "AFFINE" else np.zeros(3))]
        along = [float(v) for v in (g[1:3] if gain == "AFFINE" else np.zeros(2))]
        if length is None and (any(affine[1:]) or any(along)):
            self.out.rejected("actuator", i, "feeds back the length of something that has none")
            return None
        first = float(g[0])
        scale = self.take("kp" if first and affine[1] == -first else "kv" if first and affine[2] == -first else "gain", name,
                          first)
        slopes: list[Any] = [-scale if first and affine[1] == -first else self._slope("kp", name, affine[1]),
                             -scale if first and affine[2] == -first and affine[1] != -first
                             else self._slope("kv", name, affine[2])]
        factor, constant = scale, plain(affine[0])
        if length is not None:
            factor = factor + plain(along[0]) * length + plain(along[1]) * rate
            constant = constant + slopes[0] * length + slopes[1] * rate
        return factor * command + constant

    def _slope(self, letters: str, name: str, value: float) -> Any:
        return -self.take(letters, name, -value) if value else 0

    def _apply(self, i: int, transmission: str, target: int, gear: np.ndarray, ratio: Any, force: Any, name: str) -> None:
        d, more = float(self.m.actuator_damping[i]), self.m.actuator_dampingpoly[i]
        J = float(self.m.actuator_armature[i])
        label = f"actuator {name}"
        if transmission == "SITE":
            body = self.tree.bodies[int(self.m.site_bodyid[target])]
            R = rotation(self.m.site_quat[target])
            along, about = R @ gear[:3], R @ gear[3:]
            if along.any():
                at = [plain(float(v)) for v in self.m.site_pos[target]]
                self.system.add_force(body, [plain(float(v)) * force for v in along], at, body, name=f"{label}, force")
            if about.any():
                self.system.add_torque(body, [plain(float(v)) * force for v in about], body, name=f"{label}, torque")
            return
        if transmission == "TENDON":
            self._pull(target, ratio * force, label)
            if d or more.any() or J:
                self.out.rejected("actuator", i, "adds damping or armature to a tendon")
            return
        joint = self.tree.joints[target]
        values = [ratio * force] if target in self.tree.coordinates else [plain(float(e)) * force for e in gear[:joint.n_speeds]]
        self.system.add_joint_force(joint, values, name=label)
        if not (d or more.any() or J):
            return
        if target not in self.tree.coordinates:
            self.out.rejected("actuator", i, "adds damping or armature to a joint with several coordinates")
            return
        q = self.tree.coordinates[target]
        if self.dampers and (d or more.any()):
            self.system.add_joint_force(joint, -ratio**2 * _damping(plain(d), more, q.dot), name=f"{label}, damping")
        if J:
            self._rotor(f"{name} at {self.c.name('joint', target)}", q, J * float(gear[0]) ** 2, self.c.joint(target)[0] ==
                        "slide")


def _polynomial(first: Any, higher: np.ndarray, x: Any) -> Any:
    """a x + b x² + c x³."""
    return first * x + sum((plain(float(c)) * x ** (n + 2) for n, c in enumerate(higher) if c), sp.S.Zero)


def _damping(first: Any, higher: np.ndarray, v: Any) -> Any:
    """a v + b v |v| + c v³."""
    terms = (v * sp.Abs(v), v**3)
    return first * v + sum((plain(float(c)) * term for c, term in zip(higher, terms, strict=True) if c), sp.S.Zero)
