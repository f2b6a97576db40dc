"""A rope without stiffness between two points: straight while it is taut, else the catenary of its length."""

from __future__ import annotations

import numpy as np

# Shorter than its length by less, of it, is taut; points along a rope.
_TAUT = 1e-5
POINTS = 25
_ROUNDS = 60


def rope(a: np.ndarray, b: np.ndarray, length: float, up: np.ndarray) -> np.ndarray:
    """Points along it from a to b, (POINTS, 3), evenly by its length; up: the direction against which it hangs.

    Of a catenary with the parameter c over a horizontal distance h and a height v: sqrt(length^2 - v^2) = 2 c sinh(h / 2 c).
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
