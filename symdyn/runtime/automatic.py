"""method="auto": which method a motion takes, by tolerance, stiffness and constraints, and why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError
from symdyn.runtime.methods import COMPILED, DEFAULT, check_compiled
from symdyn.runtime.outcome import Outcome, Request

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Methods of the C backend for loose and for the smallest errors and for stiff motions; in between DEFAULT is quickest. At much
# the same error the loose one takes 0.62, 0.73, 0.78, 0.89, 1.04 times the evaluations of DEFAULT for rtol = 1e-2, 1e-3, ...
# 1e-6 (medians of seven mechanisms). Series take half the time for short right-hand sides (36 operations of the double pendulum,
# rtol = 1e-10) and errors ten to a thousand times smaller; for long ones (633 of the PUMA) twice the time, but they go on where
# DEFAULT meets its rounding errors.
LOOSE, FINEST, STIFF = "bs54", "taylor", "radau"
LOOSE_RTOL, SHORT_RTOL, SHORT, FINEST_RTOL = 1e-5, 1e-7, 100, 1e-14
# Steps of the trial runs. Eigenvalues times the step of the explicit one beyond which its stability limits it, not its accuracy
# (the limit of Dormand-Prince 8(5,3) is 6.4 on the negative, 6.0 on the imaginary axis; other motions have about 1). How much
# longer steps of an implicit method must be, which costs more a step.
TRIAL_STEPS, LIMITED, LONGER = 100, 5.0, 10.0

Trial = Callable[[Request, str], Outcome]


def automatic(module: Module, request: Request, trial: Trial) -> tuple[str, str]:
    """The method and, in one sentence, why.

    trial   runs a request by a method
    """
    explicit, stiff = (DEFAULT, STIFF) if module.backend == "c" else ("DOP853", "Radau")
    if module.backend == "c" and not _fits(module, request, stiff):
        stiff = "Radau"
    verdict, found = _stiffness(module, request, trial, explicit, stiff)
    if verdict == "stiff":
        return stiff, found
    why = f"{found}; for rtol = {request.rtol:.3g}{' and constraints' if module.metadata['constraints'] else ''}"
    if module.backend != "c":
        return explicit, f"{why} the explicit method of order 8 is quickest of those without compiled code"
    if request.rtol >= LOOSE_RTOL and verdict != "limited" and _fits(module, request, LOOSE):
        return LOOSE, f"{why} the pair of order 5 needs the fewest evaluations"
    operations = module.metadata.get("operations", {}).get("rhs", SHORT)
    if request.rtol <= (SHORT_RTOL if operations < SHORT else FINEST_RTOL) and _fits(module, request, FINEST):
        return FINEST, f"{why}, and with {operations} operations in the right-hand side, series of high order are most exact"
    return explicit, f"{why} the explicit method of order 8 is quickest"


def _fits(module: Module, request: Request, method: str) -> bool:
    if method not in COMPILED:
        return False
    try:
        check_compiled(module, request, method)
    except ArgumentError:
        return False
    return True


def _stiffness(module: Module, request: Request, trial: Trial, explicit: str, stiff: str) -> tuple[str, str]:
    """"stiff" if stability limits the steps of an explicit method and an implicit one takes far longer ones, "limited" if it does
    not take them, else nothing; and what was found, in words."""
    asked = replace(request, times=None, max_steps=TRIAL_STEPS)
    found = trial(asked, explicit)
    steps = np.abs(np.diff(found.t))
    if found.success:
        return "", f"the motion is not stiff ({found.n_steps} steps of a trial run reach the end)"
    if len(steps) < TRIAL_STEPS:
        return "", "a trial run stopped early"
    length = float(np.median(steps[-20:]))
    radius = spectral_radius(module, request, float(found.t[-1]), found.x[-1][:request.n_state])
    limited = f"eigenvalues up to {radius:.3g} 1/s times the step of a trial run, {length:.3g} s, are {radius * length:.2g}"
    if not radius * length > LIMITED:
        return "", f"the motion is not stiff ({limited})"
    # From where the explicit trial ended: what dies away quickly at the start takes an implicit method many short steps, too.
    later = replace(asked, span=(float(found.t[-1]), request.span[1]), x0=found.x[-1][:request.n_state].copy(), first_step=0.0)
    longer = np.abs(np.diff(trial(later, stiff).t))
    ratio = float(np.max(longer[-5:], initial=0.0)) / length
    if ratio < LONGER:
        return "limited", f"stability limits explicit steps ({limited}), but implicit ones are only {ratio:.2g} times as long"
    return "stiff", f"the motion is stiff ({limited}): implicit steps are {ratio:.2g} times as long"


def spectral_radius(module: Module, request: Request, t: float, x: np.ndarray) -> float:
    """Largest size of the eigenvalues of d x_dot / d x that do not grow, 1/s, from differences of the right-hand side: the exact
    Jacobian would have to be compiled for this look. NaN where it cannot be evaluated."""
    n = len(x)
    change = np.diag(1e-6 * np.maximum(1.0, np.abs(x)))
    rows = np.concatenate([x + change, x - change])
    inputs = request.inputs.rows(np.full(2 * n, t), rows) if len(request.inputs.constant) else ()
    try:
        xd = module.evaluate("rhs", np.full(2 * n, t), rows, request.p, inputs)
    except EvaluationError:
        return float("nan")
    eigenvalues = np.linalg.eigvals((xd[:n] - xd[n:]).T / (2 * np.diag(change)))
    return float(np.abs(eigenvalues[eigenvalues.real <= 1e-6 * np.abs(eigenvalues)]).max(initial=0.0))
