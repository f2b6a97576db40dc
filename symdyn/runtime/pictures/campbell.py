"""The Campbell diagram: frequencies over rotor speed, with lines of multiples of the speed, and damping below."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from symdyn.runtime.pictures.figure import Picture
from symdyn.runtime.pictures.style import colors_of

if TYPE_CHECKING:
    from symdyn.runtime.statics.campbell import Campbell

# The axis of damping ratios shows at least this much, %: less is rounding.
LEAST_DAMPING = 0.1


def plot(diagram: Campbell, path: Any = None, harmonics: Sequence[float] = (1, 3, 6), highest: float | None = None) -> Figure:
    """Frequencies, up to `highest` (Hz), and damping ratios; saved (PNG, PDF, SVG by the ending) if a path is given."""
    figure = Picture(figsize=(8.4, 6.4), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
    mark = "o" if len(diagram.values) < 12 else None
    highest = highest or 1.08 * float(np.nanmax(diagram.frequencies, initial=0.0)) or 1.0
    seen = np.nanmin(diagram.frequencies, axis=0, initial=np.inf) <= highest
    # The legend lists them from above.
    order = [k for k in np.argsort(-np.nan_to_num(diagram.frequencies[-1]), kind="stable") if seen[k]]
    for color, k in zip(colors_of(len(order)), order, strict=True):
        upper.plot(diagram.values, diagram.frequencies[:, k], color=color, marker=mark, markersize=3, label=diagram.names[k])
        lower.plot(diagram.values, 100 * diagram.damping[:, k], color=color, marker=mark, markersize=3)
    ends = np.array([min(0.0, diagram.values.min()), diagram.values.max()])
    for multiple in harmonics:
        line = multiple * np.abs(ends) / (2 * np.pi)
        upper.plot(ends, line, color="0.65", linewidth=0.8, linestyle="--", zorder=0)
        if line[1] > 0:
            at = min(0.97, 0.96 * highest / line[1])
            upper.annotate(f"{multiple:g}P", (at * ends[1], at * line[1]), color="0.4", fontsize=8, ha="right", va="bottom")
    least, most = lower.get_ylim()
    lower.set_ylim(min(least, -LEAST_DAMPING), max(most, LEAST_DAMPING))
    upper.set_ylim(0, highest)
    upper.set_xlim(*ends)
    upper.set_ylabel("damped frequency [Hz]")
    lower.set_ylabel("damping [%]")
    lower.axhline(0.0, color="0.3", linewidth=0.8)
    lower.set_xlabel(f"{diagram.speed} [rad/s]")
    for axes in (upper, lower):
        axes.grid(alpha=0.3)
    figure.legend(*upper.get_legend_handles_labels(), loc="outside right upper", fontsize=8, frameon=False)
    upper.set_title(f"{diagram.title}: Campbell diagram", fontsize=11)
    if path is not None:
        figure.savefig(path, dpi=110)
    return figure
