"""Checks of the usual motion of a mechanism: energy, constraints, time reversal, growth of small changes, condition."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from symdyn.runtime.solutions.solution import Solution
from symdyn.stress.flow import Path, demand_motion, flow, growth_back, path
from symdyn.stress.record import DEGRADE, FAIL, PASS, MotionStops, NotApplicable, Row, within
from symdyn.stress.subject import EPS, RTOL, Subject

# Magnifications up to here leave the digits to see an error by.
MAGNIFIED = 1e3
# Of constraints, by projection; relative to the mechanism's length, see symdyn.runtime.integrating.stabilization.
KEPT = 1e-12
# A change that is followed: far above rounding errors and tolerances, far below where it is no longer small.
CHANGE = 1e-6


def _end(subject: Subject, short: bool) -> float:
    return subject.duration / 5 if short else subject.duration


def energy(subject: Subject, short: bool) -> Iterator[Row]:
    """The energy of the usual motion, less the work of its loads."""
    motion = path(subject, _end(subject, short))
    demand_motion(subject, motion.sol)
    yield energy_row(subject, motion)


def energy_row(subject: Subject, motion: Path, check: str = "energy", of: str = "") -> Row:
    """The row of the energy of a motion; of: what is said before.

    Raises NotApplicable where there is none, MotionStops where a motion at other times stops early.
    """
    if not subject.has("energy"):
        raise NotApplicable("the equations tell no energy")
    conservative = bool(subject.module.metadata.conservative)
    end = float(motion.sol.t[-1])
    sol = subject.run(np.linspace(0.0, end, 401), rtol=RTOL, atol=RTOL * motion.scales, work=not conservative)
    if not sol.success:
        raise MotionStops(float(sol.t[-1]), end, sol.message)
    steepest = energy_gradient(subject, sol, motion.scales)
    size, _ = sol.energy_scale
    if not size > 0:
        raise NotApplicable("the mechanism has no energy")
    operations = subject.equations.tape("rhs").longest_chain()
    per_step = motion.step_error * (2 if subject.constrained else 1) + 8 * operations * EPS
    own = 16 * EPS * subject.equations.tape("energy").longest_chain() * float(np.abs(sol.energies).sum(axis=1).max())
    bound = (sol.n_steps * per_step * steepest + own) / size
    return within(check, subject.name, f"{of}{end:.3g} s in {sol.n_steps} steps at rtol {RTOL:g}: change of energy less work of "
                  "loads", sol.energy_error(), bound, "steps times the error one may have times the gradient of the energy, over "
                  "the energy", "energy is kept as the tolerances promise",
                  "energy is lost or gained beyond what the tolerances allow")


def energy_gradient(subject: Subject, sol: Solution, scales: np.ndarray) -> float:
    """The largest norm of the energy's gradient along a motion, J per scaled state."""
    rows = slice(None, None, 8)
    given = sol.inputs[rows] if len(sol.inputs) == len(sol.t) else None
    squares = np.zeros(len(sol.x[rows]))
    for i, scale in enumerate(scales):
        ends = []
        for sign in (1, -1):
            changed = sol.x[rows].copy()
            changed[:, i] += sign * 1e-5 * scale
            ends.append(subject.evaluate("energy", sol.t[rows], changed, inputs=given).sum(axis=1))
        squares += ((ends[0] - ends[1]) / 2e-5) ** 2
    return float(np.sqrt(squares.max()))


def constraints(subject: Subject, short: bool) -> Iterator[Row]:
    """Violations of constraints over the usual motion."""
    if not subject.constrained:
        raise NotApplicable("there are no constraints")
    sol = path(subject, _end(subject, short)).sol
    demand_motion(subject, sol)
    done = f"{sol.t[-1]:g} s in {sol.n_steps} steps, at {len(sol.t)} times"
    far = float(np.abs(sol.q).max())
    yield within("constraints", subject.name, f"{done}: residuals of constraints over the length",
                 float(np.abs(sol.constraint_violation).max()), max(KEPT, 16 * EPS * far),
                 "projection after every step and at every output time; 1e-12, or what coordinates of this size resolve",
                 "the motion stays on its constraints", "the projection leaves the constraints violated")
    yield within("constraints", subject.name, f"{done}: rates of the residuals over the largest speed",
                 float(np.abs(sol.velocity_violation).max()), 10 * KEPT,
                 "the same of speeds, ten times as much as their largest may be small at other times",
                 "speeds stay on the constraints", "the projection leaves speeds that violate the constraints")


def reversal(subject: Subject, short: bool) -> Iterator[Row]:
    """Forward and back to the start."""
    motion, back, k = reversible(subject, short)
    if motion.sol.inputs.shape[1] and not np.isfinite(motion.sol.inputs).all():
        raise NotApplicable("inputs are not finite")
    end = float(motion.sol.t[2 * k])
    forward = subject.run((0.0, end), rtol=RTOL, atol=RTOL * motion.scales, steps=True)
    returned = subject.run((end, 0.0), forward.x[-1], rtol=RTOL, atol=RTOL * motion.scales, steps=True)
    if not (forward.success and returned.success):
        message = forward.message if not forward.success else returned.message
        yield Row("reversal", subject.name, f"{end:g} s forward and back", None, None, "", FAIL, message)
        return
    steps = forward.n_steps + returned.n_steps
    found = float(np.linalg.norm((returned.x[-1] - forward.x[0]) / motion.scales))
    chain = subject.equations.tape("rhs").longest_chain()
    bound = steps * (motion.step_error * (2 if subject.constrained else 1) + 8 * chain * EPS) * float(back[k])
    yield within("reversal", subject.name, f"{end:g} s forward and back, {steps} steps at rtol {RTOL:g}: distance from the start",
                 found, bound, f"steps times the error one may have times the largest magnification back to the start "
                 f"({back[k]:.2g})",
                 "it returns to the start as far as the tolerances promise", "the way back is another motion")


