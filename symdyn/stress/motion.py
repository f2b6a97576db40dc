"""Checks of the usual motion of a mechanism: energy, constraints, time reversal, growth of small changes, condition."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from symdyn.runtime.solutions.solution import Solution
from symdyn.stress.flow import Path, demand_motion, flow, growth_back, path
from symdyn.stress.record import DEGRADE, FAIL, PASS, MotionStops, NotApplicable, Row, within
from symdyn.stress.system_under_test import EPS, RTOL, SystemUnderTest

# Magnifications up to here leave the digits to see an error by.
MAGNIFIED = 1e3
# Residual of constraints under projection, relative to the mechanism's length, see symdyn.runtime.integrating.stabilization.
KEPT = 1e-12
# A change that is followed: far above rounding errors and tolerances, far below where it is no longer small.
CHANGE = 1e-6


def _end(tested: SystemUnderTest, short: bool) -> float:
    return tested.duration / 5 if short else tested.duration


def energy(tested: SystemUnderTest, short: bool) -> Iterator[Row]:
    """The energy of the usual motion, less the work of its loads."""
    motion = path(tested, _end(tested, short))
    demand_motion(tested, motion.sol)
    yield energy_row(tested, motion)


def energy_row(tested: SystemUnderTest, motion: Path, check: str = "energy", of: str = "") -> Row:
    """The row of the energy of a motion; of: what is said before.

    Raises NotApplicable where there is none, MotionStops where a motion at other times stops early.
    """
    if not tested.has("energy"):
        raise NotApplicable("the equations give no energy")
    conservative = bool(tested.module.metadata.conservative)
    end = float(motion.sol.t[-1])
    sol = tested.run(np.linspace(0.0, end, 401), rtol=RTOL, atol=RTOL * motion.scales, work=not conservative)
    if not sol.success:
        raise MotionStops(float(sol.t[-1]), end, sol.message)
    steepest = energy_gradient(tested, sol, motion.scales)
    size, _ = sol.energy_scale
    if not size > 0:
        raise NotApplicable("the mechanism has no energy")
    operations = tested.equations.tape("rhs").longest_chain()
    per_step = motion.step_error * (2 if tested.constrained else 1) + 8 * operations * EPS
    own = 16 * EPS * tested.equations.tape("energy").longest_chain() * float(np.abs(sol.energies).sum(axis=1).max())
    bound = (sol.n_steps * per_step * steepest + own) / size
    return within(check, tested.name, f"{of}{end:.3g} s in {sol.n_steps} steps at rtol {RTOL:g}: change of energy less work of "
                  "loads", sol.energy_error(), bound, "steps times the error one may have times the gradient of the energy, over "
                  "the energy", "energy is kept as the tolerances promise",
                  "energy is lost or gained beyond what the tolerances allow")


def energy_gradient(tested: SystemUnderTest, sol: Solution, scales: np.ndarray) -> float:
    """The largest norm of the energy's gradient along a motion, J per scaled state."""
    rows = slice(None, None, 8)
    given = sol.inputs[rows] if len(sol.inputs) == len(sol.t) else None
    squares = np.zeros(len(sol.x[rows]))
    for i, scale in enumerate(scales):
        ends = []
        for sign in (1, -1):
            changed = sol.x[rows].copy()
            changed[:, i] += sign * 1e-5 * scale
            ends.append(tested.evaluate("energy", sol.t[rows], changed, inputs=given).sum(axis=1))
        squares += ((ends[0] - ends[1]) / 2e-5) ** 2
    return float(np.sqrt(squares.max()))


