"""`symdyn sweep` on a cluster: its jobs under Slurm, the scheduler of Dask, what all workers do, and what a sweep will take."""

from __future__ import annotations

import argparse
import contextlib
import math
import os
import signal
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from symdyn.cli.messages import INTERRUPTED, Stop
from symdyn.counting import counted
from symdyn.ensembles.cluster import Cluster, in_time

if TYPE_CHECKING:
    from symdyn.ensembles.plan import Plan
    from symdyn.ensembles.prediction import Limit, Measured, Prediction

# Workers that --status lists, and limits that --dry-run lists.
LISTED, LIMITS = 20, 4
# In place of times of a device that this machine lacks.
UNTIMED = "times on a GPU are not predicted: this machine has none that answers"
HERE = ("localhost", "127.0.0.1", "[::1]")


def with_scheduler(arguments: argparse.Namespace, cluster: Cluster | None, faults: list[str]) -> Cluster | None:
    """The cluster with the number of workers of the command line, and for Dask with a scheduler that may be connected to.

    A scheduler can run programs in this process, and a sweep file may come from anyone: so that one of another machine must be
    confirmed, on the command line or by Dask's own configuration.
    """
    if cluster is None:
        return None
    if arguments.workers is not None:
        cluster = replace(cluster, workers=arguments.workers)
    if cluster.kind != "dask" or arguments.dry_run or arguments.join:
        return cluster
    configured = _configured()
    address = arguments.dask or cluster.address or configured
    if address is None:
        faults.append("cluster: dask is asked for, but no scheduler; write dask = \"tcp://host:8786\" in the place of the line, "
                      "pass --dask ADDRESS, or set DASK_SCHEDULER_ADDRESS")
    elif address not in (arguments.dask, configured) and _host(address) not in HERE:
        faults.append(f"dask: {address!r:.80} is on another machine, and a scheduler can run programs here, which a sweep file "
                      f"must not: confirm it, by --dask {address if address.isprintable() else 'ADDRESS':.80} or in "
                      "DASK_SCHEDULER_ADDRESS")
    return replace(cluster, address=address)


def _configured() -> str | None:
    """The scheduler of Dask's configuration."""
    try:
        import dask
    except ImportError:
        return os.environ.get("DASK_SCHEDULER_ADDRESS")
    result = dask.config.get("scheduler-address", None)
    return str(result) if result else None


def _host(address: str) -> str:
    """The host of an address such as tcp://host:8786, or host:8786."""
    _, protocol, place = address.partition("://")
    return (place if protocol else address).rpartition(":")[0]


def show_status(folder: Path, cluster: Cluster | None) -> int:
    """Print how far the run in a folder is."""
    from symdyn.ensembles.claims import LEASE
    from symdyn.ensembles.progress import read_status
    from symdyn.ensembles.slurm import queue

    result = read_status(folder, cluster.lease if cluster is not None else LEASE)
    failed = f", {result.n_failed} of them failed" if result.n_failed else ""
    if result.complete:
        print(f"{result.system}: all {result.count} samples are done{failed}; the results are in {folder}")
        return 0
    part = 100 * result.n_done / result.count
    print(f"{result.system}: {result.n_done} of {result.count} samples are done ({part:.3g} %){failed}")
    lost = [w for w in result.workers if w.lost]
    working = [w for w in result.workers if not w.lost and w.state != "has left"]
    left = f", about {in_time((result.count - result.n_done) / result.rate)} are left" if result.rate else ""
    print(f"{counted(len(working), 'worker')} at work"
          + (f", {len(lost)} lost" if lost else "") + (f": {result.rate:.3g} samples a second{left}" if working else ""))
    for worker in result.workers[:LISTED]:
        state = "is lost" if worker.lost else worker.state
        print(f"  {worker.name}{f' (job {worker.task})' if worker.task else ''}: {counted(worker.samples, 'sample')}, {state}, "
              f"heard of {in_time(worker.silent)} ago")
    if len(result.workers) > LISTED:
        print(f"  and {len(result.workers) - LISTED} more")
    if jobs := queue(folder):
        print(jobs)
    return 0


