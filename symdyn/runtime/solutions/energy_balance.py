"""Where the energy of a motion comes from and goes to: the work of the loads, and by name what resets of events change and
what dry friction takes."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from symdyn.runtime.integrating.contacts import CONTACTS, rows_of
from symdyn.runtime.integrating.events import Happened

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

# Gauss's points on a panel, how often panels are halved at most, what two results agree to.
POINTS, HALVINGS, AGREE = 5, 6, 1e-10


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


def friction_energy(solution: Solution) -> dict[str, np.ndarray]:
    """Energy that friction of rigid contacts has given to the mechanism since the start, (n_t,), J, by the contact: negative.

    The power is integrated over the motion between its stored rows and the switches of modes by Gauss's method, on panels that
    are halved until the result is that of the panels before.
    """
    module = solution.module
    records, phases = module.metadata.contacts, solution._phases
    own = {record.name: list(rows[record.normal:]) for record, rows in zip(records, rows_of(records), strict=True)
           if record.tangents}
    k, n = 4 * len(records), sum(record.rows for record in records)
    if not own or not phases or len(solution.t) < 2:
        return {}
    starts = np.array([phase.t for phase in phases])
    edges = np.unique(np.concatenate([solution.t, starts[starts <= solution.t[-1]]]))
    points, weights = np.polynomial.legendre.leggauss(POINTS)
    before: np.ndarray | None = None
    for _ in range(HALVINGS):
        width = np.diff(edges)
        times = (edges[:-1, None] + width[:, None] * (1 + points) / 2).ravel()
        states, inputs = solution.states_and_inputs(times)
        power, within = np.zeros((len(times), len(own))), np.searchsorted(starts, times, "right") - 1
        for phase in np.unique(within):
            at = within == phase
            values = module.evaluate(CONTACTS, times[at], states[at], phases[phase].p, inputs[at])
            slips, forces = values[:, k:k + n], values[:, k + 2 * n:k + 3 * n]
            power[at] = np.stack([(forces[:, rows] * slips[:, rows]).sum(axis=1) for rows in own.values()], axis=1)
        panels = width[:, None] / 2 * np.tensordot(power.reshape(len(width), POINTS, -1), weights, (1, 0))
        summed = np.vstack([np.zeros(len(own)), np.cumsum(panels, axis=0)])[np.searchsorted(edges, solution.t)]
        if before is not None and np.abs(summed - before).max() <= AGREE * np.abs(summed).max():
            break
        before, edges = summed, np.unique(np.concatenate([edges, edges[:-1] + width / 2]))
    return {f"friction of {name}": rows for name, rows in zip(own, summed.T, strict=True) if rows.any()}


def _passed(solution: Solution, t: float, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Mask of the rows of a solution after a reset, (n_t,) of bool."""
    direction = 1.0 if solution.t[-1] >= solution.t[0] else -1.0
    passed = (solution.t - t) * direction > 0
    rows = np.flatnonzero(solution.t == t)
    nearer = np.linalg.norm(solution.x[rows] - after, axis=1) < np.linalg.norm(solution.x[rows] - before, axis=1)
    passed[rows] = np.maximum.accumulate(nearer)
    return np.array(passed)
