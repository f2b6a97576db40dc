"""The embedding formulation by hand: from a position map r(q, t), as the lecture derives its first examples.

r = r(q, t), r_dot = J q_dot + r_t, M r_ddot = F + F_c with the constraint reaction F_c perpendicular to the columns of J:
M_tilde q_ddot + k_tilde = F_tilde with M_tilde = J^T M J, k_tilde = J^T M (J_dot q_dot + ...), F_tilde = J^T F.
Source: lecture, chapters 3.2 and 3.4.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import ModelError
from symdyn.formulation.algebra import TapeAlgebra
from symdyn.formulation.embedding import EmbeddedEquations
from symdyn.formulation.equations import Symbols
from symdyn.formulation.motion import Motion
from symdyn.formulation.rank import first_dependent
from symdyn.model.faults import Faults
from symdyn.model.symbols import Acceleration, Coordinate, Input, Rate, as_coordinate, time
from symdyn.spatial.vectors import congruence, inner, vector
from symdyn.tape import node as kinds
from symdyn.tape.differentiate import jacobian
from symdyn.tape.recorder import Recorder


def embedding(coordinates: Sequence[Any], position: Any, mass: Any, force: Any = None, name: str = "system",
              defaults: dict[Any, float] | None = None) -> EmbeddedEquations:
    """Embedded equations of a position map.

    coordinates   generalized coordinates q, (n_q,)
    position      r(q, t), (n_r,): Cartesian coordinates of all bodies (m), planar orientations (rad)
    mass          (n_r, n_r) or its diagonal (n_r,): masses and moments of inertia, constant
    force         (n_r,) known forces and moments in the coordinates r: of q, q_dot, t, inputs, parameters
    defaults      numbers for parameters

    The result prints J, Jdot, Jd_qd, M_tilde, k_tilde, F_tilde, the reaction F_c = M r_ddot - F, and compiles like the
    equations of a System. Raises ModelError with every fault: shapes, coordinates that nothing depends on, symbols.
    """
    faults = Faults()
    given = list(coordinates) if hasattr(coordinates, "__iter__") else [coordinates]
    q = [as_coordinate(c) for c in given]
    for c in q:
        if not isinstance(c, Coordinate):
            faults.append(f"coordinate {c} is no symbol; make it with sd.coordinates")
    faults += [f"coordinate {c} is given {count} times" for c, count in Counter(q).items() if count > 1]
    # A plain symbol that is given as a coordinate is one in the expressions, too.
    same = {old: new for old, new in zip(given, q, strict=True) if isinstance(new, Coordinate) and old is not new}
    r = [e.xreplace(same) for e in _column(faults, position, "position")]
    F = [e.xreplace(same) for e in _column(faults, force if force is not None else [0] * len(r), "force")]
    M = _mass(faults, mass, len(r))
    if len(F) != len(r):
        faults.append(f"force has {len(F)} entries, position {len(r)}; give one force for each coordinate of position")
    parameters, inputs = _symbols(faults, q, r, M, F)
    if not faults:
        unused = [c for c in q if not any(e.has(c) for e in r)]
        if unused:
            faults.append(f"position does not depend on {', '.join(map(str, unused))}; the mass matrix would be singular")
    numbers = _numbers(faults, defaults or {}, parameters)
    if faults:
        raise ModelError(faults, name)
    symbols = Symbols(tuple(q), tuple(c.dot for c in q), (), tuple(inputs), tuple(parameters), numbers)
    derivation = _PositionMap(q, r, M, F, symbols)
    dependent = first_dependent(derivation.algebra.recorder, derivation.recall("M_tilde"))
    if dependent is not None:
        raise ModelError([f"the mass matrix is singular at every state: {q[dependent]} moves nothing that the coordinates after "
                          "it do not move already; leave one out, or let position depend on them separately"], name)
    return EmbeddedEquations(name, "embedding", True, symbols, derivation.algebra.recorder, derivation.algebra.leaves,
                             derivation.quantities(),
                             again=partial(embedding, coordinates, position, mass, force, name, defaults))


class _PositionMap(Motion):
    """Records the quantities; derivatives of r by the chain rule over the tape."""

    def __init__(self, q: list[Coordinate], r: list[sp.Expr], M: sp.Matrix, F: list[sp.Expr], symbols: Symbols) -> None:
        recorder = Recorder()
        leaves: dict[sp.Basic, Any] = {time: recorder.leaf("t", kinds.TIME)}
        for group, kind in ((symbols.coordinates, kinds.COORDINATE), (symbols.speeds, kinds.SPEED),
                            (symbols.inputs, kinds.INPUT), (symbols.parameters, kinds.PARAMETER)):
            leaves.update({s: recorder.leaf(s.name, kind) for s in group})
        algebra = TapeAlgebra(recorder, leaves)
        super().__init__(algebra, symbols.coordinates, symbols.speeds, [leaves[c.dot] for c in q], (), symbols.inputs,
                         symbols.parameters)
        with recorder.section("position r and force F"):
            self.r = recorder.name("r", algebra.constants(r))
            self.M = algebra.matrix(M)
            self.F = recorder.name("F", algebra.constants(F))

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


def _column(faults: Faults, values: Any, what: str) -> list[sp.Expr]:
    if isinstance(values, sp.MatrixBase):
        if 1 not in values.shape:
            faults.append(f"{what} is a {values.shape[0]} x {values.shape[1]} matrix; pass a column")
        values = list(values)
    if not isinstance(values, (list, tuple, np.ndarray)):
        faults.append(f"{what} is {values!r}; pass a list or column of expressions")
        return []
    return [faults.expression(v, f"{what}[{k + 1}]") for k, v in enumerate(values)]


def _mass(faults: Faults, mass: Any, n: int) -> sp.Matrix:
    try:
        M = sp.Matrix(mass)
    except (TypeError, ValueError, sp.SympifyError):
        faults.append(f"mass is {mass!r}; pass a square matrix, or a list for its diagonal")
        return sp.eye(n)
    M = M.applyfunc(lambda e: faults.expression(e, "mass"))
    if M.shape != (n, n) and 1 in M.shape and len(M) == n:
        M = sp.diag(*M)
    if M.shape != (n, n):
        faults.append(f"mass has the shape {M.shape[0]} x {M.shape[1]}, position has {n} entries; pass {n} x {n}")
        return sp.eye(n)
    if M != M.T:
        faults.append("mass is not symmetric; pass a symmetric matrix")
    for k in range(n):
        if M[k, k].is_number and M[k, k] < 0:
            faults.append(f"mass[{k + 1}, {k + 1}] is {M[k, k]}; pass zero or a positive number")
    return M


def _numbers(faults: Faults, defaults: Mapping[Any, Any], parameters: list[sp.Symbol]) -> dict[sp.Symbol, float]:
    """Numbers for parameters, given by symbol or name."""
    names = {p.name: p for p in parameters}
    numbers = {}
    for key, value in defaults.items():
        name = str(getattr(key, "name", key))
        if name not in names:
            faults.append(f"defaults has a number for {name!r}, which is no parameter; there are {', '.join(names) or 'none'}")
        elif not isinstance(value, (int, float, sp.Number)):
            faults.append(f"defaults: the value of {name} is {value!r}; pass a number")
        else:
            numbers[names[name]] = float(value)
    return numbers


def _symbols(faults: Faults, q: list[Any], r: list[sp.Expr], M: sp.Matrix, F: list[sp.Expr]) -> tuple[list, list]:
    """Parameters and inputs in the order of first use."""
    moving = {time, *q, *[c.dot for c in q if isinstance(c, Coordinate)]}
    parameters: dict[sp.Symbol, None] = {}
    inputs: dict[sp.Symbol, None] = {}
    for what, expressions, rates_allowed in (("mass", list(M), False), ("position", r, False), ("force", F, True)):
        for e in expressions:
            for s in sorted(e.free_symbols, key=lambda a: a.name):
                if s.name == "t" and s != time:
                    faults.append(f"{what} uses a symbol t with assumptions, which is not the time; use symdyn.t")
                elif isinstance(s, Acceleration) or (isinstance(s, Rate) and not rates_allowed):
                    faults.append(f"{what} uses {s}; it may use coordinates and t" + (", and speeds" if rates_allowed else ""))
                elif s in moving:
                    if what == "mass":
                        faults.append(f"mass depends on {s}, but must be constant")
                elif isinstance(s, (Coordinate, Rate)):
                    faults.append(f"{what} uses {s}, which is not among the coordinates {', '.join(map(str, q))}; add it, or "
                                  "use a parameter in its place")
                elif isinstance(s, Input):
                    inputs[s] = None
                else:
                    parameters[s] = None
    return list(parameters), list(inputs)
