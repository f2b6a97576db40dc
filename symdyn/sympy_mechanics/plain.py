"""Equations in matrices of SymPy's: M u_dot = f of coordinates q and speeds u that somebody has formed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sympy as sp

from symdyn.errors import ModelError
from symdyn.formulation.by_hand.matrices import GivenMatrices
from symdyn.shown import shown
from symdyn.sympy_mechanics.options import Options
from symdyn.sympy_mechanics.taken import Taken


def of_matrices(q: Any, u: Any, mass: Any, forcing: Any, kinematics: Any, options: Options) -> GivenMatrices:
    """The matrices of plain equations.

    kinematics   expressions in q, q', u that are zero, linear in q' and u; None: u = q'
    Raises ModelError with all faults: shapes, kinematic equations that are not linear, symbols.
    """
    q, u, forcing = (_column(values, what, options.name) for values, what in ((q, "q"), (u, "u"), (forcing, "the forcing")))
    taken = Taken(options.name, q, u, options.states)
    faults, n = taken.faults, len(u)
    M = mass if isinstance(mass, sp.MatrixBase) else _matrix(mass, taken)
    if M is None or M.shape != (n, n):
        faults.append(f"the mass matrix has the shape {'none' if M is None else f'{M.rows} x {M.cols}'}, there are {n} speeds; "
                      f"pass a matrix {n} x {n}")
        M = sp.eye(n)
    if len(forcing) != n:
        faults.append(f"the forcing has {len(forcing)} entries, there are {n} speeds; pass one for each")
        forcing = [sp.S.Zero] * n
    matrices = None
    rates = [taken.same[f].dot if f in taken.same else sp.S.Zero for f in q]
    if kinematics is not None:
        matrices = _linear(kinematics, q, u, taken)
    elif [s for s in taken.speeds if s not in rates]:
        if len(u) != len(q):
            faults.append(f"there are {len(q)} coordinates and {len(u)} speeds, and no kinematic equations; pass "
                          f"kinematics=[...], one expression for each coordinate that is zero, linear in the derivatives of the "
                          "coordinates and in the speeds")
        else:
            matrices = sp.eye(n), -sp.eye(n), sp.zeros(n, 1)
    if matrices is not None:
        taken.use("the kinematic equations", *matrices)
    taken.use("the mass matrix", M)
    taken.use("the forcing", *forcing)
    options.use(taken)
    return GivenMatrices(options.name, "matrices", options.symbols(taken), taken.same, sp.ImmutableMatrix(M), sp.Matrix(forcing),
                         matrices, states=options.rates(taken), outputs=options.outputs_of())


def _linear(kinematics: Any, q: Sequence[Any], u: Sequence[Any], taken: Taken) -> tuple[sp.Matrix, sp.Matrix, sp.Matrix] | None:
    if not isinstance(kinematics, (list, tuple, sp.MatrixBase)):
        taken.faults.append(f"kinematics is {shown(kinematics)}; pass a list of expressions that are zero")
        return None
    rows = sp.Matrix([taken.expression(e, f"kinematics[{k + 1}]") for k, e in enumerate(kinematics)])
    if len(rows) != len(q):
        taken.faults.append(f"there are {len(rows)} kinematic equations and {len(q)} coordinates; pass one for each")
        return None
    rates = [sp.diff(f, taken.t) for f in q]
    K, A = rows.jacobian(rates), rows.jacobian(list(u))
    if any(e.has(*rates, *u) for e in (*K, *A)):
        taken.faults.append("the kinematic equations are not linear in the derivatives of the coordinates and the speeds; write "
                            "them so")
        return None
    return K, A, rows.xreplace(dict.fromkeys([*rates, *u], 0))


def _matrix(rows: Any, taken: Taken) -> sp.Matrix | None:
    """A matrix from rows; None where these are none."""
    if not isinstance(rows, (list, tuple)) or not all(isinstance(row, (list, tuple)) for row in rows):
        return None
    if len({len(row) for row in rows}) > 1:
        return None
    return sp.Matrix([[taken.expression(e, "an entry of the mass matrix") for e in row] for row in rows])


def _column(values: Any, what: str, name: str) -> list[Any]:
    entries = list(values) if isinstance(values, (list, tuple, sp.MatrixBase)) else [values]
    wrong = [e for e in entries if not isinstance(e, (sp.Expr, int, float))]
    if wrong:
        raise ModelError([f"{what} holds {wrong[0]!r:.60}; pass functions of time and expressions of SymPy's"], name)
    return [sp.sympify(e, strict=True) for e in entries]
