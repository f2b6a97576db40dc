"""The work of an ensemble, a chunk of samples at a time: a function that can be sent to any process."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from symdyn.ensembles.measures import Measure
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.runtime.arguments import take
from symdyn.runtime.module import Module

GROUPS = ("q", "u", "z", "parameters", "inputs")
# Longer messages of failed members are cut.
MESSAGE = 400


@dataclass(frozen=True)
class Setting:
    """What all members have in common.

    system       a portable module
    base         q, u, z, parameters and inputs as they are where samples do not change them
    places       for each name of a sample its group and its place there
    consistent   begin with the nearest state that fulfils the constraints, what is sampled kept
    options      of `simulate`
    """

    system: Any
    times: np.ndarray
    base: Mapping[str, np.ndarray]
    names: tuple[str, ...]
    places: tuple[tuple[str, int], ...]
    measures: tuple[Measure, ...]
    consistent: bool
    options: Mapping[str, Any]
    shapes: tuple[tuple[int, ...], ...] = ()


@dataclass(frozen=True)
class Chunk:
    """Samples `first`, `first` + 1, ...: values (n, n_names)."""

    setting: Setting
    index: int
    first: int
    values: np.ndarray


@dataclass
class Done:
    """Outcomes of a chunk: label -> (n, ...), not a number for members that failed; (place in the chunk, message) of these."""

    index: int
    columns: dict[str, np.ndarray]
    failures: list[tuple[int, str]] = field(default_factory=list)


def run_chunk(chunk: Chunk) -> Done:
    """Simulate every sample of a chunk; a member that fails is noted, and the others go on."""
    setting = chunk.setting
    n = len(chunk.values)
    done = Done(chunk.index, {m.label: np.full((n, *shape), np.nan) for m, shape in zip(setting.measures, setting.shapes)})
    # Filters of warnings belong to the whole process; in the one of the caller they are set once, around all chunks.
    with contextlib.nullcontext() if setting.system.at_home else quiet():
        for k, sample in enumerate(chunk.values):
            try:
                for measure, shape, value in zip(setting.measures, setting.shapes, member(setting, sample)):
                    if value.shape != shape:
                        raise ArgumentError(f"outcome {measure.label!r} has the shape {value.shape}, elsewhere {shape}")
                    done.columns[measure.label][k] = value
            except Exception as error:  # whatever it is, it is this member's; its row is empty
                for column in done.columns.values():
                    column[k] = np.nan
                done.failures.append((k, _message(error)))
    return done


def member(setting: Setting, sample: np.ndarray) -> list[np.ndarray]:
    """The outcomes of one sample. Raises whatever is wrong with it."""
    module: Module = setting.system.module
    groups = {name: values.copy() for name, values in setting.base.items()}
    for (group, place), value in zip(setting.places, sample, strict=True):
        groups[group][place] = value
    q, u, p = groups["q"], groups["u"], groups["parameters"]
    if setting.consistent:
        keep = [n for n, (group, _) in zip(setting.names, setting.places, strict=True) if group in ("q", "u")]
        q, u = module.consistent(q, u, p, float(setting.times[0]), keep)
    solution = module.simulate(setting.times, q, u, p, z=groups["z"], inputs=groups["inputs"], **setting.options)
    if not solution.success:
        raise ArithmeticError(solution.message)
    outcomes = [m.of(solution) for m in setting.measures]
    wrong = [m.label for m, value in zip(setting.measures, outcomes, strict=True) if not np.isfinite(value).all()]
    if wrong:
        raise ArithmeticError(f"{', '.join(wrong)}: the outcome is not finite")
    return outcomes


def setting_of(system: Any, names: Sequence[str], times: np.ndarray, measures: Sequence[Measure], given: Mapping[str, Any],
               consistent: bool, options: Mapping[str, Any]) -> Setting:
    """The setting for samples of these names.

    given   q, u, z, parameters, inputs as the user gave them, for all members
    Raises ArgumentError for names that the mechanism does not have.
    """
    module: Module = system.module
    metadata = module.metadata
    places = []
    unknown = []
    for name in names:
        group = next((g for g in GROUPS if name in metadata[g]), None)
        if group is None:
            unknown.append(name)
        else:
            places.append((group, metadata[group].index(name)))
    if unknown:
        raise ArgumentError(f"{module.name}: samples: there is no {', '.join(unknown)}; there are "
                            + "; ".join(f"{g}: {', '.join(metadata[g])}" for g in GROUPS if metadata[g]))
    base = {}
    for group in GROUPS:
        defaults = {n: metadata["initial"].get(n, 0.0) for n in metadata[group]}
        if group == "parameters":
            known = dict(zip(metadata["parameters"], metadata["defaults"], strict=True))
            defaults = {n: v if v is not None or n not in names else 0.0 for n, v in known.items()}
        base[group] = take(given.get(group), metadata[group], group, defaults, module.name)
    return Setting(system, times, base, tuple(names), tuple(places), tuple(measures), consistent, dict(options))


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """What simulations warn of stands in the failures."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)
        yield


def _message(error: Exception) -> str:
    text = str(error) or type(error).__name__
    known = isinstance(error, ArithmeticError) or type(error).__module__.startswith("symdyn")
    return (text if known else f"{type(error).__name__}: {text}")[:MESSAGE]
