"""A motion that was integrated together with others: its states at the output times, and what follows from these."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.runtime.inputs.inputs import Inputs
from symdyn.runtime.integrating.outcome import Outcome
from symdyn.runtime.solutions.solution import Solution

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Members of a Solution that only a run of its own counts, times or notes.
NOT_KEPT = ("nfev", "njev", "nlu", "seconds", "integrator_seconds", "doubts", "corrections")


class StatesOnly(Solution):
    """A motion with its states at output times, steps, parameters and inputs, and all that is computed from these.

    Other results of a run of its own raise ArgumentError: see NOT_KEPT; states at other times do so already.
    """

    def __init__(self, module: Module, t: np.ndarray, x: np.ndarray, steps: tuple[int, int], params: np.ndarray,
                 inputs: np.ndarray, method: str, tolerances: tuple[float, float]) -> None:
        """steps: those of the integrator, accepted and rejected."""
        outcome = Outcome(t, x, True, "reached the end", False, *steps, 0)
        super().__init__(module, outcome, params, Inputs(inputs), method, math.nan, tolerances=tolerances)
        for name in NOT_KEPT:
            del self.__dict__[name]

    def __getattr__(self, name: str) -> Any:
        if name in NOT_KEPT:
            raise ArgumentError(f"{self.module.name}: {name} is not known of a motion that was integrated together with others; "
                                "there are t, x, params, inputs, n_steps, n_rejected, and what is computed from these, such as "
                                "outputs and energy; leave device out, so that functions get motions of their own")
        raise AttributeError(f"{type(self).__name__!r} has no attribute {name!r}")
