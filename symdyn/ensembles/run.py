"""Ensembles: the same mechanism with many parameters and initial states, over all cores or machines."""

from __future__ import annotations

import contextlib
import errno
import itertools
import os
import random
import shutil
import tempfile
import time as clock
import warnings
import weakref
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symdyn.ensembles.chunk import LISTED, Chunk, quiet
from symdyn.ensembles.claims import ATTEMPTS, BEATS, LEASE, Claims, Heartbeat
from symdyn.ensembles.dispatch import AHEAD, ExecutorFailed, run_chunks
from symdyn.ensembles.exports import EXPORTS, demand_formats, missing
from symdyn.ensembles.lock import OneRun
from symdyn.ensembles.plan import Plan, demand_device, plan, whole
from symdyn.ensembles.progress import Progress, own_name
from symdyn.ensembles.result import Ensemble
from symdyn.ensembles.samples import Samples
from symdyn.ensembles.store import RESULT, Store, check_folder, check_same, write_manifest
from symdyn.errors import ArgumentError, EnsembleStopped, SimulationWarning
from symdyn.kinds import flag
from symdyn.progress import bar as progress_bar
from symdyn.runtime.module import Module
from symdyn.shown import shown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from symdyn.ensembles.samples import SampleValues
    from symdyn.given import Names, PathName, Row, Times, Values
    from symdyn.model.system import System
    from symdyn.runtime.module import InputValues

# The piece of work, next to the chunks, that puts these together.
MERGE = "merge"
# Seconds between looks at what others are doing, for workers that wait for them.
LOOK = 1.0


