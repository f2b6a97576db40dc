"""Bodies and joints of a compiled model as those of a System."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
import sympy as sp

from symdyn.mjcf.compiled import Compiled, rotation
from symdyn.model.bodies import Body
from symdyn.model.joints import Fixed, Free, Joint, Prismatic, Revolute, Spherical
from symdyn.model.orientation import EulerParameters
from symdyn.model.symbols import Coordinate, coordinates
from symdyn.model.system import System
from symdyn.urdf.parameters import Names, Parameters, plain

# Moments off the diagonal below this share of the largest are what turning has left of none.
_ROUNDING = 1e-15


class Tree:
    """Builds bodies and joints; `bodies` by MuJoCo's numbers, `joints` and `coordinates` likewise, held ones left out.

    A body with several joints has bodies without mass between them, each turned by one joint more, as MuJoCo applies them: in
    their order, each about its anchor in the axes that those before it have turned.
    """

    def __init__(self, model: Compiled, system: System, patterns: Sequence[str], held: Sequence[str]) -> None:
        self.c, self.m, self.system = model, model.m, system
        # The time is t.
        self.names = Names({"t"})
        self.body_names, self.joint_names = Names({"ground"}), Names()
        self.parameters = Parameters(patterns, self.names)
        self.held = held
        self.bodies: dict[int, Body] = {0: system.ground}
        self.joints: dict[int, Joint] = {}
        self.coordinates: dict[int, Coordinate] = {}
        # Inputs and extra states of actuators, by their numbers.
        self.commands: dict[int, Any] = {}
        self.activations: dict[int, Any] = {}

    def build(self) -> None:
        # Coordinates have their names before the parameters.
        for j in range(self.m.njnt):
            kind, _, _ = self.c.joint(j)
            if kind in ("hinge", "slide") and not self.fixed(j):
                self.coordinates[j] = coordinates(self.names.symbol(f"q_{self.c.name('joint', j)}"))
        self._gravity()
        for number in range(1, self.m.nbody):
            self._body(number)

    def fixed(self, j: int) -> bool:
        """Whether the call holds a joint where the file has it."""
        return any(fnmatchcase(self.c.name("joint", j), p) for p in self.held)

    def _gravity(self) -> None:
        disabled = int(self.m.opt.disableflags) & int(self.c.mujoco.mjtDisableBit.mjDSBL_GRAVITY)
        g = np.zeros(3) if disabled else np.array(self.m.opt.gravity)
        size = float(np.linalg.norm(g))
        if size and np.count_nonzero(g) == 1:
            value = self.parameters.gravity(size)
            taken = [-value if e < 0 else value if e > 0 else 0 for e in g]
        else:
            taken = [plain(float(e)) for e in g]
        self.system.gravity = self.system._faults.vector(taken, "gravity")

    # -- bodies

    def _body(self, number: int) -> None:
        m, name = self.m, self.c.name("body", number)
        body = self.bodies[number] = self._weighed(number, name)
        parent = self.bodies[int(m.body_parentid[number])]
        point = [self.parameters.take(f"p_{axis}", name, float(v)) for axis, v in zip("xyz", m.body_pos[number])]
        R = rotation(m.body_quat[number])
        first, count = int(m.body_jntadr[number]), int(m.body_jntnum[number])
        moving = [j for j in range(first, first + count) if not self.fixed(j)]
        if not moving:
            held = self.joint_names.text(f"{name} fixed")
            self.system.add_joint(Fixed(held, parent, body, parent_point=point, parent_rotation=_rows(R)))
            return
        for j in moving:
            last = j == moving[-1]
            child = body if last else self.system.add_body(self.body_names.text(f"{name} before "
                                                                                f"{self.c.name('joint', moving[-1])}"))
            self._joint(j, parent, child, point, R)
            parent, point, R = child, [0, 0, 0], np.eye(3)

    def _weighed(self, number: int, name: str) -> Body:
        m, take = self.m, self.parameters.take
        mass = take("m", name, float(m.body_mass[number]))
        com = [take(f"c_{axis}", name, float(v)) for axis, v in zip("xyz", m.body_ipos[number])]
        R, moments = rotation(m.body_iquat[number]), np.array(m.body_inertia[number])
        I = R * moments @ R.T
        I = np.where(np.abs(I) <= _ROUNDING * np.abs(I).max(), 0.0, (I + I.T) / 2)
        rows: list[list[Any]] = [[0] * 3 for _ in range(3)]
        for i, k in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
            rows[i][k] = rows[k][i] = take(f"I_{'xyz'[i]}{'xyz'[k]}", name, float(I[i, k]))
        made: Body = self.system.add_body(self.body_names.text(name), mass, rows, com)
        return made

    # -- joints

    def _joint(self, j: int, parent: Body, child: Body, point: Sequence[Any], R: np.ndarray) -> None:
        """A joint whose frame is that of the body, before it turns, at its anchor; its coordinate is MuJoCo's, the reference
        included."""
        m, name = self.m, self.c.name("joint", j)
        kind, at, _ = self.c.joint(j)
        called = self.joint_names.text(name)
        if kind == "free":
            result = [self._coordinate(letters, name) for letters in ("x", "y", "z", "e0", "e1", "e2", "e3")]
            made: Joint = Free(called, self.system.ground, child, result, orientation=EulerParameters())
            self._start(result, m.qpos0[at:at + 7])
        else:
            anchor = [self.parameters.take(f"a_{axis}", name, float(v)) for axis, v in zip("xyz", m.jnt_pos[j])]
            axis = np.array(m.jnt_axis[j])
            reference = float(m.qpos0[at]) if kind != "ball" else 0.0
            seat = anchor if kind != "slide" or not reference else [a - plain(reference * float(e)) for a, e in zip(anchor, axis)]
            point = [p + sum((plain(float(R[i, k])) * seat[k] for k in range(3)), 0) for i, p in enumerate(point)]
            placed: dict[str, Any] = {"parent_point": point, "child_point": anchor}
            if kind == "ball":
                result = [self._coordinate(letters, name) for letters in ("e0", "e1", "e2", "e3")]
                made = Spherical(called, parent, child, result, orientation=EulerParameters(), parent_rotation=_rows(R), **placed)
            else:
                turned = R @ _about(axis, -reference) if kind == "hinge" and reference else R
                of = Revolute if kind == "hinge" else Prismatic
                made = of(called, parent, child, self.coordinates[j], axis=[plain(float(e)) for e in axis],
                          parent_rotation=_rows(turned), **placed)
                if reference:
                    self._start([self.coordinates[j]], [reference])
        self.system.add_joint(made)
        self.joints[j] = made

    def _coordinate(self, letters: str, joint: str) -> Coordinate:
        made: Coordinate = coordinates(self.names.symbol(f"{letters}_{joint}"))
        return made

    def _start(self, symbols: Sequence[sp.Symbol], values: Any) -> None:
        self.system.initial.update(zip(symbols, map(float, values), strict=True))


def _rows(R: np.ndarray) -> list[list[Any]]:
    return [[plain(float(v)) for v in row] for row in R]


def _about(axis: np.ndarray, angle: float) -> np.ndarray:
    """(3, 3) about a unit axis."""
    half = angle / 2
    return rotation(np.array([math.cos(half), *(math.sin(half) * axis)]))
