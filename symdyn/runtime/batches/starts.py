"""Starts of many motions of a mechanism whose states are projected: each is checked as that of one motion is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symdyn.errors import SymdynError
from symdyn.runtime.consistent import CONSISTENT, check_start, normalised
from symdyn.runtime.constraints import length, names, position_residual, velocity_residual
from symdyn.runtime.contact_numbers import impossible

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


def projects(module: Module) -> bool:
    """Whether states are projected after every step: onto constraints, or Euler parameters onto length 1."""
    return bool(names(module) or module.metadata.unit_groups)


def consistent_starts(module: Module, t: float, starts: np.ndarray, params: np.ndarray, inputs: np.ndarray,
                      n: int) -> tuple[np.ndarray, np.ndarray, dict[int, str]]:
    """Starts with unit vectors of length 1, lengths that residuals are measured by, and of motions that cannot begin why.

    t        of the starts, s
    starts   (n, n_x), or (1, n_x) where nothing varies; returned as NaN where a motion cannot begin
    params   (n, n_p) or (1, n_p); inputs: at the start, (n, n_in) or (1, n_in)
    n        motions
    The lengths, m, are (n, 1) or (1, 1).
    """
    astray = impossible(module, t, starts, params, inputs)
    if not projects(module) and not astray:
        return starts, np.ones((1, 1)), {}
    lengths = np.ones((len(params), 1))
    starts = np.array(np.broadcast_to(starts, (max(len(starts), len(params)), starts.shape[1])))
    if len(params) == 1 and astray:
        astray = dict.fromkeys(range(len(starts)), astray[0])
    for k in range(len(starts)) if module.metadata.unit_groups else ():
        try:
            starts[k] = normalised(module, starts[k])
        except SymdynError as error:
            astray[k] = str(error)
    if names(module):
        one = len(params) == 1
        for k, p in enumerate(params):
            rows = np.arange(len(starts)) if one else np.array([k])
            try:
                lengths[k] = length(module, p)
                doubtful = rows[_inconsistent(module, t, starts[rows], p, float(lengths[k, 0]))]
            except SymdynError:  # one by one it is found out which of them cannot be evaluated, and why
                doubtful = rows
            astray |= {row: why for row in doubtful.tolist() if row not in astray and (why := _why(module, t, starts[row], p))}
    starts[list(astray)] = np.nan
    if len(starts) == 1 and astray:
        astray = dict.fromkeys(range(n), astray[0])
    return starts, lengths, astray


def _inconsistent(module: Module, t: float, x: np.ndarray, params: np.ndarray, own: float) -> np.ndarray:
    """Mask of the states (n, n_x) that do not fulfil the constraints, as check_start judges one; own: the mechanism's length,
    m."""
    residuals = (position_residual(module, t, x, params), velocity_residual(module, t, x, params, 1e-9 * own, each=True))
    return (np.abs(np.hstack(residuals)) > CONSISTENT).any(axis=1)


def _why(module: Module, t: float, x: np.ndarray, params: np.ndarray) -> str:
    """Why a motion cannot begin at a state; "" if it can."""
    try:
        check_start(module, t, x, params)
    except SymdynError as error:
        return str(error)
    return ""
