"""An optimal motion: states, inputs and errors of the mesh over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from symdyn.pictures.figure import Picture
from symdyn.pictures.style import colors_of

if TYPE_CHECKING:
    from symdyn.given import PathName
    from symdyn.optimal.result import Optimum

# Points of a curve.
POINTS = 1001


def plot(optimum: Optimum, path: PathName | None = None) -> Figure:
    """Coordinates, speeds, extra states, inputs and errors below each other; saved (PNG, PDF, SVG by the ending) if a path is
    given.

    Dots are at the nodes; dashed lines, where there are any, the motion simulated with the inputs.
    """
    metadata, t = optimum.module.metadata, np.linspace(optimum.t[0], optimum.t[-1], POINTS)
    groups = [("coordinates", metadata.q), ("speeds", metadata.u), ("extra states", metadata.z), ("inputs", metadata.inputs)]
    groups = [(title, names) for title, names in groups if names]
    figure = Picture(figsize=(7.2, 2.1 * len(groups) + 1.6), layout="constrained")
    axes = figure.subplots(len(groups) + 1, 1, sharex=True, height_ratios=[*[1.0] * len(groups), 0.6])
    x, u, simulated = optimum.at(t), optimum.inputs_at(t), optimum.simulated
    for panel, (title, names) in zip(axes, groups, strict=False):
        for name, color in zip(names, colors_of(len(names)), strict=True):
            curve = u[:, metadata.inputs.index(name)] if title == "inputs" else x[:, metadata.x.index(name)]
            unit = metadata.units.get(name, "")
            panel.plot(t, curve, color=color, linewidth=1.4, label=f"{name} [{unit}]" if unit else name)
            panel.plot(optimum.t, optimum[name], ".", color=color, markersize=3)
            if simulated is not None and title != "inputs":
                panel.plot(simulated.t, simulated.x[:, metadata.x.index(name)], "--", color="black", linewidth=0.7)
        panel.set_ylabel(title)
        panel.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    lower = axes[-1]
    lower.stairs(np.maximum(optimum.errors, 1e-17), optimum.breaks, baseline=None, color="0.2")
    lower.set_yscale("log")
    lower.set_ylabel("error of an interval")
    lower.set_xlabel("t [s]")
    for panel in axes:
        panel.grid(alpha=0.3)
    figure.suptitle(f"{optimum.module.name}: {optimum.transcription}, cost {optimum.cost:.6g}", fontsize=11)
    if path is not None:
        figure.save(path)
    return figure
