"""Splines of SciPy's as functions on the tape, with derivatives: in one variable, and over a grid.

In one variable they are polynomials piece by piece, which are found by bisection. Over a grid they are evaluated by de Boor's
algorithm.

Between the knots t, degree k, a spline in one variable is the sum of c_i B_i. Its derivative has the coefficients
k (c_i - c_(i-1))/(t_(i+k) - t_i) and degree k - 1; its value comes from k + 1 coefficients by mixing neighbours k times. Over a
grid this is done along y for k_x + 1 rows, then along x. Beyond its ends the polynomials of the ends go on.

Source: de Boor, A Practical Guide to Splines, revised edition, 2001, chapter X.
"""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import sympy as sp

from symdyn.tape.algorithms.states import symdyn_stacked
from symdyn.tape.external import UserFunction
from symdyn.tape.node import is_zero

# Degrees of a spline along one variable, as in symdyn_grid_spline.h.
HIGHEST = 5


@dataclass(frozen=True, kw_only=True)
class Spline(UserFunction):
    """Function of its variables and of the orders of the derivatives by them, which are whole numbers: its value or such a
    derivative.

    knots, degrees   along each variable
    coefficients     of a grid (n_x, n_y), of polynomials (n_pieces, degree + 1) from the highest
    """

    knots: tuple[tuple[float, ...], ...] = field(compare=False)
    degrees: tuple[int, ...] = field(compare=False)
    coefficients: tuple[tuple[float, ...], ...] = field(compare=False)

    given = False

    def at(self, *variables: sp.Expr) -> sp.Expr:
        """Its value as an expression."""
        return self.applied([*variables, *[sp.S.Zero] * len(variables)])[0]

    def in_python(self, variables: Sequence[str], orders: Sequence[str]) -> str:
        """A call of its text in Python for numbers."""
        raise NotImplementedError

    def tangents(self, recorder: Any, values: Sequence[Any], results: Sequence[Any], changes: Sequence[Any]) -> list[Any]:
        total: Any = 0
        for k, degree in enumerate(self.degrees):
            higher = self._higher(k, values)
            if not is_zero(changes[k]) and higher[len(self.degrees) + k] <= degree:
                total = total + recorder.call(self, higher)[0] * changes[k]
        return [total]

    def slope(self, index: int, k: int, arguments: Sequence[sp.Expr]) -> sp.Expr:
        higher = self._higher(k, arguments)
        return self.applied(higher)[0] if higher[len(self.degrees) + k] <= self.degrees[k] else sp.S.Zero

    def _higher(self, k: int, values: Sequence[Any]) -> list[Any]:
        """With one derivative more by a variable."""
        higher, place = list(values), len(self.degrees) + k
        higher[place] = int(higher[place]) + 1
        return [sp.Integer(v) if isinstance(v, int) and isinstance(values[0], sp.Basic) else v for v in higher]


@dataclass(frozen=True, kw_only=True)
class LineSpline(Spline):
    """In one variable."""

    def rows(self, values: Sequence[Any]) -> np.ndarray:
        x, order = symdyn_stacked(values)
        result = piece_spline(np.array(self.knots[0]), np.array(self.coefficients), x, int(np.max(order, initial=0)))
        return np.asarray(result)[..., None]

    def precise(self, context: Any, values: Sequence[Any]) -> list[Any]:
        x, order = values
        return [piece_spline([context.mpf(v) for v in self.knots[0]],
                             np.array([[context.mpf(v) for v in row] for row in self.coefficients]), x, int(order))]

    def in_python(self, variables: Sequence[str], orders: Sequence[str]) -> str:
        return f"piece_spline(breaks_of_{self.label}, coefficients_of_{self.label}, {variables[0]}, {orders[0]})"


@dataclass(frozen=True, kw_only=True)
class GridSpline(Spline):
    """Over a grid."""

    def rows(self, values: Sequence[Any]) -> np.ndarray:
        x, y, *orders = symdyn_stacked(values)
        result = grid_spline([np.array(t) for t in self.knots], self.degrees, np.array(self.coefficients), (x, y),
                             _orders([float(np.max(v, initial=0)) for v in orders]))
        return np.asarray(result)[..., None]

    def precise(self, context: Any, values: Sequence[Any]) -> list[Any]:
        x, y, *orders = values
        knots, rows = ([[context.mpf(v) for v in line] for line in lines] for lines in (self.knots, self.coefficients))
        return [grid_spline(knots, self.degrees, rows, (x, y), _orders(orders))]

    def in_python(self, variables: Sequence[str], orders: Sequence[str]) -> str:
        return (f"grid_spline(knots_of_{self.label}, {self.degrees!r}, coefficients_of_{self.label}, ({', '.join(variables)}), "
                f"({', '.join(orders)}))")


