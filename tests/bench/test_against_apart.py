"""Programs in processes of their own: whatever ends them, or this process, nothing of them is left."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from symdyn.bench.work.against.apart import Apart
from symdyn.bench.work.against.peer import Failed, Unfit
from symdyn.runtime.building.compiler import LINUX

pytestmark = pytest.mark.skipif(not LINUX, reason="processes of their own are forked")
MOTION = (None, None, None, None)
# Prepares in a library that lets no other thread of Python run, with a program of its own as a child, and is ended from outside.
SCRIPT = """
import ctypes, os, subprocess, sys, time
from symdyn.bench.work.against.apart import Apart

class Slow:
    def prepare(self, *arguments):
        child = subprocess.Popen(["sleep", "100"])
        print(os.getpid(), child.pid, flush=True)
        ctypes.PyDLL(None).sleep(100)

far = time.perf_counter() + 100
Apart(Slow(), (None,) * 4, [1.0], far, far)
"""


def gone(pid: int) -> bool:
    """Whether a process has ended; nobody may have asked for its code yet."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return True


def soon(true: Callable[[], bool]) -> bool:
    end = time.perf_counter() + 10
    while not true() and time.perf_counter() < end:
        time.sleep(0.01)
    return true()


class Dies:
    """Starts a program, and ends without it: in its preparation, or when it is to run."""

    name = title = "dies"

    def __init__(self, notes: Path, at_once: bool) -> None:
        self.notes, self.at_once = notes, at_once

    def prepare(self, *arguments: Any) -> Any:
        self.notes.write_text(str(subprocess.Popen(["sleep", "100"]).pid), encoding="utf-8")
        if self.at_once:
            os._exit(7)
        return lambda tolerance, times=None: os._exit(8)


@pytest.mark.parametrize("at_once", [True, False], ids=["prepares", "runs"])
def test_what_a_program_that_died_has_started_is_ended(tmp_path: Path, at_once: bool) -> None:
    far, peer = time.perf_counter() + 100, Dies(tmp_path / "pid", at_once)
    if at_once:
        with pytest.raises(Unfit, match="its process died with code 7"):
            Apart(peer, MOTION, [1.0], far, far)  # type: ignore[arg-type]
    else:
        apart = Apart(peer, MOTION, [1.0], far, far)  # type: ignore[arg-type]
        assert not gone(int(peer.notes.read_text(encoding="utf-8"))) and apart.guard.poll() is None
        for _ in range(2):
            with pytest.raises(Failed, match="its process died with code 8"):
                apart.timed(0, 1e-3, 1)
        assert apart.guard.poll() is not None and not Path(apart.folder.name).exists()
    assert soon(lambda: gone(int(peer.notes.read_text(encoding="utf-8"))))


@pytest.mark.parametrize("by", [signal.SIGTERM, signal.SIGKILL])
def test_a_process_does_not_outlive_the_one_that_started_it(tmp_path: Path, by: signal.Signals) -> None:
    started = subprocess.Popen([sys.executable, "-c", SCRIPT], stdout=subprocess.PIPE, text=True,
                               env={**os.environ, "TMPDIR": str(tmp_path)})
    assert started.stdout is not None
    worker, child = map(int, started.stdout.readline().split())
    assert not gone(worker) and not gone(child) and list(tmp_path.glob("symdyn-bench-*"))
    children = Path(f"/proc/{started.pid}/task/{started.pid}/children")
    assert soon(lambda: len(children.read_text(encoding="utf-8").split()) == 2)  # its guard is there, too
    started.send_signal(by)
    assert started.wait(10) == -by
    started.stdout.close()
    assert soon(lambda: gone(worker) and gone(child) and not list(tmp_path.iterdir()))
