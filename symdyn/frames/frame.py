"""Reference frames: a tree of axes and origins that move relative to each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy as sp

from symdyn.frames.body import Body
from symdyn.frames.point import Point
from symdyn.frames.tree import Axes, angular_motion, demand_frames, rotation_between
from symdyn.frames.vector import Vector
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import Inertia, Matrix, Scalar
    from symdyn.given import Vector as Components


class Frame(Axes):
    """A reference frame with origin and axes; the first of a tree is taken for inertial.

    name       text
    parent     the frame it is described in; None for the first
    rotation   (3, 3) R, takes components of this frame to the parent's; of coordinates, t and parameters
    origin     (3,) this origin from the parent's, the parent's components, m
    Coordinates are those of sd.coordinates; SymPy's dynamicsymbols are taken over as such. `path` is the frames from the
    first of the tree to this one.
    Raises ModelError listing all faults, or NotARotation with numbers if the rotation alone is at fault; a symbolic rotation
    is checked at random values of its symbols (four Euler parameters: with norm 1).
    Source: lecture, chapters 1.2, 1.6 and 1.7.

    >>> q = sd.coordinates("q")
    >>> n = sd.Frame("n")
    >>> b = n.frame("b", sd.rotation.about("Z", q))
    >>> b.point("P", [1, 0, 0]).velocity(seen_from=n).T
    Matrix([[-q_dot*sin(q), q_dot*cos(q), 0]])
    """

    def __init__(self, name: str, parent: Frame | None = None, rotation: Matrix | None = None,
                 origin: Components = (0, 0, 0)) -> None:
        super().__init__(name, parent, rotation, origin)

    def frame(self, name: str, rotation: Matrix | None = None, origin: Components = (0, 0, 0)) -> Frame:
        """A frame described in this one; arguments and errors as for `Frame`.

        >>> arm = sd.Frame("n").frame("arm", sd.rotation.about("Z", sp.pi / 2), origin=[0, 0, 1])
        >>> arm, arm.parent
        (Frame('arm', in 'n'), Frame('n'))
        """
        return Frame(name, self, rotation, origin)

    def point(self, name: str, at: Components = (0, 0, 0)) -> Point:
        """A point given from this frame's origin by components in this frame (3,), m; they may move. Raises ModelError.

        >>> sd.Frame("n").frame("b", origin=[0, 0, 1]).point("P", [1, 0, 0]).position().T
        Matrix([[1, 0, 1]])
        """
        return Point(name, self, at)

    def vector(self, components: Components, name: str = "v") -> Vector:
        """A free vector, such as a force, given by components in this frame (3,). Raises ModelError.

        >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", sp.pi / 2))
        >>> b.vector([10, 0, 0], name="F").components(b.root).T
        Matrix([[0, 10, 0]])
        """
        return Vector(name, self, components)

    def body(self, mass: Scalar, inertia: Inertia, com: Components = (0, 0, 0)) -> Body:
        """A rigid body fixed to this frame: mass kg, inertia (3, 3) about the centre of mass, these axes, kg m^2, com (3,) m.

        Raises ArgumentError, listing all faults.

        >>> sd.Frame("n").body(2.0, [0.1, 0.2, 0.2], com=[1, 0, 0]).inertia().diagonal()
        Matrix([[0.1, 0.2, 0.2]])
        """
        return Body(self, mass, inertia, com)

    @property
    def root(self) -> Frame:
        """The first frame of the tree.

        >>> n = sd.Frame("n")
        >>> n.frame("a").frame("b").root is n
        True
        """
        return self.path[0]  # type: ignore[no-any-return]

    def rotation(self, to: Frame) -> sp.Matrix:
        """R, (3, 3), that takes components of this frame to those of another: r_to = R r_self. Raises ArgumentError.

        >>> q = sd.coordinates("q")
        >>> n = sd.Frame("n")
        >>> n.frame("b", sd.rotation.about("X", q)).rotation(n)
        Matrix([
        [1,      0,       0],
        [0, cos(q), -sin(q)],
        [0, sin(q),  cos(q)]])
        """
        return sp.Matrix(rotation_between(self, to))

    def angular_velocity(self, seen_from: Frame | None = None, components: Frame | None = None) -> sp.Matrix:
        """omega of this frame seen from another, (3, 1), rad/s: R_dot R^T = [omega x].

        seen_from    default: the first frame of the tree
        components   the frame along whose axes the components are taken; default: seen_from
        Raises ArgumentError for frames of different trees, ModelError for rates that have no symbol.

        >>> a, b = sd.coordinates("a b")
        >>> arm = sd.Frame("n").frame("arm", sd.rotation.about("Z", a))
        >>> arm.frame("hand", sd.rotation.about("X", b)).angular_velocity().T
        Matrix([[b_dot*cos(a), b_dot*sin(a), a_dot]])
        """
        seen_from, components = self._defaults(seen_from, components)
        return sp.Matrix(angular_motion(seen_from, self, components, 1)[0])

    def angular_acceleration(self, seen_from: Frame | None = None, components: Frame | None = None) -> sp.Matrix:
        """alpha of this frame, (3, 1), rad/s^2: the rate of its omega seen from `seen_from`, or from this frame, the same.

        Arguments and errors as for `angular_velocity`.

        >>> q = sd.coordinates("q")
        >>> sd.Frame("n").frame("b", sd.rotation.about("Z", q)).angular_acceleration().T
        Matrix([[0, 0, q_ddot]])
        """
        seen_from, components = self._defaults(seen_from, components)
        return sp.Matrix(angular_motion(seen_from, self, components, 2)[1])

    def position(self, of: Axes | Point | None = None, components: Frame | None = None) -> sp.Matrix:
        """This frame's origin from another's, (3, 1), m; as `Point.position`.

        >>> x = sd.coordinates("x")
        >>> sd.Frame("n").frame("cart", origin=[x, 0, 0]).position().T
        Matrix([[x, 0, 0]])
        """
        return self.point(self.name).position(of, components)

    def velocity(self, seen_from: Frame | None = None, components: Frame | None = None) -> sp.Matrix:
        """Velocity of this frame's origin seen from another frame, (3, 1), m/s; as `Point.velocity`.

        >>> x = sd.coordinates("x")
        >>> sd.Frame("n").frame("cart", origin=[x, 0, 0]).velocity().T
        Matrix([[x_dot, 0, 0]])
        """
        return self.point(self.name).velocity(seen_from, components)

    def acceleration(self, seen_from: Frame | None = None, components: Frame | None = None) -> sp.Matrix:
        """Acceleration of this frame's origin seen from another frame, (3, 1), m/s^2; as `Point.acceleration`.

        >>> x = sd.coordinates("x")
        >>> sd.Frame("n").frame("cart", origin=[x, 0, 0]).acceleration().T
        Matrix([[x_ddot, 0, 0]])
        """
        return self.point(self.name).acceleration(seen_from, components)

    def _defaults(self, seen_from: Frame | None, components: Frame | None) -> tuple[Frame, Frame]:
        seen_from = self.root if seen_from is None else seen_from
        components = seen_from if components is None else components
        demand_frames(of=self, seen_from=seen_from, components=components)
        return seen_from, components

    def __repr__(self) -> str:
        return f"Frame({shown(self.name)})" if self.parent is None else f"Frame({shown(self.name)}, in {shown(self.parent.name)})"
