"""Closures of loops in addition to joints: a rod between two points, a gear between two joints; and constraints by expression."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import sympy as sp

from symdyn.model.faults import Faults
from symdyn.model.joints.base import Joint
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, JointOrName, Scalar, Vector


class Rod(Joint):
    """A massless rod of a given length (m) between a point of each body, hinged at both ends: one constraint.

    For `System.close_loop`; see Joint for the points. A rod of no length is a Spherical joint.

    >>> system = sd.systems.double_pendulum()
    >>> rod = system.close_loop(sd.Rod("rod", system.ground, "rod2", length=1.5))
    """

    kind = "rod"

    def __init__(self, name: str, parent: BodyOrName, child: BodyOrName, length: Scalar, parent_point: Vector = (0, 0, 0),
                 child_point: Vector = (0, 0, 0)) -> None:
        super().__init__(name, parent, child, (), None, parent_point, child_point, None, None)
        self.length = self.faults.expression(length, f"rod {shown(name)}: length (m)")
        if not self.faults and self.length.is_number and not self.length > 0:
            self.faults.append(f"rod {shown(name)}: length is {self.length} m; pass a positive length (for two points that "
                               "coincide: "
                               "Spherical, or Revolute in a plane)")

    @property
    def constants(self) -> list[sp.Expr]:
        return [*super().constants, self.length]


class Gear:
    """A gear between two joints of the tree with one coordinate each: q_b = ratio * q_a + offset, one constraint.

    ratio    of the coordinates, a number or an expression of parameters; offset: rad or m, as the coordinate of joint_b
    For `System.close_loop`. A joint whose coordinate is an expression, such as coordinate=2*q, is a gear without a constraint.

    >>> system = sd.systems.double_pendulum()
    >>> gear = system.close_loop(sd.Gear("gear", "hinge1", "hinge2", ratio=2))
    >>> system.augmented().C_r
    Matrix([[-2, 1]])
    """

    kind = "gear"

    def __init__(self, name: str, joint_a: JointOrName, joint_b: JointOrName, ratio: Scalar, offset: Scalar = 0) -> None:
        self.name = name
        self.joint_a, self.joint_b = joint_a, joint_b
        self.faults = Faults()
        self.ratio = self.faults.expression(ratio, f"gear {shown(name)}: ratio")
        self.offset = self.faults.expression(offset, f"gear {shown(name)}: offset")

    def __repr__(self) -> str:
        return f"Gear({shown(self.name)})"


@dataclass(frozen=True)
class Constraint:
    """expression = 0 in coordinates and t; with speeds, linear in them."""

    name: str
    expression: sp.Expr
