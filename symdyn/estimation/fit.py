"""Parameters and initial values from measured motions, by least squares with exact sensitivities.

The residuals are (model - measured)/standard deviation, and (value - mean)/standard deviation of priors. Their derivatives are
the sensitivities of the motion, integrated along with it, so that a step costs one run an experiment. Source: Nocedal and Wright,
Numerical Optimization, 2nd ed., chapter 10 (Gauss-Newton in a trust region, which is what Levenberg and Marquardt do); Branch,
Coleman and Li (1999) for bounds, as in scipy.optimize.least_squares.
"""

from __future__ import annotations

import difflib
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import least_squares

from symdyn.errors import ArgumentError, EvaluationError, SimulationWarning, SymdynError
from symdyn.estimation.experiment import Experiment, Measured, taken
from symdyn.estimation.result import Fit, Unknown
from symdyn.estimation.starts import Start, moves
from symdyn.real_numbers import number_of
from symdyn.runtime.inputs.inputs import inputs_at
from symdyn.runtime.integrating.simulate import start_of
from symdyn.runtime.module import demand_module
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.given import Named, Names
    from symdyn.runtime.module import Module
    from symdyn.runtime.solutions.solution import Solution



# Relative changes of the sum of squares and of the unknowns at which the iteration ends.
PRECISION = 1e-10


def fit(module: Module, data: Experiment | Sequence[Experiment], parameters: Names = (), initial: Names = (),
        bounds: Named[tuple[float, float]] | None = None, priors: Named[tuple[float, float]] | None = None,
        noise: float | Named[float] | None = None, start: Named[float] | None = None, rtol: float = 1e-8,
        method: str = "dop853", max_steps: int = 100) -> Fit:
    """Parameters and initial values with which motions are nearest to measured ones, in the sense of least squares.

    data         an sd.Experiment, or several
    parameters   that are the same in all experiments, by name or symbol
    initial      coordinates, speeds and extra states whose initial values are unknown, each its own in every experiment; their
                 guess is the experiment's start. With constraints, the coordinates and speeds that are neither fitted nor among
                 the first that the constraints leave free follow from them, for every value that is tried
    bounds       name -> (least, most) of a parameter, or of an initial value, as "q1(0)"; masses of bodies are positive anyway
    priors       name -> (mean, standard deviation): what is known of it apart from the data
    noise        standard deviation of what was measured, for all or by name; None: the same for all, estimated from what the fit
                 leaves over
    start        guesses of parameters; default: their defaults
    rtol, method   of the runs (a compiled method)
    max_steps    of the iteration, at most

    Parameters are scaled by their guesses. A motion that cannot be computed is a step that is not taken. The minimum is one near
    the guess: over long records of chaotic motion there are many. Raises ArgumentError with all faults for what does not fit,
    EvaluationError where the motion from the guess cannot be computed.

    >>> module = sd.systems.pendulum().compile()
    >>> truth = module.simulate(np.linspace(0, 2, 50), q=[0.5], params={"l": 1.3})
    >>> found = sd.fit(module, sd.Experiment(truth.t, {"q1": truth.q[:, 0]}, q=[0.5]), ["l"])
    >>> round(found.values["l"], 6)
    1.3
    """
    demand_module(module, "sd.fit")
    experiments = taken(module, data)
    if isinstance(max_steps, bool) or not isinstance(max_steps, int) or max_steps < 1:
        raise ArgumentError(f"{module.name}: max_steps is {shown(max_steps)}; pass a whole number from 1 on")
    problem = _problem(module, experiments, parameters, initial, bounds, priors, noise, start, rtol, method)
    guess = np.array([unknown.guess for unknown in problem.unknowns])
    first = problem.residuals(guess)
    if not np.isfinite(first).all():
        raise EvaluationError(f"{module.name}: no motion from the guess of the fit, {problem.failure}; take another start")
    found = least_squares(problem.residuals, guess, problem.jacobian, (problem.least, problem.most), "trf", x_scale=problem.scale,
                          max_nfev=max_steps, ftol=PRECISION, xtol=PRECISION, gtol=PRECISION)
    return problem.result(found)


