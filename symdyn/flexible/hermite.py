"""Cubic finite elements of a clamped beam, as a basis of shape functions."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from symdyn.flexible.shape import Shape
from symdyn.flexible.table import Table


class HermiteBasis:
    """Deflection and slope of every node but the clamp, in both transverse directions; nodes at all stations."""

    degree = 3

    def __init__(self, table: Table, elements: int) -> None:
        longest = table.length / elements * (1 + 1e-9)
        parts = [np.linspace(a, b, int(np.ceil((b - a) / longest)) + 1)[1:] for a, b in pairwise(table.x)]
        self.breaks = np.concatenate([[0.0], *parts])
        nodes = self.breaks.size
        # Slopes in units of the element's length keep the matrices well scaled.
        self._unit = 1 / longest
        values = np.concatenate([np.eye(nodes)[:, 1:], np.zeros((nodes, nodes - 1))], axis=1)
        slopes = np.roll(values, nodes - 1, axis=1) * self._unit
        self._curve = CubicHermiteSpline(self.breaks, values, slopes)
        self.n = 4 * (nodes - 1)

    def __call__(self, x: np.ndarray, derivative: int = 0) -> np.ndarray:
        one = self._curve(x, derivative)
        out = np.zeros((len(x), 2, self.n))
        out[:, 0, : self.n // 2], out[:, 1, self.n // 2 :] = one, one
        return out

    def shape(self, vector: np.ndarray, axes: str, scale: float, name: str) -> Shape:
        """The shape of a vector of this basis, its largest deflection being 1 at a node, in the directions it has."""
        w, dw = (np.pad(part, ((0, 0), (1, 0))) for part in vector.reshape(2, 2, -1).transpose(1, 0, 2))
        size = np.hypot(*w)
        largest = int(size.argmax())
        factor = 1 / size[largest]
        if w[np.abs(w[:, largest]).argmax(), largest] < 0:
            factor = -factor
        small = np.abs(w).max(axis=1) < 1e-9 * size[largest]  # what rounding mixed in is left out
        w, dw = w * factor, dw * factor * self._unit * scale
        parts = [Shape(axis, stations=self.breaks / scale, values=w[k], slopes=dw[k], name=name)
                 for k, axis in enumerate(axes) if not small[k]]
        return parts[0] if len(parts) == 1 else parts[0] + parts[1]
