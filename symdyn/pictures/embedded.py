"""Pictures as text that an HTML file can hold."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from symdyn.pictures.bodies import draw_path, flat, make_artists, make_axes, show
from symdyn.pictures.curves import draw_panel
from symdyn.pictures.drawing import Drawing
from symdyn.pictures.figure import Picture
from symdyn.pictures.panels import Panel, panels_of, take

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

# Points of all curves of a panel from which on it is stored as pixels.
_MANY = 200_000
# A curve this many times as large as the next smaller one flattens it; such a small part of the largest is nothing.
_FLATTENS, _NOTHING = 15.0, 1e-7


@dataclass(frozen=True)
class Embedded:
    """A picture that a page holds.

    source   address of the <img>; title, text: what it shows
    """

    source: str
    title: str
    text: str = ""


def mechanism(solution: Solution, times: Sequence[tuple[str, float]]) -> tuple[Embedded, ...]:
    """The mechanism at named times, and its way; none if nothing can be drawn."""
    drawing = Drawing.of(solution) if len(solution.t) else None
    if drawing is None:
        return ()
    result = []
    there = drawing.at(solution.t, np.array([t for _, t in times])) if len(solution.t) > 1 else drawing
    for k, (title, t) in enumerate(times):
        figure = _square(drawing)
        show(make_artists(make_axes(figure, 111, drawing), there), there, k)
        result.append(Embedded(_source(figure, tight=True), title, f"t = {t:.5g} s"))
    if len(solution.t) > 1:
        figure = _square(drawing)
        draw_path(figure, 111, drawing)
        text = figure.axes[0].get_title()
        figure.axes[0].set_title("")
        result.append(Embedded(_source(figure, tight=True), "motion", text))
    return tuple(result)


def curves(solution: Solution) -> tuple[Embedded, ...]:
    """Curves over time, one picture for each unit."""
    panels = panels_of(solution) if len(solution.t) else []
    return tuple(_curves(solution.t, part) for panel in panels for part in _apart(panel))


def _apart(panel: Panel) -> list[Panel]:
    """Curves that would flatten the others, such as the angle of a rotor, get axes of their own."""
    sizes = np.abs(panel.values).max(axis=0)
    rising = np.sort(sizes[sizes > _NOTHING * sizes.max()])
    gaps = rising[1:] / rising[:-1]
    if panel.group == "energy" or not gaps.max(initial=0.0) > _FLATTENS:
        return [panel]
    large = sizes >= rising[1:][gaps.argmax()]
    return [take(panel, np.flatnonzero(mask).tolist(), panel.part) for mask in (~large, large)]


def balance(solution: Solution, rows: np.ndarray) -> tuple[Embedded, ...]:
    """Work of the loads with what resets of events add, and change of energy, (n_t, 2), and their difference over time."""
    added = "work of loads and resets" if solution.reset_energy else "work of loads"
    less = f"{added.replace(' of loads', '')} \N{MINUS SIGN} change"
    return (_curves(solution.t, Panel("energy", "J", [added, "change"], rows, [added, "change"])),
            _curves(solution.t, Panel("", "J", [less], rows[:, :1] - rows[:, 1:], [less]), small=True))


def _curves(t: np.ndarray, panel: Panel, small: bool = False) -> Embedded:
    figure = Picture(figsize=(6.2, 2.6), layout="constrained")
    axes: Any = figure.add_subplot(111)
    draw_panel(axes, t, panel)
    if small:
        axes.autoscale(axis="y")
    axes.set_xlabel("t [s]")
    title = f"{panel.title}: {', '.join(panel.names)}" if panel.title else panel.names[0]
    return Embedded(_source(figure, "png" if panel.values.size > _MANY else "svg"), title.replace("\n", " "))


def _square(drawing: Drawing) -> Figure:
    """A figure for the mechanism, as high as it needs."""
    if drawing.spatial:
        figure = Picture(figsize=(4.8, 4.8))
        figure.subplots_adjust(0, 0, 1, 1)
        return figure
    spans = np.ptp(drawing.limits(), axis=1)
    return Picture(figsize=(4.2, 4.0 * float(np.clip(spans[1] / spans[0], 0.35, 1.2)) + 0.5), layout="constrained")


def _around(figure: Any) -> Bbox | None:
    """Box of what is drawn in axes of space, inches."""
    axes = figure.axes[0]
    if not hasattr(axes, "zaxis"):
        return None
    figure.canvas.draw()
    limits = [axes.get_xlim(), axes.get_ylim(), axes.get_zlim()]
    corners = axes.transData.transform(flat(axes, np.array([[x, y, z] for x in limits[0] for y in limits[1] for z in limits[2]])))
    boxes = [axis.get_tightbbox(figure.canvas.get_renderer()) for axis in (axes.xaxis, axes.yaxis, axes.zaxis)]
    whole = Bbox.union([Bbox([corners.min(axis=0), corners.max(axis=0)]), *[box for box in boxes if box is not None]])
    return whole.padded(0.06 * figure.dpi).transformed(figure.dpi_scale_trans.inverted())


def _source(figure: Figure, kind: str = "svg", tight: bool = False) -> str:
    """The picture as the address of an <img>; tight: without the blank around it."""
    data = io.BytesIO()
    figure.savefig(data, format=kind, dpi=150, metadata={"Date": None} if kind == "svg" else None,
                   bbox_inches=_around(figure) if tight else None)
    return f"data:image/{'svg+xml' if kind == 'svg' else kind};base64,{base64.b64encode(data.getvalue()).decode()}"
