"""Whether derivatives that a user gives contradict the function that they are of: a central difference along one direction."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

# The step, of the sizes of the entries; by how much slopes may differ, relative; what rounding is multiplied by.
STEP, DIFFER, ROUNDING = 1e-5, 1e-4, 1e3
# The function counts as smooth there if one-sided slopes and those of half the step agree to this part of the difference.
SMOOTH = 0.1


def contradiction(of: Callable[[np.ndarray], Any], x: np.ndarray, rows: np.ndarray) -> tuple[float, float] | None:
    """The slope of a function by differences and by the given derivatives, where these contradict each other; else None.

    of     from arguments (n,) to values (m,); rows: their derivatives at x, (m, n)
    All arguments change at once, each by its size. None, too, where the function has a kink, or is not defined nearby.
    """
    direction = np.maximum(1.0, np.abs(x)) * (1.0 + 0.5 * np.cos(1.0 + 1.7 * np.arange(len(x))))
    try:
        with np.errstate(all="ignore"):
            here, *sides = [np.asarray(of(x + part * STEP * direction), dtype=float).reshape(-1)
                            for part in (0, 1, -1, 0.5, -0.5)]
    except Exception:  # it need not be defined there
        return None
    central, half = (sides[0] - sides[1]) / (2 * STEP), (sides[2] - sides[3]) / STEP
    bent = np.abs(sides[0] + sides[1] - 2 * here) / STEP
    given = rows @ direction
    rounding = ROUNDING * np.finfo(float).eps * np.max(np.abs([here, *sides]), axis=0) / STEP
    away = np.abs(central - given)
    allowed = DIFFER * np.maximum(np.abs(central), np.abs(rows) @ np.abs(direction)) + rounding
    wrong = (away > allowed) & (bent < SMOOTH * away) & (np.abs(central - half) < SMOOTH * away)
    if not wrong.any():
        return None
    k = int(np.argmax(wrong))
    return float(central[k]), float(given[k])


def message(what: str, slopes: tuple[float, float], t: float, by: str) -> str:
    """Message about a contradiction; what: the function, by: its arguments."""
    return (f"{what} contradicts its derivatives: at t = {t:.6g} it changes by {slopes[0]:.6g} along a direction of {by}, and by "
            f"{slopes[1]:.6g} by the derivatives that it came with; correct one of them")
