"""Impact of one contact with friction and Stronge's energetic restitution, by Routh's method.

The normal impulse p goes on from zero, and the velocities change with it as with forces: v' = D [1, f], where the friction f is
-mu against the slip, or what holds the contact without slip. Expansion gives back, of the work that compression takes, the
integral of v_N over p while v_N < 0, the part e^2.

In a plane each piece is a straight line in p. In space the direction phi of the slip turns as it goes on. With dp = |s| dsigma

    d ln|s| / dsigma = d a,   dphi / dsigma = d' a,   a = D_TN - mu D_TT d

is smooth up to where the slip stops, at sigma = infinity, along a direction with d' a = 0. From there the contact sticks if
static friction holds it; else it slips on in the one direction that a has itself, along a straight line again.

Source: Stronge, Rigid body collisions with friction, Proc. R. Soc. A 431 (1990), 169, and Impact Mechanics, 2000, chapter 4;
Routh, Dynamics of a System of Rigid Bodies, volume I, article 187; Bhatt and Koechling, Three-dimensional frictional rigid-body
impact, J. Applied Mechanics 62 (1995), 893 (the directions of slip).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from symdyn.runtime.contact_laws import SLIDING, STICKING, Mode, Site, Solved
from symdyn.runtime.shared_forces import least_solution
from symdyn.thresholds import DEPENDENT

# Pieces of an impact: slip before it stops, after that, each of compression and expansion, and again where friction jams.
MOST_PIECES = 12
# A slip below this part of the velocities is none; in space it turns until it is below STILL of them.
NO_SLIP, STILL = 1e-12, 1e-14
# Directions among which the one in which a slip in space begins is looked for; how far one piece goes in sigma at most, by the
# size of a; Newton steps for its end.
DIRECTIONS, FAR, STEPS = 64, 1e6, 3


def stronge(D: np.ndarray, v: np.ndarray, restitution: float, site: Site) -> Solved | None:
    """Result of an impact: impulses and velocities after it; None where it comes to no end.

    v   before it, along the normal and, with friction, the tangents
    """
    n = len(v)
    if n == 3:
        return _InSpace(D, v, restitution, site).solved()
    now, lam = v.astype(float).copy(), np.zeros(n)
    slip = float(now[1]) if n > 1 else 0.0
    least = NO_SLIP * float(np.abs(v).max())
    direction = math.copysign(1.0, slip) if abs(slip) > least else 0.0
    taken = given = 0.0  # by compression, back by expansion
    for _ in range(MOST_PIECES):
        if n > 1 and direction == 0.0:
            now[1] = 0.0
        friction, direction = _friction(D, site, direction) if n > 1 else (0.0, 0.0)
        change = D @ np.array([1.0, friction][:n])
        ends = []  # impulses at which this piece ends
        if direction and now[1] * change[1] < 0:
            ends.append(-now[1] / change[1])
        if now[0] < 0 and change[0] > 0:
            ends.append(-now[0] / change[0])
        elif now[0] >= 0:
            back = _impulse_of_work(float(now[0]), float(change[0]), restitution**2 * taken - given)
            if back is not None and back <= min(ends, default=math.inf):
                lam += back * np.array([1.0, friction][:n])
                after = now + back * change
                if n > 1 and not direction:
                    after[1] = 0.0
                still = n > 1 and not direction
                return Solved((Mode(STICKING if still else SLIDING, np.full(n - 1, direction), True),), lam, after, False)
            if change[0] < 0:  # friction presses it down again
                ends.append(-now[0] / change[0])
        if not ends:
            return None
        step = float(min(ends))
        work = step * (now[0] + 0.5 * step * change[0])
        taken, given = taken - min(work, 0.0), given + max(work, 0.0)
        lam += step * np.array([1.0, friction][:n])
        stops = bool(direction) and step == ends[0] and now[1] * change[1] < 0
        turns = step == -now[0] / change[0] if change[0] else False
        now = now + step * change
        now[0] = 0.0 if turns else now[0]
        direction = 0.0 if stops else direction
    return None


def _friction(D: np.ndarray, site: Site, direction: float) -> tuple[float, float]:
    """Friction for each normal impulse, and the direction of slip, 0 where it sticks."""
    if direction:
        return -site.kinetic * direction, direction
    holds = -D[1, 0] / D[1, 1] if D[1, 1] > 0 else 0.0
    if abs(holds) <= site.static:
        return holds, 0.0
    begun = -math.copysign(1.0, holds)
    return -site.kinetic * begun, begun


def _impulse_of_work(v: float, slope: float, work: float) -> float | None:
    """The least p >= 0 with v p + slope p^2/2 = work; None where there is none."""
    if work <= 0.0:
        return 0.0
    square = v * v + 2.0 * slope * work
    if square < 0.0 or (slope <= 0.0 and v == 0.0):
        return None
    return 2.0 * work / (v + math.sqrt(square))


class _InSpace:
    """An impact with two tangents. y = [ln|s|, phi, v_N, p, work of this piece, friction impulses]."""

    def __init__(self, D: np.ndarray, v: np.ndarray, restitution: float, site: Site) -> None:
        self.D, self.square, self.site = D, restitution**2, site
        self.size = float(np.abs(v).max())
        self.v, self.lam = v.astype(float).copy(), np.zeros(3)
        self.taken = self.given = 0.0  # by compression, back by expansion

    def solved(self) -> Solved | None:
        slips = bool(np.hypot(*self.v[1:]) > NO_SLIP * self.size)
        for _ in range(MOST_PIECES):
            if slips:
                ended = self._turning()
                slips = bool(np.hypot(*self.v[1:]) > 2 * STILL * self.size)
                direction = self.v[1:] / np.hypot(*self.v[1:]) if slips else np.zeros(2)
            else:
                self.v[1:] = 0.0
                friction, direction = self._begins()
                ended = self._straight(friction, direction)
                slips = bool(direction.any())
            if ended is None:
                return None
            if ended:
                kind = SLIDING if slips else STICKING
                return Solved((Mode(kind, direction, True),), self.lam, self.v, False)
        return None

    def _begins(self) -> tuple[np.ndarray, np.ndarray]:
        """Friction for each normal impulse where nothing slips, and the direction in which slip begins, zero where it sticks."""
        D_T, across = self.D[1:, 1:], self.D[1:, 0]
        holds = least_solution(D_T, -across)
        if np.hypot(*holds) <= self.site.static and np.abs(D_T @ holds + across).max() <= DEPENDENT * np.abs(self.D).max():
            return holds, np.zeros(2)
        from scipy.optimize import brentq

        angles = 2 * np.pi * np.arange(DIRECTIONS + 1) / DIRECTIONS
        values = [self._rates(angle)[1] for angle in angles]
        between = zip(angles[:-1], angles[1:], values[:-1], values[1:], strict=True)
        roots = [float(brentq(lambda angle: self._rates(angle)[1], low, high, xtol=1e-15, rtol=1e-14))
                 for low, high, f, g in between if f * g <= 0 and f != g]
        best = max(roots, key=lambda angle: self._rates(angle)[0])
        direction = np.array([math.cos(best), math.sin(best)])
        return -self.site.kinetic * direction, direction

    def _rates(self, phi: float) -> tuple[float, float, float]:
        """d a, d' a, and the rate of v_N by p, of a direction of slip."""
        d = np.array([math.cos(phi), math.sin(phi)])
        along = self.D[:, 0] - self.site.kinetic * (self.D[:, 1:] @ d)
        return float(d @ along[1:]), float(d[0] * along[2] - d[1] * along[1]), float(along[0])

    def _straight(self, friction: np.ndarray, direction: np.ndarray) -> bool | None:
        """A piece with constant friction; True: the impact is over, None: it never is."""
        impulse = np.array([1.0, *friction])
        change = self.D @ impulse
        if not direction.any():
            change[1:] = 0.0
        normal, slope = float(self.v[0]), float(change[0])
        turns = -normal / slope if normal * slope < 0 else math.inf
        if normal >= 0:
            back = _impulse_of_work(normal, slope, self.square * self.taken - self.given)
            if back is not None and back <= turns:
                self._go(back, impulse, change)
                return True
        if turns == math.inf:
            return None
        self._count(turns * (normal + 0.5 * turns * slope))
        self._go(turns, impulse, change)
        self.v[0] = 0.0
        return False

    def _go(self, p: float, impulse: np.ndarray, change: np.ndarray) -> None:
        self.lam, self.v = self.lam + p * impulse, self.v + p * change

    def _count(self, work: float) -> None:
        self.taken, self.given = self.taken - min(work, 0.0), self.given + max(work, 0.0)

    def _turning(self) -> bool | None:
        """A piece in which the slip turns, to where compression or expansion ends, or the slip; as `_straight`."""
        from scipy.integrate import solve_ivp

        mu, normal = self.site.kinetic, float(self.v[0])
        scale = float(np.abs(self.D).max()) * (1 + mu)
        compresses = normal < 0 or (normal == 0 and self._rates(math.atan2(self.v[2], self.v[1]))[2] < 0)
        left = self.square * self.taken - self.given

        def rates(_: float, y: np.ndarray) -> list[float]:
            size = math.exp(y[0])
            radial, turning, change = self._rates(y[1])
            return [radial, turning, size * change, size, size * y[2], -mu * size * math.cos(y[1]), -mu * size * math.sin(y[1])]

        ends: list[Callable[..., Any]] = [lambda _, y: y[2], lambda _, y: y[0] - math.log(STILL * self.size)]
        if not compresses:
            if left <= 0 and normal >= 0:
                return True
            ends.append(lambda _, y: y[4] - left)
        directions = (1.0 if compresses else -1.0, -1.0, 1.0)
        for end, direction in zip(ends, directions, strict=False):
            end.terminal, end.direction = True, direction  # type: ignore[attr-defined]
        start = [math.log(math.hypot(*self.v[1:])), math.atan2(self.v[2], self.v[1]), normal, 0.0, 0.0, 0.0, 0.0]
        options: dict[str, Any] = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-15 * np.array(
            [1, 1, self.size, self.size / scale, self.size**2 / scale, self.size / scale, self.size / scale])}
        run = solve_ivp(rates, (0, FAR / scale), start, events=ends, **options)
        which = [k for k, times in enumerate(run.t_events) if len(times)]
        if run.status != 1 or not which:
            return None
        sigma, k, y = float(run.t[-1]), which[0], run.y[:, -1]
        for _ in range(STEPS):
            slope = rates(sigma, y)[(2, 0, 4)[k]]
            if slope == 0.0:
                break
            sigma -= float(ends[k](sigma, y)) / slope
            y = solve_ivp(rates, (0, sigma), start, **options).y[:, -1]
        self._count(float(y[4]))
        self.lam = self.lam + np.array([y[3], y[5], y[6]])
        size = math.exp(y[0])
        self.v = np.array([0.0 if k == 0 else y[2], size * math.cos(y[1]), size * math.sin(y[1])])
        return k == 2
