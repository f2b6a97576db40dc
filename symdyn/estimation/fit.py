"""Parameters and initial values from measured motions, by least squares with exact sensitivities."""

from __future__ import annotations

import difflib
import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError, SimulationWarning
from symdyn.estimation.experiment import Experiment, Measured, taken
from symdyn.estimation.minimum import minimum
from symdyn.estimation.problem import Problem, Unknown
from symdyn.estimation.result import Fit
from symdyn.estimation.starts import Start, moves
from symdyn.real_numbers import number_of
from symdyn.runtime.inputs.inputs import inputs_at
from symdyn.runtime.integrating.simulate import start_of
from symdyn.runtime.module import demand_module
from symdyn.shown import by_name, name_of, shown

if TYPE_CHECKING:
    from symdyn.given import Named, Names
    from symdyn.runtime.module import Module


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
    noise        standard deviation of what was measured, for all or by name; None: estimated for each by its name, from what the
                 fit leaves over, and at least what the runs are exact to; priors keep their deviations
    start        guesses of parameters; default: their defaults
    rtol, method   of the runs (a compiled method)
    max_steps    of an iteration, at most

    Parameters are scaled by their guesses. A motion that cannot be computed is a step that is not taken. The minimum is one near
    the guess: over long records of chaotic motion there are many. Combinations that the data leave open stay at the guess, and
    what the data press against a bound is on it. A fit that ends at no minimum is reported by a SimulationWarning. Raises
    ArgumentError with all faults for what does not fit, EvaluationError where the motion from the guess cannot be computed. See
    symdyn.estimation.minimum for the method and its sources.

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
    doubts: list[warnings.WarningMessage] = []
    try:
        with warnings.catch_warnings(record=True) as doubts:
            warnings.simplefilter("always")
            first = problem.residuals(problem.guess)
    finally:
        for doubt in doubts:
            if issubclass(doubt.category, SimulationWarning):  # at the line of the caller
                warnings.warn(str(doubt.message), doubt.category, stacklevel=2)
            else:
                warnings.warn_explicit(doubt.message, doubt.category, doubt.filename, doubt.lineno, source=doubt.source)
    if not np.isfinite(first).all():
        raise EvaluationError(f"{module.name}: no motion from the guess of the fit, {problem.failure}; take another start")
    result = Fit.of(problem, minimum(problem, max_steps))
    if not result.success:
        warnings.warn(f"{module.name}: the fit found no minimum: {result.message}", SimulationWarning, stacklevel=2)
    return result


def _problem(module: Module, experiments: list[Measured], parameters: Any, initial: Any, bounds: Any, priors: Any, noise: Any,
             start: Any, rtol: float, method: str) -> Problem:
    """Problem to fit, checked. Raises ArgumentError with all faults."""
    faults: list[str] = []
    metadata = module.metadata
    named = _names(parameters, metadata.parameters, "parameters", "parameter", faults)
    states = _names(initial, metadata.x, "initial", "state", faults)
    defaults = dict(zip(metadata.parameters, metadata.defaults, strict=True))
    guesses = by_name(_mapping(start, "start", "l: 1.0", faults))
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
    for k, measured in enumerate(experiments):
        own = by_name(measured.experiment.params)
        faults += [f"{name} is fitted, and experiment {k + 1} has a value of its own for it in params; leave one of them out"
                   for name in named if name in own]
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
    problem = Problem(module, experiments, unknowns, scale, least, most, held, deviations, noise is not None, rtol, method,
                       [_on_constraints(module, e, values, states) for e in experiments])
    if problem.n < len(unknowns):
        raise ArgumentError(f"{module.name}: {len(unknowns)} unknowns are fitted to {problem.n} values; measure more, or fit "
                            "less")
    return problem


def _names(given: Any, there: Sequence[str], what: str, kind: str, faults: list[str]) -> list[str]:
    listed = list(given) if isinstance(given, (list, tuple)) else [given]
    result: list[str] = []
    for key in listed:
        name = str(name_of(key))
        if name not in there:
            near = difflib.get_close_matches(name, there, 3)
            faults.append(f"{what} has {shown(key)}, which is no {kind}; " + (f"did you mean {' or '.join(near)}?" if near else
                                                                          f"there are {', '.join(there)}"))
        elif name in result:
            faults.append(f"{what} has {name} twice")
        else:
            result.append(name)
    return result


def _mapping(given: Any, what: str, example: str, faults: list[str]) -> Mapping[Any, Any]:
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
    for key, pair in _mapping(given, what, "l: (0.5, 2.0)", faults).items():
        name = str(name_of(key))
        if name not in there:
            faults.append(f"{what} has {shown(key)}, which is not fitted; fitted are {', '.join(there)}")
        elif not isinstance(pair, (list, tuple)) or len(pair) != 2 or not all(map(_is_number, pair)):
            faults.append(f"{what} of {name} is {shown(pair)}; pass a pair of numbers")
        elif what == "priors" and not np.isfinite([float(v) for v in pair]).all():
            faults.append(f"{what} of {name} is {shown(pair)}; pass a finite mean and standard deviation, or leave the prior out")
        else:
            result[name] = (float(pair[0]), float(pair[1]))
    return result


def _is_number(value: Any) -> bool:
    """Whether a double holds it; infinity is one, NaN none."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
        return False
    try:
        return not np.isnan(float(value))
    except OverflowError:
        return False


def _noise(given: Any, measured: Sequence[str], faults: list[str]) -> dict[str, float]:
    if given is None:
        return dict.fromkeys(measured, 1.0)
    each = given if isinstance(given, Mapping) else dict.fromkeys(measured, given)
    named = by_name(each)
    faults += [f"noise has {shown(name)}, which is not measured" for name in named if name not in measured]
    faults += [f"noise of {name} is missing" for name in measured if name not in named]
    for name, value in named.items():
        if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not 0 < value < np.inf:
            faults.append(f"noise of {name} is {shown(value)}; it must be a positive number")
    return {name: named.get(name, 1.0) for name in measured}


def _guess(module: Module, experiment: Experiment, state: str) -> float:
    """The start of a state in an experiment."""
    for group in ("q", "u", "z"):
        names = list(getattr(module.metadata, group))
        if state in names:
            given = getattr(experiment, group)
            if isinstance(given, Mapping):
                given = by_name(given).get(state)
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
    p = module.parameters({**by_name(experiment.params), **guesses})
    x, t = start_of(module, experiment.q, experiment.u, experiment.z), float(measured.t[0])
    if metadata.motions:
        module = module.following(inputs_at(experiment.inputs, t, metadata.inputs, metadata.initial, module.name,
                                            metadata.motions))
    return Start(module, t, x, p, states) if moves(module, t, x, p, list(guesses), states) else None
