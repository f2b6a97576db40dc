"""A rigid body carried by a frame: its momentum, energy and equations of motion about any of its points, in any axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy as sp

from symdyn.errors import ArgumentError
from symdyn.frames.point import Point
from symdyn.frames.quantities import Quantities
from symdyn.frames.rates import moves
from symdyn.frames.rigid_body import (
    angular_momentum,
    force_equation,
    inertia_about,
    kinetic_energy,
    moment_equation,
)
from symdyn.frames.tree import Axes, angular_motion, demand_frames, rotation_between
from symdyn.model.symbols import symbols_of
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import Inertia, Scalar
    from symdyn.given import Vector as Components


class Body:
    """A rigid body fixed to a frame; `Frame.body` makes it.

    mass      kg
    inertia   (3, 3) about the centre of mass G, the frame's axes, kg m^2
    com       G from the frame's origin, a Point
    Motions are seen from the first frame of the tree, which is inertial. Below, `about` is a point fixed to the body
    (default: G), `components` the frame along whose axes the result is given (default: the body's).
    Raise ArgumentError for a point that is not fixed to the body and for frames of other trees.
    Source: lecture, chapters 2.1 and 2.2.

    >>> q = sd.coordinates("q")
    >>> m, l, I = sd.parameters("m l I")
    >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", q))
    >>> rod = b.body(m, [0, I, I], com=[l, 0, 0])
    >>> rod, rod.mass, rod.com.position(b).T
    (Body(mass m, in 'b'), m, Matrix([[l, 0, 0]]))
    """

    def __init__(self, frame: Axes, mass: Scalar, inertia: Inertia, com: Components = (0, 0, 0)) -> None:
        take = Quantities(f"body of frame {frame.name}")
        self.mass = take.mass(mass)
        self.given_inertia = sp.ImmutableMatrix(take.inertia("inertia", inertia))
        place = take.vector("com", com)
        moving = sorted({s.name for e in (self.mass, *self.given_inertia, *place) for s in symbols_of(e) if moves(s)})
        if moving:
            take.faults.append(f"body of frame {frame.name}: mass, inertia or com depend on {', '.join(moving)}; in the frame "
                               "of a rigid body they are constant")
        take.demand_none()
        self.frame = frame
        self.com = Point("G", frame, place)

    def inertia(self, about: Point | None = None, components: Axes | None = None) -> sp.Matrix:
        """I about a point, (3, 3), kg m^2: moved by the parallel axes, turned by R I R^T.

        >>> m, l, I = sd.parameters("m l I")
        >>> b = sd.Frame("n").frame("b")
        >>> b.body(m, [0, I, I], com=[l, 0, 0]).inertia(about=b.point("O")).diagonal()
        Matrix([[0, I + l**2*m, I + l**2*m]])
        """
        r, R, _ = self._at(about, components)
        return sp.Matrix(R * inertia_about(self.given_inertia, self.mass, r) * R.T)

    def angular_momentum(self, about: Point | None = None, components: Axes | None = None) -> sp.Matrix:
        """H = I omega + m r_G x v about a point, (3, 1), kg m^2/s.

        >>> q = sd.coordinates("q")
        >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", q))
        >>> b.body(2, [1, 2, 3]).angular_momentum().T
        Matrix([[0, 0, 3*q_dot]])
        """
        r, R, into = self._at(about, components)
        omega, _ = angular_motion(self._root, self.frame, into, 1)
        velocity = (about or self.com).velocity(self._root, into)
        return sp.Matrix(angular_momentum(self.inertia(about, into), omega, self.mass, R * r, velocity))

    def kinetic_energy(self, components: Axes | None = None) -> sp.Expr:
        """T = m v_G^2 / 2 + omega^T I_G omega / 2, J; the same in the components of every frame, written differently.

        >>> q = sd.coordinates("q")
        >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", q))
        >>> b.body(2, [1, 2, 3]).kinetic_energy()
        3*q_dot**2/2
        """
        _, _, into = self._at(None, components)
        omega, _ = angular_motion(self._root, self.frame, into, 1)
        return kinetic_energy(self.mass, self.inertia(None, into), self.com.velocity(self._root, into), omega)

    def force(self, components: Axes | None = None) -> sp.Matrix:
        """The force that the motion needs, (3, 1), N: m a_G.

        >>> x = sd.coordinates("x")
        >>> m = sd.parameters("m")
        >>> sd.Frame("n").frame("b", origin=[x, 0, 0]).body(m, [1, 1, 1]).force().T
        Matrix([[m*x_ddot, 0, 0]])
        """
        _, _, into = self._at(None, components)
        return sp.Matrix(force_equation(self.mass, self.com.acceleration(self._root, into)))

    def moment(self, about: Point | None = None, components: Axes | None = None) -> sp.Matrix:
        """The moment that the motion needs about a point O, (3, 1), N m: I_O alpha + omega x I_O omega + m r_G x a_O.

        >>> q = sd.coordinates("q")
        >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", q))
        >>> b.body(2, [1, 2, 3]).moment().T
        Matrix([[0, 0, 3*q_ddot]])
        """
        r, R, into = self._at(about, components)
        omega, alpha = angular_motion(self._root, self.frame, into, 2)
        acceleration = (about or self.com).acceleration(self._root, into)
        return sp.Matrix(moment_equation(self.inertia(about, into), omega, alpha, self.mass, R * r, acceleration))

    @property
    def _root(self) -> Axes:
        return self.frame.path[0]  # type: ignore[no-any-return]

    def _at(self, about: Point | None, components: Axes | None) -> tuple[sp.Matrix, sp.ImmutableMatrix, Axes]:
        """r_G from the point, the body's axes; R that takes these to the components; whose they are."""
        components = self.frame if components is None else components
        demand_frames(components=components, body=self.frame)
        if about is None:
            return sp.zeros(3, 1), rotation_between(self.frame, components), components
        if not isinstance(about, Point):
            raise ArgumentError(f"about is {shown(about)}; pass a point of frame {shown(self.frame.name)}; default: the centre "
                                "of mass")
        if about.frame is not self.frame or any(map(moves, symbols_of(about.given))):
            raise ArgumentError(f"about is {shown(about)}, which is not fixed to the body of frame {shown(self.frame.name)}; "
                                "pass a point "
                                "made with that frame's .point(...) that does not move in it")
        return sp.Matrix(self.com.given - about.given), rotation_between(self.frame, components), components

    def __repr__(self) -> str:
        return f"Body(mass {self.mass}, in {shown(self.frame.name)})"
