"""C code of SymPy's KanesMethod for a four-bar linkage, dependent speeds eliminated, as PyDy generates it."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import sympy as sp

from symdyn.bench.peers.contestant import Contestant, State, address
from symdyn.bench.peers.toolchain import c_compiler
from symdyn.runtime import cache

PARAMETERS = tuple("g m1 lc1 I1 m2 lc2 I2 m3 lc3 I3 l1 l2 l3 d".split())
# What KanesMethod solves the velocity constraints with: the Jacobian of the dependent speeds by LU, or by Cramer's rule.
SOLVERS = ("LU", "CRAMER")
_CODE = """#include <math.h>
void evaluate(const double *q, const double *u, const double *p, double *out)
{{
    const double {arguments};
{steps}
}}

void loop(long n, long fed, double *q, const double *u, const double *p, double *out)
{{
    const double start = q[fed];
    for (long i = 0; i < n; i++) {{
        evaluate(q, u, p, out);
        q[fed] = start + 1e-9 * out[2];
    }}
    q[fed] = start;
}}
"""


class KanePeer:
    """The generator. Raises CompilerNotFound, whose message tells what to install."""

    name = "SymPy"

    def __init__(self) -> None:
        self.compiler = c_compiler()

    def contestants(self, values: Mapping[str, float], state: State) -> tuple[list[Contestant], dict[str, int]]:
        """The C code for each of SOLVERS, compiled, at a state; and the operations of each."""
        p = np.array([values[name] for name in PARAMETERS])
        made, counts = [], {}
        for solver in SOLVERS:
            steps, result = solution(*kane(solver))
            name = f"kane {solver.lower()}"
            counts[name] = operations([*steps, *((None, e) for e in result)])
            made.append(self._contestant(name, code(steps, result), p, state))
        return made, counts

    def _contestant(self, name: str, text: str, p: np.ndarray, state: State) -> Contestant:
        library = cache.load(text, "kane_peer", self.compiler)
        q, u, out = state.q.copy(), state.u.copy(), np.zeros(3)

        def run(n: int) -> None:
            library.loop(ctypes.c_long(n), ctypes.c_long(state.fed), address(q), address(u), address(p), address(out))

        return Contestant(name, run, out.copy)


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


def code(steps: Sequence[tuple[sp.Symbol, sp.Expr]], result: sp.Matrix) -> str:
    """The C code of a solution."""
    places = [(name, f"{group}[{k}]") for group, names in (("q", ("q1", "q2", "q3")), ("u", ("u1", "u2", "u3")), ("p", PARAMETERS))
              for k, name in enumerate(names)]
    lines = [f"const double {name} = {sp.ccode(value)};" for name, value in steps]
    lines += [f"out[{k}] = {sp.ccode(value)};" for k, value in enumerate(result)]
    return _CODE.format(arguments=", ".join(f"{name} = {place}" for name, place in places),
                        steps="\n".join(f"    {line}" for line in lines))
