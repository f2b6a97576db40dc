"""An animation without a display."""

from __future__ import annotations

import base64
import io
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import FuncAnimation
from matplotlib.figure import Figure
from PIL import Image

from symdyn.errors import ArgumentError

# Pixels a side: H.264 wants even numbers.
_EVEN = 2
_SAID = 400


class Film(FuncAnimation):
    """An animation that shows itself in a notebook; one that nobody looks at is no mistake.

    draw   places what moves in picture k, and returns it
    """

    def __init__(self, figure: Figure, draw: Callable[[int], list[Any]], count: int, fps: float) -> None:
        super().__init__(figure, draw, frames=count, interval=1000 / fps, blit=False)
        self.figure, self.place, self.count, self.fps = figure, draw, count, fps

    def gif(self) -> bytes:
        """The film as a GIF."""
        self.place(self.count - 1)
        palette = _palette(_pixels(self.figure))
        images = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in self._images()]
        data = io.BytesIO()
        images[0].save(data, format="GIF", save_all=True, append_images=images[1:], duration=round(1000 / self.fps), loop=0)
        return data.getvalue()

    def write_mp4(self, path: Path, name: str) -> None:
        """Write the film as H.264 by the program ffmpeg; name: of the mechanism, for messages.

        Raises ArgumentError where ffmpeg is not installed, and with what it reports.
        """
        program = shutil.which("ffmpeg")
        if program is None:
            raise ArgumentError(f"{name}: an animation as .mp4 needs the program ffmpeg, which is not on the path; install it, "
                                "or take the ending .gif, which needs nothing else")
        images = self._images()
        first = next(images)
        width, height = (side - side % _EVEN for side in first.size)
        command = [program, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
                   "-r", f"{self.fps:g}", "-i", "-", "-an", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "18",
                   "-movflags", "+faststart", str(path)]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as running:
            assert running.stdin is not None and running.stderr is not None
            try:
                for image in (first, *images):
                    running.stdin.write(image.crop((0, 0, width, height)).tobytes())
                running.stdin.close()
            except BrokenPipeError:  # it has ended; what it reports says why
                pass
            said = running.stderr.read().decode(errors="replace").strip()
        if running.returncode:
            why = said[-_SAID:] or f"it ended with {running.returncode}"
            raise ArgumentError(f"{name}: ffmpeg could not write {path}: {why}")

    def _images(self) -> Iterator[Image.Image]:
        """The pictures: what stays is drawn once, and what moves over it for each."""
        figure: Any = self.figure
        moving = self.place(self.count - 1)
        for artist in moving:
            artist.set_animated(True)
        figure.canvas.draw()
        background = figure.canvas.copy_from_bbox(figure.bbox)
        for k in range(self.count):
            figure.canvas.restore_region(background)
            for artist in self.place(k):
                figure.draw_artist(artist)
            yield _pixels(figure, draw=False)
        for artist in moving:
            artist.set_animated(False)

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
    # Pillow takes white for (252, 252, 252) when it looks for the nearest colour: none may be nearer to that than white.
    colors[(colors > 245).all(axis=1)] = 255
    shared.putpalette(colors.tobytes())
    return shared
