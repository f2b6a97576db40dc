"""Programs side by side: that they compute the same, and their times."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from symdyn.errors import SymdynError
from symdyn.lab.peers.program import Program
from symdyn.timing.loops import best_times

# Accelerations may differ by rounding times the condition number of the mass matrix; a wrong model differs by far more.
AGREEMENT = 1e-7


def agree(programs: Sequence[Program], model: str, what: str = "accelerations") -> float:
    """Largest difference of the programs' results from those of the first, relative to their norm; what: they are called.

    The same of multipliers, of those that compute them. Raises SymdynError if they do not compute the same.
    """
    for program in programs:
        program.run(1)
    worst = _difference([(c.name, c.result()) for c in programs], what, model)
    return max(worst, _difference([(c.name, c.multipliers()) for c in programs if c.multipliers], "multipliers", model))


def _difference(results: Sequence[tuple[str, np.ndarray]], what: str, model: str) -> float:
    worst = 0.0
    for name, result in results[1:]:
        first, wanted = results[0]
        difference = float(np.linalg.norm(result - wanted) / np.linalg.norm(wanted))
        if not difference <= AGREEMENT:
            raise SymdynError(f"{model}: {name} and {first} do not compute the same {what}, {result} and "
                              f"{wanted}: they differ by {difference:.2g} of their norm, more than {AGREEMENT:.0e}; look for a "
                              "difference between the models that they were given")
        worst = max(worst, difference)
    return worst


def timed(programs: Sequence[Program], repeats: int) -> dict[str, float]:
    """Seconds of one evaluation of each program, the best of its timings; they take turns."""
    times = best_times([program.run for program in programs], repeats)
    return {program.name: time for program, time in zip(programs, times, strict=True)}
