"""One row: a motion run several times for its time, once for its errors."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from symdyn.bench.work.against.apart import Prepared, TooLong
from symdyn.bench.work.against.peer import Peer, taken_as
from symdyn.bench.work.methods import AUTO, SERIES
from symdyn.bench.work.record import NAN, Row
from symdyn.bench.work.system_under_test import Comparison, Formulation
from symdyn.bench.work.timing import Timing, one_pass, seconds_of
from symdyn.errors import ArgumentError, SimulationWarning, SymdynError

# Output times, besides those of the reference, at which energy and constraints are looked at.
N_LOOKS = 100
# Tolerance of methods with steps of one length: of what they iterate to.
_ITERATED = 1e-13


def own(formulation: Formulation, method: str, tolerance: float | None, step: float | None, comparison: Comparison,
        repeats: int, at: Sequence[float] = (), timing: Timing | None = None) -> Row:
    """A row of one of our methods or SciPy's; where a run stops, its message says why.

    at   times of the reference, s, until which the motion is run and timed alone, too;  timing: filled, to go on with
    Raises ArgumentError where the method does not take the mechanism.
    """
    row = Row(formulation.name, method, tolerance, step)
    given: dict[str, Any] = {"method": method, "rtol": tolerance or _ITERATED}
    if step is not None:
        given |= {"first_step": step, "max_step": step}
    end = float(comparison.times[-1])
    timing = timing or Timing()

    def run(until: float, wanted: int) -> tuple[list[float], int]:
        evaluations = [0]

        def one() -> float:
            timed = formulation.module.simulate(np.array([0.0, until]), **given)
            evaluations[:] = [timed.nfev]
            return seconds_of(timed)

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SimulationWarning)
            return one_pass(one, wanted), evaluations[0]

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)  # it is in the row
        try:
            sol = formulation.module.simulate(_looks(comparison.times), **given)
            if sol.success:
                for t in dict.fromkeys((*at, end)):
                    timing.add(_index(comparison, t), lambda wanted, t=t: run(t, wanted), repeats)  # type: ignore[misc]
            energy = _energy_error(formulation, sol, given)
        except ArgumentError:
            raise
        except SymdynError as error:
            return Row(*row.key, message=str(error))
    places = np.searchsorted(sol.t, comparison.times[comparison.times <= sol.t[-1]]) if sol.success else np.zeros(0, dtype=int)
    q, u = comparison.errors(formulation, sol.x[places])
    worse = np.fmax(q, u)
    row = Row(*row.key, evaluations=sol.nfev, steps=sol.n_steps, error=float(worse[-1]), error_q=float(q[-1]),
              error_u=float(u[-1]), errors=tuple(worse.tolist()), energy_error=energy,
              constraint_error=_constraint_error(formulation, sol), message="" if sol.success else sol.message)
    row = timing.reported(row, len(comparison.times)) if sol.success else row
    if method == AUTO:
        row = replace(row, chosen=sol.method, why=sol.why)
    return row if SERIES in (row.method, row.chosen) else replace(row, operations=row.evaluations * formulation.operations)


def peer_row(peer: Peer, formulation: Formulation, ready: Prepared, ends: Sequence[float], tolerance: float,
             comparison: Comparison, repeats: int, timing: Timing | None = None) -> Row:
    """A row of another program.

    ready   it, prepared to run the motion until each of the times `ends`, the last of which is the motion's
    timing  filled, to go on with
    Raises TooLong.
    """
    row = Row(taken_as(peer, formulation.name), peer.name, tolerance, None)
    errors = np.full((2, len(comparison.times)), NAN)
    timing = timing or Timing()
    try:
        for place, t in enumerate(ends):
            states: list[np.ndarray] = []

            def one(wanted: int, place: int = place, states: list[np.ndarray] = states) -> tuple[list[float], int]:
                seconds, evaluations, x = ready.timed(place, tolerance, wanted)
                states[:] = [x]
                return seconds, evaluations

            index = _index(comparison, t)
            timing.add(index, one, repeats)
            alone = np.full((index + 1, len(states[0])), NAN)
            alone[index] = states[0]
            for k, part in enumerate(comparison.errors(formulation, alone)):
                errors[k, index] = part[index]
    except TooLong:
        raise
    except Exception as error:  # whatever another program raises is reported as its own
        return Row(*row.key, peer=True, message=str(error) or type(error).__name__)
    worse = np.fmax(*errors)
    row = Row(*row.key, error=float(worse[-1]), error_q=float(errors[0, -1]), error_u=float(errors[1, -1]),
              errors=tuple(worse.tolist()), peer=True,
              message="" if np.isfinite(worse[-1]) else "the state at the end is not finite")
    return timing.reported(row, len(comparison.times))


def _index(comparison: Comparison, t: float) -> int:
    return next(k for k, known in enumerate(comparison.times) if math.isclose(known, t, rel_tol=1e-12))


def _looks(times: np.ndarray) -> np.ndarray:
    """The reference's times, and even ones between that do not all but coincide with them."""
    even = np.linspace(0.0, times[-1], N_LOOKS + 1)
    apart = np.abs(even[:, None] - times[None, :]).min(axis=1) > 1e-9 * times[-1]
    return np.sort(np.concatenate((even[apart], times)))


def _energy_error(formulation: Formulation, sol: Any, given: dict[str, Any]) -> float:
    """Energy error of the run itself; where loads do work, of one that integrates it along."""
    if not sol.success:
        return NAN
    try:
        if not formulation.module.metadata.conservative:
            sol = formulation.module.simulate(sol.t, **given, work=True)
        return float(sol.energy_error())
    except ArgumentError:  # equations by hand, which do not give the energy
        return NAN


def _constraint_error(formulation: Formulation, sol: Any) -> float:
    metadata = formulation.module.metadata
    worst = [float(np.abs(sol.constraint_violation).max(initial=0.0))] if metadata.constraints else []
    for group in metadata.unit_groups:
        places = [metadata.x.index(name) for name in group]
        worst.append(float(np.abs(np.linalg.norm(sol.x[:, places], axis=1) - 1).max(initial=0.0)))
    return max(worst, default=NAN)
