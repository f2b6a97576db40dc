"""Forces of rigid contacts: rows that parameters switch, solved at every state as a small system of linear equations.

With the forces lam along the rows, the relative accelerations there are r = r_0 + D lam, D = J M^-1 J^T (with the constraints
of the mechanism in M^-1). A row that holds has r = 0; a tangential one that does not has lam_T = s lam_N with the friction s of
sliding, 0 in an open contact; friction of a joint that slides is a given force. Elimination without exchange of rows is right for
every mode that a motion can be in: where the accelerations follow from the forces in one way only, D with the friction of sliding
is a P-matrix, whose pivots are positive in every order. A pivot that vanishes is the edge of Painleve's region.

Source: Pfeiffer and Glocker, Multibody Dynamics with Unilateral Contacts, chapters 5 and 8; Cottle, Pang and Stone, The Linear
Complementarity Problem, section 3.3.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from symdyn.formulation.algebra import TapeAlgebra
from symdyn.model.contacts.lowering import SOFTNESS, RigidContact
from symdyn.model.quantity import Quantity
from symdyn.spatial.vectors import vector, zeros
from symdyn.tape.differentiate import jacobian
from symdyn.tape.node import is_zero
from symdyn.tape.passes import substitute

# A closed contact whose gap is more than this part of its width touches elsewhere.
FAR = Fraction(1, 1000)


class ContactRows:
    """Quantities of rigid contacts at a state, apart from each other's modes.

    leaves          of the forces, in the order of the rows
    accelerations   u_dot as it follows from the leaves, (n_u,); rate: the derivative by time of recorded values at these
    """

    def __init__(self, algebra: TapeAlgebra, contacts: Sequence[RigidContact], leaves: Mapping[Quantity, Any],
                 accelerations: np.ndarray, rate: Callable[[Sequence[Any]], Sequence[Any]]) -> None:
        self.algebra, self.contacts, recorder = algebra, contacts, algebra.recorder
        self.forces = list(leaves)
        with algebra.section("contacts: relative velocities and accelerations"):
            unknown, n = list(leaves.values()), len(leaves)
            self.slips = vector(*[algebra.expression(e) for c in contacts for e in c.rows])
            relative = list(rate(self.slips.tolist()))
            self.free = vector(*substitute(tuple(relative), dict.fromkeys(unknown, 0), recorder))
            self._relative, self._unknown = relative, unknown
            self.directions = jacobian(recorder, accelerations.tolist(), unknown, "forward").reshape(-1, n)

    @cached_property
    def D(self) -> np.ndarray:
        """Derivative of the relative accelerations by the forces, (n, n)."""
        n = len(self._unknown)
        with self.algebra.section("contacts: relative velocities and accelerations"):
            return jacobian(self.algebra.recorder, self._relative, self._unknown, "forward").reshape(n, n)

    def solved(self) -> dict[Quantity, Any]:
        """The forces in the mode that the parameters say."""
        a = self.algebra
        with a.section("contacts: forces"):
            held = [a.expression(s) for c in self.contacts for s in c.switches]
            n = len(held)
            H: np.ndarray = np.eye(n, dtype=int).astype(object)
            fixed = zeros(n)
            reasons: list[str] = []
            sizes: list[Any] = []  # of the rows of each contact, of which some may not move: a tangent across a joint
            softness: list[Any] = []
            first = 0
            for c in self.contacts:
                rows = range(first, first + len(c.rows))
                for k, s in zip(rows[c.normal:], c.slide, strict=True):
                    free = (1 - held[k]) * a.expression(s)
                    if c.normal:
                        H[k, first] = free
                    else:  # friction of a joint, whose force is known
                        fixed[k] = free
                jams = "its friction jams, there is no acceleration with a finite force (Painleve), or " * (
                    c.normal and len(c.rows) > c.normal)
                reasons += [f"contact {c.name}: {jams}its normal has no direction: points at one place, a disc that lies flat, a "
                            "curve that ends" if c.normal else f"contact {c.name}: nothing moves along it"] * len(rows)
                sizes += [sum((self.D[k, k] for k in rows), 0)] * len(rows)
                softness += [1 / (1 + a.expression(s) * a.expression(s)) for s in c.shares] or [1] * len(rows)
                first += len(rows)
            A, shared = self.D @ H, a.expression(SOFTNESS)
            for i in range(n):
                A[i] = held[i] * A[i]
                A[i, i] = A[i, i] + (1 - held[i])
            softened = A + np.diag([shared * held[i] * sizes[i] * softness[i] for i in range(n)])
            least = [a.rounding * held[i] * sizes[i] for i in range(n)]
            factors = _Factors(a, softened, least, reasons)
            b = vector(*[-h * f for h, f in zip(held, self.free + self.D @ fixed, strict=True)])
            x = factors.solve(b)
            if n > 1:  # rows that depend on each other are softened, which a second step undoes in what the rows determine
                x = x + factors.solve(b - A @ x)
            forces = self._in_one_place(a.name("contact_force", H @ x + fixed), held)
            return dict(zip(self.forces, forces, strict=True))

    def _in_one_place(self, forces: np.ndarray, held: Sequence[Any]) -> np.ndarray:
        """Forces, which hold a round shape on a curve or surface as long as it touches in the place that they act at."""
        recorder, first = self.algebra.recorder, 0
        for c in self.contacts:
            if c.width is not None:
                gap, width = self.algebra.expression(c.gap), self.algebra.expression(c.width)
                margin = FAR * width - held[first] * recorder.apply("abs", gap)
                reason = (f"contact {c.name} is closed, and its shape touches in another place, too: it is wider than a hollow; "
                          "one contact is in one place at a time; make the curve or surface smoother")
                for k in range(first, first + len(c.rows)):
                    forces[k] = recorder.guard(forces[k], margin, reason)
            first += len(c.rows)
        return forces

    def gaps(self) -> np.ndarray:
        """[gap, static, kinetic, restitution of each contact; slips], as time stepping takes them."""
        a = self.algebra
        with a.section("contacts: gaps and relative velocities"):
            return vector(*[a.expression(e) for c in self.contacts for e in (c.gap, *c.constants)], *self.slips)

    def steps(self, speeds: Sequence[Any]) -> np.ndarray:
        """[J; M^-1 J^T] row by row, as time stepping takes them; speeds: leaves."""
        J = jacobian(self.algebra.recorder, self.slips.tolist(), speeds, "forward")
        return vector(*J.ravel(), *self.directions.ravel())

    def numbers(self, forces: Mapping[Quantity, Any], rates_along: Callable[[np.ndarray], Sequence[Any]]) -> np.ndarray:
        """[gap, static, kinetic, restitution of each contact; slips; free accelerations; forces; D; M^-1 J^T; N M^-1 J^T] row by
        row.

        rates_along   q_dot that belongs to a change of the speeds
        """
        a = self.algebra
        with a.section("contacts"):
            of_contacts = [a.expression(e) for c in self.contacts for e in (c.gap, *c.constants)]
            moved = np.array([list(rates_along(column)) for column in self.directions.T], dtype=object).T
            return vector(*of_contacts, *self.slips, *self.free, *forces.values(), *self.D.ravel(), *self.directions.ravel(),
                          *moved.ravel())


class _Factors:
    """A matrix factorized without exchange of rows; least, reasons: of its pivots."""

    def __init__(self, algebra: TapeAlgebra, A: np.ndarray, least: Sequence[Any], reasons: Sequence[str]) -> None:
        self.A = A.copy()
        self.pivots: list[Any] = []
        n = len(A)
        for k in range(n):
            self.pivots.append(algebra.divisor(self.A[k, k], least[k], reasons[k]))
            for i in range(k + 1, n):
                if not is_zero(self.A[i, k]):
                    self.A[i, k] = self.A[i, k] / self.pivots[k]
                    self.A[i, k + 1:] = self.A[i, k + 1:] - self.A[i, k] * self.A[k, k + 1:]

    def solve(self, b: np.ndarray) -> np.ndarray:
        """x with A x = b, (n,)."""
        n, x = len(b), b.copy()
        for k in range(n):
            x[k] = x[k] - self._sum(k, range(k), x)
        for k in reversed(range(n)):
            x[k] = (x[k] - self._sum(k, range(k + 1, n), x)) / self.pivots[k]
        return x

    def _sum(self, k: int, columns: Iterable[int], x: np.ndarray) -> Any:
        return sum((self.A[k, j] * x[j] for j in columns if not is_zero(self.A[k, j])), 0)
