"""A dry run: what an ensemble will take, from ten of its samples, for whatever number of them.

The ten are simulated one by one, which gives the spread of times, and together as the run will do it: in SIMD lanes and threads.
Chunks are written, put together and exported in a scratch folder on the file system of the results.
"""

from __future__ import annotations

import math
import os
import tempfile
import time as clock
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from symdyn.counting import counted
from symdyn.ensembles.chunk import Chunk, Done, held_at_once, numbers_of, quiet, run_chunk
from symdyn.ensembles.cluster import Cluster, in_time
from symdyn.ensembles.exports import EXPORTS
from symdyn.ensembles.plan import Plan, demand_device
from symdyn.ensembles.result import Ensemble
from symdyn.ensembles.samples import MOST, SOBOL_LIMIT
from symdyn.ensembles.store import Store
from symdyn.errors import MissingExtra
from symdyn.runtime.gpu.device import NoDevice
from symdyn.runtime.memory import available, in_bytes

SAMPLES = 10
# Seconds that motions of a dry run may take on one core, besides the first one.
PATIENCE = 60.0
# Seconds that a measured run in lanes or in threads takes at least: shorter ones measure the clock.
LEAST = 0.3
# Motions that are computed at once in a measurement, at most.
AT_ONCE = 4000
# Chunks of scratch results that are put together; samples in a small one, and bytes of it at the most; bytes of all large ones.
FEW, MANY, SMALL, SMALL_BYTES, TRIAL_BYTES = 2, 66, 64, 2**16, 2**25
# Files in a folder from which on listing it takes seconds on a cluster's file system.
COMFORTABLE = 100_000
# Probability within which the mean of all motions is, by Student's distribution of the ten.
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Measured:
    """Measurements of ten samples.

    alone       seconds of each motion by itself, on a core
    motion      seconds of one core, or of a GPU, for a motion as the run computes it; NaN: on a GPU that this machine lacks
    serial      the part of the work in which threads of a worker wait for each other
    put         seconds for a chunk, and for a byte of it, to write it
    merge       seconds once, for a chunk, and for a byte of the results, to put them together and to export them
    exported    bytes of other formats for a byte of ensemble.npz
    start       seconds until a worker computes its first motion;  memory: bytes that it has taken until then
    failed      part of the samples that failed
    """

    alone: np.ndarray
    motion: float
    serial: float
    put: tuple[float, float]
    merge: tuple[float, float, float]
    exported: float
    start: float
    memory: int
    failed: float

    @property
    def timed(self) -> bool:
        """Whether what computes the run is on this machine, so that it could be measured."""
        return not math.isnan(self.motion)

    def speedup(self, cores: int) -> float:
        """Rate of so many cores of a worker relative to one core, by Amdahl's law."""
        return 1 / (self.serial + (1 - self.serial) / cores)


@dataclass(frozen=True)
class Limit:
    """Limit to more motions: what it is, the number of motions from which on, and what to do."""

    what: str
    motions: float
    remedy: str


@dataclass(frozen=True)
class Prediction:
    """Cost of a number of motions.

    motion, spread     seconds of a core for a motion, and their standard deviation from motion to motion
    error              relative error of the sum over all motions, from the spread of ten
    core, wall         seconds: of cores or GPUs for all motions; until the results are there
    chunk              seconds for one chunk;  merge: to put all together
    written, result    bytes on the disk at the most, and at the end;  files: in the folder of chunks
    memory             bytes of a worker
    Times of the run are NaN where it is not timed.
    """

    count: int
    workers: int
    cores: int
    size: int
    motion: float
    spread: float
    error: float
    core: float
    wall: float
    chunk: float
    merge: float
    written: int
    result: int
    files: int
    memory: int


def measure(plan: Plan, folder: Path, cores: int, formats: tuple[str, ...], started: float = 0.0) -> Measured:
    """Simulate ten samples. The plan has been tried; folder: for results, on whose file system the disk is measured.

    cores     of a worker
    started   seconds that it took until the plan was there
    """
    taken = _rows(plan)
    with quiet():
        one_by_one = replace(plan.setting, vectors=False, device="cpu")
        alone, failures, spent = [], 0, 0.0
        run_chunk(Chunk(one_by_one, 0, 0, taken[:1]))  # what is done once in a process
        for k, row in enumerate(taken):
            seconds, done = _timed(Chunk(one_by_one, k, k, row[None]))
            alone.append(seconds)
            failures += len(done.failures)
            spent += seconds
            if spent > PATIENCE:
                break
        taken = taken[:len(alone)]
        motion = _together(plan, taken, float(np.mean(alone))) if _is_here(plan) else math.nan
        serial = _serial(plan, taken, motion, cores)
        memory = resident()
        put, merge, exported = _disk(plan, folder, formats)
        memory = resident() if formats else memory  # other formats bring packages of their own
    return Measured(np.array(alone), motion, serial, put, merge, exported, started, memory, failures / len(alone))


