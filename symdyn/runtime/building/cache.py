"""Build shared libraries once per user and machine, keyed by everything that shapes the result, each kept with its digest."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import os
import re
import shlex
import shutil
import stat
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from symdyn.errors import CacheError, CompileError
from symdyn.runtime.building.cache_folder import cache_dir
from symdyn.runtime.building.compiler import LINUX, WINDOWS, Compiler, flags, link_flags_here
from symdyn.runtime.building.objects import built_from_units, is_whole, key_of, run, seal_of
from symdyn.runtime.building.stored import PRIVATE, digest, write_whole
from symdyn.shown import shown

SUFFIX = ".dll" if WINDOWS else ".dylib" if sys.platform == "darwin" else ".so"
STALE_SECONDS = 24 * 3600.0
OUTPUT_LINES = 40
# Characters of a mechanism's name that stand in names of files, which file systems limit to 255 bytes.
LONGEST = 100


def build(source: str, stem: str, compiler: Compiler) -> Path:
    """Path of the shared library of this C source, compiled only if it is not there yet, whole to the last bit.

    Raises CompileError with the command and the compiler's own output, the source is kept next to it; CacheError where the cache
    folder does not take the library.
    """
    target = _target(source, stem, compiler)
    if not is_whole(target):
        _compile(source, target, compiler, replace=False)
    return target


def discard(library: Path) -> None:
    """Remove a built library."""
    library.unlink(missing_ok=True)
    seal_of(library).unlink(missing_ok=True)


def is_built(source: str, stem: str, compiler: Compiler) -> bool:
    """Whether the shared library of this source is there already, whole to the last bit."""
    return is_whole(_target(source, stem, compiler))


def load(source: str, stem: str, compiler: Compiler) -> ctypes.CDLL:
    """The loaded library of this C source; a damaged or foreign file in the cache is never loaded, and is built once more.

    Raises CompileError if the source does not compile or if the fresh library cannot be loaded either, CacheError where the cache
    folder does not take it.
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
            f"The library built for {shown(stem)} cannot be loaded: {error}. "
            f"It was built twice, the last time by {shlex.join(compiler.command)} ({compiler.version}). "
            f"Look for a missing function in the source, or set SYMDYN_CC to another compiler."
        ) from error


@contextlib.contextmanager
def writing(path: Path) -> Iterator[None]:
    """Errors of the disk while a file of the cache is written become a CacheError."""
    try:
        yield
    except OSError as error:
        why = "there is a folder of that name; remove it" if path.is_dir() else (
            f"{error.strerror or error}. Free some space, remove what is in the way, or set SYMDYN_CACHE_DIR to another folder")
        raise CacheError(f"{path.name} cannot be put into the cache folder {path.parent}: {why}") from error


def _target(source: str, stem: str, compiler: Compiler) -> Path:
    key = key_of(source, compiler, *flags(compiler), *link_flags_here(compiler))
    return cache_dir() / f"{re.sub(r'[^A-Za-z0-9_.-]', '_', stem)[:LONGEST]}-{key}{SUFFIX}"


def _compile(source: str, target: Path, compiler: Compiler, replace: bool) -> None:
    """Compile in a folder of its own and move the finished library to its name in one step.

    The name stands for a complete library, whatever happens to this process or to others that compile it.
    """
    cache = target.parent
    _sweep(cache)
    with writing(target), tempfile.TemporaryDirectory(prefix="build-", dir=cache, ignore_cleanup_errors=True) as folder:
        text, library = Path(folder, target.stem + ".c"), Path(folder, target.name)
        text.write_text(source, encoding="utf-8", newline="\n")
        fault, output = "", ""
        # Source that cannot be compiled as several units is compiled as one, whose messages are those to show.
        if not built_from_units(source, library, compiler, cache):
            fault, output = run(_command(compiler, text, library), cache)
            if not fault and not library.is_file():
                fault = "it reported success but wrote no library"
        if fault:
            kept = target.with_suffix(".c")
            os.replace(text, kept)
            raise CompileError(_failure(compiler, kept, target, fault, output))
        with library.open("r+b") as written:  # a power cut must not leave the name on an empty file
            os.fsync(written.fileno())
        if not replace and is_whole(target):  # another process was quicker
            return
        library.chmod(stat.S_IRWXU)
        sealed = digest(target.name, library.read_bytes()).encode()
        try:
            os.replace(library, target)
        except PermissionError:  # Windows: another process was first and has loaded it
            if not is_whole(target):
                raise
            return
        # A process that looks before the digest is there takes the library for a damaged one and builds it, too, which only costs
        # time.
        write_whole(seal_of(target), lambda file: file.write(sealed), PRIVATE, sync=False)


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
    return [*compiler.command, "-o", str(library), str(source), *flags(compiler), *link_flags_here(compiler)]


@functools.cache
def _sweep(folder: Path) -> None:
    """Remove what builds that were killed have left behind; once in a process, as a folder may hold many files."""
    limit = time.time() - STALE_SECONDS
    for left in [*folder.glob("build-*"), *folder.glob(".*.tmp")]:
        try:
            if left.lstat().st_mtime >= limit:
                continue
            if left.is_dir() and not left.is_symlink():
                shutil.rmtree(left, ignore_errors=True)
            elif left.suffix == ".tmp":
                left.unlink()
        except OSError:  # another process was quicker
            continue


def _open(library: Path) -> ctypes.CDLL:
    _share_libm()
    return ctypes.CDLL(str(library))


@functools.cache
def _share_libm() -> None:
    """Let libraries that were linked with -nostdlib find sin and its kin."""
    if LINUX:
        with contextlib.suppress(OSError):  # musl has them in libc, which every process holds
            ctypes.CDLL("libm.so.6", mode=ctypes.RTLD_GLOBAL)
