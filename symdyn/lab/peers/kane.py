"""A four-bar linkage by SymPy's KanesMethod, dependent speeds eliminated, and its accelerations by symbolic LU."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sympy as sp

PARAMETERS = tuple("g m1 lc1 I1 m2 lc2 I2 m3 lc3 I3 l1 l2 l3 d".split())
# Solvers of the velocity constraints in KanesMethod: the Jacobian of the dependent speeds by LU, or by Cramer's rule.
SOLVERS = ("LU", "CRAMER")


def kane(solver: str) -> tuple[sp.Matrix, sp.Matrix]:
    """Mass matrix and forcing of the speeds, in symbols q1 ... u3; the rows of q_dot = u are left out.

    The bars' frames turn relative to the ground, and speeds are along its axes: that takes the fewest operations.
    """
    from sympy.physics import mechanics as me

    v = dict(zip(PARAMETERS, sp.symbols(PARAMETERS), strict=True))
    q, u = me.dynamicsymbols("q1:4"), me.dynamicsymbols("u1:4")
    N, O = me.ReferenceFrame("N"), me.Point("O")
    O.set_vel(N, 0)
    start, bodies, loads = O, [], []
    for i in range(3):
        bar = me.ReferenceFrame(f"bar{i + 1}")
        bar.orient_axis(N, N.z, sum(q[:i + 1]))
        bar.set_ang_vel(N, sum(u[:i + 1]) * N.z)
        center, end = (start.locatenew(f"{end}{i}", v[f"{end}{i + 1}"] * bar.x) for end in ("lc", "l"))
        for point in (center, end):
            point.v2pt_theory(start, N, bar)
        bodies.append(me.RigidBody(f"bar{i + 1}", center, bar, v[f"m{i + 1}"], (me.inertia(bar, 0, 0, v[f"I{i + 1}"]), center)))
        loads.append((center, -v[f"m{i + 1}"] * v["g"] * N.y))
        start = end
    gap, rate = start.pos_from(O) - v["d"] * N.x, start.vel(N)
    method = me.KanesMethod(
        N, q_ind=q[:1], u_ind=u[:1], q_dependent=q[1:], u_dependent=u[1:], constraint_solver=solver,
        kd_eqs=[a - b.diff() for a, b in zip(u, q, strict=True)],
        configuration_constraints=[gap.dot(e) for e in (N.x, N.y)], velocity_constraints=[rate.dot(e) for e in (N.x, N.y)])
    method.kanes_equations(bodies, loads)
    plain = dict(zip([*u, *q], sp.symbols("u1:4 q1:4"), strict=True))
    return method.mass_matrix_full[3:, 3:].xreplace(plain), method.forcing_full[3:, :].xreplace(plain)


def solution(matrix: sp.Matrix, right: sp.Matrix) -> tuple[list[tuple[sp.Symbol, sp.Expr]], sp.Matrix]:
    """Steps and result of matrix x = right by LU with symbols, common subexpressions before and after taken out."""
    names = sp.numbered_symbols("x")
    steps, (matrix, right) = sp.cse([matrix, right], symbols=names)

    def named(entry: sp.Expr) -> sp.Expr:
        if entry.is_Atom:
            return entry
        steps.append((next(names), entry))
        return steps[-1][0]

    solving, (result,) = sp.cse([matrix.applyfunc(named).LUsolve(right.applyfunc(named))], symbols=names)
    return [*steps, *solving], result


def operations(steps: Sequence[tuple[Any, sp.Expr]]) -> int:
    """Operations that depend on q or u: one each for + - * / powers sin cos, changes of sign free."""
    depends = set(sp.symbols("q1:4 u1:4"))
    count = 0
    for name, value in steps:
        if value.free_symbols & depends:
            depends.add(name)
            count += int(sp.count_ops(value, visual=True).subs("NEG", 0).replace(lambda e: e.is_Symbol, lambda e: sp.S.One))
    return count
