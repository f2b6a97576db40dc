"""Progress of the workers of a run: each writes a small file, and anybody may read them all."""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import socket
import time as clock
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from symdyn.ensembles.chunk import Done
from symdyn.ensembles.claims import LEASE
from symdyn.ensembles.result import Ensemble
from symdyn.ensembles.store import MANIFEST, RESULT, WORKERS, Store
from symdyn.errors import ArgumentError
from symdyn.runtime.building.stored import write_whole


def own_name() -> str:
    """A name for this process that no other one has, on whatever machine."""
    return f"{socket.gethostname()}-{os.getpid()}-{secrets.token_hex(2)}"


class Progress:
    """The file of one process, which counts for all workers that it hands chunks to.

    count   samples by worker
    """

    def __init__(self, folder: Path, name: str) -> None:
        self.path = folder / WORKERS / f"{name}.json"
        self.count: dict[str, int] = {}
        self.failed, self.state, self.begun = 0, "at work", clock.time()

    def begin(self) -> None:
        """Make the file."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self.write()

    def add(self, done: Done, samples: int) -> None:
        """Count a chunk."""
        self.count[done.worker] = self.count.get(done.worker, 0) + samples
        self.failed += len(done.failures)

    def write(self, state: str | None = None) -> None:
        """Show what was done; a disk that takes nothing is reported by what matters more."""
        self.state = state or self.state
        job, task = os.environ.get("SLURM_ARRAY_JOB_ID", ""), os.environ.get("SLURM_ARRAY_TASK_ID", "")
        record = {"state": self.state, "begun": self.begun, "now": clock.time(), "count": self.count, "failed": self.failed,
                  "task": f"{job}_{task}" if job else ""}
        with contextlib.suppress(OSError):
            write_whole(self.path, lambda file: file.write(json.dumps(record).encode()), sync=False)


@dataclass(frozen=True)
class Worker:
    """One worker as its file shows it.

    silent    seconds since it was last heard of;  rate: samples a second
    """

    name: str
    task: str
    state: str
    samples: int
    rate: float
    silent: float
    lost: bool


@dataclass(frozen=True)
class Status:
    """Progress of a run: samples that are kept, of how many; members that failed, as far as workers have reported; workers."""

    system: str
    count: int
    n_done: int
    n_failed: int
    complete: bool
    workers: tuple[Worker, ...]

    @property
    def rate(self) -> float:
        """Samples a second of all workers that are at work."""
        return sum(w.rate for w in self.workers if not w.lost and w.state == "at work")


def read_status(folder: Path, lease: float = LEASE) -> Status:
    """Progress of the run in a folder. Raises ArgumentError where there is none."""
    try:
        manifest = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ArgumentError(f"{folder} holds no ensemble: nothing has begun there yet; start it without --status, or name its "
                            "folder by --output") from None
    except (OSError, ValueError) as error:
        raise ArgumentError(f"{folder / MANIFEST} cannot be read: {error}") from None
    count = int(manifest["samples"]["count"])
    store = Store(folder, count, int(manifest["chunk"]), {})
    workers = tuple(sorted(_workers(folder / WORKERS, lease), key=lambda w: (-w.samples, w.name)))
    if (folder / RESULT).is_file():
        return Status(str(manifest["system"]), count, count, Ensemble(folder).n_failed, True, workers)
    n_failed = sum(record["failed"] for _, record, _ in _records(folder / WORKERS))
    return Status(str(manifest["system"]), count, sum(store.samples_in(k) for k in store.there()), n_failed, False, workers)


def _workers(folder: Path, lease: float) -> list[Worker]:
    result = []
    now = clock.time()
    for path, record, written in _records(folder):
        silent = max(0.0, now - written)
        lost = silent > lease and record["state"] == "at work"
        seconds = max(record["now"] - record["begun"], 1e-3)
        count: Mapping[str, int] = record["count"] or {path.stem.rpartition("-")[0]: 0}
        result += [Worker(name, record["task"], record["state"], n, n / seconds, silent, lost) for name, n in count.items()]
    return result


def _records(folder: Path) -> list[tuple[Path, dict[str, Any], float]]:
    """Files of workers, with what stands in them and when they were written; one that goes meanwhile is left out."""
    result = []
    for path in folder.glob("[!.]*.json"):
        with contextlib.suppress(OSError, ValueError):
            result.append((path, json.loads(path.read_text(encoding="utf-8")), path.stat().st_mtime))
    return result
