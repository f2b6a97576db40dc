"""Pictures of a motion: curves over time, and the moving bodies. No display is needed; pyplot's state is not touched.

Bodies are drawn as lines: from the point they share with the body that carries them, over their frame's origin, to
the points that carry others. These points are found in the motion itself, so that every mechanism can be drawn whose
module gives frames or centres of mass.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError, MissingExtra

try:
    from matplotlib import colormaps
    from matplotlib.animation import FuncAnimation
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import BoundaryNorm
    from matplotlib.figure import Figure
    from PIL import Image
except ImportError as error:
    raise MissingExtra(f"pictures need matplotlib: pip install 'symdyn[plot]' ({error})") from None

if TYPE_CHECKING:
    from symdyn.runtime.solution import Solution

MANY = 12
MAX_FRAMES = 3000
GROUND = -1
_SAMPLES = 40
_LEFT_OUT = 1e-9
_PALETTE = "tab10"


class Picture(Figure):
    """A figure that draws itself without a display and shows itself in a notebook."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        FigureCanvasAgg(self)

    def _repr_png_(self) -> bytes:
        data = io.BytesIO()
        self.savefig(data, format="png")
        return data.getvalue()


class Film(FuncAnimation):
    """An animation that shows itself in a notebook; one that nobody looks at is no mistake.

    draw   places what moves in picture k, and returns it
    """

    def __init__(self, figure: Figure, draw: Callable[[int], list[Any]], count: int, fps: float) -> None:
        super().__init__(figure, draw, frames=count, interval=1000 / fps, blit=False)
        self.figure, self.place, self.count, self.fps = figure, draw, count, fps

    def gif(self) -> bytes:
        """The film as a GIF: what stays is drawn once, and what moves over it for each picture."""
        figure: Any = self.figure
        moving = self.place(self.count - 1)
        palette = _palette(_pixels(figure))
        for artist in moving:
            artist.set_animated(True)
        figure.canvas.draw()
        background = figure.canvas.copy_from_bbox(figure.bbox)
        images = []
        for k in range(self.count):
            figure.canvas.restore_region(background)
            for artist in self.place(k):
                figure.draw_artist(artist)
            images.append(_pixels(figure, draw=False).quantize(palette=palette, dither=Image.Dither.NONE))
        for artist in moving:
            artist.set_animated(False)
        data = io.BytesIO()
        images[0].save(data, format="GIF", save_all=True, append_images=images[1:], duration=round(1000 / self.fps), loop=0)
        return data.getvalue()

    def _repr_html_(self) -> str:
        return f'<img src="data:image/gif;base64,{base64.b64encode(self.gif()).decode()}">'

    def __del__(self) -> None:
        pass


def _pixels(figure: Figure, draw: bool = True) -> Image.Image:
    if draw:
        figure.canvas.draw()
    return Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3])  # type: ignore[attr-defined]


def _palette(image: Image.Image) -> Image.Image:
    """Colours that all pictures of a film share; the paper stays white."""
    shared = image.quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    colors = np.array(shared.getpalette(), dtype=np.uint8).reshape(-1, 3)
    colors[(colors > 248).all(axis=1)] = 255
    shared.putpalette(colors.tobytes())
    return shared


# -- curves


@dataclass(frozen=True)
class Panel:
    """Curves in one set of axes: values (n_t, n)."""

    title: str
    unit: str
    names: Sequence[str]
    values: np.ndarray


