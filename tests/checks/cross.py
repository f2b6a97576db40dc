"""Written mechanisms compiled for other systems and processors by zig's clang, and run where an emulator is here.

    python -m pip install 'symdyn[cross]'
    python -m pytest tests/checks/cross.py

The first build for a system takes zig a minute, as it compiles the C library of that system. Programs for Linux run under
qemu-user with the folders of Debian's libc6-arm64-cross and libc6-armhf-cross, programs for Windows under Wine.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from symdyn.runtime.building import shared
from tests.backend.c_warnings import LANGUAGE, WARNINGS
from tests.checks.programs import Written, written

MECHANISMS = ("pendulum", "four_bar", "spatial_chain")

pytestmark = pytest.mark.skipif(importlib.util.find_spec("ziglang") is None, reason="no ziglang: pip install 'symdyn[cross]'")


@dataclass(frozen=True)
class Target:
    """A system that zig compiles for.

    name      zig's
    magic     how its shared libraries begin
    suffix    of its shared libraries
    runner    the command that its programs run under here, with folders that it needs; None: they do not run here
    fused     whether its processors fuse products and sums, so that its bits are those of this machine's fused operations
    sines     whether its math library has the sines of this one: others, and glibc without fused operations, round some otherwise
    """

    name: str
    magic: bytes
    suffix: str
    runner: tuple[str, ...] | None = None
    fused: bool = False
    sines: bool = False

    def command(self) -> list[str] | None:
        """Command that its programs run under here, or None where that is missing."""
        if self.runner is None:
            return None
        if not self.runner:
            return []
        program = shutil.which(self.runner[0])
        return [program, *self.runner[1:]] if program and all(Path(a).is_dir() for a in self.runner[2:]) else None


# A translation unit need not call all of the small functions that several of them have; declarations of solvers are taken from
# their definitions, for the units that call them alone.
UNITS = ("-Wno-unused-function", "-Wno-unused-const-variable", "-Wno-missing-prototypes")
ELF, MACH_O, PE = b"\x7fELF", b"\xcf\xfa\xed\xfe", b"MZ"
HERE = sys.platform == "linux" and os.uname().machine == "x86_64"
TARGETS = {target.name: target for target in [
    Target("x86_64-linux-musl", ELF, ".so", () if HERE else None),
    Target("aarch64-linux-gnu", ELF, ".so", ("qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"), True, True),
    Target("arm-linux-gnueabihf", ELF, ".so", ("qemu-arm", "-L", "/usr/arm-linux-gnueabihf")),
    Target("x86_64-windows-gnu", PE, ".dll", ("wine",)),
    Target("aarch64-macos", MACH_O, ".dylib"),
    Target("x86_64-macos", MACH_O, ".dylib")]}


@pytest.fixture(scope="module", params=MECHANISMS)
def mechanism(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Written:
    return written(request.param, tmp_path_factory.mktemp(request.param))


def compiled(target: Target, made: Path, *arguments: object) -> Path:
    """A file made by zig for a target; a warning is a failure."""
    command = [sys.executable, "-m", "ziglang", "cc", "-target", target.name, *LANGUAGE, "-O2", "-fno-sanitize=undefined",
               *WARNINGS, "-Werror", "-o", made, *arguments]
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    assert done.returncode == 0 and "warning" not in done.stderr, done.stderr
    return made


def output(runner: list[str], program: Path) -> str:
    done = subprocess.run([*runner, program], capture_output=True, text=True, env={**os.environ, "WINEDEBUG": "-all"})
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr
    return done.stdout


def numbers(bits: str) -> np.ndarray:
    """Output of a program of a trajectory, as numbers."""
    words = [line.split()[-1] for line in bits.splitlines() if not line.startswith("status")]
    return np.array([int(word, 16) for word in words], dtype=np.uint64).view(float)


@pytest.mark.parametrize("name", TARGETS)
def test_shared_libraries(name: str, mechanism: Written, tmp_path: Path) -> None:
    """Libraries of the written file, and of the translation units that a module is compiled from."""
    target = TARGETS[name]
    shared = ["-shared", *([] if "windows" in name else ["-fPIC"])]
    library = compiled(target, tmp_path / f"whole{target.suffix}", *shared, mechanism.source)
    assert library.read_bytes().startswith(target.magic)
    assert f"{mechanism.name}_rhs".encode() in library.read_bytes()
    divided = compiled(target, tmp_path / f"divided{target.suffix}", *shared, *UNITS, *mechanism.units)
    assert divided.read_bytes().startswith(target.magic)


@pytest.mark.parametrize("name", TARGETS)
@pytest.mark.parametrize("part", ["moreau", "hybrid"])
def test_what_is_compiled_once(name: str, part: str, tmp_path: Path) -> None:
    """The libraries of the runtime that serve every mechanism."""
    target = TARGETS[name]
    source = tmp_path / f"{part}.c"
    source.write_text(shared.text(part), encoding="utf-8")
    options = ["-shared", *([] if "windows" in name else ["-fPIC"]), *UNITS]
    assert compiled(target, tmp_path / f"{part}{target.suffix}", *options, source).read_bytes().startswith(target.magic)


@pytest.mark.parametrize("name", TARGETS)
def test_programs(name: str, mechanism: Written, tmp_path: Path) -> None:
    """Self-test and trajectory are compiled; where they run, results agree and the bits are those of this machine's compiler."""
    target, suffix = TARGETS[name], ".exe" if "windows" in name else ""
    selftest = compiled(target, tmp_path / f"selftest{suffix}", *mechanism.selftest())
    trajectory = compiled(target, tmp_path / f"trajectory{suffix}", *mechanism.trajectory())
    runner = target.command()
    if runner is None:
        return
    assert output(runner, selftest).replace("\r", "").endswith("all results agree\n")
    cc = shutil.which("gcc") or shutil.which("cc")
    if not HERE or cc is None:
        return
    subprocess.run([cc, *LANGUAGE, "-O2", *(["-mfma", "-mavx2"] if target.fused else []), *mechanism.trajectory(), "-o",
                    tmp_path / "here", "-lm"], check=True)
    here, there = output([], tmp_path / "here"), output(runner, trajectory).replace("\r", "")
    assert len(here.splitlines()) > 200
    if target.sines or not mechanism.calls_sines:
        assert there == here
    else:
        np.testing.assert_allclose(numbers(there), numbers(here), rtol=1e-9, atol=1e-12)
