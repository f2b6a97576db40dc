"""The files of a computed motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from symdyn.errors import MissingExtra

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

# A longer motion is shown faster than it happens.
FILM_SECONDS = 20.0


def save(solution: Solution, folder: Path, picture: bool, film: bool) -> None:
    """Write data and pictures, and report them; without matplotlib there are data only."""
    stem = folder / solution.module.name
    for ending in (".npz", ".csv"):
        print(f"wrote {solution.save(stem.with_name(stem.name + ending))}")
    try:
        if picture:
            path = stem.with_name(stem.name + ".png")
            solution.plot(path)
            print(f"wrote {path}")
        if film:
            path = stem.with_name(stem.name + ".gif")
            length = abs(solution.t[-1] - solution.t[0]) if len(solution.t) else 0.0
            solution.animate(path, speed=max(1.0, length / FILM_SECONDS))
            print(f"wrote {path}")
    except MissingExtra as missing:
        print(f"no picture: {missing}")
