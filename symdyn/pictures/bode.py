"""The Bode diagram: gains and phases over the frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from symdyn.pictures.figure import Picture
from symdyn.pictures.style import LINES
from symdyn.pictures.symbols import typeset, typeset_unit

if TYPE_CHECKING:
    from symdyn.statics.response import Response

_WIDE = 5.0
# Styles of outputs that share a colour.
_DASHES = ("-", "--", ":", "-.")


def plot(response: Response, path: Any = None) -> Figure:
    """A column for each input; outputs by colour and dashes."""
    n_in = len(response.inputs)
    figure = Picture(figsize=(_WIDE * n_in + 1.2, 5.6), layout="constrained")
    grid: Any = figure.subplots(2, n_in, sharex=True, sharey="row", squeeze=False)
    with np.errstate(divide="ignore"):
        gains, phases = np.where(response.gain > 0, response.gain, np.nan), np.degrees(response.phase)
    for j, given in enumerate(response.inputs):
        above, below = grid[0, j], grid[1, j]
        for k, output in enumerate(response.outputs):
            there = np.isfinite(gains[:, k, j])
            style = {"color": LINES[k % len(LINES)], "linestyle": _DASHES[k // len(LINES) % len(_DASHES)], "linewidth": 1.4}
            above.loglog(response.omega[there], gains[there, k, j], **style,
                         label=_with_unit(response, output))
            below.semilogx(response.omega[there], phases[there, k, j], **style)
        if not np.isfinite(gains[:, :, j]).any():
            above.annotate("no effect on these outputs", (0.5, 0.5), xycoords="axes fraction", ha="center", fontsize=8)
        above.set_title(f"input {_with_unit(response, given)}", fontsize=10)
        below.set_xlabel(r"$\omega$ [rad/s]")
        for axes in (above, below):
            axes.grid(True, which="both", color="0.92", linewidth=0.6)
            axes.set_axisbelow(True)
            axes.spines[["top", "right"]].set_visible(False)
    grid[0, 0].set_ylabel("gain, output by input")
    grid[1, 0].set_ylabel("phase [°]")
    grid[1, 0].yaxis.set_major_locator(MultipleLocator(90 if np.nanmax(np.ptp(phases, axis=0)) < 1000 else 360))
    grid[0, -1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False, handlelength=1.2)
    figure.suptitle(f"{response.title}: Bode diagram", fontsize=11)
    if path is not None:
        figure.save(path)
    return figure


def _with_unit(response: Response, name: str) -> str:
    unit = typeset_unit(response.units.get(name, ""))
    return f"{typeset(name)} [{unit}]" if unit else typeset(name)
