"""The picture of a motion: curves, and the path of the mechanism."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import matplotlib
from matplotlib.figure import Figure

from symdyn.kinds import word
from symdyn.pictures.bodies import draw_path
from symdyn.pictures.curves import draw_panel
from symdyn.pictures.drawing import Drawing
from symdyn.pictures.figure import Picture
from symdyn.pictures.marks import events_of, switches_of
from symdyn.pictures.panels import Panel, need_something, panels_of
from symdyn.pictures.style import STYLES, Style

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

# Events that are named at most.
MOST_NAMES = 8
# Sets of axes in one column at most, and columns.
_ROWS, _COLUMNS = 4, 3


def plot(solution: Solution, path: Any = None, view: Any = None, show: Sequence[Any] | None = None,
         style: str = "screen") -> Figure:
    """Coordinates, speeds, states, inputs, outputs and energy over time, and the path of the mechanism.

    view    elevation and azimuth of the eye, degrees, for a mechanism in space
    show    names of coordinates, speeds, states, inputs or outputs, of groups of them ("coordinates", "speeds", "states",
            "inputs", "outputs", "energy"), and "mechanism"; None for all
    style   "screen", or "paper": curves alone for a column of a journal

    Dotted lines mark the times at which contacts change their modes, dashed ones events; forces of contacts are arrows.
    Returns the figure; saves it (PNG, PDF, SVG by the ending) if a path is given. Raises ArgumentError for names that there are
    not, and where nothing is left to show.
    """
    made_for = STYLES[word(style, STYLES, f"{solution.module.name}: style")]
    panels = panels_of(solution, show)
    mechanism = style == "screen" and (show is None or "mechanism" in show)
    drawing = Drawing.of(solution) if mechanism and len(solution.t) else None
    need_something(solution, show, panels or drawing)
    with matplotlib.rc_context(made_for.settings):
        figure = _figure(solution, panels, drawing, made_for, view)
        if style == "screen":
            figure.suptitle(_title(solution), fontsize=11)
        if path is not None:
            figure.save(path)
    return figure


def _figure(solution: Solution, panels: Sequence[Panel], drawing: Drawing | None, style: Style, view: Any) -> Picture:
    """Curves in columns one below the other, over the same time, and the mechanism on their right."""
    columns = min(_COLUMNS, -(-len(panels) // _ROWS)) if style.aside else min(1, len(panels))
    rows = -(-len(panels) // max(columns, 1))
    height = max(style.high * rows, 5.2 if drawing else style.high) + (0.5 if style.aside else 0.35)
    side = min(height - 1.0, 5.5)
    widths = [style.wide] * columns + ([side] if drawing else [])
    figure = Picture(figsize=(sum(widths), height), layout="constrained")
    grid = figure.add_gridspec(max(rows, 1), len(widths), width_ratios=widths)
    events, switches = events_of(solution), sorted({mark.t for mark in switches_of(solution)})
    shared: Any = None
    for k, panel in enumerate(panels):
        column, row = divmod(k, rows)
        axes = figure.add_subplot(grid[row, column], sharex=shared)
        shared = shared or axes
        draw_panel(axes, solution.t, panel, style)
        for t in switches:
            axes.axvline(t, color="0.7", linewidth=0.6, linestyle=":", zorder=0)
        for t, _ in events:
            axes.axvline(t, color="0.45", linewidth=0.7, linestyle=(0, (4, 3)), zorder=0)
        if row == 0 and len(events) <= MOST_NAMES:
            for t, event in events:
                axes.annotate(event, (t, 1.0), xycoords=axes.get_xaxis_transform(), xytext=(2, -2), textcoords="offset points",
                              rotation=90, ha="left", va="top", fontsize=style.legend - 1, color="0.35")
        last = row == rows - 1 or k == len(panels) - 1
        axes.tick_params(labelbottom=last)
        if last:
            axes.set_xlabel("$t$ [s]")
    if drawing:
        draw_path(figure, grid[:, columns], drawing, view)
    figure.align_ylabels()
    return figure


def _title(solution: Solution) -> str:
    head = f"{solution.module.name}: {solution.n_steps} steps of {solution.method} on {solution.backend}"
    if solution.success:
        return head
    end = f"{solution.t[-1]:.6g}" if len(solution.t) else "its start"
    return f"{head}, stopped early at t = {end} s"
