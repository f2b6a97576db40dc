"""Ways to keep a motion on its constraints: those of a method, the projection of a state, Baumgarte's gain."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError
from symdyn.real_numbers import number_of
from symdyn.runtime.constraints import as_velocities, length, names
from symdyn.shown import shown
from symdyn.thresholds import (
    CLOSED,
    DEPENDENT,
    EXACT,
    FAILED,
    HOLDS,
    LEFT,
    NOTICED,
    PART_OF_SIZE,
    PART_OF_WAY,
    RESOLVED,
    ROUNDINGS,
    ROUNDS,
    SHRINKS,
    SLOWEST,
    TOO_MUCH_POSITION,
    TOO_MUCH_SPEED,
)
from symdyn.turning import is_angle

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

WAYS = ("projection", "baumgarte", "none")
# Positions that are further off than this part of the mechanism's length are no motion of it any more.
LOST = 1e-2
# Why the end of a step is not put onto the constraints though it could be.
TOO_FAR = "the correction would go further than half the step"


@dataclass(frozen=True)
class Stabilization:
    """One of WAYS; gain: Baumgarte's a, 1/s, 0: to be chosen; length: that residuals are measured by, m."""

    way: str = "none"
    gain: float = 0.0
    length: float = 1.0


@dataclass(frozen=True)
class Corrections:
    """Projections over a run: the largest change of q and of u after a step (norms), how many steps were changed
    noticeably, and how often the functions that compute corrections were evaluated."""

    position: float = 0.0
    speed: float = 0.0
    n_steps: int = 0
    n_evaluations: int = 0


class ProjectionFailed(EvaluationError):
    """A state cannot be projected onto the constraints."""


def choose(module: Module, asked: Any, one_step: bool, method: str, params: np.ndarray) -> Stabilization:
    """The way for a method; one_step: whether it takes a state that was changed after a step.

    Raises ArgumentError for what there is not, or what the method does not allow.
    """
    gain = 0.0
    way = asked
    if isinstance(asked, tuple) and len(asked) == 2 and isinstance(asked[0], str) and asked[0] == "baumgarte":
        way, gain = asked
        gain = number_of(gain, module.name, "Baumgarte's gain must be a positive number, 1/s")
        if not 0 < gain < np.inf:
            raise ArgumentError(f"{module.name}: Baumgarte's gain must be a positive number, 1/s, found {shown(gain)}")
    if way is not None and (not isinstance(way, str) or way not in WAYS):
        raise ArgumentError(f"{module.name}: stabilization {shown(asked)} asked for; there are 'projection', 'baumgarte', "
                            "('baumgarte', a) with a in 1/s, 'none', and None for what the method allows")
    constrained = bool(names(module))
    if way is None:
        way = "projection" if one_step else "baumgarte" if constrained else "none"
    if way == "projection" and not one_step:
        raise ArgumentError(f"{module.name}: {method} builds on earlier steps, which a projection would contradict; use "
                            "stabilization='baumgarte', or method='Radau' (stiff), 'DOP853' or 'dop853'")
    if way == "baumgarte" and not constrained:
        raise ArgumentError(f"{module.name}: there are no constraints; leave out stabilization={shown(asked)}")
    if way == "projection" and not constrained and not module.metadata.unit_groups:
        way = "none"
    return Stabilization(way, float(gain), length(module, params) if constrained else 1.0)


