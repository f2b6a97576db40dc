"""Splines, and points where round shapes touch, in C and in Python: the same bits, and the same inputs rejected."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.interpolate import BSpline, CubicSpline, PPoly, RectBivariateSpline, make_interp_spline

import symdyn as sd
from symdyn.model.contacts.grid import HIGHEST, Spline, grid_spline_of, line_spline_of
from symdyn.model.contacts.touching import Touching
from symdyn.tape.external import Result, UserFunction
from tests.c_rows import Rows, needs_c, rows_in_c

INPUTS = 10_000
Shapes = sd.contacts
X, Y = sp.symbols("X Y")

pytestmark = [pytest.mark.native, needs_c]


def in_c(function: UserFunction, folder: Path) -> Rows:
    """The function's text in C."""
    included = "".join(f'#include "{part}.h"\n' for part in ("prelude", *function.parts))
    return rows_in_c(folder, f"{included}{function.text('c')}", f"{function.label}(", len(function.arguments), function.results)


# -- splines


def grid(k_x: int, k_y: int, n_x: int, n_y: int) -> Spline:
    stream = np.random.default_rng(k_x)
    knots = [np.sort(stream.uniform(-1, 2, n)) for n in (n_x, n_y)]
    result = grid_spline_of("road", RectBivariateSpline(*knots, stream.normal(size=(n_x, n_y)), kx=k_x, ky=k_y))
    assert result is not None
    return result


def line(degree: int) -> Spline:
    stream = np.random.default_rng(degree)
    x, y = np.cumsum(stream.uniform(0.1, 1, 40)), stream.normal(size=40)
    spline: Any = CubicSpline(x, y) if degree == 3 else PPoly.from_spline(BSpline(*make_interp_spline(x, y, degree).tck))
    return line_spline_of("road", spline)


SPLINES: dict[str, Callable[[], Spline]] = {
    "line 3": lambda: line(3), "line 5": lambda: line(5), "grid 3 3": lambda: grid(3, 3, 12, 9),
    "grid 4 1": lambda: grid(4, 1, 11, 5), f"grid 1 {HIGHEST}": lambda: grid(1, HIGHEST, 6, 14)}


@pytest.mark.parametrize("name", SPLINES)
def test_splines_in_c_and_in_python_give_the_same_bits(name: str, tmp_path: Path) -> None:
    """At random places, at and next to knots, far beyond the ends and at what is no number; values and derivatives."""
    spline = SPLINES[name]()
    n, stream = len(spline.knots), np.random.default_rng(1)
    at = np.empty((INPUTS, n))
    for k, knots in enumerate(map(np.array, spline.knots)):
        width = knots[-1] - knots[0]
        at[:, k] = stream.uniform(knots[0] - width, knots[-1] + width, INPUTS)
        at[::5, k] = stream.choice(knots, len(at[::5]))
        at[1::10, k] = np.nextafter(stream.choice(knots, len(at[1::10])), stream.choice([-np.inf, np.inf], len(at[1::10])))
        at[3 + k::400, k] = stream.choice([np.nan, np.inf, -np.inf, 1e200, 1e308], len(at[3 + k::400]))
    compiled, found = in_c(spline, tmp_path), 0
    orders = list(itertools.product(range(4), repeat=n))
    for part, order in zip(np.array_split(at, len(orders)), orders, strict=True):
        values = np.column_stack([part, np.tile(np.array(order, dtype=float), (len(part), 1))])
        expected, failed = compiled(values)
        with np.errstate(all="ignore"):
            rows = spline.rows([*part.T, *map(float, order)])
        np.testing.assert_array_equal(rows, expected)
        assert not failed.any()
        found += int(np.isfinite(rows).sum())
    assert 0.9 * INPUTS < found < INPUTS


# -- touching points


class _Math:
    """NumPy's functions for single numbers, by the C library's, which the C text calls."""

    sin, cos, sqrt, exp = math.sin, math.cos, math.sqrt, math.exp
    where = staticmethod(lambda condition, a, b: a if condition else b)
    minimum, maximum, abs, absolute = min, max, abs, abs

    def __getattr__(self, name: str) -> Any:
        return getattr(np, name)


def touching(planar: bool, shape: Any, ground: Any, compliant: bool = False) -> Touching:
    """The function of the touching point, as a contact of a free body calls it."""
    system = sd.System("rough", planar=planar)
    body = system.add_body("body", mass=1.0, inertia=1 if planar else [1, 2, 3])
    system.add_joint(sd.Planar("free", system.ground, body) if planar else sd.Free("free", system.ground, body))
    law: dict[str, Any] = {"law": "compliant", "compliance": Shapes.Compliance(1e4, slip_speed=0.1)} if compliant else {}
    system.add_contact(sd.Contact("touch", body, system.ground, shape=(shape, ground), friction=0.5, **law))
    model = system.check()
    found = {r.intrinsic for load in (model.loads, model.contacts, model.compliant, model.events)
             for e in _expressions(load) for r in e.atoms(Result) if isinstance(r.intrinsic, Touching)}
    result, = found
    return result


