"""method="auto": which method a motion takes, by tolerance, stiffness and constraints, and why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError, SymdynError
from symdyn.runtime.methods import COMPILED, DEFAULT, check_compiled
from symdyn.runtime.outcome import Outcome, Request

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Methods of the C backend for loose and for the smallest errors and for stiff motions; in between DEFAULT is quickest. At much
# the same error the loose one takes 0.62, 0.73, 0.78, 0.89, 1.04 times the evaluations of DEFAULT for rtol = 1e-2, 1e-3, ...
# 1e-6 (medians of seven mechanisms); but of linear vibrations, with tiny right-hand sides, 1.7, 3, 4 times from 1e-4 on. Series
# take half the time for short right-hand sides (36 operations of the double pendulum, rtol = 1e-10) and errors ten to a thousand
# times smaller; for long ones (633 of the PUMA) twice the time, but they go on where DEFAULT meets
# its rounding errors.
LOOSE, FINEST, STIFF = "bs54", "taylor", "radau"
LOOSE_RTOL, SHORT_RTOL, SHORT, FINEST_RTOL = 3e-5, 1e-7, 100, 1e-14
LOOSE_TINY_RTOL, TINY = 3e-4, 20
# Steps of the trial runs. Eigenvalues times the step of the explicit one beyond which its stability limits it for certain (the
# limit of Dormand-Prince 8(5,3) is 6.4 on the negative, 6.0 on the imaginary axis). How much longer steps of an implicit method
# must be, which costs more a step.
TRIAL_STEPS, LIMITED, LONGER = 100, 5.0, 10.0
# Small tolerances shorten the explicit steps of a stiff motion below that limit: its error has powers of the large eigenvalues
# (products of 0.26 to 0.9 at rtol = 1e-12, of 1.1 to 5.6 at 1e-8; other motions have 0.03 to 5). Smallest product that is tried,
# if the motion is smooth for its eigenvalues (misses a cubic over the second half of the trial by less than this part of its
# range) and so many steps are to come that compiling the Jacobian pays.
WORTH, SMOOTH, MANY = 0.1, 0.01, 1000
# What is not smooth may ring and die out. Eigenvalues of this part of the largest ring; implicit steps that follow the ringing
# cost so many times what explicit ones do (1.7 for rtol = 1e-4, 2.9 for 1e-8, of a mass on a spring). Steps in which an implicit
# trial run reaches its lengths: it begins with a short one, and each may be six times as long as the one before. The relative
# tolerance of one that is to go across the ringing.
FAST, IMPLICIT, STIFF_STEPS, LARGEST = 0.1, 3.0, 30, 0.1

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
    operations = module.metadata.get("operations", {}).get("rhs", SHORT)
    loose = request.rtol >= (LOOSE_TINY_RTOL if operations < TINY else LOOSE_RTOL)
    if loose and verdict != "limited" and _fits(module, request, LOOSE):
        return LOOSE, f"{why} the pair of order 5 needs the fewest evaluations"
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
    x = found.x[-1][:n]
    modes = Modes.at(module, request, end, x)
    if modes is None:
        return "", f"the eigenvalues cannot be evaluated at the end of a trial run, t = {end:.3g} s"
    product = modes.radius * length
    limited = f"eigenvalues up to {modes.radius:.3g} 1/s times the step of a trial run, {length:.3g} s, are {product:.2g}"
    to_come = abs(request.span[1] - end)
    later = replace(asked, span=(end, request.span[1]), x0=x.copy(), first_step=0.0, max_steps=STIFF_STEPS)
    try:
        if product <= LIMITED and (doubt := _doubt(found, request, product, to_come / length)):
            ringing = modes.ringing(request.atol[:n] + request.rtol * np.abs(x))
            if ringing is None or not _outlasted(ringing.time, length, to_come, modes.radius):
                return "", f"{doubt} ({limited})"
            # What rings now dies out early, and stability limits explicit steps from then on. Implicit steps that tolerate
            # it damp it at once; from there the true ones are tried.
            most = min(to_come / STIFF_STEPS, request.max_step or np.inf)
            calm = trial(replace(later, atol=ringing.amplitudes, rtol=LARGEST, max_step=most), stiff)
            later = replace(later, span=(float(calm.t[-1]), request.span[1]), x0=calm.x[-1][:n].copy())
            length = LIMITED / modes.radius
            limited = (f"eigenvalues up to {modes.radius:.3g} 1/s ring for {ringing.time:.2g} s only, then stability limits "
                       f"explicit steps to {length:.2g} s")
        # From where the explicit trial ended: what dies away at the start takes an implicit method many short steps, too.
        longer = np.abs(np.diff(trial(later, stiff).t))
    except SymdynError as error:
        return "", f"no implicit step can be tried: {error}"
    ratio = float(np.max(longer[-5:], initial=0.0)) / length
    if ratio >= LONGER:
        return "stiff", f"the motion is stiff ({limited}): implicit steps are {ratio:.2g} times as long"
    if product > LIMITED:
        return "limited", f"stability limits explicit steps ({limited}), but implicit ones are only {ratio:.2g} times as long"
    return "", f"the motion is not stiff near t = {end:.3g} s ({limited}; implicit steps are only {ratio:.2g} times as long)"


def _outlasted(ringing: float, length: float, to_come: float, radius: float) -> bool:
    """Whether an implicit method wins more after what rings has died out than it loses before, while it is IMPLICIT times as
    expensive as explicit steps of this length."""
    after = (to_come - ringing) * radius / LIMITED
    return after >= max(MANY, (IMPLICIT - 1) * ringing / length)


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


class Ringing(NamedTuple):
    """What of a state vibrates quickly and dies out: how far, (n,), and the time until it is tolerated, s."""

    amplitudes: np.ndarray
    time: float


@dataclass(frozen=True)
class Modes:
    """Linear motion near a state: eigenvalues (n,), 1/s, and vectors (n, n) of d x_dot / d x; x_dot (n,)."""

    values: np.ndarray
    vectors: np.ndarray
    xd: np.ndarray

    @classmethod
    def at(cls, module: Module, request: Request, t: float, x: np.ndarray) -> Modes | None:
        """By differences of the right-hand side: the exact Jacobian would have to be compiled for this look. None where it
        cannot be evaluated."""
        n = len(x)
        change = np.diag(1e-6 * np.maximum(1.0, np.abs(x)))
        rows = np.concatenate([x + change, x - change, x[None, :]])
        inputs = request.inputs.rows(np.full(2 * n + 1, t), rows) if len(request.inputs.constant) else ()
        try:
            xd = module.evaluate("rhs", np.full(2 * n + 1, t), rows, request.p, inputs)
        except EvaluationError:
            return None
        values, vectors = np.linalg.eig((xd[:n] - xd[n:2 * n]).T / (2 * np.diag(change)))
        return cls(values, vectors, xd[2 * n])

    @property
    def radius(self) -> float:
        """Largest size of the eigenvalues that do not grow, 1/s."""
        return float(np.abs(self.values[self.values.real <= 1e-6 * np.abs(self.values)]).max(initial=0.0))

    def ringing(self, tolerated: np.ndarray) -> Ringing | None:
        """What the modes near the largest eigenvalue add to the state, and how long it lasts; None if it stays or cannot be
        told."""
        fast = np.abs(self.values) >= FAST * self.radius
        decay = -self.values[fast].real
        if not (fast.any() and (decay > 0).all()):
            return None
        try:
            shares = np.linalg.solve(self.vectors, self.xd)[fast] / self.values[fast]
        except np.linalg.LinAlgError:
            return None
        amplitudes = np.abs(self.vectors[:, fast]) @ np.abs(shares) + tolerated
        if not np.isfinite(amplitudes).all():
            return None
        return Ringing(amplitudes, float(np.log((amplitudes / tolerated).max()) / decay.min()))
