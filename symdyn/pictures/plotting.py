"""The picture of a motion: curves, and the path of the mechanism."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from symdyn.pictures.bodies import draw_path
from symdyn.pictures.curves import draw_panel
from symdyn.pictures.drawing import Drawing
from symdyn.pictures.figure import Picture
from symdyn.pictures.panels import panels_of

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

# Changes of modes that are marked at most.
MOST_SWITCHES = 80


def plot(solution: Solution, path: Any = None, view: Any = None) -> Figure:
    """Coordinates, speeds, states, inputs, outputs and energy over time, and the path of the mechanism.

    view    elevation and azimuth of the eye, degrees, for a mechanism in space

    Dotted lines mark the times at which contacts change their modes, forces of contacts are arrows.
    Returns the figure; saves it (PNG, PDF, SVG by the ending) if a path is given.
    """
    panels, switches = panels_of(solution), _switches(solution)
    drawing = Drawing.of(solution) if len(solution.t) else None
    columns = 1 if len(panels) <= 3 else 2
    rows = -(-len(panels) // columns)
    height = max(2.1 * rows, 5.2 if drawing else 4.2) + 0.5
    side = min(height - 1.0, 5.5)
    widths = [5.2] * columns + ([side] if drawing else [])
    figure = Picture(figsize=(sum(widths), height), layout="constrained")
    grid = figure.add_gridspec(rows, len(widths), width_ratios=widths)
    shared: Any = None
    for k, panel in enumerate(panels):
        row, column = divmod(k, columns)
        # An odd last panel takes the whole row: room left blank says nothing.
        end = columns if k == len(panels) - 1 else column + 1
        axes = figure.add_subplot(grid[row, column:end], sharex=shared)
        shared = shared or axes
        draw_panel(figure, axes, solution.t, panel)
        for t in switches:
            axes.axvline(t, color="0.75", linewidth=0.6, linestyle=":", zorder=0)
        last = row == rows - 1
        axes.tick_params(labelbottom=last)
        if last:
            axes.set_xlabel("t [s]")
    if drawing:
        draw_path(figure, grid[:, columns], drawing, view)
    figure.suptitle(_title(solution), fontsize=11)
    if path is not None:
        figure.save(path)
    return figure


def _switches(solution: Solution) -> list[float]:
    """Times at which contacts change their modes or hit, in order; none where there are too many to be seen."""
    if not len(solution.t):
        return []
    begin = float(solution.t[0])
    times = {float(t) for one in solution.contacts.values()
             for t in (*[when for when, _ in one.switches], *one.impacts.t) if t != begin}
    return sorted(times) if len(times) <= MOST_SWITCHES else []


def _title(solution: Solution) -> str:
    head = f"{solution.module.name}: {solution.n_steps} steps of {solution.method} on {solution.backend}"
    if solution.success:
        return head
    end = f"{solution.t[-1]:.6g}" if len(solution.t) else "its start"
    return f"{head}, stopped early at t = {end} s"
