"""One row: a motion run several times for its time, once for its errors."""

from __future__ import annotations

import statistics
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from symdyn.bench.work.against.peer import Peer, Runner
from symdyn.bench.work.record import NAN, Row
from symdyn.bench.work.subject import Formulation, Yardstick
from symdyn.errors import ArgumentError, SimulationWarning, SymdynError

# Seconds after which a run is not repeated any more; short runs are repeated for as long as MUCH s, but MOST times as often as
# asked at most: on a machine with other work a median of few of them tells nothing.
ENOUGH, MUCH, MOST = 2.0, 0.03, 8
# Output times, besides those of the reference, at which energy and constraints are looked at.
N_LOOKS = 100
# Tolerance of methods with steps of one length: of what they iterate to.
_ITERATED = 1e-13


def own(formulation: Formulation, method: str, tolerance: float | None, step: float | None, yardstick: Yardstick,
        repeats: int) -> Row:
    """A row of one of our methods or SciPy's; where a run stops, its message says why.

    Raises ArgumentError where the method does not take the mechanism.
    """
    row = Row(formulation.name, method, tolerance, step)
    given: dict[str, Any] = {"method": method, "rtol": tolerance or _ITERATED}
    if step is not None:
        given |= {"first_step": step, "max_step": step}
    end = yardstick.times[-1]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)  # it is in the row
        try:
            sol = formulation.module.simulate(_looks(yardstick.times), **given)
            seconds: list[float] = []
            while sol.success and _again(seconds, repeats):
                timed = formulation.module.simulate(np.array([0.0, end]), **given)
                seconds.append(timed.seconds if timed.integrator_seconds is None else timed.integrator_seconds)
            energy = _energy_error(formulation, sol, given)
        except ArgumentError:
            raise
        except SymdynError as error:
            return Row(*row.key, message=str(error))
    places = np.searchsorted(sol.t, yardstick.times[yardstick.times <= sol.t[-1]]) if sol.success else np.zeros(0, dtype=int)
    q, u = yardstick.errors(formulation, sol.x[places])
    worse = np.fmax(q, u)
    return Row(*row.key, statistics.median(seconds) if seconds else NAN, min(seconds, default=NAN), len(seconds),
               sol.nfev, sol.n_steps, sol.nfev * formulation.operations, float(worse[-1]), float(q[-1]), float(u[-1]),
               tuple(worse.tolist()), energy, _constraint_error(formulation, sol), message="" if sol.success else sol.message)


def peer_row(peer: Peer, formulation: Formulation, runners: Sequence[tuple[float, Runner]], tolerance: float,
             yardstick: Yardstick, repeats: int) -> Row:
    """A row of another program.

    runners   time and what runs the motion until then; the last one runs it to the end, and is timed
    """
    row = Row(formulation.name, peer.name, tolerance, None)
    run = runners[-1][1]
    errors = np.full((2, len(yardstick.times)), NAN)
    try:
        seconds: list[float] = []
        while _again(seconds, repeats):
            took, evaluations, x = run(tolerance)
            seconds.append(took)
        for t, shorter in runners:
            index = int(np.flatnonzero(np.isclose(yardstick.times, t, rtol=1e-12, atol=0.0))[0])
            state = x if shorter is run else shorter(tolerance)[2]
            alone = np.full((index + 1, len(state)), NAN)
            alone[index] = state
            for k, part in enumerate(yardstick.errors(formulation, alone)):
                errors[k, index] = part[index]
    except Exception as error:  # whatever another program raises is told as its own
        return Row(*row.key, peer=True, message=str(error) or type(error).__name__)
    worse = np.fmax(*errors)
    return Row(*row.key, statistics.median(seconds), min(seconds), len(seconds), evaluations, 0, 0, float(worse[-1]),
               float(errors[0, -1]), float(errors[1, -1]), tuple(worse.tolist()), peer=True,
               message="" if np.isfinite(worse[-1]) else "the state at the end is not finite")


def _again(seconds: Sequence[float], repeats: int) -> bool:
    """Whether one more timed run is due."""
    n = len(seconds)
    return not seconds or (sum(seconds) < ENOUGH and (n < repeats or (n * min(seconds) < MUCH and n < MOST * repeats)))


def _looks(times: np.ndarray) -> np.ndarray:
    """The reference's times, and even ones between that do not all but coincide with them."""
    even = np.linspace(0.0, times[-1], N_LOOKS + 1)
    apart = np.abs(even[:, None] - times[None, :]).min(axis=1) > 1e-9 * times[-1]
    return np.sort(np.concatenate((even[apart], times)))


def _energy_error(formulation: Formulation, sol: Any, given: dict[str, Any]) -> float:
    """Of the run itself; where loads do work, of one that integrates it along."""
    if not sol.success:
        return NAN
    try:
        if not formulation.module.metadata["conservative"]:
            sol = formulation.module.simulate(sol.t, **given, work=True)
        return float(sol.energy_error())
    except ArgumentError:  # equations by hand, which do not tell the energy
        return NAN


def _constraint_error(formulation: Formulation, sol: Any) -> float:
    metadata = formulation.module.metadata
    worst = [float(np.abs(sol.constraint_violation).max(initial=0.0))] if metadata["constraints"] else []
    for group in metadata.get("unit_groups", ()):
        places = [metadata["x"].index(name) for name in group]
        worst.append(float(np.abs(np.linalg.norm(sol.x[:, places], axis=1) - 1).max(initial=0.0)))
    return max(worst, default=NAN)
