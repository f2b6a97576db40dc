"""The embedding formulation by hand: from a position map r(q, t), as the lecture derives its first examples.

r = r(q, t), r_dot = J q_dot + r_t, M r_ddot = F + F_c with the constraint reaction F_c perpendicular to the columns of J:
M_tilde q_ddot + k_tilde = F_tilde with M_tilde = J^T M J, k_tilde = J^T M (J_dot q_dot + ...), F_tilde = J^T F.
Source: lecture, chapters 3.2 and 3.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.errors import ModelError
from symdyn.formulation.accelerations import Motion
from symdyn.formulation.by_hand.checks import ByHand, Part, recording
from symdyn.formulation.equations import Symbols
from symdyn.formulation.printed.provenance import OfCoordinates
from symdyn.formulation.probes.rank import first_dependent
from symdyn.formulation.trees.embedding import EmbeddedEquations
from symdyn.model.symbols import Coordinate, GivenMotion, take_over, time
from symdyn.spatial.vectors import congruence, inner, vector
from symdyn.tape.differentiate import jacobian

if TYPE_CHECKING:
    from symdyn.given import Matrix, Numbers, Vector


def embedding(coordinates: Sequence[sp.Symbol], position: Vector, mass: Matrix, force: Vector | None = None, name: str = "system",
              defaults: Numbers | None = None) -> EmbeddedEquations:
    """Embedded equations of a position map.

    coordinates   generalized coordinates q, (n_q,)
    position      r(q, t), (n_r,): Cartesian coordinates of all bodies (m), planar orientations (rad)
    mass          (n_r, n_r) or its diagonal (n_r,): masses and moments of inertia, constant
    force         (n_r,) known forces and moments in the coordinates r: of q, q_dot, t, inputs, parameters
    defaults      numbers for parameters

    The result prints J, Jdot, Jd_qd, M_tilde, k_tilde, F_tilde, the reaction F_c = M r_ddot - F, and compiles like the
    equations of a System. Raises ModelError with every fault: shapes, coordinates that nothing depends on, symbols.

    >>> q = sd.coordinates("q")
    >>> m, l, g = sd.parameters("m l g")
    >>> equations = sd.embedding([q], [l * sp.sin(q), -l * sp.cos(q)], [m, m], [0, -m * g])
    >>> equations.M_tilde, equations.F_tilde
    (Matrix([[l**2*m]]), Matrix([[-g*l*m*sin(q)]]))
    """
    given = ByHand(coordinates, name)
    faults, q = given.faults, given.q
    r = given.column(position, "position")
    F = given.column(force if force is not None else [0] * len(r), "force")
    M = given.mass(mass, len(r), "position has")
    if len(F) != len(r):
        faults.append(f"force has {len(F)} entries, position {len(r)}; give one force for each coordinate of position")
    parameters, inputs = given.symbols([Part("mass", list(M), moving=False), Part("position", r),
                                        Part("force", F, speeds=True, inputs=True)])
    if not faults:
        unused = [c for c in q if not any(e.has(c) for e in r)]
        if unused:
            faults.append(f"position does not depend on {', '.join(map(str, unused))}; the mass matrix would be singular")
    numbers = given.faults.numbers(defaults, parameters, "defaults", "parameter", take_over)
    if faults:
        raise ModelError(faults, name)
    symbols = Symbols(tuple(q), tuple(c.dot for c in q), (), tuple(inputs), tuple(parameters), numbers)
    derivation = PositionMap(q, r, M, F, symbols)
    dependent = first_dependent(derivation.algebra.recorder, derivation.recall("M_tilde"))
    if dependent is not None:
        raise ModelError([f"the mass matrix is singular at every state: {q[dependent]} moves nothing that the coordinates after "
                          "it do not move already; leave one out, or let position depend on them separately"], name)
    return EmbeddedEquations(name, "embedding", True, symbols, derivation.algebra.recorder, derivation.algebra.leaves,
                             derivation.quantities(),
                             provenance=OfCoordinates(derivation),
                             again=partial(embedding, coordinates, position, mass, force, name, defaults))


class PositionMap(Motion):
    """Records the quantities; derivatives of r by the chain rule over the tape."""

    def __init__(self, q: list[Coordinate], r: list[sp.Expr], M: sp.Matrix, F: list[sp.Expr], symbols: Symbols) -> None:
        algebra = recording(symbols)
        recorder, leaves = algebra.recorder, algebra.leaves
        super().__init__(algebra, symbols.coordinates, symbols.speeds, [leaves[c.dot] for c in q], (), symbols.inputs,
                         symbols.parameters)
        with recorder.section("position r and force F"):
            self.r = recorder.name("r", algebra.constants(r))
            self.M = algebra.matrix(M)
            self.F = recorder.name("F", algebra.constants(F))
        self.given_motion = any(e.has(time, GivenMotion) for e in r)

    def quantities(self) -> dict[str, Any]:
        own = {"J": self.J, "Jdot": self.Jdot, "Jd_qd": self.Jd_qd, "k_tilde": self.k_tilde, "F_tilde": self.F_tilde,
               "F_c": self.F_c, "r": lambda: self.r, "kinetic_energy": self.kinetic_energy}
        return {**super().quantities(), **own}

    def J(self) -> np.ndarray:
        with self.algebra.section("velocity transformation J = dr/dq"):
            return jacobian(self.algebra.recorder, self.r.tolist(), self._leaves(self.coordinates), "forward")

    def Jdot(self) -> np.ndarray:
        return self.rate(self.J())

    def Jd_qd(self) -> np.ndarray:
        """d r_dot / dt at constant q_dot."""
        with self.algebra.section("accelerations with q_ddot = 0"):
            return self.rate(self.rate(self.r))

    def M_tilde(self) -> np.ndarray:
        J = self.J()
        with self.algebra.section("mass matrix J^T M J"):
            return self.algebra.name("M_tilde", congruence(self.M, J))

    def k_tilde(self) -> np.ndarray:
        return self.algebra.name("k_tilde", self._onto_columns(self.M @ self.Jd_qd()))

    def F_tilde(self) -> np.ndarray:
        return self.algebra.name("F_tilde", self._onto_columns(self.F))

    def bias(self) -> np.ndarray:
        return self._onto_columns(self.M @ self.Jd_qd() - self.F)

    def inverse_dynamics(self) -> np.ndarray:
        return self._onto_columns(self.M @ (self.J() @ self.speed_rates + self.Jd_qd()) - self.F)

    def F_c(self) -> np.ndarray:
        """M r_ddot - F with the accelerations of the motion."""
        return self.M @ (self.J() @ self.recall("accelerations") + self.Jd_qd()) - self.F

    def kinetic_energy(self) -> Any:
        """r_dot^T M r_dot / 2, J."""
        velocity = self.rate(self.r)
        return inner(velocity, self.M @ velocity) / 2

    def _onto_columns(self, values: np.ndarray) -> np.ndarray:
        J = self.J()
        return vector(*[inner(J[:, j], values) for j in range(J.shape[1])])