class Projector:
    """Projects states in Python, as the compiled integrator does it; for one run.

    largest   changes of q and u by a step so far (norms)
    """

    def __init__(self, module: Module, params: np.ndarray) -> None:
        self.module = module
        sizes = module.metadata.sizes
        self.n_q, self.n_u = sizes.q, sizes.u
        self.n_state: int = sizes.x
        self.n_c = len(names(module))
        self.groups = [[module.metadata.x.index(name) for name in group] for group in module.metadata.unit_groups]
        self.length = length(module, params) if self.n_c else 1.0
        self.velocities = as_velocities(module, params) if self.n_c else np.ones(self.n_u)
        units = module.metadata.units
        self.lengths = np.array([self.length if is_angle(units.get(q)) else 1.0 for q in module.metadata.q])
        self.n_evaluations, self.n_steps = 0, 0
        self.largest = np.zeros(2)
        self._evaluators = {}
        needed = ("position_correction", "velocity_correction", "violation",
                  *[name for name in ("reset_directions",) if name in module.functions])
        for name in needed if self.n_c else ():
            evaluator = self._evaluators[name] = module.library("rhs").evaluator(name)
            evaluator.set_params(params)

    def __call__(self, t: float, x: np.ndarray) -> np.ndarray:
        """The state x (n_x,) at time t, or with the work behind it, on the constraints; raises ProjectionFailed."""
        x = np.array(x, dtype=float)
        self._normalise(x)
        if self.n_c:
            self._correct(t, x)
        return x

    def keeping(self, t: float, x: np.ndarray, held: Sequence[int]) -> np.ndarray:
        """The state x (n_x,), or with the work behind it, after resets of its entries `held`, on the constraints: these stay, all
        others change by as little as can be in the metric of the mass matrix, first coordinates, then speeds.

        Raises ProjectionFailed, also where the constraints do not let an entry be what its reset makes it.
        """
        x = np.array(x, dtype=float)
        for group in self.groups:
            if not x[group].any():  # zeros have no direction
                raise ProjectionFailed(reset_rejected(self.module.metadata.x[group[0]], 1.0))
        self._normalise(x)
        middle = self.n_q + self.n_u
        if not self.n_c or not any(k < middle for k in held):
            return self(t, x)
        resets = {k for event in self.module.metadata.events for k in event.reset}
        known = [k for k in sorted(resets) if k < middle]  # in the order of reset_directions
        wanted, u = x.copy(), x[self.n_q:middle].copy()
        for part in (slice(0, self.n_q), slice(self.n_q, middle)):
            rows = [r for r, k in enumerate(known) if k in held and part.start <= k < part.stop]
            indices = [known[r] for r in rows]
            x[self.n_q:middle] = u
            x = self(t, x)
            self._close(t, x, wanted, rows, indices)
        return x

    def _close(self, t: float, x: np.ndarray, wanted: np.ndarray, rows: Sequence[int], indices: Sequence[int]) -> None:
        """Bring the entries `indices` of x to what is wanted, by Newton's method along `rows` of reset_directions."""
        if not indices:
            return
        of_speeds = indices[0] >= self.n_q
        factors = np.concatenate([self.lengths, self.velocities])
        sizes = np.abs(x[:len(factors)] * factors)
        asked = float((np.abs(wanted - x)[indices] * factors[indices]).max())
        size = max(SLOWEST * self.length, sizes[self.n_q:].max(), asked) if of_speeds else self.length
        allowed = TOO_MUCH_SPEED if of_speeds else max(TOO_MUCH_POSITION,
                                                       FAILED * RESOLVED * sizes[:self.n_q].max() / self.length)
        worst = np.inf
        for k in range(ROUNDS + 1):
            gaps = (wanted - x)[indices]
            before, parts = worst, np.abs(gaps) * factors[indices] / size
            worst, entry, left = float(parts.max()), indices[int(parts.argmax())], float(np.abs(gaps)[int(parts.argmax())])
            if worst <= CLOSED or worst > SHRINKS * before or k == ROUNDS:
                break
            try:
                directions = self.directions(t, x)[rows]
                x[:len(factors)] += self.impulses(directions, indices, gaps) @ directions
                x[:] = self(t, x)
            except ProjectionFailed:
                worst = np.inf
                break
        if worst > allowed:
            raise ProjectionFailed(reset_rejected(self.module.metadata.x[entry], left))

    def directions(self, t: float, x: np.ndarray) -> np.ndarray:
        """The function reset_directions, (n, n_q + n_u)."""
        return self._evaluate("reset_directions", t, x).reshape(-1, self.n_q + self.n_u)

    def impulses(self, directions: np.ndarray, indices: Sequence[int], gaps: np.ndarray) -> np.ndarray:
        """Impulses that close gaps (n, ...) of entries `indices` along their directions (n, n_q + n_u), likewise."""
        factors, n = np.concatenate([self.lengths, self.velocities]), len(indices)
        own = np.diag(directions[:, indices]) * factors[indices]
        # Directions that would take the others a million times as far are held by the constraints.
        free = np.flatnonzero(HOLDS * own > np.abs(directions * factors).max(axis=1))
        result = np.zeros((n, *gaps.shape[1:]))
        result[free] = solve_open(directions[free][:, np.array(indices)[free]].T, gaps[free])[0]
        return result

    def step(self, t: float, x: np.ndarray, start: np.ndarray, atol: np.ndarray, rtol: float) -> tuple[np.ndarray, bool]:
        """The same for the end x of a step from the state `start`, and whether it is a change to speak of, given the tolerances;
        raises ProjectionFailed, too, where the way to the constraints is more than half the step's."""
        result, middle = self(t, x), self.n_q + self.n_u
        change = np.abs(result - x)
        changes = [np.linalg.norm(change[:self.n_q]), np.linalg.norm(change[self.n_q:middle])]
        most = PART_OF_WAY * np.linalg.norm(x[:self.n_q] - start[:self.n_q]) + PART_OF_SIZE * np.linalg.norm(result[:self.n_q])
        if changes[0] > most + PART_OF_SIZE * self.length * (self.n_c > 0):
            raise ProjectionFailed(f"no way back onto the constraints: {TOO_FAR}")
        rounding = np.zeros(len(x))
        for part in (slice(0, self.n_q), slice(self.n_q, middle)):
            rounding[part] = ROUNDINGS * np.finfo(float).eps * np.abs(result[part]).max(initial=0.0)
        moved = bool((change > NOTICED * (atol + rtol * np.abs(result)) + rounding).any())
        self.n_steps += moved
        self.largest = np.maximum(self.largest, changes)
        return result, moved

    @property
    def corrections(self) -> Corrections:
        return Corrections(float(self.largest[0]), float(self.largest[1]), self.n_steps, self.n_evaluations)

    def _normalise(self, x: np.ndarray) -> None:
        for group in self.groups:
            x[group] /= np.linalg.norm(x[group])

    def _correct(self, t: float, x: np.ndarray) -> None:
        """Corrections until residuals are at rounding level, or shrink no further."""
        q, u = x[:self.n_q], x[self.n_q:self.n_q + self.n_u]
        left, rounding = np.full(2, np.inf), np.full(2, LEFT)
        for _ in range(ROUNDS):
            before = left
            if left[0] > rounding[0]:
                row = self._evaluate("position_correction", t, x)
                if np.abs(row[:self.n_c]).max() > EXACT * self.length:
                    q += row[self.n_c:]
                    self._normalise(x)
            u += self._evaluate("velocity_correction", t, x)[self.n_c:]
            residuals = np.abs(self._evaluate("violation", t, x)).reshape(2, self.n_c)
            speed = max(SLOWEST * self.length, np.abs(u * self.velocities).max(initial=0.0))
            left = residuals.max(axis=1) / [self.length, speed]
            far = np.abs(q * self.lengths).max(initial=0.0) / self.length
            rounding = np.array([max(LEFT, RESOLVED * far), LEFT])
            if not ((left > rounding) & (left < SHRINKS * before)).any():
                break
        too_much = np.array([max(TOO_MUCH_POSITION, FAILED * rounding[0]), TOO_MUCH_SPEED])
        if (left > too_much).any():
            of_speeds = bool(left[0] <= too_much[0])
            worst = int(residuals[int(of_speeds)].argmax())
            raise ProjectionFailed("no way back onto the constraints: " + not_converged(
                names(self.module)[worst], float(residuals[int(of_speeds), worst]), of_speeds))

    def _evaluate(self, name: str, t: float, x: np.ndarray) -> np.ndarray:
        self.n_evaluations += name.endswith("correction")
        try:
            return self._evaluators[name].one(t, x[:self.n_state], self.module.motions_at(t))
        except EvaluationError as error:
            raise ProjectionFailed(f"no way back onto the constraints: {error}") from None


