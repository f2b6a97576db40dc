"""Draws curves over time."""

from __future__ import annotations

from typing import Any

import numpy as np

from symdyn.pictures.panels import Panel
from symdyn.pictures.style import SCREEN, Style, colors_of
from symdyn.pictures.symbols import axis_label, typeset

_ENERGY = ("#D55E00", "#0072B2", "#000000")


def draw_panel(axes: Any, t: np.ndarray, panel: Panel, style: Style = SCREEN) -> None:
    """Curves with their names and unit; the legend stands on the right, on paper above."""
    count = len(panel.names)
    colors = _ENERGY if panel.group == "energy" and count == 3 else colors_of(count)
    for k, (name, values) in enumerate(zip(panel.names, panel.values.T, strict=True)):
        label = typeset(name if style.aside else name.replace("\n", " "))
        axes.plot(t, values, label=label, linewidth=style.width, color=colors[k], linestyle=style.dashes[k % len(style.dashes)],
                  marker="." if len(t) == 1 else None)
    axes.set_ylabel(axis_label(panel.names, panel.title, panel.unit))
    axes.grid(True, color="0.9", linewidth=style.grid)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    _show_small(axes, panel.values)
    if panel.part and style.aside:
        axes.set_title(panel.part, fontsize=style.legend, loc="left", color="0.35")
    if count > 1 and style.aside:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=style.legend, frameon=False, handlelength=1.2,
                    labelspacing=0.3)
    elif count > 1:
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, fontsize=style.legend, frameon=False, handlelength=1.6,
                    columnspacing=1.0, borderaxespad=0.1)


def _show_small(axes: Any, values: np.ndarray) -> None:
    """Rounding errors around a constant must not fill the axes."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return
    largest = np.abs(finite).max()
    if np.ptp(finite) <= 1e-9 * largest or largest == 0:
        middle, half = float(finite.mean()), 0.1 * float(largest) or 1.0
        axes.set_ylim(middle - half, middle + half)
