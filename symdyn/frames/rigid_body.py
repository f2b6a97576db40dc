"""Inertia, momentum, energy and the equations of motion of one rigid body, about any of its points.

Functions take numbers or expressions: with numbers alone they return NumPy arrays and floats, else sp.Matrix and expressions.
All vectors and matrices of one call are in the same axes, those of the n-frame or of the b-frame, which one does not matter:
omega, alpha and the accelerations are seen from the inertial frame. SI units.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import sympy as sp

from symdyn.frames.product import times
from symdyn.frames.quantities import Quantities

if TYPE_CHECKING:
    from symdyn.given import Array, Matrix, Scalar
    from symdyn.given import Vector as Components


class ForceSystem(NamedTuple):
    """A force (3,), N, at a point, and the moment about it (3,), N m.

    >>> at_G = sd.frames.equivalent_force_system([10.0, 0.0, 0.0], r=[0.0, 2.0, 0.0])
    >>> at_G.force, at_G.moment
    (array([10.,  0.,  0.]), array([  0.,   0., -20.]))
    """

    force: Any
    moment: Any


# -- inertia

def inertia_about(I_G: Matrix, mass: Scalar, r: Components) -> Array:
    """The inertia about a point O from that about the centre of mass G: I_O = I_G + m (r.r 1 - r r^T), (3, 3), kg m^2.

    I_G    (3, 3) about G, kg m^2
    mass   kg
    r      (3,) from O to G, or from G to O, m
    Raises ArgumentError, listing all faults, for an inertia that is not symmetric or that no body has, and wrong shapes.
    Source: lecture, chapter 2.2.

    >>> sd.frames.inertia_about([0.1, 0.2, 0.2], 2.0, [1.0, 0.0, 0.0])
    array([[0.1, 0. , 0. ],
           [0. , 2.2, 0. ],
           [0. , 0. , 2.2]])
    """
    take = Quantities("inertia_about")
    I, m, r = take.inertia("I_G", I_G), take.mass(mass), take.vector("r", r)
    take.demand_none()
    return take.given_back(I + m * _of_particle(r))


def inertia_about_com(I_O: Matrix, mass: Scalar, r: Components) -> Array:
    """The inertia about the centre of mass G from that about O: I_G = I_O - m (r.r 1 - r r^T), (3, 3), kg m^2.

    Arguments and errors as for `inertia_about`; also where what is left is the inertia of no body, because r is too long.

    >>> m, l = sd.parameters("m l")
    >>> sd.frames.inertia_about_com(sp.diag(0, m * l**2 / 3, m * l**2 / 3), m, [l / 2, 0, 0])
    Matrix([
    [0,         0,         0],
    [0, l**2*m/12,         0],
    [0,         0, l**2*m/12]])
    """
    take = Quantities("inertia_about_com")
    I, m, r = take.inertia("I_O", I_O), take.mass(mass), take.vector("r", r)
    take.demand_none()
    result = I - m * _of_particle(r)
    take.check_inertia("what is left about G", result)
    take.demand_none()
    return take.given_back(result)


def rotated_inertia(R: Matrix, I: Matrix) -> Array:
    """The same inertia in other axes: R I R^T, (3, 3), where R takes components to the new axes (nI = nR_b bI bR_n).

    Raises NotARotation with numbers if R is no rotation, ArgumentError for faults of I.
    Source: lecture, chapter 2.1.

    >>> np.round(sd.frames.rotated_inertia(sd.rotation.about("Z", np.pi / 2), [1.0, 2.0, 3.0]), 12) + 0.0
    array([[2., 0., 0.],
           [0., 1., 0.],
           [0., 0., 3.]])
    """
    take = Quantities("rotated_inertia")
    R, I = take.rotation(R), take.inertia("I", I)
    take.demand_none()
    return take.given_back(times(R, I, R.T))


def point_inertia(masses: Sequence[Scalar], positions: Sequence[Components]) -> Array:
    """The inertia of particles about the point that their positions start from: sum m (r.r 1 - r r^T), (3, 3), kg m^2.

    masses      (n,) kg
    positions   (n, 3) m
    Raises ArgumentError for lists of different lengths and wrong shapes.
    Source: lecture, chapters 2.1 and 2.2.

    >>> sd.frames.point_inertia([1.0, 2.0], [[1, 0, 0], [0, 1, 0]])
    array([[2., 0., 0.],
           [0., 1., 0.],
           [0., 0., 3.]])
    """
    take = Quantities("point_inertia")
    particles = take.particles(masses, positions)
    take.demand_none()
    return take.given_back(sum((m * _of_particle(r) for m, r in particles), sp.zeros(3, 3)))


def center_of_mass(masses: Sequence[Scalar], positions: Sequence[Components]) -> Array:
    """sum m r / sum m, (3,), m; arguments and errors as for `point_inertia`, and ArgumentError for masses that add up to 0.

    >>> sd.frames.center_of_mass([1.0, 3.0], [[0, 0, 0], [4, 0, 0]])
    array([3., 0., 0.])
    """
    take = Quantities("center_of_mass")
    particles = take.particles(masses, positions)
    total = sp.Add(*[m for m, _ in particles])
    if not take.faults and total == 0:
        take.faults.append("center_of_mass: the masses add up to 0; pass at least one mass that is not zero")
    take.demand_none()
    return take.given_back(sum((m * r for m, r in particles), sp.zeros(3, 1)) / total)


# -- momentum and energy

def angular_momentum(inertia: Matrix, omega: Components, mass: Scalar = 0, r_G: Components = (0, 0, 0),
                     velocity: Components = (0, 0, 0)) -> Array:
    """The moment of momentum about a point O of the body: H_O = I_O omega + m r_G x v_O, (3,), kg m^2/s.

    inertia    (3, 3) about O; about the centre of mass, and at a point at rest, the second term is not there
    omega      (3,) rad/s
    mass       kg
    r_G        (3,) from O to the centre of mass, m
    velocity   (3,) v_O, m/s
    Raises ArgumentError, listing all faults.
    Source: lecture, chapter 2.1.

    >>> sd.frames.angular_momentum([1.0, 2.0, 3.0], omega=[0.5, 0.0, 2.0])
    array([0.5, 0. , 6. ])
    """
    take = Quantities("angular_momentum")
    I, w, m = take.inertia("inertia", inertia), take.vector("omega", omega), take.mass(mass)
    r, v = take.vector("r_G", r_G), take.vector("velocity", velocity)
    take.demand_none()
    return take.given_back(I * w + m * r.cross(v))


def kinetic_energy(mass: Scalar, inertia: Matrix, velocity: Components, omega: Components, r_G: Components = (0, 0, 0)) -> Scalar:
    """T = m v_O^2 / 2 + m v_O . (omega x r_G) + omega^T I_O omega / 2, J; the same number in n- and in b-components.

    inertia, velocity   I_O (3, 3) and v_O (3,) of one point O of the body; r_G (3,) from there to the centre of mass
    Raises ArgumentError, listing all faults.
    Source: lecture, chapter 2.1.

    >>> sd.frames.kinetic_energy(2.0, [1.0, 2.0, 3.0], velocity=[3.0, 0.0, 0.0], omega=[0.0, 0.0, 2.0])
    15.0
    """
    take = Quantities("kinetic_energy")
    m, I = take.mass(mass), take.inertia("inertia", inertia)
    v, w, r = take.vector("velocity", velocity), take.vector("omega", omega), take.vector("r_G", r_G)
    take.demand_none()
    half = sp.Rational(1, 2)
    return take.given_back(half * m * v.dot(v) + m * v.dot(w.cross(r)) + half * w.dot(I * w))


# -- equations of motion

def moment_equation(inertia: Matrix, omega: Components, alpha: Components, mass: Scalar = 0, r_G: Components = (0, 0, 0),
                    acceleration: Components = (0, 0, 0)) -> Array:
    """The moment that the motion needs about a point O of the body, (3,), N m:

    M_O = I_O alpha + omega x I_O omega + m r_G x a_O.

    inertia        (3, 3) about O; about the centre of mass G leave out the rest: M_G = I_G alpha + omega x I_G omega
    omega, alpha   (3,) rad/s, rad/s^2
    mass           kg
    r_G            (3,) from O to the centre of mass, m
    acceleration   (3,) a_O seen from the inertial frame, m/s^2
    Raises ArgumentError, listing all faults.
    Source: lecture, chapter 2.1.

    >>> p, q, r = sp.symbols("p q r")
    >>> A, B, C = sd.parameters("A B C")
    >>> sd.frames.moment_equation(sp.diag(A, B, C), [p, q, r], [0, 0, 0]).T
    Matrix([[-B*q*r + C*q*r, A*p*r - C*p*r, -A*p*q + B*p*q]])
    """
    take = Quantities("moment_equation")
    I, w, w_rate = take.inertia("inertia", inertia), take.vector("omega", omega), take.vector("alpha", alpha)
    m, r, a = take.mass(mass), take.vector("r_G", r_G), take.vector("acceleration", acceleration)
    take.demand_none()
    return take.given_back(times(I, w_rate) + w.cross(times(I, w)) + m * r.cross(a))


def force_equation(mass: Scalar, acceleration: Components, omega: Components = (0, 0, 0), alpha: Components = (0, 0, 0),
                   r_G: Components = (0, 0, 0)) -> Array:
    """The force that the motion needs, (3,), N: F = m a_G = m (a_O + alpha x r_G + omega x (omega x r_G)).

    Arguments as for `moment_equation`; O = G if r_G is left out. Raises ArgumentError, listing all faults.
    Source: lecture, chapters 2.1 and 2.2.

    >>> sd.frames.force_equation(2.0, [0.0, 0.0, 0.0], omega=[0.0, 0.0, 3.0], r_G=[0.5, 0.0, 0.0])
    array([-9.,  0.,  0.])
    """
    take = Quantities("force_equation")
    m, a, w = take.mass(mass), take.vector("acceleration", acceleration), take.vector("omega", omega)
    w_rate, r = take.vector("alpha", alpha), take.vector("r_G", r_G)
    take.demand_none()
    return take.given_back(m * (a + w_rate.cross(r) + w.cross(w.cross(r))))


def planar_moment_equation(inertia: Scalar, alpha: Scalar, mass: Scalar = 0, r_G: Components = (0, 0),
                           acceleration: Components = (0, 0)) -> Scalar:
    """About z at a point O: M_O = I_O alpha + m (x_G a_y - y_G a_x), N m; at the centre of mass I_G alpha.

    inertia             I_O about z, kg m^2, a number or expression
    alpha               rad/s^2
    r_G, acceleration   (2,) from O to the centre of mass, m, and a_O seen from the inertial frame, m/s^2
    Raises ArgumentError, listing all faults.
    Source: lecture, chapter 2.2.

    >>> sd.frames.planar_moment_equation(0.5, alpha=4.0)
    2.0
    """
    take = Quantities("planar_moment_equation")
    I, w_rate = take.scalar("inertia", inertia, least=0, unit="kg m^2"), take.scalar("alpha", alpha)
    m, r, a = take.mass(mass), take.vector("r_G", r_G, 2), take.vector("acceleration", acceleration, 2)
    take.demand_none()
    return take.given_back(I * w_rate + m * (r[0] * a[1] - r[1] * a[0]))


def planar_force_equation(mass: Scalar, acceleration: Components, omega: Scalar = 0, alpha: Scalar = 0,
                          r_G: Components = (0, 0)) -> Array:
    """In the plane: F = m a_G = m (a_O + alpha [-y_G, x_G] - omega^2 r_G), (2,), N.

    Arguments as for `planar_moment_equation`; omega rad/s. Raises ArgumentError, listing all faults.
    Source: lecture, chapter 2.2.

    >>> sd.frames.planar_force_equation(2.0, [0.0, 0.0], omega=3.0, r_G=[0.5, 0.0])
    array([-9.,  0.])
    """
    take = Quantities("planar_force_equation")
    m, a = take.mass(mass), take.vector("acceleration", acceleration, 2)
    w, w_rate, r = take.scalar("omega", omega), take.scalar("alpha", alpha), take.vector("r_G", r_G, 2)
    take.demand_none()
    return take.given_back(m * (a + w_rate * sp.Matrix([-r[1], r[0]]) - w**2 * r))


def equivalent_force_system(force: Components, r: Components, moment: Components = (0, 0, 0)) -> ForceSystem:
    """A force and a moment at P as they act at another point G of the body: the same force, and M_G = M_P + r x F.

    force    (3,) at P, N
    r        (3,) from G to P, m
    moment   (3,) about P, N m
    Raises ArgumentError, listing all faults.
    Source: lecture, chapter 2.2.

    >>> sd.frames.equivalent_force_system([10.0, 0.0, 0.0], r=[0.0, 2.0, 0.0]).moment
    array([  0.,   0., -20.])
    """
    take = Quantities("equivalent_force_system")
    F, r, M = take.vector("force", force), take.vector("r", r), take.vector("moment", moment)
    take.demand_none()
    return ForceSystem(take.given_back(F), take.given_back(M + r.cross(F)))


def _of_particle(r: sp.Matrix) -> sp.Matrix:
    """r.r 1 - r r^T"""
    return r.dot(r) * sp.eye(3) - r * r.T
