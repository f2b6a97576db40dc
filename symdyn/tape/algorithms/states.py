"""Helpers of numeric algorithms for many states at once."""

import math

import numpy as np


def symdyn_stacked(values):
    """Numbers, or arrays of them (states) that broadcast, as one array with the states last."""
    try:
        return np.array(values, dtype=float)
    except ValueError:  # of different shapes
        return np.array(np.broadcast_arrays(*values), dtype=float)


def symdyn_each(function, n_out, values):
    """n_out results of a function of a list of numbers, which branches, state by state, and whether there are none: it gives
    None, or divides by zero and the like."""
    def found(state):
        try:
            return function(state)
        except (ArithmeticError, ValueError):
            return None

    states = symdyn_stacked(values)
    if states.ndim == 1:
        results = found(states.tolist())
        return [math.nan] * n_out if results is None else results, results is None
    flat = [found(state) for state in states.reshape(len(values), -1).T.tolist()]
    failed = np.array([results is None for results in flat]).reshape(states.shape[1:])
    results = np.array([[math.nan] * n_out if results is None else results for results in flat], dtype=float)
    return results.T.reshape(n_out, *states.shape[1:]), failed