def plot(solution: Solution, path: Any = None) -> Figure:
    """Coordinates, speeds, states, inputs, outputs and energy over time, and the path of the mechanism.

    Returns the figure; saves it (PNG, PDF, SVG by the ending) if a path is given.
    """
    panels = _panels(solution)
    drawing = Drawing.of(solution) if len(solution.t) else None
    columns = 1 if len(panels) <= 3 else 2
    rows = -(-len(panels) // columns)
    height = max(2.1 * rows, 4.2) + 0.5
    side = min(height - 1.0, 5.5)
    widths = [5.2] * columns + ([side] if drawing else [])
    figure = Picture(figsize=(sum(widths), height), layout="constrained")
    grid = figure.add_gridspec(rows, len(widths), width_ratios=widths)
    shared: Any = None
    for k, panel in enumerate(panels):
        row, column = divmod(k, columns)
        # An odd last panel takes the whole row: room left blank says nothing.
        end = columns if k == len(panels) - 1 else column + 1
        axes = figure.add_subplot(grid[row, column:end], sharex=shared)
        shared = shared or axes
        _draw_panel(figure, axes, solution.t, panel)
        last = row == rows - 1
        axes.tick_params(labelbottom=last)
        if last:
            axes.set_xlabel("t [s]")
    if drawing:
        _draw_path(figure, grid[:, columns], drawing)
    figure.suptitle(_title(solution), fontsize=11)
    if path is not None:
        figure.savefig(path, dpi=110)
    return figure


def _panels(solution: Solution) -> list[Panel]:
    metadata = solution.module.metadata
    units = metadata["units"]
    found = []
    for title, group, values in (("coordinates", "q", solution.q), ("speeds", "u", solution.u),
                                 ("states", "z", solution.z), ("inputs", "inputs", solution.inputs)):
        names = metadata[group]
        for unit in dict.fromkeys(units.get(n, "") for n in names):
            places = [k for k, n in enumerate(names) if units.get(n, "") == unit]
            found.append(Panel(title, unit, [names[k] for k in places], values[:, places]))
    for name, rows in solution.outputs.items():
        flat = rows.reshape(len(solution.t), -1)
        labels = [name] if flat.shape[1] == 1 else [f"{name}[{k}]" for k in range(flat.shape[1])]
        found.append(Panel("output", "", labels, flat))
    if "energy" in solution.module.functions:
        found.append(Panel("energy", "J", ["kinetic", "potential", "total"],
                           np.column_stack([solution.energies, solution.energy])))
    return found


def _draw_panel(figure: Figure, axes: Any, t: np.ndarray, panel: Panel) -> None:
    count = len(panel.names)
    colors = _colors(count)
    energy = panel.title == "energy"
    for k, (name, values) in enumerate(zip(panel.names, panel.values.T, strict=True)):
        axes.plot(t, values, label=name, linewidth=1.4 if count <= MANY else 0.9, marker="." if len(t) == 1 else None,
                  color=("tab:red", "tab:blue", "black")[k] if energy else colors[k])
    label = panel.title if count > 1 else panel.names[0]
    axes.set_ylabel(f"{label} [{panel.unit}]" if panel.unit else label)
    axes.grid(True, color="0.9", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    _show_small(axes, panel.values)
    if count > MANY:
        scale = ScalarMappable(BoundaryNorm(np.arange(count + 1) - 0.5, 256), "viridis")
        ticks = sorted({0, count // 2, count - 1})
        bar = figure.colorbar(scale, ax=axes, ticks=ticks, pad=0.02, aspect=15)
        bar.ax.set_yticklabels([panel.names[k] for k in ticks])
        bar.ax.tick_params(which="both", length=0)
    elif count > 1:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False, handlelength=1.2,
                    labelspacing=0.3)


def _show_small(axes: Any, values: np.ndarray) -> None:
    """Rounding errors around a constant must not fill the axes."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return
    largest = np.abs(finite).max()
    if np.ptp(finite) <= 1e-9 * largest or largest == 0:
        middle, half = float(finite.mean()), 0.1 * float(largest) or 1.0
        axes.set_ylim(middle - half, middle + half)


def _colors(count: int) -> list[Any]:
    if count > 10:
        return list(colormaps["viridis"](np.linspace(0, 1, count)))
    return [colormaps[_PALETTE](k) for k in range(count)]


def _title(solution: Solution) -> str:
    head = f"{solution.module.name}: {solution.n_steps} steps of {solution.method} on {solution.backend}"
    if solution.success:
        return head
    end = f"{solution.t[-1]:.6g}" if len(solution.t) else "its start"
    return f"{head}, stopped early at t = {end} s"


# -- bodies


@dataclass(frozen=True)
class Drawing:
    """A mechanism as lines over time, in the axes that are shown.

    lines      of each body, (n_t, n_points, 2 or 3); NaN where the pen is lifted
    arms       from each body's origin to its centre of mass, joined in one line; rails: from slider to slider
    centres    centres of mass (n_t, n_b, 2 or 3); pivots: points that hold the mechanism to the ground, (n, 2 or 3)
    sliders    the bodies that slide; labels: of the axes
    """

    lines: list[np.ndarray]
    arms: np.ndarray
    rails: np.ndarray
    centres: np.ndarray
    pivots: np.ndarray
    sliders: Sequence[int]
    labels: Sequence[str]

    @property
    def spatial(self) -> bool:
        return len(self.labels) == 3

    @classmethod
    def of(cls, solution: Solution) -> Drawing | None:
        """What can be drawn of a motion; None if the module gives no positions, or nothing moves."""
        functions, n_t = solution.module.functions, len(solution.t)
        if "positions" not in functions:
            return None
        centres = _evaluate(solution, "positions").reshape(n_t, -1, 3)
        if not centres.shape[1] or not np.isfinite(centres).all():
            return None
        if "frames" in functions:
            frames = solution.frames.reshape(n_t, -1, 12)
            skeleton = _skeleton(frames[..., :3], frames[..., 3:].reshape(n_t, -1, 3, 3), centres)
        else:
            skeleton = _Skeleton([c[:, None] for c in np.moveaxis(centres, 1, 0)], np.zeros((n_t, 0, 3)),
                                 np.zeros((n_t, 0, 3)), np.zeros((0, 3)), [])
        everything = np.concatenate([*[line.reshape(-1, 3) for line in skeleton.lines], centres.reshape(-1, 3),
                                     skeleton.pivots])
        ranges = np.nanmax(everything, axis=0) - np.nanmin(everything, axis=0)
        shown = [k for k in range(3) if ranges[k] > _LEFT_OUT * max(ranges.max(), _LEFT_OUT)]
        if not shown:
            return None
        if len(shown) == 1:
            shown = sorted({*shown, 1 if shown[0] != 1 else 0})
        return cls([line[..., shown] for line in skeleton.lines], skeleton.arms[..., shown], skeleton.rails[..., shown],
                   centres[..., shown], skeleton.pivots[..., shown], skeleton.sliders, ["xyz"[k] for k in shown])

    def at(self, t: np.ndarray, times: np.ndarray) -> Drawing:
        """The drawing at other times, by linear interpolation."""
        order = np.argsort(t)
        right = np.clip(np.searchsorted(t[order], times), 1, len(t) - 1)
        a, b = order[right - 1], order[right]
        w = ((times - t[a]) / (t[b] - t[a]))[:, None, None]
        arms, rails, centres, *lines = [points[a] * (1 - w) + points[b] * w
                                        for points in (self.arms, self.rails, self.centres, *self.lines)]
        return Drawing(lines, arms, rails, centres, self.pivots, self.sliders, self.labels)

    def limits(self) -> np.ndarray:
        """Lower and upper limits of the axes, (2 or 3, 2), the same length in each direction of a plane."""
        points = np.concatenate([*[line.reshape(-1, len(self.labels)) for line in self.lines], self.pivots,
                                 self.centres.reshape(-1, len(self.labels))])
        low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
        longest = (high - low).max()
        half = np.maximum((high - low) / 2, 0.15 * longest) + 0.06 * longest
        return np.column_stack([(low + high) / 2 - half, (low + high) / 2 + half])


@dataclass(frozen=True)
class _Skeleton:
    lines: list[np.ndarray]
    arms: np.ndarray
    rails: np.ndarray
    pivots: np.ndarray
    sliders: list[int]


def _skeleton(origins: np.ndarray, rotations: np.ndarray, centres: np.ndarray) -> _Skeleton:
    """Lines of the bodies from origins (n_t, n_b, 3), rotations (n_t, n_b, 3, 3) and centres of mass."""
    n_t, n_b = centres.shape[:2]
    poses = [(origins[:, k], rotations[:, k]) for k in range(n_b)]
    size = max(np.ptp(origins, axis=(0, 1)).max(), np.ptp(centres, axis=(0, 1)).max(), 1e-12)
    starts: dict[int, np.ndarray] = {}
    carried: list[list[np.ndarray]] = [[] for _ in range(n_b)]
    rails, pivots, sliders = [], [], []
    for k, j, point, slides in _tree(poses, (np.zeros((n_t, 3)), np.broadcast_to(np.eye(3), (n_t, 3, 3))), size):
        if slides:
            sliders.append(k)
            rails.append(np.stack([point, poses[k][0]], axis=1))
            continue
        starts[k] = point
        if j == GROUND:
            pivots.append(point[0])
        else:
            carried[j].append(point)
    lines = []
    for k in range(n_b):
        points = [starts[k], origins[:, k]] if k in starts else [origins[:, k]]
        for point in carried[k]:
            points += [point, origins[:, k]]
        lines.append(np.stack(points, axis=1))
    lifted = np.full((n_t, 1, 3), np.nan)
    arms = [part for k in range(n_b) for part in (np.stack([origins[:, k], centres[:, k]], axis=1), lifted)]
    rails = [part for rail in rails for part in (rail, lifted)]
    for k in range(n_b):
        if not carried[k] and _length(lines[k]) < 1e-6 * size:
            lines[k] = np.stack([origins[:, k], centres[:, k]], axis=1)
    return _Skeleton(lines, np.concatenate(arms, axis=1), np.concatenate([lifted, *rails], axis=1),
                     np.array(pivots).reshape(-1, 3), sliders)


def _tree(poses: Sequence[tuple], ground: tuple, size: float) -> Iterator[tuple[int, int, np.ndarray, bool]]:
    """Who carries whom: (child, parent, shared point over time, whether the child slides), parents first."""
    waiting, placed = list(range(len(poses))), [GROUND]
    ways: dict[int, list[tuple]] = {k: [] for k in waiting}
    compared = dict.fromkeys(waiting, 0)
    while waiting:
        chosen = None
        for k in waiting:
            for j in placed[compared[k]:]:
                found = _joint(ground if j == GROUND else poses[j], poses[k], size)
                if found is not None:
                    ways[k].insert(0, (j, *found))
            compared[k] = len(placed)
            # A motion can hide who carries whom; the shortest connection is then as true as any.
            best = min(ways[k], key=lambda way: (way[2], way[3]), default=None)
            if best is not None and (chosen is None or not best[2]):
                chosen = (k, *best[:3])
                if not best[2]:
                    break
        if chosen is None:
            return
        waiting.remove(chosen[0])
        placed.append(chosen[0])
        yield chosen


def _joint(parent: tuple, child: tuple, size: float) -> tuple[np.ndarray, bool, float] | None:
    """Where two bodies meet: the shared point over time, whether they slide instead, the length of the connection.

    None if they have no point in common throughout the motion, nor a straight way.
    """
    n_t = len(parent[0])
    some = np.unique(np.linspace(0, n_t - 1, _SAMPLES).astype(int))
    (O, R), (o, r) = (parent[0][some], parent[1][some]), (child[0][some], child[1][some])
    near, tolerance = 1e-5 * size, 1e-5 * size
    ahead = np.einsum("tji,tj->ti", R, o - O)
    back = np.einsum("tji,tj->ti", r, O - o)
    if np.ptp(ahead, axis=0).max() < near:
        a = ahead[0]
    elif np.ptp(back, axis=0).max() < near:
        return parent[0], False, float(np.linalg.norm(back[0]))
    else:
        solved = np.linalg.lstsq(np.concatenate([R, -r], axis=2).reshape(-1, 6), (o - O).ravel(), rcond=1e-9)[0]
        a, b = solved[:3], solved[3:]
        miss = O + R @ a - o - r @ b
        if np.abs(miss).max() > tolerance:
            way = ahead - ahead.mean(axis=0)
            if np.linalg.svd(way, compute_uv=False)[1] < tolerance:
                return parent[0], True, float(np.linalg.norm(ahead, axis=1).mean())
            return None
    return parent[0] + parent[1] @ a, False, float(np.linalg.norm(a))


def _length(line: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(line, axis=1), axis=2).max(initial=0.0))


def _evaluate(solution: Solution, name: str) -> np.ndarray:
    return solution.module.evaluate(name, solution.t, solution.x, solution.params, solution.inputs)


def _axes(figure: Figure, place: Any, drawing: Drawing) -> Any:
    axes: Any = figure.add_subplot(place, projection="3d" if drawing.spatial else None)
    limits = drawing.limits()
    axes.set_xlim(*limits[0])
    axes.set_ylim(*limits[1])
    axes.set_xlabel(f"{drawing.labels[0]} [m]")
    axes.set_ylabel(f"{drawing.labels[1]} [m]")
    if drawing.spatial:
        axes.set_zlim(*limits[2])
        axes.set_zlabel(f"{drawing.labels[2]} [m]")
        axes.set_box_aspect(np.ptp(limits, axis=1), zoom=0.79)
        axes.view_init(elev=22, azim=-55)
        axes.locator_params(nbins=5)
        axes.tick_params(labelsize=8, pad=0)
        axes.zaxis.labelpad = -2
        for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
            axis.pane.set_facecolor("0.98")
            axis.line.set_color("0.5")
            axis._axinfo["grid"].update(color="0.88", linewidth=0.7)
    else:
        axes.set_aspect("equal")
        axes.grid(True, color="0.92", linewidth=0.7)
        axes.set_axisbelow(True)
    return axes


def _draw_path(figure: Figure, place: Any, drawing: Drawing) -> None:
    """Start and end of the motion, and the way of the centres of mass."""
    axes = _axes(figure, place, drawing)
    n_b = len(drawing.lines)
    colors = _colors(n_b)
    for k in range(n_b) if n_b <= 3 else [n_b - 1]:
        axes.plot(*drawing.centres[:, k].T, color=colors[k], linewidth=0.6, alpha=0.55)
    for index, alpha in ((0, 0.3), (-1, 1.0)):
        for artist, points in zip(_artists(axes, drawing, alpha), _points(drawing, index), strict=True):
            _move(artist, points)
    which = "centre" if n_b == 1 else "last centre" if n_b > 3 else "centres"
    axes.set_title(f"start (pale), end, way of the {which} of mass", fontsize=9, y=0.97 if drawing.spatial else None)


def _artists(axes: Any, drawing: Drawing, alpha: float = 1.0) -> list[Any]:
    """Empty curves for rails, arms, bodies and centres of mass, in the order of `_points`."""
    empty: list[list[float]] = [[]] * len(drawing.labels)
    colors = _colors(len(drawing.lines))
    if len(drawing.pivots):
        axes.plot(*drawing.pivots.T, linestyle="", marker="^", color="0.3", markersize=9, zorder=4)
    style = {"alpha": alpha, "solid_capstyle": "round", "solid_joinstyle": "round"}
    width = 4.0 if len(drawing.lines) <= MANY else 2.0
    shapes = [{"marker": "s", "markersize": 3.5 * width} if k in drawing.sliders else {"marker": "o", "markersize": width}
              for k in range(len(drawing.lines))]
    return [axes.plot(*empty, color="0.6", linestyle=":", linewidth=1.2, alpha=alpha)[0],
            axes.plot(*empty, color="0.4", linewidth=1.0, alpha=alpha)[0],
            *[axes.plot(*empty, color=c, linewidth=width, **shape, **style)[0] for c, shape in zip(colors, shapes)],
            axes.plot(*empty, color="black", linestyle="", marker="o", markersize=0.8 * width, alpha=alpha)[0]]


def _points(drawing: Drawing, index: int) -> list[np.ndarray]:
    return [points[index] for points in (drawing.rails, drawing.arms, *drawing.lines, drawing.centres)]


def _move(artist: Any, points: np.ndarray) -> None:
    if points.shape[1] == 3:
        artist.set_data_3d(*points.T)
    else:
        artist.set_data(*points.T)


def animate(solution: Solution, path: Any = None, fps: int = 25, speed: float = 1.0) -> FuncAnimation:
    """The moving bodies, with the way of the last centre of mass.

    fps     pictures a second; speed: seconds of motion in one second of film
    path    where to save the film; a GIF, which needs Pillow and nothing else

    Returns the animation; a notebook shows it with buttons. Raises ArgumentError if the module gives no positions, if
    nothing can be drawn, or for another ending than .gif.
    """
    if path is not None and Path(path).suffix.lower() != ".gif":
        raise ArgumentError(f"cannot save the animation to {Path(path).name}: the ending must be .gif")
    if not (fps > 0 and speed > 0):
        raise ArgumentError(f"fps and speed must be positive, found fps = {fps}, speed = {speed}")
    whole = Drawing.of(solution) if len(solution.t) > 1 else None
    if whole is None:
        raise ArgumentError(f"{solution.module.name}: there is nothing to animate: at least two times and the function "
                            "'positions' are needed, and bodies that extend or move")
    t = solution.t
    count = int(abs(t[-1] - t[0]) / speed * fps) + 1
    if count > MAX_FRAMES:
        raise ArgumentError(f"{solution.module.name}: the film would have {count} pictures; raise speed above "
                            f"{speed * count / MAX_FRAMES:.3g}, or lower fps")
    times = t[0] + np.sign(t[-1] - t[0]) * np.arange(count) * speed / fps
    drawing = whole.at(t, times)
    spans = np.ptp(whole.limits(), axis=1)
    height = 5.0 if drawing.spatial else 6.0 * float(np.clip(spans[1] / spans[0], 0.35, 1.2)) + 0.6
    figure = Picture(figsize=(6, height), layout="constrained", dpi=80)
    axes = _axes(figure, 111, whole)
    trace = axes.plot(*[[]] * len(drawing.labels), color="0.5", linewidth=0.8)[0]
    artists = _artists(axes, drawing)
    axes.set_title(solution.module.name, fontsize=11)
    clock = figure.text(0.02, 1 - 0.2 / height, "", family="monospace")

    def draw(k: int) -> list[Any]:
        _move(trace, whole.centres[: _passed(t, times[k]), -1])
        for artist, points in zip(artists, _points(drawing, k), strict=True):
            _move(artist, points)
        clock.set_text(f"t = {times[k]:.2f} s")
        return [trace, *artists, clock]

    # The layout is found once: it is the slowest part of drawing.
    figure.canvas.draw()
    figure.set_layout_engine("none")
    film = Film(figure, draw, count, fps)
    if path is not None:
        Path(path).write_bytes(film.gif())
    return film


def _passed(t: np.ndarray, now: float) -> int:
    """How many of the times are over."""
    return int(np.searchsorted(t, now, "right") if t[-1] > t[0] else np.searchsorted(-t, -now, "right"))
