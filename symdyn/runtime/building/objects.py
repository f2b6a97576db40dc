"""Compiles the units of a text side by side and links them; units that other mechanisms have, too, are kept in the cache."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import platform
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from symdyn.runtime.building.compiler import Compiler, flags, link_flags_here
from symdyn.runtime.building.stored import PRIVATE, digest, write_whole, writers
from symdyn.translation_units import TranslationUnit, translation_units

# Interval at which running compilers are checked, s.
_POLL = 0.002
# Compilers that write object files with -c, and start quickly.
_WITH_OBJECTS = ("gcc", "clang")
# Time that a text takes with these options, compared with the usual one: as gcc 12 does for integrators.
_SHARES = {"-O1": 0.5, "-O2": 0.8}


@dataclass(frozen=True)
class _Job:
    """A unit that is compiled: its options, text and object; kept: where the object goes in the cache; work: what it takes, by
    its length and its level of optimization."""

    options: list[str]
    source: Path
    made: Path
    kept: Path | None
    work: float


def built_from_units(source: str, library: Path, compiler: Compiler, cache: Path) -> bool:
    """Whether the library was built from the units of the source; it is not where there is one, or where a step fails."""
    units = translation_units(source)
    if compiler.kind not in _WITH_OBJECTS or len(units) < 2:
        return False
    folder = library.parent
    objects, jobs = [], []
    for k, unit in enumerate(units):
        kept = _kept(unit, compiler, cache)
        if kept is not None and is_whole(kept):
            objects.append(kept)
            continue
        text = folder / f"unit_{k}.c"
        text.write_text(unit.text, encoding="utf-8", newline="\n")
        work = len(unit.text) * _SHARES.get(unit.level, 1.0)
        jobs.append(_Job(_object_flags(compiler, unit), text, folder / f"unit_{k}.o", kept, work))
        objects.append(jobs[-1].made)
    # Those that take longest first, so that no core waits for one of them at the end.
    jobs.sort(key=lambda job: -job.work)
    if not _compiled(jobs, compiler, cache):
        return False
    command = [*compiler.command, "-o", str(library), *map(str, objects), *flags(compiler), *link_flags_here(compiler)]
    fault, _ = run(command, cache)
    if fault or not library.is_file():
        return False
    for job in jobs:
        if job.kept is not None:
            _keep(job.made, job.kept)
    return True


def _kept(unit: TranslationUnit, compiler: Compiler, cache: Path) -> Path | None:
    return cache / f"unit-{key_of(unit.text, compiler, *_object_flags(compiler, unit))}.o" if unit.shared else None


def _keep(made: Path, kept: Path) -> None:
    """Put an object into the cache; if the disk is full or another process has it, the next build compiles it again."""
    with contextlib.suppress(OSError):
        sealed = digest(kept.name, made.read_bytes()).encode()
        made.chmod(0o600)
        os.replace(made, kept)
        write_whole(seal_of(kept), lambda file: file.write(sealed), PRIVATE, sync=False)


def _object_flags(compiler: Compiler, unit: TranslationUnit) -> list[str]:
    """Flags for the object of a unit: those for a library without the library's, with the unit's level of optimization."""
    chosen = [flag for flag in flags(compiler) if flag != "-shared" and not flag.startswith("-l")]
    return ["-c", *(unit.level if unit.level and flag.startswith("-O") else flag for flag in chosen)]


def _compiled(jobs: Iterable[_Job], compiler: Compiler, cache: Path) -> bool:
    """Whether all jobs succeeded; as many run at once as there are cores."""
    waiting, running = list(jobs), list[tuple[_Job, subprocess.Popen[bytes]]]()
    good = True
    with tempfile.TemporaryFile() as output:
        try:
            while (waiting and good) or running:
                while waiting and good and len(running) < _cores():
                    job = waiting.pop(0)
                    command = [*compiler.command, "-o", str(job.made), str(job.source), *job.options]
                    running.append((job, _started(command, cache, output)))
                for entry in list(running):
                    if entry[1].poll() is not None:
                        good = good and entry[1].returncode == 0 and entry[0].made.is_file()
                        running.remove(entry)
                time.sleep(_POLL if running else 0.0)
        except OSError:
            good = False
        finally:
            for _, process in running:
                process.kill()
                process.wait()
    return good


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _started(command: list[str], cache: Path, output: IO[bytes]) -> subprocess.Popen[bytes]:
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, env=_environment(cache))


def run(command: list[str], cache: Path) -> tuple[str, str]:
    """(what went wrong, or "", and the compiler's output)."""
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            env=_environment(cache),
        )
    except OSError as error:
        return "it did not start", str(error)
    return f"it ended with code {done.returncode}" if done.returncode else "", done.stdout


def _environment(cache: Path) -> Mapping[str, str]:
    """zig keeps files between runs; they belong with ours, also where the home folder cannot be written."""
    return {"ZIG_GLOBAL_CACHE_DIR": str(cache / "zig"), **os.environ}


def key_of(source: str, compiler: Compiler, *options: str) -> str:
    """Sixteen digits that change with everything that shapes what is compiled."""
    machine = (_cpu(), sys.platform, platform.machine(), str(struct.calcsize("P")))
    parts = (source, *options, *compiler.command, compiler.version, *machine)
    return hashlib.sha256("\0".join(parts).encode("utf-8")).hexdigest()[:16]


def seal_of(library: Path) -> Path:
    """The file that holds a library's digest; it is not put into the library itself, whose format signatures may cover."""
    return library.with_name(f"{library.name}.sha256")


def is_whole(library: Path) -> bool:
    """Whether a library is as it was built, and nobody else could write to it.

    The system's loader does not look: damaged code ends the process, or computes something else.
    """
    try:
        sealed = seal_of(library).read_bytes()
        return sealed == digest(library.name, library.read_bytes()).encode() and not writers(library)
    except OSError:
        return False


@functools.cache
def _cpu() -> str:
    """Key of CPUs that may not run each other's native code."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as lines:
            block: list[str] = []
            for line in lines:  # the first core's block is enough; there may be hundreds
                if not line.strip():
                    break
                block.append(line)
    except OSError:
        return platform.processor()
    telling = ("model name", "flags", "Features", "CPU implementer", "CPU part", "CPU variant", "cpu", "isa")
    return "".join(line for line in block if line.partition(":")[0].strip() in telling)
