"""Ensembles: the same mechanism with many parameters and initial states, over all cores or machines."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
import time as clock
import warnings
import weakref
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.right_side import METHOD, RightSide
from symdyn.ensembles.chunk import LISTED, Chunk, Setting, motion, quiet, setting_of, vectors_serve
from symdyn.ensembles.code import fingerprint
from symdyn.ensembles.dispatch import ExecutorFailed, run_chunks
from symdyn.ensembles.lock import OneRun
from symdyn.ensembles.measures import Measure, functions_of, output_times, take_measures
from symdyn.ensembles.portable import PortableModule, of_contacts
from symdyn.ensembles.result import Ensemble
from symdyn.ensembles.samples import Samples
from symdyn.ensembles.store import Store, check_folder, check_same, write_manifest
from symdyn.errors import ArgumentError, CompileError, CompilerNotFound, EnsembleStopped, SimulationWarning
from symdyn.kinds import flag
from symdyn.progress import bar as progress_bar
from symdyn.runtime.batches.on_device import demand_fit
from symdyn.runtime.batches.states import UNIT
from symdyn.runtime.gpu import device as devices
from symdyn.runtime.inputs.inputs import varies_over_time
from symdyn.runtime.integrating.events import wanted
from symdyn.runtime.integrating.sensitivities import names_of
from symdyn.runtime.module import Module
from symdyn.shown import shown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from symdyn.ensembles.samples import SampleValues
    from symdyn.given import Names, PathName, Row, Times, Values
    from symdyn.model.system import System
    from symdyn.runtime.module import InputValues

# Samples in a chunk, unless there are few samples or it is asked otherwise; chunks that few samples are divided into.
CHUNK, CHUNK_OF_DEVICE, PARTS = 1000, 100_000, 16
# Samples that are simulated in advance, to know the shapes of outcomes and what code workers need.
TRIED = 8
# From so many samples on it is worth compiling code that integrates several motions at once.
VECTORS_FROM = 2000


def ensemble(system: Module | System, samples: Samples | SampleValues, t: Times | None = None, outcomes: Any = None, *,
             q: Values | None = None, u: Values | None = None, z: Values | None = None, params: Values | None = None,
             inputs: InputValues | None = None, executor: Any = None, chunk: int | None = None, path: PathName | None = None,
             resume: bool = False, progress: bool = False, consistent: bool = False, outstanding: int | None = None,
             functions: tuple[str, ...] = (), rtol: float | None = None, atol: float | Row | None = None,
             method: str | type | None = None, max_step: float | None = None, first_step: float | None = None,
             max_steps: int | None = None, stabilization: str | tuple[str, float] | None = None,
             events: bool | str | Sequence[str] | None = None, event_spacing: float | None = None,
             sensitivities: Names | None = None, device: str = "cpu") -> Ensemble:
    """Simulate a mechanism for every sample, and keep some numbers of each motion.

    system      a Module, or a System, which is compiled
    samples     Samples, or a mapping from names or symbols of parameters, initial coordinates, speeds, extra states and inputs
                to arrays of one length: the k-th values belong to member k
    t           as for `simulate`
    outcomes    a list of texts "end q1", or start, min, max, mean, rms, trace (all times) of a coordinate, speed, input, output
                or "energy", and "q1 at 2.5"; all are of the values at the output times: least and greatest ones of these, mean
                and rms over time by the trapezoidal rule; "grad end q1" and the like are exact derivatives of these,
                of states and outputs, (n,) numbers, by `sensitivities`; or a mapping from labels to these or to functions of a
                Solution, which return a number or an array. Default: the end of all coordinates and speeds
    q, u, z, params, inputs   what is the same for all members, as for `simulate`; inputs are numbers
    executor    any concurrent.futures.Executor, or a function that makes one, which is called again if it dies. Processes and
                machines get the generated code as text and compile it once. Default: a thread for every core; compiled code lets
                others run meanwhile
    chunk       samples that are computed together, and written together; default: 1000, of few samples a sixteenth
    path        folder for results, written as they come; default: a temporary one, removed with the result
    resume      go on with a run that was stopped, whatever stopped it; the result is the same, to the byte
    progress    show a bar (needs tqdm)
    consistent  begin each motion with the nearest state that fulfils the constraints; what is sampled is kept
    outstanding chunks that are handed to the executor at a time; default: three for every worker
    functions   of the module that functions of a Solution call in other processes only
    rtol, atol, method, max_step, first_step, max_steps, stabilization, events, event_spacing   of `simulate`; None: as there
    sensitivities   what outcomes with "grad" are by, as for `simulate`: parameters, inputs, and initial values as "q1(0)";
                default: what is sampled
    device      "cpu", or "gpu", "gpu:1": members are integrated on an NVIDIA GPU, as `simulate_batch` does; chunks are 100,000
                samples, and one thread hands them to it, unless asked otherwise

    From 2000 samples on motions are integrated several at once in SIMD lanes, where `simulate_batch` does so. A member
    that fails has no numbers in its row, and is listed in `failures`. Warnings of single motions are not given, but one
    SimulationWarning reports members whose derivatives are outcomes and were warned of. Returns an Ensemble. Raises
    ArgumentError for what does not fit, and where another run is at work in the folder; EnsembleStopped where an executor died or
    the disk is full: what was done is kept, if there is a path.

    >>> import tempfile
    >>> module = sd.systems.pendulum().compile(backend="numpy")
    >>> found = sd.ensemble(module, {"l": [0.5, 1.0]}, (0, 1), ["end q1"], path=tempfile.mkdtemp())
    >>> found["end q1"].round(4)
    array([-1.9705, -1.491 ])
    """
    resume, progress, consistent = (flag(v, f"an ensemble: {what}") for v, what in (
        (resume, "resume"), (progress, "progress"), (consistent, "consistent")))
    module = system if isinstance(system, Module) else system.compile() if hasattr(system, "compile") else None
    if module is None:
        raise ArgumentError(f"an ensemble needs a Module or a System, found {shown(system, 80)}")
    drawn = samples if isinstance(samples, Samples) else Samples(samples, "paired")
    asked = {"rtol": rtol, "atol": atol, "method": method, "max_step": max_step, "first_step": first_step,
             "max_steps": max_steps, "stabilization": stabilization, "events": events, "event_spacing": event_spacing}
    options = {name: value for name, value in asked.items() if value is not None}
    measures = take_measures(outcomes, module)
    options |= _derivatives(module, drawn, measures, sensitivities)
    times = output_times(t, measures, module)
    gpu = devices.device_number(device, module.name)
    if gpu is not None:
        _check_device(module, gpu, options, consistent)
    vectors = gpu is not None or (drawn.count >= VECTORS_FROM and vectors_serve(module, consistent, options))
    together = [UNIT if gpu is None else RightSide(method=str(options.get("method", METHOD)), threads=True)] if vectors else []
    portable = PortableModule(module, [*functions_of(module, measures), *of_contacts(module, options), *functions, *together])
    given = {"q": q, "u": u, "z": z, "parameters": params, "inputs": inputs}
    if varies_over_time(inputs):
        raise ArgumentError(f"{module.name}: an ensemble takes numbers as inputs, found {shown(inputs, 80)}; write what goes "
                            "over time as an expression in sd.t, with parameters that samples may change, or run "
                            "module.simulate_batch, which takes functions, splines and tables")
    setting = setting_of(portable, drawn.names, times, measures, given, consistent, options)
    setting = replace(setting, vectors=vectors, device="cpu" if gpu is None else device)
    size, ahead = _whole(chunk, "chunk", module), _whole(outstanding, "outstanding", module)
    if path is not None:
        if not isinstance(path, (str, Path)) or "\0" in str(path):
            raise ArgumentError(f"{module.name}: the path is {shown(path)}; pass that of a folder, as text or a Path")
        with OneRun(Path(path)):
            return _told(_in_folder(Path(path), setting, drawn, executor, size, ahead, resume, progress, True))
    folder = Path(tempfile.mkdtemp(prefix="symdyn-ensemble-"))
    try:
        result = _told(_in_folder(folder, setting, drawn, executor, size, ahead, False, progress, False))
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    weakref.finalize(result, shutil.rmtree, folder, ignore_errors=True)
    return result


def _check_device(module: Module, number: int, options: Mapping[str, Any], consistent: bool) -> None:
    """Raises ArgumentError for what a device does not take, and where it is not there; MissingExtra."""
    others = {name: value for name, value in options.items() if name not in ("events", "event_spacing")}
    demand_fit(module, options.get("method", METHOD), None, others, bool(wanted(module, options.get("events", True)).any()))
    if consistent:
        raise ArgumentError(f"{module.name}: device='gpu' takes starts as they are; leave consistent out, or sample starts that "
                            "fulfil the constraints")
    devices.open_device(number, module.name).close()


def _told(result: Ensemble) -> Ensemble:
    """The same, after a warning of what is doubtful in it."""
    if result.doubts:
        warnings.warn(f"{result.name}: {result.doubts}", SimulationWarning, stacklevel=3)
    return result


def _derivatives(module: Module, samples: Samples, measures: Sequence[Measure], given: Any) -> dict[str, Any]:
    """The option of `simulate` with what outcomes are differentiated by. Raises ArgumentError with all that is wrong."""
    if not any(m.grad for m in measures):
        if given is not None:
            raise ArgumentError(f"{module.name}: sensitivities were given, but no outcome is a derivative; write 'grad end "
                                f"{module.metadata.x[0]}' or the like, or leave them out")
        return {}
    faults: list[str] = []
    by = given if given is not None else [f"{n}(0)" if n in module.metadata.x else n for n in samples.names]
    names = tuple(names_of(module, by, faults))
    if faults:
        raise ArgumentError("\n".join(f"{module.name}: {fault}" for fault in faults))
    return {"sensitivities": names}


def _in_folder(folder: Path, setting: Setting, samples: Samples, executor: Any, size: int | None, ahead: int | None,
               resume: bool, progress: bool, lasting: bool) -> Ensemble:
    found = check_folder(folder, resume)
    largest = CHUNK if setting.device == "cpu" else CHUNK_OF_DEVICE
    size = size or (found or {}).get("chunk") or min(largest, -(-samples.count // PARTS))
    with quiet():
        setting = _tried(setting, samples)
        manifest = _manifest(setting, samples, size)
        if found is not None:
            check_same(folder, found, manifest)
        store = Store(folder, samples.count, size, dict(zip([m.label for m in setting.measures], setting.shapes)))
        run = _Run(store, setting, samples, executor, ahead, progress, lasting)
        if found is None:
            run.kept(lambda: write_manifest(folder, manifest))
        return run.go()


class _Run:
    """One run, with all that it needs to go on."""

    def __init__(self, store: Store, setting: Setting, samples: Samples, executor: Any, outstanding: int | None,
                 progress: bool, lasting: bool) -> None:
        self.store, self.setting, self.samples = store, setting, samples
        self.executor, self.outstanding, self.progress, self.lasting = executor, outstanding, progress, lasting
        self.n_done = 0
        self.n_doubtful, self.doubts = 0, list[tuple[int, str]]()

    def go(self) -> Ensemble:
        begun, store = clock.perf_counter(), self.store
        if store.complete():
            return Ensemble(store.folder, store.count)
        there = self.kept(store.begin)
        self.n_done = n_before = sum(store.samples_in(k) for k in there)
        todo = (self._chunk(k) for k in range(store.n_chunks) if k not in there)
        make, again, own = self._executors()
        bar = _bar(self.setting.system.module.name, store.count, n_before) if self.progress else None
        arriving = run_chunks(todo, make, again, self.outstanding)
        try:
            for done in arriving:
                self.kept(lambda done=done: store.put(done))  # type: ignore[misc]
                self.n_done += store.samples_in(done.index)
                self.n_doubtful += done.n_doubtful
                self.doubts = sorted([*self.doubts, *done.doubts])[:LISTED]
                if bar is not None:
                    bar.update(store.samples_in(done.index))
        except ExecutorFailed as error:
            raise self._stopped(str(error)) from error
        except KeyboardInterrupt:
            raise KeyboardInterrupt(f"interrupted; {self._what_is_kept()}") from None
        finally:
            arriving.close()  # type: ignore[attr-defined]
            for made in own:
                made.shutdown(wait=True, cancel_futures=True)
            if bar is not None:
                bar.close()
        self.kept(lambda: store.finish(self._about(), self.setting.times, self.samples.block))
        return Ensemble(store.folder, n_before, clock.perf_counter() - begun, self._doubts())

    def kept(self, write: Callable[[], Any]) -> Any:
        """Do what writes to the disk; if the disk rejects it, report what is there."""
        try:
            return write()
        except OSError as error:
            why = "the disk is full" if error.errno in (errno.ENOSPC, errno.EDQUOT) else "results cannot be written"
            raise self._stopped(f"{why} ({error})") from error

    def _stopped(self, why: str) -> EnsembleStopped:
        return EnsembleStopped(f"{self.setting.system.module.name}: the ensemble stopped: {why}; {self._what_is_kept()}",
                               self.n_done, self.store.count)

    def _doubts(self) -> str:
        """What to warn of where derivatives of members are doubtful."""
        if not self.doubts:
            return ""
        more = f"; and {self.n_doubtful - LISTED} more" if self.n_doubtful > LISTED else ""
        listed = "; ".join(f"{k}: {text}" for k, text in self.doubts)
        return f"derivatives of {self.n_doubtful} of {self.store.count} members are doubtful: {listed}{more}"

    def _what_is_kept(self) -> str:
        if not self.lasting:
            return f"{self.n_done} of {self.store.count} samples were done; with a path they would be kept"
        return (f"{self.n_done} of {self.store.count} samples are kept in {self.store.folder}; "
                "pass resume=True (--resume) to go on from there")

    def _chunk(self, k: int) -> Chunk:
        first = k * self.store.size
        return Chunk(self.setting, k, first, self.samples.block(first, first + self.store.samples_in(k)))

    def _executors(self) -> tuple[Callable[[], Executor], bool, list[Executor]]:
        """What gives executors, whether it gives another one, and those that are ours to end."""
        own: list[Executor] = []
        given = self.executor
        if given is not None and hasattr(given, "submit"):
            return (lambda: given), False, own
        if given is not None and not callable(given):
            raise ArgumentError("an executor must be a concurrent.futures.Executor, or a function that makes one, "
                                f"found {shown(given)}")

        def make() -> Executor:
            workers = (os.cpu_count() or 1) if self.setting.device == "cpu" else 1
            own.append(ThreadPoolExecutor(workers) if given is None else given())
            return own[-1]

        return make, True, own

    def _about(self) -> dict[str, Any]:
        module, measures = self.setting.system.module, self.setting.measures
        return {"system": module.name, "names": list(self.samples.names), "varied": list(self.samples.varied),
                "outcomes": [m.label for m in measures], "count": self.store.count,
                "shapes": {m.label: s for m, s in zip(measures, self.setting.shapes)},
                "traces": [m.label for m in measures if m.kind == "trace"], "units": {"energy": "J", **module.metadata.units},
                "about": {m.label: m.record() for m in measures},
                "sensitivities": list(self.setting.options.get("sensitivities", ())),
                "rtol": self.setting.options.get("rtol", 1e-8)}


def _tried(setting: Setting, samples: Samples) -> Setting:
    """The setting with the shapes of outcomes. Raises ArgumentError where all that was tried is asked for wrongly."""
    module: Module = setting.system.module
    places = sorted({int(k) for k in np.linspace(0, samples.count - 1, TRIED)})
    wrong: list[ArgumentError] = []
    for k in places:
        try:
            solution = motion(setting, samples.block(k, k + 1)[0])
            return replace(setting, shapes=tuple(m.of(solution).shape for m in setting.measures))
        except ArgumentError as error:
            wrong.append(error)
        except (CompileError, CompilerNotFound):
            raise
        except Exception:  # it will stand among the failures
            continue
    if len(wrong) == len(places):
        raise ArgumentError(f"none of {len(places)} samples that were tried can be simulated; the first: {wrong[0]}")
    return replace(setting, shapes=tuple(_shape(m, setting, module) for m in setting.measures))


def _shape(measure: Measure, setting: Setting, module: Module) -> tuple[int, ...]:
    """The shape of an outcome where no motion shows it; of a function a number."""
    own = dict(module.metadata.outputs).get(measure.name, ())
    by = (len(setting.options["sensitivities"]),) if measure.grad else ()
    return (len(setting.times), *own, *by) if measure.kind == "trace" else (*own, *by)


def _manifest(setting: Setting, samples: Samples, size: int) -> dict[str, Any]:
    portable: PortableModule = setting.system
    functions = {m.label: fingerprint(m.function) for m in setting.measures if m.function is not None}
    return {**({"functions": functions} if functions else {}), "system": portable.module.name,
            "code": portable.key(), "backend": portable.module.backend, "chunk": size, "samples": samples.record(),
            "t": [float(setting.times[0]), float(setting.times[-1]), len(setting.times)],
            "outcomes": {m.label: m.record() for m in setting.measures}, "consistent": setting.consistent,
            "vectors": setting.vectors, **({} if setting.device == "cpu" else {"device": setting.device}),
            "base": {k: v.tolist() for k, v in setting.base.items()},
            "options": {k: v if isinstance(v, (int, float, str)) else repr(v) for k, v in setting.options.items()}}


def _whole(value: Any, what: str, module: Module) -> int | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
        raise ArgumentError(f"{module.name}: {what} must be a whole number from 1 on, found {shown(value)}")
    return int(value)


def _bar(name: str, count: int, before: int) -> Any:
    return progress_bar(total=count, initial=before, desc=name, unit=" samples")
