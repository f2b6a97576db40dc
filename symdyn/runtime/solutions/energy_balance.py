"""Where the energy of a motion comes from and goes to: the work of the loads, and by name what resets of events change."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from symdyn.runtime.integrating.events import Happened

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution


def reset_energy(solution: Solution, happened: list[Happened]) -> dict[str, np.ndarray]:
    """Energy that the resets of events have added to the mechanism since the start of the run, (n_t,), J, by the event's name;
    negative where they take it away. Events that reset the state at one time share one entry, "a + b".

    At the time of a reset itself a row counts as before or after it by the state it has.
    """
    records = solution.module.metadata.events
    resetting = [one for one in happened if records[one.event].reset or not np.array_equal(one.before, one.after)]
    groups = [list(group) for _, group in groupby(resetting, key=lambda one: (one.t, one.before.tobytes()))]
    changes: dict[str, np.ndarray] = {}
    if not groups:
        return changes
    n_x = solution.module.metadata.sizes.x
    times = np.array([group[0].t for group in groups])
    before = np.array([group[0].before[:n_x] for group in groups])
    after = np.array([group[0].after[:n_x] for group in groups])
    gained = solution.energy_at(times, after) - solution.energy_at(times, before)
    for group, t, x_before, x_after, change in zip(groups, times, before, after, gained, strict=True):
        name = " + ".join(records[one.event].name for one in group)
        total = changes.setdefault(name, np.zeros(len(solution.t)))
        total[_passed(solution, t, x_before, x_after)] += change
    return changes


def _passed(solution: Solution, t: float, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Which rows of a solution lie after a reset, (n_t,) of bool."""
    direction = 1.0 if solution.t[-1] >= solution.t[0] else -1.0
    passed = (solution.t - t) * direction > 0
    rows = np.flatnonzero(solution.t == t)
    nearer = np.linalg.norm(solution.x[rows] - after, axis=1) < np.linalg.norm(solution.x[rows] - before, axis=1)
    passed[rows] = np.maximum.accumulate(nearer)
    return np.array(passed)
