"""Files written in one step, and files that carry a digest, so that what a disk or a program has damaged is not taken for code.

A digest covers the name and the content: the file of another name, however whole, is none. It is no signature: whoever may write
into a folder can write digests, too, so folders of code must be closed to others, see symdyn.runtime.building.cache_folder.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.machinery
import importlib.util
import os
import platform
import threading
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import IO

# Read and written by the user alone: in a folder that others may enter, what they can write would be loaded as code.
PRIVATE = 0o600


def write_whole(path: Path, fill: Callable[[IO[bytes]], object], mode: int = 0o666, sync: bool = True) -> None:
    """Write a file next to its final name and move it there in one step: whoever sees the name sees a whole file.

    fill   writes the content; mode: permissions, less the umask; sync: wait until the content is on the disk
    Each process and thread, on whatever machine, writes to a scratch file of its own. Raises OSError as the disk does; then
    nothing is left of it.
    """
    owner = f"{platform.node()[:60]}-{os.getpid()}-{threading.get_ident()}"
    scratch = path.with_name(f".{path.name[:100]}.{owner}.tmp")
    try:
        # A scratch file of the same name was left by a process that was killed; it is not written into, as it may be a link.
        scratch.unlink(missing_ok=True)
        handle = os.open(scratch, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), mode)
        with open(handle, "wb") as file:
            fill(file)
            file.flush()
            if sync:
                os.fsync(file.fileno())
        os.replace(scratch, path)
    except BaseException:
        with contextlib.suppress(OSError):
            scratch.unlink(missing_ok=True)
        raise


def digest(name: str, content: bytes) -> str:
    """SHA-256 of a file's name and content, in hexadecimal digits."""
    return hashlib.sha256(name.encode() + b"\0" + content).hexdigest()


def write_sealed(path: Path, content: bytes) -> None:
    """Write a file that begins with its digest, for the user alone. Raises OSError as the disk does."""
    data = digest(path.name, content).encode() + b"\n" + content
    write_whole(path, lambda file: file.write(data), PRIVATE, sync=False)


def read_sealed(path: Path) -> bytes | None:
    """The content of a file that `write_sealed` wrote; None if it is absent, damaged, of another name or open to others."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    seal, _, content = data.partition(b"\n")
    return content if seal == digest(path.name, content).encode() and not writers(path) else None


def writers(path: Path) -> str:
    """Who besides the user (and the system's administrator) may write to a file or folder, in words; empty for nobody.

    Permissions beyond the mode bits (access lists, Windows) are not looked at. Raises OSError where there is nothing.
    """
    if os.name != "posix":
        return ""
    result = path.stat()
    if result.st_uid not in (0, os.geteuid()):
        return f"it belongs to the user with the number {result.st_uid}"
    who = [name for bit, name in ((0o020, "its group"), (0o002, "everyone")) if result.st_mode & bit]
    return f"its mode {result.st_mode & 0o7777:04o} lets {' and '.join(who)} write to it" if who else ""


def import_text(source: str, path: Path) -> ModuleType:
    """The module of a text that stands in a file, too, for tracebacks.

    The byte code is kept with a digest: Python itself would execute what a disk made of it. Raises what the text raises.
    """
    name = f"symdyn_generated_{path.stem.replace('-', '_')}"
    loader = _Loader(name, str(path), source.encode())
    spec = importlib.util.spec_from_file_location(name, path, loader=loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    return module


class _Loader(importlib.machinery.SourceFileLoader):
    """Python's loader of source files, for a text that is at hand, with sealed byte code."""

    def __init__(self, name: str, path: str, source: bytes) -> None:
        super().__init__(name, path)
        self._source = source

    def get_data(self, path: str) -> bytes:  # type: ignore[override]
        """The source, or byte code; OSError, on which Python compiles again, where that is damaged."""
        if path == self.path:
            return self._source
        content = read_sealed(Path(path))
        if content is None:
            raise OSError(f"{path} is not there, or damaged")
        return content

    def set_data(self, path: str, data: bytes, *, _mode: int = PRIVATE) -> None:  # type: ignore[override]
        """Keep byte code; on a disk that takes none the next process compiles again."""
        with contextlib.suppress(OSError):
            Path(path).parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_sealed(Path(path), data)
