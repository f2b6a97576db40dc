"""Build shared libraries once per user and machine, keyed by everything that shapes the result."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import hashlib
import os
import platform
import re
import shlex
import shutil
import stat
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from symdyn.errors import CompileError
from symdyn.runtime.compiler import LINUX, WINDOWS, Compiler, flags

MACOS = sys.platform == "darwin"
SUFFIX = ".dll" if WINDOWS else ".dylib" if MACOS else ".so"
STALE_SECONDS = 24 * 3600.0
OUTPUT_LINES = 40


def cache_dir() -> Path:
    """The folder of built libraries, created if need be.

    $SYMDYN_CACHE_DIR, else the platform's cache folder; a private folder among the temporary files if that
    one cannot be written.
    """
    folder = _preferred()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:  # a file in the way, a read-only disk
        return _temporary()
    return folder if os.access(folder, os.W_OK | os.X_OK) else _temporary()


def build(source: str, stem: str, compiler: Compiler) -> Path:
    """Path of the shared library of this C source, compiled only if it is not there yet.

    Raises CompileError with the command and the compiler's own output; the source is kept beside it.
    """
    target = _target(source, stem, compiler)
    if not target.exists():
        _compile(source, target, compiler, replace=False)
    return target


def is_built(source: str, stem: str, compiler: Compiler) -> bool:
    """Whether the shared library of this source is there already."""
    return _target(source, stem, compiler).exists()


def load(source: str, stem: str, compiler: Compiler) -> ctypes.CDLL:
    """The loaded library of this C source; a damaged file in the cache is built once more.

    Raises CompileError if the source does not compile or if the fresh library cannot be loaded either.
    """
    target = build(source, stem, compiler)
    try:
        return _open(target)
    except OSError:
        _compile(source, target, compiler, replace=True)
    try:
        return _open(target)
    except OSError as error:
        raise CompileError(
            f"The library built for {stem!r} cannot be loaded: {error}. "
            f"It was built twice, the last time by {shlex.join(compiler.command)} ({compiler.version}). "
            f"Look for a missing function in the source, or set SYMDYN_CC to another compiler."
        ) from error


def _preferred() -> Path:
    named = os.environ.get("SYMDYN_CACHE_DIR")
    if named:
        return Path(named).expanduser().absolute()
    # expanduser keeps the "~" where no home is known; such a folder must not appear in the working directory.
    home = Path(os.path.expanduser("~"))
    if not home.is_absolute():
        return _temporary()
    if WINDOWS:
        return Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local") / "symdyn" / "cache"
    if MACOS:
        return home / "Library" / "Caches" / "symdyn"
    xdg = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return (xdg if xdg.is_absolute() else home / ".cache") / "symdyn"


def _temporary() -> Path:
    if sys.platform == "win32":  # already a folder of this user alone
        folder = Path(tempfile.gettempdir(), "symdyn")
        folder.mkdir(exist_ok=True)
        return folder
    folder = Path(tempfile.gettempdir(), f"symdyn-{os.getuid()}")
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError:
        return _private()
    # Libraries are loaded from here: a folder that another user made or may write to cannot be trusted.
    mine = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022
    return folder if mine else _private()


@functools.cache
def _private() -> Path:
    return Path(tempfile.mkdtemp(prefix="symdyn-"))


def _target(source: str, stem: str, compiler: Compiler) -> Path:
    machine = (_cpu(), sys.platform, platform.machine(), str(struct.calcsize("P")))
    parts = (source, *flags(compiler), *compiler.command, compiler.version, *machine)
    key = hashlib.sha256("\0".join(parts).encode("utf-8")).hexdigest()[:16]
    return cache_dir() / f"{re.sub(r'[^A-Za-z0-9_.-]', '_', stem)}-{key}{SUFFIX}"


@functools.cache
def _cpu() -> str:
    """What tells apart CPUs that may not run each other's native code."""
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


def _compile(source: str, target: Path, compiler: Compiler, replace: bool) -> None:
    """Compile in a folder of its own and move the finished library to its name in one step.

    Whoever sees the name sees a whole library, whatever happens to this process or to others at this work.
    """
    cache = target.parent
    _sweep(cache)
    with tempfile.TemporaryDirectory(prefix="build-", dir=cache, ignore_cleanup_errors=True) as folder:
        text, library = Path(folder, target.stem + ".c"), Path(folder, target.name)
        text.write_text(source, encoding="utf-8", newline="\n")
        fault, output = _run(_command(compiler, text, library), cache)
        if not fault and not library.is_file():
            fault = "it reported success but wrote no library"
        if fault:
            kept = target.with_suffix(".c")
            os.replace(text, kept)
            raise CompileError(_failure(compiler, kept, target, fault, output))
        with library.open("r+b") as written:  # a power cut must not leave the name on an empty file
            os.fsync(written.fileno())
        if not replace and target.exists():
            return
        try:
            os.replace(library, target)
        except PermissionError:  # Windows: another process was first and has loaded it
            if not target.exists():
                raise


def _run(command: list[str], cache: Path) -> tuple[str, str]:
    """(what went wrong, or "", and the compiler's output)."""
    # zig keeps files between runs; they belong with ours, also where the home folder cannot be written.
    environment = {"ZIG_GLOBAL_CACHE_DIR": str(cache / "zig"), **os.environ}
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            env=environment,
        )
    except OSError as error:
        return "it did not start", str(error)
    return f"it ended with code {done.returncode}" if done.returncode else "", done.stdout


def _failure(compiler: Compiler, kept: Path, target: Path, fault: str, output: str) -> str:
    lines = output.strip().splitlines() or ["(the compiler printed nothing)"]
    more = len(lines) - OUTPUT_LINES
    lines = [*lines[:OUTPUT_LINES], f"... and {more} more lines"] if more > 0 else lines
    return (
        f"{compiler.kind} ({compiler.version}) could not build {target.name}: {fault}.\n"
        f"Command: {shlex.join(_command(compiler, kept, target))}\n"
        f"Source kept at: {kept}\n"
        "Output:\n" + "\n".join(lines)
    )


def _command(compiler: Compiler, source: Path, library: Path) -> list[str]:
    return [*compiler.command, "-o", str(library), str(source), *flags(compiler)]


def _sweep(folder: Path) -> None:
    """Remove what builds that were killed have left behind."""
    limit = time.time() - STALE_SECONDS
    for left in folder.glob("build-*"):
        try:
            if left.is_dir() and left.stat().st_mtime < limit:
                shutil.rmtree(left, ignore_errors=True)
        except OSError:  # another process was quicker
            continue


def _open(library: Path) -> ctypes.CDLL:
    _check_whole(library)
    _share_libm()
    return ctypes.CDLL(str(library))


def _check_whole(library: Path) -> None:
    """OSError if a 64-bit ELF file ends before its section table.

    The loader of Linux does not look: mapping such a file can end the whole process.
    """
    with library.open("rb") as file:
        head = file.read(64)
    if head[:6] != b"\x7fELF\x02\x01":
        return
    fields = struct.unpack_from("<40xQ10xHH", head.ljust(64, b"\xff"))
    if library.stat().st_size < fields[0] + fields[1] * fields[2]:
        raise OSError(f"{library} is truncated")


@functools.cache
def _share_libm() -> None:
    """Let libraries that were linked with -nostdlib find sin and its kin."""
    if LINUX:
        with contextlib.suppress(OSError):  # musl has them in libc, which every process holds
            ctypes.CDLL("libm.so.6", mode=ctypes.RTLD_GLOBAL)
