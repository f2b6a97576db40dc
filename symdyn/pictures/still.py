"""Pictures of a mechanism at chosen times."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from symdyn.errors import ArgumentError
from symdyn.kinds import flag
from symdyn.pictures.bodies import explain, height_with_labels, make_artists, make_axes, show, title
from symdyn.pictures.drawing import Drawing
from symdyn.pictures.figure import Picture
from symdyn.real_numbers import real_of
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

_COLUMNS = 4
_SIDE = 4.2
# Room below labels, and for titles above axes of space, in parts of their height.
_MARGIN, _ABOVE = 0.015, 0.1


def picture(solution: Solution, t: Any = None, path: Any = None, view: Any = None, forces: bool = False,
            inertia: bool = False) -> Figure:
    """The mechanism at one time or several (default: start and end), side by side in axes of the same limits.

    view     elevation and azimuth of the eye, degrees, or one pair for each picture
    forces   with arrows of forces in joints, loads and weights, and torques in joints and of loads
    inertia  with the ellipsoids of inertia of bodies

    Returns the figure; saves it if a path is given. Raises ArgumentError for times outside of the motion, if nothing can be
    drawn, and for ellipsoids where no body has one.
    """
    flag(forces, f"{solution.module.name}: forces")
    flag(inertia, f"{solution.module.name}: inertia")
    times, views = _pictures(solution, t, view) if len(solution.t) else (np.zeros(0), [])
    span = (float(times.min()), float(times.max())) if len(times) > 1 else None
    drawing = Drawing.of(solution, forces, span, inertia) if len(times) else None
    if drawing is None:
        raise ArgumentError(f"{solution.module.name}: there is nothing to draw: the function 'positions' is needed, and bodies "
                            "that extend or move")
    there = drawing.at(solution.t, times) if len(solution.t) > 1 else drawing
    spans = np.ptp(there.limits(), axis=1)
    columns = min(len(times), _COLUMNS)
    rows = -(-len(times) // columns)
    height = _SIDE if drawing.spatial else _SIDE * float(np.clip(spans[1] / spans[0], 0.35, 1.2)) + 0.4
    figure = Picture(figsize=(_SIDE * columns, height * rows), layout=None if drawing.spatial else "constrained")
    grid = figure.add_gridspec(rows, columns)
    for k, (time, eye) in enumerate(zip(times, views, strict=True)):
        axes = make_axes(figure, grid[divmod(k, columns)], there, eye)
        show(make_artists(axes, there), there, k if len(solution.t) > 1 else 0)
        title(axes, f"t = {time:.5g} s", 10)
    if drawing.spatial:
        _close_up(figure, rows, columns)
    explain(figure, drawing)
    if path is not None:
        figure.save(path)
    return figure


def _close_up(figure: Any, rows: int, columns: int) -> None:
    """Axes of space are square; leave out of the figure what is blank above and below all of them."""
    for k, axes in enumerate(figure.axes):
        row, column = divmod(k, columns)
        axes.set_position((column / columns, (rows - 1 - row) / rows, 1 / columns, 1 / rows))
        axes.patch.set_visible(False)
    ends = np.array([height_with_labels(axes) for axes in figure.axes])
    low, high = ends[:, 0].min() - _MARGIN, ends[:, 1].max() + _ABOVE
    figure.set_size_inches(_SIDE * columns, _SIDE * (high - low) * rows)
    for k, axes in enumerate(figure.axes):
        row, column = divmod(k, columns)
        axes.set_position((column / columns, (rows - 1 - row) / rows - low / (high - low) / rows, 1 / columns,
                           1 / (high - low) / rows))


def _pictures(solution: Solution, t: Any, view: Any) -> tuple[np.ndarray, list[Any]]:
    """Times of the pictures, and the views on them."""
    name, ends = solution.module.name, sorted((float(solution.t[0]), float(solution.t[-1])))
    given = solution.t[[0, -1]] if t is None else t
    times = np.atleast_1d(real_of(given, name, "t must be a time or a list of times"))
    views = list(view) if isinstance(view, (list, tuple)) and view and not np.isscalar(view[0]) else None
    if t is None and len(solution.t) == 1:
        times = times[:1]
    if views is not None and len(times) == 1:
        times = np.repeat(times, len(views))
    if times.ndim != 1 or not len(times):
        raise ArgumentError(f"{name}: t must be a time or a list of times, found {shown(t)}")
    outside = [float(time) for time in times if not ends[0] <= time <= ends[1]]
    if outside:
        raise ArgumentError(f"{name}: the motion goes from t = {ends[0]:.6g} s to {ends[1]:.6g} s; t = "
                            f"{', '.join(f'{time:.6g}' for time in outside)} s is outside")
    if views is not None and len(views) != len(times):
        raise ArgumentError(f"{name}: {len(views)} views are given for {len(times)} times; give one view, or one for each time")
    return times, views or [view] * len(times)
