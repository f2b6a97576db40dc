"""What a fit found, how sure it is, and what the data leave open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.estimation.estimate import Estimate, combination

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from symdyn.given import PathName
    from symdyn.runtime.module import Module
    from symdyn.runtime.solutions.solution import Solution

# Singular values of the scaled derivatives below this part of the largest say that a combination is not determined: the
# sensitivities are accurate to about this.
UNDETERMINED = 1e-7
# An unknown that went further than so many times the size of its guess, and is less sure than it went, has run off.
FAR = 100.0


@dataclass(frozen=True)
class Unknown:
    """What is fitted: a parameter, or an initial value "q1(0)" of one experiment of `of`."""

    name: str
    experiment: int | None
    guess: float
    of: int = 1

    @property
    def label(self) -> str:
        """Its name; of an initial value with the number of the experiment, where there are several."""
        return self.name if self.experiment is None or self.of == 1 else f"{self.name} of experiment {self.experiment + 1}"

    @property
    def asked(self) -> str:
        """What `simulate` is asked for."""
        return self.name

    @property
    def state(self) -> str:
        """The state whose initial value it is."""
        return self.name.removesuffix("(0)")


@dataclass(frozen=True)
class Fit(Estimate):
    """Fitted values and how well the data determine them.

    values       label -> value: parameters by name, initial values as "q1(0)", of several experiments "q1(0) of experiment 2"
    covariance   (n, n), in the order of values; NaN where the data do not determine something
    noise        standard deviation of what was measured, in units of the noise that was given, or its estimate
    undetermined   combinations of unknowns, relative to their guesses, that the data do not determine: text, from the singular
                 vectors of the derivatives
    motions      of the experiments with these values; residuals: (experiment, what was measured) -> measured - model, (n_t, ...)
    success, message   whether the iteration ended at a minimum, and why it ended; n_runs: motions an experiment that it took
    degrees      of freedom: residuals less unknowns; known_noise: whether the noise was given

    >>> module = sd.systems.pendulum().compile()
    >>> truth = module.simulate(np.linspace(0, 2, 50), q=[0.5], params={"l": 1.3})
    >>> found = sd.fit(module, sd.Experiment(truth.t, {"q1": truth.q[:, 0]}), ["l"], ["q1"], start={"l": 1.2})
    >>> {name: round(value, 6) for name, value in found.values.items()}
    {'l': 1.3, 'q1(0)': 0.5}
    """

    module: Module
    values: Mapping[str, float]
    covariance: np.ndarray
    noise: float
    undetermined: tuple[str, ...]
    motions: tuple[Solution, ...]
    residuals: Mapping[tuple[int, str], np.ndarray]
    success: bool
    message: str
    n_runs: int
    degrees: int
    known_noise: bool

    @classmethod
    def of(cls, module: Module, unknowns: Sequence[Unknown], found: Any, scale: np.ndarray, known: bool,
           motions: Sequence[Solution], residuals: Mapping[tuple[int, str], np.ndarray], runs: int) -> Fit:
        """From the solution of the least squares."""
        labels = [u.label for u in unknowns]
        scaled = found.jac * scale
        _, sizes, vectors = np.linalg.svd(scaled, full_matrices=False)
        open_ones = sizes <= UNDETERMINED * sizes[0] if sizes[0] > 0 else np.ones(len(sizes), dtype=bool)
        degrees = len(found.fun) - len(unknowns)
        estimate = float(np.sqrt(2 * found.cost / degrees)) if degrees > 0 else np.nan
        if open_ones.any():
            covariance = np.full((len(unknowns), len(unknowns)), np.nan)
        else:
            half = (vectors.T / sizes) * scale[:, None]
            covariance = half @ half.T * (1.0 if known else estimate**2)
        guesses = np.array([u.guess for u in unknowns])
        success, message = bool(found.status > 0), str(found.message)
        way = np.abs(found.x - guesses)
        lost = (way > FAR * scale) & (np.sqrt(np.diag(covariance)) > way)
        if lost.any():
            success = False
            message = "ran off to where the data say nothing: " + ", ".join(
                f"{label} from {guess:g}" for label, guess, off in zip(labels, guesses, lost, strict=True) if off
            ) + "; give bounds or priors, or another start"
        return cls(module, dict(zip(labels, map(float, found.x), strict=True)), covariance, estimate,
                   tuple(combination(v, labels) for v in vectors[open_ones]), tuple(motions), dict(residuals), success, message,
                   runs, degrees, known)

    def plot(self, path: PathName | None = None) -> Figure:
        """Measured values, motion, and residuals over time; written to a file if a path is given."""
        from symdyn.pictures.fits import plot

        return plot(self, path)

    def __str__(self) -> str:
        deviations = self.deviations
        lines = [f"fit of {self.module.name}: {self.degrees + len(self.values)} residuals, noise {self.noise:.4g}, "
                 f"{self.n_runs} runs; {self.message}"]
        width = max(map(len, self.values))
        lines += [f"  {name:<{width}}  {value: .8g} +- {deviations[name]:.2g}" for name, value in self.values.items()]
        lines += [f"  not determined by the data: {text}" for text in self.undetermined]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)
