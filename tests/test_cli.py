"""The command line: what it prints, what it writes, what it says when it cannot, and how fast it starts."""

from __future__ import annotations

import csv
import io
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn
from symdyn import systems
from symdyn.cli import main
from symdyn.runtime.building import recall
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.module import Module

ROOT = str(Path(symdyn.__file__).parents[1])

SPRING = """
import symdyn as sd


def system(count=1, stiff=False):
    q = sd.coordinates("r")
    m, k = sd.parameters("m k")
    s = sd.System(f"spring_{count}", planar=True)
    body = s.add_body("body", mass=m)
    joint = s.add_joint(sd.Prismatic("rail", s.ground, body, q, axis=[1, 0]))
    s.add_joint_force(joint, -k * q)
    s.defaults = {m: 1.0, k: 100.0 if stiff else 4.0}
    s.initial = {q: 1.0}
    return s
"""


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder and a cache of its own for each test."""
    monkeypatch.setenv("SYMDYN_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*arguments: str, before: str = "", after: str = "", **environment: str) -> subprocess.CompletedProcess[str]:
    """The program in a process of its own, with statements before and after it."""
    code = f"import sys; {before}\nfrom symdyn.cli import main\ncode = main({list(arguments)!r})\n{after}\nsys.exit(code)"
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                          env={**os.environ, "PYTHONPATH": ROOT, **environment})


def refused(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 2) -> str:
    """Message of a command that fails; never a traceback of symdyn."""
    try:
        assert main(arguments) == code
    except SystemExit as stop:  # argparse's own refusals
        assert stop.code == code
    said = capsys.readouterr().err
    assert "symdyn" in said and "Traceback" not in said
    return said


# -- help and list


def test_help_and_list_come_without_sympy() -> None:
    after = "print([m for m in ('sympy', 'numpy', 'scipy', 'matplotlib') if m in sys.modules])"
    helped = subprocess.run([sys.executable, "-c", f"import sys, atexit; atexit.register(lambda: {after})\n"
                             "from symdyn.cli import main; main(['--help'])"],
                            capture_output=True, text=True, env={**os.environ, "PYTHONPATH": ROOT})
    assert helped.returncode == 0 and helped.stdout.splitlines()[-1] == "[]"
    assert all(f" {c} " in helped.stdout for c in ("list", "derive", "generate", "simulate", "report", "diagnose", "bench",
                                                      "demo"))
    listed = run("list", after=after)
    assert listed.returncode == 0 and listed.stdout.splitlines()[-1] == "[]"


def test_list_reports_what_each_system_is_and_takes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines if not line.startswith(" ")] == systems.names()
    assert next(line for line in lines if line.startswith("pendulum ")).endswith("A point mass on a massless rod.")
    puma = next(k for k, line in enumerate(lines) if line.startswith("puma560 "))
    assert "convention=standard general=False motors=False torques=False" in lines[puma + 1]


def test_the_package_runs_as_a_program() -> None:
    done = subprocess.run([sys.executable, "-m", "symdyn", "list"], capture_output=True, text=True,
                          env={**os.environ, "PYTHONPATH": ROOT})
    assert done.returncode == 0 and "double_pendulum" in done.stdout


@pytest.mark.skipif(sys.platform == "win32", reason="pipes break otherwise there")
def test_a_reader_that_had_enough_is_no_fault() -> None:
    with subprocess.Popen([sys.executable, "-m", "symdyn", "list"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          env={**os.environ, "PYTHONPATH": ROOT}) as process:
        assert process.stdout is not None and process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b""


# -- derive


def test_derive_prints_the_equations(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["derive", "pendulum"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"M_tilde =\n.*\n?.*l.*m", said) and "k_tilde =\n[0]" in said and "F_tilde =" in said
    assert "q1 [rad]" in said and "sin(q" in said


def test_derive_prints_latex_and_single_quantities(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["derive", "pendulum", "--latex", "--quantity", "M_tilde", "Jdot"]) == 0
    first, second = capsys.readouterr().out.splitlines()
    assert first.startswith(r"\tilde{\mathbf{M}} = \left[\begin{matrix}") and r"l^{2}" in first
    assert second.startswith(r"\dot{\mathbf{J}} = ") and r"\dot{q}_{1}" in second
    assert main(["derive", "pendulum", "--no-simplify", "--quantity", "F_tilde"]) == 0
    assert "F_tilde =" in capsys.readouterr().out
    assert main(["derive", "two_link_arm", "--latex", "--shorthand", "--intermediates", "--quantity", "k_tilde"]) == 0
    said = capsys.readouterr().out
    assert r"\omega_{2,z} &= " in said and r"s_{2} = \sin" in said


def test_derive_prints_ascii_where_nothing_else_can_be_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(shown, encoding="ascii", write_through=True))
    assert main(["derive", "pendulum", "--quantity", "J"]) == 0
    assert b"cos(q1)" in shown.getvalue()


def test_derive_counts_what_nobody_can_read(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["derive", "puma560", "--quantity", "k_tilde"]) == 0
    said = capsys.readouterr().out
    written, generated = map(int, re.search(  # type: ignore[union-attr]
        r"k_tilde \(6\): (\d+) operations written out, (\d+) in generated code; --force", said).groups())
    assert written > 10_000 and generated < 1000 and len(said) < 2000


def test_the_count_is_that_of_the_expressions(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    import sympy as sp

    monkeypatch.setattr("symdyn.cli.derive.READABLE", 10)
    main(["derive", "double_pendulum", "--quantity", "F_tilde"])
    said = int(re.search(r"(\d+) operations written out", capsys.readouterr().out)[1])  # type: ignore[index]
    counted = sp.count_ops(systems.double_pendulum().embedding().explicit("F_tilde", simplify=False))
    assert 0.7 * counted <= said <= 1.3 * counted
    assert main(["derive", "double_pendulum", "--quantity", "F_tilde", "--force"]) == 0
    assert "F_tilde =" in capsys.readouterr().out


# -- generate


def test_generated_files_build_without_warnings_and_check_themselves(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["generate", "cart_pole"]) == 0
    folder = here / "generated" / "cart_pole"
    said = capsys.readouterr().out
    assert {p.name for p in folder.iterdir()} == {"cart_pole.c", "cart_pole.h", "main.c", "cart_pole.py"}
    assert all(str(p.relative_to(here)) in said for p in folder.iterdir())
    assert re.search(r"operations: rhs \d+, mass_matrix \d+", said) and "No compiler was needed" in said
    check = subprocess.run([sys.executable, folder / "cart_pole.py", "--selftest"], capture_output=True, text=True)
    assert check.returncode == 0, check.stdout + check.stderr
    if shutil.which("gcc") is None:
        pytest.skip("no gcc here")
    build = subprocess.run(["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-o", "check", "main.c",
                            "cart_pole.c", "-lm"], cwd=folder, capture_output=True, text=True)
    assert build.returncode == 0, build.stderr
    assert subprocess.run([folder / "check"], capture_output=True).returncode == 0


def test_generate_takes_backends_functions_templates_and_a_folder(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    own = here / "own" / "words"
    own.mkdir(parents=True)
    shutil.copy(Path(ROOT, "templates", "c", "dialect.toml"), own)
    text = (own / "dialect.toml").read_text(encoding="utf-8")
    own.joinpath("dialect.toml").write_text(re.sub(r"\[files\].*?\n\n", '[files]\n"t.jinja" = "{name}.txt"\n\n', text,
                                                   flags=re.S), encoding="utf-8")
    own.joinpath("t.jinja").write_text("I am {{ model.name }}\n", encoding="utf-8")
    assert main(["generate", "pendulum", "--backend", "numpy", "--backend", "words", "--templates", "own", "--functions",
                 "rhs", "--output", "out"]) == 0
    assert {p.name for p in (here / "out").iterdir()} == {"pendulum.py", "pendulum.txt"}
    assert (here / "out" / "pendulum.txt").read_text(encoding="utf-8") == "I am pendulum\n"
    assert "operations: rhs 4\n" in capsys.readouterr().out


# -- simulate


def test_simulate_saves_data_and_picture(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("matplotlib")
    assert main(["simulate", "double_pendulum", "--t", "1", "1.5", "--set", "m1=2", "g=1.6", "--q", "q1=0.5", "--u",
                 "q2_dot=-1", "--rtol", "1e-9", "--atol", "1e-10", "--gif"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"double_pendulum: dop853 on compiled C|double_pendulum: DOP853 on NumPy", said)
    assert re.search(r"\d+ steps, \d+ evaluations", said) and "at the end: q1 = " in said
    assert float(re.search(r"energy is kept to (\S+) ", said)[1]) < 1e-6  # type: ignore[index]
    folder = here / "generated" / "double_pendulum"
    assert {p.name for p in folder.iterdir()} == {f"double_pendulum.{e}" for e in ("npz", "csv", "png", "gif")}
    with np.load(folder / "double_pendulum.npz") as data:
        assert data["t"][0] == 1.0 and data["t"][-1] == 1.5
        assert data["q"][0].tolist() == [0.5, 0.1] and data["u"][0].tolist() == [0.0, -1.0]
        assert {2.0, 1.6} <= set(data["params"].tolist())
        last = data["x"][-1]
    with (folder / "double_pendulum.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["t", "q1", "q2", "q1_dot", "q2_dot"] and [float(v) for v in rows[-1][1:]] == last.tolist()
    assert (folder / "double_pendulum.png").read_bytes().startswith(b"\x89PNG")


def test_simulate_reports_energy_changes_and_takes_inputs(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "cart_pole", "--t", "1", "--input", "F=3", "--no-picture"]) == 0
    assert re.search(r"energy goes from 0\.48\S* J to \S+ J by loads", capsys.readouterr().out)


def test_motors_that_are_off_keep_the_energy(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "two_link_arm", "--t", "1", "--no-picture", "--output", "out"]) == 0
    assert float(re.search(r"energy is kept to (\S+) ", capsys.readouterr().out)[1]) < 1e-6  # type: ignore[index]
    assert (here / "out" / "two_link_arm.npz").is_file()


def test_the_second_run_needs_no_sympy_and_gives_the_same(here: Path) -> None:
    """Nor does it need what draws on a screen, for its picture."""
    pytest.importorskip("matplotlib")
    assert main(["simulate", "double_pendulum", "--output", "first"]) == 0
    after = "print([m for m in ('sympy', 'matplotlib.pyplot', 'scipy') if m in sys.modules], 'matplotlib' in sys.modules)"
    second = run("simulate", "double_pendulum", "--output", "second", after=after)
    assert second.returncode == 0, second.stderr
    assert second.stdout.splitlines()[-1] == ("[] True" if find_compiler() else "['scipy'] True")
    with np.load(here / "first" / "double_pendulum.npz") as a, np.load(here / "second" / "double_pendulum.npz") as b:
        assert set(a) == set(b) and all(np.array_equal(a[k], b[k]) for k in a)


def test_without_a_compiler_numpy_takes_over_and_reports_it(monkeypatch: pytest.MonkeyPatch,
                                                            capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("SYMDYN_CC", "none")
    for _ in range(2):
        assert main(["simulate", "pendulum", "--t", "0.5", "--no-picture"]) == 0
        said = capsys.readouterr().out
        assert "pendulum: DOP853 on NumPy to t = 0.5 s\n  No C compiler is used, as SYMDYN_CC='none' asks" in said
    assert "SYMDYN_CC='none'" in refused(capsys, "simulate", "pendulum", "--backend", "c", code=1)


def test_an_early_stop_has_its_code_and_keeps_the_data(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "fall.py").write_text(SPRING.replace("-k * q)", "-1 / q**2)").replace("m: 1.0, k: 100.0 if stiff else 4.0",
                                                                                   "m: 1.0"), encoding="utf-8")
    assert main(["simulate", "fall.py", "--no-picture", "--output", "out"]) == 3
    said = capsys.readouterr()
    assert re.search(r"symdyn: spring_1: stopped at t = 1\.11\d+: .*; the state there: r = ", said.err)
    assert "stopped early" in said.out
    with np.load(here / "out" / "spring_1.npz") as data:
        assert 100 < len(data["t"]) < 120


def test_ctrl_c_saves_what_there_is(here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    from scipy.integrate import DOP853

    steps = 0
    real = DOP853.step

    def step(solver: Any) -> Any:
        nonlocal steps
        steps += 1
        if steps > 30:
            raise KeyboardInterrupt
        return real(solver)

    monkeypatch.setattr(DOP853, "step", step)
    assert main(["simulate", "pendulum", "--backend", "numpy", "--no-picture", "--output", "out"]) == 130
    assert "interrupted" in capsys.readouterr().err
    with np.load(here / "out" / "pendulum.npz") as data:
        assert 10 < len(data["t"]) < 1001 and not data["about"].item().count('"success": true')


def test_ctrl_c_elsewhere_ends_with_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def interrupted(name: str) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(systems, "get", interrupted)
    assert refused(capsys, "derive", "pendulum", code=130) == "symdyn: interrupted\n"


# -- what is remembered


def test_a_record_lasts_until_symdyn_changes(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []
    real = systems.get

    def get(name: str, **options: Any) -> Any:
        made.append(name)
        return real(name, **options)

    monkeypatch.setattr(systems, "get", get)

    def value(**options: Any) -> np.ndarray:
        return recall.recall("n_link_pendulum", options, "numpy").rhs(0.0, [0.3] * 2 * options.get("n", 5))

    first = value(n=2)
    assert np.array_equal(value(n=2), first) and len(made) == 1
    assert len(value(n=3)) == 6 and len(made) == 2
    module = recall.recall("n_link_pendulum", {"n": 2}, "numpy")
    assert module.energy([0.1, 0.2], [0.0, 0.0]).shape == (2,) and len(made) == 3
    for path in (here / "cache").glob("*.json"):
        path.write_text(path.read_text(encoding="utf-8")[:-20], encoding="utf-8")
    assert np.array_equal(value(n=2), first) and len(made) == 4
    monkeypatch.setattr(symdyn, "__version__", "another")
    assert np.array_equal(value(n=2), first) and len(made) == 5


def test_a_remembered_module_is_whole(here: Path) -> None:
    for _ in range(2):
        module = recall.recall("cart_pole", {}, "numpy")
        whole = systems.cart_pole().compile("numpy")
        assert isinstance(module, Module) and module.functions == whole.functions
        assert module.metadata.units == whole.metadata.units
        assert np.array_equal(module.jacobian(0.0, [0.1] * 4, inputs=[1.0]).x, whole.jacobian(0.0, [0.1] * 4,
                                                                                             inputs=[1.0]).x)
        assert [p.name for p in module.write(here / "out")] == [p.name for p in whole.write(here / "out")]
        assert str(module.report()) == str(whole.report())


# -- report and demo


def test_report_counts_and_proves(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", "pendulum"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"rhs +\d+", said) and "verified" in said
    assert main(["report", "pendulum", "--no-verify"]) == 0
    assert "verified" not in capsys.readouterr().out


def test_demo_and_simulate_run_with_neither_compiler_nor_matplotlib(here: Path) -> None:
    """Data are saved, and the way to pictures is reported."""
    done = run("demo", before="sys.modules['matplotlib'] = None", SYMDYN_CC="none",
               after="code += main(['simulate', 'pendulum', '--t', '1', '--gif', '--output', 'out'])")
    assert done.returncode == 0 and not done.stderr, done.stderr
    demo, simulated = done.stdout.split("\npendulum: ")
    stages = re.findall(r"^(derive|generate|compile|simulate|save and draw)$", demo, re.M)
    assert stages == ["derive", "generate", "compile", "simulate", "save and draw"]
    assert len(re.findall(r"^  \d+\.\d\d s$", demo, re.M)) == 5
    assert "NumPy. No C compiler is used" in demo and "no picture" in demo
    assert (here / "generated" / "puma560_standard" / "puma560_standard.npz").is_file()
    assert "no picture: pictures need matplotlib: pip install 'symdyn[plot]'" in simulated
    assert {p.name for p in (here / "out").iterdir()} == {"pendulum.npz", "pendulum.csv"}


def test_demo_does_the_main_job(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("matplotlib")
    if find_compiler() is None:
        pytest.skip("no compiler here")
    assert main(["demo", "--output", "out"]) == 0
    assert "on compiled C" in capsys.readouterr().out
    assert {p.suffix for p in (here / "out").iterdir()} == {".c", ".h", ".py", ".npz", ".csv", ".png"}


# -- the user's files


def test_a_users_file_is_a_system_with_options(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "mine.py").write_text(SPRING, encoding="utf-8")
    assert main(["simulate", "mine.py", "--option", "count=2", "stiff=True", "--t", "1", "--no-picture"]) == 0
    assert "spring_2: " in capsys.readouterr().out
    with np.load(here / "generated" / "spring_2" / "spring_2.npz") as data:
        assert np.allclose(data["q"][-1], np.cos(10.0), atol=1e-6)
    assert "has no option 'size'; it has count=1, stiff=False" in refused(capsys, "derive", "mine.py", "--option", "size=1")


FAULTY = {
    "division": ("def system():\n    return 1 / 0\n", ["ended with ZeroDivisionError", "line 2, in system", "return 1 / 0"]),
    "syntax": ("def system(:\n", ["ended with SyntaxError", "line 1", "def system(:"]),
    "missing": ("import no_such_module\n", ["ended with ModuleNotFoundError", "line 1", "No module named"]),
    "exit": ("import sys\nsys.exit(4)\n", ["ended with SystemExit", "line 2"]),
    "nothing": ("x = 1\n", ["nothing.py defines no function system(); add one"]),
    "wrong": ("def system():\n    return 5\n", ["system() of wrong.py returned 5; it must return a symdyn System"]),
    "needs": ("def system(n):\n    return n\n", ["needs --option n=..."]),
    "model": ("import symdyn as sd\ndef system():\n    s = sd.System('a', gravity=[0, -9.81])\n    s.add_body('b')\n"
              "    return s\n", ["symdyn: body 'b' has no joint"]),
}


@pytest.mark.parametrize("name", FAULTY)
def test_faults_of_a_users_file_are_reported_as_its_own(name: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, expected = FAULTY[name]
    (here / f"{name}.py").write_text(text, encoding="utf-8")
    said = refused(capsys, "derive", f"{name}.py")
    assert all(part in said for part in expected) and str(Path("symdyn", "cli")) not in said


RAISING = """
import symdyn as sd


