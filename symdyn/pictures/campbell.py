"""The Campbell diagram: frequencies over rotor speed, with lines of multiples of the speed, and damping below.

Few modes have a colour each and a legend; of many those of one part (by the beginning of their names) share a colour, and each
is named at its right end.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from symdyn.pictures.figure import Picture
from symdyn.pictures.style import MANY, colors_of
from symdyn.pictures.symbols import axis_label

if TYPE_CHECKING:
    from symdyn.statics.campbell import Campbell

# The axis of damping ratios shows at least this much, %: less is rounding.
LEAST_DAMPING = 0.1
# Modes are left out by default above so many times the median of all, unless the lines of multiples go that high.
FAR_ABOVE = 3.0
STYLES = ("-", "--", "-.", ":")
# Height of a name at the right end, as a part of the axis.
NAME_HEIGHT = 0.034
RPM = 30 / np.pi


def plot(diagram: Campbell, path: Any = None, harmonics: Sequence[float] = (1, 3, 6), highest: float | None = None) -> Figure:
    """Frequencies, up to `highest` (Hz), and damping ratios; saved (PNG, PDF, SVG by the ending) if a path is given."""
    limit = highest or reach(diagram, harmonics)
    lowest = np.nanmin(diagram.frequencies, axis=0, initial=np.inf)
    seen = lowest <= limit
    highest = highest or 1.08 * float(np.nanmax(diagram.frequencies[:, seen], initial=0.0)) or 1.0
    # Names are listed from above.
    order = [k for k in np.argsort(-np.nan_to_num(diagram.frequencies[-1]), kind="stable") if seen[k]]
    many = len(order) > MANY
    figure = Picture(figsize=(10.4, 7.6) if many else (8.4, 6.4), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
    looks = _by_part([diagram.names[k] for k in order]) if many else [(color, "-") for color in colors_of(len(order))]
    mark = "o" if len(diagram.values) < 12 and not many else None
    for (color, style), k in zip(looks, order, strict=True):
        upper.plot(diagram.values, diagram.frequencies[:, k], color=color, linestyle=style, marker=mark, markersize=3,
                   label=diagram.names[k])
        lower.plot(diagram.values, 100 * diagram.damping[:, k], color=color, linestyle=style, marker=mark, markersize=3)
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
    upper.set_ylabel(f"damped frequency, {diagram.frame} frame [Hz]")
    lower.set_ylabel("damping [%]")
    lower.axhline(0.0, color="0.3", linewidth=0.8)
    lower.set_xlabel(axis_label([diagram.speed], "", "rad/s"))
    for axes in (upper, lower):
        axes.grid(alpha=0.3)
    upper.secondary_xaxis("top", functions=(lambda w: w * RPM, lambda n: n / RPM)).set_xlabel("[rpm]", fontsize=8)
    beyond = [f"{diagram.names[k]} ({lowest[k]:.3g} Hz)" for k in np.argsort(lowest) if not seen[k] and np.isfinite(lowest[k])]
    note = "\n".join(["not shown, above:", *beyond]) if beyond else None
    if many:
        _name_ends(upper, diagram, [(k, look[0]) for k, look in zip(order, looks, strict=True)], highest)
        if note:
            upper.annotate(note.replace("\n", " ", 1).replace("\n", ", "), (0.01, 0.985), xycoords="axes fraction", fontsize=8,
                           color="0.3", va="top")
    else:
        figure.legend(*upper.get_legend_handles_labels(), loc="outside right upper", fontsize=8, frameon=False, title=note,
                      title_fontsize=8)
    upper.set_title(f"{diagram.title}: Campbell diagram", fontsize=11)
    if path is not None:
        figure.save(path)
    return figure


def reach(diagram: Campbell, harmonics: Sequence[float]) -> float:
    """Up to where modes are shown by default, Hz: as high as the lines of multiples, or some times the median of the modes."""
    middle = float(np.nanmedian(diagram.frequencies)) if np.isfinite(diagram.frequencies).any() else 0.0
    lines = max([0.0, *harmonics]) * float(np.abs(diagram.values).max()) / (2 * np.pi)
    return max(FAR_ABOVE * middle, lines)


def part(name: str) -> str:
    """The beginning of a name that parts have in common: "blade" of "blade2_flap1 collective"; "" of a single word."""
    first = name.split()[0].rstrip(",")
    return first.partition("_")[0].rstrip("0123456789") if "_" in first else ""


def _by_part(names: Sequence[str]) -> list[tuple[Any, str]]:
    """Colour and style of each line: parts differ by colour, what belongs to one by style."""
    parts = sorted({part(name) for name in names})
    colors = dict(zip(parts, colors_of(len(parts)), strict=True))
    counts = dict.fromkeys(parts, 0)
    looks = []
    for name in names:
        mine = part(name)
        looks.append((colors[mine], STYLES[counts[mine] % len(STYLES)]))
        counts[mine] += 1
    return looks


def _name_ends(axes: Any, diagram: Campbell, lines: Sequence[tuple[Any, Any]], highest: float) -> None:
    """Names next to the right ends of lines, from above, apart from each other; lines that end above or early at the edge."""
    ends = [min(float(np.nan_to_num(diagram.frequencies[-1, k])) / highest, 1.0) for k, _ in lines]
    places: list[float] = []
    for end in ends:  # each below the one before
        places.append(min(end, places[-1] - NAME_HEIGHT) if places else end)
    lowest = 0.0
    for k in range(len(places) - 1, -1, -1):  # none below the axis
        places[k] = max(places[k], lowest)
        lowest = places[k] + NAME_HEIGHT
    for (k, color), end, place in zip(lines, ends, places, strict=True):
        axes.annotate(diagram.names[k], (1.0, end), (1.04, place), xycoords="axes fraction", textcoords="axes fraction",
                      color=color, fontsize=8, va="center", annotation_clip=False,
                      arrowprops={"arrowstyle": "-", "color": color, "linewidth": 0.5, "shrinkA": 0, "shrinkB": 0,
                                  "relpos": (0, 0.5)})
