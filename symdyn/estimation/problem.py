"""Problem of a fit: residuals of all experiments and priors as functions of the unknowns, with their derivatives.

The residuals are (model - measured)/noise, and (value - mean)/standard deviation of priors. Their derivatives are the
sensitivities of the motion, integrated along with it, so that a step costs one run an experiment.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError, SimulationWarning, SymdynError
from symdyn.estimation.experiment import Measured
from symdyn.estimation.starts import Start
from symdyn.runtime.integrating.simulate import simulate
from symdyn.shown import by_name

if TYPE_CHECKING:
    from symdyn.runtime.module import Module
    from symdyn.runtime.solutions.solution import Solution


# Steps of a trial motion at most: so many, or so many times those of the latest motion. Where it blows up it would not end.
_STEPS, _TIMES = 10_000, 50


@dataclass(frozen=True)
class Unknown:
    """Unknown of a fit: a parameter, or an initial value "q1(0)" of one experiment of `of`."""

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
        """Arguments requested from `simulate`."""
        return self.name

    @property
    def state(self) -> str:
        """The state whose initial value it is."""
        return self.name.removesuffix("(0)")


@dataclass
class Problem:
    """Residuals of all experiments as functions of the unknowns.

    scale   of the unknowns; least, most: their bounds
    noise   standard deviation by what was measured, with which residuals are weighted; known: whether it was given
    starts  of the experiments on the constraints; None where a start is as it is given, with unknown values put in
    """

    module: Module
    experiments: list[Measured]
    unknowns: list[Unknown]
    scale: np.ndarray
    least: np.ndarray
    most: np.ndarray
    priors: list[tuple[int, float, float]]
    noise: dict[str, float]
    known: bool
    rtol: float
    method: str
    starts: list[Start | None]
    failure: str = ""
    runs: int = 0

    def __post_init__(self) -> None:
        self._at: np.ndarray | None = None
        self._motions: list[Solution] = []
        self._most: list[int] = []

    def residuals(self, values: np.ndarray) -> np.ndarray:
        """(n,), NaN where a motion cannot be computed: such a step is not taken."""
        if not self._moved(values):
            return np.full(self.n, np.nan)
        rows = [((self._model(k, name) - measured)[present] / self.noise[name])
                for k, name, measured, present in self._parts()]
        return np.concatenate([*rows, [(values[i] - mean) / deviation for i, mean, deviation in self.priors]])

    def jacobian(self, values: np.ndarray) -> np.ndarray:
        """Derivatives of the residuals by the unknowns, (n, n_unknowns)."""
        self._moved(values)
        blocks = []
        for k, name, _, present in self._parts():
            block = np.zeros((int(present.sum()), len(self.unknowns)))
            columns = [i for i, unknown in enumerate(self.unknowns) if unknown.experiment in (None, k)]
            block[:, columns] = self._motions[k].sensitivity.of(name)[present] / self.noise[name]
            blocks.append(block)
        of_priors = np.zeros((len(self.priors), len(self.unknowns)))
        for row, (i, _, deviation) in zip(of_priors, self.priors, strict=True):
            row[i] = 1 / deviation
        return np.vstack([*blocks, of_priors])

    @property
    def n(self) -> int:
        """Number of residuals."""
        return sum(e.n for e in self.experiments) + len(self.priors)

    @property
    def guess(self) -> np.ndarray:
        """Where the iteration begins, (n_unknowns,)."""
        return np.array([unknown.guess for unknown in self.unknowns])

    @property
    def measured(self) -> dict[str, np.ndarray]:
        """Values that were measured, of all experiments, by what was measured: (n,) each."""
        return {name: np.concatenate([values[present].ravel() for _, one, values, present in self._parts() if one == name])
                for name in self.noise}

    @cached_property
    def rows(self) -> dict[str, np.ndarray]:
        """Masks of the residuals of measured values, (n,) of bool by name; those of priors are none of them."""
        parts = [(name, int(present.sum())) for _, name, _, present in self._parts()]
        of_priors = np.zeros(len(self.priors), dtype=bool)
        return {name: np.concatenate([*(np.full(n, one == name) for one, n in parts), of_priors]) for name in self.noise}

    def motions(self, values: np.ndarray) -> tuple[Solution, ...]:
        """Motions of the experiments, with values that can be computed."""
        self._moved(values)
        return tuple(self._motions)

    def left(self, values: np.ndarray) -> dict[tuple[int, str], np.ndarray]:
        """(Experiment, what was measured) -> measured - model, with values that can be computed."""
        self._moved(values)
        return {(k, name): np.where(present, measured - self._model(k, name), np.nan)
                for k, name, measured, present in self._parts()}

    def _parts(self) -> list[tuple[int, str, np.ndarray, np.ndarray]]:
        return [(k, name, values, np.isfinite(values)) for k, e in enumerate(self.experiments)
                for name, values in e.values.items()]

    def _model(self, k: int, name: str) -> np.ndarray:
        motion = self._motions[k]
        return motion[name] if name in motion.module.metadata.x else motion.outputs[name]

    def _moved(self, values: np.ndarray) -> bool:
        """Runs the experiments with these values, unless they were run with them last; False where one cannot be run."""
        if self._at is None or not np.array_equal(values, self._at):
            self.runs += 1
            self._at = None
            try:
                with warnings.catch_warnings():
                    if self.runs > 1:  # what warnings say of a motion they said of the first; why one ends is in `failure`
                        warnings.simplefilter("ignore", SimulationWarning)
                    motions = [self._run(k, values) for k in range(len(self.experiments))]
            except SymdynError as error:
                if isinstance(error, ArgumentError) and self.runs == 1:
                    raise  # what was asked is at fault, not where the iteration has gone
                self.failure = str(error)
                return False
            # An event of the system may end a motion before the data.
            stopped = next((m for m, e in zip(motions, self.experiments, strict=True)
                            if not m.success or len(m.t) < len(e.t)), None)
            if stopped is not None:
                self.failure = stopped.message
                return False
            self._most = [max(_STEPS, _TIMES * m.n_steps) for m in motions]
            self._at, self._motions = values.copy(), motions
        return True

    def _run(self, k: int, values: np.ndarray) -> Solution:
        experiment = self.experiments[k].experiment
        mine = [(unknown, float(v)) for unknown, v in zip(self.unknowns, values, strict=True) if unknown.experiment in (None, k)]
        params = {**by_name(experiment.params),
                  **{u.name: v for u, v in mine if u.experiment is None}}
        initial = {u.state: v for u, v in mine if u.experiment is not None}
        start = self.starts[k]
        asked: Any = [u.asked for u, _ in mine]
        if start is None:
            given = self._start(k, initial)
        else:
            p = self.module.parameters(params)
            x = start.at(initial, p)
            sizes = self.module.metadata.sizes
            given = dict(zip(("q", "u", "z"), np.split(x, [sizes.q, sizes.q + sizes.u]), strict=True))
            asked = {u.asked: start.derivative(x, p, u.state) for u, _ in mine}
        return simulate(self.module, self.experiments[k].t, **given, params=params, inputs=experiment.inputs, rtol=self.rtol,
                        method=self.method, max_steps=self._most[k] if self._most else None, sensitivities=asked,
                        judged=self.runs == 1)

    def _start(self, k: int, unknown: Mapping[str, float]) -> dict[str, Any]:
        """q, u and z of an experiment, with the unknown initial values put in."""
        experiment, metadata = self.experiments[k].experiment, self.module.metadata
        result: dict[str, Any] = {}
        for group in ("q", "u", "z"):
            given, names = getattr(experiment, group), getattr(metadata, group)
            mine = {name: unknown[name] for name in names if name in unknown}
            if not mine:
                result[group] = given
            elif given is None or isinstance(given, Mapping):
                result[group] = {**by_name(given), **mine}
            else:
                result[group] = [mine.get(name, value) for name, value in zip(names, np.ravel(given), strict=True)]
        return result