def line_spline_of(label: str, spline: Any) -> LineSpline:
    """The function of polynomials piece by piece, such as SciPy's CubicSpline: breaks x, coefficients c."""
    degree = len(spline.c) - 1
    made = LineSpline(
        name=f"symdyn_call_{label}", label=label, parts=("symdyn_line_spline",), arguments=("x", "order"), results=1,
        texts=(), derivative=None, cost=10 + 2 * degree, numbers=None, digits=piece_spline,
        reason=f"the spline {label} is not finite",
        knots=(tuple(spline.x.tolist()),), degrees=(degree,), coefficients=tuple(tuple(column) for column in spline.c.T.tolist()))
    return replace(made, texts=(("c", _line_in_c(made)), ("numpy", _line_in_python(made))))


def grid_spline_of(label: str, spline: Any) -> GridSpline | None:
    """The function of a spline of SciPy's: RectBivariateSpline and its like, or NdBSpline; None of anything else."""
    parts = _parts(spline)
    if parts is None:
        return None
    knots, coefficients, degrees = parts
    shape = tuple(len(t) - k - 1 for t, k in zip(knots, degrees, strict=True))
    if coefficients.shape != shape or not all(1 <= k <= HIGHEST for k in degrees) or not all(
            np.isfinite(t).all() and (np.diff(t) >= 0).all() and t[k] < t[-k - 1] for t, k in zip(knots, degrees, strict=True)):
        return None
    made = GridSpline(
        name=f"symdyn_call_{label}", label=label, parts=("symdyn_grid_spline",), arguments=("x", "y", "order_x", "order_y"),
        results=1, texts=(), derivative=None, cost=8 * (degrees[0] + 1) * (degrees[1] + 2), numbers=None, digits=grid_spline,
        reason=f"the spline {label} is not finite",
        knots=(tuple(knots[0].tolist()), tuple(knots[1].tolist())), degrees=(degrees[0], degrees[1]),
        coefficients=tuple(tuple(row) for row in coefficients.tolist()))
    return replace(made, texts=(("c", _text_in_c(made)), ("numpy", _text_in_python(made))))


def _parts(spline: Any) -> tuple[list[np.ndarray], np.ndarray, tuple[int, ...]] | None:
    """Knots along x and y, coefficients (n_x, n_y), degrees."""
    try:
        if hasattr(spline, "get_knots"):  # of FITPACK, coefficients row by row
            knots, degrees = spline.get_knots(), tuple(int(k) for k in spline.degrees)
            coefficients = np.asarray(spline.get_coeffs(), dtype=float).reshape(len(knots[0]) - degrees[0] - 1, -1)
        else:
            knots, degrees = spline.t, tuple(int(k) for k in spline.k)
            coefficients = np.asarray(spline.c, dtype=float)
        along = [np.asarray(t, dtype=float) for t in knots]
    except (AttributeError, TypeError, ValueError):
        return None
    if len(along) != 2 or len(degrees) != 2 or coefficients.ndim != 2 or not np.isfinite(coefficients).all():
        return None
    return along, coefficients, degrees


def _orders(orders: Sequence[Any]) -> tuple[int, int]:
    return int(orders[0]), int(orders[1])


# These functions stand in generated modules as they are; t, x and c hold numbers, or x arrays (n,) of them.


def piece_spline(breaks: Any, coefficients: Any, x: Any, order: Any) -> Any:
    """A derivative of polynomials piece by piece; beyond the ends those of the ends go on."""
    piece = 0
    for one in breaks[1:-1]:
        piece = piece + (x >= one)
    at, columns, degree, value = x - np.array(breaks)[piece], coefficients[piece], coefficients.shape[1] - 1, 0
    for k in range(degree - order + 1):
        factor = 1
        for power in range(degree - k - order + 1, degree - k + 1):
            factor = factor * power
        value = value * at + factor * columns[..., k]
    return value


