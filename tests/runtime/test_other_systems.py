"""Differences of Python on Windows and macOS, through the places where symdyn asks which system it is on."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

import symdyn as sd
from symdyn.ensembles import lock
from symdyn.errors import ArgumentError
from symdyn.runtime.building import cache_folder, stored
from symdyn.runtime.building.cache_folder import cache_dir
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.integrating import interrupts

ROOT = Path(__file__).parents[2]
AWKWARD = "a folder, 'Äpfel' & $HOME; 单摆 %TEMP%"

# The standard library is imported first: it is that of the system the test runs on.
NAMES = """
import ctypes, sys, tempfile, subprocess, platform, importlib.util, shlex, shutil
sys.platform = {platform!r}
from symdyn.runtime.building.cache import SUFFIX
from symdyn.runtime.building.compiler import Compiler, flags, link_flags, link_flags_here
zig = Compiler(("zig", "cc"), "zig", "21")
gcc = Compiler(("gcc", "-march=x86-64"), "gcc", "12")
tcc = Compiler(("tcc",), "tcc", "0.9.28")
print([SUFFIX, *flags(gcc), *link_flags(gcc)], flags(zig)[-3:], flags(tcc), sep="\\n")
print(*([*link_flags_here(gcc), "and", *link_flags_here(Compiler(("gcc",), "gcc", "12"))]))
"""
USUAL = ["-std=c99", "-O3", "-ffp-contract=off", "-fno-tree-slp-vectorize"]
CHOSEN = {
    "linux": ([".so", *USUAL, "-fPIC", "-shared", "-lm", "-Wl,-Bsymbolic-functions"], ["-fPIC", "-shared", "-nostdlib"],
              ["-nostdlib", "-nostdinc", "-shared"]),
    "darwin": ([".dylib", *USUAL, "-fPIC", "-shared"], ["-fno-sanitize=undefined", "-fPIC", "-shared"], ["-nostdinc", "-shared"]),
    "win32": ([".dll", *USUAL, "-shared"], ["-ffp-contract=off", "-fno-sanitize=undefined", "-shared"],
              ["-nostdinc", "-shared", "-rdynamic"]),
}


@pytest.mark.parametrize("platform", CHOSEN)
def test_names_of_libraries_and_options_of_compilers(platform: str) -> None:
    done = subprocess.run([sys.executable, "-c", NAMES.format(platform=platform)], capture_output=True, text=True,
                          env={**os.environ, "PYTHONPATH": str(ROOT)})
    assert done.returncode == 0, done.stderr
    *chosen, here = done.stdout.splitlines()
    assert chosen == [str(options) for options in CHOSEN[platform]]
    # A command with options of its own may need more libraries than what is in the process already.
    few = "-Wl,-Bsymbolic-functions and -Wl,-Bsymbolic-functions -nodefaultlibs -lm -lgcc"
    assert here == (few if platform == "linux" else "and")


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("SYMDYN_CACHE_DIR", "LOCALAPPDATA", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    return tmp_path


def test_the_cache_folder_of_macos(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache_folder, "WINDOWS", False)
    monkeypatch.setattr(cache_folder, "MACOS", True)
    assert cache_dir() == home / "Library" / "Caches" / "symdyn"


def test_the_cache_folder_of_windows(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache_folder, "WINDOWS", True)
    assert cache_dir() == home / "AppData" / "Local" / "symdyn" / "cache"
    monkeypatch.setenv("LOCALAPPDATA", str(home / AWKWARD))
    assert cache_dir() == home / AWKWARD / "symdyn" / "cache"
    # Where a file is in the way, the folder of temporary files, which is the user's own there.
    monkeypatch.setattr(cache_folder.tempfile, "tempdir", str(home))
    (home / "file").touch()
    monkeypatch.setenv("LOCALAPPDATA", str(home / "file"))
    assert cache_dir() == home / "symdyn"
    (home / "symdyn").rmdir()
    (home / "symdyn").touch()
    own = cache_dir()
    cache_folder._private.cache_clear()
    assert own.parent == home and own.name.startswith("symdyn-")


def test_without_mode_bits_nobody_else_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tmp_path.chmod(0o777)
    told = stored.writers(tmp_path)
    monkeypatch.setattr(stored, "os", SimpleNamespace(name="nt"))
    assert stored.writers(tmp_path) == "" and (told or os.name != "posix")


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_folders_with_spaces_quotes_and_any_letters(backend: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compiled or imported from there, and written there: a mechanism with several translation units."""
    if backend == "c" and find_compiler() is None:
        pytest.skip("no compiler")
    monkeypatch.setenv("SYMDYN_CACHE_DIR", str(tmp_path / AWKWARD / "cache"))
    module = sd.systems.get("four_bar").augmented().compile(backend=backend)
    assert module.simulate((0, 0.1), rtol=1e-8).success
    assert any((tmp_path / AWKWARD / "cache").iterdir())
    paths = module.write(tmp_path / AWKWARD / "written")
    assert paths and all(path.parent == tmp_path / AWKWARD / "written" and path.is_file() for path in paths)


