"""The work of an ensemble, a chunk of samples at a time: a function that can be sent to any process."""

from __future__ import annotations

import contextlib
import os
import socket
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from symdyn.arguments import take
from symdyn.backend.right_side import METHOD
from symdyn.ensembles.measures import Measure
from symdyn.ensembles.portable import NotSent
from symdyn.errors import ArgumentError, CompileError, CompilerNotFound, MissingExtra, SimulationWarning, SymdynError
from symdyn.runtime.batches.motions import IN_LANES, why_columns_one_by_one, why_one_by_one
from symdyn.runtime.consistent import NotConsistent, advice
from symdyn.runtime.gpu.device import OfDevice
from symdyn.runtime.integrating.events import wanted
from symdyn.runtime.integrating.simulate import RTOL, checked_tolerances
from symdyn.runtime.module import Module
from symdyn.runtime.solutions.solution import Solution
from symdyn.runtime.solutions.states_only import StatesOnly
from symdyn.shown import shown

GROUPS = ("q", "u", "z", "parameters", "inputs")
# Longer messages of failed members are cut.
MESSAGE = 400
# Members whose doubts are listed.
LISTED = 3
# Numbers of motions that are held at a time, 8 bytes each; of a device, which computes more of them at once.
NUMBERS, NUMBERS_OF_DEVICE = 2**21, 2**27


class MemberFailed(SymdynError):
    """A motion has no outcome; the message says why."""


