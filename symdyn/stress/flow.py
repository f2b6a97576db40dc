"""Magnification of errors by a motion: the solution of the variational equations, by the exact Jacobian.

Everything here is scaled: entries of states are divided by the largest value of their unit in the motion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from symdyn.runtime.solutions.solution import Solution
from symdyn.stress.record import MotionStops, NotApplicable, StandsStill
from symdyn.stress.system_under_test import RTOL, SystemUnderTest

# Intervals of the variational equations; more operations than this make no Jacobian to be compiled.
INTERVALS = 400
PER_STEP, MOST = 4, 4000
LONGEST = 3000
# A smaller motion than this part of the mechanism is one of errors of steps, or leaves them no two digits.
STILL = 100 * RTOL
# Steps whose errors are measured, among the first so many, and the tolerance of what they are compared with.
MEASURED, MEASURED_AMONG, FINE = 40, 20_000, 1e-14


@dataclass(frozen=True)
class Path:
    """A motion with its scales (n_x,); local: the largest error of a step that was measured."""

    sol: Solution
    scales: np.ndarray
    rtol: float

    local: float = np.inf

    @property
    def step_error(self) -> float:
        """The error of one step, scaled, in the Euclidean norm: twice the largest of those that were measured, but no more than
        the error control allows: the root mean square over n entries of error / (atol + rtol |x|) is at most 1, and atol =
        rtol scale."""
        return float(min(2 * self.local, 2 * np.sqrt(len(self.scales)) * self.rtol))


def scales_of(tested: SystemUnderTest, x: np.ndarray) -> np.ndarray:
    """For each entry of the state the largest value of its unit in rows of states, 1 where all are zero, (n_x,)."""
    metadata = tested.module.metadata
    units = [metadata.units.get(name, name) for name in metadata.x]
    most = np.abs(x).max(axis=0)
    largest = {unit: max(m for u, m in zip(units, most, strict=True) if u == unit) for unit in units}
    return np.array([largest[unit] or 1.0 for unit in units])


def path(tested: SystemUnderTest, end: float, rtol: float = RTOL, resolved: bool = False) -> Path:
    """The usual motion until `end`, with tolerances in its own scales.

    resolved   at PER_STEP intervals a step, shortened to where MOST intervals are enough
    Raises MotionStops where it stops early.
    """
    pilot = tested.run((0.0, end), rtol=1e-6, max_steps=MEASURED_AMONG)
    if not pilot.success and pilot.n_steps < MEASURED_AMONG:
        raise MotionStops(float(pilot.t[-1]), end, pilot.message)
    scales, intervals = scales_of(tested, pilot.x), INTERVALS
    if resolved:
        steps = tested.run((0.0, end), rtol=rtol, atol=rtol * scales, steps=True, max_steps=MOST // PER_STEP)
        end = float(steps.t[-1])
        intervals = max(INTERVALS, 2 * (PER_STEP * steps.n_steps // 2))
    sol = tested.run(np.linspace(0.0, end, 2 * intervals + 1), rtol=rtol, atol=rtol * scales)
    if not sol.success:
        raise MotionStops(float(sol.t[-1]), end, sol.message)
    return Path(sol, scales, rtol, local_error(tested, end, rtol, scales))


def stands_still(tested: SystemUnderTest, x: np.ndarray) -> bool:
    """Whether no coordinate changes over rows of states, of a run at RTOL or thereabouts, by more than errors of steps may make
    up: STILL of the largest value of its unit, of 1 rad, or of the longest parameter in metres."""
    module = tested.module
    known, params = module.metadata.units, zip(module.metadata.parameters, tested.params, strict=True)
    longest = max((abs(float(p)) for name, p in params if known.get(name) == "m"), default=1.0)
    n_q, n_u = module.metadata.sizes.q, module.metadata.sizes.u
    least = np.array([longest if known.get(name) == "m" else 1.0 for name in module.metadata.x])
    change = np.ptp(x, axis=0) <= STILL * np.maximum(scales_of(tested, x), least)
    return bool(np.delete(change, slice(n_q, n_q + n_u)).all())  # rounding alone gives speeds next to those that are zero


def demand_motion(tested: SystemUnderTest, sol: Solution) -> None:
    """Raises StandsStill if nothing moves."""
    if stands_still(tested, sol.x):
        raise StandsStill(float(sol.t[-1]))


def local_error(tested: SystemUnderTest, end: float, rtol: float, scales: np.ndarray, start: np.ndarray | None = None,
                method: str | None = None) -> float:
    """The largest error (scaled) of some of the steps, each against a run over it at rtol 1e-14 in four steps or more."""
    every = tested.run((0.0, end), start, rtol=rtol, atol=rtol * scales, steps=True, max_steps=MEASURED_AMONG, method=method)
    n = len(every.t) - 1
    worst = 0.0
    for k in np.unique(np.linspace(0, n - 1, MEASURED).astype(int)):
        # By the same method: "auto" might take an explicit one where stiff motion begins with its slow part.
        sharp = tested.run((every.t[k], every.t[k + 1]), every.x[k], rtol=FINE, atol=FINE * scales, steps=True,
                           max_step=(every.t[k + 1] - every.t[k]) / 4, method=every.method)
        if sharp.success:
            worst = max(worst, float(np.linalg.norm((sharp.x[-1] - every.x[k + 1]) / scales)))
    return worst


def flow(tested: SystemUnderTest, motion: Path, stride: int = 1) -> np.ndarray:
    """Phi(t_k, 0), scaled, at every second time of the motion, (n, n_x, n_x), by the Magnus series of fourth order; stride: with
    intervals so many times as long.

    Source: Blanes, Casas, Oteo, Ros, The Magnus expansion and some of its applications, Physics Reports 470 (2009) 151.
    Raises NotApplicable where there is no Jacobian, or it is too long to be compiled in passing.
    """
    operations = tested.equations.tape("rhs").operations
    if not tested.has("jacobian_x") or operations > LONGEST:
        raise NotApplicable(f"its right-hand side has {operations} operations; a Jacobian is compiled up to {LONGEST}")
    sol, n = motion.sol, motion.sol.x.shape[1]
    J = tested.evaluate("jacobian_x", sol.t[::stride], sol.x[::stride], inputs=sol.inputs[::stride]).reshape(-1, n, n)
    if not np.isfinite(J).all():
        raise NotApplicable("the Jacobian cannot be evaluated along the motion")
    J = J * (motion.scales[None, None, :] / motion.scales[None, :, None])
    first, middle, last = J[:-1:2], J[1::2], J[2::2]
    h = np.diff(sol.t[::2 * stride])[:, None, None]
    steps = expm(h / 6 * (first + 4 * middle + last) - h**2 / 12 * (first @ last - last @ first))
    phi = [np.eye(n)]
    for step in steps:
        phi.append(step @ phi[-1])
    return np.array(phi)


def growth_back(phi: np.ndarray) -> np.ndarray:
    """The largest magnification from any earlier time back to the start, (n,), of Phi (n, n_x, n_x)."""
    inverse = np.full(len(phi), np.inf)
    for k, one in enumerate(phi):
        values = np.linalg.svd(one, compute_uv=False)
        inverse[k] = 1 / values[-1] if values[-1] > 0 else np.inf
    return np.maximum.accumulate(inverse)


def growth_to(phi: np.ndarray, k: int) -> float:
    """The largest magnification from any earlier time to time k."""
    return max(float(np.linalg.norm(phi[k] @ np.linalg.pinv(phi[j]), 2)) for j in range(0, k + 1, max(1, k // 40)))
