"""The C under the sanitizers of addresses and of undefined behaviour, by gcc and by clang: written mechanisms, and the tests of
the runtime's parts.

    python -m pytest tests/checks/sanitizers.py
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.checks.programs import written

ROOT = Path(__file__).parents[2]
SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g")
# Name of the library of the address sanitizer, and the option by which a compiler links it as a shared one.
COMPILERS = {"gcc": ("libasan.so", ()), "clang": ("libclang_rt.asan-x86_64.so", ("-shared-libasan",))}
OPTIONS = ("-std=c99", "-O1", "-ffp-contract=off", "-DEXACT")


def runs_sanitized(compiler: str, folder: Path) -> bool:
    """Whether programs that a compiler links with the sanitizers run."""
    if not shutil.which(compiler):
        return False
    (folder / "empty.c").write_text("int main(void) { return 0; }\n")
    build = [compiler, *SANITIZED, "-o", folder / "empty", folder / "empty.c"]
    return all(subprocess.run(command, capture_output=True).returncode == 0 for command in (build, [folder / "empty"]))


@pytest.fixture(params=COMPILERS)
def compiler(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    if not runs_sanitized(request.param, tmp_path):
        pytest.skip(f"no {request.param} with sanitizers")
    return str(request.param)


def output(*command: object) -> str:
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr
    return done.stdout


def test_a_fault_ends_the_program(compiler: str, tmp_path: Path) -> None:
    (tmp_path / "faulty.c").write_text("int main(int n, char **a) { int at[2] = {0}; (void)a; return at[n + 1]; }\n")
    output(compiler, *SANITIZED, "-o", tmp_path / "faulty", tmp_path / "faulty.c")
    done = subprocess.run([tmp_path / "faulty"], capture_output=True, text=True)
    assert done.returncode != 0 and "index 2 out of bounds" in done.stderr


@pytest.mark.parametrize(("name", "method"), [
    ("double_pendulum", "dop853"), ("double_pendulum", "taylor"), ("four_bar", "dop853"), ("four_bar", "radau"),
    ("four_bar", "gauss")])
def test_written_mechanisms(name: str, method: str, compiler: str, tmp_path: Path) -> None:
    """Trajectories keep every bit, self-tests agree, and no sanitizer finds anything."""
    mechanism = written(name, tmp_path, method)
    bits = {}
    for program, options in (("plain", ()), ("sanitized", SANITIZED)):
        output(compiler, *OPTIONS, *options, *mechanism.trajectory(), "-o", tmp_path / program, "-lm")
        bits[program] = output(tmp_path / program)
    assert bits["plain"] == bits["sanitized"] and len(bits["plain"].splitlines()) > 400
    output(compiler, *OPTIONS, *SANITIZED, *mechanism.selftest(), "-o", tmp_path / "selftest", "-lm")
    assert output(tmp_path / "selftest").endswith("all results agree\n")


@pytest.mark.parametrize("tests", ["backend/test_runtime_in_c.py", "backend/test_cones.py", "runtime/test_hybrid_motion.py",
                                   "runtime/test_time_stepping.py", "runtime/test_shocks_of_groups.py"])
def test_parts_of_the_runtime(tests: str, compiler: str) -> None:
    """Files of tests in a process that has the sanitizer's library loaded."""
    library, shared = COMPILERS[compiler]
    path = output(compiler, f"-print-file-name={library}").strip()
    if not Path(path).is_absolute():
        pytest.skip(f"no {library}")
    # Libraries in C++ throw exceptions, which the sanitizer looks for in what is loaded with it.
    loaded = f"{path} {output('gcc', '-print-file-name=libstdc++.so.6').strip()}"
    environment = {**os.environ, "LD_PRELOAD": loaded, "ASAN_OPTIONS": "detect_leaks=0",
                   "SYMDYN_CC": " ".join([compiler, *SANITIZED, *shared])}
    done = subprocess.run([sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", f"tests/{tests}"],
                          cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
