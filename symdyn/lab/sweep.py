"""`symdyn bench sweep`: a sweep of a million short motions: rate, memory, and a run that is killed and goes on."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time as clock
from pathlib import Path

from symdyn.errors import ArgumentError, SymdynError

SWEEP = """
system = "double_pendulum"
t = [0, 1]
sampling = "latin_hypercube"
count = {count}
seed = 1
outcomes = ["end q1", "end q2"]
[parameters]
l1 = {{from = 0.8, to = 1.2}}
m2 = {{distribution = "lognormal", median = 1.0, sigma = 0.1}}
[initial]
q1 = {{from = -1, to = 1}}
q2 = {{from = -1, to = 1}}
"""


def start(folder: Path, count: int, out: str, *more: str) -> subprocess.Popen[str]:
    """A sweep in a process of its own."""
    file = folder / f"{count}.toml"
    file.write_text(SWEEP.format(count=count), encoding="utf-8")
    return subprocess.Popen([sys.executable, "-m", "symdyn", "sweep", str(file), "--no-picture", "--output", str(folder / out),
                             *more], stdout=subprocess.PIPE, text=True)


def measured(folder: Path, count: int, out: str) -> tuple[float, float, float]:
    """Wall time, processor time, s, and largest memory, MB, of a sweep."""
    begun = clock.perf_counter()
    run = start(folder, count, out)
    _, status, used = os.wait4(run.pid, 0)
    if status:
        raise SymdynError(f"the sweep of {count} motions ended with status {status}; what it said is above")
    return clock.perf_counter() - begun, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def run(count: int = 1_000_000, seed: int | None = None) -> int:
    """Measure and print; returns 0 if the killed run ended with the same file.

    count   of motions, besides a tenth as many
    seed    of the moment of the kill (default: another one every time)
    Raises ArgumentError for less than 10 motions, SymdynError if a sweep fails.
    """
    if count < 10:
        raise ArgumentError(f"{count} motions were asked for; pass 10 or more")
    with tempfile.TemporaryDirectory(prefix="symdyn-bench-") as name:
        folder = Path(name)
        start(folder, 2000, "first").communicate()  # derives and compiles
        for n in (count // 10, count):
            seconds, used, memory = measured(folder, n, f"whole{n}")
            size = (folder / f"whole{n}" / "ensemble.npz").stat().st_size / 2**20
            print(f"{n} motions of 1 s: {seconds:.1f} s, {n / seconds:.0f} a second, processor {used:.1f} s, "
                  f"memory {memory:.0f} MB, file {size:.1f} MB", flush=True)
        moment = random.Random(seed).uniform(0.1, 0.9) * seconds
        killed = start(folder, count, "killed")
        clock.sleep(moment)
        killed.send_signal(signal.SIGKILL)
        killed.wait()
        kept = len(list((folder / "killed" / "chunks").glob("0*.npz")))
        output, _ = start(folder, count, "killed", "--resume").communicate()
        same = (folder / "killed" / "ensemble.npz").read_bytes() == (folder / f"whole{count}" / "ensemble.npz").read_bytes()
        print(f"killed after {moment:.1f} s with {kept} chunks done; gone on: {output.splitlines()[0]}")
        print("the file is the same, to the byte" if same else "THE FILE DIFFERS")
    return 0 if same else 1
