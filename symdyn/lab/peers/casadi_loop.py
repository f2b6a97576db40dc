"""C code of CasADi's functions, compiled into a loop in which each evaluation waits for the one before."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.lab.peers.program import Program, State, address, unsorted
from symdyn.runtime.building import cache
from symdyn.runtime.building.compiler import Compiler

# Name of the function in a loop.
EVALUATION = "evaluation"
_LOOP = """
CASADI_SYMBOL_EXPORT void prepare(const double *p, double *c)
{{
    const double *arg[{sz_arg}] = {{p}};
    double *res[{sz_res}] = {{c}}, w[{sz_w}];
    casadi_int iw[{sz_iw}];
    {prologue}
}}

CASADI_SYMBOL_EXPORT void loop(long n, long fed, double *q, const double *u, const double *p, const double *c, double *out)
{{
    const double *arg[{sz_arg}] = {{q, u, p, c}};
    double *res[{sz_res}] = {{out}}, w[{sz_w}];
    casadi_int iw[{sz_iw}];
    const double start = q[fed];
    // CasADi's code asks whether an argument is there, wherever it takes an entry; here the compiler knows.
    if (!q || !u || !p || !c || !out) return;
    for (long i = 0; i < n; i++) {{
        evaluation(arg, res, iw, w, 0);
        q[fed] = start + 1e-9 * out[{last}];
    }}
    q[fed] = start;
}}
"""


@dataclass(frozen=True)
class Form:
    """One of the ways in which CasADi can compute accelerations, or their derivatives.

    evaluation   CasADi function (q, u, p, c) -> u_dot, or [u_dot; lam], or derivatives of u_dot; prologue (p) -> c, or None
    operations   that depend on q or u
    """

    name: str
    evaluation: Any
    prologue: Any
    operations: int


def hoisted(casadi: Any, name: str, function: Any) -> Form:
    """A function (q, u, p) as a form: what depends on its parameters alone is computed before."""
    q, u, p = function.sx_in()
    rest, symbols, values = casadi.extract_parametric(function(q, u, p), p)
    c = casadi.vertcat(*symbols)
    main = casadi.Function(EVALUATION, [q, u, p, c], [rest])
    return Form(name, main, casadi.Function("prologue", [p], [casadi.vertcat(*values)]), operations(casadi, main))


def operations(casadi: Any, function: Any) -> int:
    """Operations that depend on q or u: one each for + - * / sqrt sin cos, changes of sign and copies free."""
    free = (casadi.OP_NEG, casadi.OP_ASSIGN)
    depends: dict[int, bool] = {}  # by place of the result; places are used again
    count = 0
    for k in range(function.n_instructions()):
        op, taken, given = function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
        if op == casadi.OP_OUTPUT:
            continue
        if op == casadi.OP_INPUT:
            depends[given[0]] = taken[0] < 2
        elif op == casadi.OP_CONST:
            depends[given[0]] = False
        else:
            depends[given[0]] = any(depends[i] for i in taken)
            count += depends[given[0]] and op not in free
    return count


def casadi_program(casadi: Any, compiler: Compiler, form: Form, state: State, p: np.ndarray, q_order: Sequence[int],
                   u_order: Sequence[int]) -> Program:
    """The C code of a form of the accelerations, compiled, at a state; orders as in Description. p (n_p,): must outlive the
    program."""
    n_u = len(u_order)
    run, out = casadi_loop(casadi, compiler, form, state, p, q_order, u_order, n_u - 1)
    return Program(form.name, run, lambda: unsorted(out[:n_u], tuple(u_order)),
                   (lambda: out[n_u:].copy()) if len(out) > n_u else None)


def casadi_loop(casadi: Any, compiler: Compiler, form: Form, state: State, p: np.ndarray, q_order: Sequence[int],
                u_order: Sequence[int], last: int) -> tuple[Callable[[int], None], np.ndarray]:
    """The C code of a form, compiled, in a loop at a state: run(n), and where the result of the last evaluation is.

    last   the entry of the result that a coordinate of the next evaluation depends on
    """
    functions = [form.evaluation] + ([form.prologue] if form.prologue else [])
    generator = casadi.CodeGenerator("peer")
    for function in functions:
        generator.add(function)
    sizes = {f"sz_{what}": max(4, *[getattr(f, f"sz_{what}")() for f in functions]) for what in ("arg", "res", "iw", "w")}
    evaluation = f"int {EVALUATION}("
    text = generator.dump().replace(f"CASADI_SYMBOL_EXPORT {evaluation}", f"static {evaluation}") + _LOOP.format(
        **sizes, last=last, prologue="prologue(arg, res, iw, w, 0);" if form.prologue else "")
    library = cache.load(text, "casadi_peer", compiler)
    c = np.zeros(max(1, form.prologue.numel_out(0) if form.prologue else 1))
    library.prepare(address(p), address(c))
    q, u = state.q[list(q_order)], state.u[list(u_order)]
    out, fed = np.zeros(form.evaluation.numel_out(0)), q_order.index(state.fed)

    def run(n: int) -> None:
        library.loop(ctypes.c_long(n), ctypes.c_long(fed), address(q), address(u), address(p), address(c), address(out))

    return run, out
