"""C code of SymPy's KanesMethod for a four-bar linkage, dependent speeds eliminated, as PyDy generates it."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence

import numpy as np
import sympy as sp

from symdyn.bench.toolchain import c_compiler
from symdyn.lab.peers.kane import PARAMETERS, SOLVERS, kane, operations, solution
from symdyn.lab.peers.program import Program, State, address
from symdyn.runtime.building import cache

_CODE = """#include <math.h>
static void evaluate(const double *q, const double *u, const double *p, double *out)
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
    """The generator. Raises CompilerNotFound, whose message says what to install."""

    def __init__(self) -> None:
        self.compiler = c_compiler()

    def programs(self, values: Mapping[str, float], state: State) -> tuple[list[Program], dict[str, int]]:
        """The C code for each of SOLVERS, compiled, at a state; and the operations of each."""
        p = np.array([values[name] for name in PARAMETERS])
        made, counts = [], {}
        for solver in SOLVERS:
            steps, result = solution(*kane(solver))
            name = f"kane {solver.lower()}"
            counts[name] = operations([*steps, *((None, e) for e in result)])
            made.append(self._program(name, code(steps, result), p, state))
        return made, counts

    def _program(self, name: str, text: str, p: np.ndarray, state: State) -> Program:
        library = cache.load(text, "kane_peer", self.compiler)
        q, u, out = state.q.copy(), state.u.copy(), np.zeros(3)

        def run(n: int) -> None:
            library.loop(ctypes.c_long(n), ctypes.c_long(state.fed), address(q), address(u), address(p), address(out))

        return Program(name, run, out.copy)


def code(steps: Sequence[tuple[sp.Symbol, sp.Expr]], result: sp.Matrix) -> str:
    """The C code of a solution."""
    groups = {"q": ("q1", "q2", "q3"), "u": ("u1", "u2", "u3"), "p": PARAMETERS}
    places = [(name, f"{group}[{k}]") for group, names in groups.items() for k, name in enumerate(names)]
    lines = [f"const double {name} = {sp.ccode(value)};" for name, value in steps]
    lines += [f"out[{k}] = {sp.ccode(value)};" for k, value in enumerate(result)]
    return _CODE.format(arguments=", ".join(f"{name} = {place}" for name, place in places),
                        steps="\n".join(f"    {line}" for line in lines))
