"""A figure without a display."""

from __future__ import annotations

import io
from typing import Any

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from symdyn.errors import ArgumentError
from symdyn.runtime.paths import as_path


class Picture(Figure):
    """A figure that draws itself without a display and shows itself in a notebook."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        FigureCanvasAgg(self)

    def save(self, path: Any) -> None:
        """Write it to a file, as what its ending says (.png if it has none).

        Raises ArgumentError for an ending that there is not, and where it cannot be written.
        """
        target = as_path(path, "of the picture", "motion.png")
        kind = target.suffix.removeprefix(".").lower()
        if kind and kind not in self.canvas.get_supported_filetypes():
            raise ArgumentError(f"cannot save the picture to {target.name}: the ending must be .png, .pdf or .svg")
        try:
            # Letters stay letters: a PDF carries the fonts that it uses as TrueType.
            with matplotlib.rc_context({"pdf.fonttype": 42}):
                self.savefig(target, dpi=110)
        except OSError as error:
            raise ArgumentError(f"the picture cannot be written to {target}: {error.strerror}") from None

    def _repr_png_(self) -> bytes:
        data = io.BytesIO()
        self.savefig(data, format="png")
        return data.getvalue()
