"""Draws the bodies of a mechanism."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.ticker import MaxNLocator

from symdyn.errors import ArgumentError
from symdyn.pictures.arrows import TITLES
from symdyn.pictures.drawing import Drawing
from symdyn.pictures.grounds import COLOR
from symdyn.pictures.looks import color_of_body
from symdyn.pictures.scene import Scene
from symdyn.pictures.skeleton import Skeleton
from symdyn.pictures.style import MANY
from symdyn.real_numbers import NotReal, real
from symdyn.shown import shown

# Elevation and azimuth of the eye, degrees; on shapes it looks more from the side.
VIEW = (22.0, -55.0)
VIEW_OF_SOLIDS = (14.0, -58.0)
# Zoom of the axes' box before it is fitted.
ZOOM = 0.79
# Thickness of flat ground, as a part of the extent of the picture; largest distance of its normal from a plane picture.
_THICK, _UPRIGHT = 0.015, 1e-6
# Width of an entry and height of a line of the legend of arrows, inches.
_ENTRY, _LINE = 2.0, 0.16
# Width of a letter of the axes' numbers, points.
_LETTER = 3.5
# Order of what is drawn over all shapes.
ABOVE = 1e6


def make_axes(figure: Figure, place: Any, drawing: Drawing, view: Any = None) -> Any:
    """Axes for a drawing; view: elevation and azimuth of the eye, degrees, of a drawing in space.

    Raises ArgumentError for a view that is none.
    """
    elevation, azimuth = _view(view, drawing)
    axes: Any = figure.add_subplot(place, projection="3d" if drawing.spatial else None)
    limits, below = drawing.limits(), int(np.abs(drawing.up).argmax())
    flipped = drawing.up[below] < 0 and below in drawing.axes
    # An axis that points down is turned over, in space with the one before it: no picture is a mirror image.
    over = {below, *([(below - 1) % 3] if drawing.spatial else ())} if flipped else set()
    ends = [pair[::-1] if axis in over else pair for axis, pair in zip(drawing.axes, limits, strict=True)]
    axes.set_xlim(*ends[0])
    axes.set_ylim(*ends[1])
    axes.set_xlabel(f"{drawing.labels[0]} [m]")
    axes.set_ylabel(f"{drawing.labels[1]} [m]")
    if drawing.spatial:
        axes.set_zlim(*ends[2])
        axes.set_zlabel(f"{drawing.labels[2]} [m]")
        axes.set_box_aspect(np.ptp(limits, axis=1), zoom=ZOOM)
        axes.view_init(elev=elevation, azim=azimuth, vertical_axis=drawing.labels[int(np.abs(drawing.up).argmax())])
        axes.tick_params(labelsize=8, pad=0)
        axes.tick_params(axis="z", pad=5)
        axes.zaxis.labelpad = 8
        axes.xaxis.labelpad = axes.yaxis.labelpad = 8
        _fill(axes, limits)
        for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
            axis.pane.set_facecolor("0.98")
            axis.line.set_color("0.5")
            axis._axinfo["grid"].update(color="0.88", linewidth=0.7)
    else:
        axes.set_aspect("equal")
        spans = np.ptp(limits, axis=1)
        axes.locator_params(axis="x", nbins=int(np.clip(7 * spans[0] / spans[1], 2, 6)))
        axes.grid(True, color="0.92", linewidth=0.7)
        axes.set_axisbelow(True)
        for corners in _strips(drawing, limits):
            axes.add_patch(Polygon(corners, facecolor=COLOR, linewidth=0))
    return axes


def _strips(drawing: Drawing, limits: np.ndarray) -> Iterator[np.ndarray]:
    """Planes of the ground that are seen from their edge, from one end of a plane picture to the other, (4, 2)."""
    middle, far = limits.mean(axis=1), 2 * float(np.ptp(limits))
    for normal, level in drawing.planes:
        n = normal[drawing.axes]
        if abs(np.linalg.norm(n) - 1) < _UPRIGHT:
            at, along = middle + (level - n @ middle) * n, far * np.array([-n[1], n[0]])
            down = -_THICK * float(np.ptp(limits)) * n
            yield np.array([at - along, at + along, at + along + down, at - along + down])


def _fill(axes: Any, limits: np.ndarray) -> None:
    """Make the box as large as the labels around it leave room for; no labels for an axis that points at the eye."""
    corners = np.array([[x, y, z] for x in limits[0] for y in limits[1] for z in limits[2]])
    zoom = ZOOM
    for _ in range(2):  # a nearer box is seen in a stronger perspective
        view = axes.viewLim
        spans = 2 * np.abs(flat(axes, corners) - (view.min + view.max) / 2).max(axis=0) / view.size
        zoom *= float(min(0.7 / spans[0], 0.78 / spans[1]))
        axes.set_box_aspect(np.ptp(limits, axis=1), zoom=zoom)
    middle, halves = limits.mean(axis=1), np.diag(np.ptp(limits, axis=1) / 2)
    lengths = [float(np.linalg.norm(np.diff(flat(axes, np.array([middle - half, middle + half])), axis=0))) for half in halves]
    for axis, length in zip((axes.xaxis, axes.yaxis, axes.zaxis), lengths, strict=True):
        if length < 0.2 * max(lengths):
            axis.set_ticks([])
            axis.set_label_text("")
        else:
            axis.set_major_locator(MaxNLocator(max(3, round(5 * length / max(lengths))), steps=[1, 2, 2.5, 5, 10]))
    # The numbers of the upright axis stand between it and its label.
    longest = max((len(text) for text in axes.zaxis.get_major_formatter().format_ticks(axes.get_zticks())), default=0)
    axes.zaxis.labelpad = 8 + _LETTER * max(longest - 3, 0)


def height_of(axes: Any) -> tuple[float, float]:
    """Where the box of axes of space begins and ends from below, in parts of their height."""
    limits = (axes.get_xlim(), axes.get_ylim(), axes.get_zlim())
    heights = flat(axes, np.array([[x, y, z] for x in limits[0] for y in limits[1] for z in limits[2]]))[:, 1]
    view = axes.viewLim
    return float((heights.min() - view.y0) / view.height), float((heights.max() - view.y0) / view.height)


def height_with_labels(axes: Any) -> tuple[float, float]:
    """The same with the numbers and labels of the axes."""
    low, high = height_of(axes)
    box = axes.get_window_extent()
    around = [axis.get_tightbbox(axes.figure.canvas.get_renderer()) for axis in (axes.xaxis, axes.yaxis, axes.zaxis)]
    labels = np.array([[(one.y0 - box.y0) / box.height, (one.y1 - box.y0) / box.height] for one in around if one is not None])
    return min(low, *labels[:, 0]), max(high, *labels[:, 1])


def title(axes: Any, text: str, size: float) -> None:
    """A title close above what is drawn."""
    above = min(height_of(axes)[1] + 0.06, 0.97) if hasattr(axes, "zaxis") else None
    axes.set_title(text, fontsize=size, y=above)


def flat(axes: Any, points: np.ndarray) -> np.ndarray:
    """Points (n, 3) on the screen, (n, 2)."""
    matrix = axes.get_proj()
    there = points @ matrix[:, :3].T + matrix[:, 3]
    return np.asarray(there[:, :2] / there[:, 3:])


def _view(view: Any, drawing: Drawing) -> tuple[float, float]:
    if view is None:
        return VIEW if drawing.solids is None else VIEW_OF_SOLIDS
    wrong = (f"view is {shown(view)}; pass (elevation, azimuth) of the eye in degrees, such as (20, -60); the elevation is "
             "between -90 and 90")
    try:
        angles = real(view)
    except NotReal as error:
        raise ArgumentError(f"{wrong}: {error}") from None
    if angles.shape != (2,) or not (np.isfinite(angles[1]) and abs(angles[0]) <= 90):
        raise ArgumentError(wrong)
    return float(angles[0]), float(angles[1])


def draw_path(figure: Figure, place: Any, drawing: Drawing, view: Any = None) -> None:
    """Start and end of the motion, and the way of the centres of mass."""
    axes = make_axes(figure, place, drawing, view)
    n_b = drawing.centres.shape[1]
    for k in range(n_b) if n_b <= 3 else [n_b - 1]:
        axes.plot(*drawing.centres[:, k].T, color=color_of_body(k), linewidth=0.8, alpha=0.7, zorder=ABOVE)
    for index, alpha in ((0, 0.3), (-1, 1.0)):
        show(make_artists(axes, drawing, alpha), drawing, index)
    which = "centre" if n_b == 1 else "last centre" if n_b > 3 else "centres"
    title(axes, f"start (pale), end, way of the {which} of mass", 9)


def make_artists(axes: Any, drawing: Drawing, alpha: float = 1.0) -> list[Any]:
    """Shapes, and empty curves in the order of `_points_at`."""
    scenes = [Scene(drawing.solids, drawing.axes, drawing.up, alpha)] if drawing.solids is not None else []
    for scene in scenes:
        axes.add_collection(scene, autolim=False)
    return [*scenes, *(_sticks(axes, drawing, drawing.sticks, alpha) if drawing.sticks is not None else ()),
            *_arrows(axes, drawing, alpha)]


def _sticks(axes: Any, drawing: Drawing, sticks: Skeleton, alpha: float) -> list[Any]:
    """Curves for rails, arms, bodies, sliders and centres of mass."""
    empty: list[list[float]] = [[]] * len(drawing.labels)
    colors = [color_of_body(k) for k in range(len(sticks.lines))]
    if len(sticks.pivots):
        axes.plot(*sticks.pivots.T, linestyle="", marker="^", color="0.3", markersize=9, zorder=4)
    style = {"alpha": alpha, "solid_capstyle": "round", "solid_joinstyle": "round"}
    width = 4.0 if len(sticks.lines) <= MANY else 2.0
    return [axes.plot(*empty, color="0.6", linestyle=":", linewidth=1.2, alpha=alpha)[0],
            axes.plot(*empty, color="0.4", linewidth=1.0, alpha=alpha)[0],
            *[axes.plot(*empty, color=c, linewidth=width, marker="o", markersize=width, **style)[0] for c in colors],
            *[axes.plot(*empty, color=colors[k], linestyle="", marker="s", markersize=3.5 * width, alpha=alpha)[0]
              for k in sticks.sliders],
            axes.plot(*empty, color="black", linestyle="", marker="o", markersize=0.8 * width, alpha=alpha)[0]]


def _arrows(axes: Any, drawing: Drawing, alpha: float) -> list[Any]:
    """Curves for arrows, and points where contacts act."""
    empty: list[list[float]] = [[]] * len(drawing.labels)
    result = []
    for one in drawing.arrows:
        color = one.arrows.color
        result.append(axes.plot(*empty, color=color, linewidth=1.6, alpha=alpha, zorder=ABOVE)[0])
        if one.arrows.layer == "contacts":
            result.append(axes.plot(*empty, color=color, linestyle="", marker="o", markersize=4.5, alpha=alpha, zorder=ABOVE)[0])
    return result


def explain(figure: Any, drawing: Drawing) -> None:
    """Explain the colours of arrows and the sizes of the largest ones below all axes; nothing without forces besides contacts."""
    if not any(one.arrows.layer != "contacts" for one in drawing.arrows):
        return
    lines = [Line2D([], [], color=one.arrows.color, linewidth=1.6) for one in drawing.arrows]
    texts = [f"{TITLES[one.arrows.layer]}, up to {one.arrows.largest:.3g} {one.arrows.unit}" for one in drawing.arrows]
    columns = max(1, min(len(texts), int(figure.get_figwidth() / _ENTRY)))
    wide, high = figure.get_size_inches()
    more = _LINE * -(-len(texts) // columns) + _LINE / 2
    places = {axes: axes.get_position() for axes in figure.axes}
    figure.set_size_inches(wide, high + more)
    for axes, place in places.items() if drawing.spatial else ():
        axes.set_position((place.x0, (place.y0 * high + more) / (high + more), place.width, place.height * high / (high + more)))
    figure.legend(lines, texts, loc="lower center" if drawing.spatial else "outside lower center", fontsize=7, frameon=False,
                  handlelength=1.2, columnspacing=1.2, labelspacing=0.3, ncols=columns)


def show(artists: Sequence[Any], drawing: Drawing, index: int) -> None:
    """Place artists where the mechanism is at one of the times."""
    scenes = [artist for artist in artists if isinstance(artist, Scene)]
    for scene in scenes:
        scene.place(index)
    for artist, points in zip(artists[len(scenes):], _points_at(drawing, index), strict=True):
        move(artist, points)


def _points_at(drawing: Drawing, index: int) -> list[np.ndarray]:
    result, sticks = [], drawing.sticks
    if sticks is not None:
        slides = [sticks.lines[k][:, places] for k, places in sticks.sliders.items()]
        result += [points[index] for points in (sticks.rails, sticks.arms, *sticks.lines, *slides,
                                                drawing.centres[:, drawing.bare])]
    for one in drawing.arrows:
        result += [one.curve(index), *([one.tails[index]] if one.arrows.layer == "contacts" else [])]
    return result


def move(artist: Any, points: np.ndarray) -> None:
    """Draw a curve through points, (n, 2 or 3)."""
    if points.shape[1] == 3:
        artist.set_data_3d(*points.T)
    else:
        artist.set_data(*points.T)
