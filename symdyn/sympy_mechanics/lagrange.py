"""LagrangesMethod: what its equations consist of."""

from __future__ import annotations

from typing import Any

import sympy as sp

from symdyn.errors import ModelError
from symdyn.formulation.by_hand.matrices import GivenMatrices, GivenRow
from symdyn.sympy_mechanics.options import Options
from symdyn.sympy_mechanics.taken import Taken


def of_lagrange(lagrange: Any, options: Options) -> GivenMatrices:
    """The matrices of a LagrangesMethod; its speeds are the derivatives of its coordinates, its multipliers the same as symdyn's.

    Raises ModelError for equations that are not formed yet, and for all faults of symbols.
    """
    name = options.name
    if lagrange.eom is None:
        raise ModelError(["the equations of this LagrangesMethod are not formed yet; call form_lagranges_equations() first"],
                         name)
    taken = Taken(name, lagrange.q, None, options.states)
    n = len(lagrange.q)
    holonomic = list(lagrange._hol_coneqs)
    others = list(lagrange.coneqs)[len(holonomic):]
    rates = list(lagrange.q.diff(taken.t))
    still = dict.fromkeys(rates, 0)
    rows = [GivenRow(f"holonomic_{k + 1}", e) for k, e in enumerate(holonomic)]
    for k, e in enumerate(others):
        coefficients = sp.Matrix([e]).jacobian(rates)
        if any(c.has(*rates) for c in coefficients):
            taken.faults.append(f"the nonholonomic constraint {e} is not linear in the derivatives of the coordinates; write it "
                                "so")
        rows.append(GivenRow(f"nonholonomic_{k + 1}", None, tuple(coefficients), e.xreplace(still)))
    mass, forcing = lagrange.mass_matrix[:, :n], lagrange.forcing
    taken.use("the constraints", *holonomic, *others)
    taken.use("the mass matrix", mass)
    taken.use("the forcing", forcing)
    options.use(taken)
    return GivenMatrices(name, "lagrange", options.symbols(taken), taken.same, mass, forcing, None, None, None, tuple(rows), None,
                         _energy(lagrange, rates, taken.t), options.rates(taken), options.outputs_of())


def _energy(lagrange: Any, rates: list[sp.Expr], t: sp.Symbol) -> tuple[sp.Expr, sp.Expr, sp.Expr] | None:
    """T and V of L = T - V, and the power of the other forces, with T quadratic in the derivatives of the coordinates; None where
    L has other terms with these, depends on functions of time besides the coordinates, or on the time."""
    L = lagrange._L[0]
    V = -L.xreplace(dict.fromkeys(rates, 0))
    T = L + V
    scaled = T.xreplace({rate: 2 * rate for rate in rates}) - 4 * T
    known = {*lagrange.q, *rates}
    others = [e for e in L.atoms(sp.Derivative) | L.atoms(sp.core.function.AppliedUndef) if e not in known]
    unsteady = L.xreplace({e: sp.Dummy() for e in sorted(known, key=lambda e: -e.count_ops())}).has(t)
    if others or unsteady or sp.expand(scaled) != 0:
        return None
    return T, V, sum((f * rate for f, rate in zip(lagrange._term4, rates, strict=True)), sp.S.Zero)
