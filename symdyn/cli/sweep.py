"""`symdyn sweep`: many motions, as a TOML file describes."""

from __future__ import annotations

import argparse
import contextlib
import difflib
import os
import shlex
import time as clock
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symdyn.cli.find import is_of_catalogue, module_of
from symdyn.cli.messages import FAILED, INTERRUPTED, WRONG, Stop, complain
from symdyn.errors import ArgumentError, EnsembleStopped, MissingExtra, SymdynError

if TYPE_CHECKING:
    from symdyn.ensembles.cluster import Cluster
    from symdyn.ensembles.result import Ensemble
    from symdyn.ensembles.sweep_file import Sweep
    from symdyn.runtime.module import Module

# Messages of failed members that are printed; all of them are in the file.
SHOWN = 3
# Largest number of samples that are summarized, equally spaced among more, so that memory does not grow with their number.
SUMMARIZED = 100_000


def sweep(arguments: argparse.Namespace) -> int:
    """Read the file, simulate here or on a cluster, report, draw."""
    from symdyn.cli import sweep_on_cluster
    from symdyn.ensembles.claims import LEASE
    from symdyn.ensembles.exports import demand_formats, missing
    from symdyn.ensembles.plan import plan
    from symdyn.ensembles.run import How, StillAtWork, run
    from symdyn.ensembles.store import MANIFEST, RESULT
    from symdyn.ensembles.sweep_file import read_sweep

    begun = clock.perf_counter()
    faults: list[str] = []
    asked = read_sweep(arguments.file, faults, arguments.count)
    _check_arguments(arguments, asked, faults)
    folder = arguments.output or asked.folder or Path("generated") / arguments.file.stem
    if arguments.status:
        return sweep_on_cluster.show_status(folder, asked.cluster)
    cluster = sweep_on_cluster.with_scheduler(arguments, asked.cluster, faults)
    module = _checked(arguments, asked, faults)
    if arguments.join and not (folder / MANIFEST).is_file():
        raise Stop(f"{folder} holds no ensemble: there is nothing to join; start it without --join, or name its folder by "
                   "--output")
    wanted = plan(module, **asked.arguments(module))
    formats = demand_formats(asked.values.get("formats", ()), module.name)
    if arguments.dry_run:
        return sweep_on_cluster.dry_run(arguments, wanted, cluster, folder, formats)
    done_before = (folder / RESULT).is_file() and not missing(folder, formats)
    if cluster is not None and cluster.kind == "slurm" and not arguments.join and not done_before:
        return sweep_on_cluster.submit(arguments, wanted, cluster, folder, formats)
    shared = arguments.join or (cluster is not None and cluster.kind == "folder")
    with _executor(arguments, module, wanted.setting.device, cluster) as executor, \
            sweep_on_cluster.ends_on_sign(shared):
        lease = (cluster.lease if cluster is not None else LEASE) if shared else None
        how = How(executor, None, arguments.progress, formats, lease, not arguments.join or arguments.stay)
        try:
            done = run(wanted, folder, how, arguments.resume)
        except StillAtWork as others:
            print(others)
            return 0
        except EnsembleStopped as stop:
            return complain(str(stop), FAILED)
        except KeyboardInterrupt as stop:
            return complain(str(stop) or "interrupted", INTERRUPTED)
    _tell(done, clock.perf_counter() - begun)
    if not arguments.no_picture:
        try:
            done.plot(folder / "ensemble.png", asked.values.get("scatter"))
            print(f"wrote {folder / 'ensemble.png'}")
        except MissingExtra as error:
            print(f"no picture: {error}")
    return 0


