"""Reference of errors: a closed form, a stored or fresh run with more digits than floats have, or two runs that agree."""

from __future__ import annotations

import math
import textwrap
import time as clock
import warnings
from collections.abc import Callable, Sequence

import numpy as np

from symdyn.bench.work import store
from symdyn.bench.work.converged import converged, expected_seconds
from symdyn.bench.work.record import Reference
from symdyn.bench.work.system_under_test import Comparison, Formulation, SystemUnderTest
from symdyn.errors import CompileError, SimulationWarning, SymdynError

# Seconds that a run with more digits may take where no budget is given.
PATIENCE = 120.0
# Output times of a reference.
N_TIMES = 10
# Runs of which two must agree: tolerances of each formulation with each method.
_TIGHT = (1e-12, 1e-13, 1e-14)
_METHODS = ("dop853", "Radau", "DOP853")
_SECONDS_OF_SCIPY = 20.0
# Characters of a reason that are reported on the way; where there is no reference, all of it is reported, once.
_SHOWN = 160


def default_times(tested: SystemUnderTest) -> list[float]:
    """Ten times, evenly over the motion, the last of them its end, and those that are requested, s."""
    even = [tested.end * k / N_TIMES for k in range(1, N_TIMES + 1)]
    return sorted({*even, *[float(t) for t in tested.at]})


def find_reference(tested: SystemUnderTest, formulations: Sequence[Formulation], seconds: float = PATIENCE,
                   log: Callable[[str], None] = lambda text: None, until: float = math.inf) -> Reference:
    """The best reference that there is, or that can be made within about so many seconds.

    until  of time.perf_counter, after which no run is begun but for the two that must agree
    log   called with one line at each stage
    Raises SymdynError where nothing gives a reference.
    """
    first, times = formulations[0], default_times(tested)
    if tested.closed is not None:
        return Reference("closed form", tuple(times), tested.closed(times), 15.9, tested.source, first.coordinates)
    result = store.find(tested.name, first, times)
    if result is not None:
        return result
    why = ""
    try:
        expected = expected_seconds(first, tested.end)
        if expected > seconds:
            why = f"a run with more digits would take about {expected:.0f} s"
        else:
            log(f"a reference with more digits is made, about {expected:.0f} s; it is kept")
            reference, text = converged(first, times, until=min(until, clock.perf_counter() + 2 * seconds))
            store.keep(first, reference, text)
            return reference
    except SymdynError as error:
        why = str(error)
    log(f"{textwrap.shorten(why.splitlines()[0].rstrip('.'), _SHOWN)}: taken are the two tightest runs that agree")
    return agreement(formulations, times, why, until)


def agreement(formulations: Sequence[Formulation], times: Sequence[float], why: str, until: float = math.inf) -> Reference:
    """The two tight runs of different formulations or methods that agree best: the second of them, with the digits of the
    agreement.

    until   as of find_reference
    Raises SymdynError if there are no two, CompileError if none can be compiled.
    """
    first, broken = formulations[0], None
    runs: list[tuple[Formulation, str, float, np.ndarray]] = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)
        for formulation in formulations:
            begun = clock.perf_counter()
            for method in _METHODS:
                if method != "dop853" and clock.perf_counter() - begun > _SECONDS_OF_SCIPY:
                    continue
                for rtol in _TIGHT if method == "dop853" else _TIGHT[:1]:
                    made = {(f.coordinates, other) for f, other, *_ in runs}
                    if clock.perf_counter() > until and (len(made) > 1 or (formulation.coordinates, method) in made):
                        continue
                    try:
                        sol = formulation.module.simulate(np.r_[0.0, times], rtol=rtol, method=method)
                    except CompileError as error:
                        broken = error
                        continue
                    except SymdynError:
                        continue
                    if sol.success:
                        runs.append((formulation, method, rtol, sol.x[1:]))
    best: tuple[float, str, int] | None = None
    for k, (formulation, method, rtol, x) in enumerate(runs):
        if formulation.coordinates != first.coordinates:
            continue
        comparison = Comparison(Reference("agreement", tuple(times), x.tolist(), 0.0, ""), formulation)
        for other, other_method, other_rtol, y in runs:
            if (other.coordinates, other_method) == (formulation.coordinates, method):
                continue  # the same errors of the same steps, however near they are
            differ = float(np.max(comparison.errors(other, y)))
            if math.isfinite(differ) and (best is None or differ < best[0]):
                best = differ, (f"{formulation.name} with {method} at {rtol:g} and {other.name} with {other_method} at "
                                f"{other_rtol:g} differ by {differ:.1e}"), k
    if not runs and broken is not None:
        raise broken
    if best is None:
        raise SymdynError(f"{first.equations.name}: there is no reference: {why}, and no two runs of different formulations or "
                          "methods got to the end; shorten the motion, or look at why they stop")
    return Reference("agreement", tuple(times), runs[best[2]][3].tolist(), -math.log10(max(best[0], 1e-16)),
                     f"{best[1]} ({why})", first.coordinates, True)
