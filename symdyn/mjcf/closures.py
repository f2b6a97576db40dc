"""Equality constraints of a compiled model as exact loops and constraints."""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy as sp

from symdyn.mjcf.compiled import rotation
from symdyn.mjcf.forces import Forces
from symdyn.mjcf.tree import Tree
from symdyn.model.joints import Fixed, Spherical
from symdyn.urdf.parameters import Names, plain

_Frame = tuple[np.ndarray, np.ndarray]


class Closures:
    """Adds the equality constraints to the system of a tree; MuJoCo's are soft, these hold exactly."""

    def __init__(self, tree: Tree, forces: Forces) -> None:
        self.tree, self.forces, self.out = tree, forces, forces.out
        self.c, self.m, self.system = tree.c, tree.m, tree.system
        self.labels: Names = tree.joint_names

    def build(self) -> None:
        m, mj = self.m, self.c.mujoco
        if int(m.opt.disableflags) & int(mj.mjtDisableBit.mjDSBL_EQUALITY):
            return
        for e in range(m.neq):
            kind = mj.mjtEq(int(m.eq_type[e])).name.removeprefix("mjEQ_")
            if self.out.named(self.c.name("equality", e)):
                continue
            if not m.eq_active0[e]:
                self.out.reported("inactive", "constraints that are not active", "equality", e)
            elif kind in ("CONNECT", "WELD"):
                self._bodies(e, kind)
            elif kind in ("JOINT", "TENDON"):
                self._coupling(e, kind)
            else:
                self.out.rejected("equality", e, f"is of the kind {kind.lower()}")

    def _bodies(self, e: int, kind: str) -> None:
        """A point or a frame of one body at that of another."""
        m = self.m
        ends = [int(m.eq_obj1id[e]), int(m.eq_obj2id[e])]
        data = np.array(m.eq_data[e])
        if int(m.eq_objtype[e]) == int(self.c.mujoco.mjtObj.mjOBJ_SITE):
            frames: list[_Frame] = [(np.array(m.site_pos[s]), rotation(m.site_quat[s])) for s in ends]
            ends = [int(m.site_bodyid[s]) for s in ends]
        elif kind == "CONNECT":
            frames = [(data[:3], np.eye(3)), (data[3:6], np.eye(3))]
        else:
            frames = [(data[3:6], rotation(data[6:10])), (data[:3], np.eye(3))]
        (p_a, R_a), (p_b, R_b) = frames
        name = self.labels.text(self.c.name("equality", e))
        a, b = (self.tree.bodies[n] for n in ends)
        points: dict[str, Any] = {"parent_point": _plain(p_a), "child_point": _plain(p_b)}
        if kind == "CONNECT":
            self.system.close_loop(Spherical(name, a, b, **points))
        else:
            self.system.close_loop(Fixed(name, a, b, parent_rotation=[_plain(row) for row in R_a],
                                         child_rotation=[_plain(row) for row in R_b], **points))

    def _coupling(self, e: int, kind: str) -> None:
        """y - y0 = polynomial of x - x0, of joints or of tendons."""
        first, second = int(self.m.eq_obj1id[e]), int(self.m.eq_obj2id[e])
        y, x = (self._offset(e, kind, n) if n >= 0 else sp.S.Zero for n in (first, second))
        if y is None or x is None:
            return
        factors = [plain(float(a)) for a in self.m.eq_data[e, :5]]
        polynomial = sum((a * x**n for n, a in enumerate(factors)), sp.S.Zero)
        if y - polynomial != 0:
            self.system.add_constraint(y - polynomial, self.labels.text(self.c.name("equality", e)))

    def _offset(self, e: int, kind: str, number: int) -> Any:
        """Distance of a joint or a tendon from where the file has it."""
        if kind == "JOINT":
            if number not in self.tree.coordinates:
                return sp.S.Zero
            return self.tree.coordinates[number] - plain(float(self.m.qpos0[self.c.joint(number)[1]]))
        result = self.forces.length(number)
        if result is None:
            self.out.rejected("equality", e, "couples a tendon that wraps around geoms or pulleys")
            return None
        return result[0] - plain(float(self.m.tendon_length0[number]))


def _plain(values: Any) -> list[Any]:
    return [plain(float(v)) for v in values]
