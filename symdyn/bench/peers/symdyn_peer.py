"""symdyn's own compiled right-hand side."""

from __future__ import annotations

import numpy as np

from symdyn.bench.kernel import compiled_loop
from symdyn.bench.peers.contestant import Contestant, State
from symdyn.formulation.equations import Equations


def symdyn_contestant(equations: Equations, state: State) -> Contestant:
    """The right-hand side of equations without extra states, at their default parameters, at a state."""
    n_q = len(state.q)
    loop = compiled_loop(equations, np.concatenate([state.q, state.u]), state.fed)
    return Contestant("symdyn", loop.run, lambda: loop.evaluator.out[n_q:].copy())