def predict(plan: Plan, measured: Measured, count: int, workers: int, cores: int) -> Prediction:
    """Cost of so many motions; arithmetic alone, whatever their number."""
    size = plan.chunk_size(count)
    n_chunks = -(-count // size)
    chunk_bytes = size * (8 * plan.outcome_numbers)
    motion, alone = measured.motion, measured.alone
    speed = measured.speedup(cores)
    # With one seat a core, a chunk takes longer where threads wait for each other.
    chunk = size * motion * cores / speed
    put = measured.put[0] + measured.put[1] * chunk_bytes
    rounds = -(-n_chunks // (workers * cores))
    last = count - (n_chunks - 1) * size
    work = (chunk if n_chunks > 1 else last * motion) * rounds
    wall = measured.start + max(work + put, n_chunks * put / workers)
    result = count * plan.row
    merge = measured.merge[0] + n_chunks * measured.merge[1] + result * measured.merge[2]
    kept = round(result * (1 + measured.exported))
    spread = float(np.std(alone, ddof=1) / np.mean(alone)) if len(alone) > 1 else 0.0
    error = spread * _student(len(alone)) / math.sqrt(len(alone)) if len(alone) > 1 else math.inf
    return Prediction(count, workers, cores, size, motion, spread * motion, error, count * motion, wall + merge, chunk, merge,
                      kept + count * 8 * plan.outcome_numbers, kept, n_chunks, _memory(plan, measured, size, cores))


def fitted(plan: Plan, measured: Measured, workers: int, cores: int, time: float | None = None) -> Plan:
    """The plan with a size of chunks for a cluster, unless it has one: some for every core, and none of more than ten minutes or
    a tenth of the time limit, since what a worker has begun is lost with it."""
    if plan.size is not None:
        return plan
    count = plan.samples.count
    seconds = min(600.0, time / 10) if time else 600.0
    most = int(seconds * measured.speedup(cores) / (measured.motion * cores)) if measured.timed else count
    size = min(plan.chunk_size(), max(1, most), -(-count // (4 * workers * cores)))
    return replace(plan, size=max(size, -(-count // COMFORTABLE)))


def contradictions(result: Prediction, measured: Measured, cluster: Cluster, asked: bool) -> list[str]:
    """Faults: what the cluster gives a worker, and does not suffice; asked: the size of a chunk was."""
    faults = []
    if cluster.time is not None and cluster.time < measured.start + result.chunk:
        remedy = "a smaller chunk" if asked and result.size > 1 else "a shorter motion"
        faults.append(f"cluster.time: {in_time(cluster.time)} are asked for, but a worker is predicted to take "
                      f"{in_time(measured.start)} until it begins and {in_time(result.chunk)} for one chunk of "
                      f"{counted(result.size, 'motion')}: it would end before anything is kept; ask for more time, or {remedy}")
    elif cluster.time is not None and cluster.time < result.merge:
        faults.append(f"cluster.time: {in_time(cluster.time)} are asked for, but to put the results together is predicted "
                      f"to take {in_time(result.merge)}; ask for more time")
    if cluster.memory is not None and cluster.memory < result.memory:
        faults.append(f"cluster.memory: {in_bytes(cluster.memory)} are asked for, but a worker is predicted to take "
                      f"{in_bytes(result.memory)}; ask for more" + (", or a smaller chunk" if result.size > 1 else ""))
    return faults


def limits(plan: Plan, measured: Measured, cluster: Cluster, folder: Path, workers: int, cores: int) -> list[Limit]:
    """Limits to more motions, the lowest first."""
    def of(n: int) -> Prediction:
        return predict(plan, measured, n, workers, cores)

    place = _there(folder)
    result: list[Limit] = []

    def add(what: str, holds: Callable[[int], bool], remedy: str) -> None:
        n = _first_above(holds)
        if n is not None:
            result.append(Limit(what, n, remedy))

    free = os.statvfs(place) if hasattr(os, "statvfs") else None
    if free is not None:
        space = free.f_frsize * free.f_bavail
        add(f"the disk: {space / 1e9:.3g} GB are free", lambda n: of(n).written <= space, "name a folder on a larger one "
            "by --output, or keep fewer outcomes")
    add(f"files in a folder: more than {COMFORTABLE} are slow to list", lambda n: of(n).files <= COMFORTABLE,
        "leave chunk out, or give a larger one" if plan.size else "keep fewer numbers of a motion")
    memory = cluster.memory or available()
    add(f"memory of a worker: {memory / 1e9:.3g} GB" + (" are asked for" if cluster.memory else " are available here"),
        lambda n: of(n).memory <= memory, "ask for more memory, or give a smaller chunk")
    add(f"a reader that takes a whole outcome into {available() / 1e9:.3g} GB of memory",
        lambda n: n * 8 * max((int(np.prod(s)) for s in plan.setting.shapes), default=1) <= available(),
        'write formats = ["parquet"] or ["zarr"], which are read in pieces')
    if cluster.time and measured.timed:
        limit = cluster.time
        add(f"the time limit of {limit / 3600:.3g} h for one array of {workers} workers", lambda n: of(n).wall <= limit,
            "ask for more workers, or go on with --resume")
    if cluster.time:
        most = cluster.time
        add("putting the results together within the time limit", lambda n: of(n).merge <= most, "ask for more time")
    if measured.timed:
        add("a year", lambda n: of(n).wall <= 365 * 86400, "ask for more workers")
    if plan.samples.sampling == "sobol":
        result.append(Limit("Sobol's sequence has no more points", SOBOL_LIMIT, "take latin_hypercube or random"))
    result.append(Limit(f"samples of {MOST / 1e12:.3g} TB, the most there may be", MOST // (8 * len(plan.samples.names)),
                        "divide the sweep into several"))
    return sorted(result, key=lambda limit: limit.motions)


def usable_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def resident() -> int:
    """Bytes of memory that this process has taken at the most; 0 where the system does not report it."""
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return 0
    return next((1024 * int(line.split()[1]) for line in lines if line.startswith("VmHWM:")), 0)


def _is_here(plan: Plan) -> bool:
    """Whether this machine has what computes the run."""
    try:
        demand_device(plan.setting)
    except (NoDevice, MissingExtra):
        return False
    return True


def _rows(plan: Plan) -> np.ndarray:
    """Ten samples, one of each tenth of all of them, (10, n_names); fewer if there are fewer."""
    count = plan.samples.count
    n = min(SAMPLES, count)
    places = ((np.arange(n) + np.random.default_rng(0).random(n)) * (count / n)).astype(int)
    return np.vstack([plan.samples.block(int(k), int(k) + 1) for k in np.minimum(places, count - 1)])


def _timed(chunk: Chunk) -> tuple[float, Done]:
    """Outcomes of a chunk, after the seconds of this thread on its core, whatever else the machine does meanwhile; where a GPU
    computes, those of the clock."""
    now = clock.thread_time if chunk.setting.device == "cpu" else clock.perf_counter
    begun = now()
    done = run_chunk(chunk)
    return now() - begun, done


def _tiled(rows: np.ndarray, n: int) -> np.ndarray:
    """So many samples, each of the ten as often as the others, in a mixed order."""
    return rows[np.random.default_rng(0).permutation(-(-n // len(rows)) * len(rows)) % len(rows)]


def _together(plan: Plan, rows: np.ndarray, alone: float) -> float:
    """Seconds of a core for a motion as the run computes it: in lanes where it does so."""
    if not plan.setting.vectors:
        return alone
    run_chunk(Chunk(plan.setting, 0, 0, rows))  # compiles
    n = len(rows)
    while True:
        values = _tiled(rows, n)
        seconds, _ = _timed(Chunk(plan.setting, 0, 0, values))
        if seconds > LEAST or n >= AT_ONCE:
            return seconds / len(values)
        n = min(AT_ONCE, max(2 * n, int(1.5 * n * LEAST / max(seconds, 1e-6))))


def _serial(plan: Plan, rows: np.ndarray, motion: float, cores: int) -> float:
    """The part of the work in which the threads of a worker wait for each other, by running two and more of them at once."""
    here = min(cores, usable_cores())
    if here < 2 or plan.setting.system.module.backend != "c" or plan.setting.device != "cpu":
        return 0.0
    values = _tiled(rows, max(2 if motion > LEAST else len(rows), min(AT_ONCE, int(LEAST / motion))))
    with ThreadPoolExecutor(here) as pool:
        list(pool.map(run_chunk, [Chunk(plan.setting, k, 0, values[:1]) for k in range(here)]))
        begun = clock.perf_counter()
        one = run_chunk(Chunk(plan.setting, 0, 0, values))
        single = clock.perf_counter() - begun
        begun = clock.perf_counter()
        list(pool.map(run_chunk, [Chunk(plan.setting, k, 0, values) for k in range(here)]))
        several = clock.perf_counter() - begun
    assert one.index == 0
    # speedup = here single / several = 1 / (s + (1 - s) / here)
    return float(np.clip((several / single - 1) / (here - 1), 0.0, 1.0))


def _disk(plan: Plan, folder: Path,
          formats: tuple[str, ...]) -> tuple[tuple[float, float], tuple[float, float, float], float]:
    """Seconds for a chunk and for a byte of it to write it; for all results, for a chunk and for a byte to put them together and
    export them; bytes of exports for one of the result: of numbers without any pattern, which no format makes smaller.

    The first results are the smallest, in which what a process does once, such as loading the packages of formats, is all that
    takes time. Later ones differ in the number of chunks alone, or in their bytes alone.
    """
    row, out = plan.row, 8 * plan.outcome_numbers
    small = max(1, min(SMALL, SMALL_BYTES // row))
    rows = max(small + 1, TRIAL_BYTES // (FEW * row))
    random = np.random.default_rng(0)

    def block(first: int, stop: int) -> np.ndarray:
        n = min(stop - first, plan.samples.count)
        at = first % (plan.samples.count - n + 1)
        drawn = plan.samples.block(at, at + n)
        return np.resize(drawn, (stop - first, len(plan.samples.names)))

    with tempfile.TemporaryDirectory(prefix=".symdyn-dry-run-", dir=_there(folder)) as name:
        def kept(store: Store, k: int, columns: dict[str, np.ndarray]) -> None:
            store.put(Done(k, columns))

        def export_all(store: Store) -> None:
            for label in formats:
                EXPORTS[label].write(Ensemble(store.folder), store.folder / EXPORTS[label].file)

        def trial(n_chunks: int, n: int, times: int = 2) -> tuple[Store, tuple[float, float, float]]:
            """The store, and seconds: a chunk of n rows, putting so many of them together, exporting the result; the least of
            some times."""
            store = Store(Path(name) / f"{n_chunks}-{n}", n_chunks * n, n, plan.columns)
            store.begin()
            columns = {label: random.random((n, *shape)) for label, shape in plan.columns.items()}
            about = {**plan.about(), "count": store.count}
            put = sum(_taken(partial(kept, store, k, columns)) for k in range(n_chunks))
            together = min(_taken(lambda: store.finish(about, plan.setting.times, block)) for _ in range(times))
            export = min(_taken(partial(export_all, store)) for _ in range(times))
            return store, (put / n_chunks, together, export)

        first = trial(FEW, small, 1)[1]
        few, many = trial(FEW, small)[1], trial(MANY, small)[1]
        store, large = trial(FEW, rows)
        others = sum(_size(store.folder / EXPORTS[label].file) for label in formats)
        exported = others / (store.count * row)
    put_byte = max(0.0, large[0] - many[0]) / max(1, out * (rows - small))
    together, export = (max(0.0, large[k] - few[k]) / (FEW * row * (rows - small)) for k in (1, 2))
    chunk = max(0.0, (many[1] - few[1]) / (MANY - FEW) - small * row * together)
    once = max(0.0, first[1] + first[2] - FEW * (chunk + small * row * (together + export)))
    return (max(0.0, many[0] - small * out * put_byte), put_byte), (once, chunk, together + export), exported


def _taken(action: Callable[[], object]) -> float:
    """Seconds that something takes."""
    begun = clock.perf_counter()
    action()
    return clock.perf_counter() - begun


def _memory(plan: Plan, measured: Measured, size: int, cores: int) -> int:
    """Bytes of a worker: what it had before, and for each core a chunk, its outcomes, and the motions that are held at once."""
    setting = plan.setting
    held = min(size, held_at_once(setting)) if setting.vectors else 1
    return measured.memory + 8 * cores * (held * numbers_of(setting) + size * (plan.outcome_numbers + len(plan.samples.names)))


def _there(folder: Path) -> Path:
    """The folder, or the next one above it that exists."""
    folder = folder.absolute()
    return next((place for place in (folder, *folder.parents) if place.is_dir()), Path.cwd())


def _size(path: Path) -> int:
    return sum(p.stat().st_size for p in ([path] if path.is_file() else path.rglob("*")) if p.is_file())


def _student(n: int) -> float:
    from scipy.stats import t

    return float(t.ppf(0.5 + CONFIDENCE / 2, n - 1))


def _first_above(holds: Callable[[int], bool]) -> int | None:
    """The number of motions from which on something does not hold, to three digits; None if it holds for 1e18."""
    low, high = 1, 10**18
    if holds(high):
        return None
    while high > low * 1.001 and high - low > 1:
        middle = math.isqrt(low * high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return high
