"""Times of several equations of one mechanism at one state, taken in turns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from symdyn.errors import EvaluationError
from symdyn.formulation.equations import Equations
from symdyn.tape.tape import Tape
from symdyn.timing.loops import Loop, best_times, compiled_loop

SEED = 20


def times_side_by_side(equations: Sequence[Equations], repeats: int = 30) -> list[float]:
    """Seconds of one evaluation of each right-hand side, all at the same state, parameters at their defaults.

    Raises CompilerNotFound without a C compiler, EvaluationError where an evaluation stops early and its time means nothing.
    """
    x = _state(equations[0])
    loops = [compiled_loop(e, x, _fed(e)) for e in equations]
    for loop, e in zip(loops, equations, strict=True):
        _demand_whole(loop, e)
    return best_times([loop.run for loop in loops], repeats)


def _state(equations: Equations) -> np.ndarray:
    """A state [q; u; z] within 1 rad, 1 m and their rates; Euler parameters of unit norm."""
    s = equations.symbols
    x = np.random.default_rng(SEED).uniform(-1, 1, len(s.coordinates) + len(s.speeds) + len(s.states))
    for group in equations.unit_groups:
        places = [s.coordinates.index(q) for q in group]
        x[places] /= np.linalg.norm(x[places])
    return x


def _fed(equations: Equations) -> int:
    """The first entry of the state that the accelerations depend on: fed with the result of an evaluation, it makes the
    next one wait."""
    s = equations.symbols
    n_q, n_u = len(s.coordinates), len(s.speeds)
    used = {leaf.args[1] for leaf in Tape.of(equations.recorder, u_dot=equations.quantity("rhs")[n_q:n_q + n_u]).inputs}
    return next((k for k, symbol in enumerate((*s.coordinates, *s.speeds, *s.states)) if symbol.name in used), 0)


def _demand_whole(loop: Loop, equations: Equations) -> None:
    """Raise EvaluationError if the evaluation stops at a pivot; numbers that are not finite take as long as others."""
    code = loop.evaluator.call(loop.evaluator.address)
    if code > 0:
        raise EvaluationError(f"{equations.name} was to be timed in its {equations.formulation} form, but "
                              f"{loop.evaluator.library.reason(code)}; give all parameters numbers that make sense, in the "
                              "defaults of the system")
