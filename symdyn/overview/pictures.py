"""Pictures that a page holds."""

from __future__ import annotations

import base64
import io
from typing import TYPE_CHECKING, Any

from symdyn.errors import MissingExtra
from symdyn.runtime.solutions.solution import Solution

if TYPE_CHECKING:
    from symdyn.pictures.embedded import Embedded


def figure(size: tuple[float, float]) -> Any:
    """An empty figure of so many inches. Raises MissingExtra without matplotlib."""
    try:
        from symdyn.pictures.figure import Picture
    except ImportError:
        raise MissingExtra("pictures need matplotlib: pip install 'symdyn[plot]'") from None
    return Picture(figsize=size, layout="constrained")


def source(drawing: Any) -> str:
    """The figure as the address of an <img>."""
    data = io.BytesIO()
    drawing.savefig(data, format="svg", metadata={"Date": None})
    return f"data:image/svg+xml;base64,{base64.b64encode(data.getvalue()).decode()}"


def mechanism(solution: Solution) -> tuple[Embedded, ...]:
    """The mechanism at the start and the end, and its way; none if nothing can be drawn. Raises MissingExtra."""
    try:
        from symdyn.pictures import embedded
    except ImportError:
        raise MissingExtra("pictures need matplotlib: pip install 'symdyn[plot]'") from None
    if not len(solution.t):
        return ()
    return embedded.mechanism(solution, [("start", float(solution.t[0])), ("end", float(solution.t[-1]))])
