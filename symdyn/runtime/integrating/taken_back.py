"""Steps of SciPy's solvers that are given up after they were taken."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def take_back(solver: Any, before: Mapping[str, Any], length: float) -> None:
    """Undo the latest step of a solver; the next one to be tried has this length, s.

    before   the attributes before the step; what is counted goes on from the step, and factors that are kept are those of another
             length
    """
    attributes = vars(solver)
    counts = {name: attributes[name] for name in ("nfev", "njev", "nlu")}
    factors = {name: None for name in ("LU_real", "LU_complex") if name in attributes}
    attributes.update({**before, **counts, **factors, "h_abs": length})
