"""The layout of the C of this repository, and what compilers warn of in it and in written mechanisms, with the tools here."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from symdyn import systems
from symdyn.backend.methods import METHODS
from symdyn.formulation.equations import Equations
from symdyn.pipeline import emit, write_source
from symdyn.runtime.building import shared
from symdyn.runtime.building.compiler import Compiler, probe
from tests.backend.c_warnings import CHECKS, LANGUAGE, faults_of
from tests.helpers import swept

ROOT = Path(__file__).parents[2]
GCC = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-Wstrict-prototypes",
       "-Wmissing-prototypes", "-Wcast-qual", "-Wcast-align", "-Wpointer-arith", "-Wundef", "-Wvla", "-Wwrite-strings",
       "-Wlogical-op", "-Wduplicated-cond", "-Werror")


def formatter() -> str | None:
    """The clang-format of the version that .clang-format names: of this environment, or on PATH."""
    wanted = re.search(r"clang-format (\d+)", (ROOT / ".clang-format").read_text(encoding="utf-8"))
    assert wanted is not None
    for folder in (str(Path(sys.executable).parent), None):
        program = shutil.which("clang-format", path=folder)
        if program and f"version {wanted[1]}." in subprocess.check_output([program, "--version"], text=True):
            return program
    return None


def test_c_is_laid_out_as_the_formatter_does() -> None:
    """All that is written by hand: the runtime, FMUs, firmware, and the C of tests."""
    program = formatter()
    if program is None:
        pytest.skip("no clang-format of this version")
    files = [path for folder in ("templates", "tests") for path in sorted((ROOT / folder).rglob("*.[ch]"))]
    assert {"events.h", "instance.h", "clock.h", "jax_rows.c", "trajectory.c"} <= {path.name for path in files}
    done = subprocess.run([program, "--dry-run", "-Werror", *files], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def real_gcc() -> tuple[str, ...]:
    """The command of gcc; empty where there is none, or where a clang has its name."""
    found = probe(("gcc",), os.environ.get("PATH"))
    return found.command if isinstance(found, Compiler) and found.kind == "gcc" else ()


def mechanism(name: str) -> Equations:
    system = systems.get(name)
    return system.augmented() if name in systems.names(constrained=True) else system.embedding()


@pytest.mark.parametrize(("name", "method", "batch"), [
    *swept([("four_bar", method, False) for method in METHODS],
           *(("four_bar", method, False) for method in ("dop853", "radau"))),
    ("pendulum", "taylor", False), ("double_pendulum", "dop853", True)])
def test_written_mechanisms_are_compiled_without_a_warning(name: str, method: str, batch: bool, tmp_path: Path) -> None:
    write_source(emit(mechanism(name), "c", method=method, batch=batch), tmp_path)
    for source in sorted(tmp_path.glob("*.c")):
        # Clang-tidy sees the parts of the runtime in test_runtime_in_c.py; of Taylor series there is generated code besides.
        assert faults_of(source, tidy=method == "taylor", checks=f"{CHECKS},-clang-analyzer-*") == ""
        if gcc := real_gcc():
            done = subprocess.run([*gcc, *LANGUAGE, *GCC, "-fsyntax-only", str(source)], capture_output=True, text=True)
            assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(("name", "analyzed"), [
    ("moreau", False), ("hybrid", False), *swept([("moreau", True), ("hybrid", True)])])
def test_what_is_compiled_once_for_all_mechanisms_has_no_warning(name: str, analyzed: bool, tmp_path: Path) -> None:
    """As the library of it is made, with declarations from the text alone, which newer compilers insist on; the analyzer of clang
    takes five seconds for each."""
    source = tmp_path / f"{name}.c"
    source.write_text(shared.text(name), encoding="utf-8")
    # Small functions of the prelude are for all files; not each calls all of them.
    checks = CHECKS if analyzed else f"{CHECKS},-clang-analyzer-*"
    assert faults_of(source, "-Wno-unused-function", checks=checks) == ""
    if gcc := real_gcc():
        done = subprocess.run([*gcc, *LANGUAGE, *GCC, "-Werror=implicit-function-declaration", "-fsyntax-only", str(source)],
                              capture_output=True, text=True)
        assert done.returncode == 0, done.stderr


FAULTY = """int half(int a);
int half(int a) {
    int b;
    return a / 2, b;
}
"""


@pytest.mark.skipif(not shutil.which("clang"), reason="no clang")
def test_faults_are_reported(tmp_path: Path) -> None:
    (tmp_path / "faulty.c").write_text(FAULTY)
    assert "[-Wcomma]" in faults_of(tmp_path / "faulty.c") and "[-Wuninitialized]" in faults_of(tmp_path / "faulty.c")
    assert faults_of(tmp_path / "no_such_file.c") != ""


@pytest.mark.skipif(not shutil.which("clang-tidy"), reason="no clang-tidy")
def test_faults_of_the_analyzer_are_reported(tmp_path: Path) -> None:
    (tmp_path / "faulty.c").write_text("int of(int a);\nint of(int a) {\n    int *p = a > 3 ? &a : 0;\n    return *p;\n}\n")
    assert "clang-analyzer-core.NullDereference" in faults_of(tmp_path / "faulty.c")
