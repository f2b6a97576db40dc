"""Validity checks of many motions: in how many of them values leave the ranges in which loads are valid, and how far at worst."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

import numpy as np

from symdyn.errors import EvaluationError
from symdyn.runtime.solutions.validity import VALIDITY_CHECKS, ValidityCheck

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


def outside(module: Module, t: np.ndarray, x: np.ndarray, params: np.ndarray, inputs: np.ndarray) -> list[str]:
    """A sentence for every value that is outside its range of validity in some of the motions, at the states that are kept.

    t, x             (n_t,), (n, n_t, n_x), NaN where there is no state
    params, inputs   (n, n_p), (n, n_in), or one row for all; or inputs at every time, (n, n_t, n_in)
    """
    about = module.metadata.validity_checks
    if not about or not len(x):
        return []
    values = np.full((*x.shape[:2], len(about)), np.nan)
    # States with the same parameters are evaluated together.
    groups = [slice(None)] if len(params) == 1 else [slice(k, k + 1) for k in range(len(x))]
    for p, group in zip(params, groups, strict=True):
        states, times = x[group].reshape(-1, x.shape[2]), np.tile(t, len(x[group]))
        there = np.flatnonzero(np.isfinite(states).all(axis=1))
        if inputs.ndim == 3:
            given = inputs[group].reshape(-1, inputs.shape[2])[there]
        else:
            given = np.repeat(np.broadcast_to(inputs, (len(x), inputs.shape[1]))[group], len(t), axis=0)[there]
        result = np.full((len(states), len(about)), np.nan)
        result[there] = _rows(module, times[there], states[there], p, given)
        values[group] = result.reshape(*x[group].shape[:2], -1)
    messages = []
    for (label, least, most, message, summed), column in zip(about, np.moveaxis(values, -1, 0), strict=True):
        if summed:
            column = np.array([[np.trapezoid(row[there], t[there])] for row in column for there in [np.isfinite(row)]])
        low, high = np.fmin.reduce(column, axis=1), np.fmax.reduce(column, axis=1)
        wrong = np.flatnonzero((low < least) | (high > most))
        if len(wrong):
            worst = ValidityCheck(label, least, most, float(low[wrong].min()), float(high[wrong].max()), message)
            messages.append(f"{module.name}: in {len(wrong)} of {len(x)} motions, the first of them {wrong[0]}, at worst: "
                            f"{worst.message}")
    return messages


def _rows(module: Module, t: np.ndarray, x: np.ndarray, params: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """The function `validity_checks`, (n, n_w); NaN where it cannot be evaluated."""
    result = np.full((len(x), len(module.metadata.validity_checks)), np.nan)
    try:
        if len(x):
            result[:] = module.evaluate(VALIDITY_CHECKS, t, x, params, inputs).reshape(result.shape)
    except EvaluationError:
        for k in range(len(x)):
            with contextlib.suppress(EvaluationError):
                result[k] = module.evaluate(VALIDITY_CHECKS, t[k], x[k], params, inputs[k]).ravel()
    return result
