"""Equations of symdyn's in SymPy's terms: functions of time, mass matrices and forcing, as KanesMethod has them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import sympy as sp

from symdyn.errors import SymdynError
from symdyn.formulation.equations import Equations
from symdyn.model.symbols import GivenMotion, GivenRate, Rate


@dataclass(frozen=True)
class SympyEquations:
    """M u' + C_r^T lam = f with K q' = K_u of functions of time; names as in SymPy's KanesMethod.

    q, u, lam       columns of functions of time: coordinates, speeds, multipliers
    inputs          functions of time that are given; parameters: symbols
    mass_matrix, forcing   M (n_u, n_u) and f (n_u, 1), without multipliers
    rates           q' in terms of q, u and t, a column
    constraints     C of positions, C_dot of velocity constraints; C_r, F_d of C_r u' = F_d; empty where there are none
    """

    q: sp.ImmutableMatrix
    u: sp.ImmutableMatrix
    lam: sp.ImmutableMatrix
    inputs: tuple[sp.Expr, ...]
    parameters: tuple[sp.Symbol, ...]
    mass_matrix: sp.ImmutableMatrix
    forcing: sp.ImmutableMatrix
    rates: sp.ImmutableMatrix
    constraints: sp.ImmutableMatrix
    C_r: sp.ImmutableMatrix
    F_d: sp.ImmutableMatrix

    @property
    def mass_matrix_full(self) -> sp.Matrix:
        """Mass matrix of [q'; u'], with constraints of [q'; u'; lam], for the right side forcing_full."""
        n_q, n_c = len(self.q), len(self.lam)
        if not n_c:
            return sp.diag(sp.eye(n_q), self.mass_matrix)
        inner = sp.BlockMatrix([[self.mass_matrix, self.C_r.T], [self.C_r, sp.zeros(n_c)]])
        return sp.diag(sp.eye(n_q), sp.Matrix(inner))

    @property
    def forcing_full(self) -> sp.Matrix:
        """[q'; f], with constraints [q'; f; F_d]."""
        return sp.Matrix([*self.rates, *self.forcing, *self.F_d])

    def kindiffdict(self) -> dict[sp.Expr, sp.Expr]:
        """q' -> what it is in terms of q, u and t; empty entries where u is q' itself."""
        t = _time()
        return {sp.diff(q, t): rate for q, rate in zip(self.q, self.rates, strict=True) if sp.diff(q, t) != rate}


def to_sympy(equations: Equations, simplify: bool = True) -> SympyEquations:
    """The equations in SymPy's terms; see Equations.to_sympy."""
    if not all(name in equations.quantities for name in ("M_tilde", "bias", "rates")):
        raise SymdynError(f"{equations.name} ({equations.formulation}) has no mass matrix that could be written out; derive the "
                          "embedded equations, system.embedding()")
    s, t = equations.symbols, _time()
    same: dict[sp.Basic, Any] = {sp.Symbol("t"): t}
    for symbol in (*s.coordinates, *s.speeds, *s.states, *s.inputs):
        same[symbol] = _function(symbol, t)
    same |= {q.dot: sp.diff(same[q], t) for q in s.coordinates}
    same |= {u: sp.diff(same[q], t) for q in s.coordinates for u in s.speeds if u == q.dot}

    def written(name: str) -> sp.ImmutableMatrix:
        return sp.ImmutableMatrix(sp.Matrix(equations.explicit(name, simplify=simplify)).xreplace(same))

    n_c, n_u = len(equations.constraints), len(s.speeds)
    empty = sp.ImmutableMatrix(0, 1, [])
    lam = [sp.Function(f"lam{k + 1}")(t) for k in range(n_c)]
    rows = empty
    if n_c:
        C, C_dot = written("C"), written("C_dot")
        rows = sp.ImmutableMatrix([C[k] if holds else C_dot[k] for k, holds in enumerate(equations.holonomic)])
    return SympyEquations(
        sp.ImmutableMatrix([same[q] for q in s.coordinates]), sp.ImmutableMatrix([same[u] for u in s.speeds]),
        sp.ImmutableMatrix(lam) if lam else empty, tuple(same[i] for i in s.inputs), s.parameters, written("M_tilde"),
        -written("bias"), written("rates"), rows, written("C_r") if n_c else sp.ImmutableMatrix(0, n_u, []),
        written("F_d") if n_c else empty)


def _function(symbol: Any, t: sp.Symbol) -> sp.Expr:
    """A symbol as a function of time; rates of motions as derivatives."""
    if isinstance(symbol, GivenRate):
        return sp.diff(_function(GivenMotion(symbol.name.removesuffix("_dot"), **symbol._assumptions_orig), t), t)
    if symbol.name.endswith("_ddot") and not isinstance(symbol, (Rate, GivenMotion)):
        return sp.diff(_function(GivenMotion(symbol.name.removesuffix("_ddot"), **symbol._assumptions_orig), t), t, 2)
    return sp.Function(symbol.name, **symbol._assumptions_orig)(t)


def _time() -> sp.Symbol:
    from sympy.physics.vector import dynamicsymbols

    return dynamicsymbols._t