class DriftCheck:
    """Looks whether Baumgarte's method still holds the constraints."""

    def __init__(self, module: Module, params: np.ndarray) -> None:
        self.module = module
        self.n_state: int = module.metadata.sizes.x
        self.length = length(module, params)
        self.evaluator = module.library("rhs").evaluator("violation")
        self.evaluator.set_params(params)

    def __call__(self, t: float, x: np.ndarray) -> str:
        """Message if a position is off by more than LOST, else nothing."""
        known = names(self.module)
        rows = np.abs(self.evaluator.one(t, x[:self.n_state], self.module.motions_at(t))[:len(known)]) / self.length
        worst = int(rows.argmax())
        if not rows[worst] > LOST:
            return ""
        return (f"{known[worst]} is violated by {rows[worst]:.3g} of the mechanism's length, which Baumgarte's method does not "
                "bring back; use a one-step method with stabilization='projection'")


def not_converged(constraint: str, residual: float, of_speeds: bool = False) -> str:
    """Message where corrections do not converge."""
    return f"{constraint} stays violated by {residual:.3g} m" + "/s" * of_speeds


def reset_rejected(entry: str, gap: float) -> str:
    """Message where a reset asks for what the constraints do not allow."""
    return (f"the constraints do not let {entry} be what the reset of an event makes it: the nearest is {gap:.3g} off; reset "
            "fewer coordinates and speeds, from which the others follow, or to values that the constraints allow")