def divergence(subject: Subject, short: bool) -> Iterator[Row]:
    """A small change of the start against the variational equations: a test of the exact Jacobian, too."""
    motion, _, _ = reversible(subject, short, both=False)
    sol = motion.sol
    phi = flow(subject, motion)
    norms = np.linalg.norm(phi, 2, axis=(1, 2))
    k = int(np.flatnonzero(np.maximum.accumulate(norms) <= MAGNIFIED)[-1])
    if k < 2:
        raise NotApplicable("small changes grow beyond all measure at once")
    k -= k % 2
    direction = np.random.default_rng(7).normal(size=len(motion.scales)) * motion.scales
    starts = [sol.x[0] + sign * CHANGE * direction for sign in (0.5, -0.5, 1, -1)]
    if subject.constrained or subject.module.metadata.unit_groups:
        starts = [_onto(subject, x) for x in starts]
    times = sol.t[:2 * k + 1]
    runs = [subject.run(times, x, rtol=1e-12, atol=1e-12 * motion.scales) for x in starts]
    if not all(run.success for run in runs):
        raise NotApplicable("a motion from a changed start stops early")
    ends = [run.x[-1] / motion.scales for run in runs]
    change, apart = (starts[0] - starts[1]) / 2 / motion.scales, (ends[0] - ends[1]) / 2
    wanted, coarse = phi[k] @ change, flow(subject, motion, 2)[k // 2] @ change
    bent = float(np.linalg.norm((ends[2] - ends[3]) / 2 - 2 * apart))
    size, grown = float(np.linalg.norm(change)), max(float(norms[:k + 1].max()), 1.0)
    if subject.constrained or subject.module.metadata.unit_groups:
        wanted, coarse = (_tangent(subject, times[-1], runs[0].x[-1], motion.scales, w) for w in (wanted, coarse))
    found = float(np.linalg.norm(apart - wanted) / (size * grown))
    allowed = 2 * math.sqrt(len(motion.scales)) * 1e-12 * (2 if subject.constrained else 1)
    parts = (float(np.linalg.norm(wanted - coarse)), bent, 2 * runs[0].n_steps * grown * allowed)
    yield within("divergence", subject.name,
                 f"a change of {size:.1g} of the start, after {times[-1]:.3g} s {np.linalg.norm(apart) / size:.3g} times as "
                 "large: difference from the variational equations with the exact Jacobian, over the largest magnification",
                 found, sum(parts) / (size * grown), "the variational equations' own error (from intervals twice as long), the "
                 "change's higher orders (from twice the change), errors of steps", "small changes grow as they must",
                 "the Jacobian is not that of the motion")


def condition(subject: Subject, short: bool) -> Iterator[Row]:
    """The condition of the mass matrix, or of the whole system with constraints, along the usual motion."""
    from symdyn.stress.reference import conditions

    motion = path(subject, _end(subject, short))
    worst = conditions(subject, motion.sol.t, motion.sol.x)
    worst = worst[np.isfinite(worst)]
    if not len(worst):
        raise NotApplicable("there is no matrix to look at")
    most, chain = float(worst.max()), subject.equations.tape("rhs").longest_chain()
    lost = most * EPS * chain
    text = "of the constrained system" if subject.constrained else "of the mass matrix"
    verdict = PASS if lost <= 1e-8 else DEGRADE
    yield Row("condition", subject.name, f"condition {text}, rows and columns scaled, at {len(worst)} states of "
              f"{motion.sol.t[-1]:g} s: {worst.min():.2g} to {most:.2g}; times rounding of the longest chain of {chain} "
              "operations", lost, 1e-8,
              "accelerations that keep the usual tolerance of 1e-8", verdict,
              "accelerations have the digits that the usual tolerance needs" if verdict == PASS else
              "the mechanism itself is ill-conditioned: accelerations have fewer digits than the usual tolerance asks for")


def reversible(subject: Subject, short: bool, both: bool = True) -> tuple[Path, np.ndarray, int]:
    """The motion, its magnification back to the start, and the place up to which that stays below MAGNIFIED."""
    end = _end(subject, short)
    for k in range(6):
        motion = path(subject, end, resolved=True)
        if k == 0:
            demand_motion(subject, motion.sol)
        back = growth_back(flow(subject, motion)) if both else np.ones(1)
        last = int(np.flatnonzero(back <= MAGNIFIED)[-1])
        if not both or last >= 40:
            return motion, back, last
        end /= 10
    raise NotApplicable("the motion forgets its start within a millionth of its duration")


def _onto(subject: Subject, x: np.ndarray) -> np.ndarray:
    """The state on the constraints."""
    from symdyn.runtime.integrating.stabilization import Projector

    return Projector(subject.module, subject.params)(0.0, x)


def _tangent(subject: Subject, t: float, x: np.ndarray, scales: np.ndarray, change: np.ndarray) -> np.ndarray:
    """What projection leaves of a change (scaled)."""
    size = float(np.linalg.norm(change))
    if size == 0:
        return change
    from symdyn.runtime.integrating.stabilization import Projector

    project = Projector(subject.module, subject.params)
    step = 1e-6 / size
    return (project(t, x + step * change * scales) - project(t, x)) / (scales * step)  # type: ignore[no-any-return]
