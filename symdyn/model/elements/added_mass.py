"""Added mass: the inertia of water that a body moves along with itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import sympy as sp

from symdyn.model.elements.checks import least_eigenvalue
from symdyn.model.faults import Faults

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, Matrix, Vector


class AddedMass:
    """The kinetic energy T = 1/2 v^T A v of the water around a body, v = [surge, sway, heave; roll, pitch, yaw] rates of a
    point of the body in body axes.

    A       (6, 6) symmetric, no eigenvalue below zero: kg, kg m, kg m^2; a list of 6 stands for its diagonal
    point   (3,) of the body, body axes, m

    The forces are those of an ideal fluid that is at rest far away (Kirchhoff's equations): n = -d/dt(A v)_n - omega x (A v)_n -
    v x (A v)_f, so that energy is kept; to first order they are the usual -A v_dot. Water has no weight here: gravity is in the
    buoyancy. Source: Lamb, Hydrodynamics, section 124; Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control,
    section 6.3.

    >>> system = sd.System("float", gravity=[0, 0, -9.81])
    >>> box = system.add_body("box", mass=500, inertia=[100, 100, 100])
    >>> joint = system.add_joint(sd.Prismatic("heave", system.ground, box, axis=[0, 0, 1]))
    >>> water = system.add_load(sd.AddedMass(box, sp.diag(0, 0, 300, 0, 0, 0)))
    >>> system.compile(backend="numpy").rhs(0.0, [-0.1, 0.0]).round(4)
    array([ 0.    , -6.1313])
    """

    kind = "added mass"

    def __init__(self, body: BodyOrName, A: Matrix, point: Vector = (0, 0, 0), name: str = "") -> None:
        self.body = body
        self.label = name
        self.faults = Faults()
        where = name or f"added mass on {getattr(body, 'name', body)}"
        self.A = self.faults.square(A, 6, f"{where}: A")
        self.point = self.faults.vector(point, f"{where}: point")
        uneven = [(i + 1, j + 1) for i in range(6) for j in range(i) if not _equal(self.A[i, j], self.A[j, i])]
        if uneven and not self.faults:
            i, j = uneven[0]
            self.faults.append(f"{where}: A is not symmetric: A[{i}, {j}] = {self.A[i - 1, j - 1]}, A[{j}, {i}] = "
                               f"{self.A[j - 1, i - 1]}; pass a symmetric matrix, which has a kinetic energy")
        least = 0.0 if self.faults else least_eigenvalue(self.A)
        if least < 0:
            self.faults.append(f"{where}: A has the eigenvalue {least:.4g}, so that the water would have a negative kinetic "
                               "energy; pass a matrix without eigenvalues below zero; look at its signs")

    @property
    def constants(self) -> Sequence[sp.Expr]:
        """Expressions that may hold parameters only."""
        return [*self.A, *self.point]

    @property
    def expressions(self) -> Sequence[sp.Expr]:
        """Nothing else is used."""
        return ()

    @property
    def units(self) -> Mapping[str, Sequence[sp.Expr]]:
        """Unit -> expressions in this unit."""
        return {"kg": list(self.A[:3, :3]), "kg m": [*self.A[:3, 3:], *self.A[3:, :3]], "kg m^2": list(self.A[3:, 3:]),
                "m": list(self.point)}


def _equal(a: sp.Expr, b: sp.Expr) -> bool:
    if a == b:
        return True
    if not (a.is_number and b.is_number):
        return False
    return bool(abs(a - b) <= 1e-9 * max(abs(a), abs(b)))
