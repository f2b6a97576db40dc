"""Results of a fit, their uncertainty, and what the data leave open."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symdyn.estimation.estimate import Estimate, combination, echelon

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from symdyn.estimation.minimum import Minimum
    from symdyn.estimation.problem import Problem
    from symdyn.given import PathName
    from symdyn.runtime.module import Module
    from symdyn.runtime.solutions.solution import Solution

@dataclass(frozen=True)
class Fit(Estimate):
    """Fitted values and how well the data determine them.

    values       label -> value: parameters by name, initial values as "q1(0)", of several experiments "q1(0) of experiment 2"
    covariance   (n, n), in the order of values; NaN in rows and columns of what the data do not determine and of what is on a
                 bound, which counts as known for the others. Priors count with the deviations that were given for them
    noise        standard deviation by what was measured, given or estimated
    misfit       of residuals by the degrees of freedom, in units of the noise: about 1 where a noise that was given is right; 1
                 where it was estimated
    undetermined   combinations of unknowns, relative to their guesses, that the data do not determine: text, from the singular
                 vectors of the derivatives; shares below a thousandth of the largest are left out. Among values that fit
                 equally well those nearest to the guesses are taken
    at_bounds    labels of values that the data press against a bound
    motions      of the experiments with these values; residuals: (experiment, what was measured) -> measured - model, (n_t, ...)
    success, message   whether the iteration ended at a minimum, and why it ended; n_runs: motions an experiment that it took
    degrees      of freedom: values measured less what they have determined of the unknowns, rounded where priors have determined
                 a part; known_noise: whether the noise was given

    >>> module = sd.systems.pendulum().compile()
    >>> truth = module.simulate(np.linspace(0, 2, 50), q=[0.5], params={"l": 1.3})
    >>> found = sd.fit(module, sd.Experiment(truth.t, {"q1": truth.q[:, 0]}), ["l"], ["q1"], start={"l": 1.2})
    >>> {name: round(value, 6) for name, value in found.values.items()}
    {'l': 1.3, 'q1(0)': 0.5}
    """

    module: Module
    values: Mapping[str, float]
    covariance: np.ndarray
    noise: Mapping[str, float]
    misfit: float
    undetermined: tuple[str, ...]
    at_bounds: tuple[str, ...]
    motions: tuple[Solution, ...]
    residuals: Mapping[tuple[int, str], np.ndarray]
    success: bool
    message: str
    n_runs: int
    degrees: int
    known_noise: bool

    @classmethod
    def of(cls, problem: Problem, result: Minimum) -> Fit:
        """From the minimum of a problem."""
        labels = [unknown.label for unknown in problem.unknowns]
        motions, residuals = problem.motions(result.x), problem.left(result.x)
        return cls(problem.module, dict(zip(labels, map(float, result.x), strict=True)), result.covariance, result.noise,
                   result.misfit, tuple(combination(v, labels) for v in echelon(result.open_ones)),
                   tuple(label for label, held in zip(labels, result.at_bounds, strict=True) if held), motions, residuals,
                   result.success, result.message, problem.runs, result.degrees, problem.known)

    def plot(self, path: PathName | None = None) -> Figure:
        """Measured values, motion, and residuals over time; written to a file if a path is given.

        >>> module = sd.systems.pendulum().compile()
        >>> truth = module.simulate(np.linspace(0, 2, 50), q=[0.5], params={"l": 1.3})
        >>> found = sd.fit(module, sd.Experiment(truth.t, {"q1": truth.q[:, 0]}, q=[0.5]), ["l"])
        >>> len(found.plot().axes)
        2
        """
        from symdyn.pictures.fits import plot

        return plot(self, path)

    def __str__(self) -> str:
        deviations, n = self.deviations, sum(int(np.isfinite(left).sum()) for left in self.residuals.values())
        noise = ", ".join(f"{value:.4g}" if len(self.noise) == 1 else f"{name} {value:.4g}" for name, value in self.noise.items())
        size = f"misfit {self.misfit:.4g} of the noise" if self.known_noise else f"noise {noise}"
        lines = [f"fit of {self.module.name}: {n} residuals, {size}, {self.n_runs} runs; {self.message}"]
        width = max(map(len, self.values))
        lines += [f"  {name:<{width}}  {value: .8g} +- {deviations[name]:.2g}" for name, value in self.values.items()]
        lines += [f"  held by its bound: {name}" for name in self.at_bounds]
        lines += [f"  not determined by the data: {text}" for text in self.undetermined]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)
