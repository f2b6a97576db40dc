"""Impact of one contact in a plane with friction and Stronge's energetic restitution, by Routh's method.

The normal impulse p goes on from zero, and the velocities change with it as with forces: v' = D [1, f], where the friction f is
-mu against the slip, or what holds the contact without slip. Each of these is a straight line in p. Of the work that
compression takes, the integral of v_N over p while v_N < 0, expansion gives back the part e^2.

Source: Stronge, Rigid body collisions with friction, Proc. R. Soc. A 431 (1990), 169; Routh, Dynamics of a System of Rigid
Bodies, volume I, article 187.
"""

from __future__ import annotations

import math

import numpy as np

from symdyn.runtime.contact_laws import SLIDING, STICKING, Mode, Site, Solved

# Pieces of an impact: slip before it stops, after that, each of compression and expansion, and again where friction jams.
MOST_PIECES = 12
# A slip below this part of the velocities is none.
NO_SLIP = 1e-12


def stronge(D: np.ndarray, v: np.ndarray, restitution: float, site: Site) -> Solved | None:
    """What an impact does: impulses and velocities after it; None where it comes to no end.

    v   before it, along the normal and, with friction, the tangent
    """
    n = len(v)
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
