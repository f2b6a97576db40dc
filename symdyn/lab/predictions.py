"""`symdyn bench predictions`: what dry runs predict compared with what sweeps take; the memory in which results are merged."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time as clock
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.errors import ArgumentError, SymdynError

# Short motions in lanes; a closed loop; chaotic motions of which all output times are kept, and written as a table, too.
SWEEPS = {"short": """
system = "double_pendulum"
t = [0, 1]
sampling = "latin_hypercube"
count = {short}
outcomes = ["end q1", "end q2"]
[parameters]
l1 = {{from = 0.8, to = 1.2}}
[initial]
q1 = {{from = -1, to = 1}}
""", "loop": """
system = "four_bar"
t = [0, 5]
sampling = "random"
count = {loop}
consistent = true
outcomes = ["max q1_dot", "mean energy"]
[initial]
q1_dot = {{from = 1, to = 6}}
""", "traces": """
system = "n_link_pendulum"
options = {{n = 4}}
t = {{from = 0, to = 10, count = 201}}
sampling = "sobol"
count = {traces}
outcomes = ["trace q1", "trace q4"]
formats = ["parquet"]
[initial]
q1 = {{from = -2, to = 2}}
q2 = {{from = -1, to = 1}}
"""}
COUNTS = {"short": 100_000, "loop": 2_000, "traces": 8_192}


@dataclass(frozen=True)
class Taken:
    """Seconds of cores and of the clock, bytes of the results, and of memory."""

    core: float
    wall: float
    result: float
    memory: float


def predicted(path: str, jobs: int) -> None:
    """Print what a dry run of a sweep file predicts, as JSON."""
    from symdyn.ensembles.plan import plan
    from symdyn.ensembles.prediction import measure, predict
    from symdyn.ensembles.sweep_file import read_sweep
    from symdyn.runtime.building.recall import recall

    faults: list[str] = []
    file = Path(path)
    asked = read_sweep(file, faults)
    module = recall(asked.values["system"], asked.values.get("options", {}))
    begun = sum(os.times()[:4])
    tried = plan(module, **asked.arguments(module)).tried()
    measured = measure(tried, file.parent, jobs, tuple(asked.values.get("formats", ())), begun)
    result = predict(tried, measured, tried.samples.count, 1, jobs)
    print(json.dumps(asdict(Taken(result.core + measured.start + result.merge, result.wall, result.result, result.memory))))


def taken(file: Path, jobs: int, out: Path) -> Taken:
    """Cost of the sweep. Raises SymdynError if it fails."""
    begun = clock.perf_counter()
    run = subprocess.Popen([sys.executable, "-m", "symdyn", "sweep", str(file), "--no-picture", "--output", str(out), "--jobs",
                            str(jobs)], stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(run.pid, 0)
    if status:
        raise SymdynError(f"the sweep {file.name} ended with status {status}; what it printed is above")
    size = sum(p.stat().st_size for p in out.glob("ensemble.*"))
    return Taken(used.ru_utime + used.ru_stime, clock.perf_counter() - begun, size, 1024 * used.ru_maxrss)


def merged(rows: int) -> None:
    """Print the memory in which so many rows are put together, and written as Parquet and Zarr, as JSON."""
    from symdyn.ensembles.chunk import Done
    from symdyn.ensembles.exports import EXPORTS, demand_formats
    from symdyn.ensembles.prediction import resident
    from symdyn.ensembles.result import Ensemble
    from symdyn.ensembles.samples import Samples
    from symdyn.ensembles.store import Store

    demand_formats(list(EXPORTS), "results")
    import pyarrow.parquet  # noqa: F401
    import zarr  # noqa: F401

    samples = Samples({n: {"from": 0, "to": 1} for n in "abc"}, "latin_hypercube", rows, 1)
    with tempfile.TemporaryDirectory(prefix="symdyn-bench-") as name:
        size = max(1000, -(-rows // 10_000))
        store = Store(Path(name), rows, size, {"one": (), "two": ()})
        store.begin()
        random = np.random.default_rng(0)
        for k in range(store.n_chunks):
            store.put(Done(k, {label: random.random(store.samples_in(k)) for label in ("one", "two")}))
        before, begun = resident(), clock.perf_counter()
        about = {"system": "none", "names": list("abc"), "varied": list("abc"), "outcomes": ["one", "two"], "count": rows,
                 "shapes": {"one": (), "two": ()}, "traces": [], "units": {}}
        store.finish(about, np.array([0.0, 1.0]), samples.block)
        found = {"npz": (resident() - before, clock.perf_counter() - begun)}
        for label, export in EXPORTS.items():
            before, begun = resident(), clock.perf_counter()
            export.write(Ensemble(store.folder), store.folder / export.file)
            found[label] = resident() - before, clock.perf_counter() - begun
        result = (store.folder / "ensemble.npz").stat().st_size
        print(json.dumps({"total": resident(), "result": result, "parts": found}))


def apart(function: str, *arguments: object) -> dict[str, Any]:
    """Output of a function of this file in a process of its own, whose memory is that of the function."""
    called = f"from symdyn.lab import predictions; predictions.{function}({', '.join(map(repr, arguments))})"
    run = subprocess.run([sys.executable, "-c", called], stdout=subprocess.PIPE, text=True, check=False)
    if run.returncode:
        raise SymdynError(f"{function} ended with status {run.returncode}; what it printed is above")
    return dict(json.loads(run.stdout.splitlines()[-1]))


def run(rows: int = 10_000_000, part: float = 1.0, jobs: int = 1) -> int:
    """Measure and print.

    rows   that are put together, besides a tenth as many
    part   of the motions of the sweeps;  jobs: threads of each
    Raises ArgumentError for less than 10 rows or no motions, SymdynError if a sweep fails.
    """
    if rows < 10 or not 0 < part <= 1:
        raise ArgumentError(f"{rows} rows and the part {part:.6g} of the motions were asked for; pass 10 rows or more, and a "
                            "part from 0 to 1")
    counts = {name: max(64, int(part * count)) for name, count in COUNTS.items()}
    with tempfile.TemporaryDirectory(prefix="symdyn-bench-") as name:
        folder = Path(name)
        print(f"{'sweep':8} {'motions':>8} | core s: predicted, taken | wall s | result MB | memory MB", flush=True)
        for label, text in SWEEPS.items():
            file = folder / f"{label}.toml"
            file.write_text(text.format(**counts), encoding="utf-8")
            before, after = Taken(**apart("predicted", str(file), jobs)), taken(file, jobs, folder / label)
            print(f"{label:8} {counts[label]:8} | {before.core:6.1f} {after.core:6.1f} | {before.wall:6.1f} {after.wall:6.1f} | "
                  f"{before.result / 1e6:6.1f} {after.result / 1e6:6.1f} | {before.memory / 1e6:4.0f} {after.memory / 1e6:4.0f}",
                  flush=True)
    for n in (rows // 10, rows):
        result = apart("merged", n)
        parts = ", ".join(f"{label} {seconds:.1f} s and {memory / 1e6:.0f} MB more"
                          for label, (memory, seconds) in result["parts"].items())
        print(f"{n} rows of five numbers, {result['result'] / 1e6:.0f} MB: {parts}; the process {result['total'] / 1e6:.0f} MB",
              flush=True)
    return 0