def constraints(tested: SystemUnderTest, short: bool) -> Iterator[Row]:
    """Violations of constraints over the usual motion."""
    if not tested.constrained:
        raise NotApplicable("there are no constraints")
    sol = path(tested, _end(tested, short)).sol
    demand_motion(tested, sol)
    done = f"{sol.t[-1]:g} s in {sol.n_steps} steps, at {len(sol.t)} times"
    far = float(np.abs(sol.q).max())
    yield within("constraints", tested.name, f"{done}: residuals of constraints over the length",
                 float(np.abs(sol.constraint_violation).max()), max(KEPT, 16 * EPS * far),
                 "projection after every step and at every output time; 1e-12, or what coordinates of this size resolve",
                 "the motion stays on its constraints", "the projection leaves the constraints violated")
    yield within("constraints", tested.name, f"{done}: rates of the residuals over the largest speed",
                 float(np.abs(sol.velocity_violation).max()), 10 * KEPT,
                 "the same of speeds, ten times as much as their largest may be small at other times",
                 "speeds stay on the constraints", "the projection leaves speeds that violate the constraints")


def reversal(tested: SystemUnderTest, short: bool) -> Iterator[Row]:
    """Forward and back to the start."""
    if tested.module.metadata.contacts:
        raise NotApplicable("rigid contacts lose energy, so that its motion does not run backward")
    motion, back, k = reversible(tested, short)
    if motion.sol.inputs.shape[1] and not np.isfinite(motion.sol.inputs).all():
        raise NotApplicable("inputs are not finite")
    end = float(motion.sol.t[2 * k])
    forward = tested.run((0.0, end), rtol=RTOL, atol=RTOL * motion.scales, steps=True)
    returned = tested.run((end, 0.0), forward.x[-1], rtol=RTOL, atol=RTOL * motion.scales, steps=True)
    if not (forward.success and returned.success):
        message = forward.message if not forward.success else returned.message
        yield Row("reversal", tested.name, f"{end:g} s forward and back", None, None, "", FAIL, message)
        return
    steps = forward.n_steps + returned.n_steps
    result = float(np.linalg.norm((returned.x[-1] - forward.x[0]) / motion.scales))
    chain = tested.equations.tape("rhs").longest_chain()
    bound = steps * (motion.step_error * (2 if tested.constrained else 1) + 8 * chain * EPS) * float(back[k])
    yield within("reversal", tested.name, f"{end:g} s forward and back, {steps} steps at rtol {RTOL:g}: distance from the start",
                 result, bound, f"steps times the error one may have times the largest magnification back to the start "
                 f"({back[k]:.2g})",
                 "it returns to the start as far as the tolerances promise", "the way back is another motion")


