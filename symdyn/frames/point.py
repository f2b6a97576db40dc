"""Points of frames: where they are and how they move, seen from any frame, with components in any frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import sympy as sp

from symdyn.errors import ArgumentError
from symdyn.frames.checks import FrameFaults
from symdyn.frames.numbers import numbers
from symdyn.frames.parts import AccelerationParts, InertialForces, VelocityParts
from symdyn.frames.rates import taken
from symdyn.frames.tree import ZERO, Axes, along, angular_motion, demand_frames, point_motion
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import Motions, Scalar, Times
    from symdyn.given import Vector as Components

_ORDERS = {"position": 0, "velocity": 1, "acceleration": 2}


class Point:
    """A point given in a frame; `Frame.point` makes it.

    frame   the frame it is given in
    given   (3, 1) from that frame's origin, its components, m; of coordinates, t and parameters, so that it may move there
    Below, `seen_from` is the frame in which is differentiated (default: the first of the tree), `components` the frame along
    whose axes the result is given (default: seen_from). All raise ArgumentError for frames of different trees, and ModelError
    where a rate has no symbol (that of an input, a third derivative).
    Source: lecture, chapters 1.5 to 1.8.

    >>> q = sd.coordinates("q")
    >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", q))
    >>> tip = b.point("tip", [2, 0, 0])
    >>> tip.frame, tip.given.T
    (Frame('b', in 'n'), Matrix([[2, 0, 0]]))
    """

    def __init__(self, name: str, frame: Axes, at: Components) -> None:
        faults = FrameFaults(f"point {name}" if isinstance(name, str) else "a point")
        faults.name(name, "point")
        self.name = name
        self.frame = frame
        self.given = faults.column(at, "position")
        faults.demand_none()

    def position(self, of: Axes | Point | None = None, components: Axes | None = None) -> sp.Matrix:
        """The position of this point from the origin of a frame, or from another point, (3, 1), m.

        of           a frame (default: the first of the tree) or a Point
        components   default: `of`, or the frame in which that point is given

        >>> n = sd.Frame("n")
        >>> a, b = n.point("A", [1, 0, 0]), n.frame("b", origin=[0, 2, 0]).point("B", [0, 0, 3])
        >>> b.position().T, b.position(of=a).T
        (Matrix([[0, 2, 3]]), Matrix([[-1, 2, 3]]))
        """
        of = self.frame.path[0] if of is None else of
        start = of.frame if isinstance(of, Point) else of
        components = start if components is None else components
        result = self._motion(start, components, 0)[0]
        if isinstance(of, Point):
            result = result - along(of.given, start, components)
        return sp.Matrix(result)

    def velocity(self, seen_from: Axes | None = None, components: Axes | None = None) -> sp.Matrix:
        """The rate of its position in a frame, seen from that frame, (3, 1), m/s.

        >>> q = sd.coordinates("q")
        >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", q))
        >>> b.point("P", [2, 0, 0]).velocity(components=b).T
        Matrix([[0, 2*q_dot, 0]])
        """
        return sp.Matrix(self._motion(seen_from, components, 1)[1])

    def acceleration(self, seen_from: Axes | None = None, components: Axes | None = None) -> sp.Matrix:
        """The second rate of its position in a frame, seen from that frame, (3, 1), m/s^2.

        >>> q = sd.coordinates("q")
        >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", q))
        >>> b.point("P", [2, 0, 0]).acceleration(components=b).T
        Matrix([[-2*q_dot**2, 2*q_ddot, 0]])
        """
        return sp.Matrix(self._motion(seen_from, components, 2)[2])

    def velocity_parts(self, through: Axes | None = None, seen_from: Axes | None = None,
                       components: Axes | None = None) -> VelocityParts:
        """Its velocity as that of a moving frame's origin, omega x r, and what is seen from that frame; m/s.

        through   the moving frame b; default: the frame in which the point is given

        >>> s, phi = sd.coordinates("s phi")
        >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", phi))
        >>> parts = b.point("P", [s, 0, 0]).velocity_parts(components=b)
        >>> parts.relative.T, parts.transport.T
        (Matrix([[s_dot, 0, 0]]), Matrix([[0, s*phi_dot, 0]]))
        """
        through, seen_from, components = self._through(through, seen_from, components)
        r, v_rel = self._motion(through, components, 1)
        omega, _ = angular_motion(seen_from, through, components, 1)
        origin = point_motion(seen_from, through, ZERO, components, 1)[1]
        return VelocityParts(self.name, through.name, seen_from.name, components.name,
                             origin=sp.Matrix(origin), relative=sp.Matrix(v_rel), transport=sp.Matrix(omega.cross(r)))

    def acceleration_parts(self, through: Axes | None = None, seen_from: Axes | None = None,
                           components: Axes | None = None) -> AccelerationParts:
        """Its acceleration in five parts by way of a moving frame b, m/s^2:

        origin a_O, relative (seen from b), euler alpha x r, centripetal omega x (omega x r), coriolis 2 omega x v_rel.

        through   the moving frame b; default: the frame in which the point is given
        Source: lecture, chapter 1.7.

        >>> s, phi = sd.coordinates("s phi")
        >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", phi))
        >>> b.point("P", [s, 0, 0]).acceleration_parts(components=b).coriolis.T
        Matrix([[0, 2*phi_dot*s_dot, 0]])
        """
        through, seen_from, components = self._through(through, seen_from, components)
        r, v_rel, a_rel = self._motion(through, components, 2)
        omega, alpha = angular_motion(seen_from, through, components, 2)
        origin = point_motion(seen_from, through, ZERO, components, 2)[2]
        return AccelerationParts(
            self.name, through.name, seen_from.name, components.name, origin=sp.Matrix(origin), relative=sp.Matrix(a_rel),
            euler=sp.Matrix(alpha.cross(r)), centripetal=sp.Matrix(omega.cross(omega.cross(r))),
            coriolis=sp.Matrix(2 * omega.cross(v_rel)))

    def inertial_forces(self, mass: Scalar, frame: Axes | None = None, components: Axes | None = None,
                        inertial: Axes | None = None) -> InertialForces:
        """The forces that an observer in a moving frame b must add to the others: m a_rel = F + total; N.

        mass         kg
        frame        the moving frame b; default: the frame in which the point is given
        components   default: frame
        inertial     the frame in which Newton's law holds; default: the first of the tree
        Source: lecture, chapters 1.2 and 1.7.

        >>> s, phi = sd.coordinates("s phi")
        >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", phi))
        >>> b.point("P", [s, 0, 0]).inertial_forces(mass=2).centrifugal.T
        Matrix([[2*s*phi_dot**2, 0, 0]])
        """
        m = taken("mass", mass)
        frame = self.frame if frame is None else frame
        parts = self.acceleration_parts(frame, inertial, frame if components is None else components)
        return InertialForces(parts.point, parts.through, parts.seen_from, parts.components, origin=-m * parts.origin,
                              euler=-m * parts.euler, centrifugal=-m * parts.centripetal, coriolis=-m * parts.coriolis)

    def path(self, seen_from: Axes | None = None, t: Times | None = None, values: Motions | None = None,
             quantity: str = "position", components: Axes | None = None) -> np.ndarray:
        """Path over time as seen from a frame, (n_t, 3), m: what an observer there draws.

        t          (n_t,) times, s
        values     symbol or name -> number, expression in sd.t, or function of t; see `numbers`
        quantity   "position", "velocity" (m/s) or "acceleration" (m/s^2)
        Raises ArgumentError for missing values and EvaluationError where a value is not finite.

        >>> n = sd.Frame("n")
        >>> b = n.frame("b", sd.rotation.about("Z", sp.pi * sd.t))
        >>> np.round(b.point("P", [1, 0, 0]).path(n, t=[0.0, 0.5, 1.0]), 12) + 0.0
        array([[ 1.,  0.,  0.],
               [ 0.,  1.,  0.],
               [-1.,  0.,  0.]])
        """
        if quantity not in _ORDERS:
            raise ArgumentError(f"quantity is {shown(quantity)}; pass {', '.join(map(repr, _ORDERS))}")
        if t is None or np.ndim(t) != 1:
            raise ArgumentError(f"t is {shown(t)}; pass an array of times (n_t,), such as numpy.linspace(0, 2)")
        order = _ORDERS[quantity]
        return np.asarray(numbers(sp.Matrix(self._motion(seen_from, components, order)[order]), values, t))

    def _motion(self, seen_from: Axes | None, components: Axes | None, order: int) -> list[sp.ImmutableMatrix]:
        seen_from = self.frame.path[0] if seen_from is None else seen_from
        return point_motion(seen_from, self.frame, self.given, seen_from if components is None else components, order)

    def _through(self, through: Axes | None, seen_from: Axes | None, components: Axes | None) -> tuple[Axes, Axes, Axes]:
        through = self.frame if through is None else through
        seen_from = self.frame.path[0] if seen_from is None else seen_from
        components = seen_from if components is None else components
        demand_frames(frame=self.frame, through=through, seen_from=seen_from, components=components)
        return through, seen_from, components

    def __repr__(self) -> str:
        return f"Point({shown(self.name)}, {list(self.given)} in {shown(self.frame.name)})"
