"""Ends of slips in space, where derivatives are requested.

Friction acts against the slip v, so that a change of v across it decays as mu N (J M^-1 J^T)/|v|: faster and faster as the slip
comes to its end, without bound. A change that is left at the time tau before the end decays as tau^p, p = mu N g/|v_dot|, and no
step of one length follows that. So steps become shorter in proportion to the time that is left; and a last stretch, in which
rounding and tolerances would turn the direction, begins where the change across the slip is put to zero by the impulses that
friction has across it, after which the direction is held: what that leaves out of positions is the part tau^(p + 1). The motion
itself is not changed by any of this.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

# The last stretch begins where the slip is so many times what its tolerances let pass; its least part of the phase, and the one
# from which on it is all of that.
NOISE, LEAST, MOST = 100.0, 1e-8, 0.1
# Effect of rounded speeds on the direction of a slip, by their size over the slip; their effect on slips counts as so many times
# that in addition to tolerances.
ROUNDED, NOISY = 10 * np.finfo(float).eps, 1e4
# The shortest last stretch by the time at which it ends.
SHORTEST = 1e3 * np.finfo(float).eps


@dataclass
class SlipEnds:
    """The last stretch of a phase: when it begins, when the slips end, the contacts in space whose slips do so, and parameters
    that hold directions of friction in it.

    Nothing is known of the phase before its end was looked for: both times are infinite.
    """

    begins: float = np.inf
    ends: float = np.inf
    contacts: tuple[int, ...] = ()
    held: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def found(self, t: float, end: float, slips: Mapping[int, float], tolerated: Mapping[int, float]) -> None:
        """Note that the slips of contacts, m/s at t, come to their end; tolerated: what the tolerances let pass of each."""
        part = max(NOISE * tolerated[k] / max(slip, 1e-300) for k, slip in slips.items())
        part = max(part, SHORTEST * abs(end) / (end - t) if end > t else MOST)
        self.begins, self.ends = t if part >= MOST else end - max(part, LEAST) * (end - t), end
        self.contacts = tuple(slips)
