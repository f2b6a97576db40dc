"""Sensitivities of motions that are integrated together: their columns behind the states, and motions that need a closer look."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import EvaluationWarning, SymdynError
from symdyn.runtime.batches.states import rhs_batch
from symdyn.runtime.constraints import rank
from symdyn.runtime.inputs.inputs import Inputs
from symdyn.runtime.integrating.sensitivities import Asked, sizes_of, tolerances
from symdyn.runtime.integrating.without_effect import ROUNDING, groups_of, sizes
from symdyn.runtime.memory import aligned

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Factor of rounding above which a change is certainly no rounding: the states here are those of a single motion to rounding only.
SURE = 10.0


@dataclass(frozen=True)
class Columns:
    """Sensitivities of many motions, by the same in all of them.

    asked        what they are by, and where they start
    sizes        of what they are by, (n, n_columns), or (1, n_columns) where none varies
    controlled   whether their errors are, too
    """

    asked: Asked
    sizes: np.ndarray
    controlled: bool

    @classmethod
    def of(cls, module: Module, given: Any, params: np.ndarray, inputs: np.ndarray, along: Inputs | None,
           controlled: bool) -> Columns:
        """Requested columns; parameters (n, n_p), constant inputs (n, n_in), or one row of each; along: inputs over time.

        Raises ArgumentError with all that does not fit.
        """
        asked = Asked.of(module, given, params[0], along or Inputs(inputs[0]))
        n = max(len(params), len(inputs))
        values = [np.broadcast_to(rows, (n, rows.shape[1])) for rows in (inputs, params)]
        return cls(asked, sizes_of(module, asked.columns, np.hstack(values)), controlled)

    @property
    def n(self) -> int:
        return len(self.asked.names)

    def behind(self, states: np.ndarray) -> np.ndarray:
        """States (n, n_x) with the columns' starts behind them."""
        return np.hstack([states, np.broadcast_to(self.asked.starts.ravel(), (len(states), self.asked.starts.size))])

    def apart(self, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Copies of states (n, n_t, n_x), and of their derivatives (n, n_t, n_x, n_columns), from states with columns."""
        n, n_t, n_x = *states.shape[:2], states.shape[2] // (1 + self.n)
        x, matrix = aligned((n, n_t, n_x), 0.0), aligned((n, n_t, n_x, self.n), 0.0)
        x[:], matrix[:] = states[..., :n_x], np.swapaxes(_behind(self, states), 2, 3)
        return x, matrix

    def tolerances(self, rtol: float, atol: np.ndarray) -> tuple[float, np.ndarray]:
        """Relative, and absolute ones of every motion, (n, n_x (1 + n_columns)), or (1, ...)."""
        return tolerances(rtol, atol, self.sizes, self.controlled)

    @property
    def given(self) -> dict[str, np.ndarray]:
        """As a run of one motion is asked for them."""
        return dict(zip(self.asked.names, self.asked.starts, strict=True))


def held(module: Module, t: float, starts: np.ndarray, params: np.ndarray, columns: Columns) -> np.ndarray:
    """Mask of the motions that may not have these sensitivities, as constraints depend on each other at the start, (n,) of bool;
    starts (n, n_x), parameters (n, n_p), or one row of either."""
    changed = [name for name in columns.asked.columns if name in module.metadata.parameters]
    n_c, n = len(module.metadata.constraints), max(len(starts), len(params))
    if not n_c or not changed:
        return np.zeros(n, dtype=bool)
    there = np.flatnonzero(np.broadcast_to(np.isfinite(starts).all(axis=1), n))
    states, p = (rows[there] if len(rows) > 1 else rows for rows in (np.broadcast_to(starts, (n, starts.shape[1])), params))
    result = np.zeros(n, dtype=bool)
    try:
        ranks = rank(module, t, states, p[0]) if len(p) == 1 else [
            int(rank(module, t, state, own)) for state, own in zip(states, p, strict=True)]
        result[there] = np.asarray(ranks) < n_c
    except SymdynError:  # one by one it is found out which of them cannot be evaluated
        result[there] = True
    return result


def without_effect(columns: Columns, rows: np.ndarray) -> np.ndarray:
    """Columns in which everything is zero, (n, n_columns) of bool; rows as for `doubtful`."""
    behind = _behind(columns, rows)
    return ~((behind != 0) & ~np.isnan(behind)).any(axis=(1, 3))


def doubtful(module: Module, columns: Columns, rows: np.ndarray, ends: tuple[np.ndarray, np.ndarray, np.ndarray],
             params: np.ndarray) -> np.ndarray:
    """Mask of the motions that a run of its own may warn of, (n,) of bool: a parameter may cancel, or a state stay at a kink.

    rows     of every motion one after the other, (n, n_t, n_x (1 + n_columns)), not a number where there is none
    ends     times, states and inputs where each begins and ends, (n, 2), (n, 2, n_x), (n, 2, n_in)
    """
    n, n_x = len(rows), module.metadata.sizes.x
    result = np.zeros(n, dtype=bool)
    if module.metadata.not_smooth:
        result |= (rows[:, 1:, :n_x] == rows[:, :-1, :n_x]).any(axis=(1, 2))
    t, x, inputs = (np.ascontiguousarray(a).reshape(2 * n, -1) for a in ends)
    p = np.repeat(np.broadcast_to(params, (n, params.shape[1])), 2, axis=0)
    nothing = without_effect(columns, rows)
    for k, name in enumerate(columns.asked.columns):
        which = np.flatnonzero(~nothing[:, k])
        if name and len(which):
            pairs = np.add.outer(2 * which, [0, 1]).ravel()
            result[which] |= ~_affected(module, name, t[pairs, 0], x[pairs], p[pairs], inputs[pairs])
    return result


def _behind(columns: Columns, rows: np.ndarray) -> np.ndarray:
    return rows[..., rows.shape[-1] // (1 + columns.n):].reshape(*rows.shape[:2], columns.n, -1)


def _affected(module: Module, name: str, t: np.ndarray, x: np.ndarray, params: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """Mask of the pairs of rows where the right-hand side certainly changes with a parameter or an input."""
    metadata = module.metadata

    def rates(p: np.ndarray, given: np.ndarray) -> np.ndarray:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", EvaluationWarning)
            return np.asarray(rhs_batch(module, t, x, p, given))

    here = rates(params, inputs)
    pairs = (-1, 2, x.shape[1])
    size = SURE * ROUNDING * sizes(here.reshape(pairs), groups_of(module))[:, None]
    result = np.zeros(len(size), dtype=bool)
    for change in (lambda value: 1.5 * value, lambda value: value + 1.0):
        p, given = params.copy(), inputs.copy()
        rows, names = (p, metadata.parameters) if name in metadata.parameters else (given, metadata.inputs)
        rows[:, names.index(name)] = change(rows[:, names.index(name)])
        result |= ~(np.abs(rates(p, given) - here).reshape(pairs) <= size).all(axis=(1, 2))
    return result
