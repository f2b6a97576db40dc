"""Results that an unfinished run left and a later one goes on with, what tells that they are of the same, and the bar."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import platform
import time as clock
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import symdyn
from symdyn.bench import kept
from symdyn.errors import ArgumentError, MissingExtra
from symdyn.runtime.compiler import find_compiler


def about() -> dict[str, str]:
    """Machine, compiler, version: what times depend on besides what is measured."""
    compiler = find_compiler()
    return {"symdyn": symdyn.__version__, "machine": platform.machine(), "processor": _processor(),
            "compiler": f"{compiler.kind} {compiler.version}" if compiler else "none", "python": platform.python_version()}


def now() -> str:
    """The time of day of this machine, to the minute, which tells runs apart for a reader."""
    return clock.strftime("%Y-%m-%d %H:%M")


def fingerprint(*parts: Any) -> str:
    """A short text that is another one as soon as one of the parts, plain data, is."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:16]


def left_by(path: Path, mark: str | None = None) -> dict[str, Any]:
    """What an unfinished run wrote, if its fingerprint is this one (None: any); else nothing."""
    with contextlib.suppress(KeyError, TypeError):  # not there, or another's file
        data = kept.read(path)
        if not data["complete"] and (mark is None or data["fingerprint"] == mark):
            return data  # type: ignore[no-any-return]
    return {}


def unwritable(folder: Path, names: Sequence[str] = ()) -> str:
    """Why results cannot be written into a folder, which need not be there yet; empty if they can. Nothing is written.

    names   of files whose old versions would be written over
    """
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists() or place.is_symlink())
    if not there.is_dir():
        return f"results cannot be written into {folder}: {there} is a file, not a folder; name another one"
    closed = [place for place in (there, *(folder / name for name in names)) if place.exists() and not os.access(
        place, os.W_OK | (os.X_OK if place.is_dir() else 0))]
    if closed:
        return f"results cannot be written into {folder}: {closed[0]} is closed to writing; name another one"
    return ""


def check_writable(folder: Path, names: Sequence[str] = ()) -> None:
    """Raises ArgumentError where results cannot be written into a folder."""
    why = unwritable(folder, names)
    if why:
        raise ArgumentError(why)


def bar(name: str, total: int, unit: str = "run") -> Any:
    """A progress bar. Raises MissingExtra without tqdm."""
    try:
        from tqdm.auto import tqdm
    except ImportError:
        raise MissingExtra("a progress bar needs tqdm: pip install 'symdyn[progress]', or leave out progress=True") from None
    return tqdm(total=total, desc=name, unit=unit, leave=False)


def _processor() -> str:
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor()
