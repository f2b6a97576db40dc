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

    >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", sp.pi / 2))
    >>> b.vector([10, 0, 0], name="F")
    Vector('F', [10, 0, 0] in 'b')
    """

    def __init__(self, name: str, frame: Axes, components: Components) -> None:
        faults = FrameFaults(f"vector {name}" if isinstance(name, str) else "a vector")
        faults.name(name, "vector")
        self.name = name
        self.frame = frame
        self.given = faults.column(components, "components")
        faults.demand_none()

    def components(self, frame: Axes) -> sp.Matrix:
        """Its components along the axes of a frame, (3, 1). Raises ArgumentError for a frame of another tree.

        >>> n = sd.Frame("n")
        >>> n.frame("b", sd.rotation.about("Z", sp.pi / 2)).vector([10, 0, 0]).components(n).T
        Matrix([[0, 10, 0]])
        """
        demand_frames(frame=frame, given_in=self.frame)
        return sp.Matrix(along(self.given, self.frame, frame))

    def rate(self, seen_from: Axes, components: Axes | None = None) -> sp.Matrix:
        """Its derivative by time seen from a frame, (3, 1): that of its components plus omega x v.

        components   default: seen_from
        Raises ArgumentError for a frame of another tree.

        >>> q = sd.coordinates("q")
        >>> n = sd.Frame("n")
        >>> b = n.frame("b", sd.rotation.about("Z", q))
        >>> b.vector([1, 0, 0]).rate(seen_from=n, components=b).T
        Matrix([[0, q_dot, 0]])
        """
        components = seen_from if components is None else components
        demand_frames(given_in=self.frame, seen_from=seen_from, components=components)
        omega, _ = angular_motion(seen_from, self.frame, components, 1)
        own = sp.ImmutableMatrix(3, 1, differentiated(self.given))
        return sp.Matrix(along(own, self.frame, components) + omega.cross(along(self.given, self.frame, components)))

    def at(self, values: Motions | None = None, components: Axes | None = None, t: Times | None = None) -> np.ndarray:
        """Its components as numbers, (3,), or (n_t, 3) at an array of times; values, t and errors as for `numbers`.

        >>> q = sd.coordinates("q")
        >>> n = sd.Frame("n")
        >>> force = n.frame("b", sd.rotation.about("Z", q)).vector([10, 0, 0])
        >>> np.round(force.at({q: np.pi / 2}, components=n), 12) + 0.0
        array([ 0., 10.,  0.])
        """
        return np.asarray(numbers(self.components(self.frame if components is None else components), values, t))

    def __repr__(self) -> str:
        return f"Vector({shown(self.name)}, {list(self.given)} in {shown(self.frame.name)})"