def _check_arguments(arguments: argparse.Namespace, asked: Sweep, faults: list[str]) -> None:
    """A contradiction on the command line is an error by itself; one of the command line and the file is a fault of the file."""
    wrong = []
    if arguments.jobs is not None and arguments.jobs < 1:
        wrong.append(f"--jobs must be 1 or more, found {arguments.jobs}")
    if arguments.jobs is not None and arguments.dask is not None:
        wrong.append("--jobs is for this machine, --dask for a cluster; give one of them")
    modes = [name for name, given in (("--dry-run", arguments.dry_run), ("--status", arguments.status),
                                      ("--join", arguments.join)) if given]
    if len(modes) > 1:
        wrong.append(f"{' and '.join(modes)} ask for different things; give one of them")
    if arguments.join and arguments.dask is not None:
        wrong.append("--join computes here, --dask on a cluster; give one of them")
    if arguments.stay and not arguments.join:
        wrong.append("--stay goes with --join: a run that does not share its work does not end before it is done")
    if arguments.count is not None and not arguments.dry_run:
        wrong.append("--count goes with --dry-run; for the run itself write the count into the file")
    if wrong:
        raise Stop("\n".join(wrong))
    kind = asked.cluster.kind if asked.cluster is not None else None
    if arguments.workers is not None and kind is None:
        faults.append(f"--workers {arguments.workers}: the file names no cluster; give it a line such as cluster = \"slurm\", or "
                      "pass --jobs for this machine")
    if kind == "slurm" and arguments.dask is not None:
        faults.append(f"cluster: slurm is asked for, and --dask {arguments.dask} too; leave out one of them")
    on_gpu = asked.values.get("device", "cpu") != "cpu"
    if on_gpu and arguments.jobs is not None:
        faults.append(f"device: a GPU is asked for, but --jobs {arguments.jobs} is for cores; leave --jobs out, and start a "
                      "worker for each GPU by --join, with CUDA_VISIBLE_DEVICES")
    if not on_gpu and asked.cluster is not None and asked.cluster.gpus is not None:
        faults.append('cluster.gpus: motions are computed by cores; give the file the line device = "gpu", or leave gpus out')
    if kind in ("slurm", "dask") and arguments.jobs is not None and not arguments.join:
        faults.append(f"cluster: {kind} is asked for, but --jobs is for this machine; write cores and workers into [cluster]")


def _checked(arguments: argparse.Namespace, asked: Sweep, faults: list[str]) -> Module:
    """The module, if there is no fault in the file. Raises Stop with all of them.

    The file may name a system of the catalogue only: it is data, and whatever else a name stands for is a program.
    """
    from symdyn.ensembles.measures import output_times, read_measures

    name = arguments.system
    if name is None and "system" in asked.values:
        if is_of_catalogue(asked.values["system"]):
            name = asked.values["system"]
        else:
            faults.append(_not_of_catalogue(asked.values["system"], arguments.file))
    module = None
    if name is None and not any(f.startswith(("system", "not TOML", "there is no such", "cannot be read")) for f in faults):
        faults.append("system: is missing; name one of the catalogue, or pass a Python file by --system")
    if name is not None:
        try:
            module = module_of(name, asked.values.get("options", {}), arguments.backend,
                               asked.values.get("formulation", "auto"), asked.values.get("coordinates", "relative"))
            faults += asked.unknown_names(module.metadata)
        except (Stop, SymdynError) as error:
            faults.append(f"system: {error}")
    if module is not None:
        before = len(faults)
        measures = read_measures(asked.values.get("outcomes"), module, faults)
        if len(faults) == before:
            _check_scatter(asked, [m.label for m in measures], faults)
        try:
            output_times(asked.values.get("t"), measures, module)
        except ArgumentError as error:
            faults.append(f"t: {str(error).removeprefix(module.name + ': ')}")
    if faults or module is None:
        several = len(faults) > 1
        head = f"{arguments.file} has {len(faults)} faults:\n  - " if several else f"{arguments.file}: "
        raise Stop(head + "\n  - ".join(faults), WRONG)
    return module


