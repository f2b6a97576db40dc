"""Surroundings of bodies in pictures: what contacts touch, and how mooring lines hang.

It has no part in the equations. Curves and surfaces are texts in x, y and p1, p2, ..., which stand for parameters, or the numbers
of splines.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import sympy as sp
from sympy.printing.str import StrPrinter

from symdyn.model.contacts.contact import Contact
from symdyn.model.contacts.geometry import is_spline
from symdyn.model.contacts.grid import grid_spline_of, line_spline_of
from symdyn.model.contacts.shapes import Bore, Cam, Curve, Plane, Sphere, Surface
from symdyn.model.elements import MooringLine
from symdyn.model.faults import Faults
from symdyn.model.shapes import Drawn
from symdyn.model.symbols import symbols_of
from symdyn.shown import name_of
from symdyn.tape.external import Result

if TYPE_CHECKING:
    from symdyn.model.system import System

# Variables of heights and radii.
ABSCISSAE = ("x", "y")


def surroundings_of(system: System, loads: Iterable[Any], parameters: Iterable[sp.Symbol]) -> tuple[Drawn, ...]:
    """Surroundings by the contacts and mooring lines of a checked system; what follows from other symbols than parameters is left
    out."""
    known = set(parameters)
    result = [*_counterparts(system), *(_line(load) for load in loads if isinstance(load, MooringLine))]
    return tuple(one for one in result if all(symbols_of(e) <= known for e in one.expressions))


def _counterparts(system: System) -> Iterator[Drawn]:
    """Shapes that bodies touch: those on body b of each contact; on a ground that moves they are left out."""
    fixed = system.ground_motion is None
    for contact in system.contacts:
        if isinstance(contact, Contact) and (fixed or name_of(contact.b) != "ground"):
            yield from _drawn(contact.on_b, contact.name, [name_of(contact.a)], contact.b, system.planar)
    for group in system.contact_groups if fixed else ():
        for plane in group.planes:
            yield from _drawn(plane, group.name, [name_of(body) for body in group.bodies], "ground", system.planar)


def _drawn(shape: Any, name: str, on: list[str], body: Any, planar: bool) -> Iterator[Drawn]:
    """on: the bodies that touch it."""
    faults, about = Faults(), {"kind": type(shape).__name__.lower(), "name": name, "on": on}
    values: dict[str, tuple[tuple[sp.Expr, ...], ...]] = {}
    if isinstance(shape, Plane):
        default = (0, 1, 0) if planar else (0, 0, 1)
        values = {"normal": (tuple(faults.vector(default if shape.normal is None else shape.normal, name, planar)),),
                  "point": (tuple(faults.vector(shape.point, name, planar)),)}
    elif isinstance(shape, (Sphere, Bore)):
        values = {"center": (tuple(faults.vector(shape.center, name, planar)),),
                  "radius": ((faults.expression(shape.radius, name),),)}
    else:
        graph = _graph(shape, faults, name)
        if graph is None:
            return
        parameters, text = graph
        about["height"], values = text, {"parameters": (tuple(parameters),)}
    if not faults:
        yield Drawn(body, name, None, values, about)


def _graph(shape: Curve | Surface | Cam, faults: Faults, name: str) -> tuple[list[sp.Symbol], Any] | None:
    """Parameters of a height or radius, and its text or the numbers of its spline; None where it has none."""
    given: Any = shape.radius if isinstance(shape, Cam) else shape.height
    spline = line_spline_of(name, given) if is_spline(given) else grid_spline_of(name, given)
    if spline is not None:
        return [], {"knots": [list(line) for line in spline.knots], "degrees": list(spline.degrees),
                    "coefficients": [list(row) for row in spline.coefficients]}
    symbols = [shape.angle] if isinstance(shape, Cam) else [shape.x, *([shape.y] if isinstance(shape, Surface) else [])]
    height = faults.expression(given, name)
    parameters = sorted(symbols_of(height) - set(symbols), key=lambda s: s.name)
    texts = [*ABSCISSAE[:len(symbols)], *(f"p{k + 1}" for k in range(len(parameters)))]
    names = {s: sp.Symbol(text) for s, text in zip([*symbols, *parameters], texts, strict=True)}
    if height.atoms(Result):
        return None  # a function of the user's, which has no text
    return parameters, StrPrinter({"full_prec": True}).doprint(height.xreplace(names))


def _line(load: MooringLine) -> Drawn:
    """A mooring line: its length, m, and what its shape follows from besides."""
    numbers = (load.length, load.weight * load.length / load.stiffness, load.friction)
    return Drawn(load.body, load.label, None, {"numbers": (numbers,)},
                 {"kind": "mooring", "name": load.label, "seabed": load.seabed})