def ensemble(system: Module | System, samples: Samples | SampleValues, t: Times | None = None, outcomes: Any = None, *,
             q: Values | None = None, u: Values | None = None, z: Values | None = None, params: Values | None = None,
             inputs: InputValues | None = None, executor: Any = None, chunk: int | None = None, path: PathName | None = None,
             resume: bool = False, shared: bool = False, formats: Names = (), progress: bool = False, consistent: bool = False,
             outstanding: int | None = None, functions: tuple[str, ...] = (), rtol: float | None = None,
             atol: float | Row | None = None, method: str | type | None = None, max_step: float | None = None,
             first_step: float | None = None, max_steps: int | None = None,
             stabilization: str | tuple[str, float] | None = None, events: bool | str | Sequence[str] | None = None,
             event_spacing: float | None = None, sensitivities: Names | None = None, device: str = "cpu",
             precision: str | None = None) -> Ensemble:
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
    chunk       samples that are computed together, and written together; default: 1000, of few samples a sixteenth, of more
                than ten millions as many as make ten thousand chunks, of 64 MB at most
    path        folder for results, written as they come; default: a temporary one, removed with the result
    resume      go on with a run that was stopped, whatever stopped it; the result is the same, to the byte
    shared      processes on any machines that make this call with the same path share the work: each computes chunks that no
                other one has, and what a process that was killed had begun is taken over. They go on with what is there, and
                all return the whole result
    formats     files that are written next to ensemble.npz: "parquet", "zarr"; see Ensemble.to_parquet and to_zarr
    progress    show a bar (needs tqdm)
    consistent  begin each motion with the nearest state that fulfils the constraints; what is sampled is kept
    outstanding chunks that are handed to the executor at a time; default: three for every worker, one where work is shared
    functions   of the module that functions of a Solution call in other processes only
    rtol, atol, method, max_step, first_step, max_steps, stabilization, events, event_spacing   of `simulate`; None: as there
    sensitivities   what outcomes with "grad" are by, as for `simulate`: parameters, inputs, and initial values as "q1(0)";
                default: what is sampled
    device      "cpu", or "gpu", "gpu:1": members are integrated on an NVIDIA GPU, as `simulate_batch` does; chunks are 100,000
                samples, and one thread hands them to it, unless asked otherwise. Functions get states at output times there,
                and what is computed from these; what else they ask for raises
    precision   "double", or of a GPU "single", as for `simulate_batch`; None: "double"

    From 2000 samples on motions are integrated several at once in SIMD lanes, where `simulate_batch` does so and no outcome is
    a function, which may ask a Solution for whatever a run of its own knows. A member that fails has no numbers in its row,
    and is listed in `failures`. Warnings of single motions are not given, but one SimulationWarning reports members whose
    derivatives are outcomes and were warned of. Returns an Ensemble. Raises ArgumentError for what does not fit, and where
    another run is at work in the folder; EnsembleStopped where an executor died or the disk is full: what was done is kept, if
    there is a path; MissingExtra where a format needs a package.

    >>> import tempfile
    >>> module = sd.systems.pendulum().compile(backend="numpy")
    >>> found = sd.ensemble(module, {"l": [0.5, 1.0]}, (0, 1), ["end q1"], path=tempfile.mkdtemp())
    >>> found["end q1"].round(4)
    array([-1.9705, -1.491 ])
    """
    resume, shared, progress = (flag(v, f"an ensemble: {what}") for v, what in (
        (resume, "resume"), (shared, "shared"), (progress, "progress")))
    asked = plan(system, samples, t, outcomes, q=q, u=u, z=z, params=params, inputs=inputs, chunk=chunk, consistent=consistent,
                 functions=functions, sensitivities=sensitivities, device=device, precision=precision, rtol=rtol, atol=atol,
                 method=method, max_step=max_step, first_step=first_step, max_steps=max_steps, stabilization=stabilization,
                 events=events, event_spacing=event_spacing)
    module: Module = asked.setting.system.module
    how = How(executor, whole(outstanding, "outstanding", module), progress, demand_formats(formats, module.name),
              LEASE if shared else None)
    if shared and path is None:
        raise ArgumentError(f"{module.name}: shared=True without a path; pass that of a folder that all processes reach")
    if path is not None:
        if not isinstance(path, (str, Path)) or "\0" in str(path):
            raise ArgumentError(f"{module.name}: the path is {shown(path)}; pass that of a folder, as text or a Path")
        return run(asked, Path(path), how, resume)
    folder = Path(tempfile.mkdtemp(prefix="symdyn-ensemble-"))
    try:
        result = _warned(_in_folder(asked, folder, how, False, False), 3)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    weakref.finalize(result, shutil.rmtree, folder, ignore_errors=True)
    return result


@dataclass(frozen=True)
class How:
    """Who computes an ensemble, and what is written.

    outstanding   chunks that are handed to the executor at a time; None: by its workers
    lease         seconds without a sign of life after which the chunks of a worker go to others; None: work is not shared
    stays         a worker that finds nothing to do waits for the others, and takes over what they leave
    """

    executor: Any = None
    outstanding: int | None = None
    progress: bool = False
    formats: tuple[str, ...] = ()
    lease: float | None = None
    stays: bool = True


def run(asked: Plan, folder: Path, how: How, resume: bool) -> Ensemble:
    """Compute what is not there yet; see `ensemble`, which calls this. Raises StillAtWork if work is shared, and others have not
    done yet what is left, unless `how.stays`."""
    with OneRun(folder, how.lease is not None):
        return _warned(_in_folder(asked, folder, how, resume or how.lease is not None, True), 4)


class StillAtWork(Exception):
    """Nothing is left for this worker, but others have not completed what they have."""


def prepare(asked: Plan, folder: Path, resume: bool) -> tuple[Plan, Store]:
    """Try some samples, unless that was done, and write down what is requested in the folder, unless that stands there.

    Raises ArgumentError where a folder holds something else; OSError as the disk does.
    """
    result = check_folder(folder, resume)
    asked = asked if asked.setting.shapes else asked.tried()
    size = asked.size or (result or {}).get("chunk") or asked.chunk_size()
    manifest = asked.manifest(size)
    if result is None:
        write_manifest(folder, manifest)
        result = check_folder(folder, True) or {}  # another worker may have been faster
    check_same(folder, result, manifest)
    return asked, Store(folder, asked.samples.count, size, asked.columns)


def _warned(result: Ensemble, level: int) -> Ensemble:
    """The same, after a warning of what is doubtful in it, at the caller so many levels above."""
    if result.doubts:
        warnings.warn(f"{result.name}: {result.doubts}", SimulationWarning, stacklevel=level)
    return result


def _in_folder(asked: Plan, folder: Path, how: How, resume: bool, lasting: bool) -> Ensemble:
    if how.executor is None and not (folder / RESULT).is_file():
        demand_device(asked.setting)
    try:
        asked, store = prepare(asked, folder, resume)
    except OSError as error:
        raise EnsembleStopped(f"{asked.name}: the ensemble stopped: {_of_disk(error)}; nothing was computed", 0,
                              asked.samples.count) from error
    with quiet():
        return _Run(store, asked, how, lasting).go()


def _of_disk(error: OSError) -> str:
    """Error of the disk, in words."""
    why = "the disk is full" if error.errno in (errno.ENOSPC, errno.EDQUOT) else "results cannot be written"
    return f"{why} ({error})"


class _Run:
    """One run, with all that it needs to go on.

    claims   of this worker, if work is shared
    shown    what it has done, for whoever looks
    """

    def __init__(self, store: Store, asked: Plan, how: How, lasting: bool) -> None:
        self.store, self.plan, self.how, self.lasting = store, asked, how, lasting
        self.n_done = 0
        self.n_doubtful, self.doubts = 0, list[tuple[int, str]]()
        name = own_name()
        self.claims = None if how.lease is None else Claims(store.folder, name, how.lease)
        self.shown = Progress(store.folder, name)
        self.bar: Any = None

    def go(self) -> Ensemble:
        begun, store = clock.perf_counter(), self.store
        if store.complete() and (self.claims is None or not self._missing()):
            self.kept(self._finish)
            store.clear()
            return Ensemble(store.folder, store.count)
        there = self.kept(lambda: store.begin(self.claims is not None))
        self.n_done = n_before = self._count(there)
        self.bar = _bar(self.plan.name, store.count, n_before) if self.how.progress else None
        try:
            with self._visible():
                if self.claims is None:
                    self._compute(self.plan.chunk(k, store.size) for k in range(store.n_chunks) if k not in there)
                    self.kept(self._finish)
                else:
                    self._share(self.claims)
        except ExecutorFailed as error:
            raise self._stopped(str(error)) from error
        except KeyboardInterrupt:
            raise KeyboardInterrupt(f"interrupted; {self._what_is_kept()}") from None
        finally:
            if self.bar is not None:
                self.bar.close()
        store.clear()
        return Ensemble(store.folder, n_before, clock.perf_counter() - begun, self._doubts())

    @contextlib.contextmanager
    def _visible(self) -> Iterator[None]:
        """Show that this worker is alive, and what it has done."""
        def beat() -> None:
            if self.claims is not None:
                self.claims.touch()
            self.shown.write()

        if not self.lasting:
            yield
            return
        self.kept(self.shown.begin)
        try:
            with self.claims or contextlib.nullcontext(), Heartbeat((self.how.lease or LEASE) / BEATS, beat):
                yield
        finally:
            self.shown.write("has left")

    def _share(self, claims: Claims) -> None:
        """Compute what no other worker has, until all is there and put together."""
        while not self._complete():
            self._compute(self._claimed(claims))
            if len(self._look()) == self.store.n_chunks and claims.take([MERGE]) is not None:
                if not self._complete() and (self.store.complete() or not self.store.drop_damaged()):
                    self.shown.write("merging")
                    self.kept(self._finish)
                claims.release(MERGE)
                continue
            there = self.store.there()
            if lost := [piece for piece in claims.given_up() if piece == MERGE or int(piece) not in there]:
                raise ExecutorFailed(f"{ATTEMPTS} workers ended while they {self._doing(lost[0])}, which nobody tries again: "
                                     "their memory or their time may not suffice; start again with fewer samples in a chunk, "
                                     "more memory or more time")
            if not self.how.stays:
                left = self.store.count - self._count(there)
                others = f"{left} of {self.store.count} samples at work" if left else "begun to put the results together"
                raise StillAtWork(f"{self.plan.name}: nothing is left to begin; other workers have {others}")
            clock.sleep(LOOK)

    def _look(self) -> set[int]:
        """Chunks that are there, of all workers; the bar shows it."""
        there = self.store.there()
        if self.bar is not None:
            self.bar.update(self._count(there) - self.bar.n)
        return there

    def _claimed(self, claims: Claims) -> Iterator[Chunk]:
        """Chunks that this worker has claimed, as long as there are any; each begins somewhere else, so that few try the same."""
        while True:
            there = self._look()
            left = [f"{k:08d}" for k in range(self.store.n_chunks) if k not in there]
            cut = random.randrange(len(left)) if left else 0
            piece = claims.take([*left[cut:], *left[:cut]])
            if piece is None:
                return
            if int(piece) in self.store.there():  # another worker kept it between the two looks
                claims.release(piece)
                continue
            yield self.plan.chunk(int(piece), self.store.size)

    def _compute(self, todo: Iterator[Chunk]) -> None:
        """Compute chunks, and keep them."""
        first = next(todo, None)
        if first is None:
            return
        make, again, own = self._executors()
        arriving = run_chunks(itertools.chain([first], todo), make, again, self.how.outstanding,
                              AHEAD if self.claims is None else 1)
        wait = True
        try:
            for done in arriving:
                self.kept(lambda done=done: self.store.put(done))  # type: ignore[misc]
                n = self.store.samples_in(done.index)
                self.n_done += n
                self.shown.add(done, n)
                self.n_doubtful += done.n_doubtful
                self.doubts = sorted([*self.doubts, *done.doubts])[:LISTED]
                if self.claims is not None:
                    self.claims.release(f"{done.index:08d}")
                elif self.bar is not None:
                    self.bar.update(n)
        except KeyboardInterrupt:
            wait = self.claims is None  # others take what is not done
            raise
        finally:
            arriving.close()  # type: ignore[attr-defined]
            for made in own:
                made.shutdown(wait=wait, cancel_futures=True)

    def _complete(self) -> bool:
        return self.store.complete() and not self._missing()

    def _missing(self) -> list[str]:
        return missing(self.store.folder, self.how.formats)

    def _finish(self) -> None:
        """Put the chunks together, and write other formats."""
        if not self.store.complete():
            self.store.finish(self.plan.about(), self.plan.setting.times, self.plan.samples.block)
        for name in self._missing():
            EXPORTS[name].write(Ensemble(self.store.folder), self.store.folder / EXPORTS[name].file)

    def _count(self, chunks: set[int]) -> int:
        return sum(self.store.samples_in(k) for k in chunks)

    def kept(self, write: Callable[[], Any]) -> Any:
        """Do what writes to the disk; if the disk rejects it, report what is there."""
        try:
            return write()
        except OSError as error:
            if self.claims is not None and self._complete():  # others, who took this worker for dead, have done it all
                return None
            raise self._stopped(_of_disk(error)) from error

    def _stopped(self, why: str) -> EnsembleStopped:
        return EnsembleStopped(f"{self.plan.name}: the ensemble stopped: {why}; {self._what_is_kept()}", self.n_done,
                               self.store.count)

    def _doing(self, piece: str) -> str:
        if piece == MERGE:
            return "put the results together"
        first = int(piece) * self.store.size
        return f"computed samples {first} to {first + self.store.samples_in(int(piece)) - 1}"

    def _doubts(self) -> str:
        """Warning where derivatives of members are doubtful."""
        if not self.doubts:
            return ""
        more = f"; and {self.n_doubtful - LISTED} more" if self.n_doubtful > LISTED else ""
        listed = "; ".join(f"{k}: {text}" for k, text in self.doubts)
        return f"derivatives of {self.n_doubtful} of {self.store.count} members are doubtful: {listed}{more}"

    def _what_is_kept(self) -> str:
        if not self.lasting:
            return f"{self.n_done} of {self.store.count} samples were done; with a path they would be kept"
        n_kept = self.n_done if self.claims is None else self._count(self.store.there())
        return (f"{n_kept} of {self.store.count} samples are kept in {self.store.folder}; "
                "pass resume=True (--resume) to go on from there")

    def _executors(self) -> tuple[Callable[[], Executor], bool, list[Executor]]:
        """Function that gives executors, whether it gives another one, and the executors that this run ends."""
        own: list[Executor] = []
        given = self.how.executor
        if given is not None and hasattr(given, "submit"):
            return (lambda: given), False, own
        if given is not None and not callable(given):
            raise ArgumentError("an executor must be a concurrent.futures.Executor, or a function that makes one, "
                                f"found {shown(given)}")

        def make() -> Executor:
            workers = (os.cpu_count() or 1) if self.plan.setting.device == "cpu" else 1
            own.append(ThreadPoolExecutor(workers) if given is None else given())
            return own[-1]

        return make, True, own


def _bar(name: str, count: int, before: int) -> Any:
    return progress_bar(total=count, initial=before, desc=name, unit=" samples")
