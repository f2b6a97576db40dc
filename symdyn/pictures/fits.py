"""Measured values and their fit over time, and the residuals below."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from symdyn.pictures.figure import Picture
from symdyn.pictures.style import colors_of

if TYPE_CHECKING:
    from symdyn.estimation.result import Fit
    from symdyn.given import PathName


# Letters of the title that an inch has room for, and lines of it.
_LETTERS, _LINES = 10, 2


def plot(fit: Fit, path: PathName | None = None) -> Figure:
    """A column for each measured quantity of each experiment; saved (PNG, PDF, SVG by the ending) if a path is given."""
    units = fit.module.metadata.units
    n = len(fit.residuals)
    width = max(6.4, 3.6 * n)
    figure = Picture(figsize=(width, 5.2), layout="constrained")
    columns = figure.subplots(2, n, sharex="col", squeeze=False, height_ratios=[2, 1])
    several = len(fit.motions) > 1
    for (upper, lower), ((k, name), left) in zip(columns.T, fit.residuals.items(), strict=True):
        motion = fit.motions[k]
        model = (motion[name] if name in fit.module.metadata.x else motion.outputs[name]).reshape(len(motion.t), -1)
        rest = left.reshape(len(motion.t), -1)
        for entry, color in enumerate(colors_of(model.shape[1])):
            upper.plot(motion.t, model[:, entry] + rest[:, entry], ".", color=color, markersize=3, alpha=0.5,
                       label="measured" if entry == 0 else None)
            upper.plot(motion.t, model[:, entry], color="black", linewidth=1.2, label="motion" if entry == 0 else None)
            lower.plot(motion.t, rest[:, entry], ".", color=color, markersize=3, alpha=0.5)
        unit = f" [{units[name]}]" if units.get(name) else ""
        upper.set_title(f"{name} of experiment {k + 1}" if several else name, fontsize=10)
        upper.set_ylabel(f"{name}{unit}")
        lower.set_ylabel(f"residual{unit}")
        lower.axhline(0.0, color="0.3", linewidth=0.8)
        spread = np.nanstd(rest)
        lower.axhspan(-2 * spread, 2 * spread, color="0.9", zorder=0, label="2 standard deviations")
        lower.set_xlabel("t [s]")
        for axes in (upper, lower):
            axes.grid(alpha=0.3)
    columns[0, 0].legend(fontsize=8, frameon=False)
    columns[1, 0].legend(fontsize=8, frameon=False)
    figure.suptitle(_title(fit, round(_LETTERS * width)), fontsize=11)
    if path is not None:
        figure.save(path)
    return figure


def _title(fit: Fit, letters: int) -> str:
    """Title with the fitted unknowns, within some lines of so many letters, which end behind labels."""
    blank = "\N{NO-BREAK SPACE}"
    labels = [label.replace(" ", blank) for label in fit.values]
    lines: list[str] = []
    for shown in range(len(labels), -1, -1):
        more = [f"{len(labels) - shown} more".replace(" ", blank)] if shown < len(labels) else []
        lines = textwrap.wrap(f"{fit.module.name}: fit of {', '.join(labels[:shown] + more)}", letters)
        if len(lines) <= _LINES:
            break
    return "\n".join(lines).replace(blank, " ")
