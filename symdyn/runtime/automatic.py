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
# Steps of the trial runs. Eigenvalues times the step of the explicit one beyond which its stability limits it for certain (the
# limit of Dormand-Prince 8(5,3) is 6.4 on the negative, 6.0 on the imaginary axis). How much longer steps of an implicit method
# must be, which costs more a step.
TRIAL_STEPS, LIMITED, LONGER = 100, 5.0, 10.0
# Small tolerances shorten the explicit steps of a stiff motion below that limit: its error has powers of the large eigenvalues
# (products of 0.26 to 0.9 at rtol = 1e-12, of 1.1 to 5.6 at 1e-8; other motions have 0.03 to 5). Smallest product that is tried,
# if the motion is smooth for its eigenvalues (misses a cubic over the second half of the trial by less than this part of its
# range) and so many steps are to come that compiling the Jacobian pays.
WORTH, SMOOTH, MANY = 0.1, 0.01, 1000

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
    """"stiff" if an implicit method takes far longer steps than an explicit one, "limited" if it does not and stability limits
    those, else nothing; and what was found, in words."""
    asked = replace(request, times=None, max_steps=TRIAL_STEPS)
    found = trial(asked, explicit)
    steps = np.abs(np.diff(found.t))
    if found.success:
        return "", f"the motion is not stiff ({found.n_steps} steps of a trial run reach the end)"
    if len(steps) < TRIAL_STEPS:
        return "", "a trial run stopped early"
    n, end = request.n_state, float(found.t[-1])
    length = float(np.median(steps[-20:]))
    radius = spectral_radius(module, request, end, found.x[-1][:n])
    if not np.isfinite(radius):
        return "", f"the eigenvalues cannot be evaluated at the end of a trial run, t = {end:.3g} s"
    product = radius * length
    limited = f"eigenvalues up to {radius:.3g} 1/s times the step of a trial run, {length:.3g} s, are {product:.2g}"
    to_come = abs(request.span[1] - end) / length
    if product <= LIMITED and (doubt := _doubt(found, request, product, to_come)):
        return "", f"{doubt} ({limited})"
    # From where the explicit trial ended: what dies away quickly at the start takes an implicit method many short steps, too.
    later = replace(asked, span=(end, request.span[1]), x0=found.x[-1][:n].copy(), first_step=0.0)
    longer = np.abs(np.diff(trial(later, stiff).t))
    ratio = float(np.max(longer[-5:], initial=0.0)) / length
    if ratio >= LONGER:
        return "stiff", f"the motion is stiff ({limited}): implicit steps are {ratio:.2g} times as long"
    if product > LIMITED:
        return "limited", f"stability limits explicit steps ({limited}), but implicit ones are only {ratio:.2g} times as long"
    return "", f"the motion is not stiff near t = {end:.3g} s ({limited}; implicit steps are only {ratio:.2g} times as long)"


def _doubt(found: Outcome, request: Request, product: float, to_come: float) -> str:
    """Why no implicit method is tried where stability need not limit the explicit one; empty: it is worth a trial."""
    if product < WORTH:
        return "accuracy limits explicit steps"
    half, n = TRIAL_STEPS // 2, request.n_state
    if not _smooth(found.t[-half:], found.x[-half:, :n], request.rtol, request.atol[:n]):
        return f"the motion is not stiff up to t = {found.t[-1]:.3g} s: it is not smooth over {half} explicit steps"
    return f"some {to_come:.0f} explicit steps to come are too few for stiffness to matter" if to_come < MANY else ""


def _smooth(t: np.ndarray, x: np.ndarray, rtol: float, atol: np.ndarray) -> bool:
    """Whether x(t), (n_t, n), is a cubic within SMOOTH of its range or ten times the tolerances."""
    powers = np.vander((t - t[0]) / (t[-1] - t[0]), 4)
    missed = np.abs(x - powers @ np.linalg.lstsq(powers, x, rcond=None)[0]).max(axis=0)
    return bool((missed <= np.maximum(SMOOTH * np.ptp(x, axis=0), 10 * (atol + rtol * np.abs(x).max(axis=0)))).all())


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
