"""View of a System in a notebook: a small picture, and tables of bodies, joints and parameters."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from sympy import sstr

from symdyn.errors import ModelError, SymdynError
from symdyn.pages import table
from symdyn.shown import name_of
from symdyn.viewer.live import mechanism_of
from symdyn.viewer.still import picture_of

if TYPE_CHECKING:
    from symdyn.model.record import Model
    from symdyn.model.system import System


def summary_of(system: System) -> str:
    """HTML of a system; of one with faults the list of them."""
    title = f"<b>{escape(repr(system))}</b>"
    try:
        model = system.check()
    except ModelError as error:
        return f"<div>{title}<pre>{escape(str(error))}</pre></div>"
    return (f'<div>{title}<div style="display: flex; flex-wrap: wrap; gap: 16px; align-items: flex-start">{_picture(model)}'
            f"{_tables(model)}</div></div>")


def _picture(model: Model) -> str:
    """At the initial coordinates; none where the mechanism is not defined there."""
    try:
        mechanism, lengths = mechanism_of(model)
    except SymdynError:
        return ""
    return picture_of(mechanism, [shape.record for shape in model.shapes], lengths, model.name)


def _tables(model: Model) -> str:
    bodies = [(b.name, sstr(b.mass, full_prec=False), ", ".join(sstr(x, full_prec=False) for x in b.com)) for b in model.bodies]
    rows = [(j.name, j.kind, f"{name_of(j.parent)} → {name_of(j.child)}", ", ".join(map(str, j.coordinates)))
            for j in model.joints]
    numbers = [(p, f"{model.defaults[p]:.6g}" if p in model.defaults else "", model.units.get(p, "")) for p in model.parameters]
    return (table(("body", "mass", "centre of mass"), bodies) + table(("joint", "kind", "between", "coordinates"), rows)
            + (table(("parameter", "value", "unit"), numbers) if numbers else ""))