def push(v):
    if np.any(np.abs(v) > 1.5):
        raise RuntimeError("the table ends at 1.5 m/s")
    return 0.5 * v


def system(start=0.0):
    x = sd.coordinates("x")
    s = sd.System("falling", gravity=[0, -10])
    body = s.add_body("body", mass=1)
    s.add_joint(sd.Prismatic("way", s.ground, body, x, axis=[0, 1]))
    s.add_joint_force("way", sd.External("push", ["v"], python=push)(x.dot))
    s.initial = {x.dot: start}
    return s
"""


def test_what_a_users_function_raises_is_reported_with_its_line(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "mine.py").write_text(RAISING, encoding="utf-8")
    for start, t in (("0.0", "0.1"), ("2.0", "0: ")):
        told = refused(capsys, "simulate", "mine.py", "--backend", "numpy", "--no-picture", "--option", f"start={start}", code=3)
        assert f"symdyn: falling: stopped at t = {t}" in told
        assert "the function push(v) raised RuntimeError: the table ends at 1.5 m/s" in told
        assert told.endswith('\n  mine.py, line 7: raise RuntimeError("the table ends at 1.5 m/s")\n')
    assert (here / "generated" / "falling" / "falling.npz").is_file()


# -- what is asked wrongly


# -- closed loops and constraints


def test_derive_prints_constraints(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["derive", "pendulum_absolute"]) == 0
    said = capsys.readouterr().out
    assert "M_tilde u_dot + k_tilde + C_r^T lam = F_tilde, C_r u_dot = F_d" in said and "constraints: rod" in said
    assert all(f"\n{name} =" in said for name in ("M_tilde", "k_tilde", "F_tilde", "C_r", "F_d", "C"))
    assert main(["derive", "pendulum", "--coordinates", "absolute", "--quantity", "C"]) == 0
    assert "constraints: pivot_x, pivot_y" in capsys.readouterr().out
    assert main(["derive", "pendulum", "--formulation", "augmented", "--latex", "--quantity", "C_dot", "M_tilde"]) == 0
    assert r"\dot{\mathbf{C}} = " in capsys.readouterr().out


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
def test_simulate_reports_how_constraints_are_kept(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kept = {}
    for way in ("projection", "baumgarte", "none"):
        assert main(["simulate", "four_bar", "--t", "2", "--no-picture", "--stabilization", way, "--rtol", "1e-6"]) == 0
        said = capsys.readouterr().out
        kept[way] = float(re.search(r"constraints are kept to (\S+) of the mechanism's length", said).group(1))  # type: ignore[union-attr]
        assert ("projections changed" in said) == (way == "projection")
    assert kept["projection"] < 1e-13 < kept["none"]


@pytest.mark.parametrize("kept", [[], ["q1", "q1_dot"]])
def test_simulate_begins_with_a_consistent_state(kept: list[str], here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["simulate", "four_bar", "--t", "0.1", "--no-picture", "--backend", "numpy", "--q", "q1=0.5", "--u", "q1_dot=1"]
    told = refused(capsys, *arguments)
    assert "the initial positions violate " in told and "begin with the nearest consistent state by --consistent" in told
    assert "module.consistent" not in told
    assert main([*arguments, "--consistent", *(["--keep", *kept] if kept else [])]) == 0
    said = capsys.readouterr().out
    assert "four_bar: the start is made consistent: " in said and "q2 from " in said and "q2_dot from 0 to " in said
    assert ("q1 from 0.5 to" in said) == ("q1_dot from 1 to" in said) == (not kept)


def test_simulate_reports_that_a_start_is_consistent(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["simulate", "four_bar", "--t", "0.1", "--no-picture", "--backend", "numpy", "--consistent"]
    assert main([*arguments, "--stabilization", "baumgarte=20"]) == 0
    assert "four_bar: the start is consistent as it is" in capsys.readouterr().out


def test_coordinates_are_remembered_apart(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["simulate", "four_bar", "--t", "0.1", "--no-picture", "--backend", "numpy"]
    assert main(arguments) == 0 and "q1 = " in capsys.readouterr().out
    assert main([*arguments, "--coordinates", "absolute"]) == 0 and "x_bar1 = " in capsys.readouterr().out
    assert main(arguments) == 0 and "q1 = " in capsys.readouterr().out
    assert len(list((here / "cache").rglob("four_bar-*.json"))) == 2


def test_diagnose(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diagnose", "n_four_bar", "--option", "n=2"]) == 0
    said = capsys.readouterr().out
    assert "degrees of freedom by count: 1" in said and "rank is lost" in said and "theta0 = 1.5708" in said
    assert main(["diagnose", "four_bar", "--q", "q1=0.5", "--set", "l1=0.7", "--reach", "0.2", "--coordinates", "absolute"]) == 2
    assert "there is no 'q1'" in capsys.readouterr().err
    assert main(["diagnose", "four_bar", "--q", "q1=0.5", "--set", "l1=0.7", "--reach", "0.2"]) == 0
    assert "from the one given" in capsys.readouterr().out
    (here / "spring.py").write_text(SPRING, encoding="utf-8")
    assert main(["diagnose", "spring.py"]) == 0
    assert "no loops or constraints: 1 degree of freedom" in capsys.readouterr().out


def test_report_of_constraints(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", "pendulum_absolute"]) == 0
    said = capsys.readouterr().out
    assert "augmented equations of motion" in said and "C_ddot = 0 along the motion" in said and "FAIL" not in said


@pytest.mark.parametrize("arguments, said", [
    (["derive", "four_bar", "--formulation", "recursive"], "the recursive form takes trees only"),
    (["derive", "pendulum", "--formulation", "embedding", "--coordinates", "absolute"], "they are for 'augmented' alone"),
    (["simulate", "four_bar", "--stabilization", "hope"], "invalid choice: 'hope'"),
    (["simulate", "four_bar", "--stabilization", "baumgarte=much"], "'much' is not a number"),
    (["simulate", "four_bar", "--stabilization", "baumgarte=-1"], "must be a positive number, 1/s, found -1"),
    (["simulate", "four_bar", "--stabilization", "none=1"], "invalid choice: 'none=1'"),
    (["simulate", "four_bar", "--keep", "q1"], "--keep goes with --consistent"),
    (["simulate", "four_bar", "--consistent", "--keep", "q9"], "keep names q9; there are q1"),
    (["derive", "zzzz"], "no system 'zzzz'; it has pendulum"),
    (["simulate", "four_bar", "--method", "BDF", "--stabilization", "projection"], "builds on earlier steps"),
    (["diagnose", "four_bar", "--reach", "-1"], "--reach takes a distance from 0 on"),
    (["derive", "pendulm"], "no system 'pendulm'; did you mean pendulum"),
    (["derive", "absent.py"], "there is no file absent.py"),
    (["derive", "pendulum", "--option", "n=5"], "pendulum has no option 'n'; it has none"),
    (["simulate", "n_link_pendulum", "--option", "n=five"], "option n of n_link_pendulum must be of the kind int, such as 5"),
    (["derive", "n_link_pendulum", "--option", "n=__import__('os')"], "must be of the kind int"),
    (["derive", "n_link_pendulum", "--option", "n=0"], "was asked for 0 rods"),
    (["derive", "n_link_pendulum", "--option", "n"], "--option 'n': write name=value"),
    (["derive", "puma560", "--option", "convention=mine"], "puma560 has no convention 'mine'"),
    (["derive", "pendulum", "--quantity", "N_tilde"], "no quantity 'N_tilde'; it has"),
    (["simulat", "pendulum"], "there is no command 'simulat'; did you mean simulate"),
    (["xyz"], "there is no command 'xyz'; there are list, schema, derive,"),
    (["export", "pendulum"], "nothing to export: pass one of --casadi, --jax, --torch"),
    (["generate", "pendulum", "--backend", "cobol"], "no backend 'cobol'; there are c, firmware, fortran, javascript"),
    (["generate", "pendulum", "--functions", "lhs"], "no function lhs; did you mean rhs? There are rhs"),
    (["generate", "pendulum", "--templates", "absent"], "template folder absent does not exist"),
    (["simulate", "pendulum", "--set", "mm=1"], "there is no 'mm', did you mean m?"),
    (["simulate", "pendulum", "--set", "m=heavy"], "--set m=heavy: 'heavy' is not a number"),
    (["simulate", "pendulum", "--set", "m=nan"], "must be finite, found m = nan"),
    (["simulate", "pendulum", "--set", "m=1", "--set", "m=2"], "--set m is given twice"),
    (["simulate", "pendulum", "--q", "q2=1"], "there is no 'q2'"),
    (["simulate", "pendulum", "--input", "F=1"], "inputs were given, but the system has none"),
    (["simulate", "pendulum", "--t", "0", "1", "2"], "--t takes END or START END, found 3"),
    (["simulate", "pendulum", "--t", "inf"], "finite"),
    (["simulate", "pendulum", "--t", "soon"], "invalid float value: 'soon'"),
    (["simulate", "pendulum", "--rtol=-1"], "tolerances must be positive"),
    (["simulate", "pendulum", "--method", "euler"], "no method 'euler'"),
    (["simulate", "pendulum", "--backend", "numpy", "--method", "dop853"], "needs the C backend"),
    (["simulate"], "the following arguments are required: NAME"),
    ([], "the following arguments are required: COMMAND"),
])
def test_wrong_arguments_are_reported(arguments: list[str], said: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert said in refused(capsys, *arguments)
    assert not list(here.rglob("*.npz"))


def test_an_unusable_folder_or_compiler_is_reported(here: Path, monkeypatch: pytest.MonkeyPatch,
                                                    capsys: pytest.CaptureFixture[str]) -> None:
    (here / "taken").write_text("", encoding="utf-8")
    assert "taken" in refused(capsys, "simulate", "pendulum", "--backend", "numpy", "--output", "taken", code=1)
    monkeypatch.setenv("SYMDYN_CC", "no-such-compiler")
    assert "no-such-compiler" in refused(capsys, "simulate", "pendulum", code=1)


def test_the_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["--version"])
    assert stop.value.code == 0 and capsys.readouterr().out == f"symdyn {symdyn.__version__}\n"


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shells_complete_commands(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("shtab")
    with pytest.raises(SystemExit) as ended:
        main(["--print-completion", shell])
    text = capsys.readouterr().out
    assert ended.value.code == 0 and "simulate" in text and "rtol" in text


def test_completion_without_shtab_or_of_another_shell(capsys: pytest.CaptureFixture[str],
                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("shtab")
    with pytest.raises(SystemExit):
        main(["--print-completion", "cmd"])
    assert "--print-completion: there is no shell 'cmd'; there are bash" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "shtab", None)
    with pytest.raises(SystemExit):
        main(["--print-completion", "bash"])
    assert "--print-completion needs the package shtab: pip install 'symdyn[completion]'" in capsys.readouterr().err
