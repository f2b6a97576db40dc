"""Beginnings of slip in contacts.

Friction acts against the slip, whose direction is that of its acceleration where it begins; where the friction cone was left this
is against the friction force that held last. As the slip passes zero its direction is all but free: it turns by the rate of
friction over slip, mu N (J M^-1 J^T)/|v|, without bound. The motion is therefore integrated with held directions until the slip
is larger than the errors that the tolerances let pass, and the slip is put along the direction by the impulses that friction
would have had across it; in space then by an implicit method, in pieces that are each so many times as long as all before, until
the direction no longer turns faster than the motion goes on.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

# Times below this part of t are not resolved.
RESOLVED = 64 * float(np.finfo(float).eps)
# Slip up to which directions are held, by what the tolerances let pass and by rounding of the speeds.
TOLERATED, ROUNDED = 10.0, 1e4 * np.finfo(float).eps
# The shortest time until then, the first guess and the longest, by the length of the run; by how much guesses grow at most, how
# many there are, and by how much the slip may be larger than meant.
SHORTEST, GUESS, LONGEST, GROWS, GUESSES, LARGER = 1e-12, 1e-6, 1e-3, 100.0, 60, 4.0
# Pieces by an implicit method end after so many times the time since the slip began; its first step by that time.
PIECE, FIRST_STEP = 8.0, 0.1
# Rates of turning by the time since the slip began, up to which explicit methods go on.
GENTLE = 50.0


@dataclass
class SlipBegins:
    """Contacts whose slip has just begun.

    length     of the run, s
    directions   of those that are still held; since: when the slip began of each contact in space whose direction turns fast
    """

    length: float
    directions: dict[int, np.ndarray] = field(default_factory=dict)
    since: dict[int, float] = field(default_factory=dict)

    def switched(self, t: float, begins: Mapping[int, np.ndarray], sliding: Mapping[int, bool]) -> None:
        """Note a switch: contacts that begin to slip with their directions, and all that slide, with whether in space."""
        self.directions = dict(begins)
        self.since = {k: t if k in begins else self.since[k] for k, space in sliding.items()
                      if space and (k in begins or k in self.since)}

    def shortest(self, t: float) -> float:
        """The shortest time from t on that is looked at, s."""
        return max(SHORTEST * self.length, RESOLVED * abs(t))

    def held_until(self, t: float, x: np.ndarray, rate: Callable[[float, np.ndarray], np.ndarray],
                   slips: Callable[[float, np.ndarray], Mapping[int, np.ndarray]], tolerated: float) -> float:
        """Until when directions are held; rate: x_dot with them, slips: of contacts at a state, tolerated: an error of these."""
        wanted = TOLERATED * tolerated + ROUNDED * float(np.abs(x).max(initial=0.0))
        shortest = self.shortest(t)
        after, most = max(GUESS * self.length, shortest), LONGEST * self.length
        f = rate(t, x)
        for _ in range(GUESSES):
            ahead = x + after / 2 * (f + rate(t + after, x + after * f))
            result = slips(t + after, ahead)
            slip = min(float(result[k] @ d) for k, d in self.directions.items())
            if slip > LARGER * wanted and after > shortest:
                after = max(shortest, after * 2 * wanted / slip)
            elif slip >= wanted or after >= most or slip < -wanted:
                break
            else:
                after = min(most, after * min(GROWS, max(1.5, float(np.sqrt(2 * wanted / max(slip, 1e-300))))))
        return t + after

    def piece(self, t: float) -> tuple[float, float]:
        """Until when a piece by an implicit method goes on from t, and its first step."""
        passed = max(t - max(self.since.values()), SHORTEST * self.length)
        return t + PIECE * passed, FIRST_STEP * passed

    def settled(self, t: float, turning: Mapping[int, float]) -> None:
        """Forget contacts whose direction turns at a rate, 1/s, that is no longer fast."""
        self.since = {k: since for k, since in self.since.items() if turning[k] * (t - since) > GENTLE}
