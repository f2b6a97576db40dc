"""An animation without a display."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.animation import FuncAnimation
from matplotlib.figure import Figure
from PIL import Image


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
    # Pillow takes white for (252, 252, 252) when it looks for the nearest colour: none may be nearer to that than white.
    colors[(colors > 245).all(axis=1)] = 255
    shared.putpalette(colors.tobytes())
    return shared
