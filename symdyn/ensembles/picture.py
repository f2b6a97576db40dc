"""An ensemble at a glance: quantiles over time, outcomes over what was sampled, and how outcomes are distributed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.ensembles.archive import thinned
from symdyn.errors import ArgumentError, MissingExtra

if TYPE_CHECKING:
    from symdyn.ensembles.result import Ensemble

try:
    from symdyn.pictures.figure import Picture
except ImportError as error:
    raise MissingExtra(f"pictures need matplotlib: pip install 'symdyn[plot]' ({error})") from None

# Largest numbers of members that are drawn, equally spaced among more, so that a picture takes the same time and memory for any
# number.
DRAWN_TRACES, DRAWN_POINTS = 20_000, 5_000
BANDS = ((0.05, 0.95), (0.25, 0.75))
COLUMNS, ROWS = 3, 3
COLOR = "C0"


def draw(ensemble: Ensemble, path: Any = None, scatter: Sequence[tuple[str, str]] | None = None) -> Picture:
    """See Ensemble.plot; without pairs the first outcomes over the first varied values."""
    traces = [label for label in ensemble.traces if len(ensemble.shapes[label]) == 1]
    pairs = [(str(x), str(y)) for x, y in scatter] if scatter is not None else _pairs(ensemble)
    unknown = [n for pair in pairs for n in pair if n not in ensemble.names and ensemble.shapes.get(n) != ()]
    if unknown:
        raise ArgumentError(f"{ensemble.path}: {', '.join(unknown)}: points need what was sampled, and outcomes of one number")
    columns = max(1, min(COLUMNS, len(pairs) if scatter is not None else len(ensemble.varied)))
    n_rows = max(1, len(traces) - (-len(pairs) // columns))
    figure = Picture(figsize=(10.0, 2.9 * n_rows + 0.5), layout="constrained")
    grid = figure.add_gridspec(n_rows, columns)
    for k, label in enumerate(traces):
        _quantiles(figure.add_subplot(grid[k, :]), ensemble, label)
    for k, (x, y) in enumerate(pairs):
        _points(figure.add_subplot(grid[len(traces) + k // columns, k % columns]), ensemble, x, y)
    failed = f", {ensemble.n_failed} failed" if ensemble.n_failed else ""
    figure.suptitle(f"{ensemble.name}: {ensemble.count} samples{failed}", fontsize=11)
    if path is not None:
        figure.savefig(path, dpi=110)
    return figure


def _pairs(ensemble: Ensemble) -> list[tuple[str, str]]:
    """As many as there is room for: a row for each outcome."""
    numbers = [label for label in ensemble.labels if ensemble.shapes[label] == ()]
    return [(x, y) for y in numbers[:ROWS] for x in ensemble.varied[:COLUMNS]]


def _quantiles(axes: Any, ensemble: Ensemble, label: str) -> None:
    step = max(1, -(-ensemble.count // DRAWN_TRACES))
    rows = thinned(ensemble.file, label, step)
    rows = rows[~thinned(ensemble.file, "failed", step)]
    name = label.removeprefix("trace ")
    if len(rows):
        for (low, high), alpha in zip(BANDS, (0.2, 0.4), strict=True):
            axes.fill_between(ensemble.t, *np.quantile(rows, (low, high), axis=0), color=COLOR, alpha=alpha, linewidth=0,
                              label=f"{100 * low:.0f} to {100 * high:.0f} %")
        axes.plot(ensemble.t, np.quantile(rows, 0.5, axis=0), color=COLOR, label="median")
        axes.legend(fontsize=8, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axes.set_xlim(*sorted((ensemble.t[0], ensemble.t[-1])))
    axes.set_xlabel("t [s]")
    axes.set_ylabel(_with_unit(ensemble, name))
    axes.set_title(f"{name} over time" + (f" (every {step}th sample)" if step > 1 else ""), fontsize=9)
    axes.grid(alpha=0.3)


def _points(axes: Any, ensemble: Ensemble, x: str, y: str) -> None:
    step = max(1, -(-ensemble.count // DRAWN_POINTS))
    good = ~thinned(ensemble.file, "failed", step)
    columns = []
    for name in (x, y):
        if name in ensemble.labels:
            columns.append(thinned(ensemble.file, name, step))
        else:
            columns.append(thinned(ensemble.file, "samples", step)[:, ensemble.names.index(name)])
    n = int(good.sum())
    axes.plot(columns[0][good], columns[1][good], ".", color=COLOR, markersize=3 if n > 200 else 5, markeredgewidth=0,
              alpha=0.3 if n > 1000 else 0.7, rasterized=True)
    axes.set_xlabel(_with_unit(ensemble, x))
    axes.set_ylabel(_with_unit(ensemble, y))
    axes.grid(alpha=0.3)


def _with_unit(ensemble: Ensemble, label: str) -> str:
    """Label with its unit; an outcome has the unit of its quantity."""
    for name in (label, label.partition(" ")[2], label.partition(" at ")[0]):
        if ensemble.units.get(name):
            return f"{label} [{ensemble.units[name]}]"
    return label
