"""Stops, backlash, one-way clutches and dry friction of joints, and ropes: one-sided and set-valued laws that are no contacts of
bodies, but follow the same rules.

Each has one row, a speed w with a force along it: of a stop the rate of what is left to it, of a clutch the speed that it locks,
of friction the speed of the joint. Stops, clutches and ropes have forces that only push (w >= 0); friction has a bound.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.contact_kinds import CLUTCH, FRICTION, STOP
from symdyn.model.contacts.coefficients import value_of
from symdyn.model.faults import Faults
from symdyn.model.loads import ForceBetween, JointForce
from symdyn.model.quantity import component, distance
from symdyn.model.symbols import Coordinate
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, JointOrName, Scalar, Vector
    from symdyn.model.system import System

NEWTON = "newton"
IMPACTS = (NEWTON, "poisson")
# Ends of a rope nearer than this part of its length are at one place; its square is below rounding of the length.
COINCIDE = sp.Rational(1, 10**9)


@dataclass(frozen=True)
class Row:
    """One row of an element in a system.

    kind     STOP, CLUTCH or FRICTION; gap: what is left to the stop, of a clutch the speed itself; rate: the speed of the row
    on       the joints that the force acts on, each with its factor; of a rope empty
    """

    name: str
    kind: str
    gap: sp.Expr
    rate: sp.Expr
    on: tuple[tuple[Any, sp.Expr], ...]


class JointElement:
    """Common part of stops, clutches, friction and ropes; bounds: the numbers that are checked, with least and most."""

    impact, law = NEWTON, "rigid"

    def __init__(self, name: str, what: str) -> None:
        self.name, self.faults, self.where = name, Faults(), f"{what} {shown(name)}"
        self.bounds: dict[str, tuple[sp.Expr, float, float]] = {}
        self.restitution: sp.Expr = sp.S.Zero
        self.static: sp.Expr = sp.S.Zero
        self.kinetic: sp.Expr = sp.S.Zero
        if not isinstance(name, str) or not name.isidentifier():
            self.faults.append(f"a {what} is named {shown(name)}; pass an identifier such as 'knee'")

    def rows(self, system: System, faults: Faults) -> list[Row]:
        """Its rows in a system; what is wrong is added to faults."""
        raise NotImplementedError

    def act(self, row: Row, force: sp.Expr) -> list[JointForce | ForceBetween]:
        """The loads of a force along a row."""
        return [JointForce(joint, (factor * force,), f"{self.where}: {row.name}") for joint, factor in row.on]

    def number_faults(self, defaults: Mapping[sp.Basic | str, float]) -> list[str]:
        """Numbers that cannot be, with those that parameters have, and laws of impacts that there are not."""
        result = [] if self.impact in IMPACTS else [f"{self.where}: impact is {shown(self.impact)}; there are "
                                                    f"{', '.join(map(repr, IMPACTS))}"]
        for what, (expression, least, most) in self.bounds.items():
            value = value_of(expression, defaults)
            if value is not None and not least <= value <= most:
                limits = f"from {least:g} on" if most == math.inf else f"from {least:g} to {most:g}"
                result.append(f"{self.where}: {what} is {value:g}; pass a number {limits}")
        return result

    def _number(self, value: Any, what: str, least: float = 0.0, most: float = math.inf) -> sp.Expr:
        expression = self.faults.expression(value, f"{self.where}: {what}")
        self.bounds[what] = (expression, least, most)
        return expression

    def _coordinate(self, system: System, joint: Any, faults: Faults) -> tuple[Any, Any] | None:
        """A joint of one degree of freedom with its coordinate."""
        joints = {name_of(j): j for j in system.joints}
        result = joints.get(joint) if isinstance(joint, str) else next((j for j in system.joints if j is joint), None)
        if result is None:
            faults.append(f"{self.where} is at the joint {shown(joint)}, which the system does not have; joints: "
                          f"{', '.join(map(str, joints)) or 'none'}")
            return None
        coordinates = result.coordinates
        if len(coordinates) != 1 or not isinstance(coordinates[0], Coordinate):
            faults.append(f"{self.where}: the joint {shown(result.name)} has the coordinates {', '.join(map(str, coordinates))}; "
                          "pass a joint with one degree of freedom and a coordinate of its own, such as a Revolute")
            return None
        return result, coordinates[0]

    def _relative(self, system: System, joint: Any, other: Any, ratio: sp.Expr,
                  faults: Faults) -> tuple[sp.Expr, sp.Expr, tuple[tuple[Any, sp.Expr], ...]] | None:
        """The coordinate of a joint less ratio times that of another, its rate, and the joints with their factors."""
        first = self._coordinate(system, joint, faults)
        second = None if other is None else self._coordinate(system, other, faults)
        if first is None or (other is not None and second is None):
            return None
        if second is None:
            return first[1], first[1].dot, ((first[0], sp.S.One),)
        if first[0] is second[0]:
            faults.append(f"{self.where} is between the joint {shown(first[0].name)} and itself; pass two different joints, or "
                          "leave the second one out")
            return None
        return first[1] - ratio * second[1], first[1].dot - ratio * second[1].dot, ((first[0], sp.S.One), (second[0], -ratio))


class Stop(JointElement):
    """Stops of a joint: its coordinate does not go below `lower` nor above `upper`.

    joint         a joint with one degree of freedom, or its name
    lower, upper  rad or m, numbers or expressions of parameters; None: no stop there
    restitution   speed after an impact by that before it, 0 to 1
    impact        law of impacts, as of sd.Contact

    Its results are `solution.contacts["NAME_lower"]` and `["NAME_upper"]`; the force there is the torque, N m, or force, N.

    >>> knee = sd.Stop("knee", "knee_joint", lower=0, upper=2.4, restitution=0.2)
    >>> knee.name, knee.restitution
    ('knee', 0.200000000000000)
    """

    def __init__(self, name: str, joint: JointOrName, lower: Scalar | None = None, upper: Scalar | None = None,
                 restitution: Scalar = 0, impact: str = NEWTON) -> None:
        super().__init__(name, "stop")
        self.joint, self.impact = joint, impact
        self.ends = {what: self.faults.expression(value, f"{self.where}: {what}")
                     for what, value in (("lower", lower), ("upper", upper)) if value is not None}
        self.restitution = self._number(restitution, "restitution", 0.0, 1.0)
        if not self.ends:
            self.faults.append(f"{self.where} has neither lower nor upper; pass one of them, or both")

    def rows(self, system: System, faults: Faults) -> list[Row]:
        result = self._relative(system, self.joint, None, sp.S.One, faults)
        if result is None:
            return []
        q, rate, on = result
        rows = []
        for what, end in self.ends.items():
            sign = 1 if what == "lower" else -1
            rows.append(Row(f"{self.name}_{what}", STOP, sign * (q - end), sign * rate, _signed(on, sign)))
        return rows

    def number_faults(self, defaults: Mapping[sp.Basic | str, float]) -> list[str]:
        result = super().number_faults(defaults)
        lower, upper = (value_of(self.ends[what], defaults) if what in self.ends else None for what in ("lower", "upper"))
        if lower is not None and upper is not None and lower >= upper:
            result.append(f"{self.where}: lower is {lower:g} and upper {upper:g}; pass a lower one below the upper")
        return result


class Backlash(JointElement):
    """Backlash of a transmission: q - ratio q_other stays within plus and minus half its width; there its sides push.

    joint, other   joints with one degree of freedom, or their names; other None: against the joint's zero
    width          of the backlash, rad or m of the first joint
    ratio          of the transmission; restitution, impact: as of sd.Stop

    Its results are `solution.contacts["NAME_lower"]` and `["NAME_upper"]`.

    >>> sd.Backlash("gear", "motor", "load", width=0.02, ratio=5).name
    'gear'
    """

    def __init__(self, name: str, joint: JointOrName, other: JointOrName | None, width: Scalar, ratio: Scalar = 1,
                 restitution: Scalar = 0, impact: str = NEWTON) -> None:
        super().__init__(name, "backlash")
        self.joint, self.other, self.impact = joint, other, impact
        self.width = self._number(width, "width")
        self.ratio = self.faults.expression(ratio, f"{self.where}: ratio")
        self.restitution = self._number(restitution, "restitution", 0.0, 1.0)

    def rows(self, system: System, faults: Faults) -> list[Row]:
        result = self._relative(system, self.joint, self.other, self.ratio, faults)
        if result is None:
            return []
        q, rate, on = result
        return [Row(f"{self.name}_{what}", STOP, self.width / 2 + sign * q, sign * rate, _signed(on, sign))
                for what, sign in (("lower", 1), ("upper", -1))]


class OneWayClutch(JointElement):
    """A one-way clutch (freewheel): the speed of a joint less ratio times that of another is never against `direction`.

    joint, other   joints with one degree of freedom, or their names; other None: against what the joint is at
    direction      1 or -1: where it turns freely
    ratio          of the speeds

    Its results are `solution.contacts["NAME"]`: "open" where it turns freely, "closed" where it locks, with the torque, N m, or
    force, N, on the first joint along direction. An impact that would turn it back locks it.

    >>> sd.OneWayClutch("freewheel", "hub", "sprocket").name
    'freewheel'
    """

    def __init__(self, name: str, joint: JointOrName, other: JointOrName | None = None, direction: int = 1,
                 ratio: Scalar = 1) -> None:
        super().__init__(name, "one-way clutch")
        self.joint, self.other, self.direction = joint, other, direction
        self.ratio = self.faults.expression(ratio, f"{self.where}: ratio")
        number = isinstance(direction, (int, float, np.number, sp.Number)) and not isinstance(direction, bool)
        if not number or direction not in (1, -1):
            self.faults.append(f"{self.where}: direction is {shown(direction)}; pass 1 or -1")
            self.direction = 1

    def rows(self, system: System, faults: Faults) -> list[Row]:
        result = self._relative(system, self.joint, self.other, self.ratio, faults)
        if result is None:
            return []
        _, rate, on = result
        return [Row(self.name, CLUTCH, self.direction * rate, self.direction * rate, _signed(on, self.direction))]


class JointFriction(JointElement):
    """Dry friction of a joint: it holds up to a breakaway torque, and brakes with a constant one while the joint moves.

    joint       a joint with one degree of freedom, or its name
    breakaway   largest torque, N m, or force, N, while it sticks; sliding: the one while it moves, by default the same
    other       a second joint: friction between the two, such as of a clutch; ratio: of their speeds

    Its results are `solution.contacts["NAME"]`: "sticking" or "sliding", with the torque or force on the first joint.

    >>> hinge = sd.JointFriction("hinge", "shoulder", breakaway=2.0, sliding=1.5)
    >>> hinge.static, hinge.kinetic
    (2.00000000000000, 1.50000000000000)
    """

    def __init__(self, name: str, joint: JointOrName, breakaway: Scalar, sliding: Scalar | None = None,
                 other: JointOrName | None = None, ratio: Scalar = 1) -> None:
        super().__init__(name, "joint friction")
        self.joint, self.other = joint, other
        self.static = self._number(breakaway, "breakaway")
        self.kinetic = self._number(breakaway if sliding is None else sliding, "sliding")
        self.ratio = self.faults.expression(ratio, f"{self.where}: ratio")

    def rows(self, system: System, faults: Faults) -> list[Row]:
        result = self._relative(system, self.joint, self.other, self.ratio, faults)
        return [] if result is None else [Row(self.name, FRICTION, sp.S.Zero, result[1], result[2])]

    def number_faults(self, defaults: Mapping[sp.Basic | str, float]) -> list[str]:
        result = super().number_faults(defaults)
        static, kinetic = (value_of(e, defaults) for e in (self.static, self.kinetic))
        if static is not None and kinetic is not None and kinetic > static:
            result.append(f"{self.where}: sliding is {kinetic:g} and breakaway {static:g}; pass a breakaway torque "
                          "that is not below the sliding one")
        return result


class Rope(JointElement):
    """A rope or chain without mass that does not stretch: two points are no further apart than its length.

    a, b              bodies, or their names; b may be the ground
    length            m
    point_a, point_b  where it is tied, body axes, m; default: the origins
    restitution       with which it jerks, 0 to 1; impact: as of sd.Stop

    Its results are `solution.contacts["NAME"]`: "open" while it is slack, "closed" while it is taut, with its tension, N.

    >>> sd.Rope("tether", "ball", "ground", length=2.0).name
    'tether'
    """

    def __init__(self, name: str, a: BodyOrName, b: BodyOrName, length: Scalar, point_a: Vector | None = None,
                 point_b: Vector | None = None, restitution: Scalar = 0, impact: str = NEWTON) -> None:
        super().__init__(name, "rope")
        self.a, self.b, self.impact = a, b, impact
        self.points: Sequence[Any] = ((0, 0, 0) if point_a is None else point_a, (0, 0, 0) if point_b is None else point_b)
        self.at: list[sp.ImmutableMatrix] = []
        self.span: sp.Expr = sp.S.One
        self.length = self._number(length, "length")
        self.restitution = self._number(restitution, "restitution", 0.0, 1.0)

    def rows(self, system: System, faults: Faults) -> list[Row]:
        known = {"ground", *[b.name for b in system.bodies]}
        names = [getattr(body, "name", body) for body in (self.a, self.b)]
        strange = [name for name in names if not isinstance(name, str) or name not in known]
        if strange or names[0] == names[1]:
            between = [name if isinstance(name, str) else shown(name) for name in names]
            faults.append(f"{self.where} is between {' and '.join(between)}; pass two different bodies of the system: "
                          f"{', '.join(sorted(known))}")
            return []
        at = self.at = [faults.vector(p, f"{self.where}: {what}", system.planar)
                        for p, what in zip(self.points, ("point_a", "point_b"), strict=True)]
        apart = distance(names[0], names[1], list(at[0]), list(at[1]))
        # The rate of the distance, with a length that is not zero where the ends coincide.
        ends = [[component(name, list(p), "position", k) for k in range(2 if system.planar else 3)]
                for name, p in zip(names, at, strict=True)]
        apart_by = [(a - b, a.dot - b.dot) for a, b in zip(*ends, strict=True)]
        self.span = sp.sqrt(sp.Add(*[d**2 for d, _ in apart_by]) + (COINCIDE * self.length)**2)
        rate = sp.Add(*[d * v for d, v in apart_by]) / self.span
        return [Row(self.name, STOP, self.length - apart, -rate, ())]

    def number_faults(self, defaults: Mapping[sp.Basic | str, float]) -> list[str]:
        result = super().number_faults(defaults)
        if value_of(self.length, defaults) == 0:
            result.append(f"{self.where}: length is 0; pass a length above 0, or a joint where both points stay together")
        return result

    def act(self, row: Row, force: sp.Expr) -> list[JointForce | ForceBetween]:
        return [ForceBetween(self.a, self.b, force, self.at[0], self.at[1], self.where, self.span)]


def _signed(on: tuple[tuple[Any, sp.Expr], ...], sign: int) -> tuple[tuple[Any, sp.Expr], ...]:
    return tuple((joint, sign * factor) for joint, factor in on)
