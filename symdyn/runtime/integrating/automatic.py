"""method="auto": which method a motion takes, by tolerance, stiffness and constraints, and why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError, SymdynError
from symdyn.runtime.integrating.methods import COMPILED, DEFAULT, check_compiled
from symdyn.runtime.integrating.outcome import Outcome, Request

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
# limit of Dormand-Prince 8(5,3) is 6.4 on the negative, 6.0 on the imaginary axis). Factor by which steps of an implicit method
# must be longer, which costs more a step.
TRIAL_STEPS, LIMITED, LONGER = 100, 5.0, 10.0
# Small tolerances shorten the explicit steps of a stiff motion below that limit: its error has powers of the large eigenvalues
# (products of 0.26 to 0.9 at rtol = 1e-12, of 1.1 to 5.6 at 1e-8; other motions have 0.03 to 5). Smallest product that is tried,
# if the motion is smooth for its eigenvalues (misses a cubic over the second half of the trial by less than this part of its
# range) and so many steps are to come that compiling the Jacobian pays.
WORTH, SMOOTH, MANY = 0.1, 0.01, 1000
# Rough motion may ring and die out. Eigenvalues of this part of the largest ring; implicit steps that follow the ringing
# cost so many times what explicit ones do (1.7 for rtol = 1e-4, 2.9 for 1e-8, of a mass on a spring). Steps in which an implicit
# trial run reaches its lengths: it begins with a short one, and each may be six times as long as the one before. The relative
# tolerance of one that is to go across the ringing.
FAST, IMPLICIT, STIFF_STEPS, LARGEST = 0.1, 3.0, 30, 0.1

Trial = Callable[[Request, str], Outcome]


def automatic(module: Module, request: Request, trial: Trial) -> tuple[str, str]:
    """The method and, in one sentence, why: what was found of stiffness, by which number against which bound; what follows.

    trial   runs a request by a method
    """
    explicit, stiff = (DEFAULT, STIFF) if module.backend == "c" else ("DOP853", "Radau")
    if module.backend == "c" and not _fits(module, request, stiff):
        stiff = "Radau"
    verdict, result = _stiffness(module, request, trial, explicit, stiff)
    if verdict == "stiff":
        return stiff, result
    method, choice = _by_tolerance(module, request, verdict, explicit)
    return method, f"{result}; {choice}"


def _by_tolerance(module: Module, request: Request, verdict: str, explicit: str) -> tuple[str, str]:
    """The method for a motion that needs no implicit one, and why."""
    if module.backend != "c":
        return explicit, "of the explicit methods that need no compiled code the one of order 8 is quickest"
    operations = module.metadata.operations.get("rhs", SHORT)
    loose = LOOSE_TINY_RTOL if operations < TINY else LOOSE_RTOL
    finest = SHORT_RTOL if operations < SHORT else FINEST_RTOL

    def asked(bound: str) -> str:
        return f"for rtol = {request.rtol:.3g} ({bound}, with {operations} operations in the right-hand side)"

    if request.rtol >= loose and verdict == "limited":
        return explicit, (f"{asked(f'{loose:.3g} or more')} the explicit method of order 8 is quickest, as stability limits the "
                          "pair of order 5 to shorter steps")
    if request.rtol >= loose and _fits(module, request, LOOSE):
        return LOOSE, f"{asked(f'{loose:.3g} or more')} the explicit pair of order 5 needs the fewest evaluations"
    if request.rtol > finest:
        return explicit, f"{asked(f'between {finest:.3g} and {loose:.3g}')} the explicit method of order 8 is quickest"
    if _fits(module, request, FINEST):
        return FINEST, f"{asked(f'{finest:.3g} or less')} Taylor series are most exact"
    return explicit, (f"{asked(f'{finest:.3g} or less')} Taylor series would be most exact, but do not fit (method='{FINEST}' "
                      "says why); the explicit method of order 8 is quickest")


def _fits(module: Module, request: Request, method: str) -> bool:
    if method not in COMPILED:
        return False
    try:
        check_compiled(module, request.inputs, method)
    except ArgumentError:
        return False
    return True


def _stiffness(module: Module, request: Request, trial: Trial, explicit: str, stiff: str) -> tuple[str, str]:
    """"stiff" if an implicit method takes far longer steps than an explicit one, "limited" if it does not and stability limits
    those, else nothing; and what was found, in words."""
    asked = replace(request, times=None, max_steps=TRIAL_STEPS)
    result = trial(asked, explicit)
    steps = np.abs(np.diff(result.t))
    if result.success:
        return "", (f"no implicit method is needed: an explicit trial run reaches the end in {result.n_steps} steps, of "
                    f"{TRIAL_STEPS} that it may take")
    n, end = request.n_state, float(result.t[-1]) if len(result.t) else request.span[0]
    unknown = "whether the motion is stiff is not known"
    if len(steps) < TRIAL_STEPS:
        return "", f"{unknown}: a trial run stopped at t = {end:.3g} s, after {len(steps)} of {TRIAL_STEPS} explicit steps"
    length = float(np.median(steps[-20:]))
    x = result.x[-1][:n]
    modes = Modes.at(module, request, end, x)
    if modes is None:
        return "", (f"{unknown}: at t = {end:.3g} s, after {TRIAL_STEPS} explicit steps, the right-hand side cannot be evaluated "
                    "on all sides of the state, which its eigenvalues need")
    product = modes.radius * length
    limited = (f"steps of {length:.3g} s times the largest eigenvalue, {modes.radius:.3g} 1/s, are {product:.2g}"
               f"{f', below {WORTH:g}' if product < WORTH else ''}; stability limits explicit ones from {LIMITED:g} on")
    to_come = abs(request.span[1] - end)
    later = replace(asked, span=(end, request.span[1]), x0=x.copy(), first_step=0.0, max_steps=STIFF_STEPS)
    try:
        if product <= LIMITED and (doubt := _doubt(module, result, request, product, to_come / length)):
            ringing = modes.ringing(request.atol[:n] + request.rtol * np.abs(x))
            if ringing is None or not _outlasted(ringing.time, length, to_come, modes.radius):
                return "", f"{doubt} ({limited})"
            # A vibration that rings now dies out early, and stability limits explicit steps from then on. Implicit steps that
            # tolerate it damp it at once; from there the true ones are tried.
            most = min(to_come / STIFF_STEPS, request.max_step or np.inf)
            calm = trial(replace(later, atol=ringing.amplitudes, rtol=LARGEST, max_step=most), stiff)
            later = replace(later, span=(float(calm.t[-1]), request.span[1]), x0=calm.x[-1][:n].copy())
            length = LIMITED / modes.radius
            limited = (f"a vibration with eigenvalues up to {modes.radius:.3g} 1/s dies out within {ringing.time:.2g} s; then "
                       f"stability limits explicit steps to {length:.2g} s")
        # From where the explicit trial ended: what dies away at the start takes an implicit method many short steps, too.
        longer = np.abs(np.diff(trial(later, stiff).t))
    except SymdynError as error:
        return "", f"{unknown}: no implicit step can be tried ({error})"
    ratio = float(np.max(longer[-5:], initial=0.0)) / length
    pays = f"times as long as explicit ones, and pay from {LONGER:g} times on ({limited})"
    after = f"after t = {later.span[0]:.3g} s implicit steps are"
    if ratio >= LONGER:
        return "stiff", f"the motion is stiff: {after} {ratio:.0f} {pays}"
    return "limited" if product > LIMITED else "", f"the motion is not stiff: {after} only {ratio:.2g} {pays}"


def _outlasted(ringing: float, length: float, to_come: float, radius: float) -> bool:
    """Whether an implicit method wins more after what rings has died out than it loses before, while it is IMPLICIT times as
    expensive as explicit steps of this length."""
    after = (to_come - ringing) * radius / LIMITED
    return after >= max(MANY, (IMPLICIT - 1) * ringing / length)


def _doubt(module: Module, result: Outcome, request: Request, product: float, to_come: float) -> str:
    """Why no implicit method is tried where stability need not limit the explicit one; empty: it is worth a trial."""
    if product < WORTH:
        return "accuracy, not stability, limits explicit steps"
    half, n = TRIAL_STEPS // 2, request.n_state
    rough = _roughest(result.t[-half:], result.x[-half:, :n], request.rtol, request.atol[:n])
    if rough is not None:
        return (f"the motion itself, not stability, asks for short steps: over {half} explicit ones, to t = {result.t[-1]:.3g} "
                f"s, {module.metadata.x[rough.entry]} departs from a cubic by {100 * rough.missed:.2g} % of its range, where "
                f"{100 * rough.allowed:.2g} % would be smooth")
    return (f"stiffness does not matter: some {to_come:.0f} explicit steps are to come, fewer than the {MANY} from which on an "
            "implicit method pays" if to_come < MANY else "")


class Rough(NamedTuple):
    """Least smooth entry of a state, by how much of its range it departs from a cubic, and how much a smooth one may."""

    entry: int
    missed: float
    allowed: float


def _roughest(t: np.ndarray, x: np.ndarray, rtol: float, atol: np.ndarray) -> Rough | None:
    """None if x(t), (n_t, n), is a cubic within SMOOTH of its range or ten times the tolerances."""
    powers = np.vander((t - t[0]) / (t[-1] - t[0]), 4)
    missed = np.abs(x - powers @ np.linalg.lstsq(powers, x, rcond=None)[0]).max(axis=0)
    ranges = np.ptp(x, axis=0)
    allowed = np.maximum(SMOOTH * ranges, 10 * (atol + rtol * np.abs(x).max(axis=0)))
    rough = ~(missed <= allowed)
    if not rough.any():
        return None
    entry = int(np.argmax(np.where(rough, missed / np.where(rough, allowed, 1.0), 0.0)))
    return Rough(entry, float(missed[entry] / ranges[entry]), float(allowed[entry] / ranges[entry]))


class Ringing(NamedTuple):
    """Part of a state that vibrates quickly and dies out: its amplitude, (n,), and the time until it is tolerated, s."""

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
        """Contribution to the state of the modes near the largest eigenvalue, and its duration; None if it stays or cannot be
        reported."""
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
