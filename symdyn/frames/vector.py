"""Free vectors: one arrow, as many sets of components as there are frames."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import sympy as sp

from symdyn.frames.checks import FrameFaults
from symdyn.frames.numbers import numbers
from symdyn.frames.rates import differentiated
from symdyn.frames.tree import Axes, along, angular_motion, demand_frames
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import Motions, Times
    from symdyn.given import Vector as Components


class Vector:
    """A vector given by its components in one frame, such as a force; `Frame.vector` makes it.

    frame   the frame it is given in
    given   (3, 1) its components there
    Source: lecture, chapters 1.5 and 1.6.
    """

    def __init__(self, name: str, frame: Axes, components: Components) -> None:
        faults = FrameFaults(f"vector {name}" if isinstance(name, str) else "a vector")
        faults.name(name, "vector")
        self.name = name
        self.frame = frame
        self.given = faults.column(components, "components")
        faults.demand_none()

    def components(self, frame: Axes) -> sp.Matrix:
        """Its components along the axes of a frame, (3, 1). Raises ArgumentError for a frame of another tree."""
        demand_frames(frame=frame, given_in=self.frame)
        return sp.Matrix(along(self.given, self.frame, frame))

    def rate(self, seen_from: Axes, components: Axes | None = None) -> sp.Matrix:
        """Its derivative by time seen from a frame, (3, 1): that of its components plus omega x v.

        components   default: seen_from
        Raises ArgumentError for a frame of another tree.
        """
        components = seen_from if components is None else components
        demand_frames(given_in=self.frame, seen_from=seen_from, components=components)
        omega, _ = angular_motion(seen_from, self.frame, components, 1)
        own = sp.ImmutableMatrix(3, 1, differentiated(self.given))
        return sp.Matrix(along(own, self.frame, components) + omega.cross(along(self.given, self.frame, components)))

    def at(self, values: Motions | None = None, components: Axes | None = None, t: Times | None = None) -> np.ndarray:
        """Its components as numbers, (3,), or (n_t, 3) at an array of times; values, t and errors as for `numbers`."""
        return np.asarray(numbers(self.components(self.frame if components is None else components), values, t))

    def __repr__(self) -> str:
        return f"Vector({shown(self.name)}, {list(self.given)} in {shown(self.frame.name)})"