def submit(arguments: argparse.Namespace, plan: Plan, cluster: Cluster, folder: Path, formats: tuple[str, ...]) -> int:
    """Predict, write down what is requested, and submit workers. Raises Stop where the cluster gives them too little."""
    from symdyn.ensembles.claims import Claims
    from symdyn.ensembles.exports import missing
    from symdyn.ensembles.lock import OneRun
    from symdyn.ensembles.prediction import contradictions
    from symdyn.ensembles.progress import own_name
    from symdyn.ensembles.run import MERGE, prepare
    from symdyn.ensembles.slurm import script
    from symdyn.ensembles.slurm import submit as send
    from symdyn.ensembles.store import check_folder
    from symdyn.runtime.building.stored import write_whole

    with OneRun(folder):
        there = check_folder(folder, arguments.resume)
        asked = plan.size is not None
        plan = plan if there is None else replace(plan, size=there["chunk"])
        plan, measured, result = _predicted(plan, cluster, folder, formats)
        faults = contradictions(result, measured, cluster, asked)
        if faults:
            several = len(faults) > 1
            raise Stop(f"{arguments.file} has {len(faults)} faults:\n  - " * several + f"{arguments.file}: " * (not several)
                       + "\n  - ".join(faults))
        plan, store = prepare(plan, folder, arguments.resume)
        with Claims(folder, own_name(), cluster.lease) as claims:
            claims.forget_ended()
            busy = claims.at_work()
        if busy:
            if busy == [MERGE]:
                raise Stop(f"the results of {folder} are being put together by a worker; wait until it has ended")
            raise Stop(f"{counted(len(busy), 'chunk')} of {folder} {'is' if len(busy) == 1 else 'are'} being computed by workers"
                       f"; --status shows them, and sbatch {folder / 'slurm.sh'} adds workers")
        text = arguments.file.read_bytes()
        copy = folder / "sweep.toml"
        write_whole(copy, lambda file: file.write(text))
        home = folder.resolve()
        command = [sys.executable, "-m", "symdyn", "sweep", str(home / copy.name), "--join", "--output", str(home)]
        command += ["--system", _place(arguments.system)] if arguments.system else []
        command += ["--backend", plan.setting.system.module.backend] + ["--no-picture"] * arguments.no_picture
        unwritten = missing(folder, formats) if store.complete() else []
        cluster = replace(cluster, workers=1) if unwritten else cluster
        job = send(home, script(cluster, plan.name, home, command, plan.setting.device != "cpu"))
    if unwritten:
        print(f"{plan.name}: Slurm's job {job} with 1 worker writes {' and '.join(unwritten)}; all {store.count} samples "
              "are done")
        return 0
    print(f"{plan.name}: Slurm's job {job} with {counted(cluster.workers or 1, 'worker')} computes "
          f"{counted(store.count, 'sample')} in {counted(store.n_chunks, 'chunk')}")
    if measured.timed:
        print(f"  predicted: {in_time(result.wall)}, {result.core / 3600:.3g} {_what(plan)} hours, once all workers are there")
    else:
        print(f"  {UNTIMED}")
    if cluster.time is not None and cluster.time < result.wall:
        print(f"  the time limit of {in_time(cluster.time)} ends before: go on with --resume, about "
              f"{counted(math.ceil(result.wall / cluster.time), 'time')} in all, or ask for more workers or more time")
    print(f"  symdyn sweep {arguments.file} --status --output {folder} shows how far it is; scancel {job} stops it")
    return 0


def _place(system: str) -> str:
    """The path of a file for workers that may begin in another folder; a name of the catalogue as it is."""
    return str(Path(system).resolve()) if Path(system).is_file() else system


def dry_run(arguments: argparse.Namespace, plan: Plan, cluster: Cluster | None, folder: Path, formats: tuple[str, ...]) -> int:
    """Print what the sweep will take, and what breaks first with more motions. Raises Stop where the cluster gives too little."""
    from symdyn.ensembles.prediction import contradictions, limits

    cluster = cluster or Cluster("here", 1, arguments.jobs)
    asked = plan.size is not None
    plan, measured, result = _predicted(plan, cluster, folder, formats)
    _print_prediction(plan, measured, result, cluster)
    _print_limits(limits(plan if asked else replace(plan, size=None), measured, cluster, folder, result.workers, result.cores),
                  result.count)
    faults = contradictions(result, measured, cluster, asked)
    if faults:
        raise Stop(f"{arguments.file}: it would not run:\n  - " + "\n  - ".join(faults))
    return 0


