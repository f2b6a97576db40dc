"""CasADi's C code for a four-bar linkage: [[M, C_r^T], [C_r, 0]] solved for accelerations and multipliers with symbols."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from symdyn.bench.toolchain import c_compiler, package_folder
from symdyn.lab.peers.casadi_loop import EVALUATION, Form, casadi_program, hoisted, operations
from symdyn.lab.peers.program import Program, State

PARAMETERS = tuple("g m1 lc1 I1 m2 lc2 I2 m3 lc3 I3 l1 l2 l3 d".split())


class KktPeer:
    """The generator. Raises MissingExtra or CompilerNotFound, whose messages name what to install."""

    def __init__(self) -> None:
        package_folder("casadi")
        self.compiler = c_compiler()
        import casadi

        self.casadi = casadi

    def forms(self) -> list[Form]:
        """The ways in which CasADi solves with symbols; the last is the one with the fewest operations again, with what
        depends on parameters alone computed before.

        LDL^T takes the speeds before the multipliers: in CasADi's order of minimum degree a pivot is 0.
        """
        ca = self.casadi
        q, u, p = (ca.SX.sym(name, n) for name, n in (("q", 3), ("u", 3), ("p", len(PARAMETERS))))
        A, b = self._system(q, u, dict(zip(PARAMETERS, ca.vertsplit(p), strict=True)))
        D, LT, order = ca.ldl(A, False)
        V, R, beta, rows, columns = ca.qr_sparse(A)
        solved = {"solve": ca.solve(A, b), "qr": ca.qr_solve(b, V, R, beta, rows, columns), "ldl": ca.ldl_solve(b, D, LT, order)}
        functions = {f"casadi {way}": ca.Function(EVALUATION, [q, u, p], [x], {"cse": True}) for way, x in solved.items()}
        forms = [Form(name, f, None, operations(ca, f)) for name, f in functions.items()]
        leanest = min(forms, key=lambda form: form.operations)
        return [*forms, hoisted(ca, f"{leanest.name} hoisted", leanest.evaluation)]

    def _system(self, q: Any, u: Any, v: Mapping[str, Any]) -> tuple[Any, Any]:
        """Matrix and right side, from the positions of the bars; with absolute angles, which takes the fewest operations."""
        ca = self.casadi
        angles = ca.cumsum(q)
        end, M, k = ca.SX.zeros(2), ca.SX.zeros(3, 3), ca.SX.zeros(3)
        for i in range(3):
            along = ca.vertcat(ca.cos(angles[i]), ca.sin(angles[i]))
            J, W = ca.jacobian(end + v[f"lc{i + 1}"] * along, q), ca.jacobian(angles[i], q)
            M += v[f"m{i + 1}"] * J.T @ J + v[f"I{i + 1}"] * W.T @ W
            k += v[f"m{i + 1}"] * J.T @ (ca.jtimes(J @ u, q, u) + ca.vertcat(0, v["g"]))
            end += v[f"l{i + 1}"] * along
        C_r = ca.jacobian(end, q)
        return ca.blockcat(M, C_r.T, C_r, ca.SX(2, 2)), ca.vertcat(-k, -ca.jtimes(C_r @ u, q, u))

    def programs(self, values: Mapping[str, float], state: State) -> tuple[list[Program], dict[str, int]]:
        """The C code of all forms, compiled, at a state; and the operations of each."""
        p = np.array([values[name] for name in PARAMETERS])
        forms = self.forms()
        return ([casadi_program(self.casadi, self.compiler, form, state, p, range(3), range(3)) for form in forms],
                {form.name: form.operations for form in forms})