@dataclass(frozen=True)
class Setting:
    """Data that all members have in common.

    system       a portable module
    base         q, u, z, parameters and inputs as they are where samples do not change them
    places       for each name of a sample its group and its place there
    consistent   begin with the nearest state that fulfils the constraints, what is sampled kept
    options      of `simulate`
    shapes       of the outcomes of one member
    vectors      several members are integrated at once on one processor core, or on a device
    device       "cpu", or the GPU that integrates them; precision: of its numbers
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
    vectors: bool = False
    device: str = "cpu"
    precision: str = "double"


@dataclass(frozen=True)
class Chunk:
    """Samples `first`, `first` + 1, ...: values (n, n_names)."""

    setting: Setting
    index: int
    first: int
    values: np.ndarray


@dataclass
class Done:
    """Outcomes of a chunk: label -> (n, ...), not a number for members that failed; (place in the chunk, message) of these.

    worker   the process that computed it
    doubts   (number of the member, what its motion was warned of) where outcomes are derivatives, the first few; n_doubtful: how
             many members there are
    """

    index: int
    columns: dict[str, np.ndarray]
    failures: list[tuple[int, str]] = field(default_factory=list)
    doubts: list[tuple[int, str]] = field(default_factory=list)
    n_doubtful: int = 0
    worker: str = field(default_factory=lambda: f"{socket.gethostname()}-{os.getpid()}")

    def fail(self, index: int, error: Exception) -> None:
        """Note a failed member, and leave its row empty."""
        for column in self.columns.values():
            column[index] = np.nan
        self.failures.append((index, _message(error)))


def run_chunk(chunk: Chunk) -> Done:
    """Simulate every sample of a chunk; a member that fails is noted, and the others go on."""
    setting = chunk.setting
    n = len(chunk.values)
    done = Done(chunk.index, {m.label: np.full((n, *shape), np.nan) for m, shape in zip(setting.measures, setting.shapes)})
    finite = np.isfinite(chunk.values).all(axis=1)
    for k in np.flatnonzero(~finite).tolist():
        bad = ", ".join(f"{n} = {v}" for n, v in zip(setting.names, chunk.values[k], strict=True) if not np.isfinite(v))
        done.fail(k, ArgumentError(f"{setting.system.module.name}: a sample must be finite, found {bad}"))
    # Filters of warnings belong to the whole process; in the one of the caller they are set once, around all chunks.
    with contextlib.nullcontext() if setting.system.at_home else quiet():
        (_on_vectors if setting.vectors else _one_by_one)(setting, chunk.values, np.flatnonzero(finite), done)
    for k in sorted(set(range(n)) - {k for k, _ in done.failures}):
        wrong = [label for label, column in done.columns.items() if not np.isfinite(column[k]).all()]
        if wrong:
            done.fail(k, MemberFailed(f"{', '.join(wrong)}: the outcome is not finite"))
    done.failures.sort()
    done.doubts = [(chunk.first + k, text) for k, text in done.doubts]
    return done


def _one_by_one(setting: Setting, values: np.ndarray, rows: np.ndarray, done: Done) -> None:
    """Simulate samples, by their places, one after the other."""
    differentiated = any(measure.grad for measure in setting.measures)
    for k in rows.tolist():
        try:
            solution = motion(setting, values[k])
            if differentiated and solution.doubts:
                done.n_doubtful += 1
                done.doubts += [(k, solution.doubts[0])] * (len(done.doubts) < LISTED)
            for measure, shape in zip(setting.measures, setting.shapes, strict=True):
                done.columns[measure.label][k] = _fitting(measure, measure.of(solution), shape)
        except Exception as error:  # whatever it is, it is this member's
            _raise_others(error)
            done.fail(k, error)


def _on_vectors(setting: Setting, values: np.ndarray, rows: np.ndarray, done: Done) -> None:
    """Simulate samples, by their places, several at once."""
    module: Module = setting.system.module
    states, times, at_once = list(module.metadata.x), setting.times, held_at_once(setting)
    for part in (rows[k:k + at_once] for k in range(0, len(rows), at_once)):
        groups = _groups(setting, values[part])
        try:
            batch = module.simulate_batch(groups["q"], groups["u"], groups["parameters"], z=groups["z"], t=times,
                                          inputs=groups["inputs"], device=setting.device, precision=setting.precision,
                                          **setting.options)
        except SymdynError as error:  # of all of them: each reports it for itself
            _raise_others(error)
            _one_by_one(setting, values, part, done)
            continue
        for place, message in batch.messages.items():
            own = message.replace(advice(module, float(times[0])), _advice(setting))
            done.fail(int(part[place]), MemberFailed(own))
        well = np.flatnonzero(batch.success)
        others = [m for m in setting.measures if m.name not in states]
        if any(measure.grad for measure in setting.measures):
            doubtful = [place for place in sorted(batch.doubts) if batch.success[place]]
            done.n_doubtful += len(doubtful)
            left = LISTED - len(done.doubts)
            done.doubts += [(int(part[place]), batch.doubts[place][0]) for place in doubtful[:left]]
        for measure in setting.measures:
            if measure.grad:  # one after the other: sums are rounded as those of a motion alone
                for place in well.tolist():
                    done.columns[measure.label][part[place]] = measure.of_rows(
                        times, batch[measure.name][place], batch.sensitivity.of(measure.name)[place])
            elif measure.name in states:
                over_time = batch.x[well, :, states.index(measure.name)].T
                done.columns[measure.label][part[well]] = measure.reduce(times, over_time).T
        for place in well.tolist() if others else ():
            solution = _states_only(setting, batch.x[place], (int(batch.n_steps[place]), int(batch.n_rejected[place])),
                                    groups["parameters"][place], groups["inputs"][place])
            try:
                for measure in others:
                    shape = setting.shapes[setting.measures.index(measure)]
                    done.columns[measure.label][part[place]] = _fitting(measure, measure.of(solution), shape)
            except Exception as error:  # whatever it is, it is this member's
                _raise_others(error)
                done.fail(int(part[place]), error)


def _advice(setting: Setting) -> str:
    """Advice about starts that are not consistent."""
    return "begin each motion with the nearest consistent state: consistent=True, in a sweep file consistent = true" + (
        "" if setting.device == "cpu" else ", and leave device out")


def as_measured(setting: Setting, solution: Solution) -> Solution:
    """A motion of its own as outcomes get it: from a device with no more than is known there."""
    if setting.device == "cpu":
        return solution
    return _states_only(setting, solution.x, (solution.n_steps, solution.n_rejected), solution.params, solution.inputs[0])


def _states_only(setting: Setting, x: np.ndarray, steps: tuple[int, int], params: np.ndarray, inputs: np.ndarray) -> StatesOnly:
    """Solution that outcomes get of a motion that was integrated together with others."""
    module: Module = setting.system.module
    rtol, atol = checked_tolerances(module, setting.options.get("rtol", RTOL), setting.options.get("atol"))
    return StatesOnly(module, setting.times, x, steps, params, inputs, setting.options.get("method", METHOD),
                      (rtol, float(atol.max(initial=0.0))))


def _raise_others(error: Exception) -> None:
    """A facility that this process lacks is no fault of a member: another one may have it."""
    if isinstance(error, (NotSent, CompileError, CompilerNotFound, MissingExtra, OfDevice, MemoryError)):
        raise error


def numbers_of(setting: Setting) -> int:
    """Number of values of a motion."""
    n_columns = len(setting.options.get("sensitivities", ()))
    return len(setting.times) * max(1, len(setting.system.module.metadata.x)) * (1 + 2 * n_columns)


def held_at_once(setting: Setting) -> int:
    """Number of motions held at a time where several are integrated at once."""
    return max(1, (NUMBERS if setting.device == "cpu" else NUMBERS_OF_DEVICE) // numbers_of(setting))


def vectors_serve(module: Module, consistent: bool, options: Mapping[str, Any], measures: Sequence[Measure]) -> bool:
    """Whether motions can be integrated several at once, with the very steps of `simulate`; not for functions, which may ask a
    Solution for whatever a run of its own knows."""
    n, look = len(options.get("sensitivities", ())), wanted(module, options.get("events", True))
    return (not (why_one_by_one(module) or consistent) and events_serve(module, options, measures)
            and not any(m.kind == "function" for m in measures)
            and options.get("method", METHOD) in IN_LANES and not why_columns_one_by_one(module, look, n)
            and not (n and any(m.name not in module.metadata.x for m in measures))
            and set(options) <= {"rtol", "atol", "max_step", "first_step", "method", "events", "event_spacing", "sensitivities",
                                 "sensitivity_control"})


def events_serve(module: Module, options: Mapping[str, Any], measures: Sequence[Measure]) -> bool:
    """Whether outcomes need nothing of the events but what these do to the states at the output times."""
    look = wanted(module, options.get("events", True))
    stops = any(event.stop for event, sought in zip(module.metadata.events, look, strict=True) if sought)
    return not look.any() or not (stops or any(m.name not in module.metadata.x for m in measures))


def motion(setting: Setting, sample: np.ndarray) -> Solution:
    """The motion of one sample. Raises whatever is wrong with it."""
    module: Module = setting.system.module
    groups = {group: rows[0] for group, rows in _groups(setting, sample[None, :]).items()}
    q, u, p = groups["q"], groups["u"], groups["parameters"]
    if setting.consistent:
        keep = [n for n, (group, _) in zip(setting.names, setting.places, strict=True) if group in ("q", "u")]
        q, u = module.consistent(q, u, p, float(setting.times[0]), keep)
    try:
        solution = module.simulate(setting.times, q, u, p, z=groups["z"], inputs=groups["inputs"], **setting.options)
    except NotConsistent as error:
        raise NotConsistent(error.found, _advice(setting)) from None
    if not solution.success:
        raise MemberFailed(solution.message)
    return solution


def _groups(setting: Setting, samples: np.ndarray) -> dict[str, np.ndarray]:
    """Coordinates, speeds, states, parameters and inputs of samples, each (n, ...)."""
    groups = {name: np.tile(values, (len(samples), 1)) for name, values in setting.base.items()}
    for (group, place), column in zip(setting.places, samples.T, strict=True):
        groups[group][:, place] = column
    return groups


def _fitting(measure: Measure, value: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    if value.shape != shape:
        raise ArgumentError(f"outcome {shown(measure.label)} has the shape {value.shape}, elsewhere {shape}")
    return value


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
        group = next((g for g in GROUPS if name in metadata.names(g)), None)
        if group is None:
            unknown.append(name)
        else:
            places.append((group, metadata.names(group).index(name)))
    if unknown:
        raise ArgumentError(f"{module.name}: samples: there is no {', '.join(unknown)}; there are "
                            + "; ".join(f"{g}: {', '.join(metadata.names(g))}" for g in GROUPS if metadata.names(g)))
    base = {}
    for group in GROUPS:
        defaults: dict[str, Any] = dict(metadata.initial_values(group))
        if group == "parameters":
            known = dict(zip(metadata.parameters, metadata.defaults, strict=True))
            defaults = {n: v if v is not None or n not in names else 0.0 for n, v in known.items()}
        base[group] = take(given.get(group), metadata.names(group), group, defaults, module.name)
    return Setting(system, times, base, tuple(names), tuple(places), tuple(measures), consistent, dict(options))


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Warnings of simulations stand in the failures."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)
        yield


def _message(error: Exception) -> str:
    text = str(error) or type(error).__name__
    return (text if isinstance(error, SymdynError) else f"{type(error).__name__}: {text}")[:MESSAGE]