def line_spline(t: Any, k: Any, m: Any, c: Any, x: Any, order: Any) -> Any:
    """The derivative of an order at x, which lies between the knots m and m + 1, from the coefficients m - k to m."""
    c = list(c)
    for p in range(order):
        for j in range(k, p, -1):
            c[j] = (k - p) * (c[j] - c[j - 1]) / (t[m + j - p] - t[m - k + j])
    for r in range(1, k - order + 1):
        for j in range(k, order + r - 1, -1):
            low = t[m - k + j]
            c[j] = c[j - 1] + (x - low) / (t[m + j - order - r + 1] - low) * (c[j] - c[j - 1])
    return c[k]


def grid_spline(knots: Any, degrees: Any, coefficients: Any, at: Any, orders: Any) -> Any:
    """A derivative of a spline over a grid; at: (x, y)."""
    places = []
    for t, k, v in zip(knots, degrees, at, strict=True):
        low = k
        for one in t[k + 1:len(t) - k - 1]:
            low = low + (v >= one)
        places.append(low)
    (k, other), (m, n) = degrees, places
    lines = []
    for i in range(k + 1):
        if hasattr(m, "shape"):
            row = [coefficients[m - k + i, n - other + j] for j in range(other + 1)]
        else:
            row = [coefficients[m - k + i][n - other + j] for j in range(other + 1)]
        lines.append(line_spline(knots[1], other, n, row, at[1], orders[1]))
    return line_spline(knots[0], k, m, lines, at[0], orders[0])


def _line_in_python(spline: LineSpline) -> str:
    name = spline.label
    lines = [*inspect.getsource(piece_spline).splitlines(), f"def {name}(x, order):",
             f"    return piece_spline(breaks_of_{name}, coefficients_of_{name}, x, int(np.max(order, initial=0)))",
             f"breaks_of_{name} = np.array({list(spline.knots[0])!r})",
             f"coefficients_of_{name} = np.array({[list(row) for row in spline.coefficients]!r})"]
    return "\n".join(line.rstrip().replace(": Any", "").replace(" -> Any", "") for line in lines)


def _line_in_c(spline: LineSpline) -> str:
    name, degree, n = spline.label, spline.degrees[0], len(spline.coefficients)
    return "\n".join([
        *_table(f"{name}_x", spline.knots[0]), *_table(f"{name}_c", [v for row in spline.coefficients for v in row]), "",
        f"static double {name}_at(double x, int order) {{",
        f"    return symdyn_line_spline({name}_x, {name}_c, {n}, {degree}, x, order);", "}", "",
        f"static int {name}(const double *in, double *out) {{", f"    out[0] = {name}_at(in[0], (int)in[1]);",
        "    return 0;", "}"])


def _text_in_python(spline: GridSpline) -> str:
    lines = [inspect.getsource(line_spline), inspect.getsource(grid_spline),
             f"def {spline.label}(x, y, order_x, order_y):",
             "    orders = int(np.max(order_x, initial=0)), int(np.max(order_y, initial=0))",
             f"    return grid_spline(knots_of_{spline.label}, {spline.degrees!r}, coefficients_of_{spline.label}, (x, y),",
             "                       orders)",
             f"knots_of_{spline.label} = [np.array({list(spline.knots[0])!r}), np.array({list(spline.knots[1])!r})]",
             f"coefficients_of_{spline.label} = np.array({[list(row) for row in spline.coefficients]!r})"]
    return "\n".join(line.rstrip().replace(": Any", "").replace(" -> Any", "") for line in lines)


def _text_in_c(spline: GridSpline) -> str:
    name, shape = spline.label, (len(spline.coefficients), len(spline.coefficients[0]))
    fields = ", ".join([f"{name}_x", f"{name}_y", f"{name}_c", *map(str, shape), *map(str, spline.degrees)])
    return "\n".join([
        *_table(f"{name}_x", spline.knots[0]), *_table(f"{name}_y", spline.knots[1]),
        *_table(f"{name}_c", [v for row in spline.coefficients for v in row]), "",
        f"static double {name}_at(double x, double y, int order_x, int order_y) {{",
        f"    const symdyn_spline grid = {{{fields}}};", "    return symdyn_grid_spline(&grid, x, y, order_x, order_y);", "}", "",
        f"static int {name}(const double *in, double *out) {{",
        f"    out[0] = {name}_at(in[0], in[1], (int)in[2], (int)in[3]);", "    return 0;", "}"])


def _table(name: str, numbers: Sequence[float]) -> list[str]:
    """An array of C, some numbers a line."""
    lines = [f"static const double {name}[] = {{"]
    for first in range(0, len(numbers), 5):
        lines.append(f"    {', '.join(repr(v) for v in numbers[first:first + 5])},")
    return [*lines, "};"]