def _expressions(record: Any) -> list[sp.Expr]:
    if isinstance(record, sp.Basic):
        return [record]
    if isinstance(record, (tuple, list, np.ndarray)):
        return [e for entry in record for e in _expressions(entry)]
    return [e for entry in vars(record).values() for e in _expressions(entry)] if hasattr(record, "__dict__") else []


ALONG = np.linspace(-3, 3, 13)
GRID = RectBivariateSpline(ALONG, ALONG, np.sin(ALONG)[:, None] * ALONG / 3)
CURVE = CubicSpline(np.linspace(-3, 3, 70), 0.1 * np.cos(2 * np.linspace(-3, 3, 70)))
WAVES = sp.sin(X) * Y / 3
# Planar or not, shape, ground, whether the contact yields, how many inputs: splines take longer in Python.
SHAPES: dict[str, tuple[bool, Any, Any, bool, int]] = {
    "circle on a curve": (True, Shapes.Sphere(0.3), Shapes.Curve(sp.sin(X) / 3, X), False, INPUTS // 5),
    "sphere on a surface": (False, Shapes.Sphere(0.3), Shapes.Surface(WAVES, X, Y), False, INPUTS // 10),
    "yielding sphere": (False, Shapes.Sphere(0.3), Shapes.Surface(WAVES, X, Y), True, INPUTS // 10),
    "disc on a surface": (False, Shapes.Disc(0.3, [0, 1, 0]), Shapes.Surface(WAVES, X, Y), False, INPUTS // 25),
    "circle on a spline": (True, Shapes.Sphere(0.3), Shapes.Curve(CURVE, X), False, INPUTS // 50),
    "torus on a spline": (False, Shapes.Torus(0.3, 0.05, [0, 1, 0]), Shapes.Surface(GRID, X, Y), False, INPUTS // 100)}


def in_python(function: Touching, values: np.ndarray) -> np.ndarray:
    """The same by its text in Python, state by state."""
    text = function.text("numpy")
    assert text is not None

    def made(numbers: Any) -> Callable[..., Any]:
        names: dict[str, Any] = {"np": numbers, "math": math}
        exec(text, names)
        result: Callable[..., Any] = names[function.label]
        return result

    fast, slow = made(_Math()), made(np)
    out = np.empty((len(values), function.results))
    with np.errstate(all="ignore"):
        for k, row in enumerate(values):
            try:
                found = fast(*[[v] for v in row.tolist()])
            except (ZeroDivisionError, ValueError, OverflowError):  # NumPy gives inf and NaN there
                found = slow(*row[:, None])
            out[k] = np.ravel(found)
    return out


def places(function: Touching, n: int) -> np.ndarray:
    """Centres over hollows and hills, shapes that fit into no hollow, and others that are none."""
    stream = np.random.default_rng(n)
    columns = {"c_x": stream.uniform(-4, 4, n), "c_y": stream.uniform(-4, 4, n), "radius": 10.0 ** stream.uniform(-2, 0.7, n),
               "tube": stream.uniform(0.01, 0.2, n), "c_up": stream.uniform(-1, 2, n)}
    axes = stream.normal(size=(3, n))
    axes[:, ::10] = np.array([[0.0], [0.0], [1.0]])  # a disc that lies flat
    columns |= dict(zip(("e_x", "e_y", "e_z"), axes / np.linalg.norm(axes, axis=0), strict=True))
    columns["radius"][::25] = stream.choice([0.0, -0.3, 1e-300, np.nan, np.inf], len(columns["radius"][::25]))
    columns["c_x"][7::50] = stream.choice([np.nan, np.inf, 1e8, 0.0], len(columns["c_x"][7::50]))
    return np.column_stack([columns[name] for name in function.arguments])


@pytest.mark.parametrize("name", SHAPES)
def test_touching_points_in_c_and_in_python_have_the_same_bits(name: str, tmp_path: Path) -> None:
    planar, shape, ground, yields, n = SHAPES[name]
    function = touching(planar, shape, ground, yields)
    values = places(function, n)
    expected, failed = in_c(function, tmp_path)(values)
    expected[failed] = np.nan
    found = in_python(function, values)
    np.testing.assert_array_equal(found, expected)
    assert 0.3 < np.isfinite(found).all(axis=1).mean() < 1
