"""symdyn's own compiled right-hand side."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from symdyn.formulation.equations import Equations
from symdyn.lab.peers.program import Program, State
from symdyn.timing.loops import compiled_loop


def symdyn_program(equations: Equations, state: State) -> Program:
    """The right-hand side of equations without extra states, at their default parameters, at a state."""
    n_q = len(state.q)
    loop = compiled_loop(equations, np.concatenate([state.q, state.u]), state.fed)
    return Program("symdyn", loop.run, lambda: loop.evaluator.out[n_q:].copy())


def with_multipliers(equations: Equations) -> Equations:
    """The same equations with the quantity "rhs_lam": right-hand side and multipliers from one evaluation."""
    there = equations.singular_fallback
    quantities = {**equations.quantities, "rhs_lam": lambda: np.concatenate([equations.quantity(n) for n in ("rhs", "lam")])}
    return replace(equations, quantities=quantities, singular_fallback=None if there is None else with_multipliers(there))


def constrained_program(equations: Equations, state: State) -> Program:
    """As symdyn_program, of equations `with_multipliers`, which are computed, too."""
    n_q, n = len(state.q), len(state.q) + len(state.u)
    loop = compiled_loop(equations, np.concatenate([state.q, state.u]), state.fed, "rhs_lam")
    out = loop.evaluator.out
    return Program("symdyn with multipliers", loop.run, lambda: out[n_q:n].copy(), lambda: out[n:].copy())


def derivatives_program(equations: Equations, state: State) -> Program:
    """The derivative of the accelerations by q and u, from that of the right-hand side by x, as symdyn_program."""
    n_q, n = len(state.q), len(state.q) + len(state.u)
    loop = compiled_loop(equations, np.concatenate([state.q, state.u]), state.fed, "jacobian_x", n * n - 1)
    return Program("symdyn", loop.run, lambda: loop.evaluator.out.reshape(n, n)[n_q:].copy())
