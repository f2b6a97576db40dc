"""Derivatives of motions that stay at a kink, such as that of |x| at x = 0, and of losses that end at one: there are none.

A motion that passes a kink has derivatives: it is there for no time. For a smooth function f(x + h) + f(x - h) - 2 f(x) vanishes
like h^2; at a kink like h.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from symdyn.errors import EvaluationError
from symdyn.runtime.integrating.outcome import Request
from symdyn.runtime.losses import Cost

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Steps, relative to 1 and the entry; how much what they give may vary at a kink, and how far it is above rounding.
STEPS, SAME, ABOVE = np.array([1e-4, 1e-5, 1e-6]), 0.1, 1e3
REMEDY = "derivatives differ from side to side there, and the numbers are between them; take a smooth law, such as sqrt(x**2 + " \
         "eps**2) in place of Abs(x), or another start"


def has_kink(values: Callable[[np.ndarray], np.ndarray], x: np.ndarray, k: int) -> bool:
    """Whether a function of rows (n, n_x), with values (n, m), has a kink at x (n_x,) in entry k; False where it is undefined."""
    h = STEPS * max(1.0, abs(x[k]))
    rows = np.tile(x, (1 + 2 * len(h), 1))
    rows[1:, k] += np.concatenate([h, -h])
    try:
        result = np.asarray(values(rows), dtype=float).reshape(len(rows), -1)
    except EvaluationError:
        return False
    bent = result[1:1 + len(h)] + result[1 + len(h):] - 2 * result[0]
    alike = np.ptp(bent / h[:, None], axis=0) <= SAME * np.abs(bent / h[:, None]).max(axis=0)
    rounding = np.finfo(float).eps * np.abs(result).max(axis=0)
    return bool((alike & (np.abs(bent) > ABOVE * rounding).all(axis=0)).any())


def staying(module: Module, request: Request, t: np.ndarray, x: np.ndarray, integral: Cost | None = None) -> list[str]:
    """Warnings where an entry of the state stays at a kink of the right-hand side, or of the integral of a loss, from one
    of the rows x (n_t, n_x) at times t to the next."""
    result = []
    for k in range(x.shape[1]):
        rows = np.flatnonzero(x[1:, k] == x[:-1, k])
        if not len(rows):
            continue
        at, time = x[rows[0]], t[rows[0]]
        inputs = lambda states, time=time: request.inputs.rows(np.full(len(states), time), states)
        where = f"{module.name}: {module.metadata.x[k]} stays at {at[k]:.6g}, where"
        if module.metadata.not_smooth and has_kink(
                lambda states: module.evaluate("rhs", time, states, request.p, inputs(states)), at, k):  # noqa: B023
            result.append(f"{where} the equations have a kink: {REMEDY}")
        elif integral is not None and not integral.smooth and has_kink(
                lambda states: integral(np.full(len(states), time), states, inputs(states)).values, at, k):  # noqa: B023
            result.append(f"{where} the integral of the loss has a kink: {REMEDY}")
    return result


def ending(module: Module, request: Request, t: float, x: np.ndarray, end: Cost) -> list[str]:
    """Warnings where the cost of the end has a kink at the end."""
    if end.smooth:
        return []
    values = lambda states: end(np.full(len(states), t), states, request.inputs.rows(np.full(len(states), t), states)).values
    return [f"{module.name}: the motion ends with {name} = {x[k]:.6g}, where the end of the loss has a kink: {REMEDY}"
            for k, name in enumerate(module.metadata.x) if has_kink(values, x, k)]
