"""The Bode diagram: gains and phases over the frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from symdyn.pictures.figure import Picture
from symdyn.pictures.style import colors_of
from symdyn.pictures.symbols import typeset

if TYPE_CHECKING:
    from symdyn.statics.response import Response

_WIDE = 5.0


def plot(response: Response, path: Any = None) -> Figure:
    """A column for each input; outputs by colour."""
    n_in, n_out = len(response.inputs), len(response.outputs)
    figure = Picture(figsize=(_WIDE * n_in + 1.2, 5.6), layout="constrained")
    grid: Any = figure.subplots(2, n_in, sharex=True, sharey="row", squeeze=False)
    colors = colors_of(n_out)
    with np.errstate(divide="ignore"):
        gains, phases = np.where(response.gain > 0, response.gain, np.nan), np.degrees(response.phase)
    for j, given in enumerate(response.inputs):
        above, below = grid[0, j], grid[1, j]
        for k, output in enumerate(response.outputs):
            there = np.isfinite(gains[:, k, j])
            above.loglog(response.omega[there], gains[there, k, j], color=colors[k], linewidth=1.4,
                         label=f"{typeset(output)} {_unit(response, output, given)}".strip())
            below.semilogx(response.omega[there], phases[there, k, j], color=colors[k], linewidth=1.4)
        above.set_title(f"input {typeset(given)}", fontsize=10)
        below.set_xlabel(r"$\omega$ [rad/s]")
        for axes in (above, below):
            axes.grid(True, which="both", color="0.92", linewidth=0.6)
            axes.set_axisbelow(True)
            axes.spines[["top", "right"]].set_visible(False)
    grid[0, 0].set_ylabel("gain")
    grid[1, 0].set_ylabel("phase [°]")
    grid[1, 0].yaxis.set_major_locator(MultipleLocator(90 if np.nanmax(np.ptp(phases, axis=0)) < 1000 else 360))
    grid[0, -1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False, handlelength=1.2)
    figure.suptitle(f"{response.title}: Bode diagram", fontsize=11)
    if path is not None:
        figure.save(path)
    return figure


def _unit(response: Response, output: str, given: str) -> str:
    above, below = response.units.get(output, ""), response.units.get(given, "")
    if not below:
        return f"[{above}]" if above else ""
    above, below = (f"({unit})" if "/" in unit or " " in unit else unit for unit in (above or "1", below))
    return f"[{above}/{below}]"
