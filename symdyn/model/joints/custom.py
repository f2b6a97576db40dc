"""The custom joint: whatever its transform says."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.errors import UnsupportedExpression
from symdyn.model.faults import NAME
from symdyn.model.joints.base import IDENTITY, Joint, JointMotion, listed
from symdyn.model.joints.transform import Transform
from symdyn.model.symbols import Coordinate, as_coordinate, symbols_of
from symdyn.shown import shown
from symdyn.spatial.vectors import zeros

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, Matrix, Scalar, Vector


class Custom(Joint):
    """A joint given by its transform, for what no other joint does; see Joint for the frames.

    coordinates   1 to 6 symbols, in which the transform is written; the speeds are their derivatives
    rotation      (3, 3) of the coordinates and parameters, components in the child's joint frame to components in the
                  parent's (SymPy's rot_ccw_axis3, not rot_axis3); default: identity
    position      (3,) of the coordinates and parameters, origin of the child's joint frame in the parent's, m; default: zero
    units         of the coordinates, such as ("rad", "m"); default: "1". A coordinate in "rad" or "1" counts as an angle where
                  speeds are compared with velocities (scaling of constraints, spans of searches), one in "m" as a length

    Everything else follows by exact differentiation. The rotation must be one at every value of its symbols, and every
    coordinate must move the child in a way of its own; both are tried at random points. A motion that is given, or follows
    other coordinates, needs no joint of its own: Free takes expressions as coordinates.

    >>> s = sd.coordinates("s")
    >>> system = sd.System("bead")
    >>> joint = sd.Custom("wire", system.ground, system.add_body("bead", mass=1), [s], position=[s, 0, s**2], units=["m"])
    >>> joint.coordinates
    (s,)
    """

    kind = "custom"

    def __init__(self, name: str, parent: BodyOrName, child: BodyOrName, coordinates: Sequence[Scalar],
                 rotation: Matrix | None = None, position: Vector = (0, 0, 0), units: Sequence[str] | None = None,
                 speeds: Sequence[sp.Symbol] | None = None, parent_point: Vector = (0, 0, 0), child_point: Vector = (0, 0, 0),
                 parent_rotation: Matrix | None = None, child_rotation: Matrix | None = None) -> None:
        given = tuple(coordinates) if listed(coordinates) else coordinates
        super().__init__(name, parent, child, given, speeds, parent_point, child_point, parent_rotation, child_rotation)
        self._where = where = f"joint {shown(name)} (custom)"
        named = all(isinstance(q, Coordinate) for q in self.coordinates)
        # A plain symbol that is given as a coordinate is one in the transform, too.
        same = dict(zip(given, self.coordinates, strict=True)) if named else {}
        self.rotation = _decimal(self.faults.matrix(IDENTITY if rotation is None else rotation, f"{where}: rotation"), same)
        self.position = _decimal(self.faults.vector(position, f"{where}: position", planar=True), same)
        self._take_units(units)
        if named:
            self._reject_foreign()
        self.transform = None if self.faults else self._differentiated()
        self.identity_at_zero = self.transform is not None and self.transform.identity_at_zero

    @property
    def constants(self) -> list[sp.Expr]:
        used: dict[sp.Symbol, None] = {}
        for e in (*self.rotation, *self.position):
            used.update(dict.fromkeys(sorted(filter(_is_parameter, symbols_of(e)), key=str)))
        return [*super().constants, *used]

    def motion(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> JointMotion:
        assert self.transform is not None
        here = algebra.within(dict(zip(self.coordinates, s, strict=True)))
        c = zeros(6)
        for (j, k), factors in self.transform.c.items():
            c = c + here.constants(factors) * (sd[j] * sd[k])
        return JointMotion(here.matrix(self.rotation), here.constants(self.position), here.matrix(self.transform.S), c)

    # -- checks

    def _coordinates(self, given: Any) -> tuple[sp.Expr, ...]:
        taken = [as_coordinate(e) for e in given] if isinstance(given, tuple) else []
        if not 1 <= len(taken) <= 6 or not all(isinstance(e, Coordinate) for e in taken) or len(set(taken)) < len(taken):
            self.faults.append(f"joint {shown(self.name)} (custom): coordinates is {shown(given)}; pass a list of 1 to 6 "
                               "different "
                               "symbols, made with sd.coordinates (for a given motion, or one that follows other coordinates, "
                               "pass expressions to Free)")
            taken = [sp.S.Zero] * max(1, len(taken))
        self.coordinate_units = ("1",) * len(taken)
        return tuple(taken)

    def _take_units(self, units: Any) -> None:
        if units is None:
            return
        given = tuple(units) if listed(units) else ()
        if len(given) != len(self.coordinates) or not all(isinstance(u, str) and NAME.fullmatch(u) for u in given):
            self.faults.append(f"{self._where}: units is {shown(units)}; pass a text such as 'rad' for each of its "
                               f"{len(self.coordinates)} coordinates")
            return
        self.coordinate_units = given

    def _reject_foreign(self) -> None:
        for what, matrix in (("rotation", self.rotation), ("position", self.position)):
            foreign = sorted(str(s) for s in symbols_of(matrix) if s not in self.coordinates and not _is_parameter(s))
            if foreign:
                self.faults.append(f"{self._where}: its {what} uses {', '.join(foreign)}; it may use the joint's own coordinates "
                                   f"({', '.join(map(str, self.coordinates))}) and parameters")

    def _differentiated(self) -> Transform | None:
        try:
            transform = Transform(self.coordinates, self.rotation, self.position)
            faults = transform.faults()
        except (UnsupportedExpression, ZeroDivisionError) as error:
            faults = [f"its transform, or a derivative of it, cannot be computed: {error}"]
        self.faults.extend(f"{self._where}: {fault}" for fault in faults)
        return None if faults else transform


def _is_parameter(symbol: sp.Symbol) -> bool:
    return type(symbol) is sp.Symbol and symbol.name != "t"


def _decimal(matrix: sp.ImmutableMatrix, same: dict[sp.Basic, sp.Basic]) -> sp.ImmutableMatrix:
    """The matrix with symbols replaced, and floats by the decimal fractions that they are written as: 0.6**2 + 0.8**2 = 1."""
    return matrix.xreplace({**same, **{f: sp.Rational(repr(float(f))) for f in matrix.atoms(sp.Float)}})
