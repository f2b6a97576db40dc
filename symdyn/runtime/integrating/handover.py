"""Runs by Taylor series with stretches by another method where there are no series.

Accelerations under constraints are solved by elimination with pivots that are good at most states. Where one of them is small the
equations are solved by an algorithm that chooses others: there is a right-hand side, but no recurrence for its series. Steps go
across such states, and stop where one would end among them; the smaller the tolerance, the shorter they are. There DEFAULT, which
needs the right-hand side alone, takes some steps.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.right_side import RightSide
from symdyn.runtime.integrating.compiled import run_compiled
from symdyn.runtime.integrating.methods import DEFAULT
from symdyn.runtime.integrating.outcome import Outcome, Request
from symdyn.runtime.integrating.stabilization import Corrections

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Steps of the first stretch by DEFAULT; each that follows with no step by series in between is twice as long.
STRETCH = 4
# Rounding errors stop DEFAULT at smaller tolerances.
LEAST_RTOL = 1e-14


def run_series(module: Module, request: Request, method: str, bar: Any, field: RightSide) -> Outcome:
    """Integrate by series, and by DEFAULT where there are none."""
    parts, reasons, stretch, by_default = [run_compiled(module, request, method, bar, field)], [], STRETCH, 0
    while parts[-1].no_series and _left(request, parts) != 0:
        reasons.append(parts[-1].no_series)
        left = _left(request, parts)
        bridge = _rest(request, parts, stretch if left is None else min(stretch, left))
        parts.append(run_compiled(module, replace(bridge, rtol=max(bridge.rtol, LEAST_RTOL)), DEFAULT, bar, field))
        by_default += parts[-1].n_steps
        if parts[-1].n_steps < stretch or parts[-1].success or parts[-1].interrupted or _left(request, parts) == 0:
            break
        parts.append(run_compiled(module, _rest(request, parts, _left(request, parts)), method, bar, field))
        stretch = STRETCH if parts[-1].n_steps else 2 * stretch
    if not reasons:
        return parts[0]
    note = (f"; where the right-hand side has no Taylor series ({', '.join(dict.fromkeys(reasons))}), {by_default} steps in "
            f"{len(reasons)} stretch{'es' if len(reasons) > 1 else ''} are of {DEFAULT}")
    return _joined(request, parts, note)


def _left(request: Request, parts: list[Outcome]) -> int | None:
    """Steps that may still be taken; None: any number."""
    return None if request.max_steps is None else request.max_steps - sum(part.n_steps for part in parts)


def _rest(request: Request, parts: list[Outcome], max_steps: int | None) -> Request:
    """The rest of the run from where the latest part stopped."""
    t, x = float(parts[-1].t[-1]), np.ascontiguousarray(parts[-1].x[-1])
    times = request.times
    if times is not None:
        times = np.ascontiguousarray(times[(times - t) * np.sign(request.span[1] - request.span[0]) > 0])
    return replace(request, span=(t, request.span[1]), x0=x, times=times, first_step=0.0, max_steps=max_steps)


def _joined(request: Request, parts: list[Outcome], note: str) -> Outcome:
    """One run from its parts. Where parts meet both have a row; that stays where every step, or this time, was requested. The
    last row, where the run stopped, stays always."""
    t, x = np.concatenate([part.t for part in parts]), np.concatenate([part.x for part in parts])
    meets = np.cumsum([len(part.t) for part in parts])[:-1]
    kept = np.ones(len(t), dtype=bool)
    if request.times is None:
        kept[meets] = False  # the first row of each part is the last of that before
    else:
        kept[meets - 1] = np.isin(t[meets - 1], request.times)
    result = [part.corrections for part in parts]
    corrections = Corrections(max(c.position for c in result), max(c.speed for c in result), sum(c.n_steps for c in result),
                              sum(c.n_evaluations for c in result))
    return replace(parts[-1], t=t[kept], x=x[kept], message=parts[-1].message + note,
                   n_steps=sum(part.n_steps for part in parts), n_rejected=sum(part.n_rejected for part in parts),
                   n_evaluations=sum(part.n_evaluations for part in parts),
                   seconds=sum(part.seconds or 0.0 for part in parts), corrections=corrections,
                   happened=[row for part in parts for row in part.happened],
                   doubts=tuple(dict.fromkeys(doubt for part in parts for doubt in part.doubts)))
