"""Newton's method for equilibria, made safe by a trust region.

Unknowns are velocities v along which the state moves (q' = N v), extra states, and parameters or inputs that are solved for.
Multipliers are eliminated: those of least squares at every state, which keeps the derivative of the residual's norm exact.
Rows and columns are scaled: columns by the mass matrix, so that metres and radians compare, rows by their largest entry, so
that every residual is a displacement.
Source: Nocedal and Wright, Numerical Optimization, section 11.2; trust region by singular values: More (1978).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from symdyn.errors import EvaluationError
from symdyn.runtime.constraints import turning
from symdyn.statics.selection import Selection
from symdyn.statics.terms import OperatingPoint
from symdyn.tape.intrinsics import RANK

# Angles change by at most this in one step, rad.
LARGEST_TURN = 0.5
# Scaled steps that are none any more, and scaled residuals that are small enough.
STEP, SOLVED = 1e-10, 1e-9
# A Newton step this short gains nothing; longer ones are taken while they still shrink.
ROUNDED = 1e-15
# Rows are scaled up by at most the inverse of this: what is left of stiffness below is rounding. Less so under constraints, whose
# multipliers are found from scaled rows.
FLOOR, CONSTRAINED_FLOOR = 1e-9, 1e-3
# Singular values below this part of the largest, divided by the floor, are rounding: no step is taken along them.
CUT = 1e-15
# Forces that are left may be this part of those that act, or that of rounding in the largest.
LEFT, ROUNDING = 1e-9, 1e-13
# A coordinate that is further than this many times the largest length or radius of inertia of the start has run away.
FAR = 1e6
# After every step at most so many more bring the state onto the constraints, to this part of a metre.
CLOSING, CLOSED = 6, 1e-14
RUNAWAY = "a coordinate runs away"


@dataclass(frozen=True, eq=False)
class Trial:
    """A state on the way, with its residual and the derivative of it by the unknowns."""

    point: OperatingPoint
    selection: Selection

    @cached_property
    def tested(self) -> np.ndarray:
        return self.selection.tested(self.point)

    @cached_property
    def directions(self) -> np.ndarray:
        return self.selection.directions(self.point)

    @property
    def forces(self) -> np.ndarray:
        """Along the tested directions, with the multipliers of the point."""
        along: np.ndarray = self.tested.T @ self.point.forces
        return along

    def with_multipliers(self, weights: np.ndarray) -> Trial:
        """The same with the multipliers that balance the forces best; weights of the tested directions."""
        if not self.point.sizes[3]:
            return self
        still = self.point.at(lam=np.zeros(self.point.sizes[3]))
        pulls = weights[:, None] * (self.tested.T @ self.point.C_r.T)
        lam = np.linalg.lstsq(pulls, -weights * (self.tested.T @ still.forces), rcond=RANK)[0]
        return Trial(self.point.at(lam=lam * self.point.scale), self.selection)

    def residual(self) -> np.ndarray:
        """Forces along the tested directions, constraints as lengths, rates of the free extra states."""
        return np.concatenate([self.forces, self.point.C * self.point.scale, self.point.rates_z[self.selection.states]])

    def derivative(self) -> np.ndarray:
        """d residual / d unknowns at these multipliers; unknowns: along `directions`, extra states, parameters, inputs."""
        point, states = self.point, self.selection.states
        _, n_u, _, n_c = point.sizes
        blocks = [point.by_v @ self.directions, point.by_z[:, states], *[c[:, None] for c in self.by_unknown()]]
        whole = np.hstack(blocks)
        top = self.tested.T @ whole[:n_u]
        # By C_r in place of the derivative of C: velocity constraints have none, and hold steps, too.
        middle = np.zeros((n_c, whole.shape[1]))
        middle[:, self.directions.shape[1]:] = whole[n_u:n_u + n_c, self.directions.shape[1]:] * point.scale[:, None]
        middle[:, :self.directions.shape[1]] = point.C_r @ self.directions
        return np.vstack([top, middle, whole[n_u + n_c:][states]])

    def by_unknown(self) -> list[np.ndarray]:
        """Derivatives of the balance by the parameters and inputs that are solved for."""
        return list(self.point.by([*self.selection.parameters, *self.selection.inputs]).T)


class Search:
    """One search from one start."""

    def __init__(self, point: OperatingPoint, selection: Selection) -> None:
        self.selection = selection
        self.module = point.module
        self.turning = turning(point.module)
        self.steps = 0
        trial = Trial(point, selection)
        masses = np.abs(np.diag(point.M))
        lengthy = masses[~self.turning] if (~self.turning).any() else masses
        reference = float(lengthy.max(initial=0.0)) or 1.0
        columns = np.sqrt(reference / np.where(masses > 1e-12 * masses.max(initial=0.0), masses, reference))
        self.columns = columns
        trial = self._closed(trial)
        trial = trial.with_multipliers(np.sqrt(np.sum((trial.tested * columns[:, None])**2, axis=0)))
        n_e, n_c = trial.tested.shape[1], point.sizes[3]
        least = CONSTRAINED_FLOOR if n_c else FLOOR
        self.unknown = self._unknown_widths(trial)
        J = np.abs(trial.derivative() * self.widths(trial))
        largest = J.max(axis=1, initial=0.0)
        floor = np.ones(len(largest))
        for part in (slice(0, n_e), slice(n_e, n_e + n_c), slice(n_e + n_c, None)):
            floor[part] = least * largest[part].max(initial=0.0) or 1.0
        self.cut = CUT / least
        self.weights = 1 / np.maximum(largest, floor)
        self.n_e = n_e
        self.best = trial.with_multipliers(self.weights[:n_e])
        self.best.residual()  # where it cannot be evaluated this raises now
        self.far = FAR * max(1.0, float(np.abs(point.q).max(initial=0.0)))

    def widths(self, trial: Trial) -> np.ndarray:
        """Scales of the unknowns: what one unit of the scaled ones is."""
        along = 1 / np.sqrt(np.sum((trial.directions / self.columns[:, None])**2, axis=0))
        return np.concatenate([along, [abs(v) or 1.0 for v in trial.point.z[self.selection.states]], self.unknown])

    def _unknown_widths(self, trial: Trial) -> np.ndarray:
        """Changes of parameters and inputs that act like one unit of motion against the stiffness, with that of what is kept;
        their own size, or 1, where there is none."""
        point, n_u = trial.point, trial.point.sizes[1]
        stiffness = np.abs((trial.tested.T @ point.by_v[:n_u]) * self.columns).max(axis=1, initial=0.0)
        stiff = stiffness > FLOOR * stiffness.max(initial=0.0)
        widths = []
        for size, column in zip(self.selection.amounts(point), trial.by_unknown(), strict=True):
            effect = np.abs(trial.tested.T @ column[:n_u])[stiff] / stiffness[stiff]
            largest = effect.max(initial=0.0)
            widths.append(1 / largest if largest > 0 else abs(size) or 1.0)
        return np.array(widths)

    def allowed(self, trial: Trial) -> np.ndarray:
        """Force that may be left along each speed, (n_u,): a small part of the forces that act there, taken one by one.

        The acting forces are measured by the change of the forces with the logarithm of every parameter, by pulls of constraints,
        and, for rounding, by the stiffness.
        """
        point, names = trial.point, self.module.metadata
        n_u = point.sizes[1]
        values = np.concatenate([point.p, point.inputs])
        by = point.by([*names.parameters, *names.inputs])[:n_u]
        acting = np.abs(by) @ np.abs(values)
        if point.sizes[3]:
            acting += np.abs(point.evaluate("C_r").T) @ np.abs(point.lam)
        whole = self.columns * (acting + np.abs(point.by_v[:n_u]) @ self.columns)
        result: np.ndarray = LEFT * acting + ROUNDING * whole.max(initial=0.0) / self.columns
        return result

    def balanced(self, trial: Trial) -> bool:
        """Whether the forces that are left are small compared with those that act."""
        if not trial.tested.shape[1]:
            return True
        Q = trial.tested @ np.linalg.pinv(trial.tested)
        return bool((np.abs(Q @ trial.point.forces) <= np.abs(Q) @ self.allowed(trial)).all())

    def run(self, limit: int) -> tuple[bool, str]:
        """Whether an equilibrium was found, and else why not; `best` holds the last state, `steps` their number.

        Where no step reduces the residual though it is not zero, such as in a stretched position, a nearby start leads on.
        """
        stream = np.random.default_rng(1)
        good, reason = self._descend(self.best, limit)
        stuck = self.best
        for shake in (0.02, 0.1, 0.3):
            if good or self.steps >= limit or reason == RUNAWAY:
                break
            n = self.best.directions.shape[1]
            change = np.zeros(len(self.widths(stuck)))
            change[:n] = shake * stream.standard_normal(n)
            near = self._moved(stuck, change * self.widths(stuck))
            if near is not None:
                good = self._descend(near, limit)[0]
        if not good:
            self.best = stuck
        return good, reason

    def _descend(self, trial: Trial, limit: int) -> tuple[bool, str]:
        self.best = trial
        F, J, widths = self.scaled(trial)
        radius, last = np.inf, np.inf
        while self.steps < limit:
            U, values, Vt = np.linalg.svd(J, full_matrices=False)
            kept = values > self.cut * values.max(initial=0.0)
            along = U.T @ F
            newton = _length(along[kept] / values[kept])
            left = _length(F - U[:, kept] @ along[kept])
            if newton <= STEP and _length(F) <= SOLVED + left and (newton <= ROUNDED or newton > last / 4):
                balanced = left <= max(self.cut, SOLVED) and self.balanced(trial)
                return balanced, "" if balanced else "forces are left that nothing balances"
            last = newton
            self.steps += 1
            step = -Vt[kept].T @ _damped(along[kept], values[kept], radius)
            factor, step = self._limited(trial, step, widths)
            predicted = 0.5 * (F @ F - np.sum((F + J @ step)**2))
            new = self._moved(trial, step * widths)
            scaled = self.scaled(new) if new is not None else None
            actual = 0.5 * (F @ F - scaled[0] @ scaled[0]) if scaled is not None else -np.inf
            length = _length(step)
            if scaled is not None and new is not None and (actual > 1e-4 * predicted or self._rounding(F, scaled[0], newton)):
                trial, (F, J, widths) = new, scaled
                self.best = trial
                if actual > 0.75 * predicted and factor == 1 and np.isfinite(radius):
                    radius = max(radius, 2 * length)
            if not actual > 0.25 * predicted and newton > STEP:
                radius = 0.25 * length
            if np.abs(trial.point.q).max(initial=0.0) > self.far:
                return False, RUNAWAY
            if radius < 1e-12:
                return False, "forces are left that no step reduces"
        return False, f"{limit} iterations were not enough"

    def _closed(self, trial: Trial) -> Trial:
        """The state moved onto the constraints as far as a few steps get: only there dependent ones are seen to be."""
        for _ in range(CLOSING if trial.point.sizes[3] else 0):
            point = trial.point
            gaps = point.C * point.scale
            if np.abs(gaps).max() <= CLOSED:
                break
            B = trial.directions
            widths = 1 / np.sqrt(np.sum((B / self.columns[:, None])**2, axis=0))
            change = -(B * widths) @ (np.linalg.pinv(point.C_r @ B * widths, rcond=1e-6) @ gaps)
            turns = np.abs(change[self.turning]).max(initial=0.0)
            x = point.x.copy()
            x[:len(point.q)] = point.moved(change * min(1.0, LARGEST_TURN / turns) if turns else change)
            trial = Trial(point.at(x=self.selection.apply(x)), self.selection)
        return trial

    @staticmethod
    def _rounding(F: np.ndarray, new: np.ndarray, newton: float) -> bool:
        """Whether only rounding is left: steps are taken then though they may not reduce the residual."""
        return newton <= 1e-6 and float(np.linalg.norm(new)) <= max(SOLVED, 2 * float(np.linalg.norm(F)))

    def scaled(self, trial: Trial) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Residual and derivative, scaled, forces without what multipliers balance; scales of the unknowns."""
        widths = self.widths(trial)
        F, J = trial.residual() * self.weights, trial.derivative() * self.weights[:, None] * widths
        if trial.point.sizes[3]:
            pulls = self.weights[:self.n_e, None] * (trial.tested.T @ trial.point.C_r.T)
            Q = _complement(pulls)
            F = np.concatenate([Q.T @ F[:self.n_e], F[self.n_e:]])
            J = np.vstack([Q.T @ J[:self.n_e], J[self.n_e:]])
        return F, J, widths

    def _limited(self, trial: Trial, step: np.ndarray, widths: np.ndarray) -> tuple[float, np.ndarray]:
        n = trial.directions.shape[1]
        turns = np.abs((trial.directions @ (step * widths)[:n])[self.turning]).max(initial=0.0)
        factor = LARGEST_TURN / turns if turns > LARGEST_TURN else 1.0
        return factor, factor * step

    def _moved(self, trial: Trial, step: np.ndarray) -> Trial | None:
        """The next state; None where the equations cannot be evaluated."""
        point, selection = trial.point, self.selection
        names = self.module.metadata
        n = trial.directions.shape[1]
        n_z = len(selection.states)
        x = point.x.copy()
        x[:len(point.q)] = point.moved(trial.directions @ step[:n])
        x = selection.apply(x)
        start = len(x) - point.sizes[2]
        for k, change in zip(selection.states, step[n:n + n_z], strict=True):
            x[start + k] += change
        p, inputs = point.p.copy(), point.inputs.copy()
        for k, name in enumerate(selection.parameters):
            p[names.parameters.index(name)] += step[n + n_z + k]
        for k, name in enumerate(selection.inputs):
            inputs[names.inputs.index(name)] += step[n + n_z + len(selection.parameters) + k]
        new = Trial(point.at(x=x, p=p, inputs=inputs), selection)
        try:
            new = self._closed(new).with_multipliers(self.weights[:self.n_e])
            new.residual(), new.derivative()
        except EvaluationError:
            return None
        return new


def _complement(A: np.ndarray) -> np.ndarray:
    """Orthonormal columns Q with Q^T A = 0."""
    U, values, _ = np.linalg.svd(A)
    rank = int((values > RANK * values.max(initial=0.0)).sum())
    rest: np.ndarray = U[:, rank:]
    return rest


def _damped(along: np.ndarray, values: np.ndarray, radius: float) -> np.ndarray:
    """(s / (s^2 + mu)) along with the smallest mu >= 0 that keeps its norm within the radius."""
    if _length(along / values) <= radius:
        return np.asarray(along / values)
    low, high = -40.0, 40.0
    for _ in range(60):
        middle = (low + high) / 2
        if _length(along * values / (values**2 + np.exp(middle) * values[0]**2)) > radius:
            low = middle
        else:
            high = middle
    return np.asarray(along * values / (values**2 + np.exp(high) * values[0]**2))


def _length(step: Any) -> float:
    return float(np.linalg.norm(step))