def divergence(tested: SystemUnderTest, short: bool) -> Iterator[Row]:
    """A small change of the start against the variational equations: a test of the exact Jacobian, too."""
    if tested.module.metadata.contacts:
        raise NotApplicable("the variational equations do not go across the switches of its rigid contacts")
    motion, _, _ = reversible(tested, short, both=False)
    sol = motion.sol
    phi = flow(tested, motion)
    norms = np.linalg.norm(phi, 2, axis=(1, 2))
    k = int(np.flatnonzero(np.maximum.accumulate(norms) <= MAGNIFIED)[-1])
    if k < 2:
        raise NotApplicable("small changes grow beyond all measure at once")
    k -= k % 2
    direction = np.random.default_rng(7).normal(size=len(motion.scales)) * motion.scales
    starts = [sol.x[0] + sign * CHANGE * direction for sign in (0.5, -0.5, 1, -1)]
    if tested.constrained or tested.module.metadata.unit_groups:
        starts = [_onto(tested, x) for x in starts]
    times = sol.t[:2 * k + 1]
    runs = [tested.run(times, x, rtol=1e-12, atol=1e-12 * motion.scales) for x in starts]
    if not all(run.success for run in runs):
        raise NotApplicable("a motion from a changed start stops early")
    ends = [run.x[-1] / motion.scales for run in runs]
    change, apart = (starts[0] - starts[1]) / 2 / motion.scales, (ends[0] - ends[1]) / 2
    wanted, coarse = phi[k] @ change, flow(tested, motion, 2)[k // 2] @ change
    bent = float(np.linalg.norm((ends[2] - ends[3]) / 2 - 2 * apart))
    size, grown = float(np.linalg.norm(change)), max(float(norms[:k + 1].max()), 1.0)
    if tested.constrained or tested.module.metadata.unit_groups:
        wanted, coarse = (_tangent(tested, times[-1], runs[0].x[-1], motion.scales, w) for w in (wanted, coarse))
    result = float(np.linalg.norm(apart - wanted) / (size * grown))
    allowed = 2 * math.sqrt(len(motion.scales)) * 1e-12 * (2 if tested.constrained else 1)
    parts = (float(np.linalg.norm(wanted - coarse)), bent, 2 * runs[0].n_steps * grown * allowed)
    yield within("divergence", tested.name,
                 f"a change of {size:.1g} of the start, after {times[-1]:.3g} s {np.linalg.norm(apart) / size:.3g} times as "
                 "large: difference from the variational equations with the exact Jacobian, over the largest magnification",
                 result, sum(parts) / (size * grown), "the variational equations' own error (from intervals twice as long), the "
                 "change's higher orders (from twice the change), errors of steps", "small changes grow as they must",
                 "the Jacobian is not that of the motion")


def condition(tested: SystemUnderTest, short: bool) -> Iterator[Row]:
    """The condition of the mass matrix, or of the whole system with constraints, along the usual motion."""
    from symdyn.stress.reference import conditions

    motion = path(tested, _end(tested, short))
    worst = conditions(tested, motion.sol.t, motion.sol.x)
    worst = worst[np.isfinite(worst)]
    if not len(worst):
        raise NotApplicable("there is no matrix to look at")
    most, chain = float(worst.max()), tested.equations.tape("rhs").longest_chain()
    lost = most * EPS * chain
    text = "of the constrained system" if tested.constrained else "of the mass matrix"
    verdict = PASS if lost <= 1e-8 else DEGRADE
    yield Row("condition", tested.name, f"condition {text}, rows and columns scaled, at {len(worst)} states of "
              f"{motion.sol.t[-1]:g} s: {worst.min():.2g} to {most:.2g}; times rounding of the longest chain of {chain} "
              "operations", lost, 1e-8,
              "accelerations that keep the usual tolerance of 1e-8", verdict,
              "accelerations have the digits that the usual tolerance needs" if verdict == PASS else
              "the mechanism itself is ill-conditioned: accelerations have fewer digits than the usual tolerance asks for")


def reversible(tested: SystemUnderTest, short: bool, both: bool = True) -> tuple[Path, np.ndarray, int]:
    """The motion, its magnification back to the start, and the place up to which that stays below MAGNIFIED."""
    end = _end(tested, short)
    for k in range(6):
        motion = path(tested, end, resolved=True)
        if k == 0:
            demand_motion(tested, motion.sol)
        back = growth_back(flow(tested, motion)) if both else np.ones(1)
        last = int(np.flatnonzero(back <= MAGNIFIED)[-1])
        if not both or last >= 40:
            return motion, back, last
        end /= 10
    raise NotApplicable("the motion forgets its start within a millionth of its duration")


def _onto(tested: SystemUnderTest, x: np.ndarray) -> np.ndarray:
    """The state on the constraints."""
    from symdyn.runtime.integrating.stabilization import Projector

    return Projector(tested.module, tested.params)(0.0, x)


def _tangent(tested: SystemUnderTest, t: float, x: np.ndarray, scales: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Projection of a change (scaled)."""
    size = float(np.linalg.norm(change))
    if size == 0:
        return change
    from symdyn.runtime.integrating.stabilization import Projector

    project = Projector(tested.module, tested.params)
    step = 1e-6 / size
    return (project(t, x + step * change * scales) - project(t, x)) / (scales * step)  # type: ignore[no-any-return]
