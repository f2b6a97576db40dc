"""The root locus: eigenvalues in the complex plane, coloured by a parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from symdyn.pictures.figure import Picture
from symdyn.pictures.symbols import axis_label

if TYPE_CHECKING:
    from symdyn.statics.locus import RootLocus

_SCALE = "cividis"
_RATIOS = (0.1, 0.3, 0.5, 0.7, 0.9)
# Numbers that are nearer to each other overlap, pixels.
_APART = 18.0
# Up to so many values each is marked.
_MARKED = 60


def plot(locus: RootLocus, path: Any = None, damping: bool = True) -> Figure:
    """Curves of the eigenvalues with their mirror images; a cross where they begin, a point at every value."""
    figure = Picture(figsize=(7.2, 5.6), layout="constrained")
    axes: Any = figure.add_subplot(111)
    values, every = locus.values, locus.eigenvalues
    scale = Normalize(float(values.min()), float(values.max()) if np.ptp(values) else float(values.min()) + 1.0)
    drawn = None
    for track in every.T:
        for line in (track, track.conj()):
            points = np.column_stack([line.real, line.imag])
            pieces = np.stack([points[:-1], points[1:]], axis=1)
            middles = (values[:-1] + values[1:]) / 2
            axes.add_collection(LineCollection(list(pieces), array=middles, cmap=_SCALE, norm=scale, linewidth=1.6))
            drawn = axes.scatter(line.real, line.imag, c=values, cmap=_SCALE, norm=scale, s=14 if len(values) <= _MARKED else 0)
            there = np.flatnonzero(np.isfinite(line))
            axes.plot(line.real[there[:1]], line.imag[there[:1]], "x", color="black", markersize=7)
    finite = every[np.isfinite(every)]
    size = float(np.abs(finite).max(initial=0.0)) or 1.0
    low, high = min(float(finite.real.min(initial=0.0)), -0.05 * size), max(float(finite.real.max(initial=0.0)), 0.05 * size)
    top = max(float(np.abs(finite.imag).max(initial=0.0)), 0.05 * size)
    axes.set_xlim(low - 0.08 * (high - low), high + 0.08 * (high - low))
    axes.set_ylim(-1.12 * top, 1.12 * top)
    if damping:
        _rays(axes)
    axes.axvspan(0.0, 1e9 * size, color="#D55E00", alpha=0.06, zorder=0)
    axes.axvline(0.0, color="0.3", linewidth=0.8)
    axes.axhline(0.0, color="0.3", linewidth=0.8)
    axes.grid(True, color="0.92", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.set_xlabel("real part [1/s]")
    axes.set_ylabel("imaginary part [rad/s]")
    axes.set_title(f"{locus.title}: root locus", fontsize=11)
    if drawn is not None:
        figure.colorbar(drawn, ax=axes, label=axis_label([locus.parameter], "", locus.unit))
    if path is not None:
        figure.save(path)
    return figure


def _rays(axes: Any) -> None:
    """Where the damping ratio is the same, with its number at the edge of the picture."""
    left, (_, top) = -axes.get_xlim()[0], axes.get_ylim()
    named: list[np.ndarray] = []
    for ratio in _RATIOS:
        slope = np.sqrt(1 - ratio**2) / ratio
        reach = min(left, top / slope)
        for sign in (1, -1):
            axes.plot([0, -reach], [0, sign * slope * reach], color="0.8", linewidth=0.7, linestyle=(0, (4, 4)), zorder=0,
                      scalex=False, scaley=False)
        place = axes.transData.transform((-reach, slope * reach))
        if any(np.abs(place - other).max() < _APART for other in named):
            continue  # steep lines are close to each other where real parts are large
        named.append(place)
        axes.annotate(f"{ratio:g}", (-reach, slope * reach), xytext=(2, -2), textcoords="offset points", color="0.5", fontsize=7,
                      va="top")