def not_smooth(entry: str) -> str:
    """Message where sensitivities do not go across a reset that the constraints carry on; entry: what they do not let change
    as its reset does, "" where coordinates are off them."""
    if entry:
        return (f"the constraints allow what the reset of an event makes of {entry} at these numbers alone: it has no "
                "derivative; reset fewer coordinates and speeds, from which the others follow, or leave sensitivities out")
    return ("the reset of an event takes coordinates off the constraints and leaves some of them free, so that where they end "
            "has no derivative; reset as many as determine all others, or all of them to a position on the constraints")


def solve_open(G: np.ndarray, gaps: np.ndarray) -> tuple[np.ndarray, list[int]]:
    """f (n, ...) with G f = gaps for a positive semidefinite G, and the rows in the order in which they are taken: by elimination
    with the largest pivots, each relative to its entry of the diagonal. Rows that follow from others get zeros. Step by step what
    c/runtime/pivots.h does."""
    G, f, sizes, left, taken = G.copy(), gaps.astype(float), np.diag(G).tolist(), list(range(len(G))), list[int]()
    while left:
        most, best = DEPENDENT, -1
        for i in left:
            if G[i, i] > most * sizes[i]:
                most, best = G[i, i] / sizes[i], i
        if best < 0:
            break
        left.remove(best)
        taken.append(best)
        for i in left:
            factor = G[i, best] / G[best, best]
            f[i] -= factor * f[best]
            G[i] -= factor * G[best]
    for k in range(len(taken) - 1, -1, -1):
        i = taken[k]
        for other in taken[k + 1:]:
            f[i] -= G[i, other] * f[other]
        f[i] /= G[i, i]
    f[left] = 0.0
    return f, taken


def chosen_gain(trial: Callable[[], np.ndarray], span: tuple[float, float]) -> float:
    """Baumgarte's a, 1/s: one over twenty mean steps of a short trial run without stabilization.

    trial   gives the times of its steps; each step counts by its length, so that those do not that a method makes while it
            looks for its step, or near a singular position
    With alpha = beta = a violations decay as (1 + a t) exp(-a t). One over a single step, as usual for fixed steps, makes the
    error control shorten them. One over twenty costs few more, and violations stay near the tolerance: see
    `symdyn bench figures --only stabilization`.
    Source: Flores, Machado, Seabra, Silva, A parametric study on the Baumgarte stabilization method for forward dynamics of
    constrained multibody systems, ASME J. Comput. Nonlinear Dyn. 6 (2011).
    """
    steps = np.abs(np.diff(trial()))
    if not steps.any():
        steps = np.full(1, max(abs(span[1] - span[0]) / 100.0, float(np.finfo(float).tiny)))
    return float(steps.sum() / (20.0 * (steps @ steps)))
