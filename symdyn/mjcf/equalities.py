"""Loops, constraints and dependent coordinates of a System as equality constraints of MuJoCo's format."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any
from xml.sax.saxutils import quoteattr

import sympy as sp

from symdyn.mjcf.parts import Numbers, Scalar
from symdyn.model.closures import Gear
from symdyn.model.joints import Fixed, Revolute, Spherical
from symdyn.model.record import Model
from symdyn.model.symbols import Coordinate, symbols_of
from symdyn.shown import shown

# Highest power of the polynomials that MuJoCo couples joints by.
_DEGREE = 4


class Equalities:
    """Writes them; site: makes a site on a body and returns its name."""

    def __init__(self, model: Model, numbers: Numbers, owners: Mapping[Any, Scalar], faults: list[str],
                 site: Callable[..., str]) -> None:
        self.model, self.numbers, self.owners, self.faults, self.site = model, numbers, owners, faults, site

    def lines(self, scalars: Sequence[Scalar]) -> Iterator[str]:
        """scalars: the slides and hinges of the file."""
        for scalar in scalars:
            if not isinstance(scalar.coordinate, Coordinate):
                yield from self._dependent(scalar)
        for loop in self.model.loops:
            yield from self._loop(loop)
        for constraint in self.model.constraints:
            yield from self._constraint(constraint.name, constraint.expression)

    def _dependent(self, scalar: Scalar) -> Iterator[str]:
        result = self.numbers.multiple(scalar.coordinate, self.owners)
        if result is None:
            self.faults.append(f"joint {shown(scalar.name)} has the coordinate {scalar.coordinate}; written are coordinates of "
                               "its own, "
                               "and multiples of another's plus a number")
            return
        source, factor, offset = result
        yield self._joint(scalar.name, scalar.name, source.name, [offset, factor])

    def _loop(self, loop: Any) -> Iterator[str]:
        if isinstance(loop, Gear):
            joints = [next(j for j in self.model.joints if given in (j, j.name)) for given in (loop.joint_a, loop.joint_b)]
            yield self._joint(loop.name, joints[1].name, joints[0].name, [loop.offset, loop.ratio])
            return
        if not isinstance(loop, (Fixed, Revolute, Spherical)):
            self.faults.append(f"the loop {shown(loop.name)} is closed by a {loop.kind} joint; written are fixed, revolute and "
                               "spherical "
                               "ones, and gears")
            return
        ends = ((loop.parent, loop.parent_point, loop.parent_rotation), (loop.child, loop.child_point, loop.child_rotation))
        if isinstance(loop, Fixed):
            first, second = (self.site(*end) for end in ends)
            yield f'<weld name={quoteattr(loop.name)} site1="{first}" site2="{second}"/>'
            return
        # A hinge holds two points of its axis.
        for k in range(2 if isinstance(loop, Revolute) and not self.model.planar else 1):
            along = list(loop.axis) if k and isinstance(loop, Revolute) else [0, 0, 0]
            first, second = (self.site(body, sp.Matrix(point) + sp.Matrix(R) * sp.Matrix(along)) for body, point, R in ends)
            name = loop.name if k == 0 else f"{loop.name} 2"
            yield f'<connect name={quoteattr(name)} site1="{first}" site2="{second}"/>'

    def _constraint(self, name: str, expression: sp.Expr) -> Iterator[str]:
        """y = polynomial of x, of two coordinates."""
        e = sp.expand(expression.doit().xreplace(self.numbers.values))
        symbols = sorted(symbols_of(e), key=str)
        if symbols and len(symbols) <= 2 and all(s in self.owners for s in symbols):
            for y in symbols:
                slope, x = e.diff(y), next((s for s in symbols if s != y), None)
                if not slope.is_number:
                    continue
                rest = sp.expand(-(e - slope * y) / slope)
                if x is None:
                    yield self._joint(name, self.owners[y].name, None, [rest])
                    return
                polynomial = sp.Poly(rest, x) if rest.is_polynomial(x) else None
                if polynomial is not None and polynomial.degree() <= _DEGREE:
                    yield self._joint(name, self.owners[y].name, self.owners[x].name, polynomial.all_coeffs()[::-1])
                    return
        self.faults.append(f"the constraint {shown(name)} is {expression} = 0; written are y = polynomial of x, of the "
                           "coordinates of "
                           f"two joints, up to the power {_DEGREE}")

    def _joint(self, name: str, y: str, x: str | None, coefficients: Sequence[Any]) -> str:
        listed = self.numbers.texts([*coefficients, *[0] * (_DEGREE + 1 - len(coefficients))])
        second = "" if x is None else f" joint2={quoteattr(x)}"
        return f'<joint name={quoteattr(name)} joint1={quoteattr(y)}{second} polycoef="{listed}"/>'
