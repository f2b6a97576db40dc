"""Linear stiffness and damping of a body, 6 x 6."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.model.elements.base import Element
from symdyn.model.elements.checks import least_eigenvalue, six
from symdyn.model.elements.site import Action, Site, Validity
from symdyn.shown import shown
from symdyn.spatial.vectors import cross, dot, inner, vector

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, Matrix, Vector

ANGLES = ("auto", "ZYX", "rotation vector")
# Tilt, in degrees, up to which a linear stiffness is meant; turn up to which it is safe that its angles do not jump.
TILT, TURN = 20.0, 120.0
# (1 - x/2 cot(x/2)) / x^2 is the sum of these times x^(2k), used below x^2 = SMALL, where what is left out is below 1e-26.
COTANGENT = (Fraction(1, 12), Fraction(1, 720), Fraction(1, 30240), Fraction(1, 1209600), Fraction(1, 47900160),
             Fraction(691, 1307674368000), Fraction(1, 74724249600))
SMALL = Fraction(1, 100)
# cos^2 of the pitch angle below which its rate does not follow from the angular velocity in floats.
LOCKED = Fraction(1, 10**12)


class LinearStiffness(Element):
    """Generalized force F = force - K (xi - reference) along xi = [x, y, z, phi, theta, psi]: the place of a point of the body
    in the n-frame and the body's angles.

    K           (6, 6): N/m, N, N m, N m/rad; a list of 6 stands for its diagonal
    force       (6,) at the reference: N, N m; point: (3,) body axes, m; reference: (6,) m, rad
    angles      "ZYX": roll, pitch, yaw of R = R_z(psi) R_y(theta) R_x(phi), along whose rates the moments act; singular at a
                pitch of 90 degrees, where the run stops with a message
                "rotation vector": axis times angle, without singularity below half a turn, where it jumps to the opposite
                "auto": "ZYX" for a body whose joint with the ground has these angles, also through bodies that are fixed to
                each other, else the rotation vector; in absolute coordinates as the joints of the tree have it
    Where the moments vanish with the angles, both are the same for small angles; a prestress (`force`) turns with the axes of
    its kind. The potential is 1/2 (xi - reference)^T K (xi - reference) - force . (xi - reference) with the symmetric part of K;
    what is not symmetric in K has no potential and counts as a force that does work (a matrix of moments about fixed axes, of
    a prestressed mooring for example, is not quite symmetric). A linear stiffness is meant for small angles: a tilt above 20
    degrees gives a warning, and a turn above 120 degrees where the angles are not coordinates of a joint.

    >>> system = sd.System("float", gravity=[0, 0, -9.81])
    >>> box = system.add_body("box", mass=500, inertia=[100, 100, 100])
    >>> joint = system.add_joint(sd.Prismatic("heave", system.ground, box, axis=[0, 0, 1]))
    >>> stiffness = system.add_load(sd.LinearStiffness(box, [0, 0, 1e4, 0, 0, 0]))
    >>> system.compile(backend="numpy").rhs(0.0, [-0.1, 0.0]).round(4)
    array([ 0.  , -7.81])
    """

    kind = "linear stiffness"

    def __init__(self, body: BodyOrName, K: Matrix, force: Vector = (0,) * 6, point: Vector = (0, 0, 0),
                 reference: Vector = (0,) * 6, angles: str = "auto", name: str = "") -> None:
        super().__init__(body, name)
        where, faults = self.where, self.faults
        self.K = faults.square(K, 6, f"{where}: K")
        self.force = six(faults, force, f"{where}: force")
        self.point = faults.vector(point, f"{where}: point")
        self.reference = six(faults, reference, f"{where}: reference")
        self.angles = angles
        if angles not in ANGLES:
            faults.append(f"{where}: angles is {shown(angles)}; pass one of {', '.join(map(repr, ANGLES))}")

    @property
    def constants(self) -> Sequence[sp.Expr]:
        return [*self.K, *self.force, *self.point, *self.reference]

    @property
    def units(self) -> Mapping[str, Sequence[sp.Expr]]:
        return {"N/m": list(self.K[:3, :3]), "N": [*self.K[3:, :3], *self.force[:3]], "N/rad": list(self.K[:3, 3:]),
                "N m/rad": list(self.K[3:, 3:]), "N m": self.force[3:], "m": [*self.point, *self.reference[:3]],
                "rad": self.reference[3:]}

    def with_angles_of(self, roll_pitch_yaw: bool) -> LinearStiffness:
        """The same with "auto" decided, for a description in which the body hangs on another joint.

        roll_pitch_yaw   whether the body's own joint with the ground has these angles as coordinates
        """
        decided = copy.copy(self)
        if self.angles == "auto":
            decided.angles = "ZYX" if roll_pitch_yaw else "rotation vector"
        return decided

    def act(self, site: Site) -> Action:
        a = site.algebra
        turned = self.angles == "rotation vector" or (self.angles == "auto" and not site.angles_given)
        point, force = a.constants(self.point), a.constants(self.force)
        place = site.p + site.R @ point
        xi = vector(*place, *(site.rotation_vector if turned else site.angles)) - a.constants(self.reference)
        even, odd = a.matrix((self.K + self.K.T) / 2), a.matrix((self.K - self.K.T) / 2)
        elastic, other = force - even @ xi, -(odd @ xi)
        return Action(self._wrench(site, turned, point, elastic), self._wrench(site, turned, point, other),
                      inner(xi, even @ xi) / 2 - inner(force, xi),
                      (self._tilt(site),) if site.angles_given and not turned else (self._tilt(site), self._turn(site)))

    def _wrench(self, site: Site, turned: bool, point: np.ndarray, Q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Force and moment about the origin, body axes, of generalized forces along xi."""
        f = site.R.T @ Q[:3]
        n = about_vector(site, Q[3:]) if turned else about_angles(site, Q[3:], self.where)
        return f, n + cross(point, f)

    def _tilt(self, site: Site) -> Validity:
        a, R = site.algebra, site.R
        level = a.sqrt(R[2, 0] * R[2, 0] + R[2, 1] * R[2, 1])
        tilt = a.recorder.apply("atan2", level, R[2, 2]) * 180 / a.recorder.pi()
        return Validity(f"tilt of {self.where}", tilt, -1.0, TILT,
                        f"{self.where}: the body tilts by {{value}} degrees; a linear stiffness is meant for small angles, up to "
                        f"{TILT:g} degrees")

    def _turn(self, site: Site) -> Validity:
        """The energy of a potential that is alike on both sides of half a turn decides nothing."""
        a, r = site.algebra, site.rotation_vector
        return Validity(f"turn of {self.where}", a.sqrt(dot(r, r)) * 180 / a.recorder.pi(), -1.0, TURN,
                        f"{self.where}: the body has turned by {{value}} degrees; at half a turn its angles jump, and the "
                        "moments with them")


