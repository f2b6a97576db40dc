"""Shape functions of a clamped beam: polynomials, or samples joined by a spline."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import BPoly, CubicHermiteSpline, CubicSpline, PPoly

from symdyn.flexible.table import numbers, rising
from symdyn.shown import name_of

if TYPE_CHECKING:
    from symdyn.given import Row

# A shape is not clamped if the slope that its samples have at the clamp is more than this part of their largest slope.
_LARGEST_SLOPE = 0.25


class Shape:
    """A transverse deflection of a beam that is clamped at x = 0; a mode of unit 1 gives metres.

    direction      "x", "y" or "z" of the beam's frame, not along the beam
    coefficients   of the polynomial in xi = x / L with the powers 2, 3, ... (as in ElastoDyn's files), or with `powers`
    stations, values, slopes, curvatures
                   samples instead of a polynomial. `stations` in the unit of the beam's own: from 0 to L in m, or
                   from 0 to 1 where the beam has `length`. `slopes` and `curvatures` are derivatives by the station.
                   Values alone: a cubic spline with slope 0 at the clamp; with slopes: cubic between the stations; with
                   slopes and curvatures: quintic
    name           what the mode is called

    The sum of two shapes is one shape: Shape("x", ...) + Shape("y", ...) deflects in both directions, as the modes of
    twisted blades do. Faults are reported by the Beam that gets the shape.

    >>> sd.Shape("x", [1, 0.2], powers=[2, 3]).along("x")
    True
    """

    def __init__(self, direction: str, coefficients: Row | None = None, *, powers: Sequence[int] | None = None,
                 stations: Row | None = None, values: Row | None = None, slopes: Row | None = None,
                 curvatures: Row | None = None, name: str = "") -> None:
        self.name = str(name)
        self.faults: list[str] = []
        self.parts: tuple[tuple[str, PPoly | BPoly, bool], ...] = ()  # direction, curve over xi or station, sampled
        if (coefficients is None) == (values is None):
            self.faults.append("a shape has either coefficients or values; pass one of them")
        elif values is None:
            curve = self._polynomial(coefficients, powers)
            self.parts = () if curve is None else ((name_of(direction), curve, False),)
        else:
            curve = self._sampled(stations, values, slopes, curvatures)
            self.parts = () if curve is None else ((name_of(direction), curve, True),)

    def __add__(self, other: Shape) -> Shape:
        if not isinstance(other, Shape):
            return NotImplemented
        both = Shape.__new__(Shape)
        both.name = self.name or other.name
        both.faults = [*self.faults, *other.faults]
        both.parts = (*self.parts, *other.parts)
        return both

    def along(self, direction: str) -> bool:
        """Test of whether it deflects in this direction alone.

        >>> bent = sd.Shape("x", [1.0]) + sd.Shape("y", [1.0])
        >>> sd.Shape("x", [1.0]).along("x"), bent.along("x")
        (True, False)
        """
        return all(part == direction for part, _, _ in self.parts)

    def named(self, name: str) -> Shape:
        """The same shape under another name.

        >>> sd.Shape("x", [1.0]).named("flap").name
        'flap'
        """
        same = Shape.__new__(Shape)
        same.name, same.faults, same.parts = str(name), [*self.faults], self.parts
        return same

    def _polynomial(self, coefficients: Any, powers: Any) -> PPoly | None:
        c = numbers(coefficients, "coefficients", self.faults)
        if c is None:
            return None
        p = numbers(range(2, 2 + c.size) if powers is None else powers, "powers", self.faults)
        if p is None:
            return None
        if p.size != c.size:
            self.faults.append(f"there are {c.size} coefficients and {p.size} powers; pass one power for each coefficient")
            return None
        for power, value in zip(p, c):
            if power != int(power) or power < 0 or power > 40:
                self.faults.append(f"a power is {power:g}; powers are whole numbers from 2 to 40")
            elif power < 2 and value != 0:
                what = "value" if power == 0 else "slope"
                self.faults.append(f"the {what} at the clamp is {value:g} (coefficient of xi^{power:g}); it must vanish, so that "
                                   "powers begin at 2")
        if self.faults:
            return None
        column = np.zeros((int(p.max()) + 1, 1))
        np.add.at(column[:, 0], int(p.max()) - p.astype(int), c)
        return PPoly(column, [0.0, 1.0])

    def _sampled(self, stations: Any, values: Any, slopes: Any, curvatures: Any) -> PPoly | BPoly | None:
        before = len(self.faults)
        x = numbers(stations, "stations of the shape", self.faults)
        size = None if x is None else x.size
        if x is not None:
            rising(x, "stations of the shape", None, self.faults)
        w = numbers(values, "values", self.faults, size)
        dw = None if slopes is None else numbers(slopes, "slopes", self.faults, size)
        ddw = None if curvatures is None else numbers(curvatures, "curvatures", self.faults, size)
        if curvatures is not None and slopes is None:
            self.faults.append("curvatures are given without slopes; pass both")
        if w is not None and w[0] != 0:
            self.faults.append(f"the value at the clamp is {w[0]:g}; a shape function must vanish there")
        if dw is not None and dw[0] != 0:
            self.faults.append(f"the slope at the clamp is {dw[0]:g}; a shape function has none there")
        if len(self.faults) > before or x is None or w is None:
            return None
        if dw is not None and ddw is not None:
            return BPoly.from_derivatives(x, np.stack([w, dw, ddw], axis=-1))
        if dw is not None:
            return CubicHermiteSpline(x, w, dw)
        return self._clamped_spline(x, w)

    def _clamped_spline(self, x: np.ndarray, w: np.ndarray) -> PPoly | None:
        if x.size < 4:
            self.faults.append(f"there are {x.size} values; a spline through values alone needs 4 or more")
            return None
        slopes = CubicSpline(x, w)(x, 1)
        largest = np.abs(slopes).max()
        if abs(slopes[0]) > _LARGEST_SLOPE * largest:
            self.faults.append(f"the values have a slope of {slopes[0]:g} at the clamp, the largest being {largest:g}; a shape "
                               "function has none there")
            return None
        return CubicSpline(x, w, bc_type=((1, 0.0), "not-a-knot"))


class Basis:
    """Shapes on a beam of length L whose stations are times `scale` in metres: their values and derivatives by x."""

    def __init__(self, shapes: Sequence[Shape], axes: Sequence[str], length: float, scale: float) -> None:
        self.n = len(shapes)
        self._parts = [(k, axes.index(direction), curve, scale if sampled else length)
                       for k, shape in enumerate(shapes) for direction, curve, sampled in shape.parts]

    @property
    def breaks(self) -> np.ndarray:
        """Where a curve changes, m."""
        return np.concatenate([curve.x * unit for _, _, curve, unit in self._parts] or [np.zeros(0)])

    @property
    def degree(self) -> int:
        """Degree of the polynomials between the breaks."""
        return max([curve.c.shape[0] - 1 for _, _, curve, _ in self._parts], default=0)

    def __call__(self, x: np.ndarray, derivative: int = 0) -> np.ndarray:
        """(points, 2, n) in the two transverse directions."""
        out = np.zeros((len(x), 2, self.n))
        for k, direction, curve, unit in self._parts:
            out[:, direction, k] += curve(x / unit, derivative) / unit**derivative
        return out
