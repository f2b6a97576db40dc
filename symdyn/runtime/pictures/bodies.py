"""Draws the bodies of a mechanism."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from symdyn.runtime.pictures.drawing import Drawing
from symdyn.runtime.pictures.style import MANY, colors_of


def make_axes(figure: Figure, place: Any, drawing: Drawing) -> Any:
    axes: Any = figure.add_subplot(place, projection="3d" if drawing.spatial else None)
    limits = drawing.limits()
    axes.set_xlim(*limits[0])
    axes.set_ylim(*limits[1])
    axes.set_xlabel(f"{drawing.labels[0]} [m]")
    axes.set_ylabel(f"{drawing.labels[1]} [m]")
    if drawing.spatial:
        axes.set_zlim(*limits[2])
        axes.set_zlabel(f"{drawing.labels[2]} [m]")
        axes.set_box_aspect(np.ptp(limits, axis=1), zoom=0.79)
        axes.view_init(elev=22, azim=-55)
        axes.locator_params(nbins=5)
        axes.tick_params(labelsize=8, pad=0)
        axes.zaxis.labelpad = -2
        for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
            axis.pane.set_facecolor("0.98")
            axis.line.set_color("0.5")
            axis._axinfo["grid"].update(color="0.88", linewidth=0.7)
    else:
        axes.set_aspect("equal")
        axes.locator_params(axis="x", nbins=6)
        axes.grid(True, color="0.92", linewidth=0.7)
        axes.set_axisbelow(True)
    return axes


def draw_path(figure: Figure, place: Any, drawing: Drawing) -> None:
    """Start and end of the motion, and the way of the centres of mass."""
    axes = make_axes(figure, place, drawing)
    n_b = len(drawing.lines)
    colors = colors_of(n_b)
    for k in range(n_b) if n_b <= 3 else [n_b - 1]:
        axes.plot(*drawing.centres[:, k].T, color=colors[k], linewidth=0.6, alpha=0.55)
    for index, alpha in ((0, 0.3), (-1, 1.0)):
        for artist, points in zip(make_artists(axes, drawing, alpha), points_at(drawing, index), strict=True):
            move(artist, points)
    which = "centre" if n_b == 1 else "last centre" if n_b > 3 else "centres"
    axes.set_title(f"start (pale), end, way of the {which} of mass", fontsize=9, y=0.97 if drawing.spatial else None)


def make_artists(axes: Any, drawing: Drawing, alpha: float = 1.0) -> list[Any]:
    """Empty curves for rails, arms, rods, bodies, sliders and centres of mass, in the order of `points_at`."""
    empty: list[list[float]] = [[]] * len(drawing.labels)
    colors = colors_of(len(drawing.lines))
    if len(drawing.pivots):
        axes.plot(*drawing.pivots.T, linestyle="", marker="^", color="0.3", markersize=9, zorder=4)
    style = {"alpha": alpha, "solid_capstyle": "round", "solid_joinstyle": "round"}
    width = 4.0 if len(drawing.lines) <= MANY else 2.0
    return [axes.plot(*empty, color="0.6", linestyle=":", linewidth=1.2, alpha=alpha)[0],
            axes.plot(*empty, color="0.4", linewidth=1.0, alpha=alpha)[0],
            axes.plot(*empty, color="0.4", linewidth=0.6 * width, marker="o", markersize=0.8 * width, **style)[0],
            *[axes.plot(*empty, color=c, linewidth=width, marker="o", markersize=width, **style)[0] for c in colors],
            *[axes.plot(*empty, color=colors[k], linestyle="", marker="s", markersize=3.5 * width, alpha=alpha)[0]
              for k in drawing.sliders],
            axes.plot(*empty, color="black", linestyle="", marker="o", markersize=0.8 * width, alpha=alpha)[0]]


def points_at(drawing: Drawing, index: int) -> list[np.ndarray]:
    slides = [drawing.lines[k][:, places] for k, places in drawing.sliders.items()]
    return [points[index] for points in (drawing.rails, drawing.arms, drawing.rods, *drawing.lines, *slides, drawing.centres)]


def move(artist: Any, points: np.ndarray) -> None:
    if points.shape[1] == 3:
        artist.set_data_3d(*points.T)
    else:
        artist.set_data(*points.T)