def _not_of_catalogue(name: str, file: Path) -> str:
    """The fault of a sweep file that asks for anything but a system of the catalogue, with what to do about it."""
    from symdyn import systems

    near = difflib.get_close_matches(name, systems.names(), 3, cutoff=0.5)
    program = name if name.endswith(".py") and name.isprintable() else "my_mechanism.py"
    return (f"system: must be a system of the catalogue (see symdyn list), found {name!r:.80}"
            + (f", did you mean {' or '.join(near)}?" if near else "")
            + "; a sweep file is data, and runs no program. To sweep a system of your own, leave the key out and name its Python "
            f"file on the command line: symdyn sweep {shlex.quote(str(file))} --system {shlex.quote(program)}; or call "
            "symdyn.ensemble(system, symdyn.Samples(...), t, outcomes) from Python")


def _check_scatter(asked: Sweep, labels: list[str], faults: list[str]) -> None:
    names = asked.samples.names if asked.samples is not None else ()
    for k, (x, y) in enumerate(asked.values.get("scatter", [])):
        if asked.samples is not None and x not in (*names, *labels):
            faults.append(f"scatter[{k + 1}]: {x!r} is neither varied nor an outcome")
        if y not in labels:
            faults.append(f"scatter[{k + 1}]: {y!r} is no outcome")


@contextlib.contextmanager
def _executor(arguments: argparse.Namespace, module: Module, device: str = "cpu",
              cluster: Cluster | None = None) -> Iterator[Any]:
    """Executor that --jobs, --dask and the file name: a cluster; threads where code is compiled, else processes, which do not
    wait for each other. None, the default of an ensemble, where a GPU of this machine computes."""
    address = arguments.dask or (cluster.address if cluster is not None and not arguments.join else None)
    if address is not None:
        try:
            from distributed import Client
        except ImportError:
            raise MissingExtra("--dask needs Dask: pip install 'symdyn[dask]'") from None
        from symdyn.ensembles.dispatch import silent_connections

        try:
            client = Client(address, timeout=arguments.dask_timeout)
        except (OSError, ValueError, TimeoutError) as error:
            raise Stop(f"--dask {address}: no scheduler there ({error})", FAILED) from None
        with silent_connections(), client:
            yield client.get_executor()
        return
    from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
    from multiprocessing import get_context

    cores = cluster.cores if cluster is not None and cluster.kind == "folder" else None
    jobs = arguments.jobs or cores or os.cpu_count() or 1
    if device != "cpu":
        yield None
    elif module.backend == "c" or jobs == 1:
        yield lambda: ThreadPoolExecutor(jobs)
    else:
        yield lambda: ProcessPoolExecutor(jobs, mp_context=get_context("spawn"))


def _tell(done: Ensemble, seconds: float) -> None:
    fresh = done.count - done.n_resumed
    print(f"{done.name}: {done.count} samples of {', '.join(done.names)}"
          + (f", {done.n_resumed} of them computed before" if done.n_resumed else "")
          + (f", {fresh} in {seconds:.3g} s ({fresh / seconds:.0f} a second)" if fresh else ""))
    for label in done.labels:
        if label not in done.traces:
            _tell_outcome(done, label)
    if done.n_failed:
        print(f"{done.n_failed} samples failed:")
        for failure in done.failures(SHOWN):
            values = ", ".join(f"{n} = {float(v):.6g}" for n, v in failure["values"].items())
            print(f"  sample {failure['index']} ({values}): {failure['message']}")
        if done.n_failed > SHOWN:
            print(f"  and {done.n_failed - SHOWN} more, see {done.path / 'failures.jsonl'}")
    print(f"wrote {done.file}")


def _tell_outcome(done: Ensemble, label: str) -> None:
    import numpy as np

    from symdyn.ensembles.archive import thinned

    if done.shapes[label]:
        return
    step = max(1, -(-done.count // SUMMARIZED))
    values = thinned(done.file, label, step)
    values = values[np.isfinite(values)]  # of members that failed there are none
    if not len(values):
        return
    low, middle, high = np.quantile(values, (0.05, 0.5, 0.95))
    print(f"  {label}: mean {values.mean():.6g}, 5 % {low:.6g}, median {middle:.6g}, 95 % {high:.6g}, from {values.min():.6g} to "
          f"{values.max():.6g}" + (f" (of every {step}th sample)" if step > 1 else ""))