ENCODED = """
import sys
from pathlib import Path
import symdyn as sd
module = sd.systems.get("pendulum").embedding().compile(backend="numpy")
assert module.simulate((0, 0.1)).success
module.write(Path(sys.argv[1]))
from symdyn.cli import main
sys.exit(main(["list"]))
"""


def test_no_file_is_read_or_written_in_the_encoding_of_the_system(tmp_path: Path) -> None:
    """On Windows that is not UTF-8. The output of a compiler is in the system's encoding, and is taken so."""
    allowed = [f"-Wignore::EncodingWarning:symdyn.runtime.{name}" for name in ("compiler", "objects")]
    done = subprocess.run([sys.executable, "-X", "warn_default_encoding", "-W", "error::EncodingWarning", *allowed, "-c", ENCODED,
                           str(tmp_path / "written")], capture_output=True, text=True, cwd=tmp_path,
                          env={**os.environ, "PYTHONPATH": str(ROOT), "SYMDYN_CACHE_DIR": str(tmp_path / "cache")})
    assert done.returncode == 0 and "pendulum" in done.stdout, done.stderr


def test_without_locks_two_runs_may_be_in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on Windows, and on file systems that know no locks; the folder is made, and removed where nothing was written."""
    if lock.fcntl is not None:
        with lock.OneRun(tmp_path), pytest.raises(ArgumentError, match="another run is at work"), lock.OneRun(tmp_path):
            pass

        def unknown(handle: int, operation: int) -> None:
            raise OSError(errno.ENOLCK, "No locks available")

        with monkeypatch.context() as patch:
            patch.setattr(lock.fcntl, "flock", unknown)
            with lock.OneRun(tmp_path), lock.OneRun(tmp_path):
                pass
    monkeypatch.setattr(lock, "fcntl", None)
    with lock.OneRun(tmp_path / "new"), lock.OneRun(tmp_path / "new"):
        assert (tmp_path / "new").is_dir()
    with pytest.raises(KeyError), lock.OneRun(tmp_path / "other"):
        raise KeyError
    assert not (tmp_path / "other").exists()
    (tmp_path / "file").touch()
    with pytest.raises(ArgumentError, match="cannot be used"), lock.OneRun(tmp_path / "file" / "below"):
        pass


def test_threads_leave_signals_alone() -> None:
    """Only the main thread may set handlers, on every system."""
    before, seen = signal.getsignal(signal.SIGINT), []

    def work() -> None:
        with interrupts.Interrupts(work.__code__) as kept:
            seen.append(kept.usual)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [None] and signal.getsignal(signal.SIGINT) is before


def test_ctrl_c_in_the_frame_of_a_function_waits_until_it_is_asked_for() -> None:
    """Elsewhere it acts at once; where nothing has asked for it, it acts at the end."""
    went_on: list[bool] = []

    def pressed() -> None:
        signal.raise_signal(signal.SIGINT)
        went_on.append(True)

    with interrupts.Interrupts(pressed.__code__) as kept:
        pressed()
        with pytest.raises(KeyboardInterrupt):
            kept.check()
        kept.check()  # only once
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), interrupts.Interrupts(pressed.__code__):
        pressed()
    assert went_on == [True, True]


def test_a_handler_that_python_did_not_set_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a program that embeds Python, or where Ctrl-C is ignored."""
    monkeypatch.setattr(signal, "getsignal", lambda number: None)
    with interrupts.Interrupts(test_threads_leave_signals_alone.__code__) as kept:
        assert kept.usual is None
