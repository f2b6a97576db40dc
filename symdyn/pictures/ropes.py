"""Ropes and mooring lines between two points, as they hang.

A rope has no stiffness: it is straight while it is taut, else the catenary of its length. A mooring line has the shape that its
load computes, see symdyn.model.elements.catenary.
"""

from __future__ import annotations

import math

import numpy as np

from symdyn.model.algorithms.catenary import SYMDYN_CLOSE, SYMDYN_NEAREST, SYMDYN_TINY, symdyn_line_force

# Shorter than its length by less, of it, is taut; points along a rope.
_TAUT = 1e-5
POINTS = 25
_ROUNDS = 60


def rope(a: np.ndarray, b: np.ndarray, length: float, up: np.ndarray) -> np.ndarray:
    """Points along it from a to b, (POINTS, 3), evenly by its length; up: the direction against which it hangs.

    A catenary with the parameter c over a horizontal distance h and a height v has sqrt(length^2 - v^2) = 2 c sinh(h / 2 c).
    """
    s = np.linspace(0.0, 1.0, POINTS)[:, None]
    way = b - a
    distance, v = float(np.linalg.norm(way)), float(way @ up)
    if distance >= length * (1 - _TAUT):
        return np.asarray(a + s * way)
    across = way - v * up
    h = float(np.linalg.norm(across))
    if h < 1e-6 * length:  # two strands side by side
        low = (length - v) / 2
        along = s * length
        return np.asarray(a + up * np.where(along < low, -along, along - 2 * low) + s * across)
    ratio = np.sqrt(length**2 - v**2) / h
    w = np.sqrt(6 * (ratio - 1)) if ratio < 3 else np.log(2 * ratio) + np.log(np.log(2 * ratio))
    for _ in range(_ROUNDS):  # sinh(w) / w = ratio: by Newton, of a convex function
        step = (np.sinh(w) - ratio * w) / (np.cosh(w) - ratio)
        w -= step
        if abs(step) < 1e-14 * w:
            break
    c = h / (2 * w)
    lowest = h / 2 - c * np.arctanh(v / length)
    x = lowest + c * np.arcsinh((s * length + c * np.sinh(-lowest / c)) / c)
    height = c * (np.cosh((x - lowest) / c) - np.cosh(lowest / c))
    return np.asarray(a + across * (x / h) + up * height)


def mooring(fairlead: np.ndarray, anchor: np.ndarray, length: float, give: float, friction: float, seabed: bool,
            shown: float = np.inf) -> np.ndarray:
    """Points along a mooring line from its fairlead to its anchor, (POINTS, 3), evenly by the unstretched length of what hangs.

    The part on the seabed is straight.

    give    weight over EA; friction: with the seabed, where there is one; shown: how much of the line, from the fairlead, m
    Straight where no shape at rest is found, as where the fairlead is below the seabed.
    """
    way = fairlead - anchor
    x, z = math.hypot(way[0], way[1], 2 * length * SYMDYN_NEAREST) / length, float(way[2]) / length
    result = symdyn_line_force(math, int(seabed), (x, z, give, friction), SYMDYN_TINY, SYMDYN_CLOSE)
    share = min(1.0, shown / length)
    if result is None:
        return np.asarray(fairlead - np.linspace(0.0, share, POINTS)[:, None] * way)
    h, v = result
    lies, b = (max(1 - v, 0.0), max(v - 1, 0.0)) if seabed else (0.0, v - 1)
    tense = min(lies, h / friction) if friction else lies

    def stretch(u: np.ndarray) -> np.ndarray:
        """Stretch within a length u of where the line touches down, over `give`."""
        return np.asarray(h * np.minimum(u, tense) - friction / 2 * np.minimum(u, tense) ** 2)

    end = 1.0 - share
    s = np.append(np.linspace(1.0, lies, POINTS - 1), end) if lies > end else np.linspace(1.0, end, POINTS)
    on, up = np.minimum(s, lies), np.maximum(s - lies, 0.0)
    force = b + up  # the vertical one, over the weight of the line
    along = on + give * (stretch(np.array(lies)) - stretch(lies - on))
    if h > 0:
        along = along + h * (np.arcsinh(force / h) - math.asinh(b / h)) + give * h * up
    elif lies:  # slack: what lies is not pulled tight
        along = on * x / lies
    height = np.sqrt(h**2 + force**2) - math.hypot(h, b) + give * up * (b + up / 2)
    level = np.array([way[0], way[1], 0.0]) / (math.hypot(way[0], way[1]) or 1.0)
    return np.asarray(anchor + length * (along[:, None] * level + height[:, None] * [0.0, 0.0, 1.0]))