@dataclass
class _Problem:
    """Residuals of all experiments as functions of the unknowns.

    scale   of the unknowns; least, most: their bounds
    noise   standard deviation by what was measured; known: whether it was given
    starts  of the experiments on the constraints; None where a start is as it is given, with unknown values put in
    """

    module: Module
    experiments: list[Measured]
    unknowns: list[Unknown]
    scale: np.ndarray
    least: np.ndarray
    most: np.ndarray
    priors: list[tuple[int, float, float]]
    noise: Mapping[str, float]
    known: bool
    rtol: float
    method: str
    starts: list[Start | None]
    failure: str = ""
    runs: int = 0

    def __post_init__(self) -> None:
        self._at: np.ndarray | None = None
        self._motions: list[Solution] = []

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

    def result(self, found: Any) -> Fit:
        """The fit, from what least_squares returns."""
        self._moved(found.x)
        left = {(k, name): np.where(present, measured - self._model(k, name), np.nan)
                for k, name, measured, present in self._parts()}
        return Fit.of(self.module, self.unknowns, found, self.scale, self.known, list(self._motions), left, self.runs)

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
            stopped = next((m for m in motions if not m.success), None)
            if stopped is not None:
                self.failure = stopped.message
                return False
            self._at, self._motions = values.copy(), motions
        return True

    def _run(self, k: int, values: np.ndarray) -> Solution:
        experiment = self.experiments[k].experiment
        mine = [(unknown, float(v)) for unknown, v in zip(self.unknowns, values, strict=True) if unknown.experiment in (None, k)]
        params = {**{str(name_of(key)): value for key, value in experiment.params.items()},
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
        return self.module.simulate(self.experiments[k].t, **given, params=params, inputs=experiment.inputs, rtol=self.rtol,
                                    method=self.method, sensitivities=asked)

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
                result[group] = {**({str(name_of(key)): v for key, v in given.items()} if given else {}), **mine}
            else:
                result[group] = [mine.get(name, value) for name, value in zip(names, given, strict=True)]
        return result


def _problem(module: Module, experiments: list[Measured], parameters: Any, initial: Any, bounds: Any, priors: Any, noise: Any,
             start: Any, rtol: float, method: str) -> _Problem:
    """What is fitted, checked. Raises ArgumentError with all faults."""
    faults: list[str] = []
    metadata = module.metadata
    named = _names(parameters, metadata.parameters, "parameters", "parameter", faults)
    states = _names(initial, metadata.x, "initial", "state", faults)
    defaults = dict(zip(metadata.parameters, metadata.defaults, strict=True))
    guesses = {str(name_of(key)): value for key, value in _by_name(start, "start", "l: 1.0", faults).items()}
    faults += [f"start has {shown(key)}, which is not fitted" for key in guesses if key not in named]
    unknowns = []
    for name in named:
        guess = guesses.get(name, defaults[name])
        if guess is None:
            faults.append(f"parameter {name} has no default; give a guess of it in start")
            guess = 1.0
        unknowns.append(Unknown(name, None, number_of(guess, module.name, f"start of {name} must be a number")))
    for k, measured in enumerate(experiments):
        unknowns += [Unknown(f"{state}(0)", k, _guess(module, measured.experiment, state), len(experiments)) for state in states]
    if not unknowns:
        faults.append("nothing is fitted; pass parameters, or initial")
    positive: dict[str, tuple[float, float]] = dict.fromkeys(metadata.masses, (0.0, float("inf")))
    limits = {**positive, **_pairs(bounds, "bounds", named, states, faults)}
    for name, (low, high) in limits.items():
        if not low < high:
            faults.append(f"bounds of {name} are ({low:g}, {high:g}); the first must be less")
    least = np.array([limits.get(u.name, (-np.inf, np.inf))[0] for u in unknowns])
    most = np.array([limits.get(u.name, (-np.inf, np.inf))[1] for u in unknowns])
    for unknown, low, high in zip(unknowns, least, most, strict=True):
        if low < high and not low < unknown.guess < high:
            faults.append(f"the guess {unknown.guess:g} of {unknown.label} is not inside its bounds ({low:g}, {high:g})")
    known = _pairs(priors, "priors", named, states, faults)
    faults += [f"the prior of {name} has the standard deviation {deviation:g}; it must be positive"
               for name, (_, deviation) in known.items() if not deviation > 0]
    what = list(dict.fromkeys(name for e in experiments for name in e.values))
    deviations = _noise(noise, what, faults)
    if faults:
        raise ArgumentError(f"{module.name}: {'; '.join(faults)}")
    scale = np.array([abs(u.guess) if u.guess else 1.0 for u in unknowns])
    held = [(i, *known[u.name]) for i, u in enumerate(unknowns) if u.name in known]
    values = {u.name: u.guess for u in unknowns if u.experiment is None}
    problem = _Problem(module, experiments, unknowns, scale, least, most, held, deviations, noise is not None, rtol, method,
                       [_on_constraints(module, e, values, states) for e in experiments])
    if problem.n < len(unknowns):
        raise ArgumentError(f"{module.name}: {len(unknowns)} unknowns are fitted to {problem.n} values; measure more, or fit "
                            "less")
    return problem


def _names(given: Any, there: Sequence[str], what: str, kind: str, faults: list[str]) -> list[str]:
    listed = list(given) if isinstance(given, (list, tuple)) else [given]
    found: list[str] = []
    for key in listed:
        name = str(name_of(key))
        if name not in there:
            near = difflib.get_close_matches(name, there, 3)
            faults.append(f"{what} has {shown(key)}, which is no {kind}; " + (f"did you mean {' or '.join(near)}?" if near else
                                                                          f"there are {', '.join(there)}"))
        elif name in found:
            faults.append(f"{what} has {name} twice")
        else:
            found.append(name)
    return found


def _by_name(given: Any, what: str, example: str, faults: list[str]) -> Mapping[Any, Any]:
    """A dictionary as it is, an empty one for None; anything else is a fault."""
    if given is None or isinstance(given, Mapping):
        return given or {}
    faults.append(f"{what} is {shown(given)}; pass a dictionary from names to values, such as {{{example}}}")
    return {}


def _pairs(given: Any, what: str, named: Sequence[str], states: Sequence[str],
           faults: list[str]) -> dict[str, tuple[float, float]]:
    """Name -> two numbers; of initial values as "q1(0)"."""
    there = [*named, *[f"{state}(0)" for state in states]]
    result = {}
    for key, pair in _by_name(given, what, "l: (0.5, 2.0)", faults).items():
        name = str(name_of(key))
        if name not in there:
            faults.append(f"{what} has {shown(key)}, which is not fitted; fitted are {', '.join(there)}")
        elif not isinstance(pair, (list, tuple)) or len(pair) != 2 or any(
                isinstance(v, bool) or not isinstance(v, (int, float, np.number)) or np.isnan(v) for v in pair):
            faults.append(f"{what} of {name} is {shown(pair)}; pass a pair of numbers")
        elif what == "priors" and not np.isfinite([float(v) for v in pair]).all():
            faults.append(f"{what} of {name} is {shown(pair)}; pass a finite mean and standard deviation, or leave the prior out")
        else:
            result[name] = (float(pair[0]), float(pair[1]))
    return result


def _noise(given: Any, measured: Sequence[str], faults: list[str]) -> dict[str, float]:
    if given is None:
        return dict.fromkeys(measured, 1.0)
    each = given if isinstance(given, Mapping) else dict.fromkeys(measured, given)
    by_name = {str(name_of(key)): value for key, value in each.items()}
    faults += [f"noise has {shown(name)}, which is not measured" for name in by_name if name not in measured]
    faults += [f"noise of {name} is missing" for name in measured if name not in by_name]
    for name, value in by_name.items():
        if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not 0 < value < np.inf:
            faults.append(f"noise of {name} is {shown(value)}; it must be a positive number")
    return {name: by_name.get(name, 1.0) for name in measured}


def _guess(module: Module, experiment: Experiment, state: str) -> float:
    """The start of a state in an experiment."""
    for group in ("q", "u", "z"):
        names = list(getattr(module.metadata, group))
        if state in names:
            given = getattr(experiment, group)
            if isinstance(given, Mapping):
                given = {str(name_of(key)): v for key, v in given.items()}.get(state)
            elif given is not None:
                row = list(np.ravel(given))
                if len(row) != len(names):
                    raise ArgumentError(f"{module.name}: {group} of an experiment has {len(row)} numbers, needed are "
                                        f"{len(names)}: {', '.join(names)}")
                given = row[names.index(state)]
            guess = module.metadata.initial.get(state, 0.0) if given is None else given
            return number_of(guess, module.name, f"{state} at the start of an experiment must be a number")
    raise AssertionError(state)


def _on_constraints(module: Module, measured: Measured, guesses: Mapping[str, float], states: Sequence[str]) -> Start | None:
    """The start of an experiment as a function of what is fitted; None where no constraint ties its entries to that."""
    experiment, metadata = measured.experiment, module.metadata
    p = module.parameters({**{str(name_of(key)): value for key, value in experiment.params.items()}, **guesses})
    x, t = start_of(module, experiment.q, experiment.u, experiment.z), float(measured.t[0])
    if metadata.motions:
        module = module.following(inputs_at(experiment.inputs, t, metadata.inputs, metadata.initial, module.name,
                                            metadata.motions))
    return Start(module, t, x, p, states) if moves(module, t, x, p, list(guesses), states) else None
