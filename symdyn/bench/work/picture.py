"""Work against error as pictures: time, and evaluations, over the error; a line for each formulation with each method."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symdyn.bench.work.against.peer import BODIES
from symdyn.bench.work.methods import SERIES
from symdyn.bench.work.record import Row
from symdyn.errors import MissingExtra

if TYPE_CHECKING:
    from symdyn.bench.work.benchmark import Benchmark

# Colours that differ also for those who see few (Okabe and Ito, Color Universal Design); a method has a colour, a formulation
# a marker and a kind of line.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8c6d31")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 2)), (0, (8, 2)), (0, (3, 4)))
# With more methods than colours the others have hollow markers and thin lines.
HOLLOW = {"markerfacecolor": "white", "linewidth": 1.0}
# Marker and line of other programs; their colours are darker shades.
PEERS = ("#444444", "#7a0177", "#005824", "#993404", "#08306b", "#67000d", "#3f007d", "#525252", "#b8860b", "#006d77")
# Errors that are drawn; what is below the first counts as it.
LEAST, MOST = 1e-17, 10.0
NAMES = {"absolute:angles": "absolute, Euler angles", "absolute": "absolute", "given": "given equations",
         BODIES: "bodies and joints"}


def write_pictures(benchmark: Benchmark, folder: Path) -> list[Path]:
    """work_precision.png and .svg in a folder; returns their paths. Raises MissingExtra without matplotlib."""
    figure = picture(benchmark)
    paths = [folder / f"work_precision.{kind}" for kind in ("png", "svg")]
    for path in paths:
        figure.savefig(path, dpi=110)
        figure.set_layout_engine("none")  # it stays as it was found for the first, which takes most of the time
    return paths


def picture(benchmark: Benchmark) -> Any:
    """The figure: a row of panels for the end and for every time of interest."""
    try:
        from symdyn.pictures.figure import Picture
    except ImportError:
        raise MissingExtra("pictures of the bench need matplotlib: pip install 'symdyn[plot]'") from None
    times: list[float | None] = [None, *[t for t in reversed(benchmark.at) if not math.isclose(t, benchmark.end)]]
    styles = styles_of([r for r in benchmark.rows if not r.message])
    entries = len({r.method for r in benchmark.rows}) + len({r.formulation for r in benchmark.rows if not r.peer})
    height = max(4.6 * len(times), 0.26 * entries + 1.5) + 0.5
    figure = Picture(figsize=(13.5, height), layout="constrained")
    panels = figure.subplots(len(times), 2, squeeze=False)
    work: tuple[tuple[str, Callable[[Row, int | None], float]], ...] = (
        ("time inside the integrator [ms]", lambda row, index: row.time_at(index) * 1e3),
        ("evaluations of the right-hand side" + ", with taylor orders of series" * any(
            SERIES in (row.method, row.chosen) for row in benchmark.rows), Row.evaluations_at))
    for axes, t in zip(panels, times, strict=True):
        index = None if t is None else benchmark.index(t)
        for panel, (title, value) in zip(axes, work, strict=True):
            _draw(panel, benchmark.rows, index, value, styles)
            panel.set_ylabel(title)
            panel.set_xlabel(f"error at t = {benchmark.end if t is None else t:g} s, relative")
    figure.suptitle(f"{benchmark.name}: work against error of {benchmark.end:g} s of motion", fontsize=12)
    _legend(figure, benchmark.rows, styles)
    return figure


def styles_of(rows: Sequence[Row]) -> dict[str, dict[str, Any]]:
    """Styles of lines, by their names."""
    methods = list(dict.fromkeys(r.method for r in rows if not r.peer))
    formulations = list(dict.fromkeys(r.formulation for r in rows if not r.peer))
    peers = list(dict.fromkeys(r.method for r in rows if r.peer))
    styles: dict[str, dict[str, Any]] = {}
    for row in rows:
        if row.peer:
            k = peers.index(row.method)
            styles[row.line] = {"color": PEERS[k % len(PEERS)], "marker": MARKERS[-1 - k % len(MARKERS)],
                                "linestyle": (0, (2, 1)), "linewidth": 1.0, "markerfacecolor": "none", "markersize": 6.5}
        else:
            m, f = methods.index(row.method), formulations.index(row.formulation)
            k = m if len(methods) > 1 else f
            styles[row.line] = {"color": COLORS[k % len(COLORS)], "marker": MARKERS[f % len(MARKERS)],
                                "linestyle": LINES[f % len(LINES)], "linewidth": 1.6, "markersize": 5,
                                **(HOLLOW if k >= len(COLORS) else {})}
    return styles


def _draw(panel: Any, rows: Sequence[Row], index: int | None, value: Callable[[Row, int | None], float],
          styles: dict[str, Any]) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    for line, style in styles.items():
        points = [(max(r.error_at(index), LEAST), value(r, index)) for r in rows if r.line == line and _drawn(r, index, value)]
        if points:
            panel.plot(*zip(*points, strict=True), **style)
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.invert_xaxis()  # more digits to the right, as in books on integrators
    panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.6g}"))
    panel.yaxis.set_minor_formatter(NullFormatter())
    panel.grid(True, which="major", alpha=0.35)
    panel.grid(True, which="minor", axis="y", alpha=0.12)


def _drawn(row: Row, index: int | None, value: Callable[[Row, int | None], float]) -> bool:
    return not row.message and row.error_at(index) <= MOST and value(row, index) > 0


def _legend(figure: Any, rows: Sequence[Row], styles: dict[str, Any]) -> None:
    """Colours show methods, markers and kinds of line formulations; other programs have lines of their own."""
    from matplotlib.lines import Line2D

    def entry(label: str, **style: Any) -> Any:
        return Line2D([], [], label=label, **style)

    handles = [entry("methods:", linestyle="none")]
    rows = [r for r in rows if not r.message]
    own = [r for r in rows if not r.peer]
    methods = list(dict.fromkeys(r.method for r in own))
    for method in methods:
        style = next(styles[r.line] for r in own if r.method == method)
        hollow = {"marker": "o", "markersize": 8, "markerfacecolor": "white"} if "markerfacecolor" in style else {}
        handles.append(entry(method, color=style["color"] if len(methods) > 1 else "0.35", linewidth=3, **hollow))
    handles.append(entry("formulations:", linestyle="none"))
    for name in dict.fromkeys(r.formulation for r in own):
        style = next(styles[r.line] for r in own if r.formulation == name)
        handles.append(entry(title(name), **(style if len(methods) == 1 else {
            **style, "color": "0.35", "linewidth": 1.6, "markerfacecolor": "0.35"})))
    others = list(dict.fromkeys(r.line for r in rows if r.peer))
    if others:
        silent = {name for name in others if not any(r.evaluations for r in rows if r.line == name)}
        handles += [entry("other programs:", linestyle="none"), *[
            entry(f"{name} (reports no evaluations)" if name in silent else name, **styles[name]) for name in others]]
    figure.legend(handles=handles, loc="outside right upper", frameon=False, fontsize=9, handlelength=3.2)


def title(name: str) -> str:
    """A formulation in words."""
    kind, _, variant = name.partition(":")
    return NAMES.get(name) or (f"{kind}, Euler {variant}" if variant else kind)