def about_angles(site: Site, Q: np.ndarray, where: str) -> np.ndarray:
    """The moment, body axes, that does the work Q . [phi_dot, theta_dot, psi_dot]: its components along the axes of the three."""
    a = site.algebra
    phi, theta, _ = site.angles
    c, s = a.cos(phi), a.sin(phi)
    c_theta = a.cos(theta)
    c_theta = a.recorder.guard(c_theta, c_theta * c_theta - LOCKED, f"{where}: gimbal lock, the pitch angle is 90 degrees, where "
                               "moments along yaw and roll are the same; use angles='rotation vector'")
    across = (Q[2] + a.sin(theta) * Q[0]) / c_theta
    return vector(Q[0], c * Q[1] + s * across, c * across - s * Q[1])


def about_vector(site: Site, Q: np.ndarray) -> np.ndarray:
    """The moment, body axes, that does the work Q . r_dot of the rotation vector r: Q - r x Q / 2 + k r x (r x Q) with
    k = (1 - |r|/2 cot(|r|/2)) / |r|^2, as r_dot = omega + r x omega / 2 + k r x (r x omega), body axes."""
    a, r = site.algebra, site.rotation_vector
    apply = a.recorder.apply
    square = dot(r, r)
    series: Any = 0
    for factor in reversed(COTANGENT):
        series = series * square + factor
    far = apply("max", square, SMALL)  # a branch that is not taken must not divide by zero
    half = a.sqrt(far) / 2
    k = apply("select", apply("lt", square, SMALL), series, (1 - half * a.cos(half) / a.sin(half)) / far)
    first = cross(r, Q)
    return Q - first / 2 + k * cross(r, first)


class LinearDamping(Element):
    """F = -B [v; omega]: velocity of a point of the body and angular velocity, force and moment about the point, all in body
    axes, in the order surge, sway, heave, roll, pitch, yaw.

    B       (6, 6): N s/m, N s, N m s; a list of 6 stands for its diagonal
    point   (3,) body axes, m
    A matrix of numbers whose symmetric part has a negative eigenvalue feeds energy into some motions: it gives a ModelWarning.

    >>> system = sd.System("float", gravity=[0, 0, -9.81])
    >>> box = system.add_body("box", mass=500, inertia=[100, 100, 100])
    >>> joint = system.add_joint(sd.Prismatic("heave", system.ground, box, axis=[0, 0, 1]))
    >>> damping = system.add_load(sd.LinearDamping(box, [0, 0, 200, 0, 0, 0]))
    >>> system.compile(backend="numpy").rhs(0.0, [-0.1, 0.5]).round(4)
    array([  0.5 , -10.01])
    """

    kind = "linear damping"

    def __init__(self, body: BodyOrName, B: Matrix, point: Vector = (0, 0, 0), name: str = "") -> None:
        super().__init__(body, name)
        self.B = self.faults.square(B, 6, f"{self.where}: B")
        self.point = self.faults.vector(point, f"{self.where}: point")
        least = least_eigenvalue((self.B + self.B.T) / 2)
        if least < 0:
            self.doubts.append(f"{self.where}: the symmetric part of B has the eigenvalue {least:.4g}, so that it feeds energy "
                               "into some motions; damping has none below zero; look at its signs")

    @property
    def constants(self) -> Sequence[sp.Expr]:
        return [*self.B, *self.point]

    @property
    def units(self) -> Mapping[str, Sequence[sp.Expr]]:
        return {"N s/m": list(self.B[:3, :3]), "N s": [*self.B[:3, 3:], *self.B[3:, :3]], "N m s": list(self.B[3:, 3:]),
                "m": list(self.point)}

    def act(self, site: Site) -> Action:
        point = site.algebra.constants(self.point)
        v = site.v + cross(site.omega, point)
        F = -(site.algebra.matrix(self.B) @ vector(*v, *site.omega))
        return Action(other=(F[:3], F[3:] + cross(point, F[:3])))
