"""Sizes of states, inputs, parameters and the duration of a problem, in their units, to which small values are relative."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from symdyn.optimal.field import Arguments, Dynamics
    from symdyn.optimal.problem import Problem

# Sizes that are found are at least this part of those before: a state that stays zero has one, too.
LEAST = 1e-3
# Bounds of inputs that are wider than so many times what is needed say nothing of their sizes.
WIDE = 100.0


@dataclass(frozen=True, eq=False)
class Sizes:
    """Sizes of states (n_x,), inputs (n_in,), free parameters (k,) and the duration, s, all positive."""

    x: np.ndarray
    inputs: np.ndarray
    params: np.ndarray
    duration: float

    def grown(self, before: Sizes, factor: float) -> bool:
        """Whether one of them is more than so many times that of others."""
        pairs = ((self.x, before.x), (self.inputs, before.inputs), (self.params, before.params))
        return any(bool((now > factor * old).any()) for now, old in pairs) or self.duration > factor * before.duration


def given_sizes(problem: Problem, dynamics: Dynamics, t: np.ndarray, at: np.ndarray) -> Sizes:
    """Sizes by what is given, at times (N,) and arguments (N, n) of the guess.

    A state has the largest value of start, end and guess; without one that of its bounds; a coordinate else what the equations
    move it by in the duration, or the size of other coordinates. A speed is at least what its coordinates need in the duration,
    an input its bounds, or at least what accelerations like that need. A variable without a size by all this has 1.
    """
    of, sizes = problem.of, problem.module.metadata.sizes
    T = float(at[0, of.duration])
    some = np.unique(np.linspace(0, len(at) - 1, min(len(at), 9)).astype(int))
    largest = lambda values: np.nan_to_num(np.abs(values), nan=0.0, posinf=0.0, neginf=0.0).max(axis=0, initial=0.0)
    rates = largest(dynamics.values(t, at))
    slopes = largest(dynamics.jacobian(t[some], at[some]))
    x = _first(largest(np.vstack([at[:, of.x], problem.start, problem.end])), largest(problem.states))
    q, u = slice(0, sizes.q), slice(sizes.q, sizes.q + sizes.u)
    x[q] = _first(x[q], T * rates[q], T * slopes[q, u] @ _first(x[u], T * rates[u]))
    x[q] = _first(x[q], np.full(sizes.q, x[q].max(initial=0.0)), np.ones(sizes.q))
    for group in problem.module.metadata.unit_groups:
        x[[problem.module.metadata.q.index(name) for name in group]] = 1.0
    x[u] = _first(np.maximum(x[u], _needed(slopes[q, u], x[q] / T)), T * rates[u], np.ones(sizes.u))
    x = _first(x, T * rates, np.ones(of.n_x))
    bounds = largest(problem.inputs)
    needed = _needed(slopes[:, of.inputs], np.maximum(x / T, rates))
    needed = np.where((bounds > 0) & ((needed == 0) | (bounds <= WIDE * needed)), bounds, needed)
    inputs = _first(np.maximum(largest(at[:, of.inputs]), needed), np.ones(of.n_in))
    params = _first(largest(at[:, of.params]), largest(problem.params), np.ones(len(of.free)))
    return Sizes(x, inputs, params, T)


def found_sizes(of: Arguments, at: np.ndarray, before: Sizes) -> Sizes:
    """By a motion: the largest values, at arguments (N, n) along it; before: sizes up to now."""
    largest = np.abs(at).max(axis=0)
    floored = lambda now, old: np.maximum(np.nan_to_num(now, nan=0.0), LEAST * old)
    return Sizes(floored(largest[of.x], before.x), floored(largest[of.inputs], before.inputs),
                 floored(largest[of.params], before.params),
                 float(at[0, of.duration]))


def _first(*sizes: np.ndarray) -> np.ndarray:
    """The first of some sizes that is not zero, entry by entry."""
    result = sizes[0].copy()
    for other in sizes[1:]:
        result = np.where(result > 0, result, other)
    return result


def _needed(slopes: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Changes of variables that change rates (m,) by their sizes, by derivatives (m, n): (n,), 0 for a variable that changes
    none."""
    size = np.linalg.norm(slopes / rates[:, None], axis=0)
    return np.divide(1.0, size, out=np.zeros_like(size), where=size > 0)
