"""Draws curves over time."""

from __future__ import annotations

from typing import Any

import numpy as np

from symdyn.pictures.panels import Panel
from symdyn.pictures.style import SCREEN, Style, colors_of
from symdyn.pictures.symbols import axis_label, typeset

_ENERGY = ("#D55E00", "#0072B2", "#000000")
# Columns of a legend above its axes at most, and what numbers and names on the left take of the width, inches.
_MOST_COLUMNS, _LABELS = 4, 0.6


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
        _legend_above(axes, count, style)


def _legend_above(axes: Any, count: int, style: Style) -> None:
    """A legend in as many columns as the axes are wide; above the power of ten of large numbers, where there is one."""
    ticks = axes.yaxis.get_major_formatter()
    ticks.set_locs(axes.get_yticks())
    above = 1.6 if ticks.get_offset() else 0.1
    renderer = axes.figure.canvas.get_renderer()
    for columns in range(min(_MOST_COLUMNS, count), 0, -1):
        legend = axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, fontsize=style.legend, frameon=False,
                             handlelength=1.6, columnspacing=1.0, borderaxespad=above)
        if legend.get_window_extent(renderer).width / axes.figure.dpi <= style.wide - _LABELS:
            break


def _show_small(axes: Any, values: np.ndarray) -> None:
    """Rounding errors around a constant must not fill the axes."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return
    largest = np.abs(finite).max()
    if np.ptp(finite) <= 1e-9 * largest or largest == 0:
        middle, half = float(finite.mean()), 0.1 * float(largest) or 1.0
        axes.set_ylim(middle - half, middle + half)
