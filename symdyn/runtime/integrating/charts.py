"""Euler angles near gimbal lock: runs that came so near that rounding errors of their rates count warn."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symdyn.errors import SimulationWarning
from symdyn.runtime.integrating.outcome import Outcome, Request

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

CHARTS = "charts"
EPS = float(np.finfo(float).eps)
# Intervals between outputs that are looked at again, steps that this may take, what counts as at gimbal lock where a run stops.
INTERVALS, STEPS, AT = 8, 2000, 1e-4
INSTEAD = "take EulerParameters, or another sequence"


def distances(module: Module, x: np.ndarray) -> np.ndarray:
    """Distances of the angles of every chart from gimbal lock, rad, (n, n_charts), of rows of states."""
    names, rows = module.metadata.x, np.atleast_2d(x)
    result = []
    for _, sequence, _, name in module.metadata.charts:
        angle = rows[:, names.index(name)]
        result.append(np.abs(np.cos(angle) if len(set(sequence)) == 3 else np.sin(angle)))
    return np.array(result).reshape(-1, len(rows)).T


def at_lock(module: Module, x: np.ndarray) -> str:
    """Addition to a message where a run stopped: that angles are at gimbal lock, if they are."""
    charts = module.metadata.charts
    return "".join(f"; the {sequence} angles of joint {joint} are within {d:.2g} rad of gimbal lock ({INSTEAD})"
                   for (joint, sequence, *_), d in zip(charts, distances(module, x).ravel(), strict=True) if d < AT)


def _limit(rtol: float, speeds: str) -> float:
    """The distance from gimbal lock below which rounding errors of the angles' rates exceed rtol, see warn_near_lock."""
    return (EPS / rtol) ** (0.5 if speeds == "rates" else 1.0)


def locked(module: Module, t: np.ndarray, x: np.ndarray, rtol: float) -> list[str]:
    """A sentence for every chart whose angles are too near to gimbal lock in some of many motions, at the states that are kept:
    t (n_t,), x (n, n_t, n_x), NaN where there is no state."""
    messages = []
    result = distances(module, x.reshape(-1, x.shape[-1])).reshape(*x.shape[:2], -1)
    for k, (joint, sequence, speeds, _) in enumerate(module.metadata.charts):
        near = np.where(np.isfinite(result[..., k]), result[..., k], np.inf)
        wrong = np.flatnonzero((near < _limit(rtol, speeds)).any(axis=1))
        if len(wrong):
            worst, i = divmod(int(near.argmin()), len(t))
            messages.append(f"{module.name}: in {len(wrong)} of {len(x)} motions, the first of them {wrong[0]}, the {sequence} "
                            f"angles of joint {joint} came too near to gimbal lock, in motion {worst} at t = {t[i]:.9g} within "
                            f"{near.min():.2g} rad: rounding errors of their rates exceed rtol = {rtol:g} there; {INSTEAD}")
    return messages


def warn_near_lock(module: Module, request: Request, t: np.ndarray, x: np.ndarray, run: Callable[[Request], Outcome],
                   level: int = 2) -> None:
    """Give a SimulationWarning for angles that came nearer to gimbal lock than the tolerance allows.

    t (n_t,), x (n_t, n_x)   the motion; run: integrates a request, for what is between two outputs where it may have been near
    At the distance d the mass matrix of the angles' rates has a condition of 1/d^2, the rates themselves one of 1/d; a warning is
    given where a rounding error times that exceeds rtol.
    """
    charts = module.metadata.charts
    if not charts or len(t) < 2 or not np.isfinite(x).all():
        return
    here = distances(module, x)
    for k, (joint, sequence, speeds, name) in enumerate(charts):
        limit = _limit(request.rtol, speeds)
        angle = x[:, module.metadata.x.index(name)]
        # The angle turns back where it comes near, so that two outputs on the same side show nothing; its rate hardly changes.
        before = np.abs(np.gradient(angle, t, edge_order=1))
        most = np.maximum(before[:-1], before[1:])
        wider = np.maximum(most, np.maximum(np.append(most[1:], 0), np.append(0, most[:-1])))
        reach = np.minimum(here[:-1, k], here[1:, k]) - wider * np.abs(np.diff(t))
        least, when = float(here[:, k].min()), float(t[int(here[:, k].argmin())])
        for i in np.argsort(reach)[:INTERVALS]:
            if reach[i] > limit or least < limit:
                continue
            outcome = run(replace(request, span=(float(t[i]), float(t[i + 1])), times=None, x0=x[i].copy(), first_step=0.0,
                                  max_steps=STEPS))
            between = distances(module, outcome.x[:, :x.shape[1]])[:, k] if len(outcome.x) else np.ones(1)
            if between.min() < least:
                least, when = float(between.min()), float(outcome.t[int(between.argmin())])
        if least < limit:
            warnings.warn(
                f"{module.name}: near t = {when:.9g} the {sequence} angles of joint {joint} came within {least:.2g} rad of "
                f"gimbal lock, where rounding errors of their rates exceed rtol = {request.rtol:g}: digits are lost, and steps "
                f"are short; {INSTEAD}", SimulationWarning, stacklevel=level + 1)