def _predicted(plan: Plan, cluster: Cluster, folder: Path, formats: tuple[str, ...]) -> tuple[Plan, Measured, Prediction]:
    from symdyn.ensembles.prediction import fitted, measure, predict, usable_cores

    begun = sum(os.times()[:4])
    plan = plan.tried()
    on_gpu = plan.setting.device != "cpu"  # to which one thread of a worker hands chunks
    workers, cores = (cluster.workers or 1) * (cluster.gpus or 1), 1 if on_gpu else cluster.cores or usable_cores()
    measured = measure(plan, folder, cores, formats, begun)
    if cluster.kind == "slurm":
        plan = fitted(plan, measured, workers, cores, cluster.time)
    return plan, measured, predict(plan, measured, plan.samples.count, workers, cores)


def _print_prediction(plan: Plan, measured: Measured, result: Prediction, cluster: Cluster) -> None:
    n = len(measured.alone)
    print(f"{plan.name}: {result.count:,} motions for {counted(result.workers, 'worker')} of "
          f"{counted(result.cores, _what(plan))}, predicted from {n} of them")
    failed = f"; {100 * measured.failed:.0f} % of them failed" if measured.failed else ""
    cost = f", cost {result.core / 3600 * cluster.price:.3g}" if cluster.price is not None else ""
    chunks = f"{counted(result.files, 'chunk')} of {result.size:,}"
    if measured.timed:
        print(f"  a motion      {in_small(result.motion)} of a {_what(plan)}, from motion to motion ± {in_small(result.spread)}"
              f"{failed}")
        print(f"  {f'{_what(plan)} hours':13} {result.core / 3600:.3g} ± {100 * result.error:.0f} %{cost}")
        print(f"  wall time     {in_time(result.wall)}: {in_time(measured.start)} to begin, {in_time(result.merge)} to put the "
              f"results together, {chunks}, {in_small(result.chunk)} each")
    else:
        print(f"  a motion      {in_small(float(measured.alone.mean()))} of a core of this machine{failed}; {UNTIMED}")
        print(f"  wall time     that of the GPU, and {in_time(result.merge)} to put the results together, {chunks}")
    print(f"  disk          {_in_bytes(result.written)} at the most, {_in_bytes(result.result)} at the end; "
          f"{counted(result.files, 'file')} on the way")
    print(f"  memory        {_in_bytes(result.memory)} a worker")
    if idle := _idle(result):
        print(f"  idle          {idle}")


def _idle(result: Prediction) -> str:
    """Workers, or cores of them, for which there are no chunks, in words."""
    seats, there = result.workers * result.cores, counted(result.files, "chunk")
    if result.files >= seats:
        return ""
    left = (f"{result.workers - result.files:,} of {result.workers:,} workers" if result.files < result.workers else
            f"{seats - result.files:,} of {seats:,} cores")
    return f"{left}, as there {'is' if result.files == 1 else 'are'} {there}; ask for fewer" + (
        ", or for a smaller chunk" if result.size > 1 else "")


def _print_limits(result: list[Limit], count: int) -> None:
    print("  First limits with more motions:")
    for limit in result[:LIMITS]:
        beyond = " (this sweep is beyond it)" if limit.motions <= count else ""
        print(f"    at {limit.motions:.2g}: {limit.what}; {limit.remedy}{beyond}")


def _what(plan: Plan) -> str:
    """Words for what computes a motion."""
    return "core" if plan.setting.device == "cpu" else "GPU"


def in_small(seconds: float) -> str:
    """A duration in words, also of less than a second."""
    if seconds < 1e-3:
        return f"{1e6 * seconds:.3g} µs"
    return f"{1e3 * seconds:.3g} ms" if seconds < 1 else in_time(seconds)


def _in_bytes(size: float) -> str:
    for limit, unit, divided in ((1e9, "MB", 1e6), (1e12, "GB", 1e9), (1e15, "TB", 1e12)):
        if size < limit:
            return f"{size / divided:.3g} {unit}"
    return f"{size / 1e15:.3g} PB"


@contextlib.contextmanager
def ends_on_sign(shared: bool) -> Iterator[None]:
    """Where work is shared, a sign to end (Slurm's, when the time is over) interrupts this worker, so that it gives back what it
    has claimed; what its threads are computing is not waited for."""
    if not shared:
        yield
        return
    received: list[int] = []

    def interrupt(number: int, frame: object) -> None:
        received.append(number)
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
        if received:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(INTERRUPTED)
