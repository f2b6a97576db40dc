"""The film of a motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.animation import FuncAnimation

from symdyn.errors import ArgumentError
from symdyn.kinds import flag
from symdyn.pictures.bodies import ABOVE, explain, make_artists, make_axes, move, show
from symdyn.pictures.drawing import Drawing
from symdyn.pictures.figure import Picture
from symdyn.pictures.film import Film
from symdyn.real_numbers import number_of
from symdyn.runtime.paths import as_path

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

# Pictures a second that players and browsers can be asked for.
LEAST_FPS = 0.001
MAX_FRAMES = 3000


def animate(solution: Solution, path: Any = None, fps: int = 25, speed: float = 1.0,
            view: Any = None, forces: bool = False, inertia: bool = False) -> FuncAnimation:
    """The moving bodies, with the way of the last centre of mass.

    forces  with arrows of forces in joints, loads and weights, and torques in joints and of loads
    inertia with the ellipsoids of inertia of bodies
    fps     pictures a second; speed: seconds of motion in one second of film
    view    elevation and azimuth of the eye, degrees, for a mechanism in space
    path    where to save the film: a .gif, which needs Pillow and nothing else, or an .mp4 by the program ffmpeg

    Returns the animation; a notebook shows it. Raises ArgumentError if the module gives no positions, if nothing can be drawn,
    for ellipsoids where no body has one, for another ending, and for .mp4 without ffmpeg.
    """
    target = None if path is None else as_path(path, "of the animation", "motion.gif")
    if target is not None and target.suffix.lower() not in (".gif", ".mp4"):
        raise ArgumentError(f"cannot save the animation to {target.name}: the ending must be .gif or .mp4")
    rate, speed = (number_of(v, solution.module.name, f"{what} must be a positive number")
                  for v, what in ((fps, "fps"), (speed, "speed")))
    if not (LEAST_FPS <= rate <= 1 / LEAST_FPS and 0 < speed < np.inf):
        raise ArgumentError(f"fps and speed must be positive, fps from {LEAST_FPS} to {1 / LEAST_FPS:.0f}, found fps = {rate:g}, "
                            f"speed = {speed:g}")
    flag(forces, f"{solution.module.name}: forces")
    flag(inertia, f"{solution.module.name}: inertia")
    whole = Drawing.of(solution, forces, inertia=inertia) if len(solution.t) > 1 else None
    if whole is None:
        raise ArgumentError(f"{solution.module.name}: there is nothing to animate: at least two times and the function "
                            "'positions' are needed, and bodies that extend or move")
    t = solution.t
    wanted = abs(float(t[-1] - t[0])) / speed * rate + 1
    if wanted > MAX_FRAMES:
        raise ArgumentError(f"{solution.module.name}: the film would have {wanted:.4g} pictures; raise speed above "
                            f"{speed * wanted / MAX_FRAMES:.3g}, or lower fps")
    count = int(wanted)
    times = t[0] + np.sign(t[-1] - t[0]) * np.arange(count) * speed / rate
    drawing = whole.at(t, times)
    spans = np.ptp(whole.limits(), axis=1)
    height = 5.0 if drawing.spatial else 6.0 * float(np.clip(spans[1] / spans[0], 0.35, 1.2)) + 0.6
    figure = Picture(figsize=(6, height), layout=None if drawing.spatial else "constrained", dpi=80)
    axes = make_axes(figure, 111, whole, view)
    if drawing.spatial:
        axes.set_position((0.0, 0.0, 1.0, 0.96))
    trace = axes.plot(*[[]] * len(drawing.labels), color="0.5", linewidth=0.8, zorder=ABOVE)[0]
    artists = make_artists(axes, drawing)
    axes.set_title(solution.module.name, fontsize=11)
    explain(figure, whole)
    clock = figure.text(0.02, 1 - 0.2 / height, "", family="monospace")

    def draw(k: int) -> list[Any]:
        move(trace, whole.centres[: _passed(t, times[k]), -1])
        show(artists, drawing, k)
        clock.set_text(f"t = {times[k]:.2f} s")
        return [trace, *artists, clock]

    # The layout is found once: it is the slowest part of drawing.
    figure.canvas.draw()
    figure.set_layout_engine("none")
    film = Film(figure, draw, count, rate)
    if target is not None:
        try:
            if target.suffix.lower() == ".mp4":
                film.write_mp4(target, solution.module.name)
            else:
                target.write_bytes(film.gif())
        except OSError as error:
            raise ArgumentError(f"the animation cannot be written to {target}: {error.strerror}") from None
    return film


def _passed(t: np.ndarray, now: float) -> int:
    """Number of the times that are over."""
    return int(np.searchsorted(t, now, "right") if t[-1] > t[0] else np.searchsorted(-t, -now, "right"))
