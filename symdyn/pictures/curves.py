"""Draws curves over time."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure

from symdyn.pictures.panels import Panel
from symdyn.pictures.style import MANY, colors_of


def draw_panel(figure: Figure, axes: Any, t: np.ndarray, panel: Panel) -> None:
    count = len(panel.names)
    colors = colors_of(count)
    energy = panel.title == "energy"
    for k, (name, values) in enumerate(zip(panel.names, panel.values.T, strict=True)):
        axes.plot(t, values, label=name, linewidth=1.4 if count <= MANY else 0.9, marker="." if len(t) == 1 else None,
                  color=("tab:red", "tab:blue", "black")[k] if energy else colors[k])
    label = panel.title if count > 1 else panel.names[0]
    axes.set_ylabel(f"{label} [{panel.unit}]" if panel.unit else label)
    axes.grid(True, color="0.9", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    _show_small(axes, panel.values)
    if count > MANY:
        scale = ScalarMappable(BoundaryNorm(np.arange(count + 1) - 0.5, 256), "viridis")
        ticks = sorted({0, count // 2, count - 1})
        bar = figure.colorbar(scale, ax=axes, ticks=ticks, pad=0.02, aspect=15)
        bar.ax.set_yticklabels([panel.names[k] for k in ticks])
        bar.ax.tick_params(which="both", length=0)
    elif count > 1:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False, handlelength=1.2,
                    labelspacing=0.3)


def _show_small(axes: Any, values: np.ndarray) -> None:
    """Rounding errors around a constant must not fill the axes."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return
    largest = np.abs(finite).max()
    if np.ptp(finite) <= 1e-9 * largest or largest == 0:
        middle, half = float(finite.mean()), 0.1 * float(largest) or 1.0
        axes.set_ylim(middle - half, middle + half)
