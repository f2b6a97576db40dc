"""Marks of results of the same command, results of a run that was done, and a check whether new ones can be written."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
import platform
import time as clock
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import symdyn
from symdyn.bench import kept
from symdyn.bench.work import against
from symdyn.errors import ArgumentError
from symdyn.runtime.building.compiler import find_compiler

# Folders of the package that shape neither the code that runs nor how it is measured.
_NEARBY = ("cli", "comparison", "lecture", "report", "stress")


def about() -> dict[str, str]:
    """Machine, compiler, version: what times depend on besides what is measured."""
    compiler = find_compiler()
    return {"symdyn": symdyn.__version__, "machine": platform.machine(), "processor": _processor(),
            "compiler": f"{compiler.kind} {compiler.version}" if compiler else "none", "python": platform.python_version()}


def now() -> str:
    """The time of day of this machine, to the minute, which distinguishes runs for a reader."""
    return clock.strftime("%Y-%m-%d %H:%M")


def fingerprint(*parts: Any) -> str:
    """A short text that is another one as soon as one of the parts, plain data, is."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:16]


@functools.cache
def code() -> str:
    """Changes with every file that shapes the code that runs, of whatever method, or how it is measured."""
    package = Path(symdyn.__file__).parent
    # In a checkout the templates lie next to the package, in an installation inside it.
    folders = [package] if (package / "templates").is_dir() else [package, package.parent / "templates"]
    return digest({path.relative_to(folder).as_posix(): path for folder in folders
                   for ending in ("*.py", "*.jinja", "*.toml", "*.h", "*.c") for path in folder.rglob(ending)
                   if path.relative_to(folder).parts[0] not in _NEARBY})


def digest(files: Mapping[str, Path]) -> str:
    """Digest of the contents of files, each under a name."""
    return fingerprint(*[(name, hashlib.sha256(files[name].read_bytes()).hexdigest()) for name in sorted(files)])


def installed(names: Sequence[str]) -> list[tuple[str, bool]]:
    """Other programs, and whether they can run here."""
    return [(peer.name, peer.available() is True) for name in names for peer in against.peers(name)]


def whole(path: Path, command: str) -> dict[str, Any]:
    """Results that a run of this very command wrote, if it was done with it; else nothing."""
    with contextlib.suppress(KeyError, TypeError):
        data = kept.read(path)
        if command and data["complete"] and data["command"] == command:
            return data  # type: ignore[no-any-return]
    return {}


def unwritable(folder: Path, names: Sequence[str] = ()) -> str:
    """Why results cannot be written into a folder, which need not be there yet; empty if they can. Nothing stays there.

    names   of files whose old versions would be written over
    """
    why = kept.closed(folder)
    for path in (folder / name for name in names) if not why else ():
        try:
            with contextlib.suppress(FileNotFoundError), path.open("r+b"):
                pass
        except OSError as error:
            why = f"{path} is closed to writing ({error.strerror})"
            break
    return f"results cannot be written into {folder}: {why}; name another one" if why else ""


def check_writable(folder: Path, names: Sequence[str] = ()) -> None:
    """Raises ArgumentError where results cannot be written into a folder."""
    why = unwritable(folder, names)
    if why:
        raise ArgumentError(why)


def _processor() -> str:
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor()
